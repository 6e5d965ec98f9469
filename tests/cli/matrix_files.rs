//! Matrices of other programs: the disc brake of `jobs/disc-brake.json` through every format, its eigenvalues beside
//! those of an independent program, and what is refused.

use super::program::*;
use railsqueal::body::matrix_files::{self, dofs, Dof, Source};
use railsqueal::body::matrix_market::Csr;
use serde_json::{json, Value};
use std::path::{Path, PathBuf};

/// Frequencies (Hz) and growth rates (1/s) of the least stable eigenvalues below 12 kHz: the contacts as constraints,
/// eliminated by their null space (numpy, `scripts/studies/disc_brake.py solve`).
const BRAKE: [(f64, f64); 12] = [
    (3664.1695826, 55.43724475),
    (4012.8001522, 23.36184427),
    (2739.5194256, -17.28344195),
    (2779.6480074, -17.49893365),
    (3031.8109571, -19.28365534),
    (2879.2685151, -21.06103361),
    (4708.2095407, -38.91582623),
    (6287.8440283, -39.10728518),
    (9008.8158692, -43.20263491),
    (4795.0135883, -44.55426439),
    (8437.7656422, -48.66370651),
    (11156.5511516, -66.64371860),
];

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/disc-brake").join(name)
}

/// The brake and its files in a folder of their own.
fn brake(change: impl FnOnce(&mut Value)) -> Folder {
    let mut job = job("disc-brake.json");
    change(&mut job);
    let folder = Folder::with(job.to_string());
    std::fs::create_dir(folder.path("disc-brake")).unwrap();
    for name in ["disc.pch", "pads.sti", "pads.mas", "pads.dof"] {
        std::fs::copy(data(name), folder.path(&format!("disc-brake/{name}"))).unwrap();
    }
    folder
}

/// Frequencies and growth rates, by falling growth rate.
fn eigenvalues(folder: &Folder, ranks: usize) -> Vec<(f64, f64)> {
    folder.call(ranks, "run", &["--force"]).good();
    let file = hdf5::File::open(folder.path("job.h5")).unwrap();
    let read = |name: &str| file.dataset(name).unwrap().read_raw::<f64>().unwrap();
    read("stability/frequency").into_iter().zip(read("stability/growth_rate")).collect()
}

/// All of `want` are among the eigenvalues, as the least stable ones.
#[track_caller]
fn agree(got: &[(f64, f64)], want: &[(f64, f64)], relative: f64) {
    assert!(got.len() >= want.len(), "{got:?}");
    for ((f, g), (frequency, growth)) in got.iter().zip(want) {
        let omega = 2.0 * std::f64::consts::PI * frequency;
        let off = (2.0 * std::f64::consts::PI * (f - frequency)).hypot(g - growth);
        assert!(
            off <= relative * omega,
            "{f:.6} Hz {g:+.6} 1/s, expected {frequency} Hz {growth:+} 1/s: {off:.2e} 1/s"
        );
    }
}

fn source(path: &Path, name: Option<&str>) -> (Csr, Option<Vec<Dof>>) {
    let path = path.to_owned();
    let read = matrix_files::read(&Source { path: &path, name, format: None }).unwrap();
    (read.matrix, read.dofs)
}

