//! Kinds of cells and of their facets. One table holds all that is particular to a kind but its shape functions: nodes, faces, edges,
//! its numbers in files, its mirror image.

/// Most nodes that a cell of any kind has.
pub const MAX_NODES: usize = 8;
/// Most nodes that a facet of any kind has.
pub const MAX_FACET_NODES: usize = 4;

/// A kind of cell: shape and order. Nodes are in the order of VTK, the corners so that the Jacobian is positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CellKind {
    /// Eight-node hexahedron.
    Hex8,
}

/// A kind of facet: a face of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FacetKind {
    /// Four-node quadrilateral.
    Quad4,
}

/// A face of a cell.
#[derive(Debug)]
pub struct Face {
    /// What it is.
    pub kind: FacetKind,
    /// Nodes of the cell that are its nodes, corners first, counter-clockwise seen from outside, `[kind.nodes()]`.
    pub nodes: &'static [u8],
}

/// What is particular to a kind of cell.
#[derive(Debug)]
pub struct Topology {
    /// Its name in messages.
    pub name: &'static str,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of corners: the first nodes.
    pub corners: usize,
    /// Pairs of nodes that are neighbours: along the edges, and from nodes within a face or the cell to those around them.
    pub edges: &'static [[u8; 2]],
    /// Faces, outward.
    pub faces: &'static [Face],
    /// Node of the cell that takes each place in its mirror image, whose Jacobian is positive again, `[nodes]`. Twice it changes nothing.
    pub mirror: &'static [u8],
    /// VTK's number.
    pub vtk: u8,
    /// Node of the cell at each place of VTK's order, `[nodes]`.
    pub vtk_order: &'static [u8],
    /// Gmsh's number.
    pub gmsh: i32,
    /// Node of the cell at each place of Gmsh's order, `[nodes]`.
    pub gmsh_order: &'static [u8],
}

const fn quad4(nodes: &'static [u8; 4]) -> Face {
    Face { kind: FacetKind::Quad4, nodes }
}

static HEX8: Topology = Topology {
    name: "8-node hexahedron",
    nodes: 8,
    corners: 8,
    edges: &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]],
    faces: &[
        quad4(&[0, 3, 2, 1]),
        quad4(&[4, 5, 6, 7]),
        quad4(&[0, 1, 5, 4]),
        quad4(&[1, 2, 6, 5]),
        quad4(&[2, 3, 7, 6]),
        quad4(&[3, 0, 4, 7]),
    ],
    mirror: &[4, 5, 6, 7, 0, 1, 2, 3],
    vtk: 12,
    vtk_order: &[0, 1, 2, 3, 4, 5, 6, 7],
    gmsh: 5,
    gmsh_order: &[0, 1, 2, 3, 4, 5, 6, 7],
};

impl CellKind {
    /// All kinds.
    pub const ALL: [CellKind; 1] = [CellKind::Hex8];

    /// What is particular to the kind.
    pub fn topology(self) -> &'static Topology {
        match self {
            CellKind::Hex8 => &HEX8,
        }
    }

    /// Number of nodes.
    pub fn nodes(self) -> usize {
        self.topology().nodes
    }

    /// Faces, outward.
    pub fn faces(self) -> &'static [Face] {
        self.topology().faces
    }

    /// The kind with Gmsh's number `gmsh`.
    pub fn of_gmsh(gmsh: i32) -> Option<CellKind> {
        Self::ALL.into_iter().find(|k| k.topology().gmsh == gmsh)
    }

    /// The kind with VTK's number `vtk`.
    pub fn of_vtk(vtk: u8) -> Option<CellKind> {
        Self::ALL.into_iter().find(|k| k.topology().vtk == vtk)
    }

    /// Face of the mirror image that is the mirror image of face `face`.
    pub fn mirrored_face(self, face: usize) -> usize {
        let Topology { faces, mirror, .. } = self.topology();
        let set = |nodes: &mut dyn Iterator<Item = u8>| nodes.fold(0u32, |bits, n| bits | 1 << n);
        // The image's node at place i is node mirror[i].
        let wanted = set(&mut faces[face].nodes.iter().copied());
        faces.iter().position(|f| set(&mut f.nodes.iter().map(|&i| mirror[i as usize])) == wanted).unwrap_or(face)
    }
}

impl FacetKind {
    /// All kinds.
    pub const ALL: [FacetKind; 1] = [FacetKind::Quad4];

    /// Number of nodes.
    pub fn nodes(self) -> usize {
        match self {
            FacetKind::Quad4 => 4,
        }
    }

    /// Number of corners: the first nodes.
    pub fn corners(self) -> usize {
        match self {
            FacetKind::Quad4 => 4,
        }
    }

    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            FacetKind::Quad4 => "4-node quadrilateral",
        }
    }

    /// Gmsh's number.
    pub fn gmsh(self) -> i32 {
        match self {
            FacetKind::Quad4 => 3,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_permutation(order: &[u8], n: usize) -> bool {
        let mut sorted = order.to_vec();
        sorted.sort_unstable();
        sorted.iter().map(|&i| i as usize).eq(0..n)
    }

    /// Every face is one of the mirror image too, every edge of a face joins two faces in opposite directions, permutations are permutations.
    #[test]
    fn the_table_is_consistent() {
        for kind in CellKind::ALL {
            let t = kind.topology();
            assert!(t.nodes <= MAX_NODES && t.corners <= t.nodes, "{kind:?}");
            for order in [t.mirror, t.vtk_order, t.gmsh_order] {
                assert!(is_permutation(order, t.nodes), "{kind:?}: {order:?}");
            }
            assert!(t.mirror.iter().enumerate().all(|(i, &m)| t.mirror[m as usize] as usize == i), "{kind:?}");
            let mut directed = Vec::new();
            for (f, face) in t.faces.iter().enumerate() {
                assert_eq!(face.nodes.len(), face.kind.nodes(), "{kind:?}");
                assert!(face.kind.nodes() <= MAX_FACET_NODES);
                let corners = &face.nodes[..face.kind.corners()];
                assert!(corners.iter().all(|&c| (c as usize) < t.corners), "{kind:?}, face {f}");
                directed.extend((0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]]));
                let image = kind.mirrored_face(f);
                assert_eq!(t.faces[image].kind, face.kind);
                assert_eq!(kind.mirrored_face(image), f, "{kind:?}, face {f}");
            }
            for [a, b] in &directed {
                assert_eq!(directed.iter().filter(|e| **e == [*b, *a]).count(), 1, "{kind:?}: edge {a}-{b}");
            }
            // All nodes hang together by the edges.
            let mut reached = vec![false; t.nodes];
            reached[0] = true;
            for _ in 0..t.nodes {
                for &[a, b] in t.edges {
                    let both = reached[a as usize] || reached[b as usize];
                    (reached[a as usize], reached[b as usize]) = (both, both);
                }
            }
            assert!(reached.iter().all(|&r| r), "{kind:?}: {reached:?}");
            assert_eq!(CellKind::of_gmsh(t.gmsh), Some(kind));
            assert_eq!(CellKind::of_vtk(t.vtk), Some(kind));
        }
    }
}
