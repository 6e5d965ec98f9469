//! Everything that reads files, as a library, on files that are harmed at random with fixed seeds: an answer or an
//! error with the right code, in time, without more memory than the file is worth, and never a panic.
//! `RAILSQUEAL_FUZZ` says how many (`scripts/validate readers`).

use railsqueal::body::matrix_files::{self, dofs, Format, Source};
use railsqueal::grid::ContactGrid;
use railsqueal::job::{range, Job};
use railsqueal::mesh::{inp, msh, CellKind, Facet, Mesh};
use railsqueal::output::{survey, Reader, Segments, Table};
use railsqueal::placement::read::{profile_of, ProfileKind, Reading};
use railsqueal::roughness::read::{parse as rough_of, Units};
use railsqueal::{analysis, Error};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Allocator that counts what is read.
#[global_allocator]
static MEMORY: allocator::Counting = allocator::Counting;

/// No file may take a processor longer, nor ten times as long by the clock: others may have the processor.
const SLOW: Duration = Duration::from_secs(2);

/// No file may take more memory than ten times its size and this.
const LARGE: usize = 64 << 20;

/// Time that this thread had a processor; where the system does not tell, by the clock.
fn worked(since: Instant) -> Duration {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text.split(' ').next().and_then(|n| n.parse().ok());
    nanoseconds.map_or_else(|| since.elapsed(), Duration::from_nanos)
}

/// How many files are harmed; fewer by `part` of those that take long.
fn rounds(usual: usize, part: usize) -> usize {
    std::env::var("RAILSQUEAL_FUZZ").ok().and_then(|n| n.parse().ok()).map_or(usual, |n: usize| n.div_ceil(part))
}

/// Numbers below n, the same in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as usize % n.max(1)
    }

    /// One to four faults: bits, bytes, pieces less or twice, ends cut off, numbers in place of others. Half of them
    /// in the first `head` bytes, where counts and names may be.
    fn harm(&mut self, bytes: &mut Vec<u8>, head: usize) {
        const NUMBERS: [&[u8]; 10] =
            [b"1e308", b"-1", b"0", b"1e-300", b"17", b"99999999999", b"1e9", b"null", b"nan", b"\"x\""];
        for _ in 0..1 + self.below(4) {
            let room = if head > 0 && self.below(2) == 0 { head.min(bytes.len()) } else { bytes.len() };
            let at = self.below(room);
            if bytes.is_empty() {
                return;
            }
            match self.below(7) {
                6 => bytes[at] = self.below(256) as u8,
                0 => bytes[at] ^= 1 << self.below(8),
                1 => bytes[at] = b"0123456789.eE+-\"[]{},: \n%*=$S"[self.below(29)],
                2 => drop(bytes.drain(at..(at + 1 + self.below(9)).min(bytes.len()))),
                3 if self.below(4) == 0 => bytes.truncate(at),
                4 => {
                    let piece = bytes[at..(at + self.below(60)).min(bytes.len())].to_vec();
                    bytes.splice(at..at, piece);
                }
                _ => {
                    let number = |b: &u8| b.is_ascii_digit() || b".eE+-".contains(b);
                    let Some(begin) = bytes[at..].iter().position(u8::is_ascii_digit).map(|k| at + k) else { continue };
                    let end = bytes[begin..].iter().position(|b| !number(b)).map_or(bytes.len(), |k| begin + k);
                    bytes.splice(begin..end, NUMBERS[self.below(10)].iter().copied());
                }
            }
        }
    }
}

/// Outcomes of the files.
#[derive(Default)]
struct Count {
    read: usize,
    refused: usize,
    slowest: Duration,
    /// Memory of the file that took most, beside ten times its size.
    largest: usize,
}

