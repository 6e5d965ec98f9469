#!/usr/bin/env bash
# jobs/slurm.sh under a true SLURM of one node, which this script installs (Debian: slurm-wlm, munge; as root), starts
# without systemd in a folder of its own, and stops at the end: scripts/validate slurm. Some five minutes; it fails at
# the first thing that is not as docs/how-to/install.md says.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../env"
[ "$(id -u)" = 0 ] || fail "starts the daemons of SLURM and needs root: in a container, for example"
for name in munged slurmctld slurmd; do
    command -v "$name" > /dev/null || {
        apt-get update -qq && DEBIAN_FRONTEND=noninteractive \
            apt-get install --yes --no-install-recommends -qq slurm-wlm munge > /dev/null
        break
    }
done
[ -e /etc/slurm/slurm.conf ] &&
    fail "/etc/slurm/slurm.conf: there is a SLURM here already; use it with sbatch jobs/slurm.sh"

place=$(mktemp -d)
host=$(hostname -s)
cores=$(nproc)
export SLURM_CONF=$place/slurm.conf
mkdir "$place/state" "$place/spool" "$place/work"
cat > "$SLURM_CONF" << CONF
ClusterName=railsqueal
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthInfo=socket=$place/munge.socket
SlurmctldPort=26817
SlurmdPort=26818
SlurmctldPidFile=$place/slurmctld.pid
SlurmdPidFile=$place/slurmd.pid
StateSaveLocation=$place/state
SlurmdSpoolDir=$place/spool
SlurmctldLogFile=$place/slurmctld.log
SlurmdLogFile=$place/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobRequeue=1
KillWait=10
SchedulerParameters=sched_interval=5
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cores RealMemory=64 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
processes=()
stop() {
    scancel --user=root 2> /dev/null || true
    sleep 1
    for process in "${processes[@]}"; do kill "$process" 2> /dev/null || true; done
    wait
    rm -rf "$place"
}
trap stop EXIT
key=$place/munge.key
dd if=/dev/urandom of="$key" bs=1024 count=1 status=none
chmod 400 "$key"
chmod 755 "$place"
munged --foreground --force --key-file="$key" --socket="$place/munge.socket" --pid-file="$place/munge.pid" \
    --log-file="$place/munge.log" --seed-file="$place/munge.seed" > /dev/null 2>&1 &
processes+=($!)
until [ -S "$place/munge.socket" ]; do sleep 0.2; done
slurmctld -D > /dev/null 2>&1 &
processes+=($!)
slurmd -D -N "$host" > /dev/null 2>&1 &
processes+=($!)
for _ in $(seq 60); do
    [ "$(sinfo -h -o %T 2> /dev/null)" = idle ] && break
    sleep 1
