//! Steady sliding of the whole contact: the state about which stability is examined (`docs/explanation/stability.md`).
//!
//! Every closed node slides along τ, so that t = −μ p τ, and the pressure follows from the nonsymmetric problem
//! g = g0 − N d + (W_nn − W_nt μ τ) p ≥ 0 ⟂ p ≥ 0, with the rigid motions d of the loads.

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};

use super::active_set::settle;
use super::influence::row;
use super::interface::{PatchKinematics, Stencil, Upstream};
use super::law::{LinearContact, LinearNode, Slip, Tangent};
use super::loads::{Loads, NormalLoad};
use super::memory::{self, coefficients, SlidingNode};
use super::normal::{patches, rest_on_a_node, rounds, solve_normal, undetermined};
use super::patch::refuse_border;
use super::steady::PatchResultant;
use crate::dense::dot;
use crate::friction::PatchFriction;
use crate::grid::Interface;
use crate::{Error, Result};

/// Which way the nodes slide.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SlidingDirection {
    /// Along the rigid creep, τ = c/|c|, at the velocity |c|.
    #[default]
    Rigid,
    /// Along the creep of the deformed bodies, ṡ0 = c + V ∂w0/∂x, by a fixed point; refused where ṡ0·c ≤ 0, since such
    /// nodes would stick.
    Actual,
}

/// A problem of steady sliding on an interface of n nodes.
#[derive(Debug, Clone)]
pub struct SlidingProblem<'a> {
    /// The interface.
    pub interface: &'a Interface,
    /// Influence matrix W, m/N, `[3n, 3n]`, as in [`super::SteadyProblem`].
    pub compliance: MatRef<'a, f64>,
    /// Friction law of each patch.
    pub friction: PatchFriction,
    /// Rolling speed V > 0 and creepages of each patch, `[patches]`.
    pub kinematics: Vec<PatchKinematics>,
    /// Loads or approaches.
    pub loads: Loads,
    /// Upstream operator.
    pub stencil: Stencil,
    /// Direction of sliding.
    pub direction: SlidingDirection,
}

/// Steady sliding on n nodes.
#[derive(Debug, Clone)]
pub struct SlidingSolution {
    /// Pressure, Pa, `[n]`.
    pub pressure: Vec<f64>,
    /// Traction on body 1, Pa, `[n][2]`.
    pub traction: Vec<[f64; 2]>,
    /// Closed nodes, ascending, `[k]`.
    pub closed: Vec<usize>,
    /// Sliding direction τ of the closed nodes, `[k][2]`.
    pub direction: Vec<[f64; 2]>,
    /// Sliding velocity of the closed nodes, m/s, `[k]`.
    pub velocity: Vec<f64>,
    /// Coefficient of friction, 1, `[n]`; at open nodes that at rest.
    pub friction: Vec<f64>,
    /// Contact force on body 1, N: (x, y, z); the third is minus the normal force. Of several patches the sum of the
    /// components, each in the frame of its patch.
    pub force: [f64; 3],
    /// Moment of the tractions on body 1 about the z axes of the patches, N·m.
    pub moment_z: f64,
    /// Forces, moment and approach of each patch, `[patches]`.
    pub patches: Vec<PatchResultant>,
    /// Rigid motions, m, `[motions]`; 0 of those that bear nothing.
    pub motions: Vec<f64>,
    /// Creep velocity of the deformed bodies, c + V ∂w/∂x, m/s, `[n][2]`.
    pub creep: Vec<[f64; 2]>,
    /// Number of closed nodes whose creep in the deformed state points against τ: were the state computed with stick,
    /// they would stick.
    pub reversed: usize,
    /// Relative tangential displacement w, m, `[n][2]`.
    pub w: Vec<[f64; 2]>,
    /// Gap of the deformed bodies, m, `[n]`.
    pub gap: Vec<f64>,
    /// The upstream operator of this contact.
    pub upstream: Upstream,
}

