//! How a body lies in its frame: extent, centre of mass, and the coordinate axis that it is revolved about, if it is.

use super::{quality, Mesh};

/// Moments of inertia about the two other axes differ by less, relatively, of a body of revolution; and so much
/// smaller are its products of inertia.
const ROUND: f64 = 5e-3;

/// How a body lies in its frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Attitude {
    /// Smallest and largest coordinates, m.
    pub low: [f64; 3],
    /// Largest coordinates, m.
    pub high: [f64; 3],
    /// Volume, m³.
    pub volume: f64,
    /// Centre of mass of the homogeneous body, m.
    pub centre: [f64; 3],
    /// The coordinate axis (0 for x) parallel to which an axis of revolution passes through the centre of mass, as
    /// the moments of inertia show it.
    pub revolved: Option<usize>,
}

impl Attitude {
    /// Attitude of a mesh, by quadrature over its cells.
    pub fn from_mesh(mesh: &Mesh) -> Attitude {
        let fold = |start: f64, f: fn(f64, f64) -> f64| {
            mesh.nodes.iter().fold([start; 3], |m, x| [f(m[0], x[0]), f(m[1], x[1]), f(m[2], x[2])])
        };
        let (low, high) = (fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max));
        // About a point of the body, so that nothing cancels of one that lies far away.
        let middle = [0, 1, 2].map(|c| 0.5 * (low[c] + high[c]));
        let (mut volume, mut first, mut second) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
        for cell in mesh.cells.iter() {
            let x = cell.places(&mesh.nodes);
            for point in cell.kind.volume_rule() {
                let weight = point.weight * quality::determinant(&quality::jacobian(&x, &point.shape));
                let mut r = [0.0; 3];
                for (node, n) in x.iter().zip(point.shape.values) {
                    (0..3).for_each(|c| r[c] += n * (node[c] - middle[c]));
                }
                volume += weight;
                for i in 0..3 {
                    first[i] += weight * r[i];
                    (0..3).for_each(|j| second[i][j] += weight * r[i] * r[j]);
                }
            }
        }
        let mean = first.map(|f| f / volume);
        let spread = |i: usize, j: usize| second[i][j] / volume - mean[i] * mean[j];
        // Along the axis of revolution the spread may be any; across it it is the same in all directions.
        let round = |axis: usize| {
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            let across = 0.5 * (spread(i, i) + spread(j, j));
            let small = ROUND * (across + spread(axis, axis));
            (spread(i, i) - spread(j, j)).abs() < ROUND * across
                && [spread(i, j), spread(axis, i), spread(axis, j)].iter().all(|p| p.abs() < small)
        };
        // A cube has three such axes, and none.
        let axes: Vec<usize> = (0..3).filter(|&a| round(a)).collect();
        let revolved = if axes.len() == 1 { Some(axes[0]) } else { None };
        Attitude { low, high, volume, centre: [0, 1, 2].map(|c| middle[c] + mean[c]), revolved }
    }

    /// Distance of the axis of revolution from the origin, m, where there is one.
    pub fn axis_distance(&self) -> Option<f64> {
        self.revolved.map(|axis| self.centre[(axis + 1) % 3].hypot(self.centre[(axis + 2) % 3]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cylinder::{build, CylinderSpec};

    fn ring() -> Mesh {
        let spec = CylinderSpec {
            inner_radius: 0.1,
            outer_radius: 0.46,
            thickness: 0.1,
            crown_radius: None,
            contact_offset: 0.0,
            element_size: 0.04,
            growth: 1.3,
            max_element_size: None,
            patch_half_length: 0.0,
            patch_half_width: 0.0,
        };
        build(&spec).expect("a ring")
    }

    /// A ring below the plane z = 0 has its axle along y, at its radius from the origin; turned and moved it has it
    /// elsewhere; a block has none.
    #[test]
    fn the_axis_of_a_ring_is_found() {
        let mut mesh = ring();
        let found = Attitude::from_mesh(&mesh);
        assert_eq!(found.revolved, Some(1));
        let distance = found.axis_distance().expect("an axis");
        assert!((distance - 0.46).abs() < 1e-9, "{distance}");
        let longest = (0..3).map(|c| found.high[c] - found.low[c]).fold(0.0, f64::max);
        assert!((found.volume - mesh.volume()).abs() < 1e-12 && (longest - 0.92).abs() < 1e-3);
        mesh.nodes.iter_mut().for_each(|x| *x = [x[1] + 3.0, x[2], x[0] + 4.0]);
        let found = Attitude::from_mesh(&mesh);
        assert_eq!(found.revolved, Some(0));
        let expected = (4.0f64).hypot(0.46);
        assert!((found.axis_distance().expect("an axis") - expected).abs() < 1e-9, "{found:?}");
        // Not a circle any more.
        mesh.nodes.iter_mut().for_each(|x| x[1] *= 1.1);
        assert_eq!(Attitude::from_mesh(&mesh).revolved, None);
    }
}
