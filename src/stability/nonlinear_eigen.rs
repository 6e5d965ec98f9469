//! Eigenvalues of bodies with many modes, by what the contact sees of these.
//!
//! Over a contact patch the modes move as few functions B do, Ψ = U B with far fewer rows in B than there are modes.
//! With P(λ) = λ² + cλ + k of the modes and the contact's own unknowns eliminated at λ there remains, in these few
//! functions,
//!
//! det(1 − K(λ) G(λ)) = 0,   G = B P⁻¹ Bᵀ,   K = G_q − G_f (λA + C)⁻¹ (λA_q + X_q).
//!
//! G is a sum over poles, K is smooth along the frequencies of the modes and is interpolated there (Chebyshev
//! polynomials of ln λ). The roots are found all at once by the method of O. Aberth (Math. Comp. 27 (1973) 339),
//! which keeps them apart: as many as there are modes, and one for each relaxation of the contact that is as little
//! damped as what is listed.
//!
//! That none is missing follows from the argument principle: det(1 − KG), with the poles of the modes and the roots
//! found divided out, has the eigenvalues that were not found as its zeros and the relaxations of the contact by
//! itself as its poles, and is 1 at infinity. Its phase along the ray of the damping ratio that bounds the list
//! counts those inside. Where that is not certain, or anything else fails, there is no answer, and the whole spectrum
//! of the dense pencil has to be taken.

use super::reduced::{check, contact_rows, BodyView, ContactRows, Eigenpair};
use crate::contact::LinearContact;
use crate::model::CoupledModel;
use crate::Result;
use chebyshev::ChebyshevStiffness;
use dense_lu::DenseLu;
use modal_compliance::ModalCompliance;
use num_complex::Complex;
use pole_sums::{AberthSums, DeflationQuotient};
use std::f64::consts::{FRAC_PI_2, PI};
use std::rc::Rc;

mod argument_principle;
mod backward_errors;
mod chebyshev;
mod condensed_contact;
mod contact_resolvent;
mod dense_lu;
mod eigenvectors;
mod modal_compliance;
mod pole_sums;
mod refinement;
mod spectrum_memory;
mod tracker;

use argument_principle::remaining_error;
use condensed_contact::CondensedContact;
use spectrum_memory::LastState;
pub use spectrum_memory::{LastSpectrum, SpectrumMemory};
pub use tracker::{track, Count, KnownSpectrum, TrackedSpectrum};

type C = Complex<f64>;

/// Iterations for the roots, and how far one may go in each, over its size.
const ITERATIONS: usize = 40;
const FAR: f64 = 0.05;
/// Times that missing ones are looked for.
const ROUNDS: usize = 8;
/// Fractions of the way between the imaginary axis and the ray that bounds the list at which roots are searched for,
/// search after search.
const BETWEEN: [f64; 4] = [0.5, 0.1, 0.9, 0.3];
const MOVED: f64 = 0.618;
/// Change of a root, over its size, that is rounding; and what may be left of one by the estimate from the changes of
/// all.
const SETTLED: [f64; 2] = [1e-12, 1e-14];
/// How much nearer than its size other roots, which nobody looks for, may be to one.
const CROWDED: f64 = 100.0;
/// Part of the change of the contact from one state to the next that may differ from that before, and how many times
/// as large it may be, where the roots are taken to go on as they went.
const STRAIGHT: [f64; 2] = [0.3, 3.0];
/// Frequencies at which the contact is compared from one state to the next.
const COMPARED: usize = 4;
/// Roots nearer than this to each other, over their size, may be the same.
const APART: f64 = 1e-10;
/// A root whose imaginary part is less than this part of it may have none.
const REAL: f64 = 1e-6;
/// Largest damping ratio up to which eigenvalues can be listed.
const LISTED: f64 = 0.7;
/// Poles whose damping ratio is larger by this are left alone.
const MARGIN: f64 = 0.1;
/// Step along the ray of the logarithm of frequency, and how often it may be halved.
const STEP: f64 = 1.0;
const HALVINGS: usize = 14;
/// Largest change of the logarithm along a step, and of that change from one step to the next.
const SMOOTH: [f64; 2] = [0.8, 0.4];
/// How far below and above the frequencies of the modes the ray is followed at least and at the most, in logarithms.
const BELOW: [f64; 2] = [4.0, 16.0];
const ABOVE: [f64; 2] = [4.0, 16.0];
/// Part of the forces of the contact by which the polynomials may be wrong at a root: how well it is one is judged by
/// its eigenpair.
const NEAR: f64 = 1e-6;
/// Eigenvalues whose motions are looked at where they are not asked for: so many first ones, and each of so many.
const LOOKED_AT: [usize; 2] = [16, 48];
/// The same of continued ones, which all come from eigenvalues that were looked at.
const CONTINUED: [usize; 2] = [3, 48];
/// Part of the contact by which the polynomials may be wrong where roots are searched for, where they are counted, and
/// where roots are corrected afterwards.
const FINE: f64 = 1e-12;
const COUNTED: f64 = 1e-7;
const COARSE: f64 = 1e-5;
/// Phase that is 0 or π.
const EVEN: f64 = 0.05;

