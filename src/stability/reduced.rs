//! Stability of steady sliding on the reduced model: free-interface modes of both bodies, their residual compliance,
//! and the linearised contact, as one dense eigenproblem.
//!
//! With y = (w, change of gap) on the interface, the modes of both bodies give y = Ψ q + S R, q̈ + c q̇ + Ω² q = Ψᵀ R,
//! Ψ = [Φ1, E Φ2], S = C1 + E C2 E − Ψ Ω⁻² Ψᵀ, E = diag(−1, −1, 1) at each node. About steady sliding the closed
//! nodes keep y_n = 0 and the tractions change by δt = B f − μ τ r with the directions B across (and, where μ′ ≠ 0,
//! along) the sliding, or both where a node sticks, and C f + Bᵀ(λ + V ∂x) w = 0 with C = diag(|ṡ0|/μp0, 1/μ′p0), or
//! 0 ([`crate::contact::Tangent`]). Where friction falls with the velocity and the material remembers it, f also
//! holds the changes of the coefficients of friction, whose rows are (λ + C) f + Bᵀ(λ + V ∂x) w = 0 with C coupling
//! each node to the one upstream ([`crate::contact::LinearMemory`]). The pressures are eliminated, r = −(S_nn − S_nt
//! μτ)⁻¹ (Ψ_n q + S_nt B f), and with v = λq there remains the pencil
//!
//! λ q = v,   λ v = −c v − (Ω² − G_q) q + G_f f,   λ A f = −(C + V X_f) f − V X_q q − A_q v,
//!
//! G: the modal forces, A, A_q: Bᵀw, and X: Bᵀ∂x w, as functions of q and f. Time is scaled by a mean frequency and f
//! so that the modal forces it makes are of the size of the stiffness. A is singular where the tangential residual
//! vanishes; the pencil is therefore solved by one real shift and inversion.

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};
use num_complex::Complex;

use super::rightmost;
use crate::contact::{LinearContact, LinearNode};
use crate::model::CoupledModel;
use crate::{Error, Result};

/// One eigenvalue of the linearised system with its mode.
#[derive(Debug, Clone)]
pub struct Eigenpair {
    /// λ = σ + iω, 1/s: growth rate and angular frequency.
    pub value: Complex<f64>,
    /// Modal amplitudes q of both bodies, `[m1 + m2]`, scaled to Euclidean norm 1 (of (q, v/ω_ref, f)).
    pub modal: Vec<Complex<f64>>,
    /// The unknowns f of the contact that go with them, N: forces at each closed node across the sliding where
    /// friction resists it, then along it where the law has a slope; after these the changes of the coefficients of
    /// friction times the largest normal force of a node.
    pub tangential: Vec<Complex<f64>>,
    /// Normwise backward error of (λ, x) in the scaled pencil.
    pub backward_error: f64,
}

impl Eigenpair {
    /// Frequency |ω|/2π, Hz.
    pub fn frequency(&self) -> f64 {
        self.value.im.abs() / (2.0 * std::f64::consts::PI)
    }

    /// Growth rate σ, 1/s; the sliding is unstable if positive.
    pub fn growth_rate(&self) -> f64 {
        self.value.re
    }

    /// Damping ratio −σ/|λ|.
    pub fn damping_ratio(&self) -> f64 {
        -self.value.re / self.value.norm().max(f64::MIN_POSITIVE)
    }
}

/// The pencil (A − λE) x = 0 in scaled variables x = (q, v, f).
pub(super) struct Pencil {
    pub a: Mat<f64>,
    pub e: Mat<f64>,
    pub scales: Scales,
    /// Number of f where the rows are, in this order, λq = v, the modes', and the contact's, in which E has f alone;
    /// none of a pencil of another build, such as a transposed one.
    pub parts: Option<usize>,
}

/// Units of a [`Pencil`].
#[derive(Clone)]
pub(super) struct Scales {
    /// Unit of time is 1/`rate`, rad/s.
    pub rate: f64,
    /// Unit of the tangential forces, N.
    pub force: f64,
    /// Divisors of the rows of the unknowns f.
    pub rows: Vec<f64>,
}

/// An eigenvalue of a [`Pencil`] in its own unit, Im λ ≥ 0, with its right vector of Euclidean norm 1.
pub(super) struct Root {
    pub value: Complex<f64>,
    pub vector: Vec<Complex<f64>>,
    pub backward_error: f64,
}

