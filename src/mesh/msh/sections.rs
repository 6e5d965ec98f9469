//! Sections of an MSH file, and what they have in common in all versions.

use super::cursor::Cursor;
use super::plane;
use crate::mesh::listed::FileContents;
use crate::mesh::{CellKind, FacetKind};
use crate::Result;
use std::collections::HashMap;

/// Element types of Gmsh: number, nodes, dimension, name.
const TYPES: [(i32, usize, i32, &str); 30] = [
    (1, 2, 1, "2-node line"),
    (2, 3, 2, "3-node triangle"),
    (3, 4, 2, "4-node quadrilateral"),
    (4, 4, 3, "4-node tetrahedron"),
    (5, 8, 3, "8-node hexahedron"),
    (6, 6, 3, "6-node prism"),
    (7, 5, 3, "5-node pyramid"),
    (8, 3, 1, "3-node line"),
    (9, 6, 2, "6-node triangle"),
    (10, 9, 2, "9-node quadrilateral"),
    (11, 10, 3, "10-node tetrahedron"),
    (12, 27, 3, "27-node hexahedron"),
    (13, 18, 3, "18-node prism"),
    (14, 14, 3, "14-node pyramid"),
    (15, 1, 0, "point"),
    (16, 8, 2, "8-node quadrilateral"),
    (17, 20, 3, "20-node hexahedron"),
    (18, 15, 3, "15-node prism"),
    (19, 13, 3, "13-node pyramid"),
    (20, 9, 2, "9-node triangle"),
    (21, 10, 2, "10-node triangle"),
    (22, 12, 2, "12-node triangle"),
    (23, 15, 2, "15-node triangle"),
    (26, 4, 1, "4-node line"),
    (27, 5, 1, "5-node line"),
    (28, 6, 1, "6-node line"),
    (29, 20, 3, "20-node tetrahedron"),
    (30, 35, 3, "35-node tetrahedron"),
    (36, 16, 2, "16-node quadrilateral"),
    (92, 64, 3, "64-node hexahedron"),
];

/// Data read so far.
#[derive(Default)]
pub(super) struct RawSections {
    /// Names of physical groups by their dimension and tag.
    pub names: HashMap<(i32, i32), String>,
    /// Physical groups of each curve.
    pub curves: HashMap<i32, Vec<i32>>,
    /// Physical groups of each surface.
    pub surfaces: HashMap<i32, Vec<i32>>,
    /// Elements of a plane mesh, in place of cells and facets.
    pub plane: Option<plane::Read>,
    pub listed: FileContents,
    seen: [bool; 3],
    /// Version 2.2, not 4.1.
    old: bool,
}

const FORMAT: usize = 0;
const NODES: usize = 1;
const ELEMENTS: usize = 2;

/// An element type of Gmsh, and what it is here.
pub(super) struct GmshElementType {
    pub nodes: usize,
    pub dim: i32,
    pub name: &'static str,
    cell: Option<CellKind>,
    facet: Option<FacetKind>,
}

impl RawSections {
    /// For a plane mesh.
    pub fn of_plane() -> Self {
        Self { plane: Some(plane::Read::default()), ..Self::default() }
    }

    /// Reads a file.
    pub fn read(mut self, c: &mut Cursor) -> Result<FileContents> {
        let elements_at = self.sections(c)?;
        if self.listed.cells.is_empty() {
            return Err(c.error_at(
                elements_at,
                "no cells; expected tetrahedra, hexahedra, wedges or pyramids of a volume (if there are \
                 physical groups, Gmsh saves only what is in one)",
            ));
        }
        for (surface, groups) in self.surfaces {
            let title = |g: &i32| self.names.get(&(2, *g)).cloned().unwrap_or_else(|| g.to_string());
            self.listed.surfaces.insert(surface, groups.iter().map(title).collect());
        }
        Ok(self.listed)
    }

