"""What more ranks would give: operations, bytes and messages are counted on up to 64 ranks, which share two cores here; times follow from the rates of one rank."""

import re
import tempfile
from pathlib import Path

from clock import benchmark, busy, noted, rows, spent
from pages import put
from report import table
from whole import PAGE

SIZE = "0.01723"
RANKS = (1, 2, 4, 8, 16, 32, 64)
# A network as clusters have it: seconds a message, byte/s of a rank.
LATENCY, BANDWIDTH = 2e-6, 1e9
MONITORED = {
    "OMPI_MCA_pml_monitoring_enable": "2",
    "OMPI_MCA_pml_monitoring_enable_output": "3",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "COUNTS": "1",
}


def counted(ranks):
    """Parts of a run in processor time of rank 0 where it runs alone, what the factor counts, and the most messages and bytes that a rank sends."""
    with tempfile.TemporaryDirectory() as folder:
        settings = MONITORED | {"OMPI_MCA_pml_monitoring_filename": f"{folder}/sent"}
        done = spent([benchmark("linear_algebra"), "--size", SIZE, "--modes", "40"], ranks, settings)
        sent = [line.split("\t") for path in Path(folder).glob("sent.*") for line in path.read_text().splitlines() if line[:2] in ("E\t", "I\t")]
    of_rank = {}
    for _, source, _, size, messages, *_ in sent:
        before = of_rank.get(source, (0, 0))
        of_rank[source] = (before[0] + int(messages.split()[0]), before[1] + int(size.split()[0]))
    most = [max((of[k] for of in of_rank.values()), default=0) for k in (0, 1)]
    timed, factor = {}, None
    for row in rows(done.out):
        if row[0] == "counted":
            factor = [float(v) for v in row[1:]]
        else:
            timed[row[0]] = float(row[2])
    return timed, factor, most


def derived():
    load, body = busy(), []
    alone, _, _ = counted(1)
    solves = int(next(re.search(r"modes, (\d+)", what)[1] for what in alone if what.startswith("modes")))
    assembly, modes = (next(t for what, t in alone.items() if what.startswith(name)) for name in ("assembly", "modes"))
    solve = alone["3 solves of 8 right-hand sides"] / 24 * solves
    # The mesh, its parts, the order of elimination and the symbolic factorisation are one rank's.
    serial = alone["mesh on one rank"] + alone["its parts"] + alone["ordering and analysis"]
    first = None
    for ranks in RANKS:
        _, (flops, most_flops, entries, most_entries), (messages, size) = counted(ranks)
        parts = {
            "one rank": serial,
            "assembly": assembly / ranks,
            "factorisation": alone["factorisation alone"] * most_flops / flops,
            "solves": solve * most_entries / entries,
            "basis": max(modes - solve, 0.0) / ranks,
            "messages": messages * LATENCY,
            "bytes": size / BANDWIDTH,
        }
        whole = sum(parts.values())
        first = first or whole
        share = (ranks * most_flops / flops, ranks * most_entries / entries)
        body.append([
            str(ranks), f"{share[0]:.1f}", f"{share[1]:.1f}", f"{messages}", f"{size / 1e6:.0f} MB", *(f"{t:.2f}" for t in parts.values()), f"{whole:.1f} s",
            f"{first / whole:.1f}",
        ])
    head = ["ranks", "most operations over their mean", "most entries over their mean", "messages of a rank", "bytes", *(f"{name}, s" for name in parts), "in all", "gain"]
    put(PAGE, "scaling", table(head, body) + "\n" + noted(load, runs=1))
