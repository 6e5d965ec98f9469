//! Measured files and decks as other programs write them, in whole runs: the same numbers, or a refusal that says what
//! to do.

use super::program::*;
use serde_json::{json, Value};
use std::fmt::Write;

/// Frequencies of the modes of a run, Hz.
fn frequencies(folder: &Folder) -> Vec<f64> {
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    file.dataset("modes/lower/frequency").and_then(|d| d.read_raw()).expect("frequencies")
}

/// Points of the worn wheel's profile, mm.
fn worn() -> Vec<[f64; 2]> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/profiles/worn-s1002.txt");
    let text = std::fs::read_to_string(path).expect("the profile");
    let rows = text.lines().filter(|l| !l.trim().is_empty() && !l.starts_with('#'));
    let numbers = |l: &str| l.split_whitespace().map(|w| w.parse().expect("a number")).collect::<Vec<f64>>();
    rows.map(|l| [numbers(l)[0], numbers(l)[1]]).collect()
}

/// A job with the profile of its wheel in the text `profile`, and keys beside its path.
fn with_profile(profile: &str, keys: Value) -> Folder {
    let mut job = job("wheel-on-rail-contact.json");
    let mut file = json!({ "path": "wheel.csv" });
    for (key, value) in keys.as_object().into_iter().flatten() {
        file[key] = value.clone();
    }
    job["bodies"]["upper"]["profile"] = json!({ "file": file });
    let folder = Folder::with(job.to_string());
    std::fs::write(folder.path("wheel.csv"), profile).expect("write the profile");
    folder
}

/// The line of `check` about the place of contact.
fn touch(folder: &Folder) -> String {
    let ran = folder.call(1, "check", &[]);
    let out = &ran.good().out;
    out.lines().find(|l| l.contains("touch at y =")).unwrap_or_else(|| panic!("{out}")).to_owned()
}

#[test]
fn every_spelling_of_a_profile_touches_at_the_same_place() {
    let all = worn();
    let table = |head: &str, row: &dyn Fn(usize, f64, f64) -> String| {
        all.iter().enumerate().fold(head.to_owned(), |text, (i, p)| text + &row(i, p[0], p[1]) + "\n")
    };
    let comma = |v: f64| format!("{v:.5}").replace('.', ",");
    let plain = touch(&with_profile(&table("", &|_, y, z| format!("{y:.5} {z:.5}")), json!({})));
    for text in [
        table("", &|_, y, z| format!("{};{}", comma(y), comma(z))),
        table("\u{feff}i,y [mm],z [mm]\r\n", &|i, y, z| format!("{i},{y:.5},{z:.5}\r")),
        table("z\ty\n", &|_, y, z| format!("{z:.5}\t{y:.5}")),
        table("", &|_, y, z| format!("{y:.5} {:.5}", -z)),
    ] {
        let folder = with_profile(&text, json!({}));
        assert_eq!(touch(&folder), plain);
        let ran = folder.call(1, "check", &[]);
        let said = ran.good().out.lines().find(|l| l.contains("wheel.csv: read ")).expect("what was understood");
        assert!(said.contains("199 points") && said.contains("0.50 mm apart"), "{said}");
    }
    for (text, part) in [
        (table("", &|i, y, z| format!("{i},{y:.5},{z:.5}")), "counts the rows"),
        (table("", &|_, y, z| format!("{},{}", comma(y), comma(z))), "decimal commas or separators"),
        (table("", &|_, y, z| format!("{y:.5} {z:.5} 0.0")), "3 columns without headings"),
    ] {
        for command in ["check", "run"] {
            with_profile(&text, json!({})).call(1, command, &[]).failed(3, &["wheel.csv", part]);
        }
    }
}

/// Numbers are read and written with a decimal point whatever the locale of the process, and messages keep their signs.
#[test]
fn the_locale_changes_nothing() {
    let folder = with_profile("y [mm];z [mm]\n-70,5;1,0\n", json!({}));
    let of = |locale: &str, command: &str, path: &str| {
        let mut process = std::process::Command::new(PROGRAM);
        process.env("LC_ALL", locale).env("LANGUAGE", "de").env("OPENBLAS_NUM_THREADS", "1");
        let ran = finish(process.args([command, path]));
        // Without the free memory and the lines of progress, which differ from run to run.
        let lasting = |text: &str| -> Vec<String> {
            text.lines().filter(|l| !l.starts_with('[') && !l.contains("MemAvailable")).map(str::to_owned).collect()
        };
        (ran.code, lasting(&ran.out), lasting(&ran.err))
    };
    let job = concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/wheel-on-rail-contact.json");
    for (command, path) in [("check", job), ("check", &folder.text("job.json"))] {
        let plain = of("C.UTF-8", command, path);
        for locale in ["C", "POSIX", "de_DE.UTF-8", "tr_TR.UTF-8", "no such locale"] {
            assert_eq!(of(locale, command, path), plain, "{locale}");
        }
    }
}

