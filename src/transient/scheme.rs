//! The θ-method on modal velocities.

use super::coupled::Coupled;
use super::dynamics::Dynamics;
use super::model::{Impact, Model};
use crate::dense::{dot, sum_over};
use crate::model::ModalMatrix;
use crate::{Error, Result};
use faer::{Mat, Scale};

/// Largest h ω of a kept mode: 2π steps to its period. The frequency of the scheme is low by the share (hω)²/12, 8 %
/// at this limit.
pub const LIMIT: f64 = 1.0;

/// Step and weight of the θ-method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scheme {
    /// Step h, s.
    pub step: f64,
    /// θ in [½, 1]: ½ conserves energy and is of second order.
    pub theta: f64,
}

impl Scheme {
    /// Refuses what cannot be integrated: θ outside [½, 1], a step too long for the highest of the `omega` (rad/s).
    pub fn check(&self, omega: &[f64]) -> Result<()> {
        if !(0.5..=1.0).contains(&self.theta) {
            return Err(Error::Job(format!(
                "analyses.transient.theta is {}: it must lie in [0.5, 1]; below 0.5 the scheme is unstable",
                self.theta
            )));
        }
        if !(self.step > 0.0 && self.step.is_finite()) {
            return Err(Error::Job(format!("analyses.transient.step is {} s: it must be positive", self.step)));
        }
        let highest = omega.iter().copied().fold(0.0, f64::max);
        if self.step * highest > LIMIT {
            return Err(Error::Job(format!(
                "analyses.transient.step is {:.4e} s, too long for the highest mode kept, {:.1} Hz: the limit \
                 is {:.4e} s, \
                 2π steps to its period; take a shorter step or fewer modes",
                self.step,
                highest / (2.0 * std::f64::consts::PI),
                LIMIT / highest
            )));
        }
        Ok(())
    }

    /// Damping that the scheme adds to a motion of angular frequency `omega` (rad/s), 1/s: (θ − ½) ω² h. Half of it
    /// comes from the force, half from the velocity, both of which are weighed with θ.
    pub(crate) fn own_damping(&self, omega: f64) -> f64 {
        (self.theta - 0.5) * omega * omega * self.step
    }
}

/// The scheme on the modes of a model.
#[derive(Debug, Clone)]
pub struct Modal {
    h: f64,
    theta: f64,
    /// Weight of the reaction at the end of the step in the force that the modes feel.
    gamma: f64,
    load: Vec<f64>,
    motion: Modes,
}

/// How the modes move; with A = I + hθC + h²θ²K.
#[derive(Debug, Clone)]
enum Modes {
    /// Each by itself, with ω² and its damping; the last is 1/A.
    ModeComplement { stiffness: Vec<f64>, damping: Vec<f64>, inverse: Vec<f64> },
    /// All of a body together.
    Coupled(Box<Coupled>),
}

impl Modal {
    /// Coefficients for `model`.
    pub fn new(model: &Model, scheme: Scheme, impact: Impact) -> Result<Self> {
        let load = if model.load.is_empty() { vec![0.0; model.omega.len()] } else { model.load.to_vec() };
        let (h, theta) = (scheme.step, scheme.theta);
        let gamma = match impact {
            Impact::Compliant => theta,
            Impact::Rigid => 1.0,
        };
        let motion = match (&model.stiffness, &model.damping) {
            (ModalMatrix::Diagonal(k), ModalMatrix::Diagonal(c)) => Modes::ModeComplement {
                stiffness: k.clone(),
                damping: c.clone(),
                inverse: k.iter().zip(c).map(|(w, c)| 1.0 / (1.0 + h * theta * (c + h * theta * w))).collect(),
            },
            _ => Modes::Coupled(Box::new(Coupled::new(model, scheme, gamma)?)),
        };
        Ok(Self { h, theta, gamma, load, motion })
    }

    /// (q, v) at the end of a step from `q`, `v` under the `force` at its beginning, `[m]`.
    fn end(&self, q: &[f64], v: &[f64], force: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
        let (h, theta) = (self.h, self.theta);
        let change: Vec<f64> = match &self.motion {
            Modes::ModeComplement { stiffness, damping, inverse } => (0..q.len())
                .map(|k| h * inverse[k] * (force[k] - damping[k] * v[k] - stiffness[k] * (q[k] + theta * h * v[k])))
                .collect(),
            Modes::Coupled(coupled) => coupled.change(force, q, v),
        };
        let q = q.iter().zip(v).zip(&change).map(|((q, v), change)| q + h * (v + theta * change)).collect();
        (q, v.iter().zip(&change).map(|(v, change)| v + change).collect())
    }
}

