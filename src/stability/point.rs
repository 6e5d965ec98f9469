//! Stability with a contact of one point: the free modes of both bodies on Hertz' spring, and a law of total creep
//! forces.
//!
//! It is the reference for a discretised contact. With the means Ψ_n, Ψ_t of the modes over the contact, weighted by
//! its pressure, the gap changes by δg = Ψ_n q and the creep by δṡ = Ψ_t q̇ + V ∂xΨ_t q; so
//!
//! q̈ + C q̇ + K q = Ψ_nᵀ δP + Ψ_tᵀ δF,   δP = −k_H Ψ_n q,   δF = −D δṡ + (∂F/∂P) δP + (∂F/∂μ) δμ.
//!
//! A coefficient of friction that is remembered is one more unknown, dδμ/dt = −decay δμ + gain τ·δṡ. The local
//! compliance is all in the spring and in the law: what is left of the bodies' compliance without the modes is not
//! counted again. Creepages other than those of translation stay as they are.

use super::reduced::{Eigenpair, Root, ScaledPencil, Scales};
use crate::contact::baseline::{EllipticContact, Footprint, LinearForce};
use crate::model::CoupledModel;
use crate::{Error, Result};
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// Least |q₁ᴴq₂|²/(|q₁|²|q₂|²) of two modes that are the same.
const ALIKE: f64 = 0.5;

/// A contact of one point about a steady state.
pub struct PointContact<'a> {
    /// Position on the interface.
    pub place: &'a Footprint,
    /// Hertz' stiffness k_H, N/m.
    pub stiffness: f64,
    /// Rolling speed V, m/s.
    pub speed: f64,
    /// Friction.
    pub friction: LinearForce,
}

/// Eigenvalues by laws of point contact.
pub struct Comparison {
    /// The contact.
    pub ellipse: EllipticContact,
    /// For each of [`crate::contact::baseline::LAWS`].
    pub laws: Vec<LawSpectrum>,
}

/// Eigenvalues by one law.
pub struct LawSpectrum {
    /// Its place among the laws.
    pub law: usize,
    /// Friction (x, y) on body 1, N.
    pub force: [f64; 2],
    /// Listed eigenpairs, by falling growth rate.
    pub eigenpairs: Vec<Eigenpair>,
    /// For each its place among those of the discretised contact.
    pub partners: Vec<Option<usize>>,
}

impl LawSpectrum {
    /// The eigenvalue that is the partner of number `place` of the discretised contact, 1/s.
    pub fn partner(&self, place: usize) -> Option<C> {
        let at = self.partners.iter().position(|p| *p == Some(place));
        at.map(|i| self.eigenpairs[i].value)
    }
}

/// Eigenvalues with Im λ ≥ 0 by falling growth rate; each pair's backward error is at most `tolerance`, or the result
/// is an error.
pub fn eigenpairs(bodies: &CoupledModel, contact: &PointContact, tolerance: f64) -> Result<Vec<Eigenpair>> {
    let m = bodies.omega.len();
    if m == 0 {
        return Err(Error::Job("analyses.stability.contact: no modes are kept; stability needs modes".into()));
    }
    let pencil = assemble(bodies, contact);
    let of = |Root { value, vector, backward_error }: Root| Eigenpair {
        value: value * pencil.scales.rate,
        modal: vector[..m].to_vec(),
        tangential: Vec::new(),
        backward_error,
    };
    let mut pairs: Vec<Eigenpair> = pencil.roots(tolerance)?.into_iter().map(of).collect();
    pairs.sort_by(|a, b| b.value.re.total_cmp(&a.value.re).then(b.value.im.total_cmp(&a.value.im)));
    Ok(pairs)
}

