//! Bodies swept from sections, as a job gives them.

use super::bodies::{material_of, BuiltBodies};
use super::{absorbers, rail};
use crate::body::separate_bodies::{SeparateBodies, SeparateBody};
use crate::body::swept::{FaceCell, RevolvedSpec, Swept};
use crate::body::{ContactSpec, ElasticBody, Side};
use crate::fem::ElasticMaterial;
use crate::grid::ContactGrid;
use crate::job::{self, Job, MeshSource, Section, SectionFile, WheelDimensions};
use crate::mesh::msh::plane::{self, Plane};
use crate::parallel::World;
use crate::placement::Seat;
use crate::progress::Progress;
use crate::summary::Summary;
use crate::swept::{
    Bearing, CylinderSection, DrawnSection, EdgeSprings, Path, RunningPlace, SectionLayer, SectionSource, Wheel,
    WheelShape,
};
use crate::{Error, Result};
use std::rc::Rc;

/// By how much the rolling radius of a job may miss that of the drawing, over it.
const RADIUS: f64 = 1e-3;

/// The section of a body, whose contact is where its mesh says it.
pub(super) fn section(body: &job::Body) -> Result<SectionSource> {
    let Some(MeshSource::Revolved(revolved)) = &body.mesh else {
        return Err(Error::Defect("a section is asked for of a body that is not swept".into()));
    };
    let contact_offset = revolved.contact_offset;
    Ok(match &revolved.section {
        Section::W920S => SectionSource::Wheel(Wheel::w920s(contact_offset)),
        Section::W920SWheelset => {
            let shape = WheelShape::w920s_wheelset();
            SectionSource::Wheel(Wheel { shape, offset: contact_offset, height: None, mirrored: false })
        }
        Section::Wheel(wheel) => {
            let shape = shape(wheel);
            SectionSource::Wheel(Wheel { shape, offset: contact_offset, height: None, mirrored: false })
        }
        Section::File(file) => {
            let drawn = drawn(file, contact_offset)?;
            // Its frame is tilted where a placement says where it is touched.
            if body.profile.is_none() {
                drawn.refuse_steep(contact_offset)?;
            }
            SectionSource::DrawnSection { drawn: Rc::new(drawn), offset: contact_offset, mirrored: false }
        }
        &Section::Cylinder(job::Ring { inner_radius, outer_radius, thickness, crown_radius }) => {
            SectionSource::Cylinder(CylinderSection {
                inner_radius,
                outer_radius,
                thickness,
                crown_radius,
                contact_offset,
            })
        }
    })
}

/// Shape of a wheel by its main dimensions.
fn shape(wheel: &WheelDimensions) -> WheelShape {
    let layer = wheel.layer.as_ref().map(|of| {
        let &job::Material { young, poisson, density } = &of.material;
        let material = ElasticMaterial { young, poisson, density };
        let inner = 0.5 * of.inner_diameter;
        let layer = SectionLayer { name: "layer".into(), material, loss: of.loss_factor };
        (layer, [inner, inner + of.thickness])
    });
    let [at_rim, at_hub] = wheel.web_middle();
    WheelShape {
        name: "the wheel",
        bore_group: "bore",
        radii: wheel.radii(),
        hub: wheel.hub(),
        web: [wheel.web_thickness, at_rim, at_hub],
        rim: wheel.rim(),
        layer,
        axle: None,
    }
}

/// Layers of a drawn section with their faces.
fn layers<'d>(file: &SectionFile, drawing: &'d Plane) -> Result<Vec<(SectionLayer, &'d [usize])>> {
    let of = |(i, layer): (usize, &job::FileLayer)| {
        let Some(faces) = drawing.surfaces.get(&layer.group) else {
            let there: Vec<String> = drawing.surfaces.keys().map(|name| format!("{name:?}")).collect();
            return Err(Error::Job(format!(
                "section.file.layers.{i}.group: found {:?}, expected a physical surface of {}, which has {}",
                layer.group,
                file.path.display(),
                if there.is_empty() { "none".into() } else { there.join(", ") }
            )));
        };
        let &job::Material { young, poisson, density } = &layer.material;
        let material = ElasticMaterial { young, poisson, density };
        Ok((SectionLayer { name: layer.group.clone(), material, loss: layer.loss_factor }, &faces[..]))
    };
    file.layers.iter().enumerate().map(of).collect()
}

