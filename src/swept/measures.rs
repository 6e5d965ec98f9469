//! Area, centroid and second moments of an upright section of a rail.

use super::{CrossSection, SectionElement};

/// Measures of an upright section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures {
    /// Area, m².
    pub area: f64,
    /// Height of the centroid over the lowest node, m.
    pub centroid: f64,
    /// Second moments of area about the lateral axis (bending vertically) and about the vertical axis (bending
    /// laterally) through the centroid, m⁴.
    pub inertia: [f64; 2],
}

impl CrossSection {
    /// Its measures, if it is upright: r is the height.
    pub fn measures(&self) -> Measures {
        let lowest = self.nodes.iter().map(|x| x[0]).fold(f64::INFINITY, f64::min);
        let places: Vec<([f64; 2], f64)> = self.elements.iter().flat_map(|e| self.weighed(e)).collect();
        let sum = |f: &dyn Fn(&[f64; 2]) -> f64| places.iter().map(|(x, weight)| weight * f(x)).sum::<f64>();
        let area = sum(&|_| 1.0);
        let middle = [0, 1].map(|c| sum(&|x| x[c]) / area);
        let inertia = [0, 1].map(|c| sum(&|x| (x[c] - middle[c]).powi(2)));
        Measures { area, centroid: middle[0] - lowest, inertia }
    }

    /// The integration points of an element, m, and the area of each, m².
    fn weighed<'a>(&'a self, element: &'a SectionElement) -> impl Iterator<Item = ([f64; 2], f64)> + 'a {
        element.kind.points().into_iter().map(move |shape| {
            let area = self.jacobian(element, &shape).1.determinant * shape.weight;
            let nodes = element.nodes.iter().zip(&shape.value);
            let place = nodes.fold([0.0; 2], |at, (&k, v)| [0, 1].map(|c| at[c] + v * self.nodes[k][c]));
            (place, area)
        })
    }
}
