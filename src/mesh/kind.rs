//! Kinds of cells and of their facets. One table holds all that is particular to a kind but its shape functions:
//! nodes, faces, edges, its numbers in files, its mirror image. Sources: VTK file formats (as VTK 9.7 numbers the
//! nodes of its cells), Gmsh reference manual ("Node ordering").

use std::sync::OnceLock;

/// Most nodes that a cell of any kind has.
pub const MAX_NODES: usize = 27;
/// Most nodes that a facet of any kind has.
pub const MAX_FACET_NODES: usize = 9;

/// A kind of cell: shape and order. Nodes are in the order of VTK: corners so that the Jacobian is positive, then the
/// nodes on the edges, in the faces and within.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CellKind {
    /// Four-node tetrahedron.
    Tet4,
    /// Ten-node tetrahedron.
    Tet10,
    /// Five-node pyramid.
    Pyramid5,
    /// Thirteen-node pyramid.
    Pyramid13,
    /// Six-node wedge.
    Wedge6,
    /// Fifteen-node wedge.
    Wedge15,
    /// Eighteen-node wedge: with nodes in the quadrilaterals.
    Wedge18,
    /// Eight-node hexahedron.
    Hex8,
    /// Twenty-node hexahedron.
    Hex20,
    /// Twenty-seven-node hexahedron: with nodes in the faces and the centre.
    Hex27,
}

/// A kind of facet: a face of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FacetKind {
    /// Three-node triangle.
    Tri3,
    /// Six-node triangle.
    Tri6,
    /// Four-node quadrilateral.
    Quad4,
    /// Eight-node quadrilateral.
    Quad8,
    /// Nine-node quadrilateral.
    Quad9,
}

/// A face of a cell.
#[derive(Debug)]
pub struct Face {
    /// Kind.
    pub kind: FacetKind,
    /// Nodes of the cell that are its nodes, `[kind.nodes()]`: corners counter-clockwise seen from outside, the nodes
    /// on the edges behind each corner, the one in the middle.
    pub nodes: &'static [u8],
}

/// Properties of a kind of cell.
#[derive(Debug)]
pub struct Topology {
    /// Its name in messages.
    pub name: &'static str,
    /// Corners of each edge. Of a cell with nodes on its edges these come behind the corners, in this order.
    pub edges: &'static [[u8; 2]],
    /// Corners around each further node, in a face or within.
    pub inside: &'static [&'static [u8]],
    /// Faces, outward.
    pub faces: &'static [Face],
    /// Node of the cell that takes each place in its mirror image, whose Jacobian is positive again, `[nodes]`. Twice
    /// it changes nothing.
    pub mirror: &'static [u8],
    /// VTK's number.
    pub vtk: u8,
    /// Gmsh's number.
    pub gmsh: i32,
    /// Node of the cell at each place of Gmsh's order, `[nodes]`.
    pub gmsh_order: &'static [u8],
}

const fn face(kind: FacetKind, nodes: &'static [u8]) -> Face {
    Face { kind, nodes }
}

/// 0, 1, 2, …
const IN_ORDER: [u8; MAX_NODES] = {
    let mut order = [0; MAX_NODES];
    let mut i = 0;
    while i < MAX_NODES {
        order[i] = i as u8;
        i += 1;
    }
    order
};

/// The first `n` of 0, 1, 2, …
const fn in_order(n: usize) -> &'static [u8] {
    IN_ORDER.split_at(n).0
}

const TET_EDGES: &[[u8; 2]] = &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
const PYRAMID_EDGES: &[[u8; 2]] = &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]];
const WEDGE_EDGES: &[[u8; 2]] = &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];
const HEX_EDGES: &[[u8; 2]] =
    &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

use FacetKind::{Quad4, Quad8, Quad9, Tri3, Tri6};

