//! Thresholds and Hopf points of made branches, word by word and number by number.

use super::follow::FollowedBranches;
use super::hopf::criticality;
use super::summary::BranchSummary;
use crate::cycles::{BranchEnd, BranchPoint, ContactMemory, Multipliers, PeriodicSolution, Special, SpecialKind};
use crate::job::Branches;
use crate::output::datasets::branches::{Criticality, OneBranch, Onset};
use crate::summary::Summary;
use num_complex::Complex64;
use std::f64::consts::PI;

const FREQUENCY: f64 = 100.0;
/// Largest multiplier of stable and of unstable cycles.
const STABLE: f64 = 0.9;
const UNSTABLE: f64 = 1.1;

/// A cycle whose rim moves with the amplitude `velocity`, m/s.
fn point(key: f64, velocity: f64, multiplier: f64) -> BranchPoint {
    let memory = ContactMemory { reaction: Vec::new(), friction: Vec::new(), motions: Vec::new() };
    let omega = 2.0 * PI * FREQUENCY;
    let cycle = PeriodicSolution {
        omega,
        frequency: FREQUENCY,
        kinetic: 0.25 * velocity * velocity,
        contacts: Vec::new(),
        modal: vec![vec![Complex64::default()], vec![Complex64::new(0.0, velocity / omega)]],
        drift: 0.0,
        state: [Vec::new(), Vec::new()],
        contact: memory.clone(),
        begin: memory,
    };
    let multipliers = Multipliers { values: vec![Complex64::new(multiplier, 0.0)], phase: Complex64::new(1.0, 0.0) };
    BranchPoint { key, u: Vec::new(), cycle, multipliers: Some(multipliers), special: None }
}

fn special(point: BranchPoint, kind: SpecialKind, error: f64) -> BranchPoint {
    BranchPoint { special: Some(Special { kind, second: 0.0, error }), ..point }
}

fn branch(points: Vec<BranchPoint>, ends: [BranchEnd; 2]) -> OneBranch {
    let ends = ends.map(|e| e.text());
    OneBranch { points, start: 0, ends, origin: "a made cycle".into(), unit: 1.0, unknown: None }
}

fn onset(key: f64, above: bool) -> Onset {
    Onset { key, frequency: FREQUENCY, above, mode: 0 }
}

/// The lines of the summary on branches over the friction from 0 to 1, without blanks at their beginning.
fn lines(all: Vec<OneBranch>, onsets: &[Onset]) -> Vec<String> {
    let wanted = serde_json::json!({ "along": "contact.friction", "from": 0.0, "to": 1.0 });
    let wanted: Branches = serde_json::from_value(wanted).unwrap();
    // The upper body alone moves, along y.
    let watch: Vec<Vec<f64>> = (0..6).map(|k| vec![if k == 4 { 1.0 } else { 0.0 }]).collect();
    let criticality = criticality(onsets, &all, 1.0);
    let branches = FollowedBranches { all, same: Vec::new(), marches: 7 };
    let told = BranchSummary {
        wanted: &wanted,
        branches: &branches,
        onsets,
        criticality: &criticality,
        watch: &watch,
        failed: &[],
    };
    let mut summary = Summary::default();
    told.write(None, &mut summary);
    summary.lines().iter().map(|l| l.trim_start().to_owned()).collect()
}

/// Values of the lines of this name.
fn values(lines: &[String], name: &str) -> Vec<String> {
    let named = lines.iter().filter_map(|l| l.strip_prefix(name));
    named.filter(|l| l.starts_with("  ") || name.len() >= 34).map(|l| l.trim_start().to_owned()).collect()
}

/// From stable cycles at `sign` times the key down to a fold at 0.2 and back along unstable ones to rest at 0.3, with
/// the cycles about `middle` of the keys in the place of the sign.
fn subcritical(sign: f64, middle: f64) -> Vec<BranchPoint> {
    let key = |k: f64| middle + sign * (k - middle);
    vec![
        point(key(0.4), 0.060, STABLE),
        point(key(0.3), 0.050, STABLE),
        point(key(0.22), 0.042, STABLE),
        special(point(key(0.2), 0.035, 1.0), SpecialKind::Fold, 1e-8),
        point(key(0.22), 0.028, UNSTABLE),
        point(key(0.26), 0.014, UNSTABLE),
        point(key(0.299), 0.001, UNSTABLE),
    ]
}

