//! A wheel that turns: frequencies of its waves against an axisymmetric solution, against the same in a frame that
//! turns with it, and what is refused.

use crate::elasticity::block;
use faer::Mat;
use railsqueal::body::elements::{Elements, StaticMethod};
use railsqueal::body::fe::FeBody;
use railsqueal::body::modes::Extent;
use railsqueal::body::statics::Statics;
use railsqueal::body::{ElasticBody, ModalMatrix};
use railsqueal::fem::assembly::Assembly;
use railsqueal::fem::forms::{Convected, Gyroscopic, PrestressStiffness};
use railsqueal::fem::rotation::Axis;
use railsqueal::fem::ElasticMaterial;
use railsqueal::mesh::cylinder::{build, CylinderSpec, DEFAULT_GROWTH};
use railsqueal::model::waves;
use railsqueal::parallel::World;
use railsqueal::petsc::csr::DistCsr;
use railsqueal::petsc::Petsc;
use railsqueal::swept::modes::of_order;
use railsqueal::swept::{blocks, cylinder, CylinderSection, Focus, Forms};
use std::f64::consts::PI;

const RADIUS: f64 = 0.5;

/// The plain annulus with a clamped bore.
fn annulus(world: &World, size: f64, fixed: &str) -> FeBody {
    let spec = CylinderSpec {
        inner_radius: 0.1,
        outer_radius: RADIUS,
        thickness: 0.1,
        crown_radius: None,
        contact_offset: 0.0,
        element_size: size,
        growth: DEFAULT_GROWTH,
        max_element_size: Some(size),
        patch_half_length: 0.0,
        patch_half_width: 0.0,
    };
    let mesh = world.is_root().then(|| build(&spec).expect("an annulus"));
    let material = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800.0 };
    let groups: Vec<String> = Some(fixed.to_owned()).into_iter().filter(|g| !g.is_empty()).collect();
    FeBody::new(world, "wheel", mesh.as_ref(), None, material, &groups).expect("a body")
}

/// Collective: ΦᵀAΦ.
fn bilinear(world: &World, a: &DistCsr, left: &[Vec<f64>], right: &[Vec<f64>]) -> Mat<f64> {
    let operator = a.operator(world);
    let images: Vec<Vec<f64>> = right
        .iter()
        .map(|v| {
            let mut out = vec![0.0; v.len()];
            operator.apply(world, v, &mut out);
            out
        })
        .collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let m = left.len();
    let own: Vec<f64> = (0..m * right.len()).map(|k| dot(&left[k % m], &images[k / m])).collect();
    let all = world.sum_all(&own);
    Mat::from_fn(m, right.len(), |i, j| all[i + m * j])
}

/// The first pairs of one, two and three nodal diameters of the annulus. Their g = n + γ, φ_sᵀGφ_c = 2g at 1 rad/s,
/// and the splits at 20 rad/s are those of an axisymmetric solution with Fourier series in the angle, converged:
/// 0.98363, 1.96576, 2.94582; ±3.131, ±6.257, ±9.377 Hz.
pub fn an_annulus_splits_its_pairs(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let axis = Axis::below(RADIUS);
    let speed = 20.0;
    let mut body = Elements::new(&petsc, annulus(world, 0.04, "inner"), StaticMethod::Direct).rotating(axis).unwrap();
    body.factorise().unwrap();
    let modes = body.modes(Extent::Count(14), &mut |_, _| {}).unwrap();
    let rotation = modes.rotation.as_ref().unwrap();
    let diameters = rotation.diameters();
    let found = waves(&modes.omega, rotation, &vec![speed; modes.omega.len()]).unwrap();
    for (n, g, split) in [(1.0, 0.98363, 3.131), (2.0, 1.96576, 6.257), (3.0, 2.94582, 9.377)] {
        let pair: Vec<usize> = (0..14).filter(|&k| (diameters[k] - n).abs() < 0.02).take(2).collect();
        let [c, s] = pair[..] else { panic!("no pair of {n} nodal diameters in {diameters:?}") };
        assert!((modes.omega[c] / modes.omega[s] - 1.0).abs() < 1e-6, "{:?}", modes.omega);
        let own = 0.5 * rotation.gyroscopic[(c, s)].abs();
        assert!((own / g - 1.0).abs() < 2e-3, "n = {n}: g = {own}, expected {g}");
        let rest = modes.omega[c] / (2.0 * PI);
        let shifts = [-1.0, 1.0].map(|sign| {
            let wave = found.iter().filter(|w| (w.diameters - sign * n).abs() < 0.05);
            let near = wave.min_by(|a, b| (a.frequency - rest).abs().total_cmp(&(b.frequency - rest).abs())).unwrap();
            near.frequency - rest
        });
        let half = 0.5 * (shifts[1] - shifts[0]);
        assert!((half / split - 1.0).abs() < 2e-3, "n = {n}: {shifts:?} Hz, expected ±{split}");
        // Both waves are raised by the prestress, by far less.
        let raised = 0.5 * (shifts[0] + shifts[1]);
        assert!(raised > 0.0 && raised < 0.01 * split, "n = {n}: {shifts:?} Hz");
    }
}

