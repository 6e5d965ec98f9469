//! The group `/cycles`: branches of limit cycles.

use crate::cycles::{BranchPoint, NodalPeriod, Structure};
use crate::grid::Interface;
use crate::output::datasets::nodal_periods::nodal_tables;
use crate::output::{Reader, Table};
use crate::{Error, Result};
use num_complex::Complex;

/// Multipliers that are written of a cycle.
const WRITTEN: usize = 12;

/// A value of the key at which a mode of rest begins to grow, or ceases to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Onset {
    /// Value of the key.
    pub key: f64,
    /// Frequency of the eigenvalue whose growth rate is zero, Hz.
    pub frequency: f64,
    /// True if the mode grows at larger values.
    pub above: bool,
    /// Modes that grow on both sides: at a threshold of rest 0.
    pub mode: usize,
}

impl Onset {
    /// Length of [`numbers`](Self::numbers).
    pub const NUMBERS: usize = 4;

    /// All of it in a row.
    pub fn numbers(&self) -> [f64; Self::NUMBERS] {
        [self.key, self.frequency, f64::from(u8::from(self.above)), self.mode as f64]
    }

    /// From [`numbers`](Self::numbers); none of others.
    pub fn from_numbers(all: &[f64]) -> Option<Self> {
        let [key, frequency, above, mode] = *all else { return None };
        Some(Self { key, frequency, above: above != 0.0, mode: mode as usize })
    }
}

/// Side of a threshold of rest on which its small cycles lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criticality {
    /// On the side where rest is stable: squeal jumps to a cycle of finite amplitude.
    Subcritical,
    /// No branch tells.
    Unknown,
    /// On the side where rest is unstable: squeal grows from small cycles.
    Supercritical,
}

impl Criticality {
    /// As in tables: -1 subcritical, 0 unknown, 1 supercritical.
    pub fn number(self) -> i8 {
        match self {
            Self::Subcritical => -1,
            Self::Unknown => 0,
            Self::Supercritical => 1,
        }
    }
}

/// A branch in the order of its cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct OneBranch {
    /// The cycles from one end to the other.
    pub points: Vec<BranchPoint>,
    /// Place of the cycle that it was begun with.
    pub start: usize,
    /// Why it ends on both sides.
    pub ends: [String; 2],
    /// Its beginning, in words.
    pub origin: String,
    /// Unit of the motion, m √kg.
    pub unit: f64,
    /// Why multipliers of a cycle were not found, of one such cycle; none where all that were asked for were.
    pub unknown: Option<String>,
}

/// Cycles whose period is told, with their places among all rows: special points, and every so-manieth cycle of a
/// branch.
pub fn shown(branches: &[OneBranch], every: Option<u32>) -> Vec<(usize, &BranchPoint)> {
    let wanted = |number: usize, point: &BranchPoint| {
        point.special.is_some() || every.is_some_and(|k| number.is_multiple_of(k.max(1) as usize))
    };
    let all = branches.iter().flat_map(|b| b.points.iter().enumerate());
    all.enumerate().filter(|(_, (number, point))| wanted(*number, point)).map(|(row, (_, p))| (row, p)).collect()
}

/// The branches, and what is known of rest.
pub struct BranchTables<'a> {
    /// The key and its unit.
    pub along: (&'a str, &'a str),
    /// The branches.
    pub branches: &'a [OneBranch],
    /// One cycle of so many has a period in the tables beside the special points; none where they alone have.
    pub every: Option<u32>,
    /// Velocities of the lower and the upper body (x, y, n) at each contact over the modal ones, `[6 contacts][m]`.
    pub watch: &'a [Vec<f64>],
    /// Thresholds of rest, and of further modes.
    pub onsets: &'a [Onset],
    /// Side of each of them on which its small cycles lie.
    pub criticality: &'a [Criticality],
    /// Modes at the contact, and its nodes.
    pub structure: (&'a Structure<'a>, &'a Interface),
    /// Contact nodes over a period of each of the cycles that have one, in the order of [`shown`].
    pub nodal: &'a [NodalPeriod],
}

