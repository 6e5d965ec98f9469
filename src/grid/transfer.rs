//! How the surface of a body meets the nodes of a contact grid that its mesh does not have.

use super::clip::{clipped, Rule};
use super::faces::Faces;
use crate::quadrature::legendre;
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Nodes of a mesh and the weights of their displacements, by ascending nodes.
pub type Weights = Vec<(u32, f64)>;

/// Fraction of the area of a node that may miss a face, or have two.
const COVERED: f64 = 1e-6;
/// Points of the disc along its radius and around it.
const RADII: usize = 32;
const ANGLES: usize = 96;
/// Parts of either side of a rectangle, of four points each.
const PANELS: usize = 12;

/// How displacements of a mesh become those of the nodes of a contact grid. Forces go back by the transpose.
#[derive(Debug, Clone, PartialEq)]
pub enum Transfer {
    /// Each grid node is a node of the mesh, `[n]`.
    Nodes(Vec<u32>),
    /// Each grid node moves as the mean of the surface about it, u_i = (1/A_i) Σ_a ∫N_i N_a ds u_a, with N_i bilinear
    /// on the grid and N_a the shape functions of the faces, seen in plan.
    Averages {
        /// Weights of each node of the grid, `[n]`.
        rows: Vec<Weights>,
        /// As that of the means over a disc.
        tilt: f64,
    },
    /// The surface moves by π = (1, x, y) times three means of it over a patch, the first one; a second one, a wider
    /// disc or a smaller rectangle, shows how little it depends on that.
    PatchAverage {
        /// The patches.
        patches: Vec<PatchAverage>,
        /// Angle from the axes y, z of the mesh to those of the grid about −x, rad: y of the mesh is (0, cos, −sin)
        /// there.
        tilt: f64,
    },
}

impl Transfer {
    /// Angle from the axes y, z of the mesh to those of the grid about −x, rad.
    pub fn tilt(&self) -> f64 {
        match self {
            Self::Nodes(_) => 0.0,
            Self::Averages { tilt, .. } | Self::PatchAverage { tilt, .. } => *tilt,
        }
    }
}

/// Patch of a surface over which means are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PatchShape {
    /// A disc of the radius b about the origin, m, with Hertz' weight ω = 3/(2πb²)√(1 − r²/b²).
    Disc {
        /// Its radius, m.
        radius: f64,
    },
    /// A rectangle with the even weight ω = 1/(4ab).
    Rectangle {
        /// Half its sides a along x and b along y, m.
        half: [f64; 2],
        /// y of its middle, m.
        middle: f64,
    },
}

/// Means of a surface over a patch.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchAverage {
    /// The patch.
    pub shape: PatchShape,
    /// ∫ω π_m N_a ds for π = (1, x, y) about its middle, 1 and m.
    pub weights: [Weights; 3],
}

fn sorted(weights: BTreeMap<u32, f64>) -> Weights {
    weights.into_iter().collect()
}

