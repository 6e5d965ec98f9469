//! Damping of the bodies: the default of wheels, the damping in words, and bodies without any.

use super::model::*;
use serde_json::Value;

/// Keys below `bodies` of the bodies whose damping a job (as written, overrides applied) states. An empty object states
/// nothing.
pub(super) fn stated(job: &Value) -> Vec<String> {
    let states = |body: &Value| body.get("damping").and_then(Value::as_object).is_some_and(|keys| !keys.is_empty());
    let of = |key: &str| job.pointer(key).and_then(Value::as_object).into_iter().flatten();
    let two = of("/bodies").filter(|(key, _)| *key != "others").map(|(key, body)| (key.clone(), body));
    let others = of("/bodies/others").map(|(name, body)| (format!("others.{name}"), body));
    two.chain(others).filter(|(_, body)| states(body)).map(|(key, _)| key).collect()
}

impl Section {
    /// Returns whether the section is that of a wheel by its name.
    fn is_wheel(&self) -> bool {
        !matches!(self, Section::Cylinder(_) | Section::File(_))
    }
}

/// Returns whether a body is a wheel whose modes have nodal diameters: one with a built-in section of a wheel, or, as
/// the wheel of a placement (`on_rail`), one with any section of revolution or with a mesh file that turns.
fn is_wheel(body: &Body, on_rail: bool) -> bool {
    match &body.mesh {
        Some(MeshSource::Revolved(revolved)) => on_rail || revolved.section.is_wheel(),
        Some(MeshSource::File(_)) => on_rail && body.rotates(),
        _ => false,
    }
}

impl Job {
    /// Gives wheels whose damping is not `stated` that of steel wheels. The rotation is resolved.
    pub(super) fn resolve_damping(&mut self, stated: &[String]) {
        let placed = self.placement().is_some();
        let keys: Vec<String> = self.all_bodies().into_iter().map(|(key, _)| key).collect();
        for (key, body) in keys.iter().zip(self.bodies.all_mut()) {
            if !stated.contains(key) && is_wheel(body, placed && key == "upper") {
                body.damping = Damping::of_steel_wheels();
            }
        }
    }
}

/// Returns whether the damping of a resolved `body` is none other than before format 5, in which the section W920S
/// alone had that of steel wheels by default.
pub(super) fn as_before_5(body: &Value) -> bool {
    let wheels = serde_json::to_value(Damping::of_steel_wheels()).ok();
    let built_in = body.pointer("/mesh/revolved/section").is_some_and(|s| s == "W920S");
    built_in || body.get("damping") != wheels.as_ref()
}

/// Bodies with modes on which an analysis of the contact works.
fn moving(job: &Job) -> Vec<(String, &Body)> {
    let on_modes = job.contact.is_some() && job.analyses.modes.is_some();
    job.all_bodies().into_iter().filter(|(_, body)| on_modes && !body.is_half_space()).collect()
}

/// The damping of each body with modes, in words, one line each.
pub(crate) fn damping_lines(job: &Job) -> Vec<String> {
    let line = |(key, body): (String, &Body)| format!("damping of {}: {}", job.bodies.name_of(&key), text(body));
    moving(job).into_iter().map(line).collect()
}

/// Warnings of bodies without damping in analyses that their modes decide.
pub fn undamped(job: &Job) -> Vec<String> {
    let a = &job.analyses;
    if a.stability.is_none() && a.transient.is_none() && a.sweep.is_none() {
        return Vec::new();
    }
    // What a body by matrices has is what the other program gave it.
    let bare = |body: &Body| body.matrices.is_none() && sources(body).is_empty();
    let warning = |(name, body): (String, &Body)| {
        let diameters = body.rotates() || matches!(body.mesh, Some(MeshSource::Revolved(_)));
        let example = match diameters {
            true => "{\"modal\": {\"by_diameter\": [0.002, 0.02, 0.0002]}} of a steel wheel",
            false => "{\"modal\": {\"by_frequency\": [{\"loss_factor\": 0.001}]}}",
        };
        job.bodies.with_names(format!(
            "bodies.{name}.damping: found none, and no support damps the body either: modes without damping are \
             unstable at \
             the slightest push, also those that no body of metal would show so; expected damping, e.g. {example}"
        ))
    };
    moving(job).into_iter().filter(|(_, b)| bare(b)).map(warning).collect()
}

