"""Whole runs: the jobs, an earlier program, sweeps, the largest mesh."""

import json
import subprocess
import tempfile
from pathlib import Path

import h5py
from clock import PROGRAM, ROOT, RUNS, busy, in_turn, middle, noted, ratio, run, stages
from pages import put
from report import table

PAGE = ROOT / "docs" / "developers" / "performance.md"
# The program before modes were found in blocks, which scripts/golden builds.
FORMER = ROOT / "target/golden/railsqueal-c62cf57"


def two_cylinders():
    load, body, names = busy(), [], []
    with tempfile.TemporaryDirectory() as name:
        result = Path(name) / "two.h5"

        def one(ranks):
            spent = run("two-cylinders.json", "--output", result, "--force", ranks=ranks)
            return spent, stages(result)

        for ranks, found in zip((1, 2), in_turn(lambda: one(1), lambda: one(2))):
            shown = {stage: middle(found, lambda f: f[1].get(stage, 0.0)) for stage in found[0][1]}
            names = [stage for stage, time in shown.items() if time >= 0.3] if ranks == 1 else names
            wall, cpu, memory = (middle(found, lambda f: getattr(f[0], key)) for key in ("wall", "cpu", "memory"))
            body.append(
                [
                    str(ranks),
                    *(f"{shown.get(n, 0.0):.1f} s" for n in names),
                    f"{wall:.1f} s",
                    f"{cpu:.1f} s",
                    f"{memory / 1e9:.2f} GB",
                ]
            )
    put(
        PAGE,
        "two-cylinders",
        table(["ranks", *names, "whole run", "its CPU", "memory of all ranks"], body) + "\n" + noted(load),
    )


def former():
    """The same job, steps and a sweep with an earlier program."""
    if not FORMER.exists():
        subprocess.run([ROOT / "scripts/golden", "make", "two-cylinders"], check=True)
    load, body = busy(), []
    programs = {"earlier": str(FORMER), "present": PROGRAM}
    rest = {f"bodies.{b}.rotation": "none" for b in ("lower", "upper")}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # Jobs of that time, in the format both read.
        jobs = folder / "jobs"
        jobs.mkdir()
        for job in ("two-cylinders.json", "squeal.json", "sweep-curve.json"):
            shown = subprocess.run(
                ["git", "show", f"c62cf57:jobs/{job}"], cwd=ROOT, capture_output=True, text=True, check=True
            ).stdout
            given = json.loads(shown)
            (jobs / job).write_text(json.dumps(given))

        def one(which, job, *words, sets=None, ranks=1):
            own = rest if which == "present" else {}
            return run(
                jobs / job,
                "--output",
                folder / f"{which}.h5",
                "--force",
                *words,
                sets=own | (sets or {}),
                ranks=ranks,
                program=programs[which],
            )

        def turns(what, key, unit, call):
            found = in_turn(lambda: call("earlier"), lambda: call("present"))
            a, b = (middle(f, key) for f in found)
            body.append([what, f"{a / unit[0]:{unit[1]}} {unit[2]}", f"{b / unit[0]:{unit[1]}} {unit[2]}", ratio(b, a)])
            return found

        found = turns(
            "`two-cylinders.json`, two ranks, wall",
            "wall",
            (1, ".1f", "s"),
            lambda w: one(w, "two-cylinders.json", ranks=2),
        )
        for key, unit, label in (
            ("cpu", (1, ".1f", "s"), "CPU"),
            ("memory", (1e9, ".2f", "GB"), "memory of both ranks"),
        ):
            a, b = (middle(f, key) for f in found)
            body.append(
                [
                    f"its {label}",
                    f"{a / unit[0]:{unit[1]}} {unit[2]}",
                    f"{b / unit[0]:{unit[1]}} {unit[2]}",
                    ratio(b, a),
                ]
            )
        steps = {
            "analyses.transient.points": "[]",
            "analyses.transient.sound_power": "null",
            "analyses.transient.duration": 0.2,
        }
        models = {}
        for which in programs:
            one(which, "squeal.json", "--only", "stability", sets={"output.fields": "false"})
            models[which] = (folder / f"{which}.h5").rename(folder / f"{which}-model.h5")
        found = turns(
            "20 000 steps of `squeal.json`, CPU",
            "cpu",
            (1, ".2f", "s"),
            lambda w: one(w, "squeal.json", "--reuse", models[w], sets=steps),
        )
        a, b = (middle(f, "memory") for f in found)
        body.append(["their memory", f"{a / 1e6:.1f} MB", f"{b / 1e6:.1f} MB", ratio(b, a)])
        turns("`sweep-curve.json`, CPU", "cpu", (1, ".1f", "s"), lambda w: one(w, "sweep-curve.json"))
    put(PAGE, "former", table(["", "c62cf57", "present", "ratio"], body) + "\n" + noted(load))


