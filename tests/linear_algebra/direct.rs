//! Products, factorisations, solves, blocks of the inverse.

use crate::matrices::*;
use crate::Check;
use num_complex::Complex;
use railsqueal::parallel::World;
use railsqueal::petsc::csr::{norm2, DistCsr, Stored};
use railsqueal::petsc::{Factor, FactorOptions, Ordering, Symmetry};
use railsqueal::scratch::Scratch;
use railsqueal::Error;

pub const CHECKS: &[Check] = &[
    ("product with a chain", product),
    ("asymmetry of one entry is seen", asymmetry),
    ("half of the entries are the whole matrix", half),
    ("shifted matrix on the union of patterns", shifted),
    ("solve, every kind and ordering", solve),
    ("solve of several right-hand sides", solve_many),
    ("rank without rows", empty_rank),
    ("factors on the disk are those in memory", out_of_core),
    ("inverse block equals solves", inverse_block),
    ("inverse of the chain in closed form", inverse_closed_form),
    ("inertia counts the eigenvalues below the shift", inertia),
    ("singular matrix names its rows", singular),
    ("indefinite matrix is refused as positive", not_positive),
    ("entry that is not a number is refused", not_finite),
    ("estimate is of the size of the factorisation", estimate),
];

/// A vector without symmetry, the same on any number of ranks.
fn sample(a: &DistCsr, world: &World, seed: f64) -> Vec<f64> {
    a.rows_of(world.rank).map(|i| (seed + 1.7 * i as f64).sin() + 0.3).collect()
}

fn residual(world: &World, a: &DistCsr, x: &[f64], b: &[f64]) -> f64 {
    let mut ax = vec![0.0; x.len()];
    a.operator(world).apply(world, x, &mut ax);
    let r: Vec<f64> = ax.iter().zip(b).map(|(p, q)| p - q).collect();
    norm2(world, &r) / norm2(world, b)
}

fn product(world: &World) {
    let a = chain(world, 50, false);
    let x: Vec<f64> = a.rows_of(world.rank).map(|i| (i as f64).powi(2)).collect();
    let mut y = vec![0.0; x.len()];
    a.operator(world).apply(world, &x, &mut y);
    for (i, v) in a.rows_of(world.rank).zip(y) {
        let exact = if i == 49 { 2.0 * 49f64.powi(2) - 48f64.powi(2) } else { -2.0 };
        let exact = if i == 0 { -1.0 } else { exact };
        assert_eq!(v, exact, "row {i}");
    }
    assert_eq!(a.norm_inf(world), 4.0);
    assert_eq!(a.max_abs(world), 2.0);
}

fn asymmetry(world: &World) {
    let mut a = chain(world, 31, false);
    assert_eq!(a.asymmetry(world), 0.0);
    // Row 15 reaches over to another rank on two ranks.
    let rows = a.rows_of(world.rank);
    if rows.contains(&15) {
        let i = (15 - rows.start) as usize;
        let at = a.indptr[i] + a.row(i).0.iter().position(|&c| c == 14).unwrap();
        a.values[at] = -0.5;
    }
    assert_eq!(a.asymmetry(world), 0.25);
}

/// The matrix with the own entries above the diagonal left out.
fn lower(world: &World, all: &DistCsr) -> DistCsr {
    let own = all.rows_of(world.rank);
    let mut half = DistCsr { ranges: all.ranges.clone(), indptr: vec![0], ..DistCsr::default() };
    half.stored = Stored::Lower { first: own.start };
    for i in 0..all.n_local() {
        let above = own.start + i as u64 + 1..own.end;
        for (&c, &v) in all.row(i).0.iter().zip(all.row(i).1).filter(|(c, _)| !above.contains(&u64::from(**c))) {
            half.cols.push(c);
            half.values.push(v);
        }
        half.indptr.push(half.cols.len());
    }
    half
}

