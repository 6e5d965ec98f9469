//! The surfaces of the meshes of a job with what it does to them, to be looked at before anything is computed.

use super::meshes::Meshes;
use crate::body::Side;
use crate::job::{self, Job, MeshSource};
use crate::mesh::{Facet, Mesh};
use crate::output::surface::{Face, Group, Surfaces};
use crate::{Error, Result};
use std::collections::HashMap;

/// On rank 0: the surfaces of all bodies of `job` that have a mesh of three dimensions.
pub fn surfaces(job: &Job, meshes: &Meshes) -> Result<Surfaces> {
    let mut all = Surfaces::default();
    for (name, body) in job.bodies() {
        if !matches!(body.mesh, Some(MeshSource::Cylinder(_) | MeshSource::File(_))) {
            continue;
        }
        let side = Side::named(name).unwrap_or(Side::Lower);
        add(&mut all, &meshes.as_it_lies(job, name, body)?, side, body);
        // A mesh that lies wrong is shown too, and has no grid.
        let grid = meshes.of(job, name, body).ok().and_then(|meshed| meshed.grid.clone());
        if let Some(Ok(grid)) = &grid {
            let nx = grid.x.len().max(1);
            let place = |(k, &z): (usize, &f64)| [grid.x[k % nx], grid.y[k / nx], side.reflection(2) * z];
            all.contact.extend(grid.z.iter().enumerate().map(place).map(|p| (number(side), p)));
        }
    }
    match all.faces.is_empty() {
        true => Err(Error::Job(
            "--mesh: no body of the job has a mesh of three dimensions (mesh.cylinder or mesh.file): sections and profiles are drawn from the results of a run"
                .into(),
        )),
        false => Ok(all),
    }
}

/// The body on a side as the file numbers it.
fn number(side: Side) -> i8 {
    side.index() as i8 + 1
}

/// What the job does with the group `name` of a body.
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
        all.faces.push(Face { corners, body: number(side), group: group_of.get(&facet).copied().unwrap_or(-1) });
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
        let touching = |f: &&Face| f.group >= 0 && found.groups[f.group as usize].role == "contact";
        assert_eq!((found.faces.iter().filter(touching).count(), found.contact.len()), (2 * 36, 2 * 49));
        let places: Vec<_> = found.points.iter().map(|p| p.map(|v| (v * 1e9).round() as i64)).collect();
        assert!(!found.contact.is_empty());
        for (_, p) in &found.contact {
            assert!(places.contains(&p.map(|v| (v * 1e9).round() as i64)), "a contact node off the mesh: {p:?}");
        }
    }

    #[test]
    fn a_job_without_meshes_is_told() {
        let job = concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/wheel-on-rail.json");
        let bytes = std::fs::read(job).expect("a job");
        let job = Job::from_bytes(&bytes, Path::new(job), &[], None).expect("a job");
        let error = surfaces(&job, &Meshes::default()).expect_err("sections only");
        assert!(error.exit_code() == 2 && error.message().contains("no body"), "{error}");
    }
}
