use super::*;
use crate::sound::panels::Panel;

const AIR: Air = Air { density: 1.2, speed: 340.0 };

/// Panels along a curve (r, y)(t), 0 ≤ t ≤ 1, between these values of t.
fn along(t: &[f64], curve: impl Fn(f64) -> [f64; 2]) -> Vec<Panel> {
    t.windows(2).map(|w| Panel { points: [w[0], w[1], 0.5 * (w[0] + w[1])].map(&curve) }).collect()
}

/// The spheroid with these half axes, m, across and along the axis.
fn spheroid(across: f64, axial: f64, panels: usize) -> PanelSurface {
    let t: Vec<f64> = (0..=panels).map(|i| i as f64 / panels as f64).collect();
    PanelSurface::new(along(&t, |t| [across * (PI * t).sin().max(0.0), -axial * (PI * t).cos()]))
}

/// Frequency, Hz, of the wave number k, 1/m.
fn frequency(k: f64) -> f64 {
    k * AIR.speed / (2.0 * PI)
}

/// Associated Legendre function of the degree l and the order n, without the sign of Condon and Shortley.
fn legendre_function(l: usize, n: usize, x: f64) -> f64 {
    let (mut before, mut value) = (0.0, (0..n).map(|k| (2 * k + 1) as f64 * (1.0 - x * x).sqrt()).product::<f64>());
    for k in n..l {
        (before, value) = (value, ((2 * k + 1) as f64 * x * value - (k + n) as f64 * before) / (k + 1 - n) as f64);
    }
    value
}

/// Spherical Hankel function of the second kind, h_l = j_l − iy_l, and its derivative.
fn hankel(l: usize, x: f64) -> [Complex64; 2] {
    let first = Complex64::from_polar(1.0, -x) * Complex64::i() / x;
    let mut h = vec![first, first * (1.0 / x) + first * Complex64::i()];
    for k in 1..=l {
        h.push((2 * k + 1) as f64 / x * h[k] - h[k - 1]);
    }
    [h[l], l as f64 / x * h[l] - h[l + 1]]
}

/// Velocities at the nodes.
fn velocities(surface: &PanelSurface, of: impl Fn(&PanelNode) -> f64) -> Mat<f64> {
    Mat::from_fn(surface.nodes().len(), 1, |i, _| of(&surface.nodes()[i]))
}

/// Mean power of unit amplitude through the surface, ½ Re ∫ p v dS: another way than the far field.
fn through_surface(surface: &PanelSurface, field: &Field, i: usize, j: usize) -> Complex64 {
    let nodes = surface.nodes().iter().enumerate();
    let sum: Complex64 = nodes.map(|(k, node)| area(node) * field.pressure[(k, j)] * field.velocity[(k, i)]).sum();
    0.5 * round(field.order) * sum
}

/// Errors of a sphere of the radius 1 m that vibrates as the spherical harmonic (l, n): of the surface pressure
/// beside its largest value, of the power from the far field and of that through the surface.
fn of_sphere(panels: usize, [l, n]: [usize; 2], ka: f64, points: Option<&[[f64; 2]]>) -> [f64; 3] {
    let surface = spheroid(1.0, 1.0, panels);
    let velocity = velocities(&surface, |node| legendre_function(l, n, node.point.at[1].clamp(-1.0, 1.0)));
    let exterior = match points {
        Some(points) => Exterior::with_points(&surface, AIR, frequency(ka), n, points),
        None => Exterior::new(&surface, AIR, frequency(ka), n),
    };
    let field = exterior.field(n, velocity).expect("field");
    let [h, dh] = hankel(l, ka);
    let impedance = -Complex64::i() * AIR.density * AIR.speed * h / dh;
    let error = |i: usize| (field.pressure[(i, 0)] - impedance * field.velocity[(i, 0)]).norm();
    let largest = |of: &dyn Fn(usize) -> f64| (0..field.pressure.nrows()).map(of).fold(0.0, f64::max);
    let pressure = largest(&error) / largest(&|i| (impedance * field.velocity[(i, 0)]).norm());
    // ∫ (P_l^n cos nθ)² dS in closed form.
    let factorial = |k: usize| (1..=k).map(|i| i as f64).product::<f64>();
    let square = round(n) * 2.0 / (2 * l + 1) as f64 * factorial(l + n) / factorial(l - n);
    let power = 0.5 * AIR.density * AIR.speed * square / (ka * ka * dh.norm_sqr());
    let far = 0.5 * exterior.resistance(&field)[(0, 0)];
    let near = through_surface(&surface, &field, 0, 0).re;
    [pressure, far / power - 1.0, near / power - 1.0]
}

