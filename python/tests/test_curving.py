"""Steady curving: its tables, pictures, figures and the section of the report."""

import csv
import re
import shutil
from pathlib import Path

import h5py
import matplotlib.pyplot as plt
import numpy as np
import pytest
from conftest import RADII
from matplotlib.figure import Figure
from railsqueal import Curving, CurvingRadii, Result, ResultError, compare, figures, report
from railsqueal.curving import WHEELS
from railsqueal.pictures import Canvas, draw
from railsqueal.pictures import curving as drawn

DOTS = 40


class Kept(Canvas):
    """A canvas that keeps the figures."""

    figures: dict[str, Figure] = {}

    def save(self, figure: Figure, name: str) -> list[Path]:
        self.figures[name] = figure
        return super().save(figure, name)


def mirrored(path: Path, to: Path) -> Path:
    """The same bogie in a curve to the left."""
    shutil.copy(path, to)
    with h5py.File(to, "a") as file:
        root = file["curving"]
        for name in ("curvature", "frame", "axles/shift", "axles/yaw", "contacts/contact_angle"):
            root[name][...] = -root[name][()]
        for name, columns in (("position", [1]), ("creepage", [1, 2]), ("creep_force", [1]), ("force", [1])):
            values = root[f"contacts/{name}"][()]
            values[:, columns] *= -1
            root[f"contacts/{name}"][...] = values
    return to


def test_tables_are_read(curving: Path) -> None:
    with Result(curving) as result:
        table, radii = Curving.from_result(result), CurvingRadii.from_result(result)
    assert table.radius == pytest.approx(300) and table.curve() == "curve to the right, radius 300 m, 10 m/s"
    # The place that carries most comes first; only a wheel with several places names them.
    assert table.places(1).tolist() == [2, 1] and table.places(3).tolist() == [4]
    assert table.name(1) == "leading outer at -38.4 mm" and table.name(4) == "trailing outer"
    # The inner wheels of a curve to the right are the right-hand ones.
    assert [table.lateral_side(wheel) for wheel in range(4)] == [1, -1, 1, -1]
    assert radii.radius.tolist() == sorted(RADII) and radii.failed.tolist() == [0]
    assert radii.message[0].startswith("no equilibrium") and np.isnan(radii.creepage[0]).all()
    assert radii.creepage[1, 1, 2] == pytest.approx(2 * 1.1741) and radii.places[1].tolist() == [1, 2, 1, 1]


def test_an_unknown_wheel_is_refused(curving: Path) -> None:
    with h5py.File(curving, "a") as file:
        file["curving/contacts/wheel"][0] = 4
    with Result(curving) as result, pytest.raises(ResultError, match="contacts/wheel has the value 4, expected 0 to 3"):
        Curving.from_result(result)
    with h5py.File(curving, "a") as file:
        del file["curving"]
    with Result(curving) as result, pytest.raises(ResultError, match="its job has no analyses.curving"):
        Curving.from_result(result)


def test_axes_have_titles_with_units(curving: Path, tmp_path: Path) -> None:
    canvas = Kept(tmp_path / "out", "bogie", ["png", "svg"], DOTS)
    with Result(curving) as result:
        made = draw(result, canvas)
    names = ("curving-bogie", "curving-contacts", "curving-radius")
    assert [p.name for p in made] == [f"bogie-{name}.{ending}" for name in names for ending in ("png", "svg")]
    assert all(p.stat().st_size > 0 for p in made)
    # Bars have their quantities across, the curves over the radius upwards.
    bars = [axes.get_xlabel() for axes in canvas.figures["curving-contacts"].axes]
    curves = [axes.get_ylabel() for axes in canvas.figures["curving-radius"].axes]
    assert len(bars) == 6 and len(curves) == 8
    assert all(re.search(r" / (%|kN|\(1/m\)|\(μN\)|°|mm|mrad)$", label) for label in bars + curves)
    below = [axes.get_xlabel() for axes in canvas.figures["curving-radius"].axes[-2:]]
    assert below == ["radius of the curve R / m"] * 2
    rows = [text.get_text() for text in canvas.figures["curving-contacts"].axes[0].get_yticklabels()]
    assert rows == ["leading inner", "leading outer at −33.2 mm", "leading outer at −38.4 mm", *WHEELS[2:]]


def test_wheels_keep_their_colours_over_the_radius(curving: Path, tmp_path: Path) -> None:
    canvas = Kept(tmp_path, "bogie", resolution=DOTS)
    with Result(curving) as result:
        drawn.pictures(result, canvas)
    panels = canvas.figures["curving-radius"].axes[:6]
    for axes in panels:
        lines = {line.get_label(): line for line in axes.get_lines()}
        assert [lines[name].get_color() for name in WHEELS] == list(drawn.COLOURS)
        # A dotted line stands at the radius without equilibrium.
        assert [line.get_xdata()[0] for line in axes.get_lines() if line.get_linestyle() == ":"] == [100.0]
    xi = {line.get_label(): line for line in panels[0].get_lines()}["leading inner"]
    assert xi.get_ydata()[1:] == pytest.approx([0.68, 0.34, 0.17])


