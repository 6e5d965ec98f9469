"""Unstable modes of the narrow curve against the speed, with wheels that turn and with wheels at rest."""

import numpy as np
from program import both, run

SPEEDS = [1, 3, 5, 10, 15, 20, 25, 30]


def narrow_curve():
    rows = [{"speed": v} for v in SPEEDS]
    for rotation in ("rolling", "none"):
        keys = '{"keys": {"contact.speed": %s}}' % SPEEDS
        sets = both("rotation", rotation) | {"analyses.sweep": keys}
        tables, _ = run("rolling-curve.json", sets)
        if np.any(tables["sweep/status"]):
            raise SystemExit(f"sweep points failed: {tables['sweep/message']}")
        offset = tables["sweep/offset"]
        for k, row in enumerate(rows):
            found = tables["sweep/eigenvalue"][offset[k] : offset[k + 1]]
            row[rotation] = [[float(e.real), float(e.imag / (2 * np.pi))] for e in sorted(found, key=lambda e: e.imag) if e.real > 0]
    return rows
