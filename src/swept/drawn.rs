//! Sections that are drawn: a plane mesh of triangles and quadrilaterals with a running line.

mod border;

use super::refine::refined;
use super::wheelset;
use super::{Beam, CrossSection, Focus, HeadPoint, Path, SectionElement, SectionLayer};
use crate::fem::ElasticMaterial;
use crate::{Error, Result};
use border::{border, joined, key, line, node_text, quadratic, refuse_pieces, SAME_PLACE};
use std::collections::{BTreeMap, BTreeSet};

/// A section as it was drawn, of a wheel or a rail: nodes (r, y), m, which are (y, x) of the drawing; r of a wheel is
/// from the axle, that of a rail is its height.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnSection {
    section: CrossSection,
    /// Edges of the running line of the drawing; that of a mirror image comes behind them.
    own: usize,
    /// y of the plane about which a wheelset is the mirror image of its half that was drawn, m.
    middle: Option<f64>,
}

/// Steepest slope of the running line at a contact whose frame is not tilted, and at one whose frame lies along it: 80
/// degrees.
const STEEPEST_LEVEL: f64 = 0.2;
const STEEPEST: f64 = 5.671;
/// Slices of which the beam of a section is summed.
const SLICES: usize = 1000;

impl DrawnSection {
    /// Forms of a body swept along `path`: nodes (r, y), m; faces of 3, 4, 6, 8 or 9 nodes, corners first, then middles
    /// of the edges, then the centre; edges of named curves, first and last node first. Straight edges get a node in
    /// their middle. `running` names the running line. An error says what of the drawing is wrong, and where.
    pub fn new(
        path: Path,
        nodes: Vec<[f64; 2]>,
        faces: &[Vec<usize>],
        curves: &BTreeMap<String, Vec<Vec<usize>>>,
        running: &str,
    ) -> Result<Self> {
        let mut section = quadratic(nodes, faces)?;
        if path == Path::Axle {
            // What the drawing has on the axle lies there but for rounding.
            let largest = section.nodes.iter().map(|x| x[0].abs()).fold(0.0, f64::max);
            section.nodes.iter_mut().filter(|x| x[0].abs() <= SAME_PLACE * largest).for_each(|x| x[0] = 0.0);
        }
        joined(&section)?;
        section.check(path)?;
        let border = border(&section)?;
        refuse_pieces(&section, &border)?;
        let middle: BTreeMap<[usize; 2], usize> = border.iter().map(|e| (key(e[0], e[1]), e[2])).collect();
        for (name, edges) in curves {
            let of = |edge: &Vec<usize>| {
                let ends = key(edge[0], edge[1]);
                let missing = || {
                    let [a, b] = ends.map(|k| node_text(&section, k));
                    Error::Input(format!(
                        "the curve {name:?} has an edge from {a} to {b} that is not on the \
                     border of the section; expected curves of its border"
                    ))
                };
                middle.get(&ends).map(|&m| [edge[0], edge[1], m]).ok_or_else(missing)
            };
            let found = edges.iter().map(of).collect::<Result<Vec<[usize; 3]>>>()?;
            if name == running {
                section.tread = line(&section, found)?;
            } else {
                let group: BTreeSet<usize> = found.into_iter().flatten().collect();
                section.groups.insert(name.clone(), group.into_iter().collect());
            }
        }
        if section.tread.is_empty() {
            let there: Vec<&str> = curves.keys().map(String::as_str).collect();
            return Err(Error::Input(format!(
                "there is no physical curve {running:?}, the running line; the drawing has {}",
                if there.is_empty() { "none".into() } else { there.join(", ") }
            )));
        }
        let own = section.tread.len();
        Ok(Self { section, own, middle: None })
    }