impl BranchTables<'_> {
    /// All tables.
    pub fn tables(&self) -> Vec<Table> {
        let points: Vec<&BranchPoint> = self.branches.iter().flat_map(|b| &b.points).collect();
        let count = points.len();
        let of_branch = self.branches.iter().enumerate().flat_map(|(k, b)| vec![k as i64; b.points.len()]);
        let firsts = self.branches.iter().scan(0, |sum, b| {
            let first = *sum;
            *sum += b.points.len();
            Some((first + b.start) as i64)
        });
        let list = |name: &str, units: &str, text: &str, of: &dyn Fn(&BranchPoint) -> f64| {
            Table::list(&format!("/cycles/{name}"), units, text, points.iter().map(|p| of(p)).collect::<Vec<f64>>())
        };
        let nan = Complex::new(f64::NAN, f64::NAN);
        let multipliers: Vec<Complex<f64>> = points
            .iter()
            .flat_map(|p| {
                let of = |k: usize| p.multipliers.as_ref().and_then(|m| m.values.get(k)).copied().unwrap_or(nan);
                (0..WRITTEN).map(of).collect::<Vec<_>>()
            })
            .collect();
        let phase: Vec<Complex<f64>> = points.iter().map(|p| p.multipliers.as_ref().map_or(nan, |m| m.phase)).collect();
        let unstable: Vec<i64> =
            points.iter().map(|p| p.multipliers.as_ref().map_or(-1, |m| m.unstable() as i64)).collect();
        let special: Vec<String> = points.iter().map(|p| p.special.map_or("", |s| s.kind.name()).into()).collect();
        let places: Vec<i64> = shown(self.branches, self.every).into_iter().map(|(place, _)| place as i64).collect();
        let onsets = |of: &dyn Fn(&Onset) -> f64| self.onsets.iter().map(of).collect::<Vec<f64>>();
        let (along, unit) = self.along;
        let mut all = vec![
            Table::scalar("/cycles/along", "-", "Key along which the branch goes.", along.to_owned()),
            list("key", unit, "Value of the key.", &|p| p.key),
            list("frequency", "Hz", "Frequency.", &|p| p.cycle.frequency),
            list("kinetic", "J", "Mean kinetic energy.", &|p| p.cycle.kinetic),
            Table::new(
                "/cycles/multiplier",
                "1",
                "Floquet multipliers by falling size, one of each conjugate pair, without that of the phase; NaN where \
                 there are fewer.",
                &[count, WRITTEN],
                multipliers,
            ),
            Table::list("/cycles/phase_multiplier", "1", "The multiplier of the phase, to be 1.", phase),
            Table::list(
                "/cycles/unstable",
                "1",
                "Multipliers outside the unit circle: 0 of a stable cycle; -1 where they were not computed.",
                unstable,
            ),
            Table::list("/cycles/special", "-", "Kind of a special point; empty of an ordinary cycle.", special),
            list("second_frequency", "Hz", "Second frequency at a torus point; 0 elsewhere.", &|p| {
                p.special.map_or(0.0, |s| s.second)
            }),
            list("special_error", unit, "Error of the location of a special point; NaN of an ordinary cycle.", &|p| {
                p.special.map_or(f64::NAN, |s| s.error)
            }),
            Table::list("/cycles/branch", "1", "Number of the branch of each cycle.", of_branch.collect::<Vec<i64>>()),
            Table::list(
                "/cycles/start",
                "1",
                "Place of the cycle that each branch was begun with.",
                firsts.collect::<Vec<i64>>(),
            ),
            Table::list(
                "/cycles/origin",
                "-",
                "Origin of each branch.",
                self.branches.iter().map(|b| b.origin.clone()).collect::<Vec<String>>(),
            ),
            Table::new(
                "/cycles/end",
                "-",
                "Why each branch ends, on both sides.",
                &[self.branches.len(), 2],
                self.branches.iter().flat_map(|b| b.ends.clone()).collect::<Vec<String>>(),
            ),
            Table::list("/cycles/onset/key", unit, "Values of the key at which the stability of rest changes.", {
                onsets(&|o| o.key)
            }),
            Table::list("/cycles/onset/frequency", "Hz", "Frequency of the eigenvalue that crosses.", {
                onsets(&|o| o.frequency)
            }),
            Table::list("/cycles/onset/above", "-", "1 where rest is unstable above, 0 where below.", {
                self.onsets.iter().map(|o| i8::from(o.above)).collect::<Vec<i8>>()
            }),
            Table::list(
                "/cycles/onset/mode",
                "1",
                "Modes of rest that grow on both sides: 0 where rest loses its stability or finds it again.",
                self.onsets.iter().map(|o| o.mode as i64).collect::<Vec<i64>>(),
            ),
            Table::list(
                "/cycles/onset/criticality",
                "-",
                "Small cycles there: -1 where rest is stable (subcritical), 1 where it is unstable (supercritical), 0 \
                 not known.",
                self.criticality.iter().map(|c| c.number()).collect::<Vec<i8>>(),
            ),
            Table::list("/cycles/period/point", "1", "Places of the cycles whose periods follow.", places),
        ];
        let contacts = points.first().map_or(0, |p| p.cycle.contacts.len());
        all.extend((0..contacts).flat_map(|contact| self.of_contact(contact)));
        all.extend(nodal_tables(self.nodal));
        all.extend(self.motions());
        all
    }

    /// The contact `number`, from 0, in all cycles; those of further ones are in groups of their own.
    fn of_contact(&self, number: usize) -> Vec<Table> {
        let points: Vec<&BranchPoint> = self.branches.iter().flat_map(|b| &b.points).collect();
        let told: Vec<&BranchPoint> = shown(self.branches, self.every).into_iter().map(|(_, p)| p).collect();
        let of = |p: &BranchPoint| p.cycle.contacts.get(number).cloned().unwrap_or_default();
        let steps = points.first().map_or(0, |p| of(p).force.len());
        let path = |name: &str| match number {
            0 => format!("/cycles/{name}"),
            _ => format!("/cycles_{}/{name}", number + 1),
        };
        let rows = |name: &str, units: &str, text: &str, shape: &[usize], of: &dyn Fn(&BranchPoint) -> Vec<f64>| {
            let values: Vec<f64> = points.iter().flat_map(|p| of(p)).collect();
            Table::new(&path(name), units, text, &[&[points.len()], shape].concat(), values)
        };
        let along = self.structure.1.patches.get(number).and_then(|patch| self.structure.0.free_along(patch.nodes()));
        let text = "Change of the mean creep velocity along x by the rotation of the wheelset, which is free.";
        let turned = along.map(|along| rows("free_creep", "m/s", text, &[], &|p| vec![along * p.cycle.drift]));
        let mut all = vec![
            rows("force", "N", "Mean contact force (x, y, z) on body 1.", &[3], &|p| of(p).sway()[1].to_vec()),
            rows("force_rms", "N", "Root mean square of the force about its mean.", &[3], &|p| {
                of(p).sway()[0].to_vec()
            }),
            rows("normal", "N", "Least and largest normal force.", &[2], &|p| of(p).normal().to_vec()),
            rows("stick", "1", "Share of the closed nodes that stick: mean and largest.", &[2], &|p| {
                of(p).stick().to_vec()
            }),
            rows("closed", "1", "Fewest closed nodes.", &[], &|p| vec![of(p).closed() as f64]),
            rows(
                "velocity_rms",
                "m/s",
                "Root mean squares of the velocities (x, y, n) of the lower and the upper body at the middle of the \
                 contact.",
                &[2, 3],
                &|p| self.watch.iter().skip(6 * number).take(6).map(|row| p.cycle.velocity(row)).collect(),
            ),
            Table::new(
                &path("period/force"),
                "N",
                "Contact force (x, y, z) on body 1 over a period of each of the cycles of /cycles/period/point.",
                &[told.len(), steps, 3],
                told.iter().flat_map(|p| of(p).force.into_flattened()).collect::<Vec<f64>>(),
            ),
            Table::new(
                &path("period/nodes"),
                "1",
                "Closed and sticking nodes over a period of each of them.",
                &[told.len(), steps, 2],
                told.iter().flat_map(|p| of(p).nodes.into_flattened()).map(|n| n as i64).collect::<Vec<i64>>(),
            ),
        ];
        all.extend(turned);
        all
    }

    /// Motion and contact of every cycle, from which later runs begin.
    fn motions(&self) -> Vec<Table> {
        let points = || self.branches.iter().flat_map(|b| b.points.iter().map(move |p| (b.unit, p)));
        let count = points().count();
        let (structure, interface) = self.structure;
        let (basis, r, n) = (structure.basis(), structure.rank(), interface.len());
        let parts = points().next().map_or(0, |(_, p)| p.u.len().saturating_sub(2) / r.max(1));
        // The mean of a motion that nothing holds is a velocity, not a displacement.
        let free = structure.free_along(0..1).map(|_| r - 1);
        let motion = points().flat_map(|(unit, p)| {
            let mean = move |k: usize| if Some(k) == free { 0.0 } else { unit };
            p.u[..r * parts].iter().enumerate().map(move |(k, u)| mean(k) * u)
        });
        let memory = points().next().map_or(0, |(_, p)| p.cycle.begin.friction.len());
        let motions = points().next().map_or(1, |(_, p)| p.cycle.begin.motions.len());
        let sizes = [motions];
        let rows = |name: &str, units: &str, text: &str, shape: &[usize], values: Vec<f64>| {
            Table::new(&format!("/cycles/motion/{name}"), units, text, &[&[count], shape].concat(), values).summed()
        };
        let list = |of: &dyn Fn(&BranchPoint) -> Vec<f64>| points().flat_map(|(_, p)| of(p)).collect::<Vec<f64>>();
        let position: Vec<f64> = (0..n).flat_map(|i| interface.point(i)).collect();
        vec![
            Table::new("/cycles/motion/position", "m", "Contact nodes (x, y).", &[n, 2], position).summed(),
            Table::new(
                "/cycles/motion/basis",
                "kg^-1/2",
                "Functions of the modal motion that act at the contact: displacement (x, y, n) of each node.",
                &[3 * n, r],
                (0..3 * n).flat_map(|i| (0..r).map(move |k| basis[(i, k)])).collect::<Vec<f64>>(),
            )
            .summed(),
            rows(
                "coefficient",
                "m kg^1/2",
                "Motion of these functions: mean, then cosine and sine of each harmonic.",
                &[parts, r],
                motion.collect(),
            ),
            rows("reaction", "N", "Contact forces (x, y, n) at the phase where marches begin.", &[3 * n], {
                list(&|p| p.cycle.begin.reaction.clone())
            }),
            rows(
                "friction",
                "1",
                "Coefficients of friction there; without columns where friction is constant.",
                &[memory],
                list(&|p| p.cycle.begin.friction.clone()),
            ),
            rows(
                "approach",
                "m",
                "Approach there; with several contacts one of each rigid motion.",
                if motions == 1 { &[] } else { &sizes },
                list(&|p| p.cycle.begin.motions.clone()),
            ),
            rows("key", "-", "Value of the key.", &[], list(&|p| vec![p.key])),
            rows("frequency", "Hz", "Frequency.", &[], list(&|p| vec![p.cycle.frequency])),
            Table::scalar("/cycles/motion/along", "-", "The key.", self.along.0.to_owned()).summed(),
        ]
    }
}

