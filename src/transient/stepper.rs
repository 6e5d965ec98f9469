//! One step after the other.

use faer::{Mat, MatRef};

use super::aligned::padded_len;
use super::border::Border;
use super::departure_point::{feet, DeparturePoint};
use super::dynamics::Dynamics;
use super::energy::Energy;
use super::loading::Loading;
use super::low_rank_modes::LowRankModes;
use super::model::{Impact, Model};
use super::newton::NewtonMemory;
use super::problem::{ContactSolver, Effort, StepProblem};
use super::scheme::Scheme;
use crate::dense::{self, dot};
use crate::friction::{PatchFriction, Remembered};
use crate::grid::{ContactPatch, Interface};
use crate::roughness::RoughSurfaces;
use crate::{Error, Result};

mod carried;
mod construction;
mod energy_balance;
mod integrated;
mod linearised;
mod remembered;
mod roughness_gap;
mod step_drive;
mod step_result;
mod working_set;

use integrated::Integrated;
pub use linearised::StateChanges;
use roughness_gap::RoughnessGap;
use step_drive::StepDrive;
pub use step_result::{ContactProblemView, PatchReport, StepFields, StepReport};
use step_result::{NodeState, StepEnd};
use working_set::{InactiveNodes, WorkingSet};

/// Gap of a node that cannot close in a step, m: more than any body moves.
const FAR: f64 = 1.0;
/// Steps that the first guess of the next one is extrapolated from.
const PAST: usize = 4;

/// Settings that are constant in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Step and θ.
    pub scheme: Scheme,
    /// Friction law of each patch.
    pub friction: PatchFriction,
    /// Solver of the contact problem of a step.
    pub solver: ContactSolver,
    /// Residual of a step relative to the normal force.
    pub tolerance: f64,
    /// Prescribed quantities.
    pub drive: Loading,
}

/// Everything that the future depends on, for n nodes and m modes.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Steps done.
    pub step: u64,
    /// Modal displacements, `[m]`.
    pub q: Vec<f64>,
    /// Modal velocities, `[m]`.
    pub v: Vec<f64>,
    /// Reactions (tx, ty, p), N, `[3n]`.
    pub reaction: Vec<f64>,
    /// Rigid motions of the loading, m, `[motions]`; of one patch its approach.
    pub motions: Vec<f64>,
    /// Rigid creep velocities, m/s, of the directions with a prescribed force.
    pub creep: [f64; 2],
    /// Coefficients of friction that the material at the nodes remembers, `[n]`; empty where friction is constant. A
    /// start without them has that at rest everywhere.
    pub friction: Vec<f64>,
    /// Energies.
    pub energy: Energy,
}

