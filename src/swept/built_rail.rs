//! Sections of the built-in symmetric rails: structured 9-node quadrilaterals in three blocks, foot, web and head,
//! mapped onto the outline.
//!
//! The upper side of the head's block is the running surface. It ends on the arc of the corner, or, of a contact on
//! that arc or on the face below, nearer to the crown, so that the contact lies within a side of the block.

use super::builtin::{Focus, SectionLines};
use super::{Beam, CrossSection, HeadPoint, Path};
use crate::fem::ElasticMaterial;
use crate::rails::{Head, Rail};
use crate::{Error, Result};
use std::cell::RefCell;

/// Angle of the arcs at which the top of the head's block ends and its side begins, for a contact on the crown, rad.
const CORNER: f64 = 0.87;
/// The same for a contact on the corner: length of the surface from the crown to there, over that to [`CORNER`].
const INNER: f64 = 0.5;
/// Steepest surface at a contact on the crown, rad; steeper ones are on the corner.
const CROWN: f64 = 0.4;
/// Largest edge length, m: a wave of 6 kHz in the web is six times as long.
const LARGEST: f64 = 15e-3;
/// Largest edge length of the mesh for loads, m.
const FINE: f64 = 10e-3;
/// Largest distance of a contact from the head's surface, m.
const OFF: f64 = 10e-3;

/// A built-in rail whose contact point is at a place of its head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BuiltRail {
    rail: &'static Rail,
    /// Length of the surface from the crown to the contact point, m.
    along: f64,
}

fn step(w: &[[f64; 2]]) -> f64 {
    (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])
}

/// Length of a line, mm; m.
fn length(line: &[[f64; 2]]) -> f64 {
    1e-3 * line.windows(2).map(step).sum::<f64>()
}

/// The point at the part `part` of the length of a line, mm; m.
fn on_line(line: &[[f64; 2]], part: f64) -> [f64; 2] {
    let mut left = part * line.windows(2).map(step).sum::<f64>();
    let mut at = line[0];
    for w in line.windows(2) {
        let step = step(w);
        let here = (left / step).clamp(0.0, 1.0);
        at = [0, 1].map(|c| w[0][c] + here * (w[1][c] - w[0][c]));
        left -= step;
        if left <= 0.0 {
            break;
        }
    }
    at.map(|v| 1e-3 * v)
}

/// A block that is symmetric about y = 0: its lines of the mesh reach from −`half` to `half`; lower and upper side are
/// given for s ≥ 0, its right side from 0, below, to 1, m.
struct Block<'b> {
    half: f64,
    lower: &'b dyn Fn(f64) -> [f64; 2],
    upper: &'b dyn Fn(f64) -> [f64; 2],
    side: &'b dyn Fn(f64) -> [f64; 2],
}

impl Block<'_> {
    /// The point at s and the part t of the height (W. J. Gordon, C. A. Hall, Int. J. Numer. Meth. Engng 7 (1973) 461).
    fn at(&self, s: f64, t: f64) -> [f64; 2] {
        let mirrored = |p: [f64; 2]| if s < 0.0 { [-p[0], p[1]] } else { p };
        let (lower, upper) = (mirrored((self.lower)(s.abs())), mirrored((self.upper)(s.abs())));
        let (side, low, high) = ((self.side)(t), (self.lower)(self.half), (self.upper)(self.half));
        // What the right side is off the straight line between its ends, and what the left one is.
        let off = [0, 1].map(|c| side[c] - (1.0 - t) * low[c] - t * high[c]);
        let part = s / self.half;
        [(1.0 - t) * lower[0] + t * upper[0] + part * off[0], (1.0 - t) * lower[1] + t * upper[1] + off[1]]
    }
}

/// The outline of a rail, cut into the sides of the blocks.
struct Sides {
    rail: &'static Rail,
    /// Length of the running surface from the crown to where the upper side of the head's block ends, m.
    corner: f64,
    /// Half width of the head's block on the lines of the mesh, m.
    half: f64,
}

