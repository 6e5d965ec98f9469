"""Programs that this one is compared with, as Debian 12 has them."""

import os
from pathlib import Path


def petsc(flavour):
    """The environment of petsc4py and slepc4py with real or complex numbers; `flavour` is "real" or "complex"."""
    homes = {}
    for name, base in (("PETSC_DIR", "/usr/lib/petscdir"), ("SLEPC_DIR", "/usr/lib/slepcdir")):
        found = sorted(Path(base).glob(f"*/*-linux-gnu-{flavour}"))
        if not found:
            raise SystemExit(f"{base}: no build with {flavour} numbers")
        homes[name] = str(found[-1])
    modules = os.pathsep.join(f"{home}/lib/python3/dist-packages" for home in homes.values())
    return {**homes, "PYTHONPATH": modules, "PETSC_ARCH": ""}
