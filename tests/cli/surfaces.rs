//! Meshes whose surfaces do not match, and meshes on a placement, in whole runs.

use super::program::*;
use serde_json::{json, Value};
use std::fmt::Write;

fn numbers(folder: &Folder, file: &str, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path(file)).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The paper's cylinders with elements of the `sizes` at the contact, large ones elsewhere, on patches of the half
/// side `half`, m.
fn cylinders(sizes: [f64; 2], half: f64) -> Value {
    let mut job = small();
    for (body, size) in ["lower", "upper"].into_iter().zip(sizes) {
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(size);
    }
    job["contact"]["patch"] = json!({ "half_length": half, "half_width": half });
    job["output"] = json!({ "fields": false });
    job
}

/// Three numbers of each of two result files, relative to the largest one of the first.
#[track_caller]
fn alike(folder: &Folder, [a, b]: [&str; 2], name: &str, tolerance: f64) {
    let (a, b) = (numbers(folder, a, name), numbers(folder, b, name));
    let size = a.iter().take(3).fold(0.0f64, |m, v| m.max(v.abs()));
    for (a, b) in a.iter().zip(&b).take(3) {
        assert!((a - b).abs() < tolerance * size, "{name}: {a} {b}, of {size}");
    }
}

/// A common grid with lines where no mesh has them: forces, approach and the three largest growth rates of the same
/// bodies on the nodes of their meshes. Of Hertz' approach nodes have somewhat more, and means about the nodes of a
/// grid of five spacings in the half axis somewhat less.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_common_grid_has_what_matching_nodes_have() {
    let mut job = cylinders([7e-4, 7e-4], 7e-3);
    job["bodies"]["lower"]["mesh"]["cylinder"]["contact_offset"] = json!(0.02);
    job["contact"]["creepage"]["lateral"] = json!(0.01);
    job["analyses"] = json!({ "modes": { "count": 8 }, "steady": {}, "stability": {} });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &["--output", &folder.text("matched.h5")]).good();
    let grid = r#"contact.grid={"half_length":6.6e-3,"half_width":6.6e-3,"spacing":1.1e-3}"#;
    let said = folder.call(1, "check", &["--set", grid]);
    assert!(said.good().out.contains("contact grid: 13 x 13 nodes, 1.100 mm apart"), "{}", said.out);
    folder.call(1, "run", &["--set", grid, "--output", &folder.text("common.h5")]).good();
    let tolerances = [("contact/force", 1e-3), ("contact/approach", 1.5e-2), ("stability/growth_rate", 3e-2)];
    tolerances.into_iter().for_each(|(name, t)| alike(&folder, ["matched.h5", "common.h5"], name, t));
}

/// Elements of unlike sizes meet on a common grid without being asked to by more than that: the same forces on one
/// and two ranks, and those of meshes that match, whose nodes yield 1 % more where they are 1 mm apart. ParaView has
/// the contact on cells of the grid.
#[test]
fn meshes_that_differ_roll_as_matching_ones() {
    let mut job = cylinders([1e-3, 1e-3], 8e-3);
    job["analyses"] = json!({ "steady": {} });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &["--output", &folder.text("matched.h5")]).good();
    job["bodies"]["upper"]["mesh"]["cylinder"]["element_size"] = json!(8e-4);
    job["contact"]["grid"] = json!({ "half_length": 7e-3, "half_width": 7e-3, "spacing": 1e-3 });
    job["output"]["fields"] = json!(true);
    std::fs::write(folder.path("job.json"), job.to_string()).expect("a job");
    for (ranks, file) in [("1", "one.h5"), ("2", "two.h5")] {
        folder.call(ranks.parse().expect("a number"), "run", &["--output", &folder.text(file)]).good();
        script("check_grid.py", &[&folder.text(file), ranks, "displacement"]).good();
    }
    for (name, tolerance) in [("contact/force", 5e-3), ("contact/approach", 2e-2)] {
        alike(&folder, ["matched.h5", "one.h5"], name, tolerance);
        alike(&folder, ["one.h5", "two.h5"], name, 1e-7);
    }
}

