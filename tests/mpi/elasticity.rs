//! Assembly and solution on distributed meshes against closed forms.

use railsqueal::fem::assembly::{Assembly, Operators};
use railsqueal::fem::dofs::{DofMap, FIXED};
use railsqueal::fem::forms::{Form, Mass, NodeCoupling, Stiffness};
use railsqueal::fem::ElasticMaterial;
use railsqueal::mesh::distribute::{distribute, MeshPart};
use railsqueal::mesh::{facet_key, Cell, CellKind, Mesh};
use railsqueal::parallel::World;
use railsqueal::petsc::csr::{dot, DistCsr, Stored};
use railsqueal::petsc::exchange::Exchange;
use railsqueal::petsc::mumps::{Factor, FactorOptions, Symmetry};

const STEEL: ElasticMaterial = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800. };

/// A block of nx × ny × nz hexahedra over `size`, its inner nodes moved by `move_node`; groups `left` (x = 0) and
/// `right`.
pub fn block(n: [usize; 3], size: [f64; 3], move_node: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let mut mesh = Mesh::default();
    let id = |i: usize, j: usize, k: usize| (i + (n[0] + 1) * (j + (n[1] + 1) * k)) as u32;
    for k in 0..=n[2] {
        for j in 0..=n[1] {
            for i in 0..=n[0] {
                let p = [i, j, k];
                let x = std::array::from_fn(|c| size[c] * p[c] as f64 / n[c] as f64);
                let inner = (0..3).all(|c| p[c] > 0 && p[c] < n[c]);
                mesh.nodes.push(if inner { move_node(x) } else { x });
            }
        }
    }
    let mut left = Vec::new();
    let mut right = Vec::new();
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                let around = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let [below, above] = [k, k + 1].map(|k| around.map(|(i, j)| id(i, j, k)));
                mesh.cells.push(CellKind::Hex8, [below, above].as_flattened());
            }
            left.push([id(0, j, k), id(0, j, k + 1), id(0, j + 1, k + 1), id(0, j + 1, k)]);
            right.push([id(n[0], j, k), id(n[0], j + 1, k), id(n[0], j + 1, k + 1), id(n[0], j, k + 1)]);
        }
    }
    group(&mut mesh, "left", &left);
    group(&mut mesh, "right", &right);
    mesh
}

/// Names the boundary facets with these corners.
pub fn group(mesh: &mut Mesh, name: &str, corners: &[[u32; 4]]) {
    let keys: Vec<_> = corners.iter().map(|&c| facet_key(c)).collect();
    let facets = mesh.cells.find_facets(&keys).into_iter().collect::<Option<Vec<_>>>().expect("faces of cells");
    mesh.groups.insert(name.into(), facets);
}

/// This rank's degrees of freedom of a displacement field.
fn field(part: &MeshPart, dofs: &DofMap, u: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
    (0..part.owned).filter(|&n| dofs.local[n] != FIXED).flat_map(|n| u(part.coords[n])).collect()
}

fn body(world: &World, mesh: &Mesh, fixed: &[String]) -> (MeshPart, DofMap, Operators) {
    let part = distribute(world, world.is_root().then_some(mesh)).unwrap();
    let dofs = DofMap::new(world, &part, fixed);
    let operators = Operators::new(world, &part, &dofs, &STEEL).unwrap();
    (part, dofs, operators)
}

/// Irregular but reproducible displacement of the inner nodes, up to 0.2 of the element size `h`.
fn shake(x: [f64; 3], h: f64) -> [f64; 3] {
    let s = [
        12.9898 * x[0] + 78.233 * x[1] + 37.719 * x[2],
        3.1 * x[0] - 57.0 * x[1] + 9.2 * x[2],
        41.0 * x[0] * x[1] - 17.0 * x[2],
    ];
    std::array::from_fn(|c| x[c] + 0.2 * h * (s[c] * 43.7).sin())
}

/// A linear displacement makes no force at the inner nodes of a distorted mesh (patch test), a rigid motion none at
/// all, and the mass matrix weighs the block.
pub fn patch_test(world: &World) {
    let mesh = block([5, 4, 3], [1.0, 0.8, 0.6], |x| shake(x, 0.2));
    let (part, dofs, ops) = body(world, &mesh, &[]);
    let k = ops.stiffness.operator(world);
    let scale = ops.stiffness.max_abs(world);
    let inner = |x: [f64; 3]| (0..3).all(|c| x[c] > 1e-9 && x[c] < [1.0, 0.8, 0.6][c] - 1e-9);
    let linear = |x: [f64; 3]| [1e-3 * x[0] - 2e-3 * x[1], 3e-3 * x[2] + 1e-3, 1e-3 * x[1] - 4e-3 * x[2]];
    let rotation = |x: [f64; 3]| [0.3 - 0.5 * x[1] + 0.2 * x[2], 0.5 * x[0] - 0.7 * x[2], -0.2 * x[0] + 0.7 * x[1]];
    for (u, everywhere, size) in [(&linear as &dyn Fn([f64; 3]) -> [f64; 3], false, 1e-3), (&rotation, true, 1.0)] {
        let x = field(&part, &dofs, u);
        let mut f = vec![0.0; x.len()];
        k.apply(world, &x, &mut f);
        let worst = (0..part.owned)
            .filter(|&n| everywhere || inner(part.coords[n]))
            .flat_map(|n| f[3 * n..3 * n + 3].to_vec())
            .fold(0.0, |m: f64, v| m.max(v.abs()));
        let worst = world.max(worst);
        assert!(worst < 1e-13 * scale * size, "force {worst:e} N, stiffness {scale:e} N/m, displacement {size:e} m");
    }
    let m = ops.mass.operator(world);
    let ones = field(&part, &dofs, |_| [1.0, 0.0, 0.0]);
    let mut weighed = vec![0.0; ones.len()];
    m.apply(world, &ones, &mut weighed);
    let mass = dot(world, &ones, &weighed);
    let exact = 7800.0 * 0.48;
    assert!((mass / exact - 1.0).abs() < 1e-12, "mass {mass} kg, exact {exact} kg");
    halves(world, &part, &dofs, &ops);
}

