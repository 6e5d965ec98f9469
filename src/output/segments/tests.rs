//! Segments that are damaged, lost, put in or copied, and runs that come together.

use super::*;
use crate::progress::Progress;
use serde_json::json;

fn start(folder: &tempfile::TempDir) -> Segments {
    let segments = Segments::claim(&folder.path().join("run.h5"), false).expect("a folder");
    segments.start_run(json!({ "a": 0.1 })).expect("a run");
    segments.write(0, &[Table::scalar("/checkpoint/step", "1", "Steps.", 0i64)]).expect("the start");
    for last in [3, 6, 8] {
        segments.write(last, &rows(last)).expect("a segment");
    }
    segments
}

/// The times of the steps of the segment that ends with `last`.
fn rows(last: u64) -> [Table; 2] {
    let first = if last > 6 { 7 } else { last - 2 };
    let times: Vec<f64> = (first..=last).map(|k| k as f64).collect();
    [
        Table::scalar("/checkpoint/step", "1", "Steps.", last as i64),
        Table::list("/transient/time", "s", "Times.", times),
    ]
}

fn reopen(folder: &tempfile::TempDir) -> Result<Segments> {
    let segments = Segments::reopen(&folder.path().join("run.h5"))?;
    segments.verify()?;
    Ok(segments)
}

/// The error of a run that is continued although `harm` was done to its folder.
#[track_caller]
fn refused(harm: impl Fn(&Path), code: i32, parts: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    drop(start(&folder));
    harm(&folder.path().join("run.transient"));
    let error = reopen(&folder).expect_err("this must be refused");
    assert_eq!(error.exit_code(), code, "{error}");
    for part in parts {
        assert!(error.to_string().contains(part), "no {part:?} in: {error}");
    }
}

#[test]
fn every_flipped_bit_of_a_segment_or_the_manifest_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    drop(start(&folder));
    let place = folder.path().join("run.transient");
    let mut state = 7u64;
    let mut flips = 0;
    for name in ["manifest", "000000000000.h5", "000000000006.h5", "000000000008.h5"] {
        let path = place.join(name);
        let whole = std::fs::read(&path).expect("read");
        for _ in 0..60 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let at = (state >> 33) as usize % whole.len();
            let mut bytes = whole.clone();
            bytes[at] ^= 1 << ((state >> 20) % 8);
            std::fs::write(&path, &bytes).expect("write");
            let error = reopen(&folder).expect_err("a flipped bit");
            // Without the end of its last line the manifest has that line no more, and its segment is one too many.
            assert_eq!(error.exit_code(), 3, "bit at {at} of {name}: {error}");
            flips += 1;
        }
        std::fs::write(&path, &whole).expect("write");
    }
    assert_eq!(flips, 240);
    assert_eq!(reopen(&folder).expect("it is whole again").done(), 8);
}

#[test]
fn what_is_cut_off_lost_put_in_or_exchanged_is_refused() {
    let read = |place: &Path, name: &str| std::fs::read(place.join(name)).expect("read");
    let write = |place: &Path, name: &str, bytes: &[u8]| std::fs::write(place.join(name), bytes).expect("write");
    let six = "000000000006.h5";
    refused(|p| write(p, six, &read(p, six)[..100]), 3, &[six, "found 100 bytes", "remove it and all"]);
    refused(|p| std::fs::remove_file(p.join(six)).expect("remove"), 3, &[six, "missing", "remove all after"]);
    refused(|p| write(p, six, &read(p, "000000000003.h5")), 3, &[six, "as it was written"]);
    refused(|p| write(p, "000000000007.h5", &read(p, six)), 3, &["000000000007.h5", "another run", "remove it"]);
    let start = "000000000000.h5";
    refused(|p| std::fs::remove_file(p.join(start)).expect("remove"), 3, &["first segment is missing", "--force"]);
    refused(|p| std::fs::remove_file(p.join("manifest")).expect("remove"), 2, &["without a manifest"]);
    let lines = |p: &Path| String::from_utf8(read(p, "manifest")).expect("text");
    // A line less, in the middle and at the end.
    refused(
        |p| {
            write(
                p,
                "manifest",
                lines(p).replacen(&lines(p).lines().nth(2).expect("line").to_owned(), "", 1).as_bytes(),
            )
        },
        3,
        &["manifest", "line 3"],
    );
    refused(
        |p| {
            write(
                p,
                "manifest",
                lines(p).rsplit_once("\n").and_then(|(all, _)| all.rsplit_once("\n")).expect("lines").0.as_bytes(),
            )
        },
        3,
        &["000000000006.h5", "does not name"],
    );
    let other = tempfile::tempdir().expect("a folder");
    let strange = Segments::claim(&other.path().join("run.h5"), false).expect("a folder");
    strange.start_run(json!({ "a": 0.2 })).expect("a run");
    strange.write(0, &rows(3)).expect("a segment");
    let force = Table::list("/transient/force", "N", "Forces.", vec![0.25; 3]);
    strange.write(3, &[&rows(3)[..], &[force]].concat()).expect("a segment");
    // Of another run, with times that are the same.
    refused(|p| write(p, "000000000003.h5", &read(strange.folder(), "000000000003.h5")), 3, &["000000000003.h5"]);
}

