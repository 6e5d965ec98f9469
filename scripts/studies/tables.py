"""Tables of the pages that the program makes and no other study: written where `<!-- study: … -->` stands."""

import json
import os
import subprocess

import numpy as np
import steady
from pages import put
from program import ROOT, both, run
from report import table

DOCS = ROOT / "docs"


def closed_nodes():
    """The lateral force of `two-cylinders.json` on half-spaces, a patch of 12 mm, by the number of closed nodes."""
    found = {}
    for size in (3e-3, 2.6e-3, 2.2e-3, 1.6e-3, 1.2e-3, 8e-4, 5.7e-4):
        sets = both("mesh.cylinder.element_size", size) | {
            "contact.compliance": "half_space",
            "contact.patch.half_length": 0.006,
            "contact.patch.half_width": 0.006,
            "analyses.modes": "null",
        }
        tables, _ = run("two-cylinders.json", sets, ranks=1, only="steady")
        force, closed = tables["contact/force"], int((tables["contact/state"] > 0).sum())
        found[closed] = abs(force[1]) / (0.3 * abs(force[2]))
    head = ["closed nodes", *map(str, sorted(found))]
    put(
        DOCS / "explanation" / "limits.md",
        "closed-nodes",
        table(head, [["lateral force over μN", *(f"{found[n]:.3f}" for n in sorted(found))]]),
    )


def modes_of_a_rail():
    """Growth rates of `wheel-at-given-yaw.json` by the highest frequency of the modes that are kept."""
    waves = (965, 985, 358)
    rows = []
    for highest in (1100, 2500, 4000, 6000):
        tables, _ = run("wheel-at-given-yaw.json", {"analyses.modes.max_frequency": highest}, groups=("stability",))
        rates, hertz = tables["stability/growth_rate"], tables["stability/frequency"]
        near = [max((g for g, f in zip(rates, hertz) if abs(f - wave) < 8), default=float("nan")) for wave in waves]
        rows.append([highest, *(f"{g:.3f}" for g in near)])
    head = ["modes up to, Hz", *(f"{wave} Hz, 1/s" for wave in waves)]
    put(DOCS / "examples" / "wheel-on-rail.md", "modes-of-a-rail", table(head, rows))


def frequency(values, step):
    """Frequency of the largest line of a record, Hz: that of a parabola through three lines of its spectrum."""
    spectrum = np.log(np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values)))) + 1e-300)
    k = int(np.clip(spectrum.argmax(), 1, len(spectrum) - 2))
    a, b, c = spectrum[k - 1 : k + 2]
    return (k + 0.5 * (a - c) / (a - 2 * b + c)) / (len(values) * step)


def limit_cycles():
    """Effect of rotation on the limit cycle of `squeal.json`, at its speed and at 3 m/s: the last half second."""
    cases = {"turns, 10 m/s": {}, "at rest, 10 m/s": both("rotation", "none"), "turns, 3 m/s": {"contact.speed": 3}}
    columns = []
    for sets in cases.values():
        tables, _ = run("squeal.json", sets, groups=("stability", "transient"))
        step = float(tables["transient/time"][1] - tables["transient/time"][0])
        end = slice(-int(0.5 / step), None)
        force, rim = tables["transient/force"][end], tables["transient/point_velocity"][end, 0, 1]
        sound = [float(tables[f"transient/sound_power/{body}/total_level_a"]) for body in ("lower", "upper")]
        columns.append(
            [
                f"{tables['stability/growth_rate'][0]:.2f} ({tables['stability/frequency'][0]:.1f})",
                f"{frequency(force[:, 1] / force[:, 2], step):.1f}",
                str(int(tables["transient/stick"][end].max())),
                f"{-force[:, 2].max() / 1e3:.1f} to {-force[:, 2].min() / 1e3:.1f}",
                f"{tables['transient/kinetic'][end].mean():.3f}",
                f"{1e3 * rim.std():.3g}",
                ", ".join(f"{level:.1f}" for level in sound),
            ]
        )
    names = [
        "fastest growth, 1/s (at, Hz)",
        "limit cycle, Hz",
        "nodes that stick at most",
        "normal force, kN",
        "kinetic energy, J",
        "rim of the wheel, lateral, mm/s (root mean square)",
        "sound power of both wheels, dB(A)",
    ]
    put(
        DOCS / "explanation" / "transient.md",
        "limit-cycles",
        table(["", *cases], [[name, *row] for name, row in zip(names, zip(*columns))]),
    )


