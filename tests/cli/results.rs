//! Work with results, and jobs to begin with: the report, the comparison, pictures of a stopped run, `init`.

use super::program::*;
use super::transient::sliding;
use serde_json::{json, Value};
use std::process::Command;

const GOLDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/two-cylinders.h5");

/// The package of this checkout and the Python of its tests, wherever the program was built.
fn program(arguments: &[&str]) -> Ran {
    let root = env!("CARGO_MANIFEST_DIR");
    let mut command = Command::new(PROGRAM);
    command.env("OPENBLAS_NUM_THREADS", "1").env("PYTHONPATH", format!("{root}/python"));
    let venv = format!("{root}/.venv/bin/python");
    if std::path::Path::new(&venv).exists() {
        command.env("RAILSQUEAL_PYTHON", venv);
    }
    finish(command.args(arguments))
}

#[test]
fn jobs_to_begin_with_are_valid_and_replace_nothing() {
    let names = [
        "two-cylinders",
        "own-mesh",
        "sweep",
        "squeal",
        "wheel-on-rail",
        "wheel-on-rail-contact",
        "bogie",
        "drawn-wheel",
        "drawn-rail",
        "drawn-wheelset",
        "friction-modifier",
        "twin-disc",
    ];
    let help = program(&["init", "--help"]);
    for name in names {
        assert!(help.good().out.contains(name), "{name}: {}", help.out);
        let folder = tempfile::tempdir().expect("temporary folder");
        let init = || finish(Command::new(PROGRAM).current_dir(&folder).args(["init", name]));
        let job = format!("{name}.json");
        let said = init();
        assert!(said.good().out.contains(&format!("railsqueal check {job}")), "{}", said.out);
        let path = folder.path().join(&job);
        // What the job names lies beside it, its schema too.
        let written: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).expect("job")).expect("JSON");
        let schema = folder.path().join(written["$schema"].as_str().expect("a schema"));
        let schema: serde_json::Value = serde_json::from_slice(&std::fs::read(schema).expect("schema")).expect("JSON");
        assert!(schema["properties"]["bodies"].is_object());
        assert!(program(&["check", &path.display().to_string()]).good().out.contains("estimated memory"), "{name}");
        std::fs::write(&path, "mine").expect("write");
        init().failed(2, &[&job, "is there already"]);
        assert_eq!(std::fs::read_to_string(&path).expect("job"), "mine");
    }
}

/// A mesh of the user's own stays, and then no job is written either.
#[test]
fn a_mesh_that_is_there_stays() {
    let folder = Folder::with("{}");
    std::fs::write(folder.path("block-lower.msh"), "mine").expect("write");
    let job = folder.text("own.json");
    program(&["init", "own-mesh", "--output", &job]).failed(2, &["block-lower.msh", "is there already"]);
    assert_eq!(folder.listing(), ["block-lower.msh", "job.json"]);
}

#[test]
fn a_report_is_one_page_with_tables_beside_it() {
    let folder = Folder::with("{}");
    let out = folder.text("out");
    let ran = program(&["report", GOLDEN, "--out", &out]);
    ran.good();
    let names = ["report.html", "figures.csv", "modes.csv", "eigenvalues.csv", "unstable.csv", "forces.csv"]
        .map(|n| format!("two-cylinders-{n}"));
    assert_eq!(ran.out.lines().filter_map(|l| l.rsplit('/').next()).collect::<Vec<_>>(), names);
    let page = std::fs::read_to_string(folder.path("out").join(&names[0])).expect("page");
    assert!(page.starts_with("<!DOCTYPE html>") && page.matches("data:image/png;base64,").count() == 2);
    program(&["report", &folder.text("none.h5")]).failed(3, &["none.h5"]);
}

#[test]
fn results_are_compared() {
    let folder = Folder::with("{}");
    let other = folder.path("other.h5");
    std::fs::copy(GOLDEN, &other).expect("copy");
    let compare = |more: &[&str]| program(&[&["compare", GOLDEN, &folder.text("other.h5")], more].concat());
    assert!(compare(&[]).good().out.contains("the results agree"));
    // The file is locked as long as anything of it is open.
    {
        let file = hdf5::File::open_rw(&other).expect("file");
        let approach = file.dataset("contact/approach").expect("approach");
        let before: f64 = approach.read_scalar().expect("read");
        approach.write_scalar(&(before * (1.0 + 1e-4))).expect("write");
    }
    let differs = compare(&[]);
    assert!(differs.code == Some(1) && differs.out.contains("* approach"), "{differs:?}");
    compare(&["--tolerance", "1e-3"]).good();
    program(&["compare", GOLDEN, &folder.text("none.h5")]).failed(2, &["none.h5"]);
}

