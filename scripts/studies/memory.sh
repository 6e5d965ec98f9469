#!/usr/bin/env bash
# The safe layer on PETSc, SLEPc, MUMPS and HDF5 under valgrind, on one rank: scripts/validate memory [CHECK...], some
# minutes each. What the libraries do among themselves is counted; it fails where an error is this program's own, and
# where memory is lost that was taken on its behalf: a handle of PETSc, SLEPc or MUMPS that nobody destroyed.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../env"
command -v valgrind > /dev/null || fail "valgrind is not installed"
cd "$root"
# shellcheck disable=SC2086
test=$(cargo test --release ${RAILSQUEAL_CARGO:-} --test linear_algebra --no-run 2>&1 |
    sed -n 's/.*(\(target.*\))$/\1/p')
log=$(mktemp -d)
trap 'rm -rf "$log"' EXIT
known=()
for file in /usr/share/openmpi/openmpi-valgrind.supp \
    "$(dirname "$(command -v mpirun)")/../share/openmpi/openmpi-valgrind.supp"; do
    [ -f "$file" ] && known=(--suppressions="$file") && break
done
names=("$@")
[ ${#names[@]} -gt 0 ] || names=("")
for name in "${names[@]}"; do
    RAILSQUEAL_SMALL=1 OMP_NUM_THREADS=1 mpirun -n 1 valgrind --quiet --track-origins=yes --leak-check=full \
        --show-leak-kinds=definite --num-callers=40 --error-limit=no --log-file="$log/%p" "${known[@]}" \
        "$test" ${name:+"$name"}
done
"$python" - "$log" << 'COUNT'
import collections, pathlib, re, sys

# What is lost and may be, with the reason; frames of the program, the innermost of which counts.
KNOWN = {
    r"^linear_algebra::main": "MPI itself, which the test starts and ends there: Open MPI frees neither its components "
    "nor what their start took",
    r"^railsqueal::petsc::session::Petsc::start": "the command line of PETSc, which keeps the pointers: it lives as "
    "long as the process, a hundred bytes",
}
# Checks in which an error goes through PETSc or SLEPc: their functions return at once then and leave what they held. A
# run ends with such an error.
FAILING = r"linear_algebra::(quadratic::failing_operator|eigen::session)\b"
own, other, lost = collections.Counter(), collections.Counter(), collections.Counter()
spared = collections.Counter()
for path in pathlib.Path(sys.argv[1]).iterdir():
    # An error is a paragraph: what it is, then its frames, the innermost first, up to where the memory comes from.
    for block in re.split(r"(?m)^==\d+== *\n", path.read_text(errors="replace")):
        lines = [re.sub(r"^==\d+== ", "", line) for line in block.splitlines()]
        frames = [m.group(1) for line in lines if (m := re.match(r"\s+(?:at|by) 0x[0-9A-F]+: (.*)", line))]
        if not frames:
            continue
        what = lines[0].strip()
        if "definitely lost" in what:
            size = int(re.match(r"[\d,]+", what).group().replace(",", ""))
            ours = [f for f in frames if re.match(r"<?(railsqueal|linear_algebra|hdf5_chunks|allocator)", f)]
            mine = ours[0] if ours else "no frame of the program"
            reason = next((why for pattern, why in KNOWN.items() if re.match(pattern, mine)), None)
            if not reason and any(re.match(FAILING, f) for f in frames):
                reason = "an error of a callback or an option that is refused, on its way through PETSc and SLEPc"
            if reason:
                spared[reason] += size
            else:
                lost[f"lost under {mine}"] += size
            continue
        # The program calls all of the libraries: its own are errors within it, or at the pointers that it hands over.
        first = frames[0]
        by_program = re.match(r"(<?railsqueal|<?linear_algebra|hdf5_chunks|allocator)", first)
        (own if by_program else other)[f"{what} in {first}"] += 1
for name, counter in (("of the libraries", other), ("of this program", own)):
    print(f"errors {name}: {sum(counter.values())}")
    for text, count in counter.most_common(12):
        print(f"   {count} x {text}")
for reason, size in spared.items():
    print(f"lost, {size} bytes: {reason}")
print(f"bytes lost otherwise: {sum(lost.values())}")
for text, size in lost.most_common(12):
    print(f"   {size} bytes {text}")
sys.exit(1 if own or lost else 0)
COUNT
