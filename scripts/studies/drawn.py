"""The wheel W920S and the rail 60E1 drawn in Gmsh beside the built-in sections; docs/reference/sections.md."""

import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from pages import put
from program import ROOT, run
from report import table
from system import install

# Words for the script, and the edge of its elements, mm.
DRAWINGS = {
    "triangles of 6 nodes, 12 mm": ["--size", "12"],
    "triangles of 6 nodes, 6 mm": ["--size", "6"],
    "quadrilaterals of 9 nodes, 12 mm": ["--size", "12", "--cells", "quad"],
    "triangles of 3 nodes, 6 mm": ["--size", "6", "--order", "1"],
}

RAILS = {
    "triangles of 6 nodes, 12 mm": [],
    "triangles of 6 nodes, 6 mm, 3 mm on the head": ["--size", "6", "--fine", "3"],
    "quadrilaterals of 9 nodes, 12 mm": ["--cells", "quad"],
}
PAGE = ROOT / "docs" / "reference" / "sections.md"


def beside():
    install("python3-gmsh")
    wheels()
    rails()
    return {}


def rails():
    groups = ("modes", "contact", "stability")
    rows = []

    def said(name, found):
        frequency, rates = found["modes/lower/frequency"], found["stability/growth_rate"][:4]
        force = found["contact/force"]
        rows.append(
            [
                name,
                f"{len(frequency)}",
                f"{frequency[50]:.2f}",
                f"{frequency[400]:.1f}",
                f"{force[1] / force[2]:.5f}",
                *(f"{g:.3f}" for g in rates),
            ]
        )

    with tempfile.TemporaryDirectory() as folder:
        for name, words in RAILS.items():
            path = Path(folder) / "rail.msh"
            command = ["/usr/bin/python3", ROOT / "meshes/make_rail_section.py", "--worn", "0", *words, path]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            section = {"file": {"path": str(path), "scale": 0.001}}
            said(
                name,
                run(
                    "wheel-at-given-yaw.json",
                    {"bodies.lower.mesh.extruded.section": json.dumps(section)},
                    groups=groups,
                )[0],
            )
    said("built in", run("wheel-at-given-yaw.json", {}, groups=groups)[0])
    head = [
        "section",
        "modes of the rail",
        "the 50th, Hz",
        "the 400th",
        "lateral over normal force",
        "growth, 1/s",
        "second",
        "third",
        "fourth",
    ]
    put(PAGE, "drawn-rail", table(head, rows))


def wheels():
    groups = ("modes", "contact", "stability")
    wanted, _ = run("wheel-at-given-yaw.json", {}, groups=groups)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, words in DRAWINGS.items():
            path = Path(folder) / "wheel.msh"
            command = ["/usr/bin/python3", ROOT / "meshes/make_section.py", "--straight", *words, path]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            section = {"file": {"path": str(path), "scale": 0.001, "radius": 0.46}}
            sets = {
                "bodies.upper.mesh.revolved.section": json.dumps(section),
                "bodies.upper.fixed": '["bore"]',
                "bodies.upper.damping": '{"modal": {"by_diameter": [0.002, 0.02, 0.0002]}}',
            }
            found, _ = run("wheel-at-given-yaw.json", sets, groups=groups)
            frequency, reference = (t["modes/upper/frequency"] for t in (found, wanted))
            count = min(len(frequency), len(reference))
            off = np.abs(frequency[:count] / reference[:count] - 1)
            rates = [t["stability/growth_rate"][:4] for t in (found, wanted)]
            rows.append([name, f"{len(frequency)}", f"{off.max():.1e}", *(f"{g:.3f}" for g in rates[0])])
    rows.append(["built in", f"{len(wanted['modes/upper/frequency'])}", "", *(f"{g:.3f}" for g in rates[1])])
    head = [
        "section",
        "modes up to 6 kHz",
        "largest distance of a frequency",
        "growth, 1/s",
        "second",
        "third",
        "fourth",
    ]
    put(PAGE, "drawn-wheel", table(head, rows))
