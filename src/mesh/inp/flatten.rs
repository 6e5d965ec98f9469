//! Parts in their places, numbered through; sets and surfaces as groups.

use super::deck::{Chunk, Deck, DeckElements, DeckPart, DeckSurface, Instance, Set};
use super::elements::ElementType;
use super::lines::Place;
use super::parse::quote;
use super::Files;
use crate::mesh::listed::{FileContents, FileOrigin, Index};
use crate::mesh::Facet;
use crate::Result;
use std::collections::HashMap;

/// Sets in sets in sets: no deck goes deeper.
const DEEPEST: usize = 50;
/// Nor does one name its sets more often: sets that double with every level would be read for ever.
const MOST: usize = 100_000;
/// 0, 1, 2, …: the order of the nodes.
const AS_THEY_ARE: [u8; 20] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19];

/// One mesh of all instances.
pub fn flatten(mut deck: Deck, files: &mut Files) -> Result<FileContents> {
    let mut parts: Vec<DeckPart> = Vec::new();
    if deck.instances.is_empty() && deck.parts.len() == 1 {
        let name = deck.parts[0].0.clone();
        deck.instances.push(Instance { name, part: 0, own: DeckPart::default(), shift: [0.0; 3], turn: None });
    }
    if deck.instances.is_empty() && deck.parts.len() > 1 {
        return Err(files.error(
            0,
            format!("{} parts and no instance of one; expected *INSTANCE in an *ASSEMBLY", deck.parts.len()),
        ));
    }
    let instances = std::mem::take(&mut deck.instances);
    for i in &instances {
        parts.push(placed(i, &deck.parts[i.part].1));
    }
    files.parts = instances.iter().map(|i| deck.parts[i.part].0.clone()).collect();
    drop(std::mem::take(&mut deck.parts));
    // What stands outside of parts comes last, and is all there is in a file without any.
    files.instances = instances.into_iter().map(|i| i.name).chain([String::new()]).collect();
    parts.push(deck.top);
    let mut all =
        Flat { listed: FileContents::default(), elements: Index::default(), files, lookups: Default::default() };
    all.nodes(&mut parts)?;
    all.cells(&mut parts)?;
    all.groups(&parts)?;
    Ok(all.listed)
}

/// A copy of a part with what its instance adds, in the place of the instance: moved, then turned about the axis.
fn placed(instance: &Instance, part: &DeckPart) -> DeckPart {
    let put = |x: &[f64; 3]| {
        let moved = [0, 1, 2].map(|c| x[c] + instance.shift[c]);
        match instance.turn {
            Some([ax, ay, az, bx, by, bz, angle]) => {
                crate::mesh::motion::rotated(moved, [ax, ay, az], [bx - ax, by - ay, bz - az], angle.to_radians())
            }
            None => moved,
        }
    };
    let block = |b: &DeckElements| DeckElements {
        kind: b.kind,
        loose: b.loose,
        ids: b.ids.clone(),
        at: b.at.clone(),
        nodes: b.nodes.clone(),
    };
    let chunk = |c: &Chunk| Chunk {
        at: c.at,
        instance: None,
        runs: c.runs.clone(),
        generated: c.generated.clone(),
        names: c.names.clone(),
        nodes_of: c.nodes_of.clone(),
    };
    let surface = |s: &DeckSurface| DeckSurface { nodes: s.nodes, members: s.members.clone() };
    let mut all = DeckPart::default();
    for from in [part, &instance.own] {
        all.nodes.extend(&from.nodes);
        all.node_at.extend(&from.node_at);
        all.coords.extend(from.coords.iter().map(put));
        all.blocks.extend(from.blocks.iter().map(block));
        for (sets, more) in [(&mut all.node_sets, &from.node_sets), (&mut all.element_sets, &from.element_sets)] {
            for (name, set) in more {
                sets.entry(name.clone()).or_default().chunks.extend(set.chunks.iter().map(chunk));
            }
        }
        all.surfaces.extend(from.surfaces.iter().map(|(n, s)| (n.clone(), surface(s))));
    }
    all
}

