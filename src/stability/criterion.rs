//! One free mode on the rest, in closed form: what makes an eigenvalue grow.
//!
//! A free mode (or both of a pair) of angular frequency ω_k and damping c presses the contact by ψ_n and is driven by
//! f = ψ_n − μτ·ψ_t per unit normal force; everything else, the other modes of both bodies and what the contact
//! yields by itself, gives way by H(λ) to that force and its friction. Then λ² + cλ + ω_k² + κ/H = 0 with κ = ψ_n f,
//! so that about
//!
//! σ = −c/2 + κ Im H/(2ω_k|H|²),   Δω = κ Re H/(2ω_k|H|²).
//!
//! At constant friction the mode grows only where κ < 0 (ψ_n and ψ_t so that friction takes more than the pressure
//! gives) and H has a phase, which a rail gives and a rigid counter-body does not.
//!
//! That is the contact as a point which feels motion along the normal alone. Two more things take from, or add to,
//! what it gives: motion along the surface, which makes creep and turns the friction, and that the motion is not the
//! same all over the contact, so that moments act on it. With all of them the contact is condensed to the functions
//! 1, x and y of each direction: forces = Z motions, exactly what the linearised contact of [`super::reduced`] makes
//! of such motions. The other modes add their receptances A, and there remains, for the modes that are taken apart,
//!
//! λ² + Cλ + K − ψᵀ (1 − Z A)⁻¹ Z ψ = 0,
//!
//! of which the equation above is the one with the column of the mean normal motion alone in Z. Z and A are taken at
//! the eigenvalue that is to be explained, so that it solves the equation as far as the equation is right: of one mode
//! then σ = −c/2 + Im F/(2ω), with the forces F that Z and A make, whatever share others have in the motion. Of several
//! contact patches each has its own functions 1, x and y; κ is then the sum over the patches, and H that of the patch
//! which the mode moves most along its normal. What rotation and damping couple directly to other modes is in ψ and K.
//! Neglected is the rest of the motion over the contact alone: nothing where the compliance is `"hybrid"`.

use super::reduced::{contact_rows, participation, BodyView, ContactRows, Eigenpair};
use crate::contact::{LinearContact, Tangent};
use crate::model::CoupledModel;
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// Frequencies of a body this near to each other, relatively, are of one pair: coarse meshes split those of a body of
/// revolution.
const PAIR: f64 = 5e-3;

/// Eigenvalues whose imaginary part is less than this part of them do not oscillate.
const REAL: f64 = 1e-9;

/// Part of the size of a function over the contact below which it is made up of those before it, as y is over a line
/// of nodes.
const SAME: f64 = 1e-9;

/// Place of the normal among the mean motions (x, y, n) of a patch.
const NORMAL: usize = 2;

/// Single-mode criterion for one free mode or a pair. Of an eigenvalue that does not oscillate, as friction that falls
/// steeply has them, it is not a number but for the mode and its damping.
#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    /// The free mode with the largest share; its partner of the same frequency and body follows.
    pub modes: Vec<usize>,
    /// −c/2, the part of the growth rate that damping takes, 1/s: the mean of a pair.
    pub damping: f64,
    /// Creep damping: reduction of the growth rate by motion along the surface, 1/s.
    pub across: f64,
    /// Contribution of the variation of the motion over the contact, 1/s.
    pub tilting: f64,
    /// κ, 1/kg: the sum over a pair and over the patches.
    pub coupling: f64,
    /// H at the eigenvalue, m/N; of several patches at that which the mode moves most along its normal.
    pub compliance: C,
    /// The growth rate that all these make, 1/s.
    pub growth_rate: f64,
}

impl Criterion {
    /// Contribution of κ/H, normal motion with its friction, 1/s.
    pub fn friction(&self) -> f64 {
        self.growth_rate - self.damping - self.across - self.tilting
    }
}

/// The contact in motions that are linear over each patch: first the mean ones (x, y, n) of one patch after the other,
/// then those that grow along x and along y, where a patch has such.
struct Condensed {
    /// Rows (λ `by_rate` + `at_rest`) (motions, own unknowns) = 0 and forces on the motions.
    rows: ContactRows,
    /// Number of motions r.
    motions: usize,
    /// Number of patches with closed nodes.
    patches: usize,
    /// The modes by these, 1/√kg, `[r, m]`.
    modes: Mat<f64>,
}