/// The table, in the order of [`CellKind`].
static TABLE: [Topology; 10] = [
    Topology {
        name: "4-node tetrahedron",
        edges: TET_EDGES,
        inside: &[],
        faces: &[face(Tri3, &[0, 2, 1]), face(Tri3, &[0, 1, 3]), face(Tri3, &[1, 2, 3]), face(Tri3, &[2, 0, 3])],
        mirror: &[0, 2, 1, 3],
        vtk: 10,
        gmsh: 4,
        gmsh_order: in_order(4),
    },
    Topology {
        name: "10-node tetrahedron",
        edges: TET_EDGES,
        inside: &[],
        faces: &[
            face(Tri6, &[0, 2, 1, 6, 5, 4]),
            face(Tri6, &[0, 1, 3, 4, 8, 7]),
            face(Tri6, &[1, 2, 3, 5, 9, 8]),
            face(Tri6, &[2, 0, 3, 6, 7, 9]),
        ],
        mirror: &[0, 2, 1, 3, 6, 5, 4, 7, 9, 8],
        vtk: 24,
        gmsh: 11,
        gmsh_order: &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
    },
    Topology {
        name: "5-node pyramid",
        edges: PYRAMID_EDGES,
        inside: &[],
        faces: &[
            face(Quad4, &[0, 3, 2, 1]),
            face(Tri3, &[0, 1, 4]),
            face(Tri3, &[1, 2, 4]),
            face(Tri3, &[2, 3, 4]),
            face(Tri3, &[3, 0, 4]),
        ],
        mirror: &[0, 3, 2, 1, 4],
        vtk: 14,
        gmsh: 7,
        gmsh_order: in_order(5),
    },
    Topology {
        name: "13-node pyramid",
        edges: PYRAMID_EDGES,
        inside: &[],
        faces: &[
            face(Quad8, &[0, 3, 2, 1, 8, 7, 6, 5]),
            face(Tri6, &[0, 1, 4, 5, 10, 9]),
            face(Tri6, &[1, 2, 4, 6, 11, 10]),
            face(Tri6, &[2, 3, 4, 7, 12, 11]),
            face(Tri6, &[3, 0, 4, 8, 9, 12]),
        ],
        mirror: &[0, 3, 2, 1, 4, 8, 7, 6, 5, 9, 12, 11, 10],
        vtk: 27,
        gmsh: 19,
        gmsh_order: &[0, 1, 2, 3, 4, 5, 8, 9, 6, 10, 7, 11, 12],
    },
    Topology {
        name: "6-node wedge",
        edges: WEDGE_EDGES,
        inside: &[],
        faces: &[
            face(Tri3, &[0, 2, 1]),
            face(Tri3, &[3, 4, 5]),
            face(Quad4, &[0, 1, 4, 3]),
            face(Quad4, &[1, 2, 5, 4]),
            face(Quad4, &[2, 0, 3, 5]),
        ],
        mirror: &[3, 4, 5, 0, 1, 2],
        vtk: 13,
        gmsh: 6,
        gmsh_order: in_order(6),
    },
    Topology {
        name: "15-node wedge",
        edges: WEDGE_EDGES,
        inside: &[],
        faces: &[
            face(Tri6, &[0, 2, 1, 8, 7, 6]),
            face(Tri6, &[3, 4, 5, 9, 10, 11]),
            face(Quad8, &[0, 1, 4, 3, 6, 13, 9, 12]),
            face(Quad8, &[1, 2, 5, 4, 7, 14, 10, 13]),
            face(Quad8, &[2, 0, 3, 5, 8, 12, 11, 14]),
        ],
        mirror: &[3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8, 12, 13, 14],
        vtk: 26,
        gmsh: 18,
        gmsh_order: &[0, 1, 2, 3, 4, 5, 6, 8, 12, 7, 13, 14, 9, 11, 10],
    },
    Topology {
        name: "18-node wedge",
        edges: WEDGE_EDGES,
        inside: &[&[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]],
        faces: &[
            face(Tri6, &[0, 2, 1, 8, 7, 6]),
            face(Tri6, &[3, 4, 5, 9, 10, 11]),
            face(Quad9, &[0, 1, 4, 3, 6, 13, 9, 12, 15]),
            face(Quad9, &[1, 2, 5, 4, 7, 14, 10, 13, 16]),
            face(Quad9, &[2, 0, 3, 5, 8, 12, 11, 14, 17]),
        ],
        mirror: &[3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8, 12, 13, 14, 15, 16, 17],
        vtk: 32,
        gmsh: 13,
        gmsh_order: &[0, 1, 2, 3, 4, 5, 6, 8, 12, 7, 13, 14, 9, 11, 10, 15, 17, 16],
    },
    Topology {
        name: "8-node hexahedron",
        edges: HEX_EDGES,
        inside: &[],
        faces: &[
            face(Quad4, &[0, 3, 2, 1]),
            face(Quad4, &[4, 5, 6, 7]),
            face(Quad4, &[0, 1, 5, 4]),
            face(Quad4, &[1, 2, 6, 5]),
            face(Quad4, &[2, 3, 7, 6]),
            face(Quad4, &[3, 0, 4, 7]),
        ],
        mirror: &[4, 5, 6, 7, 0, 1, 2, 3],
        vtk: 12,
        gmsh: 5,
        gmsh_order: in_order(8),
    },
    Topology {
        name: "20-node hexahedron",
        edges: HEX_EDGES,
        inside: &[],
        faces: &[
            face(Quad8, &[0, 3, 2, 1, 11, 10, 9, 8]),
            face(Quad8, &[4, 5, 6, 7, 12, 13, 14, 15]),
            face(Quad8, &[0, 1, 5, 4, 8, 17, 12, 16]),
            face(Quad8, &[1, 2, 6, 5, 9, 18, 13, 17]),
            face(Quad8, &[2, 3, 7, 6, 10, 19, 14, 18]),
            face(Quad8, &[3, 0, 4, 7, 11, 16, 15, 19]),
        ],
        mirror: &[4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19],
        vtk: 25,
        gmsh: 17,
        gmsh_order: &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14],
    },
    Topology {
        name: "27-node hexahedron",
        edges: HEX_EDGES,
        inside: &[
            &[0, 4, 7, 3],
            &[1, 2, 6, 5],
            &[0, 1, 5, 4],
            &[2, 3, 7, 6],
            &[0, 1, 2, 3],
            &[4, 5, 6, 7],
            &[0, 1, 2, 3, 4, 5, 6, 7],
        ],
        faces: &[
            face(Quad9, &[0, 3, 2, 1, 11, 10, 9, 8, 24]),
            face(Quad9, &[4, 5, 6, 7, 12, 13, 14, 15, 25]),
            face(Quad9, &[0, 1, 5, 4, 8, 17, 12, 16, 22]),
            face(Quad9, &[1, 2, 6, 5, 9, 18, 13, 17, 21]),
            face(Quad9, &[2, 3, 7, 6, 10, 19, 14, 18, 23]),
            face(Quad9, &[3, 0, 4, 7, 11, 16, 15, 19, 20]),
        ],
        mirror: &[4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19, 20, 21, 22, 23, 25, 24, 26],
        vtk: 29,
        gmsh: 12,
        gmsh_order: &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14, 24, 22, 20, 21, 23, 25, 26],
    },
];

