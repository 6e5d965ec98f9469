//! How an infinite rail radiates under forces at its contact.

use super::adaptive::integral;
use super::plane::{directions, far, pressures};
use crate::sound::panels::PanelMesh;
use crate::sound::{Air, Bands};
use crate::swept::{Infinite, FORCES};
use crate::{Error, Result};
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::PI;

/// Panels are at most this part of the wave length, and of the largest distance from the middle.
const PANEL: f64 = 0.5;
const PANEL_OF_SIZE: f64 = 0.2;
/// Steps of κ times the largest distance from the middle between which the far field is interpolated. Below the first
/// one each κ is this part of the next, so many times: there the field goes with powers of κ, and with its logarithm.
const STEP: f64 = 0.25;
const SMALLER: f64 = 0.6;
const SMALL: i32 = 12;
/// Accuracy of the integrals over the wavenumbers, by the difference of both rules: what is left is far less.
const ACCURACY: f64 = 3e-3;
/// Frequencies in a third of a third octave.
const FINER: usize = 6;
/// Parts of the angles whose cosines are κ/k, beside those that the travelling waves make.
const PARTS: usize = 6;
/// Waves up to this wavenumber count in what plane waves would radiate, 1/m: all that travel do, and what a force
/// alone does to the section beside it is not seen from the air.
const SEEN: f64 = 60.0;

/// Quantities of radiation per metre: (xx, yy, nn) and (Re yn, Im yn), in free air and as plane waves. Forces along x
/// make motions that are odd where those of the others are even: they do not interact.
const KINDS: usize = 5;
/// Quantities by which convergence is judged: the powers of each force alone.
const JUDGED: [usize; 6] = [0, 1, 2, 5, 6, 7];

/// A rail in air.
pub struct RailRadiators<'a> {
    rail: &'a Infinite,
    air: Air,
    meshed: PanelMesh,
    /// Normal motions at the nodes of the panels, `[nodes, q]`, and ∮ of their products, m, `[q, q]`.
    normal: Mat<f64>,
    square: Mat<f64>,
    /// Wavenumbers κ in the plane at which the far field is known, 1/m, ascending.
    kappa: Vec<f64>,
    /// Number of directions.
    count: usize,
    /// The far field over iωρ of unit velocities of each motion at each κ, `[count, q]`; see
    /// [`RailRadiators::complete`].
    far: Vec<Mat<Complex64>>,
}

impl<'a> RailRadiators<'a> {
    /// Radiators of `rail` up to the end of `bands`. The far fields are still missing.
    pub fn new(rail: &'a Infinite, air: Air, bands: &Bands) -> Self {
        let points = rail.outline().edges.iter().flat_map(|e| e.points);
        let [low, high] = [f64::min, f64::max].map(|pick: fn(f64, f64) -> f64| {
            points.clone().fold(None, |found: Option<[f64; 2]>, x| {
                Some(found.map_or(x, |f| [pick(f[0], x[0]), pick(f[1], x[1])]))
            })
        });
        let (low, high) = (low.unwrap_or_default(), high.unwrap_or_default());
        let middle = [0, 1].map(|c| 0.5 * (low[c] + high[c]));
        let mut outline = rail.outline().clone();
        for point in outline.edges.iter_mut().flat_map(|e| &mut e.points) {
            (0..2).for_each(|c| point[c] -= middle[c]);
        }
        let farthest = outline.edges.iter().flat_map(|e| e.points).map(|x| x[0].hypot(x[1])).fold(0.0, f64::max);
        let highest = air.wave_number(bands.highest());
        let meshed = PanelMesh::new(&outline, (PANEL * 2.0 * PI / highest).min(PANEL_OF_SIZE * farthest));
        let normal = meshed.normal(rail.motion());
        let nodes = meshed.surface.nodes();
        let weighted = Mat::from_fn(normal.nrows(), normal.ncols(), |i, j| nodes[i].length * normal[(i, j)]);
        let square = normal.transpose() * weighted;
        let step = STEP / farthest;
        let last = (highest / step).ceil() as usize + 1;
        let small = (1..=SMALL).rev().map(|k| step * SMALLER.powi(k));
        let kappa: Vec<f64> = small.chain((1..=last).map(|k| step * k as f64)).collect();
        let count = directions(highest, farthest);
        Self { rail, air, meshed, normal, square, kappa, count, far: Vec::new() }
    }

