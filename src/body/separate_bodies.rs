//! Bodies on one side of the contacts as one body: no one of them moves another one, as the rails of a track without
//! sleepers that both share, or the wheels on one roller.
//!
//! With the contacts of the first body stacked before those of the next ones, and modes of all in ascending order,
//!
//! ```text
//! C = diag(C_1, C_2, …),   Ψ = diag(Ψ_1, Ψ_2, …) Q,   D = Qᵀ diag(D_1, D_2, …) Q
//! ```
//!
//! with the compliances C_i, the modes Ψ_i at the contact rows, their damping and terms of rotation D_i, and the
//! permutation Q.

use super::hybrid::{Compact, ContactFunctions};
use super::mode_cache::CachedModes;
use super::modes::Extent;
use super::near_contacts::NearPair;
use super::rotation::ModalRotation;
use super::{ElasticBody, Kind, ModeLabel, ProgressFn, TraceModes};
use crate::parallel::World;
use crate::swept::{Infinite, OrderModes, OutlineModes, LOADS};
use crate::{Error, Result};
use faer::Mat;
use std::collections::BTreeMap;

/// One of some bodies that do not move each other.
pub struct SeparateBody<B> {
    /// Its name among them, as messages have it.
    pub name: String,
    /// Names of its modes; none: their own ones, with its name behind them.
    pub family: Option<String>,
    /// Number of its section among them: bodies of one section have the same modes, seen at other places.
    pub section: usize,
    /// The body.
    pub body: B,
}

/// Bodies that do not move each other.
pub struct SeparateBodies<'w, B> {
    world: &'w World,
    name: String,
    /// The bodies, in the order of their contacts.
    bodies: Vec<SeparateBody<B>>,
    /// Body and number on it of each mode, ascending, once they are known.
    order: Vec<(usize, usize)>,
}

impl<'w, B: ElasticBody> SeparateBodies<'w, B> {
    /// The body `name` of several; contact rows of the first one come first.
    pub fn new(world: &'w World, name: &str, bodies: Vec<SeparateBody<B>>) -> Self {
        Self { world, name: name.into(), bodies, order: Vec::new() }
    }

    /// The bodies, in the order of their contacts.
    pub fn each(&self) -> impl Iterator<Item = &B> {
        self.bodies.iter().map(|one| &one.body)
    }

    /// Body and number on it of each mode, ascending, once they are known.
    pub fn order(&self) -> &[(usize, usize)] {
        &self.order
    }

    /// Joins a matrix of each body whose rows are those of its contacts and whose columns are its modes, `[rows, m]`.
    pub fn joined_modes(&self, each: &[&Mat<f64>]) -> Mat<f64> {
        let rows = each.iter().map(|of| of.nrows()).sum();
        let mut all = Mat::zeros(rows, self.order.len());
        for (j, &(body, k)) in self.order.iter().enumerate() {
            let first: usize = each[..body].iter().map(|of| of.nrows()).sum();
            (0..each[body].nrows()).for_each(|i| all[(first + i, j)] = each[body][(i, k)]);
        }
        all
    }

    /// Joins a list of the modes of each body; none where that of a body with modes is empty.
    fn joined_list<T: Clone>(&self, each: &[&Vec<T>]) -> Vec<T> {
        let all: Option<Vec<T>> = self.order.iter().map(|&(body, k)| each[body].get(k).cloned()).collect();
        all.unwrap_or_default()
    }

    /// Joins a list of the modes of each body that a body may do without, which has zeros then; none where all do.
    fn joined_numbers(&self, each: &[&Vec<f64>]) -> Vec<f64> {
        match each.iter().all(|list| list.is_empty()) {
            true => Vec::new(),
            false => self.order.iter().map(|&(body, k)| each[body].get(k).copied().unwrap_or(0.0)).collect(),
        }
    }

    /// Joins a square matrix of the modes of each body that it may do without, `[m, m]`; none where all do.
    fn joined_squares(&self, each: &[Option<&Mat<f64>>]) -> Option<Mat<f64>> {
        let count = self.order.len();
        let entry = |i: usize, j: usize| match (self.order[i], self.order[j]) {
            ((a, k), (b, l)) if a == b => each[a].map_or(0.0, |of| of[(k, l)]),
            _ => 0.0,
        };
        each.iter().any(Option::is_some).then(|| Mat::from_fn(count, count, entry))
    }