/// All pairs up to the second of two nodal diameters, g and the waves at 20 rad/s, are those of the section of the
/// annulus, where each order is by itself and exact in the angle.
pub fn further_pairs_are_those_of_their_orders(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let (axis, speed) = (Axis::below(RADIUS), 20.0);
    let mut body = Elements::new(&petsc, annulus(world, 0.04, "inner"), StaticMethod::Direct).rotating(axis).unwrap();
    body.factorise().unwrap();
    let modes = body.modes(Extent::Count(17), &mut |_, _| {}).unwrap();
    let rotation = modes.rotation.as_ref().unwrap();
    let diameters = rotation.diameters();
    let found = waves(&modes.omega, rotation, &vec![speed; modes.omega.len()]).unwrap();
    let ring = CylinderSection {
        inner_radius: 0.1,
        outer_radius: RADIUS,
        thickness: 0.1,
        crown_radius: None,
        contact_offset: 0.0,
    };
    let section = cylinder(&ring, Focus { size: 0.03, reach: 0.0, corner: 0.003, largest: 0.03 }).unwrap();
    let steel = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800.0 };
    let forms = Forms::new(section, steel, &["inner".to_owned()]).unwrap();
    let prestress = forms.centrifugal().unwrap();
    let mut pairs = Vec::new();
    for n in 1..=4usize {
        let own = of_order(&forms, n, 2.0 * PI * 2700.0).unwrap();
        let exact = blocks(&forms, &own, Some(&prestress));
        for (k, omega) in own.omega.iter().enumerate() {
            let (g, kappa) = (exact.coupling[(k, k)], exact.stiffness[(k, k)]);
            // The pair of elements at this frequency, of which their size leaves some percent.
            let near: Vec<usize> = (0..modes.omega.len())
                .filter(|&j| (modes.omega[j] / omega - 1.0).abs() < 0.03 && (diameters[j] - n as f64).abs() < 0.1)
                .collect();
            let [c, s] = near[..] else { panic!("n = {n}, {omega} rad/s: {near:?} of {:?}", modes.omega) };
            let seen = 0.5 * rotation.gyroscopic[(c, s)].abs();
            assert!((seen - g.abs()).abs() < 5e-3 * n as f64, "n = {n}, {omega} rad/s: g = {seen}, by its order {g}");
            let mean = (omega * omega + speed * speed * (kappa + g * g)).sqrt();
            let rest = 0.5 * (modes.omega[c] + modes.omega[s]);
            for sign in [-1.0, 1.0] {
                let wanted = (mean + sign * g * speed - omega) / (2.0 * PI);
                let shift = |f: f64| f - rest / (2.0 * PI);
                let nearest = found.iter().map(|w| shift(w.frequency)).min_by(|a, b| {
                    let apart = |x: &f64| (x - wanted).abs();
                    apart(a).total_cmp(&apart(b))
                });
                let off = (nearest.unwrap() - wanted).abs();
                assert!(off < 5e-3 * n as f64 * speed / (2.0 * PI), "n = {n}, {omega} rad/s: {off} Hz off {wanted}");
            }
            pairs.push((n, k));
        }
    }
    for further in [(1, 1), (1, 2), (2, 1), (4, 0)] {
        assert!(pairs.contains(&further), "{further:?} is not among {pairs:?}");
    }
}

