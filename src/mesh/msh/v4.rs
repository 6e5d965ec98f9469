//! Nodes, elements and entities of an MSH 4.1 file.

use super::cursor::Cursor;
use super::sections::RawSections;
use crate::Result;

impl RawSections {
    /// Reads `$Entities`.
    pub fn entities(&mut self, c: &mut Cursor) -> Result<()> {
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
                    // A negative tag reverses the orientation, which is found from the cells here.
                    match dim {
                        1 => self.curves.entry(tag).or_default().push(group.saturating_abs()),
                        2 => self.surfaces.entry(tag).or_default().push(group.saturating_abs()),
                        _ => {}
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

    /// Reads `$PartitionedEntities`: the entities that elements of a partitioned mesh are in. One has the groups that
    /// it lists, and those of the entity that it is a part of.
    pub fn partitioned_entities(&mut self, c: &mut Cursor) -> Result<()> {
        c.size("the number of partitions")?;
        for _ in 0..c.size("the number of ghost entities")? {
            c.int("the tag of a ghost entity")?;
            c.int("the partition of a ghost entity")?;
        }
        let mut counts = [0u64; 4];
        for n in &mut counts {
            *n = c.size("the number of partitioned entities")?;
        }
        let mut found: Vec<(i32, i32, Vec<i32>)> = Vec::new();
        for (dim, &n) in (0i32..).zip(&counts) {
            for _ in 0..n {
                let tag = c.int("the tag of an entity")?;
                let parent = [c.int("the dimension of a parent entity")?, c.int("the tag of a parent entity")?];
                for _ in 0..c.size("the number of partitions of an entity")? {
                    c.int("a partition of an entity")?;
                }
                for _ in 0..if dim == 0 { 3 } else { 6 } {
                    c.double("the extent of an entity")?;
                }
                let mut groups = Vec::new();
                for _ in 0..c.size("the number of physical groups of an entity")? {
                    groups.push(c.int("the tag of a physical group")?.saturating_abs());
                }
                if dim > 0 {
                    for _ in 0..c.size("the number of bounding entities")? {
                        c.int("the tag of a bounding entity")?;
                    }
                }
                let of_parents = match dim {
                    1 => Some(&self.curves),
                    2 => Some(&self.surfaces),
                    _ => None,
                };
                if let Some(of_parents) = of_parents {
                    if parent[0] == dim {
                        groups.extend(of_parents.get(&parent[1]).into_iter().flatten());
                    }
                    groups.sort_unstable();
                    groups.dedup();
                    found.push((dim, tag, groups));
                }
            }
        }
        // Tags of partitioned entities are those of no entity of the model.
        for (dim, tag, groups) in found.into_iter().filter(|f| !f.2.is_empty()) {
            let all = if dim == 1 { &mut self.curves } else { &mut self.surfaces };
            all.insert(tag, groups);
        }
        c.expect("$EndPartitionedEntities")
    }

    /// Reads `$Nodes`.
    pub fn nodes_4(&mut self, c: &mut Cursor) -> Result<()> {
        let at = c.pos();
        let [blocks, total] = [c.size("the number of node blocks")?, c.size("the number of nodes")?];
        c.size("the smallest node tag")?;
        c.size("the largest node tag")?;
        // A wrong count must not reserve memory that the file cannot fill.
        let room = (total as usize).min(c.left() / 8);
        self.listed.reserve_nodes(room);
        for _ in 0..blocks {
            let dim = c.int("the dimension of a node block")?;
            c.int("the entity of a node block")?;
            let parametric = c.int("the parametric flag of a node block")?;
            let n = c.size("the number of nodes of a block")?;
            let parameters = if parametric != 0 { dim.clamp(0, 3) } else { 0 };
            for _ in 0..n {
                let at = c.pos();
                self.listed.tags.push(c.size("a node tag")?);
                self.listed.node_at.push(at);
                c.end_of_line("a node tag")?;
            }
            for _ in 0..n {
                let coords = [c.double("a coordinate")?, c.double("a coordinate")?, c.double("a coordinate")?];
                self.listed.coords.push(coords);
                for _ in 0..parameters {
                    c.double("a node parameter")?;
                }
                c.end_of_line("the coordinates of a node")?;
            }
        }
        if self.listed.tags.len() as u64 != total {
            return Err(c.error_at(at, format!("{total} nodes announced, {} found", self.listed.tags.len())));
        }
        c.expect("$EndNodes")
    }

    /// Reads `$Elements`.
    pub fn elements_4(&mut self, c: &mut Cursor) -> Result<()> {
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
            let wanted = self.element_type(c, at, kind, entity)?;
            if wanted.dim != dim {
                return Err(c.error_at(
                    at,
                    format!(
                        "a block of {} elements in an entity of dimension {dim}; expected dimension {}",
                        wanted.name, wanted.dim
                    ),
                ));
            }
            count = count.saturating_add(n);
            let mut nodes = vec![0; wanted.nodes];
            for _ in 0..n {
                let (at, tag) = (c.pos(), c.size("an element tag")?);
                for node in &mut nodes {
                    *node = c.size("a node tag of an element")?;
                }
                self.add_element(c, &wanted, entity, [tag, at], &nodes)?;
                c.end_of_line("an element")?;
            }
        }
        if count != total {
            return Err(c.error_at(start, format!("{total} elements announced, {count} found")));
        }
        c.expect("$EndElements")
    }
}
