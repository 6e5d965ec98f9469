"""Time and memory of whole programs, run in turn, and how they are written down."""

import datetime
import json
import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import h5py

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = str(ROOT / "target/release/railsqueal")
DEBIAN = "/usr/bin/python3"
"""Debian's Python, which has the peers' modules."""
RUNS = int(os.environ.get("RUNS", "3"))
"""How often each program runs where medians are taken."""


@dataclass
class Spent:
    """Cost of one run: wall and processor time of all ranks in s, largest resident size summed over the ranks in
    bytes, and what it printed."""

    wall: float
    cpu: float
    memory: float
    out: str


def spent(command, ranks=1, settings=None, folder=None):
    """Runs a command on so many ranks; ends the study where it fails. `settings` are variables of its environment,
    `folder` is where it works."""
    with tempfile.TemporaryDirectory() as taken:
        line = [
            "mpirun",
            "-n",
            str(ranks),
            sys.executable,
            str(Path(__file__).with_name("rank.py")),
            taken,
            *map(str, command),
        ]
        # Variables of this project's own Python do not belong to another one's.
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", **(settings or {})}
        done = subprocess.run(line, capture_output=True, text=True, env=environment, cwd=folder)
        if done.returncode:
            raise SystemExit(
                f"{' '.join(map(str, command))}\nended with "
                f"{done.returncode}:\n{done.stdout[-2000:]}{done.stderr[-4000:]}"
            )
        parts = [json.loads(path.read_text()) for path in sorted(Path(taken).glob("*.json"))]
    wall, cpu, memory = max(p["wall"] for p in parts), sum(p["cpu"] for p in parts), sum(p["memory"] for p in parts)
    print(
        f"   {Path(str(command[0])).name} {' '.join(map(str, command[1:4]))} … on {ranks}: {wall:.1f} s, {cpu:.1f} s "
        f"of CPU, {memory / 1e9:.2f} GB",
        flush=True,
    )
    return Spent(wall, cpu, memory, done.stdout)


def in_turn(*runs, count=RUNS):
    """Each of these calls, one after the other, and all of that so often: the results of each."""
    found = [[] for _ in runs]
    for _ in range(count):
        for results, run in zip(found, runs):
            results.append(run())
    return found


def middle(results, key):
    """The median of one figure; `key` is a field of Spent or a function of a result."""
    take = key if callable(key) else lambda r: getattr(r, key)
    return statistics.median(take(r) for r in results)


def run(job, *words, sets=None, ranks=1, program=PROGRAM):
    """A run of the program on a job of jobs/, with keys set."""
    given = [word for key, value in (sets or {}).items() for word in ("--set", f"{key}={value}")]
    return spent([program, "run", ROOT / "jobs" / job, *words, *given], ranks)


def benchmark(name):
    """The executable of a benchmark of this crate, built."""
    line = ["cargo", "bench", "--bench", name, "--no-run", "--message-format=json", "--quiet"]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(line)}\n{done.stderr}")
    for message in map(json.loads, done.stdout.splitlines()):
        if message.get("executable") and message["target"]["name"] == name:
            return message["executable"]
    raise SystemExit(f"{' '.join(line)} built nothing")


def rows(out):
    """Rows that a benchmark prints in lines `row: a | b | c`."""
    return [line.partition("row: ")[2].split(" | ") for line in out.splitlines() if line.startswith("row: ")]


def stages(result):
    """Seconds of each stage of a run by its name, from its result file."""
    with h5py.File(result) as file:
        return dict(
            zip((n.decode() for n in file["provenance/stage_names"][()]), file["provenance/stage_times"][()].tolist())
        )


def version(package):
    """The version of a Debian package, without what Debian adds."""
    shown = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", package], capture_output=True, text=True).stdout
    return shown.partition(":")[2].partition("-")[0] if ":" in shown else shown.partition("-")[0]


def busy():
    """How busy the machine is with other things."""
    return os.getloadavg()[0]


def noted(load, *programs, runs=RUNS):
    """The line below a table: when, with what, how often, and the load of the machine before."""
    own = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True).stdout.split("\n")[0]
    count = f"medians of {runs} runs in turn" if runs > 1 else "one run each"
    return (
        f"_{', '.join([own, *programs])}; {datetime.date.today()}; {count}; load of the machine before: {load:.1f}._\n"
    )


def ratio(ours, theirs):
    return f"**{ours / theirs:.2f}**"
