//! Sections of rails, as a job gives them.

use super::builtin::finer_at;
use super::{Beam, BuiltRail, CrossSection, DrawnSection, Focus, HeadPoint, Measures, Path, SectionContact, Spot};
use crate::fem::ElasticMaterial;
use crate::{Error, Result};
use std::rc::Rc;

/// Steepest surface that a drawn rail is touched on, rad from the upright section: 80 degrees, the steepest contact of
/// a placement.
const STEEPEST: f64 = 1.4;
/// Largest distance of a contact from the running line of a drawing, m.
const OFF: f64 = 10e-3;
/// Places between the contact and the end of the running line where a height is looked for.
const PLACES: usize = 500;
/// Height of the surface beside the running line, where nothing can touch, m.
const BESIDE: f64 = -1.0;
/// Areas of the sections of rails, m²: those of a mine and of a crane have a tenth and twice that of 60E1.
const AREA: [f64; 2] = [5e-4, 3e-2];
/// The groups of a rail: the line that runs, and what lies on the pads.
const HEAD: &str = "head";
const FOOT: &str = "foot";

/// The section of a rail with the contact point at a place of its head.
#[derive(Debug, Clone)]
pub enum PlacedRailSection {
    /// The built-in one.
    Built(BuiltRail),
    /// A drawn one.
    DrawnSection(DrawnRail),
}

impl PlacedRailSection {
    /// The beam that it is, vertically or laterally, of a material with the loss factor `loss`.
    pub fn beam(&self, material: ElasticMaterial, lateral: bool, loss: f64) -> Result<Beam> {
        match self {
            PlacedRailSection::Built(rail) => match rail.beam(material, lateral, loss) {
                Some(beam) => Ok(beam),
                // The part that shears from its own outline, which chords of coarse edges give to some per cent.
                None => {
                    let own = BuiltRail::new(rail.rail(), 0.0)?.for_modes()?.beam(material, lateral, loss)?;
                    let published = rail.rail().published;
                    Ok(Beam { area: published.area, inertia: published.inertia[usize::from(lateral)], ..own })
                }
            },
            PlacedRailSection::DrawnSection(rail) => rail.drawn.beam(material, lateral, loss),
        }
    }

    /// Area, centroid and second moments of the upright section, as the mesh for the modes has them.
    pub fn measures(&self) -> Result<Measures> {
        match self {
            PlacedRailSection::Built(rail) => Ok(BuiltRail::new(rail.rail(), 0.0)?.for_modes()?.measures()),
            PlacedRailSection::DrawnSection(rail) => Ok(rail.drawn.measures()),
        }
    }

    /// The contact point.
    pub fn contact(&self) -> HeadPoint {
        match self {
            PlacedRailSection::Built(rail) => rail.contact(),
            PlacedRailSection::DrawnSection(rail) => rail.contact,
        }
    }

    /// Height of the surface over its tangent at the contact point, m, at the distance `y` from there along the
    /// tangent; 0 there.
    pub fn height(&self, y: f64) -> f64 {
        match self {
            PlacedRailSection::Built(rail) => rail.height(y),
            PlacedRailSection::DrawnSection(rail) => rail.height(y),
        }
    }

    /// The mesh for the modes, in the frame of the surface at the contact point. A drawn one is as it is drawn.
    pub fn for_modes(&self) -> Result<CrossSection> {
        match self {
            PlacedRailSection::Built(rail) => rail.for_modes(),
            PlacedRailSection::DrawnSection(rail) => rail.section(None),
        }
    }

    /// The mesh for loads spread over circles of the radius `radius`, m, and more, in the same frame.
    pub fn for_loads(&self, radius: f64) -> Result<CrossSection> {
        let any = f64::INFINITY;
        match self {
            PlacedRailSection::Built(rail) => rail.for_loads(radius),
            PlacedRailSection::DrawnSection(rail) => {
                rail.section(Some(Focus { size: radius / 3.0, reach: 1.5 * radius, corner: any, largest: any }))
            }
        }
    }
}

impl PlacedRailSection {
    /// Points at which the loads of a contact at another place of the running line act, in the frame of this rail: that
    /// of the surface at its own contact point. Order 1 has the wavenumber 1 over `radius`, m.
    pub(crate) fn contact_at(&self, place: HeadPoint, radius: f64) -> SectionContact {
        let here = self.contact();
        let [z, y] = here.in_surface_frame([place.z, place.y]);
        SectionContact::on(Spot { radius, origin: [z, y], angle: place.angle - here.angle, share: 1.0 })
    }

    /// The mesh for loads at the own contact and at other places of the running line, spread over circles of the radii
    /// `radii`, m, of which the first one is that of the own contact.
    pub(crate) fn for_loads_at(&self, others: &[HeadPoint], radii: &[f64]) -> Result<CrossSection> {
        let section = self.for_loads(radii.first().copied().unwrap_or(f64::INFINITY))?;
        let here = self.contact();
        let radii = &radii[radii.len().min(1)..];
        let spots: Vec<_> = others.iter().zip(radii).map(|(p, &b)| (here.in_surface_frame([p.z, p.y]), b)).collect();
        Ok(finer_at(section, &spots))
    }
}

