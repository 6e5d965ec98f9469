//! The verdict on a result in a sentence: what squeals and what would end it, or what is least damped. The summary
//! begins with it, and the group `/verdict` has it for the report.

mod branches;
mod names;
mod numbers;
mod sweep;
mod tables;
#[cfg(test)]
mod tests;

use super::table::Table;
use crate::stability::oscillates;
use names::{body_words, Names, BODIES};
use num_complex::Complex64;
use numbers::{general, hertz, percent, rounded};
use serde_json::Value;
use std::f64::consts::PI;
use tables::Tables;

/// Other squealing frequencies that the sentence names.
const OTHERS: usize = 5;
/// Largest shift of the contact, m, largest loss factor, and largest part of the friction, that are proposed.
const SHIFT: f64 = 10e-3;
const LOSS_FACTOR: f64 = 0.1;
const FRICTION: f64 = 0.5;

/// Answer of a result to the question whether the wheel squeals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VerdictKind {
    /// A mode grows and oscillates.
    Squeal,
    /// An eigenvalue grows without oscillation, none with one.
    Relaxation,
    /// Nothing grows.
    Quiet,
    /// The result has nothing that tells.
    Open,
}

impl VerdictKind {
    /// The word for it in `/verdict/kind`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Squeal => "squeal",
            Self::Relaxation => "relaxation",
            Self::Quiet => "quiet",
            Self::Open => "none",
        }
    }
}

/// The verdict: one sentence, and further ones on sweeps and limit cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The answer.
    pub kind: VerdictKind,
    /// The answer in words.
    pub sentence: String,
    /// Sentences that belong to it.
    pub notes: Vec<String>,
}

impl Verdict {
    /// The verdict by the `tables` of a run of the resolved `job`. None where only a motion in time tells, whose
    /// steps are not among the tables ([`of_motion`]).
    pub fn new(job: &Value, tables: &[Table]) -> Option<Self> {
        let tables = Tables(tables);
        let swept = tables.has("/sweep/keys").then(|| sweep::points(&tables));
        let mut notes: Vec<String> = swept.iter().map(|(_, text)| text.clone()).collect();
        notes.extend(sweep::loudest_cycle(&tables));
        notes.extend(branches::limit_cycles(&tables));
        let (kind, sentence) = if tables.has("/stability/eigenvalue") {
            notes.extend(without_modes(job, &tables));
            by_stability(job, &tables)
        } else if job["analyses"]["transient"].is_object() {
            return None;
        } else if let Some((kind, _)) = swept {
            let sentence = notes.remove(0);
            return Some(Self { kind, sentence, notes });
        } else {
            (VerdictKind::Open, computed(&tables))
        };
        // The point of the job itself may be quiet where others of the sweep are not.
        if kind != VerdictKind::Squeal && matches!(swept, Some((VerdictKind::Squeal, _))) {
            let squeals = std::mem::replace(&mut notes[0], format!("The point of the job itself: {sentence}"));
            return Some(Self { kind: VerdictKind::Squeal, sentence: squeals, notes });
        }
        Some(Self { kind, sentence, notes })
    }

    /// All sentences in their order.
    pub fn lines(&self) -> impl Iterator<Item = &str> {
        std::iter::once(&self.sentence).chain(&self.notes).map(String::as_str)
    }

    /// The group `/verdict`.
    pub fn tables(&self) -> Vec<Table> {
        vec![
            Table::scalar(
                "/verdict/kind",
                "-",
                "squeal: a mode grows and oscillates; relaxation: growth without oscillation alone; quiet: no growth; \
                 none: the result does not tell.",
                self.kind.word(),
            ),
            Table::scalar("/verdict/sentence", "-", "The verdict in a sentence.", self.sentence.as_str()),
            Table::list("/verdict/notes", "-", "Sentences on sweeps and limit cycles.", self.notes.clone()),
        ]
    }
}

