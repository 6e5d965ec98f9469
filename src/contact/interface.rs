//! Kinematics of the interface: creepages, and the upstream operator ∂x on its grid.

use super::law::LinearEdge;
use super::upwind_reconstruction::UpwindReconstruction;
use crate::grid::{ContactPatch, Interface};

/// How ∂w/∂x is taken at a node from the node itself and its upstream neighbours (those with smaller x).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stencil {
    /// (w_i − w_{i−1})/Δx, as in Kalker's CONTACT with V·δt = Δx. First order; on equal grids it gives CONTACT's
    /// figures.
    Upwind1,
    /// Three-point backward difference, second order where w is smooth.
    Upwind2,
    /// Second order inside the contact, and aware of its leading edge, where w is not smooth (`UpwindReconstruction`).
    /// At the first closed node the difference is exact for straight lines plus anything proportional to the gap
    /// upstream (which says where between the nodes the edge lies); at the second one, whose second upstream neighbour
    /// is outside, it is the two-point one. It removes most of the grid error of the others, which act as if the edge
    /// lay on a node.
    #[default]
    Edge,
}

/// Spacings over the smaller half axis of a contact that is [ruled by spin](ContactCreepage::is_ruled_by_spin). In
/// stick the slope of w along x is that of the rigid slip, which spin makes a straight line: the differences at the two
/// nodes behind the leading edge, of first order, are exact for a constant alone. The lateral force is too small by up
/// to about 2 h²/a² of itself, by where the edge lies between the nodes.
pub const SPIN_SPACINGS: f64 = 14.0;

/// Creepages of the undeformed bodies: rigid creep velocity divided by the rolling speed V.
///
/// ```
/// use railsqueal::contact::ContactCreepage;
///
/// let creepage = ContactCreepage { lateral: 0.003, spin: 0.5, ..ContactCreepage::default() };
/// // Spin turns the surface about the centre of the contact.
/// assert!((creepage.rigid(0.004, 0.0)[1] - 0.005).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactCreepage {
    /// Longitudinal creepage ξ, 1.
    pub longitudinal: f64,
    /// Lateral creepage η, 1.
    pub lateral: f64,
    /// Spin creepage φ, 1/m.
    pub spin: f64,
}

impl ContactCreepage {
    /// Rigid creep per unit speed at the point (x, y): (ξ − φ y, η + φ x), equations (1)–(2) of the paper without the
    /// elastic part.
    pub fn rigid(&self, x: f64, y: f64) -> [f64; 2] {
        [self.longitudinal - self.spin * y, self.lateral + self.spin * x]
    }

    /// Returns true if spin rules: the rigid slip that it makes at the edge of a contact with the half axes `half`, m,
    /// is more than that of the other creepages.
    ///
    /// ```
    /// use railsqueal::contact::ContactCreepage;
    ///
    /// let creepage = ContactCreepage { lateral: 1e-3, spin: 0.5, ..ContactCreepage::default() };
    /// assert!(creepage.is_ruled_by_spin([5e-3, 5e-3]));
    /// ```
    pub fn is_ruled_by_spin(&self, half: [f64; 2]) -> bool {
        self.spin.abs() * (half[0] * half[1]).sqrt() > self.longitudinal.hypot(self.lateral)
    }

    /// The three creepages times `factor`.
    pub fn scaled(&self, factor: f64) -> ContactCreepage {
        ContactCreepage {
            longitudinal: self.longitudinal * factor,
            lateral: self.lateral * factor,
            spin: self.spin * factor,
        }
    }
}

/// Rolling of one contact patch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PatchKinematics {
    /// Rolling speed V > 0, m/s.
    pub speed: f64,
    /// Creepages ξ, η (1), φ (1/m), spin about the origin of the patch.
    pub creepage: ContactCreepage,
}

impl PatchKinematics {
    /// The rolling of an interface of one patch.
    pub fn one(speed: f64, creepage: ContactCreepage) -> Vec<Self> {
        vec![Self { speed, creepage }]
    }
}

