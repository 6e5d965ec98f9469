//! Prestress of a section by centrifugal forces.

use super::{strains, stress, Forms};
use crate::Result;
use faer::Mat;

/// ∫σ0 : ∇N_a ⊗ ∇N_b r dr dy of a prestress that is the same all round: along the section, and along the angle with
/// 1/r² and its σ_θθ; at each pair.
#[derive(Debug, Clone)]
pub struct Prestress {
    pub(super) along_section: Vec<f64>,
    pub(super) along_angle: Vec<f64>,
}

/// Part of the shift at which a motion of the whole body yields.
const ALMOST_FREE: f64 = 1e-5;

impl Forms {
    /// The prestress of the centrifugal forces at 1 rad/s, ρ r outwards.
    pub fn centrifugal(&self) -> Result<Prestress> {
        let mut load = Mat::zeros(self.order(), 1);
        for element in &self.section.elements {
            for shape in element.kind.points() {
                let (r, jacobian) = self.section.jacobian(element, &shape);
                let density = self.section.material(element, self.material).density;
                let weight = self.path.length_integral(0) * density * r * r * jacobian.determinant * shape.weight;
                for (&node, value) in element.nodes.iter().zip(&shape.value) {
                    if let Some(k) = self.amplitude(node) {
                        load[(k, 0)] += weight * value;
                    }
                }
            }
        }
        for (node, mass) in self.rings.masses() {
            if let Some(k) = self.amplitude(node) {
                load[(k, 0)] += self.path.length_integral(0) * mass * self.section.nodes[node][0];
            }
        }
        // Motions of a free body as a whole cost next to nothing, so that they neither come nor make the stiffness
        // singular.
        let still = self.factor(0, ALMOST_FREE * self.shift())?.positive("the section under centrifugal forces")?;
        let u = still.solve(load.as_ref());
        Ok(self.prestress(u.col(0).iter().copied().collect::<Vec<f64>>().as_slice()))
    }

    /// The prestress that the axisymmetric motion `u`, m, `[order]`, brings.
    fn prestress(&self, u: &[f64]) -> Prestress {
        let zeros = vec![0.0; self.pairs.columns.len()];
        let mut out = Prestress { along_section: zeros.clone(), along_angle: zeros };
        for element in &self.section.elements {
            let (lambda, shear) = self.section.material(element, self.material).lame();
            for shape in element.kind.points() {
                let (r, jacobian) = self.section.jacobian(element, &shape);
                let slopes: Vec<[f64; 2]> = shape.slope.iter().map(|&s| jacobian.slope(s)).collect();
                let mut stressed = [0.0; 6];
                for (i, &node) in element.nodes.iter().enumerate() {
                    let Some(k) = self.amplitude(node) else { continue };
                    let [zero, _] = strains(shape.value[i], slopes[i], Some(1.0 / r));
                    let of_node = stress(&zero, lambda, shear);
                    for (s, row) in stressed.iter_mut().zip(&of_node) {
                        *s += (0..3).map(|c| row[c] * u[k + c]).sum::<f64>();
                    }
                }
                let [rr, around, yy, _, ry, _] = stressed;
                let weight = jacobian.determinant * shape.weight * r;
                for i in 0..slopes.len() {
                    for j in 0..slopes.len() {
                        let Some(k) = self.pair(element.nodes[i], element.nodes[j]) else { continue };
                        let (a, b) = (slopes[i], slopes[j]);
                        let along = rr * a[0] * b[0] + yy * a[1] * b[1] + ry * (a[0] * b[1] + a[1] * b[0]);
                        out.along_section[k] += weight * along;
                        out.along_angle[k] += weight * around * shape.value[i] * shape.value[j] / (r * r);
                    }
                }
            }
        }
        out
    }
}