/// On a mesh that is distorted and nothing like a body of revolution, all to rounding: rigid rotations a × r, b × r
/// across the axis have u_a·G u_b = (a × b)·ê times the polar moment of inertia, translations none; their K_c is the
/// mass of a × W. D′ of a rigid motion, a × W − ê × u, is one, so that the material does not feel it: K D′u = 0; and
/// D′ between them is what the program makes of G and of the mass.
pub fn rigid_motions_on_a_distorted_mesh(world: &World) {
    let skewed = |x: [f64; 3]| {
        let bend = (31.0 * x[0] + 17.0 * x[1] + 23.0 * x[2]).sin();
        std::array::from_fn(|c| x[c] + 0.012 * bend * [1.0, -0.7, 0.5][c])
    };
    let mut mesh = block([4, 3, 3], [0.2, 0.15, 0.12], skewed);
    // The surface as well.
    mesh.nodes.iter_mut().for_each(|p| *p = [p[0] + 0.2 * p[1] * p[2], p[1] - 0.1 * p[0], p[2] + 0.3 * p[0] * p[0]]);
    let (density, material) = (7800.0, ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800.0 });
    let body = FeBody::new(world, "block", world.is_root().then_some(&mesh), None, material, &[]).expect("a body");
    let axis = Axis::below(0.3);
    let cross = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
    };
    let place = |x: [f64; 3]| -> [f64; 3] { std::array::from_fn(|c| x[c] - axis.centre[c]) };
    let of = |f: &dyn Fn([f64; 3]) -> [f64; 3]| -> Vec<f64> {
        body.part.coords[..body.part.owned].iter().flat_map(|x| f(*x)).collect()
    };
    let unit = |k: usize| -> [f64; 3] { std::array::from_fn(|c| f64::from(u8::from(c == k % 3))) };
    let motion = |k: usize, x: [f64; 3]| if k < 3 { unit(k) } else { cross(unit(k), place(x)) };
    let carried = |k: usize, x: [f64; 3]| if k < 3 { [0.0; 3] } else { cross(unit(k), axis.velocity(x)) };
    let felt = |k: usize, x: [f64; 3]| -> [f64; 3] {
        let (d, t) = (carried(k, x), axis.turned(motion(k, x)));
        std::array::from_fn(|c| d[c] - t[c])
    };
    let rigid: Vec<Vec<f64>> = (0..6).map(|k| of(&|x| motion(k, x))).collect();
    let moved: Vec<Vec<f64>> = (0..6).map(|k| of(&|x| carried(k, x))).collect();
    let turned: Vec<Vec<f64>> = (0..6).map(|k| of(&|x| felt(k, x))).collect();
    let outward = vec![of(&|x| axis.outward(x))];
    let frame: Vec<Vec<f64>> = (0..6).map(|k| of(&|x| axis.turned(motion(k, x)))).collect();
    let assembly = Assembly::new(world, &body.part, &body.dofs).unwrap();
    let mass = &body.operators.mass;
    let polar = bilinear(world, mass, &outward, &outward)[(0, 0)];
    let g = bilinear(world, &assembly.assemble(&Gyroscopic { density, axis }), &rigid, &rigid);
    for i in 0..6 {
        for j in 0..6 {
            let sign: f64 = cross(unit(i), unit(j)).iter().zip(axis.direction).map(|(p, q)| p * q).sum();
            let across = i > 2 && j > 2 && [i, j].iter().all(|k| axis.direction[k % 3] == 0.0);
            if across || (i < 3 && j < 3) {
                let wanted = if across { sign * polar } else { 0.0 };
                assert!((g[(i, j)] - wanted).abs() < 1e-11 * g.norm_max(), "({i}, {j}): {}, {wanted}", g[(i, j)]);
            }
        }
    }
    let convected = bilinear(world, &assembly.assemble(&Convected { density, axis }), &rigid, &rigid);
    let wanted = bilinear(world, mass, &moved, &moved);
    assert!((&convected - &wanted).norm_max() < 1e-11 * wanted.norm_max(), "{convected:?} {wanted:?}");
    // D′ by G and the turning of the frame, and as it is.
    let (made, plain) = (bilinear(world, mass, &rigid, &frame), bilinear(world, mass, &rigid, &turned));
    let skew = |a: &Mat<f64>| faer::Scale(0.5) * (a - a.transpose());
    let made = faer::Scale(0.5) * &g - skew(&made);
    assert!((&made - skew(&plain)).norm_max() < 1e-11 * plain.norm_max(), "{made:?} {plain:?}");
    // K D′u, beside what a motion of that size that is none of the whole would make.
    let stiffness = &body.operators.stiffness;
    let operator = stiffness.operator(world);
    let largest = turned.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    for v in turned.iter().chain(&rigid) {
        let mut force = vec![0.0; v.len()];
        operator.apply(world, v, &mut force);
        let worst = world.max(force.iter().fold(0.0f64, |m, f| m.max(f.abs())));
        let scale = stiffness.norm_inf(world) * world.max(largest).max(1.0);
        assert!(worst < 1e-13 * scale, "{worst} of {scale}");
    }
}

