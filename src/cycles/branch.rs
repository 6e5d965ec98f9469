//! Branches of cycles over a key: pseudo-arclength continuation (H. B. Keller, in: Applications of Bifurcation Theory,
//! 1977; E. L. Allgower, K. Georg, Numerical Continuation Methods, 1990), with the stability of each cycle.

pub use super::corrector::Family;
use super::corrector::{norm, update, Condition, Corrected, Equations};
use super::floquet::{multipliers, Multipliers};
use super::PeriodicSolution;
use crate::{Error, Result};
use faer::Mat;

/// Settings of a branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BranchExtent {
    /// Least and largest value of the key.
    pub range: [f64; 2],
    /// Cycles in each direction, at the most.
    pub most: usize,
    /// Longest step, in units of motion, frequency and key together.
    pub longest: f64,
    /// Key by which special points are located, of the length of the range.
    pub located: f64,
    /// True if multipliers are computed.
    pub stability: bool,
}

/// A cycle of a branch.
#[derive(Debug, Clone, PartialEq)]
pub struct BranchPoint {
    /// Value of the key.
    pub key: f64,
    /// Unknowns, see [`Equations`].
    pub u: Vec<f64>,
    /// The cycle.
    pub cycle: PeriodicSolution,
    /// Its multipliers, where they were computed.
    pub multipliers: Option<Multipliers>,
    /// Kind of special point; none of an ordinary cycle.
    pub special: Option<Special>,
}

/// A special point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Special {
    /// Its kind.
    pub kind: SpecialKind,
    /// Second frequency of a torus point, Hz; 0 otherwise.
    pub second: f64,
}

/// Kinds of special points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpecialKind {
    /// The branch turns back in the key.
    Fold,
    /// A multiplier leaves the unit circle at −1: a cycle of twice the period is born.
    Flip,
    /// A pair of multipliers leaves the unit circle: two waves beat.
    Torus,
    /// A multiplier passes +1 where the branch does not turn.
    Crossing,
    /// On one side no node sticks at any time of the period.
    Stick,
    /// On one side no node opens in the period.
    Opening,
}

impl SpecialKind {
    /// As in tables and sentences.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fold => "fold",
            Self::Flip => "flip",
            Self::Torus => "torus",
            Self::Crossing => "crossing",
            Self::Stick => "first stick",
            Self::Opening => "first opening",
        }
    }
}

/// Why a branch ends.
#[derive(Debug, Clone, PartialEq)]
pub enum BranchEnd {
    /// At the end of the range of the key.
    Range,
    /// The motion has become as small as nothing: rest.
    Rest,
    /// All cycles that were asked for.
    Count,
    /// On request.
    Stopped,
    /// The model does not hold beyond, for this reason.
    Model(String),
    /// Newton's method finds no further cycle, for this reason.
    Lost(String),
}

impl BranchEnd {
    /// In a few words.
    pub fn text(&self) -> String {
        match self {
            Self::Range => "at the end of the range".into(),
            Self::Rest => "at rest".into(),
            Self::Count => "after as many cycles as were asked for".into(),
            Self::Stopped => "on request".into(),
            Self::Model(why) => format!("where the model ends: {why}"),
            Self::Lost(why) => format!("where no further cycle is found: {why}"),
        }
    }
}

/// Cycles one after the other in one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// The cycles, that of the start first.
    pub points: Vec<BranchPoint>,
    /// Why it ends.
    pub end: BranchEnd,
}

/// First step, of the longest one.
const FIRST: f64 = 0.2;
/// Shortest step, of the longest one.
const SHORTEST: f64 = 1e-3;
/// Iterations below which steps become longer, and above which they become shorter.
const ITERATIONS: [usize; 2] = [5, 9];
/// Cosine of the angle between tangent and chord of a step below which steps become shorter.
const BEND: f64 = 0.97;
/// Motion, in units, that counts as rest.
const REST: f64 = 0.02;
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
    (SpecialKind::Stick, |cycle| cycle.nodes.iter().any(|n| n[1] > 0)),
    (SpecialKind::Opening, |cycle| cycle.nodes.iter().any(|n| n[0] != cycle.nodes[0][0])),
];

/// The cycle at the key of `u`, from which branches begin.
pub fn solve(equations: &mut Equations<'_, '_>, u: Vec<f64>, jacobian: &mut Option<Mat<f64>>) -> Result<Corrected> {
    let mut row = vec![0.0; u.len()];
    row[u.len() - 1] = 1.0;
    let conditions = [equations.phase(&u), Condition { row, reference: u.clone() }];
    equations.correct(u, &conditions, jacobian)
}

