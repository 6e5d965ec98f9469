//! The modes at the contact by what it can tell apart of them.
//!
//! A contact is small beside the waves of the modes that are kept: hundreds of modes move it in a few dozen ways. Ψ =
//! B Cᵀ with r columns, to 1e-12, so that displacements of the contact and forces on the modes cost r and not m
//! products a row.

use super::aligned::{padded_len, AlignedVec};
use crate::dense::{add_columns, wide_dot};
use faer::{Mat, MatRef};

/// Columns that are shorter than this part of the largest count as nothing. Mode shapes are known to 1e-9 at best;
/// both sides of a step take the same B Cᵀ, so that energy stays what it is.
const NEGLIGIBLE: f64 = 1e-12;

/// Ψ = B Cᵀ of N rows and m modes.
#[derive(Debug, Clone)]
pub(super) struct LowRankModes {
    /// B, row by row, `[N][r]`.
    rows: Vec<f64>,
    /// r, in whole lines where there is C.
    rank: usize,
    /// None where r = m and C = I.
    mix: Option<Mix>,
}

/// C, once row by row, `[m][r]`, and once column by column, `[r][m]`: products with both its sides read it in the
/// order in which it lies.
#[derive(Debug, Clone)]
struct Mix {
    /// m.
    modes: usize,
    rows: AlignedVec<f64>,
    columns: AlignedVec<f64>,
}

impl LowRankModes {
    /// Low-rank factors of Ψ, `[N, m]`.
    pub(super) fn new(modes: MatRef<'_, f64>) -> Self {
        let (n, m) = modes.shape();
        // B and C together are to be smaller than Ψ, and as a step reads less of B than of C they are to be much
        // smaller.
        let limit = ((n * m).saturating_sub(1) / (n + m).max(1)).min(3 * m / 4);
        let Some([mut basis, mut mix]) = factors(modes, limit, NEGLIGIBLE) else {
            return Self::from_modes(modes);
        };
        // Rows in whole lines, with zeros.
        let rank = padded_len::<f64>(basis.len());
        basis.resize(rank, vec![0.0; n]);
        mix.resize(rank, vec![0.0; m]);
        let rows = (0..n).flat_map(|i| basis.iter().map(move |b| b[i])).collect();
        let mix = Mix {
            modes: m,
            rows: AlignedVec::from((0..m * rank).map(|k| mix[k % rank][k / rank])),
            columns: AlignedVec::from(mix.concat().into_iter()),
        };
        Self { rows, rank, mix: Some(mix) }
    }

    /// Factors of Ψ as they are.
    pub(super) fn from_modes(modes: MatRef<'_, f64>) -> Self {
        let (n, m) = modes.shape();
        let rows = (0..n).flat_map(|i| (0..m).map(move |k| modes[(i, k)])).collect();
        Self { rows, rank: m, mix: None }
    }

    /// r.
    pub(super) fn rank(&self) -> usize {
        self.rank
    }

    /// Row `i` of B, `[r]`.
    pub(super) fn row(&self, i: usize) -> &[f64] {
        &self.rows[self.rank * i..][..self.rank]
    }

    /// Cᵀ q, `[r]`: what the contact sees of the amplitudes `q`, `[m]`.
    pub(super) fn contact_amplitudes(&self, q: &[f64]) -> Vec<f64> {
        let Some(mix) = &self.mix else { return q.to_vec() };
        let mut z = vec![0.0; self.rank];
        add_columns(&mix.rows, self.rank, q, &mut z);
        z
    }

    /// Cᵀ Q of amplitudes in columns, `[r, c]`.
    pub(super) fn contact_motion(&self, q: &Mat<f64>) -> Mat<f64> {
        match &self.mix {
            Some(mix) => MatRef::from_column_major_slice(&mix.rows, self.rank, mix.modes) * q,
            None => q.clone(),
        }
    }

    /// C Z of forces in columns, `[m, c]`.
    pub(super) fn modal_forces(&self, z: Mat<f64>) -> Mat<f64> {
        match &self.mix {
            Some(mix) => MatRef::from_column_major_slice(&mix.columns, mix.modes, self.rank) * z,
            None => z,
        }
    }

