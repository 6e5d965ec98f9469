//! Every element: rigid-body motions, constant stress, mass.

use super::*;
use crate::fem::forms::{Convected, Form, Gyroscopic, Mass, PrestressStiffness, Stiffness};
use crate::fem::rotation::Axis;
use crate::mesh::quality::volume;
use crate::mesh::Cell;

const STEEL: ElasticMaterial = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800. };

/// The reference cell, its corners moved a little; the other nodes lie between them, and away from there by `bend` of
/// the push of a corner.
fn bent(kind: CellKind, bend: f64) -> Vec<[f64; 3]> {
    let push = [0.11, -0.23, 0.17, 0.05, -0.14, 0.21, -0.09, 0.13];
    // Reference tetrahedra, wedges and pyramids are half as large.
    let size = if kind.linear() == CellKind::Hex8 { 1.0 } else { 0.5 };
    let at = |i: usize, c: usize| size * push[(i + 3 * c) % 8] * [1.0, -0.7, 0.5][c];
    let corners = kind.reference_nodes()[..kind.corners()].iter().enumerate();
    let mut nodes: Vec<[f64; 3]> = corners.map(|(i, p)| std::array::from_fn(|c| p[c] + at(i, c))).collect();
    for around in kind.between() {
        let mean = |c: usize| around.iter().map(|&k| nodes[k as usize][c]).sum::<f64>() / around.len() as f64;
        let i = nodes.len();
        nodes.push(std::array::from_fn(|c| mean(c) + bend * at(i, c)));
    }
    nodes
}

/// Such a cell with curved edges.
fn distorted(kind: CellKind) -> Vec<[f64; 3]> {
    bent(kind, 0.2)
}

/// A cell that has the first nodes.
fn cell(kind: CellKind) -> Cell<'static> {
    const ALL: [u32; 32] = {
        let mut all = [0; 32];
        let mut i = 0;
        while i < 32 {
            all[i] = i as u32;
            i += 1;
        }
        all
    };
    Cell { kind, nodes: &ALL[..kind.nodes()] }
}

#[test]
fn six_rigid_body_motions_and_no_more() {
    for kind in CellKind::ALL {
        let x = distorted(kind);
        let n = 3 * kind.nodes();
        let mut k = vec![0.0; n * n];
        Stiffness(STEEL).matrix(cell(kind), &x, &mut k);
        let scale = k[0].abs();
        for r in 0..6 {
            let motion = |x: &[f64; 3]| match r {
                0..=2 => std::array::from_fn(|c| if c == r { 1.0 } else { 0.0 }),
                3 => [-x[1], x[0], 0.],
                4 => [0., -x[2], x[1]],
                _ => [x[2], 0., -x[0]],
            };
            let u: Vec<f64> = x.iter().flat_map(motion).collect();
            let force = |row: &[f64]| row.iter().zip(&u).map(|(a, b)| a * b).sum::<f64>().abs();
            let worst = k.chunks_exact(n).map(force).fold(0., f64::max);
            assert!(worst < 1e-12 * scale, "{kind:?}, rigid motion {r}: force {worst:e}, stiffness {scale:e}");
        }
        let m = faer::Mat::from_fn(n, n, |i, j| k[n * i + j]);
        let eig = m.self_adjoint_eigenvalues(faer::Side::Lower).expect("eigenvalues");
        let zeros = eig.iter().filter(|v| v.abs() < 1e-9 * eig[n - 1]).count();
        assert_eq!(zeros, 6, "{kind:?}: zero eigenvalues of {eig:?}");
    }
}

#[test]
fn constant_stress_is_exact_on_a_distorted_element() {
    let (l, mu) = STEEL.lame();
    let exact = stress_of([1e-3, 0., 5e-4, 2e-3, -3e-3, 0.], l, mu);
    for kind in CellKind::ALL {
        let x = distorted(kind);
        let u: Vec<f64> = x.iter().flat_map(|x| [1e-3 * x[0] + 2e-3 * x[1], -3e-3 * x[2], 5e-4 * x[2]]).collect();
        let mut stress = vec![[0.0; 6]; kind.nodes()];
        element(kind).nodal_stress(&x, &u, &STEEL, &mut stress);
        for s in stress {
            for i in 0..6 {
                let (found, exact) = (s[i], exact[i]);
                assert!((found - exact).abs() < 1e-3, "{kind:?}, component {i}: {found} Pa against {exact} Pa");
            }
        }
    }
}

#[test]
fn mass_is_density_times_volume() {
    for kind in CellKind::ALL {
        let x = distorted(kind);
        let mut m = vec![0.0; kind.nodes() * kind.nodes()];
        Mass { density: 3.0 }.matrix(cell(kind), &x, &mut m);
        let (total, exact) = (m.iter().sum::<f64>(), 3.0 * volume(kind, &x));
        assert!((total / exact - 1.0).abs() < 1e-12, "{kind:?}: {total} kg, {exact} kg");
    }
}