fn half(world: &World) {
    let (k, m) = brick(world, 4);
    // Symmetric to the last bit between the own rows.
    let [k, m] = [&k, &m].map(|a| lower(world, a).full().into_owned());
    let [low, light] = [&k, &m].map(|a| lower(world, a));
    low.validate(world, "half").unwrap();
    let same = |a: &DistCsr, b: &DistCsr| (&a.indptr, &a.cols, &a.values) == (&b.indptr, &b.cols, &b.values);
    assert!(same(&low.full(), &k) && low.full().stored == Stored::Whole);
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-14 * a.abs();
    assert!(close(low.norm_inf(world), k.norm_inf(world)) && low.max_abs(world) == k.max_abs(world));
    assert!(low.asymmetry(world) < 1e-14);
    let (n, first) = (k.n_local(), k.rows_of(world.rank).start);
    for (i, col) in (0..n).flat_map(|i| (0..k.order()).map(move |c| (i, c))) {
        assert_eq!(low.get(i, col), k.get(i, col), "({}, {col})", first + i as u64);
    }
    assert_eq!(low.diagonal(world.rank), k.diagonal(world.rank));
    // Sums are stored as their first term is.
    assert!(same(&low.minus_scaled(0.3, &light), &low.minus_scaled(0.3, &m)));
    assert!(same(&low.minus_scaled(0.3, &m).full(), &k.minus_scaled(0.3, &m)));
    assert!(same(&k.minus_scaled(0.3, &light), &k.minus_scaled(0.3, &m)));
    let held = [1, 5, k.order() - 1];
    let [mut fixed, mut all] = [low.clone(), k.clone()];
    fixed.hold(world.rank, &held, 2.0);
    all.hold(world.rank, &held, 2.0);
    assert!(same(&fixed.full(), &all));
    assert_eq!(low.gather(world), k.gather(world));
    // Products, of one column, of some, and of complex ones.
    let x: Vec<f64> = (0..11).flat_map(|j| sample(&k, world, f64::from(j))).collect();
    let scale = k.norm_inf(world);
    let (mut y, mut z) = (vec![f64::NAN; 11 * n], vec![f64::NAN; 11 * n]);
    for columns in [1, 3, 8, 11] {
        low.operator(world).apply_block(world, &x[..columns * n], &mut y[..columns * n], columns);
        k.operator(world).apply_block(world, &x[..columns * n], &mut z[..columns * n], columns);
        let worst = y[..columns * n].iter().zip(&z).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(worst < 1e-14 * scale, "{columns} columns: {worst:e} of {scale:e}");
    }
    let x: Vec<Complex<f64>> = (0..n).map(|i| Complex::new(x[i], x[n + i])).collect();
    let mut w = vec![Complex::new(f64::NAN, 0.0); n];
    low.operator(world).apply(world, &x, &mut w);
    let worst = (0..n).fold(0.0, |m: f64, i| m.max((w[i] - Complex::new(z[i], z[n + i])).norm()));
    assert!(worst < 1e-14 * scale, "complex: {worst:e} of {scale:e}");
    // Factors of half a matrix, also where all of it is asked for.
    let b = sample(&k, world, 0.0);
    for kind in [Symmetry::Positive, Symmetry::Indefinite, Symmetry::General] {
        let mut x = b.clone();
        Factor::new(world, &low, FactorOptions::new(kind), "half").unwrap().solve(&mut x, 1).unwrap();
        assert!(residual(world, &k, &x, &b) < 1e-12, "{kind:?}");
    }
}

fn shifted(world: &World) {
    let a = chain(world, 20, false);
    let m = from_rows(world, a.ranges.clone(), |i| {
        if i < 10 {
            vec![(i, 2.0), (i + 10, 1.0)]
        } else {
            vec![(i - 10, 1.0), (i, 2.0)]
        }
    });
    let s = a.minus_scaled(0.5, &m);
    s.validate(world, "shifted").unwrap();
    for (i, row) in s.rows_of(world.rank).enumerate() {
        for col in 0..20 {
            assert_eq!(s.get(i, col), a.get(i, col) - 0.5 * m.get(i, col), "({row}, {col})");
        }
    }
}

fn solve(world: &World) {
    let (k, _) = brick(world, 6);
    assert!(k.asymmetry(world) < 1e-14, "{}", k.asymmetry(world));
    let b = sample(&k, world, 0.0);
    for kind in [Symmetry::Positive, Symmetry::Indefinite, Symmetry::General] {
        for ordering in [Ordering::Metis, Ordering::Scotch, Ordering::Pord] {
            let mut f = Factor::new(world, &k, FactorOptions { kind, ordering }, "brick").unwrap();
            let mut x = b.clone();
            f.solve(&mut x, 1).unwrap();
            let r = residual(world, &k, &x, &b);
            assert!(r < 1e-12, "{kind:?} {ordering:?}: residual {r:e}");
        }
    }
}

