//! The surfaces of the meshes of a job with what it does to them, to be looked at before anything is computed.

use super::meshes::Meshes;
use super::positioned_mesh::{upright, AlongPath};
use super::surfaces::surface_points;
use super::wheel_rail_geometry::PlacedContact;
use crate::body::Side;
use crate::job::{self, Job, MeshSource};
use crate::mesh::{Facet, Mesh};
use crate::output::surface::{ContactNode, Group, SurfaceFacet, Surfaces};
use crate::{Error, Result};
use std::collections::HashMap;

/// On rank 0: the surfaces of all bodies of `job` that have a mesh of three dimensions.
pub fn surfaces(job: &Job, meshes: &Meshes) -> Result<Surfaces> {
    let mut all = Surfaces::default();
    // What cannot be placed is shown as it lies.
    let placed = job.placement().and_then(|_| PlacedContact::from_job(job).ok());
    let grid = match &placed {
        Some(placed) => Some(placed.grid_lines().map(<[f64]>::to_vec)),
        None => common(job, meshes),
    };
    for (name, body) in job.bodies() {
        if !matches!(body.mesh, Some(MeshSource::Cylinder(_) | MeshSource::File(_))) {
            continue;
        }
        let side = Side::named(name)?;
        let mut mesh = meshes.as_it_lies(job, name, body)?;
        let mut tilt = job.placement().is_none().then_some(0.0);
        let seat = placed.as_ref().and_then(|p| p.seat(name).ok()).zip(job.placement());
        let first = AlongPath::Line { distance: 0.0 };
        if let Some((seat, found)) = seat.and_then(|(s, p)| Some((s, upright(&mesh, s, p.side, first).ok()?))) {
            (mesh, tilt) = (found.0, Some(seat.tilt));
        }
        add(&mut all, &mesh, side, body);
        let number = number(side);
        let node = |([x, y, z], on_face): ([f64; 3], bool)| {
            let place = [x, y, side.reflection(2) * z];
            ContactNode { body: number, place, on_face }
        };
        // A mesh that lies wrong is shown too, and has no grid.
        match (&grid, tilt) {
            (Some([x, y]), Some(tilt)) => {
                if let Ok(nodes) = surface_points(&mesh, [x, y], tilt) {
                    all.common = [x.len(), y.len()];
                    all.contact.extend(nodes.into_iter().map(node));
                }
            }
            (None, Some(_)) => {
                let own = meshes.mesh(job, name, body).ok().and_then(|meshed| meshed.grid.clone());
                if let Some(Ok(grid)) = own {
                    let nx = grid.x.len().max(1);
                    let places = grid.z.iter().enumerate().map(|(k, &z)| ([grid.x[k % nx], grid.y[k / nx], z], true));
                    all.contact.extend(places.map(node));
                }
            }
            (_, None) => {}
        }
    }
    match all.faces.is_empty() {
        true => Err(Error::Job(
            "--mesh: no body of the job has a mesh of three dimensions (mesh.cylinder or mesh.file): sections \
             and profiles are drawn from the results of a run"
                .into(),
        )),
        false => Ok(all),
    }
}

/// The lines of the common grid of two meshes, m, where they meet on one and it can be made.
fn common(job: &Job, meshes: &Meshes) -> Option<[Vec<f64>; 2]> {
    let given = job.bodies();
    let [(lower_name, lower), (upper_name, upper)] = given[..] else { return None };
    if !lower.is_meshed() || !upper.is_meshed() {
        return None;
    }
    let both = [meshes.mesh(job, lower_name, lower).ok()?, meshes.mesh(job, upper_name, upper).ok()?];
    super::surfaces::common(job, [&both[0], &both[1]]).ok()?
}

/// The body on a side as the file numbers it.
fn number(side: Side) -> i8 {
    side.index() as i8 + 1
}

/// Use by the job of the group `name` of a body.
fn role(body: &job::Body, name: &str) -> &'static str {
    match name {
        "contact" => "contact",
        _ if body.fixed.iter().any(|g| g == name) => "fixed",
        _ if body.supports.iter().any(|s| s.group == name) => "support",
        _ => "",
    }
}

