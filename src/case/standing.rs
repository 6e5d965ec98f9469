//! Bodies of mesh files on a placement: brought from the frame of their profile to the contact.

use super::surfaces;
use crate::grid::{Faces, Transfer};
use crate::job::{Body, TrackSide};
use crate::mesh::attitude::Attitude;
use crate::mesh::Mesh;
use crate::placement::Seat;
use crate::{Error, Result};

/// The axle may lie beside where the placement has it by this part of the radius.
const AXLE: f64 = 0.01;

/// A mesh in lower form with the contact point at the origin. It stands upright: y is along its axle, or across its track, and not in the plane of the contact.
#[derive(Debug)]
pub(crate) struct Standing {
    /// The mesh.
    pub mesh: Mesh,
    /// How its surface moves at the contact, in the frame of the contact.
    pub transfer: Transfer,
    /// Distance of the axle of a wheel from the contact point, m.
    pub axle: f64,
    /// That in words.
    pub text: String,
}

/// The vector `x` of an upright body, seen in the frame of the contact, which is turned against it by `tilt`, rad, about x.
pub(crate) fn seen([x, y, z]: [f64; 3], tilt: f64) -> [f64; 3] {
    let (s, c) = tilt.sin_cos();
    [x, c * y + s * z, c * z - s * y]
}

/// A body whose `mesh`, in lower form, has the origin of its profile at the origin, touched at a seat on a side of the track by a contact of the half
/// sides `half`, m. Meshes are as on the left side; on the right they are turned about z. `radius` is that of the running circle of a wheel, m.
///
/// # Errors
/// No surface at the contact point; one that does not look at the other body; see [`surfaces::discs`].
pub(crate) fn standing(mesh: &Mesh, seat: Seat, side: TrackSide, half: [f64; 2], radius: f64) -> Result<Standing> {
    let turn = if side == TrackSide::Right { -1.0 } else { 1.0 };
    let mut mesh = mesh.clone();
    mesh.nodes.iter_mut().for_each(|[x, y, _]| {
        *x *= turn;
        *y = turn * *y - seat.y;
    });
    let faces = Faces::of(&mesh, "contact")?;
    let height = faces.height([0.0; 2]).ok_or_else(|| {
        let [[x0, x1], [y0, y1]] = faces.ends();
        Error::Input(format!(
            "group \"contact\": no face at the contact point, which is at y = {:.5} m of the profile; the group reaches from x = {x0:.4} to {x1:.4} m and from \
             y = {:.4} to {:.4} m. Expected the origin of the profile at the origin of the mesh, and a group that holds the contact",
            turn * seat.y,
            (turn * (y0 + seat.y)).min(turn * (y1 + seat.y)),
            (turn * (y0 + seat.y)).max(turn * (y1 + seat.y))
        ))
    })?;
    mesh.nodes.iter_mut().for_each(|p| p[2] -= height);
    let mut tilted = mesh.clone();
    tilted.nodes.iter_mut().for_each(|p| *p = seen(*p, seat.tilt));
    let (discs, text) = surfaces::discs(&Faces::of(&tilted, "contact")?, half)?;
    let transfer = Transfer::Means { discs, tilt: seat.tilt };
    Ok(Standing { mesh, transfer, axle: radius + height, text })
}

/// What is wrong with the axle of a wheel that turns, whose mesh stands.
pub(crate) fn axle(body: &Body, standing: &Standing) -> Option<String> {
    let attitude = Attitude::of(&standing.mesh);
    let ([x, _, z], wanted) = (attitude.centre, standing.axle);
    match attitude.revolved {
        _ if !body.rotates() => None,
        Some(1) if x.abs() < AXLE * wanted && (z + wanted).abs() < AXLE * wanted => None,
        Some(1) => Some(format!(
            "the axis of revolution is at x = {x:.4} m, {:.4} m from the contact point, and by contact.placement.radius it is at x = 0, {wanted:.4} m from there",
            z.abs()
        )),
        _ => Some("the body turns, and is no body of revolution about an axis along y: is it in its place?".into()),
    }
}
