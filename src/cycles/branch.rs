//! Branches of cycles over a key: pseudo-arclength continuation (H. B. Keller, in: Applications of Bifurcation Theory,
//! 1977; E. L. Allgower, K. Georg, Numerical Continuation Methods, 1990), with the stability of each cycle.

use super::contact_jacobian::ContactJacobian;
pub use super::corrector::Family;
use super::corrector::{norm, Condition, CorrectorResult, Equations};
use super::floquet::{multipliers, Multipliers};
use super::{ContactMemory, PeriodicSolution};
use crate::{Error, Result};

/// Settings of a branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BranchExtent {
    /// Least and largest value of the key.
    pub range: [f64; 2],
    /// Cycles in each direction, at the most.
    pub most: usize,
    /// Longest step, in units of motion, frequency and key together.
    pub longest: f64,
    /// Key by which special points are located, of the length of the range; none where they are not looked for.
    pub located: Option<f64>,
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
    /// Error of its location, in the unit of the key.
    pub error: f64,
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
    /// All of them.
    pub(super) const ALL: [Self; 6] = [Self::Fold, Self::Flip, Self::Torus, Self::Crossing, Self::Stick, Self::Opening];

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
            Self::Model(why) => format!("where the model ends: {why}"),
            Self::Lost(why) => format!("where no further cycle is found: {why}"),
        }
    }
}

/// First step, of the longest one.
const FIRST: f64 = 0.2;
/// Shortest step, of the longest one.
const SHORTEST: f64 = 1e-3;
/// Steps that fail before derivatives are made anew.
const PATIENCE: usize = 2;
/// Iterations below which steps become longer, and above which they become shorter.
const ITERATIONS: [usize; 2] = [5, 9];
/// Cosine of the angle between tangent and chord of a step below which steps become shorter.
const BEND: f64 = 0.97;
/// Way to the next cycle, of the step, beyond which it lies elsewhere.
const ASTRAY: f64 = 3.0;
/// Motion, in units, that counts as rest.
const REST: f64 = 0.02;
/// The cycle at the key of `u`, from which branches begin.
pub fn solve(
    equations: &mut Equations<'_, '_>,
    u: Vec<f64>,
    contact: &mut Option<ContactJacobian>,
) -> Result<CorrectorResult> {
    let mut row = vec![0.0; u.len()];
    row[u.len() - 1] = 1.0;
    let conditions = [equations.phase(&u), Condition { row, reference: u.clone() }];
    equations.correct(u, &conditions, contact)
}

/// A branch in one direction, as far as it was followed: everything that its next cycle depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct BranchState {
    /// The cycles, that of the start first.
    pub points: Vec<BranchPoint>,
    /// Why it ends; none where it goes on.
    pub end: Option<BranchEnd>,
    /// Direction of the last step, `[size + 2]`.
    pub(super) ahead: Vec<f64>,
    /// Length of the next step.
    pub(super) length: f64,
    /// Contact forces near the last cycle.
    pub(super) contact: Option<ContactJacobian>,
    /// The contact that the next march begins with.
    pub(super) memory: ContactMemory,
    /// Marches made for it.
    pub marches: usize,
    /// Why multipliers of a cycle were not found, of the first such cycle; none where all were.
    pub unknown: Option<String>,
}

impl BranchState {
    /// The branch from `start` with the contact forces `contact` near it, towards larger keys where `up`.
    pub fn new(start: BranchPoint, contact: ContactJacobian, up: bool, extent: &BranchExtent) -> Self {
        let mut ahead = vec![0.0; start.u.len()];
        if let Some(last) = ahead.last_mut() {
            *last = if up { 1.0 } else { -1.0 };
        }
        let memory = start.cycle.begin.clone();
        let length = FIRST * extent.longest;
        let contact = Some(contact);
        Self { points: vec![start], end: None, ahead, length, contact, memory, marches: 0, unknown: None }
    }

    /// The same towards the other side; its marches are counted with the other one.
    pub fn turned(mut self) -> Self {
        self.ahead.iter_mut().for_each(|a| *a = -*a);
        self.marches = 0;
        self
    }

    /// The same in the direction `ahead` of the unknowns, `[size + 2]`.
    pub fn towards(mut self, ahead: Vec<f64>) -> Self {
        self.ahead = ahead;
        self
    }

    /// True if it begins in the direction of the key, so that there is another side to it.
    pub fn is_two_way(&self) -> bool {
        self.ahead.last().is_some_and(|a| *a != 0.0)
    }

    /// The contact that the next march begins with.
    pub fn memory(&self) -> &ContactMemory {
        &self.memory
    }
}

