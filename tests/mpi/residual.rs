//! Displacement of a node by contact forces, with and without the modes, against closed forms and solves the other way
//! round.

use crate::elasticity::{block, group};
use crate::stability::shared_modes;
use railsqueal::body::fe::FeBody;
use railsqueal::body::residual_flexibility::at_node;
use railsqueal::body::statics::Statics;
use railsqueal::fem::ElasticMaterial;
use railsqueal::grid::ContactGrid;
use railsqueal::parallel::World;
use railsqueal::petsc::Petsc;

const YOUNG: f64 = 205e9;
const SIZE: [f64; 3] = [0.2, 0.15, 0.15];
const CELLS: [usize; 3] = [4, 3, 3];

/// A block without lateral contraction under the plane z = 0, held at its foot, with the contact surface on top.
fn column(world: &World) -> FeBody {
    let mut mesh = block(CELLS, SIZE, |x| x);
    mesh.nodes.iter_mut().for_each(|p| p[2] -= SIZE[2]);
    let face = |k: usize| {
        let node = |i: usize, j: usize| (i + (CELLS[0] + 1) * (j + (CELLS[1] + 1) * k)) as u32;
        let mut facets = Vec::new();
        for j in 0..CELLS[1] {
            for i in 0..CELLS[0] {
                facets.push([node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)]);
            }
        }
        facets
    };
    group(&mut mesh, "contact", &face(CELLS[2]));
    group(&mut mesh, "foot", &face(0));
    let grid = world.is_root().then(|| ContactGrid::from_mesh(&mesh, "contact").unwrap());
    let material = ElasticMaterial { young: YOUNG, poisson: 0.0, density: 7800.0 };
    FeBody::new(world, "lower", world.is_root().then_some(&mesh), grid.as_ref(), material, &["foot".into()]).unwrap()
}

/// The node at `at`, on the rank that owns it.
fn node(body: &FeBody, at: [f64; 3]) -> Option<usize> {
    (0..body.part.owned).find(|&i| (0..3).all(|c| (body.part.coords[i][c] - at[c]).abs() < 1e-9))
}

/// Uniform pressure shortens the column evenly, and forces at one place move another as much as the other way round.
pub fn contact_forces_move_a_node(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let body = column(world);
    let direct = Statics::direct(&petsc, &body).unwrap();
    let iterative = Statics::iterative(&petsc, &body).unwrap();
    for (mut statics, tolerance) in [(direct, 1e-12), (iterative, 1e-8)] {
        for (x, y, z) in [(0.05, 0.1, -0.1), (0.2, 0.0, -0.05), (0.1, 0.15, 0.0)] {
            let node = node(&body, [x, y, z]);
            let rows = body.transfer(world, &mut statics, node).unwrap();
            if world.is_root() {
                // Areas of the nodes over the whole: the force on each under 1 N in all.
                let share = |i: usize, n: usize| if i == 0 || i == n { 0.5 } else { 1.0 } / n as f64;
                let (nx, ny) = (CELLS[0] + 1, CELLS[1] + 1);
                let shares = (0..nx * ny).map(|k| share(k % nx, CELLS[0]) * share(k / nx, CELLS[1]));
                let moved =
                    rows.each_ref().map(|row| shares.clone().enumerate().map(|(k, s)| s * row[3 * k + 2]).sum::<f64>());
                let wanted = [0.0, 0.0, -(z + SIZE[2]) / (YOUNG * SIZE[0] * SIZE[1])];
                let error = (0..3).map(|c| (moved[c] - wanted[c]).abs()).fold(0.0, f64::max);
                assert!(error <= tolerance * wanted[2].abs(), "({x}, {y}, {z}): {moved:?} m/N, expected {wanted:?}");
            }
            let mut largest: f64 = 0.0;
            let mut error: f64 = 0.0;
            for row in [0, 1, 2, 22, 38, 59] {
                let mut forces = vec![0.0; if world.is_root() { 60 } else { 0 }];
                if world.is_root() {
                    forces[row] = 1.0;
                }
                let u = body.response(world, &mut statics, &forces).unwrap();
                let there = body.at_node(world, &u, node);
                if world.is_root() {
                    for c in 0..3 {
                        largest = largest.max(there[c].abs());
                        error = error.max((there[c] - rows[c][row]).abs());
                    }
                }
            }
            assert!(error <= tolerance * largest, "({x}, {y}, {z}): {error:e} of {largest:e} m/N");
        }
        // What is held does not move.
        let held = body.transfer(world, &mut statics, node(&body, [0.1, 0.05, -SIZE[2]])).unwrap();
        assert!(held.iter().flatten().all(|&v| v == 0.0));
    }
}

/// With all modes nothing is left; with few of them, what the others move statically.
pub fn nothing_is_left_by_all_modes(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let body = column(world);
    let mut statics = Statics::direct(&petsc, &body).unwrap();
    let all = 3 * (CELLS[0] + 1) * (CELLS[1] + 1) * CELLS[2];
    let node = node(&body, [0.05, 0.1, -0.1]);
    let mut left = Vec::new();
    for count in [0, 7, all] {
        let modes = shared_modes(world, &body, count);
        let contact = body.contact_modes(world, &modes);
        let motion = at_node(world, &body, &mut statics, &modes, contact.as_ref().map(|m| m.as_ref()), node).unwrap();
        if let (true, 7) = (world.is_root(), count) {
            let whole = by_modes(&motion.modes, &modes.omega, contact.as_ref().unwrap());
            left.push(whole);
        }
        left.push(motion.residual);
    }
    if !world.is_root() {
        return;
    }
    let [whole, of_seven, without_seven, nothing] = &left[..] else { panic!("{} matrices", left.len()) };
    let largest = |m: &[Vec<f64>; 3]| m.iter().flatten().fold(0.0f64, |a, v| a.max(v.abs()));
    let (size, rest, none) = (largest(whole), largest(without_seven), largest(nothing));
    assert!(none < 1e-9 * size, "{none:e} of {size:e} m/N left by all modes");
    assert!(rest > 0.01 * size && rest < size, "{rest:e} of {size:e} m/N left by seven modes");
    for c in 0..3 {
        for (k, v) in without_seven[c].iter().enumerate() {
            let sum = v + of_seven[c][k];
            assert!((sum - whole[c][k]).abs() < 1e-12 * size, "row {k}, direction {c}: {sum:e}, {:e}", whole[c][k]);
        }
    }
}

/// Φ_p Ω⁻² Φ_cᵀ.
fn by_modes(at: &[Vec<f64>; 3], omega: &[f64], contact: &faer::Mat<f64>) -> [Vec<f64>; 3] {
    let entry = |row: &Vec<f64>, i: usize| -> f64 {
        omega.iter().enumerate().map(|(k, w)| row[k] / (w * w) * contact[(i, k)]).sum()
    };
    at.each_ref().map(|row| (0..contact.nrows()).map(|i| entry(row, i)).collect())
}
