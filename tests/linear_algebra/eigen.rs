//! Eigenvalues in closed form and their properties.

use crate::matrices::*;
use crate::Check;
use railsqueal::eigen::sparse::{
    modes, DistributedMatrices, Method, ModesOptions, ShiftedFactor, ShiftedFactors, SLICED,
};
use railsqueal::eigen::{band, lowest, FoundModes, Pencil};
use railsqueal::parallel::World;
use railsqueal::petsc::csr::{dot, DistCsr};
use railsqueal::petsc::{Factor, FactorOptions, Petsc, Symmetry};
use std::f64::consts::PI;

pub const CHECKS: &[Check] = &[
    ("eigenvalues of the chain in closed form", chain_lowest),
    ("eigenvalues about a shift within the spectrum", chain_interior),
    ("every eigenpair of a small problem", all_of_them),
    ("double eigenvalues are both found", doublets),
    ("free chain yields its rigid-body mode", rigid),
    ("modes of a brick do not depend on the ranks", brick_modes),
    ("six rigid-body modes of a free brick", six_rigid),
    ("more modes than half the order", more_than_half),
    ("as many modes as there are rows, on ranks without any", fewer_rows_than_ranks),
    ("a block within an invariant subspace is filled up", invariant),
    ("each rank by itself", alone),
    ("a shift that is an eigenvalue is refused", singular_shift),
    ("a shift next to an eigenvalue", beside_an_eigenvalue),
    ("too many modes are refused", too_many),
    ("many modes by slices in closed form", many),
    ("many modes of a brick by slices", many_of_a_brick),
    ("a band that begins and ends within clusters", clustered_band),
    ("a band that begins and ends at eigenvalues", band_of_eigenvalues),
    ("an empty band, and one beyond the spectrum", empty_band),
    ("options and versions of the session", session),
];

fn with(world: &World, k: &DistCsr, m: &DistCsr, sigma: f64, count: usize, method: Method) -> FoundModes {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let kind = if sigma > 0.0 { Symmetry::Indefinite } else { Symmetry::Positive };
    let mut factor = Factor::new(world, &k.minus_scaled(sigma, m), FactorOptions::new(kind), "K - sigma M").unwrap();
    let options = ModesOptions { sigma, count, method, prefix: "test_".into() };
    let mut told = (0, 0);
    let found =
        modes(&petsc, &mut factor, &DistributedMatrices::new(world, k, m), &options, &mut |done, of| told = (done, of))
            .unwrap();
    assert!(
        found.lambda.len() >= count && found.vectors.len() == found.lambda.len(),
        "{method:?}: {}",
        found.lambda.len()
    );
    assert!(found.lambda.windows(2).all(|w| w[0] <= w[1]), "{method:?}: {:?}", found.lambda);
    if method == Method::Blocks {
        assert!(told.0 >= told.1.min(count) && told.1 >= count, "progress ended with {told:?}");
    }
    found
}

/// The modes by the block method, which must be those of SLEPc.
fn run(world: &World, k: &DistCsr, m: &DistCsr, sigma: f64, count: usize) -> FoundModes {
    let found = with(world, k, m, sigma, count, Method::Blocks);
    let slepc = with(world, k, m, sigma, count, Method::Slepc);
    let nearest = |modes: &FoundModes| {
        let mut all = modes.lambda.clone();
        all.sort_by(|a, b| (a - sigma).abs().total_cmp(&(b - sigma).abs()));
        all.truncate(count);
        all.sort_by(f64::total_cmp);
        all
    };
    for (a, b) in nearest(&found).iter().zip(nearest(&slepc)) {
        assert!((a - b).abs() <= 1e-10 * (b - sigma).abs().max(b.abs()), "{a:e} against {b:e} of SLEPc");
    }
    orthonormal(world, m, &found, if count > SLICED { 1e-8 } else { 1e-10 });
    found
}

