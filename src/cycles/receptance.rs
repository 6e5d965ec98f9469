//! The modes under periodic forces at the contact.

use super::structure::Structure;
use crate::model::ModalMatrix;
use crate::{Error, Result};
use num_complex::Complex;

type C = num_complex::Complex<f64>;

/// Angular frequency s of the multiple `k` of ω in steps of `h`, s: that of the θ-method with θ = ½, 2 tan(kωh/2)/h.
pub(super) fn discrete(k: usize, omega: f64, h: f64) -> f64 {
    2.0 / h * (0.5 * k as f64 * omega * h).tan()
}

impl Structure<'_> {
    /// Modal amplitudes (K + s² + sC)⁻¹ f under modal forces `force`, `[m]`, that go with exp(st), s in 1/s.
    pub(super) fn response(&self, s: C, force: &[C]) -> Result<Vec<C>> {
        let model = &self.model;
        if let (ModalMatrix::Diagonal(k), ModalMatrix::Diagonal(c)) = (&model.stiffness, &model.damping) {
            let one = |(i, f): (usize, &C)| f / (s * s + s * c[i] + k[i]);
            return checked(force.iter().enumerate().map(one).collect());
        }
        checked(self.poles.response(s, force))
    }

    /// Motion of what acts at the contact under forces on it, `[r]`, of the multiple `k` of the frequency, which goes
    /// with exp(st), s in 1/s; the mean one without that of what nothing holds, the last of them.
    pub(super) fn contact_response(&self, k: usize, s: C, push: &[C]) -> Result<Vec<C>> {
        let mut push = push.to_vec();
        if let (0, Some(_), Some(last)) = (k, &self.free, push.last_mut()) {
            *last = C::default();
        }
        let push = &push;
        let mut out = if self.is_diagonal() {
            self.at_contact(&self.response(s, &self.spread(push))?)
        } else {
            let mut out = vec![C::default(); self.rank()];
            for (lambda, motion, load) in &self.contact_poles {
                let amplitude = load.iter().zip(push).map(|(l, p)| l * p).sum::<C>() / (s - lambda);
                out.iter_mut().zip(motion).for_each(|(o, x)| *o += x * amplitude);
            }
            checked(out)?
        };
        if k == 0 {
            out.iter_mut().zip(&self.loaded).for_each(|(o, l)| *o += l);
        }
        Ok(out)
    }

    /// C φ: modal forces of forces on what acts at the contact, `[r]`.
    pub(super) fn spread(&self, seen: &[C]) -> Vec<C> {
        let mut out = vec![C::default(); self.model.omega.len()];
        for (mix, f) in self.mix.iter().zip(seen) {
            out.iter_mut().zip(mix).for_each(|(o, c)| *o += *f * *c);
        }
        out
    }

    /// Cᵀ q, `[r]`.
    pub fn at_contact(&self, q: &[C]) -> Vec<C> {
        self.mix.iter().map(|mix| mix.iter().zip(q).map(|(c, q)| *q * *c).sum()).collect()
    }
}

fn checked(found: Vec<C>) -> Result<Vec<C>> {
    match found.iter().all(|q| q.is_finite()) {
        true => Ok(found),
        false => Err(Error::Input(
            "limit cycles: a mode without stiffness or without damping has no periodic motion of its own; expected \
             bodies that are held, with damping"
                .into(),
        )),
    }
}

/// The harmonic `k` of samples, `[N][r]`, at the phases 2πn/N: the mean for k = 0, and ẑ in Re(ẑ e^{iknθ}).
pub(super) fn harmonic(samples: &[Vec<f64>], k: usize) -> Vec<C> {
    let count = samples.len();
    let width = samples.first().map_or(0, Vec::len);
    let weight = if k == 0 { 1.0 } else { 2.0 } / count as f64;
    let mut out = vec![C::default(); width];
    for (n, sample) in samples.iter().enumerate() {
        let angle = 2.0 * std::f64::consts::PI * ((k * n) % count) as f64 / count as f64;
        let turn = Complex::from_polar(weight, -angle);
        out.iter_mut().zip(sample).for_each(|(o, s)| *o += turn * *s);
    }
    out
}
