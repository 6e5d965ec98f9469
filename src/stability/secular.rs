//! Eigenvalues of bodies with many modes, by what the contact sees of these.
//!
//! Over a contact patch the modes move as few functions B do, Ψ = U B with far fewer rows in B than there are modes. With P(λ) = λ² + cλ + k of the modes
//! and the contact's own unknowns eliminated at λ there remains, in these few functions,
//!
//! det(1 − K(λ) G(λ)) = 0,   G = B P⁻¹ Bᵀ,   K = G_q − G_f (λA + C)⁻¹ (λA_q + X_q).
//!
//! G is a sum over poles, K is smooth along the frequencies of the modes and is interpolated there (Chebyshev polynomials of ln λ). The roots are found
//! all at once by the method of O. Aberth (Math. Comp. 27 (1973) 339), which keeps them apart: as many as there are modes, and one for each relaxation of
//! the contact that is as little damped as what is listed.
//!
//! That none is missing follows from the argument principle: det(1 − KG), with the poles of the modes and the roots found divided out, has the
//! eigenvalues that were not found as its zeros and the relaxations of the contact by itself as its poles, and is 1 at infinity. Its phase along the ray
//! of the damping ratio that bounds the list counts those inside. Where that is not certain, or anything else fails, there is no answer, and the whole spectrum
//! of the dense pencil has to be taken.

use super::reduced::{assemble, contact_rows, ContactRows, Eigenpair, Pencil, View};
use crate::contact::LinearContact;
use crate::model::ModalPair;
use crate::Result;
use faer::{Mat, MatRef};
use interpolated::Interpolated;
use modal::Modes;
use num_complex::Complex;
use small::Lu;
use std::cell::RefCell;
use std::f64::consts::{FRAC_PI_2, PI};

mod interpolated;
mod modal;
mod small;

type C = Complex<f64>;

/// Iterations for the roots, and how far one may go in each, over its size.
const ITERATIONS: usize = 40;
const FAR: f64 = 0.05;
/// Times that missing ones are looked for.
const ROUNDS: usize = 5;
/// Change of a root, over its size, that is rounding.
const SETTLED: f64 = 1e-12;
/// Roots nearer than this to each other, over their size, may be the same.
const APART: f64 = 1e-10;
/// A root whose imaginary part is less than this part of it may have none.
const REAL: f64 = 1e-6;
/// Largest damping ratio up to which eigenvalues can be listed.
const LISTED: f64 = 0.7;
/// Poles whose damping ratio is larger by this are left alone.
const MARGIN: f64 = 0.1;
/// Step along the ray of the logarithm of frequency, and how often it may be halved.
const STEP: f64 = 0.5;
const HALVINGS: usize = 10;
/// Largest change of the logarithm along a step, and of that change from one step to the next.
const SMOOTH: [f64; 2] = [0.8, 0.4];
/// How far below and above the frequencies of the modes the ray is followed at least and at the most, in logarithms.
const BELOW: [f64; 2] = [4.0, 16.0];
const ABOVE: [f64; 2] = [4.0, 16.0];
/// Phase that is 0 or π.
const EVEN: f64 = 0.05;

thread_local! {
    /// The poles and the roots of the last state: from one state to the next the roots are mostly near.
    static LAST: RefCell<(Vec<C>, Vec<C>)> = const { RefCell::new((Vec::new(), Vec::new())) };
}

/// All eigenvalues with a damping ratio up to `ratio`, or growing, both of each conjugate pair, by falling growth rate, each with a backward
/// error of at most `tolerance`. None where it is not certain that these are all.
pub fn eigenpairs(
    bodies: &ModalPair,
    contact: &LinearContact,
    ratio: f64,
    tolerance: f64,
) -> Result<Option<Vec<Eigenpair>>> {
    let Some(secular) = Secular::new(bodies, contact, ratio)? else { return Ok(None) };
    let Some(roots) = secular.roots() else { return Ok(None) };
    let inside: Vec<C> = roots.into_iter().filter(|v| secular.aside(*v) <= 0.0).collect();
    secular.pairs(&inside, &assemble(bodies, contact, None)?, tolerance)
}

