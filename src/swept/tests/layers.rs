//! Sections of several materials.

use super::*;

const RUBBER: ElasticMaterial = ElasticMaterial { young: 5e6, poisson: 0.45, density: 10.0 };
const LOSS: f64 = 0.15;

/// The annulus with a layer of `material` between the radii `from` and `to`, m, which lie on lines of its mesh.
fn layered(from: f64, to: f64, material: ElasticMaterial) -> CrossSection {
    let breaks = [0.1, from, 0.5 * (from + to), to, 0.5];
    let focus = even(0.01, 0.02);
    let r = focus.lines(&breaks, &[0.5], &[]);
    let y = focus.lines(&[-0.05, 0.05], &[0.0], &[]);
    let lines = super::super::builtin::SectionLines { r: &r, y: &y };
    let mut section = lines.section(|_, _| true, |at| at, |radius, _| radius == 0.5);
    section.layers.push(SectionLayer { name: "rubber".into(), material, loss: LOSS });
    for element in &mut section.elements {
        let middle = section.nodes[element.nodes[8]][0];
        element.layer = usize::from(from < middle && middle < to);
    }
    section
}

/// A tyre on a soft ring turns about the axle with ω² = k/I. Rings between the radii a and b have the torsional
/// stiffness 4πGw/(1/a² − 1/b²); that of the rubber and that of the centre are in series, and the rubber has its share
/// of the energy.
#[test]
fn a_tyre_on_rubber_turns_on_its_ring() {
    let (a, b) = (0.38, 0.40);
    let forms = clamped(layered(a, b, RUBBER), STEEL);
    let modes = of_order(&forms, 0, 2.0 * PI * 100.0).unwrap();
    let seen = ContactModeData::new(&forms, &modes, &[], None);
    let torsion = (0..seen.omega.len()).find(|&k| seen.shares[k][1] > 0.99).expect("torsion");
    let ring = |a: f64, b: f64, of: ElasticMaterial| 4.0 * PI * of.shear() * 0.1 / (1.0 / (a * a) - 1.0 / (b * b));
    let (rubber, centre) = (ring(a, b, RUBBER), ring(0.1, a, STEEL));
    let stiffness = 1.0 / (1.0 / rubber + 1.0 / centre);
    let moment = |from: f64, to: f64| 0.5 * PI * 0.1 * (f64::powi(to, 4) - f64::powi(from, 4));
    let inertia = STEEL.density * moment(b, 0.5) + RUBBER.density * moment(a, b) / 3.0;
    let omega = seen.omega[torsion];
    assert!((omega / (stiffness / inertia).sqrt() - 1.0).abs() < 1e-4, "{omega} {}", (stiffness / inertia).sqrt());
    let loss = seen.lost[(torsion, torsion)] / (omega * omega);
    assert!((loss / (LOSS * stiffness / rubber) - 1.0).abs() < 1e-4, "{loss}");
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

/// A section that is a layer in all its elements has frequencies, rotation terms and strain energies of the layer's
/// material, whatever that of the body.
#[test]
fn a_section_all_of_one_layer_is_of_its_material() {
    let mut whole = layered(0.3, 0.4, STEEL);
    whole.elements.iter_mut().for_each(|e| e.layer = 1);
    let mut plain = whole.clone();
    plain.layers.clear();
    plain.elements.iter_mut().for_each(|e| e.layer = 0);
    let bronze = ElasticMaterial { young: 100e9, poisson: 0.35, density: 8800.0 };
    let forms = [clamped(whole, bronze), clamped(plain, STEEL)];
    for n in [0, 2] {
        let [a, b] = [&forms[0], &forms[1]].map(|forms| {
            let modes = of_order(forms, n, 2.0 * PI * 2000.0).unwrap();
            ContactModeData::new(forms, &modes, &[], Some(&forms.centrifugal().unwrap()))
        });
        assert!(a.omega.len() == b.omega.len() && !a.omega.is_empty());
        for k in 0..a.omega.len() {
            let w = b.omega[k];
            assert!((a.omega[k] / w - 1.0).abs() < 1e-9, "{n}: {} {w}", a.omega[k]);
            let [x, y] = [&a, &b].map(|seen| seen.rotation.stiffness[(k, k)]);
            assert!(y.abs() > 1e-3 && (x / y - 1.0).abs() < 1e-5, "{n}: {x} {y}");
            assert!((a.stored[k] / (w * w) - 1.0).abs() < 1e-7 && b.stored[k] == 0.0);
            assert!((a.lost[(k, k)] / (LOSS * w * w) - 1.0).abs() < 1e-7 && b.lost[(k, k)] == 0.0);
        }
    }
}
