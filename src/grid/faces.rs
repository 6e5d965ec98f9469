//! The faces of a surface of any mesh, seen in plan: where they are, what they are like, and their shape functions at
//! a point of the plane.

use super::clip::{doubled_area, Plane};
use crate::mesh::kind::MAX_FACET_NODES;
use crate::mesh::{FacetKind, Mesh};
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::Mat;

/// Surfaces that are farther from the plane of the contact than this part of the longer half side of what is looked
/// at are not those of the contact.
const FAR: f64 = 0.25;
/// Largest angle of a face against the plane, rad: the pressure is along its normal.
const STEEP: f64 = 0.35;
/// A point counts as inside a triangle if it is outside by this part of its height.
const EDGE: f64 = 1e-9;
/// Nodes that a curvature is taken from.
const FITTED: usize = 25;

/// A face in lower form.
#[derive(Debug, Clone)]
struct Face {
    kind: FacetKind,
    /// Its nodes in the mesh.
    nodes: Vec<u32>,
    /// Positions, m.
    places: Vec<[f64; 3]>,
}

/// A triangle that a face is divided into: straight between nodes of the face, so that neighbours meet.
#[derive(Debug, Clone)]
pub struct FaceTriangle {
    face: usize,
    /// Its corners in plan, m.
    pub plan: [Plane; 3],
    /// The same in the coordinates of the face.
    own: [Plane; 3],
    /// Largest and smallest height of its corners, m.
    heights: [f64; 2],
    /// Cosine of its normal against +z.
    up: f64,
}

/// The shape functions of a face at a point.
#[derive(Debug, Clone, Copy)]
pub struct FaceShapeFunctions<'f> {
    /// Nodes of the face in the mesh.
    pub nodes: &'f [u32],
    /// Their shape functions; the first ones count.
    pub values: [f64; MAX_FACET_NODES],
    /// Height of the surface, m.
    pub z: f64,
}

/// The faces of a group.
#[derive(Debug, Clone)]
pub struct Faces {
    group: String,
    faces: Vec<Face>,
    pieces: Vec<FaceTriangle>,
}

/// Triangles of a face in its own coordinates, between its nodes; faces with nodes on their edges are divided there.
fn divided(kind: FacetKind) -> Vec<[Plane; 3]> {
    match kind {
        FacetKind::Tri3 => vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
        FacetKind::Tri6 => {
            let [a, b, c, ab, bc, ca] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];
            vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        }
        FacetKind::Quad4 => vec![[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]],
        FacetKind::Quad8 | FacetKind::Quad9 => {
            let ring = [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 0.5], [1.0, 1.0], [0.5, 1.0], [0.0, 1.0], [0.0, 0.5]];
            (0..8).map(|k| [[0.5, 0.5], ring[k], ring[(k + 1) % 8]]).collect()
        }
    }
}

/// Barycentric coordinates of a point in a triangle.
fn barycentric(p: Plane, [a, b, c]: [Plane; 3]) -> [f64; 3] {
    let whole = doubled_area([a, b, c]);
    [doubled_area([p, b, c]), doubled_area([a, p, c]), doubled_area([a, b, p])].map(|v| v / whole)
}

impl Face {
    fn place(&self, own: Plane) -> [f64; 3] {
        let values = self.kind.shape(own);
        std::array::from_fn(|c| self.places.iter().zip(values).map(|(x, v)| v * x[c]).sum())
    }

    /// The coordinates of the face at the point `p` of the plane, near `start`.
    fn own(&self, p: Plane, start: Plane) -> Plane {
        let mut own = start;
        if self.kind == FacetKind::Tri3 {
            return own;
        }
        for _ in 0..12 {
            let [x, y, _] = self.place(own);
            let off = [p[0] - x, p[1] - y];
            // Of second order in each coordinate: differences are its derivatives.
            let [along, up] = [[0.25, 0.0], [0.0, 0.25]].map(|d: Plane| {
                let [ahead, behind] = [1.0, -1.0].map(|s| self.place([own[0] + s * d[0], own[1] + s * d[1]]));
                [2.0 * (ahead[0] - behind[0]), 2.0 * (ahead[1] - behind[1])]
            });
            let det = along[0] * up[1] - along[1] * up[0];
            let step = [(off[0] * up[1] - off[1] * up[0]) / det, (along[0] * off[1] - along[1] * off[0]) / det];
            own = [own[0] + step[0], own[1] + step[1]];
            if !(step[0].abs().max(step[1].abs()) > 1e-14) {
                break;
            }
        }
        own
    }
}

