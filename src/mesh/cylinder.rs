//! Built-in annular cylinder with a crowned running surface, fine at the contact and coarse far away.
//!
//! The mesh is a grid in angle, depth and width. At the contact all three are fine; outside boxes around it the columns across the width
//! are joined three by three (once per box), by templates of five hexahedra that leave no hanging node. A pure tensor grid would carry the fine
//! columns once around the whole wheel, and needs three to five times the nodes.

use super::grid::ContactGrid;
use super::joined::JoinedGrid;
use super::{grading, Mesh};
use crate::{Error, Result};

/// Default ratio of neighbouring element sizes.
pub const DEFAULT_GROWTH: f64 = 1.3;
/// Largest number of nodes that [`build`] accepts.
pub const MAX_NODES: u64 = 20_000_000;
/// Largest number of divisions in one direction.
const MAX_DIVISIONS: f64 = 200_000.0;
/// Columns are joined where the elements have grown, in angle or depth, to this many column widths.
const JOIN_AT: f64 = 2.5;

/// An annular cylinder in lower form: the contact point at the origin, the axis parallel to y at z = -`outer_radius`. All lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub struct CylinderSpec {
    /// Radius of the bore.
    pub inner_radius: f64,
    /// Radius of the running surface in the plane y = 0 of the contact point.
    pub outer_radius: f64,
    /// Width in y.
    pub thickness: f64,
    /// Radius of the running surface's profile across the width, a circular arc with its apex at the contact point; `None` for a plain cylinder.
    pub crown_radius: Option<f64>,
    /// Distance of the contact point from the mid-plane, towards +y: the mid-plane is y = -`contact_offset`.
    pub contact_offset: f64,
    /// Element size on the patch and of the first layer below it; without a patch and a `max_element_size` the size everywhere.
    pub element_size: f64,
    /// Largest ratio of neighbouring element sizes away from the patch, above 1 (see [`DEFAULT_GROWTH`]).
    pub growth: f64,
    /// Largest element size; `None`: a quarter of the thickness.
    pub max_element_size: Option<f64>,
    /// Half-length in x of the patch of equal elements; 0 for a body without contact.
    pub patch_half_length: f64,
    /// Half-width in y of the patch; 0 for a body without contact.
    pub patch_half_width: f64,
}

impl CylinderSpec {
    fn has_patch(&self) -> bool {
        self.patch_half_length > 0.0
    }

    fn largest(&self) -> f64 {
        match self.max_element_size {
            Some(h) => h,
            None if self.has_patch() => (0.25 * self.thickness).max(self.element_size),
            None => self.element_size,
        }
    }

    /// Distance of the profile below its apex at `y`, m. Written without the difference of two nearly equal numbers.
    fn drop(&self, y: f64) -> f64 {
        self.crown_radius.map_or(0.0, |rc| y * y / (rc + (rc * rc - y * y).max(0.0).sqrt()))
    }

    /// Smallest and largest y of the body, m.
    fn sides(&self) -> [f64; 2] {
        [-self.contact_offset - 0.5 * self.thickness, -self.contact_offset + 0.5 * self.thickness]
    }

    /// Volume between the bore and the running surface, m³, in closed form:
    /// π ∫ (r_s² − r_i²) dy with r_s = R − R_c + √(R_c² − y²).
    pub fn exact_volume(&self) -> f64 {
        let (r, ri) = (self.outer_radius, self.inner_radius);
        let [y0, y1] = self.sides();
        let Some(rc) = self.crown_radius else {
            return std::f64::consts::PI * (r * r - ri * ri) * self.thickness;
        };
        let c = r - rc;
        let antiderivative = |y: f64| {
            let root = (rc * rc - y * y).max(0.0).sqrt();
            (c * c + rc * rc - ri * ri) * y - y * y * y / 3.0 + c * (y * root + rc * rc * (y / rc).asin())
        };
        std::f64::consts::PI * (antiderivative(y1) - antiderivative(y0))
    }

