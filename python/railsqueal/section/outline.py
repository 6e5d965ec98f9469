"""The outline of a section: curves joined into one closed loop, its checks, and its integrals.

Lengths are in m, points are (x, y): x along the axle or across the track, y away from the axle or up.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .curves import Curve, Floats

Integers = NDArray[np.int64]


def place(point: Floats) -> str:
    """A point in messages, mm."""
    x, y = 1e3 * np.asarray(point)
    return f"(x = {x:.4f}, y = {y:.4f}) mm"


@dataclass(frozen=True)
class Outline:
    """One closed loop of curves, counterclockwise: each ends where the next one starts."""

    curves: list[Curve]
    tolerance: float  # m, within which ends are joined

    @classmethod
    def join(cls, curves: Sequence[Curve], tolerance: float) -> Self:
        """Joins curves whose ends lie within `tolerance`, m. `InputError` with the place of what does not close."""
        _expect_lengths(curves, tolerance)
        curves = _without_duplicates(curves, tolerance)
        ends = np.array([curve.ends for curve in curves])
        vertex = _vertices(ends.reshape(-1, 2), tolerance).reshape(-1, 2)
        _expect_pairs(curves, ends, vertex)
        loops = _loops(curves, vertex)
        if len(loops) > 1:
            raise InputError(_several(loops))
        loop = loops[0]
        outline = cls(loop, tolerance)
        if outline.moment(0, 0) < 0:
            outline = cls([curve.reversed() for curve in loop[::-1]], tolerance)
        outline._expect_simple()
        return outline

    def moment(self, p: int, q: int) -> float:
        """The integral of x^p y^q over the area: by Green's theorem that of x^(p+1)/(p+1) y^q dy along the loop."""
        total = 0.0
        for curve in self.curves:
            points, tangents = curve.quadrature()
            total += float((points[:, 0] ** (p + 1) / (p + 1) * points[:, 1] ** q * tangents[:, 1]).sum())
        return total

    def length(self) -> float:
        """Length of the loop, m."""
        return sum(curve.length() for curve in self.curves)

    def group_lengths(self) -> dict[str, float]:
        """Length of each named group, m."""
        lengths: dict[str, float] = {}
        for curve in self.curves:
            if curve.group:
                lengths[curve.group] = lengths.get(curve.group, 0.0) + curve.length()
        return lengths

    def box(self) -> Floats:
        """Least and largest x and y, [2, 2], m."""
        points = np.concatenate([curve.chords() for curve in self.curves])
        return np.array([points.min(axis=0), points.max(axis=0)])

    def _expect_simple(self) -> None:
        """`InputError` with the place where the outline crosses or touches itself."""
        chords = [curve.chords() for curve in self.curves]
        starts = np.concatenate([c[:-1] for c in chords])
        ends = np.concatenate([c[1:] for c in chords])
        owner = np.concatenate([np.full(len(c) - 1, k) for k, c in enumerate(chords)])
        crossing = first_crossing(starts, ends)
        if crossing is not None:
            i, j = crossing
            raise InputError(
                f"the outline crosses itself near {place(0.5 * (starts[i] + ends[i]))}: {self.curves[owner[i]].source} "
                "and "
                f"{self.curves[owner[j]].source}; expected a boundary that encloses one area"
            )


