//! Faces of a disc: edges of a section whose normal points along the axle, on which pads press.
//!
//! On a face that looks to +y the frame of a contact is x = e_θ, y = −e_r, n = −e_y into the body; on one that looks to
//! −y it is x = e_θ, y = e_r, n = e_y: that of a running line, turned about x by ∓90°.

use super::contact::{SectionContact, Spot};
use super::CrossSection;
use crate::{Error, Result};
use std::f64::consts::FRAC_PI_2;

/// Distance of the nodes of a face from its plane at the most, over its radius.
const FLAT: f64 = 1e-9;

/// A flat face of a section.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionFace {
    /// Its edges, first, last and middle node, with the body to their left in the plane (r, y).
    edges: Vec<[usize; 3]>,
    /// Its y, m.
    y: f64,
    /// True if it looks to +y.
    plus: bool,
    /// Its smallest and its largest radius, m.
    radii: [f64; 2],
}

impl SectionFace {
    /// The face of a section that is its group of edges `group`.
    ///
    /// # Errors
    /// A group that is missing, has no edges, is not flat, or looks to both sides.
    pub fn new(section: &CrossSection, group: &str) -> Result<Self> {
        let edges = section.edges(group);
        if edges.is_empty() {
            let there: Vec<String> = section.groups.keys().map(|name| format!("\"{name}\"")).collect();
            return Err(Error::Job(format!(
                "found \"{group}\", expected a face of the section, one of {}",
                if there.is_empty() { "none".into() } else { there.join(", ") }
            )));
        }
        let nodes = || edges.iter().flatten().map(|&k| section.nodes[k]);
        let range = |c: usize| {
            nodes().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x[c]), high.max(x[c])])
        };
        let (radii, [low, high]) = (range(0), range(1));
        if !(high - low <= FLAT * radii[1]) {
            return Err(Error::Job(format!(
                "found \"{group}\", which reaches from y = {low:.6} m to {high:.6} m; expected a flat face across the \
                 axle, on which a pad lies"
            )));
        }
        // The body is to the left of an edge, so that one towards the axle looks to +y.
        let inwards = edges.iter().filter(|e| section.nodes[e[1]][0] < section.nodes[e[0]][0]).count();
        if inwards != 0 && inwards != edges.len() {
            return Err(Error::Job(format!(
                "found \"{group}\", which has the body on both sides; expected a face at the border of the section"
            )));
        }
        Ok(Self { plus: inwards > 0, y: 0.5 * (low + high), radii, edges })
    }

    /// Its place along the axle, m.
    pub fn y(&self) -> f64 {
        self.y
    }

    /// Smallest and largest radius, m.
    pub fn radii(&self) -> [f64; 2] {
        self.radii
    }

    /// True if it looks to +y, so that the axle points along z, out of the body, at a contact; else against it.
    pub fn looks_to_plus(&self) -> bool {
        self.plus
    }

    /// A contact about the radius `radius`, m, at the angle `angle` about the axle, rad.
    pub fn contact(&self, radius: f64, angle: f64) -> SectionContact {
        let tilt = if self.plus { -FRAC_PI_2 } else { FRAC_PI_2 };
        SectionContact::on(Spot { radius, origin: [radius, self.y], angle: tilt, share: 1.0 }).at_place(angle)
    }
}

impl CrossSection {
    /// The section with the edges of the faces `groups` in place of its running line.
    ///
    /// # Errors
    /// As those of [`SectionFace::new`].
    pub fn with_faces<'a>(mut self, groups: impl IntoIterator<Item = &'a str>) -> Result<Self> {
        let mut edges: Vec<[usize; 3]> = Vec::new();
        for group in groups {
            let face = SectionFace::new(&self, group)?;
            edges.extend(face.edges.iter().filter(|edge| !edges.contains(edge)).copied().collect::<Vec<_>>());
        }
        self.tread = edges;
        Ok(self)
    }

    /// Edges of the running line that hang together with the one under the origin of a spot on a face.
    pub(super) fn face_at(&self, spot: &Spot) -> Vec<[usize; 3]> {
        let plane = FLAT * spot.radius;
        let on = |edge: &&[usize; 3]| {
            let [a, b] = [edge[0], edge[1]].map(|k| spot.along(self.nodes[k]));
            b > a && edge.iter().all(|&k| (self.nodes[k][1] - spot.origin[1]).abs() <= plane)
        };
        let edges: Vec<[usize; 3]> = self.tread.iter().filter(on).copied().collect();
        let apart = |edge: &[usize; 3]| spot.along(self.nodes[edge[2]]).abs();
        let nearest = edges.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).copied();
        nearest.map_or(Vec::new(), |edge| hanging_together(&edges, edge))
    }
}

/// Members of `edges` that hang together with `first`.
pub(super) fn hanging_together(edges: &[[usize; 3]], first: [usize; 3]) -> Vec<[usize; 3]> {
    let mut reached: std::collections::BTreeSet<usize> = first.into_iter().collect();
    loop {
        let before = reached.len();
        for edge in edges {
            if reached.contains(&edge[0]) || reached.contains(&edge[1]) {
                reached.extend(edge);
            }
        }
        if reached.len() == before {
            break;
        }
    }
    edges.iter().filter(|edge| reached.contains(&edge[2])).copied().collect()
}

impl Spot {
    /// Returns whether the spot is on a face of the section, across the axle.
    pub(super) fn is_on_a_face(&self) -> bool {
        self.angle.abs() == FRAC_PI_2
    }
}
