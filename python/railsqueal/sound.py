"""A transient as a sound file: the velocity of a point along the direction in which it moves most, or the pressure that
the modes of a body make beside the track. Normalised; the true level is said."""

import wave
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .errors import USAGE, WRITING, ResultError
from .growth import signal
from .result import Floats, Result
from .tables import History

RATE = 44100
# Metres from the source at which its pressure is heard, over hard ground (ISO 3095), and what levels of it refer to.
DISTANCE = 7.5
PRESSURE = 20e-6


class SoundSignal(NamedTuple):
    """Signal of a sound file: samples, their step, and the reference of its level."""

    name: str
    value: Floats  # [s]
    step: float  # s
    unit: str
    reference: float
    level: str  # what its level refers to


def write(result: Result, point: str | None = None, out: Path | None = None, longest: float | None = None) -> str:
    """Writes the sound of a point, by its name or the first one, or, without points, of the modes of a body.

    Of a record that takes more than `longest` seconds the end is written. Returns what was written, and how loud it is.
    """
    history = History.from_result(result)
    bodies = [name for name in ("lower", "upper") if f"transient/sound_power/{name}/mode_resistance" in result]
    if point and point not in history.points + bodies:
        there = ", ".join(history.points + bodies) or "none"
        raise ResultError(f"{result.path} has no point and no body with sound power {point!r}; it has {there}", USAGE)
    if not history.points and not bodies:
        raise ResultError(
            f"{result.path} holds nothing to hear: give analyses.transient.points or analyses.transient.sound_power"
        )
    if history.points and (point is None or point in history.points):
        moving = signal(history, history.points.index(point) if point else 0)
        made = SoundSignal(moving.name, moving.value - moving.value.mean(), moving.step, "m/s", 1e-9, "1 nm/s")
    else:
        made = pressure(result, point or loudest(result, bodies))
    if longest is not None and longest < len(made.value) * made.step:
        made = made._replace(value=made.value[-round(longest / made.step) :])
    return saved(made, out or result.path.with_suffix(".wav"), result)


def loudest(result: Result, bodies: list[str]) -> str:
    """Body with the largest sound power among these."""
    return max(bodies, key=lambda name: float(result[f"transient/sound_power/{name}/total_level_a"]))


def pressure(result: Result, body: str) -> SoundSignal:
    """The pressure beside the track, Pa, of the modes of a body: each as loud as its radiation resistance says, in
    phase with its velocity. The phases that the way to the ear adds are not heard."""
    resistance = result.array(f"transient/sound_power/{body}/mode_resistance")
    time = result.array("transient/modal_time")
    count = {
        name: len(result.array(f"modes/{name}/frequency")) if f"modes/{name}/frequency" in result else 0
        for name in ("lower", "upper")
    }
    # Both bodies may be one.
    count = {name: number or len(resistance) for name, number in count.items()}
    first = 0 if body == "lower" else count["lower"]
    if len(time) < 2:
        raise ResultError(
            f"{result.path}: the amplitudes of the modes are not kept; set analyses.transient.modal_stride"
        )
    step = float(time[1] - time[0])
    highest = float(result.array("transient/sound_power/band_frequency")[-1])
    if 2.5 * highest * step > 1:
        raise ResultError(
            f"{result.path}: the amplitudes of the modes are kept every {step:g} s, too seldom for {highest:.0f} Hz; "
            f"expected {1 / (2.5 * highest):.1e} s or less: a smaller analyses.transient.modal_stride"
        )
    wanted = result.job["analyses"]["transient"]["sound_power"]
    resistant = wanted["air_density"] * wanted["sound_speed"]
    amplitudes = result.array("transient/modal_displacement")[:, first : first + len(resistance)]
    # p² = ρc W/(2πd²), W = Σ R q̇².
    weight = np.sqrt(resistant * resistance / (2 * np.pi * DISTANCE**2))
    value = np.diff(amplitudes @ weight) / step
    return SoundSignal(f"{body} body at {DISTANCE} m", value - value.mean(), step, "Pa", PRESSURE, "20 µPa")


def saved(made: SoundSignal, out: Path, result: Result) -> str:
    """Writes the file; what was written, and how loud it is."""
    value, step = made.value, made.step
    if 1 / step > RATE:
        # What the sound file cannot hold would be heard as something else.
        spectrum = np.fft.rfft(value)
        spectrum[np.fft.rfftfreq(len(value), step) > 0.45 * RATE] = 0
        value = np.fft.irfft(spectrum, len(value))
    time = step * np.arange(len(value))
    samples = np.interp(np.arange(0, time[-1], 1 / RATE), time, value)
    peak = float(np.abs(samples).max())
    if peak == 0:
        raise ResultError(f"{result.path}: {made.name} is zero at all times: there is nothing to hear")
    try:
        with wave.open(str(out), "wb") as sound:
            sound.setnchannels(1)
            sound.setsampwidth(2)
            sound.setframerate(RATE)
            sound.writeframes((samples / peak * 0.9 * 32767).astype("<i2").tobytes())
    except OSError as error:
        raise ResultError(f"cannot write {out}: {error}", WRITING) from error
    rms = float(np.sqrt((value[len(value) // 2 :] ** 2).mean()))
    return (
        f"{out}: {made.name}, full scale {peak / 0.9:.4e} {made.unit}\n"
        f"rms over the second half {rms:.4e} {made.unit}, {20 * np.log10(rms / made.reference):.1f} dB re "
        f"{made.level}"
    )
