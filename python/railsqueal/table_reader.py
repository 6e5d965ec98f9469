"""Tables of numbers in text files, by the same rules as the solver reads profiles and roughness
(docs/reference/tables.md).

Separator and decimal sign are found from the whole file, headings followed, numberings of rows recognised.
`Table.understood` says in words what was found.
"""

import math
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

# Separators in the order in which they are tried, each with its name.
_SEPARATORS = {";": "semicolons", "\t": "tabs", " ": "blanks", ",": "commas"}
_SIGNS = {".": "decimal point", ",": "decimal comma", "": "whole numbers"}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
# Largest file that is taken for a table, bytes.
_LARGEST = 50_000_000
_MARKS = {b"\xef\xbb\xbf": "utf-8", b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}
# Names of a numbering of the rows; the first one is that of pandas, which has none.
_INDEX = ("", "i", "index", "no", "no.", "nr", "nr.", "n", "id", "point", "#")
# Units of length, m.
_MICROMETRE = ("um", "µm", "μm", "micron", "microns", "micrometre")
_INCH = ("in", "inch", "inches")
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "nm": 1e-9} | dict.fromkeys(_INCH, 0.0254) | dict.fromkeys(_MICROMETRE, 1e-6)

_Line = tuple[int, str]


@dataclass(frozen=True)
class Heading:
    """Name of a column in lower case, and its unit where it has one; `known` is false where that is no length."""

    title: str
    name: str
    unit: str | None
    known: bool = True

    @classmethod
    def from_title(cls, title: str) -> Self:
        """The parts of `y`, `y (mm)`, `y [mm]`, `y/mm`, `y_mm`, `y in mm` or `y mm`."""
        title = title.strip()
        if match := re.fullmatch(r"([^(\[]*)[(\[](.*?)[)\]]*", title, re.S):
            unit = match[2].strip().lower()
            return cls(title, match[1].strip().lower(), unit, unit in UNITS)
        if match := re.fullmatch(r"(.*)[/_ ]([^/_ ]+)", title, re.S):
            if match[2].strip().lower() in UNITS:
                return cls(title, match[1].strip().removesuffix(" in").strip().lower(), match[2].strip().lower())
        return cls(title, title.lower(), None)


@dataclass(frozen=True)
class Table:
    """A table as text: one row a line of the file."""

    path: Path
    header: list[str] | None
    comment: list[str] | None  # words of the comment right above the rows, if there are as many as columns
    units: list[str]  # of a row of units below the header, empty without one
    rows: list[list[str]]
    lines: list[int]  # number of the line of each row, from 1
    separator: str
    decimal: str  # "." or ",", empty where no decimal sign occurs

    @classmethod
    def read(cls, path: Path, texts: Collection[str] = ()) -> "Table":
        """Reads a file, whose columns with the names `texts` may hold anything.

        `InputError` where rows differ in their number of fields, fields are no finite numbers, or commas may be
        separators or decimal signs.
        """
        return cls.parse(path, _text(path), texts)

    @classmethod
    def parse(cls, path: Path, text: str, texts: Collection[str] = ()) -> "Table":
        """Reads the text of a file called `path`."""
        found: list[_Line] = []
        remark = ""
        for n, whole in enumerate(re.split(r"\r\n|\n|\r", text), 1):
            whole = whole.replace("\ufeff", "").strip()
            line = _uncommented(whole)
            if whole and not line and not found:
                remark = whole.lstrip("#!%/").strip()
            if line and not re.fullmatch(r"(?i)sep=.|[\s;,]*", line):
                found.append((n, line))
        if not found:
            raise InputError(f"{path} is empty, 0 rows of numbers; expected rows of numbers, such as -39.0;1.575")
        layout = _layout(path, found, texts)
        return _Reader(path, layout, texts).read(found, remark)

    @property
    def understood(self) -> str:
        """Rows, columns, separator and decimal sign in words."""
        columns = "columns " + ", ".join(self.header) if self.header else f"{len(self.rows[0])} columns, no header"
        return f"{len(self.rows)} rows, {columns}, separated by {_SEPARATORS[self.separator]}, {_SIGNS[self.decimal]}"

    def headings(self, known: Collection[str]) -> list[Heading] | None:
        """The headings; those of a comment above the rows where all of its words are `known` or name a numbering."""
        if self.header is not None:
            own = [Heading.from_title(title) for title in self.header]
            pairs = zip(own, [unit.strip("()[] ").lower() for unit in self.units] or [""] * len(own))
            return [h if h.unit or unit in ("", "-") else Heading(h.title, h.name, unit) for h, unit in pairs]
        comment = [Heading.from_title(title) for title in self.comment or []]
        return comment if comment and all(h.name in known or h.name in _INDEX for h in comment) else None

    def counts(self, column: int) -> bool:
        """Returns whether the fields of a column are digits that count the rows."""
        fields = [row[column] for row in self.rows]
        if len(fields) < 3 or not all(field.isascii() and field.isdigit() for field in fields):
            return False
        return [int(field) - int(fields[0]) for field in fields] == list(range(len(fields)))

    def is_index(self, column: int, heading: Heading) -> bool:
        """Returns whether a column is a numbering of the rows, by its name and its numbers."""
        return heading.name in _INDEX and self.counts(column)

    def numbers(self, column: int) -> NDArray[np.float64]:
        """A column as numbers; `InputError` with the line of a field that is none."""
        values = []
        for n, row in zip(self.lines, self.rows):
            value = number(row[column], self.decimal or ".")
            if value is None:
                raise _no_number(self.path, n, row[column], self.decimal or ".")
            values.append(value)
        return np.array(values)

    def texts(self, column: int) -> list[str]:
        """A column as text."""
        return [row[column] for row in self.rows]


