"""Edges of the mesh along an outline: quadratic, with their ends and middle nodes on the curves."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .curves import Curve, Floats, Line, Polyline

# Largest angle by which the outline turns along one edge.
_TURN = math.radians(22.5)
# Largest angle between straight lines that are taken for pieces of one curve.
_KINK = math.radians(20.0)
# Smallest angle by which the outline turns into the section at a re-entrant corner, where stresses are singular.
_REENTRANT = math.radians(20.0)
# Halvings of the edges at a re-entrant corner.
_HALVINGS = 4
# Furthest that points of a polyline may lie off a quadratic edge that passes them, m.
_FIT = 1e-5


@dataclass(frozen=True)
class Edge:
    """A piece of a curve between two of its parameters."""

    curve: Curve
    first: float
    last: float

    def point(self, share: float) -> Floats:
        """The point at this share of the edge's parameter, [2]."""
        found: Floats = self.curve.points(np.array([self.first + (self.last - self.first) * share]))[0]
        return found

    def between(self, low: float, high: float) -> "Edge":
        """The piece between two shares."""
        span = self.last - self.first
        return Edge(self.curve, self.first + span * low, self.first + span * high)


def divide(curves: list[Curve], size: Callable[[str], float]) -> list[Edge]:
    """Edges of a closed loop of curves, counterclockwise; `size` gives their length, m, in a group.

    Edges become shorter towards re-entrant corners: there stresses are singular, and the error of frequencies goes with
    about the first power of the size of elements.
    """
    edges = []
    joined = with_polylines(curves)
    for k, curve in enumerate(joined):
        length = size(curve.group)
        parts = _along_polyline(curve, length) if isinstance(curve, Polyline) else _along(curve, length)
        if _reentrant(joined[k - 1], curve):
            parts = _towards_start(parts)
        if _reentrant(curve, joined[(k + 1) % len(joined)]):
            parts = [1.0 - part for part in _towards_start([1.0 - part for part in parts[::-1]])[::-1]]
        edges += [Edge(curve, low, high) for low, high in zip(parts, parts[1:])]
    return edges


def _reentrant(one: Curve, other: Curve) -> bool:
    """Return true if the outline turns into the section from the end of a curve to the start of the next one."""
    before, after = one.tangents(np.array([1.0]))[0], other.tangents(np.array([0.0]))[0]
    return _turn(before, after) < -_REENTRANT


def _towards_start(parts: list[float]) -> list[float]:
    """Parameters with the first edge halved again and again towards its start."""
    first = parts[1]
    return [0.0, *(first * 0.5**k for k in range(_HALVINGS, 0, -1)), *parts[1:]]


def with_polylines(curves: list[Curve]) -> list[Curve]:
    """The loop with runs of straight lines that turn little, within one group, as polylines."""
    joined: list[list[Curve]] = []
    for curve in curves:
        if joined and _continues(joined[-1][-1], curve):
            joined[-1].append(curve)
        else:
            joined.append([curve])
    if len(joined) > 1 and _continues(joined[-1][-1], joined[0][0]):
        joined[0] = joined.pop() + joined[0]
    made = []
    for run in joined:
        if len(run) == 1:
            made.append(run[0])
        else:
            vertices = np.array([run[0].ends[0], *(line.ends[1] for line in run)])
            made.append(Polyline(run[0].group, run[0].source, vertices))
    return made


def _continues(one: Curve, other: Curve) -> bool:
    """Returns whether two straight lines of one group follow each other with a small turn."""
    if not (isinstance(one, Line) and isinstance(other, Line)) or one.group != other.group:
        return False
    return abs(_turn(one.end - one.start, other.end - other.start)) < _KINK


def _turn(a: Floats, b: Floats) -> float:
    return math.atan2(float(a[0] * b[1] - a[1] * b[0]), float(a @ b))


def _along(curve: Curve, size: float) -> list[float]:
    """Parameters of the ends of edges along a smooth curve, evenly spaced by length, halved where it turns much."""
    fine = np.unique(np.concatenate([np.linspace(low, high, 33) for low, high in zip(curve.breaks, curve.breaks[1:])]))
    points, tangents = curve.points(fine), curve.tangents(fine)
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    turns = [abs(_turn(a, b)) for a, b in zip(tangents, tangents[1:])]
    turned = np.append(0.0, np.cumsum(turns))
    count = max(math.ceil(length[-1] / size - 1e-6), math.ceil(turned[-1] / _TURN - 1e-6), 1)
    even = np.interp(np.linspace(0.0, length[-1], count + 1), length, fine)
    even[0], even[-1] = 0.0, 1.0
    parts = [0.0]
    for low, high in zip(even, even[1:]):
        turn = float(np.diff(np.interp([low, high], fine, turned))[0])
        pieces = max(1, math.ceil(turn / (1.5 * _TURN)))
        parts += np.linspace(low, high, pieces + 1)[1:].tolist()
    return parts


def _along_polyline(curve: Polyline, size: float) -> list[float]:
    """Parameters of the ends of edges along a polyline: an edge passes as many points as a quadratic one can."""
    at, vertices = curve.breaks, curve.vertices
    length = float(np.linalg.norm(np.diff(vertices, axis=0), axis=1).sum())
    parts, k = [0.0], 0
    while k < len(at) - 1:
        last = k + 1
        while last + 1 < len(at) and (at[last + 1] - at[k]) * length <= 1.001 * size and _fits(curve, k, last + 1):
            last += 1
        pieces = max(1, math.ceil((at[last] - at[k]) * length / size - 1e-6))
        parts += np.linspace(at[k], at[last], pieces + 1)[1:].tolist()
        k = last
    return parts


def _fits(curve: Polyline, first: int, last: int) -> bool:
    """Returns whether points of a polyline lie on the quadratic edge from one of them to another, and turn little."""
    at, vertices = curve.breaks, curve.vertices
    steps = np.diff(vertices[first : last + 1], axis=0)
    if sum(abs(_turn(a, b)) for a, b in zip(steps, steps[1:])) > _TURN:
        return False
    a, b, m = curve.points(np.array([at[first], at[last], 0.5 * (at[first] + at[last])]))
    s = (2.0 * (at[first + 1 : last] - at[first]) / (at[last] - at[first]) - 1.0)[:, None]
    quadratic = 0.5 * s * (s - 1.0) * a + 0.5 * s * (s + 1.0) * b + (1.0 - s * s) * m
    return bool(np.linalg.norm(quadratic - vertices[first + 1 : last], axis=1).max() <= _FIT)
