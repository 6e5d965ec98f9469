//! Real columns against complex vectors: the loads and the responses of a body have many columns, so each pass takes a stretch of rows that stays in the cache.

use num_complex::Complex;

type C = Complex<f64>;

/// Rows of a stretch.
const STRETCH: usize = 1024;
/// Sums kept side by side, so that they can be taken together.
const LANES: usize = 8;

/// Σ_i column[i] x[i] of each of the columns, `[columns]`.
pub(super) fn dots<'c>(columns: impl Iterator<Item = &'c [f64]> + Clone, x: &[C]) -> Vec<C> {
    let mut sums = vec![C::default(); columns.clone().count()];
    let (mut re, mut im) = ([0.0; STRETCH], [0.0; STRETCH]);
    for (at, stretch) in x.chunks(STRETCH).enumerate() {
        for ((re, im), v) in re.iter_mut().zip(&mut im).zip(stretch) {
            (*re, *im) = (v.re, v.im);
        }
        let rows = at * STRETCH..at * STRETCH + stretch.len();
        for (sum, column) in sums.iter_mut().zip(columns.clone()) {
            let column = &column[rows.clone()];
            *sum += C::new(dot(column, &re[..stretch.len()]), dot(column, &im[..stretch.len()]));
        }
    }
    sums
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for i in 0..LANES {
            lanes[i] += a[i] * b[i];
        }
    }
    lanes.iter().sum::<f64>() + rest
}

/// out += Σ_k factors[k] column_k.
pub(super) fn add<'c>(columns: impl Iterator<Item = &'c [f64]> + Clone, factors: &[C], out: &mut [C]) {
    for (at, stretch) in out.chunks_mut(STRETCH).enumerate() {
        let (mut re, mut im) = ([0.0; STRETCH], [0.0; STRETCH]);
        let rows = at * STRETCH..at * STRETCH + stretch.len();
        for (factor, column) in factors.iter().zip(columns.clone()) {
            for ((re, im), v) in re.iter_mut().zip(&mut im).zip(&column[rows.clone()]) {
                *re += factor.re * v;
                *im += factor.im * v;
            }
        }
        for ((out, re), im) in stretch.iter_mut().zip(&re).zip(&im) {
            *out += C::new(*re, *im);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_and_sums_of_columns() {
        let n = 2 * STRETCH + 37;
        let column = |k: usize| (0..n).map(|i| ((i * 7 + 3 * k) % 13) as f64 - 6.0).collect::<Vec<f64>>();
        let columns = [column(0), column(1), column(2)];
        let x: Vec<C> = (0..n).map(|i| C::new((i % 5) as f64, (i % 3) as f64 - 1.0)).collect();
        let each = || columns.iter().map(Vec::as_slice);
        for (dot, column) in dots(each(), &x).iter().zip(&columns) {
            assert_eq!(*dot, column.iter().zip(&x).map(|(c, x)| *c * x).sum::<C>());
        }
        let factors = [C::new(1.0, 2.0), C::new(-3.0, 0.5), C::new(0.0, 4.0)];
        let mut out = x.clone();
        add(each(), &factors, &mut out);
        for (i, (out, x)) in out.iter().zip(&x).enumerate() {
            assert_eq!(*out, x + (0..3).map(|k| factors[k] * columns[k][i]).sum::<C>());
        }
    }
}
