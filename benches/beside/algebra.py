"""Tables of docs/developers/linear-algebra.md: elimination orders, solves, blocks of the modes, multigrid, low-rank
factors."""

import re
import tempfile
from pathlib import Path

from clock import DEBIAN, ROOT, benchmark, busy, noted, rows, spent
from modes import meshed, packages
from pages import put
from peers import petsc
from report import table

PAGE = ROOT / "docs" / "developers" / "linear-algebra.md"
# The annulus in uniform elements of this size, m: 94 and 279 thousand rows.
SMALL, LARGE = "0.01723", "0.0117"


def measured(*words, ranks=1, **settings):
    """Times of each step by the benchmark: {what: (wall s, CPU s, GB)}, and its other rows."""
    done = spent([benchmark("linear_algebra"), *words], ranks, settings)
    timed, others = {}, []
    for row in rows(done.out):
        if len(row) == 4 and re.fullmatch(r"[\d.]+", row[3]):
            timed[row[0]] = tuple(map(float, row[1:]))
        else:
            others.append(row)
    return timed, others


def unknowns(timed):
    return next(re.search(r"(\d+) dofs", what)[1] for what in timed if "dofs" in what)


def orderings():
    load = busy()
    timed, counted = measured("--size", LARGE, "--modes", "1", ORDERINGS="1", MODES_ONLY="1")
    names = {"Pord": "PORD", "Scotch": "SCOTCH", "Metis": "METIS on blocks"}
    body = [
        [names[name], entries, operations, f"{timed[f'factorisation, {name}'][1]:.1f} s"]
        for name, entries, operations in counted
        if name in names
    ]
    head = [f"clamped annulus, {unknowns(timed)} rows", "entries in the factor", "operations", "factorisation, CPU"]
    put(PAGE, "orderings", table(head, body) + "\n" + noted(load, runs=1))


def solves():
    load, body = busy(), []
    widths = (1, 2, 4, 8, 16, 32, 64)
    inverse = []
    for ranks, name in ((1, "one rank, CPU"), (2, "two ranks, CPU")):
        timed, _ = measured("--size", SMALL, "--modes", "1", ranks=ranks)
        repeats = {1: 5}
        each = [timed[f"{repeats.get(w, 1)} solves of {w} right-hand sides"][1] / repeats.get(w, 1) for w in widths]
        body.append([name, *(f"{t:.2f} s" for t in each)])
        factor = timed["factorisation, Metis"]
        inverse.append(
            [name, f"{factor[1]:.2f} s", *(f"{timed[f'inverse block of {n} rows'][1]:.2f} s" for n in (100, 300, 900))]
        )
    rows_of = unknowns(timed)
    put(
        PAGE,
        "solves",
        table([f"right-hand sides, {rows_of} rows", *map(str, widths)], body) + "\n" + noted(load, runs=1),
    )
    head = [f"{rows_of} rows", "factorisation", "100 rows of the inverse", "300 rows", "900 rows"]
    put(PAGE, "selected-inverse", table(head, inverse) + "\n" + noted(load, runs=1))


def blocks():
    load = busy()
    timed, sized = measured("--size", SMALL, "--modes", "40", SIZES="1", MODES_ONLY="1")
    head = ["block", "basis", "right-hand sides", "restarts", "solves, CPU s", "the rest", "in all"]
    put(PAGE, "blocks", table(head, [row for row in sized if row[0].isdigit()]) + "\n" + noted(load, runs=1))


def multigrid():
    load, body = busy(), []
    for size, patch in (("0.0025", "2.5 mm"), ("0.001", "1 mm")):
        timed, _ = measured("--size", size, "--graded", "1", GAMG="1")
        solved = next((what, took) for what, took in timed.items() if what.startswith("1 right-hand sides"))
        iterations = re.search(r"(\d+) iterations", solved[0])[1]
        took = solved[1]
        body.append(
            [
                f"{patch}, multigrid",
                unknowns(timed),
                f"{timed['set-up of multigrid'][1]:.1f} s",
                iterations,
                f"{took[1]:.1f} s",
                f"{took[2]:.2f} GB",
            ]
        )
        timed, _ = measured("--size", size, "--graded", "1", "--modes", "1")
        factor, solve = timed["factorisation, Metis"], timed["5 solves of 1 right-hand sides"]
        body.append(
            [
                f"{patch}, MUMPS",
                unknowns(timed),
                f"{factor[1]:.1f} s",
                "",
                f"{solve[1] / 5:.2f} s",
                f"{solve[2]:.2f} GB",
            ]
        )
    head = ["contact patch, tolerance 1e-9", "rows", "set-up, CPU", "iterations", "solve, CPU", "peak memory"]
    put(PAGE, "multigrid", table(head, body) + "\n" + noted(load, runs=1))


def low_rank():
    """MUMPS by petsc4py on the stiffness of two of our meshes, assembled by dolfinx."""
    programs, load, body = packages()[:1], busy(), []
    for size in (0.017, 0.0115):
        with tempfile.TemporaryDirectory() as folder:
            result, order = meshed(Path(folder), size)
            done = spent(
                [DEBIAN, ROOT / "benches/peers/low_rank.py", result, "0", "1e-9", "1e-6", "1e-4"], 1, petsc("real")
            )
        for tolerance, entries, operations, factorised, memory, solved, residual, iterations, together in (
            map(float, row) for row in rows(done.out)
        ):
            how = f"{tolerance:.0e}" if tolerance else "full rank"
            figures = [
                f"{1e-6 * entries:.0f} M",
                f"{operations:.1e}",
                f"{factorised:.1f} s",
                f"{memory:.0f} MB",
                f"{solved:.2f} s",
                f"{residual:.0e}",
                f"{iterations:.0f}",
                f"{together:.2f} s",
            ]
            body.append([str(order), how, *figures])
    head = [
        "rows",
        "dropped below",
        "entries",
        "operations",
        "factorisation, CPU",
        "memory of MUMPS",
        "a solve",
        "its residual",
        "iterations to 1e-12",
        "their time",
    ]
    put(PAGE, "low-rank", table(head, body) + "\n" + noted(load, *programs, runs=1))
