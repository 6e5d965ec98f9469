//! Wheelset: two equal wheels and a solid axle, one body, mirror-symmetric about its middle.
//!
//! Its section stands in the frame of the wheel that carries the contact, y from the running circle to the flange, so
//! that the other wheel lies beyond the middle of the axle. Either half is meshed, with small elements at its contact
//! where it has one; both meet in the nodes of the middle.

use super::face::hanging_together;
use super::wheel::{half, WheelShape};
use super::{CrossSection, Focus, SectionElement};

/// Solid axle of two equal wheels, m: y along the axle as of the wheel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolidAxle {
    /// y of the middle of the wheelset: half the distance of the running circles.
    pub middle: f64,
    /// Radius between the wheels.
    pub radius: f64,
    /// Radius of the journals.
    pub journal: f64,
    /// y of the end of the axle.
    pub end: f64,
    /// y of the middle of the bearing.
    pub bearing: f64,
}

impl SolidAxle {
    /// The axle of the benchmark wheelset: radius 80 mm between the wheels, 95 mm in the wheel seats; journals of the
    /// radius 65 mm up to 1100 mm from the middle, bearings at 1000 mm; running circles 1500 mm apart.
    pub const W920S: Self = Self { middle: 0.75, radius: 0.080, journal: 0.065, end: -0.35, bearing: -0.25 };

    /// Extends the lines along r and y of a wheel, y = 0 at `offset`, to those of its half of the wheelset.
    pub(super) fn extend(&self, r: &mut Vec<f64>, y: &mut Vec<f64>, offset: f64) {
        let focus = Focus { size: LARGEST, reach: 0.0, corner: LARGEST, largest: LARGEST };
        let between = |breaks: &[f64]| focus.lines(breaks, &[], &[]);
        let (Some(&bore), Some(&first), Some(&last)) = (r.first(), y.first(), y.last()) else { return };
        let inside = between(&[0.0, self.journal, self.radius, bore]);
        r.splice(..1, inside);
        let beyond = between(&[last, self.middle - offset]);
        y.extend(&beyond[1..]);
        let before = between(&[self.end - offset, self.bearing - offset, first]);
        y.splice(..1, before);
    }

    /// Returns whether the axle has the place (r, y), m, below the bore of a wheel whose hub has the ends `hub`.
    pub(super) fn holds(&self, [from, to]: [f64; 2], [r, y]: [f64; 2]) -> bool {
        match y {
            y if y < from => r < self.journal && y > self.end,
            y if y < to => true,
            y => r < self.radius && y < self.middle,
        }
    }
}

/// Group of the wheel seats of a wheelset, of both wheels.
pub const SEATS: &str = "seats";
/// Group of its journals.
pub const JOURNALS: &str = "journals";
/// Edge length of the axle, m: waves of its bending are longer than 0.3 m up to 6 kHz.
const LARGEST: f64 = 0.04;
/// Nodes nearer than this are one, m.
pub(super) const SAME: f64 = 1e-7;
/// Nodes nearer to a cut than this lie on it, if it is straight, m.
const STRAIGHT: f64 = 1e-4;

impl WheelShape {
    /// The benchmark wheelset: two wheels W920S with their flanges to the inside.
    pub fn w920s_wheelset() -> Self {
        Self { name: "W920S-wheelset", axle: Some(&SolidAxle::W920S), ..Self::w920s() }
    }
}

/// Places (r, y) of a wheel with small elements, m, y from the middle of its web to its flange, and their sizes.
type Focused<'a> = (&'a [[f64; 2]], Focus);