/// Place of the values that two runs may have of one contact node, m.
const SAME_PLACE: f64 = 1e-9;

/// A cycle of an earlier result.
#[derive(Debug, Clone, PartialEq)]
pub struct EarlierCycle {
    /// The file and the place in it.
    pub file: String,
    /// Place among the cycles.
    pub place: usize,
    /// Value of the key.
    pub key: f64,
    /// Frequency, Hz.
    pub frequency: f64,
    /// Displacements of the contact nodes, m: mean, then cosine and sine of each harmonic, `[2H + 1][3n]`.
    pub displacement: Vec<Vec<f64>>,
    /// Contact forces, N, `[3n]`.
    pub reaction: Vec<f64>,
    /// Coefficients of friction, `[n]` or none.
    pub friction: Vec<f64>,
    /// Rigid motions, m, `[motions]`; of one contact its approach.
    pub motions: Vec<f64>,
}

impl EarlierCycle {
    /// The cycle `place` of a result whose branches go along the key `along`, on the contact of `interface`.
    pub fn read(file: &Reader, (along, place): (&str, usize), interface: &Interface) -> Result<Self> {
        let [count, parts, r] = Self::examine(file, (along, place))?;
        let name = file.path().display().to_string();
        let refused = |what: String| Error::Input(format!("{name}: {what}"));
        let read = |name: &str| file.verified_numbers(&format!("/cycles/motion/{name}"));
        let (_, coefficient) = read("coefficient")?;
        let n = interface.len();
        let (_, position) = read("position")?;
        let same = position.len() == 2 * n
            && position.chunks_exact(2).enumerate().all(|(i, p)| {
                let [x, y] = interface.point(i);
                (p[0] - x).abs() < SAME_PLACE && (p[1] - y).abs() < SAME_PLACE
            });
        if !same {
            return Err(refused(format!(
                "found {} contact nodes in other places, expected the {n} of this job; give the same contact grid",
                position.len() / 2
            )));
        }
        let (_, basis) = read("basis")?;
        let row = |values: Vec<f64>| {
            let width = values.len() / count.max(1);
            values[place * width..(place + 1) * width].to_vec()
        };
        let z = row(coefficient);
        let displacement = z
            .chunks_exact(r)
            .map(|z| (0..3 * n).map(|i| z.iter().zip(&basis[r * i..]).map(|(z, b)| z * b).sum()).collect::<Vec<f64>>());
        let displacement: Vec<Vec<f64>> = displacement.take(parts).collect();
        let one = |name: &str| read(name).map(|(_, values)| values[place]);
        Ok(Self {
            file: name.clone(),
            place,
            key: one("key")?,
            frequency: one("frequency")?,
            displacement,
            reaction: row(read("reaction")?.1),
            friction: row(read("friction")?.1),
            motions: row(read("approach")?.1),
        })
    }

