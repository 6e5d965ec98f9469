//! Factors in single precision: what they solve to, and modes found with them.

use crate::matrices::*;
use crate::Check;
use railsqueal::eigen::sparse::{modes, At, Matrices, Method, ModesOptions};
use railsqueal::eigen::{contraction, Modes};
use railsqueal::parallel::World;
use railsqueal::petsc::csr::{dot, DistCsr};
use railsqueal::petsc::{Factor, FactorOptions, Petsc, Symmetry};
use railsqueal::{Error, Result};
use std::f64::consts::PI;

pub const CHECKS: &[Check] = &[
    ("a solution in single precision has its digits, in any units", solve),
    ("modes in single precision are those in double", same),
    ("single precision: the chain in closed form", chain_lowest),
    ("single precision: clusters and as many pairs as rows", clusters),
    ("single precision: an ill-conditioned matrix shows", ill_conditioned),
    ("single precision: no entries of the inverse", no_inverse),
];

fn factor<'w>(world: &'w World, a: &DistCsr) -> Factor<'w> {
    Factor::new(world, a, FactorOptions::new(Symmetry::Positive).single(), "K in single precision").unwrap()
}

fn solve(world: &World) {
    let (mut k, _) = brick(world, 6);
    let mut double = Factor::new(world, &k, FactorOptions::new(Symmetry::Positive), "K").unwrap();
    let columns = 70;
    let b: Vec<f64> = (0..k.n_local() * columns).map(|i| (1.0 + i as f64 + world.rank as f64).sin()).collect();
    let mut exact = b.clone();
    double.solve(&mut exact, columns).unwrap();
    let memory = double.statistics().factor_entries;
    // Beyond what a short number can hold.
    for unit in [1.0, 1e-45, 1e60] {
        k.values.iter_mut().for_each(|v| *v *= unit);
        let mut short = factor(world, &k);
        assert_eq!(short.statistics().factor_entries, memory);
        let mut x: Vec<f64> = b.iter().map(|v| v / unit).collect();
        short.solve(&mut x, columns).unwrap();
        let sums = |f: &dyn Fn(usize) -> f64| world.sum((0..x.len()).map(|i| f(i).powi(2)).sum()).sqrt();
        let error = sums(&|i| x[i] * unit * unit - exact[i]) / sums(&|i| exact[i]);
        assert!(error > 1e-9 && error < 1e-5, "{unit:e}: {error:e}");
        k.values.iter_mut().for_each(|v| *v /= unit);
    }
    let mut zero = vec![0.0; k.n_local()];
    factor(world, &k).solve(&mut zero, 1).unwrap();
    assert!(zero.iter().all(|v| *v == 0.0));
}

fn found(world: &World, k: &DistCsr, m: &DistCsr, sigma: f64, count: usize, single: bool) -> Modes {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let options = FactorOptions::new(Symmetry::Positive);
    let options = if single { options.single() } else { options };
    let mut factor = Factor::new(world, &k.minus_scaled(sigma, m), options, "K - sigma M").unwrap();
    let wanted = ModesOptions { sigma, count, method: Method::Blocks, prefix: String::new() };
    modes(&petsc, &mut factor, &Matrices::new(world, k, m), &wanted, &mut |_, _| ()).unwrap()
}

/// Products in M of all pairs of vectors to 1e-10, residuals as those in double precision are.
fn good(world: &World, m: &DistCsr, found: &Modes) {
    let operator = m.operator(world);
    for (j, x) in found.vectors.iter().enumerate() {
        let mut mx = vec![0.0; x.len()];
        operator.apply(world, x, &mut mx);
        for (i, y) in found.vectors.iter().enumerate().take(j + 1) {
            let product = dot(world, y, &mx) - f64::from(i == j);
            assert!(product.abs() < 1e-10, "{i}, {j}: {product:e}");
        }
    }
    assert!(found.residuals.iter().all(|r| *r < 1e-7), "{:?}", found.residuals);
}

/// A brick, a bar whose bending is double, a brick that nothing holds.
fn same(world: &World) {
    let bodies = [
        (brick_of(world, [6, 5, 4], 0.2), 0.0, 6),
        (brick_of(world, [12, 8, 6], 0.1), 0.0, 40),
        (brick_of(world, [24, 3, 3], 1.0 / 3.0), 0.0, 8),
        (free_brick_of(world, [5, 4, 3], 0.25), -1e-2, 9),
    ];
    for (number, ((k, m), sigma, count)) in bodies.iter().enumerate() {
        let [single, double] = [true, false].map(|single| found(world, k, m, *sigma, *count, single));
        for (a, b) in single.lambda.iter().zip(&double.lambda).take(*count) {
            assert!((a - b).abs() <= 1e-10 * (b - sigma).abs(), "{number}: {a:e} against {b:e}");
        }
        good(world, m, &single);
    }
}

fn chain_lowest(world: &World) {
    let n = 400;
    let k = chain(world, n, true);
    let m = diagonal(world, k.ranges.clone(), |_| 2.0);
    let found = found(world, &k, &m, 0.0, 12, true);
    for (i, lambda) in found.lambda.iter().enumerate().take(12) {
        let exact = 2.0 * ((i + 1) as f64 * PI / (2 * (n + 1)) as f64).sin().powi(2);
        assert!((lambda / exact - 1.0).abs() < 1e-11, "{}: {lambda} against {exact}", i + 1);
    }
    good(world, &m, &found);
}

/// Three eigenvalues thirty times each, and every pair of a small chain.
fn clusters(world: &World) {
    let k = diagonal(world, ranges(world, 90, false), |i| 1.0 + (i % 3) as f64 * 1.1);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let many = found(world, &k, &m, 0.0, 70, true);
    for (i, lambda) in many.lambda.iter().enumerate() {
        assert!((lambda - (1.0 + (i / 30) as f64 * 1.1)).abs() < 1e-12, "{i}: {lambda}");
    }
    good(world, &m, &many);
    for (n, count) in [(40, 30), (17, 17), (2, 2), (1, 1)] {
        let k = chain(world, n, true);
        let m = diagonal(world, k.ranges.clone(), |i| 1.0 + 0.1 * i as f64);
        let [single, double] = [true, false].map(|single| found(world, &k, &m, 0.0, count, single));
        for (a, b) in single.lambda.iter().zip(&double.lambda) {
            assert!((a / b - 1.0).abs() < 1e-10, "{n}, {count}: {a:e} against {b:e}");
        }
        good(world, &m, &single);
    }
}

/// The condition number of a chain grows with the square of its length; a few digits are left of that of a hundred links, none of a hundred thousand's.
fn ill_conditioned(world: &World) {
    let error = |n: u64| -> Result<f64> {
        let k = chain(world, n, false);
        let m = diagonal(world, k.ranges.clone(), |_| 1.0);
        let options = FactorOptions::new(Symmetry::Positive).single();
        let mut factor = Factor::new(world, &k, options, "K in single precision")?;
        contraction(&Matrices::new(world, &k, &m), &mut At { factor: &mut factor, sigma: 0.0 })
    };
    let short = error(100).unwrap();
    assert!(short > 1e-9 && short < 1e-3, "{short:e}");
    // Rounding may leave a negative pivot, which says it as well.
    match error(100_000) {
        Ok(long) => assert!(long > 1e-2, "{long:e}"),
        Err(error) => assert!(matches!(error, Error::NotConverged(_)), "{error}"),
    }
}

fn no_inverse(world: &World) {
    let (k, _) = brick(world, 4);
    let error = factor(world, &k).inverse_block(&[0, 1]).err().unwrap();
    assert!(error.message().contains("single precision"), "{error}");
}
