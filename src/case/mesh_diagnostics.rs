//! How the mesh of a body lies in its frame: what `railsqueal check` says of axis, contact point and what was read,
//! and what cannot be.

use super::meshes::Meshed;
use super::preflight::PreflightReport;
use crate::grid::{ContactGrid, Faces};
use crate::job::{self, Job, MeshSource};
use crate::mesh::attitude::Attitude;
use crate::{Error, Result};

/// The surface may pass the contact point at this part of the length of its grid: more than any facet is high.
const BESIDE: f64 = 0.05;
/// The axle may lie beside the axis that the mesh shows by this part of its distance.
const AXLE: f64 = 0.01;
const NAMES: [&str; 3] = ["x", "y", "z"];

/// Lines and warnings about the body `name`, whose mesh in lower form lies as `attitude` says; an error if its
/// surface does not pass the contact point.
pub(crate) fn diagnose(
    job: &Job,
    name: &str,
    body: &job::Body,
    meshed: &Meshed,
    attitude: &Attitude,
) -> Result<PreflightReport> {
    let mut report = PreflightReport { lines: Vec::new(), warnings: meshed.remarks.clone() };
    // On a placement another point than the origin is touched.
    if !matches!(body.mesh, Some(MeshSource::File(_))) || job.placement().is_some() {
        return Ok(report);
    }
    // Of an upper body the file has the mirror image.
    let side = if name == "upper" { "above" } else { "below" };
    let height = |z: f64| if name == "upper" { -z } else { z };
    let at = format!("bodies.{name}.mesh.file");
    let axis = match (attitude.revolved, attitude.axis_distance()) {
        (Some(axis), Some(distance)) => {
            format!("axis of revolution along {}, {distance:.4} m from the contact point", NAMES[axis])
        }
        _ => "no axis of revolution along x, y or z".to_string(),
    };
    let surface = match &meshed.grid {
        Some(grid) => {
            let z = match grid {
                Ok(grid) => on_grid(grid, &at, height)?,
                Err(_) => {
                    let faces = Faces::from_group(&meshed.mesh, "contact").map_err(|e| e.context(&at))?;
                    beside(faces.ends(), faces.height([0.0; 2]), &at, height)?
                }
            };
            format!(", surface {:.3} mm from the contact point", 1e3 * z.abs())
        }
        None => String::new(),
    };
    report.lines.push(format!("body {name}: {axis}{surface}"));
    if body.rotates() || body.axle_distance.is_some() {
        report.warnings.extend(axle(body, attitude).map(|text| format!("{at}: {text}")));
    }
    if job.contact.is_some() && attitude.centre[2] > 0.0 {
        let centre = height(attitude.centre[2]);
        return Err(Error::Input(format!(
            "{at}: the centre of mass is at z = {centre:.4} m, on the other side of the contact plane; expected \
             the {name} body {side} z = 0. Turn or move it \
             with mesh.file.transform, or name it as the other body"
        )));
    }
    Ok(report)
}

/// Height of the surface at the contact point, m, where it has a grid of its own.
fn on_grid(grid: &ContactGrid, at: &str, height: impl Fn(f64) -> f64) -> Result<f64> {
    // Bilinear in the rectangle around the origin.
    let around = |v: &[f64]| {
        let i = v.partition_point(|&a| a <= 0.0).clamp(1, v.len() - 1);
        (i - 1, -v[i - 1] / (v[i] - v[i - 1]))
    };
    let ((i, s), (j, t)) = (around(&grid.x), around(&grid.y));
    let z = |a: usize, b: usize| grid.z[i + a + grid.x.len() * (j + b)];
    let z = (1.0 - t) * ((1.0 - s) * z(0, 0) + s * z(1, 0)) + t * ((1.0 - s) * z(0, 1) + s * z(1, 1));
    let ends = |v: &[f64]| [v[0], v[v.len() - 1]];
    beside([ends(&grid.x), ends(&grid.y)], Some(z), at, height)
}

