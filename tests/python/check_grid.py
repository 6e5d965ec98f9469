"""Reads the contact fields of meshes that meet on a common grid with VTK's own reader.

usage: check_grid.py FILE.h5 RANKS [displacement]
"""

import sys

import h5py
import numpy as np
from check_output import arrays, read, threshold
from documented import undocumented
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import VTK_QUAD, vtkDataObject
from vtkmodules.vtkFiltersCore import vtkThreshold
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkFiltersParallel import vtkIntegrateAttributes


def of_body(data, number):
    """Cells of a body."""
    chosen = vtkThreshold()
    chosen.SetInputData(data)
    chosen.SetInputArrayToProcess(0, 0, 0, vtkDataObject.FIELD_ASSOCIATION_CELLS, "body")
    chosen.SetLowerThreshold(number)
    chosen.SetUpperThreshold(number)
    chosen.SetThresholdFunction(vtkThreshold.THRESHOLD_BETWEEN)
    chosen.Update()
    return chosen.GetOutput()


def main():
    path, ranks, moved = sys.argv[1], int(sys.argv[2]), "displacement" in sys.argv[3:]
    unlisted = undocumented(path)
    assert not unlisted, unlisted
    with h5py.File(path) as file:
        assert len(file["VTKHDF/NumberOfPoints"]) == ranks + 1
        nx, ny = file["contact/shape"][()]
        wanted = {name: file[f"contact/{name}"][()] for name in ("x", "y", "pressure", "traction", "state", "force")}
    grid = read(path)
    fields = arrays(grid.GetPointData())
    names = {"pressure", "traction", "state", "body"} | ({"displacement", "von_mises"} if moved else set())
    assert set(fields) == names, set(fields)
    assert all(np.isfinite(values).all() for values in fields.values())
    types = np.array([grid.GetCellType(i) for i in range(grid.GetNumberOfCells())])
    cells = (nx - 1) * (ny - 1)
    assert (types == VTK_QUAD).sum() == 2 * cells, (types == VTK_QUAD).sum()
    # The nodes of the grid are the last points, first those of the lower body; all others are on no grid, and free.
    n, points = nx * ny, vtk_to_numpy(grid.GetPoints().GetData())
    rest = slice(0, len(points) - 2 * n)
    assert (
        (fields["state"][rest] == -1).all()
        and (fields["pressure"][rest] == 0).all()
        and (fields["traction"][rest] == 0).all()
    )
    for body in (1, 2):
        own = slice(len(points) - (3 - body) * n, len(points) - (2 - body) * n)
        assert (fields["body"][own] == body).all()
        for name in ("pressure", "state"):
            assert np.array_equal(fields[name][own], wanted[name]), name
        assert np.allclose(points[own, 0], wanted["x"], atol=1e-12) and np.allclose(
            points[own, 1], wanted["y"], atol=1e-12
        )
        assert (
            np.allclose(fields["traction"][own, :2], wanted["traction"], rtol=1e-14, atol=0)
            and (fields["traction"][own, 2] == 0).all()
        )
        if moved:
            # The surfaces are pressed away from each other where the pressure is.
            most = np.argmax(wanted["pressure"])
            assert (fields["displacement"][own][most, 2] < 0) == (body == 1)
            assert fields["von_mises"][own].max() > 0.1 * wanted["pressure"].max()
    # What docs/reference/output.md says for ParaView: the surface, points on the grid.
    surface = vtkGeometryFilter()
    surface.SetInputData(grid)
    surface.Update()
    assert threshold(surface.GetOutput()) == 2 * cells, threshold(surface.GetOutput())
    for body in (1, 2):
        chosen = vtkThreshold()
        chosen.SetInputData(of_body(surface.GetOutput(), body))
        chosen.SetInputArrayToProcess(0, 0, 0, vtkDataObject.FIELD_ASSOCIATION_POINTS, "state")
        chosen.SetLowerThreshold(0)
        chosen.SetUpperThreshold(2)
        chosen.SetThresholdFunction(vtkThreshold.THRESHOLD_BETWEEN)
        chosen.AllScalarsOn()
        integral = vtkIntegrateAttributes()
        integral.SetInputConnection(chosen.GetOutputPort())
        integral.Update()
        found = arrays(integral.GetOutput().GetPointData())
        load = -wanted["force"][2]
        sides = found["traction"][0, :2] - wanted["force"][:2]
        print(
            f"body {body}: integral of pressure {found['pressure'][0]:.6e} N, normal force {load:.6e} N, tangential "
            f"{found['traction'][0, :2]}, {wanted['force'][:2]} N"
        )
        # Slopes of the surface in the contact are some hundredths: cells are larger than in plan by half the square of
        # them.
        assert abs(found["pressure"][0] / load - 1) < 1e-3 and (abs(sides) < 1e-3 * load).all()


main()
