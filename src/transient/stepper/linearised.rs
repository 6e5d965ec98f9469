//! Steps of small changes: the derivative of a step of a driven stepper, of many changes at once.
//!
//! With δu⁰ the change of the displacements before the step, the displacements of the core without its reactions
//! change by δb = Ψ δq − δ(foot), and its reactions by δR with
//!
//! M δt + e δp + B δu_t + c δμ⁰ = 0,   δu_n = 0 at closed nodes,   δR = 0 at open ones,
//! δu = δb + W δR + Σ column δs,   Σ row·δR = 0 for each border.
//!
//! M, e, B are those of the [`Tangent`] with the status that each node has in the step: an element of the generalised
//! Jacobian of a step that is smooth but where a node changes its status. δμ⁰ is the change that the memory of friction
//! makes, c = p τ where a node slides.

use super::step_drive::StepDrive;
use super::step_result::StepEnd;
use super::Stepper;
use crate::contact::law::{size, Tangent};
use crate::transient::aligned::padded_len;
use crate::transient::departure_point::DeparturePoint;
use crate::transient::problem::{node, StepProblem};
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};

/// Changes of the state of a driven stepper, one in each of c columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Changes {
    /// Changes of the coordinates behind the contact, `[m, c]`.
    motion: Mat<f64>,
    /// Changes of the reactions, N, `[3n, c]`.
    reaction: Mat<f64>,
    /// Changes of the coefficients of friction, `[n, c]`; without rows where friction is constant.
    friction: Mat<f64>,
    /// Changes of the rigid motions, m, `[motions, c]`.
    motions: Mat<f64>,
    /// Ψᵀ δR of the last step, `[m, c]`.
    force: Mat<f64>,
}

impl Changes {
    /// Changes `motion`, `[m, c]`, of the coordinates behind the contact of `stepper` alone.
    pub fn of_motion(stepper: &Stepper<'_>, motion: Mat<f64>) -> Self {
        let (state, columns) = (&stepper.state, motion.ncols());
        Self {
            reaction: Mat::zeros(state.reaction.len(), columns),
            friction: Mat::zeros(state.friction.len(), columns),
            motions: Mat::zeros(state.motions.len(), columns),
            force: Mat::zeros(motion.nrows(), columns),
            motion,
        }
    }

    /// Changes of the forces on the coordinates behind the contact in the last step, Ψᵀ δR, `[m, c]`.
    pub fn force(&self) -> MatRef<'_, f64> {
        self.force.as_ref()
    }
}

