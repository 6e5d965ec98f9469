//! The analysis `transient`: rolling contact in time, from a state of rest and its perturbation, written in segments.

mod account;
mod fields;
pub mod kept;
mod points;
mod roughness;
mod sound;

pub use crate::output::datasets::checkpoint::refuse_other_job;

use super::reduction::Reduction;
use super::run::Run;
use super::stability::Found;
use super::steps::Needs;
use super::RunOptions;
use crate::body::TraceModes;
use crate::case::bodies::Bodies;
use crate::case::interface::{self, creepage, given_forces, normal_load, steady_sliding};
use crate::case::well_posed;
use crate::contact::points::{bear_load, linearised, reactions};
use crate::contact::sliding::SlidingProblem;
use crate::contact::{NormalLoad, SteadyProblem};
use crate::grid::Interface;
use crate::job::{self, Direction, Hold, Job, StabilityState, StartState, TransientSolver};
use crate::model::ReducedModel;
use crate::output::datasets::checkpoint::{self, Checkpoint};
use crate::output::datasets::points::Points;
use crate::output::datasets::record::{grid, Recorder};
use crate::output::{Segments, Table};
use crate::progress::Progress;
use crate::stability::grows;
use crate::stability::reduced::{sharpness, Eigenpair};
use crate::stop::Stop;
use crate::summary::Summary;
use crate::transient::drive::{Drive, History, Normal, Tangential};
use crate::transient::{ContactSolver, Effort, Model, PointModel, Scheme, Settings, State, Stepper};
use crate::{Error, Result};
use account::Account;
use faer::MatRef;
use num_complex::Complex64;
use points::Located;
use sound::Sound;
use std::path::Path;
use std::time::Instant;

/// What the transient takes from the other stages of a run.
pub struct Inputs<'a> {
    /// The job.
    pub job: &'a Job,
    /// Its transient.
    pub wanted: &'a job::Transient,
    /// Its contact.
    pub contact: &'a job::Contact,
    /// The bodies with their modes; none where nothing is asked of them.
    pub bodies: &'a Bodies<'a>,
    /// The names of the places, and which of the bodies that differ are in them.
    pub places: &'a [(&'static str, usize)],
    /// Modes of each body that differs.
    pub modes: &'a [TraceModes],
    /// Whether an earlier run, where modes are of one, gives the shapes of the modes too.
    pub shapes: bool,
    /// The reduced model.
    pub model: &'a Reduction,
    /// On rank 0: what stability found, where it was asked for.
    pub found: Option<&'a Found>,
    /// What the command line says.
    pub options: &'a RunOptions,
    /// When to stop.
    pub stop: &'a Stop,
    /// On rank 0, at the start of a run: the reduced model as tables, for the first segment.
    pub keep: &'a [Table],
    /// On rank 0: the segments of the run.
    pub segments: Option<&'a Segments>,
    /// Where modes and compliance are kept until the first segment has them.
    pub kept: Option<&'a Path>,
}

impl Inputs<'_> {
    /// On rank 0: the eigenvalues of the reduced model, by falling growth rate.
    fn eigenpairs(&self) -> &[Eigenpair] {
        self.found.map_or(&[], |f| &f.spectrum.eigenpairs)
    }

    /// On rank 0: the segments of the run.
    fn segments(&self) -> Result<&Segments> {
        self.segments.ok_or_else(|| Error::Defect("a transient without segments".into()))
    }
}

/// What the analysis needs of the bodies: named points and the motion of the bodies take static solves, and sound the shapes. What moves the points and how
/// the modes radiate is in the first segment of a run that is continued.
pub(super) fn needs(wanted: &job::Transient, resume: bool) -> Needs {
    let solvers = (!wanted.points.is_empty() && !resume) || wanted.body_stride > 0;
    Needs { solvers, shapes: solvers || (wanted.sound_power.is_some() && !resume) }
}

