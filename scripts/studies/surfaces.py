"""Meshes that meet on a common contact grid, and a wheel on a rail in three dimensions; docs/reference/meshes.md."""

import json
import subprocess
import tempfile
from pathlib import Path

from pages import put
from program import ROOT, both, run
from report import table
from system import install

PAGE = ROOT / "docs" / "reference" / "meshes.md"
# Compliance, elements of both bodies at the contact, common grid or none, half side of the patch; m.
CASES = (
    ("fe", 2e-3, None, 8e-3),
    ("fe", 1e-3, None, 8e-3),
    ("fe", 7e-4, None, 8e-3),
    ("fe", 5e-4, None, 8e-3),
    ("fe", 1e-3, 1e-3, 8e-3),
    ("fe", 7e-4, 1e-3, 8e-3),
    ("fe", 5e-4, 1e-3, 8e-3),
    ("hybrid", 3e-3, 5e-4, 18e-3),
    ("hybrid", 5e-3, 5e-4, 20e-3),
    ("hybrid", 1e-2, 5e-4, 40e-3),
)
HALF_AXIS = 4.9e-3  # of Hertz' circle


def made(name, *options):
    """Runs a script of meshes/ with Gmsh."""
    subprocess.run(
        ["/usr/bin/python3", ROOT / "meshes" / name, *map(str, options)], check=True, stdout=subprocess.DEVNULL
    )


def lateral(sets):
    """F_y/μN of two-cylinders.json at a creepage of 0.3 %."""
    tables, _ = run("two-cylinders.json", sets | {"output.fields": "false"}, only="steady")
    force = tables["contact/force"]
    return f"{force[1] / (0.3 * abs(force[2])):.4f}"


def grown(sets):
    """The two largest growth rates of curve.json, and how far apart the first frequencies of its cylinders are."""
    sets = sets | {"analyses.modes.count": 20, "output.fields": "false"}
    tables, _ = run("curve.json", sets, groups=("modes", "stability"))
    apart = tables["modes/lower/frequency"][0] - tables["modes/upper/frequency"][0]
    return [f"{rate:.3f}" for rate in sorted(tables["stability/growth_rate"])[:-3:-1]] + [f"{apart:.4f}"]


def compliances():
    rows = []
    for kind, size, spacing, half in CASES:
        sets = both("mesh.cylinder.element_size", size)
        sets |= {"contact.patch.half_length": half, "contact.patch.half_width": half, "contact.compliance": kind}
        if spacing:
            sets["contact.grid"] = json.dumps({"half_length": 7e-3, "half_width": 7e-3, "spacing": spacing})
        # With the bodies of the narrow curve there are 20 mm to the side.
        rates = grown(sets) if half <= 20e-3 else ["–"] * 3
        grid = f"{1e3 * spacing:g}" if spacing else "its own"
        rows.append([kind, "hexahedra", f"{1e3 * size:g}", grid, f"{HALF_AXIS / size:.1f}", lateral(sets), *rates])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ring.msh"
        made("make_ring.py", "--cells", "tet10", "--size", 0.04, "--contact-size", 9e-4, path)
        turned = [{"rotate": {"axis": [1, 0, 0], "angle": 3.141592653589793}}]
        sets = {
            "bodies.lower.mesh": json.dumps({"file": str(path)}),
            "bodies.upper.mesh": json.dumps({"file": {"path": str(path), "transform": turned}}),
            "contact.patch": "null",
            "contact.grid": json.dumps(
                {"half_length": 7e-3, "half_width": 7e-3, "spacing": 7e-4, "curvatures": [4, 4]}
            ),
        }
        rows.append(
            ["fe", "tetrahedra of 10 nodes", "0.52", "0.7", f"{HALF_AXIS / 5.2e-4:.1f}", lateral(sets), "–", "–", "–"]
        )
    head = [
        "compliance",
        "cells",
        "nodes apart, mm",
        "grid, mm",
        "in the half axis",
        "F_y/μN at 0.3 %",
        "growth, 1/s",
        "second",
        "first frequencies apart, Hz",
    ]
    put(PAGE, "compliances", table(head, rows))