def partial_slip():
    """Decay of 1 mJ of vibration in partial slip: the rate of the amplitude between 0.1 and 0.3 s."""
    rows = []
    for lateral in (0.003, 0.005, 0.006, 0.007, 0.0075, 0.008):
        sets = both("rotation", "none") | {
            "contact.creepage.lateral": lateral,
            "analyses.transient.duration": 0.3,
            "analyses.transient.start": '{"state": "steady", "random": {"seed": 1, "energy": 1e-3}}',
            "analyses.transient.sound_power": "null",
        }
        tables, _ = run("squeal.json", sets, groups=("transient",))
        time, kinetic = tables["transient/time"], tables["transient/kinetic"]
        # Means over 10 ms, some periods of every mode that matters.
        width = int(round(0.01 / (time[1] - time[0])))
        count = len(time) // width
        means = [values[: count * width].reshape(count, width).mean(axis=1) for values in (time, kinetic)]
        late = means[0] > 0.1
        rate = 0.5 * np.polyfit(means[0][late], np.log(means[1][late]), 1)[0]
        end = time > 0.1
        force = tables["transient/force"][end].mean(axis=0)
        low, high = tables["transient/stick"][end].min(), tables["transient/stick"][end].max()
        stick = f"{low}" if low == high else f"{low} to {high}"
        rows.append([f"{100 * lateral:g} %", f"{abs(force[1] / (0.3 * force[2])):.3f}", stick, f"{rate:+.1f}"])
    put(
        DOCS / "explanation" / "transient.md",
        "partial-slip",
        table(["lateral creepage", "lateral force over μN", "nodes that stick", "rate, 1/s"], rows),
    )


# The lateral force of CONTACT 20.2 (E. A. H. Vollebregt) for two steel bodies of 0.5 m under 70 kN, of friction 0.3,
# over μN.
CONTACT = {0.001: -0.3005, 0.003: -0.7177, 0.005: -0.9304}


def laws_of_point_contact():
    """The lateral force by the laws of point contact on the bodies of `two-cylinders.json`, beside the discretised
    contact and CONTACT."""
    laws = {"fastsim": "FASTSIM", "shen_hedrick_elkins": "Shen, Hedrick, Elkins", "polach": "Polach"}
    sets = both("mesh.cylinder.element_size", 5e-4) | {
        "contact.compliance": "half_space",
        "contact.patch.half_length": 0.006,
        "contact.patch.half_width": 0.006,
        "contact.creepage": '{"lateral": 0.001}',
        "analyses": json.dumps({"creep_curve": {"key": "lateral", "values": list(CONTACT)}}),
    }
    tables, _ = run("two-cylinders.json", sets, ranks=1, groups=("creep_curve",))
    load = abs(tables["creep_curve/force"][:, 2]) * 0.3
    columns = [tables["creep_curve/force"], *(tables[f"creep_curve/{law}"] for law in laws)]
    rows = [
        [f"{100 * eta:g} %", f"{CONTACT[eta]:.4f}", *(f"{column[k, 1] / load[k]:.4f}" for column in columns)]
        for k, eta in enumerate(CONTACT)
    ]
    put(
        DOCS / "explanation" / "contact.md",
        "laws-of-point-contact",
        table(["η", "CONTACT", "this program", *laws.values()], rows),
    )


def swept_cylinders():
    """Growth rates of the bodies of `curve.json` at rest, swept from their sections, by the spacing of the contact's
    grid, and on their meshes."""
    sets = both("rotation", "none") | {
        "analyses.stability": '{"state": "sliding", "direction": "rigid"}',
        "output.fields": "false",
    }
    rows = []
    for spacing in (3.5e-4, 5e-4, 7e-4, 8e-4, 1e-3):
        tables, _ = run(
            "swept-curve.json", sets | {"contact.patch.spacing": spacing}, only="stability", groups=("stability",)
        )
        rows.append([f"swept, {1e3 * spacing:g} mm", *(f"{g:.2f}" for g in tables["stability/growth_rate"][:3])])
    tables, _ = run("curve.json", sets, only="stability", groups=("stability",))
    rows.append(["finite elements, 1 mm", *(f"{g:.2f}" for g in tables["stability/growth_rate"][:3])])
    put(DOCS / "explanation" / "bodies.md", "swept-cylinders", table(["grid", "first", "second", "third"], rows))


