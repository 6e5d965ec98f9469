"""The tables of a result, one class for each analysis, in SI units and with the shapes of docs/reference/output.md.

Each `from_result(result)` raises `ResultError` if the result has no such analysis; `present(result)` says whether it
has.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from .errors import ResultError
from .result import Complexes, Floats, Integers, Result

BODIES = {1: "lower", 2: "upper"}
OPEN, STICK, SLIP = 0, 1, 2
# Imaginary part of an eigenvalue over its modulus from which it oscillates; below it is rounding.
OSCILLATION = 1e-6


class Table:
    """Common base of all tables."""

    needs: ClassVar[str]
    analysis: ClassVar[str]

    @classmethod
    def present(cls, result: Result) -> bool:
        """Returns whether the result holds this table."""
        return cls.needs in result

    @classmethod
    def expect(cls, result: Result) -> None:
        """`ResultError` if it does not."""
        if not cls.present(result):
            raise ResultError(
                f"{result.path} has no /{cls.needs}: its job has no analyses.{cls.analysis}, or the run ended before it"
            )


@dataclass(frozen=True)
class Modes:
    """Free-interface modes of one body."""

    body: str
    frequency: Floats  # [m], Hz
    residual: Floats  # [m]
    angular_velocity: float  # rad/s; 0 of a body that does not rotate
    diameters: Floats | None  # [m], nodal diameters at rest; of bodies that rotate
    family: list[str]  # [m], kind of motion such as `axial 0`; empty where it is not known
    speeds: Floats  # [m], rad/s, angular velocity of the body of each mode
    wave_frequency: Floats | None  # [m], Hz
    wave_diameters: Floats | None  # [m], positive where the wave travels with the rotation

    @classmethod
    def from_result(cls, result: Result, body: str) -> Self:
        """The modes of the `lower` or the `upper` body."""
        path = f"modes/{body}"
        if f"{path}/frequency" not in result:
            raise ResultError(
                f"{result.path} has no modes of the body {body!r}; it has those of "
                f"{', '.join(cls.bodies(result)) or 'none'}"
            )
        speed = result.number(f"{path}/angular_velocity") if f"{path}/angular_velocity" in result else 0.0
        frequency = result.array(f"{path}/frequency")
        residual = result.optional(f"{path}/residual")
        speeds = result.optional(f"{path}/angular_velocities")
        return cls(
            body,
            frequency,
            np.full(len(frequency), np.nan) if residual is None else residual,
            speed,
            result.optional(f"{path}/diameters"),
            result.texts(f"{path}/family") if f"{path}/family" in result else [""] * len(frequency),
            np.full(len(frequency), speed) if speeds is None else speeds,
            result.optional(f"{path}/wave_frequency"),
            result.optional(f"{path}/wave_diameters"),
        )

    @staticmethod
    def bodies(result: Result) -> list[str]:
        """Bodies that have modes."""
        return [body for body in BODIES.values() if f"modes/{body}/frequency" in result]


def growing(eigenvalue: Complexes) -> NDArray[np.bool_]:
    """Return true for eigenvalues (1/s) that grow by more than rounding and are no rigid motions (below 0.01 1/s).

    For files that do not say it themselves.
    """
    size = np.abs(eigenvalue)
    return (size >= 0.01) & (eigenvalue.real > 1e-10 * np.maximum(size, 100.0))


@dataclass(frozen=True)
class ComplexModes(Table):
    """Eigenvalues of steady sliding or rolling, by falling growth rate; one of each conjugate pair."""

    needs: ClassVar[str] = "stability/eigenvalue"
    analysis: ClassVar[str] = "stability"

    eigenvalue: Complexes  # [e], 1/s
    frequency: Floats  # [e], Hz
    growth_rate: Floats  # [e], 1/s
    damping_ratio: Floats  # [e]
    source: list[str]  # [e], reduced or full
    participation: Floats | None  # [e, m], shares of the free-interface modes by elastic energy
    mode_body: Integers | None  # [m], 1 lower, 2 upper
    mode_frequency: Floats | None  # [m], Hz
    diameters: Floats | None  # [e, 2], nodal diameters of the motion of both bodies; where one rotates
    grows: NDArray[np.bool_]  # [e], by the rule of the program
    partner: Integers | None  # [e], place of the same eigenvalue from the other source, -1 without one

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The eigenvalues of a result."""
        cls.expect(result)
        value = result.complexes("stability/eigenvalue")
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = -value.real / np.abs(value)
        return cls(
            value,
            value.imag / (2 * np.pi),
            value.real.copy(),
            ratio,
            result.texts("stability/source") if "stability/source" in result else ["reduced"] * len(value),
            result.optional("stability/participation"),
            result.integers("stability/mode_body") if "stability/mode_body" in result else None,
            result.optional("stability/mode_frequency"),
            result.optional("stability/diameters"),
            result.integers("stability/unstable") > 0 if "stability/unstable" in result else growing(value),
            result.integers("stability/partner") if "stability/partner" in result else None,
        )

    @property
    def unstable(self) -> Integers:
        """Places of the eigenvalues that grow."""
        return np.flatnonzero(self.grows)

    @property
    def oscillates(self) -> NDArray[np.bool_]:
        """[e]: eigenvalues with a frequency; the others grow or decay without oscillation."""
        return np.asarray(np.abs(self.eigenvalue.imag) > OSCILLATION * np.maximum(np.abs(self.eigenvalue), 1e-300))

    @property
    def distinct(self) -> NDArray[np.bool_]:
        """[e]: eigenvalues without those of the reduced model that the full system has as well."""
        if self.partner is None:
            return np.ones(len(self.eigenvalue), dtype=bool)
        return np.asarray(~((np.array(self.source) == "reduced") & (self.partner >= 0)))

    def name(self, place: int) -> str:
        """Frequency, nodal diameters where the bodies rotate, and the free modes that make most of it."""
        words = [f"{self.frequency[place]:.1f} Hz"]
        if self.diameters is not None:
            shown = [f"{BODIES[b + 1]} {n:+.1f}" for b, n in enumerate(self.diameters[place]) if np.isfinite(n)]
            words.append("nodal diameters " + ", ".join(shown))
        made = self.made_of(place)
        if made:
            words.append(made)
        return "; ".join(words)

    def made_of(self, place: int, most: int = 2) -> str:
        """Free modes with the largest shares, e.g. `51 % upper mode 1, 49 % lower mode 1`; shares below 10 % are left
        out."""
        if self.participation is None or self.mode_body is None:
            return ""
        share = self.participation[place]
        number = np.empty(len(share), dtype=int)
        for body in BODIES:
            own = np.flatnonzero(self.mode_body == body)
            number[own] = np.arange(1, len(own) + 1)
        largest = [k for k in np.argsort(-share, kind="stable")[:most] if share[k] >= 0.1]
        return ", ".join(f"{100 * share[k]:.0f} % {BODIES[int(self.mode_body[k])]} mode {number[k]}" for k in largest)


