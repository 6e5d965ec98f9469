"""Steady rolling contact from nothing, and creep curves."""

from pathlib import Path

from clock import ROOT, benchmark, busy, noted, rows, spent
from pages import put
from report import table

PAGE = ROOT / "docs" / "performance.md"


def cold():
    """Ten random cases; every time is the best of three in one process."""
    load = busy()
    found = rows(spent([benchmark("steady_contact")]).out)
    head = ["processor time, best of 3", "smallest", "median", "largest"]
    put(PAGE, "steady", table(head, found) + "\n" + noted(load, runs=1))


def curves():
    load = busy()
    found = rows(spent([benchmark("creep_curve")]).out)
    head = ["", "residual", "time of a point", "iterations", "products", "50 points over five from nothing"]
    put(PAGE, "creep-curve", table(head, found) + "\n" + noted(load, runs=1))
