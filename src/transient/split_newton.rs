//! Newton's method on the natural map of a step, its linear systems solved in parts.
//!
//! At a node that slips the direction d of t − ρ u says what the traction does: along d it follows the pressure, t =
//! μ p, across it the creep turns it: with e ⟂ d and a = μ q/|t − ρ u| the row of the map is (1 − a) δt_e + a ρ δu_e.
//! So only one tangential unknown is left at a node that slips, two where it sticks, and their operator Eᵀ W_tt E +
//! diag((1 − a)/(a ρ)) is symmetric and positive definite: conjugate gradients solve it. Normal unknowns feel the
//! ones across the creep only through W_nt, which is small for bodies that are nearly alike; the part of W_nt that
//! friction multiplies is in the inverse of W_nn + μ W_nt d, which is kept while the nodes are the same. Friction
//! that depends on the velocity ties the traction along d to the motion along it, t = μ p − (p dμ/d|u|) d·u, and so
//! to all others. Where a step is well-posed that is a contraction, much of it where the coefficient is remembered
//! over more than a step: it is followed in turn with the unknowns across. Tangential forces are not treated here.
//! What is neglected is made good by the next iteration, whose residual comes from a product with all of W; so single
//! precision is enough here.

use pulp::{Arch, Simd, WithSimd};

use super::aligned::AlignedVec;
use super::problem::{Effort, StepProblem, StepSolution};
use super::structure_of_arrays::{lane, lanes, lanes_mut, SoaVec3};
use crate::dense::dot;
use natural_map::NaturalMap;
use normal::{NormalProblem, WantedGaps};
use tangential::TangentialProblem;

mod krylov;
mod natural_map;
mod normal;
mod start;
mod tangential;

/// Operators kept for the following steps on the same nodes.
struct SplitNewton {
    seen: NaturalMap,
    normal: NormalProblem,
    /// Once directions are known.
    tangential: Option<TangentialProblem>,
    /// Memory for it.
    spare: Option<TangentialProblem>,
}

/// The parts, and others whose memory can be used again.
#[derive(Default)]
pub(super) struct SolverCache {
    parts: Option<SplitNewton>,
    old: Option<SplitNewton>,
}

impl SolverCache {
    /// Forgets everything but the memory.
    pub(super) fn forget(&mut self) {
        self.old = self.parts.take().or(self.old.take());
    }
}

/// An iterate.
struct Iterate {
    /// Reactions, N.
    x: SoaVec3,
    /// Shifts of the borders, m, `[borders]`.
    shift: Vec<f64>,
    /// W x, m.
    y: SoaVec3,
}

/// Solves to the largest residual `target`, N, from the reactions `x` and their response `y` = W x where it is known
/// (to rounding), and the shifts of the borders, all of them along the normal. The last reactions and shifts where the
/// method stalls or the problem is not for it.
pub(super) fn solve(
    p: &StepProblem<'_>,
    target: f64,
    (x, y): (&[f64], Option<&[f64]>),
    shift: &[f64],
    memory: &mut SolverCache,
    effort: &mut Effort,
) -> Result<StepSolution, (Vec<f64>, Vec<f64>)> {
    let (k, l) = (p.nodes(), p.matrix.places());
    let SolverCache { parts, old } = memory;
    let parts = parts.get_or_insert_with(|| SplitNewton::new(p, old.take()));
    if !parts.seen.moves() {
        return Err((x.to_vec(), shift.to_vec()));
    }
    parts.seen.pose(p);
    // What the norm fell by in the last iteration. Of the first one nothing is known but whether it begins near the
    // solution.
    let mut progress = 0.0f64;
    let mut exact = y.is_none();
    let mut now = if x.iter().any(|v| *v != 0.0) {
        let y = match y {
            Some(y) => SoaVec3::from_interleaved(y, l),
            None => SoaVec3::from_interleaved(&product(p, x, effort), l),
        };
        Iterate { x: SoaVec3::from_interleaved(x, l), shift: shift.to_vec(), y }
    } else {
        progress = 0.3;
        exact = true;
        let mut found = start::start(parts, p, shift, effort);
        found.respond(p, effort);
        found
    };
    let (mut last, mut stalled) = (f64::INFINITY, 0);
    for _ in 0..12 {
        parts.seen.look(p, &now);
        if parts.approach(p, &mut now) {
            parts.seen.look(p, &now);
        }
        let NaturalMap { norm, largest, .. } = parts.seen;
        if largest <= target {
            if exact {
                return Ok(solution(p, now, &parts.seen));
            }
            now.respond(p, effort);
            exact = true;
            continue;
        }
        // A change of status may raise the norm once; what does not fall then is not for this method.
        if !(norm < 0.7 * last) {
            stalled += 1;
            if stalled > 1 || !(norm < 3.0 * last) {
                break;
            }
        }
        if last.is_finite() {
            progress = (norm / last).min(1.0);
        }
        last = norm;
        effort.iterations += 1;
        // No linear system has to be solved better than the laws are linear, nor than the target asks.
        let forcing = (0.3 * target / largest).max(progress * progress).clamp(1e-3, 0.1) as f32;
        parts.step(p, &mut now, forcing, effort);
        now.respond(p, effort);
        exact = true;
    }
    Err((now.x.give(k), now.shift))
}

