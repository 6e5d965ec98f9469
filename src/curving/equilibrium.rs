//! Equilibrium of both axles and the frame: shift and yaw of the axles by Newton's method with damped steps.

use super::axle::{norm, solve, Axle, AxleMotion, AxleState, Balance};
use super::{BogieWheel, ContactForce, CurvingProblem};
use crate::{Error, Result};

/// Largest steps of a shift, m, and of a yaw, rad.
const LARGEST_STEP: [f64; 2] = [0.4e-3, 2e-3];

/// Residual of lateral forces and yaw moments, over those of an axle's load, that is aimed at, and that is accepted
/// where rounding or a break of a profile leaves no more.
const AIM: f64 = 1e-9;
const ACCEPTED: f64 = 1e-7;
const MOST_STEPS: usize = 60;

/// Halvings of a step that does not make the residual smaller.
const HALVINGS: i32 = 5;

/// Steps one after the other that do not make the residual smaller, after which a search gives up.
const MOST_VAIN: usize = 5;

/// Shifts of the leading axle outwards, m, shares of the wheelbase's angle 2b/R of its yaw, and shifts of the trailing
/// axle outwards, m, at which the search begins, one after the other: near flange contact, then farther from it.
const STARTS: [[f64; 3]; 7] = [
    [6.2e-3, 0.8, 1.2e-3],
    [6.24e-3, 0.8, -1.0e-3],
    [5.5e-3, 0.6, 1.0e-3],
    [6.2e-3, 0.9, -4.5e-3],
    [3.0e-3, 0.5, 0.6e-3],
    [0.5e-3, 0.5, 0.1e-3],
    [6.6e-3, 1.0, 1.3e-3],
];

/// Continuations: ratio of the first curvature to the last, first coefficient of friction, and the smallest step over
/// the last value.
const WIDE: f64 = 0.1;
const SLIPPERY: f64 = 0.35;
const SMALLEST_STEP: f64 = 1.0 / 512.0;

/// Both axles in equilibrium with the frame.
#[derive(Debug, Clone, PartialEq)]
pub struct CurvingSolution {
    /// Leading and trailing axle.
    pub axles: [AxleState; 2],
    /// Shift, m, and yaw, rad, of the frame in the middle of the wheelbase.
    pub frame: [f64; 2],
    /// Largest residual: lateral force and vertical force over the load of an axle, moments over load times half the
    /// distance of the running circles or the wheel radius.
    pub residual: f64,
    /// Newton steps of the last start.
    pub steps: usize,
}

impl CurvingSolution {
    /// The places of contact of a wheel of `problem`, the one with the largest approach first.
    pub fn wheel(&self, problem: &CurvingProblem, wheel: BogieWheel) -> &[ContactForce] {
        let right = wheel.inner == (problem.curve.curvature > 0.0);
        &self.axles[usize::from(!wheel.leading)].wheels[usize::from(right)]
    }
}

/// Shift and yaw of the leading axle, then of the trailing one.
type Shifts = [f64; 4];

/// A Newton step.
struct NewtonStep {
    /// Changes of the shifts.
    shifts: Shifts,
    /// Changes of the motions of both axles that follow: height, roll and rotation; shift and yaw are set by `shifts`.
    motions: [[f64; 5]; 2],
}

/// A state of the search: both axles settled at their shifts.
#[derive(Clone)]
struct Iterate {
    shifts: Shifts,
    motions: [AxleMotion; 2],
    sums: [Balance; 2],
    residual: [f64; 4],
}

impl CurvingProblem {
    /// The equilibrium.
    ///
    /// # Errors
    /// [`Error::NotConverged`] where none was found; what no vehicle does: a wheel without load, three places
    /// of contact on
    /// a wheel, a wheel that climbs; those of the placement.
    pub fn solve(&self) -> Result<CurvingSolution> {
        self.solve_near(None)
    }

