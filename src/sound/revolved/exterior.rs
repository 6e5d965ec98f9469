//! The exterior problem of Helmholtz on the outline of a body of revolution, order by order of Fourier.

use super::bessel::bessel;
use super::ring::Layers;
use crate::quadrature::legendre;
use crate::sound::panels::{Integrals, PanelNode, PanelSurface};
use crate::sound::Air;
use crate::{Error, Result};
use faer::linalg::solvers::{Solve, SolveLstsq};
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::PI;

/// Directions beside those that resolve the waves over half the circumference.
const DIRECTIONS: usize = 12;

/// The field outside of a surface that vibrates, of one order: pressure and normal velocity go with cos nθ (or sin
/// nθ) round the axis.
#[derive(Debug, Clone)]
pub struct Field {
    order: usize,
    /// Normal velocities at the nodes, m/s, `[nodes, m]`.
    velocity: Mat<f64>,
    /// Pressures there, Pa, `[nodes, m]`; e^{+iωt}.
    pub pressure: Mat<Complex64>,
}

/// ∫ cos² nθ dθ all round.
fn round(order: usize) -> f64 {
    if order == 0 {
        2.0 * PI
    } else {
        PI
    }
}

/// The integral operators of a surface at one wave number, for the orders from 0 on.
pub struct Exterior<'s> {
    surface: &'s PanelSurface,
    air: Air,
    /// Frequency, Hz.
    frequency: f64,
    /// Operators of each order, `[nodes + points, nodes]`: ∫ G, m, and ½ − ∫ ∂G/∂n′ (without ½ at points inside the
    /// body).
    operators: Vec<[Mat<Complex64>; 2]>,
}

/// ∫ v_i v_j dS of normal velocities at the nodes, `[nodes, m]`, of the order `order`: m² times their unit squared,
/// `[m, m]`.
pub fn square(surface: &PanelSurface, order: usize, velocity: &Mat<f64>) -> Mat<f64> {
    let nodes = surface.nodes();
    let weighted = Mat::from_fn(velocity.nrows(), velocity.ncols(), |i, j| area(&nodes[i]) * velocity[(i, j)]);
    let sum = velocity.transpose() * weighted;
    Mat::from_fn(sum.nrows(), sum.ncols(), |i, j| round(order) * sum[(i, j)])
}

/// Area that a node stands for, per radian of the angle, m².
fn area(node: &PanelNode) -> f64 {
    node.length * node.point.at[0]
}

impl<'s> Exterior<'s> {
    /// Exterior problem of `surface` in `air` at the frequency `f` (Hz), for the orders from 0 to `last`.
    ///
    /// The integral equation of the pressure has no unique solution at the resonances of the space inside. There its
    /// solutions do not vanish inside, as the true one does: it is asked for at points a quarter of a wave length
    /// apart, too, and the equations are solved by least squares (H. A. Schenck, J. Acoust. Soc. Am. 44 (1968)
    /// 41–58). A space that is too narrow for such points is too narrow for a resonance.
    pub fn new(surface: &'s PanelSurface, air: Air, f: f64, last: usize) -> Self {
        let mut points = surface.inside(0.25 * air.speed / f);
        points.retain(|x| x[0] > 0.0);
        Self::with_points(surface, air, f, last, &points)
    }

    /// The same with these points inside the body.
    fn with_points(surface: &'s PanelSurface, air: Air, f: f64, last: usize, points: &[[f64; 2]]) -> Self {
        let n = surface.nodes().len();
        let k = air.wave_number(f);
        let mut operators = vec![[0, 1].map(|_| Mat::<Complex64>::zeros(n + points.len(), n)); last + 1];
        let mut integrals = Integrals::new(Layers::new(last), last + 1);
        for row in 0..n + points.len() {
            let own = (row < n).then_some(row);
            let at = own.map_or_else(|| points[row - n], |i| surface.nodes()[i].point.at);
            surface.integrate(at, own, k, &mut integrals, |order, node, [single, double]| {
                let half = if own == Some(node) { 0.5 } else { 0.0 };
                operators[order][0][(row, node)] = single;
                operators[order][1][(row, node)] = half - double;
            });
        }
        Self { surface, air, frequency: f, operators }
    }

