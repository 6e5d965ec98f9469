//! The analysis `receptance`: displacement of each body at the contact point per unit force there, over frequency.

use super::reduction::Reduction;
use super::run::Run;
use crate::case::interface::{given_forces, steady_rolling, steady_sliding};
use crate::contact::full_sliding::SlidingProblem;
use crate::contact::SteadyProblem;
use crate::friction::FrictionLaw;
use crate::grid::Interface;
use crate::job::{self, Spread};
use crate::model::{receptance, ReducedModel};
use crate::output::datasets::receptance::tables;
use crate::{Error, Result};

/// Collective: receptances of both bodies; tables under `/receptance`.
pub fn run(run: &mut Run, wanted: &job::Receptance, contact: &job::Contact, model: &Reduction) -> Result<()> {
    run.progress.stage("receptances of the contact point");
    let found = run.world().on_root(|| {
        let model = model.root()?;
        let frequency =
            wanted.frequency.numbers().map_err(|e| Error::Job(format!("analyses.receptance.frequency: {e}")))?;
        let reach = model.pair.reach;
        if let Some(f) = frequency.iter().find(|&&f| f > reach) {
            return Err(Error::Job(format!(
                "analyses.receptance.frequency: {f} Hz is beyond the modes of the bodies, which reach {reach:.1} Hz; \
                 ask for more modes in analyses.modes or for lower frequencies"
            )));
        }
        let share = shares(wanted.spread, contact, model)?;
        let of = |place: usize| receptance(&model.bodies[model.place[place]], &share, &frequency);
        Ok((tables(&frequency, &share, &[of(0), of(1)]), frequency))
    })?;
    if let Some((tables, frequency)) = found {
        run.file.tables(tables);
        let (first, last) = (frequency.first().copied().unwrap_or(0.0), frequency.last().copied().unwrap_or(0.0));
        run.summary.line(format!("receptances at {} frequencies, {first} to {last} Hz", frequency.len()));
    }
    Ok(())
}

/// Share of each contact node in a unit force, `[n]`.
fn shares(spread: Spread, contact: &job::Contact, model: &ReducedModel) -> Result<Vec<f64>> {
    let s: &Interface = &model.interface;
    let force: Vec<f64> = match spread {
        Spread::Uniform => s.weight.clone(),
        Spread::Pressure if s.are_points() => match given_forces(contact) {
            Some(points) => points.iter().map(|p| p.force).collect(),
            None => {
                let rigid = job::Direction::Rigid;
                let problem = steady_sliding((s, &model.pair), contact, rigid)?;
                SlidingProblem { friction: FrictionLaw::Constant(0.0).into(), ..problem }.solve()?.pressure
            }
        },
        Spread::Pressure => {
            let frictionless = FrictionLaw::Constant(0.0);
            let problem = SteadyProblem {
                friction: frictionless.into(),
                ..steady_rolling((&model.interface, &model.pair), contact, None)
            };
            problem.solve()?.pressure.iter().zip(&s.weight).map(|(p, w)| p * w).collect()
        }
    };
    let sum: f64 = force.iter().sum();
    if sum > 0.0 {
        return Ok(force.iter().map(|f| f / sum).collect());
    }
    Err(Error::Job(
        "analyses.receptance.spread: the contact is open, so there is no pressure to spread a force by; \
         raise the load, or use \"uniform\""
            .into(),
    ))
}
