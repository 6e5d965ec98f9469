"""Groups of a result as xarray datasets."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import dataset
from railsqueal import Result, ResultError
from railsqueal.named import dataset as named


def test_dimensions_have_their_names(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        for name, values, labels in (
            ("eigenvalue", np.arange(3) * 1j, ["eigenvalue"]),
            ("participation", np.arange(6.0).reshape(3, 2), ["eigenvalue", "mode"]),
            ("mode_frequency", [100.0, 200.0], ["mode"]),
            ("source", ["reduced", "reduced", "full"], ["eigenvalue"]),
            ("approach", 1e-5, []),
            ("unnamed", np.zeros((3, 4)), ["eigenvalue", ""]),
            ("other", np.zeros(7), ["eigenvalue"]),
        ):
            dataset(file, f"stability/{name}", values, "Hz" if name == "mode_frequency" else "1")
            for axis, label in enumerate(labels):
                file[f"stability/{name}"].dims[axis].label = label
        dataset(file, "stability/point/polach/force", [1.0, 2.0], "N")
    with Result(path) as result:
        table = named(result, "stability")
        assert result.dimensions("stability/participation") == ["eigenvalue", "mode"]
        with pytest.raises(ResultError, match="it has stability, stability/point/polach"):
            named(result, "modes")
    assert table["participation"].dims == ("eigenvalue", "mode")
    assert table["unnamed"].dims == ("eigenvalue", "unnamed_1")
    assert table["other"].dims == ("other_0",) and table["approach"].dims == ()
    # The eigenvalues are the coordinates of their dimension.
    assert table.participation.sel(eigenvalue=2j).values.tolist() == [4.0, 5.0]
    assert table["mode_frequency"].attrs["units"] == "Hz" and table["source"].values[2] == "full"
    assert "point" not in table


def test_files_without_labels_have_numbered_dimensions(cylinders: Path) -> None:
    with Result(cylinders) as result:
        table = named(result, "contact")
    assert table["traction"].dims == ("traction_0", "traction_1")