def test_the_bogie_stands_as_the_curve_turns(curving: Path, tmp_path: Path) -> None:
    with Result(curving) as result, Result(mirrored(curving, tmp_path / "left.h5")) as other:
        tables = [Curving.from_result(result), Curving.from_result(other)]
        canvas = Kept(tmp_path, "bogie", resolution=DOTS)
        words = []
        for source in (result, other):
            drawn.pictures(source, canvas)
            axes = canvas.figures["curving-bogie"].axes[0]
            words.append({text.get_text().split("\n")[0]: text.get_position() for text in axes.texts})
            assert "20 times as large" in axes.get_title() and axes.yaxis_inverted()
    assert drawn.exaggeration(tables[0]) == drawn.exaggeration(tables[1]) == 20
    # The inner wheels stand where y is positive in a curve to the right, and on the other side in one to the left.
    for wheel in WHEELS:
        (x, y), (mirror_x, mirror_y) = (named[wheel] for named in words)
        assert mirror_y == pytest.approx(-y) and (y > 0) == wheel.endswith("inner")
        # Ahead is to the right of the picture.
        assert (x > 0) == (mirror_x > 0) == wheel.startswith("leading")
    # The creep force in plan: its lateral part along the inclined rail is shortened by the contact angle.
    forces = drawn.wheel_forces(tables[0])
    assert forces[0, 0] == pytest.approx([-9766, -17148 * np.cos(8.1e-3)]) and forces[1, 1, 1] == pytest.approx(23090)
    assert forces[1, 0] == pytest.approx([9310, -2614 * np.cos(1.2225) - 18590 * np.cos(0.5732)])
    plt.close("all")


def test_a_straight_track_is_drawn(curving: Path, tmp_path: Path) -> None:
    with h5py.File(curving, "a") as file:
        for name in ("curvature", "frame", "axles/shift", "axles/yaw", "contacts/force", "contacts/creep_force"):
            file[f"curving/{name}"][...] = 0
    with Result(curving) as result:
        assert (
            Curving.from_result(result).curve() == "straight track at 10 m/s"
            and drawn.exaggeration(Curving.from_result(result)) == 1
        )
        assert len(drawn.pictures(result, Canvas(tmp_path, "straight", resolution=DOTS))) == 3


def test_the_report_has_a_section(curving: Path, tmp_path: Path) -> None:
    with Result(curving) as result:
        page, *tables = report.write(result, tmp_path / "out")
    text = page.read_text(encoding="utf-8")
    section = text[text.index('<h2 id="curving">Curving</h2>') : text.index('<h2 id="figures">')]
    # All three pictures stand in this section, and no other section repeats them.
    assert section.count("<figure>") == text.count("<figure>") == 3 and "Pictures</h2>" not in text
    lines = [row for row in section.splitlines() if row.startswith("<tr><td>leading outer")]
    cells = [re.findall(r"<td>(.*?)</td>", row)[4:8] for row in lines]
    assert cells == [["57.27", "-0.4092", "-0.7873", "+1.1741"], ["9.08", "-1.8241", "-1.9381", "+2.0330"]]
    assert "<th>normal force, kN</th>" in section and "<th>spin, 1/m</th>" in section
    assert ">no equilibrium &lt;R = 100 m&gt;</td>" in section
    assert [t.name for t in tables] == ["bogie-figures.csv", "bogie-curving.csv", "bogie-curving-radii.csv"]
    rows, radii = ([*csv.DictReader(t.open(encoding="utf-8"))] for t in tables[1:])
    assert len(rows) == 5 and len(radii) == 16
    assert float(rows[2]["creepage_longitudinal"]) == -1.8241e-2 and rows[2]["wheel"] == "leading outer"
    assert radii[0]["radius_m"] == "100.0" and radii[5]["places"] == "2"


def test_creepages_are_compared(curving: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.h5"
    shutil.copy(curving, other)
    with h5py.File(other, "a") as file:
        file["curving/contacts/creepage"][3, 1] *= 1.01
    with Result(curving) as one, Result(other) as two:
        named = {f.name: f for f in figures.figures_of_result(one)}
        spin = named["leading outer, spin"]
        assert spin.value == pytest.approx(1.1741) and spin.unit == "1/m"
        assert sum(name.endswith("creepage") or name.endswith("spin") for name in named) == 12
        said, same = compare.text(one, two, 1e-6)
        assert not same and compare.text(one, one, 1e-6)[1]
    marked = [line for line in said.splitlines() if line.startswith("  *")]
    assert len(marked) == 1 and "trailing inner, lateral creepage" in marked[0]
    assert "curving/contacts/creepage: " in said