    fn validate(&self) -> Result<()> {
        let job = |m: String| Err(Error::Job(m));
        let lengths = [
            ("inner_radius", self.inner_radius),
            ("outer_radius", self.outer_radius),
            ("thickness", self.thickness),
            ("element_size", self.element_size),
        ];
        let optional = [("crown_radius", self.crown_radius), ("max_element_size", self.max_element_size)];
        let optional = optional.iter().filter_map(|(name, value)| value.map(|v| (*name, v)));
        for (name, value) in lengths.into_iter().chain(optional) {
            if !(value.is_finite() && value > 0.0) {
                return job(format!("cylinder.{name} is {value}; expected a length above 0 m"));
            }
        }
        if !self.contact_offset.is_finite() {
            return job(format!("cylinder.contact_offset is {}; expected a finite length in m", self.contact_offset));
        }
        for (name, value) in [("half_length", self.patch_half_length), ("half_width", self.patch_half_width)] {
            if !(value.is_finite() && value >= 0.0) {
                return job(format!("contact.patch.{name} is {value}; expected a length above 0 m"));
            }
        }
        if !(self.growth.is_finite() && self.growth > 1.0 && self.growth <= 4.0) {
            return job(format!(
                "cylinder.growth is {}; expected a ratio of neighbouring element sizes above 1 and at most 4, such as {DEFAULT_GROWTH}",
                self.growth
            ));
        }
        if self.inner_radius >= self.outer_radius {
            return job(format!(
                "cylinder.inner_radius is {} m, not below cylinder.outer_radius, {} m",
                self.inner_radius, self.outer_radius
            ));
        }
        if let Some(h) = self.max_element_size.filter(|&h| h < self.element_size) {
            return job(format!(
                "cylinder.max_element_size is {h} m, below cylinder.element_size, {} m; raise it or leave it out",
                self.element_size
            ));
        }
        if self.has_patch() != (self.patch_half_width > 0.0) {
            return job(format!(
                "contact.patch is {} m by {} m (half_length, half_width); expected both above 0",
                self.patch_half_length, self.patch_half_width
            ));
        }
        let [y0, y1] = self.sides();
        if y0 >= 0.0 || y1 <= 0.0 {
            return job(format!(
                "cylinder.contact_offset is {} m, outside the body: with cylinder.thickness {} m it must lie between {} and {} m",
                self.contact_offset,
                self.thickness,
                -0.5 * self.thickness,
                0.5 * self.thickness
            ));
        }
        if let Some(rc) = self.crown_radius {
            let reach = y1.max(-y0);
            if rc < reach {
                return job(format!(
                    "cylinder.crown_radius is {rc} m: the arc ends before the side of the body, {reach} m from its apex; expected at least that"
                ));
            }
            let lowest = self.outer_radius - self.drop(reach);
            if lowest <= self.inner_radius * (1.0 + 1e-9) {
                return job(format!(
                    "cylinder.crown_radius is {rc} m: at the side of the body, {reach} m from the apex, the running surface falls to a radius of {lowest:.6} m, \
                     not above cylinder.inner_radius, {} m; expected a larger crown radius",
                    self.inner_radius
                ));
            }
        }
        Ok(())
    }

    /// Rounds the patch up to whole elements and checks that it lies on the body.
    fn patch(&self) -> Result<(usize, usize)> {
        if !self.has_patch() {
            return Ok((0, 0));
        }
        let h = self.element_size;
        let whole = |length: f64| ((length / h) * (1.0 - 1e-9)).ceil().max(1.0);
        let (nx, ny) = (whole(self.patch_half_length), whole(self.patch_half_width));
        let [y0, y1] = self.sides();
        let room = y1.min(-y0);
        if ny * h > room * (1.0 + 1e-9) {
            return Err(Error::Job(format!(
                "contact.patch.half_width is {} m, in whole elements of cylinder.element_size {} m; the side of the body is {room} m from the contact point; \
                 expected a smaller patch (or elements that fit)",
                ny * h,
                h
            )));
        }
        if nx * h > 0.5 * (self.outer_radius - self.drop(ny * h)) {
            return Err(Error::Job(format!(
                "contact.patch.half_length is {} m; expected at most half of cylinder.outer_radius, {} m",
                nx * h,
                self.outer_radius
            )));
        }
        for (side, rest) in [("-y", -y0 - ny * h), ("+y", y1 - ny * h)] {
            if rest > 1e-9 * h && rest < 0.1 * h {
                return Err(Error::Job(format!(
                    "contact.patch.half_width leaves a strip of {rest:.3e} m to the {side} side of the body, less than a tenth of cylinder.element_size {h} m; \
                     expected a patch that ends there or farther away"
                )));
            }
        }
        Ok((nx as usize, ny as usize))
    }

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
            size *= 1.05;
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
        let most = (half_patch / h).max(half_turn.max(self.thickness) / largest);
        if most > MAX_DIVISIONS {
            return Ok(Divided::TooMany(most));
        }
        let (nxp, nyp) = self.patch()?;
        let first = if self.has_patch() { h * self.growth } else { h };

