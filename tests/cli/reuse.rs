//! `--reuse`: the same results without meshes, and refusal of files of other jobs.

use super::program::*;
use serde_json::{json, Value};

fn numbers(folder: &Folder, file: &str, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path(file)).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The largest difference of two lists over the largest value.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let scale = b.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / scale
}

fn sliding() -> Value {
    let mut job = small();
    job["bodies"]["lower"]["mesh"]["cylinder"]["contact_offset"] = json!(0.02);
    job["contact"]["creepage"] = json!({ "lateral": 0.01 });
    job["analyses"] =
        json!({ "modes": { "count": 12 }, "stability": { "direction": "rigid", "damping_ratio": 1 }, "steady": {} });
    job["output"] = json!({ "fields": false });
    job
}

#[test]
fn the_earlier_model_gives_the_same_results_without_meshes() {
    let folder = Folder::with(sliding().to_string());
    let (first, new) = (folder.text("first.h5"), folder.text("new.h5"));
    folder.call(2, "run", &["--output", &first]).good();
    // What may differ: friction, load, damping, the analyses.
    let other =
        ["--set", "contact.friction=0.5", "--set", "contact.normal_load=60e3", "--set", "bodies.lower.damping.alpha=3"];
    folder.call(2, "run", &[&other[..], &["--output", &new]].concat()).good();
    for ranks in [1, 2] {
        let args = ["--reuse", first.as_str(), "--output", &folder.text("again.h5"), "--force"];
        let ran = folder.call(ranks, "run", &[&other[..], &args].concat());
        assert!(!ran.good().err.contains("meshing") && !ran.err.contains("factorisation"), "{}", ran.err);
        for name in [
            "stability/growth_rate",
            "stability/frequency",
            "contact/force",
            "contact/pressure",
            "modes/lower/frequency",
        ] {
            let (a, b) = (numbers(&folder, "again.h5", name), numbers(&folder, "new.h5", name));
            let d = difference(&a, &b);
            assert!(d < 1e-8, "{name} on {ranks} ranks differs by {d:.1e}");
        }
    }
    // A sweep takes it up as well.
    let sweep = ["--set", "analyses.sweep={\"keys\":{\"contact.friction\":[0.5]}}", "--reuse", first.as_str()];
    let ran = folder.call(2, "run", &[&other[..], &sweep, &["--output", &folder.text("sweep.h5")]].concat());
    assert!(!ran.good().err.contains("meshing"), "{}", ran.err);
    let (a, b) =
        (numbers(&folder, "sweep.h5", "sweep/growth_rate"), numbers(&folder, "new.h5", "stability/growth_rate"));
    assert!((a[0] - b[0]).abs() < 1e-8 * b[0].abs(), "{a:?} {}", b[0]);
}

/// Complex modes are recovered with the mode shapes that the earlier run wrote beside its results; without them the
/// run says so.
#[test]
fn complex_modes_come_from_the_shapes_of_the_earlier_run() {
    complex_modes_come_from_shapes(false);
}

/// The same of bodies that are mirror images, whose shapes are written once.
#[test]
#[ignore = "long: scripts/validate long"]
fn complex_modes_come_from_the_shapes_of_mirror_images() {
    complex_modes_come_from_shapes(true);
}

fn complex_modes_come_from_shapes(mirrored: bool) {
    let mut job = sliding();
    job["analyses"] =
        json!({ "modes": { "count": 12 }, "stability": { "direction": "rigid", "damping_ratio": 1, "phases": 4 } });
    job["output"] = json!({});
    if mirrored {
        job["bodies"]["lower"] = job["bodies"]["upper"].clone();
    }
    let folder = Folder::with(job.to_string());
    let (first, again) = (folder.text("first.h5"), folder.text("again.h5"));
    folder.call(2, "run", &["--output", &first]).good();
    let reuse = ["--reuse", first.as_str(), "--output", &again, "--force"];
    for ranks in [2, 1] {
        let ran = folder.call(ranks, "run", &reuse);
        assert!(!ran.good().err.contains("] modes, body"), "{}", ran.err);
        for (name, bound) in [("growth_parts", 1e-6), ("body_energy", 1e-6), ("contact_motion", 1e-6)] {
            let name = format!("stability/{name}");
            let d = difference(&numbers(&folder, "again.h5", &name), &numbers(&folder, "first.h5", &name));
            assert!(d < bound, "{name} on {ranks} ranks differs by {d:.1e}");
        }
        let largest = |file: &str| numbers(&folder, file, "VTKHDF/PointData/motion");
        let (a, b) = (largest("again.modes.vtkhdf"), largest("first.modes.vtkhdf"));
        if ranks == 2 {
            // The eigenvector's own phase is arbitrary, but its largest component is made real; both bodies move
            // alike where they are alike.
            assert!(difference(&a, &b) < 1e-5, "{:.1e}", difference(&a, &b));
        }
    }
    if mirrored {
        return;
    }
    std::fs::remove_file(folder.path("again.modes.vtkhdf")).expect("remove");
    // A file of other modes, a torn one, and none.
    let shapes = folder.path("first.free_modes.vtkhdf");
    let whole = std::fs::read(&shapes).expect("read");
    let other = ["--output", &folder.text("other.h5"), "--set", "bodies.lower.material.young=2e11"];
    folder.call(1, "run", &other).good();
    std::fs::copy(folder.path("other.free_modes.vtkhdf"), &shapes).expect("copy");
    let refused = |part: &str| {
        let ran = folder.call(2, "run", &reuse);
        let said = "complex modes                      not written, for want of the mode shapes of the earlier run";
        assert!(ran.good().out.contains(said) && ran.out.contains(part), "{}", ran.out);
        assert!(!folder.path("again.modes.vtkhdf").exists());
    };
    refused("is not that of the reduced model");
    std::fs::write(&shapes, &whole[..whole.len() / 2]).expect("write");
    refused("first.free_modes.vtkhdf");
    std::fs::remove_file(&shapes).expect("remove");
    refused("cannot read");
}

