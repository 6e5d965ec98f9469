//! Modes of a swept body, order by order, and the proof that none is missing.

use super::krylov;
use super::Forms;
use crate::{Error, Result};
use faer::Mat;
use std::f64::consts::PI;

/// Eigenvalues smaller than this part of the shift are rigid-body motions.
const RIGID: f64 = 1e-6;
/// Orders without modes below the limit after which higher ones are not looked at.
const EMPTY: usize = 2;
/// Limits this much apart, relatively, are tried where one meets an eigenvalue.
const ASIDE: f64 = 1e-8;

/// The modes of one order of Fourier. For n ≥ 1 each stands for a pair, one of either family.
#[derive(Debug, Clone)]
pub struct Modes {
    /// Number of nodal diameters n.
    pub order: usize,
    /// Angular frequencies, rad/s, ascending; 0 for rigid-body motions.
    pub omega: Vec<f64>,
    /// Amplitudes of the section, 1/√kg, `[amplitudes, m]`, with ΦᵀMΦ = 1 all round.
    pub vectors: Mat<f64>,
    /// |K_n φ − ω²Mφ| / (|ω² − σ| |Mφ|), `[m]`, with the shift σ of the method.
    pub residual: Vec<f64>,
}

impl Modes {
    /// Families of an order: two that are each other turned, one of order 0.
    pub fn families(order: usize) -> usize {
        if order == 0 {
            1
        } else {
            2
        }
    }

    /// Modes of both families.
    pub fn count(&self) -> usize {
        Self::families(self.order) * self.omega.len()
    }
}

/// Number of eigenvalues of the order `n` below ω = `limit`, rad/s, from the inertia of K_n − ω²M.
pub fn below(forms: &Forms, n: usize, limit: f64) -> Result<usize> {
    let mut found = forms.factor(n, limit * limit);
    for step in 1..4 {
        if found.is_ok() {
            break;
        }
        found = forms.factor(n, limit * limit * (1.0 + f64::from(step) * ASIDE));
    }
    Ok(found?.negative())
}

/// All modes of the order `n` up to ω = `limit`, rad/s; as many as the inertia of K_n − ω²M says.
pub fn of_order(forms: &Forms, n: usize, limit: f64) -> Result<Modes> {
    let count = below(forms, n, limit)?;
    if count == 0 {
        return Ok(Modes { order: n, omega: Vec::new(), vectors: Mat::zeros(forms.order(), 0), residual: Vec::new() });
    }
    let sigma = forms.shift();
    let factor = forms.factor(n, sigma)?.positive("K − σM of a section")?;
    let pairs = krylov::lowest(forms, n, sigma, &factor, count)?;
    let found = pairs.lambda.iter().filter(|&&l| l <= limit * limit * (1.0 + 4.0 * ASIDE)).count();
    if found != count {
        return Err(Error::NotConverged(format!(
            "modes of order {n}: {count} eigenvalues lie below {:.3} Hz by the inertia of the shifted matrix, but {found} were found",
            limit / (2.0 * PI)
        )));
    }
    let vectors = pairs.vectors.as_ref().subcols(0, count).to_owned();
    let lambda = &pairs.lambda[..count];
    let mass = forms.mass(n, vectors.as_ref());
    let residual = forms.dynamic(n, 0.0, vectors.as_ref());
    let size = |k: usize| {
        let off = residual.col(k).iter().zip(mass.col(k).iter()).map(|(r, m)| (r - lambda[k] * m).powi(2)).sum::<f64>();
        off.sqrt() / ((lambda[k] - sigma).abs() * mass.col(k).norm_l2())
    };
    let residual = (0..count).map(size).collect();
    let root = |&l: &f64| if l.abs() <= RIGID * sigma.abs() { 0.0 } else { l.max(0.0).sqrt() };
    Ok(Modes { order: n, omega: lambda.iter().map(root).collect(), vectors, residual })
}

/// Modes by orders, those without any left out, until `of` finds none in some orders on end; it is given the orders to look at, as many as `together`.
pub fn by_orders(together: usize, mut of: impl FnMut(Vec<usize>) -> Result<Vec<Modes>>) -> Result<Vec<Modes>> {
    let mut all = Vec::new();
    let (mut next, mut empty) = (0, 0);
    // Beyond n = 2 the lowest frequency of an order rises with it.
    while empty < EMPTY || next <= 3 {
        for modes in of((next..next + together.max(1)).collect())? {
            empty = if modes.omega.is_empty() { empty + 1 } else { 0 };
            all.extend(Some(modes).filter(|m| !m.omega.is_empty()));
        }
        next += together.max(1);
    }
    Ok(all)
}

/// The limit, rad/s, up to which `up_to` finds more than `count` modes, and those, both families counted.
pub fn lowest(
    forms: &Forms,
    count: usize,
    mut up_to: impl FnMut(f64) -> Result<Vec<Modes>>,
) -> Result<(Vec<Modes>, f64)> {
    let most = 2 * forms.order();
    if count > most {
        return Err(Error::Job(format!(
            "{count} modes are asked for, expected at most {most}, which the section has at two orders"
        )));
    }
    let mut limit = 4.0 * forms.shift().abs().sqrt();
    loop {
        let all = up_to(limit)?;
        let found: usize = all.iter().map(Modes::count).sum();
        if found > count {
            return Ok((all, limit));
        }
        // The number of modes of a plate goes with the frequency, that of a solid with its cube.
        let ratio = (count + 4) as f64 / found.max(1) as f64;
        limit *= ratio.sqrt().clamp(1.15, 3.0);
    }
}
