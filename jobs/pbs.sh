#!/bin/bash
# Runs a job under PBS:  qsub -v JOB=jobs/two-cylinders.json jobs/pbs.sh    (more options: -v JOB=...,OPTIONS="--force")
# Submit it from the folder of the project; adjust the resources below to the site (queue, project, modules).
#PBS -N railsqueal
#PBS -l select=1:ncpus=8:mpiprocs=8:mem=32gb
#PBS -l walltime=02:00:00
#PBS -j oe
# A transient saves its state when OPTIONS has "--wall-time 7000", a little less than walltime in seconds, or on `qsig
# -s SIGUSR1 JOB` (exit code 5); OPTIONS="--resume FILE.h5" continues it. At the end of walltime mpirun leaves the ranks
# little time.
set -euo pipefail

# The modules that railsqueal was built with, for example:
# module load gcc openmpi hdf5 petsc slepc

cd "$PBS_O_WORKDIR"
export OPENBLAS_NUM_THREADS=1
ranks=$(wc -l < "$PBS_NODEFILE")

# The mpirun of the MPI library that railsqueal was built with (`railsqueal --version` names it).
mpirun -n "$ranks" --hostfile "$PBS_NODEFILE" ./target/release/railsqueal check "$JOB"
# shellcheck disable=SC2086
exec mpirun -n "$ranks" --hostfile "$PBS_NODEFILE" ./target/release/railsqueal run "$JOB" ${OPTIONS:-}
