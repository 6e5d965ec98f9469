//! Pads fitted to decay rates through the whole program: rates of known pads, of a beam in closed form and of another
//! program, and refusals.

use super::program::*;
use super::transient::open;
use num_complex::Complex64;
use railsqueal::fem::ElasticMaterial;
use railsqueal::rails::R60E1;
use railsqueal::swept::BuiltRail;
use serde_json::{json, Value};
use std::f64::consts::PI;
use std::fmt::Write;

/// Pads that are to be found: stiffness vertical and lateral, N/m, and loss factor.
const KNOWN: [f64; 3] = [300e6, 70e6, 0.25];
const KEYS: [&str; 3] = ["vertical", "lateral", "loss_factor"];
/// Bands that the fits take, so that they are fast.
const BAND: [&str; 2] = ["--band", "250,1000"];

/// The job with one frequency a band, on these pads.
fn job_on(pads: [f64; 3]) -> Value {
    let mut job = job("track-decay.json");
    job["analyses"]["track_decay"] = json!({ "lines": 1 });
    for (key, value) in KEYS.iter().zip(pads) {
        job["bodies"]["lower"]["track"]["pad"][key] = json!(value);
    }
    job
}

/// A table of decay rates: band, vertical, lateral.
fn table(rows: &[[f64; 3]]) -> String {
    let mut text = "frequency [Hz];vertical [dB/m];lateral [dB/m]\n".to_owned();
    rows.iter().for_each(|[band, vertical, lateral]| writeln!(text, "{band};{vertical};{lateral}").expect("text"));
    text
}

/// Decay rates of a job, by the program.
fn computed(folder: &Folder) -> Vec<[f64; 3]> {
    folder.call(1, "run", &[]).good();
    let file = open(folder.path("job.h5"));
    let read = |name: &str| -> Vec<f64> {
        file.dataset(&format!("track_decay/{name}")).and_then(|d| d.read_raw()).expect("decay rates")
    };
    let [bands, vertical, lateral] = ["frequency", "vertical", "lateral"].map(read);
    (0..bands.len()).map(|k| [bands[k], vertical[k], lateral[k]]).collect()
}

/// The pads of the job that a fit wrote.
fn fitted(folder: &Folder) -> [f64; 3] {
    let text = std::fs::read(folder.path("job-fit.json")).expect("a fitted job");
    let job: Value = serde_json::from_slice(&text).expect("JSON");
    KEYS.map(|key| job["bodies"]["lower"]["track"]["pad"][key].as_f64().expect("a number"))
}

/// Deviations of the keys, in percent, as a fit prints them.
fn deviations(out: &str) -> Vec<f64> {
    let lines = out.lines().filter(|line| line.starts_with("  ") && line.ends_with(" %"));
    lines.filter_map(|line| line.trim_end_matches(" %").split_whitespace().last()?.parse().ok()).collect()
}

fn fit(folder: &Folder, ranks: usize, more: &[&str]) -> Ran {
    folder.call(ranks, "fit", &[&["--decay", &folder.text("rates.csv")], more].concat())
}

/// Rates without noise give the pads to three digits and more, also from pads with another minimum beside them, on one
/// and two ranks the same; the job that is written has these rates.
#[test]
fn pads_are_found_from_their_decay_rates() {
    let truth = Folder::with(job_on(KNOWN).to_string());
    let rows = computed(&truth);
    let folder = Folder::with(job_on([20e6, 5e6, 0.2]).to_string());
    std::fs::write(folder.path("rates.csv"), table(&rows)).expect("write");
    let ran = fit(&folder, 1, &BAND);
    for part in [
        "decay rates (vertical, lateral) of 7 bands from 250 to 1000 Hz",
        "left out: 1250, ",
        "0.00 dB fitted",
        "another minimum",
    ] {
        assert!(ran.good().out.contains(part), "no {part:?} in: {}", ran.out);
    }
    let found = fitted(&folder);
    for (found, known) in found.iter().zip(KNOWN) {
        assert!((found / known - 1.0).abs() < 1e-3, "{found} for {known}");
    }
    let job = std::fs::read_to_string(folder.path("job-fit.json")).expect("a fitted job");
    let again = Folder::with(&job);
    for (one, other) in rows.iter().zip(computed(&again)) {
        assert!(one.iter().zip(other).all(|(a, b)| (a / b - 1.0).abs() < 1e-3), "{one:?} and {other:?}");
    }
    fit(&folder, 2, &BAND).good();
    assert_eq!(std::fs::read_to_string(folder.path("job-fit.json")).expect("a fitted job"), job);
}

