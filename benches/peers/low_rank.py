"""Block low-rank factors: MUMPS by PETSc, on the stiffness of a body of a railsqueal result file.

    python3 low_rank.py RESULT.h5 TOLERANCE...

For each tolerance (0: full rank) a Cholesky factorisation with ICNTL(35) = 2, CNTL(7) = TOLERANCE, and conjugate
gradients to 1e-12 with it as the preconditioner. Prints lines `row: tolerance | entries | operations | factorisation s
| memory MB | solve s | residual of one solve | iterations | s`: entries and operations as the compression leaves them
(INFOG(35), RINFOG(14)), processor time of one rank, MUMPS's own memory (INFOG(22)). Debian 12: python3-dolfinx-real,
python3-petsc4py-real; one rank.
"""

import sys
import time

from dolfinx_body import assembled, distributed
from mpi4py import MPI
from petsc4py import PETSc

comm = MPI.COMM_WORLD
k, m = assembled(*distributed(comm, sys.argv[1]))
k.setOption(PETSc.Mat.Option.SPD, True)
load, found = k.createVecRight(), k.createVecRight()
load.setRandom()
for number, text in enumerate(sys.argv[2:]):
    tolerance, options, prefix = float(text), PETSc.Options(), f"low{number}_"
    if tolerance > 0:
        options[f"{prefix}mat_mumps_icntl_35"] = 2
        options[f"{prefix}mat_mumps_cntl_7"] = tolerance
    ksp = PETSc.KSP().create(comm)
    ksp.setOptionsPrefix(prefix)
    ksp.setOperators(k)
    ksp.setType(PETSc.KSP.Type.CG)
    ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
    ksp.setTolerances(rtol=1e-12, max_it=500)
    pc = ksp.getPC()
    pc.setType(PETSc.PC.Type.CHOLESKY)
    pc.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
    ksp.setFromOptions()
    begin = time.process_time()
    ksp.setUp()
    factorised = time.process_time()
    pc.apply(load, found)
    solved = time.process_time()
    residual = (load - k * found).norm() / load.norm()
    factor = pc.getFactorMatrix()
    # Without compression these two are 0.
    entries = factor.getMumpsInfog(35) or factor.getMumpsInfog(29)
    operations = factor.getMumpsRinfog(14) or factor.getMumpsRinfog(3)
    entries = -1_000_000 * entries if entries < 0 else entries
    memory = factor.getMumpsInfog(22)
    before = time.process_time()
    ksp.solve(load, found)
    if ksp.getConvergedReason() < 0:
        sys.exit(f"{text}: no convergence, {ksp.getConvergedReason()}")
    after = time.process_time()
    figures = [
        tolerance,
        entries,
        operations,
        factorised - begin,
        memory,
        solved - factorised,
        residual,
        ksp.getIterationNumber(),
        after - before,
    ]
    print("row: " + " | ".join(f"{value:.6g}" for value in figures), flush=True)
    ksp.destroy()
