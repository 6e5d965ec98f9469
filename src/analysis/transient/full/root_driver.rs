//! The two bodies of the full model on all ranks, and how rank 0, which has the contact, leads them.
//!
//! The steps are made on rank 0. What they ask of the bodies is collective: rank 0 says what comes next, the others
//! listen ([`BodyPair::serve`]).

use crate::body::full_order_integrator::{Energies, FullOrderIntegrator};
use crate::body::{Fields, Side};
use crate::parallel::World;
use crate::stop::Stop;
use crate::transient::{Dynamics, Model};
use crate::{Error, Result};
use faer::Mat;
use std::cell::RefCell;
use std::rc::Rc;

/// Next collective action of the ranks.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    /// A step begins.
    Free,
    /// It ends with the reactions of the contact.
    Push,
    /// The state goes to rank 0.
    Save,
    /// Has a signal come to one of the ranks?
    Heed,
    /// The run is over.
    End,
}

const ORDERS: [Order; 5] = [Order::Free, Order::Push, Order::Save, Order::Heed, Order::End];

/// One of the two bodies.
pub(super) struct RootHalf<'a> {
    pub(super) moving: FullOrderIntegrator<'a>,
    pub(super) side: Side,
    pub(super) fields: &'a dyn Fields,
    /// First degree of freedom of each rank, `[size + 1]`.
    pub(super) ranges: &'a [u64],
    /// Its modes, whose amplitudes are written; none where they are not.
    pub(super) modes: &'a [Vec<f64>],
}

/// A node whose motion is written: the place of its body, and the node on the rank that owns it.
pub(super) type WatchedNode = (usize, Option<usize>);

/// The two bodies, the lower one first.
pub(super) struct BodyPair<'a> {
    pub(super) world: &'a World,
    pub(super) halves: Vec<RootHalf<'a>>,
    pub(super) watched: Vec<WatchedNode>,
    pub(super) stop: &'a Stop,
}

impl BodyPair<'_> {
    /// Collective: displacements and velocities of the contact rows (w, change of gap), then of the watched nodes (x,
    /// y, z), m and m/s, then amplitudes of the modes, on rank 0.
    pub(super) fn rows(&self) -> [Vec<f64>; 2] {
        let mut both = joined(&self.halves, |half| half.moving.at_contact());
        for (k, rows) in both.iter_mut().enumerate() {
            let mut more = vec![0.0; 3 * self.watched.len()];
            // None of them, and nothing is asked of the meshes.
            for (place, half) in self.halves.iter().enumerate() {
                if self.watched.iter().all(|w| w.0 != place) {
                    continue;
                }
                let (u, v) = half.moving.state();
                let at = half.fields.at_nodes([u, v][k]);
                for ((_, node), out) in self.watched.iter().zip(more.chunks_exact_mut(3)).filter(|(w, _)| w.0 == place)
                {
                    let Some(node) = node else { continue };
                    (0..3).for_each(|c| out[c] = half.side.reflection(c) * at[*node][c]);
                }
            }
            rows.extend(self.world.sum_all(&more));
        }
        for half in self.halves.iter().filter(|half| !half.modes.is_empty()) {
            let shares = half.moving.amplitudes(half.modes);
            both.iter_mut().zip(shares).for_each(|(rows, shares)| rows.extend(shares));
        }
        both
    }

    /// Number of rows that [`rows`](Self::rows) has beyond the contact rows.
    fn beyond(&self) -> usize {
        3 * self.watched.len() + self.halves.iter().map(|half| half.modes.len()).sum::<usize>()
    }

    /// Collective.
    fn free(&mut self) -> Result<[Vec<f64>; 2]> {
        let found = self.halves.iter_mut().map(|half| half.moving.free()).collect::<Result<Vec<_>>>()?;
        let mut found = found.into_iter();
        let mut both = joined(&self.halves, |_| found.next().unwrap_or_default());
        both.iter_mut().for_each(|rows| rows.resize(rows.len() + self.beyond(), 0.0));
        Ok(both)
    }

    /// Collective: under the reactions of rank 0, N, `[3n]`.
    fn push(&mut self, reaction: &[f64]) -> Result<Energies> {
        let mut sum = Energies::default();
        for half in &mut self.halves {
            let e = half.moving.push(&half.side.orient(reaction))?;
            sum.kinetic += e.kinetic;
            sum.elastic += e.elastic;
            sum.damped += e.damped;
        }
        Ok(sum)
    }

    /// Collective: displacements and velocities of all degrees of freedom of each body, on rank 0.
    fn save(&self) -> Vec<[Vec<f64>; 2]> {
        let whole = |half: &RootHalf| {
            let (u, v) = half.moving.state();
            [self.world.gather(u), self.world.gather(v)]
        };
        self.halves.iter().map(whole).collect()
    }

    /// Collective: what rank 0 orders, the same on every rank.
    fn order(&self, order: Order) -> Order {
        let said = self.world.broadcast(vec![order as u64])[0] as usize;
        ORDERS.get(said).copied().unwrap_or(Order::End)
    }

    /// On the other ranks: does what rank 0 orders, until the run is over. Rank 0 has the errors too, and ends the run.
    pub(super) fn serve(mut self) {
        loop {
            match self.order(Order::End) {
                Order::Free => drop(self.free()),
                Order::Push => {
                    if self.push(&[]).is_ok() {
                        self.rows();
                    }
                }
                Order::Save => drop(self.save()),
                Order::Heed => drop(self.stop.wanted(self.world)),
                Order::End => return,
            }
        }
    }
}

