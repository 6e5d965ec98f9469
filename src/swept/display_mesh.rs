//! A swept body as a mesh of solid cells, which shows its modes: the corners of its section, swept.

use super::{Forms, Path};
use faer::{Col, ColRef, Mat, Scale};
use std::f64::consts::PI;

/// Stations of a wave, and of the whole way at least and at most.
const WAVE: usize = 10;
const LEAST: usize = 64;
const MOST: usize = 480;

/// Corners of a section at stations of the way it is swept along.
#[derive(Debug, Clone)]
pub struct DisplayMesh {
    path: Path,
    /// First amplitude of each corner; none where it is clamped.
    amplitudes: Vec<Option<usize>>,
    /// Angles, rad, or places along a line, m.
    stations: Vec<f64>,
    /// cos and sin of the angle of the frame in which it is shown.
    turn: [f64; 2],
    /// Places (x, y, z), m, station by station.
    pub points: Vec<[f64; 3]>,
    /// Corners of the cells, six of wedges and eight of hexahedra.
    pub cells: Vec<Vec<u32>>,
}

impl DisplayMesh {
    /// The section of `forms` with the contact point at the distance `radius`, m, from the axle, or 0 on a line, for
    /// waves of orders up to `highest`; in a frame turned by `tilt`, rad, about x, as
    /// [`rotate_loads`](super::rotate_loads) has it.
    pub fn new(forms: &Forms, radius: f64, highest: usize, tilt: f64) -> Self {
        let section = &forms.section;
        let mut number = vec![None; section.nodes.len()];
        let mut corners = Vec::new();
        let faces: Vec<Vec<u32>> = section
            .elements
            .iter()
            .map(|element| {
                let of = |&[corner, ..]: &[usize; 3]| {
                    let node = element.nodes[corner];
                    *number[node].get_or_insert_with(|| {
                        corners.push(node);
                        corners.len() as u32 - 1
                    })
                };
                element.kind.edges().iter().map(of).collect()
            })
            .collect();
        let count = (WAVE * highest).clamp(LEAST, MOST);
        let (round, stations): (bool, Vec<f64>) = match forms.path {
            Path::Axle => (true, (0..count).map(|k| 2.0 * PI * k as f64 / count as f64).collect()),
            // From end to end of the period, the contact in the middle.
            Path::Line(period) => (false, (0..=count).map(|k| period * (k as f64 / count as f64 - 0.5)).collect()),
        };
        let (sin, cos) = tilt.sin_cos();
        let mut picture = Self {
            path: forms.path,
            amplitudes: corners.iter().map(|&node| forms.amplitude(node)).collect(),
            turn: [cos, sin],
            points: Vec::new(),
            cells: Vec::new(),
            stations,
        };
        for &s in &picture.stations {
            for &node in &corners {
                let [r, y] = section.nodes[node];
                let [x, z] = match forms.path {
                    Path::Axle => [r * s.sin(), r * s.cos() - radius],
                    Path::Line(_) => [s, r],
                };
                picture.points.push(picture.shown([x, y, z]));
            }
        }
        let (all, each) = (picture.stations.len(), corners.len() as u32);
        for k in 0..if round { all } else { all - 1 } {
            let [here, next] = [k, (k + 1) % all].map(|k| k as u32 * each);
            for face in &faces {
                // In the plane (r, y) faces go round against the clock; x, y, z is right-handed with r for z, so that
                // they go round clockwise seen from +x: the first face is the one further on.
                picture.cells.push(face.iter().map(|c| next + c).chain(face.iter().map(|c| here + c)).collect());
            }
        }
        picture
    }

    /// A vector of the section's frame in the one shown.
    fn shown(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [cos, sin] = self.turn;
        [x, cos * y + sin * z, cos * z - sin * y]
    }

