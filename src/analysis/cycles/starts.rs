//! Cycles that branches begin with: that of an unstable mode, by its amplitude or marched, small ones at a threshold of
//! rest, a cycle of an earlier result, or the motion of a point of its sweep.

use super::follow::BranchFollower;
use super::search::{is_local, Search};
use crate::case::limit_cycle_point::{motion_modes, LimitCyclePoint};
use crate::case::transient_problem::scale;
use crate::cycles::branch::{solve, solve_under, stability_of};
use crate::cycles::corrector::{Condition, Equations};
use crate::cycles::{
    cycle_of_mode, BranchPoint, BranchState, ContactJacobian, ContactMemory, Family, GrowingMotion, Resolution,
};
use crate::job::{Contact, EarlierResult, StartsBy};
use crate::output::datasets::branches::{EarlierCycle, Onset};
use crate::output::datasets::cycle_motions;
use crate::output::Reader;
use crate::parallel::World;
use crate::transient::cycle::CycleMotion;
use crate::transient::{Scheme, Settings, State, Stepper};
use crate::{Error, Result};
use num_complex::Complex64;
use std::f64::consts::PI;

/// Periods that a marched cycle goes on in the steps of the equations before they take it over.
const PERIODS: usize = 8;
/// Amplitude of the first cycle at a threshold of rest, of that at which a node reaches the creep velocity.
const SMALL: f64 = 0.08;

/// Origin of a branch.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum BranchOrigin {
    /// The cycle that a motion reaches from an unstable mode of rest.
    Mode {
        /// Value of the key.
        key: f64,
        /// Rank of the mode by its growth rate.
        mode: usize,
        /// Growth rate, 1/s, and frequency, Hz.
        growth: [f64; 2],
    },
    /// Small cycles at a threshold of rest.
    Threshold(Onset),
    /// A cycle of an earlier result.
    Result(Box<EarlierCycle>),
    /// The motion of a point of a sweep of an earlier result.
    Swept {
        /// File, with the number of the point.
        place: String,
        /// Value of the key.
        key: f64,
        motion: CycleMotion,
    },
}

/// A start before it is solved for.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Candidate {
    pub(super) origin: BranchOrigin,
}

impl Candidate {
    /// In words.
    pub(super) fn text(&self, along: &str) -> String {
        match &self.origin {
            BranchOrigin::Mode { key, mode, growth: [rate, frequency] } => {
                format!("unstable mode {} at {along} = {key} ({frequency:.3} Hz, growth rate {rate:.3} 1/s)", mode + 1)
            }
            BranchOrigin::Threshold(onset) => {
                format!("threshold of rest at {along} = {:.7} ({:.3} Hz)", onset.key, onset.frequency)
            }
            BranchOrigin::Result(earlier) => format!("cycle {} of {}", earlier.place, earlier.file),
            BranchOrigin::Swept { place, .. } => place.clone(),
        }
    }
}

/// A start that was not solved.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FailedStart {
    pub(super) origin: String,
    pub(super) why: String,
}

/// A cycle that a branch begins with.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BranchStart {
    /// Number of its candidate.
    pub(super) number: usize,
    /// Units of the motion, m √kg, and of the angular frequency, rad/s; value of the key that counts from.
    pub(super) scale: [f64; 3],
    /// The branch, with this cycle alone.
    pub(super) state: BranchState,
}

impl BranchStart {
    /// The cycle.
    pub(super) fn point(&self) -> Result<&BranchPoint> {
        self.state.points.first().ok_or_else(|| Error::Defect("limit cycles: a start without cycle".into()))
    }

    /// All of it in a row.
    pub(super) fn numbers(&self) -> Result<Vec<f64>> {
        let point = self.point()?.numbers();
        let mut all = vec![self.number as f64];
        all.extend(self.scale);
        all.push(point.len() as f64);
        all.extend(point);
        all.extend(self.state.numbers());
        Ok(all)
    }

    /// From [`numbers`](Self::numbers); none where they are not those of a start.
    pub(super) fn from_numbers(all: &[f64]) -> Option<Self> {
        let (head, rest) = all.split_at_checked(5)?;
        let (point, state) = rest.split_at_checked(head[4] as usize)?;
        let point = BranchPoint::from_numbers(point)?;
        let state = BranchState::from_numbers(state, vec![point])?;
        Some(Self { number: head[0] as usize, scale: [head[1], head[2], head[3]], state })
    }
}

