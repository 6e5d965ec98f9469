//! Wheel sections by their main dimensions, among them the benchmark wheel W920S.
//!
//! The tread is a cylinder and the face of the flange a plane, with a sharp corner between them. With a running profile
//! the section stands in for the stiffness of a wheel whose flange root is round: what the corner lacks is the root of
//! the profile. A contact on the root, at the height h above the running circle, shares its loads between a spot on the
//! tread and one on the face of the flange, both away from the corner, such that the loads act near their true radius:
//! the face has none of them up to h = 3 mm and all of them from 12 mm on, linearly between. Force and moment then are
//! those at the contact within 3 mm, and all depends continuously on its place.

use super::builtin::SectionLines;
use super::refine::refined;
use super::wheelset::{self, SolidAxle};
use super::{CrossSection, Focus, Path, RunningPlace, SectionContact, SectionLayer, Spot};
use crate::{Error, Result};
use std::f64::consts::PI;

/// Main dimensions of a wheel, m; y along the axle from the running circle to the flange.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelShape {
    /// Name in messages.
    pub name: &'static str,
    /// Name of the group of the bore.
    pub bore_group: &'static str,
    /// Radii of bore, hub, inner side of the rim, tread and tip of the flange.
    pub radii: [f64; 5],
    /// Ends of the hub.
    pub hub: [f64; 2],
    /// Thickness of the web, and y of its middle at the rim and at the hub, between which it is an S.
    pub web: [f64; 3],
    /// y of the field side of the rim, of the face and of the back of the flange.
    pub rim: [f64; 3],
    /// Ring of another material between two radii of the rim.
    pub layer: Option<(SectionLayer, [f64; 2])>,
    /// Solid axle with an equal wheel at its other end.
    pub axle: Option<&'static SolidAxle>,
}

impl WheelShape {
    /// The benchmark wheel.
    pub(crate) fn w920s() -> Self {
        Self {
            name: "W920S",
            bore_group: "inner",
            radii: [0.095, 0.135, 0.390, 0.460, 0.488],
            hub: [-0.090, 0.090],
            web: [0.024, 0.0, 0.0],
            rim: [-0.065, 0.040, 0.070],
            layer: None,
            axle: None,
        }
    }

    fn tread(&self) -> f64 {
        self.radii[3]
    }

    /// Re-entrant corners (r, y) of the web at the hub and at the rim, m.
    fn corners(&self) -> [[f64; 2]; 4] {
        let [thickness, at_rim, at_hub] = self.web;
        let [_, hub, rim, ..] = self.radii;
        let half = 0.5 * thickness;
        [[hub, at_hub - half], [hub, at_hub + half], [rim, at_rim - half], [rim, at_rim + half]]
    }

    /// Place (r, y) on the inner side of the rim, halfway between the web and the field side, m.
    pub(crate) fn inside_of_rim(&self) -> [f64; 2] {
        let [thickness, at_rim, _] = self.web;
        [self.radii[2], 0.5 * (self.rim[0] + at_rim - 0.5 * thickness)]
    }

    /// Place (r, y) in the middle of the web, halfway between hub and rim, m.
    pub(crate) fn middle_of_web(&self) -> [f64; 2] {
        self.place([0.5 * (self.radii[1] + self.radii[2]), self.web[1]])
    }

    /// Place (r, y) of a point of the straight wheel: the web becomes an S, and the hub follows it between its ends.
    fn place(&self, [r, y]: [f64; 2]) -> [f64; 2] {
        let [thickness, at_rim, at_hub] = self.web;
        let [_, hub, rim, ..] = self.radii;
        let shift = at_hub - at_rim;
        let ends = [at_rim - 0.5 * thickness, at_rim + 0.5 * thickness];
        let part = ((rim - r) / (rim - hub)).clamp(0.0, 1.0);
        let blend = part * part * (3.0 - 2.0 * part);
        // In the web all of the shift, in the hub what its distance from the ends leaves; the rim stays.
        let across = match () {
            _ if r > hub || (ends[0] <= y && y <= ends[1]) => 1.0,
            _ if y < ends[0] => (y - self.hub[0]) / (ends[0] - self.hub[0]),
            _ => (self.hub[1] - y) / (self.hub[1] - ends[1]),
        };
        [r, y + shift * blend * across]
    }
}

/// Heights of a contact between which its loads go over from the tread to the face of the flange, m.
const ROOT: [f64; 2] = [0.003, 0.012];
/// Distance of a spot from the corner between tread and flange, m, and of one from the other edges.
const FROM_CORNER: f64 = 0.010;
const FROM_EDGE: f64 = 0.008;
/// Distance of the highest contact on the face of the flange from the tip of the flange, m.
const BELOW_TIP: f64 = 0.004;
/// Edge length at the re-entrant corners of the web, m. It grows with the distance from the corner, up to the distance
/// given second, m. Stresses are singular there; with edges of 3 mm frequencies up to 6 kHz would be 0.05 to 0.4 % too
/// high, so they are up to 0.07 %.
const AT_CORNERS: [f64; 2] = [0.0003, 0.004];
/// Breaks of a section nearer than this are one, m.
const SAME: f64 = 1e-6;

