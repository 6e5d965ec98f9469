"""The Python blocks of the pages run on results of one rank and of two, without a display.

usage: recipes.py PROGRAM [PAGE…]
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from documents import ROOT

PAGES = ("docs/reference/output.md", "docs/how-to/sweeps.md", "python/README.md")
CYLINDERS = ["bodies.lower.mesh.cylinder.element_size=0.0025", "bodies.upper.mesh.cylinder.element_size=0.0025"]
# Results that the blocks read: job, and what makes it coarse.
RESULTS = {
    "two-cylinders.h5": ("two-cylinders.json", [*CYLINDERS, "analyses.modes.count=6"]),
    "wheel-on-rail.h5": ("wheel-on-rail.json", ["analyses.modes.max_frequency=1500"]),
    "jobs/sweep-curve.h5": ("sweep-curve.json", CYLINDERS),
}
# Pictures that the blocks make, by page.
PICTURES = {"docs/reference/output.md": ["contact.png", "mode.png"]}


def blocks(page):
    """Blocks of Python of a page that read results."""
    found = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    if not found:
        raise SystemExit(f"{page}: has no block of Python: mend PAGES of tests/python/recipes.py")
    return found


def results(program, ranks, folder):
    """Makes the results in a folder."""
    (folder / "jobs").mkdir()
    for name, (job, changes) in RESULTS.items():
        line = ["mpirun", "-n", str(ranks), program, "run", str(ROOT / "jobs" / job), "--output", str(folder / name)]
        line += [word for change in changes for word in ("--set", change)]
        ran = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)
        if ran.returncode != 0:
            raise SystemExit(f"{job} on {ranks} ranks: exit code {ran.returncode}\n{ran.stderr[-2000:]}")


def faults(page, ranks, folder):
    """Faults of the blocks of a page, which run one after the other in one session."""
    code = "\n".join(blocks(page))
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    environment["PYTHONPATH"] = str(ROOT / "python")
    line = [sys.executable, "-c", code]
    ran = subprocess.run(line, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    print(f"{page} on {ranks} ranks: exit code {ran.returncode}", flush=True)
    if ran.returncode != 0:
        yield f"{page}, a result of {ranks} ranks:\n{ran.stderr[-2000:]}"
    for picture in PICTURES.get(page, ()):
        file = folder / picture
        if not file.is_file() or file.stat().st_size < 2000:
            yield f"{page}, a result of {ranks} ranks: {picture} was not made"


def main():
    if len(sys.argv) < 2 or not os.access(sys.argv[1], os.X_OK):
        sys.exit(__doc__)
    program, pages = str(Path(sys.argv[1]).resolve()), sys.argv[2:] or PAGES
    found = []
    for ranks in (1, 2):
        with tempfile.TemporaryDirectory() as name:
            results(program, ranks, Path(name))
            for page in pages:
                found += faults(page, ranks, Path(name))
    print("\n".join(found))
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
