"""Modes of a clamped body with dolfinx + slepc4py + MUMPS, on the mesh of a railsqueal result file.

    python3 dolfinx_modes.py RESULT.h5 [COUNT [RADIUS CENTRE]]

Clamps the inner radius of the built-in cylinder, or a RADIUS about an axis at the height CENTRE, and asks SLEPc for the
COUNT (40) lowest modes by shift-invert about 0 with a MUMPS Cholesky factorisation. Written for dolfinx 0.5 (Debian 12:
python3-dolfinx-real, python3-slepc4py-real, libopenblas0-pthread); run with OPENBLAS_NUM_THREADS=1 and under `mpirun -n
2` as well as alone. Needs h5py where the file is read: rank 0.
"""

import resource
import sys
import time

import numpy as np
from dolfinx_body import assembled, distributed
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

comm = MPI.COMM_WORLD
count = int(sys.argv[2]) if len(sys.argv) > 2 else 40
bore = tuple(map(float, sys.argv[3:5])) or None
body = distributed(comm, sys.argv[1])
comm.barrier()
begin, cpu = time.perf_counter(), time.process_time()
k, m = assembled(*body, bore)

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
