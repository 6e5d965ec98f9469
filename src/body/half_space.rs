//! Elastic half-space: displacements of the surface under a uniform traction on rectangles (Boussinesq, Cerruti, Love).
//!
//! Point forces on a half-space, surface displacements at the offset (X, Y) with r² = X² + Y², n into the body
//! (K. L. Johnson, Contact Mechanics, 1985, equations (3.18) and (3.75) at the surface):
//! a normal force P gives u_n = P(1−ν)/(2πG r), u_x = −P(1−2ν) X/(4πG r²), u_y likewise with Y;
//! a tangential force Q along x gives u_x = Q/(2πG)·((1−ν)/r + ν X²/r³), u_y = Q ν X Y/(2πG r³), u_n = Q(1−2ν) X/(4πG
//! r²).

use super::hybrid::{self, Compact, ContactFunctions, Lines};
use super::modes::Extent;
use super::near_contacts::{add_between, dual_sides, on_one_surface, ContactPosition};
use super::{ElasticBody, Kind, ProgressFn, TraceModes};
use crate::parallel::World;
use crate::swept::LOADS;
use crate::Result;
use faer::Mat;

/// Isotropic material of a half-space.
///
/// ```
/// use railsqueal::body::half_space::HalfSpace;
///
/// let steel = HalfSpace { young: 210e9, poisson: 0.3 };
/// assert!((steel.shear() - 80.77e9).abs() < 1e7);
/// // Two alike bodies have the contact modulus E* = E / 2(1 − ν²).
/// assert!((0.5 * steel.plane() - 115.4e9).abs() < 1e8);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace {
    /// Young's modulus E, Pa.
    pub young: f64,
    /// Poisson's ratio ν, 1.
    pub poisson: f64,
}

impl HalfSpace {
    /// Shear modulus G = E/(2(1+ν)), Pa.
    pub fn shear(&self) -> f64 {
        0.5 * self.young / (1.0 + self.poisson)
    }

    /// Plane-strain modulus E/(1−ν²), Pa: the contact modulus E* has 1/E* = Σ over the bodies of its inverse.
    pub fn plane(&self) -> f64 {
        self.young / (1.0 - self.poisson * self.poisson)
    }

    /// Surface displacement (x, y, n) at the offset `at` (m) from the centre of a rectangle of sides `sides` (m),
    /// under a unit force spread evenly over the rectangle: column c is for the force along c of (x, y, n). m/N,
    /// `[row][column]`.
    ///
    /// ```
    /// use railsqueal::body::half_space::HalfSpace;
    ///
    /// let steel = HalfSpace { young: 210e9, poisson: 0.3 };
    /// // Far away a pressed square acts as a point force: u_n = (1 − ν) F / (2π G r).
    /// let far = steel.influence([0.1, 0.0], [1e-3, 1e-3])[2][2];
    /// let point = 0.7 / (2.0 * std::f64::consts::PI * steel.shear() * 0.1);
    /// assert!((far / point - 1.0).abs() < 1e-4);
    /// ```
    pub fn influence(&self, at: [f64; 2], sides: [f64; 2]) -> [[f64; 3]; 3] {
        let of = |[sx, sy]: [f64; 2]| corner(at[0] + sx * sides[0], at[1] + sy * sides[1]);
        self.by_corners([[0.5, 0.5], [-0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]].map(of).each_ref(), sides)
    }

