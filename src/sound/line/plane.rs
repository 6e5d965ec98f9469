//! The exterior problem of Helmholtz in the plane of a section.

use super::kernel::Line;
use crate::sound::panels::{Integrals, PanelSurface};
use crate::{Error, Result};
use faer::linalg::solvers::{Solve, SolveLstsq};
use faer::{Mat, MatRef};
use num_complex::Complex64;
use std::f64::consts::PI;

/// Directions beside those that resolve the waves over the circumference, twice as many as waves in the power.
const DIRECTIONS: usize = 12;

/// Number of directions, evenly spread, that tell the power of a surface that reaches `farthest`, m, from the origin,
/// at the wavenumber `kappa`, 1/m.
pub fn directions(kappa: f64, farthest: f64) -> usize {
    DIRECTIONS + (2.5 * kappa * farthest).ceil() as usize
}

/// The surface pressures over iωρ, m, `[nodes, m]`, of normal velocities at the nodes, outward, `[nodes, m]`, in the
/// plane with the wavenumber `kappa`, 1/m: ½p = ∫ p ∂G/∂n′ ds + iωρ ∫ v G ds; at points inside the section, a quarter
/// of a wave length apart, p = 0 is asked for in place of ½p, so that its resonances are not seen (H. A. Schenck, J.
/// Acoust. Soc. Am. 44 (1968) 41–58). Errors: not converged.
pub fn pressures(surface: &PanelSurface, kappa: f64, velocity: MatRef<'_, f64>) -> Result<Mat<Complex64>> {
    with_points(surface, kappa, velocity, &surface.inside(0.5 * PI / kappa))
}

/// The same with these points inside.
fn with_points(
    surface: &PanelSurface,
    kappa: f64,
    velocity: MatRef<'_, f64>,
    points: &[[f64; 2]],
) -> Result<Mat<Complex64>> {
    let n = surface.nodes().len();
    let mut single = Mat::<Complex64>::zeros(n + points.len(), n);
    let mut double = single.clone();
    let mut integrals = Integrals::new(Line::default(), 1);
    for row in 0..n + points.len() {
        let own = (row < n).then_some(row);
        let at = own.map_or_else(|| points[row - n], |i| surface.nodes()[i].point.at);
        surface.integrate(at, own, kappa, &mut integrals, |_, node, [g, dg]| {
            let half = if own == Some(node) { 0.5 } else { 0.0 };
            single[(row, node)] = g;
            double[(row, node)] = half - dg;
        });
    }
    let right = single * Mat::from_fn(n, velocity.ncols(), |i, j| Complex64::new(velocity[(i, j)], 0.0));
    let found = match double.nrows() == double.ncols() {
        true => double.partial_piv_lu().solve(&right),
        false => double.qr().solve_lstsq(&right),
    };
    if !found.norm_max().is_finite() {
        return Err(Error::NotConverged(format!(
            "sound of a rail at the wavenumber {kappa} 1/m in the plane: the equations of the surface pressure \
             are singular"
        )));
    }
    Ok(found)
}

/// The far field over iωρ of the pressures of [`pressures`], m, in `count` directions, evenly spread, `[count, m]`:
/// the pressure at the distance R is iωρ D (−i/4) √(2/(πκR)) e^{−i(κR − π/4)}, and each metre radiates ½ ωρ/(8π)
/// ∫|D|² dθ of amplitudes.
pub fn far(
    surface: &PanelSurface,
    kappa: f64,
    velocity: MatRef<'_, f64>,
    pressure: &Mat<Complex64>,
    count: usize,
) -> Mat<Complex64> {
    let nodes = surface.nodes();
    let direction = |d: usize| {
        let (s, c) = (2.0 * PI * d as f64 / count as f64).sin_cos();
        [c, s]
    };
    let phase = |d: usize, i: usize| {
        let (e, at) = (direction(d), nodes[i].point.at);
        nodes[i].length * Complex64::cis(kappa * (e[0] * at[0] + e[1] * at[1]))
    };
    let of_velocity = Mat::from_fn(count, nodes.len(), phase);
    let of_pressure = Mat::from_fn(count, nodes.len(), |d, i| {
        let (e, normal) = (direction(d), nodes[i].point.normal);
        of_velocity[(d, i)] * Complex64::new(0.0, kappa * (e[0] * normal[0] + e[1] * normal[1]))
    });
    let complex = Mat::from_fn(nodes.len(), velocity.ncols(), |i, j| Complex64::new(velocity[(i, j)], 0.0));
    of_pressure * pressure + of_velocity * complex
}

#[cfg(test)]
mod tests;
