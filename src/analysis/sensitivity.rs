//! Sensitivities of the eigenvalues of `stability`: derivatives with respect to parameters of the job, the equilibrium
//! following them.

use super::stability::mode_name;
use crate::body::Side;
use crate::case::interface::friction;
use crate::case::stability_problem::{StabilityProblem, StabilityResult};
use crate::contact::LinearContact;
use crate::grid::ContactPatch;
use crate::job::{self, Job};
use crate::model::{CoupledModel, ReducedModel};
use crate::stability::reduced::Eigenpair;
use crate::stability::sensitivity::{Derivative, Linearisation, Parameter, Sensitivities};
use crate::summary::Summary;
use crate::{Error, Result};
use num_complex::Complex;

/// Steps of the differences between states of rest, over the size of the parameter: the largest one between whose
/// ends no node changes its status.
const STEPS: [f64; 3] = [1e-5, 3e-6, 1e-6];
/// Creepages are measured by no less than this.
const CREEPAGE: f64 = 1e-4;

/// The derivatives of the eigenvalues `found` by all that the job has one number for. `examined` is what they were
/// found of, on `model`.
pub(super) fn analyse(
    examined: &StabilityProblem,
    found: &StabilityResult,
    model: &ReducedModel,
) -> Result<Sensitivities> {
    let study = Study { examined, model };
    let here =
        Linearisation::new(&model.pair, &found.contact, &found.spectrum.eigenpairs, examined.stability.tolerance)?;
    let mut parameters = Vec::new();
    for (parameter, value, size) in study.parameters(found) {
        let by = study.derivative(parameter, size, (&here, &found.contact))?;
        let none = || vec![Complex::new(f64::NAN, f64::NAN); found.spectrum.eigenpairs.len()];
        parameters.push(Derivative { parameter, value, by: by.unwrap_or_else(none) });
    }
    Ok(Sensitivities { parameters, damping: here.by_damping(&model.pair) })
}

/// Stability problem under examination.
struct Study<'a> {
    examined: &'a StabilityProblem<'a>,
    model: &'a ReducedModel,
}

