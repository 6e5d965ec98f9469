//! A disc that turns between pads that do not: its bodies and its interface.
//!
//! The disc is below each contact, x is e_θ and n points into it. The pads' own frame has the axle as z, and angles
//! about it count from x to y. On a face that looks along z the frame of a contact is x = e_θ, y = −e_r, on the other
//! one x = e_θ, y = e_r; the normal into a pad is the one out of the disc.

use super::bodies::{eigen_method, material_of, matrices_of, of_elements, BuiltBodies, Place};
use super::meshes::{Meshed, Meshes};
use super::swept;
use crate::body::averaged_trace::{MeshContact, SurfaceCell};
use crate::body::elements::Elements;
use crate::body::matrix_body::MatrixBody;
use crate::body::swept::FaceCell;
use crate::body::{ElasticBody, Side};
use crate::grid::{means, Faces, Interface, PatchShape, TurningPoints};
use crate::job::{self, ContactCell, FaceContact, Job, MatrixAxis, MatrixContact, MatrixDirection};
use crate::mesh::Mesh;
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::summary::Summary;
use crate::swept::SectionFace;
use crate::{Error, Result};
use std::collections::HashSet;
use std::rc::Rc;

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
fn area(cell: &ContactCell) -> f64 {
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

/// Axes of a cell in the frame of the pads: x and y of its contact, and the normal out of the pad, into the disc.
fn axes(face: &SectionFace, cell: &ContactCell) -> [[f64; 3]; 3] {
    let outwards = if face.looks_to_plus() { -1.0 } else { 1.0 };
    let (s, c) = cell.angle.sin_cos();
    [[-s, c, 0.0], [outwards * c, outwards * s, 0.0], [0.0, 0.0, outwards]]
}

/// The contacts of pads by matrices, by the cells of a job.
fn pad_contacts(job: &Job) -> Result<Vec<MatrixContact>> {
    let mut all = Vec::new();
    for ((i, contact), face) in job.contacts.iter().enumerate().zip(faces(job)?) {
        let normal = if face.looks_to_plus() { MatrixAxis::Z } else { MatrixAxis::MinusZ };
        all.extend(contact.cells.iter().enumerate().map(|(k, cell)| {
            let [along, across, _] = axes(&face, cell);
            MatrixContact {
                node: cell.node,
                against: None,
                normal: MatrixDirection::Axis(normal),
                tangential: [along, across].map(MatrixDirection::Vector).to_vec(),
                made_of: Some(format!("contacts.{i}.cells.{k}")),
            }
        }));
    }
    Ok(all)
}

/// Largest distance of a pad from the face of the disc, in parts of the shorter half side of a cell.
const APART: f64 = 0.05;

/// The cells of pads by a `mesh`, which lies where the pads are.
///
/// # Errors
/// A group that the mesh has not, a cell beside it, and a surface that does not lie on the disc.
fn surface_cells(job: &Job, mesh: &Mesh) -> Result<Vec<SurfaceCell>> {
    let [_, pads] = both(job)?;
    refuse_loose((job.bodies.name_of("upper"), pads), mesh)?;
    let mut all = Vec::new();
    for ((i, contact), face) in job.contacts.iter().enumerate().zip(faces(job)?) {
        let group = contact.pad_face.as_deref().unwrap_or_default();
        mesh.require_group(group, &format!("contacts.{i}.pad_face: the mesh of the pads"))?;
        for (k, cell) in contact.cells.iter().enumerate() {
            let axes = axes(&face, cell);
            let cell_mesh = seen_from(mesh, middle(&face, cell), axes);
            let faces = Faces::from_group(&cell_mesh, group)?;
            let named = |e: Error| e.context(format!("contacts.{i}.cells.{k}"));
            refuse_beside(&faces, cell, (group, face.y())).map_err(named)?;
            let patch = PatchShape::Rectangle { half: cell.half, middle: 0.0 };
            let [weights, ..] = means(&faces, patch).map_err(named)?.weights;
            all.push(SurfaceCell { weights, axes });
        }
    }
    Ok(all)
}

/// Refuses a piece of the `mesh` of the pads that nothing holds.
fn refuse_loose((name, pads): (&str, &job::Body), mesh: &Mesh) -> Result<()> {
    let pieces = mesh.pieces();
    let springs = pads.supports.iter().filter(|support| support.holds()).map(|support| &support.group);
    let facets = pads.fixed.iter().chain(springs).filter_map(|group| mesh.groups.get(group)).flatten();
    let held: HashSet<u32> = facets.flat_map(|&facet| mesh.cells.facet(facet)).map(|n| pieces[n as usize]).collect();
    match (0..mesh.nodes.len()).find(|&node| !held.contains(&pieces[node])) {
        Some(node) => {
            let [x, y, z] = mesh.nodes[node];
            Err(Error::Job(format!(
                "bodies.{name}.supports: nothing holds the pad with the node at ({x:.6}, {y:.6}, {z:.6}) m; give a \
                 group of its surface springs, or clamp it (fixed)"
            )))
        }
        None => Ok(()),
    }
}

/// Middle of a cell on its face in the frame of the pads, m.
fn middle(face: &SectionFace, cell: &ContactCell) -> [f64; 3] {
    let (s, c) = cell.angle.sin_cos();
    [cell.radius * c, cell.radius * s, face.y()]
}

/// A `mesh` in the frame with this `origin`, m, whose z is the normal and whose x is that of the `axes`.
fn seen_from(mesh: &Mesh, origin: [f64; 3], [along, _, normal]: [[f64; 3]; 3]) -> Mesh {
    let [a, n] = [along, normal];
    let across = [n[1] * a[2] - n[2] * a[1], n[2] * a[0] - n[0] * a[2], n[0] * a[1] - n[1] * a[0]];
    let mut mesh = mesh.clone();
    mesh.nodes.iter_mut().for_each(|p| {
        let from: [f64; 3] = std::array::from_fn(|c| p[c] - origin[c]);
        *p = [along, across, normal].map(|axis| axis.iter().zip(from).map(|(a, d)| a * d).sum());
    });
    mesh
}

/// Refuses a cell that the `faces` of the group of a pad, seen from the cell, do not cover, or that lie away from the
/// face of the disc at z, m.
fn refuse_beside(faces: &Faces, cell: &ContactCell, (group, z): (&str, f64)) -> Result<()> {
    let [a, b] = cell.half;
    let limit = APART * a.min(b);
    let part = |k: usize| k as f64 / 4.0 - 1.0;
    for [x, y] in (0..81).map(|k| [a * part(k % 9), b * part(k / 9)]) {
        let expected = format!("expected the pad on the face of the disc at z = {z:.6} m all over the cell");
        match faces.height([x, y]) {
            None => {
                return Err(Error::Job(format!(
                    "the group \"{group}\" of the mesh of the pads has no surface there, {:.2} mm along the circle and \
                     {:.2} mm along the radius from its middle; {expected}. Is the axle z of the mesh?",
                    1e3 * x,
                    1e3 * y
                )))
            }
            Some(height) if height.abs() > limit => {
                return Err(Error::Job(format!(
                    "the group \"{group}\" of the mesh of the pads is {:.4} mm away from the disc there; {expected}",
                    1e3 * height.abs()
                )))
            }
            Some(_) => {}
        }
    }
    Ok(())
}

/// Reads the pads of a job whole; their mesh, where they have one. For one rank.
///
/// # Errors
/// Matrices that do not fit each other, and a mesh that does not lie on the disc.
pub(crate) fn examine_pads(job: &Job, meshes: &Meshes) -> Result<Option<Rc<Meshed>>> {
    let [_, given] = both(job)?;
    let name = job.bodies.name_of("upper");
    if given.matrices.is_some() {
        return matrices_of(name, &pads(job)?).map(|_| None);
    }
    let read = meshes.mesh(job, name, given)?;
    surface_cells(job, &read.mesh)?;
    Ok(Some(read))
}

/// The pads of a job by matrices, with their contacts.
fn pads(job: &Job) -> Result<job::Body> {
    let [_, pads] = both(job)?;
    let mut pads = pads.clone();
    if let Some(matrices) = &mut pads.matrices {
        matrices.contacts = pad_contacts(job)?;
    }
    Ok(pads)
}

/// Collective: the pads of a job by a mesh, and on rank 0 its checksum.
fn meshed_pads<'p>(
    (petsc, summary): (&'p Petsc<'p>, &mut Summary),
    job: &Job,
    meshes: &Meshes,
    (name, pads): (&str, &job::Body),
) -> Result<(Elements<'p>, String)> {
    let read = petsc.world().on_root(|| {
        let read = meshes.mesh(job, name, pads)?;
        let cells = surface_cells(job, &read.mesh)?;
        Ok((read, cells))
    })?;
    let contacts: Vec<MeshContact> = read.iter().map(|(_, cells)| MeshContact::Cells(cells)).collect();
    let mesh = read.as_ref().map(|(read, _)| &read.mesh);
    let checksum = mesh.map(Mesh::checksum).unwrap_or_default();
    Ok((of_elements((petsc, summary), job, (name, pads), (mesh, &contacts), None)?, checksum))
}

