//! Shape functions and integration points of the elements of a section.

use crate::quadrature::{triangle_7, GAUSS_3};

/// Kinds of elements; nodes are numbered as Gmsh does: corners, then middles of the edges, then the centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SectionCell {
    /// Triangle of 6 nodes.
    Tri6,
    /// Quadrilateral of 8 nodes.
    Quad8,
    /// Quadrilateral of 9 nodes.
    Quad9,
}

/// Values and derivatives of the shape functions at a point of the reference element.
#[derive(Debug, Clone)]
pub struct SectionShape {
    /// Weight of the integration point on the reference element.
    pub weight: f64,
    /// Values, `[nodes]`.
    pub value: Vec<f64>,
    /// Derivatives along both reference coordinates, `[nodes]`.
    pub slope: Vec<[f64; 2]>,
}

/// Corners and middles of the edges of the quadrilateral, its centre last.
const SQUARE: [[f64; 2]; 9] =
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, 0.0]];

impl SectionCell {
    /// Number of nodes.
    pub fn nodes(self) -> usize {
        match self {
            SectionCell::Tri6 => 6,
            SectionCell::Quad8 => 8,
            SectionCell::Quad9 => 9,
        }
    }

    /// The edges: first corner, last corner, middle.
    pub fn edges(self) -> &'static [[usize; 3]] {
        match self {
            SectionCell::Tri6 => &[[0, 1, 3], [1, 2, 4], [2, 0, 5]],
            SectionCell::Quad8 | SectionCell::Quad9 => &[[0, 1, 4], [1, 2, 5], [2, 3, 6], [3, 0, 7]],
        }
    }

    /// Middle of the reference element.
    pub fn middle(self) -> [f64; 2] {
        match self {
            SectionCell::Tri6 => [1.0 / 3.0; 2],
            SectionCell::Quad8 | SectionCell::Quad9 => [0.0; 2],
        }
    }

    /// Point of the reference element that is `at`, or that bounds it there.
    pub fn inside(self, at: [f64; 2]) -> [f64; 2] {
        match self {
            SectionCell::Tri6 => {
                let [a, b] = at.map(|x| x.max(0.0));
                let beyond = (0.5 * (a + b - 1.0)).max(0.0);
                let [a, b] = [a - beyond, b - beyond];
                [(a + b.min(0.0)).clamp(0.0, 1.0), (b + a.min(0.0)).clamp(0.0, 1.0)]
            }
            SectionCell::Quad8 | SectionCell::Quad9 => at.map(|x| x.clamp(-1.0, 1.0)),
        }
    }

    /// Shape functions at the integration points.
    pub fn points(self) -> Vec<SectionShape> {
        match self {
            SectionCell::Tri6 => triangle_7().into_iter().map(|(at, weight)| self.shape(at, weight)).collect(),
            SectionCell::Quad8 | SectionCell::Quad9 => GAUSS_3
                .iter()
                .flat_map(|&(a, wa)| GAUSS_3.iter().map(move |&(b, wb)| ([a, b], wa * wb)))
                .map(|(at, weight)| self.shape(at, weight))
                .collect(),
        }
    }

    /// Shape functions at a point of the reference element: [−1, 1]², or the triangle (0, 0), (1, 0), (0, 1).
    pub fn shape(self, [a, b]: [f64; 2], weight: f64) -> SectionShape {
        match self {
            SectionCell::Tri6 => {
                let l = [1.0 - a - b, a, b];
                let d = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
                let mut shape = SectionShape { weight, value: Vec::new(), slope: Vec::new() };
                for i in 0..3 {
                    shape.value.push(l[i] * (2.0 * l[i] - 1.0));
                    shape.slope.push(d[i].map(|d| d * (4.0 * l[i] - 1.0)));
                }
                for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                    shape.value.push(4.0 * l[i] * l[j]);
                    shape.slope.push([0, 1].map(|k| 4.0 * (d[i][k] * l[j] + l[i] * d[j][k])));
                }
                shape
            }
            SectionCell::Quad9 => {
                let nodes = SQUARE.iter().map(|&[p, q]| (quadratic(p, a), quadratic(q, b)));
                let (value, slope) = nodes.map(|((f, df), (g, dg))| (f * g, [df * g, f * dg])).unzip();
                SectionShape { weight, value, slope }
            }
            SectionCell::Quad8 => {
                let (value, slope) = SQUARE[..8].iter().map(|&[p, q]| serendipity([p, q], [a, b])).unzip();
                SectionShape { weight, value, slope }
            }
        }
    }
}

/// Quadratic polynomial that is 1 at the node `p` of −1, 0, 1 and 0 at the others, and its derivative, at `x`.
fn quadratic(p: f64, x: f64) -> (f64, f64) {
    match p {
        0.0 => (1.0 - x * x, -2.0 * x),
        p => (0.5 * x * (x + p), x + 0.5 * p),
    }
}

/// Shape function of the node (p, q) of the quadrilateral of 8 nodes, and its derivatives.
fn serendipity([p, q]: [f64; 2], [a, b]: [f64; 2]) -> (f64, [f64; 2]) {
    if p == 0.0 {
        return (0.5 * (1.0 - a * a) * (1.0 + q * b), [-a * (1.0 + q * b), 0.5 * q * (1.0 - a * a)]);
    }
    if q == 0.0 {
        return (0.5 * (1.0 - b * b) * (1.0 + p * a), [0.5 * p * (1.0 - b * b), -b * (1.0 + p * a)]);
    }
    let (f, g) = (1.0 + p * a, 1.0 + q * b);
    let h = p * a + q * b - 1.0;
    (0.25 * f * g * h, [0.25 * p * g * (h + f), 0.25 * q * f * (h + g)])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each kind has all quadratic polynomials, and integrates those of degree 5 (less in x alone than a square can).
    #[test]
    fn quadratics_are_interpolated_and_integrated() {
        for kind in [SectionCell::Tri6, SectionCell::Quad8, SectionCell::Quad9] {
            let corners: Vec<[f64; 2]> = match kind {
                SectionCell::Tri6 => vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]],
                _ => SQUARE[..kind.nodes()].to_vec(),
            };
            let f = |[a, b]: [f64; 2]| 1.0 + 2.0 * a - b + 0.5 * a * a - 3.0 * a * b + 0.25 * b * b;
            let df = |[a, b]: [f64; 2]| [2.0 + a - 3.0 * b, -1.0 - 3.0 * a + 0.5 * b];
            let at = [0.21, 0.37];
            let shape = kind.shape(at, 1.0);
            let value: f64 = shape.value.iter().zip(&corners).map(|(n, &x)| n * f(x)).sum();
            assert!((value - f(at)).abs() < 1e-14, "{kind:?}");
            for k in 0..2 {
                let slope: f64 = shape.slope.iter().zip(&corners).map(|(d, &x)| d[k] * f(x)).sum();
                assert!((slope - df(at)[k]).abs() < 1e-13, "{kind:?} {k}");
            }
            let integral: f64 = kind
                .points()
                .iter()
                .map(|s| {
                    let x = [0, 1].map(|k| s.value.iter().zip(&corners).map(|(n, c)| n * c[k]).sum::<f64>());
                    s.weight * (x[0].powi(4) + x[0].powi(3) * x[1].powi(2))
                })
                .sum();
            // ∫ a⁴ + a³b²: 4/5 on the square, 1/30 + 2!3!/7! on the triangle.
            let wanted = if kind == SectionCell::Tri6 { 1.0 / 30.0 + 12.0 / 5040.0 } else { 0.8 };
            assert!((integral - wanted).abs() < 1e-14, "{kind:?} {integral}");
        }
    }
}