/// All eigenvalues with a damping ratio up to `ratio`, or growing, both of each conjugate pair, by falling growth
/// rate, each with a backward error of at most `tolerance`. None where it is not certain that these are all. The search
/// begins from what `memory` has of the state before, and leaves this state there.
pub fn eigenpairs(
    bodies: &CoupledModel,
    contact: &LinearContact,
    [ratio, tolerance]: [f64; 2],
    memory: &SpectrumMemory,
) -> Result<Option<Vec<Eigenpair>>> {
    let Some((problem, roots)) = inside(bodies, contact, ratio, memory)? else { return Ok(None) };
    Ok(problem.pairs(bodies, &roots, tolerance))
}

/// The same with Im λ > 0 alone and without their motions. Backward errors are those of the motions that the poles of
/// the bodies and the contact give; at some of the eigenvalues, the least stable ones among them, also those of the
/// motions themselves.
pub fn eigenvalues(
    bodies: &CoupledModel,
    contact: &LinearContact,
    [ratio, tolerance]: [f64; 2],
    memory: &SpectrumMemory,
) -> Result<Option<Vec<Eigenpair>>> {
    let Some((problem, roots)) = inside(bodies, contact, ratio, memory)? else { return Ok(None) };
    Ok(problem.values(bodies, &roots, tolerance))
}

/// The problem and its roots with Im > 0 that may be listed, by falling growth rate; none where it is not certain
/// that these are all.
fn inside<'m>(
    bodies: &CoupledModel,
    contact: &LinearContact,
    ratio: f64,
    memory: &'m SpectrumMemory,
) -> Result<Option<(NonlinearEigenproblem<'m>, Vec<C>)>> {
    check(bodies, contact)?;
    let Some(problem) = NonlinearEigenproblem::new(bodies, contact, ratio, memory)? else { return Ok(None) };
    let Some(mut roots) = problem.roots() else { return Ok(None) };
    roots.retain(|v| problem.aside(*v) <= 0.0);
    roots.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    Ok(Some((problem, roots)))
}

/// Relaxations near those of a contact, 1/s, and the range of angular frequencies over which it is interpolated, rad/s.
type KnownContact<'k> = (&'k [C], [f64; 2]);

/// The problem in what the contact sees.
struct NonlinearEigenproblem<'m> {
    /// State before this one, and this one once it is solved.
    memory: &'m SpectrumMemory,
    modes: Rc<ModalCompliance>,
    contact: CondensedContact,
    /// K and what makes it, along the frequencies of the modes.
    along: ChebyshevStiffness,
    /// Relaxations of the contact by itself that are as little damped as what is listed.
    relaxations: Vec<C>,
    /// Angle of the ray that bounds what is listed.
    angle: f64,
}

impl<'m> NonlinearEigenproblem<'m> {
    /// None where the problem is not for this method.
    fn new(
        bodies: &CoupledModel,
        contact: &LinearContact,
        ratio: f64,
        memory: &'m SpectrumMemory,
    ) -> Result<Option<Self>> {
        Self::with_relaxations(bodies, contact, (ratio, None), memory)
    }

