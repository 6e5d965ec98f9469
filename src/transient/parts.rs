//! Newton's method on the natural map of a step, its linear systems solved in parts.
//!
//! At a node that slips the direction d of t − ρ u says what the traction does: along d it follows the pressure, t = μ p, across
//! it the creep turns it: with e ⟂ d and a = μ q/|t − ρ u| the row of the map is (1 − a) δt_e + a ρ δu_e. So only one tangential
//! unknown is left at a node that slips, two where it sticks, and their operator Eᵀ W_tt E + diag((1 − a)/(a ρ)) is symmetric and positive
//! definite: conjugate gradients solve it. Normal unknowns feel the ones across the creep only through W_nt, which is
//! small for bodies that are nearly alike; the part of W_nt that friction multiplies is in the inverse of
//! W_nn + μ W_nt d, which is kept while the nodes are the same. Friction that depends on the velocity would tie the traction along d to
//! all others and is not treated here. What is neglected is made good by the next iteration, whose
//! residual comes from a product with all of W; so single precision is enough here.

use faer::linalg::solvers::{DenseSolveCore, PartialPivLu, Solve};
use faer::Mat;

use super::problem::{Effort, Rho, StepProblem, StepSolution};
use crate::contact::laws::{size, State};

/// Sine of the angle by which a direction may leave the one that the stored operator was made for.
const TURN: f64 = 0.005;

/// Solutions after which the inverse of the normal part pays; until then conjugate gradients find the pressures too.
const WORTH: usize = 8;

