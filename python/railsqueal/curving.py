"""Tables of steady curving: the equilibrium of a two-axle bogie in its curve, and at other radii."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from .errors import ResultError
from .result import Floats, Integers, Result
from .tables import Table

# The wheels in the order of `/curving/contacts/wheel`, and the axles.
WHEELS = ("leading inner", "leading outer", "trailing inner", "trailing outer")
AXLES = ("leading", "trailing")


@dataclass(frozen=True)
class Curving(Table):
    """Equilibrium of a bogie in a curve; a row for each of c places of contact. x forwards, y to the right, z down."""

    needs: ClassVar[str] = "curving/contacts/wheel"
    analysis: ClassVar[str] = "curving"

    curvature: float  # 1/m, positive to the right
    speed: float  # m/s
    wheelbase: float  # m
    circles: float  # m, distance of the running circles
    axle_load: float  # N
    residual: float  # relative to the load of an axle
    frame: Floats  # [2], m and rad, shift and yaw to the right
    shift: Floats  # [2], m, to the right
    yaw: Floats  # [2], rad, angle of attack, to the right
    roll: Floats  # [2], rad
    angular_speed: Floats  # [2], rad/s
    wheel: Integers  # [c], place in WHEELS
    wheel_y: Floats  # [c], m, to the field side of the running circle
    rail_y: Floats  # [c], m
    position: Floats  # [c, 2], m, ahead of the axle and to the right of the middle of the track
    contact_angle: Floats  # [c], rad
    rolling_radius: Floats  # [c], m
    normal_force: Floats  # [c], N
    half_axes: Floats  # [c, 2], m
    friction: Floats  # [c]
    creepage: Floats  # [c, 3]: longitudinal, lateral, spin in 1/m
    creep_force: Floats  # [c, 2], N, on the wheel: forwards, to the right along the tangent of the rail
    force: Floats  # [c, 3], N, on the wheel: forwards, to the right, down
    utilisation: Floats  # [c], tangential force over the bound of friction

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The equilibrium of a result."""
        cls.expect(result)
        axles, contacts = "curving/axles/", "curving/contacts/"
        table = cls(
            curvature=result.number("curving/curvature"),
            speed=result.number("curving/speed"),
            wheelbase=result.number("curving/wheelbase"),
            circles=result.number("curving/circles"),
            axle_load=result.number("curving/axle_load"),
            residual=result.number("curving/residual"),
            frame=result.array("curving/frame"),
            shift=result.array(axles + "shift"),
            yaw=result.array(axles + "yaw"),
            roll=result.array(axles + "roll"),
            angular_speed=result.array(axles + "angular_speed"),
            wheel=result.integers(contacts + "wheel"),
            wheel_y=result.array(contacts + "wheel_y"),
            rail_y=result.array(contacts + "rail_y"),
            position=result.array(contacts + "position"),
            contact_angle=result.array(contacts + "contact_angle"),
            rolling_radius=result.array(contacts + "rolling_radius"),
            normal_force=result.array(contacts + "normal_force"),
            half_axes=result.array(contacts + "half_axes"),
            friction=result.array(contacts + "friction"),
            creepage=result.array(contacts + "creepage"),
            creep_force=result.array(contacts + "creep_force"),
            force=result.array(contacts + "force"),
            utilisation=result.array(contacts + "utilisation"),
        )
        unknown = table.wheel[(table.wheel < 0) | (table.wheel >= len(WHEELS))]
        if len(unknown):
            expected = f"expected 0 to {len(WHEELS) - 1}"
            raise ResultError(f"{result.path}: curving/contacts/wheel has the value {unknown[0]}, {expected}")
        return table

    @property
    def radius(self) -> float:
        """Radius of the curve, m; infinite on straight track."""
        return 1 / abs(self.curvature) if self.curvature else float("inf")

    def curve(self) -> str:
        """The curve in words."""
        if not self.curvature:
            return f"straight track at {self.speed:g} m/s"
        side = "right" if self.curvature > 0 else "left"
        return f"curve to the {side}, radius {self.radius:.6g} m, {self.speed:g} m/s"

    def places(self, wheel: int) -> Integers:
        """Rows of the places of contact of a wheel, the one that carries most first."""
        rows = np.flatnonzero(self.wheel == wheel)
        return rows[np.argsort(-self.normal_force[rows], kind="stable")]

    def lateral_side(self, wheel: int) -> int:
        """Side of the track on which a wheel runs, +1 right, -1 left. On straight track inner is right."""
        inner, right = wheel % 2 == 0, self.curvature >= 0
        return 1 if inner == right else -1

    def name(self, place: int) -> str:
        """The wheel of a place of contact, and the position on its profile where the wheel has several."""
        wheel = int(self.wheel[place])
        several = len(self.places(wheel)) > 1
        return WHEELS[wheel] + (f" at {1e3 * self.wheel_y[place]:+.1f} mm" if several else "")


@dataclass(frozen=True)
class CurvingRadii(Table):
    """Equilibria over k radii: the place of each wheel that carries most; NaN where a curve has no equilibrium."""

    needs: ClassVar[str] = "curving/radii/radius"
    analysis: ClassVar[str] = "curving.radii"

    radius: Floats  # [k], m
    message: list[str]  # [k], empty where there is an equilibrium
    shift: Floats  # [k, 2], m, of the axles
    yaw: Floats  # [k, 2], rad
    wheel_y: Floats  # [k, 4], m
    contact_angle: Floats  # [k, 4], rad
    rolling_radius: Floats  # [k, 4], m
    normal_force: Floats  # [k, 4], N
    creepage: Floats  # [k, 4, 3]
    creep_force: Floats  # [k, 4, 2], N
    force: Floats  # [k, 4, 3], N
    utilisation: Floats  # [k, 4]
    places: Integers  # [k, 4], number of places of contact

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The equilibria of a result, by rising radius."""
        cls.expect(result)
        group = "curving/radii/"
        radius, messages = result.array(group + "radius"), result.texts(group + "message")
        order = np.argsort(radius, kind="stable")

        def array(name: str) -> Floats:
            return np.asarray(result.array(group + name)[order])

        return cls(
            radius=radius[order],
            message=[messages[k] for k in order],
            shift=array("shift"),
            yaw=array("yaw"),
            wheel_y=array("wheel_y"),
            contact_angle=array("contact_angle"),
            rolling_radius=array("rolling_radius"),
            normal_force=array("normal_force"),
            creepage=array("creepage"),
            creep_force=array("creep_force"),
            force=array("force"),
            utilisation=array("utilisation"),
            places=result.integers(group + "places")[order],
        )

    @property
    def failed(self) -> Integers:
        """Places of the radii that have no equilibrium."""
        said = np.array([bool(message) for message in self.message], dtype=bool)
        return np.flatnonzero(said | np.isnan(self.yaw).any(axis=1))
