//! Real symmetric generalised eigenproblems K x = λ M x, K symmetric, M positive definite: the pairs nearest to a
//! shift, or all of a band, by a block method on factorisations of K − σM. Everything is real and distributed by
//! rows. It knows no mechanics, and no library but that of dense matrices: operators come as [`Pencil`] and
//! [`Shifted`].

mod block;
mod check;
mod lanczos;
mod orthonormal;
pub(crate) mod projection;
pub mod quadratic;
mod slices;
pub mod sparse;

pub use check::FoundModes;
pub use lanczos::Sizes;
pub use slices::{band, lowest, MovableShift};

use crate::parallel::World;
use crate::{Error, Result};
use faer::MatRef;
use lanczos::Goal;

/// K and M, of which each rank holds some rows.
pub trait Pencil {
    /// The ranks.
    fn world(&self) -> &World;
    /// Order of the matrices.
    fn order(&self) -> u64;
    /// Number of rows on this rank.
    fn n_local(&self) -> usize;
    /// Collective: Y = K X, both `[n_local, columns]` column by column.
    fn stiffness(&self, x: &[f64], y: &mut [f64], columns: usize);
    /// Collective: Y = M X, both `[n_local, columns]` column by column.
    fn mass(&self, x: &[f64], y: &mut [f64], columns: usize);
    /// Eigenvectors that are known beforehand and not sought, orthonormal in M, `[n_local, known]`.
    fn known_vectors(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&[], self.n_local(), 0)
    }
}

/// The inverse of K − σM.
pub trait Shifted {
    /// σ.
    fn sigma(&self) -> f64;
    /// Collective: X = (K − σM)⁻¹ X, `[n_local, columns]` column by column.
    fn solve(&mut self, x: &mut [f64], columns: usize) -> Result<()>;
    /// Number of eigenvalues below σ, from the inertia of K − σM.
    fn below(&self) -> u64;
    /// Block and basis for `count` pairs, by what a pass through the inverse costs.
    fn sizes(&self, count: usize) -> Sizes {
        Sizes::for_count(count)
    }
}

/// Collective: at least the `count` pairs whose eigenvalues are nearest to the shift. `progress` is told converged
/// and wanted pairs.
pub fn nearest(
    pencil: &dyn Pencil,
    shifted: &mut dyn Shifted,
    count: usize,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<FoundModes> {
    let sizes = shifted.sizes(count);
    nearest_by(pencil, shifted, count, sizes, progress)
}

/// Collective: the same with blocks and a basis of one's own, to measure what they cost.
pub fn nearest_by(
    pencil: &dyn Pencil,
    shifted: &mut dyn Shifted,
    count: usize,
    sizes: Sizes,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<FoundModes> {
    if count == 0 || pencil.order() == 0 {
        return Ok(FoundModes::default());
    }
    enough(count, pencil.order())?;
    let found = lanczos::run(pencil, shifted, pencil.known_vectors(), Goal::Nearest(count), sizes, progress)?;
    if found.theta.len() < count {
        return Err(Error::NotConverged(format!(
            "only {} of {count} modes have finite frequency: the mass matrix is singular",
            found.theta.len()
        )));
    }
    let sigma = shifted.sigma();
    let lambda: Vec<f64> = found.theta.iter().map(|t| sigma + 1.0 / t).collect();
    let mut modes = check::checked(pencil, sigma, &lambda, found.vectors)?;
    (modes.iterations, modes.solves) = (found.restarts, found.solves);
    Ok(modes)
}

/// Refuses more pairs than there are.
pub(crate) fn enough(count: usize, order: u64) -> Result<()> {
    if count as u64 > order {
        return Err(Error::Job(format!(
            "{count} modes were asked for, but there are only {order} degrees of freedom; ask for fewer or \
             refine the mesh"
        )));
    }
    Ok(())
}