impl Count {
    /// Reads a file of `size` bytes, with an answer or an error with one of the codes; `what` shows it.
    fn take<T>(
        &mut self,
        size: usize,
        codes: &[i32],
        what: impl Fn() -> String,
        read: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let begun = Instant::now();
        let before = worked(begun);
        let (result, bytes) = allocator::counted(read);
        let took = worked(begun).saturating_sub(before);
        assert!(took < SLOW && begun.elapsed() < 10 * SLOW, "{took:?} of {:?} for {}", begun.elapsed(), what());
        assert!(bytes < 10 * size + LARGE, "{bytes} bytes for {size}: {}", what());
        self.slowest = self.slowest.max(took);
        self.largest = self.largest.max(bytes.saturating_sub(10 * size));
        match &result {
            Ok(_) => self.read += 1,
            Err(e) => {
                assert!(codes.contains(&e.exit_code()), "{} ({}) for {}", e, e.exit_code(), what());
                self.refused += 1;
            }
        }
        result
    }

    fn say(&self, what: &str) {
        println!(
            "{what}: {} read, {} refused, the slowest in {:.3} s, {} MB beside ten times the file at most",
            self.read,
            self.refused,
            self.slowest.as_secs_f64(),
            self.largest.div_ceil(1_000_000)
        );
        // No harmed segment may be read.
        let read = self.read > 0 || what == "segments";
        assert!(read && self.refused > 0, "{what}: {} read, {} refused", self.read, self.refused);
    }
}

/// A folder for harmed files, in memory where there is such a place: writing takes most of the time elsewhere.
fn scratch() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a folder")
}

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The files of a folder of the project with one of the endings, by name.
fn files(folder: &str, endings: &[&str]) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(project(folder)).expect(folder).flatten().map(|e| e.path());
    let wanted = |p: &PathBuf| p.extension().is_some_and(|e| endings.iter().any(|w| *w == e));
    let mut paths: Vec<PathBuf> = entries.filter(wanted).collect();
    paths.sort();
    let name = |p: &Path| p.file_name().expect("a name").to_string_lossy().into_owned();
    paths.iter().map(|p| (name(p), std::fs::read(p).expect("a file"))).collect()
}

#[test]
fn jobs() {
    let texts = files("jobs", &["json"]);
    let (mut dice, mut count) = (Dice(4), Count::default());
    for round in 0..rounds(1000, 1) {
        let mut bytes = texts[round % texts.len()].1.clone();
        dice.harm(&mut bytes, 0);
        // Whole runs read no more of the job than this before they look at files.
        let read = || -> Result<(), Error> {
            let job = Job::from_bytes(&bytes, Path::new("job.json"), &[], None)?;
            range(&job)?;
            analysis::check(&job)?;
            // What is accepted can be written, and read again.
            let written = job.to_json();
            let again = Job::from_bytes(written.to_string().as_bytes(), Path::new("again.json"), &[], None)?;
            assert_eq!(again.to_json(), written);
            Ok(())
        };
        let _ = count.take(bytes.len(), &[2, 3], || String::from_utf8_lossy(&bytes).into_owned(), read);
    }
    count.say("jobs");
}

/// JSON pointers of all values below one, with their last key that is no index.
fn pointers(value: &serde_json::Value, at: &str, key: &str, into: &mut Vec<(String, String)>) {
    use serde_json::Value;
    if !at.is_empty() {
        into.push((at.to_owned(), key.to_owned()));
    }
    match value {
        Value::Object(map) => map.iter().for_each(|(name, inner)| {
            let escaped = name.replace('~', "~0").replace('/', "~1");
            pointers(inner, &format!("{at}/{escaped}"), name, into);
        }),
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(k, inner)| pointers(inner, &format!("{at}/{k}"), key, into))
        }
        _ => (),
    }
}

