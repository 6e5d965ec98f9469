//! How the surface of a body meets the nodes of a contact grid that its mesh does not have.

use super::clip::{clipped, Rule};
use super::faces::Faces;
use crate::quadrature::legendre;
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Nodes of a mesh and the weights of their displacements, by ascending nodes.
pub type Weights = Vec<(u32, f64)>;

/// What part of the area of a node may miss a face, or have two.
const COVERED: f64 = 1e-6;
/// Points of the disc along its radius and around it.
const RADII: usize = 32;
const ANGLES: usize = 96;

/// How displacements of a mesh become those of the nodes of a contact grid. Forces go back by the transpose.
#[derive(Debug, Clone, PartialEq)]
pub enum Transfer {
    /// Each grid node is a node of the mesh, `[n]`.
    Nodes(Vec<u32>),
    /// Each grid node moves as the mean of the surface about it, u_i = (1/A_i) Σ_a ∫N_i N_a ds u_a, with N_i bilinear on the grid and N_a the shape
    /// functions of the faces, seen in plan, `[n]`.
    Averages(Vec<Weights>),
    /// The surface moves by π = (1, x, y) times three means of it over a disc, the first one; a second, wider one shows how little it depends on that.
    Means {
        /// The discs.
        discs: Vec<Means>,
        /// Angle from the axes y, z of the mesh to those of the grid about −x, rad: y of the mesh is (0, cos, −sin) there.
        tilt: f64,
    },
}

/// Means of a surface over a disc about the origin, with Hertz' weight ω = 3/(2πb²)√(1 − r²/b²).
#[derive(Debug, Clone, PartialEq)]
pub struct Means {
    /// Radius b of the disc, m.
    pub radius: f64,
    /// ∫ω π_m N_a ds for π = (1, x, y), 1 and m.
    pub weights: [Weights; 3],
}

fn sorted(weights: BTreeMap<u32, f64>) -> Weights {
    weights.into_iter().collect()
}

/// The means of `faces` over the nodes of the grid of lines `x` and `y`, m, and the heights of the surface there, m, `[nx*ny]` each. Force and moment of
/// nodal forces within the grid are those of the forces on the faces, and a uniform pressure is one.
///
/// # Errors
/// Places where there is no face behind the grid, or two; faces that look down or are steep.
pub fn averages(faces: &Faces, x: &[f64], y: &[f64]) -> Result<(Vec<Weights>, Vec<f64>)> {
    let (nx, ny) = (x.len(), y.len());
    if nx < 2 || ny < 2 {
        return Err(Error::Defect(format!("a contact grid of {nx} by {ny} nodes")));
    }
    let half = [x, y].map(|v| v[0].abs().max(v[v.len() - 1].abs()));
    let rule = Rule::new();
    let mut rows = vec![BTreeMap::<u32, f64>::new(); nx * ny];
    let mut area = vec![0.0; nx * ny];
    let pieces = faces.around(half)?;
    for piece in &pieces {
        let span = |c: usize, line: &[f64]| {
            let at = || piece.plan.iter().map(|p| p[c]);
            let (low, high) = (at().fold(f64::INFINITY, f64::min), at().fold(f64::NEG_INFINITY, f64::max));
            line.partition_point(|v| *v <= low).saturating_sub(1)..line.partition_point(|v| *v < high).min(line.len() - 1)
        };
        for j in span(1, y) {
            for i in span(0, x) {
                let polygon = clipped(piece.plan, [x[i], y[j]], [x[i + 1], y[j + 1]]);
                for (p, weight) in rule.points(&polygon) {
                    let at = faces.at(piece, p);
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
        Ok(faces.at(piece, place).z)
    };
    // At the node: a mean would lie below a round surface.
    let z = (0..nx * ny).map(height).collect::<Result<_>>()?;
    Ok((rows.into_iter().map(sorted).collect(), z))
}

/// What is wrong where faces make up `found` of the area of a node at `p`.
fn uncovered(faces: &Faces, p: [f64; 2], found: f64) -> Error {
    let [[x0, x1], [y0, y1]] = faces.ends();
    let surface = match faces.height(p) {
        Some(z) if found < 1.0 => format!("; the surface over it is at z = {z:.6} m"),
        _ => String::new(),
    };
    let what = if found < 1.0 { "no face of the surface is behind a part of" } else { "faces lie above each other at" };
    Error::Input(format!(
        "group \"contact\": {what} the node x = {:.6}, y = {:.6} m of the contact grid (faces make up {:.4} of its area){surface}; the group reaches from \
         x = {x0:.4} to {x1:.4} m and from y = {y0:.4} to {y1:.4} m. Expected one surface near z = 0 behind the whole grid: make the group larger (contact.patch \
         of a cylinder), or the grid smaller (contact.grid)",
        p[0], p[1], found
    ))
}

/// The means of `faces` over the disc of the radius `radius`, m.
///
/// # Errors
/// A place of the disc where there is no face; faces that look down or are steep.
pub fn means(faces: &Faces, radius: f64) -> Result<Means> {
    let pieces = faces.around([radius; 2])?;
    let mut weights = [const { BTreeMap::<u32, f64>::new() }; 3];
    for (place, weight) in disc(radius) {
        let Some(piece) = faces.over(&pieces, place) else {
            let [[x0, x1], [y0, y1]] = faces.ends();
            return Err(Error::Input(format!(
                "group \"contact\": no face of the surface near z = 0 is at x = {:.6}, y = {:.6} m; expected a disc of the radius {radius:.5} m about the contact point, \
                 and found faces from x = {x0:.4} to {x1:.4} m and from y = {y0:.4} to {y1:.4} m. Make the group larger (contact.patch of a cylinder), or \
                 the faces at the contact smaller",
                place[0], place[1]
            )));
        };
        let at = faces.at(piece, place);
        for (sum, factor) in weights.iter_mut().zip([1.0, place[0], place[1]]) {
            for (&node, value) in at.nodes.iter().zip(at.values) {
                *sum.entry(node).or_default() += weight * factor * value;
            }
        }
    }
    Ok(Means { radius, weights: weights.map(sorted) })
}

/// Points of the disc and their weights, ω in them: with s = √(1 − r²/b²) ∫ω f ds = 3/(2π) ∫s² ds ∫f dφ, which is exact for polynomials.
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
