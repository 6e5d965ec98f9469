//! Prescribed quantities in time: load or approach, creepages.

use super::border::Border;
use crate::contact::{ContactCreepage, LoadedMotion, Loads, NormalLoad, PatchKinematics};
use crate::{Error, Result};

/// A quantity as a function of time: straight lines between the points of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct History {
    points: Vec<(f64, f64)>,
}

impl History {
    /// The same value at all times.
    pub fn constant(value: f64) -> Self {
        Self { points: vec![(0.0, value)] }
    }

    /// The table `points` of (time in s, value) for a run from 0 to `duration`; `key` names it in messages.
    pub fn table(key: &str, points: &[[f64; 2]], duration: f64) -> Result<Self> {
        let Some((first, last)) = points.first().zip(points.last()) else {
            return Err(Error::Job(format!("{key}: the table has no points")));
        };
        if let Some(p) = points.iter().find(|p| !(p[0].is_finite() && p[1].is_finite())) {
            return Err(Error::Job(format!("{key}: {p:?} is not a pair of numbers")));
        }
        if let Some(w) = points.windows(2).find(|w| w[1][0] <= w[0][0]) {
            return Err(Error::Job(format!(
                "{key}: time goes from {} s to {} s; the times of a table must ascend",
                w[0][0], w[1][0]
            )));
        }
        // The last step may end a rounding error after the last point.
        if first[0] > 0.0 || last[0] < duration * (1.0 - 1e-12) {
            return Err(Error::Job(format!(
                "{key}: the table goes from {} s to {} s, but the run from 0 to {duration} s; give values for \
                 all of it",
                first[0], last[0]
            )));
        }
        Ok(Self { points: points.iter().map(|p| (p[0], p[1])).collect() })
    }

    /// The same with a constant added.
    pub fn plus(mut self, value: f64) -> Self {
        self.points.iter_mut().for_each(|p| p.1 += value);
        self
    }

    /// The value at time `t`, s; outside the table that of its end.
    pub fn value(&self, t: f64) -> f64 {
        let after = self.points.partition_point(|p| p.0 <= t);
        match (after.checked_sub(1).map(|i| self.points[i]), self.points.get(after)) {
            (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (t - a.0) / (b.0 - a.0),
            (Some(a), None) => a.1,
            (None, Some(b)) => b.1,
            (None, None) => 0.0,
        }
    }
}

/// Prescribed relative motion in one tangential direction.
#[derive(Debug, Clone, PartialEq)]
pub enum Tangential {
    /// Rigid creep velocity at the origin, m/s.
    Creep(History),
    /// Total force on body 1, N; the creep velocity is found.
    Force(History),
}

/// Prescribed normal motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Normal {
    /// Total normal force, N; the approach, which is massless, is found at each step.
    Force(History),
    /// Approach of the bodies, m.
    Approach(History),
}

impl Normal {
    /// Constant load or approach.
    pub fn constant(load: NormalLoad) -> Self {
        match load {
            NormalLoad::Force(f) => Normal::Force(History::constant(f)),
            NormalLoad::Approach(d) => Normal::Approach(History::constant(d)),
        }
    }
}

/// Rolling of one contact patch in time.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchDrive {
    /// Creep or force along x and y; the force of one patch alone.
    pub tangential: [Tangential; 2],
    /// Spin ωz1 − ωz2, rad/s.
    pub spin: History,
    /// Rolling speed V ≥ 0, m/s.
    pub speed: f64,
}

impl PatchDrive {
    /// Constant creepages and speed.
    pub fn constant(kinematics: PatchKinematics) -> Self {
        let PatchKinematics { speed, creepage } = kinematics;
        let creep = |c: f64| Tangential::Creep(History::constant(c * speed));
        Self {
            tangential: [creep(creepage.longitudinal), creep(creepage.lateral)],
            spin: History::constant(creepage.spin * speed),
            speed,
        }
    }
}

/// A rigid motion of the bodies towards each other in time. It moves along the normals of the patches alone.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivenMotion {
    /// Fall of the gap of each patch per unit of the motion, `[patches]`.
    pub factors: Vec<f64>,
    /// Row (g_x, g_y, g_n) of each patch in the resultant, `[patches]`.
    pub resultant: Vec<[f64; 3]>,
    /// The resultant, at the end of each step, or the motion: its inertia holds it at all but low frequencies.
    pub normal: Normal,
}

impl DrivenMotion {
    /// The border of a motion with the resultant `total`, N, which is the load of the patches where `loads` says so.
    pub(super) fn border(&self, total: f64, loads: Vec<bool>) -> Border {
        let column = self.factors.iter().map(|&n| [0.0, 0.0, n]).collect();
        Border { column, row: self.resultant.clone(), total, loads }
    }
}

/// Everything prescribed.
#[derive(Debug, Clone, PartialEq)]
pub struct Loading {
    /// Rigid motions: of one patch its approach; of several one of each, or motions that they share.
    pub motions: Vec<DrivenMotion>,
    /// Rolling of each patch, `[patches]`.
    pub patches: Vec<PatchDrive>,
}

impl Loading {
    /// Load or approach `load` and creepages ξ, η, φ (1, 1, 1/m) of one patch at the speed V, all constant.
    pub fn constant(load: NormalLoad, creepage: ContactCreepage, speed: f64) -> Self {
        Self::of_patch(Normal::constant(load), PatchDrive::constant(PatchKinematics { speed, creepage }))
    }

    /// Loading of an interface of one patch.
    pub fn of_patch(normal: Normal, drive: PatchDrive) -> Self {
        let motion = DrivenMotion { factors: vec![1.0], resultant: vec![[0.0, 0.0, 1.0]], normal };
        Self { motions: vec![motion], patches: vec![drive] }
    }