/// The frequencies p of waves in the fixed frame, and p − nΩ of the same in the frame that turns with the wheel,
/// where the equations have Coriolis's term 2Ω ê× and the centrifugal one −Ω² instead, assembled here from mass and
/// modes alone.
pub fn fixed_and_turning_frame_agree(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let axis = Axis::below(RADIUS);
    let speed = 150.0;
    let mut body = Elements::new(&petsc, annulus(world, 0.04, "inner"), StaticMethod::Direct).rotating(axis).unwrap();
    body.factorise().unwrap();
    let modes = body.modes(Extent::Count(20), &mut |_, _| {}).unwrap();
    let rotation = modes.rotation.as_ref().unwrap();
    let phi = &body.shapes().unwrap().vectors;
    let (density, m) = (7800.0, phi.len());
    let assembly = Assembly::new(world, &body.fe.part, &body.fe.dofs).unwrap();
    let convected = bilinear(world, &assembly.assemble(&Convected { density, axis }), phi, phi);
    let prestress = &rotation.stiffness + &convected;
    let of = |f: &dyn Fn([f64; 3]) -> [f64; 3]| -> Vec<Vec<f64>> {
        phi.iter().map(|v| v.chunks_exact(3).flat_map(|p| f([p[0], p[1], p[2]])).collect()).collect()
    };
    let mass = &body.fe.operators.mass;
    let coriolis = bilinear(world, mass, phi, &of(&|p| axis.turned(p)));
    let across = bilinear(world, mass, phi, &of(&|p| [p[0], 0.0, p[2]]));
    let companion = Mat::from_fn(2 * m, 2 * m, |i, j| match (i < m, j < m) {
        (true, true) => 0.0,
        (true, false) => f64::from(u8::from(i + m == j)),
        (false, true) => {
            let (i, j) = (i - m, j);
            let own = if i == j { modes.omega[i] * modes.omega[i] } else { 0.0 };
            -(own + speed * speed * (prestress[(i, j)] - across[(i, j)]))
        }
        (false, false) => -2.0 * speed * coriolis[(i - m, j - m)],
    });
    let turning: Vec<f64> =
        companion.eigenvalues().unwrap().into_iter().map(|l| l.im / (2.0 * PI)).filter(|f| *f > 0.0).collect();
    // The last modes lack their neighbours beyond.
    let found = waves(&modes.omega, rotation, &vec![speed; modes.omega.len()]).unwrap();
    for wave in found.iter().take(12) {
        let n = wave.diameters.round();
        assert!((wave.diameters - n).abs() < 2e-3, "{wave:?}");
        let expected = wave.frequency - n * speed / (2.0 * PI);
        let near =
            turning.iter().copied().min_by(|a, b| (a - expected).abs().total_cmp(&(b - expected).abs())).unwrap();
        // Of the shift by nΩ, some 24 to 100 Hz, the mesh leaves a thousandth undecided.
        assert!(
            (near - expected).abs() < 2e-3 * speed / (2.0 * PI),
            "{wave:?}: {near} Hz in the turning frame, expected {expected}"
        );
    }
    // Without prestress and inertia of the frame the two would differ by what is tested here: several hertz.
    let raw = bilinear(world, &assembly.assemble(&Gyroscopic { density, axis }), phi, phi);
    assert!((&raw - &rotation.gyroscopic).norm_max() < 1e-9 * raw.norm_max());
    assert_eq!(ModalMatrix::from(rotation.stiffness.clone()).asymmetry(), 0.0);
}

