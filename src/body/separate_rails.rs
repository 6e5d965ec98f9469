//! The two rails of a track as one body, without sleepers that both share: no rail moves the other.
//!
//! With the contacts on the first rail stacked before those on the second one, and modes of both in ascending order,
//!
//! ```text
//! C = diag(C_1, C_2),   Ψ = diag(Ψ_1, Ψ_2) Q,   D = Qᵀ diag(D_1, D_2) Q
//! ```
//!
//! with the compliances C_i, the modes Ψ_i at the contact rows and their damping D_i, and the permutation Q.

use super::hybrid::Compact;
use super::mode_cache::CachedModes;
use super::modes::Extent;
use super::rail::RailOnTrack;
use super::{ElasticBody, Kind, ModeLabel, ProgressFn, TraceModes};
use crate::parallel::World;
use crate::swept::Infinite;
use crate::{Error, Result};
use faer::Mat;

/// Two rails that do not move each other.
pub struct SeparateRails<'w> {
    world: &'w World,
    name: String,
    /// The rails with their names, in the order of their contacts.
    rails: [(&'static str, RailOnTrack<'w>); 2],
    /// Rail and number on it of each mode, ascending, once they are known.
    order: Vec<(usize, usize)>,
}

impl<'w> SeparateRails<'w> {
    /// The body `name` of two rails with their names; contact rows of the first one come first.
    pub fn new(world: &'w World, name: &str, rails: [(&'static str, RailOnTrack<'w>); 2]) -> Self {
        Self { world, name: name.into(), rails, order: Vec::new() }
    }

    /// Joins a matrix of each rail whose rows are those of its contacts and whose columns are its modes, `[rows, m]`.
    fn joined_modes(&self, each: [&Mat<f64>; 2]) -> Mat<f64> {
        let first = each[0].nrows();
        Mat::from_fn(first + each[1].nrows(), self.order.len(), |i, j| {
            let (rail, k) = self.order[j];
            match (rail, i.checked_sub(first)) {
                (0, None) => each[0][(i, k)],
                (1, Some(i)) => each[1][(i, k)],
                _ => 0.0,
            }
        })
    }

    /// Joins a square matrix of the modes of each rail, `[m, m]`.
    fn joined_damping(&self, each: [&Mat<f64>; 2]) -> Mat<f64> {
        let count = self.order.len();
        Mat::from_fn(count, count, |i, j| match (self.order[i], self.order[j]) {
            ((a, k), (b, l)) if a == b => each[a][(k, l)],
            _ => 0.0,
        })
    }

    /// Joins a list of the modes of each rail; none where a rail has none.
    fn joined_list<T: Clone>(&self, each: [&Vec<T>; 2]) -> Vec<T> {
        self.order.iter().filter_map(|&(rail, k)| each[rail].get(k).cloned()).collect()
    }
}

/// Two matrices along the diagonal.
fn diagonal(first: &Mat<f64>, second: &Mat<f64>) -> Mat<f64> {
    let (rows, columns) = (first.nrows() + second.nrows(), first.ncols() + second.ncols());
    let mut all = Mat::zeros(rows, columns);
    all.as_mut().submatrix_mut(0, 0, first.nrows(), first.ncols()).copy_from(first);
    all.as_mut().submatrix_mut(first.nrows(), first.ncols(), second.nrows(), second.ncols()).copy_from(second);
    all
}

