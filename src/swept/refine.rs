//! A section made finer where that is wanted: triangles are halved along their longest edge, neighbours first where
//! theirs is longer (M.-C. Rivara, Int. J. Numer. Meth. Eng. 20 (1984) 745); quadrilaterals in the way become two
//! triangles.

use super::{CrossSection, SectionCell, SectionElement};
use std::collections::BTreeMap;

/// The section with no edge in an element longer than `wanted`, m, at the element's middle (r, y).
pub(super) fn refined(section: CrossSection, wanted: impl Fn([f64; 2]) -> f64) -> CrossSection {
    let mut work = Work::of(section);
    // With whether it is halved whatever its size.
    let mut open: Vec<(usize, bool)> = (0..work.elements.len()).map(|k| (k, false)).collect();
    while let Some((k, must)) = open.pop() {
        let Some(element) = &work.elements[k] else { continue };
        let longest = work.longest(element);
        if !must && longest.1 <= wanted(work.middle(element)) {
            continue;
        }
        if element.kind != SectionCell::Tri6 {
            let parts = work.cut(k);
            open.extend(parts.map(|part| (part, false)));
            continue;
        }
        let ends = longest.0;
        match work.across(k, ends) {
            None => open.extend(work.halve(ends, &[k]).map(|part| (part, false))),
            Some(other) => {
                let beside = work.elements[other].as_ref();
                let triangle = beside.is_some_and(|e| e.kind == SectionCell::Tri6);
                let same = beside.is_some_and(|e| work.longest(e).0 == ends);
                if triangle && same {
                    open.extend(work.halve(ends, &[k, other]).map(|part| (part, false)));
                } else {
                    open.push((k, must));
                    match triangle {
                        true => open.push((other, true)),
                        false => open.extend(work.cut(other).map(|part| (part, false))),
                    }
                }
            }
        }
    }
    work.done()
}

struct Work {
    section: CrossSection,
    elements: Vec<Option<SectionElement>>,
    /// Elements on either side of the edge between two nodes.
    sides: BTreeMap<[usize; 2], Vec<usize>>,
}

fn key(a: usize, b: usize) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

impl Work {
    fn of(mut section: CrossSection) -> Self {
        let elements = std::mem::take(&mut section.elements);
        let mut work = Self { section, elements: Vec::new(), sides: BTreeMap::new() };
        elements.into_iter().for_each(|e| {
            work.add(e);
        });
        work
    }

    fn add(&mut self, element: SectionElement) -> usize {
        let number = self.elements.len();
        for edge in element.kind.edges() {
            let [a, b, _] = edge.map(|k| element.nodes[k]);
            self.sides.entry(key(a, b)).or_default().push(number);
        }
        self.elements.push(Some(element));
        number
    }

    fn take(&mut self, number: usize) -> Option<SectionElement> {
        let element = self.elements[number].take()?;
        for edge in element.kind.edges() {
            let [a, b, _] = edge.map(|k| element.nodes[k]);
            if let Some(sides) = self.sides.get_mut(&key(a, b)) {
                sides.retain(|&k| k != number);
            }
        }
        Some(element)
    }

    /// The longest edge, by its nodes where two are as long, and its length.
    fn longest(&self, element: &SectionElement) -> ([usize; 2], f64) {
        let mut longest = ([0, 0], 0.0);
        for edge in element.kind.edges() {
            let [a, b, _] = edge.map(|k| element.nodes[k]);
            let [p, q] = [a, b].map(|k| self.section.nodes[k]);
            let (ends, length) = (key(a, b), (p[0] - q[0]).hypot(p[1] - q[1]));
            if length > longest.1 || (length == longest.1 && ends > longest.0) {
                longest = (ends, length);
            }
        }
        longest
    }

    fn middle(&self, element: &SectionElement) -> [f64; 2] {
        let count = element.nodes.len() as f64;
        [0, 1].map(|c| element.nodes.iter().map(|&k| self.section.nodes[k][c]).sum::<f64>() / count)
    }

    fn across(&self, number: usize, ends: [usize; 2]) -> Option<usize> {
        self.sides.get(&ends)?.iter().copied().find(|&k| k != number)
    }

    fn node(&mut self, place: [f64; 2]) -> usize {
        self.section.nodes.push(place);
        self.section.nodes.len() - 1
    }

