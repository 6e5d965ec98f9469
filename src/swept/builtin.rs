//! Built-in sections: structured 9-node quadrilaterals, small at the contact point and large far away.

use super::refine::refined;
use super::wheel::Wheel;
use super::{Attachment, Bearing, CrossSection, DrawnSection, NearestPlace, Path, SectionCell, SectionContact};
use super::{SectionElement, Spot};
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Sizes of elements: small around the contact point and around corners, growing away from them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Focus {
    /// Edge length at the contact, m.
    pub size: f64,
    /// Distance from the contact point up to which it is kept, m.
    pub reach: f64,
    /// Edge length at clamped edges and re-entrant corners, where stresses are singular, m.
    pub corner: f64,
    /// Largest edge length, m.
    pub largest: f64,
}

/// Growth of the edge length with each metre.
const GROWTH: f64 = 0.45;
/// Parts of a stretch over which sizes are summed.
const PARTS: usize = 512;

impl Focus {
    /// Edge length at a distance from the contact point, m.
    pub(super) fn near(&self, distance: f64) -> f64 {
        (self.size + GROWTH * (distance - self.reach).max(0.0)).min(self.largest)
    }

    /// Lines from the first to the last of `breaks`, m, all of which are lines; `at` are the places of the contact,
    /// `corners` those of singular stresses.
    pub(super) fn lines(&self, breaks: &[f64], at: &[f64], corners: &[f64]) -> Vec<f64> {
        let size = |x: f64| {
            let contact = at.iter().map(|a| self.near((x - a).abs())).fold(f64::INFINITY, f64::min);
            let corner = corners.iter().map(|c| self.corner + GROWTH * (x - c).abs());
            corner.fold(contact, f64::min).min(self.largest)
        };
        let mut lines = vec![breaks[0]];
        for pair in breaks.windows(2) {
            let step = (pair[1] - pair[0]) / PARTS as f64;
            // Elements up to each place, had they just the size that is wanted there.
            let mut count = vec![0.0];
            for k in 0..PARTS {
                count.push(count[k] + step / size(pair[0] + step * (k as f64 + 0.5)));
            }
            let elements = count[PARTS].ceil().max(1.0);
            let mut k = 0;
            for line in 1..elements as usize {
                let wanted = count[PARTS] * line as f64 / elements;
                while count[k + 1] < wanted {
                    k += 1;
                }
                lines.push(pair[0] + step * (k as f64 + (wanted - count[k]) / (count[k + 1] - count[k])));
            }
            lines.push(pair[1]);
        }
        lines
    }
}

/// A structured section on lines of r and y.
pub(super) struct SectionLines<'a> {
    pub r: &'a [f64],
    pub y: &'a [f64],
}