/// Wheel section with the place of its contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Wheel {
    /// Its shape.
    pub shape: WheelShape,
    /// y of the contact, m.
    pub offset: f64,
    /// Height of the contact above the running circle of a profile, away from the axle, m; none of a contact on the
    /// tread of the section itself.
    pub height: Option<f64>,
    /// True if the flange lies at negative y, as that of a right-hand wheel does.
    pub mirrored: bool,
}

impl Wheel {
    /// W920S with the contact on its own tread.
    pub(crate) fn w920s(offset: f64) -> Self {
        Self { shape: WheelShape::w920s(), offset, height: None, mirrored: false }
    }

    /// The wheel with its contact at another place: of a wheelset the one that has this place.
    pub(super) fn touched_at(&self, place: RunningPlace) -> Self {
        let mirrored = self.mirrored != place.opposite;
        Self { shape: self.shape.clone(), offset: place.y, height: place.height, mirrored }
    }

    /// Spots of tread and flange that carry the loads.
    pub fn contact(&self) -> SectionContact {
        let [tread, face] = self.spots();
        let sign = if self.mirrored { -1.0 } else { 1.0 };
        let spot = |[radius, y]: [f64; 2], angle: f64, share: f64| Spot {
            radius,
            origin: [radius, sign * (y - self.offset)],
            angle: sign * angle,
            share,
        };
        let share = self.face_share();
        let touched = [self.shape.tread() + self.height.unwrap_or(0.0), 0.0];
        SectionContact::shared(vec![spot(tread, 0.0, 1.0 - share), spot(face, 0.5 * PI, share)], touched)
    }

    /// Part of the loads that the face of the flange carries.
    pub(crate) fn face_share(&self) -> f64 {
        match self.height {
            Some(h) if self.offset > 0.0 => ((h - ROOT[0]) / (ROOT[1] - ROOT[0])).clamp(0.0, 1.0),
            _ => 0.0,
        }
    }

    /// Places (r, y) of the spots on tread and face, m, y from the middle of the web.
    fn spots(&self) -> [[f64; 2]; 2] {
        let [field, face, _] = self.shape.rim;
        let (tread, flange) = (self.shape.tread(), self.shape.radii[4]);
        let Some(height) = self.height else { return [[tread, self.offset], [tread + ROOT[1], face]] };
        let least = field + FROM_EDGE;
        // As far from the corner as the profile rises.
        let most = face - FROM_CORNER * (height / ROOT[0]).clamp(0.0, 1.0);
        let radius = (tread + height).clamp(tread + ROOT[1], flange - FROM_EDGE);
        [[tread, self.offset.clamp(least, most)], [radius, face]]
    }

    /// An error where nothing of the section can be touched at the contact.
    pub(super) fn refuse_untouchable(&self) -> Result<()> {
        let [field, face, back] = self.shape.rim;
        let highest = self.shape.radii[4] - self.shape.tread() - BELOW_TIP;
        let wrong = match self.height {
            None => !(field < self.offset && self.offset < face),
            Some(height) => !(field < self.offset && self.offset < back && height < highest),
        };
        if wrong {
            let found = match self.height {
                None => format!("contact_offset: found {} m", self.offset),
                Some(h) => format!(
                    "the contact: found y = {:.2} mm of the section, {:.2} mm above the running circle",
                    1e3 * self.offset,
                    1e3 * h
                ),
            };
            return Err(Error::Job(format!(
                "{found}, expected a place on the tread of {}, which reaches from {field:.3} to {face:.3} m, or with a \
                 running profile one on the face of its flange up to {:.0} mm above the running circle",
                self.shape.name,
                1e3 * highest
            )));
        }
        Ok(())
    }

    /// The section, y = 0 at the contact; an error where nothing of it can be touched.
    pub(super) fn section(&self, focus: Focus) -> Result<CrossSection> {
        self.section_with(focus, None)
    }

    /// Places (r, y) of the spots that carry a part of the loads, m, y from the middle of the web.
    fn loaded_places(&self) -> Vec<[f64; 2]> {
        let carry = self.spots().into_iter().zip([self.face_share() < 1.0, self.face_share() > 0.0]);
        carry.filter(|(_, loaded)| *loaded).map(|(at, _)| at).collect()
    }

    /// The same of a wheelset whose other wheel has a contact as well, and small elements there.
    pub(super) fn section_with(&self, focus: Focus, opposite: Option<(&Wheel, Focus)>) -> Result<CrossSection> {
        self.refuse_untouchable()?;
        opposite.map_or(Ok(()), |(wheel, _)| wheel.refuse_untouchable())?;
        let at = self.loaded_places();
        let section = match &self.shape.axle {
            Some(axle) => {
                let (far, coarse) =
                    opposite.map_or((Vec::new(), focus), |(wheel, focus)| (wheel.loaded_places(), focus));
                wheelset::made((&self.shape, axle), self.offset, [(&at, focus), (&far, coarse)])
            }
            None => half(&self.shape, self.offset, &at, focus),
        };
        section.check(Path::Axle)?;
        Ok(if self.mirrored { section.mirrored() } else { section })
    }
}

