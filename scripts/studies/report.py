"""docs/explanation/validation.md from the figures of the studies."""

import textwrap
from math import log2

from program import ROOT

INTRODUCTION = """# Validation

Written by `scripts/validate`, which runs the program on the jobs of `jobs/` with other mesh sizes, loads and creepages.
The tests hold more comparisons, of the single parts.
"""


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


def percent(ratio):
    return f"{100 * ratio:+.2f} %"


def steady(rows):
    forces, normal = [], []
    for r in rows:
        cells = [f"{p['force']:.4f} (a/{p['per_radius']})" for p in r["points"]]
        forces.append(
            [
                f"{r['load'] / 1e3:g}",
                f"{100 * r['eta']:g} %",
                *cells,
                f"{r['force']:.4f}",
                r["contact"],
                percent(r["force"] / r["contact"] - 1),
            ]
        )
        if r["eta"] == 0.003:
            for p in r["points"]:
                normal.append(
                    [
                        f"{r['load'] / 1e3:g}",
                        f"a/{p['per_radius']}",
                        percent(p["pressure"] - 1),
                        percent(p["approach"] - 1),
                        f"{p['along']:.1e}",
                    ]
                )
    head = ["N, kN", "η", "coarse", "middle", "fine", "extrapolated", "CONTACT", "difference"]
    return (
        table(head, forces)
        + "\n"
        + table(["N, kN", "elements", "largest pressure − Hertz", "approach − Hertz", "F_x/μN"], normal)
    )


def spin(rows):
    cells = []
    for r in rows:
        part = r["radius"] / r["size"]
        off = [percent(r["off"]), percent(-2 / part**2)]
        cells.append([f"{1e3 * r['size']:g}", f"a/{part:.1f}", f"{r['force']:.4f}", *off])
    return table(["elements, mm", "", "F_y/μN", "beside f0 of f0 + c h²", "−2 h²/a²"], cells)


def modes(rows):
    cells = []
    for before, r in zip([None, *rows], rows):
        same = before and before["support"] == r["support"]
        order = f"{log2(before['largest'] / r['largest']):.2f}" if same else "–"
        rigid = f"{r['rigid']:.1e}" if r["support"] == "free" else "–"
        cells.append([r["support"], f"{1e3 * r['size']:g}", r["modes"], f"{100 * r['largest']:.3f} %", order, rigid])
    return table(
        ["support", "element size, mm", "modes", "largest error", "order", "largest rigid-body frequency, Hz"], cells
    )


def growth(rows):
    """One table for each sign of the creepage, direction of sliding and rotation: all unstable modes, or the least
    stable one."""
    parts = []
    for k, point in enumerate(rows[0]["points"]):
        head = [
            "elements at the contact, mm",
            "far away, mm",
            "modes of each body",
            "closed nodes",
            "first frequencies apart, Hz",
            "growth rates, 1/s",
            "at, Hz",
        ]
        cells = []
        for r in rows:
            rates, frequencies = zip(*r["points"][k]["growth"])
            listed = lambda values, digits: ", ".join(f"{v:.{digits}f}" for v in values)  # noqa: E731
            cells.append(
                [
                    f"{1e3 * r['contact']:g}",
                    f"{1e3 * r['far']:g}",
                    r["modes"],
                    r["closed"],
                    f"{r['gap']:.4f}",
                    listed(rates, 3),
                    listed(frequencies, 1),
                ]
            )
        wheels = "wheels that turn" if point["speed"] else "wheels at rest"
        parts.append(
            f"Lateral creepage {100 * point['lateral']:+g} %, {point['direction']} direction of sliding, {wheels}:\n\n"
            + table(head, cells)
        )
    return "\n".join(parts)


def one_point(rows):
    names = {
        "linear": "Kalker, linear",
        "shen_hedrick_elkins": "Shen, Hedrick, Elkins",
        "polach": "Polach",
        "fastsim": "FASTSIM",
    }
    shown = lambda value: "–" if value is None else f"{value:+.2f}"  # noqa: E731
    cells = []
    for r in rows:
        first = [f"{100 * r['lateral']:+g} %", f"{100 * r['stick']:.0f} %"]
        for i, frequency in enumerate(r["frequency"]):
            cells.append(
                [
                    *(first if i == 0 else [""] * 2),
                    f"{frequency:.1f}",
                    shown(r["patch"][i]),
                    *(shown(r["laws"][law][i]) for law in names),
                ]
            )
        cells.append(["", "", "unstable", r["unstable_patch"], *(r["unstable"][law] for law in names)])
    return table(
        ["lateral creepage", "nodes in stick", "Hz", "patch, 1/s", *(f"{name}, 1/s" for name in names.values())], cells
    )


def longitudinal(rows):
    heights = ["–" if m is None else f"{m[1]:.0f} Hz" for m in rows[-1]["modes"]]
    cells = [
        [f"{1e3 * r['size']:g}", r["closed"], *("–" if m is None else f"{m[0]:.3f}" for m in r["modes"]), r["unstable"]]
        for r in rows
    ]
    return table(["element size, mm", "closed nodes", *heights, "unstable modes"], cells)