impl SectionLines<'_> {
    /// The section of the cells for whose centre `inside` holds, its nodes at `place` of those of the lines. `tread`
    /// says which upper edges are of the running line, given the radius and the y of their middle.
    pub(super) fn section(
        &self,
        inside: impl Fn(f64, f64) -> bool,
        place: impl Fn([f64; 2]) -> [f64; 2],
        tread: impl Fn(f64, f64) -> bool,
    ) -> CrossSection {
        self.section_with_face(inside, place, tread, |_, _| false)
    }

    /// The same with edges that face −y in the running line, for which `face` holds at the radius of their middle and
    /// their y.
    pub(super) fn section_with_face(
        &self,
        inside: impl Fn(f64, f64) -> bool,
        place: impl Fn([f64; 2]) -> [f64; 2],
        tread: impl Fn(f64, f64) -> bool,
        face: impl Fn(f64, f64) -> bool,
    ) -> CrossSection {
        let (cells_r, cells_y) = (self.r.len() - 1, self.y.len() - 1);
        let at = |lines: &[f64], k: usize| match k % 2 {
            0 => lines[k / 2],
            _ => 0.5 * (lines[k / 2] + lines[k / 2 + 1]),
        };
        let mut section = CrossSection::default();
        let mut number = BTreeMap::new();
        let mut node = |section: &mut CrossSection, i: usize, j: usize| {
            *number.entry((j, i)).or_insert_with(|| {
                section.nodes.push(place([at(self.r, i), at(self.y, j)]));
                section.nodes.len() - 1
            })
        };
        for j in 0..cells_y {
            for i in 0..cells_r {
                if !inside(at(self.r, 2 * i + 1), at(self.y, 2 * j + 1)) {
                    continue;
                }
                let of = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1], [1, 1]];
                let nodes: Vec<usize> = of.iter().map(|[a, b]| node(&mut section, 2 * i + a, 2 * j + b)).collect();
                let middle = at(self.y, 2 * j + 1);
                let open = i + 1 == cells_r || !inside(at(self.r, 2 * i + 3), middle);
                if open && tread(self.r[i + 1], middle) {
                    section.tread.push([nodes[1], nodes[2], nodes[5]]);
                }
                let radius = at(self.r, 2 * i + 1);
                let bare = j == 0 || !inside(radius, at(self.y, 2 * j - 1));
                if bare && face(radius, self.y[j]) {
                    section.tread.push([nodes[0], nodes[1], nodes[4]]);
                }
                section.elements.push(SectionElement { kind: SectionCell::Quad9, nodes, layer: 0 });
            }
        }
        let mut group = |name: &str, i: Option<usize>, j: Option<usize>| {
            let on = number.iter().filter(|((b, a), _)| i.is_none_or(|i| i == *a) && j.is_none_or(|j| j == *b));
            let mut nodes: Vec<usize> = on.map(|(_, &k)| k).collect();
            nodes.sort_unstable();
            section.groups.insert(name.into(), nodes);
        };
        group("inner", Some(0), None);
        group("outer", Some(2 * cells_r), None);
        group("side_minus", None, Some(0));
        group("side_plus", None, Some(2 * cells_y));
        section
    }
}

/// A section as a job gives it.
#[derive(Debug, Clone, PartialEq)]
pub enum SectionSource {
    /// An annular cylinder.
    Cylinder(CylinderSection),
    /// A wheel by its main dimensions.
    Wheel(Wheel),
    /// A drawn one.
    DrawnSection {
        /// The drawing.
        drawn: Rc<DrawnSection>,
        /// y of the contact point in the drawing, m.
        offset: f64,
        /// True if it is seen from the other side.
        mirrored: bool,
    },
}

/// Place of a contact on the running line of a section, in the coordinates of its dimensions or of its drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunningPlace {
    /// y, m: of a wheel from the middle of the web to the flange, of a cylinder from its mid-plane.
    pub y: f64,
    /// Height above the running circle of a profile, away from the axle, m; none of a contact on the tread of a wheel
    /// by its dimensions.
    pub height: Option<f64>,
    /// True if it is on the other wheel of a wheelset, and `y` counts from the middle of the web of that one to its
    /// flange.
    pub opposite: bool,
}

/// Distance from a section within which an attachment is taken to be on it, m.
const BESIDE: f64 = 0.002;
/// The same of a point at which a shape was measured, which is found with a tape measure.
const BESIDE_MEASURED: f64 = 0.01;

/// Edge lengths at corners and at the most, over the smaller one of width and depth of an annular cylinder.
const PARTS_OF_A_CYLINDER: [f64; 2] = [0.03, 0.3];
/// Edge lengths of the wheel, m.
const PARTS_OF_THE_WHEEL: [f64; 2] = [0.003, 0.02];

impl SectionSource {
    /// Rolling radius, m.
    pub fn radius(&self) -> f64 {
        match self {
            SectionSource::Cylinder(c) => c.outer_radius,
            SectionSource::Wheel(wheel) => wheel.contact().radius(),
            SectionSource::DrawnSection { drawn, offset, .. } => drawn.running(*offset).map_or(0.0, |[r, _]| r),
        }
    }

    /// Points at which the loads of the contact act on the section.
    pub fn contact(&self) -> SectionContact {
        match self {
            SectionSource::Cylinder(_) => SectionContact::level(self.radius()),
            SectionSource::Wheel(wheel) => wheel.contact(),
            SectionSource::DrawnSection { drawn, offset, mirrored } => {
                let [radius, slope] = drawn.running(*offset).unwrap_or_default();
                let angle = if *mirrored { -slope.atan() } else { slope.atan() };
                SectionContact::on(Spot { radius, origin: [radius, 0.0], angle, share: 1.0 })
            }
        }
    }