/// All finite eigenvalues of steady sliding, both of each conjugate pair, by falling growth rate. Each pair's backward
/// error is at most `tolerance`, or the result is an error.
pub fn eigenpairs(bodies: &CoupledModel, contact: &LinearContact, tolerance: f64) -> Result<Vec<Eigenpair>> {
    let pencil = assemble(bodies, contact, None)?;
    let m = bodies.omega.len();
    let mut pairs = Vec::new();
    for Root { value, vector, backward_error } in pencil.roots(tolerance)? {
        let modal = vector[..m].to_vec();
        let tangential: Vec<Complex<f64>> = vector[2 * m..].iter().map(|x| x * pencil.scales.force).collect();
        let value = value * pencil.scales.rate;
        if value.im != 0.0 {
            let conjugate = |v: &[Complex<f64>]| v.iter().map(|q| q.conj()).collect();
            let (modal, tangential) = (conjugate(&modal), conjugate(&tangential));
            pairs.push(Eigenpair { value: value.conj(), modal, tangential, backward_error });
        }
        pairs.push(Eigenpair { value, modal, tangential, backward_error });
    }
    pairs.sort_by(|a, b| b.value.re.total_cmp(&a.value.re).then(b.value.im.total_cmp(&a.value.im)));
    Ok(pairs)
}

impl Pencil {
    /// Pencil of two matrices, each scaled.
    pub fn of(a: Mat<f64>, e: Mat<f64>) -> Self {
        Self { a, e, scales: Scales { rate: 1.0, force: 1.0, rows: Vec::new() }, parts: None }
    }

    /// All finite eigenvalues, one of each conjugate pair.
    pub fn roots(&self, tolerance: f64) -> Result<Vec<Root>> {
        let n = self.a.nrows();
        let eigen = self.inverted()?.eigen().map_err(failed)?;
        let theta: Vec<Complex<f64>> = eigen.S().column_vector().iter().copied().collect();
        let norms = (self.a.norm_l2(), self.e.norm_l2());
        let (wanted, values): (Vec<usize>, Vec<Complex<f64>>) = finite(&theta).unzip();
        let vectors = Mat::from_fn(n, wanted.len(), |i, j| eigen.U()[(i, wanted[j])]);
        let mut roots = Vec::new();
        for ((lambda, residual), x) in values.iter().zip(self.residuals(&values, &vectors)).zip(vectors.col_iter()) {
            let norm = x.norm_l2();
            let mut vector: Vec<Complex<f64>> = x.iter().map(|x| x / norm).collect();
            let mut backward_error = residual / ((norms.0 + lambda.norm() * norms.1) * norm);
            if backward_error > tolerance {
                // Of eigenvalues that are equal, as those of mirror images, the vectors come out mixed with others.
                let start = Mat::from_fn(n, 1, |i, _| vector[i]);
                (vector, backward_error) = rightmost::vector(self, *lambda, start);
            }
            if backward_error > tolerance || backward_error.is_nan() {
                return Err(Error::NotConverged(format!(
                    "reduced stability: the eigenvalue {:.6e} {:+.6e}i 1/s has a backward error of \
                     {backward_error:.1e}, \
                     {tolerance:.1e} was asked for",
                    lambda.re * self.scales.rate,
                    lambda.im * self.scales.rate
                )));
            }
            vector.iter_mut().for_each(|x| *x = x.conj());
            roots.push(Root { value: lambda.conj(), vector, backward_error });
        }
        Ok(roots)
    }

    /// All finite eigenvalues alone, with Im λ ≥ 0, one of each conjugate pair.
    pub fn values(&self) -> Result<Vec<Complex<f64>>> {
        let theta = self.inverted()?.eigenvalues().map_err(failed)?;
        let values = finite(&theta).map(|(_, value)| value.conj()).collect();
        Ok(values)
    }

    /// (A − shift E)⁻¹ E.
    fn inverted(&self) -> Result<Mat<f64>> {
        let inverted = match self.parts {
            None => (&self.a - faer::Scale(SHIFT) * &self.e).partial_piv_lu().solve(&self.e),
            Some(nf) => self.without_velocities(nf),
        };
        match (0..self.a.nrows()).all(|i| inverted[(i, i)].is_finite()) {
            true => Ok(inverted),
            false => {
                Err(Error::NotConverged("reduced stability: the linearised system is singular at the shift".into()))
            }
        }
    }