/// The damping of a body in words.
fn text(body: &Body) -> String {
    let sources = sources(body);
    match sources.is_empty() {
        true => "none".into(),
        false => sources.join("; "),
    }
}

/// Damping of a body in words.
fn sources(body: &Body) -> Vec<String> {
    let mut all = Vec::new();
    if let Some(m) = &body.matrices {
        if let Some(file) = m.damping.as_ref().filter(|_| m.damping_factor > 0.0) {
            let times = if m.damping_factor == 1.0 { String::new() } else { format!("{} times ", m.damping_factor) };
            all.push(format!("{times}the matrix {}", file.path().display()));
        }
        if m.damping_factor > 0.0 && m.supports.iter().any(|s| s.damping.is_some_and(|d| d.iter().any(|c| *c > 0.0))) {
            all.push("dashpots of supports".into());
        }
    }
    if let (Some(MeshSource::Extruded(_)), Some(track)) = (&body.mesh, &body.track) {
        all.extend(of_track(track));
    }
    all.extend(own(&body.damping));
    let lossy = body.absorbers.iter().filter(|a| a.loss_factor > 0.0);
    all.extend(lossy.map(|a| {
        let (n, f, loss) = (a.count, a.frequency, a.loss_factor);
        format!("{n} absorbers of {:.4} kg in all at {f} Hz with the loss factor {loss}", a.mass)
    }));
    let lossy = body.ring_dampers.iter().filter(|r| r.loss_factor > 0.0);
    all.extend(lossy.map(|r| format!("ring damper at {} Hz with the loss factor {}", r.frequency, r.loss_factor)));
    let supports: Vec<&str> = body.supports.iter().filter(|s| s.damps()).map(|s| s.group.as_str()).collect();
    if !supports.is_empty() {
        all.push(format!("supports at {}", supports.join(", ")));
    }
    all
}

/// Damping of a rail in words.
fn of_track(track: &Track) -> Vec<String> {
    let mut all = Vec::new();
    let mut factor = |what: &str, value: f64| {
        if value > 0.0 {
            all.push(format!("loss factor {value} {what}"));
        }
    };
    factor("of the rail", track.loss_factor);
    factor("of the pads", track.pad.loss_factor);
    if let Some(sleeper) = &track.sleeper {
        factor("of the ballast", sleeper.ballast.loss_factor);
    }
    if track.ends.length > 0.0 && (track.ends.damping > 0.0 || track.ends.longitudinal > 0.0) {
        all.push(format!("absorbing ends of {} m", track.ends.length));
    }
    all
}

/// Most loss factors that are listed.
const LISTED: usize = 8;

