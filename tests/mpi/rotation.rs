//! A wheel that turns: frequencies of its waves against an axisymmetric solution, against the same in a frame that turns with it, and what is refused.

use faer::Mat;
use railsqueal::body::elements::{Elements, Method};
use railsqueal::body::fe::FeBody;
use railsqueal::body::modes::Extent;
use railsqueal::body::statics::Statics;
use railsqueal::body::{Body, ModalMatrix};
use railsqueal::fem::assembly::Assembly;
use railsqueal::fem::forms::{Convected, Gyroscopic, Prestress};
use railsqueal::fem::rotation::Axis;
use railsqueal::fem::Material;
use railsqueal::mesh::cylinder::{build, CylinderSpec, DEFAULT_GROWTH};
use railsqueal::model::waves;
use railsqueal::parallel::World;
use railsqueal::petsc::csr::DistCsr;
use railsqueal::petsc::Petsc;
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
    let material = Material { young: 205e9, poisson: 0.3, density: 7800.0 };
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

/// The first pairs of one, two and three nodal diameters of the annulus. Their g = n + γ, φ_sᵀGφ_c = 2g at 1 rad/s, and the splits at 20 rad/s are
/// those of an axisymmetric solution with Fourier series in the angle, converged: 0.98363, 1.96576, 2.94582; ±3.131, ±6.257, ±9.377 Hz.
pub fn an_annulus_splits_its_pairs(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let axis = Axis::below(RADIUS);
    let speed = 20.0;
    let mut body = Elements::new(&petsc, annulus(world, 0.04, "inner"), Method::Direct).rotating(axis).unwrap();
    body.factorise().unwrap();
    let modes = body.modes(Extent::Count(14), &mut |_, _| {}).unwrap();
    let rotation = modes.rotation.as_ref().unwrap();
    let diameters = rotation.diameters();
    let found = waves(&modes.omega, rotation, speed).unwrap();
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

/// The frequencies p of waves in the fixed frame, and p − nΩ of the same in the frame that turns with the wheel, where the equations have Coriolis's
/// term 2Ω ê× and the centrifugal one −Ω² instead, assembled here from mass and modes alone.
pub fn fixed_and_turning_frame_agree(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let axis = Axis::below(RADIUS);
    let speed = 150.0;
    let mut body = Elements::new(&petsc, annulus(world, 0.04, "inner"), Method::Direct).rotating(axis).unwrap();
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
    let found = waves(&modes.omega, rotation, speed).unwrap();
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

/// Of a free body the prestress balances what it swings with: K_σ − K_c vanishes for rigid rotations, to the integrals of x² and z² of the mesh.
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
    let prestress = Prestress { material: body.material, displacement: &displacement };
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

/// A wheel that nothing holds: of its six motions as a whole only the precession of the axis oscillates, with Ω I_p/I_t, and the pairs of its elastic modes split.
pub fn a_free_wheel_precesses(world: &World) {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let speed = 20.0;
    let free = Elements::new(&petsc, annulus(world, 0.05, ""), Method::Direct);
    let mut body = free.rotating(Axis::below(RADIUS)).unwrap();
    body.factorise().unwrap();
    let modes = body.modes(Extent::Count(10), &mut |_, _| {}).unwrap();
    assert_eq!(modes.omega[..6], [0.0; 6]);
    let rotation = modes.rotation.as_ref().unwrap();
    let found = waves(&modes.omega, rotation, speed).unwrap();
    assert_eq!(found.len(), modes.omega.len());
    assert!(found[..5].iter().all(|w| w.frequency == 0.0) && found[5].frequency > 0.0, "{found:?}");
    // 6 (R² + r²) / (3 (R² + r²) + h²) of a ring of height h.
    let square = RADIUS * RADIUS + 0.1 * 0.1;
    let ratio = 6.0 * square / (3.0 * square + 0.1 * 0.1);
    let precession = found[5].frequency * 2.0 * PI / speed;
    assert!((precession / ratio - 1.0).abs() < 5e-3, "{precession} of the speed, expected {ratio}");
    assert!((found[5].diameters.abs() - 1.0).abs() < 0.01, "{:?}", found[5]);
    // The material does not feel a motion of the whole, whatever its rotation makes of it: K D′u = 0, so D′u has no part in elastic modes.
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
        let body = Elements::new(&petsc, annulus(world, 0.05, fixed), Method::Direct);
        let error = body.rotating(Axis::below(distance)).err().expect("an error");
        assert_eq!(error.exit_code(), 2);
        assert!(parts.iter().all(|p| error.to_string().contains(p)), "{error}");
    };
    refused("inner", 0.4, &["bodies.wheel.rotation", "surface", "expected at most 0.05"]);
    for fixed in ["inner", "side_minus"] {
        let body = Elements::new(&petsc, annulus(world, 0.05, fixed), Method::Direct);
        assert!(body.rotating(Axis::below(RADIUS)).is_ok(), "{fixed}");
    }
    let mut sector = annulus(world, 0.05, "inner");
    // Half of the bore is let go of, as far as the test of the support sees.
    for (node, place) in sector.part.coords.iter().enumerate() {
        if place[0] > 0.0 && sector.dofs.local[node] == railsqueal::fem::dofs::FIXED {
            sector.dofs.local[node] = 0;
        }
    }
    let error = Elements::new(&petsc, sector, Method::Direct).rotating(Axis::below(RADIUS)).err().expect("an error");
    assert!(error.to_string().contains("support"), "{error}");
}