/// Solutions, entries of the inverse, inertia and a second factorisation; the folder holds the factors, and nothing
/// at the end.
fn out_of_core(world: &World) {
    let place = tempfile::tempdir().unwrap();
    let mine = World::new(mpi::traits::Communicator::duplicate(&world.comm));
    mine.scratch.set(Scratch::new(place.path()).unwrap()).unwrap();
    let bytes = || -> u64 {
        let files = std::fs::read_dir(mine.scratch.get().unwrap().path()).unwrap();
        files.map(|f| f.unwrap().metadata().unwrap().len()).sum()
    };
    let (k, m) = brick(world, 8);
    let (b, rows) = (sample(&k, world, 0.0), [0, 7, 100, 311]);
    for (kind, shift) in [(Symmetry::Positive, 0.0), (Symmetry::Indefinite, 3.0), (Symmetry::General, 0.0)] {
        let name = format!("{kind:?}");
        let a = k.minus_scaled(shift, &m);
        let of = |world| {
            let mut f = Factor::new(world, &a, FactorOptions::new(kind), &name).unwrap();
            f.renew(&a, &name).unwrap();
            let mut x = b.clone();
            f.solve(&mut x, 1).unwrap();
            let block = (kind != Symmetry::General).then(|| f.inverse_block(&rows).unwrap());
            (x, block, f.negative_pivots(), f)
        };
        let (x, inverse, negative, f) = of(&mine);
        let entries = 8 * f.statistics().factor_entries;
        let held = world.sum_u64(bytes());
        assert!(held > entries / 2, "{kind:?}: {held} bytes in the folder, {entries} of entries");
        drop(f);
        assert_eq!(world.sum_u64(bytes()), 0, "{kind:?}: factors stay");
        let (expected, block, below, _) = of(world);
        assert_eq!(negative, below, "{kind:?}");
        let size = norm2(world, &expected);
        let off: Vec<f64> = x.iter().zip(&expected).map(|(a, b)| a - b).collect();
        assert!(norm2(world, &off) <= 1e-12 * size, "{kind:?}: {:e} of {size:e}", norm2(world, &off));
        if let (Some(a), Some(b)) = (inverse, block) {
            assert!((&a - &b).norm_l2() <= 1e-12 * b.norm_l2(), "{kind:?}: {:e}", (&a - &b).norm_l2());
        }
    }
}

/// Blocks of right-hand sides: few, many, and numbers that are no multiple of MUMPS's own block.
fn solve_many(world: &World) {
    let (k, _) = brick(world, 8);
    let mut f = Factor::new(world, &k, FactorOptions::new(Symmetry::Positive), "brick").unwrap();
    for count in [2, 7, 8, 9, 19] {
        let columns: Vec<Vec<f64>> = (0..count).map(|j| sample(&k, world, j as f64)).collect();
        let mut x = columns.concat();
        f.solve(&mut x, count).unwrap();
        let n = f.n_local();
        for (j, b) in columns.iter().enumerate() {
            let r = residual(world, &k, &x[j * n..(j + 1) * n], b);
            assert!(r < 1e-12, "column {j} of {count}: residual {r:e}");
        }
    }
}

fn empty_rank(world: &World) {
    let a = chain(world, 40, true);
    let mut f = Factor::new(world, &a, FactorOptions::new(Symmetry::Positive), "chain").unwrap();
    let b = sample(&a, world, 1.0);
    let mut x = b.clone();
    f.solve(&mut x, 1).unwrap();
    let r = residual(world, &a, &x, &b);
    assert!(r < 1e-12, "residual {r:e}");
    // One row in all: most ranks have none.
    let one = diagonal(world, ranges(world, 1, false), |_| 4.0);
    let mut f = Factor::new(world, &one, FactorOptions::new(Symmetry::Positive), "one").unwrap();
    let mut x = vec![2.0; one.n_local()];
    f.solve(&mut x, 1).unwrap();
    assert!(x.iter().all(|v| (v - 0.5).abs() < 1e-15), "{x:?}");
}

fn inverse_block(world: &World) {
    let (k, _) = brick(world, 6);
    let n = k.order();
    // Rows in no order, of all ranks.
    let rows: Vec<u64> = (0..60).map(|i| (i * 37 + 11) % n).collect();
    let mut f = Factor::new(world, &k, FactorOptions::new(Symmetry::Positive), "brick").unwrap();
    let block = f.inverse_block(&rows).unwrap();
    let own = k.rows_of(world.rank);
    for (j, &row) in rows.iter().enumerate().step_by(7) {
        let mut x = vec![0.0; k.n_local()];
        if own.contains(&row) {
            x[(row - own.start) as usize] = 1.0;
        }
        f.solve(&mut x, 1).unwrap();
        let x = world.gather(&x);
        if world.is_root() {
            let scale = block[(j, j)];
            for (i, &other) in rows.iter().enumerate() {
                let gap = (block[(i, j)] - x[other as usize]).abs() / scale;
                assert!(gap < 1e-10, "({other}, {row}): {gap:e}");
                assert_eq!(block[(i, j)], block[(j, i)]);
            }
        }
    }
    assert!(world.is_root() || block.nrows() == 0);
}

