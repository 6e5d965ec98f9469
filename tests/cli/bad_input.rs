//! Job files and inputs that are wrong: the exit code, the message, and nothing left behind.

use super::program::*;
use serde_json::{json, Value};

/// `run` on this text must fail like this on 1 rank and on 2, and leave nothing behind.
#[track_caller]
fn refused(text: impl AsRef<[u8]>, args: &[&str], code: i32, parts: &[&str]) {
    let folder = Folder::with(text);
    for ranks in [1, 2] {
        folder.call(ranks, "run", args).failed(code, parts);
        folder.untouched();
    }
}

/// The same where it fails when modes and compliance are made: these are kept.
#[track_caller]
fn refused_late(text: impl AsRef<[u8]>, code: i32, parts: &[&str]) {
    let folder = Folder::with(text);
    folder.call(2, "run", &[]).failed(code, parts);
    assert_eq!(folder.listing(), ["job.json", "job.model.h5", "job.model.shapes.h5"]);
}

/// The small job with one key set is refused with exit code 2, by `check` as by `run`.
#[track_caller]
fn refused_key(path: &str, value: Value, parts: &[&str]) {
    let mut job = small();
    *job.pointer_mut(path).unwrap_or_else(|| panic!("no {path} in the job")) = value;
    let folder = Folder::with(job.to_string());
    for command in ["run", "check"] {
        folder.call(1, command, &[]).failed(2, parts);
        folder.untouched();
    }
}

#[test]
fn unknown_key() {
    let mut job = small();
    job["contact"]["fricton"] = json!(0.3);
    refused(job.to_string(), &[], 2, &["job.json: contact.fricton: unknown key; did you mean \"friction\"?"]);
    let set = ["--set", "contact.patch.half_lenght=0.01"];
    refused(small().to_string(), &set, 2, &["contact.patch.half_lenght: unknown key; did you mean \"half_length\"?"]);
}

#[test]
fn wrong_types_and_values() {
    refused_key("/contact/speed", json!("fast"), &["contact.speed: found the string \"fast\", expected a number"]);
    refused_key("/contact/speed", json!(0), &["contact.speed: found 0, expected a number > 0 (m/s)"]);
    let lower = "/bodies/lower/material";
    refused_key(&format!("{lower}/young"), json!(-205e9), &["lower.material.young: found -205000000000.0"]);
    refused_key(&format!("{lower}/density"), json!(0), &["density: found 0, expected a number > 0 (kg/m³)"]);
    refused_key(&format!("{lower}/poisson"), json!(0.5), &["poisson: found 0.5, expected a number > -1 and < 0.5"]);
}

/// A set of Abaqus is found whatever its case, one of Gmsh by its letters; who is not found is told where such a name
/// is given.
#[test]
fn names_of_groups_depend_on_case_in_gmsh_alone() {
    let root = env!("CARGO_MANIFEST_DIR");
    let with = |file: &str, fixed: &str| {
        let mut job = job("annulus.json");
        job["bodies"]["lower"]["mesh"] = json!({ "file": format!("{root}/{file}") });
        job["bodies"]["lower"]["fixed"] = json!([fixed]);
        job["analyses"]["modes"]["count"] = json!(3);
        Folder::with(job.to_string())
    };
    let frequencies = |fixed: &str| {
        let folder = with("tests/data/inp/hex20.inp", fixed);
        folder.call(1, "run", &[]).good();
        let file = hdf5::File::open(folder.path("job.h5")).expect("a result");
        file.dataset("modes/lower/frequency").and_then(|d| d.read_raw::<f64>()).expect("frequencies")
    };
    let found = frequencies("BOTTOM");
    assert!(found[0] > 1.0 && found == frequencies("bottom"), "{found:?}");
    for command in ["check", "run"] {
        let deck = with("tests/data/inp/hex20.inp", "Sole").call(1, command, &[]);
        deck.failed(3, &["bodies.lower.fixed", "hex20.inp", "no group \"sole\"", "\"bottom\"", "*SURFACE"]);
        assert!(!deck.err.contains("Gmsh"), "{}", deck.err);
        let gmsh = with("meshes/block-lower.msh", "BASE").call(1, command, &[]);
        gmsh.failed(3, &["block-lower.msh", "no group \"BASE\"", "\"base\"", "physical group in Gmsh"]);
    }
    let support = r#"bodies.lower.supports=[{"group": "CONTACT", "stiffness": {"x": 1e8}}]"#;
    with("tests/data/inp/hex20.inp", "bottom").refused(
        1,
        &["--set", support],
        2,
        &["bodies.lower.supports.0.group", "contact surface"],
    );
}

