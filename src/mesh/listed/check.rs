//! Cells that are inverted, and cells that lie against each other without being joined.

use super::{FileContents, FileOrigin};
use crate::mesh::kind::MAX_NODES;
use crate::mesh::quality::{jacobian_range, worst_node};
use crate::mesh::{facet_key, Facet, FacetKey, Mesh};
use crate::Result;
use std::collections::HashMap;

impl FileContents {
    /// Refuses inverted cells.
    pub(super) fn check_cells(&self, mesh: &Mesh, origin: &dyn FileOrigin) -> Result<()> {
        let (mut wrong, mut inside_out) = (0usize, 0usize);
        let mut first = None;
        let mut room = [[0.0; 3]; MAX_NODES];
        for (number, cell) in mesh.cells.iter().enumerate() {
            room.iter_mut().zip(cell.nodes).for_each(|(x, &n)| *x = mesh.nodes[n as usize]);
            let places = &room[..cell.nodes.len()];
            let [low, high] = jacobian_range(cell.kind, places);
            if low > 0.0 {
                continue;
            }
            wrong += 1;
            inside_out += usize::from(high < 0.0);
            first.get_or_insert_with(|| (number, [low, high], cell.nodes[worst_node(cell.kind, places)] as usize));
        }
        let Some((number, [low, high], node)) = first else { return Ok(()) };
        let [x, y, z] = mesh.nodes[node];
        let hint = if inside_out == mesh.cells.len() {
            " All are inside out: the mesh is left-handed, mirrored perhaps; reverse its elements where it was \
             made (Mesh.reverse in Gmsh)."
        } else {
            ""
        };
        let what = format!(
            "{} {} is inverted or flat: its Jacobian determinant runs from {low:.3e} to {high:.3e} m³, least at \
             its node {} at \
             ({x:.6}, {y:.6}, {z:.6}) m; expected above 0. {wrong} of {} cells are so.{hint}",
            mesh.cells.get(number).kind.topology().name,
            origin.number(self.cell_tags[number]),
            origin.number(self.tags[node]),
            mesh.cells.len()
        );
        Err(origin.error(self.cell_at[number], what))
    }

    /// Refuses cells of different kinds that lie against each other without being joined: faces with the same corners
    /// and other nodes between them, and quadrilaterals against triangles. Nothing else would show such a crack.
    pub(super) fn check_joints(&self, mesh: &Mesh, origin: &dyn FileOrigin) -> Result<()> {
        if mesh.cells.blocks().windows(2).all(|b| b[0].kind == b[1].kind) {
            return Ok(());
        }
        let what = |f: Facet| {
            let tag = origin.number(self.cell_tags[f.cell as usize]);
            format!("{} {tag}", mesh.cells.get(f.cell as usize).kind.topology().name)
        };
        let apart = |a: Facet, b: Facet, why: &str| {
            let place = mesh.cells.facet(a).next().map_or([0.0; 3], |n| mesh.nodes[n as usize]);
            let [one, other] = [a, b].map(what);
            Err(origin.error(
                self.cell_at[a.cell as usize],
                format!("{one} and {other} lie against each other at {place:?} m and are not joined: {why}"),
            ))
        };
        let mut open: HashMap<FacetKey, Facet> = HashMap::new();
        for (i, cell) in mesh.cells.iter().enumerate() {
            for face in 0..cell.kind.faces().len() {
                let here = Facet { cell: i as u32, face: face as u8 };
                let Some(there) = open.remove(&cell.facet_key(face)) else {
                    open.insert(cell.facet_key(face), here);
                    continue;
                };
                let sorted = |f: Facet| {
                    let mut nodes: Vec<u32> = mesh.cells.facet(f).collect();
                    nodes.sort_unstable();
                    nodes
                };
                if sorted(here) != sorted(there) {
                    return apart(
                        there,
                        here,
                        "one has nodes between the corners of the face that the other has \
                     not; expected cells of the same order",
                    );
                }
            }
        }
        let open_kind = |f: &Facet| mesh.cells.get(f.cell as usize).kind.faces()[f.face as usize].kind.corners();
        let triples = open
            .iter()
            .filter(|(_, f)| open_kind(f) == 4)
            .flat_map(|(key, &f)| (0..4).map(move |out| (facet_key((0..4).filter(|&k| k != out).map(|k| key[k])), f)));
        let triples: HashMap<FacetKey, Facet> = triples.collect();
        let against = open.iter().filter_map(|(key, &triangle)| Some((triangle, *triples.get(key)?)));
        match against.min() {
            Some((triangle, quadrilateral)) => {
                let why =
                    "a quadrilateral face against a triangular one; expected pyramids between hexahedra and tetrahedra";
                apart(quadrilateral, triangle, why)
            }
            None => Ok(()),
        }
    }
}
