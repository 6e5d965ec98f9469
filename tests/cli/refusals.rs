//! Refusals of `check` are refusals of `run`, by the same code; warnings of it come once; what wrong files say cannot
//! steer a terminal.

use super::program::*;
use serde_json::{json, Value};
use std::f64::consts::PI;

/// The blocks of `jobs/blocks.json` with keys of the mesh of one body.
fn blocks(body: &str, keys: Value) -> Value {
    let mut job = job("blocks.json");
    for (name, file) in [("lower", "block-lower.msh"), ("upper", "block-upper.msh")] {
        let path = format!("{}/meshes/{file}", env!("CARGO_MANIFEST_DIR"));
        job["bodies"][name]["mesh"]["file"] = json!({ "path": path });
    }
    for (key, value) in keys.as_object().into_iter().flatten() {
        job["bodies"][body]["mesh"]["file"][key] = value.clone();
    }
    job
}

fn moved(by: [f64; 3]) -> Value {
    json!({ "transform": [{ "translate": by }] })
}

/// Bodies that are not in their place, and other kinds of faults that only a mesh shows.
#[test]
fn meshes_that_check_refuses_are_refused_by_run() {
    let over = json!({ "transform": [{ "rotate": { "axis": [1, 0, 0], "angle": PI, "about": [0, 0, 0] } }] });
    let table: [(&str, Value, i32, &[&str]); 6] = [
        ("lower", moved([0.0, 0.0, -0.02]), 3, &["bodies.lower.mesh.file", "z = -0.020000 m", "transform"]),
        ("upper", moved([0.0, 0.0, 0.005]), 3, &["bodies.upper.mesh.file", "z = 0.005", "contact point at the origin"]),
        ("lower", moved([0.1, 0.0, 0.0]), 3, &["bodies.lower.mesh.file", "x = 0.0", "contact point at the origin"]),
        ("upper", moved([0.0, 0.0, -5e-4]), 3, &["the bodies overlap by", "move the meshes along z"]),
        ("lower", over, 3, &["bodies.lower.mesh.file", "contact point at the origin"]),
        ("lower", json!({ "scale": 0.001 }), 3, &["contact"]),
    ];
    for (body, keys, code, parts) in table {
        let folder = Folder::with(blocks(body, keys).to_string());
        folder.refused(1, &[], code, parts);
    }
    // On two ranks, with one message.
    Folder::with(blocks("lower", moved([0.0, 0.0, -0.02])).to_string()).refused(2, &[], 3, &["z = -0.020000 m"]);
    let folder = Folder::with(blocks("lower", json!({})).to_string());
    folder.refused(1, &["--set", "analyses.modes.count=100000"], 2, &["analyses.modes.count", "degrees of freedom"]);
    folder.call(1, "check", &[]).good();
    folder.call(1, "run", &[]).good();
}

/// A point of a sweep whose body is beside the contact point fails; the others have their results.
#[test]
fn points_of_a_sweep_are_examined_like_the_job() {
    let mut job = blocks("lower", json!({}));
    let file = job["bodies"]["lower"]["mesh"]["file"]["path"].clone();
    let beside = json!({ "path": file, "transform": [{ "translate": [0, 0, -0.02] }] });
    let keys = json!({ "bodies.lower.mesh.file": [{ "path": file }, beside] });
    job["analyses"] = json!({ "modes": { "count": 4 }, "stability": {}, "sweep": { "keys": keys } });
    job["output"] = json!({ "fields": false });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).failed(4, &["1 of 2 points", "z = -0.020000 m"]);
    let file = hdf5::File::open(folder.path("job.h5")).expect("results");
    let status: Vec<i32> = file.dataset("sweep/status").and_then(|d| d.read_raw()).expect("status");
    assert_eq!(status, [0, 3]);
}

/// Warnings about doubtful results come from both, once each.
#[test]
fn warnings_of_check_come_once_in_run() {
    let mut job = small();
    job["analyses"] = json!({ "steady": {} });
    let folder = Folder::with(job.to_string());
    let (checked, ran) = (folder.call(1, "check", &[]), folder.call(1, "run", &[]));
    let said = |text: &str| text.matches("fewer than 40").count();
    assert_eq!(said(&checked.good().out), 1, "{}", checked.out);
    assert_eq!((said(&ran.good().out), said(&ran.err)), (1, 1), "{ran:?}");
    // On the model of that run as well, whose bodies are not made.
    let [first, again] = ["job.h5", "again.h5"].map(|name| folder.text(name));
    let fields = ["--set", "output.fields=false", "--reuse", &first, "--output", &again];
    let reused = folder.call(1, "run", &fields);
    assert_eq!(said(&reused.good().out), 1, "{}", reused.out);
    assert!(!reused.err.contains("meshing"), "{}", reused.err);
}

