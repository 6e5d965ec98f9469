//! Equations of motion of the modes of a body that rotates: q̈ + (C + G) q̇ + (ω² + K_σ − K_c + C D′) q = f. Damping
//! acts on the material rate q̇ + D′q.

use crate::body::rotation::{ModalRotation, RotationTerms};
use crate::body::{ModalMatrix, ReducedBody};
use crate::{Error, Result};
use faer::Mat;
use num_complex::Complex;

/// The equations of motion of the modes of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalDynamics {
    /// Modal stiffness, 1/s²: diag(ω²) of a body at rest.
    pub stiffness: ModalMatrix,
    /// Modal damping, 1/s, with the gyroscopic terms of a body that rotates.
    pub damping: ModalMatrix,
    /// Terms of rotation in both.
    pub turning: Option<RotationTerms>,
}

impl ModalDynamics {
    /// Rotation of modes with the angular frequencies `omega` (rad/s) and the damping C of the body at rest. Beside the
    /// `rotation` are the angular velocities of the body of each mode, rad/s, `[m]`: modes of two bodies have no common
    /// terms.
    pub fn new(omega: &[f64], damping: ModalMatrix, rotation: Option<(&ModalRotation, &[f64])>) -> Self {
        let Some((rotation, speeds)) = rotation else {
            return Self { stiffness: ModalMatrix::squares(omega), damping, turning: None };
        };
        let c = damping.full();
        let m = omega.len();
        let derivative = Mat::from_fn(m, m, |i, j| speeds[i] * rotation.derivative[(i, j)]);
        let own = Mat::from_fn(m, m, |i, j| if i == j { omega[i] * omega[i] } else { 0.0 });
        let centrifugal = Mat::from_fn(m, m, |i, j| speeds[i] * speeds[i] * rotation.stiffness[(i, j)]);
        let stiffness = own + centrifugal + &c * &derivative;
        let turning = RotationTerms { dissipation: damping, derivative: Some(derivative.into()) };
        let damping = c + Mat::from_fn(m, m, |i, j| speeds[i] * rotation.gyroscopic[(i, j)]);
        Self { stiffness: stiffness.into(), damping: damping.into(), turning: Some(turning) }
    }

    /// The modes of the lower and of the upper body, which contact forces alone couple.
    pub fn joined(lower: &Self, upper: &Self) -> Self {
        Self {
            stiffness: lower.stiffness.joined(&upper.stiffness),
            damping: lower.damping.joined(&upper.damping),
            turning: RotationTerms::joined(
                (lower.turning.as_ref(), &lower.damping),
                (upper.turning.as_ref(), &upper.damping),
            ),
        }
    }
}

/// A body at rest, or several, turning with the angular velocities `speeds` of each mode, rad/s: its residual
/// compliance stays as it is, its modes yield as those that rotate do.
pub fn turning(body: ReducedBody, rotation: &ModalRotation, speeds: &[f64]) -> ReducedBody {
    let ModalDynamics { stiffness, damping, turning } =
        ModalDynamics::new(&body.omega, body.damping.clone(), Some((rotation, speeds)));
    let phi = &body.contact_modes;
    let yielding = |stiffness: &ModalMatrix| phi * stiffness.statics(phi.transpose());
    let compliance = &body.compliance + (yielding(&stiffness) - yielding(&body.stiffness));
    ReducedBody { stiffness, damping, turning, compliance, ..body }
}

/// A wave of a body that rotates, as seen from beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotatingWave {
    /// Frequency, Hz.
    pub frequency: f64,
    /// Nodal diameters; positive where the wave travels with the rotation, negative against it.
    pub diameters: f64,
}

/// Nodal diameters of the motion Re(φ e^{λt}), Im λ > 0, with the amplitudes `modal` of the modes of a body: positive
/// where it travels with the rotation, negative against it, near 0 where it stands.
pub fn travelling(rotation: &ModalRotation, modal: &[Complex<f64>]) -> f64 {
    // D′φ = −inφ where the phase ωt − nθ stays as it is.
    let turned = ModalMatrix::from(rotation.derivative.clone()).times(modal);
    let product: Complex<f64> = modal.iter().zip(turned).map(|(q, d)| q.conj() * d).sum();
    let square: f64 = modal.iter().map(|q| q.norm_sqr()).sum();
    if square > 0.0 {
        -product.im / square
    } else {
        0.0
    }
}

/// Motions of a free body as a whole that do not oscillate have eigenvalues below this part of the highest frequency,
/// by rounding, or this part of Ω, where the mesh is not quite of revolution. The precession of the axis has Ω times
/// a ratio of moments of inertia, 1 for a sphere, 2 for a disc.
const STILL: [f64; 2] = [1e-6, 0.02];