/// Every value of every example job is replaced by values of other kinds and sizes: the job is read, or refused with
/// code 2 or 3; a value of another kind that is refused is refused by the name of its key (null leaves the key out).
#[test]
fn odd_values_of_every_key() {
    let odd = [
        json!(null),
        json!(true),
        json!("x"),
        json!(""),
        json!([]),
        json!([1, 2, 3]),
        json!({}),
        json!({ "x": 1 }),
        json!(-1),
        json!(0),
        json!(1e-300),
        json!(1e300),
        json!(0.5),
        json!(7),
        json!(18446744073709551615u64),
    ];
    let kind = |value: &serde_json::Value| std::mem::discriminant(value);
    let (mut count, mut unnamed) = (Count::default(), Vec::new());
    for (name, bytes) in files("jobs", &["json"]) {
        let job: serde_json::Value = serde_json::from_slice(&bytes).expect("a job");
        let mut places = Vec::new();
        pointers(&job, "", "", &mut places);
        for ((pointer, key), value) in places.iter().flat_map(|place| odd.iter().map(move |value| (place, value))) {
            let mut changed = job.clone();
            let place = changed.pointer_mut(pointer).expect("a place");
            let other_kind = kind(place) != kind(value) && !value.is_null();
            *place = value.clone();
            let text = changed.to_string();
            let read = || -> Result<(), Error> {
                let job = Job::from_bytes(text.as_bytes(), Path::new("job.json"), &[], None)?;
                range(&job)?;
                analysis::check(&job)
            };
            let show = || format!("{name}: {pointer} = {value}");
            if let Err(error) = count.take(text.len(), &[2, 3], show, read) {
                if other_kind && !error.message().contains(key.as_str()) {
                    unnamed.push(format!("{}: {error}", show()));
                }
            }
        }
    }
    assert!(unnamed.is_empty(), "{} without the name of the key:\n{}", unnamed.len(), unnamed.join("\n"));
    count.say("odd values");
}

/// Checks that a mesh is consistent: nodes, cells and groups that are there.
fn holds(mesh: &Mesh) {
    assert!(mesh.cells.all_nodes().all(|n| (n as usize) < mesh.nodes.len()));
    let faces = |f: &Facet| mesh.cells.get(f.cell as usize).kind.faces().len();
    let there = |f: &Facet| (f.cell as usize) < mesh.cells.len() && (f.face as usize) < faces(f);
    assert!(mesh.groups.values().flatten().all(there));
    assert!(mesh.cells.iter().all(|c| CellKind::ALL.contains(&c.kind)));
    let _ = ContactGrid::from_mesh(mesh, "contact");
}

/// Meshes through one of the readers; errors name the line or the byte.
fn meshes(seeds: &[(String, Vec<u8>)], what: &str, parse: impl Fn(&[u8], &str) -> Result<Mesh, Error>) {
    let (mut dice, mut count) = (Dice(12345), Count::default());
    for round in 0..rounds(4000, 1) {
        let (name, whole) = &seeds[round % seeds.len()];
        let mut bytes = whole.clone();
        dice.harm(&mut bytes, 600);
        let read = || parse(&bytes, name).inspect(holds);
        if let Err(error) = count.take(bytes.len(), &[3], || format!("{name}:\n{}", bytes.escape_ascii()), read) {
            let places = [format!("{name}, line "), format!("{name}, byte ")];
            assert!(places.iter().any(|p| error.message().starts_with(p)), "{error}");
        }
    }
    count.say(what);
}

#[test]
fn msh_meshes() {
    let mut seeds = files("meshes", &["msh"]);
    seeds.extend(files("tests/data/msh", &["msh"]));
    meshes(&seeds, "meshes (MSH)", msh::parse);
}

#[test]
fn inp_meshes() {
    let sets = "*PART, NAME=P\n*NODE, NSET=All\n1, 0, 0, 0\n2, 1., 0.\n3, 1.0E0, 1.D0, 0\n4, 0, 1, 0\n5, 0, 0, \
     1\n6, 1, 0, 1\n7, 1, 1, 1\n8, 0, 1, 1\n\
        *ELEMENT, TYPE=C3D8R, ELSET=Lower\n1, 1, 2, 3, 4,\n5, 6, 7, 8\n*NSET, NSET=Foot, GENERATE\n1, 4, 1\n*END PART\n\
        *INSTANCE, NAME=I, PART=P\n1, 2, 3\n0, 0, 0, 0, 1, 0, 30\n*END INSTANCE\n*ELSET, ELSET=E, INSTANCE=I\n1\n\
        *SURFACE, NAME=S\nE, S1\n*SURFACE, NAME=N, TYPE=NODE\nI.Foot\n*STEP\n*END STEP\n";
    let mut seeds = files("tests/data/inp", &["inp"]);
    seeds.push(("sets.inp".into(), sets.into()));
    meshes(&seeds, "meshes (INP)", |bytes, name| inp::parse(bytes, name).map(|(mesh, _)| mesh));
}

