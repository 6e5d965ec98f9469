//! The mesh of a section.

use super::{Path, SectionCell, SectionLayer};
use crate::fem::ElasticMaterial;
use crate::quadrature::GAUSS_3;
use crate::{Error, Result};
use std::collections::BTreeMap;

/// An element of a section.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionElement {
    /// Its kind.
    pub kind: SectionCell,
    /// Its nodes, as the kind numbers them.
    pub nodes: Vec<usize>,
    /// Its material: 0 of the body, k of the layer k − 1 of the section.
    pub layer: usize,
}

impl SectionElement {
    /// Its nodes the other way round.
    pub(super) fn turn(&mut self) {
        let order: &[usize] = match self.kind {
            SectionCell::Tri6 => &[0, 2, 1, 5, 4, 3],
            SectionCell::Quad8 => &[0, 3, 2, 1, 7, 6, 5, 4],
            SectionCell::Quad9 => &[0, 3, 2, 1, 7, 6, 5, 4, 8],
        };
        self.nodes = order.iter().map(|&k| self.nodes[k]).collect();
    }
}

/// A section in lower form: nodes (r, y), m. Of a body of revolution r is the distance from the axle and y = 0 at the
/// contact point; of one along a line r is z, and both are 0 at the contact point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CrossSection {
    /// Nodes (r, y), m.
    pub nodes: Vec<[f64; 2]>,
    /// Elements; their area is positive in the plane (r, y).
    pub elements: Vec<SectionElement>,
    /// Nodes of each named group of edges, ascending.
    pub groups: BTreeMap<String, Vec<usize>>,
    /// Edges of the running line: first, last and middle node, from small to large y.
    pub tread: Vec<[usize; 3]>,
    /// Layers of other materials than that of the body.
    pub layers: Vec<SectionLayer>,
}

/// Part of the largest radius within which a node is on the axle.
const ON_AXLE: f64 = 1e-12;

