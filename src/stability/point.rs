//! Stability with each contact as one point: the free modes of both bodies on Hertz' springs, and a law of total creep
//! forces.
//!
//! It is the reference for discretised contacts. With the means Ψ_n, Ψ_t of the modes over a contact, weighted by
//! its pressure, the gap changes by δg = Ψ_n q and the creep by δṡ = Ψ_t q̇ + V ∂xΨ_t q; so with the sum over the
//! contacts
//!
//! q̈ + C q̇ + K q = Σ (Ψ_nᵀ δP + Ψ_tᵀ δF),   δP = −k_H Ψ_n q,   δF = −D δṡ + (∂F/∂P) δP + (∂F/∂μ) δμ.
//!
//! A coefficient of friction that is remembered is one more unknown, dδμ/dt = −decay δμ + gain τ·δṡ. The local
//! compliance is all in the springs and in the law: what is left of the bodies' compliance without the modes is not
//! counted again within a contact, and is left out between contacts. Creepages other than those of translation stay as
//! they are.

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
    /// The contacts; none of one that is open.
    pub ellipses: Vec<Option<EllipticContact>>,
    /// For each of [`crate::contact::baseline::LAWS`].
    pub laws: Vec<LawSpectrum>,
}

/// Eigenvalues by one law.
pub struct LawSpectrum {
    /// Its place among the laws.
    pub law: usize,
    /// Friction (x, y) on body 1 at each contact, N; 0 at one that is open.
    pub forces: Vec<[f64; 2]>,
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
pub fn eigenpairs(bodies: &CoupledModel, contacts: &[PointContact], tolerance: f64) -> Result<Vec<Eigenpair>> {
    let m = bodies.omega.len();
    if m == 0 {
        return Err(Error::Job("analyses.stability.contact: no modes are kept; stability needs modes".into()));
    }
    let pencil = assemble(bodies, contacts);
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

/// A contact as the modes see it.
struct ContactModes<'a> {
    /// Ψ of (x, y, n), 1/√kg, `[m]` each.
    mean: [Vec<f64>; 3],
    /// V ∂xΨ of (x, y), 1/(√kg s), `[m]` each.
    carried: [Vec<f64>; 2],
    stiffness: f64,
    friction: &'a LinearForce,
}

impl<'a> ContactModes<'a> {
    fn new(bodies: &CoupledModel, contact: &'a PointContact) -> Self {
        let over = |list: &[(usize, f64)], c: usize, factor: f64| -> Vec<f64> {
            let of = |k: usize| list.iter().map(|&(node, share)| share * bodies.modes[(3 * node + c, k)]).sum::<f64>();
            (0..bodies.omega.len()).map(|k| factor * of(k)).collect()
        };
        Self {
            mean: [0, 1, 2].map(|c| over(&contact.place.mean, c, 1.0)),
            carried: [0, 1].map(|c| over(&contact.place.slope, c, contact.speed)),
            stiffness: contact.stiffness,
            friction: &contact.friction,
        }
    }

    /// Force on the mode `i` by D and a creep.
    fn rubbed(&self, i: usize, creep: [f64; 2]) -> f64 {
        let d = self.friction.resistance;
        -[0, 1].map(|c| self.mean[c][i] * (d[c][0] * creep[0] + d[c][1] * creep[1])).iter().sum::<f64>()
    }

    /// Stiffness of the mode `i` against the motion of the mode `j`, 1/s².
    fn stiffness(&self, i: usize, j: usize) -> f64 {
        let by_load = self.friction.by_load;
        let pressed = self.mean[2][i] + by_load[0] * self.mean[0][i] + by_load[1] * self.mean[1][i];
        pressed * self.stiffness * self.mean[2][j] - self.rubbed(i, [self.carried[0][j], self.carried[1][j]])
    }