/// The means of `faces` over the nodes of the grid of lines `x` and `y`, m, and the heights of the surface there, m,
/// `[nx*ny]` each. Force and moment of nodal forces within the grid are those of the forces on the faces, and a
/// uniform pressure is one.
///
/// # Errors
/// Places where there is no face behind the grid, or two; faces that look down or are steep.
pub(crate) fn averages(faces: &Faces, x: &[f64], y: &[f64]) -> Result<(Vec<Weights>, Vec<f64>)> {
    let (nx, ny) = (x.len(), y.len());
    if nx < 2 || ny < 2 {
        return Err(Error::Defect(format!("a contact grid of {nx} by {ny} nodes")));
    }
    let half = [x, y].map(|v| v[0].abs().max(v[v.len() - 1].abs()));
    let rule = Rule::new();
    let mut rows = vec![BTreeMap::<u32, f64>::new(); nx * ny];
    let mut area = vec![0.0; nx * ny];
    let pieces = faces.pieces_within(half)?;
    for piece in &pieces {
        let span = |c: usize, line: &[f64]| {
            let at = || piece.plan.iter().map(|p| p[c]);
            let (low, high) = (at().fold(f64::INFINITY, f64::min), at().fold(f64::NEG_INFINITY, f64::max));
            line.partition_point(|v| *v <= low).saturating_sub(1)
                ..line.partition_point(|v| *v < high).min(line.len() - 1)
        };
        for j in span(1, y) {
            for i in span(0, x) {
                let polygon = clipped(piece.plan, [x[i], y[j]], [x[i + 1], y[j + 1]]);
                for (p, weight) in rule.points(&polygon) {
                    let at = faces.shape_functions(piece, p);
                    let (s, t) = ((p[0] - x[i]) / (x[i + 1] - x[i]), (p[1] - y[j]) / (y[j + 1] - y[j]));
                    for (a, b, n) in
                        [(0, 0, (1.0 - s) * (1.0 - t)), (1, 0, s * (1.0 - t)), (0, 1, (1.0 - s) * t), (1, 1, s * t)]
                    {
                        let (k, w) = (i + a + nx * (j + b), n * weight);
                        area[k] += w;
                        for (&node, value) in at.nodes.iter().zip(at.values) {
                            *rows[k].entry(node).or_default() += w * value;
                        }
                    }
                }
            }
        }
    }
    for k in 0..nx * ny {
        let side = |line: &[f64], i: usize| 0.5 * (line[(i + 1).min(line.len() - 1)] - line[i.saturating_sub(1)]);
        let (i, j) = (k % nx, k / nx);
        let found = area[k] / (side(x, i) * side(y, j));
        if (found - 1.0).abs() > COVERED {
            return Err(uncovered(faces, [x[i], y[j]], found));
        }
        rows[k].values_mut().for_each(|v| *v /= area[k]);
    }
    let height = |k: usize| {
        let place = [x[k % nx], y[k / nx]];
        let piece = faces.over(&pieces, place).ok_or_else(|| uncovered(faces, place, 0.0))?;
        Ok(faces.shape_functions(piece, place).z)
    };
    // At the node: a mean would lie below a round surface.
    let z = (0..nx * ny).map(height).collect::<Result<_>>()?;
    Ok((rows.into_iter().map(sorted).collect(), z))
}

/// Error of a node at `p` of whose area faces make up `found`.
fn uncovered(faces: &Faces, p: [f64; 2], found: f64) -> Error {
    let [[x0, x1], [y0, y1]] = faces.ends();
    let surface = match faces.height(p) {
        Some(z) if found < 1.0 => format!("; the surface over it is at z = {z:.6} m"),
        _ => String::new(),
    };
    let what = if found < 1.0 { "no face of the surface is behind a part of" } else { "faces lie above each other at" };
    Error::Input(format!(
        "group \"contact\": {what} the node x = {:.6}, y = {:.6} m of the contact grid (faces make up {:.4} of \
         its area){surface}; the group reaches from \
         x = {x0:.4} to {x1:.4} m and from y = {y0:.4} to {y1:.4} m. Expected one surface near z = 0 behind the \
         whole grid: make the group larger (contact.patch \
         of a cylinder), or the grid smaller (contact.grid)",
        p[0], p[1], found
    ))
}

