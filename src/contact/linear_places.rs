//! The nodes that a linearised contact asks for, and the contact on an interface of these alone.

use super::LinearContact;

impl LinearContact {
    /// Nodes of the interface that it asks for, ascending: the closed ones and those whose motion it sees beside them.
    pub fn places(&self) -> Vec<usize> {
        let closed = self.nodes.iter().flat_map(|n| n.convection.iter().map(|c| c.0).chain([n.node]));
        let mut all: Vec<usize> = closed.chain(self.edges.iter().flat_map(|e| e.gaps.map(|g| g.0))).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The same contact on an interface that consists of its `places` alone.
    pub(crate) fn on_places(&self, places: &[usize]) -> Self {
        let place = |node: usize| places.partition_point(|&p| p < node);
        let mut own = self.clone();
        for n in &mut own.nodes {
            n.node = place(n.node);
            n.convection.iter_mut().for_each(|c| c.0 = place(c.0));
        }
        own.edges.iter_mut().flat_map(|e| &mut e.gaps).for_each(|g| g.0 = place(g.0));
        own
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{LinearEdge, LinearNode, Tangent};

    /// Nodes are numbered anew in their order, wherever they are named.
    #[test]
    fn nodes_are_numbered_anew() {
        let tangent = Tangent::Stick { creep: 1.0 };
        let node = |node, convection: &[(usize, f64)]| LinearNode { node, tangent, convection: convection.to_vec() };
        let contact = LinearContact {
            nodes: vec![node(7, &[(7, 2.0), (9, -2.0)]), node(4, &[])],
            edges: vec![LinearEdge { at: 0, gaps: [(12, [0.5, -2.0]), (2, [7.0, 0.25])] }],
            memory: Vec::new(),
        };
        let places = contact.places();
        assert_eq!(places, [2, 4, 7, 9, 12]);
        let own = contact.on_places(&places);
        assert_eq!(own.nodes, [node(2, &[(2, 2.0), (3, -2.0)]), node(1, &[])]);
        assert_eq!(own.edges[0].gaps, [(4, [0.5, -2.0]), (0, [7.0, 0.25])]);
        assert_eq!(own.places(), [0, 1, 2, 3, 4]);
    }
}