/// The matrix of (q, q̇, δμ).
fn assemble(bodies: &CoupledModel, contact: &PointContact) -> ScaledPencil {
    let m = bodies.omega.len();
    let over = |list: &[(usize, f64)], c: usize, k: usize| -> f64 {
        list.iter().map(|&(node, share)| share * bodies.modes[(3 * node + c, k)]).sum()
    };
    let mean: [Vec<f64>; 3] = [0, 1, 2].map(|c| (0..m).map(|k| over(&contact.place.mean, c, k)).collect());
    let carried: [Vec<f64>; 2] =
        [0, 1].map(|c| (0..m).map(|k| contact.speed * over(&contact.place.slope, c, k)).collect());
    let LinearForce { resistance, by_load, by_friction, memory, .. } = &contact.friction;
    // Modal force per δP, and per creep along x and y.
    let pressed = |i: usize| mean[2][i] + by_load[0] * mean[0][i] + by_load[1] * mean[1][i];
    let rubbed = |i: usize, c: usize| -(mean[0][i] * resistance[0][c] + mean[1][i] * resistance[1][c]);
    let forces = |i: usize, motion: [f64; 2]| rubbed(i, 0) * motion[0] + rubbed(i, 1) * motion[1];
    let stiffness = Mat::from_fn(m, m, |i, j| {
        bodies.stiffness.get(i, j) + pressed(i) * contact.stiffness * mean[2][j]
            - forces(i, [carried[0][j], carried[1][j]])
    });
    let norm = stiffness.norm_l2() / (m as f64).sqrt();
    let rate = if norm > 0.0 { norm.sqrt() } else { 1.0 };
    let n = 2 * m + usize::from(memory.is_some());
    let mut a = Mat::<f64>::zeros(n, n);
    for i in 0..m {
        a[(i, m + i)] = 1.0;
        for j in 0..m {
            a[(m + i, j)] = -stiffness[(i, j)] / (rate * rate);
            a[(m + i, m + j)] = (forces(i, [mean[0][j], mean[1][j]]) - bodies.damping.get(i, j)) / rate;
        }
    }
    // The unit of δμ makes what it does to the modes of the size of the stiffness.
    let mut unit = 1.0;
    if let Some(memory) = memory {
        let by_friction: Vec<f64> = (0..m).map(|i| mean[0][i] * by_friction[0] + mean[1][i] * by_friction[1]).collect();
        let reach = by_friction.iter().map(|f| f * f).sum::<f64>().sqrt();
        unit = if reach > 0.0 { rate * rate / reach } else { 1.0 };
        let [x, y] = memory.direction.map(|t| t * memory.relaxation.gain / (rate * unit));
        a[(2 * m, 2 * m)] = -memory.relaxation.decay / rate;
        for j in 0..m {
            a[(m + j, 2 * m)] = by_friction[j] * unit / (rate * rate);
            a[(2 * m, j)] = x * carried[0][j] + y * carried[1][j];
            a[(2 * m, m + j)] = (x * mean[0][j] + y * mean[1][j]) * rate;
        }
    }
    ScaledPencil { a, e: Mat::identity(n, n), scales: Scales { rate, force: unit, rows: Vec::new() }, parts: None }
}

