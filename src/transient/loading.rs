//! Prescribed quantities in time: load or approach, creepages.

use crate::contact::{Creepage, NormalLoad, PatchKinematics};
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
    pub fn at(&self, t: f64) -> f64 {
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

/// Everything prescribed.
#[derive(Debug, Clone, PartialEq)]
pub struct Loading {
    /// Load or approach. Of several patches it is the rigid motion that they share, which is prescribed: the inertia
    /// of the bodies holds it at all but low frequencies. Approaches of single patches are part of the gaps.
    pub normal: Normal,
    /// Fall of the gap of each patch per unit of that motion, `[patches]`; 1 of one patch.
    pub factors: Vec<f64>,
    /// Rolling of each patch, `[patches]`.
    pub patches: Vec<PatchDrive>,
}

impl Loading {
    /// Load or approach `load` and creepages ξ, η, φ (1, 1, 1/m) of one patch at the speed V, all constant.
    pub fn constant(load: NormalLoad, creepage: Creepage, speed: f64) -> Self {
        Self::of_patch(Normal::constant(load), PatchDrive::constant(PatchKinematics { speed, creepage }))
    }

    /// Loading of an interface of one patch.
    pub fn of_patch(normal: Normal, drive: PatchDrive) -> Self {
        Self { normal, factors: vec![1.0], patches: vec![drive] }
    }

    /// Constant rolling of patches whose approaches stay: they are those of the gaps.
    pub fn held(kinematics: &[PatchKinematics]) -> Self {
        Self {
            normal: Normal::Approach(History::constant(0.0)),
            factors: vec![0.0; kinematics.len()],
            patches: kinematics.iter().copied().map(PatchDrive::constant).collect(),
        }
    }

    /// Refuses a loading that does not belong to `patches` patches, or forces on several of them.
    pub(super) fn check(&self, patches: usize) -> Result<()> {
        if [self.factors.len(), self.patches.len()] != [patches; 2] {
            return Err(Error::Defect(format!("transient: {} drives for {patches} patches", self.patches.len())));
        }
        let force = |t: &Tangential| matches!(t, Tangential::Force(_));
        let forced =
            matches!(self.normal, Normal::Force(_)) || self.patches.iter().any(|p| p.tangential.iter().any(force));
        if patches > 1 && forced {
            return Err(Error::Job(
                "analyses.transient: forces cannot be prescribed on several contact patches so far; give \
                 analyses.transient.hold \"approach\" and creepages"
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
            assert_eq!(h.at(t), want, "at {t} s");
        }
        assert_eq!(History::constant(7.0).at(3.0), 7.0);
        // 0.1 + 0.2 is more than 0.3, by rounding only.
        assert!(History::table("h", &[[0.0, 1.0], [0.3, 1.0]], 0.1 + 0.2).is_ok());
        assert!(History::table("h", &[[0.0, 1.0], [0.3, 1.0]], 0.301).is_err());
    }

    #[test]
    fn creepages_are_velocities_over_the_speed() {
        let creepage = Creepage { longitudinal: 0.1, lateral: 0.2, spin: 0.3 };
        let drive = Loading::constant(NormalLoad::Force(5.0), creepage, 10.0);
        let creep = |v: f64| Tangential::Creep(History::constant(v));
        assert_eq!(drive.patches[0].tangential, [creep(1.0), creep(2.0)]);
        assert_eq!((drive.patches[0].spin.at(0.0), drive.patches[0].speed), (3.0, 10.0));
        assert_eq!((&drive.normal, &drive.factors[..]), (&Normal::Force(History::constant(5.0)), &[1.0][..]));
        let two = Loading { patches: vec![drive.patches[0].clone(); 2], factors: vec![1.0; 2], ..drive.clone() };
        assert!(drive.check(1).is_ok() && drive.check(2).is_err());
        assert!(two.check(2).unwrap_err().message().contains("several contact patches"));
        assert!(Loading { normal: Normal::Approach(History::constant(0.0)), ..two }.check(2).is_ok());
    }
}