    fn angular(&self) -> f64 {
        2.0 * PI * self.frequency
    }

    /// The field of the order `order` of normal velocities at the nodes, m/s, outward, `[nodes, m]`.
    pub fn field(&self, order: usize, velocity: Mat<f64>) -> Result<Field> {
        let Some([single, double]) = self.operators.get(order) else {
            return Err(Error::Defect(format!("sound of the order {order}: operators reach {}", self.operators.len())));
        };
        let complex = Mat::from_fn(velocity.nrows(), velocity.ncols(), |i, j| {
            Complex64::i() * self.angular() * self.air.density * velocity[(i, j)]
        });
        let right = single * complex;
        let pressure = match double.nrows() == double.ncols() {
            true => double.partial_piv_lu().solve(&right),
            false => double.qr().solve_lstsq(&right),
        };
        if !pressure.norm_max().is_finite() {
            return Err(Error::NotConverged(format!(
                "sound at {} Hz of the order {order}: the equations of the surface pressure are singular",
                self.frequency
            )));
        }
        Ok(Field { order, velocity, pressure })
    }

    /// Radiation resistance of the velocities of a field, N·s/m, `[m, m]`: the mean power is ½ xᴴ R x of complex
    /// amplitudes x. Real, symmetric and not negative by its making: from the far field, whose intensity is
    /// integrated over all directions.
    pub fn resistance(&self, field: &Field) -> Mat<f64> {
        let m = field.velocity.ncols();
        let k = self.air.wave_number(self.frequency);
        let farthest = self.surface.nodes().iter().map(|n| n.point.at[0].hypot(n.point.at[1])).fold(0.0, f64::max);
        let count = DIRECTIONS + field.order + (1.2 * k * farthest).ceil() as usize;
        let mut sum = Mat::<f64>::zeros(m, m);
        for (cosine, weight) in legendre(count) {
            let d = self.far(field, cosine);
            for j in 0..m {
                for i in 0..m {
                    sum[(i, j)] += weight * (d[i].conj() * d[j]).re;
                }
            }
        }
        let factor = round(field.order) / (16.0 * PI * PI * self.air.density * self.air.speed);
        Mat::from_fn(m, m, |i, j| factor * sum[(i, j)])
    }

    /// The far field in the direction with this cosine against the axis, N/m, `[m]`: the pressure is D e^{−ikR}/(4πR)
    /// cos nθ at the distance R.
    ///
    /// D = 2π iⁿ ∫ e^{iky cosΘ} {ikp [n_y cosΘ J_n(a) − i n_r sinΘ J_n′(a)] + iωρ v J_n(a)} r ds, a = kr sinΘ: the
    /// integral of Kirchhoff and Helmholtz with the phases of the plane wave, by Jacobi's and Anger's series.
    pub fn far(&self, field: &Field, cosine: f64) -> Vec<Complex64> {
        let k = self.air.wave_number(self.frequency);
        let n = field.order;
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let turned = Complex64::i().powu(n as u32) * 2.0 * PI;
        let mut d = vec![Complex64::default(); field.velocity.ncols()];
        for (i, node) in self.surface.nodes().iter().enumerate() {
            let ([r, y], [nr, ny]) = (node.point.at, node.point.normal);
            let j = bessel(n + 1, k * r * sine);
            let below = if n == 0 { -j[1] } else { j[n - 1] };
            let slope = 0.5 * (below - j[n + 1]);
            let phase = turned * area(node) * Complex64::from_polar(1.0, k * y * cosine);
            let of_pressure = phase * Complex64::new(nr * sine * slope, ny * cosine * j[n]) * k;
            let of_velocity = phase * Complex64::new(0.0, self.angular() * self.air.density * j[n]);
            for (c, d) in d.iter_mut().enumerate() {
                *d += of_pressure * field.pressure[(i, c)] + of_velocity * field.velocity[(i, c)];
            }
        }
        d
    }
}

#[cfg(test)]
mod tests;
