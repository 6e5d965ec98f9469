"""Transients: growth with the predicted envelope, limit cycle, force–creep loops, spectrogram, stick and slip over a cycle, sound power."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from style import BLUE, GREY, ORANGE, RED, save

STATES = ListedColormap(["#eeeeee", BLUE, RED])


def pictures(results, out):
    if "transient/time" not in results:
        return []
    made = [growth(results, out)]
    if "transient/point_velocity" in results:
        made.append(spectrogram(results, out))
    if "transient/contact_state" in results and len(results["transient/contact_time"]) > 8:
        made += [cycle(results, out), loops(results, out)]
    if "transient/sound_power" in results:
        made.append(sound_power(results, out))
    return made


def signal(results):
    """The motion that is looked at: lateral velocity of the first point, or of the contact force; and its name."""
    if "transient/point_velocity" in results:
        name = results["transient/points/name"][0]
        name = name.decode() if isinstance(name, bytes) else str(name)
        v = results["transient/point_velocity"][:, 0]
        c = int(np.argmax(v.std(axis=0)))
        return 1e3 * v[:, c], f"velocity along {'xyz'[c]} of {name} / (mm/s)"
    force = results["transient/force"][:, 1]
    return force - force.mean(), "lateral force, less its mean / N"


def period(results):
    """Period of the cycle at the end, s."""
    t, (v, _) = results["transient/time"], signal(results)
    v = v[len(v) // 2 :] * np.hanning(len(v) - len(v) // 2)
    amplitude = np.abs(np.fft.rfft(v))
    amplitude[:3] = 0
    # The lowest strong line: stick and slip make harmonics that can be stronger at a point than the cycle itself.
    k = int(np.argmax(amplitude >= 0.2 * amplitude.max()))
    while k + 1 < len(amplitude) and amplitude[k + 1] > amplitude[k]:
        k += 1
    return 1 / np.fft.rfftfreq(len(v), t[1] - t[0])[k]


def growth(results, out):
    t, (v, name) = results["transient/time"], signal(results)
    figure, (whole, log, sticking) = plt.subplots(
        3, 1, figsize=(8, 8), sharex=True, height_ratios=[2, 2, 1], layout="constrained"
    )
    whole.plot(t, v, color=BLUE, linewidth=0.3)
    whole.set_ylabel(name.replace(" of ", "\nof ", 1))
    width = max(1, int(2 * period(results) / (t[1] - t[0])))
    blocks = len(v) // width
    peak = np.abs(v[: blocks * width]).reshape(blocks, width).max(axis=1)
    middle = t[: blocks * width].reshape(blocks, width).mean(axis=1)
    log.semilogy(middle, peak, color=BLUE, label="largest in two periods")
    if "stability/growth_rate" in results:
        rate = results["stability/growth_rate"].max()
        first = np.searchsorted(middle, 0.1 * t[-1])
        line = peak[first] * np.exp(rate * (middle - middle[first]))
        seen = line < 1.5 * peak.max()
        log.semilogy(middle[seen], line[seen], color=RED, linestyle="--", label=f"linear analysis, σ = {rate:.3f} 1/s")
    log.legend()
    log.set_ylabel("its envelope")
    sticking.plot(t, results["transient/stick"] / np.maximum(results["transient/closed"], 1), color=GREY, linewidth=0.3)
    sticking.set_ylabel("share of nodes\nin stick")
    sticking.set_xlabel("time / s")
    return save(figure, out / f"{results.stem}.growth.png")


def spectrogram(results, out):
    t, (v, name) = results["transient/time"], signal(results)
    dt = t[1] - t[0]
    figure, (map_axis, line) = plt.subplots(1, 2, figsize=(10, 4), width_ratios=[2, 1], layout="constrained")
    size = min(len(v), 1 << int(np.log2(max(len(v) / 16, 64))))
    power, f, when, image = map_axis.specgram(v, NFFT=size, Fs=1 / dt, noverlap=size // 2, scale="dB")
    image.set_clim(image.get_clim()[1] - 120, None)
    map_axis.set_ylim(0, 5000)
    map_axis.set_xlabel("time / s")
    map_axis.set_ylabel("frequency / Hz")
    figure.colorbar(image, label="power density / dB")
    part = v[-len(v) // 4 :]
    window = np.hanning(len(part))
    amplitude = 2 * np.abs(np.fft.rfft((part - part.mean()) * window)) / window.sum()
    line.semilogx(np.maximum(amplitude, 1e-12), np.fft.rfftfreq(len(part), dt), color=BLUE, linewidth=0.6)
    line.set_xlim(amplitude.max() * 1e-5, amplitude.max() * 2)
    line.set_ylim(0, 5000)
    line.set_xlabel(f"amplitude, last quarter\n{name}")
    return save(figure, out / f"{results.stem}.spectrogram.png")


def cycle(results, out):
    when = results["transient/contact_time"]
    x, y = (1e3 * results[f"transient/grid/{c}"] for c in "xy")
    shape = (len(np.unique(y)), len(np.unique(x)))
    span = period(results)
    last = when[-1] - span
    # Evenly over the period, as far as the times that were written allow.
    interval = when[1] - when[0]
    first, every = int(np.argmin(np.abs(when - last))), max(1, int(np.ceil(span / 8 / interval - 1e-6)))
    chosen = [k for k in range(first, len(when), every) if when[k] < last + span - 0.5 * interval][:8]
    state = results["transient/contact_state"]
    figure, axes = plt.subplots(2, 4, figsize=(10, 5.4), sharex=True, sharey=True, layout="constrained")
    for axis, k in zip(axes.flat, chosen):
        grid = (x.reshape(shape), y.reshape(shape))
        axis.pcolormesh(*grid, state[k].reshape(shape), cmap=STATES, vmin=0, vmax=2, shading="nearest")
        axis.set_title(f"{1e3 * (when[k] - when[chosen[0]]):.2f} ms")
        axis.set_aspect("equal")
    for axis in axes.flat[len(chosen) :]:
        axis.set_visible(False)
    figure.suptitle(f"stick (blue) and slip (orange) over the last period, {1e3 * span:.3f} ms; rolling towards −x")
    figure.supxlabel("x / mm")
    figure.supylabel("y / mm")
    return save(figure, out / f"{results.stem}.cycle.png")


def loops(results, out):
    when, span = results["transient/contact_time"], period(results)
    late = when > when[-1] - 20 * span
    area = results["transient/grid/weight"]
    pressure = results["transient/contact_pressure"][late] * area
    force = (results["transient/contact_traction"][late][:, :, 1] * area).sum(axis=1)
    normal = pressure.sum(axis=1)
    creep = (results["transient/contact_creep"][late][:, :, 1] * pressure).sum(axis=1) / normal
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    left.plot(1e3 * creep, force / 1e3, ".", color=BLUE, markersize=2)
    left.set_xlabel("lateral creep, mean weighted by pressure / (mm/s)")
    left.set_ylabel("lateral force on body 1 / kN")
    right.plot(normal / 1e3, force / normal, ".", color=BLUE, markersize=2)
    right.set_xlabel("normal force / kN")
    right.set_ylabel("lateral over normal force")
    figure.suptitle("the last 20 periods")
    return save(figure, out / f"{results.stem}.loops.png")


def sound_power(results, out):
    group = "transient/sound_power"
    names = results[f"{group}/band_name"]
    bodies = [b for b in ("lower", "upper") if f"{group}/{b}" in results]
    figure, axes = plt.subplots(
        2, len(bodies), figsize=(5.2 * len(bodies), 6), squeeze=False, sharey="row", layout="constrained"
    )
    labels = [f"{n / 1000:g}k" if n >= 1000 else f"{n:g}" for n in names]
    top = max(results[f"{group}/{b}/{kind}"].max() for b in bodies for kind in ("level", "level_a"))
    density = {b: results[f"{group}/{b}/density"] for b in bodies}
    peak = max(d.max() for d in density.values())
    for (bars, line), body in zip(axes.T, bodies):
        linear, weighted = (results[f"{group}/{body}/{kind}"] for kind in ("level", "level_a"))
        total, total_a = (results[f"{group}/{body}/{kind}"] for kind in ("total_level", "total_level_a"))
        place = np.arange(len(names))
        # Bands far below the loudest, or silent ones, end at the axis.
        floor = top - 80
        for offset, levels, colour, label in (
            (-0.2, linear, BLUE, f"linear, in all {total:.1f} dB"),
            (0.2, weighted, ORANGE, f"A-weighted, in all {total_a:.1f} dB(A)"),
        ):
            bars.bar(place + offset, np.maximum(levels, floor) - floor, 0.4, bottom=floor, color=colour, label=label)
        bars.set_xticks(place, labels, rotation=60)
        bars.set_ylim(floor, top + 24)
        bars.set_xlabel("third octave / Hz")
        bars.set_title(f"sound power of the {body} body")
        bars.legend(loc="upper left")
        line.semilogy(results[f"{group}/frequency"], np.maximum(density[body], peak * 1e-12), color=BLUE, linewidth=0.7)
        line.set_xlabel("frequency / Hz")
    axes[0, 0].set_ylabel("level / dB re 1 pW")
    axes[1, 0].set_ylabel("power density / (W/Hz)")
    return save(figure, out / f"{results.stem}.sound_power.png")