/// A kill between the manifest and the name of the segment, and what users are told to do.
#[test]
fn segments_missing_at_the_end_are_made_again() {
    let folder = tempfile::tempdir().expect("a folder");
    drop(start(&folder));
    let place = folder.path().join("run.transient");
    std::fs::remove_file(place.join("000000000006.h5")).expect("remove");
    std::fs::remove_file(place.join("000000000008.h5")).expect("remove");
    // The beginning of a line, too.
    let mut manifest = std::fs::read(place.join("manifest")).expect("read");
    manifest.extend(b"0123abc {\"segm");
    std::fs::write(place.join("manifest"), manifest).expect("write");
    std::fs::write(place.join(".000000000009.h5.host-1.partial"), "x").expect("write");
    let segments = reopen(&folder).expect("what is left");
    assert_eq!(segments.done(), 3);
    segments.go_on(json!({ "a": 0.1 })).expect("go on");
    for last in [6, 8] {
        segments.write(last, &rows(last)).expect("a segment");
    }
    drop(segments);
    let segments = reopen(&folder).expect("whole");
    assert_eq!(segments.parts().iter().map(|p| p.step).collect::<Vec<_>>(), [0, 3]);
    assert!(segments.complete(9).is_err() && segments.complete(7).is_err());
    segments.complete(8).expect("all steps");
    let target = folder.path().join("all.h5");
    hdf5::File::create(&target).expect("a file").close().expect("closed");
    append_to(&target, &segments, "/transient", &mut Progress::new(false)).expect("merged");
    let (_, times) = Reader::open(&target).expect("open").numbers("/transient/time").expect("times");
    assert_eq!(times, (1..=8).map(f64::from).collect::<Vec<_>>());
    segments.remove();
    drop(segments);
    assert_eq!(std::fs::read_dir(folder.path()).expect("list").count(), 1, "all.h5 alone");
}

#[test]
fn two_runs_cannot_have_the_same_segments() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = folder.path().join("run.h5");
    let segments = start(&folder);
    for error in [Segments::claim(&result, true).map(drop), Segments::reopen(&result).map(drop)] {
        let text = error.expect_err("it is locked").to_string();
        let process = format!("process {}", std::process::id());
        assert!(text.contains("another run is at work") && text.contains(&process), "{text}");
    }
    drop(segments);
    let error = Segments::claim(&result, false).map(drop).expect_err("unfinished");
    assert!(error.to_string().contains("--resume") && error.to_string().contains("run.h5"), "{error}");
    let again = Segments::claim(&result, true).expect("with force");
    assert_eq!(again.entries().len(), 4, "nothing is lost before the steps");
    again.start_run(json!({})).expect("anew");
    assert!(again.entries().is_empty());
}

/// A kill after the results were published, while the segments are removed: the run is over, and nothing is in the
/// way of the next.
#[test]
fn a_run_whose_results_are_published_is_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = folder.path().join("run.h5");
    let segments = start(&folder);
    segments.held.manifest.borrow_mut().merge().expect("merged");
    std::fs::remove_file(segments.path(&segments.entries()[0])).expect("remove");
    drop(segments);
    let error = Segments::reopen(&result).map(drop).expect_err("over");
    assert!(error.to_string().contains("came to its end"), "{error}");
    let next = Segments::claim(&result, false).expect("nothing in the way");
    next.start_run(json!({})).expect("begun");
    assert!(next.entries().is_empty() && numbered(next.folder()).expect("list").is_empty());
}

#[test]
fn nothing_is_left_of_a_run_that_did_not_begin() {
    let folder = tempfile::tempdir().expect("a folder");
    drop(Segments::claim(&folder.path().join("run.h5"), false).expect("a folder"));
    assert_eq!(std::fs::read_dir(folder.path()).expect("list").count(), 0);
}