    /// [`influence`](Self::influence) by the values of [`corner`] at the corners (+, +), (−, +), (+, −), (−, −) of the
    /// rectangle.
    fn by_corners(&self, corners: [&[f64; 6]; 4], sides: [f64; 2]) -> [[f64; 3]; 3] {
        // Antiderivatives of 1/r, X²/r³, Y²/r³, XY/r³, X/r², Y/r² over both coordinates, summed with alternate signs
        // over the four corners.
        let mut s = [0.0; 6];
        for (f, sign) in corners.into_iter().zip([1.0, -1.0, -1.0, 1.0]) {
            for (a, b) in s.iter_mut().zip(f) {
                *a += sign * b;
            }
        }
        let nu = self.poisson;
        let unit = 1.0 / (2.0 * std::f64::consts::PI * self.shear() * sides[0] * sides[1]);
        let [inv, xx, yy, xy, x, y] = s.map(|v| v * unit);
        let k = 0.5 - nu;
        [
            [(1.0 - nu) * inv + nu * xx, nu * xy, -k * x],
            [nu * xy, (1.0 - nu) * inv + nu * yy, -k * y],
            [k * x, k * y, (1.0 - nu) * inv],
        ]
    }

    /// Compliance of the nodes of a rectilinear grid, m/N, `[3n, 3n]`, rows and columns `3*i + (x, y, n)`, node
    /// i = ix + nx·iy: each nodal force is spread evenly over the node's dual rectangle (reaching half-way to its
    /// neighbours, symmetric about the node at the border of the grid), displacements are taken at the nodes. On
    /// uniform grids it is symmetric and depends on the offset only; on graded ones, where taking displacements at
    /// nodes breaks reciprocity by a little, it is the mean of the matrix and its transpose.
    pub fn compliance(&self, x: &[f64], y: &[f64]) -> Result<Mat<f64>> {
        let (nx, ny) = (x.len(), y.len());
        let (dx, dy) = (dual_sides(x)?, dual_sides(y)?);
        let n = nx * ny;
        let mut c = Mat::<f64>::zeros(3 * n, 3 * n);
        if is_uniform(x) && is_uniform(y) {
            let table = self.offsets(x, y)?;
            for j in 0..n {
                let (jx, jy) = (j % nx, j / nx);
                for cj in 0..3 {
                    let col = c.col_as_slice_mut(3 * j + cj);
                    for iy in 0..ny {
                        let sy = if iy >= jy { 1.0 } else { -1.0 };
                        let line = &table[nx * iy.abs_diff(jy)..][..nx];
                        let out = &mut col[3 * nx * iy..][..3 * nx];
                        for (ix, o) in out.chunks_exact_mut(3).enumerate() {
                            let sx = if ix >= jx { 1.0 } else { -1.0 };
                            let f = &line[ix.abs_diff(jx)];
                            let sign = [sx, sy, 1.0];
                            for ci in 0..3 {
                                // A term is odd in each coordinate that its two components name once.
                                o[ci] = if ci == cj { f[ci][cj] } else { f[ci][cj] * sign[ci] * sign[cj] };
                            }
                        }
                    }
                }
            }
        } else {
            for j in 0..n {
                let sides = [dx[j % nx], dy[j / nx]];
                for i in 0..n {
                    let f = self.influence([x[i % nx] - x[j % nx], y[i / nx] - y[j / nx]], sides);
                    for (ci, row) in f.iter().enumerate() {
                        for (cj, v) in row.iter().enumerate() {
                            c[(3 * i + ci, 3 * j + cj)] += 0.5 * v;
                            c[(3 * j + cj, 3 * i + ci)] += 0.5 * v;
                        }
                    }
                }
            }
        }
        Ok(c)
    }
}

impl HalfSpace {
    /// [`influence`](Self::influence) of a node of a uniform grid at the offsets in +x and +y, `[nx·ny]`.
    pub(super) fn offsets(&self, x: &[f64], y: &[f64]) -> Result<Vec<[[f64; 3]; 3]>> {
        let (nx, ny, [hx, hy]) = (x.len(), y.len(), [dual_sides(x)?[0], dual_sides(y)?[0]]);
        // Rectangles beside each other share their corners.
        let place = |k: usize| corner(((k % (nx + 1)) as f64 - 0.5) * hx, ((k / (nx + 1)) as f64 - 0.5) * hy);
        let corners: Vec<[f64; 6]> = (0..(nx + 1) * (ny + 1)).map(place).collect();
        let of = |k: usize| {
            let low = k % nx + (nx + 1) * (k / nx);
            self.by_corners([low + nx + 2, low + nx + 1, low + 1, low].map(|k| &corners[k]), [hx, hy])
        };
        Ok((0..nx * ny).map(of).collect())
    }