/// Collective: all starts of the job, the same on every rank: the unstable modes at each value of the key, the
/// thresholds of rest where they are asked for, cycles of earlier results.
pub(super) fn candidates(search: &Search<'_>, world: &World, onsets: &[Onset]) -> Result<Vec<Candidate>> {
    let wanted = &search.wanted.starts;
    let most = wanted.modes.map_or(usize::MAX, |n| n as usize);
    let modes = world.on_root(|| {
        let mut all = Vec::new();
        for key in search.values() {
            let growing = match search.growth(key) {
                Ok(found) => found.into_iter().filter(|g| g.1).map(|g| g.0).take(most).collect(),
                // Elsewhere the model may hold.
                Err(e) if is_local(&e) && !wanted.at.is_empty() => Vec::new(),
                Err(e) => return Err(e),
            };
            let row = |(mode, g): (usize, &[f64; 2])| [key, mode as f64, g[0], g[1]];
            all.extend(growing.iter().enumerate().flat_map(row));
        }
        Ok(all)
    })?;
    let modes = world.broadcast(modes.unwrap_or_default());
    let mode = |c: &[f64]| BranchOrigin::Mode { key: c[0], mode: c[1] as usize, growth: [c[2], c[3]] };
    let mut origins: Vec<BranchOrigin> = modes.chunks_exact(4).map(mode).collect();
    if wanted.thresholds {
        origins.extend(onsets.iter().copied().map(BranchOrigin::Threshold));
    }
    for (k, given) in wanted.results.iter().enumerate() {
        origins.push(earlier(search, world, (&format!("analyses.cycles.starts.results[{k}]"), given))?);
    }
    Ok(origins.into_iter().map(|origin| Candidate { origin }).collect())
}

/// Collective: the cycle, or the motion of a sweep, that the job takes from an earlier result by the key `path`.
fn earlier(search: &Search<'_>, world: &World, (path, given): (&str, &EarlierResult)) -> Result<BranchOrigin> {
    let (along, [from, to]) = (&search.wanted.along, [search.wanted.from, search.wanted.to]);
    let (file, number) = (given.file.display().to_string(), given.cycle as usize);
    let numbers = world.on_root(|| {
        let read = |reader: &Reader| -> Result<Vec<f64>> {
            if !cycle_motions::is_of_sweep(reader) {
                let found = EarlierCycle::read(reader, (along, number), search.model.0)?;
                return Ok([vec![0.0], found.numbers()].concat());
            }
            let (key, motion) = cycle_motions::read(reader, (along, number), &motion_modes(search.model))?;
            Ok([vec![1.0, key, motion.period], motion.q, motion.v].concat())
        };
        Reader::open(given.file.as_ref()).and_then(|reader| read(&reader)).map_err(|e| e.context(path))
    })?;
    let numbers = world.broadcast(numbers.unwrap_or_default());
    let torn = || Error::Defect("limit cycles: a cycle was torn on its way".into());
    let origin = match &numbers[..] {
        [1.0, key, period, motion @ ..] => {
            let (q, v) = motion.split_at(motion.len() / 2);
            let motion = CycleMotion { q: q.to_vec(), v: v.to_vec(), period: *period };
            BranchOrigin::Swept { place: format!("point {number} of the sweep of {file}"), key: *key, motion }
        }
        [_, cycle @ ..] => {
            let earlier = EarlierCycle::from_numbers((file, number), cycle).ok_or_else(torn)?;
            BranchOrigin::Result(Box::new(earlier))
        }
        [] => return Err(torn()),
    };
    let key = match &origin {
        BranchOrigin::Result(earlier) => earlier.key,
        BranchOrigin::Swept { key, .. } => *key,
        _ => from,
    };
    if !(from..=to).contains(&key) {
        let text = format!("{path}.cycle: found one at {along} = {key}, expected one in the range from {from} to {to}");
        return Err(Error::Job(text));
    }
    Ok(origin)
}

/// Unknowns that Newton's method begins with.
struct Guess {
    /// Coefficients of the motion, m √kg.
    z: Vec<f64>,
    /// See [`BranchStart::scale`].
    scale: [f64; 3],
    memory: ContactMemory,
    /// True if the amplitude is held in the place of the key.
    small: bool,
    /// Contact forces nearby, but for their derivatives with respect to the key.
    contact: Option<ContactJacobian>,
}

impl BranchFollower<'_, '_> {
    /// Solves for the cycle of a candidate; that of a mode is marched where the amplitude leads to none.
    pub(super) fn solve(&self, number: usize, candidate: &Candidate) -> Result<BranchStart> {
        let (key, mode) = match &candidate.origin {
            BranchOrigin::Threshold(onset) => {
                let (guess, _) = self.small_motion(onset.key, onset.mode, self.search.resolution())?;
                return self.near(number, guess);
            }
            BranchOrigin::Result(earlier) => return self.near(number, self.earlier(earlier)),
            BranchOrigin::Swept { key, motion, .. } => return self.near(number, self.taken_over(*key, motion)?),
            BranchOrigin::Mode { key, mode, .. } => (*key, *mode),
        };
        let march = || self.near(number, self.marched(key, mode)?);
        if self.search.wanted.starts.by == StartsBy::March {
            return march();
        }
        // The way only has to lead near the cycle: coarse equations take it sooner.
        let whole = self.search.resolution();
        let mut found = self.grown(key, mode, whole.coarser()).and_then(|guess| self.near(number, guess));
        if whole.coarser() != whole && matches!(found, Err(Error::NotConverged(_))) {
            found = self.grown(key, mode, whole).and_then(|guess| self.near(number, guess));
        }
        match found {
            Err(Error::NotConverged(why)) => march().map_err(|e| match e {
                Error::NotConverged(other) => Error::NotConverged(format!("{why}; marched: {other}")),
                e => e,
            }),
            found => found,
        }
    }

