//! Surfaces of a distributed mesh: area, normals, and the assembly of what acts on them.

use super::dofs::{DofMap, FIXED};
use super::forms::SurfaceForm;
use crate::mesh::distribute::MeshPart;
use crate::mesh::quality::jacobian;
use crate::mesh::reference::ShapeFunctions;
use crate::mesh::{Cell, Facet, Mesh};
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
use crate::quadrature::{triangle_6, GAUSS_3};
use std::collections::HashMap;

/// A point of the rule of a facet.
struct RulePoint {
    shape: ShapeFunctions,
    /// Coordinates, m.
    at: [f64; 3],
    /// Its unit normal, outward.
    normal: [f64; 3],
    /// Its share of the area, m².
    area: f64,
}

/// The facets of a group whose cells this rank has.
pub struct FacetSurface<'a> {
    part: &'a MeshPart,
    facets: Vec<Facet>,
}

impl<'a> FacetSurface<'a> {
    /// Collective: the facets of `group` of the mesh that rank 0 holds.
    pub fn new(world: &World, part: &'a MeshPart, mesh: Option<&Mesh>, group: &str) -> Self {
        let facets = mesh.and_then(|m| m.groups.get(group)).map_or(&[][..], |f| &f[..]);
        let cells = world.broadcast(facets.iter().map(|f| f.cell).collect::<Vec<u32>>());
        let faces = world.broadcast(facets.iter().map(|f| f.face).collect::<Vec<u8>>());
        let local: HashMap<u64, u32> = part.cell_ids.iter().copied().zip(0..).collect();
        let here = |(cell, face): (u32, u8)| local.get(&u64::from(cell)).map(|&cell| Facet { cell, face });
        Self { part, facets: cells.into_iter().zip(faces).filter_map(here).collect() }
    }

    /// Collective: area, m², and the integrals of the normal, m², and of the place, m³, over the surface.
    pub fn measures(&self, world: &World) -> (f64, [f64; 3], [f64; 3]) {
        let mut sums = [0.0; 7];
        for p in self.counted() {
            sums[0] += p.area;
            for c in 0..3 {
                sums[1 + c] += p.area * p.normal[c];
                sums[4 + c] += p.area * p.at[c];
            }
        }
        let s = world.sum_all(&sums);
        (s[0], [s[1], s[2], s[3]], [s[4], s[5], s[6]])
    }

    /// Collective: the plane that the surface lies in, a point of it, m, and its unit normal, and how far the surface
    /// is from one: the largest angle of its normal against the mean one, rad.
    pub fn plane(&self, world: &World) -> ([f64; 3], [f64; 3], f64) {
        let (area, normal, place) = self.measures(world);
        let size = normal.iter().map(|v| v * v).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let normal = normal.map(|v| v / size);
        let sine = |p: RulePoint| {
            let apart: [f64; 3] = std::array::from_fn(|c| p.normal[c] - normal[c]);
            apart.iter().map(|v| v * v).sum::<f64>().sqrt()
        };
        let worst = world.max(self.counted().map(sine).fold(0.0, f64::max));
        (place.map(|v| v / area), normal, worst)
    }

    /// The points of the facets that this rank counts: each facet is counted by one rank.
    fn counted(&self) -> impl Iterator<Item = RulePoint> + '_ {
        let own = |f: &&Facet| self.part.cell_owned[f.cell as usize];
        self.facets.iter().filter(own).flat_map(|&f| self.points(f))
    }

    fn points(&self, facet: Facet) -> Vec<RulePoint> {
        let cell = self.part.cells.get(facet.cell as usize);
        points(cell, &cell.places(&self.part.coords), facet.face as usize)
    }

    /// The matrix of a form on the surface; this rank's rows, entries only where facets are.
    pub fn assemble(&self, dofs: &DofMap, form: &dyn SurfaceForm) -> DistCsr {
        let part = self.part;
        let mut entries: Vec<(u64, u64, f64)> = Vec::new();
        for &facet in &self.facets {
            let cell = part.cells.get(facet.cell as usize);
            let nodes = cell.kind.faces()[facet.face as usize].nodes;
            for p in self.points(facet) {
                let tensor = form.tensor(p.normal);
                let values = |i: u8| (cell.nodes[i as usize] as usize, p.shape.values[i as usize]);
                for (a, va) in nodes.iter().map(|&i| values(i)).filter(|n| n.0 < part.owned) {
                    for (b, vb) in nodes.iter().map(|&i| values(i)) {
                        let (row, column) = (dofs.local[a], dofs.local[b]);
                        if row == FIXED || column == FIXED {
                            continue;
                        }
                        for (c, line) in tensor.iter().enumerate() {
                            for (d, t) in line.iter().enumerate().filter(|(_, t)| **t != 0.0) {
                                entries.push((row + c as u64, column + d as u64, p.area * va * vb * t));
                            }
                        }
                    }
                }
            }
        }
        entries.sort_by_key(|e| (e.0, e.1));
        let mut matrix = DistCsr { ranges: dofs.ranges.clone(), ..DistCsr::default() };
        matrix.indptr = vec![0; dofs.owned() + 1];
        for same in entries.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (row, column, _) = same[0];
            matrix.cols.push(column as u32);
            matrix.values.push(same.iter().map(|e| e.2).sum());
            matrix.indptr[(row - dofs.first()) as usize + 1] += 1;
        }
        for i in 0..dofs.owned() {
            matrix.indptr[i + 1] += matrix.indptr[i];
        }
        matrix
    }
}

/// Points of the facet in its own coordinates, and their weights: exact for products of two shape functions on a flat
/// facet.
fn rule(corners: usize) -> Vec<([f64; 2], f64)> {
    match corners {
        3 => triangle_6(),
        _ => {
            let line = GAUSS_3.map(|(s, w)| (0.5 + 0.5 * s, 0.5 * w));
            line.iter().flat_map(|&(s, a)| line.map(|(t, b)| ([s, t], a * b))).collect()
        }
    }
}

/// The points of a face of a cell with nodes at `x`, m.
fn points(cell: Cell<'_>, x: &[[f64; 3]], face: usize) -> Vec<RulePoint> {
    let kind = cell.kind;
    let face = &kind.faces()[face];
    let corners: Vec<[f64; 3]> =
        face.nodes[..face.kind.corners()].iter().map(|&i| kind.reference_nodes()[i as usize]).collect();
    let n = corners.len();
    // Faces of reference cells are flat parallelograms or triangles, save that of a pyramid, which are triangles.
    let [along, up]: [[f64; 3]; 2] = [1, n - 1].map(|k| std::array::from_fn(|c| corners[k][c] - corners[0][c]));
    let place = |([s, t], weight): ([f64; 2], f64)| {
        let shape = kind.shape(std::array::from_fn(|c| corners[0][c] + s * along[c] + t * up[c]));
        let j = jacobian(x, &shape);
        let [p, q] = [along, up].map(|d| -> [f64; 3] { std::array::from_fn(|i| (0..3).map(|k| j[i][k] * d[k]).sum()) });
        let area: [f64; 3] = std::array::from_fn(|c| p[(c + 1) % 3] * q[(c + 2) % 3] - p[(c + 2) % 3] * q[(c + 1) % 3]);
        let size = area.iter().map(|v| v * v).sum::<f64>().sqrt();
        RulePoint {
            at: std::array::from_fn(|c| x.iter().zip(&shape.values).map(|(x, v)| v * x[c]).sum()),
            shape,
            normal: area.map(|v| v / size),
            area: weight * size,
        }
    };
    rule(n).into_iter().map(place).collect()
}