impl Study<'_> {
    /// The parameters of the job, with their values and the sizes that steps are measured by.
    fn parameters(&self, found: &StabilityResult) -> Vec<(Parameter, f64, f64)> {
        let contact = self.examined.contact;
        let mut all = Vec::new();
        let mut add = |parameter, value: f64, size: f64| all.push((parameter, value, size));
        if friction(contact).largest() > 0.0 {
            add(Parameter::Friction, 1.0, 1.0);
        }
        match (total_load(contact), contact.approach, total_force(contact)) {
            (Some(load), ..) => add(Parameter::NormalLoad, load, load),
            (None, Some(approach), _) => add(Parameter::Approach, approach, approach),
            (None, None, Some(force)) if force > 0.0 => add(Parameter::NormalLoad, force, force),
            _ => {}
        }
        let s = &self.model.interface;
        if s.are_points() {
            return all;
        }
        add(Parameter::Speed, contact.speed, contact.speed);
        let reach = found.contact.nodes.iter().map(|n| s.point(n.node)).map(|[x, y]| x.hypot(y)).fold(0.0, f64::max);
        let c = contact.creepage;
        let creepage = (c.longitudinal.hypot(c.lateral) + c.spin.abs() * reach).max(CREEPAGE);
        add(Parameter::Longitudinal, c.longitudinal, creepage);
        add(Parameter::Lateral, c.lateral, creepage);
        add(Parameter::Spin, c.spin, if reach > 0.0 { creepage / reach } else { creepage });
        let line = |p: &ContactPatch| p.y.last().zip(p.y.first()).map_or(0.0, |(b, a)| b - a);
        let width = s.patches.iter().map(line).fold(0.0, f64::max);
        add(Parameter::LowerPosition, 0.0, width);
        add(Parameter::UpperPosition, 0.0, width);
        all
    }

    /// Derivatives by a parameter of the size `size`, about the contact given with its linearisation. None where
    /// nodes change their status however small the step.
    fn derivative(
        &self,
        parameter: Parameter,
        size: f64,
        (here, contact): (&Linearisation, &LinearContact),
    ) -> Result<Option<Vec<Complex<f64>>>> {
        for step in STEPS.map(|s| s * size) {
            let [ahead, behind] = [step, -step].map(|by| self.moved(parameter, by));
            let ((pair_ahead, ahead), (pair_behind, behind)) = (ahead?, behind?);
            if ahead.alike(contact) && behind.alike(contact) {
                let own = &self.model.pair;
                let [p, q] = [&pair_ahead, &pair_behind].map(|p| p.as_ref().unwrap_or(own));
                return here.between((p, &ahead), (q, &behind), 2.0 * step).map(Some);
            }
        }
        Ok(None)
    }

    /// The bodies, where they change, and the linearised contact with a parameter changed by `by`.
    fn moved(&self, parameter: Parameter, by: f64) -> Result<(Option<CoupledModel>, LinearContact)> {
        let StabilityProblem { job, stability, contact, model: (interface, pair) } = *self.examined;
        let mut contact: job::Contact = contact.clone();
        let mut moved = None;
        match parameter {
            Parameter::Friction => contact = contact.with_friction_scaled(1.0 + by),
            Parameter::NormalLoad => {
                let total = total_force(&contact).unwrap_or(f64::INFINITY);
                let factor = 1.0 + total_load(&contact).map_or(0.0, |load| by / load);
                for force in [&mut contact.vertical_load, &mut contact.lateral_force] {
                    *force = force.map(|force| force * factor);
                }
                each(&mut contact, &|c| c.normal_load = c.normal_load.map(|load| load * factor));
                let forces = contact.points.iter_mut().flatten().filter_map(|p| p.force.as_mut());
                forces.for_each(|f| *f *= 1.0 + by / total);
            }
            Parameter::Approach => contact.approach = contact.approach.map(|d| d + by),
            Parameter::Speed => {
                // All that moves goes faster alike, so that creepages stay.
                let factor = 1.0 + by / contact.speed;
                each(&mut contact, &|c| {
                    c.speed *= factor;
                    let track = c.placement.as_mut();
                    let speeds = track.into_iter().flat_map(|p| [p.speed.as_mut(), p.angular_speed.as_mut()]).flatten();
                    speeds.for_each(|v| *v *= factor);
                });
                if self.model.rotation.iter().any(Option::is_some) {
                    let job = Job { contact: Some(contact.clone()), ..job.clone() };
                    moved = Some(self.model.pair_of(&job)?);
                }
            }
            Parameter::Longitudinal => each(&mut contact, &|c| c.creepage.longitudinal += by),
            Parameter::Lateral => each(&mut contact, &|c| c.creepage.lateral += by),
            Parameter::Spin => each(&mut contact, &|c| c.creepage.spin += by),
            Parameter::LowerPosition => moved = Some(pair.with_contact_moved(interface, Side::Lower, by)),
            Parameter::UpperPosition => moved = Some(pair.with_contact_moved(interface, Side::Upper, by)),
        }
        let model = (interface, moved.as_ref().unwrap_or(pair));
        let (_, linear) = StabilityProblem { job, stability, contact: &contact, model }.at_rest()?;
        Ok((moved, linear))
    }
}

/// Load that all contacts carry, N: the vertical one that they share, or the sum of their normal loads.
fn total_load(contact: &job::Contact) -> Option<f64> {
    contact.vertical_load.or_else(|| contact.all().map(|c| c.normal_load).sum())
}

/// Makes a `change` to each contact of a wheel.
fn each(contact: &mut job::Contact, change: &dyn Fn(&mut job::Contact)) {
    change(contact);
    contact.further.iter_mut().for_each(change);
}

