//! Convolutions beside the matrices that they stand for.

use super::product::good_size;
use super::*;
use faer::Scale;

const STEEL: HalfSpace = HalfSpace { young: 205e9, poisson: 0.3 };
const SOFT: HalfSpace = HalfSpace { young: 60e9, poisson: 0.1 };

fn line(n: usize, h: f64) -> Vec<f64> {
    (0..n).map(|i| h * (i as f64 - 0.37 * n as f64)).collect()
}

/// Numbers without a pattern.
fn forces(n: usize) -> Vec<f64> {
    (0..n).map(|i| ((i * 7919 % 1013) as f64 * 0.37).sin()).collect()
}

fn two(x: &[f64], y: &[f64]) -> (Convolution, Mat<f64>) {
    let of = |m: HalfSpace| Convolution::of_half_space(&m, x, y).unwrap().unwrap();
    let sign = |i: usize| if i % 3 == 2 { 1.0 } else { -1.0 };
    let (a, b) = (STEEL.compliance(x, y).unwrap(), SOFT.compliance(x, y).unwrap());
    let dense = Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] + sign(i) * sign(j) * b[(i, j)]);
    (Convolution::combined(&of(STEEL), &of(SOFT)).unwrap(), dense)
}

/// Compliance that a body adds to its half-space; `skew` makes it that of a body that rotates.
fn whole(n: usize, x: &[f64], y: &[f64], skew: f64) -> Mat<f64> {
    let a = |i: usize, j: usize| {
        1e-12 * ((1 + i + j) as f64).cos() * 40f64.powi((i / 3).min(1) as i32 + (j / 3).min(1) as i32)
            + skew * 1e-12 * (i as f64 - j as f64)
    };
    let pi = Mat::from_fn(3 * n, LOADS, |row, k| {
        let node = row / 3;
        let p = [1.0, x[node % x.len()], y[node / x.len()]];
        if k % 3 == row % 3 {
            p[k / 3]
        } else {
            0.0
        }
    });
    &pi * Mat::from_fn(LOADS, LOADS, a) * pi.transpose()
}

fn difference(c: &Convolution, w: &Mat<f64>) -> f64 {
    let f = forces(c.rows());
    let wanted = w * faer::ColRef::from_slice(&f);
    let mut out = vec![0.0; f.len()];
    c.exact().times(&f, &mut out);
    let largest = wanted.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    (0..f.len()).map(|i| (out[i] - wanted[i]).abs() / largest).fold(0.0, f64::max)
}

#[test]
fn products_are_those_of_the_dense_matrix() {
    for (nx, ny) in [(3, 3), (7, 4), (17, 22), (31, 31)] {
        let (x, y) = (line(nx, 4e-4), line(ny, 7e-4));
        let (c, dense) = two(&x, &y);
        let off = difference(&c, &dense);
        assert!(off < 1e-13, "{nx} x {ny}: {off:e}");
        assert!((c.dense() - &dense).norm_max() < 1e-15 * dense.norm_max());
    }
}

#[test]
fn components_and_single_precision_are_those_of_the_whole() {
    let (x, y) = (line(12, 4e-4), line(9, 7e-4));
    let (c, dense) = two(&x, &y);
    let n = x.len() * y.len();
    let f = forces(n);
    for (e, tolerance) in [(0, 1e-13), (2, 1e-13)] {
        let mut out = vec![0.0; n];
        c.exact().components(&f, &mut out, &[e]);
        let wanted = |i: usize| (0..n).map(|j| dense[(3 * i + e, 3 * j + e)] * f[j]).sum::<f64>();
        let largest = (0..n).map(|i| wanted(i).abs()).fold(0.0, f64::max);
        assert!((0..n).all(|i| (out[i] - wanted(i)).abs() <= tolerance * largest), "component {e}");
    }
    let f = forces(3 * n);
    let (mut out, mut single) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
    c.exact().times(&f, &mut out);
    c.fast().times(&f.iter().map(|&v| v as f32).collect::<Vec<_>>(), &mut single);
    let largest = out.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    assert!((0..3 * n).all(|i| (out[i] - f64::from(single[i])).abs() < 1e-6 * largest));
}

/// Half-spaces, and bodies whose whole moves at the contact, at rest and rotating, by columns and by rows.
#[test]
fn a_matrix_that_is_a_convolution_is_found_to_be_one() {
    let (x, y) = (line(14, 4e-4), line(11, 7e-4));
    let (_, dense) = two(&x, &y);
    for skew in [0.0, 0.3] {
        let w = &dense + whole(x.len() * y.len(), &x, &y, skew);
        let c = Convolution::found_in(w.as_ref(), &x, &y).unwrap();
        assert!(c.whole.is_some());
        let off = difference(&c, &w);
        assert!(off < 1e-13, "{off:e}");
        let kept = w.transpose().to_owned();
        let by_rows = Convolution::found_in(kept.transpose(), &x, &y).unwrap();
        assert!(difference(&by_rows, &w) < 1e-13);
    }
    let again = Convolution::found_in((&dense + whole(x.len() * y.len(), &x, &y, 0.3)).as_ref(), &x, &y).unwrap();
    assert!(again.found_again(dense.as_ref()).is_some_and(|c| difference(&c, &dense) < 1e-13));
    let sent = Convolution::from_numbers(&again.numbers()).unwrap();
    assert_eq!((sent.dense() - again.dense()).norm_max(), 0.0);
    assert!(Convolution::from_numbers(&[]).is_none());
    let plain = Convolution::found_in(dense.as_ref(), &x, &y).unwrap();
    assert!(plain.whole.is_none() && difference(&plain, &dense) < 1e-13);
}

#[test]
fn other_matrices_are_none() {
    let (x, y) = (line(8, 4e-4), line(6, 7e-4));
    let (_, dense) = two(&x, &y);
    let mut off = dense.clone();
    off[(40, 71)] += 1e-10 * off[(40, 40)];
    assert!(Convolution::found_in(off.as_ref(), &x, &y).is_none());
    let mut graded = x.clone();
    graded[7] += 1e-4;
    assert!(Convolution::found_in(dense.as_ref(), &graded, &y).is_none());
    assert!(Convolution::of_half_space(&STEEL, &graded, &y).unwrap().is_none());
    assert!(Convolution::found_in((Scale(2.0) * &dense).as_ref(), &x, &y[..5]).is_none());
    let zero = Mat::<f64>::zeros(dense.nrows(), dense.ncols());
    assert!(Convolution::found_in(zero.as_ref(), &x, &y).is_none_or(|c| c.get(0, 0) == 0.0));
}

#[test]
fn transforms_have_good_sizes() {
    assert_eq!([1, 13, 61, 97, 247, 307].map(good_size), [2, 16, 64, 100, 250, 320]);
}
