//! One free mode on the rest, in closed form: what makes an eigenvalue grow.
//!
//! A free mode (or both of a pair) of angular frequency ω_k and damping c presses the contact by ψ_n and is driven by f = ψ_n − μτ·ψ_t per unit normal
//! force; everything else, the other modes of both bodies and what is left of the compliance, yields by H(ω) to that force and its friction. Then
//! λ² + cλ + ω_k² + κ/H = 0 with κ = ψ_n f, so that about
//!
//! σ = −c/2 + κ Im H/(2ω_k|H|²),   Δω = κ Re H/(2ω_k|H|²).
//!
//! At constant friction the mode grows only where κ < 0 (ψ_n and ψ_t so that friction takes more than the pressure gives) and H has a phase, which a
//! rail gives and a rigid counter-body does not. It follows from the linearised system of [`super::reduced`] with the contact taken as a point.

use super::reduced::{participation, Eigenpair};
use crate::contact::{LinearContact, Tangent};
use crate::model::ModalPair;
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// Frequencies this near to each other, relatively, are of one pair.
const PAIR: f64 = 1e-6;

/// What one free mode, or a pair, does on the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    /// The free mode with the largest share; its partner of the same frequency and body follows.
    pub modes: Vec<usize>,
    /// −c/2, the part of the growth rate that damping takes, 1/s: the mean of a pair.
    pub damping: f64,
    /// κ, 1/kg: the sum over a pair.
    pub coupling: f64,
    /// H at the frequency of the eigenvalue, m/N.
    pub compliance: C,
    /// The growth rate that these make, 1/s.
    pub growth_rate: f64,
}

/// The contact as a point: how its normal force is spread, and how displacements are averaged.
struct Point {
    /// (row of the normal, traction (x, y) per pressure) of the closed nodes.
    nodes: Vec<(usize, [f64; 2])>,
    /// Shares of the normal force, Σ = 1.
    force: Vec<f64>,
    /// Weights of the displacement, Σ = 1.
    motion: Vec<f64>,
    /// Compliance of what is left without modes, m/N.
    compliance: f64,
}

impl Point {
    fn new(bodies: &ModalPair, contact: &LinearContact) -> Result<Self> {
        let s = bodies.residual.as_ref();
        let nodes: Vec<(usize, [f64; 2])> =
            contact.nodes.iter().map(|n| (3 * n.node + 2, n.tangent.friction())).collect();
        let k = nodes.len();
        let local = Mat::from_fn(k, k, |i, j| {
            let (row, (column, t)) = (nodes[i].0, nodes[j]);
            s[(row, column)] + t[0] * s[(row, column - 2)] + t[1] * s[(row, column - 1)]
        });
        let spread = |matrix: Mat<f64>| -> Vec<f64> {
            matrix.partial_piv_lu().solve(Mat::from_fn(k, 1, |_, _| 1.0)).col(0).iter().copied().collect()
        };
        let (force, motion) = (spread(local.clone()), spread(local.transpose().to_owned()));
        let total: f64 = force.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return Err(Error::NotConverged(
                "criterion: the residual compliance of the closed nodes is not positive".into(),
            ));
        }
        let share = |v: Vec<f64>| v.into_iter().map(|v| v / total).collect();
        Ok(Self { nodes, force: share(force), motion: share(motion), compliance: 1.0 / total })
    }

    /// ψ_n and f of a free mode, 1/√kg.
    fn seen(&self, bodies: &ModalPair, k: usize) -> [f64; 2] {
        let psi = bodies.modes.col(k);
        let mut seen = [0.0; 2];
        for ((&(row, t), force), motion) in self.nodes.iter().zip(&self.force).zip(&self.motion) {
            seen[0] += motion * psi[row];
            seen[1] += force * (psi[row] + t[0] * psi[row - 2] + t[1] * psi[row - 1]);
        }
        seen
    }
}

/// The closed form for the `pairs` of bodies that slide all over the contact, in their order; none where part of it sticks.
pub fn criteria(bodies: &ModalPair, contact: &LinearContact, pairs: &[Eigenpair]) -> Result<Vec<Criterion>> {
    if contact.nodes.iter().any(|n| matches!(n.tangent, Tangent::Stick { .. })) || contact.nodes.is_empty() {
        return Ok(Vec::new());
    }
    let point = Point::new(bodies, contact)?;
    let seen: Vec<[f64; 2]> = (0..bodies.omega.len()).map(|k| point.seen(bodies, k)).collect();
    pairs.iter().map(|pair| of_pair(bodies, &seen, point.compliance, pair)).collect()
}