impl Interface {
    /// Rigid creep of node `i` per unit speed of its patch, 1; the patches roll as `kinematics` says, `[patches]`.
    pub(super) fn rigid(&self, kinematics: &[PatchKinematics], i: usize) -> [f64; 2] {
        let [x, y] = self.point(i);
        kinematics[self.patch_of(i)].creepage.rigid(x, y)
    }

    /// How V ∂w/∂x at the closed nodes `closed` (ascending) follows the gaps ahead of the leading edge, with the
    /// operator of [`Stencil::Edge`] for the deformed `gap` (m, `[n]`), the displacement `w` (m, `[n]`) and the speed
    /// V of each patch.
    pub(super) fn edges(
        &self,
        closed: &[usize],
        gap: &[f64],
        w: &[[f64; 2]],
        kinematics: &[PatchKinematics],
    ) -> Vec<LinearEdge> {
        let mut inside = vec![false; self.len()];
        closed.iter().for_each(|&i| inside[i] = true);
        let edge = |(at, &i): (usize, &usize)| {
            let (ContactPatch { x, .. }, ix, _) = self.place(i);
            if ix < 2 {
                return None;
            }
            let speed = kinematics[self.patch_of(i)].speed;
            let h = [x[ix] - x[ix - 1], x[ix] - x[ix - 2]];
            let gaps = [gap[i - 1], gap[i - 2]];
            let course = UpwindReconstruction::new(h, [inside[i], inside[i - 1], inside[i - 2]], || gaps);
            let by_gap = course.derivative_by_gap(h, gaps)?;
            let of = |k: usize| [0, 1].map(|c| speed * (0..3).map(|j| by_gap[k][j] * w[i - j][c]).sum::<f64>());
            Some(LinearEdge { at, gaps: [(i - 1, of(0)), (i - 2, of(1))] })
        };
        closed.iter().enumerate().filter_map(edge).collect()
    }

    /// The operator ∂/∂x of `stencil`. [`Stencil::Edge`] needs the contact it is for: the gap of the deformed bodies
    /// (m, `[n]`) and which nodes are closed (`[n]`); where it is not given there is no edge, and the operator is
    /// that of [`Stencil::Upwind2`].
    ///
    /// At the leading grid column, which has nothing upstream, the derivative is that of the cell behind it (zero
    /// second difference). A node there is always open, since a contact that reaches the border is refused, so that
    /// its value serves the written creep alone. The second column has the two-point difference.
    pub fn upstream(&self, stencil: Stencil, contact: Option<(&[f64], &[bool])>) -> Upstream {
        let row = |x: &[f64], i: usize, ix: usize| -> [(usize, f64); 3] {
            if self.are_points() {
                return [(i, 0.0); 3];
            }
            if ix == 0 {
                let d = 1.0 / (x[1] - x[0]);
                return [(i, -d), (i + 1, d), (i, 0.0)];
            }
            let h1 = x[ix] - x[ix - 1];
            let two = [(i, 1.0 / h1), (i - 1, -1.0 / h1), (i, 0.0)];
            if stencil == Stencil::Upwind1 || ix < 2 {
                return two;
            }
            let h = [h1, x[ix] - x[ix - 2]];
            let course = match contact {
                Some((gap, closed)) if stencil == Stencil::Edge => {
                    UpwindReconstruction::new(h, [closed[i], closed[i - 1], closed[i - 2]], || [gap[i - 1], gap[i - 2]])
                }
                _ => UpwindReconstruction::Parabola,
            };
            let [a, b, c] = course.derivative(h);
            [(i, a), (i - 1, b), (i - 2, c)]
        };
        let of = |p: &ContactPatch| p.nodes().map(|i| row(&p.x, i, p.indices(i).0)).collect::<Vec<_>>();
        Upstream { rows: self.patches.iter().flat_map(of).collect() }
    }

