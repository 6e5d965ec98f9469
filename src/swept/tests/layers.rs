//! Sections of several materials.

use super::*;

const RUBBER: Material = Material { young: 5e6, poisson: 0.45, density: 10.0 };
const LOSS: f64 = 0.15;

/// The annulus with a layer of `material` between the radii `from` and `to`, m, which lie on lines of its mesh.
fn layered(from: f64, to: f64, material: Material) -> Section {
    let breaks = [0.1, from, 0.5 * (from + to), to, 0.5];
    let focus = even(0.01, 0.02);
    let r = focus.lines(&breaks, &[0.5], &[]);
    let y = focus.lines(&[-0.05, 0.05], &[0.0], &[]);
    let lines = super::super::builtin::Lines { r: &r, y: &y };
    let mut section = lines.section(|_, _| true, |at| at, |_, _| true);
    section.layers.push(SectionLayer { name: "rubber".into(), material, loss: LOSS });
    for element in &mut section.elements {
        let middle = section.nodes[element.nodes[8]][0];
        element.layer = usize::from(from < middle && middle < to);
    }
    section
}

/// A tyre on a soft ring turns about the axle with ω² = k/I, k = 4πGw/(1/a² − 1/b²), and has the loss factor of the ring.
#[test]
fn a_tyre_on_rubber_turns_on_its_ring() {
    let (a, b) = (0.38, 0.40);
    let forms = clamped(layered(a, b, RUBBER), STEEL);
    let modes = of_order(&forms, 0, 2.0 * PI * 100.0).unwrap();
    let seen = Seen::of(&forms, &modes, None, None);
    let torsion = (0..seen.omega.len()).find(|&k| seen.shares[k][1] > 0.99).expect("torsion");
    let stiffness = 4.0 * PI * RUBBER.shear() * 0.1 / (1.0 / (a * a) - 1.0 / (b * b));
    let moment = |from: f64, to: f64| 0.5 * PI * 0.1 * (f64::powi(to, 4) - f64::powi(from, 4));
    let inertia = STEEL.density * moment(b, 0.5) + RUBBER.density * moment(a, b) / 3.0;
    let omega = seen.omega[torsion];
    assert!((omega / (stiffness / inertia).sqrt() - 1.0).abs() < 1e-3, "{omega} {}", (stiffness / inertia).sqrt());
    let loss = seen.lost[(torsion, torsion)] / (omega * omega);
    assert!((loss / LOSS - 1.0).abs() < 1e-3, "{loss}");
    assert!((seen.stored[torsion] * LOSS - seen.lost[(torsion, torsion)]).abs() < 1e-9 * omega * omega);
}

/// One material in two parts is one material; the parts share the strain energy.
#[test]
fn a_layer_of_the_same_material_changes_nothing() {
    let split = clamped(layered(0.3, 0.4, STEEL), STEEL);
    let mut plain = layered(0.3, 0.4, STEEL);
    plain.layers.clear();
    plain.elements.iter_mut().for_each(|e| e.layer = 0);
    let plain = clamped(plain, STEEL);
    for n in [0, 1, 3] {
        let [a, b] = [&split, &plain].map(|forms| of_order(forms, n, 2.0 * PI * 3000.0).unwrap());
        assert_eq!(a.omega.len(), b.omega.len());
        for (x, y) in a.omega.iter().zip(&b.omega) {
            assert!((x / y - 1.0).abs() < 1e-11, "{n}: {x} {y}");
        }
        let both = [0, 1].map(|layer| split.strain_energy(n, layer, a.vectors.as_ref()));
        for (k, w) in a.omega.iter().enumerate() {
            assert!(((both[0][(k, k)] + both[1][(k, k)]) / (w * w) - 1.0).abs() < 1e-8, "{n}");
        }
    }
    let [a, b] = [&split, &plain].map(|forms| forms.section.inertia(STEEL));
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} {b:?}");
    let mass = PI * (0.25 - 0.01) * 0.1 * STEEL.density;
    let polar = 0.5 * mass * (0.25 + 0.01);
    let wanted = [mass, 0.0, polar, 0.5 * polar + mass * 0.01 / 12.0];
    assert!(a.iter().zip(wanted).all(|(a, w)| (a - w).abs() < 1e-9 * mass), "{a:?} {wanted:?}");
}
