"""Runs that are killed, damaged or given nonsense, with fixed seeds. FAULTS=10 does ten times as many; it fails where
anything is silently wrong."""

import json
import os
import random
import re
import runpy
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np
from program import ROOT
from railsqueal import Result

PROGRAM = os.environ.get("FAULTS_PROGRAM", str(ROOT / "target/release/railsqueal"))
TIMES = float(os.environ.get("FAULTS", "1"))
# What a run may end with: done, or refused with a message.
REFUSED = {2, 3}


def squeal(folder):
    """A job of some seconds: lateral sliding on a coarse mesh."""
    job = json.loads((ROOT / "jobs/two-cylinders.json").read_text())
    for body, offset in (("lower", 0.03), ("upper", 0.02)):
        job["bodies"][body]["mesh"]["cylinder"] |= {
            "contact_offset": offset,
            "element_size": 0.002,
            "growth": 2.0,
            "max_element_size": 0.05,
        }
    job["contact"] |= {"patch": {"half_length": 0.01, "half_width": 0.01}, "creepage": {"lateral": 0.01}}
    start = {"mode": 1, "amplitude": 3e-6, "random": {"seed": 5, "energy": 1e-4}}
    transient = {"duration": 0.1, "step": 1e-5, "segment": 100, "contact_stride": 500, "start": start}
    job["analyses"] = {"modes": {"count": 20}, "stability": {"direction": "actual"}, "transient": transient}
    job["output"] = {"fields": False}
    path = Path(folder) / "job.json"
    path.write_text(json.dumps(job))
    return path


def launch(arguments, ranks=1):
    command = [PROGRAM, *map(str, arguments)]
    return (["mpirun", "-n", str(ranks)] if ranks > 1 else []) + command


def call(arguments, ranks=1, limit=600):
    return subprocess.run(launch(arguments, ranks), capture_output=True, text=True, timeout=limit)


def spoken(done, what):
    """A run that ended in order: no signal, no defect, one message where it failed."""
    text = done.stderr
    if done.returncode < 0 or done.returncode == 1 or "panicked" in text or "internal defect" in text:
        raise SystemExit(f"{what}: ended with {done.returncode}:\n{text[-3000:]}")
    return done.returncode


def transient(path):
    with Result(path) as result:
        return {name: result[name] for name in result.names("transient") if name.count("/") == 1}


def same(one, two):
    return one.keys() == two.keys() and all(np.array_equal(one[k], two[k]) for k in one)


def prepared(folder):
    job, model, whole = squeal(folder), Path(folder) / "model.h5", Path(folder) / "whole.h5"
    for arguments in (["--only", "stability", "--output", model], ["--reuse", model, "--output", whole]):
        done = call(["run", job, *arguments])
        if done.returncode:
            raise SystemExit(done.stderr)
    return job, model, transient(whole)


def kills():
    """Kills a run again and again until it is done: bit for bit the unbroken run."""
    dice, rows = random.Random(1), []
    for ranks in (1, 2):
        # What a rank writes whose launcher was killed may come while the folder goes.
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            job, model, whole = prepared(folder)
            output = Path(folder) / "run.h5"
            begun = time.monotonic()
            call(["run", job, "--reuse", model, "--output", output], ranks)
            length = time.monotonic() - begun
            count, runs, wanted = 0, 0, round((30 if ranks == 1 else 10) * TIMES)
            output.unlink()
            while count < wanted:
                going = (Path(folder) / "run.transient/manifest").exists()
                target = (
                    ["--resume", output]
                    if going and any((Path(folder) / "run.transient").glob("*.h5"))
                    else ["--output", output, "--force"]
                )
                begun = time.monotonic()
                process = subprocess.Popen(
                    launch(["run", job, "--reuse", model, *target], ranks),
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.PIPE,
                    text=True,
                    start_new_session=True,
                )
                try:
                    _, text = process.communicate(timeout=dice.uniform(0.05, 1.1) * length)
                except subprocess.TimeoutExpired:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.communicate()
                    count += 1
                    continue
                if process.returncode == 2 and "another run is at work" in text:
                    # Ranks whose launcher was killed live a little longer.
                    time.sleep(0.5)
                    continue
                # Ranks whose launcher was killed may come to the end of the run meanwhile.
                over = "came to its end" in text or ("nothing to continue" in text and output.exists())
                if process.returncode and not over:
                    raise SystemExit(f"after {count} kills on {ranks} ranks: {process.returncode}:\n{text}")
                runs += 1
                # The first one may have been slow beside other work: kills are to come before the end.
                if "--force" in target:
                    length = min(length, time.monotonic() - begun)
                if not same(transient(output), whole):
                    raise SystemExit(f"after {count} kills on {ranks} ranks: other results")
                output.unlink()
                shutil.rmtree(Path(folder) / "run.transient", ignore_errors=True)
            rows.append(
                {
                    "what": f"kills, {ranks} rank{'s'[: ranks - 1]}",
                    "cases": count,
                    "outcome": f"{runs} runs came to their end, all bit for bit the same",
                }
            )
    return rows