impl Faces {
    /// The faces of the group `group` of a mesh in lower form.
    ///
    /// # Errors
    /// No such group; a face between two cells.
    pub(crate) fn from_group(mesh: &Mesh, group: &str) -> Result<Self> {
        mesh.require_group(group, "the mesh")?;
        let facets = &mesh.groups[group];
        if let Some(k) = mesh.cells.sharing(facets).iter().position(|&n| n > 1) {
            let [x, y, z] = mesh.nodes[mesh.cells.facet(facets[k]).next().unwrap_or_default() as usize];
            return Err(Error::Input(format!(
                "group \"{group}\": the facet at ({x:.6e}, {y:.6e}, {z:.6e}) m lies between two cells; expected \
                 facets on the boundary"
            )));
        }
        let face = |&facet: &crate::mesh::Facet| {
            let nodes: Vec<u32> = mesh.cells.facet(facet).collect();
            let places = nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
            Face { kind: mesh.cells.get(facet.cell as usize).kind.faces()[facet.face as usize].kind, nodes, places }
        };
        let faces: Vec<Face> = facets.iter().map(face).collect();
        let mut pieces = Vec::new();
        for (number, face) in faces.iter().enumerate() {
            for own in divided(face.kind) {
                let [a, b, c] = own.map(|at| face.place(at));
                let side = |p: [f64; 3]| [0, 1, 2].map(|i| p[i] - a[i]);
                let (p, q) = (side(b), side(c));
                let normal: [f64; 3] =
                    std::array::from_fn(|i| p[(i + 1) % 3] * q[(i + 2) % 3] - p[(i + 2) % 3] * q[(i + 1) % 3]);
                let size = normal.iter().map(|v| v * v).sum::<f64>().sqrt();
                pieces.push(FaceTriangle {
                    face: number,
                    plan: [a, b, c].map(|v| [v[0], v[1]]),
                    own,
                    heights: [a[2].max(b[2]).max(c[2]), a[2].min(b[2]).min(c[2])],
                    up: normal[2] / size,
                });
            }
        }
        Ok(Self { group: group.into(), faces, pieces })
    }

    /// Name of the group.
    pub(super) fn group(&self) -> &str {
        &self.group
    }

    /// The pieces near the plane z = 0 that reach into the rectangle of the half sides `half`, m, about the origin.
    ///
    /// # Errors
    /// A face there that looks down, or is steep.
    pub(crate) fn pieces_within(&self, half: [f64; 2]) -> Result<Vec<&FaceTriangle>> {
        let far = FAR * half[0].max(half[1]);
        let found: Vec<&FaceTriangle> = self.pieces.iter().filter(|p| p.reaches(half) && p.is_near(far)).collect();
        let place = |p: &FaceTriangle| {
            let [x, y] = p.middle();
            format!("group \"{}\": the facet at x = {x:.6}, y = {y:.6}, z = {:.6} m", self.group, p.heights[0])
        };
        if let Some(p) = found.iter().find(|p| p.up < 0.0) {
            return Err(Error::Input(format!(
                "{} faces -z; expected a surface whose outward normal is +z on the lower body, -z on the upper one",
                place(p)
            )));
        }
        if let Some(p) = found.iter().find(|p| !(p.up > STEEP.cos())) {
            return Err(Error::Input(format!(
                "{} is {:.2} rad steep against the plane of the contact; expected at most {STEEP} rad: turn the \
                 body so that the common normal is z, or look \
                 at a smaller contact",
                place(p),
                p.up.clamp(-1.0, 1.0).acos()
            )));
        }
        Ok(found)
    }

