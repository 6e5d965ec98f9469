"""Pictures: their names and formats, and that they show nothing that was not computed."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from conftest import dataset
from railsqueal import Result, ResultError, compare, figures, report, tables
from railsqueal.pictures import Canvas, draw, receptance, style, sweep
from railsqueal.pictures import transient as drawn
from railsqueal.tables import Sweep
from railsqueal.verdict import verdict

# Per inch: coarse pictures are quick.
DOTS = 40


def swept(path: Path, first: list[float], second: list[float], failed: int) -> Path:
    """A sweep over friction and load with a failed point; the growth rate is friction − 0.3 + load / 1e6."""
    a, b = (v.reshape(-1) for v in np.meshgrid(first, second, indexing="ij"))
    growth = a - 0.3 + b / 1e6
    growth[failed] = np.nan
    with h5py.File(path, "w") as file:
        dataset(file, "sweep/keys", ["contact.friction", "contact.normal_load"], "-")
        dataset(file, "sweep/values/contact.friction", a)
        dataset(file, "sweep/values/contact.normal_load", b, "N")
        dataset(file, "sweep/shape", [len(first), len(second)])
        dataset(file, "sweep/status", np.where(np.arange(len(a)) == failed, 4, 0))
        dataset(file, "sweep/growth_rate", growth, "1/s")
        for name in ("frequency", "unstable", "sticking"):
            dataset(file, f"sweep/{name}", np.zeros(len(a)))
        dataset(file, "sweep/eigenvalue", np.zeros(0, complex))
        dataset(file, "sweep/offset", np.zeros(len(a) + 1, int))
    return path


def test_names_and_formats(cylinders: Path, tmp_path: Path) -> None:
    with Result(cylinders) as result:
        made = draw(result, Canvas(tmp_path, result.stem, ["png", "svg", "pdf"], DOTS))
        assert {p.suffix for p in made} == {".png", ".svg", ".pdf", ".md"} and all(p.stat().st_size > 0 for p in made)
        assert {p.stem for p in made} == {
            f"two-cylinders-{name}" for name in ("contact-line", "contact-map", "frequencies")
        }
        with pytest.raises(ResultError, match="gif.*png, pdf, svg"):
            Canvas(tmp_path, "a", ["gif"])


def test_a_direction_has_one_colour(cylinders: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept: dict[str, Any] = {}
    keep = lambda canvas, figure, name: kept.update({name: figure}) or [canvas.path(name, "png")]  # noqa: E731
    monkeypatch.setattr(Canvas, "save", keep)
    with Result(cylinders) as result:
        draw(result, Canvas(tmp_path, result.stem, resolution=DOTS))
    colours = {
        str(line.get_label()).split(",")[0]: line.get_color()
        for axes in kept["contact-line"].axes
        for line in axes.lines
    }
    assert colours["pressure"] == style.NORMAL and colours["traction $t_y$"] == style.LATERAL
    assert {label.split()[0]: colour for *_, label, colour in receptance.CURVES} == {
        "normal": style.NORMAL,
        "lateral": style.LATERAL,
        "longitudinal": style.LONGITUDINAL,
    }


def test_a_stopped_run_is_drawn(transient: Callable[..., Path], tmp_path: Path) -> None:
    with Result(transient(segments=2)) as result:
        made = draw(result, Canvas(tmp_path / "out", result.stem, resolution=DOTS))
        assert [p.name for p in made] == ["run-growth.png", "run-spectrogram.png"]


def test_cells_of_a_map_are_the_values_that_were_computed(tmp_path: Path) -> None:
    with Result(swept(tmp_path / "s.h5", [0.1, 0.2, 0.3], [40e3, 70e3, 1e6], failed=4)) as result:
        table = Sweep.from_result(result)
        friction, load = (sweep.Key(result, table, key) for key in table.keys)
        centres, width = friction.cells()
        assert friction.even and centres == pytest.approx([0.1, 0.2, 0.3]) and width == pytest.approx(0.1)
        # 70 kN and 1 MN: to scale, a cell would reach half a meganewton beyond what was computed.
        centres, width = load.cells()
        assert not load.even and centres.tolist() == [0, 1, 2] and width < 1
        assert [load.tick(v) for v in load.levels] == ["40", "70", "1000"]
        assert [p.name for p in draw(result, Canvas(tmp_path, "s", resolution=DOTS))] == ["s-sweep-map.png"]


def test_limit_cycles_are_drawn_branch_by_branch(tmp_path: Path) -> None:
    path = swept(tmp_path / "c.h5", [0.2, 0.3, 0.4], [40e3, 50e3], failed=5)
    fate = np.array([[0, 0, 0, 1, 1, -1], [0, 0, 2, 1, 1, -1]], np.int8)
    energy = np.where(fate > 0, 0.1 + np.arange(6), np.where(fate == 0, 0.0, np.nan))
    with h5py.File(path, "a") as file:
        dataset(file, "sweep/cycles/branch", ["up", "down"], "-")
        dataset(file, "sweep/cycles/along", "contact.friction", "-")
        dataset(file, "sweep/cycles/fate", fate, "-")
        dataset(file, "sweep/cycles/kinetic", energy, "J")
        dataset(file, "sweep/cycles/frequency", np.where(fate > 0, 420.0, np.nan), "Hz")
        dataset(file, "sweep/cycles/message", np.full((2, 6), "", object), "-")
        dataset(file, "sweep/cycles/time", np.ones((2, 6)), "s")
        for name, more in (("stick", 2), ("force", 3), ("force_rms", 3)):
            dataset(file, f"sweep/cycles/{name}", np.zeros((2, 6, more)))
        for name in ("velocity_rms", "force_harmonics"):
            dataset(file, f"sweep/cycles/{name}", np.zeros((2, 6, 2, 3)))
    with Result(path) as result:
        assert tables.Cycles.from_result(result).loudest() is None
    with h5py.File(path, "a") as file:
        level = np.where(fate > 0, 90.0 + np.arange(6), np.where(fate == 0, -np.inf, np.nan))
        dataset(file, "sweep/cycles/sound_power/lower/total_level_a", level, "dB")
        dataset(file, "sweep/cycles/sound_power/upper/total_level_a", level - 1 + 2 * (np.arange(6) == 4), "dB")
    with Result(path) as result:
        made = [p.name for p in draw(result, Canvas(tmp_path, "c", resolution=DOTS))]
        assert made == ["c-sweep-map.png", "c-limit-cycles.png", "c-limit-cycles-map.png"]
        named = {(f.group, f.name): f.value for f in figures.cycles(result)}
        notes = verdict(result).notes
    assert notes == [
        "Limit cycles: the loudest has 95 dB(A) of sound power at 420 Hz, with coefficient of friction μ = 0.4, normal "
        "load N = 40 kN."
    ]
    # The irregular one squeals too, and the largest energy is the fifth point's.
    assert [named[(f"limit cycles, {b}", "points that squeal")] for b in ("up", "down")] == [2, 3]
    assert named[("limit cycles, up", "largest kinetic energy")] == pytest.approx(4.1)
    # The louder body of the loudest point.
    assert named[("limit cycles, down", "largest sound power")] == pytest.approx(95.0)


def test_a_branch_that_ends_has_no_frequency() -> None:
    spectra = [np.array([1j, 5j]), np.array([1.01j]), np.array([1.02j])]
    branches = sweep.tracked(spectra)
    assert len(branches) == 2
    ended = next(b for b in branches if np.isnan(b[1]))
    assert np.isnan(ended.imag[1:]).all() and np.isnan(ended.real[1:]).all() and ended[0] == 5j


def test_labels_stand_apart() -> None:
    wanted = np.array([0.0, 0.1, 5.0, 0.05, 5.0, 9.0])
    placed = sweep.spread(wanted, 1.0)
    assert np.diff(np.sort(placed)).min() >= 1.0 - 1e-12
    # In the order of what they name, each cluster about its own mean; what stands alone stays.
    assert np.array_equal(np.argsort(placed, kind="stable"), np.argsort(wanted, kind="stable"))
    assert placed[5] == 9.0 and placed[[0, 1, 3]].mean() == pytest.approx(0.05)


def test_a_coarse_stride_is_said() -> None:
    when = 2e-4 * np.arange(100)
    assert drawn.coarse(when, 16e-4, 1e-5) == ""
    said = drawn.coarse(when, 8e-4, 1e-5)
    assert "4.0 in a period" in said and "contact_stride of at most 10" in said


WHEELS = ["leading inner", "leading outer", "trailing inner", "trailing outer"]


def over_wheels(path: Path, radii: list[float]) -> Path:
    """A sweep over wheels and radii, one eigenvalue a point: leading inner is unstable, the last point fails."""
    names = [w for w in WHEELS for _ in radii]
    growth = np.array([2.0 if w == WHEELS[0] else -1.0 for w in names])
    growth[-1] = np.nan
    with h5py.File(path, "w") as file:
        dataset(file, "sweep/keys", ["contact.from.wheel"] + ["curve.radius"] * (len(radii) > 1), "-")
        dataset(file, "sweep/values/contact.from.wheel", names, "-")
        dataset(file, "sweep/values/curve.radius", np.tile(radii, len(WHEELS)), "m")
        dataset(file, "sweep/shape", [len(WHEELS), len(radii)][: 1 + (len(radii) > 1)])
        dataset(file, "sweep/status", np.where(np.isnan(growth), 4, 0))
        dataset(file, "sweep/growth_rate", growth, "1/s")
        dataset(file, "sweep/frequency", np.full(len(names), 500.0), "Hz")
        dataset(file, "sweep/unstable", np.where(growth > 0, 1, 0))
        dataset(file, "sweep/sticking", np.zeros(len(names)))
        known = np.isfinite(growth)
        dataset(file, "sweep/eigenvalue", growth[known] + 2j * np.pi * 500, "1/s")
        dataset(file, "sweep/offset", np.concatenate([[0], np.cumsum(known)]))
    return path


def test_a_key_of_words_has_an_axis_of_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = {}
    save = Canvas.save

    def keep(canvas: Canvas, figure: Any, name: str) -> list[Path]:
        kept[name] = figure
        return save(canvas, figure, name)

    monkeypatch.setattr(Canvas, "save", keep)
    for name, radii in (("loci", [300.0]), ("map", [150.0, 300.0, 450.0])):
        with Result(over_wheels(tmp_path / f"{name}.h5", radii)) as result:
            made = draw(result, Canvas(tmp_path, name, resolution=DOTS))
            assert [p.name for p in made] == [f"{name}-sweep-{name}.png"]
            axes = kept[f"sweep-{name}"].axes[1 if name == "loci" else 0]
            assert [t.get_text() for t in axes.get_xticklabels()] == WHEELS and axes.get_xlabel() == "wheel"
            named = {f.name: f for f in figures.sweep(result)}
            assert named["its wheel"].text == "leading inner"
            text = report.page(result, [])
            assert re.search(r"<td>its wheel</td><td[^>]*>leading inner</td>", text)
            assert "contact.from.wheel" not in text.split("<pre>")[0]
            assert re.search(r"<tr><td>trailing outer</td>.*</tr>", text)
    # Wheels are no steps of a curve: each mode is a point, and the unstable one tells its frequency.
    lower = kept["sweep-loci"].axes[1]
    drawn_points = [np.isfinite(np.asarray(line.get_ydata(), float)).sum() for line in lower.get_lines()[:3]]
    assert max(drawn_points) == 1 and [t.get_text() for t in lower.texts] == ["500 Hz"]
    assert kept["sweep-map"].axes[0].get_ylabel() == "radius of the curve R / m"


def test_words_of_a_third_key_have_a_map_each(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = over_wheels(tmp_path / "s.h5", [150.0, 300.0, 450.0, 600.0])
    with h5py.File(path, "a") as file:
        # The radii of the file as two radii of two coefficients of friction each.
        del file["sweep/keys"], file["sweep/shape"], file["sweep/values/curve.radius"]
        dataset(file, "sweep/keys", ["curve.radius", "contact.from.wheel", "contact.friction"], "-")
        dataset(file, "sweep/shape", [2, len(WHEELS), 2])
        dataset(file, "sweep/values/curve.radius", np.tile([150.0, 150.0, 300.0, 300.0], len(WHEELS)), "m")
        dataset(file, "sweep/values/contact.friction", np.tile([0.3, 0.5, 0.3, 0.5], len(WHEELS)))
    kept = []
    monkeypatch.setattr(Canvas, "save", lambda canvas, figure, name: kept.append(figure) or [canvas.path(name, "png")])
    with Result(path) as result:
        made = draw(result, Canvas(tmp_path, "s", resolution=DOTS))
        assert [p.name for p in made] == ["s-sweep-map.png", "s-sweep-parallel.png"]
    maps = kept[0].axes[:4]
    assert [axes.get_title() for axes in maps] == WHEELS
    # Four cells each, and numbers in those of the wheel that is unstable.
    assert [len(axes.patches) for axes in maps] == [4] * 4 and [len(axes.texts) for axes in maps] == [4, 0, 0, 0]
    assert [patch.get_hatch() for patch in maps[3].patches] == [None, None, None, "///"]


def test_words_that_differ_are_no_small_difference() -> None:
    one, other = (figures.Figure("sweep", "its wheel", float("nan"), word=word) for word in WHEELS[:2])
    assert compare.difference(one, one) == 0 and compare.difference(one, other) == np.inf
