//! The gap of the undeformed bodies on a grid, from the profiles.

use super::frame::Frame;
use super::pose::{along, Vector};
use super::profile::RunningProfile;
use super::touch::WheelOverRail;
use crate::{Error, Result};
use std::cell::Cell;

/// Half the extent of a grid over that of the ellipse it is for.
const MARGIN: f64 = 1.7;

/// The same for one of several contacts, whose influence on each other takes the square of their nodes: over the part
/// of the grid that is expected to be closed.
const TIGHT_MARGIN: f64 = 1.4;

/// Most lines on either side of the origin of a grid on which the closed part of a contact is looked for.
const ROUGH_LINES: i64 = 16;

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

    /// The same without the lines along x that lie in the profile of another contact, but for the first one on either
    /// side: the grids of contacts that share a profile end where they meet.
    pub(crate) fn up_to_neighbours(mut self) -> Self {
        let nx = self.x.len();
        let own = |j: usize| self.gap[nx * j..nx * (j + 1)].iter().any(|gap| *gap < APART);
        let lines = 0..self.y.len();
        let (Some(first), Some(last)) = (lines.clone().find(|&j| own(j)), lines.rev().find(|&j| own(j))) else {
            return self;
        };
        let (first, end) = (first.saturating_sub(1), (last + 2).min(self.y.len()));
        self.y = self.y[first..end].to_vec();
        self.gap = self.gap[nx * first..nx * end].to_vec();
        self.beyond = self.beyond[nx * first..nx * end].to_vec();
        self
    }

    /// Part of the force, given by the `pressure` of each node, that lies on the last line before the wheel's profile
    /// belongs to another contact: 0 where the contact ends by itself.
    pub(crate) fn share_at_neighbour(&self, pressure: impl Fn(usize) -> f64) -> f64 {
        let nx = self.x.len();
        let open = |i: usize| self.gap.get(i).is_some_and(|gap| *gap >= APART);
        let last = |i: usize| !open(i) && (open(i + nx) || i.checked_sub(nx).is_some_and(open));
        let all: f64 = (0..self.gap.len()).map(&pressure).sum();
        let there: f64 = (0..self.gap.len()).filter(|&i| last(i)).map(&pressure).sum();
        if all > 0.0 {
            there / all
        } else {
            0.0
        }
    }
}

/// Lines of a grid for an ellipse with the semi-extents `extent` along x and y, m: over ±1.7 of them, equally spaced
/// with an eighth of the smaller one or as far apart as 97 lines are, a line through the origin.
pub fn grid_lines(extent: [f64; 2]) -> [Vec<f64>; 2] {
    finer_grid_lines(extent, SPACINGS)
}

/// The same with at least so many `spacings` in the smaller extent.
pub(crate) fn finer_grid_lines(extent: [f64; 2], spacings: f64) -> [Vec<f64>; 2] {
    lines_within(extent, spacings, MARGIN, LINES)
}

/// Lines over ±1.4 of the extents along x and y, m, at most 33 of either: on them the closed part of one of several
/// contacts is looked for.
pub(crate) fn rough_grid_lines(extent: [f64; 2]) -> [Vec<f64>; 2] {
    lines_within(extent, 2.0 * ROUGH_LINES as f64, TIGHT_MARGIN, ROUGH_LINES)
}

/// Lines of the grid of one of several contacts, at most 98 of either: over the ranges `closed` along x and y, m, and
/// 0.4 of their halves on either side, equally spaced with at least so many `spacings` in the smaller half. A line of
/// either passes through the origin if the range has it.
pub(crate) fn fitted_grid_lines(closed: [[f64; 2]; 2], spacings: f64) -> [Vec<f64>; 2] {
    let half = closed.map(|[from, to]| 0.5 * (to - from));
    let wanted = half[0].min(half[1]) / spacings.max(SPACINGS);
    [0, 1].map(|c| {
        let spacing = wanted.max(TIGHT_MARGIN * half[c] / LINES as f64);
        let more = (TIGHT_MARGIN - 1.0) * half[c];
        let first = ((closed[c][0] - more) / spacing).floor() as i64;
        let last = ((closed[c][1] + more) / spacing).ceil() as i64;
        (first..=last).map(|i| i as f64 * spacing).collect()
    })
}

fn lines_within(extent: [f64; 2], spacings: f64, margin: f64, most: i64) -> [Vec<f64>; 2] {
    let spacing = extent[0].min(extent[1]) / spacings.max(SPACINGS);
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
fn meet_rail(rail: &RunningProfile, start: Vector, direction: Vector) -> Option<(f64, f64)> {
    let (mut t, last) = (0.0, Cell::new(0));
    for _ in 0..60 {
        let p = along(start, t, direction);
        let local = rail.local_from(p[1], &last);
        let step = ((p[2] - local.z) / (local.slope * direction[1] - direction[2])).clamp(-3e-3, 3e-3);
        t += step;
        if step.abs() < 1e-13 {
            return Some((p[1], t));
        }
    }
    None
}

/// The gap on the lines x and y of a grid (program's frame, m) at first touch. Within `bounds` the wheel's profile
/// belongs to this contact; beyond them it is open.
pub(super) fn gap(pair: &WheelOverRail, frame: &Frame, [x, y]: [&[f64]; 2], bounds: Option<[f64; 2]>) -> Result<Gap> {
    let normal = frame.normal();
    let mut found =
        Gap { x: x.to_vec(), y: y.to_vec(), gap: Vec::with_capacity(x.len() * y.len()), beyond: Vec::new() };
    for &b in y {
        // The rail is the same all along the track.
        let below = meet_rail(&pair.rail, frame.point(0.0, b), normal);
        for &a in x {
            let (Some((rail_y, down)), Some((wheel_y, up))) = (below, pair.wheel.meet(frame.point(a, b), normal))
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
