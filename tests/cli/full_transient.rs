//! The transient on all degrees of freedom, as real processes.

use super::interrupted::same;
use super::program::*;
use super::transient::{growth, open, read};
use num_complex::Complex64;
use serde_json::{json, Value};

/// `jobs/full-squeal.json` on coarser meshes with fewer modes, and further keys of its transient.
fn coarse(transient: Value) -> Value {
    let mut job = job("full-squeal.json");
    for body in ["lower", "upper"] {
        let cylinder = &mut job["bodies"][body]["mesh"]["cylinder"];
        cylinder["element_size"] = json!(0.004);
        cylinder["max_element_size"] = json!(0.1);
    }
    job["contact"]["patch"] = json!({ "half_length": 0.012, "half_width": 0.012 });
    job["analyses"]["modes"]["count"] = json!(20);
    for (key, value) in transient.as_object().expect("keys") {
        job["analyses"]["transient"][key] = value.clone();
    }
    job
}

/// A period of the mode.
pub fn short(model: &str) -> Value {
    let keys = json!({ "model": model, "step": 1e-5, "duration": 1.2e-3, "segment": 40, "contact_stride": 1 });
    let mut job = coarse(keys);
    job["analyses"]["stability"].as_object_mut().expect("keys").remove("full");
    job
}

fn normal(path: &str) -> Vec<f64> {
    read::<f64>(&open(path), "transient/force").chunks_exact(3).map(|f| f[2]).collect()
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt()
}

/// Truncation of modes changes little over a period; a run that is continued is the run that was not stopped, to the
/// last bit; two ranks find what one does, from the same phase of the mode.
#[test]
fn all_degrees_of_freedom_move_as_the_modes_do() {
    let folder = Folder::with(short("full").to_string());
    let [whole, parts, two] = ["whole.h5", "parts.h5", "two.h5"].map(|name| folder.text(name));
    folder.call(1, "run", &["--output", &whole]).good();
    folder
        .call(1, "run", &["--output", &parts, "--wall-time", "0.001"])
        .failed(5, &["after 40 of 120 steps", "--resume"]);
    folder.call(1, "run", &["--resume", &parts]).good();
    same(&open(&whole), &open(&parts));
    folder.call_alone(2, "run", &["--output", &two]).good();

    let reduced = Folder::with(short("reduced").to_string());
    let modes = reduced.text("modes.h5");
    reduced.call(1, "run", &["--output", &modes]).good();
    // The force of the full model is the mean over the step, that of the reduced one holds at its end.
    let modes: Vec<f64> = normal(&modes).windows(2).map(|f| 0.5 * (f[0] + f[1])).collect();
    let [full, two] = [whole, two].map(|path| normal(&path).split_off(1));
    let mean = full.iter().sum::<f64>() / full.len() as f64;
    let swing = rms(&full.iter().map(|f| f - mean).collect::<Vec<f64>>());
    let apart = |other: &[f64]| rms(&full.iter().zip(other).map(|(a, b)| a - b).collect::<Vec<f64>>()) / swing;
    let (ranks, left_out) = (apart(&two), apart(&modes));
    assert!(swing > 1.0 && ranks < 1e-6 && left_out < 0.01, "{swing} N, two ranks {ranks:e}, modes {left_out:e}");
}

