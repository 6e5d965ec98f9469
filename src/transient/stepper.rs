//! One step after the other.

use faer::Mat;

use super::compact::Operator;
use super::drive::{Drive, Normal, Tangential};
use super::energy::Energy;
use super::foot::{edge_value, feet, support, value, Foot};
use super::model::{Impact, Model};
use super::newton::Memory;
use super::problem::{ContactSolver, Effort, StepProblem, StepSolution};
use super::scheme::{Modal, Scheme};
use crate::contact::krylov::dot;
use crate::contact::laws::State as Status;
use crate::contact::FrictionLaw;
use crate::{Error, Result};

/// What does not change in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Step and θ.
    pub scheme: Scheme,
    /// Friction law.
    pub friction: FrictionLaw,
    /// Solver of the contact problem of a step.
    pub solver: ContactSolver,
    /// Residual of a step relative to the normal force.
    pub tolerance: f64,
    /// What is prescribed.
    pub drive: Drive,
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
    /// Approach, m.
    pub approach: f64,
    /// Rigid creep velocities, m/s, of the directions with a prescribed force.
    pub creep: [f64; 2],
    /// Energies.
    pub energy: Energy,
}

/// What a step found besides the state.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Force on body 1 (x, y, z), N.
    pub force: [f64; 3],
    /// Moment about the common normal of the tractions on body 1, N·m.
    pub moment_z: f64,
    /// Closed nodes.
    pub closed: usize,
    /// Those of them that stick.
    pub stick: usize,
    /// Residual of the contact laws, N.
    pub residual: f64,
    /// Work of the solver.
    pub effort: Effort,
}

/// Fields of a step on all nodes.
#[derive(Debug, Clone)]
pub struct Fields {
    /// Pressure, Pa, `[n]`.
    pub pressure: Vec<f64>,
    /// Traction on body 1, Pa, `[n][2]`.
    pub traction: Vec<[f64; 2]>,
    /// Creep velocity over the last step, m/s, `[n][2]`; 0 away from the contact.
    pub creep: Vec<[f64; 2]>,
    /// 0 open, 1 stick, 2 slip, `[n]`.
    pub state: Vec<u8>,
}

/// The nodes that may touch (the core), and those around them whose displacements are needed.
struct Working {
    /// Core nodes, then the others.
    nodes: Vec<usize>,
    core: usize,
    /// Place of each node of the interface in `nodes`, or `usize::MAX`.
    place: Vec<usize>,
    /// Columns of W of the core nodes, rows of all nodes here, `[3 core][3 len]`.
    w: Vec<f64>,
    /// Rows of Ψ, `[3 len][m]`.
    psi: Vec<f64>,
    /// Foot of each core node with its line of the grid.
    feet: Vec<(usize, Foot)>,
    /// Displacements at the present time, m, `[3 len]`.
    u: Vec<f64>,
}

/// The nodes outside the working set: how near they are to touching.
#[derive(Default)]
struct Outside {
    /// Smallest gap at the time of the last look, m.
    gap: f64,
    q: Vec<f64>,
    reaction: Vec<f64>,
    shift: f64,
}

/// Advances a [`State`] in time.
pub struct Stepper<'a> {
    model: Model<'a>,
    settings: Settings,
    impact: Impact,
    modal: Modal,
    /// W, m/N, `[3n, 3n]`.
    w: Mat<f64>,
    /// Foot of each grid column.
    feet: Vec<Option<Foot>>,
    /// ∂x g0, `[n]`.
    slope: Vec<f64>,
    /// Largest norm of a normal row of Ψ, and largest normal influence between two nodes.
    reach: [f64; 2],
    state: State,
    working: Working,
    outside: Outside,
    memory: Memory,
    /// Normal rows of Ψ, `[n][m]`.
    normal_rows: Vec<f64>,
    /// Modal reactions of the present state, where they are at hand.
    modal_now: Option<Vec<f64>>,
    /// Reactions on the core before the last step, for extrapolation.
    before: Option<Vec<f64>>,
    status: Vec<Status>,
    slip: Vec<f64>,
    report: Report,
}