/// The means of `faces` over a patch.
///
/// # Errors
/// A place of the patch where there is no face; faces that look down or are steep.
pub fn means(faces: &Faces, shape: PatchShape) -> Result<PatchAverage> {
    let (reach, middle, points): (_, _, Vec<_>) = match shape {
        PatchShape::Disc { radius } => ([radius; 2], 0.0, disc(radius).collect()),
        PatchShape::Rectangle { half: [a, b], middle } => {
            ([a, b + middle.abs()], middle, rectangle([a, b]).map(|([x, y], w)| ([x, y + middle], w)).collect())
        }
    };
    let pieces = faces.pieces_within(reach)?;
    let mut weights = [const { BTreeMap::<u32, f64>::new() }; 3];
    for (place, weight) in points {
        let Some(piece) = faces.over(&pieces, place) else {
            let [[x0, x1], [y0, y1]] = faces.ends();
            let wanted = match shape {
                PatchShape::Disc { radius } => format!("a disc of the radius {radius:.5} m"),
                PatchShape::Rectangle { half: [a, b], .. } => {
                    format!("a rectangle of {:.5} by {:.5} m", 2.0 * a, 2.0 * b)
                }
            };
            return Err(Error::Input(format!(
                "group \"{}\": no face of the surface near z = 0 is at x = {:.6}, y = {:.6} m; expected \
                 {wanted} about the contact point, \
                 and found faces from x = {x0:.4} to {x1:.4} m and from y = {y0:.4} to {y1:.4} m. Make the \
                 group larger (contact.patch of a cylinder), or \
                 the faces at the contact smaller",
                faces.group(),
                place[0],
                place[1]
            )));
        };
        let at = faces.shape_functions(piece, place);
        for (sum, factor) in weights.iter_mut().zip([1.0, place[0], place[1] - middle]) {
            for (&node, value) in at.nodes.iter().zip(at.values) {
                *sum.entry(node).or_default() += weight * factor * value;
            }
        }
    }
    Ok(PatchAverage { shape, weights: weights.map(sorted) })
}

/// Points of a rectangle of these half sides, m, and their weights, ω in them.
fn rectangle(half: [f64; 2]) -> impl Iterator<Item = ([f64; 2], f64)> {
    let line = |half: f64| -> Vec<(f64, f64)> {
        let side = 2.0 / PANELS as f64;
        let panel = |k: usize| {
            legendre(4)
                .into_iter()
                .map(move |(x, w)| (half * (side * (k as f64 + 0.5 + 0.5 * x) - 1.0), 0.5 * w / PANELS as f64))
        };
        (0..PANELS).flat_map(panel).collect()
    };
    let [along, across] = half.map(line);
    across.into_iter().flat_map(move |(y, v)| along.clone().into_iter().map(move |(x, w)| ([x, y], w * v)))
}