/// A drawn rail, upright, with the contact point on its running line.
#[derive(Debug, Clone)]
pub struct DrawnRail {
    drawn: Rc<DrawnSection>,
    foot: String,
    contact: HeadPoint,
}

impl DrawnRail {
    /// With the contact at y, m, of the drawing; its curve `foot` lies on the pads.
    pub fn new(drawn: Rc<DrawnSection>, foot: &str, y: f64) -> Result<Self> {
        check(&drawn, foot)?;
        let [first, last] = drawn.reach();
        let Some([z, slope]) = drawn.running(y) else {
            return Err(Error::Job(format!(
                "the contact point on the rail: found y = {y} m, expected a place on the running line of its \
                 section, which reaches from {first} to {last} m"
            )));
        };
        Self::touched(drawn, foot, HeadPoint { y, z, angle: slope.atan() }, crate::rails::STEEPEST)
    }

    /// With the contact at the place of the running line that is nearest to y of the drawing and z over the running
    /// line at y = 0, m.
    pub fn near(drawn: Rc<DrawnSection>, foot: &str, [y, z]: [f64; 2]) -> Result<Self> {
        check(&drawn, foot)?;
        let [first, last] = drawn.reach();
        let Some([crown, _]) = drawn.running(0.0) else {
            return Err(Error::Job(format!(
                "the running line of the section of the rail reaches from {first} to {last} m, expected one \
                 with the middle of the head at x = 0"
            )));
        };
        let contact = drawn.nearest([crown + z, y]);
        let off = (contact.y - y).hypot(contact.z - crown - z);
        if !(off <= OFF) {
            return Err(Error::Job(format!(
                "the contact point on the rail: found y = {y:.4} m and z = {z:.4} m over the middle of the \
                 head, {:.1} mm off the running line of its \
                 section, expected at most {:.0} mm; the running line reaches from {first} to {last} m: move \
                 the wheel, or draw the section that the \
                 profile is of",
                1e3 * off,
                1e3 * OFF
            )));
        }
        Self::touched(drawn, foot, contact, STEEPEST)
    }

    fn touched(drawn: Rc<DrawnSection>, foot: &str, contact: HeadPoint, steepest: f64) -> Result<Self> {
        if contact.angle.abs() > steepest {
            return Err(Error::Job(format!(
                "the contact point on the rail: found y = {:.4} m, where the running line of its section is \
                 {:.0} degrees steep, expected {:.0} at the most",
                contact.y,
                contact.angle.abs().to_degrees(),
                steepest.to_degrees()
            )));
        }
        Ok(Self { drawn, foot: foot.into(), contact })
    }

    /// A place of the running line, y of the drawing in m, in the frame of the contact: (z, y), m.
    fn seen(&self, y: f64) -> [f64; 2] {
        self.drawn.running(y).map_or([BESIDE, y], |[z, _]| self.contact.in_surface_frame([z, y]))
    }

    fn height(&self, y: f64) -> f64 {
        let [first, last] = self.drawn.reach();
        let end = if y < 0.0 { first } else { last };
        // Along the tangent the distance grows up to where the surface is upright on it.
        let part = |k: usize| self.contact.y + (end - self.contact.y) * k as f64 / PLACES as f64;
        let away = |k: usize| self.seen(part(k))[1] * y.signum();
        let grows = |k: &usize| away(*k) > away(*k - 1);
        let Some(beyond) = (1..=PLACES).take_while(grows).find(|&k| away(k) >= y.abs()) else { return BESIDE };
        let (mut near, mut far) = (part(beyond - 1), part(beyond));
        // To rounding.
        for _ in 0..60 {
            let middle = 0.5 * (near + far);
            if self.seen(middle)[1].abs() < y.abs() {
                near = middle;
            } else {
                far = middle;
            }
        }
        self.seen(0.5 * (near + far))[0]
    }

    /// The section in the frame of the contact, finer there if asked for, with the groups of a rail.
    fn section(&self, focus: Option<Focus>) -> Result<CrossSection> {
        let mut section = self.drawn.in_frame(&self.contact, focus)?;
        let foot = section.groups.remove(&self.foot).unwrap_or_default();
        let mut head: Vec<usize> = section.tread.iter().flatten().copied().collect();
        head.sort_unstable();
        head.dedup();
        section.groups = [(FOOT.to_string(), foot), (HEAD.to_string(), head)].into();
        section.check(Path::Line(1.0))?;
        Ok(section)
    }
}

/// An error where a drawing is no section of a rail with the curve `foot`.
fn check(drawn: &DrawnSection, foot: &str) -> Result<()> {
    if !drawn.groups().any(|name| name == foot) {
        let there: Vec<&str> = drawn.groups().collect();
        return Err(Error::Input(format!(
            "there is no physical curve {foot:?}, which lies on the pads; beside the running line the drawing has {}",
            if there.is_empty() { "none".into() } else { there.join(", ") }
        )));
    }
    let area = drawn.area();
    if !(AREA[0]..=AREA[1]).contains(&area) {
        return Err(Error::Job(format!(
            "the section has an area of {area:.3e} m², expected that of a rail, {:.0e} to {:.0e} m²; give the \
             unit of the drawing (section.file.scale)",
            AREA[0], AREA[1]
        )));
    }
    Ok(())
}
