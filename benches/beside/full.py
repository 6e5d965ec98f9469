"""The quadratic eigenproblem of the full system beside slepc4py."""

import re
import tempfile
from pathlib import Path

from clock import DEBIAN, ROOT, Spent, benchmark, busy, in_turn, middle, noted, ratio, spent, version
from pages import put
from peers import petsc
from report import table
from system import install

PAGE = ROOT / "docs" / "developers" / "performance.md"


def parts(done, first, second):
    """CPU and wall time of the two parts and of both, and the memory."""
    found = {}
    for name, label in (("set-up", first), ("eigensolver", second), ("in all", "in all")):
        wall, cpu = re.search(rf"{label}\s+([\d.]+) s wall\s+([\d.]+) s cpu", done.out).groups()
        found[name] = Spent(float(wall), float(cpu), done.memory, "")
    return found


def beside():
    install("python3-slepc4py-complex", "libopenblas0-pthread")
    program, load = benchmark("full_stability"), busy()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "matrices.bin"
        exported = spent([program, "--size", "0.002", "--export", file])
        unknowns = exported.out.split(" unknowns")[0].split()[-1]

        def ours():
            return parts(spent([program, "--size", "0.002"]), "inverse", "eigensolver")

        def theirs():
            return parts(
                spent([DEBIAN, ROOT / "benches/peers/slepc4py_pep.py", file, 20], 1, petsc("complex")),
                "set-up",
                "solve",
            )

        found = in_turn(ours, theirs)
    rows = []
    for name in ("set-up", "eigensolver", "in all"):
        for key in ("cpu", "wall"):
            a, b = (middle(f, lambda r: getattr(r[name], key)) for f in found)
            rows.append([f"{name}, {key if key == 'wall' else 'CPU'}", f"{a:.1f} s", f"{b:.1f} s", ratio(a, b)])
    a, b = (middle(f, lambda r: r["in all"].memory) for f in found)
    rows.append(["largest memory", f"{a / 1e9:.2f} GB", f"{b / 1e9:.2f} GB", ratio(a, b)])
    head = [f"{unknowns} unknowns, 20 eigenvalues", "railsqueal", "slepc4py", "ratio"]
    put(PAGE, "full", table(head, rows) + "\n" + noted(load, f"SLEPc {version('python3-slepc4py-complex')}"))
