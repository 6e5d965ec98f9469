"""Pieces are joined, and exported as other programs read them."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from railsqueal import Fields, ResultError, export


def volume(points: Any, faces: Any) -> float:
    """Volume inside a closed surface with outward faces, by the divergence theorem on two triangles a face."""
    p = points[faces]
    return float(sum(np.einsum("ij,ij->", p[:, 0], np.cross(p[:, a], p[:, a + 1])) for a in (1, 2)) / 6)


def test_pieces_share_their_points_and_bodies_do_not(pieces: Path) -> None:
    with Fields(pieces) as fields:
        mesh = fields.mesh
        assert (len(mesh), len(mesh.points)) == (3, 12 + 8)
        # Two cubes side by side have ten faces outside, the one on top of them is a body of its own with six.
        for body, count, size in ((1, 10, 2.0), (2, 6, 1.0), (None, 16, 3.0)):
            faces = mesh.surface(body)
            assert len(faces) == count and volume(mesh.points, faces) == pytest.approx(size, rel=1e-12)
        height = fields.field("height")
        assert np.array_equal(height, mesh.points[:, 0] + 10 * mesh.points[:, 2])
        assert list(mesh.cell_body) == [1, 1, 2]
        with pytest.raises(ResultError, match="pressure.*body, height"):
            fields.field("pressure")
        with pytest.raises(ResultError, match="1 steps"):
            fields.field("height", 1)


def test_a_contact_grid_is_beside_the_bodies(pieces: Path) -> None:
    with h5py.File(pieces, "a") as file:
        root = file["VTKHDF"]
        # A cell on the top of the first cube, corner on corner, as a piece of its own.
        more = {
            "Points": [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
            "PointData/body": [1] * 4,
            "PointData/height": [-7.0] * 4,
            "Connectivity": [0, 1, 2, 3],
            "Offsets": [0, 4],
            "Types": [9],
            "NumberOfPoints": [4],
            "NumberOfCells": [1],
            "NumberOfConnectivityIds": [4],
        }
        for name, values in more.items():
            joined = np.concatenate([root[name][()], np.asarray(values, root[name].dtype)])
            del root[name]
            root[name] = joined
    with Fields(pieces) as fields:
        mesh = fields.mesh
        assert (len(mesh), len(mesh.points)) == (4, 12 + 8 + 4)
        height = fields.field("height")
        (grid,) = mesh.cells(9, 1)
        assert (height[grid] == -7).all() and (height[mesh.cells(12)] != -7).all()
        assert len(mesh.surface(1)) == 10 and volume(mesh.points, mesh.surface(1)) == pytest.approx(2.0, rel=1e-12)


def test_a_file_without_fields_says_how_to_get_them(cylinders: Path) -> None:
    with pytest.raises(ResultError, match="output.fields"):
        Fields(cylinders)


def test_vtu_is_read_by_vtk(pieces: Path, tmp_path: Path) -> None:
    xml = pytest.importorskip("vtkmodules.vtkIOXML")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    (path,) = export.write(pieces, tmp_path / "out", "vtu")
    reader = xml.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    assert (grid.GetNumberOfCells(), grid.GetNumberOfPoints()) == (3, 20)
    points = vtk_to_numpy(grid.GetPoints().GetData())
    assert np.array_equal(vtk_to_numpy(grid.GetPointData().GetArray("height")), points[:, 0] + 10 * points[:, 2])
    corners = [grid.GetCell(2).GetPointId(k) for k in range(8)]
    assert points[corners, 2].tolist() == [0] * 4 + [1] * 4


def test_xdmf_is_read_by_vtk(pieces: Path, tmp_path: Path) -> None:
    xdmf = pytest.importorskip("vtkmodules.vtkIOXdmf2", reason="VTK without XDMF")
    path, heavy = export.write(pieces, tmp_path / "out", "xdmf")
    reader = xdmf.vtkXdmfReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutputDataObject(0)
    while not grid.IsA("vtkUnstructuredGrid"):
        grid = grid.GetBlock(0)
    assert heavy.exists() and (grid.GetNumberOfCells(), grid.GetNumberOfPoints()) == (3, 20)
