//! Friction memory: the coefficient of a particle follows the law of friction over a length of sliding.
//!
//! A coefficient bound to the velocity of the moment makes a falling law ill-posed: what is in contact has no mass of
//! its own, and a node that slides faster meets less friction and slides faster still, at once. With memory (E. A. H.
//! Vollebregt, H. M. Schuttelaars, *J. Sound Vib.* 331 (2012); *User guide for CONTACT*) the coefficient of a
//! particle changes at the rate
//!
//! dμ/dt = −r (μ − μ_s(v)),   r = max(v, v₀)/d,
//!
//! with the law μ_s, the length d of the memory and a velocity v₀ that lets it forget in stick as well. Material
//! comes with the coefficient at rest, μ_s(0). Over a time T at one velocity that is μ⁺ = μ_s + (μ − μ_s) e^{−rT}:
//! along a line of the grid with T = Δx/V from node to node, and in time with the step. Between two nodes the
//! coefficient lies on the exponential of the same rate, so that at rest every step finds the course that the steady
//! state has.

use super::{exp_simd, FrictionLaw};

/// Length of the memory where a job does not give it, m: a wear-in of asperities, as in the examples of CONTACT (0.02
/// mm).
pub(super) fn default_length() -> f64 {
    2e-5
}

/// The velocity v₀ where a job does not give it, m/s.
pub(super) fn default_velocity() -> f64 {
    1e-3
}

/// Length or time over which a law remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Memory {
    /// Length of sliding d, m.
    pub length: f64,
    /// Velocity v₀ at which it forgets at least, m/s.
    pub velocity: f64,
}

impl Memory {
    /// Rate r at which the coefficient follows the law at the sliding velocity `v` ≥ 0, 1/s.
    pub fn rate(&self, v: f64) -> f64 {
        v.max(self.velocity) / self.length
    }

    /// dr/dv, 1/m.
    fn rate_slope(&self, v: f64) -> f64 {
        if v > self.velocity {
            1.0 / self.length
        } else {
            0.0
        }
    }
}

/// Contribution that came to a node before a step of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Remembered {
    /// Coefficient at the node before the step.
    pub own: f64,
    /// Coefficient at the node upstream of it before the step.
    pub upstream: f64,
    /// The step, s.
    pub step: f64,
    /// Time from the node upstream to this one, s, no shorter than the step; infinite where nothing rolls.
    pub passage: f64,
}

impl Remembered {
    /// The coefficient after the step and its slope by the velocity, with those of the `law`, the slope `dr` of the
    /// rate and the parts `a` and `b` that have gone in the step and on the way from the node upstream.
    #[inline(always)]
    fn renewed(&self, (law, slope): (f64, f64), dr: f64, [a, b]: [f64; 2]) -> (f64, f64) {
        let (kept, over) = (1.0 - b, 1.0 / b);
        let late = if kept > 0.0 { self.passage * kept } else { 0.0 };
        let rest = law - (self.own - kept * self.upstream) * over;
        let by_velocity =
            dr * self.step * (1.0 - a) * rest + a * (slope - dr * late * (self.upstream - self.own) * over * over);
        (self.own + a * rest, by_velocity)
    }
}

/// How the coefficient at a node leaves the state of rest: dδμ/dt = −`decay` δμ + `upstream` δμ(upstream) + `gain` δv.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxation {
    /// 1/s.
    pub decay: f64,
    /// 1/s.
    pub upstream: f64,
    /// 1/m.
    pub gain: f64,
}

/// 1 − e^(−x) for x ≥ 0, to rounding but for its last digit: each node of a time step asks for it several times,
/// where `exp_m1` costs more.
#[inline]
fn lapsed(x: f64) -> f64 {
    if x > 0.1 {
        return 1.0 - (-x).exp();
    }
    // The series; its next term is below 1e-17 of it. By pairs, which do not wait for each other.
    let pair = |n: usize| exp_simd::INVERSE_FACTORIALS[n + 1] - x * exp_simd::INVERSE_FACTORIALS[n + 2];
    let (square, fourth) = (x * x, x * x * (x * x));
    let first = pair(0) + square * pair(2);
    x * (first + fourth * (pair(4) + square * pair(6) + fourth * pair(8)))
}

impl FrictionLaw {
    /// The coefficient of material that came with `before` and slid for the time `time` (s) at the velocity `v` ≥ 0;
    /// that of the law itself where it has no memory.
    pub fn passed(&self, before: f64, v: f64, time: f64) -> f64 {
        let law = self.coefficient(v);
        match self.memory() {
            None => law,
            Some(memory) => law + (before - law) * (-memory.rate(v) * time).exp(),
        }
    }

    /// The coefficient at a node after a step at the velocity `v` ≥ 0.
    pub fn renewed(&self, before: &Remembered, v: f64) -> f64 {
        let law = self.coefficient(v);
        let Some(memory) = self.memory() else { return law };
        let r = memory.rate(v);
        let (a, b) = (lapsed(r * before.step), lapsed(r * before.passage));
        before.own + a * (law - (before.own - (1.0 - b) * before.upstream) / b)
    }

