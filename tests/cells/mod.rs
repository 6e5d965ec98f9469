//! Meshes of every kind of cell: a unit cube of bricks, each divided into cells of first order; then nodes between,
//! and any map of the cube.

use railsqueal::mesh::{CellKind, Cells, Facet, Mesh};
use std::collections::HashMap;

/// Cells into which a brick is split.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Split {
    /// Itself.
    Brick,
    /// Two wedges, their triangles below and above.
    Wedges,
    /// Six pyramids with their apex in the middle; the one that looks to +x becomes two tetrahedra if it is said so.
    Pyramids { tetrahedra: bool },
    /// Six tetrahedra around the diagonal from the first corner to the last.
    Tetrahedra,
}

/// The unit cube of `n` bricks along each axis; `split` is told the place of a brick.
pub fn cube(n: [usize; 3], split: impl Fn([usize; 3]) -> Split) -> Mesh {
    let mut mesh = Mesh::default();
    let id = |p: [usize; 3]| (p[0] + (n[0] + 1) * (p[1] + (n[1] + 1) * p[2])) as u32;
    for k in 0..=n[2] {
        for j in 0..=n[1] {
            for i in 0..=n[0] {
                mesh.nodes.push([i as f64 / n[0] as f64, j as f64 / n[1] as f64, k as f64 / n[2] as f64]);
            }
        }
    }
    for place in (0..n[0] * n[1] * n[2]).map(|b| [b % n[0], b / n[0] % n[1], b / (n[0] * n[1])]) {
        let corner = |d: [usize; 3]| id(std::array::from_fn(|c| place[c] + d[c]));
        let v = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]].map(corner);
        let mut take =
            |kind, places: &[usize]| mesh.cells.push(kind, &places.iter().map(|&p| v[p]).collect::<Vec<_>>());
        match split(place) {
            Split::Brick => take(CellKind::Hex8, &[0, 1, 2, 3, 4, 5, 6, 7]),
            Split::Wedges => {
                take(CellKind::Wedge6, &[0, 1, 2, 4, 5, 6]);
                take(CellKind::Wedge6, &[0, 2, 3, 4, 6, 7]);
            }
            Split::Tetrahedra => {
                // Along the edges from corner 0 to corner 6 in the six orders of the axes.
                for [a, b] in [[1, 2], [2, 3], [3, 7], [7, 4], [4, 5], [5, 1]] {
                    take(CellKind::Tet4, &[0, a, b, 6]);
                }
            }
            Split::Pyramids { tetrahedra } => {
                let apex = mesh.nodes.len() as u32;
                let middle =
                    std::array::from_fn(|c| 0.5 * (mesh.nodes[v[0] as usize][c] + mesh.nodes[v[6] as usize][c]));
                mesh.nodes.push(middle);
                for base in [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]] {
                    // Outward faces of the brick; the base of a pyramid is counter-clockwise seen from its apex.
                    let [a, b, c, d] = base.map(|p| v[p]);
                    if tetrahedra && base[0] == 1 {
                        mesh.cells.push(CellKind::Tet4, &[a, c, b, apex]);
                        mesh.cells.push(CellKind::Tet4, &[a, d, c, apex]);
                    } else {
                        mesh.cells.push(CellKind::Pyramid5, &[a, d, c, b, apex]);
                    }
                }
            }
        }
    }
    mesh
}

/// All of a cube in one way.
pub fn uniform(n: [usize; 3], split: Split) -> Mesh {
    cube(n, |_| split)
}

/// The mesh with cells of other kinds of the same shapes, `kind`, whose further nodes lie between the corners.
pub fn raised(mesh: &Mesh, mut kind: impl FnMut(CellKind) -> CellKind) -> Mesh {
    let mut out = Mesh { nodes: mesh.nodes.clone(), ..Mesh::default() };
    let mut known: HashMap<Vec<u32>, u32> = HashMap::new();
    for cell in mesh.cells.iter() {
        let kind = kind(cell.kind);
        let mut nodes = cell.nodes.to_vec();
        for around in kind.between() {
            let corners: Vec<u32> = around.iter().map(|&c| cell.nodes[c as usize]).collect();
            let mut key = corners.clone();
            key.sort_unstable();
            nodes.push(*known.entry(key).or_insert_with(|| {
                let mean =
                    |c: usize| corners.iter().map(|&n| mesh.nodes[n as usize][c]).sum::<f64>() / corners.len() as f64;
                out.nodes.push([mean(0), mean(1), mean(2)]);
                out.nodes.len() as u32 - 1
            }));
        }
        out.cells.push(kind, &nodes);
    }
    out
}

