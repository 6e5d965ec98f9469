//! Newton's method on the natural map of a step, its linear systems solved in parts.
//!
//! At a node that slips the direction d of t − ρ u says what the traction does: along d it follows the pressure, t = μ p, across
//! it the creep turns it: with e ⟂ d and a = μ q/|t − ρ u| the row of the map is (1 − a) δt_e + a ρ δu_e. So only one tangential
//! unknown is left at a node that slips, two where it sticks, and their operator Eᵀ W_tt E + diag((1 − a)/(a ρ)) is symmetric and positive
//! definite: conjugate gradients solve it. Normal unknowns feel the ones across the creep only through W_nt, which is
//! small for bodies that are nearly alike; the part of W_nt that friction multiplies is in the inverse of
//! W_nn + μ W_nt d, which is kept while the nodes are the same. What is neglected is made good by the next iteration, whose
//! residual comes from a product with all of W; so single precision is enough here.

use faer::linalg::solvers::{DenseSolveCore, PartialPivLu, Solve};
use faer::Mat;

use super::problem::{Effort, Rho, StepProblem, StepSolution};
use crate::contact::laws::State;

/// Sine of the angle by which a direction may leave the one that the stored operator was made for.
const TURN: f64 = 0.005;

/// What serves the following steps on the same nodes.
pub(super) struct Parts {
    rho: Vec<Rho>,
    /// Mean of the compliances of the nodes, m/N: what the following are relative to.
    unit: f64,
    /// Inverse of W_nn + μ W_nt d, columns, `[k][k]`.
    normal: Vec<f32>,
    /// Direction d of each node; e = (−d_y, d_x).
    frame: Vec<[f64; 2]>,
    /// W between the components across (first k) and along d (last k), columns, `[2k][2k]`.
    tangential: Vec<f32>,
    /// W from the normal components to those across d, columns, `[k][k]`.
    coupling: Vec<f32>,
    /// Open nodes, and the factor of the rows and columns of `normal` that they have.
    open: Vec<usize>,
    shut: Option<PartialPivLu<f32>>,
}

/// What the map says of a node.
#[derive(Clone, Copy)]
struct Node {
    state: State,
    /// Direction of t − ρ u where it slips.
    d: [f64; 2],
    /// (1 − a)/(a ρ), m/N; 0 where it sticks.
    soft: f64,
    mu: f64,
}

/// The map at an iterate.
struct Seen {
    nodes: Vec<Node>,
    norm: f64,
    largest: f64,
}

/// Solves to the largest residual `target`, N, from the reactions `x` and their response `y` = W x where it is known (to
/// rounding). The last reactions where the method stalls or the problem is not for it. No totals may be prescribed.
pub(super) fn solve(
    p: &StepProblem<'_>,
    target: f64,
    mut x: Vec<f64>,
    y: Option<Vec<f64>>,
    memory: &mut Option<Parts>,
    effort: &mut Effort,
) -> Result<StepSolution, Vec<f64>> {
    let product = |x: &[f64], effort: &mut Effort| {
        let mut y = vec![0.0; x.len()];
        p.matrix.times(x, &mut y);
        effort.products += 1;
        y
    };
    let mut exact = y.is_none();
    let mut y = y.unwrap_or_else(|| product(&x, effort));
    let rho: Vec<Rho> = match memory {
        Some(parts) => parts.rho.clone(),
        None => (0..p.nodes()).map(|i| p.rho(i)).collect(),
    };
    if rho.iter().any(|r| !(r.tangential > 0.0 && r.normal.is_finite())) {
        return Err(x);
    }
    let mut last = f64::INFINITY;
    for _ in 0..12 {
        let seen = look(p, &rho, &x, &y);
        if seen.largest <= target {
            if exact {
                return Ok(solution(x, y, &seen));
            }
            y = product(&x, effort);
            exact = true;
            continue;
        }
        // A change of status may raise the norm a little; what does not fall then is not for this method.
        if !(seen.norm < 0.7 * last) {
            return Err(x);
        }
        last = seen.norm;
        effort.iterations += 1;
        let parts = memory.get_or_insert_with(|| Parts::new(p, rho.clone(), &seen));
        let forcing = (0.1 * target / seen.largest).clamp(1e-3, 0.1);
        parts.step(p, &seen, &mut x, &y, forcing, effort);
        y = product(&x, effort);
        exact = true;
    }
    Err(x)
}

fn solution(mut x: Vec<f64>, y: Vec<f64>, seen: &Seen) -> StepSolution {
    // What is left on open nodes is below the residual.
    for (r, _) in x.chunks_exact_mut(3).zip(&seen.nodes).filter(|(_, n)| n.state == State::Open) {
        r.fill(0.0);
    }
    let status = seen.nodes.iter().map(|n| n.state).collect();
    StepSolution { reaction: x, shift: [0.0; 3], response: y, status, residual: seen.largest }
}

