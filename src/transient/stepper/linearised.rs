//! Steps of small changes: the derivative of a step, of many changes at once.
//!
//! The motion behind the contact without the reactions of the step changes by δq, that of a driven stepper by what is
//! given. With δu⁰ the change of the displacements before the step, the displacements of the core without its reactions
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
use crate::transient::departure_point::DeparturePoint;
use crate::transient::model::Impact;
use crate::transient::problem::{node, StepProblem};
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};

/// Singular values below this part of the largest one are rounding.
const KEPT: f64 = 1e-12;

/// Small changes of the state of a stepper, one in each of c columns.
#[derive(Debug, Clone, PartialEq)]
pub struct StateChanges {
    /// Changes of the modal displacements, m √kg, and velocities, m √kg/s, `[m, c]` each; without rows of a driven
    /// stepper.
    modes: [Mat<f64>; 2],
    /// Changes of the motion that the contact saw in the last step without its reactions, `[r, c]`.
    seen: Mat<f64>,
    /// Reactions that changed in the last step: row of each unknown with its parts (x, y, n), and the unknowns, N,
    /// `[k, c]`.
    parts: Vec<(usize, [f64; 3])>,
    reaction: Mat<f64>,
    /// Changes of the coefficients of friction, `[n, c]`; without rows where friction is constant.
    friction: Mat<f64>,
    /// Changes of the rigid motions, m, `[motions, c]`.
    motions: Mat<f64>,
    /// Ψᵀ δR of the last step, `[m, c]`.
    force: Mat<f64>,
    /// Parts of W for the reactions of the step and for those before it.
    near: [NearCompliance; 2],
}

/// Part of W, m/N: displacements of some rows of the interface by the forces on some nodes. It is kept as long as these
/// stay, since W is far larger than it.
#[derive(Debug, Clone, PartialEq, Default)]
struct NearCompliance {
    rows: Vec<usize>,
    /// First row of each node.
    nodes: Vec<usize>,
    /// Columns of the nodes, `[rows][3 nodes]`.
    columns: Vec<f64>,
}

impl NearCompliance {
    /// Displacements of the `rows` of `w`, m, by a unit of each of `parts`, which are the first row of a node and its
    /// reaction (x, y, n), N, `[rows, parts]`.
    fn response<'p>(
        &mut self,
        w: &Mat<f64>,
        rows: &[usize],
        parts: impl Iterator<Item = (usize, &'p [f64; 3])> + Clone,
    ) -> Mat<f64> {
        let mut nodes: Vec<usize> = parts.clone().map(|(first, _)| first).collect();
        let count = nodes.len();
        nodes.dedup();
        if self.rows != rows || self.nodes != nodes {
            let column = |k: usize| rows.iter().map(move |&row| w.col_as_slice(k)[row]);
            self.columns = nodes.iter().flat_map(|first| (*first..first + 3).flat_map(column)).collect();
            (self.rows, self.nodes) = (rows.to_vec(), nodes);
        }
        let mut out = Mat::zeros(rows.len(), count);
        let mut place = 0;
        for (k, (first, part)) in parts.enumerate() {
            if self.nodes[place] != first {
                place += 1;
            }
            let columns = &self.columns[3 * place * rows.len()..][..3 * rows.len()];
            let (x, rest) = columns.split_at(rows.len());
            let (y, n) = rest.split_at(rows.len());
            let out = out.col_as_slice_mut(k).iter_mut();
            out.zip(x.iter().zip(y).zip(n)).for_each(|(o, ((x, y), n))| *o = part[0] * x + part[1] * y + part[2] * n);
        }
        out
    }
}

impl StateChanges {
    /// Changes `motion`, `[m, c]`, of the coordinates behind the contact of the driven `stepper` alone.
    pub(crate) fn of_motion(stepper: &Stepper<'_>, motion: Mat<f64>) -> Self {
        let (state, columns) = (&stepper.state, motion.ncols());
        Self {
            modes: [Mat::zeros(0, columns), Mat::zeros(0, columns)],
            parts: Vec::new(),
            reaction: Mat::zeros(0, columns),
            friction: Mat::zeros(state.friction.len(), columns),
            motions: Mat::zeros(state.motions.len(), columns),
            force: Mat::zeros(motion.nrows(), columns),
            near: Default::default(),
            seen: motion,
        }
    }

