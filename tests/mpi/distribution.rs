//! Distribution of a mesh: every rank's part against the whole mesh.

use railsqueal::mesh::cylinder::{self, CylinderSpec};
use railsqueal::mesh::distribute::{distribute, MeshPart};
use railsqueal::mesh::{CellKind, Cells, Facet, Mesh};
use railsqueal::parallel::World;
use std::collections::BTreeSet;

fn wheel() -> Mesh {
    let spec = CylinderSpec {
        inner_radius: 0.1,
        outer_radius: 0.5,
        thickness: 0.1,
        crown_radius: Some(0.5),
        contact_offset: 0.01,
        element_size: 2e-3,
        growth: 1.5,
        max_element_size: None,
        patch_half_length: 6e-3,
        patch_half_width: 6e-3,
    };
    cylinder::build(&spec).expect("a valid cylinder")
}

fn cube() -> Mesh {
    let nodes = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
    ];
    let groups = [("bottom".to_string(), vec![Facet { cell: 0, face: 0 }])].into();
    let mut cells = Cells::default();
    cells.push(CellKind::Hex8, &[0, 1, 2, 3, 4, 5, 6, 7]);
    Mesh { nodes, cells, groups, ..Mesh::default() }
}

/// Checks the parts against the mesh, which every rank holds.
pub fn check(world: &World, mesh: &Mesh) -> MeshPart {
    let part = distribute(world, world.is_root().then_some(mesh)).expect("a distribution");
    let n = mesh.nodes.len();
    assert_eq!(part.ranges.len(), world.size + 1);
    assert_eq!((part.ranges[0], part.ranges[world.size]), (0, n as u64));
    assert_eq!(part.owned as u64, part.ranges[world.rank + 1] - part.ranges[world.rank]);
    let renumbered = world.broadcast(part.renumbered.clone());
    assert_eq!(renumbered.iter().collect::<BTreeSet<_>>().len(), n, "the renumbering is a permutation");
    let mut original = vec![0usize; n];
    renumbered.iter().enumerate().for_each(|(old, &new)| original[new as usize] = old);

    let first = part.ranges[world.rank];
    for (k, &id) in part.node_ids.iter().enumerate() {
        let owned = id >= first && id < first + part.owned as u64;
        assert_eq!(owned, k < part.owned, "owned nodes come first");
        assert_eq!(part.coords[k], mesh.nodes[original[id as usize]]);
    }
    assert!((0..part.owned).all(|k| part.node_ids[k] == first + k as u64), "owned nodes are in order");
    assert!(part.node_ids[part.owned..].windows(2).all(|w| w[0] < w[1]), "ghosts ascend");

    // Exactly the cells that touch an owned node, with their nodes in order; each owned once in the world.
    let here = |node: u32| (first..first + part.owned as u64).contains(&renumbered[node as usize]);
    let expected: Vec<u64> =
        (0..mesh.cells.len() as u64).filter(|&e| mesh.cells.get(e as usize).nodes.iter().any(|&i| here(i))).collect();
    assert_eq!(part.cell_ids, expected);
    for (cell, &e) in part.cells.iter().zip(&part.cell_ids) {
        let back = cell.nodes.iter().map(|&k| original[part.node_ids[k as usize] as usize] as u32);
        let there = mesh.cells.get(e as usize);
        assert!(cell.kind == there.kind && back.eq(there.nodes.iter().copied()));
    }
    let mine: Vec<u64> = part.cell_ids.iter().zip(&part.cell_owned).filter(|(_, o)| **o).map(|(e, _)| *e).collect();
    let mut all = world.all_gather(&mine);
    all.sort_unstable();
    assert_eq!(all, (0..mesh.cells.len() as u64).collect::<Vec<_>>(), "each cell has one owner");

    let names: Vec<&String> = part.groups.keys().collect();
    assert_eq!(names, mesh.groups.keys().collect::<Vec<_>>());
    for (name, local) in &part.groups {
        let members: BTreeSet<u32> = mesh.groups[name].iter().flat_map(|&f| mesh.cells.facet(f)).collect();
        let found: Vec<u32> = local.iter().map(|&k| original[part.node_ids[k as usize] as usize] as u32).collect();
        assert!(found.iter().all(|i| members.contains(i)));
        let expected = part.node_ids.iter().filter(|&&id| members.contains(&(original[id as usize] as u32))).count();
        assert_eq!(found.len(), expected, "group {name}");
    }
    part
}

/// A wheel, evenly divided, with a cut near that of the best plane sections.
pub fn a_wheel_is_divided_evenly(world: &World) {
    let mesh = wheel();
    let part = check(world, &mesh);
    let share = mesh.nodes.len() as f64 / world.size as f64;
    assert!((part.owned as f64) < 1.1 * share && (part.owned as f64) > 0.9 * share, "{} of {share}", part.owned);
    if world.size == 1 {
        assert_eq!(part.edge_cut, 0);
    } else {
        // Two plane sections through the wheel cut about the nodes of a section each; METIS must not be far above.
        let section = 2.0 * (mesh.nodes.len() as f64).powf(2.0 / 3.0);
        assert!(part.edge_cut > 0 && (part.edge_cut as f64) < world.size as f64 * section, "{}", part.edge_cut);
    }
    let again = distribute(world, world.is_root().then_some(&mesh)).expect("a distribution");
    assert_eq!(part.node_ids, again.node_ids, "the same mesh is divided in the same way");
}

/// One cell: some ranks hold few nodes.
pub fn one_cell(world: &World) {
    let part = check(world, &cube());
    assert_eq!(part.cells.len(), 1);
}

/// Nothing at all: every rank is left empty.
pub fn no_cells(world: &World) {
    let part = check(world, &Mesh::default());
    assert_eq!((part.owned, part.cells.len()), (0, 0));
}

/// Fewer nodes than ranks.
pub fn a_rank_without_nodes(world: &World) {
    let mesh = Mesh { nodes: vec![[0.0; 3]], ..Mesh::default() };
    let part = check(world, &mesh);
    assert_eq!(part.owned, usize::from(world.rank == 0));
}

/// The missing mesh of rank 0 is an error on every rank.
pub fn no_mesh(world: &World) {
    assert_eq!(distribute(world, None).expect_err("no mesh").exit_code(), 1);
}
