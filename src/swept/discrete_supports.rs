//! Pads and sleepers that stand apart, each under a piece of the foot: they couple the modes of a rail on pads that
//! are spread evenly.
//!
//! With g(x) = d/l on the pads, of the length l, and 0 between them, d apart, the track of a metre is g(x) times that
//! of the even one, whose mean it has. So the modes φ of the rail on the even pads get the stiffness Ω² + ∫(g − 1) φᵀ
//! s φ dx, and the dashpots likewise; a sleeper is a mass with three motions more. The eigenvectors of both together
//! are the modes of the rail on its track. What waves too short to be among the modes would give way by under a pad
//! is left out: beside the pad's own 8 nm/N it is little, and less with more modes.
//!
//! Sleepers that both rails lie on are rigid bars of the length L with the mass and the ballast spread along them. They
//! move by v, u and w, and turn by θ about the track and by ψ about the vertical. With the rails b to either side of
//! their middle the seats move by
//!
//! ```text
//! vertical v ± bθ,   along the track u ± bψ,   across w
//! ```
//!
//! and, of what has the mass or the stiffness 2m below both rails, the share of bθ and of bψ is 2m (L²/12)/b². The
//! seats do not tilt with the sleeper and lie on its axis, and the inclination of the rails is left out.
//!
//! A wave n of the period L of N bays meets the waves m with n ± m = N, 2N … alone: pinned–pinned is n = m = N/2,
//! half a wave a bay.

use super::forms::Springs;
use super::track::{axes, block};
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
    /// Shape of sleepers below both rails; none: each rail has sleepers of its own, which do not turn.
    pub shared: Option<SleeperBar>,
}

/// A sleeper below both rails, a rigid bar on ballast that is spread along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SleeperBar {
    /// Its length L, m.
    pub length: f64,
    /// Distance of the rails from each other 2b, m.
    pub rail_distance: f64,
}

/// The modes of one of the rails on even pads.
#[derive(Clone, Copy)]
pub struct RailOnPads<'a> {
    /// The rail.
    pub forms: &'a Forms,
    /// Angle of its section against the upright one, rad.
    pub tilt: f64,
    /// Its modes, order by order.
    pub waves: &'a [RailMode],
    /// Distance of its contact from that of the first rail, along +x, m.
    pub ahead: f64,
}

/// One of the modes of some rails: the rail, and the mode of it.
pub type RailMember = (usize, Member);

/// A motion of a sleeper.
struct SleeperMotion {
    /// Its mass, kg.
    mass: f64,
    /// Stiffness, N/m, and viscosity, N·s/m, of the ballast against it.
    ballast: [f64; 2],
    /// Motion of the seat of each rail: vertical, longitudinal, lateral.
    seats: Vec<[f64; 3]>,
}

/// The modes of rails on their bays.
pub struct SupportedRailModes {
    /// Angular frequencies, rad/s, ascending, `[m']`.
    pub omega: Vec<f64>,
    /// Share of each in the modes of the rails on even pads, `[m, m']`.
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

    /// ∫(g − 1) cos qx dx and ∫(g − 1) sin qx dx over the period, m, of a wave with `waves` on it, and a contact this
    /// far `ahead`, m.
    fn wave(&self, waves: usize, ahead: f64) -> [f64; 2] {
        if waves == 0 || !waves.is_multiple_of(self.count) {
            return [0.0; 2];
        }
        let (sin, cos) = (2.0 * PI * waves as f64 / self.period() * (self.position + ahead)).sin_cos();
        let size = self.period() * self.mean(waves);
        // The pads are at jd − position − ahead.
        [size * cos, -size * sin]
    }

