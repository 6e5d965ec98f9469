//! Floquet multipliers from the kernel of the contact, closed through the modes (Hill's method): their cost hardly
//! grows with the number of modes.
//!
//! Over a period a small motion of what acts at the contact is a, in the functions of the window, and the forces are
//! φ = Σ A_l a_l with the kernel A and the motions a_l of the periods before. Each mode has the amplitude η at the
//! beginning of the period; E is its factor of a period, p the motion of the contact that it makes, q what forces add
//! to its amplitude, K what forces make of the motion within the period:
//!
//! a = Σ_j p_j η_j + K φ,   η_j⁺ = E_j η_j + q_jᵀ φ
//!
//! Multipliers μ are the eigenvalues of this map. A small map is written out as a real matrix. Of a large one, those of
//! a contact that remembers many periods, they are found sector by sector of the unit circle by Arnoldi's method on the
//! inverse about a point of it (Y. Saad, Numerical Methods for Large Eigenvalue Problems, 2nd ed., 2011): eliminating
//! all but a leaves one dense system of the size of a for each point.

use super::balance::{Balance, Conditions, PeriodicSolution, Resolution};
use super::kernel::window;
use super::structure::Structure;
use crate::{Error, Result};
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::Mat;
use std::f64::consts::PI;

type C = num_complex::Complex<f64>;

/// Largest dimension of a map that is written out.
const WRITTEN: usize = 800;
/// Largest dimension of the subspaces.
const SUBSPACE: usize = 80;
/// Residual of an eigenvalue of the inverse, relative to it.
const RESIDUAL: f64 = 1e-9;
/// Sectors of the upper half of the unit circle to begin with, and how often one is halved.
const SECTORS: usize = 3;
const HALVINGS: usize = 7;
/// A multiplier is real whose imaginary part is below this part of it.
const REAL: f64 = 1e-8;

/// All multipliers of `cycle` near the unit circle, at least one of each pair, that of the phase included.
pub(super) fn multipliers_near_the_circle(
    structure: &Structure<'_>,
    conditions: &Conditions,
    cycle: &PeriodicSolution,
    resolution: Resolution,
) -> Result<Vec<C>> {
    let multiples = resolution.harmonics as f64 + 1.0;
    let window = window(resolution.samples, multiples)?;
    let mut balance = Balance::new(structure, conditions, resolution, 1.0, &cycle.contact)?;
    let kernel = balance.kernel(cycle, &window)?;
    let closed = Closed::new(structure, cycle, (&window, multiples), kernel);
    match closed.size() <= WRITTEN {
        true => closed.all(),
        false => closed.near_the_circle(),
    }
}

/// The map of a period.
struct Closed {
    /// λ of each mode, 1/s, and E.
    exponent: Vec<C>,
    factor: Vec<C>,
    /// p, `[r d, modes]`, and q, `[modes, r d]`.
    motion: Mat<C>,
    gain: Mat<C>,
    /// K, `[r d, r d]`.
    within: Mat<C>,
    /// A, `[r d, r d]` each.
    kernel: Vec<Mat<f64>>,
}

/// The system of one point of the circle.
struct Shifted<'a> {
    closed: &'a Closed,
    shift: C,
    /// K + p (shift − E)⁻¹ q.
    response: Mat<C>,
    /// A(shift) = Σ A_l shift^−l.
    kernel: Mat<C>,
    /// 1 − response·A(shift).
    system: PartialPivLu<C>,
}

