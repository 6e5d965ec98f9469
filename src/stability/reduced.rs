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
//! If the lower body turns under an upper one that does not, V ∂x w is Ω(D′ u + e × v) of their modes
//! ([`CoupledModel::carried`]).
//!
//! G: the modal forces, A, A_q: Bᵀw, and X: Bᵀ∂x w, as functions of q and f. Time is scaled by a mean frequency and f
//! so that the modal forces it makes are of the size of the stiffness. A is singular where the tangential residual
//! vanishes; the pencil is therefore solved by one real shift and inversion.

use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex;

use crate::contact::{LinearContact, LinearNode};
use crate::model::CoupledModel;
use crate::{Error, Result};

mod pencil;
#[cfg(test)]
mod tests;

pub(super) use pencil::{images, Root, ScaledPencil, Scales};

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
pub(super) struct BodyView<'a> {
    /// `[3n, m]`.
    pub modes: &'a Mat<f64>,
    /// `[3n, 3n]`, m/N.
    pub residual: &'a Mat<f64>,
    /// Rates at which a body that turns under the other one carries these functions, `[3n, m]`.
    pub carried: Option<&'a Mat<f64>>,
}

impl<'a> From<&'a CoupledModel> for BodyView<'a> {
    fn from(pair: &'a CoupledModel) -> Self {
        Self { modes: &pair.modes, residual: &pair.residual, carried: pair.carried.as_ref() }
    }
}

/// Displacements at the rows that a contact asks for, under its unknowns and its pressures.
struct Responses<'a> {
    bodies: BodyView<'a>,
    /// Place of each contact row among those asked for, `[3n]`.
    place: Vec<usize>,
    /// Per unknown, `[rows, nf]`.
    by_force: Mat<f64>,
    /// Per pressure of a closed node with its friction, m/N, `[rows, k]`.
    by_pressure: Mat<f64>,
}

impl<'a> Responses<'a> {
    fn new(bodies: BodyView<'a>, contact: &LinearContact, unknowns: &[Yielding]) -> Self {
        let (s, nodes) = (bodies.residual, &contact.nodes);
        let rows: Vec<usize> = contact.places().into_iter().flat_map(|i| 3 * i..3 * i + 3).collect();
        let mut place = vec![usize::MAX; s.nrows()];
        rows.iter().enumerate().for_each(|(k, &row)| place[row] = k);
        let (mut by_force, mut by_pressure) =
            (Mat::zeros(rows.len(), unknowns.len()), Mat::zeros(rows.len(), nodes.len()));
        let mut at_node: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
        unknowns.iter().enumerate().for_each(|(j, f)| at_node[f.at].push(j));
        // Column by column, as they lie in memory, and each of them once.
        let mut asked = vec![0.0; rows.len()];
        for (j, n) in nodes.iter().enumerate() {
            let [x, y] = n.tangent.friction();
            for (c, by_pressures) in [x, y, 1.0].into_iter().enumerate() {
                let column = s.col_as_slice(3 * n.node + c);
                asked.iter_mut().zip(&rows).for_each(|(a, &row)| *a = column[row]);
                let add = |out: &mut [f64], factor: f64| {
                    if factor != 0.0 {
                        out.iter_mut().zip(&asked).for_each(|(o, a)| *o += factor * a);
                    }
                };
                add(by_pressure.col_as_slice_mut(j), by_pressures);
                for &k in at_node[j].iter().filter(|_| c < 2) {
                    add(by_force.col_as_slice_mut(k), unknowns[k].along[c]);
                }
            }
        }
        Self { bodies, place, by_force, by_pressure }
    }
}

