//! States to start from.

use super::energy::Energy;
use super::model::Model;
use super::stepper::State;
use faer::Mat;

impl State {
    /// At rest under the nodal reactions `reaction` (tx, ty, p), N, `[3n]`, and the loads of the model; rigid-body
    /// modes are at 0. `motions` are the rigid ones, m, `[motions]`: of one patch its approach.
    pub fn at_rest(model: &Model, reaction: &[f64], motions: &[f64]) -> Self {
        let m = model.omega.len();
        let force = Mat::from_fn(m, 1, |k, _| {
            let load = model.load.get(k).copied().unwrap_or(0.0);
            load + reaction.iter().enumerate().map(|(i, r)| model.modes[(i, k)] * r).sum::<f64>()
        });
        let q = model.stiffness.statics(force.as_ref()).col(0).iter().copied().collect();
        Self {
            step: 0,
            q,
            v: vec![0.0; m],
            reaction: reaction.to_vec(),
            motions: motions.to_vec(),
            creep: [0.0; 2],
            friction: Vec::new(),
            energy: Energy::default(),
        }
    }

    /// The same, with the coefficients of friction `friction` that the material remembers, `[n]`.
    pub fn remembering(self, friction: &[f64]) -> Self {
        Self { friction: friction.to_vec(), ..self }
    }

    /// The same, moved by the real part of a complex mode: amplitude·Re(z), and its rate amplitude·Re(λ z), `z` of
    /// `[m]`.
    pub fn perturbed(
        mut self,
        mode: &[num_complex::Complex<f64>],
        value: num_complex::Complex<f64>,
        amplitude: f64,
    ) -> Self {
        for (k, z) in mode.iter().enumerate().take(self.q.len()) {
            self.q[k] += amplitude * z.re;
            self.v[k] += amplitude * (value * z).re;
        }
        self
    }

    /// The same, moved by velocities drawn evenly from (−1, 1), scaled to the kinetic energy `energy` (J). The same
    /// seed gives the same state on every machine (SplitMix64; Steele, Lea and Flood, OOPSLA 2014).
    pub fn shaken(mut self, seed: u64, energy: f64) -> Self {
        let mut x = seed;
        let mut draw = || {
            x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = x;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^= z >> 31;
            (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let noise: Vec<f64> = self.v.iter().map(|_| draw()).collect();
        let norm = noise.iter().map(|v| v * v).sum::<f64>().sqrt();
        if norm > 0.0 {
            let factor = (2.0 * energy).sqrt() / norm;
            self.v.iter_mut().zip(&noise).for_each(|(v, n)| *v += factor * n);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Interface;
    use num_complex::Complex64;

    /// Two modes, one of them rigid, on one loaded node of nine.
    #[test]
    fn states_of_rest_are_moved_as_asked() {
        let line = || vec![-1.0, 0.0, 1.0];
        let interface = Interface::new(line(), line(), vec![0.0; 9]).unwrap();
        let modes = Mat::from_fn(27, 2, |i, k| if i == 14 { [2.0, 1.0][k] } else { 0.0 });
        let residual = Mat::<f64>::zeros(27, 27);
        let model = Model {
            interface: &interface,
            residual: residual.as_ref(),
            modes: modes.as_ref(),
            omega: &[10.0, 0.0],
            stiffness: vec![100.0, 0.0].into(),
            damping: vec![0.0; 2].into(),
            turning: None,
            carried: None,
            load: &[50.0, 3.0],
        };
        let reaction: Vec<f64> = (0..27).map(|i| if i == 14 { 100.0 } else { 0.0 }).collect();
        let rest = State::at_rest(&model, &reaction, &[0.01]);
        assert_eq!((&rest.q[..], &rest.v[..], &rest.motions[..]), (&[2.5, 0.0][..], &[0.0; 2][..], &[0.01][..]));
        // q + Re(z), and the velocity that goes with the motion Re(z e^{λt}).
        let (z, value) = ([Complex64::new(1.0, 2.0), Complex64::new(0.0, -1.0)], Complex64::new(3.0, 5.0));
        let moved = rest.clone().perturbed(&z, value, 0.1);
        for (k, want) in [(0, [2.6, -0.7]), (1, [0.0, 0.5])] {
            let got = [moved.q[k], moved.v[k]];
            assert!((0..2).all(|c| (got[c] - want[c]).abs() < 1e-15), "mode {k}: {got:?}, expected {want:?}");
        }
        let shaken = rest.shaken(4, 0.3);
        let energy = 0.5 * shaken.v.iter().map(|v| v * v).sum::<f64>();
        assert!((energy - 0.3).abs() < 1e-15 && shaken.q == [2.5, 0.0], "{energy} J");
    }
}