    /// The same of a pencil of modes and `nf` unknowns of the contact: v = shift q + (the right-hand side for q) is
    /// put into the other rows.
    fn without_velocities(&self, nf: usize) -> Mat<f64> {
        let n = self.a.nrows();
        let m = (n - nf) / 2;
        let (a, e) = (self.a.as_ref().subrows(m, m + nf), self.e.as_ref().submatrix(2 * m, 2 * m, nf, nf));
        let mut rates = a.subcols(m, m).to_owned();
        (0..m).for_each(|i| rates[(i, i)] -= SHIFT);
        let mut matrix = Mat::<f64>::zeros(m + nf, m + nf);
        matrix.as_mut().subcols_mut(0, m).copy_from(a.subcols(0, m) + faer::Scale(SHIFT) * &rates);
        matrix.as_mut().subcols_mut(m, nf).copy_from(a.subcols(2 * m, nf));
        let mut own = matrix.as_mut().submatrix_mut(m, m, nf, nf);
        own -= faer::Scale(SHIFT) * e;
        let mut right = Mat::<f64>::zeros(m + nf, n);
        right.as_mut().subcols_mut(0, m).copy_from(-&rates);
        (0..m).for_each(|i| right[(i, m + i)] = 1.0);
        right.as_mut().submatrix_mut(m, 2 * m, nf, nf).copy_from(e);
        matrix.partial_piv_lu().solve_in_place(&mut right);
        let mut whole = Mat::<f64>::zeros(n, n);
        whole.as_mut().subrows_mut(0, m).copy_from(right.as_ref().subrows(0, m));
        whole.as_mut().subrows_mut(m, m).copy_from(faer::Scale(SHIFT) * right.as_ref().subrows(0, m));
        (0..m).for_each(|i| whole[(m + i, i)] += 1.0);
        whole.as_mut().subrows_mut(2 * m, nf).copy_from(right.as_ref().subrows(m, nf));
        whole
    }

    /// ‖(A − λE) x‖ of each pair of `values` and columns of `vectors`.
    pub fn residuals(&self, values: &[Complex<f64>], vectors: &Mat<Complex<f64>>) -> Vec<f64> {
        let n = self.a.nrows();
        let Some(nf) = self.parts else {
            return images([&self.a, &self.e], values, vectors).col_iter().map(|c| c.norm_l2()).collect();
        };
        let m = (n - nf) / 2;
        // q and v are tied by λq = v alone, and E is 1 but in the rows of the contact: these have no part of q and v
        // in it.
        let (low, storing) = (self.a.as_ref().subrows(m, m + nf), self.e.as_ref().submatrix(2 * m, 2 * m, nf, nf));
        let part = |of: fn(&Complex<f64>) -> f64, first: usize| {
            Mat::from_fn(n - first, vectors.ncols(), |i, j| of(&vectors[(first + i, j)]))
        };
        let [low_re, low_im] = [part(|v| v.re, 0), part(|v| v.im, 0)].map(|x| low * x);
        let [e_re, e_im] = [part(|v| v.re, 2 * m), part(|v| v.im, 2 * m)].map(|x| storing * x);
        let of = |(j, value): (usize, &Complex<f64>)| {
            let x = |i: usize| vectors[(i, j)];
            let tied: f64 = (0..m).map(|i| (x(m + i) - value * x(i)).norm_sqr()).sum();
            let image = |i: usize| Complex::new(low_re[(i, j)], low_im[(i, j)]);
            let moved: f64 = (0..m).map(|i| (image(i) - value * x(m + i)).norm_sqr()).sum();
            let rows = (0..nf).map(|i| image(m + i) - value * Complex::new(e_re[(i, j)], e_im[(i, j)]));
            (tied + moved + rows.map(|v| v.norm_sqr()).sum::<f64>()).sqrt()
        };
        values.iter().enumerate().map(of).collect()
    }

    /// The vector x of an eigenpair of it.
    pub fn vector(&self, pair: &Eigenpair) -> Vec<Complex<f64>> {
        let Scales { rate, force, .. } = self.scales;
        let velocity = pair.modal.iter().map(|q| q * (pair.value / rate));
        pair.modal.iter().copied().chain(velocity).chain(pair.tangential.iter().map(|f| f / force)).collect()
    }
}

