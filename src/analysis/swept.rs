//! Bodies swept from sections, as a job gives them.

use super::bodies::Bodies;
use super::rail;
use super::report::Summary;
use crate::body::swept::{Making, Swept};
use crate::body::Side;
use crate::fem::Material;
use crate::grid::ContactGrid;
use crate::job::{self, Job, MeshSource, Section};
use crate::parallel::World;
use crate::progress::Progress;
use crate::swept::{BuiltIn, Cylinder};
use crate::{Error, Result};

/// The section of a body.
fn section(body: &job::Body) -> Result<BuiltIn> {
    let Some(MeshSource::Revolved(revolved)) = &body.mesh else {
        return Err(Error::Defect("a section is asked for of a body that is not swept".into()));
    };
    let contact_offset = revolved.contact_offset;
    Ok(match revolved.section {
        Section::W920S => BuiltIn::W920S(contact_offset),
        Section::Cylinder(job::Ring { inner_radius, outer_radius, thickness, crown_radius }) => {
            BuiltIn::Cylinder(Cylinder { inner_radius, outer_radius, thickness, crown_radius, contact_offset })
        }
    })
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
                && a.rotation == b.rotation
                && a.track == b.track
        }
        _ => false,
    };
    let mut bodies = Bodies::none();
    for (i, (name, body)) in given.iter().enumerate() {
        let grid = grid(job, body)?.filter(|_| !job.analyses.on_contact().is_empty());
        let m = body.elastic()?;
        let material = Material { young: m.young, poisson: m.poisson, density: m.density };
        let side = Side::named(name).unwrap_or(Side::Lower);
        if same && i == 1 {
            summary.line(format!("body {name}: the mirror image of the lower one, computed once"));
        } else if rail::extruded(body).is_some() {
            let lines = grid.as_ref().map(|g| [&g.x[..], &g.y[..]]);
            let rail = rail::make(world, job, (name, body), None, lines)?;
            summary.line(format!(
                "body {name}: rail, {} unknowns of each order, {:.2} kg/m",
                rail.unknowns(),
                rail.mass()
            ));
            bodies.unique.push(Box::new(rail));
        } else {
            let making = Making {
                section: section(body)?,
                material,
                fixed: &body.fixed,
                rotates: body.rotates(),
                grid: grid.as_ref().map(|g| [&g.x[..], &g.y[..]]),
            };
            let swept = Swept::new(world, name, making)?;
            summary.line(format!(
                "body {name}: swept, {} unknowns of each order, mass {:.6e} kg",
                swept.unknowns(),
                swept.mass()
            ));
            bodies.unique.push(Box::new(swept));
        }
        let grid = grid.filter(|_| world.is_root());
        bodies.places.push(super::bodies::Place::meshless((name, side), bodies.unique.len() - 1, grid, material));
    }
    Ok(bodies)
}
