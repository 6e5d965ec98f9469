//! Dimensions of the built-in rails: what sections, running profiles and the checks of a job are made of.

mod head;
mod r115re;
mod r49e1;
mod r54e1;
mod r54e3;
mod r60e1;
mod r60e2;

pub use head::{Head, HeadPoint, DEEPEST, STEEPEST};
pub use r115re::R115RE;
pub use r49e1::R49E1;
pub use r54e1::R54E1;
pub use r54e3::R54E3;
pub use r60e1::R60E1;
pub use r60e2::R60E2;

/// All of them.
pub static ALL: [&Rail; 6] = [&R49E1, &R54E1, &R54E3, &R60E1, &R60E2, &R115RE];

/// A rail that is symmetric about its middle plane, upright: y to the right of that plane, z up from the underside of
/// the foot.
#[derive(Debug, PartialEq)]
pub struct Rail {
    /// Its name.
    pub name: &'static str,
    /// The running surface.
    pub head: Head,
    /// From the lower corner of the head inwards to the web, mm.
    pub underside: &'static [[f64; 2]],
    /// Down the web, in the middle of its upper and its lower fillet, mm.
    pub web: &'static [[f64; 2]],
    /// Outwards along the upper side of the foot, mm.
    pub foot: &'static [[f64; 2]],
    /// Up the tip of the foot, mm.
    pub tip: &'static [[f64; 2]],
    /// Up the side of the head, from its lower corner to where the last arc begins, mm.
    pub side: &'static [[f64; 2]],
    /// Half width of the web's block on the lines of the mesh, m.
    pub stem: f64,
    /// Published figures.
    pub published: Published,
}

/// Published figures of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Published {
    /// Area, m².
    pub area: f64,
    /// Mass of each metre, kg/m.
    pub mass: f64,
    /// Second moments of area about the lateral axis (bending vertically) and about the vertical axis (bending
    /// laterally), m⁴.
    pub inertia: [f64; 2],
    /// Parts of the area that shear when the rail bends vertically and laterally, where they are published.
    pub sheared: Option<[f64; 2]>,
}