/// Follows a branch from the cycle `start` with the Jacobian `jacobian`, towards larger keys where `up`. `step` is
/// called after each cycle and says whether to go on.
pub fn follow(
    equations: &mut Equations<'_, '_>,
    start: &BranchPoint,
    jacobian: &Mat<f64>,
    up: bool,
    extent: &BranchExtent,
    step: &mut dyn FnMut(&BranchPoint) -> Result<bool>,
) -> Result<Branch> {
    let mut walk = Walk { equations, extent, jacobian: Some(jacobian.clone()) };
    walk.equations.memory = start.cycle.begin.clone();
    let mut points = vec![start.clone()];
    let end = walk.all(&mut points, up, step)?;
    Ok(Branch { points, end })
}

struct Walk<'w, 'e, 'a> {
    equations: &'w mut Equations<'e, 'a>,
    extent: &'w BranchExtent,
    jacobian: Option<Mat<f64>>,
}

impl Walk<'_, '_, '_> {
    fn all(
        &mut self,
        points: &mut Vec<BranchPoint>,
        up: bool,
        step: &mut dyn FnMut(&BranchPoint) -> Result<bool>,
    ) -> Result<BranchEnd> {
        let last = |points: &[BranchPoint]| points[points.len() - 1].clone();
        let n = last(points).u.len();
        let mut ahead = vec![0.0; n];
        ahead[n - 1] = if up { 1.0 } else { -1.0 };
        let mut length = FIRST * self.extent.longest;
        while points.len() <= self.extent.most {
            let here = last(points);
            let mut renewed = false;
            let (found, tangent) = loop {
                let found =
                    self.ahead(&here, &ahead).and_then(|tangent| Ok((self.reach(&here, &tangent, length)?, tangent)));
                match found {
                    Ok(found) => break found,
                    Err(e) if matches!(e, Error::Defect(_) | Error::Io(_)) => return Err(e),
                    Err(e) => {
                        length *= 0.4;
                        if length < SHORTEST * self.extent.longest {
                            return Ok(match e {
                                Error::NotConverged(_) => BranchEnd::Lost(e.to_string()),
                                _ => BranchEnd::Model(e.to_string()),
                            });
                        }
                        // That of a cycle further back may have led astray.
                        if !std::mem::replace(&mut renewed, true) {
                            let lack = self.equations.march(&here.u)?.lack;
                            self.jacobian = Some(self.equations.jacobian(&here.u, &lack)?);
                        }
                    }
                }
            };
            let iterations = found.iterations;
            let mut key = self.equations.key_of(&found.u);
            let [low, high] = self.extent.range;
            let mut end = None;
            let mut point = if key < low || key > high {
                key = key.clamp(low, high);
                end = Some(BranchEnd::Range);
                match self.at_key(&here, &found, key) {
                    Ok(found) => self.point(found, None)?,
                    Err(e) => return Ok(BranchEnd::Lost(e.to_string())),
                }
            } else {
                self.point(found, None)?
            };
            // Through rest the branch comes back, half a period later.
            let r = self.equations.structure.rank();
            let along = |u: &[f64], v: &[f64]| u[r..n - 2].iter().zip(&v[r..n - 2]).map(|(a, b)| a * b).sum::<f64>();
            if self.equations.amplitude(&point.u) < REST || along(&point.u, &here.u) < 0.0 {
                return Ok(BranchEnd::Rest);
            }
            let chord: Vec<f64> = point.u.iter().zip(&here.u).map(|(a, b)| a - b).collect();
            for special in self.between(points, &here, &point)? {
                points.push(special);
                if !step(&last(points))? {
                    return Ok(BranchEnd::Stopped);
                }
            }
            ahead = chord.iter().map(|c| c / norm(&chord).max(f64::MIN_POSITIVE)).collect();
            point.special = None;
            points.push(point);
            if !step(&last(points))? {
                return Ok(BranchEnd::Stopped);
            }
            if let Some(end) = end {
                return Ok(end);
            }
            let straight = tangent.iter().zip(&ahead).map(|(t, c)| t * c).sum::<f64>();
            if straight < BEND {
                length *= 0.5;
            } else if iterations <= ITERATIONS[0] {
                length = (1.5 * length).min(self.extent.longest);
            } else if iterations >= ITERATIONS[1] {
                length *= 0.6;
            }
        }
        Ok(BranchEnd::Count)
    }

    /// The tangent at `here`, on the side of `before`.
    fn ahead(&self, here: &BranchPoint, before: &[f64]) -> Result<Vec<f64>> {
        let Some(j) = &self.jacobian else { return Err(Error::Defect("limit cycles: no Jacobian".into())) };
        self.equations.tangent(j, &self.equations.phase(&here.u), before)
    }

    /// The cycle a step of the length `length` ahead of `here`.
    fn reach(&mut self, here: &BranchPoint, tangent: &[f64], length: f64) -> Result<Corrected> {
        let guess: Vec<f64> = here.u.iter().zip(tangent).map(|(u, t)| u + length * t).collect();
        let kept = (self.jacobian.clone(), self.equations.memory.clone());
        let conditions = [self.equations.phase(&here.u), Condition { row: tangent.to_vec(), reference: guess.clone() }];
        let found = self.equations.correct(guess, &conditions, &mut self.jacobian);
        // A step that leads somewhere else is none.
        let found = found.and_then(|found| {
            let moved: Vec<f64> = found.u.iter().zip(&here.u).map(|(a, b)| a - b).collect();
            match norm(&moved) <= 3.0 * length {
                true => Ok((found, moved)),
                false => Err(Error::NotConverged("limit cycles: a step along the branch leads away from it".into())),
            }
        });
        let (found, moved) = match found {
            Ok(found) => found,
            Err(e) => {
                (self.jacobian, self.equations.memory) = kept;
                return Err(e);
            }
        };
        // The equations hold at both ends.
        if let Some(j) = &mut self.jacobian {
            let zeros = vec![0.0; j.nrows()];
            update(j, &moved, &zeros, &zeros);
        }
        Ok(found)
    }

    /// The cycle at the key `key` between `here` and `there`.
    fn at_key(&mut self, here: &BranchPoint, there: &Corrected, key: f64) -> Result<Corrected> {
        let n = here.u.len();
        let [a, b] = [here.key, self.equations.key_of(&there.u)];
        let part = if b == a { 0.0 } else { (key - a) / (b - a) };
        let mut u: Vec<f64> = here.u.iter().zip(&there.u).map(|(a, b)| a + part * (b - a)).collect();
        u[n - 1] = (key - self.equations.key[0]) / self.equations.key[1];
        solve(self.equations, u, &mut self.jacobian)
    }

    /// The cycle on the plane that divides the chord between `a` and `b` at `part`.
    fn on_chord(&mut self, a: &[f64], b: &[f64], part: f64) -> Result<Corrected> {
        let chord: Vec<f64> = b.iter().zip(a).map(|(b, a)| b - a).collect();
        let guess: Vec<f64> = a.iter().zip(&chord).map(|(a, c)| a + part * c).collect();
        let length = norm(&chord);
        let row: Vec<f64> = chord.iter().map(|c| c / length).collect();
        let conditions = [self.equations.phase(&guess), Condition { row, reference: guess.clone() }];
        self.equations.correct(guess, &conditions, &mut self.jacobian)
    }

    /// A point with its multipliers.
    fn point(&mut self, found: Corrected, special: Option<Special>) -> Result<BranchPoint> {
        let key = self.equations.key_of(&found.u);
        let multipliers = match self.extent.stability {
            true => {
                let conditions = self.equations.family.at(key)?;
                let samples = self.equations.resolution.samples;
                Some(multipliers(self.equations.structure, &conditions, &found.cycle, samples)?)
            }
            false => None,
        };
        Ok(BranchPoint { key, u: found.u, cycle: found.cycle, multipliers, special })
    }

    /// Special points between the last points of a branch, `here`, and the next one.
    fn between(&mut self, points: &[BranchPoint], here: &BranchPoint, there: &BranchPoint) -> Result<Vec<BranchPoint>> {
        let mut found: Vec<BranchPoint> = Vec::new();
        let ordinary: Vec<&BranchPoint> = points.iter().filter(|p| p.special.is_none()).collect();
        let before = ordinary.len().checked_sub(2).map(|k| ordinary[k]);
        let before = before.filter(|b| (here.key - b.key) * (there.key - here.key) < 0.0);
        if let Some(before) = before {
            found.extend(self.fold(before, here, there)?);
        }
        for (kind, of) in EVENTS {
            if of(&here.cycle) != of(&there.cycle) {
                found.push(self.event(here, there, kind, of)?);
            }
        }
        if let (Some(a), Some(b)) = (&here.multipliers, &there.multipliers) {
            let folds = before.is_some();
            let change = a.unstable().abs_diff(b.unstable());
            // At a fold one multiplier passes through +1 anyway.
            if change > usize::from(folds) || (change == 1 && !folds) {
                found.extend(self.passage(here, there)?);
            }
        }
        Ok(found)
    }

    /// The fold near `middle`, where the key is largest or smallest: parabolas through three cycles, and the golden
    /// section where they lead nowhere.
    fn fold(&mut self, before: &BranchPoint, middle: &BranchPoint, after: &BranchPoint) -> Result<Option<BranchPoint>> {
        let tolerance = self.extent.located * (self.extent.range[1] - self.extent.range[0]);
        let chord: Vec<f64> = after.u.iter().zip(&before.u).map(|(a, b)| a - b).collect();
        let length = norm(&chord);
        let row: Vec<f64> = chord.iter().map(|c| c / length).collect();
        let place = |u: &[f64]| u.iter().zip(&before.u).zip(&row).map(|((u, a), r)| (u - a) * r).sum::<f64>() / length;
        let sign = if middle.key > before.key { 1.0 } else { -1.0 };
        let known = |p: &BranchPoint| (place(&p.u), sign * p.key, p.u.clone());
        let [mut a, mut b, mut c] = [known(before), known(middle), known(after)];
        let mut best: Option<Corrected> = None;
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
            let there = match self.equations.correct(guess, &conditions, &mut self.jacobian) {
                Ok(there) => there,
                Err(Error::NotConverged(_)) => break,
                Err(e) => return Err(e),
            };
            let now = (next, sign * self.equations.key_of(&there.u), there.u.clone());
            let gain = (now.1 - b.1).abs();
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
        let special = Some(Special { kind: SpecialKind::Fold, second: 0.0 });
        match best {
            Some(found) => self.point(found, special).map(Some),
            None => Ok(Some(BranchPoint { special, ..middle.clone() })),
        }
    }

    /// The cycle between two at which what `of` says changes, by bisection.
    fn event(
        &mut self,
        here: &BranchPoint,
        there: &BranchPoint,
        kind: SpecialKind,
        of: Happens,
    ) -> Result<BranchPoint> {
        let tolerance = self.extent.located * (self.extent.range[1] - self.extent.range[0]);
        let (mut low, mut high) = ((0.0, here.key), (1.0, there.key));
        let begins = of(&here.cycle);
        let mut best: Option<Corrected> = None;
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
        let special = Some(Special { kind, second: 0.0 });
        match best {
            Some(found) => self.point(found, special),
            None => Ok(BranchPoint { special, ..there.clone() }),
        }
    }

    /// The cycle between two at which a multiplier passes the unit circle.
    fn passage(&mut self, here: &BranchPoint, there: &BranchPoint) -> Result<Option<BranchPoint>> {
        let tolerance = self.extent.located * (self.extent.range[1] - self.extent.range[0]);
        let [a, b] = [&here.multipliers, &there.multipliers];
        let (Some(a), Some(b)) = (a, b) else { return Ok(None) };
        let count = a.unstable().min(b.unstable());
        // The first of those that are not outside on both sides.
        let growth = |m: &Multipliers| m.values.get(unlike(m, count)).map_or(-1.0, |v| v.norm().ln());
        // One that is outside by less than its error counts as inside: the passage is looked for above it.
        let within = growth(a).min(growth(b));
        let zero = if within > 0.0 { 0.5 * (growth(a) + growth(b)) } else { 0.0 };
        let level = |m: &Multipliers| growth(m) - zero;
        let (mut low, mut high) = ((0.0, level(a), here.key), (1.0, level(b), there.key));
        let mut best: Option<BranchPoint> = None;
        for round in 0..ROUNDS {
            let secant = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
            let inside = secant > low.0 && secant < high.0 && round % 3 < 2;
            let part = if inside { secant } else { 0.5 * (low.0 + high.0) };
            let found = match self.on_chord(&here.u, &there.u, part) {
                Ok(found) => found,
                Err(Error::NotConverged(_)) => break,
                Err(e) => return Err(e),
            };
            let point = self.point(found, None)?;
            let Some(m) = &point.multipliers else { return Ok(None) };
            let now = (part, level(m), point.key);
            let apart = (point.key - low.2).abs().min((point.key - high.2).abs());
            match (now.1 < 0.0) == (low.1 < 0.0) {
                true => low = now,
                false => high = now,
            }
            let critical = m.values.get(unlike(m, count)).copied().unwrap_or_default();
            let kind = match (critical.im.abs() > 1e-9, critical.re > 0.0) {
                (true, _) => SpecialKind::Torus,
                (false, true) => SpecialKind::Crossing,
                (false, false) => SpecialKind::Flip,
            };
            let second = match kind {
                SpecialKind::Torus => critical.arg() * point.cycle.frequency / (2.0 * std::f64::consts::PI),
                _ => 0.0,
            };
            best = Some(BranchPoint { special: Some(Special { kind, second }), ..point });
            if apart < tolerance {
                break;
            }
        }
        // At a fold that has not shown yet the key goes beyond both.
        let beyond = |p: &BranchPoint| (p.key - here.key) * (there.key - p.key) <= 0.0;
        let folds = |p: &BranchPoint| p.special.is_some_and(|s| s.kind == SpecialKind::Crossing) && beyond(p);
        Ok(best.filter(|p| !folds(p)))
    }
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