    /// Points at which the loads of another contact act, in the frame of this section, y = 0 at its own contact.
    pub(crate) fn contact_at(&self, place: RunningPlace) -> SectionContact {
        let (offset, mirrored) = self.frame();
        let beyond = if mirrored { offset - place.y } else { place.y - offset };
        match self {
            SectionSource::Cylinder(c) => {
                let radius = c.outer_radius - c.drop(beyond);
                let slope = c.crown_radius.map_or(0.0, |k| -beyond / (k * k - beyond * beyond).max(0.0).sqrt());
                SectionContact::on(Spot { radius, origin: [radius, beyond], angle: slope.atan(), share: 1.0 })
            }
            SectionSource::Wheel(wheel) => {
                let there = wheel.touched_at(place);
                match &wheel.shape.axle {
                    Some(axle) if place.opposite => {
                        let across = 2.0 * axle.middle - place.y - offset;
                        there.contact().shifted(if mirrored { -across } else { across })
                    }
                    _ => there.contact().shifted(beyond),
                }
            }
            SectionSource::DrawnSection { drawn, mirrored, .. } => {
                let there = |mirrored| {
                    SectionSource::DrawnSection { drawn: Rc::clone(drawn), offset: place.y, mirrored }.contact()
                };
                match drawn.middle() {
                    Some(middle) if place.opposite => {
                        let across = 2.0 * middle - place.y - offset;
                        there(!mirrored).shifted(if *mirrored { -across } else { across })
                    }
                    _ => there(*mirrored).shifted(beyond),
                }
            }
        }
    }

    /// The mesh for loads at the own contact and at other places, spread over circles of the radii `radii`, m, of which
    /// the first one is that of the own contact. Errors: a place where nothing can be touched.
    pub(crate) fn for_loads_at(&self, others: &[RunningPlace], radii: &[f64]) -> Result<CrossSection> {
        let of_loads = |radius: f64| {
            let [corner, largest] = self.sizes();
            Focus { size: radius / 3.0, reach: 1.5 * radius, corner, largest }
        };
        let own = of_loads(radii.first().copied().unwrap_or(f64::INFINITY));
        let mut rest: Vec<(RunningPlace, f64)> =
            others.iter().copied().zip(radii[radii.len().min(1)..].iter().copied()).collect();
        // The other wheel of a wheelset is meshed as the one of the own contact: mirror images stay mirror images.
        let opposite = rest.iter().position(|(place, _)| place.opposite);
        let section = match (self, opposite) {
            (SectionSource::Wheel(wheel), Some(k)) => {
                let (place, radius) = rest.remove(k);
                wheel.section_with(own, Some((&wheel.touched_at(place), of_loads(radius))))?
            }
            _ => self.section(own)?,
        };
        let mut spots = Vec::new();
        for (place, radius) in rest {
            match self {
                SectionSource::Wheel(wheel) => wheel.touched_at(place).refuse_untouchable()?,
                SectionSource::DrawnSection { drawn, .. } => drawn.refuse_beside(place.y)?,
                // A contact beside the tread is found when its loads are laid.
                SectionSource::Cylinder(_) => (),
            }
            spots.extend(self.contact_at(place).spots().map(|spot| (spot.origin, radius)));
        }
        Ok(finer_at(section, &spots))
    }

    /// The mesh for loads on faces: about each of the places (r, y), m, fine enough for a patch of the half width with
    /// it, m.
    pub(crate) fn for_loads_on_faces(&self, places: &[([f64; 2], f64)]) -> Result<CrossSection> {
        Ok(finer_at(self.for_modes()?, places))
    }

    /// y of the contact in the coordinates of the section as a job gives it, m, and true if it is seen from the other
    /// side.
    fn frame(&self) -> (f64, bool) {
        match self {
            SectionSource::Cylinder(c) => (c.contact_offset, false),
            SectionSource::Wheel(wheel) => (wheel.offset, wheel.mirrored),
            SectionSource::DrawnSection { offset, mirrored, .. } => (*offset, *mirrored),
        }
    }