/// The drawing in a file, x along the axle and y away from it, with the rolling radius that the job says at y =
/// `offset`, m.
fn drawn(file: &SectionFile, offset: f64) -> Result<DrawnSection> {
    let name = file.path.display();
    let drawing = plane::read(&file.path)?;
    let place = |&[x, y]: &[f64; 2]| [file.scale * y, file.scale * x];
    let drawn = DrawnSection::new(
        Path::Axle,
        drawing.nodes.iter().map(place).collect(),
        &drawing.faces,
        &drawing.curves,
        &file.running,
    )
    .map_err(|e| e.context(format!("section {name}")))?;
    let drawn = match file.layers[..] {
        [] => drawn,
        _ => {
            drawn.with_layers(layers(file, &drawing)?).map_err(|e| e.context(format!("section.file.layers, {name}")))?
        }
    };
    let drawn = match file.middle {
        Some(middle) => {
            drawn.with_mirror_image(middle).map_err(|e| e.context(format!("section.file.middle, {name}")))?
        }
        None => drawn,
    };
    match drawn.running(offset) {
        Some([radius, _]) if (radius - file.radius).abs() > RADIUS * file.radius => Err(Error::Job(format!(
            "section.file.radius: found {} m, but the running line of {name} has the radius {radius:.6} m at y \
             = {offset} m; give that, or the unit of the \
             drawing (section.file.scale)",
            file.radius
        ))),
        _ => Ok(drawn),
    }
}

/// An error if a group that holds the body is not in its section.
fn held(body: &job::Body, section: &crate::swept::CrossSection) -> Result<()> {
    let groups = body.fixed.iter().map(|g| ("fixed", g)).chain(body.supports.iter().map(|s| ("supports", &s.group)));
    for (key, group) in groups {
        if !section.groups.contains_key(group) {
            let there: Vec<String> = section.groups.keys().map(|k| format!("\"{k}\"")).collect();
            return Err(Error::Job(format!(
                "{key}: the section has no group \"{group}\"; its groups are {}",
                if there.is_empty() { "none".into() } else { there.join(", ") }
            )));
        }
    }
    Ok(())
}

/// Distance of a seat from the running circle towards the flange, m: a right-hand wheel has its flange at −y.
fn offset(seat: Seat, side: job::TrackSide) -> f64 {
    if side == job::TrackSide::Right {
        -seat.y
    } else {
        seat.y
    }
}

/// Position of the contact on the section of a wheel or a rail: the wheel at a seat, on a side of the track.
fn section_at(body: &job::Body, seat: Seat, side: job::TrackSide) -> Result<SectionSource> {
    let right = side == job::TrackSide::Right;
    let offset = offset(seat, side);
    match section(body)? {
        SectionSource::Wheel(wheel) => {
            Ok(SectionSource::Wheel(Wheel { offset, height: Some(seat.z), mirrored: right, ..wheel }))
        }
        SectionSource::DrawnSection { drawn, .. } => Ok(SectionSource::DrawnSection { drawn, offset, mirrored: right }),
        SectionSource::Cylinder(_) => Err(Error::Defect("a cylinder has no profile".into())),
    }
}

/// An error where the wheel `body` cannot be touched at a seat.
pub(crate) fn touched(body: &job::Body, seat: Seat, side: job::TrackSide) -> Result<()> {
    section_at(body, seat, side)?.for_modes().map(|_| ())
}

/// A contact on a wheel.
#[derive(Debug, Clone)]
pub(crate) struct WheelContact {
    /// Its place on the profile.
    pub seat: Seat,
    /// Side of the track of its wheel.
    pub side: job::TrackSide,
    /// Lines of its grid along x and y, m; none where no analysis looks at the contact.
    pub lines: Option<[Vec<f64>; 2]>,
    /// Angle about the axle from the first contact, in the direction of x, rad.
    pub along: f64,
}