    /// Displacements of all points under the amplitudes of an order and a family, 0 or 1.
    pub fn motion(&self, order: usize, family: usize, amplitudes: ColRef<'_, f64>) -> Vec<[f64; 3]> {
        let mut all = Vec::with_capacity(self.points.len());
        let of_section: Vec<[f64; 3]> = self
            .amplitudes
            .iter()
            .map(|at| at.map_or([0.0; 3], |k| [amplitudes[k], amplitudes[k + 1], amplitudes[k + 2]]))
            .collect();
        for &s in &self.stations {
            let (sin_s, cos_s) = s.sin_cos();
            let angle = match self.path {
                Path::Axle => order as f64 * s,
                Path::Line(_) => self.path.wavenumber(order) * s,
            };
            // (U cos, V sin, W cos), or (U sin, −V cos, W sin); order 0 has all of them constant.
            let (sin, cos) = angle.sin_cos();
            let [along, across] = match (order, family) {
                (0, _) => [1.0, 1.0],
                (_, 0) => [cos, sin],
                _ => [sin, -cos],
            };
            for [u, v, w] in &of_section {
                let (r, t, y) = (along * u, across * v, along * w);
                let motion = match self.path {
                    Path::Axle => [r * sin_s + t * cos_s, y, r * cos_s - t * sin_s],
                    Path::Line(_) => [t, y, r],
                };
                all.push(self.shown(motion));
            }
        }
        all
    }
}

/// The modes of a swept body on its picture.
#[derive(Debug, Clone)]
pub struct PictureModes {
    /// The mesh.
    pub picture: DisplayMesh,
    /// Amplitudes of the modes of each order, `[amplitudes, m]`.
    pub orders: Vec<(usize, Mat<f64>)>,
    /// The modes of the body: index of the order in `orders`, of the mode there, and its family.
    pub list: Vec<(usize, usize, usize)>,
}

impl PictureModes {
    /// Displacements of all points in the mode `k`, mass-normalised, 1/√kg.
    pub fn motion(&self, k: usize) -> Vec<[f64; 3]> {
        let Some((order, vectors)) = self.list.get(k).and_then(|&(of, ..)| self.orders.get(of)) else {
            return Vec::new();
        };
        let (_, index, family) = self.list[k];
        self.picture.motion(*order, family, vectors.col(index))
    }

