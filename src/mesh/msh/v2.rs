//! Nodes and elements of an MSH 2.2 file.

use super::cursor::Cursor;
use super::sections::{CellBlock, Raw};
use crate::Result;
use std::collections::HashSet;

impl Raw {
    /// Reads `$Nodes`.
    pub fn nodes_2(&mut self, c: &mut Cursor) -> Result<()> {
        let total = c.line_count("the number of nodes")?;
        // A wrong count must not reserve memory that the file cannot fill.
        let room = (total as usize).min(c.left() / 8);
        self.tags.reserve(room);
        self.coords.reserve(room);
        for _ in 0..total {
            self.tags.push(c.tag("a node tag")?);
            self.coords.push([c.double("a coordinate")?, c.double("a coordinate")?, c.double("a coordinate")?]);
            c.end_of_line("the coordinates of a node")?;
        }
        c.expect("$EndNodes")
    }

    /// Reads `$Elements`. An element has its physical group with it; one in several groups occurs several times.
    pub fn elements_2(&mut self, c: &mut Cursor) -> Result<()> {
        let total = c.line_count("the number of elements")?;
        let mut volumes = HashSet::new();
        let mut done = 0u64;
        while done < total {
            let at = c.pos();
            // In binary files elements of a type come together, with one head for all.
            let mut tag = if c.binary { 0 } else { c.tag("an element number")? };
            let kind = c.int("an element type")?;
            let together = if c.binary { c.tag("the number of elements of a type")? } else { 1 };
            let labels = c.int("the number of tags of an element")?;
            if together == 0 || together > total - done || !(0..=1000).contains(&labels) {
                return Err(c.error_at(
                    at,
                    format!("{together} elements of type {kind} with {labels} tags each, behind {done} of {total}; expected a valid head"),
                ));
            }
            let mut nodes = Vec::new();
            for _ in 0..together {
                if c.binary {
                    tag = c.tag("an element number")?;
                }
                let mut group = 0;
                for k in 0..labels {
                    let label = c.int("a tag of an element")?;
                    if k == 0 {
                        // A negative one reverses the orientation, which is found from the cells here.
                        group = label.saturating_abs();
                    }
                }
                if group != 0 {
                    self.surfaces.entry(group).or_insert_with(|| vec![group]);
                }
                let wanted = self.element_type(c, at, kind, group)?;
                nodes.resize(wanted.nodes, 0);
                for node in &mut nodes {
                    *node = c.tag("a node of an element")?;
                }
                if wanted.dim == 3 {
                    volumes.insert(group);
                }
                self.take(&wanted, group, tag, &nodes);
                c.end_of_line("an element")?;
            }
            done += together;
        }
        if volumes.len() > 1 {
            self.keep_first();
        }
        c.expect("$EndElements")
    }

    /// Drops cells that occurred before with the same nodes.
    fn keep_first(&mut self) {
        let mut seen = HashSet::new();
        for block in std::mem::take(&mut self.cell_blocks) {
            let mut kept = CellBlock { kind: block.kind, tags: Vec::new(), nodes: Vec::new() };
            for (&tag, nodes) in block.tags.iter().zip(block.nodes.chunks_exact(block.kind.nodes())) {
                if seen.insert(nodes.to_vec()) {
                    kept.tags.push(tag);
                    kept.nodes.extend_from_slice(nodes);
                }
            }
            self.cell_blocks.push(kept);
        }
    }
}