/// The map at the reactions `x` with the response `y`.
fn look(p: &StepProblem<'_>, rho: &[Rho], x: &[f64], y: &[f64]) -> Seen {
    let (mut square, mut largest) = (0.0, 0.0f64);
    let nodes = (0..rho.len())
        .map(|i| {
            let r = &x[3 * i..3 * i + 3];
            let u = [0, 1, 2].map(|c| p.free[3 * i + c] + y[3 * i + c]);
            let (f, state) = p.map_with(rho[i], r, &u);
            let tangential = f[0] * f[0] + f[1] * f[1];
            square += tangential + f[2] * f[2];
            largest = largest.max(tangential).max(f[2] * f[2]);
            let mut node = Node { state, d: [1.0, 0.0], soft: 0.0, mu: 0.0 };
            if state == State::Slip {
                let z = [r[0] - rho[i].tangential * u[0], r[1] - rho[i].tangential * u[1]];
                let size = (z[0] * z[0] + z[1] * z[1]).sqrt();
                node.d = [z[0] / size, z[1] / size];
                node.mu = p.friction.coefficient((u[0] * u[0] + u[1] * u[1]).sqrt() / p.step);
                let a = node.mu * (r[2] - rho[i].normal * u[2]) / size;
                node.soft = (1.0 - a) / (a * rho[i].tangential);
            }
            node
        })
        .collect();
    // The larger of NaN and a number is the number: it must not pass for a small residual.
    let largest = if square.is_finite() { largest.sqrt() } else { f64::INFINITY };
    Seen { nodes, norm: square.sqrt(), largest }
}

fn across(d: [f64; 2]) -> [f64; 2] {
    [-d[1], d[0]]
}

/// out += A x for the leading rows of the columns of `a`, which are `stride` apart.
fn add(a: &[f32], stride: usize, x: &[f32], out: &mut [f32]) {
    let n = out.len();
    let threes = x.chunks_exact(3);
    let rest = x.len() - threes.remainder().len();
    for (j, v) in threes.enumerate() {
        let at = 3 * j * stride;
        let (a, b, c) = (&a[at..][..n], &a[at + stride..][..n], &a[at + 2 * stride..][..n]);
        for (((o, a), b), c) in out.iter_mut().zip(a).zip(b).zip(c) {
            *o += a * v[0] + b * v[1] + c * v[2];
        }
    }
    for j in rest..x.len() {
        out.iter_mut().zip(&a[j * stride..][..n]).for_each(|(o, a)| *o += a * x[j]);
    }
}

/// Inner product in several partial sums.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let (ac, bc) = (a.chunks_exact(16), b.chunks_exact(16));
    let tail: f32 = ac.remainder().iter().zip(bc.remainder()).map(|(x, y)| x * y).sum();
    let mut s = [0.0; 16];
    for (x, y) in ac.zip(bc) {
        for k in 0..16 {
            s[k] += x[k] * y[k];
        }
    }
    s.iter().sum::<f32>() + tail
}

impl Parts {
    fn new(p: &StepProblem<'_>, rho: Vec<Rho>, seen: &Seen) -> Self {
        let k = rho.len();
        let unit = rho.iter().map(|r| 1.0 / r.normal).sum::<f64>() / k as f64;
        let mut new = Self {
            rho,
            unit,
            normal: Vec::new(),
            frame: seen.nodes.iter().map(|n| n.d).collect(),
            tangential: vec![0.0; 4 * k * k],
            coupling: vec![0.0; k * k],
            open: Vec::new(),
            shut: None,
        };
        let matrix = Mat::from_fn(k, k, |i, j| {
            let w = |c: usize| p.matrix.col(3 * j + c)[3 * i + 2] / unit;
            let (d, mu) = (seen.nodes[j].d, seen.nodes[j].mu);
            w(2) + mu * (d[0] * w(0) + d[1] * w(1))
        });
        let inverse = matrix.partial_piv_lu().inverse();
        new.normal = (0..k).flat_map(|j| (0..k).map(move |i| (i, j))).map(|(i, j)| inverse[(i, j)] as f32).collect();
        (0..k).for_each(|i| new.turn(p, i));
        new
    }

