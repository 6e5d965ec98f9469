"""Runs the program on a job with keys set, and reads its result file."""

import os
import subprocess
import tempfile
import time
from pathlib import Path

from railsqueal import Result

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / "target" / "validation"


def run(job, sets, ranks=2, only=None, reuse=None, output=None, groups=("contact", "modes", "sweep")):
    """The tables of these groups of a run as {path: array}, and its wall time in s. `sets` maps dotted keys to values.

    `reuse` is a result file whose reduced model is taken, `output` the result file if it is to stay.
    """
    with tempfile.TemporaryDirectory() as folder:
        output = output or Path(folder) / "run.h5"
        command = ["mpirun", "-n", str(ranks), str(ROOT / "target/release/railsqueal"), "run", str(ROOT / "jobs" / job)]
        command += (
            ["--output", str(output)] + (["--only", only] if only else []) + (["--reuse", str(reuse)] if reuse else [])
        )
        for key, value in sets.items():
            command += ["--set", f"{key}={value}"]
        begun = time.monotonic()
        done = subprocess.run(command, capture_output=True, text=True, env=os.environ)
        seconds = time.monotonic() - begun
        if done.returncode:
            raise SystemExit(f"{' '.join(command)}\nended with {done.returncode}:\n{done.stderr}")
        with Result(output) as result:
            tables = {name: result[name] for group in groups for name in result.names(group)}
    print(
        f"   {job}, {', '.join(f'{k.split(chr(46))[-1]} {v}' for k, v in sets.items() if 'upper' not in k)}: "
        f"{seconds:.0f} s",
        flush=True,
    )
    return tables, seconds


def both(key, value):
    """The same key of both bodies."""
    return {f"bodies.{body}.{key}": value for body in ("lower", "upper")}


def extrapolated(sizes, values):
    """Value at size 0 of f0 + c h², least squares."""
    x = [h * h for h in sizes]
    mx, my = sum(x) / len(x), sum(values) / len(values)
    slope = sum((a - mx) * (b - my) for a, b in zip(x, values)) / sum((a - mx) ** 2 for a in x)
    return my - slope * mx
