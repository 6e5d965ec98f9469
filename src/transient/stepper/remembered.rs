//! The coefficient of friction that the material at the nodes remembers, from step to step.

use super::super::departure_point::DeparturePoint;
use super::super::problem::StepSolution;
use super::Stepper;
use crate::contact::law::{size, Status};
use crate::friction::{PatchFriction, Remembered};
use crate::grid::Interface;

/// The coefficients of friction at rest of the nodes of an interface, `[n]`.
pub(super) fn at_rest(friction: &PatchFriction, s: &Interface) -> Vec<f64> {
    (0..s.len()).map(|i| friction.law(s.patch_of(i)).coefficient(0.0)).collect()
}

impl Stepper<'_> {
    /// Memory of friction of the core nodes before the step, `[core]`; nothing where friction is constant. The material
    /// of a node comes from its foot: where that lies between the node and the one upstream, in the course between the
    /// two; further away, in a straight line between two others.
    pub(super) fn remembered(&self) -> Vec<Remembered> {
        let mu = &self.state.friction;
        if mu.is_empty() {
            return Vec::new();
        }
        let step = self.settings.scheme.step;
        let of = |(&i, &(line, foot)): (&usize, &(usize, DeparturePoint))| {
            let x = &self.model.interface.place(i).0.x;
            let speed = self.settings.drive.patches[self.model.interface.patch_of(i)].speed;
            let came = |upstream: f64| Remembered { own: upstream, upstream, step, passage: step };
            match foot {
                DeparturePoint::Node(at) if line + at == i => {
                    Remembered { own: mu[i], upstream: mu[i], step, passage: f64::INFINITY }
                }
                DeparturePoint::Node(at) => came(mu[line + at]),
                DeparturePoint::Between { left, .. } if line + left + 1 == i => {
                    Remembered { own: mu[i], upstream: mu[i - 1], step, passage: (x[left + 1] - x[left]) / speed }
                }
                DeparturePoint::Between { left, travel } => {
                    let way = travel / (x[left + 1] - x[left]);
                    came((1.0 - way) * mu[line + left + 1] + way * mu[line + left])
                }
            }
        };
        self.working.nodes[..self.working.core].iter().zip(&self.working.feet).map(of).collect()
    }

    /// The coefficients after a step, whose slip is met: what is open, and comes in next, has that at rest.
    pub(super) fn renew_friction(&mut self, solution: &StepSolution) {
        if self.state.friction.is_empty() {
            return;
        }
        let friction = &self.settings.friction;
        self.state.friction = at_rest(friction, self.model.interface);
        let renewed = || {
            let velocity = |slip: &[f64]| size([slip[0], slip[1]]) / self.settings.scheme.step;
            let v: Vec<f64> = self.met.slip.chunks_exact(2).map(velocity).collect();
            friction.renewed_with_slopes(&self.working.patch, &self.before, &v).0
        };
        let found = match solution.friction.len() == self.met.nodes.len() {
            true => &solution.friction,
            false => &renewed(),
        };
        for ((&i, mu), _) in self.met.nodes.iter().zip(found).zip(&solution.status).filter(|n| *n.1 != Status::Open) {
            self.state.friction[i] = *mu;
        }
    }
}
