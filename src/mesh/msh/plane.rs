//! Plane meshes of MSH files: the faces of a drawing, and its curves in physical groups.

use super::cursor::Cursor;
use super::sections::{GmshElementType, RawSections};
use crate::{Error, Result};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// A plane mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plane {
    /// Nodes (x, y), in the file's unit.
    pub nodes: Vec<[f64; 2]>,
    /// Nodes of each triangle (3 or 6) and quadrilateral (4, 8 or 9): corners, middles of the edges, centre, as Gmsh
    /// numbers them.
    pub faces: Vec<Vec<usize>>,
    /// Edges of the curves in each physical group: first node, last node, and the middle one of those of second order.
    pub curves: BTreeMap<String, Vec<Vec<usize>>>,
    /// Places in `faces` of those in each physical surface, ascending.
    pub surfaces: BTreeMap<String, Vec<usize>>,
}

/// Data read of a plane mesh so far.
#[derive(Default)]
pub(super) struct Read {
    faces: Vec<Vec<usize>>,
    /// Place in `faces` by the nodes.
    seen: HashMap<Vec<usize>, usize>,
    /// Surface entity and place in `faces`.
    within: Vec<(i32, usize)>,
    edges: Vec<(i32, Vec<usize>)>,
}

/// Furthest that nodes may lie from the plane z = 0, over the size of the mesh.
const FLAT: f64 = 1e-9;

/// Reads the plane mesh of the file at `path`, which lies in the plane z = const.
pub fn read(path: &Path) -> Result<Plane> {
    let name = path.display().to_string();
    let mut file = crate::input::open(path).map_err(|e| {
        Error::Input(format!(
            "section {name} cannot be read: {e}; expected a plane mesh of Gmsh, MSH version 4.1 or 2.2"
        ))
    })?;
    of_source(&mut file, &name)
}

fn of_source(source: &mut dyn super::cursor::InputSource, name: &str) -> Result<Plane> {
    let mut c = Cursor::new(source, name)?;
    c.skip_mark()?;
    RawSections::of_plane().read_plane(&mut c)
}

impl Read {
    /// Takes an element with the numbers of its nodes.
    pub fn add_element(
        &mut self,
        c: &Cursor,
        of: &GmshElementType,
        (entity, [tag, at]): (i32, [u64; 2]),
        nodes: Vec<usize>,
    ) -> Result<()> {
        match (of.dim, nodes.len()) {
            (0, _) => {}
            (1, 2 | 3) => self.edges.push((entity, nodes)),
            (2, 3 | 4 | 6 | 8 | 9) => {
                // What is in several groups occurs several times in files of version 2.2.
                let new = self.faces.len();
                let place = *self.seen.entry(nodes.clone()).or_insert(new);
                if place == new {
                    self.faces.push(nodes);
                }
                self.within.push((entity, place));
            }
            _ => {
                return Err(c.error_at(
                    at,
                    format!(
                        "element {tag} is a {}; expected triangles of 3 or 6 nodes, quadrilaterals of 4, 8 or \
                         9, and lines of 2 or 3: a section is a plane mesh",
                        of.name
                    ),
                ));
            }
        }
        Ok(())
    }
}

impl RawSections {
    /// Reads a file with a plane mesh.
    fn read_plane(mut self, c: &mut Cursor) -> Result<Plane> {
        let elements_at = self.sections(c)?;
        let read = self.plane.take().unwrap_or_default();
        if read.faces.is_empty() {
            return Err(c.error_at(
                elements_at,
                "no triangles or quadrilaterals; expected a plane mesh (if there are physical groups, Gmsh \
                 saves only what is in one)",
            ));
        }
        let coords = &self.listed.coords;
        let size = coords.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let level = coords[read.faces[0][0]][2];
        if let Some(i) = coords.iter().position(|x| !((x[2] - level).abs() <= FLAT * size)) {
            return Err(c.error_at(
                self.listed.node_at[i],
                format!(
                    "node {} has z = {}, others {level}; expected a plane mesh, all of it at one z",
                    self.listed.tags[i], coords[i][2]
                ),
            ));
        }
        let nodes = coords.iter().map(|x| [x[0], x[1]]).collect();
        let mut curves: BTreeMap<String, Vec<Vec<usize>>> = BTreeMap::new();
        let title = |g: &i32| self.names.get(&(1, *g)).cloned().unwrap_or_else(|| g.to_string());
        let titles: HashMap<i32, Vec<String>> =
            self.curves.iter().map(|(curve, groups)| (*curve, groups.iter().map(title).collect())).collect();
        for (curve, edge) in read.edges {
            for name in titles.get(&curve).into_iter().flatten() {
                curves.entry(name.clone()).or_default().push(edge.clone());
            }
        }
        let title = |g: &i32| self.names.get(&(2, *g)).cloned().unwrap_or_else(|| g.to_string());
        let mut surfaces: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (surface, place) in read.within {
            for group in self.surfaces.get(&surface).into_iter().flatten() {
                surfaces.entry(title(group)).or_default().push(place);
            }
        }
        surfaces.values_mut().for_each(|places| places.sort_unstable());
        Ok(Plane { nodes, faces: read.faces, curves, surfaces })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(data: &[u8], name: &str) -> Result<Plane> {
        of_source(&mut std::io::Cursor::new(data), name)
    }

    const SQUARE: &str =
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 1 \"running\"\n2 2 \"steel\"\n$EndPhysicalNames\n\
        $Nodes\n5\n1 0 1 0\n2 2 1 0\n3 2 2 0\n4 0 2 0\n5 9 9 0\n$EndNodes\n\
        $Elements\n4\n1 1 2 1 7 4 3\n2 3 2 2 1 1 2 3 4\n3 3 2 3 1 1 2 3 4\n4 15 2 0 1 1\n$EndElements\n";

    #[test]
    fn faces_and_named_curves_are_read() {
        let plane = parse(SQUARE.as_bytes(), "square.msh").expect("a plane mesh");
        assert_eq!(plane.nodes[..4], [[0.0, 1.0], [2.0, 1.0], [2.0, 2.0], [0.0, 2.0]]);
        assert_eq!(plane.faces, [vec![0, 1, 2, 3]], "once");
        assert_eq!(plane.curves, [("running".to_owned(), vec![vec![3, 2]])].into());
        let surfaces = [("steel".to_owned(), vec![0]), ("3".to_owned(), vec![0])];
        assert_eq!(plane.surfaces, surfaces.into(), "each group that has it");
    }

    #[test]
    fn what_is_no_plane_mesh_is_refused_with_its_place() {
        let says = |text: String| parse(text.as_bytes(), "square.msh").expect_err("refused").to_string();
        let text = says(SQUARE.replace("3 2 2 0", "3 2 2 0.5"));
        assert!(text.contains("square.msh, line 13") && text.contains("z = 0.5"), "{text}");
        let text = says(SQUARE.replace("2 3 2 2 1 1 2 3 4", "2 4 2 2 1 1 2 3 4"));
        assert!(text.contains("4-node tetrahedron") && text.contains("plane mesh"), "{text}");
        let text = says(SQUARE.replace("2 3 2 2 1 1 2 3 4\n3 3 2 3 1 1 2 3 4", "2 1 2 2 1 1 2\n3 1 2 3 1 1 2"));
        assert!(text.contains("no triangles or quadrilaterals"), "{text}");
        let text = says(SQUARE.replace("1 1 2 1 7 4 3", "1 1 2 1 7 4 33"));
        assert!(text.contains("node 33"), "{text}");
    }
}