/// Matrices of the bodies with node and direction of their rows: stiffness, mass and damping.
struct Given {
    dofs: Vec<Dof>,
    matrices: Vec<(&'static str, Csr)>,
}

fn disc() -> Given {
    let (k, dofs) = source(&data("disc.pch"), Some("KAAX"));
    let dofs = dofs.unwrap();
    let (m, own) = source(&data("disc.pch"), Some("MAAX"));
    assert_eq!(own.as_ref(), Some(&dofs));
    // Modes alone are damped.
    let (c, damped) = source(&data("disc.pch"), Some("BAAX"));
    let place: Vec<usize> = damped.unwrap().iter().map(|d| dofs.iter().position(|e| e == d).unwrap()).collect();
    let c = Csr::from_entries(k.n, (0..c.n).map(|i| (place[i], place[i], c.get(i, i))).collect());
    Given { dofs, matrices: vec![("stiffness", k), ("mass", m), ("damping", c)] }
}

fn pads() -> Given {
    let dofs = dofs::read(&data("pads.dof")).unwrap();
    let matrices =
        [("stiffness", "pads.sti"), ("mass", "pads.mas")].map(|(key, name)| (key, source(&data(name), None).0));
    Given { dofs, matrices: matrices.into() }
}

/// Entries of the lower triangle, or of all.
fn listed(m: &Csr, all: bool) -> Vec<(usize, usize, f64)> {
    let rows = (0..m.n).flat_map(|i| (0..m.n).map(move |j| (i, j)));
    let there = rows.filter(|&(i, j)| (all || i >= j) && (i == j || m.get(i, j) != 0.0));
    there.map(|(i, j)| (i, j, m.get(i, j))).collect()
}

/// Columns of a matrix in OUTPUT4 and Harwell–Boeing.
fn words(words: impl Iterator<Item = String>, per: usize) -> (usize, String) {
    let lines: Vec<String> = words.collect::<Vec<_>>().chunks(per).map(|c| c.concat() + "\n").collect();
    (lines.len(), lines.concat())
}

/// A value with all its digits in 26 columns.
fn real(value: f64) -> String {
    format!("{:>26}", format!("{value:.16e}").replace('e', "E"))
}

/// The content of a matrix file, by a writer of this test.
fn written(ending: &str, m: &Csr, dofs: &[Dof]) -> String {
    let label = |i: usize| format!("{},{}", dofs[i].node, dofs[i].direction);
    let lower = listed(m, false);
    match ending {
        "mm" => {
            let head = format!("%%MatrixMarket matrix coordinate real symmetric\n{0} {0} {1}\n", m.n, lower.len());
            head + &lower.iter().map(|&(i, j, v)| format!("{} {} {v:e}\n", i + 1, j + 1)).collect::<String>()
        }
        "mtx" => lower.iter().map(|&(i, j, v)| format!("{}, {}, {v:e}\n", label(i), label(j))).collect(),
        "coordinate" => listed(m, true).iter().map(|&(i, j, v)| format!("{} {} {v:e}\n", i + 1, j + 1)).collect(),
        "sti" => lower.iter().map(|&(i, j, v)| format!("{} {} {v:e}\n", j + 1, i + 1)).collect(),
        "bdf" => {
            let column = |j: usize| {
                let there = lower.iter().filter(|e| e.1 == j);
                there.map(|&(i, _, v)| format!("DMIG,A,{},,{},{v:e}\n", label(j), label(i))).collect::<String>()
            };
            "DMIG,A,0,6,2,0\n".to_owned() + &(0..m.n).map(column).collect::<String>()
        }
        "op4" => {
            let column = |j: usize| {
                let (_, values) = words((0..m.n).map(|i| real(m.get(i, j))), 3);
                format!("{:8}{:8}{:8}\n{values}", j + 1, 1, m.n)
            };
            let head = format!("{0:8}{0:8}{1:8}{2:8}{3:8}1P,3E26.16\n", m.n, 6, 2, "A");
            let end = format!("{:8}{:8}{:8}\n{}\n", m.n + 1, 1, 1, real(1.0));
            head + &(0..m.n).map(column).collect::<String>() + &end
        }
        "rsa" => {
            let mut sorted = lower;
            sorted.sort_by_key(|e| (e.1, e.0));
            let first = |j: usize| 1 + sorted.iter().filter(|e| e.1 < j).count();
            let (p, pointers) = words((0..=m.n).map(|j| format!("{:8}", first(j))), 10);
            let (r, rows) = words(sorted.iter().map(|e| format!("{:8}", e.0 + 1)), 10);
            let (v, values) = words(sorted.iter().map(|e| real(e.2)), 3);
            let cards = format!("{:14}{p:14}{r:14}{v:14}{:14}", p + r + v, 0);
            let sizes = format!("{:14}{1:14}{1:14}{2:14}{3:14}", "RSA", m.n, sorted.len(), 0);
            let formats = format!("{:16}{:16}{:20}", "(10I8)", "(10I8)", "(3E26.16)");
            format!("{:72}{:8}\n{cards}\n{sizes}\n{formats}\n{pointers}{rows}{values}", "brake", "A")
        }
        _ => panic!("{ending}"),
    }
}

/// Writes a body in one format and names its files in the job.
fn rewrite(folder: &Folder, job: &mut Value, (body, given): (&str, &Given), ending: &str) {
    for (key, m) in &given.matrices {
        let name = format!("{body}-{key}.{ending}");
        std::fs::write(folder.path(&name), written(ending, m, &given.dofs)).unwrap();
        job["bodies"][body]["matrices"][key] = match ending {
            "coordinate" => json!({ "path": name, "format": "abaqus" }),
            _ => json!(name),
        };
    }
    if !matches!(ending, "mtx" | "bdf") {
        let lines: String = given.dofs.iter().map(|d| format!("{} {}\n", d.node, d.direction)).collect();
        std::fs::write(folder.path(&format!("{body}.dofs")), lines).unwrap();
        job["bodies"][body]["matrices"]["dofs"] = json!(format!("{body}.dofs"));
    }
}

#[test]
fn brake_has_the_eigenvalues_of_an_independent_program() {
    for ranks in [1, 2] {
        let folder = brake(|_| ());
        let ran = folder.call(ranks, "check", &[]);
        ran.good();
        let all = eigenvalues(&folder, ranks);
        let (reduced, full) = all.split_at(all.len() / 2);
        agree(full, &BRAKE, 1e-10);
        // What modes beyond the 38th of the pads add is static, and without its damping.
        agree(reduced, full, 1e-5);
    }
}

#[test]
fn every_format_gives_the_eigenvalues_of_matrix_market() {
    let bodies = [("lower", disc()), ("upper", pads())];
    let mut of_market = Vec::new();
    for ending in ["mm", "mtx", "coordinate", "sti", "bdf", "op4", "rsa"] {
        let mut job = job("disc-brake.json");
        let folder = Folder::with("");
        for (body, given) in &bodies {
            // Scalar points, the modes of the disc, are Nastran's; in an Abaqus file they are nodes.
            let mut given = Given { dofs: given.dofs.clone(), matrices: given.matrices.clone() };
            if ending == "mtx" {
                given.dofs.iter_mut().filter(|d| d.direction == 0).for_each(|d| d.direction = 1);
            }
            rewrite(&folder, &mut job, (body, &given), ending);
        }
        std::fs::write(folder.path("job.json"), job.to_string()).unwrap();
        let found = eigenvalues(&folder, 1);
        agree(&found[found.len() / 2..], &BRAKE, 1e-10);
        if of_market.is_empty() {
            of_market = found;
            continue;
        }
        assert_eq!(found.len(), of_market.len(), "{ending}");
        agree(&found, &of_market, 1e-11);
    }
}

/// Both bodies in one set of matrices: contacts of a node against another one.
#[test]
fn contacts_within_one_set_of_matrices() {
    let (disc, pads) = (disc(), pads());
    let n = disc.dofs.len();
    let shifted = pads.dofs.iter().map(|d| Dof { node: d.node + 100_000, ..*d });
    let dofs: Vec<Dof> = disc.dofs.iter().copied().chain(shifted).collect();
    let order = dofs.len();
    let join = |a: Option<&Csr>, b: Option<&Csr>| {
        let upper = b.map_or(Vec::new(), |b| listed(b, true)).into_iter().map(|(i, j, v)| (n + i, n + j, v));
        Csr::from_entries(order, a.map_or(Vec::new(), |a| listed(a, true)).into_iter().chain(upper).collect())
    };
    let of = |given: &Given, key: &str| given.matrices.iter().find(|m| m.0 == key).map(|m| m.1.clone());
    let matrices =
        ["stiffness", "mass", "damping"].map(|key| (key, join(of(&disc, key).as_ref(), of(&pads, key).as_ref())));
    let both = Given { dofs, matrices: matrices.into() };
    let mut job = job("disc-brake.json");
    let mut upper = job["bodies"]["upper"]["matrices"].take();
    job["bodies"].as_object_mut().unwrap().remove("upper");
    let lower = &mut job["bodies"]["lower"]["matrices"];
    for (contact, other) in
        lower["contacts"].as_array_mut().unwrap().iter_mut().zip(upper["contacts"].as_array().unwrap())
    {
        contact["against"] = json!(other["node"].as_i64().unwrap() + 100_000);
        // A direction by its vector.
        contact["tangential"][0] = json!([2, 0, 0]);
    }
    let mut supports = upper["supports"].take();
    for node in supports[0]["nodes"].as_array_mut().unwrap() {
        *node = json!(node.as_i64().unwrap() + 100_000);
    }
    lower["supports"] = supports;
    job["analyses"]["modes"]["count"] = json!(80);
    let folder = Folder::with("");
    rewrite(&folder, &mut job, ("lower", &both), "op4");
    std::fs::write(folder.path("job.json"), job.to_string()).unwrap();
    let all = eigenvalues(&folder, 1);
    agree(&all[all.len() / 2..], &BRAKE, 1e-10);
}

/// Matrices in mm, N, t and s, and clamped nodes, beside matrices in SI units whose rows the test takes out.
#[test]
fn units_and_clamped_nodes() {
    let disc = disc();
    let held: Vec<usize> =
        (0..disc.dofs.len()).filter(|&i| disc.dofs[i].node == 203 && disc.dofs[i].direction != 3).collect();
    let rest: Vec<usize> = (0..disc.dofs.len()).filter(|i| !held.contains(i)).collect();
    let reduced = Given {
        dofs: rest.iter().map(|&i| disc.dofs[i]).collect(),
        matrices: disc
            .matrices
            .iter()
            .map(|(key, m)| {
                let place = |i: usize| rest.iter().position(|&r| r == i);
                let kept = listed(m, true).into_iter().filter_map(|(i, j, v)| Some((place(i)?, place(j)?, v)));
                (*key, Csr::from_entries(rest.len(), kept.collect()))
            })
            .collect(),
    };
    let mut milli = Given { dofs: disc.dofs.clone(), matrices: disc.matrices.clone() };
    milli.matrices.iter_mut().for_each(|(_, m)| m.values.iter_mut().for_each(|v| *v *= 1e-3));
    let all: Vec<Vec<(f64, f64)>> = [(&reduced, false), (&milli, true)]
        .into_iter()
        .map(|(given, supported)| {
            let folder = brake(|_| ());
            let mut job = job("disc-brake.json");
            rewrite(&folder, &mut job, ("lower", given), "bdf");
            let lower = &mut job["bodies"]["lower"]["matrices"];
            if supported {
                lower["supports"] = json!([{ "nodes": [203], "clamped": ["x", "y"] }]);
                lower["scale"] = json!(0.001);
            } else {
                // The node has no rows along x and y.
                lower["contacts"][1]["tangential"] = json!([0, 0]);
            }
            job["analyses"]["modes"]["count"] = json!(rest.len());
            std::fs::write(folder.path("job.json"), job.to_string()).unwrap();
            eigenvalues(&folder, 1)
        })
        .collect();
    assert!(all[0].len() > 20, "{all:?}");
    agree(&all[1], &all[0], 1e-9);
}

#[test]
fn faults_are_named() {
    let refused = |change: &dyn Fn(&mut Value), code: i32, parts: &[&str]| {
        let folder = brake(|job| change(job));
        folder.call(1, "check", &[]).failed(code, parts);
        folder.call(1, "run", &[]).failed(code, parts);
    };
    let lower = |job: &mut Value, key: &str, value: Value| job["bodies"]["lower"]["matrices"][key] = value;
    let contact =
        |job: &mut Value, key: &str, value: Value| job["bodies"]["upper"]["matrices"]["contacts"][2][key] = value;
    let support =
        |job: &mut Value, key: &str, value: Value| job["bodies"]["upper"]["matrices"]["supports"][0][key] = value;
    let key = "bodies.upper.matrices.contacts.2";
    refused(&|job| contact(job, "node", json!(77)), 2, &[key, "node 77", "24 nodes 1 to 112"]);
    refused(&|job| contact(job, "node", Value::Null), 2, &[key, "node: missing", "normal is a direction"]);
    refused(&|job| contact(job, "normal", json!(3)), 2, &[key, "a row beside a node"]);
    refused(&|job| contact(job, "normal", json!("x")), 2, &[key, "not perpendicular to normal"]);
    refused(&|job| contact(job, "normal", json!([0, 0, 0])), 2, &[key, "without direction"]);
    refused(&|job| contact(job, "against", json!(3)), 2, &[key, "the node itself"]);
    refused(&|job| support(job, "nodes", json!([9, 9])), 2, &["supports.0.nodes", "node 9 twice"]);
    refused(&|job| support(job, "nodes", json!([13])), 2, &["supports.0.nodes", "node 13"]);
    refused(&|job| support(job, "clamped", json!(["z"])), 2, &["supports.0.stiffness", "clamped"]);
    refused(&|job| support(job, "stiffness", json!([-1, 0, 0])), 2, &["supports.0.stiffness"]);
    refused(&|job| lower(job, "scale", json!(0)), 2, &["matrices.scale"]);
    refused(&|job| lower(job, "stiffness", json!("disc-brake/disc.pch")), 3, &["KAAX, MAAX, BAAX", "name it"]);
    refused(
        &|job| lower(job, "mass", json!({ "path": "disc-brake/disc.pch", "name": "M" })),
        3,
        &["disc.pch", "one named \"M\""],
    );
    // The mass has no node that the stiffness does not have.
    refused(
        &|job| lower(job, "stiffness", json!({ "path": "disc-brake/disc.pch", "name": "BAAX" })),
        3,
        &["disc.pch", "node 203 x", "14 degrees of freedom"],
    );
    refused(&|job| lower(job, "mass", json!("disc-brake/pads.mas")), 3, &["pads.mas", "order 72", "order 38"]);
    refused(&|job| lower(job, "dofs", json!("disc-brake/pads.dof")), 3, &["disc.pch", "none of the 72 degrees"]);
    refused(
        &|job| lower(job, "mass", json!({ "path": "disc-brake/disc.pch", "format": "op4" })),
        3,
        &["disc.pch", "line 1", "number of columns"],
    );
    // Abaqus holds degrees of freedom by 1e36 on the diagonal.
    let folder = brake(|job| {
        job["bodies"]["upper"]["matrices"]["stiffness"] = json!("disc-brake/pads.mtx");
        job["bodies"]["upper"]["matrices"]["dofs"] = json!("disc-brake/pads.dof");
    });
    let Given { dofs, mut matrices } = pads();
    let k = &mut matrices[0].1;
    let entries = listed(k, true).into_iter().map(|(i, j, v)| (i, j, if i == j && i < 2 { 1e36 } else { v }));
    *k = Csr::from_entries(k.n, entries.collect());
    std::fs::write(folder.path("disc-brake/pads.mtx"), written("mtx", k, &dofs)).unwrap();
    folder.call(1, "check", &[]).failed(3, &["pads.mtx", "1e36", "row node 1 x", "in 2 rows", "clamped"]);
    let support = json!({ "nodes": [1], "clamped": ["x", "y"] });
    let mut job: Value = serde_json::from_slice(&std::fs::read(folder.path("job.json")).unwrap()).unwrap();
    job["bodies"]["upper"]["matrices"]["supports"].as_array_mut().unwrap().push(support);
    std::fs::write(folder.path("job.json"), job.to_string()).unwrap();
    assert!(eigenvalues(&folder, 1).len() > 20);
    let folder = brake(|_| ());
    std::fs::remove_file(folder.path("disc-brake/pads.dof")).unwrap();
    folder.call(1, "check", &[]).failed(3, &["pads.dof", "cannot read the degrees of freedom"]);
    let folder = brake(|job| job["bodies"]["upper"]["matrices"]["mass"] = json!("disc-brake/pads.mtx"));
    std::fs::copy(data("pads.mas"), folder.path("disc-brake/pads.mtx")).unwrap();
    folder.call(1, "check", &[]).failed(3, &["pads.mtx", "no Matrix Market banner", "\"format\": \"abaqus\""]);
}
