//! Every dataset of a run against what its steps found, on a small model.

use super::*;
use crate::body::ReducedBody;
use crate::friction::FrictionLaw;
use crate::grid::Interface;
use crate::model::CoupledModel;
use crate::output::{Reader, Segments};
use crate::transient::loading::{History, Loading, Normal, PatchDrive, Tangential};
use crate::transient::stepper::StepFields;
use crate::transient::Model;
use crate::transient::{ContactSolver, Scheme, Settings, State};
use faer::Mat;
use serde_json::json;

const H: f64 = 1e-3;
/// Steps; those of the first segment.
const STEPS: [u64; 2] = [11, 6];

/// Five by five nodes in contact at three of them, two modes of one body and one of the other.
fn model() -> ReducedModel {
    let x: Vec<f64> = (0..5).map(|i| 0.5 * (f64::from(i) - 2.0)).collect();
    let gap = (0..25).map(|i| if [7, 8, 12].contains(&i) { 1e-5 * i as f64 } else { 1.0 }).collect();
    let interface = Interface::new(x.clone(), x, gap).expect("a grid");
    let body = |omega: Vec<f64>, k0: usize| {
        let m = omega.len();
        let modes = Mat::from_fn(75, m, |i, k| 0.1 * ((2 * i + 5 * (k + k0)) as f64).sin());
        let compliance = Mat::from_fn(75, 75, |i, j| {
            let own = if i == j { 1e-6 } else { 0.0 };
            own + (0..m).map(|k| modes[(i, k)] * modes[(j, k)] / omega[k].powi(2)).sum::<f64>()
        });
        ReducedBody::new(omega, vec![3.0; m], modes, compliance)
    };
    let bodies = vec![body(vec![150.0, 400.0], 0), body(vec![230.0], 2)];
    let pair = CoupledModel::new(&bodies[0], &bodies[1]).expect("a pair");
    ReducedModel {
        interface,
        bodies,
        place: [0, 1],
        pair,
        own: Default::default(),
        rotation: [None, None],
        at_rest: vec![None; 2],
    }
}

/// Motion of row `r` of the points by mode `k`, and by reaction `i`.
fn by_mode(r: usize, k: usize) -> f64 {
    ((3 * r + 7 * k + 1) as f64).cos()
}

fn by_reaction(r: usize, i: usize) -> f64 {
    1e-6 * ((r + 2 * i) as f64).sin()
}

/// A step as the stepper tells it.
struct Seen {
    state: State,
    force: [f64; 3],
    moment_z: f64,
    counts: [f64; 4],
    residual: f64,
    fields: StepFields,
}

