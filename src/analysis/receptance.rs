//! The analysis `receptance`: displacement of each body at each contact per unit force at each, over frequency.

use super::reduction::Reduction;
use super::run::Run;
use crate::case::interface::{given_forces, steady_rolling, steady_sliding};
use crate::contact::full_sliding::SlidingProblem;
use crate::contact::SteadyProblem;
use crate::friction::FrictionLaw;
use crate::grid::{ContactPatch, Interface};
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
        let force = forces(wanted.spread, contact, model)?;
        let patches = &model.interface.patches;
        let share = patches.iter().zip(contact.all()).map(|(p, one)| share(&force, p, one));
        let share: Vec<Vec<f64>> = share.collect::<Result<_>>()?;
        let places: Vec<Vec<f64>> = patches
            .iter()
            .zip(&share)
            .map(|(p, share)| {
                let mut all = vec![0.0; model.interface.len()];
                all[p.nodes()].copy_from_slice(share);
                all
            })
            .collect();
        let of = |place: usize| receptance(&model.bodies[model.place[place]], &places, &frequency);
        Ok((tables(&frequency, &share, &[of(0), of(1)]), frequency))
    })?;
    if let Some((tables, frequency)) = found {
        run.file.tables(tables);
        let (first, last) = (frequency.first().copied().unwrap_or(0.0), frequency.last().copied().unwrap_or(0.0));
        run.summary.line(format!("receptances at {} frequencies, {first} to {last} Hz", frequency.len()));
    }
    Ok(())
}

/// Forces on the contact nodes by which a unit force is spread, before they are scaled, `[n]`.
fn forces(spread: Spread, contact: &job::Contact, model: &ReducedModel) -> Result<Vec<f64>> {
    let s: &Interface = &model.interface;
    Ok(match spread {
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
    })
}

/// Share of each node of a contact in a unit force there, `[nodes of the patch]`.
fn share(force: &[f64], patch: &ContactPatch, contact: &job::Contact) -> Result<Vec<f64>> {
    let force = &force[patch.nodes()];
    let sum: f64 = force.iter().sum();
    if sum > 0.0 {
        return Ok(force.iter().map(|f| f / sum).collect());
    }
    let which = contact.name.as_ref().or(contact.body.as_ref()).map_or(String::new(), |name| format!(" {name:?}"));
    Err(Error::Job(format!(
        "analyses.receptance.spread: the contact{which} is open, so there is no pressure to spread a force by; raise \
         the load, or use \"uniform\""
    )))
}
