//! Motions along a rail without ends under a harmonic force at a point, as the sum of its waves.
//!
//! On the motions of the section A(ξ) = A0 + ξA1 + ξ²A2 is complex and symmetric. A unit force with the coupling b
//! moves the rail at the distance x along itself by
//!
//!   H(x) = 1/2π ∫ bᵀA(ξ)⁻¹b e^{−iξx} dξ = −i Σ_j r_j e^{−iξ_j x},   r_j = (bᵀu_j)²/(u_jᵀ(A1 + 2ξ_jA2)u_j),
//!
//! over the waves A(ξ_j)u_j = 0 with Im ξ_j < 0, near fields included. The waves are those of A projected on its
//! solutions A(ξ_k)⁻¹b at real wavenumbers ξ_k: bᵀA⁻¹b and its slope are then exact there (two-sided rational Krylov
//! subspaces: E. J. Grimme, Krylov projection methods for model reduction, thesis, University of Illinois, 1997), and
//! are compared with A itself between them.
//!
//! A parameter p that changes A by A′ = A′0 + ξA′1 + ξ²A′2 changes H by −1/2π ∫ bᵀA⁻¹A′A⁻¹b e^{−iξx} dξ. With
//! A⁻¹ = Σ_j u_ju_jᵀ/(d_j(ξ − ξ_j)), d_j = u_jᵀ(A1 + 2ξ_jA2)u_j, over all waves, and
//! N_jk(ξ) = (bᵀu_j)(bᵀu_k)/(d_jd_k) u_jᵀA′(ξ)u_k, the residues at the poles, that at ξ_j double for k = j, give
//!
//!   H′(x) = i Σ_j (g_j − ix N_jj(ξ_j)) e^{−iξ_j x},   g_j = N_jj′(ξ_j) + 2 Σ_{k≠j} N_jk(ξ_j)/(ξ_j − ξ_k),
//!
//! j over those with Im ξ_j < 0, k over all. N_jj′ is the derivative by ξ.

use super::supports::TrackSlope;
use super::Infinite;
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex64;

/// Wavenumbers of either sign at which A is solved, 1/m, beside those of the waves that travel.
const SOLVED: [f64; 11] = [0.0, 0.6, 1.5, 3.0, 5.0, 8.0, 13.0, 20.0, 34.0, 60.0, 110.0];
/// Wavenumbers at which both are compared, 1/m.
const COMPARED: [f64; 4] = [2.2, 6.4, 16.0, 45.0];
/// Part by which they may differ there.
const AGREE: f64 = 0.02;
/// Travelling waves that are closer to each other than this part are solved for once.
const CLOSE: f64 = 1e-3;
/// Part of a solution that is new to the others; less is rounding.
const NEW: f64 = 1e-9;

/// Displacements along a rail, and their derivatives by parameters of its track.
#[derive(Debug, Clone, PartialEq)]
pub struct AlongRail {
    /// m/N, `[at]`.
    pub response: Vec<Complex64>,
    /// m/N for a unit of each parameter, `[parameters][at]`.
    pub slopes: Vec<Vec<Complex64>>,
}

impl Infinite {
    /// Displacements along each of the `forces` (0 x, 1 y, 2 n) under a unit force along it, at the distances `at`, m,
    /// all above 0, and the angular frequency `omega`, rad/s; m/N, e^{+iωt}, `[forces][at]`. Errors: a rail without
    /// damping, not converged.
    pub fn along(&self, omega: f64, forces: &[usize], at: &[f64]) -> Result<Vec<Vec<Complex64>>> {
        Ok(self.along_slopes(omega, forces, at, &[])?.into_iter().map(|of| of.response).collect())
    }

