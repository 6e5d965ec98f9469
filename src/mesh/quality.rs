//! Geometry of hexahedra: Jacobians, volume, checksum.

use super::Mesh;
use sha2::{Digest, Sha256};

/// Corners of the reference hexahedron [-1, 1]³ in VTK (= Gmsh) order.
pub const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Faces of a hexahedron in VTK order, seen from outside.
pub const FACES: [[usize; 4]; 6] = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// Determinant of the Jacobian of the trilinear map of a hexahedron (corner positions in m) at the reference point `at`, m³.
pub fn jacobian(corners: &[[f64; 3]; 8], at: [f64; 3]) -> f64 {
    let mut j = [[0.0; 3]; 3];
    for (x, c) in corners.iter().zip(&CORNERS) {
        let f = [1.0 + c[0] * at[0], 1.0 + c[1] * at[1], 1.0 + c[2] * at[2]];
        let d = [c[0] * f[1] * f[2] / 8.0, f[0] * c[1] * f[2] / 8.0, f[0] * f[1] * c[2] / 8.0];
        for (row, dk) in j.iter_mut().zip(d) {
            for (entry, xi) in row.iter_mut().zip(x) {
                *entry += dk * xi;
            }
        }
    }
    j[0][0] * (j[1][1] * j[2][2] - j[1][2] * j[2][1]) - j[0][1] * (j[1][0] * j[2][2] - j[1][2] * j[2][0])
        + j[0][2] * (j[1][0] * j[2][1] - j[1][1] * j[2][0])
}

/// Smallest and largest Jacobian determinant over the eight corners and the centre of a hexahedron, m³.
pub fn jacobian_range(corners: &[[f64; 3]; 8]) -> [f64; 2] {
    CORNERS.iter().chain([&[0.0; 3]]).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], c| {
        let j = jacobian(corners, *c);
        [low.min(j), high.max(j)]
    })
}

/// Volume of a hexahedron, m³; 2 × 2 × 2 Gauss points are exact for the trilinear map.
pub fn volume(corners: &[[f64; 3]; 8]) -> f64 {
    let g = 1.0 / 3f64.sqrt();
    CORNERS.iter().map(|c| jacobian(corners, c.map(|s| s * g))).sum()
}

impl Mesh {
    /// Corner positions of a cell, m.
    pub fn corners(&self, cell: &[u32; 8]) -> [[f64; 3]; 8] {
        cell.map(|n| self.nodes[n as usize])
    }

    /// Volume of the hexahedra, m³.
    pub fn volume(&self) -> f64 {
        self.cells.iter().map(|cell| volume(&self.corners(cell))).sum()
    }

    /// The mesh mirrored in the plane z = 0. Nodes keep their numbers; the nodes of cells and facets are reordered so that Jacobians stay positive
    /// and facets point outwards. Twice gives the same mesh again.
    pub fn reflected(&self) -> Mesh {
        Mesh {
            nodes: self.nodes.iter().map(|&[x, y, z]| [x, y, -z]).collect(),
            cells: self.cells.iter().map(|c| [c[4], c[5], c[6], c[7], c[0], c[1], c[2], c[3]]).collect(),
            groups: self
                .groups
                .iter()
                .map(|(name, facets)| (name.clone(), facets.iter().map(|f| [f[0], f[3], f[2], f[1]]).collect()))
                .collect(),
        }
    }

    /// True where the two meshes (both in lower form) are the same body: same numbering, same groups, node positions equal to 1e-12 of the
    /// largest coordinate. Such bodies need to be computed once only.
    pub fn identical(&self, other: &Mesh) -> bool {
        let size = self.nodes.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let near = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(p, q)| (p - q).abs() <= 1e-12 * size);
        self.nodes.len() == other.nodes.len()
            && self.cells == other.cells
            && self.groups == other.groups
            && self.nodes.iter().zip(&other.nodes).all(|(a, b)| near(a, b))
    }

    /// SHA-256 of the mesh, in hexadecimal: coordinates bit by bit, cells, groups.
    pub fn checksum(&self) -> String {
        let mut hash = Sha256::new();
        let mut bytes = Vec::new();
        let mut flush = |bytes: &mut Vec<u8>, force: bool| {
            if force || bytes.len() > 1 << 16 {
                hash.update(&*bytes);
                bytes.clear();
            }
        };
        bytes.extend((self.nodes.len() as u64).to_le_bytes());
        for v in self.nodes.iter().flatten() {
            bytes.extend(v.to_le_bytes());
            flush(&mut bytes, false);
        }
        bytes.extend((self.cells.len() as u64).to_le_bytes());
        for n in self.cells.iter().flatten() {
            bytes.extend(n.to_le_bytes());
            flush(&mut bytes, false);
        }
        for (name, facets) in &self.groups {
            bytes.extend((name.len() as u64).to_le_bytes());
            bytes.extend(name.as_bytes());
            bytes.extend((facets.len() as u64).to_le_bytes());
            for n in facets.iter().flatten() {
                bytes.extend(n.to_le_bytes());
                flush(&mut bytes, false);
            }
        }
        flush(&mut bytes, true);
        hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
    }
}