/// Cells of 10 mm, twice the half width of the contact, with the compliance "hybrid": CONTACT's lateral force of the
/// paper's cylinders, −0.7177, within 0.5 %, on one and on two ranks.
#[test]
fn coarse_cells_roll_as_contact_does() {
    let mut job = cylinders([0.01, 0.01], 0.04);
    job["contact"]["compliance"] = json!("hybrid");
    job["analyses"] = json!({ "steady": {} });
    job["output"]["fields"] = json!(true);
    let folder = Folder::with(job.to_string());
    for ranks in [1, 2] {
        let ran = folder.call(ranks, "run", &["--force"]);
        assert!(ran.good().out.contains("means over a disc of 25.00 mm"), "{}", ran.out);
        let force = numbers(&folder, "job.h5", "contact/force");
        let coefficient = force[1] / (0.3 * force[2].abs());
        assert!((coefficient / -0.7177 - 1.0).abs() < 5e-3, "{ranks} ranks: {coefficient}");
        script("check_grid.py", &[&folder.text("job.h5"), &ranks.to_string()]).good();
    }
}

/// Half the section of the ring of [`wheel`], in m from its axle: radii 0.25 to 0.46, width 0.08; nodes from the bore
/// outwards, across, and twice as many as cells and one more.
const RADII: [f64; 5] = [0.25, 0.32, 0.39, 0.43, 0.46];
const ACROSS: [f64; 9] = [-0.04, -0.026, -0.012, 0.0, 0.008, 0.016, 0.024, 0.032, 0.04];

fn twice(line: &[f64]) -> Vec<f64> {
    let between = line.windows(2).flat_map(|w| [w[0], 0.5 * (w[0] + w[1])]);
    between.chain(line.last().copied()).collect()
}

/// A drawing of the section: quadrilaterals of 9 nodes, x along the axle.
fn section() -> String {
    let (r, y) = (twice(&RADII), twice(&ACROSS));
    let tag = |i: usize, j: usize| i * y.len() + j + 1;
    let mut nodes = String::new();
    let places = r.iter().flat_map(|r| y.iter().map(move |y| (r, y)));
    places.enumerate().for_each(|(k, (r, y))| writeln!(nodes, "{} {y} {r} 0", k + 1).expect("text"));
    let mut elements = Vec::new();
    for j in (0..y.len() - 1).step_by(2) {
        for (group, i) in [(2, 0), (1, r.len() - 1)] {
            elements.push(format!("8 2 {group} {group} {} {} {}", tag(i, j), tag(i, j + 2), tag(i, j + 1)));
        }
        for i in (0..r.len() - 1).step_by(2) {
            let at = [[0, 0], [0, 2], [2, 2], [2, 0], [0, 1], [1, 2], [2, 1], [1, 0], [1, 1]];
            let nodes: Vec<String> = at.iter().map(|[a, b]| tag(i + a, j + b).to_string()).collect();
            elements.push(format!("10 2 3 1 {}", nodes.join(" ")));
        }
    }
    file(["1 1 \"running\"", "1 2 \"bore\"", "2 3 \"steel\""], &nodes, r.len() * y.len(), &elements)
}

/// A file of Gmsh, version 2.2.
fn file(names: [&str; 3], nodes: &str, count: usize, elements: &[String]) -> String {
    let mut text = format!(
        "$MeshFormat\n2.2 0 \
     8\n$EndMeshFormat\n$PhysicalNames\n3\n{}\n$EndPhysicalNames\n$Nodes\n{count}\n{nodes}$EndNodes\n$Elements\n{}\n",
        names.join("\n"),
        elements.len()
    );
    elements.iter().enumerate().for_each(|(k, e)| writeln!(text, "{} {e}", k + 1).expect("text"));
    text + "$EndElements\n"
}

