//! The benchmark wheel W920S.
//!
//! Its tread is a cylinder and the face of its flange a plane, with a sharp corner between them. With a running profile the
//! section stands in for the stiffness of a wheel whose flange root is round: what the corner lacks is the root of the
//! profile. A contact on the root, at the height h above the running circle, shares its loads between a spot on the tread
//! and one on the face of the flange, both away from the corner, such that the loads act near their true radius:
//! the face has none of them up to h = 3 mm and all of them from 12 mm on, linearly between. Force and moment then are
//! those at the contact within 3 mm, and all depends continuously on its place.

use super::builtin::Lines;
use super::{Focus, Path, Section, SectionContact, Spot};
use crate::{Error, Result};
use std::f64::consts::PI;

/// Radii of bore, hub, web, tread and flange, m.
const BORE: f64 = 0.095;
const HUB: f64 = 0.135;
const WEB: f64 = 0.390;
const TREAD: f64 = 0.460;
const FLANGE: f64 = 0.488;
/// Ends of hub, rim, web and flange along the axle, m.
const Y: [f64; 7] = [-0.090, -0.065, -0.012, 0.012, 0.040, 0.070, 0.090];
const FIELD: f64 = Y[1];
const FACE: f64 = Y[4];

/// Heights of a contact between which its loads go over from the tread to the face of the flange, m.
const ROOT: [f64; 2] = [0.003, 0.012];
/// Distance of a spot from the corner between tread and flange, m, and of one from the other edges.
const FROM_CORNER: f64 = 0.010;
const FROM_EDGE: f64 = 0.008;
/// Greatest height of a contact on the face of the flange, m: the tip of S1002 is 28 mm high.
const HIGHEST: f64 = 0.024;

/// W920S with its contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct W920S {
    /// Distance of the contact from the middle of the web towards the flange, m.
    pub offset: f64,
    /// Height of the contact above the running circle of a profile, away from the axle, m; none of a contact on the tread of the section itself.
    pub height: Option<f64>,
    /// Whether the flange lies at negative y, as that of a right-hand wheel does.
    pub mirrored: bool,
}

impl W920S {
    /// With the contact on its own tread.
    pub fn on_tread(offset: f64) -> Self {
        Self { offset, height: None, mirrored: false }
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
        SectionContact::shared(vec![spot(tread, 0.0, 1.0 - share), spot(face, 0.5 * PI, share)])
    }

    /// Part of the loads that the face of the flange carries.
    pub fn face_share(&self) -> f64 {
        match self.height {
            Some(h) if self.offset > 0.0 => ((h - ROOT[0]) / (ROOT[1] - ROOT[0])).clamp(0.0, 1.0),
            _ => 0.0,
        }
    }

    /// Places (r, y) of the spots on tread and face, m, y from the middle of the web.
    fn spots(&self) -> [[f64; 2]; 2] {
        let Some(height) = self.height else { return [[TREAD, self.offset], [TREAD + ROOT[1], FACE]] };
        let least = FIELD + FROM_EDGE;
        // As far from the corner as the profile rises.
        let most = FACE - FROM_CORNER * (height / ROOT[0]).clamp(0.0, 1.0);
        let radius = (TREAD + height).clamp(TREAD + ROOT[1], FLANGE - FROM_EDGE);
        [[TREAD, self.offset.clamp(least, most)], [radius, FACE]]
    }

    /// The section, y = 0 at the contact; an error where nothing of it can be touched.
    pub(super) fn section(&self, focus: Focus) -> Result<Section> {
        let wrong = match self.height {
            None => !(FIELD < self.offset && self.offset < FACE),
            Some(height) => !(FIELD < self.offset && self.offset < Y[5] && height < HIGHEST),
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
                "{found}, expected a place on the tread of W920S, which reaches from {FIELD} to {FACE} m, or with a running profile one on the face of its \
                 flange up to {} mm above the running circle",
                1e3 * HIGHEST
            )));
        }
        let carry = self.spots().into_iter().zip([self.face_share() < 1.0, self.face_share() > 0.0]);
        let at: Vec<[f64; 2]> = carry.filter(|(_, loaded)| *loaded).map(|(at, _)| at).collect();
        let section = made(self.offset, &at, focus);
        section.check(Path::Axle)?;
        Ok(if self.mirrored { section.mirrored() } else { section })
    }
}

/// The benchmark wheel W920S: a bore of radius 95 mm, a hub, a straight web, a rim whose tread has the radius 460 mm, a flange. Its group `inner` is
/// the bore. The contact point lies `contact_offset`, m, from the middle of the web towards the flange.
pub fn w920s(contact_offset: f64, focus: Focus) -> Result<Section> {
    W920S::on_tread(contact_offset).section(focus)
}

/// The section with y = 0 at `offset`, m, small elements at the places `at`, (r, y) from the middle of the web. Tread and face of the flange run.
fn made(offset: f64, at: &[[f64; 2]], focus: Focus) -> Section {
    let radii: Vec<f64> = at.iter().map(|x| x[0]).collect();
    let places: Vec<f64> = at.iter().map(|x| x[1] - offset).collect();
    let r = focus.lines(&[BORE, HUB, WEB, TREAD, FLANGE], &radii, &[HUB, WEB]);
    let across = Y.map(|y| y - offset);
    let y = focus.lines(&across, &places, &across[2..4]);
    let inside = |r: f64, y: f64| {
        let y = y + offset;
        match r {
            r if r < HUB => true,
            r if r < WEB => Y[2] < y && y < Y[3],
            r if r < TREAD => Y[1] < y && y < Y[5],
            _ => Y[4] < y && y < Y[5],
        }
    };
    let lines = Lines { r: &r, y: &y };
    let face = |r: f64, y: f64| r > TREAD && y == across[4];
    let mut section = lines.section_with_face(inside, |at| at, |r, _| r == TREAD, face);
    section.groups.retain(|name, _| name == "inner");
    section
}