/// Inverse of the chain: (min + 1)(n − max) / (n + 1).
fn inverse_closed_form(world: &World) {
    let n = 30u64;
    let a = chain(world, n, false);
    for kind in [Symmetry::Positive, Symmetry::Indefinite] {
        let mut f = Factor::new(world, &a, FactorOptions::new(kind), "chain").unwrap();
        let rows = [29, 0, 14, 15, 3];
        let block = f.inverse_block(&rows).unwrap();
        if world.is_root() {
            for (i, &p) in rows.iter().enumerate() {
                for (j, &q) in rows.iter().enumerate() {
                    let exact = ((p.min(q) + 1) * (n - p.max(q))) as f64 / (n + 1) as f64;
                    assert!((block[(i, j)] - exact).abs() < 1e-12, "({p}, {q}): {} against {exact}", block[(i, j)]);
                }
            }
        }
    }
}

fn inertia(world: &World) {
    let n = 100u64;
    let a = chain(world, n, false);
    let one = diagonal(world, a.ranges.clone(), |_| 1.0);
    let eigenvalue = |k: u64| 4.0 * (k as f64 * std::f64::consts::PI / (2 * (n + 1)) as f64).sin().powi(2);
    for below in [0, 1, 17, 50, 99, 100] {
        let shift = if below == n { 5.0 } else { 0.5 * (eigenvalue(below) + eigenvalue(below + 1)) };
        let s = a.minus_scaled(shift, &one);
        let f = Factor::new(world, &s, FactorOptions::new(Symmetry::Indefinite), "shifted chain").unwrap();
        assert_eq!(f.negative_pivots(), below, "shift {shift}");
    }
}

fn message<T>(result: Result<T, Error>, code: i32, what: &str) -> String {
    match result {
        Ok(_) => panic!("{what}: no error"),
        Err(e) => {
            assert_eq!(e.exit_code(), code, "{what}: {e}");
            e.to_string()
        }
    }
}

fn singular(world: &World) {
    for kind in [Symmetry::Positive, Symmetry::Indefinite] {
        let a = free_chain(world, 60);
        let text = message(Factor::new(world, &a, FactorOptions::new(kind), "free chain"), 4, "free chain");
        assert!(text.contains("singular") && text.contains("free chain"), "{kind:?}: {text}");
        // A row of its own with a zero: named.
        let d = diagonal(world, ranges(world, 12, false), |i| if i == 7 { 0.0 } else { 1.0 + i as f64 });
        let text = message(Factor::new(world, &d, FactorOptions::new(kind), "diagonal"), 4, "diagonal");
        assert!(text.contains("in rows 7.") || text.contains("in row 7."), "{kind:?}: {text}");
    }
}

fn not_positive(world: &World) {
    let d = diagonal(world, ranges(world, 12, false), |i| i as f64 - 3.5);
    let text = message(Factor::new(world, &d, FactorOptions::new(Symmetry::Positive), "stiffness"), 4, "indefinite");
    assert!(text.contains("4 negative pivots"), "{text}");
}

fn not_finite(world: &World) {
    let d = diagonal(world, ranges(world, 12, false), |i| if i == 5 { f64::NAN } else { 1.0 });
    let text = message(Factor::new(world, &d, FactorOptions::new(Symmetry::Positive), "stiffness"), 3, "NaN");
    assert!(text.contains("(5, 5) is NaN"), "{text}");
}

fn estimate(world: &World) {
    let (k, _) = brick(world, 8);
    let options = FactorOptions::new(Symmetry::Positive);
    let estimate = Factor::estimate(world, &k, options).unwrap();
    let counted = Factor::new(world, &k, options, "brick").unwrap().statistics();
    let ratio = counted.factor_entries as f64 / estimate.factor_entries as f64;
    assert!((0.5..1.5).contains(&ratio), "{estimate:?} {counted:?}");
    assert!(estimate.memory_max_mb >= 1 && estimate.memory_sum_mb >= estimate.memory_max_mb, "{estimate:?}");
}
