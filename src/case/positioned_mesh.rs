//! Bodies of mesh files on a placement: brought from the frame of their profile to the contact.

use super::surfaces;
use crate::grid::{averages, Faces, Transfer};
use crate::job::{Body, Compliance, TrackSide};
use crate::mesh::attitude::Attitude;
use crate::mesh::Mesh;
use crate::placement::Seat;
use crate::{Error, Result};

/// The axle may lie beside where the placement has it by this part of the radius.
const AXLE: f64 = 0.01;

/// A mesh in lower form with the contact point at the origin. It stands upright: y is along its axle, or across its
/// track, and not in the plane of the contact.
#[derive(Debug)]
pub(crate) struct PositionedMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// How its surface moves at the contact, in the frame of the contact.
    pub transfer: Transfer,
    /// Distance of the axle of a wheel from the contact point, m.
    pub axle: f64,
    /// The same in words.
    pub text: String,
}

/// The vector `x` of an upright body, seen in the frame of the contact, which is turned against it by `tilt`, rad,
/// about x.
pub(crate) fn in_contact_frame([x, y, z]: [f64; 3], tilt: f64) -> [f64; 3] {
    let (s, c) = tilt.sin_cos();
    [x, c * y + s * z, c * z - s * y]
}

/// An upright mesh as it is seen in the frame of the contact.
pub(crate) fn tilted(mesh: &Mesh, tilt: f64) -> Mesh {
    let mut mesh = mesh.clone();
    mesh.nodes.iter_mut().for_each(|p| *p = in_contact_frame(*p, tilt));
    mesh
}

/// Place of a contact along the path of a body, from that of its first contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum AlongPath {
    /// At an angle about the axle, rad, of a wheel with this radius of the running circle, m.
    Axle { angle: f64, radius: f64 },
    /// At a distance along a rail, m.
    Line { distance: f64 },
}

impl AlongPath {
    /// A point of the body, the running circle or the middle of the head at the origin, where the body is moved along
    /// its path so that the touched place is at x = 0, m.
    fn brought(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match *self {
            Self::Axle { angle, radius } => {
                let ((s, c), up) = (angle.sin_cos(), z + radius);
                [c * x - s * up, y, s * x + c * up - radius]
            }
            Self::Line { distance } => [x - distance, y, z],
        }
    }

    /// Angle of the normal of the contact about the axle, rad.
    pub(crate) fn angle(&self) -> f64 {
        match *self {
            Self::Axle { angle, .. } => angle,
            Self::Line { .. } => 0.0,
        }
    }
}

/// A `mesh` in lower form that has the origin of its profile at the origin, moved so that the place where it is
/// touched, at a seat on a side of the track and `along` its path, is there; and the height of that place in the frame
/// of the profile, m. Meshes are as on the left side; on the right they are turned about z.
///
/// # Errors
/// No surface at the contact point.
pub(crate) fn upright(mesh: &Mesh, seat: Seat, side: TrackSide, along: AlongPath) -> Result<(Mesh, f64)> {
    let turn = if side == TrackSide::Right { -1.0 } else { 1.0 };
    let mut mesh = mesh.clone();
    mesh.nodes.iter_mut().for_each(|p| *p = along.brought([turn * p[0], turn * p[1] - seat.y, p[2]]));
    let faces = Faces::from_group(&mesh, "contact")?;
    let height = faces.height([0.0; 2]).ok_or_else(|| {
        let [[x0, x1], [y0, y1]] = faces.ends();
        Error::Input(format!(
            "group \"contact\": no face at the contact point, which is at y = {:.5} m of the profile; the group \
             reaches from x = {x0:.4} to {x1:.4} m and from \
             y = {:.4} to {:.4} m. Expected the origin of the profile at the origin of the mesh, and a group \
             that holds the contact",
            turn * seat.y,
            (turn * (y0 + seat.y)).min(turn * (y1 + seat.y)),
            (turn * (y0 + seat.y)).max(turn * (y1 + seat.y))
        ))
    })?;
    mesh.nodes.iter_mut().for_each(|p| p[2] -= height);
    Ok((mesh, height))
}

