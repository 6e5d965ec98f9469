//! Quadratic eigenproblems in closed form, and the complex factorisation.

use crate::dense::dense;
use crate::matrices::*;
use crate::Check;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::Mat;
use num_complex::Complex;
use railsqueal::eigen::quadratic::{nearest, Quadratic, QuadraticSettings, BLOCK};
use railsqueal::parallel::World;
use railsqueal::petsc::complex::ComplexFactor;
use railsqueal::petsc::csr::DistCsr;
use railsqueal::petsc::operator::Operator;
use railsqueal::petsc::pep::{self, QuadraticOptions};
use railsqueal::petsc::shell::ShellOperator;
use railsqueal::petsc::two_sided::{two_sided, StartVectors, TwoSidedOptions};
use railsqueal::petsc::{Petsc, Span};
use railsqueal::stability::confirmation::{self, ConfirmationRequest, Problem};
use railsqueal::stability::dense::DensePencil;
use railsqueal::{Error, Result};
use std::f64::consts::PI;

pub const CHECKS: &[Check] = &[
    ("quadratic: damped chain in closed form", damped_chain),
    ("quadratic: multipliers and a singular mass", saddle_point),
    ("quadratic: a rank without rows is refused", empty_rank),
    ("quadratic: an error of the operator comes through", failing_operator),
    ("two-sided: a chain in a stream in closed form", chain_in_a_stream),
    ("two-sided: vectors of another eigenvalue", other_vectors),
    ("two-sided: an eigenvalue that is none is not confirmed", wrong_eigenvalue),
    ("complex factor: few and many right-hand sides", complex_factor),
    ("complex factor: a singular matrix is an error", singular),
];

/// Sparse matrices with a dense inverse on every rank.
struct Small<'a> {
    world: &'a World,
    matrices: [Operator<'a>; 3],
    inverse: PartialPivLu<Complex<f64>>,
    fail_after: usize,
}

impl<'a> Small<'a> {
    fn new(world: &'a World, k: &'a DistCsr, c: &'a DistCsr, m: &'a DistCsr, target: Complex<f64>) -> Self {
        let [dk, dc, dm] = [k, c, m].map(|a| dense(world, a));
        let p = Mat::from_fn(dk.nrows(), dk.ncols(), |i, j| {
            target * target * dm[(i, j)] + target * dc[(i, j)] + dk[(i, j)]
        });
        Self {
            world,
            matrices: [k, c, m].map(|a| a.operator(world)),
            inverse: p.partial_piv_lu(),
            fail_after: usize::MAX,
        }
    }
}

impl ShellOperator for Small<'_> {
    fn n_local(&self) -> usize {
        self.matrices[0].matrix().n_local()
    }

    fn multiply(&mut self, power: usize, x: &[Complex<f64>], y: &mut [Complex<f64>]) -> Result<()> {
        self.matrices[power].apply(self.world, x, y);
        Ok(())
    }

    fn solve(&mut self, x: &mut [Complex<f64>]) -> Result<()> {
        Quadratic::solve(self, x, 1)
    }
}

impl Quadratic for Small<'_> {
    fn world(&self) -> &World {
        self.world
    }

    fn n_local(&self) -> usize {
        ShellOperator::n_local(self)
    }

    fn multiply(&mut self, power: usize, x: &[Complex<f64>], y: &mut [Complex<f64>], columns: usize) -> Result<()> {
        let n = x.len() / columns;
        x.chunks_exact(n).zip(y.chunks_exact_mut(n)).try_for_each(|(x, y)| ShellOperator::multiply(self, power, x, y))
    }

    fn solve(&mut self, x: &mut [Complex<f64>], columns: usize) -> Result<()> {
        if self.fail_after == 0 {
            return Err(Error::Memory("no more solves".into()));
        }
        self.fail_after -= 1;
        let first = self.matrices[0].matrix().ranges[self.world.rank] as usize;
        let n = x.len() / columns;
        for x in x.chunks_exact_mut(n) {
            let all = self.world.all_gather(x);
            let mut b = Mat::from_fn(all.len(), 1, |i, _| all[i]);
            self.inverse.solve_in_place(&mut b);
            x.iter_mut().enumerate().for_each(|(i, x)| *x = b[(first + i, 0)]);
        }
        Ok(())
    }
}