/// A real shift beside the origin of the right half-plane; an eigenvalue there would be static divergence at just
/// this rate, which the backward error would show.
const SHIFT: f64 = 0.7390851332151607;

fn failed(e: impl std::fmt::Debug) -> Error {
    Error::NotConverged(format!("reduced stability: dense eigenvalues failed: {e:?}"))
}

/// The finite eigenvalues of a pencil, with their places among those, `theta`, of the inverted one: those of a
/// singular E are left out. The matrices are real: of a conjugate pair one says all, here that with Im λ ≤ 0.
fn finite(theta: &[Complex<f64>]) -> impl Iterator<Item = (usize, Complex<f64>)> + '_ {
    let largest = theta.iter().map(|t| t.norm()).fold(0.0, f64::max);
    let kept = move |t: &Complex<f64>| t.im >= 0.0 && t.norm() > 1e-13 * largest;
    theta.iter().enumerate().filter(move |(_, t)| kept(t)).map(|(k, t)| (k, SHIFT + t.inv()))
}

/// (A − λE) x of each pair of `values` and columns of `vectors`, for real matrices [A, E].
pub(super) fn images(
    [a, e]: [&Mat<f64>; 2],
    values: &[Complex<f64>],
    vectors: &Mat<Complex<f64>>,
) -> Mat<Complex<f64>> {
    // Four real products of matrices are much faster than a complex one vector by vector.
    let part =
        |of: fn(&Complex<f64>) -> f64| Mat::from_fn(vectors.nrows(), vectors.ncols(), |i, j| of(&vectors[(i, j)]));
    let (re, im) = (part(|v| v.re), part(|v| v.im));
    let (a_re, a_im, e_re, e_im) = (a * &re, a * &im, e * &re, e * &im);
    Mat::from_fn(vectors.nrows(), vectors.ncols(), |i, j| {
        Complex::new(a_re[(i, j)], a_im[(i, j)]) - values[j] * Complex::new(e_re[(i, j)], e_im[(i, j)])
    })
}

/// An unknown f of a closed node, N: λ s f + c f − c′ f′ + b·(λ + V ∂x) w = 0, f′ being that of the node upstream.
struct Yielding {
    /// Index of the closed node.
    at: usize,
    /// Traction per f.
    along: [f64; 2],
    /// b; for a force the same.
    creep: [f64; 2],
    /// s, 1 for what has a memory, else 0.
    storage: f64,
    /// c, m/(N·s) or 1/s.
    coefficient: f64,
    /// Place of f′ and c′.
    upstream: Option<(usize, f64)>,
}

/// The unknowns of a contact: tangential forces, then coefficients of friction.
fn yielding(contact: &LinearContact) -> Vec<Yielding> {
    let of = |(at, n): (usize, &LinearNode)| {
        let force =
            |(along, coefficient)| Yielding { at, along, creep: along, storage: 0.0, coefficient, upstream: None };
        n.tangent.yielding().map(force).collect::<Vec<_>>()
    };
    let mut all: Vec<Yielding> = contact.nodes.iter().enumerate().flat_map(of).collect();
    let forces = all.len();
    let unit = match contact.memory.iter().map(|m| m.force).fold(0.0, f64::max) {
        0.0 => 1.0,
        largest => largest,
    };
    all.extend(contact.memory.iter().map(|m| Yielding {
        at: m.at,
        along: m.direction.map(|t| -m.force / unit * t),
        creep: m.direction.map(|t| -unit * m.relaxation.gain * t),
        storage: 1.0,
        coefficient: m.relaxation.decay,
        upstream: m.upstream.map(|u| (forces + u, m.relaxation.upstream)),
    }));
    all
}

/// Bodies as the contact reaches them: functions with the amplitudes of which they move at the contact rows, the modes
/// or others of which these consist, and what is left of the compliance.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    /// `[3n, m]`.
    pub modes: MatRef<'a, f64>,
    /// `[3n, 3n]`, m/N.
    pub residual: MatRef<'a, f64>,
}

impl<'a> From<&'a CoupledModel> for View<'a> {
    fn from(pair: &'a CoupledModel) -> Self {
        Self { modes: pair.modes.as_ref(), residual: pair.residual.as_ref() }
    }
}

