"""Tables of numbers in text files: separator, decimal sign, header and encoding are found from the whole file.

Lines that are empty or begin with # are passed over. `Table.understood` says in words what was found.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

# Separators that are tried: the text between fields, and its name.
_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", " ": "spaces"}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
# Largest file that is taken for a table, bytes.
_LARGEST = 50_000_000
_MARKS = {b"\xef\xbb\xbf": "utf-8", b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


@dataclass(frozen=True)
class Table:
    """A table as text: one row a line of the file."""

    path: Path
    header: list[str] | None
    rows: list[list[str]]
    lines: list[int]  # number of the line of each row, from 1
    separator: str
    decimal: str  # "." or ","

    @classmethod
    def read(cls, path: Path) -> Self:
        """Reads a file; `InputError` where rows differ in their number of fields or there are no numbers."""
        text = _text(path)
        found = [(n, line.strip()) for n, line in enumerate(text.splitlines(), 1)]
        found = [(n, line) for n, line in found if line and not line.startswith("#")]
        if not found:
            raise InputError(f"{path} is empty; expected rows of numbers, such as -39.0;1.575")
        separator, decimal = _format(path, found)
        fields = [(n, _split(line, separator)) for n, line in found]
        header = None
        if not any(_is_number(field, decimal) for field in fields[0][1]):
            header = [field.strip('"') for field in fields.pop(0)[1]]
        if not fields:
            raise InputError(f"{path} has a header and no rows")
        columns = len(header or fields[0][1])
        for n, row in fields:
            if len(row) != columns:
                message = f"{path}, line {n}: {len(row)} fields, expected {columns} as in the first line"
                raise InputError(f"{message} (separated by {_SEPARATORS[separator]})")
        return cls(path, header, [row for _, row in fields], [n for n, _ in fields], separator, decimal)

    @property
    def understood(self) -> str:
        """Rows, columns, separator and decimal sign in words."""
        sign = {".": "decimal point", ",": "decimal comma"}[self.decimal]
        columns = "columns " + ", ".join(self.header) if self.header else f"{len(self.rows[0])} columns, no header"
        return f"{len(self.rows)} rows, {columns}, separated by {_SEPARATORS[self.separator]}, {sign}"

    def numbers(self, column: int) -> NDArray[np.float64]:
        """A column as numbers; `InputError` with the line of a field that is none."""
        values = []
        for n, row in zip(self.lines, self.rows):
            field = row[column]
            if not _is_number(field, self.decimal):
                name = repr(self.header[column]) if self.header else str(column + 1)
                sign = {".": "decimal point", ",": "decimal comma"}[self.decimal]
                raise InputError(f"{self.path}, line {n}, column {name}: {field!r} is no number (with a {sign})")
            values.append(_number(field, self.decimal))
        if not all(math.isfinite(value) for value in values):
            n = next(n for n, value in zip(self.lines, values) if not math.isfinite(value))
            raise InputError(f"{self.path}, line {n}: a number is too large")
        return np.array(values)

    def texts(self, column: int) -> list[str]:
        """A column as text."""
        return [row[column].strip().strip('"') for row in self.rows]


def _text(path: Path) -> str:
    """The text of a file, by its byte order mark, else as UTF-8 or Latin-1."""
    if not path.is_file():
        raise InputError(f"{path}: no such file" if not path.exists() else f"{path} is no regular file")
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(f"{path} is larger than {_LARGEST // 1_000_000} MB; expected a table of coordinates")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from error
    for mark, encoding in _MARKS.items():
        if data.startswith(mark):
            return data[len(mark) :].decode(encoding, errors="replace")
    if b"\0" in data:
        raise InputError(f"{path} holds bytes of zero and is no text; expected rows of numbers")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _split(line: str, separator: str) -> list[str]:
    return line.split() if separator == " " else [field.strip() for field in line.split(separator)]


def _is_number(field: str, decimal: str) -> bool:
    other = "." if decimal == "," else ","
    return other not in field and _NUMBER.fullmatch(field.replace(decimal, ".")) is not None


def _number(field: str, decimal: str) -> float:
    return float(field.replace(decimal, "."))


def _format(path: Path, lines: list[tuple[int, str]]) -> tuple[str, str]:
    """Separator and decimal sign with which most fields are numbers in rows of equal length."""
    best, found = (0, 0.0), None
    for separator in _SEPARATORS:
        for decimal in (".", ","):
            if separator == decimal:
                continue
            rows = [_split(line, separator) for _, line in lines]
            counts = [len(row) for row in rows]
            usual = max(set(counts), key=counts.count)
            regular = [row for row in rows if len(row) == usual]
            numeric = sum(sum(_is_number(field, decimal) for field in row) >= 2 for row in regular)
            numbers = sum(_is_number(field, decimal) for row in regular for field in row)
            score = (numeric, numbers / (len(regular) * usual))
            if usual >= 2 and numeric > 0 and score > best:
                best, found = score, (separator, decimal)
    if found is None:
        n, line = lines[min(1, len(lines) - 1)]
        raise InputError(
            f"{path}, line {n}: {line[:60]!r} is no row of numbers; expected at least two numbers a line, separated by "
            "semicolons, tabs, commas or spaces (with a decimal comma: by semicolons, tabs or spaces)"
        )
    return found