/// The benchmark wheel W920S: a bore of radius 95 mm, a hub, a straight web, a rim whose tread has the radius 460 mm, a
/// flange. Its group `inner` is the bore. The contact point lies `contact_offset`, m, from the middle of the web
/// towards the flange.
#[cfg(test)]
pub(crate) fn w920s(contact_offset: f64, focus: Focus) -> Result<CrossSection> {
    Wheel::w920s(contact_offset).section(focus)
}

/// The section with short edges at the re-entrant corners of the web, see [`AT_CORNERS`].
fn finer_at_corners(section: CrossSection, shape: &WheelShape, offset: f64) -> CrossSection {
    let corners = shape.corners().map(|[r, y]| [r, y - offset]);
    let [finest, reach] = AT_CORNERS;
    refined(section, |[r, y]| {
        let distance = corners.iter().map(|c| (r - c[0]).hypot(y - c[1])).fold(f64::INFINITY, f64::min);
        if distance < reach {
            finest + distance
        } else {
            f64::INFINITY
        }
    })
}

/// Section of the wheel of a shape, with its half of the axle where it has one, and short edges at the corners of the
/// web; y = 0 at `offset`, m, small elements at the places `at`, (r, y).
pub(super) fn half(shape: &WheelShape, offset: f64, at: &[[f64; 2]], focus: Focus) -> CrossSection {
    finer_at_corners(made(shape, offset, at, focus), shape, offset)
}

/// Section of a shape with y = 0 at `offset`, m, and small elements at the places `at`, (r, y). The running line is the
/// tread and the face of the flange.
fn made(shape: &WheelShape, offset: f64, at: &[[f64; 2]], focus: Focus) -> CrossSection {
    let [bore, hub, rim, tread, flange] = shape.radii;
    let [thickness, middle, _] = shape.web;
    let [field, face, back] = shape.rim;
    let web = [middle - 0.5 * thickness, middle + 0.5 * thickness];
    let radii: Vec<f64> = at.iter().map(|x| x[0]).collect();
    let places: Vec<f64> = at.iter().map(|x| x[1] - offset).collect();
    let mut breaks = vec![bore, hub, rim, tread, flange];
    if let Some((_, [from, to])) = &shape.layer {
        breaks.extend([*from, 0.5 * (from + to), *to]);
    }
    let mut across: Vec<f64> = [shape.hub[0], field, web[0], web[1], face, back, shape.hub[1]].to_vec();
    for lines in [&mut breaks, &mut across] {
        lines.sort_by(f64::total_cmp);
        lines.dedup_by(|b, a| *b - *a < SAME);
    }
    let across: Vec<f64> = across.into_iter().map(|y| y - offset).collect();
    let mut r = focus.lines(&breaks, &radii, &[hub, rim]);
    // Shear waves of a soft layer are short: its elements are about square.
    let largest = shape.layer.as_ref().map_or(focus.largest, |(_, [from, to])| focus.largest.min(0.5 * (to - from)));
    let mut y = Focus { largest, ..focus }.lines(&across, &places, &web.map(|y| y - offset));
    if let Some(axle) = &shape.axle {
        axle.extend(&mut r, &mut y, offset);
    }
    let inside = |r: f64, y: f64| {
        let y = y + offset;
        match r {
            r if r < bore => shape.axle.is_none_or(|axle| axle.holds(shape.hub, [r, y])),
            r if r < hub => shape.hub[0] < y && y < shape.hub[1],
            r if r < rim => web[0] < y && y < web[1],
            r if r < tread => field < y && y < back,
            _ => face < y && y < back,
        }
    };
    let straight = shape.web[1] == shape.web[2];
    let place = |[r, y]: [f64; 2]| match straight {
        true => [r, y],
        false => {
            let [r, y] = shape.place([r, y + offset]);
            [r, y - offset]
        }
    };
    let lines = SectionLines { r: &r, y: &y };
    let on_tread = |r: f64, _: f64| (r - tread).abs() < SAME;
    let on_face = |r: f64, y: f64| r > tread && (y + offset - face).abs() < SAME;
    let mut section = lines.section_with_face(inside, place, on_tread, on_face);
    let bore = section.groups.remove("inner").unwrap_or_default();
    section.groups = [(shape.bore_group.to_owned(), bore)].into();
    if let Some((layer, [from, to])) = &shape.layer {
        section.layers.push(layer.clone());
        for element in &mut section.elements {
            let middle = section.nodes[element.nodes[8]][0];
            element.layer = usize::from(*from < middle && middle < *to);
        }
    }
    section
}
