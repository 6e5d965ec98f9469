//! Triangles cut by rectangles, and integrals over what is left.

use crate::quadrature::triangle_6;

/// A point or a corner in the plane, m.
pub type Plane = [f64; 2];

/// Twice the area of a triangle, m²; positive if its corners go round counter-clockwise.
pub fn doubled_area([a, b, c]: [Plane; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Part of the triangle in the rectangle from `low` to `high`: a convex polygon, its corners in order; fewer than three
/// if there is nothing. (I. E. Sutherland, G. W. Hodgman, Comm. ACM 17 (1974) 32.)
pub fn clipped(triangle: [Plane; 3], low: Plane, high: Plane) -> Vec<Plane> {
    let mut polygon = triangle.to_vec();
    for (c, bound, sign) in [(0, low[0], 1.0), (0, high[0], -1.0), (1, low[1], 1.0), (1, high[1], -1.0)] {
        let inside = |p: &Plane| sign * (p[c] - bound) >= 0.0;
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, here) in polygon.iter().enumerate() {
            let before = &polygon[(i + polygon.len() - 1) % polygon.len()];
            if inside(here) != inside(before) {
                let t = (bound - before[c]) / (here[c] - before[c]);
                let mut cut = [before[0] + t * (here[0] - before[0]), before[1] + t * (here[1] - before[1])];
                cut[c] = bound;
                kept.push(cut);
            }
            if inside(here) {
                kept.push(*here);
            }
        }
        polygon = kept;
    }
    polygon
}

/// Integrals over polygons.
pub struct Rule(Vec<(Plane, f64)>);

impl Rule {
    /// One that is exact for polynomials of degree 4: bilinear functions times those of a face with straight edges.
    pub fn new() -> Self {
        Self(triangle_6())
    }

    /// Points of a convex polygon and their weights, m².
    pub fn points<'r>(&'r self, polygon: &'r [Plane]) -> impl Iterator<Item = (Plane, f64)> + 'r {
        (2..polygon.len()).flat_map(move |k| {
            let [a, b, c] = [polygon[0], polygon[k - 1], polygon[k]];
            let area = doubled_area([a, b, c]);
            let place = move |[s, t]: Plane| [0, 1].map(|i| a[i] + s * (b[i] - a[i]) + t * (c[i] - a[i]));
            self.0.iter().map(move |&(at, weight)| (place(at), area * weight))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫x^p y^q over a triangle is the sum of that over the squares it is cut by; a triangle beside a square leaves
    /// nothing.
    #[test]
    fn pieces_of_a_triangle_make_it_up() {
        let triangle = [[0.13, -0.21], [2.9, 0.4], [0.7, 2.3]];
        let rule = Rule::new();
        for (p, q) in [(0, 0), (1, 0), (0, 1), (2, 2), (3, 1)] {
            let of = |polygon: &[Plane]| rule.points(polygon).map(|([x, y], w)| w * x.powi(p) * y.powi(q)).sum::<f64>();
            let mut sum = 0.0;
            for i in -1..4 {
                for j in -1..4 {
                    let low = [f64::from(i), f64::from(j)];
                    sum += of(&clipped(triangle, low, low.map(|v| v + 1.0)));
                }
            }
            let whole = of(&triangle);
            assert!((sum / whole - 1.0).abs() < 1e-13, "x^{p} y^{q}: {sum} {whole}");
        }
        assert!(clipped(triangle, [5.0, 5.0], [6.0, 6.0]).len() < 3);
    }
}
