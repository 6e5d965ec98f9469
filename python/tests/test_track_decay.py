"""Track decay rates: picture, table and report, and measured ones beside them."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from conftest import dataset
from railsqueal import Result, ResultError
from railsqueal.__main__ import main
from railsqueal.measured import Measurements
from railsqueal.pictures import Canvas, draw
from railsqueal.report.csv_tables import csv_tables
from railsqueal.track_decay import LIMITS, MeasuredDecay, TrackDecay

BANDS = [250, 315, 400, 500, 630, 800, 1000, 1250, 1600, 2000, 2500, 3150, 4000, 5000]


@pytest.fixture
def decayed(tmp_path: Path) -> Path:
    path = tmp_path / "rail.h5"
    with h5py.File(path, "w") as file:
        dataset(file, "track_decay/frequency", np.array(BANDS, float), "Hz")
        dataset(file, "track_decay/position", np.arange(29) * 1.0, "m")
        dataset(file, "track_decay/least", 0.11, "dB/m")
        for name in LIMITS:
            dataset(file, f"track_decay/{name}", np.array(LIMITS[name]) * 1.5, "dB/m")
            dataset(file, f"track_decay/response/{name}", np.ones((14, 29)))
        dataset(file, "provenance/job", '{"title": "rail"}', "-")
    return path


def test_measured_rates_beside_computed_ones(tmp_path: Path, decayed: Path, capsys: Any) -> None:
    table = tmp_path / "measured.csv"
    table.write_text("frequency [Hz];vertical [dB/m];lateral [dB/m]\n250;2,1;1,9\n315;2,5;1,2\n1000;0,9;0,3\n")
    measured = MeasuredDecay.read(table)
    assert measured.frequency.tolist() == [250, 315, 1000] and measured.rate["lateral"].tolist() == [1.9, 1.2, 0.3]
    with Result(decayed) as result:
        assert TrackDecay.from_result(result).rate["vertical"][2] == 9.0
        made = draw(result, Canvas(tmp_path, "rail", resolution=40), measured=Measurements(decay=measured))
        rows = {name: (head, rows) for name, head, rows in csv_tables(result)}
    assert [p.name for p in made] == ["rail-track-decay.png"]
    assert rows["track-decay"][0] == ("band_Hz", "vertical_dB/m", "lateral_dB/m") and len(rows["track-decay"][1]) == 14
    assert main(["report", str(decayed), "--decay", str(table)]) == 0
    assert "Track decay rates" in (tmp_path / "rail-report.html").read_text(encoding="utf-8")
    with h5py.File(decayed, "a") as file:
        del file["track_decay"]
    assert main(["plot", str(decayed), "--decay", str(table)]) == 3
    assert "analyses.track_decay" in capsys.readouterr().err


@pytest.mark.parametrize(
    "text, words",
    [
        ("250;2.1\n315;2.5\n400;3\n", "no names of columns"),
        ("frequency;vertical;axial\n250;2.1;1\n315;2.5;1\n", "found the column 'axial'"),
        ("frequency;vertical [1/m]\n250;2.1\n315;2.5\n", "in 1/m"),
        ("vertical;lateral\n250;2.1\n315;2.5\n", "found the columns vertical, lateral"),
        ("frequency;vertical\n315;2.1\n250;2.5\n", "do not rise"),
        ("frequency;vertical\n250;2.1\n315;0\n", "line 3: a decay rate of 0.0 dB/m"),
    ],
)
def test_other_tables_are_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text(text)
    with pytest.raises(ResultError, match=words) as error:
        MeasuredDecay.read(path)
    assert error.value.code == 3 and "t.csv" in str(error.value)