    /// The influence at the offset that is `ahead` along x and y, or behind, of that at the same offset in +x and +y.
    pub(super) fn towards(ahead: [bool; 2], influence: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
        let sign = [ahead[0], ahead[1], true].map(|s| if s { 1.0 } else { -1.0 });
        // A term is odd in each coordinate that its two components name once.
        std::array::from_fn(|i| {
            std::array::from_fn(|j| if i == j { influence[i][j] } else { influence[i][j] * sign[i] * sign[j] })
        })
    }
}

/// A half-space as a body, with the nodes of a rectilinear grid.
pub struct HalfSpaceBody<'w> {
    world: &'w World,
    name: String,
    material: HalfSpace,
    grids: Vec<Lines>,
    /// Position of each contact; none where it is not known.
    positions: Vec<Option<ContactPosition>>,
}

/// Contact of a half-space, on rank 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpaceContact<'a> {
    /// Lines of the grid along x and y, m.
    pub lines: [&'a [f64]; 2],
    /// Its position on the body; none where it is not known: what it does to the other contacts is left out.
    pub position: Option<ContactPosition>,
}

impl<'w> HalfSpaceBody<'w> {
    /// The half-space `name` of a material; rank 0 gives the lines of the grid, m, `[nx]` and `[ny]`.
    pub fn new(world: &'w World, name: &str, material: HalfSpace, grid: Option<[&[f64]; 2]>) -> Self {
        let contact = grid.map(|lines| HalfSpaceContact { lines, position: None });
        Self::with_contacts(world, name, material, contact.as_slice())
    }

    /// The same with several contacts, which rank 0 gives.
    pub(crate) fn with_contacts(
        world: &'w World,
        name: &str,
        material: HalfSpace,
        contacts: &[HalfSpaceContact],
    ) -> Self {
        let count = world.broadcast(vec![contacts.len() as u64]).first().map_or(0, |&n| n as usize);
        let line = |k: usize, c: usize| world.broadcast(contacts.get(k).map_or(Vec::new(), |of| of.lines[c].to_vec()));
        let grids = (0..count).map(|k| [line(k, 0), line(k, 1)]).collect();
        let position = |k: usize| {
            let known = contacts.get(k).and_then(|of| of.position).map(|p| [p.point, p.normal].concat());
            match world.broadcast(known.unwrap_or_default())[..] {
                [x, y, z, a, b, c] => Some(ContactPosition { point: [x, y, z], normal: [a, b, c] }),
                _ => None,
            }
        };
        Self { world, name: name.into(), material, grids, positions: (0..count).map(position).collect() }
    }

    /// Compliance of all contact rows, m/N, `[3n, 3n]`: between two contacts on one surface the influence of the forces
    /// on the nodes of one, each spread over its rectangle, on those of the other; none of others.
    fn matrix(&self) -> Result<Mat<f64>> {
        self.material.of_contacts(&self.grids, &self.positions)
    }
}

impl HalfSpace {
    fn of_contacts(&self, grids: &[Lines], positions: &[Option<ContactPosition>]) -> Result<Mat<f64>> {
        let mut all = hybrid::half_spaces(self, grids)?;
        add_between(&mut all, self, (grids, &on_one_surface(positions, grids)), 1.0)?;
        Ok(all)
    }
}