/// Up to `limit`: what is found about different shifts is as orthogonal as it has converged, the rest to working
/// precision.
fn orthonormal(world: &World, m: &DistCsr, found: &FoundModes, limit: f64) {
    let operator = m.operator(world);
    for (j, x) in found.vectors.iter().enumerate() {
        let mut mx = vec![0.0; x.len()];
        operator.apply(world, x, &mut mx);
        for (i, y) in found.vectors.iter().enumerate().take(j + 1) {
            let product = dot(world, y, &mx) - f64::from(i == j);
            assert!(product.abs() < limit, "{i}, {j}: {product:e}");
        }
    }
    assert!(found.residuals.iter().all(|r| *r < 1e-7), "{:?}", found.residuals);
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

fn six_rigid(world: &World) {
    let (k, m) = free_brick_of(world, [5, 4, 3], 0.25);
    let found = run(world, &k, &m, -1e-2, 9);
    assert!(found.lambda[..6].iter().all(|l| l.abs() < 1e-11), "{:?}", found.lambda);
    assert!(found.lambda[6] > 0.05, "{:?}", found.lambda);
}

fn more_than_half(world: &World) {
    for (n, count) in [(40, 30), (40, 39), (17, 17), (2, 2), (1, 1)] {
        let k = chain(world, n, true);
        let m = diagonal(world, k.ranges.clone(), |i| 1.0 + 0.1 * i as f64);
        run(world, &k, &m, 0.0, count);
    }
    // As many rows and more as pairs that are sought in slices.
    let n = sized(300, 180);
    for count in [sized(220, 160), n as usize] {
        let k = chain(world, n, true);
        let m = diagonal(world, k.ranges.clone(), |_| 1.0);
        let found = run(world, &k, &m, 0.0, count);
        for (i, lambda) in found.lambda.iter().enumerate() {
            assert!((lambda / chain_value(i + 1, n) - 1.0).abs() < 1e-10, "{i}: {lambda}");
        }
    }
}

fn fewer_rows_than_ranks(world: &World) {
    let k = diagonal(world, ranges(world, 2, false), |i| 3.0 + i as f64);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let found = with(world, &k, &m, 0.0, 2, Method::Blocks);
    assert!((found.lambda[0] - 3.0).abs() < 1e-14 && (found.lambda[1] - 4.0).abs() < 1e-14, "{:?}", found.lambda);
}

/// Three eigenvalues thirty times each: a block and its images span three dimensions for each of its columns, no more.
fn invariant(world: &World) {
    let k = diagonal(world, ranges(world, 90, false), |i| 1.0 + (i % 3) as f64);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let found = with(world, &k, &m, 0.0, 70, Method::Blocks);
    for (i, lambda) in found.lambda.iter().enumerate() {
        assert!((lambda - (1 + i / 30) as f64).abs() < 1e-12, "{i}: {lambda}");
    }
    orthonormal(world, &m, &found, 1e-10);
}

/// Each rank has a problem of its own.
fn alone(world: &World) {
    let own = World::new(mpi::topology::SimpleCommunicator::self_comm());
    let n = 200 + 10 * world.rank as u64;
    let k = chain(&own, n, false);
    let m = diagonal(&own, k.ranges.clone(), |_| 1.0);
    let mut factor = Factor::new(&own, &k, FactorOptions::new(Symmetry::Positive), "chain").unwrap();
    let pencil = DistributedMatrices::new(&own, &k, &m);
    let mut first = ShiftedFactor { factor: &mut factor, sigma: 0.0 };
    let found = railsqueal::eigen::nearest(&pencil, &mut first, 10, &mut |_, _| ()).unwrap();
    let all = lowest(&pencil, &mut first, &mut ShiftedFactors::new(&pencil), 170, &mut |_, _| ()).unwrap();
    for (i, lambda) in found.lambda.iter().take(10).chain(&all.lambda).enumerate() {
        let k = if i < 10 { i } else { i - 10 };
        assert!((lambda / chain_value(k + 1, n) - 1.0).abs() < 1e-11, "{k}: {lambda}");
    }
}

fn singular_shift(world: &World) {
    let k = diagonal(world, ranges(world, 50, false), |i| 1.0 + i as f64);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let error = Factor::new(world, &k.minus_scaled(7.0, &m), FactorOptions::new(Symmetry::Indefinite), "K - 7 M")
        .err()
        .unwrap();
    assert_eq!(error.exit_code(), 4);
    assert!(error.message().contains("singular"), "{error}");
}

/// The eigenvalue nearest to the shift dwarfs all others in the inverse.
fn beside_an_eigenvalue(world: &World) {
    let n = 300;
    let k = chain(world, n, false);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let sigma = chain_value(100, n) * (1.0 + 1e-7);
    let found = run(world, &k, &m, sigma, 12);
    for lambda in &found.lambda {
        let nearest = (1..=300).map(|i| (chain_value(i, n) - lambda).abs()).fold(f64::MAX, f64::min);
        assert!(nearest < 1e-12, "{lambda}: {nearest:e}");
    }
}

fn too_many(world: &World) {
    let k = chain(world, 20, false);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let mut factor = Factor::new(world, &k, FactorOptions::new(Symmetry::Positive), "chain").unwrap();
    for method in [Method::Blocks, Method::Slepc] {
        let options = ModesOptions { sigma: 0.0, count: 21, method, prefix: String::new() };
        let pencil = DistributedMatrices::new(world, &k, &m);
        let error = modes(&petsc, &mut factor, &pencil, &options, &mut |_, _| ()).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.message().contains("only 20 degrees of freedom"), "{error}");
    }
}