    /// Numbers of a far field.
    fn size(&self) -> usize {
        2 * self.count * self.normal.ncols()
    }

    /// The far fields of part `part` of `parts`, 0 elsewhere: the sum over the parts is what
    /// [`RailRadiators::complete`] takes.
    pub fn far(&self, part: usize, parts: usize) -> Result<Vec<f64>> {
        let size = self.size();
        let mut all = vec![0.0; size * self.kappa.len()];
        for (k, &kappa) in self.kappa.iter().enumerate().filter(|(k, _)| k % parts == part) {
            let velocity = self.normal.as_ref();
            let pressure = pressures(&self.meshed.surface, kappa, velocity)?;
            let found = far(&self.meshed.surface, kappa, velocity, &pressure, self.count);
            let numbers = found.col_iter().flat_map(|c| c.iter().flat_map(|v| [v.re, v.im]).collect::<Vec<f64>>());
            all[size * k..size * (k + 1)].iter_mut().zip(numbers).for_each(|(to, v)| *to = v);
        }
        Ok(all)
    }

    /// With all far fields.
    pub fn complete(mut self, far: &[f64]) -> Self {
        let (rows, columns) = (self.count, self.normal.ncols());
        let field = |v: &[f64]| {
            Mat::from_fn(rows, columns, |i, j| {
                let at = 2 * (i + rows * j);
                Complex64::new(v[at], v[at + 1])
            })
        };
        self.far = far.chunks_exact(self.size()).map(field).collect();
        self
    }

    /// The far field at the wavenumber `kappa` in the plane: a cubic between its neighbours.
    fn far_at(&self, kappa: f64) -> Mat<Complex64> {
        let kappa = kappa.max(self.kappa[0]);
        let above = self.kappa.partition_point(|&k| k < kappa);
        let first = above.saturating_sub(2).min(self.kappa.len().saturating_sub(4));
        let nodes = &self.kappa[first..first + 4];
        let mut sum = Mat::<Complex64>::zeros(self.count, self.normal.ncols());
        for (i, field) in self.far[first..first + 4].iter().enumerate() {
            let others = (0..4).filter(|&j| j != i);
            let weight: f64 = others.map(|j| (kappa - nodes[j]) / (nodes[i] - nodes[j])).product();
            sum += field * faer::Scale(Complex64::new(weight, 0.0));
        }
        sum
    }

    /// Frequencies, Hz, at which the powers are needed so that they can be interpolated over the bands.
    pub fn frequencies(&self, bands: &Bands) -> Vec<f64> {
        let mut all: Vec<f64> = Vec::new();
        for pair in bands.grid().windows(2) {
            let ratio = pair[1] / pair[0];
            all.extend((0..FINER).map(|i| pair[0] * ratio.powf(i as f64 / FINER as f64)));
        }
        all.push(bands.highest());
        all
    }

    /// Powers of unit forces at the frequencies of `grid` (Hz), W/N², real parts and then imaginary ones,
    /// `[frequencies × 2 × 3 × 3]`, and those of plane waves in the same way: the mean power is ½ FᴴGF of complex
    /// amplitudes F. Those of part `part` of `parts`, 0 elsewhere.
    pub fn powers(&self, grid: &[f64], part: usize, parts: usize) -> Result<[Vec<f64>; 2]> {
        const EACH: usize = 2 * FORCES * FORCES;
        let mut all = [0, 1].map(|_| vec![0.0; EACH * grid.len()]);
        for (g, &f) in grid.iter().enumerate().filter(|(g, _)| g % parts == part) {
            for (to, found) in all.iter_mut().zip(self.at(f)?) {
                let numbers = matrix(found).into_iter().flat_map(|v| v.map(|v| v.re));
                let imaginary = matrix(found).into_iter().flat_map(|v| v.map(|v| v.im));
                to[EACH * g..EACH * (g + 1)].iter_mut().zip(numbers.chain(imaginary)).for_each(|(to, v)| *to = v);
            }
        }
        Ok(all)
    }