impl Condensed {
    fn new(bodies: &CoupledModel, places: &[Vec<[f64; 2]>], contact: &LinearContact) -> Result<Self> {
        let closed: Vec<usize> = contact.nodes.iter().map(|n| n.node).collect();
        let (functions, patches) = functions(places, &closed);
        let motions = 3 * functions.len();
        let shapes = Mat::from_fn(bodies.modes.nrows(), motions, |row, j| match row % 3 == j % 3 {
            true => functions[j / 3][row / 3],
            false => 0.0,
        });
        // A function has the mean square 1 over the closed nodes of its patch, and is 0 on the others.
        let squares: Vec<f64> = functions.iter().map(|f| closed.iter().map(|&i| f[i] * f[i]).sum()).collect();
        let modes = Mat::from_fn(motions, bodies.omega.len(), |j, k| {
            let of = |&i: &usize| functions[j / 3][i] * bodies.modes[(3 * i + j % 3, k)];
            closed.iter().map(of).sum::<f64>() / squares[j / 3]
        });
        let view = BodyView { modes: &shapes, residual: &bodies.residual, carried: None };
        Ok(Self { rows: contact_rows(view, contact)?, motions, patches, modes })
    }

    /// Z, the forces on the motions by these at λ, N/m, `[r, r]`.
    fn forces(&self, lambda: C) -> Mat<C> {
        let (r, ContactRows { by_rate, at_rest, forces }) = (self.motions, &self.rows);
        let nf = by_rate.nrows();
        let at = |first: usize, n: usize| {
            Mat::from_fn(nf, n, |i, j| lambda * by_rate[(i, first + j)] + at_rest[(i, first + j)])
        };
        let own = at(r, nf).partial_piv_lu().solve(at(0, r));
        Mat::from_fn(r, r, |i, j| forces[(i, j)] - (0..nf).map(|l| forces[(i, r + l)] * own[(l, j)]).sum::<C>())
    }
}

/// The functions 1, x and y of each patch at all nodes, 0 on other patches, orthogonal over the `closed` nodes with a
/// mean square of 1 over those of the patch, as far as these can tell them apart; and the number of patches with closed
/// nodes, whose functions 1 come first.
fn functions(places: &[Vec<[f64; 2]>], closed: &[usize]) -> (Vec<Vec<f64>>, usize) {
    let nodes = places.iter().map(Vec::len).sum();
    let (mut ones, mut others) = (Vec::new(), Vec::new());
    let mut first = 0;
    for patch in places {
        let own = first..first + patch.len();
        let closed: Vec<usize> = closed.iter().copied().filter(|i| own.contains(i)).collect();
        let at = |of: &dyn Fn(&[f64; 2]) -> f64| {
            let mut f = vec![0.0; nodes];
            f[own.clone()].iter_mut().zip(patch).for_each(|(f, x)| *f = of(x));
            f
        };
        first += patch.len();
        if closed.is_empty() {
            continue;
        }
        let mean = |a: &[f64], b: &[f64]| closed.iter().map(|&i| a[i] * b[i]).sum::<f64>() / closed.len() as f64;
        let mut found = vec![at(&|_| 1.0)];
        for mut f in [at(&|x| x[0]), at(&|x| x[1])] {
            let whole = mean(&f, &f).sqrt();
            for before in &found {
                let share = mean(&f, before);
                f.iter_mut().zip(before).for_each(|(f, b)| *f -= share * b);
            }
            let size = mean(&f, &f).sqrt();
            if size > SAME * whole {
                f.iter_mut().for_each(|f| *f /= size);
                found.push(f);
            }
        }
        others.extend(found.split_off(1));
        ones.append(&mut found);
    }
    let patches = ones.len();
    ones.append(&mut others);
    (ones, patches)
}

/// The closed form for the `pairs` of bodies that slide all over the contact, whose nodes have their `places` (x, y),
/// m, in their order, patch by patch; none where part of it sticks, or where it does not yield by itself.
pub fn criteria(
    bodies: &CoupledModel,
    places: &[Vec<[f64; 2]>],
    contact: &LinearContact,
    pairs: &[Eigenpair],
) -> Result<Vec<Criterion>> {
    if contact.nodes.is_empty() || contact.nodes.iter().any(|n| !matches!(n.tangent, Tangent::Slip(_))) {
        return Ok(Vec::new());
    }
    let condensed = Condensed::new(bodies, places, contact)?;
    let found: Result<Option<Vec<Criterion>>> = pairs.iter().map(|p| of_pair(bodies, &condensed, p)).collect();
    Ok(found?.unwrap_or_default())
}