#[derive(Debug, Clone, Copy)]
enum Way {
    Blocks,
    Slepc,
}

const WAYS: [Way; 2] = [Way::Blocks, Way::Slepc];

/// Eigenvalues, the nearest first; of the vectors it checks that they solve the problem.
fn solve(
    petsc: &Petsc,
    operator: &mut Small,
    target: Complex<f64>,
    count: usize,
    way: Way,
) -> Result<Vec<Complex<f64>>> {
    let n = ShellOperator::n_local(operator);
    let first = operator.matrices[0].matrix().ranges[operator.world.rank];
    let start = |k: f64| {
        let number = move |i: usize| 1.0 + ((0.7 + 0.3 * k) * (first + i as u64) as f64 + k).sin();
        (0..n).map(move |i| Complex::new(number(i), 0.0))
    };
    let (lambda, vectors) = match way {
        Way::Blocks => {
            let start: Vec<_> = (0..BLOCK).flat_map(|k| start(k as f64)).collect();
            let found = nearest(
                operator,
                &start,
                &QuadraticSettings { target, count, tolerance: 1e-12, loose: 0.0 },
                &mut |_, _| {},
            )?;
            (found.lambda, found.vectors)
        }
        Way::Slepc => {
            let options = QuadraticOptions { target, count, tolerance: 1e-12, prefix: "test_".into() };
            let start: Vec<_> = start(0.0).collect();
            let found = pep::quadratic(petsc, operator, &start, &options, &mut |_, _| {})?;
            (found.lambda, found.vectors)
        }
    };
    for (lambda, x) in lambda.iter().zip(&vectors) {
        let (mut sum, mut y) = (vec![Complex::default(); n], vec![Complex::default(); n]);
        for power in 0..3 {
            ShellOperator::multiply(operator, power, x, &mut y)?;
            sum.iter_mut().zip(&y).for_each(|(s, y)| *s += lambda.powi(power as i32) * y);
        }
        let square = |v: &[Complex<f64>]| operator.world.sum(v.iter().map(|v| v.norm_sqr()).sum());
        assert!((square(x) - 1.0).abs() < 1e-12, "{way:?}: a vector of length² {}", square(x));
        assert!(square(&sum) < 1e-18, "{way:?}: residual² of {lambda}: {:e}", square(&sum));
    }
    Ok(lambda)
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
    let mut exact: Vec<Complex<f64>> = (1..=n)
        .flat_map(|i| {
            let w2 = 4.0 * (i as f64 * PI / (2 * (n + 1)) as f64).sin().powi(2);
            let half = 0.5 * (alpha + beta * w2);
            let root = Complex::new(half * half - w2, 0.0).sqrt();
            [root - half, -root - half]
        })
        .collect();
    exact.sort_by(|a, b| (a - target).norm().total_cmp(&(b - target).norm()));
    // The second time the space of the blocks has to restart.
    for (way, count) in [(Way::Blocks, 8), (Way::Blocks, 30), (Way::Slepc, 8)] {
        let found = solve(&petsc, &mut Small::new(world, &k, &c, &m, target), target, count, way).unwrap();
        for (i, (lambda, exact)) in found.iter().zip(&exact).enumerate() {
            assert!((lambda - exact).norm() < 1e-9, "{way:?} {i}: {lambda} against {exact}");
        }
        assert!(found.len() >= count, "{way:?}: {found:?}");
    }
}

/// The chain's masses tied in pairs (2i, 2i+1) by multipliers g: M is singular, K indefinite. What is left is a chain
/// of half as many masses of 2 with springs 1: λ = ± iω, ω² = 2 sin²(kπ / 2(p + 1)) for p pairs.
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
    let exact: Vec<f64> = (1..=pairs).map(|i| 2f64.sqrt() * (i as f64 * PI / (2 * (pairs + 1)) as f64).sin()).collect();
    let mut close = exact.clone();
    close.sort_by(|a, b| (a - 0.3).abs().total_cmp(&(b - 0.3).abs()));
    for way in WAYS {
        let found = solve(&petsc, &mut Small::new(world, &k, &c, &m, target), target, 6, way).unwrap();
        for (lambda, w) in found.iter().zip(&close).take(6) {
            assert!(lambda.re.abs() < 1e-9 && (lambda.im - w).abs() < 1e-9, "{way:?}: {lambda} against {w}i");
        }
    }
}