/// Pressures r of the closed nodes as a function of (q, f), `[k, m + nf]`.
fn pressures(responses: &Responses<'_>, contact: &LinearContact) -> Result<Mat<f64>> {
    let Responses { bodies: BodyView { residual: s, modes: psi, .. }, place, by_force, by_pressure } = responses;
    let (m, k, nf) = (psi.ncols(), contact.nodes.len(), by_force.ncols());
    let normal: Vec<usize> = contact.nodes.iter().map(|n| 3 * n.node + 2).collect();
    let mut s_np = Mat::from_fn(k, k, |i, j| by_pressure[(place[normal[i]], j)]);
    // Where no body moves along the normal the normal force stays as it is: r = 0.
    for (i, &row) in normal.iter().enumerate() {
        if (0..m).all(|j| psi[(row, j)] == 0.0) && (0..s.ncols()).all(|j| s[(row, j)] == 0.0) {
            s_np[(i, i)] = 1.0;
        }
    }
    // r = −S_np⁻¹ (Ψ_n q + S_nf f): one right-hand side for q and f.
    let mut r =
        Mat::from_fn(k, m + nf, |i, j| -if j < m { psi[(normal[i], j)] } else { by_force[(place[normal[i]], j - m)] });
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
    let r = pressures(&Responses::new(bodies.into(), contact, &unknowns), contact)?;
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
fn rows_of(responses: &Responses<'_>, lists: &[Vec<(usize, f64)>], pressures: &Mat<f64>) -> Mat<f64> {
    let Responses { bodies: BodyView { modes: psi, .. }, place, by_force, by_pressure } = responses;
    let (m, k, nf) = (psi.ncols(), by_pressure.ncols(), by_force.ncols());
    let sum = |i: usize, f: &dyn Fn(usize) -> f64| lists[i].iter().map(|&(row, c)| c * f(row)).sum::<f64>();
    let placed = |i: usize, column: &[f64]| lists[i].iter().map(|&(row, c)| c * column[place[row]]).sum::<f64>();
    let direct = Mat::from_fn(nf, m + nf, |i, j| match j < m {
        true => sum(i, &|row| psi[(row, j)]),
        false => placed(i, by_force.col_as_slice(j - m)),
    });
    direct + Mat::from_fn(nf, k, |i, j| placed(i, by_pressure.col_as_slice(j))) * pressures
}

/// b·w of each unknown as a function of (q, f), `[nf, m + nf]`.
fn displacements(responses: &Responses<'_>, contact: &LinearContact, unknowns: &[Yielding], r: &Mat<f64>) -> Mat<f64> {
    let list = |u: &Yielding| (0..2).map(|q| (3 * contact.nodes[u.at].node + q, u.creep[q])).collect();
    rows_of(responses, &unknowns.iter().map(list).collect::<Vec<_>>(), r)
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
    let responses = Responses::new(bodies.into(), contact, &unknowns);
    let r = pressures(&responses, contact)?;
    let w = displacements(&responses, contact, &unknowns, &r);
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
pub(super) struct ContactCoupling {
    /// Forces on the amplitudes, `[m, m + nf]`.
    pub g: Mat<f64>,
    /// b·w of each unknown, `[nf, m + nf]`.
    pub w: Mat<f64>,
    /// b·V ∂w/∂x, `[nf, m + nf]`.
    pub x: Mat<f64>,
}

impl ContactCoupling {
    /// System of the closed nodes of `contact` with these unknowns.
    fn new(bodies: BodyView<'_>, contact: &LinearContact, unknowns: &[Yielding]) -> Result<Self> {
        let (m, k, nf) = (bodies.modes.ncols(), contact.nodes.len(), unknowns.len());
        let (psi, nodes) = (bodies.modes, &contact.nodes);
        let responses = Responses::new(bodies, contact, unknowns);
        let r = pressures(&responses, contact)?;
        let w = displacements(&responses, contact, unknowns, &r);
        let list = |u: &Yielding| {
            let terms = nodes[u.at].convection.iter();
            let carried = terms.flat_map(|&(j, v)| (0..2).map(move |q| (3 * j + q, v * u.creep[q])));
            let edges = contact.edges.iter().filter(|e| e.at == u.at).flat_map(|e| e.gaps);
            carried.chain(edges.map(|(j, d)| (3 * j + 2, d[0] * u.creep[0] + d[1] * u.creep[1]))).collect()
        };
        let mut x = rows_of(&responses, &unknowns.iter().map(list).collect::<Vec<_>>(), &r);
        // b·Ω(D′ u + e × v) of a body that turns under the other one.
        if let Some(rates) = bodies.carried {
            for (i, u) in unknowns.iter().enumerate() {
                let row = 3 * nodes[u.at].node;
                (0..m).for_each(|k| x[(i, k)] += u.creep[0] * rates[(row, k)] + u.creep[1] * rates[(row + 1, k)]);
            }
        }
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
pub(super) fn contact_rows(bodies: BodyView<'_>, contact: &LinearContact) -> Result<ContactRows> {
    let (m, unknowns) = (bodies.modes.ncols(), yielding(contact));
    let ContactCoupling { g: forces, w: mut by_rate, x: mut at_rest } =
        ContactCoupling::new(bodies, contact, &unknowns)?;
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
pub(super) fn assemble(bodies: &CoupledModel, contact: &LinearContact, given: Option<&Scales>) -> Result<ScaledPencil> {
    check(bodies, contact)?;
    let m = bodies.omega.len();
    let unknowns = yielding(contact);
    let nf = unknowns.len();

    let ContactCoupling { g, w, x } = ContactCoupling::new(bodies.into(), contact, &unknowns)?;
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
    Ok(ScaledPencil { a, e, scales: Scales { rate, force, rows }, parts })
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

/// Returns whether the modes are all of the compliance S + Σ ψ²/ω² of a closed node along its normal.
fn rigid(bodies: &CoupledModel, contact: &LinearContact) -> bool {
    let moving = |&(_, w): &(usize, &f64)| *w > 0.0;
    contact.nodes.iter().map(|c| 3 * c.node + 2).any(|k| {
        let of_modes = bodies.omega.iter().enumerate().filter(moving).map(|(j, w)| (bodies.modes[(k, j)] / w).powi(2));
        let (left, of_modes) = (bodies.residual[(k, k)].abs(), of_modes.sum::<f64>());
        of_modes > 0.0 && left <= ROUNDING * of_modes
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