/// Rates with a scatter of 5 %: the pads lie within three of the deviations that are told, and those are of the size
/// of the scatter.
#[test]
fn scatter_is_in_the_deviations() {
    let truth = Folder::with(job_on(KNOWN).to_string());
    let rows = computed(&truth);
    for seed in [1u32, 2] {
        // Sums of twelve numbers of a linear congruence are nearly normal.
        let mut state = seed;
        let mut normal = || {
            let mut next = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1 << 24)
            };
            (0..12).map(|_| next()).sum::<f64>() - 6.0
        };
        let scattered: Vec<[f64; 3]> = rows
            .iter()
            .map(|[band, vertical, lateral]| {
                [*band, vertical * (0.05 * normal()).exp(), lateral * (0.05 * normal()).exp()]
            })
            .collect();
        let folder = Folder::with(job_on([120e6, 40e6, 0.2]).to_string());
        std::fs::write(folder.path("rates.csv"), table(&scattered)).expect("write");
        let ran = fit(&folder, 1, &BAND);
        let deviations = deviations(&ran.good().out);
        assert_eq!(deviations.len(), 3, "{}", ran.out);
        for ((found, known), percent) in fitted(&folder).iter().zip(KNOWN).zip(&deviations) {
            let off = 100.0 * (found / known).ln().abs();
            assert!(off < 3.0 * percent && (0.5..20.0).contains(percent), "{found} for {known}: {off} {}", ran.out);
        }
    }
}

/// Vertical rates of Timoshenko's beam on a Winkler foundation in closed form give the stiffness of that foundation.
#[test]
fn a_beam_in_closed_form_gives_its_foundation() {
    let steel = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };
    let beam = BuiltRail::new(&R60E1, 0.0).expect("a rail").beam(steel, false, 0.02).expect("a beam");
    let (stiffness, loss) = (250e6 / 0.6, 0.2);
    let viscosity = loss * (stiffness * beam.density * beam.area).sqrt();
    let bays = [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0];
    let bays = [&bays[..], &[12.0, 16.0, 20.0, 24.0, 30.0, 36.0, 42.0, 48.0, 54.0, 66.0]].concat();
    let rate = |centre: f64| {
        // The job has one frequency a band, in the middle of its ends.
        let omega = PI * centre * (10f64.powf(0.05) + 10f64.powf(-0.05));
        let foundation = Complex64::new(stiffness, omega * viscosity);
        let square = |bay: f64| beam.along(omega, foundation, (0.6 * bay).max(0.04)).norm_sqr();
        let sum: f64 = (0..bays.len())
            .map(|n| {
                let before = if n > 0 { bays[n] - bays[n - 1] } else { 0.0 };
                let after = bays.get(n + 1).map_or(before, |next| next - bays[n]);
                square(bays[n]) / square(0.0) * 0.3 * (before + after)
            })
            .sum();
        4.343 / sum
    };
    let text: String = [(250, 251.189), (315, 316.228), (400, 398.107), (500, 501.187), (630, 630.957)]
        .map(|(band, centre)| format!("{band},{}\n", rate(centre)))
        .concat();
    let mut job = job_on([100e6, 40e6, 0.1]);
    job["bodies"]["lower"]["track"]["sleeper"] = Value::Null;
    let folder = Folder::with(job.to_string());
    std::fs::write(folder.path("rates.csv"), format!("frequency,vertical\n{text}")).expect("write");
    let ran = fit(&folder, 1, &[]);
    println!("{}", ran.good().out);
    let [vertical, lateral, loss] = fitted(&folder);
    // The section yields above the pads, as the beam does not.
    assert!((vertical / 250e6 - 1.0).abs() < 0.02 && (loss / 0.2 - 1.0).abs() < 0.03, "{vertical} {loss}");
    assert_eq!(lateral, 40e6, "not measured, not fitted");
}

