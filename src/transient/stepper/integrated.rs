//! Steps whose contact laws hold at points of quadrature, with the consistent matrices of the interface
//! ([`crate::contact::consistent`]).

use super::super::border::Border;
use super::super::model::Impact;
use super::super::problem::{Effort, StepProblem, StepSolution};
use super::Stepper;
use crate::contact::consistent::{self, CellProblem, ConsistentSurface, ContactCells, FactoredJacobian, IntegratedLaw};
use crate::contact::law::{Augmentation, Status};
use crate::{Error, Result};

/// The laws at points of quadrature and what serves the next step too.
pub(super) struct Integrated {
    surface: ConsistentSurface,
    /// Per displacement over a step, Pa/m.
    rho: Augmentation,
    cells: Option<ContactCells>,
    memory: FactoredJacobian,
    /// Nodes that are closed by the fields there at the beginning of the step, `[n]`.
    closed: Vec<bool>,
}

impl Stepper<'_> {
    /// The same with the laws at points of quadrature: `rho` are ρ_n in Pa/m and ρ_t V in Pa, as of the steady
    /// problem that the run begins with ([`consistent::augmentation`]). Points without neighbours, bodies without
    /// residual compliance and friction that changes are errors.
    pub fn consistent(mut self, rho: Augmentation) -> Result<Self> {
        let s = self.model.interface;
        if s.are_points() || self.impact == Impact::Rigid || !self.settings.friction.is_constant() {
            return Err(Error::Job(
                "contact.quadrature: \"consistent\" is for bodies with a residual compliance that touch on a \
                 grid with a constant coefficient of friction; \
                 take \"nodal\""
                    .into(),
            ));
        }
        let patch = s.single("contact.quadrature \"consistent\"")?;
        if self.settings.drive.motions.iter().any(|m| m.factors != [1.0] || m.resultant != [[0.0, 0.0, 1.0]]) {
            return Err(Error::Job(
                "contact.quadrature: \"consistent\" takes a normal load or an approach; expected \"nodal\" with \
                 contact.vertical_load"
                    .into(),
            ));
        }
        let way = self.settings.drive.patches[0].speed * self.settings.scheme.step;
        self.integrated = Some(Integrated {
            surface: ConsistentSurface::new(patch),
            rho: Augmentation { normal: rho.normal, tangential: rho.tangential / way },
            cells: None,
            memory: FactoredJacobian::default(),
            closed: vec![false; s.len()],
        });
        self.reset()?;
        Ok(self)
    }

    /// Returns whether the node `i` of the interface was closed at the beginning of the step.
    pub(super) fn is_closed(&self, i: usize) -> bool {
        match &self.integrated {
            Some(integrated) => integrated.closed[i],
            None => self.state.reaction[3 * i + 2] > 0.0,
        }
    }

    /// Looks where the contact ends in the present state, where its forces do not tell: as the steady analysis does.
    pub(super) fn look_for_edges(&mut self) {
        let Some(integrated) = &mut self.integrated else { return };
        let ws = &self.working;
        let approach = self.settings.drive.approaches(&self.state.motions)[0];
        let field = integrated.surface.field(&self.state.reaction);
        integrated.closed.fill(false);
        for (a, &i) in ws.nodes.iter().enumerate() {
            let gap = self.passing.before[i] - approach + ws.u[ws.normal(a)];
            integrated.closed[i] = field[3 * i + 2] > integrated.rho.normal * gap;
        }
    }

    /// Nodes outside the core of cells that are pressed somewhere.
    pub(super) fn pressed_beyond(
        &self,
        solution: &StepSolution,
        (response, free): (&[f64], &[f64]),
        approach: &[f64],
    ) -> Vec<usize> {
        let Some(integrated) = self.integrated.as_ref().filter(|_| self.open != [true]) else { return Vec::new() };
        let ws = &self.working;
        let mut forces = vec![0.0; self.state.reaction.len()];
        for (r, &i) in solution.reaction.chunks_exact(3).zip(&ws.nodes) {
            forces[3 * i..3 * i + 3].copy_from_slice(r);
        }
        let field = integrated.surface.field(&forces);
        let gap = |i: usize| {
            let a = Some(ws.place[i]).filter(|&a| a != usize::MAX)?;
            let row = ws.normal(a);
            Some(self.passing.after[i] - approach[0] + free[row] + response[row])
        };
        let mut beyond = integrated.surface.pressed(|i| field[3 * i + 2], integrated.rho.normal, gap);
        beyond.retain(|&i| ws.place[i] >= ws.core);
        beyond
    }
}

