//! A vehicle in a curve, as a job gives it: the problem of steady curving, and the contact of one of its wheels.

use super::wheel_rail_geometry::{material, profile};
use crate::curving::{
    BogieData, BogieWheel, ContactForce, CreepLaw, CurveMotion, CurvingProblem, CurvingSolution, WHEELS,
};
use crate::job::{self, ContactPlaces, ContactWheels, CreepForceLaw, Curve, Job, VehicleData, VehicleWheel};
use crate::output::datasets::curving as datasets;
use crate::output::Table;
use crate::parallel::World;
use crate::placement::read::ProfileKind;
use crate::placement::{MovableWheel, Position, RailSide, WheelPlacement};
use crate::{Error, Result};
use serde_json::{json, Value};
use std::collections::HashMap;

/// A place of contact with less than this share of the load of its wheel is not told of.
const NO_SHARE: f64 = 1e-4;

/// The vehicle of a job in its curve, in equilibrium.
pub struct CurvingVehicle {
    /// The problem.
    pub problem: CurvingProblem,
    /// Its solution.
    pub solution: CurvingSolution,
    /// Notes of the readers of the profiles.
    notes: Vec<String>,
}

/// The problem of `job`, and what was done to its profiles. For one rank: it reads the files of the profiles.
fn problem(job: &Job) -> Result<(CurvingProblem, Vec<String>)> {
    let missing = || Error::Defect("steady curving is asked for of a job without a curve".into());
    let (curve, vehicle) = (job.curve.as_ref().ok_or_else(missing)?, job.vehicle.as_ref().ok_or_else(missing)?);
    let vehicle = vehicle.data();
    let contact = job.contact.as_ref().ok_or_else(missing)?;
    let (lower, upper) =
        (job.bodies.lower.as_ref().ok_or_else(missing)?, job.bodies.upper.as_ref().ok_or_else(missing)?);
    let mut notes = Vec::new();
    let wheel = profile(upper, ProfileKind::Wheel, &mut notes)?;
    let rail = profile(lower, ProfileKind::Rail, &mut notes)?;
    let over = |side| MovableWheel::new(&track(curve, &vehicle, side), &wheel, &rail).map_err(|e| e.context("curve"));
    let problem = CurvingProblem {
        wheels: [over(RailSide::Left)?, over(RailSide::Right)?],
        materials: [material(lower)?, material(upper)?],
        friction: contact.track_friction(),
        law: match curve.creep_law {
            CreepForceLaw::ShenHedrickElkins => CreepLaw::ShenHedrickElkins,
            CreepForceLaw::Polach => CreepLaw::Polach,
            CreepForceLaw::Fastsim => CreepLaw::Fastsim,
        },
        bogie: bogie(&vehicle),
        curve: motion(curve, &vehicle),
    };
    Ok((problem, notes))
}

fn track(curve: &Curve, vehicle: &VehicleData, side: RailSide) -> WheelPlacement {
    WheelPlacement {
        side,
        gauge: curve.gauge + curve.gauge_widening,
        gauge_depth: curve.gauge_depth,
        cant: curve.rail_cant,
        radius: vehicle.wheel_radius,
        circles: vehicle.circles(),
        position: Position::Shift { lateral: 0.0, yaw: 0.0, roll: 0.0 },
        near: None,
    }
}

fn bogie(vehicle: &VehicleData) -> BogieData {
    BogieData {
        half_wheelbase: 0.5 * vehicle.wheelbase,
        axle_load: vehicle.axle_load,
        wheel_radius: vehicle.wheel_radius,
        half_circles: 0.5 * vehicle.circles(),
        primary: [vehicle.primary.longitudinal, vehicle.primary.lateral],
        half_boxes: 0.5 * vehicle.primary.box_distance,
        yaw_stiffness: vehicle.primary.yaw,
        secondary_moment: vehicle.secondary_moment,
        torque: vehicle.torque,
        mass_height: vehicle.centre_of_gravity.unwrap_or(vehicle.wheel_radius),
    }
}

fn motion(curve: &Curve, vehicle: &VehicleData) -> CurveMotion {
    let sign = if curve.direction == job::TrackSide::Right { 1.0 } else { -1.0 };
    CurveMotion {
        curvature: sign / curve.radius,
        speed: curve.speed,
        deficiency: curve.deficiency(vehicle) / vehicle.circles(),
    }
}

fn bogie_wheel(wheel: VehicleWheel) -> BogieWheel {
    let [leading, inner] = wheel.place();
    BogieWheel { leading, inner }
}