/// Displacement at a row under the traction `t` and the pressure `p` at a node, m.
fn response(View { residual: s, .. }: View<'_>, row: usize, node: usize, t: [f64; 2], p: f64) -> f64 {
    t[0] * s[(row, 3 * node)] + t[1] * s[(row, 3 * node + 1)] + p * s[(row, 3 * node + 2)]
}

/// Pressures r of the closed nodes as a function of (q, f), `[k, m + nf]`.
fn pressures(bodies: View<'_>, contact: &LinearContact, unknowns: &[Yielding]) -> Result<Mat<f64>> {
    let (m, k, nf) = (bodies.modes.ncols(), contact.nodes.len(), unknowns.len());
    let View { residual: s, modes: psi } = bodies;
    let nodes = &contact.nodes;
    let mut s_np = Mat::from_fn(k, k, |i, j| {
        response(bodies, 3 * nodes[i].node + 2, nodes[j].node, nodes[j].tangent.friction(), 1.0)
    });
    // Where no body moves along the normal the normal force stays as it is: r = 0.
    for i in 0..k {
        let row = 3 * nodes[i].node + 2;
        if (0..m).all(|j| psi[(row, j)] == 0.0) && (0..s.ncols()).all(|j| s[(row, j)] == 0.0) {
            s_np[(i, i)] = 1.0;
        }
    }
    // r = −S_np⁻¹ (Ψ_n q + S_nf f): one right-hand side for q and f.
    let mut r = Mat::from_fn(k, m + nf, |i, j| {
        -if j < m {
            psi[(3 * nodes[i].node + 2, j)]
        } else {
            let f = &unknowns[j - m];
            response(bodies, 3 * nodes[i].node + 2, nodes[f.at].node, f.along, 0.0)
        }
    });
    s_np.partial_piv_lu().solve_in_place(&mut r);
    if r.col_iter().any(|c| c.iter().any(|v| !v.is_finite())) {
        return Err(Error::NotConverged(
            "reduced stability: the residual normal compliance is singular on the closed nodes; keep fewer modes"
                .into(),
        ));
    }
    Ok(r)
}

/// The reactions of the closed nodes that go with an eigenpair, N, rows (x, y, n), `[3k]`.
pub fn reactions(bodies: &CoupledModel, contact: &LinearContact, pair: &Eigenpair) -> Result<Vec<Complex<f64>>> {
    let unknowns = yielding(contact);
    let r = pressures(bodies.into(), contact, &unknowns)?;
    let mut forces = vec![Complex::default(); 3 * contact.nodes.len()];
    for (i, n) in contact.nodes.iter().enumerate() {
        let all = pair.modal.iter().chain(&pair.tangential);
        let p: Complex<f64> = all.enumerate().map(|(j, v)| r[(i, j)] * v).sum();
        let friction = n.tangent.friction();
        for q in 0..2 {
            forces[3 * i + q] = friction[q] * p;
        }
        forces[3 * i + 2] = p;
    }
    for (u, f) in unknowns.iter().zip(&pair.tangential) {
        forces[3 * u.at] += u.along[0] * f;
        forces[3 * u.at + 1] += u.along[1] * f;
    }
    Ok(forces)
}

/// y at rows as a function of (q, f), Ψ q + S(·, f) f + S(·, p) r, for a list of rows with coefficients for each
/// unknown, `[nf, m + nf]`; p stands for the pressure with its friction −μτ, and r = `pressures` gives the pressures.
fn rows_of(
    bodies: View<'_>,
    contact: &LinearContact,
    unknowns: &[Yielding],
    pressures: &Mat<f64>,
    list: &dyn Fn(&Yielding) -> Vec<(usize, f64)>,
) -> Mat<f64> {
    let (m, k, nf) = (bodies.modes.ncols(), contact.nodes.len(), unknowns.len());
    let (psi, nodes) = (bodies.modes, &contact.nodes);
    let lists: Vec<Vec<(usize, f64)>> = unknowns.iter().map(list).collect();
    let sum = |i: usize, f: &dyn Fn(usize) -> f64| lists[i].iter().map(|&(row, c)| c * f(row)).sum::<f64>();
    let direct = Mat::from_fn(nf, m + nf, |i, j| {
        sum(i, &|row| {
            if j < m {
                psi[(row, j)]
            } else {
                let f = &unknowns[j - m];
                response(bodies, row, nodes[f.at].node, f.along, 0.0)
            }
        })
    });
    let by_pressure = Mat::from_fn(nf, k, |i, j| {
        sum(i, &|row| response(bodies, row, nodes[j].node, nodes[j].tangent.friction(), 1.0))
    });
    direct + by_pressure * pressures
}