/// W `x`.
fn product(p: &StepProblem<'_>, x: &[f64], effort: &mut Effort) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    p.matrix.times(x, &mut y);
    effort.products += 1;
    y
}

impl Iterate {
    /// Makes the response the one to the reactions.
    fn respond(&mut self, p: &StepProblem<'_>, effort: &mut Effort) {
        self.y.assign(&product(p, &self.x.give(p.nodes()), effort));
    }
}

fn solution(p: &StepProblem<'_>, mut now: Iterate, seen: &NaturalMap) -> StepSolution {
    // What is left on open nodes is below the residual.
    for i in seen.open() {
        (0..3).for_each(|c| now.x.row_mut(c)[i] = 0.0);
    }
    let k = p.nodes();
    let friction = if p.friction.is_constant() { Vec::new() } else { seen.friction().to_vec() };
    StepSolution {
        reaction: now.x.give(k),
        shift: now.shift,
        response: now.y.give(k),
        status: (0..k).map(|i| seen.status(i)).collect(),
        friction,
        residual: seen.largest,
    }
}

impl SplitNewton {
    fn new(p: &StepProblem<'_>, old: Option<Self>) -> Self {
        let spare = old.and_then(|o| o.tangential.or(o.spare));
        Self { seen: NaturalMap::new(p), normal: NormalProblem::new(p.nodes()), tangential: None, spare }
    }

    /// If a load is given and no node that its shift moves is closed, lets the nearest one touch with that load.
    /// Returns whether it had to.
    fn approach(&self, p: &StepProblem<'_>, now: &mut Iterate) -> bool {
        let (seen, mut had_to) = (&self.seen, false);
        for (b, border) in p.borders.iter().enumerate() {
            let column = |i: usize| border.column[p.patch_of(i)][2];
            let moved = || (0..p.nodes()).filter(|&i| column(i) > 0.0);
            if !(border.total > 0.0) || moved().next().is_none() || moved().any(|i| seen.closed[i] > 0.0) {
                continue;
            }
            // The gap of a node without this shift, per unit of it: the first to touch has the largest shift.
            let own = |i: usize| {
                let others = p.shifted(i, &now.shift)[2] - column(i) * now.shift[b];
                -(seen.u.row(2)[i] + others) / column(i)
            };
            let Some(i) = moved().max_by(|&i, &j| own(i).total_cmp(&own(j)).then(j.cmp(&i))) else { continue };
            now.shift[b] = own(i) - border.total / (seen.rho(i).normal * column(i));
            had_to = true;
        }
        had_to
    }

