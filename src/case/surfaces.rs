//! How the meshes of two bodies meet: on the grid that both have, or on a common one that neither needs to have.

use super::interface::creepage;
use super::meshes::{Meshed, Meshes};
use super::positioned_mesh::{in_contact_frame, tilted};
use crate::body::half_space::HalfSpace;
use crate::body::hybrid::{CIRCLE, WIDER};
use crate::contact::SPIN_SPACINGS;
use crate::grid::{averages, means, ContactGrid, Faces, PatchAverage, PatchShape, Transfer};
use crate::job::{self, Compliance, Job, Load, MeshSource, MOST_NODES};
use crate::mesh::Mesh;
use crate::placement::{Ellipse, HertzLoad};
use crate::swept::{CylinderSection, SectionSource};
use crate::{Error, Result};

/// Half the extent of a grid over that of Hertz' ellipse, and spacings over its smaller half axis.
const MARGIN: f64 = 1.7;
const SPACINGS: f64 = 10.0;
/// Radius of the loads of "hybrid" over the distance of the nodes at the contact: fewer do not show the load.
const FACES: f64 = 2.5;
/// An error of the gap of more than this part of the approach is warned of.
const GAP: f64 = 0.02;
/// Distances of nodes in the smaller half axis of the contact from which on their own compliance is nearer to the
/// truth than that of a half-space with what the rest adds: docs/reference/meshes.md has the study.
const FINE: f64 = 7.0;
/// By how much the spacing of a grid may fall short of the size of the faces.
const SHORT: f64 = 1e-6;

/// Two meshes in contact.
#[derive(Debug, Default)]
pub struct SurfacePairing {
    /// The grid as the lower and the upper body meet it; two of them.
    pub grids: Vec<ContactGrid>,
    /// Description of the steps taken, one line each.
    pub lines: Vec<String>,
    /// Properties that make results doubtful.
    pub warnings: Vec<String>,
}

/// The lines of the common grid, and Hertz' ellipse where that is known.
struct Lines {
    x: Vec<f64>,
    y: Vec<f64>,
    ellipse: Option<Ellipse>,
}

/// Returns whether the job asks for a common grid, and why.
fn asked(contact: &job::Contact) -> Option<&'static str> {
    match (contact.grid, contact.compliance) {
        (Some(_), _) => Some("contact.grid"),
        (None, Compliance::Hybrid) => Some("the compliance \"hybrid\""),
        _ => None,
    }
}

/// Why two meshes do not meet on a grid of their own; none where they do.
fn differ([lower, upper]: [&Meshed; 2]) -> Option<String> {
    match [&lower.grid, &upper.grid] {
        [Some(Ok(a)), Some(Ok(b))] => ContactGrid::matched(a, b, 1e-3 * spacing(a)).err(),
        [Some(Err(e)), _] | [_, Some(Err(e))] => Some(e.clone()),
        _ => None,
    }
    .map(|e| e.message().to_owned())
}

/// Smallest distance of the lines of a grid, m.
pub(crate) fn spacing(grid: &ContactGrid) -> f64 {
    grid.x.windows(2).chain(grid.y.windows(2)).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min)
}

/// Exact geometry of a body, where its description gives it.
fn exact(body: &job::Body) -> Option<SectionSource> {
    let Some(MeshSource::Cylinder(c)) = &body.mesh else { return None };
    let &job::Cylinder { inner_radius, outer_radius, thickness, crown_radius, contact_offset, .. } = c;
    Some(SectionSource::Cylinder(CylinderSection {
        inner_radius,
        outer_radius,
        thickness,
        crown_radius,
        contact_offset,
    }))
}

/// Curvatures of a body at its contact, 1/m; none where neither its description nor its mesh shows them.
fn curvatures(body: &job::Body, faces: Option<&Faces>) -> Option<[[f64; 2]; 2]> {
    match body.running() {
        Some(r) => Some([[1.0 / r.radius, 0.0], [0.0, r.crown.map_or(0.0, |c| 1.0 / c)]]),
        None => faces?.curvatures(),
    }
}

