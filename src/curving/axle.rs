//! Forces and moments on one axle, and its height, roll and speed of rotation under a given shift and yaw.

use super::contact_force::{ContactForce, Kinematics};
use super::CurvingProblem;
use crate::placement::ContactPlace;
use crate::{Error, Result};

/// Approach with which the search for the height begins, m.
const FIRST_APPROACH: f64 = 75e-6;

/// Largest Newton steps of height, of roll times half the distance of the circles, m, and of the speed of rotation, 1.
const LARGEST_STEP: [f64; 3] = [60e-6, 60e-6, 4e-3];

/// Differences for the Jacobian: height, m, roll, rad, speed of rotation, 1, shift, m, yaw, rad.
const DIFFERENCE: [f64; 5] = [1e-9, 1e-9, 1e-8, 1e-8, 1e-8];

/// Residual of load, roll moment and torque, over those of the axle, at which height, roll and speed are accepted.
const BALANCED: f64 = 1e-10;

/// Residual at which they are accepted where no step makes it smaller: the share of a fading place is known to so many
/// digits only.
const NOISE: f64 = 5e-8;
const MOST_STEPS: usize = 24;

/// Position and rotation of an axle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AxleMotion {
    /// Height below one radius over the rails' tops, m.
    pub height: f64,
    /// Roll, rad: positive lowers the right-hand wheel.
    pub roll: f64,
    /// Ω r0/V − 1: positive where the axle turns faster than on its running circles.
    pub turning: f64,
    /// Shift to the right, m.
    pub lateral: f64,
    /// Yaw to the right, rad.
    pub yaw: f64,
}

impl AxleMotion {
    fn numbers(&self) -> [f64; 5] {
        [self.height, self.roll, self.turning, self.lateral, self.yaw]
    }

    fn of([height, roll, turning, lateral, yaw]: [f64; 5]) -> Self {
        Self { height, roll, turning, lateral, yaw }
    }

    /// The motion changed by `step`, in the order of the fields.
    pub(super) fn plus(&self, step: [f64; 5]) -> Self {
        let here = self.numbers();
        Self::of([0, 1, 2, 3, 4].map(|k| here[k] + step[k]))
    }
}

/// Sums over the places of contact of an axle, each over a force or moment of its load: vertical, roll, torque,
/// lateral, yaw.
pub(super) type Balance = [f64; 5];

/// An axle with its places of contact.
#[derive(Debug, Clone, PartialEq)]
pub struct AxleState {
    /// Position and rotation.
    pub motion: AxleMotion,
    /// Angular speed Ω, rad/s.
    pub angular_speed: f64,
    /// Places of contact of the left-hand and of the right-hand wheel, the nearest first.
    pub wheels: [Vec<ContactForce>; 2],
    /// Lateral force, N, and yaw moment, N m, of the suspension on the axle.
    pub suspension: [f64; 2],
}

/// The places of contact of both wheels, which height and rotation do not change.
type Places = [Vec<ContactPlace>; 2];

/// Derivatives of an axle by its shift and its yaw.
pub(super) struct AxleTangent {
    /// Lateral force and yaw moment, scaled as [`Balance`] is.
    pub loads: [[f64; 2]; 2],
    /// Height, roll and speed of rotation.
    pub follow: [[f64; 2]; 3],
}

/// One axle of a problem: 0 the leading one, 1 the trailing one.
pub(super) struct Axle<'a> {
    pub problem: &'a CurvingProblem,
    pub number: usize,
}

