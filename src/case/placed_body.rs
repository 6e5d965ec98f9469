//! One body of a wheel on a rail, touched at a place that is given, and where the wheel of a job touches both bodies.

use super::wheel_rail_geometry::{on_rail, PlacedContact};
use super::{rail, swept};
use crate::body::hybrid::{circle_radius, CIRCLE};
use crate::body::{ElasticBody, Side};
use crate::grid::Interface;
use crate::job::{self, Job, MeshSource};
use crate::parallel::World;
use crate::placement::Seat;
use crate::summary::Summary;
use crate::{Error, Result};

/// Contact of a wheel on its rail, as the bodies see it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactSeat {
    /// Places on the rail and on the wheel.
    pub seats: [Seat; 2],
    /// Radius of the circle of the loads, m.
    pub radius: f64,
}

/// Contact of the wheel of `job`, with the grid and the gap. For one rank: it reads the files of the profiles.
pub(crate) fn contact_seat(job: &Job) -> Result<(ContactSeat, Interface)> {
    let placed = PlacedContact::from_job(job)?;
    let seats = [placed.seat(Side::Lower.name())?, placed.seat(Side::Upper.name())?];
    Ok((ContactSeat { seats, radius: circle_radius(placed.grid_lines()) }, placed.interface()?))
}

/// Returns whether both bodies of a job may be touched at a place that is given: a wheel of a section on a rail.
pub(crate) fn are_sections(job: &Job) -> bool {
    let mesh = |body: &Option<job::Body>| body.as_ref().and_then(|b| b.mesh.clone());
    let lower = matches!(mesh(&job.bodies.lower), Some(MeshSource::Extruded(_)));
    lower && matches!(mesh(&job.bodies.upper), Some(MeshSource::Revolved(_)))
}

/// Collective: the body of `job` on a `side`, touched at a `seat` with a circle of the loads of this radius, m.
pub(crate) fn body_at<'p>(
    world: &'p World,
    job: &Job,
    side: Side,
    (seat, radius): (Seat, f64),
) -> Result<Box<dyn ElasticBody + 'p>> {
    let missing = || Error::Defect("a body of a placement is missing".into());
    let track = job.placement().map(|p| p.side).ok_or_else(missing)?;
    let given = [&job.bodies.lower, &job.bodies.upper][side.index()];
    let body = given.as_ref().ok_or_else(missing)?;
    let (name, half) = (side.name(), radius / CIRCLE);
    let lines = [vec![-half, half], vec![-half, half]];
    let mut quiet = Summary::default();
    Ok(match &body.mesh {
        Some(MeshSource::Extruded(_)) => {
            let contact = rail::RailContact { at: Some(on_rail(seat, track)), lines: Some(lines), along: 0.0 };
            Box::new(rail::build((world, &mut quiet), job, (name, body), &[contact])?)
        }
        Some(MeshSource::Revolved(_)) => {
            let contact = swept::WheelContact { seat, side: track, lines: Some(lines), along: 0.0 };
            Box::new(swept::wheel((world, &mut quiet), (name, body), &[contact])?)
        }
        _ => return Err(missing()),
    })
}
