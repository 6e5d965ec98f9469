# SPDX-License-Identifier: (Apache-2.0 OR MIT)
"""Recipe for Spack 1.0 or later. From the checkout, on a machine with network (crates are fetched during the build):

spack repo add packaging/spack/spack_repo/railsqueal
spack dev-build --source-path . railsqueal@main
"""

import os

from spack.package import *
from spack_repo.builtin.build_systems.cargo import CargoPackage


class Railsqueal(CargoPackage):
    """Rolling contact with friction between finite-element bodies, and wheel/rail squeal."""

    license("MIT OR Apache-2.0")

    version("main")
    version("0.2.0")

    variant("python", default=True, description="Pictures, reports and comparisons of results")

    depends_on("c", type="build")
    depends_on("rust@1.87:", type="build")
    # bindgen reads the headers of PETSc, SLEPc, MUMPS, METIS, MPI and HDF5 with libclang.
    depends_on("llvm+clang", type="build")
    depends_on("pkgconfig", type="build")

    depends_on("mpi")
    depends_on("petsc@3.18:3.24 +complex+double+mpi+mumps+metis~int64")
    depends_on("slepc@3.18:3.24")
    depends_on("mumps+double+complex+mpi")
    depends_on("metis@5:~int64~real64")
    # docs/how-to/install.md says which.
    depends_on("hdf5@1.10.7:1.10,1.12.1: +mpi")

    with when("+python"):
        extends("python@3.11:", type=("build", "run"))
        depends_on("py-pip", type="build")
        depends_on("py-setuptools@64:", type="build")
        depends_on("py-wheel", type="build")
        depends_on("py-h5py@3.7:", type=("build", "run"))
        depends_on("py-matplotlib@3.6:", type=("build", "run"))
        depends_on("py-numpy@1.24:", type=("build", "run"))

    conflicts("^openblas+ilp64", msg="BLAS with integers of 64 bit is not supported")

    def setup_build_environment(self, env):
        """Environment in which the build scripts of the crates find the libraries."""
        spec = self.spec
        env.set("PETSC_DIR", spec["petsc"].prefix)
        env.unset("PETSC_ARCH")
        env.set("SLEPC_DIR", spec["slepc"].prefix)
        env.set("MUMPS_DIR", spec["mumps"].prefix)
        env.set("HDF5_DIR", spec["hdf5"].prefix)
        env.set("LIBCLANG_PATH", spec["llvm"].prefix.lib)
        env.append_path("LIBRARY_PATH", spec["metis"].libs.directories[0])
        includes = [f"-I{spec[name].prefix.include}" for name in ("metis", "mpi")]
        env.set("BINDGEN_EXTRA_CLANG_ARGS", " ".join(includes))

    def build(self, spec, prefix):
        """The program alone; the tests of `cargo test` start MPI."""
        cargo("build", "--release", "--locked", "--bin", "railsqueal", f"-j{make_jobs}")

    def install(self, spec, prefix):
        """Installs what `scripts/install` puts beneath a folder, and the Python package by Spack's Python."""
        env = {"RAILSQUEAL_PROGRAM": join_path(self.stage.source_path, "target", "release", "railsqueal")}
        Executable(join_path("scripts", "install"))("--files", str(prefix), extra_env=env)
        if spec.satisfies("+python"):
            pip = spec["python"].command
            pip("-m", "pip", "install", "--no-deps", "--no-build-isolation", f"--prefix={prefix}", "./python")

    def check(self):
        """The library on one rank."""
        cargo("test", "--release", "--locked", "--lib")

    def setup_run_environment(self, env):
        """BLAS threads beside ranks slow each other down."""
        env.set("OPENBLAS_NUM_THREADS", "1")
        if self.spec.satisfies("+python"):
            env.set("RAILSQUEAL_PYTHON", os.path.realpath(self.spec["python"].command.path))