/// A tread without its flange does not show which way z points: the job says it.
#[test]
fn a_tread_without_flange_needs_the_direction_of_z() {
    let tread = |sign: f64| {
        let rows = worn().into_iter().filter(|p| p[0] > -30.0 && p[0] < 50.0);
        rows.fold(String::new(), |text, [y, z]| text + &format!("{y} {}\n", sign * z))
    };
    for command in ["check", "run"] {
        with_profile(&tread(1.0), json!({})).call(1, command, &[]).failed(3, &["no flange", "profile.file.z"]);
    }
    let down = touch(&with_profile(&tread(1.0), json!({ "z": "down" })));
    assert_eq!(touch(&with_profile(&tread(-1.0), json!({ "z": "up" }))), down);
    let whole = worn().into_iter().fold(String::new(), |text, [y, z]| text + &format!("{y} {z}\n"));
    with_profile(&whole, json!({ "z": "up" })).refused(1, &[], 3, &["z pointing down, as the flange shows"]);
}

#[test]
fn a_noisy_profile_is_pointed_to_smoothing() {
    let rough = |k: usize| 0.1 * ((k * k * 7919 % 17) as f64 / 8.0 - 1.0);
    let text =
        worn().iter().enumerate().fold(String::new(), |text, (k, p)| text + &format!("{} {}\n", p[0], p[1] + rough(k)));
    let ran = with_profile(&text, json!({})).call(1, "check", &[]);
    ran.failed(
        2,
        &["contact.placement", "wheel.csv is taken without smoothing", "bodies.upper.profile.file.smoothing"],
    );
    let smoothed = with_profile(&text, json!({ "smoothing": 0.02 }));
    smoothed.call(1, "check", &[]).good();
    // Noise that leaves a contact rules its pressure all the same.
    let text = worn()
        .iter()
        .enumerate()
        .fold(String::new(), |text, (k, p)| text + &format!("{} {}\n", p[0], p[1] + rough(k) / 20.0));
    let said = |keys: Value| with_profile(&text, keys).call(1, "check", &[]).good().out.clone();
    assert!(said(json!({})).contains("without smoothing"), "{}", said(json!({})));
    assert!(!said(json!({ "smoothing": 0.01 })).contains("without smoothing"));
}

/// Missing samples of a measured line are refused with their line.
#[test]
fn gaps_of_roughness_are_refused() {
    let mut job = job("rough-cylinders.json");
    job["contact"]["roughness"] = json!({ "lower": [{ "file": { "path": "r.txt" } }] });
    job["analyses"]["transient"]["duration"] = json!(0.004);
    let folder = Folder::with(job.to_string());
    let line = |gone: std::ops::Range<i32>| {
        let kept = (0..700).filter(|i| !gone.contains(i)).map(f64::from);
        kept.fold(String::new(), |text, i| text + &format!("{:.3} {:.3}\n", 1e-3 * i, 5.0 * (0.13 * i).sin()))
    };
    std::fs::write(folder.path("r.txt"), line(300..400)).expect("write");
    for command in ["check", "run"] {
        folder
            .call(1, command, &[])
            .failed(3, &["r.txt, line 301: found a gap of 101.000 mm", "where samples are 1.000 mm"]);
    }
    std::fs::write(folder.path("r.txt"), line(300..302)).expect("write");
    let ran = folder.call(1, "check", &[]);
    assert!(ran.good().out.contains("every 1.0000 mm but for 1 gaps of up to 3.0000 mm"), "{}", ran.out);
}

