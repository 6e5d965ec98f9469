#!/bin/bash
# Runs a job under SLURM:  sbatch jobs/slurm.sh jobs/two-cylinders.json [options of `railsqueal run`]
# Submit it from the folder of the project; adjust the resources below to the site (partition, account, modules).
#
# A transient stops two minutes before the end of the job's time, its state saved (exit code 5); SLURM then puts the
# same job into its queue again, and it goes on from there. RAILSQUEAL_RESTARTS says how often at the most (50).
# `scancel --signal=USR1 JOBID` stops it earlier. Other analyses are not stopped.
#SBATCH --job-name=railsqueal
#SBATCH --nodes=1
#SBATCH --ntasks=8
#SBATCH --cpus-per-task=1
#SBATCH --mem=32G
#SBATCH --time=02:00:00
#SBATCH --output=%x-%j.log
#SBATCH --open-mode=append
#SBATCH --requeue
set -uo pipefail

# The modules that railsqueal was built with, for example:
# module load gcc openmpi hdf5 petsc slepc

cd "$SLURM_SUBMIT_DIR" || exit 6
export OPENBLAS_NUM_THREADS=1
program=${RAILSQUEAL:-./target/release/railsqueal}
say() { echo "slurm.sh: $*" >&2; }

job=${1:?the job file is missing: sbatch jobs/slurm.sh JOB [options of railsqueal run]}
shift

# What of the options is for `check`, which file the results go to, and what stays when the run is continued.
checked=() kept=() result=${job%.*}.h5 limited=
given=("$@")
for ((i = 0; i < ${#given[@]}; i++)); do
    option=${given[i]} value=${given[i + 1]-}
    case $option in
        --) kept+=("${given[@]:i}"); break ;;
        --set | --only) checked+=("$option" "$value"); kept+=("$option" "$value"); ((++i)) ;;
        --set=* | --only=*) checked+=("$option"); kept+=("$option") ;;
        --output | -o | --resume) result=$value; ((++i)) ;;
        --output=* | --resume=*) result=${option#*=} ;;
        --force | -f) ;;
        --wall-time) limited=yes; kept+=("$option" "$value"); ((++i)) ;;
        --wall-time=*) limited=yes; kept+=("$option") ;;
        *) kept+=("$option") ;;
    esac
done

# One world of all tasks needs a PMI that srun and the MPI library share. Where srun has no pmix the MPI library's own
# mpirun starts the ranks. RAILSQUEAL_LAUNCH names another launcher.
if [ -n "${RAILSQUEAL_LAUNCH:-}" ]; then
    read -ra launch <<<"$RAILSQUEAL_LAUNCH"
elif srun --mpi=list 2>&1 | grep -qw 'pmix[_v0-9]*'; then
    launch=(srun --mpi=pmix)
else
    launch=(mpirun -n "${SLURM_NTASKS:-1}")
fi

# Its errors go to the log, what it says does not.
plan=$("${launch[@]}" "$program" check "$job" "${checked[@]}") || exit

# SLURM puts the job into the queue again after exit code 5 and after the failure of a node: what there is of the run is
# continued. A run that ended before its first segment may have left modes and compliance.
options=("${given[@]}") taken=() model=${result%.*}.model.h5
if [ "${SLURM_RESTART_COUNT:-0}" -gt 0 ]; then
    number="start number $((SLURM_RESTART_COUNT + 1))"
    if compgen -G "${result%.*}.transient/*.h5" >/dev/null; then
        say "$number: --resume $result"
        options=(--resume "$result" "${kept[@]}")
    elif [ -e "$model" ] && [[ " ${given[*]-}" != *" --reuse"* ]]; then
        say "$number: --reuse $model"
        taken=(--reuse "$model")
    fi
fi

# Only a transient can be stopped and continued.
if grep -Eq 'transient on (the modes|all degrees of freedom)' <<<"$plan" && [ -z "$limited" ]; then
    end=${SLURM_JOB_END_TIME:-$(date -d "$(squeue -h -j "${SLURM_JOB_ID:-0}" -o %e 2>/dev/null)" +%s 2>/dev/null)}
    if [ -n "$end" ]; then
        left=$((end - $(date +%s) - 120))
        # Options of PETSc come last.
        options=(--wall-time "$((left > 1 ? left : 1))" "${options[@]}")
    fi
fi

start() {
    "${launch[@]}" "$program" run "$job" "$@"
    code=$?
}
start "${taken[@]}" "${options[@]}"
if [ ${#taken[@]} -gt 0 ] && { [ "$code" = 2 ] || [ "$code" = 3 ]; }; then
    say "$model is not taken up: from the beginning"
    start "${options[@]}"
fi
if [ "$code" = 5 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt "${RAILSQUEAL_RESTARTS:-50}" ]; then
    say "stopped with its state saved: into the queue again"
    scontrol requeue "$SLURM_JOB_ID" || say "SLURM does not take the job again; continue it with --resume $result"
fi
exit "$code"
