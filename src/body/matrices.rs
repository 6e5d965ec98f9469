//! A body given by its matrices instead of a mesh: M, C, K from files and the rows that touch the contacts.
//!
//! Small bodies are reduced densely, with their complete spectrum; large ones by the same distributed solvers as finite
//! elements. A body without supports has a singular K: everything is then taken from K − σM with a negative shift σ,
//! from which the kept modes are subtracted, so that rigid-body modes enter as modes and the rest as residual
//! compliance.

use super::clusters;
use super::matrix_market::Csr;
use super::modes::Extent;
use super::{Trace, TraceModes};
use crate::dense::symmetric_eigen;
use crate::eigen::sparse::{self, Method, ModesOptions};
use crate::parallel::World;
use crate::petsc::csr::{DistCsr, Stored};
use crate::petsc::mumps::{Factor, FactorOptions, Symmetry};
use crate::petsc::session::Petsc;
use crate::{Error, Result};
use faer::linalg::solvers::Llt;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, MatRef, Par, Side};

/// Bodies up to this order are treated densely.
pub const DENSE: usize = 800;
/// Largest |a_ij − a_ji| of M and K over their largest entry: rounding of printed figures.
pub(super) const ASYMMETRY: f64 = 1e-9;
/// Eigenvalues smaller than this part of the shift of a free body are its rigid-body motions.
const RIGID: f64 = 1e-6;
/// Pivots of the scaled stiffness below this mean rigid-body motions.
const SINGULAR: f64 = 1e-11;

/// A contact row: degrees of freedom (0-based) and coefficients whose sum of products is the displacement in one
/// direction of a contact; empty where the body does not move in that direction.
pub type ContactRow = Vec<(usize, f64)>;

/// M, C, K and the contact rows of a body, whole, on rank 0.
#[derive(Debug, Clone)]
pub struct BodyMatrices {
    /// Mass matrix, symmetric, positive semidefinite.
    pub mass: Csr,
    /// Damping matrix.
    pub damping: Option<Csr>,
    /// Stiffness matrix, symmetric, positive semidefinite.
    pub stiffness: Csr,
    /// Rows (x, y, n into the body) of each contact.
    pub contacts: Vec<[ContactRow; 3]>,
}

impl BodyMatrices {
    /// The contact rows as degrees of freedom and coefficients.
    pub fn rows(&self) -> Vec<Vec<(u64, f64)>> {
        let row = |row: &ContactRow| row.iter().map(|&(dof, c)| (dof as u64, c)).collect();
        self.contacts.iter().flatten().map(row).collect()
    }

    /// `[3k, columns]` values at the contact rows of a field of all degrees of freedom, `value(dof, column)`.
    fn at_contacts(&self, columns: usize, value: impl Fn(usize, usize) -> f64) -> Mat<f64> {
        Mat::from_fn(3 * self.contacts.len(), columns, |row, j| {
            self.contacts[row / 3][row % 3].iter().map(|&(dof, c)| c * value(dof, j)).sum()
        })
    }
}

/// Result of the reduction of matrices; on rank 0.
pub struct Reduced {
    /// The kept modes.
    pub modes: TraceModes,
    /// Static compliance of the contact rows without rigid-body motions, m/N, `[3k, 3k]`.
    pub compliance: Mat<f64>,
    /// The modes at all degrees of freedom, 1/√kg, `[n, m]`, of a body that is small enough to be treated densely.
    pub vectors: Option<Mat<f64>>,
}

