//! Newton's method on the natural map of a step, its linear systems solved in parts.
//!
//! At a node that slips the direction d of t − ρ u says what the traction does: along d it follows the pressure, t = μ p, across it the creep turns
//! it: with e ⟂ d and a = μ q/|t − ρ u| the row of the map is (1 − a) δt_e + a ρ δu_e. So only one tangential unknown is left at a node that slips,
//! two where it sticks, and their operator Eᵀ W_tt E + diag((1 − a)/(a ρ)) is symmetric and positive definite: conjugate gradients solve it. Normal
//! unknowns feel the ones across the creep only through W_nt, which is small for bodies that are nearly alike; the part of W_nt that friction
//! multiplies is in the inverse of W_nn + μ W_nt d, which is kept while the nodes are the same. Friction that depends on the velocity ties the
//! traction along d to the motion along it, t = μ p − (p dμ/d|u|) d·u, and so to all others. Where a step is well-posed that is a contraction, much
//! of it where the coefficient is remembered over more than a step: it is followed in turn with the unknowns across. Tangential forces are not
//! treated here. What is neglected is made good by the next iteration, whose residual comes from a product with all of W; so single precision is
//! enough here.

use super::lines::Lines;
use super::problem::{node, Effort, StepProblem, StepSolution};
use crate::contact::law::{across, size, Augmentation, Status, Tangent};
use crate::dense::dot;
use crate::friction::FrictionLaw;
use normal::{Normal, Wanted};
use tangential::Tangential;

mod krylov;
mod normal;
mod start;
mod tangential;

/// What serves the following steps on the same nodes.
struct Operators {
    rho: Vec<Augmentation>,
    normal: Normal,
    /// Once directions are known.
    tangential: Option<Tangential>,
    /// Memory for it.
    spare: Option<Tangential>,
}

/// The parts, and others whose memory can be used again.
#[derive(Default)]
pub(super) struct Kept {
    parts: Option<Operators>,
    old: Option<Operators>,
}

impl Kept {
    /// Forgets everything but the memory.
    pub(super) fn forget(&mut self) {
        self.old = self.parts.take().or(self.old.take());
    }
}

/// What the map says of a node.
#[derive(Clone, Copy)]
struct Node {
    status: Status,
    /// Direction of t − ρ u where it slips.
    d: [f64; 2],
    /// (1 − a)/(a ρ), m/N; 0 where it sticks.
    soft: f64,
    mu: f64,
    /// −p dμ/d|u| where it slips, N/m: traction along d per motion along d.
    feed: f64,
}

/// The map at an iterate.
struct Seen {
    nodes: Vec<Node>,
    /// Coefficients of friction, `[k]`.
    friction: Vec<f64>,
    /// Pressures that lack to the load, N; 0 where none is prescribed.
    lack: f64,
    norm: f64,
    largest: f64,
}

/// An iterate.
struct Iterate {
    /// Reactions, N, `[3k]`.
    x: Vec<f64>,
    /// Shift of the gaps, m; 0 where no load is prescribed.
    shift: f64,
    /// W x, m, `[3k]`.
    y: Vec<f64>,
}

