//! Rotation terms of the modes of one order, at 1 rad/s: exact, as the section holds for all angles.

use super::forms::Prestress;
use super::modes::FourierModes;
use super::Forms;
use faer::Mat;

/// Rotation among the m modes of an order, at 1 rad/s.
///
/// For n ≥ 1 with the families c (cos) and s (sin): ΦsᵀMDΦc = −g, ΦcᵀMDΦs = g, g symmetric; D is the derivative along
/// the angle of Cartesian components. Of order 0 `coupling` is ΦᵀMDΦ itself, which is skew.
#[derive(Debug, Clone, PartialEq)]
pub struct RotationBlocks {
    /// g, or ΦᵀMDΦ of order 0, `[m, m]`.
    pub coupling: Mat<f64>,
    /// Φᵀ(K_σ − K_c)Φ of either family, `[m, m]`.
    pub stiffness: Mat<f64>,
}

/// The rotation of `modes` with the centrifugal `prestress` at 1 rad/s; none leaves K_σ out.
pub fn blocks(forms: &Forms, modes: &FourierModes, prestress: Option<&Prestress>) -> RotationBlocks {
    let (n, phi) = (modes.order, modes.vectors.as_ref());
    // U_j V_k ∓ V_j U_k with the sign of D, which takes e_r to e_θ and e_θ to −e_r.
    let exchanged = phi.transpose() * forms.exchanged(n, phi);
    let m = modes.omega.len();
    let coupling = Mat::from_fn(m, m, |j, k| match n {
        0 => -exchanged[(j, k)],
        _ => exchanged[(j, k)] + if j == k { n as f64 } else { 0.0 },
    });
    RotationBlocks { coupling, stiffness: phi.transpose() * forms.rotation(n, prestress, phi) }
}
