//! Matrices with known answers, distributed by rows.

use railsqueal::parallel::World;
use railsqueal::petsc::csr::DistCsr;

/// The first of two sizes; the second where RAILSQUEAL_SMALL is set: under valgrind, which works a hundred times as
/// long, and for which the way through the code counts and not the size.
pub fn sized<T>(usual: T, small: T) -> T {
    if std::env::var_os("RAILSQUEAL_SMALL").is_some() {
        small
    } else {
        usual
    }
}

/// Which rank owns how many rows: all alike, or none on the last rank (a rank without rows must work).
pub fn ranges(world: &World, n: u64, last_is_empty: bool) -> Vec<u64> {
    let owners = if last_is_empty && world.size > 1 { world.size - 1 } else { world.size } as u64;
    (0..=world.size as u64).map(|r| n * r.min(owners) / owners).collect()
}

/// The local rows of a matrix whose row `i` is `row(i)`, (column, value) ascending.
pub fn from_rows(world: &World, ranges: Vec<u64>, row: impl Fn(u64) -> Vec<(u64, f64)>) -> DistCsr {
    let mut a = DistCsr { indptr: vec![0], ..Default::default() };
    for i in ranges[world.rank]..ranges[world.rank + 1] {
        for (c, v) in row(i) {
            a.cols.push(c as u32);
            a.values.push(v);
        }
        a.indptr.push(a.cols.len());
    }
    a.ranges = ranges;
    a
}

/// −d²/dx² on a chain of `n` masses between two walls: eigenvalues 4 sin²(k π / 2(n + 1)).
pub fn chain(world: &World, n: u64, last_is_empty: bool) -> DistCsr {
    from_rows(world, ranges(world, n, last_is_empty), |i| {
        let mut row = Vec::new();
        if i > 0 {
            row.push((i - 1, -1.0));
        }
        row.push((i, 2.0));
        if i + 1 < n {
            row.push((i + 1, -1.0));
        }
        row
    })
}

/// The same chain without walls: singular.
pub fn free_chain(world: &World, n: u64) -> DistCsr {
    let mut a = chain(world, n, false);
    let first = a.ranges[world.rank];
    for i in 0..a.n_local() {
        if first + i as u64 == 0 || first + i as u64 == n - 1 {
            let at = a.indptr[i] + a.row(i).0.iter().position(|&c| u64::from(c) == first + i as u64).unwrap();
            a.values[at] = 1.0;
        }
    }
    a
}

/// Unit matrix times `value` with the ranges given.
pub fn diagonal(world: &World, ranges: Vec<u64>, value: impl Fn(u64) -> f64) -> DistCsr {
    from_rows(world, ranges, |i| vec![(i, value(i))])
}

/// [`brick_of`] for a unit cube of `n`³ elements.
pub fn brick(world: &World, n: usize) -> (DistCsr, DistCsr) {
    brick_of(world, [n; 3], 1.0 / n as f64)
}

/// Stiffness (Poisson's ratio 0.3, unit modulus) and consistent mass (unit density) of a block of `n` trilinear cubes
/// of edge `h`, clamped at x = 0. Rows are three per node, nodes ordered x slowest.
pub fn brick_of(world: &World, n: [usize; 3], h: f64) -> (DistCsr, DistCsr) {
    block_of(world, n, h, true)
}

/// [`brick_of`] without a support.
pub fn free_brick_of(world: &World, n: [usize; 3], h: f64) -> (DistCsr, DistCsr) {
    block_of(world, n, h, false)
}