    /// Joins the terms of rotation of the bodies that turn.
    fn joined_rotation(&self, each: &[TraceModes]) -> Option<ModalRotation> {
        let all: Vec<Option<&ModalRotation>> = each.iter().map(|of| of.rotation.as_ref()).collect();
        let joined = |of: fn(&ModalRotation) -> &Mat<f64>| {
            self.joined_squares(&all.iter().map(|rotation| rotation.map(of)).collect::<Vec<_>>())
        };
        Some(ModalRotation {
            gyroscopic: joined(|r| &r.gyroscopic)?,
            stiffness: joined(|r| &r.stiffness)?,
            derivative: joined(|r| &r.derivative)?,
        })
    }
}

/// Some matrices along the diagonal.
fn diagonal(each: &[Mat<f64>]) -> Mat<f64> {
    let (rows, columns) = (each.iter().map(Mat::nrows).sum(), each.iter().map(Mat::ncols).sum());
    let mut all = Mat::zeros(rows, columns);
    let mut at = (0, 0);
    for of in each {
        all.as_mut().submatrix_mut(at.0, at.1, of.nrows(), of.ncols()).copy_from(of);
        at = (at.0 + of.nrows(), at.1 + of.ncols());
    }
    all
}

impl<B: ElasticBody> ElasticBody for SeparateBodies<'_, B> {
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> Kind {
        self.each().next().map_or(Kind::Rigid, ElasticBody::kind)
    }

    fn rows(&self) -> usize {
        self.each().map(ElasticBody::rows).sum()
    }

    fn factorise(&mut self) -> Result<Option<String>> {
        let mut texts: Vec<(String, String)> = Vec::new();
        for SeparateBody { name, body, .. } in &mut self.bodies {
            let made = body.factorise().map_err(|e| e.context(name.clone()))?;
            texts.extend(made.map(|text| (name.clone(), text)));
        }
        // What is alike is told once.
        match &texts[..] {
            [] => Ok(None),
            [(_, first), others @ ..] if others.iter().all(|(_, text)| text == first) => {
                Ok(Some(format!("each: {first}")))
            }
            _ => Ok(Some(texts.iter().map(|(name, text)| format!("{name}: {text}")).collect::<Vec<_>>().join("; "))),
        }
    }

    fn release(&mut self) -> Result<()> {
        self.bodies.iter_mut().try_for_each(|one| one.body.release())
    }

    fn compliance(&self, steps: &mut ProgressFn) -> Result<Option<Mat<f64>>> {
        let each = self.each().map(|body| body.compliance(steps)).collect::<Result<Vec<_>>>()?;
        Ok(each.into_iter().collect::<Option<Vec<_>>>().map(|each| diagonal(&each)))
    }

    fn compact(&self) -> Result<Option<Compact>> {
        let each = self.each().map(ElasticBody::compact).collect::<Result<Vec<_>>>()?;
        let Some(each) = each.into_iter().collect::<Option<Vec<Compact>>>() else { return Ok(None) };
        let seen = self.joined_modes(&each.iter().map(|of| &of.seen).collect::<Vec<_>>());
        let half_space = each.first().map(|of| of.half_space);
        let near = joined_pairs(each.iter().map(|of| (&of.near[..], of.seen.nrows() / LOADS)));
        let beside = diagonal(&each.into_iter().map(|of| of.beside).collect::<Vec<_>>());
        Ok(half_space.map(|half_space| Compact { half_space, near, beside, seen }))
    }

    fn contact_functions(&self) -> Result<Option<ContactFunctions>> {
        let each = self.each().map(ElasticBody::contact_functions).collect::<Result<Vec<_>>>()?;
        let Some(each) = each.into_iter().collect::<Option<Vec<ContactFunctions>>>() else { return Ok(None) };
        let seen = self.joined_modes(&each.iter().map(|of| &of.seen).collect::<Vec<_>>());
        let half_space = each.first().map(|of| of.half_space);
        let near = joined_pairs(each.iter().map(|of| (&of.near[..], of.seen.nrows() / LOADS)));
        let constant = diagonal(&each.into_iter().map(|of| of.constant).collect::<Vec<_>>());
        Ok(half_space.map(|half_space| ContactFunctions { half_space, near, constant, seen }))
    }

    fn modes(&mut self, extent: Extent, steps: &mut ProgressFn) -> Result<TraceModes> {
        let mut each: Vec<TraceModes> = Vec::new();
        let mut known: BTreeMap<usize, CachedModes> = BTreeMap::new();
        for one in &mut self.bodies {
            if let Some(found) = known.get(&one.section) {
                one.body.reuse_modes(found);
            }
            each.push(one.body.modes(extent, steps)?);
            if let Some(found) = one.body.cached_modes() {
                known.entry(one.section).or_insert(found);
            }
        }
        let mut order: Vec<(usize, usize)> = Vec::new();
        each.iter().enumerate().for_each(|(body, modes)| order.extend((0..modes.omega.len()).map(|k| (body, k))));
        order.sort_by(|a, b| each[a.0].omega[a.1].total_cmp(&each[b.0].omega[b.1]));
        self.order = order;
        let missing = || Error::Defect("modes of one of some bodies are missing on rank 0".into());
        let (rows, damping) = match self.world.is_root() {
            false => (None, None),
            true => {
                let rows = each.iter().map(|of| of.rows.as_ref()).collect::<Option<Vec<_>>>();
                let damping = self.joined_squares(&each.iter().map(|of| of.damping.as_ref()).collect::<Vec<_>>());
                (Some(self.joined_modes(&rows.ok_or_else(missing)?)), damping)
            }
        };
        let label = |one: &SeparateBody<B>, of: &ModeLabel| match &one.family {
            Some(family) => ModeLabel { order: of.order, family: family.clone() },
            None => of.on(&one.name),
        };
        let named =
            |(one, modes): (&SeparateBody<B>, &TraceModes)| modes.names.iter().map(|of| label(one, of)).collect();
        let names: Vec<Vec<ModeLabel>> = self.bodies.iter().zip(&each).map(named).collect();
        let list = |of: fn(&TraceModes) -> &Vec<f64>| self.joined_list(&each.iter().map(of).collect::<Vec<_>>());
        Ok(TraceModes {
            omega: list(|of| &of.omega),
            residual: list(|of| &of.residual),
            springs: self.joined_numbers(&each.iter().map(|of| &of.springs).collect::<Vec<_>>()),
            names: self.joined_list(&names.iter().collect::<Vec<_>>()),
            reach: each.iter().map(|of| of.reach).fold(f64::INFINITY, f64::min),
            rotation: self.joined_rotation(&each),
            rows,
            damping,
            computed: Vec::new(),
            matched: Vec::new(),
        })
    }

    fn cached_modes(&self) -> Option<CachedModes> {
        self.each().next().and_then(ElasticBody::cached_modes)
    }

    fn reuse_modes(&mut self, found: &CachedModes) {
        self.bodies.iter_mut().take(1).for_each(|one| one.body.reuse_modes(found));
    }

    fn outlines(&self) -> Result<Vec<OutlineModes>> {
        let mut all = Vec::new();
        for (body, one) in self.each().enumerate() {
            let own: Vec<usize> = (0..self.order.len()).filter(|&k| self.order[k].0 == body).collect();
            all.extend(one.outlines()?.into_iter().map(|outline| among_all(outline, &own, self.order.len())));
        }
        Ok(all)
    }

    fn infinite_rails(&self, reach: f64) -> Result<Vec<Infinite>> {
        let each = self.each().map(|body| body.infinite_rails(reach)).collect::<Result<Vec<_>>>()?;
        Ok(each.into_iter().flatten().collect())
    }

    fn response(&self, forces: &[f64]) -> Result<Vec<f64>> {
        let mut all = Vec::new();
        let mut rest = forces;
        for body in self.each() {
            // Forces are on rank 0 alone.
            let (own, others) = rest.split_at(rest.len().min(body.rows()));
            rest = others;
            all.extend(body.response(own)?);
        }
        Ok(all)
    }
}

