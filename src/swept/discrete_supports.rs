//! Pads and sleepers that stand apart, each under a piece of the foot: they couple the modes of a rail on pads that
//! are spread evenly.
//!
//! With g(x) = d/l on the pads, of the length l, and 0 between them, d apart, the track of a metre is g(x) times that
//! of the even one, whose mean it has. So the modes φ of the rail on the even pads get the stiffness Ω² + ∫(g − 1) φᵀ
//! s φ dx, and the dashpots likewise; a sleeper is a mass with three motions more. The eigenvectors of both together
//! are the modes of the rail on its track. What waves too short to be among the modes would give way by under a pad
//! is left out: beside the pad's own 8 nm/N it is little, and less with more modes.
//!
//! A wave n of the period L of N bays meets the waves m with n ± m = N, 2N … alone: pinned–pinned is n = m = N/2,
//! half a wave a bay.

use super::track::block;
use super::waves::{shape, Member, RailMode};
use super::{Forms, SleeperLayer, TrackLayer};
use crate::{Error, Result};
use faer::Mat;
use std::f64::consts::PI;

/// Pads, and sleepers under them, one a bay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscreteSupports {
    /// Number of bays on the period.
    pub count: usize,
    /// Length of a bay d, m.
    pub spacing: f64,
    /// Length of a pad l along the rail, m.
    pub length: f64,
    /// Distance from the middle of a pad to the contact, along +x, m.
    pub position: f64,
    /// The pads, each metre of track, as the rail's modes have them.
    pub pad: TrackLayer,
    /// Sleepers, each metre of track; none: the pads lie on the ground.
    pub sleeper: Option<SleeperLayer>,
}

/// The modes of a rail on its bays.
pub struct SupportedRailModes {
    /// Angular frequencies, rad/s, ascending, `[m']`.
    pub omega: Vec<f64>,
    /// Share of each in the modes of the rail on even pads, `[m, m']`.
    pub shares: Mat<f64>,
    /// Damping, 1/s, `[m', m']`.
    pub damping: Mat<f64>,
}

/// Motions along x at a wavenumber: cosine or sine, and the sign.
type Shape = (bool, f64);

/// Shapes of (U, W) and of V of a mode.
fn shapes(waves: &[RailMode], &(of, _, family): &Member) -> [Shape; 2] {
    let (cos, sign) = shape(waves[of].order, family);
    [(cos, 1.0), if sign == 0.0 { (false, 1.0) } else { (true, sign) }]
}

impl DiscreteSupports {
    fn period(&self) -> f64 {
        self.count as f64 * self.spacing
    }

    /// sin(ql/2)/(ql/2), the mean over a pad of a wave with `waves` on the period.
    fn mean(&self, waves: usize) -> f64 {
        let half = PI * waves as f64 / self.period() * self.length;
        if half == 0.0 {
            1.0
        } else {
            half.sin() / half
        }
    }

    /// ∫(g − 1) cos qx dx and ∫(g − 1) sin qx dx over the period, m, of a wave with `waves` on it.
    fn wave(&self, waves: usize) -> [f64; 2] {
        if waves == 0 || !waves.is_multiple_of(self.count) {
            return [0.0; 2];
        }
        let (sin, cos) = (2.0 * PI * waves as f64 / self.period() * self.position).sin_cos();
        let size = self.period() * self.mean(waves);
        // The pads are at jd − position.
        [size * cos, -size * sin]
    }

    /// ∫(g − 1) a(x) b(x) dx, m, of motions with m and n waves on the period.
    fn integral(&self, (m, (cos, s)): (usize, Shape), (n, (also, t)): (usize, Shape)) -> f64 {
        let ([sum, odd_sum], [apart, odd]) = (self.wave(m + n), self.wave(m.abs_diff(n)));
        // sin (m − n)qx is odd in m − n.
        let odd_apart = if m >= n { odd } else { -odd };
        s * t
            * 0.5
            * match (cos, also) {
                (true, true) => apart + sum,
                (false, false) => apart - sum,
                (false, true) => odd_sum + odd_apart,
                (true, false) => odd_sum - odd_apart,
            }
    }

    /// The mean over the pad `pad` of a motion with `waves` on the period.
    fn at(&self, pad: usize, (waves, (cos, sign)): (usize, Shape)) -> f64 {
        let x = pad as f64 * self.spacing - self.position;
        let (s, c) = (2.0 * PI * waves as f64 / self.period() * x).sin_cos();
        sign * self.mean(waves) * if cos { c } else { s }
    }

