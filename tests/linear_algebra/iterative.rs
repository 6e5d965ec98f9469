//! Conjugate gradients with multigrid beside the direct solver.

use crate::matrices::*;
use crate::Check;
use railsqueal::parallel::World;
use railsqueal::petsc::csr::{dot, norm2, DistCsr};
use railsqueal::petsc::ksp::{rigid_body_motions, Iterative, IterativeOptions};
use railsqueal::petsc::{Factor, FactorOptions, Petsc, Symmetry};

pub const CHECKS: &[Check] = &[
    ("multigrid: residuals of right-hand sides of any size", residuals),
    ("multigrid: block of the inverse equals the direct one", inverse),
    ("multigrid: iterations grow little with the mesh", mesh_independence),
    ("multigrid: an approximate solution is improved, not made again", improvement),
    ("multigrid: failures are errors", failures),
];

fn options(tolerance: f64) -> IterativeOptions {
    IterativeOptions { tolerance, max_iterations: 200, prefix: "test_".into() }
}

fn brick_motions(world: &World, n: usize, k: &DistCsr) -> Vec<Vec<f64>> {
    rigid_body_motions(&brick_coordinates(world, n, &k.ranges))
}

fn residuals(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let (k, _) = brick(world, 8);
    let motions = brick_motions(world, 8, &k);
    let mut solver = Iterative::new(&petsc, &k, 3, &motions, options(1e-10), "brick").unwrap();
    let n = k.n_local();
    let operator = k.operator(world);
    // Very unlike in size, one of them zero, an odd number.
    let sizes = [1.0, 1e-9, 1e12, 0.0, 3.0];
    let b: Vec<f64> = sizes
        .iter()
        .enumerate()
        .flat_map(|(j, s)| k.rows_of(world.rank).map(move |i| s * (1.3 * i as f64 + j as f64).cos()))
        .collect();
    let mut x = b.clone();
    solver.solve(&mut x, sizes.len()).unwrap();
    let mut ax = vec![0.0; n];
    for (j, size) in sizes.iter().enumerate() {
        operator.apply(world, &x[j * n..][..n], &mut ax);
        let r: Vec<f64> = ax.iter().zip(&b[j * n..]).map(|(p, q)| p - q).collect();
        let (r, b) = (norm2(world, &r), norm2(world, &b[j * n..][..n]));
        assert!(r <= 1e-10 * b, "column {j} of size {size}: residual {:e}", r / b);
    }
}

fn inverse(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let (k, _) = brick(world, 6);
    let rows: Vec<u64> = (0..9).map(|i| (i * 83 + 5) % k.order()).collect();
    let motions = brick_motions(world, 6, &k);
    let mut solver = Iterative::new(&petsc, &k, 3, &motions, options(1e-11), "brick").unwrap();
    let mut calls = 0;
    let by_iteration = solver.inverse_block(&rows, &mut |_, _| calls += 1).unwrap();
    let mut factor = Factor::new(world, &k, FactorOptions::new(Symmetry::Positive), "brick").unwrap();
    let direct = factor.inverse_block(&rows).unwrap();
    assert_eq!(calls, 5);
    assert_eq!(by_iteration.nrows(), direct.nrows());
    for j in 0..direct.ncols() {
        for i in 0..direct.nrows() {
            let gap = (by_iteration[(i, j)] - direct[(i, j)]).abs() / direct[(j, j)];
            assert!(gap < 1e-9, "({i}, {j}): {gap:e}");
        }
    }
}

/// In the energy norm, from where it is.
fn improvement(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let (k, _) = brick(world, 8);
    let motions = brick_motions(world, 8, &k);
    let mut solver = Iterative::new(&petsc, &k, 3, &motions, options(1e-10), "brick").unwrap();
    let mut factor = Factor::new(world, &k, FactorOptions::new(Symmetry::Positive), "brick").unwrap();
    let n = k.n_local();
    let b: Vec<f64> =
        (0..2).flat_map(|j| k.rows_of(world.rank).map(move |i| (0.9 * i as f64 + j as f64).sin())).collect();
    let mut exact = b.clone();
    factor.solve(&mut exact, 2).unwrap();
    let energy = |solver: &[f64], j: usize| {
        let e: Vec<f64> = solver[j * n..][..n].iter().zip(&exact[j * n..]).map(|(x, y)| x - y).collect();
        let (mut ke, mut ku) = (vec![0.0; n], vec![0.0; n]);
        k.operator(world).apply(world, &e, &mut ke);
        k.operator(world).apply(world, &exact[j * n..][..n], &mut ku);
        (dot(world, &e, &ke) / dot(world, &exact[j * n..][..n], &ku)).sqrt()
    };
    let mut x = vec![0.0; 2 * n];
    let mut spent = Vec::new();
    for tolerance in [1e-3, 1e-6, 1e-9] {
        let before = solver.effort().0;
        solver.improve(&mut x, &b, 2, tolerance).unwrap();
        spent.push(solver.effort().0 - before);
        for j in 0..2 {
            // The preconditioner stands for the inverse: near it, not equal.
            let error = energy(&x, j);
            assert!(error <= 3.0 * tolerance, "column {j}: energy error {error:e} for {tolerance:e}");
        }
    }
    let before = solver.effort().0;
    solver.improve(&mut x, &b, 2, 1e-9).unwrap();
    assert_eq!(solver.effort().0, before, "a solution that is good enough");
    let mut y = vec![0.0; 2 * n];
    solver.improve(&mut y, &b, 2, 1e-9).unwrap();
    let whole = solver.effort().0 - before;
    assert!(spent.iter().sum::<usize>() <= whole + 6, "{spent:?} iterations in steps, {whole} at once");
}

fn mesh_independence(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let mut counts = Vec::new();
    for n in [6, sized(16, 9)] {
        let (k, _) = brick(world, n);
        let motions = brick_motions(world, n, &k);
        let mut solver = Iterative::new(&petsc, &k, 3, &motions, options(1e-8), "brick").unwrap();
        let mut x: Vec<f64> = k.rows_of(world.rank).map(|i| (i as f64).sin()).collect();
        solver.solve(&mut x, 1).unwrap();
        counts.push(solver.effort().0);
    }
    // Without a coarse space the number would grow as the number of elements along an edge, 2.7 times.
    assert!(counts[1] <= 30 && 2 * counts[1] <= 4 * counts[0], "{counts:?}");
}

fn failures(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let (k, _) = brick(world, 5);
    let motions = brick_motions(world, 5, &k);
    let few = IterativeOptions { max_iterations: 2, ..options(1e-12) };
    let mut solver = Iterative::new(&petsc, &k, 3, &motions, few, "brick").unwrap();
    let mut x = vec![1.0; k.n_local()];
    let error = solver.solve(&mut x, 1).unwrap_err();
    assert_eq!(error.exit_code(), 4, "{error}");
    assert!(error.message().contains("limit of iterations"), "{error}");
    let mut x = vec![f64::NAN; k.n_local()];
    assert_eq!(solver.solve(&mut x, 1).unwrap_err().exit_code(), 1);
    // Shifted beyond its lowest eigenvalues.
    let one = diagonal(world, k.ranges.clone(), |_| 1.0);
    let indefinite = k.minus_scaled(0.5, &one);
    let outcome = Iterative::new(&petsc, &indefinite, 3, &motions, options(1e-8), "shifted")
        .and_then(|mut s| s.solve(&mut vec![1.0; k.n_local()], 1));
    let error = outcome.unwrap_err();
    assert_eq!(error.exit_code(), 4, "{error}");
}
