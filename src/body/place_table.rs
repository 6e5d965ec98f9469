//! What the contact sees of a body at any place of its profile, interpolated between places where it was computed.
//!
//! The modes of a body do not depend on where it is touched; ψ̂ at the contact and the compliance beside the half-space
//! do. Both are kept in axes of the body, so that they do not turn with the surface. Each place is computed with two
//! radii b of the circle of the loads near those of the contacts there, and goes with b², as means of smooth functions
//! over a circle do. Along the profile a polynomial of third degree goes through the four nearest places.

use super::half_space::HalfSpace;
use super::hybrid::{Compact, LOADS};
use crate::swept::{turned, turned_between};
use faer::Mat;

/// Numbers of a place with a circle without size, the compliance beside the half-space, row by row, and ψ̂, mode by mode;
/// then the change of all of them with b².
type Values = Vec<f64>;

/// A body as it was computed at a place of its profile.
#[derive(Debug, Clone)]
pub struct ComputedPlace {
    /// Place along the profile, m.
    pub y: f64,
    /// Angle of the frame of the contact there against the axes of the body, rad.
    pub tilt: f64,
    /// Radii of the circle of the loads, m, ascending.
    pub radii: [f64; 2],
    /// The body with both of them.
    pub compacts: [Compact; 2],
}

/// A body at places of its profile.
#[derive(Debug, Clone)]
pub struct PlaceTable {
    half_space: HalfSpace,
    modes: usize,
    /// Places along the profile, m, ascending, with their numbers.
    places: Vec<(f64, Values)>,
}

/// Numbers of `compact` in axes of the body, against which its contact is turned by `tilt`, rad.
fn in_axes(compact: &Compact, tilt: f64) -> Vec<f64> {
    let square = std::array::from_fn(|i| std::array::from_fn(|j| compact.beside[(i, j)]));
    let square = turned_between(&square, [-tilt; 2]);
    let mode = |k: usize| turned(std::array::from_fn(|c| compact.seen[(c, k)]), -tilt);
    let modes = (0..compact.seen.ncols()).flat_map(mode);
    square.into_iter().flatten().chain(modes).collect()
}

impl ComputedPlace {
    fn values(&self) -> Values {
        let [small, large] = [0, 1].map(|r| in_axes(&self.compacts[r], self.tilt));
        let [first, second] = self.radii.map(|b| b * b);
        let slope = |k: usize| (large[k] - small[k]) / (second - first);
        let values = (0..small.len()).map(|k| small[k] - first * slope(k));
        values.chain((0..small.len()).map(slope)).collect()
    }
}

impl PlaceTable {
    /// Body of the material of `half_space` with so many `modes`, at no place yet.
    pub fn new(half_space: HalfSpace, modes: usize) -> Self {
        Self { half_space, modes, places: Vec::new() }
    }

    /// Places, m, ascending.
    pub fn places(&self) -> Vec<f64> {
        self.places.iter().map(|p| p.0).collect()
    }

    /// Adds a place.
    pub fn insert(&mut self, place: &ComputedPlace) {
        let before = self.places.partition_point(|p| p.0 < place.y);
        self.places.insert(before, (place.y, place.values()));
    }

    /// The body at the place `y`, m, with a circle of `radius`, m, in a frame that is turned by `tilt`, rad.
    pub fn at(&self, y: f64, radius: f64, tilt: f64) -> Compact {
        let values = self.values(y, radius);
        let (square, modes) = values.split_at(LOADS * LOADS);
        let square = std::array::from_fn(|i| std::array::from_fn(|j| square[LOADS * i + j]));
        let square = turned_between(&square, [tilt; 2]);
        let mut seen = Mat::zeros(LOADS, self.modes);
        for (k, mode) in modes.chunks_exact(LOADS).enumerate() {
            let mode = turned(std::array::from_fn(|c| mode[c]), tilt);
            (0..LOADS).for_each(|c| seen[(c, k)] = mode[c]);
        }
        let beside = Mat::from_fn(LOADS, LOADS, |i, j| square[i][j]);
        Compact { half_space: self.half_space, beside, seen }
    }

    /// Distance of the interpolated body from the one `computed` at a place, over its size: the larger one of ψ̂ over
    /// all modes, and of the compliance over that of the contact.
    pub fn error(&self, computed: &ComputedPlace) -> f64 {
        let own = PlaceTable { places: vec![(computed.y, computed.values())], ..*self };
        let radius = computed.radii[1];
        let [found, exact] = [self, &own].map(|table| table.values(computed.y, radius));
        // Motions that go with x and y count by what they make on the circle.
        let unit = |c: usize| if c < 3 { 1.0 } else { radius };
        let contact = 0.6 / (self.half_space.plane() * radius);
        let size = |i: usize| exact[(LOADS + 1) * i].abs() * unit(i) * unit(i) + contact;
        let mut worst = 0.0f64;
        for i in 0..LOADS {
            for j in 0..LOADS {
                let off = (found[LOADS * i + j] - exact[LOADS * i + j]).abs() * unit(i) * unit(j);
                worst = worst.max(off / (size(i) * size(j)).sqrt());
            }
        }
        let square = |of: &dyn Fn(usize) -> f64| -> f64 {
            (LOADS * LOADS..exact.len()).map(|k| (of(k) * unit(k % LOADS)).powi(2)).sum()
        };
        let (off, all) = (square(&|k| found[k] - exact[k]), square(&|k| exact[k]));
        worst.max((off / all.max(f64::MIN_POSITIVE)).sqrt())
    }

