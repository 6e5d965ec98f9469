//! The integrals of equation (3) over the cells of some nodes, and their derivative.

use super::surface::{ConsistentSurface, Rule};
use crate::contact::law::{Augmentation, Node, Status};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Some nodes of an interface with the cells that have all four corners among them.
pub(crate) struct ContactCells {
    rule: Rule,
    /// Numbers of the nodes, ascending or not, `[k]`.
    pub nodes: Vec<usize>,
    /// Corners, by place in `nodes`, and area, m².
    cells: Vec<([usize; 4], f64)>,
    /// H⁻¹ of all nodes of the interface, that of these among each other, 1/m², `[k, k]`.
    inverse: Mat<f64>,
    /// Place of the eight neighbours of each node and of itself, row by row from the lowest x and y; `usize::MAX`
    /// where there is none, `[k]`.
    neighbours: Vec<[usize; 9]>,
}

/// Stresses and motions at nodes.
#[derive(Clone, Copy)]
pub(crate) struct NodeFields<'a> {
    /// H⁻¹R (tx, ty, p), Pa, `[3k]`.
    pub stress: &'a [f64],
    /// Creep (x, y) and gap, `[3k]`.
    pub motion: &'a [f64],
}

impl NodeFields<'_> {
    /// The law at the node `i`.
    fn node(&self, i: usize) -> Node {
        let (t, y) = (&self.stress[3 * i..3 * i + 3], &self.motion[3 * i..3 * i + 3]);
        Node { pressure: t[2], traction: [t[0], t[1]], gap: y[2], creep: [y[0], y[1]] }
    }
}

/// The law that is integrated: Coulomb's with the coefficient `friction`, and ρ in Pa per unit of gap and creep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct IntegratedLaw {
    pub rho: Augmentation,
    pub friction: f64,
}

impl IntegratedLaw {
    /// The status of the node `i` by the fields there.
    pub fn status(&self, fields: NodeFields<'_>, i: usize) -> Status {
        fields.node(i).project(self.rho, self.friction).status
    }
}

/// ∫Nᵀ of the projections over cells.
#[derive(Debug, Clone)]
pub(crate) struct Integral {
    /// (x, y, n) of each node, N, `[3k]`.
    pub forces: Vec<f64>,
    /// Area under pressure, and that of it that sticks, m².
    pub area: [f64; 2],
}

/// Derivative of an [`Integral`] by what is projected at the nodes: blocks of each node and its neighbours, as
/// [`ContactCells`] counts them, m².
pub(crate) struct CellDerivative(Vec<[[[f64; 3]; 3]; 9]>);

/// The integral by the `rule` over `cells` (corners and areas, m²) of `k` nodes with these fields.
pub(super) fn integral(
    rule: &Rule,
    k: usize,
    cells: impl Iterator<Item = ([usize; 4], f64)>,
    fields: NodeFields<'_>,
    law: IntegratedLaw,
) -> Integral {
    let mut found = Integral { forces: vec![0.0; 3 * k], area: [0.0; 2] };
    visit(rule, cells, fields, law, |corners, shape, weight, projected| {
        let [x, y] = projected.traction;
        for (&i, n) in corners.iter().zip(shape) {
            for (c, v) in [x, y, projected.pressure].into_iter().enumerate() {
                found.forces[3 * i + c] += weight * n * v;
            }
        }
        found.area[0] += weight;
        found.area[1] += if projected.status == Status::Stick { weight } else { 0.0 };
    });
    found
}

/// Calls `with` for each point of quadrature under pressure: corners of its cell, shape functions, area of the point,
/// projections.
fn visit(
    rule: &Rule,
    cells: impl Iterator<Item = ([usize; 4], f64)>,
    fields: NodeFields<'_>,
    law: IntegratedLaw,
    mut with: impl FnMut(&[usize; 4], &[f64; 4], f64, &crate::contact::law::Projected),
) {
    for (corners, area) in cells {
        let at = corners.map(|i| fields.node(i));
        // What is projected is a mean of that at the corners.
        if at.iter().all(|n| n.pressure <= law.rho.normal * n.gap) {
            continue;
        }
        for (shape, weight) in rule {
            let mean = |of: &dyn Fn(&Node) -> f64| (0..4).map(|k| shape[k] * of(&at[k])).sum::<f64>();
            let node = Node {
                pressure: mean(&|n| n.pressure),
                traction: [mean(&|n| n.traction[0]), mean(&|n| n.traction[1])],
                gap: mean(&|n| n.gap),
                creep: [mean(&|n| n.creep[0]), mean(&|n| n.creep[1])],
            };
            let projected = node.project(law.rho, law.friction);
            if projected.status != Status::Open {
                with(&corners, shape, weight * area, &projected);
            }
        }
    }
}