#[test]
fn a_load_that_nothing_bears() {
    let mut job = small();
    job["bodies"]["lower"]["fixed"] = json!([]);
    job["bodies"]["lower"]["supports"] = json!([{ "group": "inner", "stiffness": { "x": 1e8, "z": 1e8 } }]);
    let parts =
        ["bodies.lower.supports: rigid motions left free: 1", "analyses.steady is a static problem", "add springs"];
    refused(job.to_string(), &[], 2, &parts);
    job["bodies"]["lower"]["supports"] = json!([]);
    refused(job.to_string(), &[], 2, &["bodies.lower.fixed: no fixed support", "hang the body on springs"]);
}

#[test]
fn not_a_number() {
    let text = small().to_string().replace("205000000000.0", "NaN");
    assert!(text.contains("NaN"));
    refused(text, &[], 2, &["line 1, column", "NaN and Infinity are not JSON", "^"]);
}

#[test]
fn impossible_cylinders() {
    let cylinder = "/bodies/lower/mesh/cylinder";
    let of = |key: &str| format!("{cylinder}/{key}");
    refused_key(&of("inner_radius"), json!(0.5), &["inner_radius: found 0.5 m, expected less than outer_radius"]);
    refused_key(&of("crown_radius"), json!(0.02), &["crown_radius: found 0.02 m, expected more than 0.05 m"]);
    refused_key(&of("contact_offset"), json!(0.06), &["contact_offset: found 0.06 m"]);
    refused_key(&of("thickness"), json!(-0.1), &["thickness: found -0.1, expected a number > 0 (m)"]);
}

#[test]
fn absurdly_small_elements() {
    for size in [1e-5, 1e-9, 1e-300] {
        let mut job = small();
        for body in ["lower", "upper"] {
            job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(size);
        }
        let folder = Folder::with(job.to_string());
        let ran = folder.call(1, "run", &[]);
        ran.failed(2, &["element_size"]);
        folder.untouched();
    }
}

#[test]
fn more_than_the_memory() {
    let args = ["--set", "solver.memory_limit=1e7"];
    refused(small().to_string(), &args, 7, &["needs about", "solver.memory_limit gives 10 MB", "element_size"]);
    // Fine enough that no machine holds the dense compliance of the patch, but not absurd: refused before meshing.
    let mut job = small();
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(5e-5);
    }
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(ran.code == Some(7) || ran.code == Some(2), "{ran:?}");
    assert!(!ran.err.contains("meshing"), "{ran:?}");
    folder.untouched();
}

#[test]
fn broken_files() {
    let whole = small().to_string();
    refused("", &[], 2, &["job.json: the file is empty"]);
    refused(&whole[..whole.len() / 2], &[], 2, &["truncated"]);
    refused("[".repeat(1_000_000), &[], 2, &["nested too deeply"]);
    refused(b"{\"title\": \"\xff\"}", &[], 2, &["not UTF-8"]);
    refused(b"\0\0\0\0", &[], 2, &["line 1, column 1"]);
}

#[test]
fn missing_files() {
    for ranks in [1, 2] {
        railsqueal(ranks, &["run", "no/such/job.json"]).failed(2, &["no/such/job.json", "No such file"]);
    }
    railsqueal(1, &["run", "/"]).failed(2, &["cannot read the job file"]);
    let mut job = job("annulus.json");
    job["bodies"]["lower"]["mesh"] = json!({ "file": "ring.msh" });
    refused(job.to_string(), &[], 3, &["ring.msh"]);
}