/// b·w of each unknown as a function of (q, f), `[nf, m + nf]`.
fn displacements(bodies: View<'_>, contact: &LinearContact, unknowns: &[Yielding], r: &Mat<f64>) -> Mat<f64> {
    rows_of(bodies, contact, unknowns, r, &|u| (0..2).map(|q| (3 * contact.nodes[u.at].node + q, u.creep[q])).collect())
}

/// How near the memory of the friction is to being too short: the largest factor by which the coefficients of
/// friction, when they change at once, change themselves through the residual compliance. Below 1 the contact is
/// well-posed; at 1 an eigenvalue goes through infinity, from −∞ to +∞; it goes with the inverse of the length of the
/// memory, so that this factor times the length is what a memory must be longer than. 0 without memory.
///
/// With λ → ∞ the nodes keep their place across the sliding, the closed ones keep their gap, and the modes their
/// motion: then δμ = diag(gain) Tᵀδw, Tᵀδw = −S_ττ diag(p) δμ.
pub fn sharpness(bodies: &CoupledModel, contact: &LinearContact) -> Result<f64> {
    if contact.memory.is_empty() {
        return Ok(0.0);
    }
    check(bodies, contact)?;
    let (m, unknowns) = (bodies.omega.len(), yielding(contact));
    let r = pressures(bodies.into(), contact, &unknowns)?;
    let w = displacements(bodies.into(), contact, &unknowns, &r);
    let place = |storage: f64| (0..unknowns.len()).filter(|&i| unknowns[i].storage == storage).collect::<Vec<_>>();
    // A direction without residual compliance has no part in it.
    let across: Vec<usize> = place(0.0).into_iter().filter(|&i| w[(i, m + i)] != 0.0).collect();
    let memory = place(1.0);
    let block = |rows: &[usize], columns: &[usize]| {
        Mat::from_fn(rows.len(), columns.len(), |i, j| w[(rows[i], m + columns[j])])
    };
    let mut feedback = block(&memory, &memory);
    if !across.is_empty() {
        let held = block(&across, &across).partial_piv_lu().solve(block(&across, &memory));
        feedback -= block(&memory, &across) * held;
    }
    let factors = feedback.eigenvalues().map_err(|e| {
        Error::NotConverged(format!("reduced stability: dense eigenvalues of the friction memory failed: {e:?}"))
    })?;
    let largest = factors.iter().map(|f| f.norm()).fold(0.0, f64::max);
    let real = factors.iter().filter(|f| f.im.abs() <= 1e-6 * largest);
    Ok(real.map(|f| -f.re).fold(0.0, f64::max))
}

/// How the contact ties amplitudes q and its own unknowns f together, each as a function of (q, f).
pub(super) struct Coupling {
    /// Forces on the amplitudes, `[m, m + nf]`.
    pub g: Mat<f64>,
    /// b·w of each unknown, `[nf, m + nf]`.
    pub w: Mat<f64>,
    /// b·V ∂w/∂x, `[nf, m + nf]`.
    pub x: Mat<f64>,
}