/// Prestress of a free body balances its inertial forces: K_σ − K_c vanishes for rigid rotations, to the integrals of
/// x² and z² of the mesh.
pub fn prestress_of_a_free_wheel_balances_rigid_rotations(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let axis = Axis::below(RADIUS);
    let body = annulus(world, 0.06, "");
    assert!(!body.supported);
    let assembly = Assembly::new(world, &body.part, &body.dofs).unwrap();
    let load = assembly.load(|x| axis.outward(x).map(|r| 7800.0 * r));
    // K u = f with the factor of K − σM, until nothing is left.
    let mut statics = Statics::direct(&petsc, &body).unwrap();
    let stiffness = body.operators.stiffness.operator(world);
    let mut u = vec![0.0; load.len()];
    for _ in 0..12 {
        let mut rest = vec![0.0; load.len()];
        stiffness.apply(world, &u, &mut rest);
        rest.iter_mut().zip(&load).for_each(|(r, f)| *r = f - *r);
        statics.solve(&mut rest, 1).unwrap();
        u.iter_mut().zip(rest).for_each(|(u, r)| *u += r);
    }
    let displacement = body.at_nodes(world, &u);
    let prestress = PrestressStiffness { material: body.material, displacement: &displacement };
    let rigid: Vec<Vec<f64>> = (0..6)
        .map(|k| {
            let field = |x: [f64; 3]| -> [f64; 3] {
                let r: [f64; 3] = std::array::from_fn(|c| x[c] - axis.centre[c]);
                let e: [f64; 3] = std::array::from_fn(|c| f64::from(u8::from(c == k % 3)));
                match k < 3 {
                    true => e,
                    false => std::array::from_fn(|c| e[(c + 1) % 3] * r[(c + 2) % 3] - e[(c + 2) % 3] * r[(c + 1) % 3]),
                }
            };
            body.part.coords[..body.part.owned].iter().flat_map(|x| field(*x)).collect()
        })
        .collect();
    let by_stress = bilinear(world, &assembly.assemble(&prestress), &rigid, &rigid);
    let convected = bilinear(world, &assembly.assemble(&Convected { density: 7800.0, axis }), &rigid, &rigid);
    let scale = convected.norm_max();
    // Rotations about x and z: ∫ρx² and ∫ρz² differ by what the mesh is not round.
    for i in 0..6 {
        for j in 0..6 {
            let rest = by_stress[(i, j)] - convected[(i, j)];
            let most = if i == j && i > 2 { 2e-3 } else { 1e-9 };
            assert!(
                rest.abs() < most * scale,
                "({i}, {j}): {} and {} of {scale}",
                by_stress[(i, j)],
                convected[(i, j)]
            );
        }
    }
    // About the axle itself: ∫ρ(x² + z²) both.
    assert!((by_stress[(4, 4)] / convected[(4, 4)] - 1.0).abs() < 1e-9, "{} {}", by_stress[(4, 4)], convected[(4, 4)]);
}

