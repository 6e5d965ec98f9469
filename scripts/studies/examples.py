"""The worked examples: runs their jobs, and writes the tables and the pictures of docs/examples."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from pages import put
from program import KEPT, ROOT, run
from railsqueal import Result
from railsqueal.tables import Branches, Sweep
from railsqueal.uncertainty import Uncertainty
from report import table

PAGES = ROOT / "docs" / "examples"
# Waves of the wheel that squeal: frequency, Hz, and name.
WAVES = [(344.3, "n = 2, against"), (357.7, "n = 2, with"), (965.1, "n = 3, against"), (985.0, "n = 3, with")]
# An eigenvalue this near is that wave, Hz.
NEAR = 6.0
# What decays faster, 1/s, is not followed: it is the wave no more.
LOST = -10.0
COLOURS = ["#4477aa", "#66ccee", "#cc3311", "#ee7733"]


class Point:
    """A point of a sweep: the values of its keys, and growth rates, 1/s, of the four waves (NaN where it decays too
    fast to be one)."""

    def __init__(self, values, eigenvalues):
        hertz = eigenvalues.imag / (2 * np.pi)
        self.values = values
        self.growth = [
            max((e.real for e, f in zip(eigenvalues, hertz) if abs(f - wave) < NEAR and e.real > LOST), default=np.nan)
            for wave, _ in WAVES
        ]
        beside = [abs(f - wave) >= NEAR for f in hertz for wave, _ in WAVES]
        apart = np.reshape(beside, (-1, len(WAVES))).all(axis=1)
        self.others = [(e.real, f) for e, f, a in zip(eigenvalues, hertz, apart) if a and e.real > 0]

    def cells(self):
        """The growth rates, and what else grows, for a table."""
        other = ", ".join(f"{g:.1f} ({f:.0f} Hz)" for g, f in self.others) or "–"
        return [f"{g:+.2f}" if np.isfinite(g) else "damped" for g in self.growth] + [other]


HEAD = [*(f"{wave:.0f} Hz, {name}" for wave, name in WAVES), "others that grow"]


def points(job):
    """The points of the sweep of a job."""
    KEPT.mkdir(parents=True, exist_ok=True)
    output = KEPT / Path(job).with_suffix(".h5").name
    output.unlink(missing_ok=True)
    run(job, {}, output=output)
    with Result(output) as result:
        sweep = Sweep.from_result(result)
    output.unlink()
    if np.any(sweep.status):
        raise SystemExit(f"points of {job} failed: {sweep.message}")
    values = [sweep.values[key] for key in sweep.keys]
    return [Point([v[k] for v in values], sweep.spectrum(k)) for k in range(len(sweep.status))]


def write(name, head, rows, draw):
    """The table and the picture of an example."""
    put(PAGES / f"{name}.md", name, table([*head, *HEAD], rows))
    figure, axes = plt.subplots(figsize=(7.2, 3.4), layout="constrained")
    axes.axhline(0, color="#bbbbbb", linewidth=1)
    draw(axes)
    axes.set_ylabel("growth rate / (1/s)")
    axes.legend(fontsize="small", frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    # No date and no random names: the same figures give the same file.
    plt.rcParams["svg.hashsalt"] = name
    figure.savefig(PAGES / f"{name}.svg", metadata={"Date": None})
    plt.close(figure)


def lines(axes, x, found, waves=range(len(WAVES)), **style):
    """Growth rates of the waves over x."""
    for k in waves:
        axes.plot(
            x, [p.growth[k] for p in found], marker="o", markersize=4, color=COLOURS[k], label=WAVES[k][1], **style
        )


def damped_wheel():
    """Damping of the modes with two and with three nodal diameters."""
    found = points("damped-wheel.json")
    two = [p for p in found if p.values[1] == found[0].values[1]]
    three = [p for p in found if p.values[0] == found[0].values[0]]

    def draw(axes):
        lines(axes, [p.values[0] for p in two], two, waves=(0, 1))
        lines(axes, [p.values[1] for p in three], three, waves=(2, 3))
        axes.set_xlabel("loss factor of the modes with as many nodal diameters")

    rows = [
        [f"{p.values[0]:g}", f"{p.values[1]:g}", *p.cells()] for p in found if p in two or p in three or p is found[-1]
    ]
    write("damped-wheel", ["loss factor, n = 2", "n = 3"], rows, draw)


def friction_modifier():
    """A dry rail, constant coefficients, and friction that rises."""
    found = points("friction-modifier.json")
    names = [
        "dry: 0.4 falling to 0.3",
        "constant 0.38",
        "constant 0.25",
        "constant 0.15",
        "modifier: 0.15 rising to 0.35",
    ]

    def draw(axes):
        place = np.arange(len(names))
        for k, (_, name) in enumerate(WAVES):
            axes.bar(
                place + 0.2 * (k - 1.5), [np.nan_to_num(p.growth[k]) for p in found], 0.2, color=COLOURS[k], label=name
            )
        axes.set_yscale("symlog", linthresh=1)
        axes.set_xticks(
            place, [n.replace(": ", ":\n").replace("constant", "constant\n") for n in names], fontsize="small"
        )

    write("friction-modifier", ["friction"], [[name, *p.cells()] for name, p in zip(names, found)], draw)


def worn_wheel():
    """A new and a worn profile over the lateral shift."""
    found = points("worn-wheel.json")
    half = len(found) // 2
    rows = [["new" if k < half else "worn", f"{1e3 * p.values[1]:g}", *p.cells()] for k, p in enumerate(found)]

    def draw(axes):
        for part, style in ((found[:half], "-"), (found[half:], "--")):
            lines(axes, [1e3 * p.values[1] for p in part], part, linestyle=style)
        axes.set_xlabel("lateral shift / mm (lines: new, dashed: worn)")
        for line in axes.lines[-len(WAVES) :]:
            line.set_label(None)

    write("worn-wheel", ["profile", "shift, mm"], rows, draw)


def sleeper_bay():
    """Places between two sleepers."""
    found = points("sleeper-bay.json")

    def draw(axes):
        lines(axes, [p.values[0] for p in found], found)
        axes.set_xlabel("distance from the middle of a sleeper / m")

    write("sleeper-bay", ["distance from a sleeper, m"], [[f"{p.values[0]:g}", *p.cells()] for p in found], draw)


# Wear of the wheel, and the rail's friction: static and kinetic coefficients with the limits between which they lie.
PROFILES = {
    "new": '"S1002"',
    "hollow 0.5 mm": '{"file": {"path": "profiles/half-worn-s1002.txt"}}',
    "hollow 1 mm": '{"file": {"path": "profiles/worn-s1002.txt"}}',
}
RAILS = {"dry": [(0.45, [0.41, 0.55]), (0.38, [0.30, 0.41])], "humid": [(0.30, [0.27, 0.40]), (0.26, [0.20, 0.27])]}


def uncertain_curve():
    """Probability of squeal of three states of wear on a dry and on a humid rail."""
    KEPT.mkdir(parents=True, exist_ok=True)
    rows, likely = [], {}
    for wear, profile in PROFILES.items():
        for rail, friction in RAILS.items():
            output = KEPT / "uncertain-curve.h5"
            output.unlink(missing_ok=True)
            sets = {"bodies.upper.profile": profile}
            for k, (mean, limits) in enumerate(friction):
                sets[f"analyses.uncertainty.inputs.{k}.distribution.normal.mean"] = mean
                sets[f"analyses.uncertainty.inputs.{k}.truncate"] = limits
            for k, name in enumerate(("static", "kinetic")):
                sets[f"contact.friction.exponential.{name}"] = friction[k][0]
            run("uncertain-curve.json", sets, output=output)
            with Result(output) as result:
                found = Uncertainty.from_result(result)
            output.unlink()
            likely[wear, rail] = found
            modes = ", ".join(
                f"{found.mode_frequency[m]:.0f} Hz {found.mode_probability[m]:.2f}" for m in found.squealing[:4]
            )
            rows.append(
                [
                    wear,
                    rail,
                    f"{found.probability:.2f}",
                    f"{found.interval[0]:.2f} to {found.interval[1]:.2f}",
                    modes or "none",
                ]
            )
    head = ["wheel", "rail", "P(squeal)", "95 % interval", "modes with their probability"]
    put(PAGES / "uncertain-curve.md", "uncertain-curve", table(head, rows))
    figure, axes = plt.subplots(figsize=(7.2, 3.0), layout="constrained")
    for k, rail in enumerate(RAILS):
        place = np.arange(len(PROFILES)) + 0.36 * (k - 0.5)
        shares = [likely[wear, rail] for wear in PROFILES]
        height = [p.probability for p in shares]
        error = np.abs(np.transpose([p.interval for p in shares]) - height)
        axes.bar(place, height, 0.36, yerr=error, capsize=3, color=COLOURS[2 * (1 - k)], label=rail)
    axes.set_xticks(range(len(PROFILES)), PROFILES)
    axes.set_xlabel("profile of the wheel")
    axes.set_ylabel("probability of squeal")
    axes.set_ylim(0, 1.05)
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    plt.rcParams["svg.hashsalt"] = "uncertain-curve"
    figure.savefig(PAGES / "uncertain-curve.svg", metadata={"Date": None})
    plt.close(figure)


def squeal_branch(name="squeal-branch", key="friction", form=".4f", unit=""):
    """Amplitude and sound of the limit cycles of one mode over the friction, or another key."""
    KEPT.mkdir(parents=True, exist_ok=True)
    output = KEPT / f"{name}.h5"
    output.unlink(missing_ok=True)
    run(f"{name}.json", {}, output=output, groups=())
    with Result(output) as result:
        found = Branches.from_result(result)
    output.unlink()
    # m/s, root mean square, of the wheel along y.
    rim = 1e3 * found.velocity_rms[:, 1, 1]
    # Of wheel and rail together.
    level = 10 * np.log10(sum(10 ** (0.1 * found.level_a[body]) for body in found.level_a))
    order = np.argsort(found.key)
    step = max(1, len(order) // 12)
    special = [k for k, kind in enumerate(found.special) if kind]
    shown = sorted({*order[::step], order[-1], *special}, key=lambda k: found.key[k])
    rows = [
        [
            f"{found.key[k]:{form}}",
            f"{found.frequency[k]:.2f}",
            f"{rim[k]:.1f}",
            f"{level[k]:.1f}",
            f"{100 * found.stick[k, 0]:.1f}",
            found.special[k] or "–",
        ]
        for k in shown
    ]
    label = f"{key}, {unit}" if unit else key
    head = [label, "frequency, Hz", "rim, mm/s", "sound power, dB(A)", "stick, %", "special point"]
    put(PAGES / f"{name}.md", name, table(head, rows))
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.2, 3.0), layout="constrained")
    drawn = ((left, rim, "lateral velocity of the rim / (mm/s)"), (right, level, "sound power / dB(A)"))
    for axes, values, quantity in drawn:
        axes.plot(found.key[order], values[order], marker="o", markersize=4, color=COLOURS[2])
        axes.axvline(found.onset_key[0], color="#bbbbbb", linewidth=1)
        axes.set_xlabel(f"{label.replace(', ', ' / ')} (line: threshold of rest)")
        axes.set_ylabel(quantity)
    plt.rcParams["svg.hashsalt"] = name
    figure.savefig(PAGES / f"{name}.svg", metadata={"Date": None})
    plt.close(figure)


def squeal_over_radius():
    """The same over the radius of the curve."""
    squeal_branch("squeal-over-radius", "radius", ".1f", "m")


def worked():
    """All of them."""
    examples = (damped_wheel, friction_modifier, worn_wheel, sleeper_bay, uncertain_curve, squeal_branch)
    for example in (*examples, squeal_over_radius):
        example()
    return {}
