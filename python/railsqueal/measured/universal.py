"""Universal files (`.uff`, `.unv`): frequency responses (dataset 58) as receptances, and modes (dataset 55).

Formats: University of Cincinnati, Structural Dynamics Research Laboratory, universal datasets 55, 58, 58b and 164
(www.ceas3.uc.edu/sdrluff). The bytes are read by pyuff. What a file does not say for certain, above all units and
directions, is an `InputError` with the number of the dataset.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from ..errors import USAGE, InputError, ResultError
from ..result import Complexes, Floats

# Function types of dataset 58.
FUNCTIONS = {
    0: "general or unknown function",
    1: "time response",
    2: "auto spectrum",
    3: "cross spectrum",
    4: "frequency response function",
    5: "transmissibility",
    6: "coherence",
    7: "auto correlation",
    8: "cross correlation",
    9: "power spectral density",
    12: "spectrum",
    18: "mode indicator function",
    26: "multiple coherence",
}
RESPONSE = 4
# Specific data types: name of the frequency response per force, and the power of iω that the displacement is times.
QUANTITIES = {8: ("receptance", 0), 11: ("mobility", 1), 12: ("accelerance", 2)}
FORCES = (9, 13)
FREQUENCY = 18
COMPLEX = (5, 6)
# Codes of dataset 164 and their factors: length and force, each in one SI unit.
UNIT_CODES = {
    1: (1.0, 1.0),
    2: (1 / 0.3048, 1 / 4.4482216),
    3: (1.0, 1 / 9.80665),
    4: (1 / 0.3048, 1 / 0.138254954),
    5: (1e3, 1e3),
    6: (1e2, 1e2),
    7: (1 / 0.0254, 1 / 4.4482216),
    8: (1e3, 1 / 9.80665),
    10: (1e3, 1.0),
}
# Factors that are written with few digits still are these.
ALIKE = 1e-3
# Units on the axes of dataset 58 in SI units, by what they may be units of.
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "inch": 0.0254, "ft": 0.3048}
TIMES = {0: ("",), 1: ("/s",), 2: ("/s2", "/s/s")}
NEWTONS = {"n": 1.0, "mn": 1e-3, "kn": 1e3, "lbf": 4.4482216, "lb": 4.4482216, "kgf": 9.80665, "newton": 1.0}
GRAVITY = {"g": 9.80665, "gn": 9.80665}
AXES = "XYZ"
# Largest file that is read, bytes.
LARGEST = 2_000_000_000


@dataclass(frozen=True)
class Direction:
    """A translation at a node: the axis, 0 to 2, and the sign along it."""

    node: int
    axis: int
    sign: int

    @classmethod
    def parse(cls, node: int, code: int) -> Self | None:
        """The direction of a code of dataset 58: ±1 to ±3; None where it is no translation."""
        return cls(node, abs(code) - 1, 1 if code > 0 else -1) if 1 <= abs(code) <= 3 else None

    def __str__(self) -> str:
        return f"{self.node}:{'-' if self.sign < 0 else '+'}{AXES[self.axis]}"


@dataclass(frozen=True)
class MeasuredResponse:
    """A measured frequency response, as receptance in SI units, e^{+iωt}."""

    dataset: int  # its number in the file, from 1
    name: str  # its first line of text
    response: Direction
    reference: Direction
    quantity: str  # receptance, mobility or accelerance: as it was measured
    power: int  # of iω between the receptance and the quantity
    frequency: Floats  # [f], Hz, rising, above 0
    receptance: Complexes  # [f], m/N

    @property
    def measured(self) -> Complexes:
        """[f]: values of the quantity as it was measured, SI."""
        return np.asarray((2j * np.pi * self.frequency) ** self.power * self.receptance)

    @property
    def title(self) -> str:
        """Dataset, quantity and directions in words."""
        return f"dataset {self.dataset}: {self.quantity} {self.response} by a force at {self.reference}"


@dataclass(frozen=True)
class FileMode:
    """A mode that a file lists (dataset 55)."""

    dataset: int
    frequency: float  # Hz
    damping_ratio: float | None
    motion: dict[int, Complexes]  # displacements [3] at nodes, in any unit


@dataclass(frozen=True)
class UniversalFile:
    """Frequency responses and modes of a universal file, and what else it has."""

    path: Path
    responses: list[MeasuredResponse]
    modes: list[FileMode]
    others: list[str]  # datasets that are left out, in words
    nodes: dict[int, tuple[float, float, float]]  # their coordinates in the global frame, m

    @classmethod
    def read(cls, path: Path) -> "UniversalFile":
        """Reads a file; `InputError` where it is none, or units, directions or values are not certain."""
        return _Reader(path).read()

    @property
    def listing(self) -> str:
        """Directions of the frequency responses, one line each."""
        return "\n".join(f"  {response.title}" for response in self.responses)


class _Reader:
    """Reads the datasets of a file one after the other."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.units: tuple[float, float] | None = None
        self.nodes: dict[int, tuple[float, float, float]] = {}

    def fault(self, number: int, text: str) -> InputError:
        return InputError(f"{self.path}, dataset {number}: {text}")

    def read(self) -> UniversalFile:
        if not self.path.is_file():
            raise InputError(f"{self.path}: no such file; expected a universal file (.uff, .unv)")
        if self.path.stat().st_size > LARGEST:
            raise InputError(f"{self.path} is larger than {LARGEST // 1_000_000} MB; split it by functions")
        try:
            import pyuff
        except ImportError as error:
            words = "universal files are read by the module pyuff: pip install 'railsqueal[measured]'"
            raise ResultError(f"{words} ({error})", USAGE) from error
        try:
            file = pyuff.UFF(str(self.path))
            kinds = [int(kind) for kind in file.get_set_types()]
        except Exception as error:  # pyuff raises nothing more special
            raise InputError(f"{self.path}: no universal file: {error}") from error
        if not kinds:
            raise InputError(
                f"{self.path}: found no dataset between lines of -1, expected a universal file (.uff, .unv)"
            )
        responses, modes, others = [], [], []
        for k, kind in enumerate(kinds):
            if kind not in (15, 55, 58, 164, 2411):
                others.append(f"dataset {k + 1}: type {kind}")
                continue
            try:
                data = file.read_sets(k)
            except Exception as error:
                words = f"type {kind} that cannot be read: {error}; write the file anew, or leave the dataset out"
                raise self.fault(k + 1, words) from error
            if kind == 164:
                self.units = self.factors(k + 1, data)
            elif kind in (15, 2411):
                others += self.coordinates(k + 1, data)
            elif kind == 55:
                mode = self.mode(k + 1, data)
                modes += [mode] if isinstance(mode, FileMode) else []
                others += [mode] if isinstance(mode, str) else []
            elif data["func_type"] != RESPONSE:
                name = FUNCTIONS.get(data["func_type"], f"function of type {data['func_type']}")
                others.append(f"dataset {k + 1}: {name}")
            else:
                responses.append(self.response(k + 1, data))
        return UniversalFile(self.path, responses, modes, others, self.nodes)

    def coordinates(self, number: int, data: dict[str, Any]) -> list[str]:
        """Takes the nodes of a dataset 15 or 2411 in the global frame; the others in words."""
        if self.units is None:
            return [f"dataset {number}: nodes without units, which a dataset 164 before them would give"]
        place = np.array([data["x"], data["y"], data["z"]], dtype=float) / self.units[0]
        if not np.isfinite(place).all():
            raise self.fault(number, "coordinates that are no numbers, expected finite ones")
        own = [any(int(data[key][i]) not in (0, 1) for key in ("def_cs", "disp_cs")) for i in range(place.shape[1])]
        for i, other in enumerate(own):
            if not other:
                x, y, z = (float(v) for v in place[:, i])
                self.nodes[int(data["node_nums"][i])] = (x, y, z)
        return [f"dataset {number}: {sum(own)} nodes in coordinate systems of their own"] if any(own) else []

    def factors(self, number: int, data: dict[str, Any]) -> tuple[float, float]:
        """Length and force of the file's units in one SI unit."""
        length, force = float(data["length"]), float(data["force"])
        if not (0 < length < np.inf and 0 < force < np.inf):
            raise self.fault(number, f"units with the factors {length} and {force}, expected numbers above 0")
        known = UNIT_CODES.get(int(data["units_code"]))
        if known and max(abs(length / known[0] - 1), abs(force / known[1] - 1)) > ALIKE:
            raise self.fault(
                number,
                f"units of the code {data['units_code']}, whose factors are {known[0]:.6g} and {known[1]:.6g}, found "
                f"{length:.6g} and {force:.6g}; make both the same, or give the code 9 (user defined)",
            )
        return length, force

    def response(self, number: int, data: dict[str, Any]) -> MeasuredResponse:
        """A frequency response as receptance."""
        if self.units is None:
            raise self.fault(
                number,
                "a frequency response without units: found no dataset 164 before it, expected one; write the file "
                "with units (dataset 164)",
            )
        kind = int(data.get("ordinate_spec_data_type", 0))
        if kind not in QUANTITIES:
            raise self.fault(
                number,
                f"a frequency response of the data type {kind} (record 9), expected 8 displacement, 11 velocity or 12 "
                "acceleration; write it with its type",
            )
        below = int(data.get("orddenom_spec_data_type", 0))
        if below not in FORCES:
            raise self.fault(
                number,
                f"a frequency response per data of the type {below} (record 10), expected 13 excitation force; write "
                "it with its type",
            )
        if int(data.get("abscissa_spec_data_type", 0)) != FREQUENCY:
            raise self.fault(
                number,
                f"an abscissa of the data type {data.get('abscissa_spec_data_type')} (record 8), expected 18 frequency",
            )
        quantity, power = QUANTITIES[kind]
        self.expect_label(number, str(data.get("ordinate_axis_units_lab", "")), power)
        self.expect_label(number, str(data.get("orddenom_axis_units_lab", "")), None)
        frequency, values = self.values(number, data)
        length, force = self.units
        values = values * force / length / (2j * np.pi * frequency) ** power
        return MeasuredResponse(
            number,
            str(data.get("id1", "")),
            self.direction(number, "response", data["rsp_node"], data["rsp_dir"]),
            self.direction(number, "reference", data["ref_node"], data["ref_dir"]),
            quantity,
            power,
            frequency,
            values,
        )

    def direction(self, number: int, what: str, node: int, code: int) -> Direction:
        """The direction of a code."""
        found = Direction.parse(int(node), int(code))
        if found is None:
            raise self.fault(
                number,
                f"a {what} at the node {node} in the direction {code}, expected a translation: 1, 2, 3 or −1, −2, −3 "
                "(record 6)",
            )
        return found

    def values(self, number: int, data: dict[str, Any]) -> tuple[Floats, Complexes]:
        """Frequencies above 0 and the values there."""
        if int(data.get("ord_data_type", 0)) not in COMPLEX:
            raise self.fault(number, "a frequency response of real numbers, expected complex ones (data type 5 or 6)")
        if data.get("binary") and int(data.get("fp_format", 2)) != 2:
            raise self.fault(number, f"binary numbers of the format {data['fp_format']}, expected 2 (IEEE 754)")
        frequency = np.asarray(data["x"], dtype=np.float64)
        values = np.asarray(data["data"], dtype=np.complex128)
        expected = int(data.get("num_pts", len(values)))
        if len(values) != expected or len(frequency) != expected:
            raise self.fault(number, f"found {len(values)} values, expected {expected}: the file is cut or damaged")
        if not (np.isfinite(frequency).all() and np.isfinite(values).all()):
            raise self.fault(number, "values that are no numbers, expected finite ones; leave these lines out")
        if len(frequency) < 2 or not (np.diff(frequency) > 0).all() or frequency[0] < 0:
            raise self.fault(number, "frequencies that do not rise from 0 Hz or above, expected two or more that do")
        kept = frequency > 0
        return frequency[kept], values[kept]

    def expect_label(self, number: int, label: str, power: int | None) -> None:
        """`InputError` where the unit on an axis contradicts dataset 164, or is none that is known.

        `power` is that of 1/s of a motion; None is a force.
        """
        assert self.units is not None
        unit = re.sub(r"[\s()\[\]^*]", "", label).lower().replace("sec", "s").replace("µ", "u").replace("μ", "u")
        if unit in ("", "none"):
            return
        record = 10 if power is None else 9
        known = NEWTONS if power is None else {k + end: v for k, v in LENGTHS.items() for end in TIMES[power]}
        if power == 2:
            known = known | GRAVITY
        if unit not in known:
            raise self.fault(
                number,
                f"{label!r} as unit of the axis (record {record}), which is not understood; write the unit of dataset "
                "164 there, or NONE",
            )
        own = 1 / self.units[1 if power is None else 0]
        if abs(known[unit] / own - 1) > ALIKE:
            raise self.fault(
                number,
                f"{label!r} as unit of the axis (record {record}), {known[unit]:.6g} in SI, where dataset 164 has "
                f"{own:.6g}; write values in the unit of dataset 164, or correct that dataset",
            )

    def mode(self, number: int, data: dict[str, Any]) -> FileMode | str:
        """The mode of a dataset 55, or what it is instead."""
        kind = int(data["analysis_type"])
        if kind == 2:
            frequency, ratio = float(data["freq"]), float(data.get("modal_damp_vis", 0.0))
            if not (frequency > 0 and 0 <= ratio < 1):
                raise self.fault(
                    number, f"a mode at {frequency} Hz with the damping ratio {ratio}, expected above 0 Hz, and 0 to 1"
                )
            return FileMode(number, frequency, ratio or None, self.motion(data))
        if kind in (3, 7):
            value = complex(data["eig"])
            if not (abs(value) > 0 and value.real <= 0):
                raise self.fault(number, f"a complex mode with the eigenvalue {value} 1/s, expected one that decays")
            return FileMode(number, abs(value) / (2 * np.pi), -value.real / abs(value), self.motion(data))
        return f"dataset {number}: data at nodes of the analysis type {kind}"

    def motion(self, data: dict[str, Any]) -> dict[int, Complexes]:
        """Displacements at the nodes of a dataset 55: its first three values, where they are translations."""
        if int(data.get("data_ch", 0)) not in (2, 3):
            return {}
        values = np.array([data["r1"], data["r2"], data["r3"]], dtype=np.complex128)
        return {int(node): values[:, i] for i, node in enumerate(data["node_nums"])}
