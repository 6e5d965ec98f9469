use super::*;
use crate::fem::ElasticMaterial;
use crate::sound::revolved::{square, Exterior};
use crate::sound::Air;
use crate::swept::modes::of_order;
use crate::swept::{Forms, SectionSource, Wheel};
use std::f64::consts::PI;

const AIR: Air = Air { density: 1.2, speed: 343.0 };
const STEEL: ElasticMaterial = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };

fn wheel() -> (Forms, Outline) {
    let section = SectionSource::Wheel(Wheel::w920s(0.0)).for_modes().expect("section");
    let outline = section.outline(&section.groups["inner"]).expect("outline");
    (Forms::new(section, STEEL, &["inner".into()]).expect("forms"), outline)
}

fn motion(forms: &Forms, outline: &Outline, vectors: MatRef<'_, f64>) -> Mat<f64> {
    Mat::from_fn(2 * outline.nodes.len(), vectors.ncols(), |i, j| {
        forms.amplitude(outline.nodes[i / 2]).map_or(0.0, |first| vectors[(first + 2 * (i % 2), j)])
    })
}

/// With panels of half a wave length the power of the wheel's modes is within 0.02 dB of that of panels a third as
/// long.
#[test]
fn the_modes_of_a_wheel_radiate_alike_from_coarse_and_fine_panels() {
    let (forms, outline) = wheel();
    for n in [0, 2, 3, 4] {
        let modes = of_order(&forms, n, 2.0 * PI * 3100.0).expect("modes");
        let u = motion(&forms, &outline, modes.vectors.as_ref());
        for (k, omega) in modes.omega.iter().enumerate() {
            let (f, one) = (omega / (2.0 * PI), u.as_ref().subcols(k, 1));
            let of = |size: f64| {
                let meshed = PanelMesh::new(&outline, size);
                let exterior = Exterior::new(&meshed.surface, AIR, f, n);
                let field = exterior.field(n, meshed.normal(one)).expect("field");
                let plane = AIR.density * AIR.speed * square(&meshed.surface, n, &meshed.normal(one))[(0, 0)];
                [exterior.resistance(&field)[(0, 0)], plane]
            };
            let [coarse, fine] = [0.5, 0.17].map(|part| of((part * AIR.speed / f).min(0.12 * 0.49 * part / 0.5)));
            // Torsion moves nothing but the air's shear.
            if fine[1] < 1e-3 {
                continue;
            }
            for (a, b) in coarse.iter().zip(fine) {
                let apart = 10.0 * (a / b).log10();
                assert!(apart.abs() < 0.02, "n = {n}, {f:.1} Hz: {apart:.4} dB");
            }
        }
    }
}