fn many(world: &World) {
    let (n, count) = sized((1500, 400), (600, 200));
    let k = chain(world, n, true);
    let m = diagonal(world, k.ranges.clone(), |_| 2.0);
    let found = with(world, &k, &m, 0.0, count, Method::Blocks);
    assert!(found.lambda.len() < count + 80, "{}", found.lambda.len());
    for (i, lambda) in found.lambda.iter().enumerate() {
        let exact = 0.5 * chain_value(i + 1, n);
        assert!((lambda / exact - 1.0).abs() < 1e-10, "{}: {lambda} against {exact}", i + 1);
    }
    orthonormal(world, &m, &found, 1e-8);
}

/// Doublets all along, and a spectrum that becomes denser.
fn many_of_a_brick(world: &World) {
    let (n, count) = sized(([12, 4, 4], 260), ([6, 4, 4], 170));
    let (k, m) = brick_of(world, n, 0.25);
    run(world, &k, &m, 0.0, count);
}

/// Groups of six eigenvalues within 1e-6 of each other.
fn cluster_value(i: u64) -> f64 {
    (1.0 + (i / 6) as f64) * (1.0 + 1e-6 * (i % 6) as f64)
}

fn in_band(world: &World, value: fn(u64) -> f64, n: u64, from: f64, to: f64) -> FoundModes {
    // In no order.
    let k = diagonal(world, ranges(world, n, true), |i| value(i * 7 % n));
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let pencil = DistributedMatrices::new(world, &k, &m);
    assert_eq!(pencil.order(), n);
    let found = band(&pencil, &mut ShiftedFactors::new(&pencil), from, to, &mut |_, _| ()).unwrap();
    orthonormal(world, &m, &found, 1e-8);
    found
}

fn clustered_band(world: &World) {
    let (n, first, last) = sized((600, 63, 399), (240, 63, 189));
    let (from, to) = (
        0.5 * (cluster_value(first - 1) + cluster_value(first)),
        0.5 * (cluster_value(last) + cluster_value(last + 1)),
    );
    let found = in_band(world, cluster_value, n, from, to);
    assert_eq!(found.lambda.len() as u64, last + 1 - first);
    for (lambda, i) in found.lambda.iter().zip(first..) {
        assert!((lambda / cluster_value(i) - 1.0).abs() < 1e-12, "{i}: {lambda}");
    }
}

/// Returns whether an end itself is within cannot be asked of numbers, but all between the ends must be there.
fn band_of_eigenvalues(world: &World) {
    let value = |i: u64| 1.0 + i as f64;
    let found = in_band(world, value, 200, 21.0, 41.0);
    let inside: Vec<f64> = found.lambda.iter().copied().filter(|l| *l > 21.5 && *l < 40.5).collect();
    assert_eq!(inside.len(), 19, "{:?}", found.lambda);
    assert!(
        found.lambda.len() <= 21 && found.lambda.iter().all(|l| (l - l.round()).abs() < 1e-12),
        "{:?}",
        found.lambda
    );
}

fn empty_band(world: &World) {
    let value = |i: u64| 1.0 + i as f64;
    assert!(in_band(world, value, 100, 20.2, 20.8).lambda.is_empty());
    assert!(in_band(world, value, 100, 100.5, 200.0).lambda.is_empty());
    assert_eq!(in_band(world, value, 100, 90.5, 200.0).lambda.len(), 10);
    assert_eq!(in_band(world, value, 100, -5.0, 200.0).lambda.len(), 100);
}

fn session(world: &World) {
    let options = [("eps_nonsense".to_string(), "3".to_string()), ("-test_eps_ncv".to_string(), "30".to_string())];
    let arguments = ["-test_eps_max_it".to_string(), "90".to_string(), "-flag".to_string()];
    let petsc = Petsc::start(world, &options, &arguments).unwrap();
    let k = chain(world, 100, false);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let mut factor = Factor::new(world, &k, FactorOptions::new(Symmetry::Positive), "chain").unwrap();
    let wanted = ModesOptions { sigma: 0.0, count: 4, method: Method::Slepc, prefix: "test_".into() };
    let pencil = DistributedMatrices::new(world, &k, &m);
    modes(&petsc, &mut factor, &pencil, &wanted, &mut |_, _| ()).unwrap();
    let mut unused = petsc.unused_options().unwrap();
    unused.sort();
    assert_eq!(unused, ["-eps_nonsense 3", "-flag"]);
    assert_eq!(Petsc::start(world, &[], &[]).err().unwrap().exit_code(), 1);
    drop(petsc);
    // An option that PETSc refuses: its own words, and the user's fault.
    let petsc = Petsc::start(world, &[("test_eps_type".into(), "krylof".into())], &[]).unwrap();
    let error = modes(&petsc, &mut factor, &pencil, &wanted, &mut |_, _| ()).unwrap_err();
    assert_eq!(error.exit_code(), 2, "{error}");
    assert!(error.message().contains("krylof"), "{error}");
    let versions = Petsc::versions();
    assert!(versions.petsc.starts_with("3.") && versions.scalar.contains("complex"), "{versions:?}");
}
