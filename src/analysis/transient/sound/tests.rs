//! The record of modal amplitudes and its spectra, without bodies.

use super::*;
use crate::job::Transient;
use serde_json::json;

fn wanted(power: serde_json::Value) -> SoundPower {
    serde_json::from_value(power).expect("sound power")
}

/// Segments in which the amplitudes `q` of a time (s), `[m]`, are kept at every multiple of `interval` from the first
/// on to `count`, some in each; the first segment holds none.
fn record(folder: &tempfile::TempDir, interval: f64, count: usize, q: impl Fn(usize, f64) -> Vec<f64>) -> Segments {
    let segments = Segments::claim(&folder.path().join("run.h5"), false).expect("a folder");
    segments.start_run(serde_json::Value::Null).expect("a run");
    segments.write(0, &[Table::scalar("/checkpoint/step", "1", "Steps.", 0i64)]).expect("the start");
    for first in (1..=count).step_by(700) {
        let rows = first..(first + 700).min(count + 1);
        let times: Vec<f64> = rows.clone().map(|k| k as f64 * interval).collect();
        let values: Vec<Vec<f64>> = rows.clone().zip(&times).map(|(k, &t)| q(k, t)).collect();
        let shape = [times.len(), values[0].len()];
        let tables = [
            Table::list("/sound/time", "s", "Times.", times),
            Table::new("/sound/displacement", "m kg^1/2", "Amplitudes.", &shape, values.concat()),
        ];
        segments.write(rows.end as u64, &tables).expect("a segment");
    }
    segments
}

/// Mean square of each channel by the spectra of all pieces, `[pieces][m]`.
fn mean_squares(sound: &Sound<'_>, from: f64, segments: &Segments) -> Result<Vec<Vec<f64>>> {
    let welch = Welch::new(1.0 / sound.interval, resolving_time(sound.wanted.min_frequency));
    let mut found = Vec::new();
    let pieces = sound.spectra((from, None), segments, &welch, |x| {
        let square = |lines: &Vec<Complex64>| lines.iter().map(|z| z.norm_sqr()).sum::<f64>() * welch.spacing();
        found.push(x.iter().map(square).collect::<Vec<f64>>());
    })?;
    assert_eq!(pieces, found.len());
    Ok(found)
}

/// Harmonic motions keep their velocity to the highest frequency wanted, though it is the mean over an interval that
/// is sampled; and of a motion so fast that it appears at this frequency no more than a fifth is left, without
/// samples beyond need.
#[test]
fn velocities_are_kept_to_the_highest_frequency_and_faster_ones_hardly_appear() {
    let wanted = wanted(json!({ "min_frequency": 200, "max_frequency": 1300 }));
    let bands = bands_within(KEY, &wanted, 1e4).expect("bands");
    let highest = bands.highest();
    for step in [1e-5, 7.3e-5] {
        let sound = Sound::of(&wanted, bands, (step, 1));
        assert!((sound.interval - sound.stride() as f64 * step).abs() < 1e-18);
        let image = 1.0 / sound.interval - highest;
        let tones = [0.3 * highest, 0.7 * highest, 0.99 * highest, image];
        let velocity = [1.0, 2.0, 0.3, 1.0];
        let folder = tempfile::tempdir().expect("a folder");
        let segments = record(&folder, sound.interval, 2000, |_, t| {
            tones.iter().zip(velocity).map(|(f, v)| v / (2.0 * PI * f) * (2.0 * PI * f * t).sin()).collect()
        });
        let found = mean_squares(&sound, 0.0, &segments).expect("spectra");
        assert!(found.len() > 2, "{} pieces", found.len());
        for squares in found {
            for k in 0..3 {
                let ratio = (2.0 * squares[k]).sqrt() / velocity[k];
                assert!((ratio - 1.0).abs() < 2e-3, "{} Hz, step {step} s: {ratio} of the velocity", tones[k]);
            }
            let left = (2.0 * squares[3]).sqrt();
            assert!(left < 0.2 * (1.0 + 2e-3), "{left} of a motion at {image} Hz is left at {highest} Hz");
            let coarser = (sound.stride() + 1) as f64 * step;
            assert!(1.0 / (coarser * highest) < 6.0, "{} samples per period would do", 1.0 / (coarser * highest));
        }
    }
    // A step that is too long as it is.
    assert_eq!(Sound::of(&wanted, bands, (1e-3, 1)).stride(), 1);
}

