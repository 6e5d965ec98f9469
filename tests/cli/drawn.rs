//! Bodies swept from drawings, in whole runs.

use super::program::*;
use serde_json::{json, Value};
use std::fmt::Write;

/// The section of the cylinders of `jobs/swept-curve.json`, in mm, x along the axle from the mid-plane:
/// quadrilaterals of 9 nodes, `n` times `m` of them, the running line on the crown's arc about its apex at `apex`.
fn drawing(n: usize, m: usize, apex: f64) -> String {
    let (rows, columns) = (2 * n + 1, 2 * m + 1);
    let tag = |i: usize, j: usize| i * columns + j + 1;
    let mut text = String::from(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n1 1 \"running\"\n1 2 \
     \"bore\"\n2 3 \"steel\"\n$EndPhysicalNames\n",
    );
    writeln!(text, "$Nodes\n{}", rows * columns).expect("text");
    for i in 0..rows {
        for j in 0..columns {
            // Finer at the bore and at the tread, where the stress is steep.
            let s = i as f64 / (rows - 1) as f64;
            let s = 0.5 - 0.5 * (std::f64::consts::PI * s).cos();
            let x = -50.0 + 100.0 * j as f64 / (columns - 1) as f64;
            let outer = 500.0 - (500.0 - (500.0f64.powi(2) - (x - apex).powi(2)).sqrt());
            writeln!(text, "{} {x} {} 0", tag(i, j), 100.0 + (outer - 100.0) * s).expect("text");
        }
    }
    let mut elements = Vec::new();
    for j in (0..columns - 1).step_by(2) {
        for (group, i) in [(2, 0), (1, rows - 1)] {
            elements.push(format!("8 2 {group} {group} {} {} {}", tag(i, j), tag(i, j + 2), tag(i, j + 1)));
        }
        for i in (0..rows - 1).step_by(2) {
            let at = [[0, 0], [0, 2], [2, 2], [2, 0], [0, 1], [1, 2], [2, 1], [1, 0], [1, 1]];
            let nodes: Vec<String> = at.iter().map(|[a, b]| tag(i + a, j + b).to_string()).collect();
            elements.push(format!("10 2 3 1 {}", nodes.join(" ")));
        }
    }
    writeln!(text, "$EndNodes\n$Elements\n{}", elements.len()).expect("text");
    elements.iter().enumerate().for_each(|(k, e)| writeln!(text, "{} {e}", k + 1).expect("text"));
    text + "$EndElements\n"
}

/// `jobs/swept-curve.json` on a coarser contact with fewer modes.
fn coarse() -> Value {
    let mut job = job("swept-curve.json");
    job["analyses"]["modes"]["count"] = json!(14);
    job["contact"]["patch"] = json!({ "half_length": 0.0075, "half_width": 0.0075, "spacing": 0.0015 });
    job
}

/// The same with both sections from files.
fn drawn(folder: &Folder) -> Value {
    let mut job = coarse();
    for body in ["lower", "upper"] {
        let revolved = &mut job["bodies"][body]["mesh"]["revolved"];
        let ring = revolved["section"]["cylinder"].clone();
        assert_eq!(
            [&ring["inner_radius"], &ring["outer_radius"], &ring["thickness"], &ring["crown_radius"]],
            [0.1, 0.5, 0.1, 0.5]
        );
        let apex = 1e3 * revolved["contact_offset"].as_f64().unwrap_or(0.0);
        std::fs::write(folder.path(&format!("{body}.msh")), drawing(16, 8, apex)).expect("a drawing");
        revolved["section"] =
            json!({ "file": { "path": format!("{body}.msh"), "scale": 0.001, "radius": 0.5, "crown": 0.5 } });
        job["bodies"][body]["fixed"] = json!(["bore"]);
    }
    job
}

fn numbers(folder: &Folder, file: &str, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path(file)).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// A section from a file rolls as the built-in one: frequencies, compliance, forces, growth; on two ranks as on one,
/// and the file is among what the result came from.
#[test]
fn a_drawn_section_rolls_as_the_built_in_one() {
    let folder = Folder::with(coarse().to_string());
    folder.call(1, "run", &["--output", &folder.text("built.h5")]).good();
    std::fs::write(folder.path("job.json"), drawn(&folder).to_string()).expect("a job");
    folder.call(1, "check", &[]).good();
    folder.call(1, "run", &["--output", &folder.text("one.h5")]).good();
    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    let of = |name: &str| ["built.h5", "one.h5", "two.h5"].map(|file| numbers(&folder, file, name));
    let near = |a: &[f64], b: &[f64], limit: f64, what: &str| {
        let scale = a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / scale;
        assert!(a.len() == b.len() && off <= limit, "{what}: {off:e}\n{a:?}\n{b:?}");
    };
    for (name, limit) in [
        ("modes/lower/frequency", 5e-4),
        ("modes/upper/frequency", 5e-4),
        ("reduced/lower/compliance", 1e-3),
        ("reduced/upper/compliance", 1e-3),
    ] {
        let [built, one, two] = of(name);
        near(&built, &one, limit, name);
        near(&one, &two, 1e-10, name);
    }
    let [built, one, _] = of("stability/growth_rate");
    near(&built[..3], &one[..3], 0.01, "growth");
    let file = hdf5::File::open(folder.path("one.h5")).expect("result file");
    let inputs = file.dataset("provenance/input_files").and_then(|d| d.read_raw::<hdf5::types::VarLenUnicode>());
    assert!(inputs.expect("inputs").iter().any(|name| name.ends_with("lower.msh")));
}