@dataclass(frozen=True)
class _Reader:
    """Makes a table of lines whose separator and decimal sign are known."""

    path: Path
    layout: tuple[str, str]
    texts: Collection[str]

    def read(self, found: list[_Line], remark: str) -> Table:
        separator, decimal = self.layout
        header, units, body = self._header(found)
        if not body:
            raise InputError(f"{self.path} has a header and no rows")
        rows = [(n, split(line, separator)) for n, line in body]
        first = rows[0][1]
        if header is None:
            rows = [(n, _cut(row, 0)) for n, row in rows]
            columns = len(rows[0][1])
        else:
            if len(header) == 1 and len(header[0].split()) == len(_cut(first, 0)):
                # Names may stand between blanks above numbers between semicolons.
                header = header[0].split()
            columns = len(header)
            rows = [(n, _cut(row, columns)) for n, row in rows]
        anything = {k for k, title in enumerate(header or []) if Heading.from_title(title).name in self.texts}
        fraction = False
        for n, row in rows:
            if len(row) != columns or columns < 2:
                expected = f"expected {max(columns, 2)} as in line {found[0][0]}"
                message = f"{self.path}, line {n}: {len(row)} fields, {expected}"
                hint = "; let the line begin with # if it is a comment" if header else ""
                raise InputError(f"{message} (separated by {_SEPARATORS[separator]}){hint}")
            for k, field in enumerate(row):
                if k not in anything and number(field, decimal) is None:
                    raise _no_number(self.path, n, field, decimal)
                fraction |= k not in anything and decimal in field
        self._refuse_digits_between_commas(header, body, [row for _, row in rows])
        words = _names(remark, separator) if header is None else []
        return Table(
            self.path,
            header,
            words if len(words) == columns else None,
            units,
            [row for _, row in rows],
            [n for n, _ in rows],
            separator,
            decimal if fraction else "",
        )

    def _header(self, found: list[_Line]) -> tuple[list[str] | None, list[str], list[_Line]]:
        """Headings, a row of units below them, and the other lines."""
        separator, decimal = self.layout
        header = _names(found[0][1], separator)
        if not header or number(header[0], decimal) is not None:
            return None, [], found
        if len(found) > 1:
            units = _names(found[1][1], separator)
            words = [unit.strip("()[] ").lower() for unit in units]
            if len(units) == len(header) and set(words) & set(UNITS) and set(words) <= {"", "-", *UNITS}:
                return header, units, found[2:]
        return header, [], found[1:]

    def _refuse_digits_between_commas(self, header: list[str] | None, body: list[_Line], rows: list[list[str]]) -> None:
        """Refuses whole numbers between commas that may be the digits behind decimal commas."""
        if self.layout[0] != "," or header is not None or any(re.search(r"[.eEdD\"]", line) for _, line in body):
            return
        if any(all(row[k].isdigit() for row in rows) for k in range(1, len(rows[0]))):
            raise InputError(
                f"{self.path}, line {body[0][0]}: whole numbers between commas, {body[0][1][:60]!r}; are the commas "
                "decimal commas or separators? Separate columns by semicolons, or name them in a first row such as x,y"
            )


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


