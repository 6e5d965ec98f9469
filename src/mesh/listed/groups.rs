//! Groups of boundary facets: those that a file lists as elements, as faces of cells, or by their nodes.

use super::{FileContents, FileOrigin};
use crate::mesh::{facet_key, Facet, FacetKey, Mesh};
use crate::Result;
use std::collections::{HashMap, HashSet};

impl FileContents {
    /// Sorts the facets into their groups. Remarks are about node sets that are no group.
    pub(super) fn group(&self, mesh: &mut Mesh, origin: &dyn FileOrigin) -> Result<Vec<String>> {
        let listed = || self.facets.iter().filter(|f| self.surfaces.contains_key(&f.surface));
        let keys: Vec<FacetKey> = listed().map(|f| facet_key(f.corners[..f.kind.corners()].iter().copied())).collect();
        for (facet, found) in listed().zip(mesh.cells.find_facets(&keys)) {
            if facet.loose && found.is_none() {
                continue;
            }
            let found = found.ok_or_else(|| {
                let what = format!(
                    "{} {} is not a face of any cell; expected a boundary that conforms to the volume",
                    facet.kind.name(),
                    origin.number(facet.tag)
                );
                origin.error(facet.at, what)
            })?;
            for name in self.surfaces.get(&facet.surface).into_iter().flatten() {
                mesh.groups.entry(name.clone()).or_default().push(found);
            }
        }
        for (name, face) in &self.faces {
            mesh.groups.entry(name.clone()).or_default().push(*face);
        }
        // A face that a surface names twice is one.
        let named: HashSet<&String> = self.faces.iter().map(|f| &f.0).collect();
        for (_, facets) in mesh.groups.iter_mut().filter(|(name, _)| named.contains(name)) {
            let mut seen = HashSet::new();
            facets.retain(|f| seen.insert(*f));
        }
        let mut remarks = Vec::new();
        for (name, set) in &self.node_sets {
            // A set of all nodes names no surface, and a group of that name is there already.
            if set.len() == mesh.nodes.len() || mesh.groups.contains_key(name) {
                continue;
            }
            let facets = between(mesh, set);
            if facets.is_empty() {
                remarks
                    .push(format!("the node set \"{name}\" holds no whole face of the boundary: it is no group here"));
            } else {
                mesh.groups.insert(name.clone(), facets);
            }
        }
        Ok(remarks)
    }
}

/// Boundary facets all of whose nodes are in `set`, in the order of the cells.
fn between(mesh: &Mesh, set: &[u32]) -> Vec<Facet> {
    let mut member = vec![false; mesh.nodes.len()];
    set.iter().for_each(|&n| member[n as usize] = true);
    let mut open: HashMap<FacetKey, Facet> = HashMap::new();
    for (i, cell) in mesh.cells.iter().enumerate() {
        if cell.nodes.iter().filter(|&&n| member[n as usize]).count() < 3 {
            continue;
        }
        for face in 0..cell.kind.faces().len() {
            let key = cell.facet_key(face);
            // Met for the second time it lies between two cells.
            if cell.facet(face).all(|n| member[n as usize]) && open.remove(&key).is_none() {
                open.insert(key, Facet { cell: i as u32, face: face as u8 });
            }
        }
    }
    let mut facets: Vec<Facet> = open.into_values().collect();
    facets.sort_unstable();
    facets
}