    /// The same with what is `known` of this contact.
    fn with_relaxations(
        bodies: &CoupledModel,
        contact: &LinearContact,
        (ratio, known): (f64, Option<KnownContact>),
        memory: &'m SpectrumMemory,
    ) -> Result<Option<Self>> {
        if !(ratio <= LISTED) || contact.nodes.is_empty() {
            return Ok(None);
        }
        let angle = FRAC_PI_2 + ratio.asin();
        let within = FRAC_PI_2 + (ratio + MARGIN).asin();
        let Some((modes, shapes)) = ModalCompliance::build(bodies, &places(contact), within, memory) else {
            return Ok(None);
        };
        let [low, high] = modes.range();
        let rate = (low * high).sqrt();
        let view = BodyView { modes: &shapes, residual: &bodies.residual, carried: None };
        let rows = contact_rows(view, contact)?;
        let contact = CondensedContact::new(rows, modes.rank, rate);
        let computed = || contact.relaxations(rate, angle);
        let Some(relaxations) = known.map(|k| k.0.to_vec()).or_else(computed) else { return Ok(None) };
        if relaxations.iter().any(|z| z.im <= REAL * z.norm()) {
            return Ok(None);
        }
        let range = known.map_or_else(|| Self::reach([low, high], &relaxations), |k| k.1);
        // Of known ones the polynomials are a start.
        let left = if known.is_some() { COARSE } else { FINE };
        let Some(along) = ChebyshevStiffness::new(&contact, range, left) else { return Ok(None) };
        Ok(Some(Self { memory, modes, contact, along, relaxations, angle }))
    }

    /// Angular frequencies of the modes in the `range`, and of the relaxations of the contact.
    fn reach(range: [f64; 2], relaxations: &[C]) -> [f64; 2] {
        let [low, high] = relaxations.iter().fold(range, |[a, b], z| [a.min(z.norm()), b.max(z.norm())]);
        [0.8 * low, 1.25 * high]
    }

    /// The contact along all of these frequencies, good to the digits that a count needs.
    fn along_all(&self) -> Option<ChebyshevStiffness> {
        ChebyshevStiffness::new(&self.contact, Self::reach(self.modes.range(), &self.relaxations), COUNTED)
    }

    /// K G − 1, by columns.
    fn matrix(&self, k: &[C], g: &[C]) -> Vec<C> {
        let r = self.modes.rank;
        let mut h = vec![C::default(); r * r];
        (0..r).for_each(|i| h[i * r + i] -= 1.0);
        self.modes.add_product(k, g, &mut h);
        h
    }

    /// A vector of norm 1 that K G − 1 makes smallest.
    fn null_vector(&self, k: &[C], g: &[C]) -> Vec<C> {
        let (r, h) = (self.modes.rank, self.matrix(k, g));
        DenseLu::new((0..r * r).map(|i| h[i % r * r + i / r]).collect(), r).null_vector()
    }

    /// The logarithmic derivative of det(1 − KG) P at each of `values`.
    fn slopes(&self, values: &[C]) -> Vec<C> {
        let r = self.modes.rank;
        let ([g, by_g], poles) = self.modes.compliances(values);
        let [k, by_k] = self.along.stiffnesses(values);
        let of = |l: usize| {
            let of = |of: &'_ [C]| -> Vec<C> { of[l * r * r..(l + 1) * r * r].to_vec() };
            let (k, g) = (of(&k), of(&g));
            // By columns: trace and determinant are those of the transposed.
            let lu = DenseLu::new(self.matrix(&k, &g), r);
            let mut change = vec![C::default(); r * r];
            self.modes.add_product(&of(&by_k), &g, &mut change);
            self.modes.add_product(&k, &of(&by_g), &mut change);
            poles[l] + lu.trace_of_solution(&change)
        };
        (0..values.len()).map(of).collect()
    }

    /// Roots with Im > 0, among them all inside the ray; none where that is not certain.
    fn roots(&self) -> Option<Vec<C>> {
        let last = Some(self.memory.last()).filter(|last| last.is_near(&self.modes.poles));
        let now = self.compared();
        let starts = last.as_ref().map_or_else(|| self.anew(), |last| last.predicted(&now));
        // What is known of the way here is of the same bodies.
        let last = last.filter(|last| last.poles == self.modes.poles);
        let (mut roots, mut moving) = self.settled(Vec::new(), starts);
        for round in 0..ROUNDS {
            let missing = self.missing(&roots)?;
            if missing == 0 {
                self.remember(last, &roots, now);
                return Some(roots);
            }
            // Some went to others outside. What is left is looked for with the roots that are known kept apart.
            let count = 2 * usize::try_from(missing).ok()? + 6;
            let [low, high] = self.modes.range();
            let share = |k: usize| ((k as f64 + 0.5 + MOVED * round as f64) / count as f64).fract();
            let place = |k: usize| low * (high / low).powf(share(k));
            moving.extend((0..count).map(|k| self.between(place(k), BETWEEN[round % BETWEEN.len()])));
            (roots, moving) = self.settled(roots, moving);
        }
        None
    }

