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
use crate::contact::law::{across, size as size_of, Tangent};
use crate::dense::dot;
use crate::transient::aligned::padded_len;
use crate::transient::departure_point::DeparturePoint;
use crate::transient::problem::{node, StepProblem};
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};

/// StateChanges of the state of a driven stepper, one in each of c columns.
#[derive(Debug, Clone, PartialEq)]
pub struct StateChanges {
    /// StateChanges of the coordinates behind the contact, `[m, c]`.
    motion: Mat<f64>,
    /// Nodes whose reactions change, `[k]`, and the changes, N, `[3k, c]`.
    closed: Vec<usize>,
    reaction: Mat<f64>,
    /// Nodes whose displacements are known, `[f]`, and their changes, m, `[3f, c]`.
    known: Vec<usize>,
    displacement: Mat<f64>,
    /// StateChanges of the coefficients of friction, `[n, c]`; without rows where friction is constant.
    friction: Mat<f64>,
    /// StateChanges of the rigid motions, m, `[motions, c]`.
    motions: Mat<f64>,
    /// Ψᵀ δR of the last step, `[m, c]`.
    force: Mat<f64>,
}

impl StateChanges {
    /// StateChanges `motion`, `[m, c]`, of the coordinates behind the contact of `stepper` alone.
    pub fn of_motion(stepper: &Stepper<'_>, motion: Mat<f64>) -> Self {
        let (state, columns) = (&stepper.state, motion.ncols());
        Self {
            closed: Vec::new(),
            reaction: Mat::zeros(0, columns),
            known: Vec::new(),
            displacement: Mat::zeros(0, columns),
            friction: Mat::zeros(state.friction.len(), columns),
            motions: Mat::zeros(state.motions.len(), columns),
            force: Mat::zeros(motion.nrows(), columns),
            motion,
        }
    }

    /// StateChanges of the forces on the coordinates behind the contact in the last step, Ψᵀ δR, `[m, c]`.
    pub fn force(&self) -> MatRef<'_, f64> {
        self.force.as_ref()
    }
}

