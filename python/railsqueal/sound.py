"""The motion of a point as a sound file: the velocity along the direction in which it moves most, normalised; its true level is said."""

import wave
from pathlib import Path

import numpy as np

from .errors import USAGE, WRITING, ResultError
from .growth import signal
from .result import Result
from .tables import History

RATE = 44100


def write(result: Result, point: str | None = None, out: Path | None = None) -> str:
    """Writes the sound of a point, by its name or the first one; what was written, and how loud it is."""
    history = History.of(result)
    if not history.points:
        raise ResultError(f"{result.path} holds no motion of points: give analyses.transient.points")
    if point and point not in history.points:
        raise ResultError(f"{result.path} has no point {point!r}; it has {', '.join(history.points)}", USAGE)
    moving = signal(history, history.points.index(point) if point else 0)
    v, time, step = moving.value - moving.value.mean(), moving.time, moving.step
    if 1 / step > RATE:
        # What the sound file cannot hold would be heard as something else.
        spectrum = np.fft.rfft(v)
        spectrum[np.fft.rfftfreq(len(v), step) > 0.45 * RATE] = 0
        v = np.fft.irfft(spectrum, len(v))
    samples = np.interp(np.arange(time[0], time[-1], 1 / RATE), time, v)
    peak = float(np.abs(samples).max())
    if peak == 0:
        raise ResultError(f"{result.path}: {moving.name} is zero at all times: there is nothing to hear")
    out = out or result.path.with_suffix(".wav")
    try:
        with wave.open(str(out), "wb") as sound:
            sound.setnchannels(1)
            sound.setsampwidth(2)
            sound.setframerate(RATE)
            sound.writeframes((samples / peak * 0.9 * 32767).astype("<i2").tobytes())
    except OSError as error:
        raise ResultError(f"cannot write {out}: {error}", WRITING) from error
    rms = float(np.sqrt((v[len(v) // 2 :] ** 2).mean()))
    return (
        f"{out}: {moving.name}, full scale {peak / 0.9:.4e} m/s\n"
        f"rms over the second half {rms:.4e} m/s, {20 * np.log10(rms / 1e-9):.1f} dB re 1 nm/s"
    )