/// Spherical harmonics of all kinds, small and large spheres. The error of the power is divided by 16 with each
/// halving of the panels (parabolas in place of arcs, and quadratic pressures, whose errors add up to the fourth
/// power), that of the pressure by 8 at least.
#[test]
fn spheres_radiate_as_hankels_functions_say() {
    for ka in [0.3, 1.0, 3.0, 8.0] {
        for ln in [[0, 0], [1, 0], [1, 1], [2, 0], [2, 2], [3, 2], [3, 3]] {
            let [coarse, fine] = [8, 16].map(|panels| of_sphere(panels, ln, ka, None));
            assert!(
                fine[0] < 1.5e-4 && coarse[0] < 1.5e-3,
                "{ln:?}, ka {ka}: pressure {:.1e}, {:.1e}",
                coarse[0],
                fine[0]
            );
            assert!(coarse[0] / fine[0] > 6.5, "{ln:?}, ka {ka}: pressure {:.1e}, {:.1e}", coarse[0], fine[0]);
            for (coarse, fine) in coarse[1..].iter().zip(&fine[1..]) {
                assert!(fine.abs() < 2.5e-5, "{ln:?}, ka {ka}: power {coarse:.1e}, {fine:.1e}");
                // The fourth power, where the error is not next to nothing already.
                let order = (coarse / fine).abs().log2();
                assert!(order > 3.5 || fine.abs() < 2e-6, "{ln:?}, ka {ka}: power {coarse:.1e}, {fine:.1e}");
            }
        }
    }
}

/// At a resonance of the space inside the integral equation alone has errors of percents; with points inside, none
/// beyond those beside it.
#[test]
fn resonances_of_the_space_inside_are_not_seen() {
    let mut worst: f64 = 0.0;
    // Zeros of j_0, j_1, j_2, with harmonics that each have that resonance.
    for (ka, ln) in [(PI, [0, 0]), (4.493409457909064, [1, 0]), (4.493409457909064, [1, 1]), (5.76345919689455, [2, 2])]
    {
        let [pressure, far, near] = of_sphere(12, ln, ka, None);
        let [beside, ..] = of_sphere(12, ln, 1.03 * ka, None);
        assert!(
            pressure < 1.1 * beside && far.abs() < 3e-5 && near.abs() < 3e-5,
            "{ln:?}: {pressure:.1e}, {beside:.1e}, {far:.1e}"
        );
        let alone = of_sphere(12, ln, ka, Some(&[]));
        worst = worst.max(alone[0] / pressure);
    }
    assert!(worst > 100.0, "without points the resonances do no harm here: {worst:.1}");
}

/// A body that moves to and fro along its axis, small against the wave: the power of a dipole, P = ρc k⁴ (V +
/// m_a/ρ)²/(24π), with the added mass m_a of the oblate spheroid (H. Lamb, *Hydrodynamics*, 6th ed., 1932, §114).
/// However thin it is; the rest is of the order (ka)².
#[test]
fn thin_spheroids_are_dipoles_with_their_added_mass() {
    for (axial, panels) in [(0.5, 16), (0.1, 16), (0.02, 24), (0.005, 32)] {
        let surface = spheroid(1.0, axial, panels);
        let ka = 0.02;
        let exterior = Exterior::new(&surface, AIR, frequency(ka), 0);
        let field = exterior.field(0, velocities(&surface, |node| node.point.normal[1])).expect("field");
        let e = f64::sqrt(1.0 - axial * axial);
        let alpha = 2.0 / (e * e) * (1.0 - axial / e * e.asin());
        let volume = 4.0 / 3.0 * PI * axial * (1.0 + alpha / (2.0 - alpha));
        let power = AIR.density * AIR.speed * ka.powi(4) * volume * volume / (24.0 * PI);
        let error = 0.5 * exterior.resistance(&field)[(0, 0)] / power - 1.0;
        assert!(error.abs() < 0.5 * ka * ka, "{axial}: {error:.1e}");
    }
}

