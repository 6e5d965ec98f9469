"""Growth of a motion whose rate, frequency and saturation are known."""

import json
import wave
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import FREQUENCY, RATE, dataset, motion
from railsqueal import History, Result, ResultError, growth, sound


def test_the_growth_is_found_and_the_cycle_left_out(transient: Callable[..., Path]) -> None:
    with Result(transient()) as result:
        moving = growth.signal(History.from_result(result))
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
        result.__dict__["_derived"]["provenance/job"] = (
            '{"analyses": {"transient": {"histories": {"normal_load": [[0, 1], [1, 2]]}}}}'
        )
        assert growth.driven(result) == ["normal_load"] and growth.linear(result, FREQUENCY) is None


def test_the_sound_has_the_frequency_of_the_motion(transient: Callable[..., Path], tmp_path: Path) -> None:
    with Result(transient()) as result:
        said = sound.write(result, "rim", tmp_path / "a.wav")
    with wave.open(str(tmp_path / "a.wav")) as file:
        samples = np.frombuffer(file.readframes(file.getnframes()), "<i2")
        rate = file.getframerate()
    assert len(samples) == pytest.approx(3.0 * rate, rel=1e-3) and np.abs(samples).max() == pytest.approx(
        0.9 * 32767, abs=2
    )
    lines = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    assert np.fft.rfftfreq(len(samples), 1 / rate)[lines.argmax()] == pytest.approx(FREQUENCY, abs=0.5)
    late = motion(1e-4 * np.arange(15001, 30001))
    level = 20 * np.log10(np.sqrt((late**2).mean()) / 1e-9)
    assert "along y of rim" in said and f"{level:.1f} dB re 1 nm/s" in said


def test_a_body_is_heard_by_its_modes(tmp_path: Path) -> None:
    time = 5e-5 * np.arange(1, 20001)
    # Two modes of the lower body that do not sound here, and of the upper one's two one that is heard and one that does
    # not radiate.
    amplitude = np.zeros((len(time), 4))
    speed = 1e-3
    amplitude[:, 1], amplitude[:, 3] = 1e-3 * np.sin(2000 * time), 1e-3 * time
    amplitude[:, 2] = speed / (2 * np.pi * 440) * np.sin(2 * np.pi * 440 * time)
    air = {"air_density": 1.2, "sound_speed": 340.0}
    job = json.dumps({"analyses": {"transient": {"sound_power": air}}})
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        tables = {
            "time": time,
            "force": np.zeros((len(time), 3)),
            "closed": np.full(len(time), 4),
            "stick": np.zeros(len(time), int),
        }
        for name, values in (tables | {"modal_time": time, "modal_displacement": amplitude}).items():
            dataset(file, f"transient/{name}", values)
        dataset(file, "transient/sound_power/band_frequency", [400.0, 500.0], "Hz")
        dataset(file, "transient/sound_power/upper/mode_resistance", [20.0, 0.0])
        dataset(file, "transient/sound_power/upper/total_level_a", 80.0)
        dataset(file, "modes/lower/frequency", [300.0, 318.0])
        dataset(file, "modes/upper/frequency", [440.0, 500.0])
        dataset(file, "provenance/job", job, "-")
    with Result(path) as result:
        said = sound.write(result)
        with pytest.raises(ResultError, match="it has upper"):
            sound.write(result, "lower")
    # W = R q̇² goes through half a sphere.
    power = 20.0 * speed**2 / 2
    level = 10 * np.log10(1.2 * 340 * power / (2 * np.pi * 7.5**2) / 20e-6**2)
    assert "upper body at 7.5 m" in said and f"{level:.1f} dB re 20 µPa" in said
    with wave.open(str(tmp_path / "run.wav")) as file:
        samples, rate = np.frombuffer(file.readframes(file.getnframes()), "<i2"), file.getframerate()
    lines = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    assert np.fft.rfftfreq(len(samples), 1 / rate)[lines.argmax()] == pytest.approx(440, abs=1.5)
    with h5py.File(path, "r+") as file:
        del file["transient/modal_time"], file["transient/modal_displacement"]
        dataset(file, "transient/modal_time", time[::20])
        dataset(file, "transient/modal_displacement", amplitude[::20])
    with Result(path) as result, pytest.raises(ResultError, match="modal_stride"):
        sound.write(result)
