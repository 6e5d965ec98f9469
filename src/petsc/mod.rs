//! Safe layer on PETSc, SLEPc and MUMPS. It knows no mechanics.

pub mod csr;