    /// The cycle near `guess`.
    fn near(&self, number: usize, guess: Guess) -> Result<BranchStart> {
        let Guess { z, scale: [unit, omega, key], memory, small, mut contact } = guess;
        let mut equations = self.equations([unit, omega, key], memory);
        let mut u: Vec<f64> = z.iter().map(|z| z / unit).collect();
        u.extend([1.0, 0.0]);
        if let Some(contact) = &mut contact {
            equations.settle(&u)?;
            equations.key_derivative(contact)?;
        }
        let r = self.structure.rank();
        let mut ahead = vec![0.0; u.len()];
        let found = match small {
            false => solve(&mut equations, u, &mut contact)?,
            true => {
                let size = u[r..z.len()].iter().map(|u| u * u).sum::<f64>().sqrt();
                (r..z.len()).for_each(|k| ahead[k] = u[k] / size);
                let held = Condition { row: ahead.clone(), reference: u.clone() };
                solve_under(&mut equations, u, held, &mut contact)?
            }
        };
        if equations.amplitude(&found.u) < SMALL / 4.0 {
            return Err(Error::NotConverged("limit cycles: Newton's method falls back to rest".into()));
        }
        let key = equations.key_of(&found.u);
        // A cycle that was solved for is one, with its multipliers or without.
        let (values, unknown) = match self.search.wanted.stability {
            true => stability_of(&equations, key, &found.cycle)?.map_or_else(|e| (None, Some(e)), |m| (Some(m), None)),
            false => (None, None),
        };
        let Some(contact) = contact else { return Err(Error::Defect("limit cycles: no Jacobian".into())) };
        let point = BranchPoint { key, u: found.u, cycle: found.cycle, multipliers: values, special: None };
        let mut state = BranchState::new(point, contact, true, &self.search.extent());
        (state.marches, state.unknown) = (equations.marches, unknown);
        if small {
            state = state.towards(ahead);
        }
        Ok(BranchStart { number, scale: [unit, omega, equations.key[0]], state })
    }

    /// The cycle that motions of growing amplitude along the mode of the rank `mode` end at, by equations of the
    /// `resolution` given.
    fn grown(&self, key: f64, mode: usize, resolution: Resolution) -> Result<Guess> {
        let (Guess { z, scale: [unit, omega, _], memory, .. }, rate) = self.small_motion(key, mode, resolution)?;
        let motions = GrowingMotion(self.search.conditions(key)?);
        let equations = self.equations([unit, omega, rate], memory);
        let structure = equations.structure_at(key)?;
        let mut equations = Equations { structure: &structure, family: &motions, resolution, ..equations };
        equations.key = [rate, rate];
        let mut u: Vec<f64> = z.iter().map(|z| z / unit).collect();
        u.extend([1.0, 0.0]);
        let (cycle, contact) = cycle_of_mode(&mut equations, u)?;
        // In the units of the cycle.
        let (n, size, period) = (z.len(), equations.amplitude(&cycle.u), cycle.u[z.len()]);
        let mut z: Vec<f64> = cycle.u[..n].iter().map(|u| u * unit).collect();
        let whole = self.search.resolution();
        let (omega, contact) = match resolution == whole {
            true => (omega * period, Some(contact.in_units(size, period, 0.0))),
            false => {
                z.resize(self.structure.rank() * (2 * whole.harmonics + 1), 0.0);
                (whole.omega(cycle.cycle.frequency), None)
            }
        };
        Ok(Guess { z, scale: [unit * size, omega, key], memory: cycle.cycle.begin, small: false, contact })
    }

    /// The motion that the mode of the rank `mode` leads to at `key`, marched.
    fn marched(&self, key: f64, mode: usize) -> Result<Guess> {
        let search = self.search;
        let job = search.job_at(key)?;
        let cycles = &search.wanted.march;
        let pair = search.pair(&job)?;
        let attempt = LimitCyclePoint { job: &job, cycles, model: (search.model.0, &pair), heard: None, mode };
        let motion = attempt.follow(None)?.motion.ok_or_else(|| {
            Error::NotConverged("limit cycles: the motion that begins with this mode dies out".into())
        })?;
        self.taken_over(key, &motion)
    }

