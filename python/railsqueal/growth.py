"""Motion of a transient: its period, its envelope, and the time in which it grows exponentially."""

from dataclasses import dataclass

import numpy as np

from .result import Floats, Result, lookup
from .tables import ComplexModes, History

# Largest rms departure of the logarithm of the envelope from a line, the strictest first: other modes that grow as well
# make it wave.
STRAIGHT = (0.005, 0.01, 0.02, 0.04, 0.08)
# Least number of values on the line, and least factor by which it rises.
LEAST, RISE = 6, 2.0
# A mode of the linear analysis is that of the motion within this, relative to the frequency.
NEAR = 0.03


@dataclass(frozen=True)
class Signal:
    """A motion in time, [s], and what it is; m/s of a point, N of the force."""

    time: Floats
    value: Floats
    name: str
    unit: str

    @property
    def step(self) -> float:
        """s."""
        return float(self.time[1] - self.time[0])


def signal(history: History, point: int = 0) -> Signal:
    """Velocity of a point along its largest motion; without points the lateral force less its mean."""
    if history.velocity is not None and history.points:
        v = history.velocity[:, point]
        axis = int(np.argmax(v.std(axis=0)))
        return Signal(history.time, v[:, axis], f"velocity along {'xyz'[axis]} of {history.points[point]}", "m/s")
    force = history.force[:, 1]
    return Signal(history.time, force - force.mean(), "lateral force, less its mean", "N")


def period(moving: Signal) -> float:
    """Period of the cycle at the end, s; the whole time where nothing oscillates."""
    half = moving.value[len(moving.value) // 2 :]
    amplitude = np.abs(np.fft.rfft((half - half.mean()) * np.hanning(len(half))))
    amplitude[:3] = 0
    if len(amplitude) < 5 or not amplitude.any():
        return float(moving.time[-1] - moving.time[0])
    # The lowest strong line: stick and slip make harmonics that can be stronger at a point than the cycle itself.
    k = int(np.argmax(amplitude >= 0.2 * amplitude.max()))
    while k + 1 < len(amplitude) and amplitude[k + 1] > amplitude[k]:
        k += 1
    return float(1 / np.fft.rfftfreq(len(half), moving.step)[k])


def envelope(moving: Signal, span: float) -> tuple[Floats, Floats]:
    """Times, s, and largest departures from the mean in pieces of this length, s."""
    width = min(max(1, round(span / moving.step)), len(moving.value))
    blocks = len(moving.value) // width
    pieces = moving.value[: blocks * width].reshape(blocks, width)
    peak = np.abs(pieces - pieces.mean(axis=1, keepdims=True)).max(axis=1)
    return moving.time[: blocks * width].reshape(blocks, width).mean(axis=1), peak


@dataclass(frozen=True)
class Phase:
    """A time of exponential growth."""

    begin: float  # s
    end: float  # s
    rate: float  # 1/s, of the line through the logarithm of the envelope
    level: float  # logarithm of the envelope on that line at `middle`
    middle: float  # s

    def line(self, time: Floats, rate: float) -> Floats:
        """An envelope of another rate through the middle of the phase."""
        return np.asarray(np.exp(self.level + rate * (time - self.middle)))


def exponential(time: Floats, peak: Floats) -> Phase | None:
    """The time of the greatest rise of the envelope along an exponential; None where it does so nowhere.

    The greatest rise, not the longest time: a limit cycle that creeps upwards is longer than the growth before it.
    """
    for straight in STRAIGHT:
        phase = straightest(time, peak, straight)
        if phase:
            return phase
    return None


def straightest(time: Floats, peak: Floats, straight: float) -> Phase | None:
    """The same for one rms departure from the line."""
    good = peak > 0
    if good.sum() < LEAST:
        return None
    t, e = time[good] - time[good].mean(), np.log(peak[good])
    # Sums from the first value on, so that every window is a difference.
    sums = [np.concatenate([[0.0], np.cumsum(v)]) for v in (t, e, t * t, t * e, e * e)]
    n = len(t)
    best, most = (0, 0), np.log(RISE)
    for size in range(LEAST, n + 1):
        st, se, stt, ste, see = (s[size:] - s[:-size] for s in sums)
        ctt, cte, cee = stt - st * st / size, ste - st * se / size, see - se * se / size
        slope = cte / ctt
        rms = np.sqrt(np.maximum(cee - slope * cte, 0) / size)
        rise = slope * (t[size - 1 :] - t[: n - size + 1])
        rise[rms >= straight] = 0.0
        at = int(np.argmax(rise))
        if rise[at] > most:
            best, most = (at, at + size), rise[at]
    if best == (0, 0):
        return None
    chosen = slice(*best)
    slope, level = np.polyfit(t[chosen] - t[chosen].mean(), e[chosen], 1)
    kept = time[good][chosen]
    return Phase(float(kept[0]), float(kept[-1]), float(slope), float(level), float(kept.mean()))


def frequency(moving: Signal, begin: float, end: float) -> float:
    """Frequency of the strongest line in a part of the time, Hz, the parabola through the logarithms of three lines."""
    part = moving.value[(moving.time >= begin) & (moving.time <= end)]
    if len(part) < 8:
        return float("nan")
    amplitude = np.abs(np.fft.rfft((part - part.mean()) * np.hanning(len(part))))
    k = int(np.argmax(amplitude[1:-1])) + 1
    with np.errstate(divide="ignore", invalid="ignore"):
        left, middle, right = np.log(amplitude[k - 1 : k + 2])
        shift = 0.5 * (left - right) / (left - 2 * middle + right)
    return float((k + (shift if np.isfinite(shift) else 0.0)) / (len(part) * moving.step))


def driven(result: Result) -> list[str]:
    """Keys of the job by which contact or speed change with time: no steady state is there to grow from."""
    transient = lookup(result.job, "analyses.transient", {}) or {}
    return sorted(key for key, value in (transient.get("histories") or {}).items() if value)


def linear(result: Result, at: float) -> float | None:
    """Growth rate, 1/s, of the unstable mode at this frequency, Hz; None where there is none or the steady state
    changes with time."""
    if driven(result) or not ComplexModes.present(result):
        return None
    modes = ComplexModes.from_result(result)
    places = modes.unstable
    if not len(places) or not np.isfinite(at):
        return None
    nearest = places[np.argmin(np.abs(modes.frequency[places] - at))]
    return float(modes.growth_rate[nearest]) if abs(modes.frequency[nearest] - at) <= NEAR * at else None