/// Angles of the corners over π, from the contact point at the bottom.
const AROUND: [f64; 16] = [0.0, 0.02, 0.045, 0.08, 0.13, 0.2, 0.28, 0.36, 0.44, 0.52, 0.6, 0.68, 0.76, 0.84, 0.92, 1.0];

/// The ring of that section in three dimensions, standing on the running circle: hexahedra of 20 nodes, small ones
/// about the contact.
fn wheel() -> String {
    ring(&RADII, &ACROSS, &AROUND)
}

/// The rim of a wheel with cells of 2.9 mm where a contact that is 14 mm beside the running circle reaches: nodes
/// 1.45 mm apart.
fn fine_rim() -> String {
    let radii = [0.36, 0.42, 0.445, 0.456, 0.46];
    // The flange is towards +y, so that is the other side.
    let fine = (0..=16).map(|k| 9.3e-3 - 2.9e-3 * f64::from(16 - k));
    let across: Vec<f64> = [-0.04].into_iter().chain(fine).chain([0.022, 0.04]).collect();
    let near = (0..=8).map(|k| 2e-3 * f64::from(k));
    let far = [0.024, 0.05, 0.1, 0.2, 0.32, 0.44, 0.56, 0.68, 0.8, 0.9, 1.0];
    ring(&radii, &across, &near.chain(far).collect::<Vec<f64>>())
}

/// A ring of hexahedra of 20 nodes between radii, m, places across, m, and angles over π on either side of the
/// contact point.
fn ring(radii: &[f64], across: &[f64], half: &[f64]) -> String {
    let (r, y) = (twice(radii), twice(across));
    let all = half[1..].iter().rev().map(|v| -v).chain(half.iter().copied()).map(|v| v * std::f64::consts::PI);
    let mut angles = twice(&all.collect::<Vec<f64>>());
    angles.pop();
    let mut tags = std::collections::BTreeMap::new();
    let mut nodes = String::new();
    let mut elements = Vec::new();
    let mut tag = |k: usize, i: usize, j: usize| -> usize {
        let next = tags.len() + 1;
        let k = k % angles.len();
        *tags.entry((k, i, j)).or_insert_with(|| {
            let (sin, cos) = angles[k].sin_cos();
            writeln!(nodes, "{next} {:.17e} {:.17e} {:.17e}", r[i] * sin, y[j], 0.46 - r[i] * cos).expect("text");
            next
        })
    };
    for k in (0..angles.len()).step_by(2) {
        for j in (0..y.len() - 1).step_by(2) {
            for i in (0..r.len() - 1).step_by(2) {
                // Along x, across, and inwards, which is up here.
                let corners = [[0, 2, 0], [2, 2, 0], [2, 2, 2], [0, 2, 2], [0, 0, 0], [2, 0, 0], [2, 0, 2], [0, 0, 2]];
                let edges =
                    [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)];
                let middle = |&(a, b): &(usize, usize)| [0, 1, 2].map(|c| (corners[a][c] + corners[b][c]) / 2);
                let at: Vec<[usize; 3]> = corners.into_iter().chain(edges.iter().map(middle)).collect();
                let mut text = |of: &[[usize; 3]]| -> String {
                    let all: Vec<String> = of.iter().map(|[a, b, c]| tag(k + a, i + b, j + c).to_string()).collect();
                    all.join(" ")
                };
                elements.push(format!("17 2 3 1 {}", text(&at)));
                let face =
                    |b: usize| [[0, b, 0], [2, b, 0], [2, b, 2], [0, b, 2], [1, b, 0], [2, b, 1], [1, b, 2], [0, b, 1]];
                if i == 0 {
                    elements.push(format!("16 2 2 2 {}", text(&face(0))));
                }
                if i + 3 == r.len() {
                    elements.push(format!("16 2 1 1 {}", text(&face(2))));
                }
            }
        }
    }
    let count = tags.len();
    file(["2 1 \"contact\"", "2 2 \"bore\"", "3 3 \"steel\""], &nodes, count, &elements)
}