/// A body whose `mesh`, in lower form, has the origin of its profile at the origin, touched at a seat on a side of the
/// track and along its path by a contact on the grid of the `lines`, m. `radius` is that of the running circle of a
/// wheel, m. With the compliance "fe" the surface moves as the means about the nodes of the grid. Otherwise it moves as
/// those over discs, or over the rectangle of the grid of one of `several` contacts.
///
/// # Errors
/// See [`upright`], [`surfaces::discs`] and [`averages`]; a grid finer than the mesh.
pub(crate) fn standing(
    mesh: &Mesh,
    (seat, side, along): (Seat, TrackSide, AlongPath),
    lines: [&[f64]; 2],
    (compliance, several): (Compliance, bool),
    radius: f64,
) -> Result<PositionedMesh> {
    let (mesh, height) = upright(mesh, seat, side, along)?;
    let faces = Faces::from_group(&tilted(&mesh, seat.tilt), "contact")?;
    let half = lines.map(|line| 0.5 * (line[line.len() - 1] - line[0]));
    let (transfer, text) = if compliance == Compliance::Fe {
        let apart = lines.map(|line| line.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min));
        // The grid follows from the profiles.
        let text = surfaces::refuse_finer(&faces, half, apart[0].min(apart[1]), |_| String::new())?;
        let (rows, _) = averages(&faces, lines[0], lines[1])?;
        (Transfer::Averages { rows, tilt: seat.tilt }, text)
    } else {
        let (patches, text) = match several {
            true => surfaces::rectangles(&faces, lines)?,
            false => surfaces::discs(&faces, half)?,
        };
        (Transfer::PatchAverage { patches, tilt: seat.tilt }, text)
    };
    Ok(PositionedMesh { mesh, transfer, axle: radius + height, text })
}