/// The sum of the forces of points that have forces of their own, N.
fn total_force(contact: &job::Contact) -> Option<f64> {
    let forces: Vec<f64> = contact.points.iter().flatten().filter_map(|p| p.force).collect();
    (!forces.is_empty()).then(|| forces.iter().sum())
}

/// Changes of a mode that would end its growth, at the most so many.
const CURES: usize = 4;

/// Changes that would end the growth of the eigenvalue `index`, `pair`, by its derivatives alone, the smallest changes
/// first; `model` has its modes.
pub(super) fn cures(all: &Sensitivities, index: usize, pair: &Eigenpair, model: &CoupledModel) -> String {
    let growth = pair.growth_rate();
    // Changes with their sizes over what would be a large one.
    let mut found: Vec<(f64, String)> = Vec::new();
    let own = |p: Parameter| all.parameters.iter().find(|d| d.parameter == p).map_or(0.0, |d| d.value);
    let creepage = own(Parameter::Longitudinal).hypot(own(Parameter::Lateral));
    for Derivative { parameter, value, by } in &all.parameters {
        let slope = by[index].re;
        let change = -growth / slope;
        if !change.is_finite() {
            continue;
        }
        let percent = format!("{:+.1} %", 100.0 * change / value);
        let (size, text) = match parameter {
            Parameter::Friction => (change, format!("friction {percent}")),
            Parameter::NormalLoad => (change / value, format!("normal load {percent}")),
            Parameter::Approach => (change / value, format!("approach {percent}")),
            Parameter::Speed => (change / value, format!("speed {percent}")),
            Parameter::Longitudinal => (change / creepage, format!("longitudinal creepage {:+.4} %", 100.0 * change)),
            Parameter::Lateral => (change / creepage, format!("lateral creepage {:+.4} %", 100.0 * change)),
            Parameter::Spin => (change / value, format!("spin {change:+.3e} 1/m")),
            Parameter::LowerPosition => {
                (change / 0.01, format!("contact on the lower body {:+.2} mm in y", 1e3 * change))
            }
            Parameter::UpperPosition => {
                (change / 0.01, format!("contact on the upper body {:+.2} mm in y", 1e3 * change))
            }
        };
        if size.abs() <= 1.0 {
            found.push((size.abs(), text));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let strongest = (0..model.omega.len()).min_by(|&a, &b| {
        let slope = |k: usize| all.damping[index][k].re;
        slope(a).total_cmp(&slope(b))
    });
    let damped = strongest.filter(|&k| all.damping[index][k].re < 0.0).map(|k| {
        let change = -growth / all.damping[index][k].re;
        (change / 0.01, format!("damping ratio of {} {change:+.1e}", mode_name(model, k)))
    });
    let cures = damped.into_iter().filter(|d| d.0 <= 1.0).chain(found);
    cures.take(CURES).map(|c| c.1).collect::<Vec<_>>().join(", or ")
}

/// A warning for each parameter without derivatives.
pub(super) fn warn(all: &Sensitivities, summary: &mut Summary) {
    for Derivative { parameter, by, .. } in &all.parameters {
        if !by.is_empty() && by.iter().all(|d| d.re.is_nan()) {
            summary.warn(format!(
                "analyses.stability.sensitivities: none by the {}: a node of the contact changes its status \
                 with the smallest change of it, or every \
                 eigenvalue is multiple",
                parameter.name()
            ));
        }
    }
}

/// On rank 0: those that the job asks for.
pub(super) fn wanted(
    examined: &StabilityProblem,
    found: &StabilityResult,
    model: &ReducedModel,
) -> Result<Option<Sensitivities>> {
    if !examined.stability.sensitivities {
        return Ok(None);
    }
    analyse(examined, found, model).map(Some).map_err(|e: Error| e.context("analyses.stability.sensitivities"))
}
