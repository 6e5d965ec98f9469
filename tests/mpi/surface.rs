//! The surface of a distributed body as radiators.

use railsqueal::body::elements::{Elements, StaticMethod};
use railsqueal::body::fe::{BodyModes, FeBody};
use railsqueal::fem::ElasticMaterial;
use railsqueal::mesh::cylinder::{build, CylinderSpec, DEFAULT_GROWTH};
use railsqueal::parallel::World;
use railsqueal::petsc::Petsc;
use railsqueal::sound::surface::radiators;
use railsqueal::sound::Air;
use std::f64::consts::PI;

/// A ring that moves as a whole: its area, the square of its normal velocity, and the sound of each way of moving.
pub fn the_boundary_is_found_once(world: &World) {
    let (inner, outer, thickness) = (0.1, 0.5, 0.1);
    let spec = CylinderSpec {
        inner_radius: inner,
        outer_radius: outer,
        thickness,
        crown_radius: None,
        contact_offset: 0.0,
        element_size: 4e-3,
        growth: DEFAULT_GROWTH,
        max_element_size: Some(0.03),
        patch_half_length: 12e-3,
        patch_half_width: 12e-3,
    };
    let mesh = world.is_root().then(|| build(&spec).expect("a ring"));
    let material = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800. };
    let fe = FeBody::new(world, "ring", mesh.as_ref(), None, material, &[]).expect("a body");
    let petsc = Petsc::start(world, &[], &[]).expect("PETSc");
    let body = Elements::new(&petsc, fe, StaticMethod::Direct);
    // Motion along x, along the axis y, and outward, all of 1 m.
    let centre = [0.0, 0.0, -outer];
    let ways: [fn([f64; 3]) -> [f64; 3]; 3] = [
        |_| [1.0, 0.0, 0.0],
        |_| [0.0, 1.0, 0.0],
        |x| {
            let r = x[0].hypot(x[2]);
            [x[0] / r, 0.0, x[2] / r]
        },
    ];
    let vector = |way: fn([f64; 3]) -> [f64; 3]| -> Vec<f64> {
        let own = &body.fe.part.coords[..body.fe.part.owned];
        own.iter().flat_map(|p| way(std::array::from_fn(|c| p[c] - centre[c]))).collect()
    };
    let modes = BodyModes { omega: vec![1.0; 3], residual: vec![0.0; 3], vectors: ways.map(vector).to_vec() };
    let found = radiators(world, &body, &modes, 0.03);
    let side = PI * (outer * outer - inner * inner);
    let (tread, bore) = (2.0 * PI * outer * thickness, 2.0 * PI * inner * thickness);
    let near = |what: &str, value: f64, wanted: f64| {
        assert!((value / wanted - 1.0).abs() < 0.01, "{what}: {value}, closed form {wanted}");
    };
    near("area", found.area(), 2.0 * side + tread + bore);
    let square = found.square();
    near("square of the motion along x", square[(0, 0)], 0.5 * (tread + bore));
    near("square of the motion along y", square[(1, 1)], 2.0 * side);
    near("square of the breathing motion", square[(2, 2)], tread + bore);
    assert!(square[(0, 1)].abs() < 1e-3 && square[(0, 2)].abs() < 1e-3, "{square:?}");
    // At low frequency only the flow through each part counts: ρc k²/(2π) ΣS², and nothing net along x.
    let air = Air { density: 1.2, speed: 343.0 };
    let f = 1.0;
    let r = found.resistance(f, air);
    let unit = air.density * air.speed * air.wave_number(f).powi(2) / (2.0 * PI);
    near("sound of the motion along y", r[(1, 1)], unit * 2.0 * side * side);
    near("sound of the breathing motion", r[(2, 2)], unit * (tread * tread + bore * bore));
    assert!(r[(0, 0)].abs() < 1e-3 * r[(2, 2)], "along x: {}", r[(0, 0)]);
}
