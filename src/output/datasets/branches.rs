//! The group `/cycles`: branches of limit cycles.

use crate::cycles::BranchPoint;
use crate::output::Table;
use num_complex::Complex;

/// Multipliers that are written of a cycle.
const WRITTEN: usize = 12;

/// A value of the key at which rest loses its stability, or finds it again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Onset {
    /// Value of the key.
    pub key: f64,
    /// Frequency of the eigenvalue whose growth rate is zero, Hz.
    pub frequency: f64,
    /// True if rest is unstable at larger values.
    pub above: bool,
}

/// A branch in the order of its cycles, and what is known of rest.
pub struct BranchTables<'a> {
    /// The key and its unit.
    pub along: (&'a str, &'a str),
    /// The cycles from one end to the other.
    pub points: &'a [BranchPoint],
    /// Place of the cycle that was marched.
    pub start: usize,
    /// Why the branch ends on both sides.
    pub ends: [String; 2],
    /// Velocities of the lower and the upper body (x, y, n) at the contact over the modal ones, `[6][m]`.
    pub watch: &'a [Vec<f64>],
    /// Thresholds of rest.
    pub onsets: &'a [Onset],
}

impl BranchTables<'_> {
    /// All tables.
    pub fn tables(&self) -> Vec<Table> {
        let points = self.points;
        let count = points.len();
        let list = |name: &str, units: &str, text: &str, of: &dyn Fn(&BranchPoint) -> f64| {
            Table::list(&format!("/cycles/{name}"), units, text, points.iter().map(of).collect::<Vec<f64>>())
        };
        let rows = |name: &str, units: &str, text: &str, shape: &[usize], of: &dyn Fn(&BranchPoint) -> Vec<f64>| {
            let values: Vec<f64> = points.iter().flat_map(of).collect();
            Table::new(&format!("/cycles/{name}"), units, text, &[&[count], shape].concat(), values)
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
        let told: Vec<&BranchPoint> = points.iter().filter(|p| p.special.is_some()).collect();
        let places: Vec<i64> = (0..count).filter(|&k| points[k].special.is_some()).map(|k| k as i64).collect();
        let steps = points.first().map_or(0, |p| p.cycle.force.len());
        let onsets = |of: &dyn Fn(&Onset) -> f64| self.onsets.iter().map(of).collect::<Vec<f64>>();
        let (along, unit) = self.along;
        vec![
            Table::scalar("/cycles/along", "-", "Key along which the branch goes.", along.to_owned()),
            list("key", unit, "Value of the key.", &|p| p.key),
            list("frequency", "Hz", "Frequency.", &|p| p.cycle.frequency),
            list("kinetic", "J", "Mean kinetic energy.", &|p| p.cycle.kinetic),
            rows("force", "N", "Mean contact force (x, y, z) on body 1.", &[3], &|p| p.cycle.sway()[1].to_vec()),
            rows("force_rms", "N", "Root mean square of the force about its mean.", &[3], &|p| {
                p.cycle.sway()[0].to_vec()
            }),
            rows("normal", "N", "Least and largest normal force.", &[2], &|p| p.cycle.normal().to_vec()),
            rows("stick", "1", "Share of the closed nodes that stick: mean and largest.", &[2], &|p| {
                p.cycle.stick().to_vec()
            }),
            list("closed", "1", "Fewest closed nodes.", &|p| {
                p.cycle.nodes.iter().map(|n| n[0]).min().unwrap_or(0) as f64
            }),
            rows(
                "velocity_rms",
                "m/s",
                "Root mean squares of the velocities (x, y, n) of the lower and the upper body at the middle of the \
                 contact.",
                &[2, 3],
                &|p| self.watch.iter().map(|row| p.cycle.velocity(row)).collect(),
            ),
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
            Table::scalar("/cycles/start", "1", "Place of the cycle that was marched.", self.start as i64),
            Table::list("/cycles/end", "-", "Why the branch ends, on both sides.", self.ends.to_vec()),
            Table::list("/cycles/onset/key", unit, "Values of the key at which the stability of rest changes.", {
                onsets(&|o| o.key)
            }),
            Table::list("/cycles/onset/frequency", "Hz", "Frequency of the eigenvalue that crosses.", {
                onsets(&|o| o.frequency)
            }),
            Table::list("/cycles/onset/above", "-", "1 where rest is unstable above, 0 where below.", {
                self.onsets.iter().map(|o| i8::from(o.above)).collect::<Vec<i8>>()
            }),
            Table::list("/cycles/period/point", "1", "Places of the special points, whose periods follow.", places),
            Table::new(
                "/cycles/period/force",
                "N",
                "Contact force (x, y, z) on body 1 over a period of each special point.",
                &[told.len(), steps, 3],
                told.iter().flat_map(|p| p.cycle.force.iter().flatten().copied()).collect::<Vec<f64>>(),
            ),
            Table::new(
                "/cycles/period/nodes",
                "1",
                "Closed and sticking nodes over a period of each special point.",
                &[told.len(), steps, 2],
                told.iter().flat_map(|p| p.cycle.nodes.iter().flatten().map(|n| *n as i64)).collect::<Vec<i64>>(),
            ),
        ]
    }
}