def wheel_on_rail():
    load, body = busy(), []
    with tempfile.TemporaryDirectory() as name:
        result = Path(name) / "wheel.h5"
        for job, what in (
            ("wheel-on-rail.json", "modes, receptances, steady rolling, stability"),
            ("wheel-on-rail-squeal.json", "and half a second of squeal"),
        ):
            count = RUNS if job == "wheel-on-rail.json" else 1
            found = in_turn(lambda: run(job, "--output", result, "--force", ranks=2), count=count)[0]
            body.append(
                [
                    f"`{job}`",
                    what,
                    *(f"{middle(found, key):.1f} s" for key in ("wall", "cpu")),
                    f"{middle(found, 'memory') / 1e9:.2f} GB",
                ]
            )
    put(PAGE, "wheel-on-rail", table(["two ranks", "", "wall", "CPU", "memory of both"], body) + "\n" + noted(load))


SWEEP = {
    "keys": {
        "contact.friction": {"from": 0.1, "to": 0.5, "count": 25},
        "contact.creepage.lateral": {"from": 0.005, "to": 0.02, "count": 8},
        "contact.normal_load": {"from": 50e3, "to": 70e3, "count": 5},
    }
}
# Of a wheel on a rail with its modes up to 6.6 kHz: one place, so that bodies are made once.
MANY = {"analyses.modes.max_frequency": 6600}


def sweeps():
    load, body = busy(), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plain = {"output.fields": "false"}
        run("curve.json", "--output", folder / "curve.h5", sets=plain, ranks=2)
        one = {"analyses.sweep": '{"keys": {"contact.friction": [0.3]}}'}
        run("curve-map.json", "--output", folder / "map.h5", sets=plain | MANY | one, ranks=2)
        with h5py.File(folder / "map.h5") as file:
            states = 2 * sum(len(file[f"modes/{body}/frequency"]) for body in ("lower", "upper"))

        def points(job, model, ranks, sets):
            run(
                job,
                "--reuse",
                folder / model,
                "--output",
                folder / "out.h5",
                "--force",
                "--only",
                "sweep",
                sets=plain | sets,
                ranks=ranks,
            )
            with h5py.File(folder / "out.h5") as file:
                count, failed = len(file["sweep/status"]), int((file["sweep/status"][()] != 0).sum())
                error = file["sweep/backward_error"][()].max()
            return count, stages(folder / "out.h5")["points of the sweep"], failed, error

        many = MANY | {
            "analyses.sweep": json.dumps({"keys": {"contact.friction": {"from": 0.2, "to": 0.5, "count": 100}}})
        }
        cases = [
            ("`curve.json`, 240 states", "curve.json", "curve.h5", {"analyses.sweep": json.dumps(SWEEP)}),
            (f"`curve-map.json` at one place, {states} states", "curve-map.json", "map.h5", many),
        ]
        for what, job, model, sets in cases:
            for ranks in (1, 2):
                found = in_turn(lambda: points(job, model, ranks, sets))[0]
                count, failed, error = found[0][0], max(f[2] for f in found), max(f[3] for f in found)
                seconds = middle(found, lambda f: f[1])
                body.append(
                    [
                        what,
                        str(ranks),
                        str(count),
                        f"{seconds:.1f} s",
                        f"{60 * count / seconds:.0f}",
                        f"{error:.0e}",
                        str(failed),
                    ]
                )
    head = ["model", "ranks", "points", "time", "points a minute", "backward errors to", "failed"]
    put(PAGE, "sweeps", table(head, body) + "\n" + noted(load))