/// The cycle near `u` that meets the condition `held` in the place of a given key.
pub fn solve_under(
    equations: &mut Equations<'_, '_>,
    u: Vec<f64>,
    held: Condition,
    contact: &mut Option<ContactJacobian>,
) -> Result<CorrectorResult> {
    let conditions = [equations.phase(&u), held];
    equations.correct(u, &conditions, contact)
}

/// Follows the branch `state` to its end. `step` is called after each cycle, with its special points, and says whether
/// to go on; a branch that was not to go on has no end, and goes on from its state as if it had not been stopped.
pub fn follow(
    equations: &mut Equations<'_, '_>,
    state: &mut BranchState,
    extent: &BranchExtent,
    step: &mut dyn FnMut(&BranchState) -> Result<bool>,
) -> Result<()> {
    if state.end == Some(BranchEnd::Count) && state.points.len() <= extent.most {
        state.end = None;
    }
    equations.memory = state.memory.clone();
    while state.end.is_none() {
        let before = equations.marches;
        let mut walk = BranchWalk { equations, extent, contact: state.contact.take(), unknown: state.unknown.take() };
        let end = walk.one(state);
        (state.contact, state.unknown) = (walk.contact.take(), walk.unknown.take());
        state.end = match end {
            Err(e @ Error::NotConverged(_)) => Some(BranchEnd::Lost(e.to_string())),
            Err(e @ (Error::Job(_) | Error::Input(_))) => Some(BranchEnd::Model(e.to_string())),
            other => other?,
        };
        state.memory = equations.memory.clone();
        state.marches += equations.marches - before;
        if !step(state)? {
            return Ok(());
        }
    }
    Ok(())
}

pub(super) struct BranchWalk<'w, 'e, 'a> {
    pub(super) equations: &'w mut Equations<'e, 'a>,
    pub(super) extent: &'w BranchExtent,
    pub(super) contact: Option<ContactJacobian>,
    /// As that of [`BranchState`].
    pub(super) unknown: Option<String>,
}

