//! The rectilinear grid of contact nodes that a body offers to the interface.

use super::transfer::Transfer;
use crate::mesh::{Facet, FacetKind, Mesh};
use crate::{Error, Result};

/// Tensor-product grid of surface nodes around the contact point. Node `(i, j)` has index `i + nx*j`.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactGrid {
    /// Longitudinal node positions, m, `[nx]`, ascending.
    pub x: Vec<f64>,
    /// Lateral node positions, m, `[ny]`, ascending.
    pub y: Vec<f64>,
    /// How the mesh of the body meets the grid; none of a body without a mesh of three dimensions.
    pub transfer: Option<Transfer>,
    /// Height z of the surface of the body in lower form at each grid node, m, `[nx*ny]`; 0 at the contact point,
    /// negative away from it.
    pub z: Vec<f64>,
}

/// Nodes of one grid line may differ by this part of the shortest facet edge.
const LINE: f64 = 1e-5;

/// Distinct values of `values`, ascending, those nearer than `tolerance` taken for one (their mean); and the index of
/// the line of each value.
fn lines(values: &[f64], tolerance: f64) -> (Vec<f64>, Vec<usize>) {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let (mut out, mut line): (Vec<f64>, Vec<usize>) = (Vec::new(), vec![0; values.len()]);
    for run in order.chunk_by(|&a, &b| values[b] - values[a] <= tolerance) {
        run.iter().for_each(|&i| line[i] = out.len());
        // Equal values stay as they are to the last bit.
        let (first, last) = (values[run[0]], values[run[run.len() - 1]]);
        out.push(if first == last { first } else { run.iter().map(|&i| values[i]).sum::<f64>() / run.len() as f64 });
    }
    (out, line)
}

impl ContactGrid {
    /// Finds the grid in the facet group `group` of a mesh in lower form. Its nodes must lie on lines x = const and y
    /// = const, each pair of lines meeting in a node, and its facets must be the boundary facets between them, facing
    /// +z.
    pub fn from_mesh(mesh: &Mesh, group: &str) -> Result<ContactGrid> {
        mesh.require_group(group, "the mesh")?;
        let facets = &mesh.groups[group];
        let place = |n: u32| {
            let [x, y, z] = mesh.nodes[n as usize];
            format!("({x:.6e}, {y:.6e}, {z:.6e}) m")
        };
        let wrong = |what: String| {
            Error::Input(format!(
                "group \"{group}\" is no rectilinear grid in x and y: {what}; expected structured \
                 quadrilaterals of 4 or 9 nodes with edges along x and y (in plan)"
            ))
        };
        let corners = rectangles(mesh, facets).map_err(wrong)?;
        let mut nodes: Vec<u32> = corners.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let mut shortest = f64::INFINITY;
        for f in &corners {
            for k in 0..4 {
                let (a, b) = (mesh.nodes[f[k] as usize], mesh.nodes[f[(k + 1) % 4] as usize]);
                shortest = shortest.min((a[0] - b[0]).hypot(a[1] - b[1]));
            }
        }
        let coordinate = |c: usize| nodes.iter().map(|&n| mesh.nodes[n as usize][c]).collect::<Vec<f64>>();
        let (x, ix) = lines(&coordinate(0), LINE * shortest);
        let (y, iy) = lines(&coordinate(1), LINE * shortest);
        let (nx, ny) = (x.len(), y.len());
        if nx.checked_mul(ny) != Some(nodes.len()) {
            // The emptiest line in x shows where.
            let mut members = vec![0usize; nx];
            ix.iter().for_each(|&i| members[i] += 1);
            let i = (0..nx).min_by_key(|&i| members[i]).unwrap_or(0);
            let n = ix.iter().position(|&l| l == i).map_or(0, |k| nodes[k]);
            return Err(wrong(format!(
                "{} nodes on {nx} lines x = const and {ny} lines y = const; the line x = {:.6e} m, through the \
                 node at {}, has {} of {ny} nodes",
                nodes.len(),
                x[i],
                place(n),
                members[i]
            )));
        }
        let mut at = vec![u32::MAX; nx * ny];
        for (k, &n) in nodes.iter().enumerate() {
            let slot = &mut at[ix[k] + nx * iy[k]];
            if *slot != u32::MAX {
                return Err(wrong(format!("the nodes at {} and {} lie above each other", place(*slot), place(n))));
            }
            *slot = n;
        }
        if nx < 2 || ny < 2 {
            return Err(wrong(format!("{nx} by {ny} nodes")));
        }

        // Each facet must fill one rectangle of the grid, counter-clockwise seen from +z, and none be left.
        let index_of = |n: u32| nodes.binary_search(&n).map(|k| (ix[k], iy[k])).unwrap_or((usize::MAX, usize::MAX));
        let mut filled = vec![false; (nx - 1) * (ny - 1)];
        for f in &corners {
            let [a, b, c, d] = f.map(index_of);
            let i = a.0.min(b.0).min(c.0).min(d.0);
            let j = a.1.min(b.1).min(c.1).min(d.1);
            let ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let begins = |start: usize, step: usize| {
                [a, b, c, d].iter().enumerate().all(|(k, &p)| p == ring[(start + k * step) % 4])
            };
            if (0..4).any(|s| begins(s, 3)) {
                return Err(Error::Input(format!(
                    "group \"{group}\": the facet at {} faces -z; expected a surface whose outward normal is +z \
                     on the lower body, -z on the upper one",
                    place(f[0])
                )));
            }
            if !(0..4).any(|s| begins(s, 1)) {
                return Err(wrong(format!("the facet at {} is no rectangle of the grid", place(f[0]))));
            }
            if std::mem::replace(&mut filled[i + (nx - 1) * j], true) {
                return Err(wrong(format!("two facets at {}", place(f[0]))));
            }
        }
        if let Some(k) = filled.iter().position(|f| !f) {
            let n = at[k % (nx - 1) + nx * (k / (nx - 1))];
            return Err(wrong(format!("no facet behind the node at {}", place(n))));
        }
        if let Some(k) = mesh.cells.sharing(facets).iter().position(|&n| n > 1) {
            return Err(Error::Input(format!(
                "group \"{group}\": the facet at {} lies between two cells; expected facets on the boundary",
                place(mesh.cells.facet(facets[k]).next().unwrap_or_default())
            )));
        }
        let z = at.iter().map(|&n| mesh.nodes[n as usize][2]).collect();
        Ok(ContactGrid { x, y, transfer: Some(Transfer::Nodes(at)), z })
    }