    /// The piece among `pieces` that is over the point `p`.
    pub fn over<'p>(&self, pieces: &[&'p FaceTriangle], p: Plane) -> Option<&'p FaceTriangle> {
        pieces.iter().find(|t| barycentric(p, t.plan).iter().all(|v| *v >= -EDGE)).copied()
    }

    /// The shape functions at the point `p` of a piece.
    pub(crate) fn shape_functions(&self, piece: &FaceTriangle, p: Plane) -> FaceShapeFunctions<'_> {
        let face = &self.faces[piece.face];
        let weights = barycentric(p, piece.plan);
        let start = [0, 1].map(|c| (0..3).map(|k| weights[k] * piece.own[k][c]).sum());
        let own = face.own(p, start);
        FaceShapeFunctions { nodes: &face.nodes, values: face.kind.shape(own), z: face.place(own)[2] }
    }

    /// Height of the surface over the point `p`, m: that of the highest face that looks up; none where there is none.
    pub fn height(&self, p: Plane) -> Option<f64> {
        let inside = |t: &&FaceTriangle| t.up > 0.0 && barycentric(p, t.plan).iter().all(|v| *v >= -EDGE);
        self.pieces.iter().filter(inside).map(|t| self.shape_functions(t, p).z).max_by(f64::total_cmp)
    }

    /// Ends of the group along x and y, m.
    pub fn ends(&self) -> [[f64; 2]; 2] {
        let places = || self.faces.iter().flat_map(|f| &f.places);
        [0, 1].map(|c| {
            places().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[c]), high.max(p[c])])
        })
    }

    /// Distance of the nodes of the largest face in the rectangle of the half sides `half`, m, about the origin: the
    /// side of a square, or of the half of one, over the order of its shape functions.
    pub fn size(&self, half: [f64; 2]) -> f64 {
        let far = FAR * half[0].max(half[1]);
        let mut doubled = vec![0.0; self.faces.len()];
        let mut reaches = vec![false; self.faces.len()];
        for p in &self.pieces {
            doubled[p.face] += doubled_area(p.plan);
            reaches[p.face] |= p.reaches(half) && p.is_near(far);
        }
        let of = |k: usize| {
            let kind = self.faces[k].kind;
            let square = if kind.corners() == 3 { doubled[k] } else { 0.5 * doubled[k] };
            square.max(0.0).sqrt() / if kind.nodes() > kind.corners() { 2.0 } else { 1.0 }
        };
        (0..self.faces.len()).filter(|&k| reaches[k]).map(of).fold(0.0, f64::max)
    }

    /// Returns whether all faces in the rectangle are flat ones, of first order: the surface is a polyhedron there.
    pub(crate) fn are_flat(&self, half: [f64; 2]) -> bool {
        let flat = |p: &FaceTriangle| self.faces[p.face].kind.nodes() == self.faces[p.face].kind.corners();
        self.pieces.iter().filter(|p| p.reaches(half)).all(flat)
    }

    /// Curvatures −∂²z/∂x_i∂x_j of the surface at the origin, 1/m, positive of a body that is round outwards: of the
    /// parabola through the nodes nearest to it, which lie on the surface whatever is between them. None where they
    /// do not show it.
    pub fn curvatures(&self) -> Option<[[f64; 2]; 2]> {
        let mut near: Vec<[f64; 3]> = Vec::new();
        for p in self.pieces.iter().filter(|p| p.up > STEEP.cos()) {
            near.extend(&self.faces[p.face].places);
        }
        let distance = |p: &[f64; 3]| p[0].hypot(p[1]);
        let key = |p: &[f64; 3]| [distance(p), p[0], p[1], p[2]];
        near.retain(|p| p[2].abs() <= FAR * distance(p).max(1e-6));
        near.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
        near.dedup();
        near.truncate(FITTED);
        let size = near.last().map(distance).filter(|s| *s > 0.0)?;
        let terms = |p: &[f64; 3]| {
            let [x, y] = [p[0] / size, p[1] / size];
            [1.0, x, y, 0.5 * x * x, x * y, 0.5 * y * y]
        };
        let mut normal = Mat::<f64>::zeros(6, 6);
        let mut right = Mat::<f64>::zeros(6, 1);
        for p in &near {
            let t = terms(p);
            for i in 0..6 {
                right[(i, 0)] += t[i] * p[2] / size;
                (0..6).for_each(|j| normal[(i, j)] += t[i] * t[j]);
            }
        }
        // Nodes on a line, or on two, leave it singular.
        let eigen = normal.self_adjoint_eigenvalues(faer::Side::Lower).ok()?;
        if !(eigen.first()? > &(1e-6 * eigen.last()?)) {
            return None;
        }
        let fit = normal.llt(faer::Side::Lower).ok()?.solve(&right);
        let [xx, xy, yy] = [3, 4, 5].map(|k| -fit[(k, 0)] / size);
        Some([[xx, xy], [xy, yy]])
    }
}