/// Collective: the bodies of the job.
pub(super) fn build<'p>(
    petsc: &'p Petsc<'p>,
    job: &Job,
    meshes: &Meshes,
    progress: &mut Progress,
    summary: &mut Summary,
) -> Result<BuiltBodies<'p>> {
    let world = petsc.world();
    let missing = || Error::Defect("bodies of contacts without names".into());
    let [disc_name, pads_name] = job.bodies.names.as_ref().ok_or_else(missing)?;
    let [disc, given] = both(job)?;
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
    if given.matrices.is_none() {
        progress.stage(format!("mesh of body {pads_name}"));
        let (body, checksum) = meshed_pads((petsc, summary), job, meshes, (pads_name, given))?;
        bodies.unique.push(Box::new(body));
        bodies.places.push(Place { checksum, ..Place::by_matrices(place(Side::Upper), 1) });
    } else {
        progress.stage(format!("matrices of body {pads_name}"));
        let body = MatrixBody::new(petsc, pads_name, world.on_root(|| matrices_of(pads_name, &pads(job)?))?)?;
        summary.line(format!("body {pads_name}: {} degrees of freedom, {} contacts", body.dofs(), body.rows() / 3));
        bodies.unique.push(Box::new(body.with_modes_by(eigen_method(job))));
        bodies.places.push(Place::by_matrices(place(Side::Upper), 1));
    }
    Ok(bodies)
}
