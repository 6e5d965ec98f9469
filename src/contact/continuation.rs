//! Steady rolling at one creepage after the other: each solution is the start of the next one.
//!
//! The stresses are taken on along the parabola through the last three solutions where these lie in one direction and
//! a node has the same status in all of them, else along the straight line through the last two, and cut at the bound
//! of friction. The influence matrix of the candidates is kept: it does not depend on the creepage.

use super::candidates::Candidates;
use super::interface::Creepage;
use super::law::{project_disc, size, Status};
use super::steady::{Start, SteadyProblem, SteadySolution};
use crate::Result;
use std::collections::VecDeque;

/// The course of a steady rolling contact over its creepages.
pub struct Continuation<'a> {
    problem: SteadyProblem<'a>,
    candidates: Option<Candidates<'a>>,
    /// The last solutions with their creepages, the latest first.
    last: VecDeque<(Creepage, SteadySolution)>,
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

    /// The solution at another `creepage`; where the last ones lead to none, from nothing.
    pub fn solve(&mut self, creepage: Creepage) -> Result<SteadySolution> {
        self.problem.creepage = creepage;
        let found = match self.ahead(creepage) {
            Some(start) => self.problem.solve_with(Some(start), &mut self.candidates).or_else(|_| {
                self.candidates = None;
                self.problem.solve_with(None, &mut self.candidates)
            }),
            None => self.problem.solve_with(None, &mut self.candidates),
        };
        match &found {
            Ok(solution) => {
                self.last.truncate(2);
                self.last.push_front((creepage, solution.clone()));
            }
            Err(_) => {
                self.candidates = None;
                self.last.clear();
            }
        }
        found
    }

    /// The stresses at `creepage` by the last solutions.
    fn ahead(&self, creepage: Creepage) -> Option<Start> {
        let (here, last) = self.last.front().filter(|(_, s)| s.pressure.iter().any(|&p| p > 0.0))?;
        let mut start =
            Start { stress: last.stresses(), approach: last.approach, friction: Some(last.friction.clone()) };
        let Some((there, before)) = self.last.get(1) else { return Some(start) };
        // Where the others are when the last one is at 0 and the one before it at −1.
        let past = distance(here, there);
        let place = |c: &Creepage| dot(distance(c, here), past) / dot(past, past);
        let far = place(&creepage);
        if !(far.abs() <= 4.0) {
            return Some(start);
        }
        let line = [1.0 + far, -far, 0.0];
        let earlier = self.last.get(2).filter(|(c, _)| {
            let (along, off) = (place(c), distance(c, here));
            let aside = [0, 1, 2].map(|k| off[k] - along * past[k]);
            // Beyond the others, in their direction, by a step like theirs; and on.
            (-4.0..=-1.25).contains(&along)
                && (0.0..=2.0).contains(&far)
                && dot(aside, aside) <= 1e-12 * dot(past, past)
        });
        let parabola = earlier.map_or(line, |(c, _)| {
            let e = place(c);
            [(far + 1.0) * (far - e) / -e, far * (far - e) / (1.0 + e), far * (far + 1.0) / (e * (e + 1.0))]
        });
        let oldest = earlier.map_or(last, |(_, s)| s);
        let taken = |by: [f64; 3], of: &dyn Fn(&SteadySolution) -> f64| {
            by[0] * of(last) + by[1] * of(before) + by[2] * of(oldest)
        };
        start.approach = taken(parabola, &|s| s.approach);
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

fn distance(a: &Creepage, b: &Creepage) -> [f64; 3] {
    [a.longitudinal - b.longitudinal, a.lateral - b.lateral, a.spin - b.spin]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