/// Hertz' ellipse of the job, where the curvatures of both bodies are known and make one.
fn ellipse(job: &Job, contact: &job::Contact, faces: [Option<&Faces>; 2]) -> Result<Option<Ellipse>> {
    let mut relative = [[0.0; 2]; 2];
    let mut compliance = 0.0;
    for ((_, body), faces) in job.bodies().into_iter().zip(faces) {
        let m = body.elastic()?;
        compliance += 1.0 / HalfSpace { young: m.young, poisson: m.poisson }.plane();
        let Some(own) = curvatures(body, faces) else { continue };
        (0..4).for_each(|k| relative[k / 2][k % 2] += own[k / 2][k % 2]);
    }
    if let Some([along, across]) = contact.grid.and_then(|g| g.curvatures) {
        relative = [[along, 0.0], [0.0, across]];
    }
    let press = match contact.load() {
        Load::Normal(force) => HertzLoad::Force(force),
        Load::Approach(approach) => HertzLoad::Approach(approach),
    };
    Ok(Ellipse::new(relative, 1.0 / compliance, press).ok())
}

/// The lines of the common grid of the job.
fn lines(job: &Job, contact: &job::Contact, faces: [Option<&Faces>; 2]) -> Result<Lines> {
    let given = contact.grid.unwrap_or_default();
    let ellipse = ellipse(job, contact, faces)?;
    let extent = ellipse.as_ref().map(Ellipse::extent);
    let missing = |key: &str| {
        Error::Job(format!(
            "contact.grid.{key}: missing; the curvatures at the contact make no ellipse of Hertz from which it \
             could follow. Give half_length, half_width and \
             spacing (m), or curvatures (1/m)"
        ))
    };
    let half =
        |key: &str, given: Option<f64>, c: usize| given.or(extent.map(|e| MARGIN * e[c])).ok_or_else(|| missing(key));
    let (length, width) = (half("half_length", given.half_length, 0)?, half("half_width", given.half_width, 1)?);
    let spacings = |e: [f64; 2]| if creepage(contact).is_ruled_by_spin(e) { SPIN_SPACINGS } else { SPACINGS };
    let spacing = given.spacing.or(extent.map(|e| e[0].min(e[1]) / spacings(e))).ok_or_else(|| missing("spacing"))?;
    let line = |key: &str, half: f64| -> Result<Vec<f64>> {
        // Rounding does not make a line more.
        let n = (half / spacing - 1e-9).ceil().max(2.0);
        // Either may have followed from the ellipse, so that this is seen only here.
        if !(2.0 * n <= MOST_NODES) {
            return Err(Error::Job(format!(
                "contact.grid.{key}: {half:.4e} m with a spacing of {spacing:.4e} m is {n:.0} spacings; \
                 expected at most {}. Give a smaller contact.grid.{key}, or a \
                 larger contact.grid.spacing",
                0.5 * MOST_NODES
            )));
        }
        let n = n as i64;
        Ok((-n..=n).map(|i| i as f64 * spacing).collect())
    };
    Ok(Lines { x: line("half_length", length)?, y: line("half_width", width)?, ellipse })
}

/// The grid that the meshes of the job, the lower one first, share, or a common one where they have none or the job
/// asks for it.
pub fn meet(job: &Job, meshed: [&Meshed; 2]) -> Result<SurfacePairing> {
    let Some(contact) = &job.contact else { return Ok(SurfacePairing::default()) };
    let why = asked(contact).map(str::to_owned).or_else(|| differ(meshed));
    let Some(why) = why else {
        let own = |m: &Meshed| m.grid.clone().and_then(Result::ok);
        let grids: Vec<ContactGrid> = meshed.into_iter().filter_map(own).collect();
        let ellipse = ellipse(job, contact, [None, None])?;
        let lines = recommended(contact, ellipse.as_ref(), grids.first().map_or(0.0, spacing)).into_iter().collect();
        return Ok(SurfacePairing { grids, lines, ..SurfacePairing::default() });
    };
    let named = |name: &str| {
        let at = format!("bodies.{name}.mesh");
        move |e: Error| e.context(&at)
    };
    let mut faces = Vec::new();
    for ((name, _), m) in job.bodies().into_iter().zip(meshed) {
        faces.push(Faces::from_group(&m.mesh, "contact").map_err(named(name))?);
    }
    let [lower, upper] = &faces[..] else { return Err(Error::Defect("a contact of one body".into())) };
    let Lines { x, y, ellipse } = lines(job, contact, [Some(lower), Some(upper)])?;
    let mut meeting = SurfacePairing::default();
    meeting.lines.push(format!(
        "contact grid: {} x {} nodes, {:.3} mm apart, on which both meshes meet ({why})",
        x.len(),
        y.len(),
        1e3 * (x[1] - x[0])
    ));
    for ((name, body), faces) in job.bodies().into_iter().zip(&faces) {
        let mut met = foot(contact, faces, (&x, &y)).map_err(named(name))?;
        meeting.lines.push(format!("body {name}: {}", met.1));
        if let Some(given) = exact(body) {
            met.0.z = y.iter().flat_map(|&b| x.iter().map(|&a| given.height(a, b)).collect::<Vec<_>>()).collect();
            meeting.grids.push(met.0);
            continue;
        }
        let across = curvatures(body, Some(faces)).map_or(0.0, |c| c[0][0].abs().max(c[1][1].abs()));
        let half = [x[x.len() - 1], y[y.len() - 1]];
        let off = faces.size(half).powi(2) * across / 8.0;
        let approach = ellipse.as_ref().map_or(f64::INFINITY, |e| e.approach);
        let given = contact.grid.is_some_and(|g| g.curvatures.is_some());
        if !given && faces.are_flat(half) && off > GAP * approach {
            meeting.warnings.push(format!(
                "bodies.{name}.mesh: the flat faces at the contact are {:.1} µm off the round surface between \
                 their nodes (size² times curvature / 8), where the \
                 bodies approach each other by about {:.1} µm: give contact.grid.curvatures, or take cells of \
                 second order",
                1e6 * off,
                1e6 * approach
            ));
        }
        meeting.grids.push(met.0);
    }
    let half = [x[x.len() - 1], y[y.len() - 1]];
    let size = faces.iter().map(|f| f.size(half)).fold(0.0, f64::max);
    meeting.lines.extend(recommended(contact, ellipse.as_ref(), size));
    if let Some([along, across]) = contact.grid.and_then(|g| g.curvatures) {
        let height = |x: f64, y: f64| -0.5 * (along * x * x + across * y * y);
        let z: Vec<f64> = y.iter().flat_map(|&b| x.iter().map(move |&a| height(a, b))).collect();
        meeting.grids[0].z = z;
        meeting.grids[1].z = vec![0.0; x.len() * y.len()];
    }
    Ok(meeting)
}