/// None where no normal force answers a normal motion.
fn of_pair(bodies: &CoupledModel, contact: &Condensed, pair: &Eigenpair) -> Result<Option<Criterion>> {
    let m = bodies.omega.len();
    let share = participation(bodies, pair);
    let first = (0..m).max_by(|&a, &b| share[a].total_cmp(&share[b])).unwrap_or(0);
    let body = |k: usize| k < bodies.lower_modes;
    let near = |k: usize| (bodies.omega[k] - bodies.omega[first]).abs() <= PAIR * bodies.omega[first];
    let mut own: Vec<usize> = (0..m).filter(|&k| k == first || (body(k) == body(first) && near(k))).collect();
    own.sort_by_key(|&k| k != first);
    let omega = pair.value.im.abs();
    let damping = -0.5 * own.iter().map(|&k| bodies.damping.get(k, k)).sum::<f64>() / own.len() as f64;
    if omega <= REAL * pair.value.norm() {
        let (none, compliance) = (f64::NAN, C::new(f64::NAN, f64::NAN));
        let (across, tilting, coupling, growth_rate) = (none, none, none, none);
        return Ok(Some(Criterion { modes: own, damping, across, tilting, coupling, compliance, growth_rate }));
    }

    let lambda = C::new(pair.value.re, omega);
    let z = contact.forces(lambda);
    let means = 3 * contact.patches;
    let presses = |j: usize| j < means && j % 3 == NORMAL;
    if (0..means).any(|j| presses(j) && z[(j, j)] == C::default()) {
        return Ok(None);
    }
    let rest = Rest::new(bodies, contact, &own, lambda);
    let apart = ModeComplement { bodies, own: &own, rest: &rest, value: lambda };
    let grown = |keeps: &dyn Fn(usize, usize) -> bool| {
        let part = Mat::from_fn(z.nrows(), z.ncols(), |i, j| if keeps(i, j) { z[(i, j)] } else { C::default() });
        apart.grown(&part)
    };
    let pressed = grown(&|i, j| i < means && presses(j))?;
    let moved = grown(&|i, j| i < means && j < means)?;
    let growth_rate = grown(&|_, _| true)?;
    // (x, y, n) of patch p per normal force there.
    let force = |p: usize| [0, 1, 2].map(|c| z[(3 * p + c, 3 * p + NORMAL)] / z[(3 * p + NORMAL, 3 * p + NORMAL)]);
    let psi = |p: usize, c: usize, k: usize| contact.modes[(3 * p + c, k)];
    let driven = |p: usize, k: usize| (0..3).map(|c| force(p)[c] * psi(p, c, k)).sum::<C>();
    let coupling = |p: usize| own.iter().map(|&k| psi(p, NORMAL, k) * driven(p, k).re).sum::<f64>();
    let normal_motion = |p: &usize| own.iter().map(|&k| psi(*p, NORMAL, k).powi(2)).sum::<f64>();
    let patches = 0..contact.patches;
    let most = patches.clone().max_by(|a, b| normal_motion(a).total_cmp(&normal_motion(b))).unwrap_or(0);
    let (row, on) = (3 * most + NORMAL, force(most));
    Ok(Some(Criterion {
        damping,
        across: moved - pressed,
        tilting: growth_rate - moved,
        coupling: patches.map(coupling).sum(),
        compliance: (0..3).map(|c| rest.receptances[(row, 3 * most + c)] * on[c]).sum::<C>() - z[(row, row)].inv(),
        growth_rate,
        modes: own,
    }))
}

/// All modes but those that are taken apart, at λ.
struct Rest {
    /// A, the motions of the contact by forces on them, m/N, `[r, r]`.
    receptances: Mat<C>,
    /// ψ of the modes apart, with those that they move directly: the motions of the contact by them, `[r, n]`, and
    /// the forces on them by those on these, `[n, r]`.
    motions: Mat<C>,
    work: Mat<C>,
    /// The forces on the modes apart by those that they move directly, 1/s², `[n, n]`.
    direct: Mat<C>,
}

