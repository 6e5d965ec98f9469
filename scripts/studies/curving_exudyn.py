"""Steady curving of a two-axle bogie by a multibody program: Exudyn runs it round the curve in time.

    python3 scripts/studies/curving_exudyn.py           writes docs/data/curving_exudyn.csv
    python3 scripts/studies/curving_exudyn.py 600       one radius, m, with the history of the shifts

Needs numpy and exudyn (pip install exudyn; the table was made with 1.13.6). Two wheelsets that spin and a frame are
rigid bodies in an inertial frame. The track is a circle; the bogie starts in its middle and runs until it is steady.
Exudyn has inertia, gyroscopic moments, rotations, primary suspension (connectors between the frame and points of the
axles) and the integration in time. Contact comes from curving_contact.py (profiles, Hertz, Shen, Hedrick and Elkins),
with creepages from the velocities of the wheelset's material at the contact, not from formulas of steady curving.

Axes of Exudyn: x forward at the start, y up, z to the right; the centre of the curve is at z = R. Tables are in those
of curving_contact.py: track frame, x forward, y right, z down. Gravity and cant are in the plane of the track: each
body has the force m V^2/R to the centre, so that the curve is balanced, and each axle has its load at its middle.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from curving_contact import Array, TrackGeometry, creep_force, hertz
from curving_model import COLUMNS, Axle, Bogie, Contact, Vehicle, rows
from exudyn.utilities import RigidBodyInertia

TABLE = Path(__file__).resolve().parents[2] / "docs/data/curving_exudyn.csv"
RADII = (600.0, 200.0)
SPEED = 20.0  # m/s
STEP = 6e-4  # s
DISTANCE = 30.0  # m
WHEELSET, WHEELSET_INERTIA = 1500.0, (800.0, 80.0)  # kg; kg m^2 about a diameter and about the axle
FRAME, FRAME_INERTIA = 3000.0, 3000.0  # kg; kg m^2 about the vertical
DAMPING = 30e3  # N s/m of a box, in each direction
CONTACT_DAMPING = 4e5, 2e5  # N s/m against heave and N m s against roll of an axle, which end with the transient
PULL = 2e6  # N s/m, holds the speed of the frame along the track


@dataclass
class Circle:
    """Track of radius R (m) about (0, 0, R), to the right."""

    radius: float

    def frame(self, place: Array) -> tuple[float, Array]:
        """Shift to the right (m) of a place, and the axes forward, right, down there as rows."""
        inwards = np.array([-place[0], 0.0, self.radius - place[2]])
        distance = np.linalg.norm(inwards)
        right, down = inwards / distance, np.array([0.0, -1.0, 0.0])
        return self.radius - distance, np.array([np.cross(right, down), right, down])


class Sampled(TrackGeometry):
    """Wheel and rail whose contacts are found by two steps of sampling: 0.2 mm, and 5 um round each minimum."""

    COARSE, FINE = 2e-4, 40

    def __post_init__(self) -> None:
        low, high = self.wheel.range
        self.samples = np.arange(low, high, self.COARSE)
        self.lines = self.wheel.at(self.samples)

    def minima(self, side: int, pose: Array) -> Array:
        """As of TrackGeometry, by linear interpolation of the slope between samples that are 5 um apart."""

        def crossings(y: Array, line: tuple[Array, Array] | None = None) -> tuple[Array, Array]:
            s = self.separation(side, pose, y, line)
            near = np.minimum(s.distance[:-1], s.distance[1:]) < 1e-6
            (k,) = np.nonzero((s.slope[:-1] < 0) & (s.slope[1:] >= 0) & near)
            return k, y[k] + (y[k + 1] - y[k]) * s.slope[k] / (s.slope[k] - s.slope[k + 1])

        k, _ = crossings(self.samples, self.lines)
        part = np.linspace(0.0, self.COARSE, self.FINE + 1)
        finer = [crossings(self.samples[i] + part)[1] for i in k]
        return np.concatenate(finer) if finer else np.zeros(0)


@dataclass
class Wheelset:
    """Contact forces on a wheelset, from its motion in Exudyn's axes."""

    vehicle: Vehicle
    track: Circle
    contacts: list[Contact] = field(default_factory=list)
    state: Array = field(default_factory=lambda: np.zeros(5))  # shift, yaw, height, roll, spin over speed
    resultants: Array = field(default_factory=lambda: np.zeros(5))  # as of curving_model.Axle

    def forces(self, place: Array, axle: Array, velocity: Array, turning: Array) -> tuple[Array, Array]:
        """Force and moment about the centre; place, direction of the axle to the right, velocity, angular velocity."""
        geometry = self.vehicle.geometry
        shift, axes = self.track.frame(place)
        direction, v, w = axes @ axle, axes @ velocity, axes @ turning
        roll = np.arctan2(direction[2], direction[1])
        pose = np.array([shift, np.arcsin(-direction[0]), -place[1], roll])
        along = v[0]
        self.contacts, self.state = [], np.array([*pose, -(w @ direction) / along])
        force, moment = np.zeros(3), np.zeros(3)
        for side in (1, -1):
            for t in geometry.touches(side, pose):
                here = geometry.separation(side, pose, np.array([t.wheel]))
                rail = geometry.rail.at(side * (shift + here.lateral))[0]
                arm = np.array([t.forward, t.lateral, float(rail[0] - pose[2] - here.distance[0])])
                material = v + np.cross(w, arm)
                c, s = np.cos(t.angle), np.sin(t.angle)
                bend = t.forward / self.track.radius  # direction of the rail ahead of the axle
                ahead = np.array([np.cos(bend), np.sin(bend), 0.0])
                right = np.array([-ahead[1], ahead[0], 0.0])
                down = np.array([0.0, 0.0, 1.0])
                across, up = c * right + s * down, s * right - c * down
                creepages = (material @ ahead / along, -(material @ across) / along, -(w @ up) / along)
                ellipse = hertz(t.approach, t.along, t.across)
                fx, tangential = creep_force(ellipse, creepages, self.vehicle.friction)
                f = fx * ahead + ellipse.force * up + tangential * across
                force, moment = force + f, moment + np.cross(arm, f)
                self.contacts.append(Contact(t, ellipse, creepages, fx, tangential, f[1], f[2]))
        about = sum(
            c.touch.radius * (c.longitudinal + c.tangential * pose[1] / np.cos(c.touch.angle)) for c in self.contacts
        )
        self.resultants = np.array([force[1], force[2], moment[0], moment[2], about])
        return axes.T @ force, axes.T @ moment


