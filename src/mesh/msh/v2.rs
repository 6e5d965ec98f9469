//! Nodes and elements of an MSH 2.2 file.

use super::cursor::Cursor;
use super::sections::RawSections;
use crate::Result;
use std::collections::HashSet;

impl RawSections {
    /// Reads `$Nodes`, or `$ParametricNodes` (Mesh.SaveParametric), where dimension and number of the entity follow,
    /// and one parameter on a curve, two on a surface.
    pub fn nodes_2(&mut self, c: &mut Cursor, parametric: bool) -> Result<()> {
        let total = c.line_count("the number of nodes")?;
        // A wrong count must not reserve memory that the file cannot fill.
        let room = (total as usize).min(c.left() / 8);
        self.listed.reserve_nodes(room);
        for _ in 0..total {
            let (at, tag) = (c.pos(), c.tag("a node tag")?);
            let coords = [c.double("a coordinate")?, c.double("a coordinate")?, c.double("a coordinate")?];
            self.listed.node(tag, at, coords);
            if parametric {
                let dim = c.int("the dimension of the entity of a node")?;
                c.int("the entity of a node")?;
                for _ in 0..if matches!(dim, 1 | 2) { dim } else { 0 } {
                    c.double("a parameter of a node")?;
                }
            }
            c.end_of_line("the coordinates of a node")?;
        }
        c.expect(if parametric { "$EndParametricNodes" } else { "$EndNodes" })
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
                    format!(
                        "{together} elements of type {kind} with {labels} tags each, behind {done} of \
                     {total}; expected a valid head"
                    ),
                ));
            }
            let mut nodes = Vec::new();
            for k in 0..together {
                let at = if k == 0 { at } else { c.pos() };
                if c.binary {
                    tag = c.tag("an element number")?;
                }
                let mut group = 0;
                for l in 0..labels {
                    let label = c.int("a tag of an element")?;
                    if l == 0 {
                        // A negative one reverses the orientation, which is found from the cells here.
                        group = label.saturating_abs();
                    }
                }
                if group != 0 {
                    self.surfaces.entry(group).or_insert_with(|| vec![group]);
                    self.curves.entry(group).or_insert_with(|| vec![group]);
                }
                let wanted = self.element_type(c, at, kind, group)?;
                nodes.resize(wanted.nodes, 0);
                for node in &mut nodes {
                    *node = c.tag("a node of an element")?;
                }
                if wanted.dim == 3 {
                    volumes.insert(group);
                }
                self.add_element(c, &wanted, group, [tag, at], &nodes)?;
                c.end_of_line("an element")?;
            }
            done += together;
        }
        if volumes.len() > 1 {
            self.listed.keep_first();
        }
        c.expect("$EndElements")
    }
}
