//! A disc that turns between pads that do not: its bodies and its interface.
//!
//! The disc is below each contact, x is e_θ and n points into it. The pads' own frame has the axle as z, and angles
//! about it count from x to y. On a face that looks along z the frame of a contact is x = e_θ, y = −e_r, on the other
//! one x = e_θ, y = e_r; the normal into a pad is the one out of the disc.

use super::bodies::{eigen_method, material_of, matrices_of, BuiltBodies, Place};
use super::swept;
use crate::body::matrix_body::MatrixBody;
use crate::body::swept::FaceCell;
use crate::body::{ElasticBody, Side};
use crate::grid::{Interface, TurningPoints};
use crate::job::{self, FaceContact, Job, MatrixAxis, MatrixContact, MatrixDirection};
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::summary::Summary;
use crate::swept::SectionFace;
use crate::{Error, Result};

/// The disc and the pads of a job.
fn both(job: &Job) -> Result<[&job::Body; 2]> {
    match (&job.bodies.lower, &job.bodies.upper) {
        (Some(disc), Some(pads)) => Ok([disc, pads]),
        _ => Err(Error::Defect("contacts of a disc with pads without these".into())),
    }
}

/// The face of each contact.
fn faces(job: &Job) -> Result<Vec<SectionFace>> {
    let [disc, _] = both(job)?;
    let named = |e: Error| e.context(job.bodies.with_names("bodies.lower.mesh.revolved".into()));
    let section = swept::section(disc).and_then(|section| section.for_modes()).map_err(named)?;
    let face = |(i, contact): (usize, &FaceContact)| {
        SectionFace::new(&section, &contact.face).map_err(|e| e.context(format!("contacts.{i}.face")))
    };
    job.contacts.iter().enumerate().map(face).collect()
}

/// Lines about the contacts of a job.
///
/// # Errors
/// Faces that the section has not, and cells beside their face.
pub(crate) fn examine(job: &Job) -> Result<Vec<String>> {
    let mut lines = vec![names(job)];
    for (i, (contact, face)) in job.contacts.iter().zip(faces(job)?).enumerate() {
        let [low, high] = face.radii();
        for (k, cell) in contact.cells.iter().enumerate() {
            let [first, last] = [cell.radius - cell.half[1], cell.radius + cell.half[1]];
            if !(first > low && last < high) {
                return Err(Error::Job(format!(
                    "contacts.{i}.cells.{k}: reaches from r = {first:.6} m to {last:.6} m, and the face \"{}\" from \
                     {low:.6} m to {high:.6} m; expected a cell within it",
                    contact.face
                )));
            }
        }
        let area: f64 = contact.cells.iter().map(area).sum();
        lines.push(format!(
            "contact {}: {} cells of {:.2} cm² on {}, {} N, mean pressure {:.3} MPa",
            contact.name,
            contact.cells.len(),
            1e4 * area,
            contact.face,
            contact.normal_load,
            1e-6 * contact.normal_load / area
        ));
    }
    Ok(lines)
}

/// The bodies by their names and their places.
pub(crate) fn names(job: &Job) -> String {
    match &job.bodies.names {
        Some([disc, pads]) => {
            format!("bodies: {disc} is the lower one and turns, {pads} the upper one, which does not")
        }
        None => String::new(),
    }
}

/// Area of a cell, m².
fn area(cell: &job::ContactCell) -> f64 {
    4.0 * cell.half[0] * cell.half[1]
}

/// The interface of a job: a patch of cells for each contact, whose creep is Ω r along x.
pub(crate) fn interface(job: &Job) -> Result<Interface> {
    let speed = job.angular_velocity(Side::Lower.name());
    let patch = |(contact, face): (&FaceContact, SectionFace)| {
        let axle = if face.looks_to_plus() { 1.0 } else { -1.0 };
        Interface::turning(TurningPoints {
            area: contact.cells.iter().map(area).collect(),
            creep: contact.cells.iter().map(|cell| [speed * cell.radius, 0.0]).collect(),
            axle: vec![axle; contact.cells.len()],
        })
    };
    Interface::joined(job.contacts.iter().zip(faces(job)?).map(patch).collect::<Result<Vec<_>>>()?)
}

/// The contacts of the pads by the cells of a job.
fn pad_contacts(job: &Job) -> Result<Vec<MatrixContact>> {
    let mut all = Vec::new();
    for ((i, contact), face) in job.contacts.iter().enumerate().zip(faces(job)?) {
        let (normal, outwards) = match face.looks_to_plus() {
            true => (MatrixAxis::Z, -1.0),
            false => (MatrixAxis::MinusZ, 1.0),
        };
        all.extend(contact.cells.iter().enumerate().map(|(k, cell)| {
            let (s, c) = cell.angle.sin_cos();
            let [along, across] = [[-s, c, 0.0], [outwards * c, outwards * s, 0.0]];
            MatrixContact {
                node: Some(cell.node),
                against: None,
                normal: MatrixDirection::Axis(normal),
                tangential: [along, across].map(MatrixDirection::Vector).to_vec(),
                made_of: Some(format!("contacts.{i}.cells.{k}")),
            }
        }));
    }
    Ok(all)
}

/// The pads of a job with their contacts.
pub(crate) fn pads(job: &Job) -> Result<job::Body> {
    let [_, pads] = both(job)?;
    let mut pads = pads.clone();
    if let Some(matrices) = &mut pads.matrices {
        matrices.contacts = pad_contacts(job)?;
    }
    Ok(pads)
}

/// Collective: the bodies of the job.
pub(super) fn build<'p>(
    petsc: &'p Petsc<'p>,
    job: &Job,
    progress: &mut Progress,
    summary: &mut Summary,
) -> Result<BuiltBodies<'p>> {
    let world = petsc.world();
    let missing = || Error::Defect("bodies of contacts without names".into());
    let [disc_name, pads_name] = job.bodies.names.as_ref().ok_or_else(missing)?;
    let [disc, _] = both(job)?;
    progress.stage("sections");
    // Files are read by every rank, and may be there for some of them only.
    world.agree(examine(job))?.into_iter().for_each(|line| summary.line(line));
    let cell = |contact: &'_ FaceContact, cell: &job::ContactCell| (contact.face.clone(), *cell);
    let all: Vec<_> = job.contacts.iter().flat_map(|c| c.cells.iter().map(move |one| cell(c, one))).collect();
    let cells: Vec<FaceCell> = all
        .iter()
        .map(|(face, cell)| FaceCell { face, radius: cell.radius, angle: cell.angle, half: cell.half })
        .collect();
    // A contact that no analysis looks at takes no loads.
    let examined = !job.analyses.on_contact().is_empty();
    let cells = if examined { &cells[..] } else { &[] };
    let mut bodies = BuiltBodies::none();
    bodies.unique.push(Box::new(swept::disc((world, summary), (disc_name, disc), cells)?));
    let place = |side: Side| (side.name(), side);
    bodies.places.push(Place::meshless(place(Side::Lower), 0, Vec::new(), material_of(disc)?));
    progress.stage(format!("matrices of body {pads_name}"));
    let body = MatrixBody::new(petsc, pads_name, world.on_root(|| matrices_of(pads_name, &pads(job)?))?)?;
    summary.line(format!("body {pads_name}: {} degrees of freedom, {} contacts", body.dofs(), body.rows() / 3));
    bodies.unique.push(Box::new(body.with_modes_by(eigen_method(job))));
    bodies.places.push(Place::by_matrices(place(Side::Upper), 1));
    Ok(bodies)
}