def three_dimensions():
    """wheel-at-given-yaw.json with each body swept and as a mesh."""
    rows, wanted = [], None
    with tempfile.TemporaryDirectory() as folder:
        wheel, rail = Path(folder) / "wheel.msh", Path(folder) / "rail.msh"
        made("make_wheel.py", "--contact-size", 0.012, "--corner-size", 0.005, "--patch", 0.036, wheel)
        made("make_rail.py", "--at", -0.005, "--contact-size", 0.008, "--patch", 0.02, rail)
        for of_wheel, of_rail in (("swept", "swept"), ("mesh", "swept"), ("swept", "mesh"), ("mesh", "mesh")):
            sets = {"analyses.modes.max_frequency": 2500, "output.fields": "false"}
            given = json.loads((ROOT / "jobs" / "wheel-on-rail-3d.json").read_text())["bodies"]
            if of_wheel == "mesh":
                sets["bodies.upper"] = json.dumps(given["upper"] | {"mesh": {"file": str(wheel)}})
            if of_rail == "mesh":
                sets["bodies.lower"] = json.dumps(given["lower"] | {"mesh": {"file": str(rail)}})
            tables, _ = run("wheel-at-given-yaw.json", sets, groups=("stability",))
            found = list(zip(tables["stability/frequency"], tables["stability/growth_rate"]))[:4]
            wanted = wanted or found
            cells = []
            for (at, rate), (known_at, known) in zip(found, wanted):
                text = f"{rate:.3f} at {at:.1f} Hz"
                cells.append(
                    text
                    if found is wanted
                    else f"{text} ({100 * (rate / known - 1):+.1f} %, {100 * (at / known_at - 1):+.2f} %)"
                )
            rows.append([of_wheel, of_rail, *cells])
    put(PAGE, "three-dimensions", table(["wheel", "rail", "growth, 1/s", "second", "third", "fourth"], rows))


def two_contacts():
    """The wheel of wheel-at-given-yaw.json where it touches the rail at two places, swept and as a mesh."""
    tables = {}
    with tempfile.TemporaryDirectory() as folder:
        wheel = Path(folder) / "wheel.msh"
        made("make_wheel.py", "--contact-size", 0.003, "--corner-size", 0.005, "--patch", 0.018, wheel)
        for of_wheel in ("swept", "mesh"):
            sets = {
                "analyses": json.dumps({"modes": {"max_frequency": 2500}, "steady": {}, "stability": {}}),
                "output.fields": "false",
                "contact.places": "all",
                "contact.normal_load": "null",
                "contact.vertical_load": 60e3,
                "contact.placement.lateral": 0.21e-3,
            }
            if of_wheel == "mesh":
                given = json.loads((ROOT / "jobs" / "wheel-on-rail-3d.json").read_text())["bodies"]["upper"]
                sets["bodies.upper"] = json.dumps(given | {"mesh": {"file": str(wheel)}})
            tables[of_wheel], _ = run("wheel-at-given-yaw.json", sets, groups=("stability", "contact", "contact_2"))
    forces = [[-t[f"{c}/force"][2] / 1e3 for c in ("contact", "contact_2")] for t in tables.values()]
    print("normal forces, kN:", forces)

    def listed(t):
        pairs = zip(t["stability/frequency"], t["stability/growth_rate"])
        return sorted((at, rate) for at, rate in pairs if at < 1500 and rate > -30)

    rows = []
    for (at, rate), (there, found) in zip(listed(tables["swept"]), listed(tables["mesh"]), strict=True):
        shift, change = 100 * (there / at - 1), 100 * (found / rate - 1)
        rows.append([f"{at:.1f}", f"{there:.1f} ({shift:+.2f} %)", f"{rate:.3f}", f"{found:.3f} ({change:+.1f} %)"])
    put(PAGE, "two-contacts", table(["swept, Hz", "mesh, Hz", "swept, 1/s", "mesh, 1/s"], rows))


def met():
    install("python3-gmsh")
    compliances()
    three_dimensions()
    two_contacts()
    return {}
