"""Modes of the plain annular cylinder, clamped and free, against the converged reference."""

import csv

from program import ROOT, run


def reference():
    found = {"clamped": [], "free": []}
    with open(ROOT / "docs/data/annulus_modes.csv") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            found[row["support"]].append(float(row["frequency_Hz"]))
    return found


def annulus():
    wanted = reference()
    rows = []
    for support, fixed in (("clamped", '["inner"]'), ("free", "[]")):
        for size in (0.05, 0.025, 0.0125):
            sets = {
                "bodies.lower.mesh.cylinder.element_size": size,
                "bodies.lower.mesh.cylinder.max_element_size": size,
                "bodies.lower.fixed": fixed,
                "output.fields": "false",
            }
            tables, seconds = run("annulus.json", sets)
            found = [float(f) for f in tables["modes/lower/frequency"]][:30]
            pairs = list(zip(found, wanted[support]))
            errors = [abs(f / w - 1) for f, w in pairs if w > 1.0]
            rigid = [f for f, w in pairs if w <= 1.0]
            rows.append(
                {
                    "support": support,
                    "size": size,
                    "largest": max(errors),
                    "first": errors[0],
                    "rigid": max(rigid, default=0.0),
                    "modes": len(pairs),
                    "seconds": seconds,
                }
            )
    return rows
