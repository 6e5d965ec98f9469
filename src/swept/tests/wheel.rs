//! Wheels by a few numbers.

use super::*;
use std::rc::Rc;

const STEEL_OF_WHEELS: Material = Material { young: 210e9, poisson: 0.3, density: 7860.0 };

fn curved() -> WheelShape {
    WheelShape { web: [0.022, -0.005, 0.030], hub: [-0.060, 0.110], bore_group: "bore", ..WheelShape::w920s() }
}

/// A drawing of the curved wheel in triangles, finer than the program's mesh.
fn drawing() -> Drawn {
    let wheel = Wheel { shape: curved(), ..Wheel::w920s(0.0) };
    let section = wheel.section(even(0.002, 0.015)).unwrap();
    let faces: Vec<Vec<usize>> = section
        .elements
        .iter()
        .flat_map(|e| [[0, 1, 2, 4, 5, 8], [0, 2, 3, 8, 6, 7]].map(|t| t.map(|k| e.nodes[k]).to_vec()))
        .collect();
    let tread = section.tread.iter().filter(|e| section.nodes[e[0]][1] < section.nodes[e[1]][1]);
    let running: Vec<Vec<usize>> = tread.map(|e| e.to_vec()).collect();
    let bore: Vec<Vec<usize>> = section.edges("bore").into_iter().map(|e| e.to_vec()).collect();
    let curves = [("running".to_owned(), running), ("bore".to_owned(), bore)].into();
    Drawn::new(Path::Axle, section.nodes, &faces, &curves, "running").unwrap()
}

/// All modes to 3 kHz of the wheel by numbers are those of the same wheel drawn.
#[test]
fn a_wheel_by_numbers_is_the_same_wheel_drawn() {
    let numbers = Given::Wheel(Wheel { shape: curved(), ..Wheel::w920s(0.0) }).for_modes().unwrap();
    let drawn = Given::Drawn { drawn: Rc::new(drawing()), offset: 0.0, mirrored: false }.for_modes().unwrap();
    let [a, b] = [&numbers, &drawn].map(|s| s.inertia(STEEL_OF_WHEELS));
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3 * b.abs().max(1e-2)), "{a:?} {b:?}");
    let found = [numbers, drawn].map(|section| {
        let forms = Forms::new(section, STEEL_OF_WHEELS, &["bore".to_owned()]).unwrap();
        spectrum(&up_to(&forms, 3000.0))
    });
    assert!(found[0].len() == found[1].len() && found[0].len() > 30, "{} {}", found[0].len(), found[1].len());
    for (a, b) in found[0].iter().zip(&found[1]) {
        assert!(a.1 == b.1 && (a.0 / b.0 - 1.0).abs() < 1e-3, "{a:?} {b:?}");
    }
}