/// Fault in the axle of a wheel that turns, whose mesh stands.
pub(crate) fn axle(body: &Body, standing: &PositionedMesh) -> Option<String> {
    let attitude = Attitude::from_mesh(&standing.mesh);
    let ([x, _, z], wanted) = (attitude.centre, standing.axle);
    match attitude.revolved {
        _ if !body.rotates() => None,
        Some(1) if x.abs() < AXLE * wanted && (z + wanted).abs() < AXLE * wanted => None,
        Some(1) => Some(format!(
            "the axis of revolution is at x = {x:.4} m, {:.4} m from the contact point, and by \
             contact.placement.radius it is at x = 0, {wanted:.4} m from there",
            z.abs()
        )),
        _ => Some("the body turns, and is no body of revolution about an axis along y: is it in its place?".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::example;
    use crate::mesh::cylinder::{build, CylinderSpec, DEFAULT_GROWTH};
    use crate::placement::builtin;

    const FIRST: AlongPath = AlongPath::Line { distance: 0.0 };

    /// A place of a wheel at an angle about its axle, or of a rail farther along, is brought to the origin; its normal
    /// becomes upright.
    #[test]
    fn places_along_the_path_are_brought_to_the_contact() {
        let axle = AlongPath::Axle { angle: 0.3, radius: 0.5 };
        let (s, c) = 0.3f64.sin_cos();
        let near = |found: [f64; 3], wanted: [f64; 3]| {
            assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-15), "{found:?} {wanted:?}");
        };
        near(axle.brought([0.5 * s, 0.02, 0.5 * c - 0.5]), [0.0, 0.02, 0.0]);
        near(axle.brought([0.6 * s, 0.0, 0.6 * c - 0.5]), [0.0, 0.0, 0.1]);
        near(AlongPath::Line { distance: 0.7 }.brought([0.7, 0.01, 0.002]), [0.0, 0.01, 0.002]);
        assert_eq!((axle.angle(), AlongPath::Line { distance: 0.7 }.angle()), (0.3, 0.0));
    }

    /// A ring whose surface is the head of a 60E1 along y, its crown at the origin: round along x, so that it can
    /// stand for a rail.
    fn head() -> Mesh {
        let spec = CylinderSpec {
            inner_radius: 0.1,
            outer_radius: 0.5,
            thickness: 0.06,
            crown_radius: None,
            contact_offset: 0.0,
            element_size: 2e-3,
            growth: DEFAULT_GROWTH,
            max_element_size: None,
            patch_half_length: 0.03,
            patch_half_width: 0.03,
        };
        let (mut mesh, profile) = (build(&spec).expect("a ring"), builtin::rail_60e1().expect("a profile"));
        // Profiles have their z down.
        mesh.nodes.iter_mut().for_each(|[_, y, z]| *z -= profile.local(*y).z * (1.0 + 2.0 * *z).clamp(0.0, 1.0));
        mesh
    }

    /// The lines of a grid, m.
    const LINE: [f64; 9] = [-8e-3, -6e-3, -4e-3, -2e-3, 0.0, 2e-3, 4e-3, 6e-3, 8e-3];

    /// Means about the nodes of a grid that is tilted with the surface: they add up to one each, and are about the
    /// places of the nodes in the plane of the contact. A grid that is finer than the mesh is refused.
    #[test]
    fn a_surface_moves_as_its_means_about_the_nodes_of_a_tilted_grid() {
        let (mesh, profile) = (head(), builtin::rail_60e1().expect("a profile"));
        let seat = Seat { y: 0.008, z: -profile.local(0.008).z, tilt: -profile.local(0.008).slope.atan() };
        let at = (seat, TrackSide::Right);
        // Coarser than the faces, which slope.
        let line = LINE.map(|v| 1.25 * v);
        let found = standing(&mesh, (at.0, at.1, FIRST), [&line; 2], (Compliance::Fe, false), 0.5).expect("it stands");
        let Transfer::Averages { rows, tilt } = &found.transfer else { panic!("{}", found.text) };
        assert!(rows.len() == 81 && *tilt == seat.tilt && tilt.abs() > 0.02, "{tilt}");
        for (k, row) in rows.iter().enumerate() {
            let mean = |c: usize| -> f64 {
                row.iter().map(|&(n, w)| w * in_contact_frame(found.mesh.nodes[n as usize], seat.tilt)[c]).sum()
            };
            assert!((row.iter().map(|t| t.1).sum::<f64>() - 1.0).abs() < 1e-12);
            let (i, j) = (k % 9, k / 9);
            if (1..8).contains(&i) && (1..8).contains(&j) {
                assert!(
                    (mean(0) - line[i]).abs() < 1e-9 && (mean(1) - line[j]).abs() < 1e-9,
                    "{k}: {} {}",
                    mean(0),
                    mean(1)
                );
            }
        }
        let fine: Vec<f64> = (-8..=8).map(|i| f64::from(i) * 1e-3).collect();
        let error = standing(&mesh, (at.0, at.1, FIRST), [&fine; 2], (Compliance::Fe, false), 0.5)
            .expect_err("finer than the mesh")
            .to_string();
        assert!(error.contains("1.000 mm spacing") && error.contains("Take \"hybrid\", or a finer mesh"), "{error}");
    }

    /// Rail meshes in a placement touch the plane of the contact: on both sides of the track, which are mirror images.
    #[test]
    fn a_rail_touches_the_plane_of_the_contact() {
        let (mesh, profile) = (head(), builtin::rail_60e1().expect("a profile"));
        for (y, side) in [(0.008, TrackSide::Right), (-0.008, TrackSide::Left), (-0.004, TrackSide::Right)] {
            // As [`placement::Placed::seats`] has it: the tilt is that of the profile there.
            let seat = Seat { y, z: -profile.local(y).z, tilt: -profile.local(y).slope.atan() };
            let found =
                standing(&mesh, (seat, side, FIRST), [&LINE; 2], (Compliance::Hybrid, false), 0.5).expect("it stands");
            let faces = Faces::from_group(&tilted(&found.mesh, seat.tilt), "contact").expect("faces");
            let height = |y: f64| faces.height([0.0, y]).expect("a face");
            assert!(height(0.0).abs() < 1e-12, "{}", height(0.0));
            // No slope, to what chords of 2 mm on a radius of 80 mm leave.
            let slope = (height(4e-3) - height(-4e-3)) / 8e-3;
            assert!(slope.abs() < 2e-3, "{y}: {slope}, tilt {}", seat.tilt);
            let z = profile.local(y).z;
            assert!((found.axle - (0.5 - z)).abs() < 2e-5, "{} {z}", found.axle);
            assert!(
                matches!(found.transfer, Transfer::PatchAverage { ref patches, .. } if patches.len() == 2),
                "{}",
                found.text
            );
        }
        let beside = Seat { y: 0.05, z: 0.0, tilt: 0.0 };
        let at = (beside, TrackSide::Left);
        let error = standing(&mesh, (at.0, at.1, FIRST), [&LINE; 2], (Compliance::Hybrid, false), 0.5)
            .expect_err("no head there")
            .to_string();
        assert!(error.contains("y = 0.05000 m of the profile") && error.contains("y = -0.0300 to 0.0300 m"), "{error}");
    }

    #[test]
    fn an_axle_elsewhere_is_told() {
        let mesh = head();
        let body = |radius: f64| {
            let at = (Seat { y: 0.0, z: 0.0, tilt: 0.0 }, TrackSide::Left);
            let found = standing(&mesh, (at.0, at.1, FIRST), [&LINE; 2], (Compliance::Hybrid, false), radius)
                .expect("it stands");
            let mut body = example::two_cylinders(&[]).bodies.upper.expect("a body");
            body.rotation = Some(crate::job::Rotation::Speed(20.0));
            axle(&body, &found)
        };
        assert_eq!(body(0.5), None);
        assert!(body(0.46).is_some_and(|t| t.contains("0.4600 m from there")), "{:?}", body(0.46));
    }
}