#[test]
fn datasets_hold_what_their_names_say_at_the_times_they_should() {
    let root = model();
    let model = Model::new(&root.pair, &root.interface);
    let approach = History::table("approach", &[[0.0, 2e-3], [1.0, 0.1]], 1.0).expect("a history");
    let settings = Settings {
        scheme: Scheme { step: H, theta: 0.5 },
        friction: FrictionLaw::Constant(0.3).into(),
        solver: ContactSolver::Newton,
        tolerance: 1e-11,
        drive: Loading::of_patch(
            Normal::Approach(approach),
            PatchDrive {
                tangential: [0.05, -0.11].map(|c| Tangential::Creep(History::constant(c))),
                spin: History::constant(0.4),
                speed: 1.0,
            },
        ),
    };
    let reaction: Vec<f64> =
        (0..75).map(|k| if k % 3 == 2 && [7, 8, 12].contains(&(k / 3)) { 1e3 } else { 0.0 }).collect();
    let start = State::at_rest(&model, &reaction, &[2e-3]).shaken(3, 0.5);
    let mut stepper = Stepper::new(model, settings, start).expect("a stepper");
    let points = ["one", "two"].map(|name| json!({ "name": name, "body": "upper", "at": [0, 0, 0] }));
    let wanted: job::Transient = serde_json::from_value(json!({
        "duration": 0.011, "step": H, "contact_stride": 3, "modal_stride": 2, "body_stride": 5,
        "points": points
    }))
    .expect("a transient");
    let names = ["one", "two"];
    let (rows, m, n) = (6, 3, 25);
    let all = |f: fn(usize, usize) -> f64, columns: usize| {
        (0..columns).flat_map(|k| (0..rows).map(move |r| f(r, k))).collect::<Vec<f64>>()
    };
    let points = Points::moved(&names, all(by_mode, m), all(by_reaction, 3 * n));

    let folder = tempfile::tempdir().expect("a folder");
    let segments = Segments::claim(&folder.path().join("run.h5"), false).expect("a folder");
    segments.start_run(serde_json::Value::Null).expect("a run");
    segments.write(0, &points.checkpoint_tables()).expect("the start");
    // A run that is continued takes what moves the points from its first segment.
    let again = Points::restore(&wanted, &segments.open_first().expect("the first")).expect("the points");
    assert_eq!((&again.names, &again.at), (&points.names, &points.at));

    let mut recorder = Recorder::new(&points, &wanted, &root, 4, &stepper.state().reaction);
    let mut seen: Vec<Seen> = Vec::new();
    let first = stepper.state().clone();
    for step in 1..=STEPS[0] {
        stepper.advance().expect("a step");
        recorder.record_step(&stepper);
        let r = stepper.report();
        seen.push(Seen {
            state: stepper.state().clone(),
            force: r.patches[0].force,
            moment_z: r.patches[0].moment_z,
            counts: [r.closed(), r.stick(), r.effort.iterations, r.effort.products].map(|c| c as f64),
            residual: r.residual,
            fields: stepper.fields(),
        });
        // One segment in two parts, the second by the same recorder; then another recorder, as in a run that is
        // continued.
        if [4, STEPS[1], STEPS[0]].contains(&step) {
            assert!(recorder.any());
            segments.write(step, &recorder.tables()).expect("a segment");
            recorder.clear();
            assert!(!recorder.any() && recorder.tables().is_empty());
            if step == STEPS[1] {
                recorder = Recorder::new(&again, &wanted, &root, 4, &stepper.state().reaction);
            }
        }
    }
    for (k, s) in seen.iter().enumerate() {
        assert_eq!(s.state.step, k as u64 + 1);
        // What the stepper says of itself, once more.
        let (mut force, mut moment) = ([0.0; 3], 0.0);
        for (i, r) in s.state.reaction.chunks_exact(3).enumerate() {
            let [x, y] = root.interface.point(i);
            [0, 1, 2].iter().for_each(|&c| force[c] += if c == 2 { -r[c] } else { r[c] });
            moment += x * r[1] - y * r[0];
        }
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * force[2].abs();
        assert!((0..3).all(|c| close(s.force[c], force[c])) && close(s.moment_z, moment), "{force:?} N, {moment} N m");
        let kinetic = 0.5 * s.state.v.iter().map(|v| v * v).sum::<f64>();
        assert!((s.state.energy.kinetic / kinetic - 1.0).abs() < 1e-9, "{kinetic} J");
    }
    let beyond = |state: &State, r: usize| -> f64 {
        state.reaction.iter().enumerate().map(|(i, f)| by_reaction(r, i) * f).sum()
    };
    let moved =
        |s: &State, r: usize| s.q.iter().enumerate().map(|(k, q)| by_mode(r, k) * q).sum::<f64>() + beyond(s, r);
    let rate = |s: &State, before: &State, r: usize| {
        let own: f64 = s.v.iter().enumerate().map(|(k, v)| by_mode(r, k) * v).sum();
        own + (beyond(s, r) - beyond(before, r)) / H
    };
    let time = |s: &Seen, _: usize| vec![s.state.step as f64 * H];
    let before = |k: usize| if k == 0 { &first } else { &seen[k - 1].state };
    type Row<'a> = Box<dyn Fn(&Seen, usize) -> Vec<f64> + 'a>;
    let energy =
        |f: fn(&crate::transient::Energy) -> f64| -> Row<'_> { Box::new(move |s, _| vec![f(&s.state.energy)]) };
    let number = |f: fn(&Seen) -> f64| -> Row<'_> { Box::new(move |s, _| vec![f(s)]) };
    let q = || -> Row<'_> { Box::new(|s, _| s.state.q.clone()) };
    let steps: Vec<(&str, u64, Row<'_>)> = vec![
        ("transient/time", 1, Box::new(time)),
        ("transient/force", 1, Box::new(|s, _| s.force.to_vec())),
        ("transient/moment_z", 1, number(|s| s.moment_z)),
        ("transient/approach", 1, Box::new(|s, _| vec![2e-3 + 0.098 * s.state.step as f64 * H])),
        ("transient/kinetic", 1, energy(|e| e.kinetic)),
        ("transient/elastic", 1, energy(|e| e.elastic)),
        ("transient/friction_loss", 1, energy(|e| e.friction)),
        ("transient/damping_loss", 1, energy(|e| e.damping)),
        ("transient/impact_loss", 1, energy(|e| e.impact)),
        ("transient/drive_work", 1, energy(|e| e.drive)),
        ("transient/rolling_work", 1, energy(|e| e.rolling)),
        ("transient/balance", 1, energy(|e| e.residual())),
        ("transient/residual", 1, number(|s| s.residual)),
        ("transient/closed", 1, number(|s| s.counts[0])),
        ("transient/stick", 1, number(|s| s.counts[1])),
        ("transient/iterations", 1, number(|s| s.counts[2])),
        ("transient/products", 1, number(|s| s.counts[3])),
        ("transient/point_displacement", 1, Box::new(|s, _| (0..rows).map(|r| moved(&s.state, r)).collect())),
        ("transient/point_velocity", 1, Box::new(|s, k| (0..rows).map(|r| rate(&s.state, before(k), r)).collect())),
        ("transient/contact_time", 3, Box::new(time)),
        ("transient/contact_pressure", 3, Box::new(|s, _| s.fields.pressure.clone())),
        ("transient/contact_traction", 3, Box::new(|s, _| s.fields.traction.as_flattened().to_vec())),
        ("transient/contact_creep", 3, Box::new(|s, _| s.fields.creep.as_flattened().to_vec())),
        ("transient/contact_state", 3, Box::new(|s, _| s.fields.state.iter().map(|&v| f64::from(v)).collect())),
        ("transient/modal_time", 2, Box::new(time)),
        ("transient/modal_displacement", 2, q()),
        ("sound/time", 4, Box::new(time)),
        ("sound/displacement", 4, q()),
        ("bodies/time", 5, Box::new(time)),
        ("bodies/displacement", 5, q()),
        ("bodies/reaction", 5, Box::new(|s, _| s.state.reaction.clone())),
    ];
    let files: Vec<Reader> = segments.entries().iter().map(|e| segments.open(e).expect("open")).collect();
    for (path, stride, row) in &steps {
        let due = seen.iter().enumerate().filter(|(_, s)| s.state.step % stride == 0);
        let wanted: Vec<f64> = due.flat_map(|(k, s)| row(s, k)).collect();
        let found: Vec<f64> = files
            .iter()
            .filter(|f| f.has(&format!("/{path}")))
            .flat_map(|f| match f.read(&format!("/{path}")).expect("read").1 {
                Values::F64(v) => v,
                Values::I32(v) => v.into_iter().map(f64::from).collect(),
                Values::I8(v) => v.into_iter().map(f64::from).collect(),
                other => panic!("{path}: {other:?}"),
            })
            .collect();
        let size = wanted.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        assert!(found.len() == wanted.len(), "{path}: {} values instead of {}", found.len(), wanted.len());
        let error = found.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error <= 1e-12 * size, "{path}: {found:?} instead of {wanted:?}");
        // Nothing agrees because it is 0; impacts there are none on springs.
        assert!(size > 0.0 || ["transient/impact_loss", "transient/stick"].contains(path), "{path} is 0 throughout");
    }
    assert_eq!(
        files
            .iter()
            .flat_map(|f| f.names("transient").unwrap_or_default())
            .collect::<std::collections::BTreeSet<_>>()
            .len(),
        26
    );
}
