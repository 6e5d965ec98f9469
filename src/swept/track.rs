//! Track under a rail: pads along the whole foot, and under them sleepers on ballast, all spread evenly along the
//! track.
//!
//! A layer has springs and dashpots, which are the viscous equivalent of a loss factor η at the angular frequency
//! ω_c: c = ηs/ω_c. The sleeper moves along the three axes, without turning.

use super::forms::Springs;
use super::CrossSection;
use crate::{Error, Result};

/// A layer of springs and dashpots; vertical, longitudinal, lateral.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackLayer {
    /// Stiffness of each metre of track, N/m².
    pub stiffness: [f64; 3],
    /// Viscosity of each metre of track, N·s/m².
    pub viscosity: [f64; 3],
}

impl TrackLayer {
    /// The layer of this stiffness, N/m², whose dashpots have the loss factor `loss` where each direction with the
    /// mass `mass`, kg/m, on it resonates.
    pub fn with_loss(stiffness: [f64; 3], loss: f64, mass: f64) -> Self {
        Self { stiffness, viscosity: stiffness.map(|s| loss * (s * mass).sqrt()) }
    }
}

/// Sleepers and ballast, spread along the track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SleeperLayer {
    /// Mass under one rail, kg/m.
    pub mass: f64,
    /// Ballast.
    pub ballast: TrackLayer,
}

/// Track under a rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RailTrack {
    /// Between foot and sleeper, or foot and ground.
    pub pad: TrackLayer,
    /// Sleepers; none: the pads lie on the ground.
    pub sleeper: Option<SleeperLayer>,
}

/// The vertical, longitudinal and lateral direction of the upright section, each by (U, V, W) of one that is turned by
/// `tilt`, rad, from it, from y to z.
pub(super) fn axes(tilt: f64) -> [[f64; 3]; 3] {
    let (s, c) = tilt.sin_cos();
    [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]
}

/// diag(vertical, longitudinal, lateral) for (U, V, W) of a section that is turned by `tilt`, rad, from the upright
/// one, from y to z.
fn turned(stiffness: [f64; 3], tilt: f64) -> [[f64; 3]; 3] {
    let along = axes(tilt);
    let entry = |i: usize, j: usize| (0..3).map(|d| stiffness[d] * along[d][i] * along[d][j]).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

/// Springs and dashpots of a layer.
pub(super) fn block(layer: &TrackLayer, tilt: f64) -> Springs {
    Springs { stiffness: turned(layer.stiffness, tilt), viscosity: turned(layer.viscosity, tilt) }
}

/// Matrices that a track adds to the matrices of a section: blocks at pairs of nodes, and the sleeper's mass.
pub(super) struct TrackMatrices {
    /// Node, node, springs and dashpots of each metre between what the first and the second of them move.
    pub blocks: Vec<(usize, usize, Springs)>,
    /// Node of the sleeper and its mass, kg/m.
    pub mass: Option<(usize, f64)>,
}

impl RailTrack {
    /// Motions of its own at each order: those of the sleepers.
    pub fn motions(&self) -> usize {
        self.sleeper.map_or(0, |_| 3)
    }

    /// Terms that the track adds to `section`, which is turned by `tilt`, rad, from the upright one, under all of its
    /// group `foot`. A sleeper becomes another node.
    pub(super) fn added(&self, section: &mut CrossSection, tilt: f64) -> Result<TrackMatrices> {
        let edges = section.edges("foot");
        let length: f64 = edges.iter().flat_map(|e| section.along(e)).map(|(_, step)| step).sum();
        if !(length > 0.0) {
            return Err(Error::Defect("a section on a track has no edges in its group \"foot\"".into()));
        }
        let pad = block(&self.pad, tilt);
        let sleeper = self.sleeper.map(|s| {
            section.nodes.push([0.0, 0.0]);
            (section.nodes.len() - 1, s)
        });
        let mut blocks = Vec::new();
        for edge in &edges {
            for (values, step) in section.along(edge) {
                let share = step / length;
                for (&a, va) in edge.iter().zip(values) {
                    for (&b, vb) in edge.iter().zip(values) {
                        blocks.push((a, b, pad.times(share * va * vb)));
                    }
                    if let Some((s, _)) = sleeper {
                        blocks.push((a, s, pad.times(-share * va)));
                        blocks.push((s, a, pad.times(-share * va)));
                    }
                }
            }
        }
        if let Some((s, SleeperLayer { ballast, .. })) = sleeper {
            blocks.push((s, s, pad));
            blocks.push((s, s, block(&ballast, tilt)));
        }
        Ok(TrackMatrices { blocks, mass: sleeper.map(|(s, sleeper)| (s, sleeper.mass)) })
    }
}