/// Points of the disc and their weights, ω in them: with s = √(1 − r²/b²) ∫ω f ds = 3/(2π) ∫s² ds ∫f dφ, which is
/// exact for polynomials.
fn disc(radius: f64) -> impl Iterator<Item = ([f64; 2], f64)> {
    legendre(RADII).into_iter().flat_map(move |(node, weight)| {
        let s = 0.5 * (1.0 + node);
        let r = radius * (1.0 - s * s).sqrt();
        (0..ANGLES).map(move |k| {
            // No point on an axis, where edges of faces often are.
            let (sin, cos) = (2.0 * PI * (k as f64 + 0.5) / ANGLES as f64).sin_cos();
            ([r * cos, r * sin], 1.5 * weight * s * s / ANGLES as f64)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{msh, CellKind, FacetKind, Mesh};
    use std::path::Path;

    const X: [f64; 5] = [-0.13, -0.08, 0.0, 0.07, 0.13];
    const Y: [f64; 4] = [-0.09, -0.01, 0.05, 0.09];

    /// The block of 0.3 by 0.2 m of a kind of cell, its top about the origin, its inner corners displaced, so that
    /// its faces fit no grid; edges are straight.
    fn block(kind: CellKind) -> Mesh {
        let name = format!("tests/data/msh/{}-4.1.msh", format!("{kind:?}").to_lowercase());
        let mut mesh = msh::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).expect("a block");
        mesh.nodes.iter_mut().for_each(|[x, y, z]| {
            (*x, *y, *z) = (*x - 0.15, *y - 0.1, *z - 0.1);
            let inner = (1.0 - (*x / 0.15).powi(2)) * (1.0 - (*y / 0.1).powi(2));
            (*x, *y) = (*x + 0.012 * inner, *y - 0.009 * inner);
        });
        let places = mesh.nodes.clone();
        for cell in mesh.cells.iter() {
            for (node, around) in cell.nodes[kind.corners()..].iter().zip(kind.between()) {
                let mean = |c: usize| around.iter().map(|&i| places[cell.nodes[i as usize] as usize][c]).sum::<f64>();
                mesh.nodes[*node as usize] = [0, 1, 2].map(|c| mean(c) / around.len() as f64);
            }
        }
        mesh
    }

    /// ∫N_a ds of a face in plan, by points that are many.
    fn consistent(kind: FacetKind, places: &[[f64; 3]]) -> Vec<f64> {
        let at = |own: [f64; 2], c: usize| -> f64 { places.iter().zip(kind.shape(own)).map(|(p, v)| v * p[c]).sum() };
        let mut loads = vec![0.0; places.len()];
        for (a, wa) in legendre(8) {
            for (b, wb) in legendre(8) {
                let (s, mut t, mut weight) = (0.5 * (1.0 + a), 0.5 * (1.0 + b), 0.25 * wa * wb);
                if kind.corners() == 3 {
                    (t, weight) = (t * (1.0 - s), weight * (1.0 - s));
                }
                // Of second order in each: differences are derivatives.
                let slope = |c: usize, d: [f64; 2]| 2.0 * (at([s + d[0], t + d[1]], c) - at([s - d[0], t - d[1]], c));
                let (along, up) = ([0.25, 0.0], [0.0, 0.25]);
                let area = weight * (slope(0, along) * slope(1, up) - slope(0, up) * slope(1, along));
                loads.iter_mut().zip(kind.shape([s, t])).for_each(|(sum, v)| *sum += area * v);
            }
        }
        loads
    }

    /// Means of linear fields are those at the nodes within the grid, force and moment go through, and a field 1 is
    /// 1, on every kind of face.
    #[test]
    fn means_on_faces_that_fit_no_grid() {
        for kind in CellKind::ALL {
            let mesh = block(kind);
            let (rows, z) = averages(&Faces::from_group(&mesh, "top").expect("faces"), &X, &Y).expect("means");
            assert!(z.iter().all(|z| z.abs() < 1e-14));
            for (k, row) in rows.iter().enumerate() {
                let of =
                    |f: &dyn Fn([f64; 3]) -> f64| row.iter().map(|&(n, w)| w * f(mesh.nodes[n as usize])).sum::<f64>();
                let (i, j) = (k % X.len(), k / X.len());
                assert!((of(&|_| 1.0) - 1.0).abs() < 1e-13, "{kind:?}");
                // Towards a border half of a hat is missing.
                let third = |line: &[f64], i: usize| match i {
                    0 => line[0] + (line[1] - line[0]) / 3.0,
                    _ if i + 1 == line.len() => line[i] - (line[i] - line[i - 1]) / 3.0,
                    _ => line[i] + (line[i + 1] - 2.0 * line[i] + line[i - 1]) / 3.0,
                };
                let (x, y) = (third(&X, i), third(&Y, j));
                assert!(
                    (of(&|p| p[0]) - x).abs() < 1e-9 && (of(&|p| p[1]) - y).abs() < 1e-9,
                    "{kind:?}, node {k}: {} {x}",
                    of(&|p| p[0])
                );
            }
        }
    }

    /// Nodal forces of a uniform pressure on a grid as large as the surface are the consistent ones of the faces:
    /// nothing at the corners of triangles of second order.
    #[test]
    fn a_uniform_pressure_passes() {
        let (x, y) = ([-0.15, -0.06, 0.02, 0.15], [-0.1, 0.03, 0.1]);
        for kind in CellKind::ALL {
            let mesh = block(kind);
            let faces = Faces::from_group(&mesh, "top").expect("faces");
            let (rows, _) = averages(&faces, &x, &y).expect("means");
            let side = |line: &[f64], i: usize| 0.5 * (line[(i + 1).min(line.len() - 1)] - line[i.saturating_sub(1)]);
            let mut found = BTreeMap::<u32, f64>::new();
            for (k, row) in rows.iter().enumerate() {
                let area = side(&x, k % x.len()) * side(&y, k / x.len());
                row.iter().for_each(|&(n, w)| *found.entry(n).or_default() += area * w);
            }
            let total: f64 = found.values().sum();
            assert!((total - 0.06).abs() < 1e-14, "{kind:?}: {total}");
            let mut wanted = BTreeMap::<u32, f64>::new();
            let mut triangles = true;
            for facet in &mesh.groups["top"] {
                let nodes: Vec<u32> = mesh.cells.facet(*facet).collect();
                let kind = mesh.cells.get(facet.cell as usize).kind.faces()[facet.face as usize].kind;
                let places: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
                triangles &= kind.corners() == 3;
                let loads = consistent(kind, &places);
                nodes.iter().zip(loads).for_each(|(&n, v)| *wanted.entry(n).or_default() += v);
            }
            for (node, force) in wanted {
                let found = found.get(&node).copied().unwrap_or_default();
                // Quadrilaterals are no polynomials in plan.
                let tolerance = if triangles { 1e-15 } else { 1e-7 };
                assert!((found - force).abs() < tolerance, "{kind:?}, node {node}: {found} {force}");
            }
        }
    }

    /// Means over a disc of 1, x and y give back their moments: 1, b²/5.
    #[test]
    fn means_over_a_disc() {
        for kind in CellKind::ALL {
            let mesh = block(kind);
            let faces = Faces::from_group(&mesh, "top").expect("faces");
            let PatchAverage { weights, .. } = means(&faces, PatchShape::Disc { radius: 0.06 }).expect("a disc");
            let of = |m: usize, f: &dyn Fn([f64; 3]) -> f64| -> f64 {
                weights[m].iter().map(|&(n, w)| w * f(mesh.nodes[n as usize])).sum()
            };
            let second = 0.06f64.powi(2) / 5.0;
            for (m, wanted) in [[1.0, 0.0, 0.0], [0.0, second, 0.0], [0.0, 0.0, second]].into_iter().enumerate() {
                let found = [of(m, &|_| 1.0), of(m, &|p| p[0]), of(m, &|p| p[1])];
                assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9), "{kind:?}: {found:?} {wanted:?}");
            }
        }
    }

    /// Means over a rectangle of 1, x and y about its middle: 1, a²/3, b²/3.
    #[test]
    fn means_over_a_rectangle() {
        let mesh = block(CellKind::Tet10);
        let faces = Faces::from_group(&mesh, "top").expect("faces");
        let shape = PatchShape::Rectangle { half: [0.06, 0.03], middle: 0.02 };
        let PatchAverage { weights, .. } = means(&faces, shape).expect("a rectangle");
        let of = |m: usize, f: &dyn Fn([f64; 3]) -> f64| -> f64 {
            weights[m].iter().map(|&(n, w)| w * f(mesh.nodes[n as usize])).sum()
        };
        let wanted = [[1.0, 0.0, 0.02], [0.0, 1.2e-3, 0.0], [0.0, 0.0, 3e-4]];
        for (m, wanted) in wanted.into_iter().enumerate() {
            let found = [of(m, &|_| 1.0), of(m, &|p| p[0]), of(m, &|p| p[1])];
            assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?} {wanted:?}");
        }
    }

    /// A grid beside the surface, a disc that is too large, a surface that looks down: errors with the place.
    #[test]
    fn what_is_not_there_is_named() {
        let mesh = block(CellKind::Tet10);
        let faces = Faces::from_group(&mesh, "top").expect("faces");
        let beside = averages(&faces, &[-0.16, 0.0, 0.16], &[-0.05, 0.0, 0.05]).expect_err("no face").to_string();
        for word in ["x = -0.160000", "x = -0.1500 to 0.1500 m", "contact.grid"] {
            assert!(beside.contains(word), "{word} not in: {beside}");
        }
        let large = means(&faces, PatchShape::Disc { radius: 0.12 }).expect_err("no face").to_string();
        assert!(large.contains("disc of the radius 0.12000 m"), "{large}");
        let down = Faces::from_group(&mesh.reflected(), "top").expect("faces");
        let down = averages(&down, &X, &Y).expect_err("it looks down").to_string();
        assert!(down.contains("faces -z"), "{down}");
        let missing = Faces::from_group(&mesh, "head").expect_err("no group").to_string();
        assert!(missing.contains("\"head\"") && missing.contains("\"top\""), "{missing}");
    }
}