impl ContactCells {
    /// Cells around `nodes`.
    pub fn new(surface: &ConsistentSurface, nodes: Vec<usize>) -> Self {
        let mut place = vec![usize::MAX; surface.nodes()];
        nodes.iter().enumerate().for_each(|(a, &i)| place[i] = a);
        let placed = surface.cells().map(|(corners, area)| (corners.map(|i| place[i]), area));
        let cells: Vec<_> = placed.filter(|(corners, _)| corners.iter().all(|&a| a != usize::MAX)).collect();
        let inverse = Mat::from_fn(nodes.len(), nodes.len(), |a, b| surface.inverse(nodes[a], nodes[b]));
        let mut neighbours = vec![[usize::MAX; 9]; nodes.len()];
        for (corners, _) in &cells {
            for (a, b) in pairs() {
                neighbours[corners[a]][beside(a, b)] = corners[b];
            }
        }
        Self { rule: surface.rule(), nodes, cells, inverse, neighbours }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// H⁻¹R at the nodes for forces R on them, N, `[3k]`: Pa, `[3k]`.
    pub fn stress(&self, forces: &[f64]) -> Vec<f64> {
        let k = self.len();
        let mut out = vec![0.0; 3 * k];
        let forces = MatRef::from_row_major_slice(forces, k, 3);
        matmul(MatMut::from_row_major_slice_mut(&mut out, k, 3), Accum::Replace, &self.inverse, forces, 1.0, Par::Seq);
        out
    }

    /// An entry of H⁻¹, 1/m², by places.
    pub fn inverse(&self, a: usize, b: usize) -> f64 {
        self.inverse[(a, b)]
    }

    /// The integral over the cells.
    pub fn integral(&self, fields: NodeFields<'_>, law: IntegratedLaw) -> Integral {
        integral(&self.rule, self.len(), self.cells.iter().copied(), fields, law)
    }

    /// Its derivative by t − ρ ṡ and p − ρ g at the nodes.
    pub fn derivative(&self, fields: NodeFields<'_>, law: IntegratedLaw) -> CellDerivative {
        let mut blocks = vec![[[[0.0; 3]; 3]; 9]; self.len()];
        visit(&self.rule, self.cells.iter().copied(), fields, law, |corners, shape, weight, projected| {
            let d = projected.derivative();
            for (a, b) in pairs() {
                let share = weight * shape[a] * shape[b];
                let block = &mut blocks[corners[a]][beside(a, b)];
                (0..3).for_each(|r| (0..3).for_each(|c| block[r][c] += share * d[r][c]));
            }
        });
        CellDerivative(blocks)
    }

    /// out −= D v, `[3k]`.
    pub fn subtract(&self, d: &CellDerivative, v: &[f64], out: &mut [f64]) {
        for (i, (blocks, neighbours)) in d.0.iter().zip(&self.neighbours).enumerate() {
            let mut sum = [0.0; 3];
            for (block, &j) in blocks.iter().zip(neighbours).filter(|(_, &j)| j != usize::MAX) {
                let v = &v[3 * j..3 * j + 3];
                sum.iter_mut().zip(block).for_each(|(s, d)| *s += d[0] * v[0] + d[1] * v[1] + d[2] * v[2]);
            }
            out[3 * i..3 * i + 3].iter_mut().zip(sum).for_each(|(o, s)| *o -= s);
        }
    }
}

/// Pairs of the corners of a cell.
fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..16).map(|k| (k / 4, k % 4))
}

/// Place of corner `b` of a cell among the neighbours of corner `a`.
fn beside(a: usize, b: usize) -> usize {
    let offset = |bit: usize| ((b >> bit) & 1) + 1 - ((a >> bit) & 1);
    offset(0) + 3 * offset(1)
}
