"""Sweeps over many keys in pictures and in the report, and the sound of a transient in it."""

import csv
import json
import re
import wave
from base64 import b64decode
from collections.abc import Callable
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from conftest import FREQUENCY, dataset
from railsqueal import Result, report
from railsqueal.pictures import Canvas, draw, slices
from railsqueal.pictures.sweep import Key
from railsqueal.tables import Sweep
from railsqueal.verdict import verdict

DOTS = 40
KEYS = {
    "contact.friction": ([0.2, 0.4], "1"),
    "contact.placement.lateral": ([-6e-3, -3e-3, 0.0], "m"),
    "contact.placement.yaw": ([-10e-3, -5e-3, 0.0, 5e-3], "rad"),
    "bodies.lower.track.pad.vertical": ([100e6, 400e6], "N/m"),
}


def over_four(path: Path) -> Path:
    """A sweep over four keys: the growth rate is 10 (friction − 0.3) − 100 yaw, and the second point fails."""
    points = np.array(list(product(*(values for values, _ in KEYS.values()))))
    growth = 10 * (points[:, 0] - 0.3) - 100 * points[:, 2]
    growth[1] = np.nan
    with h5py.File(path, "w") as file:
        dataset(file, "sweep/keys", list(KEYS), "-")
        dataset(file, "sweep/shape", [len(values) for values, _ in KEYS.values()])
        for column, (key, (_, unit)) in zip(points.T, KEYS.items()):
            dataset(file, f"sweep/values/{key}", column, unit)
        dataset(file, "sweep/status", np.where(np.isnan(growth), 4, 0))
        dataset(file, "sweep/message", ["did not converge" if np.isnan(g) else "" for g in growth], "-")
        dataset(file, "sweep/growth_rate", growth, "1/s")
        dataset(file, "sweep/frequency", np.where(growth > 1.0, 500.0, 0.0), "Hz")
        dataset(file, "sweep/unstable", np.where(growth > 0, 1, 0))
        dataset(file, "sweep/sticking", np.zeros(len(growth)))
        known = np.isfinite(growth)
        dataset(file, "sweep/eigenvalue", growth[known] + 2j * np.pi * 500, "1/s")
        dataset(file, "sweep/offset", np.concatenate([[0], np.cumsum(known)]))
    return path