impl<'a> Stepper<'a> {
    /// A stepper at the given state.
    pub fn new(model: Model<'a>, settings: Settings, state: State) -> Result<Self> {
        let impact = model.impact()?;
        settings.scheme.check(model.omega)?;
        let n = model.interface.len();
        if state.q.len() != model.omega.len() || state.v.len() != model.omega.len() || state.reaction.len() != 3 * n {
            return Err(Error::Defect("transient: the state does not belong to the model".into()));
        }
        if impact == Impact::Rigid && matches!(settings.drive.normal, Normal::Force(_)) {
            return Err(Error::Job(
                "analyses.transient: bodies without residual compliance need a given approach, not a normal load"
                    .into(),
            ));
        }
        let modal = Modal::new(&model, settings.scheme, impact);
        let w = modal.operator(&model);
        let s = model.interface;
        let travel = settings.drive.speed * settings.scheme.step;
        let nx = s.x.len();
        let slope = (0..n)
            .map(|i| {
                let (ix, line) = (i % nx, i - i % nx);
                let (a, b) = (ix.saturating_sub(1), (ix + 1).min(nx - 1));
                (s.gap[line + b] - s.gap[line + a]) / (s.x[b] - s.x[a])
            })
            .collect();
        let mut reach = [0.0f64; 2];
        for i in 0..n {
            let row = (0..model.omega.len()).map(|k| model.modes[(3 * i + 2, k)].powi(2)).sum::<f64>();
            reach[0] = reach[0].max(row.sqrt());
            let col = model.residual.col(3 * i + 2);
            let far = (0..3 * n).filter(|j| j / 3 != i).map(|j| col[j].abs()).fold(0.0, f64::max);
            reach[1] = reach[1].max(far);
        }
        let normal_rows = (0..n)
            .flat_map(|i| (0..model.omega.len()).map(move |k| (i, k)))
            .map(|(i, k)| model.modes[(3 * i + 2, k)])
            .collect();
        let mut new = Self {
            feet: feet(&s.x, travel),
            model,
            settings,
            impact,
            modal,
            w,
            slope,
            reach,
            state,
            working: Working {
                nodes: Vec::new(),
                core: 0,
                place: Vec::new(),
                w: Vec::new(),
                psi: Vec::new(),
                feet: Vec::new(),
                u: Vec::new(),
            },
            outside: Outside::default(),
            memory: Memory::default(),
            before: None,
            normal_rows,
            modal_now: None,
            status: Vec::new(),
            slip: Vec::new(),
            report: Report::default(),
        };
        new.reset()?;
        let (kinetic, elastic) = new.stored();
        let e = &mut new.state.energy;
        if *e == Energy::default() {
            *e = Energy { kinetic, elastic, start: kinetic + elastic, ..Energy::default() };
        }
        Ok(new)
    }

    /// Forgets everything that is not part of the state, so that a run continued from here goes on in the same way.
    pub fn reset(&mut self) -> Result<()> {
        self.memory.forget();
        self.before = None;
        self.modal_now = None;
        let closed: Vec<usize> =
            (0..self.model.interface.len()).filter(|&i| self.state.reaction[3 * i + 2] > 0.0).collect();
        self.gather(closed)
    }

    /// The present state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The time of the present state, s.
    pub fn time(&self) -> f64 {
        self.state.step as f64 * self.settings.scheme.step
    }

    /// The report of the last step.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// The reactions that hold at the present displacements: those at the end of a first step, taken from here. To be called at
    /// a start whose modes were perturbed and whose reactions were not. The state stays where it is in time.
    pub fn settle(&mut self) -> Result<()> {
        let kept = self.state.clone();
        for _ in 0..2 {
            self.advance()?;
            let reaction = std::mem::take(&mut self.state.reaction);
            let (approach, creep) = (self.state.approach, self.state.creep);
            self.state = State { reaction, approach, creep, ..kept.clone() };
            self.reset()?;
        }
        let (kinetic, elastic) = self.stored();
        self.state.energy = Energy { kinetic, elastic, start: kinetic + elastic, ..Energy::default() };
        Ok(())
    }

    /// Fields of the last step.
    pub fn fields(&self) -> Fields {
        let s = self.model.interface;
        let n = s.len();
        let h = self.settings.scheme.step;
        let r = &self.state.reaction;
        let mut fields = Fields {
            pressure: (0..n).map(|i| r[3 * i + 2] / s.weight[i]).collect(),
            traction: (0..n).map(|i| [r[3 * i] / s.weight[i], r[3 * i + 1] / s.weight[i]]).collect(),
            creep: vec![[0.0; 2]; n],
            state: vec![0; n],
        };
        for (a, status) in self.status.iter().enumerate() {
            let i = self.working.nodes[a];
            fields.creep[i] = [self.slip[2 * a] / h, self.slip[2 * a + 1] / h];
            fields.state[i] = *status as u8;
        }
        fields
    }

