"""Stiffness and mass of a clamped body by dolfinx, on the mesh of a railsqueal result file.

Written for dolfinx 0.5 (Debian 12: python3-dolfinx-real). Needs h5py where the file is read: rank 0.
"""

import json

import h5py
import numpy as np
import ufl
from dolfinx import fem, mesh
from petsc4py import PETSc


def read(path):
    """Points, hexahedra and the job of a result file of the built-in cylinder, its pieces joined."""
    with h5py.File(path) as f:
        job = json.loads(f["provenance/job"][()])
        grid = f["VTKHDF"]
        pieces = grid["NumberOfCells"].shape[0]
        start = np.concatenate([[0], np.cumsum(grid["NumberOfPoints"][:])])
        cell0 = np.concatenate([[0], np.cumsum(grid["NumberOfCells"][:])])
        conn = grid["Connectivity"][:].reshape(-1, 8)
        for p in range(pieces):
            conn[cell0[p] : cell0[p + 1]] += start[p]
        points, back = np.unique(np.round(grid["Points"][:], 9), axis=0, return_inverse=True)
        cells = back[conn].astype(np.int64)[:, [0, 1, 3, 2, 4, 5, 7, 6]]
    return points, cells, job


def distributed(comm, path):
    """The mesh on all ranks, and the job."""
    points, cells, job = read(path) if comm.rank == 0 else (np.empty((0, 3)), np.empty((0, 8), dtype=np.int64), None)
    return mesh.create_mesh(comm, cells, points, ufl.Mesh(ufl.VectorElement("Lagrange", "hexahedron", 1))), comm.bcast(job)


def assembled(domain, job):
    """Stiffness and mass, clamped within 1e-6 m of the inner radius."""
    body = job["bodies"]["lower"]
    cylinder, material = body["mesh"]["cylinder"], body["material"]
    space = fem.VectorFunctionSpace(domain, ("Lagrange", 1))
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    young, nu, rho = material["young"], material["poisson"], material["density"]
    lam, mu = young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))

    def strain(w):
        return ufl.sym(ufl.grad(w))

    stress = lam * ufl.tr(strain(u)) * ufl.Identity(3) + 2 * mu * strain(u)
    k_form = fem.form(ufl.inner(stress, strain(v)) * ufl.dx)
    m_form = fem.form(rho * ufl.inner(u, v) * ufl.dx)
    centre = -cylinder["outer_radius"]

    def bore(x):
        return np.abs(np.hypot(x[0], x[2] - centre) - cylinder["inner_radius"]) < 1e-6

    clamped = fem.dirichletbc(np.zeros(3, dtype=PETSc.ScalarType), fem.locate_dofs_geometrical(space, bore), space)
    k = fem.petsc.assemble_matrix(k_form, [clamped])
    k.assemble()
    m = fem.petsc.assemble_matrix(m_form, [clamped], diagonal=0.0)
    m.assemble()
    return k, m
