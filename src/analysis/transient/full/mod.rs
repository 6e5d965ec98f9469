//! The transient on all degrees of freedom of the finite elements: the check of the reduced one, with its laws, its
//! contact solver and its steps.
//!
//! No residual compliance is left here, the nodes of the surface have mass, and the normal law is one of velocities
//! ([`Impact::Rigid`](crate::transient::model::Impact)).

mod root_driver;
mod start;

use super::points::LocatedPoints;
use super::sound::Sound;
use super::time_loop::{LoopReport, TimeLoop};
use super::Inputs;
use crate::analysis::run::Run;
use crate::analysis::steps::Requirements;
use crate::body::full_order_integrator::{Energies, FullOrderIntegrator, StepMatrices};
use crate::case::roughness;
use crate::case::transient_problem::TransientProblem;
use crate::job::{self, Compliance, Job, Quadrature};
use crate::model::{combined_compliance, ModalMatrix};
use crate::output::datasets::checkpoint;
use crate::output::datasets::points::Points;
use crate::output::Table;
use crate::transient::{Model, Stepper};
use crate::{Error, Result};
use faer::Mat;
use root_driver::{BodyPair, DrivenByRoot, RootDriver, RootHalf};
use std::cell::RefCell;
use std::rc::Rc;

/// Checks properties of the bodies that a full transient requires, beyond their capabilities.
pub(super) fn check(job: &Job) -> Result<()> {
    let refused = |key: String, found: &str, why: &str| {
        Err(Error::Job(format!("{key}: found {found}, but analyses.transient.model is \"full\": {why}")))
    };
    if let Some(contact) = job.contact.as_ref().filter(|c| c.compliance != Compliance::Fe) {
        let found = if contact.compliance == Compliance::Hybrid { "\"hybrid\"" } else { "\"half_space\"" };
        let why = "its contact is that of the elements; take \"fe\", or the model \"reduced\"";
        return refused("contact.compliance".into(), found, why);
    }
    if job.contact.as_ref().is_some_and(|c| c.quadrature == Quadrature::Consistent) {
        let why = "its laws hold node by node; take \"nodal\", or the model \"reduced\"";
        return refused("contact.quadrature".into(), "\"consistent\"", why);
    }
    for (name, body) in job.bodies() {
        if body.matrices.is_some() {
            let why = "it takes finite elements; take the model \"reduced\", which keeps all that matrices have";
            return refused(format!("bodies.{name}"), "matrices", why);
        }
        if body.rotates() {
            let why = "its steps have no terms of rotation; set it to \"none\", or take the model \"reduced\"";
            return refused(format!("bodies.{name}.rotation"), "a body that rotates", why);
        }
        if body.damping.modal.is_some() {
            let why = "loss factors belong to modes; give alpha and beta, or take the model \"reduced\"";
            return refused(format!("bodies.{name}.damping.modal"), "loss factors", why);
        }
    }
    Ok(())
}

/// Returns whether the amplitudes of modes are looked at on the way.
fn watches_modes(wanted: &job::Transient) -> bool {
    wanted.modal_stride > 0 || wanted.sound_power.is_some()
}

/// Requirements of a full transient on the bodies: their matrices, the shapes of the modes whose amplitudes are
/// written, and at its start what it is moved along.
pub(super) fn needs(wanted: &job::Transient, resume: bool) -> Requirements {
    let moved = wanted.start.mode.is_some() || wanted.start.random.is_some();
    Requirements { solvers: true, shapes: watches_modes(wanted) || (moved && !resume) }
}

/// Refuses what needs shapes of modes, where there are none.
pub(super) fn refuse_without_shapes(inputs: &Inputs<'_>) -> Result<()> {
    if inputs.shapes || !needs(inputs.wanted, inputs.options.resume).shapes {
        return Ok(());
    }
    Err(Error::Job(
        "analyses.transient.model: found \"full\" with --reuse, where there are no mode shapes of the bodies; \
         without them leave start.mode, start.random and \
         sound_power out and set modal_stride to 0, or run without --reuse"
            .into(),
    ))
}

/// Collective: the points of the job, whose motion is known as that of nodes.
pub(super) fn points(located: &mut LocatedPoints, rows: usize) {
    let count = 3 * located.points.names.len();
    let mut modes = vec![0.0; (rows + count) * count];
    (0..count).for_each(|c| modes[(rows + c) * count + c] = 1.0);
    located.points.modes = modes;
    located.points.residual = vec![0.0; rows * count];
}

