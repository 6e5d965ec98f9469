#!/usr/bin/env bash
# Builds against PETSc and SLEPc with integers of 64 bit, as Debian has them, and tests the linear algebra with it: scripts/validate builds, half an hour or so.
# The packages are unpacked into target/builds, not installed: beside the ones that are in use they would take their place.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../env"
command -v apt-get > /dev/null || fail "this is no Debian system; with PETSC_DIR and SLEPC_DIR set scripts/test tests any build of PETSc"
place=$root/target/builds
mkdir -p "$place/archives/partial" "$place/root"
apt-get install --yes --no-install-recommends --download-only -qq -o Dir::Cache::archives="$place/archives" libslepc64-complex-dev > /dev/null
for package in "$place"/archives/*.deb; do dpkg -x "$package" "$place/root"; done
usr=$place/root/usr
# They say where they would lie.
find "$usr" -name "*.pc" -type f -exec sed -i "s#=/usr/lib/#=$usr/lib/#" {} +
PETSC_DIR=$(echo "$usr"/lib/petscdir/petsc64-*/*-complex)
SLEPC_DIR=$(echo "$usr"/lib/slepcdir/slepc64-*/*-complex)
export PETSC_DIR SLEPC_DIR
[ -d "$PETSC_DIR" ] && [ -d "$SLEPC_DIR" ] || fail "$PETSC_DIR, $SLEPC_DIR: not what was expected in the packages"
# What the packages share with those that are installed is there already; links of the development packages lead out of the folder.
libraries=$usr/lib/x86_64-linux-gnu
export LIBRARY_PATH=$libraries LD_LIBRARY_PATH=$libraries:${LD_LIBRARY_PATH:-}
cd "$root"
say "PETSc and SLEPc of 64 bit in $place"
# shellcheck disable=SC2086
cargo ${1:-test} --release --target-dir "$place/target" --test linear_algebra
