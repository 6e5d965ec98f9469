"""Uncertain squeal: probability by mode, growth rates, Sobol' indices, samples and maps over the inputs, and levels."""

import textwrap
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D

from ..result import Floats, Result
from ..uncertainty import Loudness, Uncertainty, named
from .style import BLUE, GREY, ORANGE, RED, Canvas, heading, legend

# Modes with a line of their own.
MODES = 12


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    if not Uncertainty.present(result):
        return []
    table = Uncertainty.from_result(result)
    made = probabilities(result, table, canvas) + growth_rates(result, table, canvas)
    if table.first is not None:
        made += tornado(result, table, canvas)
    made += scatter(result, table, canvas) + conditional(result, table, canvas)
    return made + levels(result, canvas)


def short(name: str) -> str:
    """The name of a mode on two lines."""
    return name.replace(", ", "\n", 1)


def probabilities(result: Result, table: Uncertainty, canvas: Canvas) -> list[Path]:
    """Probability that each mode is unstable, with its interval."""
    modes = (table.squealing or list(range(len(table.modes))))[:MODES]
    values = [table.probability, *(table.mode_probability[m] for m in modes)]
    ends = np.array([table.interval, *(table.mode_interval[m] for m in modes)])
    names = ["any mode", *(short(table.modes[m]) for m in modes)]
    if table.other > 0:
        values.append(table.other)
        ends = np.vstack([ends, [np.nan, np.nan]])
        names.append("other motions")
    figure, axes = plt.subplots(figsize=(7.2, 1.4 + 0.5 * len(values)), layout="constrained")
    places = np.arange(len(values))
    axes.barh(places, values, color=[RED, *[ORANGE] * (len(values) - 1)], height=0.6)
    wide = np.abs(ends.T - np.array(values))
    axes.errorbar(values, places, xerr=wide, fmt="none", color="black", capsize=3, linewidth=1.2)
    axes.set_yticks(places, names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0, min(1.0, 1.1 * max(np.nanmax(ends), max(values), 0.05)))
    axes.set_xlabel(f"probability of instability, with {100 * table.confidence:.0f} % intervals")
    axes.set_title(f"{heading(result)}probability of squeal by mode, {table.samples} samples")
    return canvas.save(figure, "uncertainty-probability")


def growth_rates(result: Result, table: Uncertainty, canvas: Canvas) -> list[Path]:
    """Distribution functions of the growth rates of the largest and of each mode."""
    figure, axes = plt.subplots(figsize=(7.2, 4.6), layout="constrained")
    at = table.random

    def line(values: Floats, label: str, **look: Any) -> None:
        known = np.sort(values[np.isfinite(values)])
        if len(known):
            axes.step(known, np.arange(1, len(known) + 1) / len(known), where="post", label=label, **look)

    line(table.growth_rate[at], "largest growth rate", color="black", linewidth=2.2)
    colours = plt.get_cmap("viridis")
    modes = (table.squealing or list(range(len(table.modes))))[:6]
    for k, m in enumerate(modes):
        line(table.mode_growth[at, m], table.modes[m], color=colours(k / max(len(modes) - 1, 1) * 0.9))
    axes.axvline(0, color=GREY, linewidth=1, linestyle=":")
    shown = np.concatenate([table.quantiles, table.mode_quantiles[modes].ravel()])
    shown = shown[np.isfinite(shown)]
    if len(shown):
        margin = 0.05 * max(np.ptp(shown), 1e-9)
        axes.set_xlim(shown.min() - margin, shown.max() + margin)
    axes.set_ylim(0, 1)
    axes.set_xlabel("growth rate σ / (1/s); unstable to the right of 0")
    axes.set_ylabel("share of the samples up to it")
    axes.set_title(f"{heading(result)}distribution of growth rates")
    legend(figure, [axes], columns=2)
    return canvas.save(figure, "uncertainty-growth")


def tornado(result: Result, table: Uncertainty, canvas: Canvas) -> list[Path]:
    """First-order and total Sobol' indices, the largest at the top."""
    assert table.first is not None and table.total is not None
    assert table.first_interval is not None and table.total_interval is not None
    order = np.argsort(-table.total, kind="stable")
    labels = [named(result, table.keys[k]).name for k in order]
    figure, axes = plt.subplots(figsize=(7.2, 1.6 + 0.7 * len(order)), layout="constrained")
    places = np.arange(len(order))
    for values, ends, shift, colour, label in (
        (table.first, table.first_interval, -0.19, BLUE, "by itself (first order)"),
        (table.total, table.total_interval, 0.19, ORANGE, "with all interactions (total)"),
    ):
        axes.barh(places + shift, values[order], height=0.36, color=colour, label=label)
        wide = np.abs(ends[order].T - values[order])
        axes.errorbar(values[order], places + shift, xerr=wide, fmt="none", color="black", capsize=3, linewidth=1.2)
    axes.set_yticks(places, [textwrap.fill(label, 32) for label in labels])
    axes.invert_yaxis()
    axes.axvline(0, color=GREY, linewidth=1)
    axes.set_xlabel("share of the variance of the largest growth rate (Sobol' index)")
    axes.set_title(f"{heading(result)}influence of the inputs")
    legend(figure, [axes])
    return canvas.save(figure, "uncertainty-indices")


