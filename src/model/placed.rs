//! Bodies of a [`SharedModel`] that are touched at another place: dense matrices are made of the nodes alone that a
//! linearised contact asks for.

use super::low_rank_compliance::JoinedCompliance;
use super::pair::ModeFactors;
use super::{adapt, CoupledModel, SharedModel};
use crate::body::hybrid::{add_functions, expansion, Compact, Lines};
use crate::body::Convolution;
use crate::grid::Interface;
use crate::job::Job;
use crate::{Error, Result};
use faer::Mat;

/// Two bodies at a place of theirs. A state of rest sees half-spaces alone.
#[derive(Debug, Clone)]
pub struct PlacedModel {
    /// The grid, with the gap.
    pub interface: Interface,
    /// The bodies as rolling sees them: without matrices of the contact rows.
    pub rolling: CoupledModel,
    grid: Lines,
    contact: JoinedCompliance,
}

impl SharedModel {
    /// The bodies on the grid of an `interface` elsewhere, where the contact sees them as the lower and the upper one
    /// of `parts`, with the damping and the rotation of `job`.
    pub fn placed(&mut self, job: &Job, interface: Interface, parts: [&Compact; 2]) -> Result<PlacedModel> {
        let missing = || Error::Defect("bodies are placed on a grid that is not uniform".into());
        let patch = interface.single("a place that is interpolated")?;
        let grid = [patch.x.clone(), patch.y.clone()];
        let convolution =
            |of: &Compact| Convolution::of_half_space(&of.half_space, &grid[0], &grid[1])?.ok_or_else(missing);
        let lower = convolution(parts[0])?;
        let upper = if parts[0].half_space == parts[1].half_space { None } else { Some(convolution(parts[1])?) };
        let both = Convolution::combined(&lower, upper.as_ref().unwrap_or(&lower))?;
        adapt(&mut self.pair, job, (&self.own, &self.rotation), &mut self.last)?;
        let own = &self.pair;
        let rolling = CoupledModel {
            compliance: Mat::zeros(0, 0),
            local: None,
            convolution: Some(both),
            residual: Mat::zeros(0, 0),
            modes: Mat::zeros(0, own.omega.len()),
            modes_mark: None,
            functions: None,
            omega: own.omega.clone(),
            stiffness: own.stiffness.clone(),
            damping: own.damping.clone(),
            turning: own.turning.clone(),
            carried: None,
            lower_modes: own.lower_modes,
            names: own.names.clone(),
            reach: own.reach,
        };
        let contact = JoinedCompliance::join(parts);
        match contact.seen.ncols() == own.omega.len() {
            true => Ok(PlacedModel { interface, rolling, grid, contact }),
            false => Err(Error::Defect("bodies are placed with other modes".into())),
        }
    }
}

impl PlacedModel {
    /// The bodies at some `nodes` of the grid, with residual and modes there, without compliance.
    pub fn at_nodes(&self, nodes: &[usize]) -> Result<CoupledModel> {
        let missing = || Error::Defect("a place without its half-spaces".into());
        let kernel = self.rolling.convolution.as_ref().ok_or_else(missing)?;
        let all = expansion(&self.grid);
        let pi = Mat::from_fn(3 * nodes.len(), all.ncols(), |i, k| all[(3 * nodes[i / 3] + i % 3, k)]);
        let mut residual = Mat::zeros(pi.nrows(), pi.nrows());
        for (b, &j) in nodes.iter().enumerate() {
            for (a, &i) in nodes.iter().enumerate() {
                let block = kernel.block(i, j);
                for c in 0..3 {
                    (0..3).for_each(|r| residual[(3 * a + r, 3 * b + c)] = block[r][c]);
                }
            }
        }
        add_functions(&mut residual, &pi, self.contact.beside.as_ref());
        let modes = &pi * &self.contact.seen;
        let functions = Some(ModeFactors { functions: pi, amplitudes: self.contact.seen.clone() });
        Ok(CoupledModel { residual, modes, functions, convolution: None, ..self.rolling.clone() })
    }
}
