//! Track decay rates through the whole program: beside those of another program, on one and two ranks, and refusals.

use super::program::*;
use super::transient::open;
use serde_json::json;

fn numbers(file: &hdf5::File, name: &str) -> Vec<f64> {
    file.dataset(&format!("track_decay/{name}")).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// 60E1 on viscous pads alone, as docs/data/track_decay_rolland.py has it: a beam that bends, shears and twists.
#[test]
fn decay_rates_are_those_of_another_program() {
    let mut job = job("track-decay.json");
    let track = &mut job["bodies"]["lower"]["track"];
    track["sleeper"] = serde_json::Value::Null;
    track["loss_factor"] = json!(0.0);
    track["pad"] = json!({ "vertical": 120e6, "lateral": 40e6, "loss_factor": 0.2 });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &["--output", &folder.text("one.h5")]);
    assert!(ran.good().out.contains("track decay rate (EN 15461) of body lower, vertical: "), "{}", ran.out);
    let file = open(folder.path("one.h5"));
    let [bands, vertical, lateral] = ["frequency", "vertical", "lateral"].map(|name| numbers(&file, name));
    assert_eq!((bands.len(), bands[0], bands[13]), (14, 250.0, 5000.0));
    assert_eq!(numbers(&file, "position").last(), Some(&39.6));
    let mut compared = 0;
    for line in include_str!("../../docs/data/track_decay_rolland.csv").lines().skip(2) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        let k = bands.iter().position(|f| *f == cells[0]).expect("a band");
        let (vertical, lateral) = (vertical[k] / cells[1], lateral[k] / cells[2]);
        println!("{} Hz: vertical {vertical:.3}, lateral {lateral:.3}", cells[0]);
        // Above, web and foot bend, which the beam does not.
        if cells[0] <= 1000.0 {
            assert!((vertical - 1.0).abs() < 0.02 && (lateral - 1.0).abs() < 0.1, "{line}: {vertical} {lateral}");
            compared += 1;
        }
    }
    assert_eq!(compared, 7);
    let response = numbers(&file, "response/vertical");
    assert!(response.len() == 14 * 29 && response.chunks(29).all(|band| band[0] == 1.0 && band[28] < 0.5));

    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    let two = open(folder.path("two.h5"));
    for name in ["vertical", "lateral", "response/lateral"] {
        assert_eq!(numbers(&two, name), numbers(&file, name), "{name}");
    }
}

#[test]
fn what_has_no_rail_or_no_damping_has_no_decay_rates() {
    let mut wheel = job("annulus.json");
    wheel["analyses"] = json!({ "track_decay": {} });
    Folder::with(wheel.to_string()).refused(1, &[], 2, &["analyses.track_decay", "found 0 rails"]);
    let mut rail = job("track-decay.json");
    rail["analyses"]["track_decay"] = json!({ "offset": 0.5 });
    Folder::with(rail.to_string()).refused(1, &[], 2, &["analyses.track_decay.offset", "0.1"]);
    let track = json!({ "pad": { "vertical": 120e6, "loss_factor": 0.0 }, "loss_factor": 0.0 });
    rail["analyses"]["track_decay"] = json!({ "lines": 1 });
    rail["bodies"]["lower"]["track"] = track;
    Folder::with(rail.to_string()).refused(1, &[], 2, &["never decay"]);
}