def harm(dice, path):
    """One fault in a file; returns what it was."""
    data = bytearray(path.read_bytes())
    kind = dice.choice(["bit", "bit", "bit", "cut", "byte", "zeros", "missing"])
    at = dice.randrange(max(len(data), 1))
    if kind == "missing":
        path.unlink()
        return kind
    if kind == "bit":
        data[at] ^= 1 << dice.randrange(8)
    elif kind == "cut":
        del data[at:]
    elif kind == "byte":
        data.insert(at, dice.randrange(256))
    else:
        data[at : at + 64] = bytes(len(data[at : at + 64]))
    path.write_bytes(data)
    return kind


def segments():
    """One fault in a stopped run: refused before any step, or right."""
    dice = random.Random(2)
    with tempfile.TemporaryDirectory() as folder:
        job, model, whole = prepared(folder)
        output, place, good = (Path(folder) / name for name in ("run.h5", "run.transient", "good"))
        done = call(["run", job, "--reuse", model, "--output", output, "--wall-time", "1"])
        if done.returncode != 5:
            raise SystemExit(f"not stopped: {done.returncode}\n{done.stderr}")
        shutil.copytree(place, good)
        outcome = {"refused": 0, "right": 0}
        count = round(60 * TIMES)
        for case in range(count):
            shutil.rmtree(place, ignore_errors=True)
            output.unlink(missing_ok=True)
            shutil.copytree(good, place)
            path = dice.choice(sorted(place.iterdir()) + [place / "manifest"] * 5)
            what = f"{harm(dice, path)} in {path.name}, case {case}"
            done = call(["run", job, "--reuse", model, "--resume", output])
            code = spoken(done, what)
            if code == 0 and same(transient(output), whole):
                outcome["right"] += 1
            elif code in REFUSED and "s] transient" not in done.stderr:
                outcome["refused"] += 1
            else:
                raise SystemExit(f"{what}: ended with {code}, silently wrong or after steps:\n{done.stderr}")
        return [
            {
                "what": "damaged or missing segments",
                "cases": count,
                "outcome": f"{outcome['refused']} refused before any step, {outcome['right']} right",
            }
        ]


def models():
    """One fault in the result file that --reuse takes up."""
    dice = random.Random(3)
    with tempfile.TemporaryDirectory() as folder:
        job, model, _ = prepared(folder)
        data, output = model.read_bytes(), Path(folder) / "again.h5"
        arguments = ["run", job, "--only", "stability", "--reuse", model, "--output", output, "--force"]

        def rates():
            with h5py.File(output) as file:
                return file["stability/eigenvalue"][()]

        call(arguments)
        wanted, outcome, count = rates(), {"refused": 0, "right": 0, "crash": 0}, round(60 * TIMES)
        for case in range(count):
            model.write_bytes(data)
            what = f"{harm(dice, model)} in the model, case {case}"
            done = call(arguments)
            code = spoken(done, what)
            if code == 0 and np.array_equal(rates(), wanted):
                outcome["right"] += 1
            elif code in REFUSED:
                outcome["crash" if "libhdf5 crashed" in done.stderr else "refused"] += 1
            else:
                raise SystemExit(f"{what}: ended with {code}, silently wrong:\n{done.stderr}")
        refused = outcome["refused"] + outcome["crash"]
        text = f"{refused} refused ({outcome['crash']} where libhdf5 itself crashed), {outcome['right']} right"
        return [{"what": "damaged models of --reuse", "cases": count, "outcome": text}]


