//! The gap of the undeformed bodies at both ends of a step: roughness travels through it.

use crate::grid::{ContactPatch, Interface};
use crate::roughness::RoughSurfaces;
use crate::{Error, Result};
use std::ops::Range;

/// Gaps, m, `[n]` each. They follow from the number of the step alone, so that a run that is continued finds the same.
pub(super) struct RoughnessGap {
    /// Rough surfaces of each patch; none of smooth bodies.
    surfaces: Vec<RoughPatch>,
    /// At the beginning of the step.
    pub(super) before: Vec<f64>,
    /// At its end.
    pub(super) after: Vec<f64>,
    /// Number of the step that `after` is the end of.
    ahead: Option<u64>,
}

/// Rough surfaces of a patch.
struct RoughPatch {
    surfaces: RoughSurfaces,
    /// Lines of the grid along x, m.
    x: Vec<f64>,
    /// Gap of the smooth bodies, m, `[nx ny]`.
    smooth: Vec<f64>,
    /// Its nodes.
    nodes: Range<usize>,
}

impl RoughnessGap {
    /// Smooth bodies.
    pub(super) fn smooth(interface: &Interface) -> Self {
        Self { surfaces: Vec::new(), before: interface.gap.clone(), after: interface.gap.clone(), ahead: None }
    }

    /// The same bodies with rough surfaces, `[patches]`.
    pub(super) fn rough(interface: &Interface, surfaces: Vec<RoughSurfaces>) -> Result<Self> {
        let (given, patches) = (surfaces.len(), &interface.patches);
        if given != patches.len() {
            return Err(Error::Defect(format!("rough surfaces of {given} contacts on {} patches", patches.len())));
        }
        let of = |(surfaces, patch): (RoughSurfaces, &ContactPatch)| {
            let nodes = patch.nodes();
            RoughPatch { surfaces, x: patch.x.clone(), smooth: interface.gap[nodes.clone()].to_vec(), nodes }
        };
        Ok(Self { surfaces: surfaces.into_iter().zip(patches).map(of).collect(), ..Self::smooth(interface) })
    }

    /// Returns whether the gap changes from step to step.
    pub(super) fn is_rough(&self) -> bool {
        !self.surfaces.is_empty()
    }

    /// Goes to the step of the length `h` (s) that begins after `step` others.
    pub(super) fn go(&mut self, step: u64, h: f64) {
        if self.surfaces.is_empty() {
            return;
        }
        let at = |step: u64, gap: &mut [f64]| {
            for RoughPatch { surfaces, x, smooth, nodes } in &self.surfaces {
                surfaces.travel(step as f64 * h, x, smooth, &mut gap[nodes.clone()]);
            }
        };
        if self.ahead == Some(step) {
            std::mem::swap(&mut self.before, &mut self.after);
        } else {
            at(step, &mut self.before);
        }
        at(step + 1, &mut self.after);
        self.ahead = Some(step + 1);
    }

    /// By how much the surfaces at node `i` come nearer to each other over the step, m.
    pub(super) fn raised(&self, i: usize) -> f64 {
        self.before[i] - self.after[i]
    }
}
