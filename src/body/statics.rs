//! Static solves with the stiffness of a body, by the method the job selects.

use crate::petsc::mumps::Factor;
use crate::Result;
use faer::Mat;

/// Solver of K u = f for one body.
pub enum Statics<'w> {
    /// Factorisation of K.
    Direct(Factor<'w>),
}

impl Statics<'_> {
    /// Collective: solves in place; `f` holds this rank's degrees of freedom, N in, m out.
    pub fn solve(&mut self, f: &mut [f64]) -> Result<()> {
        match self {
            Statics::Direct(factor) => factor.solve(f, 1),
        }
    }

    /// Collective: entries of K⁻¹ at `rows` × `rows` (the same on every rank), m/N, on rank 0.
    pub fn inverse_block(&mut self, rows: &[u64]) -> Result<Mat<f64>> {
        match self {
            Statics::Direct(factor) => factor.inverse_block(rows),
        }
    }
}