/// Measured data: profiles in the formats that there are, heights in columns and in a table.
#[test]
fn profiles_and_heights() {
    let worn = files("jobs/profiles", &["txt"]);
    let plain = String::from_utf8(worn[0].1.clone()).expect("text");
    let numbers: Vec<&str> = plain.lines().filter(|l| l.starts_with(|c: char| "-0123456789".contains(c))).collect();
    let miniprof =
        format!("\"ProgramName\"=\"MiniProf\"\n\"XYPOINTS\"=\"{}\"\n\n{}\n", numbers.len(), numbers.join("\n"));
    let simpack = format!(
        "header.begin\n version = 1\n type = 0\nheader.end\nspline.begin\n units.len.f = 1000.\n \
         point.begin\n{}\n point.end\nspline.end\n",
        numbers.join("\n")
    );
    let mut seeds = worn.clone();
    seeds.extend([("a.whl".into(), miniprof.into_bytes()), ("a.prw".into(), simpack.into_bytes())]);
    let (mut dice, mut count) = (Dice(8), Count::default());
    for round in 0..rounds(1000, 1) {
        let (name, whole) = &seeds[round % seeds.len()];
        let mut bytes = whole.clone();
        dice.harm(&mut bytes, 200);
        let text = String::from_utf8_lossy(&bytes);
        let read = || profile_of(name, &text, &Reading::plain(ProfileKind::Wheel));
        let _ = count.take(bytes.len(), &[2, 3], || format!("{name}:\n{text}"), read);
    }
    count.say("profiles");
    let line: String = (0..40).map(|i| format!("{} {}\n", f64::from(i) * 1e-3, f64::from(i * 7 % 11))).collect();
    let row = |i: i32| format!("{}; {}; {}; {}\n", f64::from(i) * 1e-3, i * 5 % 7, i * 3 % 5, i * 7 % 11);
    let area: String = std::iter::once("0; -0.01; 0; 0.01\n".into()).chain((0..40).map(row)).collect();
    let seeds = [format!("# measured\nway height\n{line}"), area];
    let (mut dice, mut count) = (Dice(9), Count::default());
    let units = Units { height: 1e-6, distance: 1.0 };
    for round in 0..rounds(1000, 1) {
        let mut bytes = seeds[round % seeds.len()].clone().into_bytes();
        dice.harm(&mut bytes, 100);
        let text = String::from_utf8_lossy(&bytes);
        let read = || rough_of("heights.txt", &text, units);
        if let Ok(m) = count.take(bytes.len(), &[2, 3], || text.clone().into_owned(), read) {
            assert!(m.height.len() == m.at.len() && m.height.iter().flatten().chain(&m.at).all(|v| v.is_finite()));
        }
    }
    count.say("heights");
}

