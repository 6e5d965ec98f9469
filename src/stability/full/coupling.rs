//! The contact rows of the linearised system: what the closed nodes do to the motion of the two bodies.
//!
//! With the motion y = (w, change of gap) of the contact nodes the tractions change by t = −μ τ r − D (λ + V ∂x) w, and
//! y_n = 0 at the closed nodes: all of them slide, so that there is a D ([`crate::contact::Tangent::resistance`]).

use crate::contact::{LinearContact, LinearNode};
use crate::{Error, Result};
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// A sliding contact on the nodes that it involves: the k closed ones, then those upstream that ∂x reaches.
#[derive(Debug, Clone)]
pub struct Coupling {
    /// Nodes of the interface, `[m]`, the closed ones first.
    pub nodes: Vec<usize>,
    /// D of each closed node, N·s/m, `[k]`.
    damping: Vec<[[f64; 2]; 2]>,
    /// μ τ of each closed node, `[k]`.
    friction: Vec<[f64; 2]>,
    /// V ∂/∂x of each closed node: (place in `nodes`, coefficient in 1/s).
    convection: Vec<Vec<(usize, f64)>>,
}

impl Coupling {
    /// The coupling of a contact.
    pub fn new(contact: &LinearContact) -> Result<Self> {
        let mut nodes: Vec<usize> = contact.nodes.iter().map(|n| n.node).collect();
        let mut place = |node: usize| match nodes.iter().position(|&n| n == node) {
            Some(at) => at,
            None => {
                nodes.push(node);
                nodes.len() - 1
            }
        };
        let places = |n: &LinearNode| n.convection.iter().map(|&(j, v)| (place(j), v)).collect();
        let convection = contact.nodes.iter().map(places).collect();
        let resistance = contact.nodes.iter().map(|n| n.tangent.resistance()).collect::<Option<_>>();
        let damping = resistance.ok_or_else(|| {
            Error::Job(format!(
                "analyses.stability.full: {} of {} closed nodes stick; the full system is for contacts that slide everywhere: \
                 leave it out, or let them slide by a larger creepage",
                contact.sticking(),
                contact.nodes.len()
            ))
        })?;
        let friction = contact.nodes.iter().map(|n| n.tangent.friction().map(|f| -f)).collect();
        Ok(Self { nodes, damping, friction, convection })
    }

    /// Number of closed nodes, k.
    pub fn closed(&self) -> usize {
        self.friction.len()
    }

    /// Forces of the damping part, −D w, N/s per unit of λ: `y` and the result are `[3m]`, rows (x, y, n).
    pub fn damping_forces(&self, y: &[C]) -> Vec<C> {
        self.tangential(|i, q| y[3 * i + q])
    }

    /// Forces of the stiffness part, −D V ∂x w, N, `[3m]`.
    pub fn convection_forces(&self, y: &[C]) -> Vec<C> {
        self.tangential(|i, q| self.convection[i].iter().map(|&(j, v)| v * y[3 * j + q]).sum())
    }

    fn tangential(&self, w: impl Fn(usize, usize) -> C) -> Vec<C> {
        let mut forces = vec![C::default(); 3 * self.nodes.len()];
        for (i, d) in self.damping.iter().enumerate() {
            let w = [w(i, 0), w(i, 1)];
            for q in 0..2 {
                forces[3 * i + q] = -(d[q][0] * w[0] + d[q][1] * w[1]);
            }
        }
        forces
    }

    /// Forces of the pressures r (N, `[k]`) with their friction, `[3m]`.
    pub fn pressure_forces(&self, r: &[C]) -> Vec<C> {
        let mut forces = vec![C::default(); 3 * self.nodes.len()];
        for (i, (r, t)) in r.iter().zip(&self.friction).enumerate() {
            forces[3 * i] = -t[0] * r;
            forces[3 * i + 1] = -t[1] * r;
            forces[3 * i + 2] = *r;
        }
        forces
    }

    /// Largest entry of D, N·s/m.
    pub fn largest_damping(&self) -> f64 {
        self.damping.iter().flatten().flatten().fold(0.0, |m: f64, v| m.max(v.abs()))
    }

    /// Sum of the absolute coefficients of V ∂x, at most, 1/s.
    pub fn largest_rate(&self) -> f64 {
        self.convection.iter().map(|l| l.iter().map(|c| c.1.abs()).sum::<f64>()).fold(0.0, f64::max)
    }

    /// Factorises the contact problem at λ = `shift` for bodies whose receptance on the rows is `receptance` (y = H R), m/N, `[3m, 3m]`.
    pub fn at(&self, receptance: &Mat<C>, shift: C) -> Result<CoupledContact> {
        let k = self.closed();
        let h = receptance;
        // Forces in units that make H of order one.
        let scale = (0..3 * k).map(|i| h[(i, i)].norm()).fold(0.0, f64::max);
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(Error::NotConverged(format!(
                "stability, full system: the receptance of the contact at the shift is {scale:e} m/N"
            )));
        }
        // Unknown forces R of the closed nodes, `[3k]`: t + μτ p + D (λ + V∂x) w = 0 and y_n = g, with y = y0 + H R.
        let mut a = Mat::<C>::zeros(3 * k, 3 * k);
        for i in 0..k {
            let d = self.damping[i];
            for j in 0..3 * k {
                let w = [0, 1].map(|q| {
                    let rolling: C = self.convection[i].iter().map(|&(n, v)| v * h[(3 * n + q, j)]).sum();
                    shift * h[(3 * i + q, j)] + rolling
                });
                for q in 0..2 {
                    a[(3 * i + q, j)] = d[q][0] * w[0] + d[q][1] * w[1];
                }
                a[(3 * i + 2, j)] = h[(3 * i + 2, j)] / scale;
            }
            for q in 0..2 {
                a[(3 * i + q, 3 * i + q)] += C::from(1.0);
                a[(3 * i + q, 3 * i + 2)] += C::from(self.friction[i][q]);
            }
        }
        Ok(CoupledContact { factor: a.partial_piv_lu(), scale, shift })
    }
}

/// The contact problem at one λ, factorised.
#[derive(Debug)]
pub struct CoupledContact {
    factor: PartialPivLu<C>,
    scale: f64,
    shift: C,
}

impl CoupledContact {
    /// The forces (N, `[3m]`) that bring the motion `y0` (m, `[3m]`) to y_n = `gap` (m, `[k]`) at the closed nodes and obey friction.
    pub fn forces(&self, coupling: &Coupling, y0: &[C], gap: &[C]) -> Vec<C> {
        let k = coupling.closed();
        let (damped, rolling) = (coupling.damping_forces(y0), coupling.convection_forces(y0));
        let mut rhs = Mat::<C>::from_fn(3 * k, 1, |i, _| match i % 3 {
            2 => (gap[i / 3] - y0[i]) / self.scale,
            _ => self.shift * damped[i] + rolling[i],
        });
        self.factor.solve_in_place(&mut rhs);
        let mut forces = vec![C::default(); y0.len()];
        for (i, f) in forces.iter_mut().take(3 * k).enumerate() {
            *f = rhs[(i, 0)];
        }
        forces
    }
}