    /// λ of this size, a part of the way from the imaginary axis to the ray that bounds the list.
    fn between(&self, size: f64, part: f64) -> C {
        C::from_polar(size, FRAC_PI_2 + part * (self.angle - FRAC_PI_2))
    }

    /// Start of the search without earlier roots: the poles, of which the contact brings back some that are damped
    /// more.
    fn anew(&self) -> Vec<C> {
        let damped = self.modes.damped.iter().map(|p| self.between(p.norm(), BETWEEN[0]));
        self.modes.starts().into_iter().chain(self.relaxations.iter().copied()).chain(damped).collect()
    }

    /// K at some frequencies, one matrix after the other.
    fn compared(&self) -> Vec<C> {
        let [low, high] = self.modes.range();
        let at = |k: usize| C::new(0.0, low * (high / low).powf((k as f64 + 0.5) / COMPARED as f64));
        self.along.stiffness(&(0..COMPARED).map(at).collect::<Vec<C>>())
    }

    /// Keeps the `roots` of this state, whose contact is `now`, for the next one; `last` is the one before.
    fn remember(&self, last: Option<LastState>, roots: &[C], now: Vec<C>) {
        let (mut before, mut change) = (Vec::new(), Vec::new());
        if let Some(last) = last.filter(|l| l.contact.len() == now.len() && !l.roots.is_empty()) {
            let far = |a: &C, b: &C| (a - b).norm_sqr();
            let nearest = |v: &C| last.roots.iter().copied().min_by(|a, b| far(a, v).total_cmp(&far(b, v)));
            before = roots.iter().map(|v| nearest(v).unwrap_or(*v)).collect();
            change = now.iter().zip(&last.contact).map(|(a, b)| a - b).collect();
        }
        let (poles, roots, relaxations) = (self.modes.poles.clone(), roots.to_vec(), self.relaxations.clone());
        self.memory.remember(LastState { poles, roots, before, contact: now, change, relaxations });
    }

    /// The roots `known` and those that `starts` lead to; and where those are that have not come to rest.
    fn settled(&self, known: Vec<C>, starts: Vec<C>) -> (Vec<C>, Vec<C>) {
        let first = known.len();
        let mut all = known;
        all.extend(starts);
        let mut moving: Vec<usize> = (first..all.len()).collect();
        for _ in 0..ITERATIONS {
            let values: Vec<C> = moving.iter().map(|&j| all[j]).collect();
            let mut moved = all.clone();
            let charges = AberthSums::new(&all);
            let mut changes: Vec<(usize, f64)> = Vec::new();
            for (&j, slope) in moving.iter().zip(self.slopes(&values)) {
                let own = all[j];
                let change = (slope - charges.attraction(j)).inv();
                // On a root, or on a pole that the contact does not see.
                if !change.is_finite() {
                    continue;
                }
                let size = own.norm();
                let change = change * (FAR * size / change.norm()).min(1.0);
                let to = own - change;
                moved[j] = if to.im < 0.0 { to.conj() } else { to };
                if change.norm() > SETTLED[0] * size {
                    changes.push((j, change.norm()));
                }
            }
            all = moved;
            moving = changes
                .iter()
                .filter(|c| remaining_error(&all, &changes, **c) > SETTLED[1] * all[c.0].norm())
                .map(|c| c.0)
                .collect();
            if moving.is_empty() {
                break;
            }
        }
        // Where poles and roots lie on either side of what is looked at, a start may have no root to go to.
        let good = |v: &C| v.im > REAL * v.norm() && self.along.covers(*v) && self.sound(*v);
        let left = moving.iter().map(|&j| all[j]).collect();
        let mut found: Vec<C> = Vec::new();
        for (j, v) in all.iter().enumerate() {
            let settled = j < first || (moving.binary_search(&j).is_err() && good(v));
            let apart = APART * APART * v.norm_sqr();
            if settled && found.iter().all(|a| (a - v).norm_sqr() > apart) {
                found.push(*v);
            }
        }
        (found, left)
    }

