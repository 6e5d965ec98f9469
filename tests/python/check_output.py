"""Reads the files of tests/output.rs with h5py and with VTK's own reader.

usage: check_output.py FILE.h5 RANKS [few]
"""

import sys

import h5py
import numpy as np
from documented import undocumented
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkDataObject
from vtkmodules.vtkFiltersCore import vtkAppendFilter, vtkThreshold
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter, vtkMeshQuality
from vtkmodules.vtkIOHDF import vtkHDFReader

SIZE = np.array([0.3, 0.2, 0.25])
BOXES = {1: 0.0, 2: -0.01}  # top of each box in lower form


def displacement(points, body):
    """Data given to the writer, in the frame of the contact."""
    x, y, z = points.T.copy()
    sign = np.where(body == 2, -1.0, 1.0)
    z = sign * z
    return np.column_stack([1e-3 * x + 2e-3 * y, 1e-3 * z, sign * (5e-3 * z + 1e-3 * x * y)])


def check_attributes(file):
    def visit(name, item):
        if isinstance(item, h5py.Dataset):
            for key in ("units", "description"):
                assert key in item.attrs, f"{name} has no {key}"
                assert isinstance(item.attrs[key], str) and item.attrs[key], f"{name}: {key} is {item.attrs[key]!r}"

    file.visititems(visit)
    kind = file["VTKHDF"].attrs.get_id("Type").get_type()
    assert isinstance(kind, h5py.h5t.TypeStringID) and not kind.is_variable_str(), "Type is not of fixed length"
    assert kind.get_cset() == h5py.h5t.CSET_ASCII, "Type is not ASCII"
    assert file["VTKHDF"].attrs["Type"] == b"UnstructuredGrid", file["VTKHDF"].attrs["Type"]


def read(path, step=None):
    reader = vtkHDFReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    if step is not None:
        assert reader.GetHasTransientData() if hasattr(reader, "GetHasTransientData") else reader.GetHasTemporalData()
        reader.SetStep(step)
    reader.Update()
    grid = reader.GetOutputDataObject(0)
    if not grid.IsA("vtkUnstructuredGrid"):  # several pieces come as a collection
        append = vtkAppendFilter()
        pieces = [grid.GetPartition(i) for i in range(grid.GetNumberOfPartitions())]
        for piece in pieces:
            append.AddInputData(piece)
        append.Update()
        grid = append.GetOutput()
    return grid


def arrays(data):
    return {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)) for i in range(data.GetNumberOfArrays())}


def threshold(data):
    """Cells of which all points have a state from 0 to 2."""
    chosen = vtkThreshold()
    chosen.SetInputData(data)
    chosen.SetInputArrayToProcess(0, 0, 0, vtkDataObject.FIELD_ASSOCIATION_POINTS, "state")
    chosen.SetLowerThreshold(0)
    chosen.SetUpperThreshold(2)
    chosen.SetThresholdFunction(vtkThreshold.THRESHOLD_BETWEEN)
    chosen.AllScalarsOn()
    chosen.Update()
    return chosen.GetOutput().GetNumberOfCells()


def check_volume(grid):
    quality = vtkCellSizeFilter()
    quality.SetInputData(grid)
    quality.ComputeVolumeOn()
    quality.Update()
    volume = vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Volume"))
    assert np.all(volume > 0), f"{(volume <= 0).sum()} cells are inside out"
    mesh = vtkMeshQuality()
    mesh.SetInputData(grid)
    mesh.SetHexQualityMeasureToScaledJacobian()
    mesh.Update()
    jacobian = vtk_to_numpy(mesh.GetOutput().GetCellData().GetArray("Quality"))
    assert np.all(jacobian > 0.99), f"scaled Jacobian down to {jacobian.min()}"
    assert abs(volume.sum() - 2 * SIZE.prod()) < 1e-12, volume.sum()