/// The rows of both bodies: displacement of the lower against the upper one along the surface, and change of the gap.
fn joined<'a, 'h>(
    halves: &'h [RootHalf<'a>],
    mut rows: impl FnMut(&'h RootHalf<'a>) -> [Vec<f64>; 2],
) -> [Vec<f64>; 2] {
    let mut sum: [Vec<f64>; 2] = Default::default();
    for half in halves {
        for (sum, rows) in sum.iter_mut().zip(rows(half)) {
            sum.resize(rows.len(), 0.0);
            sum.iter_mut().zip(rows).enumerate().for_each(|(i, (s, r))| *s += half.side.sign(i) * r);
        }
    }
    sum
}

/// The bodies as rank 0 leads them.
pub(super) struct RootDriver<'a> {
    pair: BodyPair<'a>,
    /// W of both bodies, m/N, `[3n, 3n]`.
    influence: Mat<f64>,
    /// θh, s.
    lead: f64,
    energies: Energies,
}

impl<'a> RootDriver<'a> {
    /// On rank 0: the `pair` with its W at the energies `energies`; `lead` is θh, s.
    pub(super) fn new(pair: BodyPair<'a>, influence: Mat<f64>, lead: f64, energies: Energies) -> Self {
        Self { pair, influence, lead, energies }
    }

    /// All degrees of freedom of each body: displacements and velocities.
    pub(super) fn save(&self) -> Vec<[Vec<f64>; 2]> {
        self.pair.order(Order::Save);
        self.pair.save()
    }

    /// Returns whether a signal came to one of the ranks.
    pub(super) fn heed(&self) -> bool {
        self.pair.order(Order::Heed);
        self.pair.stop.wanted(self.pair.world)
    }

    /// First degree of freedom of each rank, of each body.
    pub(super) fn ranges(&self) -> Vec<&'a [u64]> {
        self.pair.halves.iter().map(|half| half.ranges).collect()
    }

    /// Lets the other ranks go.
    pub(super) fn release_ranks(&self) {
        self.pair.order(Order::End);
    }
}

/// Bodies as the steps address them. Its coordinates are the contact rows, then those of the watched nodes, then the
/// amplitudes of the modes.
pub(super) struct DrivenByRoot<'a>(pub(super) Rc<RefCell<RootDriver<'a>>>);

impl Dynamics for DrivenByRoot<'_> {
    fn operator(&self, _: &Model<'_>) -> Mat<f64> {
        self.0.borrow().influence.clone()
    }

    fn free(&mut self, _: &[f64], _: &[f64], _: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
        let mut leader = self.0.borrow_mut();
        leader.pair.order(Order::Free);
        let [q, v] = leader.pair.free()?;
        Ok((q, v))
    }

    fn lag(&self, _: &[f64]) -> Option<Vec<f64>> {
        None
    }

    fn add(&self, f: &[f64], q: &mut [f64], v: &mut [f64]) {
        let leader = self.0.borrow();
        let loaded = f.iter().take(leader.influence.ncols()).enumerate().filter(|(_, f)| **f != 0.0);
        for (k, f) in loaded {
            for (i, w) in leader.influence.col(k).iter().enumerate() {
                q[i] += w * f;
                v[i] += w * f / leader.lead;
            }
        }
    }

    fn accept(&mut self, f: &[f64], q: &mut [f64], v: &mut [f64]) -> Result<()> {
        let mut leader = self.0.borrow_mut();
        let rows = leader.influence.ncols();
        let Some(reaction) = f.get(..rows) else {
            return Err(Error::Defect(format!("full transient: {} forces for {rows} contact rows", f.len())));
        };
        leader.pair.order(Order::Push);
        leader.energies = leader.pair.push(reaction)?;
        let [displaced, moving] = leader.pair.rows();
        q.copy_from_slice(&displaced);
        v.copy_from_slice(&moving);
        Ok(())
    }

    fn gamma(&self) -> f64 {
        1.0
    }

    fn kinetic(&self, _: &[f64]) -> f64 {
        self.0.borrow().energies.kinetic
    }

    fn elastic(&self, _: &[f64]) -> f64 {
        self.0.borrow().energies.elastic
    }

    fn damped(&self, _: (&[f64], &[f64]), _: (&[f64], &[f64])) -> (f64, f64) {
        (self.0.borrow().energies.damped, 0.0)
    }
}