/// Mirror images are kept once; fields bring the mesh back.
#[test]
fn fields_are_made_on_the_mesh_of_the_job() {
    let mut job = small();
    job["analyses"] = json!({ "steady": {} });
    let folder = Folder::with(job.to_string());
    let first = folder.text("job.h5");
    folder.call(1, "run", &[]).good();
    let ran = folder.call(2, "run", &["--reuse", &first, "--output", &folder.text("again.h5")]);
    assert!(ran.good().err.contains("fields in the bodies"), "{}", ran.err);
    let largest =
        |file: &str| numbers(&folder, file, "VTKHDF/PointData/displacement").iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let (a, b) = (largest("again.h5"), largest("job.h5"));
    assert!((a - b).abs() < 1e-9 * b, "{a} and {b}");
    let file = hdf5::File::open(&first).expect("result file");
    assert!(file.group("reduced/lower").is_ok() && file.group("reduced/upper").is_err(), "mirror images are kept once");
}

#[test]
fn files_of_other_jobs_are_refused_by_the_keys_that_differ() {
    let folder = Folder::with(sliding().to_string());
    let first = folder.text("first.h5");
    folder.call(1, "run", &["--output", &first]).good();
    let reuse = ["--reuse", first.as_str()];
    for (set, parts) in [
        (
            "bodies.lower.material.young=2e11",
            &["bodies.lower.material.young (205000000000.0 there, 200000000000.0 here)"][..],
        ),
        ("bodies.upper.mesh.cylinder.thickness=0.11", &["bodies.upper.mesh.cylinder.thickness"]),
        ("bodies.upper.fixed=[\"side_plus\"]", &["bodies.upper.fixed"]),
        ("contact.patch.half_width=0.016", &["contact.patch.half_width"]),
        ("analyses.modes.count=13", &["analyses.modes.count (12 there, 13 here)"]),
        ("analyses.stability.full={\"max_frequency\":500}", &["analyses.stability.full"]),
        ("contact.compliance=half_space", &["half_space"]),
    ] {
        let sets = ["--set", set, "--set", "output.fields=false"];
        let sets =
            if set.ends_with("half_space") { [&sets[..], &["--only", "steady"]].concat() } else { sets.to_vec() };
        for ranks in [1, 2] {
            folder.call(ranks, "run", &[&reuse[..], &sets].concat()).failed(2, &[&["--reuse"], parts].concat());
            assert_eq!(folder.listing(), ["first.h5", "job.json"]);
        }
    }
    folder.call(1, "run", &["--reuse", &folder.text("none.h5")]).failed(3, &["none.h5", "cannot read"]);
    let whole = std::fs::read(&first).expect("read");
    std::fs::write(folder.path("torn.h5"), &whole[..whole.len() / 2]).expect("write");
    folder.call(2, "run", &["--reuse", &folder.text("torn.h5")]).failed(3, &["torn.h5"]);
    folder.call(1, "run", &["--output", &folder.text("bare.h5"), "--set", "output.reduced=false"]).good();
    folder
        .call(1, "run", &["--reuse", &folder.text("bare.h5")])
        .failed(3, &["bare.h5", "no reduced model", "output.reduced"]);
}

/// Mesh files count by their contents, wherever they lie.
#[test]
fn mesh_files_are_compared_by_their_contents() {
    let mut job = job("blocks.json");
    let mesh =
        |name: &str| std::fs::read_to_string(format!("{}/meshes/{name}", env!("CARGO_MANIFEST_DIR"))).expect("mesh");
    let folder = Folder::with("");
    for name in ["lower", "upper"] {
        std::fs::write(folder.path(&format!("{name}.msh")), mesh(&format!("block-{name}.msh"))).expect("write");
        job["bodies"][name]["mesh"]["file"] = json!(format!("{name}.msh"));
    }
    job["output"] = json!({ "fields": false });
    std::fs::write(folder.path("job.json"), job.to_string()).expect("write");
    folder.call(1, "run", &["--only", "steady", "--output", &folder.text("first.h5")]).good();
    std::fs::copy(folder.path("upper.msh"), folder.path("moved.msh")).expect("copy");
    let reuse =
        ["--only", "steady", "--reuse", &folder.text("first.h5"), "--output", &folder.text("new.h5"), "--force"];
    folder.call(1, "run", &[&reuse[..], &["--set", "bodies.upper.mesh.file=moved.msh"]].concat()).good();
    std::fs::write(folder.path("lower.msh"), mesh("block-lower.msh") + "\n").expect("write");
    folder.call(1, "run", &reuse).failed(2, &["bodies.lower.mesh.file (", "sha256"]);
}