/// Adds the boundary of a mesh in lower form.
fn add(all: &mut Surfaces, mesh: &Mesh, side: Side, body: &job::Body) {
    let first = all.groups.len();
    let mut group_of: HashMap<Facet, i32> = HashMap::new();
    // A facet in several groups shows the one that matters.
    let rank = |role: &str| ["contact", "fixed", "support", ""].iter().position(|r| *r == role);
    let mut names: Vec<&String> = mesh.groups.keys().collect();
    names.sort_by_key(|name| rank(role(body, name)));
    for (k, name) in names.into_iter().enumerate() {
        all.groups.push(Group { name: format!("{} {name}", side.name()), role: role(body, name) });
        mesh.groups[name].iter().for_each(|&f| {
            group_of.entry(f).or_insert((first + k) as i32);
        });
    }
    let mut point_of: HashMap<u32, u32> = HashMap::new();
    for facet in mesh.cells.boundary() {
        let cell = mesh.cells.get(facet.cell as usize);
        let mut corners: Vec<u32> = cell
            .facet_corners(facet.face as usize)
            .map(|node| {
                *point_of.entry(node).or_insert_with(|| {
                    let [x, y, z] = mesh.nodes[node as usize];
                    all.points.push([x, y, side.reflection(2) * z]);
                    all.points.len() as u32 - 1
                })
            })
            .collect();
        if side == Side::Upper {
            // Reflection turns a facet round.
            corners.reverse();
        }
        all.faces.push(SurfaceFacet {
            corners,
            body: number(side),
            group: group_of.get(&facet).copied().unwrap_or(-1),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Job;
    use std::path::Path;

    /// The two blocks: every face of both, outward, in its group; contact nodes on the surfaces.
    #[test]
    fn surfaces_of_two_blocks_are_closed_and_point_outward() {
        let job = concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/blocks.json");
        let bytes = std::fs::read(job).expect("a job");
        let job = Job::from_bytes(&bytes, Path::new(job), &[], None).expect("a job");
        let found = surfaces(&job, &Meshes::default()).expect("two meshes");
        for body in [1, 2] {
            let mut area = [0.0; 3];
            let mut volume = 0.0;
            for face in found.faces.iter().filter(|f| f.body == body) {
                let p: Vec<[f64; 3]> = face.corners.iter().map(|&c| found.points[c as usize]).collect();
                for k in 1..p.len() - 1 {
                    let [a, b] = [k, k + 1].map(|k| [0, 1, 2].map(|c| p[k][c] - p[0][c]));
                    let n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
                    (0..3).for_each(|c| area[c] += 0.5 * n[c]);
                    volume += (0..3).map(|c| n[c] * p[0][c]).sum::<f64>() / 6.0;
                }
            }
            assert!(area.iter().all(|a| a.abs() < 1e-12), "closed: {area:?}");
            // 40 x 32 x 20 mm.
            assert!((volume / 2.56e-5 - 1.0).abs() < 0.1, "outward: {volume}");
        }
        let role = |name: &str| found.groups.iter().find(|g| g.name == name).map(|g| g.role);
        assert_eq!(
            (role("lower contact"), role("upper base"), role("lower sides")),
            (Some("contact"), Some("fixed"), Some(""))
        );
        // The contact is a grid of rectangles: 7 by 7 nodes on either body.
        let touching = |f: &&SurfaceFacet| f.group >= 0 && found.groups[f.group as usize].role == "contact";
        assert_eq!((found.faces.iter().filter(touching).count(), found.contact.len()), (2 * 36, 2 * 49));
        let places: Vec<_> = found.points.iter().map(|p| p.map(|v| (v * 1e9).round() as i64)).collect();
        assert!(!found.contact.is_empty());
        assert_eq!(found.common, [0, 0]);
        for ContactNode { place: p, on_face, .. } in &found.contact {
            assert!(*on_face);
            assert!(places.contains(&p.map(|v| (v * 1e9).round() as i64)), "a contact node off the mesh: {p:?}");
        }
    }

    /// Cylinders of unlike elements: the nodes of the common grid on both surfaces, which are round towards each
    /// other, and those beyond a patch of 12 mm.
    #[test]
    fn a_common_grid_lies_on_both_surfaces_and_is_told_where_it_leaves_them() {
        let shown = |half: &str| {
            let grid = format!("contact.grid={{\"half_length\":{half},\"half_width\":0.008,\"spacing\":0.004}}");
            let sets = [
                "bodies.lower.mesh.cylinder.element_size=0.004",
                "bodies.upper.mesh.cylinder.element_size=0.003",
                "contact.patch={\"half_length\":0.012,\"half_width\":0.012}",
                &grid,
            ];
            let job = crate::job::example::two_cylinders(&sets);
            surfaces(&job, &Meshes::default()).expect("two meshes")
        };
        let inside = shown("0.008");
        assert_eq!((inside.common, inside.contact.len()), ([5, 5], 50));
        for (k, node) in inside.contact.iter().enumerate() {
            let (side, at) = (k / 25, k % 25);
            let [x, y, z] = node.place;
            assert!(node.on_face && usize::from(node.body.unsigned_abs()) == side + 1);
            assert!(
                (x - 0.004 * (at % 5) as f64 + 0.008).abs() < 1e-15
                    && (y - 0.004 * (at / 5) as f64 + 0.008).abs() < 1e-15
            );
            // Below the plane or above it by x²/2R and y²/2R of the crown, to the sag of flat faces of 4 mm.
            let drop = 0.5 * (x * x + y * y) / 0.5;
            let depth = if side == 0 { -z } else { z };
            assert!((depth - drop).abs() < 1e-5, "{node:?}: {depth:e} {drop:e}");
        }
        let beyond = shown("0.016");
        let off: Vec<&ContactNode> = beyond.contact.iter().filter(|n| !n.on_face).collect();
        assert_eq!((beyond.common, off.len()), ([9, 5], 2 * 2 * 5));
        assert!(off.iter().all(|n| n.place[0].abs() > 0.012 && n.place[2] == 0.0), "{off:?}");
    }

    #[test]
    fn a_job_without_meshes_is_told() {
        let job = concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/wheel-at-given-yaw.json");
        let bytes = std::fs::read(job).expect("a job");
        let job = Job::from_bytes(&bytes, Path::new(job), &[], None).expect("a job");
        let error = surfaces(&job, &Meshes::default()).expect_err("sections only");
        assert!(error.exit_code() == 2 && error.message().contains("no body"), "{error}");
    }
}