/// Chunks go into the main file as they are, also behind a segment that ended between two of them.
#[test]
fn segments_are_put_together_whether_their_chunks_fit_or_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let segments = Segments::claim(&folder.path().join("run.h5"), false).expect("a folder");
    segments.start_run(json!({})).expect("a run");
    let step = |last: u64| Table::scalar("/checkpoint/step", "1", "Steps.", last as i64);
    segments.write(0, &[step(0)]).expect("the start");
    let row = |k: u64| (0..200).map(move |c| (k as f64 + 0.01 * f64::from(c)).sin());
    let mut first = 1;
    // Multiples of ten but for one that was cut short, and what continues it.
    for last in [10, 20, 27, 30, 40] {
        let rows = (last - first + 1) as usize;
        let wide: Vec<f64> = (first..=last).flat_map(row).collect();
        let times: Vec<f64> = (first..=last).map(|k| k as f64).collect();
        let wide = Table::new("/transient/wide", "N", "Forces.", &[rows, 200], wide).in_chunks(5);
        let times = Table::list("/transient/time", "s", "Times.", times).in_chunks(10);
        segments.write(last, &[step(last), wide, times]).expect("a segment");
        first = last + 1;
    }
    let target = folder.path().join("all.h5");
    hdf5::File::create(&target).expect("a file").close().expect("closed");
    append_to(&target, &segments, "/transient", &mut Progress::new(false)).expect("merged");
    let all = Reader::open(&target).expect("open");
    assert_eq!(all.numbers("/transient/wide").expect("wide"), (vec![40, 200], (1..=40).flat_map(row).collect()));
    assert_eq!(all.numbers("/transient/time").expect("times").1, (1..=40).map(|k| k as f64).collect::<Vec<_>>());
    assert_eq!(all.attribute("/transient/wide", "units").expect("units"), "N");
    let wide = all.dataset("/transient/wide").expect("wide");
    assert_eq!((wide.chunk(), wide.num_chunks()), (Some(vec![5, 200]), Some(8)));
    // The times of ten steps are too few for a chunk of their own.
    assert!(all.dataset("/transient/time").expect("times").chunk().is_some_and(|chunk| chunk[0] > 1000));
    // As they lie in the first segment.
    let segment = segments.open(&segments.entries()[1]).expect("a segment");
    let sizes = |of: &hdf5::Dataset| (0..2).map(|k| of.chunk_info(k).expect("a chunk").size).collect::<Vec<_>>();
    assert_eq!(sizes(&wide), sizes(&segment.dataset("/transient/wide").expect("wide")));
}

/// Message without segments: of a run that ended before its first one the model is named, as long as it lies there.
#[test]
fn without_segments_the_model_is_pointed_to() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = folder.path().join("run.h5");
    let model = folder.path().join("run.model.h5");
    let refused = |parts: &[&str]| {
        let error = Segments::reopen(&result).and_then(|s| s.verify()).expect_err("nothing to continue");
        assert_eq!(error.exit_code(), 2, "{error}");
        parts.iter().for_each(|part| assert!(error.to_string().contains(part), "no {part:?} in: {error}"));
        error.to_string()
    };
    let reuse = format!("run its job with --reuse {}", model.display());
    assert!(!refused(&["nothing to continue", "name the result file"]).contains("model"));
    std::fs::write(&model, "model").expect("write");
    refused(&["nothing to continue", &reuse]);
    // Killed when the run was begun, and when its first segment was announced: the manifest is there, and the segment
    // is not.
    let segments = Segments::claim(&result, false).expect("a folder");
    segments.start_run(json!({ "a": 0.1 })).expect("a run");
    drop(segments);
    refused(&["nothing to continue", &reuse]);
    let segments = Segments::claim(&result, false).expect("nothing in the way");
    segments.start_run(json!({ "a": 0.1 })).expect("a run");
    segments.write(0, &[Table::scalar("/checkpoint/step", "1", "Steps.", 0i64)]).expect("the start");
    let place = segments.folder().to_owned();
    let start = segments.path(&segments.entries()[0]);
    drop(segments);
    // The model of a run with segments is no matter.
    Segments::reopen(&result).and_then(|s| s.verify()).expect("a run");
    std::fs::remove_file(&start).expect("remove");
    refused(&["nothing to continue", &reuse]);
    std::fs::remove_file(&model).expect("remove");
    refused(&["has no segment", "--force"]);
    // A manifest that has lost its lines.
    std::fs::write(&start, "a segment").expect("write");
    std::fs::write(place.join("manifest"), "").expect("write");
    refused(&["without a manifest"]);
}