/// No piece contains the record before `from` or the remainder before the first piece; the last sample belongs to one.
#[test]
fn pieces_begin_after_from_and_end_with_the_record() {
    let wanted = wanted(json!({ "min_frequency": 200, "max_frequency": 1300 }));
    let sound = Sound::of(&wanted, bands_within(KEY, &wanted, 1e4).expect("bands"), (1e-5, 1));
    let welch = Welch::new(1.0 / sound.interval, resolving_time(200.0));
    let (before, after) = (welch.hop() + 123, 3 * welch.hop() + 41);
    let count = before + after;
    // The first sample from `from` on is number `before`; there are `after` mean velocities, of which the first 41
    // are in no piece.
    assert_eq!(welch.pieces(after), (2, 41));
    let from = before as f64 * sound.interval;
    let folder = tempfile::tempdir().expect("a folder");
    let at = |yes: bool, value: f64| if yes { value } else { 0.0 };
    let segments = record(&folder, sound.interval, count, |k, _| {
        vec![at(k < before, (k as f64).sin()), at(k < before + 41, 1.0), at(k == count, 1.0), at(k == before + 43, 1.0)]
    });
    let found = mean_squares(&sound, from, &segments).expect("spectra");
    assert_eq!(found.len(), 2);
    assert!(found.iter().all(|s| s[0] == 0.0), "from before `from`: {found:?}");
    assert!(found.iter().all(|s| s[1] == 0.0), "from before the first piece: {found:?}");
    assert!(found[0][2] == 0.0 && found[1][2] > 0.0, "of the last sample: {found:?}");
    assert!(found[0][3] > 0.0 && found[1][3] == 0.0, "of the third sample: {found:?}");

    // A sample that is missing.
    let rows = |first: usize| {
        [
            Table::list("/sound/time", "s", "Times.", vec![first as f64 * sound.interval]),
            Table::new("/sound/displacement", "m kg^1/2", "Amplitudes.", &[1, 1], vec![0.0]),
        ]
    };
    segments.write(10_000_000, &rows(count + 2)).expect("a segment");
    let error = mean_squares(&sound, from, &segments).expect_err("a sample is missing");
    assert!(error.message().contains("jump from"), "{error}");
}

/// A run that is not refused has a piece at least, however `from` and the steps fall; one that is refused falls short
/// by a few samples at most.
#[test]
fn a_record_that_is_accepted_is_long_enough() {
    let mut least = usize::MAX;
    for step in [1e-5, 1.37e-5, 4e-5, 3e-4, 9.1e-4] {
        for k in 0..40 {
            let from = 0.3 + 0.0137 * step * f64::from(k * k) + f64::from(k) * 1e-4;
            for min_frequency in [100.0, 160.0, 200.0] {
                let run = |there: f64| -> Transient {
                    let power = json!({ "from": from, "min_frequency": min_frequency });
                    serde_json::from_value(json!({ "duration": from + there, "step": step, "sound_power": power }))
                        .expect("a transient")
                };
                let time = resolving_time(min_frequency);
                let (mut short, mut long) = (time, 2.0 * time + 10.0 * step);
                assert!(check(&run(short)).is_err() && check(&run(long)).is_ok());
                while long - short > 1e-9 {
                    let middle = 0.5 * (short + long);
                    *if check(&run(middle)).is_ok() { &mut long } else { &mut short } = middle;
                }
                let job = run(long);
                let wanted = job.sound_power.as_ref().expect("sound");
                // The lowest band alone, where the samples are farthest apart.
                let sound = Sound::of(wanted, Bands::spanning(min_frequency, min_frequency), (step, 1));
                let total = (job.duration / step).round() as u64;
                let rows = |from: f64| {
                    let times = (1..=total / sound.stride()).map(|k| k as f64 * sound.interval);
                    times.filter(|t| *t >= from - 1e-9 * sound.interval).count()
                };
                let welch = Welch::new(1.0 / sound.interval, time);
                let (found, needed) = (rows(begin(&job, wanted)) - 1, welch.length());
                assert!(found >= needed, "step {step} s, {min_frequency} Hz, from {from} s: {found} of {needed}");
                let sample = step.max(1.0 / (6.0 * sound.bands.highest()));
                assert!(long - time < 4.0 * sample + 1e-8, "{} s more than {time} s", long - time);
                least = least.min(found - needed);
            }
        }
    }
    assert!(least < 2, "all records are {least} samples longer than they need be");
}

#[test]
fn bands_end_below_the_highest_frequency_wanted_and_below_the_modes() {
    let last = |power: serde_json::Value, reach: f64| {
        bands_within(KEY, &wanted(power), reach).map(|b| b.nominal().last().copied().expect("bands"))
    };
    assert_eq!(last(json!({}), 5000.0).expect("bands"), 4000.0);
    assert_eq!(last(json!({ "max_frequency": 1000 }), 5000.0).expect("bands"), 800.0);
    assert_eq!(last(json!({ "max_frequency": 1123 }), 5000.0).expect("bands"), 1000.0);
    let error = last(json!({ "max_frequency": 5001 }), 5000.0).expect_err("too few modes");
    assert!(error.message().contains("reach 5000.0 Hz"), "{error}");
}

