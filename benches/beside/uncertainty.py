"""Time of the samples of a study of uncertain squeal: friction and creepages on one model, loads and places."""

import tempfile
from pathlib import Path

import h5py
from clock import ROOT, busy, middle, noted, run
from pages import put
from report import table

PAGE = ROOT / "docs" / "explanation" / "uncertainty.md"
# Job, what is uncertain, and numbers of samples.
STUDIES = (
    ("uncertain-friction.json", "friction, both creepages, damping", (512, 2048, 10_000)),
    ("uncertain-load.json", "the same and the load", (512, 10_000)),
    ("uncertain-place.json", "friction, lateral shift, yaw, load", (512, 10_000)),
)
RANKS = 2
WAYS = {1: "counted", 3: "not counted", 4: "with missing ones", 5: "from points that went astray", 2: "searched for"}


def samples():
    """Whole runs with more and more samples, once each: their clock, processor time, and that of a further sample."""
    load, body = busy(), []
    with tempfile.TemporaryDirectory() as name:
        result = Path(name) / "samples.h5"
        for job, what, counts in STUDIES:
            last = None
            for count in counts:
                sets = {"analyses.uncertainty.samples": count}
                found = [run(job, "--output", result, "--force", sets=sets, ranks=RANKS)]
                with h5py.File(result) as file:
                    search, status = (file[f"uncertainty/{part}"][()] for part in ("search", "status"))
                # As /uncertainty/search has them: continued and counted, uncounted, with missing ones, gone astray.
                ways = ", ".join(f"{(search == k).sum()} {name}" for k, name in WAYS.items())
                print(f"   {ways}, {(status != 0).sum()} failed", flush=True)
                wall, cpu = (middle(found, key) for key in ("wall", "cpu"))
                further = f"{(wall - last[1]) / (count - last[0]):.3f} s" if last else ""
                last = (count, wall)
                shown = [f"{wall:.0f} s", f"{cpu:.0f} s", further]
                body.append([what if count == counts[0] else "", f"{count:,}".replace(",", " "), *shown])
    head = ["uncertain", "samples", "clock", "processor", "clock for each further sample"]
    put(PAGE, "uncertain-samples", table(head, body) + "\n" + noted(load, runs=1))