    /// Reads all sections; the place of the elements.
    pub fn sections(&mut self, c: &mut Cursor) -> Result<u64> {
        let mut elements_at = 0;
        loop {
            let at = c.pos();
            let Some(line) = c.filled_line()? else { break };
            if !self.seen[FORMAT] && line != "$MeshFormat" {
                return Err(
                    c.error_at(at, format!("found {:?}; expected $MeshFormat: not a Gmsh MSH file", clip(&line)))
                );
            }
            match line.as_str() {
                "$MeshFormat" => self.format(c)?,
                "$PhysicalNames" => self.physical_names(c)?,
                "$Entities" if !self.old => self.entities(c)?,
                "$PartitionedEntities" if !self.old => self.partitioned_entities(c)?,
                "$Nodes" | "$ParametricNodes" => {
                    self.once(c, NODES, "$Nodes")?;
                    if self.old {
                        self.nodes_2(c, line == "$ParametricNodes")?;
                    } else {
                        self.nodes_4(c)?;
                    }
                    self.listed.number(c)?;
                }
                "$Elements" => {
                    elements_at = at;
                    self.once(c, ELEMENTS, "$Elements")?;
                    if !self.seen[NODES] {
                        return Err(
                            c.error_at(at, "$Elements before $Nodes; expected the nodes first, as Gmsh writes them")
                        );
                    }
                    if self.old {
                        self.elements_2(c)?;
                    } else {
                        self.elements_4(c)?;
                    }
                }
                other if other.starts_with('$') && !other.starts_with("$End") => {
                    c.skip_past(&format!("$End{}", &other[1..]))?;
                }
                other => {
                    return Err(
                        c.error_at(at, format!("found {:?}; expected the beginning of a section ($…)", clip(other)))
                    );
                }
            }
        }
        for (seen, name) in self.seen.iter().zip(["$MeshFormat", "$Nodes", "$Elements"]) {
            if !seen {
                return Err(c.error(format!("the file ends without {name}; it may be empty or truncated")));
            }
        }
        Ok(elements_at)
    }

    /// Refuses a section that was there before.
    fn once(&mut self, c: &Cursor, section: usize, name: &str) -> Result<()> {
        if std::mem::replace(&mut self.seen[section], true) {
            return Err(c.error(format!("a second section {name}; expected one")));
        }
        Ok(())
    }

    fn format(&mut self, c: &mut Cursor) -> Result<()> {
        self.once(c, FORMAT, "$MeshFormat")?;
        let at = c.pos();
        let line = c.line()?.unwrap_or_default();
        let words: Vec<&str> = line.split_whitespace().collect();
        let [version, kind, size] = words[..] else {
            return Err(c.error_at(
                at,
                format!("found {:?}; expected version, file type and data size, such as \"4.1 0 8\"", clip(&line)),
            ));
        };
        match version {
            "4.1" => {}
            "2.2" => self.old = true,
            _ => {
                return Err(c.error_at(
                    at,
                    format!(
                        "MSH version {:?}; expected 4.1 or 2.2: save with Mesh.MshFileVersion = 4.1 or gmsh \
                         -format msh41",
                        clip(version)
                    ),
                ));
            }
        }
        if size != "8" {
            return Err(c.error_at(at, format!("data size {:?}; expected 8 (bytes)", clip(size))));
        }
        match kind {
            "0" => {}
            "1" => {
                c.binary = true;
                let at = c.pos();
                let one = c.int("the number 1 that shows the byte order")?;
                c.swapped = one == 1i32.swap_bytes();
                if one != 1 && !c.swapped {
                    return Err(c.error_at(at, format!("found {one}; expected the number 1 that shows the byte order")));
                }
            }
            _ => return Err(c.error_at(at, format!("file type {:?}; expected 0 (ASCII) or 1 (binary)", clip(kind)))),
        }
        c.expect("$EndMeshFormat")
    }

