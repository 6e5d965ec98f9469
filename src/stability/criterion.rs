//! One free mode on the rest, in closed form: what makes an eigenvalue grow.
//!
//! A free mode (or both of a pair) of angular frequency ω_k and damping c presses the contact by ψ_n and is driven by f = ψ_n − μτ·ψ_t per unit normal
//! force; everything else, the other modes of both bodies and what is left of the compliance, yields by H(ω) to that force and its friction. Then
//! λ² + cλ + ω_k² + κ/H = 0 with κ = ψ_n f, so that about
//!
//! σ = −c/2 + κ Im H/(2ω_k|H|²),   Δω = κ Re H/(2ω_k|H|²).
//!
//! At constant friction the mode grows only where κ < 0 (ψ_n and ψ_t so that friction takes more than the pressure gives) and H has a phase, which a
//! rail gives and a rigid counter-body does not. Motion across the sliding turns the friction and so is damped by c_s = Σ μp/|ṡ|: a second row with the
//! creep u_s + f_s/(λc_s), which takes from what κ gives. It follows from the linearised system of [`super::reduced`] with the contact taken as a point.

use super::reduced::{participation, Eigenpair};
use crate::contact::{LinearContact, Slip, Tangent};
use crate::model::ModalPair;
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// Frequencies this near to each other, relatively, are of one pair.
const PAIR: f64 = 1e-6;

/// Eigenvalues whose imaginary part is less than this part of them do not oscillate.
const REAL: f64 = 1e-9;

/// What one free mode, or a pair, does on the rest. Of an eigenvalue that does not oscillate, as friction that falls steeply has them, it is not a number
/// but for the mode and its damping.
#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    /// The free mode with the largest share; its partner of the same frequency and body follows.
    pub modes: Vec<usize>,
    /// −c/2, the part of the growth rate that damping takes, 1/s: the mean of a pair.
    pub damping: f64,
    /// What motion across the sliding takes of the growth rate, 1/s.
    pub across: f64,
    /// κ, 1/kg: the sum over a pair.
    pub coupling: f64,
    /// H at the frequency of the eigenvalue, m/N.
    pub compliance: C,
    /// The growth rate that all these make, 1/s.
    pub growth_rate: f64,
}

/// A closed node of the contact taken as a point.
struct Node {
    /// Row of its normal; those of x and y come before it.
    row: usize,
    /// Traction (x, y) per pressure.
    friction: [f64; 2],
    /// Direction across the sliding.
    across: [f64; 2],
    /// Share of the normal force.
    force: f64,
    /// Weight of the displacement along the normal.
    motion: f64,
}

/// The contact as a point: forces along the normal with their friction, and across the sliding.
struct Point {
    nodes: Vec<Node>,
    /// Compliance of what is left without modes: (normal, across) by both forces, m/N.
    compliance: [[f64; 2]; 2],
    /// c_s, N·s/m.
    creep: f64,
}

/// What a point sees of a free mode, 1/√kg: the motion along the normal and across, and the work of both forces on it.
#[derive(Clone, Copy)]
struct Seen {
    motion: [f64; 2],
    work: [f64; 2],
}

