"""Forces and frequencies on 1, 2 and 3 ranks."""

import numpy as np
from program import both, run


def agreement():
    sets = both("mesh.cylinder.element_size", 0.001) | {
        "bodies.upper.material.young": 70e9,
        "contact.normal_load": 40e3,
        "contact.creepage.longitudinal": 0.001,
        "contact.creepage.spin": 0.1,
        "analyses.modes.count": 10,
        "output.fields": "false",
    }
    names = ["contact/force", "contact/approach", "modes/lower/frequency", "modes/upper/frequency"]
    first, rows = None, []
    for ranks in (1, 2, 3):
        tables, seconds = run("two-cylinders.json", sets, ranks=ranks)
        values = {name: np.atleast_1d(tables[name]).astype(float) for name in names}
        first = first or values
        # Lists of modes may differ in length where a cluster at the end is completed.
        shared = {name: min(len(values[name]), len(first[name])) for name in names}
        difference = {
            name: float(
                np.abs(values[name][: shared[name]] - first[name][: shared[name]]).max() / np.abs(first[name]).max()
            )
            for name in names
        }
        rows.append({"ranks": ranks, "difference": difference, "seconds": seconds})
    return rows
