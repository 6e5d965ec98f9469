"""Sweeps: stability map over two keys, loci of frequency and growth rate over one; over more keys see `slices`."""

from pathlib import Path
from textwrap import wrap
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import TwoSlopeNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from ..errors import ResultError
from ..labels import body_words, number, quantity, words
from ..result import Complexes, Floats, Integers, Result
from ..tables import Sweep, growing
from .style import BLUE, GREY, RED, Canvas, heading, legend

# Part of the way between two values that a cell of a map takes up where they are not evenly spaced.
CELL = 0.86


class Key:
    """A swept key: its name on an axis, its value at each point, and where on the axis of a map each value stands."""

    def __init__(self, result: Result, sweep: Sweep, key: str) -> None:
        self.key = key
        self.quantity = quantity(key, result.units(f"sweep/values/{key}"), body_words(result.job))
        self.label = self.quantity.axis
        given = sweep.values[key]
        self.words: list[str] = []
        if given.dtype.kind == "f":
            self.values: Floats = self.quantity.factor * given
        else:
            self.words = list(dict.fromkeys(given))
            self.values = np.array([self.words.index(w) for w in given], float)
            self.label = f"{self.quantity.name} {self.quantity.symbol}".strip()
        self.levels: Floats = np.unique(self.values)
        gaps = np.diff(self.levels)
        self.even = len(gaps) == 0 or bool(np.ptp(gaps) <= 1e-6 * gaps.max())

    def tick(self, level: float) -> str:
        """Label of a value."""
        if not self.words:
            return number(level)
        text = words(self.words[int(level)])
        return "\n".join(wrap(text, 20)[:4]) if len(text) > 20 else text

    def statement(self, level: float) -> str:
        """Name and value with unit, as the title of a map."""
        if self.words:
            return f"{self.quantity.name}: {words(self.words[int(level)])}"
        name = f"{self.quantity.name} {self.quantity.symbol}".strip()
        return f"{name} = {number(level)} {self.quantity.unit}".rstrip()

    def label_axis(self, axis: Axis) -> None:
        """Axis of a picture to scale."""
        axis.set_label_text(self.label)
        if self.words:
            axis.set_ticks(range(len(self.words)), [self.tick(k) for k in range(len(self.words))])

    def cells(self) -> tuple[Floats, float]:
        """Centres of the cells of a map along this key, and their width: to scale where the values are evenly spaced,
        else one beside the other.

        A cell as wide as the way to the next value would show what was never computed.
        """
        if self.even:
            return self.levels, float(np.diff(self.levels)[0]) if len(self.levels) > 1 else 1.0
        return np.arange(len(self.levels), dtype=float), CELL

    def label_map(self, axis: Axis) -> None:
        """Axis of a map."""
        if self.even:
            self.label_axis(axis)
        else:
            axis.set_label_text(f"{self.label}, not to scale")
            axis.set_ticks(range(len(self.levels)), [self.tick(v) for v in self.levels])


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    if not Sweep.present(result):
        return []
    sweep = Sweep.from_result(result)
    moving = sweep.moving
    if len(moving) == 2:
        return stability_map(result, sweep, [Key(result, sweep, sweep.keys[i]) for i in moving], canvas)
    if len(moving) == 1 or len(sweep.shape) != len(sweep.keys) or len(sweep.status) == 1:
        return loci(result, sweep, Key(result, sweep, sweep.keys[moving[0] if moving else 0]), canvas)
    # More keys than a map has axes: see `slices`, but for words of a third one, of which each has a map.
    keys = [Key(result, sweep, sweep.keys[i]) for i in moving]
    panels = [key for key in keys if key.words]
    if len(keys) == 3 and len(panels) == 1:
        return stability_map(result, sweep, [key for key in keys if not key.words], canvas, panels[0])
    return []