/// Squeal starts by itself above a threshold and persists down to a fold; in between it takes a push as large as the
/// unstable cycle half way, between its neighbours 3 : 1.
#[test]
fn subcritical_threshold_tells_fold_and_push() {
    let ends = || [BranchEnd::Range, BranchEnd::Rest];
    let said = lines(vec![branch(subcritical(1.0, 0.0), ends())], &[onset(0.3, true)]);
    let push = "in between a push starts it: 17.500 mm/s at the rim at contact.friction";
    assert_eq!(
        values(&said, "threshold"),
        [format!(
            "starts by itself above contact.friction = 0.3000000, persists down to contact.friction = 0.2000000 \
             (fold); {push} = 0.25000 (amplitude of the unstable cycle)"
        )]
    );
    assert_eq!(
        values(&said, "squeal starts by itself"),
        ["above contact.friction = 0.3000000 (100.000 Hz); subcritical: squeal jumps to a cycle of finite amplitude"]
    );
    assert_eq!(
        values(&said, "stable cycles"),
        ["from contact.friction = 0.2000000 (fold: squeal that was started ends there) to 0.4000000 (followed no \
          further)"]
    );
    assert_eq!(values(&said, "fold"), ["contact.friction = 0.2000000, 100.000 Hz, 3.0625e-4 J"]);
    assert_eq!(values(&said, "first end"), ["contact.friction = 0.4000000, at the end of the range"]);
    assert_eq!(values(&said, "other end"), ["contact.friction = 0.2990000, at rest"]);
    assert_eq!(said[0], "limit cycles over contact.friction: 7 cycles, 7 marches of the contact");
    // The same the other way round: mirrored at 0.4, from the other end, and where a multiplier at the fold is outside
    // the unit circle.
    let mut mirrored = subcritical(-1.0, 0.4);
    mirrored[3].multipliers = mirrored[4].multipliers.clone();
    mirrored.reverse();
    let [range, rest] = ends();
    let said = lines(vec![branch(mirrored, [rest, range])], &[onset(0.5, false)]);
    assert_eq!(
        values(&said, "threshold"),
        [format!(
            "starts by itself below contact.friction = 0.5000000, persists up to contact.friction = 0.6000000 (fold); \
             {push} = 0.55000 (amplitude of the unstable cycle)"
        )]
    );
    assert!(values(&said, "squeal starts by itself")[0].contains("below contact.friction = 0.5000000"), "{said:#?}");
    assert!(values(&said, "squeal starts by itself")[0].contains("subcritical"), "{said:#?}");
}

/// Small cycles where rest is unstable: squeal ends at the threshold where it began, also where the smallest cycle lies
/// a little beyond it by the error of the time step.
#[test]
fn supercritical_threshold_has_no_push() {
    for last in [0.3005, 0.2996] {
        let points = vec![point(last, 0.002, STABLE), point(0.33, 0.02, STABLE), point(0.5, 0.05, STABLE)];
        let said = lines(vec![branch(points, [BranchEnd::Rest, BranchEnd::Count])], &[onset(0.3, true)]);
        assert_eq!(
            values(&said, "threshold"),
            ["starts by itself above contact.friction = 0.3000000, and ends there on the way back"],
            "{last}"
        );
        assert_eq!(
            values(&said, "squeal starts by itself"),
            ["above contact.friction = 0.3000000 (100.000 Hz); supercritical: squeal grows from small cycles"]
        );
        assert_eq!(
            values(&said, "other end"),
            ["contact.friction = 0.5000000, after as many cycles as were asked for"]
        );
    }
}