#[test]
fn without_python_it_is_said_what_to_install() {
    let ran = finish(Command::new(PROGRAM).env("RAILSQUEAL_PYTHON", "/bin/false").args(["report", GOLDEN]));
    ran.failed(2, &["/bin/false", "pip install", "RAILSQUEAL_PYTHON"]);
}

#[test]
fn a_stopped_run_is_drawn_as_far_as_it_came() {
    let points = json!([{ "name": "rim", "body": "upper", "at": [0.5, -0.02, 0.5] }]);
    let job = sliding(json!({ "duration": 0.1, "segment": 200, "contact_stride": 10, "points": points }));
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &["--wall-time", "1e-3"]).failed(5, &["stopped by the limit of wall time"]);
    assert!(!folder.path("job.h5").exists());
    let ran = program(&["plot", &folder.text("job.h5"), "--format", "svg"]);
    assert!(ran.good().out.contains("job-growth.svg") && folder.path("job-growth.svg").exists(), "{ran:?}");
    // It is heard as well.
    let sound = |more: &[&str]| program(&[&["sound", &folder.text("job.h5")], more].concat());
    let ran = sound(&["--point", "rim", "--out", &folder.text("rim.wav")]);
    assert!(ran.good().out.contains("rim.wav"), "{}", ran.out);
    let wave = std::fs::read(folder.path("rim.wav")).expect("a sound file");
    // A segment of 2 ms at 44.1 kHz, 16 bit, behind a head of 44 bytes.
    assert!(wave.len() > 44 + 2 * 80 && wave.starts_with(b"RIFF") && wave[8..12] == *b"WAVE");
    sound(&["--point", "hub"]).failed(2, &["'hub'", "rim"]);
}

/// The summary is printed again from the file, and fields become files of other programs.
#[test]
fn summary_and_fields_come_out_of_a_result() {
    let folder = Folder::with(small().to_string());
    let ran = folder.call(1, "run", &["--only", "steady"]);
    let again = program(&["summary", &folder.text("job.h5")]);
    let lines = ran.good().out.lines().filter(|line| !line.starts_with("results: "));
    assert_eq!(again.good().out.lines().collect::<Vec<_>>(), lines.collect::<Vec<_>>());
    // A result of an earlier program has a verdict all the same.
    let earlier = program(&["summary", GOLDEN]);
    assert!(earlier.good().out.starts_with("No squeal found up to "), "{}", earlier.out);
    let out = folder.text("out");
    for (format, names) in [("vtu", &["job.vtu"][..]), ("xdmf", &["job.xdmf", "job.xdmf.h5"])] {
        let ran = program(&["export", &folder.text("job.h5"), "--format", format, "--out", &out]);
        for name in names {
            assert!(ran.good().out.contains(name) || folder.path("out").join(name).exists(), "{name}: {ran:?}");
        }
    }
    assert!(std::fs::read_to_string(folder.path("out/job.vtu")).expect("a file").contains("\"pressure\""));
    program(&["export", &folder.text("job.h5"), "--format", "stl"]).failed(2, &["stl", "vtu"]);
    program(&["sound", &folder.text("job.h5")]).failed(3, &["analyses.transient"]);
    for (command, option) in [("sound", "--point"), ("export", "xdmf"), ("summary", "FILE.h5")] {
        assert!(program(&[command, "--help"]).good().out.contains(option), "{command}");
    }
}