/// A form that hides that it is symmetric.
struct All<F>(F);

impl<F: Form> Form for All<F> {
    fn coupling(&self) -> NodeCoupling {
        self.0.coupling()
    }

    fn symmetric(&self) -> bool {
        false
    }

    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]) {
        self.0.matrix(cell, x, out);
    }
}

/// Matrices with all their entries are symmetric, and those of which half is assembled are the same.
fn halves(world: &World, part: &MeshPart, dofs: &DofMap, ops: &Operators) {
    let assembly = Assembly::new(world, part, dofs).unwrap();
    let forms: [(&str, &DistCsr, Box<dyn Form>); 2] = [
        ("K", &ops.stiffness, Box::new(All(Stiffness(STEEL)))),
        ("M", &ops.mass, Box::new(All(Mass { density: STEEL.density }))),
    ];
    for (name, half, form) in forms {
        let all = assembly.assemble(&*form);
        assert_eq!(all.stored, Stored::Whole);
        let asymmetry = all.asymmetry(world);
        assert!(asymmetry < 1e-14, "{name} is not symmetric: {asymmetry:e} of its largest entry");
        half.validate(world, name).unwrap();
        assert!(half.cols.len() < all.cols.len(), "{name}: {} of {} entries", half.cols.len(), all.cols.len());
        let whole = half.full();
        assert_eq!((&whole.indptr, &whole.cols), (&all.indptr, &all.cols), "{name}");
        let scale = all.max_abs(world);
        let worst = whole.values.iter().zip(&all.values).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(worst < 1e-14 * scale, "{name}: {worst:e} of {scale:e}");
    }
}

/// Deflection of a cantilever of slenderness 20 under an end load, one element through its height: no locking in
/// bending. Timoshenko: w = F L³/(3EI) + F L/(κGA), κ = 10(1+ν)/(12+11ν).
pub fn cantilever(world: &World) {
    let (l, b, h, force) = (2.0f64, 0.1, 0.1f64, 1e3);
    let (e, nu) = (STEEL.young, STEEL.poisson);
    let kappa = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu);
    let exact = force * l.powi(3) / (3.0 * e * b * h.powi(3) / 12.0) + force * l / (kappa * STEEL.shear() * b * h);
    let mesh = block([20, 1, 1], [l, b, h], |x| x);
    let (part, dofs, ops) = body(world, &mesh, &["left".into()]);
    let mut factor = Factor::new(world, &ops.stiffness, FactorOptions::new(Symmetry::Positive), "beam").unwrap();
    let end = |x: [f64; 3]| (x[0] - l).abs() < 1e-9;
    let mut u = field(&part, &dofs, |x| if end(x) { [0., 0., force / 4.0] } else { [0.; 3] });
    factor.solve(&mut u, 1).unwrap();
    let tip = field(&part, &dofs, |x| if end(x) { [0., 0., 0.25] } else { [0.; 3] });
    let w = dot(world, &tip, &u);
    let error = w / exact - 1.0;
    assert!(error.abs() < 0.01, "tip deflection {w:e} m, beam theory {exact:e} m, error {error:.4}");
}

/// Second order in the energy norm's square: the compliance of a short cantilever under a shear load converges to
/// that of a finer mesh with the order of the element.
pub fn convergence_order(world: &World) {
    let size = [1.0, 0.5, 0.5];
    let compliance = |n: usize| {
        let mesh = block([2 * n, n, n], size, |x| x);
        let (part, dofs, ops) = body(world, &mesh, &["left".into(), "right".into()]);
        // Body force of one period, zero at the supports: smooth enough for the full order.
        let load = field(&part, &dofs, |x| {
            let s = (std::f64::consts::PI * x[0]).sin();
            [s * x[1], s * x[2] * x[2], s * (1.0 + x[1])]
        });
        let mut f = vec![0.0; load.len()];
        ops.mass.operator(world).apply(world, &load, &mut f);
        let mut u = f.clone();
        let mut factor = Factor::new(world, &ops.stiffness, FactorOptions::new(Symmetry::Positive), "block").unwrap();
        factor.solve(&mut u, 1).unwrap();
        dot(world, &f, &u)
    };
    let c: Vec<f64> = [3, 6, 12].iter().map(|&n| compliance(n)).collect();
    let order = ((c[1] - c[0]) / (c[2] - c[1])).abs().log2();
    assert!((1.6..3.0).contains(&order), "compliances {c:?}, observed order {order:.2}, expected 2");
}

/// Values of ghosts arrive in the order of the local nodes.
pub fn ghost_values(world: &World) {
    let mesh = block([6, 3, 2], [6.0, 3.0, 2.0], |x| x);
    let part = distribute(world, world.is_root().then_some(&mesh)).unwrap();
    let exchange = Exchange::new(world, &part.ranges, part.node_ids.iter().copied());
    let owned: Vec<f64> = part.coords[..part.owned].iter().map(|x| x[0] + 10.0 * x[1] + 100.0 * x[2]).collect();
    let ghosts = exchange.fetch(world, &owned);
    let expected: Vec<f64> = part.coords[part.owned..].iter().map(|x| x[0] + 10.0 * x[1] + 100.0 * x[2]).collect();
    assert_eq!(ghosts, expected);
}