impl Closed {
    fn new(
        structure: &Structure<'_>,
        cycle: &PeriodicSolution,
        (window, multiples): (&Mat<f64>, f64),
        kernel: Vec<Mat<f64>>,
    ) -> Self {
        let (samples, d, r) = (window.nrows(), window.ncols(), structure.rank());
        let h = 2.0 * PI / (samples as f64 * cycle.omega);
        let whole = Mat::from_fn(samples, d, |n, k| C::new(window[(n, k)], 0.0));
        let sums = whole.transpose();
        let poles = &structure.contact_poles;
        // Motion within a period, summed over the modes as products of two matrices.
        let mut shapes = Mat::zeros(r * r, poles.len());
        let mut courses = Mat::zeros(poles.len(), d * d);
        let (mut exponent, mut factor, mut motions, mut gains) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (j, (lambda, x, y)) in poles.iter().enumerate() {
            let half = 0.5 * h * lambda;
            let (e, g) = ((1.0 + half) / (1.0 - half), 0.5 * h / (1.0 - half));
            let mut course = Mat::zeros(samples, d);
            for k in 0..d {
                let mut amplitude = C::default();
                for n in 0..samples {
                    let force = g * window[(n, k)];
                    course[(n, k)] = amplitude + force;
                    amplitude = e * amplitude + (1.0 + e) * force;
                }
            }
            let course = sums * course;
            for (i, x) in x.iter().enumerate() {
                y.iter().enumerate().for_each(|(l, y)| shapes[(i * r + l, j)] = x * y);
            }
            (0..d * d).for_each(|k| courses[(j, k)] = course[(k / d, k % d)]);
            // Free motions beyond the window act on nothing that it holds.
            if e.arg().abs() * samples as f64 > 2.0 * PI * (multiples + 1.0) {
                continue;
            }
            let free = |k: usize| (0..samples).map(|n| e.powu(n as u32) * window[(n, k)]).sum::<C>();
            let own = |k: usize| {
                (0..samples).map(|n| (1.0 + e) * g * e.powu((samples - 1 - n) as u32) * window[(n, k)]).sum::<C>()
            };
            let (free, own): (Vec<C>, Vec<C>) = ((0..d).map(free).collect(), (0..d).map(own).collect());
            exponent.push(*lambda);
            factor.push(e.powu(samples as u32));
            motions.push((0..r * d).map(|k| x[k / d] * free[k % d]).collect::<Vec<C>>());
            gains.push((0..r * d).map(|k| y[k / d] * own[k % d]).collect::<Vec<C>>());
        }
        let sum = shapes * courses;
        Self {
            motion: Mat::from_fn(r * d, factor.len(), |i, j| motions[j][i]),
            gain: Mat::from_fn(factor.len(), r * d, |j, i| gains[j][i]),
            exponent,
            factor,
            within: Mat::from_fn(r * d, r * d, |i, k| sum[((i / d) * r + k / d, (i % d) * d + k % d)]),
            kernel,
        }
    }

    /// Dimension of the map: modes, and motions of the periods before.
    fn size(&self) -> usize {
        self.factor.len() + (self.kernel.len() - 1) * self.within.nrows()
    }