@dataclass
class Run:
    """The bogie in Exudyn: its system, and the numbers of its objects."""

    vehicle: Vehicle
    radius: float
    sets: list[Wheelset] = field(default_factory=list)
    shifts: list[list[float]] = field(default_factory=list)

    def build(self) -> None:
        """Bodies, primary suspension, loads and contacts."""
        v, track = self.vehicle, Circle(self.radius)
        self.container = exu.SystemContainer()
        mbs = self.mbs = self.container.AddSystem()
        ground = mbs.AddObject(eii.ObjectGround())
        origin = mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=ground))
        height, roll = v.geometry.first_touch(0.0, 0.0)
        turn = v.half_base / self.radius
        diametral, polar = WHEELSET_INERTIA

        def on_track(angle: float, inertia: RigidBodyInertia, spin: float) -> int:
            """A body that runs along the middle of the track."""
            at = [self.radius * np.sin(angle), -height, self.radius * (1 - np.cos(angle))]
            velocity = [SPEED * np.cos(angle), 0.0, SPEED * np.sin(angle)]
            heading = [0.0, -angle, 0.0]
            node = mbs.AddNode(
                eii.NodeRigidBodyRxyz(
                    referenceCoordinates=[*at, *heading],
                    initialVelocities=[*velocity, 0.0, -SPEED / self.radius, spin],
                )
            )
            return mbs.AddObject(
                eii.ObjectRigidBody(
                    mass=inertia.mass,
                    inertia=inertia.GetInertia6D(),
                    nodeNumber=node,
                )
            )

        def connect(body: int, law) -> None:
            """A force and a moment at the centre of a body, from its motion."""

            def user(mbs, t, item, displacement, rotation, velocity, turning, *_):
                a, b = rotation[0], rotation[1]
                axle = np.array([np.sin(b), -np.sin(a) * np.cos(b), np.cos(a) * np.cos(b)])
                force, moment = law(np.array(displacement), axle, np.array(velocity), np.array(turning))
                return [*(-force), *(-moment)]

            mbs.AddObject(
                eii.ObjectConnectorRigidBodySpringDamper(
                    markerNumbers=[origin, mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body))],
                    stiffness=np.zeros((6, 6)),
                    damping=np.zeros((6, 6)),
                    springForceTorqueUserFunction=user,
                )
            )

        def inwards(place: Array, mass: float) -> Array:
            """The part of gravity in the plane of the track that balances the curve."""
            return mass * SPEED**2 / self.radius * track.frame(place)[1][1]

        frame = on_track(0.0, RigidBodyInertia(mass=FRAME, inertiaTensor=np.diag([FRAME_INERTIA] * 3)), 0.0)
        node = mbs.GetObject(frame)["nodeNumber"]
        for coordinate in (1, 3, 5):  # height, roll and pitch of the frame are held: they carry no load here
            marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
            fixed = mbs.AddNode(eii.NodePointGround())
            other = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0))
            mbs.AddObject(eii.ObjectConnectorCoordinate(markerNumbers=[other, marker]))

        def pull(place: Array, axle: Array, velocity: Array, turning: Array) -> tuple[Array, Array]:
            forward = track.frame(place)[1][0]
            return PULL * (SPEED - velocity @ forward) * forward + inwards(place, FRAME), np.zeros(3)

        connect(frame, pull)
        stiffness = np.diag([v.along, 0.0, v.across, 0.0, 0.0, 0.0])
        for s in (1, -1):
            wheelset = Wheelset(v, track)
            self.sets.append(wheelset)
            body = on_track(
                s * turn,
                RigidBodyInertia(mass=WHEELSET, inertiaTensor=np.diag([diametral, diametral, polar])),
                -SPEED / v.geometry.radius,
            )

            def contact(place, axle, velocity, turning, wheelset=wheelset):
                force, moment = wheelset.forces(place, axle, velocity, turning)
                forward = track.frame(place)[1][0]
                heave, rolling = CONTACT_DAMPING
                force += np.array([0.0, -v.load - heave * velocity[1], 0.0]) + inwards(place, WHEELSET)
                tilting = turning - (turning @ axle) * axle
                return force, moment - rolling * (tilting @ forward) * forward

            connect(body, contact)
            for side in (1, -1):
                box = v.half_boxes * side
                mbs.AddObject(
                    eii.ObjectConnectorRigidBodySpringDamper(
                        markerNumbers=[
                            mbs.AddMarker(
                                eii.MarkerBodyRigid(bodyNumber=frame, localPosition=[s * v.half_base, 0, box])
                            ),
                            mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body, localPosition=[0, 0, box])),
                        ],
                        stiffness=stiffness,
                        damping=np.diag([DAMPING, 0.0, DAMPING, 0.0, 0.0, 0.0]),
                    )
                )
        mbs.Assemble()

    def solve(self, distance: float, report: bool = False) -> None:
        """Runs the bogie over a distance, m; keeps time, shifts (mm) and yaws (mrad) each metre."""
        settings = exu.SimulationSettings()
        integration = settings.timeIntegration
        integration.endTime = distance / SPEED
        integration.numberOfSteps = int(round(integration.endTime / STEP))
        integration.solverType = exu.DynamicSolverType.RK44
        integration.explicit.eliminateConstraints = True
        integration.verboseMode = 0
        settings.solution.file.write = False
        due = [0.0]

        def observe(mbs, t: float) -> bool:
            if SPEED * t >= due[0] - 1e-9:
                due[0] += 1.0
                self.shifts.append([t, *(1e3 * x for w in self.sets for x in w.state[:2])])
                if report:
                    print(" ".join(f"{x:9.4f}" for x in self.shifts[-1]), flush=True)
            return True

        self.mbs.SetPreStepUserFunction(observe)
        self.mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK44)

    def bogie(self) -> Bogie:
        """The state at the end, with the forces and moments that balance those of the contacts."""
        axles = [Axle(*w.state, w.contacts, w.resultants) for w in self.sets]
        lateral, moment = np.array([(-a.resultants[0], -a.resultants[3]) for a in axles]).T
        return Bogie(axles, np.zeros(2), lateral, moment, 0.0, 0)

    def unsteady(self) -> float:
        """Largest change of a shift (mm) or a yaw (mrad) over the last two metres."""
        return float(np.max(np.abs(np.subtract(self.shifts[-1], self.shifts[-3])[1:])))


