//! Sections of rails, as a job gives them.

use super::{Beam, Drawn, Focus, Path, Rail60E1, Section};
use crate::fem::Material;
use crate::{Error, Result};
use std::rc::Rc;

/// Steepest surface that a rail is touched on, rad from the upright section: that of the corners of 60E1.
const STEEPEST: f64 = 0.87;
/// Height of the surface beside the running line, where nothing can touch, m.
const BESIDE: f64 = -1.0;
/// Areas of the sections of rails, m²: those of a mine and of a crane have a tenth and twice that of 60E1.
const AREA: [f64; 2] = [5e-4, 3e-2];
/// The groups of a rail: the line that runs, and what lies on the pads.
const HEAD: &str = "head";
const FOOT: &str = "foot";

/// A place on the head: y to the right and z up, m; angle of the surface, from y to z, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadPoint {
    /// To the right, m.
    pub y: f64,
    /// Up, m.
    pub z: f64,
    /// Of the tangent, from y to z, rad.
    pub angle: f64,
}

impl HeadPoint {
    /// A point (z, y) of the upright section in the frame of the surface here: (z, y), m.
    pub(super) fn seen(&self, [z, y]: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.angle.sin_cos();
        let (y, z) = (y - self.y, z - self.z);
        [c * z - s * y, c * y + s * z]
    }
}

/// The section of a rail with the contact point at a place of its head.
#[derive(Debug, Clone)]
pub enum Rail {
    /// The built-in one.
    Built(Rail60E1),
    /// A drawn one.
    Drawn(DrawnRail),
}

impl Rail {
    /// The beam that it is, vertically or laterally, of a material with the loss factor `loss`.
    pub fn beam(&self, material: Material, lateral: bool, loss: f64) -> Result<Beam> {
        match self {
            Rail::Built(_) => Ok(Rail60E1::beam(material, lateral, loss)),
            Rail::Drawn(rail) => rail.drawn.beam(material, lateral, loss),
        }
    }

    /// The contact point.
    pub fn contact(&self) -> HeadPoint {
        match self {
            Rail::Built(rail) => rail.contact(),
            Rail::Drawn(rail) => rail.contact,
        }
    }

    /// Height of the surface over its tangent at the contact point, m, at the distance `y` from there along the tangent; 0 there.
    pub fn height(&self, y: f64) -> f64 {
        match self {
            Rail::Built(rail) => rail.height(y),
            Rail::Drawn(rail) => rail.height(y),
        }
    }

    /// The mesh for the modes, in the frame of the surface at the contact point. A drawn one is as it is drawn.
    pub fn for_modes(&self) -> Result<Section> {
        match self {
            Rail::Built(rail) => rail.for_modes(),
            Rail::Drawn(rail) => rail.section(None),
        }
    }

    /// The mesh for loads spread over circles of the radius `radius`, m, and more, in the same frame.
    pub fn for_loads(&self, radius: f64) -> Result<Section> {
        let any = f64::INFINITY;
        match self {
            Rail::Built(rail) => rail.for_loads(radius),
            Rail::Drawn(rail) => {
                rail.section(Some(Focus { size: radius / 3.0, reach: 1.5 * radius, corner: any, largest: any }))
            }
        }
    }
}

/// A drawn rail, upright, with the contact point on its running line.
#[derive(Debug, Clone)]
pub struct DrawnRail {
    drawn: Rc<Drawn>,
    foot: String,
    contact: HeadPoint,
}

impl DrawnRail {
    /// With the contact at y, m, of the drawing; its curve `foot` lies on the pads.
    pub fn new(drawn: Rc<Drawn>, foot: &str, y: f64) -> Result<Self> {
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
                "the section has an area of {area:.3e} m², expected that of a rail, {:.0e} to {:.0e} m²; give the unit of the drawing (section.file.scale)",
                AREA[0], AREA[1]
            )));
        }
        let [first, last] = drawn.reach();
        let Some([z, slope]) = drawn.running(y) else {
            return Err(Error::Job(format!(
                "the contact point on the rail: found y = {y} m, expected a place on the running line of its section, which reaches from {first} to {last} m"
            )));
        };
        let angle = slope.atan();
        if angle.abs() > STEEPEST {
            return Err(Error::Job(format!(
                "the contact point on the rail: found y = {y} m, where the running line of its section is {:.0} degrees steep, expected {:.0} at the most",
                angle.abs().to_degrees(),
                STEEPEST.to_degrees()
            )));
        }
        Ok(Self { drawn, foot: foot.into(), contact: HeadPoint { y, z, angle } })
    }

    /// A place of the running line, y of the drawing in m, in the frame of the contact: (z, y), m.
    fn seen(&self, y: f64) -> [f64; 2] {
        self.drawn.running(y).map_or([BESIDE, y], |[z, _]| self.contact.seen([z, y]))
    }

    fn height(&self, y: f64) -> f64 {
        let [mut low, mut high] = self.drawn.reach();
        if !(self.seen(low)[1] <= y && y <= self.seen(high)[1]) {
            return BESIDE;
        }
        // To rounding.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.seen(middle)[1] < y {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.seen(0.5 * (low + high))[0]
    }

    /// The section in the frame of the contact, finer there if asked for, with the groups of a rail.
    fn section(&self, focus: Option<Focus>) -> Result<Section> {
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
