//! Bodies swept from sections, in whole runs.

use super::program::*;
use serde_json::{json, Value};

fn numbers(folder: &Folder, file: &str, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path(file)).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The narrow curve with fewer modes and a coarser contact.
fn coarse() -> Value {
    let mut job = at_rest();
    job["analyses"]["modes"]["count"] = json!(14);
    job["contact"]["patch"] = json!({ "half_length": 0.0075, "half_width": 0.0075, "spacing": 0.0015 });
    job
}

/// The narrow curve with wheels at rest.
fn at_rest() -> Value {
    let mut job = job("swept-curve.json");
    for body in ["lower", "upper"] {
        job["bodies"][body]["rotation"] = json!("none");
    }
    job
}

/// `jobs/swept-curve.json`: frequencies of a program of its own with elements of one size, which the singular corners
/// of the clamped bores make up to 1.1e-3 too high, and growth rates with rigid sliding within 3 % of those on the
/// compliance of a half-space with constants, 8.79, 6.27 and 2.99 1/s; finite elements of three dimensions have 8.77,
/// 6.28 and 2.96 1/s with 0.35 mm at the contact.
#[test]
fn the_narrow_curve_squeals_as_with_meshes() {
    let mut job = at_rest();
    job["analyses"]["stability"] = json!({ "state": "sliding", "direction": "rigid" });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &["--output", &folder.text("one.h5")]).good();
    let frequency = numbers(&folder, "one.h5", "modes/lower/frequency");
    let wanted = [422.10, 422.10, 482.41, 574.36, 574.36, 607.22, 1133.9, 1133.9, 1582.6, 1582.6, 1876.8, 1876.8];
    for (f, w) in frequency.iter().zip(wanted) {
        assert!((f / w - 1.0).abs() < 1.3e-3, "{f} Hz, expected {w} Hz");
    }
    let growth = numbers(&folder, "one.h5", "stability/growth_rate");
    for (g, wanted) in growth.iter().zip([8.79, 6.27, 2.99]) {
        assert!((g / wanted - 1.0).abs() < 0.03, "{g} 1/s, expected {wanted} 1/s");
    }
    assert!(growth[3] < 0.0, "{growth:?}");
}

/// Modes, compliance and growth are the same on two ranks, with wheels that roll, and from the reduced model of the
/// earlier run at another speed.
#[test]
fn ranks_and_reuse_change_nothing() {
    let mut job = coarse();
    for body in ["lower", "upper"] {
        job["bodies"][body]["rotation"] = json!("rolling");
    }
    let folder = Folder::with(job.to_string());
    let one = folder.call(1, "run", &["--output", &folder.text("one.h5")]);
    assert!(one.good().out.contains("418.51 (-1), 424.78 (+1)"), "{}", one.out);
    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    let one_file = folder.text("one.h5");
    folder.call(1, "run", &["--output", &folder.text("three.h5"), "--reuse", &one_file]).good();
    for name in ["modes/upper/frequency", "modes/upper/wave_frequency", "stability/growth_rate"] {
        let here = numbers(&folder, "one.h5", name);
        let scale = here.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for file in ["two.h5", "three.h5"].into_iter().filter(|f| *f == "two.h5" || !name.contains("wave")) {
            let there = numbers(&folder, file, name);
            assert_eq!(here.len(), there.len(), "{file} {name}");
            let apart = here.iter().zip(&there).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-7 * scale, "{file} {name}: {apart:e} of {scale:e}");
        }
    }
    // Waves of the rotating body, ±3.13 Hz of 421.63 Hz.
    let waves = numbers(&folder, "one.h5", "modes/lower/wave_frequency");
    assert!((waves[1] - waves[0] - 6.27).abs() < 0.02, "{waves:?}");
}

