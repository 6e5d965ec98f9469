//! Contacts of a body: their grids, frames and places.

/// Contact of a body: the lines of its grid, the frame of its rows, and its place, of the type `P`, on the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSpec<'a, P> {
    /// Lines of the contact grid along x and y, m.
    pub lines: [&'a [f64]; 2],
    /// Angle of the frame of the contact about x, rad: of a body of revolution against that of the axle, as
    /// [`rotate_loads`](crate::swept::rotate_loads) has it; of a rail against the upright section.
    pub tilt: f64,
    /// Place on the section; none: the contact point of the section itself.
    pub place: Option<P>,
    /// Place along the path of the section: angle about the axle, rad, or distance x along a rail, m.
    pub along: f64,
}

impl<'a, P> ContactSpec<'a, P> {
    /// Contact at the contact point of a section, in a frame of the angle `tilt`, rad.
    pub fn own(lines: [&'a [f64]; 2], tilt: f64) -> Self {
        Self { lines, tilt, place: None, along: 0.0 }
    }
}
