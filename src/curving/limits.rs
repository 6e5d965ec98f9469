//! Curves that cannot be run through, and solutions that are none of a wheel that rolls on its rail.

use super::{ContactForce, CurvingProblem, CurvingSolution};
use crate::{Error, Result};

/// Most places of contact of a wheel.
const MOST_PLACES: usize = 2;

/// Share of the axle's load below which a place of contact is left out of the count.
const NO_LOAD: f64 = 1e-4;

/// Distance beyond the flange face at which a wheel stands on the tip of its flange, m.
const BELOW_FLANGE: f64 = 0.2e-3;

/// Contact angle from which on a place is one of the flange, rad.
const FLANGE: f64 = 0.6;

impl CurvingProblem {
    /// An error where the vehicle tips over, or an axle in the middle of the track already stands on its flanges.
    pub(super) fn refuse_impossible(&self) -> Result<()> {
        let arm = self.curve.deficiency.abs() * self.bogie.mass_height;
        if arm >= self.bogie.half_circles {
            return Err(Error::Job(format!(
                "curve.cant_deficiency: a lateral acceleration of {:.2} g at a height of {:.2} m tips over a \
                 vehicle on circles {:.2} m apart; \
                 expected less, or a lower vehicle.centre_of_gravity",
                self.curve.deficiency.abs(),
                self.bogie.mass_height,
                2.0 * self.bogie.half_circles
            )));
        }
        for (wheel, side) in self.wheels.iter().zip(["left", "right"]) {
            let straight = wheel.places(0.0, 0.0, 0.0)?;
            let angle = |places: &[crate::placement::ContactPlace]| places.first().map_or(0.0, |p| p.angle.abs());
            if angle(&straight) > FLANGE {
                return Err(Error::Job(format!(
                    "curve.gauge: the flange of the {side} wheel stands on its rail with the axle in the middle \
                     of the track; expected a \
                     gauge wider than the wheels. Check curve.gauge, curve.gauge_widening and vehicle.back_to_back"
                )));
            }
        }
        Ok(())
    }

    /// An error where a wheel has lost contact, has more than two places of contact, or climbs its rail.
    pub(super) fn refuse_unsound(&self, solution: &CurvingSolution) -> Result<()> {
        for (axle, which) in solution.axles.iter().zip(["leading", "trailing"]) {
            for (k, (places, side)) in axle.wheels.iter().zip(["left", "right"]).enumerate() {
                let named = format!("the {side} wheel of the {which} axle");
                let least = NO_LOAD * self.bogie.axle_load;
                let loaded: Vec<&ContactForce> = places.iter().filter(|c| c.is_loaded() && c.normal > least).collect();
                if loaded.is_empty() {
                    return Err(Error::Job(format!(
                        "curve: {named} carries no load: the lateral load of the curve or a moment lifts it. \
                         Expected less cant deficiency \
                         (curve.cant_deficiency), or a lower vehicle.centre_of_gravity"
                    )));
                }
                if loaded.len() > MOST_PLACES {
                    let places: Vec<String> = loaded
                        .iter()
                        .map(|c| {
                            format!("y = {:.1} mm of the wheel with {:.1} kN", 1e3 * c.place.wheel, 1e-3 * c.normal)
                        })
                        .collect();
                    return Err(Error::Job(format!(
                        "curve: {named} touches its rail at {} places: {}; expected two at the most. Smooth the \
                         profiles \
                         (profile.file.smoothing), or change the radius a little",
                        loaded.len(),
                        places.join(", ")
                    )));
                }
                self.refuse_climbing(&loaded, k, &named)?;
            }
        }
        Ok(())
    }

    /// An error where the lateral force of a wheel over its vertical one is beyond Nadal's limit, (tan δ − μ)/(1 + μ
    /// tan δ) with the flange angle δ (M. J. Nadal, 1908).
    fn refuse_climbing(&self, loaded: &[&ContactForce], side: usize, named: &str) -> Result<()> {
        if !loaded.iter().any(|c| c.place.angle.abs() > FLANGE) {
            return Ok(());
        }
        // A flange pushes the left-hand wheel to the right.
        let inwards = if side == 0 { 1.0 } else { -1.0 };
        let lateral: f64 = loaded.iter().map(|c| inwards * c.lateral()).sum();
        let vertical: f64 = loaded.iter().map(|c| -c.vertical()).sum();
        let (flange, end) = self.wheels[side].flange();
        if let Some(tip) = loaded.iter().find(|c| c.place.wheel < end - BELOW_FLANGE) {
            return Err(Error::Job(format!(
                "curve: {named} stands on the tip of its flange: it touches the rail at y = {:.1} mm of its \
                 profile, beyond the flange face, \
                 which ends at y = {:.1} mm. Expected a wider curve, less friction, a softer primary suspension \
                 or less cant deficiency",
                1e3 * tip.place.wheel,
                1e3 * end
            )));
        }
        let on_flange = loaded.iter().filter(|c| c.place.angle.abs() > FLANGE);
        let friction = on_flange.map(|c| c.friction).fold(0.0, f64::max);
        let limit = (flange.tan() - friction) / (1.0 + friction * flange.tan());
        if lateral <= limit * vertical {
            return Ok(());
        }
        Err(Error::Job(format!(
            "curve: {named} climbs its rail: found a lateral over vertical force of {:.2} (Y = {:.1} kN, Q = \
             {:.1} kN), expected less than \
             Nadal's limit of {limit:.2} for a flange of {:.1} degrees and a friction of {friction:.2}. \
             Expected a wider curve, less \
             friction, a softer primary suspension or less cant deficiency",
            lateral / vertical,
            1e-3 * lateral,
            1e-3 * vertical,
            flange.to_degrees()
        )))
    }
}