/// For each of `found` the place of its partner in `others`, the mode that moves alike: each has one at most, the
/// nearest ones first.
pub fn partners(found: &[Eigenpair], others: &[Eigenpair]) -> Vec<Option<usize>> {
    let square = |q: &[C]| q.iter().map(C::norm_sqr).sum::<f64>();
    let alike = |a: &Eigenpair, b: &Eigenpair| {
        let product: C = a.modal.iter().zip(&b.modal).map(|(a, b)| a.conj() * b).sum();
        product.norm_sqr() / (square(&a.modal) * square(&b.modal))
    };
    let mut all: Vec<(f64, usize, usize)> = Vec::new();
    for (i, a) in found.iter().enumerate() {
        all.extend(others.iter().enumerate().map(|(j, b)| (alike(a, b), i, j)).filter(|c| c.0 >= ALIKE));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut partners, mut taken) = (vec![None; found.len()], vec![false; others.len()]);
    for (_, i, j) in all {
        if partners[i].is_none() && !taken[j] {
            (partners[i], taken[j]) = (Some(j), true);
        }
    }
    partners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::ReducedBody;
    use crate::contact::baseline::{linear, shen_hedrick_elkins, Coefficients};
    use crate::contact::{ContactCreepage, LinearContact, LinearMemory, LinearNode, Slip, Tangent};
    use crate::friction::{Exponential, FrictionLaw};
    use crate::stability::reduced;

    const SPEED: f64 = 10.0;

    fn ellipse() -> EllipticContact {
        let kalker = Coefficients { longitudinal: 4.1, lateral: 3.7, spin: 1.5 };
        EllipticContact { a: 5e-3, b: 4e-3, load: 7e4, friction: 0.3, shear: 8e10, plane: 1.1e11, kalker }
    }

    /// Modes (x, y, n) at one node on a rigid counter-body, with the residual compliance `local` along the normal.
    fn body(omega: &[f64], damping: f64, modes: &[[f64; 3]], local: f64) -> CoupledModel {
        let m = omega.len();
        let rows = Mat::from_fn(3, m, |i, k| modes[k][i]);
        let compliance = Mat::from_fn(3, 3, |i, j| {
            let own = if (i, j) == (2, 2) { local } else { 0.0 };
            let modal = |k: usize| if omega[k] > 0.0 { modes[k][i] * modes[k][j] / omega[k].powi(2) } else { 0.0 };
            own + (0..m).map(modal).sum::<f64>()
        });
        let lower = ReducedBody::new(omega.to_vec(), vec![damping; m], rows, compliance);
        let rigid = ReducedBody::new(vec![], vec![], Mat::zeros(3, 0), Mat::zeros(3, 3));
        CoupledModel::new(&lower, &rigid).unwrap()
    }

    fn place() -> Footprint {
        Footprint { mean: vec![(0, 1.0)], slope: Vec::new() }
    }

    fn lateral(lateral: f64) -> ContactCreepage {
        ContactCreepage { longitudinal: 0.0, lateral, spin: 0.0 }
    }

    fn found(bodies: &CoupledModel, place: &Footprint, friction: LinearForce) -> Vec<C> {
        let contact = PointContact { place, stiffness: ellipse().normal_stiffness(), speed: SPEED, friction };
        eigenpairs(bodies, &contact, 1e-9).unwrap().iter().map(|p| p.value).collect()
    }

    fn near(a: C, b: C, relative: f64, what: &str) {
        assert!((a - b).norm() < relative * b.norm(), "{what}: {a}, expected {b}");
    }

    /// One mode: λ² + (c + ψ·Dψ) λ + ω² + k ψ_n (ψ_n + F′·ψ_t) = 0, by each law and creepage, with F′ = ∂F/∂P. Along
    /// the creep the slope of a law that saturates damps; a falling coefficient feeds; where the mode presses as it
    /// slides, the spring's force grows or falls with friction.
    #[test]
    fn one_mode_in_closed_form() {
        let (omega, c, psi): (f64, f64, [f64; 3]) = (4000.0, 3.0, [0.02, 0.05, 0.03]);
        let bodies = body(&[omega], c, &[psi], 0.0);
        let constant = FrictionLaw::Constant(0.3);
        for (law, eta) in [
            (linear as fn(&EllipticContact, &ContactCreepage) -> [f64; 2], 0.001),
            (shen_hedrick_elkins, 0.004),
            (shen_hedrick_elkins, -0.03),
        ] {
            let f = LinearForce::new(law, &ellipse(), &lateral(eta), SPEED, &constant);
            let d = f.resistance;
            let work = |u: [f64; 3], r: [f64; 2]| u[0] * r[0] + u[1] * r[1];
            let damping = c + work(psi, [0, 1].map(|i| d[i][0] * psi[0] + d[i][1] * psi[1]));
            let stiffness = omega * omega + ellipse().normal_stiffness() * psi[2] * (psi[2] + work(psi, f.by_load));
            let want = C::new(-0.5 * damping, (stiffness - 0.25 * damping * damping).sqrt());
            near(found(&bodies, &place(), f)[0], want, 1e-11, "one mode");
            assert!(damping > c, "creep damps");
        }
    }

    /// Without slip stiffness the bodies only lean on the spring; with very much of it they cannot slip: the limits
    /// of the linear law.
    #[test]
    fn the_linear_law_has_its_limits() {
        let modes = [[0.0, 0.05, 0.03], [0.0, -0.04, 0.06]];
        let (omega, k): ([f64; 2], f64) = ([3000.0, 5000.0], ellipse().normal_stiffness());
        let bodies = body(&omega, 0.0, &modes, 0.0);
        let law = |stiff: f64| {
            let f = LinearForce::new(linear, &ellipse(), &lateral(0.0), SPEED, &FrictionLaw::Constant(0.3));
            LinearForce { resistance: f.resistance.map(|r| r.map(|v| stiff * v)), ..f }
        };
        // K + k ψ_n ψ_nᵀ of two modes by the quadratic formula.
        let entry = |i: usize, j: usize| (if i == j { omega[i].powi(2) } else { 0.0 }) + k * modes[i][2] * modes[j][2];
        let (mean, half) = (0.5 * (entry(0, 0) + entry(1, 1)), 0.5 * (entry(0, 0) - entry(1, 1)));
        let root = half.hypot(entry(0, 1));
        let all = found(&bodies, &place(), law(0.0));
        for want in [(mean - root).sqrt(), (mean + root).sqrt()] {
            let best = all.iter().min_by(|a, b| (a.im - want).abs().total_cmp(&(b.im - want).abs())).unwrap();
            assert!((best.im - want).abs() < 1e-9 * want && best.re.abs() < 1e-9 * want, "{best} {want}");
        }
        // Held along y only the motion with ψ_t·q = 0 is left.
        let q = [0.04, 0.05].map(|v: f64| v / 0.04f64.hypot(0.05));
        let held = (0..2).map(|i| (0..2).map(|j| q[i] * entry(i, j) * q[j]).sum::<f64>()).sum::<f64>().sqrt();
        let stuck = found(&bodies, &place(), law(1e6));
        assert!(
            stuck.iter().any(|l| (l.im - held).abs() < 1e-4 * held && l.re.abs() < 1e-3 * held),
            "{stuck:?} {held}"
        );
    }

    /// In full sliding with Coulomb's law the point is the discretised contact of one node whose compliance is that
    /// of the spring, with the signs of all couplings, for either direction, a constant coefficient and one that
    /// falls and is remembered.
    #[test]
    fn full_sliding_is_that_of_one_node() {
        let coulomb = |e: &EllipticContact, c: &ContactCreepage| {
            let v = c.longitudinal.hypot(c.lateral);
            [c.longitudinal, c.lateral].map(|c| -e.friction * e.load * c / v)
        };
        let modes = [[0.03, 0.05, 0.03], [0.01, -0.04, 0.06], [-0.05, 0.02, 0.02]];
        let bodies = body(&[3000.0, 3100.0, 7000.0], 2.0, &modes, 1.0 / ellipse().normal_stiffness());
        let falling = FrictionLaw::from(Exponential::new(0.4, 0.2, 0.3)).remembering(2e-4);
        for law in [FrictionLaw::Constant(0.4), falling] {
            for (xi, eta) in [(0.0, 0.02), (0.0, -0.02), (0.01, -0.015)] {
                let creepage = ContactCreepage { longitudinal: xi, lateral: eta, spin: 0.0 };
                let velocity = SPEED * f64::hypot(xi, eta);
                let direction = [xi, eta].map(|c| c * SPEED / velocity);
                let slip = Slip::steady(ellipse().load, direction, velocity, law.coefficient(velocity), 0.0);
                let node = LinearNode { node: 0, tangent: Tangent::Slip(slip), convection: Vec::new() };
                let memory = LinearMemory::at_a_point(&law, 0, direction, ellipse().load, velocity);
                let contact = LinearContact {
                    nodes: vec![node],
                    memory: memory.into_iter().collect(),
                    ..LinearContact::default()
                };
                let want = reduced::eigenpairs(&bodies, &contact, 1e-10).unwrap();
                let got = found(&bodies, &place(), LinearForce::new(coulomb, &ellipse(), &creepage, SPEED, &law));
                let upper: Vec<C> = want.iter().map(|p| p.value).filter(|v| v.im >= 0.0).collect();
                assert_eq!(got.len(), upper.len());
                got.iter().zip(upper).for_each(|(a, b)| near(*a, b, 1e-7, "full sliding"));
            }
        }
    }

    /// A mass on a belt: far beyond the memory's frequency a falling coefficient feeds by half its slope times the
    /// load over the mass.
    #[test]
    fn a_mass_on_a_belt_grows_with_the_slope() {
        let (omega, c, psi, eta): (f64, f64, f64, f64) = (300.0, 0.2, 0.1, 0.05);
        let law = FrictionLaw::from(Exponential::new(0.4, 0.2, 0.3)).remembering(1e-9);
        let f = LinearForce::new(shen_hedrick_elkins, &ellipse(), &lateral(eta), SPEED, &law);
        let got = found(&body(&[omega], c, &[[0.0, psi, 0.0]], 0.0), &place(), f)[0];
        let want = -0.5 * c - 0.5 * psi * psi * ellipse().load * law.slope(SPEED * eta);
        assert!(want > 0.0 && (got.re / want - 1.0).abs() < 1e-4, "{got}, expected {want}");
    }

    /// The material that the bodies carry through the contact: V ∂xΨ_t makes creep of displacement, as a rate does.
    #[test]
    fn material_is_carried_through() {
        let (omega, psi, slope): (f64, f64, f64) = (4000.0, 0.05, 2.0);
        let modes = Mat::from_fn(6, 1, |i, _| {
            if i == 1 {
                psi
            } else if i == 4 {
                psi + slope * 1e-3
            } else {
                0.0
            }
        });
        let compliance = Mat::from_fn(6, 6, |i, j| modes[(i, 0)] * modes[(j, 0)] / omega.powi(2));
        let lower = ReducedBody::new(vec![omega], vec![0.0], modes, compliance);
        let rigid = ReducedBody::new(vec![], vec![], Mat::zeros(6, 0), Mat::zeros(6, 6));
        let bodies = CoupledModel::new(&lower, &rigid).unwrap();
        let place = Footprint { mean: vec![(0, 1.0)], slope: vec![(0, -1e3), (1, 1e3)] };
        let f = LinearForce::new(linear, &ellipse(), &lateral(0.0), SPEED, &FrictionLaw::Constant(0.3));
        let d = f.resistance[1][1];
        let damping = psi * psi * d;
        let want = C::new(-0.5 * damping, (omega * omega + psi * d * SPEED * slope - 0.25 * damping * damping).sqrt());
        near(found(&bodies, &place, f)[0], want, 1e-9, "carried");
    }

    #[test]
    fn modes_find_their_partners() {
        let pair = |value: f64, q: [f64; 2]| Eigenpair {
            value: C::new(value, 1.0),
            modal: q.map(|q| C::new(0.0, q)).to_vec(),
            tangential: Vec::new(),
            backward_error: 0.0,
        };
        let ours = [pair(3.0, [1.0, 0.1]), pair(2.0, [0.9, 0.3]), pair(1.0, [0.1, 1.0])];
        let others = [pair(5.0, [0.0, 1.0]), pair(4.0, [1.0, 0.0])];
        assert_eq!(partners(&ours, &others), [Some(1), None, Some(0)]);
    }
}
