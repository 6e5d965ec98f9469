//! The interface S_c: a rectilinear grid of nodes with undeformed gap and nodal areas, and the upstream operator ∂x on it.

use faer::{Mat, MatRef};

use crate::{Error, Result};

/// How ∂w/∂x is taken at a node from the node itself and its upstream neighbours (those with smaller x).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stencil {
    /// (w_i − w_{i−1})/Δx, as in Kalker's CONTACT with V·δt = Δx. First order; on equal grids it gives CONTACT's figures.
    Upwind1,
    /// Three-point backward difference, second order where w is smooth.
    Upwind2,
    /// Second order inside the contact, and aware of its leading edge, where w is not smooth: ahead of the edge x_e both
    /// the gap and the departure of w from its course inside grow like (x_e − x)^{3/2}. At the first closed node the
    /// difference is therefore exact for straight lines plus anything proportional to the gap upstream (which says where
    /// between the nodes the edge lies); at the second one, whose second upstream neighbour is outside, it is the two-point
    /// one. It removes most of the grid error of the others, which act as if the edge lay on a node.
    #[default]
    Edge,
}

/// Creepages of the undeformed bodies: rigid creep velocity divided by the rolling speed V.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Creepage {
    /// Longitudinal creepage ξ, 1.
    pub longitudinal: f64,
    /// Lateral creepage η, 1.
    pub lateral: f64,
    /// Spin creepage φ, 1/m.
    pub spin: f64,
}

impl Creepage {
    /// Rigid creep per unit speed at the point (x, y): (ξ − φ y, η + φ x), equations (1)–(2) of the paper without the
    /// elastic part.
    pub fn rigid(&self, x: f64, y: f64) -> [f64; 2] {
        [self.longitudinal - self.spin * y, self.lateral + self.spin * x]
    }

    /// The three creepages times `factor`.
    pub fn scaled(&self, factor: f64) -> Creepage {
        Creepage { longitudinal: self.longitudinal * factor, lateral: self.lateral * factor, spin: self.spin * factor }
    }
}

/// The potential contact area: a rectilinear grid. Node `(ix, iy)` has index `ix + nx*iy`. Contact rows of matrices are
/// interleaved `3*i + c` over the nodes with c = (x, y, n).
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// Longitudinal node positions, m, ascending, `[nx]`. Smaller x is upstream (ahead of the contact).
    pub x: Vec<f64>,
    /// Lateral node positions, m, ascending, `[ny]`.
    pub y: Vec<f64>,
    /// Gap of the undeformed bodies at zero approach, m, `[nx*ny]`.
    pub gap: Vec<f64>,
    /// Tangential displacement difference (x, y) that does not come from the reactions, m, `[nx*ny]`: none between bodies as
    /// they are. As the gap does for the normal direction, it takes up what an approximate influence matrix leaves out.
    pub shift: Vec<[f64; 2]>,
    /// Nodal areas (integral of the shape function: nodal quadrature), m², `[nx*ny]`. Pressure = nodal force / weight.
    pub weight: Vec<f64>,
}

impl Interface {
    /// An interface with the areas of bilinear shape functions on the grid. `gap` is `[nx*ny]` in m.
    pub fn new(x: Vec<f64>, y: Vec<f64>, gap: Vec<f64>) -> Result<Self> {
        let wx = nodal_lengths(&x, "x")?;
        let wy = nodal_lengths(&y, "y")?;
        if gap.len() != x.len() * y.len() {
            return Err(Error::Defect(format!(
                "interface: {} gaps for a grid of {} x {} nodes",
                gap.len(),
                x.len(),
                y.len()
            )));
        }
        if let Some(i) = gap.iter().position(|g| !g.is_finite()) {
            return Err(Error::Defect(format!("interface: the gap at node {i} is {}", gap[i])));
        }
        let weight = wy.iter().flat_map(|b| wx.iter().map(move |a| a * b)).collect();
        let shift = vec![[0.0; 2]; gap.len()];
        Ok(Self { x, y, gap, shift, weight })
    }

