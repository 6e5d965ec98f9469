//! Special points of a branch between two of its cycles: folds, multipliers that pass the unit circle, the first stick
//! and the first opening.

use super::branch::{BranchPoint, BranchWalk, Special, SpecialKind};
use super::corrector::{norm, Condition, CorrectorResult};
use super::floquet::Multipliers;
use super::PeriodicSolution;
use crate::{Error, Result};

/// Rounds in which a special point is located.
const ROUNDS: usize = 12;
/// Part of the longer side of a bracket at which the golden section looks next.
const GOLDEN: f64 = 0.381_966_011_250_105;
/// Halvings in which an event is located.
const BISECTIONS: usize = 40;

/// True if something happens in a cycle.
type Happens = fn(&PeriodicSolution) -> bool;

/// Events of the piecewise smooth equations, where the slope of a branch may have a kink.
const EVENTS: [(SpecialKind, Happens); 2] = [
    (SpecialKind::Stick, |cycle| cycle.contacts.iter().any(|c| c.nodes.iter().any(|n| n[1] > 0))),
    (SpecialKind::Opening, |cycle| cycle.contacts.iter().any(|c| c.nodes.iter().any(|n| n[0] != c.nodes[0][0]))),
];

impl BranchWalk<'_, '_, '_> {
    /// Special points between the last points of a branch, `here`, and the next one, to `tolerance` of the key.
    pub(super) fn between(
        &mut self,
        points: &[BranchPoint],
        here: &BranchPoint,
        there: &BranchPoint,
        tolerance: f64,
    ) -> Result<Vec<BranchPoint>> {
        let mut found: Vec<BranchPoint> = Vec::new();
        let ordinary: Vec<&BranchPoint> = points.iter().filter(|p| p.special.is_none()).collect();
        let before = ordinary.len().checked_sub(2).map(|k| ordinary[k]);
        let before = before.filter(|b| (here.key - b.key) * (there.key - here.key) < 0.0);
        if let Some(before) = before {
            found.extend(self.fold([before, here, there], tolerance)?);
        }
        for (kind, of) in EVENTS {
            if of(&here.cycle) != of(&there.cycle) {
                found.push(self.event([here, there], (kind, of), tolerance)?);
            }
        }
        if let (Some(a), Some(b)) = (&here.multipliers, &there.multipliers) {
            let folds = before.is_some();
            let change = a.unstable().abs_diff(b.unstable());
            // At a fold one multiplier passes through +1 anyway.
            if change > usize::from(folds) || (change == 1 && !folds) {
                found.extend(self.passage(here, there, tolerance)?);
            }
        }
        Ok(found)
    }

    /// The fold near `middle`, where the key is largest or smallest: parabolas through three cycles, and the golden
    /// section where they lead nowhere.
    fn fold(&mut self, [before, middle, after]: [&BranchPoint; 3], tolerance: f64) -> Result<Option<BranchPoint>> {
        let chord = self.equations.counted(after.u.iter().zip(&before.u).map(|(a, b)| a - b).collect());
        let length = norm(&chord);
        let row: Vec<f64> = chord.iter().map(|c| c / length).collect();
        let place = |u: &[f64]| u.iter().zip(&before.u).zip(&row).map(|((u, a), r)| (u - a) * r).sum::<f64>() / length;
        let sign = if middle.key > before.key { 1.0 } else { -1.0 };
        let known = |p: &BranchPoint| (place(&p.u), sign * p.key, p.u.clone());
        let [mut a, mut b, mut c] = [known(before), known(middle), known(after)];
        let mut best: Option<CorrectorResult> = None;
        let mut last: f64 = 0.0;
        for _ in 0..BISECTIONS {
            let (d, e) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
            let vertex = 0.5 * (a.0 + b.0) - 0.5 * d * (c.0 - a.0) / (e - d);
            let wide = if b.0 - a.0 > c.0 - b.0 { a.0 - b.0 } else { c.0 - b.0 };
            let good = vertex > a.0 && vertex < c.0 && (vertex - b.0).abs() > 0.02 * wide.abs();
            let next = if good { vertex } else { b.0 + GOLDEN * wide };
            let (low, high) = if next < b.0 { (&a, &b) } else { (&b, &c) };
            let part = (next - low.0) / (high.0 - low.0);
            let guess: Vec<f64> = low.2.iter().zip(&high.2).map(|(l, h)| l + part * (h - l)).collect();
            let conditions = [self.equations.phase(&guess), Condition { row: row.clone(), reference: guess.clone() }];
            let there = match self.equations.correct(guess, &conditions, &mut self.contact) {
                Ok(there) => there,
                Err(Error::NotConverged(_)) => break,
                Err(e) => return Err(e),
            };
            let now = (next, sign * self.equations.key_of(&there.u), there.u.clone());
            let gain = (now.1 - b.1).abs();
            last = gain;
            match (now.1 > b.1, next < b.0) {
                (true, true) => (c, b) = (b, now),
                (true, false) => (a, b) = (b, now),
                (false, true) => a = now,
                (false, false) => c = now,
            }
            if b.2 == there.u {
                best = Some(there);
            }
            // Parabolas come near at once; the golden section halves what is left in two steps.
            if gain < 0.1 * tolerance && (good || c.1.max(a.1) > b.1 - tolerance) {
                break;
            }
        }
        // The key of the fold differs from that of the middle one of three cycles, the largest, by what the parabola
        // has beyond it; or, where that tells too little, by the last correction.
        let ends = [a, b, c].map(|(place, key, _)| (place, key));
        let error = beyond_the_middle(ends).max(last);
        let special = Some(Special { kind: SpecialKind::Fold, second: 0.0, error });
        match best {
            Some(found) => self.point(found, special).map(Some),
            None => Ok(Some(BranchPoint { special, ..middle.clone() })),
        }
    }

    /// The cycle between two at which what `of` says changes, by bisection.
    fn event(
        &mut self,
        [here, there]: [&BranchPoint; 2],
        (kind, of): (SpecialKind, Happens),
        tolerance: f64,
    ) -> Result<BranchPoint> {
        let (mut low, mut high) = ((0.0, here.key), (1.0, there.key));
        let begins = of(&here.cycle);
        let mut best: Option<CorrectorResult> = None;
        for _ in 0..BISECTIONS {
            if (high.1 - low.1).abs() < tolerance && high.0 - low.0 < 1e-3 {
                break;
            }
            let part = 0.5 * (low.0 + high.0);
            let found = match self.on_chord(&here.u, &there.u, part) {
                Ok(found) => found,
                Err(Error::NotConverged(_)) => break,
                Err(e) => return Err(e),
            };
            let now = (part, self.equations.key_of(&found.u));
            match of(&found.cycle) == begins {
                true => low = now,
                false => high = now,
            }
            best = Some(found);
        }
        let special = Some(Special { kind, second: 0.0, error: (high.1 - low.1).abs() });
        match best {
            Some(found) => self.point(found, special),
            None => Ok(BranchPoint { special, ..there.clone() }),
        }
    }

    /// The cycle between two at which a multiplier passes the unit circle.
    fn passage(&mut self, here: &BranchPoint, there: &BranchPoint, tolerance: f64) -> Result<Option<BranchPoint>> {
        let [a, b] = [&here.multipliers, &there.multipliers];
        let (Some(a), Some(b)) = (a, b) else { return Ok(None) };
        let count = a.unstable().min(b.unstable());
        // The first of those that are not outside on both sides.
        let growth = |m: &Multipliers| m.values.get(unlike(m, count)).map_or(-1.0, |v| v.norm().ln());
        // One that is outside by less than its error counts as inside: the passage is looked for above it.
        let within = growth(a).min(growth(b));
        let zero = if within > 0.0 { 0.5 * (growth(a) + growth(b)) } else { 0.0 };
        let level = |m: &Multipliers| growth(m) - zero;
        let mut tried = vec![(0.0, level(a)), (1.0, level(b))];
        let (mut low, mut high) = (0.0, 1.0);
        let begins = level(a) < 0.0;
        let critical = |m: &Multipliers| m.values.get(unlike(m, count)).copied().unwrap_or_default();
        let kind = |m: &Multipliers| match (critical(m).im.abs() > 1e-9, critical(m).re > 0.0) {
            (true, _) => SpecialKind::Torus,
            (false, true) => SpecialKind::Crossing,
            (false, false) => SpecialKind::Flip,
        };
        let mut best = (if level(a).abs() < level(b).abs() { here } else { there }).clone();
        // Way that is left to the passage, of that between both.
        let mut left = 1.0;
        for round in 0..ROUNDS {
            let part = match zero_of(&tried, [low, high]) {
                Some(part) if round % 4 < 3 => part,
                _ => 0.5 * (low + high),
            };
            let found = match self.on_chord(&here.u, &there.u, part) {
                Ok(found) => found,
                Err(Error::NotConverged(_)) => break,
                Err(e) => return Err(e),
            };
            let point = self.point(found, None)?;
            let Some(m) = &point.multipliers else { break };
            // Nearer than this multipliers do not tell.
            let known = level(m).abs() <= m.error();
            tried.push((part, level(m)));
            match (level(m) < 0.0) == begins {
                true => low = part,
                false => high = part,
            }
            // The next place is where the zero lies but for what this one tells beside those before it.
            let apart = zero_of(&tried, [low, high]).map_or(high - low, |next| (next - part).abs());
            left = apart.max(blind(&tried, m.error())).min(1.0);
            best = point;
            if known || (apart * (there.key - here.key).abs() < tolerance && apart < 1e-3) {
                break;
            }
        }
        // At a fold that has not shown yet the key goes beyond both.
        let beyond = |p: &BranchPoint| (p.key - here.key) * (there.key - p.key) <= 0.0;
        let Some(kind) = best.multipliers.as_ref().map(kind) else { return Ok(None) };
        let turn = best.multipliers.as_ref().map_or(0.0, |m| critical(m).arg());
        let second = match kind {
            SpecialKind::Torus => turn * best.cycle.frequency / (2.0 * std::f64::consts::PI),
            _ => 0.0,
        };
        let error = left * (there.key - here.key).abs();
        let folds = kind == SpecialKind::Crossing && beyond(&best);
        Ok((!folds).then_some(BranchPoint { special: Some(Special { kind, second, error }), ..best }))
    }
}

