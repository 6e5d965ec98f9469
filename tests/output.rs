//! Result files written on 1, 2 and 3 ranks, and read back by h5py, by VTK and by the program itself; writing that
//! fails.
//!
//! Without arguments this program is the test; it starts itself under mpirun as the ranks that write.

use railsqueal::mesh::distribute::MeshPart;
use railsqueal::mesh::{CellKind, Cells};
use railsqueal::output::*;
use railsqueal::parallel::World;
use railsqueal::Result;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output};

/// Elements along x, y, z of each of the two boxes, and their size, m.
const CELLS: [usize; 3] = [6, 4, 5];
const SIZE: [f64; 3] = [0.3, 0.2, 0.25];

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().collect();
    if let Some(at) = args.iter().position(|a| a == "--rank") {
        return ranks(&args[at + 1..]);
    }
    let tests: [(&str, fn()); 9] = [
        ("one_file_on_any_number_of_ranks", one_file_on_any_number_of_ranks),
        ("pictures_of_a_result", pictures_of_a_result),
        ("more_ranks_than_cells", more_ranks_than_cells),
        ("failed_run_leaves_nothing", failed_run_leaves_nothing),
        ("killed_run_is_swept_by_the_next", killed_run_is_swept_by_the_next),
        ("file_size_limit_is_an_io_error", file_size_limit_is_an_io_error),
        ("one_rank_that_cannot_write_ends_all", one_rank_that_cannot_write_ends_all),
        ("full_disk_is_an_io_error", full_disk_is_an_io_error),
        ("target_is_checked_first", target_is_checked_first),
    ];
    if args.iter().any(|a| a == "--list") {
        tests.iter().for_each(|(name, _)| println!("{name}: test"));
        return ExitCode::SUCCESS;
    }
    let wanted = args.iter().skip(1).find(|a| !a.starts_with('-'));
    for (name, test) in tests.iter().filter(|(name, _)| wanted.is_none_or(|w| name.contains(w.as_str()))) {
        test();
        println!("test {name} ... ok");
    }
    ExitCode::SUCCESS
}

// ---- The test side ----

/// Files of a run with modes and a transient.
const WHOLE: [&str; 4] = ["run.free_modes.vtkhdf", "run.h5", "run.hdf", "run.transient.vtkhdf"];

fn one_file_on_any_number_of_ranks() {
    for n in 1..=3 {
        let dir = tempfile::tempdir().expect("temporary directory");
        let out = mpirun(n, &["write", &path(&dir, "run.h5")]);
        assert!(out.status.success(), "{n} ranks: {}", said(&out));
        assert_eq!(listing(dir.path()), WHOLE, "{n} ranks");
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/check_output.py");
        let check = Command::new(python()).arg(script).arg(path(&dir, "run.h5")).arg(n.to_string()).output();
        let check = check.expect("python3 with h5py and vtk");
        assert!(check.status.success(), "{n} ranks: {}", said(&check));
    }
}

fn pictures_of_a_result() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let out = mpirun(2, &["write", &path(&dir, "run.h5")]);
    assert!(out.status.success(), "{}", said(&out));
    let plot = |file: &str| {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/plot");
        Command::new(script).args([&path(&dir, file), "--out", &path(&dir, "pictures")]).output().expect("scripts/plot")
    };
    let made = plot("run.h5");
    assert!(made.status.success(), "{}", said(&made));
    let names = ["contact-line.png", "contact-map.png", "frequencies.md", "modes-lower.png", "modes-upper.png"];
    assert_eq!(listing(&dir.path().join("pictures")), names.map(|n| format!("run-{n}")));
    std::fs::write(dir.path().join("broken.h5"), "no HDF5").expect("write");
    let broken = plot("broken.h5");
    assert_eq!(broken.status.code(), Some(3), "{}", said(&broken));
    assert!(said(&broken).contains("broken.h5") && !said(&broken).contains("Traceback"), "{}", said(&broken));
}

