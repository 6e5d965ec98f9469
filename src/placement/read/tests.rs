//! Files of all formats, right and wrong ones.

use super::super::builtin::{rail_60e1, s1002};
use super::*;
use std::fmt::Write;

/// The tread up to the root of the flange of S1002, m.
const TREAD: [f64; 2] = [-0.033, 0.055];

/// Points of a profile, mm, no further apart than `step`, m.
fn points(profile: &RunningProfile, step: f64) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = Vec::new();
    for y in profile.nodes(2e-6) {
        let p = [1e3 * y, 1e3 * profile.local(y).z];
        if all.last().is_none_or(|q| (p[0] - q[0]).hypot(p[1] - q[1]) > 1e3 * step) {
            all.push(p);
        }
    }
    all
}

fn text(points: &[[f64; 2]]) -> String {
    points.iter().fold(String::new(), |mut s, [y, z]| {
        writeln!(s, "{y:.9} {z:.9}").unwrap();
        s
    })
}

/// Largest distance of two profiles away from the steep ends, m.
fn apart(a: &RunningProfile, b: &RunningProfile, range: [f64; 2]) -> f64 {
    (0..2000)
        .map(|i| range[0] + (range[1] - range[0]) * i as f64 / 1999.0)
        .map(|y| (a.local(y).z - b.local(y).z).abs())
        .fold(0.0, f64::max)
}

/// The profile and the notes behind the line that says what was understood.
fn of(name: &str, text: &str, kind: ProfileKind) -> Result<(RunningProfile, Vec<String>)> {
    let (profile, mut notes) = profile_of(name, text, &Reading::plain(kind))?;
    assert!(notes[0].contains(" points") && notes[0].contains(" mm apart"), "{}", notes.remove(0));
    Ok((profile, notes.split_off(1)))
}

fn wheel(name: &str, text: &str) -> Result<(RunningProfile, Vec<String>)> {
    of(name, text, ProfileKind::Wheel)
}

fn rail(name: &str, text: &str) -> Result<(RunningProfile, Vec<String>)> {
    of(name, text, ProfileKind::Rail)
}

#[test]
fn a_text_file_gives_the_profile_back_in_either_order_and_orientation() {
    let exact = s1002().unwrap();
    let all = points(&exact, 2e-4);
    let (plain, notes) = wheel("w.txt", &format!("# S1002\ny z\n{}", text(&all))).unwrap();
    assert!(notes.is_empty(), "{notes:?}");
    // A spline rounds the jumps J of z″ between arcs: by J h²/48, with 1/13 mm on the flank of 70 degrees 0.3 µm for
    // points 0.2 mm apart along the line. The sections themselves meet at y = −26 mm with a step of 0.04 µm, of which
    // a spline takes the mean.
    for (range, limit) in [(TREAD, 2.5e-8), ([-0.067, 0.055], 3e-7)] {
        assert!(apart(&plain, &exact, range) < limit, "{}", apart(&plain, &exact, range));
    }
    for y in [-0.03, -0.01, 0.004, 0.02] {
        let (a, b) = (plain.local(y).curvature(), exact.local(y).curvature());
        assert!((a - b).abs() < 0.02 * b.abs().max(0.5), "{y}: {a} {b}");
    }
    let reversed: Vec<_> = all.iter().rev().copied().collect();
    assert!(apart(&wheel("w.txt", &text(&reversed)).unwrap().0, &plain, TREAD) < 1e-15);
    for (y, z, count) in [(-1.0, 1.0, 1), (1.0, -1.0, 1), (-1.0, -1.0, 2)] {
        let turned: Vec<_> = all.iter().map(|p| [y * p[0], z * p[1]]).collect();
        let (profile, notes) = wheel("w.csv", &text(&turned).replace(' ', ",")).unwrap();
        assert_eq!(notes.len(), count, "{notes:?}");
        assert!(notes.iter().all(|n| n.contains("turned")));
        assert!(apart(&profile, &plain, TREAD) < 1e-12, "{y} {z}");
    }
}