/// The damping by `damping` of a body, where it is any.
fn own(damping: &Damping) -> Option<String> {
    let zero = |factors: &[LossFactor]| factors.iter().all(|f| f.0 == 0.0);
    let list = |words: Vec<String>| match words.len() {
        n if n > LISTED => format!("{}, and {} more", words[..LISTED].join(", "), n - LISTED),
        _ => words.join(", "),
    };
    match &damping.modal {
        None => (damping.alpha > 0.0 || damping.beta > 0.0)
            .then(|| format!("Rayleigh damping, alpha {} 1/s and beta {:e} s", damping.alpha, damping.beta)),
        Some(ModalDamping::ByMode(factors) | ModalDamping::ByDiameter(factors)) if zero(factors) => None,
        Some(ModalDamping::ByFrequency(bands)) if bands.iter().all(|b| b.loss_factor.0 == 0.0) => None,
        Some(ModalDamping::ByMode(factors)) => match &factors[..] {
            [one] => Some(format!("loss factor {} of all modes", one.0)),
            all => {
                let words = all.iter().map(|f| f.0.to_string()).collect();
                Some(format!("loss factors {} by mode, the last of all that follow", list(words)))
            }
        },
        Some(ModalDamping::ByFrequency(bands)) => {
            let word = |band: &DampingBand| match band.up_to {
                Some(end) => format!("{} up to {end} Hz", band.loss_factor.0),
                None => format!("{} above", band.loss_factor.0),
            };
            Some(match &bands[..] {
                [only] if only.up_to.is_none() => format!("loss factor {} of all modes", only.loss_factor.0),
                all => format!("loss factors {}", list(all.iter().map(word).collect())),
            })
        }
        Some(ModalDamping::ByDiameter(factors)) => {
            let last = factors.len() - 1;
            let word = |(n, factor): (usize, &LossFactor)| match n {
                n if n == last => format!("{} (n >= {n})", factor.0),
                n => format!("{} (n = {n})", factor.0),
            };
            let words = list(factors.iter().enumerate().map(word).collect());
            let default = if *damping == Damping::of_steel_wheels() { ", the default of wheels" } else { "" };
            Some(format!("loss factors {words}{default}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Job;
    use super::*;
    use std::path::Path;

    const DRAWN: &str = include_str!("../../jobs/drawn-wheel.json");
    const MESHED: &str = include_str!("../../jobs/wheel-on-rail-3d.json");
    const CYLINDERS: &str = include_str!("../../jobs/two-cylinders.json");
    const BUILT_IN: &str = include_str!("../../jobs/wheel-at-given-yaw.json");
    const BY_DEFAULT: &str =
        "damping of upper: loss factors 0.002 (n = 0), 0.02 (n = 1), 0.0002 (n >= 2), the default of wheels";

    /// The job without the damping that its bodies state.
    fn bare(text: &str) -> Value {
        let mut value: Value = serde_json::from_str(text).unwrap();
        for body in value["bodies"].as_object_mut().unwrap().values_mut() {
            body.as_object_mut().unwrap().remove("damping");
        }
        value
    }

    fn read(value: &Value, sets: &[&str]) -> Job {
        let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
        Job::from_bytes(value.to_string().as_bytes(), Path::new("job.json"), &sets, None).unwrap()
    }

    fn upper(job: &Job) -> &Damping {
        &job.bodies.upper.as_ref().unwrap().damping
    }

    #[test]
    fn wheels_of_every_kind_have_the_default_on_a_rail() {
        for text in [DRAWN, MESHED, BUILT_IN] {
            let job = read(&bare(text), &[]);
            assert_eq!(*upper(&job), Damping::of_steel_wheels());
            assert_eq!(job.bodies.lower.as_ref().unwrap().damping, Damping::default(), "no rail is a wheel");
            assert!(damping_lines(&job).contains(&BY_DEFAULT.to_string()), "{:?}", damping_lines(&job));
            // As resolved it is the same job.
            assert_eq!(upper(&read(&job.to_json(), &[])), upper(&job));
        }
        // What is stated holds, be it none.
        for stated in ["{\"alpha\": 2}", "{\"alpha\": 0}", "{\"modal\": {\"by_mode\": [0]}}"] {
            let job = read(&bare(DRAWN), &[&format!("bodies.upper.damping={stated}")]);
            assert_ne!(*upper(&job), Damping::of_steel_wheels(), "{stated}");
        }
        assert_eq!(*upper(&read(&bare(DRAWN), &["bodies.upper.damping={}"])), Damping::of_steel_wheels());
    }

    #[test]
    fn bodies_that_are_no_wheels_stay_without_damping() {
        let job = read(&bare(CYLINDERS), &[]);
        assert_eq!(*upper(&job), Damping::default());
        assert_eq!(damping_lines(&job), ["damping of lower: none", "damping of upper: none"]);
        // A mesh whose nodal diameters nothing tells.
        let rest = read(&bare(MESHED), &["bodies.upper.rotation=none"]);
        assert_eq!(*upper(&rest), Damping::default());
        assert!(undamped(&rest).iter().any(|w| w.starts_with("bodies.upper.damping: found none")), "{rest:?}");
    }

    #[test]
    fn points_of_a_sweep_have_the_damping_of_their_job() {
        let sweep = "analyses.sweep={\"keys\": {\"contact.friction\": [0.2, 0.3]}}";
        let job = read(&bare(DRAWN), &[sweep]);
        let points = &job.sweep.as_ref().unwrap().points;
        assert!(points.iter().all(|p| *upper(p) == Damping::of_steel_wheels()));
    }

    #[test]
    fn a_job_of_format_4_is_told_of_the_wheels_that_were_without() {
        let told = "bodies.upper.damping is not given: loss factors by nodal diameters since format 5, none before";
        for (text, expected) in [(DRAWN, vec![told]), (MESHED, vec![told]), (BUILT_IN, vec![]), (CYLINDERS, vec![])] {
            let mut value = bare(text);
            value["version"] = 4.into();
            let changed = read(&value, &[]).changed_defaults;
            let changed: Vec<&str> = changed.iter().filter(|c| c.contains("damping")).map(String::as_str).collect();
            assert_eq!(changed, expected);
            value["version"] = 5.into();
            assert!(read(&value, &[]).changed_defaults.iter().all(|c| !c.contains("damping")));
        }
        // As it is shipped the drawn wheel states its own.
        let shipped: Value = serde_json::from_str(DRAWN).unwrap();
        assert!(read(&shipped, &["version=4"]).changed_defaults.iter().all(|c| !c.contains("damping")));
    }

    #[test]
    fn a_body_without_damping_is_warned_of_where_its_modes_decide() {
        let job = read(&bare(CYLINDERS), &["bodies.upper.damping={\"beta\": 1e-6}"]);
        let [warning] = &undamped(&job)[..] else { panic!("{:?}", undamped(&job)) };
        assert!(
            warning.starts_with("bodies.lower.damping: found none") && warning.contains("by_frequency"),
            "{warning}"
        );
        let spring = "bodies.lower.supports=[{\"group\": \"side_plus\", \"damping\": {\"z\": 10}}]";
        assert_eq!(undamped(&read(&bare(CYLINDERS), &["bodies.upper.damping.beta=1e-6", spring])), [""; 0]);
        assert_eq!(undamped(&read(&bare(CYLINDERS), &["analyses.stability=null"])), [""; 0]);
        for value in ["{\"modal\": {\"by_diameter\": [0, 0]}}", "{\"alpha\": 0}"] {
            let set = format!("bodies.upper.damping={value}");
            let wheel = undamped(&read(&bare(DRAWN), &[&set]));
            assert!(wheel[0].starts_with("bodies.upper.damping") && wheel[0].contains("by_diameter"), "{wheel:?}");
        }
    }

    #[test]
    fn damping_is_told_in_words() {
        let words = |damping: &str| damping_lines(&read(&bare(DRAWN), &[&format!("bodies.upper.damping={damping}")]));
        for (damping, expected) in [
            ("{\"alpha\": 1, \"beta\": 1e-6}", "Rayleigh damping, alpha 1 1/s and beta 1e-6 s"),
            ("{\"modal\": {\"by_mode\": [0.001]}}", "loss factor 0.001 of all modes"),
            ("{\"modal\": {\"by_mode\": [0.1, 0.01]}}", "loss factors 0.1, 0.01 by mode, the last of all that follow"),
            ("{\"modal\": {\"by_diameter\": [0.1, 0.01]}}", "loss factors 0.1 (n = 0), 0.01 (n >= 1)"),
            (
                "{\"modal\": {\"by_frequency\": [{\"up_to\": 900, \"loss_factor\": 0.01}, {\"loss_factor\": 0.002}]}}",
                "loss factors 0.01 up to 900 Hz, 0.002 above",
            ),
        ] {
            let lines = words(damping);
            assert_eq!(lines[1], format!("damping of upper: {expected}"));
            assert_eq!(
                lines[0],
                "damping of lower: loss factor 0.02 of the rail; loss factor 0.2 of the pads; absorbing ends of 5 m"
            );
        }
    }
}