def _uncommented(line: str) -> str:
    """The line without comments: they begin with #, !, % or //, behind numbers with #, ! or //."""
    if line.startswith("%"):
        return ""
    quoted = False
    for i, c in enumerate(line):
        quoted ^= c == '"'
        if not quoted and (c in "#!" or line.startswith("//", i)):
            return line[:i].rstrip()
    return line


def split(line: str, separator: str) -> list[str]:
    """Fields of a line, in quotes or not."""
    fields, begin, quoted = [], 0, False
    for i, c in enumerate(line + separator):
        quoted ^= c == '"'
        if i == len(line) or not quoted and (c.isspace() if separator == " " else c == separator):
            field = line[begin:i].strip()
            begin = i + 1
            if field or separator != " ":
                inside = field[1:-1].strip() if len(field) > 1 and field[0] == field[-1] == '"' else field
                fields.append(inside)
    return fields


def _cut(row: list[str], columns: int) -> list[str]:
    """The row without empty fields behind its first `columns`."""
    while len(row) > columns and row[-1] == "":
        row = row[:-1]
    return row


def _names(line: str, separator: str) -> list[str]:
    """Names in a row; between blanks a unit in brackets belongs to the name before it."""
    names: list[str] = []
    for field in _cut(split(line, separator), 0):
        if names and separator == " " and field[:1] in ("(", "["):
            names[-1] += f" {field}"
        else:
            names.append(field)
    return names


def number(field: str, decimal: str) -> float | None:
    """A finite number with the decimal sign `decimal` and an exponent of E or D, or `None`."""
    field = field.replace("\N{MINUS SIGN}", "-")
    if decimal == ",":
        # A comma at the end of a number is a separator.
        if "." in field or field.endswith(","):
            return None
        field = field.replace(",", ".")
    if not field.isascii() or _NUMBER.fullmatch(field) is None:
        return None
    value = float(re.sub("[dD]", "e", field))
    return value if math.isfinite(value) else None


def _no_number(path: Path, line: int, field: str, decimal: str) -> InputError:
    what = f"{field!r} is no finite number" if field else "a number is missing between separators"
    return InputError(f"{path}, line {line}: {what} (with a {_SIGNS[decimal]}); comments begin with #, !, % or //")


def _layouts(found: list[_Line]) -> Iterator[tuple[str, str]]:
    """Separators and decimal signs that the text may have."""
    text = "\n".join(line for _, line in found)
    for separator in _SEPARATORS:
        for decimal in (".", ","):
            needs = separator if separator in ";\t," else ""
            if needs in text and (decimal == "." or "," in text and (separator != "," or '"' in text)):
                yield separator, decimal


def _layout(path: Path, found: list[_Line], texts: Collection[str]) -> tuple[str, str]:
    """Separator and decimal sign with which all rows are numbers, else those with which most are.

    Rows that are numbers in two ways are the same numbers, as a field that holds a separator of another way is none.
    """
    best, most = None, 0
    for separator, decimal in _layouts(found):
        names = [Heading.from_title(title).name for title in _names(found[0][1], separator)]
        anything = {k for k, name in enumerate(names) if name in texts}
        numeric, whole, headings, length = 0, True, 0, None
        for _, line in found:
            row = _cut(split(line, separator), len(names) if anything else 0)
            wrong = [field for k, field in enumerate(row) if k not in anything and number(field, decimal) is None]
            if not wrong and len(row) - len(anything) >= 2:
                numeric += 1
                length = length or len(row)
                whole &= length == len(row)
            elif numeric == 0 and headings < 2 and not any(number(row[0], sign) is not None for sign in ".,"):
                headings += 1
            else:
                whole = False
        if numeric and whole:
            return separator, decimal
        if numeric > most:
            best, most = (separator, decimal), numeric
    if best is None:
        n, line = found[min(1, len(found) - 1)]
        raise InputError(
            f"{path}, line {n}: {line[:60]!r} is no row of numbers; expected at least two numbers a line, separated by "
            "semicolons, tabs, blanks or commas (with a decimal comma: by semicolons, tabs or blanks)"
        )
    return best
