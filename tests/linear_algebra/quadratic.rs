//! Quadratic eigenproblems in closed form.

use crate::matrices::*;
use crate::Check;
use num_complex::Complex;
use railsqueal::parallel::World;
use railsqueal::petsc::pep::{quadratic, QuadraticOptions};
use railsqueal::petsc::Petsc;
use std::f64::consts::PI;

pub const CHECKS: &[Check] = &[
    ("quadratic: damped chain in closed form", damped_chain),
    ("quadratic: multipliers and a singular mass", saddle_point),
    ("quadratic: a rank without rows is refused", empty_rank),
    ("quadratic: wrong pairs are not let through", limit),
];

fn options(target: Complex<f64>, count: usize) -> QuadraticOptions {
    QuadraticOptions { target, count, backward_error: 1e-9, prefix: "test_".into() }
}

/// λ² + (α + βω²) λ + ω² = 0 for Rayleigh damping C = αM + βK.
fn damped_chain(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let (n, alpha, beta) = (200u64, 0.02, 0.05);
    let k = chain(world, n, false);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let mut c = k.minus_scaled(-alpha / beta, &m);
    c.values.iter_mut().for_each(|v| *v *= beta);
    let target = Complex::new(0.0, 0.9);
    let found = quadratic(&petsc, &k, &c, &m, &options(target, 8)).unwrap();
    let mut exact: Vec<Complex<f64>> = (1..=n)
        .flat_map(|i| {
            let w2 = 4.0 * (i as f64 * PI / (2 * (n + 1)) as f64).sin().powi(2);
            let half = 0.5 * (alpha + beta * w2);
            let root = Complex::new(half * half - w2, 0.0).sqrt();
            [root - half, -root - half]
        })
        .collect();
    exact.sort_by(|a, b| (a - target).norm().total_cmp(&(b - target).norm()));
    for (i, (lambda, exact)) in found.lambda.iter().zip(&exact).enumerate() {
        assert!((lambda - exact).norm() < 1e-9, "{i}: {lambda} against {exact}");
    }
    assert!(found.lambda.len() >= 8 && found.backward_error.iter().all(|e| *e < 1e-11), "{:?}", found.backward_error);
}

/// The chain's masses tied in pairs (2i, 2i+1) by multipliers g: M is singular, K indefinite. What is left is a chain of half as many
/// masses of 2 with springs 1: λ = ± iω, ω² = 2 sin²(kπ / 2(p + 1)) for p pairs.
fn saddle_point(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let pairs = 40u64;
    let n = 2 * pairs;
    let all = ranges(world, n + pairs, false);
    let k = from_rows(world, all.clone(), |i| {
        if i >= n {
            return vec![(2 * (i - n), 1.0), (2 * (i - n) + 1, -1.0)];
        }
        let mut row = Vec::new();
        if i > 0 {
            row.push((i - 1, -1.0));
        }
        row.push((i, 2.0));
        if i + 1 < n {
            row.push((i + 1, -1.0));
        }
        row.push((n + i / 2, if i % 2 == 0 { 1.0 } else { -1.0 }));
        row
    });
    assert_eq!(k.asymmetry(world), 0.0);
    let m = from_rows(world, all.clone(), |i| vec![(i, if i < n { 1.0 } else { 0.0 })]);
    let c = diagonal(world, all, |_| 0.0);
    let target = Complex::new(0.0, 0.3);
    let found = quadratic(&petsc, &k, &c, &m, &options(target, 6)).unwrap();
    let exact: Vec<f64> = (1..=pairs).map(|i| 2f64.sqrt() * (i as f64 * PI / (2 * (pairs + 1)) as f64).sin()).collect();
    let mut nearest = exact.clone();
    nearest.sort_by(|a, b| (a - 0.3).abs().total_cmp(&(b - 0.3).abs()));
    for (lambda, w) in found.lambda.iter().zip(nearest).take(6) {
        assert!(lambda.re.abs() < 1e-9 && (lambda.im - w).abs() < 1e-9, "{lambda} against {w}i");
    }
}

fn limit(world: &World) {
    let petsc = Petsc::start(world, &[("test_pep_tol".into(), "1e-2".into())], &[]).unwrap();
    let k = chain(world, 300, false);
    let m = diagonal(world, k.ranges.clone(), |i| 1.0 + 1e-3 * (i as f64).sin());
    let c = diagonal(world, k.ranges.clone(), |i| 0.01 * (i as f64).cos());
    let strict = QuadraticOptions { backward_error: 1e-15, ..options(Complex::new(0.0, 1.0), 20) };
    let error = quadratic(&petsc, &k, &c, &m, &strict).unwrap_err();
    assert_eq!(error.exit_code(), 4, "{error}");
    assert!(error.message().contains("backward error"), "{error}");
}

fn empty_rank(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let k = chain(world, 30, true);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let outcome = quadratic(&petsc, &k, &m, &m, &options(Complex::new(0.0, 1.0), 2));
    if world.size == 1 {
        assert!(outcome.is_ok(), "{:?}", outcome.err());
    } else {
        let error = outcome.unwrap_err();
        assert!(error.exit_code() == 2 && error.message().contains("fewer ranks"), "{error}");
    }
}