/// What serves the following steps on the same nodes.
pub(super) struct Parts {
    rho: Vec<Rho>,
    /// Mean of the compliances of the nodes, m/N: what the following are relative to.
    unit: f64,
    /// W: for each node its columns x and y, each as rows x, y and n of all nodes, `[k][2][3][k]`.
    plane: Vec<f32>,
    /// W_nn, columns, `[k][k]`.
    gaps: Vec<f32>,
    /// Inverse of W_nn + μ W_nt d, columns, `[k][k]`, where it was made.
    normal: Vec<f32>,
    /// Direction d of each node as components x and y; e = (−d_y, d_x).
    frame: [Vec<f32>; 2],
    /// W between the components across (first k) and along d (last k), columns, `[2k][2k]`.
    tangential: Vec<f32>,
    /// W from all normal components to the one across d at a node, `[k][k]`, node after node.
    coupling: Vec<f32>,
    /// Open nodes, and the factor of the rows and columns of `normal` that they have.
    open: Vec<usize>,
    shut: Option<PartialPivLu<f32>>,
    /// Linear systems solved.
    solved: usize,
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
/// rounding). The last reactions where the method stalls or the problem is not for it. No totals may be prescribed, and the friction
/// must be constant.
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
        let forcing = (0.3 * target / seen.largest).clamp(1e-3, 0.1);
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
                let long = size(z);
                node.d = [z[0] / long, z[1] / long];
                node.mu = p.friction.coefficient(size([u[0], u[1]]) / p.step);
                // Without friction nothing is left to turn: a row t_e = 0 is as good.
                let a = (node.mu * (r[2] - rho[i].normal * u[2]) / long).max(1e-9);
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
        let (mut plane, mut gaps) = (vec![0.0; 6 * k * k], vec![0.0; k * k]);
        let factor = 1.0 / unit;
        for i in 0..k {
            for (c, out) in plane[6 * k * i..][..6 * k].chunks_exact_mut(3 * k).enumerate() {
                let (x, rest) = out.split_at_mut(k);
                let (y, n) = rest.split_at_mut(k);
                for (((x, y), n), w) in x.iter_mut().zip(y).zip(n).zip(p.matrix.col(3 * i + c).chunks_exact(3)) {
                    (*x, *y, *n) = ((w[0] * factor) as f32, (w[1] * factor) as f32, (w[2] * factor) as f32);
                }
            }
            let column = p.matrix.col(3 * i + 2).chunks_exact(3);
            gaps[k * i..][..k].iter_mut().zip(column).for_each(|(g, w)| *g = (w[2] * factor) as f32);
        }
        let frame = [0, 1].map(|c| seen.nodes.iter().map(|n| n.d[c] as f32).collect());
        let (tangential, coupling) = (vec![0.0; 4 * k * k], vec![0.0; k * k]);
        let (normal, open) = (Vec::new(), Vec::new());
        let mut new = Self { rho, unit, plane, gaps, normal, frame, tangential, coupling, open, shut: None, solved: 0 };
        (0..k).for_each(|i| new.turn(i));
        new
    }

    /// The inverse for the directions of now.
    fn invert(&mut self, seen: &Seen) {
        let k = self.rho.len();
        let matrix = Mat::from_fn(k, k, |i, j| {
            // W is symmetric: row n of column x, y of node j.
            let at = |c: usize| self.plane[6 * k * j + 3 * k * c + 2 * k + i];
            let mu = seen.nodes[j].mu as f32;
            self.gaps[k * j + i] + mu * (self.frame[0][j] * at(0) + self.frame[1][j] * at(1))
        });
        let inverse = matrix.partial_piv_lu().inverse();
        self.normal = (0..k).flat_map(|j| (0..k).map(move |i| (i, j))).map(|(i, j)| inverse[(i, j)]).collect();
    }

    fn direction(&self, i: usize) -> [f64; 2] {
        [f64::from(self.frame[0][i]), f64::from(self.frame[1][i])]
    }

    /// Columns of node `i` for the directions of all nodes.
    fn turn(&mut self, i: usize) {
        let k = self.rho.len();
        let (cx, cy) = self.plane[6 * k * i..][..6 * k].split_at(3 * k);
        let [dx, dy] = &self.frame;
        for (own, f) in [(i, [-dy[i], dx[i]]), (k + i, [dx[i], dy[i]])] {
            let (across, along) = self.tangential[2 * k * own..][..2 * k].split_at_mut(k);
            let rows = cx[..k].iter().zip(&cx[k..2 * k]).zip(cy[..k].iter().zip(&cy[k..2 * k]));
            for (((((xx, xy), (yx, yy)), dx), dy), (s, t)) in rows.zip(dx).zip(dy).zip(across.iter_mut().zip(along)) {
                let v = [f[0] * xx + f[1] * yx, f[0] * xy + f[1] * yy];
                *s = dx * v[1] - dy * v[0];
                *t = dx * v[0] + dy * v[1];
            }
            if own == i {
                let out = &mut self.coupling[k * i..][..k];
                for ((o, x), y) in out.iter_mut().zip(&cx[2 * k..]).zip(&cy[2 * k..]) {
                    *o = f[0] * x + f[1] * y;
                }
            }
        }
    }

    /// Rows and columns of the nodes whose direction has changed.
    fn follow(&mut self, seen: &Seen) {
        let k = self.rho.len();
        let mut turned = Vec::new();
        for (i, node) in seen.nodes.iter().enumerate().filter(|(_, n)| n.state == State::Slip) {
            let (d, f) = (node.d, self.direction(i));
            if (d[0] * f[1] - d[1] * f[0]).abs() > TURN || d[0] * f[0] + d[1] * f[1] < 0.0 {
                (self.frame[0][i], self.frame[1][i]) = (d[0] as f32, d[1] as f32);
                turned.push(i);
            }
        }
        if 4 * turned.len() > k {
            (0..k).for_each(|i| self.turn(i));
            return;
        }
        turned.iter().for_each(|&i| self.turn(i));
        for own in turned.into_iter().flat_map(|i| [i, k + i]) {
            for row in 0..2 * k {
                self.tangential[2 * k * row + own] = self.tangential[2 * k * own + row];
            }
        }
    }

    /// Newton's step from `x` with the response `y`.
    fn step(&mut self, p: &StepProblem<'_>, seen: &Seen, x: &mut [f64], y: &[f64], forcing: f64, effort: &mut Effort) {
        let k = self.rho.len();
        self.follow(seen);
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
        self.solved += 1;
        if self.solved > WORTH && self.normal.is_empty() {
            self.invert(seen);
        }
        let pressure = self.press(seen, &u, forcing as f32, effort);
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
                    let d = self.direction(i);
                    let e = across(d);
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
        self.subtract(seen, &along, &pressure, &mut rhs);
        let found = self.turned(seen, &soft, &rhs, forcing as f32, effort);
        for (i, node) in seen.nodes.iter().enumerate().filter(|(_, n)| n.state != State::Open) {
            let (d, along) = match node.state {
                State::Stick => (self.direction(i), found[k + i]),
                _ => (node.d, along[i]),
            };
            let (e, along, across) = (across(d), f64::from(along), f64::from(found[i]));
            x[3 * i] += d[0] * along + e[0] * across;
            x[3 * i + 1] += d[1] * along + e[1] * across;
            x[3 * i + 2] += f64::from(pressure[i]);
        }
    }

    /// The change of the pressures that closes the gaps in `u`, N; 0 at open nodes.
    fn press(&mut self, seen: &Seen, u: &[f64], forcing: f32, effort: &mut Effort) -> Vec<f32> {
        let k = self.rho.len();
        let open: Vec<usize> = (0..k).filter(|&i| seen.nodes[i].state == State::Open).collect();
        let mut gap: Vec<f32> = u[2..].iter().step_by(3).map(|u| (-u / self.unit) as f32).collect();
        open.iter().for_each(|&i| gap[i] = 0.0);
        if self.normal.is_empty() {
            let mut scale: Vec<f32> = (0..k).map(|i| 1.0 / self.gaps[(k + 1) * i]).collect();
            open.iter().for_each(|&i| scale[i] = 0.0);
            let apply = |v: &[f32], out: &mut [f32]| add(&self.gaps, k, v, out);
            return conjugate_gradients(&gap, &scale, forcing, apply, effort);
        }
        if open != self.open || self.shut.is_none() {
            let block = Mat::from_fn(open.len(), open.len(), |i, j| self.normal[k * open[j] + open[i]]);
            self.shut = Some(block.partial_piv_lu());
            self.open = open;
        }
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
    fn subtract(&self, seen: &Seen, along: &[f32], pressure: &[f32], rhs: &mut [f32]) {
        let k = self.rho.len();
        let mut moved = vec![0.0; k];
        add(&self.tangential[2 * k * k..], 2 * k, along, &mut moved);
        for (i, node) in seen.nodes.iter().enumerate() {
            if node.state == State::Open {
                rhs[i] = 0.0;
                continue;
            }
            rhs[i] -= moved[i] + dot(&self.coupling[k * i..][..k], pressure);
            if node.state == State::Stick {
                let [x, y] = [0, 1].map(|c| dot(&self.plane[6 * k * i + 3 * k * c + 2 * k..][..k], pressure));
                let normal = self.frame[0][i] * x + self.frame[1][i] * y;
                rhs[k + i] -= dot(&self.tangential[2 * k * (k + i) + k..][..k], along) + normal;
            }
        }
    }

    /// The tangential unknowns: across at closed nodes, along where they stick.
    fn turned(&self, seen: &Seen, soft: &[f32], rhs: &[f32], forcing: f32, effort: &mut Effort) -> Vec<f32> {
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
        let apply = |v: &[f32], out: &mut [f32]| {
            let (first, second) = out.split_at_mut(k);
            add(&self.tangential, 2 * k, &v[..k], first);
            first.iter_mut().zip(soft).zip(v).for_each(|((o, s), v)| *o += s * v);
            for &i in &stick {
                let column = &self.tangential[2 * k * (k + i)..][..2 * k];
                first.iter_mut().zip(column).for_each(|(o, w)| *o += v[k + i] * w);
                second[i] = dot(column, v);
            }
        };
        conjugate_gradients(&rhs[..size], &scale[..size], forcing, apply, effort)
    }
}