    /// Changes of the modal `displacement` and `velocity`, `[m, c]`, of `stepper` alone.
    pub fn of_modes(stepper: &Stepper<'_>, displacement: Mat<f64>, velocity: Mat<f64>) -> Self {
        let force = Mat::zeros(displacement.nrows(), displacement.ncols());
        let seen = stepper.shapes.contact_motion(&displacement);
        Self { force, modes: [displacement, velocity], ..Self::of_motion(stepper, seen) }
    }

    /// Changes of the modal displacements and velocities, `[m, c]`.
    pub fn modes(&self) -> [MatRef<'_, f64>; 2] {
        self.modes.each_ref().map(Mat::as_ref)
    }

    /// Parts of the contact in these changes of `stepper`, beside the changes of the modes alone
    /// ([`of_modes`](Self::of_modes)): a singular value decomposition, each quantity relative to its largest change.
    pub(crate) fn kept_by_the_contact(&self, stepper: &Stepper<'_>) -> Result<KeptChanges> {
        let seen = &self.seen - stepper.shapes.contact_motion(&self.modes[0]);
        let quantities = [&self.reaction, &seen, &self.motions, &self.friction];
        let columns = self.seen.ncols();
        let mut stack = Mat::zeros(quantities.iter().map(|of| of.nrows()).sum(), columns);
        let mut first = 0;
        for of in quantities {
            let largest = of.norm_max();
            let unit = if largest > 0.0 { 1.0 / largest } else { 0.0 };
            (0..columns).for_each(|c| (0..of.nrows()).for_each(|i| stack[(first + i, c)] = unit * of[(i, c)]));
            first += of.nrows();
        }
        let found = stack
            .thin_svd()
            .map_err(|e| Error::NotConverged(format!("changes that the contact keeps of a period: {e:?}")))?;
        let (values, v) = (found.S().column_vector(), found.V());
        let kept = (0..values.nrows()).take_while(|&k| values[k] > KEPT * values[0]).count();
        let mix = Mat::from_fn(columns, kept, |c, k| v[(c, k)] / values[k]);
        let changes = Self {
            modes: [(); 2].map(|()| Mat::zeros(self.modes[0].nrows(), kept)),
            seen: seen * &mix,
            parts: self.parts.clone(),
            reaction: &self.reaction * &mix,
            friction: &self.friction * &mix,
            motions: &self.motions * &mix,
            force: &self.force * &mix,
            near: self.near.clone(),
        };
        Ok(KeptChanges { changes, parts: Mat::from_fn(kept, columns, |k, c| values[k] * v[(c, k)]) })
    }

    /// Changes of the forces on the coordinates behind the contact in the last step, Ψᵀ δR, `[m, c]`.
    pub fn force(&self) -> MatRef<'_, f64> {
        self.force.as_ref()
    }
}

/// Small changes of the contact that the contact keeps of others.
#[derive(Debug, Clone, PartialEq)]
pub struct KeptChanges {
    /// Independent changes of the contact alone, the modes at rest, one in each of p columns.
    pub changes: StateChanges,
    /// Parts of each of the others in these, `[p, c]`.
    pub parts: Mat<f64>,
}

/// Displacements and gaps that the departure points of some nodes take.
#[derive(Default)]
struct Feet {
    /// Rows of the interface that they take.
    rows: Vec<usize>,
    /// Row of the nodes, place in `rows`, part in it.
    takes: Vec<(usize, usize, f64)>,
    /// Row of the nodes, patch, part in its approach.
    sinks: Vec<(usize, usize, f64)>,
}

