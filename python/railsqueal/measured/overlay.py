"""Measured receptances beside those of a result: which functions of a file are at the contact point of a body, and
along which of its directions.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from ..errors import USAGE, ResultError
from ..result import Complexes, Floats, Result
from ..tables import BODIES, Receptances
from .universal import AXES, Direction, MeasuredResponse, UniversalFile

# Directions of receptances in results.
NAMES = ("x", "y", "n")


@dataclass(frozen=True)
class FileAxes:
    """Axes of a file along x, y and z of the job's frame."""

    axis: tuple[int, int, int]
    sign: tuple[int, int, int]

    @classmethod
    def parse(cls, text: str) -> Self:
        """The axes of `Y,-X,Z`: x of the job lies along +Y of the file, y against its X, and z along its Z."""
        parts = [part.strip().upper() for part in text.split(",")]
        if len(parts) != 3 or not all(re.fullmatch(r"[+-]?[XYZ]", part) for part in parts):
            raise ResultError(f"--axes: found {text!r}, expected three axes of the file such as Y,-X,Z", USAGE)
        axis = [AXES.index(part[-1]) for part in parts]
        sign = [-1 if part[0] == "-" else 1 for part in parts]
        frame = np.zeros((3, 3))
        for k in range(3):
            frame[k, axis[k]] = sign[k]
        if len(set(axis)) != 3 or np.linalg.det(frame) < 0:
            raise ResultError(
                f"--axes: found {text!r}, expected each axis once and a right-handed frame, such as X,Y,Z or Y,-X,Z",
                USAGE,
            )
        return cls((axis[0], axis[1], axis[2]), (sign[0], sign[1], sign[2]))

    def direction_in_result(self, direction: Direction, body: str) -> tuple[int, int]:
        """Direction of a result, 0 to 2 for x, y and n into the body, and the sign along it."""
        k = self.axis.index(direction.axis)
        # n is −z of the lower body and +z of the upper one.
        inwards = -1 if k == 2 and body == "lower" else 1
        return k, direction.sign * self.sign[k] * inwards


@dataclass(frozen=True)
class MeasuredPoint:
    """Nodes of a file that are the contact point of a body: of the response and of the force."""

    body: str
    response: int
    reference: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """The point of `upper=12`, or `upper=12,13` where the response is at 12 and the force at 13."""
        found = re.fullmatch(r"(\w+)=(\d+)(?:,(\d+))?", text.replace(" ", ""))
        if not found or found[1] not in BODIES.values():
            raise ResultError(
                f"--point: found {text!r}, expected a body and the node of the file at its contact point, such as "
                "upper=12, or upper=12,13 for a response at 12 and a force at 13",
                USAGE,
            )
        return cls(found[1], int(found[2]), int(found[3] or found[2]))


@dataclass(frozen=True)
class MeasuredReceptance:
    """A measured receptance in the directions of a result."""

    body: str
    directions: tuple[int, int]  # of displacement and force: 0 x, 1 y, 2 n into the body
    frequency: Floats  # [f], Hz
    receptance: Complexes  # [f], m/N
    source: MeasuredResponse

    @property
    def name(self) -> str:
        """Directions in words, e.g. `y by n`."""
        return " by ".join(NAMES[k] for k in self.directions)

    def level(self, table: Receptances) -> tuple[float, float, int] | None:
        """Mean and standard deviation of 20 lg(measured over computed), dB, at the measured frequencies that the
        result covers, and their number; None where there are none, or the result has no such body."""
        if self.body not in table.bodies or len(table.frequency) < 2:
            return None
        at = (self.frequency >= table.frequency[0]) & (self.frequency <= table.frequency[-1])
        a, b = self.directions
        computed = np.abs(table.bodies[self.body][:, a, b])
        if not at.any() or not (computed > 0).all() or not (np.abs(self.receptance[at]) > 0).all():
            return None
        known = np.interp(self.frequency[at], table.frequency, np.log10(computed))
        apart = 20 * (np.log10(np.abs(self.receptance[at])) - known)
        return float(apart.mean()), float(apart.std()), int(at.sum())


@dataclass(frozen=True)
class Overlay:
    """Measured receptances of the contact points of a result."""

    path: Path
    curves: list[MeasuredReceptance]
    left: int  # frequency responses of other nodes

    @classmethod
    def read(cls, path: Path, points: Sequence[str], axes: str | None) -> "Overlay":
        """Reads the responses at `points` (`upper=12`) with the axes of the file along x, y, z of the job (`X,Y,Z`).

        `ResultError` where points or axes are not given, or nothing was measured there.
        """
        file = UniversalFile.read(path)
        if not file.responses:
            has = ", ".join(file.others[:8]) or f"{len(file.modes)} modes"
            raise ResultError(f"{path}: found no frequency response (dataset 58, function type 4); it has {has}")
        if not points or axes is None:
            raise ResultError(
                f"{path}: say which node is the contact point of which body, and how its axes lie: --point upper=12 "
                f"--axes X,Y,Z (axes of the file along x, y, z of the job's frame). It has\n{file.listing}",
                USAGE,
            )
        frame = FileAxes.parse(axes)
        curves = []
        for point in [MeasuredPoint.parse(text) for text in points]:
            for response in file.responses:
                if (response.response.node, response.reference.node) != (point.response, point.reference):
                    continue
                (a, one), (b, other) = (
                    frame.direction_in_result(d, point.body) for d in (response.response, response.reference)
                )
                values = one * other * response.receptance
                curves.append(MeasuredReceptance(point.body, (a, b), response.frequency, values, response))
            if not any(c.body == point.body for c in curves):
                raise ResultError(
                    f"{path}: found no response at the node {point.response} by a force at {point.reference} "
                    f"(--point); it has\n{file.listing}",
                    USAGE,
                )
        return cls(path, curves, len(file.responses) - len({c.source.dataset for c in curves}))

    def on_body(self, body: str) -> list[MeasuredReceptance]:
        """Measured receptances of a body."""
        return [curve for curve in self.curves if curve.body == body]

    @staticmethod
    def expect_one_contact(result: Result) -> None:
        """`ResultError` for a result with several contacts: the points of a file are not of one of them."""
        if len(Receptances.groups(result)) > 1:
            raise ResultError(
                f"{result.path}: --measured: the result has several contacts, expected one; compare with a result of "
                "the contact where it was measured alone",
                USAGE,
            )

    def rows(self, result: Result) -> list[tuple[str, ...]]:
        """A row of words for each: body, directions, dataset, quantity, frequencies, level over the computed one."""
        self.expect_one_contact(result)
        table = Receptances.from_result(result)
        rows: list[tuple[str, ...]] = []
        for curve in self.curves:
            level = curve.level(table)
            source = curve.source
            rows.append(
                (
                    curve.body,
                    curve.name,
                    str(source.dataset),
                    source.quantity,
                    f"{source.response} by {source.reference}",
                    f"{curve.frequency[0]:.5g} to {curve.frequency[-1]:.5g}",
                    ""
                    if level is None
                    else f"{round(level[0], 1) + 0.0:+.1f} ± {level[1]:.1f} at {level[2]}".replace("-", "−"),
                )
            )
        return rows