    /// Compliance, row by row, then ψ̂ of a circle of `radius`, m, mode by mode.
    fn values(&self, y: f64, radius: f64) -> Vec<f64> {
        let count = LOADS * (LOADS + self.modes);
        let mut sum = vec![0.0; count];
        for (place, weight) in self.weights(y) {
            let (values, slopes) = self.places[place].1.split_at(count);
            sum.iter_mut().zip(values).for_each(|(s, v)| *s += weight * v);
            let change = weight * radius * radius;
            sum.iter_mut().zip(slopes).for_each(|(s, v)| *s += change * v);
        }
        sum
    }

    /// Weights of the four nearest places, or of all of fewer.
    fn weights(&self, y: f64) -> Vec<(usize, f64)> {
        let count = self.places.len().min(4);
        let after = self.places.partition_point(|p| p.0 < y);
        let first = after.saturating_sub(2).min(self.places.len() - count);
        let place = |k: usize| self.places[k].0;
        let weight = |k: usize| {
            let others = (first..first + count).filter(|&l| l != k);
            (k, others.map(|l| (y - place(l)) / (place(k) - place(l))).product())
        };
        (first..first + count).map(weight).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEEL: HalfSpace = HalfSpace { young: 210e9, poisson: 0.3 };

    /// A body whose numbers in its axes are a cubic of y, those of its mode also with the square of the radius.
    fn cubic(y: f64, radius: f64, tilt: f64, curve: impl Fn(f64) -> f64) -> Compact {
        let value = |k: usize| (1.0 + 0.1 * k as f64) * curve(y);
        let square = std::array::from_fn(|i| std::array::from_fn(|j| 1e-9 * value(i + j)));
        let square = turned_between(&square, [tilt; 2]);
        let mode = turned(std::array::from_fn(|c| value(c) * (1.0 + y * radius * radius)), tilt);
        Compact {
            half_space: STEEL,
            beside: Mat::from_fn(LOADS, LOADS, |i, j| square[i][j]),
            seen: Mat::from_fn(LOADS, 1, |c, _| mode[c]),
        }
    }

    fn computed(y: f64, curve: impl Fn(f64) -> f64 + Copy) -> ComputedPlace {
        let (tilt, radii) = (0.2 * y, [0.5 + 0.1 * y, 0.7 + 0.1 * y]);
        ComputedPlace { y, tilt, radii, compacts: radii.map(|b| cubic(y, b, tilt, curve)) }
    }

    fn table(curve: impl Fn(f64) -> f64 + Copy, places: &[f64]) -> PlaceTable {
        let mut table = PlaceTable::new(STEEL, 1);
        places.iter().for_each(|&y| table.insert(&computed(y, curve)));
        table
    }

    /// Polynomials are met exactly between places that are not even, in any frame and with any radius.
    #[test]
    fn polynomials_are_met_exactly() {
        let curve = |y: f64| 2.0 - y + 3.0 * y * y;
        let table = table(curve, &[1.0, -0.4, 0.3, 2.0, 1.7]);
        for (y, radius, tilt) in [(0.1, 0.6, 0.3), (1.3, 0.5, -0.2), (1.95, 0.7, 0.0), (0.3, 0.75, 0.5)] {
            let (found, wanted) = (table.at(y, radius, tilt), cubic(y, radius, tilt, curve));
            assert!((&found.beside - &wanted.beside).norm_max() < 1e-13 * wanted.beside.norm_max());
            assert!((&found.seen - &wanted.seen).norm_max() < 1e-13 * wanted.seen.norm_max());
        }
    }

    /// The error is what a place shows that is not on the polynomial, and none on one that is.
    #[test]
    fn error_is_that_of_the_interpolation() {
        let curve = |y: f64| 2.0 + y * y;
        let table = table(curve, &[0.0, 0.5, 1.0, 1.5]);
        assert!(table.error(&computed(0.7, curve)) < 1e-12);
        let error = table.error(&computed(0.7, |y| 1.01 * curve(y)));
        assert!((0.002..0.02).contains(&error), "{error}");
        // In another frame it is another body.
        let turned = ComputedPlace { tilt: 0.4, ..computed(0.7, curve) };
        assert!(table.error(&turned) > 0.05);
    }
}