    /// C z, `[m]`: forces on the modes from those, `z`, on what the contact sees of them, `[r]`.
    pub(super) fn spread(&self, z: Vec<f64>) -> Vec<f64> {
        let Some(mix) = &self.mix else { return z };
        let mut q = vec![0.0; mix.modes];
        add_columns(&mix.columns, q.len(), &z, &mut q);
        q
    }
}

/// Columns of B, `[r][N]`, and of C, `[r][m]`, of a matrix: Gram–Schmidt with the largest of the columns that are
/// left first, until none is above [`NEGLIGIBLE`]. What is left is subtracted from the columns themselves, so B Cᵀ is
/// the matrix whether B is orthogonal or not. `None` where that takes more than `limit`. Columns shorter than
/// `negligible` times the longest one are left out.
pub(crate) fn factors(modes: MatRef<'_, f64>, limit: usize, negligible: f64) -> Option<[Vec<Vec<f64>>; 2]> {
    let mut left = modes.to_owned();
    let m = left.ncols();
    let mut sizes: Vec<f64> = (0..m).map(|k| size(left.col_as_slice(k))).collect();
    let floor = negligible * sizes.iter().fold(0.0, |a: f64, b| a.max(*b));
    let (mut basis, mut mix) = (Vec::new(), Vec::new());
    loop {
        let pivot = (0..m).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b])).filter(|&k| !(sizes[k] <= floor));
        let Some(pivot) = pivot else { return Some([basis, mix]) };
        if basis.len() == limit || !sizes[pivot].is_finite() {
            return None;
        }
        let along: Vec<f64> = left.col_as_slice(pivot).iter().map(|v| v / sizes[pivot]).collect();
        let shares: Vec<f64> = (0..m).map(|k| wide_dot(&along, left.col_as_slice(k))).collect();
        for (k, share) in shares.iter().enumerate() {
            left.col_as_slice_mut(k).iter_mut().zip(&along).for_each(|(v, a)| *v -= share * a);
            sizes[k] = size(left.col_as_slice(k));
        }
        basis.push(along);
        mix.push(shares);
    }
}

fn size(v: &[f64]) -> f64 {
    wide_dot(v, v).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;

    /// Waves longer than the place where they are looked at: few ways to move it, and the same displacements and
    /// forces to nearly that. Modes that have nothing in common stay as they are.
    #[test]
    fn long_waves_move_a_small_place_in_few_ways() {
        let (n, m) = (120, 60);
        let long = Mat::from_fn(n, m, |i, k| (0.3 * i as f64 / n as f64 * (1 + k / 2) as f64 / 6.0 + k as f64).sin());
        let apart = Mat::from_fn(n, m, |i, k| (1.0 + (i * i * 7 + 13 * k * k + i * k) as f64).sin());
        for (modes, few) in [(long, true), (apart, false)] {
            let shapes = LowRankModes::new(modes.as_ref());
            assert_eq!(shapes.mix.is_some(), few, "rank {}", shapes.rank());
            assert!(if few { shapes.rank() <= m / 2 } else { shapes.rank() == m });
            let q: Vec<f64> = (0..m).map(|k| (k as f64).cos()).collect();
            let f: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
            let z = shapes.contact_amplitudes(&q);
            for i in 0..n {
                let want: f64 = (0..m).map(|k| modes[(i, k)] * q[k]).sum();
                let got: f64 = shapes.row(i).iter().zip(&z).map(|(b, z)| b * z).sum();
                assert!((got - want).abs() < 1e-12, "row {i}: {got}, expected {want}");
            }
            let mut pressed = vec![0.0; shapes.rank()];
            for i in 0..n {
                pressed.iter_mut().zip(shapes.row(i)).for_each(|(p, b)| *p += b * f[i]);
            }
            let force = shapes.spread(pressed);
            for k in 0..m {
                let want: f64 = (0..n).map(|i| modes[(i, k)] * f[i]).sum();
                assert!((force[k] - want).abs() < 1e-11, "mode {k}: {}, expected {want}", force[k]);
            }
        }
    }
}
