//! Divisions of the cylinder in angle, depth and width, and the place of each node.

use super::joined::JoinedGrid;
use super::{grading, CylinderSpec, MAX_NODES};
use crate::{Error, Result};

/// Largest number of divisions in one direction.
const MAX_DIVISIONS: f64 = 200_000.0;
/// Largest number of times that columns are joined.
const MAX_JOINS: u32 = 3;
/// Columns are joined where the elements have grown, in angle or depth, to this many column widths.
const JOIN_AT: f64 = 2.5;

/// Largest layer, as a part of the largest element size: bending of the disc, clamped at the bore, varies faster
/// along the radius than around it.
const RADIAL: f64 = 0.8;
/// Layer at the bore, as a part of the largest element size: a clamped bore has singular stresses at its edges, and
/// bending is strongest there. Equal elements of 25 mm in a wheel of 0.5 m put its first clamped frequency 0.9 % too
/// high, a bore layer of 7.5 mm halves that.
const BORE: f64 = 0.3;
/// Thickness of the ring around the bore where columns are joined once less than elsewhere, in largest element sizes:
/// where a clamped bore meets the sides its stresses are singular.
const RING: f64 = 1.0;
/// Columns of that ring at the sides, relative to their mean.
const SIDE: f64 = 0.6;

impl CylinderSpec {
    /// The error of a mesh with `found` nodes (or divisions), too many, with a size that would do.
    fn too_fine(&self, found: f64, what: &str) -> Error {
        let fits = |h: f64| {
            let mut spec = self.clone();
            spec.element_size = h;
            spec.max_element_size = self.max_element_size.map(|m| m.max(h));
            matches!(spec.divisions(), Ok(Divided::Grid(l)) if l.grid.count().0 <= MAX_NODES)
        };
        let mut size = self.element_size.max(self.outer_radius / MAX_DIVISIONS);
        while size < self.outer_radius && !fits(size) {
            size *= 1.25;
        }
        for _ in 0..4 {
            if fits(size / 1.05) {
                size /= 1.05;
            }
        }
        let advice = if size < self.outer_radius {
            format!("{size:.2e} m would fit")
        } else {
            "no element_size alone would fit: raise cylinder.max_element_size too".into()
        };
        Error::Job(format!(
            "cylinder.element_size is {} m: {found:.3e} {what}, above the limit; {advice}",
            self.element_size
        ))
    }

    /// The divisions of a valid cylinder, and the way of joining columns that needs the fewest nodes.
    fn divisions(&self) -> Result<Divided> {
        self.validate()?;
        let h = self.element_size;
        let largest = self.largest();
        let r = self.outer_radius;
        let half_turn = std::f64::consts::PI * r;
        let depth = r - self.inner_radius;
        let half_patch = self.patch_half_length.max(self.patch_half_width);
        // Columns that are joined three by three are at most so much smaller than the largest size.
        let finest = (largest / 3f64.powi(MAX_JOINS as i32)).max(h);
        let longest = half_turn.max(self.thickness).max(depth);
        let most = (half_patch / h).max(grading::elements(longest, h, self.growth, finest) as f64);
        if most > MAX_DIVISIONS {
            return Ok(Divided::TooMany(most));
        }
        let (nxp, nyp) = self.patch()?;
        let first = if self.has_patch() { h * self.growth } else { h };

        // Angle: arcs measured on the running surface at y = 0. Patch lines lie at exact x, not at exact arcs.
        let mut theta: Vec<f64> = (0..=nxp).map(|i| (i as f64 * h / r).asin()).collect();
        let edge = theta[nxp] * r;
        let rest = half_turn - edge;
        let first = if self.has_patch() { first } else { largest };
        theta.extend(
            ends(
                &grading::sizes(rest, grading::elements(rest, first, self.growth, largest), first, largest),
                edge,
                half_turn,
            )
            .map(|arc| arc / r),
        );

        let layers = self.layers(depth);
        let mut below = vec![0.0];
        below.extend(ends(&layers, 0.0, depth));

        let arcs: Vec<f64> = theta.iter().map(|t| t * r).collect();
        let clear = 0.5 * half_patch;
        let mut best: Option<(u64, CylinderLayout)> = None;
        for joins in 0..=if self.has_patch() { MAX_JOINS } else { 0 } {
            let Some((y, j0)) = self.width(joins, nyp, first) else { continue };
            let mut level_r = levels(&below, 0, joins, h, clear);
            level_r.reverse();
            let level_theta = levels(&arcs, nxp, joins, h, clear);
            let reach = self.has_patch().then(|| {
                let joined = |at: &[f64], levels: &[u32]| at[levels.partition_point(|&l| l < joins).min(at.len() - 1)];
                let from_surface: Vec<u32> = level_r.iter().rev().copied().collect();
                joined(&arcs, &level_theta).max(joined(&below, &from_surface)).max(half_patch).max(arcs[nxp])
            });
            let ring = self.ring(&layers, &level_r);
            let grid = JoinedGrid { columns: y.len() - 1, level_theta, level_r, ring };
            let nodes = grid.count().0;
            if best.as_ref().is_none_or(|(n, _)| nodes < *n) {
                let s = below.iter().rev().map(|b| 1.0 - b / depth).collect();
                let y_far = self.far_lines(y.len() - 1, 3usize.pow(joins));
                best = Some((nodes, CylinderLayout { theta: theta.clone(), s, y, y_far, reach, nxp, nyp, j0, grid }));
            }
        }
        best.map(|(_, l)| Divided::Grid(l)).ok_or_else(|| Error::Defect("no division of the cylinder's width".into()))
    }