impl CurvingVehicle {
    /// The vehicle of `job` in its curve. For one rank.
    ///
    /// # Errors
    /// As [`CurvingProblem::solve`]; profiles that cannot be read.
    pub fn from_job(job: &Job) -> Result<Self> {
        Self::near(job, None)
    }

    /// The vehicle of `job` in its curve, looked for near that of a similar job first. For one rank.
    fn near(job: &Job, similar: Option<&CurvingSolution>) -> Result<Self> {
        let (problem, notes) = problem(job)?;
        let solution = problem.solve_near(similar)?;
        Ok(Self { problem, solution, notes })
    }

    /// Puts `contact` at a place of contact of a wheel.
    pub(super) fn put(&self, contact: &mut job::Contact, wheel: BogieWheel, place: &ContactForce) {
        let axle = &self.solution.axles[usize::from(!wheel.leading)];
        let curve = &self.problem.curve;
        let right = wheel.inner == (curve.curvature > 0.0);
        contact.normal_load = Some(place.normal);
        contact.speed = curve.speed;
        if let Some(placement) = &mut contact.placement {
            placement.side = if right { job::TrackSide::Right } else { job::TrackSide::Left };
            placement.lateral = axle.motion.lateral;
            placement.yaw = axle.motion.yaw;
            placement.roll = axle.motion.roll;
            placement.angular_speed = Some(axle.angular_speed);
            placement.curvature = curve.curvature;
            placement.touch_near = Some(place.place.wheel);
        }
        contact.in_equilibrium = true;
    }

    /// `contact` at the places of the wheel that it names, then, where the job takes both wheels, at those of the other
    /// wheel of its axle.
    fn contacts(&self, contact: &job::Contact) -> Result<Vec<job::Contact>> {
        let missing = || Error::Defect("a contact of a curve without a wheel".into());
        let wheel = bogie_wheel(contact.from.ok_or_else(missing)?.wheel);
        let wheels = match contact.wheels {
            ContactWheels::One => vec![wheel],
            ContactWheels::Both => vec![wheel, BogieWheel { inner: !wheel.inner, ..wheel }],
        };
        let mut all = Vec::new();
        for wheel in wheels {
            let unbalanced = self.left_out(wheel).filter(|_| contact.torque.is_some());
            if let (Some(text), ContactPlaces::One) = (unbalanced, contact.places) {
                return Err(Error::Job(format!(
                    "contact.torque: {text}; a torque is balanced by all contacts of the axle, expected contact.places \
                     = \"all\""
                )));
            }
            all.extend(self.contacts_of(contact, wheel)?);
        }
        Ok(all)
    }

    /// `contact` at the places of a wheel, the one with the largest load first; those behind it only where the job
    /// takes all places.
    fn contacts_of(&self, contact: &job::Contact, wheel: BogieWheel) -> Result<Vec<job::Contact>> {
        let missing = || Error::Defect(format!("the {} wheel carries no load", wheel.name()));
        let mut places: Vec<&ContactForce> = self.solution.wheel(&self.problem, wheel).iter().collect();
        let total: f64 = places.iter().map(|place| place.normal).sum();
        places.sort_by(|a, b| b.normal.total_cmp(&a.normal));
        match contact.places {
            ContactPlaces::One => places.truncate(1),
            ContactPlaces::All => places.retain(|place| place.normal > NO_SHARE * total),
        }
        let at = |place: &&ContactForce| {
            let mut one = job::Contact { further: Vec::new(), ..contact.clone() };
            self.put(&mut one, wheel, place);
            one
        };
        match places.is_empty() {
            true => Err(missing()),
            false => Ok(places.iter().map(at).collect()),
        }
    }