def first_crossing(starts: Floats, ends: Floats) -> tuple[int, int] | None:
    """Numbers of two segments of a closed polygon that cross, or None; neighbours are passed over."""
    count = len(starts)
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)

    def side(p: Floats, q: Floats, x: Floats) -> Floats:
        return (q[..., 0] - p[..., 0]) * (x[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (x[..., 0] - p[..., 0])

    for i in range(count - 2):
        rest = slice(i + 2, count - (1 if i == 0 else 0))
        near = np.flatnonzero(((low[rest] <= high[i]) & (high[rest] >= low[i])).all(axis=1)) + i + 2
        if len(near) == 0:
            continue
        p, q, a, b = starts[i], ends[i], starts[near], ends[near]
        apart = (side(p, q, a) * side(p, q, b) > 0) | (side(a, b, p) * side(a, b, q) > 0)
        if not apart.all():
            return i, int(near[np.flatnonzero(~apart)[0]])
    return None


def _expect_lengths(curves: Sequence[Curve], tolerance: float) -> None:
    if not curves:
        raise InputError("there are no curves; expected lines and arcs of an outline")
    for curve in curves:
        if curve.length() <= tolerance:
            raise InputError(
                f"{curve.source} at {place(curve.ends[0])} has no length (at most the tolerance of {1e3 * tolerance:g} "
                "mm): "
                "delete it, or give a smaller --tolerance if it is meant"
            )


def _without_duplicates(curves: Sequence[Curve], tolerance: float) -> list[Curve]:
    """`InputError` where two curves lie upon each other."""
    middles = np.array([curve.points(np.array([0.0, 0.5, 1.0])) for curve in curves])
    for k, points in enumerate(middles[:-1]):
        for order in (points, points[::-1]):
            same = np.flatnonzero((np.abs(middles[k + 1 :] - order) <= tolerance).all(axis=(1, 2)))
            if len(same):
                other = curves[k + 1 + int(same[0])]
                raise InputError(
                    f"{curves[k].source} and {other.source} are the same curve, from {place(points[0])} to "
                    f"{place(points[-1])}: delete one"
                )
    return list(curves)


def _vertices(points: Floats, tolerance: float) -> Integers:
    """Number of the vertex of each point: points within `tolerance` of one another are one vertex."""
    number = np.arange(len(points), dtype=np.int64)
    for k, point in enumerate(points):
        near = np.flatnonzero(np.linalg.norm(points[k:] - point, axis=1) <= tolerance) + k
        number[np.isin(number, number[near])] = number[near].min()
    return number


def _expect_pairs(curves: Sequence[Curve], ends: Floats, vertex: Integers) -> None:
    """`InputError` where an end is alone, with the nearest other one, or where more than two meet."""
    count = Counter(vertex.ravel().tolist())
    flat, numbers = ends.reshape(-1, 2), vertex.ravel()
    alone = [k for k in range(len(flat)) if count[numbers[k]] == 1]
    if alone:
        lines = []
        for k in alone[:4]:
            line = f"{place(flat[k])}, an end of {curves[k // 2].source}"
            others = [j for j in alone if j != k]
            if others:
                gaps = np.linalg.norm(flat[others] - flat[k], axis=1)
                nearest = others[int(np.argmin(gaps))]
                line += f"; the nearest open end is {1e3 * gaps.min():.4g} mm away at {place(flat[nearest])}"
            lines.append(line)
        more = f"\n  and {len(alone) - 4} more" if len(alone) > 4 else ""
        raise InputError(
            f"the outline is open, with {len(alone)} ends that meet no other:\n  "
            + "\n  ".join(lines)
            + more
            + "\n  Close the drawing, leave out layers of other lines by --ignore LAYER, or give a larger --tolerance"
        )
    for k in range(len(flat)):
        if count[numbers[k]] > 2:
            sources = ", ".join(curves[j // 2].source for j in np.flatnonzero(numbers == numbers[k]).tolist())
            raise InputError(
                f"{count[numbers[k]]} ends of curves meet at {place(flat[k])} ({sources}); expected two, the outline "
                "of one area"
            )


def _loops(curves: Sequence[Curve], vertex: Integers) -> list[list[Curve]]:
    """The closed loops that curves make whose ends meet in pairs."""
    at: dict[int, list[int]] = {}
    for k, (start, end) in enumerate(vertex.tolist()):
        at.setdefault(start, []).append(k)
        at.setdefault(end, []).append(k)
    left = dict.fromkeys(range(len(curves)))
    loops = []
    while left:
        k = next(iter(left))
        first, here = int(vertex[k, 0]), int(vertex[k, 1])
        del left[k]
        loop = [curves[k]]
        while here != first:
            k = next(j for j in at[here] if j in left)
            del left[k]
            forward = int(vertex[k, 0]) == here
            loop.append(curves[k] if forward else curves[k].reversed())
            here = int(vertex[k, 1 if forward else 0])
        loops.append(loop)
    return loops


def _several(loops: list[list[Curve]]) -> str:
    lines = []
    for loop in loops[:4]:
        points = np.concatenate([curve.chords() for curve in loop])
        layers = ", ".join(sorted({curve.group for curve in loop if curve.group})) or "without a group"
        lines.append(f"{len(loop)} curves from {place(points.min(axis=0))} to {place(points.max(axis=0))} ({layers})")
    return (
        f"the drawing has {len(loops)} closed outlines:\n  "
        + "\n  ".join(lines)
        + "\n  Expected one: draw one half of a wheel, "
        "without holes, and leave out layers of other lines by --ignore LAYER"
    )
