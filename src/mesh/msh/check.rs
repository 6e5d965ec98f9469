//! From the content of an MSH file to a mesh that the solver can rely on.

use super::cursor::Cursor;
use super::sections::Raw;
use crate::mesh::quality::{jacobian_range, FACES};
use crate::mesh::Mesh;
use crate::{Error, Result};
use std::collections::{BTreeMap, HashMap};

/// Two nodes nearer than this part of the mesh's extent are taken for one that was not merged.
const COINCIDENT: f64 = 1e-10;

impl Raw {
    /// Checks what was read and makes the mesh of it; nodes keep their order, unused ones are dropped.
    pub fn mesh(self, c: &Cursor, name: &str) -> Result<Mesh> {
        if self.cells.is_empty() {
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
        let mut cells = Vec::with_capacity(self.cells.len());
        for (cell, &tag) in self.cells.iter().zip(&self.cell_tags) {
            let mut nodes = [0u32; 8];
            for (to, &from) in nodes.iter_mut().zip(cell) {
                *to = find("hexahedron", tag, from)?;
                used[*to as usize] = true;
            }
            cells.push(nodes);
        }
        let mut number = vec![u32::MAX; self.tags.len()];
        let (mut nodes, mut tags) = (Vec::new(), Vec::new());
        for i in (0..self.tags.len()).filter(|&i| used[i]) {
            number[i] = nodes.len() as u32;
            nodes.push(self.coords[i]);
            tags.push(self.tags[i]);
        }
        cells.iter_mut().flatten().for_each(|n| *n = number[*n as usize]);
        let mut facets = Vec::with_capacity(self.facets.len());
        for facet in self.facets.iter().filter(|f| self.surfaces.contains_key(&f.surface)) {
            let mut nodes = [0u32; 4];
            for (to, &from) in nodes.iter_mut().zip(&facet.nodes) {
                *to = number[find("quadrilateral", facet.tag, from)? as usize];
                if *to == u32::MAX {
                    return Err(Error::Input(format!(
                        "{name}: quadrilateral {} has the node {from}, which belongs to no hexahedron; expected a face of one",
                        facet.tag
                    )));
                }
            }
            facets.push(nodes);
        }
        let mut mesh = Mesh { nodes, cells, groups: BTreeMap::new() };
        self.check_cells(&mesh, name)?;
        check_nodes(&mesh, &tags, name)?;
        self.group(&mut mesh, facets, name)?;
        Ok(mesh)
    }

    /// Refuses inverted hexahedra.
    fn check_cells(&self, mesh: &Mesh, name: &str) -> Result<()> {
        let (mut wrong, mut inside_out) = (0usize, 0usize);
        let mut first = None;
        for (cell, &tag) in mesh.cells.iter().zip(&self.cell_tags) {
            let [low, high] = jacobian_range(&mesh.corners(cell));
            if low > 0.0 {
                continue;
            }
            wrong += 1;
            inside_out += usize::from(high < 0.0);
            first.get_or_insert((tag, low, high));
        }
        let Some((tag, low, high)) = first else { return Ok(()) };
        let hint = if inside_out == mesh.cells.len() {
            " All are inside out: the mesh is left-handed, mirrored perhaps; reverse it in Gmsh (Mesh.reverse) or renumber the nodes of its elements."
        } else {
            ""
        };
        Err(Error::Input(format!(
            "{name}: hexahedron {tag} is inverted or flat: its Jacobian determinant runs from {low:.3e} to {high:.3e} m³ (corners and centre); expected above 0. \
             {wrong} of {} hexahedra are so.{hint}",
            mesh.cells.len()
        )))
    }

    /// Sorts the boundary quadrilaterals into their groups, each turned outwards.
    fn group(&self, mesh: &mut Mesh, facets: Vec<[u32; 4]>, name: &str) -> Result<()> {
        let key = |mut f: [u32; 4]| {
            f.sort_unstable();
            f
        };
        let mut touched = vec![false; mesh.nodes.len()];
        facets.iter().flatten().for_each(|&n| touched[n as usize] = true);
        let wanted: std::collections::HashSet<[u32; 4]> = facets.iter().map(|&f| key(f)).collect();
        let mut outward: HashMap<[u32; 4], [u32; 4]> = HashMap::with_capacity(wanted.len());
        for cell in &mesh.cells {
            for face in FACES {
                let nodes = face.map(|i| cell[i]);
                if nodes.iter().all(|&n| touched[n as usize]) && wanted.contains(&key(nodes)) {
                    outward.entry(key(nodes)).or_insert(nodes);
                }
            }
        }
        let listed = self.facets.iter().filter(|f| self.surfaces.contains_key(&f.surface));
        for (facet, nodes) in listed.zip(facets) {
            let Some(face) = outward.get(&key(nodes)) else {
                return Err(Error::Input(format!(
                    "{name}: quadrilateral {} is not a face of any hexahedron; expected a boundary that conforms to the volume",
                    facet.tag
                )));
            };
            for group in self.surfaces.get(&facet.surface).into_iter().flatten() {
                let title = self.names.get(&(2, *group)).cloned().unwrap_or_else(|| group.to_string());
                mesh.groups.entry(title).or_default().push(*face);
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
    for cell in &mesh.cells {
        for &n in &cell[1..] {
            let (a, b) = (find(&mut root, cell[0]), find(&mut root, n));
            if a != b {
                root[a.max(b) as usize] = a.min(b);
                pieces -= 1;
            }
        }
    }
    if pieces > 1 {
        return Err(Error::Input(format!(
            "{name}: the hexahedra form {pieces} pieces that share no node; expected one body, in one piece"
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