/// Lines of the common grid on which the meshes of the job, the lower one first, meet, m; none where they meet on
/// nodes of their own.
///
/// # Errors
/// As [`meet`], but for what is wrong with the grid on the surfaces.
pub(super) fn common(job: &Job, meshed: [&Meshed; 2]) -> Result<Option<[Vec<f64>; 2]>> {
    let Some(contact) = &job.contact else { return Ok(None) };
    if asked(contact).is_none() && differ(meshed).is_none() {
        return Ok(None);
    }
    let [lower, upper] = meshed.map(|m| Faces::from_group(&m.mesh, "contact"));
    let Lines { x, y, .. } = lines(job, contact, [Some(&lower?), Some(&upper?)])?;
    Ok(Some([x, y]))
}

/// The nodes of the grid of the lines `x` and `y`, m, on the group `contact` of a mesh in lower form, which the frame
/// of the grid is turned against by `tilt`, rad, about x: their places in the frame of the mesh, m, `[nx*ny]`, and
/// whether there is a face. Where there is none they are in the plane of the contact.
pub(super) fn surface_points(mesh: &Mesh, [x, y]: [&[f64]; 2], tilt: f64) -> Result<Vec<([f64; 3], bool)>> {
    let faces = match tilt == 0.0 {
        true => Faces::from_group(mesh, "contact")?,
        false => Faces::from_group(&tilted(mesh, tilt), "contact")?,
    };
    let node = |a: f64, b: f64| {
        let height = faces.height([a, b]);
        (in_contact_frame([a, b, height.unwrap_or(0.0)], -tilt), height.is_some())
    };
    Ok(y.iter().flat_map(|&b| x.iter().map(move |&a| (a, b))).map(|(a, b)| node(a, b)).collect())
}

/// Positions of nodes of a contact `grid` on the surface of a mesh, as [`surface_points`] has it, m; none where they
/// are nodes of the mesh.
pub(super) fn beside_nodes(mesh: &Mesh, grid: &ContactGrid, tilt: f64) -> Result<Vec<[f64; 3]>> {
    match &grid.transfer {
        Some(Transfer::Averages { .. } | Transfer::PatchAverage { .. }) => {
            Ok(surface_points(mesh, [&grid.x, &grid.y], tilt)?.into_iter().map(|(place, _)| place).collect())
        }
        _ => Ok(Vec::new()),
    }
}