impl Sides {
    fn head(&self) -> &'static Head {
        &self.rail.head
    }

    /// Heights of the web's block, m.
    fn stem(&self) -> [f64; 2] {
        let web = self.rail.web;
        [web[web.len() - 1][1], web[0][1]].map(|z| 1e-3 * z)
    }

    fn foot(&self) -> f64 {
        1e-3 * self.rail.tip[0][0]
    }

    /// Lengths of the straight part of the head's side and of the rest of its arcs, m.
    fn side(&self) -> [f64; 2] {
        [length(self.rail.side), self.head().to_angle(self.head().steep()) - self.corner]
    }

    /// The point at the part `part` of the side of the head: a line, then the rest of the arcs.
    fn on_side(&self, part: f64) -> [f64; 2] {
        let [straight, arc] = self.side();
        let length = part * (straight + arc);
        if length <= straight {
            return on_line(self.rail.side, length / straight);
        }
        let place = self.head().point(self.corner + arc - (length - straight));
        [place.y, place.z]
    }

    /// Half of the width of the web at a height, m.
    fn web(&self, z: f64) -> f64 {
        let web = self.rail.web;
        let z = 1e3 * z;
        let within = web.windows(2).find(|w| z >= w[1][1]).unwrap_or(&web[web.len() - 2..]);
        let part = ((z - within[1][1]) / (within[0][1] - within[1][1])).clamp(0.0, 1.0);
        1e-3 * (within[1][0] + part * (within[0][0] - within[1][0]))
    }

    /// The place on the upright section of what is at the height z and at s across on the lines of the mesh, m.
    fn place(&self, [z, s]: [f64; 2]) -> [f64; 2] {
        let Sides { rail, corner, half } = *self;
        let [bottom, top] = self.stem();
        let height = rail.head.height;
        let stem = |s: f64, z: f64| [s / rail.stem * self.web(z), z];
        let beside = |s: f64, half: f64| (s - rail.stem) / (half - rail.stem);
        if z > bottom && z < top {
            return stem(s, z);
        }
        if z >= top {
            let lower = |s: f64| match s <= rail.stem {
                true => stem(s, top),
                false => on_line(rail.underside, 1.0 - beside(s, half)),
            };
            let upper = |s: f64| {
                let place = rail.head.point(if half == corner { s } else { s / half * corner });
                [place.y, place.z]
            };
            let side = |t: f64| self.on_side(t);
            return Block { half, lower: &lower, upper: &upper, side: &side }.at(s, (z - top) / (height - top));
        }
        let half = self.foot();
        let inner = self.web(bottom);
        let lower = |s: f64| match s <= rail.stem {
            true => [s / rail.stem * inner, 0.0],
            false => [inner + beside(s, half) * (half - inner), 0.0],
        };
        let upper = |s: f64| match s <= rail.stem {
            true => stem(s, bottom),
            false => on_line(rail.foot, beside(s, half)),
        };
        Block { half, lower: &lower, upper: &upper, side: &|t| on_line(rail.tip, t) }.at(s, z / bottom)
    }
}

impl BuiltRail {
    /// The rail with the contact point at y, m, of its head, to the right of its middle.
    pub fn new(rail: &'static Rail, y: f64) -> Result<Self> {
        let reach = rail.head.reach();
        if !(y.abs() <= reach) {
            return Err(Error::Job(format!(
                "the contact point on the rail {}: found y = {y} m, expected a place on its head, at most \
                 {reach} m from the middle; a contact on the \
                 face below needs contact.placement, which knows its height",
                rail.name
            )));
        }
        Ok(Self { rail, along: y.signum() * rail.head.to_distance(y.abs()) })
    }

    /// The rail with the contact point at the place of its head that is nearest to y to the right of its middle and z
    /// over its crown, m.
    pub fn near(rail: &'static Rail, [y, z]: [f64; 2]) -> Result<Self> {
        let head = &rail.head;
        let wanted = [y, head.height + z];
        let along = head.nearest(wanted);
        let found = head.point(along);
        let apart = (found.y - y).hypot(found.z - wanted[1]);
        if !(apart <= OFF) || along.abs() >= head.to_deepest() {
            return Err(Error::Job(format!(
                "the contact point on the rail {}: found y = {y:.4} m and {:.4} m below its crown, expected a \
                 place on its head down to {} m below the \
                 crown, and at most {OFF} m off it; move the wheel, or give the section that the profile is of",
                rail.name,
                -z,
                crate::rails::DEEPEST
            )));
        }
        Ok(Self { rail, along })
    }

