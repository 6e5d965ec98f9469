"""Unstable modes of the narrow curve against the speed, with wheels that turn and with wheels at rest: a table and a
picture."""

import tempfile
from pathlib import Path

import numpy as np
from pages import put
from program import ROOT, both, run
from report import table

SPEEDS = [1, 2, 3, 5, 7.5, 10, 15, 20, 25, 30]
JOBS = ("curve", "squeal")
# The limit of rest: so slow, with the sliding velocity of the job; the creepage is 0.8 then, of at most 1.
REST = 0.125
# Speeds that the theory shows; validation has all of them.
SHOWN = (0, 1, 3, 10, 30)
PICTURE = ROOT / "docs/pictures/rotation.svg"


def unstable(tables, k):
    offset = tables["sweep/offset"]
    found = tables["sweep/eigenvalue"][offset[k] : offset[k + 1]]
    return [[float(e.real), float(e.imag / (2 * np.pi))] for e in sorted(found, key=lambda e: e.imag) if e.real > 0]


def narrow_curve():
    rows = [{"job": job, "speed": v} for job in JOBS for v in [0, *SPEEDS]]
    for rotation in ("rolling", "none"):
        with tempfile.TemporaryDirectory() as folder:
            model = None
            for job in JOBS:
                sets = both("rotation", rotation) | {"analyses.transient": "null"}
                for speeds in ([REST], SPEEDS):
                    keys = {"analyses.sweep": '{"keys": {"contact.speed": %s}}' % speeds}
                    if speeds == [REST]:
                        keys["contact.creepage.lateral"] = 0.01 * 10 / REST
                    kept = Path(folder) / f"{job}{len(speeds)}.h5"
                    tables, _ = run(f"{job}.json", sets | keys, reuse=model, output=kept)
                    model = model or kept
                    if np.any(tables["sweep/status"]):
                        raise SystemExit(f"sweep points failed: {tables['sweep/message']}")
                    for row in (r for r in rows if r["job"] == job):
                        if row["speed"] in (speeds if len(speeds) > 1 else [0]):
                            at = speeds.index(row["speed"]) if row["speed"] else 0
                            row[rotation] = unstable(tables, at)
    draw(rows)
    listed = lambda pairs: ", ".join(f"{g:.2f} ({f:.1f})" for g, f in pairs)  # noqa: E731
    shown = [r for r in rows if r["job"] == JOBS[0] and r["speed"] in SHOWN]
    cells = [[f"{r['speed']:g}", listed(r["rolling"]), listed(r["none"])] for r in shown]
    put(ROOT / "docs/explanation/rotation.md", "rotation", table(["V, m/s", "wheels that turn", "at rest"], cells))
    return rows


def draw(rows):
    """Growth over the speed of each job: circles turn, crosses are at rest, colours tell the modes."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "railsqueal"
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(JOBS), figsize=(9, 4.2), sharey=True, layout="constrained")
    bands = [
        (380, 452, "C0", "about 423 Hz, n = 1"),
        (452, 520, "C1", "483 Hz, n = 0"),
        (520, 640, "C2", "about 575 Hz, n = 2"),
    ]
    for axis, job in zip(axes, JOBS):
        for low, high, colour, name in bands:
            for rotation, marker, words in (("rolling", "o", "turning"), ("none", "x", "at rest")):
                points = [(r["speed"], g) for r in rows if r["job"] == job for g, f in r[rotation] if low <= f < high]
                if points:
                    axis.plot(
                        *zip(*points), marker, color=colour, fillstyle="none", markersize=5, label=f"{name}, {words}"
                    )
        axis.set(title=f"jobs/{job}.json", xlabel="speed V, m/s")
        axis.grid(alpha=0.3)
    axes[0].set(ylabel="growth, 1/s", ylim=(0, None))
    figure.legend(*axes[0].get_legend_handles_labels(), fontsize=8, ncols=3, loc="outside lower center")
    figure.savefig(PICTURE, metadata={"Date": None})
    plt.close(figure)
