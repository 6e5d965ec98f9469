#!/usr/bin/env bash
# Tests the linear algebra with other builds of PETSc and SLEPc than those in use: scripts/validate builds [64 | newer |
# mpich], a quarter of an hour each. They come into target/builds and are not installed: beside the ones that are in use
# they would take their place.
#   64      Debian's packages with integers of 64 bit
#   newer   PETSc and SLEPc of PETSC_WANTED (3.24) from source, out of PyPI, with Debian's Open MPI and MUMPS
#   mpich   the same with Debian's MPICH, with its ScaLAPACK and HDF5, and with MUMPS from Debian's source
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../env"
command -v apt-get > /dev/null ||
    fail "this is no Debian system; with PETSC_DIR and SLEPC_DIR set scripts/test tests any build of PETSc"
place=$root/target/builds
mkdir -p "$place"

# Sets PETSC_DIR and SLEPC_DIR to packages that are unpacked.
wide() {
    mkdir -p "$place/archives/partial" "$place/root"
    apt-get install --yes --no-install-recommends --download-only -qq \
        -o Dir::Cache::archives="$place/archives" libslepc64-complex-dev > /dev/null
    local package
    for package in "$place"/archives/*.deb; do dpkg -x "$package" "$place/root"; done
    local usr=$place/root/usr
    # They say where they would lie.
    find "$usr" -name "*.pc" -type f -exec sed -i "s#=/usr/lib/#=$usr/lib/#" {} +
    PETSC_DIR=$(echo "$usr"/lib/petscdir/petsc64-*/*-complex)
    SLEPC_DIR=$(echo "$usr"/lib/slepcdir/slepc64-*/*-complex)
    # What the packages share with those that are installed is there already; links of the development packages lead out
    # of the folder.
    local libraries=$usr/lib/x86_64-linux-gnu
    export LIBRARY_PATH=$libraries LD_LIBRARY_PATH=$libraries:${LD_LIBRARY_PATH:-}
}

# The sources of PETSc and SLEPc, in the folder $1.
petsc_sources() {
    local at=$1 wanted=${PETSC_WANTED:-3.24} tools=$place/tools name
    command -v gfortran > /dev/null || fail "gfortran is not installed: apt-get install gfortran"
    mkdir -p "$at"
    if [ ! -d "$tools" ]; then
        python3 -m venv "$tools"
        # PETSc's own builds want no newer ones.
        "$tools/bin/pip" install --quiet "setuptools<80" wheel
    fi
    for name in petsc slepc; do
        ls -d "$at/$name-$wanted".*/ > /dev/null 2>&1 && continue
        # The sources alone: without their own tools in place SLEPc's would build a PETSc first.
        "$tools/bin/pip" download --quiet --no-deps --no-binary :all: --no-build-isolation --dest "$at" \
            "$name==$wanted.*"
        tar xf "$at/$name-$wanted".*.tar.gz -C "$at"
    done
    PETSC_DIR=$(echo "$at/petsc-$wanted".*/)
    SLEPC_DIR=$(echo "$at/slepc-$wanted".*/)
    PETSC_DIR=${PETSC_DIR%/} SLEPC_DIR=${SLEPC_DIR%/}
    export PETSC_DIR SLEPC_DIR PETSC_ARCH=arch-complex
}

# Builds both, PETSc with these options.
build_petsc() {
    if [ ! -e "$PETSC_DIR/$PETSC_ARCH/lib/libpetsc.so" ]; then
        say "building $PETSC_DIR"
        (
            cd "$PETSC_DIR"
            ./configure --with-scalar-type=complex --with-debugging=0 --with-fortran-bindings=0 --with-x=0 \
                --with-ssl=0 "$@" > configure.out
            make all > make.out 2>&1
        ) || fail "PETSc could not be built: $PETSC_DIR/configure.out, make.out"
    fi
    if [ ! -e "$SLEPC_DIR/$PETSC_ARCH/lib/libslepc.so" ]; then
        say "building $SLEPC_DIR"
        (cd "$SLEPC_DIR" && ./configure > configure.out && make > make.out 2>&1) ||
            fail "SLEPc could not be built: $SLEPC_DIR/configure.out, make.out"
    fi
}

mumps_libraries="-lzmumps -ldmumps -lsmumps -lcmumps -lmumps_common"

# Sets PETSC_DIR and SLEPC_DIR to builds from source.
newer() {
    petsc_sources "$place"
    build_petsc --with-mumps-include=/usr/include --with-mumps-lib="$mumps_libraries -lpord" \
        --with-scalapack-lib=-lscalapack-openmpi
}

# Debian's source of the package $1, in the folder $2: the system's lists, with sources in place of packages.
debian_source() {
    local parts=$2/lists/parts file
    mkdir -p "$parts" "$2/lists/state/partial"
    for file in /etc/apt/sources.list /etc/apt/sources.list.d/*; do
        case $file in
            *.list) [ -f "$file" ] && sed -n 's/^deb /deb-src /p' "$file" > "$parts/$(basename "$file")" ;;
            *.sources) sed 's/^Types:.*/Types: deb-src/' "$file" > "$parts/$(basename "$file")" ;;
        esac
    done
    local options=(-qq -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::SourceParts="$parts"
        -o Dir::State::lists="$2/lists/state")
    apt-get "${options[@]}" update
    (cd "$2" && apt-get "${options[@]}" source --download-only "$1" 2> /dev/null)
}

