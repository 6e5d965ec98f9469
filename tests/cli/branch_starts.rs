//! Branches of limit cycles that begin from a sweep, and the contact nodes over a period.

use super::branches::{job, quick};
use super::program::*;
use super::transient::open;
use serde_json::{json, Value};

/// A branch of one cycle from the motion `number` of the sweep of `file`.
fn from_sweep(file: &str, number: usize) -> Value {
    let mut cycles = quick();
    cycles["starts"] = json!({ "modes": 0, "results": [{ "file": file, "cycle": number }] });
    (cycles["most"], cycles["stability"], cycles["every"]) = (json!(1), json!(false), json!(1));
    job(cycles)
}

/// A marched cycle of a sweep begins a branch: it is the cycle that the unstable mode leads to. Forces of the contact
/// nodes add up to those of the contact at each step.
#[test]
fn a_branch_begins_from_a_cycle_of_a_sweep() {
    let mut swept = job(quick());
    let march = json!({ "duration": 1.0, "settled": 0.01, "amplitude": 1e-5, "branches": ["mode"] });
    swept["analyses"] = json!({
        "modes": { "count": 6 },
        "stability": {},
        "sweep": { "keys": { "contact.creepage.lateral": [0.0, 0.014] }, "cycles": march }
    });
    let folder = Folder::with(swept.to_string());
    folder.call(1, "run", &["--output", &folder.text("swept.h5")]).good();
    let file = folder.text("swept.h5");
    let own = Folder::with(from_sweep(&file, 1).to_string());
    let ran = own.call(2, "run", &["--output", &own.text("own.h5")]);
    assert!(ran.good().out.contains("point 1 of the sweep of"), "{}", ran.out);
    let mut cycles = quick();
    (cycles["most"], cycles["stability"]) = (json!(1), json!(false));
    let mode = Folder::with(job(cycles).to_string());
    mode.call(1, "run", &["--output", &mode.text("own.h5")]).good();
    let begun = [&own, &mode].map(|folder| {
        let result = open(folder.path("own.h5"));
        let start = result.dataset("cycles/start").and_then(|d| d.read_raw::<i64>()).expect("start")[0] as usize;
        ["key", "frequency", "kinetic"].map(|name| {
            result.dataset(&format!("cycles/{name}")).and_then(|d| d.read_raw::<f64>()).expect("numbers")[start]
        })
    });
    assert!((begun[0][0] - 0.014).abs() < 1e-12 && (begun[0][1] / begun[1][1] - 1.0).abs() < 1e-6, "{begun:?}");
    assert!((begun[0][2] / begun[1][2] - 1.0).abs() < 1e-4, "{begun:?}");

    let result = open(own.path("own.h5"));
    let shape = result.dataset("cycles/period/reaction").expect("reactions").shape();
    let read = |name: &str| result.dataset(name).and_then(|d| d.read_raw::<f64>()).expect("numbers");
    let (reaction, force) = (read("cycles/period/reaction"), read("cycles/period/force"));
    let state = result.dataset("cycles/period/state").and_then(|d| d.read_raw::<i8>()).expect("states");
    let counts = result.dataset("cycles/period/nodes").and_then(|d| d.read_raw::<i64>()).expect("counts");
    let &[cycles, steps, nodes, 3] = &shape[..] else { panic!("{shape:?}") };
    assert!(cycles >= 2 && steps == 120 && nodes > 4, "{shape:?}");
    let largest = force.iter().fold(0.0f64, |most, f| most.max(f.abs()));
    for step in 0..cycles * steps {
        let of = |c: usize| (0..nodes).map(|k| reaction[3 * (nodes * step + k) + c]).sum::<f64>();
        let sum = [of(0), of(1), -of(2)];
        for c in 0..3 {
            assert!((sum[c] - force[3 * step + c]).abs() < 1e-9 * largest, "step {step}: {sum:?}");
        }
        let states = &state[nodes * step..nodes * (step + 1)];
        let found = [states.iter().filter(|&&s| s > 0).count(), states.iter().filter(|&&s| s == 1).count()];
        assert_eq!(found.map(|n| n as i64), [counts[2 * step], counts[2 * step + 1]], "step {step}");
    }

    for (change, wanted) in [
        (
            ("analyses.cycles.starts.results.0.cycle", json!(0)),
            "found no motion at the number 0 of the sweep; these move: 1",
        ),
        (("analyses.cycles.starts.results.0.cycle", json!(7)), "found 2 motions of limit cycles"),
        (("analyses.modes.count", json!(5)), "expected the 10 of this job"),
        (("bodies.upper.material.young", json!(209e9)), "found a mode 7 of "),
    ] {
        let ran = own.call(1, "run", &["--force", "--set", &format!("{}={}", change.0, change.1)]);
        assert!(ran.code != Some(0) && ran.err.contains(wanted), "{wanted}: {:?} {}", ran.code, ran.err);
        assert!(ran.err.contains("analyses.cycles.starts.results[0]"), "{}", ran.err);
    }
    // So does the check, where the bodies are not needed.
    let missing = "analyses.cycles.starts.results.0.file=none.h5";
    for set in ["analyses.cycles.starts.results.0.cycle=0", "analyses.cycles.starts.results.0.cycle=7", missing] {
        let ran = own.call(1, "check", &["--set", set]);
        assert!(ran.code == Some(3) && ran.err.contains("starts.results[0]"), "{set}: {:?} {}", ran.code, ran.err);
    }
    let other = from_sweep(&file, 1);
    let other = Folder::with(other.to_string().replace("contact.creepage.lateral", "contact.friction"));
    let ran = other.call(1, "run", &["--set", "analyses.cycles.from=0.1", "--set", "analyses.cycles.to=0.5"]);
    assert!(ran.err.contains("found a sweep over \"contact.creepage.lateral\""), "{}", ran.err);
}
