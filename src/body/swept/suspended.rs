//! Modes of a wheelset on a primary suspension that is not equally stiff along x and z.
//!
//! With p_j the mean displacements of the modes at the bearing j, K_1 of either family has the mean of both
//! stiffnesses, and the modal stiffness of the first family is diag(ω²) + Σ ½(k_z − k_x)_j p_jp_jᵀ, that of the second
//! one diag(ω²) − the same. Its eigenvectors combine the modes of the order into those of the body.

use super::Member;
use crate::body::rotation::ModalRotation;
use crate::dense::symmetric_eigen;
use crate::swept::Forms;
use crate::{Error, Result};
use faer::Mat;

/// Modes of the body from those with the mean stiffness of the bearings.
pub(super) struct RecombinedModes {
    /// Places in the list of the modes that those of the body come from, `[m]`.
    pub order: Vec<usize>,
    /// Angular frequencies, rad/s, ascending.
    pub omega: Vec<f64>,
    /// Components of the modes along those of the list, `[m, m]`.
    pub components: Mat<f64>,
}

/// The modes of `list` on the bearings of `forms`; none where these are as stiff along x as along z.
pub(super) fn recombined(forms: &Forms, list: &[Member]) -> Result<Option<RecombinedModes>> {
    let half: Vec<f64> = forms.bearings().map(|b| 0.5 * (b.stiffness[2] - b.stiffness[0])).collect();
    if half.iter().all(|k| *k == 0.0) {
        return Ok(None);
    }
    let m = list.len();
    let mut omega: Vec<f64> = list.iter().map(Member::omega).collect();
    let mut components = Mat::<f64>::identity(m, m);
    for (family, sign) in [(0, 1.0), (1, -1.0)] {
        let mine: Vec<usize> = (0..m).filter(|&k| list[k].of.order == 1 && list[k].family == family).collect();
        let at = |j: usize, k: usize| list[mine[k]].of.bearings[(j, list[mine[k]].index)];
        let stiffness = Mat::from_fn(mine.len(), mine.len(), |a, b| {
            let own = if a == b { omega[mine[a]] * omega[mine[a]] } else { 0.0 };
            own + half.iter().enumerate().map(|(j, k)| sign * k * at(j, a) * at(j, b)).sum::<f64>()
        });
        let failed = || Error::NotConverged("modes of order 1 on the suspension were not found".into());
        let (squares, vectors) = symmetric_eigen(stiffness.as_ref()).ok_or_else(failed)?;
        for (b, &to) in mine.iter().enumerate() {
            omega[to] = squares[b].max(0.0).sqrt();
            mine.iter().enumerate().for_each(|(a, &from)| components[(from, to)] = vectors[(a, b)]);
        }
    }
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by(|&a, &b| omega[a].total_cmp(&omega[b]));
    let components = Mat::from_fn(m, m, |i, k| components[(i, order[k])]);
    Ok(Some(RecombinedModes { omega: order.iter().map(|&k| omega[k]).collect(), order, components }))
}

/// Energies Σ k p² of the modes of the body in the springs of the bearings, 1/s², `[m]`: `list` has the modes with the
/// mean stiffness, `found` what becomes of them. Empty without bearings.
pub(super) fn energies(forms: &Forms, list: &[Member], found: Option<&RecombinedModes>) -> Vec<f64> {
    let bearings: Vec<[f64; 3]> = forms.bearings().map(|b| b.stiffness).collect();
    if bearings.is_empty() {
        return Vec::new();
    }
    let own = Mat::from_fn(bearings.len(), list.len(), |j, k| list[k].of.bearings[(j, list[k].index)]);
    let energy = |k: usize| {
        let place = found.map_or(k, |found| found.order[k]);
        let Member { of, family, .. } = list[place];
        let moved = |j: usize| match found {
            Some(found) if of.order == 1 => {
                (0..list.len()).map(|i| own[(j, i)] * found.components[(i, k)]).sum::<f64>()
            }
            _ => own[(j, place)],
        };
        let along = match (of.order, family) {
            (0, _) => 1,
            (1, 0) => 2,
            _ => 0,
        };
        bearings.iter().enumerate().map(|(j, stiffness)| stiffness[along] * moved(j).powi(2)).sum()
    };
    (0..list.len()).map(energy).collect()
}