/// A wheel that nothing holds: of its six motions as a whole only the precession of the axis oscillates, with Ω
/// I_p/I_t, and the pairs of its elastic modes split.
pub fn a_free_wheel_precesses(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let speed = 20.0;
    let free = Elements::new(&petsc, annulus(world, 0.05, ""), StaticMethod::Direct);
    let mut body = free.rotating(Axis::below(RADIUS)).unwrap();
    body.factorise().unwrap();
    let modes = body.modes(Extent::Count(10), &mut |_, _| {}).unwrap();
    assert_eq!(modes.omega[..6], [0.0; 6]);
    let rotation = modes.rotation.as_ref().unwrap();
    let found = waves(&modes.omega, rotation, &vec![speed; modes.omega.len()]).unwrap();
    assert_eq!(found.len(), modes.omega.len());
    assert!(found[..5].iter().all(|w| w.frequency == 0.0) && found[5].frequency > 0.0, "{found:?}");
    // 6 (R² + r²) / (3 (R² + r²) + h²) of a ring of height h.
    let square = RADIUS * RADIUS + 0.1 * 0.1;
    let ratio = 6.0 * square / (3.0 * square + 0.1 * 0.1);
    let precession = found[5].frequency * 2.0 * PI / speed;
    assert!((precession / ratio - 1.0).abs() < 5e-3, "{precession} of the speed, expected {ratio}");
    assert!((found[5].diameters.abs() - 1.0).abs() < 0.01, "{:?}", found[5]);
    // The material does not feel a motion of the whole, whatever its rotation makes of it: K D′u = 0, so D′u has no
    // part in elastic modes.
    for (i, j) in (6..modes.omega.len()).flat_map(|i| (0..6).map(move |j| (i, j))) {
        let felt = rotation.derivative[(i, j)];
        assert!(felt.abs() < 2e-3, "{felt} of motion {j} in mode {i}");
    }
    // The first elastic pair, of two nodal diameters: ω0 ± gΩ.
    let g = 0.5 * rotation.gyroscopic[(6, 7)].abs();
    let half = PI * (found[7].frequency - found[6].frequency) / speed;
    assert!(g > 1.0 && (half / g - 1.0).abs() < 1e-3, "{found:?}, g = {g}");
}

/// An axis beside the wheel's own, and a support on one side of it.
pub fn what_is_not_of_revolution_is_refused(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let refused = |fixed: &str, distance: f64, parts: &[&str]| {
        let body = Elements::new(&petsc, annulus(world, 0.05, fixed), StaticMethod::Direct);
        let error = body.rotating(Axis::below(distance)).err().expect("an error");
        assert_eq!(error.exit_code(), 2);
        assert!(parts.iter().all(|p| error.to_string().contains(p)), "{error}");
    };
    refused("inner", 0.4, &["bodies.wheel.rotation", "surface", "expected at most 0.05"]);
    for fixed in ["inner", "side_minus"] {
        let body = Elements::new(&petsc, annulus(world, 0.05, fixed), StaticMethod::Direct);
        assert!(body.rotating(Axis::below(RADIUS)).is_ok(), "{fixed}");
    }
    let mut sector = annulus(world, 0.05, "inner");
    // Half of the bore is let go of, as far as the test of the support sees.
    for (node, place) in sector.part.coords.iter().enumerate() {
        if place[0] > 0.0 && sector.dofs.local[node] == railsqueal::fem::dofs::FIXED {
            sector.dofs.local[node] = 0;
        }
    }
    let error =
        Elements::new(&petsc, sector, StaticMethod::Direct).rotating(Axis::below(RADIUS)).err().expect("an error");
    assert!(error.to_string().contains("support"), "{error}");
}
