"""Stiffness and mass of a clamped body by dolfinx, on the mesh of a railsqueal result file.

Hexahedra of 8 nodes, hexahedra of 20 nodes (serendipity on trilinear geometry from the corners) and tetrahedra of 10
nodes (with their curved edges). Written for dolfinx 0.5 (Debian 12: python3-dolfinx-real). Needs h5py where the file is
read: rank 0.
"""

import json

import h5py
import numpy as np
import ufl
from dolfinx import fem, mesh

# By VTK's number of a kind: the form of the cell, the degree of its geometry, our nodes in the peer's order, the space,
# and the degree that is integrated exactly.
KINDS = {
    12: ("hexahedron", 1, [0, 1, 3, 2, 4, 5, 7, 6], ("Lagrange", 1), None),
    24: ("tetrahedron", 2, [0, 1, 2, 3, 9, 8, 5, 7, 6, 4], ("Lagrange", 2), 4),
    25: ("hexahedron", 1, [0, 1, 3, 2, 4, 5, 7, 6], ("S", 2), 5),
}


def read(path):
    """Points, cells, their kind and the job of a result file with cells of one kind, its pieces joined."""
    with h5py.File(path) as f:
        job = json.loads(f["provenance/job"][()])
        grid = f["VTKHDF"]
        (kind,) = np.unique(grid["Types"][:])
        pieces = grid["NumberOfCells"].shape[0]
        start = np.concatenate([[0], np.cumsum(grid["NumberOfPoints"][:])])
        cell0 = np.concatenate([[0], np.cumsum(grid["NumberOfCells"][:])])
        conn = grid["Connectivity"][:].reshape(cell0[-1], -1)
        for p in range(pieces):
            conn[cell0[p] : cell0[p + 1]] += start[p]
        points, back = np.unique(np.round(grid["Points"][:], 9), axis=0, return_inverse=True)
        cells = back[conn].astype(np.int64)[:, KINDS[kind][2]]
    # Nodes between the corners are no nodes of a trilinear geometry.
    used, cells = np.unique(cells, return_inverse=True)
    return points[used], cells.reshape(-1, len(KINDS[kind][2])), int(kind), job


def distributed(comm, path):
    """The mesh on all ranks, the kind of its cells and the job."""
    points, cells, kind, job = read(path) if comm.rank == 0 else (np.empty((0, 3)), None, None, None)
    kind, job = comm.bcast(kind), comm.bcast(job)
    form, degree, order = KINDS[kind][:3]
    if cells is None:
        cells = np.empty((0, len(order)), dtype=np.int64)
    return mesh.create_mesh(comm, cells, points, ufl.Mesh(ufl.VectorElement("Lagrange", form, degree))), kind, job


def assembled(domain, kind, job, bore=None):
    """Stiffness and mass, clamped on a radius about an axis along y through (0, 0, centre): `bore` is (radius, centre),
    m; without it the inner radius of the built-in cylinder."""
    body = job["bodies"]["lower"]
    material = body["material"]
    if bore is None:
        bore = body["mesh"]["cylinder"]["inner_radius"], -body["mesh"]["cylinder"]["outer_radius"]
    *_, element, degree = KINDS[kind]
    space = fem.VectorFunctionSpace(domain, element)
    dx = ufl.dx if degree is None else ufl.dx(metadata={"quadrature_degree": degree})
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    young, nu, rho = material["young"], material["poisson"], material["density"]
    lam, mu = young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))

    def strain(w):
        return ufl.sym(ufl.grad(w))

    stress = lam * ufl.tr(strain(u)) * ufl.Identity(3) + 2 * mu * strain(u)
    k_form = fem.form(ufl.inner(stress, strain(v)) * dx)
    m_form = fem.form(rho * ufl.inner(u, v) * dx)
    radius, centre = bore
    # Faces, not nodes: the nodes of a serendipity space between corners have no place that could be asked for, and
    # straight ones are not on the radius.
    faces = mesh.locate_entities_boundary(domain, 2, lambda x: np.abs(np.hypot(x[0], x[2] - centre) - radius) < 1e-6)
    clamped = fem.dirichletbc(fem.Function(space), fem.locate_dofs_topological(space, 2, faces))
    k = fem.petsc.assemble_matrix(k_form, [clamped])
    k.assemble()
    m = fem.petsc.assemble_matrix(m_form, [clamped], diagonal=0.0)
    m.assemble()
    return k, m