    /// Rows and columns of node `i` for its direction.
    fn turn(&mut self, p: &StepProblem<'_>, i: usize) {
        let k = self.rho.len();
        let (cx, cy) = (p.matrix.col(3 * i), p.matrix.col(3 * i + 1));
        for (own, f) in [(i, across(self.frame[i])), (k + i, self.frame[i])] {
            let f = [f[0] / self.unit, f[1] / self.unit];
            for (j, (x, y)) in cx.chunks_exact(3).zip(cy.chunks_exact(3)).enumerate() {
                let at = |c: usize| f[0] * x[c] + f[1] * y[c];
                let (v, d) = ([at(0), at(1)], self.frame[j]);
                let (s, t) = ((d[0] * v[1] - d[1] * v[0]) as f32, (d[0] * v[0] + d[1] * v[1]) as f32);
                self.tangential[2 * k * own + j] = s;
                self.tangential[2 * k * own + k + j] = t;
                self.tangential[2 * k * j + own] = s;
                self.tangential[2 * k * (k + j) + own] = t;
                if own == i {
                    self.coupling[k * j + i] = at(2) as f32;
                }
            }
        }
    }

    /// Newton's step from `x` with the response `y`.
    fn step(&mut self, p: &StepProblem<'_>, seen: &Seen, x: &mut [f64], y: &[f64], forcing: f64, effort: &mut Effort) {
        let k = self.rho.len();
        for (i, node) in seen.nodes.iter().enumerate().filter(|(_, n)| n.state == State::Slip) {
            let (d, f) = (node.d, self.frame[i]);
            if (d[0] * f[1] - d[1] * f[0]).abs() > TURN || d[0] * f[0] + d[1] * f[1] < 0.0 {
                self.frame[i] = d;
                self.turn(p, i);
            }
        }
        // Displacements once the reactions of open nodes are gone.
        let mut u: Vec<f64> = p.free.iter().zip(y).map(|(f, y)| f + y).collect();
        for (i, _) in seen.nodes.iter().enumerate().filter(|(_, n)| n.state == State::Open) {
            for c in 3 * i..3 * i + 3 {
                if x[c] != 0.0 {
                    u.iter_mut().zip(p.matrix.col(c)).for_each(|(u, w)| *u -= w * x[c]);
                    x[c] = 0.0;
                }
            }
        }
        effort.solutions += 1;
        let pressure = self.press(seen, &u);
        // Tractions along the direction of slip follow from the pressures.
        let mut along = vec![0.0f32; k];
        let mut rhs = vec![0.0f32; 2 * k];
        let mut soft = vec![0.0f32; k];
        for (i, node) in seen.nodes.iter().enumerate() {
            let r = &x[3 * i..3 * i + 3];
            // In newtons, as everything here.
            let v = [u[3 * i] / self.unit, u[3 * i + 1] / self.unit];
            match node.state {
                State::Open => {}
                State::Stick => {
                    let (d, e) = (self.frame[i], across(self.frame[i]));
                    rhs[i] = -(e[0] * v[0] + e[1] * v[1]) as f32;
                    rhs[k + i] = -(d[0] * v[0] + d[1] * v[1]) as f32;
                }
                State::Slip => {
                    let (d, e) = (node.d, across(node.d));
                    along[i] = (node.mu * (r[2] + f64::from(pressure[i])) - (d[0] * r[0] + d[1] * r[1])) as f32;
                    // The row of the map is (1 − a) t_e + a ρ u_e.
                    let softness = node.soft / self.unit;
                    rhs[i] = -(e[0] * v[0] + e[1] * v[1] + softness * (e[0] * r[0] + e[1] * r[1])) as f32;
                    soft[i] = softness as f32;
                }
            }
        }
        self.subtract(p, seen, &along, &pressure, &mut rhs);
        let found = self.conjugate(seen, &soft, &rhs, forcing as f32, effort);
        for (i, node) in seen.nodes.iter().enumerate().filter(|(_, n)| n.state != State::Open) {
            let (d, along) = match node.state {
                State::Stick => (self.frame[i], found[k + i]),
                _ => (node.d, along[i]),
            };
            let (e, along, across) = (across(d), f64::from(along), f64::from(found[i]));
            x[3 * i] += d[0] * along + e[0] * across;
            x[3 * i + 1] += d[1] * along + e[1] * across;
            x[3 * i + 2] += f64::from(pressure[i]);
        }
    }