    /// Examines whether a result has the cycle `place` of branches along the key `along`: numbers of its cycles, of
    /// parts of each motion and of functions.
    pub fn examine(file: &Reader, (along, place): (&str, usize)) -> Result<[usize; 3]> {
        let refused = |what: String| Err(Error::Input(format!("{}: {what}", file.path().display())));
        if !file.has("/cycles/motion/coefficient") {
            return refused(
                "found neither /cycles/motion nor /sweep/cycles/motion, expected a result of analyses.cycles, or of \
                 analyses.sweep.cycles with points that move"
                    .into(),
            );
        }
        let there = file.verified_text("/cycles/motion/along")?;
        if there != along {
            return refused(format!("found branches along \"{there}\", expected \"{along}\""));
        }
        let (shape, _) = file.numbers("/cycles/motion/coefficient")?;
        let [count, parts, r] = shape[..] else { return refused("/cycles/motion/coefficient is damaged".into()) };
        if place >= count {
            return refused(format!("found {count} cycles, expected one with the number {place}, from 0"));
        }
        Ok([count, parts, r])
    }

    /// All of it but its place, in a row.
    pub fn numbers(&self) -> Vec<f64> {
        let counts = [self.displacement.len(), self.reaction.len(), self.friction.len()].map(|n| n as f64);
        let mut all = counts.to_vec();
        all.extend([self.key, self.frequency]);
        all.extend(self.displacement.iter().flatten().chain(&self.reaction).chain(&self.friction));
        all.extend(&self.motions);
        all
    }

    /// From [`numbers`](Self::numbers) and file and place; none of others.
    pub fn from_numbers((file, place): (String, usize), all: &[f64]) -> Option<Self> {
        let (&[parts, rows, memory, key, frequency], rest) = all.split_first_chunk::<5>()?;
        let [parts, rows, memory] = [parts, rows, memory].map(|n| n as usize);
        let (displacement, rest) = rest.split_at_checked(parts * rows)?;
        let (reaction, rest) = rest.split_at_checked(rows)?;
        let (friction, motions) = rest.split_at_checked(memory)?;
        let displacement = displacement.chunks_exact(rows.max(1)).map(<[f64]>::to_vec).collect();
        Some(Self {
            file,
            place,
            key,
            frequency,
            displacement,
            reaction: reaction.to_vec(),
            friction: friction.to_vec(),
            motions: motions.to_vec(),
        })
    }
}
