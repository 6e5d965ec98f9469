"""Opening results and their tables."""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from railsqueal import ComplexModes, ContactGrid, History, Modes, Receptances, Result, ResultError
from railsqueal.tables import growing


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    broken = tmp_path / "broken.h5"
    broken.write_text("no HDF5")
    for path in (broken, tmp_path / "none.h5"):
        with pytest.raises(ResultError, match=path.name) as caught:
            Result(path)
        assert caught.value.code == 3


def test_what_is_not_there_is_said_with_what_is(cylinders: Path) -> None:
    with Result(cylinders) as result:
        for name, part in (
            ("contact/presure", "contact/pressure".split("/")[1]),
            ("nothing", "contact, modes"),
            ("contact", "is a group"),
        ):
            with pytest.raises(ResultError, match=part):
                result[name]
        with pytest.raises(ResultError, match="analyses.receptance"):
            Receptances.from_result(result)
        with pytest.raises(ResultError, match="'middle'.*lower, upper"):
            Modes.from_result(result, "middle")


def test_the_tables_of_a_real_result(cylinders: Path) -> None:
    with Result(cylinders) as result, h5py.File(cylinders) as file:
        grid, modes = ContactGrid.from_result(result), ComplexModes.from_result(result)
        nx, ny = file["contact/shape"][()]
        pressure = file["contact/pressure"][()]
        # Node (i, j) has the index i + nx j, and the pressures over the areas are the normal force.
        assert grid.pressure.shape == (ny, nx) and grid.pressure[2, 3] == pressure[3 + nx * 2]
        assert (grid.pressure * grid.weight).sum() == pytest.approx(-grid.force[2], rel=1e-9)
        assert (grid.traction * grid.weight[..., None]).sum(axis=(0, 1)) == pytest.approx(grid.force[:2], rel=1e-9)
        assert 0 <= grid.stick_share <= 1
        assert np.array_equal(modes.growth_rate, file["stability/growth_rate"][()])
        assert modes.frequency == pytest.approx(file["stability/frequency"][()], rel=1e-12)
        # A result of an earlier program has no flags.
        flags = file["stability/unstable"][()] == 1 if "stability/unstable" in file else growing(modes.eigenvalue)
        assert len(modes.unstable) == flags.sum()
        # A file without the flags is read by the same rule; a rigid motion with its rounding is none.
        assert np.array_equal(growing(modes.eigenvalue), modes.grows)
        assert not growing(np.array([1e-3, 2e-8 + 1e-4j, 1e-9 + 6e3j])).any()
        assert growing(np.array([1588.0, 0.1 + 6e3j])).all()
        assert Modes.from_result(result, "upper").frequency[0] == file["modes/upper/frequency"][0]
        assert result.units("contact/pressure") == "Pa"
        # Largest shares first, with the number of the mode in its body.
        share = file["stability/participation"][0]
        k = int(share.argmax())
        body = int(file["stability/mode_body"][k])
        number = k + 1 if body == 1 else k + 1 - int((file["stability/mode_body"][()] == 1).sum())
        assert modes.made_of(0).startswith(f"{100 * share[k]:.0f} % {('lower', 'upper')[body - 1]} mode {number}")


def test_a_stopped_run_is_joined(transient: Callable[..., Path]) -> None:
    path = transient(segments=3)
    with Result(path) as result:
        assert result.stopped and result.job["title"] == "made"
        history = History.from_result(result)
        assert len(history.time) == 30000 and np.all(np.diff(history.time) > 0)
        assert history.points == ["rim"] and history.velocity is not None and history.velocity.shape == (30000, 1, 3)
        # Areas belong to lines half the way to their neighbours.
        assert result.array("transient/grid/weight").reshape(3, 3)[1] == pytest.approx([0.75e-6, 1.5e-6, 0.75e-6])
        assert "transient/time" in result and "transient/time" in result.names("transient")
    path.write_text("a complete file comes first")
    with pytest.raises(ResultError, match="run.h5"):
        Result(path)