impl SlidingProblem<'_> {
    /// Solves for the sliding state.
    pub fn solve(&self) -> Result<SlidingSolution> {
        let s = self.interface;
        let n = s.len();
        if self.compliance.shape() != (3 * n, 3 * n) || self.kinematics.len() != s.patches.len() {
            return Err(Error::Defect(format!(
                "steady sliding: an influence matrix of {:?} entries and {} rolling speeds for {n} nodes on {} patches",
                self.compliance.shape(),
                self.kinematics.len(),
                s.patches.len()
            )));
        }
        for &PatchKinematics { speed, .. } in &self.kinematics {
            if !(s.are_points() || speed > 0.0 && speed.is_finite()) {
                return Err(Error::Job(format!("contact.speed is {speed}: it must be positive")));
            }
        }
        self.refuse_loads()?;
        let rigid = |i: usize| {
            let (creepage, own) = (s.rigid(&self.kinematics, i), s.creep(i));
            [0, 1].map(|c| creepage[c] * self.speed(i) + own[c])
        };
        // The creep that gives direction and velocity; the rigid one to begin with.
        let mut creep: Vec<[f64; 2]> = (0..n).map(rigid).collect();
        let mut closed = solve_normal(self.compliance.into(), s, &self.loads)?.closed;
        let mut change = f64::INFINITY;
        for round in 0..100 {
            let solution = self.with_creep(&creep, &mut closed)?;
            if self.direction == SlidingDirection::Rigid || change < 1e-10 {
                return Ok(solution);
            }
            change = 0.0;
            for &i in &solution.closed {
                let (new, c) = (solution.creep[i], rigid(i));
                let ahead = new[0] * c[0] + new[1] * c[1];
                if ahead <= 0.0 || ahead.is_nan() {
                    let [x, y] = s.point(i);
                    return Err(Error::Job(format!(
                        "contact.creepage: the node at x = {x:.4e} m, y = {y:.4e} m would stick, not slide: the \
                         deformation \
                         takes up its whole creep. Full sliding needs a larger creepage, less load or less friction"
                    )));
                }
                let size = new[0].hypot(new[1]);
                change = f64::max(change, (new[0] - creep[i][0]).hypot(new[1] - creep[i][1]) / size);
            }
            // Where the creep is small it may overshoot from step to step: then half the way.
            let way = if round < 8 { 1.0 } else { 0.5 };
            for (c, new) in creep.iter_mut().zip(&solution.creep) {
                *c = [0, 1].map(|k| c[k] + way * (new[k] - c[k]));
            }
        }
        Err(Error::NotConverged(format!(
            "steady sliding: the direction of sliding did not settle in 100 iterations, last change {change:.1e}"
        )))
    }

    /// Refuses loads that do not press.
    fn refuse_loads(&self) -> Result<()> {
        let pressing = |load: &NormalLoad| !matches!(load, NormalLoad::Force(f) if !(*f > 0.0 && f.is_finite()));
        let motions = &self.loads.motions;
        if !self.friction.fits(self.interface.patches.len()) {
            return Err(Error::Defect("steady sliding: the laws of friction are not those of the patches".into()));
        }
        match motions.first().map(|m| m.load) {
            Some(NormalLoad::Force(f)) if !motions.iter().any(|m| pressing(&m.load)) => {
                Err(Error::Job(format!("contact.normal_load is {f} N: sliding needs a pressing load")))
            }
            _ => self.loads.check(self.interface.patches.len(), self.friction.largest()),
        }
    }

    /// Rolling speed of the patch of node `i`, m/s.
    fn speed(&self, i: usize) -> f64 {
        self.kinematics[self.interface.patch_of(i)].speed
    }

    /// The state with direction and velocity of sliding given by `creep` (m/s, `[n][2]`); `closed` is a guess and
    /// becomes the closed set.
    fn with_creep(&self, creep: &[[f64; 2]], closed: &mut Vec<usize>) -> Result<SlidingSolution> {
        let s = self.interface;
        let n = s.len();
        let w = self.compliance;
        // Traction per pressure, −μ τ; where there is no creep only a closed node is wrong.
        let ratio = |mu: &[f64], i: usize| -> [f64; 2] {
            let c = creep[i];
            let v = c[0].hypot(c[1]);
            if v > 0.0 {
                c.map(|c| -mu[i] * c / v)
            } else {
                [0.0; 2]
            }
        };
        // What the material remembers depends on where it came in.
        let remembered = |closed: &[usize]| {
            let closed = |i: usize| closed.binary_search(&i).is_ok();
            coefficients(&self.friction, s, &self.kinematics, closed, |i| creep[i][0].hypot(creep[i][1]))
        };
        let limit = rounds(s);
        let patch = patches(s);
        let count = self.loads.motions.len();
        let displacement =
            |at: usize, reaction: &[f64]| -> f64 { row(w, at).map_or(f64::NAN, |row| dot(row, reaction)) };
        let settled = settle(std::mem::take(closed), limit, |closed| {
            rest_on_a_node(s, &self.loads, &patch, closed);
            if closed.is_empty() {
                return Err(Error::Job(
                    "contact.approach: the bodies do not touch; sliding needs a closed contact, increase the approach"
                        .into(),
                ));
            }
            let k = closed.len();
            let mu = remembered(closed);
            let ratios: Vec<[f64; 2]> = closed.iter().map(|&i| ratio(&mu, i)).collect();
            let a = Mat::from_fn(k, k, |i, j| {
                let (i, (j, [x, y])) = (closed[i], (closed[j], ratios[j]));
                w[(3 * i + 2, 3 * j + 2)] + w[(3 * i + 2, 3 * j)] * x + w[(3 * i + 2, 3 * j + 1)] * y
            });
            let mut solved = Mat::from_fn(k, count + 1, |i, c| match self.loads.motions.get(c) {
                Some(motion) => motion.factors[patch[closed[i]]],
                None => s.gap[closed[i]],
            });
            a.partial_piv_lu().solve_in_place(&mut solved);
            let bearing = |j: usize, i: usize| {
                let ([gx, gy, gn], [x, y]) = (self.loads.motions[j].resultant[patch[closed[i]]], ratios[i]);
                gn + gx * x + gy * y
            };
            let (force, motions) = self.loads.forces(&solved, bearing).ok_or_else(undetermined)?;
            let approach: Vec<f64> = (0..s.patches.len()).map(|c| self.loads.approach(&motions, c)).collect();
            let mut reaction = vec![0.0; 3 * n];
            let mut inside = vec![false; n];
            let mut next = Vec::new();
            for ((&i, &p), [x, y]) in closed.iter().zip(&force).zip(&ratios) {
                inside[i] = true;
                reaction[3 * i..3 * i + 3].copy_from_slice(&[x * p, y * p, p]);
                if p > 0.0 {
                    next.push(i);
                }
            }
            if reaction.iter().any(|v| !v.is_finite()) {
                return Err(Error::NotConverged(
                    "steady sliding: the normal compliance with friction is singular on the closed nodes; \
                     with this coefficient of friction the pressure is not determined"
                        .into(),
                ));
            }
            let gap: Vec<f64> =
                (0..n).map(|i| s.gap[i] - approach[patch[i]] + displacement(3 * i + 2, &reaction)).collect();
            let largest = |v: &[f64]| v.iter().fold(0.0f64, |m, g| m.max(g.abs()));
            let scale = largest(&approach) + largest(&s.gap);
            let enters = |i: &usize| !inside[*i] && !self.loads.is_open(patch[*i]) && gap[*i] < -1e-13 * scale;
            next.extend((0..n).filter(enters));
            next.sort_unstable();
            Ok((next, (reaction, gap, motions)))
        })?;
        let (found, (reaction, gap, motions)) = settled.map_err(|history| {
            Error::NotConverged(format!(
                "steady sliding: the set of closed nodes did not settle in {limit} iterations; nodes changed \
                 per iteration: {history:?}"
            ))
        })?;
        *closed = found;
        refuse_border(w.into(), s, &self.loads, closed)?;
        let tangential = (0..n).map(|i| [0, 1].map(|c| displacement(3 * i + c, &reaction))).collect();
        let friction = remembered(closed);
        let solution = self.solution(creep, closed, &reaction, motions, gap, tangential)?;
        Ok(SlidingSolution { friction, ..solution })
    }

    fn solution(
        &self,
        creep: &[[f64; 2]],
        closed: &[usize],
        reaction: &[f64],
        motions: Vec<f64>,
        gap: Vec<f64>,
        w: Vec<[f64; 2]>,
    ) -> Result<SlidingSolution> {
        let s = self.interface;
        let n = s.len();
        let (mut direction, mut velocity) = (Vec::new(), Vec::new());
        for &i in closed {
            let v = creep[i][0].hypot(creep[i][1]);
            if v <= 1e-12 * self.speed(i) || v.is_nan() {
                let [x, y] = s.point(i);
                return Err(Error::Job(format!(
                    "contact.creepage: no creep at the closed node x = {x:.4e} m, y = {y:.4e} m, so the \
                     direction of sliding is \
                     undefined; give a longitudinal or lateral creepage (spin alone has a pole inside the contact)"
                )));
            }
            direction.push(creep[i].map(|c| c / v));
            velocity.push(v);
        }
        let stress: Vec<f64> = (0..3 * n).map(|k| reaction[k] / s.weight[k / 3]).collect();
        let upstream = s.edge_upstream(self.stencil, &stress, |i| gap[i]);
        let actual: Vec<[f64; 2]> = (0..n)
            .map(|i| {
                let (c, own) = (s.rigid(&self.kinematics, i), s.creep(i));
                [0, 1].map(|q| self.speed(i) * (c[q] + upstream.derivative(i, |j| w[j][q])) + own[q])
            })
            .collect();
        let reversed =
            closed.iter().zip(&direction).filter(|(&i, t)| actual[i][0] * t[0] + actual[i][1] * t[1] <= 0.0).count();
        let approach: Vec<f64> = (0..s.patches.len()).map(|c| self.loads.approach(&motions, c)).collect();
        let patches = PatchResultant::of_patches(s, reaction, &approach);
        let (force, moment_z) = PatchResultant::total(&patches);
        Ok(SlidingSolution {
            pressure: (0..n).map(|i| stress[3 * i + 2]).collect(),
            traction: (0..n).map(|i| [stress[3 * i], stress[3 * i + 1]]).collect(),
            closed: closed.to_vec(),
            direction,
            velocity,
            friction: Vec::new(),
            force,
            moment_z,
            patches,
            motions,
            creep: actual,
            reversed,
            w,
            gap,
            upstream,
        })
    }

    /// The contact of `solution` linearised about it.
    pub fn contact(&self, solution: &SlidingSolution) -> LinearContact {
        let node = |((&i, &direction), &v): ((&usize, &[f64; 2]), &f64)| {
            let force = solution.pressure[i] * self.interface.weight[i];
            // What a law that falls does beyond that is in the memories.
            let slip = Slip::steady(force, direction, v, solution.friction[i], 0.0);
            let terms = solution.upstream.rows[i].iter().filter(|t| t.1 != 0.0);
            let convection = terms.map(|&(j, d)| (j, self.speed(i) * d)).collect();
            LinearNode { node: i, tangent: Tangent::Slip(slip), convection }
        };
        let sliding = |((&i, t), &v): ((&usize, &[f64; 2]), &f64)| SlidingNode {
            node: i,
            creep: t.map(|t| v * t),
            force: solution.pressure[i] * self.interface.weight[i],
            friction: solution.friction[i],
        };
        let closed = || solution.closed.iter().zip(&solution.direction).zip(&solution.velocity);
        let remembering: Vec<SlidingNode> = closed().map(sliding).collect();
        // About the rigid creep the deformed bodies are not looked at, so that neither is what moves their edge.
        let edges = match (self.direction, self.stencil) {
            (SlidingDirection::Actual, Stencil::Edge) => {
                self.interface.edges(&solution.closed, &solution.gap, &solution.w, &self.kinematics)
            }
            _ => Vec::new(),
        };
        LinearContact {
            nodes: closed().map(node).collect(),
            edges,
            memory: memory::linear(&self.friction, self.interface, &self.kinematics, &remembering),
        }
    }
}
