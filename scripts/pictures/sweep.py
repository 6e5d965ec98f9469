"""Sweeps: stability map over two keys, loci of frequency and growth rate over one."""

import matplotlib.pyplot as plt
import numpy as np
from contact import edges
from matplotlib.colors import TwoSlopeNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from results import ResultsError, lookup
from style import BLUE, GREY, RED, save

NAMES = {
    "contact.friction": ("coefficient of friction μ", 1),
    "contact.normal_load": ("normal load N / kN", 1e-3),
    "contact.approach": ("approach δ / µm", 1e6),
    "contact.speed": ("rolling speed V / (m/s)", 1),
    "contact.creepage.longitudinal": ("longitudinal creepage ξ / %", 100),
    "contact.creepage.lateral": ("lateral creepage η / %", 100),
    "contact.creepage.spin": ("spin φ / (1/m)", 1),
    "bodies.lower.mesh.cylinder.contact_offset": ("contact offset of the lower body / mm", 1e3),
    "bodies.upper.mesh.cylinder.contact_offset": ("contact offset of the upper body / mm", 1e3),
}


class Key:
    """A swept key: its name on an axis, its value at each point, and the ticks where the values are words."""

    def __init__(self, results, key):
        self.key = key
        name = f"sweep/values/{key}"
        values = results[name]
        unit = results.file[name].attrs["units"]
        plain = key if unit in ("1", "-") else f"{key} / {unit}"
        self.label, factor = NAMES.get(key, (plain, 1))
        self.words = None
        if values.dtype.kind == "f":
            self.values = factor * values
        else:
            words = [v.decode() if isinstance(v, bytes) else str(v) for v in values]
            self.words = list(dict.fromkeys(words))
            self.values = np.array([self.words.index(w) for w in words], float)
            self.label = key

    def label_axis(self, axis):
        axis.set_label_text(self.label)
        if self.words:
            axis.set_ticks(range(len(self.words)), [w if len(w) < 25 else w[:24] + "…" for w in self.words])


def pictures(results, out):
    if "sweep/keys" not in results:
        return []
    keys = [k.decode() if isinstance(k, bytes) else str(k) for k in results["sweep/keys"]]
    shape = [int(n) for n in results["sweep/shape"]]
    moving = [i for i, n in enumerate(shape) if n > 1]
    if len(shape) == len(keys) and len(moving) == 2 and all(n == 1 for i, n in enumerate(shape) if i not in moving):
        return [stability_map(results, [Key(results, keys[i]) for i in moving], out)]
    if len(moving) == 1 or len(results["sweep/status"]) == 1:
        first = moving[0] if moving and len(shape) == len(keys) else 0
        return [loci(results, Key(results, keys[first]), out)]
    # More than two keys: a map for each pair would hide the others.
    return []


def heading(results):
    title = lookup(results.job, "title")
    return f"{title}\n" if title else ""


def stability_map(results, keys, out):
    """Largest growth rate over two keys; failed points are hatched, those that stick in part are dotted."""
    horizontal, vertical = keys
    x, y = (np.unique(k.values) for k in keys)
    growth = np.full((len(y), len(x)), np.nan)
    failed, sticks = np.zeros(growth.shape, bool), np.zeros(growth.shape, bool)
    points = (horizontal.values, vertical.values)
    for a, b, rate, status, sticking in zip(
        *points, results["sweep/growth_rate"], results["sweep/status"], results["sweep/sticking"], strict=True
    ):
        at = np.searchsorted(y, b), np.searchsorted(x, a)
        growth[at], failed[at], sticks[at] = rate, status != 0, sticking > 0
    figure, axes = plt.subplots(figsize=(6.8, 5.0), constrained_layout=True)
    reach = max(np.nanmax(np.abs(growth)), 1e-12) if np.isfinite(growth).any() else 1.0
    limit = max(np.nanmax(growth), 0.05 * reach) if np.isfinite(growth).any() else 1.0
    image = axes.pcolormesh(
        edges(x), edges(y), growth, cmap="RdBu_r", norm=TwoSlopeNorm(0, vmin=-limit, vmax=limit)
    )
    figure.colorbar(image, ax=axes, label="largest growth rate σ / (1/s)", extend="min")
    border(axes, edges(x), edges(y), growth > 0, failed)
    handles = [Line2D([], [], color="black", label="between stable and unstable points")]
    across, up = edges(x), edges(y)
    for marked, face, hatch, label in ((sticks, "none", "..", "part of the contact sticks"), (failed, "white", "///", "failed")):
        for j, i in np.argwhere(marked):
            corner, size = (across[i], up[j]), (across[i + 1] - across[i], up[j + 1] - up[j])
            axes.add_patch(Rectangle(corner, *size, facecolor=face, edgecolor=GREY, hatch=hatch, linewidth=0))
        if marked.any():
            handles.append(Patch(facecolor=face, edgecolor=GREY, hatch=hatch, label=label))
    frequency = results["sweep/frequency"]
    if growth.size <= 150:  # the frequency of the fastest growing mode, where there is room for it
        for a, b, rate, f in zip(
            horizontal.values, vertical.values, results["sweep/growth_rate"], frequency, strict=True
        ):
            if rate > 0:
                color = "white" if rate > 0.6 * limit else "black"
                axes.annotate(f"{f:.0f}", (a, b), ha="center", va="center", fontsize=7, color=color)
        handles.append(Line2D([], [], linestyle="none", label="numbers: frequency / Hz of the fastest growth"))
    horizontal.label_axis(axes.xaxis)
    vertical.label_axis(axes.yaxis)
    axes.set_title(heading(results) + "stability")
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2)
    return save(figure, out / f"{results.stem}-sweep-map.png")