def scatter(result: Result, table: Uncertainty, canvas: Canvas) -> list[Path]:
    """Largest growth rate of the random samples over each input."""
    count = len(table.keys)
    columns = min(count, 3)
    rows = -(-count // columns)
    figure, grid = plt.subplots(
        rows, columns, figsize=(1.2 + 3.2 * columns, 1 + 2.8 * rows), sharey=True, squeeze=False, layout="constrained"
    )
    at = table.random
    growth, grows = table.growth_rate[at], table.unstable[at] > 0
    for k, axes in enumerate(grid.flat):
        if k >= count:
            axes.axis("off")
            continue
        found = named(result, table.keys[k])
        x = found.factor * table.values[table.keys[k]][at]
        axes.plot(x[~grows], growth[~grows], ".", color=BLUE, markersize=4)
        axes.plot(x[grows], growth[grows], ".", color=RED, markersize=4)
        axes.axhline(0, color=GREY, linewidth=1, linestyle=":")
        axes.set_xlabel(textwrap.fill(found.axis, 34))
    low, high = np.nanquantile(growth, [0.01, 1.0]) if len(growth) else (-1.0, 1.0)
    margin = 0.05 * max(float(high - low), 1e-9)
    grid[0, 0].set_ylim(low - margin, high + margin)
    for axes in grid[:, 0]:
        axes.set_ylabel("largest growth rate σ / (1/s)")
    figure.suptitle(f"{heading(result)}samples over the inputs", fontsize=10)
    dots = [(RED, "unstable"), (BLUE, "stable")]
    legend(figure, [], [Line2D([], [], linestyle="none", marker="o", markersize=4, color=c, label=t) for c, t in dots])
    return canvas.save(figure, "uncertainty-scatter")


def conditional(result: Result, table: Uncertainty, canvas: Canvas) -> list[Path]:
    """Conditional probability of squeal over the two inputs that it depends on most."""
    found = table.map()
    if found is None:
        return []
    keys, ends, share = found
    x, y = (named(result, key) for key in keys)
    figure, axes = plt.subplots(figsize=(6.4, 4.8), layout="constrained")
    mesh = axes.pcolormesh(x.factor * ends[0], y.factor * ends[1], share, vmin=0, vmax=1, cmap="viridis")
    for (i, j), p in np.ndenumerate(share):
        if np.isfinite(p):
            at, up = x.factor * (ends[0][j] + ends[0][j + 1]) / 2, y.factor * (ends[1][i] + ends[1][i + 1]) / 2
            axes.text(at, up, f"{p:.2f}", ha="center", va="center", fontsize=7, color="black" if p > 0.6 else "white")
    axes.set_xlabel(textwrap.fill(x.axis, 60))
    axes.set_ylabel(textwrap.fill(y.axis, 44))
    figure.colorbar(mesh, label="probability of squeal")
    axes.set_title(f"{heading(result)}probability of squeal where two inputs are known")
    return canvas.save(figure, "uncertainty-map")


def levels(result: Result, canvas: Canvas) -> list[Path]:
    """Share of the followed samples that are louder than a level."""
    if not Loudness.present(result):
        return []
    known = Loudness.from_result(result).sorted_levels
    loud = known[np.isfinite(known)]
    if not len(loud):
        return []
    figure, axes = plt.subplots(figsize=(7.2, 4.2), layout="constrained")
    share = np.arange(len(loud), -1, -1) / len(known)
    margin = max(0.05 * float(np.ptp(loud)), 1.0)
    axes.step([loud[0] - margin, *loud], share, where="post", color=RED, linewidth=2)
    axes.plot(loud, share[1:], ".", color=RED, markersize=5)
    axes.set_xlim(loud[0] - margin, loud[-1] + margin)
    axes.set_ylim(0, 1)
    axes.set_xlabel("A-weighted sound power level of the louder body / dB re 1 pW")
    axes.set_ylabel("share of the samples that are louder")
    axes.set_title(f"{heading(result)}level of the limit cycles of {len(known)} samples")
    return canvas.save(figure, "uncertainty-levels")
