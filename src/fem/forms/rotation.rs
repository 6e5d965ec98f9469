//! Terms that rotation of the material adds to the equations of motion in a frame that does not turn, each at 1 rad/s.
//! With D = W·∇ acting on Cartesian components the acceleration of the material is ü + 2 D u̇ + D D u − Ω² r; after
//! integration by parts (div W = 0, W·n = 0 on the boundary of a body of revolution) there remain a skew, a symmetric
//! and a prestress form.

use super::{Form, NodeCoupling};
use crate::fem::element::{element, inverse, to_space};
use crate::fem::rotation::Axis;
use crate::fem::ElasticMaterial;
use crate::mesh::quality::{determinant, jacobian};
use crate::mesh::Cell;

/// Values N_a and derivatives D N_a = W·∇N_a of the shape functions at the points of the rule for the mass, with the
/// mass of each point, kg.
fn points(cell: Cell<'_>, x: &[[f64; 3]], density: f64, axis: &Axis, mut take: impl FnMut(f64, &[f64], &[f64])) {
    let n = cell.kind.nodes();
    let mut along = vec![0.0; n];
    for p in cell.kind.mass_rule() {
        let shape = &p.shape;
        let j = jacobian(x, shape);
        let det = determinant(&j);
        let inv = inverse(&j, det);
        let place = std::array::from_fn(|c| (0..n).map(|a| shape.values[a] * x[a][c]).sum());
        let w = axis.velocity(place);
        for (d, g) in along.iter_mut().zip(&shape.gradients) {
            let g = to_space(*g, &inv);
            *d = (0..3).map(|c| w[c] * g[c]).sum();
        }
        take(density * p.weight * det, &shape.values[..n], &along);
    }
}

/// Gyroscopic form ∫ ρ (v·Du − u·Dv) dV, kg: skew.
pub struct Gyroscopic {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// Axis of the rotation.
    pub axis: Axis,
}

impl Form for Gyroscopic {
    fn coupling(&self) -> NodeCoupling {
        NodeCoupling::Components
    }

    fn symmetric(&self) -> bool {
        false
    }

    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]) {
        let n = cell.kind.nodes();
        out.fill(0.0);
        points(cell, x, self.density, &self.axis, |mass, value, along| {
            for a in 0..n {
                for b in 0..n {
                    out[n * a + b] += mass * (value[a] * along[b] - along[a] * value[b]);
                }
            }
        });
    }
}

/// Form of the convected velocity, K_c: ∫ ρ Dv·Du dV, kg; it enters the stiffness with a minus.
pub struct Convected {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// Axis of the rotation.
    pub axis: Axis,
}

impl Form for Convected {
    fn coupling(&self) -> NodeCoupling {
        NodeCoupling::Components
    }

    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]) {
        let n = cell.kind.nodes();
        out.fill(0.0);
        points(cell, x, self.density, &self.axis, |mass, _, along| {
            for a in 0..n {
                for b in 0..n {
                    out[n * a + b] += mass * along[a] * along[b];
                }
            }
        });
    }
}

/// Stiffness by prestress, K_σ: ∫ σ0 : ∇v·∇u dV with the stress of a displacement.
pub struct PrestressStiffness<'a> {
    /// Elastic constants.
    pub material: ElasticMaterial,
    /// Displacement of all local nodes, m, `[nodes][3]`.
    pub displacement: &'a [[f64; 3]],
}

impl Form for PrestressStiffness<'_> {
    fn coupling(&self) -> NodeCoupling {
        NodeCoupling::Components
    }

    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]) {
        let n = cell.kind.nodes();
        out.fill(0.0);
        let u: Vec<f64> = cell.nodes.iter().flat_map(|&i| self.displacement[i as usize]).collect();
        for p in element(cell.kind).stresses(x, &u, &self.material) {
            let [xx, yy, zz, xy, yz, zx] = p.stress.map(|s| s * p.volume);
            for a in 0..n {
                let g = p.gradients[a];
                let t = [
                    xx * g[0] + xy * g[1] + zx * g[2],
                    xy * g[0] + yy * g[1] + yz * g[2],
                    zx * g[0] + yz * g[1] + zz * g[2],
                ];
                for b in 0..n {
                    out[n * a + b] += (0..3).map(|c| t[c] * p.gradients[b][c]).sum::<f64>();
                }
            }
        }
    }
}