#[test]
fn units_are_asked_for() {
    let all = points(&s1002().unwrap(), 5e-4);
    for (factor, looks) in [(1e-3, "looks like m:"), (1.0 / 25.4, "looks like inches"), (0.1, "looks like cm")] {
        let scaled: Vec<_> = all.iter().map(|p| p.map(|v| factor * v)).collect();
        let text: String = scaled.iter().map(|[y, z]| format!("{y:.12} {z:.12}\n")).collect();
        let error = wheel("w.txt", &text).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains(looks), "{error}");
        let reading = Reading { unit: Some(1e-3 / factor), ..Reading::plain(ProfileKind::Wheel) };
        assert!(apart(&profile_of("w.txt", &text, &reading).unwrap().0, &s1002().unwrap(), TREAD) < 1e-7);
    }
}

#[test]
fn simpack_files_are_changed_as_their_keys_say() {
    let exact = rail_60e1().unwrap();
    let angle = 0.025_f64.atan();
    // What the keys undo: in cm, turned the other way, shifted, mirrored and from right to left.
    let (s, c) = angle.sin_cos();
    let all: Vec<_> = points(&exact, 2e-4)
        .into_iter()
        .rev()
        .map(|[y, z]| {
            let (y, z) = (-y, z);
            let (y, z) = (c * y + s * z, -s * y + c * z);
            [0.1 * y - 0.3, 0.1 * z + 0.2]
        })
        .collect();
    let keys = format!(
        "! comment\nheader.begin\n version = 1 ! Version\nheader.end\nspline.begin\n file = 'x.txt'\n shift.y = \
         0.3\n shift.z = -0.2\n rotate = \
         {:e}\n mirror.y = 1\n inversion = 1\n units.len.f = +1.0e+02 ! cm\n units.ang.f = 1\n bound.y.min = \
         1\n bound.y.max = 0\n \
         point.begin\n ! y z\n",
        angle
    );
    let file = format!("{keys}{}!9.0 9.0\n point.end\nspline.end\n", text(&all));
    let (profile, notes) = rail("r.prr", &file).unwrap();
    assert!(notes.is_empty(), "{notes:?}");
    let apart = apart(&profile, &exact, [-0.03, 0.03]);
    assert!(apart < 1e-7, "{apart}");
    for (from, to, what) in [
        ("version = 1", "version", "key = value"),
        ("shift.y = 0.3", "shift.y = a", "a number for shift.y"),
        ("units.len.f = +1.0e+02", "units.len.f = 0", "unit factors"),
        (" ! y z\n", " none\n", "two numbers of a point"),
    ] {
        let error = rail("r.prr", &file.replace(from, to)).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains(what), "{error}");
    }
    let smooth = file.replace("version = 1", "version = 1\n approx.smooth = 2.0");
    assert!(rail("r.prr", &smooth).unwrap().1[0].contains("approx.smooth"));
    assert!(rail("r.prr", "header.begin\nheader.end\n").unwrap_err().to_string().contains("no points"));
}

