//! Bodies of a wheel on a rail with all their contacts.

use super::{common_lines, missing, PlacedContact};
use crate::body::averaged_trace::MeshContact;
use crate::body::half_space::{HalfSpace, HalfSpaceBody, HalfSpaceContact};
use crate::body::near_contacts::ContactPosition;
use crate::body::Side;
use crate::case::bodies::{material_of, of_elements, BuiltBodies, Place};
use crate::case::meshes::Meshes;
use crate::case::positioned_mesh::AlongPath;
use crate::case::surfaces::beside_nodes;
use crate::case::{rail, swept};
use crate::fem::rotation::Axis;
use crate::grid::ContactGrid;
use crate::job::{Job, MeshSource};
use crate::parallel::World;
use crate::petsc::session::Petsc;
use crate::placement::{Gap, Seat};
use crate::progress::Progress;
use crate::summary::Summary;
use crate::{job, Result};

/// Collective: the two places of a wheel on a rail.
pub(crate) fn build<'p>(
    petsc: &'p Petsc<'p>,
    job: &Job,
    meshes: &Meshes,
    progress: &mut Progress,
    summary: &mut Summary,
) -> Result<BuiltBodies<'p>> {
    let world = petsc.world();
    progress.stage("placing the wheel");
    let placed = world.on_root(|| PlacedContact::all(job))?.unwrap_or_default();
    for (number, one) in placed.iter().enumerate() {
        if placed.len() > 1 {
            let wheel = one.wheel_of(job).map_or(String::new(), |wheel| format!(", {wheel}"));
            summary.line(format!("contact {} of {}{wheel}", number + 1, placed.len()));
        }
        one.lines().into_iter().for_each(|line| summary.line(line));
    }
    common_lines(job, &placed).into_iter().for_each(|line| summary.line(line));
    let moves = job.bodies().iter().any(|(_, body)| body.mesh.is_some());
    let sites = ContactSite::all(world, &placed)?;
    let first = sites.first().ok_or_else(|| missing("a contact"))?;
    let touched = !job.analyses.on_contact().is_empty();
    let one_side = sites.iter().all(|site| site.side == first.side);
    let mut bodies = BuiltBodies::none();
    for (name, body) in job.bodies() {
        let side = Side::named(name)?;
        let is_file = matches!(body.mesh, Some(MeshSource::File(_)));
        let stands = |one: &PlacedContact| one.standing(&placed[0], (job, meshes), name, body);
        let stands: Result<Vec<_>> = placed.iter().filter(|_| is_file).map(stands).collect();
        let stands = world.agree(stands)?;
        let transfer = |k: usize| stands.get(k).map(|(s, _)| s.transfer.clone());
        let grids: Vec<ContactGrid> = placed.iter().enumerate().map(|(k, p)| p.grid(side, transfer(k))).collect();
        if is_file {
            let distance = world.broadcast(stands.first().map_or(Vec::new(), |(s, _)| vec![s.axle]));
            let axis = distance.first().filter(|_| body.rotates()).map(|&d| Axis::below(d));
            for (number, (one, _)) in stands.iter().enumerate() {
                let of = if stands.len() > 1 { format!(", contact {}", number + 1) } else { String::new() };
                summary.line(format!("body {name}{of}: {}", one.text));
            }
            if job.output.fields && stands.len() > 1 {
                summary.line(format!(
                    "body {name}: its fields are those of the mesh; contact fields on a mesh are those of one contact"
                ));
            }
            progress.stage(format!("distribution and assembly, body {name}"));
            let on = |(grid, (_, along)): (_, &(_, AlongPath))| MeshContact::Grid { grid, along: along.angle() };
            let contacts: Vec<MeshContact> = grids.iter().zip(&stands).map(on).collect();
            let mesh = (stands.first().map(|(s, _)| &s.mesh), &contacts[..]);
            bodies.unique.push(Box::new(of_elements((petsc, summary), job, (name, body), mesh, axis)?));
        } else if moves {
            bodies.unique.push(match &body.mesh {
                Some(MeshSource::Extruded(_)) => {
                    let [near, far] = [true, false].map(|near| on_one_rail(&sites, first.side, near, touched));
                    match far.is_empty() {
                        true => Box::new(rail::build((world, summary), job, (name, body), &near)?),
                        false => {
                            let other = sites.iter().find(|site| site.side != first.side);
                            let ahead = other.map_or(0.0, |other| first.ahead - other.ahead);
                            rail::build_both((world, summary), job, (name, body), ([&near, &far], ahead))?
                        }
                    }
                }
                Some(MeshSource::Revolved(_)) => {
                    let on = |site: &'_ ContactSite| swept::WheelContact {
                        seat: site.seats[side.index()],
                        side: site.side,
                        lines: touched.then(|| site.lines.clone()),
                        along: (first.from_axle - site.from_axle) / site.radius,
                    };
                    let contacts: Vec<swept::WheelContact> = sites.iter().map(on).collect();
                    Box::new(swept::wheel((world, summary), (name, body), &contacts)?)
                }
                _ => {
                    let m = body.elastic()?;
                    let place = |site| one_side.then(|| ContactSite::position(site, first, side));
                    let on = sites.iter().filter(|_| touched);
                    let contacts: Vec<HalfSpaceContact> = on
                        .map(|site| HalfSpaceContact { lines: [&site.lines[0], &site.lines[1]], position: place(site) })
                        .collect();
                    let material = HalfSpace { young: m.young, poisson: m.poisson };
                    Box::new(HalfSpaceBody::with_contacts(world, name, material, &contacts))
                }
            });
        }
        let index = bodies.unique.len().saturating_sub(1);
        let laid = world.on_root(|| match (&stands[..], &grids[..]) {
            ([(s, _)], [grid]) if job.output.fields => beside_nodes(&s.mesh, grid, first.seats[side.index()].tilt),
            _ => Ok(Vec::new()),
        })?;
        let laid = laid.unwrap_or_default();
        let checksum = stands.first().map(|(s, _)| s.mesh.checksum()).unwrap_or_default();
        let positions = sites.iter().filter(|_| one_side).map(|site| site.position(first, side)).collect();
        bodies.places.push(Place {
            checksum,
            laid,
            positions,
            ..Place::meshless((name, side), index, grids, material_of(body)?)
        });
    }
    Ok(bodies)
}

