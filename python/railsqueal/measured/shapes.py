"""Measured mode shapes as keys of a job: the value of `bodies.*.modes.measured.*.shape`.

A shape comes from a dataset 55, or from the residues R_kr of a fit: of responses to one force, or of one response to
forces at many points, they are φ_k φ_0 times a number that is the same for all points k of a mode. A complex shape is
rotated by the phase that makes its real part largest, ½ arg Σ s².
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..errors import USAGE, InputError, ResultError
from ..result import Complexes, Floats
from .overlay import FileAxes
from .universal import Direction, FileMode, MeasuredResponse, UniversalFile

# Fewest components that a job takes.
LEAST = 6
# Share of the real part below which a shape is told to be complex.
COLLINEAR = 0.9
# Digits of coordinates, m, and of displacements over the largest one.
DIGITS = 5


@dataclass(frozen=True)
class BodyFrame:
    """Axes and origin of a body in a file."""

    axes: FileAxes
    origin: tuple[float, float, float]  # m, in the axes of the file

    @classmethod
    def parse(cls, axes: str, origin: str | None) -> Self:
        """The frame of `--axes Y,-X,Z --origin 0,0.1,0`."""
        parts = (origin or "0,0,0").split(",")
        try:
            found = tuple(float(part) for part in parts)
        except ValueError:
            found = ()
        if len(found) != 3 or not np.isfinite(found).all():
            raise ResultError(f"--origin: found {origin!r}, expected three numbers in m such as 0,0.1,0", USAGE)
        return cls(FileAxes.parse(axes), (found[0], found[1], found[2]))

    def turned(self, vector: Any) -> Any:
        """`[3]` in the axes of the file as (x, y, z) of the body."""
        return np.array([self.axes.sign[k] * vector[self.axes.axis[k]] for k in range(3)])


@dataclass(frozen=True)
class Shape:
    """A measured shape in the frame of a body."""

    points: Floats  # [p, 3], m
    motion: Complexes  # [p, 3]; NaN where nothing was measured

    @property
    def components(self) -> Complexes:
        """[c]: what was measured."""
        return np.asarray(self.motion[~np.isnan(self.motion)])

    @property
    def collinearity(self) -> float:
        """Square of the real part, once rotated, over that of the whole."""
        values = self.components
        return float((1 + abs((values**2).sum()) / (np.abs(values) ** 2).sum()) / 2)

    @property
    def real(self) -> Floats:
        """[p, 3]: the largest real part, over its largest component."""
        turned = (self.motion * np.exp(-0.5j * np.angle((self.components**2).sum()))).real
        return np.asarray(turned / np.nanmax(np.abs(turned)))

    @property
    def value(self) -> dict[str, Any]:
        """The value of the key `shape` of a job."""
        motion = [[None if np.isnan(v) else float(f"{v:.{DIGITS}g}") for v in row] for row in self.real]
        return {"points": [[float(f"{v:.{DIGITS + 1}g}") for v in p] for p in self.points], "motion": motion}

    def remark(self, frequency: float) -> str | None:
        """Reason to doubt the shape of the mode at a frequency, Hz."""
        if len(self.components) < LEAST:
            return (
                f"the shape at {frequency:.2f} Hz has {len(self.components)} components, a job takes {LEAST} or more: "
                "left out"
            )
        if self.collinearity < COLLINEAR:
            return (
                f"the shape at {frequency:.2f} Hz is complex, its real part has {100 * self.collinearity:.0f} % of it: "
                "close modes that were not told apart, or strong damping"
            )
        return None


def of_mode(file: UniversalFile, mode: FileMode, frame: BodyFrame) -> Shape:
    """The shape of a mode that the file lists."""
    if not mode.motion:
        raise InputError(f"{file.path}, dataset {mode.dataset}: a mode without displacements at nodes")
    return placed(file, frame, ((Direction(n, k, 1), u[k]) for n, u in mode.motion.items() for k in range(3)))


def of_fit(file: UniversalFile, responses: list[MeasuredResponse], residues: Complexes, frame: BodyFrame) -> Shape:
    """The shape of a mode with these residues `[K]` of the responses."""
    ends = ([r.response for r in responses], [r.reference for r in responses])
    if len(set(ends[1])) == 1:
        moving = ends[0]
    elif len(set(ends[0])) == 1:
        moving = ends[1]
    else:
        raise ResultError(
            f"{file.path}: shapes are of responses to one force, or of one response to many; choose such ones by "
            f"--datasets\n{file.listing}",
            USAGE,
        )
    if len({r.power for r in responses}) != 1:
        found = ", ".join(sorted({r.quantity for r in responses}))
        raise ResultError(
            f"{file.path}: shapes are of responses of one quantity, found {found}; choose one by --datasets", USAGE
        )
    return placed(file, frame, zip(moving, residues))


def placed(file: UniversalFile, frame: BodyFrame, motions: Iterable[tuple[Direction, complex]]) -> Shape:
    """Displacements at nodes in the frame of a body; those measured twice as their mean."""
    sums: dict[int, dict[int, list[complex]]] = {}
    for direction, value in motions:
        sums.setdefault(direction.node, {}).setdefault(direction.axis, []).append(direction.sign * value)
    points, rows = [], []
    for node, by_axis in sums.items():
        if node not in file.nodes:
            raise InputError(
                f"{file.path}: found no coordinates of the node {node}, expected them in the global frame in a dataset "
                "15 or 2411; leave --axes out where shapes are not needed"
            )
        points.append(frame.turned(np.array(file.nodes[node]) - frame.origin))
        own = [complex(np.mean(by_axis[k])) if k in by_axis else complex(np.nan) for k in range(3)]
        rows.append(frame.turned(own))
    return Shape(np.array(points), np.array(rows))