#[test]
fn miniprof_wheels_begin_at_the_back_of_the_flange() {
    let exact = s1002().unwrap();
    // A back with noise, the profile, and a face on the field side that hangs over.
    let mut all: Vec<_> = (0..40).map(|i| [0.1 * (1.3 * i as f64).sin(), -20.0 + 0.75 * i as f64]).collect();
    all.extend(points(&exact, 3e-4).into_iter().map(|[y, z]| [y + 70.0, z]));
    all.extend((0..20).map(|i| [129.9 - 0.05 * i as f64, -2.7 - i as f64]));
    let body: String = all.iter().map(|[y, z]| format!("{y:.6}\t{z:.6} 0.000\n")).collect();
    for header in [
        "Filename=a.whl\nXYPoints=3\n\"XOffset=1\"\nColumnDef=X,Y,A\n\n",
        "MINIPROF 101 148 1994 3 24\na.prd\nStock.......:\n32.58 37.11 14.71  (Sd/Sh/qR)\n\n",
    ] {
        let (profile, notes) = wheel("a.WHL", &format!("{header}{body}")).unwrap();
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(notes[0].contains("hang over"), "{notes:?}");
        assert!(apart(&profile, &exact, TREAD) < 1e-7);
    }
    // One point a little back, as vibration leaves it.
    let mut shaken = all.clone();
    let k = all.iter().position(|p| p[0] > 80.0).unwrap();
    shaken.insert(k, [all[k - 1][0] - 0.01, all[k - 1][1] + 0.01]);
    let (profile, notes) = wheel("a.whl", &format!("Filename=a\n{}", text(&shaken))).unwrap();
    assert!(notes.iter().any(|n| n.contains("went back")) && apart(&profile, &exact, TREAD) < 1e-7, "{notes:?}");
    // Columns the other way round.
    let swapped: String = all.iter().map(|[y, z]| format!("{z:.6},{y:.6}\n")).collect();
    let (profile, _) = wheel("a.whl", &format!("ColumnDef=Y,X\n\n{swapped}")).unwrap();
    assert!(apart(&profile, &exact, TREAD) < 1e-7);
    for (file, what) in [
        (format!("ColumnDef=A,C\n\n{body}"), "columns X and Y"),
        (format!("MINIPROF\n{body}"), "no points"),
        (format!("Filename=a\nword\n{body}"), "line 2: found \"word\""),
        (format!("[FileInfo]\n\n{body}"), "several sections"),
        (format!("Filename=a\n\n{body}12.0 word\n"), "found \"12.0 word\", expected 3 numbers"),
    ] {
        let error = wheel("a.whl", &file).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains(what), "{error}");
    }
}

#[test]
fn miniprof_rails_point_up_and_show_their_gauge_side() {
    let exact = rail_60e1().unwrap();
    let half: Vec<_> = points(&exact, 3e-4).into_iter().filter(|p| p[0] < 12.0).map(|[y, z]| [-y, -z]).collect();
    let file = format!("Rail=R\nColumnDef=X,Y\n\n{}", text(&half));
    let (profile, notes) = rail("a.ban", &file).unwrap();
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("pointed up") && notes[1].contains("gauge side"));
    assert!(apart(&profile, &exact, [-0.03, 0.011]) < 1e-7);
}

#[test]
fn corners_stay_corners_and_noise_is_smoothed() {
    let exact = s1002().unwrap();
    let mut all = points(&exact, 5e-4);
    let corner = all.iter().find(|p| p[0] > 30.0).unwrap()[0];
    all.iter_mut().filter(|p| p[0] > corner).for_each(|p| p[1] -= p[0] - corner);
    let (profile, _) = wheel("w.txt", &text(&all)).unwrap();
    let kinks = profile.kinks();
    assert_eq!(kinks.len(), 1, "{kinks:?}");
    assert!((kinks[0].0 - 1e-3 * corner).abs() < 1e-9 && kinks[0].1 < -0.6, "{kinks:?}");
    // A wave of 1.3 mm and 5 µm, as a measuring wheel leaves it: its curvature of 117 1/m hides the tread's.
    let mut noisy = points(&exact, 3e-4);
    noisy.iter_mut().for_each(|p| p[1] += 5e-3 * (2.0 * std::f64::consts::PI * p[0] / 1.3).sin());
    let raw = wheel("w.txt", &text(&noisy)).unwrap().0;
    let reading = Reading { smoothing: 6e-3, ..Reading::plain(ProfileKind::Wheel) };
    let smooth = profile_of("w.txt", &text(&noisy), &reading).unwrap().0;
    let worst = |p: &RunningProfile| {
        let all = (0..200).map(|i| -0.01 + 1e-4 * i as f64);
        all.map(|y| (p.local(y).curvature() - exact.local(y).curvature()).abs()).fold(0.0, f64::max)
    };
    assert!(worst(&raw) > 80.0 && worst(&smooth) < 0.8, "{} {}", worst(&raw), worst(&smooth));
}