impl Stepper<'_> {
    /// One step of a [driven](Self::driven) stepper, with its small `changes`, whose coordinates end changed by `ends`,
    /// `[m, c]`. An error where the laws hold at points of quadrature or the step is singular.
    pub fn advance_with(&mut self, changes: &mut Changes, ends: MatRef<'_, f64>) -> Result<()> {
        self.advance_changed(Some((changes, ends)))
    }

    /// The changes at the end of the step that `end` ends, in the state before it.
    pub(super) fn change(
        &self,
        (changes, ends): (&mut Changes, MatRef<'_, f64>),
        drive: &StepDrive,
        end: &StepEnd,
    ) -> Result<()> {
        if self.integrated.is_some() {
            return Err(Error::Defect("a linearised step with the laws at points of quadrature".into()));
        }
        let ws = &self.working;
        let (core, columns, h) = (ws.core, ends.ncols(), self.settings.scheme.step);
        let problem = StepProblem {
            matrix: &ws.w,
            free: &self.posed,
            friction: &self.settings.friction,
            before: &self.before,
            step: h,
            patch: &ws.patch,
            borders: &drive.borders,
            tolerance: self.settings.tolerance,
        };
        let old = gathered(&changes.reaction, &ws.nodes[..core]);
        let free = self.changed_free(changes, &old, ends);
        let remembered = self.changed_memory(changes);
        let solution = &end.solution;
        let u = problem.displacement(&solution.response, &solution.shift);
        // The laws of the closed nodes.
        let unit = (0..core).map(|i| problem.rho(i).normal).sum::<f64>() / core.max(1) as f64;
        let mut closed = Vec::new();
        let mut laws = Vec::new();
        for i in 0..core {
            let node = node(&solution.reaction[3 * i..3 * i + 3], &u[3 * i..3 * i + 3]);
            let found = problem.project(i, problem.rho(i), &node);
            let tangent = match found.tangent(&node, problem.slope(i, &node)) {
                Tangent::Open => continue,
                // A node that cannot move along the surface keeps the traction that it has.
                Tangent::Stick { creep: 0.0 } => Tangent::Open,
                tangent => tangent,
            };
            closed.push(i);
            laws.push(Law { tangent, normal: problem.rho(i).normal, pressure: found.pressure });
        }
        let rows = 3 * closed.len();
        let mut system = Mat::<f64>::zeros(rows + drive.borders.len(), rows + drive.borders.len());
        for (j, (&b, own)) in closed.iter().zip(&laws).enumerate() {
            let (m, e, _) = own.tangent.plane();
            for c in 0..3 {
                let w = ws.w.col(3 * b + c);
                let out = system.col_as_slice_mut(3 * j + c);
                for (i, (&a, law)) in closed.iter().zip(&laws).enumerate() {
                    law.put([w[3 * a], w[3 * a + 1], w[3 * a + 2]], &mut out[3 * i..3 * i + 3]);
                }
                let direct = if c < 2 { [m[0][c], m[1][c]] } else { e };
                (0..2).for_each(|k| out[3 * j + k] += direct[k]);
                for (k, border) in drive.borders.iter().enumerate() {
                    out[rows + k] = border.row[ws.patch_of(b)][c];
                }
            }
        }
        for (k, border) in drive.borders.iter().enumerate() {
            let out = system.col_as_slice_mut(rows + k);
            for (i, (&a, law)) in closed.iter().zip(&laws).enumerate() {
                law.put(border.column[ws.patch_of(a)].map(|c| c / unit), &mut out[3 * i..3 * i + 3]);
            }
        }
        let mut right = Mat::<f64>::zeros(system.nrows(), columns);
        for column in 0..columns {
            let (free, out) = (free.col_as_slice(column), right.col_as_slice_mut(column));
            for (i, (&a, law)) in closed.iter().zip(&laws).enumerate() {
                let out = &mut out[3 * i..3 * i + 3];
                law.put([free[3 * a], free[3 * a + 1], free[3 * a + 2]], out);
                if let (Tangent::Slip(slip), true) = (&law.tangent, remembered.nrows() > 0) {
                    (0..2).for_each(|c| out[c] += slip.direction[c] * law.pressure * remembered[(a, column)]);
                }
                out.iter_mut().for_each(|v| *v = -*v);
            }
        }
        let found = match closed.is_empty() {
            true => Mat::zeros(right.nrows(), columns),
            false => system.partial_piv_lu().solve(&right),
        };
        if (0..columns).any(|c| found.col_as_slice(c).iter().any(|v| !v.is_finite())) {
            return Err(Error::NotConverged("the linearised contact of a time step is singular".into()));
        }
        let mut reaction = Mat::<f64>::zeros(3 * core, columns);
        for column in 0..columns {
            let (from, to) = (found.col_as_slice(column), reaction.col_as_slice_mut(column));
            for (i, &a) in closed.iter().enumerate() {
                to[3 * a..3 * a + 3].copy_from_slice(&from[3 * i..3 * i + 3]);
            }
        }
        let shift = Mat::from_fn(drive.borders.len(), columns, |k, c| found[(rows + k, c)] / unit);
        if remembered.nrows() > 0 {
            let moved = &free + ws.w.matrix() * &reaction;
            changes.friction.fill(0.0);
            for &a in &closed {
                let node = node(&solution.reaction[3 * a..3 * a + 3], &u[3 * a..3 * a + 3]);
                let velocity = size(node.creep);
                let slope = if velocity > 0.0 { problem.slope(a, &node) / velocity } else { 0.0 };
                for c in 0..columns {
                    let rigid = |k: usize| {
                        let borders = drive.borders.iter().enumerate();
                        borders.map(|(b, border)| border.column[ws.patch_of(a)][k] * shift[(b, c)]).sum::<f64>()
                    };
                    let along: f64 = (0..2).map(|k| node.creep[k] * (moved[(3 * a + k, c)] + rigid(k))).sum();
                    changes.friction[(ws.nodes[a], c)] = remembered[(a, c)] + slope * along;
                }
            }
        }
        changes.reaction.fill(0.0);
        changes.motions.fill(0.0);
        for c in 0..columns {
            let (from, to) = (reaction.col_as_slice(c), changes.reaction.col_as_slice_mut(c));
            for &a in &closed {
                to[3 * ws.nodes[a]..3 * ws.nodes[a] + 3].copy_from_slice(&from[3 * a..3 * a + 3]);
            }
            for k in 0..drive.borders.len() {
                if let Some(motion) = drive.motion_of(k) {
                    changes.motions[(motion, c)] = -shift[(k, c)];
                }
            }
        }
        changes.force = self.core_shapes(3 * core).transpose() * &reaction;
        changes.motion = ends.to_owned();
        Ok(())
    }

    /// The first `rows` rows of Ψ on the working set, `[rows, m]`.
    fn core_shapes(&self, rows: usize) -> MatRef<'_, f64> {
        let rank = self.shapes.rank();
        MatRef::from_row_major_slice(&self.working.psi[..rows * rank], rows, rank)
    }

    /// Changes of the displacements of the core without its reactions at the end of the step, m, `[3 core, c]`: `old`
    /// are those of its reactions before, N, `[3 core, c]`.
    fn changed_free(&self, changes: &Changes, old: &Mat<f64>, ends: MatRef<'_, f64>) -> Mat<f64> {
        let ws = &self.working;
        let (core, full, columns) = (3 * ws.core, 3 * ws.full, ends.ncols());
        // Before the step: Ψ δq + S δR.
        let mut before = self.core_shapes(full) * &changes.motion;
        let mut own = before.as_mut().subrows_mut(0, core);
        own += ws.w.matrix() * old;
        let around = ws.rows() - core;
        let stride = padded_len::<f64>(around);
        let around = MatRef::from_column_major_slice_with_stride(&ws.around, around, core, stride);
        let mut beside = before.as_mut().subrows_mut(core, full - core);
        beside += around.subrows(0, full - core) * old;
        let mut free = self.core_shapes(core) * ends;
        // What the feet take from the displacements before, and from the gaps where an edge moves.
        let mut takes = Vec::new();
        let mut sinks = Vec::new();
        for a in 0..ws.core {
            let (near, part) = self.foot_stencil(a);
            for c in 0..2 {
                takes.extend(near.iter().zip(part).filter(|n| n.1 != 0.0).map(|(n, p)| (3 * a + c, 3 * n + c, p)));
            }
            for (place, [x, y]) in self.foot_by_gap(a).into_iter().flatten() {
                takes.extend([(3 * a, 3 * place + 2, x), (3 * a + 1, 3 * place + 2, y)]);
                sinks.extend([(3 * a, ws.patch_of(a), x), (3 * a + 1, ws.patch_of(a), y)]);
            }
        }
        for column in 0..columns {
            let approach = self.settings.drive.approaches(changes.motions.col_as_slice(column));
            let (from, to) = (before.col_as_slice(column), free.col_as_slice_mut(column));
            takes.iter().for_each(|&(row, of, part)| to[row] -= part * from[of]);
            sinks.iter().for_each(|&(row, patch, part)| to[row] += part * approach[patch]);
        }
        free
    }

    /// Changes of the coefficients of friction of the core at the end of the step that those before it make at the
    /// slip that there is, `[core, c]`; without rows where friction is constant.
    fn changed_memory(&self, changes: &Changes) -> Mat<f64> {
        let ws = &self.working;
        if changes.friction.nrows() == 0 {
            return Mat::zeros(0, changes.friction.ncols());
        }
        let h = self.settings.scheme.step;
        let mut out = Mat::zeros(ws.core, changes.friction.ncols());
        for a in 0..ws.core {
            let slip = [0, 1].map(|c| self.met.slip[2 * a + c]);
            let [own, upstream] = self.settings.friction.renewed_by_memory(&self.before[a], size(slip) / h);
            for (of, part) in self.remembers(a) {
                let weight = part[0] * own + part[1] * upstream;
                (0..out.ncols()).for_each(|c| out[(a, c)] += weight * changes.friction[(of, c)]);
            }
        }
        out
    }

    /// Nodes of the interface whose coefficients come to core node `a` in a step, with their parts in the coefficient
    /// at the node and in that upstream of it ([`Stepper::remembered`]).
    fn remembers(&self, a: usize) -> Vec<(usize, [f64; 2])> {
        let (i, (line, foot)) = (self.working.nodes[a], self.working.feet[a]);
        match foot {
            DeparturePoint::Node(at) => vec![(line + at, [1.0; 2])],
            DeparturePoint::Between { left, .. } if line + left + 1 == i => vec![(i, [1.0, 0.0]), (i - 1, [0.0, 1.0])],
            DeparturePoint::Between { left, travel } => {
                let x = &self.model.interface.place(i).0.x;
                let way = travel / (x[left + 1] - x[left]);
                vec![(line + left + 1, [1.0 - way; 2]), (line + left, [way; 2])]
            }
        }
    }
}

/// Linearised laws of a closed node.
struct Law {
    tangent: Tangent,
    /// ρ_n, N/m.
    normal: f64,
    /// p, N.
    pressure: f64,
}

impl Law {
    /// Adds the rows for the displacements `u` (x, y, n).
    fn put(&self, u: [f64; 3], out: &mut [f64]) {
        let (_, _, b) = self.tangent.plane();
        out[0] += b[0][0] * u[0] + b[0][1] * u[1];
        out[1] += b[1][0] * u[0] + b[1][1] * u[1];
        out[2] += self.normal * u[2];
    }
}

/// Rows of `nodes` of a field, `[3n, c]`, as `[3k, c]`.
fn gathered(of: &Mat<f64>, nodes: &[usize]) -> Mat<f64> {
    Mat::from_fn(3 * nodes.len(), of.ncols(), |row, c| of[(3 * nodes[row / 3] + row % 3, c)])
}
