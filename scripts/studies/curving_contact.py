"""Wheel-rail contact of the independent curving model: profiles, contact points, Hertz ellipses, creep forces.

Needs numpy alone. Track frame: x forward, y right, z down. Profiles: y to the field side, z down. Yaw is positive to
the right, roll (after the yaw) lowers the right-hand wheel. Creepages are those of the program's frame (rail minus
wheel, x back), forces are those on the wheel, x forward. SI units, angles in rad.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

YOUNG, POISSON = 210e9, 0.3
SHEAR = 0.5 * YOUNG / (1 + POISSON)
CONTACT_MODULUS = 0.5 * YOUNG / (1 - POISSON**2)  # of two like bodies
SAMPLES = 5e-5  # m, between samples of the touching line
APART = 2.5e-3  # m, the smallest distance of two contacts of a wheel
SPREAD = 0.5e-3  # m, curvatures are means over this length to either side
FLATTEST = 0.05  # 1/m, the smallest relative curvature across

Array = np.ndarray


class Profile(Protocol):
    """Profile of a wheel or a rail."""

    def at(self, y: Array) -> tuple[Array, Array]:
        """Height (m, down) and slope at y (m, to the field side)."""


class S1002:
    """The wheel profile S1002 of EN 13715 (UIC 510-2): height z (m, down) and slope at y (m, to the field side)."""

    # Polynomials in mm of the sections B and C, lowest power first.
    TREAD = [
        0,
        -3.358537058e-2,
        1.565681624e-3,
        -2.810427944e-5,
        5.844240864e-8,
        -1.562379023e-8,
        5.309217349e-15,
        -5.957839843e-12,
        2.646656573e-13,
    ]
    ROOT = [
        -4.320221063e3,
        -1.038384026e3,
        -1.065501873e2,
        -6.051367875,
        -2.054332446e-1,
        -4.169739389e-3,
        -4.687195829e-5,
        -2.252755540e-7,
    ]
    range = (-49e-3, 45e-3)

    def at(self, y: Array) -> tuple[Array, Array]:
        """Height (m) and slope at y (m), between the tip of the flange and the field side."""
        y = 1e3 * np.asarray(y, float)
        z, slope = 1.364323640 - y / 15, np.full_like(y, -1 / 15)
        for below, coefficients in ((32.15796, self.TREAD), (-26.0, self.ROOT)):
            k = y < below
            z[k] = np.polynomial.polynomial.polyval(y[k], coefficients)
            slope[k] = np.polynomial.polynomial.polyval(y[k], np.arange(1, len(coefficients)) * coefficients[1:])
        k = (y < -35) & (y >= -38.426669071)
        z[k], slope[k] = self.arc(y[k], -26.210665, 16.446, -13.0)
        k = y < -38.426669071
        z[k], slope[k] = -93.576667419 - 2.747477419 * y[k], -2.747477419
        k = y < -39.764473993
        z[k], slope[k] = self.arc(y[k], -58.558326413, 8.834924130, 20.0)
        return 1e-3 * z, slope

    @staticmethod
    def arc(y: Array, centre: float, height: float, radius: float) -> tuple[Array, Array]:
        """Height and slope of an arc, below its centre for a positive radius."""
        root = np.sqrt(radius**2 - (y - centre) ** 2)
        return height + np.sign(radius) * root, -np.sign(radius) * (y - centre) / root


@dataclass(frozen=True)
class Cone:
    """A conical wheel: its radius falls by `slope` for each unit to the field side."""

    slope: float
    range: tuple[float, float] = (-45e-3, 45e-3)

    def at(self, y: Array) -> tuple[Array, Array]:
        y = np.asarray(y, float)
        return -self.slope * y, np.full_like(y, -self.slope)


class Head:
    """A symmetric rail head of arcs that meet tangentially, canted towards the track and moved to its gauge.

    `radii` and the `widths` at which arcs meet in m, from the crown outwards; straight sides of 1:20; `cant` in rad;
    the `gauge` (m) is taken 14 mm below the highest point. `at` takes the distance from the centre of the track (m).
    """

    SIDE, DEPTH = 20.0, 14e-3

    def __init__(self, radii: list[float], widths: list[float], cant: float, gauge: float) -> None:
        # Angles of the normal at which pieces begin, and centres (y, z), from the crown to the side.
        ends, centres, centre = [], [], np.array([0.0, radii[0]])
        for k, radius in enumerate(radii):
            centres.append(centre)
            if k < len(widths):
                angle = np.arcsin((0.5 * widths[k] - centre[0]) / radius)
                ends.append(angle)
                centre = centre + (radius - radii[k + 1]) * np.array([np.sin(angle), -np.cos(angle)])
        ends.append(np.arctan(self.SIDE))
        turned = np.array([[np.cos(cant), np.sin(cant)], [-np.sin(cant), np.cos(cant)]])  # the field side rises
        mirror = np.array([-1.0, 1.0])
        order = list(range(len(radii) - 1, 0, -1))
        self.centres = np.array([turned @ (mirror * centres[k]) for k in order] + [turned @ c for c in centres])
        self.radii = np.array([radii[k] for k in order] + list(radii))
        angles = np.array([-e for e in reversed(ends)] + ends) - cant
        pieces = [0, *range(len(self.radii))]  # the break before each piece, and the last one
        points = [self.centres[k] + self.radii[k] * np.array([np.sin(a), -np.cos(a)]) for k, a in zip(pieces, angles)]
        self.breaks = np.array([p[0] for p in points])
        self.first, self.last = points[0], points[-1]
        self.sides = np.tan(angles[[0, -1]])
        self.offset, self.top = 0.0, 0.0
        y = np.linspace(self.breaks[0], self.breaks[-1], 20001)
        k = np.argmin(self.at(y)[0])
        piece = np.searchsorted(self.breaks, y[k]) - 1
        self.top = self.centres[piece][1] - self.radii[piece]
        low, high = self.breaks[0] - 5e-3, y[k]
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.at(np.array([middle]))[0][0] > self.DEPTH else (low, middle)
        self.offset = 0.5 * gauge - 0.5 * (low + high)

    def at(self, y: Array) -> tuple[Array, Array]:
        """Height below the highest point (m) and slope, at the distance y (m) from the centre of the track."""
        y = np.asarray(y, float) - self.offset
        piece = np.searchsorted(self.breaks, y) - 1
        k = np.clip(piece, 0, len(self.radii) - 1)
        centre, radius = self.centres[k], self.radii[k]
        apart = np.clip(y - centre[..., 0], -0.9999999 * radius, 0.9999999 * radius)
        root = np.sqrt(radius**2 - apart**2)
        z, slope = centre[..., 1] - root, apart / root
        before, after = piece < 0, piece >= len(self.radii)
        z = np.where(before, self.first[1] + self.sides[0] * (y - self.first[0]), z)
        z = np.where(after, self.last[1] + self.sides[1] * (y - self.last[0]), z)
        return z - self.top, np.where(before, self.sides[0], np.where(after, self.sides[1], slope))


class Circle:
    """A rail head of one radius (m) whose highest point is `centre` (m) from the centre of the track."""

    def __init__(self, radius: float, centre: float) -> None:
        self.radius, self.centre = radius, centre

    def at(self, y: Array) -> tuple[Array, Array]:
        apart = np.asarray(y, float) - self.centre
        root = np.sqrt(self.radius**2 - apart**2)
        return self.radius - root, apart / root


def rail_60e1() -> Head:
    """The head of the rail 60E1, canted 1:40, 1435 mm apart 14 mm below the tops."""
    return Head([0.300, 0.080, 0.013], [20.456e-3, 52.053e-3], np.arctan(1 / 40), 1.435)


def _elliptic(g: Array) -> tuple[Array, Array]:
    """Complete elliptic integrals K and E of the modulus e with 1 - e^2 = g^2, by the arithmetic-geometric mean."""
    a, b = np.ones_like(g), np.array(g)
    total, power = 0.5 * (1 - g**2), 1.0
    for _ in range(12):
        a, b, c = 0.5 * (a + b), np.sqrt(a * b), 0.5 * (a - b)
        total, power = total + power * c**2, 2 * power
        if np.max(np.abs(c)) < 1e-17:
            break
    whole = np.pi / (2 * a)
    return whole, whole * (1 - total)


_RATIO = np.exp(np.linspace(np.log(1e-4), -1e-6, 20001))  # short half-axis over the long one
_K, _E = _elliptic(_RATIO)
_PLANE = np.log((_K - _E) / (_E / _RATIO**2 - _K))  # log of the smaller curvature over the larger one


@dataclass
class Ellipse:
    """Hertz' ellipse: half-axes along and across the rolling direction (m) under the force N (N)."""

    along: float
    across: float
    force: float


