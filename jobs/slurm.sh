#!/bin/bash
# Runs a job under SLURM:  sbatch jobs/slurm.sh jobs/two-cylinders.json [options of `railsqueal run`]
# Submit it from the folder of the project; adjust the resources below to the site (partition, account, modules).
#SBATCH --job-name=railsqueal
#SBATCH --nodes=1
#SBATCH --ntasks=8
#SBATCH --cpus-per-task=1
#SBATCH --mem=32G
#SBATCH --time=02:00:00
#SBATCH --output=%x-%j.log
# A transient that is not done two minutes before the end saves its state (exit code 5); --resume FILE.h5 continues it. Other
# analyses cannot be continued: the signal ends them.
#SBATCH --signal=USR1@120
set -euo pipefail

# The modules that railsqueal was built with, for example:
# module load gcc openmpi hdf5 petsc slepc

cd "$SLURM_SUBMIT_DIR"
export OPENBLAS_NUM_THREADS=1

# One world of all tasks needs a PMI that srun and the MPI library share; `srun --mpi=list` shows what there is. If the two do not
# fit, railsqueal says so and ends with exit code 2; mpirun instead of srun is the other way.
srun --mpi="${RAILSQUEAL_SRUN_MPI:-pmix}" ./target/release/railsqueal check "$1"
exec srun --mpi="${RAILSQUEAL_SRUN_MPI:-pmix}" ./target/release/railsqueal run "$@"
