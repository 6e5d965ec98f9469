//! Slip beside a body that turns under the other one, which does not.
//!
//! The lower body carries its deformation past the contact with the rates C ([`crate::model::CoupledModel::carried`]).
//! Over a step h the particles that meet slide by h (c + C q) + w(t + h) − w(t) on each other, with the rigid creep c.
//! C q is taken in the middle of the step, at q(t) + ½ h v(t), with an error of the order h². Nothing of it depends on
//! the reactions of the step, so that W stays symmetric.

use super::Stepper;
use crate::{Error, Result};
use faer::{Mat, Scale};

impl Stepper<'_> {
    /// C q in the middle of the next step, m/s, `[3n]`; empty where the material of both bodies passes alike.
    pub(super) fn carried_rates(&self) -> Vec<f64> {
        let Some(rates) = self.model.carried else { return Vec::new() };
        let half = 0.5 * self.settings.scheme.step;
        let middle = Mat::from_fn(rates.ncols(), 1, |k, _| self.state.q[k] + half * self.state.v[k]);
        (rates * middle).col_as_slice(0).to_vec()
    }

    /// Velocity, m/s, at which the particles that meet at core node `a` slide on each other beside the change of their
    /// displacements, by the creep (m/s) and spin (rad/s) of their contact and the rates `carried`, m/s, `[3n]`.
    pub(super) fn slide_rate(&self, a: usize, (creep, spin): ([f64; 2], f64), carried: &[f64]) -> [f64; 2] {
        let (([x, y], own), i) = (self.working.at[a], self.working.nodes[a]);
        let carried = |c: usize| carried.get(3 * i + c).copied().unwrap_or(0.0);
        [creep[0] - spin * y + own[0] + carried(0), creep[1] + spin * x + own[1] + carried(1)]
    }

    /// Changes of h C q of a step, m, at the `rows` of the interface, none along the normal, `[rows, c]`, by those of
    /// the modal displacements and velocities before it, `[m, c]`; none where the material of both bodies passes alike.
    pub(super) fn changed_carried(&self, [q, v]: &[Mat<f64>; 2], rows: &[usize]) -> Result<Option<Mat<f64>>> {
        let Some(rates) = self.model.carried else { return Ok(None) };
        if q.nrows() != rates.ncols() {
            return Err(Error::Defect(
                "a linearised step of a body that turns under another one, without modes".into(),
            ));
        }
        let h = self.settings.scheme.step;
        let slides = |row: usize| if row % 3 < 2 { h } else { 0.0 };
        let own = Mat::from_fn(rows.len(), rates.ncols(), |i, k| slides(rows[i]) * rates[(rows[i], k)]);
        Ok(Some(own * (q + Scale(0.5 * h) * v)))
    }
}

#[cfg(test)]
mod tests {
    use crate::contact::{ContactCreepage, NormalLoad};
    use crate::friction::FrictionLaw;
    use crate::grid::{Interface, TurningPoints};
    use crate::model::ModalMatrix;
    use crate::transient::stepper::StateChanges;
    use crate::transient::{ContactSolver, Loading, Model, Scheme, Settings, State, Stepper};
    use faer::Mat;
    use num_complex::Complex64;

    /// Angular frequencies of the motions along x and y, rad/s.
    const OMEGA: [f64; 2] = [3000.0, 4100.0];
    /// Rate at which the motion along x slides along y, 1/s.
    const CARRIED: f64 = 400.0;
    /// Rigid creep along x, m/s, coefficient of friction, normal force, N, and compliance along it, m/N.
    const CREEP: f64 = 2.0;
    const MU: f64 = 0.4;
    const LOAD: f64 = 1000.0;
    const SOFT: f64 = 1e-8;

    /// Two motions of 1 kg along x and y at one point, which slides along x.
    struct Pad {
        interface: Interface,
        residual: Mat<f64>,
        modes: Mat<f64>,
        rates: Mat<f64>,
    }

    impl Pad {
        fn new() -> Self {
            let points = TurningPoints { area: vec![1.0], creep: vec![[CREEP, 0.0]], axle: vec![1.0] };
            Self {
                interface: Interface::turning(points).unwrap(),
                residual: Mat::from_fn(3, 3, |i, j| if i == 2 && j == 2 { SOFT } else { 0.0 }),
                modes: Mat::from_fn(3, 2, |i, k| f64::from(u8::from(i == k))),
                rates: Mat::from_fn(3, 2, |i, k| if (i, k) == (1, 0) { CARRIED } else { 0.0 }),
            }
        }