def hertz(approach: float, along: float, across: float) -> Ellipse:
    """Ellipse of two like bodies of steel under an approach (m), of relative curvatures along and across (1/m)."""
    low, high = 0.5 * min(along, across), 0.5 * max(along, across)
    g = np.exp(np.interp(np.log(low / high), _PLANE, np.log(_RATIO)))
    k, e = (float(v[0]) for v in _elliptic(np.array([g])))
    # approach = 3 N K/(2 pi E* a), a^3 = 3 N (K - E)/(2 pi E* e^2 A)
    long = np.sqrt(approach * (k - e) / (k * (1 - g**2) * low))
    force = approach * 2 * np.pi * CONTACT_MODULUS * long / (3 * k)
    return Ellipse(long, g * long, force) if along <= across else Ellipse(g * long, long, force)


# J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (Kluwer, 1990), table E3: C11, C22, C23, each at
# nu = 0, 1/4, 1/2, for a/b = 0.1 ... 1 and for b/a = 0.1 ... 1, a along the rolling direction. C23 at a/b = 0.8 and
# nu = 1/4 is 1.15 there, taken as a misprint of 1.25.
_NARROW = np.array(
    [
        [[2.51, 3.31, 4.85], [2.51, 2.52, 2.53], [0.334, 0.473, 0.731]],
        [[2.59, 3.37, 4.81], [2.59, 2.63, 2.66], [0.483, 0.603, 0.809]],
        [[2.68, 3.44, 4.80], [2.68, 2.75, 2.81], [0.607, 0.715, 0.889]],
        [[2.78, 3.53, 4.82], [2.78, 2.88, 2.98], [0.720, 0.823, 0.977]],
        [[2.88, 3.62, 4.83], [2.88, 3.01, 3.14], [0.827, 0.929, 1.07]],
        [[2.98, 3.72, 4.91], [2.98, 3.14, 3.31], [0.930, 1.03, 1.18]],
        [[3.09, 3.81, 4.97], [3.09, 3.28, 3.48], [1.03, 1.14, 1.29]],
        [[3.19, 3.91, 5.05], [3.19, 3.41, 3.65], [1.13, 1.25, 1.40]],
        [[3.29, 4.01, 5.12], [3.29, 3.54, 3.82], [1.23, 1.36, 1.51]],
        [[3.40, 4.12, 5.20], [3.40, 3.67, 3.98], [1.33, 1.47, 1.63]],
    ]
)
_LONG = np.array(
    [
        [[10.7, 11.7, 12.9], [10.7, 12.8, 16.0], [12.2, 14.6, 18.0]],
        [[6.96, 7.78, 8.82], [6.96, 8.14, 9.79], [5.72, 6.63, 7.89]],
        [[5.57, 6.34, 7.34], [5.57, 6.40, 7.51], [3.79, 4.32, 5.01]],
        [[4.84, 5.57, 6.57], [4.84, 5.48, 6.31], [2.88, 3.24, 3.70]],
        [[4.37, 5.10, 6.11], [4.37, 4.90, 5.56], [2.35, 2.62, 2.96]],
        [[4.06, 4.78, 5.80], [4.06, 4.50, 5.04], [2.01, 2.23, 2.50]],
        [[3.82, 4.54, 5.58], [3.82, 4.21, 4.67], [1.76, 1.95, 2.18]],
        [[3.65, 4.36, 5.42], [3.65, 3.99, 4.39], [1.58, 1.75, 1.94]],
        [[3.51, 4.22, 5.30], [3.51, 3.81, 4.16], [1.44, 1.59, 1.77]],
        [[3.40, 4.12, 5.20], [3.40, 3.67, 3.98], [1.33, 1.47, 1.63]],
    ]
)