done
[ "$(sinfo -h -o %T)" = idle ] || { tail -n 5 "$place"/*.log >&2; fail "the node does not come up"; }
say "$(sinfo --version), node $host with $cores cores; interfaces: $(srun --mpi=list 2>&1 | tr '\n' ' ')"

# --- the jobs
export RAILSQUEAL=${FAULTS_PROGRAM:-$root/target/release/railsqueal}
cd "$place/work"
export PYTHONPATH=$root/scripts/studies:$PYTHONPATH
"$python" - << 'JOB'
import faults, json
path = faults.squeal(".")
job = json.loads(path.read_text())
job["analyses"]["transient"]["duration"] = 0.5
path.write_text(json.dumps(job))
JOB
tasks=$((cores < 2 ? cores : 2))
submit() { sbatch --parsable --ntasks="$tasks" --mem=0 "$@"; }
# What SLURM says of a job; a field of it.
of() { scontrol show job "$1" | tr ' ' '\n' | sed -n "s/^$2=//p" | head -1; }
# Waits until a job is in one of the states.
await() {
    local id=$1 limit=$2 state
    shift 2
    for _ in $(seq "$limit"); do
        state=$(of "$id" JobState)
        for wanted in "$@"; do [ "$state" = "$wanted" ] && return 0; done
        # What was queued again would wait for two minutes.
        [ "$state" != PENDING ] || scontrol update JobId="$id" StartTime=now 2> /dev/null || true
        sleep 1
    done
    cat ./*-"$id".log >&2 || true
    fail "job $id is $state after $limit s, expected $*"
}
log() { cat ./*-"$1".log; }
says() { log "$1" | grep -qF -e "$2" || { log "$1" >&2; fail "job $1: the log does not say \"$2\""; }; }
silent() { log "$1" | grep -qF -e "$2" && { log "$1" >&2; fail "job $1: the log says \"$2\""; } || true; }
segments() { find . -path "./$1.transient/*.h5" 2> /dev/null | wc -l; }

say "1. a job without a transient: options reach check, which keeps out of the log; all ranks are one world"
id=$(submit "$root/jobs/slurm.sh" job.json --only stability --set contact.friction=0.31 --output first.h5)
await "$id" 120 COMPLETED
silent "$id" "estimated memory"
silent "$id" "wall time"
"$python" -c "
import h5py
with h5py.File('first.h5') as f:
    assert f['provenance/ranks'][()] == $tasks, f['provenance/ranks'][()]
    assert b'\"friction\": 0.31' in f['provenance/job'][()]
"

say "2. a job that check refuses ends with its code and computes nothing"
id=$(submit "$root/jobs/slurm.sh" job.json --set contact.friction=-1)
await "$id" 60 FAILED
[ "$(of "$id" ExitCode)" = 2:0 ] || fail "exit code $(of "$id" ExitCode), expected 2"
says "$id" "contact.friction"
silent "$id" "s] "

say "3. srun without an interface, or with one that the MPI library does not speak, is refused in words"
for mpi in none pmi2; do
    code=0
    srun --mpi="$mpi" -n 2 --overcommit --oversubscribe "$RAILSQUEAL" run job.json --output wrong.h5 \
        > wrong.log 2>&1 || code=$?
    if [ "$code" != 2 ] || ! grep -q "srun --mpi=list" wrong.log; then
        cat wrong.log >&2
        fail "--mpi=$mpi ended with $code"
    fi
done

say "4. a signal stops the run with its state saved, SLURM queues it again, and it goes on"
id=$(submit "$root/jobs/slurm.sh" job.json --reuse first.h5 --set contact.friction=0.31 --output signal.h5)
until [ "$(segments signal)" -ge 3 ]; do sleep 0.2; done
scancel --signal=USR1 "$id"
await "$id" 60 PENDING
says "$id" "stopped on request"
before=$(segments signal)
await "$id" 300 COMPLETED
says "$id" "--resume signal.h5"
[ "$(of "$id" Restarts)" = 1 ] || fail "restarts: $(of "$id" Restarts)"
[ -e signal.h5 ] && [ ! -e signal.transient ] && [ "$before" -ge 3 ] || fail "the run did not go on"

say "5. the job's time runs out: the run stops two minutes before, and goes on in the next"
id=$(submit --time=0:02:00 "$root/jobs/slurm.sh" job.json --reuse first.h5 --set contact.friction=0.31 --output time.h5)
until [ "$(segments time)" -ge 1 ]; do sleep 0.2; done
await "$id" 150 PENDING
says "$id" "stopped by the limit of wall time"
scontrol update JobId="$id" TimeLimit=0:20:00
await "$id" 300 COMPLETED
"$python" - << 'SAME'
import faults
a, b = (faults.transient(f) for f in ("signal.h5", "time.h5"))
assert faults.same(a, b), "other results"
SAME

say "6. a job that is cancelled leaves its segments"
id=$(submit "$root/jobs/slurm.sh" job.json --reuse first.h5 --set contact.friction=0.31 --output gone.h5 \
    --set analyses.transient.duration=50)
until [ "$(segments gone)" -ge 3 ]; do sleep 0.2; done
scancel "$id"
await "$id" 60 CANCELLED
code=0
"$RAILSQUEAL" run --resume gone.h5 --wall-time 1 > /dev/null 2>&1 || code=$?
[ "$code" = 5 ] || fail "--resume after scancel ended with $code, expected 5"
say "all as expected"
