//! State of a transient before it is disturbed: equilibrium and prescribed quantities.

use super::interface::{self, creepage, given_forces, kinematics, loads, steady_sliding};
use super::well_posed;
use crate::contact::consistent::{augmentation, ConsistentSteady};
use crate::contact::full_sliding::SlidingProblem;
use crate::contact::law::Augmentation;
use crate::contact::points::{bear_load, linearised, reactions};
use crate::contact::{Loads, NormalLoad, PatchKinematics, SteadyProblem};
use crate::grid::{ContactPatch, Interface};
use crate::job::{self, Direction, HeldQuantity, Job, Quadrature, StabilityState, StartState, TransientSolver};
use crate::model::CoupledModel;
use crate::stability::reduced::{sharpness, Eigenpair};
use crate::transient::loading::{History, Loading, Normal, PatchDrive, Tangential};
use crate::transient::{ContactSolver, Model, PointModel, Scheme, Settings, State};
use crate::{Error, Result};
use faer::MatRef;
use num_complex::Complex64;

/// A transient of a job on two bodies and their interface.
#[derive(Clone, Copy)]
pub(crate) struct TransientProblem<'a> {
    pub(crate) job: &'a Job,
    pub(crate) wanted: &'a job::Transient,
    pub(crate) contact: &'a job::Contact,
    pub(crate) model: (&'a Interface, &'a CoupledModel),
}

/// State known before the first step.
pub(crate) struct StepperSetUp {
    interface: Interface,
    begin: Begin,
    /// Forces on the modes that keep bodies at rest which nothing else holds, N/√kg, `[m]`; none where all are held.
    load: Vec<f64>,
}

/// Rest on a grid or on points.
enum Begin {
    Grid(InitialEquilibrium),
    Points(PointModel),
}

impl TransientProblem<'_> {
    /// The state of rest, whose approach is held.
    pub(crate) fn ready(&self) -> Result<StepperSetUp> {
        if let Some(points) = at_points(self)? {
            let interface = self.model.0.clone();
            return Ok(StepperSetUp { interface, begin: Begin::Points(points), load: Vec::new() });
        }
        let rest = InitialEquilibrium::of(self)?;
        let load = rest.kept_by(self.model.1);
        Ok(StepperSetUp { interface: rest.interface(self.model.0), begin: Begin::Grid(rest), load })
    }

    /// ρ of the laws at points of quadrature, where they hold there: those of the state of rest.
    pub(crate) fn augmentation(&self) -> Option<Augmentation> {
        let consistent = self.contact.quadrature == Quadrature::Consistent;
        consistent.then(|| augmentation(&interface::at_rest(self.model, self.contact, None)))
    }
}

impl StepperSetUp {
    /// The interface of the bodies without load.
    pub(crate) fn interface(&self) -> &Interface {
        &self.interface
    }

    /// The bodies `pair` as the steps take them.
    pub(crate) fn model<'a>(&'a self, pair: &'a CoupledModel) -> Model<'a> {
        match &self.begin {
            Begin::Points(points) => points.model(pair),
            Begin::Grid(_) => Model { load: &self.load, ..Model::new(pair, &self.interface) },
        }
    }

    /// The load of [`StepperSetUp::model`] on a grid, N/√kg, `[m]`; none where nothing is loaded.
    pub(crate) fn load(&self) -> &[f64] {
        &self.load
    }

