//! The lateral shift at which a wheel exerts a given vertical force on its rail and bears a given lateral one.
//!
//! Each place has the normal force N of Hertz' contact and the tangential force T of a creep law, as of a vehicle in
//! its curve ([`crate::curving`]). At each shift y the height follows from the vertical force, and the shift from the
//! lateral one:
//!
//! Q = Σ (N cos δ − T sin δ),   Y(y) = Σ (N sin δ + T cos δ).
//!
//! A wheel that is pushed towards its flange is pushed back: Y falls with y. A shift with the opposite slope is no
//! equilibrium that a wheel would stay in.

use super::contact_places::{height_under, loaded, wheel_over_rail, LoadedPlace, HEAVIER};
use crate::curving::{ContactForce, CreepLaw, CurveMotion, Kinematics, PlaceLaws};
use crate::job::{Job, TrackSide};
use crate::placement::{ContactPlace, MovableWheel};
use crate::{Error, Result};

/// Largest shift that is tried, and the distance of the shifts from each other, m.
const FARTHEST: f64 = 15e-3;
const STEP: f64 = 0.1e-3;
const HALVINGS: usize = 50;
/// Part of the vertical force by which the lateral one may be missed.
const ACCURACY: f64 = 1e-6;

/// A wheel under a vertical force that may be shifted.
struct ShiftedWheel<'a> {
    movable: MovableWheel,
    laws: PlaceLaws<'a>,
    motion: Kinematics,
    right: bool,
    vertical: f64,
}

/// The wheel at a shift under its vertical force.
struct AtShift {
    lateral: f64,
    places: Vec<ContactPlace>,
    forces: Vec<ContactForce>,
}

impl AtShift {
    /// Lateral force on the wheel, N, positive to the right.
    fn force(&self) -> f64 {
        self.forces.iter().filter(|f| f.is_loaded()).map(ContactForce::lateral).sum()
    }
}

impl ShiftedWheel<'_> {
    /// Forces at the `places` of the wheel under `load` times its vertical force.
    fn forces(&self, places: &[ContactPlace], load: f64) -> Result<Vec<ContactForce>> {
        let first = places.iter().map(|p| p.distance).fold(f64::INFINITY, f64::min);
        let at = |height: f64| -> Result<Vec<ContactForce>> {
            let of =
                |&p: &ContactPlace| ContactForce::at_height(&self.laws, (p, self.right), first + height, self.motion);
            places.iter().map(of).collect()
        };
        let total = |height: f64| -> Result<f64> {
            Ok(at(height)?.iter().filter(|f| f.is_loaded()).map(|f| -f.vertical()).sum())
        };
        at(height_under(load * self.vertical, total)?)
    }

    fn at(&self, lateral: f64) -> Result<AtShift> {
        self.on(lateral, self.movable.places(lateral, self.motion.yaw, self.motion.roll)?)
    }

    fn on(&self, lateral: f64, places: Vec<ContactPlace>) -> Result<AtShift> {
        let forces = self.forces(&places, 1.0)?;
        Ok(AtShift { lateral, places, forces })
    }

    /// The wheel at the shifts at which it lies over its rail; the first error of its forces where there are none.
    fn at_all(&self) -> Result<Vec<AtShift>> {
        let count = (FARTHEST / STEP).round() as i32;
        let (mut tried, mut failed) = (Vec::new(), None);
        for lateral in (-count..=count).map(|k| f64::from(k) * STEP) {
            let Ok(places) = self.movable.places(lateral, self.motion.yaw, self.motion.roll) else { continue };
            match self.on(lateral, places) {
                Ok(at) => tried.push(at),
                Err(e) => failed = failed.or(Some(e)),
            }
        }
        match failed {
            Some(e) if tried.is_empty() => Err(e),
            _ => Ok(tried),
        }
    }

    /// The places that carry load at a shift.
    fn loaded(&self, at: &AtShift) -> Result<Vec<LoadedPlace>> {
        let heavier = self.forces(&at.places, HEAVIER)?;
        let normal = |of: &[ContactForce]| of.iter().map(|f| f.normal.max(0.0)).collect::<Vec<f64>>();
        Ok(loaded(&at.places, self.vertical, [&normal(&at.forces), &normal(&heavier)]))
    }

    /// The shift between two others at which the lateral force is `wanted`, N; none where it jumps over it.
    fn between(&self, [mut low, mut high]: [f64; 2], wanted: f64) -> Result<Option<AtShift>> {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            match self.at(middle)?.force() > wanted {
                true => low = middle,
                false => high = middle,
            }
        }
        let found = self.at(high)?;
        Ok(((found.force() - wanted).abs() <= ACCURACY * self.vertical).then_some(found))
    }
}