fn block_of(world: &World, n: [usize; 3], h: f64, clamped: bool) -> (DistCsr, DistCsr) {
    let (ke, me) = brick_element(h);
    let plane = (n[1] + 1) * (n[2] + 1);
    // Planes of nodes without rows.
    let held = usize::from(clamped);
    let nodes = (n[0] + 1 - held) * plane;
    let ranges: Vec<u64> = ranges(world, nodes as u64, false).iter().map(|r| 3 * r).collect();
    let assemble = |element: &[[f64; 24]; 24]| {
        from_rows(world, ranges.clone(), |row| {
            let (node, c) = (row as usize / 3 + held * plane, row as usize % 3);
            let at = [node / plane, node / (n[2] + 1) % (n[1] + 1), node % (n[2] + 1)];
            let mut sums = vec![0.0; 81];
            // Each element of which this node is corner `corner`.
            for corner in 0..8 {
                let off = offset(corner);
                if (0..3).any(|d| at[d] < off[d] || at[d] - off[d] >= n[d]) {
                    continue;
                }
                for other in 0..8 {
                    let to = offset(other);
                    let slot = (0..3).fold(0, |s, d| 3 * s + (1 + to[d] - off[d]));
                    for d in 0..3 {
                        sums[3 * slot + d] += element[3 * corner + c][3 * other + d];
                    }
                }
            }
            let mut out = Vec::new();
            for slot in 0..27 {
                let step = [slot / 9, slot / 3 % 3, slot % 3];
                let to: Vec<usize> = (0..3).map(|d| (at[d] + step[d]).wrapping_sub(1)).collect();
                if to[0] == 0 && clamped || (0..3).any(|d| to[d] > n[d]) {
                    continue;
                }
                let column = 3 * ((to[0] - held) * plane + to[1] * (n[2] + 1) + to[2]) as u64;
                out.extend((0..3).map(|d| (column + d, sums[3 * slot + d as usize])));
            }
            out
        })
    };
    (assemble(&ke), assemble(&me))
}

/// Coordinates of the local nodes of [`brick`], three rows each.
pub fn brick_coordinates(world: &World, n: usize, ranges: &[u64]) -> Vec<[f64; 3]> {
    let side = n + 1;
    let place = |k: u64| {
        let node = k as usize + side * side;
        [node / (side * side), node / side % side, node % side].map(|i| i as f64 / n as f64)
    };
    (ranges[world.rank] / 3..ranges[world.rank + 1] / 3).map(place).collect()
}

fn offset(corner: usize) -> [usize; 3] {
    [corner >> 2 & 1, corner >> 1 & 1, corner & 1]
}

fn brick_element(h: f64) -> ([[f64; 24]; 24], [[f64; 24]; 24]) {
    let (nu, gauss) = (0.3, 1.0 / 3f64.sqrt());
    let (lambda, mu) = (nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 / (1.0 + nu));
    let (mut k, mut m) = ([[0.0; 24]; 24], [[0.0; 24]; 24]);
    for point in 0..8 {
        let x: Vec<f64> = offset(point).iter().map(|&o| if o == 1 { gauss } else { -gauss }).collect();
        let sign = |a: usize, d: usize| if offset(a)[d] == 1 { 1.0 } else { -1.0 };
        let part = |a: usize, d: usize| 0.5 * (1.0 + sign(a, d) * x[d]);
        let shape = |a: usize| part(a, 0) * part(a, 1) * part(a, 2);
        let slope =
            |a: usize, d: usize| sign(a, d) / h * (0..3).filter(|&e| e != d).map(|e| part(a, e)).product::<f64>();
        let w = h * h * h / 8.0;
        for a in 0..8 {
            for b in 0..8 {
                let dot: f64 = (0..3).map(|d| slope(a, d) * slope(b, d)).sum();
                for i in 0..3 {
                    for j in 0..3 {
                        let mut v = lambda * slope(a, i) * slope(b, j) + mu * slope(a, j) * slope(b, i);
                        if i == j {
                            v += mu * dot;
                            m[3 * a + i][3 * b + j] += w * shape(a) * shape(b);
                        }
                        k[3 * a + i][3 * b + j] += w * v;
                    }
                }
            }
        }
    }
    (k, m)
}