    /// The same with its derivatives by parameters that change the track as `slopes`.
    pub(crate) fn along_slopes(
        &self,
        omega: f64,
        forces: &[usize],
        at: &[f64],
        slopes: &[TrackSlope],
    ) -> Result<Vec<AlongRail>> {
        if self.loss <= 0.0 && self.dashpots.col_iter().flat_map(|c| c.iter()).all(|v| *v == 0.0) {
            return Err(Error::Job(
                "found neither a loss factor of the rail nor one of pads or ballast, expected one above 0: without \
                 damping its waves never decay"
                    .into(),
            ));
        }
        let places = self.places(omega);
        let solved: Vec<Mat<Complex64>> = places.iter().map(|&xi| self.response(omega, xi)).collect();
        let whole = self.parts(omega);
        let changes: Vec<Vec<Mat<Complex64>>> = slopes.iter().map(|slope| self.changes(omega, slope)).collect();
        let compared: Vec<Mat<Complex64>> = COMPARED.iter().map(|&xi| self.response(omega, xi)).collect();
        let one = |&force: &usize| {
            let load = Mat::from_fn(self.loads.nrows(), 1, |i, _| Complex64::new(self.loads[(i, force)], 0.0));
            let basis = orthonormal(solved.iter().map(|s| Mat::from_fn(s.nrows(), 1, |i, _| s[(i, force)])));
            let [zero, first, second] = [0, 1, 2].map(|k| basis.transpose() * (&whole[k] * &basis));
            let few = Few { parts: [zero, first, second], load: basis.transpose() * &load };
            for (xi, direct) in COMPARED.iter().zip(&compared) {
                let wanted: Complex64 = (0..direct.nrows()).map(|i| load[(i, 0)] * direct[(i, force)]).sum();
                let found = few.at(*xi);
                if !((found - wanted).norm() <= AGREE * wanted.norm()) {
                    return Err(Error::NotConverged(format!(
                        "waves of an infinite rail: found {found:.3e} m²/N at the wavenumber {xi} 1/m and the angular \
                         frequency {omega:.1} rad/s, expected {wanted:.3e} m²/N"
                    )));
                }
            }
            let waves = few.waves()?;
            let response = at.iter().map(|x| few.response(&waves, *x)).collect();
            let slope = |change: &Vec<Mat<Complex64>>| {
                let projected: Vec<_> = change.iter().map(|part| basis.transpose() * (part * &basis)).collect();
                let poles = slopes_at_poles(&waves, &projected);
                at.iter().map(|x| poles.iter().map(|pole| pole.at(*x)).sum()).collect()
            };
            Ok(AlongRail { response, slopes: changes.iter().map(slope).collect() })
        };
        forces.iter().map(one).collect()
    }

    /// Wavenumbers at which A is solved, of either sign, 1/m.
    fn places(&self, omega: f64) -> Vec<f64> {
        let mut all: Vec<f64> = SOLVED.to_vec();
        all.extend(self.travelling(omega));
        all.sort_by(f64::total_cmp);
        all.dedup_by(|a, b| *a - *b <= CLOSE * *a);
        let opposite: Vec<f64> = all.iter().filter(|xi| **xi > 0.0).map(|xi| -xi).collect();
        all.extend(opposite);
        all
    }

    /// A0, A1 and A2 at an angular frequency, rad/s.
    fn parts(&self, omega: f64) -> [Mat<Complex64>; 3] {
        let loss = Complex64::new(1.0, self.loss);
        let q = self.loads.nrows();
        let elastic = |k: usize| Mat::from_fn(q, q, |i, j| loss * self.elastic[k][(i, j)]);
        let mut zero = elastic(0);
        for i in 0..q {
            for j in 0..q {
                zero[(i, j)] += Complex64::new(self.springs[(i, j)], omega * self.dashpots[(i, j)]);
            }
            zero[(i, i)] -= omega * omega;
        }
        [zero, elastic(1), elastic(2)]
    }

    /// A′0, and A′1 and A′2 where they are not 0, of a parameter at an angular frequency, rad/s.
    fn changes(&self, omega: f64, slope: &TrackSlope) -> Vec<Mat<Complex64>> {
        let q = self.loads.nrows();
        let layers = [slope.pad, slope.ballast];
        let springs = self.units.sum(q, &layers.map(|l| l.stiffness));
        let dashpots = self.units.sum(q, &layers.map(|l| l.viscosity));
        let zero = Mat::from_fn(q, q, |i, j| {
            Complex64::new(springs[(i, j)], omega * dashpots[(i, j)] + slope.loss * self.elastic[0][(i, j)])
        });
        let lost = |k: usize| Mat::from_fn(q, q, |i, j| Complex64::new(0.0, slope.loss * self.elastic[k][(i, j)]));
        let count = if slope.loss == 0.0 { 0 } else { 2 };
        std::iter::once(zero).chain((1..=count).map(lost)).collect()
    }
}

/// A wave of the rail: A(ξ)u = 0.
struct Wave {
    /// Wavenumber ξ, 1/m.
    xi: Complex64,
    /// u on few motions.
    u: Vec<Complex64>,
    /// bᵀu.
    load: Complex64,
    /// uᵀ(A1 + 2ξA2)u.
    size: Complex64,
}

impl Wave {
    /// True if it decays along +x.
    fn decays(&self) -> bool {
        self.xi.im < 0.0
    }
}

/// Change by a parameter at the pole of a wave.
struct PoleSlope {
    xi: Complex64,
    /// Residues of the simple pole and of the double one.
    simple: Complex64,
    double: Complex64,
}

impl PoleSlope {
    /// Its part in H′ at the distance x, m.
    fn at(&self, x: f64) -> Complex64 {
        Complex64::I * (self.simple - Complex64::I * x * self.double) * (-Complex64::I * self.xi * x).exp()
    }
}