/// The section of a wheelset of two wheels of one shape on its axle, y = 0 at `offset` of the first one, m, with small
/// elements at the places `at` of the first and of the second wheel.
pub(super) fn made((shape, axle): (&WheelShape, &SolidAxle), offset: f64, at: [Focused; 2]) -> CrossSection {
    let middle = axle.middle - offset;
    let named = |mut section: CrossSection| {
        let pick = |inside: &dyn Fn([f64; 2]) -> bool| -> Vec<usize> {
            let own = |k: &usize| inside([section.nodes[*k][0], section.nodes[*k][1] + offset]);
            (0..section.nodes.len()).filter(own).collect()
        };
        let [from, to] = shape.hub;
        let seats = pick(&|[r, y]| (r - shape.radii[0]).abs() < SAME && from - SAME < y && y < to + SAME);
        let journals = pick(&|[r, y]| (r - axle.journal).abs() < SAME && y < from + SAME);
        section.groups = [(SEATS.to_owned(), seats), (JOURNALS.to_owned(), journals)].into();
        section
    };
    let [near, far] = at.map(|(places, focus)| named(half(shape, offset, places, focus)));
    joined(near, mirrored_about(far, middle), middle)
}

/// The section on the other side of y = `middle`, m.
pub(super) fn mirrored_about(mut section: CrossSection, middle: f64) -> CrossSection {
    section.nodes.iter_mut().for_each(|x| x[1] = 2.0 * middle - x[1]);
    section.elements.iter_mut().for_each(SectionElement::turn);
    section.tread = section.tread.iter().rev().map(|&[first, last, middle]| [last, first, middle]).collect();
    section
}

/// A node (r, y) of a half that was meant to lie on its cut at y = `middle`, m, and does not.
pub(super) fn beside_cut(half: &CrossSection, middle: f64) -> Option<[f64; 2]> {
    half.nodes.iter().find(|x| (SAME..STRAIGHT).contains(&(x[1] - middle).abs())).copied()
}

/// Two halves with the same nodes on y = `middle`, m.
pub(super) fn joined(mut near: CrossSection, far: CrossSection, middle: f64) -> CrossSection {
    let on = |x: &[f64; 2]| (x[1] - middle).abs() < SAME;
    let shared: Vec<usize> = (0..near.nodes.len()).filter(|&k| on(&near.nodes[k])).collect();
    let mut number = Vec::new();
    for node in &far.nodes {
        let same = |k: &&usize| on(node) && (near.nodes[**k][0] - node[0]).abs() < SAME;
        let known = shared.iter().find(same).copied();
        number.push(known.unwrap_or(near.nodes.len()));
        if known.is_none() {
            near.nodes.push(*node);
        }
    }
    for element in far.elements {
        let nodes = element.nodes.iter().map(|&k| number[k]).collect();
        near.elements.push(SectionElement { nodes, ..element });
    }
    near.tread.extend(far.tread.iter().map(|edge| edge.map(|k| number[k])));
    for (name, nodes) in far.groups {
        let group = near.groups.entry(name).or_default();
        group.extend(nodes.iter().map(|&k| number[k]));
        group.sort_unstable();
        group.dedup();
    }
    near
}

impl CrossSection {
    /// Edges of the running line that hang together with the one nearest to `y`, m: those of one wheel.
    pub(crate) fn running_at(&self, y: f64) -> Vec<[usize; 3]> {
        let apart = |edge: &[usize; 3]| {
            let away = |&k: &usize| (self.nodes[k][1] - y).abs();
            edge.iter().map(away).fold(f64::INFINITY, f64::min)
        };
        let Some(nearest) = self.tread.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))) else { return Vec::new() };
        hanging_together(&self.tread, *nearest)
    }

    /// Largest distance from the axle of the section at `y`, m; none beside it.
    pub fn outermost(&self, y: f64) -> Option<f64> {
        let edges = self.elements.iter().flat_map(|e| e.kind.edges().iter().map(|k| k.map(|i| self.nodes[e.nodes[i]])));
        let crossing = |[a, b, _]: [[f64; 2]; 3]| {
            let (low, high) = (a[1].min(b[1]), a[1].max(b[1]));
            if !(low <= y && y <= high) {
                return None;
            }
            let part = if high > low { (y - a[1]) / (b[1] - a[1]) } else { f64::from(u8::from(b[0] > a[0])) };
            Some(a[0] + part * (b[0] - a[0]))
        };
        edges.filter_map(crossing).reduce(f64::max)
    }
}