        /// The steps of `h` from the displacements `q` and velocities `v` beside rest, with the traction `across`, N.
        fn stepper(&self, h: f64, [q, v]: [[f64; 2]; 2], across: f64) -> Stepper<'_> {
            let model = Model {
                interface: &self.interface,
                residual: self.residual.as_ref(),
                modes: self.modes.as_ref(),
                omega: &OMEGA,
                stiffness: ModalMatrix::squares(&OMEGA),
                damping: vec![0.0; 2].into(),
                turning: None,
                carried: Some(self.rates.as_ref()),
                // What holds the motions against friction at rest.
                load: &[MU * LOAD, 0.0],
            };
            let settings = Settings {
                scheme: Scheme { step: h, theta: 0.5 },
                friction: FrictionLaw::Constant(MU).into(),
                solver: ContactSolver::Newton,
                tolerance: 1e-13,
                drive: Loading::constant(NormalLoad::Approach(SOFT * LOAD), ContactCreepage::default(), 0.0),
            };
            let mut start = State::at_rest(&model, &[-MU * LOAD, across, LOAD], &[SOFT * LOAD]);
            (start.q, start.v) = (q.to_vec(), v.to_vec());
            Stepper::new(model, settings, start).unwrap()
        }
    }

    /// A small motion q = a cos ω₁t along x slides along y by κ q besides. Friction across the sliding acts as a damper
    /// d = μN/c on ẏ + κ q, so that y = Re(Y e^{iω₁t}) with Y = −d κ a / (ω₂² − ω₁² + i d ω₁). The traction of a step
    /// is that of its middle and counts as that of its end: an error of the first order.
    #[test]
    fn carried_deformation_rubs_as_its_particles_move() {
        let (pad, a) = (Pad::new(), 1e-8);
        let d = MU * LOAD / CREEP;
        let across = -d * CARRIED * a / Complex64::new(OMEGA[1].powi(2) - OMEGA[0].powi(2), d * OMEGA[0]);
        let at = |t: f64| across * Complex64::from_polar(1.0, OMEGA[0] * t);
        let rate = |t: f64| (Complex64::new(0.0, OMEGA[0]) * at(t)).re;
        let error = |h: f64| {
            let start = [[a, at(0.0).re], [0.0, rate(0.0)]];
            let mut stepper = pad.stepper(h, start, -d * (rate(0.0) + CARRIED * a));
            let steps = (4e-3 / h).round() as usize;
            (0..steps).for_each(|_| stepper.advance().unwrap());
            let (found, state) = (stepper.state().q[1], stepper.state());
            assert!(state.energy.residual().abs() < 1e-9 * state.energy.friction, "{:?}", state.energy);
            (found - at(stepper.time()).re) / across.norm()
        };
        let errors = [1e-5, 5e-6, 2.5e-6].map(error);
        let order = (errors[0] - errors[1]) / (errors[1] - errors[2]);
        assert!((order / 2.0 - 1.0).abs() < 0.1, "{order} {errors:?}");
        assert!((2.0 * errors[2] - errors[1]).abs() < 2e-4, "{errors:?}");
    }

    /// Small changes of the steps are the differences of steps beside each other.
    #[test]
    fn linearised_steps_carry_their_changes() {
        let (pad, h, small) = (Pad::new(), 1e-5, 1e-7);
        let start = [[2e-6, -1e-6], [1e-2, 3e-2]];
        for (part, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let size = small * [1e-6, 1e-2][part];
            let of = |sign: f64| {
                let mut moved = start;
                moved[part][k] += sign * size;
                let mut stepper = pad.stepper(h, moved, 0.0);
                (0..5).for_each(|_| stepper.advance().unwrap());
                [stepper.state().q.clone(), stepper.state().v.clone()]
            };
            let (ahead, behind) = (of(1.0), of(-1.0));
            let mut stepper = pad.stepper(h, start, 0.0);
            let unit = |p: usize| Mat::from_fn(2, 1, |i, _| if (p, i) == (part, k) { 1.0 } else { 0.0 });
            let mut changes = StateChanges::of_modes(&stepper, unit(0), unit(1));
            (0..5).for_each(|_| stepper.advance_modes_with(&mut changes).unwrap());
            for (p, found) in changes.modes().into_iter().enumerate() {
                let scale = (0..2).map(|i| found[(i, 0)].abs()).fold(0.0, f64::max);
                for i in 0..2 {
                    let wanted = (ahead[p][i] - behind[p][i]) / (2.0 * size);
                    assert!((found[(i, 0)] - wanted).abs() < 1e-5 * scale, "{part} {k} {p}: {found:?} {wanted}");
                }
            }
        }
    }
}