fn empty_rank(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let k = chain(world, 30, true);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let target = Complex::new(0.0, 1.0);
    for way in WAYS {
        let outcome = solve(&petsc, &mut Small::new(world, &k, &m, &m, target), target, 2, way);
        if world.size == 1 {
            assert!(outcome.is_ok(), "{way:?}: {:?}", outcome.err());
        } else {
            let error = outcome.unwrap_err();
            assert!(error.exit_code() == 1 && error.message().contains("without rows"), "{way:?}: {error}");
        }
    }
}

fn failing_operator(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let k = chain(world, 60, false);
    let m = diagonal(world, k.ranges.clone(), |_| 1.0);
    let target = Complex::new(0.0, 1.0);
    for (way, after) in [(Way::Blocks, 2), (Way::Slepc, 7)] {
        let mut operator = Small::new(world, &k, &m, &m, target);
        operator.fail_after = after;
        let error = solve(&petsc, &mut operator, target, 4, way).unwrap_err();
        assert!(error.exit_code() == 7 && error.message().contains("no more solves"), "{way:?}: {error}");
    }
}

fn complex_factor(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let (k, m) = brick(world, 4);
    let scale = k.max_abs(world) / m.max_abs(world);
    let factors = [Complex::new(1.0, 0.1), Complex::new(-0.3 * scale, 0.05 * scale)];
    let mut factor = ComplexFactor::new(&petsc, &[(&k, factors[0]), (&m, factors[1])], "test_", "aK + bM").unwrap();
    let (n, first) = (k.n_local(), k.ranges[world.rank]);
    for count in [1, 3, 70] {
        let value =
            |row: u64, column: usize| Complex::new((row as f64 + column as f64).sin(), (2.0 * row as f64).cos());
        let right: Vec<Complex<f64>> =
            (0..count).flat_map(|c| (0..n).map(move |i| value(first + i as u64, c))).collect();
        let mut x = right.clone();
        factor.solve(&mut x, count).unwrap();
        let (ko, mo) = (k.operator(world), m.operator(world));
        for c in 0..count {
            let span = c * n..(c + 1) * n;
            let (mut kx, mut mx) = (vec![Complex::default(); n], vec![Complex::default(); n]);
            ko.apply(world, &x[span.clone()], &mut kx);
            mo.apply(world, &x[span.clone()], &mut mx);
            let left = (0..n).map(|i| (factors[0] * kx[i] + factors[1] * mx[i] - right[c * n + i]).norm());
            let worst = world.max(left.fold(0.0, f64::max));
            assert!(worst < 1e-10, "column {c} of {count}: {worst:e}");
        }
    }
}

fn singular(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let k = diagonal(world, ranges(world, 12, false), |i| if i == 5 { 0.0 } else { 1.0 });
    let factors = [Complex::new(1.0, 0.5), Complex::new(0.0, 0.0)];
    let error =
        ComplexFactor::new(&petsc, &[(&k, factors[0]), (&k, factors[1])], "test_", "a matrix").err().expect("singular");
    assert!(error.exit_code() == 4 && error.message().contains("a matrix"), "{error}");
}

/// λ² + γλ + K with K tridiagonal: d on the diagonal, a below and b above it. Its eigenvalues for negative a and b
/// are κ = d − 2 √(ab) cos θ, θ = kπ/(n + 1), with right vectors (a/b)^(j/2) sin jθ and left vectors (b/a)^(j/2) sin
/// jθ.
struct Stream<'a> {
    /// None: the calling rank has all rows.
    world: Option<&'a World>,
    rows: std::ops::Range<usize>,
    matrices: [Mat<f64>; 3],
    inverse: PartialPivLu<Complex<f64>>,
}

const BELOW: f64 = -1.05;
const ABOVE: f64 = -0.95;
const FRICTION: f64 = -0.02;