impl Rest {
    fn new(bodies: &CoupledModel, contact: &Condensed, own: &[usize], lambda: C) -> Self {
        let rest: Vec<usize> = (0..bodies.omega.len()).filter(|k| !own.contains(k)).collect();
        let dynamic = |i: usize, j: usize| {
            let inertia = if i == j { lambda * lambda } else { C::default() };
            inertia + lambda * bodies.damping.get(i, j) + bodies.stiffness.get(i, j)
        };
        let block = |rows: &[usize], columns: &[usize]| {
            Mat::from_fn(rows.len(), columns.len(), |a, b| dynamic(rows[a], columns[b]))
        };
        let seen =
            |modes: &[usize]| Mat::from_fn(contact.motions, modes.len(), |j, a| C::from(contact.modes[(j, modes[a])]));
        let (among, onto, back) = (block(&rest, &rest).partial_piv_lu(), block(&rest, own), block(own, &rest));
        let (psi, psi_rest) = (seen(own), seen(&rest));
        let (by_forces, moved) = (among.solve(psi_rest.transpose()), among.solve(onto));
        Self {
            receptances: &psi_rest * &by_forces,
            motions: &psi - &psi_rest * &moved,
            work: psi.transpose() - &back * &by_forces,
            direct: back * moved,
        }
    }
}

/// Modes that are taken apart.
struct ModeComplement<'a> {
    bodies: &'a CoupledModel,
    own: &'a [usize],
    rest: &'a Rest,
    /// The eigenvalue that they are to explain, with Im > 0.
    value: C,
}

impl ModeComplement<'_> {
    /// Their growth rate on a contact with the forces `z`: that of the eigenvalue nearest to the one looked at.
    fn grown(&self, z: &Mat<C>) -> Result<f64> {
        let Self { bodies, own, rest, value } = self;
        let (n, omega) = (own.len(), value.im);
        let held = Mat::<C>::identity(z.nrows(), z.nrows()) - z * &rest.receptances;
        let forces = &rest.direct + &rest.work * held.partial_piv_lu().solve(z * &rest.motions);
        // λ² + Cλ + K − forces, as a companion matrix in units of ω.
        let companion = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, true) => C::default(),
            (true, false) => C::from(f64::from(u8::from(i == j - n))),
            (false, true) => (forces[(i - n, j)] - bodies.stiffness.get(own[i - n], own[j])) / (omega * omega),
            (false, false) => C::from(-bodies.damping.get(own[i - n], own[j - n]) / omega),
        });
        let values = companion.eigenvalues().map_err(|e| Error::NotConverged(format!("criterion: {e:?}")))?;
        let wanted = value / omega;
        let nearest = values.into_iter().min_by(|a, b| (a - wanted).norm().total_cmp(&(b - wanted).norm()));
        Ok(nearest.map_or(f64::NAN, |v| v.re * omega))
    }
}

#[cfg(test)]
mod tests {
    use super::super::reduced::eigenpairs;
    use super::*;
    use crate::body::ReducedBody;
    use crate::contact::{LinearNode, Slip};

    /// A mode that friction which falls drives harder than it can oscillate: two real eigenvalues, of which there is
    /// no such criterion.
    #[test]
    fn what_does_not_oscillate_has_none() {
        let omega = 900.0;
        let modes = Mat::from_fn(3, 1, |i, _| [0.0, 0.17, 0.0][i]);
        let compliance = Mat::from_fn(3, 3, |i, j| {
            let own = if i == j && i == 2 { 1e-9 } else { 0.0 };
            own + modes[(i, 0)] * modes[(j, 0)] / (omega * omega)
        });
        let body = ReducedBody::new(vec![omega], vec![0.5], modes, compliance.clone());
        let rigid = ReducedBody::new(Vec::new(), Vec::new(), Mat::zeros(3, 0), Mat::zeros(3, 3));
        let pair = CoupledModel::new(&rigid, &body).unwrap();
        let contact = LinearContact {
            nodes: vec![LinearNode {
                node: 0,
                tangent: Tangent::Slip(Slip::steady(6e4, [0.0, -1.0], 0.1, 0.3, -2.0)),
                convection: Vec::new(),
            }],
            ..LinearContact::default()
        };
        let growing: Vec<_> =
            eigenpairs(&pair, &contact, 1e-9).unwrap().into_iter().filter(|e| e.growth_rate() > 0.0).collect();
        assert!(growing.len() == 2 && growing.iter().all(|e| e.value.im.abs() < 1e-6), "{growing:?}");
        for c in criteria(&pair, &[vec![[0.0; 2]]], &contact, &growing).unwrap() {
            assert!(c.modes == [0] && c.damping == -0.25 && c.growth_rate.is_nan() && c.coupling.is_nan(), "{c:?}");
        }
    }