/// Height of the surface at the contact point, `surface`, m, where the group has the `ends` along x and y, m; an
/// error if the contact point is beside it or far from it.
fn beside(
    [[x0, x1], [y0, y1]]: [[f64; 2]; 2],
    surface: Option<f64>,
    at: &str,
    height: impl Fn(f64) -> f64,
) -> Result<f64> {
    let hint =
        "expected the contact point at the origin. Move the mesh with mesh.file.transform, or look at mesh.file.scale";
    if x0 > 0.0 || x1 < 0.0 || y0 > 0.0 || y1 < 0.0 {
        return Err(Error::Input(format!(
            "{at}: the contact point is not on the group \"contact\", which reaches from x = {x0:.4} to {x1:.4} \
             m and from y = {y0:.4} to {y1:.4} m; {hint}"
        )));
    }
    let Some(z) = surface else {
        return Err(Error::Input(format!("{at}: no face of the group \"contact\" is at the contact point; {hint}")));
    };
    if z.abs() > BESIDE * (x1 - x0).max(y1 - y0) {
        return Err(Error::Input(format!(
            "{at}: at the contact point the surface of the group \"contact\" is at z = {:.6} m; {hint}",
            height(z)
        )));
    }
    Ok(z)
}

/// Fault in the axle of a body that turns.
fn axle(body: &job::Body, attitude: &Attitude) -> Option<String> {
    let given = body.axle_distance?;
    let [x, _, z] = attitude.centre;
    match attitude.revolved {
        None => Some("the body turns, and is no body of revolution about an axis along y: is it in its place?".into()),
        Some(axis) if axis != 1 => Some(format!(
            "the axis of revolution is along {}, and the axle along y: turn the mesh with mesh.file.transform",
            NAMES[axis]
        )),
        Some(_) if x.abs() > AXLE * given || (z + given).abs() > AXLE * given => Some(format!(
            "the axis of revolution is at x = {x:.4} m, {:.4} m from the contact plane, and axle_distance is {given} m",
            z.abs()
        )),
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(height: f64, shift: f64) -> ContactGrid {
        let x = vec![-0.01 + shift, -0.004 + shift, 0.005 + shift, 0.01 + shift];
        let y = vec![-0.01, 0.0, 0.01];
        let z = y.iter().flat_map(|b| x.iter().map(move |a| height + 0.1 * a - 0.2 * b)).collect();
        ContactGrid::meshless(x, y, z)
    }

    /// A plane is interpolated exactly; a surface elsewhere is refused, with its place as it is in the file.
    #[test]
    fn the_surface_passes_the_contact_point() {
        let found = on_grid(&grid(1e-4, 0.0), "here", |z| z).expect("near by");
        assert!((found - 1e-4).abs() < 1e-15, "{found}");
        let below = on_grid(&grid(-0.46, 0.0), "here", |z| -z).expect_err("the axle is at the origin").to_string();
        assert!(
            below.starts_with("here: ") && below.contains("z = 0.460000 m") && below.contains("transform"),
            "{below}"
        );
        let aside = on_grid(&grid(0.0, 0.1), "here", |z| z).expect_err("beside it").to_string();
        assert!(aside.contains("from x = 0.0900 to 0.1100 m"), "{aside}");
    }

    #[test]
    fn an_axle_that_the_mesh_does_not_show_is_told() {
        let attitude = |revolved, centre| Attitude { low: [0.0; 3], high: [1.0; 3], volume: 1.0, centre, revolved };
        let text = r#"{"mesh": {"file": "wheel.msh"}, "axle_distance": 0.46}"#;
        let body: job::Body = serde_json::from_str(text).expect("a body");
        let of = |revolved, centre| axle(&body, &attitude(revolved, centre));
        assert_eq!(of(Some(1), [0.0, 0.03, -0.46]), None);
        assert!(of(Some(1), [0.0, 0.0, 0.0]).is_some_and(|t| t.contains("axle_distance is 0.46")));
        assert!(of(Some(2), [0.0, 0.0, -0.46]).is_some_and(|t| t.contains("along z")));
        assert!(of(None, [0.0, 0.0, -0.46]).is_some_and(|t| t.contains("no body of revolution")));
    }
}