/// Collective: the transient; its results become part of `file`.
pub fn run(run: &mut Run, inputs: &Inputs<'_>) -> Result<()> {
    let world = run.world();
    let wanted = inputs.wanted;
    if wanted.body_stride > 0 && !inputs.shapes {
        return Err(Error::Job(
            "analyses.transient.body_stride: with --reuse there are no mode shapes of the bodies; set it to 0, or run without \
             --reuse"
                .into(),
        ));
    }
    let points = if inputs.options.resume {
        let found = world.on_root(|| Points::restore(wanted, &inputs.segments()?.open_first()?))?;
        found.unwrap_or_default()
    } else {
        let mut located = Located::find(wanted, inputs.bodies, inputs.shapes)?;
        located.solve(inputs.bodies, inputs.modes, inputs.model)?;
        located.points
    };
    let sound = match &wanted.sound_power {
        Some(power) => Some(Sound::new(world, inputs, power, run.progress)?),
        None => None,
    };
    run.progress.stage("transient");
    if world.is_root() {
        report_damping(wanted, inputs.eigenpairs(), run.progress, &mut run.summary);
    }
    let wish = || inputs.stop.signalled();
    let work = |elsewhere: &dyn Fn() -> bool| advance(inputs, &points, sound.as_ref(), elsewhere, run.progress);
    let done = world.on_root_heeding(wish, work)?;
    if let Some((effort, steps, seconds, account)) = &done {
        let pair = &inputs.model.root()?.pair;
        let per = |n: usize| n as f64 / (*steps).max(1) as f64;
        run.summary.line(format!("transient: {} s in steps of {} s", wanted.duration, wanted.step));
        if *steps > 0 {
            run.summary.value("time of a step", format!("{:.3} ms", 1e3 * seconds / *steps as f64));
            run.summary.value(
                "of a step",
                format!(
                    "{:.2} iterations, {:.2} products, {:.2} solutions, {:.4} factorisations, {:.4} sweeps",
                    per(effort.iterations),
                    per(effort.products),
                    per(effort.solutions),
                    per(effort.factorisations),
                    per(effort.sweeps)
                ),
            );
        }
        account.report(&points.names, &mut run.summary)?;
        run.file.tables(points.tables());
        run.file.tables(inputs.model.root().map(|m| grid(&m.interface, pair))?);
        let interface = &inputs.model.root()?.interface;
        if let Some(surface) = roughness::surface(inputs.job, [&interface.x, &interface.y])? {
            run.file.tables(roughness::tables(&surface, &interface.y, wanted.duration));
        }
        let segments = inputs.segments()?;
        run.file.append(segments.clone(), "/transient");
    }
    if let Some(sound) = &sound {
        run.progress.stage("sound power");
        sound.write(run, inputs)?;
    }
    if wanted.body_stride > 0 {
        run.progress.stage("motion of the bodies");
        fields::write(run, inputs)?;
    }
    Ok(())
}

/// The scheme's own damping beside the growth rates that it would falsify.
fn report_damping(wanted: &job::Transient, pairs: &[Eigenpair], progress: &Progress, summary: &mut Summary) {
    let scheme = Scheme { step: wanted.step, theta: wanted.theta };
    for e in pairs.iter().filter(|e| grows(e.value, e.backward_error) && e.frequency() > 0.0) {
        let own = scheme.own_damping(e.value.im.abs());
        let share = own / e.growth_rate();
        let text = format!("{own:.3e} 1/s, {:.2} % of the growth rate {:.4} 1/s", 100.0 * share, e.growth_rate());
        summary.value(&format!("damping by the scheme, {:.2} Hz", e.frequency()), &text);
        if share > 0.02 {
            progress.note(format!(
                "warning: the scheme damps the unstable motion at {:.2} Hz by {text}; take theta nearer to 0.5 or a shorter step",
                e.frequency()
            ));
        }
    }
}

