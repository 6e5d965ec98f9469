//! Every kind of cell, alone and mixed, distributed: patch test, order of convergence, modes of an annulus, rotation,
//! radiators.

use crate::cells::{all, census, mapped, mixed, named, raised, ring, second, uniform, Split};
use railsqueal::body::elements::{Elements, StaticMethod};
use railsqueal::body::fe::FeBody;
use railsqueal::body::modes::Extent;
use railsqueal::body::ElasticBody;
use railsqueal::fem::assembly::{volume, Assembly, Operators};
use railsqueal::fem::dofs::{DofMap, FIXED};
use railsqueal::fem::rotation::Axis;
use railsqueal::fem::{stress, ElasticMaterial};
use railsqueal::mesh::distribute::{distribute, MeshPart};
use railsqueal::mesh::{CellKind, Mesh};
use railsqueal::parallel::World;
use railsqueal::petsc::csr::dot;
use railsqueal::petsc::mumps::{Factor, FactorOptions, Symmetry};
use railsqueal::petsc::Petsc;
use std::f64::consts::PI;

const STEEL: ElasticMaterial = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800. };

fn body(world: &World, mesh: &Mesh, fixed: &[String]) -> (MeshPart, DofMap, Operators) {
    let part = distribute(world, world.is_root().then_some(mesh)).unwrap();
    let dofs = DofMap::new(world, &part, fixed);
    let operators = Operators::new(world, &part, &dofs, &STEEL).unwrap();
    (part, dofs, operators)
}

fn field(part: &MeshPart, dofs: &DofMap, u: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
    (0..part.owned).filter(|&n| dofs.local[n] != FIXED).flat_map(|n| u(part.coords[n])).collect()
}

/// Corners within the cube moved by up to a tenth of a brick.
fn shaken(mesh: &Mesh) -> Mesh {
    let size = mesh.nodes.iter().map(|x| x[0]).filter(|x| *x > 1e-9).fold(1.0, f64::min);
    let corners = mapped(mesh, |x| {
        let s =
            [12.9898 * x[0] + 78.233 * x[1], 3.1 * x[0] - 57.0 * x[1] + 9.2 * x[2], 41.0 * x[0] * x[1] - 17.0 * x[2]];
        let inner = x.iter().all(|v| *v > 1e-9 && *v < 1.0 - 1e-9);
        std::array::from_fn(|c| if inner { x[c] + 0.1 * size * (s[c] * 43.7).sin() } else { x[c] })
    });
    assert_eq!(corners.nodes.len(), mesh.nodes.len());
    corners
}

/// A mesh of first order with its corners shaken, brought to the order of `mesh`, whose corners are its first nodes:
/// its edges stay straight.
fn distorted(mesh: &Mesh) -> Mesh {
    let corners = mesh.cells.iter().flat_map(|c| &c.nodes[..c.kind.corners()]).max().map_or(0, |n| *n as usize + 1);
    let mut linear = Mesh { nodes: mesh.nodes[..corners].to_vec(), ..Mesh::default() };
    mesh.cells.iter().for_each(|c| linear.cells.push(c.kind.linear(), &c.nodes[..c.kind.corners()]));
    let linear = shaken(&linear);
    let mut kinds = mesh.cells.iter().map(|c| c.kind);
    raised(&linear, |_| kinds.next().unwrap())
}

/// A linear displacement makes no force within a distorted mesh and the same stress everywhere, a rigid motion no
/// force at all; mass and volume.
pub fn patch_test(world: &World) {
    for (name, mesh) in all(2) {
        let mesh = distorted(&mesh);
        let (part, dofs, ops) = body(world, &mesh, &[]);
        let k = ops.stiffness.operator(world);
        let scale = ops.stiffness.max_abs(world);
        let inner = |x: [f64; 3]| x.iter().all(|v| *v > 1e-9 && *v < 1.0 - 1e-9);
        let linear = |x: [f64; 3]| [1e-3 * x[0] - 2e-3 * x[1], 3e-3 * x[2] + 1e-3, 1e-3 * x[1] - 4e-3 * x[2]];
        let rotation = |x: [f64; 3]| [0.3 - 0.5 * x[1] + 0.2 * x[2], 0.5 * x[0] - 0.7 * x[2], -0.2 * x[0] + 0.7 * x[1]];
        for (u, everywhere, size) in [(&linear as &dyn Fn([f64; 3]) -> [f64; 3], false, 1e-3), (&rotation, true, 1.0)] {
            let x = field(&part, &dofs, u);
            let mut f = vec![0.0; x.len()];
            k.apply(world, &x, &mut f);
            let tested = (0..part.owned).filter(|&n| everywhere || inner(part.coords[n]));
            let worst =
                world.max(tested.flat_map(|n| f[3 * n..3 * n + 3].to_vec()).fold(0.0, |m: f64, v| m.max(v.abs())));
            assert!(
                worst < 1e-12 * scale * size,
                "{name}: force {worst:e} N, stiffness {scale:e} N/m, displacement {size:e} m"
            );
        }
        // ε = (1e-3, 0, −4e-3; −2e-3, 4e-3, 0).
        let (l, mu) = STEEL.lame();
        let [xx, yy, zz] = [1e-3, 0.0, -4e-3].map(|e| 2.0 * mu * e - 3e-3 * l);
        let (xy, yz) = (-2e-3 * mu, 4e-3 * mu);
        let exact =
            (0.5 * ((xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2)) + 3. * (xy * xy + yz * yz)).sqrt();
        let u: Vec<[f64; 3]> = part.coords.iter().map(|&x| linear(x)).collect();
        for s in stress::von_mises(&part, &u, &STEEL) {
            assert!((s / exact - 1.0).abs() < 1e-10, "{name}: {s} Pa, exact {exact} Pa");
        }
        let ones = field(&part, &dofs, |_| [0.0, 1.0, 0.0]);
        let mut weighed = vec![0.0; ones.len()];
        ops.mass.operator(world).apply(world, &ones, &mut weighed);
        let (mass, all) = (dot(world, &ones, &weighed), volume(world, &part));
        assert!((mass / 7800.0 - 1.0).abs() < 1e-12 && (all - 1.0).abs() < 1e-12, "{name}: {mass} kg, {all} m³");
    }
}