    /// Interpretation of an element of type `number`, in the surface `entity` if it is a facet; `at` is its place.
    pub fn element_type(&self, c: &Cursor, at: u64, number: i32, entity: i32) -> Result<GmshElementType> {
        let Some(&(_, nodes, dim, name)) = TYPES.iter().find(|t| t.0 == number) else {
            let text = format!("element type {number}; expected {} (and {} on the boundary)", cells(), facets());
            return Err(c.error_at(at, text));
        };
        let cell = CellKind::of_gmsh(number);
        let facet = FacetKind::ALL.into_iter().find(|f| f.gmsh() == number);
        if dim == 3 && cell.is_none() {
            return Err(c.error_at(at, format!("elements of type {number}, {name}; expected {}", cells())));
        }
        if dim == 2 && facet.is_none() && self.surfaces.contains_key(&entity) {
            let text = format!(
                "elements of type {number}, {name}, in a physical group; expected {} on the boundary",
                facets()
            );
            return Err(c.error_at(at, text));
        }
        Ok(GmshElementType { nodes, dim, name, cell, facet })
    }

    /// Takes an element, of which `place` is number and place in the file, in the surface `entity` with its nodes in
    /// Gmsh's order.
    pub fn add_element(
        &mut self,
        c: &Cursor,
        of: &GmshElementType,
        entity: i32,
        place: [u64; 2],
        nodes: &[u64],
    ) -> Result<()> {
        if let Some(plane) = &mut self.plane {
            let position = |&tag: &u64| {
                let missing = || {
                    c.error_at(
                        place[1],
                        format!("{} {} has the node {tag}, which is not among the nodes", of.name, place[0]),
                    )
                };
                self.listed.position(tag).map(|n| n as usize).ok_or_else(missing)
            };
            let nodes = nodes.iter().map(position).collect::<Result<Vec<usize>>>()?;
            plane.add_element(c, of, (entity, place), nodes)?;
        } else if let Some(kind) = of.cell {
            self.listed.cell(kind, place, kind.topology().gmsh_order, nodes, c)?;
        } else if let Some(kind) = of.facet {
            self.listed.facet(kind, entity, place, nodes);
        }
        Ok(())
    }

    fn physical_names(&mut self, c: &mut Cursor) -> Result<()> {
        // Text in binary files too.
        loop {
            let at = c.pos();
            let Some(line) = c.filled_line()? else {
                return Err(c.error("the file ends here; expected $EndPhysicalNames. It may be truncated"));
            };
            if line == "$EndPhysicalNames" {
                return Ok(());
            }
            if line.bytes().all(|b| b.is_ascii_digit()) {
                continue;
            }
            let mut parts = line.splitn(3, char::is_whitespace);
            let number = |p: Option<&str>| p.and_then(|p| p.parse::<i32>().ok());
            let (dim, tag) = (number(parts.next()), number(parts.next()));
            let name = parts.next().map(str::trim).and_then(|n| n.strip_prefix('"')?.strip_suffix('"'));
            let (Some(dim), Some(tag), Some(name)) = (dim, tag, name) else {
                return Err(c.error_at(
                    at,
                    format!("found {:?}; expected dimension, tag and \"name\" of a physical group", clip(&line)),
                ));
            };
            if !name.is_empty() {
                self.names.insert((dim, tag), name.to_string());
            }
        }
    }
}

/// Allowed kinds of cells, for messages.
fn cells() -> String {
    list(CellKind::ALL.map(|k| (k.topology().name, k.topology().gmsh)))
}

/// Allowed kinds of facets, for messages.
fn facets() -> String {
    list(FacetKind::ALL.map(|k| (k.name(), k.gmsh())))
}

fn list<const N: usize>(kinds: [(&str, i32); N]) -> String {
    kinds.map(|(name, number)| format!("{name} ({number})")).join(", ")
}

/// The beginning of a text, for messages.
fn clip(text: &str) -> String {
    text.chars().take(40).collect()
}