def multibody(rows):
    digits = (3, 3, 2, 3, 3, 2)
    both = lambda r, k: f"{r['program'][k]:.{digits[k]}f} ({r['exudyn'][k]:.{digits[k]}f})"  # noqa: E731
    place = lambda r: [f"{r['radius']:g}", r["place"], f"{r['wheel_y']:.1f}"]  # noqa: E731
    quantities = ["shift, mm", "yaw, mrad", "N, kN", "ξ, ‰", "η, ‰", "lateral force, kN"]
    cells = [[*place(r), *(both(r, k) for k in range(6))] for r in rows]
    return table(["radius, m", "wheel", "touches at y, mm", *quantities], cells)


def rotation(rows):
    listed = lambda pairs: ", ".join(f"{g:.2f} ({f:.1f})" for g, f in pairs) or "–"  # noqa: E731
    tables = {}
    for job in dict.fromkeys(r["job"] for r in rows):
        cells = [[f"{r['speed']:g}", listed(r["rolling"]), listed(r["none"])] for r in rows if r["job"] == job]
        # Jobs with the same figures share a table.
        tables.setdefault(table(["V, m/s", "wheels that turn: growth, 1/s (at, Hz)", "at rest"], cells), []).append(
            f"`jobs/{job}.json`"
        )
    parts = [f"{' and '.join(jobs)}:\n\n{text}" for text, jobs in tables.items()]
    return "![growth over the speed](../pictures/rotation.svg)\n\n" + "\n".join(parts)


def ranks(rows):
    names = list(rows[0]["difference"])
    return table(["ranks", *names], [[r["ranks"], *(f"{r['difference'][n]:.1e}" for n in names)] for r in rows])


def transient(rows):
    head = [
        "lateral creepage",
        "step, µs",
        "linear, 1/s",
        "transient, 1/s",
        "halves of the time, 1/s",
        "linear, Hz",
        "transient, Hz",
        "shift of the frequency",
        "−(hω)²/12",
    ]
    cells = []
    for r in rows:
        (rate, frequency), (fitted, at) = r["linear"], r["transient"]
        halves = ", ".join(f"{half:.3f}" for half in r["halves"])
        shifts = [f"{1e6 * (at / frequency - 1):.1f}e-6", f"{1e6 * r['scheme']:.1f}e-6"]
        cells.append(
            [
                f"{100 * r['lateral']:+g} %",
                f"{1e6 * r['step']:g}",
                f"{rate:.3f}",
                f"{fitted:.3f}",
                halves,
                f"{frequency:.3f}",
                f"{at:.3f}",
                *shifts,
            ]
        )
    return table(head, cells)


def faults(rows):
    return table(["what", "cases", "outcome"], [[r["what"], r["cases"], r["outcome"]] for r in rows])