/// Solves to the largest residual `target`, N, from the reactions `x` and their response `y` = W x where it is known (to
/// rounding), and the shift of the gaps. The last reactions and shift where the method stalls or the problem is not for it. No tangential
/// totals may be prescribed.
pub(super) fn solve(
    p: &StepProblem<'_>,
    target: f64,
    (x, y): (Vec<f64>, Option<Vec<f64>>),
    shift: f64,
    memory: &mut Kept,
    effort: &mut Effort,
) -> Result<StepSolution, (Vec<f64>, f64)> {
    let product = |x: &[f64], effort: &mut Effort| {
        let mut y = vec![0.0; x.len()];
        p.matrix.times(x, &mut y);
        effort.products += 1;
        y
    };
    let Kept { parts, old } = memory;
    let parts = parts.get_or_insert_with(|| Operators::new(p, old.take()));
    if parts.rho.iter().any(|r| !(r.tangential > 0.0 && r.normal.is_finite())) {
        return Err((x, shift));
    }
    // What the norm fell by in the last iteration. Of the first one nothing is known but whether it begins near the solution.
    let mut progress = 0.0f64;
    let mut exact = y.is_none();
    let mut now = if x.iter().any(|v| *v != 0.0) {
        let y = y.unwrap_or_else(|| product(&x, effort));
        Iterate { x, shift, y }
    } else {
        progress = 0.3;
        exact = true;
        let found = start::start(parts, p, shift, effort);
        Iterate { y: product(&found.x, effort), ..found }
    };
    let (mut last, mut stalled) = (f64::INFINITY, 0);
    for _ in 0..12 {
        let mut seen = look(p, &parts.rho, &now);
        if parts.approach(p, &seen, &mut now) {
            seen = look(p, &parts.rho, &now);
        }
        if seen.largest <= target {
            if exact {
                return Ok(solution(now, seen));
            }
            now.y = product(&now.x, effort);
            exact = true;
            continue;
        }
        // A change of status may raise the norm once; what does not fall then is not for this method.
        if !(seen.norm < 0.7 * last) {
            stalled += 1;
            if stalled > 1 || !(seen.norm < 3.0 * last) {
                break;
            }
        }
        if last.is_finite() {
            progress = (seen.norm / last).min(1.0);
        }
        last = seen.norm;
        effort.iterations += 1;
        // No linear system has to be solved better than the laws are linear, nor than the target asks.
        let forcing = (0.3 * target / seen.largest).max(progress * progress).clamp(1e-3, 0.1) as f32;
        parts.step(p, &seen, &mut now, forcing, effort);
        now.y = product(&now.x, effort);
        exact = true;
    }
    Err((now.x, now.shift))
}

fn solution(mut now: Iterate, seen: Seen) -> StepSolution {
    // What is left on open nodes is below the residual.
    for (r, _) in now.x.chunks_exact_mut(3).zip(&seen.nodes).filter(|(_, n)| n.status == Status::Open) {
        r.fill(0.0);
    }
    let status = seen.nodes.iter().map(|n| n.status).collect();
    let (friction, residual) = (seen.friction, seen.largest);
    StepSolution { reaction: now.x, shift: [0.0, 0.0, now.shift], response: now.y, status, friction, residual }
}

/// The map at an iterate.
fn look(p: &StepProblem<'_>, rho: &[Augmentation], now: &Iterate) -> Seen {
    let lack = p.total[2].map_or(0.0, |n| n - now.x[2..].iter().step_by(3).sum::<f64>());
    let (mut square, mut largest) = (lack * lack / rho.len() as f64, lack * lack);
    let moved = |i: usize| [0, 1].map(|c| p.free[3 * i + c] + now.y[3 * i + c]);
    let velocities = || (0..rho.len()).map(|i| size(moved(i)) / p.step).collect::<Vec<f64>>();
    // What is constant takes no time.
    let (friction, slopes) = match p.friction {
        FrictionLaw::Constant(mu) => (vec![*mu; rho.len()], Vec::new()),
        FrictionLaw::Varying(_) => p.coefficients_with_slopes(&velocities()),
    };
    let nodes = (0..rho.len())
        .map(|i| {
            let r = &now.x[3 * i..3 * i + 3];
            let [x, y] = moved(i);
            let at = node(r, &[x, y, p.free[3 * i + 2] + now.y[3 * i + 2] + now.shift]);
            let found = at.project(rho[i], friction[i]);
            let f = found.map(&at);
            let tangential = f[0] * f[0] + f[1] * f[1];
            square += tangential + f[2] * f[2];
            largest = largest.max(tangential).max(f[2] * f[2]);
            let (mut d, mut soft, mut mu, mut feed) = ([1.0, 0.0], 0.0, 0.0, 0.0);
            let mut status = found.status;
            if let (Status::Stick | Status::Slip, Tangent::Slip(slip)) = (status, found.tangent(&at, 0.0)) {
                // Without friction nothing is left to turn: a row t_e = 0 is as good.
                let creep = slip.across[1].max(1e-9 * rho[i].tangential);
                (d, soft, mu) = (slip.direction.map(|t| -t), slip.across[0] / creep, slip.friction);
                feed = slopes.get(i).map_or(0.0, |slope| -found.pressure * slope);
                status = Status::Slip;
            }
            Node { status, d, soft, mu, feed }
        })
        .collect();
    // The larger of NaN and a number is the number: it must not pass for a small residual.
    let largest = if square.is_finite() { largest.sqrt() } else { f64::INFINITY };
    Seen { nodes, friction, lack, norm: square.sqrt(), largest }
}

