//! Finds PETSc, checks that it is the build these bindings are for, and generates them.

use std::path::{Path, PathBuf};
use std::{env, fs, process};

/// Functions in the bindings. A short list generates in seconds; a broad pattern takes several times as long.
const FUNCTIONS: &[&str] = &[
    // system
    "PetscInitialize",
    "PetscInitialized",
    "PetscFinalize",
    "PetscFinalized",
    "PetscPushErrorHandler",
    "PetscPopErrorHandler",
    "PetscErrorMessage",
    "PetscPopSignalHandler",
    "PetscOptionsSetValue",
    "PetscOptionsClearValue",
    "PetscOptionsHasName",
    "PetscOptionsLeftGet",
    "PetscOptionsLeftRestore",
    "PetscGetVersionNumber",
    "PetscObjectGetComm",
    "PetscObjectReference",
    "PetscMallocGetCurrentUsage",
    // vectors
    "VecCreateMPI",
    "VecCreateMPIWithArray",
    "VecDestroy",
    "VecDuplicate",
    "VecGetArray",
    "VecGetArrayRead",
    "VecRestoreArray",
    "VecRestoreArrayRead",
    "VecGetLocalSize",
    "VecGetOwnershipRange",
    "VecGetSize",
    "VecNorm",
    "VecSet",
    "VecSetBlockSize",
    // matrices
    "MatAssemblyBegin",
    "MatAssemblyEnd",
    "MatCreate",
    "MatCholeskyFactorNumeric",
    "MatCholeskyFactorSymbolic",
    "MatCreateAIJ",
    "MatCreateDense",
    "MatCreateShell",
    "MatCreateVecs",
    "MatDenseGetArray",
    "MatDenseRestoreArray",
    "MatDestroy",
    "MatDuplicate",
    "MatGetFactor",
    "MatGetInfo",
    "MatMatSolve",
    "MatSolve",
    "MatGetLocalSize",
    "MatGetOwnershipRange",
    "MatGetSize",
    "MatMPIAIJSetPreallocation",
    "MatMPIAIJSetPreallocationCSR",
    "MatMPIBAIJSetPreallocation",
    "MatMPISBAIJSetPreallocation",
    "MatMult",
    "MatNullSpaceCreate",
    "MatNullSpaceCreateRigidBody",
    "MatNullSpaceDestroy",
    "MatSeqAIJSetPreallocation",
    "MatSeqBAIJSetPreallocation",
    "MatSeqSBAIJSetPreallocation",
    "MatSetBlockSize",
    "MatSetFromOptions",
    "MatSetNearNullSpace",
    "MatSetOption",
    "MatSetOptionsPrefix",
    "MatSetSizes",
    "MatSetType",
    "MatSetUp",
    "MatSetValues",
    "MatSetValuesBlocked",
    "MatShellGetContext",
    "MatShellSetOperation",
    // linear solvers
    "KSPCreate",
    "KSPDestroy",
    "KSPGetConvergedReason",
    "KSPGetIterationNumber",
    "KSPGetPC",
    "KSPGetResidualNorm",
    "KSPMonitorSet",
    "KSPSetErrorIfNotConverged",
    "KSPSetFromOptions",
    "KSPSetInitialGuessNonzero",
    "KSPSetNormType",
    "KSPSetOperators",
    "KSPSetOptionsPrefix",
    "KSPSetTolerances",
    "KSPSetType",
    "KSPSetUp",
    "KSPSolve",
    "PCApply",
    "PCSetType",
    "PCSetOptionsPrefix",
    "PCGAMGSetType",
    "PCFactorSetMatSolverType",
    "PCFactorGetMatrix",
    "PCShellSetApply",
    "PCShellSetApplyTranspose",
    "PCShellSetContext",
    "PCShellGetContext",
    "MatMumpsGetInfog",
    "MatMumpsSetIcntl",
];

/// Types that appear in no signature above, but in those of packages built on PETSc.
const TYPES: &[&str] = &[
    "PetscBool",
    "PetscReal",
    "PetscInt",
    "PetscInt64",
    "PetscMPIInt",
    "MatStructure",
    "MatOperation",
    "MatInfo",
    "IS",
];

