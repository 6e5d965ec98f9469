//! The paper's solver: a fixed point on the reactions, R ← Proj(R − ρ u), its equation (3) with nodal quadrature.
//!
//! ρ_i = 1/(λ W_ii) with λ the largest eigenvalue of W scaled by its diagonal: R − ρ W R is then a contraction in every
//! direction, fastest where W is softest (ρ < 2/(λ W_ii) is the limit for frictionless contact; friction, which is not
//! the gradient of an energy, takes part of the margin). Where a total force is prescribed the projection is that
//! on the reactions which have it.

use super::problem::{Effort, StepProblem, StepSolution};
use crate::contact::law::project_disc;
use crate::{Error, Result};

/// Solves to the residual `target`, N, in at most `most` iterations: the slowest direction of W converges like
/// (1 − 1/condition)ⁿ.
pub(super) fn solve(
    p: &StepProblem<'_>,
    target: f64,
    guess: &[f64],
    mut shift: [f64; 3],
    most: usize,
    effort: &mut Effort,
) -> Result<StepSolution> {
    let k = p.nodes();
    let factor = 1.0 / largest_eigenvalue(p, effort);
    let mut reaction = guess.to_vec();
    let mut response = vec![0.0; 3 * k];
    let mut last = f64::INFINITY;
    for _ in 0..most {
        p.matrix.times(&reaction, &mut response);
        effort.products += 1;
        effort.iterations += 1;
        let u = p.displacement(&response, shift);
        let (residual, status) = p.residual(&reaction, &u);
        last = residual;
        if residual <= target {
            return Ok(StepSolution { reaction, shift, response, status, friction: Vec::new(), residual });
        }
        if !residual.is_finite() {
            break;
        }
        project(p, factor, &mut reaction, &u, &mut shift);
    }
    Err(Error::NotConverged(format!(
        "contact of a time step: the fixed point on the reactions stopped at a residual of {last:.2e} N, \
         {target:.2e} N was asked for"
    )))
}

/// Largest eigenvalue of W scaled by its diagonal, by power iteration, rounded up.
fn largest_eigenvalue(p: &StepProblem<'_>, effort: &mut Effort) -> f64 {
    let k = p.nodes();
    let root: Vec<f64> = (0..k)
        .flat_map(|i| {
            let r = p.rho(i);
            [r.tangential.sqrt(), r.tangential.sqrt(), r.normal.sqrt()]
        })
        .collect();
    let mut x: Vec<f64> = (0..3 * k).map(|i| 1.0 + 0.1 * ((i * 7 % 11) as f64)).collect();
    let (mut value, mut y) = (1.0, vec![0.0; 3 * k]);
    for _ in 0..30 {
        let norm = x.iter().map(|v| v * v).sum::<f64>().sqrt();
        let scaled: Vec<f64> = x.iter().zip(&root).map(|(v, r)| v / norm * r).collect();
        p.matrix.times(&scaled, &mut y);
        effort.products += 1;
        x = y.iter().zip(&root).map(|(v, r)| v * r).collect();
        value = x.iter().map(|v| v * v).sum::<f64>().sqrt();
    }
    1.1 * value.max(1.0)
}

/// R ← Proj(R − ρ (u + change of shift)), with the shift that gives the prescribed totals.
fn project(p: &StepProblem<'_>, factor: f64, reaction: &mut [f64], u: &[f64], shift: &mut [f64; 3]) {
    let k = p.nodes();
    let rho: Vec<_> = (0..k).map(|i| p.rho(i)).collect();
    let pressure = |i: usize, s: f64| (reaction[3 * i + 2] - factor * rho[i].normal * (u[3 * i + 2] + s)).max(0.0);
    let mut change = [0.0; 3];
    if let Some(total) = p.total[2] {
        let sum = |s: f64| (0..k).map(|i| pressure(i, s)).sum::<f64>() - total;
        change[2] = root(sum, (0..k).map(|i| factor * rho[i].normal).sum::<f64>(), total);
    }
    let normal: Vec<f64> = (0..k).map(|i| pressure(i, change[2])).collect();
    let old = &*reaction;
    let traction = |i: usize, s: [f64; 2]| {
        let bound = normal[i] * p.coefficient(i, [u[3 * i], u[3 * i + 1]]);
        let f = factor * rho[i].tangential;
        project_disc([old[3 * i] - f * (u[3 * i] + s[0]), old[3 * i + 1] - f * (u[3 * i + 1] + s[1])], bound)
    };
    for c in 0..2 {
        if let Some(total) = p.total[c] {
            let mut s = [change[0], change[1]];
            let slope = (0..k).map(|i| factor * rho[i].tangential).sum::<f64>();
            let size: f64 = normal.iter().sum();
            change[c] = root(
                |v| {
                    s[c] = v;
                    (0..k).map(|i| traction(i, s)[c]).sum::<f64>() - total
                },
                slope,
                size,
            );
        }
    }
    let new: Vec<[f64; 2]> = (0..k).map(|i| traction(i, [change[0], change[1]])).collect();
    for (i, t) in new.iter().enumerate() {
        reaction[3 * i..3 * i + 3].copy_from_slice(&[t[0], t[1], normal[i]]);
    }
    for c in 0..3 {
        shift[c] += change[c];
    }
}

/// Root of a falling function whose slope is −`slope` at the steepest, where there is one; `size` is the size of its
/// values.
fn root(mut f: impl FnMut(f64) -> f64, slope: f64, size: f64) -> f64 {
    let at_zero = f(0.0);
    if at_zero == 0.0 {
        return 0.0;
    }
    let sign = at_zero.signum();
    let (mut near, mut far) = (0.0, sign * at_zero.abs() / slope);
    // A force that friction cannot carry has no root: the shift then grows from step to step of the fixed point.
    for _ in 0..60 {
        if f(far) * sign <= 0.0 {
            break;
        }
        near = far;
        far *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (near + far);
        if middle == near || middle == far {
            break;
        }
        let v = f(middle);
        if v * sign > 0.0 {
            near = middle;
        } else {
            far = middle;
        }
        if v.abs() < 1e-16 * size {
            return middle;
        }
    }
    0.5 * (near + far)
}