    /// Rolling of patches under constant `loads`.
    pub fn of_loads(loads: &Loads, patches: Vec<PatchDrive>) -> Self {
        let motion = |m: &LoadedMotion| DrivenMotion {
            factors: m.factors.clone(),
            resultant: m.resultant.clone(),
            normal: Normal::constant(m.load),
        };
        Self { motions: loads.motions.iter().map(motion).collect(), patches }
    }

    /// The same with the rigid motions held at `motions`, m, `[motions]`.
    pub fn held_at(mut self, motions: &[f64]) -> Self {
        for (motion, &d) in self.motions.iter_mut().zip(motions) {
            motion.normal = Normal::Approach(History::constant(d));
        }
        self
    }

    /// Approach of each patch under the `motions`, m, `[patches]`; or the rates of the ones by those of the others.
    pub(super) fn approaches(&self, motions: &[f64]) -> Vec<f64> {
        let of = |c: usize| self.motions.iter().zip(motions).map(|(m, d)| m.factors[c] * d).sum();
        (0..self.patches.len()).map(of).collect()
    }

    /// Returns whether a resultant is prescribed in place of a rigid motion.
    pub(super) fn is_loaded(&self) -> bool {
        self.motions.iter().any(|m| matches!(m.normal, Normal::Force(_)))
    }

    /// The motion whose resultant is the load of patch `c`: the first one that moves it.
    fn leading(&self, c: usize) -> Option<usize> {
        self.motions.iter().position(|m| m.factors[c] != 0.0)
    }

    /// Returns for each patch whether the resultant of motion `j` is its load.
    pub(super) fn loaded_by(&self, j: usize) -> Vec<bool> {
        (0..self.patches.len()).map(|c| self.leading(c) == Some(j)).collect()
    }

    /// Returns whether patch `c` stays open at the time `t` (s), because nothing presses it.
    pub(super) fn is_open(&self, c: usize, t: f64) -> bool {
        // A resultant of 0 beside that of another motion of the same patches is a balance of forces.
        let alone = |j: usize, (c, &n): (usize, &f64)| n == 0.0 || (n > 0.0 && self.leading(c) == Some(j));
        let lifted = |(j, m): (usize, &DrivenMotion)| match &m.normal {
            Normal::Force(history) => {
                m.factors[c] != 0.0
                    && history.value(t) == 0.0
                    && m.factors.iter().enumerate().all(|factor| alone(j, factor))
            }
            Normal::Approach(_) => false,
        };
        self.motions.iter().enumerate().any(lifted)
    }

    /// Refuses a loading that does not belong to `patches` patches, or tangential forces on several of them.
    pub(super) fn check(&self, patches: usize) -> Result<()> {
        let fits = |m: &DrivenMotion| [m.factors.len(), m.resultant.len()] == [patches; 2];
        if self.patches.len() != patches || !self.motions.iter().all(fits) {
            return Err(Error::Defect(format!("transient: {} drives for {patches} patches", self.patches.len())));
        }
        let force = |t: &Tangential| matches!(t, Tangential::Force(_));
        if patches > 1 && self.patches.iter().any(|p| p.tangential.iter().any(force)) {
            return Err(Error::Job(
                "analyses.transient: tangential forces cannot be prescribed on several contact patches; expected \
                 creepages"
                    .into(),
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_history_is_straight_between_its_points_and_stays_outside() {
        let h = History::table("h", &[[-1.0, 4.0], [1.0, 2.0], [2.0, 5.0]], 2.0).unwrap();
        for (t, want) in [(-3.0, 4.0), (-1.0, 4.0), (0.0, 3.0), (1.0, 2.0), (1.5, 3.5), (2.0, 5.0), (9.0, 5.0)] {
            assert_eq!(h.value(t), want, "at {t} s");
        }
        assert_eq!(History::constant(7.0).value(3.0), 7.0);
        // 0.1 + 0.2 is more than 0.3, by rounding only.
        assert!(History::table("h", &[[0.0, 1.0], [0.3, 1.0]], 0.1 + 0.2).is_ok());
        assert!(History::table("h", &[[0.0, 1.0], [0.3, 1.0]], 0.301).is_err());
    }

    #[test]
    fn creepages_are_velocities_over_the_speed() {
        let creepage = ContactCreepage { longitudinal: 0.1, lateral: 0.2, spin: 0.3 };
        let drive = Loading::constant(NormalLoad::Force(5.0), creepage, 10.0);
        let creep = |v: f64| Tangential::Creep(History::constant(v));
        assert_eq!(drive.patches[0].tangential, [creep(1.0), creep(2.0)]);
        assert_eq!((drive.patches[0].spin.value(0.0), drive.patches[0].speed), (3.0, 10.0));
        let motion = &drive.motions[0];
        assert_eq!((&motion.normal, &motion.factors[..]), (&Normal::Force(History::constant(5.0)), &[1.0][..]));
        let loads = Loads::of_patches(&[NormalLoad::Force(5.0), NormalLoad::Force(0.0)]);
        let mut two = Loading::of_loads(&loads, vec![drive.patches[0].clone(); 2]);
        assert!(drive.check(1).is_ok() && drive.check(2).is_err() && two.check(2).is_ok());
        assert!(!two.is_open(0, 0.0) && two.is_open(1, 0.0) && two.is_loaded());
        let held = two.clone().held_at(&[1e-5, 2e-5]);
        assert!(!held.is_loaded() && !held.is_open(1, 0.0) && held.approaches(&[1e-5, 2e-5]) == [1e-5, 2e-5]);
        two.patches[1].tangential[0] = Tangential::Force(History::constant(1.0));
        assert!(two.check(2).unwrap_err().message().contains("several contact patches"));
    }
}