    /// A wheelset of which the drawing is the half up to the plane y = `middle`, m: with its mirror image beyond it. An
    /// error says where the half does not end there.
    pub fn with_mirror_image(self, middle: f64) -> Result<Self> {
        let [_, [_, last]] = self.section.extent();
        if (last - middle).abs() > wheelset::SAME {
            return Err(Error::Job(format!(
                "found {middle} m, but the drawing ends at x = {last:.6} m towards its flange; expected one half of a \
                 wheelset, drawn up to the middle of its axle and no farther"
            )));
        }
        let near = self.section;
        let running = near.tread.last().is_some_and(|edge| near.nodes[edge[1]][1] >= middle - wheelset::SAME);
        let on = |k: &usize| (near.nodes[*k][1] - middle).abs() <= wheelset::SAME;
        let meets = |e: &SectionElement| e.kind.edges().iter().any(|edge| edge.iter().all(|&k| on(&e.nodes[k])));
        if running || !near.elements.iter().any(meets) {
            let what = if running { "the running line ends there" } else { "only a corner of it is there" };
            return Err(Error::Job(format!(
                "found {middle} m, where the axle of a wheelset is cut through; of the drawing {what}"
            )));
        }
        if let Some([r, y]) = wheelset::beside_cut(&near, middle) {
            return Err(Error::Job(format!(
                "found {middle} m, but the node at x = {y:.7} m, y = {r:.6} m lies {:.1e} m beside it; expected a \
                 straight cut with all its nodes within {:.0e} m: the halves would have a slit between them",
                (y - middle).abs(),
                wheelset::SAME
            )));
        }
        let far = wheelset::mirrored_about(near.clone(), middle);
        Ok(Self { section: wheelset::joined(near, far, middle), middle: Some(middle), ..self })
    }

    /// y of the middle of a wheelset, m.
    pub(super) fn middle(&self) -> Option<f64> {
        self.middle
    }

    /// The same with layers of other materials, each with the places of its faces among those of the drawing. An error
    /// says which of them does not fit.
    pub(crate) fn with_layers(mut self, layers: Vec<(SectionLayer, &[usize])>) -> Result<Self> {
        for (layer, faces) in layers {
            let number = self.section.layers.len() + 1;
            for &face in faces {
                let element = &mut self.section.elements[face];
                if let Some(other) = element.layer.checked_sub(1).map(|k| &self.section.layers[k]) {
                    return Err(Error::Job(format!(
                        "the physical surfaces {:?} and {:?} have a face in common, expected one material for each \
                         face",
                        other.name, layer.name
                    )));
                }
                element.layer = number;
            }
            self.section.layers.push(layer);
        }
        let runs = |e: &&SectionElement| {
            let edges = e.kind.edges().iter().map(|edge| e.nodes[edge[2]]);
            e.layer > 0 && edges.clone().any(|middle| self.section.tread.iter().any(|t| t[2] == middle))
        };
        let running = self.section.elements.iter().find(runs).map(|element| element.layer);
        match running {
            Some(layer) => Err(Error::Job(format!(
                "the running line lies on the physical surface {:?}, expected it on the material of the body, which \
                 the contact has",
                self.section.layers[layer - 1].name
            ))),
            None => Ok(self),
        }
    }

    /// Area, m².
    pub fn area(&self) -> f64 {
        self.section.area()
    }

    /// Area, centroid and second moments, of a rail.
    pub fn measures(&self) -> super::Measures {
        self.section.measures()
    }

    /// Seen from the other side.
    pub fn mirrored(self) -> Self {
        Self { section: self.section.mirrored(), ..self }
    }

    /// Names of the curves beside the running line.
    pub fn groups(&self) -> impl Iterator<Item = &str> {
        self.section.groups.keys().map(String::as_str)
    }

    /// First and last y of the running line as drawn, m.
    pub fn reach(&self) -> [f64; 2] {
        let line = &self.section.tread[..self.own];
        let ends = [line.first().map(|e| e[0]), line.last().map(|e| e[1])];
        ends.map(|k| k.map_or(0.0, |k| self.section.nodes[k][1]))
    }

