"""A wheelset as a body of revolution beside a mesh of hexahedra of the same section; docs/explanation/wheelset.md."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from pages import put
from program import ROOT, run
from report import table

STEEL = {"young": 210e9, "poisson": 0.3, "density": 7860}
# Springs that hold nothing, N/m: the mesh is free.
SOFT = {"longitudinal": 1, "lateral": 1, "vertical": 1, "journals": [-1, 1]}
REACH = 1100  # Hz


def modes(mesh, **more):
    """Frequencies of the elastic modes, Hz, ascending, and their names where they have some."""
    body = {"mesh": mesh, "material": STEEL} | more
    sets = {
        "bodies.lower": json.dumps(body),
        "analyses.modes": json.dumps({"max_frequency": REACH}),
        "output.fields": "false",
    }
    found, _ = run("annulus.json", sets, groups=("modes",))
    frequency = found["modes/lower/frequency"]
    names = [""] * len(frequency)
    if "modes/lower/family" in found:
        text = [f.decode() if isinstance(f, bytes) else str(f) for f in found["modes/lower/family"]]
        names = [f"({int(n)}, {family})" for n, family in zip(found["modes/lower/diameters"], text)]
    listed = sorted(zip(frequency.tolist(), names))
    return [(f, name) for f, name in listed if f > 1.0]


def meshed():
    with tempfile.TemporaryDirectory() as folder:
        body, half = (Path(folder) / name for name in ("wheelset.msh", "half.msh"))
        command = [sys.executable, ROOT / "meshes/make_wheelset.py", body, half]
        said = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
        section = {"file": {"path": str(half), "radius": 0.46, "middle": 0.75}}
        swept = modes({"revolved": {"section": section}}, suspension=SOFT)
        solid = modes({"file": {"path": str(body)}})
    if len(swept) != len(solid):
        raise SystemExit(f"{len(swept)} modes of the section up to {REACH} Hz, {len(solid)} of the mesh")
    rows, k = [], 0
    while k < len(swept):
        frequency, name = swept[k]
        # Both modes of a pair have one frequency.
        pair = 2 if k + 1 < len(swept) and swept[k + 1][1] == name else 1
        found = float(np.mean([f for f, _ in solid[k : k + pair]]))
        rows.append([name, f"{frequency:.2f}", f"{found:.2f}", f"{100 * (found / frequency - 1):+.3f} %"])
        k += pair
    head = ["mode", "section, Hz", f"{said[1]} hexahedra, {said[3]} nodes, Hz", "difference"]
    put(ROOT / "docs" / "explanation" / "wheelset.md", "wheelset-mesh", table(head, rows))
    return {}