impl RecombinedModes {
    /// ZᵀAZ of a matrix between the modes.
    pub fn between(&self, a: &Mat<f64>) -> Mat<f64> {
        self.components.transpose() * a * &self.components
    }

    /// The terms of rotation between the modes.
    pub fn rotation(&self, of: &ModalRotation) -> ModalRotation {
        ModalRotation {
            gyroscopic: self.between(&of.gyroscopic),
            stiffness: self.between(&of.stiffness),
            derivative: self.between(&of.derivative),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::members;
    use super::*;
    use crate::fem::ElasticMaterial;
    use crate::swept::modes::of_order;
    use crate::swept::{Bearing, ContactModeData, SectionSource, Wheel, WheelShape};
    use std::f64::consts::PI;

    /// On soft springs with k_x ≠ k_z a wheelset heaves with √(2k_z/m), moves along the track with √(2k_x/m), rolls
    /// with √(2k_z b²/I) and yaws with √(2k_x b²/I), b = 1 m; the first family is the vertical one.
    #[test]
    fn springs_that_differ_split_the_families() {
        let steel = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };
        let shape = WheelShape::w920s_wheelset();
        let given = SectionSource::Wheel(Wheel { shape, offset: 0.0, height: None, mirrored: true });
        let section = given.for_modes().unwrap();
        let [mass, _, _, diametral] = section.inertia(steel);
        let (along, vertical) = (9e3, 4e3);
        let at = |y: f64| Bearing { place: [0.0, y], stiffness: [along, 5e3, vertical] };
        let bearings = given.bearings(&section, &[at(-1.0), at(1.0)]).unwrap();
        let forms = Forms::new(section, steel, &[]).unwrap().on_bearings(&bearings);
        let modes = of_order(&forms, 1, 2.0 * PI * 1500.0).unwrap();
        let all = [ContactModeData::new(&forms, &modes, &[], None)];
        let list = members(&all);
        let found = recombined(&forms, &list).unwrap().unwrap();
        let mut wanted = [(vertical, mass, 0), (along, mass, 1), (vertical, diametral, 0), (along, diametral, 1)]
            .map(|(k, inertia, family): (f64, f64, usize)| ((2.0 * k / inertia).sqrt(), family));
        wanted.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (k, (omega, family)) in wanted.into_iter().enumerate() {
            assert!((found.omega[k] / omega - 1.0).abs() < 1e-3, "{:?} {wanted:?}", &found.omega[..4]);
            assert_eq!(list[found.order[k]].family, family);
        }
        assert!(
            (found.between(&Mat::identity(list.len(), list.len())) - Mat::<f64>::identity(list.len(), list.len()))
                .norm_max()
                < 1e-12
        );
        // All of a rigid motion is in the springs, and next to nothing of the last mode.
        let last = list.len() - 1;
        let stored = energies(&forms, &list, Some(&found));
        for k in 0..4 {
            assert!((stored[k] / found.omega[k].powi(2) - 1.0).abs() < 1e-3, "{stored:?}");
        }
        assert!(stored[last] < 1e-4 * found.omega[last].powi(2));
        // Elastic modes hardly move with springs so soft.
        assert!((found.omega[last] / list[last].omega() - 1.0).abs() < 1e-5);
        let even = at(0.0);
        let same = [Bearing { stiffness: [5e3; 3], ..even }, Bearing { stiffness: [5e3; 3], place: [0.0, 1.0] }];
        let same = given.bearings(&forms.section, &same).unwrap();
        assert!(recombined(&forms.clone().on_bearings(&same), &list).unwrap().is_none());
    }
}