/// Sentence on a motion in time without a stability analysis, that grows by `rate`, 1/s, and has its strongest line
/// at `frequency`, Hz, in the end.
pub fn of_motion(job: &Value, tables: &[Table], rate: Option<f64>, frequency: Option<f64>) -> String {
    let heard = loudness(&Tables(tables), body_words(job)).map_or(String::new(), |text| format!("; {text}"));
    let end = frequency.map(hertz);
    match (rate, end) {
        (Some(rate), Some(end)) if rate > 0.0 => {
            format!("Squeals: the motion grows at {} 1/s and is at {end} in the end{heard}.", rounded(rate))
        }
        (Some(rate), _) if rate <= 0.0 => format!("The motion in time decays at {} 1/s{heard}.", rounded(-rate)),
        (_, Some(end)) => {
            format!("The motion in time shows no exponential growth; its strongest periodic part is at {end}{heard}.")
        }
        _ => format!("The motion in time has come to rest{heard}."),
    }
}

/// Eigenvalues of a result with what names them.
struct Spectrum {
    value: Vec<Complex64>,
    /// Places of those that count, each motion once: of the same in both models that of the full system.
    distinct: Vec<usize>,
    grows: Vec<bool>,
}

impl Spectrum {
    fn of(tables: &Tables) -> Self {
        let value = tables.complexes("/stability/eigenvalue").to_vec();
        let (partner, source) = (tables.numbers("/stability/partner"), tables.texts("/stability/source"));
        let twice = |k: &usize| {
            partner.get(*k).is_some_and(|p| *p >= 0.0) && source.get(*k).is_some_and(|source| source == "reduced")
        };
        let distinct = (0..value.len()).filter(|k| !twice(k)).collect();
        let grows = tables.numbers("/stability/unstable").iter().map(|u| *u > 0.0).collect();
        Self { value, distinct, grows }
    }

    fn grows(&self, k: usize) -> bool {
        self.grows.get(k).copied().unwrap_or(false)
    }

    /// Places of the eigenvalues that grow, with oscillation or without, by falling growth rate.
    fn growing(&self, with_oscillation: bool) -> Vec<usize> {
        let all = self.distinct.iter().copied();
        let mut places: Vec<usize> =
            all.filter(|&k| self.grows(k) && oscillates(self.value[k]) == with_oscillation).collect();
        places.sort_by(|&a, &b| self.value[b].re.total_cmp(&self.value[a].re));
        places
    }

    fn frequency(&self, k: usize) -> f64 {
        self.value[k].im.abs() / (2.0 * PI)
    }

    fn damping_ratio(&self, k: usize) -> f64 {
        -self.value[k].re / self.value[k].norm().max(f64::MIN_POSITIVE)
    }

    fn rate(&self, k: usize) -> String {
        format!("{} 1/s", rounded(self.value[k].re))
    }
}

/// Kind and sentence of a stability analysis.
fn by_stability(job: &Value, tables: &Tables) -> (VerdictKind, String) {
    let (spectrum, names) = (Spectrum::of(tables), Names::new(job, tables));
    let (growing, relaxing) = (spectrum.growing(true), spectrum.growing(false));
    let lowest = infinite_from(tables);
    let (low, unstable): (Vec<usize>, Vec<usize>) = growing.into_iter().partition(|&k| spectrum.frequency(k) < lowest);
    let apart = match relaxing[..] {
        [] => None,
        [only] => Some(format!(
            "one eigenvalue grows without oscillation (stick–slip relaxation), at {}",
            spectrum.rate(only)
        )),
        [first, ..] => Some(format!(
            "{} eigenvalues grow without oscillation (stick–slip relaxation), the fastest at {}",
            relaxing.len(),
            spectrum.rate(first)
        )),
    };
    if let [first, others @ ..] = &unstable[..] {
        let mut parts =
            vec![format!("Squeals at {}: {}", hertz(spectrum.frequency(*first)), described(&spectrum, &names, *first))];
        if !others.is_empty() {
            parts.push(format!("also at {}", listed(&spectrum, others)));
        }
        parts.extend(loudness(tables, names.bodies));
        parts.extend(cures(job, tables, (&spectrum, &names), &unstable));
        parts.extend(apart.map(|text| format!("apart from these, {text}")));
        parts.extend(below(&spectrum, &low, lowest));
        return (VerdictKind::Squeal, format!("{}.", parts.join("; ")));
    }
    let limit = searched(job, &spectrum);
    let more = below(&spectrum, &low, lowest).into_iter().chain(least_damped(&spectrum, &names));
    let damped: String = more.map(|text| format!("; {text}")).collect();
    match apart {
        Some(apart) => (VerdictKind::Relaxation, format!("No squealing mode found{limit}, but {apart}{damped}.")),
        None => (VerdictKind::Quiet, format!("No squeal found{limit}{damped}.")),
    }
}