/// An outline whose modes are those with the numbers `own` among all `count` modes.
fn among_all(outline: OutlineModes, own: &[usize], count: usize) -> OutlineModes {
    let moved = |mut order: OrderModes| {
        order.places.iter_mut().flatten().for_each(|place| *place = own[*place]);
        order
    };
    OutlineModes { orders: outline.orders.into_iter().map(moved).collect(), count, ..outline }
}

/// Pairs of near contacts of bodies one after the other, each with its number of contacts.
fn joined_pairs<'a>(each: impl Iterator<Item = (&'a [NearPair], usize)>) -> Vec<NearPair> {
    let (mut all, mut first) = (Vec::new(), 0);
    for (near, contacts) in each {
        all.extend(near.iter().map(|pair| NearPair { contacts: pair.contacts.map(|c| first + c), ..*pair }));
        first += contacts;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swept::Outline;

    #[test]
    fn modes_on_an_outline_move_to_their_places_among_all() {
        let order = |order: usize, places: Vec<Vec<usize>>| OrderModes { order, motion: Mat::zeros(2, 2), places };
        let outline = Outline { nodes: vec![0], edges: Vec::new() };
        let alone =
            OutlineModes { outline, orders: vec![order(0, vec![vec![2]]), order(3, vec![vec![0], vec![1]])], count: 3 };
        let found = among_all(alone, &[1, 2, 5], 7);
        let places: Vec<_> = found.orders.iter().map(|of| (of.order, of.places.clone())).collect();
        assert_eq!((found.count, places), (7, vec![(0, vec![vec![5]]), (3, vec![vec![1], vec![2]])]));
    }
}
