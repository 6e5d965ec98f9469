//! Steady rolling under loads that patches without friction may be unable to bear, such as a vertical and a lateral
//! force of a wheel.
//!
//! The rigid motions d are found by Newton's method from the resultants F(d) of the contact under prescribed motions,
//! with the derivatives by differences to begin with, then Broyden's. Newton's method on stresses and motions at once
//! does not do: contacts with similar angles bear a lateral force by creep forces, which move with the edges of the
//! contact, and small changes of them move the normal forces by much.

use super::{SteadyProblem, SteadySolution};
use crate::contact::loads::{solve_small, Loads};
use crate::contact::steady::StartStresses;
use crate::{Error, Result};

/// Change of the motions for the derivatives, over the largest approach.
const DIFFERENCE: f64 = 1e-3;
/// Largest change of an approach in a step, over the largest one.
const LARGEST_CHANGE: f64 = 0.3;
/// Part of the tolerance to which the contact under prescribed motions is solved.
const INNER: f64 = 0.1;
/// Smallest tolerance that it is solved to.
const FLOOR: f64 = 2e-13;
const MOST_STEPS: usize = 30;
/// Halvings of a step that leads to no contact, or to one that is not found.
const HALVINGS: usize = 6;
/// Independence of the resultants from which on they determine the motions.
const DETERMINED: f64 = 0.02;

/// Rolling under prescribed motions, and how far its resultants are from the loads.
struct Trial {
    solution: SteadySolution,
    /// Resultants less the loads over the largest load, `[unknown]`.
    error: Vec<f64>,
}

impl Trial {
    fn largest(&self) -> f64 {
        self.error.iter().fold(0.0, |m, e| f64::max(m, e.abs()))
    }
}

/// Independence of the rows of a matrix, `[n, n]` by rows: its determinant over the product of their lengths, 1 of rows
/// at right angles and 0 of rows that depend on each other.
fn independence(rows: &[f64], n: usize) -> f64 {
    let lengths = rows.chunks(n).map(|row| row.iter().map(|v| v * v).sum::<f64>().sqrt());
    let matrix = faer::Mat::from_fn(n, n, |i, j| rows[n * i + j]);
    matrix.determinant().abs() / lengths.product::<f64>().max(f64::MIN_POSITIVE)
}

fn undetermined() -> Error {
    Error::Job(
        "contact.lateral_force: the lateral force of this wheel hardly depends on how its contacts share the vertical \
         load, so that it does not tell their loads: their angles are too much alike, or friction makes up for them; \
         give contact.placement.lateral in the place of contact.lateral_force"
            .into(),
    )
}

impl SteadyProblem<'_> {
    /// The solution, from the motions of `start`, or from the contact under the normal forces `first` alone.
    pub(super) fn solve_by_loads(&self, first: Loads, start: Option<StartStresses>) -> Result<SteadySolution> {
        let unknown = self.loads.unknown();
        let mut spent = [0; 2];
        let mut at = |motions: &[f64], start: StartStresses| -> Result<Trial> {
            let tolerance = (INNER * self.tolerance).max(FLOOR).min(self.tolerance);
            let problem = Self { loads: self.loads.held_at(motions), tolerance, ..self.clone() };
            let start = StartStresses { motions: motions.to_vec(), ..start };
            let solution = problem.solve_with(Some(start), &mut None)?;
            spent = [spent[0] + solution.iterations, spent[1] + solution.products];
            let error = unknown.iter().map(|&j| self.loads.error(j, &solution.patches)).collect();
            Ok(Trial { solution, error })
        };
        let (mut motions, start) = match start {
            Some(start) => (start.motions.clone(), start),
            None => {
                let begun = Self { loads: first, ..self.clone() }.solve()?;
                let approaches: Vec<f64> = begun.patches.iter().map(|p| p.approach).collect();
                (self.loads.nearest_motions(&approaches), StartStresses::from_solution(&begun))
            }
        };
        let mut here = at(&motions, start)?;
        let largest = |here: &Trial| here.solution.patches.iter().fold(0.0, |m, p| f64::max(m, p.approach.abs()));
        let n = unknown.len();
        // By rows.
        let mut derivative = vec![0.0; n * n];
        for (column, &j) in unknown.iter().enumerate() {
            let mut beside = motions.clone();
            let step = DIFFERENCE * largest(&here);
            beside[j] += step;
            let there = at(&beside, StartStresses::from_solution(&here.solution))?;
            (0..n).for_each(|row| derivative[n * row + column] = (there.error[row] - here.error[row]) / step);
        }
        if independence(&derivative, n) < DETERMINED {
            return Err(undetermined());
        }
        let mut trace = vec![here.largest()];
        for _ in 0..MOST_STEPS {
            if here.largest() <= self.tolerance {
                let mut solution = here.solution;
                solution.residual = unknown.iter().zip(&here.error).fold(solution.residual, |m, (_, e)| m.max(e.abs()));
                (solution.iterations, solution.products) = (spent[0], spent[1]);
                return Ok(solution);
            }
            let mut step: Vec<f64> = here.error.iter().map(|e| -e).collect();
            if !solve_small(&mut derivative.clone(), &mut step) || step.iter().any(|d| !d.is_finite()) {
                break;
            }
            let moved = |step: &[f64]| {
                let mut change = vec![0.0; motions.len()];
                unknown.iter().zip(step).for_each(|(&j, d)| change[j] = *d);
                change
            };
            let approaches = self.approaches(&moved(&step));
            let change = approaches.iter().fold(0.0, |m, d| f64::max(m, d.abs()));
            let part = f64::min(1.0, LARGEST_CHANGE * largest(&here) / change);
            step.iter_mut().for_each(|d| *d *= part);
            let mut tried = Err(undetermined());
            let mut next = motions.clone();
            for _ in 0..HALVINGS {
                next = motions.iter().zip(moved(&step)).map(|(d, by)| d + by).collect();
                tried = match at(&next, StartStresses::from_solution(&here.solution)) {
                    Ok(there) if there.solution.pressure.iter().any(|p| *p > 0.0) => Ok(there),
                    Ok(_) => Err(undetermined()),
                    Err(e @ (Error::NotConverged(_) | Error::Job(_))) => Err(e),
                    Err(e) => return Err(e),
                };
                if tried.is_ok() {
                    break;
                }
                step.iter_mut().for_each(|d| *d *= 0.5);
            }
            let there = tried?;
            let length: f64 = step.iter().map(|d| d * d).sum();
            for row in 0..n {
                let expected: f64 = (0..n).map(|column| derivative[n * row + column] * step[column]).sum();
                let missed = there.error[row] - here.error[row] - expected;
                (0..n).for_each(|column| derivative[n * row + column] += missed * step[column] / length);
            }
            (motions, here) = (next, there);
            trace.push(here.largest());
        }
        Err(Error::NotConverged(format!(
            "steady contact: no motions of the wheel were found under which its contacts bear contact.vertical_load \
             and contact.lateral_force, which were missed by {} of the largest; give contact.placement.lateral in the \
             place of contact.lateral_force",
            trace.iter().map(|e| format!("{e:.1e}")).collect::<Vec<_>>().join(" ")
        )))
    }
}
