//! Steady rolling at one creepage after the other: each solution is the start of the next one.
//!
//! The stresses are taken on along the straight line through the last two solutions, and cut at the bound of friction. The influence matrix of the
//! candidates is kept: it does not depend on the creepage.

use super::candidates::Candidates;
use super::interface::Creepage;
use super::law::{project_disc, size, Status};
use super::steady::{Start, SteadyProblem, SteadySolution};
use crate::Result;

/// The course of a steady rolling contact over its creepages.
pub struct Continuation<'a> {
    problem: SteadyProblem<'a>,
    candidates: Option<Candidates>,
    /// The last solution and the one before it, with their creepages.
    last: [Option<(Creepage, SteadySolution)>; 2],
}

impl<'a> Continuation<'a> {
    /// That of `problem`, from nothing.
    pub fn new(problem: SteadyProblem<'a>) -> Self {
        Self { problem, candidates: None, last: [None, None] }
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
                let last = self.last[0].replace((creepage, solution.clone()));
                self.last[1] = last;
            }
            Err(_) => (self.candidates, self.last) = (None, [None, None]),
        }
        found
    }

    /// The stresses at `creepage` by the last solutions.
    fn ahead(&self, creepage: Creepage) -> Option<Start> {
        let (here, last) = self.last[0].as_ref().filter(|(_, s)| s.pressure.iter().any(|&p| p > 0.0))?;
        let friction = Some(last.friction.clone());
        let mut start = Start { stress: last.stresses(), approach: last.approach, friction };
        let Some((there, before)) = &self.last[1] else { return Some(start) };
        let distance =
            |a: &Creepage, b: &Creepage| [a.longitudinal - b.longitudinal, a.lateral - b.lateral, a.spin - b.spin];
        let (step, past) = (distance(&creepage, here), distance(here, there));
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let far = dot(step, past) / dot(past, past);
        if !(far.abs() <= 4.0) {
            return Some(start);
        }
        start.approach += far * (last.approach - before.approach);
        for i in (0..last.state.len()).filter(|&i| last.pressure[i] > 0.0) {
            let pressure =
                (last.pressure[i] + far * (last.pressure[i] - before.pressure[i])).max(0.1 * last.pressure[i]);
            let t = [0, 1].map(|c| last.traction[i][c] + far * (last.traction[i][c] - before.traction[i][c]));
            let bound = last.friction[i] * pressure;
            let length = size(t);
            let t = match last.state[i] == Status::Slip as u8 && before.state[i] == Status::Slip as u8 && length > 0.0 {
                true => t.map(|t| t * bound / length),
                false => project_disc(t, bound),
            };
            start.stress[3 * i..3 * i + 3].copy_from_slice(&[t[0], t[1], pressure]);
        }
        Some(start)
    }
}
