//! The state that stability is examined about.

use crate::contact::{PatchResultant, SlidingSolution, Status, SteadySolution};

/// A contact that rolls or slides steadily, on n nodes.
#[derive(Debug, Clone)]
pub struct Equilibrium {
    /// True if nodes that would stick are made to slide.
    pub sliding: bool,
    /// Pressure, Pa, `[n]`.
    pub pressure: Vec<f64>,
    /// Coefficient of friction, 1, `[n]`; at open nodes that at rest.
    pub friction: Vec<f64>,
    /// Contact force on body 1, N: (x, y, z). Of several patches the sum of the components.
    pub force: [f64; 3],
    /// Forces and approach of each patch, `[patches]`.
    pub patches: Vec<PatchResultant>,
    /// 0 open, 1 stick, 2 slip, `[n]`.
    pub state: Vec<u8>,
    /// Closed nodes that slide although their creep in the deformed state points backwards.
    pub reversed: usize,
}

impl Equilibrium {
    /// Number of closed nodes.
    pub fn closed(&self) -> usize {
        self.state.iter().filter(|s| **s != Status::Open as u8).count()
    }

    /// Number of nodes in stick.
    pub fn sticking(&self) -> usize {
        self.state.iter().filter(|s| **s == Status::Stick as u8).count()
    }
}

impl From<SlidingSolution> for Equilibrium {
    fn from(s: SlidingSolution) -> Self {
        let mut state = vec![Status::Open as u8; s.pressure.len()];
        s.closed.iter().for_each(|&i| state[i] = Status::Slip as u8);
        Self {
            sliding: true,
            pressure: s.pressure,
            friction: s.friction,
            force: s.force,
            patches: s.patches,
            state,
            reversed: s.reversed,
        }
    }
}

impl From<SteadySolution> for Equilibrium {
    fn from(s: SteadySolution) -> Self {
        Self {
            sliding: false,
            pressure: s.pressure,
            friction: s.friction,
            force: s.force,
            patches: s.patches,
            state: s.state,
            reversed: 0,
        }
    }
}