impl CellKind {
    /// All kinds.
    pub const ALL: [CellKind; 10] = {
        use CellKind::*;
        [Tet4, Tet10, Pyramid5, Pyramid13, Wedge6, Wedge15, Wedge18, Hex8, Hex20, Hex27]
    };

    /// Returns the properties of the kind.
    pub fn topology(self) -> &'static Topology {
        &TABLE[self as usize]
    }

    /// Number of nodes.
    pub fn nodes(self) -> usize {
        self.topology().mirror.len()
    }

    /// The kind of the same shape without nodes on its edges.
    pub fn linear(self) -> CellKind {
        match self {
            CellKind::Tet4 | CellKind::Tet10 => CellKind::Tet4,
            CellKind::Pyramid5 | CellKind::Pyramid13 => CellKind::Pyramid5,
            CellKind::Wedge6 | CellKind::Wedge15 | CellKind::Wedge18 => CellKind::Wedge6,
            CellKind::Hex8 | CellKind::Hex20 | CellKind::Hex27 => CellKind::Hex8,
        }
    }

    /// Number of corners: the first nodes.
    pub fn corners(self) -> usize {
        self.linear().nodes()
    }

    /// Faces, outward.
    pub fn faces(self) -> &'static [Face] {
        self.topology().faces
    }

    /// Corners around each node that is none, in the order of the nodes.
    pub fn between(self) -> impl Iterator<Item = &'static [u8]> + Clone {
        let Topology { edges, inside, .. } = self.topology();
        let edges = if self == self.linear() { &[] } else { *edges };
        edges.iter().map(|e| &e[..]).chain(inside.iter().copied())
    }

    /// Pairs of nodes that are neighbours: the ends of the edges, or each node that is no corner and the corners
    /// around it.
    pub fn links(self) -> &'static [[u8; 2]] {
        static ALL: [OnceLock<Vec<[u8; 2]>>; CellKind::ALL.len()] = [const { OnceLock::new() }; CellKind::ALL.len()];
        ALL[self as usize].get_or_init(|| {
            let further = (self.corners() as u8..).zip(self.between());
            match self == self.linear() {
                true => self.topology().edges.to_vec(),
                false => further.flat_map(|(n, around)| around.iter().map(move |&c| [n, c])).collect(),
            }
        })
    }

    /// The kind with Gmsh's number `gmsh`.
    pub(crate) fn of_gmsh(gmsh: i32) -> Option<CellKind> {
        Self::ALL.into_iter().find(|k| k.topology().gmsh == gmsh)
    }

    /// The kind with VTK's number `vtk`.
    pub(crate) fn of_vtk(vtk: u8) -> Option<CellKind> {
        Self::ALL.into_iter().find(|k| k.topology().vtk == vtk)
    }

    /// Face of the mirror image that is the mirror image of face `face`.
    pub(crate) fn mirrored_face(self, face: usize) -> usize {
        let Topology { faces, mirror, .. } = self.topology();
        let set = |nodes: &mut dyn Iterator<Item = u8>| nodes.fold(0u32, |bits, n| bits | 1 << n);
        // The image's node at place i is node mirror[i].
        let wanted = set(&mut faces[face].nodes.iter().copied());
        faces.iter().position(|f| set(&mut f.nodes.iter().map(|&i| mirror[i as usize])) == wanted).unwrap_or(face)
    }
}

