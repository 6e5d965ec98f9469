//! Two bodies on one interface: compliance, residual and modes of both together.

use super::broadcast;
use crate::body::{ReducedBody, Side};
use crate::parallel::World;
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// Two bodies on one interface: combined compliance and modes.
#[derive(Debug, Clone)]
pub struct ModalPair {
    /// W = C1 + E C2 E, m/N, `[3n, 3n]`.
    pub compliance: Mat<f64>,
    /// Residual S = W − Ψ Ω⁻² Ψᵀ, m/N, `[3n, 3n]`.
    pub residual: Mat<f64>,
    /// Ψ = [Φ1, E Φ2], 1/√kg, `[3n, m1 + m2]`.
    pub modes: Mat<f64>,
    /// Angular frequencies, rad/s, `[m1 + m2]`: the lower body's, then the upper one's.
    pub omega: Vec<f64>,
    /// Modal damping coefficients, 1/s, `[m1 + m2]`.
    pub damping: Vec<f64>,
    /// m1.
    pub lower_modes: usize,
    /// Damping between different modes, 1/s, `[m1 + m2, m1 + m2]` with a zero diagonal; only a damping matrix has it.
    pub coupling: Option<Mat<f64>>,
}

impl ModalPair {
    /// Combines the lower and the upper body (both in lower form). Rigid-body modes (ω = 0) have no part in the compliance.
    pub fn new(lower: &ReducedBody, upper: &ReducedBody) -> Result<Self> {
        for (name, b) in [("lower", lower), ("upper", upper)] {
            let m = b.omega.len();
            if b.damping.len() != m || b.contact_modes.ncols() != m || b.contact_modes.nrows() != b.compliance.nrows() {
                return Err(Error::Defect(format!(
                    "reduced {name} body: {m} frequencies, {} damping coefficients, contact modes {:?}, compliance {:?}",
                    b.damping.len(),
                    b.contact_modes.shape(),
                    b.compliance.shape()
                )));
            }
        }
        let compliance = combined_compliance(lower.compliance.as_ref(), upper.compliance.as_ref())?;
        let (rows, m1, m2) = (compliance.nrows(), lower.omega.len(), upper.omega.len());
        let modes = Mat::from_fn(rows, m1 + m2, |i, k| {
            if k < m1 {
                lower.contact_modes[(i, k)]
            } else {
                Side::Upper.sign(i) * upper.contact_modes[(i, k - m1)]
            }
        });
        let omega: Vec<f64> = lower.omega.iter().chain(&upper.omega).copied().collect();
        let damping = lower.damping.iter().chain(&upper.damping).copied().collect();
        let scaled = Mat::from_fn(rows, m1 + m2, |i, k| if omega[k] > 0.0 { modes[(i, k)] / omega[k] } else { 0.0 });
        let residual = &compliance - &scaled * scaled.transpose();
        Ok(Self { compliance, residual, modes, omega, damping, lower_modes: m1, coupling: None })
    }

    /// Collective: the pair of rank 0 on every rank; a damping between different modes stays behind.
    pub fn broadcast(world: &World, root: Option<&ModalPair>) -> Self {
        let list = |of: &dyn Fn(&ModalPair) -> Vec<f64>| world.broadcast(root.map(of).unwrap_or_default());
        Self {
            compliance: broadcast(world, root.map(|p| &p.compliance)),
            residual: broadcast(world, root.map(|p| &p.residual)),
            modes: broadcast(world, root.map(|p| &p.modes)),
            omega: list(&|p| p.omega.clone()),
            damping: list(&|p| p.damping.clone()),
            coupling: None,
            lower_modes: list(&|p| vec![p.lower_modes as f64]).first().map_or(0, |&n| n as usize),
        }
    }

    /// Takes the modal damping matrices ΦᵀCΦ of the bodies, 1/s, `[m1, m1]` and `[m2, m2]`, where there are any.
    pub fn set_damping(&mut self, lower: Option<&Mat<f64>>, upper: Option<&Mat<f64>>) {
        let m = self.omega.len();
        let mut coupling = Mat::zeros(m, m);
        for (first, matrix) in [(0, lower), (self.lower_modes, upper)] {
            let Some(c) = matrix else { continue };
            for j in 0..c.ncols() {
                for i in 0..c.nrows() {
                    if i == j {
                        self.damping[first + i] = c[(i, i)];
                    } else {
                        coupling[(first + i, first + j)] = c[(i, j)];
                    }
                }
            }
        }
        self.coupling = Some(coupling);
    }
}

/// Influence matrix of the interface, W = C1 + E C2 E with E = diag(−1, −1, 1) at each node, from the compliances of the
/// lower body 1 and the upper body 2, both in lower form with rows (x, y, n), `[3n, 3n]`, m/N. With the nodal reactions
/// R = (tx, ty, p) on body 1 it gives (w_x, w_y, gap change) = W R. Symmetric positive definite when C1 and C2 are.
pub fn combined_compliance(lower: MatRef<'_, f64>, upper: MatRef<'_, f64>) -> Result<Mat<f64>> {
    if lower.nrows() != lower.ncols() || lower.nrows() % 3 != 0 || upper.shape() != lower.shape() {
        return Err(Error::Defect(format!(
            "compliances of {:?} and {:?} entries cannot be combined on one interface",
            lower.shape(),
            upper.shape()
        )));
    }
    Ok(Mat::from_fn(lower.nrows(), lower.ncols(), |i, j| {
        lower[(i, j)] + Side::Upper.sign(i) * Side::Upper.sign(j) * upper[(i, j)]
    }))
}
