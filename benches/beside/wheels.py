"""Modes of a wheel in second-order cells beside dolfinx with slepc4py, and CalculiX, on the same mesh."""

import json
import tempfile
from pathlib import Path

from clock import DEBIAN, PROGRAM, ROOT, busy, in_turn, noted, spent, stages
from modes import CALCULIX_UP_TO, calculix, deck, dolfinx, lines, packages
from pages import put
from report import table
from system import install

PAGE = ROOT / "docs" / "developers" / "performance.md"
# Kind of cell, edge length and edge length at the corners, m: 100 and 300 thousand rows of each.
WHEELS = (("tet10", 0.0255, 0.017), ("tet10", 0.0157, 0.0105), ("hex20", 0.026, 0.012), ("hex20", 0.016, 0.008))
NAMES = {"tet10": "tetrahedra of 10 nodes", "hex20": "hexahedra of 20 nodes"}
COUNT = 40
# Radius of the bore and height of the axle of the wheel as meshes/make_wheel.py --lower has it, m.
BORE = (0.095, -0.46)
MATERIAL = {"young": 210e9, "poisson": 0.3, "density": 7860}


def made(folder, cells, size, corner):
    """The mesh of the wheel and a job with its modes."""
    path = folder / "wheel.msh"
    words = [
        "--lower",
        "--cells",
        cells,
        "--size",
        size,
        "--contact-size",
        size,
        "--corner-size",
        corner,
        "--patch",
        "0.02",
        path,
    ]
    spent([DEBIAN, ROOT / "meshes/make_wheel.py", *words])
    job = {
        "version": 4,
        "bodies": {"lower": {"mesh": {"file": path.name}, "material": MATERIAL, "fixed": ["inner"]}},
        "analyses": {"modes": {"count": COUNT}},
    }
    (folder / "wheel.json").write_text(json.dumps(job))
    return folder / "wheel.json"


def wheels():
    """Two kinds of cells in two sizes, on one rank and two."""
    install("python3-gmsh")
    programs, load = packages(), busy()
    body, parts = [], []
    for cells, size, corner in WHEELS:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            job, result = made(folder, cells, size, corner), folder / "wheel.h5"

            def ours(ranks):
                return spent([PROGRAM, "run", job, "--output", result, "--force"], ranks)

            ours(1)
            times = stages(result)
            assembly, factor = times["distribution and assembly"], times["factorisation, body lower"]
            rows = deck(result, COUNT, folder / "annulus.inp", BORE, MATERIAL)
            mesh = (folder / "wheel.h5").rename(folder / "mesh.h5")
            parts.append([NAMES[cells], str(rows), f"{assembly:.2f} s", f"{factor:.2f} s", f"{assembly / factor:.2f}"])
            # The forms are compiled in the first run.
            dolfinx(mesh, COUNT, 1, *BORE)
            for ranks in (1, 2):
                names = ["railsqueal", "dolfinx + slepc4py"]
                calls = [lambda: ours(ranks), lambda: dolfinx(mesh, COUNT, ranks, *BORE)]
                if rows < CALCULIX_UP_TO and ranks == 1:
                    names.append("CalculiX")
                    calls.append(lambda: calculix(folder, COUNT, ranks))
                found, _ = lines(names, in_turn(*calls))
                body += [[NAMES[cells], f"{rows}", str(ranks), *row] for row in found]
    put(
        PAGE,
        "wheels",
        table(["cells", "rows", "ranks", "", "wall", "CPU", "memory"], body) + "\n" + noted(load, *programs),
    )
    put(
        PAGE,
        "wheel-assembly",
        table(["cells", "rows, one rank", "distribution and assembly", "factorisation", "ratio"], parts)
        + "\n"
        + noted(load, runs=1),
    )
