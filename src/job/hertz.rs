//! How much a load strains the surfaces, and how large a contact it makes, by Hertz.

use super::{Contact, Job, Load, Material};
use crate::{Error, Result};

/// Largest strain of the contact surfaces, about, for which linear elasticity is used.
const MAX_STRAIN: f64 = 0.05;

/// An error if the load of a `contact`, whose key in the job is `path`, strains the surfaces of two built-in bodies
/// beyond small strain. The measure is the largest Hertz pressure over the combined modulus E*, (2/π) a/R for a
/// circular contact (K. L. Johnson, Contact Mechanics, 1985, eqs. 4.22–4.24); an elliptic contact is taken as the
/// circular one of the same geometric mean curvature, a plain cylinder as a line contact across the width (eq. 4.45).
pub(super) fn small_strain(job: &Job, (path, contact): (&str, &Contact)) -> Result<()> {
    let (Some(lower), Some((_, upper))) = (&job.bodies.lower, job.upper_at(contact)) else { return Ok(()) };
    let (Some(a), Some(b)) = (lower.running(), upper.running()) else {
        return Ok(());
    };
    let compliance = |m: &Material| (1.0 - m.poisson * m.poisson) / m.young;
    let modulus = 1.0 / (compliance(lower.elements()?.1) + compliance(upper.elements()?.1));
    let along = 1.0 / a.radius + 1.0 / b.radius;
    let across = a.crown.map_or(0.0, |r| 1.0 / r) + b.crown.map_or(0.0, |r| 1.0 / r);
    let curvature = (along * across).sqrt();
    let (key, strain) = match contact.load() {
        Load::Normal(n) if across > 0.0 => {
            ("normal_load", (6.0 * n * curvature * curvature / modulus / std::f64::consts::PI.powi(3)).cbrt())
        }
        Load::Normal(n) => {
            let width = a.width.min(b.width);
            ("normal_load", (n * along / (std::f64::consts::PI * width * modulus)).sqrt())
        }
        // A line contact has no approach of its own: the curvature along the rolling direction bounds it.
        Load::Approach(d) if across > 0.0 => ("approach", 2.0 / std::f64::consts::PI * (d * curvature).sqrt()),
        Load::Approach(d) => ("approach", 2.0 / std::f64::consts::PI * (d * along).sqrt()),
    };
    if strain <= MAX_STRAIN {
        return Ok(());
    }
    let value = contact.normal_load.or(contact.approach).unwrap_or_default();
    Err(Error::Job(format!(
        "{path}.{key}: found {value:e}, which would strain the surfaces by about {:.3} %; the bodies are \
         linear elastic at small strain, \
         taken to hold up to {} %. Reduce it",
        100.0 * strain,
        100.0 * MAX_STRAIN
    )))
}

/// Radius of the contact of two built-in crowned bodies under a normal load, about, m: (3N/(4E*κ))^(1/3) with the
/// geometric mean curvature κ (Johnson, eq. 4.22). `None` for other bodies and loads.
pub(crate) fn contact_radius(job: &Job) -> Option<f64> {
    radius_at(job, job.contact.as_ref()?)
}

/// [`contact_radius`] of a contact of the job.
fn radius_at(job: &Job, contact: &Contact) -> Option<f64> {
    let (lower, (_, upper)) = (job.bodies.lower.as_ref()?, job.upper_at(contact)?);
    let (Some(a), Some(b)) = (lower.running(), upper.running()) else {
        return None;
    };
    let compliance = |m: &Material| (1.0 - m.poisson * m.poisson) / m.young;
    let modulus = 1.0 / (compliance(lower.material.as_ref()?) + compliance(upper.material.as_ref()?));
    let along = 1.0 / a.radius + 1.0 / b.radius;
    let across = a.crown.map_or(0.0, |r| 1.0 / r) + b.crown.map_or(0.0, |r| 1.0 / r);
    match contact.load() {
        Load::Normal(n) if across > 0.0 => Some((0.75 * n / (modulus * (along * across).sqrt())).cbrt()),
        _ => None,
    }
}

/// [`contact_radius`] of a contact of the job, or that of the approach, a² = δ/κ.
pub(super) fn contact_size(job: &Job, contact: &Contact) -> Option<f64> {
    let (lower, (_, upper)) = (job.bodies.lower.as_ref()?, job.upper_at(contact)?);
    let (Some(a), Some(b)) = (lower.running(), upper.running()) else {
        return None;
    };
    let along = 1.0 / a.radius + 1.0 / b.radius;
    let across = a.crown.map_or(0.0, |r| 1.0 / r) + b.crown.map_or(0.0, |r| 1.0 / r);
    match contact.load() {
        Load::Approach(d) if across > 0.0 => Some((d / (along * across).sqrt()).sqrt()),
        _ => radius_at(job, contact),
    }
}

#[cfg(test)]
mod tests {
    use super::super::example::two_cylinders as job;
    use super::*;

    #[test]
    fn strain_is_hertz_pressure_over_modulus() {
        // The paper's cylinders: 1401.0 MPa at 70 kN, E* = 112.64 GPa. The strain grows with the cube root of the load.
        let strain: f64 = 1401.0e6 / (205e9 / 2.0 / (1.0 - 0.09));
        let limit = 70e3 * (MAX_STRAIN / strain).powi(3);
        let strains = |job: &Job| small_strain(job, ("contact", job.contact.as_ref().unwrap()));
        let at = |load: f64| strains(&job(&[&format!("contact.normal_load={load}")]));
        assert!(at(0.999 * limit).is_ok());
        let error = at(1.001 * limit).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("about 5.0"), "{error}");
        // Hertz' approach is a²/R = (π strain / 2)² R with R = 1/curvature = 0.25 m.
        let approach = (std::f64::consts::PI * MAX_STRAIN / 2.0).powi(2) * 0.25;
        let at = |d: f64| strains(&job(&["contact.normal_load=null", &format!("contact.approach={d}")]));
        assert!(at(0.999 * approach).is_ok());
        assert!(at(1.001 * approach).is_err());
    }

    #[test]
    fn the_contact_radius_is_that_of_hertz() {
        let radius = contact_radius(&job(&["contact.normal_load=70e3"])).unwrap();
        assert!((radius - 4.884e-3).abs() < 1e-5, "{radius}");
        assert!(contact_radius(&job(&["contact.normal_load=null", "contact.approach=1e-4"])).is_none());
    }
}
