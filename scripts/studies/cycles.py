"""Limit cycles of `limit-cycles.json` beside full transients of single points, and their picture."""

import json
import tempfile
from pathlib import Path

import numpy as np
from pages import put
from program import ROOT, run
from railsqueal import Result
from railsqueal.pictures import Canvas, cycles, style
from report import table
from tables import frequency

DOCS = ROOT / "docs"
# Lateral creepages of the single runs.
SINGLE = (0.008, 0.010, 0.012)


def alone(lateral):
    """Energy, J, frequency, Hz, and lateral force, N, of the last second of eight, from the most unstable mode."""
    transient = {"duration": 8, "start": {"mode": 1, "amplitude": 1e-5}, "contact_stride": 0, "modal_stride": 0}
    sets = {"analyses.sweep": "null", "contact.creepage.lateral": lateral, "analyses.transient": json.dumps(transient)}
    tables, _ = run("limit-cycles.json", sets, ranks=1, groups=("transient",))
    time, force = tables["transient/time"], tables["transient/force"]
    late = time > time[-1] - 1
    # The longitudinal force has the frequency of the motion, the lateral one twice that.
    return tables["transient/kinetic"][late].mean(), frequency(force[late, 0], time[1] - time[0]), force[late, 1].std()


def followed():
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "limit-cycles.h5"
        tables, _ = run("limit-cycles.json", {}, output=output, groups=("sweep",))
        with Result(output) as result:
            style.apply()
            cycles.pictures(result, Canvas(DOCS / "pictures", "limit-cycles", ["svg"]))
        (DOCS / "pictures" / "limit-cycles-limit-cycles.svg").replace(DOCS / "pictures" / "limit-cycles.svg")
    creepage, group = tables["sweep/values/contact.creepage.lateral"], "sweep/cycles"
    rows = []
    for lateral in SINGLE:
        energy, hertz, sway = alone(lateral)
        at = int(np.argmin(abs(creepage - lateral)))
        # Of the two waves the one to which the single run came.
        branch = int(np.argmin(abs(tables[f"{group}/frequency"][:, at] - hertz)))
        one = lambda name: tables[f"{group}/{name}"][branch, at]  # noqa: E731
        rows.append(
            [
                f"{100 * lateral:g} %",
                f"{one('frequency'):.2f} ({hertz:.2f})",
                f"{one('kinetic'):.4f} ({energy:.4f})",
                f"{one('force_rms')[1]:.1f} ({sway:.1f})",
                f"{one('time'):.2f} (8)",
            ]
        )
    head = ["lateral creepage", "Hz", "kinetic energy, J", "lateral force, N rms", "simulated, s"]
    put(DOCS / "explanation" / "limit-cycles.md", "limit-cycles-alone", table(head, rows))
    return {}