fn more_ranks_than_cells() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let out = mpirun(4, &["few", &path(&dir, "run.h5")]);
    assert!(out.status.success(), "{}", said(&out));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/check_output.py");
    let check = Command::new(python()).arg(script).arg(path(&dir, "run.h5")).arg("4").arg("few").output();
    let check = check.expect("python3 with h5py and vtk");
    assert!(check.status.success(), "{}", said(&check));
}

fn failed_run_leaves_nothing() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let out = mpirun(2, &["unfinished", &path(&dir, "run.h5")]);
    assert!(out.status.success(), "{}", said(&out));
    assert_eq!(listing(dir.path()), [""; 0]);
    let out = mpirun(2, &["one-fails", &path(&dir, "run.h5")]);
    assert_eq!(out.status.code(), Some(1), "{}", said(&out));
    assert_eq!(listing(dir.path()), [""; 0]);
}

fn killed_run_is_swept_by_the_next() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let out = mpirun(1, &["abort", &path(&dir, "run.h5")]);
    assert!(!out.status.success());
    let left = listing(dir.path());
    let kinds = [".claim", ".partial"];
    let known = left.iter().zip(kinds).all(|(name, kind)| name.ends_with(kind));
    assert!(left.len() == 2 && known, "the killed run left {left:?}");
    let out = mpirun(1, &["write", &path(&dir, "run.h5")]);
    assert!(out.status.success(), "{}", said(&out));
    assert_eq!(listing(dir.path()), WHOLE);
}

fn file_size_limit_is_an_io_error() {
    // In the fields' reservation, then in the tables'.
    for (limit, case) in [("20000", "write"), ("200000", "large-table")] {
        let dir = tempfile::tempdir().expect("temporary directory");
        let out = mpirun(2, &[case, &path(&dir, "run.h5"), limit]);
        assert_eq!(out.status.code(), Some(6), "{}", said(&out));
        assert!(said(&out).contains("run.h5") && said(&out).contains("ulimit -f"), "{}", said(&out));
        assert_eq!(listing(dir.path()), [""; 0]);
    }
}

/// Rank 0 could reserve the space, another rank cannot write into it.
fn one_rank_that_cannot_write_ends_all() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let out = mpirun(2, &["write", &path(&dir, "run.h5"), "20000", "1"]);
    assert_eq!(out.status.code(), Some(6), "{}", said(&out));
    assert!(said(&out).contains("run.h5"), "{}", said(&out));
    assert_eq!(listing(dir.path()), [""; 0]);
}

/// A real full file system, where one can be mounted (that takes root).
fn full_disk_is_an_io_error() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let mount = Command::new("mount").args(["-t", "tmpfs", "-o", "size=2m", "tmpfs"]).arg(dir.path()).output();
    if !mount.is_ok_and(|m| m.status.success()) {
        println!("     (no small file system can be mounted here; the file size limit stands for it)");
        return;
    }
    let out = mpirun(2, &["large-table", &path(&dir, "run.h5")]);
    let left = listing(dir.path());
    let unmounted = Command::new("umount").arg(dir.path()).status().expect("umount");
    assert!(unmounted.success());
    assert_eq!(out.status.code(), Some(6), "{}", said(&out));
    assert!(said(&out).contains("run.h5") && said(&out).contains("No space left"), "{}", said(&out));
    assert_eq!(left, [""; 0]);
}

