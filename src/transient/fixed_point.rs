//! The paper's solver: a fixed point on the reactions, R ← Proj(R − ρ u), its equation (3) with nodal quadrature.
//!
//! ρ_i = 1/(λ W_ii) with λ the largest eigenvalue of W scaled by its diagonal: R − ρ W R is then a contraction in every
//! direction, fastest where W is softest (ρ < 2/(λ W_ii) is the limit for frictionless contact; friction, which is not
//! the gradient of an energy, takes part of the margin). Where resultants are prescribed the
//! projection is that on the reactions which have them.

use super::problem::{Effort, StepProblem, StepSolution};
use crate::contact::law::project_disc;
use crate::{Error, Result};

/// Solves to the residual `target`, N, in at most `most` iterations: the slowest direction of W converges like
/// (1 − 1/condition)ⁿ.
pub(super) fn solve(
    p: &StepProblem<'_>,
    target: f64,
    guess: &[f64],
    mut shift: Vec<f64>,
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
        let u = p.displacement(&response, &shift);
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

/// R ← Proj(R − ρ (u + change of shift)), with the shifts that give the prescribed resultants: each by itself, those
/// along the normal first; what it has of others, and of the tractions, is that of the iteration before.
fn project(p: &StepProblem<'_>, factor: f64, reaction: &mut [f64], u: &[f64], shift: &mut [f64]) {
    let k = p.nodes();
    let rho: Vec<_> = (0..k).map(|i| p.rho(i)).collect();
    let old = reaction.to_vec();
    let mut change = vec![0.0; shift.len()];
    let pressure = |i: usize, change: &[f64]| {
        let moved = u[3 * i + 2] + p.shifted(i, change)[2];
        (old[3 * i + 2] - factor * rho[i].normal * moved).max(0.0)
    };
    for (b, border) in p.borders.iter().enumerate().filter(|(_, b)| b.is_normal()) {
        let row = |i: usize| border.row[p.patch_of(i)];
        let rubbed = |i: usize| row(i)[0] * old[3 * i] + row(i)[1] * old[3 * i + 1];
        let total = border.total - (0..k).map(rubbed).sum::<f64>();
        let steepest = |i: usize| factor * rho[i].normal * border.column[p.patch_of(i)][2] * row(i)[2];
        let slope = (0..k).map(steepest).sum::<f64>();
        let mut all = change.clone();
        let sum = |s: f64| {
            all[b] = s;
            (0..k).map(|i| row(i)[2] * pressure(i, &all)).sum::<f64>() - total
        };
        change[b] = root(sum, slope, border.total.abs());
    }
    let normal: Vec<f64> = (0..k).map(|i| pressure(i, &change)).collect();
    let traction = |i: usize, change: &[f64]| {
        let bound = normal[i] * p.coefficient(i, [u[3 * i], u[3 * i + 1]]);
        let (f, moved) = (factor * rho[i].tangential, p.shifted(i, change));
        let along = |c: usize| old[3 * i + c] - f * (u[3 * i + c] + moved[c]);
        project_disc([along(0), along(1)], bound)
    };
    for (b, border) in p.borders.iter().enumerate() {
        if let Some(c) = border.tangential() {
            let mut all = change.clone();
            let slope = (0..k).map(|i| factor * rho[i].tangential).sum::<f64>();
            let size: f64 = normal.iter().sum();
            change[b] = root(
                |v| {
                    all[b] = v;
                    (0..k).map(|i| traction(i, &all)[c]).sum::<f64>() - border.total
                },
                slope,
                size,
            );
        }
    }
    for (i, r) in reaction.chunks_exact_mut(3).enumerate() {
        let [x, y] = traction(i, &change);
        r.copy_from_slice(&[x, y, normal[i]]);
    }
    shift.iter_mut().zip(&change).for_each(|(s, c)| *s += c);
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