#[test]
fn bad_files_are_named_with_their_line() {
    let all = points(&s1002().unwrap(), 5e-4);
    let n = all.len();
    let check = |all: &[[f64; 2]], what: &[&str]| {
        let error = wheel("w.txt", &text(all)).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(what.iter().all(|w| error.to_string().contains(w)), "{error}");
    };
    check(&all[..8], &["8 points", "at least 12"]);
    let mut unsorted = all.clone();
    unsorted.swap(100, 180);
    check(&unsorted, &["line 101", "function of y"]);
    let folded: Vec<_> = all[..150].iter().chain(&all[120..]).copied().collect();
    check(&folded, &["line 151", "function of y"]);
    let hole: Vec<_> = all.iter().filter(|p| !(5.0..12.0).contains(&p[0])).copied().collect();
    check(&hole, &["gap of 7.", "between y = 4."]);
    let shifted: Vec<_> = all.iter().map(|p| [p[0] + 100.0, p[1]]).collect();
    check(&shifted, &["running circle"]);
    // A flange back that would stand out of the line is no side that may be left out.
    let mut out: Vec<_> = (0..10).map(|i| [-69.0 + 0.5 * i as f64, 40.0 - i as f64]).collect();
    out.extend(&all);
    check(&out, &["function of y"]);
    let mut nan = text(&all);
    nan = nan.replacen(&format!("{:.9} {:.9}", all[n / 2][0], all[n / 2][1]), "1.0 NaN", 1);
    assert!(wheel("w.txt", &nan).unwrap_err().to_string().contains("finite"));
    let word = text(&all).replacen('\n', "\nabc def\n", 1);
    assert!(wheel("w.txt", &word).unwrap_err().to_string().contains("line 2: found \"abc\""));
    assert!(wheel("w.txt", "").unwrap_err().to_string().contains("0 rows of numbers"));
    let missing = read(Path::new("/nowhere/w.txt"), &Reading::plain(ProfileKind::Wheel)).unwrap_err();
    assert!(missing.exit_code() == 3 && missing.to_string().contains("/nowhere/w.txt"));
    let much = Reading { smoothing: 6.0, ..Reading::plain(ProfileKind::Wheel) };
    assert_eq!(profile_of("w.txt", &text(&all), &much).unwrap_err().exit_code(), 2);
}

/// A tread without its flange: the job says which way z points, and the file of the flange's root shows it.
#[test]
fn the_direction_of_z_is_seen_or_asked_for() {
    let exact = s1002().unwrap();
    let all = points(&exact, 5e-4);
    let up = |all: &[[f64; 2]]| text(&all.iter().map(|[y, z]| [*y, -z]).collect::<Vec<_>>());
    let tread: Vec<_> = all.iter().filter(|p| (-30.0..50.0).contains(&p[0])).copied().collect();
    let given =
        |text: &str, z| profile_of("w.txt", text, &Reading { z: Some(z), ..Reading::plain(ProfileKind::Wheel) });
    for file in [text(&tread), up(&tread)] {
        let error = wheel("w.txt", &file).unwrap_err();
        assert!(error.exit_code() == 3 && error.message().contains("profile.file.z = \"down\" or \"up\""), "{error}");
    }
    for (file, z) in [(text(&tread), Vertical::Down), (up(&tread), Vertical::Up)] {
        let (profile, notes) = given(&file, z).unwrap();
        let distance = apart(&profile, &exact, [-0.029, 0.049]);
        // Of the jump of z″ of 77 1/m at y = −29 mm a spline rounds J h²/48 off.
        assert!(distance < 4e-7, "{distance}");
        assert!(notes[0].contains("as given") && notes[0].contains("no flange is seen"), "{notes:?}");
    }
    // With the root of the flange, 14 mm high, or all of it, both ways are seen, and a key that differs is refused.
    let root: Vec<_> = all.iter().filter(|p| (-39.0..50.0).contains(&p[0])).copied().collect();
    for all in [root, all] {
        assert!(apart(&wheel("w.txt", &text(&all)).unwrap().0, &exact, [-0.033, 0.049]) < 1e-7);
        assert!(apart(&wheel("w.txt", &up(&all)).unwrap().0, &exact, [-0.033, 0.049]) < 1e-7);
        let error = given(&up(&all), Vertical::Down).unwrap_err();
        assert!(error.message().contains("z pointing up, as the flange shows, expected down"), "{error}");
    }
    // A flat piece of a rail's head shows nothing.
    let head: Vec<_> = points(&rail_60e1().unwrap(), 5e-4).into_iter().filter(|p| p[0].abs() < 15.5).collect();
    assert!(rail("r.txt", &text(&head)).unwrap_err().message().contains("no round head"));
    let reading = Reading { z: Some(Vertical::Up), ..Reading::plain(ProfileKind::Rail) };
    let (profile, _) = profile_of("r.txt", &up(&head), &reading).unwrap();
    // Away from the ends, at which a spline does not know the curvature.
    assert!(apart(&profile, &rail_60e1().unwrap(), [-0.012, 0.012]) < 1e-7);
}