/// Contacts of a body of a section, and the angle of the frame in which it is shown, rad.
#[derive(Default)]
struct Touched<'c> {
    running: &'c [ContactSpec<'c, RunningPlace>],
    cells: &'c [FaceCell<'c>],
    tilt: f64,
}

/// A disc that is touched at `cells` of its faces.
pub(super) fn disc<'p>(
    told: (&'p World, &mut Summary),
    (name, body): (&str, &job::Body),
    cells: &[FaceCell],
) -> Result<Swept<'p>> {
    made(told, (name, body), section(body)?, Touched { cells, ..Touched::default() })
}

/// A body of a section with its contacts.
fn made<'p>(
    (world, summary): (&'p World, &mut Summary),
    (name, body): (&str, &job::Body),
    section: SectionSource,
    touched: Touched,
) -> Result<Swept<'p>> {
    let (material, springs, suspension) = (material_of(body)?, springs(body), bearings(body));
    let carried = absorbers::carried(name, body, &section)?;
    let making = RevolvedSpec {
        section,
        material,
        fixed: &body.fixed,
        springs: &springs,
        attachments: &carried.attachments,
        suspension: &suspension,
        rotates: body.rotates(),
        contacts: touched.running,
        cells: touched.cells,
        tilt: touched.tilt,
    };
    let swept = Swept::new(world, name, making)?;
    let unknowns = swept.unknowns();
    let inertia = in_words(swept.inertia());
    summary.line(format!("body {name}: swept, {unknowns} unknowns of each order, {inertia}"));
    carried.lines.into_iter().for_each(|line| summary.line(line));
    Ok(swept)
}

/// Mass and moments of inertia of a body of revolution in words.
fn in_words([mass, _, polar, diametral]: [f64; 4]) -> String {
    format!("mass {mass:.6e} kg, moments of inertia {polar:.5e} kg m² (polar), {diametral:.5e} kg m² (diametral)")
}

/// Lines with mass and moments of inertia of the bodies of revolution of a job.
pub(crate) fn inertia(job: &Job) -> Result<Vec<String>> {
    let turned = |(_, body): &(String, &job::Body)| matches!(body.mesh, Some(MeshSource::Revolved(_)));
    let of = |(name, body): (String, &job::Body)| {
        let inertia = section(body)?.for_modes()?.inertia(material_of(body)?);
        Ok(format!("body {name}: {}", in_words(inertia)))
    };
    job.all_bodies().into_iter().filter(turned).map(of).collect()
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

/// The bearings of a body on a primary suspension, at their places along the axle as the job gives them.
fn bearings(body: &job::Body) -> Vec<Bearing> {
    let Some(suspension) = &body.suspension else { return Vec::new() };
    let stiffness = [suspension.longitudinal, suspension.lateral, suspension.vertical];
    suspension.places().iter().map(|&y| Bearing { place: [0.0, y], stiffness }).collect()
}

/// The wheel or wheelset `body` of a placement with its contacts, the same on every rank.
pub(crate) fn wheel<'p>(
    told: (&'p World, &mut Summary),
    (name, body): (&str, &job::Body),
    contacts: &[WheelContact],
) -> Result<Swept<'p>> {
    let first = contacts.first().ok_or_else(|| Error::Defect("a wheel of a placement without a contact".into()))?;
    let mut specs = Vec::new();
    for (number, contact) in contacts.iter().enumerate() {
        let Some([x, y]) = &contact.lines else { continue };
        let WheelContact { seat, side, along, .. } = *contact;
        let own = ContactSpec::own([&x[..], &y[..]], seat.tilt);
        let place = RunningPlace { y: offset(seat, side), height: Some(seat.z), opposite: side != first.side };
        specs.push(if number == 0 { own } else { ContactSpec { place: Some(place), along, ..own } });
    }
    let touched = Touched { running: &specs, tilt: first.seat.tilt, ..Touched::default() };
    made(told, (name, body), section_at(body, first.seat, first.side)?, touched)
}

