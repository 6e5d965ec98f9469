//! Raw bindings to the C interface of MUMPS in real double and single precision, generated against the installed `dmumps_c.h` and `smumps_c.h`.
//!
//! Where MUMPS is looked for: `MUMPS_DIR`, the PETSc build of `PETSC_DIR`/`PETSC_ARCH` (which brings it with
//! `--download-mumps`), then the system's directories. Debian's variant with SCOTCH orderings is preferred.

#![allow(non_upper_case_globals, non_camel_case_types, non_snake_case, missing_docs, clippy::all)]

include!(concat!(env!("OUT_DIR"), "/bindings.rs"));

/// Version of the headers these bindings were generated from.
pub const VERSION: &str = env!("MUMPS_SYS_VERSION");
