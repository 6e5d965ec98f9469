//! Sentences on made tables whose spectra are known.

use super::*;
use serde_json::json;

fn at(frequency: f64, growth: f64) -> Complex64 {
    Complex64::new(growth, 2.0 * PI * frequency)
}

fn job() -> Value {
    json!({
        "bodies": { "lower": { "mesh": { "extruded": { "section": "60E1" } } }, "upper": {} },
        "contact": { "friction": 0.4, "placement": null },
        "analyses": { "stability": { "max_frequency": 6000.0 }, "transient": null }
    })
}

/// A rail with one mode, a wheel with a pair of n = 3 and a second axial mode; of each motion 98 % are in the pair.
fn tables(values: &[Complex64]) -> Vec<Table> {
    let list = |path: &str, values: Vec<f64>| Table::list(path, "1", "made", values);
    let rows = |row: &[f64]| row.iter().copied().cycle().take(row.len() * values.len()).collect::<Vec<f64>>();
    let unstable: Vec<i8> = values.iter().map(|v| i8::from(v.re > 0.0)).collect();
    let family: Vec<String> = ["axial 0", "axial 0", "axial 1"].map(str::to_owned).to_vec();
    vec![
        list("/modes/lower/frequency", vec![100.0]),
        list("/modes/lower/diameters", vec![4.0]),
        list("/modes/upper/frequency", vec![975.0, 975.0, 2020.0]),
        list("/modes/upper/diameters", vec![3.0; 3]),
        Table::list("/modes/upper/family", "-", "made", family),
        Table::list("/stability/eigenvalue", "1/s", "made", values.to_vec()),
        Table::list("/stability/unstable", "-", "made", unstable),
        Table::new("/stability/participation", "1", "made", &[values.len(), 4], rows(&[0.02, 0.54, 0.44, 0.0])),
        Table::list("/stability/mode_body", "-", "made", vec![1i8, 2, 2, 2]),
        Table::new("/stability/diameters", "1", "made", &[values.len(), 2], rows(&[0.0, -3.0])),
    ]
}

#[test]
fn squealing_wheel_is_named_with_its_cures() {
    let mut tables = tables(&[at(965.0, 4.05), at(985.0, 2.9), at(350.0, -1.0)]);
    let level = |body: &str, level: f64| {
        Table::scalar(&format!("/transient/sound_power/{body}/total_level_a"), "dB", "made", level)
    };
    tables.extend([level("lower", 88.0), level("upper", 112.4)]);
    let slopes = [20.25, 11.6, 1.0].map(|re| Complex64::new(re, 0.0)).to_vec();
    tables.push(Table::list("/stability/sensitivity/friction", "1/s", "made", slopes));
    let said = Verdict::new(&job(), &tables).expect("a verdict");
    assert_eq!(said.kind, VerdictKind::Squeal);
    // 2 · 4.05 / (2π 965) over the 98 % of the wheel; 0.4 (1 − 2.9/11.6).
    assert_eq!(
        said.sentence,
        "Squeals at 965 Hz: wheel mode n = 3 axial, travelling against the rotation, growth rate 4.0 1/s (damping \
         ratio −0.067 %); also at 985 Hz; about 112 dB(A) of sound power, most from the wheel; quiet with a loss \
         factor of the wheel that is higher by 0.0014 or with friction below 0.30 (linear estimate)."
    );
    assert!(said.notes.is_empty(), "{:?}", said.notes);
}

#[test]
fn growth_without_oscillation_is_relaxation() {
    let values = [Complex64::new(1588.0, 0.0), at(350.0, -2.0), at(3000.0, -1.0)];
    let said = Verdict::new(&job(), &tables(&values)).expect("a verdict");
    assert_eq!(said.kind, VerdictKind::Relaxation);
    assert!(said.sentence.starts_with(
        "No squealing mode found up to 6 kHz, but one eigenvalue grows without oscillation (stick–slip relaxation), at \
         1600 1/s; least damped: 3000 Hz, wheel mode n = 3 axial"
    ));
    let said = Verdict::new(&job(), &tables(&[values[0], at(965.0, 3.0)])).expect("a verdict");
    assert!(said.kind == VerdictKind::Squeal && said.sentence.contains("; apart from these, one eigenvalue grows"));
}

#[test]
fn quiet_wheel_has_its_least_damped_mode() {
    let said = Verdict::new(&job(), &tables(&[at(350.0, -1.0), at(3183.0, -1.7)])).expect("a verdict");
    assert_eq!(
        said.sentence,
        "No squeal found up to 6 kHz; least damped: 3183 Hz, wheel mode n = 3 axial, travelling against the rotation, \
         damping ratio 0.0085 %."
    );
}

