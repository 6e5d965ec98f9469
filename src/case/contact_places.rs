//! The places where a wheel carries load on its rail under a vertical force, and those of both wheels of a wheelset, as
//! contacts of a job.

use super::lateral_shift;
use super::wheel_rail_geometry::{description, material, profile};
use crate::job::{self, ContactPlaces, ContactWheels, Job, TrackSide};
use crate::parallel::World;
use crate::placement::read::ProfileKind;
use crate::placement::{ContactPlace, Ellipse, HertzLoad, MovableWheel};
use crate::{Error, Result};

/// Load at which places are looked for, over the given one: a place that is just open has a grid as well.
pub(super) const HEAVIER: f64 = 1.3;
/// Part of the load below which a place is left out.
const SMALL: f64 = 1e-3;
/// Largest approach that is tried, m.
const DEEPEST: f64 = 1e-3;
const HALVINGS: usize = 80;

/// A place that carries load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LoadedPlace {
    /// Position on the wheel's profile, m.
    pub wheel: f64,
    /// Estimate of the normal force, N.
    pub force: f64,
}

/// The same contact at the other wheel of its wheelset.
fn at_other_wheel(contact: &job::Contact) -> job::Contact {
    let mut other = contact.clone();
    if let Some(placement) = &mut other.placement {
        placement.side = match placement.side {
            TrackSide::Left => TrackSide::Right,
            TrackSide::Right => TrackSide::Left,
        };
    }
    other
}

/// Collective: gives the contact of `job` a contact for each place that carries its vertical load, the heaviest first,
/// or one at the other wheel, if it asks for them and does not have them yet.
pub(crate) fn settle(world: &World, job: &mut Job) -> Result<()> {
    let Some(contact) = &mut job.contact else { return Ok(()) };
    if contact.wheels == ContactWheels::Both && contact.from.is_none() {
        contact.further = vec![at_other_wheel(&job::Contact { further: Vec::new(), ..contact.clone() })];
        return bear_axle_load(world, job);
    }
    let Some(load) = contact.vertical_load.filter(|_| contact.places == ContactPlaces::All) else { return Ok(()) };
    if contact.normal_load.is_some() {
        return Ok(());
    }
    let lateral = contact.lateral_force;
    let found = world.on_root(|| {
        let (shift, places) = match lateral {
            Some(lateral) => lateral_shift::balance(job, [load, lateral]).map(|found| (Some(found.0), found.1))?,
            None => (None, spread(job, load)?),
        };
        Ok(shift.into_iter().chain(places.into_iter().flat_map(|p| [p.wheel, p.force])).collect::<Vec<f64>>())
    })?;
    let found = world.broadcast(found.unwrap_or_default());
    let (shift, places) = found.split_at(usize::from(lateral.is_some()).min(found.len()));
    let Some(contact) = &mut job.contact else { return Ok(()) };
    if let (Some(placement), Some(&shift)) = (&mut contact.placement, shift.first()) {
        placement.lateral = shift;
    }
    let base = contact.clone();
    let mut all = places.chunks_exact(2).map(|place| {
        let mut one = job::Contact { normal_load: Some(place[1]), ..base.clone() };
        one.placement.iter_mut().for_each(|p| p.touch_near = Some(place[0]));
        one
    });
    let missing = || Error::Defect("a wheel without a place of contact".into());
    *contact = all.next().ok_or_else(missing)?;
    contact.further = all.collect();
    Ok(())
}

/// Collective: gives both wheels of `job` the normal forces that follow from its axle load, if it has one.
fn bear_axle_load(world: &World, job: &mut Job) -> Result<()> {
    let Some(axle_load) = job.contact.as_ref().and_then(|contact| contact.axle_load) else { return Ok(()) };
    let found = world.on_root(|| at_both_wheels(job, axle_load).map(|found| found.to_vec()))?;
    let found = world.broadcast(found.unwrap_or_default());
    let wheels = job.contact.iter_mut().flat_map(|contact| {
        let job::Contact { normal_load, further, .. } = contact;
        std::iter::once(normal_load).chain(further.iter_mut().map(|other| &mut other.normal_load))
    });
    wheels.zip(found).for_each(|(normal_load, force)| *normal_load = Some(force));
    Ok(())
}