    /// ∫(g − 1) a(x) b(x) dx, m, of motions with m and n waves on the period of a rail whose contact is this far
    /// `ahead`, m.
    fn integral(&self, (m, (cos, s)): (usize, Shape), (n, (also, t)): (usize, Shape), ahead: f64) -> f64 {
        let ([sum, odd_sum], [apart, odd]) = (self.wave(m + n, ahead), self.wave(m.abs_diff(n), ahead));
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

    /// The mean over the pad `pad` of a motion with `waves` on the period of a rail whose contact is this far `ahead`,
    /// m.
    fn at(&self, pad: usize, (waves, (cos, sign)): (usize, Shape), ahead: f64) -> f64 {
        let x = pad as f64 * self.spacing - self.position - ahead;
        let (s, c) = (2.0 * PI * waves as f64 / self.period() * x).sin_cos();
        sign * self.mean(waves) * if cos { c } else { s }
    }

    /// Motions of a sleeper below some rails.
    fn motions(&self, sleeper: &SleeperLayer, rails: usize) -> Vec<SleeperMotion> {
        let SleeperLayer { mass, ballast } = sleeper;
        let motion = |direction: usize, part: f64, signs: &[f64]| SleeperMotion {
            mass: part * self.spacing * mass,
            ballast: [&ballast.stiffness, &ballast.viscosity].map(|of| part * self.spacing * of[direction]),
            seats: signs.iter().map(|s| std::array::from_fn(|d| if d == direction { *s } else { 0.0 })).collect(),
        };
        let alike = vec![1.0; rails];
        let mut all: Vec<SleeperMotion> = (0..3).map(|d| motion(d, rails as f64, &alike)).collect();
        if let Some(SleeperBar { length, rail_distance }) = self.shared {
            let turned = rails as f64 * length * length / (3.0 * rail_distance * rail_distance);
            let signs: Vec<f64> = (0..rails).map(|r| if r == 0 { 1.0 } else { -1.0 }).collect();
            all.extend([0, 1].map(|d| motion(d, turned, &signs)));
        }
        all
    }

    /// The modes of the `rails` from the modes `list` of all of them on even pads with their `damping`, 1/s, `[m, m]`.
    /// Errors: not converged.
    pub fn lay(&self, rails: &[RailOnPads], list: &[RailMember], damping: &Mat<f64>) -> Result<SupportedRailModes> {
        let m = list.len();
        let motions = self.sleeper.map_or(Vec::new(), |sleeper| self.motions(&sleeper, rails.len()));
        let size = m + motions.len() * self.count;
        let (mut k, mut c) = (Mat::<f64>::zeros(size, size), Mat::<f64>::zeros(size, size));
        c.as_mut().submatrix_mut(0, 0, m, m).copy_from(damping);
        for (i, &(rail, (of, index, _))) in list.iter().enumerate() {
            k[(i, i)] = rails[rail].waves[of].omega[index].powi(2);
        }
        self.couple(rails, list, [&mut k, &mut c]);
        self.carry(rails, list, &motions, [&mut k, &mut c]);
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
    fn couple(&self, rails: &[RailOnPads], list: &[RailMember], [k, c]: [&mut Mat<f64>; 2]) {
        for (number, rail) in rails.iter().enumerate() {
            let RailOnPads { forms, waves, ahead, .. } = *rail;
            let first = first(waves);
            let count = waves.iter().map(|w| w.omega.len()).sum();
            let mut all = Mat::<f64>::zeros(forms.order(), count);
            for (wave, &at) in waves.iter().zip(&first) {
                all.as_mut().subcols_mut(at, wave.omega.len()).copy_from(&wave.vectors);
            }
            let own: Vec<(usize, &Member)> =
                list.iter().enumerate().filter(|(_, of)| of.0 == number).map(|(i, of)| (i, &of.1)).collect();
            for (part, along) in [false, true].into_iter().enumerate() {
                let [springs, dashpots] = forms.track_of(along, all.as_ref()).map(|moved| all.transpose() * moved);
                for &(i, mine) in &own {
                    for &(j, other) in &own {
                        let (a, b) = (first[mine.0] + mine.1, first[other.0] + other.1);
                        let of = |m: &Member| (waves[m.0].order, shapes(waves, m)[part]);
                        let integral = self.integral(of(mine), of(other), ahead);
                        k[(i, j)] += integral * springs[(a, b)];
                        c[(i, j)] += integral * dashpots[(a, b)];
                    }
                }
            }
        }
    }

    /// Adds the sleepers, a row for each of their `motions`, times the root of its mass.
    fn carry(&self, rails: &[RailOnPads], list: &[RailMember], motions: &[SleeperMotion], [k, c]: [&mut Mat<f64>; 2]) {
        let (m, d) = (list.len(), self.spacing);
        let pads: Vec<Springs> = rails.iter().map(|rail| block(&self.pad, rail.tilt)).collect();
        // Motion of the seats over the root of the mass, in the frame of each section.
        let seats: Vec<Vec<[f64; 3]>> = motions
            .iter()
            .map(|motion| {
                let frames = rails.iter().map(|rail| axes(rail.tilt));
                let of = |(frame, seat): ([[f64; 3]; 3], &[f64; 3])| {
                    std::array::from_fn(|i| (0..3).map(|j| frame[j][i] * seat[j]).sum::<f64>() / motion.mass.sqrt())
                };
                frames.zip(&motion.seats).map(of).collect()
            })
            .collect();
        // Mean of each mode's (U, V, W) over the foot of its rail.
        let means: Vec<[f64; 3]> = list
            .iter()
            .map(|&(rail, (of, index, _))| {
                let RailOnPads { forms, waves, .. } = rails[rail];
                let amplitude = waves[of].vectors.col(index);
                std::array::from_fn(|i| forms.foot().iter().map(|&(at, share)| share * amplitude[at + i]).sum())
            })
            .collect();
        for s in 0..self.count {
            let at = |a: usize| m + motions.len() * s + a;
            // Mean of each mode's (U, V, W) over the pad of this sleeper.
            let over = |(&(rail, member), [u, v, w]): (&RailMember, &[f64; 3])| {
                let RailOnPads { waves, ahead, .. } = rails[rail];
                let order = waves[member.0].order;
                let [across, along] = shapes(waves, &member).map(|shape| self.at(s, (order, shape), ahead));
                (rail, [across * u, along * v, across * w])
            };
            let moved: Vec<(usize, [f64; 3])> = list.iter().zip(&means).map(over).collect();
            for (matrix, part) in [(&mut *k, 0), (&mut *c, 1)] {
                let of = |rail: usize| if part == 0 { pads[rail].stiffness } else { pads[rail].viscosity };
                for (a, motion) in motions.iter().enumerate() {
                    matrix[(at(a), at(a))] += motion.ballast[part] / motion.mass;
                    for b in 0..motions.len() {
                        let shared = |r: usize| product(&of(r), seats[a][r], seats[b][r]);
                        matrix[(at(a), at(b))] += d * (0..rails.len()).map(shared).sum::<f64>();
                    }
                    for (i, &(rail, moved)) in moved.iter().enumerate() {
                        let force = d * product(&of(rail), seats[a][rail], moved);
                        matrix[(at(a), i)] -= force;
                        matrix[(i, at(a))] -= force;
                    }
                }
            }
        }
    }
}

/// aᵀ S b.
fn product(springs: &[[f64; 3]; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * (0..3).map(|j| springs[i][j] * b[j]).sum::<f64>()).sum()
}

/// Places of the first modes of each order in a list of all.
fn first(waves: &[RailMode]) -> Vec<usize> {
    let before = |sum: &mut usize, w: &RailMode| {
        *sum += w.omega.len();
        Some(*sum - w.omega.len())
    };
    waves.iter().scan(0, before).collect()
}