@pytest.fixture
def figures_kept(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Figures by their names, as they would be written."""
    kept: dict[str, Any] = {}
    save = Canvas.save

    def keep(canvas: Canvas, figure: Any, name: str) -> list[Path]:
        kept[name] = figure
        return save(canvas, figure, name)

    monkeypatch.setattr(Canvas, "save", keep)
    return kept


def test_four_keys_have_slices_and_parallel_coordinates(tmp_path: Path, figures_kept: dict[str, Any]) -> None:
    with Result(over_four(tmp_path / "s.h5")) as result:
        made = draw(result, Canvas(tmp_path, "s", resolution=DOTS))
    assert [p.name for p in made] == ["s-sweep-slices.png", "s-sweep-parallel.png"]
    # The two keys with the most values are the axes; the others make four maps of twelve cells.
    maps = figures_kept["sweep-slices"].axes[:4]
    assert [len(axes.patches) for axes in maps] == [12] * 4
    assert maps[0].get_title() == "coefficient of friction μ = 0.2\nvertical pad stiffness of the lower body = 100 MN/m"
    assert (
        maps[0].get_ylabel() == "yaw of the wheelset (angle of attack) / mrad"
        and maps[2].get_xlabel() == "lateral shift of the wheelset / mm"
    )
    # The failed point is the second one: the first friction, the second stiffness, yaw −10 mrad, shift −6 mm.
    hatched = [
        [(round(p.get_x() + 1.5), round(p.get_y() + 2.5)) for p in axes.patches if p.get_hatch() == "///"]
        for axes in maps
    ]
    assert hatched == [[], [(-6, -10)], [], []]
    lines = figures_kept["sweep-parallel"].axes[0].collections[0].get_segments()
    growth = np.sort([10 * (f - 0.3) - 100 * y for f, _, y, _ in product(*(v for v, _ in KEYS.values()))])
    assert len(lines) == 47 and all(segment.shape == (5, 2) for segment in lines)
    # The last axis has the growth rate to scale, the slowest first, without that of the failed point.
    heights = np.array([segment[-1, 1] for segment in lines])
    known = np.delete(growth, np.argmin(np.abs(growth - (10 * (0.2 - 0.3) + 1))))
    assert heights == pytest.approx((known - known[0]) / (known[-1] - known[0]), abs=1e-9)
    labels = [t.get_text().replace("\n", " ") for t in figures_kept["sweep-parallel"].axes[0].get_xticklabels()]
    assert (
        labels[0] == "coefficient of friction μ"
        and labels[3] == "vertical pad stiffness of the lower body / (MN/m)"
        and not any("_" in t for t in labels)
    )


def test_lines_through_one_value_are_spread_in_their_order() -> None:
    spread = slices.spread_lines(np.array([0.0, 1.0, 0.0, 0.0]))
    assert spread == pytest.approx([-slices.SPREAD, 1.0, 0.0, slices.SPREAD])


def test_more_maps_than_fit_are_picked_and_said(tmp_path: Path, figures_kept: dict[str, Any]) -> None:
    values = {
        "contact.friction": np.linspace(0.1, 0.4, 31),
        "contact.speed": np.arange(1.0, 33),
        "contact.normal_load": np.arange(1.0, 31),
    }
    points = np.array(list(product(*values.values())))
    path = tmp_path / "s.h5"
    with h5py.File(path, "w") as file:
        dataset(file, "sweep/keys", list(values), "-")
        dataset(file, "sweep/shape", [len(v) for v in values.values()])
        for column, key in zip(points.T, values):
            dataset(file, f"sweep/values/{key}", column)
        for name in ("status", "growth_rate", "frequency", "unstable", "sticking"):
            dataset(file, f"sweep/{name}", np.zeros(len(points)))
        dataset(file, "sweep/eigenvalue", np.zeros(0, complex))
        dataset(file, "sweep/offset", np.zeros(len(points) + 1, int))
    with Result(path) as result:
        sweep = Sweep.from_result(result)
        few = [Key(result, sweep, key) for key in sweep.keys]
        # One cell for each map would take long: the maps are counted, not drawn.
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(slices, "one_map", lambda *_: {})
            slices.slices(result, sweep, few, Canvas(tmp_path, "s", resolution=20))
    title = figures_kept["sweep-slices"].get_suptitle()
    assert "24 of 30 combinations" in title


def test_points_and_growth_rates_are_in_the_tables(tmp_path: Path) -> None:
    with Result(over_four(tmp_path / "s.h5")) as result:
        page, *tables = report.write(result, tmp_path / "out")
        said = verdict(result)
    text = page.read_text(encoding="utf-8")
    rows = list(csv.DictReader((tmp_path / "out/s-sweep.csv").open(encoding="utf-8")))
    assert (
        len(rows) == 48
        and float(rows[0]["growth_rate_1/s"]) == pytest.approx(0.0)
        and rows[1]["message"] == "did not converge"
    )
    assert float(rows[0]["contact.placement.yaw_rad"]) == -0.01
    assert len(list(csv.DictReader((tmp_path / "out/s-sweep-eigenvalues.csv").open(encoding="utf-8")))) == 47
    unstable = sum(float(r["growth_rate_1/s"]) > 0 for r in rows)
    assert (
        said.kind == "squeal"
        and f"Sweep: growth at {unstable} of 47 points; 1 point failed; fastest 2.0 1/s at 500 Hz" in said.sentence
    )
    assert "yaw of the wheelset (angle of attack) = −10 mrad" in said.sentence
    section = text[text.index('<h2 id="sweep">') : text.index('<h2 id="figures">')]
    assert "lateral shift of the wheelset / mm" in section and "contact.placement" not in section
    # The fastest growth first, in displayed units.
    first = re.search(r'<tr class="unstable">(.*?)</tr>', section)
    assert first and re.findall(r">([^<]+)<", first[1]) == ["0.4", "−6", "−10", "100", "1", "+2.0000", "500.0"]
    assert "none: stick–slip relaxation" in section and "did not converge" in section


def test_the_report_plays_the_sound(transient: Callable[..., Path], tmp_path: Path) -> None:
    with Result(transient()) as result:
        text = report.page(result, [])
    found = re.search(r'<audio controls src="data:audio/wav;base64,([^"]+)"></audio><figcaption>([^<]*)', text)
    assert found and "velocity along y of rim" in found[2] and "dB re 1 nm/s" in found[2]
    with wave.open(BytesIO(b64decode(found[1]))) as file:
        rate, samples = file.getframerate(), np.frombuffer(file.readframes(file.getnframes()), "<i2")
    lines = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    assert np.fft.rfftfreq(len(samples), 1 / rate)[lines.argmax()] == pytest.approx(FREQUENCY, abs=0.5)


def test_a_long_sound_is_its_end(transient: Callable[..., Path], tmp_path: Path) -> None:
    from railsqueal import sound

    with Result(transient()) as result:
        sound.write(result, "rim", tmp_path / "end.wav", 0.5)
    with wave.open(str(tmp_path / "end.wav")) as file:
        assert file.getnframes() / file.getframerate() == pytest.approx(0.5, abs=1e-3)


def test_friction_laws_are_told_apart(tmp_path: Path) -> None:
    laws = [json.dumps({"exponential": {"static": 0.4, "kinetic": k, "decay_velocity": 0.5}}) for k in (0.3, 0.2)]
    path = tmp_path / "s.h5"
    with h5py.File(path, "w") as file:
        dataset(file, "sweep/keys", ["contact.friction"], "-")
        dataset(file, "sweep/shape", [2])
        dataset(file, "sweep/values/contact.friction", laws, "-")
        for name in ("status", "growth_rate", "frequency", "unstable", "sticking"):
            dataset(file, f"sweep/{name}", np.zeros(2))
        dataset(file, "sweep/eigenvalue", np.zeros(0, complex))
        dataset(file, "sweep/offset", np.zeros(3, int))
    with Result(path) as result:
        key = Key(result, Sweep.from_result(result), "contact.friction")
    ticks = [key.tick(k).replace("\n", " ") for k in key.levels]
    assert (
        ticks == [f"exponential: static 0.4, kinetic {k}, decay velocity 0.5 m/s" for k in (0.3, 0.2)]
        and key.label == "coefficient of friction μ"
    )


def test_a_stopped_run_has_a_report(transient: Callable[..., Path], tmp_path: Path) -> None:
    with Result(transient(segments=2)) as result:
        page, *tables = report.write(result, tmp_path / "out")
    text = page.read_text(encoding="utf-8")
    assert "The run was stopped before its end" in text and "Squeals: the motion grows at" in text
    rows = list(csv.DictReader((tmp_path / "out/run-transient.csv").open(encoding="utf-8")))
    # Too long for the page, it stays beside it.
    assert len(rows) == 30000 and "run-transient.csv, beside this file" in text
    assert float(rows[-1]["force_y_N"]) == -3.0 and "velocity_y_of_rim_m/s" in rows[0]