/// Normal forces, N, at both wheels of `job` in the order of its contacts, under the axle load Q, N, and the roll
/// moment M, N m. Of the vertical forces V = N cos δ at the places y of first touch, to the right, V_1 + V_2 = Q and
/// y_1 V_1 + y_2 V_2 = M. The part that friction has in them is left out.
fn at_both_wheels(job: &Job, load: f64) -> Result<[f64; 2]> {
    let missing = || Error::Defect("an axle load of a job without both wheels".into());
    let contact = job.contact.as_ref().ok_or_else(missing)?;
    let touch = |one: &job::Contact| -> Result<ContactPlace> {
        let alone = Job { contact: Some(job::Contact { further: Vec::new(), ..one.clone() }), ..job.clone() };
        let given = alone.placement().ok_or_else(missing)?;
        let (movable, _) = wheel_over_rail(&alone)?;
        let places = movable.places(given.lateral, given.yaw, given.roll);
        places.map_err(|e| e.context("contact.placement"))?.first().copied().ok_or_else(missing)
    };
    let [one, other] = [touch(contact)?, touch(contact.further.first().ok_or_else(missing)?)?];
    let moment = contact.roll_moment;
    let second = (moment - one.across * load) / (other.across - one.across);
    let vertical = [load - second, second];
    if !vertical.iter().all(|force| *force > 0.0) {
        let [low, high] = [one.across.min(other.across) * load, one.across.max(other.across) * load];
        return Err(Error::Job(format!(
            "contact.roll_moment: found {moment} N m, which lifts a wheel under contact.axle_load = {load} N; expected \
             between {low:.0} and {high:.0} N m"
        )));
    }
    Ok([vertical[0] / one.angle.cos(), vertical[1] / other.angle.cos()])
}

/// The wheel of `job` over its rail, with Young's moduli, Pa, and Poisson's ratios of rail and wheel.
pub(super) fn wheel_over_rail(job: &Job) -> Result<(MovableWheel, [(f64, f64); 2])> {
    let missing = || Error::Defect("a placement is asked for of a job without one".into());
    let given = job.placement().ok_or_else(missing)?;
    let (lower, upper) =
        (job.bodies.lower.as_ref().ok_or_else(missing)?, job.bodies.upper.as_ref().ok_or_else(missing)?);
    let wheel = profile(upper, ProfileKind::Wheel, &mut Vec::new())?;
    let rail = profile(lower, ProfileKind::Rail, &mut Vec::new())?;
    let movable = MovableWheel::new(&description(given), &wheel, &rail).map_err(|e| e.context("contact.placement"))?;
    Ok((movable, [material(lower)?, material(upper)?]))
}

/// Height of the wheel below first touch, m, at which the vertical force that it exerts is the `load`, N; `total` is
/// that force at a height.
pub(super) fn height_under(load: f64, total: impl Fn(f64) -> Result<f64>) -> Result<f64> {
    let (mut low, mut high) = (0.0, DEEPEST);
    if total(high)? < load {
        return Err(Error::Job(format!(
            "contact.vertical_load: found {load} N, under which the wheel would approach the rail by more than \
             {DEEPEST} m; expected the vertical force on one wheel in N"
        )));
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match total(middle)? < load {
            true => low = middle,
            false => high = middle,
        }
    }
    Ok(high)
}

/// The places that carry a load of a wheel, the heaviest first, from the normal forces of the `places` under the
/// vertical `load` and under a heavier one, N.
pub(super) fn loaded(places: &[ContactPlace], load: f64, [carried, heavier]: [&[f64]; 2]) -> Vec<LoadedPlace> {
    let mut loaded: Vec<LoadedPlace> = places
        .iter()
        .zip(carried.iter().zip(heavier))
        .filter(|(_, (_, heavier))| **heavier > SMALL * load)
        .map(|(place, (carried, heavier))| LoadedPlace { wheel: place.wheel, force: carried.max(0.5 * heavier) })
        .collect();
    loaded.sort_by(|a, b| b.force.total_cmp(&a.force));
    loaded
}