#[test]
fn matrices() {
    let mut seeds = vec![
        b"%%MatrixMarket matrix coordinate real symmetric\n% a comment\n3 3 5\n1 1 2.0\n2 2 3.5e0\n3 3 1\n2 1 \
         -0.5\n3 2 1e-3\n"
            .to_vec(),
        b"%%MatrixMarket matrix coordinate real general\n2 2 3\n1 1 1\n1 2 4\n2 2 0.25\n".to_vec(),
        b"%%MatrixMarket matrix array real general\n2 2\n1\n2\n3\n4\n".to_vec(),
    ];
    for folder in ["jobs/hulten", "jobs/belt"] {
        seeds.extend(files(folder, &["mtx"]).into_iter().map(|(_, bytes)| bytes));
    }
    let mut seeds: Vec<(Format, Vec<u8>)> = seeds.into_iter().map(|bytes| (Format::MatrixMarket, bytes)).collect();
    seeds.extend(MATRICES.map(|(format, text)| (format, text.as_bytes().to_vec())));
    let folder = scratch();
    let path = folder.path().join("harmed.mtx");
    let (mut dice, mut count) = (Dice(5), Count::default());
    for round in 0..rounds(3000, 1) {
        let (format, mut bytes) = seeds[round % seeds.len()].clone();
        dice.harm(&mut bytes, 0);
        std::fs::write(&path, &bytes).expect("write");
        let show = || String::from_utf8_lossy(&bytes).into_owned();
        let source = Source { path: &path, name: None, format: Some(format) };
        if let Ok(read) = count.take(bytes.len(), &[3, 7], show, || matrix_files::read(&source)) {
            let m = &read.matrix;
            let good = |i| m.row(i).0.iter().all(|&c| (c as usize) < m.n) && m.row(i).1.iter().all(|v| v.is_finite());
            assert!((0..m.n).all(good));
            assert!(read.dofs.is_none_or(|d| d.len() == m.n));
        }
    }
    count.say("matrices");
    let mut count = Count::default();
    for round in 0..rounds(1000, 1) {
        let mut bytes =
            [&b"1.1\n1.2\n1.3\n12.1\n12.6\n"[..], b"Eqn Node DOF\n2 7 UX\n1 7 UY\n3 8 ROTZ\n"][round % 2].to_vec();
        dice.harm(&mut bytes, 0);
        std::fs::write(&path, &bytes).expect("write");
        let show = || String::from_utf8_lossy(&bytes).into_owned();
        if let Ok(mut read) = count.take(bytes.len(), &[3, 7], show, || dofs::read(&path)) {
            let rows = read.len();
            read.sort();
            read.dedup();
            assert_eq!(rows, read.len());
        }
    }
    count.say("degrees of freedom");
}

/// Small matrices in the formats of other programs.
const MATRICES: [(Format, &str); 7] = [
    (Format::Abaqus, "** K\n3,1, 3,1, 4.0\n3,2, 3,1, -1.0\n3,2, 3,2, 3.0\n7,1, 3,1, 0.5\n7,1, 7,1, 2.5D+05\n"),
    (Format::Abaqus, "1 1 4.0\n1 2 -1\n2 1 -1\n2 2 3\n"),
    (Format::CalculiX, "1 1  4.0e+00\n1 2 -1.0e+00\n2 2 3.0e+00\n1 3 5.0e-01\n2 3 0.0e+00\n3 3 2.5e+05\n"),
    (
        Format::Dmig,
        "DMIG    KAAX           0       6       2       0\n\
         DMIG*   KAAX                           3               1\n\
         *                      3               1 4.000000000D+00\n\
         *                      7               1 5.000000000D-01\n\
         DMIG    KAAX           7       1               7       1   2.5+5\n",
    ),
    (Format::Dmig, "DMIG,KAAX,0,1,2,0\nDMIG,KAAX,3,1,,3,1,4.,0.\n,3,2,-1.,,7,1,.5\nDMIG,KAAX,3,2,,3,1,-1.\n"),
    (
        Format::Op4,
        "       2       2       1       2K       1P,3E12.4\n       1       1       2\n  4.0000E+00 -1.0000E+00\n\
         \x20      2       0       3\n  196610\n  3.0000E+00\n       3       1       1\n  1.0000E+00\n",
    ),
    (
        Format::HarwellBoeing,
        "title                                                                   KEY     \n\
         \x20            4             1             1             2             0\n\
         RSA                        2             2             3             0\n\
         (4I4)           (3I4)           (2E12.4)            \n\
         \x20  1   3   4\n   1   2   2\n  4.0000E+00 -1.0000E+00\n  3.0000E+00\n",
    ),
];

