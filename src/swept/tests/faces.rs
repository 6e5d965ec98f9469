//! Loads on the faces of a disc.

use super::super::modes::contact_functions;
use super::*;

const SIDES: [&str; 2] = ["side_minus", "side_plus"];

/// A brake disc of steel, held at its bore.
fn disc() -> SectionSource {
    SectionSource::Cylinder(CylinderSection {
        inner_radius: 0.05,
        outer_radius: 0.15,
        thickness: 0.02,
        crown_radius: None,
        contact_offset: 0.0,
    })
}

const PATCH: LoadPatch = LoadPatch::Rectangle { half: [0.012, 0.01], middle: 0.0 };

/// Forms of the disc for loads on its faces, and a contact on a face at a radius, m, and an angle, rad.
fn faced() -> (Forms, impl Fn(usize, f64, f64) -> SectionContact) {
    let section = disc().for_loads_on_faces(&[([0.12, -0.01], 0.01), ([0.12, 0.01], 0.01)]).unwrap();
    let section = section.with_faces(SIDES).unwrap();
    let faces = SIDES.map(|side| SectionFace::new(&section, side).unwrap());
    (clamped(section, STEEL), move |side, radius, angle| faces[side].contact(radius, angle))
}

/// Means of a motion of the family `family` of the order `n` with the amplitudes U, V, W of all nodes over the cell of
/// a contact: (x, y, n).
fn means(forms: &Forms, at: &SectionContact, (n, family): (usize, usize), amplitudes: [f64; 3]) -> [f64; 3] {
    let column = Mat::from_fn(forms.order(), 1, |i, _| amplitudes[i % 3]);
    let line = LineLoad::for_contact(forms, PATCH, n, at);
    let (shares, means) = (line.shares(family), line.means(column.col(0)));
    [0, 1, 2].map(|c| shares[c] * means[c])
}

/// Translations have the components of the frames x = e_θ, y = ∓e_r and n = ∓e_y, on either face.
#[test]
fn translations_have_the_components_of_the_frame_of_a_face() {
    let (forms, contact) = faced();
    for (side, e) in [(0, -1.0), (1, 1.0)] {
        for angle in [0.0, 0.4, -1.3] {
            let at = contact(side, 0.12, angle);
            let (s, c) = f64::sin_cos(angle);
            let motions = [
                (means(&forms, &at, (0, 0), [0.0, 0.0, 1.0]), [0.0, 0.0, -e]),
                // Along e_r and e_θ of the angle 0.
                (means(&forms, &at, (1, 0), [1.0, -1.0, 0.0]), [-s, -e * c, 0.0]),
                (means(&forms, &at, (1, 1), [1.0, -1.0, 0.0]), [c, -e * s, 0.0]),
            ];
            for (k, (found, wanted)) in motions.iter().enumerate() {
                let apart = found.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(apart < 1e-12, "side {side}, angle {angle}, motion {k}: {found:?}, expected {wanted:?}");
            }
        }
    }
}

