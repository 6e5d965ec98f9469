//! Contacts over the radius of the curve: equilibria of the vehicle at some curvatures, and cubic functions of the
//! curvature between them (E. Catmull, R. Rom, in: Computer Aided Geometric Design, 1974).
//!
//! A branch along the radius keeps bodies and places of contact of the job; creepages, normal forces and rolling speeds
//! are those of the equilibrium at each radius.

use super::search::is_local;
use crate::case::placements;
use crate::job::{Contact, Creepage, Job};
use crate::parallel::World;
use crate::{Error, Result};

/// Equilibria over the range.
const NODES: usize = 33;
/// Way of a place of contact over the wheel's profile from one equilibrium to the next beyond which it jumps, m.
const JUMP: f64 = 3e-3;
/// Numbers of a contact between which cubic functions run: longitudinal and lateral creepage, spin (1/m), rolling speed
/// (m/s), normal force (N); and its place on the wheel's profile (m).
const NUMBERS: usize = 6;

/// Numbers of each contact at one curvature, or why there are none.
type Node = std::result::Result<Vec<[f64; NUMBERS]>, String>;

/// Contacts over the radius.
pub(super) struct CurveTable {
    /// First curvature, and the distance from one to the next, 1/m.
    first: f64,
    step: f64,
    nodes: Vec<Node>,
}

impl CurveTable {
    /// Collective: the contacts of `job` between two radii, m.
    pub(super) fn new(world: &World, job: &Job, [low, high]: [f64; 2]) -> Result<Self> {
        let first = 1.0 / high;
        let step = (1.0 / low - first) / (NODES - 1) as f64;
        let jobs: Vec<Job> = (0..NODES).map(|k| in_curve(job, 1.0 / (first + step * k as f64))).collect();
        let of = |found: Result<Option<Job>>| match found {
            Ok(job) => {
                Ok(Ok(job.iter().filter_map(|j| j.contact.as_ref()).flat_map(Contact::all).map(numbers).collect()))
            }
            Err(e) if is_local(&e) => Ok(Err(e.to_string())),
            Err(e) => Err(e),
        };
        let nodes = placements::all_filled(world, &jobs).into_iter().map(of).collect::<Result<_>>()?;
        Ok(Self { first, step, nodes })
    }

    /// `job` with its contacts as they are in a curve of this radius, m.
    pub(super) fn job_at(&self, job: &Job, radius: f64) -> Result<Job> {
        let refused = |why: String| Error::Job(format!("analyses.cycles, at curve.radius = {radius}: {why}"));
        let place = (1.0 / radius - self.first) / self.step;
        // Rounding may lead beyond the ends.
        let left = (place.max(0.0) as usize).min(NODES - 2);
        let part = place - left as f64;
        let known = |k: usize| self.nodes[k].as_ref().map_err(|why| refused(why.clone()));
        let ends = [known(left)?, known(left + 1)?];
        let mut other = job.clone();
        let Some(contact) = &mut other.contact else { return Err(Error::Defect("a curve without contact".into())) };
        let count = contact.all().count();
        if let Some(found) = ends.iter().find(|e| e.len() != count) {
            return Err(refused(format!(
                "the wheel touches at {} places near this radius, expected as many as in the job, {count}: the bodies \
                 are those of the job",
                found.len()
            )));
        }
        for number in 0..count {
            let [a, b] = ends.map(|e| e[number]);
            if (b[NUMBERS - 1] - a[NUMBERS - 1]).abs() > JUMP {
                return Err(refused(format!(
                    "the place of contact jumps from {:.1} mm to {:.1} mm of the wheel's profile near this radius",
                    1e3 * a[NUMBERS - 1],
                    1e3 * b[NUMBERS - 1]
                )));
            }
            // The slopes at the ends, in one step of the curvature: those of the chord over both sides.
            let beyond = |k: Option<usize>, near: [f64; NUMBERS]| {
                let found = self.nodes.get(k?)?.as_ref().ok().filter(|n| n.len() == count)?[number];
                Some(found).filter(|f| (f[NUMBERS - 1] - near[NUMBERS - 1]).abs() <= JUMP)
            };
            let (before, after) = (beyond(left.checked_sub(1), a), beyond(Some(left + 2), b));
            let of = |k: usize| {
                let chord = b[k] - a[k];
                let slope =
                    [before.map_or(chord, |f| 0.5 * (b[k] - f[k])), after.map_or(chord, |f| 0.5 * (f[k] - a[k]))];
                hermite([a[k], b[k]], slope, part)
            };
            let one = if number == 0 { &mut *contact } else { &mut contact.further[number - 1] };
            one.creepage = Creepage { longitudinal: of(0), lateral: of(1), spin: of(2) };
            (one.speed, one.normal_load) = (of(3), Some(of(4)));
        }
        Ok(other)
    }

    /// The table in a sentence.
    pub(super) fn text(&self) -> String {
        let radius = |k: usize| 1.0 / (self.first + self.step * k as f64);
        let failed = self.nodes.iter().filter(|n| n.is_err()).count();
        let without = if failed > 0 { format!(", {failed} of them without one") } else { String::new() };
        format!(
            "from {NODES} equilibria of the vehicle between {:.1} and {:.1} m{without}; bodies and places of contact \
             are those of the job",
            radius(NODES - 1),
            radius(0)
        )
    }
}

/// `job` in a curve of another radius, m, before its equilibrium is known.
fn in_curve(job: &Job, radius: f64) -> Job {
    let mut other = job.clone();
    other.sweep = None;
    if let Some(curve) = &mut other.curve {
        curve.radius = radius;
    }
    if let Some(contact) = &mut other.contact {
        contact.further.clear();
        contact.in_equilibrium = false;
        contact.placement.iter_mut().for_each(|p| p.speed = None);
    }
    other
}

fn numbers(contact: &Contact) -> [f64; NUMBERS] {
    let c = contact.creepage;
    let place = contact.placement.as_ref().and_then(|p| p.touch_near).unwrap_or(f64::NAN);
    [c.longitudinal, c.lateral, c.spin, contact.speed, contact.normal_load.unwrap_or(f64::NAN), place]
}

/// The cubic function with these values and slopes at 0 and 1.
fn hermite([a, b]: [f64; 2], slope: [f64; 2], t: f64) -> f64 {
    let u = 1.0 - t;
    a * u * u * (1.0 + 2.0 * t) + b * t * t * (3.0 - 2.0 * t) + slope[0] * t * u * u - slope[1] * t * t * u
}