    /// The upstream operator of the contact that holds the given stresses (tx, ty, p), Pa, `[3n]`; `deformed` is the
    /// gap of the deformed bodies at a node, m.
    pub(super) fn edge_upstream(&self, stencil: Stencil, stress: &[f64], deformed: impl Fn(usize) -> f64) -> Upstream {
        let closed: Vec<bool> = (0..self.len()).map(|i| stress[3 * i + 2] > 0.0).collect();
        let mut gap = vec![0.0; self.len()];
        // Only the two nodes ahead of an edge are asked for their gap.
        for p in &self.patches {
            let (first, nx) = (p.first, p.x.len());
            let ahead = |i: usize| !closed[i] && (1..=2).any(|k| (i - first) % nx + k < nx && closed[i + k]);
            p.nodes().filter(|&i| ahead(i)).for_each(|i| gap[i] = deformed(i));
        }
        self.upstream(stencil, Some((&gap, &closed)))
    }
}

/// The upstream difference operator ∂/∂x on the nodes of an interface.
#[derive(Debug, Clone, PartialEq)]
pub struct Upstream {
    /// For each node three pairs (node, coefficient in 1/m), the first being the node itself; pairs not used have the
    /// coefficient 0. `[n]`.
    pub rows: Vec<[(usize, f64); 3]>,
}

impl Upstream {
    /// ∂v/∂x at node `i` of one component of a nodal field.
    pub fn derivative(&self, i: usize, v: impl Fn(usize) -> f64) -> f64 {
        self.rows[i].iter().map(|&(j, d)| d * v(j)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graded() -> Interface {
        let x = vec![-2.0, -1.2, -0.5, 0.0, 0.3, 1.0];
        let y = vec![-1.0, 0.1, 0.7];
        let gap = vec![0.0; 18];
        Interface::new(x, y, gap).unwrap()
    }

    #[test]
    fn upstream_operators_are_exact_for_their_degree_and_look_upstream() {
        let s = graded();
        for st in [Stencil::Upwind1, Stencil::Upwind2, Stencil::Edge] {
            let d = s.upstream(st, None);
            for i in 0..s.len() {
                let (ContactPatch { x, .. }, ix, _) = s.place(i);
                let got = d.derivative(i, |j| 3.0 - 2.0 * s.point(j)[0]);
                assert!((got + 2.0).abs() < 1e-12, "node {i} {st:?}: {got}");
                if ix >= 2 && st != Stencil::Upwind1 {
                    let got = d.derivative(i, |j| s.point(j)[0].powi(2));
                    assert!((got - 2.0 * x[ix]).abs() < 1e-12, "node {i} {st:?}: {got}");
                }
                if ix >= 1 {
                    assert!(d.rows[i].iter().all(|&(j, _)| s.point(j)[0] <= x[ix]), "node {i} looks downstream");
                }
            }
        }
    }

    #[test]
    fn edge_operator_does_not_see_the_departure_ahead_of_the_leading_edge() {
        let x: Vec<f64> = vec![-2.0, -1.5, -1.1, -0.6, -0.2, 0.4, 1.0];
        let s = Interface::new(x.clone(), vec![0.0, 1.0, 2.0], vec![0.0; 21]).unwrap();
        for edge in [-0.65, -0.75, -0.9, -1.05] {
            let ahead = |j: usize| (edge - s.point(j)[0]).max(0.0).powf(1.5);
            let gap: Vec<f64> = (0..21).map(|j| 0.3 * ahead(j)).collect();
            let closed: Vec<bool> = (0..21).map(|j| s.point(j)[0] > edge).collect();
            let d = s.upstream(Stencil::Edge, Some((&gap, &closed)));
            for i in (0..21).filter(|&i| closed[i]) {
                let got = d.derivative(i, |j| 1.0 + 4.0 * s.point(j)[0] - 7.0 * ahead(j));
                assert!((got - 4.0).abs() < 1e-11, "edge {edge}, node {i}: {got}");
            }
        }
    }

    #[test]
    fn rigid_creep_has_the_signs_of_the_formulation() {
        let c = ContactCreepage { longitudinal: 1.0, lateral: 10.0, spin: 2.0 };
        assert_eq!(c.rigid(0.5, 0.25), [1.0 - 2.0 * 0.25, 10.0 + 2.0 * 0.5]);
    }
}
