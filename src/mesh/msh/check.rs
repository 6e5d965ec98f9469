//! From the content of an MSH file to a mesh that the solver can rely on.

use super::cursor::Cursor;
use super::sections::Raw;
use crate::mesh::quality::jacobian_range;
use crate::mesh::{facet_key, Cells, FacetKey, Mesh};
use crate::{Error, Result};
use std::collections::{BTreeMap, HashMap};

/// Two nodes nearer than this part of the mesh's extent are taken for one that was not merged.
const COINCIDENT: f64 = 1e-10;

impl Raw {
    /// Checks what was read and makes the mesh of it; nodes keep their order, unused ones are dropped.
    pub fn mesh(self, c: &Cursor, name: &str) -> Result<Mesh> {
        if self.cell_blocks.is_empty() {
            return Err(c.error_at(
                self.elements_at,
                "no hexahedra; expected 8-node hexahedra of a volume (if there are physical groups, Gmsh saves only what is in one)",
            ));
        }
        let index =
            Index::new(&self.tags).map_err(|tag| c.error_at(self.nodes_at, format!("two nodes have the tag {tag}")))?;
        let find = |what: &str, element: u64, node: u64| {
            index.get(node).ok_or_else(|| {
                c.error_at(
                    self.elements_at,
                    format!("{what} {element} has the node {node}, which is not among the nodes"),
                )
            })
        };
        // File positions of the nodes first; numbers without gaps when the used ones are known.
        let mut used = vec![false; self.tags.len()];
        let mut cells = Cells::default();
        for (kind, tag, from) in self.cells() {
            let mut nodes = vec![0u32; kind.nodes()];
            for (&to, &from) in kind.topology().gmsh_order.iter().zip(from) {
                let at = find(kind.topology().name, tag, from)?;
                nodes[to as usize] = at;
                used[at as usize] = true;
            }
            cells.push(kind, &nodes);
        }
        let mut number = vec![u32::MAX; self.tags.len()];
        let (mut nodes, mut tags) = (Vec::new(), Vec::new());
        for i in (0..self.tags.len()).filter(|&i| used[i]) {
            number[i] = nodes.len() as u32;
            nodes.push(self.coords[i]);
            tags.push(self.tags[i]);
        }
        let cells = cells.renumbered(|n| number[n as usize]);
        let mut keys = Vec::with_capacity(self.facets.len());
        for facet in self.facets.iter().filter(|f| self.surfaces.contains_key(&f.surface)) {
            let mut corners = [u32::MAX; 4];
            for (to, &from) in corners.iter_mut().zip(&facet.corners[..facet.kind.corners()]) {
                *to = number[find(facet.kind.name(), facet.tag, from)? as usize];
                if *to == u32::MAX {
                    return Err(Error::Input(format!(
                        "{name}: {} {} has the node {from}, which belongs to no cell; expected a face of one",
                        facet.kind.name(),
                        facet.tag
                    )));
                }
            }
            keys.push(facet_key(corners));
        }
        let mut mesh = Mesh { nodes, cells, groups: BTreeMap::new() };
        self.check_cells(&mesh, name)?;
        check_nodes(&mesh, &tags, name)?;
        self.group(&mut mesh, &keys, name)?;
        Ok(mesh)
    }

    /// Refuses inverted cells.
    fn check_cells(&self, mesh: &Mesh, name: &str) -> Result<()> {
        let (mut wrong, mut inside_out) = (0usize, 0usize);
        let mut first = None;
        for (cell, (kind, tag, _)) in mesh.cells.iter().zip(self.cells()) {
            let [low, high] = jacobian_range(kind, &cell.places(&mesh.nodes));
            if low > 0.0 {
                continue;
            }
            wrong += 1;
            inside_out += usize::from(high < 0.0);
            first.get_or_insert((kind, tag, low, high));
        }
        let Some((kind, tag, low, high)) = first else { return Ok(()) };
        let hint = if inside_out == mesh.cells.len() {
            " All are inside out: the mesh is left-handed, mirrored perhaps; reverse it in Gmsh (Mesh.reverse) or renumber the nodes of its elements."
        } else {
            ""
        };
        Err(Error::Input(format!(
            "{name}: {} {tag} is inverted or flat: its Jacobian determinant runs from {low:.3e} to {high:.3e} m³ (nodes and centre); expected above 0. \
             {wrong} of {} cells are so.{hint}",
            kind.topology().name,
            mesh.cells.len()
        )))
    }