/// A stopped run with one of its files harmed is refused, or has steps that were written.
#[test]
fn segments() {
    let folder = scratch();
    let (result, place) = (folder.path().join("run.h5"), folder.path().join("run.transient"));
    {
        let segments = Segments::claim(&result, false).expect("a folder");
        segments.start_run(json!({ "a": 0.1 })).expect("a run");
        let state = |step: i64| Table::scalar("/checkpoint/step", "1", "Steps.", step);
        segments.write(0, &[state(0)]).expect("the start");
        for last in [3u64, 6, 8] {
            let times: Vec<f64> = (0..3).map(|k| (last + k) as f64).collect();
            let times = Table::list("/transient/time", "s", "Times.", times).extendible();
            segments.write(last, &[state(last as i64), times]).expect("a segment");
        }
    }
    let mut files: Vec<PathBuf> = std::fs::read_dir(&place).expect("segments").flatten().map(|e| e.path()).collect();
    files.sort();
    let whole: Vec<Vec<u8>> = files.iter().map(|f| std::fs::read(f).expect("a file")).collect();
    let (mut dice, mut count) = (Dice(6), Count::default());
    for _ in 0..rounds(300, 10) {
        let which = dice.below(files.len());
        let mut bytes = whole[which].clone();
        dice.harm(&mut bytes, 0);
        if bytes == whole[which] {
            continue;
        }
        std::fs::write(&files[which], &bytes).expect("write");
        let read = || -> Result<(), Error> {
            let segments = Segments::reopen(&result)?;
            segments.verify()?;
            // Only the manifest can have lost what came last, with the segments that it no longer names refused.
            assert_eq!(segments.done(), 8);
            segments.open_first().map(drop)
        };
        let _ = count.take(bytes.len(), &[2, 3], || files[which].display().to_string(), read);
        std::fs::write(&files[which], &whole[which]).expect("write");
    }
    assert_eq!(count.read, 0, "harmed files that were read");
    // And as they were written they are.
    let read = || Segments::reopen(&result).and_then(|s| s.verify());
    Count::default().take(1, &[], String::new, read).expect("a whole run");
    count.say("segments");
}

/// Damage to the size of a dataset alone does not ask for memory.
#[test]
fn a_dataset_is_not_larger_than_its_file() {
    const COUNT: u64 = 3701;
    let folder = scratch();
    let segments = Segments::claim(&folder.path().join("run.h5"), false).expect("a folder");
    segments.start_run(json!({ "a": 0.1 })).expect("a run");
    let values = || (0..COUNT).map(|k| k as f64).collect::<Vec<_>>();
    let step = Table::scalar("/checkpoint/step", "1", "Steps.", 0i64);
    let plain = Table::list("/checkpoint/plain", "1", "Values.", values());
    let grown = Table::list("/transient/grown", "1", "Values.", values()).extendible();
    segments.write(0, &[step, plain, grown]).expect("the start");
    let entries = std::fs::read_dir(folder.path().join("run.transient")).expect("segments").flatten().map(|e| e.path());
    let file = entries.into_iter().find(|p| p.extension().is_some_and(|e| e == "h5")).expect("a segment");
    let names = ["/checkpoint/plain", "/transient/grown"];
    let whole = Reader::open(&file).expect("a file");
    assert!(names.iter().all(|name| whole.numbers(name).expect(name).1 == values()));
    drop(whole);
    let mut bytes = std::fs::read(&file).expect("read");
    for at in 0..bytes.len() - 8 {
        if bytes[at..at + 8] == COUNT.to_le_bytes() {
            bytes[at..at + 8].copy_from_slice(&(1u64 << 33).to_le_bytes());
        }
    }
    std::fs::write(&file, &bytes).expect("write");
    let reader = Reader::open(&file).expect("a file");
    for name in names {
        let (read, bytes) = allocator::counted(|| reader.read(name));
        let error = read.expect_err(name);
        assert!(error.exit_code() == 3 && bytes < LARGE, "{bytes} bytes, {error}");
        assert!(error.message().contains("by its shape"), "{error}");
    }
}

