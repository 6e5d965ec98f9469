"""Plane curves of an outline: straight lines, arcs of circles and ellipses, B-splines, polylines that stand for a
curve.

Every curve has a parameter t from 0 at its start to 1 at its end. Lengths are in the unit of the drawing until
`transformed` makes them metres.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Largest angle of an arc that one interval of quadrature spans.
_QUADRATURE_ANGLE = math.radians(45.0)
_GAUSS = np.polynomial.legendre.leggauss(10)


@dataclass(frozen=True)
class Affine:
    """The map p -> matrix p + shift of the plane."""

    matrix: Floats  # [2, 2]
    shift: Floats  # [2]

    @classmethod
    def identity(cls) -> Self:
        """The map that changes nothing."""
        return cls(np.eye(2), np.zeros(2))

    def __call__(self, points: Floats) -> Floats:
        """Images of points [..., 2]."""
        return points @ self.matrix.T + self.shift

    def after(self, first: "Affine") -> "Affine":
        """The map that applies `first`, then this one."""
        return Affine(self.matrix @ first.matrix, self(first.shift))


@dataclass(frozen=True)
class Curve(ABC):
    """A smooth curve with the group of its edges (empty: none) and its source for messages."""

    group: str
    source: str

    @abstractmethod
    def points(self, t: Floats) -> Floats:
        """Points [n, 2] at parameters [n]."""

    @abstractmethod
    def tangents(self, t: Floats) -> Floats:
        """Derivatives [n, 2] of the points with respect to the parameter."""

    @abstractmethod
    def reversed(self) -> Self:
        """The same curve from its end to its start."""

    @abstractmethod
    def transformed(self, by: Affine) -> Self:
        """The image of the curve."""

    @property
    @abstractmethod
    def breaks(self) -> Floats:
        """Parameters from 0 to 1 between which the curve is analytic and turns little."""

    def in_group(self, group: str) -> Self:
        """The curve with another group."""
        return replace(self, group=group)

    @property
    def ends(self) -> Floats:
        """Start and end, [2, 2]."""
        return self.points(np.array([0.0, 1.0]))

    def quadrature(self) -> tuple[Floats, Floats]:
        """Points [n, 2] and weighted tangents [n, 2] of Gauss quadrature along the curve."""
        low, high = self.breaks[:-1, None], self.breaks[1:, None]
        t = (0.5 * (low + high) + 0.5 * (high - low) * _GAUSS[0]).ravel()
        weight = (0.5 * (high - low) * _GAUSS[1]).ravel()
        return self.points(t), self.tangents(t) * weight[:, None]

    def length(self) -> float:
        """Arc length."""
        return float(np.linalg.norm(self.quadrature()[1], axis=1).sum())

    def chords(self, count: int = 8) -> Floats:
        """Points [n, 2] from start to end, `count` chords an interval of `breaks`."""
        steps = np.arange(count) / count
        low, high = self.breaks[:-1, None], self.breaks[1:, None]
        return self.points(np.append((low + (high - low) * steps).ravel(), 1.0))


@dataclass(frozen=True)
class Line(Curve):
    """A straight line."""

    start: Floats
    end: Floats

    def points(self, t: Floats) -> Floats:
        return self.start + np.multiply.outer(t, self.end - self.start)

    def tangents(self, t: Floats) -> Floats:
        return np.broadcast_to(self.end - self.start, (len(t), 2))

    def reversed(self) -> Self:
        return replace(self, start=self.end, end=self.start)

    def transformed(self, by: Affine) -> Self:
        return replace(self, start=by(self.start), end=by(self.end))

    @property
    def breaks(self) -> Floats:
        return np.array([0.0, 1.0])

    def chords(self, count: int = 1) -> Floats:
        return self.ends


@dataclass(frozen=True)
class Arc(Curve):
    """An arc of an ellipse, centre + major cos(a) + minor sin(a) for the angle a from `first` to `last`, rad."""

    centre: Floats
    major: Floats
    minor: Floats
    first: float
    last: float

    @classmethod
    def circular(cls, group: str, source: str, centre: Floats, radius: float, angles: tuple[float, float]) -> Self:
        """An arc of a circle between two angles, rad."""
        return cls(group, source, centre, np.array([radius, 0.0]), np.array([0.0, radius]), *angles)

    @classmethod
    def of_bulge(cls, group: str, source: str, ends: Floats, bulge: float) -> Self:
        """The arc between two points with a bulge: the tangent of a quarter of its angle, > 0 counterclockwise."""
        chord = ends[1] - ends[0]
        centre = 0.5 * (ends[0] + ends[1]) + (1.0 - bulge**2) / (4.0 * bulge) * np.array([-chord[1], chord[0]])
        first = math.atan2(*(ends[0] - centre)[::-1])
        radius = float(np.linalg.norm(ends[0] - centre))
        return cls.circular(group, source, centre, radius, (first, first + 4.0 * math.atan(bulge)))

    def points(self, t: Floats) -> Floats:
        angle = self.first + (self.last - self.first) * t
        return self.centre + np.multiply.outer(np.cos(angle), self.major) + np.multiply.outer(np.sin(angle), self.minor)

    def tangents(self, t: Floats) -> Floats:
        angle = self.first + (self.last - self.first) * t
        by_angle = np.multiply.outer(np.cos(angle), self.minor) - np.multiply.outer(np.sin(angle), self.major)
        return (self.last - self.first) * by_angle

    def reversed(self) -> Self:
        return replace(self, first=self.last, last=self.first)

    def transformed(self, by: Affine) -> Self:
        turned = {name: getattr(self, name) @ by.matrix.T for name in ("major", "minor")}
        return replace(self, centre=by(self.centre), **turned)

    @property
    def breaks(self) -> Floats:
        return np.linspace(0.0, 1.0, 1 + max(1, math.ceil(abs(self.last - self.first) / _QUADRATURE_ANGLE)))


@dataclass(frozen=True)
class Spline(Curve):
    """A piece of a B-spline between two of its parameters. `spline` is a BSpline of ezdxf, mapped by `frame`."""

    spline: Any
    frame: Affine
    first: float
    last: float
    knots: tuple[float, ...]  # all of the spline

    def _evaluated(self, t: Floats, derivative: int) -> Floats:
        at = np.clip(self.first + (self.last - self.first) * t, self.knots[0], self.knots[-1])
        found = [values[derivative] for values in self.spline.derivatives(at.tolist(), 1)]
        return np.array([[p.x, p.y] for p in found])

    def points(self, t: Floats) -> Floats:
        return self.frame(self._evaluated(t, 0))

    def tangents(self, t: Floats) -> Floats:
        return (self.last - self.first) * self._evaluated(t, 1) @ self.frame.matrix.T

    def reversed(self) -> Self:
        return replace(self, first=self.last, last=self.first)

    def transformed(self, by: Affine) -> Self:
        return replace(self, frame=by.after(self.frame))

    @property
    def breaks(self) -> Floats:
        between = sorted({(k - self.first) / (self.last - self.first) for k in self.knots})
        return np.array([0.0, *(t for t in between if 1e-9 < t < 1.0 - 1e-9), 1.0])


@dataclass(frozen=True)
class Polyline(Curve):
    """Straight lines through points that stand for one curve; t is the share of the length."""

    vertices: Floats  # [n, 2]

    def _lengths(self) -> Floats:
        return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(self.vertices, axis=0), axis=1)))

    def points(self, t: Floats) -> Floats:
        at = self._lengths()
        return np.stack([np.interp(t * at[-1], at, self.vertices[:, k]) for k in range(2)], axis=1)

    def tangents(self, t: Floats) -> Floats:
        at = self._lengths()
        place = np.clip(np.searchsorted(at, t * at[-1], side="right") - 1, 0, len(at) - 2)
        step = np.diff(self.vertices, axis=0)
        found: Floats = (step / np.linalg.norm(step, axis=1)[:, None])[place] * float(at[-1])
        return found

    def reversed(self) -> Self:
        return replace(self, vertices=self.vertices[::-1])

    def transformed(self, by: Affine) -> Self:
        return replace(self, vertices=by(self.vertices))

    @property
    def breaks(self) -> Floats:
        at = self._lengths()
        return at / float(at[-1])

    def chords(self, count: int = 1) -> Floats:
        return self.vertices
