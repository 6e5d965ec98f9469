//! Modes computed again: other signs, and other directions within a cluster of equal frequencies. They are turned
//! back by the orthogonal matrix that brings their motion of the contact nearest to the one kept (P. H. Schönemann,
//! *Psychometrika* 31 (1966)).

use super::clusters::CLUSTER_GAP;
use faer::{Mat, MatRef};

/// The columns times the matrix `rotation`, given by columns, `[m, m]`.
pub fn apply_alignment(vectors: &[Vec<f64>], rotation: &[f64]) -> Vec<Vec<f64>> {
    let sum = |factors: &[f64]| {
        let mut sum = vec![0.0; vectors.first().map_or(0, Vec::len)];
        for (vector, t) in vectors.iter().zip(factors).filter(|(_, t)| **t != 0.0) {
            sum.iter_mut().zip(vector).for_each(|(s, v)| *s += t * v);
        }
        sum
    };
    rotation.chunks_exact(vectors.len().max(1)).map(sum).collect()
}

/// The matrix T, by columns, `[m, m]`, for which `now` T is `kept`; both `[3n, m]`, 1/√kg.
pub fn alignment(now: MatRef<'_, f64>, kept: MatRef<'_, f64>, omega: &[f64]) -> std::result::Result<Vec<f64>, String> {
    let m = omega.len();
    if now.shape() != kept.shape() || kept.ncols() != m {
        return Err(format!("{:?} rows and modes, {:?} then", now.shape(), kept.shape()));
    }
    let largest = (0..m).map(|k| kept.col(k).norm_l2()).fold(0.0, f64::max);
    let mut out = vec![0.0; m * m];
    let mut first = 0;
    while first < m {
        let mut end = first + 1;
        while end < m && omega[end] - omega[end - 1] <= CLUSTER_GAP * omega[end] {
            end += 1;
        }
        let (a, b) = (now.subcols(first, end - first), kept.subcols(first, end - first));
        let product: Mat<f64> = a.transpose() * b;
        let svd = product.svd().map_err(|e| format!("{e:?}"))?;
        let t = svd.U() * svd.V().transpose();
        let error = (a * &t - b).norm_l2();
        // Modes are exact to their residual over the distance to the next frequency.
        if error > 1e-4 * largest {
            let hertz = omega[first] / (2.0 * std::f64::consts::PI);
            return Err(format!(
                "at {hertz:.2} Hz the motion of the contact differs by {error:.2e} of at most {largest:.2e} 1/√kg"
            ));
        }
        for k in first..end {
            for j in first..end {
                out[j + m * k] = t[(j - first, k - first)];
            }
        }
        first = end;
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_and_pairs_are_turned_back() {
        let kept = Mat::from_fn(12, 4, |i, k| ((3 * i + 7 * k) as f64).sin());
        let omega = [10.0, 20.0, 20.001, 30.0];
        let (c, s) = (0.6, 0.8);
        let now = Mat::from_fn(12, 4, |i, k| match k {
            0 => -kept[(i, 0)],
            1 => c * kept[(i, 1)] + s * kept[(i, 2)],
            2 => -s * kept[(i, 1)] + c * kept[(i, 2)],
            _ => kept[(i, k)],
        });
        let t = alignment(now.as_ref(), kept.as_ref(), &omega).unwrap();
        let t = Mat::from_fn(4, 4, |i, k| t[i + 4 * k]);
        let error = (&now * &t - &kept).norm_l2();
        assert!(error < 1e-12, "{error:e}");
        assert_eq!((t[(0, 0)].signum(), t[(0, 1)]), (-1.0, 0.0));
        let other = Mat::from_fn(12, 4, |i, k| ((3 * i + 5 * k) as f64).cos());
        assert!(alignment(other.as_ref(), kept.as_ref(), &omega).unwrap_err().contains("at 1.59 Hz"));
    }

    /// A pair of equal frequencies whose plane comes out turned, the motion of the contact being only a part of the
    /// shapes: the shapes that were kept come back, and not those turned twice as far.
    #[test]
    fn shapes_of_a_pair_are_turned_back_not_further() {
        let shapes = Mat::from_fn(9, 3, |i, k| ((2 * i + 5 * k) as f64).cos());
        let (c, s) = (0.5f64.cos(), 0.5f64.sin());
        let now = Mat::from_fn(9, 3, |i, k| match k {
            0 => c * shapes[(i, 0)] + s * shapes[(i, 1)],
            1 => -s * shapes[(i, 0)] + c * shapes[(i, 1)],
            _ => -shapes[(i, 2)],
        });
        let columns = |m: &Mat<f64>| (0..3).map(|k| m.col(k).iter().copied().collect::<Vec<f64>>()).collect::<Vec<_>>();
        let t = alignment(now.as_ref().subrows(0, 6), shapes.as_ref().subrows(0, 6), &[20.0, 20.0, 30.0]).unwrap();
        for (found, kept) in apply_alignment(&columns(&now), &t).iter().zip(columns(&shapes)) {
            assert!(found.iter().zip(&kept).all(|(a, b)| (a - b).abs() < 1e-13), "{found:?} for {kept:?}");
        }
    }
}
