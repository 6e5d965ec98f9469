//! The interface S_c: a rectilinear grid of nodes with undeformed gap and nodal areas, and the upstream operator ∂x on it.

use faer::{Mat, MatRef};

use crate::{Error, Result};

/// How ∂w/∂x is taken at a node from the node itself and its upstream neighbours (those with smaller x).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stencil {
    /// (w_i − w_{i−1})/Δx, as in Kalker's CONTACT with V·δt = Δx. First order.
    #[default]
    Upwind1,
    /// Three-point backward difference, second order where w is smooth; falls back to [`Stencil::Upwind1`] at the second
    /// grid column.
    Upwind2,
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
        Ok(Self { x, y, gap, weight })
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

    /// Coefficients of ∂/∂x at node `i`, 1/m: up to three pairs (node, coefficient), the first being `i` itself; pairs not
    /// used have coefficient 0 and node `i`. At the leading grid column, which has nothing upstream, the derivative is the
    /// one of the cell behind it (zero second difference): a node there can only be open, since a contact that reaches the
    /// border is refused, and its value serves the written creep alone.
    pub fn upstream(&self, i: usize, stencil: Stencil) -> [(usize, f64); 3] {
        let nx = self.x.len();
        let ix = i % nx;
        if ix == 0 {
            let d = 1.0 / (self.x[1] - self.x[0]);
            return [(i, -d), (i + 1, d), (i, 0.0)];
        }
        let h1 = self.x[ix] - self.x[ix - 1];
        match stencil {
            Stencil::Upwind2 if ix >= 2 => {
                // Derivative at x_i of the parabola through x_i, x_{i-1}, x_{i-2}.
                let h2 = self.x[ix] - self.x[ix - 2];
                let a1 = -h2 / (h1 * (h2 - h1));
                let a2 = h1 / (h2 * (h2 - h1));
                [(i, -a1 - a2), (i - 1, a1), (i - 2, a2)]
            }
            _ => [(i, 1.0 / h1), (i - 1, -1.0 / h1), (i, 0.0)],
        }
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
        for i in 0..s.len() {
            let apply = |st, f: &dyn Fn(f64) -> f64| -> f64 {
                s.upstream(i, st).iter().map(|&(j, d)| d * f(s.point(j)[0])).sum()
            };
            for st in [Stencil::Upwind1, Stencil::Upwind2] {
                let got = apply(st, &|x| 3.0 - 2.0 * x);
                assert!((got + 2.0).abs() < 1e-12, "node {i} {st:?}: {got}");
            }
            let ix = i % s.x.len();
            if ix >= 2 {
                let got = apply(Stencil::Upwind2, &|x| x * x);
                assert!((got - 2.0 * s.x[ix]).abs() < 1e-12, "node {i}: {got}");
            }
            if ix >= 1 {
                let seen = s.upstream(i, Stencil::Upwind2);
                assert!(seen.iter().all(|&(j, _)| s.point(j)[0] <= s.x[ix]), "node {i} looks downstream: {seen:?}");
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