impl Point {
    /// None where the contact does not yield by itself.
    fn new(bodies: &ModalPair, slips: &[(usize, &Slip)]) -> Option<Self> {
        let s = bodies.residual.as_ref();
        let mut nodes: Vec<Node> = Vec::new();
        for &(node, slip) in slips {
            let [x, y] = slip.direction;
            let friction = slip.direction.map(|t| -slip.friction * t);
            nodes.push(Node { row: 3 * node + 2, friction, across: [-y, x], force: 0.0, motion: 0.0 });
        }
        // Displacement at a row by tractions and a pressure at a node.
        let by = |row: usize, n: &Node, [x, y]: [f64; 2], p: f64| {
            x * s[(row, n.row - 2)] + y * s[(row, n.row - 1)] + p * s[(row, n.row)]
        };
        let k = nodes.len();
        let local = Mat::from_fn(k, k, |i, j| by(nodes[i].row, &nodes[j], nodes[j].friction, 1.0));
        let spread = |matrix: Mat<f64>| -> Vec<f64> {
            matrix.partial_piv_lu().solve(Mat::from_fn(k, 1, |_, _| 1.0)).col(0).iter().copied().collect()
        };
        let (force, motion) = (spread(local.clone()), spread(local.transpose().to_owned()));
        let total: f64 = force.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        for (n, (force, motion)) in nodes.iter_mut().zip(force.into_iter().zip(motion)) {
            (n.force, n.motion) = (force / total, motion / total);
        }
        let along = |i: &Node, n: &Node, t: [f64; 2], p: f64| {
            i.across[0] * by(i.row - 2, n, t, p) + i.across[1] * by(i.row - 1, n, t, p)
        };
        let sum = |of: &dyn Fn(&Node, &Node) -> f64| -> f64 {
            nodes.iter().map(|i| nodes.iter().map(|j| j.force * of(i, j)).sum::<f64>()).sum()
        };
        let compliance = [
            [1.0 / total, sum(&|i, j| i.motion * by(i.row, j, j.across, 0.0))],
            [sum(&|i, j| i.force * along(i, j, j.friction, 1.0)), sum(&|i, j| i.force * along(i, j, j.across, 0.0))],
        ];
        let creep = slips.iter().map(|(_, s)| s.across[1] / s.across[0]).sum();
        Some(Self { nodes, compliance, creep })
    }

    fn seen(&self, bodies: &ModalPair, k: usize) -> Seen {
        let psi = bodies.modes.col(k);
        let mut seen = Seen { motion: [0.0; 2], work: [0.0; 2] };
        for n in &self.nodes {
            let along = |[x, y]: [f64; 2]| x * psi[n.row - 2] + y * psi[n.row - 1];
            seen.motion[0] += n.motion * psi[n.row];
            seen.work[0] += n.force * (psi[n.row] + along(n.friction));
            seen.motion[1] += n.force * along(n.across);
        }
        seen.work[1] = seen.motion[1];
        seen
    }
}

/// The closed form for the `pairs` of bodies that slide all over the contact, in their order; none where part of it sticks, or where it does not yield by
/// itself.
pub fn criteria(bodies: &ModalPair, contact: &LinearContact, pairs: &[Eigenpair]) -> Result<Vec<Criterion>> {
    let mut slips = Vec::new();
    for n in &contact.nodes {
        match &n.tangent {
            Tangent::Slip(slip) => slips.push((n.node, slip)),
            _ => return Ok(Vec::new()),
        }
    }
    if slips.is_empty() {
        return Ok(Vec::new());
    }
    let Some(point) = Point::new(bodies, &slips) else { return Ok(Vec::new()) };
    let seen: Vec<Seen> = (0..bodies.omega.len()).map(|k| point.seen(bodies, k)).collect();
    pairs.iter().map(|pair| of_pair(bodies, &point, &seen, pair)).collect()
}