    /// Layers from the running surface down to the bore, m.
    fn layers(&self, depth: f64) -> Vec<f64> {
        let (h, g) = (self.element_size, self.growth);
        let largest = self.largest();
        if !self.has_patch() {
            // Fine at the bore alone, where a support bends the body most.
            let mut layers = grading::sizes(depth, grading::elements(depth, h, g, largest), h, largest);
            layers.reverse();
            return layers;
        }
        let cap = (RADIAL * largest).max(h);
        let bore = (BORE * largest).max(h);
        // Sizes that grow at the same rate from either end are equal here.
        let meet = (0.5 * (depth + (bore - h) / g.ln())).clamp(0.0, depth);
        let from =
            |first: f64, length: f64| grading::sizes(length, grading::elements(length, first, g, cap), first, cap);
        let mut layers = from(h, meet);
        layers.extend(from(bore, depth - meet).iter().rev());
        layers
    }

    /// Number of layers in the ring around the bore; 0 where no columns are joined or the ring would meet what is
    /// fine at the contact. `layers` from the running surface, `level_r` from the bore.
    fn ring(&self, layers: &[f64], level_r: &[u32]) -> usize {
        let Some(&joined) = level_r.first().filter(|&&l| l > 0) else { return 0 };
        let mut thickness = 0.0;
        let mut ring = 0;
        for layer in layers.iter().rev() {
            if thickness >= RING * self.largest() {
                break;
            }
            thickness += layer;
            ring += 1;
        }
        // One layer of templates lies between the ring and what is joined, another between that and the next box.
        let apart = level_r.get(ring + 1).is_some_and(|&l| l == joined);
        if apart {
            ring
        } else {
            0
        }
    }

    /// Lines across the width, m, `[columns + 1]`, far from the contact: the same on either side of the mid-plane,
    /// wherever the contact lies, and finer at the sides. The frequencies of two wheels that differ only by the place
    /// of their contacts then carry the same error of discretisation, and their small distance, on which the growth
    /// of squeal depends, next to none.
    fn far_lines(&self, columns: usize, group: usize) -> Vec<f64> {
        let [y0, y1] = self.sides();
        let fine = (group / 3).max(1);
        let sizes = grading::symmetric(self.thickness, columns / fine, SIDE);
        let mut y = vec![y0];
        let mut at = y0;
        for size in sizes {
            y.extend((1..=fine).map(|k| at + size * k as f64 / fine as f64));
            at += size;
        }
        if let Some(last) = y.last_mut() {
            *last = y1;
        }
        y
    }

