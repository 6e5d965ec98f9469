//! Branches over the damping of a mode, which changes the modes and leaves the contact as it is.

use super::belt::{beside_differences, equations, onset, smooth, BeltModes, FALL};
use super::*;
use crate::model::ModalDynamics;

/// The belt at one velocity, m/s, under modes whose damping is `key` times that given, 1/s.
struct Damped<'a> {
    belt: &'a Belt,
    v: f64,
    omega: Vec<f64>,
    damping: Mat<f64>,
}

impl Family for Damped<'_> {
    fn conditions(&self, _key: f64) -> crate::Result<Conditions> {
        self.belt.conditions(self.v)
    }

    fn dynamics(&self, key: f64) -> crate::Result<Option<ModalDynamics>> {
        let damping = match self.damping.nrows() {
            1 => vec![key * self.damping[(0, 0)]].into(),
            _ => (faer::Scale(key) * &self.damping).into(),
        };
        Ok(Some(ModalDynamics { stiffness: ModalMatrix::squares(&self.omega), damping, turning: None }))
    }
}

/// With fixed velocity and damping as the key, the branch from a cycle on the branch over the velocity ends at rest
/// where friction feeds a small motion what damping takes: c = N 0.2/v₀ exp(−v/v₀).
#[test]
fn branch_over_damping_ends_where_rest_loses_its_stability() {
    let (belt, modes) = (Belt::new(), BeltModes::new(&[OMEGA], &[DAMPING]));
    let structure = Structure::new(modes.model(&belt)).unwrap();
    let resolution = Resolution { harmonics: 6, samples: 120 };
    let mut equations = equations(&belt, &structure, resolution, onset());
    let (v, mut u, known, _) = smooth(&mut equations, 0.2);
    let damped = Damped { belt: &belt, v, omega: vec![OMEGA], damping: Mat::from_fn(1, 1, |_, _| 1.0) };
    let mut equations = Equations { family: &damped, key: [DAMPING, 5.0], ..equations };
    *u.last_mut().unwrap() = 0.0;
    let mut contact = None;
    let found = solve(&mut equations, u, &mut contact).unwrap();
    assert!((found.cycle.kinetic / known.kinetic - 1.0).abs() < 1e-6, "{} {}", found.cycle.kinetic, known.kinetic);
    let start = BranchPoint { key: DAMPING, u: found.u, cycle: found.cycle, multipliers: None, special: None };
    let extent = BranchExtent { range: [5.0, 20.0], most: 100, longest: 0.1, located: Some(1e-6), stability: true };
    let state = BranchState::new(start, contact.unwrap(), true, &extent);
    let critical = LOAD * 0.2 / FALL * (-v / FALL).exp();
    let ends = [state.clone(), state.turned()].map(|mut branch| {
        follow(&mut equations, &mut branch, &extent, &mut |_| Ok(true)).unwrap();
        let last = branch.points.last().unwrap();
        // An unstable cycle between rest and the cycle that sticks.
        assert!(branch.points[1].multipliers.as_ref().unwrap().unstable() > 0);
        (branch.end.clone(), last.key)
    });
    assert!(
        critical < DAMPING
            && ends.iter().any(|(end, key)| { *end == Some(BranchEnd::Rest) && (key / critical - 1.0).abs() < 2e-3 }),
        "{ends:?}, expected {critical}"
    );
}

/// The assembled derivative by the key beside central differences of the equations, of modes that damping couples.
#[test]
fn derivative_by_the_damping_is_that_of_the_equations() {
    let omega = [OMEGA, 1.63 * OMEGA];
    let (belt, modes) = (Belt::new(), BeltModes::new(&omega, &[DAMPING, 15.5]));
    let structure = Structure::new(modes.model(&belt)).unwrap();
    let resolution = Resolution { harmonics: 6, samples: 120 };
    let mut equations = equations(&belt, &structure, resolution, onset());
    let (v, mut u, ..) = smooth(&mut equations, 0.2);
    let damping = Mat::from_fn(2, 2, |i, j| [[DAMPING, 3.0], [3.0, 15.5]][i][j]);
    let damped = Damped { belt: &belt, v, omega: omega.to_vec(), damping };
    let mut equations = Equations { family: &damped, key: [1.0, 1.0], ..equations };
    let n = equations.size();
    u[n + 1] = 0.0;
    beside_differences(&mut equations, &u, &[(1, 1e-4), (n, 1e-5), (n + 1, 1e-4)]);
}