/// Volume of what the faces of a cell enclose, by Gauss's theorem: ⅓ ∫ x · n dA.
fn enclosed(kind: CellKind, x: &[[f64; 3]]) -> f64 {
    let line = [(0.5 - 0.15f64.sqrt(), 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.5 + 0.15f64.sqrt(), 5.0 / 18.0)];
    let cross = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
    };
    let mut volume = 0.0;
    for face in kind.faces() {
        let place = |at: [f64; 2]| -> [f64; 3] {
            let n = face.kind.shape(at);
            std::array::from_fn(|c| face.nodes.iter().zip(n).map(|(&i, n)| n * x[i as usize][c]).sum())
        };
        for (s, ws) in line {
            for (t, wt) in line {
                // The triangle is the square with one side drawn together. 3 × 3 points are exact to the degree 5.
                let (at, weight) = match face.kind.corners() {
                    3 => ([s * (1.0 - t), t], ws * wt * (1.0 - t)),
                    _ => ([s, t], ws * wt),
                };
                // Polynomials of second degree along each coordinate: differences are derivatives.
                let along = |c: usize| -> [f64; 3] {
                    let (mut up, mut down) = (at, at);
                    (up[c], down[c]) = (at[c] + 0.5, at[c] - 0.5);
                    std::array::from_fn(|i| place(up)[i] - place(down)[i])
                };
                let (p, normal) = (place(at), cross(along(0), along(1)));
                volume += weight * (0..3).map(|c| p[c] * normal[c]).sum::<f64>() / 3.0;
            }
        }
    }
    volume
}

/// A cell is as large as what its faces enclose, with straight edges and with curved ones; and so large as an affine
/// map makes it.
#[test]
fn volume_is_exact() {
    for kind in CellKind::ALL {
        for bend in [0.0, 0.2] {
            let x = bent(kind, bend);
            let (found, exact) = (volume(kind, &x), enclosed(kind, &x));
            assert!(
                (found / exact - 1.0).abs() < 1e-12,
                "{kind:?}, edges bent by {bend}: {found} m³, faces enclose {exact} m³"
            );
        }
        let size = match kind.linear() {
            CellKind::Tet4 => 1.0 / 6.0,
            CellKind::Pyramid5 => 4.0 / 3.0,
            CellKind::Wedge6 => 1.0,
            _ => 8.0,
        };
        let found = volume(kind, &affine(kind));
        assert!((found / (ENLARGED * size) - 1.0).abs() < 1e-13, "{kind:?}: {found} m³");
    }
}

/// Determinant of the map of [`affine`]: 1.1 · 1.5 · 1.8 + 0.3 · (−0.4) · 0.2.
const ENLARGED: f64 = 2.946;

/// The reference cell under a linear map.
fn affine(kind: CellKind) -> Vec<[f64; 3]> {
    let map = |p: &[f64; 3]| [1.1 * p[0] + 0.3 * p[1], 1.5 * p[1] - 0.4 * p[2], 0.2 * p[0] + 1.8 * p[2]];
    kind.reference_nodes().iter().map(map).collect()
}

/// A displacement of second degree on an affine cell of second order: stress at the nodes, and twice its energy u·K u
/// = ∫ σ : ε dV.
#[test]
fn fields_of_second_degree_are_exact() {
    let (l, mu) = STEEL.lame();
    let field = |p: [f64; 3]| {
        [p[0] * p[1] - 0.3 * p[2] * p[2], 0.7 * p[0] * p[2] + p[1] * p[1], p[1] * p[2] - 0.4 * p[0] * p[0]]
    };
    // Derivatives: [y, x, −0.6 z], [0.7 z, 2 y, 0.7 x], [−0.8 x, z, y].
    let strain = |p: [f64; 3]| [p[1], 2.0 * p[1], p[1], p[0] + 0.7 * p[2], 0.7 * p[0] + p[2], -0.8 * p[0] - 0.6 * p[2]];
    for kind in CellKind::ALL.into_iter().filter(|&k| k != k.linear()) {
        let x = affine(kind);
        let u: Vec<f64> = x.iter().flat_map(|&p| field(p)).collect();
        let mut stress = vec![[0.0; 6]; kind.nodes()];
        element(kind).nodal_stress(&x, &u, &STEEL, &mut stress);
        for (&p, s) in x.iter().zip(&stress) {
            let exact = stress_of(strain(p), l, mu);
            let worst = (0..6).map(|i| (s[i] - exact[i]).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-12 * l, "{kind:?} at {p:?}: {s:?} Pa, exact {exact:?} Pa");
        }
        let n = u.len();
        let mut k = vec![0.0; n * n];
        Stiffness(STEEL).matrix(cell(kind), &x, &mut k);
        let found: f64 = k.iter().enumerate().map(|(i, k)| u[i / n] * k * u[i % n]).sum();
        let exact: f64 = kind
            .mass_rule()
            .iter()
            .map(|p| {
                let at = std::array::from_fn(|c| x.iter().zip(&p.shape.values).map(|(x, n)| x[c] * n).sum());
                let (e, s) = (strain(at), stress_of(strain(at), l, mu));
                p.weight * ENLARGED * (0..6).map(|i| e[i] * s[i]).sum::<f64>()
            })
            .sum();
        assert!((found / exact - 1.0).abs() < 1e-12, "{kind:?}: {found}, exact {exact}");
    }
}