impl Integrated {
    /// `nodes` and their neighbours.
    pub(super) fn with_neighbours(&self, nodes: Vec<usize>) -> Vec<usize> {
        self.surface.with_neighbours(nodes.into_iter())
    }

    /// Solves the problem of a step on the `nodes` from the reactions `guess`, N, `[3k]`, and a shift.
    pub(super) fn solve(
        &mut self,
        p: &StepProblem<'_>,
        nodes: &[usize],
        guess: &[f64],
        shift: &[f64],
        effort: &mut Effort,
    ) -> Result<StepSolution> {
        let k = nodes.len();
        if self.cells.as_ref().is_none_or(|c| c.nodes != nodes) {
            self.cells = Some(ContactCells::new(&self.surface, nodes.to_vec()));
            self.memory = FactoredJacobian::default();
        }
        let missing = || Error::Defect("a step without the cells of its nodes".into());
        let cells = self.cells.as_ref().ok_or_else(missing)?;
        let scale = p.scale(guess);
        if scale == 0.0 {
            let (reaction, response) = (vec![0.0; 3 * k], vec![0.0; 3 * k]);
            let status = vec![Status::Open; k];
            let shift = shift.to_vec();
            return Ok(StepSolution { reaction, shift, response, status, friction: Vec::new(), residual: 0.0 });
        }
        let law = IntegratedLaw { rho: self.rho, friction: p.friction.law(0).coefficient(0.0) };
        // Component of the reactions whose total each border prescribes.
        let component = |b: &Border| b.tangential().unwrap_or(2);
        let (mut total, mut from) = ([None; 3], [0.0; 3]);
        for (border, s) in p.borders.iter().zip(shift) {
            (total[component(border)], from[component(border)]) = (Some(border.total), *s);
        }
        let posed =
            CellProblem { cells, law, response: p.matrix.matrix(), constant: p.free, total, measure: &vec![1.0; k] };
        let target = p.tolerance * scale;
        let mut now = posed.iterate(guess.to_vec(), from);
        let mut spent = consistent::ConsistentEffort::default();
        // What rounding leaves is removed by a product of the whole once the method is there.
        for _ in 0..3 {
            let found = posed.solve(target, now, &mut self.memory, &mut spent);
            *effort += Effort {
                iterations: spent.iterations,
                products: spent.products,
                factorisations: spent.factorisations,
                ..Effort::default()
            };
            spent = consistent::ConsistentEffort::default();
            let reached = found.map_err(|left| {
                Error::NotConverged(format!(
                    "contact of a time step, consistent quadrature: Newton's method stalled at a residual of \
                     {:.2e} N, {target:.2e} N was asked for",
                    left
                ))
            })?;
            now = posed.iterate(reached.forces, reached.shift);
            if now.largest <= target {
                let status = (0..k).map(|i| law.status(now.fields(), i)).collect();
                return Ok(StepSolution {
                    residual: now.largest,
                    reaction: now.projected(),
                    shift: p.borders.iter().map(|b| now.shift[component(b)]).collect(),
                    response: now.response,
                    status,
                    friction: Vec::new(),
                });
            }
        }
        Err(Error::NotConverged(format!(
            "contact of a time step, consistent quadrature: rounding leaves a residual of {:.2e} N, \
             {target:.2e} N was asked for",
            now.largest
        )))
    }
}
