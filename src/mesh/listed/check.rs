//! From the content of an MSH file to a mesh that the solver can rely on.

use super::cursor::Cursor;
use super::sections::Raw;
use crate::mesh::quality::{jacobian_range, worst_node};
use crate::mesh::{facet_key, Cells, Facet, FacetKey, Mesh};
use crate::{Error, Result};
use std::collections::{BTreeMap, HashMap};

/// Two nodes nearer than this part of the mesh's extent are taken for one that was not merged.
const COINCIDENT: f64 = 1e-10;

impl Raw {
    /// Checks what was read and makes the mesh of it; nodes keep their order, unused ones are dropped.
    pub fn mesh(self, c: &Cursor, name: &str) -> Result<Mesh> {
        if self.cells().next().is_none() {
            return Err(c.error_at(
                self.elements_at,
                "no cells; expected tetrahedra, hexahedra, wedges or pyramids of a volume (if there are physical groups, Gmsh saves only what is in one)",
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
        self.check_cells(&mesh, &tags, name)?;
        check_nodes(&mesh, &tags, name)?;
        self.check_joints(&mesh, name)?;
        self.group(&mut mesh, &keys, name)?;
        Ok(mesh)
    }

    /// Refuses inverted cells; `tags` are those of the nodes.
    fn check_cells(&self, mesh: &Mesh, tags: &[u64], name: &str) -> Result<()> {
        let (mut wrong, mut inside_out) = (0usize, 0usize);
        let mut first = None;
        for (cell, (kind, tag, _)) in mesh.cells.iter().zip(self.cells()) {
            let places = cell.places(&mesh.nodes);
            let [low, high] = jacobian_range(kind, &places);
            if low > 0.0 {
                continue;
            }
            wrong += 1;
            inside_out += usize::from(high < 0.0);
            first.get_or_insert_with(|| (kind, tag, [low, high], cell.nodes[worst_node(kind, &places)] as usize));
        }
        let Some((kind, tag, [low, high], node)) = first else { return Ok(()) };
        let [x, y, z] = mesh.nodes[node];
        let hint = if inside_out == mesh.cells.len() {
            " All are inside out: the mesh is left-handed, mirrored perhaps; reverse it in Gmsh (Mesh.reverse) or renumber the nodes of its elements."
        } else {
            ""
        };
        Err(Error::Input(format!(
            "{name}: {} {tag} is inverted or flat: its Jacobian determinant runs from {low:.3e} to {high:.3e} m³, least at its node {} at \
             ({x:.6}, {y:.6}, {z:.6}) m; expected above 0. {wrong} of {} cells are so.{hint}",
            kind.topology().name,
            tags[node],
            mesh.cells.len()
        )))
    }

    /// Refuses cells of different kinds that lie against each other without being joined: faces with the same corners and other nodes between them, and
    /// quadrilaterals against triangles. Nothing else would show such a crack.
    fn check_joints(&self, mesh: &Mesh, name: &str) -> Result<()> {
        if mesh.cells.blocks().windows(2).all(|b| b[0].kind == b[1].kind) {
            return Ok(());
        }
        let what = |f: Facet| {
            let (kind, tag, _) = self.cells().nth(f.cell as usize)?;
            Some(format!("{} {tag}", kind.topology().name))
        };
        let apart = |a: Facet, b: Facet, why: &str| {
            let place = mesh.cells.facet(a).next().map_or([0.0; 3], |n| mesh.nodes[n as usize]);
            let [a, b] = [a, b].map(|f| what(f).unwrap_or_default());
            Err(Error::Input(format!(
                "{name}: {a} and {b} lie against each other at {place:?} m and are not joined: {why}"
            )))
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
                    return apart(there, here, "one has nodes between the corners of the face that the other has not; expected cells of the same order");
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