    /// The place of a point of an element.
    fn place(&self, element: &SectionElement, at: [f64; 2]) -> [f64; 2] {
        let shape = element.kind.shape(at, 1.0);
        [0, 1].map(|c| shape.value.iter().zip(&element.nodes).map(|(n, &k)| n * self.section.nodes[k][c]).sum())
    }

    /// A quadrilateral as two triangles along its shorter diagonal.
    fn cut(&mut self, number: usize) -> std::array::IntoIter<usize, 2> {
        let Some(old) = self.take(number) else { return [number; 2].into_iter() };
        let centre = match old.kind {
            SectionCell::Quad9 => old.nodes[8],
            _ => {
                let place = self.place(&old, [0.0, 0.0]);
                self.node(place)
            }
        };
        let length = |a: usize, b: usize| {
            let [p, q] = [a, b].map(|k| self.section.nodes[old.nodes[k]]);
            (p[0] - q[0]).hypot(p[1] - q[1])
        };
        let turn = usize::from(length(1, 3) < length(0, 2));
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| old.nodes[(k + turn) % 4]);
        let [ab, bc, cd, da] = [0, 1, 2, 3].map(|k| old.nodes[4 + (k + turn) % 4]);
        let triangle =
            |nodes: [usize; 6]| SectionElement { kind: SectionCell::Tri6, nodes: nodes.to_vec(), layer: old.layer };
        [triangle([a, b, c, ab, bc, centre]), triangle([a, c, d, centre, cd, da])].map(|e| self.add(e)).into_iter()
    }

    /// The triangles that share an edge, halved at its middle.
    fn halve(&mut self, ends: [usize; 2], numbers: &[usize]) -> std::vec::IntoIter<usize> {
        let old: Vec<SectionElement> = numbers.iter().filter_map(|&k| self.take(k)).collect();
        let mut quarters = None;
        let mut parts = Vec::new();
        for element in &old {
            let Some(turn) = (0..3).find(|&k| key(element.nodes[k], element.nodes[(k + 1) % 3]) == ends) else {
                continue;
            };
            let [a, b, c] = [0, 1, 2].map(|k| element.nodes[(k + turn) % 3]);
            let [m, bc, ca] = [0, 1, 2].map(|k| element.nodes[3 + (k + turn) % 3]);
            let turned =
                SectionElement { kind: SectionCell::Tri6, nodes: vec![a, b, c, m, bc, ca], layer: element.layer };
            // Nodes at a quarter of the edge from its first and from its last end.
            let (first, at_first, at_last) = match quarters {
                Some(known) => known,
                None => {
                    let places = [[0.25, 0.0], [0.75, 0.0]].map(|at| self.place(&turned, at));
                    let [p, q] = places.map(|place| self.node(place));
                    self.on_border(&[a, b, m], [p, q]);
                    *quarters.insert((a, p, q))
                }
            };
            let [am, mb] = if first == a { [at_first, at_last] } else { [at_last, at_first] };
            let place = self.place(&turned, [0.25, 0.5]);
            let mc = self.node(place);
            for nodes in [[a, m, c, am, mc, ca], [m, b, c, mb, bc, mc]] {
                parts.push(self.add(SectionElement {
                    kind: SectionCell::Tri6,
                    nodes: nodes.to_vec(),
                    layer: element.layer,
                }));
            }
        }
        parts.into_iter()
    }

    /// The two nodes `between` on the edge of these ends and middle belong to what the edge belongs to.
    fn on_border(&mut self, &[a, b, m]: &[usize; 3], between: [usize; 2]) {
        for group in self.section.groups.values_mut() {
            if [a, b, m].iter().all(|k| group.binary_search(k).is_ok()) {
                // Their numbers are the largest.
                group.extend(between);
            }
        }
        if let Some(place) = self.section.tread.iter().position(|e| key(e[0], e[1]) == key(a, b)) {
            let [first, last, _] = self.section.tread[place];
            let [p, q] = if first == a { between } else { [between[1], between[0]] };
            self.section.tread.splice(place..=place, [[first, m, p], [m, last, q]]);
        }
    }

    fn done(mut self) -> CrossSection {
        self.section.elements = self.elements.into_iter().flatten().collect();
        self.section
    }
}
