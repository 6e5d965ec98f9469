//! Eight-node hexahedron with incompatible modes: the element of Taylor, Beresford and Wilson, "A non-conforming element
//! for stress analysis", Int. J. Numer. Meth. Engng 10 (1976) 1211–1219. It represents bending exactly on parallelepipeds
//! and, with the Jacobian of the incompatible part taken at the centre, passes the patch test on distorted meshes.

use super::Material;
use crate::mesh::quality::CORNERS;

/// Number of displacement degrees of freedom of the element.
pub const DOFS: usize = 24;
/// Stiffness matrix of an element, N/m, row-major, degree of freedom `3*node + component`.
pub type Stiffness = [[f64; DOFS]; DOFS];
/// Consistent mass matrix per component, kg: the mass matrix is this one times the 3×3 identity.
pub type ScalarMass = [[f64; 8]; 8];

/// Trilinear shape functions at the reference point `xi`, `[8]`.
pub fn shape(xi: [f64; 3]) -> [f64; 8] {
    CORNERS.map(|c| 0.125 * (1. + c[0] * xi[0]) * (1. + c[1] * xi[1]) * (1. + c[2] * xi[2]))
}

/// Derivatives of the shape functions with respect to the reference coordinates, `[8][3]`.
fn shape_gradients(xi: [f64; 3]) -> [[f64; 3]; 8] {
    CORNERS.map(|c| {
        let f = [1. + c[0] * xi[0], 1. + c[1] * xi[1], 1. + c[2] * xi[2]];
        [0.125 * c[0] * f[1] * f[2], 0.125 * c[1] * f[0] * f[2], 0.125 * c[2] * f[0] * f[1]]
    })
}

/// Jacobian ∂x_i/∂ξ_j, m, `[3][3]`.
fn jacobian(x: &[[f64; 3]; 8], grad: &[[f64; 3]; 8]) -> [[f64; 3]; 3] {
    let mut j = [[0.0; 3]; 3];
    for (xa, ga) in x.iter().zip(grad) {
        for (i, row) in j.iter_mut().enumerate() {
            for (k, e) in row.iter_mut().enumerate() {
                *e += xa[i] * ga[k];
            }
        }
    }
    j
}

fn determinant(j: &[[f64; 3]; 3]) -> f64 {
    j[0][0] * (j[1][1] * j[2][2] - j[1][2] * j[2][1]) - j[0][1] * (j[1][0] * j[2][2] - j[1][2] * j[2][0])
        + j[0][2] * (j[1][0] * j[2][1] - j[1][1] * j[2][0])
}

fn inverse(j: &[[f64; 3]; 3], det: f64) -> [[f64; 3]; 3] {
    let c = |a: usize, b: usize, d: usize, e: usize| (j[a][b] * j[d][e] - j[a][e] * j[d][b]) / det;
    [
        [c(1, 1, 2, 2), c(0, 2, 2, 1), c(0, 1, 1, 2)],
        [c(1, 2, 2, 0), c(0, 0, 2, 2), c(0, 2, 1, 0)],
        [c(1, 0, 2, 1), c(0, 1, 2, 0), c(0, 0, 1, 1)],
    ]
}

/// Derivatives with respect to the space coordinates from those with respect to the reference ones: `g_i = g_ξj J⁻¹_ji`.
fn to_space(grad: [f64; 3], inv: &[[f64; 3]; 3]) -> [f64; 3] {
    std::array::from_fn(|i| grad[0] * inv[0][i] + grad[1] * inv[1][i] + grad[2] * inv[2][i])
}

/// Strain (xx, yy, zz, xy, yz, zx; engineering shears) made by a unit displacement of a function with gradient `g` along axis `c`.
fn strain_column(g: [f64; 3], c: usize) -> [f64; 6] {
    match c {
        0 => [g[0], 0., 0., g[1], 0., g[2]],
        1 => [0., g[1], 0., g[0], g[2], 0.],
        _ => [0., 0., g[2], 0., g[1], g[0]],
    }
}

/// Gauss points of the 2×2×2 rule, in the order of [`CORNERS`]; all weights are 1.
fn gauss_points() -> [[f64; 3]; 8] {
    let g = 1. / 3f64.sqrt();
    CORNERS.map(|c| c.map(|v| v * g))
}

/// Strain-displacement columns at one Gauss point: 24 of the shape functions, then 9 of the incompatible modes.
struct GaussPoint {
    weight: f64,
    columns: [[f64; 6]; 33],
}