/// Along an eigenvector of the full system the motion is that of its eigenvalue: it grows and turns as this says, and
/// energy is balanced.
#[test]
#[ignore = "long: scripts/validate long"]
fn all_degrees_of_freedom_grow_as_their_eigenvalue_says() {
    let mut job = coarse(json!({ "step": 1e-5, "duration": 5e-3, "modal_stride": 5 }));
    job["analyses"]["transient"]["start"]["amplitude"] = json!(1e-7);
    let folder = Folder::with(job.to_string());
    let output = folder.text("run.h5");
    folder.call(1, "run", &["--output", &output]).good();
    let file = open(&output);
    let (values, partner): (Vec<Complex64>, Vec<i64>) =
        (read(&file, "stability/eigenvalue"), read(&file, "stability/partner"));
    let wanted = values[usize::try_from(partner[0]).expect("the first eigenvalue in the full system")];
    let shape = file.dataset("transient/modal_displacement").expect("amplitudes").shape();
    let q: Vec<f64> = read(&file, "transient/modal_displacement");
    let rows: Vec<Vec<f64>> = q.chunks_exact(shape[1]).skip(shape[0] / 5).map(<[f64]>::to_vec).collect();
    let turns = wanted.im / (2.0 * std::f64::consts::PI);
    let (sigma, frequency) = growth(&rows, 5e-5, turns);
    // By the scheme it is low by (hω)²/12.
    let low = (1e-5 * wanted.im).powi(2) / 12.0;
    let friction: Vec<f64> = read(&file, "transient/friction_loss");
    let balance: Vec<f64> = read(&file, "transient/balance");
    println!(
        "growth {sigma}, eigenvalue {}, reduced {}, shift {:e}, scheme {low:e}, balance {:?} of {:?}",
        wanted.re,
        values[0].re,
        frequency / turns - 1.0,
        balance.last(),
        friction.last()
    );
    assert!((sigma / wanted.re - 1.0).abs() < 0.01, "growth {sigma}, eigenvalue {}", wanted.re);
    assert!((frequency / turns - 1.0 + low).abs() < 2e-5, "{frequency} Hz, eigenvalue {turns} Hz");
    assert!(balance.last().expect("steps").abs() < 1e-9 * friction.last().expect("steps"), "{:?}", balance.last());
}

/// A file of `--reuse` without fields has no mode shapes: no motion along a mode can be made, and no amplitudes of
/// modes be found. What needs neither is the run without `--reuse`.
#[test]
fn an_earlier_run_without_mode_shapes_serves_what_needs_none() {
    let folder = Folder::with(short("full").to_string());
    let [first, again, whole] = ["first.h5", "again.h5", "whole.h5"].map(|name| folder.text(name));
    folder.call(1, "run", &["--only", "stability", "--output", &first]).good();
    let before = folder.listing();
    let (amplitudes, motion) = ("analyses.transient.modal_stride=0", r#"analyses.transient.start={"state": "steady"}"#);
    let random = r#"analyses.transient.start={"random": {"seed": 1, "energy": 1e-9}}"#;
    let with = |sets: &[&str], more: &[&str], ranks: usize| {
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        folder.call(ranks, "run", &[&sets[..], more].concat())
    };
    let named = ["analyses.transient.model", "\"full\"", "--reuse", "start.mode", "start.random", "modal_stride"];
    for (sets, ranks) in
        [(&[][..], 1), (&[][..], 2), (&[amplitudes][..], 1), (&[motion][..], 1), (&[amplitudes, random][..], 1)]
    {
        with(sets, &["--reuse", &first, "--output", &again], ranks).failed(2, &named);
        assert_eq!(folder.listing(), before);
    }
    let sets = [amplitudes, motion];
    with(&sets, &["--reuse", &first, "--output", &again], 1).good();
    with(&sets, &["--output", &whole], 1).good();
    let (whole, again) = (normal(&whole), normal(&again));
    let off = whole.iter().zip(&again).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(whole.len() == again.len() && whole.len() > 100 && off < 1e-6 * 70e3, "{} steps, {off:e} N", whole.len());
}

#[test]
fn what_the_full_model_has_not_is_refused() {
    let cases: [(&[&str], &str); 3] = [
        (&["analyses.transient.hold=\"load\""], "hold"),
        (&["analyses.transient.body_stride=5"], "body_stride"),
        (
            &[
                "contact.quadrature=\"consistent\"",
                "analyses.stability=null",
                "analyses.transient.start={\"state\": \"steady\"}",
            ],
            "contact.quadrature",
        ),
    ];
    let folder = Folder::with(short("full").to_string());
    for (sets, named) in cases {
        let args: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        folder.refused(1, &args, 2, &[named, "\"full\"", "reduced"]);
    }
    let missing = ["--set", "solver.linear=gamg"];
    folder.refused(1, &missing, 2, &["solver.linear", "mumps"]);
}