    /// The equilibrium, with the search beginning at that of a similar problem.
    ///
    /// # Errors
    /// As [`CurvingProblem::solve`].
    pub(crate) fn solve_near(&self, similar: Option<&CurvingSolution>) -> Result<CurvingSolution> {
        self.refuse_impossible()?;
        let near = similar.map(|s| [s.axles[0].motion, s.axles[1].motion]);
        let found = near.and_then(|m| self.newton([m[0].lateral, m[0].yaw, m[1].lateral, m[1].yaw], Some(m)).ok());
        match found.filter(|s| self.refuse_unsound(s).is_ok()) {
            Some(found) => Ok(found),
            None => self.search(),
        }
    }

    /// From less friction where there is much, from the starts, from a wider curve, one after the other.
    fn search(&self) -> Result<CurvingSolution> {
        let starts = self.starts();
        let much = self.friction.largest() > SLIPPERY;
        let mut failure = None;
        for found in (much.then(|| self.with_friction_raised(&starts)).into_iter())
            .chain(starts.iter().map(|start| self.starting_at(start)))
            .chain(std::iter::once_with(|| self.with_curve_narrowed()))
        {
            match found.and_then(|s| self.sound(s)) {
                Ok(sound) => return Ok(sound),
                Err(e) => failure = worst(failure, e),
            }
        }
        Err(failure.unwrap_or_else(|| Error::Defect("curving: no start".into())))
    }

    /// From one of the [`STARTS`].
    fn starting_at(&self, &[shift, share, trailing]: &[f64; 3]) -> Result<CurvingSolution> {
        let curvature = self.curve.curvature;
        let outwards = -curvature.signum() * f64::from(curvature != 0.0);
        let yaw = -share * 2.0 * self.bogie.half_wheelbase * curvature;
        self.newton([outwards * shift, yaw, outwards * trailing, 0.0], None)
    }

    /// The solution, unless it is none of wheels that roll on their rails.
    fn sound(&self, solution: CurvingSolution) -> Result<CurvingSolution> {
        self.refuse_unsound(&solution)?;
        Ok(solution)
    }

    /// The starts in the order in which they are tried: in a wide curve the axles run far from flange contact.
    fn starts(&self) -> Vec<[f64; 3]> {
        let mut starts = STARTS.to_vec();
        // The shift at which a cone of 1:20 rolls freely.
        let rolling = 20.0 * self.bogie.half_circles * self.bogie.wheel_radius * self.curve.curvature.abs();
        starts.sort_by(|a, b| {
            (a[0] - rolling.min(STARTS[0][0])).abs().total_cmp(&(b[0] - rolling.min(STARTS[0][0])).abs())
        });
        starts
    }

    /// The equilibrium by continuation from a coefficient of friction of [`SLIPPERY`], where the starts are nearer to
    /// it.
    fn with_friction_raised(&self, starts: &[[f64; 3]]) -> Result<CurvingSolution> {
        let part = SLIPPERY / self.friction.largest();
        let at = |part: f64| CurvingProblem { friction: self.friction.scaled(part), ..self.clone() };
        let first = starts.iter().find_map(|start| at(part).starting_at(start).and_then(|s| at(part).sound(s)).ok());
        let first = first.ok_or_else(|| Error::NotConverged("curving: no equilibrium with less friction".into()))?;
        self.continued(at, (part, first), 0.5 * (1.0 - part))
    }

    /// The equilibrium by continuation from a curve that is ten times as wide.
    fn with_curve_narrowed(&self) -> Result<CurvingSolution> {
        let at = |part: f64| {
            let mut problem = self.clone();
            problem.curve.curvature *= part;
            problem
        };
        let outwards = -self.curve.curvature.signum();
        let first = at(WIDE).newton([outwards * 2e-3, 0.0, outwards * 1e-3, 0.0], None)?;
        self.continued(at, (WIDE, first), 0.5 * WIDE)
    }

    /// The equilibrium of `at(1)` by continuation from that of `at(part)`, with a first step of `step`.
    fn continued(
        &self,
        at: impl Fn(f64) -> CurvingProblem,
        (mut part, mut here): (f64, CurvingSolution),
        mut step: f64,
    ) -> Result<CurvingSolution> {
        while part < 1.0 {
            let next = (part + step).min(1.0);
            let motions = [here.axles[0].motion, here.axles[1].motion];
            let shifts = [motions[0].lateral, motions[0].yaw, motions[1].lateral, motions[1].yaw];
            match at(next).newton(shifts, Some(motions)) {
                Ok(found) => {
                    (here, part) = (found, next);
                    step *= 1.5;
                }
                Err(e) if step < SMALLEST_STEP => return Err(e),
                Err(_) => step *= 0.5,
            }
        }
        Ok(here)
    }