/// A wheel of the profile S1002 with that section, on a rail that is a half-space.
fn placed(folder: &Folder, mesh: Value) -> Value {
    std::fs::write(folder.path("section.msh"), section()).expect("a drawing");
    std::fs::write(folder.path("wheel.msh"), wheel()).expect("a mesh");
    let mut job = job("wheel-at-given-yaw.json");
    job["bodies"]["lower"].as_object_mut().expect("a body").remove("mesh");
    let upper = job["bodies"]["upper"].as_object_mut().expect("a body");
    upper.insert("mesh".into(), mesh);
    upper.insert("fixed".into(), json!(["bore"]));
    upper.insert("damping".into(), json!({ "modal": { "by_diameter": [0.002, 0.02, 0.0002] } }));
    job["analyses"] = json!({ "modes": { "count": 8 }, "steady": {}, "stability": {} });
    job
}

/// A wheel of hexahedra where the placement says it is: as the one that is swept from the same section, on either
/// side of the track, turning.
#[test]
fn a_mesh_stands_where_its_section_does() {
    mesh_beside_section(1);
}

/// The same on two ranks.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_mesh_on_two_ranks_stands_where_its_section_does() {
    mesh_beside_section(2);
}

fn mesh_beside_section(ranks: usize) {
    let folder = Folder::with("{}");
    let swept = json!({ "revolved": { "section": { "file": { "path": "section.msh", "radius": 0.46 } } } });
    let set = |mesh: &Value, side: &str| {
        let mut job = placed(&folder, mesh.clone());
        let sign = if side == "left" { -1.0 } else { 1.0 };
        job["contact"]["placement"] =
            json!({ "side": side, "radius": 0.46, "cant": 0.025, "lateral": -0.006 * sign, "yaw": -0.010 * sign });
        std::fs::write(folder.path("job.json"), job.to_string()).expect("a job");
    };
    let run =
        |file: &str, ranks: usize| folder.call(ranks, "run", &["--output", &folder.text(file)]).good().out.clone();
    set(&swept, "right");
    run("swept.h5", 1);
    let mesh = json!({ "file": { "path": "wheel.msh", "scale": 1.0 } });
    set(&mesh, "right");
    let said = folder.call(1, "check", &[]).good().out.clone();
    assert!(said.contains("body upper: means over a disc of"), "{said}");
    // The grid is shown on the wheel as it stands, its middle at the contact point.
    folder.call(1, "check", &["--mesh", &folder.text("shown.vtkhdf")]).good();
    let shown = |name: &str| numbers(&folder, "shown.vtkhdf", &format!("surface/{name}"));
    let (grid, places) = (shown("common_grid"), shown("contact_point"));
    assert!(places.len() as f64 == 3.0 * grid[0] * grid[1] && shown("contact_body").iter().all(|b| *b == 2.0));
    assert!(shown("contact_on_face").iter().all(|on| *on == 1.0), "a wheel behind the whole grid");
    let middle = places.chunks_exact(3).map(|p| p[0].hypot(p[1]).hypot(p[2])).fold(f64::INFINITY, f64::min);
    assert!(middle < 1e-9, "{middle}");
    run("right.h5", 1);
    let again = (ranks > 1).then(|| run("again.h5", ranks)).map(|_| "again.h5");
    // Its modes serve another friction, and no other mesh.
    folder
        .call(1, "run", &["--reuse", &folder.text("right.h5"), "--set", "contact.friction=0.3", "--only", "stability"])
        .good();
    let other = "bodies.upper.mesh.file.scale=1.001";
    std::fs::remove_file(folder.path("job.h5")).expect("the last result");
    folder
        .call(1, "run", &["--reuse", &folder.text("right.h5"), "--set", other])
        .failed(2, &["bodies.upper.mesh.file.scale"]);
    set(&mesh, "left");
    run("left.h5", 1);
    let of = |file: &str, name: &str| numbers(&folder, file, name);
    for (name, tolerance) in
        [("modes/upper/frequency", 5e-3), ("stability/frequency", 5e-3), ("stability/damping_ratio", 5e-2)]
    {
        let (wanted, found) = (of("swept.h5", name), of("right.h5", name));
        let size = wanted.iter().take(8).fold(0.0f64, |m, v| m.max(v.abs()));
        for k in 0..8 {
            let scale = if name.ends_with("frequency") { wanted[k] } else { size };
            assert!((found[k] - wanted[k]).abs() < tolerance * scale, "{name}: {found:?}, swept {wanted:?}");
        }
    }
    let forces = |file: &str| of(file, "contact/force");
    let (wanted, right, left) = (forces("swept.h5"), forces("right.h5"), forces("left.h5"));
    let load = wanted[2].abs();
    for c in 0..3 {
        let mirrored = if c == 1 { -left[c] } else { left[c] };
        assert!(
            (right[c] - wanted[c]).abs() < 1e-3 * load && (mirrored - right[c]).abs() < 1e-6 * load,
            "{wanted:?} {right:?} {left:?}"
        );
    }
    for other in again.into_iter().chain(["left.h5"]) {
        let (a, b) = (of("right.h5", "stability/growth_rate"), of(other, "stability/growth_rate"));
        for k in 0..8 {
            assert!((a[k] - b[k]).abs() < 1e-6 * a[k].abs().max(1.0), "{other}: {a:?} {b:?}");
        }
    }
}