/// The way about a zero, of that between both ends, in which a function that is known up to `error` does not tell its
/// sign: by its slope between the last two places where it was looked at.
fn blind(tried: &[(f64, f64)], error: f64) -> f64 {
    match tried {
        [.., a, b] if a.1 != b.1 => (error * (b.0 - a.0) / (b.1 - a.1)).abs(),
        _ => 1.0,
    }
}

/// How far the parabola through three points, places and values, the middle one the largest, goes beyond that one: at
/// most by the difference to the smallest.
fn beyond_the_middle([a, b, c]: [(f64, f64); 3]) -> f64 {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (c.0 - a.0);
    let slope = left + bend * (b.0 - a.0);
    let most = (b.1 - a.1.min(c.1)).abs();
    match 0.25 * slope * slope / -bend {
        beyond if beyond.is_finite() && beyond >= 0.0 => beyond.min(most),
        _ => most,
    }
}

/// The zero of a function by its values at the last places where it was looked at, which lies between `ends`: by the
/// inverse parabola through three of them (R. P. Brent, Algorithms for Minimization without Derivatives, 1973), or the
/// line through two.
fn zero_of(tried: &[(f64, f64)], [low, high]: [f64; 2]) -> Option<f64> {
    let line = |a: (f64, f64), b: (f64, f64)| b.0 - b.1 * (b.0 - a.0) / (b.1 - a.1);
    let inside = |x: &f64| *x > low && *x < high;
    let parabola = match tried {
        [.., a, b, c] => {
            let of = |p: &(f64, f64), q: &(f64, f64), r: &(f64, f64)| p.0 * q.1 * r.1 / ((p.1 - q.1) * (p.1 - r.1));
            Some(of(a, b, c) + of(b, a, c) + of(c, a, b))
        }
        _ => None,
    };
    let secant = match tried {
        [.., a, b] => Some(line(*a, *b)),
        _ => None,
    };
    parabola.filter(inside).or(secant.filter(inside))
}

/// The place of the first multiplier after those that count `count`, both of a pair counted.
fn unlike(m: &Multipliers, count: usize) -> usize {
    let mut sum = 0;
    for (k, v) in m.values.iter().enumerate() {
        if sum >= count {
            return k;
        }
        sum += if v.im.abs() > 0.0 { 2 } else { 1 };
    }
    m.values.len()
}

#[cfg(test)]
mod tests {
    use super::zero_of;

    #[test]
    fn zero_is_found_in_a_few_looks() {
        let f = |x: f64| (2.0 * x).exp() - 1.9;
        let mut tried = vec![(0.0, f(0.0)), (1.0, f(1.0))];
        for _ in 0..6 {
            let x = zero_of(&tried, [0.0, 1.0]).unwrap();
            tried.push((x, f(x)));
        }
        assert!((tried[7].0 - 0.5 * 1.9f64.ln()).abs() < 1e-9, "{tried:?}");
        // Outside of the bracket there is none.
        assert_eq!(zero_of(&[(0.0, 1.0), (1.0, 2.0)], [0.0, 1.0]), None);
    }
}
