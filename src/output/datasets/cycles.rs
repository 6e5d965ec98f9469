//! Limit cycles of the points of a sweep.

use crate::job::Branch;
use crate::output::Table;
use crate::transient::cycle::{CycleOutcome, FollowedMotion};

/// Outcome of a point, as numbers only: so it travels and is kept without loss.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    /// -1 not computed, 0 at rest, 1 periodic, 2 irregular, 3 unsettled.
    pub fate: i8,
    /// Hz.
    pub frequency: f64,
    /// Crossings of the section in a period.
    pub crossings: usize,
    /// Distance of states any number of periods apart, of the amplitude.
    pub apart: f64,
    /// 1/s.
    pub back: f64,
    /// s.
    pub time: f64,
    /// J.
    pub kinetic: f64,
    /// N.
    pub force: [f64; 3],
    /// N.
    pub sway: [f64; 3],
    /// Mean and largest share.
    pub stick: [f64; 2],
    /// Fewest closed nodes.
    pub closed: usize,
    /// m/s, lower (x, y, n) and upper.
    pub velocity: [f64; 6],
    /// Amplitudes of force (3) and velocities (6) at the multiples of the frequency, `[harmonics][9]`.
    pub lines: Vec<[f64; 9]>,
    /// Sound power of each body that is heard in each third octave, W, `[bodies × bands]`; empty where none is.
    pub sound: Vec<f64>,
}

/// Numbers before the lines.
const HEAD: usize = 23;

impl Cycle {
    /// Row of a point that was not computed.
    pub fn none(harmonics: usize) -> Self {
        Self {
            fate: -1,
            frequency: f64::NAN,
            crossings: 0,
            apart: f64::NAN,
            back: f64::NAN,
            time: 0.0,
            kinetic: f64::NAN,
            force: [f64::NAN; 3],
            sway: [f64::NAN; 3],
            stick: [f64::NAN; 2],
            closed: 0,
            velocity: [f64::NAN; 6],
            lines: vec![[f64::NAN; 9]; harmonics],
            sound: Vec::new(),
        }
    }

    /// At rest under the force `force`, N, with so many nodes closed and stuck, after `time`, s.
    pub fn at_rest(force: [f64; 3], [closed, stick]: [usize; 2], time: f64, harmonics: usize) -> Self {
        let share = stick as f64 / closed.max(1) as f64;
        Self {
            fate: 0,
            time,
            kinetic: 0.0,
            force,
            sway: [0.0; 3],
            stick: [share; 2],
            closed,
            velocity: [0.0; 6],
            lines: vec![[0.0; 9]; harmonics],
            ..Self::none(0)
        }
    }

    /// Row of a motion that was followed; None where it came to rest.
    pub fn from_followed(found: &FollowedMotion) -> Option<Self> {
        let (returns, record) = found.motion.as_ref()?;
        let fate = match found.fate {
            CycleOutcome::Rest => 0,
            CycleOutcome::Cycle => 1,
            CycleOutcome::Irregular => 2,
            CycleOutcome::Unsettled => 3,
        };
        let lines = record.lines.iter().zip(&record.spectrum);
        Some(Self {
            fate,
            frequency: 1.0 / returns.period,
            crossings: returns.crossings,
            apart: returns.apart,
            back: found.back,
            time: found.time,
            kinetic: record.kinetic,
            force: record.force,
            sway: record.sway,
            stick: record.stick,
            closed: record.closed,
            velocity: std::array::from_fn(|k| record.velocity.get(k).copied().unwrap_or(f64::NAN)),
            lines: lines
                .map(|(force, velocity)| {
                    let all: Vec<f64> = force.iter().chain(velocity).map(|z| z.norm()).collect();
                    std::array::from_fn(|k| all.get(k).copied().unwrap_or(f64::NAN))
                })
                .collect(),
            sound: Vec::new(),
        })
    }

    /// All of it in a row.
    pub fn numbers(&self) -> Vec<f64> {
        let mut all = vec![f64::from(self.fate), self.frequency, self.crossings as f64, self.apart, self.back];
        all.extend([self.time, self.kinetic]);
        all.extend(self.force.iter().chain(&self.sway).chain(&self.stick));
        all.push(self.closed as f64);
        all.extend(self.velocity);
        all.push(self.lines.len() as f64);
        all.extend(self.lines.as_flattened());
        all.extend(&self.sound);
        all
    }

    /// From [`numbers`](Self::numbers); none where they are too few.
    pub fn from_numbers(all: &[f64]) -> Option<Self> {
        let (head, rest) = all.split_at_checked(HEAD)?;
        let (lines, sound) = rest.split_at_checked(9 * head[HEAD - 1] as usize)?;
        let line = |l: &[f64]| std::array::from_fn(|k| l[k]);
        Some(Self {
            fate: head[0] as i8,
            frequency: head[1],
            crossings: head[2] as usize,
            apart: head[3],
            back: head[4],
            time: head[5],
            kinetic: head[6],
            force: [head[7], head[8], head[9]],
            sway: [head[10], head[11], head[12]],
            stick: [head[13], head[14]],
            closed: head[15] as usize,
            velocity: std::array::from_fn(|k| head[16 + k]),
            lines: lines.chunks_exact(9).map(line).collect(),
            sound: sound.to_vec(),
        })
    }
}