/// On rank 0: all steps; returns effort, number of steps, time and what is to be said of them.
fn advance(
    inputs: &Inputs<'_>,
    points: &Points,
    sound: Option<&Sound<'_>>,
    elsewhere: &dyn Fn() -> bool,
    progress: &mut Progress,
) -> Result<(Effort, u64, f64, Account)> {
    let (root, segments) = (inputs.model.root()?, inputs.segments()?);
    let wanted = inputs.wanted;
    let at_points = at_points(inputs, root)?;
    // The settings follow from the state of rest, whose approach is held; a resumed run finds the same again.
    let rest = match &at_points {
        Some(_) => None,
        None => Some(Rest::of(inputs, root)?),
    };
    let interface = rest.as_ref().map_or_else(|| root.interface.clone(), |rest| rest.interface(&root.interface));
    let model = match &at_points {
        Some(points) => points.model(&root.pair),
        None => Model::of(&root.pair, &interface),
    };
    let scheme = Scheme { step: wanted.step, theta: wanted.theta };
    scheme.check(model.omega)?;
    let surface = roughness::surface(inputs.job, [&interface.x, &interface.y])?;
    let identity = roughness::identity(checkpoint::identity(&model), surface.as_ref());
    let resumed = if inputs.options.resume { Some(Checkpoint::last(segments)?) } else { None };
    let (rest, approach, deflected) = match (&at_points, &rest) {
        (Some(points), _) => {
            let (rest, approach) = points.at_rest(&model);
            (rest, approach, [0.0; 2])
        }
        (None, Some(rest)) => (rest.state(&model), rest.approach, rest.slopes(&root.interface)),
        (None, None) => return Err(Error::Defect("a transient without a state of rest".into())),
    };
    let settings = Settings {
        scheme,
        friction: inputs.contact.friction.clone(),
        solver: match wanted.solver {
            TransientSolver::Newton => ContactSolver::Newton,
            TransientSolver::FixedPoint => ContactSolver::FixedPoint,
        },
        tolerance: wanted.tolerance,
        drive: drive(wanted, inputs.contact, approach, deflected)?,
    };
    let total = wanted.steps();
    let begin = |state: State| -> Result<Stepper<'_>> {
        let stepper = Stepper::new(model, settings, state)?;
        Ok(match surface {
            Some(surface) => stepper.rough(surface),
            None => stepper,
        })
    };
    let mut stepper;
    match resumed {
        Some(found) => {
            if found.identity != identity {
                progress.note(
                    "warning: the reduced model differs in rounding from that of the run to be continued, or a file of its roughness has changed; the results do too",
                );
            }
            stepper = begin(found.state)?;
            segments.go_on(inputs.job.to_json())?;
        }
        None => {
            let (start, moved) = perturbed(inputs, root, rest)?;
            stepper = begin(start)?;
            if moved {
                stepper.settle().map_err(|e| e.context("analyses.transient: the start"))?;
            }
            // Nothing is left behind by a run that cannot begin.
            segments.begin(inputs.job.to_json())?;
        }
    }
    let mut recorder = Recorder::new(points, wanted, root, sound.map_or(0, Sound::stride), &stepper.state().reaction);
    let mut effort = Effort::default();
    let first = stepper.state().step;
    let mut account = Account::new(wanted.step, first, total);
    let begun = Instant::now();
    if !inputs.options.resume {
        let mut tables = checkpoint::tables(stepper.state(), &identity, inputs.job)?;
        tables.extend_from_slice(inputs.keep);
        tables.extend(points.kept());
        tables.extend(sound.map(Sound::kept).unwrap_or_default());
        segments.write(0, &tables)?;
        if let Some(kept) = inputs.kept {
            let _ = std::fs::remove_file(kept);
        }
    }
    let mut segment_begun = Instant::now();
    while stepper.state().step < total {
        let result = stepper.advance();
        if result.is_ok() {
            recorder.take(&stepper);
            account.take(stepper.state().step, stepper.report(), stepper.state().energy.kinetic, recorder.velocities());
            effort += stepper.report().effort;
        }
        let step = stepper.state().step;
        let end = step.is_multiple_of(u64::from(wanted.segment)) || step == total;
        if result.is_err() || end {
            let mut tables = recorder.tables();
            tables.extend(checkpoint::tables(stepper.state(), &identity, inputs.job)?);
            if result.is_ok() || recorder.any() {
                segments.write(step, &tables)?;
            }
            recorder.clear();
        }
        result.map_err(|e| {
            let place = segments.folder().display();
            let advice = match e {
                Error::NotConverged(_) => "; a shorter analyses.transient.step, or a larger tolerance, may help",
                _ => "",
            };
            e.context(format!("analyses.transient (the state before is kept in {place}{advice})"))
        })?;
        if end {
            // A run that is continued from here begins with an empty solver; one that goes on does as well.
            stepper.reset()?;
            progress.step("steps", (step - first) as usize, (total - first) as usize);
            let segment = segment_begun.elapsed();
            segment_begun = Instant::now();
            if elsewhere() {
                inputs.stop.request();
            }
            if step < total {
                if let Some(why) = inputs.stop.asked(segment) {
                    return Err(Error::Stopped(format!(
                        "stopped {why} after {step} of {total} steps (t = {:.6} s); the state is kept in {}. Continue with \
                         --resume {}",
                        step as f64 * wanted.step,
                        segments.folder().display(),
                        inputs.options.output.display()
                    )));
                }
            }
        }
    }
    segments.complete(total)?;
    Ok((effort, total - first, begun.elapsed().as_secs_f64(), account))
}

