//! Bodies that are swept from a section, on meshes that show their modes.

use super::bodies::{BuiltBodies, Place};
use crate::body::{Kind, Side};
use crate::mesh::{distribute::MeshPart, CellKind};
use crate::output::BodyPart;
use crate::parallel::World;
use crate::swept::PictureModes;
use num_complex::Complex;

/// The places whose bodies have such meshes.
pub struct Pictures<'a> {
    all: Vec<(&'a Place, &'a PictureModes, MeshPart)>,
}

impl<'a> Pictures<'a> {
    /// Display meshes of the kinds that are `wanted`; the meshes are on rank 0.
    pub fn new(world: &World, bodies: &'a BuiltBodies, wanted: impl Fn(Kind) -> bool) -> Self {
        let of = |place: &'a Place| {
            let body = bodies.unique.get(place.body).filter(|b| wanted(b.kind()))?;
            let modes = body.picture()?;
            let cells = modes.picture.cells.iter().map(|nodes| {
                let kind = if nodes.len() == 8 { CellKind::Hex8 } else { CellKind::Wedge6 };
                (kind, nodes.clone())
            });
            Some((place, modes, MeshPart::undivided(world, &modes.picture.points, cells)))
        };
        Self { all: bodies.places.iter().filter_map(of).collect() }
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// The meshes, for writing.
    pub fn parts(&self) -> Vec<BodyPart<'_>> {
        self.all.iter().map(|(place, _, part)| BodyPart { part, upper: place.side == Side::Upper }).collect()
    }

    /// Index in [`BuiltBodies::unique`] of the body of each.
    pub fn bodies(&self) -> Vec<usize> {
        self.all.iter().map(|(place, ..)| place.body).collect()
    }

    /// The mode `k` of one of them at this rank's nodes, 1/√kg, `[3 · nodes]`.
    pub fn mode(&self, picture: usize, k: usize) -> Vec<f64> {
        let (_, modes, part) = &self.all[picture];
        if part.owned == 0 {
            return Vec::new();
        }
        modes.motion(k).into_flattened()
    }

    /// Real and imaginary part of the motion of one of them with these amplitudes of the modes of both bodies, at
    /// this rank's nodes, `[3 · nodes]`.
    pub fn moved(&self, picture: usize, amplitudes: &[Complex<f64>]) -> [Vec<f64>; 2] {
        let (place, modes, part) = &self.all[picture];
        if part.owned == 0 {
            return [Vec::new(), Vec::new()];
        }
        let count = modes.list.len();
        // Those of the upper body stand behind those of the lower one.
        let first = if place.side == Side::Upper { amplitudes.len().saturating_sub(count) } else { 0 };
        let own = amplitudes.get(first..first + count).unwrap_or_default();
        let of =
            |part: fn(&Complex<f64>) -> f64| modes.moved(&own.iter().map(part).collect::<Vec<f64>>()).into_flattened();
        [of(|q| q.re), of(|q| q.im)]
    }
}