/// The group `/sweep/cycles` of `points` points: `all` has those of the first branch, then those of the next.
pub fn tables(branches: &[Branch], along: &str, points: usize, all: &[Cycle]) -> Vec<Table> {
    let names: Vec<String> = branches.iter().map(|b| b.name().to_owned()).collect();
    let mut tables = vec![
        Table::list("/sweep/cycles/branch", "-", "Origin of the motions of the points.", names),
        Table::scalar("/sweep/cycles/along", "-", "The swept key along which they are handed on.", along),
    ];
    tables.extend(motions("/sweep/cycles", &[branches.len(), points], all));
    tables
}

/// Tables of `all` cycles in a group, in the order of a `shape`.
pub fn motions(group: &str, shape: &[usize], all: &[Cycle]) -> Vec<Table> {
    let path = |name: &str| format!("{group}/{name}");
    let numbers = |name: &str, unit: &str, text: &str, of: &dyn Fn(&Cycle) -> f64| {
        Table::new(&path(name), unit, text, shape, all.iter().map(of).collect::<Vec<f64>>())
    };
    let counts = |name: &str, text: &str, of: &dyn Fn(&Cycle) -> usize| {
        Table::new(&path(name), "1", text, shape, all.iter().map(|c| of(c) as i64).collect::<Vec<i64>>())
    };
    let harmonics = all.first().map_or(0, |c| c.lines.len());
    let rows = |name: &str, unit: &str, text: &str, more: &[usize], of: &dyn Fn(&Cycle) -> Vec<f64>| {
        let shape = [shape, more].concat();
        Table::new(&path(name), unit, text, &shape, all.iter().flat_map(of).collect::<Vec<f64>>())
    };
    vec![
        Table::new(
            &path("fate"),
            "-",
            "-1 not computed, 0 at rest, 1 periodic, 2 irregular: neither its amplitude nor its beat changes \
             but it does \
             not repeat itself, 3 unsettled at the end of the time.",
            shape,
            all.iter().map(|c| c.fate).collect::<Vec<i8>>(),
        ),
        numbers("frequency", "Hz", "One over the period; of what does not repeat itself the mean.", &|c| c.frequency),
        counts("crossings", "Crossings of the section in a period; 0 where it does not repeat itself.", &|c| {
            c.crossings
        }),
        numbers("apart", "1", "Largest distance of states any number of periods apart, of the amplitude.", &|c| {
            c.apart
        }),
        numbers("back", "1/s", "Rate at which small deviations of the amplitude go back.", &|c| c.back),
        numbers("time", "s", "Time that was simulated.", &|c| c.time),
        numbers("kinetic", "J", "Mean kinetic energy.", &|c| c.kinetic),
        rows("force", "N", "Mean contact force (x, y, z) on body 1, at the first contact.", &[3], &|c| {
            c.force.to_vec()
        }),
        rows("force_rms", "N", "Root mean square of the force about its mean.", &[3], &|c| c.sway.to_vec()),
        rows("stick", "1", "Share of the closed nodes that stick: mean and largest.", &[2], &|c| c.stick.to_vec()),
        counts("closed", "Fewest closed nodes.", &|c| c.closed),
        rows(
            "velocity_rms",
            "m/s",
            "Root mean squares of the velocities (x, y, n) of the lower and the upper body at the middle of the \
             contact.",
            &[2, 3],
            &|c| c.velocity.to_vec(),
        ),
        rows(
            "force_harmonics",
            "N",
            "Amplitudes of the force (x, y, z) at the multiples of the frequency.",
            &[harmonics, 3],
            &|c| c.lines.iter().flat_map(|l| l[..3].to_vec()).collect(),
        ),
        rows(
            "velocity_harmonics",
            "m/s",
            "Amplitudes of the velocities (x, y, n) of the lower and the upper body at the multiples of the frequency.",
            &[harmonics, 2, 3],
            &|c| c.lines.iter().flat_map(|l| l[3..].to_vec()).collect(),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back() {
        let rest = Cycle::at_rest([1.0, -2.0, 3.0], [40, 10], 0.5, 2);
        let moving = Cycle {
            fate: 1,
            frequency: 963.7,
            crossings: 2,
            back: 4.0,
            apart: 1e-4,
            lines: vec![[2.0; 9], [1.0; 9]],
            sound: vec![1e-3, 2e-3],
            ..rest
        };
        assert_eq!(Cycle::from_numbers(&moving.numbers()), Some(moving.clone()));
        let numbers = moving.numbers();
        assert_eq!(Cycle::from_numbers(&numbers[..9]), None);
        assert_eq!(Cycle::from_numbers(&numbers[..numbers.len() - 3]), None);
        assert_eq!(moving.stick, [0.25; 2]);
    }
}