def main():
    path, ranks, few = sys.argv[1], int(sys.argv[2]), "few" in sys.argv[3:]
    layers = 1 if few else 6
    with h5py.File(path) as file:
        check_attributes(file)
        assert list(file["VTKHDF"].attrs["Version"]) == [1, 0]
        assert len(file["VTKHDF/NumberOfPoints"]) == ranks
        assert file["VTKHDF/NumberOfCells"][...].sum() == 2 * layers * 4 * 5
        assert np.array_equal(file["stability/eigenvalue"][...], [1 - 2j, 1 + 2j])
        assert file["stability/eigenvalue"].dtype.names is None  # h5py takes {r, i} as complex
        assert file["contact/traction"].shape == (4, 2)
        assert file["history/force"].maxshape == (None, 3)
        assert file["large"].compression == "gzip" and np.all(file["large"][...] == 0.5)
        assert file["provenance/job"].asstr()[()] == '{"version":1}'
        assert file["provenance/ranks"][()] == ranks
        assert file["provenance/input_files"].shape == (0,)

    faults = undocumented(path, ignore=["stability/", "history/", "large"])
    faults += undocumented(path.replace(".h5", ".free_modes.vtkhdf"))
    assert not faults, "\n".join(faults)

    grid = read(path)
    assert grid.GetNumberOfCells() == 2 * layers * 4 * 5, grid.GetNumberOfCells()
    check_volume(grid)
    points = vtk_to_numpy(grid.GetPoints().GetData())
    data = arrays(grid.GetPointData())
    body = data["body"]
    for number, top in BOXES.items():
        z = points[body == number][:, 2] * (1 if number == 1 else -1)
        assert abs(z.max() - top) < 1e-15 and abs(z.min() - top + SIZE[2]) < 1e-15, (number, z.min(), z.max())
    error = np.abs(data["displacement"] - displacement(points, body)).max()
    assert error < 1e-18, f"displacement differs by {error}"
    assert np.allclose(data["von_mises"], 1e6 * np.abs(points[:, 0]), rtol=1e-14, atol=0)

    # Contact fields sit at the four named surface nodes of each body, and nowhere else.
    x = SIZE[0] * (np.arange(layers + 1) / layers - 0.5)
    y = SIZE[1] * (np.arange(5) / 4 - 0.5)
    pressure, traction = [1e8, 2e8, 3e8, 0], [[1e7, 0, 0], [0, 2e7, 0], [1e6, -1e6, 0], [0, 0, 0]]
    state = [1, 2, 2, 0]
    seen = np.zeros(len(points), bool)
    for number, top in BOXES.items():
        sign = 1 if number == 1 else -1
        for k in range(4):
            at = [x[layers // 2 + k % 2], y[2 + k // 2], sign * top]
            here = (body == number) & (np.abs(points - at).max(axis=1) < 1e-12)
            assert here.any(), f"no point at {at}"
            assert np.all(data["pressure"][here] == pressure[k]) and np.all(data["state"][here] == state[k])
            assert np.all(data["traction"][here] == traction[k])
            seen |= here
    assert np.all(data["pressure"][~seen] == 0) and np.all(data["traction"][~seen] == 0)
    assert np.all(data["state"][~seen] == -1)

    # The four nodes are the corners of one face of each body: what docs/reference/output.md says of the contact in
    # ParaView shows it, and of the bodies themselves nothing.
    assert threshold(grid) == 0
    surface = vtkGeometryFilter()
    surface.SetInputData(grid)
    surface.Update()
    assert threshold(surface.GetOutput()) == 2

    cells = arrays(grid.GetCellData())
    assert set(np.unique(cells["body"])) == {1, 2}
    assert set(np.unique(cells["rank"])) <= set(range(ranks))
    if not few:
        assert set(np.unique(cells["rank"])) == set(range(ranks))

    check_sequence(path.replace(".h5", ".transient.vtkhdf"), "velocity", [0.1, 0.25, 0.4], [1, 2], [0.1, 0.25, 0.4])
    modes = path.replace(".h5", ".free_modes.vtkhdf")
    for body, steps, factors in ((1, [0, 1], [100, 250, 0]), (2, [2], [0, 0, 400])):
        check_sequence(modes, "shape", [1, 2, 3], [body], factors)
        with h5py.File(modes) as file:
            assert np.all(file["modes/body"][steps] == body)
            assert np.array_equal(file["modes/frequency"][...], [100, 250, 400])


def check_sequence(path, name, values, bodies, factors):
    with h5py.File(path) as file:
        check_attributes(file)
        assert list(file["VTKHDF"].attrs["Version"]) == [2, 0]
        assert file["VTKHDF/Steps"].attrs["NSteps"] == len(values)
        assert list(file["VTKHDF/Steps/Values"]) == values
    for step, factor in enumerate(factors):
        grid = read(path, step)
        check_volume(grid)
        points = vtk_to_numpy(grid.GetPoints().GetData())
        data = arrays(grid.GetPointData())
        here = np.isin(data["body"], bodies)
        expected = factor * displacement(points, data["body"])[here]
        error = np.abs(data[name][here] - expected).max()
        assert error <= 1e-6 * np.abs(expected).max(), f"{path}, step {step}: {name} differs by {error}"


if __name__ == "__main__":
    main()