def growth_colours(sweep: Sweep) -> ScalarMappable:
    """Colours of growth rates: blue is stable, red grows, white is between; the scale reaches to the largest one."""
    known = sweep.growth_rate[np.isfinite(sweep.growth_rate)]
    reach = float(np.abs(known).max()) if known.size else 1.0
    limit = max(float(known.max()) if known.size else 1.0, 0.05 * reach, 1e-12)
    return ScalarMappable(TwoSlopeNorm(0, vmin=-limit, vmax=limit), "RdBu_r")


def stability_map(result: Result, sweep: Sweep, keys: list[Key], canvas: Canvas, by: Key | None = None) -> list[Path]:
    """Largest growth rate over two keys, one map for each word of a third one, if there is one."""
    count = len(by.words) if by else 1
    columns = min(count, 2)
    rows = -(-count // columns)
    size = (6.8, 5.6) if count == 1 else (4.9 * columns + 1, 4.1 * rows)
    share: dict[str, Any] = {"sharex": True, "sharey": True, "squeeze": False}
    figure, grid = plt.subplots(rows, columns, figsize=size, layout="constrained", **share)
    colours = growth_colours(sweep)
    handles: dict[str, Any] = {"border": Line2D([], [], color="black", label="between stable and unstable points")}
    for place, axes in enumerate(grid.flat):
        if place >= count:
            axes.axis("off")
            continue
        points = np.arange(len(sweep.status)) if by is None else np.flatnonzero(by.values == place)
        handles |= one_map(axes, sweep, keys, points, colours)
        if by:
            axes.set_title(by.tick(place))
        if place + columns >= count:  # nothing below
            keys[0].label_map(axes.xaxis)
            axes.tick_params(labelbottom=True)
    figure.colorbar(colours, ax=list(grid.flat), label="largest growth rate σ / (1/s)", extend="min")
    for axes in grid[:, 0]:
        keys[1].label_map(axes.yaxis)
    title = heading(result) + "stability"
    if by:
        figure.suptitle(f"{title}, one map for each {by.label}", fontsize=10)
    else:
        grid[0, 0].set_title(title)
    legend(figure, [], list(handles.values()), columns=2)
    return canvas.save(figure, "sweep-map")


def one_map(axes: Axes, sweep: Sweep, keys: list[Key], points: Integers, colours: ScalarMappable) -> dict[str, Any]:
    """Map of some points: failed ones are hatched, those that stick in part are dotted; entries of the legend."""
    across, up = keys
    (x, width), (y, height) = across.cells(), up.cells()
    at = tuple(np.searchsorted(key.levels, key.values[points]) for key in (up, across))
    growth, frequency = np.full((len(y), len(x)), np.nan), np.full((len(y), len(x)), np.nan)
    failed, sticks = np.zeros(growth.shape, bool), np.zeros(growth.shape, bool)
    growth[at], frequency[at] = sweep.growth_rate[points], sweep.frequency[points]
    failed[at], sticks[at] = sweep.status[points] != 0, sweep.sticking[points] > 0
    handles: dict[str, Any] = {}
    _, limit = colours.get_clim()
    for j, i in np.ndindex(*growth.shape):
        corner = (float(x[i]) - width / 2, float(y[j]) - height / 2)
        if failed[j, i]:
            axes.add_patch(
                Rectangle(corner, width, height, facecolor="white", edgecolor=GREY, hatch="///", linewidth=0)
            )
        elif np.isfinite(growth[j, i]):
            axes.add_patch(Rectangle(corner, width, height, facecolor=colours.to_rgba(growth[j, i]), linewidth=0))
            if sticks[j, i]:
                axes.add_patch(
                    Rectangle(corner, width, height, facecolor="none", edgecolor=GREY, hatch="..", linewidth=0)
                )
    for marked, hatch, label in ((sticks & ~failed, "..", "part of the contact sticks"), (failed, "///", "failed")):
        if marked.any():
            handles[label] = Patch(facecolor="white", edgecolor=GREY, hatch=hatch, label=label)
    border(axes, x, y, growth > 0, np.isfinite(growth))
    if growth.size <= 150:  # the frequency of the fastest growing mode, where there is room for it
        for j, i in np.argwhere(growth > 0):
            color = "white" if growth[j, i] > 0.6 * (limit or 1.0) else "black"
            axes.annotate(f"{frequency[j, i]:.0f}", (x[i], y[j]), ha="center", va="center", fontsize=7, color=color)
        handles["numbers"] = Line2D([], [], linestyle="none", label="numbers: frequency / Hz of the fastest growth")
    axes.set_xlim(x[0] - width / 2, x[-1] + width / 2)
    axes.set_ylim(y[0] - height / 2, y[-1] + height / 2)
    return handles


def border(axes: Axes, x: Floats, y: Floats, unstable: NDArray[np.bool_], known: NDArray[np.bool_]) -> None:
    """Lines between unstable points and stable neighbours, midway between the cells."""
    across, up = (
        np.concatenate([[v[0] - 0.5 * d[0]], 0.5 * (v[1:] + v[:-1]), [v[-1] + 0.5 * d[-1]]])
        for v, d in ((x, np.diff(x)), (y, np.diff(y)))
    )
    for j, i in np.argwhere(known):
        for dj, di, line in (
            (0, 1, ([across[i + 1]] * 2, up[j : j + 2])),
            (1, 0, (across[i : i + 2], [up[j + 1]] * 2)),
        ):
            there = (j + dj, i + di)
            if there[0] < len(y) and there[1] < len(x) and known[there] and unstable[j, i] != unstable[there]:
                axes.plot(*line, color="black", linewidth=1.6)


def tracked(spectra: list[Complexes]) -> list[Complexes]:
    """Branches through the spectra of the points, `[branch][point]`, NaN where one has no continuation: each eigenvalue
    goes on to the nearest one of the next point, measured in frequency and growth rate alike."""
    branches: list[Complexes] = []
    ends: list[int] = []
    for point, spectrum in enumerate(spectra):
        free = list(range(len(spectrum)))
        pairs = sorted(
            ((abs(spectrum[j] - branches[b][point - 1]), b, j) for b in ends for j in free), key=lambda p: float(p[0])
        )
        taken: set[int] = set()
        used: set[int] = set()
        for distance, b, j in pairs:
            # Further than 5 % of itself it is another mode.
            if b in taken or j in used or distance > 0.05 * abs(spectrum[j]):
                continue
            branches[b][point] = spectrum[j]
            taken.add(b)
            used.add(j)
        for j in free:
            if j not in used:
                branch = np.full(len(spectra), complex(np.nan, np.nan))
                branch[point] = spectrum[j]
                branches.append(branch)
                taken.add(len(branches) - 1)
        ends = list(taken)
    return branches


def alone(spectra: list[Complexes]) -> list[Complexes]:
    """Branches of one point each: nothing leads from one word to the next."""
    made = []
    for point, spectrum in enumerate(spectra):
        for value in spectrum:
            branch = np.full(len(spectra), complex(np.nan, np.nan))
            branch[point] = value
            made.append(branch)
    return made


def spread(wanted: Floats, least: float) -> Floats:
    """Heights as near as can be to the wanted ones, at least this far apart: each cluster about its mean, by merging
    neighbours that meet."""
    order = np.argsort(wanted, kind="stable")
    groups: list[list[int]] = []
    for k in order:
        groups.append([int(k)])
        while len(groups) > 1:
            below, above = groups[-2], groups[-1]
            centres = [float(np.mean(wanted[g])) for g in (below, above)]
            if centres[1] - centres[0] >= 0.5 * least * (len(below) + len(above)):
                break
            groups[-2:] = [below + above]
    placed = np.empty(len(wanted))
    for group in groups:
        placed[group] = np.mean(wanted[group]) + least * (np.arange(len(group)) - 0.5 * (len(group) - 1))
    return placed


def loci(result: Result, sweep: Sweep, key: Key, canvas: Canvas) -> list[Path]:
    """Frequency and growth rate of every mode over one key; unstable parts in red. Words have no lines between them."""
    order = np.argsort(key.values, kind="stable")
    if sweep.eigenvalue.size == 0:
        raise ResultError(
            f"{result.path}: every point of the sweep failed, so there are no loci to draw; /sweep/message says why"
        )
    spectra = [sweep.spectrum(int(i)) for i in order]
    # Relaxation of the contact itself is far more damped than any mode of the bodies.
    spectra = [s[(s.imag > 0) & (s.real > -0.1 * np.abs(s))] for s in spectra]
    values = key.values[order]
    branches = alone(spectra) if key.words else tracked(spectra)
    figure, (upper, lower) = plt.subplots(2, 1, sharex=True, figsize=(7.2, 8.0), layout="constrained")
    top = max((float(b.real[np.isfinite(b.real)].max()) for b in branches), default=0.0)
    # The modes that matter are those near the limit.
    lower.set_ylim(-3 * max(top, 2.0), 1.25 * max(top, 1.0))
    names = []
    for branch in sorted(branches, key=lambda b: float(np.nanmax(b.real))):
        grows = growing(branch)
        unstable = bool(grows.any())
        color, width = (RED, 1.6) if unstable else (BLUE, 0.7)
        for axes, value in ((upper, branch.imag / (2 * np.pi)), (lower, branch.real)):
            look: dict[str, Any] = {"marker": "o" if key.words else "none", "markersize": 3}
            look |= {"color": color if axes is lower else BLUE, "linewidth": width, "alpha": 1 if unstable else 0.6}
            axes.plot(values, value, **look)
            axes.plot(values[grows], value[grows], "o", color=RED, markersize=3.5)
        if unstable and key.words:
            at = np.flatnonzero(grows)[0]
            where = {"xytext": (5, 0), "textcoords": "offset points", "va": "center", "fontsize": 8}
            lower.annotate(f"{branch[at].imag / (2 * np.pi):.0f} Hz", (values[at], branch[at].real), **where)
        elif unstable:
            last = np.flatnonzero(np.isfinite(branch.real))[-1]
            at = np.nanargmax(np.where(grows, branch.real, np.nan))
            names.append((f"{branch[at].imag / (2 * np.pi):.0f} Hz", values[last], branch[last].real))
    if names:
        label_ends(lower, names)
    failed = values[sweep.status[order] != 0]
    for axes in (upper, lower):
        for value in failed:
            axes.axvline(value, color=GREY, linestyle=":", linewidth=1)
    upper.set_ylabel("frequency f / Hz")
    lower.set_ylabel("growth rate σ / (1/s)")
    lower.axhline(0, color="black", linewidth=0.8)
    key.label_axis(lower.xaxis)
    upper.set_title(
        heading(result)
        + "modes of steady sliding"
        + ("; at the right: frequency of the fastest growth" if names else "")
    )
    line: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.5} if key.words else {}
    dotted = line | {"marker": "o", "markersize": 3.5}
    handles = [Line2D([], [], color=BLUE, label="mode", **line), Line2D([], [], color=RED, label="unstable", **dotted)]
    if len(failed):
        handles.append(Line2D([], [], color=GREY, linestyle=":", label="failed point"))
    legend(figure, [], handles)
    return canvas.save(figure, "sweep-loci")


def label_ends(axes: Axes, names: list[tuple[str, float, float]]) -> None:
    """Names of curves at the right of the axes, each with a line to the end (x, y) of its own, none on another."""
    low, high = axes.get_ylim()
    ends = np.clip(np.array([y for *_, y in names]), low, high)
    heights = spread(ends, 0.045 * (high - low))
    heights += min(0.0, high - heights.max()) + max(0.0, low - heights.min())
    for (text, x, _), end, height in zip(names, ends, heights):
        axes.annotate(
            text,
            (x, end),
            xytext=(1.03, (height - low) / (high - low)),
            textcoords="axes fraction",
            va="center",
            fontsize=8,
            arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.6},
        )