    /// A uniform grid of `nx` × `ny` nodes over [−half_length, half_length] × [−half_width, half_width] (m) whose gap is
    /// that of two bodies with relative curvatures `curvature_x`, `curvature_y` (1/m): g0 = (κx x² + κy y²)/2.
    pub fn paraboloid(nx: usize, ny: usize, half: [f64; 2], curvature: [f64; 2]) -> Result<Self> {
        let line = |n: usize, h: f64| -> Vec<f64> {
            (0..n).map(|i| h * (2.0 * i as f64 / (n.max(2) - 1) as f64 - 1.0)).collect()
        };
        let (x, y) = (line(nx, half[0]), line(ny, half[1]));
        let gap =
            y.iter().flat_map(|b| x.iter().map(move |a| 0.5 * (curvature[0] * a * a + curvature[1] * b * b))).collect();
        Self::new(x, y, gap)
    }

    /// Number of nodes, nx·ny.
    pub fn len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    /// True for a grid without nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position (x, y) of node `i`, m.
    pub fn point(&self, i: usize) -> [f64; 2] {
        let nx = self.x.len();
        [self.x[i % nx], self.y[i / nx]]
    }

    /// True when node `i` lies on the border of the grid.
    pub fn on_border(&self, i: usize) -> bool {
        let (nx, ny) = (self.x.len(), self.y.len());
        let (ix, iy) = (i % nx, i / nx);
        ix == 0 || iy == 0 || ix + 1 == nx || iy + 1 == ny
    }

    /// The operator ∂/∂x of `stencil`. [`Stencil::Edge`] needs the contact it is for: the gap of the deformed bodies (m, `[n]`)
    /// and which nodes are closed (`[n]`); where it is not given there is no edge, and the operator is that of
    /// [`Stencil::Upwind2`].
    ///
    /// At the leading grid column, which has nothing upstream, the derivative is that of the cell behind it (zero second
    /// difference). A node there is always open, since a contact that reaches the border is refused, so that its value
    /// serves the written creep alone. The second column has the two-point difference.
    pub fn upstream(&self, stencil: Stencil, contact: Option<(&[f64], &[bool])>) -> Upstream {
        let nx = self.x.len();
        let row = |i: usize| -> [(usize, f64); 3] {
            let ix = i % nx;
            if ix == 0 {
                let d = 1.0 / (self.x[1] - self.x[0]);
                return [(i, -d), (i + 1, d), (i, 0.0)];
            }
            let h1 = self.x[ix] - self.x[ix - 1];
            let two = [(i, 1.0 / h1), (i - 1, -1.0 / h1), (i, 0.0)];
            if stencil == Stencil::Upwind1 || ix < 2 {
                return two;
            }
            // A three-point stencil assumes a ratio b of the departures e from a straight line at the two upstream nodes:
            // e_{i−2} = b e_{i−1}. For a parabola they go with the square of the distance.
            let h2 = self.x[ix] - self.x[ix - 2];
            let smooth = (h2 / h1).powi(2);
            let b = match contact {
                Some((gap, closed)) if stencil == Stencil::Edge => match [closed[i], closed[i - 1], closed[i - 2]] {
                    [true, true, true] => smooth,
                    [true, false, false] if gap[i - 1] > 0.0 => {
                        // Less than this no edge between the nodes would give; a corner of the surface might.
                        (gap[i - 2] / gap[i - 1]).max((1.0 + 1.2 * (h2 - h1) / h1).powf(1.2))
                    }
                    _ => return two,
                },
                _ => smooth,
            };
            let scale = 1.0 / (b * h1 - h2);
            [(i, (b - 1.0) * scale), (i - 1, -b * scale), (i - 2, scale)]
        };
        Upstream { rows: (0..self.len()).map(row).collect() }
    }

    /// The upstream operator of the contact that holds the given stresses (tx, ty, p), Pa, `[3n]`, at the given approach, m,
    /// with the influence matrix `w`, `[3n, 3n]`.
    pub(super) fn deformed_upstream(
        &self,
        stencil: Stencil,
        w: MatRef<'_, f64>,
        stress: &[f64],
        approach: f64,
    ) -> Upstream {
        let force: Vec<f64> =
            stress.chunks_exact(3).zip(&self.weight).flat_map(|(t, w)| t.iter().map(move |v| v * w)).collect();
        let sunk = |i: usize| w.col(3 * i + 2).iter().zip(&force).map(|(c, f)| c * f).sum::<f64>();
        self.edge_upstream(stencil, stress, |i| self.gap[i] - approach + sunk(i))
    }

