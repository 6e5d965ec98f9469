//! Sections of an MSH file.

use super::cursor::Cursor;
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

/// What a file holds, as read; nodes by their tags in the file.
#[derive(Default)]
pub(super) struct Raw {
    pub names: HashMap<(i32, i32), String>,
    /// Physical groups of each surface.
    pub surfaces: HashMap<i32, Vec<i32>>,
    pub tags: Vec<u64>,
    pub coords: Vec<[f64; 3]>,
    pub cell_blocks: Vec<CellBlock>,
    pub facets: Vec<Facet>,
    seen: [bool; 3],
    /// Places of `$Nodes` and `$Elements`, for errors about their content.
    pub nodes_at: usize,
    pub elements_at: usize,
}

/// Cells of one kind.
pub(super) struct CellBlock {
    pub kind: CellKind,
    pub tags: Vec<u64>,
    /// Nodes in Gmsh's order, cell by cell.
    pub nodes: Vec<u64>,
}

/// A facet on a surface of the model.
pub(super) struct Facet {
    pub kind: FacetKind,
    pub surface: i32,
    pub tag: u64,
    /// Tags of its corners, the first `kind.corners()` of these.
    pub corners: [u64; 4],
}

const FORMAT: usize = 0;
const NODES: usize = 1;
const ELEMENTS: usize = 2;

impl Raw {
    /// Kind, tag and nodes in Gmsh's order of every cell.
    pub fn cells(&self) -> impl Iterator<Item = (CellKind, u64, &[u64])> {
        self.cell_blocks.iter().flat_map(|b| {
            b.tags.iter().zip(b.nodes.chunks_exact(b.kind.nodes())).map(|(&tag, nodes)| (b.kind, tag, nodes))
        })
    }