/// Physical surfaces of a drawing have materials of their own: the tyre turns on its rubber as rings do, with the loss
/// factor of the rubber, and the mass is that of both.
#[test]
fn a_drawn_wheel_has_layers() {
    let folder = Folder::with("{}");
    let mut job = drawn(&folder);
    let text = drawing(16, 8, 0.0).replace("$PhysicalNames\n3\n", "$PhysicalNames\n4\n2 4 \"rubber\"\n");
    // Elements of the middle row, counted from the bore, between 300 and 339.2 mm.
    let mut faces = 0;
    let in_rubber = |line: &str| match line.split_once(" 10 2 3 1 ") {
        Some((number, nodes)) => {
            faces += 1;
            let group = if (faces - 1) % 16 == 8 { 4 } else { 3 };
            format!("{number} 10 2 {group} 1 {nodes}\n")
        }
        None => format!("{line}\n"),
    };
    std::fs::write(folder.path("lower.msh"), text.lines().map(in_rubber).collect::<String>()).expect("a drawing");
    job["bodies"]["lower"]["mesh"]["revolved"]["contact_offset"] = json!(0);
    let file = &mut job["bodies"]["lower"]["mesh"]["revolved"]["section"]["file"];
    file.as_object_mut().expect("keys").remove("crown");
    file["layers"] = json!([{
        "group": "rubber", "material": { "young": 2e7, "poisson": 0.45, "density": 1000 }, "loss_factor": 0.1
    }]);
    let bodies = job["bodies"].as_object_mut().expect("bodies");
    bodies.remove("upper");
    job.as_object_mut().expect("a job").remove("contact");
    job["analyses"] = json!({ "modes": { "max_frequency": 100 } });
    std::fs::write(folder.path("job.json"), job.to_string()).expect("a job");
    folder.call(1, "run", &[]).good();
    let inner = 100.0 + 400.0 * (0.5 - 0.5 * (std::f64::consts::PI * 8.0 / 16.0).cos());
    let outer = 100.0 + 400.0 * (0.5 - 0.5 * (std::f64::consts::PI * 9.0 / 16.0).cos());
    assert!((inner - 300.0f64).abs() < 1e-9 && outer > inner);
    // Torsion: the ring between a and b has the stiffness 4πGw/(1/a² − 1/b²).
    let (a, b, width) = (1e-3 * inner, 1e-3 * outer, 0.1);
    let stiffness = 4.0 * std::f64::consts::PI * 2e7 / 2.9 * width / (1.0 / (a * a) - 1.0 / (b * b));
    let density = job["bodies"]["lower"]["material"]["density"].as_f64().expect("a density");
    let moment = |from: f64, to: f64| 0.5 * std::f64::consts::PI * width * (to.powi(4) - from.powi(4));
    let inertia = density * moment(b, 0.5) + 1000.0 * moment(a, b) / 3.0;
    let wanted = (stiffness / inertia).sqrt() / (2.0 * std::f64::consts::PI);
    let found = numbers(&folder, "job.h5", "modes/lower/frequency");
    // The crown takes half a per cent of the moment of inertia away.
    assert!(found.iter().any(|f| (f / wanted - 1.0).abs() < 0.01), "{wanted} Hz: {found:?}");
    let key = "bodies.lower.mesh.revolved.section.file.layers.0.group";
    folder.refused(1, &["--set", &format!("{key}=tyre")], 2, &["layers.0.group", "tyre", "\"rubber\""]);
    folder.refused(1, &["--set", &format!("{key}=steel")], 2, &["section.file.layers", "running line"]);
}

