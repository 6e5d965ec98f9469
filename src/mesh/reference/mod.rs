//! Reference cells: nodes, shape functions, rules of quadrature. Tetrahedron with the corners 0 and the unit points;
//! pyramid over [-1, 1]² with its apex at (0, 0, 1); wedge over the triangle of 0 and the unit points from -1 to 1;
//! hexahedron [-1, 1]³.

pub(crate) mod facet;
mod quadrature;
mod shapes;

use super::kind::{CellKind, MAX_NODES};
use quadrature::RawRule;
use std::sync::OnceLock;

/// Corners of the reference hexahedron.
pub const HEX_CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];
const TET_CORNERS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const PYRAMID_CORNERS: [[f64; 3]; 5] =
    [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const WEDGE_CORNERS: [[f64; 3]; 6] =
    [[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];

/// Shape functions of a cell at a point of its reference cell; the first `kind.nodes()` count.
#[derive(Debug, Clone, Copy)]
pub struct ShapeFunctions {
    /// Their values.
    pub values: [f64; MAX_NODES],
    /// Their derivatives with respect to the reference coordinates.
    pub gradients: [[f64; 3]; MAX_NODES],
}

/// A point of a rule of quadrature.
#[derive(Debug, Clone, Copy)]
pub struct QuadraturePoint {
    /// Reference coordinates.
    pub at: [f64; 3],
    /// Weight.
    pub weight: f64,
    /// Shape functions there.
    pub shape: ShapeFunctions,
}

/// Data of a kind of cell that are computed once.
struct Reference {
    nodes: Vec<[f64; 3]>,
    stiffness: Vec<QuadraturePoint>,
    mass: Vec<QuadraturePoint>,
    checked: Vec<ShapeFunctions>,
}

impl CellKind {
    fn reference(self) -> &'static Reference {
        static ALL: [OnceLock<Reference>; CellKind::ALL.len()] = [const { OnceLock::new() }; CellKind::ALL.len()];
        ALL[self as usize].get_or_init(|| self.make_reference())
    }

    fn make_reference(self) -> Reference {
        let mut nodes = self.reference_corners().to_vec();
        for around in self.between() {
            let mean = |c: usize| around.iter().map(|&k| nodes[k as usize][c]).sum::<f64>() / around.len() as f64;
            let node = [mean(0), mean(1), mean(2)];
            nodes.push(node);
        }
        let points = |rule: RawRule| -> Vec<QuadraturePoint> {
            rule.into_iter().map(|(at, weight)| QuadraturePoint { at, weight, shape: self.shape(at) }).collect()
        };
        let stiffness = points(quadrature::stiffness(self));
        let mut checked: Vec<ShapeFunctions> = nodes.iter().map(|&at| self.shape(at)).collect();
        checked.push(self.shape(self.centre()));
        // Nothing is hidden within the eight-node hexahedron, whose Jacobian is linear along every edge.
        if self != CellKind::Hex8 {
            checked.extend(stiffness.iter().map(|p| p.shape));
        }
        Reference { nodes, stiffness, mass: points(quadrature::mass(self)), checked }
    }

    fn reference_corners(self) -> &'static [[f64; 3]] {
        match self.linear() {
            CellKind::Tet4 => &TET_CORNERS,
            CellKind::Pyramid5 => &PYRAMID_CORNERS,
            CellKind::Wedge6 => &WEDGE_CORNERS,
            _ => &HEX_CORNERS,
        }
    }

    /// Nodes of the reference cell, `[nodes][3]`.
    pub(crate) fn reference_nodes(self) -> &'static [[f64; 3]] {
        &self.reference().nodes
    }

    /// Centre of the reference cell.
    pub fn centre(self) -> [f64; 3] {
        match self.linear() {
            CellKind::Tet4 => [0.25; 3],
            CellKind::Pyramid5 => [0.0, 0.0, 0.25],
            CellKind::Wedge6 => [1.0 / 3.0, 1.0 / 3.0, 0.0],
            _ => [0.0; 3],
        }
    }

    /// Shape functions at the reference point `at`.
    pub fn shape(self, at: [f64; 3]) -> ShapeFunctions {
        shapes::shape(self, at)
    }

    /// The rule for the stiffness: exact where the Jacobian is constant.
    pub(crate) fn stiffness_rule(self) -> &'static [QuadraturePoint] {
        &self.reference().stiffness
    }

    /// The rule for mass and volume: exact for products of two shape functions where the Jacobian is constant.
    pub(crate) fn mass_rule(self) -> &'static [QuadraturePoint] {
        &self.reference().mass
    }

    /// The rule for the volume: exact where the rule for the stiffness is and where edges are curved.
    pub(crate) fn volume_rule(self) -> &'static [QuadraturePoint] {
        match self {
            CellKind::Hex8 => self.stiffness_rule(),
            _ => self.mass_rule(),
        }
    }

    /// Points at which the Jacobian must be positive: at the nodes, first, and at the centre and points within.
    pub(super) fn checked_shapes(self) -> &'static [ShapeFunctions] {
        &self.reference().checked
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shape functions are 1 at their node and 0 at the others, add up to 1, and have the derivatives that
    /// differences show.
    #[test]
    fn shape_functions_interpolate() {
        for kind in CellKind::ALL {
            let nodes = kind.reference_nodes();
            let n = kind.nodes();
            assert_eq!(nodes.len(), n);
            for (i, &at) in nodes.iter().enumerate() {
                let shape = kind.shape(at);
                for a in 0..n {
                    let wanted = f64::from(u8::from(a == i));
                    assert!((shape.values[a] - wanted).abs() < 1e-14, "{kind:?}: {a} at node {i}: {}", shape.values[a]);
                }
            }
            for p in kind.mass_rule().iter().chain(kind.stiffness_rule()) {
                assert!((p.shape.values[..n].iter().sum::<f64>() - 1.0).abs() < 1e-14, "{kind:?}");
                for c in 0..3 {
                    let sum: f64 = p.shape.gradients[..n].iter().map(|g| g[c]).sum();
                    assert!(sum.abs() < 1e-13, "{kind:?}: gradients add up to {sum}");
                    let h = 1e-6;
                    let moved = |h: f64| {
                        let mut at = p.at;
                        at[c] += h;
                        kind.shape(at).values
                    };
                    let (up, down) = (moved(h), moved(-h));
                    for a in 0..n {
                        let difference = (up[a] - down[a]) / (2.0 * h);
                        let g = p.shape.gradients[a][c];
                        assert!((g - difference).abs() < 1e-8, "{kind:?}, function {a}: {g}, {difference}");
                    }
                }
            }
        }
    }

    /// Monomials over the reference cells, up to the degree that mass and stiffness of each ask for, against closed
    /// forms.
    #[test]
    fn rules_are_exact() {
        let factorial = |n: u32| (1..=n).product::<u32>() as f64;
        let line = |n: u32| if n.is_multiple_of(2) { 2.0 / f64::from(n + 1) } else { 0.0 };
        let exact = |kind: CellKind, [i, j, k]: [u32; 3]| match kind.linear() {
            CellKind::Tet4 => factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3),
            CellKind::Wedge6 => factorial(i) * factorial(j) / factorial(i + j + 2) * line(k),
            // ∫ ζ^k (1 − ζ)^(i + j + 2) dζ, a beta function.
            CellKind::Pyramid5 => line(i) * line(j) * factorial(k) * factorial(i + j + 2) / factorial(i + j + k + 3),
            _ => line(i) * line(j) * line(k),
        };
        for kind in CellKind::ALL {
            let second = kind != kind.linear();
            for (name, rule, degree) in [
                ("stiffness", kind.stiffness_rule(), if second { 2 } else { 0 }),
                ("mass", kind.mass_rule(), if second { 4 } else { 2 }),
            ] {
                for i in 0..=degree {
                    for j in 0..=degree - i {
                        for k in 0..=degree - i - j {
                            let at = |p: &QuadraturePoint| {
                                p.at[0].powi(i as i32) * p.at[1].powi(j as i32) * p.at[2].powi(k as i32)
                            };
                            let found: f64 = rule.iter().map(|p| p.weight * at(p)).sum();
                            let wanted = exact(kind, [i, j, k]);
                            assert!((found - wanted).abs() < 1e-14, "{kind:?}, {name}, {i} {j} {k}: {found}, {wanted}");
                        }
                    }
                }
                assert!(rule.iter().all(|p| p.weight > 0.0), "{kind:?}, {name}");
            }
        }
    }
}