fn target_is_checked_first() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let out = mpirun(2, &["write", &path(&dir, "no/such/run.h5")]);
    assert_eq!(out.status.code(), Some(6), "{}", said(&out));
    assert!(said(&out).contains("no/such/run.h5"), "{}", said(&out));
    std::fs::write(dir.path().join("run.h5"), "precious").expect("write");
    let out = mpirun(2, &["keep", &path(&dir, "run.h5")]);
    assert_eq!(out.status.code(), Some(2), "{}", said(&out));
    assert!(said(&out).contains("--force"), "{}", said(&out));
    assert_eq!(std::fs::read(dir.path().join("run.h5")).expect("read"), b"precious");
    std::fs::rename(dir.path().join("run.h5"), dir.path().join("run.modes.vtkhdf")).expect("rename");
    let out = mpirun(2, &["keep", &path(&dir, "run.h5")]);
    assert_eq!(out.status.code(), Some(2), "{}", said(&out));
    assert!(said(&out).contains("run.modes.vtkhdf"), "{}", said(&out));
    // What is no result of this program stays, whatever was asked for.
    let out = mpirun(2, &["write", &path(&dir, "run.h5")]);
    assert_eq!(out.status.code(), Some(2), "{}", said(&out));
    assert!(said(&out).contains("run.modes.vtkhdf is no result file"), "{}", said(&out));
    std::fs::remove_file(dir.path().join("run.modes.vtkhdf")).expect("remove");
    // Replacing the results removes what would no longer belong to them.
    let out = mpirun(2, &["write", &path(&dir, "run.h5")]);
    assert!(out.status.success(), "{}", said(&out));
    std::fs::rename(dir.path().join("run.transient.vtkhdf"), dir.path().join("run.modes.vtkhdf")).expect("rename");
    let out = mpirun(2, &["write", &path(&dir, "run.h5")]);
    assert!(out.status.success(), "{}", said(&out));
    assert_eq!(listing(dir.path()), WHOLE);
}

fn mpirun(ranks: usize, args: &[&str]) -> Output {
    let me = std::env::current_exe().expect("this program");
    Command::new("timeout")
        .args(["120", "mpirun", "-n", &ranks.to_string()])
        .arg(me)
        .arg("--rank")
        .args(args)
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        .env("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe")
        .output()
        .expect("mpirun")
}

fn python() -> PathBuf {
    let venv = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python");
    if venv.exists() {
        venv
    } else {
        PathBuf::from("python3")
    }
}

fn path(dir: &tempfile::TempDir, name: &str) -> String {
    dir.path().join(name).to_string_lossy().into_owned()
}

fn listing(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(dir)
        .expect("directory")
        .flatten()
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn said(out: &Output) -> String {
    format!("{}\n{}{}", out.status, String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr))
}

// ---- The ranks ----

fn ranks(args: &[String]) -> ExitCode {
    let universe = mpi::initialize().expect("MPI");
    let world = World::new(universe.world());
    let number = |k: usize| args.get(k).and_then(|l| l.parse::<u64>().ok());
    let limited = number(3).is_none_or(|rank| rank == world.rank as u64);
    if let (Some(limit), true) = (number(2), limited) {
        // After MPI is up: its own shared memory counts as files.
        let limit = rustix::process::Rlimit { current: Some(limit), maximum: Some(limit) };
        rustix::process::setrlimit(rustix::process::Resource::Fsize, limit).expect("file size limit");
    }
    let code = match act(&world, &args[0], Path::new(&args[1])) {
        Ok(()) => 0,
        Err(e) => {
            if world.is_root() {
                eprintln!("{e}");
            }
            e.exit_code()
        }
    };
    drop(universe);
    ExitCode::from(code as u8)
}