impl Operators {
    fn new(p: &StepProblem<'_>, old: Option<Self>) -> Self {
        let rho: Vec<Augmentation> = (0..p.nodes()).map(|i| p.rho(i)).collect();
        let spare = old.and_then(|o| o.tangential.or(o.spare));
        Self { rho, normal: Normal::new(p.nodes()), tangential: None, spare }
    }

    /// Where a load is given and no node is closed: lets the nearest one touch with that load. Whether it had to.
    fn approach(&self, p: &StepProblem<'_>, seen: &Seen, now: &mut Iterate) -> bool {
        let Some(load) = p.total[2].filter(|_| seen.nodes.iter().all(|n| n.status == Status::Open)) else {
            return false;
        };
        let gap = |i: usize| p.free[3 * i + 2] + now.y[3 * i + 2];
        let Some(i) = (0..seen.nodes.len()).min_by(|&a, &b| gap(a).total_cmp(&gap(b))) else { return false };
        now.shift = -gap(i) - load / self.rho[i].normal;
        true
    }

    /// Newton's step; leaves the response as it was.
    fn step(&mut self, p: &StepProblem<'_>, seen: &Seen, now: &mut Iterate, forcing: f32, effort: &mut Effort) {
        let (k, nodes, unit) = (self.rho.len(), &seen.nodes, p.matrix.unit());
        // Displacements once the reactions of open nodes are gone.
        let mut u: Vec<f64> = p.free.iter().zip(&now.y).map(|(f, y)| f + y).collect();
        let open: Vec<usize> = (0..k).filter(|&i| nodes[i].status == Status::Open).collect();
        let mut lack = seen.lack;
        for c in open.iter().flat_map(|i| 3 * i..3 * i + 3) {
            let gone = std::mem::take(&mut now.x[c]);
            if gone != 0.0 {
                u.iter_mut().zip(p.matrix.col(c)).for_each(|(u, w)| *u -= w * gone);
                lack += if c % 3 == 2 { gone } else { 0.0 };
            }
        }
        effort.solutions += 1;
        if self.normal.wants_inverse() {
            self.normal.invert(p.matrix.gaps(), |i, j| {
                let (n, d) = (p.matrix.col(3 * i + 2), nodes[j].d);
                (nodes[j].mu * (d[0] * n[3 * j] + d[1] * n[3 * j + 1]) / unit) as f32
            });
        }
        let per_unit = -1.0 / unit;
        let mut gap = Lines::from(u[2..].iter().step_by(3).map(|u| ((u + now.shift) * per_unit) as f32));
        open.iter().for_each(|&i| gap[i] = 0.0);
        let wanted = Wanted { gap, total: p.total[2].map(|_| lack as f32) };
        let (pressure, nearer) = self.normal.press(p.matrix.gaps(), open, wanted, forcing, effort);
        now.shift -= unit * f64::from(nearer);
        self.slide(p, seen, (&u, &pressure), &mut now.x, forcing, effort);
        now.x[2..].iter_mut().step_by(3).zip(pressure.iter()).for_each(|(x, q)| *x += f64::from(*q));
    }