    /// Forces and moments of the suspension on both axles, and shift and yaw of the frame.
    fn suspension(&self, [y1, yaw1, y2, yaw2]: Shifts) -> ([[f64; 2]; 2], [f64; 2]) {
        let b = self.bogie.half_wheelbase;
        let curvature = self.curve.curvature;
        let [along, across] = self.bogie.primary;
        let turn = 2.0 * along * self.bogie.half_boxes * self.bogie.half_boxes + self.bogie.yaw_stiffness;
        // Σ Y = 0 and Σ (s b Y + M) = secondary moment, solved for the frame.
        let shift = 0.5 * (y1 + y2) + 0.5 * b * b * curvature;
        let stiffness = 4.0 * across * b * b + 2.0 * turn;
        let yaw = match stiffness > 0.0 {
            true => (self.bogie.secondary_moment + 2.0 * across * b * (y1 - y2) + turn * (yaw1 + yaw2)) / stiffness,
            false => 0.0,
        };
        let on_axle = |s: f64, y: f64, axle_yaw: f64| {
            let force = -2.0 * across * (y - shift - s * b * yaw + 0.5 * b * b * curvature);
            [force, -turn * (axle_yaw - yaw + s * b * curvature)]
        };
        ([on_axle(1.0, y1, yaw1), on_axle(-1.0, y2, yaw2)], [shift, yaw])
    }

    /// Sums of lateral force and yaw moment on both axles, scaled as [`Balance`] is.
    fn residual(&self, shifts: Shifts, sums: &[Balance; 2]) -> [f64; 4] {
        let (suspension, _) = self.suspension(shifts);
        let (w, l) = (self.bogie.axle_load, self.bogie.half_circles);
        let of = |k: usize| [sums[k][3] + suspension[k][0] / w, sums[k][4] + suspension[k][1] / (w * l)];
        let ([a, b], [c, d]) = (of(0), of(1));
        [a, b, c, d]
    }