/// The waves of an undamped body with the modes `omega` (rad/s; 0 for those of a free body as a whole) that rotates
/// with the angular velocities `speeds` of each mode, rad/s; ascending, as many as modes: of those as a whole the
/// precession of the axis oscillates, the others have the frequency 0. An error where rotation leaves no stiffness.
pub fn waves(omega: &[f64], rotation: &ModalRotation, speeds: &[f64]) -> Result<Vec<RotatingWave>> {
    let m = omega.len();
    let speed = speeds.iter().fold(0.0, |fastest: f64, speed| fastest.max(speed.abs()));
    let ModalDynamics { stiffness, damping: gyroscopic, .. } =
        ModalDynamics::new(omega, vec![0.0; m].into(), Some((rotation, speeds)));
    // Velocities in units of the highest frequency.
    let unit = omega.last().copied().unwrap_or(1.0).max(f64::MIN_POSITIVE);
    let companion = Mat::from_fn(2 * m, 2 * m, |i, j| match (i < m, j < m) {
        (true, true) => 0.0,
        (true, false) => f64::from(u8::from(i + m == j)),
        (false, true) => -stiffness.get(i - m, j) / (unit * unit),
        (false, false) => -gyroscopic.get(i - m, j - m) / unit,
    });
    let failed = |e: String| Error::NotConverged(format!("modes of a rotating body: {e}"));
    let eigen = companion.eigen().map_err(|e| failed(format!("{e:?}")))?;
    let values = eigen.S().column_vector();
    let mut found = Vec::new();
    let rigid = omega.iter().filter(|w| **w == 0.0).count();
    let least = if rigid > 0 { STILL[0].max(STILL[1] * speed / unit) } else { 0.0 };
    let still = (0..2 * m).filter(|&k| values[k].norm() <= least).count();
    let whole = rigid.min(still / 2);
    found.resize(whole, RotatingWave { frequency: 0.0, diameters: 0.0 });
    for k in (0..2 * m).filter(|&k| values[k].im > 0.0 && values[k].norm() > least) {
        let modal: Vec<Complex<f64>> = (0..m).map(|i| eigen.U()[(i, k)]).collect();
        let frequency = values[k].im * unit / (2.0 * std::f64::consts::PI);
        found.push(RotatingWave { frequency, diameters: travelling(rotation, &modal) });
    }
    if found.len() != m {
        return Err(failed(format!(
            "{} of {m} oscillate at {speed} rad/s: it is beyond what the body stands",
            found.len()
        )));
    }
    found.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pair (cos nθ, sin nθ) of a body in which the material moves along the axis only: waves p = ω0 ± nΩ of the
    /// fixed frame, and −δ for both with the damping of the material, δ = c/2: what moves with the material decays
    /// alike in either frame.
    #[test]
    fn an_axial_pair_splits_by_its_diameters_and_decays_with_the_material() {
        let (w, n, speed, c) = (2.0e3, 3.0, 25.0, 6.0);
        let skew = Mat::from_fn(2, 2, |i, j| [[0.0, -n], [n, 0.0]][i][j]);
        let square = Mat::from_fn(2, 2, |i, j| if i == j { -n * n } else { 0.0 });
        let rotation = ModalRotation { gyroscopic: 2.0 * &skew, stiffness: square, derivative: skew };
        let ModalDynamics { stiffness: k, damping: d, .. } =
            ModalDynamics::new(&[w, w], vec![c; 2].into(), Some((&rotation, &[speed; 2])));
        let companion = Mat::from_fn(4, 4, |i, j| match (i < 2, j < 2) {
            (true, true) => 0.0,
            (true, false) => w * f64::from(u8::from(i + 2 == j)),
            (false, true) => -k.get(i - 2, j) / w,
            (false, false) => -d.get(i - 2, j - 2),
        });
        let mut found: Vec<(f64, f64)> =
            companion.eigenvalues().unwrap().into_iter().filter(|l| l.im > 0.0).map(|l| (l.im, l.re)).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let damped = (w * w - 0.25 * c * c).sqrt();
        for ((frequency, growth), wanted) in found.iter().zip([damped - n * speed, damped + n * speed]) {
            assert!((frequency / wanted - 1.0).abs() < 1e-11, "{frequency} rad/s, expected {wanted}");
            assert!((growth + 0.5 * c).abs() < 1e-9, "{growth} 1/s");
        }
        assert_eq!(rotation.diameters(), [n, n]);
        // Beside the body the forward wave has the higher frequency.
        let both = waves(&[w, w], &rotation, &[speed; 2]).unwrap();
        for (wave, sign) in both.iter().zip([-1.0, 1.0]) {
            assert!((wave.frequency * 2.0 * std::f64::consts::PI / (w + sign * n * speed) - 1.0).abs() < 1e-11);
            assert!((wave.diameters - sign * n).abs() < 1e-9, "{wave:?}");
        }
    }
}