#[test]
fn wrong_mesh_files() {
    let mesh = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/block-lower.msh")).expect("mesh");
    let folder = Folder::with(small().to_string());
    let mut job = job("blocks.json");
    job["bodies"]["upper"]["mesh"]["file"] = json!(concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/block-upper.msh"));
    job["bodies"]["lower"]["mesh"]["file"] = json!("lower.msh");
    let cases: [(String, &[&str]); 4] = [
        (mesh[..mesh.len() / 2].to_string(), &["lower.msh"]),
        (mesh.replacen("4.1 0 8", "4.0 0 8", 1), &["lower.msh", "4.0", "4.1", "2.2"]),
        (mesh.replace("\"base\"", "\"floor\""), &["bodies.lower.fixed", "\"base\"", "\"floor\""]),
        (String::new(), &["lower.msh"]),
    ];
    std::fs::write(folder.path("job.json"), job.to_string()).expect("write the job");
    for (i, (text, parts)) in cases.iter().enumerate() {
        assert_ne!(*text, mesh, "case {i} changes the mesh");
        std::fs::write(folder.path("lower.msh"), text).expect("write the mesh");
        for ranks in [1, 2] {
            folder.call(ranks, "run", &[]).failed(3, parts);
            assert_eq!(folder.listing(), ["job.json", "lower.msh"]);
        }
    }
}

#[test]
fn no_fixed_support_with_a_static_solve() {
    refused_key("/bodies/upper/fixed", json!([]), &["bodies.upper.fixed: no fixed support", "analyses.steady"]);
}

#[test]
fn patch_smaller_than_the_contact() {
    let mut job = small();
    job["analyses"] = json!({ "steady": {} });
    job["contact"]["normal_load"] = json!(2e6);
    let parts = ["contact.patch", "half_length", "half_width", "needs about", "enlarge"];
    refused(job.to_string(), &[], 2, &parts);
    // Before anything is factorised, and by `check` as well.
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    ran.failed(2, &parts);
    assert!(ran.err.contains("examining the job") && !ran.err.contains("factorisation"), "{}", ran.err);
    folder.refused(1, &[], 2, &parts);
}

#[test]
fn load_beyond_small_strain() {
    for (key, value) in [("normal_load", 1e9), ("normal_load", 1e300), ("approach", 0.05)] {
        let mut job = small();
        job["contact"].as_object_mut().expect("contact").remove("normal_load");
        job["contact"][key] = json!(value);
        refused(job.to_string(), &[], 2, &[&format!("contact.{key}"), "small strain"]);
    }
}

/// No job file makes the program panic or leave something behind, whatever is done to its bytes.
#[test]
fn mutated_jobs() {
    let text = small().to_string();
    let mut state = 12345u64;
    let mut below = |n: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) % n as u64) as usize
    };
    for _ in 0..25 {
        let mut bytes = text.clone().into_bytes();
        for _ in 0..3 {
            let at = below(bytes.len());
            match below(3) {
                0 => bytes[at] = below(256) as u8,
                1 => drop(bytes.remove(at)),
                _ => bytes.insert(at, b"0123456789.eE-+\"[]{},:"[below(22)]),
            }
        }
        let folder = Folder::with(&bytes);
        let ran = folder.call(1, "check", &[]);
        let shown = String::from_utf8_lossy(&bytes);
        assert!(matches!(ran.code, Some(0 | 2 | 3 | 7)), "{ran:?} for {shown}");
        assert!(!ran.err.contains("internal defect") && !ran.err.contains("panic"), "{ran:?} for {shown}");
        folder.untouched();
    }
}

/// Special files are not waited for, and counts too large to enumerate are made in closed form.
#[test]
fn inputs_that_would_take_for_ever() {
    let fifo = |folder: &Folder, name: &str| {
        let made = std::process::Command::new("mkfifo").arg(folder.path(name)).status();
        assert!(made.expect("mkfifo").success());
    };
    let mut job = small();
    job["analyses"] = json!({ "steady": {} });
    job["bodies"]["lower"]["mesh"] = json!({ "file": "lower.msh" });
    let folder = Folder::with(job.to_string());
    fifo(&folder, "lower.msh");
    fifo(&folder, "fifo.json");
    for command in ["run", "check"] {
        folder.call(1, command, &[]).failed(3, &["lower.msh", "a FIFO, expected a regular file"]);
        railsqueal(2, &[command, &folder.text("fifo.json")]).failed(2, &["fifo.json", "a FIFO"]);
    }
    let size = ["lower", "upper"].map(|b| format!("bodies.{b}.mesh.cylinder.element_size=1e-12"));
    let growth = ["lower", "upper"].map(|b| format!("bodies.{b}.mesh.cylinder.growth=1.0000001"));
    let folder = Folder::with(small().to_string());
    let sets = ["--set", &size[0], "--set", &size[1], "--set", &growth[0], "--set", &growth[1]];
    folder.refused(1, &sets, 2, &["element_size", "would fit"]);
    let long =
        ["--set", "bodies.lower.mesh.cylinder.thickness=5000", "--set", "bodies.lower.mesh.cylinder.crown_radius=null"];
    folder.refused(1, &[&long[..], &sets[4..]].concat(), 2, &["bodies.lower.mesh", "would fit"]);
    let transient = ["--set", "analyses.transient={\"duration\": 1e308}"];
    folder.refused(1, &transient, 2, &["analyses.transient.duration", "1e308 s", "at most 999999999999", "1.000e7 s"]);
    let mut job = super::program::job("hulten.json");
    for key in ["mass", "damping", "stiffness"] {
        job["bodies"]["lower"]["matrices"][key] = json!("huge.mtx");
    }
    let folder = Folder::with(job.to_string());
    let text = "%%MatrixMarket matrix coordinate real general\n100000000 100000000 1\n1 1 2.0\n";
    std::fs::write(folder.path("huge.mtx"), text).expect("write");
    for command in ["run", "check"] {
        folder.call(1, command, &[]).failed(3, &["huge.mtx: line 2", "100000000 rows with 1 entries"]);
    }
    // One that does not fit the others is found by both.
    std::fs::write(folder.path("huge.mtx"), "%%MatrixMarket matrix array real general\n1 1\n2.0\n").expect("write");
    let other = std::fs::read(format!("{}/jobs/hulten/stiffness.mtx", env!("CARGO_MANIFEST_DIR"))).expect("read");
    std::fs::write(folder.path("k.mtx"), other).expect("write");
    for command in ["run", "check"] {
        let sets = ["--set", "bodies.lower.matrices.stiffness=k.mtx"];
        folder.call(1, command, &sets).failed(3, &["huge.mtx", "order 1", "k.mtx is of order 4"]);
    }
}