    /// Radius of the running line at y, m, and its slope dr/dy; none beside it.
    pub fn running(&self, y: f64) -> Option<[f64; 2]> {
        let nodes = &self.section.nodes;
        let &[a, b, m] = self.section.tread.iter().find(|e| nodes[e[0]][1] <= y && y <= nodes[e[1]][1])?;
        let [a, b, m] = [a, b, m].map(|k| nodes[k]);
        // y(s) is quadratic and grows: its place by halving.
        let at = |s: f64, c: usize| 0.5 * s * (s - 1.0) * a[c] + 0.5 * s * (s + 1.0) * b[c] + (1.0 - s * s) * m[c];
        let (mut low, mut high) = (-1.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if at(middle, 1) < y {
                low = middle;
            } else {
                high = middle;
            }
        }
        let s = 0.5 * (low + high);
        let slope = |c: usize| (s - 0.5) * a[c] + (s + 0.5) * b[c] - 2.0 * s * m[c];
        Some([at(s, 0), slope(0) / slope(1)])
    }

    /// An error where the running line at y = `offset`, m, is too steep for a contact whose frame is not tilted.
    pub(crate) fn refuse_steep(&self, offset: f64) -> Result<()> {
        match self.running(offset) {
            Some([_, slope]) if slope.abs() > STEEPEST_LEVEL => Err(Error::Job(format!(
                "the contact is at y = {offset} m of the section, where the running line has the slope \
                 {slope:.2}, expected at most {STEEPEST_LEVEL}: \
                 without contact.placement a section is touched on its tread"
            ))),
            _ => Ok(()),
        }
    }

    /// The place of the running line that is nearest to (r, y), m.
    pub(super) fn nearest(&self, [r, y]: [f64; 2]) -> HeadPoint {
        let at = |edge: &[usize; 3], s: f64| {
            let [value, slope] =
                [[0.5 * s * (s - 1.0), 0.5 * s * (s + 1.0), 1.0 - s * s], [s - 0.5, s + 0.5, -2.0 * s]];
            let sum =
                |of: [f64; 3], c: usize| edge.iter().zip(of).map(|(&k, f)| f * self.section.nodes[k][c]).sum::<f64>();
            [[sum(value, 0), sum(value, 1)], [sum(slope, 0), sum(slope, 1)]]
        };
        let apart = |x: [f64; 2]| (x[0] - r).hypot(x[1] - y);
        let mut nearest = (f64::INFINITY, HeadPoint { y, z: r, angle: 0.0 });
        for edge in &self.section.tread {
            // From where the way to the place has a part along the edge to where it has none.
            let ahead = |s: f64| {
                let [here, slope] = at(edge, s);
                (r - here[0]) * slope[0] + (y - here[1]) * slope[1]
            };
            let (mut low, mut high) = (-1.0, 1.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if ahead(middle) > 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let [here, slope] = at(edge, 0.5 * (low + high));
            if apart(here) < nearest.0 {
                nearest = (apart(here), HeadPoint { y: here[1], z: here[0], angle: slope[0].atan2(slope[1]) });
            }
        }
        nearest.1
    }

    /// An error where nothing can be touched at y, m.
    pub(super) fn refuse_beside(&self, y: f64) -> Result<()> {
        self.touched_radius(y).map(|_| ())
    }

    /// Radius of the running line at y = `offset`, m. An error where nothing can be touched there.
    fn touched_radius(&self, offset: f64) -> Result<f64> {
        let [first, last] = self.reach();
        let Some([radius, slope]) = self.running(offset) else {
            return Err(Error::Job(format!(
                "the contact is at y = {offset} m of the section, expected a place on its running line, which \
                 reaches from {first} to {last} m"
            )));
        };
        if slope.abs() > STEEPEST {
            return Err(Error::Job(format!(
                "the contact is at y = {offset} m of the section, where the running line has the slope \
                 {slope:.2}, expected at most {STEEPEST}: a section is \
                 touched on its tread, its flange root and the face of its flange, up to 80 degrees"
            )));
        }
        Ok(radius)
    }

    /// The section with the contact at y = `offset` of the drawing, m, seen from the other side if `mirrored`, and
    /// where the drawing is coarser than `focus`, finer. An error where nothing runs there.
    pub(super) fn with_contact_at(&self, offset: f64, mirrored: bool, focus: &Focus) -> Result<CrossSection> {
        let radius = self.touched_radius(offset)?;
        let mut section = self.section.clone();
        section.nodes.iter_mut().for_each(|x| x[1] -= offset);
        let section = if mirrored { section.mirrored() } else { section };
        if focus.largest.is_infinite() && focus.size.is_infinite() {
            return Ok(section);
        }
        let finer = refined(section, |[r, y]| focus.near((r - radius).hypot(y)));
        finer.check(Path::Axle)?;
        Ok(finer)
    }
}

impl DrawnSection {
    /// The section of a rail in the frame of a place of its head, and where the drawing is coarser than `focus`, finer.
    pub(super) fn in_frame(&self, contact: &HeadPoint, focus: Option<Focus>) -> Result<CrossSection> {
        let mut section = self.section.clone();
        section.nodes.iter_mut().for_each(|x| *x = contact.in_surface_frame(*x));
        Ok(match focus {
            Some(focus) => refined(section, |[z, y]| focus.near(z.hypot(y))),
            None => section,
        })
    }