    /// Newton's step; leaves the response as it was.
    fn step(&mut self, p: &StepProblem<'_>, now: &mut Iterate, forcing: f32, effort: &mut Effort) {
        let (seen, unit) = (&mut self.seen, p.matrix.unit());
        // Displacements once the reactions of open nodes are gone.
        let open = seen.open();
        let mut lack = seen.lack.clone();
        for (i, c) in open.iter().flat_map(|&i| [0, 1, 2].map(|c| (i, c))) {
            let gone = std::mem::take(&mut now.x.row_mut(c)[i]);
            if gone != 0.0 {
                let column = p.matrix.col(3 * i + c);
                for r in 0..3 {
                    let rows = column[r..].iter().step_by(3);
                    seen.u.row_mut(r).iter_mut().zip(rows).for_each(|(u, w)| *u -= w * gone);
                }
                lack.iter_mut().zip(p.borders).for_each(|(l, b)| *l += b.row[p.patch_of(i)][c] * gone);
            }
        }
        effort.solutions += 1;
        if self.normal.wants_inverse() {
            let (mu, [dx, dy]) = (&seen.mu, &seen.direction);
            self.normal.invert(p.matrix.gaps(), |i, j| {
                let n = p.matrix.col(3 * i + 2);
                (mu[j] * (dx[j] * n[3 * j] + dy[j] * n[3 * j + 1]) / unit) as f32
            });
        }
        let mut gap = AlignedVec::zeros(p.matrix.places());
        Arch::new().dispatch(Gaps { seen, per_unit: -1.0 / unit, gap: &mut gap });
        let borders = seen.normal_borders(p, &now.x, &mut lack);
        let lack = lack.iter().map(|l| *l as f32).collect();
        let wanted = WantedGaps { gap, lack };
        let (pressure, nearer) = self.normal.press((p.matrix.gaps(), &borders), open, wanted, forcing, effort);
        now.shift.iter_mut().zip(&nearer).for_each(|(s, n)| *s -= unit * f64::from(*n));
        self.slide(p, &pressure, &mut now.x, forcing, effort);
        now.x.row_mut(2).iter_mut().zip(pressure.iter()).for_each(|(x, q)| *x += f64::from(*q));
    }

    /// Newton's step on the tractions of `x` at the displacements that were seen, while the pressures change by
    /// `pressure`, `[l]`.
    fn slide(&mut self, p: &StepProblem<'_>, pressure: &[f32], x: &mut SoaVec3, forcing: f32, effort: &mut Effort) {
        let (l, seen, unit) = (p.matrix.places(), &self.seen, p.matrix.unit());
        let tangential = match &mut self.tangential {
            Some(tangential) => {
                tangential.follow(p.matrix, seen, forcing);
                tangential
            }
            none => none.insert(TangentialProblem::new(p.matrix, seen, self.spare.take())),
        };
        // Tractions along the direction of slip follow from the pressures.
        let (mut along, mut rhs, mut soft) = (AlignedVec::zeros(l), AlignedVec::zeros(2 * l), AlignedVec::zeros(l));
        Arch::new().dispatch(TangentialRhs {
            seen,
            still: tangential.directions(),
            x,
            pressure,
            per_unit: 1.0 / unit,
            along: &mut along,
            rhs: &mut rhs,
            soft: &mut soft,
        });
        let stick = seen.sticking();
        tangential.subtract((seen, &stick), &along, pressure, &mut rhs);
        let mut found = tangential.solve((seen, &stick), &soft, &rhs, forcing, effort);
        if !seen.feed.is_empty() {
            let feed: Vec<f32> = seen.feed.iter().map(|f| (f * unit) as f32).collect();
            tangential.feed(
                (seen, &stick),
                &feed,
                (&mut along, &mut found, pressure),
                (&soft, dot(&rhs, &rhs).sqrt(), forcing),
                effort,
            );
        }
        // Along d the unknowns of nodes that stick.
        for &i in &stick {
            along[i] = found[l + i];
        }
        let found = &found[..l];
        Arch::new().dispatch(TractionUpdate { seen, still: tangential.directions(), along: &along, across: found, x });
    }
}

/// Gaps that pressures have to close, over minus the unit; 0 at open nodes.
struct Gaps<'a> {
    seen: &'a NaturalMap,
    per_unit: f64,
    gap: &'a mut [f32],
}

impl WithSimd for Gaps<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { seen, per_unit, gap } = self;
        let [_, _, u] = seen.u.lanes();
        let (closed, shift) = (lanes(&seen.closed, u.len()), lanes(&seen.shift, u.len()));
        let gap = lanes_mut(gap, u.len());
        for b in 0..u.len() {
            let (u, closed, shift) = (u[b], closed[b], shift[b]);
            gap[b] = lane(|k| if closed[k] > 0.0 { ((u[k] + shift[k]) * per_unit) as f32 } else { 0.0 });
        }
    }
}

/// Right-hand side of the tangential unknowns, in newtons as everything in single precision.
struct TangentialRhs<'a> {
    seen: &'a NaturalMap,
    /// Directions of the operator, which are those of nodes that stick.
    still: [&'a [f32]; 2],
    x: &'a SoaVec3,
    /// Changes of the pressures, N, `[l]`.
    pressure: &'a [f32],
    per_unit: f64,
    /// Changes of the tractions along the slip, N, `[l]`.
    along: &'a mut [f32],
    /// Minus the motion across and along d, `[2l]`.
    rhs: &'a mut [f32],
    /// Compliance added to the tangential diagonal, `[l]`.
    soft: &'a mut [f32],
}