        // Angle: arcs measured on the running surface at y = 0. Patch lines lie at exact x, not at exact arcs.
        let mut theta: Vec<f64> = (0..=nxp).map(|i| (i as f64 * h / r).asin()).collect();
        let edge = theta[nxp] * r;
        let rest = half_turn - edge;
        theta.extend(
            ends(
                &grading::sizes(rest, grading::elements(rest, first, self.growth, largest), first, largest),
                edge,
                half_turn,
            )
            .map(|arc| arc / r),
        );

        // Depth: layers from the running surface down.
        let layers = grading::sizes(depth, grading::elements(depth, h, self.growth, largest), h, largest);
        let mut below = vec![0.0];
        below.extend(ends(&layers, 0.0, depth));

        let arcs: Vec<f64> = theta.iter().map(|t| t * r).collect();
        let clear = 0.5 * half_patch;
        let mut best: Option<(u64, Layout)> = None;
        for joins in 0..=if self.has_patch() { 3 } else { 0 } {
            let Some((y, j0)) = self.width(joins, nyp, first) else { continue };
            let mut level_r = levels(&below, 0, joins, h, clear);
            level_r.reverse();
            let grid = JoinedGrid { columns: y.len() - 1, level_theta: levels(&arcs, nxp, joins, h, clear), level_r };
            let nodes = grid.count().0;
            if best.as_ref().is_none_or(|(n, _)| nodes < *n) {
                let s = below.iter().rev().map(|b| 1.0 - b / depth).collect();
                best = Some((nodes, Layout { theta: theta.clone(), s, y, nxp, nyp, j0, grid }));
            }
        }
        best.map(|(_, l)| Divided::Grid(l)).ok_or_else(|| Error::Defect("no division of the cylinder's width".into()))
    }

    /// Lines across the width, m, ascending, in a multiple of 3^`joins` columns, and the index of the line y = 0. `None` where so many
    /// columns cannot be joined and stay below the largest size.
    fn width(&self, joins: u32, nyp: usize, first: f64) -> Option<(Vec<f64>, usize)> {
        let h = self.element_size;
        let [y0, y1] = self.sides();
        let largest = self.largest();
        let group = 3usize.pow(joins);
        if joins > 0 && group as f64 * h > largest {
            return None;
        }
        if !self.has_patch() && self.max_element_size.is_none() {
            // A plain body: equal columns; no line need pass through the contact point.
            let n = grading::elements(self.thickness, h, self.growth, h);
            return Some(((0..=n).map(|j| y0 + self.thickness * (j as f64 / n as f64)).collect(), 0));
        }
        let cap = (largest / group as f64).max(h);
        let edge = nyp as f64 * h;
        let rest = [-y0 - edge, y1 - edge].map(|l| if l <= 1e-9 * h { 0.0 } else { l });
        let mut n = rest.map(|l| grading::elements(l, first, self.growth, cap));
        while (n[0] + n[1] + 2 * nyp) % group > 0 {
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

/// Level of each division of a line, `[positions.len()]`: how often columns of width `h` are joined there. A level begins behind the first
/// element that is long enough for the joined columns and at least `clear` from the patch, whose edge is division `edge`.
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
struct Layout {
    /// Angles of half a turn at y = 0, `[nh + 1]`, from 0 to π.
    theta: Vec<f64>,
    /// Depth fraction, `[nr + 1]`: 0 at the bore, 1 at the running surface.
    s: Vec<f64>,
    /// Lines across the width, m, `[ny + 1]`, ascending.
    y: Vec<f64>,
    /// Patch columns on either side of x = 0.
    nxp: usize,
    /// Patch columns on either side of y = 0.
    nyp: usize,
    /// Index in `y` of the line y = 0 (of a body with a patch).
    j0: usize,
    grid: JoinedGrid,
}

enum Divided {
    Grid(Layout),
    TooMany(f64),
}

impl Layout {
    fn new(spec: &CylinderSpec) -> Result<Self> {
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

    /// Position in lower form of the point in angle column `a` (half columns allowed, negative towards -x), depth fraction `s` and width line `j`.
    fn position(&self, spec: &CylinderSpec, a: f64, s: f64, j: usize) -> [f64; 3] {
        let y = self.y[j];
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

    fn patch_edge(&self, spec: &CylinderSpec) -> f64 {
        self.nyp as f64 * spec.element_size
    }

    /// Angle of column `k` ≥ 0 at `y`: on the patch the one whose surface point has the column's exact x, beside it (in y) as at its edge; the columns
    /// outside share the rest of the half turn in proportion.
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

/// Number of nodes and of cells that [`build`] would make, without building them.
pub fn count(spec: &CylinderSpec) -> Result<(u64, u64)> {
    Ok(Layout::new(spec)?.grid.count())
}

/// Builds the mesh with the facet groups `inner`, `outer`, `side_minus`, `side_plus` and, if there is a patch, `contact` (a part of `outer`), and the
/// grid of the patch.
pub fn build(spec: &CylinderSpec) -> Result<(Mesh, Option<ContactGrid>)> {
    let layout = Layout::new(spec)?;
    let patch_columns = layout.j0.wrapping_sub(layout.nyp)..=layout.j0 + layout.nyp;
    let mut built = layout.grid.build(
        |a, t, j| layout.position(spec, a, t.interpolate(&layout.s), j),
        |a, j| spec.has_patch() && a.unsigned_abs() as usize <= layout.nxp && patch_columns.contains(&j),
    );
    let grid = spec.has_patch().then(|| {
        let h = spec.element_size;
        let (nx, ny) = (layout.nxp as i64, layout.nyp as i64);
        let mut nodes = Vec::new();
        for j in -ny..=ny {
            for i in -nx..=nx {
                nodes.push(built.surface_node(i, (layout.j0 as i64 + j) as usize));
            }
        }
        ContactGrid {
            x: (-nx..=nx).map(|i| i as f64 * h).collect(),
            y: (-ny..=ny).map(|j| j as f64 * h).collect(),
            z: nodes.iter().map(|&n| built.mesh.nodes[n as usize][2]).collect(),
            nodes,
        }
    });
    if !spec.has_patch() {
        built.mesh.groups.remove("contact");
    }
    Ok((built.mesh, grid))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::quality::jacobian_range;
    use std::collections::HashMap;

    fn paper(element_size: f64) -> CylinderSpec {
        CylinderSpec {
            inner_radius: 0.1,
            outer_radius: 0.5,
            thickness: 0.1,
            crown_radius: Some(0.5),
            contact_offset: 0.0,
            element_size,
            growth: DEFAULT_GROWTH,
            max_element_size: None,
            patch_half_length: 7e-3,
            patch_half_width: 7e-3,
        }
    }

    fn plain(element_size: f64) -> CylinderSpec {
        CylinderSpec { crown_radius: None, patch_half_length: 0.0, patch_half_width: 0.0, ..paper(element_size) }
    }

    /// Every face is shared by two cells or lies in exactly one of the four boundary groups; contact lies in outer.
    fn check_watertight(mesh: &Mesh) {
        let key = |mut f: [u32; 4]| {
            f.sort_unstable();
            f
        };
        let mut faces: HashMap<[u32; 4], (usize, usize)> = HashMap::new();
        for cell in &mesh.cells {
            for face in crate::mesh::joined::FACES {
                faces.entry(key(face.map(|i| cell[i]))).or_default().0 += 1;
            }
        }
        for name in ["inner", "outer", "side_minus", "side_plus"] {
            for facet in &mesh.groups[name] {
                faces.get_mut(&key(*facet)).expect("a facet is a face of a cell").1 += 1;
            }
        }
        for (face, (cells, groups)) in &faces {
            assert!(
                (*cells, *groups) == (2, 0) || (*cells, *groups) == (1, 1),
                "face {face:?}: {cells} cells, {groups} groups"
            );
        }
        if let Some(contact) = mesh.groups.get("contact") {
            let outer: std::collections::HashSet<_> = mesh.groups["outer"].iter().collect();
            assert!(!contact.is_empty() && contact.iter().all(|f| outer.contains(f)));
        }
        let mut used = vec![false; mesh.nodes.len()];
        mesh.cells.iter().flatten().for_each(|&n| used[n as usize] = true);
        assert!(used.iter().all(|&u| u), "unused nodes");
    }

    fn cases() -> Vec<CylinderSpec> {
        vec![
            paper(1e-3),
            paper(2e-3),
            CylinderSpec { contact_offset: 0.03, ..paper(1e-3) },
            CylinderSpec { contact_offset: -0.02, crown_radius: Some(0.3), ..paper(1.5e-3) },
            CylinderSpec { patch_half_length: 0.1, patch_half_width: 0.05, ..paper(0.01) },
            CylinderSpec { patch_half_length: 3e-3, patch_half_width: 9e-3, growth: 1.8, ..paper(0.7e-3) },
            CylinderSpec { inner_radius: 0.45, ..paper(1e-3) },
            CylinderSpec { inner_radius: 0.001, outer_radius: 0.06, crown_radius: None, ..paper(2e-3) },
            plain(0.03),
            CylinderSpec { max_element_size: Some(0.05), ..plain(0.005) },
        ]
    }

    #[test]
    fn meshes_are_watertight_with_positive_jacobians_and_the_counted_size() {
        for spec in cases() {
            let (mesh, grid) = build(&spec).expect("a valid cylinder");
            assert_eq!(count(&spec).expect("a valid cylinder"), (mesh.nodes.len() as u64, mesh.cells.len() as u64));
            check_watertight(&mesh);
            for cell in &mesh.cells {
                let [low, high] = jacobian_range(&mesh.corners(cell));
                assert!(low > 0.02 * high, "{spec:?}: Jacobian from {low:e} to {high:e}");
            }
            assert_eq!(grid.is_some(), spec.patch_half_length > 0.0);
        }
    }

    #[test]
    fn halves_are_mirror_images() {
        for spec in cases() {
            let (mesh, _) = build(&spec).expect("a valid cylinder");
            let bits = |p: [f64; 3]| p.map(|v| (v + 0.0).to_bits());
            let all: std::collections::HashSet<_> = mesh.nodes.iter().map(|&p| bits(p)).collect();
            assert_eq!(all.len(), mesh.nodes.len(), "coinciding nodes");
            for &[x, y, z] in &mesh.nodes {
                assert!(all.contains(&bits([-x, y, z])), "no mirror image of {:?}", [x, y, z]);
            }
        }
    }

    #[test]
    fn volume_converges_at_second_order() {
        for spec in [plain(0.04), CylinderSpec { contact_offset: 0.02, crown_radius: Some(0.2), ..plain(0.04) }] {
            let error = |h: f64| {
                let s = CylinderSpec { element_size: h, ..spec.clone() };
                let (mesh, _) = build(&s).expect("a valid cylinder");
                (mesh.volume() / s.exact_volume() - 1.0).abs()
            };
            let (coarse, fine) = (error(0.025), error(0.0125));
            let order = (coarse / fine).log2();
            assert!(fine < 1e-3 && order > 1.8 && order < 2.3, "errors {coarse:e} {fine:e}, order {order}");
        }
        let spec = paper(1e-3);
        let (mesh, _) = build(&spec).expect("a valid cylinder");
        let error = mesh.volume() / spec.exact_volume() - 1.0;
        assert!(error.abs() < 1e-3, "{error:e}");
    }

    #[test]
    fn exact_volume_equals_quadrature() {
        let spec = CylinderSpec { contact_offset: 0.02, crown_radius: Some(0.2), ..paper(1e-3) };
        let [y0, y1] = spec.sides();
        let n = 20_000;
        let h = (y1 - y0) / n as f64;
        let sum: f64 = (0..n)
            .map(|k| {
                let r = spec.outer_radius - spec.drop(y0 + (k as f64 + 0.5) * h);
                std::f64::consts::PI * (r * r - spec.inner_radius * spec.inner_radius) * h
            })
            .sum();
        let exact = spec.exact_volume();
        assert!((sum / exact - 1.0).abs() < 1e-8, "{sum} {exact}");
    }

    #[test]
    fn patch_nodes_are_exact_and_match_between_bodies() {
        let lower = CylinderSpec { contact_offset: 0.03, ..paper(1e-3) };
        let upper = CylinderSpec { outer_radius: 0.3, crown_radius: Some(0.08), contact_offset: 0.02, ..paper(1e-3) };
        let mut grids = Vec::new();
        for spec in [lower, upper] {
            let (mesh, grid) = build(&spec).expect("a valid cylinder");
            let grid = grid.expect("a patch");
            assert_eq!((grid.x.len(), grid.y.len()), (15, 15));
            assert_eq!((grid.x[7], grid.y[7], grid.z[7 + 15 * 7]), (0.0, 0.0, 0.0));
            for (j, &y) in grid.y.iter().enumerate() {
                for (i, &x) in grid.x.iter().enumerate() {
                    let k = i + 15 * j;
                    let [px, py, pz] = mesh.nodes[grid.nodes[k] as usize];
                    assert_eq!((px, py, pz), (x, y, grid.z[k]));
                    // On the body of revolution: (x² + (z + R)²) = r_s(y)², written as the difference from the apex.
                    let r = spec.outer_radius - spec.drop(y);
                    let error = ((x * x + (pz + spec.outer_radius).powi(2)).sqrt() - r).abs();
                    assert!(error < 1e-15, "node ({i}, {j}) is {error:e} m off the surface");
                }
            }
            assert_eq!(mesh.groups["contact"].len(), 14 * 14);
            grids.push(grid);
        }
        assert_eq!((&grids[0].x, &grids[0].y), (&grids[1].x, &grids[1].y));
    }

    #[test]
    fn a_wheel_at_one_millimetre_needs_about_a_hundred_thousand_dofs() {
        let dofs = 3 * count(&paper(1e-3)).expect("a valid cylinder").0;
        assert!((60_000..150_000).contains(&dofs), "{dofs} dofs");
    }

    #[test]
    fn impossible_cylinders_are_refused_with_the_key_to_change() {
        let p = paper(1e-3);
        let bad = [
            (CylinderSpec { inner_radius: 0.5, ..p.clone() }, "inner_radius"),
            (CylinderSpec { outer_radius: f64::NAN, ..p.clone() }, "outer_radius"),
            (CylinderSpec { thickness: 0.0, ..p.clone() }, "thickness"),
            (CylinderSpec { thickness: f64::INFINITY, ..p.clone() }, "thickness"),
            (CylinderSpec { crown_radius: Some(-1.0), ..p.clone() }, "crown_radius"),
            (CylinderSpec { crown_radius: Some(0.04), ..p.clone() }, "crown_radius"),
            (CylinderSpec { crown_radius: Some(0.05), inner_radius: 0.46, ..p.clone() }, "crown_radius"),
            (CylinderSpec { contact_offset: 0.05, ..p.clone() }, "contact_offset"),
            (CylinderSpec { contact_offset: -0.06, ..p.clone() }, "contact_offset"),
            (CylinderSpec { element_size: -1e-3, ..p.clone() }, "element_size"),
            (CylinderSpec { element_size: 1e-12, ..p.clone() }, "would fit"),
            (CylinderSpec { element_size: 1e-5, ..p.clone() }, "would fit"),
            (CylinderSpec { element_size: 1e-300, ..p.clone() }, "would fit"),
            (CylinderSpec { max_element_size: Some(5e-4), ..p.clone() }, "max_element_size"),
            (CylinderSpec { growth: 1.0, ..p.clone() }, "growth"),
            (CylinderSpec { patch_half_width: 0.06, ..p.clone() }, "half_width"),
            (CylinderSpec { patch_half_length: 0.3, ..p.clone() }, "half_length"),
            (CylinderSpec { patch_half_length: 0.0, ..p.clone() }, "contact.patch"),
            (CylinderSpec { contact_offset: 0.04295, ..p.clone() }, "strip"),
            (CylinderSpec { element_size: 1e-9, ..plain(1.0) }, "would fit"),
        ];
        for (spec, word) in bad {
            let error = build(&spec).expect_err(&format!("{word}: {spec:?}"));
            assert_eq!(error.exit_code(), 2);
            assert!(error.message().contains(word), "{word} not in: {error}");
            assert_eq!(count(&spec).expect_err("the same").message(), error.message());
        }
    }

    #[test]
    fn the_size_that_would_fit_fits() {
        let error = build(&paper(1e-12)).expect_err("far too fine");
        let text = error.message();
        let size: f64 =
            text.split("; ").nth(1).and_then(|t| t.split(' ').next()).and_then(|t| t.parse().ok()).expect(text);
        let (nodes, _) = count(&paper(1.01 * size)).expect("the advised size");
        assert!(nodes <= MAX_NODES && nodes > MAX_NODES / 4, "{nodes} nodes at {size} m");
    }

    #[test]
    fn reflection_keeps_jacobians_positive_and_undoes_itself() {
        let (mesh, _) = build(&paper(2e-3)).expect("a valid cylinder");
        let up = mesh.reflected();
        assert!(up.cells.iter().all(|c| jacobian_range(&up.corners(c))[0] > 0.0));
        assert!((up.volume() / mesh.volume() - 1.0).abs() < 1e-12);
        assert_eq!(up.reflected(), mesh);
        assert_eq!(up.reflected().checksum(), mesh.checksum());
        assert_ne!(up.checksum(), mesh.checksum());
        assert!(mesh.identical(&up.reflected()) && !mesh.identical(&up));
    }
}
