"""Growth of a motion whose rate, frequency and saturation are known."""

import wave
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import FREQUENCY, RATE, motion

from railsqueal import History, Result, growth, sound


def test_the_growth_is_found_and_the_cycle_left_out(transient: Callable[..., Path]) -> None:
    with Result(transient()) as result:
        moving = growth.signal(History.of(result))
        span = growth.period(moving)
        assert 1 / span == pytest.approx(FREQUENCY, rel=2e-3)
        phase = growth.exponential(*growth.envelope(moving, 2 * span))
        assert phase is not None
        # Half of the cycle is reached after 1.06 s; up to a few per cent of it the motion is an exponential.
        assert phase.rate == pytest.approx(RATE, rel=0.02) and phase.end < 1.0
        at = growth.frequency(moving, phase.begin, phase.end)
        assert at == pytest.approx(FREQUENCY, abs=0.5)
        # The mode of that frequency, not the one that grows most.
        assert growth.linear(result, at) == RATE
        assert growth.linear(result, 500.0) is None
        line = phase.line(np.array([phase.middle]), RATE)
        assert np.log(line[0]) == pytest.approx(phase.level)


def test_what_does_not_grow_has_no_growth() -> None:
    time = 1e-4 * np.arange(20000)
    steady = growth.Signal(time, np.sin(2 * np.pi * 300 * time), "v", "m/s")
    assert growth.exponential(*growth.envelope(steady, 2 / 300)) is None
    still = growth.Signal(time, 0 * time, "v", "m/s")
    assert growth.exponential(*growth.envelope(still, 2 / 300)) is None
    assert growth.period(still) == pytest.approx(time[-1])


def test_a_driven_job_has_no_linear_line(transient: Callable[..., Path]) -> None:
    with Result(transient()) as result:
        result.__dict__["_derived"]["provenance/job"] = '{"analyses": {"transient": {"histories": {"normal_load": [[0, 1], [1, 2]]}}}}'
        assert growth.driven(result) == ["normal_load"] and growth.linear(result, FREQUENCY) is None


def test_the_sound_has_the_frequency_of_the_motion(transient: Callable[..., Path], tmp_path: Path) -> None:
    with Result(transient()) as result:
        said = sound.write(result, "rim", tmp_path / "a.wav")
    with wave.open(str(tmp_path / "a.wav")) as file:
        samples = np.frombuffer(file.readframes(file.getnframes()), "<i2")
        rate = file.getframerate()
    assert len(samples) == pytest.approx(3.0 * rate, rel=1e-3) and np.abs(samples).max() == pytest.approx(0.9 * 32767, abs=2)
    lines = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    assert np.fft.rfftfreq(len(samples), 1 / rate)[lines.argmax()] == pytest.approx(FREQUENCY, abs=0.5)
    late = motion(1e-4 * np.arange(15001, 30001))
    level = 20 * np.log10(np.sqrt((late**2).mean()) / 1e-9)
    assert "along y of rim" in said and f"{level:.1f} dB re 1 nm/s" in said