impl FacetKind {
    /// All kinds.
    pub const ALL: [FacetKind; 5] = [Tri3, Tri6, Quad4, Quad8, Quad9];

    /// Number of nodes.
    pub fn nodes(self) -> usize {
        match self {
            Tri3 => 3,
            Quad4 => 4,
            Tri6 => 6,
            Quad8 => 8,
            Quad9 => 9,
        }
    }

    /// Number of corners: the first nodes.
    pub fn corners(self) -> usize {
        match self {
            Tri3 | Tri6 => 3,
            Quad4 | Quad8 | Quad9 => 4,
        }
    }

    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Tri3 => "3-node triangle",
            Tri6 => "6-node triangle",
            Quad4 => "4-node quadrilateral",
            Quad8 => "8-node quadrilateral",
            Quad9 => "9-node quadrilateral",
        }
    }

    /// Gmsh's number.
    pub fn gmsh(self) -> i32 {
        match self {
            Tri3 => 2,
            Tri6 => 9,
            Quad4 => 3,
            Quad8 => 16,
            Quad9 => 10,
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

    fn sorted(nodes: impl IntoIterator<Item = u8>) -> Vec<u8> {
        let mut nodes: Vec<u8> = nodes.into_iter().collect();
        nodes.sort_unstable();
        nodes
    }

    /// Every face is one of the mirror image too, every edge of a face joins two faces in opposite directions, nodes
    /// on the edges of faces are those of the edges, permutations are permutations that keep what lies between what.
    #[test]
    fn the_table_is_consistent() {
        for (number, kind) in CellKind::ALL.into_iter().enumerate() {
            let t = kind.topology();
            let (n, corners) = (kind.nodes(), kind.corners());
            assert_eq!(kind as usize, number);
            assert!(n <= MAX_NODES && t.name.starts_with(&n.to_string()), "{kind:?}");
            assert_eq!(n, corners + kind.between().count(), "{kind:?}");
            for order in [t.mirror, t.gmsh_order] {
                assert!(is_permutation(order, n), "{kind:?}: {order:?}");
            }
            assert!(t.mirror.iter().enumerate().all(|(i, &m)| t.mirror[m as usize] as usize == i), "{kind:?}");
            let between: Vec<Vec<u8>> = kind.between().map(|c| sorted(c.iter().copied())).collect();
            // What lies between corners lies between their images in the image.
            for (i, around) in between.iter().enumerate() {
                let image = sorted(around.iter().map(|&c| t.mirror[c as usize]));
                assert_eq!(image, between[t.mirror[corners + i] as usize - corners], "{kind:?}, node {}", corners + i);
            }
            let mut directed = Vec::new();
            for (f, face) in t.faces.iter().enumerate() {
                assert_eq!(face.nodes.len(), face.kind.nodes(), "{kind:?}");
                assert!(face.kind.nodes() <= MAX_FACET_NODES);
                let m = face.kind.corners();
                let ring = &face.nodes[..m];
                assert!(ring.iter().all(|&c| (c as usize) < corners), "{kind:?}, face {f}");
                directed.extend((0..m).map(|k| [ring[k], ring[(k + 1) % m]]));
                for (k, &node) in face.nodes[m..].iter().enumerate() {
                    let around = if k < m { sorted([ring[k], ring[(k + 1) % m]]) } else { sorted(ring.to_vec()) };
                    assert_eq!(between[node as usize - corners], around, "{kind:?}, face {f}, node {node}");
                }
                let image = kind.mirrored_face(f);
                assert_eq!(t.faces[image].kind, face.kind);
                assert_eq!(kind.mirrored_face(image), f, "{kind:?}, face {f}");
            }
            for [a, b] in &directed {
                assert_eq!(directed.iter().filter(|e| **e == [*b, *a]).count(), 1, "{kind:?}: edge {a}-{b}");
                assert!(t.edges.contains(&[*a, *b]) || t.edges.contains(&[*b, *a]), "{kind:?}: edge {a}-{b}");
            }
            assert_eq!(directed.len(), 2 * t.edges.len(), "{kind:?}");
            // All nodes hang together by the links.
            let mut reached = vec![false; n];
            reached[0] = true;
            for _ in 0..n {
                for &[a, b] in kind.links() {
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