/// A wheel alone; steady rolling, receptance and a transient of two bodies; what needs a mesh is refused.
#[test]
fn every_analysis_of_the_reduced_model_takes_swept_bodies() {
    let mut alone = job("swept-curve.json");
    alone["bodies"]["lower"]["mesh"] = json!({ "revolved": { "section": "W920S" } });
    alone["bodies"]["lower"]["material"] = json!({ "young": 210e9, "poisson": 0.3, "density": 7860 });
    let bodies = alone["bodies"].as_object_mut().expect("bodies");
    bodies.remove("upper");
    alone.as_object_mut().expect("a job").remove("contact");
    alone["analyses"] = json!({ "modes": { "max_frequency": 1000 } });
    let folder = Folder::with(alone.to_string());
    folder.call(2, "run", &[]).good();
    let found = numbers(&folder, "job.h5", "modes/lower/frequency");
    // Of a mesh with edges of 10 mm, and of 0.3 mm and less around the corners of the web.
    for (f, w) in found.iter().zip([99.65, 99.65, 150.05, 350.50, 350.50]) {
        assert!((f / w - 1.0).abs() < 5e-4, "{f} Hz, expected {w} Hz");
    }

    let mut all = coarse();
    all["analyses"] = json!({
        "modes": { "count": 14 },
        "steady": {},
        "receptance": { "frequency": [0, 300] },
        "transient": { "duration": 2e-4, "step": 2e-5 }
    });
    let folder = Folder::with(all.to_string());
    folder.call(1, "run", &[]).good();
    let of_bodies = ["lower", "upper"].map(|b| numbers(&folder, "job.h5", &format!("reduced/{b}/compliance")));
    for c in &of_bodies {
        let n = c.len().isqrt();
        let apart = (0..n * n).map(|k| (c[k] - c[k % n * n + k / n]).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-12 * c[n + 1], "of {:e} m/N {apart:e} are not symmetric", c[n + 1]);
    }
    all["analyses"] = json!({ "modes": { "count": 14 }, "stability": { "full": { "max_frequency": 500 } } });
    let folder = Folder::with(all.to_string());
    folder.call(1, "run", &[]).failed(2, &["analyses.stability.full", "bodies.lower", "swept"]);
    folder.untouched();
}

/// Mirror images are never unstable at constant friction, whatever the friction.
#[test]
fn mirror_images_are_stable() {
    let mut job = coarse();
    job["bodies"]["upper"]["mesh"]["revolved"]["contact_offset"] = json!(0.03);
    job["contact"]["friction"] = json!(1.0);
    job["analyses"]["stability"] = json!({ "state": "sliding", "direction": "rigid", "damping_ratio": 1 });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(ran.good().out.contains("mirror image of the lower one, computed once"), "{}", ran.out);
    let growth = numbers(&folder, "job.h5", "stability/growth_rate");
    assert!(growth.len() > 20 && growth[0] < 0.0, "{growth:?}");
}

/// A change of a job, and the words of what is said about it.
type Case<'c> = (&'c dyn Fn(&mut Value), &'c [&'c str]);

#[test]
fn keys_that_do_not_go_together_are_named() {
    let with = |change: &dyn Fn(&mut Value)| {
        let mut job = coarse();
        change(&mut job);
        Folder::with(job.to_string())
    };
    let cases: [Case; 8] = [
        (&|j| j["contact"]["compliance"] = json!("fe"), &["contact.compliance", "hybrid"]),
        (&|j| j["contact"]["patch"]["spacing"] = Value::Null, &["contact.patch.spacing", "0.001"]),
        (&|j| j["contact"]["patch"]["spacing"] = json!(1e-300), &["contact.patch.spacing", "half_length / 500"]),
        (
            &|j| j["contact"]["patch"]["half_width"] = json!(0.025),
            &["contact.patch.half_width", "bodies.lower", "0.02"],
        ),
        (&|j| j["bodies"]["lower"]["fixed"] = json!(["bore"]), &["bodies.lower.fixed", "bore", "inner"]),
        (
            &|j| j["bodies"]["upper"]["mesh"]["revolved"]["section"]["cylinder"]["inner_radius"] = json!(0.6),
            &["bodies.upper.mesh.revolved.section.cylinder.inner_radius", "outer_radius"],
        ),
        (
            &|j| j["bodies"]["upper"]["mesh"] = json!({ "revolved": { "section": "W920S", "contact_offset": 0.05 } }),
            &["bodies.upper.mesh.revolved.contact_offset", "tread of W920S"],
        ),
        (
            &|j| j["bodies"]["upper"]["mesh"] = job("curve.json")["bodies"]["upper"]["mesh"].clone(),
            &["contact.patch.spacing", "both bodies or none"],
        ),
    ];
    for (change, words) in cases {
        let folder = with(change);
        folder.refused(1, &[], 2, words);
    }
}