/// Columns, separators and units as spreadsheets and measuring devices write them.
#[test]
fn tables_of_spreadsheets_are_followed_or_refused() {
    let exact = s1002().unwrap();
    let all = points(&exact, 5e-4);
    let lines = |row: &dyn Fn(usize, f64, f64) -> String| -> String {
        all.iter().enumerate().map(|(i, p)| row(i, p[0], p[1]) + "\n").collect()
    };
    let comma = |v: f64| format!("{v:.6}").replace('.', ",");
    let good = [
        lines(&|_, y, z| format!("{};{}", comma(y), comma(z))),
        format!("i,y,z\n{}", lines(&|i, y, z| format!("{i},{y:.6},{z:.6}"))),
        format!("Z (mm);Y (mm)\r\n{}", lines(&|_, y, z| format!("{};{}\r", comma(z), comma(y)))),
        format!("y [m]\tz [m]\n{}", lines(&|_, y, z| format!("{:.9}\t{:.9}", 1e-3 * y, 1e-3 * z))),
        lines(&|_, y, z| format!("{y:.6e} {z:.6e}").replace('e', "D")),
    ];
    for file in good {
        let (profile, notes) = wheel("w.csv", &file).unwrap_or_else(|e| panic!("{e}"));
        assert!(notes.is_empty() && apart(&profile, &exact, TREAD) < 1e-7, "{notes:?}");
    }
    for (file, word) in [
        (lines(&|i, y, z| format!("{i},{y:.6},{z:.6}")), "counts the rows"),
        (lines(&|_, y, z| format!("{y:.6},{z:.6},0.0")), "3 columns"),
        (lines(&|i, _, z| format!("{i} {z:.6}")), "counts the rows"),
        (lines(&|_, y, z| format!("{},{}", comma(y), comma(z))), "decimal commas or separators"),
        (format!("way;height\n{}", lines(&|_, y, z| format!("{y};{z}"))), "\"way\", \"height\""),
        (format!("y [mm];z [m]\n{}", lines(&|_, y, z| format!("{y};{z}"))), "one unit"),
    ] {
        let error = wheel("w.csv", &file).unwrap_err();
        assert!(error.exit_code() == 3 && error.message().contains(word), "{word} not in {error}");
    }
    let file = format!("y (mm) z (mm)\n{}", text(&all));
    let error =
        profile_of("w.csv", &file, &Reading { unit: Some(1.0), ..Reading::plain(ProfileKind::Wheel) }).unwrap_err();
    assert!(error.message().contains("file.unit = 1 m"), "{error}");
}