def contact_number(group: str) -> int:
    """Number of a contact by its group, or by that of its placement, from 1."""
    return int(group.rpartition("_")[2]) if "_" in group else 1


def contact_name(result: Result, number: int) -> str:
    """Number of a contact, from 1, with the name that it has among several."""
    names = result.texts("contacts/name") if "contacts/name" in result else []
    return f"contact {number} ({names[number - 1]})" if 1 <= number <= len(names) else f"contact {number}"


def friction_law(result: Result, number: int = 1) -> Any:
    """Friction law of a contact, a number or an object of the job: its own one, that of its zone, or that of all."""
    contact = result.job.get("contact") or {}
    around = contact.get("around") or []
    if 2 <= number <= len(around) + 1 and around[number - 2].get("friction") is not None:
        return around[number - 2]["friction"]
    zone = result.optional(f"placement{'' if number == 1 else f'_{number}'}/friction_zone")
    if zone is not None and int(zone) >= 0:
        return contact["friction_zones"][int(zone)]["friction"]
    return contact.get("friction")


def numbered(result: Result, name: str) -> list[str]:
    """A group and those of further contacts: `contact`, `contact_2`, … or `placement`, `placement_2`, …"""
    found = [name] if name in result else []
    while found and f"{name}_{len(found) + 1}" in result:
        found.append(f"{name}_{len(found) + 1}")
    return found


