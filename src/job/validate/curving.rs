//! Rules of a vehicle in a curve.

use super::super::model::*;

/// Gravity, m/s².
pub const GRAVITY: f64 = 9.806_65;

/// Adds the faults of a job with a curve or a vehicle.
pub fn check(job: &Job, faults: &mut Vec<String>) {
    let (Some(curve), Some(vehicle)) = (&job.curve, &job.vehicle) else {
        for (key, other, given) in
            [("curve", "vehicle", job.curve.is_some()), ("vehicle", "curve", job.vehicle.is_some())]
        {
            if given {
                faults.push(format!(
                    "{other}: missing; {key} is given, and steady curving takes both: give both or none"
                ));
            }
        }
        if job.analyses.curving.is_some() && job.curve.is_none() && job.vehicle.is_none() {
            faults.push("curve, vehicle: missing; analyses.curving is the equilibrium of a vehicle in a curve".into());
        }
        return;
    };
    let vehicle = vehicle.data();
    check_curve(curve, &vehicle, faults);
    check_vehicle(curve, &vehicle, faults);
    if job.contact.is_none() {
        faults.push("contact: missing; steady curving needs contact.friction".into());
    }
    for (name, body) in [("lower", &job.bodies.lower), ("upper", &job.bodies.upper)] {
        match body {
            None => faults.push(format!("bodies.{name}: missing; steady curving needs both bodies")),
            Some(body) if body.profile.is_none() => faults.push(format!(
                "bodies.{name}.profile: missing; steady curving needs the profiles of the wheel (upper) and of \
                 the rail (lower)"
            )),
            Some(_) => {}
        }
    }
    if let Some(Err(fault)) = job.analyses.curving.as_ref().map(Curving::radii) {
        faults.push(format!("analyses.curving.radii: {fault}"));
    }
}

fn check_curve(curve: &Curve, vehicle: &VehicleData, faults: &mut Vec<String>) {
    if curve.radius < 10.0 {
        faults.push(format!(
            "curve.radius: found {} m, expected at least 10 m; a radius of {} km is {} m",
            curve.radius,
            curve.radius,
            1e3 * curve.radius
        ));
    }
    if curve.speed > 120.0 {
        faults.push(format!(
            "curve.speed: found {} m/s, expected at most 120 m/s; {} km/h are {:.2} m/s",
            curve.speed,
            curve.speed,
            curve.speed / 3.6
        ));
    }
    if let Some(cant) = curve.cant.filter(|c| *c > 0.3) {
        let wrong = if cant <= 15.0 { "degrees" } else { "mm" };
        faults.push(format!(
            "curve.cant: found {cant} m, expected at most 0.3 m, the height of the outer rail above the inner \
             one; it looks like {wrong}"
        ));
    }
    if let Some(missing) = curve.cant_deficiency.filter(|c| c.abs() > 0.35) {
        faults.push(format!(
            "curve.cant_deficiency: found {missing} m, expected at most 0.35 m in magnitude; 100 mm are 0.1 m"
        ));
    }
    if curve.cant.is_some() && curve.cant_deficiency.is_some() {
        faults.push(
            "curve: both cant and cant_deficiency are given; give one of them, or none for the cant of equilibrium"
                .into(),
        );
    }
    let deficiency = curve.deficiency(vehicle);
    // A cant that is wrong by itself has its own fault.
    if curve.cant.is_some_and(|cant| cant <= 0.3) && deficiency.abs() > 0.35 {
        faults.push(format!(
            "curve.speed: {} m/s on a radius of {} m with this cant is a cant deficiency of {:.0} mm, expected \
             at most 350 mm in magnitude; \
             is the speed in km/h? {} km/h are {:.2} m/s",
            curve.speed,
            curve.radius,
            1e3 * deficiency,
            curve.speed,
            curve.speed / 3.6
        ));
    }
    if curve.gauge_widening > 0.04 {
        faults.push(format!(
            "curve.gauge_widening: found {} m, expected at most 0.04 m; 10 mm are 0.01 m",
            curve.gauge_widening
        ));
    }
    if curve.rail_cant.abs() > 0.2 {
        faults.push(format!(
            "curve.rail_cant: found {} rad, expected at most 0.2 rad: 1:40 is 0.025 rad, 1:20 is 0.05 rad",
            curve.rail_cant
        ));
    }
}

fn check_vehicle(curve: &Curve, vehicle: &VehicleData, faults: &mut Vec<String>) {
    if !(0.5..=25.0).contains(&vehicle.wheelbase) {
        faults.push(format!(
            "vehicle.wheelbase: found {} m, expected from 0.5 to 25 m, the distance of two axles",
            vehicle.wheelbase
        ));
    } else if vehicle.wheelbase > 0.2 * curve.radius {
        faults.push(format!(
            "vehicle.wheelbase: {} m does not fit a curve of {} m: expected at most a fifth of the radius",
            vehicle.wheelbase, curve.radius
        ));
    }
    if !(2e3..=600e3).contains(&vehicle.axle_load) {
        let hint = match vehicle.axle_load {
            load if load < 60.0 => format!("; {load} t are {:.0} N", 9806.65 * load),
            load if load < 600.0 => format!("; {load} kN are {:.0} N", 1e3 * load),
            _ => String::new(),
        };
        faults.push(format!(
            "vehicle.axle_load: found {} N, expected from 2000 to 600000 N, the load of both wheels{hint}",
            vehicle.axle_load
        ));
    }
    let inside = curve.gauge + curve.gauge_widening;
    if !(vehicle.back_to_back < inside && vehicle.back_to_back > 0.8 * inside) {
        faults.push(format!(
            "vehicle.back_to_back: found {} m between the backs of the flanges on a gauge of {inside} m, \
             expected a little less than the gauge",
            vehicle.back_to_back
        ));
    }
    if curve.deficiency(vehicle) != 0.0 && vehicle.centre_of_gravity.is_none() {
        faults.push(format!(
            "vehicle.centre_of_gravity: missing; the curve has a cant deficiency of {:.0} mm, which shifts load \
             from one rail to the other: give \
             the height of the centre of gravity above the rails (m)",
            1e3 * curve.deficiency(vehicle)
        ));
    }
}

impl Curve {
    /// Cant deficiency, m: the height that is missing to the cant of equilibrium of the speed, V²/(gR) times the
    /// distance of the running circles.
    pub fn deficiency(&self, vehicle: &VehicleData) -> f64 {
        let balanced = self.speed * self.speed / (GRAVITY * self.radius) * vehicle.circles();
        match (self.cant, self.cant_deficiency) {
            (Some(cant), _) => balanced - cant,
            (None, Some(missing)) => missing,
            (None, None) => 0.0,
        }
    }
}