/// A flat disc of the radius 1 m and this thickness; its panels become small towards the edge.
fn disc(thickness: f64) -> PanelSurface {
    let mut inwards = vec![0.0];
    let mut size = 0.25 * thickness;
    while inwards[inwards.len() - 1] + 1.5 * size < 1.0 {
        inwards.push(inwards[inwards.len() - 1] + size);
        size = (1.5 * size).min(0.1);
    }
    inwards.push(1.0);
    let below = inwards.iter().rev().map(|x| [1.0 - x, -0.5 * thickness]);
    let edge = [-0.25, 0.0, 0.25].map(|y| [1.0, y * thickness]);
    let above = inwards.iter().map(|x| [1.0 - x, 0.5 * thickness]);
    let corners: Vec<[f64; 2]> = below.chain(edge).chain(above).collect();
    let straight = |w: &[[f64; 2]]| Panel { points: [w[0], w[1], [0, 1].map(|c| 0.5 * (w[0][c] + w[1][c]))] };
    PanelSurface::new(corners.windows(2).map(straight).collect())
}

/// σ = 8 (ka)⁴/(27π²) on both faces of a rigid disc without thickness, ka ≪ 1 (from its added mass 8ρa³/3, as Lamb,
/// §102). What the edge of a thick one adds goes with h and h ln h: three thicknesses tell the limit.
#[test]
fn a_rigid_disc_radiates_as_its_added_mass_says() {
    let ka: f64 = 0.03;
    let efficiency = |h: f64| {
        let surface = disc(h);
        let exterior = Exterior::new(&surface, AIR, frequency(ka), 0);
        let field = exterior.field(0, velocities(&surface, |node| node.point.normal[1])).expect("field");
        let [far, near] = [exterior.resistance(&field)[(0, 0)], 2.0 * through_surface(&surface, &field, 0, 0).re];
        assert!((near / far - 1.0).abs() < 1e-4, "{h}: {far:.6e}, {near:.6e}");
        let square = square(&surface, 0, &field.velocity)[(0, 0)];
        assert!((square / (2.0 * PI) - 1.0).abs() < 1e-12, "{square}");
        far / (AIR.density * AIR.speed * square) / (8.0 * ka.powi(4) / (27.0 * PI * PI))
    };
    let [a, b, c] = [0.02, 0.01, 0.005].map(efficiency);
    assert!(a > b && b > c && c > 1.0 && c < 1.04, "{a}, {b}, {c}");
    // f(2h) − 2f(h) = −f(0) + 2h s ln 2.
    let limit = 2.0 * (2.0 * c - b) - (2.0 * b - a);
    assert!((limit - 1.0).abs() < 2e-3, "{limit} of {a}, {b}, {c}");
}

