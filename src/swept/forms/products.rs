//! Products of the matrices of a section with columns of amplitudes.

use super::{Forms, NodeStiffness};
use faer::{Mat, MatRef};

/// Columns that go through the pairs of nodes together: each block is made once for all of them.
const TOGETHER: usize = 4;

/// Amplitudes of one row in columns that go together.
type Row = [f64; TOGETHER];

impl Forms {
    /// (K_n − σM) x of columns, `[order, k]`.
    pub fn dynamic(&self, n: usize, sigma: f64, x: MatRef<'_, f64>) -> Mat<f64> {
        let (rings, w) = (self.of_rings(n), self.path.length_integral(n));
        self.constrained(n, x, |x| {
            self.product(x, |k| {
                let mut block = self.block(n, sigma, k);
                if let Some(ring) = rings.get(&k).filter(|_| !rings.is_empty()) {
                    block.as_flattened_mut().iter_mut().zip(ring.as_flattened()).for_each(|(b, r)| *b += w * r);
                }
                block
            })
        })
    }

    /// M x of columns at the order n, `[order, k]`.
    pub fn mass(&self, n: usize, x: MatRef<'_, f64>) -> Mat<f64> {
        let whole = self.path.length_integral(n);
        self.constrained(n, x, |x| self.inertia(x, whole))
    }

    /// M x of columns at the order n with (U, W) of x alone, or with V alone, each metre of a line.
    pub(crate) fn mass_of(&self, along: bool, x: MatRef<'_, f64>) -> Mat<f64> {
        let part = Mat::from_fn(x.nrows(), x.ncols(), |i, k| if (i % 3 == 1) == along { x[(i, k)] } else { 0.0 });
        self.inertia(part.as_ref(), 1.0)
    }

    /// Projects columns of amplitudes of the order n, `[order, k]`, on motions that meet the constraints: regular on
    /// the axle, and of a half section symmetric or antisymmetric in its middle plane.
    pub(crate) fn make_regular(&self, n: usize, x: &mut Mat<f64>) {
        self.constraints.project(n, x);
    }

    /// Q A Q x of a `product` A x, with the projections Q on motions of the order n that meet the constraints.
    fn constrained(&self, n: usize, x: MatRef<'_, f64>, product: impl Fn(MatRef<'_, f64>) -> Mat<f64>) -> Mat<f64> {
        if self.constraints.is_empty() {
            return product(x);
        }
        let mut regular = x.to_owned();
        self.constraints.project(n, &mut regular);
        let mut y = product(regular.as_ref());
        self.constraints.project(n, &mut y);
        y
    }

    /// `factor` times M x, without constraints.
    fn inertia(&self, x: MatRef<'_, f64>, factor: f64) -> Mat<f64> {
        by_columns(x, |x, y| {
            for (a, b, k) in self.pairs.iter() {
                let mass = factor * self.mass[k];
                (0..3).for_each(|c| add(&mut y[3 * a + c], mass, &x[3 * b + c]));
                if a != b {
                    (0..3).for_each(|c| add(&mut y[3 * b + c], mass, &x[3 * a + c]));
                }
            }
        })
    }

    /// A x of a symmetric matrix given by its blocks at the pairs.
    pub(super) fn product(&self, x: MatRef<'_, f64>, block: impl Fn(usize) -> NodeStiffness) -> Mat<f64> {
        by_columns(x, |x, y| {
            for (a, b, k) in self.pairs.iter() {
                let block = block(k);
                for c in 0..3 {
                    (0..3).for_each(|d| add(&mut y[3 * a + c], block[c][d], &x[3 * b + d]));
                }
                if a != b {
                    for d in 0..3 {
                        (0..3).for_each(|c| add(&mut y[3 * b + d], block[c][d], &x[3 * a + c]));
                    }
                }
            }
        })
    }
}

/// y += a x.
#[inline(always)]
fn add(y: &mut Row, a: f64, x: &Row) {
    (0..TOGETHER).for_each(|l| y[l] += a * x[l]);
}

/// The columns y that `product` adds to 0 from the columns x, `[order, k]`, some of them at a time.
fn by_columns(x: MatRef<'_, f64>, product: impl Fn(&[Row], &mut [Row])) -> Mat<f64> {
    let mut y = Mat::zeros(x.nrows(), x.ncols());
    let mut rows = vec![[0.0; TOGETHER]; x.nrows()];
    let mut out = rows.clone();
    for first in (0..x.ncols()).step_by(TOGETHER) {
        let width = TOGETHER.min(x.ncols() - first);
        for l in 0..TOGETHER {
            match l < width {
                true => rows.iter_mut().zip(x.col(first + l).iter()).for_each(|(row, v)| row[l] = *v),
                false => rows.iter_mut().for_each(|row| row[l] = 0.0),
            }
        }
        out.fill([0.0; TOGETHER]);
        product(&rows, &mut out);
        for l in 0..width {
            y.as_mut().col_mut(first + l).iter_mut().zip(&out).for_each(|(v, row)| *v = row[l]);
        }
    }
    y
}
