//! Steady rolling at one creepage after the other: each solution is the start of the next one.
//!
//! The stresses are taken on along the parabola through the last three solutions where these lie in one direction and
//! a node has the same status in all of them, else along the straight line through the last two, and cut at the bound
//! of friction. The influence matrix of the candidates is kept: it does not depend on the creepage.

use super::candidates::Candidates;
use super::interface::PatchKinematics;
use super::law::{project_disc, size, Status};
use super::steady::{StartStresses, SteadyProblem, SteadySolution};
use crate::Result;
use std::collections::VecDeque;

/// The course of a steady rolling contact over its creepages.
pub struct Continuation<'a> {
    problem: SteadyProblem<'a>,
    candidates: Option<Candidates<'a>>,
    /// The last solutions with their creepages, the latest first.
    last: VecDeque<(Vec<PatchKinematics>, SteadySolution)>,
}

impl<'a> Continuation<'a> {
    /// Continuation of `problem`, from rest.
    pub fn new(problem: SteadyProblem<'a>) -> Self {
        Self { problem, candidates: None, last: VecDeque::new() }
    }

    /// The problem at the creepage of the last solution.
    pub fn problem(&self) -> &SteadyProblem<'a> {
        &self.problem
    }

    /// The solution at other creepages of the patches, `[patches]`; where the last ones lead to none, from nothing.
    pub fn solve(&mut self, kinematics: Vec<PatchKinematics>) -> Result<SteadySolution> {
        self.problem.kinematics.clone_from(&kinematics);
        let found = match self.ahead(&kinematics) {
            Some(start) => self.problem.solve_with(Some(start), &mut self.candidates).or_else(|_| {
                self.candidates = None;
                self.problem.solve_with(None, &mut self.candidates)
            }),
            None => self.problem.solve_with(None, &mut self.candidates),
        };
        match &found {
            Ok(solution) => {
                self.last.truncate(2);
                self.last.push_front((kinematics, solution.clone()));
            }
            Err(_) => {
                self.candidates = None;
                self.last.clear();
            }
        }
        found
    }

    /// The stresses at the creepages `kinematics` by the last solutions.
    fn ahead(&self, kinematics: &[PatchKinematics]) -> Option<StartStresses> {
        let (here, last) = self.last.front().filter(|(_, s)| s.pressure.iter().any(|&p| p > 0.0))?;
        let mut start = StartStresses {
            stress: last.stresses(),
            motions: last.motions.clone(),
            friction: Some(last.friction.clone()),
        };
        let Some((there, before)) = self.last.get(1) else { return Some(start) };
        // Where the others are when the last one is at 0 and the one before it at −1.
        let past = distance(here, there);
        let place = |c: &[PatchKinematics]| dot(&distance(c, here), &past) / dot(&past, &past);
        let far = place(kinematics);
        if !(far.abs() <= 4.0) {
            return Some(start);
        }
        let line = [1.0 + far, -far, 0.0];
        let earlier = self.last.get(2).filter(|(c, _)| {
            let (along, off) = (place(c), distance(c, here));
            let aside: Vec<f64> = off.iter().zip(&past).map(|(o, p)| o - along * p).collect();
            // Beyond the others, in their direction, by a step like theirs; and on.
            (-4.0..=-1.25).contains(&along)
                && (0.0..=2.0).contains(&far)
                && dot(&aside, &aside) <= 1e-12 * dot(&past, &past)
        });
        let parabola = earlier.map_or(line, |(c, _)| {
            let e = place(c);
            [(far + 1.0) * (far - e) / -e, far * (far - e) / (1.0 + e), far * (far + 1.0) / (e * (e + 1.0))]
        });
        let oldest = earlier.map_or(last, |(_, s)| s);
        let taken = |by: [f64; 3], of: &dyn Fn(&SteadySolution) -> f64| {
            by[0] * of(last) + by[1] * of(before) + by[2] * of(oldest)
        };
        for (j, motion) in start.motions.iter_mut().enumerate() {
            *motion = taken(parabola, &|s| s.motions[j]);
        }
        for i in (0..last.state.len()).filter(|&i| last.pressure[i] > 0.0) {
            let same = [before, oldest].iter().all(|s| s.state[i] == last.state[i]);
            let by = if same { parabola } else { line };
            let pressure = taken(by, &|s| s.pressure[i]).max(0.1 * last.pressure[i]);
            let t = [0, 1].map(|c| taken(by, &|s| s.traction[i][c]));
            let bound = last.friction[i] * pressure;
            let length = size(t);
            let slides = [last, before].iter().all(|s| s.state[i] == Status::Slip as u8);
            let t = match slides && length > 0.0 {
                true => t.map(|t| t * bound / length),
                false => project_disc(t, bound),
            };
            start.stress[3 * i..3 * i + 3].copy_from_slice(&[t[0], t[1], pressure]);
        }
        Some(start)
    }
}

/// Differences of the creepages of all patches, `[3 patches]`.
fn distance(a: &[PatchKinematics], b: &[PatchKinematics]) -> Vec<f64> {
    let of = |(a, b): (&PatchKinematics, &PatchKinematics)| {
        let (a, b) = (a.creepage, b.creepage);
        [a.longitudinal - b.longitudinal, a.lateral - b.lateral, a.spin - b.spin]
    };
    a.iter().zip(b).flat_map(of).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