/// Frequency, Hz, below which growth depends on the ends of a rail of finite length; 0 without a rail.
fn infinite_from(tables: &Tables) -> f64 {
    let of = |body: &&str| tables.numbers(&format!("/modes/{body}/infinite_from")).first().copied();
    BODIES.iter().filter_map(of).fold(0.0, f64::max)
}

/// Growth of the modes `low` below the frequency `lowest`, Hz, in words; none without such modes.
fn below(spectrum: &Spectrum, low: &[usize], lowest: f64) -> Option<String> {
    let first = *low.first()?;
    Some(format!(
        "growth at {} ({}) depends on the ends of the rail, which is one of infinite length from {} on",
        listed(spectrum, low),
        spectrum.rate(first),
        hertz(lowest)
    ))
}

/// Frequencies as `985, 358 and 344 Hz`, at most [`OTHERS`] of them.
fn listed(spectrum: &Spectrum, places: &[usize]) -> String {
    let hertz = |k: &usize| hertz(spectrum.frequency(*k)).trim_end_matches(" Hz").to_owned();
    let words: Vec<String> = places.iter().take(OTHERS).map(hertz).collect();
    match (&words[..], places.len().saturating_sub(OTHERS)) {
        (_, more @ 1..) => format!("{} Hz and {more} more frequencies", words.join(", ")),
        ([before @ .., last], _) if !before.is_empty() => format!("{} and {last} Hz", before.join(", ")),
        _ => format!("{} Hz", words.join(", ")),
    }
}

/// Name, growth rate and damping ratio of an eigenvalue.
fn described(spectrum: &Spectrum, names: &Names, place: usize) -> String {
    let ratio = percent(spectrum.damping_ratio(place));
    let text = format!("growth rate {} (damping ratio {ratio})", spectrum.rate(place));
    match names.dominant(place) {
        name if name.is_empty() => text,
        name => format!("{name}, {text}"),
    }
}

/// The oscillating mode with the smallest damping ratio, in words.
fn least_damped(spectrum: &Spectrum, names: &Names) -> Option<String> {
    let counts = |k: &&usize| oscillates(spectrum.value[**k]) && !spectrum.grows(**k) && spectrum.frequency(**k) > 0.1;
    let ratio = |k: &usize| spectrum.damping_ratio(*k);
    let &place = spectrum.distinct.iter().filter(counts).min_by(|a, b| ratio(a).total_cmp(&ratio(b)))?;
    let name = match names.dominant(place) {
        name if name.is_empty() => name,
        name => format!(", {name}"),
    };
    let at = hertz(spectrum.frequency(place));
    Some(format!("least damped: {at}{name}, damping ratio {}", percent(spectrum.damping_ratio(place))))
}

/// Frequency up to which eigenvalues were searched.
fn searched(job: &Value, spectrum: &Spectrum) -> String {
    let analyses = &job["analyses"];
    let given = [&analyses["stability"]["full"], &analyses["stability"], &analyses["modes"]];
    let limit = given.iter().filter_map(|a| a["max_frequency"].as_f64()).find(|limit| *limit > 0.0);
    let highest = || (0..spectrum.value.len()).map(|k| spectrum.frequency(k)).fold(0.0, f64::max);
    match limit {
        Some(limit) => format!(" up to {} kHz", general(limit / 1000.0, 6)),
        None => match highest() {
            highest if highest > 0.0 => format!(" up to {} kHz", general(highest / 1000.0, 2)),
            _ => String::new(),
        },
    }
}