@dataclass(frozen=True)
class ContactGrid(Table):
    """The contact in steady rolling on its grid: fields are [ny, nx] and [ny, nx, 2]."""

    needs: ClassVar[str] = "contact/pressure"
    analysis: ClassVar[str] = "steady"

    x: Floats  # [nx], m
    y: Floats  # [ny], m
    pressure: Floats  # Pa
    traction: Floats  # Pa, on body 1
    creep: Floats  # m/s
    state: Integers  # 0 open, 1 stick, 2 slip
    weight: Floats  # m², area of each node
    gap0: Floats  # m, of the undeformed bodies
    force: Floats  # [3], N, on body 1
    moment_z: float  # N m
    approach: float  # m

    @classmethod
    def from_result(cls, result: Result, group: str = "contact") -> Self:
        """A contact of a result: one of `groups(result)`."""
        cls.expect(result)
        x, y = result.array(f"{group}/x"), result.array(f"{group}/y")
        if f"{group}/shape" in result:
            nx, ny = (int(n) for n in result[f"{group}/shape"])
        else:
            nx, ny = len(np.unique(x)), len(np.unique(y))
        if nx * ny != len(x):
            raise ResultError(f"{result.path}: /{group} has {len(x)} nodes, which is no grid of {nx} x {ny}")

        def field(name: str, *more: int) -> Floats:
            if f"{group}/{name}" not in result:
                return np.full((ny, nx, *more), np.nan)
            return result.array(f"{group}/{name}").reshape(ny, nx, *more)

        def number(name: str) -> float:
            return result.number(f"{group}/{name}") if f"{group}/{name}" in result else float("nan")

        return cls(
            x.reshape(ny, nx)[0],
            y.reshape(ny, nx)[:, 0],
            field("pressure"),
            field("traction", 2),
            field("creep", 2),
            result.integers(f"{group}/state").reshape(ny, nx),
            field("weight"),
            field("gap0"),
            result.array(f"{group}/force"),
            number("moment_z"),
            number("approach"),
        )

    @staticmethod
    def groups(result: Result) -> list[str]:
        """Groups of the contacts in steady rolling: `contact`, then `contact_2` and so on where a wheel has several."""
        return [group for group in numbered(result, "contact") if f"{group}/pressure" in result]

    @property
    def closed(self) -> NDArray[np.bool_]:
        """[ny, nx]: nodes in contact."""
        return np.asarray(self.state != OPEN)

    @property
    def stick_share(self) -> float:
        """Share of the area in contact that sticks; NaN where nothing touches."""
        area = self.weight[self.closed].sum()
        return float(self.weight[self.state == STICK].sum() / area) if area > 0 else float("nan")


