//! Everything that reads files, as a library, on files that are harmed at random with fixed seeds: an answer or an error with the right code, in time,
//! and never a panic. `RAILSQUEAL_FUZZ` says how many (`scripts/validate readers`); mesh files have theirs in `mesh_files.rs` and `mesh/inp`.

use railsqueal::body::matrix_market;
use railsqueal::job::{range, Job};
use railsqueal::output::{Segments, Table};
use railsqueal::{analysis, Error};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// No file may take longer, by much, than one that is whole.
const SLOW: Duration = Duration::from_secs(20);

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

    /// One to four faults: bits, bytes, pieces less or twice, ends cut off, numbers in place of others.
    fn harm(&mut self, bytes: &mut Vec<u8>) {
        const NUMBERS: [&[u8]; 10] =
            [b"1e308", b"-1", b"0", b"1e-300", b"17", b"99999999999", b"1e9", b"null", b"nan", b"\"x\""];
        for _ in 0..1 + self.below(4) {
            let at = self.below(bytes.len());
            if bytes.is_empty() {
                return;
            }
            match self.below(6) {
                0 => bytes[at] ^= 1 << self.below(8),
                1 => bytes[at] = b"0123456789.eE+-\"[]{},: \n%"[self.below(25)],
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

/// What became of the files.
struct Count {
    begun: Instant,
    read: usize,
    refused: usize,
    slowest: Duration,
}

impl Count {
    fn new() -> Self {
        Self { begun: Instant::now(), read: 0, refused: 0, slowest: Duration::ZERO }
    }

    /// Takes the answer about a file; `what` shows it.
    fn take(&mut self, result: Result<(), Error>, codes: &[i32], begun: Instant, what: impl Fn() -> String) {
        self.slowest = self.slowest.max(begun.elapsed());
        assert!(begun.elapsed() < SLOW, "{:?} for {}", begun.elapsed(), what());
        match result {
            Ok(()) => self.read += 1,
            Err(e) => {
                assert!(codes.contains(&e.exit_code()), "{} ({}) for {}", e, e.exit_code(), what());
                self.refused += 1;
            }
        }
    }

    fn say(&self, what: &str) {
        println!(
            "{what}: {} read, {} refused, the slowest in {:.3} s, {:.0} a second",
            self.read,
            self.refused,
            self.slowest.as_secs_f64(),
            (self.read + self.refused) as f64 / self.begun.elapsed().as_secs_f64()
        );
    }
}

/// A folder for harmed files, in memory where there is such a place: writing takes most of the time elsewhere.
fn scratch() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a folder")
}

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

#[test]
fn jobs() {
    let entries = std::fs::read_dir(project("jobs")).expect("jobs").flatten().map(|e| e.path());
    let mut paths: Vec<PathBuf> = entries.filter(|p| p.extension().is_some_and(|e| e == "json")).collect();
    paths.sort();
    let texts: Vec<Vec<u8>> = paths.iter().map(|p| std::fs::read(p).expect("a job")).collect();
    let (mut dice, mut count) = (Dice(4), Count::new());
    for round in 0..rounds(1000, 1) {
        let mut bytes = texts[round % texts.len()].clone();
        dice.harm(&mut bytes);
        let begun = Instant::now();
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
        count.take(read(), &[2, 3], begun, || String::from_utf8_lossy(&bytes).into_owned());
    }
    count.say("jobs");
    assert!(count.read > 0 && count.refused > count.read, "{} read, {} refused", count.read, count.refused);
}

#[test]
fn matrices() {
    let mut seeds = vec![
        b"%%MatrixMarket matrix coordinate real symmetric\n% a comment\n3 3 5\n1 1 2.0\n2 2 3.5e0\n3 3 1\n2 1 -0.5\n3 2 1e-3\n".to_vec(),
        b"%%MatrixMarket matrix coordinate real general\n2 2 3\n1 1 1\n1 2 4\n2 2 0.25\n".to_vec(),
        b"%%MatrixMarket matrix array real general\n2 2\n1\n2\n3\n4\n".to_vec(),
    ];
    for folder in ["jobs/hulten", "jobs/belt"] {
        let entries = std::fs::read_dir(project(folder)).expect("matrices").flatten().map(|e| e.path());
        let mut paths: Vec<PathBuf> = entries.filter(|p| p.extension().is_some_and(|e| e == "mtx")).collect();
        paths.sort();
        seeds.extend(paths.iter().map(|p| std::fs::read(p).expect("a matrix")));
    }
    let folder = scratch();
    let path = folder.path().join("harmed.mtx");
    let (mut dice, mut count) = (Dice(5), Count::new());
    for round in 0..rounds(1000, 1) {
        let mut bytes = seeds[round % seeds.len()].clone();
        dice.harm(&mut bytes);
        std::fs::write(&path, &bytes).expect("write");
        let begun = Instant::now();
        let read = matrix_market::read(&path).map(|m| {
            assert!((0..m.n)
                .all(|i| m.row(i).0.iter().all(|&c| (c as usize) < m.n) && m.row(i).1.iter().all(|v| v.is_finite())));
        });
        count.take(read, &[3, 7], begun, || String::from_utf8_lossy(&bytes).into_owned());
    }
    count.say("matrices");
    assert!(count.read > 0 && count.refused > 0, "{} read, {} refused", count.read, count.refused);
}

/// A stopped run with one of its files harmed is refused, or has steps that were written.
#[test]
fn segments() {
    let folder = scratch();
    let (result, place) = (folder.path().join("run.h5"), folder.path().join("run.transient"));
    {
        let segments = Segments::claim(&result, false).expect("a folder");
        segments.begin(json!({ "a": 0.1 })).expect("a run");
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
    let (mut dice, mut count) = (Dice(6), Count::new());
    for _ in 0..rounds(300, 10) {
        let which = dice.below(files.len());
        let mut bytes = whole[which].clone();
        dice.harm(&mut bytes);
        if bytes == whole[which] {
            continue;
        }
        std::fs::write(&files[which], &bytes).expect("write");
        let begun = Instant::now();
        let read = || -> Result<(), Error> {
            let segments = Segments::reopen(&result)?;
            segments.verify()?;
            // Only the manifest can have lost what came last, with the segments that it no longer names refused.
            assert_eq!(segments.done(), 8);
            segments.open_first().map(drop)
        };
        count.take(read(), &[2, 3], begun, || files[which].display().to_string());
        std::fs::write(&files[which], &whole[which]).expect("write");
    }
    count.say("segments");
    assert_eq!(count.read, 0, "harmed files that were read");
}

/// Result files that a later run takes up are read by a process of its own: it may be ended by libhdf5, and must come to its end. One process reads
/// some of them; where it is ended each gets one of its own.
#[test]
fn results() {
    const TOGETHER: usize = 40;
    let whole = std::fs::read(project("tests/golden/two-cylinders.h5")).expect("a result");
    let folder = scratch();
    let paths: Vec<PathBuf> = (0..TOGETHER).map(|k| folder.path().join(format!("{k}.h5"))).collect();
    let (mut dice, mut ended, mut crashed, mut slowest) = (Dice(7), 0, 0, Duration::ZERO);
    let mut read = |files: &[PathBuf]| {
        let begun = Instant::now();
        let mut command = Command::new(env!("CARGO_BIN_EXE_railsqueal"));
        command.arg("probe").arg("--").args(files).stdout(Stdio::null()).stderr(Stdio::null());
        let good = command.status().expect("a process").success();
        slowest = slowest.max(begun.elapsed());
        assert!(begun.elapsed() < 2 * SLOW, "{:?}", begun.elapsed());
        good
    };
    let begun = Instant::now();
    for first in (0..rounds(40, 10)).step_by(TOGETHER) {
        let some = &paths[..TOGETHER.min(rounds(40, 10) - first)];
        for path in some {
            let mut bytes = whole.clone();
            match dice.below(3) {
                // Metadata lie at the beginning.
                0 => (0..4).for_each(|_| bytes[dice.below(8192)] ^= 1 << dice.below(8)),
                1 => (0..4).for_each(|_| bytes[dice.below(whole.len())] ^= 1 << dice.below(8)),
                _ => dice.harm(&mut bytes),
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
        "results: {ended} read or refused, {crashed} ended by libhdf5, a process took {:.3} s at most, {:.0} a second",
        slowest.as_secs_f64(),
        (ended + crashed) as f64 / begun.elapsed().as_secs_f64()
    );
    assert!(ended > crashed, "{ended} read or refused, {crashed} ended by libhdf5");
}
