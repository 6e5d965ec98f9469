"""A rail beside Timoshenko's beam in closed form: on pads that are spread evenly, and on pads that stand apart; and
what its length does to squeal; docs/explanation/rail.md."""

import json

import numpy as np
from pages import put
from program import ROOT, run
from report import table

PAGE = ROOT / "docs" / "explanation" / "rail.md"
STEEL = {"young": 210e9, "shear": 210e9 / 2.6, "density": 7860.0}
# 60E1, vertical: area, m²; second moment, m⁴ (EN 13674-1); the part that shears (D. J. Thompson, Railway Noise and
# Vibration, 2009).
AREA, INERTIA, SHEARED = 76.70e-4, 3.037e-5, 0.393
LOSS, SPACING = 0.02, 0.6
# One pad, and the ballast under one sleeper: N/m, loss factor; the length of a pad, m; half a sleeper, kg.
PAD, PAD_LOSS, PAD_LENGTH, SLEEPER = 120e6, 0.2, 0.15, 150.0
SUPPORTS = 61


def beam(omega, distances, foundation=0.0):
    """Displacement of the infinite beam at `distances` from a unit force, m/N, e^{+iωt}: the residues of its integral
    over the wavenumber."""
    bend = STEEL["young"] * INERTIA * (1 + 1j * LOSS)
    shear = STEEL["shear"] * AREA * SHEARED * (1 + 1j * LOSS)
    turning = STEEL["density"] * INERTIA * omega**2
    carried, turned = foundation - STEEL["density"] * AREA * omega**2, shear - turning
    a, b, c = bend * shear, bend * carried - shear * turning, carried * turned
    root = np.sqrt(b * b - 4 * a * c + 0j)
    moved = np.zeros(np.shape(distances), complex)
    for square in ((-b + root) / (2 * a), (-b - root) / (2 * a)):
        k = np.sqrt(square)
        k = k if k.imag > 0 else -k
        moved += 1j * (bend * square + turned) / (4 * a * k * square + 2 * b * k) * np.exp(1j * k * np.abs(distances))
    return moved


def layer(omega, mass=STEEL["density"] * AREA * SPACING):
    """Complex stiffness of one pad, N/m, or of the ballast under one sleeper: its dashpot has the loss factor where the
    mass swings on it."""
    return PAD * (1 + 1j * PAD_LOSS * omega / np.sqrt(PAD / mass))


def on_pads(hertz, sleepers):
    """The beam on pads that are spread evenly, on the ground or on sleepers."""
    omega = 2 * np.pi * hertz
    support = layer(omega)
    if sleepers:
        below = layer(omega, SLEEPER) - SLEEPER * omega**2
        support = support * below / (support + below)
    return complex(beam(omega, np.zeros(1), support / SPACING)[0])


def on_supports(hertz, position):
    """The beam on 61 pads that stand apart, each of five springs along its length, loaded at `position` from the middle
    of a pad."""
    omega = 2 * np.pi * hertz
    points, weights = np.polynomial.legendre.leggauss(5)
    middles = (np.arange(SUPPORTS) - SUPPORTS // 2) * SPACING
    places = (middles[:, None] + 0.5 * PAD_LENGTH * points).ravel()
    springs = np.tile(layer(omega) * 0.5 * weights, SUPPORTS)
    between = beam(omega, places[:, None] - places)
    to_load = beam(omega, places - position)
    # Forces of the springs on the beam, −s w at their places.
    forces = np.linalg.solve(between + np.diag(1 / springs), -to_load)
    return complex(beam(omega, np.zeros(1))[0] + to_load @ forces)


def receptance(job, frequencies, sets):
    """The vertical receptance of the rail of a job at its contact, m/N."""
    sets = {"bodies.lower.track.sleeper": "null", "analyses.receptance.frequency": json.dumps(frequencies)} | sets
    tables, _ = run(job, sets, ranks=1, groups=("receptance",))
    found = tables["receptance/lower"][:, 2, 2]
    return found if found.dtype.kind == "c" else found["r"] + 1j * found["i"]


def itself(found, wanted):
    """The compliance of the contact itself, which the beam has not, m/N: the real constant that leaves the least of the
    relative differences."""
    weight = 1 / abs(wanted) ** 2
    return float(np.sum(weight * (found - wanted).real) / np.sum(weight))


def even():
    hertz = np.array([100, 200, 300, 500, 800, 1000, 1500, 2000, 3000])
    ballast = {"vertical": PAD, "lateral": 40e6, "loss_factor": PAD_LOSS}
    rows = []
    for name, sleeper in (("on pads", None), ("on pads, sleepers and ballast", {"mass": SLEEPER, "ballast": ballast})):
        found = receptance("rail-receptance.json", hertz.tolist(), {"bodies.lower.track.sleeper": json.dumps(sleeper)})
        wanted = np.array([on_pads(f, sleeper) for f in hertz])
        # Above, the section shows, and not the contact alone.
        low = hertz <= 1500
        own = itself(found[low], wanted[low])
        rows.append(
            [f"{name}, over the beam", *(f"{r:.3f}" for r in abs(found - own) / abs(wanted)), f"{1e12 * own:.0f} pm/N"]
        )
    put(
        PAGE,
        "rail-on-pads",
        table(["vertical, spread evenly", *(f"{f} Hz" for f in hertz), "the contact itself"], rows),
    )
    return own


def bays(own):
    hertz = [150, 300, 500, 800, 1075, 1200]
    names = {"over a sleeper": 0.0, "between two": 0.5 * SPACING}
    rows = []
    for name, position in names.items():
        found = receptance("rail-bays.json", hertz, {"bodies.lower.track.position": position}) - own
        wanted = np.array([on_supports(f, position) for f in hertz])
        rows.append([f"{name}, over the beam", *(f"{r:.3f}" for r in abs(found) / abs(wanted))])
        rows.append([f"{name}, nm/N", *(f"{1e9 * abs(v):.2f}" for v in found)])
        rows.append([f"the beam {name}, nm/N", *(f"{1e9 * abs(v):.2f}" for v in wanted)])
    put(PAGE, "rail-on-supports", table(["vertical, 28.8 m, modes up to 3.5 kHz", *(f"{f} Hz" for f in hertz)], rows))


def lengths():
    """Growth rates of wheel-at-given-yaw.json on rails of other lengths, with dashpots at their ends and without."""
    rows = []
    for name, longitudinal in (("dashpots", 0.9), ("damping by the mass alone", 0.0)):
        for length in (14, 21, 28, 42):
            sets = {"bodies.lower.mesh.extruded.length": length, "bodies.lower.track.ends.longitudinal": longitudinal}
            tables, _ = run(
                "wheel-at-given-yaw.json",
                sets | {"analyses.modes.max_frequency": 2500, "output.fields": "false"},
                groups=("stability",),
            )
            found = sorted(
                zip(tables["stability/frequency"], tables["stability/growth_rate"], strict=True),
                key=lambda pair: -pair[1],
            )[:4]
            by_frequency = sorted(found)
            rows.append([name, length, *(f"{rate:.3f}" for _, rate in by_frequency)])
            heads = [f"{at:.0f} Hz, 1/s" for at, _ in by_frequency]
    put(PAGE, "length-of-a-rail", table(["ends", "length, m", *heads], rows))


def compared():
    bays(even())
    lengths()
    return {}
