"""Steady rolling contact from nothing, and creep curves."""

from clock import ROOT, benchmark, busy, noted, rows, spent
from pages import put
from report import table

PAGE = ROOT / "docs" / "developers" / "performance.md"


NAMES = {
    "dense": "with a matrix",
    "convolution": "half-spaces as a convolution, made within the time",
    "hybrid": 'bodies that yield as wholes beside it (`"hybrid"`)',
}


def cold():
    """Ten random cases of some 500 closed nodes, and three of many thousands; every time is the best of three in one
    process."""
    load = busy()
    found = rows(spent([benchmark("steady_contact")]).out)
    small = [[NAMES[row[0]], *row[1:]] for row in found if row[0] in NAMES]
    put(
        PAGE,
        "steady",
        table(["processor time, best of 3", "smallest", "median", "largest"], small) + "\n" + noted(load, runs=1),
    )
    head = ["nodes", "closed", "processor time, best of 3", "iterations on the finest grid", "products"]
    put(PAGE, "steady-large", table(head, [row[1:] for row in found if row[0] == "large"]) + "\n" + noted(load, runs=1))


def curves():
    load = busy()
    found = rows(spent([benchmark("creep_curve")]).out)
    head = ["", "residual", "time of a point", "iterations", "products", "50 points over five from nothing"]
    put(PAGE, "creep-curve", table(head, found) + "\n" + noted(load, runs=1))