    /// Force on each mode by a change of the coefficient of friction.
    fn by_friction(&self) -> Vec<f64> {
        let [x, y] = self.friction.by_friction;
        self.mean[0].iter().zip(&self.mean[1]).map(|(a, b)| a * x + b * y).collect()
    }
}

/// The matrix of (q, q̇, δμ of each contact that remembers).
fn assemble(bodies: &CoupledModel, contacts: &[PointContact]) -> ScaledPencil {
    let m = bodies.omega.len();
    let contacts: Vec<ContactModes> = contacts.iter().map(|contact| ContactModes::new(bodies, contact)).collect();
    let sum = |of: &dyn Fn(&ContactModes) -> f64| contacts.iter().map(of).sum::<f64>();
    let stiffness = Mat::from_fn(m, m, |i, j| bodies.stiffness.get(i, j) + sum(&|c| c.stiffness(i, j)));
    let norm = stiffness.norm_l2() / (m as f64).sqrt();
    let rate = if norm > 0.0 { norm.sqrt() } else { 1.0 };
    let remembering: Vec<_> = contacts.iter().filter_map(|c| Some((c, c.friction.memory.as_ref()?))).collect();
    let n = 2 * m + remembering.len();
    let mut a = Mat::<f64>::zeros(n, n);
    for i in 0..m {
        a[(i, m + i)] = 1.0;
        for j in 0..m {
            a[(m + i, j)] = -stiffness[(i, j)] / (rate * rate);
            let rubbed = sum(&|c| c.rubbed(i, [c.mean[0][j], c.mean[1][j]]));
            a[(m + i, m + j)] = (rubbed - bodies.damping.get(i, j)) / rate;
        }
    }
    // The unit of δμ makes what it does to the modes of the size of the stiffness.
    let by_friction: Vec<Vec<f64>> = remembering.iter().map(|(c, _)| c.by_friction()).collect();
    let reach = by_friction.iter().map(|by| by.iter().map(|f| f * f).sum::<f64>().sqrt()).fold(0.0, f64::max);
    let unit = if reach > 0.0 { rate * rate / reach } else { 1.0 };
    for (k, ((contact, memory), by_friction)) in remembering.iter().zip(&by_friction).enumerate() {
        let at = 2 * m + k;
        let [x, y] = memory.direction.map(|t| t * memory.relaxation.gain / (rate * unit));
        a[(at, at)] = -memory.relaxation.decay / rate;
        for j in 0..m {
            a[(m + j, at)] = by_friction[j] * unit / (rate * rate);
            a[(at, j)] = x * contact.carried[0][j] + y * contact.carried[1][j];
            a[(at, m + j)] = (x * contact.mean[0][j] + y * contact.mean[1][j]) * rate;
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
        eigenpairs(bodies, &[contact], 1e-9).unwrap().iter().map(|p| p.value).collect()
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

    /// Contacts that touch modes of their own have the eigenvalues that each has alone, with a memory of friction each;
    /// two at one place are one of twice the stiffness and twice the forces.
    #[test]
    fn several_contacts_are_added_up() {
        let law = |memory: f64| FrictionLaw::from(Exponential::new(0.4, 0.2, 0.3)).remembering(memory);
        let friction = |eta: f64, memory: f64| {
            LinearForce::new(shen_hedrick_elkins, &ellipse(), &lateral(eta), SPEED, &law(memory))
        };
        let (omega, psi): ([f64; 2], _) = ([3000.0, 5000.0], [[0.02, 0.05, 0.03], [-0.01, 0.04, 0.06]]);
        // Rows of two nodes, of which each mode moves one.
        let modes = Mat::from_fn(6, 2, |i, k| if i / 3 == k { psi[k][i % 3] } else { 0.0 });
        let compliance =
            Mat::from_fn(6, 6, |i, j| (0..2).map(|k| modes[(i, k)] * modes[(j, k)] / omega[k].powi(2)).sum());
        let lower = ReducedBody::new(omega.to_vec(), vec![2.0; 2], modes, compliance);
        let rigid = ReducedBody::new(vec![], vec![], Mat::zeros(6, 0), Mat::zeros(6, 6));
        let both = CoupledModel::new(&lower, &rigid).unwrap();
        let places = [0, 1].map(|node| Footprint { mean: vec![(node, 1.0)], slope: Vec::new() });
        let given = [(0.01, 1e-3), (-0.02, 4e-3)];
        let contacts: Vec<PointContact> = places
            .iter()
            .zip(given)
            .map(|(place, (eta, memory))| PointContact {
                place,
                stiffness: ellipse().normal_stiffness(),
                speed: SPEED,
                friction: friction(eta, memory),
            })
            .collect();
        let all: Vec<C> = eigenpairs(&both, &contacts, 1e-9).unwrap().iter().map(|p| p.value).collect();
        let alone =
            |k: usize| found(&body(&[omega[k]], 2.0, &[psi[k]], 0.0), &place(), friction(given[k].0, given[k].1));
        let each: Vec<C> = [0, 1].into_iter().flat_map(alone).collect();
        assert_eq!(all.len(), each.len());
        for value in each {
            let best = all.iter().min_by(|a, b| (*a - value).norm().total_cmp(&(*b - value).norm())).unwrap();
            near(*best, value, 1e-9, "each by itself");
        }
        // Twice the same contact.
        let one = body(&[omega[0]], 2.0, &[psi[0]], 0.0);
        let constant =
            || LinearForce::new(shen_hedrick_elkins, &ellipse(), &lateral(0.01), SPEED, &FrictionLaw::Constant(0.3));
        let here = place();
        let single = |factor: f64| {
            let f = constant();
            let friction = LinearForce { resistance: f.resistance.map(|r| r.map(|v| factor * v)), ..f };
            PointContact { place: &here, stiffness: factor * ellipse().normal_stiffness(), speed: SPEED, friction }
        };
        let [twice, double] = [vec![single(1.0), single(1.0)], vec![single(2.0)]]
            .map(|contacts| eigenpairs(&one, &contacts, 1e-9).unwrap()[0].value);
        near(twice, double, 1e-12, "twice the contact");
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