/// `curving` solves as well, and takes no job that `check` refuses.
#[test]
fn curving_refuses_what_check_refuses() {
    let job = job("wheel-on-rail.json");
    let folder = Folder::with(job.to_string());
    let heavy = json!([{
        "place": "rim", "count": 24, "mass": 4000, "direction": "axial", "frequency": 1500, "loss_factor": 0.1
    }]);
    let set = format!("bodies.upper.absorbers={heavy}");
    let parts = ["bodies.upper: absorbers", "far less than the wheel"];
    folder.refused(1, &["--set", &set], 2, &parts);
    folder.call(1, "curving", &["--set", &set]).failed(2, &parts);
    folder.call(1, "curving", &[]).good();
}

/// Colours, titles, cursor movements and reversed text of wrong files come out as escapes.
#[test]
fn control_characters_of_wrong_files_are_escaped() {
    const EVIL: &str = "\u{1b}]0;owned\u{7}\u{1b}[2J\u{9b}31m\u{202e}";
    let root = env!("CARGO_MANIFEST_DIR");
    let deck = std::fs::read_to_string(format!("{root}/tests/data/inp/hex20.inp")).expect("a deck");
    let mesh = std::fs::read_to_string(format!("{root}/meshes/block-lower.msh")).expect("a mesh");
    let annulus = |file: &str, fixed: &str| {
        let mut job = job("annulus.json");
        job["bodies"]["lower"]["mesh"] = json!({ "file": file });
        job["bodies"]["lower"]["fixed"] = json!([fixed]);
        job
    };
    let mut rough = job("rough-cylinders.json");
    rough["contact"]["roughness"]["upper"] = json!([{ "file": { "path": "r.txt" } }]);
    let mut profile = job("wheel-on-rail-contact.json");
    profile["bodies"]["upper"]["profile"] = json!({ "file": { "path": "p.csv" } });
    let mut matrices = job("hulten.json");
    for key in ["mass", "damping", "stiffness"] {
        matrices["bodies"]["lower"]["matrices"][key] = json!("m.mtx");
    }
    let mut key = small();
    key["contact"][EVIL] = json!(1);
    let mut word = small();
    word["contact"]["compliance"] = json!(EVIL);
    let mut group = annulus("a.inp", EVIL);
    group["title"] = json!(EVIL);
    let cases: [(&str, Value, &str, String); 10] = [
        ("a table of roughness", rough.clone(), "r.txt", format!("0.0 1.0\n0.1 {EVIL}\n")),
        ("its headings", rough, "r.txt", format!("{EVIL},{EVIL}\n0.0,1.0\n0.1,1.0\n")),
        ("a profile", profile, "p.csv", format!("-70 1\n-69 {EVIL}\n")),
        (
            "a set of a deck",
            annulus("a.inp", "nobody"),
            "a.inp",
            deck.replace("ELSET=bottom", &format!("ELSET={EVIL}")),
        ),
        (
            "a number of a deck",
            annulus("a.inp", "bottom"),
            "a.inp",
            deck.replacen("0.3, 0.2, 0\n", &format!("0.3, {EVIL}, 0\n"), 1),
        ),
        ("a group of a mesh", annulus("a.msh", "nobody"), "a.msh", mesh.replace("\"base\"", &format!("\"{EVIL}\""))),
        ("a matrix", matrices, "m.mtx", format!("%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 {EVIL}\n")),
        ("a key", key, "none", String::new()),
        ("a word", word, "none", String::new()),
        ("a name in the job", group, "a.inp", deck.clone()),
    ];
    for (what, job, name, text) in cases {
        let folder = Folder::with(job.to_string());
        std::fs::write(folder.path(name), text).expect("write");
        for command in ["check", "run"] {
            let ran = folder.call(1, command, &[]);
            assert!(matches!(ran.code, Some(2 | 3)), "{what}: {ran:?}");
            for steers in ['\u{1b}', '\u{7}', '\u{9b}', '\u{202e}'] {
                assert!(!ran.err.contains(steers) && !ran.out.contains(steers), "{what}: {ran:?}");
            }
            assert!(ran.err.contains("u{1b}") || ran.err.contains("?]0;owned"), "{what} is not quoted: {}", ran.err);
        }
    }
}