    /// Returns whether the polynomials give the contact at λ: far from the frequencies of the modes they may have roots
    /// of their own.
    fn sound(&self, lambda: C) -> bool {
        if self.along.is_near(lambda) {
            return true;
        }
        let (r, exact) = (self.modes.rank, self.contact.stiffness(lambda));
        let found = self.along.stiffness(&[lambda]);
        let off = (0..r * r).map(|i| (found[i] - exact[(i % r, i / r)]).norm_sqr()).sum::<f64>();
        off.sqrt() <= NEAR * exact.norm_l2()
    }

    /// The poles of the modes and of the contact, and the `roots`, to be taken out, as many of these as of those.
    fn balanced(&self, roots: &[C]) -> [Vec<C>; 2] {
        let outside = |v: &C| (self.aside(*v), *v);
        let mut poles: Vec<(f64, C)> = self.modes.poles.iter().chain(&self.relaxations).map(outside).collect();
        let mut roots = roots.to_vec();
        poles.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Poles outside the ray may stay, ...
        while poles.len() > roots.len() && poles.last().is_some_and(|p| p.0 > 0.0) {
            poles.pop();
        }
        let mut poles: Vec<C> = poles.into_iter().map(|p| p.1).collect();
        // ... and what lies far outside does not count.
        let far = |v: &C| C::from(-v.norm());
        let more: [Vec<C>; 2] = [&roots, &poles].map(|v| v.iter().map(far).collect());
        let (have, want) = (poles.len(), roots.len());
        poles.extend(more[0].iter().skip(have));
        roots.extend(more[1].iter().skip(want));
        [poles, roots]
    }

    /// How far λ lies outside the ray, rad.
    fn aside(&self, lambda: C) -> f64 {
        lambda.im.atan2(lambda.re) - self.angle
    }

    /// The logarithm of det(1 − KG) with some poles and roots divided out, at each of `values`.
    fn rest(&self, quotient: &DeflationQuotient, values: &[C]) -> Vec<C> {
        self.rest_with(quotient, values, &self.modes.compliance(values))
    }

    /// The same with G at each of `values`, `[r²]` each.
    fn rest_with(&self, quotient: &DeflationQuotient, values: &[C], compliances: &[C]) -> Vec<C> {
        let r = self.modes.rank;
        // The polynomials are good to many more digits here than a phase needs.
        let (near, far): (Vec<C>, Vec<C>) = values.iter().partition(|v| self.along.holds(**v));
        let polynomials = self.along.stiffness(&near);
        let mut polynomials = polynomials.chunks_exact(r * r).map(<[C]>::to_vec);
        let mut exact = far.iter().map(|v| {
            let k = self.contact.stiffness(*v);
            (0..r * r).map(|i| k[(i % r, i / r)]).collect::<Vec<C>>()
        });
        // det(KG − 1) has the sign of det(1 − KG) where r is even.
        let sign = C::new(0.0, PI * (r % 2) as f64);
        let of = |(lambda, g): (&C, &[C])| {
            let k = if self.along.holds(*lambda) { polynomials.next() } else { exact.next() };
            let k = k.unwrap_or_default();
            sign + DenseLu::new(self.matrix(&k, g), r).log_determinant() + quotient.logarithm(*lambda)
        };
        values.iter().zip(compliances.chunks_exact(r * r)).map(of).collect()
    }
}

/// Contact rows, ascending, that the linearised laws ask for.
fn places(contact: &LinearContact) -> Vec<usize> {
    let closed = contact.nodes.iter().flat_map(|n| {
        let carried = n.convection.iter().flat_map(|&(j, _)| [3 * j, 3 * j + 1]);
        (3 * n.node..3 * n.node + 3).chain(carried)
    });
    let edges = contact.edges.iter().flat_map(|e| e.gaps.map(|(j, _)| 3 * j + 2));
    let mut all: Vec<usize> = closed.chain(edges).collect();
    all.sort_unstable();
    all.dedup();
    all
}

#[cfg(test)]
mod tests;