    /// Lines across the width, m, ascending, in a multiple of 3^`joins` columns, and the index of the line y = 0.
    /// `None` where so many columns cannot be joined and stay below the largest size.
    fn width(&self, joins: u32, nyp: usize, first: f64) -> Option<(Vec<f64>, usize)> {
        let h = self.element_size;
        let [y0, y1] = self.sides();
        let largest = self.largest();
        let group = 3usize.pow(joins);
        if joins > 0 && group as f64 * h > largest {
            return None;
        }
        if !self.has_patch() {
            // Fine at both sides, where a supported bore ends in an edge; no line need pass through the contact point.
            let half = 0.5 * self.thickness;
            let columns = grading::sizes(half, grading::elements(half, h, self.growth, largest), h, largest);
            let from_side: Vec<f64> = ends(&columns, 0.0, half).collect();
            let mut y = vec![y0];
            y.extend(from_side.iter().map(|d| y0 + d));
            y.extend(from_side.iter().rev().skip(1).map(|d| y1 - d));
            y.push(y1);
            return Some((y, 0));
        }
        let cap = (largest / group as f64).max(h);
        let edge = nyp as f64 * h;
        let rest = [-y0 - edge, y1 - edge].map(|l| if l <= 1e-9 * h { 0.0 } else { l });
        let mut n = rest.map(|l| grading::elements(l, first, self.growth, cap));
        while !(n[0] + n[1] + 2 * nyp).is_multiple_of(group) {
            // To the side whose elements are the larger on the mean; never to a side without any.
            let mean = [0, 1].map(|k| if n[k] == 0 { 0.0 } else { rest[k] / n[k] as f64 });
            let k = usize::from(mean[1] > mean[0]);
            if n[k] == 0 {
                return None;
            }
            n[k] += 1;
        }
        let sides = [0, 1].map(|k| grading::sizes(rest[k], n[k], first, cap));
        if joins > 0 && sides.iter().flatten().any(|&size| size < 0.4 * h) {
            return None;
        }
        let mut y: Vec<f64> = ends(&sides[0], edge, -y0).map(|d| -d).collect();
        y.reverse();
        y.extend((0..=2 * nyp).map(|j| (j as f64 - nyp as f64) * h));
        y.extend(ends(&sides[1], edge, y1));
        Some((y, n[0] + nyp))
    }
}

/// Ends of the elements of the given sizes laid from `start`; the last lies exactly at `stop`.
fn ends(sizes: &[f64], start: f64, stop: f64) -> impl Iterator<Item = f64> + '_ {
    let n = sizes.len();
    sizes.iter().enumerate().scan(start, move |at, (k, size)| {
        *at += size;
        Some(if k + 1 == n { stop } else { *at })
    })
}

/// Level of each division of a line, `[positions.len()]`: how often columns of width `h` are joined there. A level
/// begins behind the first element that is long enough for the joined columns and at least `clear` from the patch,
/// whose edge is division `edge`.
fn levels(positions: &[f64], edge: usize, joins: u32, h: f64, clear: f64) -> Vec<u32> {
    let mut out = vec![0; positions.len()];
    let mut begin = edge;
    for level in 1..=joins {
        let width = h * 3f64.powi(level as i32 - 1);
        let enough =
            |p: usize| positions[p + 1] - positions[p] >= JOIN_AT * width && positions[p] - positions[edge] >= clear;
        let Some(p) = (begin..positions.len() - 1).find(|&p| enough(p)) else { break };
        out[p + 1..].iter_mut().for_each(|l| *l = level);
        begin = p + 1;
    }
    out
}

/// The divisions of a cylinder in angle, depth and width.
pub(super) struct CylinderLayout {
    /// Angles of half a turn at y = 0, `[nh + 1]`, from 0 to π.
    pub theta: Vec<f64>,
    /// Depth fraction, `[nr + 1]`: 0 at the bore, 1 at the running surface.
    pub s: Vec<f64>,
    /// Lines across the width at the contact, m, `[ny + 1]`, ascending.
    pub y: Vec<f64>,
    /// The same lines far from the contact, m, `[ny + 1]`.
    y_far: Vec<f64>,
    /// Distance from the contact point, m, behind which all columns are joined and the lines begin to move; `None`
    /// without contact.
    reach: Option<f64>,
    /// Patch columns on either side of x = 0.
    pub nxp: usize,
    /// Patch columns on either side of y = 0.
    pub nyp: usize,
    /// Index in `y` of the line y = 0 (of a body with a patch).
    pub j0: usize,
    pub grid: JoinedGrid,
}