    /// Sorts the boundary facets, given by their corners, into their groups.
    fn group(&self, mesh: &mut Mesh, keys: &[FacetKey], name: &str) -> Result<()> {
        let listed = self.facets.iter().filter(|f| self.surfaces.contains_key(&f.surface));
        for (facet, found) in listed.zip(mesh.cells.find_facets(keys)) {
            let found = found.ok_or_else(|| {
                Error::Input(format!(
                    "{name}: {} {} is not a face of any cell; expected a boundary that conforms to the volume",
                    facet.kind.name(),
                    facet.tag
                ))
            })?;
            for group in self.surfaces.get(&facet.surface).into_iter().flatten() {
                let title = self.names.get(&(2, *group)).cloned().unwrap_or_else(|| group.to_string());
                mesh.groups.entry(title).or_default().push(found);
            }
        }
        Ok(())
    }
}

/// Refuses meshes with unmerged nodes or in several pieces: both leave cracks that nothing else would show.
fn check_nodes(mesh: &Mesh, tags: &[u64], name: &str) -> Result<()> {
    let size = mesh.nodes.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    let step = COINCIDENT * size;
    let mut places = HashMap::with_capacity(mesh.nodes.len());
    for (i, x) in mesh.nodes.iter().enumerate() {
        let place = x.map(|v| (v / step).round() as i64);
        if let Some(other) = places.insert(place, i) {
            return Err(Error::Input(format!(
                "{name}: the nodes {} and {} lie at the same place ({:.6}, {:.6}, {:.6}) m; expected merged nodes (Gmsh: removeDuplicateNodes, or fragment the volumes)",
                tags[other], tags[i], x[0], x[1], x[2]
            )));
        }
    }
    let mut root: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    fn find(root: &mut [u32], mut i: u32) -> u32 {
        while root[i as usize] != i {
            root[i as usize] = root[root[i as usize] as usize];
            i = root[i as usize];
        }
        i
    }
    let mut pieces = mesh.nodes.len();
    for cell in mesh.cells.iter() {
        for &n in &cell.nodes[1..] {
            let (a, b) = (find(&mut root, cell.nodes[0]), find(&mut root, n));
            if a != b {
                root[a.max(b) as usize] = a.min(b);
                pieces -= 1;
            }
        }
    }
    if pieces > 1 {
        return Err(Error::Input(format!(
            "{name}: the cells form {pieces} pieces that share no node; expected one body, in one piece"
        )));
    }
    Ok(())
}

/// Position of each node tag in the file.
enum Index {
    Dense(u64, Vec<u32>),
    Sparse(HashMap<u64, u32>),
}

impl Index {
    /// Fails with the first tag that occurs twice.
    fn new(tags: &[u64]) -> std::result::Result<Self, u64> {
        let low = tags.iter().min().copied().unwrap_or(0);
        let span = tags.iter().max().map_or(0, |high| high - low);
        if span < 8 * tags.len() as u64 + 1024 {
            let mut at = vec![u32::MAX; span as usize + 1];
            for (i, &tag) in tags.iter().enumerate() {
                if std::mem::replace(&mut at[(tag - low) as usize], i as u32) != u32::MAX {
                    return Err(tag);
                }
            }
            return Ok(Index::Dense(low, at));
        }
        let mut at = HashMap::with_capacity(tags.len());
        for (i, &tag) in tags.iter().enumerate() {
            if at.insert(tag, i as u32).is_some() {
                return Err(tag);
            }
        }
        Ok(Index::Sparse(at))
    }

    fn get(&self, tag: u64) -> Option<u32> {
        match self {
            Index::Dense(low, at) => {
                at.get(usize::try_from(tag.checked_sub(*low)?).ok()?).copied().filter(|&i| i != u32::MAX)
            }
            Index::Sparse(at) => at.get(&tag).copied(),
        }
    }
}
