"""Branches of limit cycles over a key: energy, velocity at the contact, level, stick and frequency; unstable parts
dashed."""

from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from ..labels import body_words, quantity
from ..result import Integers, Result
from ..tables import Branches
from .style import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, Canvas, heading, legend

# Mark and colour of a kind of special point.
MARKS = {
    "fold": ("s", RED),
    "flip": ("D", PURPLE),
    "torus": ("o", PURPLE),
    "crossing": ("P", PURPLE),
    "first stick": ("v", GREY),
    "first opening": ("^", GREY),
}


# Colours of branches, one after the other.
COLORS = (BLUE, ORANGE, GREEN)


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    """The branch diagram of a result that has branches."""
    if not Branches.present(result):
        return []
    branch = Branches.from_result(result)
    key = quantity(branch.along, result.units("cycles/key"), body_words(result.job))
    place = key.factor * branch.key
    shown = [
        (branch.kinetic, "mean kinetic\nenergy / J"),
        (1e3 * branch.velocity(), "velocity at the contact,\nrms / (mm/s)"),
        (100 * branch.stick[:, 1], "nodes that stick\nat most / %"),
        (branch.frequency, "frequency / Hz"),
    ]
    loudest = branch.loudest()
    if loudest is not None:
        shown.insert(2, (loudest, "sound power level\n/ dB(A)"))
    figure, panels = plt.subplots(len(shown), 1, sharex=True, figsize=(7.2, 2.4 * len(shown)), layout="constrained")
    # Without multipliers at all the branch is drawn full, and called cycles.
    known = bool((branch.unstable >= 0).any())
    for axes, (values, label) in zip(panels, shown):
        for k in range(len(branch.key) - 1):
            if branch.branch[k] != branch.branch[k + 1]:
                continue
            color = COLORS[int(branch.branch[k]) % len(COLORS)]
            line = line_style(branch.unstable[k : k + 2], known)
            axes.plot(place[k : k + 2], values[k : k + 2], color=color, linestyle=line)
        for k, kind in enumerate(branch.special):
            if kind in MARKS:
                mark, color = MARKS[kind]
                axes.plot(place[k], values[k], mark, color=color, markersize=6)
        for number, first in enumerate(branch.start):
            color = COLORS[number % len(COLORS)]
            axes.plot(place[first], values[first], "o", color=color, markerfacecolor="white", markersize=6)
        axes.set_ylabel(label)
        axes.ticklabel_format(axis="y", useOffset=False)
        for onset in key.factor * branch.onset_key[branch.onset_mode == 0]:
            axes.axvline(onset, color=GREY, linestyle=":", linewidth=1)
    panels[-1].set_xlabel(key.axis)
    panels[0].set_title(heading(result) + "branches of limit cycles")
    handles = [Line2D([], [], color=BLUE, label="stable" if known else "cycles")]
    if (branch.unstable > 0).any():
        handles.append(Line2D([], [], color=BLUE, linestyle="--", label="unstable"))
    if known and (branch.unstable < 0).any():
        handles.append(Line2D([], [], color=BLUE, linestyle="-.", label="stability not known"))
    handles.append(
        Line2D([], [], linestyle="none", marker="o", color=BLUE, markerfacecolor="white", label="begun with")
    )
    for kind in dict.fromkeys(k for k in branch.special if k in MARKS):
        mark, color = MARKS[kind]
        handles.append(Line2D([], [], linestyle="none", marker=mark, color=color, label=kind))
    if len(branch.onset_key):
        handles.append(Line2D([], [], color=GREY, linestyle=":", label="stability of rest changes"))
    legend(figure, [], handles, columns=3)
    return canvas.save(figure, "branches")


def line_style(unstable: Integers, known: bool) -> str:
    """Line between two cycles by their numbers of unstable multipliers, -1 where these are not known."""
    if unstable.max() > 0:
        return "--"
    return "-." if known and unstable.min() < 0 else "-"