impl ElasticBody for HalfSpaceBody<'_> {
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> Kind {
        Kind::HalfSpace
    }

    fn rows(&self) -> usize {
        self.grids.iter().map(hybrid::rows).sum()
    }

    fn compliance(&self, _: &mut ProgressFn) -> Result<Option<Mat<f64>>> {
        self.world.on_root(|| self.matrix())
    }

    fn compact(&self) -> Result<Option<Compact>> {
        let order = LOADS * self.grids.len();
        let near = on_one_surface(&self.positions, &self.grids);
        Ok(Some(Compact {
            half_space: self.material,
            near,
            beside: Mat::zeros(order, order),
            seen: Mat::zeros(order, 0),
        }))
    }

    fn contact_functions(&self) -> Result<Option<ContactFunctions>> {
        let whole =
            |Compact { half_space, near, beside, seen }| ContactFunctions { half_space, near, constant: beside, seen };
        Ok(self.compact()?.map(whole))
    }

    fn factorise(&mut self) -> Result<Option<String>> {
        let contacts = self.grids.len();
        let (all, known) =
            (contacts * contacts.saturating_sub(1) / 2, on_one_surface(&self.positions, &self.grids).len());
        Ok((known < all).then(|| {
            format!(
                "half-space with {contacts} contacts: what they do to each other is known of {known} of {all} pairs, \
                 and left out of the others"
            )
        }))
    }

    /// None: it has no inertia that would reflect waves.
    fn modes(&mut self, _: Extent, _: &mut ProgressFn) -> Result<TraceModes> {
        let rows = self.world.is_root().then(|| Mat::zeros(ElasticBody::rows(self), 0));
        Ok(TraceModes { rows, reach: f64::INFINITY, ..TraceModes::default() })
    }

    fn response(&self, forces: &[f64]) -> Result<Vec<f64>> {
        let found = self.world.on_root(|| {
            let compliance = self.matrix()?;
            let row = |i: usize| compliance.row(i).iter().zip(forces).map(|(c, f)| c * f).sum();
            Ok((0..compliance.nrows()).map(row).collect())
        })?;
        Ok(found.unwrap_or_default())
    }
}

/// Antiderivatives at a corner (X, Y): of 1/r, X²/r³, Y²/r³, XY/r³, X/r², Y/r².
fn corner(x: f64, y: f64) -> [f64; 6] {
    let r = x.hypot(y);
    // Y asinh(X/|Y|) is Y ln(X + r) up to a term that cancels between corners, without loss of digits at X < 0.
    let a = if x == 0.0 { 0.0 } else { x * (y / x.abs()).asinh() };
    let b = if y == 0.0 { 0.0 } else { y * (x / y.abs()).asinh() };
    let ln = if r == 0.0 { 0.0 } else { r.ln() };
    // The principal branch of atan(Y/X) jumps at X = 0, where its factor vanishes.
    let p = if x == 0.0 { y * ln } else { y * ln + x * (y / x).atan() };
    let q = if y == 0.0 { x * ln } else { x * ln + y * (x / y).atan() };
    [a + b, b, a, -r, p, q]
}