    /// The change of the pressures that closes the gaps in `u`, N; 0 at open nodes.
    fn press(&mut self, seen: &Seen, u: &[f64]) -> Vec<f32> {
        let k = self.rho.len();
        let open: Vec<usize> = (0..k).filter(|&i| seen.nodes[i].state == State::Open).collect();
        if open != self.open {
            let block = Mat::from_fn(open.len(), open.len(), |i, j| self.normal[k * open[j] + open[i]]);
            self.shut = Some(block.partial_piv_lu());
            self.open = open;
        }
        let mut gap: Vec<f32> = u[2..].iter().step_by(3).map(|u| (-u / self.unit) as f32).collect();
        self.open.iter().for_each(|&i| gap[i] = 0.0);
        let mut out = vec![0.0; k];
        add(&self.normal, k, &gap, &mut out);
        if let Some(shut) = self.shut.as_ref().filter(|_| !self.open.is_empty()) {
            // Forces on the gaps of open nodes that keep their pressures at 0.
            let free = Mat::from_fn(self.open.len(), 1, |i, _| -out[self.open[i]]);
            let held = shut.solve(&free);
            for (a, &j) in self.open.iter().enumerate() {
                out.iter_mut().zip(&self.normal[k * j..][..k]).for_each(|(o, w)| *o += w * held[(a, 0)]);
            }
            self.open.iter().for_each(|&i| out[i] = 0.0);
        }
        out
    }

    /// Takes from `rhs` what the changes of the pressures and of the tractions along the slip do.
    fn subtract(&self, p: &StepProblem<'_>, seen: &Seen, along: &[f32], pressure: &[f32], rhs: &mut [f32]) {
        let k = self.rho.len();
        let mut moved = vec![0.0; k];
        add(&self.tangential[2 * k * k..], 2 * k, along, &mut moved);
        add(&self.coupling, k, pressure, &mut moved);
        rhs.iter_mut().zip(&moved).for_each(|(r, m)| *r -= m);
        for (i, node) in seen.nodes.iter().enumerate() {
            match node.state {
                State::Open => rhs[i] = 0.0,
                State::Slip => {}
                State::Stick => {
                    let d = self.frame[i];
                    let normal: f64 = (0..k)
                        .map(|j| {
                            let w = |c: usize| p.matrix.col(3 * i + c)[3 * j + 2];
                            (d[0] * w(0) + d[1] * w(1)) * f64::from(pressure[j])
                        })
                        .sum();
                    rhs[k + i] -=
                        dot(&self.tangential[2 * k * (k + i) + k..][..k], along) + (normal / self.unit) as f32;
                }
            }
        }
    }

    /// Conjugate gradients, scaled by the diagonal, on the tangential unknowns: across at closed nodes, along where they stick.
    fn conjugate(&self, seen: &Seen, soft: &[f32], rhs: &[f32], forcing: f32, effort: &mut Effort) -> Vec<f32> {
        let k = self.rho.len();
        let stick: Vec<usize> = (0..k).filter(|&i| seen.nodes[i].state == State::Stick).collect();
        // Inverse of the diagonal; 0 for what is no unknown.
        let mut scale = vec![0.0f32; 2 * k];
        for (i, _) in seen.nodes.iter().enumerate().filter(|(_, n)| n.state != State::Open) {
            scale[i] = 1.0 / (self.tangential[(2 * k + 1) * i] + soft[i]);
        }
        for &i in &stick {
            scale[k + i] = 1.0 / self.tangential[(2 * k + 1) * (k + i)];
        }
        // Without nodes in stick the second half has no part.
        let size = if stick.is_empty() { k } else { 2 * k };
        let (scale, mut r) = (&scale[..size], rhs[..size].to_vec());
        let mut found = vec![0.0; 2 * k];
        let mut z: Vec<f32> = r.iter().zip(scale).map(|(r, s)| r * s).collect();
        let mut direction = z.clone();
        let mut rz = dot(&r, &z);
        let enough = forcing * forcing * rz;
        let mut image = vec![0.0; size];
        for _ in 0..2 * k {
            if !(rz > enough) {
                break;
            }
            effort.inner += 1;
            let (first, second) = image.split_at_mut(k);
            first.iter_mut().zip(soft).zip(&direction).for_each(|((o, s), d)| *o = s * d);
            add(&self.tangential, 2 * k, &direction[..k], first);
            for &i in &stick {
                let column = &self.tangential[2 * k * (k + i)..][..2 * k];
                let v = direction[k + i];
                first.iter_mut().zip(column).for_each(|(o, w)| *o += v * w);
                second[i] = dot(column, &direction);
            }
            // The direction is 0 where there is no unknown.
            let curvature = dot(&image, &direction);
            if !(curvature > 0.0) {
                break;
            }
            let step = rz / curvature;
            found.iter_mut().zip(&direction).for_each(|(f, d)| *f += step * d);
            r.iter_mut().zip(&image).for_each(|(r, i)| *r -= step * i);
            z.iter_mut().zip(&r).zip(scale).for_each(|((z, r), s)| *z = r * s);
            let next = dot(&r, &z);
            let beta = next / rz;
            rz = next;
            direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + beta * *d);
        }
        found
    }
}
