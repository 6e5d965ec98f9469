//! The analysis `creep_curve`: steady rolling over the values of one creepage, each from the solution before. Of
//! several contacts the values are those of the first one, and the creepages of the others change by as much.

use super::point;
use super::reduction::Reduction;
use super::run::Run;
use crate::case::interface::{at_rest, creepage, kinematics, steady_rolling};
use crate::case::well_posed;
use crate::contact::baseline::{fastsim, linear, polach, shen_hedrick_elkins, EllipticContact};
use crate::contact::{Continuation, SteadyProblem, SteadySolution};
use crate::grid::Interface;
use crate::job::{self, CreepCurve, Job};
use crate::model::{CoupledModel, ReducedModel};
use crate::output::datasets::creep_curve::{tables, Baseline, CreepCurvePoint, CurveContact};
use crate::stability::nonlinear_eigen::SpectrumMemory;
use crate::stability::{grows, least_stable};
use crate::summary::Summary;
use crate::{Error, Result};

/// Collective: the creep curve, tables under `/creep_curve`. A point that fails has its exit code and message there,
/// the others go on.
pub(super) fn run(run: &mut Run, wanted: &CreepCurve, contact: &job::Contact, model: &Reduction) -> Result<()> {
    let (world, job) = (run.world(), run.job);
    run.progress.stage("creep curve");
    let values = wanted.numbers().map_err(|fault| Error::Job(format!("analyses.creep_curve.values: {fault}")))?;
    let progress = &mut *run.progress;
    let points = world.on_root(|| {
        let curve = Curve { wanted, contact, job, model: model.root()?, memory: SpectrumMemory::default() };
        let mut continuation = Continuation::new(curve.problem());
        let point = |(number, &value): (usize, &f64)| {
            let point = curve.point(&mut continuation, value);
            progress.step("creepages", number + 1, values.len());
            point
        };
        values.iter().enumerate().map(point).collect::<Result<Vec<CreepCurvePoint>>>()
    })?;
    if let Some(points) = points {
        let changes = changes(wanted, contact);
        summarise(wanted, (contact, &changes), &points, &mut run.summary);
        run.file.tables(tables(wanted, &points, &changes, job.analyses.stability.is_some()));
    }
    Ok(())
}

/// Creep curve as it is computed, on rank 0.
struct Curve<'a> {
    wanted: &'a CreepCurve,
    contact: &'a job::Contact,
    job: &'a Job,
    model: &'a ReducedModel,
    memory: SpectrumMemory,
}

impl<'a> Curve<'a> {
    /// Steady rolling, as a state of rest where small motions are looked at about it.
    fn problem(&self) -> SteadyProblem<'a> {
        let (model, steady): ((&Interface, &CoupledModel), _) =
            ((&self.model.interface, &self.model.pair), self.job.analyses.steady.as_ref());
        match self.job.analyses.stability {
            Some(_) => at_rest(model, self.contact, steady),
            None => {
                let problem = steady_rolling(model, self.contact, steady);
                SteadyProblem { tolerance: self.wanted.tolerance.unwrap_or(problem.tolerance), ..problem }
            }
        }
    }

    /// One point; what concerns it alone is no error.
    fn point(&self, continuation: &mut Continuation, value: f64) -> Result<CreepCurvePoint> {
        match self.solved(continuation, value) {
            Err(e @ (Error::Defect(_) | Error::Io(_) | Error::Memory(_))) => Err(e),
            Err(e) => Ok(CreepCurvePoint::failed(value, &e)),
            Ok(point) => Ok(point),
        }
    }

    fn solved(&self, continuation: &mut Continuation, value: f64) -> Result<CreepCurvePoint> {
        let contact = self.contact.with_creepage_at(self.wanted.key, value);
        let solution = continuation.solve(kinematics(&contact))?;
        let of_contact = |(number, one)| {
            let baseline = self.baseline((one, number), &solution)?;
            Ok(CurveContact { baseline, ..of_contact(&self.model.interface, &solution, number) })
        };
        let contacts = contact.all().enumerate().map(of_contact).collect::<Result<Vec<_>>>()?;
        let (residual, iterations) = (solution.residual, solution.iterations);
        let mut point = CreepCurvePoint {
            value,
            status: 0,
            message: String::new(),
            contacts,
            residual,
            iterations,
            least_stable: None,
        };
        if let Some(stability) = &self.job.analyses.stability {
            let (problem, pair) = (continuation.problem(), &self.model.pair);
            well_posed::refuse_short(&contact, |friction| well_posed::rolling(problem, friction, pair))?;
            let found = least_stable(stability, pair, &problem.contact(&solution), &self.memory)?;
            point.least_stable = found.map(|e| (e.value, grows(e.value, e.backward_error)));
        }
        Ok(point)
    }
}

