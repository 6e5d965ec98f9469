//! Sentence on branches of limit cycles.

use super::names::BODIES;
use super::numbers::{general, hertz, rounded};
use super::tables::Tables;

/// Thresholds of rest, and the largest cycle; none without branches.
pub(super) fn limit_cycles(tables: &Tables) -> Option<String> {
    let along = tables.texts("/cycles/along").first()?;
    let (key, frequency) = (tables.numbers("/cycles/key"), tables.numbers("/cycles/frequency"));
    let unit = Some(tables.units("/cycles/key")).filter(|u| !["1", "-"].contains(u)).unwrap_or_default();
    let value = |number: f64| format!("{} {unit}", general(number, 4)).trim_end().to_owned();
    let mut parts = Vec::new();
    let onset = |name: &str| tables.numbers(&format!("/cycles/onset/{name}"));
    let (at, above) = (onset("key"), onset("above"));
    let starts: Vec<String> = (0..at.len())
        // Where rest itself loses its stability, not where a further mode does.
        .filter(|&k| onset("mode").get(k) == Some(&0.0))
        .map(|k| {
            let side = if above.get(k) == Some(&1.0) { "above" } else { "below" };
            let frequency = onset("frequency").get(k).map_or(String::new(), |f| format!(" ({})", hertz(*f)));
            format!("{side} {}{frequency}", value(at[k]))
        })
        .collect();
    if !starts.is_empty() {
        parts.push(format!("squeal starts by itself {}", starts.join(" and ")));
    }
    // Amplitude of the body that moves faster at the middle of a contact, m/s.
    let velocity = tables.numbers("/cycles/velocity_rms");
    let width = velocity.len() / key.len().max(1);
    let rim = |place: usize| {
        let body = |v: &[f64]| (2.0 * v.iter().map(|v| v * v).sum::<f64>()).sqrt();
        velocity.get(place * width..(place + 1) * width)?.chunks(3).map(body).reduce(f64::max)
    };
    let largest = (0..key.len()).filter_map(|k| Some((k, rim(k)?))).reduce(|a, b| if b.1 > a.1 { b } else { a });
    if let Some((place, speed)) = largest {
        let level =
            |body: &str| tables.numbers(&format!("/cycles/sound_power/{body}/total_level_a")).get(place).copied();
        let heard = BODIES.iter().filter_map(|body| level(body)).filter(|l| l.is_finite()).reduce(f64::max);
        let heard = heard.map_or(String::new(), |level| format!(" and radiates {level:.0} dB(A) of sound power"));
        parts.push(format!(
            "the largest one moves the rim with {} mm/s{heard} at {}, with {along} = {}",
            rounded(1e3 * speed),
            hertz(frequency.get(place).copied()?),
            value(key[place])
        ));
    }
    Some(format!("Limit cycles over {along}: {}.", parts.join("; ")))
}