    /// The upstream operator of the contact that holds the given stresses (tx, ty, p), Pa, `[3n]`; `deformed` is the gap of the
    /// deformed bodies at a node, m.
    pub(super) fn edge_upstream(&self, stencil: Stencil, stress: &[f64], deformed: impl Fn(usize) -> f64) -> Upstream {
        let nx = self.x.len();
        let closed: Vec<bool> = (0..self.len()).map(|i| stress[3 * i + 2] > 0.0).collect();
        let mut gap = vec![0.0; self.len()];
        // Only the two nodes ahead of an edge are asked for their gap.
        for i in (0..self.len()).filter(|&i| !closed[i] && (1..=2).any(|k| i % nx + k < nx && closed[i + k])) {
            gap[i] = deformed(i);
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
    pub fn at(&self, i: usize, v: impl Fn(usize) -> f64) -> f64 {
        self.rows[i].iter().map(|&(j, d)| d * v(j)).sum()
    }
}

/// Half the distances to the neighbours: lengths of the dual cells of `x`, `[x.len()]`.
fn nodal_lengths(x: &[f64], name: &str) -> Result<Vec<f64>> {
    if x.len() < 3 {
        return Err(Error::Job(format!(
            "contact.patch: the contact grid has {} nodes along {name}, at least 3 are needed; \
             make the patch larger or the elements at the contact smaller",
            x.len()
        )));
    }
    if x.iter().any(|v| !v.is_finite()) || x.windows(2).any(|w| w[1] <= w[0]) {
        return Err(Error::Defect(format!("interface: grid positions along {name} do not ascend")));
    }
    let n = x.len();
    Ok((0..n).map(|i| 0.5 * (x[(i + 1).min(n - 1)] - x[i.saturating_sub(1)])).collect())
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
        let mixed = (i % 3 == 2) != (j % 3 == 2);
        lower[(i, j)] + if mixed { -upper[(i, j)] } else { upper[(i, j)] }
    }))
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
                let ix = i % s.x.len();
                let got = d.at(i, |j| 3.0 - 2.0 * s.point(j)[0]);
                assert!((got + 2.0).abs() < 1e-12, "node {i} {st:?}: {got}");
                if ix >= 2 && st != Stencil::Upwind1 {
                    let got = d.at(i, |j| s.point(j)[0].powi(2));
                    assert!((got - 2.0 * s.x[ix]).abs() < 1e-12, "node {i} {st:?}: {got}");
                }
                if ix >= 1 {
                    assert!(d.rows[i].iter().all(|&(j, _)| s.point(j)[0] <= s.x[ix]), "node {i} looks downstream");
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
                let got = d.at(i, |j| 1.0 + 4.0 * s.point(j)[0] - 7.0 * ahead(j));
                assert!((got - 4.0).abs() < 1e-11, "edge {edge}, node {i}: {got}");
            }
        }
    }

    #[test]
    fn weights_add_up_to_the_area() {
        let s = graded();
        let area: f64 = s.weight.iter().sum();
        assert!((area - 3.0 * 1.7).abs() < 1e-12, "{area}");
    }

    #[test]
    fn rigid_creep_has_the_signs_of_the_formulation() {
        let c = Creepage { longitudinal: 1.0, lateral: 10.0, spin: 2.0 };
        assert_eq!(c.rigid(0.5, 0.25), [1.0 - 2.0 * 0.25, 10.0 + 2.0 * 0.5]);
    }

    #[test]
    fn a_grid_that_does_not_ascend_is_refused() {
        assert!(Interface::new(vec![0.0, 1.0, 1.0], vec![0.0, 1.0, 2.0], vec![0.0; 9]).is_err());
        assert!(Interface::new(vec![0.0, 1.0], vec![0.0, 1.0, 2.0], vec![0.0; 6]).is_err());
    }
}