    /// Reads all sections.
    pub fn sections(&mut self, c: &mut Cursor) -> Result<()> {
        loop {
            let at = c.pos();
            let Some(line) = c.filled_line() else { break };
            if !self.seen[FORMAT] && line != "$MeshFormat" {
                return Err(
                    c.error_at(at, format!("found {:?}; expected $MeshFormat: not a Gmsh MSH file", clip(&line)))
                );
            }
            match line.as_str() {
                "$MeshFormat" => self.format(c)?,
                "$PhysicalNames" => self.physical_names(c)?,
                "$Entities" => self.entities(c)?,
                "$Nodes" => {
                    self.nodes_at = at;
                    self.nodes(c)?;
                }
                "$Elements" => {
                    self.elements_at = at;
                    self.elements(c)?;
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
        Ok(())
    }

    fn once(&mut self, c: &Cursor, section: usize, name: &str) -> Result<()> {
        if std::mem::replace(&mut self.seen[section], true) {
            return Err(c.error(format!("a second section {name}; expected one")));
        }
        Ok(())
    }

    fn format(&mut self, c: &mut Cursor) -> Result<()> {
        self.once(c, FORMAT, "$MeshFormat")?;
        let at = c.pos();
        let line = c.line().unwrap_or_default();
        let words: Vec<&str> = line.split_whitespace().collect();
        let [version, kind, size] = words[..] else {
            return Err(c.error_at(
                at,
                format!("found {:?}; expected version, file type and data size, such as \"4.1 0 8\"", clip(&line)),
            ));
        };
        if version != "4.1" {
            return Err(c.error_at(
                at,
                format!(
                    "MSH version {:?}; expected 4.1: save with Mesh.MshFileVersion = 4.1 or gmsh -format msh41",
                    clip(version)
                ),
            ));
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

    fn physical_names(&mut self, c: &mut Cursor) -> Result<()> {
        // Text in binary files too.
        loop {
            let at = c.pos();
            let Some(line) = c.filled_line() else {
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

    fn entities(&mut self, c: &mut Cursor) -> Result<()> {
        let mut counts = [0u64; 4];
        for n in &mut counts {
            *n = c.size("the number of entities")?;
        }
        for (dim, &n) in counts.iter().enumerate() {
            for _ in 0..n {
                let tag = c.int("the tag of an entity")?;
                for _ in 0..if dim == 0 { 3 } else { 6 } {
                    c.double("the extent of an entity")?;
                }
                let groups = c.size("the number of physical groups of an entity")?;
                for _ in 0..groups {
                    let group = c.int("the tag of a physical group")?;
                    if dim == 2 {
                        // A negative tag reverses the orientation, which is found from the cells here.
                        self.surfaces.entry(tag).or_default().push(group.saturating_abs());
                    }
                }
                if dim > 0 {
                    for _ in 0..c.size("the number of bounding entities")? {
                        c.int("the tag of a bounding entity")?;
                    }
                }
            }
        }
        c.expect("$EndEntities")
    }

    fn nodes(&mut self, c: &mut Cursor) -> Result<()> {
        self.once(c, NODES, "$Nodes")?;
        let at = c.pos();
        let [blocks, total] = [c.size("the number of node blocks")?, c.size("the number of nodes")?];
        c.size("the smallest node tag")?;
        c.size("the largest node tag")?;
        // A wrong count must not reserve memory that the file cannot fill.
        let room = (total as usize).min(c.left() / 8);
        self.tags.reserve(room);
        self.coords.reserve(room);
        for _ in 0..blocks {
            let dim = c.int("the dimension of a node block")?;
            c.int("the entity of a node block")?;
            let parametric = c.int("the parametric flag of a node block")?;
            let n = c.size("the number of nodes of a block")?;
            let parameters = if parametric != 0 { dim.clamp(0, 3) } else { 0 };
            for _ in 0..n {
                self.tags.push(c.size("a node tag")?);
                c.end_of_line("a node tag")?;
            }
            for _ in 0..n {
                self.coords.push([c.double("a coordinate")?, c.double("a coordinate")?, c.double("a coordinate")?]);
                for _ in 0..parameters {
                    c.double("a node parameter")?;
                }
                c.end_of_line("the coordinates of a node")?;
            }
        }
        if self.tags.len() as u64 != total {
            return Err(c.error_at(at, format!("{total} nodes announced, {} found", self.tags.len())));
        }
        c.expect("$EndNodes")
    }

    fn elements(&mut self, c: &mut Cursor) -> Result<()> {
        self.once(c, ELEMENTS, "$Elements")?;
        let start = c.pos();
        let [blocks, total] = [c.size("the number of element blocks")?, c.size("the number of elements")?];
        c.size("the smallest element tag")?;
        c.size("the largest element tag")?;
        let mut count = 0u64;
        for _ in 0..blocks {
            let at = c.pos();
            let dim = c.int("the dimension of an element block")?;
            let entity = c.int("the entity of an element block")?;
            let kind = c.int("the type of an element block")?;
            let n = c.size("the number of elements of a block")?;
            let Some(&(_, nodes, type_dim, name)) = TYPES.iter().find(|t| t.0 == kind) else {
                return Err(c.error_at(
                    at,
                    format!("element type {kind}; expected {} (and {} on the boundary)", cells(), facets()),
                ));
            };
            if type_dim != dim {
                return Err(c.error_at(
                    at,
                    format!(
                        "a block of {name} elements in an entity of dimension {dim}; expected dimension {type_dim}"
                    ),
                ));
            }
            let cell = CellKind::of_gmsh(kind);
            if dim == 3 && cell.is_none() {
                return Err(c.error_at(at, format!("{n} elements of type {kind}, {name}; expected {}", cells())));
            }
            let facet = FacetKind::ALL.into_iter().find(|f| f.gmsh() == kind);
            if dim == 2 && facet.is_none() && self.surfaces.contains_key(&entity) {
                return Err(c.error_at(
                    at,
                    format!(
                        "{n} elements of type {kind}, {name}, in a physical group; expected {} on the boundary",
                        facets()
                    ),
                ));
            }
            count = count.saturating_add(n);
            // A wrong count must not reserve memory that the file cannot fill.
            let room = (n as usize).min(c.left() / (2 * (nodes + 1)));
            let (mut tags, mut cell_nodes) = (Vec::new(), Vec::new());
            if cell.is_some() {
                tags.reserve(room);
                cell_nodes.reserve(room * nodes);
            }
            for _ in 0..n {
                let tag = c.size("an element tag")?;
                if cell.is_some() {
                    tags.push(tag);
                    for _ in 0..nodes {
                        cell_nodes.push(c.size("a node tag of an element")?);
                    }
                } else {
                    let mut corners = [0; 4];
                    for k in 0..nodes {
                        let node = c.size("a node tag of an element")?;
                        if let Some(corner) = corners.get_mut(k) {
                            *corner = node;
                        }
                    }
                    if let Some(kind) = facet {
                        self.facets.push(Facet { kind, surface: entity, tag, corners });
                    }
                }
                c.end_of_line("an element")?;
            }
            if let (Some(kind), false) = (cell, tags.is_empty()) {
                self.cell_blocks.push(CellBlock { kind, tags, nodes: cell_nodes });
            }
        }
        if count != total {
            return Err(c.error_at(start, format!("{total} elements announced, {count} found")));
        }
        c.expect("$EndElements")
    }
}

/// What cells there may be, for messages.
fn cells() -> String {
    list(CellKind::ALL.map(|k| (k.topology().name, k.topology().gmsh)))
}

/// What facets there may be, for messages.
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
