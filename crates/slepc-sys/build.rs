//! Finds the SLEPc that belongs to the PETSc of `petsc-sys`, and generates the bindings.

use std::path::{Path, PathBuf};
use std::{env, fs, process};

/// Functions in the bindings.
const FUNCTIONS: &[&str] = &[
    "SlepcInitialize",
    "SlepcInitialized",
    "SlepcFinalize",
    "SlepcGetVersionNumber",
    "EPS(Create|Destroy|Solve|SetUp|SetOperators|SetProblemType|SetType|SetDimensions|SetTolerances)",
    "EPS(SetWhichEigenpairs|SetTarget|SetInitialSpace|SetOptionsPrefix|SetFromOptions|SetConvergenceTest)",
    "EPS(GetConverged|GetConvergedReason|GetEigenpair|GetEigenvalue|GetEigenvector|GetIterationNumber|GetST|GetBV)",
    "EPS(MonitorSet|KrylovSchurSetRestart|KrylovSchurSetLocking|GetDimensions|GetTolerances|SetStoppingTestFunction)",
    "EPS(SetTrueResidual|SetPurify|KrylovSchurSetDimensions|StoppingBasic|SetTwoSided|SetEigenvalueComparison)",
    "EPS(SetLeftInitialSpace|GetLeftEigenvector|SetDeflationSpace)",
    "ST(SetType|GetKSP|GetMatrix|SetShift|ShellSetApply|ShellSetApplyTranspose|ShellSetBackTransform|ShellSetContext|ShellGetContext)",
    "ST(SetMatStructure|SetTransform|SetMatMode|SetOptionsPrefix|SetFromOptions)",
    "BV(SetType|SetOrthogonalization|GetSizes|SetMatMultMethod)",
    "PEP(Create|Destroy|Solve|SetUp|SetOperators|SetProblemType|SetType|SetDimensions|SetTolerances|SetScale)",
    "PEP(SetWhichEigenpairs|SetTarget|SetInitialSpace|SetOptionsPrefix|SetFromOptions|SetConvergenceTest|SetRefine|SetExtract)",
    "PEP(GetConverged|GetConvergedReason|GetEigenpair|GetIterationNumber|GetST|MonitorSet|TOARSetLocking|TOARSetRestart|GetDimensions)",
];

fn main() {
    for variable in ["SLEPC_DIR", "PETSC_DIR", "PETSC_ARCH", "PKG_CONFIG_PATH"] {
        println!("cargo:rerun-if-env-changed={variable}");
    }
    println!("cargo:rerun-if-changed=wrapper.h");
    let petsc_includes: Vec<PathBuf> =
        env::split_paths(&env::var_os("DEP_PETSC_INCLUDE").unwrap_or_default()).collect();
    let petsc_pkgconfig = env::var("DEP_PETSC_PKGCONFIG").unwrap_or_default();
    let petsc_version = env::var("DEP_PETSC_VERSION").unwrap_or_default();

    let directory = find(Path::new(&petsc_pkgconfig));
    let mut paths: Vec<PathBuf> = directory.iter().cloned().collect();
    // slepc.pc requires petsc: the same one.
    if !petsc_pkgconfig.is_empty() {
        paths.push(petsc_pkgconfig.into());
    }
    paths.extend(env::var_os("PKG_CONFIG_PATH").iter().flat_map(env::split_paths));
    if let Ok(joined) = env::join_paths(paths) {
        env::set_var("PKG_CONFIG_PATH", joined);
    }
    let origin = directory.map(|d| d.display().to_string()).unwrap_or_else(|| "pkg-config's search path".into());
    let attempt = |name| pkg_config::Config::new().env_metadata(false).probe(name);
    let library = attempt("slepc").or_else(|first| attempt("SLEPc").map_err(|_| first)).unwrap_or_else(|error| {
        fail(&format!(
            "SLEPc was not found in {origin}: {error}\n\
             Install its complex build (Debian: libslepc-complex-dev), or set SLEPC_DIR to one built on the \
             PETSc of PETSC_DIR."
        ))
    });
    let release = |v: &str| v.split('.').take(2).map(str::to_owned).collect::<Vec<_>>();
    if release(&library.version) != release(&petsc_version) {
        fail(&format!(
            "SLEPc {} ({origin}) does not belong to PETSc {petsc_version}: the first two numbers must be equal. \
             Set SLEPC_DIR to the SLEPc built on that PETSc.",
            library.version
        ));
    }
    generate(&library.include_paths, &petsc_includes);
    let join = |paths: &[PathBuf]| env::join_paths(paths).map(|p| p.to_string_lossy().into_owned()).unwrap_or_default();
    println!("cargo:lib_dirs={}", join(&library.link_paths));
    println!("cargo:version={}", library.version);
    println!("cargo:rustc-env=SLEPC_SYS_VERSION={}", library.version);
}

/// Directory of slepc.pc; `None` leaves the choice to pkg-config.
fn find(petsc_pkgconfig: &Path) -> Option<PathBuf> {
    if let Some(dir) = env::var_os("SLEPC_DIR").filter(|d| !d.is_empty()) {
        let base = PathBuf::from(dir);
        let arch = env::var_os("PETSC_ARCH").filter(|a| !a.is_empty()).map(|a| base.join(a).join("lib/pkgconfig"));
        let tried: Vec<PathBuf> = arch.into_iter().chain([base.join("lib/pkgconfig")]).collect();
        return Some(tried.iter().find(|p| p.is_dir()).cloned().unwrap_or_else(|| {
            fail(&format!("SLEPC_DIR={}: no built SLEPc there (looked for {tried:?}).", base.display()))
        }));
    }
    // PETSc configured with --download-slepc puts SLEPc into its own prefix.
    if ["slepc.pc", "SLEPc.pc"].iter().any(|pc| petsc_pkgconfig.join(pc).is_file()) {
        return Some(petsc_pkgconfig.to_path_buf());
    }
    // Debian: /usr/lib/petscdir/petsc3.18/ARCH-complex -> /usr/lib/slepcdir/slepc3.18/ARCH-complex.
    let text = petsc_pkgconfig.to_string_lossy();
    let debian = PathBuf::from(text.replace("/petscdir/petsc", "/slepcdir/slepc"));
    (text.contains("/petscdir/petsc") && fs::metadata(&debian).is_ok()).then_some(debian)
}

fn generate(includes: &[PathBuf], petsc_includes: &[PathBuf]) {
    let mpi = build_probe_mpi::probe().unwrap_or_else(|errors| fail(&format!("MPI was not found ({errors:?}).")));
    let mut builder = bindgen::Builder::default()
        .header("wrapper.h")
        .clang_args(
            includes.iter().chain(petsc_includes).chain(&mpi.include_paths).map(|p| format!("-I{}", p.display())),
        )
        .blocklist_file(".*/petsc[^/]*\\.h")
        .blocklist_item("MPI_.*|ompi_.*|mpich_.*")
        .derive_debug(false)
        .layout_tests(false)
        .generate_comments(false);
    for name in FUNCTIONS {
        builder = builder.allowlist_function(name);
    }
    let bindings = builder.generate().unwrap_or_else(|error| {
        fail(&format!(
            "bindgen failed on SLEPc's headers: {error}\nIt needs libclang and clang's own headers \
         (Debian: libclang1-14 libclang-common-14-dev)."
        ))
    });
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default()).join("bindings.rs");
    if let Err(error) = bindings.write_to_file(&out) {
        fail(&format!("{}: {error}", out.display()));
    }
}

fn fail(message: &str) -> ! {
    eprintln!("\nslepc-sys: {message}\n");
    process::exit(1);
}
