"""Track decay rates of a result (EN 15461), and measured ones from a table beside them."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self

import numpy as np

from .errors import InputError
from .result import Floats, Result
from .table_reader import Table as TextTable
from .tables import Table

DIRECTIONS = ("vertical", "lateral")
# Lower limits of a reference track, dB/m, from 250 to 5000 Hz: the table beside Figure 3 of ISO 3095:2013 as the
# package phonometry has it (github jmrplens/phonometry).
LIMITS = {
    "vertical": (2.0, 2.0, 6.0, 6.0, 6.0, 2.19, 0.8, 0.8, 0.8, 0.8, 0.8, 0.8, 0.8, 0.8),
    "lateral": (2.04, 1.38, 0.94, 0.64, 0.43, 0.29, 0.2, 0.2, 0.32, 0.5, 0.5, 0.5, 0.5, 0.5),
}


@dataclass(frozen=True)
class TrackDecay(Table):
    """Decay rates in third octaves."""

    needs: ClassVar[str] = "track_decay/frequency"
    analysis: ClassVar[str] = "track_decay"

    frequency: Floats  # [b], Hz, nominal
    rate: dict[str, Floats]  # direction: [b], dB/m
    least: float  # dB/m, lowest rate that the positions can tell
    position: Floats  # [n], m
    response: dict[str, Floats]  # direction: [b, n], over the direct response

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The decay rates of a result."""
        cls.expect(result)
        return cls(
            result.array("track_decay/frequency"),
            {name: result.array(f"track_decay/{name}") for name in DIRECTIONS},
            result.number("track_decay/least"),
            result.array("track_decay/position"),
            {name: result.array(f"track_decay/response/{name}") for name in DIRECTIONS},
        )


@dataclass(frozen=True)
class MeasuredDecay:
    """Measured decay rates."""

    path: Path
    frequency: Floats  # [b], Hz
    rate: dict[str, Floats]  # vertical, lateral or both: [b], dB/m

    @classmethod
    def read(cls, path: Path) -> Self:
        """Reads a table with the columns `frequency` (Hz), `vertical` and `lateral` (dB/m), one of which may lack."""
        table = TextTable.read(path)
        heads = table.headings(("frequency", *DIRECTIONS))
        expected = "expected the columns frequency, vertical and lateral, in Hz and dB/m, named in the first row"
        if heads is None:
            raise InputError(f"{path}: found no names of columns, {expected}")
        columns: dict[str, Floats] = {}
        for k, head in enumerate(heads):
            unit = {"frequency": "hz"}.get(head.name, "db/m")
            if head.name not in ("frequency", *DIRECTIONS):
                raise InputError(f"{path}: found the column {head.title!r}, {expected}")
            if head.unit not in (None, "", unit):
                raise InputError(f"{path}: found the column {head.title!r} in {head.unit}, {expected}")
            if head.name in columns:
                raise InputError(f"{path}: found the column {head.name} twice, {expected}")
            columns[head.name] = table.numbers(k)
        if "frequency" not in columns or len(columns) < 2:
            raise InputError(f"{path}: found the columns {', '.join(columns)}, {expected}")
        frequency = columns.pop("frequency")
        if not (frequency > 0).all() or not (np.diff(frequency) > 0).all():
            raise InputError(f"{path}: frequencies that do not rise from above 0 Hz, expected the bands in their order")
        for name, rate in columns.items():
            if not (rate > 0).all():
                line = table.lines[int(np.argmin(rate))]
                raise InputError(f"{path}, line {line}: a decay rate of {rate.min()} dB/m ({name}), expected above 0")
        return cls(path, frequency, columns)