impl Dynamics for Modal {
    /// W = S + θh²γ Ψ A⁻¹ Ψᵀ, m/N, `[3n, 3n]`, with the symmetric part of A⁻¹; what the skew one does is in
    /// [`lag`](Self::lag).
    fn operator(&self, model: &Model) -> Mat<f64> {
        let (h, theta) = (self.h, self.theta);
        let scaled = match &self.motion {
            Modes::ModeComplement { inverse, .. } => {
                let root: Vec<f64> = inverse.iter().map(|a| (h * theta * (h * self.gamma * a)).sqrt()).collect();
                Mat::from_fn(model.modes.nrows(), root.len(), |i, k| model.modes[(i, k)] * root[k])
            }
            Modes::Coupled(coupled) => faer::Scale((h * theta * (h * self.gamma)).sqrt()) * coupled.half(model.modes),
        };
        model.residual + &scaled * scaled.transpose()
    }

    /// The step without the reaction at its end, from displacements `q`, velocities `v` and the modal reactions at
    /// its beginning `f` (all `[m]`): (q, v) at the end.
    fn free(&mut self, q: &[f64], v: &[f64], f: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
        let force = self.load.iter().zip(f).map(|(load, f)| load + (1.0 - self.gamma) * f).collect();
        Ok(self.end(q, v, force))
    }

    fn free_changes(&self, [q, v, f]: [&Mat<f64>; 3]) -> Option<[Mat<f64>; 3]> {
        let (h, theta, part) = (self.h, self.theta, 1.0 - self.gamma);
        let ends = |change: Mat<f64>| [q + Scale(h) * (v + Scale(theta) * &change), v + change];
        Some(match &self.motion {
            Modes::ModeComplement { stiffness, damping, inverse } => {
                let change = Mat::from_fn(q.nrows(), q.ncols(), |k, c| {
                    let (q, v) = (q[(k, c)], v[(k, c)]);
                    let force = part * f[(k, c)] - damping[k] * v - stiffness[k] * (q + theta * h * v);
                    h * inverse[k] * force
                });
                let [q, v] = ends(change);
                [q.clone(), v, q]
            }
            Modes::Coupled(coupled) => {
                let [q, v] = ends(coupled.changes(Scale(part) * f, q, v));
                let seen = coupled.lags(f).map_or_else(|| q.clone(), |lag| &q + lag);
                [q, v, seen]
            }
        })
    }

    fn add_changes(&self, f: &Mat<f64>, [q, v]: [&mut Mat<f64>; 2]) {
        let gain = self.h * self.gamma;
        let change = match &self.motion {
            Modes::ModeComplement { inverse, .. } => {
                Mat::from_fn(f.nrows(), f.ncols(), |k, c| gain * inverse[k] * f[(k, c)])
            }
            Modes::Coupled(coupled) => Scale(gain) * coupled.solved_columns(f),
        };
        *q += Scale(self.h * self.theta) * &change;
        *v += change;
    }

    /// Modal displacements that the skew part of A⁻¹, which [`operator`](Self::operator) leaves out, makes of modal
    /// reactions: displacements of the modes, m √kg, `[m]`; none where there is no such part. The steps take it from
    /// the reactions at their beginning, which changes the contact by less than the scheme's own error.
    fn lag(&self, f: &[f64]) -> Option<Vec<f64>> {
        match &self.motion {
            Modes::ModeComplement { .. } => None,
            Modes::Coupled(coupled) => coupled.lag(f),
        }
    }

    /// Adds what the modal reactions at the end of the step, `f`, do: to the velocities hγ A⁻¹ f, to the
    /// displacements θh times that.
    fn add(&self, f: &[f64], q: &mut [f64], v: &mut [f64]) {
        let (h, theta) = (self.h, self.theta);
        match &self.motion {
            Modes::ModeComplement { inverse, .. } => {
                for k in 0..q.len() {
                    let gain = h * self.gamma * inverse[k];
                    q[k] += h * theta * gain * f[k];
                    v[k] += gain * f[k];
                }
            }
            Modes::Coupled(coupled) => {
                for (k, a) in coupled.solved(f).into_iter().enumerate() {
                    let change = h * self.gamma * a;
                    q[k] += h * theta * change;
                    v[k] += change;
                }
            }
        }
    }

    /// Weight γ of the reaction at the end of the step in the mean force of the step.
    fn gamma(&self) -> f64 {
        self.gamma
    }