    /// One step.
    pub fn advance(&mut self) -> Result<()> {
        let at = format!("time step {} (t = {:.6e} s)", self.state.step + 1, self.time() + self.settings.scheme.step);
        self.one().map_err(|e| e.context(at))
    }

    fn one(&mut self) -> Result<()> {
        let (h, theta) = (self.settings.scheme.step, self.settings.scheme.theta);
        let m = self.model.omega.len();
        let t = self.time();
        // The modal reactions at the beginning of the step: kept from the one before where there was one.
        let old_modal = self.modal_now.take().unwrap_or_else(|| self.modal_reaction(&self.state.reaction));
        let (q_free, v_free) = self.modal.free(&self.state.q, &self.state.v, &old_modal);
        let drive = self.settings.drive.clone();
        let mut total = [None; 3];
        let mut creep = [0.0; 2];
        for c in 0..2 {
            match &drive.tangential[c] {
                Tangential::Creep(history) => creep[c] = history.at(t + 0.5 * h),
                Tangential::Force(history) => total[c] = Some(history.at(t + h)),
            }
        }
        let spin = drive.spin.at(t + 0.5 * h);
        let (approach, rate) = match &drive.normal {
            Normal::Force(history) => {
                total[2] = Some(history.at(t + h));
                (0.0, 0.0)
            }
            Normal::Approach(history) => (history.at(t + h), (history.at(t + h) - history.at(t)) / h),
        };
        let mut effort = Effort::default();
        let mut rounds = 0;
        let (solution, response, free, modal, (q, v)) = loop {
            let ws = &self.working;
            let core = ws.core;
            let len = ws.nodes.len();
            let mut free = vec![0.0; 3 * len];
            for (f, row) in free.iter_mut().zip(ws.psi.chunks_exact(m.max(1))) {
                *f = dot(row, &q_free);
            }
            let mut b = free[..3 * core].to_vec();
            for a in 0..core {
                let i = ws.nodes[a];
                let [x, y] = self.model.interface.point(i);
                let foot = self.foot_value(a);
                let rigid = [creep[0] - spin * y, creep[1] + spin * x];
                for c in 0..2 {
                    b[3 * a + c] += h * rigid[c] - foot[c];
                }
                let gap = b[3 * a + 2] + self.model.interface.gap[i] - approach;
                b[3 * a + 2] = match self.impact {
                    Impact::Compliant => gap,
                    Impact::Rigid if gap > 0.0 => f64::INFINITY,
                    Impact::Rigid => theta * h * (dot(&ws.psi[m * (3 * a + 2)..][..m], &v_free) - rate),
                };
            }
            let problem = StepProblem {
                matrix: Operator::new(&ws.w, 3 * len, 3 * core),
                free: &b,
                friction: self.settings.friction,
                step: h,
                total,
                tolerance: self.settings.tolerance,
            };
            let guess = self.guess();
            let shift = [self.state.creep[0] * h, self.state.creep[1] * h, -self.state.approach];
            let shift = [0, 1, 2].map(|c| if total[c].is_some() { shift[c] } else { 0.0 });
            let solution = problem.solve(self.settings.solver, &guess, shift, &mut self.memory, &mut effort)?;
            let mut response = vec![0.0; 3 * len];
            Operator::new(&ws.w, 3 * len, 3 * len).add(&solution.reaction, &mut response);
            let mut reaction = vec![0.0; self.state.reaction.len()];
            for (a, r) in solution.reaction.chunks_exact(3).enumerate() {
                reaction[3 * ws.nodes[a]..][..3].copy_from_slice(r);
            }
            let modal = self.modal_reaction(&reaction);
            let (mut q, mut v) = (q_free.clone(), v_free.clone());
            self.modal.add(&modal, &mut q, &mut v);
            let (entering, outside) = self.entering(&solution, (&response, &free), &reaction, &q, approach);
            if let Some(outside) = outside {
                self.outside = outside;
            }
            if entering.is_empty() {
                self.slip = (0..core)
                    .flat_map(|a| [0, 1].map(|c| b[3 * a + c] + response[3 * a + c] + solution.shift[c]))
                    .collect();
                break (solution, response, free, modal, (q, v));
            }
            rounds += 1;
            if rounds > 50 {
                return Err(Error::NotConverged(format!(
                    "the set of contact nodes did not settle in {rounds} rounds; {} more nodes touch",
                    entering.len()
                )));
            }
            let mut core: Vec<usize> = self.working.nodes[..core].to_vec();
            core.extend(entering);
            self.before = None;
            self.gather(core)?;
        };
        self.take(solution, response, free, (q, v), modal, total, approach, effort);
        self.shrink()
    }