/// The problem in what the contact sees.
struct Secular {
    modes: Modes,
    contact: Condensed,
    /// K and what makes it, along the frequencies of the modes.
    along: Interpolated,
    /// Relaxations of the contact by itself that are as little damped as what is listed.
    relaxations: Vec<C>,
    /// Angle of the ray that bounds what is listed.
    angle: f64,
}

/// The contact in what it sees: rows (λ `by_rate` + `at_rest`) (y, f) = 0 and forces on y, `[r, r + nf]`.
struct Condensed {
    rows: ContactRows,
    seen: usize,
}

impl Condensed {
    fn new(mut rows: ContactRows, seen: usize, rate: f64) -> Self {
        // Rows of one size.
        for i in 0..rows.by_rate.nrows() {
            let size = |j: usize| rows.by_rate[(i, j)].abs() * rate + rows.at_rest[(i, j)].abs();
            let largest = (0..rows.by_rate.ncols()).map(size).fold(0.0, f64::max);
            if largest > 0.0 {
                for j in 0..rows.by_rate.ncols() {
                    rows.by_rate[(i, j)] /= largest;
                    rows.at_rest[(i, j)] /= largest;
                }
            }
        }
        Self { rows, seen }
    }

    fn unknowns(&self) -> usize {
        self.rows.by_rate.nrows()
    }

    /// f as a function of y at λ, `[nf, r]`.
    fn follow(&self, lambda: C) -> Mat<C> {
        use faer::linalg::solvers::Solve;
        let (r, nf) = (self.seen, self.unknowns());
        let at = |i: usize, j: usize| lambda * self.rows.by_rate[(i, j)] + self.rows.at_rest[(i, j)];
        let matrix = Mat::from_fn(nf, nf, |i, j| at(i, r + j));
        matrix.partial_piv_lu().solve(Mat::from_fn(nf, r, |i, j| -at(i, j)))
    }

    /// Forces on y per y, `[r, r]`, where f follows y as `follow` says.
    fn stiffness(&self, follow: MatRef<'_, C>) -> Mat<C> {
        let r = self.seen;
        let own = Mat::from_fn(r, self.unknowns(), |i, j| C::from(self.rows.forces[(i, r + j)]));
        let mut k = own * follow;
        for j in 0..r {
            for i in 0..r {
                k[(i, j)] += self.rows.forces[(i, j)];
            }
        }
        k
    }

    /// Eigenvalues of the contact by itself, y = 0, with Im ≥ 0, whose angle is at most `angle`; none where they are not to be had.
    fn relaxations(&self, rate: f64, angle: f64) -> Option<Vec<C>> {
        let (r, nf) = (self.seen, self.unknowns());
        let part = |of: &Mat<f64>, f: f64| Mat::from_fn(nf, nf, |i, j| f * of[(i, r + j)]);
        let pencil = Pencil::of(part(&self.rows.at_rest, -1.0), part(&self.rows.by_rate, rate));
        let values = pencil.values().ok()?;
        Some(values.into_iter().map(|v| v * rate).filter(|v| v.im.atan2(v.re) <= angle).collect())
    }
}

impl Secular {
    /// None where the problem is not for this method.
    fn new(bodies: &ModalPair, contact: &LinearContact, ratio: f64) -> Result<Option<Self>> {
        if !(ratio <= LISTED) || contact.nodes.is_empty() {
            return Ok(None);
        }
        let angle = FRAC_PI_2 + ratio.asin();
        let within = FRAC_PI_2 + (ratio + MARGIN).asin();
        let Some(modes) = Modes::new(bodies, &places(contact), within) else { return Ok(None) };
        let [low, high] = modes.range();
        let rate = (low * high).sqrt();
        let view = View { modes: modes.shapes.as_ref(), residual: bodies.residual.as_ref() };
        let contact = Condensed::new(contact_rows(view, contact)?, modes.seen, rate);
        let Some(relaxations) = contact.relaxations(rate, angle) else { return Ok(None) };
        if relaxations.iter().any(|z| z.im <= REAL * z.norm()) {
            return Ok(None);
        }
        let reach = relaxations.iter().fold([low, high], |[a, b], z| [a.min(z.norm()), b.max(z.norm())]);
        let Some(along) = Interpolated::new(&contact, [0.8 * reach[0], 1.25 * reach[1]]) else { return Ok(None) };
        Ok(Some(Self { modes, contact, along, relaxations, angle }))
    }