    /// The table of the axles and of all places of contact, one line each.
    pub fn lines(&self) -> Vec<String> {
        let (curve, bogie) = (&self.problem.curve, &self.problem.bogie);
        let mut lines = vec![format!(
            "steady curving: radius {:.6} m to the {}, {:.4} m/s, cant deficiency {:.1} mm, wheelbase {:.6} m, \
             axle load {:.6} kN",
            1.0 / curve.curvature.abs(),
            if curve.curvature > 0.0 { "right" } else { "left" },
            curve.speed,
            2e3 * curve.deficiency * bogie.half_circles,
            2.0 * bogie.half_wheelbase,
            1e-3 * bogie.axle_load
        )];
        for (axle, name) in self.solution.axles.iter().zip(["leading", "trailing"]) {
            let m = &axle.motion;
            lines.push(format!(
                "  {name} axle   shift {:+.3} mm, yaw (angle of attack) {:+.3} mrad, roll {:+.3} mrad, {:.4} \
                 rad/s; suspension {:+.2} kN, {:+.2} kN m",
                1e3 * m.lateral,
                1e3 * m.yaw,
                1e3 * m.roll,
                axle.angular_speed,
                1e-3 * axle.suspension[0],
                1e-3 * axle.suspension[1]
            ));
        }
        lines.push(
            "  wheel            y, mm  angle, mrad  radius, mm    N, kN   xi, %  eta, %  spin, 1/m  Fx, kN   T, \
             kN  lateral, kN  T/(mu N)"
                .into(),
        );
        for wheel in WHEELS {
            for contact in self.solution.wheel(&self.problem, wheel) {
                let [xi, eta, spin] = contact.creepage;
                lines.push(format!(
                    "  {:<15} {:+6.1} {:+12.1} {:11.2} {:8.2} {:+7.3} {:+7.3} {:+10.3} {:+7.2} {:+7.2} {:+12.2} {:9.2}",
                    wheel.name(),
                    1e3 * contact.place.wheel,
                    1e3 * contact.place.angle,
                    1e3 * contact.place.radius,
                    1e-3 * contact.normal,
                    1e2 * xi,
                    1e2 * eta,
                    spin,
                    1e-3 * contact.longitudinal,
                    1e-3 * contact.tangential,
                    1e-3 * contact.lateral(),
                    contact.utilisation()
                ));
            }
        }
        lines.push(
            "  y of the wheel's profile to the field side; angle positive where the rail falls to the right; \
             creepages of rail over wheel; forces on the wheel, \
             Fx forwards, T and lateral to the right"
                .into(),
        );
        lines.extend(self.notes.iter().cloned());
        lines
    }

    /// Warning of the place that is left out of the contact of a wheel with two.
    fn left_out(&self, wheel: BogieWheel) -> Option<String> {
        let places = self.solution.wheel(&self.problem, wheel);
        let total: f64 = places.iter().map(|c| c.normal).sum();
        let heaviest = places.iter().max_by(|a, b| a.normal.total_cmp(&b.normal))?;
        let other = places.iter().find(|c| c.place.wheel != heaviest.place.wheel && c.normal > NO_SHARE * total)?;
        Some(format!(
            "the {} wheel touches at two places: y = {:.1} mm of its profile with {:.2} kN, which is examined, \
             and y = {:.1} mm with {:.2} kN, which is left \
             out ({:.0} % of the normal forces)",
            wheel.name(),
            1e3 * heaviest.place.wheel,
            1e-3 * heaviest.normal,
            1e3 * other.place.wheel,
            1e-3 * other.normal,
            1e2 * other.normal / total
        ))
    }

    /// Warnings about the contact of `job`.
    pub fn warnings(&self, job: &Job) -> Vec<String> {
        let Some(contact) = job.contact.as_ref().filter(|c| c.places == ContactPlaces::One) else { return Vec::new() };
        let Some(wheel) = contact.from.map(|from| bogie_wheel(from.wheel)) else { return Vec::new() };
        let other = BogieWheel { inner: !wheel.inner, ..wheel };
        let both = contact.wheels == ContactWheels::Both;
        [Some(wheel), both.then_some(other)].into_iter().flatten().filter_map(|wheel| self.left_out(wheel)).collect()
    }

    /// The group `/curving`, with the equilibria at the radii of `analyses.curving`.
    ///
    /// # Errors
    /// Curves that are refused before any is solved; single radii that fail are in the table.
    pub fn tables(&self, job: &Job) -> Result<Vec<Table>> {
        let radii =
            job.analyses.curving.as_ref().map(|c| c.radii().map_err(Error::Job)).transpose()?.unwrap_or_default();
        let mut similar: Option<CurvingSolution> = None;
        let mut at = |radius: &f64| {
            let mut problem = self.problem.clone();
            let (curve, vehicle) = (job.curve.as_ref(), job.vehicle.as_ref().map(|v| v.data()));
            if let (Some(curve), Some(vehicle)) = (curve, vehicle) {
                problem.curve = motion(&Curve { radius: *radius, ..curve.clone() }, &vehicle);
            }
            let solution = problem.solve_near(similar.as_ref());
            if let Ok(found) = &solution {
                similar = Some(found.clone());
            }
            (*radius, problem, solution)
        };
        let others: Vec<_> = radii.iter().map(&mut at).collect();
        let mut tables = datasets::tables(&self.problem, &self.solution);
        tables.extend(datasets::tables_of_radii(&others));
        Ok(tables)
    }
}