/// Nodes and elements of a bar, 2 by 2 by 4 hexahedra, and a job of its modes with `fixed`.
fn bar() -> (String, String) {
    let (mut nodes, mut elements) = (String::from("*NODE\n"), String::from("*ELEMENT, TYPE=C3D8I, ELSET=ALL\n"));
    let number = |i: usize, j: usize, k: usize| 1 + i + 3 * j + 9 * k;
    for k in 0..5 {
        for j in 0..3 {
            for i in 0..3 {
                let [x, y, z] = [i, j, k].map(|n| 0.01 * n as f64);
                writeln!(nodes, "{}, {x:.3}, {y:.3}, {z:.3}", number(i, j, k)).expect("a line");
                if i < 2 && j < 2 && k < 4 {
                    let ring = |k| [number(i, j, k), number(i + 1, j, k), number(i + 1, j + 1, k), number(i, j + 1, k)];
                    let all =
                        [ring(k), ring(k + 1)].concat().iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
                    writeln!(elements, "{}, {all}", 1 + i + 2 * j + 4 * k).expect("a line");
                }
            }
        }
    }
    (nodes, elements)
}

fn with_deck(deck: &str, fixed: &str) -> Folder {
    let job = json!({
        "version": 5,
        "bodies": { "lower": {
            "mesh": { "file": { "path": "bar.inp" } },
            "material": { "young": 200e9, "poisson": 0.3, "density": 7800 },
            "fixed": [fixed]
        } },
        "analyses": { "modes": { "count": 4 } }
    });
    let folder = Folder::with(job.to_string());
    std::fs::write(folder.path("bar.inp"), deck).expect("write the deck");
    folder
}

/// Abbreviations, sets of one name in part and assembly, and a mesh in the instance, by the frequencies of a clamped
/// bar.
#[test]
fn decks_mean_what_the_manual_says() {
    let (nodes, elements) = bar();
    let mesh = format!("{nodes}{elements}");
    let run = |deck: &str, fixed: &str| {
        let folder = with_deck(deck, fixed);
        folder.call(1, "run", &[]).good();
        frequencies(&folder)
    };
    let plain = run(
        &format!("{mesh}*ELSET, ELSET=bottom, GENERATE\n1, 4, 1\n*SURFACE, TYPE=ELEMENT, NAME=base\nbottom, S1\n"),
        "base",
    );
    let same = |found: Vec<f64>| {
        let near = |(a, b): (&f64, &f64)| (a / b - 1.0).abs() < 1e-6;
        assert!(found.iter().zip(&plain).all(near), "{found:?} {plain:?}");
    };
    same(run(&format!("{mesh}*ELSET, EL=bottom, GEN\n1, 4\n*SURFACE, TY=ELEMENT, NAME=base\nbottom, S1\n"), "BASE"));
    let both = format!(
        "*PART, NAME=Bar\n{mesh}*NSET, NSET=Set-1, GENERATE\n37, 45\n*END PART\n\
         *ASSEMBLY, NAME=A\n*INSTANCE, NAME=Bar-1, PART=Bar\n\
         *END INSTANCE\n*NSET, NSET=Set-1, INSTANCE=Bar-1, GENERATE\n1, 9\n*END ASSEMBLY\n"
    );
    same(run(&both, "assembly.Set-1"));
    // The other end of the bar is as good.
    same(run(&both, "Bar-1.Set-1"));
    for command in ["check", "run"] {
        let ran = with_deck(&both, "Set-1").call(1, command, &[]);
        ran.failed(3, &["bodies.lower.fixed", "several groups \"set-1\"", "\"assembly.set-1\", \"bar-1.set-1\""]);
    }
    let inside = format!(
        "\u{feff}*PART, NAME=Bar\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=Bar-1, PART=Bar\n\
         0., 0., 1.\n0., 0., 1., 1., 0., 1., 90.\n\
         {mesh}*END INSTANCE\n*ELSET, ELSET=_b, internal, instance=Bar-1, generate\n1, 4, 1\n\
         *SURFACE, TYPE=ELEMENT, NAME=base\n_b, S1\n\
         *END ASSEMBLY\n"
    );
    same(run(&inside, "base"));
    let ran = with_deck(&inside, "base").call(1, "check", &[]);
    assert!(ran.good().out.contains("0.0200 x 0.0400 x 0.0200"), "{}", ran.out);
    let masses = format!("{mesh}*NSET, NSET=base, GENERATE\n1, 9\n*ELEMENT, TYPE=MASS, ELSET=m\n100, 45\n");
    same(run(&masses, "base"));
    with_deck(&format!("{masses}*MASS, ELSET=m\n0.1\n"), "base").refused(1, &[], 3, &["*\"MASS\"", "supports"]);
}