/// Equal spacing to the digits that positions read from a mesh file keep.
pub(crate) fn is_uniform(x: &[f64]) -> bool {
    let h = (x[x.len() - 1] - x[0]) / (x.len() - 1) as f64;
    x.windows(2).all(|w| (w[1] - w[0] - h).abs() <= 1e-9 * h)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Displacement (x, y, z into the body) under a unit normal force at the origin, inside the half-space, Johnson
    /// (3.18).
    fn boussinesq(m: &HalfSpace, p: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = p;
        let rho = (x * x + y * y + z * z).sqrt();
        let k = 1.0 / (4.0 * std::f64::consts::PI * m.shear());
        let h = z / rho.powi(3) - (1.0 - 2.0 * m.poisson) / (rho * (rho + z));
        [k * x * h, k * y * h, k * (z * z / rho.powi(3) + 2.0 * (1.0 - m.poisson) / rho)]
    }

    /// Stresses σ_xz, σ_yz, σ_zz by central differences of a displacement field.
    fn traction_z(m: &HalfSpace, p: [f64; 3]) -> [f64; 3] {
        let h = 1e-4;
        let mut g = [[0.0; 3]; 3];
        for d in 0..3 {
            let (mut a, mut b) = (p, p);
            a[d] += h;
            b[d] -= h;
            let (ua, ub) = (boussinesq(m, a), boussinesq(m, b));
            for c in 0..3 {
                g[c][d] = (ua[c] - ub[c]) / (2.0 * h);
            }
        }
        let lambda = 2.0 * m.shear() * m.poisson / (1.0 - 2.0 * m.poisson);
        let tr = g[0][0] + g[1][1] + g[2][2];
        [m.shear() * (g[0][2] + g[2][0]), m.shear() * (g[1][2] + g[2][1]), lambda * tr + 2.0 * m.shear() * g[2][2]]
    }

    /// The point-load solution that fixes the sign of the coupling must satisfy elasticity: with the opposite sign of
    /// its (1−2ν) term in u_x the surface z = 0 would not be free of shear, and the force on z = const would not be
    /// one.
    #[test]
    fn point_load_solution_leaves_the_surface_free_and_carries_the_force() {
        let m = HalfSpace { young: 2.6, poisson: 0.25 };
        for p in [[0.7, 0.2, 0.0], [-0.3, 0.9, 0.0]] {
            let t = traction_z(&m, p);
            assert!(t.iter().all(|v| v.abs() < 1e-6), "traction on the free surface: {t:?}");
        }
        let (mut force, n, z) = (0.0, 400, 0.3);
        for i in 0..n {
            // ∫ 2πr σ_zz dr with r = z tan α.
            let a = (i as f64 + 0.5) / n as f64 * std::f64::consts::FRAC_PI_2;
            let r = z * a.tan();
            let dr = z / a.cos().powi(2) * std::f64::consts::FRAC_PI_2 / n as f64;
            if r < 50.0 {
                force += 2.0 * std::f64::consts::PI * r * traction_z(&m, [r, 0.0, z])[2] * dr;
            }
        }
        assert!((force + 1.0).abs() < 1e-3, "force through z = {z}: {force}");
    }

    #[test]
    fn rectangle_integrals_equal_numerical_integration_of_point_loads() {
        let m = HalfSpace { young: 3.0, poisson: 0.3 };
        let (g, nu, pi) = (m.shear(), m.poisson, std::f64::consts::PI);
        let sides = [0.4, 0.7];
        for at in [[0.9, 0.3], [-0.6, 0.8], [0.5, -0.9], [-0.7, -0.6], [0.0, 1.1], [1.0, 0.0]] {
            let mut want = [[0.0; 3]; 3];
            let points = || crate::quadrature::legendre(8);
            for (px, wx) in points() {
                for (py, wy) in points() {
                    let (x, y) = (at[0] - 0.5 * sides[0] * px, at[1] - 0.5 * sides[1] * py);
                    let (r, w) = (x.hypot(y), 0.25 * wx * wy);
                    // The normal column is the surface value of the field that the test above verifies.
                    let un = boussinesq(&m, [x, y, 0.0]);
                    let k = w / (2.0 * pi * g);
                    let f = [
                        [k * ((1.0 - nu) / r + nu * x * x / r.powi(3)), k * nu * x * y / r.powi(3), w * un[0]],
                        [k * nu * x * y / r.powi(3), k * ((1.0 - nu) / r + nu * y * y / r.powi(3)), w * un[1]],
                        [-w * un[0], -w * un[1], w * un[2]],
                    ];
                    for i in 0..3 {
                        for j in 0..3 {
                            want[i][j] += f[i][j];
                        }
                    }
                }
            }
            let got = m.influence(at, sides);
            for i in 0..3 {
                for j in 0..3 {
                    let e = (got[i][j] - want[i][j]).abs();
                    assert!(e < 1e-8, "{at:?} ({i},{j}): {} against {}", got[i][j], want[i][j]);
                }
            }
        }
    }

    /// Love: a square of side h under unit pressure sinks by 4 ln(1+√2)(1−ν²) h/(πE) at its centre.
    #[test]
    fn centre_of_a_loaded_square() {
        let m = HalfSpace { young: 2.0, poisson: 0.3 };
        let h = 0.2;
        let want = 4.0 * (1.0 + 2f64.sqrt()).ln() * (1.0 - 0.09) * h / (std::f64::consts::PI * 2.0);
        let got = m.influence([0.0, 0.0], [h, h])[2][2] * h * h;
        assert!((got / want - 1.0).abs() < 1e-12, "{got} {want}");
    }

    #[test]
    fn compliance_obeys_reciprocity_and_is_positive_definite() {
        let m = HalfSpace { young: 200.0, poisson: 0.28 };
        let uniform: Vec<f64> = (0..5).map(|i| 0.3 * i as f64).collect();
        let graded = vec![0.0, 0.2, 0.5, 1.0];
        for (x, y) in [(&uniform, &uniform), (&uniform, &graded), (&graded, &graded)] {
            let c = m.compliance(x, y).unwrap();
            for i in 0..c.nrows() {
                for j in 0..i {
                    let (a, b) = (c[(i, j)], c[(j, i)]);
                    assert!((a - b).abs() <= 1e-13 * c[(0, 0)], "({i},{j}): {a} {b}");
                }
            }
            assert!(c.llt(faer::Side::Lower).is_ok(), "not positive definite");
        }
    }

    /// Two contacts on one plane have the influence of one grid that spans both; one at an unknown position has none.
    #[test]
    fn contacts_on_one_plane_are_parts_of_one_grid() {
        let m = HalfSpace { young: 200.0, poisson: 0.3 };
        let line = |first: i32, n: i32| (first..first + n).map(|i| 0.25 * f64::from(i)).collect::<Vec<f64>>();
        let (whole, left, right, y) = (line(-2, 9), line(-2, 5), line(0, 4), line(-1, 3));
        let grids = [[left, y.clone()], [right, y.clone()]];
        let at = |[x, y]: [f64; 2]| Some(ContactPosition::straight([0.0, y], x, 0.0));
        let body = |positions: [Option<ContactPosition>; 2]| m.of_contacts(&grids, &positions).unwrap();
        let all = m.compliance(&whole, &y).unwrap();
        let found = body([at([0.1, 0.3]), at([0.1 + 0.75, 0.3])]);
        assert_eq!(found.nrows(), all.nrows());
        // Nodes of the left grid, then those of the right one, among those of the whole.
        let place = |k: usize| match k < 15 {
            true => k % 5 + 9 * (k / 5),
            false => 5 + (k - 15) % 4 + 9 * ((k - 15) / 4),
        };
        for i in 0..found.nrows() {
            for j in 0..found.nrows() {
                let wanted = all[(3 * place(i / 3) + i % 3, 3 * place(j / 3) + j % 3)];
                assert!((found[(i, j)] - wanted).abs() < 1e-15, "{i} {j}: {} {wanted}", found[(i, j)]);
            }
        }
        let apart = body([at([0.1, 0.3]), None]);
        assert!((0..45).all(|i| (45..81).all(|j| apart[(i, j)] == 0.0 && apart[(j, i)] == 0.0)));
    }

    #[test]
    fn fast_assembly_equals_the_influence_of_each_pair() {
        let m = HalfSpace { young: 200.0, poisson: 0.3 };
        let x: Vec<f64> = (0..4).map(|i| 0.25 * i as f64).collect();
        let y: Vec<f64> = (0..3).map(|i| 0.5 * i as f64).collect();
        let c = m.compliance(&x, &y).unwrap();
        for i in 0..12 {
            for j in 0..12 {
                let f = m.influence([x[i % 4] - x[j % 4], y[i / 4] - y[j / 4]], [0.25, 0.5]);
                for a in 0..3 {
                    for b in 0..3 {
                        let got = c[(3 * i + a, 3 * j + b)];
                        assert!((got - f[a][b]).abs() < 1e-15, "nodes {i} {j} ({a},{b}): {got} {}", f[a][b]);
                    }
                }
            }
        }
    }
}