/// Nodes, or elements.
#[derive(Clone, Copy, PartialEq)]
enum What {
    Nodes,
    Elements,
}

struct Flat<'f> {
    listed: FileContents,
    /// Positions of the elements by their numbers: cells, then facets.
    elements: Index,
    files: &'f Files,
    /// How often a set was looked up by its name.
    lookups: std::cell::Cell<usize>,
}

/// The number of something of an instance.
fn tag(instance: usize, id: u32) -> u64 {
    (instance as u64) << 32 | u64::from(id)
}

impl Flat<'_> {
    fn nodes(&mut self, parts: &mut [DeckPart]) -> Result<()> {
        if let [part] = parts {
            // Nothing is copied of a mesh that has no parts.
            self.listed.tags = std::mem::take(&mut part.nodes);
            self.listed.node_at = std::mem::take(&mut part.node_at);
            self.listed.coords = std::mem::take(&mut part.coords);
        } else {
            for (i, part) in parts.iter_mut().enumerate() {
                self.listed.tags.extend(part.nodes.iter().map(|&id| tag(i, id as u32)));
                self.listed.node_at.append(&mut part.node_at);
                self.listed.coords.append(&mut part.coords);
            }
        }
        self.listed.number(self.files)
    }

    fn cells(&mut self, parts: &mut [DeckPart]) -> Result<()> {
        for (i, part) in parts.iter_mut().enumerate() {
            for block in std::mem::take(&mut part.blocks) {
                let n = block.kind.nodes();
                let mut nodes = vec![0u64; n];
                for ((&id, &at), from) in block.ids.iter().zip(&block.at).zip(block.nodes.chunks_exact(n)) {
                    nodes.iter_mut().zip(from).for_each(|(to, &id)| *to = tag(i, id));
                    let place = [tag(i, id), at];
                    match block.kind {
                        ElementType::Cell(kind) => {
                            self.listed.cell(kind, place, &AS_THEY_ARE[..n], &nodes, self.files)?
                        }
                        ElementType::Facet(kind) => {
                            self.listed.facet(kind, -1, place, &nodes);
                            if let Some(facet) = self.listed.facets.last_mut() {
                                facet.loose = block.loose;
                            }
                        }
                        ElementType::Line(_) => {}
                    }
                }
            }
        }
        if self.listed.cells.is_empty() {
            let expected = super::elements::solids();
            return Err(self.files.error(0, format!("no solid elements; expected some of {expected}")));
        }
        let tags: Vec<u64> =
            self.listed.cell_tags.iter().copied().chain(self.listed.facets.iter().map(|f| f.tag)).collect();
        self.elements = Index::new(&tags).map_err(|p| {
            let cells = self.listed.cells.len();
            let at = if p < cells { self.listed.cell_at[p] } else { self.listed.facets[p - cells].at };
            self.files.error(at, format!("a second element {}; expected one", self.files.number(tags[p])))
        })?;
        Ok(())
    }

    /// Surfaces first, then sets of facets, then sets of nodes. Surfaces that cannot be understood are errors.
    fn groups(&mut self, parts: &[DeckPart]) -> Result<()> {
        let mut facets: HashMap<usize, Vec<String>> = HashMap::new();
        let mut named = std::collections::BTreeSet::new();
        for (i, part) in parts.iter().enumerate() {
            for (name, surface) in &part.surfaces {
                let name = &self.files.scoped(i, name);
                named.insert(name.clone());
                self.surface(parts, i, (name, surface), &mut facets)?;
            }
        }
        for (i, part) in parts.iter().enumerate() {
            let sets = part.element_sets.iter().map(|(n, s)| (self.files.scoped(i, n), s));
            for (name, set) in sets.filter(|(n, _)| !named.contains(n)) {
                let name = &name;
                for e in self.members(parts, i, What::Elements, set, 0)? {
                    if let Some(facet) = (e as usize).checked_sub(self.listed.cells.len()) {
                        add(&mut facets, facet, name);
                    }
                }
            }
        }
        named.extend(facets.values().flatten().cloned());
        // Facets in the same groups are on one surface.
        let mut surfaces: HashMap<Vec<String>, i32> = HashMap::new();
        for (facet, groups) in facets {
            let next = surfaces.len() as i32;
            self.listed.facets[facet].surface = *surfaces.entry(groups).or_insert(next);
        }
        self.listed.surfaces.extend(surfaces.into_iter().map(|(groups, number)| (number, groups)));
        for (i, part) in parts.iter().enumerate() {
            let sets = part.node_sets.iter().map(|(n, s)| (self.files.scoped(i, n), s));
            for (name, set) in sets.filter(|(n, _)| !named.contains(n)) {
                let nodes = self.members(parts, i, What::Nodes, set, 0)?;
                self.node_set(&name, nodes);
            }
        }
        Ok(())
    }

    /// Adds nodes to the set `name`.
    fn node_set(&mut self, name: &str, nodes: Vec<u32>) {
        match self.listed.node_sets.iter_mut().find(|s| s.0 == name) {
            Some((_, there)) => there.extend(nodes),
            None => self.listed.node_sets.push((name.to_string(), nodes)),
        }
    }

    fn surface(
        &mut self,
        parts: &[DeckPart],
        i: usize,
        (name, surface): (&str, &DeckSurface),
        facets: &mut HashMap<usize, Vec<String>>,
    ) -> Result<()> {
        let cells = self.listed.cells.len();
        for (member, face, at) in &surface.members {
            let what = if surface.nodes { What::Nodes } else { What::Elements };
            let mut chunk = Chunk::new(*at, None);
            match member.parse() {
                Ok(id) => chunk.push(id),
                Err(_) => chunk.names.push(member.clone()),
            }
            let members = self.members(parts, i, what, &Set { chunks: vec![chunk] }, 0)?;
            if surface.nodes {
                self.node_set(name, members);
                continue;
            }
            let mut free = Vec::new();
            for e in members {
                if let Some(facet) = (e as usize).checked_sub(cells) {
                    add(facets, facet, name);
                    continue;
                }
                let kind = self.listed.cells.get(e as usize).kind;
                match face {
                    Some(f) if (*f as usize) < kind.faces().len() => {
                        self.listed.faces.push((name.to_string(), Facet { cell: e, face: *f }));
                    }
                    Some(f) => {
                        let element = self.files.number(self.listed.cell_tags[e as usize]);
                        let text = format!(
                            "the face S{} of the element {element}, a {}, which has none",
                            f + 1,
                            kind.topology().name
                        );
                        return Err(self.files.error(*at, text));
                    }
                    None => free.extend((0..kind.faces().len() as u8).map(|face| Facet { cell: e, face })),
                }
            }
            // Without a face it is all that is on the boundary.
            let sharing = self.listed.cells.sharing(&free);
            let boundary = free.into_iter().zip(sharing).filter(|f| f.1 == 1);
            self.listed.faces.extend(boundary.map(|(f, _)| (name.to_string(), f)));
        }
        Ok(())
    }

    /// Positions of the members of a set of the part `i`, ascending.
    fn members(&self, parts: &[DeckPart], i: usize, what: What, set: &Set, depth: usize) -> Result<Vec<u32>> {
        let mut all = Vec::new();
        for chunk in &set.chunks {
            let i = match &chunk.instance {
                None => i,
                Some(name) => self.instance(name, chunk.at)?,
            };
            let title = if what == What::Nodes { "node" } else { "element" };
            for &[first, last] in &chunk.runs {
                for id in first..=last {
                    // Elements that are left out are in sets too.
                    match self.find(i, what, id) {
                        Some(p) => all.push(p),
                        None if what == What::Elements => {}
                        None => {
                            return Err(self
                                .files
                                .error(chunk.at, format!("{title} {id}, which is not there, in a set")))
                        }
                    }
                }
            }
            for &[first, last, step] in &chunk.generated {
                self.generated(i, what, [first, last, step], &mut all);
            }
            for name in &chunk.names {
                all.extend(self.named(parts, i, what, (name, chunk.at), depth)?);
            }
            if let Some(name) = &chunk.nodes_of {
                for element in self.named(parts, i, What::Elements, (name, chunk.at), depth)? {
                    if element as usize >= self.listed.cells.len() {
                        let text = format!(
                            "*NSET with ELSET={}, a set with shells or membranes; expected one of solid elements, or \
                             the nodes of the set",
                            name
                        );
                        return Err(self.files.error(chunk.at, text));
                    }
                    all.extend(self.listed.cells.get(element as usize).nodes);
                }
            }
        }
        all.sort_unstable();
        all.dedup();
        Ok(all)
    }

    fn find(&self, i: usize, what: What, id: u32) -> Option<u32> {
        match what {
            What::Nodes => self.listed.position(tag(i, id)),
            What::Elements => self.elements.get(tag(i, id)),
        }
    }

    /// The members that there are among numbers that are generated.
    fn generated(&self, i: usize, what: What, [first, last, step]: [u32; 3], all: &mut Vec<u32>) {
        if ((last - first) / step) as usize <= self.listed.tags.len() {
            let ids = (first..=last).step_by(step as usize);
            all.extend(ids.filter_map(|id| self.find(i, what, id)));
            return;
        }
        let take = |p: usize, t: u64| {
            let (instance, id) = ((t >> 32) as usize, t as u32);
            (instance == i && (first..=last).contains(&id) && (id - first) % step == 0).then_some(p as u32)
        };
        let cells = self.listed.cell_tags.iter().chain(self.listed.facets.iter().map(|f| &f.tag));
        match what {
            What::Nodes => all.extend(self.listed.tags.iter().enumerate().filter_map(|(p, &t)| take(p, t))),
            What::Elements => all.extend(cells.enumerate().filter_map(|(p, &t)| take(p, t))),
        }
    }

    /// Members of the set `name` of the part `i`: a set of that part, of the assembly, or `instance.set`.
    fn named(
        &self,
        parts: &[DeckPart],
        i: usize,
        what: What,
        (name, at): (&str, Place),
        depth: usize,
    ) -> Result<Vec<u32>> {
        let title = if what == What::Nodes { "node set" } else { "element set" };
        let lookups = self.lookups.replace(self.lookups.get() + 1);
        if depth > DEEPEST || lookups > MOST {
            return Err(self.files.error(
                at,
                format!("{title}s within {title}s more than {DEEPEST} deep or {MOST} times: do they hold each other?"),
            ));
        }
        let sets = |p: &'_ usize| match what {
            What::Nodes => &parts[*p].node_sets,
            What::Elements => &parts[*p].element_sets,
        };
        if let Some(set) = sets(&i).get(name) {
            return self.members(parts, i, what, set, depth + 1);
        }
        if let Some((instance, rest)) = name.split_once('.') {
            let i = self.instance(instance, at)?;
            return match rest.parse() {
                Ok(id) => {
                    let mut chunk = Chunk::new(at, None);
                    chunk.push(id);
                    self.members(parts, i, what, &Set { chunks: vec![chunk] }, depth + 1)
                }
                Err(_) => self.named(parts, i, what, (rest, at), depth + 1),
            };
        }
        Err(self.files.error(at, format!("no {title} {}", quote(name))))
    }

    fn instance(&self, name: &str, at: Place) -> Result<usize> {
        self.files.instances.iter().position(|n| n == name).ok_or_else(|| {
            let there = self.files.instances.iter().filter(|n| !n.is_empty()).cloned().collect::<Vec<_>>().join(", ");
            self.files.error(at, format!("no instance {}; expected one of: {there}", quote(name)))
        })
    }
}

fn add(facets: &mut HashMap<usize, Vec<String>>, facet: usize, name: &str) {
    let groups = facets.entry(facet).or_default();
    if !groups.iter().any(|g| g == name) {
        groups.push(name.to_string());
    }
}