    /// Kinetic energy of the modes, J.
    fn kinetic(&self, v: &[f64]) -> f64 {
        0.5 * dot(v, v)
    }

    /// Elastic energy of the modes, J.
    fn elastic(&self, q: &[f64]) -> f64 {
        match &self.motion {
            Modes::ModeComplement { stiffness, .. } => 0.5 * sum_over(q.len(), |k| stiffness[k] * q[k] * q[k]),
            Modes::Coupled(coupled) => coupled.elastic(q),
        }
    }

    /// Energy that damping takes in a step, and the part of it that the axles of bodies that rotate supply, J;
    /// between the ends (q, v) of the step.
    fn damped(&self, before: (&[f64], &[f64]), after: (&[f64], &[f64])) -> (f64, f64) {
        match &self.motion {
            Modes::ModeComplement { damping, .. } => {
                let (before, after) = (before.1, after.1);
                let mean = |k: usize| (1.0 - self.theta) * before[k] + self.theta * after[k];
                let sum = sum_over(before.len(), |k| damping[k] * mean(k) * 0.5 * (before[k] + after[k]));
                (self.h * sum, 0.0)
            }
            Modes::Coupled(coupled) => coupled.damped(before, after),
        }
    }

    /// Work of the loads in a step, J.
    fn loaded(&self, before: &[f64], after: &[f64]) -> f64 {
        sum_over(before.len(), |k| self.load[k] * (after[k] - before[k]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Interface;

    const OMEGA: f64 = 3000.0;

    /// Angular frequency and decay rate, 1/s, of one free mode under the scheme, from its phase q + i v/ω; with its
    /// own damping c, 1/s.
    fn free_motion(scheme: Scheme, c: f64) -> (f64, f64) {
        let interface = Interface::new(vec![-1.0, 0.0, 1.0], vec![-1.0, 0.0, 1.0], vec![1.0; 9]).unwrap();
        let (residual, modes) = (Mat::<f64>::zeros(27, 27), Mat::<f64>::zeros(27, 1));
        let model = Model {
            interface: &interface,
            residual: residual.as_ref(),
            modes: modes.as_ref(),
            omega: &[OMEGA],
            stiffness: vec![OMEGA * OMEGA].into(),
            damping: vec![c].into(),
            load: &[],
            turning: None,
            carried: None,
        };
        let mut modal = Modal::new(&model, scheme, Impact::Compliant).unwrap();
        let (mut q, mut v) = (vec![1.0], vec![0.0]);
        let (mut turned, mut last) = (0.0, 0.0);
        let steps = 1000;
        for _ in 0..steps {
            (q, v) = modal.free(&q, &v, &[0.0]).unwrap();
            let angle = (-v[0] / OMEGA).atan2(q[0]);
            turned += (angle - last).rem_euclid(2.0 * std::f64::consts::PI);
            last = angle;
        }
        let time = steps as f64 * scheme.step;
        let energy = 0.5 * (q[0] * q[0] + (v[0] / OMEGA).powi(2));
        (turned / time, -0.5 * (2.0 * energy).ln() / time)
    }

    #[test]
    fn a_free_mode_is_slow_and_damped_as_documented() {
        let step = 1e-5;
        for theta in [0.5, 0.51, 0.6, 1.0] {
            let scheme = Scheme { step, theta };
            let (omega, decay) = free_motion(scheme, 0.0);
            let low = 1.0 - omega / OMEGA;
            // Of the next order, (hω)² = 1e-3.
            let own = scheme.own_damping(OMEGA);
            assert!((decay - own).abs() < 2e-3 * own + 1e-9, "θ = {theta}: decay {decay}, expected {own}");
            if theta == 0.5 {
                let want = (step * OMEGA).powi(2) / 12.0;
                assert!((low / want - 1.0).abs() < 0.02, "frequency low by {low:e}, expected {want:e}");
            }
        }
    }

    #[test]
    fn a_step_may_take_a_radian_of_the_highest_mode_and_no_more() {
        let check = |omega: f64| Scheme { step: 1e-3, theta: 0.5 }.check(&[10.0, omega, 20.0]);
        assert!(check(999.0).is_ok());
        let error = check(1001.0).unwrap_err();
        assert!(error.exit_code() == 2 && error.message().contains("the limit is 9.9900e-4 s"), "{error}");
    }

    #[test]
    fn damping_takes_half_its_coefficient_of_the_amplitude() {
        let (_, decay) = free_motion(Scheme { step: 1e-5, theta: 0.5 }, 40.0);
        assert!((decay - 20.0).abs() < 0.2, "decay {decay}");
    }
}