/// Displacement of the upper body at nodes of the contact under forces on others, 10 to 25 mm beside them, as means
/// over all such pairs, m/N, `[3][3]` in (x, y, n).
fn far_yielding(folder: &Folder, file: &str) -> [[f64; 3]; 3] {
    let (x, y) = (numbers(folder, file, "reduced/x"), numbers(folder, file, "reduced/y"));
    let compliance = numbers(folder, file, "reduced/upper/compliance");
    let n = x.len() * y.len();
    let place = |k: usize| [x[k % x.len()], y[k / x.len()]];
    let (mut sum, mut pairs) = ([[0.0; 3]; 3], 0.0);
    for i in 0..n {
        for j in 0..n {
            let ([a, b], [c, d]) = (place(i), place(j));
            if !(0.010..0.025).contains(&(a - c).hypot(b - d)) || a.hypot(b) > 0.015 || c.hypot(d) > 0.015 {
                continue;
            }
            pairs += 1.0;
            (0..9).for_each(|k| sum[k / 3][k % 3] += compliance[(3 * i + k / 3) * 3 * n + 3 * j + k % 3]);
        }
    }
    sum.map(|row| row.map(|v| v / pairs))
}

/// The compliance of the elements of a wheel on a placement, whose contact is tilted against them, beside that of a
/// half-space and what the rest adds, on one mesh. Far from a force both yield alike, also along y by forces along n,
/// which a tilt to the wrong side would change by 7 pm/N; so do forces, approach and growth. The same on two ranks.
#[test]
#[ignore = "long: scripts/validate long"]
fn elements_of_a_placed_wheel_yield_as_a_half_space_and_the_rest_do() {
    let folder = Folder::with("{}");
    let mut job = placed(&folder, json!({ "file": "fine.msh" }));
    std::fs::write(folder.path("fine.msh"), fine_rim()).expect("a mesh");
    // A load under which the grid, an eighth of Hertz' ellipse, is as coarse as the mesh.
    job["contact"]["normal_load"] = json!(480e3);
    job["contact"]["placement"] =
        json!({ "side": "right", "radius": 0.46, "cant": 0.025, "lateral": -0.006, "yaw": -0.010, "loaded": false });
    job["contact"]["compliance"] = json!("fe");
    job["analyses"]["modes"]["count"] = json!(4);
    std::fs::write(folder.path("job.json"), job.to_string()).expect("a job");
    let said = folder.call(1, "check", &[]).good().out.clone();
    assert!(said.contains("body upper: means about the nodes of the grid; nodes of its faces there 1.4"), "{said}");
    folder.call(1, "run", &["--output", &folder.text("fe.h5")]).good();
    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    folder.call(1, "run", &["--set", "contact.compliance=hybrid", "--output", &folder.text("hybrid.h5")]).good();
    for name in ["contact/force", "contact/approach", "stability/growth_rate"] {
        alike(&folder, ["fe.h5", "two.h5"], name, 1e-6);
    }
    let (wanted, found) = (far_yielding(&folder, "hybrid.h5"), far_yielding(&folder, "fe.h5"));
    for k in 0..9 {
        let (a, b) = (wanted[k / 3][k % 3], found[k / 3][k % 3]);
        assert!((a - b).abs() < 1e-12 + 3e-3 * a.abs(), "row {}, force {}: {b:e}, hybrid {a:e}", k / 3, k % 3);
    }
    assert!(wanted[1][2].abs() > 2e-11, "{wanted:?}");
    for (name, tolerance) in [
        ("contact/force", 5e-3),
        ("contact/approach", 5e-3),
        ("stability/frequency", 1e-3),
        ("stability/growth_rate", 2e-2),
    ] {
        alike(&folder, ["hybrid.h5", "fe.h5"], name, tolerance);
    }
    let refused = |set: &str, words: &[&str]| {
        let before = folder.listing();
        folder.refused(1, &["--set", set], 2, words);
        assert_eq!(folder.listing(), before);
    };
    refused("contact.placement.loaded=true", &["contact.compliance", "contact.placement.loaded = false", "\"hybrid\""]);
    refused(
        "bodies.upper.mesh.file=wheel.msh",
        &["bodies.upper.mesh", "contact.compliance", "mm spacing", "a finer mesh"],
    );
    let swept = r#"bodies.lower.mesh={"extruded": {"section": "60E1"}}"#;
    refused(swept, &["contact.compliance", "bodies.lower is swept", "\"hybrid\""]);
}