/// A lathe's piece with a thin web and edges that stand out and in: what one velocity radiates by another's pressure
/// is mutual, and the power through the surface is that in the far field, for all orders.
#[test]
fn resistances_are_symmetric_positive_and_the_same_near_and_far() {
    let corners: [[f64; 2]; 12] = [
        [0.0, -0.09],
        [0.13, -0.09],
        [0.13, -0.012],
        [0.39, -0.012],
        [0.39, -0.065],
        [0.46, -0.065],
        [0.46, 0.07],
        [0.39, 0.07],
        [0.39, 0.012],
        [0.13, 0.012],
        [0.13, 0.09],
        [0.0, 0.09],
    ];
    let mut panels = Vec::new();
    for w in corners.windows(2) {
        let count = 2 + 2 * ((w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]) / 0.05).ceil() as usize;
        let t: Vec<f64> = (0..=count).map(|i| 0.5 - 0.5 * (PI * i as f64 / count as f64).cos()).collect();
        panels.extend(along(&t, |t| [0, 1].map(|c| w[0][c] + t * (w[1][c] - w[0][c]))));
    }
    let surface = PanelSurface::new(panels);
    for f in [150.0, 900.0, 2700.0] {
        let exterior = Exterior::new(&surface, AIR, f, 5);
        for order in [0, 1, 2, 5] {
            let kinds: [fn(&PanelNode) -> f64; 3] = [
                |n| n.point.normal[1] * n.point.at[0],
                |n| n.point.normal[0] * n.point.at[0],
                |n| n.point.at[0].powi(2) * (1.0 + 20.0 * n.point.at[1]),
            ];
            let velocity = Mat::from_fn(surface.nodes().len(), 3, |i, j| kinds[j](&surface.nodes()[i]));
            let field = exterior.field(order, velocity).expect("field");
            let far = exterior.resistance(&field);
            let through = Mat::from_fn(3, 3, |i, j| through_surface(&surface, &field, i, j));
            for i in 0..3 {
                assert!(far[(i, i)] > 0.0);
                for j in 0..3 {
                    let size = (through[(i, i)].norm() * through[(j, j)].norm()).sqrt();
                    let mutual = (through[(i, j)] - through[(j, i)]).norm() / size;
                    assert!(mutual < 1e-4, "{f} Hz, order {order}, {i} {j}: {mutual:.1e} apart");
                    assert_eq!(far[(i, j)], far[(j, i)]);
                    let apart = (2.0 * through[(i, j)].re - far[(i, j)]).abs() / (far[(i, i)] * far[(j, j)]).sqrt();
                    assert!(apart < 1e-3, "{f} Hz, order {order}, {i} {j}: {apart:.1e} between near and far");
                }
            }
            let least = far.self_adjoint_eigenvalues(faer::Side::Lower).expect("eigenvalues")[0];
            assert!(least > -1e-12 * far.norm_max(), "{f} Hz, order {order}: {least:.1e}");
        }
    }
}

/// The pressure outside of a sphere, close to it and in the far field.
#[test]
fn pressures_outside_are_hankels_functions_too() {
    let (surface, ka) = (spheroid(1.0, 1.0, 16), 2.0);
    for (l, n) in [(0, 0), (1, 1), (3, 2)] {
        let velocity = velocities(&surface, |node| legendre_function(l, n, node.point.at[1].clamp(-1.0, 1.0)));
        let exterior = Exterior::new(&surface, AIR, frequency(ka), n);
        let field = exterior.field(n, velocity).expect("field");
        let largest = (0..field.velocity.nrows()).map(|i| field.velocity[(i, 0)].abs()).fold(0.0, f64::max);
        let amplitude = -Complex64::i() * AIR.density * AIR.speed / hankel(l, ka)[1];
        for distance in [1.01, 1.5, 10.0, 400.0] {
            for cosine in [-0.9, 0.1, 0.7] {
                let at = [distance * f64::sqrt(1.0 - cosine * cosine), distance * cosine];
                let wanted = amplitude * hankel(l, ka * distance)[0] * legendre_function(l, n, cosine);
                let found = exterior.pressure(&field, at)[0];
                let scale = largest * (amplitude * hankel(l, ka * distance)[0]).norm();
                // Closer to the surface than a panel is long the parabolas between the nodes are seen.
                let close = if distance < 1.1 { 5e-4 } else { 3e-5 };
                assert!((found - wanted).norm() < close * scale, "({l}, {n}) at {at:?}: {found} for {wanted}");
                if distance > 300.0 {
                    let far = exterior.far(&field, cosine)[0];
                    let far = far * Complex64::from_polar(1.0 / (4.0 * PI * distance), -ka * distance);
                    // The rest falls with the distance.
                    assert!((far - wanted).norm() < 1e-2 * scale, "({l}, {n}) at {at:?}: {far} for {wanted}");
                }
            }
        }
    }
}

impl Exterior<'_> {
    /// Pressure at a point (r, y) outside of the body, Pa, `[m]`, in the plane where cos nθ = 1.
    fn pressure(&self, field: &Field, at: [f64; 2]) -> Vec<Complex64> {
        let k = self.air.wave_number(self.frequency);
        let mut integrals = Integrals::new(Layers::new(field.order), field.order + 1);
        let mut p = vec![Complex64::default(); field.velocity.ncols()];
        let source = Complex64::i() * self.angular() * self.air.density;
        self.surface.integrate(at, None, k, &mut integrals, |order, node, [single, double]| {
            if order == field.order {
                for (c, p) in p.iter_mut().enumerate() {
                    *p += double * field.pressure[(node, c)] + single * source * field.velocity[(node, c)];
                }
            }
        });
        p
    }
}