/// Changes at the poles of the waves that decay along +x by a parameter that changes A by `parts`, on few motions.
fn slopes_at_poles(waves: &[Wave], parts: &[Mat<Complex64>]) -> Vec<PoleSlope> {
    let few = waves.first().map_or(0, |wave| wave.u.len());
    let shapes = Mat::from_fn(few, waves.len(), |i, k| waves[k].load / waves[k].size * waves[k].u[i]);
    let coupled: Vec<Mat<Complex64>> = parts.iter().map(|part| shapes.transpose() * (part * &shapes)).collect();
    let sum = |j: usize, k: usize, weight: &dyn Fn(i32) -> Complex64| -> Complex64 {
        (0i32..).zip(&coupled).map(|(n, part)| weight(n) * part[(j, k)]).sum()
    };
    let pole = |(j, wave): (usize, &Wave)| {
        let xi = wave.xi;
        let at = |n: i32| xi.powi(n);
        let derivative = sum(j, j, &|n| if n == 0 { Complex64::default() } else { f64::from(n) * xi.powi(n - 1) });
        let others = (0..waves.len()).filter(|&k| k != j);
        let simple = derivative + others.map(|k| 2.0 * sum(j, k, &at) / (xi - waves[k].xi)).sum::<Complex64>();
        PoleSlope { xi, simple, double: sum(j, j, &at) }
    };
    waves.iter().enumerate().filter(|(_, wave)| wave.decays()).map(pole).collect()
}

/// A on few motions.
struct Few {
    parts: [Mat<Complex64>; 3],
    load: Mat<Complex64>,
}

impl Few {
    fn matrix(&self, xi: Complex64) -> Mat<Complex64> {
        let [zero, first, second] = &self.parts;
        Mat::from_fn(zero.nrows(), zero.ncols(), |i, j| zero[(i, j)] + xi * (first[(i, j)] + xi * second[(i, j)]))
    }

    /// bᵀA⁻¹b at a wavenumber, 1/m.
    fn at(&self, xi: f64) -> Complex64 {
        let moved = self.matrix(Complex64::new(xi, 0.0)).partial_piv_lu().solve(&self.load);
        (0..moved.nrows()).map(|i| self.load[(i, 0)] * moved[(i, 0)]).sum()
    }

    /// H at the distance x, m, as the sum of the waves that decay along +x.
    fn response(&self, waves: &[Wave], x: f64) -> Complex64 {
        let residue = |wave: &Wave| wave.load * wave.load / wave.size;
        let decaying = waves.iter().filter(|wave| wave.decays());
        decaying.map(|wave| -Complex64::I * residue(wave) * (-Complex64::I * wave.xi * x).exp()).sum()
    }

    /// Its waves, those that decay along +x and those along −x.
    fn waves(&self) -> Result<Vec<Wave>> {
        let [zero, first, second] = &self.parts;
        let m = zero.nrows();
        let solver = second.partial_piv_lu();
        let (stiff, turned) = (solver.solve(zero), solver.solve(first));
        // Of (u, ξu).
        let companion = Mat::from_fn(2 * m, 2 * m, |i, j| match (i < m, j < m) {
            (true, false) if j - m == i => Complex64::new(1.0, 0.0),
            (true, _) => Complex64::default(),
            (false, true) => -stiff[(i - m, j)],
            (false, false) => -turned[(i - m, j - m)],
        });
        let failed = |e| Error::NotConverged(format!("waves of an infinite rail: {e:?}"));
        let eigen = companion.eigen().map_err(failed)?;
        let (values, vectors) = (eigen.S().column_vector(), eigen.U());
        let wave = |k: usize| {
            let xi = values[k];
            let slope = |i: usize, j: usize| first[(i, j)] + 2.0 * xi * second[(i, j)];
            let u = |i: usize| vectors[(i, k)];
            let load: Complex64 = (0..m).map(|i| self.load[(i, 0)] * u(i)).sum();
            let size: Complex64 = (0..m).map(|i| u(i) * (0..m).map(|j| slope(i, j) * u(j)).sum::<Complex64>()).sum();
            Wave { xi, u: (0..m).map(u).collect(), load, size }
        };
        let finite = |wave: &Wave| wave.xi.is_finite() && (wave.load * wave.load / wave.size).is_finite();
        Ok((0..2 * m).map(wave).filter(finite).collect())
    }
}

/// Orthonormal columns that span those given.
fn orthonormal(columns: impl Iterator<Item = Mat<Complex64>>) -> Mat<Complex64> {
    let mut kept: Vec<Mat<Complex64>> = Vec::new();
    let norm = |v: &Mat<Complex64>| v.col(0).iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
    for mut column in columns {
        let size = norm(&column);
        for _ in 0..2 {
            for other in &kept {
                let part: Complex64 = (0..column.nrows()).map(|i| other[(i, 0)].conj() * column[(i, 0)]).sum();
                (0..column.nrows()).for_each(|i| column[(i, 0)] -= part * other[(i, 0)]);
            }
        }
        let left = norm(&column);
        if left > NEW * size {
            kept.push(Mat::from_fn(column.nrows(), 1, |i, _| column[(i, 0)] / left));
        }
    }
    let rows = kept.first().map_or(0, |v| v.nrows());
    Mat::from_fn(rows, kept.len(), |i, k| kept[k][(i, 0)])
}