/// The surfaces of meshes before a run: written, drawn, written again; nothing else is replaced; and written too
/// where the job is refused.
#[test]
fn meshes_are_shown_before_a_run() {
    let mut job: Value = serde_json::from_slice(include_bytes!("../../jobs/blocks.json")).expect("a job");
    for (body, file) in [("lower", "block-lower.msh"), ("upper", "block-upper.msh")] {
        job["bodies"][body]["mesh"] = json!({ "file": format!("{}/meshes/{file}", env!("CARGO_MANIFEST_DIR")) });
    }
    let folder = Folder::with(job.to_string());
    let file = folder.text("job.mesh.vtkhdf");
    let check = |more: &[&str]| program(&[&["check", &folder.text("job.json")], more].concat());
    check(&["--mesh", &file]).good();
    check(&["--mesh", &file]).good();
    let ran = program(&["plot", &file, "--format", "svg"]);
    assert!(ran.good().out.contains("job-surfaces.svg") && folder.path("job-surfaces.svg").exists(), "{ran:?}");
    let read = hdf5::File::open(folder.path("job.mesh.vtkhdf")).expect("a file");
    let offsets = read.dataset("VTKHDF/Offsets").and_then(|d| d.read_raw::<i64>()).expect("offsets");
    let group = read.dataset("VTKHDF/CellData/group").and_then(|d| d.read_raw::<i32>()).expect("groups");
    assert_eq!(offsets.len(), group.len() + 1);
    drop(read);
    check(&["--mesh", &folder.text("job.h5")]).failed(2, &["job.h5", ".vtkhdf"]);
    std::fs::write(folder.path("other.vtkhdf"), "mine").expect("a file of another kind");
    check(&["--mesh", &folder.text("other.vtkhdf")]).failed(2, &["other.vtkhdf"]);
    assert_eq!(std::fs::read(folder.path("other.vtkhdf")).expect("still there"), b"mine");
    // Above where a lower body should be.
    std::fs::remove_file(folder.path("job.mesh.vtkhdf")).expect("a file");
    let wrong = r#"bodies.lower.mesh={"file": {"path": "PATH", "transform": [{"translate": [0, 0, 0.05]}]}}"#;
    let wrong = wrong.replace("PATH", concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/block-lower.msh"));
    let ran = check(&["--mesh", &file, "--set", &wrong]);
    assert!(ran.code == Some(3) && folder.path("job.mesh.vtkhdf").exists(), "{ran:?}");
    program(&["check", &format!("{}/jobs/wheel-at-given-yaw.json", env!("CARGO_MANIFEST_DIR")), "--mesh", &file])
        .failed(2, &["--mesh", "no body"]);
}

#[test]
fn a_shell_and_man_are_told_of_the_commands() {
    assert!(program(&["completion", "bash"]).good().out.contains("wheel-on-rail-contact"));
    assert!(program(&["man"]).good().out.starts_with(".ie"));
}

/// Each run that a page shows is one the program would begin.
#[test]
fn pages_show_what_there_is() {
    let ran = script("documents.py", &["check", PROGRAM]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.out, ran.err);
}

/// The macro for ParaView shows the contact that the file has: both bodies' cells between closed nodes. Only where
/// ParaView is installed.
#[test]
fn the_macro_shows_the_contact_in_paraview() {
    let root = env!("CARGO_MANIFEST_DIR");
    if Command::new("pvpython").arg("--version").output().is_err() {
        return;
    }
    let folder = Folder::with("{}");
    let result = folder.text("own.h5");
    let job = format!("{root}/jobs/two-cylinders.json");
    let size = |body: &str| format!("bodies.{body}.mesh.cylinder.element_size=0.002");
    let sizes = [size("lower"), size("upper")];
    let line = ["run", &job, "--only", "steady", "--output", &result, "--set", &sizes[0], "--set", &sizes[1]];
    program(&line).good();
    let closed = {
        let file = hdf5::File::open(&result).expect("result");
        let shape: Vec<i64> = file.dataset("contact/shape").expect("shape").read_raw().expect("read");
        let state: Vec<i8> = file.dataset("contact/state").expect("state").read_raw().expect("read");
        let (nx, ny) = (shape[0] as usize, shape[1] as usize);
        let closed = |i: usize, j: usize| state[j * nx + i] > 0;
        let cell = |i: usize, j: usize| closed(i, j) && closed(i + 1, j) && closed(i, j + 1) && closed(i + 1, j + 1);
        (0..ny - 1).map(|j| (0..nx - 1).filter(|&i| cell(i, j)).count()).sum::<usize>()
    };
    let script = format!("{root}/scripts/paraview/contact.py");
    // By its reader, and by its name alone.
    for name in [result, folder.text("own.hdf")] {
        let ran = finish(Command::new("pvpython").args([&script, &name]));
        assert!(
            closed > 0 && ran.good().out.contains(&format!("contact: {} cells", 2 * closed)),
            "{closed} {}",
            ran.out
        );
    }
}

/// The mesh that `section` makes of a drawing is one that a job takes, and what is wrong with a drawing has its exit
/// code.
#[test]
fn section_of_a_drawing_is_taken_by_a_job() {
    let root = env!("CARGO_MANIFEST_DIR");
    let mut job = job("drawn-wheel.json");
    job["bodies"]["lower"] = json!({ "profile": "60E1", "material": job["bodies"]["lower"]["material"] });
    job["bodies"]["upper"]["mesh"]["revolved"]["section"]["file"] = json!({ "path": "wheel.msh", "radius": 0.46 });
    let folder = Folder::with(job.to_string());
    let (drawing, mesh) = (format!("{root}/meshes/wheel-outline.dxf"), folder.text("wheel.msh"));
    let make = ["section", &drawing, "--kind", "wheel", "--size", "0.012", "--output", &mesh, "--origin", "-0.0", "0"];
    let said = program(&make);
    assert!(said.good().out.contains("\"radius\": 0.46"), "{}", said.out);
    folder.call(1, "check", &[]).good();
    program(&make).failed(2, &["wheel.msh", "is there already"]);
    program(&["section", &folder.text("none.dxf"), "--kind", "wheel"]).failed(3, &["none.dxf", "no such file"]);
    program(&["section", &drawing, "--kind", "wheel", "--unit", "in"]).failed(2, &["--unit in", "says mm"]);
}
