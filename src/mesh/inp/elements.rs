//! Types of elements, in one table: what each is here. The order of the nodes is that of VTK for all of them,
//! corners, edges of the bottom, of the top, those that stand up; the faces S1, S2, … come in the order of those of
//! our cells.

use crate::mesh::{CellKind, FacetKind};

/// Interpretation of an element type.
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

/// Solid elements whose letters behind the number of nodes say how they are integrated or what else they compute:
/// R and I, H hybrid, M modified, S improved stress, T and P coupled with temperature and pore pressure.
const VARIANTS: &str = "RIHMSTP";

/// Families of surface elements: shells, membranes, plane and axisymmetric elements, rigid faces.
const SURFACES: [&str; 9] = ["STRI", "SFM3D", "M3D", "R3D", "CPEG", "CPS", "CPE", "CAX", "S"];

/// Families of elements with two or three nodes in a line, or one: beams, pipes, trusses, frames, springs, dashpots,
/// masses, connectors. They are left out.
const POINTS_AND_LINES: [(&str, usize); 22] = [
    ("B21", 2),
    ("B22", 3),
    ("B23", 2),
    ("B31", 2),
    ("B32", 3),
    ("B33", 2),
    ("PIPE21", 2),
    ("PIPE22", 3),
    ("PIPE31", 2),
    ("PIPE32", 3),
    ("FRAME2D", 2),
    ("FRAME3D", 2),
    ("T3D2", 2),
    ("T3D3", 3),
    ("MASS", 1),
    ("ROTARYI", 1),
    ("SPRING1", 1),
    ("SPRING2", 2),
    ("SPRINGA", 2),
    ("DASHPOT1", 1),
    ("DASHPOT2", 2),
    ("DASHPOTA", 2),
];

/// The element type `name`, in capitals.
pub fn element_type(name: &str) -> Option<ElementType> {
    let known = TYPES.iter().find(|t| t.0 == name).map(|t| t.1);
    known.or_else(|| solid_variant(name)).or_else(|| surface(name)).or_else(|| {
        let line = POINTS_AND_LINES.iter().find(|(family, _)| variant_of(name, family, "RHOSWT"));
        line.map(|&(_, nodes)| Line(nodes))
    })
}

/// Returns whether `name` is `family` with some of the letters behind it.
fn variant_of(name: &str, family: &str, letters: &str) -> bool {
    name.strip_prefix(family).is_some_and(|rest| rest.chars().all(|c| letters.contains(c)))
}

/// A variant of a solid element, which is its base here: `C3D8RH` is a C3D8.
fn solid_variant(name: &str) -> Option<ElementType> {
    let mut bases: Vec<&(&str, ElementType)> = TYPES.iter().filter(|t| matches!(t.1, Cell(_))).collect();
    bases.sort_by_key(|t| std::cmp::Reverse(t.0.len()));
    bases.iter().find(|t| t.0.starts_with("C3D") && variant_of(name, t.0, VARIANTS)).map(|t| t.1)
}

/// A surface element, by its family and its number of nodes: `S8R5`, `CAX4P`, `M3D4R`, `STRI65`.
fn surface(name: &str) -> Option<ElementType> {
    let family = SURFACES.iter().find(|f| name.starts_with(**f))?;
    let rest = &name[family.len()..];
    let (first, letters) = rest.split_at_checked(1)?;
    let letters = letters.trim_end_matches('5');
    if !letters.chars().all(|c| "RIHMSTPW".contains(c)) {
        return None;
    }
    Some(Facet(match first {
        "3" => FacetKind::Tri3,
        "4" => FacetKind::Quad4,
        "6" => FacetKind::Tri6,
        "8" => FacetKind::Quad8,
        _ => return None,
    }))
}

/// Names of the solid elements, for messages.
pub fn solids() -> String {
    let names: Vec<&str> = TYPES.iter().filter(|t| matches!(t.1, Cell(_))).map(|t| t.0).collect();
    names.join(", ")
}

/// Remark on elements that are read as other types.
pub fn remark(name: &str) -> Option<&'static str> {
    Some(match name {
        "C3D8" => "are 8-node hexahedra with incompatible modes here, as C3D8I",
        "C3D8R" => {
            "with reduced integration are 8-node hexahedra with incompatible modes here, fully integrated, as C3D8I"
        }
        "C3D20R" => "with reduced integration are fully integrated here, as C3D20: a little stiffer",
        "C3D10M" => "are 10-node tetrahedra of the usual kind here, as C3D10",
        _ => match element_type(name)? {
            Cell(kind) if TYPES.iter().all(|t| t.0 != name) => match kind {
                Hex8 => "are 8-node hexahedra with incompatible modes here, fully integrated, as C3D8I",
                _ => "are elements of displacements alone here, fully integrated, as those without further letters",
            },
            Cell(_) => return None,
            Facet(_) if ["CP", "CAX", "SFM"].iter().any(|f| name.starts_with(f)) => return None,
            Facet(_) => "are surfaces without thickness here: they name faces of solids, and are left out of the body",
            Line(_) => "are left out of the body",
        },
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