def _of_poisson(table: Array) -> Array:
    """The table at Poisson's ratio of steel: the parabola of the inverses through 0, 1/4 and 1/2."""
    n = POISSON
    weights = np.array([8 * (n - 0.25) * (n - 0.5), -16 * n * (n - 0.5), 8 * n * (n - 0.25)])
    return 1 / (weights @ np.moveaxis(1 / table, -1, 0))


def kalker(ratio: float) -> Array:
    """C11, C22, C23 at the ratio of half-axes a/b, linear between rows; beyond 0.1 and 10 those of the end."""
    table, g = (_NARROW, ratio) if ratio <= 1 else (_LONG, 1 / ratio)
    g = max(g, 0.1)
    row = min(max(int(10 * g), 1), 9)
    low, high = table[row - 1], table[row]
    return _of_poisson(low + (10 * g - row) * (high - low))


def creep_force(ellipse: Ellipse, creepages: tuple[float, float, float], friction: float) -> tuple[float, float]:
    """F_x (forward) and T (along y of the contact) on the wheel (N), saturated by Shen, Hedrick and Elkins."""
    xi, eta, phi = creepages
    area = ellipse.along * ellipse.across
    c11, c22, c23 = kalker(ellipse.along / ellipse.across)
    fx, fy = -SHEAR * area * c11 * xi, SHEAR * area * (c22 * eta - np.sqrt(area) * c23 * phi)
    linear, limit = np.hypot(fx, fy), friction * ellipse.force
    u = linear / limit
    factor = 1 - u / 3 + u * u / 27 if u < 3 else 1 / u
    return fx * factor, fy * factor


