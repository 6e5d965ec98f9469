#!/usr/bin/env bash
# Points per minute of a sweep on jobs/curve.json: modes and compliance once, then 1000 points from them on 1 and 2
# ranks. usage: benches/sweep.sh [FOLDER for the result files, kept to be used again]
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
. "$root/scripts/env"
folder=${1:-$(mktemp -d)}
mkdir -p "$folder"
program=$root/target/release/railsqueal
[ -x "$program" ] || (cd "$root" && cargo build --release --bin railsqueal)
plain="--set output.fields=false"
[ -f "$folder/model.h5" ] ||
    mpirun -n 2 "$program" run "$root/jobs/curve.json" $plain --output "$folder/model.h5" >/dev/null
sweep='{"keys": {"contact.friction": {"from": 0.1, "to": 0.5, "count": 25},
                 "contact.creepage.lateral": {"from": 0.005, "to": 0.02, "count": 8},
                 "contact.normal_load": {"from": 50e3, "to": 70e3, "count": 5}}}'
for ranks in 1 2; do
    output=$folder/sweep-$ranks.h5
    mpirun -n $ranks "$program" run "$root/jobs/curve.json" $plain --set "analyses.sweep=$sweep" \
        --reuse "$folder/model.h5" --output "$output" --force >/dev/null 2>&1
    python3 - "$output" $ranks <<'PYTHON'
import sys
import h5py
with h5py.File(sys.argv[1]) as file:
    names = [n.decode() for n in file["provenance/stage_names"]]
    seconds = file["provenance/stage_times"][names.index("points of the sweep")]
    count, closed = len(file["sweep/status"]), file["sweep/closed"][:]
    error, failed = file["sweep/backward_error"][:].max(), (file["sweep/status"][:] != 0).sum()
print(
    f"{sys.argv[2]} ranks: {count} points in {seconds:.1f} s, {60 * count / seconds:.0f} a minute; "
    f"{closed.min()} to {closed.max()} closed nodes, backward errors to {error:.0e}, {failed} failed"
)
PYTHON
done