#[test]
fn mistakes_with_surfaces_are_named() {
    let hybrid = "contact.compliance=hybrid";
    let folder = Folder::with(cylinders([0.004, 0.004], 0.012).to_string());
    let refused = |sets: &[&str], code: i32, words: &[&str]| {
        let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
        for command in ["check", "run"] {
            folder.call(1, command, &sets).failed(code, words);
            folder.untouched();
        }
    };
    refused(
        &["contact.grid.spacing=0.001"],
        2,
        &["contact.compliance", "1.000 mm spacing", "\"hybrid\"", "contact.grid.spacing = 4.0e-3"],
    );
    refused(
        &["contact.grid={\"spacing\":0.004,\"half_length\":0.02}"],
        3,
        &["bodies.lower.mesh", "no face of the surface", "contact.patch"],
    );
    refused(
        &["contact.grid={\"spacing\":0.004,\"half_length\":0.002}"],
        2,
        &["contact.grid.half_length: found 0.002 m", "0.008"],
    );
    refused(&["contact.grid.curvatures=[4,-1]"], 2, &["contact.grid.curvatures", "above 0"]);
    refused(&["contact.compliance=half_space", "contact.grid={}"], 2, &["contact.grid", "leave it out"]);
    refused(
        &[hybrid, "analyses.stability.full={\"max_frequency\":2000}"],
        2,
        &["analyses.stability.full", "\"hybrid\"", "\"fe\""],
    );
    // A disc of the loads needs a surface.
    let large = "bodies.lower.mesh.cylinder.element_size=0.006";
    refused(&[hybrid, large], 3, &["bodies.lower.mesh", "disc of the radius", "contact.patch"]);
}