@dataclass(frozen=True)
class History(Table):
    """A transient, step by step."""

    needs: ClassVar[str] = "transient/time"
    analysis: ClassVar[str] = "transient"

    time: Floats  # [s], s
    force: Floats  # [s, 3], N, on body 1
    closed: Integers  # [s]
    stick: Integers  # [s], those of the closed nodes that stick
    points: list[str]  # [k], names
    velocity: Floats | None  # [s, k, 3], m/s

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The history of a result, of a stopped run as far as it came."""
        cls.expect(result)
        has_points = "transient/point_velocity" in result and "transient/points/name" in result
        history = cls(
            result.array("transient/time"),
            result.array("transient/force"),
            result.integers("transient/closed"),
            result.integers("transient/stick"),
            result.texts("transient/points/name") if has_points else [],
            result.array("transient/point_velocity") if has_points else None,
        )
        if len(history.time) < 2:
            raise ResultError(
                f"{result.path}: the transient has {len(history.time)} steps, too few to show: let the run go on"
            )
        return history

    @property
    def step(self) -> float:
        """Time between two rows, s."""
        return float(self.time[1] - self.time[0])

    @property
    def stick_share(self) -> Floats:
        """[s]: share of the closed nodes that stick."""
        return np.asarray(self.stick / np.maximum(self.closed, 1))


@dataclass(frozen=True)
class Receptances(Table):
    """Receptances of the contact point; directions (x, y, n into the body) in lower form."""

    needs: ClassVar[str] = "receptance/frequency"
    analysis: ClassVar[str] = "receptance"

    frequency: Floats  # [f], Hz, rising
    bodies: dict[str, Complexes]  # name: [f, 3, 3], m/N

    @classmethod
    def from_result(cls, result: Result, group: str = "receptance") -> Self:
        """The receptances of a contact of a result, one of `groups(result)`, by rising frequency."""
        cls.expect(result)
        frequency = result.array(f"{group}/frequency")
        order = np.argsort(frequency, kind="stable")
        names = [n for n in BODIES.values() if f"{group}/{n}" in result]
        return cls(frequency[order], {n: result.complexes(f"{group}/{n}")[order] for n in names})

    @staticmethod
    def groups(result: Result) -> list[str]:
        """Groups of the contacts: `receptance`, then `receptance_2` and so on where a job has several."""
        return numbered(result, "receptance")


def numbers_or_words(values: NDArray[Any]) -> NDArray[Any]:
    """Values of a swept key: doubles, or texts."""
    if values.dtype.kind in "fiu":
        return values.astype(np.float64)
    return np.array([w.decode() if isinstance(w, bytes) else str(w) for w in values], dtype=object)


@dataclass(frozen=True)
class Sweep(Table):
    """Points of a sweep, in the order of the grid; numbers of a point that failed are NaN."""

    needs: ClassVar[str] = "sweep/keys"
    analysis: ClassVar[str] = "sweep"

    keys: list[str]  # [k]
    values: dict[str, NDArray[Any]]  # key: [s]
    shape: list[int]  # values along the keys of a grid, or one number where lists run side by side
    status: Integers  # [s], 0 computed
    message: list[str]  # [s]
    unstable: Integers  # [s]
    growth_rate: Floats  # [s], 1/s
    frequency: Floats  # [s], Hz
    sticking: Integers  # [s]
    eigenvalue: Complexes  # [e], 1/s
    offset: Integers  # [s + 1]

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The sweep of a result."""
        cls.expect(result)
        keys = result.texts("sweep/keys")
        values = {key: np.asarray(result[f"sweep/values/{key}"]) for key in keys}
        return cls(
            keys,
            {key: numbers_or_words(v) for key, v in values.items()},
            [int(n) for n in result["sweep/shape"]],
            result.integers("sweep/status"),
            result.texts("sweep/message") if "sweep/message" in result else [],
            result.integers("sweep/unstable"),
            result.array("sweep/growth_rate"),
            result.array("sweep/frequency"),
            result.integers("sweep/sticking"),
            result.complexes("sweep/eigenvalue"),
            result.integers("sweep/offset"),
        )

    def spectrum(self, point: int) -> Complexes:
        """Eigenvalues of a point, by falling growth rate."""
        return self.eigenvalue[self.offset[point] : self.offset[point + 1]]

    @property
    def moving(self) -> list[int]:
        """Places of the keys that have more than one value; empty where lists run side by side."""
        return [i for i, n in enumerate(self.shape) if n > 1] if len(self.shape) == len(self.keys) else []