    /// Attachments with the places of a job in the frame of `section`, y = 0 at the contact. An error names one whose
    /// place is beside the section.
    pub fn attached(&self, section: &CrossSection, attachments: &[Attachment]) -> Result<Vec<Attachment>> {
        let (offset, mirrored) = self.frame();
        let turn = |y: f64| if mirrored { -y } else { y };
        let of = |attachment: &Attachment| {
            let [r, y] = attachment.place;
            let place = [r, turn(y - offset)];
            let near = section.nearest(place).filter(|near| near.distance > BESIDE);
            let Some(near) = near else { return Ok(Attachment { place, ..attachment.clone() }) };
            let [along, across] = section.extent();
            let [first, last] = across.map(|y| turn(y) + offset);
            Err(Error::Job(format!(
                "{}.place: found r = {r:.4} m, y = {y:.4} m, which is {:.1} mm beside the section; expected a place \
                 of it within {:.0} mm, the nearest is r = {:.4} m, y = {:.4} m; the section reaches from r = {:.4} \
                 to {:.4} m and from y = {:.4} to {:.4} m",
                attachment.name,
                1e3 * near.distance,
                1e3 * BESIDE,
                near.place[0],
                turn(near.place[1]) + offset,
                along[0],
                along[1],
                first.min(last),
                first.max(last)
            )))
        };
        attachments.iter().map(of).collect()
    }

    /// The place of `section` nearest to a measured point (r, y), m, as a job gives it, and the sign of its y against
    /// that of the job. An error where it is beside the section.
    pub(crate) fn measured_at(&self, section: &CrossSection, [r, y]: [f64; 2]) -> Result<(NearestPlace, f64)> {
        let (offset, mirrored) = self.frame();
        let sign = if mirrored { -1.0 } else { 1.0 };
        let beside = |near: Option<NearestPlace>| {
            let found = near.map_or(String::new(), |near| {
                let [radius, across] = near.place;
                format!(
                    ", {:.0} mm beside the section, of which r = {radius:.4} m, y = {:.4} m is nearest",
                    1e3 * near.distance,
                    sign * across + offset
                )
            });
            Error::Job(format!(
                "found r = {r:.4} m, y = {y:.4} m{found}; expected a point of the body within {:.0} mm",
                1e3 * BESIDE_MEASURED
            ))
        };
        match section.nearest([r, sign * (y - offset)]) {
            Some(near) if near.distance <= BESIDE_MEASURED => Ok((near, sign)),
            near => Err(beside(near)),
        }
    }

    /// y of the middle of a wheelset in the frame of the section, m; none of another body.
    pub fn middle(&self) -> Option<f64> {
        let middle = match self {
            SectionSource::Cylinder(_) => None,
            SectionSource::Wheel(wheel) => wheel.shape.axle.map(|axle| axle.middle),
            SectionSource::DrawnSection { drawn, .. } => drawn.middle(),
        };
        let (offset, mirrored) = self.frame();
        middle.map(|y| if mirrored { offset - y } else { y - offset })
    }

    /// The bearings of a `suspension` on the surface of `section`: their y, counted from the middle of a wheelset to
    /// the right and in a drawing of a whole axle as it counts, becomes a place in the frame of the section.
    pub fn bearings(&self, section: &CrossSection, suspension: &[Bearing]) -> Result<Vec<Bearing>> {
        let (offset, mirrored) = self.frame();
        let of = |bearing: &Bearing| {
            let [_, y] = bearing.place;
            let here = match self.middle() {
                Some(middle) => middle + y,
                None if mirrored => offset - y,
                None => y - offset,
            };
            let Some(radius) = section.outermost(here) else {
                let [first, last] = section.extent()[1].map(|end| y + end - here);
                return Err(Error::Job(format!(
                    "suspension.journals: found y = {y} m, which is beside the section; expected a place between \
                     {first:.4} and {last:.4} m"
                )));
            };
            Ok(Bearing { place: [radius, here], ..*bearing })
        };
        suspension.iter().map(of).collect()
    }