    /// The rail.
    pub fn rail(&self) -> &'static Rail {
        self.rail
    }

    /// The beam that it is, vertically or laterally, by its published figures; the part of the area that shears is none
    /// of them for most rails.
    pub fn beam(&self, material: ElasticMaterial, lateral: bool, loss: f64) -> Option<Beam> {
        let published = &self.rail.published;
        let sheared = published.sheared?[usize::from(lateral)];
        let inertia = published.inertia[usize::from(lateral)];
        let ElasticMaterial { young, density, .. } = material;
        Some(Beam { young, shear: material.shear(), density, area: published.area, inertia, sheared, loss })
    }

    /// The contact point.
    pub fn contact(&self) -> HeadPoint {
        self.rail.head.point(self.along)
    }

    fn seen(&self, [y, z]: [f64; 2]) -> [f64; 2] {
        self.contact().in_surface_frame([z, y])
    }

    /// Returns whether the contact is on the corner or on the face below it.
    fn on_corner(&self) -> bool {
        self.contact().angle.abs() > CROWN
    }

    /// Height of the surface over its tangent at the contact point, m, at the distance `y` from there along the
    /// tangent; 0 there, negative elsewhere.
    pub fn height(&self, y: f64) -> f64 {
        let head = &self.rail.head;
        let end = head.to_angle(head.steep());
        let here = self.contact().angle;
        // Along the tangent the distance grows with the length of the surface up to where that is upright on it.
        let turned = |s: f64| (head.point(s).angle - here).abs() < 0.5 * std::f64::consts::PI;
        let upright = |far: f64| {
            if turned(far) {
                return far;
            }
            let (mut inside, mut outside) = (self.along, far);
            for _ in 0..60 {
                let middle = 0.5 * (inside + outside);
                *if turned(middle) { &mut inside } else { &mut outside } = middle;
            }
            inside
        };
        let (mut low, mut high) = (upright(-end), upright(end));
        let point = |s: f64| self.seen([head.point(s).y, head.point(s).z]);
        while high - low > 1e-15 + 1e-14 * end {
            let middle = 0.5 * (low + high);
            if point(middle)[1] < y {
                low = middle;
            } else {
                high = middle;
            }
        }
        point(0.5 * (low + high))[0]
    }

    /// The mesh for the modes, in the frame of the surface at the contact point.
    pub fn for_modes(&self) -> Result<CrossSection> {
        self.section(Focus { size: LARGEST, reach: 0.0, corner: LARGEST, largest: LARGEST })
    }

    /// The mesh for loads spread over circles of the radius `radius`, m, and more, in the same frame.
    pub fn for_loads(&self, radius: f64) -> Result<CrossSection> {
        self.section(Focus { size: radius / 3.0, reach: 1.5 * radius, corner: FINE, largest: FINE })
    }

    /// The section with the groups `foot`, its lower side, and `head`, the running line, in the frame of the surface at
    /// the contact point. The running line of a contact on the corner goes on down the faces.
    pub fn section(&self, focus: Focus) -> Result<CrossSection> {
        let (rail, corner) = (self.rail, self.on_corner());
        let wide = rail.head.to_angle(CORNER);
        let sides = match corner {
            false => Sides { rail, corner: wide, half: wide },
            true => Sides { rail, corner: INNER * wide, half: wide },
        };
        let ([bottom, top], foot, height) = (sides.stem(), sides.foot(), rail.head.height);
        let (half, stem) = (sides.half, rail.stem);
        // The contact on the lines of the mesh.
        let at = match corner {
            false => [height, self.along],
            true => {
                let [straight, arc] = sides.side();
                let part = 1.0 - (self.along.abs() - sides.corner) / (straight + arc);
                [top + part * (height - top), self.along.signum() * half]
            }
        };
        let z = focus.lines(&[0.0, bottom, top, height], &at[..1], &[]);
        let y = focus.lines(&[-foot, -half, -stem, stem, half, foot], &at[1..2], &[]);
        let inside = |z: f64, y: f64| match z {
            z if z < bottom => true,
            z if z < top => y.abs() < stem,
            _ => y.abs() < half,
        };
        let on_lines = RefCell::new(Vec::new());
        let place = |at: [f64; 2]| {
            on_lines.borrow_mut().push(at);
            self.seen(sides.place(at))
        };
        let mut section = SectionLines { r: &z, y: &y }.section(inside, place, |z, _| z == height);
        if corner {
            let [left, right] = [-half, half].map(|s| side(&section, &on_lines.borrow(), [top, s]));
            let down = right.into_iter().rev().map(|[first, last, middle]| [last, first, middle]);
            section.tread = left.into_iter().chain(section.tread).chain(down).collect();
        }
        let foot = section.groups.remove("inner").unwrap_or_default();
        let mut head: Vec<usize> = section.tread.iter().flatten().copied().collect();
        head.sort_unstable();
        head.dedup();
        section.groups = [("foot".to_string(), foot), ("head".to_string(), head)].into();
        section.check(Path::Line(1.0))?;
        Ok(section)
    }
}

/// The edges at `s` across on the lines of the mesh from the height `top` on, upwards: first, last and middle node.
/// `at` has the place of each node on the lines.
fn side(section: &CrossSection, at: &[[f64; 2]], [top, s]: [f64; 2]) -> Vec<[usize; 3]> {
    let on = |&k: &usize| at[k][1] == s && at[k][0] >= top;
    let edges = section.elements.iter().flat_map(|e| e.kind.edges().iter().map(|edge| edge.map(|k| e.nodes[k])));
    let mut found: Vec<[usize; 3]> = edges.filter(|edge| edge.iter().all(on)).collect();
    for edge in &mut found {
        if at[edge[0]][0] > at[edge[1]][0] {
            edge.swap(0, 1);
        }
    }
    found.sort_by(|a, b| at[a[0]][0].total_cmp(&at[b[0]][0]));
    found
}
