"""Mass and second moments of a section, from exact integrals along its outline."""

import math
from dataclasses import dataclass
from typing import Self

from .outline import Outline


@dataclass(frozen=True)
class WheelProperties:
    """A wheel or a wheelset, the section turned about the axle y = 0."""

    area: float  # m², of the section
    volume: float  # m³
    mass: float  # kg
    centre: float  # m, x of the centre of mass
    axial: float  # kg m², moment of inertia about the axle
    diametral: float  # kg m², about a diameter through the centre of mass

    @classmethod
    def of_outline(cls, outline: Outline, density: float) -> Self:
        """Volume 2 pi int y dA, moments of inertia 2 pi rho int y^3 dA and half of it + 2 pi rho int (x - c)^2 y dA."""
        first = outline.moment(0, 1)
        centre = outline.moment(1, 1) / first
        axial = 2 * math.pi * density * outline.moment(0, 3)
        along = 2 * math.pi * density * (outline.moment(2, 1) - centre**2 * first)
        volume = 2 * math.pi * first
        return cls(outline.moment(0, 0), volume, density * volume, centre, axial, 0.5 * axial + along)

    @classmethod
    def of_half(cls, outline: Outline, density: float, middle: float) -> Self:
        """A wheelset of which the outline is one half, up to x = middle, m; the area is that of the half."""
        half = cls.of_outline(outline, density)
        diametral = half.diametral + half.mass * (half.centre - middle) ** 2
        return cls(half.area, 2 * half.volume, 2 * half.mass, middle, 2 * half.axial, 2 * diametral)

    def lines(self, density: float) -> list[str]:
        """The properties in words."""
        return [
            f"area {1e4 * self.area:.3f} cm², volume {1e3 * self.volume:.4f} dm³, mass {self.mass:.2f} kg with "
            f"{density:g} kg/m³",
            f"centre of mass at x = {1e3 * self.centre:.2f} mm",
            f"moments of inertia {self.axial:.4f} kg m² about the axle, {self.diametral:.4f} kg m² about a diameter",
        ]


@dataclass(frozen=True)
class RailProperties:
    """A rail, the section drawn along the track."""

    area: float  # m²
    mass: float  # kg/m
    height: float  # m, from the lowest point to the highest
    centroid: tuple[float, float]  # m, x, and height above the lowest point
    vertical: float  # m⁴, second moment of area about the horizontal axis through the centroid (vertical bending)
    lateral: float  # m⁴, about the vertical axis

    @classmethod
    def of_outline(cls, outline: Outline, density: float) -> Self:
        """Second moments of area about the axes through the centroid."""
        area = outline.moment(0, 0)
        x, y = outline.moment(1, 0) / area, outline.moment(0, 1) / area
        low, high = outline.box()[:, 1]
        vertical, lateral = outline.moment(0, 2) - area * y * y, outline.moment(2, 0) - area * x * x
        return cls(area, density * area, float(high - low), (x, float(y - low)), vertical, lateral)

    def lines(self, density: float) -> list[str]:
        """The properties in words."""
        x, height = self.centroid
        return [
            f"area {1e4 * self.area:.3f} cm², mass {self.mass:.3f} kg/m with {density:g} kg/m³, height "
            f"{1e3 * self.height:.2f} mm",
            f"centroid {1e3 * height:.2f} mm above the foot, x = {1e3 * x:.2f} mm",
            f"second moments of area {1e8 * self.vertical:.2f} cm⁴ (Iy, vertical bending), {1e8 * self.lateral:.2f} "
            "cm⁴ (Iz, lateral bending)",
        ]