#[test]
fn mass_of_the_cube() {
    let kind = CellKind::Hex8;
    let mut m = vec![0.0; 64];
    Mass { density: 3.0 }.matrix(cell(kind), kind.reference_nodes(), &mut m);
    let total: f64 = m.iter().sum();
    assert!((total - 24.).abs() < 1e-12, "mass {total}");
    assert!((m[0] - 3.0 * 8. / 27.).abs() < 1e-12, "corner entry {}", m[0]);
}

/// v·A u of a form that couples equal components.
fn form(matrix: &[f64], v: &[[f64; 3]], u: &[[f64; 3]]) -> f64 {
    let n = v.len();
    let dot = |a: usize, b: usize| (0..3).map(|c| v[a][c] * u[b][c]).sum::<f64>();
    (0..n * n).map(|i| matrix[i] * dot(i / n, i % n)).sum()
}

/// On any cell: rigid rotations a × r, b × r have u_a·G u_b = (a × b)·ê I with the polar moment of inertia,
/// translations none; K_c of a rotation is ∫ρ|a × W|²; and a constant stress gives ∫σ:∇v·∇u.
#[test]
fn rotation_forms_of_rigid_motions_and_constant_stress() {
    let axis = Axis { centre: [0.3, -0.2, 0.5], direction: [0.0, 0.6, 0.8] };
    let density = 3.0;
    for kind in CellKind::ALL {
        let x = distorted(kind);
        let n = kind.nodes();
        let (mut gyroscopic, mut convected, mut mass) = (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n * n]);
        Gyroscopic { density, axis }.matrix(cell(kind), &x, &mut gyroscopic);
        Convected { density, axis }.matrix(cell(kind), &x, &mut convected);
        Mass { density }.matrix(cell(kind), &x, &mut mass);
        let cross = |a: [f64; 3], b: [f64; 3]| {
            std::array::from_fn(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
        };
        let place = |p: &[f64; 3]| std::array::from_fn(|c| p[c] - axis.centre[c]);
        let rotation = |a: [f64; 3]| -> Vec<[f64; 3]> { x.iter().map(|p| cross(a, place(p))).collect() };
        // Two directions across the axis, a × b = ê.
        let (a, b) = ([1.0, 0.0, 0.0], [0.0, 0.8, -0.6]);
        let outward: Vec<[f64; 3]> = x.iter().map(|p| axis.outward(*p)).collect();
        let polar = form(&mass, &outward, &outward);
        let found = form(&gyroscopic, &rotation(a), &rotation(b));
        let sign: f64 = cross(a, b).iter().zip(axis.direction).map(|(p, q): (&f64, f64)| p * q).sum();
        assert!((found - sign * polar).abs() < 1e-12 * polar, "{kind:?}: {found}, expected {}", sign * polar);
        let shift = vec![[0.3, 1.0, -2.0]; n];
        assert!(form(&gyroscopic, &shift, &shift).abs() < 1e-12 * polar);
        let velocity: Vec<[f64; 3]> = x.iter().map(|p| cross(a, axis.velocity(*p))).collect();
        let (found, wanted) = (form(&convected, &rotation(a), &rotation(a)), form(&mass, &velocity, &velocity));
        assert!((found - wanted).abs() < 1e-12 * wanted, "{kind:?}: {found}, expected {wanted}");
        for i in 0..n {
            assert!((0..n).all(|j| gyroscopic[n * i + j] == -gyroscopic[n * j + i]), "{kind:?}: not skew");
        }
        // ε = diag(1e-3, 0, 0); v = u = (x, 0, 0): ∇u has the entry xx alone.
        // Straight edges: where they are curved volume and stiffness have rules of their own.
        let x = bent(kind, 0.0);
        let stretch: Vec<[f64; 3]> = x.iter().map(|p| [1e-3 * p[0], 0.0, 0.0]).collect();
        let mut prestress = vec![0.0; n * n];
        PrestressStiffness { material: STEEL, displacement: &stretch }.matrix(cell(kind), &x, &mut prestress);
        let (l, mu) = STEEL.lame();
        let wanted = 1e-3 * (l + 2.0 * mu) * 1e-6 * volume(kind, &x);
        let found = form(&prestress, &stretch, &stretch);
        assert!((found / wanted - 1.0).abs() < 1e-9, "{kind:?}: {found}, expected {wanted}");
    }
}