    /// A grid of the lines `x` and `y`, m, with the heights `z`, m, `[nx*ny]`, of a body that has no mesh to meet it
    /// with.
    pub(crate) fn meshless(x: Vec<f64>, y: Vec<f64>, z: Vec<f64>) -> ContactGrid {
        ContactGrid { x, y, transfer: None, z }
    }

    /// Number of nodes, nx·ny.
    pub fn len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    /// True for a grid without nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Mesh node (index into [`Mesh::nodes`]) of each grid node, `[nx*ny]`; none where they are no nodes of a mesh.
    pub fn nodes(&self) -> &[u32] {
        match &self.transfer {
            Some(Transfer::Nodes(nodes)) => nodes,
            _ => &[],
        }
    }

    /// Checks that two bodies (`a` lower, `b` upper, both in lower form) have their contact nodes at the same x and
    /// y, within `tolerance` (m).
    pub fn matched(a: &ContactGrid, b: &ContactGrid, tolerance: f64) -> Result<()> {
        for (name, p, q) in [("x", &a.x, &b.x), ("y", &a.y, &b.y)] {
            let wrong = |what: String| {
                Err(Error::Input(format!(
                    "the contact grids of the two bodies do not match: {what}; expected the same lines {name} = \
                     const within {tolerance:.1e} m on both"
                )))
            };
            if let Some(k) = (0..p.len().min(q.len())).find(|&k| (p[k] - q[k]).abs() > tolerance) {
                return wrong(format!(
                    "line {} is {name} = {:.9e} m on the lower, {:.9e} m on the upper body",
                    k + 1,
                    p[k],
                    q[k]
                ));
            }
            if p.len() != q.len() {
                return wrong(format!("{} lines {name} = const on the lower, {} on the upper body", p.len(), q.len()));
            }
        }
        Ok(())
    }
}