/// Changes that would each end all growth, by linear estimates: loss factor of one body, shift of the contact,
/// friction.
fn cures(job: &Value, tables: &Tables, (spectrum, names): (&Spectrum, &Names), unstable: &[usize]) -> Option<String> {
    let mut parts = Vec::new();
    let wanted: Option<Vec<(usize, f64)>> = unstable.iter().map(|&k| extra_loss_factor(spectrum, names, k)).collect();
    let wanted = wanted.filter(|all| all.windows(2).all(|w| w[0].0 == w[1].0)).unwrap_or_default();
    if let Some((body, most)) = wanted.into_iter().reduce(|a, b| if b.1 > a.1 { b } else { a }) {
        if most <= LOSS_FACTOR {
            let body = names.bodies[body];
            parts.push(format!("with a loss factor of the {body} that is higher by {}", rounded(most)));
        }
    }
    let change =
        |name: &str| needed_change(spectrum, tables.complexes(&format!("/stability/sensitivity/{name}")), unstable);
    if let Some(shift) = change("upper_position").filter(|s| s.abs() <= SHIFT) {
        let shift = general((1e4 * shift).round() / 10.0, 6);
        parts.push(format!("with the contact on the upper body {shift} mm further in y"));
    }
    if let Some(less) = change("friction").filter(|c| (-FRICTION..0.0).contains(c)) {
        // The sensitivity is that to the friction of all contacts.
        let alike = job["contact"]["friction_zones"].is_null() && job["contact"]["around"].is_null();
        parts.push(match job["contact"]["friction"].as_f64().filter(|_| alike) {
            Some(friction) => format!("with friction below {}", rounded(friction * (1.0 + less))),
            None => format!("with friction lower by {} %", rounded(-100.0 * less)),
        });
    }
    (!parts.is_empty()).then(|| format!("quiet {} (linear estimate)", parts.join(" or ")))
}

/// Body with most of a mode's energy, and the additional loss factor that its modes need: 2|ζ| over its share.
fn extra_loss_factor(spectrum: &Spectrum, names: &Names, place: usize) -> Option<(usize, f64)> {
    let mut per_body = [0.0; 2];
    names.shares(place).iter().for_each(|(body, _, share)| per_body[*body] += share);
    let body = usize::from(per_body[1] > per_body[0]);
    (per_body[body] > 0.5).then(|| (body, -2.0 * spectrum.damping_ratio(place) / per_body[body]))
}

/// The change of a parameter that would end all growth, from the derivatives of the eigenvalues by it; none where
/// modes need changes of opposite signs, or one has no derivative.
fn needed_change(spectrum: &Spectrum, slopes: &[Complex64], unstable: &[usize]) -> Option<f64> {
    let change = |k: &usize| {
        let slope = slopes.get(*k)?.re;
        (slope.is_finite() && slope != 0.0).then(|| -spectrum.value[*k].re / slope)
    };
    let all: Vec<f64> = unstable.iter().map(change).collect::<Option<_>>()?;
    let same = all.windows(2).all(|w| w[0].signum() == w[1].signum());
    all.into_iter().filter(|_| same).reduce(|a, b| if b.abs() > a.abs() { b } else { a })
}

/// Sound power of the motion in time, of the louder body; none without it.
fn loudness(tables: &Tables, bodies: [&str; 2]) -> Option<String> {
    let level =
        |b: usize| tables.numbers(&format!("/transient/sound_power/{}/total_level_a", BODIES[b])).first().copied();
    let levels = (0..2).filter_map(|b| Some((b, level(b)?)));
    let (body, level) = levels.reduce(|a, b| if b.1 > a.1 { b } else { a })?;
    level.is_finite().then(|| format!("about {level:.0} dB(A) of sound power, most from the {}", bodies[body]))
}

/// Note on a body without modes, on which the verdict says nothing.
fn without_modes(job: &Value, tables: &Tables) -> Option<String> {
    let missing: Vec<usize> = (0..2).filter(|&b| !tables.has(&format!("/modes/{}/frequency", BODIES[b]))).collect();
    match missing[..] {
        [one] => Some(format!("The {} has no modes in this result.", body_words(job)[one])),
        _ => None,
    }
}

/// Sentence of a run without stability analysis: its results.
fn computed(tables: &Tables) -> String {
    let all = [
        ("/curving/", "the vehicle in its curve"),
        ("/modes/", "free modes"),
        ("/receptance/", "receptances of the contact"),
        ("/track_decay/", "track decay rates"),
        ("/contact/pressure", "steady rolling"),
        ("/creep_curve/", "a creep curve"),
    ];
    let found: Vec<&str> = all.iter().filter(|(begin, _)| tables.has_group(begin)).map(|(_, words)| *words).collect();
    let found = match &found[..] {
        [] => "nothing else".to_owned(),
        [only] => (*only).to_owned(),
        [before @ .., last] => format!("{} and {last}", before.join(", ")),
    };
    format!("No statement on squeal, as the job has no stability analysis; computed: {found}.")
}