    /// A marched motion at `key`, which goes on for some periods in the steps of the equations.
    fn taken_over(&self, key: f64, motion: &CycleMotion) -> Result<Guess> {
        let (search, structure) = (self.search, self.structure);
        let job = search.job_at(key)?;
        let pair = search.pair(&job)?;
        let transient = search.transient()?;
        let rolling = search.rolling(&job, &transient, &pair)?;
        let ready = rolling.ready()?;
        let model = ready.model(&pair);
        let (mut state, settings) = ready.initial_state(&model, &rolling)?;
        state.q.iter_mut().zip(&motion.q).for_each(|(q, d)| *q += d);
        state.v.iter_mut().zip(&motion.v).for_each(|(v, d)| *v += d);
        let resolution = search.resolution();
        let scheme = Scheme { step: motion.period / resolution.samples as f64, theta: 0.5 };
        let mut stepper = Stepper::new(model, Settings { scheme, ..settings }, state)?;
        stepper.settle()?;
        for _ in 0..PERIODS * resolution.samples {
            stepper.advance()?;
        }
        let z = structure.follow(&mut stepper, resolution)?;
        let unit = z[structure.rank()..].iter().map(|z| z * z).sum::<f64>().sqrt();
        let memory = memory_of(stepper.state());
        Ok(Guess { z, scale: [unit, 2.0 * PI / motion.period, key], memory, small: false, contact: None })
    }

    /// The small motion along the mode of the rank `mode` at `key`, with the harmonics of `resolution`, and its growth
    /// rate, 1/s: 0 at a threshold of rest.
    fn small_motion(&self, key: f64, mode: usize, resolution: Resolution) -> Result<(Guess, f64)> {
        let (search, structure) = (self.search, self.structure);
        let found = search.with_problem(key, |problem| problem.analyse(search.memory))?;
        let mode = found.spectrum.eigenpairs.iter().filter(|e| e.frequency() > 0.0).nth(mode);
        let Some(mode) = mode else {
            return Err(Error::NotConverged("limit cycles: the mode of rest is not found again".into()));
        };
        let job = search.job_at(key)?;
        let (transient, pair) = (search.transient()?, search.pair(&job)?);
        let rolling = search.rolling(&job, &transient, &pair)?;
        let ready = rolling.ready()?;
        let (rest, _) = ready.initial_state(&ready.model(&pair), &rolling)?;
        // The motion at which a node at the contact reaches the velocity of the creepage, the largest one of several.
        let omega = mode.value.im.abs();
        let creep = |c: &Contact| c.creepage.longitudinal.hypot(c.creepage.lateral) * c.speed;
        let creep = rolling.contact.all().map(creep).fold(0.0, f64::max);
        let amplitude = if creep > 0.0 { creep / omega } else { 100.0 * search.wanted.march.amplitude };
        let factor = scale(&pair, &mode.modal, amplitude);
        let turn = |z: &Complex64| if mode.value.im < 0.0 { z.conj() } else { *z };
        let modal: Vec<Complex64> = mode.modal.iter().map(|q| turn(&(factor * q))).collect();
        let first = structure.at_contact(&modal);
        let mean: Vec<Complex64> = rest.q.iter().map(|q| Complex64::new(*q, 0.0)).collect();
        let unit = first.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
        let mut z: Vec<f64> = structure.at_contact(&mean).iter().map(|z| z.re).collect();
        z.extend(first.iter().map(|z| SMALL * z.re));
        z.extend(first.iter().map(|z| -SMALL * z.im));
        z.resize(structure.rank() * (2 * resolution.harmonics + 1), 0.0);
        let memory = memory_of(&rest);
        Ok((Guess { z, scale: [unit, omega, key], memory, small: true, contact: None }, mode.value.re))
    }

    /// A cycle of an earlier result, as the modes of this job have it.
    fn earlier(&self, earlier: &EarlierCycle) -> Guess {
        let harmonics = self.search.resolution().harmonics;
        let r = self.structure.rank();
        let mut z: Vec<f64> = Vec::new();
        for displacement in earlier.displacement.iter().take(2 * harmonics + 1) {
            z.extend(self.structure.projected(displacement));
        }
        z.resize(r * (2 * harmonics + 1), 0.0);
        let unit = z[r..].iter().map(|z| z * z).sum::<f64>().sqrt();
        let omega = self.search.resolution().omega(earlier.frequency);
        let memory = ContactMemory {
            reaction: earlier.reaction.clone(),
            friction: earlier.friction.clone(),
            motions: earlier.motions.clone(),
        };
        Guess { z, scale: [unit, omega, earlier.key], memory, small: false, contact: None }
    }
}

fn memory_of(state: &State) -> ContactMemory {
    ContactMemory { reaction: state.reaction.clone(), friction: state.friction.clone(), motions: state.motions.clone() }
}
