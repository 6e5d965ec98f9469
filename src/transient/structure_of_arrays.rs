//! Vectors over contact nodes sorted by components, for loops that take several nodes at a time.

use bytemuck::Pod;
use pulp::{Arch, Simd, WithSimd};

use super::aligned::AlignedVec;

/// Nodes taken at a time: the numbers in a line.
pub(super) const LANES: usize = 8;

/// A number of each of these nodes.
pub(super) type Lane<T = f64> = [T; LANES];

/// The number of each lane. Straight code over a few lanes is what the compiler turns into vector instructions,
/// whatever it knows of the memory around.
#[inline(always)]
pub(super) fn lane<T>(of: impl FnMut(usize) -> T) -> Lane<T> {
    std::array::from_fn(of)
}

/// The first `blocks` lanes of a row of whole lines.
#[inline(always)]
pub(super) fn lanes<T: Pod>(row: &[T], blocks: usize) -> &[Lane<T>] {
    &bytemuck::cast_slice(row)[..blocks]
}

/// [`lanes`] to be changed.
#[inline(always)]
pub(super) fn lanes_mut<T: Pod>(row: &mut [T], blocks: usize) -> &mut [Lane<T>] {
    &mut bytemuck::cast_slice_mut(row)[..blocks]
}

/// Components (x, y, n) of k nodes, each in a row of l ≥ k places that fill whole lines; zeros where there is no node.
#[derive(Debug, Clone, Default)]
pub(super) struct SoaVec3 {
    /// `[3][l]`.
    numbers: AlignedVec<f64>,
    /// l.
    places: usize,
}

impl SoaVec3 {
    /// Zeros in `places` of whole lines.
    pub(super) fn zeros(places: usize) -> Self {
        Self { numbers: AlignedVec::zeros(3 * places), places }
    }

    /// The vector `v`, `[k][3]`.
    pub(super) fn from_interleaved(v: &[f64], places: usize) -> Self {
        let mut new = Self::zeros(places);
        new.assign(v);
        new
    }

    /// Takes the vector `v`, `[k][3]`, of the same k as before.
    pub(super) fn assign(&mut self, v: &[f64]) {
        let rows = self.rows_mut();
        Arch::new().dispatch(Sort { from: bytemuck::cast_slice(v), rows });
    }

    /// Node after node, `[k][3]`.
    pub(super) fn give(&self, k: usize) -> Vec<f64> {
        let mut v = vec![0.0; 3 * k];
        Arch::new().dispatch(Mix { rows: [0, 1, 2].map(|c| self.row(c)), to: bytemuck::cast_slice_mut(&mut v) });
        v
    }

    /// l.
    pub(super) fn places(&self) -> usize {
        self.places
    }

    /// Component `c`, `[l]`.
    pub(super) fn row(&self, c: usize) -> &[f64] {
        &self.numbers[self.places * c..][..self.places]
    }

    /// Component `c`, `[l]`, to be changed.
    pub(super) fn row_mut(&mut self, c: usize) -> &mut [f64] {
        &mut self.numbers[self.places * c..][..self.places]
    }

    fn rows_mut(&mut self) -> [&mut [f64]; 3] {
        let (x, rest) = self.numbers.split_at_mut(self.places);
        let (y, n) = rest.split_at_mut(self.places);
        [x, y, n]
    }

    /// All components by lanes.
    #[inline(always)]
    pub(super) fn lanes(&self) -> [&[Lane]; 3] {
        [0, 1, 2].map(|c| bytemuck::cast_slice(self.row(c)))
    }

    /// All components by lanes, to be changed.
    #[inline(always)]
    pub(super) fn lanes_mut(&mut self) -> [&mut [Lane]; 3] {
        self.rows_mut().map(bytemuck::cast_slice_mut)
    }
}

struct Sort<'a> {
    from: &'a [[f64; 3]],
    rows: [&'a mut [f64]; 3],
}

impl WithSimd for Sort<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let k = self.from.len();
        let [x, y, n] = self.rows.map(|row| &mut row[..k]);
        for (i, v) in self.from.iter().enumerate() {
            (x[i], y[i], n[i]) = (v[0], v[1], v[2]);
        }
    }
}

struct Mix<'a> {
    rows: [&'a [f64]; 3],
    to: &'a mut [[f64; 3]],
}

impl WithSimd for Mix<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let k = self.to.len();
        let [x, y, n] = self.rows.map(|row| &row[..k]);
        for (i, v) in self.to.iter_mut().enumerate() {
            *v = [x[i], y[i], n[i]];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorted_numbers_come_back_and_places_without_a_node_hold_zeros() {
        for k in [0, 1, 7, 8, 16, 17, 89] {
            let v: Vec<f64> = (0..3 * k).map(|i| i as f64 + 1.0).collect();
            let sorted = SoaVec3::from_interleaved(&v, super::super::aligned::padded_len::<f32>(k));
            assert_eq!(sorted.give(k), v);
            for c in 0..3 {
                let row = sorted.row(c);
                assert!((0..k).all(|i| row[i] == v[3 * i + c]) && row[k..].iter().all(|v| *v == 0.0));
                assert_eq!(sorted.lanes()[c].as_flattened(), row);
            }
        }
    }
}