/// Collective: all steps. What is said of them is on rank 0.
pub(super) fn run(
    run: &mut Run,
    inputs: &Inputs<'_>,
    (located, points): (&LocatedPoints, &Points),
    sound: Option<&Sound<'_>>,
    keep: Vec<Table>,
) -> Result<Option<LoopReport>> {
    let (world, wanted) = (run.world(), inputs.wanted);
    run.progress.stage("factorisation of the steps");
    let mut halves: Vec<RootHalf> = Vec::new();
    for (place, (name, body)) in inputs.bodies.places.iter().zip(inputs.job.bodies()) {
        let missing = || Error::Defect(format!("bodies.{name} has no matrices"));
        let system = inputs.bodies.unique.get(place.body).and_then(|b| b.full_system()).ok_or_else(missing)?;
        let job::Damping { alpha, beta, .. } = body.damping;
        let march = StepMatrices { step: wanted.step, theta: wanted.theta, alpha, beta };
        let twin = halves.iter().zip(&inputs.bodies.places).find(|(_, p)| p.body == place.body);
        let moving = FullOrderIntegrator::new(world, system, march, twin.map(|(half, _)| &half.moving))?;
        let s = moving.statistics();
        run.summary.value(
            &format!("factor of the steps of {name}"),
            format!(
                "{:.2} M entries, {:.2} GB on all ranks",
                s.factor_entries as f64 / 1e6,
                s.memory_sum_mb as f64 / 1e3
            ),
        );
        let (fields, ranges) = (inputs.bodies.fields(place.body)?, &system.stiffness().ranges[..]);
        let modes = match watches_modes(wanted) {
            true => &inputs.bodies.shapes_of(place.body)?.vectors[..],
            false => &[],
        };
        halves.push(RootHalf { moving, side: place.side, fields, ranges, modes });
    }
    let blocks = halves.iter().map(|half| half.moving.influence()).collect::<Result<Vec<_>>>()?;
    let influence = world.on_root(|| match &blocks[..] {
        [Some(lower), Some(upper)] => combined_compliance(lower.as_ref(), upper.as_ref()),
        _ => Err(Error::Defect("a full transient of other than two bodies".into())),
    })?;

    run.progress.stage("start of the full model");
    let model = inputs.model.on_root().map(|root| (&root.interface, &root.pair));
    let ready = world.on_root(|| {
        let model = model.ok_or_else(|| Error::Defect("no reduced model on rank 0".into()))?;
        let rolling = TransientProblem { job: inputs.job, wanted, contact: inputs.contact, model };
        let ready = rolling.ready()?;
        let reduced = ready.model(model.1);
        let identity = checkpoint::identity(&reduced);
        let (rest, settings) = ready.initial_state(&reduced, &rolling)?;
        let interface = ready.interface().clone();
        Ok((interface, rest, settings, identity))
    })?;
    let rest = ready.as_ref().map(|r| &r.1);
    let begun = match inputs.options.resume {
        true => start::resumed(world, inputs, &halves)?,
        false => start::fresh(world, inputs, rest)?,
    };
    let mut energies = Energies::default();
    for (half, (u, v)) in halves.iter_mut().zip(begun.motion) {
        let e = half.moving.place(u, v);
        energies.kinetic += e.kinetic;
        energies.elastic += e.elastic;
    }
    let pair = BodyPair { world, halves, watched: located.nodes().collect(), stop: inputs.stop };
    let [q, v] = pair.rows();

    run.progress.stage("transient of the full model");
    // From here on rank 0 alone says what the ranks do.
    let (Some((interface, rest, settings, identity)), Some(influence)) = (ready, influence) else {
        pair.serve();
        return world.agree(Ok(None));
    };
    let leader = Rc::new(RefCell::new(RootDriver::new(pair, influence, wanted.theta * wanted.step, energies)));
    let go = || -> Result<LoopReport> {
        let (rows, m) = (3 * interface.len(), q.len());
        let residual = Mat::<f64>::zeros(rows, rows);
        let picks = Mat::from_fn(rows, m, |i, k| if i == k { 1.0 } else { 0.0 });
        let model = Model {
            interface: &interface,
            residual: residual.as_ref(),
            modes: picks.as_ref(),
            omega: &vec![0.0; m],
            stiffness: ModalMatrix::Diagonal(vec![0.0; m]),
            damping: ModalMatrix::Diagonal(vec![0.0; m]),
            turning: None,
            carried: None,
            load: &[],
        };
        interface.single("analyses.transient")?;
        let surfaces = roughness::surfaces(inputs.job, &interface)?;
        let identity = roughness::identity(identity, surfaces.as_deref());
        let mut state = begun.state.unwrap_or(rest);
        (state.q, state.v) = (q, v);
        let stepper = Stepper::over(model, settings, state, Box::new(DrivenByRoot(Rc::clone(&leader))))?;
        let stepper = match surfaces {
            Some(surfaces) => stepper.rough(surfaces)?,
            None => stepper,
        };
        let more = || Ok(start::tables(&leader.borrow()));
        let elsewhere = || leader.borrow().heed();
        let course = TimeLoop { inputs, points, sound, identity, more: &more, elsewhere: &elsewhere };
        course.go(stepper, begun.identity.as_deref(), keep, run.progress)
    };
    let done = go();
    leader.borrow().release_ranks();
    // The factors are freed by all ranks together, and the others have done with theirs.
    drop(leader);
    world.agree(done.map(Some))
}
