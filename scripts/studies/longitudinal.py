"""Longitudinal sliding, where the term V ∂x acts on the directions that friction damps: growth rates against the grid
spacing."""

import numpy as np
from program import both, run

SIZES = (0.002, 0.0014, 0.001, 0.0007)
# Modes that the contact moves much, Hz, and the part of it within which they are looked for: it moves with the mesh.
FREQUENCIES, NEAR = (458.0, 522.0, 800.0), 0.02
# Damping ratio up to which an eigenvalue counts as a mode.
RATIO = 0.2


def spectrum(size):
    # At rest, where the contact damps one wave of a pair and leaves the other alone.
    sets = (
        both("mesh.cylinder.element_size", size)
        | both("rotation", "none")
        | {
            "contact.creepage.longitudinal": 0.01,
            "contact.creepage.lateral": 0.0,
            "analyses.modes.count": 20,
            "analyses.sweep": '{"keys": {"contact.friction": [0.3]}}',
            "output.fields": "false",
            "output.reduced": "false",
        }
    )
    tables, seconds = run("curve.json", sets)
    values = tables["sweep/eigenvalue"]
    return values[(values.imag > 0) & (-values.real < RATIO * abs(values))], int(tables["sweep/closed"][0]), seconds


def sliding():
    rows = []
    for size in sorted(SIZES):
        values, closed, seconds = spectrum(size)
        picked = []
        for height in 2 * np.pi * np.array(FREQUENCIES):
            near = values[np.abs(values.imag - height) < NEAR * height]
            # Of a pair of equal frequencies the contact damps one.
            picked.append(
                None
                if not len(near)
                else [float(near[near.real.argmin()].real), float(near[near.real.argmin()].imag / (2 * np.pi))]
            )
        rows.append(
            {
                "size": size,
                "closed": closed,
                "modes": picked,
                "unstable": int((values.real > 0).sum()),
                "seconds": seconds,
            }
        )
    return rows[::-1]