impl FaceTriangle {
    fn reaches(&self, half: [f64; 2]) -> bool {
        (0..2).all(|c| {
            let at = || self.plan.iter().map(|p| p[c]);
            at().fold(f64::INFINITY, f64::min) < half[c] && at().fold(f64::NEG_INFINITY, f64::max) > -half[c]
        })
    }

    fn is_near(&self, far: f64) -> bool {
        self.heights[0] > -far && self.heights[1] < far
    }

    fn middle(&self) -> Plane {
        [0, 1].map(|c| self.plan.iter().map(|p| p[c]).sum::<f64>() / 3.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cylinder::{build, CylinderSpec, DEFAULT_GROWTH};

    fn wheel() -> Mesh {
        let spec = CylinderSpec {
            inner_radius: 0.1,
            outer_radius: 0.5,
            thickness: 0.1,
            crown_radius: Some(0.3),
            contact_offset: 0.01,
            element_size: 2e-3,
            growth: DEFAULT_GROWTH,
            max_element_size: None,
            patch_half_length: 8e-3,
            patch_half_width: 8e-3,
        };
        build(&spec).expect("a valid cylinder")
    }

    /// Curvatures, heights and sizes of a crowned wheel, as its nodes show them.
    #[test]
    fn a_round_surface_is_seen() {
        let faces = Faces::from_group(&wheel(), "contact").expect("faces");
        let [[xx, xy], [_, yy]] = faces.curvatures().expect("a parabola");
        assert!((xx - 2.0).abs() < 1e-3 && (yy - 1.0 / 0.3).abs() < 2e-3 && xy.abs() < 1e-9, "{xx} {xy} {yy}");
        // A face is flat between its nodes: half way it lies lower by a quarter of what the node is lower.
        let of = |x: f64| faces.height([x, 0.0]).expect("a face");
        let node = (0.25f64 - 4e-6).sqrt() - 0.5;
        assert!((of(2e-3) - node).abs() < 1e-15 && (of(1e-3) - 0.5 * node).abs() < 1e-15);
        assert_eq!(faces.height([0.1, 0.0]), None);
        assert!((faces.size([6e-3; 2]) - 2e-3).abs() < 1e-8 && faces.are_flat([6e-3; 2]));
        let [[x0, x1], [y0, y1]] = faces.ends();
        assert!([x0 + 8e-3, x1 - 8e-3, y0 + 8e-3, y1 - 8e-3].iter().all(|e| e.abs() < 1e-12));
    }

    /// A surface that stands upright beside the contact is refused there, and does not matter farther away.
    #[test]
    fn steep_faces_are_refused() {
        let mut mesh = wheel();
        mesh.nodes.iter_mut().for_each(|p| p[2] -= if p[0] > 3e-3 { 2e-3 * (p[0] - 3e-3) / 2e-3 } else { 0.0 });
        let faces = Faces::from_group(&mesh, "contact").expect("faces");
        let error = faces.pieces_within([7e-3; 2]).expect_err("it is steep").to_string();
        assert!(error.contains("rad steep") && error.contains("x = 0.0"), "{error}");
        assert!(!faces.pieces_within([1.9e-3; 2]).expect("faces").is_empty());
    }
}