impl ElasticBody for SeparateRails<'_> {
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> Kind {
        Kind::Rail
    }

    fn rows(&self) -> usize {
        self.rails.iter().map(|(_, rail)| rail.rows()).sum()
    }

    fn factorise(&mut self) -> Result<Option<String>> {
        let mut texts = Vec::new();
        for (side, rail) in &mut self.rails {
            let text = rail.factorise().map_err(|e| e.context(format!("{side} rail")))?;
            texts.extend(text.map(|text| format!("{side} rail: {text}")));
        }
        Ok((!texts.is_empty()).then(|| texts.join("; ")))
    }

    fn release(&mut self) -> Result<()> {
        self.rails.iter_mut().try_for_each(|(_, rail)| rail.release())
    }

    fn compliance(&self, steps: &mut ProgressFn) -> Result<Option<Mat<f64>>> {
        let [(_, first), (_, second)] = &self.rails;
        let (first, second) = (first.compliance(steps)?, second.compliance(steps)?);
        Ok(first.zip(second).map(|(first, second)| diagonal(&first, &second)))
    }

    fn compact(&self) -> Result<Option<Compact>> {
        let [(_, first), (_, second)] = &self.rails;
        let (Some(first), Some(second)) = (first.compact()?, second.compact()?) else { return Ok(None) };
        let beside = diagonal(&first.beside, &second.beside);
        let seen = self.joined_modes([&first.seen, &second.seen]);
        Ok(Some(Compact { half_space: first.half_space, beside, seen }))
    }

    fn modes(&mut self, extent: Extent, steps: &mut ProgressFn) -> Result<TraceModes> {
        let [(one, first), (other, second)] = &mut self.rails;
        let names = [*one, *other];
        let of_first = first.modes(extent, steps)?;
        // Rails of one section have the same modes, seen at other places.
        if let Some(found) = first.cached_modes() {
            second.reuse_modes(&found);
        }
        let of_second = second.modes(extent, steps)?;
        let each = [&of_first, &of_second];
        let mut order: Vec<(usize, usize)> = Vec::new();
        each.iter().enumerate().for_each(|(rail, modes)| order.extend((0..modes.omega.len()).map(|k| (rail, k))));
        order.sort_by(|a, b| each[a.0].omega[a.1].total_cmp(&each[b.0].omega[b.1]));
        self.order = order;
        let on_root = |what: &str| Error::Defect(format!("{what} of one of two rails are missing on rank 0"));
        let (rows, damping) = match self.world.is_root() {
            false => (None, None),
            true => {
                let rows = of_first.rows.as_ref().zip(of_second.rows.as_ref()).ok_or_else(|| on_root("modes"))?;
                let damping = match (&of_first.damping, &of_second.damping) {
                    (Some(first), Some(second)) => Some(self.joined_damping([first, second])),
                    (None, None) => None,
                    _ => return Err(on_root("dampings")),
                };
                (Some(self.joined_modes(rows.into())), damping)
            }
        };
        let named = |rail: usize| -> Vec<ModeLabel> {
            let label = |name: &ModeLabel| ModeLabel { order: name.order, family: names[rail].into() };
            each[rail].names.iter().map(label).collect()
        };
        Ok(TraceModes {
            omega: self.joined_list(each.map(|modes| &modes.omega)),
            residual: self.joined_list(each.map(|modes| &modes.residual)),
            springs: self.joined_list(each.map(|modes| &modes.springs)),
            names: self.joined_list([&named(0), &named(1)]),
            reach: of_first.reach.min(of_second.reach),
            rows,
            damping,
            ..TraceModes::default()
        })
    }

    fn cached_modes(&self) -> Option<CachedModes> {
        self.rails[0].1.cached_modes()
    }

    fn reuse_modes(&mut self, found: &CachedModes) {
        self.rails[0].1.reuse_modes(found);
    }

    fn infinite(&self, _reach: f64) -> Result<Option<Infinite>> {
        Err(Error::Job(format!(
            "bodies.{}: found two rails whose sound is asked for, expected one: waves of a rail without ends are known \
             under forces at one place; leave the sound of the rails out (sound_power.bodies)",
            self.name
        )))
    }

    fn response(&self, forces: &[f64]) -> Result<Vec<f64>> {
        let [(_, first), (_, second)] = &self.rails;
        // Forces are on rank 0 alone.
        let (of_first, of_second) = forces.split_at(forces.len().min(first.rows()));
        Ok([first.response(of_first)?, second.response(of_second)?].concat())
    }
}