fn main() {
    for variable in ["PETSC_DIR", "PETSC_ARCH", "PKG_CONFIG_PATH"] {
        println!("cargo:rerun-if-env-changed={variable}");
    }
    println!("cargo:rerun-if-changed=wrapper.h");
    let found = find();
    let conf = header(&found.includes, "petscconf.h");
    check(&conf, &found);
    let version = version(&header(&found.includes, "petscversion.h"));
    generate(&found.includes);

    let join = |paths: &[PathBuf]| env::join_paths(paths).map(|p| p.to_string_lossy().into_owned()).unwrap_or_default();
    println!("cargo:include={}", join(&found.includes));
    println!("cargo:lib_dirs={}", join(&found.lib_dirs));
    println!("cargo:pkgconfig={}", found.pkgconfig.as_deref().map(|p| p.display().to_string()).unwrap_or_default());
    println!("cargo:version={version}");
    println!("cargo:int_width={}", if defined(&conf, "PETSC_USE_64BIT_INDICES") { 64 } else { 32 });
    println!("cargo:scalar=complex double");
    println!("cargo:rustc-env=PETSC_SYS_VERSION={version}");
}

/// An installation: where it was found and what pkg-config says of it.
struct Found {
    pkgconfig: Option<PathBuf>,
    includes: Vec<PathBuf>,
    lib_dirs: Vec<PathBuf>,
    origin: String,
}

fn find() -> Found {
    if let Some(dir) = env::var_os("PETSC_DIR").filter(|d| !d.is_empty()) {
        let mut base = PathBuf::from(&dir);
        let mut origin = format!("PETSC_DIR={}", base.display());
        if let Some(arch) = env::var_os("PETSC_ARCH").filter(|a| !a.is_empty()) {
            origin += &format!(", PETSC_ARCH={}", Path::new(&arch).display());
            base.push(arch);
        }
        let pkgconfig = base.join("lib/pkgconfig");
        if !pkgconfig.is_dir() {
            fail(&format!(
                "{origin}: {} does not exist. PETSC_DIR (with PETSC_ARCH for a build in the source tree, \
                 without for an \
                 installed one) must lead to a configured and built PETSc.",
                pkgconfig.display()
            ));
        }
        return probe(Some(pkgconfig), origin);
    }
    // Debian's petsc.pc is an alternative that turns to the real flavour as soon as that one is installed: the complex
    // one is therefore taken from its own directory.
    if let Some(dir) = debian("/usr/lib/petscdir", "petsc") {
        let origin = dir.display().to_string();
        return probe(Some(dir.join("lib/pkgconfig")), origin);
    }
    probe(None, "pkg-config's search path".into())
}

/// The newest complex flavour in Debian's layout, `ROOT/NAME*/*-complex`.
fn debian(root: &str, name: &str) -> Option<PathBuf> {
    let mut found: Vec<(Vec<u32>, PathBuf)> = Vec::new();
    for version in fs::read_dir(root).ok()?.flatten() {
        let file = version.file_name().to_string_lossy().into_owned();
        let Some(number) = file.strip_prefix(name) else { continue };
        let key: Vec<u32> = number.split('.').filter_map(|p| p.parse().ok()).collect();
        for flavour in fs::read_dir(version.path()).into_iter().flatten().flatten() {
            let complex = flavour.file_name().to_string_lossy().ends_with("-complex");
            if complex && !key.is_empty() && flavour.path().join("lib/pkgconfig").is_dir() {
                found.push((key.clone(), flavour.path()));
            }
        }
    }
    found.sort();
    found.pop().map(|(_, path)| path)
}

fn probe(pkgconfig: Option<PathBuf>, origin: String) -> Found {
    if let Some(dir) = &pkgconfig {
        let mut paths = vec![dir.clone()];
        paths.extend(env::var_os("PKG_CONFIG_PATH").iter().flat_map(env::split_paths));
        if let Ok(joined) = env::join_paths(paths) {
            env::set_var("PKG_CONFIG_PATH", joined);
        }
    }
    let attempt = |name| pkg_config::Config::new().atleast_version("3.15").env_metadata(false).probe(name);
    match attempt("petsc").or_else(|first| attempt("PETSc").map_err(|_| first)) {
        Ok(library) => Found { pkgconfig, includes: library.include_paths, lib_dirs: library.link_paths, origin },
        Err(error) => fail(&format!(
            "PETSc was not found in {origin}: {error}\n\
             Install the complex build (Debian: libslepc-complex-dev, which brings libpetsc-complex-dev, and \
             pkg-config), \
             or set PETSC_DIR (and PETSC_ARCH) to a PETSc configured with --with-scalar-type=complex."
        )),
    }
}

/// Text of a header of the installation.
fn header(includes: &[PathBuf], name: &str) -> String {
    for dir in includes {
        if let Ok(text) = fs::read_to_string(dir.join(name)) {
            println!("cargo:rerun-if-changed={}", dir.join(name).display());
            return text;
        }
    }
    fail(&format!(
        "{name} is in none of PETSc's include directories {includes:?}. Install PETSc's development \
     files (Debian: libpetsc-complex-dev)."
    ))
}