impl CrossSection {
    /// Nodes on the axle of a solid body of revolution, ascending.
    pub(crate) fn on_axle(&self) -> impl Iterator<Item = usize> + '_ {
        let largest = self.nodes.iter().map(|x| x[0]).fold(0.0, f64::max);
        (0..self.nodes.len()).filter(move |&k| self.nodes[k][0] <= ON_AXLE * largest)
    }

    /// Material of an element, with `body` as that of elements without a layer.
    pub fn material(&self, element: &SectionElement, body: ElasticMaterial) -> ElasticMaterial {
        element.layer.checked_sub(1).and_then(|k| self.layers.get(k)).map_or(body, |layer| layer.material)
    }

    /// Mass, kg, y of the centre of mass, m, and moments of inertia about the axle and about a diameter through the
    /// centre of mass, kg m², of the body of revolution of which `body` is the material without layers.
    pub fn inertia(&self, body: ElasticMaterial) -> [f64; 4] {
        let mut sums = [0.0; 4];
        for element in &self.elements {
            let density = self.material(element, body).density;
            for shape in element.kind.points() {
                let (r, jacobian) = self.jacobian(element, &shape);
                let y: f64 = element.nodes.iter().zip(&shape.value).map(|(&k, n)| n * self.nodes[k][1]).sum();
                let mass = 2.0 * std::f64::consts::PI * r * jacobian.determinant * shape.weight * density;
                [1.0, y, r * r, y * y].iter().zip(&mut sums).for_each(|(f, sum)| *sum += mass * f);
            }
        }
        let [mass, first, polar, second] = sums;
        [mass, first / mass, polar, 0.5 * polar + second - first * first / mass]
    }

    /// Volume of the body of revolution, m³.
    pub fn volume(&self) -> f64 {
        let mut sum = 0.0;
        for element in &self.elements {
            for shape in element.kind.points() {
                let (r, jacobian) = self.jacobian(element, &shape);
                sum += 2.0 * std::f64::consts::PI * r * jacobian.determinant * shape.weight;
            }
        }
        sum
    }

    /// The section seen from the other side: y is reversed.
    pub fn mirrored(mut self) -> Self {
        self.nodes.iter_mut().for_each(|x| x[1] = -x[1]);
        self.elements.iter_mut().for_each(SectionElement::turn);
        self.tread = self.tread.iter().rev().map(|&[first, last, middle]| [last, first, middle]).collect();
        self
    }

    /// Area, m².
    pub fn area(&self) -> f64 {
        let of = |e: &SectionElement| {
            e.kind.points().iter().map(|s| self.jacobian(e, s).1.determinant * s.weight).sum::<f64>()
        };
        self.elements.iter().map(of).sum()
    }

    /// The edges of elements whose nodes are all in a group: first, last and middle node.
    pub fn edges(&self, group: &str) -> Vec<[usize; 3]> {
        let inside = |k: usize| self.groups.get(group).is_some_and(|g| g.binary_search(&k).is_ok());
        let of = |e: &SectionElement| e.kind.edges().iter().map(|edge| edge.map(|k| e.nodes[k])).collect::<Vec<_>>();
        self.elements.iter().flat_map(of).filter(|edge| edge.iter().all(|&k| inside(k))).collect()
    }

    /// Length of an edge, m.
    pub(super) fn length(&self, edge: &[usize; 3]) -> f64 {
        self.along(edge).iter().map(|(_, step)| step).sum()
    }

    /// Values of the shape functions of an edge's first, last and middle node, and the length, m, at its integration
    /// points.
    pub(super) fn along(&self, edge: &[usize; 3]) -> [([f64; 3], f64); 3] {
        GAUSS_3.map(|(s, weight)| {
            let slopes = [s - 0.5, s + 0.5, -2.0 * s];
            let tangent = [0, 1].map(|c| edge.iter().zip(slopes).map(|(&k, d)| d * self.nodes[k][c]).sum::<f64>());
            ([0.5 * s * (s - 1.0), 0.5 * s * (s + 1.0), 1.0 - s * s], weight * tangent[0].hypot(tangent[1]))
        })
    }

    /// The radius and the Jacobian at a point of an element.
    pub(super) fn jacobian(&self, element: &SectionElement, shape: &super::shape::SectionShape) -> (f64, Jacobian) {
        let mut j = [[0.0; 2]; 2];
        let mut r = 0.0;
        for ((&node, value), slope) in element.nodes.iter().zip(&shape.value).zip(&shape.slope) {
            let x = self.nodes[node];
            r += value * x[0];
            for (a, row) in j.iter_mut().enumerate() {
                row.iter_mut().zip(x).for_each(|(j, x)| *j += slope[a] * x);
            }
        }
        let determinant = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let inverse =
            [[j[1][1] / determinant, -j[0][1] / determinant], [-j[1][0] / determinant, j[0][0] / determinant]];
        (r, Jacobian { determinant, inverse })
    }

    /// An error that names the element if one is inverted or, round an axle, reaches it.
    pub fn check(&self, path: Path) -> Result<()> {
        let below = |&k: &usize| path == Path::Axle && self.nodes[k][0] < 0.0;
        for (number, element) in self.elements.iter().enumerate() {
            if let Some(&node) = element.nodes.iter().find(|k| below(k)) {
                let [r, y] = self.nodes[node];
                return Err(Error::Input(format!(
                    "element {} of the section: found a node at r = {r:.6} m, y = {y:.6} m, beyond the axle; expected \
                     r ≥ 0: the section must lie beside the axle or, of a solid body, reach it",
                    number + 1
                )));
            }
            for shape in element.kind.points() {
                let (r, jacobian) = self.jacobian(element, &shape);
                if !(jacobian.determinant > 0.0) || (path == Path::Axle && !(r > 0.0)) {
                    return Err(Error::Input(format!(
                        "element {} of the section, at r = {r:.6} m: found the Jacobian {:.3e}, expected \
                         Jacobian > 0 and, round an axle, r > 0; elements must not be inverted, and the section must \
                         lie beside the axle or, of a solid one, reach it",
                        number + 1,
                        jacobian.determinant
                    )));
                }
            }
        }
        Ok(())
    }
}

/// The Jacobian of an element at a point.
pub(super) struct Jacobian {
    /// Area of the section over that of the reference element.
    pub determinant: f64,
    /// Derivatives of the reference coordinates: ∂ξ_k/∂(r, y) is `[c][k]`.
    inverse: [[f64; 2]; 2],
}

impl Jacobian {
    /// Derivatives along r and y of what has these derivatives along the reference coordinates.
    pub fn slope(&self, reference: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|c| (0..2).map(|k| self.inverse[c][k] * reference[k]).sum())
    }
}
