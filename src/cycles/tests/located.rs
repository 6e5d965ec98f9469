//! Special points: the error of their location, their order along a branch, and cycles without multipliers.

use super::belt::{equations, onset, smooth, BeltModes};
use super::*;
use crate::cycles::branch::BranchWalk;
use crate::cycles::corrector::CorrectorResult;
use crate::cycles::in_order;

const FEW: Resolution = Resolution { harmonics: 8, samples: 120 };

/// Belts but for the velocities within a gap, m/s, for which no contact is found.
struct Gap(Belt, [f64; 2]);

impl Family for Gap {
    fn conditions(&self, key: f64) -> crate::Result<Conditions> {
        match key > self.1[0] && key < self.1[1] {
            true => Err(crate::Error::NotConverged("a belt without contact".into())),
            false => self.0.conditions(key),
        }
    }
}

/// The branch from a smooth cycle over the fold to the first stick, with special points located to this part of the
/// range of 0.6 m/s.
fn to_the_stick(family: &Gap, located: f64) -> Vec<BranchPoint> {
    let modes = BeltModes::new(&[OMEGA], &[DAMPING]);
    let structure = Structure::new(modes.model(&family.0)).unwrap();
    let mut equations = equations(&family.0, &structure, FEW, onset());
    let (key, u, cycle, contact) = smooth(&mut equations, 0.3);
    equations.family = family;
    let start = BranchPoint { key, u, cycle, multipliers: None, special: None };
    let extent = BranchExtent { range: [0.3, 0.9], most: 200, longest: 0.2, located: Some(located), stability: false };
    let mut branch = BranchState::new(start, contact, true, &extent);
    let sticks = |p: &BranchPoint| p.special.is_some_and(|s| s.kind == SpecialKind::Stick);
    follow(&mut equations, &mut branch, &extent, &mut |state| Ok(!state.points.iter().any(sticks))).unwrap();
    assert!(branch.points.iter().any(sticks), "{:?}", branch.end);
    branch.points
}

fn place(points: &[BranchPoint], kind: SpecialKind) -> (f64, f64) {
    let found = points.iter().find(|p| p.special.is_some_and(|s| s.kind == kind)).expect("the point");
    (found.key, found.special.unwrap().error)
}

/// Fold and first stick lie within their errors, and these within what was asked for, unless Newton's method fails on
/// the way: then the error says how near it came.
#[test]
fn special_points_lie_within_their_errors() {
    let whole = Gap(Belt::new(), [0.0; 2]);
    let exact = to_the_stick(&whole, 1e-8);
    let [fold, stick] = [SpecialKind::Fold, SpecialKind::Stick].map(|kind| place(&exact, kind));
    for located in [1e-6, 1e-4, 1e-2] {
        let found = to_the_stick(&whole, located);
        for (kind, known) in [(SpecialKind::Fold, fold), (SpecialKind::Stick, stick)] {
            let (key, error) = place(&found, kind);
            assert!(error > 0.0 && error < 0.6 * located, "{kind:?}: {error:e} at {located:e}");
            assert!((key - known.0).abs() <= error + known.1, "{kind:?}: {:e}, error {error:e}", key - known.0);
        }
    }
    // No contact about the first stick.
    let without = Gap(Belt::new(), [stick.0 - 3e-5, stick.0 + 5e-5]);
    let (key, error) = place(&to_the_stick(&without, 1e-6), SpecialKind::Stick);
    assert!(error > 8e-5 && (key - stick.0).abs() <= error, "{:e}, error {error:e}", key - stick.0);
}

/// A branch that rises to its fold and falls from there does so from one cycle to the next.
#[test]
fn special_points_are_in_order_along_a_branch() {
    let found = to_the_stick(&Gap(Belt::new(), [0.0; 2]), 1e-6);
    let turns = |points: &[BranchPoint]| {
        points.windows(3).filter(|p| (p[1].key - p[0].key) * (p[2].key - p[1].key) < 0.0).count()
    };
    let found = in_order(found, 1);
    let keys: Vec<_> = found.iter().map(|p| (p.key, p.special.map(|s| s.kind))).collect();
    assert_eq!(turns(&found), 1, "{keys:?}");
    // The amplitude of the first harmonic rises up to the first stick.
    let smooth = found.iter().take_while(|p| p.special.is_none_or(|s| s.kind != SpecialKind::Stick));
    let sizes: Vec<f64> = smooth.map(|p| p.u[1].hypot(p.u[2])).collect();
    assert!(sizes.len() > 10 && sizes.is_sorted(), "{sizes:?}");
    // Made ones: a fold found after the second cycle that lies before it, and two points the wrong way round.
    let model = found[0].clone();
    let made = |x: f64, y: f64, kind: Option<SpecialKind>| BranchPoint {
        u: vec![1e3 * (x - y), x, y],
        key: y,
        special: kind.map(|kind| Special { kind, second: 0.0, error: 0.0 }),
        ..model.clone()
    };
    let all = vec![
        made(0.0, 0.0, None),
        made(1.0, 1.0, None),
        made(1.4, 1.1, Some(SpecialKind::Stick)),
        made(2.0, 0.5, None),
        made(0.9, 1.2, Some(SpecialKind::Fold)),
        made(1.7, 0.9, Some(SpecialKind::Flip)),
        made(1.1, 1.0, Some(SpecialKind::Opening)),
        made(3.0, -1.0, None),
    ];
    let mut all = in_order(all, 1);
    // The fold belongs to the second cycle; those after the third one stay there.
    assert_eq!(all.remove(6).u[1], 1.7);
    let places: Vec<f64> = all.iter().map(|p| p.u[1]).collect();
    assert_eq!(places, [0.0, 1.0, 0.9, 1.4, 2.0, 1.1, 3.0]);
}

/// A cycle whose multipliers are not found stays a cycle, and the reason is kept, also over a stop.
#[test]
fn cycles_without_multipliers_stay_on_their_branch() {
    let (belt, modes) = (Belt::new(), BeltModes::new(&[OMEGA], &[DAMPING]));
    let structure = Structure::new(modes.model(&belt)).unwrap();
    let mut equations = equations(&belt, &structure, FEW, onset());
    let (key, u, mut cycle, contact) = smooth(&mut equations, 0.3);
    let extent = BranchExtent { range: [0.3, 0.9], most: 3, longest: 0.2, located: Some(1e-6), stability: true };
    // Multipliers follow the state, which is no number.
    cycle.state[1][0] = f64::NAN;
    let mut walk = BranchWalk { equations: &mut equations, extent: &extent, contact: None, unknown: None };
    let point = walk.point(CorrectorResult { u, cycle, iterations: 0 }, None).unwrap();
    let why = walk.unknown.clone().expect("a reason");
    assert!(point.multipliers.is_none() && point.key == key && why.starts_with("at the key 0."), "{why}");
    let mut state = BranchState::new(point, contact, true, &extent);
    state.unknown = Some(why.clone());
    state.points[0].cycle.state[1][0] = 0.0;
    follow(&mut equations, &mut state, &extent, &mut |_| Ok(true)).unwrap();
    // The cycles after it have theirs.
    assert_eq!((state.end.clone(), state.points.len()), (Some(BranchEnd::Count), 4));
    assert!(state.points[1..].iter().all(|p| p.multipliers.is_some()) && state.unknown == Some(why));
    let again = BranchState::from_numbers(&state.numbers(), state.points.clone());
    assert_eq!(again, Some(state));
}