    /// Derivatives of [`Self::renewed`] by the coefficients at the node and upstream of it.
    pub(crate) fn renewed_by_memory(&self, before: &Remembered, v: f64) -> [f64; 2] {
        let Some(memory) = self.memory() else { return [0.0; 2] };
        let r = memory.rate(v);
        let part = lapsed(r * before.step) / lapsed(r * before.passage);
        [1.0 - part, part * (1.0 - lapsed(r * before.passage))]
    }

    /// Its derivative by `v`, s/m.
    pub(crate) fn renewed_slope(&self, before: &Remembered, v: f64) -> f64 {
        self.renewed_with_slope(before, v).1
    }

    /// Both of them.
    pub(crate) fn renewed_with_slope(&self, before: &Remembered, v: f64) -> (f64, f64) {
        let (law, slope) = self.with_slope(v);
        let Some(memory) = self.memory() else { return (law, slope) };
        let r = memory.rate(v);
        let gone = [lapsed(r * before.step), lapsed(r * before.passage)];
        before.renewed((law, slope), memory.rate_slope(v), gone)
    }

    /// Both of them at nodes that slide at the velocities `v` ≥ 0, `[k]`; those of the law itself where nothing is
    /// remembered, `before` being empty.
    pub(crate) fn renewed_with_slopes(&self, before: &[Remembered], v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let varying = match self {
            Self::Constant(mu) => return (vec![*mu; v.len()], vec![0.0; v.len()]),
            Self::Varying(varying) => varying,
        };
        let (mut mu, mut slope) = varying.law().with_slopes(v);
        if before.len() != v.len() {
            return (mu, slope);
        }
        let (memory, k) = (varying.law().memory(), v.len());
        let times = |time: fn(&Remembered) -> f64| v.iter().zip(before).map(move |(v, b)| memory.rate(*v) * time(b));
        let mut lapsed: Vec<f64> = times(|b| b.step).chain(times(|b| b.passage)).collect();
        exp_simd::lapsed(&mut lapsed);
        let (steps, passages) = lapsed.split_at(k);
        for (i, before) in before.iter().enumerate() {
            (mu[i], slope[i]) = before.renewed((mu[i], slope[i]), memory.rate_slope(v[i]), [steps[i], passages[i]]);
        }
        (mu, slope)
    }

