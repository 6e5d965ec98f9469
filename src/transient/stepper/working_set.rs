//! The nodes in the problem of a step: those that touch, those around them, and what tells that others come near.

use super::super::aligned::AlignedVec;
use super::super::delassus::DelassusOperator;
use super::super::departure_point::{support, DeparturePoint};
use super::super::model::Impact;
use super::super::problem::StepSolution;
use super::{pressed, Stepper};
use crate::contact::upwind_reconstruction::UpwindReconstruction;
use crate::dense::{dot, sum_over};
use crate::{Error, Result};

/// The nodes that may touch (the core), and those around them whose displacements are needed.
pub(super) struct WorkingSet {
    /// Core nodes, then those upstream that feet may need, then those of which only the gap is looked at.
    pub(super) nodes: Vec<usize>,
    /// Patch of each core node; empty where there is one patch.
    pub(super) patch: Vec<usize>,
    pub(super) core: usize,
    /// Core nodes and those upstream: those with all three components.
    pub(super) full: usize,
    /// Place of each node of the interface in `nodes`, or `usize::MAX`.
    pub(super) place: Vec<usize>,
    /// W of the core nodes.
    pub(super) w: DelassusOperator,
    /// Rows of W of the other nodes here, columns of the core nodes, `[3 core][rows − 3 core]`, every column in
    /// lines of its own.
    pub(super) around: AlignedVec<f64>,
    /// Rows of Ψ by what the contact sees of the modes: three of each full node, then the normal one of each other,
    /// `[rows][r]`.
    pub(super) psi: AlignedVec<f64>,
    /// Foot of each core node with its line of the grid.
    pub(super) feet: Vec<(usize, DeparturePoint)>,
    /// The same by what it takes.
    pub(super) ways: Vec<InterpolationStencil>,
    /// Position of each core node, m, and its rigid creep beside that of the creepages, m/s.
    pub(super) at: Vec<([f64; 2], [f64; 2])>,
    /// Displacements at the present time, m, `[rows]`.
    pub(super) u: Vec<f64>,
}

/// Interpolation stencil of a departure point; nodes by their places in the working set.
pub(super) enum InterpolationStencil {
    Node(usize),
    /// Between the first two nodes of a line: in a straight line.
    First([usize; 2], [f64; 2]),
    /// The nodes after the foot, before it and upstream of that, and what they take part with where all three are
    /// closed.
    Between([usize; 3], [f64; 3]),
}

impl WorkingSet {
    /// Number of rows.
    pub(super) fn rows(&self) -> usize {
        2 * self.full + self.nodes.len()
    }

    /// Patch of core node `a`.
    pub(super) fn patch_of(&self, a: usize) -> usize {
        self.patch.get(a).copied().unwrap_or(0)
    }

    /// Normal row of node `a`.
    pub(super) fn normal(&self, a: usize) -> usize {
        if a < self.full {
            3 * a + 2
        } else {
            2 * self.full + a
        }
    }
}

/// The nodes outside the working set: how near they are to touching.
#[derive(Default)]
pub(super) struct InactiveNodes {
    /// Smallest gap at the time of the last look, m; none where there was no look yet.
    gap: Option<f64>,
    /// Gaps of the undeformed bodies then, m, `[n]`.
    undeformed: Vec<f64>,
    q: Vec<f64>,
    /// Reactions on the core, N, `[3 core]`.
    reaction: Vec<f64>,
    /// Approach of each patch, m, `[patches]`.
    approach: Vec<f64>,
    /// Largest change of a gap that a unit of each mode and of each reaction on the core makes out there, `[m]` and
    /// `[3 core]`.
    reach: [Vec<f64>; 2],
}

/// Distances of the nodes `left` and the one before it from the one after it, m.
fn upstream(x: &[f64], left: usize) -> [f64; 2] {
    [left, left - 1].map(|jx| x[left + 1] - x[jx])
}

/// By how much gaps can have changed at the most: changes of what moves them, each times its `reach`.
fn moved(reach: &[f64], now: &[f64], then: &[f64]) -> f64 {
    let n = reach.len().min(now.len()).min(then.len());
    let (reach, now, then) = (&reach[..n], &now[..n], &then[..n]);
    sum_over(n, |i| reach[i] * (now[i] - then[i]).abs())
}