/// Energy of a cube clamped all around under the load of u = (1, ½, −¼) sin πx sin πy sin πz, which is smooth: it
/// converges at twice the order of the elements to ∫ f·u dV = π² (λ + 4μ) |a|²/8.
pub fn convergence_order(world: &World) {
    let (l, mu) = STEEL.lame();
    let a = [1.0, 0.5, -0.25];
    let exact = PI * PI * (l + 4.0 * mu) * a.iter().map(|a| a * a).sum::<f64>() / 8.0;
    // f = −μ Δu − (λ + μ) ∇ div u.
    let force = |x: [f64; 3]| -> [f64; 3] {
        let (s, c) = (x.map(|v| (PI * v).sin()), x.map(|v| (PI * v).cos()));
        let second = |i: usize, j: usize| -> f64 {
            let factor = |k: usize| if i != j && (k == i || k == j) { c[k] } else { s[k] };
            PI * PI * (0..3).map(factor).product::<f64>() * if i == j { -1.0 } else { 1.0 }
        };
        std::array::from_fn(|i| {
            let gradient: f64 = (0..3).map(|j| a[j] * second(i, j)).sum();
            3.0 * PI * PI * mu * a[i] * s[0] * s[1] * s[2] - (l + mu) * gradient
        })
    };
    let error = |mesh: &Mesh| {
        let mut mesh = mesh.clone();
        named(&mut mesh, "all", |_| true);
        let (part, dofs, ops) = body(world, &mesh, &["all".into()]);
        let load = Assembly::new(world, &part, &dofs).unwrap().load(force);
        let mut u = load.clone();
        let mut factor = Factor::new(world, &ops.stiffness, FactorOptions::new(Symmetry::Positive), "cube").unwrap();
        factor.solve(&mut u, 1).unwrap();
        1.0 - dot(world, &load, &u) / exact
    };
    let linear = |mesh: &Mesh| mesh.cells.iter().all(|c| c.kind == c.kind.linear());
    for (first, n, least) in [(true, 4, 1.7), (false, 2, 3.4)] {
        let meshes = |n: usize| all(n).into_iter().filter(move |(_, m)| linear(m) == first);
        for ((name, coarse), (_, fine)) in meshes(n).zip(meshes(2 * n)) {
            let [a, b] = [coarse, fine].map(|mesh| error(&mesh));
            let order = (a / b).log2();
            if world.is_root() && std::env::var("ELEMENTS").is_ok() {
                println!("{name}: errors {a:.3e} {b:.3e}, order {order:.2}");
            }
            assert!(order > least, "{name}: errors {a:e} and {b:e}, order {order:.2}");
        }
    }
}

/// First frequencies, Hz, of the free ring without rigid motions, from an axisymmetric solution.
fn free_ring() -> Vec<f64> {
    let rows = include_str!("../../docs/data/annulus_modes.csv").lines().filter(|l| l.starts_with("free"));
    rows.skip(6).map(|l| l.split(',').nth(2).and_then(|f| f.parse().ok()).expect("a frequency")).collect()
}

/// A ring of `n` bricks along radius, angle and width, or what they are split into, of second order.
fn annulus(world: &World, n: [usize; 3], split: Split, full: bool, fixed: &[String]) -> (Mesh, FeBody) {
    let cube = raised(&uniform(n, split), second(full));
    // Finer towards the bore.
    let graded = mapped(&cube, |[r, a, y]| [r * (0.5 + 0.5 * r), a, y]);
    let mesh = ring(&graded, 0.1, 0.5, 0.1);
    let body = FeBody::new(world, "ring", world.is_root().then_some(&mesh), None, STEEL, fixed).expect("a body");
    (mesh, body)
}