impl<'a> Stream<'a> {
    fn new(world: Option<&'a World>, n: usize, shift: Complex<f64>) -> Self {
        let entry = |i: usize, j: usize| match i as i64 - j as i64 {
            0 => 2.5,
            1 => BELOW,
            -1 => ABOVE,
            _ => 0.0,
        };
        let unit = |v: f64| Mat::from_fn(n, n, |i, j| if i == j { v } else { 0.0 });
        let matrices = [Mat::from_fn(n, n, entry), unit(FRICTION), unit(1.0)];
        let [k, c, m] = &matrices;
        let whole = Mat::from_fn(n, n, |i, j| k[(i, j)] + shift * (c[(i, j)] + shift * m[(i, j)]));
        let first = |rank: usize| n * rank / world.map_or(1, |w| w.size);
        let rank = world.map_or(0, |w| w.rank);
        Self { world, rows: first(rank)..first(rank + 1), inverse: whole.partial_piv_lu(), matrices }
    }

    fn whole(&self, x: &[Complex<f64>]) -> Mat<Complex<f64>> {
        let all = self.world.map_or_else(|| x.to_vec(), |w| w.all_gather(x));
        Mat::from_fn(all.len(), 1, |i, _| all[i])
    }

    fn own(&self, of: &Mat<Complex<f64>>, out: &mut [Complex<f64>]) {
        self.rows.clone().zip(out).for_each(|(row, out)| *out = of[(row, 0)]);
    }

    fn product(&self, power: usize, transposed: bool, x: &[Complex<f64>], y: &mut [Complex<f64>]) {
        let a = &self.matrices[power];
        let a =
            Mat::from_fn(a.nrows(), a.ncols(), |i, j| Complex::from(if transposed { a[(j, i)] } else { a[(i, j)] }));
        self.own(&(a * self.whole(x)), y);
    }
}

impl ShellOperator for Stream<'_> {
    fn n_local(&self) -> usize {
        self.rows.len()
    }

    fn multiply(&mut self, power: usize, x: &[Complex<f64>], y: &mut [Complex<f64>]) -> Result<()> {
        self.product(power, false, x, y);
        Ok(())
    }

    fn solve(&mut self, x: &mut [Complex<f64>]) -> Result<()> {
        let mut all = self.whole(x);
        self.inverse.solve_in_place(&mut all);
        self.own(&all, x);
        Ok(())
    }

    fn multiply_transposed(&mut self, power: usize, x: &[Complex<f64>], y: &mut [Complex<f64>]) -> Result<()> {
        self.product(power, true, x, y);
        Ok(())
    }

    fn solve_transposed(&mut self, x: &mut [Complex<f64>]) -> Result<()> {
        let mut all = self.whole(x);
        self.inverse.solve_transpose_in_place(&mut all);
        self.own(&all, x);
        Ok(())
    }
}

/// From random vectors near the eigenvalue and from vectors nearly right at a distance, over all ranks and on each by
/// itself, and as a whole by LAPACK.
fn chain_in_a_stream(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    for (n, k, span) in [(60, 20, Span::World), (60, 41, Span::Rank), (9, 4, Span::World), (9, 4, Span::Rank)] {
        let theta = k as f64 * PI / (n + 1) as f64;
        let kappa = 2.5 - 2.0 * (BELOW * ABOVE).sqrt() * theta.cos();
        let exact = Complex::new(-0.5 * FRICTION, (kappa - 0.25 * FRICTION * FRICTION).sqrt());
        let ratio = (BELOW / ABOVE).sqrt();
        let vector = |by: f64| (1..=n).map(|j| by.powi(j) * (j as f64 * theta).sin()).collect::<Vec<f64>>();
        let (right, left) = (vector(ratio), vector(1.0 / ratio));
        for given in [false, true] {
            let shift = exact + if given { Complex::new(0.02, 0.03) } else { Complex::new(1e-4, 1e-4) };
            let mut operator = Stream::new((span == Span::World).then_some(world), n as usize, shift);
            let rows = operator.rows.clone();
            let start = |v: &[f64]| -> Vec<Complex<f64>> {
                let off = |j: usize| Complex::new(v[j] + 1e-7 * (j as f64).sin(), 1e-7 * (2.0 * j as f64).cos());
                if given {
                    rows.clone().map(off).collect()
                } else {
                    Vec::new()
                }
            };
            let (x, y) = (start(&right), start(&left));
            let options = TwoSidedOptions { shift, target: exact, tolerance: 1e-10, space: 12, prefix: "test_", span };
            let pair =
                two_sided(&petsc, &mut operator, StartVectors { value: exact, right: &x, left: &y }, &options).unwrap();
            assert!((pair.value - exact).norm() < 1e-10, "{n} rows, given {given}: {} against {exact}", pair.value);
            // Along the exact ones, but for a factor.
            for (found, exact, side) in [(&pair.right, &right, "right"), (&pair.left, &left, "left")] {
                let found = operator.whole(found);
                let product: Complex<f64> = (0..exact.len()).map(|j| found[(j, 0)] * exact[j]).sum();
                let sizes = found.norm_l2() * exact.iter().map(|v| v * v).sum::<f64>().sqrt();
                assert!(product.norm() > (1.0 - 1e-12) * sizes, "{n} rows, {side}: {:e}", 1.0 - product.norm() / sizes);
            }
        }
    }
}