/// The state of rest that is wanted: the one that stability is examined about, where the job does not say.
fn start_state(job: &Job, wanted: &job::Transient) -> StartState {
    let examined = job.analyses.stability.as_ref().map(job::Stability::state);
    wanted.start.state.unwrap_or(match examined {
        Some(StabilityState::Steady) => StartState::Steady,
        _ => StartState::Sliding,
    })
}

/// The state of rest.
struct Rest {
    /// Reactions, N, `[3n]`.
    reaction: Vec<f64>,
    /// Coefficients of friction, `[n]`.
    friction: Vec<f64>,
    /// m.
    approach: f64,
    /// What of the displacements the placement has already, m, `[3n]`.
    deflection: Option<Vec<f64>>,
}

impl Rest {
    fn of(inputs: &Inputs<'_>, root: &ReducedModel) -> Result<Self> {
        let (reaction, friction, approach) = at_rest(inputs, root)?;
        let deflection = root.pair.deflection(&reaction);
        Ok(Self { reaction, friction, approach, deflection })
    }

    /// The interface of bodies without load, whose gap becomes that of `placed` ones under it.
    fn interface(&self, placed: &Interface) -> Interface {
        match &self.deflection {
            Some(moved) => placed.with_gap((0..placed.len()).map(|i| placed.gap[i] - moved[3 * i + 2]).collect()),
            None => placed.clone(),
        }
    }

    /// ∂/∂x of the deflection along x and y.
    fn slopes(&self, interface: &Interface) -> [f64; 2] {
        let Some(moved) = &self.deflection else { return [0.0; 2] };
        // The deflection goes with x and y, no higher: any line along x will do.
        let (nx, x) = (interface.x.len(), &interface.x);
        let length = x[nx - 1] - x[0];
        [0, 1].map(|c| (moved[3 * (nx - 1) + c] - moved[c]) / length)
    }

    fn state(&self, model: &Model<'_>) -> State {
        State::at_rest(model, &self.reaction, self.approach).remembering(&self.friction)
    }
}