    /// The state of rest of `model`, and what does not change in time.
    pub(crate) fn initial_state(&self, model: &Model<'_>, rolling: &TransientProblem<'_>) -> Result<(State, Settings)> {
        let wanted = rolling.wanted;
        let (rest, deflected) = match &self.begin {
            Begin::Points(points) => (points.at_rest(model), Vec::new()),
            Begin::Grid(rest) => (rest.state(model), rest.slopes(rolling.model.0)),
        };
        let settings = Settings {
            scheme: Scheme { step: wanted.step, theta: wanted.theta },
            friction: interface::friction(rolling.contact),
            solver: match wanted.solver {
                TransientSolver::Newton => ContactSolver::Newton,
                TransientSolver::FixedPoint => ContactSolver::FixedPoint,
            },
            tolerance: wanted.tolerance,
            drive: drive(wanted, rolling.contact, &rest.motions, &deflected)?,
        };
        Ok((rest, settings))
    }
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
struct InitialEquilibrium {
    /// Reactions, N, `[3n]`.
    reaction: Vec<f64>,
    /// Coefficients of friction, `[n]`.
    friction: Vec<f64>,
    /// Rigid motions, m, `[motions]`.
    motions: Vec<f64>,
    /// Displacements that the placement already includes, m, `[3n]`.
    deflection: Option<Vec<f64>>,
}

impl InitialEquilibrium {
    fn of(rolling: &TransientProblem<'_>) -> Result<Self> {
        let (reaction, friction, motions) = at_rest(rolling)?;
        let deflection = rolling.model.1.deflection(&reaction);
        Ok(Self { reaction, friction, motions, deflection })
    }

    /// The interface of bodies without load, whose gap becomes that of `placed` ones under it.
    fn interface(&self, placed: &Interface) -> Interface {
        match &self.deflection {
            Some(moved) => placed.with_gap((0..placed.len()).map(|i| placed.gap[i] - moved[3 * i + 2]).collect()),
            None => placed.clone(),
        }
    }

    /// ∂/∂x of the deflection along x and y at each contact; empty where there is no deflection.
    fn slopes(&self, interface: &Interface) -> Vec<[f64; 2]> {
        let Some(moved) = &self.deflection else { return Vec::new() };
        // The deflection goes with x and y, no higher: any line along x will do.
        let slope = |patch: &ContactPatch| {
            let last = patch.x.len() - 1;
            let (length, ends) = (patch.x[last] - patch.x[0], [patch.node(last, 0), patch.first]);
            [0, 1].map(|c| (moved[3 * ends[0] + c] - moved[3 * ends[1] + c]) / length)
        };
        interface.patches.iter().map(slope).collect()
    }

    /// The loads of modes without frequency that balance the reactions, N/√kg, `[m]`: of a wheelset that is free to
    /// turn the torque of what drives it at the creepages of the job. None where there is no such mode.
    fn kept_by(&self, pair: &CoupledModel) -> Vec<f64> {
        if pair.omega.iter().all(|&omega| omega > 0.0) {
            return Vec::new();
        }
        let reaction = |k: usize| self.reaction.iter().enumerate().map(|(i, r)| pair.modes[(i, k)] * r).sum::<f64>();
        let load = |(k, &omega): (usize, &f64)| if omega > 0.0 { 0.0 } else { -reaction(k) };
        pair.omega.iter().enumerate().map(load).collect()
    }

