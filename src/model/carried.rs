//! Rates at which a body that turns under another one carries its deformation past contact points fixed in space.
//!
//! A particle of the lower body at y + u(y, t) in the fixed frame, where y turns with Ω about the axle e, has the
//! velocity Ω e × y + ∂u/∂t + Ω D u, with the derivative D of the Cartesian components of u along the angle. The upper
//! body does not turn: its particle at a contact point P is at P + v and has the velocity ∂v/∂t. The two particles
//! meet, y + u = P + v, and with w = u − v and the derivative D′ of cylindrical components, D u = D′ u + e × u, they
//! slide on each other with
//!
//! ṡ = Ω e × P + ∂w/∂t + Ω (D u − e × w) = Ω e × P + ∂w/∂t + Ω (D′ u + e × v).
//!
//! The term e × w is the change of the rigid creep where the particles that meet have moved. So a body that has turned
//! as a whole, D′ u = 0, slides as before. With modes u = Σ φ_k q_k and D′ φ_k = Σ φ_j d_jk at the contact rows, D′ u
//! is Ψ d q; the residual compliance moves with ∂/∂t alone.

use super::CoupledModel;
use crate::body::rotation::ModalRotation;
use crate::grid::Interface;
use faer::Mat;

/// Ω (D′ u + e × v) at the contact rows of `interface` by the amplitudes of the modes of `pair`, 1/(√kg s), `[3n, m]`,
/// where its lower body turns at `speed`, rad/s; none where the material of both bodies passes alike.
pub(super) fn carried(
    interface: &Interface,
    pair: &CoupledModel,
    rotation: Option<&ModalRotation>,
    speed: f64,
) -> Option<Mat<f64>> {
    interface.axle(0)?;
    let (psi, lower) = (&pair.modes, pair.lower_modes);
    let mut rates = Mat::zeros(psi.nrows(), psi.ncols());
    if let Some(rotation) = rotation {
        let along = psi.as_ref().subcols(0, lower) * &rotation.derivative;
        rates.as_mut().subcols_mut(0, lower).copy_from(faer::Scale(speed) * along);
    }
    // Rows of the upper body are those of −v.
    for k in lower..psi.ncols() {
        for i in 0..interface.len() {
            let turn = speed * interface.axle(i).unwrap_or(0.0);
            rates[(3 * i, k)] = turn * psi[(3 * i + 1, k)];
            rates[(3 * i + 1, k)] = -turn * psi[(3 * i, k)];
        }
    }
    Some(rates)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::ReducedBody;
    use crate::grid::TurningPoints;

    /// Points at a radius on both faces, with their frames x = e_θ, y = −e_r or e_r, and the angles θ.
    const POINTS: [(f64, f64, f64); 3] = [(0.12, 1.0, 0.3), (0.1, -1.0, 0.3), (0.14, 1.0, 2.0)];
    const SPEED: f64 = 30.0;

    /// Modes (u_x, u_y) of the fixed frame at a point (r, θ) as rows (x, y, n) there.
    fn rows(of: impl Fn(usize, [f64; 2]) -> [f64; 2], modes: usize) -> Mat<f64> {
        Mat::from_fn(9, modes, |row, k| {
            let (r, e, angle) = POINTS[row / 3];
            let (s, c) = angle.sin_cos();
            let u = of(k, [r * c, r * s]);
            [c * u[1] - s * u[0], -e * (c * u[0] + s * u[1]), 0.0][row % 3]
        })
    }

    fn coupled(lower: Mat<f64>, upper: Mat<f64>) -> CoupledModel {
        let body = |modes: Mat<f64>| {
            let omega: Vec<f64> = (0..modes.ncols()).map(|k| 1e3 + k as f64).collect();
            let damping = vec![0.0; omega.len()];
            ReducedBody::new(omega, damping, modes, Mat::identity(9, 9))
        };
        CoupledModel::new(&body(lower), &body(upper)).unwrap()
    }

    fn interface() -> Interface {
        Interface::turning(TurningPoints {
            area: vec![1e-4; 3],
            creep: POINTS.map(|(r, ..)| [SPEED * r, 0.0]).to_vec(),
            axle: POINTS.map(|(_, e, _)| e).to_vec(),
        })
        .unwrap()
    }

    /// Translations of the lower body along x and y, its rotation as a whole and those of the upper one: what slides is
    /// the velocity Ω e × (P − u) of its particles there, e × P + φ e × (e × P) in the turned direction, and nothing.
    #[test]
    fn rigid_motions_are_carried_as_particles_move() {
        let motion = |k: usize, [x, y]: [f64; 2]| [[1.0, 0.0], [0.0, 1.0], [-y, x]][k];
        let pair = coupled(rows(motion, 3), rows(motion, 3));
        // D′ of translations: −e × u; a rotation has none.
        let derivative = Mat::from_fn(3, 3, |i, j| [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0; 3]][i][j]);
        let none = Mat::zeros(3, 3);
        let rotation = ModalRotation { gyroscopic: none.clone(), stiffness: none, derivative };
        let found = carried(&interface(), &pair, Some(&rotation), SPEED).unwrap();
        let turned = |[x, y]: [f64; 2]| [-SPEED * y, SPEED * x];
        let lower = |k: usize, at: [f64; 2]| if k < 2 { turned(motion(k, at)).map(|v| -v) } else { [0.0; 2] };
        let upper = |k: usize, at: [f64; 2]| turned(motion(k, at));
        let wanted = [rows(lower, 3), rows(upper, 3)];
        for row in 0..9 {
            for k in 0..6 {
                let wanted = wanted[k / 3][(row, k % 3)];
                assert!((found[(row, k)] - wanted).abs() < 1e-12, "{row} {k}: {} {wanted}", found[(row, k)]);
            }
        }
        let still = Interface::points(vec![0.0; 3], vec![[1.0, 0.0]; 3]).unwrap();
        assert!(carried(&still, &pair, Some(&rotation), SPEED).is_none());
    }
}