/// Reactions, coefficients of friction and approach of the state of rest.
fn at_rest(inputs: &Inputs<'_>, root: &ReducedModel) -> Result<(Vec<f64>, Vec<f64>, f64)> {
    let contact = inputs.contact;
    let histories = inputs.wanted.histories.clone().unwrap_or_default();
    // A history says what holds at the start too.
    let at_start = |table: &Option<Vec<[f64; 2]>>, key: &str| -> Result<Option<f64>> {
        let Some(points) = table else { return Ok(None) };
        Ok(Some(
            History::table(&format!("analyses.transient.histories.{key}"), points, inputs.wanted.duration)?.at(0.0),
        ))
    };
    let mut creepage = creepage(contact);
    for (value, given, key) in [
        (&mut creepage.longitudinal, &histories.longitudinal, "longitudinal"),
        (&mut creepage.lateral, &histories.lateral, "lateral"),
        (&mut creepage.spin, &histories.spin, "spin"),
    ] {
        if let Some(v) = at_start(given, key)? {
            *value = v;
        }
    }
    let mut load = normal_load(contact);
    if let Some(n) = at_start(&histories.normal_load, "normal_load")? {
        if n == 0.0 {
            return Err(Error::Job(
                "analyses.transient.histories.normal_load: begins with 0 N, but the run begins with rolling under load; let it \
                 begin with a load above 0 (a small one, such as 1 N, will do)"
                    .into(),
            ));
        }
        load = NormalLoad::Force(n);
    }
    if let Some(d) = at_start(&histories.approach, "approach")? {
        load = NormalLoad::Approach(d);
    }
    let analyses = &inputs.job.analyses;
    let (pressure, traction, approach, friction) = match start_state(inputs.job, inputs.wanted) {
        StartState::Sliding => {
            let direction = analyses.stability.as_ref().map_or(Direction::Rigid, |s| s.direction);
            let problem = steady_sliding((&root.interface, &root.pair), contact, direction)?;
            let problem = SlidingProblem { creepage, load, ..problem };
            well_posed::refuse_short(&contact.friction, |law| well_posed::sliding(&problem, law, &root.pair))?;
            let found = problem.solve()?;
            (found.pressure, found.traction, found.approach, found.friction)
        }
        StartState::Steady => {
            let problem = interface::at_rest((&root.interface, &root.pair), contact, analyses.steady.as_ref());
            let problem = SteadyProblem { creepage, load, ..problem };
            well_posed::refuse_short(&contact.friction, |law| well_posed::rolling(&problem, law, &root.pair))?;
            let found = problem.solve()?;
            (found.pressure, found.traction, found.approach, found.friction)
        }
    };
    let interface = &root.interface;
    let reaction: Vec<f64> = (0..interface.len())
        .flat_map(|i| [traction[i][0], traction[i][1], pressure[i]].map(|v| v * interface.weight[i]))
        .collect();
    Ok((reaction, friction, approach))
}

/// The contact points of the job, under its load or their given forces; none of a job with a grid.
fn at_points(inputs: &Inputs, root: &ReducedModel) -> Result<Option<PointModel>> {
    let (contact, pair, s) = (inputs.contact, &root.pair, &root.interface);
    let span = inputs.wanted.theta * inputs.wanted.step;
    let law = &contact.friction;
    if !s.are_points() {
        return Ok(None);
    }
    if let Some(points) = given_forces(contact) {
        well_posed::refuse_short(law, |law| sharpness(pair, &linearised(&points, law)))?;
        let friction = points.iter().map(|p| p.coefficient(law)).collect();
        return Ok(Some(PointModel::given(pair, s, (reactions(&points, law), friction), span)));
    }
    let problem = steady_sliding((s, pair), contact, Direction::Rigid)?;
    well_posed::refuse_short(law, |law| well_posed::sliding(&problem, law, pair))?;
    let found = problem.solve()?;
    let of = |i: usize| [found.traction[i][0], found.traction[i][1], found.pressure[i]];
    let reaction: Vec<f64> = (0..s.len()).flat_map(of).collect();
    bear_load(pair, &reaction)?;
    Ok(Some(PointModel::under_load(pair, s, (reaction, found.friction), found.approach, span)))
}

/// Largest displacement of a contact node over the period of the motion Ψ z e^{iωt}, in the unit of Ψ z: the square root of the sum of
/// the squared amplitudes along x, y and n, with the phase of the largest of them. Rows of `psi` are 3i + c.
fn largest_displacement(psi: MatRef<'_, f64>, modal: &[Complex64]) -> Complex64 {
    let component = |row: usize| psi.row(row).iter().zip(modal).map(|(p, z)| z * p).sum::<Complex64>();
    let node = |i: usize| {
        let all = [0, 1, 2].map(|c| component(3 * i + c));
        let size = all.iter().map(|u| u.norm_sqr()).sum::<f64>().sqrt();
        let first = all.into_iter().max_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr())).unwrap_or_default();
        if first.norm() > 0.0 {
            first * (size / first.norm())
        } else {
            first
        }
    };
    (0..psi.nrows() / 3).map(node).max_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr())).unwrap_or_default()
}

