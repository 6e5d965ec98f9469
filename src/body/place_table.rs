//! Modes and compliance of a body at a contact on any place of its profile, interpolated between computed places.
//!
//! The modes of a body do not depend on where it is touched; ψ̂ at the contact and the compliance beside the half-space
//! do. Both are kept in axes of the body, so that they do not turn with the surface. Each place is computed with three
//! radii b of the circle of the loads, which the radii of the contacts there lie between, on one mesh: the compliance
//! depends on the mesh below the load by up to 0.3 % of that of the contact. Between them a parabola in b is taken,
//! along the profile a polynomial of third degree through the four nearest places.

use super::half_space::HalfSpace;
use super::hybrid::{Compact, LOADS};
use crate::swept::{rotate_load_pairs_between, rotate_loads};
use faer::Mat;

/// Numbers of a place with a circle of the radius of reference, the compliance beside the half-space, row by row, and
/// ψ̂, mode by mode; then their coefficients of t and t², t the deviation of the radius over that of reference.
type Values = Vec<f64>;

/// A body as it was computed at a place of its profile.
#[derive(Debug, Clone)]
pub struct ComputedPlace {
    /// Place along the profile, m.
    pub y: f64,
    /// Angle of the frame of the contact there against the axes of the body, rad.
    pub tilt: f64,
    /// Radii of the circle of the loads, m, ascending.
    pub radii: [f64; 3],
    /// The body with each of them.
    pub compacts: [Compact; 3],
}

/// A body at places of its profile.
#[derive(Debug, Clone)]
pub struct PlaceTable {
    half_space: HalfSpace,
    modes: usize,
    /// Radius of reference, m.
    radius: f64,
    /// Places along the profile, m, ascending, with their numbers.
    places: Vec<(f64, Values)>,
}

/// Numbers of `compact` in axes of the body, against which its contact is turned by `tilt`, rad.
fn in_axes(compact: &Compact, tilt: f64) -> Vec<f64> {
    let square = std::array::from_fn(|i| std::array::from_fn(|j| compact.beside[(i, j)]));
    let square = rotate_load_pairs_between(&square, [-tilt; 2]);
    let mode = |k: usize| rotate_loads(std::array::from_fn(|c| compact.seen[(c, k)]), -tilt);
    let modes = (0..compact.seen.ncols()).flat_map(mode);
    square.into_iter().flatten().chain(modes).collect()
}

/// Coefficients of the parabola through three values `v` at `t`.
fn parabola(t: [f64; 3], v: [f64; 3]) -> [f64; 3] {
    let slope = |i: usize, j: usize| (v[j] - v[i]) / (t[j] - t[i]);
    let bend = (slope(1, 2) - slope(0, 1)) / (t[2] - t[0]);
    let first = slope(0, 1) - bend * (t[0] + t[1]);
    [v[0] - t[0] * (first + bend * t[0]), first, bend]
}

impl ComputedPlace {
    fn values(&self, reference: f64) -> Values {
        let all = [0, 1, 2].map(|r| in_axes(&self.compacts[r], self.tilt));
        let t = self.radii.map(|b| b / reference - 1.0);
        let coefficients: Vec<[f64; 3]> =
            (0..all[0].len()).map(|k| parabola(t, [0, 1, 2].map(|r| all[r][k]))).collect();
        (0..3).flat_map(|power| coefficients.iter().map(move |c| c[power])).collect()
    }
}

impl PlaceTable {
    /// Body of the material of `half_space` with so many `modes`, at no place yet, with circles of about `radius`, m.
    pub fn new(half_space: HalfSpace, modes: usize, radius: f64) -> Self {
        Self { half_space, modes, radius, places: Vec::new() }
    }

    /// Table of the same body with one `place` alone, which is exact there.
    pub fn only(&self, place: &ComputedPlace) -> Self {
        Self { places: vec![(place.y, place.values(self.radius))], ..*self }
    }

    /// Places, m, ascending.
    pub fn places(&self) -> Vec<f64> {
        self.places.iter().map(|p| p.0).collect()
    }

    /// Adds a place.
    pub fn insert(&mut self, place: &ComputedPlace) {
        let before = self.places.partition_point(|p| p.0 < place.y);
        self.places.insert(before, (place.y, place.values(self.radius)));
    }

    /// The body at the place `y`, m, with a circle of `radius`, m, in a frame that is turned by `tilt`, rad.
    pub fn interpolated(&self, y: f64, radius: f64, tilt: f64) -> Compact {
        let values = self.values(y, radius);
        let (square, modes) = values.split_at(LOADS * LOADS);
        let square = std::array::from_fn(|i| std::array::from_fn(|j| square[LOADS * i + j]));
        let square = rotate_load_pairs_between(&square, [tilt; 2]);
        let mut seen = Mat::zeros(LOADS, self.modes);
        for (k, mode) in modes.chunks_exact(LOADS).enumerate() {
            let mode = rotate_loads(std::array::from_fn(|c| mode[c]), tilt);
            (0..LOADS).for_each(|c| seen[(c, k)] = mode[c]);
        }
        let beside = Mat::from_fn(LOADS, LOADS, |i, j| square[i][j]);
        Compact { half_space: self.half_space, near: Vec::new(), beside, seen }
    }

    /// Distance of the interpolated body from the one `computed` at a place, over its size: the larger one of ψ̂ over
    /// all modes, and of the compliance over that of the contact.
    pub fn error(&self, computed: &ComputedPlace) -> f64 {
        let radius = computed.radii[1];
        let [found, exact] = [self, &self.only(computed)].map(|table| table.values(computed.y, radius));
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
        let t = radius / self.radius - 1.0;
        for (place, weight) in self.weights(y) {
            for (values, power) in self.places[place].1.chunks_exact(count).zip([1.0, t, t * t]) {
                let factor = weight * power;
                sum.iter_mut().zip(values).for_each(|(s, v)| *s += factor * v);
            }
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
        let square = rotate_load_pairs_between(&square, [tilt; 2]);
        let mode = rotate_loads(std::array::from_fn(|c| value(c) * (1.0 + y * radius * radius)), tilt);
        Compact {
            half_space: STEEL,
            near: Vec::new(),
            beside: Mat::from_fn(LOADS, LOADS, |i, j| square[i][j]),
            seen: Mat::from_fn(LOADS, 1, |c, _| mode[c]),
        }
    }

    fn computed(y: f64, curve: impl Fn(f64) -> f64 + Copy) -> ComputedPlace {
        let (tilt, radii) = (0.2 * y, [0.5, 0.65, 0.7].map(|b| b + 0.1 * y));
        ComputedPlace { y, tilt, radii, compacts: radii.map(|b| cubic(y, b, tilt, curve)) }
    }

    fn table(curve: impl Fn(f64) -> f64 + Copy, places: &[f64]) -> PlaceTable {
        let mut table = PlaceTable::new(STEEL, 1, 0.6);
        places.iter().for_each(|&y| table.insert(&computed(y, curve)));
        table
    }

    /// Polynomials are met exactly between places that are not even, in any frame and with any radius.
    #[test]
    fn polynomials_are_met_exactly() {
        let curve = |y: f64| 2.0 - y + 3.0 * y * y;
        let table = table(curve, &[1.0, -0.4, 0.3, 2.0, 1.7]);
        for (y, radius, tilt) in [(0.1, 0.6, 0.3), (1.3, 0.5, -0.2), (1.95, 0.7, 0.0), (0.3, 0.75, 0.5)] {
            let (found, wanted) = (table.interpolated(y, radius, tilt), cubic(y, radius, tilt, curve));
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