/// Modes below the frequency from which on the rail is endless are told apart, and make no squeal by themselves.
#[test]
fn growth_that_depends_on_the_ends_of_the_rail_is_told_apart() {
    let limit = || Table::scalar("/modes/lower/infinite_from", "Hz", "made", 279.0);
    let mut tables = tables(&[at(71.0, 37.8), at(965.0, 4.05), at(350.0, -1.0)]);
    let before = Verdict::new(&job(), &tables).expect("a verdict").sentence;
    assert!(before.starts_with("Squeals at 71 Hz") && before.contains("also at 965 Hz"), "{before}");
    tables.push(limit());
    let said = Verdict::new(&job(), &tables).expect("a verdict");
    assert!(said.kind == VerdictKind::Squeal && said.sentence.starts_with("Squeals at 965 Hz"), "{}", said.sentence);
    let apart = "; growth at 71 Hz (38 1/s) depends on the ends of the rail, which is one of infinite length from \
                 279 Hz on";
    assert!(said.sentence.contains(apart) && !said.sentence.contains("also at"), "{}", said.sentence);
    let mut quiet = self::tables(&[at(71.0, 37.8), at(965.0, -4.0)]);
    quiet.push(limit());
    let said = Verdict::new(&job(), &quiet).expect("a verdict");
    assert!(said.kind == VerdictKind::Quiet && said.sentence.contains(apart), "{}", said.sentence);
    assert!(said.sentence.starts_with("No squeal found up to 6 kHz; growth at 71 Hz"), "{}", said.sentence);
}

#[test]
fn eigenvalue_of_both_models_counts_once() {
    let mut tables = tables(&[at(965.0, 4.0), at(965.1, 4.1)]);
    let source = ["reduced", "full"].map(str::to_owned).to_vec();
    tables.push(Table::list("/stability/source", "-", "made", source));
    tables.push(Table::list("/stability/partner", "1", "made", vec![1i64, 0]));
    let said = Verdict::new(&job(), &tables).expect("a verdict").sentence;
    assert!(said.contains("growth rate 4.1 1/s") && !said.contains("also at"), "{said}");
}

#[test]
fn sweep_that_squeals_outweighs_a_quiet_point() {
    let mut tables = tables(&[at(965.0, -1.0)]);
    let list = |name: &str, values: Vec<f64>| Table::list(&format!("/sweep/{name}"), "1", "made", values);
    tables.extend([
        Table::list("/sweep/keys", "-", "made", vec!["contact.normal_load".to_owned()]),
        Table::list("/sweep/values/contact.normal_load", "N", "made", vec![60e3, 70e3]),
        list("status", vec![0.0, 0.0]),
        list("unstable", vec![0.0, 1.0]),
        list("growth_rate", vec![-1.0, 8.39]),
        list("frequency", vec![965.0, 4400.6]),
        Table::list("/sweep/eigenvalue", "1/s", "made", vec![at(965.0, -1.0), at(4400.6, 8.39)]),
        Table::list("/sweep/offset", "1", "made", vec![0i64, 1, 2]),
    ]);
    let said = Verdict::new(&job(), &tables).expect("a verdict");
    assert_eq!(said.kind, VerdictKind::Squeal);
    assert_eq!(
        said.sentence,
        "Sweep: growth at 1 of 2 points; fastest 8.4 1/s at 4401 Hz, with contact.normal_load = 70000 N."
    );
    let own = "The point of the job itself: No squeal found up to 6 kHz; least damped: 965 Hz";
    assert!(said.notes[0].starts_with(own), "{:?}", said.notes);
}

#[test]
fn runs_without_stability_say_what_was_computed() {
    let list = |path: &str| Table::list(path, "1", "made", vec![1.0]);
    let said = Verdict::new(&job(), &[list("/modes/lower/frequency"), list("/contact/pressure")]).expect("a verdict");
    assert_eq!(said.kind, VerdictKind::Open);
    assert!(said.sentence.ends_with("computed: free modes and steady rolling."), "{}", said.sentence);
    let mut moving = job();
    moving["analyses"]["transient"] = json!({});
    assert_eq!(Verdict::new(&moving, &[]), None);
    assert_eq!(
        of_motion(&moving, &[], Some(5.0), Some(425.2)),
        "Squeals: the motion grows at 5.0 1/s and is at 425 Hz in the end."
    );
    assert!(of_motion(&moving, &[], None, Some(425.2)).contains("no exponential growth"));
}

#[test]
fn branches_tell_thresholds_and_the_largest_cycle() {
    let mut tables = tables(&[at(965.0, 4.05)]);
    let list = |path: &str, values: &[f64]| Table::list(path, "1", "made", values.to_vec());
    tables.extend([
        Table::scalar("/cycles/along", "-", "made", "contact.friction"),
        list("/cycles/key", &[0.2, 0.3]),
        list("/cycles/frequency", &[965.0, 964.0]),
        // Of the upper body 3 and 4 along x and y: an amplitude of √2 5.
        Table::new("/cycles/velocity_rms", "m/s", "made", &[2, 2, 3], {
            let mut all = vec![0.0; 12];
            (all[0], all[9], all[10]) = (0.001, 0.03, 0.04);
            all
        }),
        list("/cycles/sound_power/upper/total_level_a", &[90.0, 112.4]),
        list("/cycles/onset/key", &[0.1671234, 0.19, 0.45]),
        list("/cycles/onset/frequency", &[965.4, 358.0, 421.5]),
        list("/cycles/onset/above", &[1.0, 1.0, 0.0]),
        list("/cycles/onset/mode", &[0.0, 1.0, 0.0]),
    ]);
    let said = Verdict::new(&job(), &tables).expect("a verdict");
    assert_eq!(
        said.notes,
        ["Limit cycles over contact.friction: squeal starts by itself above 0.1671 (965 Hz) and below 0.45 (422 Hz); \
          the largest one moves the rim with 71 mm/s and radiates 112 dB(A) of sound power at 964 Hz, with \
          contact.friction = 0.3."]
    );
}