/// Frequencies of free rings of second-order cells converge at nearly the fourth order, from meshes that are coarse;
/// the rotation forms of one with a clamped bore.
pub fn modes_of_an_annulus(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let axis = Axis::below(0.5);
    for (split, full) in [
        (Split::Brick, false),
        (Split::Brick, true),
        (Split::Wedges, false),
        (Split::Wedges, true),
        (Split::Tetrahedra, false),
        (Split::Pyramids { tetrahedra: false }, false),
    ] {
        let errors = |n: [usize; 3]| -> Vec<f64> {
            let (_, fe) = annulus(world, n, split, full, &[]);
            let mut body = Elements::new(&petsc, fe, StaticMethod::Direct);
            body.factorise().unwrap();
            let omega = body.modes(Extent::Count(12), &mut |_, _| {}).unwrap().omega;
            assert!(omega[..6].iter().all(|w| *w == 0.0), "{omega:?}");
            omega[6..].iter().zip(free_ring()).map(|(w, f)| w / (2.0 * PI * f) - 1.0).collect()
        };
        let [coarse, fine] = [[3, 16, 1], [6, 32, 2]].map(errors);
        let largest = |e: &[f64]| e.iter().fold(0.0f64, |m, e| m.max(e.abs()));
        let (a, b) = (largest(&coarse), largest(&fine));

        let (mesh, fe) = annulus(world, [6, 24, 1], split, full, &["inner".into()]);
        let kinds: Vec<CellKind> = census(&mesh.cells).into_keys().collect();
        railsqueal::body::rotation::of_revolution(world, &fe, axis).expect("of revolution");
        let mut body = Elements::new(&petsc, fe, StaticMethod::Direct).rotating(axis).unwrap();
        body.factorise().unwrap();
        let modes = body.modes(Extent::Count(12), &mut |_, _| {}).unwrap();
        // φ_sᵀGφ_c = 2g of the pair of one nodal diameter, g = 0.98363 (axisymmetric solution, see `rotation`).
        let rotation = modes.rotation.as_ref().unwrap();
        let diameters = rotation.diameters();
        let pair: Vec<usize> = (0..12).filter(|&k| (diameters[k] - 1.0).abs() < 0.05).take(2).collect();
        let [c, s] = pair[..] else { panic!("{kinds:?}: no pair of one nodal diameter in {diameters:?}") };
        let g = 0.5 * rotation.gyroscopic[(c, s)].abs();
        if world.is_root() && std::env::var("ELEMENTS").is_ok() {
            println!("{kinds:?}: largest errors {a:.2e}, {b:.2e}, order {:.2}; g = {g}", (a / b).log2());
        }
        assert!(b < 0.01 && a / b > 8.0, "{kinds:?}: {coarse:?}, {fine:?}");
        assert!((g / 0.98363 - 1.0).abs() < 2e-3, "{kinds:?}: g = {g}");
    }
}

/// The free surface as radiators: area, and the square of a motion along the axis, of faces with three and four
/// corners.
pub fn radiators_of_any_faces(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    for split in [Split::Brick, Split::Wedges, Split::Tetrahedra] {
        let (_, fe) = annulus(world, [4, 24, 1], split, false, &["inner".into()]);
        let own = fe.part.owned;
        let fixed = |n: usize| fe.dofs.local[n] == FIXED;
        let vector: Vec<f64> = (0..own).filter(|&n| !fixed(n)).flat_map(|_| [0.0, 1.0, 0.0]).collect();
        let modes = railsqueal::body::fe::BodyModes { omega: vec![1.0], residual: vec![0.0], vectors: vec![vector] };
        let body = Elements::new(&petsc, fe, StaticMethod::Direct);
        let found = railsqueal::sound::surface::radiators(world, &body, &modes, 0.02);
        let side = PI * (0.25 - 0.01);
        let area = 2.0 * side + 2.0 * PI * 0.6 * 0.1;
        assert!((found.area() / area - 1.0).abs() < 0.005, "{split:?}: {} m², closed form {area} m²", found.area());
        // The bore is clamped: what lies beside it moves less.
        let square = found.square()[(0, 0)];
        assert!(square < 2.0 * side && square > 1.85 * side, "{split:?}: {square} m², sides {}", 2.0 * side);
    }
}

/// A part has the cells of all kinds that touch its nodes, and one rank each face of the boundary.
pub fn mixed_cells_are_distributed(world: &World) {
    let mesh = raised(&mixed(2), second(false));
    let part = crate::distribution::check(world, &mesh);
    let kinds = census(&mesh.cells);
    assert_eq!(kinds.len(), 4, "{kinds:?}");
    let corners: usize =
        part.boundary().iter().map(|f| part.cells.get(f.cell as usize).facet_corners(f.face as usize).count()).sum();
    let mut whole = mesh.clone();
    named(&mut whole, "all", |_| true);
    let wanted: usize = whole.groups["all"]
        .iter()
        .map(|f| whole.cells.get(f.cell as usize).facet_corners(f.face as usize).count())
        .sum();
    assert_eq!(world.sum(corners as f64), wanted as f64);
}