@dataclass(frozen=True)
class Branches(Table):
    """Branches of limit cycles over a key, one after the other, each from one end to the other."""

    needs: ClassVar[str] = "cycles/key"
    analysis: ClassVar[str] = "cycles"

    along: str  # the key
    key: Floats  # [p], its value
    frequency: Floats  # [p], Hz
    kinetic: Floats  # [p], J
    stick: Floats  # [p, 2], mean and largest share
    normal: Floats  # [p, 2], N, least and largest
    force_rms: Floats  # [p, 3], N
    velocity_rms: Floats  # [p, 2, 3], m/s
    multiplier: Complexes  # [p, 12], NaN where there are fewer
    unstable: Integers  # [p], multipliers outside the unit circle, -1 where they were not computed
    special: list[str]  # [p], kind of a special point, empty of an ordinary cycle
    second_frequency: Floats  # [p], Hz
    special_error: Floats  # [p], of the key, error of the location; NaN of an ordinary cycle
    branch: Integers  # [p], number of the branch
    start: Integers  # [b], place of the cycle that each branch was begun with
    origin: list[str]  # [b], where it was begun
    end: list[list[str]]  # [b][2], why it ends, on both sides
    onset_key: Floats  # [o], where a mode of rest begins to grow, or ceases to
    onset_frequency: Floats  # [o], Hz
    onset_above: Integers  # [o], 1 where it grows above
    onset_mode: Integers  # [o], modes that grow on both sides: 0 where rest loses its stability
    onset_criticality: Integers  # [o], -1 subcritical, 1 supercritical, 0 not known
    level_a: dict[str, Floats]  # A-weighted sound power level of each body that is heard, [p], dB re 1 pW

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The branches of a result."""
        cls.expect(result)
        # Results of earlier versions have neither errors nor criticality.
        error = result.optional("cycles/special_error")
        critical = result.optional("cycles/onset/criticality")
        ends = [str(t) for t in np.char.decode(np.asarray(result["cycles/end"], dtype=bytes), "utf-8").ravel()]
        return cls(
            result.texts("cycles/along")[0],
            result.array("cycles/key"),
            result.array("cycles/frequency"),
            result.array("cycles/kinetic"),
            result.array("cycles/stick"),
            result.array("cycles/normal"),
            result.array("cycles/force_rms"),
            result.array("cycles/velocity_rms"),
            result.complexes("cycles/multiplier"),
            result.integers("cycles/unstable"),
            result.texts("cycles/special"),
            result.array("cycles/second_frequency"),
            np.full(len(result.array("cycles/key")), np.nan) if error is None else error,
            result.integers("cycles/branch"),
            result.integers("cycles/start"),
            result.texts("cycles/origin"),
            [ends[k : k + 2] for k in range(0, len(ends), 2)],
            result.array("cycles/onset/key"),
            result.array("cycles/onset/frequency"),
            result.integers("cycles/onset/above"),
            result.integers("cycles/onset/mode"),
            np.asarray(np.zeros_like(result.array("cycles/onset/key")) if critical is None else critical, np.int64),
            {
                b: result.array(path)
                for b in BODIES.values()
                if (path := f"cycles/sound_power/{b}/total_level_a") in result
            },
        )

    def places(self, branch: int) -> list[int]:
        """Rows of a branch."""
        return [int(k) for k in np.flatnonzero(self.branch == branch)]

    def velocity(self) -> Floats:
        """Root mean square of the velocity at the contact of the body that moves faster, [p], m/s."""
        speed: Floats = np.sqrt((self.velocity_rms**2).sum(axis=2))
        return np.asarray(speed.max(axis=1))

    def loudest(self) -> Floats | None:
        """A-weighted sound power level of the louder body, [p], dB re 1 pW; none where no sound was asked for."""
        return np.max(list(self.level_a.values()), axis=0) if self.level_a else None


@dataclass(frozen=True)
class Cycles(Table):
    """Limit cycles of the points of a sweep, one row for each branch; numbers of what rests or was not computed are 0
    or NaN."""

    needs: ClassVar[str] = "sweep/cycles/fate"
    analysis: ClassVar[str] = "sweep.cycles"

    branch: list[str]  # [b]: mode, up, down
    along: str  # the swept key along which motions are handed on
    fate: Integers  # [b, s]: -1 not computed, 0 at rest, 1 periodic, 2 irregular, 3 unsettled
    frequency: Floats  # [b, s], Hz
    kinetic: Floats  # [b, s], J
    time: Floats  # [b, s], s
    stick: Floats  # [b, s, 2], mean and largest share
    force: Floats  # [b, s, 3], N
    force_rms: Floats  # [b, s, 3], N
    velocity_rms: Floats  # [b, s, 2, 3], m/s
    force_harmonics: Floats  # [b, s, h, 3], N
    message: list[str]  # [b s]
    level_a: dict[
        str, Floats
    ]  # A-weighted sound power level of each body that is heard, [b, s], dB re 1 pW; -inf at rest

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The limit cycles of a result."""
        cls.expect(result)
        group = "sweep/cycles/"
        messages = np.asarray(result[group + "message"]).reshape(-1)
        return cls(
            result.texts(group + "branch"),
            result.texts(group + "along")[0],
            result.integers(group + "fate"),
            result.array(group + "frequency"),
            result.array(group + "kinetic"),
            result.array(group + "time"),
            result.array(group + "stick"),
            result.array(group + "force"),
            result.array(group + "force_rms"),
            result.array(group + "velocity_rms"),
            result.array(group + "force_harmonics"),
            [m.decode() if isinstance(m, bytes) else str(m) for m in messages],
            {
                b: result.array(path)
                for b in BODIES.values()
                if (path := f"{group}sound_power/{b}/total_level_a") in result
            },
        )

    def loudest(self) -> Floats | None:
        """A-weighted sound power level of the louder body, [b, s], dB re 1 pW; none where no sound was asked for."""
        return np.fmax.reduce(list(self.level_a.values())) if self.level_a else None