enum Divided {
    Grid(CylinderLayout),
    TooMany(f64),
}

impl CylinderLayout {
    /// The divisions of a valid cylinder that is not too fine.
    pub fn new(spec: &CylinderSpec) -> Result<Self> {
        match spec.divisions()? {
            Divided::TooMany(n) => Err(spec.too_fine(n, "elements in one direction")),
            Divided::Grid(layout) => {
                let nodes = layout.grid.count().0;
                if nodes > MAX_NODES {
                    return Err(spec.too_fine(nodes as f64, &format!("nodes (limit {MAX_NODES})")));
                }
                Ok(layout)
            }
        }
    }

    /// Position in lower form of the point in angle column `a` (half columns allowed, negative towards -x), depth
    /// fraction `s` and width line `j`.
    pub fn position(&self, spec: &CylinderSpec, a: f64, s: f64, j: usize) -> [f64; 3] {
        let y = self.line(spec, a, s, j);
        let r = spec.outer_radius;
        let column = a.abs();
        if column == (self.theta.len() - 1) as f64 {
            let radius = spec.inner_radius + s * (r - spec.drop(y) - spec.inner_radius);
            return [0.0, y, -radius - r];
        }
        let k = column as usize;
        let at = |k: usize| self.angle(spec, k, y);
        let angle = if column == k as f64 { at(k) } else { 0.5 * (at(k) + at(k + 1)) };
        let sign = if a < 0.0 { -1.0 } else { 1.0 };
        if s == 1.0 {
            // On the running surface x is exact in the patch and z is free of the cancellation in r cos θ − R.
            let drop = spec.drop(y);
            let radius = r - drop;
            let on_patch = column == k as f64 && k <= self.nxp && y.abs() <= self.patch_edge(spec) * (1.0 + 1e-12);
            let x = if on_patch { k as f64 * spec.element_size } else { radius * angle.sin() };
            let fall = if angle < 1.0 {
                x * x / (radius + (radius * radius - x * x).sqrt())
            } else {
                radius * (1.0 - angle.cos())
            };
            return [sign * x, y, -drop - fall];
        }
        let radius = spec.inner_radius + s * (r - spec.drop(y) - spec.inner_radius);
        [sign * radius * angle.sin(), y, radius * angle.cos() - r]
    }

    /// Position of line `j`, m, in angle column `a` at depth fraction `s`: from that at the contact to that far away
    /// over one width of the body.
    fn line(&self, spec: &CylinderSpec, a: f64, s: f64, j: usize) -> f64 {
        let Some(reach) = self.reach else { return self.y[j] };
        let (k, part) = (a.abs() as usize, a.abs().fract());
        let next = self.theta.get(k + 1).unwrap_or(&self.theta[k]);
        let arc = spec.outer_radius * ((1.0 - part) * self.theta[k] + part * next);
        let depth = (1.0 - s) * (spec.outer_radius - spec.inner_radius);
        let way = ((arc.hypot(depth) - reach) / spec.thickness).clamp(0.0, 1.0);
        let far = way * way * (3.0 - 2.0 * way);
        self.y[j] + far * (self.y_far[j] - self.y[j])
    }

    fn patch_edge(&self, spec: &CylinderSpec) -> f64 {
        self.nyp as f64 * spec.element_size
    }

    /// Angle of column `k` ≥ 0 at `y`: on the patch the one whose surface point has the column's exact x, beside it
    /// (in y) as at its edge; the columns outside share the rest of the half turn in proportion.
    fn angle(&self, spec: &CylinderSpec, k: usize, y: f64) -> f64 {
        let y = y.abs().min(self.patch_edge(spec));
        let radius = spec.outer_radius - spec.drop(y);
        let exact = |k: usize| (k as f64 * spec.element_size / radius).asin();
        if k <= self.nxp {
            return exact(k);
        }
        let (edge, edge0, pi) = (exact(self.nxp), self.theta[self.nxp], std::f64::consts::PI);
        pi - (pi - self.theta[k]) * (pi - edge) / (pi - edge0)
    }
}