# The same with everything that MPI is in made for MPICH.
mpich() {
    local at=$place/mpich
    local usr=$at/root/usr libraries=$at/root/usr/lib/x86_64-linux-gnu name package
    if [ ! -d "$usr" ]; then
        mkdir -p "$at/archives/partial"
        apt-get install --yes --no-install-recommends --download-only -qq -o Dir::Cache::archives="$at/archives" \
            mpich libmpich-dev libscalapack-mpich-dev libhdf5-mpich-dev > /dev/null
        for package in "$at"/archives/*.deb; do dpkg -x "$package" "$at/root"; done
        # The compilers' wrappers say where they would lie.
        for name in mpicc mpicxx mpif90; do
            sed -e "s#^\(prefix\|includedir\|libdir\)=/usr#\1=$usr#; s#-L/usr/lib\b#-L$libraries#" \
                "$usr/bin/$name.mpich" > "$usr/bin/$name"
            chmod +x "$usr/bin/$name"
        done
        ln -sf mpiexec.hydra "$usr/bin/mpirun"
        mkdir -p "$at/hdf5"
        ln -sfn "$usr/include/hdf5/mpich" "$at/hdf5/include"
        ln -sfn "$libraries/hdf5/mpich" "$at/hdf5/lib"
    fi
    export PATH=$usr/bin:$PATH HDF5_DIR=$at/hdf5 MUMPS_DIR=$at/mumps
    export LIBRARY_PATH=$libraries:$at/mumps/lib LD_LIBRARY_PATH=$libraries:$at/mumps/lib:${LD_LIBRARY_PATH:-}
    petsc_sources "$at"
    [ -e "$at/mumps/lib/libzmumps.so" ] || mumps "$at" "$libraries"
    build_petsc --with-cc=mpicc --with-cxx=mpicxx --with-fc=mpif90 --with-mpiexec=mpiexec.hydra \
        --with-mumps-include="$MUMPS_DIR/include" --with-mumps-lib="-L$MUMPS_DIR/lib $mumps_libraries" \
        --with-scalapack-lib="-L$libraries -lscalapack-mpich"
}

# Builds MUMPS in the folder $1 for the MPI that is on the path; its own makefile makes archives, and libraries are made
# of these.
mumps() {
    debian_source mumps "$1"
    tar xf "$1"/mumps_*.orig.tar.* -C "$1"
    local source name
    source=$(echo "$1"/MUMPS_*/)
    say "building $source"
    # shellcheck disable=SC2016
    printf '%s\n' 'LPORDDIR = $(topdir)/PORD/lib/' 'IPORD = -I$(topdir)/PORD/include/' 'LPORD = -L$(LPORDDIR) -lpord' \
        'ORDERINGSF = -Dpord -Dmetis' 'ORDERINGSC = $(ORDERINGSF)' 'IORDERINGSC = $(IPORD)' \
        'LORDERINGS = -lmetis $(LPORD)' 'LIBEXT = .a' 'OUTC = -o' 'OUTF = -o' 'RM = rm -f' 'CC = mpicc' \
        'FC = mpif90' 'FL = mpif90' 'AR = ar vr ' 'RANLIB = ranlib' 'CDEFS = -DAdd_' \
        'OPTC = -O2 -fPIC' 'OPTF = -O2 -fPIC -fallow-argument-mismatch' \
        'LIBPAR = -lscalapack-mpich -llapack -lblas' 'LIBOTHERS = -lpthread' 'LIBS = $(LIBPAR)' > "$source/Makefile.inc"
    (
        cd "$source"
        make prerequisites
        for name in s d c z; do make -C src -j2 ARITH=$name $name; done
        mkdir -p "$1/mumps/lib" "$1/mumps/include"
        cp include/*.h "$1/mumps/include"
        cd lib
        mpif90 -shared -o "$1/mumps/lib/libmumps_common.so" \
            -Wl,--whole-archive libmumps_common.a libpord.a -Wl,--no-whole-archive \
            -L"$2" -lmetis -lscalapack-mpich -llapack -lblas
        for name in s d c z; do
            mpif90 -shared -o "$1/mumps/lib/lib${name}mumps.so" \
                -Wl,--whole-archive "lib${name}mumps.a" -Wl,--no-whole-archive \
                -L"$1/mumps/lib" -lmumps_common -L"$2" -lscalapack-mpich -llapack -lblas
        done
    ) > "$1/mumps.out" 2>&1 || fail "MUMPS could not be built: $1/mumps.out"
}

kind=${1:-64}
case $kind in
    64) wide ;;
    newer) newer ;;
    mpich)
        mpich
        # Its ranks wait busily: on fewer cores they do not get on.
        [ "$(nproc)" -ge 3 ] || export RAILSQUEAL_RANKS="1 2"
        ;;
    *) fail "usage: scripts/validate builds [64 | newer | mpich]" ;;
esac
export PETSC_DIR SLEPC_DIR
[ -d "$PETSC_DIR" ] && [ -d "$SLEPC_DIR" ] || fail "$PETSC_DIR, $SLEPC_DIR: not what was expected"
cd "$root"
say "PETSc of $PETSC_DIR"
# shellcheck disable=SC2086
cargo test --release ${RAILSQUEAL_CARGO:-} --target-dir "$place/target-$kind" --test linear_algebra
