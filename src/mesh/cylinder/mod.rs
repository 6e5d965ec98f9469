//! Built-in annular cylinder with a crowned running surface, fine at the contact and coarse far away.
//!
//! The mesh is a grid in angle, depth and width. At the contact all three are fine; outside boxes around it the
//! columns across the width are joined three by three (once per box), by templates of five hexahedra that leave no
//! hanging node. A pure tensor grid would carry the fine columns once around the whole wheel, and needs three to five
//! times the nodes. Away from the contact the columns move to places that do not depend on where it is; around the
//! bore they are joined once less.

mod grading;
mod joined;
mod layout;
#[cfg(test)]
mod tests;

use super::Mesh;
use crate::{Error, Result};
use layout::CylinderLayout;

/// Default ratio of neighbouring element sizes.
pub const DEFAULT_GROWTH: f64 = 1.3;
/// Largest number of nodes that [`build`] accepts.
pub const MAX_NODES: u64 = 20_000_000;

/// An annular cylinder in lower form: the contact point at the origin, the axis parallel to y at z = -`outer_radius`.
/// All lengths in m.
///
/// ```
/// use railsqueal::mesh::cylinder::{build, CylinderSpec, DEFAULT_GROWTH};
///
/// let ring = CylinderSpec {
///     inner_radius: 0.1,
///     outer_radius: 0.2,
///     thickness: 0.05,
///     crown_radius: None,
///     contact_offset: 0.0,
///     element_size: 0.025,
///     growth: DEFAULT_GROWTH,
///     max_element_size: None,
///     patch_half_length: 0.0,
///     patch_half_width: 0.0,
/// };
/// let mesh = build(&ring)?;
/// // The contact point is at the origin, the axis at z = −0.2 m.
/// let highest = mesh.nodes.iter().map(|x| x[2]).fold(f64::NEG_INFINITY, f64::max);
/// assert!(highest.abs() < 1e-12 && mesh.groups.contains_key("inner"));
/// // Straight edges between the nodes lose less than a hundredth of the volume.
/// assert!((0.99..1.0).contains(&(mesh.volume() / ring.exact_volume())));
/// # Ok::<(), railsqueal::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CylinderSpec {
    /// Radius of the bore.
    pub inner_radius: f64,
    /// Radius of the running surface in the plane y = 0 of the contact point.
    pub outer_radius: f64,
    /// Width in y.
    pub thickness: f64,
    /// Radius of the running surface's profile across the width, a circular arc with its apex at the contact point;
    /// `None` for a plain cylinder.
    pub crown_radius: Option<f64>,
    /// Distance of the contact point from the mid-plane, towards +y: the mid-plane is y = -`contact_offset`.
    pub contact_offset: f64,
    /// Element size on the patch and of the first layer below it; without a patch, at the edges of the bore; without a
    /// patch and a `max_element_size`, the size everywhere.
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

    /// Largest element size, m, given or by default.
    pub fn largest(&self) -> f64 {
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
                "cylinder.growth is {}; expected a ratio of neighbouring element sizes above 1 and at most 4, \
                 such as {DEFAULT_GROWTH}",
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
                "cylinder.contact_offset is {} m, outside the body: with cylinder.thickness {} m it must lie \
                 between {} and {} m",
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
                    "cylinder.crown_radius is {rc} m: the arc ends before the side of the body, {reach} m from \
                     its apex; expected at least that"
                ));
            }
            let lowest = self.outer_radius - self.drop(reach);
            if lowest <= self.inner_radius * (1.0 + 1e-9) {
                return job(format!(
                    "cylinder.crown_radius is {rc} m: at the side of the body, {reach} m from the apex, the \
                     running surface falls to a radius of {lowest:.6} m, \
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
        // Messages say lengths to the nanometre, without the rounding of sums.
        let told = |length: f64| (length * 1e9).round() / 1e9;
        if ny * h > room * (1.0 + 1e-9) {
            return Err(Error::Job(format!(
                "contact.patch.half_width is {} m, in whole elements of cylinder.element_size {} m; the side of \
                 the body is {} m from the contact point; \
                 expected a smaller patch (or elements that fit)",
                told(ny * h),
                h,
                told(room)
            )));
        }
        if nx * h > 0.5 * (self.outer_radius - self.drop(ny * h)) {
            return Err(Error::Job(format!(
                "contact.patch.half_length is {} m; expected at most half of cylinder.outer_radius, {} m",
                told(nx * h),
                self.outer_radius
            )));
        }
        for (side, rest) in [("-y", -y0 - ny * h), ("+y", y1 - ny * h)] {
            if rest > 1e-9 * h && rest < 0.1 * h {
                return Err(Error::Job(format!(
                    "contact.patch.half_width leaves a strip of {rest:.3e} m to the {side} side of the body, \
                     less than a tenth of cylinder.element_size {h} m; \
                     expected a patch that ends there or farther away"
                )));
            }
        }
        Ok((nx as usize, ny as usize))
    }
}

/// Number of nodes and of cells that [`build`] would make, without building them.
pub fn count(spec: &CylinderSpec) -> Result<(u64, u64)> {
    Ok(CylinderLayout::new(spec)?.grid.count())
}

/// Builds the mesh with the facet groups `inner`, `outer`, `side_minus`, `side_plus` and, if there is a patch,
/// `contact` (a part of `outer`). Nodes of the patch lie on lines x = const and y = const through the whole multiples
/// of the element size.
pub fn build(spec: &CylinderSpec) -> Result<Mesh> {
    let layout = CylinderLayout::new(spec)?;
    let patch_columns = layout.j0.wrapping_sub(layout.nyp)..=layout.j0 + layout.nyp;
    let mut mesh = layout.grid.build(
        |a, t, j| layout.position(spec, a, t.interpolate(&layout.s), j),
        |a, j| spec.has_patch() && a.unsigned_abs() as usize <= layout.nxp && patch_columns.contains(&j),
    );
    if !spec.has_patch() {
        mesh.groups.remove("contact");
    }
    Ok(mesh)
}
