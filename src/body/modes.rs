//! Free-interface modes: how many to ask for, and what makes a list of them complete.

use super::clusters;
use super::fe::{BodyModes, FeBody};
use super::statics::Statics;
use crate::eigen::sparse::{self, Method, ModesOptions};
use crate::eigen::FoundModes;
use crate::parallel::World;
use crate::petsc::mumps::{Factor, FactorOptions, Symmetry};
use crate::petsc::session::Petsc;
use crate::{Error, Result};

/// Which modes are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Extent {
    /// This many, the lowest first.
    Count(usize),
    /// All up to this frequency, Hz.
    MaxFrequency(f64),
}

/// Modes computed beyond the wanted ones, to see where the last cluster ends.
const BEYOND: usize = 3;

/// Collective: the modes of `body`, computed by `method`. `statics` holds its factorisation. Rigid motions that are
/// free come first, exactly at 0.
pub fn compute(
    petsc: &Petsc,
    body: &FeBody,
    statics: &mut Statics,
    extent: Extent,
    method: Method,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<BodyModes> {
    let world = petsc.world();
    let order = body.dofs.total() as usize;
    let named = |e: Error| e.context(format!("modes of body \"{}\"", body.name));
    let (count, limit) = match extent {
        Extent::Count(n) => (n, f64::INFINITY),
        Extent::MaxFrequency(f) => {
            let limit = (2.0 * std::f64::consts::PI * f).powi(2);
            (count_below(world, body, limit).map_err(named)?, limit)
        }
    };
    if count > order {
        return Err(Error::Job(format!(
            "analyses.modes.count: {count} modes are asked for, but body \"{}\" has only {order} degrees of freedom",
            body.name
        )));
    }
    let pencil = sparse::DistributedMatrices::new(world, &body.operators.stiffness, &body.operators.mass);
    let pencil = pencil.knowing(&body.rigid.shapes);
    let rigid = body.rigid.len();
    let mut wanted = (count.max(rigid) + BEYOND).min(order);
    loop {
        let asked = |count| ModesOptions { sigma: 0.0, count, method, prefix: format!("{}_", body.name) };
        let mut found = match &mut *statics {
            Statics::Direct(factor) => {
                sparse::modes(petsc, factor, &pencil, &asked(wanted), progress).map_err(named)?
            }
            Statics::InertiaRelief(balanced) => {
                sparse::beside_known(petsc, &pencil, &mut **balanced, &asked(wanted - rigid), progress)
                    .map_err(named)?
            }
            Statics::Iterative(_) => return Err(Error::Defect("modes without a factorisation".into())),
        };
        complete(world, body, &mut found);
        let omega: Vec<f64> = found.lambda.iter().map(|&l| l.max(0.0).sqrt()).collect();
        let keep = match clusters::cut(&omega, count) {
            Some(end) => end,
            None if omega.len() >= order => omega.len(),
            None => {
                wanted = (omega.len() + omega.len() / 4 + BEYOND).min(order);
                continue;
            }
        };
        let below = found.lambda.iter().filter(|&&l| l <= limit).count();
        if limit.is_finite() && below != count {
            return Err(Error::NotConverged(format!(
                "modes of body \"{}\": {count} eigenvalues lie below the frequency limit by the inertia of the \
                 shifted matrix, but {below} were found",
                body.name
            )));
        }
        let mut vectors = found.vectors;
        vectors.truncate(keep);
        return Ok(BodyModes { omega: omega[..keep].to_vec(), residual: found.residuals[..keep].to_vec(), vectors });
    }
}

/// Collective: puts the rigid motions before the elastic modes, which are freed of what rounding has left of them,
/// and clears what is clamped.
fn complete(world: &World, body: &FeBody, found: &mut FoundModes) {
    for vector in &mut found.vectors {
        body.rigid.deform(world, vector, 1);
        body.effect.clear(&body.dofs, vector);
    }
    let rigid = body.rigid.len();
    found.lambda.splice(..0, std::iter::repeat_n(0.0, rigid));
    found.residuals.splice(..0, std::iter::repeat_n(0.0, rigid));
    found.vectors.splice(..0, body.rigid.shapes.iter().cloned());
}

/// Collective: number of eigenvalues below `limit` (1/s²), from the inertia of K − limit·M (Sylvester's law).
fn count_below(world: &World, body: &FeBody, limit: f64) -> Result<usize> {
    let shifted = body.operators.stiffness.minus_scaled(limit, &body.operators.mass);
    let factor = Factor::new(world, &shifted, FactorOptions::new(Symmetry::Indefinite), "K - ω²M")?;
    Ok(factor.negative_pivots() as usize)
}
