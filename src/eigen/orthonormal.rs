//! A block of columns made orthonormal in the mass, and orthogonal to a basis.

use super::block::{columns, combine, gram, subtract};
use super::Pencil;
use crate::parallel::World;
use faer::linalg::solvers::Llt;
use faer::{Mat, MatRef, Side};

/// A column that is shorter than this part of what it was before the basis was taken from it is rounding.
const NOISE: f64 = 1e-13;
/// Cholesky-QR is used while the pivots of the Gram matrix with unit diagonal are larger than this.
const PIVOT: f64 = 1e-5;
/// Times that a single column is freed of the basis at the most; two are enough for what is not rounding.
const PASSES: usize = 4;

/// A basis whose columns are orthonormal in the mass, in two parts that stay where they are.
pub(super) struct OrthonormalBlocks<'a> {
    /// Columns whose coefficients nobody asks for.
    pub deflated: MatRef<'a, f64>,
    /// Columns whose coefficients are counted.
    pub basis: MatRef<'a, f64>,
}

impl OrthonormalBlocks<'_> {
    /// Collective: w −= V Vᵀ M w for `p` columns with `mass` = M w; returns the coefficients in the basis.
    pub fn project_out(&self, world: &World, w: &mut [f64], mass: &[f64], p: usize) -> Mat<f64> {
        let mass = columns(mass, self.basis.nrows(), p);
        let deflated = gram(world, self.deflated, mass);
        let h = gram(world, self.basis, mass);
        subtract(w, self.deflated, deflated.as_ref());
        subtract(w, self.basis, h.as_ref());
        h
    }
}

/// An orthonormal block.
pub(super) struct Orthonormal {
    /// Number of its columns.
    pub rank: usize,
    /// The columns before, in the block: `[rank, columns before]`.
    pub factors: Mat<f64>,
    /// Coefficients of the projection that was subtracted from the columns before, in columns of the basis, `[basis,
    /// columns before]`.
    pub taken: Mat<f64>,
}

/// Collective: frees the columns of `w` of the basis, and replaces them by orthonormal ones that span the same;
/// `mass` becomes M times those. `sizes` are the lengths of the columns before anything was taken from them. Columns
/// that are nothing but rounding are left out.
pub(super) fn orthonormalise(
    pencil: &dyn Pencil,
    against: &OrthonormalBlocks,
    w: &mut Vec<f64>,
    mass: &mut Vec<f64>,
    sizes: &[f64],
) -> Orthonormal {
    let (world, n, p) = (pencil.world(), pencil.n_local(), sizes.len());
    mass.resize(n * p, 0.0);
    let mut taken = Mat::zeros(against.basis.ncols(), p);
    let mut inner = Mat::zeros(p, p);
    for _ in 0..2 {
        pencil.mass(w, mass, p);
        let h = against.project_out(world, w, mass, p);
        taken += &h;
        pencil.mass(w, mass, p);
        inner = gram(world, columns(w, n, p), columns(mass, n, p));
        // What is short beside what was just taken off is not orthogonal to working precision yet.
        let clean = |j: usize| h.col(j).norm_l2() <= 10.0 * inner[(j, j)].max(0.0).sqrt();
        if (0..p).all(clean) {
            break;
        }
    }
    let factors = match cholesky_qr(pencil, w, mass, &inner, sizes) {
        Some(factors) => factors,
        None => one_by_one(pencil, against, w, mass, &inner, sizes, &mut taken),
    };
    Orthonormal { rank: factors.nrows(), factors, taken }
}