    /// The map as a real matrix. Of a pair of conjugate modes it has the real and the imaginary part of the amplitude
    /// of one, η = u + iv; a = (1 − K A_0)⁻¹ (p η + K Σ_{l>0} A_l a_l).
    fn written(&self) -> Mat<f64> {
        let n = self.within.nrows();
        let delays = self.kernel.len() - 1;
        let oscillates = |j: usize| self.exponent[j].im > 0.0;
        let parts: Vec<(usize, bool)> = (0..self.exponent.len())
            .filter(|&j| self.exponent[j].im >= 0.0)
            .flat_map(|j| [(j, false), (j, true)].into_iter().take(1 + usize::from(oscillates(j))))
            .collect();
        let m = parts.len();
        let part = |of: C, imaginary: bool| if imaginary { of.im } else { of.re };
        let within = Mat::from_fn(n, n, |i, k| self.within[(i, k)].re);
        // φ without what a makes, by the modes and by the motions before.
        let before = |i: usize, k: usize| self.kernel[1 + k / n][(i, k % n)];
        let earlier = Mat::from_fn(n, m + delays * n, |i, k| if k < m { 0.0 } else { before(i, k - m) });
        let mut free = &within * &earlier;
        for (k, &(j, imaginary)) in parts.iter().enumerate() {
            let paired = if oscillates(j) { 2.0 } else { 1.0 };
            // Re(p (u + iv)) = Re p u − Im p v.
            let sign = if imaginary { -1.0 } else { 1.0 };
            (0..n).for_each(|i| free[(i, k)] = paired * sign * part(self.motion[(i, j)], imaginary));
        }
        let own = &within * &self.kernel[0];
        let system = Mat::from_fn(n, n, |i, k| f64::from(u8::from(i == k)) - own[(i, k)]);
        let motion = system.partial_piv_lu().solve(free);
        let force = &self.kernel[0] * &motion + earlier;
        let gain = Mat::from_fn(m, n, |k, i| part(self.gain[(parts[k].0, i)], parts[k].1));
        let gained = gain * force;
        Mat::from_fn(m + delays * n, m + delays * n, |row, k| match row.checked_sub(m) {
            None => {
                let ((j, imaginary), e) = (parts[row], self.factor[parts[row].0]);
                let own = match parts.get(k) {
                    Some(&(i, other)) if i == j => match (imaginary, other) {
                        (false, true) => -e.im,
                        (true, false) => e.im,
                        _ => e.re,
                    },
                    _ => 0.0,
                };
                own + gained[(row, k)]
            }
            Some(row) if row < n => motion[(row, k)],
            Some(row) => f64::from(u8::from(k + n == row + m)),
        })
    }

    /// All multipliers of a map that is written out.
    fn all(&self) -> Result<Vec<C>> {
        self.written().eigenvalues().map_err(|e| {
            Error::NotConverged(format!("limit cycles: the multipliers of the period were not found ({e:?})"))
        })
    }

    /// Multipliers near the unit circle, without those of negative imaginary part.
    fn near_the_circle(&self) -> Result<Vec<C>> {
        let mut found = Vec::new();
        let width = PI / SECTORS as f64;
        for sector in 0..SECTORS {
            self.sector([sector as f64 * width, (sector + 1) as f64 * width], HALVINGS, &mut found)?;
        }
        Ok(found)
    }

    /// Multipliers between two angles.
    fn sector(&self, [low, high]: [f64; 2], halvings: usize, found: &mut Vec<C>) -> Result<()> {
        let middle = 0.5 * (low + high);
        let shift = C::from_polar(1.0 + 1e-4, middle);
        let (near, covered) = self.at(shift)?.eigenvalues()?;
        let needed = (C::from_polar(1.0, low) - shift).norm() * 1.05;
        // The part about the middle that is covered, where that is not all.
        let [from, to] = match covered < needed && halvings > 0 {
            true => {
                let half = 2.0 * (0.5 * covered / 1.05).min(1.0).asin();
                [(middle - half).max(low), (middle + half).min(high)]
            }
            false => [low, high],
        };
        for mut value in near {
            if value.im.abs() < REAL * value.norm() {
                value.im = 0.0;
            }
            let angle = value.arg();
            if angle >= from && (angle < to || (to >= PI - 1e-12 && angle <= PI)) {
                found.push(value);
            }
        }
        if from > low {
            self.sector([low, from], halvings - 1, found)?;
            self.sector([to, high], halvings - 1, found)?;
        }
        Ok(())
    }

    fn at(&self, shift: C) -> Result<Shifted<'_>> {
        let n = self.within.nrows();
        let weighted = Mat::from_fn(self.gain.nrows(), n, |j, k| self.gain[(j, k)] / (shift - self.factor[j]));
        let response = &self.within + &self.motion * weighted;
        let turns: Vec<C> = (0..self.kernel.len()).map(|delay| shift.powi(-(delay as i32))).collect();
        let kernel = Mat::from_fn(n, n, |i, k| self.kernel.iter().zip(&turns).map(|(a, t)| t * a[(i, k)]).sum::<C>());
        let product = &response * &kernel;
        let system = Mat::from_fn(n, n, |i, k| C::new(f64::from(u8::from(i == k)), 0.0) - product[(i, k)]);
        Ok(Shifted { closed: self, shift, response, kernel, system: system.partial_piv_lu() })
    }
}

