//! The gap of the undeformed bodies at both ends of a step: roughness travels through it.

use crate::grid::Interface;
use crate::roughness::RoughSurfaces;
use crate::Result;

/// Gaps, m, `[n]` each. They follow from the number of the step alone, so that a run that is continued finds the same.
pub(super) struct RoughnessGap {
    /// Rough surfaces, the lines of the grid along x, m, and the gap of the smooth bodies, m, `[n]`.
    surface: Option<(RoughSurfaces, Vec<f64>, Vec<f64>)>,
    /// At the beginning of the step.
    pub(super) before: Vec<f64>,
    /// At its end.
    pub(super) after: Vec<f64>,
    /// Number of the step that `after` is the end of.
    ahead: Option<u64>,
}

impl RoughnessGap {
    /// Smooth bodies.
    pub(super) fn smooth(interface: &Interface) -> Self {
        Self { surface: None, before: interface.gap.clone(), after: interface.gap.clone(), ahead: None }
    }

    /// The same bodies with rough surfaces.
    pub(super) fn rough(interface: &Interface, surface: RoughSurfaces) -> Result<Self> {
        let x = interface.single("contact.roughness")?.x.clone();
        Ok(Self { surface: Some((surface, x, interface.gap.clone())), ..Self::smooth(interface) })
    }

    /// Returns whether the gap changes from step to step.
    pub(super) fn is_rough(&self) -> bool {
        self.surface.is_some()
    }

    /// Goes to the step of the length `h` (s) that begins after `step` others.
    pub(super) fn go(&mut self, step: u64, h: f64) {
        let Some((surface, x, smooth)) = &self.surface else { return };
        let at = |step: u64, gap: &mut Vec<f64>| surface.travel(step as f64 * h, x, smooth, gap);
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
