//! Tuned absorbers and ring dampers of a wheel, as a job gives them.

use super::bodies::material_of;
use crate::fem::ElasticMaterial;
use crate::job::{self, AbsorberDirection, AbsorberPlace, Job, MeshSource, NamedPlace};
use crate::swept::{Attachment, SectionSource, Wire};
use crate::{Error, Result};
use std::f64::consts::PI;

/// Mass of all that a wheel carries over its own, from which on it is remarked, and refused.
const HEAVY: f64 = 0.2;
const TOO_HEAVY: f64 = 1.0;

/// Absorbers and ring dampers of a wheel.
#[derive(Debug, Default)]
pub(crate) struct WheelAttachments {
    /// Rings on its section.
    pub attachments: Vec<Attachment>,
    /// Lines of the summary.
    pub lines: Vec<String>,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// Absorbers and ring dampers of the body `name` with its section. An error names what does not fit the wheel.
pub(crate) fn carried(name: &str, body: &job::Body, section: &SectionSource) -> Result<WheelAttachments> {
    if body.absorbers.is_empty() && body.ring_dampers.is_empty() {
        return Ok(WheelAttachments::default());
    }
    let mesh = section.for_modes()?;
    let [wheel, ..] = mesh.inertia(material_of(body)?);
    let mut carried = WheelAttachments::default();
    for (i, absorber) in body.absorbers.iter().enumerate() {
        let place = place_of(&absorber.place, section)?;
        let omega = 2.0 * PI * absorber.frequency;
        let along = match absorber.direction {
            AbsorberDirection::Radial => 0,
            AbsorberDirection::Tangential => 1,
            AbsorberDirection::Axial => 2,
        };
        carried.attachments.push(Attachment {
            name: format!("bodies.{name}.absorbers.{i}"),
            place,
            mass: absorber.mass,
            frequency: [0, 1, 2].map(|c| (c == along).then_some(omega)),
            loss: absorber.loss_factor,
            highest: Some(absorber.highest_order()),
            wire: None,
        });
        carried.lines.push(format!(
            "body {name}: {} {} absorbers of {:.4} kg each, {:.3} kg in all, {:.2} % of the wheel, {}, tuned to {} \
             Hz with the loss factor {} (springs of {:.4e} N/m and dashpots of {:.4e} N·s/m each); a ring in modes \
             of up to {} nodal diameters",
            absorber.count,
            absorber.direction.name(),
            absorber.each(),
            absorber.mass,
            100.0 * absorber.mass / wheel,
            absorber.place.text(),
            absorber.frequency,
            absorber.loss_factor,
            absorber.each() * omega * omega,
            absorber.each() * omega * absorber.loss_factor,
            absorber.highest_order()
        ));
    }
    for (i, ring) in body.ring_dampers.iter().enumerate() {
        let place = place_of(&ring.place, section)?;
        let &job::Material { young, poisson, density } = &ring.material;
        let wire = Wire { diameter: ring.diameter, material: ElasticMaterial { young, poisson, density } };
        let (mass, omega) = (wire.mass(place[0]), 2.0 * PI * ring.frequency);
        carried.attachments.push(Attachment {
            name: format!("bodies.{name}.ring_dampers.{i}"),
            place,
            mass,
            frequency: [Some(omega); 3],
            loss: ring.loss_factor,
            highest: None,
            wire: Some(wire),
        });
        carried.lines.push(format!(
            "body {name}: ring damper of wire of {:.2} mm, {mass:.3} kg, {:.2} % of the wheel, {}, on its groove at \
             {} Hz with the loss factor {}: a linear equivalent of its friction, which depends on the amplitude",
            1e3 * ring.diameter,
            100.0 * mass / wheel,
            ring.place.text(),
            ring.frequency,
            ring.loss_factor
        ));
    }
    section.attached(&mesh, &carried.attachments)?;
    let all: f64 = carried.attachments.iter().map(|a| a.mass).sum();
    let text = format!(
        "bodies.{name}: absorbers and ring dampers have a mass of {all:.2} kg in all, {:.0} % of the {wheel:.1} kg \
         of the wheel",
        100.0 * all / wheel
    );
    match all / wheel {
        part if part > TOO_HEAVY => {
            return Err(Error::Job(format!(
                "{text}; expected far less than the wheel, usual are 2 to 8 %; give less (kg)"
            )))
        }
        part if part > HEAVY => carried.warnings.push(format!("{text}; usual are 2 to 8 %")),
        _ => {}
    }
    Ok(carried)
}

/// Place (r, y) in the coordinates of a job, m.
fn place_of(place: &AbsorberPlace, section: &SectionSource) -> Result<[f64; 2]> {
    match (place, section) {
        (AbsorberPlace::At(at), _) => Ok([at.radius, at.y]),
        (AbsorberPlace::Named(NamedPlace::Rim), SectionSource::Wheel(wheel)) => Ok(wheel.shape.inside_of_rim()),
        (AbsorberPlace::Named(NamedPlace::Web), SectionSource::Wheel(wheel)) => Ok(wheel.shape.middle_of_web()),
        (AbsorberPlace::Named(_), _) => Err(Error::Defect("a place by name on a section without names".into())),
    }
}

/// Absorbers and ring dampers of all wheels of a job, for `check`.
pub(crate) fn of_job(job: &Job) -> Result<WheelAttachments> {
    let mut all = WheelAttachments::default();
    for (name, body) in job.all_bodies() {
        if matches!(body.mesh, Some(MeshSource::Revolved(_))) {
            let found = carried(&name, body, &super::swept::section(body)?)?;
            all.lines.extend(found.lines);
            all.warnings.extend(found.warnings);
        }
    }
    Ok(all)
}
