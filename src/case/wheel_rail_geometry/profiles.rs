//! Profiles, materials and position of wheel and rail as a job gives them, and advice on measured profiles.

use super::PlacedContact;
use crate::job::{self, Job, Profile};
use crate::placement::read::{read, ProfileKind, Reading, Vertical};
use crate::placement::{self, builtin, Position, WheelPlacement};
use crate::{Error, Result};

/// Young's modulus, Pa, and Poisson's ratio of a body.
pub(in crate::case) fn material(body: &job::Body) -> Result<(f64, f64)> {
    let m = body.elastic()?;
    Ok((m.young, m.poisson))
}

/// The profile of a body, and what was done to it.
pub(in crate::case) fn profile(
    body: &job::Body,
    kind: ProfileKind,
    notes: &mut Vec<String>,
) -> Result<placement::RunningProfile> {
    match &body.profile {
        Some(Profile::S1002) => builtin::s1002(),
        Some(Profile::Uic60) => builtin::uic60(),
        Some(Profile::File(file)) => {
            let &job::ProfileFile { unit, mirror, circle, smoothing, .. } = file;
            let z = file.z.map(|z| match z {
                job::ProfileVertical::Down => Vertical::Down,
                job::ProfileVertical::Up => Vertical::Up,
            });
            let (profile, found) = read(&file.path, &Reading { kind, unit, z, mirror, circle, smoothing })?;
            notes.extend(found);
            Ok(profile)
        }
        Some(profile) => match profile.rail() {
            Some(rail) => builtin::rail(rail),
            None => Err(Error::Defect("a built-in profile that is neither that of a wheel nor of a rail".into())),
        },
        None => Err(Error::Defect("a profile is asked for of a body without one".into())),
    }
}

pub(in crate::case) fn description(given: &job::Placement) -> WheelPlacement {
    let &job::Placement { radius, gauge, gauge_depth, cant, circles, lateral, yaw, roll, .. } = given;
    WheelPlacement {
        side: match given.side {
            job::TrackSide::Left => placement::RailSide::Left,
            job::TrackSide::Right => placement::RailSide::Right,
        },
        gauge,
        gauge_depth,
        cant,
        radius,
        circles,
        near: given.touch_near,
        position: match given.contact {
            Some(job::GivenContact { wheel, rail }) => Position::Contact { wheel, rail, yaw },
            None => Position::Shift { lateral, yaw, roll },
        },
    }
}

/// Advice where measured profiles that are not smoothed do not touch as profiles do.
pub(super) fn unsmoothed(job: &Job) -> Option<String> {
    let bodies = job.bodies();
    let raw = bodies.iter().find_map(|(name, body)| match &body.profile {
        Some(Profile::File(file)) if file.smoothing == 0.0 => Some((name, file)),
        _ => None,
    });
    raw.map(|(name, file)| {
        format!(
            "{} is taken without smoothing: noise of a measurement makes curvatures of its own. Give \
             bodies.{name}.profile.file.smoothing, 0.003 to 0.01 m, if it was measured",
            file.path.display()
        )
    })
}

/// Smoothing that shows whether noise rules the contact of profiles that are not smoothed, m; and the part by which
/// Hertz' pressure may differ with it.
const SMOOTHED: f64 = 0.005;
const NOISY: f64 = 0.25;

/// Warning of measured profiles that are not smoothed, where the contact depends on it.
pub(in crate::case) fn noise(job: &Job, placed: &PlacedContact) -> Option<String> {
    let hint = unsmoothed(job)?;
    let mut job = job.clone();
    for body in [&mut job.bodies.lower, &mut job.bodies.upper].into_iter().flatten() {
        match &mut body.profile {
            Some(Profile::File(file)) if file.smoothing == 0.0 => file.smoothing = SMOOTHED,
            _ => {}
        }
    }
    let smoothed = PlacedContact::resolve(&job, job.contact.as_ref()?).ok()?.ellipse.pressure;
    let pressure = placed.ellipse.pressure;
    ((pressure / smoothed).ln().abs() > NOISY).then(|| {
        format!(
            "{hint}. Hertz' pressure is {:.0} MPa as it is, and {:.0} MPa with {SMOOTHED} m",
            1e-6 * pressure,
            1e-6 * smoothed
        )
    })
}
