"""Runs the cases with the earlier program or the present one and compares their results. Called by scripts/golden."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import cases
import comparison
import h5py

ROOT = Path(__file__).resolve().parents[2]
# A folder that several checkouts may share; what the present program writes stays in this one.
KEPT = Path(os.environ.get("GOLDEN_FOLDER", ROOT / "target/golden")) / "jobs"
PRESENT = ROOT / "target/golden/present/jobs"
TREE = ROOT / "tests/golden"
# About sliding, with all eigenvalues listed: what the earlier program has.
SLIDING = {"analyses.stability.state": "sliding", "analyses.stability.damping_ratio": 1}
SMALL = {
    "hulten": {"analyses.stability.damping_ratio": 1},
    "blocks": {"analyses.modes.count": 2},
    "two-cylinders": cases.TINY | SLIDING | {"analyses.stability.direction": "rigid"},
}


def inputs(folder):
    """Files that the jobs name by relative paths."""
    folder.mkdir(parents=True, exist_ok=True)
    links = {folder / "hulten": ROOT / "jobs/hulten", folder.parent / "meshes": ROOT / "meshes"}
    for link, to in links.items():
        if link.is_symlink():
            link.unlink()
        link.symlink_to(to)
    (folder / "lattice").mkdir(exist_ok=True)
    (folder / "lattice-source.json").write_text(json.dumps(cases.lattice(folder / "lattice")))


def run(program, job, output, sets=(), reuse=None):
    """A run on one rank; its wall time in s."""
    command = [str(program), "run", str(job), "--output", str(output), "--force"]
    command += [arg for key, value in dict(sets).items() for arg in ("--set", f"{key}={cases.plain(value)}")]
    command += ["--reuse", str(reuse)] if reuse else []
    begun = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}\nended with {done.returncode}:\n{done.stderr[-2000:]}")
    return time.monotonic() - begun


def earlier(job):
    """The file of a job as it was when the earlier program was the present one."""
    if job == "lattice-source.json":
        return KEPT / job
    shown = subprocess.run(
        ["git", "-C", str(ROOT), "show", f"{os.environ['GOLDEN_COMMIT']}:jobs/{job}"],
        capture_output=True,
        text=True,
        check=True,
    )
    path = KEPT / f"source-{job}"
    path.write_text(shown.stdout)
    return path


def at_rest(text):
    """The keys that say of the bodies of a job what the earlier program took for granted."""
    bodies = json.loads(text)["bodies"]
    return {f"bodies.{name}.rotation": "none" for name, body in bodies.items() if "matrices" not in body}


def chosen(names):
    unknown = [name for name in names if name not in cases.CASES]
    if unknown:
        sys.exit(f"scripts/golden: no case {', '.join(unknown)}; there are {', '.join(cases.CASES)}")
    wanted = names or list(cases.CASES)
    needed = [reused(name) for name in wanted if reused(name)]
    return [name for name in cases.CASES if name in wanted or name in needed]


def reused(name):
    """The case whose results this one takes up, if any."""
    return "".join(cases.CASES[name][2:]).removeprefix("kept:")


def reuse(name, folder):
    """The result file of that case, of the program that writes to `folder`."""
    return (
        (KEPT if "".join(cases.CASES[name][2:]).startswith("kept:") else folder) / f"{reused(name)}.h5"
        if reused(name)
        else None
    )


def recipe(name):
    return json.dumps(cases.CASES[name])


def made(name):
    """Returns whether the results of a case are there, of the job as it is now."""
    note = KEPT / f"{name}.recipe"
    return note.exists() and note.read_text() == recipe(name)


def make(program, names):
    inputs(KEPT)
    failed = []
    for name in chosen(names):
        job, sets, *_ = cases.CASES[name]
        output = KEPT / f"{name}.h5"
        try:
            seconds = run(program, earlier(job), output, sets, reuse(name, KEPT))
        except RuntimeError as error:
            failed.append(name)
            print(f"{name}: {error}", flush=True)
            continue
        # The present program gets the job with all defaults of the earlier one written out.
        with h5py.File(output) as file:
            (KEPT / f"{name}.json").write_text(file["provenance/job"][()].decode())
        (KEPT / f"{name}.recipe").write_text(recipe(name))
        print(f"made {name} ({seconds:.1f} s)", flush=True)
    if failed:
        sys.exit(f"scripts/golden: {', '.join(failed)} failed")


def compare(program, names):
    inputs(PRESENT)
    differing = []
    for name in chosen(names):
        job = PRESENT / f"{name}.json"
        text = (KEPT / f"{name}.json").read_text()
        job.write_text(text)
        if any(f'"{law}"' in text for law in ("exponential", "rational")):
            print(f"{name}: not compared: friction that falls is remembered now, which changes its results", flush=True)
            continue
        analyses = json.loads(text)["analyses"]
        if ((analyses.get("transient") or {}).get("start") or {}).get("mode") is not None:
            print(
                f"{name}: not compared: a start along a mode begins with its largest displacement now, whatever phase "
                "the eigensolver gave it",
                flush=True,
            )
            continue
        stability = analyses.get("stability")
        # By matrices everything slides.
        sets = SLIDING if "matrices" not in text else dict(list(SLIDING.items())[1:])
        sets = at_rest(text) | (sets if stability is not None else {})
        try:
            seconds = run(program, job, PRESENT / f"{name}.h5", sets, reuse(name, PRESENT))
        except RuntimeError as error:
            differing.append(name)
            print(f"{name}: {error}", flush=True)
            continue
        found, datasets, worst = comparison.results(
            KEPT / f"{name}.h5",
            PRESENT / f"{name}.h5",
            comparison.STEADY_START if name in cases.STEADY_START else comparison.LIMIT,
        )
        verdict = f"{len(found)} differences" if found else "the same"
        print(
            f"{name}: {verdict} in {datasets} "
            f"datasets{f', largest distance {worst[0]:.1e}, {worst[1]}' if worst[0] else ''} ({seconds:.1f} s)",
            flush=True,
        )
        for line in found:
            print(f"    {line}")
        if found:
            differing.append(name)
    if differing:
        sys.exit(f"scripts/golden: {', '.join(differing)} differ")


def tree(program):
    """The small results that tests/cli/golden.rs compares with."""
    inputs(PRESENT)
    TREE.mkdir(exist_ok=True)
    for name, sets in SMALL.items():
        job, own, *_ = cases.CASES[name]
        output = PRESENT / f"tree-{name}.h5"
        run(program, ROOT / "jobs" / job, output, own | sets | {"output.fields": False})
        with h5py.File(output) as file, h5py.File(TREE / f"{name}.h5", "w") as small:
            # Paths as from the folder of the jobs, wherever the project lies.
            job = file["provenance/job"][()].decode()
            small.attrs["job"] = job.replace(f"{ROOT}/jobs/", "").replace(f"{ROOT}/", "../")
            for group in file:
                if group not in ("provenance", "VTKHDF"):
                    file.copy(group, small)
        print(f"{TREE / name}.h5")


def main():
    command, *rest = sys.argv[1:]
    if command == "list":
        print("\n".join(cases.CASES))
    elif command == "missing":
        print(" ".join(name for name in chosen(rest) if not made(name)))
    elif command == "make":
        make(rest[0], rest[1:])
    elif command == "compare":
        compare(rest[0], rest[1:])
    else:
        tree(rest[0])


main()
