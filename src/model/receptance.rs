//! Receptance of a body: displacement at the contact per unit force there, over frequency.
//!
//! A unit force in direction c is spread over the contact nodes by shares d_i, Σ d_i = 1, and the displacement is the
//! mean of the nodes with the same shares, so that the receptance is symmetric: H(ω) = Dᵀ [Φ diag(1/(ω_k² − ω² + i
//! c_k ω)) Φᵀ + S] D with the residual S = C − Φ Ω⁻² Φᵀ, taken as static. Of a body that rotates the modes are
//! coupled: diag(…) is then (K − ω² + iωC)⁻¹, and H is not symmetric.

use crate::body::{ModalMatrix, ReducedBody};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};
use num_complex::Complex;

const TWO_PI: f64 = 2.0 * std::f64::consts::PI;

/// Receptance of a body in lower form under a force spread by `share` (`[n]`) at the frequencies (Hz), m/N,
/// `[frequencies][3][3]`: displacement in direction (x, y, n into the body) by force in direction (x, y, n).
pub fn receptance(body: &ReducedBody, share: &[f64], frequency: &[f64]) -> Vec<[[Complex<f64>; 3]; 3]> {
    // Dᵀ C D and Dᵀ Φ.
    let static_ = spread_twice(body.compliance.as_ref(), share);
    let modes: Vec<[f64; 3]> = (0..body.omega.len())
        .map(|k| {
            std::array::from_fn(|c| share.iter().enumerate().map(|(i, d)| d * body.contact_modes[(3 * i + c, k)]).sum())
        })
        .collect();
    let at = |f: &f64| {
        let w = TWO_PI * f;
        let mut h: [[Complex<f64>; 3]; 3] =
            std::array::from_fn(|a| std::array::from_fn(|b| Complex::new(static_[a][b], 0.0)));
        if let (ModalMatrix::Diagonal(stiffness), ModalMatrix::Diagonal(damping)) = (&body.stiffness, &body.damping) {
            for ((phi, &own), &c) in modes.iter().zip(stiffness).zip(damping) {
                let rest = if own > 0.0 { 1.0 / own } else { 0.0 };
                let dynamic = Complex::new(own - w * w, c * w).inv() - rest;
                for a in 0..3 {
                    for b in 0..3 {
                        h[a][b] += dynamic * phi[a] * phi[b];
                    }
                }
            }
            return h;
        }
        // Coupled modes: Φ ((K − ω² + iωC)⁻¹ − K⁻¹) Φᵀ.
        let phi = Mat::from_fn(modes.len(), 3, |k, c| modes[k][c]);
        let rest = phi.transpose() * body.stiffness.statics(phi.as_ref());
        let one = |i: usize, j: usize| if i == j { w * w } else { 0.0 };
        let dynamic = Mat::from_fn(modes.len(), modes.len(), |i, j| {
            Complex::new(body.stiffness.get(i, j) - one(i, j), w * body.damping.get(i, j))
        });
        let moved = dynamic.partial_piv_lu().solve(Mat::from_fn(modes.len(), 3, |k, c| Complex::new(phi[(k, c)], 0.0)));
        for a in 0..3 {
            for b in 0..3 {
                let sum: Complex<f64> = (0..modes.len()).map(|k| phi[(k, a)] * moved[(k, b)]).sum();
                h[a][b] += sum - rest[(a, b)];
            }
        }
        h
    };
    frequency.iter().map(at).collect()
}

fn spread_twice(m: MatRef<'_, f64>, share: &[f64]) -> [[f64; 3]; 3] {
    let loaded: Vec<(usize, f64)> = share.iter().copied().enumerate().filter(|s| s.1 != 0.0).collect();
    std::array::from_fn(|a| {
        std::array::from_fn(|b| {
            let column = |&(j, d): &(usize, f64)| -> f64 {
                d * loaded.iter().map(|&(i, e)| e * m[(3 * i + a, 3 * j + b)]).sum::<f64>()
            };
            loaded.iter().map(column).sum()
        })
    })
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
        let h = &receptance(&b, &share, &[0.0])[0];
        for a in 0..3 {
            for c in 0..3 {
                let mut want = 0.0;
                for i in 0..2 {
                    for j in 0..2 {
                        want += share[i] * share[j] * b.compliance[(3 * i + a, 3 * j + c)];
                    }
                }
                let error = (h[a][c] - want).norm();
                assert!(error < 1e-14 * h[2][2].norm(), "({a}, {c}): {} and {want}", h[a][c]);
            }
        }
    }

    /// One mass on a spring and a dashpot, with a spring s in series: x = F (1/(k − mω² + icω) + s).
    #[test]
    fn one_degree_of_freedom_has_its_closed_form() {
        let (m, k, c, s): (f64, f64, f64, f64) = (2.0, 8e5, 40.0, 1e-7);
        let contact_modes = Mat::from_fn(3, 1, |i, _| if i == 2 { 1.0 / m.sqrt() } else { 0.0 });
        let compliance = Mat::from_fn(3, 3, |i, j| if i == 2 && j == 2 { 1.0 / k + s } else { 0.0 });
        let b = ReducedBody::new(vec![(k / m).sqrt()], vec![c / m], contact_modes, compliance);
        let f = [0.0, 30.0, 100.0, 100.6584, 500.0, 5000.0];
        for (f, h) in f.iter().zip(receptance(&b, &[1.0], &f)) {
            let w = TWO_PI * f;
            let want = Complex::new(k - m * w * w, c * w).inv() + s;
            assert!((h[2][2] - want).norm() < 1e-11 * want.norm(), "{f} Hz: {} and {want}", h[2][2]);
            assert_eq!(h[0][2].norm() + h[1][1].norm(), 0.0);
            // Force leads the displacement: the phase lies between 0 and −180°.
            assert!(h[2][2].im <= 0.0, "{f} Hz: {}", h[2][2]);
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
        for (f, h) in f.iter().zip(receptance(&body, &[1.0], &f)) {
            let wave = |sign: f64| {
                let w = TWO_PI * f + sign * n * speed;
                Complex::new(w0 * w0 - w * w, c * w).inv()
            };
            let want = 0.5 * phi * phi * (wave(1.0) + wave(-1.0)) + s;
            assert!((h[2][2] - want).norm() < 1e-11 * want.norm(), "{f} Hz: {} and {want}", h[2][2]);
        }
    }

    #[test]
    fn it_is_symmetric_and_has_one_peak_for_each_mode() {
        let f: Vec<f64> = (0..800).map(|i| 0.5 * i as f64).collect();
        let h = receptance(&body(), &[0.5, 0.5], &f);
        let size: Vec<f64> = h.iter().map(|h| h[2][2].norm()).collect();
        let peaks: Vec<f64> =
            (1..799).filter(|&i| size[i] > size[i - 1] && size[i] > size[i + 1]).map(|i| f[i]).collect();
        assert_eq!(peaks, [100.0, 300.0]);
        let largest = |h: &[[Complex<f64>; 3]; 3]| h.iter().flatten().map(|v| v.norm()).fold(0.0, f64::max);
        assert!(h.iter().all(|h| (h[0][2] - h[2][0]).norm() <= 1e-14 * largest(h)));
    }
}