impl Coupling {
    /// System of the closed nodes of `contact` with these unknowns.
    fn new(bodies: View<'_>, contact: &LinearContact, unknowns: &[Yielding]) -> Result<Self> {
        let (m, k, nf) = (bodies.modes.ncols(), contact.nodes.len(), unknowns.len());
        let (psi, nodes) = (bodies.modes, &contact.nodes);
        let r = pressures(bodies, contact, unknowns)?;
        let w = displacements(bodies, contact, unknowns, &r);
        let x = rows_of(bodies, contact, unknowns, &r, &|u| {
            let terms = nodes[u.at].convection.iter();
            let carried = terms.flat_map(|&(j, v)| (0..2).map(move |q| (3 * j + q, v * u.creep[q])));
            let edges = contact.edges.iter().filter(|e| e.at == u.at).flat_map(|e| e.gaps);
            carried.chain(edges.map(|(j, d)| (3 * j + 2, d[0] * u.creep[0] + d[1] * u.creep[1]))).collect()
        });
        // Modal forces Ψᵀ R with R = f and (p, −μτ) r.
        let by_f = Mat::from_fn(m, nf, |i, j| {
            let (row, b) = (3 * nodes[unknowns[j].at].node, unknowns[j].along);
            b[0] * psi[(row, i)] + b[1] * psi[(row + 1, i)]
        });
        let by_p = Mat::from_fn(m, k, |i, j| {
            let (row, t) = (3 * nodes[j].node, nodes[j].tangent.friction());
            t[0] * psi[(row, i)] + t[1] * psi[(row + 1, i)] + psi[(row + 2, i)]
        });
        let mut g = by_p * &r;
        for j in 0..nf {
            for i in 0..m {
                g[(i, m + j)] += by_f[(i, j)];
            }
        }
        Ok(Self { g, w, x })
    }
}

/// The rows of the contact alone, (λ `by_rate` + `at_rest`) (q, f) = 0, `[nf, m + nf]` each, and the forces on the
/// amplitudes, `[m, m + nf]`.
pub(super) struct ContactRows {
    pub by_rate: Mat<f64>,
    pub at_rest: Mat<f64>,
    pub forces: Mat<f64>,
}

/// Contact rows of `contact` on bodies that move as `bodies` says.
pub(super) fn contact_rows(bodies: View<'_>, contact: &LinearContact) -> Result<ContactRows> {
    let (m, unknowns) = (bodies.modes.ncols(), yielding(contact));
    let Coupling { g: forces, w: mut by_rate, x: mut at_rest } = Coupling::new(bodies, contact, &unknowns)?;
    for (i, u) in unknowns.iter().enumerate() {
        by_rate[(i, m + i)] += u.storage;
        at_rest[(i, m + i)] += u.coefficient;
        if let Some((from, c)) = u.upstream {
            at_rest[(i, m + from)] -= c;
        }
    }
    Ok(ContactRows { by_rate, at_rest, forces })
}

/// The pencil of `contact`, in the units given or in its own.
pub(super) fn assemble(bodies: &CoupledModel, contact: &LinearContact, given: Option<&Scales>) -> Result<Pencil> {
    check(bodies, contact)?;
    let m = bodies.omega.len();
    let unknowns = yielding(contact);
    let nf = unknowns.len();

    let Coupling { g, w, x } = Coupling::new(bodies.into(), contact, &unknowns)?;
    let stiffness = Mat::from_fn(m, m, |i, j| bodies.stiffness.get(i, j) - g[(i, j)]);
    let own = || {
        let norm = stiffness.norm_l2() / (m.max(1) as f64).sqrt();
        let rate = if norm > 0.0 { norm.sqrt() } else { 1.0 };
        let reach = g.as_ref().subcols(m, nf).norm_l2() / (nf.max(1) as f64).sqrt();
        (rate, if reach > 0.0 { rate * rate / reach } else { 1.0 })
    };
    let (rate, force) = given.map_or_else(own, |s| (s.rate, s.force));

    let n = 2 * m + nf;
    let (mut a, mut e) = (Mat::<f64>::zeros(n, n), Mat::<f64>::zeros(n, n));
    for i in 0..m {
        a[(i, m + i)] = 1.0;
        e[(i, i)] = 1.0;
        e[(m + i, m + i)] = 1.0;
    }
    // Column by column, as they lie in memory.
    for j in 0..m {
        let low = &mut a.col_as_slice_mut(j)[m..];
        for i in 0..m {
            low[i] = -stiffness[(i, j)] / (rate * rate);
        }
        // λ (A_q q + A f + s f) + c f − c′ f′ + V X = 0 with λ q = v.
        for i in 0..nf {
            low[m + i] = -x[(i, j)];
        }
        let low = &mut a.col_as_slice_mut(m + j)[m..];
        for i in 0..m {
            low[i] = -bodies.damping.get(i, j) / rate;
        }
        for i in 0..nf {
            low[m + i] = -w[(i, j)] * rate;
        }
    }
    for j in 0..nf {
        let low = &mut a.col_as_slice_mut(2 * m + j)[m..];
        for i in 0..m {
            low[i] = g[(i, m + j)] * force / (rate * rate);
        }
        for i in 0..nf {
            low[m + i] = -x[(i, m + j)] * force;
        }
        let low = &mut e.col_as_slice_mut(2 * m + j)[2 * m..];
        for i in 0..nf {
            low[i] = w[(i, m + j)] * force * rate;
        }
    }
    for (i, unknown) in unknowns.iter().enumerate() {
        let row = 2 * m + i;
        a[(row, row)] -= force * unknown.coefficient;
        if let Some((from, c)) = unknown.upstream {
            a[(row, 2 * m + from)] += force * c;
        }
        e[(row, row)] += unknown.storage * force * rate;
    }
    // The rows of the contact are scaled to a largest entry of 1.
    let rows = match given.filter(|s| s.rows.len() == nf) {
        Some(scales) => scales.rows.clone(),
        None => largest([&a, &e], 2 * m),
    };
    for matrix in [&mut a, &mut e] {
        for j in 0..n {
            matrix.col_as_slice_mut(j)[2 * m..].iter_mut().zip(&rows).for_each(|(v, largest)| *v /= largest);
        }
    }
    // With a contact that is rigid but for rounding the elimination would spread the rounding.
    let parts = (!rigid(bodies, contact)).then_some(nf);
    Ok(Pencil { a, e, scales: Scales { rate, force, rows }, parts })
}