    /// The modes of the rail of `forms`, whose section is turned by `tilt`, rad, from the modes `list` of `waves` on
    /// even pads with their `damping`, 1/s, `[m, m]`. Errors: not converged.
    pub fn lay(
        &self,
        (forms, tilt): (&Forms, f64),
        waves: &[RailMode],
        list: &[Member],
        damping: &Mat<f64>,
    ) -> Result<SupportedRailModes> {
        let m = list.len();
        let size = m + self.sleeper.map_or(0, |_| 3 * self.count);
        let (mut k, mut c) = (Mat::<f64>::zeros(size, size), Mat::<f64>::zeros(size, size));
        c.as_mut().submatrix_mut(0, 0, m, m).copy_from(damping);
        (0..m).for_each(|i| k[(i, i)] = waves[list[i].0].omega[list[i].1].powi(2));
        self.couple((forms, waves, list), [&mut k, &mut c]);
        if let Some(sleeper) = &self.sleeper {
            self.carry((forms, tilt), (waves, list), sleeper, [&mut k, &mut c]);
        }
        let eigen = k
            .self_adjoint_eigen(faer::Side::Lower)
            .map_err(|e| Error::NotConverged(format!("modes of a rail on pads that stand apart: {e:?}")))?;
        let (values, vectors) = (eigen.S().column_vector(), eigen.U());
        if let Some(value) = values.iter().find(|v| !(**v > 0.0)) {
            return Err(Error::NotConverged(format!(
                "modes of a rail on pads that stand apart: found an eigenvalue of {value:.3e} 1/s², expected \
                 none but positive ones"
            )));
        }
        Ok(SupportedRailModes {
            omega: values.iter().map(|v| v.sqrt()).collect(),
            shares: vectors.subrows(0, m).to_owned(),
            damping: vectors.transpose() * (c * vectors),
        })
    }

    /// Adds what the pads have beyond their mean to stiffness and damping.
    fn couple(&self, (forms, waves, list): (&Forms, &[RailMode], &[Member]), [k, c]: [&mut Mat<f64>; 2]) {
        let first = first(waves);
        let count = waves.iter().map(|w| w.omega.len()).sum();
        let mut all = Mat::<f64>::zeros(forms.order(), count);
        for (wave, &at) in waves.iter().zip(&first) {
            all.as_mut().subcols_mut(at, wave.omega.len()).copy_from(&wave.vectors);
        }
        for (part, along) in [false, true].into_iter().enumerate() {
            let [springs, dashpots] = forms.track_of(along, all.as_ref()).map(|moved| all.transpose() * moved);
            for (i, mine) in list.iter().enumerate() {
                for (j, other) in list.iter().enumerate() {
                    let (a, b) = (first[mine.0] + mine.1, first[other.0] + other.1);
                    let of = |m: &Member| (waves[m.0].order, shapes(waves, m)[part]);
                    let integral = self.integral(of(mine), of(other));
                    k[(i, j)] += integral * springs[(a, b)];
                    c[(i, j)] += integral * dashpots[(a, b)];
                }
            }
        }
    }

    /// Adds the sleepers, three rows each, their motions times the root of their mass.
    fn carry(
        &self,
        (forms, tilt): (&Forms, f64),
        (waves, list): (&[RailMode], &[Member]),
        sleeper: &SleeperLayer,
        [k, c]: [&mut Mat<f64>; 2],
    ) {
        let (m, root) = (list.len(), (sleeper.mass * self.spacing).sqrt());
        let (pad, ballast) = (block(&self.pad, tilt), block(&sleeper.ballast, tilt));
        let foot = forms.foot();
        // Mean of each mode's (U, V, W) over the foot.
        let means: Vec<[f64; 3]> = list
            .iter()
            .map(|&(of, index, _)| {
                let amplitude = waves[of].vectors.col(index);
                std::array::from_fn(|d| foot.iter().map(|&(at, share)| share * amplitude[at + d]).sum())
            })
            .collect();
        for s in 0..self.count {
            let at = m + 3 * s;
            for (matrix, own, below) in
                [(&mut *k, pad.stiffness, ballast.stiffness), (&mut *c, pad.viscosity, ballast.viscosity)]
            {
                for d in 0..3 {
                    for e in 0..3 {
                        matrix[(at + d, at + e)] += self.spacing * (own[d][e] + below[d][e]) / (root * root);
                    }
                }
                for (i, member) in list.iter().enumerate() {
                    let [across, along] = shapes(waves, member).map(|s| (waves[member.0].order, s));
                    let [across, along] = [across, along].map(|motion| self.at(s, motion));
                    let moved: [f64; 3] = std::array::from_fn(|d| means[i][d] * if d == 1 { along } else { across });
                    for d in 0..3 {
                        let force: f64 = (0..3).map(|e| own[d][e] * moved[e]).sum();
                        matrix[(at + d, i)] -= self.spacing * force / root;
                        matrix[(i, at + d)] -= self.spacing * force / root;
                    }
                }
            }
        }
    }
}

/// Places of the first modes of each order in a list of all.
fn first(waves: &[RailMode]) -> Vec<usize> {
    let before = |sum: &mut usize, w: &RailMode| {
        *sum += w.omega.len();
        Some(*sum - w.omega.len())
    };
    waves.iter().scan(0, before).collect()
}
