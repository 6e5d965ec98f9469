//! Memory of friction in a steady contact: the coefficient of friction at each node, and how small motions change it.

use super::interface::PatchKinematics;
use super::law::size;
use crate::friction::{FrictionLaw, PatchFriction, Relaxation};
use crate::grid::{ContactPatch, Interface};

/// The coefficient of friction at the nodes of an interface, `[n]`: along each line of the grid from the leading edge
/// on, at the rolling speeds of `kinematics`, `[patches]`, where `velocity` (m/s) is that of the sliding at the
/// `closed` nodes. Open nodes have the coefficient at rest.
pub(super) fn coefficients(
    friction: &PatchFriction,
    s: &Interface,
    kinematics: &[PatchKinematics],
    closed: impl Fn(usize) -> bool,
    velocity: impl Fn(usize) -> f64,
) -> Vec<f64> {
    let mut mu: Vec<f64> = Vec::with_capacity(s.len());
    for (c, (patch, rolling)) in s.patches.iter().zip(kinematics).enumerate() {
        let law = friction.law(c);
        let at_rest = law.coefficient(0.0);
        for i in patch.nodes() {
            let (ix, _) = patch.indices(i);
            let before = if ix == 0 { at_rest } else { mu[i - 1] };
            let passage = || if s.are_points() { f64::INFINITY } else { passage(patch, rolling.speed, ix) };
            mu.push(if closed(i) { law.passed(before, velocity(i), passage()) } else { at_rest });
        }
    }
    mu
}

/// Time that the material takes from the grid column upstream to the column `ix`, s.
fn passage(patch: &ContactPatch, speed: f64, ix: usize) -> f64 {
    let ix = ix.max(1);
    (patch.x[ix] - patch.x[ix - 1]) / speed
}

/// The coefficient at a closed node about a steady state: λ δμ = −decay δμ + upstream δμ(upstream) + gain τ·(λ + V
/// ∂x) δw, which changes the traction by −p τ δμ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearMemory {
    /// Place of the node in the list of closed ones.
    pub at: usize,
    /// Direction of sliding τ, a unit vector.
    pub direction: [f64; 2],
    /// Pressure p, N; 0 where the node sticks, whose traction does not follow the coefficient.
    pub force: f64,
    /// Rates of change, 1/s and 1/m.
    pub relaxation: Relaxation,
    /// Place of the node upstream in the list of these; none where it is open.
    pub upstream: Option<usize>,
}

/// A closed node of a steady contact and how it slides.
#[derive(Clone, Copy)]
pub(super) struct SlidingNode {
    /// Node of the interface.
    pub node: usize,
    /// Creep, m/s; zero where it sticks.
    pub creep: [f64; 2],
    /// Pressure, N.
    pub force: f64,
    /// Coefficient of friction.
    pub friction: f64,
}

/// The memories of the closed `nodes`, ascending, of an interface whose patches roll as `kinematics` says. Nodes in
/// stick take part where nodes upstream of them slide: they hand on what these have changed.
pub(super) fn linear(
    friction: &PatchFriction,
    s: &Interface,
    kinematics: &[PatchKinematics],
    nodes: &[SlidingNode],
) -> Vec<LinearMemory> {
    let mut memories: Vec<LinearMemory> = Vec::new();
    for (at, n) in nodes.iter().enumerate() {
        let v = size(n.creep);
        let (patch, ix, _) = s.place(n.node);
        // At a point the material stays for ever.
        let passage = match s.are_points() {
            true => f64::INFINITY,
            false => passage(patch, kinematics[s.patch_of(n.node)].speed, ix),
        };
        let upstream = memories
            .last()
            .filter(|m| !s.are_points() && nodes[m.at].node + 1 == n.node && ix > 0)
            .map(|_| memories.len() - 1);
        let sliding = v > 0.0;
        let law = friction.law(s.patch_of(n.node));
        let Some(mut relaxation) = law.relaxation(n.friction, v, passage) else { continue };
        if !sliding {
            if upstream.is_none() {
                continue;
            }
            relaxation.gain = 0.0;
        }
        let (direction, force) = if sliding { (n.creep.map(|c| c / v), n.force) } else { ([0.0; 2], 0.0) };
        memories.push(LinearMemory { at, direction, force, relaxation, upstream });
    }
    memories
}

impl LinearMemory {
    /// Memory of a contact that does not roll: a body that slides along `direction` at `velocity` (m/s) under `force`
    /// (N) with the place `at` in the list of contacts. None where the law has no memory.
    pub fn at_a_point(law: &FrictionLaw, at: usize, direction: [f64; 2], force: f64, velocity: f64) -> Option<Self> {
        let relaxation = law.relaxation(law.coefficient(velocity), velocity, f64::INFINITY)?;
        Some(Self { at, direction, force, relaxation, upstream: None })
    }

    /// Its numbers, for [`super::LinearContact::numbers`].
    pub(super) fn numbers(&self) -> [f64; 8] {
        let Relaxation { decay, upstream, gain } = self.relaxation;
        let [x, y] = self.direction;
        [self.at as f64, x, y, self.force, decay, upstream, gain, self.upstream.map_or(-1.0, |u| u as f64)]
    }

    /// Restores the memory from the output of [`LinearMemory::numbers`].
    pub(super) fn from_numbers(&[at, x, y, force, decay, upstream, gain, from]: &[f64; 8]) -> Self {
        Self {
            at: at as usize,
            direction: [x, y],
            force,
            relaxation: Relaxation { decay, upstream, gain },
            upstream: (from >= 0.0).then_some(from as usize),
        }
    }
}