impl Stepper<'_> {
    /// One step of a [driven](Self::driven) stepper, with its small `changes`, whose coordinates end changed by `ends`,
    /// `[m, c]`. An error where the laws hold at points of quadrature or the step is singular.
    pub fn advance_with(&mut self, changes: &mut StateChanges, ends: MatRef<'_, f64>) -> Result<()> {
        self.advance_changed(Some((changes, Some(ends))))
    }

    /// One step of a stepper on modes, with the small `changes` of its state. Errors as of
    /// [`advance_with`](Self::advance_with), and where nodes strike each other or the motion behind the contact is not
    /// that of modes.
    pub(crate) fn advance_modes_with(&mut self, changes: &mut StateChanges) -> Result<()> {
        self.advance_changed(Some((changes, None)))
    }

    /// The changes at the end of the step that `end` ends, in the state before it; its motion is changed by `ends`, or
    /// as the modes go on.
    pub(super) fn change(
        &self,
        (changes, ends): (&mut StateChanges, Option<MatRef<'_, f64>>),
        drive: &StepDrive,
        end: &StepEnd,
    ) -> Result<()> {
        if self.integrated.is_some() || (ends.is_none() && self.impact == Impact::Rigid) {
            return Err(Error::Defect(
                "a linearised step with laws at points of quadrature or nodes that strike".into(),
            ));
        }
        let (mut modes, seen) = match ends {
            Some(ends) => (changes.modes.clone(), ends.to_owned()),
            None => {
                let [q, v] = &changes.modes;
                let free = self.motion.free_changes([q, v, &changes.force]);
                let [q, v, motion] =
                    free.ok_or_else(|| Error::Defect("a linearised step of bodies that are not modes".into()))?;
                ([q, v], self.shapes.contact_motion(&motion))
            }
        };
        let ws = &self.working;
        let (core, columns, h) = (ws.core, seen.ncols(), self.settings.scheme.step);
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
        let own: Vec<usize> = nodes.iter().flat_map(|n| 3 * ws.nodes[n.at]..3 * ws.nodes[n.at] + 3).collect();
        let carried = self.changed_carried(&changes.modes, &own)?;
        let mut free = self.changed_free(changes, &seen, &nodes);
        carried.into_iter().for_each(|slid| free += slid);
        // Of each equation and each unknown the place of its node among the closed ones.
        let rows: Vec<(usize, &Equation)> =
            nodes.iter().enumerate().flat_map(|(k, n)| n.rows.iter().map(move |r| (k, r))).collect();
        let parts: Vec<(usize, &[f64; 3])> =
            nodes.iter().enumerate().flat_map(|(k, n)| n.parts.iter().map(move |p| (k, p))).collect();
        // Displacements of the closed nodes by each unknown.
        let at = |node: &ClosedNode| 3 * ws.nodes[node.at];
        let unknowns = parts.iter().map(|(node, part)| (at(&nodes[*node]), *part));
        let response = changes.near[0].response(&self.w, &own, unknowns);
        let size = parts.len() + drive.borders.len();
        let mut system = Mat::<f64>::zeros(size, size);
        for (k, (node, part)) in parts.iter().enumerate() {
            let (u, out) = (response.col_as_slice(k), system.col_as_slice_mut(k));
            for (o, (of, row)) in out.iter_mut().zip(&rows) {
                *o = row.moved(&u[3 * of..3 * of + 3]);
                if of == node {
                    *o += dot(&row.reaction, *part);
                }
            }
            for (b, border) in drive.borders.iter().enumerate() {
                out[parts.len() + b] = dot(&border.row[ws.patch_of(nodes[*node].at)], *part);
            }
        }
        for (b, border) in drive.borders.iter().enumerate() {
            let out = system.col_as_slice_mut(parts.len() + b);
            for (o, (of, row)) in out.iter_mut().zip(&rows) {
                *o = row.moved(&border.column[ws.patch_of(nodes[*of].at)]) / unit;
            }
        }
        let mut right = Mat::<f64>::zeros(size, columns);
        for column in 0..columns {
            let (free, out) = (free.col_as_slice(column), right.col_as_slice_mut(column));
            for (o, (of, row)) in out.iter_mut().zip(&rows) {
                *o = -row.moved(&free[3 * of..3 * of + 3]);
                if remembered.nrows() > 0 {
                    *o -= row.friction * remembered[(nodes[*of].at, column)];
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
        let reaction = found.subrows(0, parts.len());
        if remembered.nrows() > 0 {
            changes.friction.fill(0.0);
            // The slip is the displacement less that at the foot.
            let slip = &free + &response * reaction;
            for (place, ClosedNode { at, .. }) in nodes.iter().enumerate() {
                let node = node(&solution.reaction[3 * at..3 * at + 3], &u[3 * at..3 * at + 3]);
                let velocity = size_of(node.creep);
                let slope = if velocity > 0.0 { problem.slope(*at, &node) / velocity } else { 0.0 };
                for c in 0..columns {
                    let rigid = |k: usize| {
                        let borders = drive.borders.iter().enumerate();
                        borders.map(|(b, border)| border.column[ws.patch_of(*at)][k] * shift[(b, c)]).sum::<f64>()
                    };
                    let along: f64 = (0..2).map(|k| node.creep[k] * (slip[(3 * place + k, c)] + rigid(k))).sum();
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
        changes.parts = parts.iter().map(|(k, part)| (3 * ws.nodes[nodes[*k].at], **part)).collect();
        let pressed = Mat::from_fn(seen.nrows(), parts.len(), |m, k| {
            let (row, part) = changes.parts[k];
            (0..3).map(|c| part[c] * self.shapes.row(row + c)[m]).sum::<f64>()
        });
        let force = self.shapes.modal_forces(pressed * reaction);
        if ends.is_none() {
            let [q, v] = &mut modes;
            self.motion.add_changes(&force, [q, v]);
        }
        changes.force = force;
        changes.reaction = reaction.to_owned();
        changes.seen = seen;
        changes.modes = modes;
        Ok(())
    }

    /// Ψ of the `rows` of the interface by what the contact sees of the motion, `[rows, r]`.
    fn shapes_of(&self, rows: &[usize]) -> Mat<f64> {
        Mat::from_fn(rows.len(), self.shapes.rank(), |i, k| self.shapes.row(rows[i])[k])
    }

    /// Changes of the displacements before the step, m, at the `rows` of the interface, `[rows, c]`: Ψ δq + W δR.
    fn changed_displacement(&self, changes: &mut StateChanges, rows: &[usize]) -> Mat<f64> {
        let parts = changes.parts.iter().map(|(row, part)| (*row, part));
        let response = changes.near[1].response(&self.w, rows, parts);
        self.shapes_of(rows) * &changes.seen + response * &changes.reaction
    }

    /// Changes of the displacements of the closed `nodes` without their reactions at the end of the step, m, `[3
    /// nodes, c]`, where the contact sees the motion `seen` without reactions.
    fn changed_free(&self, changes: &mut StateChanges, seen: &Mat<f64>, nodes: &[ClosedNode]) -> Mat<f64> {
        let own: Vec<usize> = nodes.iter().flat_map(|n| (0..3).map(|c| 3 * self.working.nodes[n.at] + c)).collect();
        let mut free = self.shapes_of(&own) * seen;
        let feet = self.feet_of(nodes);
        let before = self.changed_displacement(changes, &feet.rows);
        for column in 0..free.ncols() {
            let approach = self.settings.drive.approaches(changes.motions.col_as_slice(column));
            let (from, to) = (before.col_as_slice(column), free.col_as_slice_mut(column));
            feet.takes.iter().for_each(|&(row, of, part)| to[row] -= part * from[of]);
            feet.sinks.iter().for_each(|&(row, patch, part)| to[row] += part * approach[patch]);
        }
        free
    }

    /// Displacements and gaps that the departure points of the closed `nodes` take.
    fn feet_of(&self, nodes: &[ClosedNode]) -> Feet {
        let ws = &self.working;
        let mut feet = Feet::default();
        let mut places = vec![usize::MAX; 3 * ws.place.len()];
        for (k, ClosedNode { at, .. }) in nodes.iter().enumerate() {
            let mut take = |component: usize, (place, from): (usize, usize), part: f64| {
                let row = 3 * ws.nodes[place] + from;
                if places[row] == usize::MAX {
                    places[row] = feet.rows.len();
                    feet.rows.push(row);
                }
                feet.takes.push((3 * k + component, places[row], part));
            };
            let (near, part) = self.foot_stencil(*at);
            for c in 0..2 {
                near.into_iter().zip(part).filter(|n| n.1 != 0.0).for_each(|(n, p)| take(c, (n, c), p));
            }
            for (place, parts) in self.foot_by_gap(*at).into_iter().flatten() {
                for (c, part) in parts.into_iter().enumerate() {
                    take(c, (place, 2), part);
                    feet.sinks.push((3 * k + c, ws.patch_of(*at), part));
                }
            }
        }
        feet
    }

    /// Changes of the coefficients of friction of the core at the end of the step that those before it make at the
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
            let law = self.settings.friction.law(ws.patch_of(a));
            let [own, upstream] = law.renewed_by_memory(&self.before[a], size_of(slip) / h);
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