/// The largest entry of both matrices in each row from `first` on.
fn largest(matrices: [&Mat<f64>; 2], first: usize) -> Vec<f64> {
    let mut found = vec![0.0; matrices[0].nrows() - first];
    for matrix in matrices {
        for j in 0..matrix.ncols() {
            let column = &matrix.col_as_slice(j)[first..];
            found.iter_mut().zip(column).for_each(|(largest, v)| *largest = f64::max(*largest, v.abs()));
        }
    }
    found
}

/// A compliance that is left below this part of the whole one is rounding.
const ROUNDING: f64 = 1e-9;

/// Returns whether the modes are all of the compliance of a closed node along its normal.
fn rigid(bodies: &CoupledModel, contact: &LinearContact) -> bool {
    contact.nodes.iter().map(|c| 3 * c.node + 2).any(|k| {
        let (left, whole) = (bodies.residual[(k, k)].abs(), bodies.compliance[(k, k)]);
        whole > 0.0 && left <= ROUNDING * whole
    })
}

/// An error where there is nothing to examine, or the contact is not of these bodies.
pub(super) fn check(bodies: &CoupledModel, contact: &LinearContact) -> Result<()> {
    let k = contact.nodes.len();
    let n = bodies.modes.nrows() / 3;
    if k == 0 || bodies.omega.is_empty() {
        return Err(Error::Job(
            "analyses.stability: the contact is open or no modes are kept; stability needs a closed contact and modes"
                .into(),
        ));
    }
    let edges = contact.edges.iter().flat_map(|e| e.gaps.map(|g| g.0));
    let mut places =
        contact.nodes.iter().flat_map(|c| c.convection.iter().map(|&(j, _)| j).chain([c.node])).chain(edges);
    if let Some(i) = places.find(|&i| i >= n) {
        return Err(Error::Defect(format!("reduced stability: contact node {i} of an interface of {n}")));
    }
    Ok(())
}

/// Shares of the modes in an eigenvector, `[m1 + m2]`, as in [`shares`].
pub fn participation(bodies: &CoupledModel, pair: &Eigenpair) -> Vec<f64> {
    shares(&bodies.omega, &pair.modal, pair.value)
}

/// Shares of modes of angular frequencies `omega` in a motion with amplitudes `modal` and eigenvalue `value`: |q_k|²
/// ω_k² (elastic energy, or |λq_k|² where ω_k = 0), normalised to the sum 1.
pub fn shares(omega: &[f64], modal: &[Complex<f64>], value: Complex<f64>) -> Vec<f64> {
    let e: Vec<f64> =
        modal.iter().zip(omega).map(|(q, &w)| q.norm_sqr() * if w > 0.0 { w * w } else { value.norm_sqr() }).collect();
    let sum: f64 = e.iter().sum();
    e.iter().map(|v| if sum > 0.0 { v / sum } else { 0.0 }).collect()
}