def places():
    """A map over places of the wheel on the rail, whose bodies are made anew at each: the whole run, the job's own
    model and its pictures included."""
    load, body = busy(), []
    cases = [
        ("modes up to 2.5 kHz, as the job has it", {}, 1),
        ("modes up to 2.5 kHz, as the job has it", {}, 2),
        ("up to 5.8 kHz", {"analyses.modes.max_frequency": 5800}, 2),
        ("up to 6.6 kHz", MANY, 2),
    ]
    with tempfile.TemporaryDirectory() as name:
        result = Path(name) / "map.h5"
        for what, sets, ranks in cases:
            found = in_turn(lambda: run("curve-map.json", "--output", result, "--force", sets=sets, ranks=ranks))[0]
            with h5py.File(result) as file:
                modes = [len(file[f"modes/{one}/frequency"]) for one in ("lower", "upper")]
                status, error = file["sweep/status"][()], file["sweep/backward_error"][()].max()
            wall, cpu, memory = (middle(found, key) for key in ("wall", "cpu", "memory"))
            shown = [
                f"{wall:.1f} s",
                f"{60 * status.size / wall:.0f}",
                f"{cpu:.1f} s",
                f"{memory / 1e9:.2f} GB",
                f"{error:.0e}",
                str(int((status != 0).sum())),
            ]
            body.append([what, f"{modes[0]} and {modes[1]}", str(ranks), str(status.size), *shown])
    head = [
        "`curve-map.json`",
        "modes of rail and wheel",
        "ranks",
        "points",
        "whole run",
        "points a minute",
        "its CPU",
        "memory of all ranks",
        "backward errors to",
        "failed",
    ]
    put(PAGE, "places", table(head, body) + "\n" + noted(load))


# Of `limit-cycles.json`: fifty states, each in two branches.
CYCLES = {
    "contact.creepage.lateral": {"from": 0.004, "to": 0.013, "count": 10},
    "contact.friction": {"from": 0.25, "to": 0.45, "count": 5},
}


def limit_cycles():
    """A hundred limit cycles of the bodies of `squeal.json` on a coarse mesh, with their sound."""
    load = busy()
    with tempfile.TemporaryDirectory() as name:
        result = Path(name) / "cycles.h5"
        done = run("limit-cycles.json", "--output", result, sets={"analyses.sweep.keys": json.dumps(CYCLES)}, ranks=2)
        with h5py.File(result) as file:
            fate, time = file["sweep/cycles/fate"][()], file["sweep/cycles/time"][()]
    names = {0: "at rest", 1: "periodic", 2: "irregular", 3: "unsettled", -1: "not computed"}
    row = [
        str(fate.size),
        *(str(int((fate == code).sum())) for code in names),
        f"{time.sum():.0f} s",
        f"{done.wall:.0f} s",
        f"{done.cpu:.0f} s",
    ]
    head = ["two ranks", *names.values(), "simulated", "whole run", "its CPU"]
    put(PAGE, "hundred-cycles", table(head, [row]) + "\n" + noted(load, runs=1))


def largest():
    """Two bodies of a million degrees of freedom by multigrid: more than an hour."""
    load = busy()
    fine = {
        f"bodies.{b}.mesh.cylinder.{key}": value
        for b in ("lower", "upper")
        for key, value in (("element_size", 0.0004), ("max_element_size", 0.01))
    }
    with tempfile.TemporaryDirectory() as name:
        result = Path(name) / "large.h5"
        done = run(
            "two-cylinders.json", "--output", result, "--only", "steady", sets=fine | {"solver.linear": "gamg"}, ranks=2
        )
        times = stages(result)
        with h5py.File(result) as file:
            force = file["contact/force"][()]
            job = json.loads(file["provenance/job"][()])
    share = force[1] / (job["contact"]["friction"] * -force[2])
    rows = [[stage, f"{seconds:.0f} s"] for stage, seconds in times.items() if seconds >= 1]
    rows += [
        ["whole run", f"{done.wall:.0f} s"],
        ["CPU of both ranks", f"{done.cpu:.0f} s"],
        ["memory of both ranks", f"{done.memory / 1e9:.1f} GB"],
    ]
    rows += [["lateral force over μN", f"{share:.4f}"]]
    put(PAGE, "largest", table(["two ranks", ""], rows) + "\n" + noted(load, runs=1))