def jobs():
    """Mutated job files through `check`."""
    dice, codes, slowest = random.Random(4), {}, 0.0
    texts = [path.read_bytes() for path in sorted((ROOT / "jobs").glob("*.json"))]
    signs = b'0123456789.eE-+"[]{},:'
    numbers = [b"1e308", b"-1", b"0", b"1e-300", b"17", b"0.5", b"1e9", b"null", b"true", b'"x"']
    with tempfile.TemporaryDirectory() as folder:
        path, count = Path(folder) / "job.json", round(200 * TIMES)
        for case in range(count):
            data = bytearray(dice.choice(texts))
            for _ in range(dice.randint(1, 3)):
                at = dice.randrange(len(data))
                kind = dice.randrange(4)
                if kind == 0:
                    data[at] = dice.randrange(256)
                elif kind == 1:
                    del data[at]
                elif kind == 2:
                    data.insert(at, dice.choice(signs))
                else:
                    # A number in place of another.
                    places = [
                        i
                        for i, b in enumerate(data)
                        if chr(b).isdigit() and not chr(data[i - 1]).isalnum() and data[i - 1] not in b'."_-'
                    ]
                    if places:
                        at = dice.choice(places)
                        end = at
                        while end < len(data) and data[end] in b"0123456789.eE+-":
                            end += 1
                        data[at:end] = dice.choice(numbers)
            path.write_bytes(data)
            begun = time.monotonic()
            code = spoken(call(["check", path], limit=120), f"job {case}: {bytes(data)!r}")
            slowest = max(slowest, time.monotonic() - begun)
            if code not in {0, 2, 3, 7}:
                raise SystemExit(f"job {case} ended with {code}: {bytes(data)!r}")
            codes[code] = codes.get(code, 0) + 1
    text = ", ".join(f"{n} with {code}" for code, n in sorted(codes.items()))
    return [{"what": "mutated jobs, check", "cases": count, "outcome": f"{text}; the slowest took {slowest:.1f} s"}]


# Jobs of a second or so, with the keys that make them so (scripts/reference/cases.py).
BASES = (
    "blocks",
    "hulten",
    "hulten-full",
    "hulten-sweep",
    "two-cylinders",
    "half-space",
    "approach",
    "curve",
    "curve-falling",
    "sweep-zip",
)
# Where NaN says that there is nothing (docs/reference/output.md).
NOTHING = ("stability/criterion/", "stability/sensitivity/", "stability/point/", "creep_curve/", "sweep/")


def bases():
    """The jobs as the program understands them, all keys filled in; files by whole names."""
    reference = runpy.run_path(str(ROOT / "scripts/reference/cases.py"))
    cases = {name: reference["CASES"][name][:2] for name in BASES}
    step = reference["in_time"](100, contact_stride=10) | {"contact.creepage.lateral": 0.01}
    cases |= {"in-time": ("squeal.json", step), "belt": ("belt.json", {})}
    for name, (file, keys) in cases.items():
        sets = [
            word
            for key, value in keys.items()
            for word in ("--set", f"{key}={'null' if value is None else reference['plain'](value)}")
        ]
        done = call(["check", ROOT / "jobs" / file, *sets])
        if done.returncode:
            raise SystemExit(f"{name}: {done.stderr}")
        job = json.JSONDecoder().raw_decode(done.stdout)[0]
        job["solver"] = job.get("solver", {}) | {"memory_limit": 3e9}
        yield name, job