    /// 1 − K G, by rows.
    fn matrix(&self, k: &[C], g: &[C]) -> Vec<C> {
        let r = self.modes.seen;
        let mut h = self.modes.times(k, g);
        h.iter_mut().for_each(|v| *v = -*v);
        (0..r).for_each(|i| h[i * r + i] += 1.0);
        h
    }

    /// The logarithmic derivative of det(1 − KG) P at each of `values`.
    fn slopes(&self, values: &[C]) -> Vec<C> {
        let r = self.modes.seen;
        let (g, by_g, poles) = self.modes.compliance(values);
        let (k, by_k) = self.along.stiffness(values);
        let of = |l: usize| {
            let part = |of: &[C]| -> Vec<C> { of[l * r * r..(l + 1) * r * r].to_vec() };
            let (k, g) = (part(&k), part(&g));
            let lu = Lu::new(self.matrix(&k, &g), r);
            let (a, b) = (self.modes.times(&part(&by_k), &g), self.modes.times(&k, &part(&by_g)));
            let change: Vec<C> = a.iter().zip(&b).map(|(a, b)| a + b).collect();
            poles[l] - lu.trace_of_solution(&change)
        };
        (0..values.len()).map(of).collect()
    }

    /// Roots with Im > 0, among them all inside the ray; none where that is not certain.
    fn roots(&self) -> Option<Vec<C>> {
        let before = LAST.with_borrow(|(of, roots)| (*of == self.modes.poles).then(|| roots.clone()));
        let anew = || self.modes.starts().into_iter().chain(self.relaxations.iter().copied()).collect();
        let starts = before.unwrap_or_else(anew);
        let mut roots = self.settled(Vec::new(), starts);
        for _ in 0..ROUNDS {
            let missing = self.missing(&roots)?;
            if missing == 0 {
                LAST.set((self.modes.poles.clone(), roots.clone()));
                return Some(roots);
            }
            // Some went to others outside. What is left is looked for with the roots that are known kept apart.
            let count = 2 * usize::try_from(missing).ok()? + 6;
            let [low, high] = self.modes.range();
            let place = |k: usize| low * (high / low).powf((k as f64 + 0.5) / count as f64);
            let more = (0..count).map(|k| C::from_polar(place(k), FRAC_PI_2 + 0.5 * (self.angle - FRAC_PI_2)));
            roots = self.settled(roots, more.collect());
        }
        None
    }

    /// The roots `known` and those that `starts` lead to.
    fn settled(&self, known: Vec<C>, starts: Vec<C>) -> Vec<C> {
        let first = known.len();
        let mut all = known;
        all.extend(starts);
        let mut moving: Vec<usize> = (first..all.len()).collect();
        for _ in 0..ITERATIONS {
            let values: Vec<C> = moving.iter().map(|&j| all[j]).collect();
            let mut moved = all.clone();
            let mut next = Vec::new();
            for (&j, slope) in moving.iter().zip(self.slopes(&values)) {
                let own = all[j];
                let mut others = (own - own.conj()).inv();
                for (_, other) in all.iter().enumerate().filter(|(k, _)| *k != j) {
                    others += (own - other).inv() + (own - other.conj()).inv();
                }
                let change = (slope - others).inv();
                // On a root, or on a pole that the contact does not see.
                if !change.is_finite() {
                    continue;
                }
                let size = own.norm();
                let change = change * (FAR * size / change.norm()).min(1.0);
                let to = own - change;
                moved[j] = if to.im < 0.0 { to.conj() } else { to };
                if change.norm() > SETTLED * size {
                    next.push(j);
                }
            }
            all = moved;
            moving = next;
            if moving.is_empty() {
                break;
            }
        }
        // Where poles and roots lie on either side of what is looked at, a start may have no root to go to.
        let good = |v: &C| v.im > REAL * v.norm() && self.along.covers(*v);
        let mut found: Vec<C> = Vec::new();
        for (j, v) in all.iter().enumerate() {
            let settled = j < first || (moving.binary_search(&j).is_err() && good(v));
            if settled && found.iter().all(|a| (a - v).norm() > APART * v.norm()) {
                found.push(*v);
            }
        }
        found
    }

