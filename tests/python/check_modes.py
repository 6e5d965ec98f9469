"""The complex modes of a run, read with h5py and with VTK's own reader.

usage: check_modes.py FILE.h5 INNER_RADIUS OUTER_RADIUS
"""

import sys

import h5py
import numpy as np
from documented import undocumented
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersCore import vtkAppendFilter
from vtkmodules.vtkIOHDF import vtkHDFReader


def steps(path):
    """Points, body of each point and motion at each step of the file."""
    reader = vtkHDFReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    count = reader.GetNumberOfSteps()
    motions = []
    for step in range(count):
        reader.SetStep(step)
        reader.Update()
        grid = reader.GetOutputDataObject(0)
        if not grid.IsA("vtkUnstructuredGrid"):  # several pieces come as a collection
            append = vtkAppendFilter()
            for piece in range(grid.GetNumberOfPartitions()):
                append.AddInputData(grid.GetPartition(piece))
            append.Update()
            grid = append.GetOutput()
        motions.append(vtk_to_numpy(grid.GetPointData().GetArray("motion")).astype(float))
    points = vtk_to_numpy(grid.GetPoints().GetData()).astype(float)
    body = vtk_to_numpy(grid.GetPointData().GetArray("body"))
    return points, body, np.array(motions)


def main(path, inner_radius, outer_radius):
    sequence = path.replace(".h5", ".modes.vtkhdf")
    faults = undocumented(sequence) + undocumented(path)
    assert not faults, "\n".join(faults)
    points, body, motions = steps(sequence)
    with h5py.File(path) as file, h5py.File(sequence) as modes:
        stability = file["stability"]
        shape = stability["shape"][...]
        growth = stability["growth_rate"][...][shape]
        eigenvalue = modes["modes/eigenvalue"][...]
        phase = modes["modes/phase"][...]
        assert np.allclose(modes["modes/growth_rate"][...], stability["growth_rate"][...][eigenvalue])
        assert np.allclose(modes["modes/frequency"][...], stability["frequency"][...][eigenvalue])
        assert np.allclose(stability["body_energy"][...].sum(axis=1), 1, atol=1e-12)
        assert np.allclose(stability["contact_motion"][...].sum(axis=(1, 2)), 1, atol=1e-12)
        # Damping and work of the contact forces make up the growth rate: of a recovered mode as well, whose residual
        # part is static.
        parts = stability["growth_parts"][...]
        worst = np.abs(parts.sum(axis=1) - growth).max()
        assert worst < 1e-5 * np.abs(parts).max(), f"growth rates {growth}, parts {parts}"
        assert (parts[:, :2] < 0).all(), parts
        rates = stability["growth_rate"][...]
        source = stability["source"].asstr()[...][shape]
        assert len(set(source)) == 1
        of_source = rates[stability["source"].asstr()[...] == source[0]]
        assert len(shape) >= max(3, (of_source > 0).sum()), shape
    phases = len(motions) // len(shape)
    assert len(motions) == len(shape) * phases and phases % 4 == 0
    quarter = phases // 4
    for k in range(len(shape)):
        mode = motions[k * phases : (k + 1) * phases]
        assert (eigenvalue[k * phases : (k + 1) * phases] == shape[k]).all()
        assert abs(np.abs(mode[0]).max() - 1) < 1e-6, np.abs(mode[0]).max()
        assert np.abs(mode[0] + mode[2 * quarter]).max() < 1e-6
        turn = 2 * np.pi * phase[k * phases + 1]
        assert np.abs(mode[1] - np.cos(turn) * mode[0] - np.sin(turn) * mode[quarter]).max() < 1e-6
        # The supports hold; the bodies stay in touch at the contact point and slide on each other.
        relative = {}
        for b in (1, 2):
            mine = np.flatnonzero(body == b)
            place = points[mine]
            nearest = mine[np.argmin((place**2).sum(axis=1))]
            relative[b] = mode[0][nearest] + 1j * mode[quarter][nearest]
            axis = -outer_radius if b == 1 else outer_radius
            radius = np.hypot(place[:, 0], place[:, 2] - axis)
            ring = mine[np.abs(radius - inner_radius) < 1e-6 + 1e-3 * inner_radius]
            assert len(ring) > 10, f"body {b}: axis at {axis}"
            assert np.abs(mode[:, ring]).max() < 1e-7
        opening = relative[2][2] - relative[1][2]
        sliding = relative[2][1] - relative[1][1]
        assert abs(opening) < 1e-6, (opening, relative)
        assert abs(sliding) > 1e-4, (sliding, relative)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), float(sys.argv[3]))