    /// Takes the solution of a step into the state.
    #[allow(clippy::too_many_arguments)]
    fn take(
        &mut self,
        solution: StepSolution,
        response: Vec<f64>,
        free: Vec<f64>,
        (q, v): (Vec<f64>, Vec<f64>),
        modal: Vec<f64>,
        total: [Option<f64>; 3],
        approach: f64,
        effort: Effort,
    ) {
        let h = self.settings.scheme.step;
        let gamma = self.modal.gamma();
        let core = self.working.core;
        let mut reaction = vec![0.0; self.state.reaction.len()];
        for (a, r) in solution.reaction.chunks_exact(3).enumerate() {
            reaction[3 * self.working.nodes[a]..][..3].copy_from_slice(r);
        }
        self.modal_now = Some(modal);
        let approach = if total[2].is_some() { -solution.shift[2] } else { approach };
        let u: Vec<f64> = free.iter().zip(&response).map(|(f, r)| f + r).collect();

        // Energy: mean reactions of the step times what moved.
        let e = &mut self.state.energy;
        let mut report = Report { residual: solution.residual, effort, ..Report::default() };
        let sunk = approach - self.state.approach;
        for a in 0..core {
            let i = self.working.nodes[a];
            let mean = [0, 1, 2].map(|c| gamma * reaction[3 * i + c] + (1.0 - gamma) * self.state.reaction[3 * i + c]);
            for c in 0..2 {
                let slip = self.slip[2 * a + c];
                e.friction -= mean[c] * slip;
                e.drive -= mean[c] * (slip - (u[3 * a + c] - self.working.u[3 * a + c]));
            }
            e.drive += mean[2] * sunk;
            e.rolling -= mean[2] * self.settings.drive.speed * h * self.slope[i];
            if self.impact == Impact::Rigid {
                e.impact -= mean[2] * (u[3 * a + 2] - self.working.u[3 * a + 2] - sunk);
            }
            let r = &reaction[3 * i..3 * i + 3];
            let [x, y] = self.model.interface.point(i);
            report.force[0] += r[0];
            report.force[1] += r[1];
            report.force[2] -= r[2];
            report.moment_z += x * r[1] - y * r[0];
            if r[2] > 0.0 {
                report.closed += 1;
                report.stick += usize::from(solution.status[a] == Status::Stick);
            }
        }
        e.damping += self.modal.damped(&self.state.v, &v);
        e.drive += self.modal.loaded(&self.state.q, &q);
        self.before = Some(self.core_reaction());
        self.state.q = q;
        self.state.v = v;
        self.state.reaction = reaction;
        self.state.approach = approach;
        for c in 0..2 {
            self.state.creep[c] = if total[c].is_some() { solution.shift[c] / h } else { 0.0 };
        }
        self.state.step += 1;
        self.working.u = u;
        self.status = solution.status;
        self.report = report;
        let (kinetic, elastic) = self.stored();
        self.state.energy.kinetic = kinetic;
        self.state.energy.elastic = elastic;
    }

    /// Kinetic and elastic energy of the present state, J.
    fn stored(&self) -> (f64, f64) {
        let m = self.model.omega.len();
        let mut elastic = self.modal.elastic(&self.state.q);
        for a in 0..self.working.core {
            for c in 0..3 {
                let r = self.state.reaction[3 * self.working.nodes[a] + c];
                if r != 0.0 && self.impact == Impact::Compliant {
                    let modal = dot(&self.working.psi[m * (3 * a + c)..][..m], &self.state.q);
                    elastic += 0.5 * r * (self.working.u[3 * a + c] - modal);
                }
            }
        }
        (self.modal.kinetic(&self.state.v), elastic)
    }