fn gauss_point(x: &[[f64; 3]; 8], xi: [f64; 3], centre_inv: &[[f64; 3]; 3], centre_det: f64) -> GaussPoint {
    let grad = shape_gradients(xi);
    let j = jacobian(x, &grad);
    let det = determinant(&j);
    let inv = inverse(&j, det);
    let mut columns = [[0.0; 6]; 33];
    for (a, ga) in grad.iter().enumerate() {
        let g = to_space(*ga, &inv);
        for c in 0..3 {
            columns[3 * a + c] = strain_column(g, c);
        }
    }
    // Incompatible modes 1-ξ², 1-η², 1-ζ² with the centre's Jacobian scaled by det₀/det: their strains then integrate to
    // zero over the element, which is what the patch test asks for.
    for m in 0..3 {
        let mut gm = [0.0; 3];
        gm[m] = -2. * xi[m] * centre_det / det;
        let g = to_space(gm, centre_inv);
        for c in 0..3 {
            columns[24 + 3 * m + c] = strain_column(g, c);
        }
    }
    GaussPoint { weight: det, columns }
}

fn gauss(x: &[[f64; 3]; 8]) -> [GaussPoint; 8] {
    let j0 = jacobian(x, &shape_gradients([0.; 3]));
    let det0 = determinant(&j0);
    let inv0 = inverse(&j0, det0);
    gauss_points().map(|xi| gauss_point(x, xi, &inv0, det0))
}

/// Condensed stiffness and the operator that recovers the incompatible amplitudes: `amplitudes[9] = recover[9][24] · u`.
struct Condensed {
    stiffness: Stiffness,
    recover: [[f64; DOFS]; 9],
}

fn condense(points: &[GaussPoint; 8], material: &Material) -> Condensed {
    let (lambda, mu) = material.lame();
    let mut k = [[0.0; 33]; 33];
    for p in points {
        let stress: [[f64; 6]; 33] = p.columns.map(|e| stress_of(e, lambda, mu));
        for a in 0..33 {
            for b in a..33 {
                let mut s = 0.0;
                for i in 0..6 {
                    s += p.columns[a][i] * stress[b][i];
                }
                k[a][b] += s * p.weight;
            }
        }
    }
    for a in 0..33 {
        for b in 0..a {
            k[a][b] = k[b][a];
        }
    }
    // K_uu - K_ua K_aa⁻¹ K_au by eliminating the nine amplitudes, symmetric positive definite.
    let mut recover = [[0.0; DOFS]; 9];
    let mut work: Vec<[f64; 33]> = (24..33)
        .map(|a| {
            let mut row = [0.0; 33];
            row[..9].copy_from_slice(&k[a][24..33]);
            row[9..33].copy_from_slice(&k[a][..24]);
            row
        })
        .collect();
    for p in 0..9 {
        let pivot = work[p][p];
        for v in &mut work[p] {
            *v /= pivot;
        }
        for r in 0..9 {
            if r != p {
                let f = work[r][p];
                for c in p..33 {
                    work[r][c] -= f * work[p][c];
                }
            }
        }
    }
    for (a, row) in work.iter().enumerate() {
        for d in 0..DOFS {
            recover[a][d] = -row[9 + d];
        }
    }
    let mut stiffness = [[0.0; DOFS]; DOFS];
    for d in 0..DOFS {
        for e in d..DOFS {
            let mut v = k[d][e];
            for a in 0..9 {
                v += k[d][24 + a] * recover[a][e];
            }
            stiffness[d][e] = v;
            stiffness[e][d] = v;
        }
    }
    Condensed { stiffness, recover }
}

fn stress_of(e: [f64; 6], lambda: f64, mu: f64) -> [f64; 6] {
    let p = lambda * (e[0] + e[1] + e[2]);
    [p + 2. * mu * e[0], p + 2. * mu * e[1], p + 2. * mu * e[2], mu * e[3], mu * e[4], mu * e[5]]
}

/// Stiffness of the element with corners `x` (m, `[8][3]`), N/m.
pub fn stiffness(x: &[[f64; 3]; 8], material: &Material) -> Stiffness {
    condense(&gauss(x), material).stiffness
}

/// Consistent mass of the element per component, kg, by the 3×3×3 Gauss rule (exact on parallelepipeds).
pub fn mass(x: &[[f64; 3]; 8], density: f64) -> ScalarMass {
    let points = [(-(0.6f64.sqrt()), 5. / 9.), (0., 8. / 9.), (0.6f64.sqrt(), 5. / 9.)];
    let mut m = [[0.0; 8]; 8];
    for (xi, wx) in points {
        for (eta, wy) in points {
            for (zeta, wz) in points {
                let p = [xi, eta, zeta];
                let n = shape(p);
                let w = density * wx * wy * wz * determinant(&jacobian(x, &shape_gradients(p)));
                for a in 0..8 {
                    for b in 0..8 {
                        m[a][b] += w * n[a] * n[b];
                    }
                }
            }
        }
    }
    m
}

