"""Steady curving of a two-axle bogie: an independent model, beside which the program's own can be laid.

    python3 scripts/studies/curving_model.py           writes docs/data/curving_bogie.csv
    python3 scripts/studies/curving_model.py limits    compares with closed forms

Needs numpy alone. Frames, signs and units are those of curving_contact.py: track frame at each axle, curve to the
right for R > 0. Every local minimum of the vertical distance between the touching line of the yawed, rolled wheel and
the rail is a contact if the bodies overlap there: normal force by Hertz, tangential force by Kalker's linear theory
with the saturation of Shen, Hedrick and Elkins. Unknowns of an axle are shift, yaw, height, roll and angular velocity;
the frame of the bogie is eliminated, as its equations are linear.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from curving_contact import Array, Circle, Cone, Ellipse, Touch, TrackGeometry, creep_force, hertz

TABLE = Path(__file__).resolve().parents[2] / "docs/data/curving_bogie.csv"


@dataclass
class Vehicle:
    """Geometry, load and suspension of the bogie, SI. Stiffnesses are those of one axle box."""

    geometry: TrackGeometry = field(default_factory=TrackGeometry)
    load: float = 120e3
    friction: float = 0.35
    half_base: float = 1.25
    half_boxes: float = 1.0
    along: float = 10e6
    across: float = 5e6
    unbalanced: float = 0.0  # lateral force on an axle, N
    drive: float = 0.0  # torque on an axle, Nm


@dataclass
class Contact:
    """Forces at one contact, on the wheel in track axes (N), with the creepages."""

    touch: Touch
    ellipse: Ellipse
    creepages: tuple[float, float, float]
    longitudinal: float  # F_x, forward
    tangential: float  # T, along y of the contact
    lateral: float
    vertical: float


@dataclass
class Axle:
    """State of an axle and the resultants of its contacts: forces in N, moments about its centre in Nm."""

    shift: float
    yaw: float
    height: float
    roll: float
    spin: float  # angular velocity over speed, 1/m
    contacts: list[Contact]
    resultants: Array  # lateral, vertical, about x, about z, about the axle


def axle_forces(v: Vehicle, curvature: float, state: Array) -> Axle:
    """Contact forces on an axle. state: shift, yaw, height, roll, angular velocity over speed; curvature: 1/R."""
    yaw, roll, spin = state[1], state[3], state[4]
    sums, contacts = np.zeros(5), []
    for side in (1, -1):
        for t in v.geometry.touches(side, state[:4]):
            ellipse = hertz(t.approach, t.along, t.across)
            c, s = np.cos(t.angle), np.sin(t.angle)
            creepages = (
                1 - t.track * curvature - spin * t.radius,
                yaw / c,
                spin * np.sin(t.angle - roll) + c * curvature,
            )
            fx, tangential = creep_force(ellipse, creepages, v.friction)
            fy, fz = ellipse.force * s + tangential * c, -ellipse.force * c + tangential * s
            about_x, about_z = t.lateral * fz - t.radius * fy, t.forward * fy - t.lateral * fx
            sums += [fy, fz, about_x, about_z, t.radius * (fx + tangential * yaw / c)]
            contacts.append(Contact(t, ellipse, creepages, fx, tangential, fy, fz))
    return Axle(*state, contacts, sums)


def axle_equilibrium(v: Vehicle, curvature: float, place: Array, start: Array | None = None) -> Axle:
    """Axle of given shift and yaw in vertical, roll and torque equilibrium, by damped Newton with differences.

    start: height, roll, angular velocity over speed; by default those of first touch. The axle goes at most 60 um,
    60 urad or 0.02 1/m in a step. Raises ArithmeticError where the residual stays above 10 mN or 1 mNm.
    """
    scales = np.array([1e3, 1e3, 1e2])  # N, Nm, Nm
    differences, limits = np.array([1e-9, 1e-9, 1e-7]), np.array([60e-6, 60e-6, 2e-2])
    u = np.array([*v.geometry.first_touch(*place), 1 / v.geometry.radius]) if start is None else start.copy()

    def residual(u: Array) -> Array:
        _, vertical, about_x, _, torque = axle_forces(v, curvature, np.array([*place, *u])).resultants
        return np.array([vertical + v.load, about_x, torque - v.drive]) / scales

    f = residual(u)
    for _ in range(60):
        if np.max(np.abs(f)) < 1e-8:
            break
        jacobian = np.column_stack([(residual(u + d * e) - f) / d for d, e in zip(differences, np.eye(3))])
        try:
            step = np.linalg.solve(jacobian, -f)
        except np.linalg.LinAlgError:
            step = np.array([30e-6, 0.0, 0.0])  # in the air: downwards
        step *= min(1.0, np.min(limits / np.maximum(np.abs(step), 1e-300)))
        part = 1.0
        while part > 1e-3:
            trial = residual(u + part * step)
            if np.linalg.norm(trial) < (1 - 1e-4 * part) * np.linalg.norm(f):
                break
            part *= 0.5
        u, f = u + part * step, trial
    if np.max(np.abs(f)) > 1e-5:
        where = f"{1e3 * place[0]:.4f} mm, {1e3 * place[1]:.4f} mrad"
        raise ArithmeticError(f"axle at {where}: residual {f} kN, kNm, 0.1 kNm")
    return axle_forces(v, curvature, np.array([*place, *u]))


def frame_equilibrium(v: Vehicle, curvature: float, shifts: Array, yaws: Array) -> tuple[Array, Array, Array]:
    """Shift and yaw of the frame in equilibrium, lateral forces and yaw moments of the suspension on both axles."""
    b, side = v.half_base, np.array([1.0, -1.0])
    lateral_stiffness, yaw_stiffness = 2 * v.across, 2 * v.along * v.half_boxes**2

    def suspension(place: Array) -> tuple[Array, Array]:
        lateral = -lateral_stiffness * (shifts - place[0] - side * b * place[1] + 0.5 * b * b * curvature)
        return lateral, -yaw_stiffness * (yaws - place[1] + side * b * curvature)

    def total(place: Array) -> Array:
        lateral, moment = suspension(place)
        return np.array([np.sum(lateral), np.sum(side * b * lateral + moment)])

    free = total(np.zeros(2))
    place = np.linalg.solve(np.column_stack([total(e) - free for e in np.eye(2)]), -free)
    return place, *suspension(place)


@dataclass
class Bogie:
    """A bogie in equilibrium: axles, shift and yaw of the frame, suspension's forces and moments on the axles."""

    axles: list[Axle]
    frame: Array
    lateral: Array
    moment: Array
    residual: float  # the largest one, kN or kNm
    steps: int

    def places(self) -> Array:
        """Shift and yaw of both axles, a start for another radius."""
        return np.array([p for a in self.axles for p in (a.shift, a.yaw)])