/// Rectangles that facets are divided into, corners outward: a quadrilateral of four nodes is one, one of nine is
/// four. Else what is wrong.
fn rectangles(mesh: &Mesh, facets: &[Facet]) -> std::result::Result<Vec<[u32; 4]>, String> {
    let mut all = Vec::with_capacity(facets.len());
    for &facet in facets {
        let kind = mesh.cells.get(facet.cell as usize).kind.faces()[facet.face as usize].kind;
        let nodes: Vec<u32> = mesh.cells.facet(facet).collect();
        let divided: &[[usize; 4]] = match kind {
            FacetKind::Quad4 => &[[0, 1, 2, 3]],
            FacetKind::Quad9 => &[[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]],
            FacetKind::Tri3 | FacetKind::Tri6 | FacetKind::Quad8 => {
                let [x, y, z] = mesh.nodes[nodes[0] as usize];
                let why = if kind == FacetKind::Quad8 {
                    ", which has no node in its middle (27-node hexahedra and 18-node wedges have)"
                } else {
                    ""
                };
                return Err(format!("the facet at ({x:.6e}, {y:.6e}, {z:.6e}) m is a {}{why}", kind.name()));
            }
        };
        all.extend(divided.iter().map(|piece| piece.map(|k| nodes[k])));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cylinder::{build, CylinderSpec, DEFAULT_GROWTH};
    use crate::mesh::CellKind;

    fn wheel() -> (Mesh, ContactGrid) {
        let spec = CylinderSpec {
            inner_radius: 0.1,
            outer_radius: 0.5,
            thickness: 0.1,
            crown_radius: Some(0.5),
            contact_offset: 0.01,
            element_size: 2e-3,
            growth: DEFAULT_GROWTH,
            max_element_size: None,
            patch_half_length: 6e-3,
            patch_half_width: 4e-3,
        };
        let mesh = build(&spec).expect("a valid cylinder");
        let grid = ContactGrid::from_mesh(&mesh, "contact").expect("a patch");
        (mesh, grid)
    }

    /// Nodes on the lines that the specification asks for, to the last bit, and the height of the body of revolution.
    #[test]
    fn the_grid_of_a_cylinder_is_found() {
        let (mesh, grid) = wheel();
        let line = |n: i32| (-n..=n).map(|i| f64::from(i) * 2e-3).collect::<Vec<f64>>();
        assert_eq!((grid.x.clone(), grid.y.clone()), (line(3), line(2)));
        for (k, (&n, &z)) in grid.nodes().iter().zip(&grid.z).enumerate() {
            assert_eq!(mesh.nodes[n as usize], [grid.x[k % 7], grid.y[k / 7], z]);
        }
        assert_eq!(grid.z[3 + 7 * 2], 0.0);
    }

    /// `change` the mesh and expect the word in the error.
    fn refused(change: impl FnOnce(&mut Mesh), word: &str) {
        let (mut mesh, _) = wheel();
        change(&mut mesh);
        let error = ContactGrid::from_mesh(&mesh, "contact").expect_err(word);
        assert_eq!(error.exit_code(), 3);
        assert!(error.message().contains(word), "{word} not in: {error}");
    }

    #[test]
    fn what_is_no_grid_is_refused_with_the_place() {
        let (_, grid) = wheel();
        let inner = grid.nodes()[3 + 7 * 2] as usize;
        refused(|m| m.nodes[inner][0] += 1e-4, "lines x = const");
        refused(|m| drop(m.groups.remove("contact")), "found: \"inner\", \"outer\"");
        refused(|m| m.groups.get_mut("contact").expect("group").clear(), "no group \"contact\"");
        refused(
            |m| {
                m.groups.get_mut("contact").expect("group").swap_remove(8);
            },
            "no facet behind",
        );
        refused(
            |m| {
                m.groups.get_mut("contact").expect("group").swap_remove(0);
            },
            "lines x = const",
        );
        refused(
            |m| {
                let facets = m.groups.get_mut("contact").expect("group");
                facets.push(facets[0]);
            },
            "two facets",
        );
        refused(|m| *m = m.reflected(), "faces -z");
        refused(|m| twist(m, &grid), "no rectangle");
        refused(
            |m| {
                let side = m.groups["side_plus"].clone();
                m.groups.insert("contact".into(), side);
            },
            "rectilinear",
        );
        refused(
            |m| {
                let under = m.groups["contact"][0].cell as usize;
                let nodes = m.cells.get(under).nodes.to_vec();
                m.cells.push(CellKind::Hex8, &nodes);
            },
            "between two cells",
        );
    }

    /// Exchanges two neighbouring nodes of the grid in all cells.
    fn twist(mesh: &mut Mesh, grid: &ContactGrid) {
        let (a, b) = (grid.nodes()[2], grid.nodes()[3]);
        mesh.cells = mesh.cells.renumbered(|n| {
            if n == a {
                b
            } else if n == b {
                a
            } else {
                n
            }
        });
    }

    #[test]
    fn grids_that_do_not_match_are_refused_with_the_first_difference() {
        let (_, a) = wheel();
        assert!(ContactGrid::matched(&a, &a, 0.0).is_ok());
        let mut b = a.clone();
        b.y[1] += 1e-6;
        assert!(ContactGrid::matched(&a, &b, 2e-6).is_ok());
        let error = ContactGrid::matched(&a, &b, 1e-9).expect_err("different y");
        assert!(error.exit_code() == 3 && error.message().contains("line 2 is y = "), "{error}");
        b.y.pop();
        b.y[1] = a.y[1];
        let error = ContactGrid::matched(&a, &b, 1e-9).expect_err("different number");
        assert!(error.message().contains("5 lines y = const on the lower, 4 on the upper"), "{error}");
    }
}
