//! Layers of a section with a material of their own, as the rubber of a resilient wheel.
//!
//! A layer l with the loss factor η_l has the complex stiffness (1 + iη_l) K_l. A mode φ of angular frequency ω then
//! has the loss factor η = Σ η_l φᵀK_lφ/ω², the share of its strain energy in each layer times the loss factor there
//! (modal strain energy: C. D. Johnson, D. A. Kienholz, *AIAA Journal* 20 (1982), 1284–1290).

use super::forms::{strains, stress, Strains};
use super::{Forms, Path};
use crate::fem::ElasticMaterial;
use faer::{Mat, MatRef};

/// Layer of a section.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionLayer {
    /// Its name.
    pub name: String,
    /// Its material.
    pub material: ElasticMaterial,
    /// Its loss factor.
    pub loss: f64,
}

impl Forms {
    /// Xᵀ K_l X with the stiffness K_l of one layer at the order n, of the columns X, `[k, k]`; `layer` is that of its
    /// elements.
    pub(crate) fn strain_energy(&self, n: usize, layer: usize, x: MatRef<'_, f64>) -> Mat<f64> {
        let (order, whole) = (self.path.wavenumber(n), self.path.length_integral(n));
        let mut energy = Mat::zeros(x.ncols(), x.ncols());
        for element in self.section.elements.iter().filter(|e| e.layer == layer) {
            let (lambda, shear) = self.section.material(element, self.material).lame();
            for shape in element.kind.points() {
                let (r, jacobian) = self.section.jacobian(element, &shape);
                let weight = whole * jacobian.determinant * shape.weight * self.path.measure(r);
                let over = (self.path == Path::Axle).then_some(1.0 / r);
                let mut strained = Mat::<f64>::zeros(6, x.ncols());
                let mut stressed = Mat::<f64>::zeros(6, x.ncols());
                for (i, &node) in element.nodes.iter().enumerate() {
                    let Some(at) = self.amplitude(node) else { continue };
                    let [zero, one] = strains(shape.value[i], jacobian.slope(shape.slope[i]), over);
                    let all: Strains = std::array::from_fn(|k| [0, 1, 2].map(|c| zero[k][c] + order * one[k][c]));
                    for (target, rows) in [(&mut strained, all), (&mut stressed, stress(&all, lambda, shear))] {
                        for column in 0..x.ncols() {
                            for (k, row) in rows.iter().enumerate() {
                                target[(k, column)] += (0..3).map(|c| row[c] * x[(at + c, column)]).sum::<f64>();
                            }
                        }
                    }
                }
                energy += faer::Scale(weight) * (strained.transpose() * stressed);
            }
        }
        energy
    }
}
