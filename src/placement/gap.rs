//! The gap of the undeformed bodies on a grid, from the profiles.

use super::frame::Frame;
use super::pose::{along, Vector};
use super::profile::Profile;
use super::touch::Pair;
use crate::{Error, Result};

/// Half the extent of a grid over that of the ellipse it is for; and where there are several, whose influence on each
/// other takes the square of their nodes.
const MARGIN: f64 = 1.7;
const TIGHT_MARGIN: f64 = 1.4;

/// Spacings of a grid over the smaller semi-axis.
const SPACINGS: f64 = 8.0;

/// Most lines on either side of the origin: along a contact that is much longer than wide they are further apart.
const LINES: i64 = 48;

/// The gap of two bodies at first touch, along the normal of a frame, on a rectilinear grid in the program's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// Places along x, m, ascending, `[nx]`.
    pub x: Vec<f64>,
    /// Places along y, m, ascending, `[ny]`.
    pub y: Vec<f64>,
    /// Gap, m, `[nx*ny]`, node (i, j) at i + nx j.
    pub gap: Vec<f64>,
    /// Flags of nodes beyond the end of a profile, `[nx*ny]`: there the profile was taken to go on straight.
    pub beyond: Vec<bool>,
}

impl Gap {
    /// An error if one of the `closed` nodes lies beyond the end of a profile: the contact reaches an edge, where
    /// pressure is not that of smooth bodies.
    pub fn refuse_edge(&self, closed: impl Fn(usize) -> bool) -> Result<()> {
        let Some(i) = (0..self.gap.len()).find(|&i| self.beyond[i] && closed(i)) else { return Ok(()) };
        let nx = self.x.len();
        Err(Error::Job(format!(
            "placement: the contact reaches the end of a profile: found a closed node at x = {:.2}, y = {:.2} \
             mm from the point of contact, \
             beyond the wheel's or the rail's line; expected it inside both. Move the wheel, reduce the load, \
             or give a profile that goes on",
            1e3 * self.x[i % nx],
            1e3 * self.y[i / nx]
        )))
    }
}

/// Lines of a grid for an ellipse with the semi-extents `extent` along x and y, m: over ±1.7 of them, equally spaced
/// with an eighth of the smaller one or as far apart as 97 lines are, a line through the origin.
pub fn grid_lines(extent: [f64; 2]) -> [Vec<f64>; 2] {
    finer_grid_lines(extent, SPACINGS)
}

/// The same with at least so many `spacings` in the smaller extent.
pub fn finer_grid_lines(extent: [f64; 2], spacings: f64) -> [Vec<f64>; 2] {
    lines_within(extent, spacings, MARGIN)
}

/// The same over ±1.4 of the extents: of one of several grids.
pub fn tight_grid_lines(extent: [f64; 2], spacings: f64) -> [Vec<f64>; 2] {
    lines_within(extent, spacings, TIGHT_MARGIN)
}

fn lines_within(extent: [f64; 2], spacings: f64, margin: f64) -> [Vec<f64>; 2] {
    let spacing = extent[0].min(extent[1]) / spacings.max(SPACINGS);
    let most = (LINES as f64 * margin / MARGIN).round() as i64;
    extent.map(|half| {
        let n = (margin * half / spacing).ceil() as i64;
        let (n, spacing) = if n > most { (most, margin * half / most as f64) } else { (n, spacing) };
        (-n..=n).map(|i| i as f64 * spacing).collect()
    })
}

/// Gap beyond the part of a profile that belongs to the contact, m: no load closes it.
const APART: f64 = 0.01;

/// Distance of the rail from the tangent plane at `start`, along `direction`, m, and the y of the track at which it
/// was met.
fn meet_rail(rail: &Profile, start: Vector, direction: Vector) -> Option<(f64, f64)> {
    let mut t = 0.0;
    for _ in 0..60 {
        let p = along(start, t, direction);
        let local = rail.at(p[1]);
        let step = ((p[2] - local.z) / (local.slope * direction[1] - direction[2])).clamp(-3e-3, 3e-3);
        t += step;
        if step.abs() < 1e-13 {
            return Some((p[1], t));
        }
    }
    None
}

/// The gap on the lines x and y of a grid (program's frame, m) at first touch. Within `bounds` the wheel's profile
/// belongs to this contact;
/// beyond them it is open.
pub(super) fn gap(pair: &Pair, frame: &Frame, [x, y]: [&[f64]; 2], bounds: Option<[f64; 2]>) -> Result<Gap> {
    let normal = frame.normal();
    let mut found =
        Gap { x: x.to_vec(), y: y.to_vec(), gap: Vec::with_capacity(x.len() * y.len()), beyond: Vec::new() };
    for &b in y {
        for &a in x {
            let start = frame.at(a, b);
            let (Some((rail_y, down)), Some((wheel_y, up))) =
                (meet_rail(&pair.rail, start, normal), pair.wheel.meet(start, normal))
            else {
                return Err(Error::Job(format!(
                    "placement: the grid leaves the profiles: at x = {:.2}, y = {:.2} mm from the point of \
                     contact the normal meets no wheel or \
                     no rail; make the grid smaller",
                    1e3 * a,
                    1e3 * b
                )));
            };
            let inside = bounds.is_none_or(|[from, to]| (from..=to).contains(&wheel_y));
            found.gap.push(if inside { up - down } else { APART });
            found.beyond.push(!pair.rail.contains(rail_y) || !pair.wheel.profile.contains(wheel_y));
        }
    }
    Ok(found)
}