impl Curve<'_> {
    /// Results of laws of point contact for the solution `r` of the contact `number`, on half-spaces of the bodies'
    /// materials, with the coefficient of friction at the rigid creep of the centre. None where there is no ellipse in
    /// the range of their table.
    fn baseline(&self, (contact, number): (&job::Contact, usize), r: &SteadySolution) -> Result<Option<Baseline>> {
        let c = creepage(contact);
        let of = |e: EllipticContact| Baseline {
            half_axes: [e.a, e.b],
            linear: linear(&e, &c),
            shen_hedrick_elkins: shen_hedrick_elkins(&e, &c),
            polach: polach(&e, &c),
            fastsim: fastsim(&e, &c),
        };
        let patch = (&self.model.interface, number);
        Ok(point::ellipse(self.job, contact, patch, &r.pressure)?.map(of))
    }
}

/// Creepages of each contact over that of the first one, which they keep along the curve.
fn changes(wanted: &CreepCurve, contact: &job::Contact) -> Vec<f64> {
    let first = contact.creepage.component(wanted.key);
    contact.all().map(|one| one.creepage.component(wanted.key) - first).collect()
}

/// State of the contact `number` of a solution on the interface `s`, without the laws of point contact.
fn of_contact(s: &Interface, r: &SteadySolution, number: usize) -> CurveContact {
    let nodes = |status: u8| s.patches[number].nodes().filter(move |&i| r.state[i] == status);
    let area = |status: u8| nodes(status).map(|i| s.weight[i]).sum::<f64>();
    let (stick, slip) = (area(1), area(2));
    let resultant = &r.patches[number];
    CurveContact {
        force: resultant.force,
        moment_z: resultant.moment_z,
        approach: resultant.approach,
        closed: nodes(1).count() + nodes(2).count(),
        sticking: nodes(1).count(),
        stick_share: if stick + slip > 0.0 { stick / (stick + slip) } else { 0.0 },
        baseline: None,
    }
}

fn summarise(
    wanted: &CreepCurve,
    (contact, changes): (&job::Contact, &[f64]),
    points: &[CreepCurvePoint],
    summary: &mut Summary,
) {
    let good: Vec<&CreepCurvePoint> = points.iter().filter(|p| p.status == 0).collect();
    let failed = points.len() - good.len();
    let iterations: usize = good.iter().map(|p| p.iterations).sum();
    let (key, unit) = (wanted.key.name(), wanted.key.unit());
    summary.line(format!(
        "creep curve over the {key} creepage: {} points, {failed} failed, {iterations} iterations",
        points.len()
    ));
    let friction = |c: &CurveContact| c.force[0].hypot(c.force[1]);
    let said = |value: f64| match unit {
        "1" => format!("{:.4} %", 100.0 * value),
        _ => format!("{value} {unit}"),
    };
    let at = |p: &CreepCurvePoint| said(p.value);
    let names = contact.names();
    for (number, (one, change)) in contact.all().zip(changes).enumerate() {
        let of_contact = good.iter().filter_map(|p| Some((p.value + change, p.contacts.get(number)?)));
        let largest = of_contact.max_by(|a, b| friction(a.1).total_cmp(&friction(b.1)));
        let Some((value, most)) = largest else { continue };
        let limit = -most.force[2] * one.law().coefficient(0.0);
        let part = if limit > 0.0 { format!(", {:.4} of μN", friction(most) / limit) } else { String::new() };
        let which = names.get(number).map_or(String::new(), |name| format!(", contact {} ({name})", number + 1));
        let name = format!("largest friction{which}");
        summary.value(&name, format!("{:.6e} N{part}, at {}", friction(most), said(value)));
    }
    if good.iter().any(|p| p.least_stable.is_some()) {
        let growing: Vec<&&CreepCurvePoint> = good.iter().filter(|p| p.least_stable.is_some_and(|l| l.1)).collect();
        let worst =
            good.iter().filter_map(|p| p.least_stable.map(|l| (p, l.0))).max_by(|a, b| a.1.re.total_cmp(&b.1.re));
        summary.value("unstable points", growing.len());
        if let Some((p, l)) = worst {
            let frequency = l.im / (2.0 * std::f64::consts::PI);
            summary.value("largest growth rate", format!("{:+.4} 1/s at {frequency:.3} Hz, at {}", l.re, at(p)));
        }
    }
    let Some(first) = points.iter().find(|p| p.status != 0) else { return };
    summary.fail(Error::NotConverged(format!(
        "{failed} of {} points of the creep curve failed, the others are in the results; \
         /creep_curve/status and /creep_curve/message say which and why. \
         The first is {key} = {}: {}",
        points.len(),
        first.value,
        first.message
    )));
}
