"""Branches of limit cycles: their table, diagram, section of the report and values separated by commas."""

import csv
from pathlib import Path

import h5py
import numpy as np
from conftest import dataset
from railsqueal import Result, export
from railsqueal.pictures import Canvas, branches
from railsqueal.report import branches as section
from railsqueal.tables import Branches


def result(path: Path) -> Path:
    """Two branches: one that turns back at a fold, with an unstable part, and one of two cycles."""
    key = [0.30, 0.25, 0.24, 0.26, 0.30, 0.35]
    count = len(key)
    with h5py.File(path, "w") as file:
        dataset(file, "cycles/along", ["contact.friction"], "-")
        dataset(file, "cycles/key", key)
        dataset(file, "cycles/frequency", np.linspace(420.0, 425.0, count), "Hz")
        dataset(file, "cycles/kinetic", [0.3, 0.2, 0.1, 0.05, 0.7, 0.8], "J")
        dataset(file, "cycles/stick", np.full((count, 2), 0.1))
        dataset(file, "cycles/normal", np.full((count, 2), 7e4), "N")
        dataset(file, "cycles/force_rms", np.ones((count, 3)), "N")
        velocity = np.zeros((count, 2, 3))
        velocity[:, 1, 1], velocity[:, 0, 2] = 0.03, 0.01
        dataset(file, "cycles/velocity_rms", velocity, "m/s")
        dataset(file, "cycles/multiplier", np.full((count, 12), 0.9 + 0j))
        dataset(file, "cycles/unstable", [0, 0, 0, 1, 0, 0])
        dataset(file, "cycles/special", ["", "", "fold", "", "", ""], "-")
        dataset(file, "cycles/second_frequency", np.zeros(count), "Hz")
        dataset(file, "cycles/special_error", [np.nan, np.nan, 3e-7, np.nan, np.nan, np.nan])
        dataset(file, "cycles/branch", [0, 0, 0, 0, 1, 1])
        dataset(file, "cycles/start", [0, 4])
        dataset(file, "cycles/origin", ["unstable mode 1", "unstable mode 2"], "-")
        ends = [["at the end of the range", "at rest"], ["at rest", "at the end of the range"]]
        dataset(file, "cycles/end", ends, "-")
        dataset(file, "cycles/onset/key", [0.27, 0.29])
        dataset(file, "cycles/onset/frequency", [421.0, 600.0], "Hz")
        dataset(file, "cycles/onset/above", [1, 1])
        dataset(file, "cycles/onset/mode", [0, 1])
        dataset(file, "cycles/onset/criticality", [-1, 1])
        dataset(file, "cycles/sound_power/upper/total_level_a", np.linspace(100.0, 105.0, count), "dB")
    return path


def test_branches_have_rows_of_their_own(tmp_path: Path) -> None:
    with Result(result(tmp_path / "a.h5")) as found:
        table = Branches.from_result(found)
    assert table.places(0) == [0, 1, 2, 3] and table.places(1) == [4, 5]
    assert table.end == [["at the end of the range", "at rest"], ["at rest", "at the end of the range"]]
    assert np.allclose(table.velocity(), 0.03)
    loudest = table.loudest()
    assert loudest is not None and loudest[-1] == 105.0


def test_diagram_and_section_show_both_branches(tmp_path: Path) -> None:
    with Result(result(tmp_path / "a.h5")) as found:
        made = branches.pictures(found, Canvas(tmp_path, "a", ["png"], 40))
        parts = "".join(section.section(found, {"branches": "<img>"}))
    assert [p.name for p in made] == ["a-branches.png"] and made[0].stat().st_size > 0
    # The second mode does not start by itself: another one grows already.
    assert parts.count("unstable mode") == 4 and "0.270000" in parts and "0.290000" not in parts and "fold" in parts
    assert "subcritical" in parts and "supercritical" not in parts and parts.count("3.0e−07") == 1


def test_export_writes_a_row_for_each_cycle(tmp_path: Path) -> None:
    (made,) = export.write(result(tmp_path / "a.h5"), tmp_path / "out", "csv")
    assert made.name == "a-branches.csv"
    with made.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6 and rows[0]["branch"] == "0" and rows[5]["branch"] == "1"
    assert float(rows[1]["contact_friction"]) == 0.25 and rows[2]["special"] == "fold" and rows[3]["unstable"] == "1"
    assert float(rows[5]["level_upper_dB(A)"]) == 105.0 and float(rows[0]["velocity_rms_m/s"]) == 0.03