impl Stepper<'_> {
    /// One step of a [driven](Self::driven) stepper, with its small `changes`, whose coordinates end changed by `ends`,
    /// `[m, c]`. An error where the laws hold at points of quadrature or the step is singular.
    pub fn advance_with(&mut self, changes: &mut StateChanges, ends: MatRef<'_, f64>) -> Result<()> {
        self.advance_changed(Some((changes, ends)))
    }

    /// The changes at the end of the step that `end` ends, in the state before it.
    pub(super) fn change(
        &self,
        (changes, ends): (&mut StateChanges, MatRef<'_, f64>),
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
        let free = self.changed_free(changes, ends);
        let remembered = self.changed_memory(changes);
        let solution = &end.solution;
        let u = problem.displacement(&solution.response, &solution.shift);
        let unit = (0..core).map(|i| problem.rho(i).normal).sum::<f64>() / core.max(1) as f64;
        let nodes: Vec<ClosedNode> = (0..core)
            .filter_map(|i| {
                let node = node(&solution.reaction[3 * i..3 * i + 3], &u[3 * i..3 * i + 3]);
                let found = problem.project(i, problem.rho(i), &node);
                let tangent = match found.tangent(&node, problem.slope(i, &node)) {
                    Tangent::Open => return None,
                    // A node that cannot move along the surface keeps the traction that it has.
                    Tangent::Stick { creep: 0.0 } => Tangent::Open,
                    tangent => tangent,
                };
                Some(ClosedNode::new(i, tangent, [problem.rho(i).normal, found.pressure], remembered.nrows() == 0))
            })
            .collect();
        let rows: Vec<(&ClosedNode, &Equation)> =
            nodes.iter().flat_map(|n| n.rows.iter().map(move |r| (n, r))).collect();
        let parts: Vec<(&ClosedNode, &[f64; 3])> =
            nodes.iter().flat_map(|n| n.parts.iter().map(move |p| (n, p))).collect();
        // Displacements of the nodes by each unknown.
        let mut response = Mat::<f64>::zeros(3 * ws.full, parts.len());
        let around = ws.rows() - 3 * core;
        let stride = padded_len::<f64>(around);
        for (k, (node, part)) in parts.iter().enumerate() {
            let (own, beside) = response.col_as_slice_mut(k).split_at_mut(3 * core);
            for c in (0..3).filter(|&c| part[c] != 0.0) {
                let column = 3 * node.at + c;
                own.iter_mut().zip(ws.w.col(column)).for_each(|(o, w)| *o += part[c] * w);
                let beyond = &ws.around[stride * column..];
                beside.iter_mut().zip(beyond).for_each(|(o, w)| *o += part[c] * w);
            }
        }
        let size = parts.len() + drive.borders.len();
        let mut system = Mat::<f64>::zeros(size, size);
        for (k, (node, part)) in parts.iter().enumerate() {
            let (u, out) = (response.col_as_slice(k), system.col_as_slice_mut(k));
            for (o, (of, row)) in out.iter_mut().zip(&rows) {
                *o = row.moved(&u[3 * of.at..3 * of.at + 3]);
                if of.at == node.at {
                    *o += dot(&row.reaction, *part);
                }
            }
            for (b, border) in drive.borders.iter().enumerate() {
                out[parts.len() + b] = dot(&border.row[ws.patch_of(node.at)], *part);
            }
        }
        for (b, border) in drive.borders.iter().enumerate() {
            let out = system.col_as_slice_mut(parts.len() + b);
            for (o, (of, row)) in out.iter_mut().zip(&rows) {
                *o = row.moved(&border.column[ws.patch_of(of.at)]) / unit;
            }
        }
        let mut right = Mat::<f64>::zeros(size, columns);
        for column in 0..columns {
            let (free, out) = (free.col_as_slice(column), right.col_as_slice_mut(column));
            for (o, (of, row)) in out.iter_mut().zip(&rows) {
                *o = -row.moved(&free[3 * of.at..3 * of.at + 3]);
                if remembered.nrows() > 0 {
                    *o -= row.friction * remembered[(of.at, column)];
                }
            }
        }
        let found = match nodes.is_empty() {
            true => Mat::zeros(size, columns),
            false => system.partial_piv_lu().solve(&right),
        };
        if (0..columns).any(|c| found.col_as_slice(c).iter().any(|v| !v.is_finite())) {
            return Err(Error::NotConverged("the linearised contact of a time step is singular".into()));
        }
        let shift = Mat::from_fn(drive.borders.len(), columns, |k, c| found[(parts.len() + k, c)] / unit);
        let mut reaction = Mat::<f64>::zeros(3 * nodes.len(), columns);
        let places: Vec<usize> = nodes.iter().enumerate().flat_map(|(k, n)| n.parts.iter().map(move |_| k)).collect();
        for column in 0..columns {
            let (from, to) = (found.col_as_slice(column), reaction.col_as_slice_mut(column));
            for ((y, (_, part)), k) in from.iter().zip(&parts).zip(&places) {
                (0..3).for_each(|c| to[3 * k + c] += y * part[c]);
            }
        }
        let posed = self.core_shapes(3 * ws.full) * ends;
        let moved = &posed + &response * found.subrows(0, parts.len());
        if remembered.nrows() > 0 {
            changes.friction.fill(0.0);
            for ClosedNode { at, .. } in &nodes {
                let node = node(&solution.reaction[3 * at..3 * at + 3], &u[3 * at..3 * at + 3]);
                let velocity = size_of(node.creep);
                let slope = if velocity > 0.0 { problem.slope(*at, &node) / velocity } else { 0.0 };
                // The slip is the displacement less that at the foot.
                let foot = |k: usize, c: usize| free[(3 * at + k, c)] - posed[(3 * at + k, c)];
                for c in 0..columns {
                    let rigid = |k: usize| {
                        let borders = drive.borders.iter().enumerate();
                        borders.map(|(b, border)| border.column[ws.patch_of(*at)][k] * shift[(b, c)]).sum::<f64>()
                    };
                    let along: f64 =
                        (0..2).map(|k| node.creep[k] * (moved[(3 * at + k, c)] + foot(k, c) + rigid(k))).sum();
                    changes.friction[(ws.nodes[*at], c)] = remembered[(*at, c)] + slope * along;
                }
            }
        }
        changes.motions.fill(0.0);
        for k in 0..drive.borders.len() {
            if let Some(motion) = drive.motion_of(k) {
                (0..columns).for_each(|c| changes.motions[(motion, c)] = -shift[(k, c)]);
            }
        }
        let shapes = Mat::from_fn(ends.nrows(), 3 * nodes.len(), |m, row| {
            self.shapes.row(3 * ws.nodes[nodes[row / 3].at] + row % 3)[m]
        });
        changes.force = shapes * &reaction;
        changes.closed = nodes.iter().map(|n| ws.nodes[n.at]).collect();
        changes.reaction = reaction;
        changes.known = ws.nodes[..ws.full].to_vec();
        changes.displacement = moved;
        changes.motion = ends.to_owned();
        Ok(())
    }

    /// The first `rows` rows of Ψ on the working set, `[rows, m]`.
    fn core_shapes(&self, rows: usize) -> MatRef<'_, f64> {
        let rank = self.shapes.rank();
        MatRef::from_row_major_slice(&self.working.psi[..rows * rank], rows, rank)
    }

    /// StateChanges of the displacements of the nodes of the working set with all three components before the step, m,
    /// `[3 full, c]`: Ψ δq + S δR.
    fn changed_displacement(&self, changes: &StateChanges) -> Mat<f64> {
        let ws = &self.working;
        if changes.known == ws.nodes[..ws.full] {
            return changes.displacement.clone();
        }
        let residual = Mat::from_fn(3 * ws.full, 3 * changes.closed.len(), |row, column| {
            self.model.residual[(3 * ws.nodes[row / 3] + row % 3, 3 * changes.closed[column / 3] + column % 3)]
        });
        let mut before = self.core_shapes(3 * ws.full) * &changes.motion;
        before += residual * &changes.reaction;
        before
    }

    /// StateChanges of the displacements of the core without its reactions at the end of the step, m, `[3 core, c]`.
    fn changed_free(&self, changes: &StateChanges, ends: MatRef<'_, f64>) -> Mat<f64> {
        let ws = &self.working;
        let (core, columns) = (3 * ws.core, ends.ncols());
        let before = self.changed_displacement(changes);
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

    /// StateChanges of the coefficients of friction of the core at the end of the step that those before it make at the
    /// slip that there is, `[core, c]`; without rows where friction is constant.
    fn changed_memory(&self, changes: &StateChanges) -> Mat<f64> {
        let ws = &self.working;
        if changes.friction.nrows() == 0 {
            return Mat::zeros(0, changes.friction.ncols());
        }
        let h = self.settings.scheme.step;
        let mut out = Mat::zeros(ws.core, changes.friction.ncols());
        for a in 0..ws.core {
            let slip = [0, 1].map(|c| self.met.slip[2 * a + c]);
            let [own, upstream] = self.settings.friction.renewed_by_memory(&self.before[a], size_of(slip) / h);
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

/// A linearised equation of a closed node: reaction·δR + motion·δu + friction δμ⁰ = 0.
struct Equation {
    reaction: [f64; 3],
    motion: [f64; 3],
    friction: f64,
}

impl Equation {
    /// The part of the displacement `u` (x, y, n).
    fn moved(&self, u: &[f64]) -> f64 {
        self.motion[0] * u[0] + self.motion[1] * u[1] + self.motion[2] * u[2]
    }
}

/// A closed node: its linearised laws, and the reactions that they leave unknown.
struct ClosedNode {
    /// Place in the core.
    at: usize,
    rows: Vec<Equation>,
    /// Reactions (x, y, n) under a unit of each unknown, as many as there are equations.
    parts: Vec<[f64; 3]>,
}

impl ClosedNode {
    /// The node at place `at` with ρ_n, N/m, and the pressure p, N. Where friction is constant, the traction along the
    /// sliding follows the pressure and is no unknown.
    fn new(at: usize, tangent: Tangent, [normal, pressure]: [f64; 2], constant: bool) -> Self {
        let closes = Equation { reaction: [0.0; 3], motion: [0.0, 0.0, normal], friction: 0.0 };
        if let (Tangent::Slip(slip), true) = (&tangent, constant) {
            let (d, e) = (slip.direction, across(slip.direction));
            let with = |v: [f64; 2], c: f64, n: f64| [c * v[0], c * v[1], n];
            let turns = Equation {
                reaction: with(e, slip.across[0], 0.0),
                motion: with(e, slip.across[1], 0.0),
                friction: 0.0,
            };
            return Self {
                at,
                rows: vec![turns, closes],
                parts: vec![with(e, 1.0, 0.0), with(d, -slip.friction, 1.0)],
            };
        }
        let (m, e, b) = tangent.plane();
        let direction = match &tangent {
            Tangent::Slip(slip) => slip.direction,
            _ => [0.0; 2],
        };
        let along = |c: usize| Equation {
            reaction: [m[c][0], m[c][1], e[c]],
            motion: [b[c][0], b[c][1], 0.0],
            friction: pressure * direction[c],
        };
        let unit = |c: usize| [0, 1, 2].map(|k| if k == c { 1.0 } else { 0.0 });
        Self { at, rows: vec![along(0), along(1), closes], parts: vec![unit(0), unit(1), unit(2)] }
    }
}