/// A third of the wavelength at the end of the last band, and never more than 3 % of the body: half a wave of 16
/// nodal diameters around a disc is 10 % of its diameter, so three patches at least, however long the waves in the
/// air are.
#[test]
fn patches_resolve_the_waves_in_the_air_and_those_of_the_body() {
    let wanted = wanted(json!({ "sound_speed": 340 }));
    for (reach, size) in [(200.0, 0.03), (5000.0, 340.0 / 3.0 / Bands::spanning(4000.0, 4000.0).highest())] {
        let (bands, air) = (bands_within(KEY, &wanted, reach).expect("bands"), radiation::air(&wanted));
        let found = radiation::patch_sizes((bands, air), 1.0);
        assert!((found[0] - size).abs() < 1e-12 && found[1] == 0.03, "to {reach} Hz: {found:?} for {size}");
        assert_eq!(radiation::patch_sizes((bands, air), 0.5)[1], 0.015);
    }
}

/// The forces at two contacts are averaged over the same intervals as the modes, wherever segments end, and what is
/// constant of them is not heard.
#[test]
fn forces_of_all_steps_become_means_between_the_samples() {
    let wanted = wanted(json!({ "min_frequency": 200, "max_frequency": 1300 }));
    let bands = bands_within(KEY, &wanted, 1e4).expect("bands");
    let step = 1.1e-5;
    let sound = Sound::of(&wanted, bands, (step, 2));
    let stride = sound.stride() as usize;
    assert!(stride > 3, "{stride}");
    let tones = [0.3, 0.6, 0.95, 0.4, 0.7, 0.85].map(|part| part * bands.highest());
    let folder = tempfile::tempdir().expect("a folder");
    let segments = Segments::claim(&folder.path().join("run.h5"), false).expect("a folder");
    segments.start_run(serde_json::Value::Null).expect("a run");
    segments.write(0, &[Table::scalar("/checkpoint/step", "1", "Steps.", 0i64)]).expect("the start");
    let (total, segment) = (2000 * stride, 257);
    for first in (1..=total).step_by(segment) {
        let rows = first..(first + segment).min(total + 1);
        let times: Vec<f64> = rows.clone().map(|k| k as f64 * step).collect();
        let [first, second] = [&tones[..FORCES], &tones[FORCES..]].map(|tones| -> Vec<f64> {
            let at = |t: f64| {
                let each = [2e3, -7e3, -6e4].into_iter().zip(tones);
                each.map(move |(o, f)| o + (2.0 * PI * f * t).sin())
            };
            times.iter().flat_map(|t| at(*t)).collect()
        });
        let samples: Vec<f64> = rows.clone().filter(|k| k % stride == 0).map(|k| k as f64 * step).collect();
        let shape = [times.len(), FORCES];
        let tables = [
            Table::list("/sound/time", "s", "Times.", samples.clone()),
            Table::new("/sound/displacement", "m kg^1/2", "Amplitudes.", &[samples.len(), 1], vec![0.0; samples.len()]),
            Table::list("/transient/time", "s", "Times.", times),
            Table::new("/transient/force", "N", "Forces.", &shape, first),
            Table::new("/transient_2/force", "N", "Forces.", &shape, second),
        ];
        segments.write(rows.end as u64 - 1, &tables).expect("a segment");
    }
    let welch = Welch::new(1.0 / sound.interval, resolving_time(wanted.min_frequency));
    let mut pieces = 0;
    let from = 0.2 * total as f64 * step;
    let found = sound.spectra((from, Some(step)), &segments, &welch, |x| {
        pieces += 1;
        assert_eq!(x.len(), 1 + 2 * FORCES);
        // What is left of the constant part is far below the bands.
        let skip = (100.0 / welch.spacing()) as usize;
        let square = |l: &Vec<Complex64>| l[skip..].iter().map(|z| z.norm_sqr()).sum::<f64>() * welch.spacing();
        let squares: Vec<f64> = x.iter().map(square).collect();
        assert_eq!(squares[0], 0.0);
        for (square, tone) in squares[1..].iter().zip(tones) {
            // Of the sum over steps in place of an integral: x/sin x.
            let x = PI * tone * step;
            let amplitude = (2.0 * square).sqrt() * x.sin() / x;
            assert!((amplitude - 1.0).abs() < 2e-3, "{tone} Hz: {amplitude} N");
        }
    });
    assert_eq!(found.expect("spectra"), pieces);
    assert!(pieces > 2, "{pieces}");
}
