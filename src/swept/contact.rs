//! Contact of a section: the spots of its surface that carry the loads of the contact, and the frame of these loads.
//!
//! A section whose running line is that of the profile has one spot, in the tangent plane of the surface there. Where
//! the section is a stand-in with a sharp corner in place of the flange root, two spots share the loads: one on the
//! tread, one on the face of the flange. The load is then Σ s_i L_i, Σ s_i = 1, with the loads L_i of the spots turned
//! into one frame. Its mean displacement under itself is Σ s_i s_j ⟨L_i, u(L_j)⟩; that of a half-space, which the
//! contact has beside it, is part of the terms i = j alone, with the factor s_i².
//!
//! A contact lies at the angle θ_c about the axle, or at x_c along a line. With θ = θ_c + θ′ the two families of an
//! order n are those about the contact, turned by nθ_c: F_0 = cos nθ_c F_0′ − sin nθ_c F_1′, F_1 = sin nθ_c F_0′ +
//! cos nθ_c F_1′.

use super::load_frame::rotate_load_pairs;
use super::load_patch::{Square, LOADS};

/// Spot of the surface of a section that carries loads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Distance from the axle, m; along a line its period over 2π.
    pub radius: f64,
    /// Place (r, y) of its origin in the section, m.
    pub origin: [f64; 2],
    /// Angle of the tangent plane against that of a cylinder, from y to r, rad: tan is dr/dy of the surface.
    pub angle: f64,
    /// Part of the loads.
    pub share: f64,
}

/// Spots that carry the contact together.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionContact {
    spots: Vec<Spot>,
    /// Place (r, y) that is touched, m, where spots beside it stand in for it.
    touched: Option<[f64; 2]>,
    /// Angle of the frame of the loads, as that of a spot, rad.
    angle: f64,
    /// Place along the path: angle θ about the axle, rad, or distance x along a line, m.
    along: f64,
}

impl SectionContact {
    /// Contact on a surface without slope at (r, y) = (0, 0) of a section along a line, or at y = 0 of one round an
    /// axle.
    pub fn level(radius: f64) -> Self {
        Self::on(Spot { radius, origin: [0.0; 2], angle: 0.0, share: 1.0 })
    }

    /// Contact on one spot, in its own frame.
    pub fn on(spot: Spot) -> Self {
        Self { spots: vec![Spot { share: 1.0, ..spot }], touched: None, angle: spot.angle, along: 0.0 }
    }

    /// Contact on several spots, in the frame of a surface without slope, at the place (r, y) of a profile, m.
    pub fn shared(spots: Vec<Spot>, touched: [f64; 2]) -> Self {
        Self { spots, touched: Some(touched), angle: 0.0, along: 0.0 }
    }

    /// The same contact at another place along the path: at the angle `along` about the axle, rad, or at x = `along`
    /// on a line, m.
    pub(crate) fn at_place(self, along: f64) -> Self {
        Self { along, ..self }
    }

    /// The same contact in a section whose y = 0 lies `distance`, m, farther to smaller y.
    pub(super) fn shifted(mut self, distance: f64) -> Self {
        self.spots.iter_mut().for_each(|spot| spot.origin[1] += distance);
        self.touched = self.touched.map(|[r, y]| [r, y + distance]);
        self
    }

    /// Returns whether the `other` contact is this one at another place along the path.
    pub(super) fn is_along(&self, other: &Self) -> bool {
        *self == Self { along: self.along, ..other.clone() }
    }

    /// Place along the path, rad or m.
    pub fn along(&self) -> f64 {
        self.along
    }

    /// Place (r, y) of the contact in the section, m: the mean over the loads.
    pub fn origin(&self) -> [f64; 2] {
        [0, 1].map(|c| self.spots().map(|s| s.share * s.origin[c]).sum())
    }

    /// Place (r, y) that is touched, m: that of the profile where spots stand in for it.
    pub fn touched(&self) -> [f64; 2] {
        self.touched.unwrap_or([self.radius(), self.origin()[1]])
    }

    /// The spots that carry a part of the loads.
    pub fn spots(&self) -> impl Iterator<Item = &Spot> {
        self.spots.iter().filter(|s| s.share != 0.0)
    }

    /// Angle of the frame of the loads against that of a cylinder, rad.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Angle by which loads of a spot are turned into the frame of all, rad.
    pub(super) fn turn(&self, spot: &Spot) -> f64 {
        self.angle - spot.angle
    }

    /// Distance of the contact from the axle, m: the mean over the loads.
    pub fn radius(&self) -> f64 {
        self.spots().map(|s| s.share * s.radius).sum()
    }

    /// Σ s_i² T_i B_i T_iᵀ of values B_i that belong to the spots by themselves, in the frame of all.
    pub(super) fn locally(&self, of: impl Fn(&Spot) -> Square) -> Square {
        let mut all = [[0.0; LOADS]; LOADS];
        for spot in self.spots() {
            let turned = rotate_load_pairs(&of(spot), self.turn(spot));
            for (sum, value) in all.as_flattened_mut().iter_mut().zip(turned.as_flattened()) {
                *sum += spot.share * spot.share * value;
            }
        }
        all
    }
}

impl Spot {
    /// Coordinate of a point (r, y) of the section along the tangent of the spot, m; 0 at its origin.
    pub(super) fn along(&self, [r, y]: [f64; 2]) -> f64 {
        let (s, c) = self.angle.sin_cos();
        // Along a surface without slope only y counts, whatever r is.
        let rise = if s == 0.0 { 0.0 } else { s * (r - self.origin[0]) };
        c * (y - self.origin[1]) + rise
    }

    /// Returns whether a point (r, y) of the section lies farther along the axle than half the rolling radius: the
    /// surface there is that of the other wheel of a wheelset.
    pub(super) fn is_far_from(&self, [_, y]: [f64; 2]) -> bool {
        (y - self.origin[1]).abs() > 0.5 * self.radius
    }

    /// Distance from the axle at the coordinate `t`, m, along the tangent, m.
    pub(super) fn radius_at(&self, t: f64) -> f64 {
        self.radius + self.angle.sin() * t
    }
}