impl Shifted<'_> {
    /// (map − shift)⁻¹ of `b`.
    fn solve(&self, b: &[C]) -> Vec<C> {
        let c = self.closed;
        let (m, n) = (c.factor.len(), c.within.nrows());
        let (modes, before) = b.split_at(m);
        // Motions of the periods before are a/shift^l less these.
        let mut known: Vec<Vec<C>> = Vec::new();
        for part in before.chunks_exact(n) {
            let last = known.last();
            let one = |(k, b): (usize, &C)| (last.map_or(C::default(), |l| l[k]) + b) / self.shift;
            known.push(part.iter().enumerate().map(one).collect());
        }
        // Their forces: real and imaginary parts.
        let mut parts = Mat::<f64>::zeros(n, 2);
        for (kernel, known) in c.kernel.iter().skip(1).zip(&known) {
            parts += kernel * Mat::from_fn(n, 2, |k, part| if part == 0 { known[k].re } else { known[k].im });
        }
        let lost = Mat::from_fn(n, 1, |k, _| C::new(parts[(k, 0)], parts[(k, 1)]));
        let own = Mat::from_fn(m, 1, |j, _| modes[j] / (self.shift - c.factor[j]));
        let right = -(&c.motion * own) - &self.response * &lost;
        let a = self.system.solve(right);
        let force = &self.kernel * &a - lost;
        let gained = &c.gain * force;
        let mut x: Vec<C> = (0..m).map(|j| (gained[(j, 0)] - modes[j]) / (self.shift - c.factor[j])).collect();
        for (delay, known) in known.iter().enumerate() {
            let turn = self.shift.powi(-(delay as i32 + 1));
            x.extend(known.iter().enumerate().map(|(k, known)| turn * a[(k, 0)] - known));
        }
        x
    }

    /// Multipliers nearest to the shift, and the distance up to which none is missing.
    fn eigenvalues(&self) -> Result<(Vec<C>, f64)> {
        let size = self.closed.size();
        let most = SUBSPACE.min(size);
        let product = |a: &[C], b: &[C]| a.iter().zip(b).map(|(a, b)| a.conj() * b).sum::<C>();
        let norm = |a: &[C]| a.iter().map(|a| a.norm_sqr()).sum::<f64>().sqrt();
        // A start that has something of every mode, the same in every run.
        let first: Vec<C> = (0..size).map(|k| C::from_polar(1.0, 0.7 + 2.399_963 * (k * k + k) as f64)).collect();
        let scale = norm(&first);
        let mut basis = vec![first.into_iter().map(|v| v / scale).collect::<Vec<C>>()];
        let mut columns: Vec<Vec<C>> = Vec::new();
        let mut beyond = 0.0;
        for k in 0..most {
            let mut next = self.solve(&basis[k]);
            let whole = norm(&next);
            let mut column = vec![C::default(); k + 1];
            for _ in 0..2 {
                for (part, v) in column.iter_mut().zip(&basis) {
                    let along = product(v, &next);
                    *part += along;
                    next.iter_mut().zip(v).for_each(|(n, v)| *n -= along * v);
                }
            }
            beyond = norm(&next);
            columns.push(column);
            if !whole.is_finite() {
                return Err(Error::NotConverged("limit cycles: multipliers on the point of a shift".into()));
            }
            if beyond < 1e-12 * whole {
                beyond = 0.0;
                break;
            }
            column_end(&mut columns, k, beyond);
            basis.push(next.into_iter().map(|v| v / beyond).collect());
        }
        let k = columns.len();
        let hessenberg = Mat::from_fn(k, k, |i, j| columns[j].get(i).copied().unwrap_or_default());
        let eigen = hessenberg.eigen().map_err(|e| {
            Error::NotConverged(format!("limit cycles: the multipliers about a point were not found ({e:?})"))
        })?;
        let mut all: Vec<(C, bool)> = (0..k)
            .filter(|&j| eigen.S().column_vector()[j].norm() > 0.0)
            .map(|j| {
                let theta = eigen.S().column_vector()[j];
                let length = (0..k).map(|i| eigen.U()[(i, j)].norm_sqr()).sum::<f64>().sqrt();
                let residual = beyond * eigen.U()[(k - 1, j)].norm() / length.max(f64::MIN_POSITIVE);
                (self.shift + 1.0 / theta, residual < RESIDUAL * theta.norm())
            })
            .collect();
        let distance = |v: &C| (v - self.shift).norm();
        all.sort_by(|a, b| distance(&a.0).total_cmp(&distance(&b.0)));
        let covered = match all.iter().find(|v| !v.1) {
            Some(v) => distance(&v.0),
            None if beyond == 0.0 || k == size => f64::INFINITY,
            None => all.last().map_or(0.0, |v| distance(&v.0)),
        };
        Ok((all.into_iter().filter(|v| v.1).map(|v| v.0).collect(), covered))
    }
}