/// Advances a [`State`] in time.
///
/// ```
/// use faer::Mat;
/// use railsqueal::contact::{ContactCreepage, NormalLoad};
/// use railsqueal::friction::FrictionLaw;
/// use railsqueal::grid::Interface;
/// use railsqueal::model::ModalMatrix;
/// use railsqueal::transient::{ContactSolver, Loading, Model, Scheme, Settings, State, Stepper};
///
/// // A point that yields by 10 nm/N on a belt, under 100 N: it sticks, then it slides under μN.
/// let interface = Interface::points(vec![0.0], vec![[0.0; 2]])?;
/// let residual = Mat::from_fn(3, 3, |i, j| if i == j { 1e-8 } else { 0.0 });
/// let modes = Mat::<f64>::zeros(3, 0);
/// let model = Model {
///     interface: &interface,
///     residual: residual.as_ref(),
///     modes: modes.as_ref(),
///     omega: &[],
///     stiffness: ModalMatrix::squares(&[]),
///     damping: Vec::new().into(),
///     turning: None,
///     carried: None,
///     load: &[],
/// };
/// // The belt runs with the creepage times the speed, 0.01 m/s.
/// let creepage = ContactCreepage { longitudinal: 0.01, ..ContactCreepage::default() };
/// let settings = Settings {
///     scheme: Scheme { step: 1e-5, theta: 0.5 },
///     friction: FrictionLaw::Constant(0.3).into(),
///     solver: ContactSolver::Newton,
///     tolerance: 1e-10,
///     drive: Loading::constant(NormalLoad::Approach(1e-6), creepage, 1.0),
/// };
/// let rest = State::at_rest(&model, &[0.0, 0.0, 100.0], &[1e-6]);
/// let mut stepper = Stepper::new(model, settings, rest)?;
/// stepper.advance()?;
/// assert_eq!(stepper.report().patches[0].stick, 1);
/// for _ in 0..10 {
///     stepper.advance()?;
/// }
/// let [x, _, z] = stepper.report().patches[0].force;
/// assert!((x.abs() - 30.0).abs() < 1e-6 && (z + 100.0).abs() < 1e-6);
/// # Ok::<(), railsqueal::Error>(())
/// ```
pub struct Stepper<'a> {
    model: Model<'a>,
    settings: Settings,
    impact: Impact,
    motion: Box<dyn Dynamics + 'a>,
    /// True if the nodes of the surface have mass: all degrees of freedom move, none is taken statically.
    massive: bool,
    /// W, m/N, `[3n, 3n]`.
    w: Mat<f64>,
    /// Foot of each grid column of each patch.
    feet: Vec<Vec<Option<DeparturePoint>>>,
    /// ∂x g0, `[n]`.
    slope: Vec<f64>,
    /// Largest size of a gap of the smooth bodies, m.
    widest: f64,
    /// The gap with the roughness that passes.
    passing: RoughnessGap,
    state: State,
    working: WorkingSet,
    outside: InactiveNodes,
    memory: NewtonMemory,
    /// The laws at points of quadrature; none where they hold node by node.
    integrated: Option<Integrated>,
    /// Ψ.
    shapes: LowRankModes,
    /// Modal reactions of the present state, where they are at hand.
    modal_now: Option<Vec<f64>>,
    /// Reactions on the core and their responses at the end of the last steps, the last one first.
    past: Vec<(Vec<f64>, Vec<f64>)>,
    /// Result of the last step.
    met: NodeState,
    /// Displacements of the core without its reactions in the last step, m, `[3 core]`; empty where the nodes are new.
    posed: Vec<f64>,
    /// Memory of friction before it, `[core]`.
    before: Vec<Remembered>,
    report: StepReport,
    /// Patches that stayed open in the last step, because nothing pressed them.
    open: Vec<bool>,
    /// The start has settled and no step has followed: the reactions are those of a step later.
    settled: bool,
}

impl<'a> Stepper<'a> {
    /// The same on rough surfaces, `[patches]`.
    pub fn rough(mut self, surfaces: Vec<RoughSurfaces>) -> Result<Self> {
        self.passing = RoughnessGap::rough(self.model.interface, surfaces)?;
        Ok(self)
    }

    /// Forgets everything that is not part of the state, so that a run continued from here goes on in the same way.
    pub fn reset(&mut self) -> Result<()> {
        self.memory.forget();
        self.past.clear();
        self.modal_now = None;
        self.gather(pressed(&self.state.reaction))
    }

    /// The present state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Angular frequencies of the modes, rad/s, `[m]`.
    pub fn omega(&self) -> &[f64] {
        self.model.omega
    }

    /// Goes on from another state.
    pub fn put(&mut self, mut state: State) -> Result<()> {
        if self.settings.friction.memory().is_none() {
            state.friction.clear();
        }
        self.state = state;
        self.settled = false;
        self.reset()
    }

    /// Goes on from another state in steps of `step`, s. To be called of a [driven](Self::driven) stepper, whose W does
    /// not depend on the step.
    pub fn restart(&mut self, step: f64, state: State) -> Result<()> {
        self.settings.scheme.step = step;
        self.settings.scheme.check(&[])?;
        self.feet = all_feet(self.model.interface, &self.settings.drive, step);
        self.put(state)
    }

    /// Ψᵀ R of the last step, `[m]`; none before it.
    pub(crate) fn modal_force(&self) -> Option<&[f64]> {
        self.modal_now.as_deref()
    }

    /// The time of the present state, s.
    pub fn time(&self) -> f64 {
        self.state.step as f64 * self.settings.scheme.step
    }

    /// The contact patches.
    pub fn patches(&self) -> &[ContactPatch] {
        &self.model.interface.patches
    }