    fn axle(&self, number: usize) -> Axle<'_> {
        Axle { problem: self, number }
    }

    fn settled(&self, shifts: Shifts, near: [AxleMotion; 2]) -> Result<Iterate> {
        let at = |k: usize| {
            let motion = AxleMotion { lateral: shifts[2 * k], yaw: shifts[2 * k + 1], ..near[k] };
            // Where the neighbour's height is too far off, the first touch is a better start.
            self.axle(k).settle(motion).or_else(|_| {
                let touch = self.axle(k).first_touch(motion.lateral, motion.yaw)?;
                self.axle(k).settle(touch)
            })
        };
        let (first, second) = (at(0)?, at(1)?);
        let sums = [first.1, second.1];
        Ok(Iterate { shifts, motions: [first.0, second.0], sums, residual: self.residual(shifts, &sums) })
    }

    fn newton(&self, shifts: Shifts, near: Option<[AxleMotion; 2]>) -> Result<CurvingSolution> {
        let near = match near {
            Some(near) => near,
            None => [self.axle(0).first_touch(shifts[0], shifts[1])?, self.axle(1).first_touch(shifts[2], shifts[3])?],
        };
        let mut here = self.settled(shifts, near)?;
        let mut best = here.clone();
        let (mut steps, mut vain) = (0, 0);
        while norm(&here.residual) > AIM && steps < MOST_STEPS && vain < MOST_VAIN {
            steps += 1;
            let Some(NewtonStep { shifts: step, motions }) = self.step(&here)? else { break };
            let before = norm(&here.residual);
            let mut next = None;
            for halving in 0..HALVINGS {
                let part = 0.5_f64.powi(halving);
                let shifts = [0, 1, 2, 3].map(|k| here.shifts[k] + part * step[k]);
                let near = [0, 1].map(|k| here.motions[k].plus([0, 1, 2, 3, 4].map(|j| part * motions[k][j])));
                let Ok(trial) = self.settled(shifts, near) else { continue };
                let smaller = norm(&trial.residual) < before;
                next = Some(trial);
                if smaller {
                    break;
                }
            }
            let Some(next) = next else { break };
            here = next;
            vain += 1;
            if norm(&here.residual) < norm(&best.residual) {
                (best, vain) = (here.clone(), 0);
            } else if norm(&best.residual) <= ACCEPTED {
                break;
            }
        }
        let residual = norm(&best.residual);
        if !(residual <= ACCEPTED) {
            // Where a wheel climbs or lifts there is no equilibrium: that is what to say.
            let reason = self.solution(&best, steps).and_then(|s| self.refuse_unsound(&s));
            return Err(reason.err().unwrap_or_else(|| self.not_found(&best)));
        }
        self.solution(&best, steps)
    }

    /// The Newton step of the shifts, cut to the largest, and of both motions; none where the derivative is singular.
    fn step(&self, here: &Iterate) -> Result<Option<NewtonStep>> {
        let mut jacobian = [[0.0; 4]; 4];
        let mut follow = [[[0.0; 2]; 3]; 2];
        for k in 0..2 {
            let tangent = self.axle(k).tangent(&here.motions[k], &here.sums[k])?;
            follow[k] = tangent.follow;
            for i in 0..2 {
                for j in 0..2 {
                    jacobian[2 * k + i][2 * k + j] = tangent.loads[i][j];
                }
            }
        }
        // The suspension is linear: a difference of any size is its derivative.
        let none = [[0.0; 5]; 2];
        let rest = self.residual([0.0; 4], &none);
        for j in 0..4 {
            let mut unit = [0.0; 4];
            unit[j] = 1.0;
            let moved = self.residual(unit, &none);
            (0..4).for_each(|i| jacobian[i][j] += moved[i] - rest[i]);
        }
        let Some(mut step) = solve(jacobian, here.residual.map(|r| -r)) else { return Ok(None) };
        let over = (0..4).map(|k| step[k].abs() / LARGEST_STEP[k % 2]).fold(1.0, f64::max);
        step.iter_mut().for_each(|s| *s /= over);
        let motions = [0, 1].map(|k| {
            let inner = [0, 1, 2].map(|i| follow[k][i][0] * step[2 * k] + follow[k][i][1] * step[2 * k + 1]);
            // Shift and yaw are set by themselves.
            [inner[0], inner[1], inner[2], 0.0, 0.0]
        });
        Ok(Some(NewtonStep { shifts: step, motions }))
    }

    fn solution(&self, found: &Iterate, steps: usize) -> Result<CurvingSolution> {
        let (suspension, frame) = self.suspension(found.shifts);
        let axle = |k: usize| self.axle(k).state(found.motions[k], suspension[k]);
        let inner = found.sums.iter().flat_map(|s| s[..3].to_vec());
        let residual = inner.chain(found.residual).fold(0.0, |worst: f64, r| worst.max(r.abs()));
        Ok(CurvingSolution { axles: [axle(0)?, axle(1)?], frame, residual, steps })
    }

    fn not_found(&self, best: &Iterate) -> Error {
        let [y1, yaw1, y2, yaw2] = best.shifts;
        let worst = best.residual.iter().fold(0.0_f64, |w, r| w.max(r.abs()));
        Error::NotConverged(format!(
            "curving: no equilibrium was found; nearest to one with the leading axle at {:.3} mm and {:.3} \
             mrad, the trailing one at {:.3} mm \
             and {:.3} mrad, where a lateral force or yaw moment of {:.1e} of that of the load is left. Try \
             another radius nearby, a lower \
             friction, or a softer primary suspension; a wheel may be about to climb",
            1e3 * y1,
            1e3 * yaw1,
            1e3 * y2,
            1e3 * yaw2,
            worst
        ))
    }
}

/// The first error, unless a later one says more: of a search that did not converge nothing is said where another is
/// refused for a reason.
fn worst(first: Option<Error>, later: Error) -> Option<Error> {
    match first {
        Some(Error::NotConverged(_)) if !matches!(later, Error::NotConverged(_)) => Some(later),
        Some(first) => Some(first),
        None => Some(later),
    }
}