def full_and_reduced():
    """The full system of `curve.json` on a coarse mesh at rest beside the reduced one, by the number of modes kept."""
    waves = (426, 578, 486)
    rows, full = [], {}
    for count in (20, 40, 80, 160):
        distances = []
        for beta in (1e-6, 0):
            sets = (
                both("rotation", "none")
                | both("mesh.cylinder.element_size", 0.002)
                | both("mesh.cylinder.max_element_size", 0.05)
            )
            sets |= both("damping.beta", beta) | {
                "analyses.modes.count": count,
                "analyses.stability": '{"state": "sliding", "direction": "rigid", "full": {"max_frequency": 2000}}',
                "output.fields": "false",
            }
            tables, _ = run("curve.json", sets, only="stability", groups=("stability", "modes"))
            values, partner = tables["stability/eigenvalue"], tables["stability/partner"]
            is_full = np.array([source in ("full", b"full") for source in tables["stability/source"]])
            whole, reduced, there = values[is_full], values[~is_full], is_full & (partner >= 0)
            distances.append(abs(values[there] - values[partner[there]]) / abs(values[there]))
            if beta:
                near = lambda values, wave: max(v.real for v in values if abs(v.imag / (2 * np.pi) - wave) < 8)
                rates = [f"{near(reduced, wave):.4f}" for wave in waves]
                full = [f"{near(whole, wave):.4f}" for wave in waves]
                highest = tables["modes/lower/frequency"].max()
        rows.append(
            [
                f"{count} ({highest / 1e3:.1f} kHz)",
                *rates,
                *(f"{of(d):.1e}" for d in distances for of in (np.max, np.median)),
            ]
        )
    rows.append(["full", *full, "", "", "", ""])
    head = [
        "modes (up to)",
        *(f"{wave} Hz" for wave in waves),
        "largest distance",
        "median",
        "largest, β = 0",
        "median, β = 0",
    ]
    put(DOCS / "explanation" / "stability.md", "full-and-reduced", table(head, rows))


def quadratures():
    """Laws at nodes and at points of quadrature: `two-cylinders.json` on half-spaces beside Hertz and CONTACT, on two
    grids."""
    radius, pressure, approach = steady.HERTZ[70e3]
    stick = 0.518  # CONTACT's, at 0.3 %
    rows = [["Hertz, CONTACT", "", "1", "1", "1", *(f"{force:.4f}" for force in CONTACT.values()), f"{stick:.3f}", ""]]
    for kind in ("nodal", "consistent"):
        for size in (1e-3, 5e-4):
            found, took = {}, {}
            for eta in CONTACT:
                sets = both("mesh.cylinder.element_size", size) | {
                    "contact.compliance": "half_space",
                    "contact.creepage.lateral": eta,
                    "contact.quadrature": kind,
                    "analyses.modes": "null",
                    "output.fields": "false",
                }
                found[eta], took[eta] = run("two-cylinders.json", sets, ranks=1, only="steady")
            tables = found[0.003]
            if kind == "nodal":
                weight, state = tables["contact/weight"], tables["contact/state"]
                area, sticking = weight[state > 0].sum(), weight[state == 1].sum()
                largest = tables["contact/pressure"].max()
            else:
                (area, sticking), largest = tables["contact/area"], tables["contact/field"][:, 2].max()
            along = [f"{found[eta]['contact/force'][1] / (0.3 * 70e3):.4f}" for eta in CONTACT]
            ratios = [area / (np.pi * radius**2), largest / pressure, float(tables["contact/approach"]) / approach]
            rows.append(
                [
                    kind,
                    f"{1e3 * size:g} mm",
                    *(f"{r:.4f}" for r in ratios),
                    *along,
                    f"{sticking / area:.3f}",
                    f"{took[0.003]:.1f}",
                ]
            )
    names = [f"F_y/μN at {100 * eta:g} %" for eta in CONTACT]
    head = ["laws", "grid", "area", "largest pressure", "approach", *names, "stick at 0.3 %", "whole run, s"]
    put(DOCS / "explanation" / "contact.md", "quadratures", table(head, rows))


def manchester():
    """Manchester's benchmark A-2.2 beside CONTACT, as the test computes it."""
    command = ["cargo", "test", "--release", "--quiet", "--test", "wheel_on_rail", "--", "--nocapture"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    rows = [line.partition("row: ")[2].split(" | ") for line in done.stdout.splitlines() if "row: " in line]
    head = ["case", "approach, µm", "largest pressure, MPa", "Fx, N; on CONTACT's grid", "Fs, N; on CONTACT's grid"]
    put(DOCS / "explanation" / "placement.md", "manchester", table(head, rows))


TABLES = [
    manchester,
    closed_nodes,
    quadratures,
    laws_of_point_contact,
    modes_of_a_rail,
    swept_cylinders,
    full_and_reduced,
    limit_cycles,
    partial_slip,
]


def written():
    """All of them, or those named in TABLES."""
    wanted = os.environ.get("TABLES", "").split()
    for make in TABLES:
        if not wanted or make.__name__ in wanted:
            make()
    return {}