    /// Ψᵀ R, N/√kg, `[m]`; reactions outside the working set are zero.
    fn modal_reaction(&self, reaction: &[f64]) -> Vec<f64> {
        let m = self.model.omega.len();
        let mut out = vec![0.0; m];
        for a in 0..self.working.core {
            for c in 0..3 {
                let r = reaction[3 * self.working.nodes[a] + c];
                if r != 0.0 {
                    let row = &self.working.psi[m * (3 * a + c)..][..m];
                    out.iter_mut().zip(row).for_each(|(o, p)| *o += p * r);
                }
            }
        }
        out
    }

    fn core_reaction(&self) -> Vec<f64> {
        self.working.nodes[..self.working.core]
            .iter()
            .flat_map(|&i| self.state.reaction[3 * i..3 * i + 3].iter().copied())
            .collect()
    }

    /// Reactions on the core, extrapolated where two steps are known.
    fn guess(&self) -> Vec<f64> {
        let now = self.core_reaction();
        let Some(before) = &self.before else { return now };
        let mut guess: Vec<f64> = now.iter().zip(before).map(|(a, b)| 2.0 * a - b).collect();
        for (g, r) in guess.chunks_exact_mut(3).zip(now.chunks_exact(3)) {
            if r[2] == 0.0 || g[2] <= 0.0 {
                g.fill(0.0);
            }
        }
        guess
    }

    /// Displacement w of the material of core node `a` a step ago, m.
    fn foot_value(&self, a: usize) -> [f64; 2] {
        let ws = &self.working;
        let (line, foot) = ws.feet[a];
        let x = &self.model.interface.x;
        let ix = ws.nodes[a] - line;
        if let (Foot::Between { left, s }, true) = (foot, self.impact == Impact::Compliant && ix >= 2) {
            let near = [ix, ix - 1, ix - 2].map(|jx| line + jx);
            let closed = near.map(|j| self.state.reaction[3 * j + 2] > 0.0);
            let place = near.map(|j| ws.place[j]);
            if left + 1 == ix && closed == [true, false, false] {
                let gap =
                    [1, 2].map(|k| self.model.interface.gap[near[k]] - self.state.approach + ws.u[3 * place[k] + 2]);
                if gap[0] > 0.0 {
                    let distance = [x[ix] - x[ix - 1], x[ix] - x[ix - 2]];
                    let travel = self.settings.drive.speed * self.settings.scheme.step;
                    return [0, 1].map(|c| edge_value(travel, distance, place.map(|p| ws.u[3 * p + c]), gap));
                }
            }
            // As in the steady analysis, the second closed node does not look across the edge.
            if left + 1 == ix && closed == [true, true, false] {
                return [0, 1].map(|c| ws.u[3 * place[0] + c] * s + ws.u[3 * place[1] + c] * (1.0 - s));
            }
        }
        let at = |c: usize| {
            value(&self.model.interface.x, foot, |ix| {
                let place = ws.place[line + ix];
                ws.u[3 * place + c]
            })
        };
        [at(0), at(1)]
    }

    /// Nodes outside the core that the solution presses into each other, and the last look at those outside the working set
    /// where it had to be renewed.
    fn entering(
        &self,
        solution: &StepSolution,
        (response, free): (&[f64], &[f64]),
        reaction: &[f64],
        q: &[f64],
        approach: f64,
    ) -> (Vec<usize>, Option<Outside>) {
        let s = self.model.interface;
        let ws = &self.working;
        let shift = solution.shift[2] - approach;
        let limit = -1e-12 * (shift.abs() + s.gap.iter().fold(0.0f64, |m, g| m.max(g.abs())));
        let mut entering: Vec<usize> = (ws.core..ws.nodes.len())
            .filter(|&a| s.gap[ws.nodes[a]] + shift + free[3 * a + 2] + response[3 * a + 2] < limit)
            .map(|a| ws.nodes[a])
            .collect();
        if !entering.is_empty() {
            return (entering, None);
        }
        // The others: only when they may have come near since the last look.
        let o = &self.outside;
        if o.q.len() == q.len() && o.reaction.len() == reaction.len() {
            let moved: f64 = q.iter().zip(&o.q).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            let loaded: f64 = reaction.iter().zip(&o.reaction).map(|(a, b)| (a - b).abs()).sum();
            if o.gap > self.reach[0] * moved + self.reach[1] * loaded + (shift - o.shift).abs() {
                return (entering, None);
            }
        }
        let rows: Vec<usize> = (0..reaction.len()).filter(|&k| reaction[k] != 0.0).collect();
        let mut nearest = f64::INFINITY;
        for i in (0..s.len()).filter(|&i| ws.place[i] == usize::MAX) {
            let col = self.model.residual.col(3 * i + 2);
            let elastic: f64 = rows.iter().map(|&k| col[k] * reaction[k]).sum();
            let moved = dot(&self.normal_rows[q.len() * i..][..q.len()], q);
            let gap = s.gap[i] + shift + elastic + moved;
            nearest = nearest.min(gap);
            if gap < limit {
                entering.push(i);
            }
        }
        let (q, reaction) = (q.to_vec(), reaction.to_vec());
        (entering, Some(Outside { gap: nearest, q, reaction, shift }))
    }