fn of_pair(bodies: &ModalPair, seen: &[[f64; 2]], local: f64, pair: &Eigenpair) -> Result<Criterion> {
    let m = bodies.omega.len();
    let share = participation(bodies, pair);
    let first = (0..m).max_by(|&a, &b| share[a].total_cmp(&share[b])).unwrap_or(0);
    let body = |k: usize| k < bodies.lower_modes;
    let near = |k: usize| (bodies.omega[k] - bodies.omega[first]).abs() <= PAIR * bodies.omega[first];
    let mut own: Vec<usize> = (0..m).filter(|&k| k == first || (body(k) == body(first) && near(k))).collect();
    own.sort_by_key(|&k| k != first);
    let rest: Vec<usize> = (0..m).filter(|k| !own.contains(k)).collect();
    let omega = pair.value.im.abs();

    let dynamic = |i: usize, j: usize| {
        let inertia = if i == j { omega * omega } else { 0.0 };
        C::new(bodies.stiffness.get(i, j) - inertia, omega * bodies.damping.get(i, j))
    };
    let matrix = Mat::from_fn(rest.len(), rest.len(), |a, b| dynamic(rest[a], rest[b]));
    let driven = Mat::from_fn(rest.len(), 1, |a, _| C::from(seen[rest[a]][1]));
    let moved = matrix.partial_piv_lu().solve(driven);
    let compliance = rest.iter().enumerate().map(|(a, &k)| moved[(a, 0)] * seen[k][0]).sum::<C>() + local;

    // λ² + Cλ + K + f ψ_nᵀ/H of the own modes, as a companion matrix in units of ω.
    let n = own.len();
    let companion = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => C::default(),
        (true, false) => C::from(f64::from(u8::from(i == j - n))),
        (false, true) => {
            let (a, b) = (own[i - n], own[j]);
            let coupled = C::from(seen[a][1] * seen[b][0]) / compliance;
            -(C::from(bodies.stiffness.get(a, b)) + coupled) / (omega * omega)
        }
        (false, false) => C::from(-bodies.damping.get(own[i - n], own[j - n]) / omega),
    });
    let values = companion.eigenvalues().map_err(|e| Error::NotConverged(format!("criterion: {e:?}")))?;
    let wanted = C::new(pair.value.re, omega) / omega;
    let nearest = values.into_iter().min_by(|a, b| (a - wanted).norm().total_cmp(&(b - wanted).norm()));
    Ok(Criterion {
        damping: -0.5 * own.iter().map(|&k| bodies.damping.get(k, k)).sum::<f64>() / n as f64,
        coupling: own.iter().map(|&k| seen[k][0] * seen[k][1]).sum(),
        compliance,
        growth_rate: nearest.map_or(f64::NAN, |v| v.re * omega),
        modes: own,
    })
}

#[cfg(test)]
mod tests {
    use super::super::reduced::eigenpairs;
    use super::*;
    use crate::body::ReducedBody;
    use crate::contact::{LinearNode, Slip};

    /// A wheel of one mode on a rail of one mode, at one contact that slides along y at constant friction 0.3; on either side of the rail's resonance
    /// and on a rail at rest.
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
            let pair = ModalPair::new(&rail, &wheel).unwrap();
            let all = eigenpairs(&pair, &contact, 1e-9).unwrap();
            let of_wheel: Vec<_> =
                all.into_iter().filter(|e| e.value.im > 0.0 && participation(&pair, e)[1] > 0.7).collect();
            let found = criteria(&pair, &contact, &of_wheel).unwrap();
            assert_eq!((found.len(), &found[0].modes[..]), (1, &[1usize][..]));
            let (c, grown) = (&found[0], of_wheel[0].growth_rate());
            let omega = of_wheel[0].value.im;
            let first_order = c.damping + c.coupling * c.compliance.im / (2.0 * 2200.0 * c.compliance.norm_sqr());
            assert!((c.growth_rate - grown).abs() < 0.03 * (grown - c.damping).abs(), "{c:?} {grown}");
            assert!((first_order - grown).abs() < 0.1 * (grown - c.damping).abs(), "{first_order} {grown} {omega}");
            assert!((c.damping + 0.25).abs() < 1e-15);
            signs.push((c.coupling.signum(), c.compliance.im.signum()));
        }
        // A rail's mode always lags: only the sign of κ decides; the wheel sees μτ·ψ_t of either sign.
        assert!(signs.iter().all(|s| s.1 < 0.0) && signs[0].0 == signs[1].0, "{signs:?}");
    }
}
