#!/usr/bin/env bash
# Tests the linear algebra with other builds of PETSc and SLEPc than those in use: scripts/validate builds [64 | newer], an hour or so each. They come into
# target/builds and are not installed: beside the ones that are in use they would take their place.
#   64      Debian's packages with integers of 64 bit
#   newer   PETSc and SLEPc of PETSC_WANTED (3.24) from source, out of PyPI, with Debian's Open MPI and MUMPS
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../env"
command -v apt-get > /dev/null || fail "this is no Debian system; with PETSC_DIR and SLEPC_DIR set scripts/test tests any build of PETSc"
place=$root/target/builds
mkdir -p "$place"

# Sets PETSC_DIR and SLEPC_DIR to packages that are unpacked.
wide() {
    mkdir -p "$place/archives/partial" "$place/root"
    apt-get install --yes --no-install-recommends --download-only -qq -o Dir::Cache::archives="$place/archives" libslepc64-complex-dev > /dev/null
    local package
    for package in "$place"/archives/*.deb; do dpkg -x "$package" "$place/root"; done
    local usr=$place/root/usr
    # They say where they would lie.
    find "$usr" -name "*.pc" -type f -exec sed -i "s#=/usr/lib/#=$usr/lib/#" {} +
    PETSC_DIR=$(echo "$usr"/lib/petscdir/petsc64-*/*-complex)
    SLEPC_DIR=$(echo "$usr"/lib/slepcdir/slepc64-*/*-complex)
    # What the packages share with those that are installed is there already; links of the development packages lead out of the folder.
    local libraries=$usr/lib/x86_64-linux-gnu
    export LIBRARY_PATH=$libraries LD_LIBRARY_PATH=$libraries:${LD_LIBRARY_PATH:-}
}

# Sets them to builds from source.
newer() {
    local wanted=${PETSC_WANTED:-3.24} tools=$place/tools name
    command -v gfortran > /dev/null || fail "gfortran is not installed: apt-get install gfortran"
    if [ ! -d "$tools" ]; then
        python3 -m venv "$tools"
        # PETSc's own builds want no newer ones.
        "$tools/bin/pip" install --quiet "setuptools<80" wheel
    fi
    for name in petsc slepc; do
        ls -d "$place/$name-$wanted".*/ > /dev/null 2>&1 && continue
        # The sources alone: without their own tools in place SLEPc's would build a PETSc first.
        "$tools/bin/pip" download --quiet --no-deps --no-binary :all: --no-build-isolation --dest "$place" "$name==$wanted.*"
        tar xf "$place/$name-$wanted".*.tar.gz -C "$place"
    done
    PETSC_DIR=$(echo "$place/petsc-$wanted".*/)
    SLEPC_DIR=$(echo "$place/slepc-$wanted".*/)
    PETSC_DIR=${PETSC_DIR%/} SLEPC_DIR=${SLEPC_DIR%/}
    export PETSC_DIR SLEPC_DIR PETSC_ARCH=arch-complex
    if [ ! -e "$PETSC_DIR/$PETSC_ARCH/lib/libpetsc.so" ]; then
        say "building $PETSC_DIR"
        (
            cd "$PETSC_DIR"
            ./configure --with-scalar-type=complex --with-debugging=0 --with-fortran-bindings=0 --with-x=0 --with-ssl=0 --with-mumps-include=/usr/include \
                --with-mumps-lib="-lzmumps -ldmumps -lsmumps -lcmumps -lmumps_common -lpord" --with-scalapack-lib=-lscalapack-openmpi > configure.out
            make all > make.out 2>&1
        ) || fail "PETSc could not be built: $PETSC_DIR/configure.out, make.out"
    fi
    if [ ! -e "$SLEPC_DIR/$PETSC_ARCH/lib/libslepc.so" ]; then
        say "building $SLEPC_DIR"
        (cd "$SLEPC_DIR" && ./configure > configure.out && make > make.out 2>&1) || fail "SLEPc could not be built: $SLEPC_DIR/configure.out, make.out"
    fi
}

kind=${1:-64}
case $kind in
    64) wide ;;
    newer) newer ;;
    *) fail "usage: scripts/validate builds [64 | newer]" ;;
esac
export PETSC_DIR SLEPC_DIR
[ -d "$PETSC_DIR" ] && [ -d "$SLEPC_DIR" ] || fail "$PETSC_DIR, $SLEPC_DIR: not what was expected"
cd "$root"
say "PETSc of $PETSC_DIR"
# shellcheck disable=SC2086
cargo test --release ${RAILSQUEAL_CARGO:-} --target-dir "$place/target-$kind" --test linear_algebra
