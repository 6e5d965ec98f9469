//! The contact rows of the linearised system: what the closed nodes do to the motion of the two bodies.
//!
//! With the motion y = (w, change of gap) of the contact nodes the tractions change by t = −μ τ r − D (λ + V ∂x) w, and
//! y_n = 0 at the closed nodes: all of them slide, so that there is a D ([`crate::contact::Tangent::resistance`]).
//! Where the friction remembers, its coefficients are unknowns as well: f = P δμ with the largest normal force P of a
//! node gives t = … − (p/P) τ f, and (λ + decay) f − upstream f′ − P gain τ·(λ + V ∂x) w = 0, f′ at the node upstream
//! ([`crate::contact::LinearMemory`]).

use crate::contact::{LinearContact, LinearMemory, LinearNode};
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
    /// Contribution of the gaps ahead of the edge: (place in `nodes`, coefficients along x and y in 1/s).
    edges: Vec<Vec<(usize, [f64; 2])>>,
    /// The nodes whose friction remembers.
    memory: Vec<LinearMemory>,
    /// P, N.
    unit: f64,
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
        let mut edges = vec![Vec::new(); contact.nodes.len()];
        for edge in &contact.edges {
            edges[edge.at].extend(edge.gaps.iter().map(|&(j, d)| (place(j), d)));
        }
        let resistance = contact.nodes.iter().map(|n| n.tangent.resistance()).collect::<Option<_>>();
        let damping = resistance.ok_or_else(|| {
            Error::Job(format!(
                "analyses.stability.full: {} of {} closed nodes stick; the full system is for contacts that \
                 slide everywhere: \
                 leave it out, or let them slide by a larger creepage",
                contact.sticking(),
                contact.nodes.len()
            ))
        })?;
        let friction = contact.nodes.iter().map(|n| n.tangent.friction().map(|f| -f)).collect();
        let unit = match contact.memory.iter().map(|m| m.force).fold(0.0, f64::max) {
            0.0 => 1.0,
            largest => largest,
        };
        Ok(Self { nodes, damping, friction, convection, edges, memory: contact.memory.clone(), unit })
    }

    /// Number of closed nodes, k.
    pub fn closed(&self) -> usize {
        self.friction.len()
    }

    /// Number of coefficients of friction that change, s.
    pub fn remembering(&self) -> usize {
        self.memory.len()
    }

    /// Tractions of the changes `f` of friction (N, `[s]`), `[3m]`.
    pub(crate) fn memory_forces(&self, f: &[C]) -> Vec<C> {
        let mut forces = vec![C::default(); 3 * self.nodes.len()];
        for (memory, f) in self.memory.iter().zip(f) {
            for (q, t) in memory.direction.iter().enumerate() {
                forces[3 * memory.at + q] -= memory.force / self.unit * t * f;
            }
        }
        forces
    }

    /// The rows of friction with the power `power` of λ, 1 or 0, on the motion `y` (`[3m]`) and the changes `f` (N,
    /// `[s]`): N or N/s, `[s]`.
    pub(crate) fn memory_rows(&self, power: usize, y: &[C], f: &[C]) -> Vec<C> {
        let row = |(i, m): (usize, &LinearMemory)| {
            let w = |q: usize| match power {
                1 => y[3 * m.at + q],
                _ => self.carried(m.at, q, |row| y[row]),
            };
            let own = match power {
                1 => f[i],
                _ => m.relaxation.decay * f[i] - m.upstream.map_or(C::default(), |u| m.relaxation.upstream * f[u]),
            };
            own - self.unit * m.relaxation.gain * (m.direction[0] * w(0) + m.direction[1] * w(1))
        };
        self.memory.iter().enumerate().map(row).collect()
    }

    /// Largest sums of the absolute coefficients of these rows with λ and without: of f, 1 and 1/s, and of the
    /// motion, N/m and N/(m s).
    pub(crate) fn largest_memory(&self) -> ([f64; 2], [f64; 2]) {
        let most = |of: &dyn Fn(&LinearMemory) -> f64| self.memory.iter().map(of).fold(0.0, f64::max);
        let moved = 2.0 * most(&|m| (self.unit * m.relaxation.gain).abs());
        let one = if self.memory.is_empty() { 0.0 } else { 1.0 };
        ([one, most(&|m| m.relaxation.decay + m.relaxation.upstream)], [moved, moved * self.largest_rate()])
    }

    /// Forces of the damping part, −D w, N/s per unit of λ: `y` and the result are `[3m]`, rows (x, y, n).
    pub(crate) fn damping_forces(&self, y: &[C]) -> Vec<C> {
        self.tangential(|i, q| y[3 * i + q])
    }

    /// Forces of the stiffness part, −D V ∂x w, N, `[3m]`.
    pub(crate) fn convection_forces(&self, y: &[C]) -> Vec<C> {
        self.tangential(|i, q| self.carried(i, q, |row| y[row]))
    }

    /// V ∂w/∂x of component `q` at closed node `i` for the motion `y` of the rows.
    fn carried(&self, i: usize, q: usize, y: impl Fn(usize) -> C) -> C {
        let along: C = self.convection[i].iter().map(|&(j, v)| v * y(3 * j + q)).sum();
        along + self.edges[i].iter().map(|&(j, d)| d[q] * y(3 * j + 2)).sum::<C>()
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
    pub(crate) fn pressure_forces(&self, r: &[C]) -> Vec<C> {
        let mut forces = vec![C::default(); 3 * self.nodes.len()];
        for (i, (r, t)) in r.iter().zip(&self.friction).enumerate() {
            forces[3 * i] = -t[0] * r;
            forces[3 * i + 1] = -t[1] * r;
            forces[3 * i + 2] = *r;
        }
        forces
    }

    /// Largest entry of D, N·s/m.
    pub(crate) fn largest_damping(&self) -> f64 {
        self.damping.iter().flatten().flatten().fold(0.0, |m: f64, v| m.max(v.abs()))
    }

    /// Sum of the absolute coefficients of V ∂x, at most, 1/s.
    pub(crate) fn largest_rate(&self) -> f64 {
        let along = |l: &Vec<(usize, f64)>| l.iter().map(|c| c.1.abs()).sum::<f64>();
        let edge = |l: &Vec<(usize, [f64; 2])>| l.iter().map(|c| c.1[0].abs().max(c.1[1].abs())).sum::<f64>();
        self.convection.iter().zip(&self.edges).map(|(c, e)| along(c) + edge(e)).fold(0.0, f64::max)
    }

    /// Factorises the contact problem at λ = `shift` for bodies whose receptance on the rows is `receptance` (y = H
    /// R), m/N, `[3m, 3m]`.
    pub fn factorise(&self, receptance: &Mat<C>, shift: C) -> Result<CoupledContact> {
        let k = self.closed();
        let h = receptance;
        // Forces in units that make H of order one.
        let scale = (0..3 * k).map(|i| h[(i, i)].norm()).fold(0.0, f64::max);
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(Error::NotConverged(format!(
                "stability, full system: the receptance of the contact at the shift is {scale:e} m/N"
            )));
        }
        // Unknown forces R of the closed nodes, `[3k]`: t + μτ p + (p0/P) τ f + D (λ + V∂x) w = 0 and y_n = g, with y
        // = y0 + H R; then f, `[s]`.
        let size = 3 * k + self.memory.len();
        let mut a = Mat::<C>::zeros(size, size);
        for i in 0..k {
            let d = self.damping[i];
            for j in 0..3 * k {
                let w = [0, 1].map(|q| shift * h[(3 * i + q, j)] + self.carried(i, q, |row| h[(row, j)]));
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
        for (i, m) in self.memory.iter().enumerate() {
            let (row, rate) = (3 * k + i, shift + m.relaxation.decay);
            for j in 0..3 * k {
                let along = |q: usize| {
                    m.direction[q] * (shift * h[(3 * m.at + q, j)] + self.carried(m.at, q, |row| h[(row, j)]))
                };
                a[(row, j)] = -self.unit * m.relaxation.gain * (along(0) + along(1)) / rate;
            }
            a[(row, row)] += C::from(1.0);
            if let Some(u) = m.upstream {
                a[(row, 3 * k + u)] -= m.relaxation.upstream / rate;
            }
            for (q, t) in m.direction.iter().enumerate() {
                a[(3 * m.at + q, row)] += C::from(m.force / self.unit * t);
            }
        }
        Ok(CoupledContact { factor: a.partial_piv_lu(), scale, shift })
    }
}

/// The linear maps of a contact as matrices, for products with the transposed ones; m nodes, k of them closed, s
/// coefficients of friction.
#[derive(Debug, Clone)]
pub struct CouplingMatrices {
    /// Forces of the damping and of the stiffness part by the motion, `[3m, 3m]` each.
    damping: Mat<f64>,
    convection: Mat<f64>,
    /// Forces of the pressures, `[3m, k]`, and of the changes of friction, `[3m, s]`.
    pressures: Mat<f64>,
    memory: Mat<f64>,
    /// Rows of friction with the powers 0 and 1 of λ by the motion, `[s, 3m]`, and by its changes, `[s, s]`.
    rows: [Mat<f64>; 2],
    own: [Mat<f64>; 2],
}

/// A linear map of `from` numbers as a matrix of real entries, `[rows, from]`.
fn matrix_of(rows: usize, from: usize, map: impl Fn(&[C]) -> Vec<C>) -> Mat<f64> {
    let mut out = Mat::zeros(rows, from);
    let mut unit = vec![C::default(); from];
    for j in 0..from {
        unit[j] = C::from(1.0);
        map(&unit).iter().enumerate().for_each(|(i, v)| out[(i, j)] = v.re);
        unit[j] = C::default();
    }
    out
}

/// out += factor Aᵀ x.
fn add_transposed(a: &Mat<f64>, x: &[C], factor: C, out: &mut [C]) {
    for (column, out) in a.col_iter().zip(out) {
        *out += factor * column.iter().zip(x).map(|(a, x)| a * x).sum::<C>();
    }
}

/// Transposed images: of motions, of pressures and of changes of friction.
#[derive(Debug, Clone)]
pub struct TransposedRows {
    /// `[3m]`.
    pub motion: Vec<C>,
    /// `[k]`.
    pub pressures: Vec<C>,
    /// `[s]`.
    pub friction: Vec<C>,
}

impl CouplingMatrices {
    /// Coupling terms of a contact.
    pub fn new(coupling: &Coupling) -> Self {
        let (m, k, s) = (3 * coupling.nodes.len(), coupling.closed(), coupling.remembering());
        let (still, same) = (vec![C::default(); m], vec![C::default(); s]);
        Self {
            damping: matrix_of(m, m, |y| coupling.damping_forces(y)),
            convection: matrix_of(m, m, |y| coupling.convection_forces(y)),
            pressures: matrix_of(m, k, |r| coupling.pressure_forces(r)),
            memory: matrix_of(m, s, |f| coupling.memory_forces(f)),
            rows: [0, 1].map(|power| matrix_of(s, m, |y| coupling.memory_rows(power, y, &same))),
            own: [0, 1].map(|power| matrix_of(s, s, |f| coupling.memory_rows(power, &still, f))),
        }
    }

    /// The transposed of what the contact adds to the matrix of this power of λ in units of `stiffness` (N/m) and
    /// `rate` (1/s), with `unit` the factor of that matrix: applied to the motion `z` of the rows, the weights `r` of
    /// the closed nodes and `f` of the rows of friction.
    pub fn transposed(
        &self,
        power: usize,
        (z, r, f): (&[C], &[C], &[C]),
        [unit, stiffness, rate]: [f64; 3],
    ) -> TransposedRows {
        let mut motion = vec![C::default(); z.len()];
        let mut pressures = vec![C::default(); r.len()];
        let mut friction = vec![C::default(); f.len()];
        let by_motion = if power == 0 { &self.convection } else { &self.damping };
        add_transposed(by_motion, z, C::from(-unit), &mut motion);
        // Rows of friction in units of the stiffness and of the rate.
        let rows = if power == 0 { 1.0 / (stiffness * rate) } else { 1.0 / stiffness };
        add_transposed(&self.rows[power], f, C::from(rows), &mut motion);
        add_transposed(&self.own[power], f, C::from(rows * stiffness), &mut friction);
        if power == 0 {
            r.iter().enumerate().for_each(|(i, r)| motion[3 * i + 2] += r);
            add_transposed(&self.pressures, z, C::from(-unit * stiffness), &mut pressures);
            add_transposed(&self.memory, z, C::from(-unit * stiffness), &mut friction);
        }
        TransposedRows { motion, pressures, friction }
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
    /// The forces (N, `[3m]`) that bring the motion `y0` (m, `[3m]`) to y_n = `gap` (m, `[k]`) at the closed nodes
    /// and obey friction, and its changes (N, `[s]`), whose rows are to be `remembered` (N/s, `[s]`).
    pub fn forces(&self, coupling: &Coupling, y0: &[C], gap: &[C], remembered: &[C]) -> (Vec<C>, Vec<C>) {
        let k = coupling.closed();
        let (damped, rolling) = (coupling.damping_forces(y0), coupling.convection_forces(y0));
        let none = vec![C::default(); coupling.remembering()];
        let moved = [0, 1].map(|power| coupling.memory_rows(power, y0, &none));
        let mut rhs = Mat::<C>::from_fn(3 * k + none.len(), 1, |i, _| {
            if let Some(at) = i.checked_sub(3 * k) {
                let rate = self.shift + coupling.memory[at].relaxation.decay;
                return (remembered[at] - moved[0][at] - self.shift * moved[1][at]) / rate;
            }
            match i % 3 {
                2 => (gap[i / 3] - y0[i]) / self.scale,
                _ => self.shift * damped[i] + rolling[i],
            }
        });
        self.factor.solve_in_place(&mut rhs);
        let mut forces = vec![C::default(); y0.len()];
        for (i, f) in forces.iter_mut().take(3 * k).enumerate() {
            *f = rhs[(i, 0)];
        }
        (forces, (0..none.len()).map(|i| rhs[(3 * k + i, 0)]).collect())
    }

    /// The transposed of [`CoupledContact::forces`]: weights of the forces of the closed nodes (`[3k]`) and of the
    /// changes of friction (`[s]`) give those of the motion, of the gaps and of the rows of friction.
    pub fn transposed(
        &self,
        coupling: &Coupling,
        matrices: &CouplingMatrices,
        forces: &[C],
        friction: &[C],
    ) -> TransposedRows {
        let (k, s) = (coupling.closed(), coupling.remembering());
        let mut t = Mat::<C>::from_fn(3 * k + s, 1, |i, _| if i < 3 * k { forces[i] } else { friction[i - 3 * k] });
        self.factor.solve_transpose_in_place(&mut t);
        let mut motion = vec![C::default(); 3 * coupling.nodes.len()];
        // Weights of the tangential rows, which the motion enters by its forces.
        let tangential: Vec<C> =
            (0..motion.len()).map(|i| if i < 3 * k && i % 3 != 2 { t[(i, 0)] } else { C::default() }).collect();
        add_transposed(&matrices.damping, &tangential, self.shift, &mut motion);
        add_transposed(&matrices.convection, &tangential, C::from(1.0), &mut motion);
        let pressures: Vec<C> = (0..k).map(|i| t[(3 * i + 2, 0)] / self.scale).collect();
        pressures.iter().enumerate().for_each(|(i, p)| motion[3 * i + 2] -= p);
        let friction: Vec<C> =
            (0..s).map(|i| t[(3 * k + i, 0)] / (self.shift + coupling.memory[i].relaxation.decay)).collect();
        add_transposed(&matrices.rows[0], &friction, C::from(-1.0), &mut motion);
        add_transposed(&matrices.rows[1], &friction, -self.shift, &mut motion);
        TransposedRows { motion, pressures, friction }
    }
}
