//! Safe layer on PETSc, SLEPc and MUMPS. It knows no mechanics.

mod aij;
pub mod complex;
pub mod csr;
pub mod eps;
pub mod exchange;
mod handle;
pub mod ksp;
pub mod mumps;
pub mod operator;
mod ordering;
pub mod pep;
pub mod session;
pub mod shell;
pub mod two_sided;

pub use handle::Span;
pub use mumps::{Factor, FactorOptions, FactorStatistics, Ordering, Symmetry};
pub use session::{Petsc, Versions};
