"""The annulus of docs/data/annulus_modes.csv on meshes of Gmsh, of several kinds of cells; docs/reference/meshes.md."""

import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from modes import reference
from pages import put
from program import ROOT, run
from report import table
from system import install

# Kind of cell and its edge, m.
RINGS = (("tet10", 0.0285), ("wedge15", 0.026), ("hex20", 0.02), ("tet4", 0.0205))
NAMES = {
    "tet10": "tetrahedra of 10 nodes",
    "wedge15": "wedges of 15 nodes",
    "hex20": "hexahedra of 20 nodes",
    "tet4": "tetrahedra of 4 nodes, asked for",
}


def errors(path, cells, wanted, fixed):
    given = {"path": str(path)} | ({"linear_tetrahedra": True} if cells == "tet4" else {})
    sets = {
        "bodies.lower.mesh": json.dumps({"file": given}),
        "bodies.lower.fixed": fixed,
        "analyses.modes.count": len(wanted),
        "output.fields": "false",
    }
    tables, _ = run("annulus.json", sets, groups=("modes",))
    found = np.sort(tables["modes/lower/frequency"])[: len(wanted)]
    wanted = np.sort(wanted)
    elastic = wanted > 1.0
    return abs(found[elastic] / wanted[elastic] - 1)


def rings():
    install("python3-gmsh")
    wanted, rows = reference(), []
    with tempfile.TemporaryDirectory() as folder:
        for cells, size in RINGS:
            path = Path(folder) / "ring.msh"
            command = ["/usr/bin/python3", ROOT / "meshes/make_ring.py", "--cells", cells, "--size", str(size), path]
            said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            row = [NAMES[cells], said.split()[-2]]
            for support, fixed in (("free", "[]"), ("clamped", '["inner"]')):
                error = errors(path, cells, wanted[support], fixed)
                row += [f"{error.max():.1e}", f"{np.median(error):.1e}"]
            rows.append(row)
    put(
        ROOT / "docs" / "reference" / "meshes.md",
        "rings",
        table(["cells", "nodes", "free: largest error", "median", "clamped: largest error", "median"], rows),
    )
    return {}
