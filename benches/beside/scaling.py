"""docs/developers/scaling.md: what more ranks would give, from what each of them would have to do and to send."""

import re
import tempfile
from dataclasses import dataclass
from pathlib import Path

from clock import ROOT, benchmark, busy, noted, rows, spent
from pages import put
from report import table

PAGE = ROOT / "docs" / "developers" / "scaling.md"
RANKS = (1, 2, 4, 8, 16, 32, 64)
# The annulus in uniform elements of this size, m: 94 and 279 thousand rows.
SIZES = ("0.01723", "0.0117")
# A cluster of today: s for a message, bytes a second of one rank. A node has several ranks on one memory: what each
# gets of it.
LATENCY, BANDWIDTH = 2e-6, 2e9


@dataclass
class Work:
    """Work and messages of the ranks of one run: operations and entries of the factor, of all ranks and of the busiest
    one; messages and bytes that the busiest rank sends."""

    flops: float
    flops_max: float
    entries: float
    entries_max: float
    messages: int
    sent: int


def called(program, size, ranks, way, **settings):
    return spent([program, "--size", size, "--modes", "40"], ranks, {"COUNTS": way, **settings})


def worked(program, size, ranks):
    """One run without anything twice, whose messages Open MPI counts."""
    with tempfile.TemporaryDirectory() as folder:
        monitoring = {"enable": "2", "enable_output": "3", "filename": f"{folder}/sent"}
        done = called(
            program,
            size,
            ranks,
            "once",
            **{f"OMPI_MCA_pml_monitoring_{key}": value for key, value in monitoring.items()},
        )
        sent = [sends(path.read_text()) for path in Path(folder).glob("sent.*.prof")]
    counted = next(row[1:] for row in rows(done.out) if row[0] == "counted")
    # Programs of one rank are not monitored.
    return Work(*map(float, counted), max((m for m, _ in sent), default=0), max((b for _, b in sent), default=0))


def sends(text):
    """Messages and bytes that a rank sent to others: its own and those of its collective calls (lines `E|I from to N
    bytes M msgs sent`)."""
    lines = re.findall(r"^[EI]\t(\d+)\t(\d+)\t(\d+) bytes\t(\d+) msgs", text, re.MULTILINE)
    others = [(int(messages), int(size)) for here, there, size, messages in lines if here != there]
    return sum(m for m, _ in others), sum(b for _, b in others)


def parts(program, size):
    """Times of a run on one rank, s: {part: time}, and its rows."""
    timed = {row[0]: float(row[1]) for row in rows(called(program, size, 1, "parts").out) if row[0] != "counted"}
    assembly, modes = (next(what for what in timed if what.startswith(word)) for word in ("assembly", "modes"))
    solves = timed["3 solves of 8 right-hand sides"] / 24 * int(re.search(r"\d+", modes)[0])
    found = {
        "mesh and order of elimination": timed["mesh on one rank"]
        + timed["its parts"]
        + timed["ordering and analysis"],
        "factorisation": timed["factorisation alone"],
        "solves": solves,
        "assembly, products, bases": timed[assembly] + timed[modes] - solves,
    }
    return found, re.search(r"\d+", assembly)[0]


def expected(one, work, ranks):
    """The parts of a run on so many ranks: one rank's work is what the busiest of them has to do."""
    return {
        "mesh and order of elimination": one["mesh and order of elimination"],
        "factorisation": one["factorisation"] * work.flops_max / work.flops,
        "solves": one["solves"] * work.entries_max / work.entries,
        "assembly, products, bases": one["assembly, products, bases"] / ranks,
        "messages": work.messages * LATENCY + work.sent / BANDWIDTH,
    }


def ranks():
    program, load = benchmark("linear_algebra"), busy()
    counts, times = [], []
    for size in SIZES:
        one, order = parts(program, size)
        alone = sum(one.values())
        for count in RANKS:
            work = worked(program, size, count)
            flops, entries = work.flops_max / work.flops * count, work.entries_max / work.entries * count
            counts.append(
                [
                    order,
                    str(count),
                    f"{work.flops:.1e}",
                    f"{flops:.2f}",
                    f"{1e-6 * work.entries:.0f} M",
                    f"{entries:.2f}",
                    str(work.messages),
                    f"{1e-6 * work.sent:.0f} MB",
                ]
            )
            there = expected(one, work, count)
            whole = sum(there.values())
            times.append(
                [order, str(count), *(f"{t:.2f}" for t in there.values()), f"{whole:.2f}", f"{alone / whole:.1f}"]
            )
    head = [
        "rows",
        "ranks",
        "operations",
        "busiest over mean",
        "entries",
        "busiest over mean",
        "messages of the busiest",
        "bytes of the busiest",
    ]
    put(PAGE, "scaling-work", table(head, counts) + "\n" + noted(load, runs=1))
    head = ["rows", "ranks", *there, "in all, s", "gain"]
    put(PAGE, "scaling", table(head, times) + "\n" + noted(load, runs=1))