/// The start with its perturbations, and whether there are any.
fn perturbed(inputs: &Inputs<'_>, root: &ReducedModel, mut state: State) -> Result<(State, bool)> {
    let start = &inputs.wanted.start;
    if let Some(number) = start.mode {
        let pair = (number as usize).checked_sub(1).and_then(|i| inputs.eigenpairs().get(i)).ok_or_else(|| {
            let found = inputs.eigenpairs().len();
            Error::Job(format!("analyses.transient.start.mode is {number}: stability found {found} eigenvalues"))
        })?;
        let largest = largest_displacement(root.pair.modes.as_ref(), &pair.modal);
        // A wave has no phase of its own: its largest displacement is now.
        let phase = match root.pair.turning {
            Some(_) => largest.conj() / largest.norm(),
            None => Complex64::from(1.0),
        };
        let modal: Vec<Complex64> = pair.modal.iter().map(|z| phase * z).collect();
        state = state.perturbed(&modal, pair.value, start.amplitude / largest.norm());
    }
    if let Some(random) = start.random {
        state = state.shaken(u64::from(random.seed), random.energy);
    }
    Ok((state, start.mode.is_some() || start.random.is_some()))
}

/// What can be refused before anything is meshed.
pub fn check(job: &Job, wanted: &job::Transient, contact: &job::Contact) -> Result<()> {
    Scheme { step: wanted.step, theta: wanted.theta }.check(&[])?;
    sound::check(wanted)?;
    roughness::check(job)?;
    drive(wanted, contact, 0.0, [0.0; 2]).map(|_| ())
}

/// What is prescribed in time; `deflected` are the derivatives along x of a deflection that is part of the placement: its material passes too.
fn drive(wanted: &job::Transient, contact: &job::Contact, approach: f64, deflected: [f64; 2]) -> Result<Drive> {
    let histories = wanted.histories.clone().unwrap_or_default();
    let history = |key: &str, table: &Option<Vec<[f64; 2]>>, constant: f64, factor: f64| -> Result<History> {
        let Some(points) = table else { return Ok(History::constant(constant * factor)) };
        let points: Vec<[f64; 2]> = points.iter().map(|p| [p[0], p[1] * factor]).collect();
        History::table(&format!("analyses.transient.histories.{key}"), &points, wanted.duration)
    };
    let load = match (wanted.hold, normal_load(contact)) {
        (Hold::Load, NormalLoad::Force(n)) => NormalLoad::Force(n),
        _ => NormalLoad::Approach(approach),
    };
    let normal = match (&histories.normal_load, &histories.approach, load) {
        (table @ Some(_), _, _) => Normal::Force(history("normal_load", table, 0.0, 1.0)?),
        (_, table @ Some(_), _) => Normal::Approach(history("approach", table, 0.0, 1.0)?),
        (_, _, load) => Normal::constant(load),
    };
    let v = contact.speed;
    let c = creepage(contact);
    Ok(Drive {
        normal,
        tangential: [
            Tangential::Creep(
                history("longitudinal", &histories.longitudinal, c.longitudinal, v)?.plus(-v * deflected[0]),
            ),
            Tangential::Creep(history("lateral", &histories.lateral, c.lateral, v)?.plus(-v * deflected[1])),
        ],
        spin: history("spin", &histories.spin, c.spin, v)?,
        speed: v,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_displacement_counts_all_directions_and_phases() {
        // Two nodes, two modes: the second node moves by 3i along x and by 4 along n.
        let psi = faer::Mat::from_fn(6, 2, |row, k| {
            [[1.0, 0.0], [0.0; 2], [0.0; 2], [0.0, 1.0], [0.0; 2], [2.0, 0.0]][row][k]
        });
        let modal = [Complex64::new(2.0, 0.0), Complex64::new(0.0, 3.0)];
        let found = largest_displacement(psi.as_ref(), &modal);
        assert!((found.norm() - 5.0).abs() < 1e-15, "{found}");
    }
}