/// The shift of the wheel of `job`, m, under a vertical and a lateral force, N, and its loaded places there.
///
/// # Errors
/// No shift with this force, several of them, or one at which a single place carries the wheel.
pub(super) fn balance(job: &Job, [vertical, wanted]: [f64; 2]) -> Result<(f64, Vec<LoadedPlace>)> {
    let missing = || Error::Defect("a lateral force is asked for of a job without a placement".into());
    let (contact, placement) = (job.contact.as_ref().ok_or_else(missing)?, job.placement().ok_or_else(missing)?);
    let (movable, materials) = wheel_over_rail(job)?;
    let speed = placement.speed.unwrap_or(contact.speed);
    let turning = placement.angular_speed.map_or(1.0 / placement.radius, |angular| angular / speed);
    let given = &placement.creepage;
    let wheel = ShiftedWheel {
        movable,
        laws: PlaceLaws {
            materials,
            friction: &contact.track_friction(),
            law: CreepLaw::ShenHedrickElkins,
            curve: &CurveMotion { curvature: placement.curvature, speed, deficiency: 0.0 },
        },
        motion: Kinematics {
            yaw: placement.yaw,
            roll: placement.roll,
            turning,
            given: [given.longitudinal, given.lateral, given.spin],
        },
        right: placement.side == TrackSide::Right,
        vertical,
    };
    let tried = wheel.at_all()?;
    let mut found = Vec::new();
    for pair in tried.windows(2) {
        let [low, high] = [&pair[0], &pair[1]];
        if low.force() > wanted && high.force() <= wanted && high.lateral - low.lateral < 1.5 * STEP {
            found.extend(wheel.between([low.lateral, high.lateral], wanted)?);
        }
    }
    let told = |at: &AtShift| format!("{:.4} mm", 1e3 * at.lateral);
    match &found[..] {
        [] => Err(not_borne(&tried, wanted)),
        [one] => match wheel.loaded(one)? {
            places if places.len() > 1 => Ok((one.lateral, places)),
            _ => Err(Error::Job(format!(
            "contact.lateral_force: found {wanted} N, which one place of contact carries, at a shift of {}; expected \
             a force that two places share. One place has the lateral force that its contact angle and friction \
             give: give contact.placement.lateral in the place of contact.lateral_force",
            told(one)
        ))),
        },
        several => Err(Error::Job(format!(
            "contact.lateral_force: found {wanted} N, which the wheel bears at several shifts ({}); expected one: give \
             contact.placement.lateral in the place of contact.lateral_force",
            several.iter().map(told).collect::<Vec<_>>().join(", ")
        ))),
    }
}

/// Error of a force that the wheel bears at none of the shifts that were `tried`.
fn not_borne(tried: &[AtShift], wanted: f64) -> Error {
    let [Some(first), Some(last)] = [tried.first(), tried.last()] else {
        return Error::Job(
            "contact.lateral_force: the wheel lies over its rail at no shift; expected a placement in which it does: \
             see gauge, circles, yaw and roll of contact.placement"
                .into(),
        );
    };
    let forces = || tried.iter().map(AtShift::force);
    let (least, most) = (forces().fold(f64::INFINITY, f64::min), forces().fold(f64::NEG_INFINITY, f64::max));
    let crossed = tried.windows(2).find(|pair| (pair[0].force() - wanted) * (pair[1].force() - wanted) <= 0.0);
    if let Some(pair) = crossed {
        return Error::Job(format!(
            "contact.lateral_force: found {wanted} N, which the wheel bears at no shift that it would stay at: near \
             {:.1} mm its lateral force jumps over it, or grows with the shift; give contact.placement.lateral in the \
             place of contact.lateral_force",
            1e3 * pair[1].lateral
        ));
    }
    Error::Job(format!(
        "contact.lateral_force: found {wanted} N on the wheel, positive to the right; expected from {least:.0} to \
         {most:.0} N, which this wheel bears at shifts from {:.1} to {:.1} mm: beyond that it climbs its rail",
        1e3 * first.lateral,
        1e3 * last.lateral
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::example;

    /// The wheel of a job under 60 kN at `lateral`, m, or under a lateral force, N.
    fn wheel(lateral: Option<f64>) -> Job {
        let mut sets: Vec<String> = [
            "contact.places=all",
            "contact.normal_load=null",
            "contact.vertical_load=60e3",
            "contact.placement.side=right",
            "contact.placement.yaw=0.019",
        ]
        .map(String::from)
        .to_vec();
        sets.extend(lateral.map(|y| format!("contact.placement.lateral={y}")));
        example::wheel_on_rail(&sets.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// A wheel between flange root and flange is shifted farther by a larger lateral force, and its mirror image on the
    /// other rail by the opposite force to the opposite side.
    #[test]
    fn the_shift_follows_the_lateral_force() {
        let mut job = wheel(Some(0.0));
        let (found, places) = balance(&job, [60e3, -30e3]).unwrap();
        assert!((6.2e-3..6.8e-3).contains(&found), "{found}");
        assert!(places.len() == 2 && places.iter().all(|p| p.force > 5e3), "{places:?}");
        let placement = job.contact.as_mut().unwrap().placement.as_mut().unwrap();
        (placement.side, placement.yaw) = (TrackSide::Left, -placement.yaw);
        let (mirrored, other) = balance(&job, [60e3, 30e3]).unwrap();
        assert!((mirrored + found).abs() < 1e-9, "{mirrored} and {found}");
        assert!((other[0].force / places[0].force - 1.0).abs() < 1e-6, "{other:?}, {places:?}");
        let more = balance(&wheel(Some(0.0)), [60e3, -32e3]).unwrap().0;
        assert!(more > found, "{more} and {found}");
        let error = balance(&job, [60e3, 200e3]).unwrap_err().to_string();
        assert!(error.contains("climbs its rail"), "{error}");
    }
}