fn act(world: &World, case: &str, path: &Path) -> Result<()> {
    let layers = if case == "few" { 1 } else { CELLS[0] };
    let parts = [part(world, layers, 0.0), part(world, layers, -0.01)];
    let bodies = [BodyPart { part: &parts[0], upper: false }, BodyPart { part: &parts[1], upper: true }];
    let mut file = ResultFile::create(world, path, case != "keep")?;

    let u: Vec<Vec<f64>> = parts.iter().map(displacement).collect();
    let s: Vec<Vec<f64>> = parts.iter().map(|p| p.coords.iter().map(|x| 1e6 * x[0].abs()).collect()).collect();
    // The contact grid of the test: the four surface nodes around the origin of either body.
    let nodes: [u32; 4] = [0, 1, 2, 3].map(|k| surface_node(layers, k % 2, k / 2));
    let (nodes, p, t, state): (&[u32], Vec<f64>, Vec<f64>, Vec<i8>) = if world.is_root() {
        (&nodes, vec![1e8, 2e8, 3e8, 0.0], vec![1e7, 0.0, 0.0, 2e7, 1e6, -1e6, 0.0, 0.0], vec![1, 2, 2, 0])
    } else {
        (&[], vec![], vec![], vec![])
    };
    let contact: Vec<_> = parts.iter().map(|q| contact_fields(world, q, nodes, &p, &t, &state)).collect();
    let mut fields = vec![
        PointField::displacement(u.iter().map(|v| &v[..]).collect()),
        PointField::von_mises(s.iter().map(|v| &v[..]).collect()),
    ];
    fields.extend(PointField::contact(&contact));
    if case == "one-fails" && world.rank == 1 {
        fields[1].values[0] = &[];
    }
    file.fields(&bodies, &fields)?;
    match case {
        "unfinished" => return Ok(()),
        "abort" => std::process::abort(),
        _ => {}
    }

    file.table(Table::new("/contact/traction", "Pa", "Traction on body 1.", &[4, 2], t));
    file.table(Table::scalar("/contact/approach", "m", "Rigid approach.", 1e-4));
    file.table(Table::list("/contact/x", "m", "Positions.", vec![0.0, 0.05, 0.0, 0.05]));
    file.table(Table::list("/contact/y", "m", "Positions.", vec![0.0, 0.0, 0.05, 0.05]));
    file.table(Table::list("/contact/shape", "1", "Nodes along x and y.", vec![2i64, 2]));
    file.table(Table::list("/contact/pressure", "Pa", "Pressure.", p));
    file.table(Table::list("/contact/state", "-", "State.", state));
    file.table(Table::list("/contact/force", "N", "Force on body 1.", vec![1e3, 2e3, -7e4]));
    let frequencies = vec![vec![100.0, 250.0], vec![400.0]];
    for (name, values) in ["lower", "upper"].iter().zip(&frequencies) {
        file.table(Table::list(&format!("/modes/{name}/frequency"), "Hz", "Frequencies.", values.clone()));
    }
    let z = num_complex::Complex64::new(1.0, -2.0);
    file.table(Table::list("/stability/eigenvalue", "1/s", "Eigenvalues.", vec![z, z.conj()]));
    file.table(Table::new("/history/force", "N", "A table that can grow.", &[2, 3], vec![1.0; 6]).extendible());
    if case == "large-table" {
        // Noise, so that compression does not help.
        let noise: Vec<f64> = (0..400_000).map(|i| ((i as f64) * 12.9898).sin() * 43758.5453 % 1.0).collect();
        file.table(Table::list("/noise", "1", "Noise.", noise));
    } else {
        file.table(Table::list("/large", "1", "A table large enough to be compressed.", vec![0.5; 100_000]));
    }
    file.tables(
        Provenance {
            job: "{\"version\":1}".into(),
            command: vec!["railsqueal".into(), "run".into()],
            versions: vec![("railsqueal".into(), "0.1.0".into())],
            ranks: world.size,
            inputs: vec![],
            stages: vec![("mesh".into(), 0.5)],
            date: utc_now(),
            parts: vec![],
            warnings: vec![],
            summary: vec![],
            damping: vec![],
        }
        .tables(),
    );

    let spec = FieldSpec::new("velocity", "m/s", "A field that changes.", FieldKind::Vector);
    let times = [0.1, 0.25, 0.4];
    let frames = Sequence {
        fields: vec![spec],
        values: &times,
        units: "s",
        description: "Time.",
        tables: &[],
        summed: false,
        single: true,
    };
    let beside = companion(path, "transient.vtkhdf");
    let mut sequence = SequenceFile::create(world, &beside, true, &bodies, frames)?;
    for (k, time) in times.iter().enumerate() {
        let scaled: Vec<Vec<f64>> = u.iter().map(|v| v.iter().map(|a| a * time).collect()).collect();
        sequence.step(k, &[scaled.iter().map(|v| &v[..]).collect()])?;
    }
    file.attach(sequence)?;
    file.attach(write_modes(
        world,
        &companion(path, "free_modes.vtkhdf"),
        (true, true),
        &bodies,
        &frequencies,
        |b, k| Ok(u[b].iter().map(|v| v * frequencies[b][k]).collect()),
    )?)?;
    file.finish(Vec::new)?;

    // Reading back, on every rank at once.
    let back = Reader::open(path)?;
    assert_eq!(back.numbers("/contact/approach")?, (vec![], vec![1e-4]));
    assert_eq!(back.read("/stability/eigenvalue")?, (vec![2], Values::Complex(vec![z, z.conj()])));
    assert_eq!(back.text("/provenance/job")?, "{\"version\":1}");
    assert_eq!(back.attribute("/contact/approach", "units")?, "m");
    let missing = back.read("/contact/nothing").map_err(|e| (e.exit_code(), e.to_string()));
    assert!(matches!(&missing, Err((3, m)) if m.contains("/contact/nothing") && m.contains("run.h5")), "{missing:?}");
    Ok(())
}