/// Process started by [`results`]: one process that reads the files named in the environment.
#[test]
fn a_process_that_reads() {
    let Some(files) = std::env::var_os("RAILSQUEAL_READ") else { return };
    let files = files.into_string().expect("names");
    // What the process has used at most, and uses, byte: libhdf5 takes memory past Rust, whose own is counted. It
    // gets no more than the limit that the process gives itself; what goes beyond is refused, as in the program.
    let taken = || -> Option<[usize; 2]> {
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        let of = |key| Some(1024 * status.split(key).nth(1)?.split_whitespace().next()?.parse::<usize>().ok()?);
        Some([of("VmHWM:")?, of("VmRSS:")?])
    };
    let mut before = None;
    for file in files.lines().map(Path::new) {
        let size = std::fs::metadata(file).expect("a file").len() as usize;
        // The first one is whole: with it the library itself has been started.
        let (_, bytes) = allocator::counted(|| survey(file, false));
        assert!(bytes < 10 * size + LARGE, "{bytes} bytes for {size}");
        let Some([peak, now]) = taken() else { continue };
        let room = 10 * size + LARGE;
        assert!(before.is_none_or(|b| peak < b + room), "{peak} bytes for {size}, {before:?} before");
        before = before.max(Some(now));
    }
}

/// Result files that a later run takes up are read by a process of its own: it may be ended by libhdf5, and must come
/// to its end. One process reads some of them; where it is ended each gets one of its own.
#[test]
fn results() {
    const TOGETHER: usize = 40;
    let seeds = ["two-cylinders", "hulten"].map(|n| std::fs::read(project(&format!("tests/golden/{n}.h5"))).expect(n));
    let folder = scratch();
    let paths: Vec<PathBuf> = (0..TOGETHER).map(|k| folder.path().join(format!("{k}.h5"))).collect();
    let (mut dice, mut ended, mut crashed, mut slowest) = (Dice(7), 0, 0, Duration::ZERO);
    let mut read = |files: &[PathBuf]| {
        let begun = Instant::now();
        let whole = project("tests/golden/two-cylinders.h5");
        let names: Vec<String> = std::iter::once(&whole).chain(files).map(|f| f.display().to_string()).collect();
        let mut command = Command::new(std::env::current_exe().expect("this test"));
        command.args(["--exact", "a_process_that_reads", "--nocapture"]).env("RAILSQUEAL_READ", names.join("\n"));
        let output = command.stdin(Stdio::null()).output().expect("a process");
        slowest = slowest.max(begun.elapsed());
        assert!(begun.elapsed() < 20 * SLOW, "{:?}", begun.elapsed());
        // A test that fails ends with 101, the code of a panic; by libhdf5, or for want of memory, it ends by a signal.
        assert_ne!(output.status.code(), Some(101), "{}", String::from_utf8_lossy(&output.stderr));
        output.status.success()
    };
    for first in (0..rounds(40, 10)).step_by(TOGETHER) {
        let some = &paths[..TOGETHER.min(rounds(40, 10) - first)];
        for path in some {
            let whole = &seeds[usize::from(dice.below(4) == 0)];
            let mut bytes = whole.clone();
            match dice.below(3) {
                // Metadata lie at the beginning.
                0 => (0..4).for_each(|_| bytes[dice.below(8192)] ^= 1 << dice.below(8)),
                1 => (0..4).for_each(|_| bytes[dice.below(whole.len())] ^= 1 << dice.below(8)),
                _ => dice.harm(&mut bytes, 8192),
            }
            std::fs::write(path, &bytes).expect("write");
        }
        let good = match read(some) {
            true => some.len(),
            false => some.iter().filter(|path| read(std::slice::from_ref(*path))).count(),
        };
        ended += good;
        crashed += some.len() - good;
    }
    println!(
        "results: {ended} read or refused, {crashed} ended by libhdf5 or for want of memory, {TOGETHER} in a \
         process took {:.3} s at most",
        slowest.as_secs_f64()
    );
    assert!(ended > crashed, "{ended} read or refused, {crashed} ended by libhdf5");
}