    /// The poles of the modes and of the contact, and the `roots`, to be taken out, as many of these as of those.
    fn balanced(&self, roots: &[C]) -> [Vec<C>; 2] {
        let mut poles: Vec<C> = self.modes.poles.iter().chain(&self.relaxations).copied().collect();
        let mut roots = roots.to_vec();
        poles.sort_by(|a, b| self.aside(*a).total_cmp(&self.aside(*b)));
        // Poles outside the ray may stay, ...
        while poles.len() > roots.len() && poles.last().is_some_and(|p| self.aside(*p) > 0.0) {
            poles.pop();
        }
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

    /// The logarithm of det(1 − KG) with `poles` and `roots` divided out, at λ.
    fn rest(&self, roots: &[C], poles: &[C], lambda: C) -> C {
        let r = self.modes.seen;
        let (g, _, _) = self.modes.compliance(&[lambda]);
        let k = self.contact.stiffness(self.contact.follow(lambda).as_ref());
        let k: Vec<C> = (0..r * r).map(|i| k[(i % r, i / r)]).collect();
        let all = |of: &[C]| of.iter().map(|v| (lambda - v).ln() + (lambda - v.conj()).ln()).sum::<C>();
        Lu::new(self.matrix(&k, &g), r).log_determinant() + all(poles) - all(roots)
    }

    /// How many eigenvalues within the ray, both of each conjugate pair, are missing in `roots`; none where the count is not certain.
    fn missing(&self, roots: &[C]) -> Option<i64> {
        let [poles, roots] = self.balanced(roots);
        let [low, high] = self.modes.range().map(f64::ln);
        let at = |u: f64| self.rest(&roots, &poles, C::from_polar(u.exp(), self.angle));
        let even = |v: C| (v.im / PI - (v.im / PI).round()).abs() * PI < EVEN;
        let one = |v: C| wrapped(v.im).abs() < EVEN && v.re.abs() < EVEN;
        // Down to where it is real and up to where it is 1.
        let mut points = vec![(low, at(low))];
        let mut u = low;
        while u > low - BELOW[0] || !even(points[0].1) {
            u -= STEP;
            if u < low - BELOW[1] {
                return None;
            }
            points.insert(0, (u, at(u)));
        }
        u = low;
        while u < high + ABOVE[0] || !points.last().is_some_and(|p| one(p.1)) {
            u += STEP;
            if u > high + ABOVE[1] {
                return None;
            }
            points.push((u, at(u)));
        }
        // From 0, where it is real, to infinity, where it is 1: π less for each that is missing.
        Some((-turned(points, &at)? / PI).round() as i64)
    }

    /// The eigenpairs of `roots`, those of conjugates too.
    fn pairs(&self, roots: &[C], pencil: &Pencil, tolerance: f64) -> Result<Option<Vec<Eigenpair>>> {
        let (m, nf) = (self.modes.count(), self.contact.unknowns());
        let r = self.modes.seen;
        let (rate, force) = (pencil.scales.rate, pencil.scales.force);
        let (g, _, _) = self.modes.compliance(roots);
        let (k, _) = self.along.stiffness(roots);
        let forces: Vec<Vec<C>> = (0..roots.len())
            .map(|l| {
                let part = |of: &[C]| -> Vec<C> { of[l * r * r..(l + 1) * r * r].to_vec() };
                Lu::new(self.matrix(&part(&k), &part(&g)), r).null_vector()
            })
            .collect();
        let modal = self.modes.motions(roots, &forces);
        let own = self.along.follow(roots, &self.modes.seen_of(&modal));
        let mut vectors = Mat::<C>::zeros(2 * m + nf, roots.len());
        for (l, value) in roots.iter().enumerate() {
            for i in 0..m {
                vectors[(i, l)] = modal[(i, l)];
                vectors[(m + i, l)] = modal[(i, l)] * value / rate;
            }
            for i in 0..nf {
                vectors[(2 * m + i, l)] = own[(i, l)] / force;
            }
            let norm = vectors.col(l).norm_l2();
            vectors.col_mut(l).iter_mut().for_each(|v| *v /= norm);
        }
        let scaled: Vec<C> = roots.iter().map(|v| v / rate).collect();
        let norms = (pencil.a.norm_l2(), pencil.e.norm_l2());
        let mut pairs = Vec::new();
        for (l, residual) in pencil.residuals(&scaled, &vectors).into_iter().enumerate() {
            let backward_error = residual / (norms.0 + scaled[l].norm() * norms.1);
            if !(backward_error <= tolerance) {
                return Ok(None);
            }
            let x = |i: usize| vectors[(i, l)];
            let modal: Vec<C> = (0..m).map(x).collect();
            let tangential: Vec<C> = (2 * m..2 * m + nf).map(|i| x(i) * force).collect();
            let conjugate = |v: &[C]| v.iter().map(C::conj).collect();
            let other = (conjugate(&modal), conjugate(&tangential));
            pairs.push(Eigenpair { value: roots[l], modal, tangential, backward_error });
            pairs.push(Eigenpair { value: roots[l].conj(), modal: other.0, tangential: other.1, backward_error });
        }
        pairs.sort_by(|a, b| b.value.re.total_cmp(&a.value.re).then(b.value.im.total_cmp(&a.value.im)));
        Ok(Some(pairs))
    }
}

/// An angle in (−π, π].
fn wrapped(angle: f64) -> f64 {
    angle - 2.0 * PI * (angle / (2.0 * PI)).round()
}

/// By how much the phase of e^(`at`) turns from a real value before the first of `points` to 1 beyond the last; none where it is not certain.
fn turned(mut points: Vec<(f64, C)>, at: &dyn Fn(f64) -> C) -> Option<f64> {
    let step = |a: &(f64, C), b: &(f64, C)| C::new(b.1.re - a.1.re, wrapped(b.1.im - a.1.im));
    for _ in 0..=HALVINGS {
        if points.iter().any(|p| !p.1.is_finite()) {
            return None;
        }
        let steps: Vec<C> = points.windows(2).map(|w| step(&w[0], &w[1])).collect();
        // Per unit of u, so that steps of unlike length can be compared.
        let length = |i: usize| points[i + 1].0 - points[i].0;
        let slope = |i: usize| steps[i] / length(i);
        let smooth = |i: usize| {
            let bent = |j: usize| (slope(i) - slope(j)).norm() * length(i) <= SMOOTH[1];
            steps[i].norm() <= SMOOTH[0] && (i == 0 || bent(i - 1)) && (i + 1 == steps.len() || bent(i + 1))
        };
        let rough: Vec<usize> = (0..steps.len()).filter(|&i| !smooth(i)).collect();
        if rough.is_empty() {
            let (first, last) = (points.first()?.1.im, points.last()?.1.im);
            let before = first - PI * (first / PI).round();
            return Some(before + steps.iter().map(|s| s.im).sum::<f64>() - wrapped(last));
        }
        for &i in rough.iter().rev() {
            let u = 0.5 * (points[i].0 + points[i + 1].0);
            points.insert(i + 1, (u, at(u)));
        }
    }
    None
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
