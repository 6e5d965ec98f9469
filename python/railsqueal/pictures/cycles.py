"""Limit cycles of a sweep: branches over the key along which they are followed, a map of the loudest over two keys."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from ..result import Result
from ..tables import Cycles, Sweep
from .style import BLUE, GREEN, GREY, RED, Canvas, heading, legend
from .sweep import Key

# Direction of a branch: colour and mark.
LOOKS = {"mode": (GREEN, "o"), "up": (RED, "^"), "down": (BLUE, "v")}


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    if not Cycles.present(result):
        return []
    cycles, sweep = Cycles.from_result(result), Sweep.from_result(result)
    along = cycles.along if cycles.along in sweep.keys else sweep.keys[-1]
    made = branches(result, cycles, sweep, Key(result, sweep, along), canvas)
    if len(sweep.moving) == 2:
        made += energy_map(result, cycles, [Key(result, sweep, sweep.keys[i]) for i in sweep.moving], canvas)
    return made


def branches(result: Result, cycles: Cycles, sweep: Sweep, key: Key, canvas: Canvas) -> list[Path]:
    """Energy and frequency of each branch over the key; a line for each combination of the other keys."""
    others = [k for k in sweep.keys if k != key.key and len(sweep.shape) == len(sweep.keys)]
    lines: dict[tuple[object, ...], list[int]] = {}
    for point in range(len(sweep.status)):
        lines.setdefault(tuple(sweep.values[k][point] for k in others), []).append(point)
    squeals, loudest = cycles.fate > 0, cycles.loudest()
    shown = [(cycles.kinetic, "mean kinetic energy / J"), (cycles.frequency, "frequency / Hz")]
    if loudest is not None:
        shown.insert(1, (loudest, "sound power level,\nlouder body / dB(A)"))
    figure, panels = plt.subplots(
        len(shown), 1, sharex=True, figsize=(7.2, 1.4 + 2.8 * len(shown)), layout="constrained"
    )
    upper, lower = panels[0], panels[-1]
    for b, name in enumerate(cycles.branch):
        color, mark = LOOKS.get(name, (GREY, "o"))
        # Nothing leads from one word to the next.
        width = 0.0 if key.words else 1.0
        for points in lines.values():
            at = np.array(points)[np.argsort(key.values[points], kind="stable")]
            known = at[cycles.fate[b, at] >= 0]
            # What rests has no energy; a logarithm has no place for it.
            for axes, (values, _) in zip(panels, shown):
                shown_here = np.where(squeals[b, known], values[b, known], np.nan)
                axes.plot(key.values[known], shown_here, color=color, linewidth=width)
            for fate, filled in ((1, True), (2, False), (3, False)):
                these = at[cycles.fate[b, at] == fate]
                face = color if filled else "white"
                for axes, (values, _) in zip(panels, shown):
                    axes.plot(
                        key.values[these], values[b, these], mark, color=color, markerfacecolor=face, markersize=5
                    )
    rests = np.flatnonzero((cycles.fate == 0).any(axis=0))
    for place, mark in (("stable", "|"), ("unstable", "x")):
        these = rests[(sweep.unstable[rests] > 0) == (place == "unstable")]
        if len(these):
            upper.plot(
                key.values[these],
                np.full(len(these), 0.02),
                mark,
                color=GREY,
                transform=upper.get_xaxis_transform(),
                markersize=7,
            )
    if squeals.any():
        upper.set_yscale("log")
    for axes, (_, label) in zip(panels, shown):
        axes.set_ylabel(label)
    key.label_axis(lower.xaxis)
    upper.set_title(heading(result) + "limit cycles")
    names = {"mode": "from the most unstable mode", "up": "from the point before", "down": "from the point behind"}
    handles = [
        Line2D([], [], color=LOOKS[n][0], marker=LOOKS[n][1], label=names[n]) for n in cycles.branch if n in LOOKS
    ]
    if (cycles.fate > 1).any():
        handles.append(
            Line2D(
                [],
                [],
                linestyle="none",
                marker="o",
                color=GREY,
                markerfacecolor="white",
                label="irregular or unsettled",
            )
        )
    if len(rests):
        handles.append(Line2D([], [], linestyle="none", marker="|", color=GREY, label="at rest"))
    legend(figure, [], handles, columns=2)
    return canvas.save(figure, "limit-cycles")


def energy_map(result: Result, cycles: Cycles, keys: list[Key], canvas: Canvas) -> list[Path]:
    """The largest energy of all branches over two keys; crosses where it exists beside a stable rest."""
    across, up = keys
    (x, width), (y, height) = across.cells(), up.cells()
    at = tuple(np.searchsorted(key.levels, key.values) for key in (up, across))
    energy, beside = np.full((len(y), len(x)), np.nan), np.zeros((len(y), len(x)), bool)
    squeals = cycles.fate > 0
    energy[at] = np.where(squeals.any(axis=0), np.where(squeals, cycles.kinetic, 0).max(axis=0), np.nan)
    beside[at] = squeals.any(axis=0) & (Sweep.from_result(result).unstable == 0)
    figure, axes = plt.subplots(figsize=(6.8, 5.6), layout="constrained")
    levels = 10 * np.log10(energy)
    known = levels[np.isfinite(levels)]
    norm, colours = Normalize(*((known.min(), known.max()) if known.size else (0.0, 1.0))), plt.get_cmap("viridis")
    for j, i in np.argwhere(np.isfinite(levels)):
        corner = (float(x[i]) - width / 2, float(y[j]) - height / 2)
        axes.add_patch(Rectangle(corner, width, height, facecolor=colours(norm(levels[j, i])), linewidth=0))
    figure.colorbar(plt.cm.ScalarMappable(norm, colours), ax=axes, label="kinetic energy / dB re 1 J")
    axes.set_xlim(x[0] - width / 2, x[-1] + width / 2)
    axes.set_ylim(y[0] - height / 2, y[-1] + height / 2)
    for j, i in np.argwhere(beside):
        axes.plot(x[i], y[j], "x", color="white", markeredgecolor="black", markersize=6)
    across.label_map(axes.xaxis)
    up.label_map(axes.yaxis)
    axes.set_title(heading(result) + "limit cycles")
    if beside.any():
        legend(figure, [], [Line2D([], [], linestyle="none", marker="x", color="black", label="beside a stable rest")])
    return canvas.save(figure, "limit-cycles-map")
