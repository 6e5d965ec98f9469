"""Probability of squeal of a wheel on a rail: the tables and pictures of docs/explanation/uncertainty.md."""

import re
import textwrap

import matplotlib.pyplot as plt
from pages import put
from program import KEPT, ROOT, run
from railsqueal import Result
from railsqueal.pictures import Canvas, style, uncertainty
from railsqueal.uncertainty import Uncertainty
from report import table

PAGE = ROOT / "docs" / "explanation" / "uncertainty.md"
PICTURES = ROOT / "docs" / "pictures"
# Pictures of the study, and the names that the page has for them.
SHOWN = {
    "uncertainty-probability": "uncertain-squeal.svg",
    "uncertainty-indices": "uncertain-squeal-indices.svg",
    "uncertainty-map": "uncertain-squeal-map.svg",
}
INPUTS = {
    "contact.friction": "coefficient of friction",
    "contact.placement.lateral": "lateral shift",
    "bodies.upper.damping.modal.by_diameter.2": "loss factor, n ≥ 2",
}


def interval(ends):
    return f"{signed(ends[0], 2)} to {signed(ends[1], 2)}"


def signed(value, digits, plus=""):
    """A number with a minus sign as it is printed."""
    return f"{value:{plus}.{digits}f}".replace("-", "−")


def squeal():
    """Runs `uncertain-squeal.json`, and writes its probabilities, its indices and its pictures."""
    KEPT.mkdir(parents=True, exist_ok=True)
    output = KEPT / "uncertain-squeal.h5"
    output.unlink(missing_ok=True)
    run("uncertain-squeal.json", {}, output=output)
    style.apply()
    # No random names: the same figures give the same file.
    plt.rcParams["svg.hashsalt"] = "uncertain-squeal"
    with Result(output) as result:
        found = Uncertainty.from_result(result)
        made = uncertainty.pictures(result, Canvas(PICTURES, "made", ["svg"]))
    output.unlink()
    for path in made:
        name = SHOWN.get(path.stem.removeprefix("made-"))
        if name:
            path.replace(PICTURES / name)
        else:
            path.unlink()
    ends = [list(found.levels).index(level) for level in (0.05, 0.5, 0.95)]
    rows = [["any", f"{found.probability:.3f}", *limits(found.interval), ""]]
    for m in found.squealing:
        rates = ", ".join(signed(found.mode_quantiles[m, k], 2, "+") for k in ends)
        chance = f"{found.mode_probability[m]:.3f}"
        rows.append(
            [re.sub(r"upper mode \d+", "wheel", found.modes[m]), chance, *limits(found.mode_interval[m]), rates]
        )
    head = ["mode", "P", "95 % interval", "growth rate, 1/s: 5 %, median, 95 %"]
    put(PAGE, "uncertain-squeal", f"{sentence(found)}\n\n{table(head, rows)}")
    rows = [
        [
            INPUTS[key],
            signed(found.first[k], 2),
            interval(found.first_interval[k]),
            signed(found.total[k], 2),
            interval(found.total_interval[k]),
        ]
        for k, key in enumerate(found.keys)
    ]
    head = ["input", "first-order index", "95 % interval", "total index", "95 % interval"]
    put(PAGE, "uncertain-squeal-indices", table(head, rows))
    return {}


def limits(ends):
    return [f"{ends[0]:.3f} to {ends[1]:.3f}"]


def sentence(found):
    """The outcome, with the numbers of samples and points."""
    said = textwrap.fill(found.sentence(INPUTS), 117, initial_indent="> ", subsequent_indent="> ")
    failed = f"{found.failed} failed" if found.failed else "none failed"
    return f"{found.samples} random samples, {len(found.status)} points in all, of which {failed}:\n\n{said}"
