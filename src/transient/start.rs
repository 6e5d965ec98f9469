//! States to start from.

use super::energy::Energy;
use super::model::Model;
use super::stepper::State;

impl State {
    /// At rest under the nodal reactions `reaction` (tx, ty, p), N, `[3n]`, and the loads of the model; rigid-body modes are at 0.
    pub fn at_rest(model: &Model, reaction: &[f64], approach: f64) -> Self {
        let m = model.omega.len();
        let q = (0..m)
            .map(|k| {
                let load = model.load.get(k).copied().unwrap_or(0.0);
                let force: f64 = load + reaction.iter().enumerate().map(|(i, r)| model.modes[(i, k)] * r).sum::<f64>();
                if model.omega[k] > 0.0 {
                    force / model.omega[k].powi(2)
                } else {
                    0.0
                }
            })
            .collect();
        Self {
            step: 0,
            q,
            v: vec![0.0; m],
            reaction: reaction.to_vec(),
            approach,
            creep: [0.0; 2],
            energy: Energy::default(),
        }
    }

    /// The same, moved by the real part of a complex mode: amplitude·Re(z), and its rate amplitude·Re(λ z), `z` of `[m]`.
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

    /// The same, moved by velocities drawn evenly from (−1, 1), scaled to the kinetic energy `energy` (J). The same seed gives
    /// the same state on every machine (SplitMix64; Steele, Lea and Flood, OOPSLA 2014).
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