def leaves(value, path=()):
    """Places of all values, objects and lists among them."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in inner:
        yield (*path, key)
        yield from leaves(part, (*path, key))


def strange(dice, value):
    """A value of the same kind that nobody means, or one of another kind."""
    if isinstance(value, bool) or value is None or dice.random() < 0.08:
        return dice.choice([None, True, False, "x", "", [], {}, -1, 0, [0, 0]])
    if isinstance(value, (int, float)):
        others = [
            0,
            -value,
            10 * value,
            value / 10,
            1e3 * value,
            value / 1e3,
            1e6 * value,
            value / 1e6,
            1,
            2,
            1e308,
            1e-308,
            -1e-12,
            1e15,
            2**31,
            0.5,
        ]
        odd = dice.choice(others)
        return round(odd) if isinstance(value, int) and dice.random() < 0.7 and abs(odd) < 1e18 else odd
    if isinstance(value, list):
        return dice.choice([[], value + value, value[::-1], value[:1]])
    return (
        dice.choice(["", "x", "fe", "half_space", "steady", "full", "load", "gamg", "patch"])
        if isinstance(value, str)
        else {}
    )


def altered(dice, given):
    """A job with one to three strange values, and what was done to it."""
    job, changes = json.loads(json.dumps(given)), []
    for _ in range(dice.choice([1, 1, 1, 2, 3])):
        places = [
            p for p in leaves(job) if p[-1] not in {"memory_limit", "version", "title"} and "matrices" not in p[-2:-1]
        ]
        *way, key = dice.choice(places)
        inside = job
        for part in way:
            inside = inside[part]
        where = ".".join(map(str, [*way, key]))
        if dice.random() < 0.1:
            del inside[key]
            changes.append(f"without {where}")
        else:
            inside[key] = strange(dice, inside[key])
            changes.append(f"{where} = {json.dumps(inside[key])}")
    return job, "; ".join(changes)


def patient(what, path):
    """Exit code of a run; what takes long is asked to stop, and what does not come to the end of a step then, once
    more."""
    process = subprocess.Popen(
        launch(["run", path, "--force"]), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    for patience in (30, 60, 10):
        try:
            _, text = process.communicate(timeout=patience)
            return spoken(subprocess.CompletedProcess([], process.returncode, "", text), what)
        except subprocess.TimeoutExpired:
            process.terminate()
    process.kill()
    process.communicate()
    raise SystemExit(f"{what}: does not end")


def odd():
    """Jobs that nobody means, through `run`: refused, stopped, not converged, or a result of numbers."""
    dice, codes, count, slowest, failed = random.Random(8), {}, round(100 * TIMES), 0.0, []
    with tempfile.TemporaryDirectory() as folder:
        path, output = Path(folder) / "job.json", Path(folder) / "job.h5"
        given = dict(bases())
        for case in range(count):
            name = dice.choice(list(given))
            job, changes = altered(dice, given[name])
            path.write_text(json.dumps(job))
            what, begun = f"odd job {case}, {name} with {changes}", time.monotonic()
            try:
                code = patient(what, path)
                if code not in {0, 2, 3, 4, 5, 7}:
                    raise SystemExit(f"{what}: ended with {code}")
                if code == 0:
                    with h5py.File(output) as file:
                        file.visititems(lambda where, item: finite(what, where, item))
                codes[code] = codes.get(code, 0) + 1
            except SystemExit as fault:
                print(fault, flush=True)
                failed.append(str(fault))
            slowest = max(slowest, time.monotonic() - begun)
            for left in Path(folder).glob("job.*"):
                shutil.rmtree(left) if left.is_dir() else left.unlink()
    if failed:
        raise SystemExit(f"{len(failed)} of {count} odd jobs end badly")
    told = ", ".join(f"{n} with {code}" for code, n in sorted(codes.items()))
    return [
        {
            "what": "odd jobs, run",
            "cases": count,
            "outcome": f"{told}; no result of 0 has NaN; the slowest took {slowest:.0f} s",
        }
    ]


def finite(what, where, item):
    if (
        isinstance(item, h5py.Dataset)
        and item.dtype.kind in "fc"
        and not where.startswith(NOTHING)
        and not np.isfinite(item[()]).all()
    ):
        raise SystemExit(f"{what}: ended well with NaN in /{where}")


# Jobs, two kinds of meshes, profiles, heights, matrices, segments and results.
READERS = 8


def readers():
    """Harmed files through the readers as a library, a thousand of each times FAULTS: a million with FAULTS=1000."""
    program = os.environ.get("FAULTS_READERS")
    command = [program] if program else ["cargo", "test", "--release", "--quiet", "--test", "readers", "--"]
    count = round(1000 * TIMES)
    begun = time.monotonic()
    done = subprocess.run(
        [*command, "--nocapture", "--test-threads=1"],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=os.environ | {"RAILSQUEAL_FUZZ": str(count)},
    )
    if done.returncode:
        raise SystemExit(done.stdout + done.stderr)
    told = re.findall(r"^(?:test \w+ \.\.\. )?([\w() ]+): (\d+) (read|read or refused), (\d+) (.*)$", done.stdout, re.M)
    if len(told) != READERS:
        raise SystemExit(f"{READERS} readers were to say what they read:\n{done.stdout}")
    print(f"   {time.monotonic() - begun:.0f} s", flush=True)
    return [
        {"what": f"readers, {what}", "cases": int(good) + int(bad), "outcome": f"{good} {how}, {bad} {rest}"}
        for what, good, how, bad, rest in told
    ]


def broken():
    rows = []
    for study in (readers, jobs, odd, models, segments, kills):
        rows += study()
        print(f"   {rows[-1]}", flush=True)
    return rows
