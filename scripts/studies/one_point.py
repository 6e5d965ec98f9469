"""Growth rates of the narrow-curve job with the discretised contact and with one point in its place, by each law of
point contact."""

import tempfile
from pathlib import Path

import numpy as np
from program import run

LAWS = ["linear", "shen_hedrick_elkins", "polach", "fastsim"]
CREEPAGES = [0.01, 0.006, 0.004, -0.01]


def figures(lateral, tables):
    """Results of one run: the unstable modes of the patch, or the three least stable ones, and their
    partners."""
    patch, state = tables["stability/eigenvalue"], tables["stability/state"]
    listed = max(3, int(np.sum(patch.real > 0)))
    beside = {law: tables[f"stability/point/{law}/beside"].real[:listed] for law in LAWS}
    return {
        "lateral": lateral,
        "stick": float(np.mean(state[state > 0] == 1)),
        "frequency": (patch.imag[:listed] / (2 * np.pi)).tolist(),
        "patch": patch.real[:listed].tolist(),
        "unstable_patch": int(np.sum(patch.real > 0)),
        "laws": {law: [None if np.isnan(v) else float(v) for v in values] for law, values in beside.items()},
        "unstable": {law: int(np.sum(tables[f"stability/point/{law}/eigenvalue"].real > 0)) for law in LAWS},
    }


def narrow_curve():
    sets = {"analyses.stability.contact": "point", "output.fields": "false"}
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        base = None
        for lateral in CREEPAGES:
            output = Path(folder) / f"{lateral}.h5"
            tables, _ = run(
                "curve.json",
                sets | {"contact.creepage.lateral": lateral},
                reuse=base,
                output=output,
                groups=("stability",),
            )
            base = base or output
            rows.append(figures(lateral, tables))
    return rows