    /// Newton's step on the tractions of `x` at the displacements `u`, while the pressures change by `pressure`.
    fn slide(
        &mut self,
        p: &StepProblem<'_>,
        seen: &Seen,
        (u, pressure): (&[f64], &[f32]),
        x: &mut [f64],
        forcing: f32,
        effort: &mut Effort,
    ) {
        let (l, nodes, unit) = (p.matrix.places(), &seen.nodes, p.matrix.unit());
        let tangential = match &mut self.tangential {
            Some(tangential) => {
                tangential.follow(p.matrix, nodes, forcing);
                tangential
            }
            none => none.insert(Tangential::new(p.matrix, nodes, self.spare.take())),
        };
        // Tractions along the direction of slip follow from the pressures.
        let (mut along, mut rhs, mut soft) = (Lines::zeros(l), Lines::zeros(2 * l), Lines::zeros(l));
        // In newtons, as everything here.
        let per_unit = 1.0 / unit;
        for (i, node) in nodes.iter().enumerate() {
            let r = &x[3 * i..3 * i + 3];
            let v = [u[3 * i] * per_unit, u[3 * i + 1] * per_unit];
            match node.status {
                Status::Open => {}
                Status::Stick => {
                    let d = tangential.direction(i);
                    let e = across(d);
                    rhs[i] = -(e[0] * v[0] + e[1] * v[1]) as f32;
                    rhs[l + i] = -(d[0] * v[0] + d[1] * v[1]) as f32;
                }
                Status::Slip => {
                    let (d, e) = (node.d, across(node.d));
                    along[i] = (node.mu * (r[2] + f64::from(pressure[i])) - (d[0] * r[0] + d[1] * r[1])) as f32;
                    // The row of the map is (1 − a) t_e + a ρ u_e.
                    let softness = node.soft * per_unit;
                    rhs[i] = -(e[0] * v[0] + e[1] * v[1] + softness * (e[0] * r[0] + e[1] * r[1])) as f32;
                    soft[i] = softness as f32;
                }
            }
        }
        tangential.subtract(nodes, &along, pressure, &mut rhs);
        let mut found = tangential.solve(nodes, &soft, &rhs, forcing, effort);
        if nodes.iter().any(|n| n.feed != 0.0) {
            let feed: Vec<f32> = nodes.iter().map(|n| (n.feed * unit) as f32).collect();
            tangential.feed(
                nodes,
                &feed,
                (&mut along, &mut found, pressure),
                (&soft, dot(&rhs, &rhs).sqrt(), forcing),
                effort,
            );
        }
        for (i, node) in nodes.iter().enumerate().filter(|(_, n)| n.status != Status::Open) {
            let (d, along) = match node.status {
                Status::Stick => (tangential.direction(i), found[l + i]),
                _ => (node.d, along[i]),
            };
            let (e, along, across) = (across(d), f64::from(along), f64::from(found[i]));
            x[3 * i] += d[0] * along + e[0] * across;
            x[3 * i + 1] += d[1] * along + e[1] * across;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::half_space::HalfSpace;
    use crate::friction::Exponential;
    use crate::grid::Interface;
    use crate::model::combined_compliance;
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
        let falling = FrictionLaw::from(Exponential::new(0.35, 0.25, 0.3));
        for (other, friction) in [
            (&steel, FrictionLaw::Constant(0.3)),
            (&hard, FrictionLaw::Constant(0.3)),
            (&hard, FrictionLaw::Constant(0.0)),
            (&steel, falling.clone()),
            (&hard, falling),
        ] {
            let w = combined_compliance(steel.as_ref(), other.as_ref()).unwrap();
            let columns: Vec<f64> = (0..3 * s.len()).flat_map(|j| w.col_as_slice(j).to_vec()).collect();
            let matrix = &Operator::new(columns);
            let mut memory = Memory::default();
            let mut guess = vec![0.0; 3 * s.len()];
            for step in 0..4 {
                let free = displacements(&s, (8.0 + 0.01 * step as f64) * 1e-5, (1.0 + 0.01 * step as f64) * 1.2e-5);
                let tolerance = 1e-11;
                let (friction, before) = (&friction, &[][..]);
                let p = StepProblem { matrix, free: &free, friction, before, step: 1e-5, total: [None; 3], tolerance };
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
                let [open, stick, slip] = [Status::Open, Status::Stick, Status::Slip].map(count);
                let enough = open > 10 && slip > 5 && (stick > 5 || *friction == FrictionLaw::Constant(0.0));
                assert!(enough, "{friction:?}: {open} open, {stick} in stick, {slip} in slip");
                if step > 0 && friction.is_constant() {
                    assert!(effort.factorisations == 0 && effort.products <= 8, "step {step}: {effort:?}");
                }
                // The same with the load given and the approach unknown: from nothing, from bodies far apart, and from what is known.
                let loaded = StepProblem { total: [None, None, Some(normal)], ..p };
                let nothing = vec![0.0; 3 * s.len()];
                for (guess, known) in [(&nothing, 2e-6), (&nothing, 1e-3), (&guess, 1e-3), (&guess, -1e-7)] {
                    let (mut effort, mut memory) = (Effort::default(), Memory::default());
                    let found = loaded
                        .solve(ContactSolver::Newton, guess, None, [0.0, 0.0, known], &mut memory, &mut effort)
                        .unwrap();
                    let off = found.reaction.iter().zip(&reference.reaction).map(|(a, b)| (a - b).abs());
                    let off = off.fold(0.0, f64::max);
                    assert!(
                        off < 1e-8 * 0.25 * normal,
                        "{friction:?}, step {step}, load given: {off:e} of {normal:e} N"
                    );
                    assert!(found.shift[2].abs() < 1e-9 * 8e-5, "shift {:e}", found.shift[2]);
                    assert!(effort.factorisations == 0 || !friction.is_constant(), "step {step}: {effort:?}");
                }
                guess = found.reaction;
            }
        }
    }

    /// A millinewton on unlike bodies rests on one node, whatever is known of the approach.
    #[test]
    fn a_small_load_rests_on_one_node() {
        let s = Interface::paraboloid(9, 9, [6e-3; 2], [4.0; 2]).unwrap();
        let steel = HalfSpace { young: 205e9, poisson: 0.3 }.compliance(&s.x, &s.y).unwrap();
        let hard = HalfSpace { young: 205e13, poisson: 0.3 }.compliance(&s.x, &s.y).unwrap();
        let w = combined_compliance(steel.as_ref(), hard.as_ref()).unwrap();
        let matrix = &Operator::new((0..3 * s.len()).flat_map(|j| w.col_as_slice(j).to_vec()).collect());
        let free = displacements(&s, 0.0, 1e-6);
        let (friction, load) = (FrictionLaw::Constant(0.3), 1e-3);
        let p = StepProblem {
            matrix,
            free: &free,
            friction: &friction,
            before: &[],
            step: 1e-5,
            total: [None, None, Some(load)],
            tolerance: 1e-10,
        };
        for known in [-1e-4, 0.0, 1e-4] {
            let (mut effort, mut memory) = (Effort::default(), Memory::default());
            let guess = vec![0.0; 3 * s.len()];
            let shift = [0.0, 0.0, known];
            let found = p.solve(ContactSolver::Newton, &guess, None, shift, &mut memory, &mut effort).unwrap();
            let closed: Vec<usize> = (0..s.len()).filter(|&i| found.status[i] != Status::Open).collect();
            assert_eq!(closed, [40], "from a shift of {known}");
            let r = &found.reaction[120..123];
            assert!((r[2] - load).abs() < 1e-12 && (size([r[0], r[1]]) - 0.3 * load).abs() < 1e-12, "{r:?}");
            // The gap of the middle node is closed.
            assert!((s.gap[40] + found.response[122] + found.shift[2]).abs() < 1e-18, "{:?}", found.shift);
            assert_eq!(effort.factorisations, 0, "{effort:?}");
        }
    }
}