impl WithSimd for TangentialRhs<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { seen, still, x, pressure, per_unit, along, rhs, soft } = self;
        let ([rx, ry, p], [ux, uy, _]) = (x.lanes(), seen.u.lanes());
        let blocks = rx.len();
        let (ry, p, ux, uy) = (&ry[..blocks], &p[..blocks], &ux[..blocks], &uy[..blocks]);
        let [dx, dy] = [0, 1].map(|c| lanes(&seen.direction[c], blocks));
        let [sx, sy] = still.map(|d| lanes(d, blocks));
        let [softness, mu] = [&seen.soft, &seen.mu].map(|row| lanes(row, blocks));
        let [closed, slips] = [&seen.closed, &seen.slips].map(|row| lanes(row, blocks));
        let more = lanes(pressure, blocks);
        let (across, held) = rhs.split_at_mut(along.len());
        let [along, across, held, soft] = [along, across, held, soft].map(|row| lanes_mut(row, blocks));
        for b in 0..blocks {
            let (rx, ry, p, ux, uy, more) = (rx[b], ry[b], p[b], ux[b], uy[b], more[b]);
            let [dx, dy, sx, sy] = [dx[b], dy[b], sx[b].map(f64::from), sy[b].map(f64::from)];
            let (closed, slips, mu) = (closed[b], slips[b], mu[b]);
            let softness = lane(|k| softness[b][k] * per_unit);
            let dx = lane(|k| if slips[k] > 0.0 { dx[k] } else { sx[k] });
            let dy = lane(|k| if slips[k] > 0.0 { dy[k] } else { sy[k] });
            let traction = lane(|k| dx[k] * rx[k] + dy[k] * ry[k]);
            let turned = lane(|k| dx[k] * ry[k] - dy[k] * rx[k]);
            let forward = lane(|k| (dx[k] * ux[k] + dy[k] * uy[k]) * per_unit);
            let aside = lane(|k| (dx[k] * uy[k] - dy[k] * ux[k]) * per_unit);
            // The row of the map is (1 − a) t_e + a ρ u_e.
            let wanted = lane(|k| -(aside[k] + softness[k] * turned[k]) as f32);
            let follows = lane(|k| (mu[k] * (p[k] + f64::from(more[k])) - traction[k]) as f32);
            along[b] = lane(|k| if slips[k] > 0.0 { follows[k] } else { 0.0 });
            across[b] = lane(|k| if closed[k] > 0.0 { wanted[k] } else { 0.0 });
            held[b] = lane(|k| if closed[k] > slips[k] { -forward[k] as f32 } else { 0.0 });
            soft[b] = lane(|k| softness[k] as f32);
        }
    }
}

/// Adds changes of tractions along and across the directions, N, `[l]` each, to the reactions.
struct TractionUpdate<'a> {
    seen: &'a NaturalMap,
    still: [&'a [f32]; 2],
    along: &'a [f32],
    across: &'a [f32],
    x: &'a mut SoaVec3,
}

impl WithSimd for TractionUpdate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { seen, still, along, across, x } = self;
        let [tx, ty, _] = x.lanes_mut();
        let blocks = tx.len();
        let ty = &mut ty[..blocks];
        let [dx, dy] = [0, 1].map(|c| lanes(&seen.direction[c], blocks));
        let [sx, sy] = still.map(|d| lanes(d, blocks));
        let [slips, along, across] = [&seen.slips, along, across].map(|row| lanes(row, blocks));
        for b in 0..blocks {
            let [dx, dy, sx, sy] = [dx[b], dy[b], sx[b].map(f64::from), sy[b].map(f64::from)];
            let (slips, along, across) = (slips[b], along[b].map(f64::from), across[b].map(f64::from));
            let dx = lane(|k| if slips[k] > 0.0 { dx[k] } else { sx[k] });
            let dy = lane(|k| if slips[k] > 0.0 { dy[k] } else { sy[k] });
            let (x, y) = (tx[b], ty[b]);
            tx[b] = lane(|k| x[k] + dx[k] * along[k] - dy[k] * across[k]);
            ty[b] = lane(|k| y[k] + dy[k] * along[k] + dx[k] * across[k]);
        }
    }
}

#[cfg(test)]
mod tests;
