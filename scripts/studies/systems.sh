#!/usr/bin/env bash
# Tests railsqueal on a bare Debian of a release, in a folder: scripts/validate systems [RELEASE...], as root, half an
# hour a release on two idle cores (bookworm and trixie, Debian 12 and 13, unless others are named). The two commands
# of the README set up, build and run; then come the tests of the library, those of MPI on 1 to 3 ranks, and those of
# the command line that the launcher may spoil: wrong usage, failures, signals. Last it makes the package, and a user
# of another bare system, where nothing but the package is installed, runs the job of the README. TRY_FOLDER=DIR keeps
# the system of one release in DIR.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../../containers/bare"

# step COMMAND...: in the checkout inside, with its time.
step() {
    local begun=$SECONDS
    say "$release: $*"
    inside bash -euc 'cd /opt/railsqueal; . scripts/env; "$@"' bash "$@" || fail "$release: $* failed"
    times+=("$(printf '%6d s  %s' $((SECONDS - begun)) "$*")")
}

# What a user has of the package.
installed_package() (
    built=$(echo "$system"/opt/railsqueal/target/package/railsqueal_*.deb)
    TRY_FOLDER=
    bare_system "$release"
    cp "$built" "$system/tmp/"
    inside apt-get install --yes -qq --no-install-recommends "/tmp/${built##*/}" > /dev/null
    inside useradd --create-home user
    inside su --login --command '
        set -eu
        railsqueal init wheel-on-rail
        mpirun -n 2 railsqueal run wheel-on-rail.json
        railsqueal plot wheel-on-rail.h5
        railsqueal report wheel-on-rail.h5
        railsqueal check /usr/share/railsqueal/jobs/drawn-wheel.json > /dev/null
        ls -l
        test -s /usr/share/man/man1/railsqueal.1.gz' user
    inside apt-get remove --yes -qq railsqueal > /dev/null
)

if [ $# -gt 1 ]; then
    for release in "$@"; do "${BASH_SOURCE[0]}" "$release"; done
    exit
elif [ $# = 0 ]; then
    exec "${BASH_SOURCE[0]}" bookworm trixie
fi
release=$1 times=()
bare_system "$release"
checkout_inside
step scripts/run jobs/wheel-on-rail.json
step scripts/run jobs/two-cylinders.json
step target/release/railsqueal --version
step cargo test --release --quiet --lib
step cargo test --release --quiet --test mpi
step cargo test --release --quiet --test cli -- usage:: failures:: interrupted:: cycles::
step scripts/package
begun=$SECONDS
say "$release: the package in another system"
# Alone on its line: after an || no command of it would end it.
installed_package
times+=("$(printf '%6d s  %s' $((SECONDS - begun)) 'another system, the package, a job')")
printf '%s\n' "${times[@]}"
say "all is well on $(sed -n 's/^PRETTY_NAME="\(.*\)"/\1/p' "$system/etc/os-release")"
