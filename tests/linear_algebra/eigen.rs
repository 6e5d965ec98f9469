//! Eigenvalues in closed form and their properties.

use crate::matrices::*;
use crate::Check;
use railsqueal::parallel::World;
use railsqueal::petsc::csr::{dot, DistCsr};
use railsqueal::petsc::eps::{modes, Modes, ModesOptions};
use railsqueal::petsc::{Factor, FactorOptions, Kind, Petsc};
use std::f64::consts::PI;

pub const CHECKS: &[Check] = &[
    ("eigenvalues of the chain in closed form", chain_lowest),
    ("eigenvalues about a shift within the spectrum", chain_interior),
    ("every eigenpair of a small problem", all_of_them),
    ("double eigenvalues are both found", doublets),
    ("free chain yields its rigid-body mode", rigid),
    ("modes of a brick do not depend on the ranks", brick_modes),
    ("options and versions of the session", session),
];

fn run(world: &World, k: &DistCsr, m: &DistCsr, sigma: f64, count: usize) -> Modes {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let kind = if sigma > 0.0 { Kind::Indefinite } else { Kind::Positive };
    let mut factor = Factor::new(world, &k.minus_scaled(sigma, m), FactorOptions::new(kind), "K - sigma M").unwrap();
    let options = ModesOptions { sigma, count, prefix: "test_".into() };
    modes(&petsc, &mut factor, &k.operator(world), &m.operator(world), &options, &mut |_, _| ()).unwrap()
}

fn chain_value(k: usize, n: u64) -> f64 {
    4.0 * (k as f64 * PI / (2 * (n + 1)) as f64).sin().powi(2)
}

fn chain_lowest(world: &World) {
    let n = 400;
    let k = chain(world, n, true);
    let m = diagonal(world, k.ranges.clone(), |_| 2.0);
    let found = run(world, &k, &m, 0.0, 12);
    for (i, lambda) in found.lambda.iter().enumerate().take(12) {
        let exact = 0.5 * chain_value(i + 1, n);
        assert!((lambda / exact - 1.0).abs() < 1e-11, "{}: {lambda} against {exact}", i + 1);
        // Sines.
        let x = &found.vectors[i];
        let shape = |row: u64| ((i + 1) as f64 * PI * (row + 1) as f64 / (n + 1) as f64).sin();
        let exact: Vec<f64> = k.rows_of(world.rank).map(|r| shape(r) / ((n + 1) as f64).sqrt()).collect();
        let along = 2.0 * dot(world, x, &exact);
        assert!((along.abs() - 1.0).abs() < 1e-10, "{}: {along}", i + 1);
    }
}

fn chain_interior(world: &World) {
    let n = 300;
    let k = chain(world, n, false);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let sigma = 0.5 * (chain_value(100, n) + chain_value(101, n));
    let found = run(world, &k, &m, sigma, 10);
    for lambda in &found.lambda {
        let nearest = (1..=300).map(|i| (chain_value(i, n) - lambda).abs()).fold(f64::MAX, f64::min);
        assert!(nearest < 1e-11, "{lambda}: {nearest:e}");
    }
    let below = found.lambda.iter().filter(|l| **l < sigma).count();
    assert!((4..=6).contains(&below), "{:?}", found.lambda);
}

fn all_of_them(world: &World) {
    let k = chain(world, 7, false);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let found = run(world, &k, &m, 0.0, 7);
    assert_eq!(found.lambda.len(), 7);
    for (i, lambda) in found.lambda.iter().enumerate() {
        assert!((lambda - chain_value(i + 1, 7)).abs() < 1e-12, "{lambda}");
    }
}

/// A clamped square bar: bending is double.
fn doublets(world: &World) {
    let (k, m) = brick_of(world, [24, 3, 3], 1.0 / 3.0);
    let found = run(world, &k, &m, 0.0, 8);
    assert!((found.lambda[1] / found.lambda[0] - 1.0).abs() < 1e-9, "{:?}", found.lambda);
    assert!(found.lambda[2] > 1.1 * found.lambda[1], "{:?}", found.lambda);
}

fn rigid(world: &World) {
    let k = free_chain(world, 60);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let found = run(world, &k, &m, -1e-3, 3);
    assert!(found.lambda[0].abs() < 1e-12, "{:?}", found.lambda);
    let exact = 4.0 * (PI / 120.0).sin().powi(2);
    assert!((found.lambda[1] / exact - 1.0).abs() < 1e-10, "{:?}", found.lambda);
}

fn brick_modes(world: &World) {
    let (k, m) = brick_of(world, [6, 5, 4], 0.2);
    let found = run(world, &k, &m, 0.0, 6);
    // Of one rank; every world compares with them.
    const ONE_RANK: [f64; 3] = [0.21399816628767, 0.27120803681466, 0.58265877531774];
    for (lambda, kept) in found.lambda.iter().zip(ONE_RANK) {
        assert!((lambda / kept - 1.0).abs() < 1e-9, "{:?}", found.lambda);
    }
    assert!(found.residuals.iter().all(|r| *r < 1e-7), "{:?}", found.residuals);
}

fn session(world: &World) {
    let options = [("eps_nonsense".to_string(), "3".to_string()), ("-test_eps_ncv".to_string(), "30".to_string())];
    let arguments = ["-test_eps_max_it".to_string(), "90".to_string(), "-flag".to_string()];
    let petsc = Petsc::start(world, &options, &arguments).unwrap();
    let k = chain(world, 100, false);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let mut factor = Factor::new(world, &k, FactorOptions::new(Kind::Positive), "chain").unwrap();
    let wanted = ModesOptions { sigma: 0.0, count: 4, prefix: "test_".into() };
    modes(&petsc, &mut factor, &k.operator(world), &m.operator(world), &wanted, &mut |_, _| ()).unwrap();
    let mut unused = petsc.unused_options().unwrap();
    unused.sort();
    assert_eq!(unused, ["-eps_nonsense 3", "-flag"]);
    assert_eq!(Petsc::start(world, &[], &[]).err().unwrap().exit_code(), 1);
    drop(petsc);
    // An option that PETSc refuses: its own words, and the user's fault.
    let petsc = Petsc::start(world, &[("test_eps_type".into(), "krylof".into())], &[]).unwrap();
    let error =
        modes(&petsc, &mut factor, &k.operator(world), &m.operator(world), &wanted, &mut |_, _| ()).unwrap_err();
    assert_eq!(error.exit_code(), 2, "{error}");
    assert!(error.message().contains("krylof"), "{error}");
    let versions = Petsc::versions();
    assert!(versions.petsc.starts_with("3.") && versions.scalar.contains("complex"), "{versions:?}");
}