/// Which compliance suits a contact with nodes so far apart as `size`, m, in words.
fn recommended(contact: &job::Contact, ellipse: Option<&Ellipse>, size: f64) -> Option<String> {
    let [a, b] = ellipse?.semi_axes;
    let count = a.min(b) / size;
    let taken = match contact.compliance {
        Compliance::HalfSpace => return None,
        Compliance::Fe => "fe",
        Compliance::Hybrid => "hybrid",
    };
    let better = if count < FINE { "hybrid" } else { "fe" };
    let relation = if count < FINE { "fewer than" } else { "at least" };
    Some(format!(
        "compliance of the contact: \"{taken}\"; recommended: \"{better}\", as there are {count:.1} distances \
         of nodes of the meshes in its smaller half axis, \
         {relation} {FINE}"
    ))
}

/// How the `faces` of a body meet the grid of the lines `x` and `y`, and that in words.
pub(crate) fn foot(contact: &job::Contact, faces: &Faces, (x, y): (&[f64], &[f64])) -> Result<(ContactGrid, String)> {
    let (rows, z) = averages(faces, x, y)?;
    let grid = |transfer| ContactGrid { x: x.to_vec(), y: y.to_vec(), z, transfer: Some(transfer) };
    let half = [x[x.len() - 1], y[y.len() - 1]];
    if contact.compliance != Compliance::Hybrid {
        let larger = |size: f64| format!(", or contact.grid.spacing = {size:.1e} (m) at least");
        let text = refuse_finer(faces, half, x[1] - x[0], larger)?;
        return Ok((grid(Transfer::Averages { rows, tilt: 0.0 }), text));
    }
    let (discs, text) = discs(faces, half)?;
    Ok((grid(Transfer::PatchAverage { patches: discs, tilt: 0.0 }), text))
}

/// An error where the nodes of a grid of the half sides `half`, m, are nearer to each other, by `spacing`, m, than
/// those of the `faces`; `remedy` says what else to do than to take a finer mesh. What is there, in words.
pub(crate) fn refuse_finer(
    faces: &Faces,
    half: [f64; 2],
    spacing: f64,
    remedy: impl Fn(f64) -> String,
) -> Result<String> {
    let size = faces.size(half);
    if spacing < (1.0 - SHORT) * size {
        return Err(Error::Job(format!(
            "contact.compliance: \"fe\" on a contact grid of {:.3} mm spacing, where the nodes of the faces at \
             the contact are {:.3} mm apart: the compliance \
             would be singular. Take \"hybrid\"{}, or a finer mesh",
            1e3 * spacing,
            1e3 * size,
            remedy(size)
        )));
    }
    Ok(format!("means about the nodes of the grid; nodes of its faces there {:.3} mm apart", 1e3 * size))
}

/// The means from which the contact of the half sides `half`, m, follows beside a half-space, and that in words.
pub(crate) fn discs(faces: &Faces, half: [f64; 2]) -> Result<(Vec<PatchAverage>, String)> {
    let least = CIRCLE * half[0].min(half[1]);
    let mut radius = least;
    // A larger disc may reach larger faces.
    for _ in 0..4 {
        radius = least.max(FACES * faces.size([radius; 2]));
    }
    let mut discs = vec![means(faces, PatchShape::Disc { radius })?];
    discs.extend(means(faces, PatchShape::Disc { radius: WIDER * radius }));
    let size = faces.size([radius; 2]);
    let room = if discs.len() == 1 { "; no room for a wider one that would show its error" } else { "" };
    let text = format!(
        "means over a disc of {:.2} mm, nodes of its faces there {:.3} mm apart{room}",
        1e3 * radius,
        1e3 * size
    );
    Ok((discs, text))
}

/// The means from which one of several contacts on a grid of `lines`, m, follows beside a half-space, over the
/// rectangle of the grid, and that in words. [`Hybrid::patches`](crate::body::hybrid::Hybrid::patches) says why.
pub(crate) fn rectangles(faces: &Faces, lines: [&[f64]; 2]) -> Result<(Vec<PatchAverage>, String)> {
    let ends = lines.map(|line| [line[0], line[line.len() - 1]]);
    let half = ends.map(|[first, last]| 0.5 * (last - first));
    let size = faces.size(half);
    let half = half.map(|side| side.max(FACES * size));
    let middle = 0.5 * (ends[1][0] + ends[1][1]);
    let of = |by: f64| means(faces, PatchShape::Rectangle { half: half.map(|side| side / by), middle });
    let text = format!(
        "means over a rectangle of {:.2} by {:.2} mm, nodes of its faces there {:.3} mm apart",
        2e3 * half[0],
        2e3 * half[1],
        1e3 * size
    );
    Ok((vec![of(1.0)?, of(WIDER)?], text))
}