fn defined(conf: &str, name: &str) -> bool {
    conf.lines().any(|line| {
        let mut words = line.split_whitespace();
        words.next() == Some("#define") && words.next() == Some(name) && words.next() != Some("0")
    })
}

/// Refuses a PETSc that these bindings, or what is built on them, cannot use.
fn check(conf: &str, found: &Found) {
    let needs = [
        ("PETSC_USE_COMPLEX", "complex scalars (--with-scalar-type=complex; Debian: libpetsc-complex-dev)"),
        ("PETSC_USE_REAL_DOUBLE", "double precision (--with-precision=double)"),
        ("PETSC_HAVE_MUMPS", "the MUMPS interface (--download-mumps --download-scalapack)"),
    ];
    let missing: Vec<_> = needs.iter().filter(|(name, _)| !defined(conf, name)).map(|(_, what)| *what).collect();
    if !missing.is_empty() {
        fail(&format!(
            "the PETSc of {} was built without {}. Point PETSC_DIR and PETSC_ARCH to one that has it.",
            found.origin,
            missing.join(" and without ")
        ));
    }
    if defined(conf, "PETSC_HAVE_64BIT_BLAS_INDICES") {
        fail(&format!(
            "the PETSc of {} calls a BLAS with integers of 64 bits, but MUMPS is called with those of 32 bits \
             beside it. \
             Configure it with a BLAS of 32 bits (without --with-64-bit-blas-indices; OpenBLAS, not its ILP64 build).",
            found.origin
        ));
    }
    if defined(conf, "PETSC_HAVE_MPIUNI") {
        fail(&format!("the PETSc of {} was built without MPI (--with-mpi=0). Use one with MPI.", found.origin));
    }
}

fn version(text: &str) -> String {
    let part = |name: &str| {
        text.lines()
            .filter_map(|l| l.strip_prefix("#define"))
            .find_map(|l| {
                let mut words = l.split_whitespace();
                (words.next() == Some(name)).then(|| words.next()).flatten().map(str::to_owned)
            })
            .unwrap_or_else(|| "?".into())
    };
    format!("{}.{}.{}", part("PETSC_VERSION_MAJOR"), part("PETSC_VERSION_MINOR"), part("PETSC_VERSION_SUBMINOR"))
}

fn generate(includes: &[PathBuf]) {
    let mpi = build_probe_mpi::probe().unwrap_or_else(|errors| {
        fail(&format!(
            "MPI was not found ({errors:?}). Install an MPI with mpicc (Debian: libopenmpi-dev), the \
         one PETSc was built with."
        ))
    });
    let mut builder = bindgen::Builder::default()
        .header("wrapper.h")
        .clang_args(includes.iter().chain(&mpi.include_paths).map(|p| format!("-I{}", p.display())))
        .blocklist_item("MPI_.*|ompi_.*|mpich_.*")
        .blocklist_type("PetscScalar|PetscComplex|PetscErrorCode")
        .allowlist_var("PETSC_(DECIDE|DETERMINE|DEFAULT|SMALL)|PETSC_ERR_[A-Z_]*")
        .derive_debug(false)
        .layout_tests(false)
        .generate_comments(false);
    for name in FUNCTIONS {
        builder = builder.allowlist_function(name);
    }
    for name in TYPES {
        builder = builder.allowlist_type(name);
    }
    let bindings = builder.generate().unwrap_or_else(|error| {
        fail(&format!(
            "bindgen failed on PETSc's headers: {error}\nIt needs libclang and clang's own headers \
         (Debian: libclang1-14 libclang-common-14-dev)."
        ))
    });
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default()).join("bindings.rs");
    // An enumeration up to 3.23, then C's own.
    let text = bindings.to_string();
    let [yes, no] = match text.contains("PetscBool_PETSC_TRUE") {
        true => ["PetscBool_PETSC_TRUE", "PetscBool_PETSC_FALSE"],
        false => ["true", "false"],
    };
    let booleans = format!(
        "/// `PETSC_TRUE` of `petscsystypes.h`.\npub const PETSC_TRUE: PetscBool = {yes};\n/// `PETSC_FALSE` of \
         `petscsystypes.h`.\npub const PETSC_FALSE: PetscBool = {no};\n"
    );
    if let Err(error) = std::fs::write(&out, text + &booleans) {
        fail(&format!("{}: {error}", out.display()));
    }
}

fn fail(message: &str) -> ! {
    eprintln!("\npetsc-sys: {message}\n");
    process::exit(1);
}
