"""20 eigenvalues near 2 kHz of the full stability problem with slepc4py: PEP TOAR, shift-invert, complex MUMPS LU.

    cargo bench --bench full_stability -- --export matrices.bin
    python3 slepc4py_pep.py matrices.bin [COUNT]

The file holds K, C and M in PETSc's binary format with complex scalars. Written for slepc4py 3.18 with the complex
PETSc (Debian 12: python3-slepc4py-complex, libopenblas0-pthread, PETSC_DIR and SLEPC_DIR set to the complex builds);
run with OPENBLAS_NUM_THREADS=1. Scaling as in -pep_scale both, with which the pairs are right; with the default scaling
they are not.
"""

import resource
import sys
import time

import slepc4py

slepc4py.init(sys.argv[:1] + sys.argv[3:])
import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

count = int(sys.argv[2]) if len(sys.argv) > 2 else 20
viewer = PETSc.Viewer().createBinary(sys.argv[1], "r")
stiffness, damping, mass = (PETSc.Mat().load(viewer) for _ in range(3))
print(stiffness.getSize()[0], "unknowns")

begin, cpu = time.perf_counter(), time.process_time()
pep = SLEPc.PEP().create()
pep.setOperators([stiffness, damping, mass])
pep.setProblemType(SLEPc.PEP.ProblemType.GENERAL)
pep.setType(SLEPc.PEP.Type.TOAR)
PETSc.Options().setValue("pep_scale", "both")
pep.setDimensions(count, max(2 * count, count + 15))
pep.setTolerances(1e-10, 200)
pep.setWhichEigenpairs(SLEPc.PEP.Which.TARGET_MAGNITUDE)
pep.setTarget(2j * np.pi * 2000)
transform = pep.getST()
transform.setType(SLEPc.ST.Type.SINVERT)
solver = transform.getKSP()
solver.setType("preonly")
solver.getPC().setType("lu")
solver.getPC().setFactorSolverType("mumps")
pep.setFromOptions()
pep.setUp()
ready, ready_cpu = time.perf_counter(), time.process_time()
pep.solve()
done, done_cpu = time.perf_counter(), time.process_time()
print(f"set-up      {ready - begin:8.2f} s wall {ready_cpu - cpu:8.2f} s cpu")
print(f"solve       {done - ready:8.2f} s wall {done_cpu - ready_cpu:8.2f} s cpu")
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(
    f"in all      {done - begin:8.2f} s wall {done_cpu - cpu:8.2f} s cpu, {pep.getConverged()} converged, "
    f"{memory / 1e6:.2f} GB"
)
x = stiffness.createVecRight()
y = [x.duplicate() for _ in range(3)]
norms = [a.norm(PETSc.NormType.INFINITY) for a in (stiffness, damping, mass)]
for i in range(min(count, pep.getConverged())):
    value = pep.getEigenpair(i, x)
    for a, v in zip((stiffness, damping, mass), y):
        a.mult(x, v)
    y[0].axpy(value, y[1])
    y[0].axpy(value**2, y[2])
    scale = norms[0] + abs(value) * norms[1] + abs(value) ** 2 * norms[2]
    print(f"  {value.real:.6f} {value.imag:+.6f}i  backward error {y[0].norm() / (scale * x.norm()):.1e}")
