"""Modes of a clamped body with dolfinx + slepc4py + MUMPS, on the mesh of a railsqueal result file.

    python3 dolfinx_modes.py RESULT.h5 [COUNT]

Takes points and hexahedra from /VTKHDF, clamps the nodes within 1e-6 m of the inner radius of the built-in cylinder,
and asks SLEPc for the COUNT (40) lowest modes by shift-invert about 0 with a MUMPS Cholesky factorisation.
Written for dolfinx 0.5 (Debian 12: python3-dolfinx-real, python3-slepc4py-real, libopenblas0-pthread); run with
OPENBLAS_NUM_THREADS=1 and under `mpirun -n 2` as well as alone. Needs h5py where the file is read: rank 0.
"""

import json
import resource
import sys
import time

import h5py
import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

comm = MPI.COMM_WORLD
path = sys.argv[1]
count = int(sys.argv[2]) if len(sys.argv) > 2 else 40

job = None
if comm.rank == 0:
    with h5py.File(path) as f:
        job = json.loads(f["provenance/job"][()])
        grid = f["VTKHDF"]
        pieces = grid["NumberOfCells"].shape[0]
        start = np.concatenate([[0], np.cumsum(grid["NumberOfPoints"][:])])
        cell0 = np.concatenate([[0], np.cumsum(grid["NumberOfCells"][:])])
        conn = grid["Connectivity"][:].reshape(-1, 8)
        for p in range(pieces):
            conn[cell0[p]:cell0[p + 1]] += start[p]
        points, back = np.unique(np.round(grid["Points"][:], 9), axis=0, return_inverse=True)
        cells = back[conn].astype(np.int64)[:, [0, 1, 3, 2, 4, 5, 7, 6]]
else:
    points, cells = np.empty((0, 3)), np.empty((0, 8), dtype=np.int64)
job = comm.bcast(job)
body = job["bodies"]["lower"]
cylinder, material = body["mesh"]["cylinder"], body["material"]

domain = mesh.create_mesh(comm, cells, points, ufl.Mesh(ufl.VectorElement("Lagrange", "hexahedron", 1)))
comm.barrier()
begin, cpu = time.perf_counter(), time.process_time()
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

eps = SLEPc.EPS().create(comm)
eps.setOperators(k, m)
eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)
eps.setDimensions(count)
eps.setTarget(0.0)
eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
eps.setTolerances(1e-9)
st = eps.getST()
st.setType(SLEPc.ST.Type.SINVERT)
ksp = st.getKSP()
ksp.setType(PETSc.KSP.Type.PREONLY)
ksp.getPC().setType(PETSc.PC.Type.CHOLESKY)
ksp.getPC().setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
eps.setFromOptions()
eps.solve()
frequency = [np.sqrt(eps.getEigenvalue(i).real) / (2 * np.pi) for i in range(min(count, eps.getConverged()))]
comm.barrier()
wall, cpu = time.perf_counter() - begin, comm.allreduce(time.process_time() - cpu)
memory = comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 1e6
if comm.rank == 0:
    print(f"dofs {k.size[0]}  converged {eps.getConverged()}  first {frequency[0]:.3f} Hz  last {frequency[-1]:.3f} Hz")
    print(f"ranks {comm.size}  wall {wall:.1f} s  cpu {cpu:.1f} s  peak memory of all ranks {memory:.2f} GB")
