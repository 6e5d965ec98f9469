"""Every dataset of a result file is in the tables of docs/reference/output.md, with its units.

usage: documented.py FILE…
"""

import re
import sys
from pathlib import Path

import h5py

DOCS = Path(__file__).parents[2] / "docs/reference/output.md"


def table():
    """Pattern of the path, and units, of each row."""
    rows = []
    for line in DOCS.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) == 5 and cells[0].startswith("`/"):
            path = re.sub(r"<\w+>", "[^/]+", cells[0].strip("`").replace(".", r"\."))
            rows.append((re.compile(path), cells[3]))
    assert len(rows) > 20, f"{DOCS} has lost its tables"
    return rows


def undocumented(path, ignore=()):
    """Faults of the datasets of a file, one line each."""
    rows, faults = table(), []

    def visit(name, item):
        if not isinstance(item, h5py.Dataset) or name.startswith(tuple(ignore)):
            return
        units = [row[1] for row in rows if row[0].fullmatch("/" + name)]
        if not units:
            faults.append(f"{path}: /{name} is not in {DOCS.name}")
        elif item.attrs.get("units") not in units and "of the key" not in units:
            faults.append(f"{path}: /{name} has units {item.attrs.get('units')!r}, {DOCS.name} says {units}")
        elif not item.attrs.get("description"):
            faults.append(f"{path}: /{name} has no description")

    with h5py.File(path) as file:
        file.visititems(visit)
    return faults


if __name__ == "__main__":
    found = [fault for path in sys.argv[1:] for fault in undocumented(path)]
    print("\n".join(found))
    sys.exit(1 if found else 0)
