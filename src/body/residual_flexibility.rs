//! Residual flexibility: displacements by contact forces beyond the modes that are kept: K⁻¹ − Φ Ω⁻² Φᵀ, taken
//! statically.

use super::fe::{BodyModes, FeBody};
use super::statics::Statics;
use crate::parallel::World;
use crate::{Error, Result};
use faer::MatRef;

/// A node of a body as the contact and the modes move it, in lower form.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeRecovery {
    /// Modes at the node, (x, y, z), 1/√kg, `[3][m]`; on every rank.
    pub modes: [Vec<f64>; 3],
    /// Displacement (x, y, z) of the node by forces on the contact rows (x, y, n) without the part in the modes kept,
    /// m/N, `[3][3n]`; on rank 0, empty elsewhere.
    pub residual: [Vec<f64>; 3],
}

/// Collective: the motion of an owned node, given on the rank that owns it. `contact_modes` are the modes at the
/// contact rows, 1/√kg, `[3n, m]`, on rank 0. Three static solves: K⁻¹ is symmetric, so what contact forces move at
/// the node is what unit forces at the node move in the contact.
pub fn at_node(
    world: &World,
    body: &FeBody,
    statics: &mut Statics,
    modes: &BodyModes,
    contact_modes: Option<MatRef<'_, f64>>,
    node: Option<usize>,
) -> Result<NodeRecovery> {
    let mut motion = NodeRecovery { modes: Default::default(), residual: body.transfer(world, statics, node)? };
    for vector in &modes.vectors {
        let values = body.at_node(world, vector, node);
        motion.modes.iter_mut().zip(values).for_each(|(row, v)| row.push(v));
    }
    world.on_root(|| {
        let phi = contact_modes.ok_or_else(|| Error::Defect("no modes at the contact on rank 0".into()))?;
        if motion.residual.iter().any(|row| row.len() != phi.nrows()) || phi.ncols() != modes.omega.len() {
            return Err(Error::Defect(format!(
                "{} contact rows and {} modes of a node, {:?} in the contact",
                motion.residual[0].len(),
                modes.omega.len(),
                phi.shape()
            )));
        }
        for (row, own) in motion.residual.iter_mut().zip(&motion.modes) {
            for (k, (&w, p)) in modes.omega.iter().zip(own).enumerate().filter(|(_, (&w, _))| w > 0.0) {
                let share = p / (w * w);
                row.iter_mut().zip(phi.col(k).iter()).for_each(|(g, c)| *g -= share * c);
            }
        }
        Ok(())
    })?;
    Ok(motion)
}