    /// At the frequency `f`, Hz: in free air, and as plane waves. Errors: not converged, as without damping.
    fn at(&self, f: f64) -> Result<[[f64; KINDS]; 2]> {
        let (omega, k) = (2.0 * PI * f, self.air.wave_number(f));
        let travelling = self.rail.travelling(omega);
        // ½ ωρ/(8π) ∫|D|² dθ of velocities iωu; the integral over ξ/2π is twice that over half of it.
        let radiated = omega.powi(3) * self.air.density / (8.0 * PI) * 2.0 * PI / self.count as f64 / PI;
        let plane = self.air.density * self.air.speed * omega * omega / PI;
        let of = |xi: f64, kappa: Option<f64>| -> [f64; 2 * KINDS] {
            let motion = self.rail.response(omega, xi);
            let mut all = [0.0; 2 * KINDS];
            if let Some(kappa) = kappa {
                let d = self.far_at(kappa) * &motion;
                all[..KINDS].copy_from_slice(&products(&d, &d).map(|v| radiated * v));
            }
            let complex = |i: usize, j: usize| Complex64::new(self.square[(i, j)], 0.0);
            let weighted = Mat::from_fn(motion.nrows(), motion.nrows(), complex) * &motion;
            all[KINDS..].copy_from_slice(&products(&motion, &weighted).map(|v| plane * v));
            all
        };
        // ξ = k sin φ, κ = k cos φ.
        let inside = travelling.iter().filter(|&&x| x < k).map(|x| (x / k).asin());
        let mut angles: Vec<f64> = (0..=PARTS).map(|i| 0.5 * PI * i as f64 / PARTS as f64).chain(inside).collect();
        angles.sort_by(f64::total_cmp);
        angles.dedup();
        let endless = |e: Error| {
            Error::NotConverged(format!(
                "sound of a rail without ends at {f:.1} Hz: {e}; without damping its waves go on for ever: give \
                 track.loss_factor, or its pads a loss factor"
            ))
        };
        let all = integral(&angles, &JUDGED, ACCURACY, |phi| {
            let (sin, cos) = phi.sin_cos();
            of(k * sin, Some(k * cos)).map(|v| k * cos * v)
        });
        let mut sum = all.map_err(endless)?;
        if k < SEEN {
            let outside = travelling.iter().copied().filter(|&x| x > k && x < SEEN);
            let mut breaks: Vec<f64> = [k, SEEN].into_iter().chain(outside).collect();
            breaks.sort_by(f64::total_cmp);
            breaks.dedup();
            let rest = integral(&breaks, &JUDGED[3..], ACCURACY, |xi| of(xi, None)).map_err(endless)?;
            sum.iter_mut().zip(rest).for_each(|(s, r)| *s += r);
        }
        Ok([0, 1].map(|kind| std::array::from_fn(|c| sum[KINDS * kind + c])))
    }
}

/// Sums of conj(a) b over the rows, `[rows, 3]`: (xx, yy, nn, Re yn, Im yn).
fn products(a: &Mat<Complex64>, b: &Mat<Complex64>) -> [f64; KINDS] {
    let sum = |i: usize, j: usize| -> Complex64 { (0..a.nrows()).map(|r| a[(r, i)].conj() * b[(r, j)]).sum() };
    let cross = sum(1, 2);
    [sum(0, 0).re, sum(1, 1).re, sum(2, 2).re, cross.re, cross.im]
}

/// The Hermitian matrix of (xx, yy, nn, Re yn, Im yn), column by column.
fn matrix([xx, yy, nn, re, im]: [f64; KINDS]) -> [[Complex64; FORCES]; FORCES] {
    let real = |v: f64| Complex64::new(v, 0.0);
    let cross = Complex64::new(re, im);
    let zero = Complex64::default();
    [[real(xx), zero, zero], [zero, real(yy), cross.conj()], [zero, cross, real(nn)]]
}

#[cfg(test)]
mod tests;
