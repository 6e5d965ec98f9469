//! Gmsh MSH 4.1 reader, ASCII and binary: 8-node hexahedra and the physical groups of their boundary quadrilaterals.
//!
//! Format: Gmsh reference manual, "MSH file format". Every error names the file and the line (ASCII) or byte offset (binary).

use super::cursor::Cursor;
use super::joined::FACES;
use super::quality::jacobian_range;
use super::Mesh;
use crate::{Error, Result};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

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
const QUADRILATERAL: i32 = 3;
const HEXAHEDRON: i32 = 5;

/// Two nodes nearer than this part of the mesh's extent are taken for one that was not merged.
const COINCIDENT: f64 = 1e-10;

/// Reads a mesh from the file at `path`. Lengths in the file are in m. An upper body's mesh lies at z > 0 and is reflected by the caller
/// ([`Mesh::reflected`]).
pub fn read(path: &Path) -> Result<Mesh> {
    let name = path.display().to_string();
    let data = std::fs::read(path)
        .map_err(|e| Error::Input(format!("mesh file {name} cannot be read: {e}; expected a Gmsh MSH 4.1 file")))?;
    parse(&data, &name)
}

/// Reads a mesh from the bytes of a file; `name` stands in messages.
pub fn parse(data: &[u8], name: &str) -> Result<Mesh> {
    let mut raw = Raw::default();
    let mut cursor = Cursor::new(data, name);
    raw.sections(&mut cursor)?;
    raw.mesh(&cursor, name)
}

/// Checks that `mesh`, from `source`, has the facet group `group`; the error names those it has.
pub fn require_group(mesh: &Mesh, group: &str, source: &str) -> Result<()> {
    if mesh.groups.get(group).is_some_and(|facets| !facets.is_empty()) {
        return Ok(());
    }
    let found: Vec<String> =
        mesh.groups.iter().filter(|(_, facets)| !facets.is_empty()).map(|(name, _)| format!("\"{name}\"")).collect();
    let found = if found.is_empty() { "none".to_string() } else { found.join(", ") };
    Err(Error::Input(format!(
        "{source} has no group \"{group}\" of boundary quadrilaterals; found: {found}. Name the surface as a physical group in Gmsh"
    )))
}

/// A block of elements as read: tag and nodes (as node tags at first) of each.
#[derive(Default)]
struct Raw {
    names: HashMap<(i32, i32), String>,
    /// Physical groups of each surface.
    surfaces: HashMap<i32, Vec<i32>>,
    tags: Vec<u64>,
    coords: Vec<[f64; 3]>,
    cells: Vec<[u64; 8]>,
    cell_tags: Vec<u64>,
    facets: Vec<Facet>,
    seen: [bool; 3],
    /// Places of `$Nodes` and `$Elements`, for errors about their content.
    nodes_at: usize,
    elements_at: usize,
}

struct Facet {
    surface: i32,
    tag: u64,
    nodes: [u64; 4],
}

const FORMAT: usize = 0;
const NODES: usize = 1;
const ELEMENTS: usize = 2;

impl Raw {
    fn sections(&mut self, c: &mut Cursor) -> Result<()> {
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
                        // A negative tag reverses the orientation, which is found from the hexahedra here.
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
                return Err(c.error_at(at, format!("element type {kind}; only 8-node hexahedra (type 5) and 4-node quadrilaterals on their boundary (3) are supported")));
            };
            if type_dim != dim {
                return Err(c.error_at(
                    at,
                    format!(
                        "a block of {name} elements in an entity of dimension {dim}; expected dimension {type_dim}"
                    ),
                ));
            }
            if dim == 3 && kind != HEXAHEDRON {
                return Err(c.error_at(
                    at,
                    format!("{n} elements of type {kind}, {name}; only 8-node hexahedra are supported"),
                ));
            }
            if dim == 2 && kind != QUADRILATERAL && self.surfaces.contains_key(&entity) {
                return Err(c.error_at(
                    at,
                    format!("{n} elements of type {kind}, {name}, in a physical group; only 4-node quadrilaterals are supported on the boundary"),
                ));
            }
            count = count.saturating_add(n);
            if kind == HEXAHEDRON {
                let room = (n as usize).min(c.left() / 18);
                self.cells.reserve(room);
                self.cell_tags.reserve(room);
            }
            for _ in 0..n {
                let tag = c.size("an element tag")?;
                match kind {
                    HEXAHEDRON => {
                        let mut cell = [0; 8];
                        for node in &mut cell {
                            *node = c.size("a node tag of a hexahedron")?;
                        }
                        self.cells.push(cell);
                        self.cell_tags.push(tag);
                    }
                    QUADRILATERAL => {
                        let mut facet = [0; 4];
                        for node in &mut facet {
                            *node = c.size("a node tag of a quadrilateral")?;
                        }
                        self.facets.push(Facet { surface: entity, tag, nodes: facet });
                    }
                    _ => {
                        for _ in 0..nodes {
                            c.size("a node tag of an element")?;
                        }
                    }
                }
                c.end_of_line("an element")?;
            }
        }
        if count != total {
            return Err(c.error_at(start, format!("{total} elements announced, {count} found")));
        }
        c.expect("$EndElements")
    }

    /// Checks what was read and makes the mesh of it; nodes keep their order, unused ones are dropped.
    fn mesh(self, c: &Cursor, name: &str) -> Result<Mesh> {
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

/// The beginning of a text, for messages.
fn clip(text: &str) -> String {
    text.chars().take(40).collect()
}
