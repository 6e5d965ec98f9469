"""Cost of a time step, in products with the influence matrix, and beside Siconos."""

import re
import tempfile
from pathlib import Path

from clock import DEBIAN, ROOT, benchmark, busy, in_turn, middle, noted, ratio, rows, run, spent, version
from pages import put
from report import table
from system import install

PAGE = ROOT / "docs" / "developers" / "performance.md"
# Elements at the contact, m.
SIZES = (1e-3, 0.64e-3, 0.55e-3, 0.47e-3)


def both(size):
    return {f"bodies.{body}.mesh.cylinder.element_size": size for body in ("lower", "upper")}


def made(folder):
    """Reduced models of the squeal job with all sizes."""
    found = {}
    for size in SIZES:
        found[size] = folder / f"squeal-{1e3 * size:g}.h5"
        run(
            "squeal.json",
            "--only",
            "stability",
            "--output",
            found[size],
            sets=both(size) | {"output.fields": "false"},
            ranks=2,
        )
    return found


def limit_cycle(model, *more):
    return rows(spent([benchmark("transient"), "--model", model, *more]).out)[0]


def in_squeal():
    load, body = busy(), []
    with tempfile.TemporaryDirectory() as name:
        for size, model in made(Path(name)).items():
            found = in_turn(lambda: limit_cycle(model))[0]
            best = sorted(found, key=lambda r: float(r[3]))[len(found) // 2]
            body.append([f"{1e3 * size:g} mm", *best[1:]])
    head = [
        "elements at the contact",
        "closed",
        "in stick",
        "step, µs",
        "dense product, µs",
        "step in these",
        "own product, µs",
        "step in these",
        "products",
        "inner iterations",
    ]
    put(PAGE, "steps", table(head, body) + "\n" + noted(load))


def on_half_spaces():
    load = busy()
    found = in_turn(lambda: rows(spent([benchmark("transient")]).out))[0]
    names = [row[0] for row in found[0]]
    body, times = [], {}
    for k, name in enumerate(names):
        best = sorted((f[k] for f in found), key=lambda r: float(r[3]))[len(found) // 2]
        times[name] = float(best[3])
        body.append([name.split(", ", 2)[2], *best[1:]])
    head = [
        "half-spaces, 120 modes",
        "closed",
        "in stick",
        "step, µs",
        "dense product, µs",
        "step in these",
        "own product, µs",
        "step in these",
        "products",
        "inner iterations",
    ]
    falling = {
        name: time / times[name.replace("falling", "constant")] for name, time in times.items() if "falling" in name
    }
    told = "; ".join(f"{name.split(', ')[2]}: {value:.2f}" for name, value in falling.items())
    put(PAGE, "steps-half-spaces", table(head, body) + f"\nFalling over constant friction: {told}.\n\n" + noted(load))


def beside_siconos():
    install("python3-siconos", "python3-h5py", "libopenblas0-pthread")
    load, body = busy(), []
    program = benchmark("transient")
    with tempfile.TemporaryDirectory() as name:
        for size, model in made(Path(name)).items():
            problems = Path(name) / "problems.h5"
            problems.unlink(missing_ok=True)
            spent([program, "--model", model, "--export", problems])
            out = spent([DEBIAN, ROOT / "benches/peers/siconos_nsgs.py", problems], 1, {"PYTHONPATH": ""}).out
            nodes, opened = re.search(r"(\d+) nodes: (\d+) open", out).groups()
            for residual in ("1e-06", "1e-10"):
                ours = re.search(rf"residual {residual}, ours: cold ([\d.]+) ms .*warm ([\d.]+) ms", out).groups()
                for kind, own in zip(("cold", "warm"), map(float, ours)):
                    theirs = {
                        solver: float(time)
                        for solver, time in re.findall(rf"residual {residual}, (.*), {kind}: ([\d.]+) ms", out)
                        if solver != "ours"
                    }
                    default = next(time for solver, time in theirs.items() if solver.startswith("default"))
                    fastest = min(theirs.values())
                    body.append(
                        [
                            f"{nodes} ({int(nodes) - int(opened)})",
                            residual,
                            kind,
                            f"{own:.3f} ms",
                            f"{default:.3g} ms",
                            f"{fastest:.3g} ms",
                            f"{default / own:.1f}",
                            f"{fastest / own:.1f}",
                        ]
                    )
    head = ["nodes (closed)", "residual", "", "ours", "Siconos, default", "fastest", "ratio, default", "fastest"]
    put(PAGE, "siconos", table(head, body) + "\n" + noted(load, f"Siconos {version('python3-siconos')}", runs=1))


def turning():
    """Cost of rotation in steps, a sweep and the full system, and cost of output."""
    load, body = busy(), []
    steps = {
        "analyses.transient.points": "[]",
        "analyses.transient.sound_power": "null",
        "analyses.transient.duration": 0.4,
        "analyses.transient.start.amplitude": 4e-5,
    }
    sweep = {
        "analyses.transient": "null",
        "analyses.sweep": '{"keys": {"contact.friction": {"from": 0.1, "to": 0.5, "count": 40}}}',
    }
    rest = {f"bodies.{b}.rotation": "none" for b in ("lower", "upper")}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        models = {"rolling": (folder / "rolling.h5", {}), "rest": (folder / "rest.h5", rest)}
        for model, sets in models.values():
            run(
                "squeal.json", "--only", "stability", "--output", model, sets=sets | {"output.fields": "false"}, ranks=2
            )

        def again(which, sets, *words):
            model, own = models[which]
            return run(
                "squeal.json", "--reuse", model, "--output", folder / "out.h5", "--force", *words, sets=own | sets
            )

        cases = {
            "40 000 steps of `squeal.json` in its limit cycle, from an earlier model": (steps, ()),
            "stability at 40 values of friction, from an earlier model": (sweep, ("--only", "sweep")),
        }
        for what, (sets, words) in cases.items():
            found = in_turn(lambda: again("rest", sets, *words), lambda: again("rolling", sets, *words))
            body.append([what, *pair(found)])
        written(folder, again, steps)
        mesh = {
            f"bodies.{b}.mesh.cylinder.{key}": v
            for b in ("lower", "upper")
            for key, v in (("element_size", 0.002), ("max_element_size", 0.03))
        }
        whole = mesh | {"analyses.stability.full": '{"max_frequency": 2000}', "output.fields": "false"}

        def full(own):
            return run("squeal.json", "--only", "stability", "--output", folder / "out.h5", "--force", sets=own | whole)

        found = in_turn(lambda: full(rest), lambda: full({}), count=1)
        body.append(
            [
                "the full system up to 2 kHz, elements of 2 mm at the contact, modes and factorisations included",
                *pair(found),
            ]
        )
    put(
        PAGE,
        "rotation",
        table(["processor time on one rank", "at rest", "turning", "ratio"], body) + "\n" + noted(load),
    )


def pair(found):
    a, b = (middle(f, "cpu") for f in found)
    return [f"{a:.2f} s", f"{b:.2f} s", ratio(b, a)]


def written(folder, again, steps):
    """Cost of fields at a stride for the steps of the limit cycle."""
    load = busy()

    def strided(stride):
        sets = {f"analyses.transient.{kind}_stride": stride for kind in ("contact", "modal")}
        return again("rolling", steps | sets)

    found = in_turn(*(lambda s=s: strided(s) for s in (0, 20, 1)))
    none, *others = (middle(f, "cpu") for f in found)
    body = [["without fields", f"{none:.2f} s", ""]]
    body += [
        [name, f"{t:.2f} s", f"{100 * (t / none - 1):.0f} % more"]
        for name, t in zip(("every 20th step", "every step"), others)
    ]
    put(PAGE, "strides", table(["40 000 steps, contact and modal amplitudes", "CPU", ""], body) + "\n" + noted(load))