    /// A wheel of one mode on a rail of one mode, at one contact that slides along y at constant friction 0.3; on
    /// either side of the rail's resonance and on a rail at rest.
    #[test]
    fn one_mode_grows_as_the_eigenvalues_say() {
        let mu = 0.3;
        let local = 1e-9;
        let body = |omega: f64, c: f64, modes: [f64; 3], local: f64| {
            let rows = Mat::from_fn(3, 1, |i, _| modes[i]);
            let compliance = Mat::from_fn(3, 3, |i, j| {
                let own = if i == j && i == 2 { local } else { 0.0 };
                own + modes[i] * modes[j] / (omega * omega)
            });
            ReducedBody::new(vec![omega], vec![c], rows, compliance)
        };
        let slip = Slip::steady(6e4, [0.0, -1.0], 0.1, mu, 0.0);
        let contact = LinearContact {
            nodes: vec![LinearNode { node: 0, tangent: Tangent::Slip(slip), convection: Vec::new() }],
            ..LinearContact::default()
        };
        let wheel = body(2200.0, 0.5, [0.0, 0.08, 0.01], local);
        let mut signs = Vec::new();
        for rail in [1500.0, 3500.0] {
            let rail = body(rail, 400.0, [0.0, 0.0, 0.1], 0.0);
            let pair = CoupledModel::new(&rail, &wheel).unwrap();
            let all = eigenpairs(&pair, &contact, 1e-9).unwrap();
            let of_wheel: Vec<_> =
                all.into_iter().filter(|e| e.value.im > 0.0 && participation(&pair, e)[1] > 0.7).collect();
            let found = criteria(&pair, &[vec![[0.0; 2]]], &contact, &of_wheel).unwrap();
            assert_eq!((found.len(), &found[0].modes[..]), (1, &[1usize][..]));
            let (c, grown) = (&found[0], of_wheel[0].growth_rate());
            let omega = of_wheel[0].value.im;
            let first_order = c.damping + c.coupling * c.compliance.im / (2.0 * 2200.0 * c.compliance.norm_sqr());
            assert!((c.growth_rate - grown).abs() < 1e-8 * omega, "{c:?} {grown}");
            assert!((first_order - grown).abs() < 0.1 * (grown - c.damping).abs(), "{first_order} {grown} {omega}");
            assert!((c.damping + 0.25).abs() < 1e-15 && c.across.abs() < 1e-12 && c.tilting == 0.0, "{c:?}");
            signs.push((c.coupling.signum(), c.compliance.im.signum()));
        }
        // A single node has no moments to tell from forces, and a single line of them those about two axes alone.
        let grid: Vec<[f64; 2]> = (0..9).map(|i| [(i % 3) as f64, (i / 3) as f64]).collect();
        let one = [grid.clone()];
        assert_eq!([&[4][..], &[3, 4, 5], &[0, 4, 8], &[1, 3, 4]].map(|c| functions(&one, c).0.len()), [1, 2, 2, 3]);
        // Of two patches each has its own, the means first; a patch that is open has none.
        let (found, patches) = functions(&[grid.clone(), grid.clone()], &[4, 10, 12, 13]);
        let seen: Vec<[f64; 2]> = found.iter().map(|f| [f[4], f[13]]).collect();
        assert_eq!((patches, found.len(), &seen[..2]), (2, 4, &[[1.0, 0.0], [0.0, 1.0]][..]));
        assert!(found[2..].iter().all(|f| f[..9] == [0.0; 9]) && functions(&[grid.clone(), grid], &[10]).1 == 1);
        // A rail's mode always lags: only the sign of κ decides; the wheel sees μτ·ψ_t of either sign.
        assert!(signs.iter().all(|s| s.1 < 0.0) && signs[0].0 == signs[1].0, "{signs:?}");
    }
}