    /// Approach of patch `c` in the present state, m.
    pub fn approach(&self, c: usize) -> f64 {
        self.settings.drive.approaches(&self.state.motions)[c]
    }

    /// The report of the last step.
    pub fn report(&self) -> &StepReport {
        &self.report
    }

    /// The reactions that hold at the present displacements: those at the end of a first step, taken from here. To be
    /// called at a start whose modes were perturbed and whose reactions were not. The state stays where it is in
    /// time. These reactions are a step ahead of the displacements, and the work of closing what they leave open, p·v
    /// h, is that of the start: the balance of energy is counted from the end of the first step.
    pub fn settle(&mut self) -> Result<()> {
        let kept = self.state.clone();
        for _ in 0..2 {
            self.advance()?;
            let reaction = std::mem::take(&mut self.state.reaction);
            let motions = std::mem::take(&mut self.state.motions);
            self.state = State { reaction, motions, creep: self.state.creep, ..kept.clone() };
            self.reset()?;
        }
        let (kinetic, elastic) = self.stored();
        self.state.energy = Energy { kinetic, elastic, start: kinetic + elastic, ..Energy::default() };
        self.settled = true;
        Ok(())
    }

    /// The contact problem of the last step; none where other nodes came in since.
    pub fn problem_view(&self) -> Option<ContactProblemView<'_>> {
        let ws = &self.working;
        let nodes = &ws.nodes[..ws.core];
        let before = &self.before[..];
        (!self.posed.is_empty()).then_some(ContactProblemView { nodes, matrix: &ws.w, free: &self.posed, before })
    }

    /// Fields of the last step.
    pub fn fields(&self) -> StepFields {
        let s = self.model.interface;
        let n = s.len();
        let h = self.settings.scheme.step;
        let r = &self.state.reaction;
        let mut fields = StepFields {
            pressure: (0..n).map(|i| r[3 * i + 2] / s.weight[i]).collect(),
            traction: (0..n).map(|i| [r[3 * i] / s.weight[i], r[3 * i + 1] / s.weight[i]]).collect(),
            creep: vec![[0.0; 2]; n],
            state: vec![0; n],
        };
        for ((&i, slip), status) in self.met.nodes.iter().zip(self.met.slip.chunks_exact(2)).zip(&self.met.status) {
            fields.creep[i] = [slip[0] / h, slip[1] / h];
            fields.state[i] = *status as u8;
        }
        fields
    }

    /// One step.
    pub fn advance(&mut self) -> Result<()> {
        self.advance_changed(None)
    }

    fn advance_changed(&mut self, changes: Option<(&mut StateChanges, Option<MatRef<'_, f64>>)>) -> Result<()> {
        let (step, time) = (self.state.step + 1, self.time() + self.settings.scheme.step);
        self.one(changes).map_err(|e| e.context(format!("time step {step} (t = {time:.6e} s)")))
    }

    fn one(&mut self, changes: Option<(&mut StateChanges, Option<MatRef<'_, f64>>)>) -> Result<()> {
        let (h, theta) = (self.settings.scheme.step, self.settings.scheme.theta);
        let rank = self.shapes.rank();
        let t = self.time();
        self.passing.go(self.state.step, h);
        // The modal reactions at the beginning of the step: kept from the one before where there was one.
        let old_modal = self.modal_now.take().unwrap_or_else(|| self.modal_reaction(&self.core_reaction()));
        let (q_free, v_free) = self.motion.free(&self.state.q, &self.state.v, &old_modal)?;
        // As the contact sees them.
        let q_seen = match self.motion.lag(&old_modal) {
            Some(lag) => {
                self.shapes.contact_amplitudes(&q_free.iter().zip(lag).map(|(q, l)| q + l).collect::<Vec<f64>>())
            }
            None => self.shapes.contact_amplitudes(&q_free),
        };
        let v_seen = if self.impact == Impact::Rigid { self.shapes.contact_amplitudes(&v_free) } else { Vec::new() };
        let drive = StepDrive::new(&self.settings.drive, &self.state, t, h);
        let carried = self.carried_rates();
        if drive.open != self.open {
            self.memory.forget();
            self.open.clone_from(&drive.open);
        }
        self.rest_on_nearest(&drive, &q_seen)?;
        let mut effort = Effort::default();
        let mut rounds = 0;
        let mut touching = self.touching();
        let end = loop {
            self.look_for_edges();
            let ws = &self.working;
            let core = ws.core;
            let rows = ws.rows();
            let mut free = vec![0.0; rows];
            dense::add_transposed(&ws.psi, rank, &q_seen, &mut free);
            let mut b = free[..3 * core].to_vec();
            let mut gaps = Vec::with_capacity(core);
            for a in 0..core {
                let i = ws.nodes[a];
                let patch = ws.patch_of(a);
                let (slid, foot) = (self.slide_rate(a, drive.creeps[patch], &carried), self.foot_value(a));
                for c in 0..2 {
                    b[3 * a + c] += h * slid[c] - foot[c];
                }
                let gap = match drive.open[patch] {
                    true => FAR,
                    false => b[3 * a + 2] + self.passing.after[i] - drive.approach[patch],
                };
                gaps.push(gap);
                let closes = touching.as_ref().map_or(gap <= 0.0, |t| t[i]);
                b[3 * a + 2] = match self.impact {
                    Impact::Compliant => gap,
                    Impact::Rigid if !closes && self.massive => FAR,
                    Impact::Rigid if !closes => f64::INFINITY,
                    Impact::Rigid => {
                        let rate = drive.rate[patch] + self.passing.raised(i) / h;
                        theta * h * (dot(&ws.psi[rank * (3 * a + 2)..][..rank], &v_seen) - rate)
                    }
                };
            }
            let before = self.remembered();
            let problem = StepProblem {
                matrix: &ws.w,
                free: &b,
                friction: &self.settings.friction,
                before: &before,
                step: h,
                patch: &ws.patch,
                borders: &drive.borders,
                tolerance: self.settings.tolerance,
            };
            let (guess, known) = self.guess(&drive.open);
            let shift = &drive.shifts(&self.state, h)[..];
            let solution = match &mut self.integrated {
                Some(integrated) => integrated.solve(&problem, &ws.nodes[..core], &guess, shift, &mut effort)?,
                None => {
                    let (memory, known) = (&mut self.memory, known.as_deref());
                    problem.solve(self.settings.solver, &guess, known, shift, memory, &mut effort)?
                }
            };
            let mut response = vec![0.0; rows];
            response[..3 * core].copy_from_slice(&solution.response);
            dense::add_columns(
                &ws.around,
                padded_len::<f64>(rows - 3 * core),
                &solution.reaction,
                &mut response[3 * core..],
            );
            let modal = self.modal_reaction(&solution.reaction);
            let (mut q, mut v) = (q_free.clone(), v_free.clone());
            self.motion.add(&modal, &mut q, &mut v);
            let motions = drive.motions(&solution.shift);
            let approach = self.settings.drive.approaches(&motions);
            let mut entering = self.entering(&solution, (&response, &free), &q, &approach);
            if entering.is_empty() {
                entering = self.pressed_beyond(&solution, (&response, &free), &approach);
            }
            let mut late = 0;
            if let Some(touching) = &mut touching {
                let limit = self.rounding(&drive.approach);
                for (a, gap) in gaps.iter().enumerate() {
                    let i = self.working.nodes[a];
                    if !touching[i] && gap + response[3 * a + 2] < limit {
                        touching[i] = true;
                        late += 1;
                    }
                }
                entering.iter().for_each(|&i| touching[i] = true);
            }
            if entering.is_empty() && late == 0 {
                self.motion.accept(&modal, &mut q, &mut v)?;
                self.met.nodes.clear();
                self.met.nodes.extend_from_slice(&self.working.nodes[..core]);
                self.met.slip.clear();
                let along = drive.tangential(&solution.shift);
                for (b, y) in b.chunks_exact(3).zip(response.chunks_exact(3)) {
                    self.met.slip.extend([b[0] + y[0] + along[0], b[1] + y[1] + along[1]]);
                }
                self.posed = b;
                self.before = before;
                let creep = along.map(|d| d / h);
                break StepEnd { solution, response, free, modal, q, v, motions, creep };
            }
            rounds += 1;
            if rounds > 50 {
                return Err(Error::NotConverged(format!(
                    "the set of contact nodes did not settle in {rounds} rounds; {} more nodes touch",
                    entering.len() + late
                )));
            }
            if entering.is_empty() {
                continue;
            }
            let mut core: Vec<usize> = self.working.nodes[..core].to_vec();
            core.append(&mut entering);
            self.gather(core)?;
        };
        if let Some(changes) = changes {
            self.change(changes, &drive, &end)?;
        }
        self.finish_step(end, effort);
        self.shrink()
    }

    /// The nodes that a step of a surface with mass begins with in contact, `[n]`: those that pressed at the end of
    /// the step before. Others come in where the step would press them into each other. None where the gap without
    /// reactions decides.
    fn touching(&self) -> Option<Vec<bool>> {
        let pressed = |i: usize| self.state.reaction[3 * i + 2] > 0.0;
        let n = self.model.interface.len();
        self.massive.then(|| (0..n).map(pressed).collect())
    }

    /// Gives a load that nothing bears a node to rest on, the nearest one that its motion moves; others come in as
    /// they are reached. `q` is seen of the modes, `[r]`.
    fn rest_on_nearest(&mut self, drive: &StepDrive, q: &[f64]) -> Result<()> {
        let core = &self.working.nodes[..self.working.core];
        let borne = |c: usize| core.iter().any(|&i| self.model.interface.patch_of(i) == c);
        let patches = 0..drive.open.len();
        let bare = |b: &&Border| b.is_normal() && b.total > 0.0 && !patches.clone().any(|c| b.moves(c) && borne(c));
        let nearest: Vec<usize> =
            drive.borders.iter().filter(bare).filter_map(|b| self.nearest(q, |c| b.moves(c))).collect();
        if nearest.is_empty() {
            return Ok(());
        }
        self.gather([core, &nearest[..]].concat())
    }

    /// A gap that is negative by rounding alone, m, of patches with an `approach`, m, `[patches]`.
    fn rounding(&self, approach: &[f64]) -> f64 {
        -1e-12 * (approach.iter().fold(0.0f64, |m, a| m.max(a.abs())) + self.widest)
    }

    /// Reactions on the core, extrapolated by a polynomial in time as far as steps are known, and their response
    /// where it is known. Patches that stay `open` have none.
    fn guess(&self, open: &[bool]) -> (Vec<f64>, Option<Vec<f64>>) {
        if open.contains(&true) {
            let mut guess = self.core_reaction();
            let nodes = guess.chunks_exact_mut(3).enumerate();
            nodes.filter(|(a, _)| open[self.working.patch_of(*a)]).for_each(|(_, r)| r.fill(0.0));
            return (guess, None);
        }
        let weights: &[f64] = match self.past.len() {
            0 => return (self.core_reaction(), None),
            1 => &[1.0],
            2 => &[2.0, -1.0],
            3 => &[3.0, -3.0, 1.0],
            _ => &[4.0, -6.0, 4.0, -1.0],
        };
        let (mut guess, mut response) = (vec![0.0; 3 * self.working.core], vec![0.0; 3 * self.working.core]);
        let past = || weights.iter().zip(&self.past);
        let reactions: Vec<_> = past().map(|(w, (r, _))| (&r[..], *w)).collect();
        dense::add_scattered(&reactions, &mut guess);
        let responses: Vec<_> = past().map(|(w, (_, y))| (&y[..], *w)).collect();
        dense::add_scattered(&responses, &mut response);
        (guess, Some(response))
    }
}

/// Feet of the grid columns of each patch in steps of `step`, s.
fn all_feet(s: &Interface, drive: &Loading, step: f64) -> Vec<Vec<Option<DeparturePoint>>> {
    s.patches.iter().zip(&drive.patches).map(|(p, drive)| feet(&p.x, drive.speed * step)).collect()
}

/// Nodes with a pressure, ascending.
fn pressed(reaction: &[f64]) -> Vec<usize> {
    (0..reaction.len() / 3).filter(|&i| reaction[3 * i + 2] > 0.0).collect()
}