    fn state(&self, model: &Model<'_>) -> State {
        State::at_rest(model, &self.reaction, &self.motions).remembering(&self.friction)
    }
}

/// Reactions, coefficients of friction and rigid motions of the state of rest.
fn at_rest(rolling: &TransientProblem<'_>) -> Result<(Vec<f64>, Vec<f64>, Vec<f64>)> {
    let TransientProblem { job, wanted, contact, model } = *rolling;
    let (interface, pair) = model;
    let Prescribed { kinematics, loads } = at_start(wanted, contact)?;
    let analyses = &job.analyses;
    let (pressure, traction, motions, friction) = match start_state(job, wanted) {
        StartState::Sliding => {
            let direction = analyses.stability.as_ref().map_or(Direction::Rigid, |s| s.direction);
            let problem = steady_sliding(model, contact, direction)?;
            let problem = SlidingProblem { kinematics, loads, ..problem };
            well_posed::refuse_short(contact, |friction| well_posed::sliding(&problem, friction, pair))?;
            let found = problem.solve()?;
            (found.pressure, found.traction, found.motions, found.friction)
        }
        StartState::Steady => {
            let problem = interface::at_rest(model, contact, analyses.steady.as_ref());
            let problem = SteadyProblem { kinematics, loads, ..problem };
            well_posed::refuse_short(contact, |friction| well_posed::rolling(&problem, friction, pair))?;
            let found = match contact.quadrature {
                Quadrature::Nodal => problem.solve()?,
                Quadrature::Consistent => ConsistentSteady::new(problem).solve()?.solution,
            };
            (found.pressure, found.traction, found.motions, found.friction)
        }
    };
    let reaction: Vec<f64> = (0..interface.len())
        .flat_map(|i| [traction[i][0], traction[i][1], pressure[i]].map(|v| v * interface.weight[i]))
        .collect();
    Ok((reaction, friction, motions))
}

/// The contact points of the job, under its load or their given forces; none of a job with a grid.
fn at_points(rolling: &TransientProblem<'_>) -> Result<Option<PointModel>> {
    let TransientProblem { wanted, contact, model: (s, pair), .. } = *rolling;
    let span = wanted.theta * wanted.step;
    let law = contact.law();
    if !s.are_points() {
        return Ok(None);
    }
    if let Some(points) = given_forces(contact) {
        well_posed::refuse_short(contact, |friction| sharpness(pair, &linearised(&points, friction.law(0))))?;
        let friction = points.iter().map(|p| p.coefficient(law)).collect();
        return Ok(Some(PointModel::with_reactions(pair, s, (reactions(&points, law), friction), span)));
    }
    let problem = steady_sliding((s, pair), contact, Direction::Rigid)?;
    let problem = SlidingProblem { loads: at_start(wanted, contact)?.loads, ..problem };
    well_posed::refuse_short(contact, |friction| well_posed::sliding(&problem, friction, pair))?;
    let found = problem.solve()?;
    let of = |i: usize| [found.traction[i][0], found.traction[i][1], found.pressure[i]].map(|v| v * s.weight[i]);
    let reaction: Vec<f64> = (0..s.len()).flat_map(of).collect();
    bear_load(pair, &reaction)?;
    Ok(Some(PointModel::under_load(pair, s, (reaction, found.friction), found.motions, span)))
}

/// Rolling of each contact and the loads.
struct Prescribed {
    kinematics: Vec<PatchKinematics>,
    loads: Loads,
}

/// Rolling and loads at the start, where histories say what holds then too.
fn at_start(wanted: &job::Transient, contact: &job::Contact) -> Result<Prescribed> {
    let histories = histories(wanted, contact)?;
    let mut start = Prescribed { kinematics: kinematics(contact), loads: loads(contact) };
    let value = |path: &str, key: &str, table: &Option<Vec<[f64; 2]>>| -> Result<Option<f64>> {
        let Some(points) = table else { return Ok(None) };
        Ok(Some(History::table(&format!("{path}.{key}"), points, wanted.duration)?.value(0.0)))
    };
    let force = |path: &str, key: &str, table: &Option<Vec<[f64; 2]>>| match value(path, key, table)? {
        Some(0.0) => Err(Error::Job(format!(
            "{path}.{key}: begins with 0 N, but the run begins with rolling under load; let it begin with a load \
             above 0 (a small one, such as 1 N, will do)"
        ))),
        found => Ok(found.map(NormalLoad::Force)),
    };
    for (number, (path, own)) in histories.all().iter().enumerate() {
        let creepage = &mut start.kinematics[number].creepage;
        for (creep, table, key) in [
            (&mut creepage.longitudinal, &own.longitudinal, "longitudinal"),
            (&mut creepage.lateral, &own.lateral, "lateral"),
            (&mut creepage.spin, &own.spin, "spin"),
        ] {
            *creep = value(path, key, table)?.unwrap_or(*creep);
        }
        let approach = value(path, "approach", &own.approach)?.map(NormalLoad::Approach);
        if let Some(load) = force(path, "normal_load", &own.normal_load)?.or(approach) {
            start.loads.motions[number].load = load;
        }
    }
    if let Some(load) = force("analyses.transient.histories", "vertical_load", &histories.vertical_load)? {
        start.loads.motions[0].load = load;
    }
    if let Some(force) = value("analyses.transient.histories", "lateral_force", &histories.lateral_force)? {
        lateral(&mut start.loads.motions)?.load = NormalLoad::Force(-force);
    }
    Ok(start)
}

/// The histories of the job; an error where they are of more contacts than there are.
pub(crate) fn histories(wanted: &job::Transient, contact: &job::Contact) -> Result<job::Histories> {
    let histories = wanted.histories.clone().unwrap_or_default();
    let (found, there) = (histories.further.len(), contact.all().count() - 1);
    if found > there {
        return Err(Error::Job(format!(
            "analyses.transient.histories.further: found tables of {found} further contacts, expected at most {there}: \
             the job has {} contacts",
            there + 1
        )));
    }
    Ok(histories)
}

/// Prescribed quantities in time, of rigid motions that begin with `motions`, m. `deflected` are the derivatives along
/// x of a deflection of each contact that is part of the placement: its material passes too.
pub(crate) fn drive(
    wanted: &job::Transient,
    contact: &job::Contact,
    motions: &[f64],
    deflected: &[[f64; 2]],
) -> Result<Loading> {
    let histories = histories(wanted, contact)?;
    let history = |key: String, table: &Option<Vec<[f64; 2]>>, constant: f64, factor: f64| -> Result<History> {
        let Some(points) = table else { return Ok(History::constant(constant * factor)) };
        let points: Vec<[f64; 2]> = points.iter().map(|p| [p[0], p[1] * factor]).collect();
        History::table(&key, &points, wanted.duration)
    };
    let of_contact = |(number, one): (usize, &job::Contact)| -> Result<PatchDrive> {
        let (v, c) = (one.speed, creepage(one));
        let (path, own) = histories.of_contact(number);
        let deflected = deflected.get(number).copied().unwrap_or_default();
        let longitudinal = history(format!("{path}.longitudinal"), &own.longitudinal, c.longitudinal, v)?;
        let lateral = history(format!("{path}.lateral"), &own.lateral, c.lateral, v)?;
        let tangential = [longitudinal.plus(-v * deflected[0]), lateral.plus(-v * deflected[1])].map(Tangential::Creep);
        let spin = history(format!("{path}.spin"), &own.spin, c.spin, v)?;
        Ok(PatchDrive { tangential, spin, speed: v })
    };
    let patches = contact.all().enumerate().map(of_contact).collect::<Result<Vec<_>>>()?;
    let loads = loads(contact);
    let forces = loads.motions.iter().all(|m| matches!(m.load, NormalLoad::Force(_)));
    let mut loading = Loading::of_loads(&loads, patches);
    if wanted.hold == HeldQuantity::Approach || !forces {
        loading = loading.held_at(motions);
    }
    for (number, (path, own)) in histories.all().iter().enumerate() {
        if own.normal_load.is_some() {
            let load = history(format!("{path}.normal_load"), &own.normal_load, 0.0, 1.0)?;
            loading.motions[number].normal = Normal::Force(load);
        } else if own.approach.is_some() {
            let approach = history(format!("{path}.approach"), &own.approach, 0.0, 1.0)?;
            loading.motions[number].normal = Normal::Approach(approach);
        }
    }
    if histories.vertical_load.is_some() {
        let key = "analyses.transient.histories.vertical_load";
        loading.motions[0].normal = Normal::Force(history(key.into(), &histories.vertical_load, 0.0, 1.0)?);
    }
    if histories.lateral_force.is_some() {
        let key = "analyses.transient.histories.lateral_force";
        let force = history(key.into(), &histories.lateral_force, 0.0, -1.0)?;
        lateral(&mut loading.motions)?.normal = Normal::Force(force);
    }
    Ok(loading)
}

/// The lateral one of the rigid `motions` of a wheel, which follows the vertical one. Its resultant is the force of the
/// wheel on the rail, against that of the job.
fn lateral<M>(motions: &mut [M]) -> Result<&mut M> {
    let missing = || Error::Defect("a history of the lateral force without a lateral motion".into());
    motions.get_mut(1).ok_or_else(missing)
}

/// The state moved by a complex mode, whose largest displacement of a contact node is to be `amplitude`, m.
pub(crate) fn moved(state: State, pair: &CoupledModel, mode: &Eigenpair, amplitude: f64) -> State {
    let scale = scale(pair, &mode.modal, amplitude);
    let modal: Vec<Complex64> = mode.modal.iter().map(|z| scale * z).collect();
    state.perturbed(&modal, mode.value, 1.0)
}

/// Factor of a complex mode with the amplitudes `modal` of the free modes that makes the largest displacement of a
/// contact node `amplitude`, m, at this moment: an eigenvector has neither phase nor sign of its own, and those of the
/// modes come from the solver.
pub(crate) fn scale(pair: &CoupledModel, modal: &[Complex64], amplitude: f64) -> Complex64 {
    let largest = largest_displacement(pair.modes.as_ref(), modal);
    largest.conj() * (amplitude / largest.norm_sqr())
}

/// Displacements that differ by less than this share are taken for equally large, and the first of them is taken:
/// nodes beside a plane of symmetry differ by rounding alone.
const ALIKE: f64 = 1e-6;

/// Largest displacement of a contact node over the period of the motion Ψ z e^{iωt}, in the unit of Ψ z: the square
/// root of the sum of the squared amplitudes along x, y and n, with the phase of the largest of them. Rows of `psi`
/// are 3i + c.
fn largest_displacement(psi: MatRef<'_, f64>, modal: &[Complex64]) -> Complex64 {
    let component = |row: usize| psi.row(row).iter().zip(modal).map(|(p, z)| z * p).sum::<Complex64>();
    let node = |i: usize| {
        let all = [0, 1, 2].map(|c| component(3 * i + c));
        let size = all.iter().map(|u| u.norm_sqr()).sum::<f64>().sqrt();
        let first = first_of_largest(&all);
        if first.norm() > 0.0 {
            first * (size / first.norm())
        } else {
            first
        }
    };
    first_of_largest(&(0..psi.nrows() / 3).map(node).collect::<Vec<Complex64>>())
}

/// The first of those that are as large as the largest.
fn first_of_largest(all: &[Complex64]) -> Complex64 {
    let largest = all.iter().map(|u| u.norm()).fold(0.0, f64::max);
    all.iter().find(|u| u.norm() >= (1.0 - ALIKE) * largest).copied().unwrap_or_default()
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

    /// Either of the vertical and the lateral force on a wheel may be given over time, from the start on; the other one
    /// is held with its motion.
    #[test]
    fn forces_on_a_wheel_have_histories() {
        let text = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/lateral-force.json"));
        let table = "[[0, -31e3], [2e-3, -33e3]]";
        let sets = [
            r#"analyses.transient={"duration": 1e-3, "step": 1e-5, "start": {"state": "steady"}}"#.to_owned(),
            format!("analyses.transient.histories.lateral_force={table}"),
        ];
        let job = job::Job::from_bytes(text, "job.json".as_ref(), &sets, None).expect("a job");
        let (wanted, mut contact) = (job.analyses.transient.expect("a transient"), job.contact.expect("a contact"));
        contact.further = vec![contact.clone()];
        let start = at_start(&wanted, &contact).expect("a start");
        assert_eq!(start.loads.motions.iter().map(|m| m.load).collect::<Vec<_>>(), [60e3, 31e3].map(NormalLoad::Force));
        let drive = drive(&wanted, &contact, &[1e-4, 2e-6], &[]).expect("a drive");
        let at = |j: usize, t: f64| match &drive.motions[j].normal {
            Normal::Approach(history) => ("held", history.value(t)),
            Normal::Force(history) => ("force", history.value(t)),
        };
        assert_eq!([at(0, 1e-3), at(1, 0.0), at(1, 1e-3)], [("held", 1e-4), ("force", 31e3), ("force", 32e3)]);
        // Not without the force from which the shift follows.
        let aside = ["contact.lateral_force=null".to_owned(), "contact.placement.lateral=6.5e-3".to_owned()];
        let refused = job::Job::from_bytes(text, "job.json".as_ref(), &[&sets[..], &aside].concat(), None).unwrap_err();
        assert!(refused.to_string().contains("histories.lateral_force: given without"), "{refused}");
    }

    #[test]
    fn of_displacements_that_rounding_alone_tells_apart_the_first_counts() {
        // The ends of a rod that tilts, in both orders of rounding.
        for error in [-1e-12, 1e-12] {
            let psi = faer::Mat::from_fn(6, 1, |row, _| [0.0, 0.0, 1.0, 0.0, 0.0, -1.0 - error][row]);
            let found = largest_displacement(psi.as_ref(), &[Complex64::i()]);
            assert_eq!(found, Complex64::i());
        }
    }
}
