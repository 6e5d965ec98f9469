//! Receptance of a body: displacement at the contact per unit force there, over frequency.
//!
//! A unit force in direction c is spread over the contact nodes by shares d_i, Σ d_i = 1, and the displacement is the
//! mean of the nodes with the same shares, so that the receptance is symmetric: H(ω) = Dᵀ [Φ diag(1/(ω_k² − ω² + i
//! c_k ω)) Φᵀ + S] D with the residual S = C − Φ Ω⁻² Φᵀ, taken as static. Of a body that rotates the modes are
//! coupled: diag(…) is then (K − ω² + iωC)⁻¹, and H is not symmetric. Each of several contacts has shares of its own
//! and three columns of D: H holds the receptances of each and the transfer receptances between them.

use crate::body::{ModalMatrix, ReducedBody};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};
use num_complex::Complex;

const TWO_PI: f64 = 2.0 * std::f64::consts::PI;

/// Receptance of a body in lower form at the frequencies (Hz), m/N: for each a matrix `[3p, 3p]`, the displacement of
/// place i in direction (x, y, n into the body), row 3i + direction, by a unit force at place j, column 3j + direction.
/// A place is its share of each contact node, `[n]`, which sum to 1; p places, one for each contact.
pub fn receptance(body: &ReducedBody, places: &[Vec<f64>], frequency: &[f64]) -> Vec<Mat<Complex<f64>>> {
    let loaded: Vec<(usize, usize, f64)> = places
        .iter()
        .enumerate()
        .flat_map(|(p, share)| share.iter().enumerate().filter(|s| *s.1 != 0.0).map(move |(i, &d)| (p, i, d)))
        .collect();
    // Dᵀ Φ and Dᵀ C D.
    let mut phi = Mat::<f64>::zeros(3 * places.len(), body.omega.len());
    let mut static_ = Mat::<f64>::zeros(3 * places.len(), 3 * places.len());
    for &(p, i, d) in &loaded {
        for a in 0..3 {
            for k in 0..body.omega.len() {
                phi[(3 * p + a, k)] += d * body.contact_modes[(3 * i + a, k)];
            }
            for &(q, j, e) in &loaded {
                for b in 0..3 {
                    static_[(3 * p + a, 3 * q + b)] += d * e * body.compliance[(3 * i + a, 3 * j + b)];
                }
            }
        }
    }
    let complex = |m: MatRef<'_, f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| Complex::new(m[(i, j)], 0.0));
    let at_rest = complex(static_.as_ref());
    let at = |f: &f64| {
        let w = TWO_PI * f;
        let mut h = at_rest.clone();
        if let (ModalMatrix::Diagonal(stiffness), ModalMatrix::Diagonal(damping)) = (&body.stiffness, &body.damping) {
            for (k, (&own, &c)) in stiffness.iter().zip(damping).enumerate() {
                let rest = if own > 0.0 { 1.0 / own } else { 0.0 };
                let dynamic = Complex::new(own - w * w, c * w).inv() - rest;
                for b in 0..h.ncols() {
                    for a in 0..h.nrows() {
                        h[(a, b)] += dynamic * phi[(a, k)] * phi[(b, k)];
                    }
                }
            }
            return h;
        }
        // Coupled modes: Φ ((K − ω² + iωC)⁻¹ − K⁻¹) Φᵀ.
        let rest = &phi * body.stiffness.statics(phi.transpose());
        let one = |i: usize, j: usize| if i == j { w * w } else { 0.0 };
        let dynamic = Mat::from_fn(body.omega.len(), body.omega.len(), |i, j| {
            Complex::new(body.stiffness.get(i, j) - one(i, j), w * body.damping.get(i, j))
        });
        let moved = dynamic.partial_piv_lu().solve(complex(phi.transpose()));
        h + complex(phi.as_ref()) * moved - complex(rest.as_ref())
    };
    frequency.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::rotation::ModalRotation;
    use crate::model::rotating::turning;

    /// Two nodes; two modes and a residual S.
    fn body() -> ReducedBody {
        let omega = vec![TWO_PI * 100.0, TWO_PI * 300.0];
        let contact_modes = Mat::from_fn(6, 2, |i, k| 0.1 * ((i + 1) as f64 * (k as f64 + 0.4)).cos());
        let compliance = Mat::from_fn(6, 6, |i, j| {
            let modal: f64 = (0..2).map(|k| contact_modes[(i, k)] * contact_modes[(j, k)] / omega[k].powi(2)).sum();
            modal + if i == j { 2e-9 } else { 1e-10 }
        });
        ReducedBody::new(omega, vec![4.0, 9.0], contact_modes, compliance)
    }

    #[test]
    fn at_rest_it_is_the_static_compliance() {
        let b = body();
        let share = [0.25, 0.75];
        let h = &receptance(&b, &[share.to_vec()], &[0.0])[0];
        for a in 0..3 {
            for c in 0..3 {
                let mut want = 0.0;
                for i in 0..2 {
                    for j in 0..2 {
                        want += share[i] * share[j] * b.compliance[(3 * i + a, 3 * j + c)];
                    }
                }
                let error = (h[(a, c)] - want).norm();
                assert!(error < 1e-14 * h[(2, 2)].norm(), "({a}, {c}): {} and {want}", h[(a, c)]);
            }
        }
    }

    /// Two places have the receptances that each has alone, and those between them answer to each other.
    #[test]
    fn transfer_receptances_are_reciprocal() {
        let body = body();
        let places = [vec![1.0, 0.0], vec![0.25, 0.75]];
        let f = [0.0, 90.0, 310.0];
        let both = receptance(&body, &places, &f);
        for (p, place) in places.iter().enumerate() {
            for (h, alone) in both.iter().zip(receptance(&body, std::slice::from_ref(place), &f)) {
                let own = h.submatrix(3 * p, 3 * p, 3, 3);
                assert!((own - &alone).norm_max() < 1e-14 * alone.norm_max());
            }
        }
        for h in &both {
            assert!((h - h.transpose()).norm_max() < 1e-14 * h.norm_max());
        }
        let static_ = 0.25 * body.compliance[(2, 2)] + 0.75 * body.compliance[(2, 5)];
        assert!((both[0][(2, 5)] - static_).norm() < 1e-14 * static_.abs());
    }

    /// One mass on a spring and a dashpot, with a spring s in series: x = F (1/(k − mω² + icω) + s).
    #[test]
    fn one_degree_of_freedom_has_its_closed_form() {
        let (m, k, c, s): (f64, f64, f64, f64) = (2.0, 8e5, 40.0, 1e-7);
        let contact_modes = Mat::from_fn(3, 1, |i, _| if i == 2 { 1.0 / m.sqrt() } else { 0.0 });
        let compliance = Mat::from_fn(3, 3, |i, j| if i == 2 && j == 2 { 1.0 / k + s } else { 0.0 });
        let b = ReducedBody::new(vec![(k / m).sqrt()], vec![c / m], contact_modes, compliance);
        let f = [0.0, 30.0, 100.0, 100.6584, 500.0, 5000.0];
        for (f, h) in f.iter().zip(receptance(&b, &[vec![1.0]], &f)) {
            let w = TWO_PI * f;
            let want = Complex::new(k - m * w * w, c * w).inv() + s;
            assert!((h[(2, 2)] - want).norm() < 1e-11 * want.norm(), "{f} Hz: {} and {want}", h[(2, 2)]);
            assert_eq!(h[(0, 2)].norm() + h[(1, 1)].norm(), 0.0);
            // Force leads the displacement: the phase lies between 0 and −180°.
            assert!(h[(2, 2)].im <= 0.0, "{f} Hz: {}", h[(2, 2)]);
        }
    }

    /// An axial pair (cos nθ, sin nθ) of a body that rotates, touched where the sine is 0: its waves e^{±inθ} answer
    /// each by itself to a force of the frequency ω, as masses of the body at rest at ω ± nΩ, damping included: H =
    /// φ²/2 Σ± 1/(ω0² − (ω ± nΩ)² + ic(ω ± nΩ)) + s.
    #[test]
    fn waves_of_a_body_that_rotates_answer_each_by_itself() {
        let (w0, c, n, speed, phi, s): (f64, f64, f64, f64, f64, f64) = (TWO_PI * 400.0, 30.0, 3.0, 25.0, 0.2, 3e-9);
        let contact_modes = Mat::from_fn(3, 2, |i, k| if i == 2 && k == 0 { phi } else { 0.0 });
        let compliance = Mat::from_fn(3, 3, |i, j| if i == 2 && j == 2 { phi * phi / (w0 * w0) + s } else { 0.0 });
        let skew = Mat::from_fn(2, 2, |i, j| [[0.0, -n], [n, 0.0]][i][j]);
        let square = Mat::from_fn(2, 2, |i, j| if i == j { -n * n } else { 0.0 });
        let rotation = ModalRotation { gyroscopic: 2.0 * &skew, stiffness: square, derivative: skew };
        let body =
            turning(ReducedBody::new(vec![w0; 2], vec![c; 2], contact_modes, compliance), &rotation, &[speed; 2]);
        // At 0 Hz, beside and at the two peaks, far above.
        let f = [0.0, 200.0, 400.0 - n * speed / TWO_PI, 400.0, 400.0 + n * speed / TWO_PI, 1500.0];
        for (f, h) in f.iter().zip(receptance(&body, &[vec![1.0]], &f)) {
            let wave = |sign: f64| {
                let w = TWO_PI * f + sign * n * speed;
                Complex::new(w0 * w0 - w * w, c * w).inv()
            };
            let want = 0.5 * phi * phi * (wave(1.0) + wave(-1.0)) + s;
            assert!((h[(2, 2)] - want).norm() < 1e-11 * want.norm(), "{f} Hz: {} and {want}", h[(2, 2)]);
        }
    }

    #[test]
    fn it_is_symmetric_and_has_one_peak_for_each_mode() {
        let f: Vec<f64> = (0..800).map(|i| 0.5 * i as f64).collect();
        let h = receptance(&body(), &[vec![0.5, 0.5]], &f);
        let size: Vec<f64> = h.iter().map(|h| h[(2, 2)].norm()).collect();
        let peaks: Vec<f64> =
            (1..799).filter(|&i| size[i] > size[i - 1] && size[i] > size[i + 1]).map(|i| f[i]).collect();
        assert_eq!(peaks, [100.0, 300.0]);
        let largest = |h: &Mat<Complex<f64>>| h.col_iter().flat_map(|c| c.iter()).map(|v| v.norm()).fold(0.0, f64::max);
        assert!(h.iter().all(|h| (h[(0, 2)] - h[(2, 0)]).norm() <= 1e-14 * largest(h)));
    }
}
