//! Types of elements, in one table: what each is here. The order of the nodes is that of VTK for all of them, corners, edges of the bottom, of the top, those
//! that stand up; the faces S1, S2, … come in the order of those of our cells.

use crate::mesh::{CellKind, FacetKind};

/// What an element type is here.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElementType {
    /// A cell.
    Cell(CellKind),
    /// A facet: it has no part in the stiffness, and its element set is a group.
    Facet(FacetKind),
    /// Left out: a line that Gmsh writes along an edge, with so many nodes.
    Line(usize),
}

use CellKind::{Hex20, Hex8, Tet10, Tet4, Wedge15, Wedge6};
use ElementType::{Cell, Facet, Line};

const TYPES: [(&str, ElementType); 30] = [
    ("C3D4", Cell(Tet4)),
    ("C3D6", Cell(Wedge6)),
    ("C3D8", Cell(Hex8)),
    ("C3D8I", Cell(Hex8)),
    ("C3D8R", Cell(Hex8)),
    ("C3D10", Cell(Tet10)),
    ("C3D10M", Cell(Tet10)),
    ("C3D15", Cell(Wedge15)),
    ("C3D20", Cell(Hex20)),
    ("C3D20R", Cell(Hex20)),
    ("CPS3", Facet(FacetKind::Tri3)),
    ("CPS4", Facet(FacetKind::Quad4)),
    ("CPS6", Facet(FacetKind::Tri6)),
    ("CPS8", Facet(FacetKind::Quad8)),
    ("CPS4R", Facet(FacetKind::Quad4)),
    ("CPS8R", Facet(FacetKind::Quad8)),
    ("CPE3", Facet(FacetKind::Tri3)),
    ("CPE4", Facet(FacetKind::Quad4)),
    ("CPE6", Facet(FacetKind::Tri6)),
    ("CPE8", Facet(FacetKind::Quad8)),
    ("SFM3D3", Facet(FacetKind::Tri3)),
    ("SFM3D4", Facet(FacetKind::Quad4)),
    ("SFM3D6", Facet(FacetKind::Tri6)),
    ("SFM3D8", Facet(FacetKind::Quad8)),
    ("SFM3D4R", Facet(FacetKind::Quad4)),
    ("SFM3D8R", Facet(FacetKind::Quad8)),
    ("T3D2", Line(2)),
    ("T3D3", Line(3)),
    ("T2D2", Line(2)),
    ("T2D3", Line(3)),
];

/// The element type `name`, in capitals.
pub fn of(name: &str) -> Option<ElementType> {
    TYPES.iter().find(|t| t.0 == name).map(|t| t.1)
}

/// Names of the solid elements, for messages.
pub fn solids() -> String {
    let names: Vec<&str> = TYPES.iter().filter(|t| matches!(t.1, Cell(_))).map(|t| t.0).collect();
    names.join(", ")
}

/// What is said of elements that are other ones here.
pub fn remark(name: &str) -> Option<&'static str> {
    Some(match name {
        "C3D8" => "are 8-node hexahedra with incompatible modes here, as C3D8I",
        "C3D8R" => {
            "with reduced integration are 8-node hexahedra with incompatible modes here, fully integrated, as C3D8I"
        }
        "C3D20R" => "with reduced integration are fully integrated here, as C3D20: a little stiffer",
        "C3D10M" => "are 10-node tetrahedra of the usual kind here, as C3D10",
        _ => return None,
    })
}

impl ElementType {
    /// Nodes of an element.
    pub fn nodes(self) -> usize {
        match self {
            Cell(kind) => kind.nodes(),
            Facet(kind) => kind.nodes(),
            Line(n) => n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners of the faces S1, S2, … from 1, as the manuals have them.
    #[test]
    fn faces_come_in_the_order_of_the_manuals() {
        let faces: [(CellKind, &[&[u8]]); 3] = [
            (Tet10, &[&[1, 2, 3], &[1, 4, 2], &[2, 4, 3], &[3, 4, 1]]),
            (Wedge15, &[&[1, 2, 3], &[4, 6, 5], &[1, 4, 5, 2], &[2, 5, 6, 3], &[3, 6, 4, 1]]),
            (Hex20, &[&[1, 2, 3, 4], &[5, 8, 7, 6], &[1, 5, 6, 2], &[2, 6, 7, 3], &[3, 7, 8, 4], &[4, 8, 5, 1]]),
        ];
        for (kind, expected) in faces {
            assert_eq!(kind.faces().len(), expected.len());
            for (face, corners) in kind.faces().iter().zip(expected) {
                let mut ours: Vec<u8> = face.nodes[..face.kind.corners()].iter().map(|n| n + 1).collect();
                let mut theirs = corners.to_vec();
                ours.sort_unstable();
                theirs.sort_unstable();
                assert_eq!(ours, theirs, "{kind:?}");
            }
        }
    }
}