def border(axes, x, y, unstable, failed):
    """Lines between unstable points and stable neighbours."""
    for j in range(unstable.shape[0]):
        for i in range(unstable.shape[1]):
            for dj, di, line in ((0, 1, ([x[i + 1]] * 2, y[j : j + 2])), (1, 0, (x[i : i + 2], [y[j + 1]] * 2))):
                if j + dj == unstable.shape[0] or i + di == unstable.shape[1]:
                    continue
                here, there = (j, i), (j + dj, i + di)
                if unstable[here] != unstable[there] and not (failed[here] or failed[there]):
                    axes.plot(*line, color="black", linewidth=1.6)


def tracked(spectra):
    """Branches through the spectra of the points, `[branch][point]`, NaN where one has no continuation: each eigenvalue goes
    on to the nearest one of the next point, measured in frequency and growth rate alike."""
    branches, ends = [], []
    for point, spectrum in enumerate(spectra):
        free = list(range(len(spectrum)))
        pairs = sorted(
            ((abs(spectrum[j] - branches[b][point - 1]), b, j) for b in ends for j in free), key=lambda p: p[0]
        )
        taken, used = set(), set()
        for distance, b, j in pairs:
            # Further than 5 % of itself it is another mode.
            if b in taken or j in used or distance > 0.05 * abs(spectrum[j]):
                continue
            branches[b][point] = spectrum[j]
            taken.add(b)
            used.add(j)
        for j in free:
            if j not in used:
                branch = np.full(len(spectra), np.nan, complex)
                branch[point] = spectrum[j]
                branches.append(branch)
                taken.add(len(branches) - 1)
        ends = list(taken)
    return branches


def loci(results, key, out):
    """Frequency and growth rate of every mode over one key; unstable parts in red."""
    order = np.argsort(key.values, kind="stable")
    offset, eigenvalue = results["sweep/offset"], results["sweep/eigenvalue"]
    if eigenvalue.size == 0:
        raise ResultsError(f"{results.path}: every point of the sweep failed, so there are no loci to draw")
    spectra = [eigenvalue[offset[i] : offset[i + 1]] for i in order]
    # Relaxation of the contact itself is far more damped than any mode of the bodies.
    spectra = [s[(s.imag > 0) & (s.real > -0.1 * np.abs(s))] for s in spectra]
    values = key.values[order]
    branches = tracked(spectra)
    figure, (upper, lower) = plt.subplots(2, 1, sharex=True, figsize=(7.2, 7.6), constrained_layout=True)
    top = max((b.real[np.isfinite(b.real)].max() for b in branches), default=0)
    for branch in sorted(branches, key=lambda b: np.nanmax(b.real)):
        unstable = np.nanmax(branch.real) > 0
        color, width = (RED, 1.6) if unstable else (BLUE, 0.7)
        grows = branch.real > 0
        for axes, value in ((upper, branch.imag / (2 * np.pi)), (lower, branch.real)):
            axes.plot(values, value, color=color if axes is lower else BLUE, linewidth=width, alpha=1 if unstable else 0.6)
            axes.plot(values[grows], value[grows], "o", color=RED, markersize=3.5)
        if unstable:
            at = np.nanargmax(branch.real)
            text = f"{branch[at].imag / (2 * np.pi):.0f} Hz"
            lower.annotate(text, (values[at], branch[at].real), xytext=(3, 3), textcoords="offset points", fontsize=8)
    failed = values[results["sweep/status"][order] != 0]
    for axes in (upper, lower):
        for value in failed:
            axes.axvline(value, color=GREY, linestyle=":", linewidth=1)
    upper.set_ylabel("frequency f / Hz")
    lower.set_ylabel("growth rate σ / (1/s)")
    lower.axhline(0, color="black", linewidth=0.8)
    # The modes that matter are those near the limit.
    near = max(top, 0.0)
    lower.set_ylim(-3 * max(near, 2.0), 1.25 * max(near, 1.0))
    key.label_axis(lower.xaxis)
    upper.set_title(heading(results) + "modes of steady sliding")
    handles = [
        Line2D([], [], color=BLUE, label="mode"),
        Line2D([], [], color=RED, marker="o", markersize=3.5, label="unstable"),
    ]
    if len(failed):
        handles.append(Line2D([], [], color=GREY, linestyle=":", label="failed point"))
    lower.legend(handles=handles, loc="lower left")
    return save(figure, out / f"{results.stem}-sweep-loci.png")
