"""A mesh of another program: the annulus as CalculiX's own mesher makes it, its modes by CalculiX and by this program;
docs/reference/meshes.md."""

import json
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from pages import put
from program import ROOT, run
from report import table
from system import install

# CalculiX's name of the cells, what they are here, and its mesher's name for them.
KINDS = (("C3D20", "hexahedra of 20 nodes", "he20"), ("C3D8I", "hexahedra of 8 nodes, incompatible modes", "he8i"))
COUNT = 20
# The section, swept four times by a quarter; A002 to A00H are the surfaces that the mesher makes of the line l1.
RING = """pnt c0 0 -0.05 0
pnt c1 0 0.05 0
pnt p1 0 -0.05 0.1
pnt p2 0 0.05 0.1
pnt p3 0 0.05 0.5
pnt p4 0 -0.05 0.5
line l1 p1 p2 8
line l2 p2 p3 32
line l3 p3 p4 8
line l4 p4 p1 32
gsur s1 + BLEND + l1 + l2 + l3 + l4
seta r0 s s1
swep r0 r1 rot c0 c1 90 40
swep r1 r2 rot c0 c1 90 40
swep r2 r3 rot c0 c1 90 40
swep r3 r4 rot c0 c1 90 40
merg p all
merg l all
merg s all
elty all KIND
mesh all
seta bore s A002 A007 A00C A00H
comp bore do
send all abq
send bore abq nam
"""
DECK = f"""*INCLUDE, INPUT=all.msh
*INCLUDE, INPUT=bore.nam
*MATERIAL, NAME=STEEL
*ELASTIC
205e9, 0.3
*DENSITY
7800
*SOLID SECTION, ELSET=Eall, MATERIAL=STEEL
*BOUNDARY
Nbore, 1, 3
*STEP
*FREQUENCY
{COUNT}
*END STEP
"""


def ring():
    """Both programs on both meshes."""
    install("calculix-cgx", "calculix-ccx")
    rows = []
    for name, said, kind in KINDS:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            (folder / "ring.fbd").write_text(RING.replace("KIND", kind))
            (folder / "ring.inp").write_text(DECK)
            for command in (["cgx", "-bg", "ring.fbd"], ["ccx", "-i", "ring"]):
                subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
            lines = (folder / "ring.dat").read_text().splitlines()
            theirs = np.array(
                [float(line.split()[3]) for line in lines if re.match(r" +\d+ +\S+E\S+ +\S+E", line)][:COUNT]
            )
            nodes = len(
                re.findall(
                    r"^ *\d+,[^,]+,[^,]+,[^,]+$", (folder / "all.msh").read_text().partition("*ELEMENT")[0], re.M
                )
            )
            mesh = {"file": {"path": str(folder / "ring.inp"), "transform": [{"translate": [0, 0, -0.5]}]}}
            sets = {
                "bodies.lower.mesh": json.dumps(mesh),
                "bodies.lower.fixed": '["nbore"]',
                "analyses.modes.count": COUNT,
                "output.fields": "false",
            }
            ours = np.sort(run("annulus.json", sets, groups=("modes",))[0]["modes/lower/frequency"])[:COUNT]
        difference = abs(ours / theirs - 1)
        rows.append(
            [
                f"{name}, {said}",
                str(nodes),
                f"{theirs[0]:.2f}",
                f"{ours[0]:.2f}",
                f"{theirs[-1]:.1f}",
                f"{ours[-1]:.1f}",
                f"{difference.max():.0e}",
            ]
        )
    head = [
        "cells",
        "nodes",
        "first mode, CalculiX, Hz",
        "railsqueal",
        f"mode {COUNT}, CalculiX",
        "railsqueal",
        "largest difference",
    ]
    put(ROOT / "docs" / "reference" / "meshes.md", "foreign", table(head, rows))
    return {}
