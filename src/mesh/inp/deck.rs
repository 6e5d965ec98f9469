//! Contents of a deck, part by part, before parts are put in their places.

use super::elements::ElementType;
use super::lines::Place;
use super::Files;
use std::collections::BTreeMap;

/// A part, or what stands outside of parts.
#[derive(Default)]
pub struct DeckPart {
    /// Numbers, places and coordinates of the nodes.
    pub nodes: Vec<u64>,
    pub node_at: Vec<Place>,
    pub coords: Vec<[f64; 3]>,
    pub blocks: Vec<DeckElements>,
    /// Sets by name.
    pub node_sets: BTreeMap<String, Set>,
    pub element_sets: BTreeMap<String, Set>,
    pub surfaces: BTreeMap<String, DeckSurface>,
}

/// Elements of a type.
pub struct DeckElements {
    pub kind: ElementType,
    /// Shells and membranes, which need not lie on the solid elements.
    pub loose: bool,
    /// Their numbers, places, and nodes element by element.
    pub ids: Vec<u32>,
    pub at: Vec<Place>,
    pub nodes: Vec<u32>,
}

/// A set of nodes or elements.
#[derive(Default)]
pub struct Set {
    pub chunks: Vec<Chunk>,
}

/// Entries that one keyword adds to a set.
pub struct Chunk {
    pub at: Place,
    /// The instance whose members they are, of a set of the assembly.
    pub instance: Option<String>,
    /// Runs of numbers that are listed: first and last.
    pub runs: Vec<[u32; 2]>,
    /// First, last and step of numbers that are generated: some may be missing.
    pub generated: Vec<[u32; 3]>,
    /// Other sets.
    pub names: Vec<String>,
    /// Set of elements whose nodes form this set of nodes (`*NSET` with `ELSET`).
    pub nodes_of: Option<String>,
}

impl Chunk {
    pub fn new(at: Place, instance: Option<String>) -> Self {
        Chunk { at, instance, runs: Vec::new(), generated: Vec::new(), names: Vec::new(), nodes_of: None }
    }

    /// Adds a number.
    pub fn push(&mut self, id: u32) {
        match self.runs.last_mut() {
            Some([_, last]) if last.checked_add(1) == Some(id) => *last = id,
            _ => self.runs.push([id, id]),
        }
    }
}

/// A surface.
pub struct DeckSurface {
    /// Given by nodes, not by faces of elements.
    pub nodes: bool,
    /// Element, node or set, the face of the elements from 0 where one is given, and the place.
    pub members: Vec<(String, Option<u8>, Place)>,
}

/// A part in its place.
pub struct Instance {
    pub name: String,
    pub part: usize,
    /// Nodes, elements and sets between *INSTANCE and *END INSTANCE, which are moved with it.
    pub own: DeckPart,
    /// Displacement, in the file's unit; then the two points of the axis that it is turned about, and the angle in
    /// degrees.
    pub shift: [f64; 3],
    pub turn: Option<[f64; 7]>,
}

/// A whole deck.
#[derive(Default)]
pub struct Deck {
    /// Items outside of parts.
    pub top: DeckPart,
    pub parts: Vec<(String, DeckPart)>,
    pub instances: Vec<Instance>,
    pub remarks: Remarks,
}

/// Keywords that were left out and elements that are other ones here, each with its first place.
#[derive(Default)]
pub struct Remarks {
    pub keywords: BTreeMap<String, (Place, usize)>,
    pub elements: BTreeMap<String, (Place, usize)>,
}

impl Remarks {
    /// The remarks in words.
    pub fn said(&self, files: &Files) -> Vec<String> {
        let mut all: Vec<(Place, String)> = Vec::new();
        for (name, &(at, count)) in &self.elements {
            let text = super::elements::remark(name).unwrap_or_default();
            all.push((at, format!("{count} elements {name} {text}")));
        }
        for (name, &(at, count)) in &self.keywords {
            let times = if count > 1 { format!(" ({count} times)") } else { String::new() };
            all.push((at, format!("*{name} is left out{times}: {}", super::keywords::why(name))));
        }
        all.sort();
        all.into_iter().map(|(at, text)| format!("{}: {text}", files.at(at))).collect()
    }
}
