//! Factors that go to the disk.

use crate::program::{small, Folder};
use crate::transient::{open, read};
use serde_json::{json, Value};

/// Real and complex factors of both bodies: modes in slices, compliance, eigenvalues of the full system with unlike
/// damping.
fn wanted() -> Value {
    let mut job = small();
    job["bodies"]["lower"]["damping"] = json!({ "alpha": 3.0 });
    job["contact"]["creepage"]["lateral"] = json!(0.05);
    job["analyses"]["stability"] = json!({ "full": { "max_frequency": 500 } });
    job
}

#[test]
#[ignore = "long: scripts/validate long"]
fn results_are_those_in_memory_and_nothing_is_left() {
    let folder = Folder::with(wanted().to_string());
    std::fs::create_dir(folder.path("disk")).unwrap();
    let disk = ["--set", "solver.out_of_core=disk"];
    let told = folder.call(1, "check", &disk);
    told.good();
    assert!(told.out.contains("factors on the disk") && told.out.contains("/disk, not in memory"), "{told:?}");
    folder.call(2, "run", &["-o", &folder.text("memory.h5")]).good();
    folder.call(2, "run", &[&disk[..], &["-o", &folder.text("disk.h5")]].concat()).good();
    assert_eq!(std::fs::read_dir(folder.path("disk")).unwrap().count(), 0, "factors stay in the folder");
    let (a, b) = (open(folder.path("memory.h5")), open(folder.path("disk.h5")));
    for name in ["modes/lower/frequency", "modes/upper/frequency", "contact/pressure", "stability/growth_rate"] {
        let (a, b): (Vec<f64>, Vec<f64>) = (read(&a, name), read(&b, name));
        let size = a.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        assert!(size > 0.0 && a.len() == b.len(), "{name}");
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() <= 1e-9 * size, "{name}: {a} in memory, {b} from the disk");
        }
    }
}

#[test]
fn a_place_that_will_not_do() {
    let folder = Folder::with(small().to_string());
    for (ranks, command) in [(1, "check"), (1, "run"), (2, "run")] {
        let ran = folder.call(ranks, command, &["--set", "solver.out_of_core=nowhere"]);
        ran.failed(6, &["solver.out_of_core", "nowhere"]);
        folder.untouched();
    }
}