/// The contacts of `sites` on the rail of the side `first`, or on the other one.
fn on_one_rail(sites: &[ContactSite], first: job::TrackSide, near: bool, touched: bool) -> Vec<rail::RailContact> {
    let own: Vec<&ContactSite> = sites.iter().filter(|site| (site.side == first) == near).collect();
    let on = |site: &&ContactSite| rail::RailContact {
        at: Some(on_rail(site.seats[Side::Lower.index()], site.side)),
        lines: touched.then(|| site.lines.clone()),
        along: own[0].ahead - site.ahead,
    };
    own.iter().map(on).collect()
}

/// Position of the contact on the rail on a side of the track.
pub(in crate::case) fn on_rail(seat: Seat, side: job::TrackSide) -> rail::RailContactPosition {
    rail::RailContactPosition {
        y: seat.y,
        z: Some(seat.z),
        right: side == job::TrackSide::Right,
        tilt: Some(seat.tilt),
    }
}

/// A contact of a wheel on its rail, known on every rank.
struct ContactSite {
    /// Place of its frame on the rail and on the wheel.
    seats: [Seat; 2],
    /// Lines of its grid along x and y, m.
    lines: [Vec<f64>; 2],
    /// Side of the track.
    side: job::TrackSide,
    /// Distance of its frame ahead of the middle of the axle along the track, m.
    ahead: f64,
    /// Distance of its frame ahead of the axle, across it, m.
    from_axle: f64,
    /// Rolling radius, m.
    radius: f64,
}

impl ContactSite {
    /// Position on the running surface of the wheel or on the rail, along x from that of the `first` contact.
    fn position(&self, first: &Self, side: Side) -> ContactPosition {
        let along = match side {
            Side::Lower => first.ahead - self.ahead,
            Side::Upper => first.from_axle - self.from_axle,
        };
        let seat = self.seats[side.index()];
        ContactPosition::straight([seat.z, seat.y], along, -seat.tilt)
    }

    /// Collective: the contacts that rank 0 has `placed`.
    pub(super) fn all(world: &World, placed: &[PlacedContact]) -> Result<Vec<Self>> {
        let seats = |p: &PlacedContact| p.placed.seats(&p.frame).map_err(|e| e.context("contact.placement"));
        let numbers = world.on_root(|| {
            let of = |p: &PlacedContact| -> Result<Vec<f64>> {
                let seats = seats(p)?.into_iter().flat_map(|s| [s.y, s.z, s.tilt]);
                let right = f64::from(u8::from(p.side == job::TrackSide::Right));
                let ahead = [p.frame.origin()[0], p.placed.ahead_of_axle(&p.frame)];
                Ok(seats.chain(ahead).chain([p.placed.touch().radius, right]).collect())
            };
            Ok(placed.iter().map(of).collect::<Result<Vec<_>>>()?.concat())
        })?;
        let numbers = world.broadcast(numbers.unwrap_or_default());
        let site = |(k, of): (usize, &[f64])| {
            let seat = |i: usize| Seat { y: of[3 * i], z: of[3 * i + 1], tilt: of[3 * i + 2] };
            let lines =
                |of: fn(&Gap) -> &Vec<f64>| world.broadcast(placed.get(k).map_or(Vec::new(), |p| of(&p.gap).clone()));
            let lines = [lines(|g| &g.x), lines(|g| &g.y)];
            let side = if of[9] > 0.5 { job::TrackSide::Right } else { job::TrackSide::Left };
            Self { seats: [seat(0), seat(1)], side, lines, ahead: of[6], from_axle: of[7], radius: of[8] }
        };
        Ok(numbers.chunks_exact(10).enumerate().map(site).collect())
    }
}