/// The loaded places of the wheel of `job`, by Hertz' contact at each: with the height d of the wheel below first
/// touch, the approach of a place that is D above it is (d − D) cos δ, and Σ N cos δ = Q.
fn spread(job: &Job, load: f64) -> Result<Vec<LoadedPlace>> {
    let missing = || Error::Defect("a placement is asked for of a job without one".into());
    let given = job.placement().ok_or_else(missing)?;
    let (movable, materials) = wheel_over_rail(job)?;
    let soft = materials.map(|(young, poisson)| (1.0 - poisson * poisson) / young);
    let modulus = 1.0 / (soft[0] + soft[1]);
    let places =
        movable.places(given.lateral, given.yaw, given.roll).map_err(|e: Error| e.context("contact.placement"))?;
    let first = places.iter().map(|p| p.distance).fold(f64::INFINITY, f64::min);
    let force = |place: &ContactPlace, height: f64| -> Result<f64> {
        let approach = place.angle.cos() * (height - (place.distance - first));
        if approach <= 0.0 {
            return Ok(0.0);
        }
        let [along, across] = place.curvature;
        let ellipse = Ellipse::new([[along, 0.0], [0.0, across]], modulus, HertzLoad::Approach(approach))?;
        Ok(place.share * ellipse.force)
    };
    let under = |wanted: f64| -> Result<Vec<f64>> {
        let total = |height: f64| -> Result<f64> { places.iter().map(|p| Ok(force(p, height)? * p.angle.cos())).sum() };
        let height = height_under(wanted, total)?;
        places.iter().map(|p| force(p, height)).collect()
    };
    Ok(loaded(&places, load, [&under(load)?, &under(HEAVIER * load)?]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::example;

    /// In the middle of the track the wheels of an axle share its load, and a roll moment M moves M/2y of it to the one
    /// on the right, at the place y; one that would lift a wheel is refused.
    #[test]
    fn both_wheels_bear_an_axle_load() {
        let forces = |moment: f64| {
            let mut job = example::wheel_on_rail(&[
                "contact.wheels=both",
                r#"bodies.upper.mesh={"revolved": {"section": "W920S-wheelset"}}"#,
                r#"bodies.upper.suspension={"longitudinal": 1e7, "lateral": 5e6, "vertical": 1e6}"#,
                "bodies.upper.fixed=[]",
                "contact.normal_load=null",
                "contact.axle_load=120e3",
                "contact.placement.lateral=0",
                "contact.placement.yaw=0",
                "contact.placement.side=right",
                &format!("contact.roll_moment={moment}"),
            ]);
            let contact = job.contact.as_mut().expect("a contact");
            contact.further = vec![at_other_wheel(contact)];
            at_both_wheels(&job, 120e3)
        };
        let [right, left] = forces(0.0).unwrap();
        assert!((right / left - 1.0).abs() < 1e-9 && (60e3..60.3e3).contains(&right), "{right} {left}");
        let [right, left] = forces(9e3).unwrap();
        assert!(((right - left) / (9e3 / 0.75) - 1.0).abs() < 0.01, "{right} {left}");
        let refused = forces(1e5).unwrap_err().to_string();
        assert!(refused.contains("contact.roll_moment: found 100000 N m, which lifts a wheel"), "{refused}");
    }

    /// New S1002 on 60E1 1:40, circles 1500: two places share 60 kN at a shift of 5 mm, and one carries it at 0.
    #[test]
    fn two_places_share_the_load_of_a_wheel_between_tread_and_gauge_corner() {
        let at = |lateral: f64| {
            let job = example::wheel_on_rail(&[
                "contact.places=all",
                "contact.normal_load=null",
                "contact.vertical_load=60e3",
                &format!("contact.placement.lateral={lateral}"),
            ]);
            spread(&job, 60e3).unwrap()
        };
        let both = at(4.95e-3);
        assert_eq!(both.len(), 2, "{both:?}");
        let normal: f64 = both.iter().map(|place| place.force).sum();
        assert!(both[1].force > 5e3 && (60e3..62e3).contains(&normal), "{both:?}");
        assert_eq!(at(-3e-3).len(), 1);
    }
}
