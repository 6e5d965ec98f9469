//! Every element: rigid-body motions, constant stress, mass.

use super::*;
use crate::fem::forms::{Form, Mass, Stiffness};
use crate::mesh::quality::volume;

const STEEL: Material = Material { young: 205e9, poisson: 0.3, density: 7800. };

/// The reference cell, its nodes moved a little.
fn distorted(kind: CellKind) -> Vec<[f64; 3]> {
    let push = [0.11, -0.23, 0.17, 0.05, -0.14, 0.21, -0.09, 0.13];
    let at = |i: usize, c: usize| push[(i + 3 * c) % 8] * [1.0, -0.7, 0.5][c];
    let nodes = kind.reference_nodes().iter().enumerate();
    nodes.map(|(i, p)| std::array::from_fn(|c| p[c] + at(i, c))).collect()
}

#[test]
fn six_rigid_body_motions_and_no_more() {
    for kind in CellKind::ALL {
        let x = distorted(kind);
        let n = 3 * kind.nodes();
        let mut k = vec![0.0; n * n];
        Stiffness(STEEL).matrix(kind, &x, &mut k);
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
        Mass { density: 3.0 }.matrix(kind, &x, &mut m);
        let (total, exact) = (m.iter().sum::<f64>(), 3.0 * volume(kind, &x));
        assert!((total / exact - 1.0).abs() < 1e-12, "{kind:?}: {total} kg, {exact} kg");
    }
}

#[test]
fn mass_of_the_cube() {
    let kind = CellKind::Hex8;
    let mut m = vec![0.0; 64];
    Mass { density: 3.0 }.matrix(kind, kind.reference_nodes(), &mut m);
    let total: f64 = m.iter().sum();
    assert!((total - 24.).abs() < 1e-12, "mass {total}");
    assert!((m[0] - 3.0 * 8. / 27.).abs() < 1e-12, "corner entry {}", m[0]);
}
