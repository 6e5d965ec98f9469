"""Tables of the pages that the program makes and no other study: written where `<!-- study: … -->` stands."""

import numpy as np
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
    put(DOCS / "theory.md", "closed-nodes", table(head, [["lateral force over μN", *(f"{found[n]:.3f}" for n in sorted(found))]]))


def modes_of_a_rail():
    """Growth rates of `wheel-on-rail.json` by the highest frequency of the modes that are kept."""
    waves = (965, 985, 358)
    rows = []
    for highest in (1100, 2500, 4000, 6000):
        tables, _ = run("wheel-on-rail.json", {"analyses.modes.max_frequency": highest}, groups=("stability",))
        rates, hertz = tables["stability/growth_rate"], tables["stability/frequency"]
        near = [max((g for g, f in zip(rates, hertz) if abs(f - wave) < 8), default=float("nan")) for wave in waves]
        rows.append([highest, *(f"{g:.3f}" for g in near)])
    head = ["modes up to, Hz", *(f"{wave} Hz, 1/s" for wave in waves)]
    put(DOCS / "wheel-on-rail.md", "modes-of-a-rail", table(head, rows))


def frequency(values, step):
    """Frequency of the largest line of a record, Hz: that of a parabola through three lines of its spectrum."""
    spectrum = np.log(np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values)))) + 1e-300)
    k = int(np.clip(spectrum.argmax(), 1, len(spectrum) - 2))
    a, b, c = spectrum[k - 1 : k + 2]
    return (k + 0.5 * (a - c) / (a - 2 * b + c)) / (len(values) * step)


def limit_cycles():
    """What rotation makes of the limit cycle of `squeal.json`, at its speed and at 3 m/s: the last half second."""
    cases = {"turns, 10 m/s": {}, "at rest, 10 m/s": both("rotation", "none"), "turns, 3 m/s": {"contact.speed": 3}}
    columns = []
    for sets in cases.values():
        tables, _ = run("squeal.json", sets, groups=("stability", "transient"))
        step = float(tables["transient/time"][1] - tables["transient/time"][0])
        end = slice(-int(0.5 / step), None)
        force, rim = tables["transient/force"][end], tables["transient/point_velocity"][end, 0, 1]
        sound = [float(tables[f"transient/sound_power/{body}/total_level_a"]) for body in ("lower", "upper")]
        columns.append([
            f"{tables['stability/growth_rate'][0]:.2f} ({tables['stability/frequency'][0]:.1f})",
            f"{frequency(force[:, 1] / force[:, 2], step):.1f}",
            str(int(tables["transient/stick"][end].max())),
            f"{-force[:, 2].max() / 1e3:.1f} to {-force[:, 2].min() / 1e3:.1f}",
            f"{tables['transient/kinetic'][end].mean():.3f}",
            f"{1e3 * rim.std():.3g}",
            ", ".join(f"{level:.1f}" for level in sound),
        ])
    names = [
        "fastest growth, 1/s (at, Hz)",
        "limit cycle, Hz",
        "nodes that stick at most",
        "normal force, kN",
        "kinetic energy, J",
        "rim of the wheel, lateral, mm/s (root mean square)",
        "sound power of both wheels, dB(A)",
    ]
    put(DOCS / "transient.md", "limit-cycles", table(["", *cases], [[name, *row] for name, row in zip(names, zip(*columns))]))


def partial_slip():
    """What becomes of 1 mJ of vibration in partial slip: the rate of the amplitude between 0.1 and 0.3 s."""
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
    put(DOCS / "transient.md", "partial-slip", table(["lateral creepage", "lateral force over μN", "nodes that stick", "rate, 1/s"], rows))


def written():
    """All of them."""
    closed_nodes()
    modes_of_a_rail()
    limit_cycles()
    partial_slip()
    return {}
