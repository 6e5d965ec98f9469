//! How an infinite rail radiates under forces at its contacts.
//!
//! The motions under the forces i and j, along x or across the rail, are a_i(ξ) e^{iξx_i} times −i for forces along x.
//! Those of −ξ are the same but for the sign of what forces along x move. So both together radiate, with the power
//! P_ij(ξ) of the velocities iωa_i and iωa_j at one of them,
//!
//! ```text
//! 2 P_ij cos ξ(x_j − x_i)     both along x, or both across;
//! −2 P_ij sin ξ(x_j − x_i)    i along x, j across;     +2 P_ij sin ξ(x_j − x_i)     i across, j along x.
//! ```

use super::adaptive::integral;
use super::plane::{directions, far, pressures};
use crate::sound::panels::PanelMesh;
use crate::sound::{Air, Bands};
use crate::swept::{Infinite, FORCES};
use crate::{Error, Result};
use faer::Mat;
use num_complex::Complex64;
use std::cmp::Ordering;
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

    /// Number of forces, three at each of C contacts.
    pub fn forces(&self) -> usize {
        self.rail.loads().ncols()
    }

    /// Powers of unit forces at the frequencies of `grid` (Hz), W/N², real parts and then imaginary ones,
    /// `[frequencies × 2 × 3C × 3C]`, and those of plane waves in the same way: the mean power is ½ FᴴGF of complex
    /// amplitudes F. Those of part `part` of `parts`, 0 elsewhere.
    pub fn powers(&self, grid: &[f64], part: usize, parts: usize) -> Result<[Vec<f64>; 2]> {
        let each = 2 * self.forces().pow(2);
        let mut all = [0, 1].map(|_| vec![0.0; each * grid.len()]);
        for (g, &f) in grid.iter().enumerate().filter(|(g, _)| g % parts == part) {
            for (to, found) in all.iter_mut().zip(self.at(f)?) {
                let columns = || found.col_iter().flat_map(|c| c.iter());
                let numbers = columns().map(|v| v.re).chain(columns().map(|v| v.im));
                to[each * g..each * (g + 1)].iter_mut().zip(numbers).for_each(|(to, v)| *to = v);
            }
        }
        Ok(all)
    }

    /// G at the frequency `f`, Hz, `[3C, 3C]`: in free air, and of plane waves. Errors: not converged, as without
    /// damping.
    fn at(&self, f: f64) -> Result<[Mat<Complex64>; 2]> {
        let (omega, k) = (2.0 * PI * f, self.air.wave_number(f));
        let travelling = self.rail.travelling(omega);
        // ½ ωρ/(8π) ∫|D|² dθ of velocities iωu; the integral over ξ/2π is twice that over half of it.
        let radiated = omega.powi(3) * self.air.density / (8.0 * PI) * 2.0 * PI / self.count as f64 / PI;
        let plane = self.air.density * self.air.speed * omega * omega / PI;
        let n = self.forces();
        // Convergence is judged by the powers of each force alone, in free air and of plane waves.
        let alone: Vec<usize> = (0..n).map(|i| packed(n, i, i)).collect();
        let plane_alone: Vec<usize> = alone.iter().map(|k| n * n + k).collect();
        let of = |xi: f64, kappa: Option<f64>| -> Vec<f64> {
            let motion = self.rail.response(omega, xi);
            let mut all = match kappa {
                Some(kappa) => {
                    let d = self.far_at(kappa) * &motion;
                    self.both_ways(&d, &d, xi, radiated)
                }
                None => vec![0.0; n * n],
            };
            let complex = |i: usize, j: usize| Complex64::new(self.square[(i, j)], 0.0);
            let weighted = Mat::from_fn(motion.nrows(), motion.nrows(), complex) * &motion;
            all.extend(self.both_ways(&motion, &weighted, xi, plane));
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
        let judged = [&alone[..], &plane_alone].concat();
        let all = integral(&angles, (2 * n * n, &judged), ACCURACY, |phi| {
            let (sin, cos) = phi.sin_cos();
            of(k * sin, Some(k * cos)).into_iter().map(|v| k * cos * v).collect()
        });
        let mut sum = all.map_err(endless)?;
        if k < SEEN {
            let outside = travelling.iter().copied().filter(|&x| x > k && x < SEEN);
            let mut breaks: Vec<f64> = [k, SEEN].into_iter().chain(outside).collect();
            breaks.sort_by(f64::total_cmp);
            breaks.dedup();
            let rest = integral(&breaks, (2 * n * n, &plane_alone), ACCURACY, |xi| of(xi, None)).map_err(endless)?;
            sum.iter_mut().zip(rest).for_each(|(s, r)| *s += r);
        }
        let entry = |of: &[f64], i: usize, j: usize| match i.cmp(&j) {
            Ordering::Equal => Complex64::new(of[packed(n, i, i)], 0.0),
            Ordering::Less => Complex64::new(of[packed(n, i, j)], of[packed(n, j, i)]),
            Ordering::Greater => Complex64::new(of[packed(n, j, i)], -of[packed(n, i, j)]),
        };
        Ok([0, 1].map(|kind| {
            let of = &sum[n * n * kind..n * n * (kind + 1)];
            Mat::from_fn(n, n, |i, j| entry(of, i, j))
        }))
    }

    /// `factor` times half the power of ±ξ that the sums of conj(a) b over the rows, `[rows, 3C]`, stand for; packed,
    /// `[(3C)²]`.
    fn both_ways(&self, a: &Mat<Complex64>, b: &Mat<Complex64>, xi: f64, factor: f64) -> Vec<f64> {
        let (n, along) = (a.ncols(), self.rail.along_of_forces());
        let mut all = vec![0.0; n * n];
        for i in 0..n {
            for j in i..n {
                let (sin, cos) = (xi * (along[j / FORCES] - along[i / FORCES])).sin_cos();
                let share = match [i, j].map(|k| k % FORCES == 0) {
                    [true, false] => -sin,
                    [false, true] => sin,
                    _ => cos,
                };
                // Forces along x and across that act at one place do not interact.
                if share == 0.0 {
                    continue;
                }
                let sum: Complex64 = (0..a.nrows()).map(|r| a[(r, i)].conj() * b[(r, j)]).sum();
                all[packed(n, i, j)] = factor * share * sum.re;
                if i != j {
                    all[packed(n, j, i)] = factor * share * sum.im;
                }
            }
        }
        all
    }
}

/// Place of the real part of the entry (i, j) of a Hermitian matrix `[n, n]` among n² numbers for i ≤ j; that of (j, i)
/// is the place of its imaginary part.
fn packed(n: usize, i: usize, j: usize) -> usize {
    n * i + j
}

#[cfg(test)]
mod tests;