/// The grid of a body at a `contact`, in lower form; none where that has none.
pub fn grid(contact: &job::Contact, body: &job::Body) -> Result<Option<ContactGrid>> {
    let Some(patch) = contact.patch else { return Ok(None) };
    let Some(spacing) = patch.spacing else { return Ok(None) };
    let line = |half: f64| -> Vec<f64> {
        // Rounding does not make a line more.
        let n = (half / spacing - 1e-9).ceil() as i64;
        (-n..=n).map(|i| i as f64 * spacing).collect()
    };
    let (x, y) = (line(patch.half_length), line(patch.half_width));
    let z = match rail::extruded(body) {
        Some(extruded) => {
            let across = rail::heights(extruded, &y)?;
            across.into_iter().flat_map(|z| std::iter::repeat_n(z, x.len())).collect()
        }
        None => {
            let section = &section(body)?;
            y.iter().flat_map(|&y| x.iter().map(move |&x| section.height(x, y))).collect()
        }
    };
    Ok(Some(ContactGrid::meshless(x, y, z)))
}

/// Nodes and elements of the section of a body, as the modes see it.
pub fn size(body: &job::Body) -> Result<[usize; 2]> {
    if let Some(extruded) = rail::extruded(body) {
        return rail::size(extruded);
    }
    let given = section(body)?;
    let section = given.for_modes()?;
    held(body, &section)?;
    given.bearings(&section, &bearings(body))?;
    Ok([section.nodes.len(), section.elements.len()])
}

/// Collective: the bodies of the job.
pub fn build<'p>(
    world: &'p World,
    job: &Job,
    progress: &mut Progress,
    summary: &mut Summary,
) -> Result<BuiltBodies<'p>> {
    progress.stage("sections");
    let given = job.bodies();
    // Files are read by every rank, and may be there for some of them only.
    let swept = given.iter().filter(|(_, body)| rail::extruded(body).is_none());
    world.agree(
        swept
            .map(|(name, body)| section(body).map_err(|e| e.context(format!("bodies.{name}.mesh.revolved"))))
            .collect::<Result<Vec<_>>>(),
    )?;
    let same = match &given[..] {
        [(_, a), (_, b)] => {
            a.mesh == b.mesh
                && a.material == b.material
                && a.fixed == b.fixed
                && a.supports == b.supports
                && a.suspension == b.suspension
                && a.absorbers == b.absorbers
                && a.ring_dampers == b.ring_dampers
                && a.rotation == b.rotation
                && a.track == b.track
                && a.modes == b.modes
        }
        _ => false,
    };
    // At each contact around the axle of the lower body stands an upper one.
    let contacts: Vec<&job::Contact> = job.contact.iter().flat_map(job::Contact::all).collect();
    let examined = !job.analyses.on_contact().is_empty();
    let same = same && contacts.len() < 2;
    let mut bodies = BuiltBodies::none();
    for (i, (name, body)) in given.iter().enumerate() {
        let grids = match examined {
            true => {
                contacts.iter().filter_map(|contact| grid(contact, body).transpose()).collect::<Result<Vec<_>>>()?
            }
            false => Vec::new(),
        };
        let material = material_of(body)?;
        let side = Side::named(name)?;
        if same && i == 1 {
            summary.line(format!("body {name}: the mirror image of the lower one, computed once"));
        } else if rail::extruded(body).is_some() {
            let lines = grids.first().map(|g| [g.x.clone(), g.y.clone()]);
            let contact = rail::RailContact { at: None, lines, along: 0.0 };
            bodies.unique.push(Box::new(rail::build((world, summary), job, (name, body), &[contact])?));
        } else if side == Side::Upper && contacts.len() > 1 {
            bodies.unique.push(Box::new(separate((world, summary), job, examined)?) as Box<dyn ElasticBody>);
        } else {
            let contacts = grids.iter().zip(&contacts).map(|(grid, contact)| at_grid(grid, contact.turned));
            let contacts: Vec<_> = contacts.collect();
            let touched = Touched { running: &contacts, ..Touched::default() };
            bodies.unique.push(Box::new(made((world, summary), (name, body), section(body)?, touched)?));
        }
        let grids = match side {
            _ if !examined || !world.is_root() => Vec::new(),
            Side::Upper if contacts.len() > 1 => grids_around(job)?,
            _ => grids,
        };
        bodies.places.push(super::bodies::Place::meshless((name, side), bodies.unique.len() - 1, grids, material));
    }
    Ok(bodies)
}