/// Collective: puts the contact of `job` where the wheel stands that it names, and that of the points of its sweep;
/// points whose curve cannot be run through keep their stand-ins, and are refused by `settle` when they come up.
///
/// # Errors
/// As [`CurvingVehicle::from_job`], for the job's own curve.
pub fn resolve(world: &World, job: &mut Job) -> Result<()> {
    let own = needs_equilibrium(job).then(|| job.clone());
    let found = settle(world, job)?;
    super::contact_places::settle(world, job)?;
    let Some(mut plan) = job.sweep.take() else { return Ok(()) };
    // In the same curve with another friction the vehicle stands nearly as it does in the job itself. No point starts
    // from another one: so none depends on which others there are.
    let runs_alike = |point: &Job| own.as_ref().is_some_and(|own| same_but_for_friction(own, point));
    // Points with the same inputs, the job itself among them, share their place.
    let own_inputs = inputs(job).to_string();
    let mut known: HashMap<String, usize> = HashMap::new();
    for i in 0..plan.points.len() {
        let point = &plan.points[i];
        if !needs_equilibrium(point) {
            continue;
        }
        let wanted = inputs(point).to_string();
        let same = if wanted == own_inputs { Some(&*job) } else { known.get(&wanted).map(|&j| &plan.points[j]) };
        if let Some(same) = same {
            let contact = same.contact.as_ref().map(|c| taken(c, point));
            plan.points[i].contact = contact;
            continue;
        }
        let similar = found.as_ref().filter(|_| runs_alike(point));
        if settle_near(world, &mut plan.points[i], similar).is_ok() {
            known.insert(wanted, i);
        }
    }
    job.sweep = Some(plan);
    Ok(())
}

/// The contact of `point` with the place that the equilibrium of `same` has given it.
fn taken(same: &job::Contact, point: &Job) -> job::Contact {
    let own = point.contact.as_ref().unwrap_or(same);
    job::Contact {
        normal_load: same.normal_load,
        speed: same.speed,
        placement: same.placement.clone(),
        in_equilibrium: same.in_equilibrium,
        further: same.further.clone(),
        ..own.clone()
    }
}

pub(super) fn needs_equilibrium(job: &Job) -> bool {
    job.contact.as_ref().is_some_and(|c| c.from.is_some() && !c.in_equilibrium)
}

/// Keys of a job on which the place of its contact in a curve depends.
fn inputs(job: &Job) -> serde_json::Value {
    let body = |b: &Option<job::Body>| b.as_ref().map(|b| (b.profile.clone(), b.material.clone()));
    let contact = job
        .contact
        .as_ref()
        .map(|c| (c.from, [json!(c.places), json!(c.wheels)], json!([c.friction, c.friction_zones])));
    json!([job.curve, job.vehicle, contact, body(&job.bodies.lower), body(&job.bodies.upper)])
}

/// True if the vehicles of both jobs stand in their curves alike, but for what friction makes of it.
fn same_but_for_friction(a: &Job, b: &Job) -> bool {
    let others = |job: &Job| {
        let body = |b: &Option<job::Body>| b.as_ref().map(|b| (b.profile.clone(), b.material.clone()));
        json!([job.curve, job.vehicle, body(&job.bodies.lower), body(&job.bodies.upper)])
    };
    others(a) == others(b)
}

/// Collective: puts the contact of `job` where the wheel stands that it names, if it does not yet. Returns the
/// equilibrium on rank 0, where one was looked for.
pub(crate) fn settle(world: &World, job: &mut Job) -> Result<Option<CurvingSolution>> {
    settle_near(world, job, None)
}

/// The same, with the equilibrium looked for near a `similar` one, that of rank 0, first.
fn settle_near(world: &World, job: &mut Job, similar: Option<&CurvingSolution>) -> Result<Option<CurvingSolution>> {
    if !needs_equilibrium(job) {
        return Ok(None);
    }
    let found = world.on_root(|| {
        let curving = CurvingVehicle::near(job, similar)?;
        let contacts = job.contact.as_ref().map_or(Ok(Vec::new()), |c| curving.contacts(c))?;
        let bytes = serde_json::to_vec(&contacts).map_err(|e| Error::Defect(format!("contact in a curve: {e}")))?;
        Ok((bytes, curving.solution))
    })?;
    let (bytes, solution) = found.unzip();
    let bytes = world.broadcast(bytes.unwrap_or_default());
    let wrong = |e: &dyn std::fmt::Display| Error::Defect(format!("contact in a curve: {e}"));
    let value: Value = serde_json::from_slice(&bytes).map_err(|e| wrong(&e))?;
    let contacts: Vec<job::Contact> = job::from_json(&value).map_err(|e| wrong(&e))?;
    let mut settled = contacts.into_iter().map(|c| job::Contact { in_equilibrium: true, ..c });
    let Some(first) = settled.next() else { return Ok(solution) };
    job.contact = Some(job::Contact { further: settled.collect(), ..first });
    Ok(solution)
}
