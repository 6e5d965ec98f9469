//! Names of free modes and of eigenvalues: body, nodal diameters, kind of motion.

use super::tables::Tables;
use serde_json::Value;

/// Share of a kind of free mode in an eigenvector below which it is not named.
const LEAST_SHARE: f64 = 0.1;
/// Share from which the first kind is named alone.
const ALONE: f64 = 0.8;

/// Bodies in the order of their numbers.
pub(super) const BODIES: [&str; 2] = ["lower", "upper"];

/// Names of both bodies: rail and wheel where one is an extruded rail or they are placed, else lower and upper body.
pub(super) fn body_words(job: &Value) -> [&'static str; 2] {
    let extruded = BODIES.iter().any(|body| job["bodies"][body]["mesh"]["extruded"].is_object());
    let given = |key: &str| !matches!(job["contact"].get(key), None | Some(Value::Null | Value::Bool(false)));
    match extruded || given("placement") || given("from") {
        true => ["rail", "wheel"],
        false => ["lower body", "upper body"],
    }
}

/// Names of the free modes of both bodies and the shares that they have in eigenvectors.
pub(super) struct Names {
    /// Names of the bodies.
    pub(super) bodies: [&'static str; 2],
    /// Kind of each free mode, in the order of `/stability/mode_body`, and its body.
    modes: Vec<(usize, String)>,
    /// Shares of the free modes, `[e, m]`.
    shares: Vec<f64>,
    /// Nodal diameters of the motion of both bodies, `[e, 2]`; empty where none rotates.
    diameters: Vec<f64>,
}

impl Names {
    /// The names of a result.
    pub(super) fn new(job: &Value, tables: &Tables) -> Self {
        let bodies = body_words(job);
        let kinds: [Vec<String>; 2] = [0, 1].map(|b| kinds(tables, BODIES[b], bodies[b]));
        let mut count = [0; 2];
        let mut modes = Vec::new();
        for number in tables.numbers("/stability/mode_body") {
            let body = usize::from(number > 1.5);
            let k = count[body];
            count[body] += 1;
            let name = kinds[body].get(k).cloned().unwrap_or_else(|| format!("{} mode {}", bodies[body], k + 1));
            modes.push((body, name));
        }
        let shares = tables.numbers("/stability/participation");
        Self { bodies, modes, shares, diameters: tables.numbers("/stability/diameters") }
    }

    /// Body, kind of free mode and its share in the elastic energy of an eigenvector, largest first.
    pub(super) fn shares(&self, place: usize) -> Vec<(usize, &str, f64)> {
        let width = self.modes.len();
        let Some(row) = self.shares.get(place * width..(place + 1) * width) else { return Vec::new() };
        let mut sums: Vec<(usize, &str, f64)> = Vec::new();
        for ((body, name), share) in self.modes.iter().zip(row) {
            match sums.iter_mut().find(|(b, n, _)| (b, *n) == (body, name.as_str())) {
                Some(sum) => sum.2 += share,
                None => sums.push((*body, name.as_str(), *share)),
            }
        }
        sums.retain(|(.., share)| share.is_finite());
        sums.sort_by(|a, b| b.2.total_cmp(&a.2));
        sums
    }

    /// Kinds of free modes that make most of an eigenvector, with the direction in which its wave travels.
    pub(super) fn dominant(&self, place: usize) -> String {
        let shares = self.shares(place);
        let wanted = if shares.first().is_some_and(|s| s.2 >= ALONE) { 1 } else { 2 };
        let named: Vec<_> = shares.iter().take(wanted).filter(|s| s.2 >= LEAST_SHARE).collect();
        let Some(first) = named.first() else { return String::new() };
        let words = named.iter().map(|s| s.1).collect::<Vec<_>>().join(" with ");
        match self.diameters.get(2 * place + first.0) {
            Some(n) if *n >= 0.5 => format!("{words}, travelling with the rotation"),
            Some(n) if *n <= -0.5 => format!("{words}, travelling against the rotation"),
            _ => words,
        }
    }
}

/// Names that free modes of one kind of a body share: `wheel mode n = 3 axial`; the modes of a rail are `rail`.
fn kinds(tables: &Tables, body: &str, word: &str) -> Vec<String> {
    let list = |name: &str| tables.numbers(&format!("/modes/{body}/{name}"));
    let (frequency, diameters) = (list("frequency"), list("diameters"));
    let family = tables.texts(&format!("/modes/{body}/family"));
    let name = |(k, frequency): (usize, &f64)| {
        let Some(n) = diameters.get(k).filter(|n| n.is_finite()) else { return format!("{word} mode {}", k + 1) };
        let kind = family.get(k).map_or("", |f| f.trim_end_matches(" 0"));
        match (kind, word) {
            ("", "rail") => word.to_owned(),
            ("", _) => format!("{word} mode n = {n:.0} of {frequency:.0} Hz"),
            _ => format!("{word} mode n = {n:.0} {kind}"),
        }
    };
    frequency.iter().enumerate().map(name).collect()
}
