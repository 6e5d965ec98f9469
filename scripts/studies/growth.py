"""Growth rates of the narrow-curve job against the mesh at the contact, the mesh far away and the number of modes, for
both signs of the lateral creepage, with wheels that turn and at rest."""

import json

import numpy as np
from program import both, run

# Elements at the contact, elements far away (m), modes of each body.
CASES = [
    (0.001, 0.025, 40),
    (0.001, 0.025, 60),
    (0.001, 0.025, 80),
    (0.001, 0.0175, 40),
    (0.0007, 0.025, 40),
    (0.0005, 0.025, 40),
    (0.00035, 0.025, 40),
]
# Lateral creepage, direction of sliding, angular velocity in rad/s (of rolling: 10 m/s over 0.5 m).
POINTS = [
    (0.01, "actual", 20.0),
    (0.01, "actual", 0.0),
    (0.01, "rigid", 0.0),
    (-0.01, "actual", 20.0),
    (-0.01, "actual", 0.0),
]
KEYS = ["contact.creepage.lateral", "analyses.stability.direction", "bodies.lower.rotation", "bodies.upper.rotation"]
SWEEP = json.dumps({"keys": dict(zip(KEYS, zip(*[(*p, p[2]) for p in POINTS]))), "combine": "zip"})


def narrow_curve():
    rows = []
    for contact, far, modes in CASES:
        sets = both("mesh.cylinder.element_size", contact) | both("mesh.cylinder.max_element_size", far)
        sets |= {"analyses.modes.count": modes, "analyses.sweep": SWEEP, "output.fields": "false"}
        tables, seconds = run("curve.json", sets)
        if np.any(tables["sweep/status"]):
            raise SystemExit(f"sweep points failed: {tables['sweep/message']}")
        points = []
        offset = tables["sweep/offset"]
        for k, (lateral, direction, speed) in enumerate(POINTS):
            eigenvalue = tables["sweep/eigenvalue"][offset[k] : offset[k + 1]]
            shown = [e for e in eigenvalue if e.real > 0] or list(eigenvalue[:1])
            points.append(
                {
                    "lateral": lateral,
                    "direction": direction,
                    "speed": speed,
                    "growth": [[float(e.real), float(e.imag / (2 * np.pi))] for e in shown],
                }
            )
        rows.append(
            {
                "contact": contact,
                "far": far,
                "modes": modes,
                "closed": int(tables["sweep/closed"][0]),
                "gap": float(tables["modes/lower/frequency"][0] - tables["modes/upper/frequency"][0]),
                "points": points,
                "seconds": seconds,
            }
        )
    return rows