fn of_pair(bodies: &ModalPair, point: &Point, seen: &[Seen], pair: &Eigenpair) -> Result<Criterion> {
    let m = bodies.omega.len();
    let share = participation(bodies, pair);
    let first = (0..m).max_by(|&a, &b| share[a].total_cmp(&share[b])).unwrap_or(0);
    let body = |k: usize| k < bodies.lower_modes;
    let near = |k: usize| (bodies.omega[k] - bodies.omega[first]).abs() <= PAIR * bodies.omega[first];
    let mut own: Vec<usize> = (0..m).filter(|&k| k == first || (body(k) == body(first) && near(k))).collect();
    own.sort_by_key(|&k| k != first);
    let rest: Vec<usize> = (0..m).filter(|k| !own.contains(k)).collect();
    let omega = pair.value.im.abs();
    let damping = -0.5 * own.iter().map(|&k| bodies.damping.get(k, k)).sum::<f64>() / own.len() as f64;
    if omega <= REAL * pair.value.norm() {
        let none = f64::NAN;
        let compliance = C::new(none, none);
        return Ok(Criterion { modes: own, damping, across: none, coupling: none, compliance, growth_rate: none });
    }

    let dynamic = |i: usize, j: usize| {
        let inertia = if i == j { omega * omega } else { 0.0 };
        C::new(bodies.stiffness.get(i, j) - inertia, omega * bodies.damping.get(i, j))
    };
    let matrix = Mat::from_fn(rest.len(), rest.len(), |a, b| dynamic(rest[a], rest[b]));
    let driven = Mat::from_fn(rest.len(), 2, |a, c| C::from(seen[rest[a]].work[c]));
    let moved = matrix.partial_piv_lu().solve(driven);
    let mut h = [[C::default(); 2]; 2];
    for (r, row) in h.iter_mut().enumerate() {
        for (c, v) in row.iter_mut().enumerate() {
            let modal = rest.iter().enumerate().map(|(a, &k)| moved[(a, c)] * seen[k].motion[r]).sum::<C>();
            *v = modal + point.compliance[r][c];
        }
    }
    // Without friction that turns nothing is done across.
    let creep = if point.creep > 0.0 { (C::i() * omega * point.creep).inv() } else { C::from(f64::INFINITY) };
    let alone = [[h[0][0].inv(), C::default()], [C::default(); 2]];
    let (a, b, c, d) = (h[0][0], h[0][1], h[1][0], h[1][1] + creep);
    let determinant = a * d - b * c;
    let both = match determinant.is_finite() {
        true => [[d / determinant, -b / determinant], [-c / determinant, a / determinant]],
        false => alone,
    };
    let growth = |inverse: &[[C; 2]; 2]| grown(bodies, seen, &own, inverse, pair.value);
    let growth_rate = growth(&both)?;
    Ok(Criterion {
        damping,
        across: growth_rate - growth(&alone)?,
        coupling: own.iter().map(|&k| seen[k].motion[0] * seen[k].work[0]).sum(),
        compliance: h[0][0],
        growth_rate,
        modes: own,
    })
}

/// Growth rate of the modes `own` on a contact with the compliance's `inverse`: that of the eigenvalue nearest to `value`.
fn grown(bodies: &ModalPair, seen: &[Seen], own: &[usize], inverse: &[[C; 2]; 2], value: C) -> Result<f64> {
    let (n, omega) = (own.len(), value.im.abs());
    let coupled = |a: &Seen, b: &Seen| -> C {
        (0..2).map(|r| (0..2).map(|c| inverse[r][c] * a.work[r] * b.motion[c]).sum::<C>()).sum()
    };
    // λ² + Cλ + K + (work)ᵀH⁻¹(motion), as a companion matrix in units of ω.
    let companion = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => C::default(),
        (true, false) => C::from(f64::from(u8::from(i == j - n))),
        (false, true) => {
            let (a, b) = (own[i - n], own[j]);
            -(coupled(&seen[a], &seen[b]) + bodies.stiffness.get(a, b)) / (omega * omega)
        }
        (false, false) => C::from(-bodies.damping.get(own[i - n], own[j - n]) / omega),
    });
    let values = companion.eigenvalues().map_err(|e| Error::NotConverged(format!("criterion: {e:?}")))?;
    let wanted = C::new(value.re, omega) / omega;
    let nearest = values.into_iter().min_by(|a, b| (a - wanted).norm().total_cmp(&(b - wanted).norm()));
    Ok(nearest.map_or(f64::NAN, |v| v.re * omega))
}

#[cfg(test)]
mod tests {
    use super::super::reduced::eigenpairs;
    use super::*;
    use crate::body::ReducedBody;
    use crate::contact::LinearNode;

    /// A mode that friction which falls drives harder than it can oscillate: two real eigenvalues, of which there is no such criterion.
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
        let pair = ModalPair::new(&rigid, &body).unwrap();
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
        for c in criteria(&pair, &contact, &growing).unwrap() {
            assert!(c.modes == [0] && c.damping == -0.25 && c.growth_rate.is_nan() && c.coupling.is_nan(), "{c:?}");
        }
    }

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
            assert!((c.damping + 0.25).abs() < 1e-15 && c.across.abs() < 1e-12, "{c:?}");
            signs.push((c.coupling.signum(), c.compliance.im.signum()));
        }
        // A rail's mode always lags: only the sign of κ decides; the wheel sees μτ·ψ_t of either sign.
        assert!(signs.iter().all(|s| s.1 < 0.0) && signs[0].0 == signs[1].0, "{signs:?}");
    }
}
