//! NodePairs of coupled nodes, and the numbers of the free ones.

use crate::swept::numbering::reverse_cuthill_mckee;
use crate::swept::CrossSection;
use std::collections::BTreeSet;

/// NodePairs (a, b ≤ a) of free nodes that share an element, by rows.
#[derive(Debug, Clone, Default)]
pub(super) struct NodePairs {
    start: Vec<usize>,
    pub(super) columns: Vec<usize>,
}

impl NodePairs {
    pub(super) fn rows(&self) -> usize {
        self.start.len() - 1
    }

    /// (a, b, index) of each.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
        (0..self.rows()).flat_map(move |a| (self.start[a]..self.start[a + 1]).map(move |k| (a, self.columns[k], k)))
    }

    pub(super) fn find(&self, a: usize, b: usize) -> Option<usize> {
        let row = &self.columns[self.start[a]..self.start[a + 1]];
        row.binary_search(&b).ok().map(|k| self.start[a] + k)
    }
}

/// Numbers of the free nodes of a section, and the pairs of them that share an element or are among `links`. The nodes
/// of `last` have the highest numbers.
pub(super) fn number(
    section: &CrossSection,
    free: &[bool],
    links: &[[usize; 2]],
    last: &[usize],
) -> (Vec<Option<usize>>, NodePairs) {
    let mut near = vec![BTreeSet::new(); section.nodes.len()];
    links.iter().for_each(|[a, b]| {
        near[*a].insert(*b);
    });
    for element in &section.elements {
        for &a in element.nodes.iter().filter(|&&a| free[a]) {
            near[a].extend(element.nodes.iter().copied().filter(|&b| free[b]));
        }
    }
    let kept: Vec<usize> = (0..near.len()).filter(|&k| !near[k].is_empty()).collect();
    let mut index = vec![None; near.len()];
    kept.iter().enumerate().for_each(|(i, &k)| index[k] = Some(i));
    let others = |k: usize| near[k].iter().filter(|&&b| b != k).filter_map(|&b| index[b]).collect();
    let neighbours: Vec<Vec<usize>> = kept.iter().map(|&k| others(k)).collect();
    let last: BTreeSet<usize> = last.iter().filter_map(|&k| index[k]).collect();
    let order = reverse_cuthill_mckee(&neighbours, &last.into_iter().collect::<Vec<usize>>());
    let mut place = vec![None; near.len()];
    order.iter().enumerate().for_each(|(new, &i)| place[kept[i]] = Some(new));
    let mut pairs = NodePairs { start: vec![0], columns: Vec::new() };
    for (a, &i) in order.iter().enumerate() {
        let mut row: Vec<usize> = near[kept[i]].iter().filter_map(|&b| place[b]).filter(|&b| b <= a).collect();
        row.sort_unstable();
        pairs.columns.extend(row);
        pairs.start.push(pairs.columns.len());
    }
    (place, pairs)
}