    /// How the coefficient leaves the state of rest `mu` at a node that slides at `v` ≥ 0, with the node upstream the
    /// time `passage` (s, infinite where nothing rolls) away. None where the law has no memory.
    pub fn relaxation(&self, mu: f64, v: f64, passage: f64) -> Option<Relaxation> {
        let memory = self.memory()?;
        let r = memory.rate(v);
        let (kept, left) = ((-r * passage).exp(), -(-r * passage).exp_m1());
        // At rest where nothing rolls nothing is left of what was before.
        let behind = if kept > 0.0 { (mu - self.coefficient(v)) * r * passage / left } else { 0.0 };
        Some(Relaxation {
            decay: r / left,
            upstream: r * kept / left,
            gain: r * self.slope(v) - memory.rate_slope(v) * behind,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{DoubleExponential, Exponential, FrictionLaw, FrictionTable, Kraft, Linear, Rational};
    use super::*;

    #[test]
    fn what_has_lapsed_is_right_to_rounding() {
        for x in [0.0f64, 1e-300, 1e-12, 1e-3, 0.05, 0.0999999, 0.1, 0.1000001, 0.7, 5.0, 800.0, f64::INFINITY] {
            let want = -(-x).exp_m1();
            assert!((lapsed(x) - want).abs() <= 4e-15 * want, "{x}: {} against {want}", lapsed(x));
        }
    }

    fn laws() -> [FrictionLaw; 6] {
        [
            Exponential::new(0.4, 0.25, 0.3).into(),
            Rational::new(0.4, 0.25, 0.3).into(),
            DoubleExponential::new(0.4, 0.25, 0.6, 0.1, 2.0).into(),
            Linear::new(0.4, 0.25, 0.6).into(),
            Kraft::new(0.4).into(),
            FrictionTable::new(vec![[0.0, 0.4], [0.1, 0.42], [0.9, 0.25]]).into(),
        ]
    }

    const PASSAGES: [f64; 3] = [1e-4, 3e-5, f64::INFINITY];

    /// A step is affine in what it remembers.
    #[test]
    fn the_parts_of_the_memory_make_the_step() {
        for law in laws() {
            for (v, passage) in [1e-4, 0.2, 3.0].into_iter().flat_map(|v| PASSAGES.map(|p| (v, p))) {
                let before = |own, upstream| Remembered { own, upstream, step: 2e-5, passage };
                let [own, upstream] = law.renewed_by_memory(&before(0.31, 0.38), v);
                let got = law.renewed(&before(0.41, 0.36), v) - law.renewed(&before(0.31, 0.38), v);
                let want = 0.1 * own - 0.02 * upstream;
                assert!((got - want).abs() < 1e-13, "{law:?}, {v} m/s, {passage} s: {got} against {want}");
            }
        }
    }

    #[test]
    fn the_slope_of_a_step_is_its_derivative() {
        for law in laws() {
            for (v, passage) in [1e-4, 0.01, 0.2, 3.0].into_iter().flat_map(|v| PASSAGES.map(|p| (v, p))) {
                let before = Remembered { own: 0.31, upstream: 0.38, step: 2e-5, passage };
                let h = 1e-6 * v;
                let d = (law.renewed(&before, v + h) - law.renewed(&before, v - h)) / (2.0 * h);
                let slope = law.renewed_slope(&before, v);
                assert!(
                    (slope - d).abs() < 1e-6 * d.abs().max(1.0),
                    "{law:?}, {v} m/s, {passage} s: {slope} against {d}"
                );
            }
        }
    }

    /// Many nodes at once as each by itself, with a memory and without.
    #[test]
    fn many_nodes_are_renewed_as_one() {
        let mut all = Vec::new();
        for (k, passage) in (0..37).flat_map(|k| PASSAGES.map(|p| (k, p))) {
            let own = 0.28 + 1e-3 * f64::from(k);
            all.push((Remembered { own, upstream: 0.31, step: 2e-5, passage }, 1e-4 * 1.4_f64.powi(k)));
        }
        let (before, v): (Vec<Remembered>, Vec<f64>) = all.into_iter().unzip();
        for law in laws().into_iter().chain([FrictionLaw::Constant(0.3)]) {
            let (mu, slope) = law.renewed_with_slopes(&before, &v);
            let (plain, plain_slope) = law.renewed_with_slopes(&[], &v);
            for (i, (before, &v)) in before.iter().zip(&v).enumerate() {
                let ends = [
                    ((mu[i], slope[i]), law.renewed_with_slope(before, v)),
                    ((plain[i], plain_slope[i]), law.with_slope(v)),
                ];
                for (got, want) in ends {
                    assert!((got.0 - want.0).abs() < 1e-15, "{law:?}, {v} m/s: {} against {}", got.0, want.0);
                    let size = want.1.abs().max(1e-3);
                    assert!((got.1 - want.1).abs() < 1e-13 * size, "{law:?}, {v} m/s: {} against {}", got.1, want.1);
                }
            }
        }
    }

    /// At rest a step changes nothing, whatever its length, and what it makes of small changes is, for short steps,
    /// the relaxation.
    #[test]
    fn at_rest_a_step_leaves_the_course_and_departs_from_it_as_the_relaxation_says() {
        for law in laws() {
            for (v, passage) in [1e-4, 0.05, 0.4].into_iter().flat_map(|v| PASSAGES.map(|p| (v, p))) {
                let upstream = 0.37;
                let rest = law.passed(upstream, v, passage);
                for step in [1e-8, 1e-6, 3e-5] {
                    let before = Remembered { own: rest, upstream, step, passage };
                    assert!(
                        (law.renewed(&before, v) - rest).abs() < 1e-14,
                        "{law:?}, {v} m/s, {passage} s, step {step}"
                    );
                }
                let step = 1e-5 / law.relaxation(rest, v, passage).unwrap().decay;
                let rate = |own: f64, upstream: f64, v: f64| {
                    let before = Remembered { own, upstream, step, passage };
                    (law.renewed(&before, v) - own) / step
                };
                let r = law.relaxation(rest, v, passage).unwrap();
                let h = 1e-4;
                let by = |f: &dyn Fn(f64) -> f64, h: f64| (f(h) - f(-h)) / (2.0 * h);
                let k = 1e-2 * v;
                for (got, want) in [
                    (by(&|d| rate(rest + d, upstream, v), h), -r.decay),
                    (by(&|d| rate(rest, upstream + d, v), h), r.upstream),
                    (by(&|d| rate(rest, upstream, v + d), k), r.gain),
                ] {
                    assert!(
                        (got - want).abs() < 1e-4 * want.abs() + 1e-4 * r.decay,
                        "{law:?}, {v} m/s, {passage} s: {got} against {want}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_long_way_leads_to_the_law_and_a_short_one_stays() {
        for law in laws() {
            assert!((law.passed(0.4, 0.2, 1.0) - law.coefficient(0.2)).abs() < 1e-15);
            assert!((law.passed(0.37, 0.2, 0.0) - 0.37).abs() < 1e-15);
            // The length of the memory takes 63 %.
            let time = law.memory().unwrap().length / 0.2;
            let want = law.coefficient(0.2) + (0.4 - law.coefficient(0.2)) * (-1.0f64).exp();
            assert!((law.passed(0.4, 0.2, time) - want).abs() < 1e-15);
        }
        let constant = FrictionLaw::Constant(0.3);
        let before = Remembered { own: 0.4, upstream: 0.5, step: 1e-5, passage: 1e-4 };
        assert_eq!((constant.passed(0.4, 0.2, 1e-4), constant.renewed(&before, 0.2)), (0.3, 0.3));
        assert_eq!((constant.renewed_slope(&before, 0.2), constant.relaxation(0.3, 0.2, 1e-4)), (0.0, None));
    }
}