/// Conjugate gradients scaled by the diagonal, whose inverse is `scale`: 0 where there is no unknown. `apply` adds A v to zeros; what it leaves
/// where there is no unknown does not matter. The scaled residual falls by `forcing`.
fn conjugate_gradients(
    rhs: &[f32],
    scale: &[f32],
    forcing: f32,
    apply: impl Fn(&[f32], &mut [f32]),
    effort: &mut Effort,
) -> Vec<f32> {
    let mut r = rhs.to_vec();
    let mut z: Vec<f32> = r.iter().zip(scale).map(|(r, s)| r * s).collect();
    let mut direction = z.clone();
    let mut rz = dot(&r, &z);
    let enough = forcing * forcing * rz;
    let (mut found, mut image) = (vec![0.0; r.len()], vec![0.0; r.len()]);
    for _ in 0..r.len() {
        if !(rz > enough) {
            break;
        }
        effort.inner += 1;
        image.fill(0.0);
        apply(&direction, &mut image);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::half_space::HalfSpace;
    use crate::contact::{combined_compliance, FrictionLaw, Interface};
    use crate::transient::{ContactSolver, Memory, Operator};

    /// (dx, dy, g) of bodies pressed together by `approach` and moved by about `path`, unevenly over the contact.
    fn displacements(s: &Interface, approach: f64, path: f64) -> Vec<f64> {
        (0..s.len())
            .flat_map(|i| {
                let [x, y] = s.point(i);
                [path * (1.0 + 150.0 * x), 0.4 * path * (1.0 - 200.0 * y), s.gap[i] - approach]
            })
            .collect()
    }

    /// With open nodes, stick and slip, for equal and for unlike bodies: the reactions of the fixed point, and from a solution nearby in few
    /// products without a factorisation of the whole. Falling friction goes another way to the same.
    #[test]
    fn finds_the_reactions_of_the_fixed_point_for_unlike_bodies_and_falling_friction() {
        let s = Interface::paraboloid(9, 9, [6e-3; 2], [4.0; 2]).unwrap();
        let steel = HalfSpace { young: 205e9, poisson: 0.3 }.compliance(&s.x, &s.y).unwrap();
        let hard = HalfSpace { young: 205e13, poisson: 0.3 }.compliance(&s.x, &s.y).unwrap();
        let falling = FrictionLaw::Exponential { at_rest: 0.35, kinetic: 0.25, decay_velocity: 0.3 };
        for (other, friction) in [
            (&steel, FrictionLaw::Constant(0.3)),
            (&hard, FrictionLaw::Constant(0.3)),
            (&hard, FrictionLaw::Constant(0.0)),
            (&steel, falling),
            (&hard, falling),
        ] {
            let w = combined_compliance(steel.as_ref(), other.as_ref()).unwrap();
            let columns: Vec<f64> = (0..3 * s.len()).flat_map(|j| w.col_as_slice(j).to_vec()).collect();
            let matrix = Operator::new(&columns, 3 * s.len(), 3 * s.len());
            let mut memory = Memory::default();
            let mut guess = vec![0.0; 3 * s.len()];
            for step in 0..4 {
                let free = displacements(&s, (8.0 + 0.01 * step as f64) * 1e-5, (1.0 + 0.01 * step as f64) * 1.2e-5);
                let tolerance = 1e-11;
                let p = StepProblem { matrix, free: &free, friction, step: 1e-5, total: [None; 3], tolerance };
                let solve = |solver, memory: &mut Memory| {
                    let mut effort = Effort::default();
                    let found = p.solve(solver, &guess, None, [0.0; 3], memory, &mut effort).unwrap();
                    (found, effort)
                };
                let (found, effort) = solve(ContactSolver::Newton, &mut memory);
                let (reference, _) = solve(ContactSolver::FixedPoint, &mut Memory::default());
                let normal: f64 = reference.reaction.iter().skip(2).step_by(3).sum();
                let difference =
                    found.reaction.iter().zip(&reference.reaction).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(difference < 1e-8 * 0.25 * normal, "{friction:?}, step {step}: {difference:e} of {normal:e} N");
                let count = |state| found.status.iter().filter(|s| **s == state).count();
                let [open, stick, slip] = [State::Open, State::Stick, State::Slip].map(count);
                let enough = open > 10 && slip > 5 && (stick > 5 || friction == FrictionLaw::Constant(0.0));
                assert!(enough, "{friction:?}: {open} open, {stick} in stick, {slip} in slip");
                if step > 0 && friction.is_constant() {
                    assert!(effort.factorisations == 0 && effort.products <= 8, "step {step}: {effort:?}");
                }
                guess = found.reaction;
            }
        }
    }
}