@dataclass(frozen=True)
class CreepCurve(Table):
    """Steady rolling over one creepage; NaN at points that failed."""

    needs: ClassVar[str] = "creep_curve/force"
    analysis: ClassVar[str] = "creep_curve"

    key: str  # longitudinal, lateral or spin
    creepage: Floats  # [c]
    force: Floats  # [c, 3], N, on body 1
    stick_share: Floats  # [c]
    status: Integers  # [c], 0 computed
    eigenvalue: Complexes | None  # [c], 1/s, the one with the largest growth rate

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The creep curve of a result."""
        cls.expect(result)
        key = next((k for k in ("longitudinal", "lateral", "spin") if f"creep_curve/{k}" in result), None)
        if key is None:
            raise ResultError(
                f"{result.path}: /creep_curve does not say which creepage changes; it has "
                f"{', '.join(result.names('creep_curve'))}"
            )
        stable = "creep_curve/eigenvalue" in result
        return cls(
            key,
            result.array(f"creep_curve/{key}"),
            result.array("creep_curve/force"),
            result.array("creep_curve/stick_share"),
            result.integers("creep_curve/status"),
            result.complexes("creep_curve/eigenvalue") if stable else None,
        )

    @staticmethod
    def further(result: Result) -> list[str]:
        """Groups of the further contacts, whose creepages change by as much as that of the first one."""
        groups: list[str] = []
        while f"{(group := f'creep_curve_{len(groups) + 2}')}/force" in result:
            groups.append(group)
        return groups


@dataclass(frozen=True)
class Provenance:
    """Provenance of a result; items that the file does not have are empty."""

    command: list[str]
    versions: dict[str, str]
    ranks: int
    inputs: dict[str, str]  # name of the input file: SHA-256
    stages: dict[str, float]  # name: s, all times that a stage was entered together
    date: str
    warnings: list[str]
    damping: list[str]  # of each body with modes, in words

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The provenance of a result."""

        def texts(name: str) -> list[str]:
            return result.texts(f"provenance/{name}") if f"provenance/{name}" in result else []

        times = result.array("provenance/stage_times").tolist() if "provenance/stage_times" in result else []
        stages: dict[str, float] = {}
        # Files of earlier versions have a stage as often as it came, as for each point of a sweep.
        for name, time in zip(texts("stage_names"), times):
            stages[name] = stages.get(name, 0.0) + time
        return cls(
            texts("command"),
            dict(zip(texts("version_names"), texts("versions"))),
            int(result.number("provenance/ranks")) if "provenance/ranks" in result else 0,
            dict(zip(texts("input_files"), texts("input_sha256"))),
            stages,
            (texts("date") or [""])[0],
            texts("warnings"),
            texts("damping"),
        )