/// A branch that was not followed to its threshold, or beyond it without the unstable cycles, says so.
#[test]
fn thresholds_tell_what_was_not_followed() {
    let far = vec![point(0.35, 0.03, STABLE), point(0.5, 0.05, STABLE)];
    let said = lines(vec![branch(far, [BranchEnd::Count, BranchEnd::Range])], &[onset(0.3, true)]);
    assert_eq!(
        values(&said, "threshold"),
        ["starts by itself above contact.friction = 0.3000000; cycles were followed down to contact.friction = \
          0.3500000 and no further"]
    );
    assert_eq!(values(&said, "squeal starts by itself"), ["above contact.friction = 0.3000000 (100.000 Hz)"]);
    // First stick and first opening beside each other do not bound squeal, and are no unstable cycles.
    let sticks = |key: f64, v: f64, kind| special(point(key, v, STABLE), kind, 1e-8);
    let beyond = vec![
        point(0.2, 0.03, STABLE),
        sticks(0.24, 0.036, SpecialKind::Stick),
        sticks(0.26, 0.037, SpecialKind::Opening),
        point(0.5, 0.05, STABLE),
    ];
    let said = lines(
        vec![
            branch(subcritical(1.0, 0.0), [BranchEnd::Range, BranchEnd::Rest]),
            branch(beyond, [BranchEnd::Range, BranchEnd::Range]),
        ],
        &[onset(0.3, true)],
    );
    let told = values(&said, "threshold");
    assert!(told[0].starts_with("branch 1: starts by itself above") && told[0].contains("17.500 mm/s"), "{told:#?}");
    assert_eq!(
        told[1],
        "branch 2: starts by itself above contact.friction = 0.3000000, persists down to contact.friction = 0.2000000 \
         or beyond (followed no further); in between a push starts it (no unstable cycle was found there)"
    );
    assert_eq!(values(&said, "branch"), ["1", "2"]);
}

/// A special point that is located worse than to 1e-6 of the range tells its error, and cycles without multipliers are
/// counted, with the reason.
#[test]
fn poor_locations_and_missing_multipliers_are_told() {
    let mut points = subcritical(1.0, 0.0);
    points[3].special = Some(Special { kind: SpecialKind::Torus, second: 12.5, error: 3e-4 });
    points[5].multipliers = None;
    let mut one = branch(points, [BranchEnd::Range, BranchEnd::Rest]);
    // Beyond a torus squeal goes on as another motion.
    let from = values(&lines(vec![one.clone()], &[]), "stable cycles");
    assert!(from[0].contains("0.2000000 (torus: this motion is unstable beyond) to"), "{from:?}");
    one.unknown = Some("at the key 0.2600000: limit cycles: no reason".into());
    let said = lines(vec![one], &[]);
    assert_eq!(
        values(&said, "torus"),
        ["contact.friction = 0.2000000, 100.000 Hz, 3.0625e-4 J, beats with 12.500 Hz, the key known to 3.0e-4 only"]
    );
    assert_eq!(
        values(&said, "multipliers"),
        ["not found for 1 of 7 cycles, whose stability is not known; the first at the key 0.2600000: limit cycles: no \
          reason"]
    );
}

/// The criticality is that of the nearest threshold with the frequency of the branch, and not known of a branch that is
/// vertical or ends elsewhere.
#[test]
fn criticality_belongs_to_the_threshold_where_a_branch_ends() {
    let rising =
        |last: f64| vec![point(0.5, 0.05, STABLE), point(last + 0.001, 0.004, STABLE), point(last, 0.002, STABLE)];
    let ends = |end| [BranchEnd::Range, end];
    let other = Onset { frequency: 120.0, ..onset(0.3, true) };
    let known = |points, end, onsets: &[Onset]| criticality(onsets, &[branch(points, ends(end))], 1.0);
    let (sub, none, sup) = (Criticality::Subcritical, Criticality::Unknown, Criticality::Supercritical);
    let onsets = [other, onset(0.32, true), onset(0.3, true), onset(0.3, false)];
    assert_eq!(known(rising(0.3003), BranchEnd::Rest, &onsets[..3]), [none, none, sup]);
    // On the other side rest is unstable below.
    assert_eq!(known(rising(0.3003), BranchEnd::Rest, &onsets[3..]), [sub]);
    assert_eq!(known(rising(0.3003), BranchEnd::Count, &onsets), [none; 4]);
    assert_eq!(known(rising(0.42), BranchEnd::Rest, &onsets), [none; 4]);
    let mut vertical = rising(0.3);
    vertical[1].key = 0.3 + 5e-7;
    assert_eq!(known(vertical, BranchEnd::Rest, &onsets), [none; 4]);
    assert_eq!([sub, none, sup].map(Criticality::number), [-1, 0, 1]);
}