/// The pads of the program rolland, docs/data/track_decay_rolland.py, from bands in which the web does not bend, like
/// that of a beam.
#[test]
fn rates_of_another_program_give_its_pads() {
    let mut job = job_on([250e6, 20e6, 0.1]);
    job["bodies"]["lower"]["track"]["sleeper"] = Value::Null;
    job["bodies"]["lower"]["track"]["loss_factor"] = json!(0.0);
    let folder = Folder::with(job.to_string());
    let text = include_str!("../../docs/data/track_decay_rolland.csv");
    std::fs::write(folder.path("rates.csv"), text.replace("_Hz", "").replace("_dB/m", "")).expect("write");
    let ran = fit(&folder, 1, &["--band", "250,400", "--set", "analyses.track_decay.lines=2"]);
    println!("{}", ran.good().out);
    let [vertical, lateral, loss] = fitted(&folder);
    assert!((vertical / 120e6 - 1.0).abs() < 0.03, "{vertical}");
    assert!((lateral / 40e6 - 1.0).abs() < 0.1 && (loss / 0.2 - 1.0).abs() < 0.05, "{lateral} {loss}");
}

#[test]
fn fits_that_cannot_be_are_refused() {
    let folder = Folder::with(job_on(KNOWN).to_string());
    let write = |text: &str| std::fs::write(folder.path("rates.csv"), text).expect("write");
    let vertical = "frequency;vertical\n250;9\n315;8\n400;7\n500;6\n";
    for (text, more, code, parts) in [
        ("250;9\n315;8\n", &[][..], 3, &["no names of columns"][..]),
        ("frequency;vertical [dB]\n250;9\n315;8\n", &[], 3, &["in db", "Hz and dB/m"]),
        ("frequency;vertical\n250;9\n315;-8\n", &[], 3, &["line 3", "-8 dB/m (vertical)"]),
        ("frequency;vertical\n250;9\n500;8\n", &[], 3, &["line 3", "third octave of 315 Hz", "--band"]),
        ("frequency;vertical\n250;9\n315;8\n", &[], 2, &["2 keys", "2 decay rates"]),
        (vertical, &["--key", "pad.lateral"], 2, &["--key pad.lateral", "no column lateral"]),
        (vertical, &["--key", "pad.stiffness"], 2, &["\"pad.stiffness\"", "pad.vertical, pad.lateral"]),
        (vertical, &["--band", "250"], 2, &["--band", "\"250\"", "250,5000"]),
        (vertical, &["--band", "1000,2000"], 3, &["no third octave", "another --band"]),
        (vertical, &["--set", "bodies.lower.track.pad.loss_factor=0"], 2, &["pad.loss_factor: found 0", "above 0"]),
        (
            vertical,
            &["--set", "analyses.track_decay=null", "--set", "analyses.modes={\"count\": 3}"],
            2,
            &["analyses.track_decay"],
        ),
        (vertical, &["--modes", "2"], 2, &["--modes"]),
    ] {
        write(text);
        fit(&folder, 1, more).failed(code, parts);
    }
    let key = ["--key", "sleeper.ballast.vertical", "--set", "bodies.lower.track.sleeper=null"];
    write(vertical);
    for ranks in [1, 2] {
        fit(&folder, ranks, &key).failed(2, &["--key sleeper.ballast.vertical", "bodies.lower.track.sleeper"]);
    }
    folder.call(1, "fit", &["--decay", &folder.text("none.csv")]).failed(3, &["none.csv"]);
    assert!(!folder.path("job-fit.json").exists());
}