/// Two chains without a spring between them. Vectors of the first one say nothing of the second one, so that no space
/// begun with them holds an eigenvalue of it; the second attempt, begun at random, confirms that one all the same.
fn other_vectors(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let (n, stiffer) = (60, 0.2);
    let kappa = 2.5 + stiffer - 2.0 * (BELOW * ABOVE).sqrt() * (20.0 * PI / (n + 1) as f64).cos();
    let sought = Complex::new(-0.5 * FRICTION, (kappa - 0.25 * FRICTION * FRICTION).sqrt());
    let shift = sought + Complex::new(0.02, 0.03);
    let mut operator = Stream::new(Some(world), 2 * n, shift);
    let [k, c, m] = &mut operator.matrices;
    (k[(n, n - 1)], k[(n - 1, n)]) = (0.0, 0.0);
    (n..2 * n).for_each(|i| k[(i, i)] += stiffer);
    let whole = Mat::from_fn(2 * n, 2 * n, |i, j| k[(i, j)] + shift * (c[(i, j)] + shift * m[(i, j)]));
    operator.inverse = whole.partial_piv_lu();
    let first_chain = |row: usize| if row < n { Complex::new(1.0, (row as f64).sin()) } else { Complex::default() };
    let vector: Vec<Complex<f64>> = operator.rows.clone().map(first_chain).collect();
    let (span, effort) = (Span::World, (1e-8, 4));
    let problem = Problem { petsc: &petsc, span, norms: [4.5, 0.02, 1.0], rate: 1.0, system: "two chains" };
    let asked = |value| ConfirmationRequest { value, shift, right: &vector, left: &vector, effort };
    let found = problem.confirm(&mut operator, &asked(sought)).unwrap().expect("the second attempt converges");
    assert!(found.difference < 1e-9, "{found:?}");
    assert_eq!(problem.confirm(&mut operator, &asked(sought * 1.001)).unwrap_err().exit_code(), 4);
}

/// λ² + K with K = [2 1; −1 2]: λ² = −2 ± i, half of which grow. What is off by a thousandth is refused with both
/// values.
fn wrong_eigenvalue(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let a = [[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [-2.0, -1.0, 0.0, 0.0], [1.0, -2.0, 0.0, 0.0]];
    let pencil = || DensePencil { a: Mat::from_fn(4, 4, |i, j| a[i][j]), e: Mat::identity(4, 4), rate: 300.0 };
    let exact = Complex::new(-2.0, 1.0).sqrt() * 300.0;
    assert!(exact.re > 0.0 && exact.im > 0.0);
    let found = confirmation::of_pencil(&petsc, pencil(), &[exact, exact.conj()]).unwrap();
    assert_eq!(found.len(), 2);
    for c in found {
        let c = c.expect("it converges");
        assert!(c.difference < 1e-13 && c.residuals.iter().all(|r| *r < 1e-13), "{c:?}");
        assert!(c.condition > 0.5 && c.condition < 10.0, "{c:?}");
    }
    // In a unit of λ far from the values, as that of a stiff contact.
    let far = || DensePencil { e: 1e9 * Mat::<f64>::identity(4, 4), rate: 300e9, ..pencil() };
    for c in confirmation::of_pencil(&petsc, far(), &[exact]).unwrap() {
        assert!(c.is_some_and(|c| c.difference < 1e-13 && c.condition < 10.0), "{c:?}");
    }
    let error = confirmation::of_pencil(&petsc, pencil(), &[exact * 1.001]).unwrap_err();
    assert_eq!(error.exit_code(), 4);
    let hertz = format!("{:.6} Hz", exact.im / (2.0 * PI));
    assert!(error.message().contains("does not confirm") && error.message().contains(&hertz), "{error}");
}