def run(radius: float, report: bool) -> Run:
    """The bogie of the reference table in a curve, run until it is steady."""
    bogie = Run(Vehicle(Sampled()), radius)
    bogie.build()
    bogie.solve(DISTANCE, report)
    return bogie


def write_table() -> None:
    """Writes the steady states in all curves."""
    head = [
        f"# Steady curving of a bogie to the right, run in time by the multibody program Exudyn {exu.__version__}:",
        "# made by scripts/studies/curving_exudyn.py. Bogie, track, profiles, columns and signs are those of",
        f"# curving_bogie.csv. {SPEED:g} m/s, {DISTANCE:g} m from the middle of the track, Runge-Kutta steps of"
        f" {1e3 * STEP:g} ms.",
    ]
    lines = []
    for radius in RADII:
        bogie = run(radius, False)
        change = bogie.unsteady()
        head.append(f"# R {radius:g} m: shifts (mm) and yaws (mrad) change by {change:.1e} over the last 2 m.")
        print(head[-1], flush=True)
        lines += rows(bogie.vehicle, int(radius), bogie.bogie())
    TABLE.write_text("\n".join([*head, COLUMNS, *lines]) + "\n")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        one = run(float(sys.argv[1]), True)
        print("\n".join([COLUMNS, *rows(one.vehicle, int(one.radius), one.bogie())]))
        print(f"change over the last 2 m: {one.unsteady():.1e} mm, mrad")
    else:
        write_table()
