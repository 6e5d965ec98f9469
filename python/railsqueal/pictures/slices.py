"""Sweeps over three and more keys: maps over two of them for each combination of the others; parallel coordinates."""

from itertools import product
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from ..result import Floats, Result
from ..tables import Sweep
from .style import GREY, Canvas, heading, legend
from .sweep import Key, growth_colours, one_map

# Maps in one picture at most; of more combinations this many are drawn, evenly picked.
MAPS, COLUMNS = 24, 4
# Behind numbers at an axis that lines cross, and half of the height over which lines through one value are spread.
PAPER = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8}
SPREAD = 0.03


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    if not Sweep.present(result):
        return []
    sweep = Sweep.from_result(result)
    keys = [Key(result, sweep, key) for key in sweep.keys]
    keys = [key for key in keys if len(key.levels) > 1]
    if len(sweep.shape) != len(sweep.keys):
        # Lists that run side by side are no grid.
        return parallel(result, sweep, keys, canvas) if len(keys) > 1 else []
    if len(keys) < 3:
        return []
    mapped = len(keys) == 3 and sum(bool(key.words) for key in keys) == 1
    return ([] if mapped else slices(result, sweep, keys, canvas)) + parallel(result, sweep, keys, canvas)


def slices(result: Result, sweep: Sweep, keys: list[Key], canvas: Canvas) -> list[Path]:
    """Stability maps over the two keys with the most values, one for each combination of the other keys."""
    numbers = [key for key in keys if not key.words]
    order = sorted(numbers, key=lambda key: -len(key.levels)) + [key for key in keys if key.words]
    across, up = sorted(order[:2], key=keys.index)
    others = [key for key in keys if key not in (across, up)]
    combinations = list(product(*(key.levels for key in others)))
    chosen = combinations
    if len(combinations) > MAPS:
        chosen = [combinations[int(k)] for k in np.linspace(0, len(combinations) - 1, MAPS).round()]
    columns = min(
        COLUMNS, len(others[-1].levels) if len(combinations) == len(chosen) and len(others[-1].levels) > 1 else COLUMNS
    )
    rows = -(-len(chosen) // columns)
    share: dict[str, Any] = {"sharex": True, "sharey": True, "squeeze": False}
    figure, grid = plt.subplots(
        rows, columns, figsize=(3.1 * columns + 1.2, 2.9 * rows + 0.8), layout="constrained", **share
    )
    colours = growth_colours(sweep)
    handles: dict[str, Any] = {"border": Line2D([], [], color="black", label="between stable and unstable points")}
    for place, axes in enumerate(grid.flat):
        if place >= len(chosen):
            axes.axis("off")
            continue
        inside = np.ones(len(sweep.status), dtype=bool)
        for key, level in zip(others, chosen[place]):
            inside &= key.values == level
        handles |= one_map(axes, sweep, [across, up], np.flatnonzero(inside), colours)
        axes.set_title("\n".join(key.statement(level) for key, level in zip(others, chosen[place])), fontsize=8)
        if place + columns >= len(chosen):
            across.label_map(axes.xaxis)
            axes.tick_params(labelbottom=True)
        if place % columns == 0:
            up.label_map(axes.yaxis)
    figure.colorbar(colours, ax=list(grid.flat), label="largest growth rate σ / (1/s)", extend="min")
    shown = "" if len(chosen) == len(combinations) else f"; {len(chosen)} of {len(combinations)} combinations"
    figure.suptitle(heading(result) + f"stability, one map for each combination of the other keys{shown}", fontsize=10)
    legend(figure, [], list(handles.values()), columns=2)
    return canvas.save(figure, "sweep-slices")


def parallel(result: Result, sweep: Sweep, keys: list[Key], canvas: Canvas) -> list[Path]:
    """Each point as a line over the axes of all keys and of the growth rate, stable points behind the growing ones."""
    computed = np.flatnonzero(np.isfinite(sweep.growth_rate))
    if not len(computed):
        return []
    order = computed[np.argsort(sweep.growth_rate[computed], kind="stable")]
    growth = sweep.growth_rate[order]
    heights = [spread_lines(positions(key)[order]) for key in keys]
    low, high = min(float(growth.min()), 0.0), max(float(growth.max()), 0.0)
    heights.append((growth - low) / max(high - low, 1e-300))
    colours = growth_colours(sweep)
    places = np.arange(len(heights))
    figure, axes = plt.subplots(figsize=(2.3 * len(heights) + 1.5, 5.4), layout="constrained")
    lines = np.stack([np.broadcast_to(places, (len(order), len(places))), np.array(heights).T], axis=-1)
    grows = growth > 0
    drawn = LineCollection(
        list(lines), colors=colours.to_rgba(growth), linewidths=np.where(grows, 1.8, 0.8), alpha=0.85
    )
    axes.add_collection(drawn)
    axes.set_xlim(-0.2, len(heights) - 0.6)
    axes.set_ylim(-0.06, 1.06)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_yticks([])
    axes.set_xticks(places, [*(wrapped(key.label) for key in keys), "largest growth\nrate σ / (1/s)"], fontsize=9)
    axes.tick_params(axis="x", length=0)
    for place, key in enumerate(keys):
        axes.axvline(place, color=GREY, linewidth=0.8)
        for level, height in zip(key.levels, positions(key, key.levels)):
            axes.annotate(
                key.tick(level),
                (place, height),
                xytext=(-4, 0),
                textcoords="offset points",
                ha="right",
                va="center",
                fontsize=8,
                bbox=PAPER,
            )
    last = len(keys)
    axes.axvline(last, color=GREY, linewidth=0.8)
    for value in sorted({low, 0.0, high}):
        at = (value - low) / max(high - low, 1e-300)
        axes.annotate(
            f"{value:.3g}".replace("-", "−"),
            (last, at),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            bbox=PAPER,
        )
    figure.colorbar(colours, ax=axes, label="largest growth rate σ / (1/s)", extend="min")
    failed = int((sweep.status != 0).sum())
    missing = f"; {failed} failed points are left out" if failed else ""
    axes.set_title(
        heading(result)
        + f"{int(grows.sum())} of {len(order)} points grow; lines through one value are spread about it{missing}"
    )
    return canvas.save(figure, "sweep-parallel")


def positions(key: Key, values: Floats | None = None) -> Floats:
    """Heights between 0 and 1 of values of a key: to scale where they are evenly spaced, else one beside the other."""
    given = key.values if values is None else values
    levels = key.levels if key.even else np.arange(len(key.levels), dtype=float)
    at = levels[np.searchsorted(key.levels, given)]
    extent = float(levels[-1] - levels[0])
    return np.asarray((at - levels[0]) / extent if extent > 0 else np.full(len(given), 0.5))


def spread_lines(heights: Floats) -> Floats:
    """Heights of lines through common values, spread about each value in the order of the lines."""
    made = heights.copy()
    for height in np.unique(heights):
        same = np.flatnonzero(heights == height)
        if len(same) > 1:
            made[same] += np.linspace(-SPREAD, SPREAD, len(same))
    return np.asarray(made)


def wrapped(label: str, width: int = 18) -> str:
    """A title in lines that fit between two axes."""
    lines = [""]
    for word in label.split():
        if lines[-1] and len(lines[-1]) + len(word) + 1 > width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)