    /// Drops core nodes when many of them are open.
    fn shrink(&mut self) -> Result<()> {
        if self.working.core > 12 && 3 * self.working.core > 4 * self.report.closed + 36 {
            return self.reset();
        }
        Ok(())
    }

    /// Makes the working set of the given core nodes.
    fn gather(&mut self, mut core: Vec<usize>) -> Result<()> {
        let s = self.model.interface;
        let (nx, ny) = (s.x.len(), s.y.len());
        let m = self.model.omega.len();
        core.sort_unstable();
        core.dedup();
        let mut place = vec![usize::MAX; s.len()];
        let mut nodes = core.clone();
        for (a, &i) in core.iter().enumerate() {
            place[i] = a;
        }
        let mut lines = Vec::with_capacity(core.len());
        for &i in &core {
            let (ix, iy) = (i % nx, i / nx);
            let foot = self.feet[ix].filter(|_| !s.on_border(i) || self.impact == Impact::Rigid).ok_or_else(|| {
                let [x, y] = s.point(i);
                Error::Job(format!(
                    "contact.patch: the contact reaches x = {x:.4e} m, y = {y:.4e} m, at the border of the patch; enlarge \
                     contact.patch.half_length and contact.patch.half_width, or lower the load"
                ))
            })?;
            lines.push((nx * iy, foot));
            let around = (ix.saturating_sub(1)..(ix + 2).min(nx))
                .flat_map(|jx| (iy.saturating_sub(1)..(iy + 2).min(ny)).map(move |jy| jx + nx * jy));
            for j in around.chain(support(foot, nx).map(|jx| jx + nx * iy)) {
                if place[j] == usize::MAX {
                    place[j] = nodes.len();
                    nodes.push(j);
                }
            }
        }
        let len = nodes.len();
        let mut w = vec![0.0; 9 * core.len() * len];
        for (a, &j) in core.iter().enumerate() {
            for c in 0..3 {
                let col = self.w.col_as_slice(3 * j + c);
                let out = &mut w[3 * len * (3 * a + c)..][..3 * len];
                for (o, &i) in out.chunks_exact_mut(3).zip(&nodes) {
                    o.copy_from_slice(&col[3 * i..3 * i + 3]);
                }
            }
        }
        let mut psi = vec![0.0; 3 * len * m];
        for k in 0..m {
            for (a, &i) in nodes.iter().enumerate() {
                for c in 0..3 {
                    psi[m * (3 * a + c) + k] = self.model.modes[(3 * i + c, k)];
                }
            }
        }
        // Displacements of the present state: Ψ q + S R.
        let mut u = vec![0.0; 3 * len];
        let loaded: Vec<usize> = (0..self.state.reaction.len()).filter(|&k| self.state.reaction[k] != 0.0).collect();
        for (a, &i) in nodes.iter().enumerate() {
            for c in 0..3 {
                let col = self.model.residual.col(3 * i + c);
                let elastic: f64 = loaded.iter().map(|&k| col[k] * self.state.reaction[k]).sum();
                u[3 * a + c] = elastic + dot(&psi[m * (3 * a + c)..][..m], &self.state.q);
            }
        }
        let core = core.len();
        self.working = Working { nodes, core, place, w, psi, feet: lines, u };
        self.outside = Outside::default();
        self.memory.forget();
        self.before = None;
        self.status = vec![Status::Open; core];
        self.slip = vec![0.0; 2 * core];
        Ok(())
    }
}