impl Axle<'_> {
    fn places(&self, motion: &AxleMotion) -> Result<Places> {
        let [left, right] = &self.problem.wheels;
        let of = |w: &crate::placement::MovableWheel| w.places(motion.lateral, motion.yaw, motion.roll);
        Ok([of(left)?, of(right)?])
    }

    /// Forces at the places of contact. A wheel without contact has the nearest place alone.
    fn forces(&self, places: &Places, motion: &AxleMotion) -> Result<[Vec<ContactForce>; 2]> {
        let turning = (1.0 + motion.turning) / self.problem.bogie.wheel_radius;
        let kinematics = Kinematics { yaw: motion.yaw, roll: motion.roll, turning, given: [None; 3] };
        let laws = self.problem.place_laws();
        let of = |places: &[ContactPlace], right: bool| -> Result<Vec<ContactForce>> {
            let at = |&p: &ContactPlace| ContactForce::at_height(&laws, (p, right), motion.height, kinematics);
            let all = places.iter().map(at);
            let mut all = all.collect::<Result<Vec<_>>>()?;
            let closed = all.iter().filter(|c| c.is_loaded()).count();
            all.sort_by(|a, b| b.approach.total_cmp(&a.approach));
            all.truncate(closed.max(1));
            Ok(all)
        };
        Ok([of(&places[0], false)?, of(&places[1], true)?])
    }

    /// Sums of the contact forces and the load of the axle. Suspension and the lateral force of the curve are not in
    /// it.
    fn balance(&self, places: &Places, motion: &AxleMotion) -> Result<Balance> {
        let bogie = &self.problem.bogie;
        let mut sum = [0.0; 5];
        for c in self.forces(places, motion)?.iter().flatten() {
            let [ahead, right] = c.place.arm;
            let (lateral, vertical) = (c.lateral(), c.vertical());
            sum[0] += vertical;
            sum[1] += right * vertical - c.place.radius * lateral;
            sum[2] += c.place.radius * (c.longitudinal + c.tangential * motion.yaw / c.place.angle.cos());
            sum[3] += lateral;
            sum[4] += ahead * lateral - right * c.longitudinal;
        }
        let side = self.lateral_load();
        sum[0] += bogie.axle_load;
        sum[1] += side * (bogie.mass_height - bogie.wheel_radius);
        sum[2] -= bogie.torque[self.number];
        sum[3] += side;
        let (w, l, r) = (bogie.axle_load, bogie.half_circles, bogie.wheel_radius);
        let scale = [w, w * l, w * r, w, w * l];
        Ok([0, 1, 2, 3, 4].map(|k| sum[k] / scale[k]))
    }

    /// Lateral force of the curve on the axle, N: outwards where the cant is too small.
    fn lateral_load(&self) -> f64 {
        let curve = &self.problem.curve;
        let outwards = if curve.curvature > 0.0 { -1.0 } else { 1.0 };
        match curve.curvature == 0.0 {
            true => 0.0,
            false => outwards * self.problem.bogie.axle_load * curve.deficiency,
        }
    }

    /// Height and roll at which both wheels just touch, then a usual approach; free rolling on the circles of contact.
    pub fn first_touch(&self, lateral: f64, yaw: f64) -> Result<AxleMotion> {
        let mut motion = AxleMotion { lateral, yaw, ..AxleMotion::default() };
        let half = self.problem.bogie.half_circles;
        for _ in 0..20 {
            let places = self.places(&motion)?;
            let [left, right] = [0, 1].map(|k| places[k].first().map_or(0.0, |p| p.distance));
            motion.height = 0.5 * (left + right) + FIRST_APPROACH;
            let turn = (right - left) / (2.0 * half);
            motion.roll += turn;
            if turn.abs() < 1e-9 {
                break;
            }
        }
        let places = self.places(&motion)?;
        let radii: f64 = places.iter().filter_map(|p| p.first()).map(|p| p.radius).sum();
        motion.turning = 2.0 * self.problem.bogie.wheel_radius / radii - 1.0;
        Ok(motion)
    }

    /// Height, roll and speed of rotation that balance load, roll moment and torque, from the start `motion`, by
    /// Newton's method; and the sums that are left, those of lateral force and yaw moment among them.
    ///
    /// # Errors
    /// [`Error::NotConverged`]; those of the placement.
    pub fn settle(&self, motion: AxleMotion) -> Result<(AxleMotion, Balance)> {
        let mut here = motion;
        let mut places = self.places(&here)?;
        let mut rest = self.balance(&places, &here)?;
        let half = self.problem.bogie.half_circles;
        for _ in 0..MOST_STEPS {
            if rest[..3].iter().all(|r| r.abs() <= BALANCED) {
                return Ok((here, rest));
            }
            let mut jacobian = [[0.0; 3]; 3];
            for k in 0..3 {
                let column = self.column(&places, &here, &rest, k)?;
                (0..3).for_each(|i| jacobian[i][k] = column[i]);
            }
            let Some(mut step) = solve(jacobian, [-rest[0], -rest[1], -rest[2]]) else { break };
            let size = [step[0].abs(), half * step[1].abs(), step[2].abs()];
            let over = (0..3).map(|k| size[k] / LARGEST_STEP[k]).fold(1.0, f64::max);
            step.iter_mut().for_each(|s| *s /= over);
            // Half the step where the sums do not become smaller; the smallest step is taken in any case.
            let before = norm(&rest[..3]);
            for halving in 0..6 {
                let part = 0.5_f64.powi(halving);
                let trial = here.plus([part * step[0], part * step[1], part * step[2], 0.0, 0.0]);
                let Ok(there) = self.places(&trial) else { continue };
                let sums = self.balance(&there, &trial)?;
                let smaller = norm(&sums[..3]) < before;
                if !smaller && before <= NOISE {
                    return Ok((here, rest));
                }
                if smaller || halving == 5 {
                    (here, places, rest) = (trial, there, sums);
                    break;
                }
            }
        }
        Err(Error::NotConverged(format!(
            "curving: height, roll and rotation of the {} axle at a shift of {:.3} mm and a yaw of {:.3} mrad \
             were not found: load, roll \
             moment and torque are off by {:.1e}, {:.1e} and {:.1e} of those of the axle",
            ["leading", "trailing"][self.number],
            1e3 * here.lateral,
            1e3 * here.yaw,
            rest[0],
            rest[1],
            rest[2]
        )))
    }

    /// Derivative of the sums by the number `k` of the motion.
    fn column(&self, places: &Places, motion: &AxleMotion, rest: &Balance, k: usize) -> Result<Balance> {
        let mut step = [0.0; 5];
        step[k] = DIFFERENCE[k];
        let moved = motion.plus(step);
        // Height and rotation leave the places where they are.
        let there = match k {
            0 | 2 => self.balance(places, &moved)?,
            _ => self.balance(&self.places(&moved)?, &moved)?,
        };
        Ok([0, 1, 2, 3, 4].map(|i| (there[i] - rest[i]) / DIFFERENCE[k]))
    }

    /// Derivatives by shift and yaw at a settled motion, with height, roll and rotation in balance.
    pub fn tangent(&self, motion: &AxleMotion, rest: &Balance) -> Result<AxleTangent> {
        let places = self.places(motion)?;
        let mut jacobian = [[0.0; 5]; 5];
        for k in 0..5 {
            let column = self.column(&places, motion, rest, k)?;
            (0..5).for_each(|i| jacobian[i][k] = column[i]);
        }
        let inner = [0, 1, 2].map(|i| [jacobian[i][0], jacobian[i][1], jacobian[i][2]]);
        let mut follow = [[0.0; 2]; 3];
        for k in 0..2 {
            let right = [0, 1, 2].map(|i| -jacobian[i][3 + k]);
            let column = solve(inner, right).ok_or_else(|| {
                Error::NotConverged("curving: the load of an axle does not fix its height, roll and rotation".into())
            })?;
            (0..3).for_each(|i| follow[i][k] = column[i]);
        }
        let total = |i: usize, k: usize| {
            jacobian[3 + i][3 + k] + (0..3).map(|j| jacobian[3 + i][j] * follow[j][k]).sum::<f64>()
        };
        Ok(AxleTangent { loads: [[total(0, 0), total(0, 1)], [total(1, 0), total(1, 1)]], follow })
    }

    /// The axle at a settled motion.
    pub fn state(&self, motion: AxleMotion, suspension: [f64; 2]) -> Result<AxleState> {
        let wheels = self.forces(&self.places(&motion)?, &motion)?;
        let angular_speed = (1.0 + motion.turning) * self.problem.curve.speed / self.problem.bogie.wheel_radius;
        Ok(AxleState { motion, angular_speed, wheels, suspension })
    }
}

/// Euclidean norm.
pub(super) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The solution of a small system by elimination with pivoting; none of a singular one.
pub(super) fn solve<const N: usize>(mut a: [[f64; N]; N], mut b: [f64; N]) -> Option<[f64; N]> {
    for k in 0..N {
        let pivot = (k..N).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs()))?;
        if !(a[pivot][k].abs() > f64::MIN_POSITIVE) {
            return None;
        }
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..N {
            let factor = a[i][k] / a[k][k];
            for j in k..N {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..N).rev() {
        let known: f64 = (k + 1..N).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    b.iter().all(|x| x.is_finite()).then_some(b)
}