    /// The beam of this section, vertically or laterally. What shears, as a part of the area A, is I² over A∫Q²/b,
    /// with the width b of each slice and the first moment Q beyond it (Jourawski's shear stress).
    pub(super) fn beam(&self, material: ElasticMaterial, lateral: bool, loss: f64) -> Result<Beam> {
        self.section.beam(material, lateral, loss)
    }
}

impl CrossSection {
    /// The beam of an upright section, see [`DrawnSection::beam`].
    pub(super) fn beam(&self, material: ElasticMaterial, lateral: bool, loss: f64) -> Result<Beam> {
        let across = usize::from(lateral);
        let border = border(self)?;
        let chords: Vec<[[f64; 2]; 2]> =
            border.iter().flat_map(|&[a, b, m]| [[a, m], [m, b]]).map(|ends| ends.map(|k| self.nodes[k])).collect();
        let places = chords.iter().flatten().map(|x| x[across]);
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let step = (high - low) / SLICES as f64;
        let slices: Vec<[f64; 2]> = (0..SLICES)
            .map(|k| {
                let at = low + step * (k as f64 + 0.5);
                [at, width(&chords, across, at)]
            })
            .collect();
        let area = step * slices.iter().map(|[_, b]| b).sum::<f64>();
        let centre = step * slices.iter().map(|[at, b]| at * b).sum::<f64>() / area;
        let inertia = step * slices.iter().map(|[at, b]| (at - centre).powi(2) * b).sum::<f64>();
        let (mut beyond, mut sheared) = (0.0, 0.0);
        for [at, b] in slices.into_iter().rev().filter(|[_, b]| *b > 0.0) {
            beyond += step * (at - centre) * b;
            sheared += step * beyond * beyond / b;
        }
        let ElasticMaterial { young, density, .. } = material;
        let sheared = inertia * inertia / (area * sheared);
        Ok(Beam { young, shear: material.shear(), density, area, inertia, sheared, loss })
    }
}

/// Width of what these chords enclose, m, at a place along r (0) or y (1).
fn width(chords: &[[[f64; 2]; 2]], across: usize, at: f64) -> f64 {
    let mut crossed: Vec<f64> = chords
        .iter()
        .filter(|[p, q]| (p[across] <= at) != (q[across] <= at))
        .map(|[p, q]| p[1 - across] + (at - p[across]) / (q[across] - p[across]) * (q[1 - across] - p[1 - across]))
        .collect();
    crossed.sort_by(f64::total_cmp);
    crossed.chunks_exact(2).map(|ends| ends[1] - ends[0]).sum()
}

#[cfg(test)]
mod tests;