#[test]
fn what_a_drawing_lacks_is_said() {
    let folder = Folder::with("{}");
    let good = drawn(&folder);
    let fails = |change: &dyn Fn(&mut Value), says: &[&str]| {
        let mut job = good.clone();
        change(&mut job);
        std::fs::write(folder.path("job.json"), job.to_string()).expect("a job");
        for command in ["check", "run"] {
            folder
                .call(2, command, &["--force"][..usize::from(command == "run")])
                .failed(if says[0] == "read" { 3 } else { 2 }, &says[1..]);
        }
    };
    let section = |job: &mut Value| job["bodies"]["upper"]["mesh"]["revolved"]["section"]["file"].take();
    let set = |key: &'static str, value: Value| {
        move |job: &mut Value| {
            let mut file = section(job);
            file[key] = value.clone();
            job["bodies"]["upper"]["mesh"]["revolved"]["section"]["file"] = file;
        }
    };
    fails(&set("radius", json!(0.46)), &["job", "section.file.radius", "found 0.46 m", "has the radius 0.5"]);
    fails(&set("scale", json!(1.0)), &["job", "section.file.radius", "found 0.5 m", "499.6"]);
    fails(&set("running", json!("tread")), &["read", "no physical curve \"tread\"", "bore, running"]);
    fails(&set("path", json!("nowhere.msh")), &["read", "nowhere.msh", "cannot be read"]);
    fails(
        &|job: &mut Value| job["bodies"]["upper"]["fixed"] = json!(["inner"]),
        &["job", "no group \"inner\"", "\"bore\""],
    );
    fails(
        &|job: &mut Value| job["bodies"]["upper"]["fixed"] = json!(["running"]),
        &["job", "bodies.upper.fixed.0", "running line"],
    );
    fails(
        &|job: &mut Value| job["bodies"]["upper"]["mesh"]["revolved"]["contact_offset"] = json!(0.06),
        &["job", "y = 0.06 m", "from -0.05 to 0.05 m"],
    );
}

/// The rail of `jobs/drawn-rail.json`, with modes up to 1.2 kHz.
fn worn() -> Value {
    let mut job = job("drawn-rail.json");
    let drawing = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/rail-section.msh");
    job["bodies"]["lower"]["mesh"]["extruded"]["section"]["file"]["path"] = json!(drawing);
    job["analyses"]["modes"] = json!({ "max_frequency": 1200 });
    job
}

/// 60E1 whose head is 8 mm lower: lighter by those 8 mm of a head 72 mm wide. Its forces are those of the same
/// profiles.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_worn_rail_carries_the_wheel() {
    let folder = Folder::with(worn().to_string());
    let said = folder.call(2, "run", &["--output", &folder.text("worn.h5")]);
    said.good();
    let mut built = worn();
    built["bodies"]["lower"]["mesh"]["extruded"]["section"] = json!("60E1");
    std::fs::write(folder.path("job.json"), built.to_string()).expect("a job");
    let new = folder.call(2, "run", &["--output", &folder.text("new.h5")]);
    new.good();
    let mass = |out: &str| -> f64 {
        let line = out.lines().find(|l| l.contains("body lower: rail")).expect("a line on the rail");
        let words: Vec<&str> = line.split_whitespace().collect();
        words[words.iter().position(|w| *w == "kg/m").expect("its mass") - 1].parse().expect("a number")
    };
    let lighter = mass(&new.out) - mass(&said.out);
    assert!((lighter / (7860.0 * 8e-3 * 72e-3) - 1.0).abs() < 0.03, "{lighter} kg/m");
    let of = |name: &str| ["worn.h5", "new.h5"].map(|file| numbers(&folder, file, name));
    let [worn, new] = of("contact/force");
    let worst = worn.iter().zip(&new).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 5e-3 * new[2].abs(), "{worn:?} {new:?}");
    // Waves in the rail go with √(EI/m): nearly as many.
    let [worn, new] = of("modes/lower/frequency");
    let (count, wanted) = (worn.len() as f64, new.len() as f64);
    assert!(count > 0.9 * wanted && count < 1.2 * wanted, "{count} {wanted}");
}

#[test]
fn what_a_drawn_rail_lacks_is_said() {
    let folder = Folder::with("{}");
    let fails = |key: &str, value: Value, code: i32, says: &[&str]| {
        let mut job = worn();
        job["bodies"]["lower"]["mesh"]["extruded"]["section"]["file"][key] = value;
        std::fs::write(folder.path("job.json"), job.to_string()).expect("a job");
        folder.refused(2, &[], code, says);
    };
    fails("foot", json!("base"), 3, &["no physical curve \"base\"", "foot"]);
    fails("running", json!("head"), 3, &["no physical curve \"head\"", "foot, running"]);
    fails("scale", json!(0.01), 2, &["area", "section.file.scale"]);
    fails("path", json!("nowhere.msh"), 3, &["nowhere.msh", "cannot be read"]);
    fails("radius", json!(0.3), 2, &["radius"]);
}