/// Puts the element below the diagonal into its column.
fn column_end(columns: &mut [Vec<C>], k: usize, beyond: f64) {
    if let Some(column) = columns.get_mut(k) {
        column.push(C::new(beyond, 0.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two pairs of modes and one that does not oscillate under a contact that remembers two periods.
    #[test]
    fn both_ways_have_the_same_multipliers() {
        let (n, exponent) = (3, [C::new(-1.0, 9.0), C::new(-1.0, -9.0), C::new(-0.3, 0.0), C::new(0.1, 2.0)]);
        let exponent: Vec<C> = exponent.into_iter().chain([C::new(0.1, -2.0)]).collect();
        let wave = |k: usize| (1.7 * k as f64 + 0.4 * (k * k) as f64).sin();
        // Conjugate modes have conjugate motions.
        let vector = |start: usize| -> Mat<C> {
            Mat::from_fn(n, exponent.len(), |i, j| {
                let at = |k: usize| wave(start + 20 * i + k);
                match j {
                    2 => C::new(at(4), 0.0),
                    _ => C::new(at(2 * (j / 3)), if j % 3 == 0 { at(2 * (j / 3) + 1) } else { -at(2 * (j / 3) + 1) }),
                }
            })
        };
        let gain = vector(100);
        let closed = Closed {
            factor: exponent.iter().map(|e| (0.2 * e).exp()).collect(),
            motion: vector(0),
            gain: Mat::from_fn(exponent.len(), n, |j, i| gain[(i, j)]),
            within: Mat::from_fn(n, n, |i, k| C::new(0.3 * wave(200 + 7 * i + k), 0.0)),
            kernel: (0..3).map(|l| Mat::from_fn(n, n, |i, k| 0.4 * wave(300 + 50 * l + 7 * i + k))).collect(),
            exponent,
        };
        let written: Vec<C> = closed.all().unwrap().into_iter().filter(|v| v.im >= 0.0).collect();
        let found = closed.near_the_circle().unwrap();
        assert!(found.len() >= 6 && written.iter().any(|v| v.norm() > 1.0), "{found:?}");
        for value in &found {
            let apart = written.iter().map(|v| (v - value).norm()).fold(f64::INFINITY, f64::min);
            assert!(apart < 1e-9 * value.norm(), "{value} {written:?}");
        }
        let large = |of: &[C]| of.iter().filter(|v| v.norm() > 1e-3).count();
        assert_eq!(large(&written), large(&found), "{written:?} {found:?}");
    }
}
