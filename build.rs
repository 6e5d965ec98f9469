//! Linker arguments of the final binary: the order of MUMPS, and run-time paths of libraries outside the system's
//! directories. Passes the versions found on to the program.

use std::path::Path;
use std::{env, process::Command};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let dep = |name: &str| env::var(name).unwrap_or_default();
    for (variable, value) in [
        ("RAILSQUEAL_PETSC_VERSION", dep("DEP_PETSC_VERSION")),
        ("RAILSQUEAL_SLEPC_VERSION", dep("DEP_SLEPC_VERSION")),
        ("RAILSQUEAL_MUMPS_VERSION", dep("DEP_DMUMPS_VERSION")),
        ("RAILSQUEAL_PETSC_SCALAR", dep("DEP_PETSC_SCALAR")),
        ("RAILSQUEAL_PETSC_INT_WIDTH", dep("DEP_PETSC_INT_WIDTH")),
    ] {
        println!("cargo:rustc-env={variable}={value}");
    }
    if dep("DEP_DMUMPS_VARIANT") == "_ptscotch" {
        mumps_with_scotch(&dep("DEP_DMUMPS_VERSION"));
    }
    let directories = [dep("DEP_PETSC_LIB_DIRS"), dep("DEP_SLEPC_LIB_DIRS"), dep("DEP_DMUMPS_LIB_DIR")];
    for dir in directories.iter().flat_map(env::split_paths) {
        // Debian's own directories hold links to files the loader finds by itself.
        if dir.as_os_str().is_empty() || dir.starts_with("/usr/lib") {
            continue;
        }
        println!("cargo:rustc-link-arg=-Wl,-rpath,{}", dir.display());
    }
}

/// PETSc is linked to Debian's default MUMPS, whose only ordering is PORD. The same libraries built with SCOTCH, loaded
/// before them, take their place: complex factorisations are then a quarter faster.
fn mumps_with_scotch(version: &str) {
    let number = version.split('.').take(2).collect::<Vec<_>>().join(".");
    let names = ["zmumps", "dmumps", "mumps_common"].map(|base| format!("lib{base}_ptscotch-{number}.so"));
    let compiler = env::var("CC").unwrap_or_else(|_| "cc".into());
    let found = |file: &String| {
        let answer = Command::new(&compiler).arg(format!("-print-file-name={file}")).output();
        answer.is_ok_and(|o| Path::new(String::from_utf8_lossy(&o.stdout).trim()).is_file())
    };
    if names.iter().all(found) {
        let list = names.map(|n| format!("-l:{n}")).join(",");
        println!("cargo:rustc-link-arg=-Wl,--push-state,--no-as-needed,{list},--pop-state");
    }
}