impl BranchWalk<'_, '_, '_> {
    /// The next cycle of a branch, with the special points before it; why the branch ends, where it does.
    fn one(&mut self, state: &mut BranchState) -> Result<Option<BranchEnd>> {
        let Some(here) = state.points.last().cloned() else {
            return Err(Error::Defect("limit cycles: a branch without start".into()));
        };
        if state.points.len() > self.extent.most {
            return Ok(Some(BranchEnd::Count));
        }
        let n = here.u.len();
        let mut failed = 0;
        let (found, tangent) = loop {
            let length = state.length;
            // Where a node changes its status a short step may begin far from its end: then Newton's method decides.
            let longest = if failed < PATIENCE { ASTRAY * length } else { f64::INFINITY };
            let found = self
                .ahead(&here, &state.ahead)
                .and_then(|tangent| Ok((self.reach(&here, &tangent, [length, longest])?, tangent)));
            match found {
                Ok(found) => break found,
                Err(e) if matches!(e, Error::Defect(_) | Error::Io(_)) => return Err(e),
                Err(e) => {
                    state.length *= 0.4;
                    if state.length < SHORTEST * self.extent.longest {
                        return Ok(Some(match e {
                            Error::NotConverged(_) => BranchEnd::Lost(e.to_string()),
                            _ => BranchEnd::Model(e.to_string()),
                        }));
                    }
                    // Those of a cycle further back may have led astray.
                    failed += 1;
                    if failed == PATIENCE {
                        self.contact = Some(self.equations.derivatives(&here.u)?);
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
                Err(e) => return Ok(Some(BranchEnd::Lost(e.to_string()))),
            }
        } else {
            self.point(found, None)?
        };
        // Through rest the branch comes back, half a period later.
        let r = self.equations.structure.rank();
        let along = |u: &[f64], v: &[f64]| u[r..n - 2].iter().zip(&v[r..n - 2]).map(|(a, b)| a * b).sum::<f64>();
        if self.equations.amplitude(&point.u) < REST || along(&point.u, &here.u) < 0.0 {
            return Ok(Some(BranchEnd::Rest));
        }
        let chord = self.equations.counted(point.u.iter().zip(&here.u).map(|(a, b)| a - b).collect());
        if let Some(located) = self.extent.located {
            let tolerance = located * (high - low);
            let special = self.between(&state.points, &here, &point, tolerance)?;
            state.points.extend(special);
        }
        state.ahead = chord.iter().map(|c| c / norm(&chord).max(f64::MIN_POSITIVE)).collect();
        point.special = None;
        state.points.push(point);
        if end.is_some() {
            return Ok(end);
        }
        let straight = tangent.iter().zip(&state.ahead).map(|(t, c)| t * c).sum::<f64>();
        if straight < BEND {
            state.length *= 0.5;
        } else if iterations <= ITERATIONS[0] {
            state.length = (1.5 * state.length).min(self.extent.longest);
        } else if iterations >= ITERATIONS[1] {
            state.length *= 0.6;
        }
        Ok((state.points.len() > self.extent.most).then_some(BranchEnd::Count))
    }

    /// The tangent at `here`, on the side of `before`.
    fn ahead(&self, here: &BranchPoint, before: &[f64]) -> Result<Vec<f64>> {
        let Some(contact) = &self.contact else { return Err(Error::Defect("limit cycles: no Jacobian".into())) };
        self.equations.tangent(contact, &here.u, before)
    }

    /// The cycle a step of the length `length` ahead of `here`, whose first correction is not longer than `longest`.
    fn reach(&mut self, here: &BranchPoint, tangent: &[f64], [length, longest]: [f64; 2]) -> Result<CorrectorResult> {
        let guess: Vec<f64> = here.u.iter().zip(tangent).map(|(u, t)| u + length * t).collect();
        let kept = (self.contact.clone(), self.equations.memory.clone());
        let row = self.equations.counted(tangent.to_vec());
        let conditions = [self.equations.phase(&here.u), Condition { row, reference: guess.clone() }];
        let found = self.equations.correct_within(guess, &conditions, &mut self.contact, longest);
        // A step that leads somewhere else is none.
        let found = found.and_then(|found| {
            let moved = self.equations.counted(found.u.iter().zip(&here.u).map(|(a, b)| a - b).collect());
            match norm(&moved) <= ASTRAY * length {
                true => Ok(found),
                false => Err(Error::NotConverged("limit cycles: a step along the branch leads away from it".into())),
            }
        });
        if found.is_err() {
            (self.contact, self.equations.memory) = kept;
        } else if let (Some(before), Some(now)) = (kept.0, &mut self.contact) {
            // The forces are known at both ends.
            let moved: Vec<f64> = now.u.iter().zip(&before.u).map(|(a, b)| a - b).collect();
            let force = now.force.clone();
            now.update(&moved, &before.force, &force);
        }
        found
    }

    /// The cycle at the key `key` between `here` and `there`.
    fn at_key(&mut self, here: &BranchPoint, there: &CorrectorResult, key: f64) -> Result<CorrectorResult> {
        let n = here.u.len();
        let [a, b] = [here.key, self.equations.key_of(&there.u)];
        let part = if b == a { 0.0 } else { (key - a) / (b - a) };
        let mut u: Vec<f64> = here.u.iter().zip(&there.u).map(|(a, b)| a + part * (b - a)).collect();
        u[n - 1] = (key - self.equations.key[0]) / self.equations.key[1];
        solve(self.equations, u, &mut self.contact)
    }

    /// The cycle on the plane that divides the chord between `a` and `b` at `part`.
    pub(super) fn on_chord(&mut self, a: &[f64], b: &[f64], part: f64) -> Result<CorrectorResult> {
        let chord: Vec<f64> = b.iter().zip(a).map(|(b, a)| b - a).collect();
        let guess: Vec<f64> = a.iter().zip(&chord).map(|(a, c)| a + part * c).collect();
        let counted = self.equations.counted(chord);
        let length = norm(&counted);
        let row: Vec<f64> = counted.iter().map(|c| c / length).collect();
        let conditions = [self.equations.phase(&guess), Condition { row, reference: guess.clone() }];
        self.equations.correct(guess, &conditions, &mut self.contact)
    }

    /// A point with its multipliers, or without them where they are not found: a cycle that was solved for stays one.
    pub(super) fn point(&mut self, found: CorrectorResult, special: Option<Special>) -> Result<BranchPoint> {
        let key = self.equations.key_of(&found.u);
        let multipliers = match self.extent.stability {
            true => match stability_of(self.equations, key, &found.cycle)? {
                Ok(found) => Some(found),
                Err(why) => {
                    self.unknown.get_or_insert(why);
                    None
                }
            },
            false => None,
        };
        Ok(BranchPoint { key, u: found.u, cycle: found.cycle, multipliers, special })
    }
}

/// The multipliers of `cycle`, a solution at the value `key`, or why they were not found.
pub fn stability_of(
    equations: &Equations<'_, '_>,
    key: f64,
    cycle: &PeriodicSolution,
) -> Result<std::result::Result<Multipliers, String>> {
    let conditions = equations.family.conditions(key)?;
    match multipliers(&*equations.structure_at(key)?, &conditions, cycle, equations.resolution) {
        Ok(found) => Ok(Ok(found)),
        Err(Error::NotConverged(why)) => Ok(Err(format!("at the key {key:.7}: {why}"))),
        Err(e) => Err(e),
    }
}