def bogie_equilibrium(v: Vehicle, curvature: float, start: Array, tolerance: float = 1e-7, most: int = 60) -> Bogie:
    """Equilibrium from start = (y1, yaw1, y2, yaw2), by damped Newton with differences.

    Steps of 0.4 mm and 2 mrad at most. Raises ArithmeticError where an axle has no equilibrium on the way or the
    residual stays above `tolerance` (kN, kNm).
    """
    difference, limits = 1e-8, np.array([0.4e-3, 2e-3] * 2)
    memory: list[Array | None] = [None, None]

    def equilibrium(i: int, q: Array) -> Axle:
        place = q[2 * i : 2 * i + 2]
        if memory[i] is not None:
            try:
                return axle_equilibrium(v, curvature, place, memory[i])
            except ArithmeticError:
                pass
        return axle_equilibrium(v, curvature, place)

    def residual(q: Array, axles: list[Axle]) -> Array:
        _, lateral, moment = frame_equilibrium(v, curvature, q[::2], q[1::2])
        return 1e-3 * np.ravel(
            [(a.resultants[0] + lateral[i] + v.unbalanced, a.resultants[3] + moment[i]) for i, a in enumerate(axles)]
        )

    q = np.array(start, float)
    axles = [equilibrium(i, q) for i in (0, 1)]
    f = residual(q, axles)
    for count in range(most):
        if np.max(np.abs(f)) < tolerance:
            frame, lateral, moment = frame_equilibrium(v, curvature, q[::2], q[1::2])
            return Bogie(axles, frame, lateral, moment, float(np.max(np.abs(f))), count)
        memory = [np.array([a.height, a.roll, a.spin]) for a in axles]
        jacobian = np.empty((4, 4))
        for k, e in enumerate(np.eye(4)):
            moved, varied = q + difference * e, list(axles)
            varied[k // 2] = equilibrium(k // 2, moved)
            jacobian[:, k] = (residual(moved, varied) - f) / difference
        step = np.linalg.solve(jacobian, -f)
        step *= min(1.0, np.min(limits / np.maximum(np.abs(step), 1e-300)))
        part = 1.0
        while True:
            try:
                axles = [equilibrium(i, q + part * step) for i in (0, 1)]
                trial = residual(q + part * step, axles)
                if np.linalg.norm(trial) < (1 - 1e-4 * part) * np.linalg.norm(f) or part < 0.02:
                    break
            except ArithmeticError:
                if part < 1e-3:
                    raise
            part *= 0.5
        q, f = q + part * step, trial
    raise ArithmeticError(f"1/R = {curvature:.3e}: residual {np.max(np.abs(f)):.1e} kN, kNm after {most} steps")


# Radius, m, and start: y, mm, and yaw, mrad, of both axles. None goes on from the line above.
RADII: list[tuple[float, float, list[float] | None]] = [
    (0.35, 1000, [-4.0, -1.0, -1.0, 0.4]),
    (0.35, 600, [-5.9, -2.5, -1.2, 0.25]),
    (0.35, 500, None),
    (0.35, 450, None),
    (0.35, 260, [-6.244, -8.1, 2.0, -0.5]),
    (0.35, 300, None),
    (0.35, 240, [-6.242, -9.0, 3.0, -0.56]),
    (0.35, 220, None),
    (0.35, 200, None),
    (0.35, 180, None),
    (0.35, 150, None),
    (0.50, 150, None),
]
REPORTED = (1000, 600, 450, 300, 200, 150)
COLUMNS = (
    "friction [1],radius [m],axle [1 leading],y [mm],yaw [mrad],roll [mrad],wheel [side],wheel_y [mm],delta [mrad],"
    "r [mm],N [kN],a [mm],b [mm],xi [1e-3],eta [1e-3],phi [1/m],Fx [kN],T [kN],F_lateral [kN],x_forward [mm],"
    "Y_suspension [kN],M_suspension [kNm]"
)


def rows(v: Vehicle, radius: float, bogie: Bogie) -> list[str]:
    """Lines of the table, one a contact."""
    lines = []
    for i, axle in enumerate(bogie.axles):
        for c in sorted(axle.contacts, key=lambda c: -c.touch.track):
            t, e = c.touch, c.ellipse
            xi, eta, phi = c.creepages
            fields = [
                f"{v.friction},{radius},{i + 1},{1e3 * axle.shift:.4f},{1e3 * axle.yaw:.4f},{1e3 * axle.roll:.4f}",
                f"{t.side},{1e3 * t.wheel:.3f},{1e3 * t.angle:.2f},{1e3 * t.radius:.3f},{1e-3 * e.force:.3f}",
                f"{1e3 * e.along:.3f},{1e3 * e.across:.3f},{1e3 * xi:.4f},{1e3 * eta:.4f},{phi:.4f}",
                f"{1e-3 * c.longitudinal:.3f},{1e-3 * c.tangential:.3f},{1e-3 * c.lateral:.3f},{1e3 * t.forward:.2f}",
                f"{1e-3 * bogie.lateral[i]:.3f},{1e-3 * bogie.moment[i]:.3f}",
            ]
            lines.append(",".join(fields))
    return lines


def write_table() -> None:
    """Writes the bogie in curves of 1000 to 150 m to the table of reference values."""
    v, lines, places = Vehicle(), {}, None
    for friction, radius, start in RADII:
        v.friction = friction
        bogie = bogie_equilibrium(v, 1 / radius, places if start is None else 1e-3 * np.array(start))
        places = bogie.places()
        print(f"R {radius} m, mu {friction}: {bogie.steps} steps, residual {bogie.residual:.1e} kN, kNm", flush=True)
        if radius in REPORTED:
            lines[friction, -radius] = rows(v, radius, bogie)
    head = [
        "# Steady curving of a bogie to the right, made by scripts/studies/curving_model.py with contact of its own.",
        "# Wheels S1002 (radius 460 mm, running circles 1500 mm apart) on rails 60E1 of 1:40 (arcs of 300, 80, 13 mm",
        "# that meet 20.456 and 52.053 mm apart), gauge 1435 mm 14 mm down. Axles 2.5 m apart, axle load 120 kN,",
        "# primary suspension 10 MN/m along and 5 MN/m across a box, boxes +-1 m from the middle; balanced, no drive;",
        "# E = 210 GPa, nu = 0.3; creep forces by Shen, Hedrick and Elkins. Frame x forward, y right, z down; forces",
        "# on the wheel; xi, eta, phi rail minus wheel, x back; a along, b across; x_forward from the axle's centre;",
        "# right is the inner side.",
    ]
    TABLE.write_text("\n".join(head + [COLUMNS] + [line for key in sorted(lines) for line in lines[key]]) + "\n")


def compare_limits() -> None:
    """Prints limits with closed forms: free conical wheelsets, a stiff primary suspension, the mirrored curve."""
    cone, head, half, nominal, radius = 0.05, 0.300, 0.745, 0.46, 2000.0
    # The right-hand contact of the middle position is at `half`, the wheel's radius is nominal there.
    rail = Circle(head, half + head * np.sin(np.arctan(cone)))
    geometry = TrackGeometry(Cone(cone), rail, nominal, 2 * half)
    free = Vehicle(geometry, along=1e-2, across=1e-2)
    bogie = bogie_equilibrium(free, 1 / radius, np.array([-3e-3, 0.0, -3e-3, 0.0]))
    familiar = -half * nominal / (cone * radius)
    expected = familiar * (1 - cone * (nominal + head) / half)
    for i, a in enumerate(bogie.axles):
        print(
            f"free cone, axle {i + 1}: y {1e3 * a.shift:.4f} mm (closed form {1e3 * expected:.4f}, at the rail"
            f" {1e3 * familiar:.4f}), yaw {1e3 * a.yaw:.1e} mrad, xi {[f'{c.creepages[0]:.1e}' for c in a.contacts]}"
        )
    radius = 300.0
    start = 1e-3 * np.array([-6.2429, -6.6148, 0.5337, -0.3703])
    soft = Vehicle()
    stiff = replace(soft, along=1e10, across=1e10)
    for along in (1e7, 3e7, 1e8, 1e9, 1e10):
        stiff = replace(stiff, along=along, across=0.5 * along if along < 1e9 else along)
        bogie = bogie_equilibrium(stiff, 1 / radius, start)
        start = bogie.places()
    apart = -2e3 * soft.half_base / radius
    print(
        f"stiff primary: yaw_1 - yaw_2 {1e3 * (start[1] - start[3]):.4f} mrad (-2b/R = {apart:.4f}),"
        f" y_1 - y_2 {1e3 * (start[0] - start[2]):.4f} mm (2b psi_B = {2e3 * soft.half_base * bogie.frame[1]:.4f})"
    )
    radius, start = 600.0, 1e-3 * np.array([-5.9, -2.5, -1.2, 0.25])
    one, other = (bogie_equilibrium(soft, s / radius, s * start) for s in (1, -1))
    print(f"mirror: largest y_1 + y_1', psi_1 + psi_1' ... {np.max(np.abs(one.places() + other.places())):.1e} m, rad")


if __name__ == "__main__":
    if sys.argv[1:] == ["limits"]:
        compare_limits()
    else:
        write_table()