fn surface_node(layers: usize, i: usize, j: usize) -> u32 {
    let [_, ny, nz] = CELLS;
    ((layers / 2 + i) * (ny + 1) * (nz + 1) + (ny / 2 + j) * (nz + 1) + nz) as u32
}

/// A box below the plane z = `top`, cut into slabs along x, one for each rank: nodes numbered with x slowest.
fn part(world: &World, layers: usize, top: f64) -> MeshPart {
    let [_, ny, nz] = CELLS;
    let plane = (ny + 1) * (nz + 1);
    let planes = layers + 1;
    let ranges: Vec<u64> = (0..=world.size).map(|r| (planes * r / world.size * plane) as u64).collect();
    let (first, last) = (ranges[world.rank], ranges[world.rank + 1]);
    let node = |i: usize, j: usize, k: usize| (i * plane + j * (nz + 1) + k) as u64;
    let mut all = Vec::new();
    for (i, j, k) in (0..layers).flat_map(|i| (0..ny).flat_map(move |j| (0..nz).map(move |k| (i, j, k)))) {
        let corner = |c: [usize; 3]| node(i + c[0], j + c[1], k + c[2]);
        let bottom = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]];
        let top = [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
        all.push([bottom, top].concat().into_iter().map(corner).collect::<Vec<u64>>());
    }
    let mine = |n: &u64| (first..last).contains(n);
    let touching: Vec<(u64, Vec<u64>)> =
        all.into_iter().enumerate().filter(|(_, c)| c.iter().any(mine)).map(|(i, c)| (i as u64, c)).collect();
    let mut ghosts: Vec<u64> = touching.iter().flat_map(|(_, c)| c.iter().copied()).filter(|n| !mine(n)).collect();
    ghosts.sort_unstable();
    ghosts.dedup();
    let node_ids: Vec<u64> = (first..last).chain(ghosts).collect();
    let local = |n: &u64| node_ids.iter().position(|m| m == n).expect("local node") as u32;
    let position = |&n: &u64| {
        let (i, j, k) = (n as usize / plane, n as usize % plane / (nz + 1), n as usize % (nz + 1));
        let at = |i: usize, n: usize, size: f64| size * (i as f64 / n as f64 - 0.5);
        [at(i, layers, SIZE[0]), at(j, ny, SIZE[1]), at(k, nz, SIZE[2]) - 0.5 * SIZE[2] + top]
    };
    let mut cells = Cells::default();
    touching.iter().for_each(|(_, c)| cells.push(CellKind::Hex8, &c.iter().map(local).collect::<Vec<u32>>()));
    MeshPart {
        coords: node_ids.iter().map(position).collect(),
        cells,
        cell_ids: touching.iter().map(|(i, _)| *i).collect(),
        // The rank of the lowest node owns the cell.
        cell_owned: touching.iter().map(|(_, c)| c.iter().min().is_some_and(mine)).collect(),
        owned: (last - first) as usize,
        renumbered: if world.is_root() { (0..(planes * plane) as u64).collect() } else { vec![] },
        ranges,
        node_ids,
        ..MeshPart::default()
    }
}

/// A displacement in lower form that the reader knows too.
fn displacement(part: &MeshPart) -> Vec<f64> {
    part.coords.iter().flat_map(|[x, y, z]| [1e-3 * x + 2e-3 * y, 1e-3 * z, 5e-3 * z + 1e-3 * x * y]).collect()
}