/// A, to which the half-space is added within a cell, is the sum over all orders one by one; cells on both faces of a
/// disc that is its own mirror image yield alike.
#[test]
fn the_compliance_of_cells_is_the_sum_over_the_orders() {
    let (forms, contact) = faced();
    let contacts = [contact(0, 0.12, 0.0), contact(1, 0.12, 0.0), contact(1, 0.12, 0.25)];
    let constant = Constant::of_contacts(&forms, &[vec![PATCH; 3]], &contacts).unwrap();
    let all = whole_of(&constant).swap_remove(0);
    let known = crate::body::half_space::HalfSpace { young: STEEL.young, poisson: STEEL.poisson }.under_loads(PATCH);
    let at = |c: usize, d: usize, i: usize, j: usize| {
        all[(LOADS * c + i, LOADS * d + j)] + if c == d { known[i][j] } else { 0.0 }
    };
    // The terms fall with n⁻³ from order 12 on, whose waves are as long as the cell is: those left out are few.
    let last = 400;
    let mut sum = Mat::<f64>::zeros(9, 9);
    for n in 0..=last {
        let factor = forms.factor(n, 0.0).unwrap().positive("a disc").unwrap();
        let lines: Vec<LineLoad> = contacts.iter().map(|at| LineLoad::for_contact(&forms, PATCH, n, at)).collect();
        for (d, line) in lines.iter().enumerate() {
            let moved = factor.solve(line.columns(forms.order()).as_ref());
            for j in 0..3 {
                for (c, other) in lines.iter().enumerate() {
                    let found = other.means(moved.col(j));
                    for family in 0..ContactModeData::families(n) {
                        for i in 0..3 {
                            let share = other.shares(family)[i] * line.shares(family)[j];
                            sum[(3 * c + i, 3 * d + j)] += share * found[i];
                        }
                    }
                }
            }
        }
    }
    for c in 0..3 {
        for d in 0..3 {
            let scale = at(c, c, 2, 2);
            for i in 0..3 {
                for j in 0..3 {
                    let (found, wanted) = (at(c, d, i, j), sum[(3 * c + i, 3 * d + j)]);
                    let apart = (found - wanted).abs() / scale;
                    assert!(apart < 5e-3, "{c} {d}, {i} {j}: {found:e}, sum of the orders {wanted:e}");
                }
            }
        }
    }
    for i in 0..3 {
        let apart = (at(0, 0, i, i) / at(1, 1, i, i) - 1.0).abs();
        assert!(apart < 1e-9, "{i}: {apart:e}");
        assert!((at(1, 1, i, i) / at(2, 2, i, i) - 1.0).abs() < 1e-12);
    }
}

/// The derivative along the angle of the rows of a mode is that of the rows farther round: (U cos nθ, V sin nθ, W cos
/// nθ) becomes −n times the other family, which becomes n times this one.
#[test]
fn the_derivative_along_the_angle_is_that_of_rows_farther_round() {
    let (forms, contact) = faced();
    let step = 1e-5;
    for n in [1, 2, 5] {
        let modes = of_order(&forms, n, 2.0 * PI * 12e3).unwrap();
        assert!(!modes.omega.is_empty());
        let rows = |family: usize, angle: f64| {
            let lines = [0, 1].map(|side| LineLoad::for_contact(&forms, PATCH, n, &contact(side, 0.12, angle)));
            let seen = contact_functions(modes.vectors.as_ref(), &lines);
            Mat::from_fn(6, modes.omega.len(), |i, k| {
                lines[i / 3].shares(family)[i % 3] * seen[(LOADS * (i / 3) + i % 3, k)]
            })
        };
        for (family, factor) in [(0, -(n as f64)), (1, n as f64)] {
            let wanted = faer::Scale(0.5 / step) * (rows(family, 0.7 + step) - rows(family, 0.7 - step));
            let found = faer::Scale(factor) * rows(1 - family, 0.7);
            let apart = (&found - &wanted).norm_max() / wanted.norm_max();
            assert!(apart < 1e-7, "order {n}, family {family}: {apart:e}");
        }
    }
}

/// Faces are refused by what they are.
#[test]
fn what_is_no_face_is_refused() {
    let section = disc().for_modes().unwrap();
    for (group, text) in [("outer", "expected a flat face"), ("back", "one of \"inner\", \"outer\"")] {
        let error = SectionFace::new(&section, group).unwrap_err();
        assert!(error.message().contains(text), "{error}");
    }
    let face = SectionFace::new(&section, "side_plus").unwrap();
    assert!(face.looks_to_plus() && !SectionFace::new(&section, "side_minus").unwrap().looks_to_plus());
    assert!(face.radii().iter().zip([0.05, 0.15]).all(|(a, b)| (a - b).abs() < 1e-12));
    let (forms, contact) = faced();
    let error = Constant::of_contacts(&forms, &[vec![PATCH]], &[contact(1, 0.145, 0.0)]).unwrap_err();
    assert!(error.message().contains("make the patch smaller"), "{error}");
}