/// Collective: modes, computed by `method` if the body is large, and compliance of the body `name`, whose matrices
/// rank 0 holds; the result is on rank 0.
pub fn reduce(
    petsc: &Petsc,
    name: &str,
    matrices: Option<&BodyMatrices>,
    extent: Extent,
    method: Method,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Option<Reduced>> {
    let world = petsc.world();
    let named = |e: Error| e.context(format!("bodies.{name}.matrices"));
    let order = world.broadcast(vec![matrices.map_or(0, |m| m.stiffness.n as u64)])[0] as usize;
    if order <= DENSE {
        return world.on_root(|| match matrices {
            Some(m) => dense(m, extent).map_err(named),
            None => Err(Error::Defect("no matrices on rank 0".into())),
        });
    }
    sparse(petsc, name, matrices, extent, method, progress).map_err(named)
}

/// A negative shift of the scale of the mean eigenvalue.
fn mean_shift(m: &BodyMatrices) -> f64 {
    let trace = |a: &Csr| (0..a.n).map(|i| a.get(i, i)).sum::<f64>();
    let massive = (0..m.mass.n).filter(|&i| m.mass.get(i, i) > 0.0);
    let stiffness: f64 = massive.map(|i| m.stiffness.get(i, i)).sum();
    -1e-4 * stiffness / trace(&m.mass)
}

/// Returns whether K has rigid-body motions, from the pivots of its Cholesky factor after scaling to a unit diagonal.
fn singular(k: &Mat<f64>) -> bool {
    let n = k.nrows();
    if (0..n).any(|i| k[(i, i)] <= 0.0) {
        return true;
    }
    let scaled = Mat::from_fn(n, n, |i, j| k[(i, j)] / (k[(i, i)] * k[(j, j)]).sqrt());
    match scaled.llt(Side::Lower) {
        Ok(factor) => (0..n).any(|i| factor.L()[(i, i)].powi(2) < SINGULAR),
        Err(_) => true,
    }
}

/// How many of the ascending `omega` to keep.
fn keep(omega: &[f64], extent: Extent) -> Result<usize> {
    match extent {
        Extent::Count(n) if n > omega.len() => Err(Error::Job(format!(
            "analyses.modes.count: {n} modes are asked for, but the body has only {} of finite frequency",
            omega.len()
        ))),
        Extent::Count(n) => Ok(clusters::cut(omega, n).unwrap_or(omega.len())),
        Extent::MaxFrequency(f) => Ok(omega.partition_point(|w| *w <= 2.0 * std::f64::consts::PI * f)),
    }
}

/// All eigenpairs of finite frequency of K φ = ω² M φ and the compliance, densely.
fn dense(m: &BodyMatrices, extent: Extent) -> Result<Reduced> {
    let n = m.stiffness.n;
    let full = |a: &Csr| Mat::from_fn(n, n, |i, j| a.get(i, j));
    let (k, mass) = (full(&m.stiffness), full(&m.mass));
    let shift = if singular(&k) { mean_shift(m) } else { 0.0 };
    let shifted = &k - faer::Scale(shift) * &mass;
    let factor: Llt<f64> = shifted.llt(Side::Lower).map_err(|_| {
        Error::Input("the stiffness has negative eigenvalues, or a motion has neither stiffness nor mass".into())
    })?;
    let l = factor.L();
    // B = L⁻¹ M L⁻ᵀ has the eigenvalues 1/(ω² − σ), 0 for massless motions.
    let mut b = mass.clone();
    solve_lower_triangular_in_place(l, b.as_mut(), Par::Seq);
    let mut b = b.transpose().to_owned();
    solve_lower_triangular_in_place(l, b.as_mut(), Par::Seq);
    let failed = || Error::NotConverged("dense eigenvalues of the body".into());
    let (values, eigenvectors) = symmetric_eigen(b.as_ref()).ok_or_else(failed)?;
    let theta: Vec<f64> = values.into_iter().rev().collect();
    let largest = theta.first().copied().unwrap_or(0.0);
    let finite = theta.iter().take_while(|&&t| t > 1e-13 * largest).count();
    let mut vectors = Mat::from_fn(n, finite, |i, j| eigenvectors[(i, n - 1 - j)] / theta[j].sqrt());
    solve_upper_triangular_in_place(l.transpose(), vectors.as_mut(), Par::Seq);
    let squares: Vec<f64> = theta[..finite].iter().map(|t| shift + 1.0 / t).collect();
    let omega = frequencies(&squares, shift)?;
    let kept = keep(&omega, extent)?;

    let modes = m.at_contacts(finite, |dof, j| vectors[(dof, j)]);
    // (K − σM)⁻¹ Pᵀ at the contact rows.
    let mut columns = Mat::zeros(n, 3 * m.contacts.len());
    for (row, terms) in m.contacts.iter().flatten().enumerate() {
        for &(dof, c) in terms {
            columns[(dof, row)] += c;
        }
    }
    solve_lower_triangular_in_place(l, columns.as_mut(), Par::Seq);
    let whole = columns.transpose() * &columns;
    // Without all modes of finite frequency what is left is massless; the modes beyond the kept ones come back
    // statically.
    let compliance = recombine(whole, &modes, &squares, &omega, shift);
    let modal = m.damping.as_ref().map(|c| {
        let phi = vectors.subcols(0, kept);
        phi.transpose() * (full(c) * phi)
    });
    let modes = kept_modes(&omega, kept, modes.as_ref(), modal, kept == finite);
    Ok(Reduced { modes, compliance, vectors: Some(vectors.subcols(0, kept).to_owned()) })
}

/// Angular frequencies of the eigenvalues `squares`: 0 for rigid-body motions, an error below.
fn frequencies(squares: &[f64], shift: f64) -> Result<Vec<f64>> {
    let rigid = RIGID * shift.abs();
    squares
        .iter()
        .map(|&s| match s {
            s if s.abs() <= rigid => Ok(0.0),
            s if s > 0.0 => Ok(s.sqrt()),
            s => Err(Error::Input(format!("the stiffness has a negative eigenvalue, ω² = {s:.3e} 1/s²"))),
        })
        .collect()
}

/// From (K − σM)⁻¹ at the contact rows to the static compliance without rigid-body motions: every known mode is
/// exchanged from 1/(ω² − σ) to 1/ω².
fn recombine(mut whole: Mat<f64>, modes: &Mat<f64>, squares: &[f64], omega: &[f64], shift: f64) -> Mat<f64> {
    if shift == 0.0 {
        return whole;
    }
    for (k, (&s, &w)) in squares.iter().zip(omega).enumerate() {
        let change = (if w > 0.0 { 1.0 / (w * w) } else { 0.0 }) - 1.0 / (s - shift);
        for j in 0..whole.ncols() {
            for i in 0..whole.nrows() {
                whole[(i, j)] += change * modes[(i, k)] * modes[(j, k)];
            }
        }
    }
    whole
}

/// The first `kept` of the modes of angular frequencies `omega` that are `rows` at the contact rows; `complete` if
/// these are all there are.
fn kept_modes(
    omega: &[f64],
    kept: usize,
    rows: MatRef<'_, f64>,
    damping: Option<Mat<f64>>,
    complete: bool,
) -> TraceModes {
    let omega = omega[..kept].to_vec();
    let reach = if complete { f64::INFINITY } else { omega.last().copied().unwrap_or(0.0) };
    TraceModes {
        rows: Some(rows.subcols(0, kept).to_owned()),
        residual: Vec::new(),
        damping,
        reach,
        omega,
        ..TraceModes::default()
    }
}

/// Collective: the lowest modes and the compliance by distributed factorisations.
fn sparse(
    petsc: &Petsc,
    name: &str,
    matrices: Option<&BodyMatrices>,
    extent: Extent,
    method: Method,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Option<Reduced>> {
    let world = petsc.world();
    let Extent::Count(count) = extent else {
        return Err(Error::Job(
            "analyses.modes.max_frequency: a body given by large matrices takes analyses.modes.count".into(),
        ));
    };
    let k = scatter(world, matrices.map(|m| &m.stiffness));
    let m = scatter(world, matrices.map(|m| &m.mass));
    let factor_of = |shift: f64| -> Result<Factor<'_>> {
        Factor::new(
            world,
            &k.minus_scaled(shift, &m),
            FactorOptions::new(Symmetry::Positive),
            &format!("K of body {name}"),
        )
    };
    let mut shift = 0.0;
    let mut factor = match factor_of(0.0) {
        Ok(factor) => factor,
        // Rigid-body motions; anything else that is wrong comes up again with the shift.
        Err(Error::NotConverged(_)) => {
            shift = world.broadcast(vec![matrices.map_or(0.0, mean_shift)])[0];
            factor_of(shift)?
        }
        Err(e) => return Err(e),
    };
    let pencil = sparse::DistributedMatrices::new(world, &k, &m);
    let mut wanted = (count + 3).min(k.order() as usize);
    let found = loop {
        let options = ModesOptions { sigma: shift, count: wanted, method, prefix: format!("{name}_") };
        let found = sparse::modes(petsc, &mut factor, &pencil, &options, progress)?;
        let omega = frequencies(&found.lambda, shift)?;
        if clusters::cut(&omega, count).is_none() && omega.len() < k.order() as usize {
            wanted = (omega.len() + omega.len() / 4 + 3).min(k.order() as usize);
            continue;
        }
        // A shift well below the first elastic frequency: the residual compliance is taken at the shift.
        let elastic = omega.iter().copied().find(|w| *w > 0.0).unwrap_or(0.0);
        let near = -0.01 * elastic * elastic;
        if shift >= near || elastic == 0.0 {
            break found;
        }
        shift = near;
        factor = factor_of(shift)?;
    };
    let omega = frequencies(&found.lambda, shift)?;
    let kept = keep(&omega, extent)?;

    let given = matrices.map(BodyMatrices::rows);
    let trace = Trace::new(world, &k.ranges, given.as_deref())?;
    let rows = trace.dofs();
    let at_shift = factor.inverse_block(&rows)?;
    // The residual of the modes left out is wanted at σ = 0: two shifts and a straight line through them.
    let twice = if shift == 0.0 { None } else { Some(factor_of(2.0 * shift)?.inverse_block(&rows)?) };
    let modes = trace.gather(world, omega.len(), |j| &found.vectors[j]);
    // Whole vectors only for a damping matrix, which is on rank 0.
    let damped = world.broadcast(vec![u8::from(matrices.is_some_and(|m| m.damping.is_some()))]) == [1];
    let whole: Vec<Vec<f64>> = match damped {
        true => found.vectors[..kept].iter().map(|v| world.gather(v)).collect(),
        false => Vec::new(),
    };
    let modal = matrices.and_then(|m| m.damping.as_ref());
    let modal = modal.map(|c| Mat::from_fn(kept, kept, |i, j| bilinear(c, &whole[i], &whole[j])));
    let Some(modes) = modes else { return Ok(None) };
    let compliance = match twice {
        None => trace.enclose(at_shift.as_ref()),
        Some(twice) => {
            let one = recombine(trace.enclose(at_shift.as_ref()), &modes, &found.lambda, &omega, shift);
            let two = recombine(trace.enclose(twice.as_ref()), &modes, &found.lambda, &omega, 2.0 * shift);
            faer::Scale(2.0) * one - two
        }
    };
    let modes = kept_modes(&omega, kept, modes.as_ref(), modal, false);
    Ok(Some(Reduced { modes, compliance, vectors: None }))
}

/// xᵀ C y.
fn bilinear(c: &Csr, x: &[f64], y: &[f64]) -> f64 {
    let row = |i: usize| {
        let (cols, values) = c.row(i);
        cols.iter().zip(values).map(|(&j, v)| v * y[j as usize]).sum::<f64>()
    };
    (0..c.n).map(|i| x[i] * row(i)).sum()
}

/// Collective: the matrix of rank 0 in contiguous rows over the ranks.
pub(super) fn scatter(world: &World, matrix: Option<&Csr>) -> DistCsr {
    let n = world.broadcast(vec![matrix.map_or(0, |m| m.n as u64)])[0];
    let ranges: Vec<u64> = (0..=world.size as u64).map(|r| r * n / world.size as u64).collect();
    // Row starts, columns and values of each rank.
    let (mut starts, mut cols, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for rank in ranges.windows(2) {
        let Some(m) = matrix else { break };
        let rows = rank[0] as usize..rank[1] as usize;
        let entries = m.indptr[rows.start]..m.indptr[rows.end];
        starts.push(m.indptr[rows.start..=rows.end].iter().map(|&p| (p - entries.start) as u64).collect::<Vec<u64>>());
        cols.push(m.cols[entries.clone()].iter().map(|&c| c as u32).collect::<Vec<u32>>());
        values.push(m.values[entries].to_vec());
    }
    let starts = world.scatter(starts);
    let (cols, values) = (world.scatter(cols), world.scatter(values));
    let indptr = starts.into_iter().map(|s| s as usize).collect();
    DistCsr { ranges, indptr, cols, values, stored: Stored::Whole }
}