    /// Displacements of all points with these `amplitudes` of the modes, m √kg. Those of one order and family are added
    /// up on the section before it is swept.
    pub fn moved(&self, amplitudes: &[f64]) -> Vec<[f64; 3]> {
        let mut sum = vec![[0.0; 3]; self.picture.points.len()];
        for (of, (order, vectors)) in self.orders.iter().enumerate() {
            for family in [0, 1] {
                let own =
                    self.list.iter().zip(amplitudes).filter(|((o, _, f), q)| (*o, *f) == (of, family) && **q != 0.0);
                let mut on_section: Option<Col<f64>> = None;
                for ((_, index, _), q) in own {
                    let column = on_section.get_or_insert_with(|| Col::zeros(vectors.nrows()));
                    *column += Scale(*q) * vectors.col(*index);
                }
                let Some(on_section) = on_section else { continue };
                let motion = self.picture.motion(*order, family, on_section.as_ref());
                sum.iter_mut().flatten().zip(motion.iter().flatten()).for_each(|(s, m)| *s += m);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::modes::of_order;
    use super::super::{cylinder, CylinderSection, Focus};
    use super::*;
    use crate::fem::ElasticMaterial;

    const STEEL: ElasticMaterial = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };

    fn ring() -> Forms {
        let ring = CylinderSection {
            inner_radius: 0.1,
            outer_radius: 0.3,
            thickness: 0.1,
            crown_radius: None,
            contact_offset: 0.0,
        };
        let focus = Focus { size: 0.02, reach: 0.0, corner: 0.02, largest: 0.02 };
        Forms::new(cylinder(&ring, focus).expect("section"), STEEL, &["inner".into()]).expect("forms")
    }

    /// Six times the volume of a tetrahedron; positive if d is on the side of (a, b, c) from which these go round
    /// against the clock.
    fn volume([a, b, c, d]: [[f64; 3]; 4]) -> f64 {
        let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        (u[1] * v[2] - u[2] * v[1]) * w[0] + (u[2] * v[0] - u[0] * v[2]) * w[1] + (u[0] * v[1] - u[1] * v[0]) * w[2]
    }

    /// Cells stand upright round an axle and along a line, whatever the tilt; the contact point is a point of the
    /// mesh, and the wheel is round.
    #[test]
    fn the_mesh_is_the_body() {
        let forms = ring();
        let line = Forms::along(forms.section.clone(), STEEL, 3.0, None, 0.0).expect("forms");
        for (forms, radius, length) in [(&forms, 0.3, 2.0 * PI * 0.2), (&line, 0.0, 3.0)] {
            let picture = DisplayMesh::new(forms, radius, 20, 0.3);
            let mut sum = 0.0;
            for cell in &picture.cells {
                let at = |k: usize| picture.points[cell[k] as usize];
                let half = cell.len() / 2;
                assert!(volume([at(0), at(1), at(half - 1), at(half)]) > 0.0, "{cell:?}");
                // Prisms of triangles, each as three tetrahedra.
                for t in 1..half - 1 {
                    let [a, b, c] = [0, t, t + 1];
                    let [d, e, f] = [a, b, c].map(|k| half + k);
                    sum +=
                        [[a, b, c, d], [b, c, d, e], [c, d, e, f]].map(|t| volume(t.map(at)).abs()).iter().sum::<f64>()
                            / 6.0;
                }
            }
            assert!((sum / (0.02 * length) - 1.0).abs() < 2e-3, "{sum}");
            let touched = picture.points.iter().any(|p| p.iter().all(|c| c.abs() < 1e-12));
            assert!(touched == (radius > 0.0));
        }
        let far = DisplayMesh::new(&forms, 0.3, 3, 0.0);
        assert!(far.points.iter().all(|p| p[0].hypot(p[2] + 0.3) < 0.3 + 1e-12));
    }

    /// At the contact a mode moves as the contact sees it: (U, V, W) is along (z, x, y) there; both families are each
    /// other a quarter of a wave further.
    #[test]
    fn modes_are_what_the_families_say() {
        let forms = ring();
        let modes = of_order(&forms, 3, 2.0 * PI * 6000.0).expect("modes");
        let picture = DisplayMesh::new(&forms, 0.3, 3, 0.0);
        let count = picture.stations.len();
        assert!(count % 12 == 4, "{count} stations, of which a wave has not a whole quarter");
        let corners = picture.amplitudes.len();
        for k in 0..modes.omega.len().min(3) {
            let [even, odd] = [0, 1].map(|family| picture.motion(3, family, modes.vectors.col(k)));
            for (c, at) in picture.amplitudes.iter().enumerate() {
                let [u, v, w] = at.map_or([0.0; 3], |k0| [0, 1, 2].map(|d| modes.vectors[(k0 + d, k)]));
                assert!(
                    even[c].iter().zip([0.0, w, u]).all(|(a, b)| (a - b).abs() < 1e-12),
                    "{:?} {u} {v} {w}",
                    even[c]
                );
                assert!(odd[c].iter().zip([-v, 0.0, 0.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{:?} {v}", odd[c]);
            }
            // Energies of both families are the same.
            let square = |all: &[[f64; 3]]| all.iter().flatten().map(|v| v * v).sum::<f64>();
            assert!((square(&even) / square(&odd) - 1.0).abs() < 1e-9);
            assert_eq!(even.len(), corners * count);
        }
    }

    /// The motion of several modes is the sum of theirs.
    #[test]
    fn modes_move_together_as_each_of_them() {
        let picture = DisplayMesh::new(&ring(), 0.3, 4, 0.2);
        let size = picture.amplitudes.iter().flatten().max().expect("an amplitude") + 3;
        let vectors = |of: f64| Mat::from_fn(size, 3, |i, j| (of + i as f64 + 0.1 * j as f64).sin());
        let orders = vec![(0, vectors(0.3)), (3, vectors(0.7))];
        let list = vec![(1, 0, 0), (0, 2, 0), (1, 0, 1), (1, 2, 0), (1, 1, 1)];
        let modes = PictureModes { picture, orders, list };
        let amplitudes = [0.5, -1.5, 0.0, 2.0, 0.7];
        let together = modes.moved(&amplitudes);
        for (i, together) in together.iter().enumerate() {
            for c in 0..3 {
                let sum: f64 = amplitudes.iter().enumerate().map(|(k, q)| q * modes.motion(k)[i][c]).sum();
                assert!((sum - together[c]).abs() < 1e-12, "{i}, {c}: {sum} and {}", together[c]);
            }
        }
    }
}