/// The arc of so long a patch is longer than its chord by more than an element.
#[test]
fn a_patch_that_bends_with_the_wheel() {
    let mut job = small();
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(0.008);
    }
    job["contact"]["patch"] = json!({ "half_length": 0.2, "half_width": 0.016 });
    job["output"] = json!({ "fields": false, "reduced": false });
    let folder = Folder::with(job.to_string());
    folder.call(1, "check", &[]).good();
    folder.call(1, "run", &["--only", "steady"]).good();
}

/// Stability needs modes, a creepage and a frequency range that the modes reach.
#[test]
fn stability_without_what_it_needs() {
    let mut job = small();
    job["contact"]["creepage"] = json!({});
    job["analyses"] = json!({ "stability": { "direction": "rigid" } });
    refused(
        job.to_string(),
        &[],
        2,
        &["analyses.modes: missing", "contact.creepage", "direction of sliding is undefined"],
    );
    // Spin alone has a pole inside the contact, where nothing slides.
    let mut job = small();
    job["contact"]["creepage"] = json!({ "spin": 0.5 });
    job["analyses"] = json!({ "modes": { "count": 5 }, "stability": { "direction": "rigid" } });
    refused_late(job.to_string(), 2, &["contact.creepage: no creep at the closed node", "pole"]);
    let mut job = small();
    job["analyses"] = json!({ "modes": { "count": 5 }, "stability": { "max_frequency": 1e5 } });
    refused_late(job.to_string(), 2, &["analyses.stability.max_frequency", "reach", "more modes"]);
    job["analyses"]["stability"] = json!({ "phases": 6 });
    refused(job.to_string(), &[], 2, &["analyses.stability.phases", "multiple of 4"]);
    job["analyses"]["stability"] = json!({ "state": "steady", "direction": "rigid" });
    refused(job.to_string(), &[], 2, &["analyses.stability.direction: found \"rigid\"", "the state \"sliding\""]);
    // At this creepage part of the contact sticks.
    job["analyses"]["stability"] = json!({ "full": { "max_frequency": 500 } });
    refused_late(job.to_string(), 2, &["analyses.stability.full: ", "closed nodes stick"]);
    job["analyses"]["stability"] = json!({ "direction": "rigid", "full": { "max_frequency": 1e5 } });
    refused_late(job.to_string(), 2, &["analyses.stability.full.max_frequency", "reaches", "more modes"]);
    job["analyses"]["stability"]["full"]["max_frequency"] = json!(500);
    // The truncation of five modes is seen.
    job["bodies"]["upper"]["damping"] = json!({});
    job["analyses"]["stability"]["full"]["agreement"] = json!(1e-12);
    refused_late(job.to_string(), 4, &["full.agreement", "Hz"]);
}

/// Flat on each other as they are, blocks touch at their edges; that they are in millimetres is said all the same.
#[test]
fn meshes_in_millimetres_whose_contact_cannot_be_say_so() {
    let mut job = job("two-cylinders.json");
    for body in ["lower", "upper"] {
        let path = format!("{}/meshes/block-lower.msh", env!("CARGO_MANIFEST_DIR"));
        job["bodies"][body]["mesh"] = json!({ "file": { "path": path, "scale": 1000.0 } });
        job["bodies"][body]["fixed"] = json!(["base"]);
    }
    let turned = json!([{ "rotate": { "axis": [1.0, 0.0, 0.0], "angle": std::f64::consts::PI } }]);
    job["bodies"]["upper"]["mesh"]["file"]["transform"] = turned;
    job["contact"].as_object_mut().expect("contact").remove("patch");
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "check", &[]);
    ran.failed(2, &["contact.patch: the contact reaches the border", "bodies.lower: ", "bodies.upper: "]);
    assert_eq!(ran.err.matches("is the mesh in mm").count(), 2, "{}", ran.err);
}
