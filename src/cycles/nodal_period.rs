//! Reactions and statuses of the contact nodes over a period of a cycle.

use super::balance::{Balance, Resolution};
use super::branch::{BranchPoint, Family};
use super::structure::Structure;
use crate::Result;

/// The contact nodes that close at some time of a period.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NodalPeriod {
    /// Their numbers, rising, `[k]`.
    pub nodes: Vec<usize>,
    /// Reactions (x, y, n) at the end of each step, N, `[N][3k]`.
    pub reaction: Vec<Vec<f64>>,
    /// Statuses then: 0 open, 1 stick, 2 slip, `[N][k]`.
    pub state: Vec<Vec<u8>>,
}

impl NodalPeriod {
    /// Period of a cycle of a branch whose motion is measured by `unit`, m √kg, marched once more.
    pub fn new(
        (structure, family): (&Structure<'_>, &dyn Family),
        resolution: Resolution,
        (point, unit): (&BranchPoint, f64),
    ) -> Result<Self> {
        let conditions = family.conditions(point.key)?;
        let with = family.dynamics(point.key)?.map(|dynamics| structure.with(dynamics)).transpose()?;
        let structure = with.as_ref().unwrap_or(structure);
        let size = structure.rank() * (2 * resolution.harmonics + 1);
        let begin = &point.cycle.begin;
        let mut balance = Balance::new(structure, &conditions, resolution, unit, begin)?;
        let all = balance.nodal_fields(&point.u[..size], point.cycle.omega, begin)?;
        let count = conditions.interface.len();
        let nodes: Vec<usize> = (0..count).filter(|&i| all.iter().any(|(_, state)| state[i] > 0)).collect();
        let reaction = all.iter().map(|(r, _)| nodes.iter().flat_map(|&i| [r[3 * i], r[3 * i + 1], r[3 * i + 2]]));
        let state = all.iter().map(|(_, state)| nodes.iter().map(|&i| state[i]).collect());
        Ok(Self { reaction: reaction.map(Iterator::collect).collect(), state: state.collect(), nodes })
    }

    /// All of it in a row.
    pub fn numbers(&self) -> Vec<f64> {
        let mut all = vec![self.nodes.len() as f64, self.state.len() as f64];
        all.extend(self.nodes.iter().map(|&i| i as f64));
        all.extend(self.reaction.iter().flatten());
        all.extend(self.state.iter().flatten().map(|&s| f64::from(s)));
        all
    }

    /// From [`numbers`](Self::numbers); none of others.
    pub fn from_numbers(all: &[f64]) -> Option<Self> {
        let (&[k, steps], rest) = all.split_first_chunk::<2>()?;
        let (k, steps) = (k as usize, steps as usize);
        let (nodes, rest) = rest.split_at_checked(k)?;
        let (reaction, state) = rest.split_at_checked(3 * k * steps)?;
        (state.len() == k * steps).then(|| Self {
            nodes: nodes.iter().map(|&i| i as usize).collect(),
            reaction: (0..steps).map(|n| reaction[3 * k * n..][..3 * k].to_vec()).collect(),
            state: (0..steps).map(|n| state[k * n..][..k].iter().map(|&s| s as u8).collect()).collect(),
        })
    }
}
