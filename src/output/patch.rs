//! The contact grid on the surface of a body, where its nodes are none of the mesh's: cells of its own beside those
//! of the body.

use super::fields::{FieldKind, FieldSpec};
use crate::grid::Weights;
use crate::mesh::distribute::MeshPart;
use crate::parallel::World;
use crate::{Error, Result};
use std::collections::HashMap;

/// A quadrilateral between each four nodes of the grid, on the surface of a body. It is rank 0's.
#[derive(Debug, Clone)]
pub struct GridPatch {
    /// True for body 2: coordinates and vectors are reflected in z when written.
    pub upper: bool,
    /// Nodes along x and y, nx and ny.
    pub lines: [usize; 2],
    /// Nodes in the body's own (lower) form, m, `[nx*ny]`, node (i, j) the (i + nx·j)-th.
    pub points: Vec<[f64; 3]>,
    /// Names of all fields of the file and their values here, node by node, vectors in the body's own form, `[nx*ny *
    /// components]`.
    pub values: Vec<(String, Vec<f64>)>,
}

/// Points, cells and what goes with them, as they are written.
#[derive(Debug, Clone)]
pub(super) struct PatchGrid {
    pub(super) points: Vec<f64>,
    pub(super) connectivity: Vec<i64>,
    pub(super) offsets: Vec<i64>,
    pub(super) types: Vec<u8>,
    pub(super) body_of_point: Vec<i8>,
    pub(super) body_of_cell: Vec<i8>,
}

impl PatchGrid {
    pub(super) fn new() -> Self {
        Self {
            points: Vec::new(),
            connectivity: Vec::new(),
            offsets: vec![0],
            types: Vec::new(),
            body_of_point: Vec::new(),
            body_of_cell: Vec::new(),
        }
    }

    /// Points, cells and entries of the connectivity.
    pub(super) fn counts(&self) -> [i64; 3] {
        [self.body_of_point.len() as i64, self.body_of_cell.len() as i64, self.connectivity.len() as i64]
    }

    /// Adds the cells of a patch, outward.
    pub(super) fn add(&mut self, patch: &GridPatch) {
        let body = if patch.upper { 2 } else { 1 };
        let first = self.body_of_point.len();
        for &[x, y, z] in &patch.points {
            self.points.extend([x, y, if patch.upper { -z } else { z }]);
            self.body_of_point.push(body);
        }
        let [nx, ny] = patch.lines;
        for j in 1..ny {
            for i in 1..nx {
                let mut ring = [[i - 1, j - 1], [i, j - 1], [i, j], [i - 1, j]];
                if patch.upper {
                    ring.reverse();
                }
                self.connectivity.extend(ring.map(|[i, j]| (first + i + nx * j) as i64));
                self.offsets.push(self.connectivity.len() as i64);
                // VTK's quadrilateral.
                self.types.push(9);
                self.body_of_cell.push(body);
            }
        }
    }
}

/// The values of a field at the points of all `patches`, as they are written.
pub(super) fn values(spec: &FieldSpec, patches: &[GridPatch]) -> Result<Vec<f64>> {
    let mut all: Vec<f64> = Vec::new();
    for patch in patches {
        let found = patch.values.iter().find(|(name, _)| *name == spec.name).map(|(_, values)| values);
        let expected = patch.points.len() * spec.kind.components();
        match found {
            Some(values) if values.len() == expected => all.extend(values),
            _ => {
                let have = found.map_or(0, Vec::len);
                return Err(Error::Defect(format!(
                    "field {} has {have} values on the contact grid, expected {expected}",
                    spec.name
                )));
            }
        }
        if patch.upper && spec.kind == FieldKind::Vector {
            let first = all.len() - expected;
            all[first..].iter_mut().skip(2).step_by(3).for_each(|z| *z = -*z);
        }
    }
    Ok(all)
}

/// Collective: weighted sums of nodal `values`, which each rank has at its local nodes, `[node_ids.len() *
/// components]`: `rows` of nodes of the whole mesh are rank 0's. On rank 0 `[rows.len() * components]`, nothing
/// elsewhere.
pub fn averaged(world: &World, part: &MeshPart, rows: &[Weights], values: &[f64], components: usize) -> Vec<f64> {
    let mut nodes: Vec<u32> = rows.iter().flatten().map(|&(node, _)| node).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let id = |&n: &u32| part.renumbered.get(n as usize).copied().unwrap_or(u64::from(n));
    let ids = world.broadcast(nodes.iter().map(id).collect::<Vec<u64>>());
    let owned: HashMap<u64, usize> = part.node_ids[..part.owned].iter().enumerate().map(|(i, &id)| (id, i)).collect();
    let mut mine = vec![0.0; ids.len() * components];
    for (id, row) in ids.iter().zip(mine.chunks_exact_mut(components)) {
        if let Some(&i) = owned.get(id) {
            row.copy_from_slice(&values[i * components..(i + 1) * components]);
        }
    }
    let all = world.sum_all(&mine);
    let mean = |row: &Weights, c: usize| -> f64 {
        let term = |&(node, w): &(u32, f64)| nodes.binary_search(&node).map_or(0.0, |k| w * all[k * components + c]);
        row.iter().map(term).sum()
    };
    rows.iter().flat_map(|row| (0..components).map(move |c| (row, c))).map(|(row, c)| mean(row, c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(upper: bool) -> GridPatch {
        let points = (0..6).map(|k| [f64::from(k % 3), f64::from(k / 3), -0.1]).collect();
        let pressure = ("pressure".to_owned(), (0..6).map(f64::from).collect());
        let traction = ("traction".to_owned(), [1.0, 2.0, 3.0].repeat(6));
        GridPatch { upper, lines: [3, 2], points, values: vec![pressure, traction] }
    }

    /// Quadrilaterals of both bodies look at the other one, and values of the upper one are mirrored with it.
    #[test]
    fn patches_look_outward_and_are_mirrored() {
        let both = [patch(false), patch(true)];
        let mut block = PatchGrid::new();
        both.iter().for_each(|p| block.add(p));
        assert_eq!((block.counts(), &block.types[..]), ([12, 4, 16], &[9; 4][..]));
        for cell in 0..4 {
            let ring = &block.connectivity[4 * cell..4 * cell + 4];
            let at = |k: usize| &block.points[3 * ring[k] as usize..3 * ring[k] as usize + 3];
            let [a, b, d] = [at(0), at(1), at(3)];
            let up = (b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0]);
            let (body, z) = if cell < 2 { (1, -0.1) } else { (2, 0.1) };
            assert_eq!((block.body_of_cell[cell], a[2]), (body, z));
            assert!((up - if body == 1 { 1.0 } else { -1.0 }).abs() < 1e-15, "{ring:?}");
        }
        let spec = |name: &str, kind| FieldSpec::new(name, "Pa", "A field.", kind);
        let pressure = values(&spec("pressure", FieldKind::Scalar), &both).expect("it is there");
        assert_eq!(pressure, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0].repeat(2));
        let traction = values(&spec("traction", FieldKind::Vector), &both).expect("it is there");
        assert_eq!(traction, [[1.0, 2.0, 3.0].repeat(6), [1.0, 2.0, -3.0].repeat(6)].concat());
        assert!(values(&spec("state", FieldKind::Label), &both).is_err());
    }
}