/// The kinds of second order: those with nodes in their faces too if `full`.
pub fn second(full: bool) -> impl Fn(CellKind) -> CellKind {
    move |kind| match kind.linear() {
        CellKind::Tet4 => CellKind::Tet10,
        CellKind::Pyramid5 => CellKind::Pyramid13,
        CellKind::Wedge6 if full => CellKind::Wedge18,
        CellKind::Wedge6 => CellKind::Wedge15,
        _ if full => CellKind::Hex27,
        _ => CellKind::Hex20,
    }
}

/// The mesh with its nodes elsewhere, those that come to lie on each other joined.
pub fn mapped(mesh: &Mesh, map: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let mut out = Mesh::default();
    let mut known: HashMap<[i64; 3], u32> = HashMap::new();
    let number: Vec<u32> = mesh
        .nodes
        .iter()
        .map(|&x| {
            let x = map(x);
            *known.entry(x.map(|v| (v * 1e9).round() as i64)).or_insert_with(|| {
                out.nodes.push(x);
                out.nodes.len() as u32 - 1
            })
        })
        .collect();
    out.cells = mesh.cells.renumbered(|n| number[n as usize]);
    out
}

/// Names the facets on the boundary whose corners all lie where it is said.
pub fn named(mesh: &mut Mesh, name: &str, there: impl Fn([f64; 3]) -> bool) {
    let mut facets = Vec::new();
    for (c, cell) in mesh.cells.iter().enumerate() {
        for face in 0..cell.kind.faces().len() {
            if cell.facet_corners(face).all(|n| there(mesh.nodes[n as usize])) {
                facets.push(Facet { cell: c as u32, face: face as u8 });
            }
        }
    }
    let sharing = mesh.cells.sharing(&facets);
    let mut sharing = sharing.iter();
    facets.retain(|_| sharing.next() == Some(&1));
    mesh.groups.insert(name.into(), facets);
}

/// Four slabs along x: wedges, bricks, pyramids that become tetrahedra towards the last one, tetrahedra.
pub fn mixed(n: usize) -> Mesh {
    cube([4 * n, n, n], |p| match p[0] / n {
        0 => Split::Wedges,
        1 => Split::Brick,
        2 => Split::Pyramids { tetrahedra: p[0] == 3 * n - 1 },
        _ => Split::Tetrahedra,
    })
}

/// Every mesh of one kind of cell, and the mixed ones, of first and second order.
pub fn all(n: usize) -> Vec<(String, Mesh)> {
    let of = |split| uniform([n; 3], split);
    let linear =
        [of(Split::Tetrahedra), of(Split::Pyramids { tetrahedra: false }), of(Split::Wedges), of(Split::Brick)];
    let mut all = Vec::new();
    for mesh in linear {
        let kind = mesh.cells.get(0).kind;
        let mut kinds = vec![kind, second(false)(kind)];
        if second(true)(kind) != second(false)(kind) {
            kinds.push(second(true)(kind));
        }
        all.extend(kinds.into_iter().map(|k| (format!("{k:?}"), raised(&mesh, |_| k))));
    }
    let mixed = mixed(n);
    all.push(("mixed, first order".into(), mixed.clone()));
    all.push(("mixed, second order".into(), raised(&mixed, second(false))));
    let full = cube([2 * n, n, n], |p| if p[0] < n { Split::Wedges } else { Split::Brick });
    all.push(("wedges and hexahedra with nodes in their faces".into(), raised(&full, second(true))));
    all
}

/// A ring about an axis parallel to y with the contact point at the origin: the cube's x is the radius, its y the
/// angle, its z the width, m.
pub fn ring(mesh: &Mesh, inner: f64, outer: f64, width: f64) -> Mesh {
    let mut ring = mapped(mesh, |[r, angle, y]| {
        let (r, angle) = (inner + (outer - inner) * r, 2.0 * std::f64::consts::PI * angle);
        [r * angle.sin(), width * (y - 0.5), r * angle.cos() - outer]
    });
    let radius = move |x: [f64; 3]| x[0].hypot(x[2] + outer);
    named(&mut ring, "inner", |x| (radius(x) - inner).abs() < 1e-9);
    named(&mut ring, "outer", |x| (radius(x) - outer).abs() < 1e-9);
    ring
}

/// Number of cells of each kind.
pub fn census(cells: &Cells) -> HashMap<CellKind, usize> {
    cells.iter().fold(HashMap::new(), |mut n, c| {
        *n.entry(c.kind).or_default() += 1;
        n
    })
}
