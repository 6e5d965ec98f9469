"""Uncertain squeal: the sentence, pictures, section and tables of a small made study."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from conftest import dataset
from railsqueal import figures
from railsqueal.pictures import Canvas, draw
from railsqueal.pictures.uncertainty import conditional
from railsqueal.report import csv_tables, uncertainty, write
from railsqueal.result import Result
from railsqueal.uncertainty import Loudness, Uncertainty, named

LOSS = "bodies.upper.damping.modal.by_diameter.2"
MODES = ["971 Hz, upper mode 7 (3, axial 0)", "358 Hz, upper mode 4 (2, axial 0)"]


def study(path: Path, indices: bool = True, cycles: bool = False) -> Path:
    """Eight samples of two inputs, each of four points; the sample 2 failed. Four of them may be followed in time."""
    samples, points = 8, 32
    part = np.tile([0, 1, 2, 3], samples).astype(np.int32)
    friction = np.linspace(0.1, 0.5, points)
    status = np.zeros(points, np.int32)
    status[8] = 4
    growth = np.where(status == 0, 10 * (friction - 0.4), np.nan)
    modes = np.stack([growth, growth - 0.5], axis=1)
    with h5py.File(path, "w") as file:
        dataset(file, "provenance/job", "{}", "-")
        put: dict[str, tuple[Any, str]] = {
            "keys": (["contact.friction", LOSS], "-"),
            "values/contact.friction": (friction, "1"),
            f"values/{LOSS}": (np.full(points, 2e-4), "1"),
            "part": (part, "-"),
            "status": (status, "-"),
            "message": (np.where(status == 0, "", "no equilibrium").astype(object), "-"),
            "unstable": ((growth > 0).astype(np.int64), "1"),
            "growth_rate": (growth, "1/s"),
            "frequency": (np.full(points, 971.0), "Hz"),
            "samples": (16, "1"),
            "failed": (1, "1"),
            "confidence": (0.95, "1"),
            "probability": (0.23, "1"),
            "probability_interval": ([0.21, 0.25], "1"),
            "interval_method": ("the spread of the replicates", "-"),
            "other_probability": (0.01, "1"),
            "levels": ([0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99], "1"),
            "quantiles": (np.linspace(-3, 1, 7), "1/s"),
            "modes/name": (MODES, "-"),
            "modes/own_frequency": ([971.0, 358.0], "Hz"),
            "modes/probability": ([0.19, 0.06], "1"),
            "modes/interval": ([[0.17, 0.21], [0.05, 0.07]], "1"),
            "modes/found": ([1.0, 0.9], "1"),
            "modes/quantiles": (np.tile(np.linspace(-3, 1, 7), (2, 1)), "1/s"),
            "modes/growth_rate": (modes, "1/s"),
        }
        if indices:
            put["indices/first"] = ([0.71, 0.1], "1")
            put["indices/first_interval"] = ([[0.6, 0.8], [0.0, 0.2]], "1")
            put["indices/total"] = ([0.8, 0.2], "1")
            put["indices/total_interval"] = ([[0.7, 0.9], [0.1, 0.3]], "1")
        if cycles:
            put["cycles/sample"] = (np.arange(0, 16, 4), "1")
            put["cycles/fate"] = (np.array([0, 1, 1, -1], np.int8), "-")
            put["cycles/frequency"] = ([0.0, 971.0, 358.0, np.nan], "Hz")
            put["cycles/kinetic"] = ([0.0, 0.2, 0.1, np.nan], "J")
            put["cycles/level_a"] = ([-np.inf, 120.0, 110.0, np.nan], "dB")
            put["cycles/message"] = (["", "", "", "no state of rest"], "-")
        for name, (values, units) in put.items():
            dataset(file, f"uncertainty/{name}", values, units)
    return path


def test_the_outcome_is_a_sentence(tmp_path: Path) -> None:
    with Result(study(tmp_path / "u.h5")) as result:
        table = Uncertainty.from_result(result)
        said = table.sentence({key: named(result, key).name for key in table.keys})
        rows = {f.name: f.value for f in figures.uncertainty(result)}
        loss = named(result, LOSS).name
    assert said == (
        "P(squeal) = 0.23 ± 0.02: 971 Hz 0.19, 358 Hz 0.06; "
        "71 % of the variance of the growth rate is coefficient of friction."
    )
    assert rows["any mode"] == 0.23 and rows[MODES[1]] == 0.06 and rows["failed samples"] == 1
    assert loss.startswith("loss factor for n = 2 nodal diameters")
    assert list(table.random[:5]) == [0, 1, 4, 5, 9]


def test_pictures_and_tables(tmp_path: Path) -> None:
    with Result(study(tmp_path / "u.h5")) as result:
        made = [p.name for p in draw(result, Canvas(tmp_path, "u", resolution=40))]
        # Too few samples for a map, and none followed in time.
        assert made == [f"u-{name}.png" for name in uncertainty.PICTURES[:-2]]
        found = {name: (head, rows) for name, head, rows in csv_tables(result)}
        text = "".join(uncertainty.section(result, {name: f"<{name}>" for name in uncertainty.PICTURES}))
        page, *files = write(result, tmp_path)
    head, rows = found["uncertainty"]
    assert len(rows) == 32 and len(head) == len(rows[0]) and rows[8][-1] == "no equilibrium"
    assert found["uncertainty-indices"][1][0] == ("contact.friction", 0.71, 0.6, 0.8, 0.8, 0.7, 0.9)
    assert [row[0] for row in found["uncertainty-modes"][1]] == ["any", *MODES]
    for part in ("P(squeal) = 0.23 ± 0.02", "no equilibrium", "0.710", "unlike any mode", "<uncertainty-scatter>"):
        assert part in text, part
    assert 'href="#uncertainty"' in page.read_text(encoding="utf-8")
    assert {f.name for f in files} >= {"u-uncertainty.csv", "u-uncertainty-modes.csv", "u-uncertainty-indices.csv"}
    with (tmp_path / "u-uncertainty.csv").open(encoding="utf-8") as file:
        first = next(csv.DictReader(file))
    assert float(first["contact.friction"]) == 0.1 and first["growth_rate_of_971_Hz_1/s"] == repr(10 * (0.1 - 0.4))


def test_without_indices_there_is_no_tornado(tmp_path: Path) -> None:
    with Result(study(tmp_path / "u.h5", indices=False)) as result:
        made = [p.name for p in draw(result, Canvas(tmp_path, "u", resolution=40))]
        assert "u-uncertainty-indices.png" not in made and len(made) == 3
        assert "Influence of the inputs" not in "".join(uncertainty.section(result, {}))


def test_limit_cycles_of_samples_are_shown(tmp_path: Path) -> None:
    with Result(study(tmp_path / "u.h5", cycles=True)) as result:
        made = [p.name for p in draw(result, Canvas(tmp_path, "u", resolution=40))]
        assert made == [f"u-{name}.png" for name in uncertainty.PICTURES if name != "uncertainty-map"]
        of = Loudness.from_result(result)
        found = {name: rows for name, _, rows in csv_tables(result)}
        text = "".join(uncertainty.section(result, {}))
    assert list(of.sorted_levels) == [-np.inf, 110, 120]
    said = "2 of 4 samples followed in time squeal; the median of their levels is 110.0 dB(A), the largest 120.0 dB(A)."
    assert of.sentence() == said and said in text
    assert found["uncertainty-cycles"][1] == (4, 1, 971.0, 0.2, 120.0, "")
    assert found["uncertainty-cycles"][3][-1] == "no state of rest"


def test_probability_is_conditional_on_two_inputs(tmp_path: Path) -> None:
    with Result(study(tmp_path / "u.h5")) as result:
        small = Uncertainty.from_result(result)
        assert small.map() is None
        friction, other = np.meshgrid(np.linspace(0.1, 0.5, 32), np.linspace(1e-4, 3e-4, 32))
        count = friction.size
        table = replace(
            small,
            values={LOSS: other.ravel(), "contact.friction": friction.ravel()},
            part=np.zeros(count, np.int32),
            status=np.zeros(count, np.int32),
            unstable=(friction.ravel() > 0.3).astype(np.int64),
        )
        found = table.map()
        assert found is not None
        keys, (x, y), share = found
        # Squeal hangs on friction alone, at every loss factor.
        assert keys == ("contact.friction", LOSS) and share.shape == (8, 8) and len(x) == len(y) == 9
        assert (share[:, :4] == 0).all() and (share[:, 4:] == 1).all()
        made = conditional(result, table, Canvas(tmp_path, "u", resolution=40))
    assert [p.name for p in made] == ["u-uncertainty-map.png"]
