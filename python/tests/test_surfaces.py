"""Pictures of meshes before a run."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from railsqueal import ResultError
from railsqueal.__main__ import main
from railsqueal.pictures import Canvas
from railsqueal.pictures.surfaces import Surfaces, close, draw, node_handles


def written(path: Path) -> Path:
    """A square of two triangles below and a square above, each a group of its own; two contact nodes."""
    with h5py.File(path, "w") as file:
        points = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
        file["VTKHDF/Points"] = np.array(points + [[x, y, 0.5] for x, y, _ in points], float)
        file["VTKHDF/Connectivity"] = np.array([0, 1, 2, 0, 2, 3, 4, 7, 6, 5])
        file["VTKHDF/Offsets"] = np.array([0, 3, 6, 10])
        file["VTKHDF/CellData/body"] = np.array([1, 1, 2])
        file["VTKHDF/CellData/group"] = np.array([0, -1, 1])
        file["surface/group"] = np.array([b"lower contact", b"upper top"])
        file["surface/role"] = np.array([b"contact", b""])
        file["surface/contact_point"] = np.array([[0.0, 0, 0], [0.5, 0, 0.5]])
        file["surface/contact_body"] = np.array([1, 2])
        file["surface/contact_on_face"] = np.array([1, 1], np.int8)
        file["surface/common_grid"] = np.array([0, 0])
    return path


def on_a_grid(path: Path) -> Path:
    """The same with a common grid of 3 by 2 nodes, of which one is beside the upper square."""
    with h5py.File(written(path), "a") as file:
        for name in ("point", "body", "on_face"):
            del file[f"surface/contact_{name}"]
        plan = [[x, y] for y in (-0.5, 0.5) for x in (-0.5, 0.0, 1.5)]
        file["surface/contact_point"] = np.array([[x, y, z] for z in (0.0, 0.5) for x, y in plan])
        file["surface/contact_body"] = np.repeat([1, 2], 6)
        file["surface/contact_on_face"] = np.array([1] * 11 + [0], np.int8)
        file["surface/common_grid"][...] = [3, 2]
    return path


def test_a_common_grid_has_lines_on_each_body(tmp_path: Path) -> None:
    surfaces = Surfaces(on_a_grid(tmp_path / "grid.vtkhdf"))
    for body, height in ((1, 0.0), (2, 0.5)):
        lines = surfaces.lines(body)
        assert [len(line) for line in lines] == [3, 3, 2, 2, 2]
        assert all((line[:, 1] == line[0, 1]).all() for line in lines[:2]) and all(
            (line[:, 0] == line[0, 0]).all() for line in lines[2:]
        )
        assert all((line[:, 2] == height).all() for line in lines)
    labels = [str(handle.get_label()) for handle in node_handles(surfaces)]
    assert labels == ["common grid: 3 x 2 nodes, 1e+03 mm", "upper: 1 of them off its surface"]
    assert draw(tmp_path / "grid.vtkhdf", Canvas(tmp_path, "grid", ("svg",)))[0].exists()


def test_nodes_of_the_meshes_have_no_lines(tmp_path: Path) -> None:
    surfaces = Surfaces(written(tmp_path / "own.vtkhdf"))
    assert surfaces.lines(1) == [] and [handle.get_label() for handle in node_handles(surfaces)] == ["2 contact nodes"]


def test_facets_have_four_corners_and_a_colour(tmp_path: Path) -> None:
    surfaces = Surfaces(written(tmp_path / "a.vtkhdf"))
    assert surfaces.corners.tolist() == [[0, 1, 2, 2], [0, 2, 3, 3], [4, 7, 6, 5]]
    # The last colour is that of facets in no group, which -1 picks.
    assert len(surfaces.colours()) == 3 and len(set(surfaces.colours())) == 3
    assert close(surfaces).all()


def test_they_are_drawn_by_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written(tmp_path / "job.mesh.vtkhdf")
    assert main(["plot", str(file), "--format", "svg"]) == 0
    assert capsys.readouterr().out.split() == [str(tmp_path / "job-surfaces.svg")]


def test_what_is_damaged_is_told(tmp_path: Path) -> None:
    file = written(tmp_path / "b.vtkhdf")
    with h5py.File(file, "a") as open_file:
        del open_file["surface/role"]
    with pytest.raises(ResultError, match="b.vtkhdf.*role"):
        draw(file, Canvas(tmp_path, "b"))