/// Stress (xx, yy, zz, xy, yz, zx), Pa, at the corners, `[8][6]`: evaluated at the Gauss points, where it is most
/// accurate, and extrapolated trilinearly. `u` is the displacement, m, `[24]`.
pub fn corner_stress(x: &[[f64; 3]; 8], u: &[f64; DOFS], material: &Material) -> [[f64; 6]; 8] {
    let points = gauss(x);
    let recover = condense(&points, material).recover;
    let amplitudes: [f64; 9] = std::array::from_fn(|a| recover[a].iter().zip(u).map(|(r, v)| r * v).sum());
    let (lambda, mu) = material.lame();
    let at_gauss = points.map(|p| {
        let mut e = [0.0; 6];
        for (column, v) in p.columns.iter().zip(u.iter().chain(&amplitudes)) {
            for (ei, ci) in e.iter_mut().zip(column) {
                *ei += ci * v;
            }
        }
        stress_of(e, lambda, mu)
    });
    CORNERS.map(|c| {
        let n = shape(c.map(|v| v * 3f64.sqrt()));
        std::array::from_fn(|i| (0..8).map(|g| n[g] * at_gauss[g][i]).sum())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steel() -> Material {
        Material { young: 205e9, poisson: 0.3, density: 7800. }
    }

    fn distorted() -> [[f64; 3]; 8] {
        let mut x = CORNERS;
        let push = [0.11, -0.23, 0.17, 0.05, -0.14, 0.21, -0.09, 0.13];
        for (i, p) in x.iter_mut().enumerate() {
            p[0] += push[i];
            p[1] -= 0.7 * push[(i + 3) % 8];
            p[2] += 0.5 * push[(i + 5) % 8];
        }
        x
    }

    #[test]
    fn six_rigid_body_motions_and_no_more() {
        let k = stiffness(&distorted(), &steel());
        let x = distorted();
        let scale = k[0][0].abs();
        for r in 0..6 {
            let mut u = [0.0; DOFS];
            for a in 0..8 {
                let v = match r {
                    0..=2 => std::array::from_fn(|c| if c == r { 1.0 } else { 0.0 }),
                    3 => [-x[a][1], x[a][0], 0.],
                    4 => [0., -x[a][2], x[a][1]],
                    _ => [x[a][2], 0., -x[a][0]],
                };
                u[3 * a..3 * a + 3].copy_from_slice(&v);
            }
            let worst =
                k.iter().map(|row| row.iter().zip(&u).map(|(a, b)| a * b).sum::<f64>().abs()).fold(0., f64::max);
            assert!(worst < 1e-12 * scale, "rigid motion {r}: force {worst:e} against stiffness {scale:e}");
        }
        let m = faer::Mat::from_fn(DOFS, DOFS, |i, j| k[i][j]);
        let eig = m.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
        let zeros = eig.iter().filter(|v| v.abs() < 1e-9 * eig[DOFS - 1]).count();
        assert_eq!(zeros, 6, "zero eigenvalues of {eig:?}");
    }

    #[test]
    fn pure_bending_of_one_element_is_exact() {
        // A 2×2×2 cube bent about y: u = κxz, w = -κx²/2 (+ Poisson terms); the energy per volume is E κ² z²/2.
        let (e, nu) = (205e9, 0.3);
        let mat = Material { young: e, poisson: nu, density: 1. };
        let k = stiffness(&CORNERS, &mat);
        let mut u = [0.0; DOFS];
        for (a, c) in CORNERS.iter().enumerate() {
            // Corner values of the beam solution; x² and y², z² parts live in the incompatible modes.
            u[3 * a] = c[0] * c[2];
            u[3 * a + 1] = -nu * c[1] * c[2];
        }
        let energy: f64 = 0.5 * (0..DOFS).map(|i| u[i] * (0..DOFS).map(|j| k[i][j] * u[j]).sum::<f64>()).sum::<f64>();
        let exact = 0.5 * e * 8. / 3.;
        assert!((energy / exact - 1.).abs() < 1e-12, "bending energy {energy:e}, beam theory {exact:e}");
    }

    #[test]
    fn constant_stress_is_exact_on_a_distorted_element() {
        let x = distorted();
        let mat = steel();
        let mut u = [0.0; DOFS];
        for a in 0..8 {
            u[3 * a] = 1e-3 * x[a][0] + 2e-3 * x[a][1];
            u[3 * a + 1] = -3e-3 * x[a][2];
            u[3 * a + 2] = 5e-4 * x[a][2];
        }
        let (l, mu) = mat.lame();
        let exact = stress_of([1e-3, 0., 5e-4, 2e-3, -3e-3, 0.], l, mu);
        for s in corner_stress(&x, &u, &mat) {
            for i in 0..6 {
                assert!(
                    (s[i] - exact[i]).abs() < 1e-9 * exact[0].abs(),
                    "component {i}: {} against {}",
                    s[i],
                    exact[i]
                );
            }
        }
    }

    #[test]
    fn mass_of_the_cube() {
        let m = mass(&CORNERS, 3.0);
        let total: f64 = m.iter().flatten().sum();
        assert!((total - 24.).abs() < 1e-12, "mass {total}");
        assert!((m[0][0] - 3.0 * 8. / 27.).abs() < 1e-12, "corner entry {}", m[0][0]);
    }
}
