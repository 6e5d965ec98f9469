"""Transients: growth with the predicted envelope, limit cycle, force–creep loops, spectrogram, stick and slip over a
cycle, sound power."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator

from .. import growth as growing
from ..labels import body_words
from ..result import Floats, Result
from ..tables import History
from .contact import edges
from .style import BLUE, LATERAL, ORANGE, RED, SLIP, STICK, Canvas, heading, legend

STATES = ListedColormap(["#eeeeee", STICK, SLIP])
# Phases shown of a cycle; with fewer samples in a period a picture says so.
PHASES = 8


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    if not History.present(result):
        return []
    history = History.from_result(result)
    moving = growing.signal(history)
    span = growing.period(moving)
    made = growth(result, history, moving, span, canvas)
    if history.points:
        made += spectrogram(result, moving, canvas)
    if "transient/contact_state" in result and len(result["transient/contact_time"]) > PHASES:
        # Contact points of bodies given by matrices stand alone, not on a grid.
        if grid_shape(result):
            made += cycle(result, span, canvas)
        if "transient/grid/weight" in result:
            made += loops(result, span, canvas)
    if "transient/sound_power/band_name" in result:
        made += sound_power(result, canvas)
    return made


def shown(moving: growing.Signal) -> tuple[float, str]:
    """Factor and name for an axis."""
    return (1e3, f"{moving.name} / (mm/s)") if moving.unit == "m/s" else (1.0, f"{moving.name} / {moving.unit}")


def growth(result: Result, history: History, moving: growing.Signal, span: float, canvas: Canvas) -> list[Path]:
    """The motion, its envelope beside the linear analysis, and what sticks."""
    t, (factor, name) = history.time, shown(moving)
    figure, (whole, log, sticking) = plt.subplots(
        3, 1, figsize=(8, 8.4), sharex=True, height_ratios=[2, 2, 1], layout="constrained"
    )
    # Hundreds of thousands of points are dots in PDF and SVG too.
    whole.plot(t, factor * moving.value, color=BLUE, linewidth=0.3, rasterized=True)
    whole.set_ylabel(name.replace(" of ", "\nof ", 1))
    whole.set_title(heading(result) + ("the run was stopped: as far as it came" if result.stopped else "growth"))
    middle, peak = growing.envelope(moving, 2 * span)
    log.semilogy(middle, factor * peak, color=BLUE, label="largest in two periods")
    phase = growing.exponential(middle, peak)
    if phase:
        inside = (middle >= phase.begin) & (middle <= phase.end)
        fitted = factor * phase.line(middle[inside], phase.rate)
        log.semilogy(
            middle[inside],
            fitted,
            color=ORANGE,
            linewidth=3,
            alpha=0.6,
            label=f"exponential growth, fitted: {phase.rate:.3f} 1/s",
        )
        rate = growing.linear(result, growing.frequency(moving, phase.begin, phase.end))
        if rate is not None:
            # Through the middle of the fitted growth: the start is not exactly one mode, and the limit cycle is none.
            line = phase.line(middle, rate)
            seen = (line < 1.5 * peak.max()) & (line > 0.5 * peak[peak > 0].min())
            log.semilogy(
                middle[seen], factor * line[seen], color=RED, linestyle="--", label=f"linear analysis: {rate:.3f} 1/s"
            )
    log.set_ylabel(f"its envelope / {name.partition(' / ')[2]}")
    # Powers of ten alone would leave an axis of less than a decade without numbers.
    for set_formatter in (log.yaxis.set_major_formatter, log.yaxis.set_minor_formatter):
        set_formatter("{x:g}")
    log.yaxis.set_minor_locator(LogLocator(subs=(2, 5)))
    sticking.plot(t, history.stick_share, color=STICK, linewidth=0.3, rasterized=True)
    sticking.set_ylabel("share of nodes\nin stick")
    sticking.set_xlabel("time / s")
    legend(figure, [log])
    return canvas.save(figure, "growth")


def spectrogram(result: Result, moving: growing.Signal, canvas: Canvas) -> list[Path]:
    """Spectrogram, and the spectrum of the last quarter."""
    v, (factor, name) = moving.value, shown(moving)
    v = factor * v
    figure, (map_axis, line) = plt.subplots(1, 2, figsize=(10, 4), width_ratios=[2, 1], layout="constrained")
    figure.suptitle(heading(result) + name, fontsize=10)
    size = min(len(v), 1 << int(np.log2(max(len(v) / 16, 64))))
    # A start at rest has no power at all, of which there is no logarithm.
    with np.errstate(divide="ignore"):
        *_, image = map_axis.specgram(v, NFFT=size, Fs=1 / moving.step, noverlap=size // 2, scale="dB")
    highest = image.get_clim()[1] or 0.0
    image.set_clim(highest - 120, highest)
    map_axis.set_ylim(0, min(5000, 0.5 / moving.step))
    map_axis.set_xlabel("time / s")
    map_axis.set_ylabel("frequency / Hz")
    figure.colorbar(image, label="power density / dB")
    part = v[-len(v) // 4 :]
    window = np.hanning(len(part))
    amplitude = 2 * np.abs(np.fft.rfft((part - part.mean()) * window)) / window.sum()
    line.semilogx(np.maximum(amplitude, 1e-12), np.fft.rfftfreq(len(part), moving.step), color=BLUE, linewidth=0.6)
    if amplitude.any():
        line.set_xlim(amplitude.max() * 1e-5, amplitude.max() * 2)
    line.set_ylim(0, min(5000, 0.5 / moving.step))
    line.set_xlabel(f"amplitude, last quarter / {name.partition(' / ')[2]}")
    return canvas.save(figure, "spectrogram")


def coarse(when: Floats, span: float, step: float) -> str:
    """Remark where the contact fields are too far apart to show a period; else empty."""
    interval = float(when[1] - when[0])
    each = span / interval
    if each >= PHASES * (1 - 1e-6):
        return ""
    stride = max(1, int(span / (PHASES * step)))
    return (
        f"\ncontact fields every {1e3 * interval:.3g} ms are {each:.1f} in a period: too coarse; "
        f"contact_stride of at most {stride} shows {PHASES}"
    )


def grid_shape(result: Result) -> tuple[int, int] | None:
    """Numbers of lines along x and y, or None where the contact is no grid of at least two by two."""
    if "transient/grid/x" not in result:
        return None
    x, y = result.array("transient/grid/x"), result.array("transient/grid/y")
    nx, ny = len(np.unique(x)), len(np.unique(y))
    return (nx, ny) if nx > 1 and ny > 1 and nx * ny == len(x) else None


def cycle(result: Result, span: float, canvas: Canvas) -> list[Path]:
    """Stick and slip over the last period."""
    when, time = result.array("transient/contact_time"), result.array("transient/time")
    x, y = (1e3 * np.unique(result.array(f"transient/grid/{c}")) for c in "xy")
    # Evenly over the period, as far as the times that were written allow.
    wanted = when[-1] - span + span / PHASES * np.arange(PHASES)
    chosen = np.unique(np.abs(when[:, None] - wanted).argmin(axis=0))
    state = result["transient/contact_state"]
    figure, axes = plt.subplots(2, PHASES // 2, figsize=(10, 5.8), sharex=True, sharey=True, layout="constrained")
    for axis, k in zip(axes.flat, chosen):
        axis.pcolormesh(edges(x), edges(y), state[k].reshape(len(y), len(x)), cmap=STATES, vmin=-0.5, vmax=2.5)
        axis.set_title(f"{1e3 * (when[k] - when[chosen[0]]):.2f} ms")
        axis.set_aspect("equal")
    for axis in axes.flat[len(chosen) :]:
        axis.axis("off")
    said = f"stick and slip over the last period, {1e3 * span:.3f} ms; rolling towards −x"
    figure.suptitle(said + coarse(when, span, time[1] - time[0]), fontsize=11)
    for axis in axes[-1]:
        axis.set_xlabel("x / mm")
    for axis in axes[:, 0]:
        axis.set_ylabel("y / mm")
    names = (("open", "#eeeeee"), ("stick", STICK), ("slip", SLIP))
    legend(figure, [], [Patch(facecolor=colour, label=label) for label, colour in names])
    return canvas.save(figure, "cycle")


def loops(result: Result, span: float, canvas: Canvas) -> list[Path]:
    """Force over creep and over the normal force in the last periods."""
    when, time = result.array("transient/contact_time"), result.array("transient/time")
    late = when > when[-1] - 20 * span
    area = result.array("transient/grid/weight")
    pressure = result["transient/contact_pressure"][late] * area
    force = (result["transient/contact_traction"][late][:, :, 1] * area).sum(axis=1)
    normal = pressure.sum(axis=1)
    touching = normal > 0
    force, normal, pressure = force[touching], normal[touching], pressure[touching]
    creep = (result["transient/contact_creep"][late][touching][:, :, 1] * pressure).sum(axis=1) / normal
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4.2), layout="constrained")
    left.plot(1e3 * creep, force / 1e3, ".", color=LATERAL, markersize=2)
    left.set_xlabel("lateral creep, mean weighted by pressure / (mm/s)")
    left.set_ylabel("lateral force on body 1 / kN")
    right.plot(normal / 1e3, force / normal, ".", color=LATERAL, markersize=2)
    right.set_xlabel("normal force / kN")
    right.set_ylabel("lateral over normal force")
    figure.suptitle("the last 20 periods" + coarse(when, span, time[1] - time[0]), fontsize=11)
    return canvas.save(figure, "loops")


def sound_power(result: Result, canvas: Canvas) -> list[Path]:
    """Sound power in third octaves, and its density."""
    group = "transient/sound_power"
    names = result.array(f"{group}/band_name")
    bodies = [b for b in ("lower", "upper") if f"{group}/{b}" in result]
    figure, axes = plt.subplots(
        2, len(bodies), figsize=(5.2 * len(bodies), 6.6), squeeze=False, sharey="row", layout="constrained"
    )
    labels = [f"{n / 1000:g}k" if n >= 1000 else f"{n:g}" for n in names]
    top = max(result.array(f"{group}/{b}/{kind}").max() for b in bodies for kind in ("level", "level_a"))
    density = {b: result.array(f"{group}/{b}/density") for b in bodies}
    peak = max(d.max() for d in density.values())
    for (bars, line), body in zip(axes.T, bodies):
        linear, weighted = (result.array(f"{group}/{body}/{kind}") for kind in ("level", "level_a"))
        total, total_a = (result.number(f"{group}/{body}/{kind}") for kind in ("total_level", "total_level_a"))
        place = np.arange(len(names))
        # Bands far below the loudest, or silent ones, end at the axis.
        floor = top - 80
        for offset, levels, colour, label in (
            (-0.2, linear, BLUE, f"linear, in all {total:.1f} dB"),
            (0.2, weighted, ORANGE, f"A-weighted, in all {total_a:.1f} dB(A)"),
        ):
            bars.bar(place + offset, np.maximum(levels, floor) - floor, 0.4, bottom=floor, color=colour, label=label)
        bars.set_xticks(place, labels, rotation=60)
        bars.set_ylim(floor, top + 3)
        bars.set_xlabel("third octave / Hz")
        bars.set_title(f"sound power of the {body_words(result.job)[body]}")
        bars.legend(loc="upper center", bbox_to_anchor=(0.5, -0.35), ncols=2)
        line.semilogy(
            result.array(f"{group}/frequency"), np.maximum(density[body], peak * 1e-12), color=BLUE, linewidth=0.7
        )
        line.set_xlabel("frequency / Hz")
    axes[0, 0].set_ylabel("level / dB re 1 pW")
    axes[1, 0].set_ylabel("power density / (W/Hz)")
    return canvas.save(figure, "sound-power")
