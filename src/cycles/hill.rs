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
//! Multipliers μ are the eigenvalues of this map. They are found sector by sector of the unit circle by Arnoldi's
//! method on the inverse about a point of it (Y. Saad, Numerical Methods for Large Eigenvalue Problems, 2nd ed., 2011):
//! eliminating all but a leaves one dense system of the size of a for each point.

use super::balance::{Balance, Conditions, PeriodicSolution, Resolution, Structure};
use super::kernel::window;
use crate::{Error, Result};
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::Mat;
use std::f64::consts::PI;

type C = num_complex::Complex<f64>;

/// Largest dimension of the subspaces.
const SUBSPACE: usize = 80;
/// Residual of an eigenvalue of the inverse, relative to it.
const RESIDUAL: f64 = 1e-9;
/// Sectors of the upper half of the unit circle to begin with, and how often one is halved.
const SECTORS: usize = 3;
const HALVINGS: usize = 7;
/// A multiplier is real whose imaginary part is below this part of it.
const REAL: f64 = 1e-8;

/// All multipliers of `cycle` near the unit circle, one of each pair, that of the phase included.
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
    let mut found = Vec::new();
    let width = PI / SECTORS as f64;
    for sector in 0..SECTORS {
        closed.sector([sector as f64 * width, (sector + 1) as f64 * width], HALVINGS, &mut found)?;
    }
    Ok(found)
}

/// The map of a period.
struct Closed {
    /// E of each mode.
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
        let (mut factor, mut motions, mut gains) = (Vec::new(), Vec::new(), Vec::new());
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
            factor.push(e.powu(samples as u32));
            motions.push((0..r * d).map(|k| x[k / d] * free[k % d]).collect::<Vec<C>>());
            gains.push((0..r * d).map(|k| y[k / d] * own[k % d]).collect::<Vec<C>>());
        }
        let sum = shapes * courses;
        Self {
            motion: Mat::from_fn(r * d, factor.len(), |i, j| motions[j][i]),
            gain: Mat::from_fn(factor.len(), r * d, |j, i| gains[j][i]),
            factor,
            within: Mat::from_fn(r * d, r * d, |i, k| sum[((i / d) * r + k / d, (i % d) * d + k % d)]),
            kernel,
        }
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
    /// Dimension of the map: modes, and motions of the periods before.
    fn size(&self) -> usize {
        let c = self.closed;
        c.factor.len() + (c.kernel.len() - 1) * c.within.nrows()
    }

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
        let size = self.size();
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
