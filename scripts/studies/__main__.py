"""Convergence studies with the program itself; writes docs/explanation/validation.md. Called by scripts/validate."""

import json
import sys

import drawn
import faults
import foreign
import growth
import longitudinal
import modes
import multibody
import one_point
import rail
import ranks
import report
import rotation
import steady
import surfaces
import tables
import truncation
import tutorial
import uncertain
import wheelset
from program import KEPT

import cycles
import examples
import meshes
import transient

STUDIES = {
    "half_space": steady.half_space,
    "spin": steady.spin,
    "finite_elements": steady.finite_elements,
    "modes": modes.annulus,
    "meshes": meshes.rings,
    "foreign": foreign.ring,
    "surfaces": surfaces.met,
    "growth": growth.narrow_curve,
    "one_point": one_point.narrow_curve,
    "longitudinal": longitudinal.sliding,
    "rotation": rotation.narrow_curve,
    "transient": transient.against_linear,
    "truncation": truncation.beside_all,
    "ranks": ranks.agreement,
    "faults": faults.broken,
    "cycles": cycles.followed,
    "examples": examples.worked,
    "rail": rail.compared,
    "drawn": drawn.beside,
    "multibody": multibody.compared,
    "tables": tables.written,
    "tutorial": tutorial.performed,
    "uncertain": uncertain.squeal,
    "wheelset": wheelset.meshed,
}


def main():
    wanted = sys.argv[1:] or list(STUDIES)
    unknown = [name for name in wanted if name not in STUDIES]
    if unknown:
        sys.exit(f"scripts/validate: no study {', '.join(unknown)}; there are {', '.join(STUDIES)}")
    KEPT.mkdir(parents=True, exist_ok=True)
    for name in wanted:
        print(f"== {name}", flush=True)
        (KEPT / f"{name}.json").write_text(json.dumps(STUDIES[name](), indent=1))
    found = {name: KEPT / f"{name}.json" for name in STUDIES}
    report.write({name: json.loads(path.read_text()) for name, path in found.items() if path.exists()})


main()