# Title, words and table of each study.
SECTIONS = {
    "half_space": (
        "Steady rolling on half-spaces",
        "Lateral force F_y/μN of two equal steel bodies with radii of 0.5 m both ways, μ = 0.3, with element sizes of "
        "a "
        "fraction of Hertz's contact radius a, extrapolated by f0 + c h² (the order of the upstream difference), "
        "beside CONTACT extrapolated "
        "to zero grid size. Pressure and approach beside Hertz.",
        steady,
    ),
    "spin": (
        "Spin alone",
        "The same two bodies under 70 kN with spin alone, φ = 0.4 1/m: a rigid slip of 0.2 % at the edge of "
        "the contact. It depends on where the leading edge lies between the nodes, and is too small by up to "
        "about 2 h²/a² of itself, where that of a lateral creepage is good to 1 %. In stick the slope of w "
        "along x is that of the rigid slip, which spin makes a straight line; the differences at the two "
        "nodes behind the leading edge are exact for a constant alone. Taking the rigid slip at the middle of "
        "these differences makes it +1.4, +0.8, +0.5 and +0.3 % at the first four sizes, but where spin "
        "saturates (φ = 4 1/m) +3.6 % at 1 mm where it is +1.3 %, so it is not done. Grids that follow from "
        "the job have fourteen spacings in the half axis where spin rules, and a coarser one is told.",
        spin,
    ),
    "finite_elements": (
        "Steady rolling with finite elements",
        "The same with the compliance of the finite-element cylinders. Their approach is larger than Hertz's "
        "half-space value: it includes the deformation of the whole disc, from the contact to the clamped bore (0.04 "
        "nm/N for each).",
        steady,
    ),
    "modes": (
        "Modes of the plain annular cylinder",
        "First 30 modes on uniform meshes against the converged reference in `docs/data/annulus_modes.csv`; "
        "the order is that of the largest error. Clamping makes the stress singular at the edges of the bore, which "
        "costs some of the order.",
        modes,
    ),
    "growth": (
        "Growth rates of the narrow curve",
        "`jobs/curve.json` on other meshes and with other numbers of modes, with wheels that turn and at rest: every "
        "unstable mode, or the least stable one where there is none. "
        "The distance between the first frequencies of the two cylinders, on which the growth depends, is 1.0369 Hz by "
        "`docs/data/crowned_modes.csv`.",
        growth,
    ),
    "one_point": (
        "One point in place of the patch",
        '`jobs/curve.json` with `analyses.stability.contact = "point"`: growth rates of the unstable modes, or of the '
        "three least stable ones, with the discretised contact and with one point on Hertz' spring, by "
        "each law of point contact; – where no mode with a damping ratio below 0.3 moves alike. Below them how many "
        "are unstable in all.",
        one_point,
    ),
    "longitudinal": (
        "Longitudinal sliding",
        "`jobs/curve.json` with wheels at rest, a longitudinal creepage of 1 % in place of the lateral one and 20 "
        "modes of each body: growth rates, 1/s, of three modes that the "
        "contact moves much, against the grid; – where no eigenvalue near that frequency has a damping ratio below "
        "0.2.",
        longitudinal,
    ),
    "rotation": (
        "Wheels that turn",
        "Every unstable mode of the narrow curve against the speed, the creepage being the same, with the inertia of "
        'wheels that turn (`"rolling"`) and of wheels at rest (`"none"`). '
        "V = 0 is the limit at the sliding velocity of 10 m/s: 0.125 m/s, 0.25 rad/s, with a creepage of 0.8. A pair "
        "of n nodal diameters splits into two waves, each of which has about half of the pair's growth. "
        "Circles turn, crosses are at rest.",
        rotation,
    ),
    "transient": (
        "The transient against the linear analysis",
        "`jobs/squeal.json` from a start in each unstable mode with 0.05 µm, and at the other sign of the lateral "
        "creepage in as many of the least stable modes, against the eigenvalues of full "
        'sliding (`"actual"`). Rates and frequencies are those of the modal amplitudes from 0.03 to 0.2 s, fitted by '
        "dynamic mode decomposition, and from either half of that time. "
        "The study fails where a rate is off by more than 2 % and more than 0.2 1/s, where the halves differ by more "
        "than a tenth of that, where the frequency is not low by (hω)²/12 "
        "within 1e-5 of it, where the rest of the difference does not fall with the step, or where a node sticks.",
        transient,
    ),
    "multibody": (
        "A bogie in curves, beside a multibody program",
        "The metro bogie with a friction of 0.35: steady curving of the program, and in brackets the end of a run in "
        "time by Exudyn 1.13.6 (`scripts/studies/curving_exudyn.py`, `docs/data/curving_exudyn.csv`), in which "
        "two wheelsets that spin and a frame run 30 m round the curve. Inertia, rotations, suspension and the "
        "velocities of which the creepages are made are Exudyn's; profiles, Hertz' contact and the creep law are those "
        "of the independent model in Python.",
        multibody,
    ),
    "ranks": (
        "Number of ranks",
        "Unlike bodies, all creepages: largest difference from one rank, relative to the largest entry.",
        ranks,
    ),
    "faults": (
        "Faults",
        "Runs that are killed again and again until they are done, segments and models with one fault each (a bit, a "
        "byte more, a piece of zeros, the end cut off, the file gone), and jobs "
        "with one to three, by fixed seeds; odd jobs have one to three values that nobody means, and are run. Readers "
        "are called as a library. The study fails where a result is silently wrong or has NaN "
        "where there should be a number, where steps are made on what is damaged, where a process ends by a signal or "
        "with exit code 1 or does not end when it is asked to, and where a reader panics, works for more than 2 s, or "
        "takes more memory "
        "than ten times the file and 64 MB. Result files keep to that because the process that reads them gets no "
        "more: one byte of damage can make libhdf5 ask for gigabytes, which is refused. Its time is by the clock, with "
        "whatever else the machine does. `FAULTS=12.5`, 40 minutes, does the 500 kills of the table; `scripts/validate "
        "readers` a million files of each kind for the readers, a tenth of segments and results.",
        faults,
    ),
}


def written(path):
    """The sections of the page as it is, by their titles."""
    parts = path.read_text().split("\n## ")[1:] if path.exists() else []
    return {part.split("\n", 1)[0]: f"## {part.rstrip()}\n" for part in parts}


def write(found):
    """The page anew; a study without figures keeps the section it has."""
    page = ROOT / "docs/explanation/validation.md"
    old, parts = written(page), [INTRODUCTION]
    for name, (title, words, rows) in SECTIONS.items():
        if name in found:
            prose = textwrap.fill(words, 120, break_long_words=False, break_on_hyphens=False)
            parts.append(f"## {title}\n\n{prose}\n\n{rows(found[name])}")
        elif title in old:
            parts.append(old[title])
    page.write_text("\n".join(parts))
    print("docs/explanation/validation.md")