    /// Height of the surface over the contact point at (x, y), m: 0 there, negative elsewhere.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        let drop = match self {
            SectionSource::Cylinder(c) => c.drop(y),
            SectionSource::Wheel(_) => 0.0,
            // Beside the running line nothing can touch.
            SectionSource::DrawnSection { drawn, offset, mirrored } => {
                let at = if *mirrored { offset - y } else { offset + y };
                drawn.running(at).map_or(self.radius(), |[r, _]| self.radius() - r)
            }
        };
        let (radius, here) = (self.radius(), self.radius() - drop);
        (here * here - x * x).max(0.0).sqrt() - radius
    }

    /// The mesh for the modes: waves are long against the contact. A drawn one is as it is drawn.
    pub fn for_modes(&self) -> Result<CrossSection> {
        let [corner, largest] = self.sizes();
        self.section(Focus { size: largest, reach: 0.0, corner, largest })
    }

    /// The mesh for loads spread over circles of the radius `radius`, m, and more.
    pub fn for_loads(&self, radius: f64) -> Result<CrossSection> {
        self.for_loads_at(&[], &[radius])
    }

    /// Edge lengths at corners and at the most, m; a drawing has its own.
    fn sizes(&self) -> [f64; 2] {
        match self {
            SectionSource::Cylinder(c) => {
                PARTS_OF_A_CYLINDER.map(|p| p * c.thickness.min(c.outer_radius - c.inner_radius))
            }
            SectionSource::Wheel(_) => PARTS_OF_THE_WHEEL,
            SectionSource::DrawnSection { .. } => [f64::INFINITY; 2],
        }
    }

    fn section(&self, focus: Focus) -> Result<CrossSection> {
        match self {
            SectionSource::Cylinder(c) => cylinder(c, focus),
            SectionSource::Wheel(wheel) => wheel.section(focus),
            SectionSource::DrawnSection { drawn, offset, mirrored } => {
                drawn.with_contact_at(*offset, *mirrored, &focus)
            }
        }
    }
}

/// The section with the edges that loads on circles about the places `spots`, (r, y), ask for, m; a section that has no
/// longer ones stays.
pub(super) fn finer_at(section: CrossSection, spots: &[([f64; 2], f64)]) -> CrossSection {
    if spots.is_empty() {
        return section;
    }
    let any = f64::INFINITY;
    refined(section, |[r, y]| {
        let wanted = |&([a, b], radius): &([f64; 2], f64)| {
            Focus { size: radius / 3.0, reach: 1.5 * radius, corner: any, largest: any }.near((r - a).hypot(y - b))
        };
        spots.iter().map(wanted).fold(any, f64::min)
    })
}

/// An annular cylinder, crowned or plain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CylinderSection {
    /// Radius of the bore, m.
    pub inner_radius: f64,
    /// Radius at the contact point, m.
    pub outer_radius: f64,
    /// Width along y, m.
    pub thickness: f64,
    /// Transversal radius of the running surface with its apex at the contact point, m; plain without it.
    pub crown_radius: Option<f64>,
    /// Distance of the contact point from the mid-plane, towards +y, m.
    pub contact_offset: f64,
}

impl CylinderSection {
    /// How much smaller than at the contact point the radius is at y, m.
    fn drop(&self, y: f64) -> f64 {
        self.crown_radius.map_or(0.0, |k| k - (k * k - y * y).max(0.0).sqrt())
    }
}

/// The section of an annular cylinder, with the groups `inner`, `outer`, `side_minus`, `side_plus` of the built-in
/// cylinder of three dimensions.
pub fn cylinder(c: &CylinderSection, focus: Focus) -> Result<CrossSection> {
    let half = 0.5 * c.thickness;
    let sides = [-half - c.contact_offset, half - c.contact_offset];
    let r = focus.lines(&[c.inner_radius, c.outer_radius], &[c.outer_radius], &[c.inner_radius]);
    let y = focus.lines(&[sides[0], 0.0, sides[1]], &[0.0], &sides);
    let depth = c.outer_radius - c.inner_radius;
    let place = |[r, y]: [f64; 2]| [c.inner_radius + (r - c.inner_radius) * (1.0 - c.drop(y) / depth), y];
    let section = SectionLines { r: &r, y: &y }.section(|_, _| true, place, |_, _| true);
    section.check(Path::Axle)?;
    Ok(section)
}