/// Nodes of the common grid of a job of meshes; none where the meshes have their own. For one rank.
pub fn nodes(job: &Job, meshes: &Meshes) -> Result<Option<usize>> {
    let Some(contact) = job.contact.as_ref().filter(|c| c.placement.is_none()) else { return Ok(None) };
    let given = job.bodies();
    let [(lower_name, lower), (upper_name, upper)] = given[..] else { return Ok(None) };
    if !lower.is_meshed() || !upper.is_meshed() {
        return Ok(None);
    }
    let is_file = |b: &job::Body| matches!(b.mesh, Some(MeshSource::File(_)));
    let files = is_file(lower) || is_file(upper);
    if asked(contact).is_none() && !files {
        return Ok(None);
    }
    let mut faces = [None, None];
    if files {
        let both = [meshes.mesh(job, lower_name, lower)?, meshes.mesh(job, upper_name, upper)?];
        if asked(contact).is_none() && differ([&both[0], &both[1]]).is_none() {
            return Ok(None);
        }
        for (face, (m, name)) in faces.iter_mut().zip(both.iter().zip([lower_name, upper_name])) {
            let of = Faces::from_group(&m.mesh, "contact").map_err(|e| e.context(format!("bodies.{name}.mesh")))?;
            *face = Some(of);
        }
    }
    let lines = lines(job, contact, [faces[0].as_ref(), faces[1].as_ref()])?;
    Ok(Some(lines.x.len() * lines.y.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::example;

    /// The meeting of the cylinders of the job with these keys.
    fn met(sets: &[&str]) -> Result<SurfacePairing> {
        let job = example::two_cylinders(sets);
        let meshes = Meshes::default();
        let of = |name: &str, body: &Option<job::Body>| meshes.mesh(&job, name, body.as_ref().expect("a body"));
        let both = [of("lower", &job.bodies.lower)?, of("upper", &job.bodies.upper)?];
        meet(&job, [&both[0], &both[1]])
    }

    const COARSE: [&str; 4] = [
        "bodies.lower.mesh.cylinder.element_size=0.002",
        "bodies.upper.mesh.cylinder.element_size=0.002",
        "bodies.lower.mesh.cylinder.growth=2",
        "bodies.upper.mesh.cylinder.growth=2",
    ];

    /// Hertz' circle of the paper's cylinders has 4.9 mm: 2.4 elements of 2 mm, and its grid of ten spacings.
    #[test]
    fn grids_follow_from_hertz() {
        let own = met(&COARSE).expect("they match");
        assert!(matches!(own.grids[0].transfer, Some(Transfer::Nodes(_))));
        assert!(
            own.lines[0].contains("recommended: \"hybrid\"") && own.lines[0].contains("2.4 distances"),
            "{:?}",
            own.lines
        );
        let patch = ["contact.patch.half_length=0.014", "contact.patch.half_width=0.014", "contact.compliance=hybrid"];
        let hybrid = met(&[&COARSE[..], &patch].concat()).expect("they meet");
        let grid = &hybrid.grids[1];
        assert!(matches!(grid.transfer, Some(Transfer::PatchAverage { tilt: 0.0, .. })));
        assert_eq!((grid.x.len(), grid.y.len()), (35, 35));
        assert!((grid.x[34] / 17.0 - 4.9e-4).abs() < 0.1e-4, "{:?}", grid.x);
        // The gap is that of the radii, although elements of 2 mm are flat.
        let gap = -hybrid.grids[0].z[0] - grid.z[0];
        let [x, y] = [grid.x[0], grid.y[0]];
        let drop = 0.5 - (0.25 - y * y).sqrt();
        let one = 0.5 - ((0.5 - drop).powi(2) - x * x).sqrt();
        assert!((gap - 2.0 * one).abs() < 1e-12, "{gap} {one}");
        assert!(hybrid.warnings.is_empty(), "{:?}", hybrid.warnings);
        let curvatures = met(&[&COARSE[..], &patch, &["contact.grid.curvatures=[4,6]"]].concat()).expect("they meet");
        let found = -curvatures.grids[0].z[0] - curvatures.grids[1].z[0];
        let [x, y] = [curvatures.grids[0].x[0], curvatures.grids[0].y[0]];
        assert!((found - 2.0 * x * x - 3.0 * y * y).abs() < 1e-15, "{found}");
        for (key, value) in [("spacing", "1e-9"), ("half_width", "1000")] {
            let set = format!("contact.grid.{key}={value}");
            let error = met(&[&COARSE[..], &patch, &[&set]].concat()).expect_err("more nodes than can be").to_string();
            assert!(
                error.contains("spacings; expected at most 200") && error.contains("contact.grid.half_"),
                "{error}"
            );
        }
    }
}
