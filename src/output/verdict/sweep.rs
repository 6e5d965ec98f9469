//! Sentences on the points of a sweep and their limit cycles.

use super::names::BODIES;
use super::numbers::{general, hertz, rounded};
use super::tables::Tables;
use super::VerdictKind;
use crate::stability::oscillates;

/// Frequency below which the fastest growth of a point has no oscillation, Hz.
const STILL: f64 = 1e-3;

/// Kind and sentence of a sweep: points that squeal, and the one with the fastest growth.
pub(super) fn points(tables: &Tables) -> (VerdictKind, String) {
    let path = |name: &str| tables.numbers(&format!("/sweep/{name}"));
    let (status, unstable) = (path("status"), path("unstable"));
    let (growth, frequency) = (path("growth_rate"), path("frequency"));
    let failed = status.iter().filter(|s| **s != 0.0).count();
    let computed = status.len() - failed;
    let missing = match failed {
        0 => String::new(),
        1 => "; 1 point failed".into(),
        n => format!("; {n} points failed"),
    };
    let grows: Vec<usize> = (0..unstable.len()).filter(|&i| unstable[i] > 0.0).collect();
    let fastest = grows.iter().copied().filter(|&i| growth.get(i).is_some_and(|g| g.is_finite()));
    let Some(place) = fastest.fold(None, |best: Option<usize>, i| match best {
        Some(b) if growth[b] >= growth[i] => best,
        _ => Some(i),
    }) else {
        return (VerdictKind::Quiet, format!("Sweep: no growth at any of {computed} points{missing}."));
    };
    let how = match frequency.get(place) {
        Some(f) if *f > STILL => format!("at {}", hertz(*f)),
        _ => "without oscillation (stick–slip relaxation)".into(),
    };
    let sentence = format!(
        "Sweep: growth at {} of {computed} points{missing}; fastest {} 1/s {how}, with {}.",
        grows.len(),
        rounded(growth[place]),
        point(tables, place)
    );
    (kind(tables, &unstable), sentence)
}

/// Squeal where the growing eigenvalues of a point oscillate.
fn kind(tables: &Tables, unstable: &[f64]) -> VerdictKind {
    let offset = tables.numbers("/sweep/offset");
    let values = tables.complexes("/sweep/eigenvalue");
    // Eigenvalues come by falling growth rate: those that grow are the first ones.
    let growing = unstable.iter().zip(&offset).flat_map(|(n, begin)| {
        let begin = *begin as usize;
        values.get(begin..begin + *n as usize).unwrap_or_default()
    });
    match growing.into_iter().any(|value| oscillates(*value)) {
        true => VerdictKind::Squeal,
        false => VerdictKind::Relaxation,
    }
}

/// Values of the swept keys at a point.
fn point(tables: &Tables, place: usize) -> String {
    let said = |key: &String| {
        let path = format!("/sweep/values/{key}");
        match (tables.texts(&path).get(place), tables.numbers(&path).get(place)) {
            (Some(word), _) => format!("{key} = {word}"),
            (None, Some(number)) => {
                let unit = Some(tables.units(&path)).filter(|u| !["1", "-"].contains(u)).unwrap_or_default();
                format!("{key} = {} {unit}", general(*number, 6)).trim_end().to_owned()
            }
            (None, None) => key.clone(),
        }
    };
    tables.texts("/sweep/keys").iter().map(said).collect::<Vec<_>>().join(", ")
}

/// The loudest limit cycle by the sound power of its louder body; none without sound power.
pub(super) fn loudest_cycle(tables: &Tables) -> Option<String> {
    let level = |body: &str| tables.numbers(&format!("/sweep/cycles/sound_power/{body}/total_level_a"));
    let all: Vec<Vec<f64>> = BODIES.iter().map(|body| level(body)).filter(|v| !v.is_empty()).collect();
    let columns = tables.columns("/sweep/cycles/frequency").max(1);
    let count = all.iter().map(Vec::len).max()?;
    let loudest = |i: usize| {
        let levels = all.iter().filter_map(|v| v.get(i).copied()).filter(|l| l.is_finite());
        levels.fold(f64::NEG_INFINITY, f64::max)
    };
    let place = (0..count).filter(|&i| loudest(i).is_finite()).max_by(|&a, &b| {
        // Of equal ones the first.
        loudest(a).total_cmp(&loudest(b)).then(b.cmp(&a))
    })?;
    let frequency = tables.numbers("/sweep/cycles/frequency").get(place).copied()?;
    Some(format!(
        "Limit cycles: the loudest has {:.0} dB(A) of sound power at {}, with {}.",
        loudest(place),
        hertz(frequency),
        point(tables, place % columns)
    ))
}