@dataclass
class Touch:
    """One contact of a wheel: places (m) relative to the axle's centre in track axes, but for `wheel` and `track`."""

    side: str
    wheel: float  # y on the wheel's profile, m
    track: float  # lateral place in the track, right +, m
    forward: float
    lateral: float
    radius: float  # rolling radius, m
    angle: float  # delta, positive where the rail falls to the right
    roll: float
    approach: float  # along the normal, m
    along: float  # relative curvature along the rolling direction, 1/m
    across: float  # relative curvature across, 1/m


@dataclass
class Separation:
    """Wheel and rail along the touching line: vertical distance (m), its slope to the field side, and both lines."""

    distance: Array
    slope: Array
    rail_slope: Array  # to the field side
    wheel_slope: Array  # to the field side
    forward: Array  # relative to the axle's centre, m
    lateral: Array


@dataclass
class TrackGeometry:
    """Wheel and rail profiles and their places: radius at the running circles, distance of the two circles (m)."""

    wheel: Profile = field(default_factory=S1002)
    rail: Profile = field(default_factory=rail_60e1)
    radius: float = 0.46
    circles: float = 1.5

    def __post_init__(self) -> None:
        low, high = self.wheel.range
        self.samples = np.linspace(low, high, int(round((high - low) / SAMPLES)) + 1)
        self.lines = self.wheel.at(self.samples)

    def separation(self, side: int, pose: Array, y: Array, line: tuple[Array, Array] | None = None) -> Separation:
        """Separation at y (m) of the wheel's profile; side +1 right, -1 left; pose: shift, yaw, height, roll.

        The points of a wheel of revolution that can touch a prismatic rail have no normal component along the track:
        sin(theta) = -r' tan(yaw), whatever the roll.
        """
        shift, yaw, height, roll = pose
        z, slope = self.wheel.at(y) if line is None else line
        r, dr = self.radius + z, side * slope
        sine = -dr * np.tan(yaw)
        cosine = np.sqrt(1 - sine**2)
        along, across = r * sine, side * (0.5 * self.circles + y)
        cy, sy, cr, sr = np.cos(yaw), np.sin(yaw), np.cos(roll), np.sin(roll)
        x, y1, z1 = cy * along - sy * across, sy * along + cy * across, r * cosine
        normal = sy * sine - cy * dr
        wheel_slope = -(cr * normal - sr * cosine) / (sr * normal + cr * cosine)
        lateral = cr * y1 - sr * z1
        rail, rail_slope = self.rail.at(side * (shift + lateral))
        distance = rail - height - sr * y1 - cr * z1
        return Separation(distance, rail_slope - side * wheel_slope, rail_slope, side * wheel_slope, x, lateral)

    def minima(self, side: int, pose: Array) -> Array:
        """Places on the wheel's profile, m, at which the vertical distance is smallest, and less than 1 um."""
        y = self.samples
        sampled = self.separation(side, pose, y, self.lines)
        near = np.minimum(sampled.distance[:-1], sampled.distance[1:]) < 1e-6
        (k,) = np.nonzero((sampled.slope[:-1] < 0) & (sampled.slope[1:] >= 0) & near)
        if not len(k):
            return np.zeros(0)
        low, high, f_low, f_high = y[k], y[k + 1], sampled.slope[k], sampled.slope[k + 1]
        for _ in range(40):  # regula falsi; the value of an end that stays is halved (Illinois)
            middle = low - f_low * (high - low) / (f_high - f_low)
            f = self.separation(side, pose, middle).slope
            left = f < 0
            f_high, f_low = np.where(left, 0.5 * f_high, f), np.where(left, f, 0.5 * f_low)
            low, high = np.where(left, middle, low), np.where(left, high, middle)
            if np.all((np.abs(f) < 1e-12) | (high - low < 1e-14)):
                break
        return middle

    def touches(self, side: int, pose: Array) -> list[Touch]:
        """Contacts of a wheel, deepest first: local minima of the vertical distance at which the bodies overlap."""
        middle = self.minima(side, pose)
        if not len(middle):
            return []
        places = self.separation(side, pose, middle)
        found: list[Touch] = []
        for i in np.argsort(places.distance):
            lateral = float(places.lateral[i])
            if places.distance[i] >= 0 or any(abs(t.lateral - lateral) < APART for t in found):
                continue
            angle = float(np.arctan(side * places.rail_slope[i]))
            ends = self.separation(side, pose, middle[i] + np.array([-SPREAD, SPREAD]))
            turn = np.arctan(ends.rail_slope) - np.arctan(ends.wheel_slope)
            length = abs(ends.lateral[1] - ends.lateral[0]) / np.cos(angle)
            radius = self.radius + float(self.wheel.at(middle[i : i + 1])[0][0])
            found.append(
                Touch(
                    side="right" if side > 0 else "left",
                    wheel=float(middle[i]),
                    track=float(pose[0]) + lateral,
                    forward=float(places.forward[i]),
                    lateral=lateral,
                    radius=radius,
                    angle=angle,
                    roll=float(pose[3]),
                    approach=float(-places.distance[i] * np.cos(angle)),
                    along=float(np.cos(angle)) / radius,
                    across=max(float(turn[1] - turn[0]) / length, FLATTEST),
                )
            )
        return found

    def first_touch(self, shift: float, yaw: float, below: float = 75e-6) -> tuple[float, float]:
        """Height (m) and roll of an axle whose wheels both touch, lowered by `below` (m)."""
        roll = 0.0
        for _ in range(30):
            pose = np.array([shift, yaw, 0.0, roll])
            right, left = (np.min(self.separation(k, pose, self.samples, self.lines).distance) for k in (1, -1))
            roll += (right - left) / self.circles
            if abs(right - left) < 1e-9:
                break
        return 0.5 * (right + left) + below, roll