impl Stepper<'_> {
    /// Displacement w of the material of core node `a` a step ago, m.
    pub(super) fn foot_value(&self, a: usize) -> [f64; 2] {
        let ws = &self.working;
        let u = |place: usize| [ws.u[3 * place], ws.u[3 * place + 1]];
        if let InterpolationStencil::Node(place) = ws.ways[a] {
            return u(place);
        }
        let (near, part) = self.foot_stencil(a);
        let [a, b, c] = near.map(u);
        [part[0] * a[0] + part[1] * b[0] + part[2] * c[0], part[0] * a[1] + part[1] * b[1] + part[2] * c[1]]
    }

    /// Places in the working set whose displacements make the one at the departure point of core node `a`, and their
    /// parts in it.
    pub(super) fn foot_stencil(&self, a: usize) -> ([usize; 3], [f64; 3]) {
        let ws = &self.working;
        let (near, inside) = match ws.ways[a] {
            InterpolationStencil::Node(place) => return ([place; 3], [1.0, 0.0, 0.0]),
            InterpolationStencil::First([after, before], part) => {
                return ([after, before, before], [part[0], part[1], 0.0])
            }
            InterpolationStencil::Between(near, inside) => (near, inside),
        };
        // Where the contact is closed at the nodes beside the foot and upstream of it; as in the steady analysis.
        let closed = near.map(|place| self.is_closed(ws.nodes[place]));
        if closed == [true; 3] {
            return (near, inside);
        }
        let Some((course, travel, h)) = self.course_at_an_edge(a, near, closed) else { return (near, [0.0; 3]) };
        (near, course.value(travel, h))
    }

    /// The course of the displacement from core node `a` on to the nodes `near` its departure point where not all of
    /// them are `closed`, with the way of the point and the distances of the nodes, m.
    fn course_at_an_edge(
        &self,
        a: usize,
        near: [usize; 3],
        closed: [bool; 3],
    ) -> Option<(UpwindReconstruction, f64, [f64; 2])> {
        let ws = &self.working;
        let (line, DeparturePoint::Between { left, travel }) = ws.feet[a] else { return None };
        let h = upstream(&self.model.interface.place(ws.nodes[a]).0.x, left);
        let known = self.impact == Impact::Compliant || self.massive;
        let own = line + left + 1 == ws.nodes[a] && known;
        let course = match closed {
            // Only at its own node the gaps of the edge are known.
            [true, false, false] if !own => UpwindReconstruction::Line,
            _ => UpwindReconstruction::new(h, closed, || self.gaps_ahead(a, near)),
        };
        Some((course, travel, h))
    }

    /// Gaps before the step at the two nodes upstream of core node `a`, m.
    fn gaps_ahead(&self, a: usize, near: [usize; 3]) -> [f64; 2] {
        let ws = &self.working;
        let approach = self.settings.drive.approaches(&self.state.motions)[ws.patch_of(a)];
        [1, 2].map(|k| self.passing.before[ws.nodes[near[k]]] - approach + ws.u[3 * near[k] + 2])
    }

    /// How the displacement (x, y) at the departure point of core node `a` changes with the gaps ahead of it: their
    /// places and the derivatives; none where it does not.
    pub(super) fn foot_by_gap(&self, a: usize) -> Option<[(usize, [f64; 2]); 2]> {
        let ws = &self.working;
        let InterpolationStencil::Between(near, _) = ws.ways[a] else { return None };
        let closed = near.map(|place| self.is_closed(ws.nodes[place]));
        if closed != [true, false, false] {
            return None;
        }
        let (course, travel, h) = self.course_at_an_edge(a, near, closed)?;
        let change = course.value_by_gap(travel, h, self.gaps_ahead(a, near))?;
        let sum = |part: [f64; 3], c: usize| (0..3).map(|k| part[k] * ws.u[3 * near[k] + c]).sum::<f64>();
        Some([0, 1].map(|k| (near[k + 1], [0, 1].map(|c| sum(change[k], c)))))
    }

    /// Nodes outside the core that the solution presses into each other; those outside the working set are looked at
    /// when they may have come near since the last time.
    pub(super) fn entering(
        &mut self,
        solution: &StepSolution,
        (response, free): (&[f64], &[f64]),
        q: &[f64],
        approach: &[f64],
    ) -> Vec<usize> {
        let s = self.model.interface;
        let ws = &self.working;
        let gap = &self.passing.after;
        let limit = self.rounding(approach);
        let nearer = |i: usize| approach[s.patch_of(i)];
        let closes = |i: usize| !self.open.get(s.patch_of(i)).copied().unwrap_or(false);
        let mut entering: Vec<usize> = (ws.core..ws.nodes.len())
            .filter(|&a| closes(ws.nodes[a]))
            .filter(|&a| gap[ws.nodes[a]] - nearer(ws.nodes[a]) + free[ws.normal(a)] + response[ws.normal(a)] < limit)
            .map(|a| ws.nodes[a])
            .collect();
        if !entering.is_empty() {
            return entering;
        }
        let o = &mut self.outside;
        if let Some(then) = o.gap {
            let passed = (0..s.len()).filter(|&i| ws.place[i] == usize::MAX).map(|i| (gap[i] - o.undeformed[i]).abs());
            // Smooth bodies take no time.
            let passed = if self.passing.is_rough() { passed.fold(0.0, f64::max) } else { 0.0 };
            let by = moved(&o.reach[0], q, &o.q) + moved(&o.reach[1], &solution.reaction, &o.reaction) + passed;
            let sunk = approach.iter().zip(&o.approach).fold(0.0f64, |m, (now, then)| m.max((now - then).abs()));
            if then > by + sunk {
                return entering;
            }
        }
        let mut nearest = f64::INFINITY;
        let seen = self.shapes.contact_amplitudes(q);
        for i in (0..s.len()).filter(|&i| ws.place[i] == usize::MAX && closes(i)) {
            let col = self.model.residual.col(3 * i + 2);
            let mut elastic = [0.0; 3];
            for (&j, r) in ws.nodes.iter().zip(solution.reaction.chunks_exact(3)) {
                for c in 0..3 {
                    elastic[c] += col[3 * j + c] * r[c];
                }
            }
            let now = gap[i] - nearer(i) + elastic.iter().sum::<f64>() + dot(self.shapes.row(3 * i + 2), &seen);
            nearest = nearest.min(now);
            if now < limit {
                entering.push(i);
            }
        }
        o.gap = Some(nearest);
        o.undeformed.clone_from(gap);
        o.q = q.to_vec();
        o.reaction = solution.reaction.clone();
        o.approach = approach.to_vec();
        entering
    }

    /// The node of the patches `of` that is nearest to the other body, without reactions, where `q` is seen of the
    /// modes, `[r]`.
    pub(super) fn nearest(&self, q: &[f64], of: impl Fn(usize) -> bool) -> Option<usize> {
        let s = self.model.interface;
        let gap = |i: usize| self.passing.after[i] + dot(self.shapes.row(3 * i + 2), q);
        (0..s.len()).filter(|&i| of(s.patch_of(i))).min_by(|&a, &b| gap(a).total_cmp(&gap(b)))
    }

    /// Motions that can move the gaps of the nodes outside the working set, which are not looked at yet.
    fn around(&self) -> InactiveNodes {
        let ws = &self.working;
        let modes = self.model.modes;
        let mut reach = [vec![0.0f64; modes.ncols()], vec![0.0f64; 3 * ws.core]];
        for i in (0..ws.place.len()).filter(|&i| ws.place[i] == usize::MAX) {
            let row = modes.row(3 * i + 2);
            reach[0].iter_mut().zip(row.iter()).for_each(|(r, v)| *r = r.max(v.abs()));
            let col = self.model.residual.col(3 * i + 2);
            for (r, &j) in reach[1].chunks_exact_mut(3).zip(&ws.nodes) {
                (0..3).for_each(|c| r[c] = r[c].max(col[3 * j + c].abs()));
            }
        }
        InactiveNodes { reach, ..InactiveNodes::default() }
    }

    /// Drops core nodes when many of them are open.
    pub(super) fn shrink(&mut self) -> Result<()> {
        let needed = match &self.integrated {
            Some(integrated) => integrated.with_neighbours(pressed(&self.state.reaction)).len(),
            None => self.report.closed(),
        };
        if self.working.core > 12 && 3 * self.working.core > 4 * needed + 36 {
            return self.reset();
        }
        Ok(())
    }

    /// Makes the working set of the given core nodes.
    pub(super) fn gather(&mut self, mut core: Vec<usize>) -> Result<()> {
        let s = self.model.interface;
        if let Some(integrated) = &self.integrated {
            core = integrated.with_neighbours(core);
        }
        core.sort_unstable();
        core.dedup();
        let mut place = vec![usize::MAX; s.len()];
        let mut nodes = core.clone();
        for (a, &i) in core.iter().enumerate() {
            place[i] = a;
        }
        let mut beside = Vec::new();
        let mut lines = Vec::with_capacity(core.len());
        for &i in &core {
            let (patch, ix, iy) = s.place(i);
            let line = patch.node(0, iy);
            let foot = self.feet[s.patch_of(i)][ix]
                .filter(|_| !s.on_border(i) || self.impact == Impact::Rigid && !self.massive)
                .ok_or_else(|| {
                    let [x, y] = s.point(i);
                    Error::Job(format!(
                        "contact.patch: the contact reaches x = {x:.4e} m, y = {y:.4e} m, at the border of the \
                     patch; enlarge \
                     contact.patch.half_length and contact.patch.half_width (of mesh files the groups \
                     \"contact\"), or lower the load"
                    ))
                })?;
            lines.push((line, foot));
            let near = |k: usize, n: usize| k.saturating_sub(1)..(k + 2).min(n);
            let (columns, rows) = (near(ix, patch.x.len()), near(iy, patch.y.len()));
            beside.extend(columns.flat_map(|jx| rows.clone().map(move |jy| patch.node(jx, jy))));
            for j in support(foot, patch.x.len()).map(|jx| line + jx) {
                if place[j] == usize::MAX {
                    place[j] = nodes.len();
                    nodes.push(j);
                }
            }
        }
        let full = nodes.len();
        for j in beside {
            if place[j] == usize::MAX {
                place[j] = nodes.len();
                nodes.push(j);
            }
        }
        let rows: Vec<usize> = nodes[..full]
            .iter()
            .flat_map(|&i| 3 * i..3 * i + 3)
            .chain(nodes[full..].iter().map(|&i| 3 * i + 2))
            .collect();
        let columns = |rows: &[usize]| -> Vec<f64> {
            core.iter()
                .flat_map(|&j| (3 * j..3 * j + 3).map(|column| self.w.col_as_slice(column)))
                .flat_map(|column| rows.iter().map(|&row| column[row]))
                .collect()
        };
        let w = DelassusOperator::new(columns(&rows[..3 * core.len()]));
        let beyond = &rows[3 * core.len()..];
        let around = AlignedVec::columns(beyond.len(), columns(beyond).into_iter());
        let psi: Vec<f64> = rows.iter().flat_map(|&row| self.shapes.row(row).iter().copied()).collect();
        let psi = AlignedVec::from(psi.into_iter());
        let seen = self.shapes.contact_amplitudes(&self.state.q);
        // Displacements of the present state: Ψ q + S R.
        let loaded: Vec<usize> = (0..self.state.reaction.len()).filter(|&k| self.state.reaction[k] != 0.0).collect();
        let u = rows
            .iter()
            .enumerate()
            .map(|(a, &row)| {
                let column = self.model.residual.col(row);
                let elastic: f64 = loaded.iter().map(|&k| column[k] * self.state.reaction[k]).sum();
                elastic + dot(&psi[seen.len() * a..][..seen.len()], &seen)
            })
            .collect();
        let way = |&(line, foot): &(usize, DeparturePoint)| {
            let at = |jx: usize| place[line + jx];
            let x = &s.place(line).0.x;
            match foot {
                DeparturePoint::Node(jx) => InterpolationStencil::Node(at(jx)),
                DeparturePoint::Between { left: 0, travel } => {
                    let [after, before, _] = UpwindReconstruction::Line.value(travel, [x[1] - x[0]; 2]);
                    InterpolationStencil::First([at(1), at(0)], [after, before])
                }
                DeparturePoint::Between { left, travel } => {
                    let near = [at(left + 1), at(left), at(left - 1)];
                    InterpolationStencil::Between(near, UpwindReconstruction::Parabola.value(travel, upstream(x, left)))
                }
            }
        };
        let ways = lines.iter().map(way).collect();
        let at = core.iter().map(|&i| (s.point(i), s.creep(i))).collect();
        let patch = if s.patches.len() > 1 { core.iter().map(|&i| s.patch_of(i)).collect() } else { Vec::new() };
        let core = core.len();
        self.working = WorkingSet { nodes, patch, core, full, place, w, around, psi, feet: lines, ways, at, u };
        self.outside = self.around();
        self.memory.forget();
        self.past.clear();
        self.posed.clear();
        Ok(())
    }
}