/// Collective: W R⁻¹ twice, from Cholesky factors of the Gram matrix `inner`; `None` and nothing done where columns
/// are short beside `sizes` or nearly depend on each other. Returns R.
fn cholesky_qr(
    pencil: &dyn Pencil,
    w: &mut [f64],
    mass: &mut [f64],
    inner: &Mat<f64>,
    sizes: &[f64],
) -> Option<Mat<f64>> {
    let (n, p) = (pencil.n_local(), inner.nrows());
    let length: Vec<f64> = (0..p).map(|j| inner[(j, j)].max(0.0).sqrt()).collect();
    if !length.iter().zip(sizes).all(|(l, s)| *l > NOISE.sqrt() * s) {
        return None;
    }
    let scaled = Mat::from_fn(p, p, |i, j| inner[(i, j)] / (length[i] * length[j]));
    let factor = scaled.llt(Side::Lower).ok()?;
    if !(0..p).all(|j| factor.L()[(j, j)] > PIVOT.sqrt()) {
        return None;
    }
    let r = |l: &Llt<f64>| Mat::from_fn(p, p, |i, j| if i <= j { l.L()[(j, i)] } else { 0.0 });
    let mut first = r(&factor);
    for j in 0..p {
        (0..=j).for_each(|i| first[(i, j)] *= length[j]);
    }
    divide(w, mass, n, &first);
    let again = gram(pencil.world(), columns(w, n, p), columns(mass, n, p));
    let second = r(&again.llt(Side::Lower).ok()?);
    divide(w, mass, n, &second);
    Some(&second * &first)
}

/// W and M W times R⁻¹.
fn divide(w: &mut [f64], mass: &mut [f64], n: usize, r: &Mat<f64>) {
    let p = r.nrows();
    let mut inverse = Mat::<f64>::identity(p, p);
    faer::linalg::triangular_solve::solve_upper_triangular_in_place(r.as_ref(), inverse.as_mut(), faer::Par::Seq);
    combine(w, n, inverse.as_ref());
    combine(mass, n, inverse.as_ref());
}

/// Collective: Gram–Schmidt column by column, the longest first, which tells what is rounding. Returns the factors of
/// the columns kept.
fn one_by_one(
    pencil: &dyn Pencil,
    against: &OrthonormalBlocks,
    w: &mut Vec<f64>,
    mass: &mut Vec<f64>,
    inner: &Mat<f64>,
    sizes: &[f64],
    taken: &mut Mat<f64>,
) -> Mat<f64> {
    let (world, n, p) = (pencil.world(), pencil.n_local(), inner.nrows());
    let mut order: Vec<usize> = (0..p).collect();
    order.sort_by(|&a, &b| inner[(b, b)].total_cmp(&inner[(a, a)]));
    let (mut kept, mut kept_mass): (Vec<f64>, Vec<f64>) = (Vec::with_capacity(n * p), Vec::with_capacity(n * p));
    let mut factors = Mat::zeros(p, p);
    let mut rank = 0;
    for j in order {
        let noise = NOISE * sizes[j];
        let mut x = w[j * n..(j + 1) * n].to_vec();
        let mut mx = vec![0.0; n];
        pencil.mass(&x, &mut mx, 1);
        let mut length = gram(world, columns(&x, n, 1), columns(&mx, n, 1))[(0, 0)].max(0.0).sqrt();
        for _ in 0..PASSES {
            let among = gram(world, columns(&kept, n, rank), columns(&mx, n, 1));
            subtract(&mut x, columns(&kept, n, rank), among.as_ref());
            (0..rank).for_each(|i| factors[(i, j)] += among[(i, 0)]);
            let h = against.project_out(world, &mut x, &mx, 1);
            (0..h.nrows()).for_each(|i| taken[(i, j)] += h[(i, 0)]);
            pencil.mass(&x, &mut mx, 1);
            let before = length;
            length = gram(world, columns(&x, n, 1), columns(&mx, n, 1))[(0, 0)].max(0.0).sqrt();
            if length <= noise || length > 0.5 * before {
                break;
            }
        }
        if length > noise {
            factors[(rank, j)] = length;
            kept.extend(x.iter().map(|v| v / length));
            kept_mass.extend(mx.iter().map(|v| v / length));
            rank += 1;
        }
    }
    (*w, *mass) = (kept, kept_mass);
    factors.subrows(0, rank).to_owned()
}
