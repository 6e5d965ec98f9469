//! A disc that turns between pads that do not: `jobs/disc-and-pads.json`.

use super::program::*;
use super::transient::growth;
use num_complex::Complex64;
use serde_json::{json, Value};
use std::path::Path;

/// The brake with the files of its pads, whose masses and stiffnesses are `factor` times those of the job.
fn brake(factor: f64, change: impl FnOnce(&mut Value)) -> Folder {
    let mut job = job("disc-and-pads.json");
    job["analyses"].as_object_mut().expect("analyses").remove("sweep");
    change(&mut job);
    let folder = Folder::with(job.to_string());
    std::fs::create_dir(folder.path("disc-brake")).unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/disc-brake");
    for name in ["pads.sti", "pads.mas", "pads.dof"] {
        let text = std::fs::read_to_string(data.join(name)).unwrap();
        let scaled = |line: &str| {
            let words: Vec<&str> = line.split_whitespace().collect();
            let value: f64 = words[2].parse().unwrap();
            format!("{} {} {:e}\n", words[0], words[1], factor * value)
        };
        let text = if name == "pads.dof" { text } else { text.lines().map(scaled).collect() };
        std::fs::write(folder.path(&format!("disc-brake/{name}")), text).unwrap();
    }
    folder
}

fn read<T: hdf5::H5Type>(folder: &Folder, name: &str) -> Vec<T> {
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn eigenvalues(folder: &Folder, ranks: usize) -> Vec<Complex64> {
    folder.call(ranks, "run", &["--force"]).good();
    read(folder, "stability/eigenvalue")
}

/// Largest distance of one of `some` to the nearest of `others`, over its size.
fn farthest(some: &[Complex64], others: &[Complex64]) -> f64 {
    let nearest = |a: &Complex64| others.iter().map(|b| (a - b).norm()).fold(f64::INFINITY, f64::min) / a.norm();
    some.iter().map(nearest).fold(0.0, f64::max)
}

/// Each pad with its own force and friction.
fn pads(job: &mut Value, [outer, inner]: [(f64, f64); 2]) {
    for (i, (load, friction)) in [outer, inner].into_iter().enumerate() {
        job["contacts"][i]["normal_load"] = json!(load);
        job["contacts"][i]["friction"] = json!(friction);
    }
}

/// The brake squeals; friction acts on the disc against its rotation, each pad bears its own force, and pads that are
/// mirror images press alike. Two ranks find what one does, and contacts have their names.
#[test]
fn each_pad_bears_its_force_and_two_ranks_find_the_same() {
    let folder = brake(1.0, |_| {});
    let ran = folder.call(1, "run", &[]);
    let said = ["bodies: disc is the lower one and turns", "contact outer pad: 4 cells", "8 closed contacts"];
    said.iter().for_each(|part| assert!(ran.good().out.contains(part), "{}", ran.out));
    let one: Vec<Complex64> = read(&folder, "stability/eigenvalue");
    assert!(one[0].re > 50.0 && one[0].im > 2e4, "{}", one[0]);
    let force: Vec<f64> = read(&folder, "stability/force");
    let wanted = [-1000.0, 0.0, -2000.0, -1000.0, 0.0, -2000.0];
    assert!(force.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{force:?}");
    let pressure: Vec<f64> = read(&folder, "stability/pressure");
    assert!((0..4).all(|i| (pressure[i] / pressure[i + 4] - 1.0).abs() < 1e-9), "{pressure:?}");
    let two = eigenvalues(&folder, 2);
    assert!(one.len() == two.len() && farthest(&one, &two) < 1e-9, "{:e}", farthest(&one, &two));
}

/// The brake seen from its other side has its pads exchanged, and turning the other way it is its own mirror image:
/// the frames of both faces and the sign of what the disc carries.
#[test]
#[ignore = "long: scripts/validate long"]
fn mirror_images_of_the_brake_have_the_same_eigenvalues() {
    let (one, other) = ((1500.0, 0.3), (2500.0, 0.5));
    let found = eigenvalues(&brake(1.0, |job| pads(job, [one, other])), 1);
    let exchanged = eigenvalues(&brake(1.0, |job| pads(job, [other, one])), 1);
    assert!(found.len() > 15 && farthest(&found, &exchanged) < 1e-9, "{:e}", farthest(&found, &exchanged));
    let back = brake(1.0, |job| {
        pads(job, [one, other]);
        job["bodies"]["disc"]["rotation"] = json!(-50);
    });
    let back = eigenvalues(&back, 1);
    assert!(farthest(&found, &back) < 1e-9, "{:e}", farthest(&found, &back));
    let slow = brake(1.0, |job| {
        pads(job, [one, other]);
        job["bodies"]["disc"]["rotation"] = json!(25);
    });
    assert!(farthest(&found, &eigenvalues(&slow, 1)) > 1e-5);
}

/// Pads without mass and stiffness leave the disc its waves, with friction and without: those of the disc by itself,
/// split by its rotation, and at rest its modes.
#[test]
#[ignore = "long: scripts/validate long"]
fn pads_that_weigh_nothing_leave_the_disc_its_waves() {
    for (friction, rotation, split) in [(0.0, 50.0, true), (0.3, 50.0, true), (0.3, 1e-3, false)] {
        let folder = brake(1e-7, |job| {
            job["bodies"]["disc"]["rotation"] = json!(rotation);
            let support = &mut job["bodies"]["pads"]["matrices"]["supports"][0];
            (support["stiffness"], support["damping"]) = (json!([1.6, 1.6, 3.0]), json!([0, 0, 0]));
            pads(job, [(1e-4, friction); 2]);
        });
        let found: Vec<f64> = eigenvalues(&folder, 1).iter().map(|v| v.im / std::f64::consts::TAU).collect();
        let [waves, modes] =
            ["wave_frequency", "frequency"].map(|name| read::<f64>(&folder, &format!("modes/lower/{name}")));
        let off = |wanted: &[f64]| {
            let nearest = |w: &f64| found.iter().map(|f| (f / w - 1.0).abs()).fold(f64::INFINITY, f64::min);
            wanted[..10].iter().map(nearest).fold(0.0, f64::max)
        };
        assert!(off(&waves) < 1e-6, "friction {friction} at {rotation} rad/s: {:e}", off(&waves));
        assert!((off(&modes) > 1e-3) == split, "at {rotation} rad/s: {:e}", off(&modes));
    }
}

/// A disc by its drawing, whose faces are physical curves, is the one by its dimensions but for the meshes.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_drawn_disc_is_that_of_its_dimensions() {
    let built = eigenvalues(&brake(1.0, |_| {}), 1);
    let folder = brake(1.0, |job| {
        let file = json!({ "file": { "path": "disc.msh", "radius": 0.13 } });
        job["bodies"]["disc"]["mesh"]["revolved"]["section"] = file;
    });
    let (along, across) = (20, 4);
    let node = |i: usize, j: usize| 1 + i + (along + 1) * j;
    let mut text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n".to_owned();
    for (k, name) in ["inner", "running", "side_minus", "side_plus"].into_iter().enumerate() {
        text += &format!("1 {} \"{name}\"\n", k + 1);
    }
    text += &format!("2 5 \"disc\"\n$EndPhysicalNames\n$Nodes\n{}\n", node(along, across));
    let mut cells = Vec::new();
    for j in 0..=across {
        for i in 0..=along {
            let [y, r] = [-0.006 + 0.012 * j as f64 / across as f64, 0.07 + 0.06 * i as f64 / along as f64];
            text += &format!("{} {y} {r} 0\n", node(i, j));
            if i < along && j < across {
                let corners = [node(i, j), node(i, j + 1), node(i + 1, j + 1), node(i + 1, j)].map(|n| n.to_string());
                cells.push(format!("3 2 5 5 {}", corners.join(" ")));
            }
        }
    }
    let mut line = |k: usize, a: usize, b: usize| cells.push(format!("1 2 {k} {k} {a} {b}"));
    (0..across).for_each(|j| [(1, 0), (2, along)].iter().for_each(|&(k, i)| line(k, node(i, j), node(i, j + 1))));
    (0..along).for_each(|i| [(3, 0), (4, across)].iter().for_each(|&(k, j)| line(k, node(i, j), node(i + 1, j))));
    text += &format!("$EndNodes\n$Elements\n{}\n", cells.len());
    cells.iter().enumerate().for_each(|(k, cell)| text += &format!("{} {cell}\n", k + 1));
    std::fs::write(folder.path("disc.msh"), text + "$EndElements\n").unwrap();
    let drawn = eigenvalues(&folder, 1);
    let found = farthest(&built[..10], &drawn);
    assert!(built.len() == drawn.len() && found < 4e-3, "{found:e}");
    assert!((drawn[0].re / built[0].re - 1.0).abs() < 0.03, "{} {}", drawn[0], built[0]);
}

/// Sensitivities are the slopes of a sweep, whose points have their own speed and friction.
#[test]
#[ignore = "long: scripts/validate long"]
fn points_of_a_sweep_are_jobs_of_their_own() {
    let step = 1e-4;
    let folder = brake(1.0, |job| {
        let values = json!([0.5 * (1.0 - step), 0.5 * (1.0 + step)]);
        let keys = json!({ "contacts.0.friction": values, "contacts.1.friction": values });
        job["analyses"]["sweep"] = json!({ "keys": keys, "combine": "zip" });
    });
    let first = eigenvalues(&folder, 1)[0];
    let slope: Complex64 = read(&folder, "stability/sensitivity/friction")[0];
    let growth: Vec<f64> = read(&folder, "sweep/growth_rate");
    let by = (growth[1] - growth[0]) / (2.0 * step);
    assert!((by / slope.re - 1.0).abs() < 1e-5, "{by} {slope}");
    assert!((0.5 * (growth[0] + growth[1]) / first.re - 1.0).abs() < 1e-6, "{growth:?} {first}");
    let folder = brake(1.0, |job| {
        job["analyses"]["sweep"] = json!({ "keys": { "bodies.disc.rotation": [20, 50] } });
    });
    let own = eigenvalues(&folder, 1)[0];
    let growth: Vec<f64> = read(&folder, "sweep/growth_rate");
    let slow = eigenvalues(&brake(1.0, |job| job["bodies"]["disc"]["rotation"] = json!(20)), 1)[0];
    assert!([(growth[0], slow), (growth[1], own)].iter().all(|(a, b)| (a / b.re - 1.0).abs() < 1e-8), "{growth:?}");
}

/// Some friction of the outer pad and rotation of the disc, with limit cycles where they are given.
fn uncertain(cycles: Value) -> Value {
    let uniform = |from: f64, to: f64| json!({ "uniform": { "from": from, "to": to } });
    let mut wanted = json!({
        "inputs": [
            { "key": "contacts.0.friction", "distribution": uniform(0.2, 0.6) },
            { "key": "bodies.disc.rotation", "distribution": uniform(10.0, 80.0) }
        ],
        "samples": 4, "method": "latin_hypercube", "indices": false
    });
    if !cycles.is_null() {
        wanted["cycles"] = cycles;
    }
    wanted
}

/// Points of a sweep are followed to their limit cycles: of low friction motion dies out, of high friction it grows.
#[test]
fn points_of_a_sweep_have_limit_cycles() {
    let folder = brake(1.0, |job| {
        let cycles = json!({ "duration": 0.004, "step": 4e-6, "settled": 0.01, "branches": ["mode"] });
        let values = json!([0.1, 0.5]);
        let keys = json!({ "contacts.0.friction": values, "contacts.1.friction": values });
        job["analyses"]["sweep"] = json!({ "keys": keys, "combine": "zip", "cycles": cycles });
    });
    folder.call(2, "run", &[]).good();
    let fate: Vec<i8> = read(&folder, "sweep/cycles/fate");
    let force: Vec<f64> = read(&folder, "sweep/cycles/force");
    assert!(fate.len() == 2 && fate[0] == 0 && fate[1] > 0, "{fate:?}");
    assert!((force[0] + 200.0).abs() < 1.0 && (force[2] + 2000.0).abs() < 1.0 && force[3] < -500.0, "{force:?}");
}

/// Samples of uncertain friction and rotation have the growth rates of single runs.
#[test]
fn samples_are_jobs_of_their_own() {
    let folder = brake(1.0, |job| job["analyses"]["uncertainty"] = uncertain(Value::Null));
    folder.call(2, "run", &[]).good();
    let [friction, rotation] = ["contacts.0.friction", "bodies.disc.rotation"]
        .map(|key| read::<f64>(&folder, &format!("uncertainty/values/{key}")));
    let growth: Vec<f64> = read(&folder, "uncertainty/growth_rate");
    assert!(growth.len() == 4 && growth.iter().any(|g| *g != growth[0]), "{growth:?}");
    let last = eigenvalues(
        &brake(1.0, |job| {
            job["contacts"][0]["friction"] = json!(friction[3]);
            job["bodies"]["disc"]["rotation"] = json!(rotation[3]);
        }),
        1,
    )[0];
    assert!((growth[3] / last.re - 1.0).abs() < 1e-7, "{growth:?} {last}");
}

/// Both pads are alike. Without rotation what one contact moves the other one by is the same from either side. Forces
/// of both on the faces of the disc against each other do not bend it, where those along each other do.
#[test]
fn receptances_are_those_of_each_pad() {
    let folder = brake(1.0, |job| {
        job["bodies"]["disc"]["rotation"] = json!(1e-6);
        job["analyses"]["stability"] = Value::Null;
        job["analyses"]["receptance"] = json!({ "frequency": [0, 1000, 2500], "spread": "uniform" });
    });
    folder.call(1, "run", &[]).good();
    let table = |name: &str| read::<Complex64>(&folder, name);
    let [outer, inner] = ["receptance/lower", "receptance_2/lower"].map(table);
    let [to, fro] = ["receptance/lower_by_2", "receptance_2/lower_by_1"].map(table);
    let pads = ["receptance/upper", "receptance_2/upper"].map(table);
    for f in 0..3 {
        let entry = |of: &[Complex64], i: usize, j: usize| of[9 * f + 3 * i + j];
        let size = entry(&outer, 2, 2).norm();
        let near = |a: Complex64, b: Complex64| (a - b).norm() < 1e-9 * size;
        // y is towards the axle on one face and away from it on the other one.
        let sign = |k: usize| if k == 1 { -1.0 } else { 1.0 };
        for (i, j) in [(0, 0), (0, 2), (1, 1), (1, 2), (2, 0), (2, 2)] {
            let turned = sign(i) * sign(j) * entry(&inner, i, j);
            assert!(near(entry(&outer, i, j), turned), "{f}: {outer:?} {inner:?}");
            assert!(near(entry(&to, i, j), entry(&fro, j, i)), "{f}: {to:?} {fro:?}");
        }
        assert!((entry(&pads[0], 2, 2) - entry(&pads[1], 2, 2)).norm() < 1e-9 * entry(&pads[0], 2, 2).norm());
        // Both normals are into the disc.
        let [squeezed, bent] = [1.0, -1.0].map(|sign| (entry(&outer, 2, 2) + sign * entry(&to, 2, 2)).norm());
        assert!(squeezed < 0.05 * bent, "{f}: {squeezed:e} {bent:e}");
    }
}

/// A small motion decays in time as the eigenvalue says, of a disc that turns so fast that what it carries past its
/// pads counts. The balance of energy holds, and the number of ranks does not matter.
#[test]
fn a_small_motion_decays_as_the_eigenvalue_says() {
    let folder = brake(1.0, |job| {
        pads(job, [(2000.0, 0.1), (2000.0, 0.1)]);
        job["bodies"]["disc"]["rotation"] = json!(500);
        job["analyses"]["transient"] = json!({
            "duration": 0.05, "step": 2e-6, "start": { "mode": 1, "amplitude": 1e-9 }, "modal_stride": 5
        });
    });
    let mut found = Vec::new();
    for (ranks, step) in [(1, 2e-6f64), (2, 1e-6)] {
        let sets = [("step", step), ("modal_stride", (1e-5 / step).round())];
        let sets = sets.map(|(key, value)| format!("analyses.transient.{key}={value}"));
        folder.call(ranks, "run", &["--force", "--set", &sets[0], "--set", &sets[1]]).good();
        let wanted = read::<Complex64>(&folder, "stability/eigenvalue")[0];
        let q: Vec<f64> = read(&folder, "transient/modal_displacement");
        let modes = q.len() / 5000;
        // After what is beside the eigenvector has died away.
        let rows: Vec<Vec<f64>> = q.chunks_exact(modes).skip(2500).map(<[f64]>::to_vec).collect();
        let (rate, frequency) = growth(&rows, 1e-5, wanted.im / std::f64::consts::TAU);
        assert!((rate - wanted.re).abs() < 2e-3 * wanted.re.abs(), "{rate} 1/s, eigenvalue {wanted}");
        found.push(frequency / (wanted.im / std::f64::consts::TAU) - 1.0);
        for group in ["transient", "transient_2"] {
            let force: Vec<f64> = read(&folder, &format!("{group}/force"));
            let last = &force[force.len() - 3..];
            assert!((last[0] + 200.0).abs() < 0.01 && (last[2] + 2000.0).abs() < 0.1, "{group}: {last:?}");
        }
        let [balance, friction] =
            ["balance", "friction_loss"].map(|of| read::<f64>(&folder, &format!("transient/{of}")));
        assert!(balance.last().unwrap().abs() < 1e-9 * friction.last().unwrap(), "{:?}", balance.last());
    }
    // The frequency is low by (hω)²/12.
    assert!((found[0] / found[1] - 4.0).abs() < 0.05, "{found:?}");
}

/// The force of a piston over time presses its pad; the disc squeals then, and what is left of the motion is told where
/// it is beyond what the modes hold.
#[test]
fn pistons_press_over_time() {
    let folder = brake(1.0, |job| {
        let table = |last: f64| json!([[0, 500], [0.004, last]]);
        let histories = json!({ "normal_load": table(2000.0), "further": [{ "normal_load": table(1500.0) }] });
        job["analyses"]["transient"] = json!({ "duration": 0.004, "step": 2e-6, "histories": histories });
    });
    folder.call(2, "run", &[]).good();
    for (group, load) in [("transient", 2000.0), ("transient_2", 1500.0)] {
        let force: Vec<f64> = read(&folder, &format!("{group}/force"));
        let [x, _, z] = force[force.len() - 3..] else { panic!("{group}: no force") };
        assert!((z + load).abs() < 1e-6 * load && (x + 0.5 * load).abs() < 0.01 * load, "{group}: {x} N, {z} N");
    }
    let held = ["analyses.transient.histories=null", "analyses.transient.start={\"mode\": 1, \"amplitude\": 1e-8}"];
    let ran = folder.call(2, "run", &["--force", "--set", held[0], "--set", held[1]]);
    assert!(ran.good().err.contains("the model squeals there, the bodies need not"), "{}", ran.err);
}

/// The brake whose pads are a mesh.
fn meshed(change: impl FnOnce(&mut Value)) -> Folder {
    let mut job = job("disc-and-meshed-pads.json");
    job["analyses"].as_object_mut().expect("analyses").remove("transient");
    job["analyses"]["modes"] = json!({ "max_frequency": 12000 });
    // Half of the cells.
    for contact in 0..2 {
        job["contacts"][contact]["friction"] = json!(0.5);
        let cells = job["contacts"][contact]["cells"].as_array_mut().expect("cells");
        *cells = [0, 3, 4, 7].map(|k| cells[k].clone()).to_vec();
    }
    job["bodies"]["pads"]["mesh"]["file"] = json!({ "path": concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/pads.msh") });
    change(&mut job);
    Folder::with(job.to_string())
}

/// Pads by a mesh bear their forces, alike on both sides, on one rank and on two. Turned about the axle with their
/// cells they are the same brake.
#[test]
fn pads_by_a_mesh_bear_their_forces() {
    let folder = meshed(|_| {});
    let one = eigenvalues(&folder, 1);
    assert!(one.len() > 10 && one[0].re > 0.0, "{one:?}");
    let force: Vec<f64> = read(&folder, "stability/force");
    let wanted = [-1000.0, 0.0, -2000.0, -1000.0, 0.0, -2000.0];
    assert!(force.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{force:?}");
    let pressure: Vec<f64> = read(&folder, "stability/pressure");
    assert!((0..4).all(|i| (pressure[i] / pressure[i + 4] - 1.0).abs() < 1e-9), "{pressure:?}");
    let two = eigenvalues(&folder, 2);
    assert!(farthest(&one, &two) < 1e-9, "{:e}", farthest(&one, &two));
    let turned = eigenvalues(
        &meshed(|job| {
            let turn = json!([{ "rotate": { "axis": [0, 0, 1], "angle": 0.7 } }]);
            job["bodies"]["pads"]["mesh"]["file"]["transform"] = turn;
            for cell in (0..2).flat_map(|i| (0..4).map(move |k| (i, k))) {
                let angle = &mut job["contacts"][cell.0]["cells"][cell.1]["angle"];
                *angle = json!(angle.as_f64().unwrap() + 0.7);
            }
        }),
        1,
    );
    assert!(one.len() == turned.len() && farthest(&one, &turned) < 1e-7, "{:e}", farthest(&one, &turned));
}

/// A rigid pad on springs that are spread evenly over its back, k in all, yields to a force at the distance e from
/// their middle by (1 + e² A/I)/k: means of the cells, their areas and directions.
#[test]
fn a_rigid_pad_yields_as_its_springs() {
    let folder = meshed(|job| {
        job["bodies"]["pads"]["material"]["young"] = json!(8e13);
        job["analyses"]["stability"] = Value::Null;
        job["analyses"]["modes"] = json!({ "count": 12 });
        job["analyses"]["receptance"] = json!({ "frequency": [0], "spread": "uniform" });
    });
    folder.call(1, "run", &[]).good();
    // The back: a sector of a ring.
    let ([r, s], half, k) = ([0.078f64, 0.128], 25f64.to_radians(), 120e6);
    let area = half * (s * s - r * r);
    let middle = 2.0 / 3.0 * (s.powi(3) - r.powi(3)) * half.sin() / area;
    let second = 0.25 * (s.powi(4) - r.powi(4)) * (half + 0.5 * (2.0 * half).sin()) - middle * middle * area;
    let given: Value = serde_json::from_str(&std::fs::read_to_string(folder.path("job.json")).unwrap()).unwrap();
    let (mut at, mut all) = (0.0, 0.0);
    for cell in given["contacts"][0]["cells"].as_array().unwrap() {
        let of = |key: &str| cell[key].as_f64().unwrap();
        let own = cell["half"][0].as_f64().unwrap() * cell["half"][1].as_f64().unwrap();
        at += own * of("radius") * of("angle").cos();
        all += own;
    }
    let off = at / all - middle;
    let wanted = (1.0 + off * off * area / second) / k;
    for group in ["receptance", "receptance_2"] {
        let found: Vec<Complex64> = read(&folder, &format!("{group}/upper"));
        assert!((found[8].re / wanted - 1.0).abs() < 1e-3, "{group}: {} {wanted:e}, {off} m", found[8]);
        // Neither along nor across.
        assert!(found[2].norm() < 1e-6 * wanted && found[5].norm() > 0.0, "{group}: {found:?}");
    }
}

/// Refusals of pads by a mesh that does not lie on the disc.
#[test]
fn a_mesh_of_pads_beside_the_disc_is_refused() {
    type Change = fn(&mut Value);
    let table: [(Change, &[&str]); 10] = [
        (
            |job| drop(job["bodies"]["pads"]["supports"].as_array_mut().unwrap().remove(1)),
            &["bodies.pads.supports", "nothing holds the pad with the node"],
        ),
        (|job| drop(job["contacts"][0].as_object_mut().unwrap().remove("pad_face")), &["contacts.0.pad_face: missing"]),
        (|job| job["contacts"][0]["pad_face"] = json!("outer"), &["contacts.0.pad_face", "outer_back"]),
        (|job| job["contacts"][1]["pad_face"] = json!("outer_face"), &["contacts.1.cells.0", "outer_face"]),
        (
            |job| job["contacts"][0]["cells"][3]["angle"] = json!(0.4),
            &["contacts.0.cells.3", "no surface there", "z = 0.006"],
        ),
        (
            |job| {
                let step = json!([{ "translate": [0, 0, 1e-3] }]);
                job["bodies"]["pads"]["mesh"]["file"]["transform"] = step;
            },
            &["contacts.0.cells.0", "1.0000 mm away from the disc"],
        ),
        (|job| job["contacts"][0]["cells"][0]["node"] = json!(3), &["contacts.0.cells.0.node", "leave it out"]),
        (|job| job["bodies"]["pads"]["supports"] = json!([]), &["bodies.pads.supports", "nothing holds the pads"]),
        (|job| job["bodies"]["pads"]["rotation"] = json!(3), &["bodies.pads.rotation", "do not turn"]),
        (
            |job| {
                job["bodies"]["pads"]["mesh"] = json!({ "cylinder": {
                "inner_radius": 0.05, "outer_radius": 0.1, "thickness": 0.1, "element_size": 0.02
            } })
            },
            &["bodies.pads", "mesh.file"],
        ),
    ];
    for (change, parts) in table {
        // A group that is missing is a fault of the file.
        let code = if parts.contains(&"outer_back") { 3 } else { 2 };
        meshed(change).refused(1, &[], code, parts);
    }
}

/// Refusals name the key, and say what to do, of all that is not computed of a disc between pads.
#[test]
fn what_a_disc_between_pads_has_not_is_refused() {
    type Change = fn(&mut Value);
    let table: [(Change, &[&str]); 23] = [
        (|job| job["analyses"]["steady"] = json!({}), &["analyses.steady", "modes, stability, transient"]),
        (
            |job| job["analyses"]["transient"] = json!({ "duration": 1e-3, "step": 1e-6, "model": "full" }),
            &["analyses.transient.model", "leave it out"],
        ),
        (
            |job| job["analyses"]["transient"] = json!({ "duration": 1e-3, "step": 1e-6, "sound_power": {} }),
            &["analyses.transient.sound_power", "leave it out"],
        ),
        (
            |job| {
                let histories = json!({ "further": [{ "lateral": [[0, 0], [1, 0.1]] }] });
                job["analyses"]["transient"] = json!({ "duration": 1e-3, "step": 1e-6, "histories": histories });
            },
            &["analyses.transient.histories.further.0.lateral", "expected normal_load"],
        ),
        (
            |job| {
                job["analyses"]["sweep"] =
                    json!({ "keys": { "contacts.0.friction": [0.1] }, "cycles": { "along": "x" } })
            },
            &["analyses.sweep.cycles.along"],
        ),
        (
            |job| job["analyses"]["stability"]["full"] = json!({ "max_frequency": 5000 }),
            &["analyses.stability.full", "leave it out"],
        ),
        (|job| job["analyses"]["stability"]["state"] = json!("steady"), &["analyses.stability.state", "sliding"]),
        (|job| job["analyses"]["stability"]["contact"] = json!("point"), &["analyses.stability.contact"]),
        (|job| job["bodies"]["disc"]["rotation"] = json!(2e4), &["bodies.disc.rotation 20000 rad/s", "at most 0.3"]),
        (|job| job["bodies"]["disc"]["rotation"] = json!("rolling"), &["bodies.disc.rotation", "rad/s"]),
        (|job| job["bodies"]["disc"]["fixed"] = json!([]), &["bodies.disc.fixed", "clamp its bore"]),
        (
            |job| job["bodies"]["disc"]["mesh"]["revolved"]["section"] = json!("W920S"),
            &["bodies.disc.mesh.revolved.section", "\"cylinder\" or a \"file\""],
        ),
        (
            |job| {
                let contact = json!([{ "node": 1, "normal": "z", "tangential": ["x", "y"] }]);
                job["bodies"]["pads"]["matrices"]["contacts"] = contact;
            },
            &["bodies.pads.matrices.contacts", "leave them out"],
        ),
        (|job| job["bodies"]["caliper"] = job["bodies"]["pads"].clone(), &["bodies.caliper", "no contact names it"]),
        (|job| job["contact"] = json!({ "friction": 0.3 }), &["contact: given beside contacts"]),
        (
            |job| (0..2).for_each(|i| job["contacts"][i]["between"] = json!(["pads", "disc"])),
            &["contacts.0.between", "expected the disc first"],
        ),
        (|job| job["contacts"][1]["name"] = json!("outer pad"), &["contacts.1.name", "given twice"]),
        (|job| job["contacts"][0]["face"] = json!("outer"), &["contacts.0.face", "a flat face across the axle"]),
        (
            |job| job["contacts"][0]["cells"][2]["radius"] = json!(0.125),
            &["contacts.0.cells.2", "expected a cell within it"],
        ),
        (
            |job| job["contacts"][0]["cells"][2]["radius"] = json!(0.095),
            &["contacts.0.cells.2", "overlaps an earlier cell"],
        ),
        (|job| job["contacts"][0]["cells"][2]["node"] = json!(1), &["contacts.0.cells.2.node", "found 1 twice"]),
        (|job| job["contacts"][0]["cells"][2]["node"] = json!(99_999), &["contacts.0.cells.2.node", "99999"]),
        (|job| drop(job.as_object_mut().unwrap().remove("contacts")), &["bodies.disc: unknown key", "contacts"]),
    ];
    for (change, parts) in table {
        brake(1.0, change).refused(1, &[], 2, parts);
    }
    let folder = brake(1.0, |_| {});
    folder.call(1, "run", &[]).good();
    let model = folder.text("job.h5");
    folder
        .call(1, "run", &["--force", "--reuse", &model, "--output", &folder.text("again.h5")])
        .failed(2, &["--reuse"]);
}
