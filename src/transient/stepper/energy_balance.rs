//! End of a step: its state, its report, and the balance of energy.

use super::step_result::{PatchReport, StepEnd, StepReport};
use super::{Stepper, PAST};
use crate::contact::law::Status;
use crate::dense::{self, dot};
use crate::transient::model::Impact;
use crate::transient::problem::Effort;

impl Stepper<'_> {
    /// Takes the end of a step into the state.
    pub(super) fn finish_step(&mut self, end: StepEnd, effort: Effort) {
        let StepEnd { solution, response: mut u, free, modal, q, v, motions, creep } = end;
        let h = self.settings.scheme.step;
        let gamma = self.motion.gamma();
        self.renew_friction(&solution);
        self.modal_now = Some(modal);
        u.iter_mut().zip(&free).for_each(|(u, f)| *u += f);

        // Energy: mean reactions of the step times what moved.
        let (mut friction, mut drive, mut rolling, mut impact) = (0.0, 0.0, 0.0, 0.0);
        let patches = vec![PatchReport::default(); self.settings.drive.patches.len()];
        let mut report = StepReport { residual: solution.residual, effort, patches };
        let sunk: Vec<f64> = motions.iter().zip(&self.state.motions).map(|(now, then)| now - then).collect();
        let sunk = self.settings.drive.approaches(&sunk);
        let ws = &self.working;
        let core = ws.nodes[..ws.core].iter().zip(&ws.at).zip(solution.reaction.chunks_exact(3)).zip(&solution.status);
        let moved = u.chunks_exact(3).zip(ws.u.chunks_exact(3)).zip(self.met.slip.chunks_exact(2));
        for (a, ((((&i, ([x, y], _)), r), status), ((now, then), slip))) in core.zip(moved).enumerate() {
            let patch = ws.patch_of(a);
            // Nodes outside the core have no reaction.
            let old = &mut self.state.reaction[3 * i..3 * i + 3];
            let mean: [f64; 3] = std::array::from_fn(|c| gamma * r[c] + (1.0 - gamma) * old[c]);
            old.copy_from_slice(r);
            friction -= mean[0] * slip[0] + mean[1] * slip[1];
            let nearer = sunk[patch] + self.passing.raised(i);
            drive +=
                mean[2] * nearer - mean[0] * (slip[0] - (now[0] - then[0])) - mean[1] * (slip[1] - (now[1] - then[1]));
            let speed = self.settings.drive.patches[patch].speed;
            rolling -= mean[2] * speed * h * self.slope[i];
            impact -= mean[2] * (now[2] - then[2] - nearer);
            let own = &mut report.patches[patch];
            own.force[0] += r[0];
            own.force[1] += r[1];
            own.force[2] -= r[2];
            own.moment_z += x * r[1] - y * r[0];
            let closed = match self.integrated {
                Some(_) => *status != Status::Open,
                None => r[2] > 0.0,
            };
            own.closed += usize::from(closed);
            own.stick += usize::from(closed && *status == Status::Stick);
        }
        let e = &mut self.state.energy;
        e.friction += friction;
        e.drive += drive;
        e.rolling += rolling;
        if self.impact == Impact::Rigid {
            e.impact += impact;
        }
        let (damped, supplied) = self.motion.damped((&self.state.q, &self.state.v), (&q, &v));
        e.damping += damped;
        e.drive += supplied;
        e.drive += self.motion.loaded(&self.state.q, &q);
        self.state.q = q;
        self.state.v = v;
        if self.past.len() == PAST {
            self.past.pop();
        }
        self.past.insert(0, (solution.reaction, solution.response));
        (self.state.motions, self.state.creep) = (motions, creep);
        self.state.step += 1;
        self.working.u = u;
        self.met.status = solution.status;
        self.report = report;
        let (kinetic, elastic) = self.stored();
        let e = &mut self.state.energy;
        (e.kinetic, e.elastic) = (kinetic, elastic);
        if std::mem::take(&mut self.settled) {
            e.start += e.residual();
        }
    }

    /// The state is that of a start after [`Self::settle`], as a stopped run has kept it: the balance of energy is
    /// counted from the end of the first step.
    pub(crate) fn after_settling(mut self) -> Self {
        self.settled = true;
        self
    }

    /// Kinetic and elastic energy of the present state, J.
    pub(super) fn stored(&self) -> (f64, f64) {
        let mut elastic = self.motion.elastic(&self.state.q);
        if self.impact == Impact::Compliant {
            // ½ RᵀSR = ½ Rᵀ(u − Ψ q).
            for (&i, u) in self.working.nodes[..self.working.core].iter().zip(self.working.u.chunks_exact(3)) {
                let r = &self.state.reaction[3 * i..3 * i + 3];
                elastic += 0.5 * (r[0] * u[0] + r[1] * u[1] + r[2] * u[2]);
            }
            let modal = match &self.modal_now {
                Some(f) => dot(f, &self.state.q),
                None => dot(&self.modal_reaction(&self.core_reaction()), &self.state.q),
            };
            elastic -= 0.5 * modal;
        }
        (self.motion.kinetic(&self.state.v), elastic)
    }

    /// Ψᵀ R of the reactions on the core, N/√kg, `[m]`.
    pub(super) fn modal_reaction(&self, reaction: &[f64]) -> Vec<f64> {
        let rank = self.shapes.rank();
        let mut seen = vec![0.0; rank];
        dense::add_columns(&self.working.psi[..rank * reaction.len()], rank, reaction, &mut seen);
        self.shapes.spread(seen)
    }

    /// Reactions on the core, N, `[3 core]`.
    pub(super) fn core_reaction(&self) -> Vec<f64> {
        self.working.nodes[..self.working.core]
            .iter()
            .flat_map(|&i| self.state.reaction[3 * i..3 * i + 3].iter().copied())
            .collect()
    }
}
