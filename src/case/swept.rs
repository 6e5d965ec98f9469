//! Bodies swept from sections, as a job gives them.

use super::bodies::{material_of, Bodies};
use super::rail;
use crate::body::swept::{Making, Swept};
use crate::body::Side;
use crate::grid::ContactGrid;
use crate::job::{self, Job, MeshSource, Section};
use crate::parallel::World;
use crate::placement::Seat;
use crate::progress::Progress;
use crate::summary::Summary;
use crate::swept::{BuiltIn, Cylinder, EdgeSprings};
use crate::{Error, Result};

/// The section of a body, whose contact is where its mesh says it.
fn section(body: &job::Body) -> Result<BuiltIn> {
    let Some(MeshSource::Revolved(revolved)) = &body.mesh else {
        return Err(Error::Defect("a section is asked for of a body that is not swept".into()));
    };
    let contact_offset = revolved.contact_offset;
    Ok(match revolved.section {
        Section::W920S => BuiltIn::W920S { offset: contact_offset, mirrored: false },
        Section::Cylinder(job::Ring { inner_radius, outer_radius, thickness, crown_radius }) => {
            BuiltIn::Cylinder(Cylinder { inner_radius, outer_radius, thickness, crown_radius, contact_offset })
        }
    })
}

/// Where the contact of a wheel on a rail is on its section: the wheel at a seat, on a side of the track.
fn section_at(body: &job::Body, seat: Seat, side: job::TrackSide) -> Result<BuiltIn> {
    // A right-hand wheel has its flange at −y.
    let right = side == job::TrackSide::Right;
    match section(body)? {
        BuiltIn::W920S { .. } => Ok(BuiltIn::W920S { offset: if right { -seat.y } else { seat.y }, mirrored: right }),
        BuiltIn::Cylinder(_) => Err(Error::Defect("a cylinder has no profile".into())),
    }
}

/// An error where the wheel `body` cannot be touched at a seat.
pub(crate) fn touched(body: &job::Body, seat: Seat, side: job::TrackSide) -> Result<()> {
    section_at(body, seat, side)?.for_modes().map(|_| ())
}

/// A body of a section, with lines of the contact grid and the tilt of its frame.
fn made<'p>(
    (world, summary): (&'p World, &mut Summary),
    (name, body): (&str, &job::Body),
    section: BuiltIn,
    (grid, tilt): (Option<[&[f64]; 2]>, f64),
) -> Result<Swept<'p>> {
    let (material, springs) = (material_of(body)?, springs(body));
    let making =
        Making { section, material, fixed: &body.fixed, springs: &springs, rotates: body.rotates(), grid, tilt };
    let swept = Swept::new(world, name, making)?;
    let (unknowns, mass) = (swept.unknowns(), swept.mass());
    summary.line(format!("body {name}: swept, {unknowns} unknowns of each order, mass {mass:.6e} kg"));
    Ok(swept)
}

/// The springs of revolution that a body stands on.
fn springs(body: &job::Body) -> Vec<EdgeSprings> {
    let one = |support: &job::Support| {
        let [across, along, _, normal] = support.springs();
        let per_area = support.per == job::Per::Area;
        EdgeSprings { group: support.group.clone(), stiffness: [across, along, normal], per_area }
    };
    body.supports.iter().map(one).collect()
}

/// The wheel `body` of a placement, on the same grid on every rank.
pub(crate) fn wheel<'p>(
    told: (&'p World, &mut Summary),
    (name, body): (&str, &job::Body),
    (seat, side): (Seat, job::TrackSide),
    grid: Option<[&[f64]; 2]>,
) -> Result<Swept<'p>> {
    made(told, (name, body), section_at(body, seat, side)?, (grid, seat.tilt))
}

/// The contact grid of a body in lower form; none of a job without contact.
pub fn grid(job: &Job, body: &job::Body) -> Result<Option<ContactGrid>> {
    let Some(patch) = job.contact.as_ref().and_then(|c| c.patch) else { return Ok(None) };
    let Some(spacing) = patch.spacing else { return Ok(None) };
    let line = |half: f64| -> Vec<f64> {
        // Rounding does not make a line more.
        let n = (half / spacing - 1e-9).ceil() as i64;
        (-n..=n).map(|i| i as f64 * spacing).collect()
    };
    let (x, y) = (line(patch.half_length), line(patch.half_width));
    let z = match rail::extruded(body) {
        Some(extruded) => {
            let across = y.iter().map(|&y| rail::height(extruded, y)).collect::<Result<Vec<f64>>>()?;
            across.into_iter().flat_map(|z| std::iter::repeat_n(z, x.len())).collect()
        }
        None => {
            let section = section(body)?;
            y.iter().flat_map(|&y| x.iter().map(move |&x| section.height(x, y))).collect()
        }
    };
    Ok(Some(ContactGrid { x, y, nodes: Vec::new(), z }))
}

/// Nodes and elements of the section of a body, as the modes see it.
pub fn size(body: &job::Body) -> Result<[usize; 2]> {
    if let Some(extruded) = rail::extruded(body) {
        return rail::size(extruded);
    }
    let section = section(body)?.for_modes()?;
    Ok([section.nodes.len(), section.elements.len()])
}

/// Collective: the bodies of the job.
pub fn build<'p>(world: &'p World, job: &Job, progress: &mut Progress, summary: &mut Summary) -> Result<Bodies<'p>> {
    progress.stage("sections");
    let given = job.bodies();
    let same = match &given[..] {
        [(_, a), (_, b)] => {
            a.mesh == b.mesh
                && a.material == b.material
                && a.fixed == b.fixed
                && a.supports == b.supports
                && a.rotation == b.rotation
                && a.track == b.track
        }
        _ => false,
    };
    let mut bodies = Bodies::none();
    for (i, (name, body)) in given.iter().enumerate() {
        let grid = grid(job, body)?.filter(|_| !job.analyses.on_contact().is_empty());
        let material = material_of(body)?;
        let side = Side::named(name).unwrap_or(Side::Lower);
        if same && i == 1 {
            summary.line(format!("body {name}: the mirror image of the lower one, computed once"));
        } else if rail::extruded(body).is_some() {
            let lines = grid.as_ref().map(|g| [&g.x[..], &g.y[..]]);
            bodies.unique.push(Box::new(rail::told((world, summary), job, (name, body), (None, lines))?));
        } else {
            let lines = grid.as_ref().map(|g| [&g.x[..], &g.y[..]]);
            bodies.unique.push(Box::new(made((world, summary), (name, body), section(body)?, (lines, 0.0))?));
        }
        let grid = grid.filter(|_| world.is_root());
        bodies.places.push(super::bodies::Place::meshless((name, side), bodies.unique.len() - 1, grid, material));
    }
    Ok(bodies)
}