/// A contact on the lines of `grid` at the angle `along`, rad.
fn at_grid(grid: &ContactGrid, along: f64) -> ContactSpec<'_, RunningPlace> {
    ContactSpec { along, ..ContactSpec::own([&grid.x[..], &grid.y[..]], 0.0) }
}

/// A body on the lower one at a contact.
struct Standing<'j> {
    /// Its name among them.
    name: String,
    /// Its key below `bodies`.
    key: String,
    body: &'j job::Body,
    contact: &'j job::Contact,
}

/// The bodies on the lower one, in the order of their contacts.
fn standing<'j>(job: &'j Job) -> Result<Vec<Standing<'j>>> {
    let of = |(number, contact): (usize, &'j job::Contact)| {
        let missing = || Error::Defect("a contact of a body that the job does not give".into());
        let (key, body) = job.upper_at(contact).ok_or_else(missing)?;
        let name = contact.body.clone().unwrap_or_else(|| format!("body {}", number + 1));
        Ok(Standing { name, key, body, contact })
    };
    job.contact.iter().flat_map(job::Contact::all).enumerate().map(of).collect()
}

/// Grids of the bodies on the lower one, in the order of their contacts.
fn grids_around(job: &Job) -> Result<Vec<ContactGrid>> {
    let missing = || Error::Defect("a contact without a grid".into());
    standing(job)?.iter().map(|one| grid(one.contact, one.body)?.ok_or_else(missing)).collect()
}

/// The bodies on the lower one, each with its own contact where contacts are `examined`.
fn separate<'p>(
    (world, summary): (&'p World, &mut Summary),
    job: &Job,
    examined: bool,
) -> Result<SeparateBodies<'p, Swept<'p>>> {
    let standing = standing(job)?;
    let grids = if examined { grids_around(job)? } else { Vec::new() };
    let mut all = Vec::with_capacity(standing.len());
    for (number, one) in standing.iter().enumerate() {
        let contacts: Vec<_> = grids.get(number).map(|grid| at_grid(grid, 0.0)).into_iter().collect();
        let first = standing.iter().position(|other| other.key == one.key).unwrap_or(all.len());
        // Bodies that are alike are told once.
        let mut quiet = Summary::default();
        let told = if first == all.len() { &mut *summary } else { &mut quiet };
        let at = |e: Error| e.context(format!("bodies.{}", one.key));
        let touched = Touched { running: &contacts, ..Touched::default() };
        let body = made((world, told), (&one.key, one.body), section(one.body)?, touched).map_err(at)?;
        all.push(SeparateBody { name: one.name.clone(), family: None, section: first, body });
    }
    let count = all.len();
    summary.line(match standing.iter().all(|one| one.key == "upper") {
        true => format!("body upper: {count} alike around the lower one, without coupling of their own"),
        false => {
            let names: Vec<&str> = standing.iter().map(|one| &*one.name).collect();
            format!("body upper: {count} around the lower one, without coupling of their own: {}", names.join(", "))
        }
    });
    Ok(SeparateBodies::new(world, "upper", all))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The default dimensions of a wheel are those of W920S.
    #[test]
    fn a_wheel_of_default_dimensions_is_w920s() {
        let wheel: WheelDimensions = serde_json::from_str(r#"{"diameter": 0.92}"#).unwrap();
        let built = SectionSource::Wheel(Wheel { shape: shape(&wheel), offset: 0.0, height: None, mirrored: false });
        let known = SectionSource::Wheel(Wheel::w920s(0.0));
        let [built, known] = [built, known].map(|given| given.for_modes().unwrap());
        assert_eq!(built.tread, known.tread);
        assert_eq!(built.groups["bore"], known.groups["inner"]);
        // The triangles at the corners hang on the last bits of their sides.
        let steel = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };
        let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-12 * b.abs().max(1.0);
        assert!(built.inertia(steel).iter().zip(&known.inertia(steel)).all(near));
        let sides = |section: &crate::swept::CrossSection| section.extent().concat();
        assert!(sides(&built).iter().zip(&sides(&known)).all(near));
    }
}