/// Modes on meshes that show them: those of both bodies, and the complex ones over their period; the same on two
/// ranks. They touch at the contact point.
#[test]
fn swept_modes_are_shown() {
    let mut job = coarse();
    job["analyses"] = json!({ "modes": { "count": 14 }, "stability": { "shapes": 2 } });
    job["output"] = json!({});
    let folder = Folder::with(job.to_string());
    for ranks in [1, 2] {
        folder.call(ranks, "run", &["--output", &folder.text(&format!("{ranks}.h5"))]).good();
    }
    let read = |file: &str, name: &str| numbers(&folder, file, name);
    let listed = read("1.free_modes.vtkhdf", "modes/frequency");
    assert_eq!(listed, ["lower", "upper"].map(|body| read("1.h5", &format!("modes/{body}/frequency"))).concat());
    let points = read("1.free_modes.vtkhdf", "VTKHDF/Points");
    let high =
        points.iter().skip(2).step_by(3).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], z| [a.min(*z), b.max(*z)]);
    // Two wheels of the radius 0.5 m, one on the other.
    assert!((high[0] + 1.0).abs() < 1e-6 && (high[1] - 1.0).abs() < 1e-6, "{high:?}");
    assert!(points.chunks_exact(3).any(|p| p.iter().all(|c| c.abs() < 1e-9)), "no contact point");
    let growth = read("1.modes.vtkhdf", "modes/growth_rate");
    let eigenvalue = read("1.h5", "stability/growth_rate");
    assert!(growth.iter().any(|g| (g - eigenvalue[0]).abs() < 1e-9), "{growth:?} {eigenvalue:?}");
    for file in ["free_modes", "modes"] {
        let name = if file == "modes" { "motion" } else { "shape" };
        let [one, two] = [1, 2].map(|ranks| {
            let mut all = read(&format!("{ranks}.{file}.vtkhdf"), &format!("VTKHDF/PointData/{name}"));
            all.iter_mut().for_each(|v| *v = v.abs());
            all
        });
        let sum = |all: &[f64]| all.iter().map(|v| v * v).sum::<f64>();
        assert_eq!(one.len(), two.len());
        assert!((sum(&one) / sum(&two) - 1.0).abs() < 1e-3 && sum(&one) > 0.0, "{file}: {} {}", sum(&one), sum(&two));
    }
    job["output"] = json!({ "swept_modes": false });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    assert!(!folder.listing().iter().any(|name| name.ends_with(".vtkhdf")), "{:?}", folder.listing());
}

/// The sound of swept wheels: in the band of the mode that squeals, as loud on one rank as on two, and the same to
/// the last bit of a run that is continued.
#[test]
fn swept_wheels_are_heard() {
    let mut job = coarse();
    job["analyses"] = json!({
        "modes": { "count": 14 },
        "stability": {},
        "transient": {
            "duration": 0.1,
            "step": 2e-5,
            "start": { "mode": 1, "amplitude": 1e-7 },
            "sound_power": { "min_frequency": 200, "max_frequency": 1300, "from": 0.005 },
            "segment": 1700
        }
    });
    job["output"] = json!({ "fields": false });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &["--output", &folder.text("one.h5")]);
    assert!(ran.good().out.contains("sound power of upper") && ran.out.contains("dB(A)"), "{}", ran.out);
    assert!(ran.out.contains("7.5 m"), "{}", ran.out);
    let centres = numbers(&folder, "one.h5", "transient/sound_power/band_frequency");
    // The mode (1, 0) at 422 Hz.
    let own = centres.iter().position(|f| (f / 422.0).log10().abs() < 0.05).expect("a band");
    let mut levels = Vec::new();
    for body in ["lower", "upper"] {
        let of = |name: &str| numbers(&folder, "one.h5", &format!("transient/sound_power/{body}/{name}"));
        let (power, sigma) = (of("power"), of("radiation_efficiency"));
        assert!(
            power[own] > 0.9 * power.iter().sum::<f64>() && power[own] > 0.0,
            "{body}: {power:?} W at {centres:?} Hz"
        );
        // Wheels of the radius 0.5 m: about one at 422 Hz, as long as the wave is against them (0.98 in baffles); air
        // flows around them at 200 Hz.
        assert!(sigma[own] > 0.9 && sigma[own] < 1.2 && sigma[0] < 0.1, "{body}: {sigma:?}");
        levels.push(of("total_level_a")[0]);
        let pressure = of("pressure_level_a")[0];
        assert!((levels[levels.len() - 1] - pressure - 25.36).abs() < 0.01, "{pressure} dB(A) at 7.5 m");
    }
    let output = folder.text("two.h5");
    folder.call(1, "run", &["--output", &output, "--wall-time", "0.01"]).failed(5, &["--resume"]);
    folder.call(1, "run", &["--resume", &output]).good();
    for name in ["lower/power", "upper/density"].map(|n| format!("transient/sound_power/{n}")) {
        assert_eq!(numbers(&folder, "one.h5", &name), numbers(&folder, "two.h5", &name), "{name}");
    }
    folder.call(2, "run", &["--output", &output, "--force"]).good();
    for (body, level) in ["lower", "upper"].iter().zip(levels) {
        let two = numbers(&folder, "two.h5", &format!("transient/sound_power/{body}/total_level_a"))[0];
        assert!((level - two).abs() < 1.0, "{body}: {level} dB(A) on one rank, {two} on two");
    }
}
