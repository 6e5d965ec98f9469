"""Several contacts of a wheel: each has its figures, pictures, rows and comparison."""

import csv
import json
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import dataset
from railsqueal import ContactGrid, Result, ResultError, compare, figures, report
from railsqueal.measured.overlay import Overlay
from railsqueal.pictures import Canvas, draw
from railsqueal.tables import Receptances, contact_name, friction_law


@pytest.fixture
def two(cylinders: Path, tmp_path: Path) -> Path:
    """The contact of two cylinders, and a second one with half of its pressure and force."""
    path = tmp_path / "two.h5"
    shutil.copy(cylinders, path)
    with h5py.File(path, "a") as file:
        file.copy("contact", "contact_2")
        for name in ("pressure", "force"):
            file[f"contact_2/{name}"][...] = 0.5 * file[f"contact/{name}"][()]
        for group, creepage in (("placement", 0.01), ("placement_2", 0.02)):
            dataset(file, f"{group}/creepage", np.array([0.0, creepage, 0.0]))
        del file["stability/force"]
        dataset(file, "stability/force", np.array([[1.0, 2.0, -3.0], [4.0, 5.0, -6.0]]), "N")
    return path


def test_each_contact_has_its_grid_and_its_figures(two: Path) -> None:
    with Result(two) as result:
        assert ContactGrid.groups(result) == ["contact", "contact_2"]
        first, second = (ContactGrid.from_result(result, group) for group in ContactGrid.groups(result))
        assert np.array_equal(second.pressure, 0.5 * first.pressure) and second.force[2] == 0.5 * first.force[2]
        said = {(f.group, f.name): f.value for f in figures.figures_of_result(result)}
    assert said["steady rolling", "largest pressure"] == 2 * said["steady rolling, contact 2", "largest pressure"]
    assert said["placement, contact 2", "lateral creepage"] == 2 * said["placement", "lateral creepage"]


def test_each_contact_has_its_pictures_but_an_open_one(two: Path, tmp_path: Path) -> None:
    def drawn() -> set[str]:
        with Result(two) as result:
            made = draw(result, Canvas(tmp_path / "out", result.stem, resolution=30))
        return {p.stem.removeprefix("two-") for p in made if "contact" in p.stem}

    assert drawn() == {"contact-line", "contact-map", "contact-line-2", "contact-map-2"}
    with h5py.File(two, "a") as file:
        file["contact_2/state"][...] = 0
    assert drawn() == {"contact-line", "contact-map"}


def test_report_names_the_contacts(two: Path, tmp_path: Path) -> None:
    with Result(two) as result:
        page, *tables = report.write(result, tmp_path / "out")
        force = result.array("contact_2/force")
    assert "Stick and slip, traction and pressure, contact 2" in page.read_text(encoding="utf-8")
    (path,) = [p for p in tables if p.stem.endswith("-forces")]
    with path.open(encoding="utf-8") as file:
        rows = {(row["analysis"], row["point"]): row for row in csv.DictReader(file)}
    assert float(rows["steady", "contact 2"]["force_z_N"]) == force[2]
    assert float(rows["stability", "contact 2"]["force_x_N"]) == 4.0


def test_names_and_frictions_are_those_of_each_contact(two: Path, tmp_path: Path) -> None:
    with h5py.File(two, "a") as file:
        job = {"contact": {"friction": 0.4, "friction_zones": [{"from_angle": 0.5, "friction": 0.1}]}}
        dataset(file, "provenance/job", json.dumps(job))
        for group, zone in (("placement", -1), ("placement_2", 0)):
            dataset(file, f"{group}/friction_zone", np.int32(zone))
        dataset(file, "contacts/name", ["tread", "flange"])
    with Result(two) as result:
        assert [friction_law(result, number) for number in (1, 2)] == [0.4, 0.1]
        assert contact_name(result, 2) == "contact 2 (flange)"
        _, *tables = report.write(result, tmp_path / "out")
    (path,) = [p for p in tables if p.stem.endswith("-forces")]
    with path.open(encoding="utf-8") as file:
        points = {row["point"] for row in csv.DictReader(file) if row["analysis"] == "steady"}
    assert points == {"contact 1 (tread)", "contact 2 (flange)"}


def test_second_contacts_are_compared(two: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.h5"
    shutil.copy(two, other)
    with h5py.File(other, "a") as file:
        file["contact_2/gap"][...] *= 1.01
    with Result(two) as a, Result(other) as b:
        text, same = compare.text(a, b, 1e-6)
    assert not same and "contact_2/gap" in text


def test_a_creep_curve_has_the_forces_of_each_contact(two: Path, tmp_path: Path) -> None:
    with h5py.File(two, "a") as file:
        for group, change in (("creep_curve", 0.0), ("creep_curve_2", -0.004)):
            eta = np.array([0.002, 0.004, 0.01]) + change
            force = np.stack([0 * eta, -100 * np.tanh(500 * eta), np.full(3, -1000.0)], axis=1)
            dataset(file, f"{group}/lateral", eta)
            dataset(file, f"{group}/force", force, "N")
            dataset(file, f"{group}/stick_share", np.array([0.5, 0.2, 0.0]))
        dataset(file, "creep_curve/status", np.zeros(3, dtype=np.int32))
    with Result(two) as result:
        made = draw(result, Canvas(tmp_path / "out", result.stem, resolution=30))
        page, *tables = report.write(result, tmp_path / "report")
    assert [p.stem for p in made if "creep" in p.stem] == ["two-creep-curve"]
    (path,) = [p for p in tables if p.stem.endswith("-forces")]
    with path.open(encoding="utf-8") as file:
        rows = {row["point"]: row for row in csv.DictReader(file) if row["analysis"] == "creep_curve"}
    assert len(rows) == 6
    assert float(rows["contact 2, lateral 0.0"]["force_y_N"]) == 0.0
    assert float(rows["lateral 0.01"]["force_y_N"]) == pytest.approx(-100 * np.tanh(5))


def test_each_contact_has_its_receptances(two: Path, tmp_path: Path) -> None:
    frequency = np.array([0.0, 500.0])
    with h5py.File(two, "a") as file:
        for group, factor in (("receptance", 1.0), ("receptance_2", 3.0)):
            dataset(file, f"{group}/frequency", frequency, "Hz")
            for body in ("lower", "upper"):
                h = factor * np.full((2, 3, 3), 1e-9 - 1e-10j)
                dataset(file, f"{group}/{body}", h, "m/N")
    with Result(two) as result:
        assert Receptances.groups(result) == ["receptance", "receptance_2"]
        ratio = (
            Receptances.from_result(result, "receptance_2").bodies["upper"]
            / Receptances.from_result(result).bodies["upper"]
        )
        made = draw(result, Canvas(tmp_path / "out", result.stem, resolution=30))
        _, *tables = report.write(result, tmp_path / "out")
        with pytest.raises(ResultError, match="expected one"):
            Overlay.expect_one_contact(result)
    assert np.allclose(ratio, 3.0)
    assert {p.stem for p in made} >= {"two-receptance", "two-receptance-2"}
    assert {p.stem for p in tables} >= {"two-receptance", "two-receptance-2"}
