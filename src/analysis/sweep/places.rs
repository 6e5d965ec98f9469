//! Points of a study that differ in where the bodies are touched: what the contact sees of both bodies is interpolated
//! over their profiles ([`PlaceTable`]), where that is as good as computing it anew.
//!
//! Each table begins with a few places of the points. Between two of them another one is computed, and kept; where the
//! table was wrong there, more follow between. Then some points are computed as a whole and from the tables, and the
//! growth rates of the modes that are followed compared. All of it follows from the points of the study alone.

use super::point_model::PointModel;
use super::uncertain::Study;
use super::{build, point_of};
use crate::body::hybrid::Compact;
use crate::body::mode_cache::CachedModes;
use crate::body::modes::Extent;
use crate::body::place_table::{ComputedPlace, PlaceTable};
use crate::body::Side;
use crate::case::meshes::Meshes;
use crate::case::placed_body::{are_sections, body_at, contact_seat, ContactSeat};
use crate::job::{fe_inputs, ContactPlaces, Direction, Job, ModesExtent, StabilityState};
use crate::model::{PlacedModel, SharedModel};
use crate::parallel::World;
use crate::petsc::session::Petsc;
use crate::placement::Seat;
use crate::progress::Progress;
use crate::{Error, Result};
use serde_json::{json, Value};

/// Fewer places than these are computed, each for itself.
const LEAST: usize = 96;
/// Places that a table begins with, and those that it has at the most.
const FIRST: usize = 5;
const MOST: usize = 40;
/// Errors of a table between its places from which on it gets more of them, attempt after attempt.
const PRECISE: [f64; 3] = [2e-3, 5e-4, 1e-4];
/// A place lies between two others where it is this part of their distance away from both.
const BETWEEN: f64 = 0.2;
/// Radii of the circle of the loads with which a place is computed, over the mean one of so many contacts there.
const ABOUT: [f64; 2] = [0.9, 1.1];
const NEIGHBOURS: usize = 9;
/// Points that are computed as a whole, and the difference of growth rates that is small enough, over the larger one
/// of them and `SMALL`, 1/s.
const CHECKED: usize = 8;
pub(super) const AGREES: f64 = 1e-4;
const SMALL: f64 = 1.0;

/// Points by the bodies that they need, and the points.
type Groups = Vec<(Value, Vec<usize>)>;

/// Points on bodies that differ in where they are touched.
pub(super) struct Family {
    /// The points, ascending.
    pub members: Vec<usize>,
    /// The same, place by place.
    pub groups: Groups,
}

/// Returns whether the bodies of a point may be interpolated: a wheel of a section on a rail with one contact, in steady
/// rolling with a constant coefficient of friction.
fn is_placed(point: &Job) -> bool {
    let (Some(contact), Some(stability)) = (&point.contact, &point.analyses.stability) else { return false };
    let one = contact.further.is_empty() && contact.places != ContactPlaces::All;
    let rolls = stability.state() == StabilityState::Steady && stability.direction == Direction::Actual;
    let reduced = point.analyses.modes.is_some() && stability.full.is_none();
    one && rolls && reduced && contact.friction.is_constant() && point.is_loaded() && are_sections(point)
}

/// Inputs that points on the same bodies share wherever these are touched.
fn bodies_of(point: &Job) -> Option<String> {
    let placement = point.placement().filter(|_| is_placed(point))?;
    let mut inputs = fe_inputs(point);
    inputs["contact"]["placement"] = json!({ "side": placement.side, "radius": placement.radius });
    inputs["contact"]["load"] = Value::Null;
    Some(inputs.to_string())
}

/// The families among the `groups` of points with enough places, and the other groups.
pub(super) fn families(points: &[Option<Job>], groups: Groups) -> (Vec<Family>, Groups) {
    let mut found: Vec<(String, Groups)> = Vec::new();
    let mut others = Vec::new();
    for (inputs, members) in groups {
        let own = members.first().and_then(|&i| points[i].as_ref()).and_then(bodies_of);
        match own {
            None => others.push((inputs, members)),
            Some(own) => match found.iter_mut().find(|f| f.0 == own) {
                Some(family) => family.1.push((inputs, members)),
                None => found.push((own, vec![(inputs, members)])),
            },
        }
    }
    let mut families = Vec::new();
    for (_, groups) in found {
        if groups.len() < LEAST {
            others.extend(groups);
            continue;
        }
        let mut members: Vec<usize> = groups.iter().flat_map(|g| g.1.iter().copied()).collect();
        members.sort_unstable();
        families.push(Family { members, groups });
    }
    (families, others)
}

/// Bodies at any place of a family, on every rank.
pub(super) struct PlacedBodies {
    shared: SharedModel,
    /// The rail and the wheel.
    tables: [PlaceTable; 2],
    /// Largest difference of growth rates that was found.
    error: f64,
}

impl PlacedBodies {
    /// Number of modes of the lower body.
    pub fn lower_modes(&self) -> usize {
        self.shared.lower_modes()
    }

    /// The bodies where a point touches them, on this rank alone.
    pub fn model(&mut self, point: &Job) -> Result<PlacedModel> {
        let (ContactSeat { seats, radius }, interface) = contact_seat(point)?;
        let [lower, upper] = [0, 1].map(|s| self.tables[s].at(seats[s].y, radius, seats[s].tilt));
        self.shared.placed(point, interface, [&lower, &upper])
    }

    /// Line of the summary.
    pub fn in_words(&self) -> String {
        let [lower, upper] = [0, 1].map(|s| self.tables[s].places().len());
        format!(
            "interpolated between {lower} of the rail and {upper} of the wheel; growth rates at {CHECKED} computed ones \
             differ by up to {:.1e} of them",
            self.error
        )
    }
}

/// Data that places are computed from.
pub(super) struct Computing<'a, 'p> {
    pub petsc: &'p Petsc<'p>,
    pub meshes: &'a Meshes,
    pub points: &'a [Option<Job>],
}

/// Collective: the bodies of a `family`; none where interpolation is not good enough, and why.
pub(super) fn bodies(
    of: &Computing,
    family: &Family,
    study: &Study,
    progress: &mut Progress,
) -> Result<std::result::Result<PlacedBodies, String>> {
    progress.stage("places of the bodies");
    let world = of.petsc.world();
    let first = point_of(of.points, family.members[0])?;
    let mut cached = Vec::new();
    let (shared, ..) = build(of.petsc, first, &mut cached, (of.meshes, &mut *progress))?;
    let mut job = first.clone();
    for body in [&mut job.bodies.lower, &mut job.bodies.upper].into_iter().flatten() {
        body.damping = Default::default();
    }
    let sites = sites(world, of.points, &family.members)?;
    let found = cached.clone();
    let profile = |side: Side, progress: &mut Progress| -> Result<Profile> {
        let cached = found.get(side.index()).cloned().flatten();
        let making = Making { world, job: &job, side, cached };
        Profile::new(making, &sites, progress)
    };
    let mut profiles = match (profile(Side::Lower, progress), profile(Side::Upper, progress)) {
        (Ok(lower), Ok(upper)) => [lower, upper],
        (Err(e), _) | (_, Err(e)) => return declined(e),
    };
    let checked: Vec<usize> =
        (0..CHECKED).map(|k| family.members[(2 * k + 1) * family.members.len() / (2 * CHECKED)]).collect();
    let mut exact: Vec<Option<Vec<(usize, f64)>>> = vec![None; CHECKED];
    let mut made = PlacedBodies { shared, tables: profiles.each_ref().map(|p| p.table.clone()), error: f64::INFINITY };
    for precise in PRECISE {
        for profile in &mut profiles {
            if let Err(e) = profile.refine(precise, progress) {
                return declined(e);
            }
        }
        made.tables = profiles.each_ref().map(|p| p.table.clone());
        let mut worst = 0.0f64;
        for (k, &i) in checked.iter().enumerate() {
            let point = point_of(of.points, i)?;
            let mine = k % world.size == world.rank;
            if exact[k].is_none() {
                progress.note(format!("compared at {} of {CHECKED} places", k + 1));
                let (mut model, ..) = build(of.petsc, point, &mut cached, (of.meshes, &mut *progress))?;
                let rates =
                    if mine { study.growth_rates(PointModel::Shared(&mut model), point) } else { Ok(Vec::new()) };
                match world.agree(rates) {
                    Ok(rates) => exact[k] = Some(rates),
                    Err(e) => return declined(e),
                }
            }
            let rates = if mine { study.growth_rates(PointModel::Placed(&mut made), point) } else { Ok(Vec::new()) };
            let rates = match world.agree(rates) {
                Ok(rates) => rates,
                Err(e) => return declined(e),
            };
            worst = worst.max(difference(exact[k].as_deref().unwrap_or_default(), &rates));
        }
        made.error = world.max(worst);
        progress.note(made.in_words());
        if made.error <= AGREES {
            return Ok(Ok(made));
        }
    }
    Ok(Err(format!(
        "computed each for itself: growth rates of interpolated ones differ by {:.1e} of them, more than {AGREES:.0e}",
        made.error
    )))
}

/// The reason why places are not interpolated; what concerns the run as a whole stays an error.
fn declined<T>(error: Error) -> Result<std::result::Result<T, String>> {
    match error {
        Error::Defect(_) | Error::Io(_) | Error::Stopped(_) => Err(error),
        error => Ok(Err(format!("computed each for itself: {}", error.message()))),
    }
}

/// Largest difference of growth rates, 1/s, of modes, over their size; infinite where one has not the modes of the
/// other.
fn difference(exact: &[(usize, f64)], found: &[(usize, f64)]) -> f64 {
    if exact.len() != found.len() {
        return f64::INFINITY;
    }
    let of = |((a, x), (b, y)): (&(usize, f64), &(usize, f64))| match a == b {
        true => (x - y).abs() / x.abs().max(SMALL),
        false => f64::INFINITY,
    };
    exact.iter().zip(found).map(of).fold(0.0, f64::max)
}

/// Collective: where the `members` of the points touch their bodies.
fn sites(world: &World, points: &[Option<Job>], members: &[usize]) -> Result<Vec<ContactSeat>> {
    let (rank, size) = (world.rank, world.size);
    let mine = &members[rank * members.len() / size..(rank + 1) * members.len() / size];
    let of = |&i: &usize| -> Result<Vec<f64>> {
        let (ContactSeat { seats, radius }, _) = contact_seat(point_of(points, i)?)?;
        Ok(seats.iter().flat_map(|s| [s.y, s.z, s.tilt]).chain([radius]).collect())
    };
    let mine = world.agree(mine.iter().map(of).collect::<Result<Vec<_>>>())?.concat();
    let seat = |v: &[f64]| Seat { y: v[0], z: v[1], tilt: v[2] };
    let site = |v: &[f64]| ContactSeat { seats: [seat(&v[..3]), seat(&v[3..6])], radius: v[6] };
    Ok(world.all_gather(&mine).chunks_exact(7).map(site).collect())
}

/// Data from which one body is made.
struct Making<'a> {
    world: &'a World,
    job: &'a Job,
    side: Side,
    cached: Option<CachedModes>,
}

impl Making<'_> {
    /// Collective: the body at a place with circles of two radii about this one, m.
    fn computed(&self, (seat, radius): (Seat, f64)) -> Result<ComputedPlace> {
        let radii = ABOUT.map(|part| part * radius);
        let compacts = [self.compact(seat, radii[0])?, self.compact(seat, radii[1])?];
        Ok(ComputedPlace { y: seat.y, tilt: seat.tilt, radii, compacts })
    }

    /// Collective: the body at a place with a circle of this radius, m.
    fn compact(&self, seat: Seat, radius: f64) -> Result<Compact> {
        let missing = || Error::Defect("a body that is interpolated has no modes, or not few numbers".into());
        let mut body = body_at(self.world, self.job, self.side, (seat, radius))?;
        if let Some(cached) = &self.cached {
            body.take(cached);
        }
        body.factorise()?;
        let extent = match self.job.analyses.modes.as_ref().ok_or_else(missing)?.extent() {
            ModesExtent::Count(n) => Extent::Count(n),
            ModesExtent::MaxFrequency(f) => Extent::MaxFrequency(f),
        };
        body.modes(extent, &mut |_, _| {})?;
        body.compact()?.ok_or_else(missing)
    }
}

/// A body along its profile.
struct Profile<'a> {
    making: Making<'a>,
    /// Places of the points on it, ascending, with the mean radius of the circles of the loads there.
    seats: Vec<(Seat, f64)>,
    table: PlaceTable,
}

impl<'a> Profile<'a> {
    /// Collective: the body at its first places.
    fn new(making: Making<'a>, sites: &[ContactSeat], progress: &mut Progress) -> Result<Self> {
        let mut all: Vec<(Seat, f64)> = sites.iter().map(|s| (s.seats[making.side.index()], s.radius)).collect();
        all.sort_by(|a, b| a.0.y.total_cmp(&b.0.y));
        let mean = |k: usize| {
            let near = &all[k.saturating_sub(NEIGHBOURS / 2)..(k + NEIGHBOURS / 2 + 1).min(all.len())];
            near.iter().map(|s| s.1).sum::<f64>() / near.len() as f64
        };
        let seats: Vec<(Seat, f64)> = (0..all.len()).map(|k| (all[k].0, mean(k))).collect();
        let (from, to) = (seats[0], seats[seats.len() - 1].0.y);
        let one = making.computed(from)?;
        let mut table = PlaceTable::new(one.compacts[0].half_space, one.compacts[0].seen.ncols());
        table.insert(&one);
        let (mut last, length) = (from.0.y, to - from.0.y);
        for k in 1..FIRST {
            let wanted = from.0.y + length * k as f64 / (FIRST - 1) as f64;
            let far = |s: &(Seat, f64)| (s.0.y - wanted).abs();
            let Some(&seat) = seats.iter().min_by(|a, b| far(a).total_cmp(&far(b))) else { continue };
            if seat.0.y - last > 0.1 * length / FIRST as f64 {
                progress.step("places", k, FIRST);
                table.insert(&making.computed(seat)?);
                last = seat.0.y;
            }
        }
        Ok(Self { making, seats, table })
    }

    /// Collective: adds places until the table is wrong by less than `precise` at places between its own.
    fn refine(&mut self, precise: f64, progress: &mut Progress) -> Result<()> {
        let places = self.table.places();
        let mut open: Vec<[f64; 2]> = places.windows(2).map(|w| [w[0], w[1]]).collect();
        while let Some([from, to]) = open.pop() {
            let middle = 0.5 * (from + to);
            let far = |s: &(Seat, f64)| (s.0.y - middle).abs();
            let nearest = self.seats.iter().copied().min_by(|a, b| far(a).total_cmp(&far(b)));
            let Some(seat) = nearest.filter(|s| far(s) < (0.5 - BETWEEN) * (to - from)) else { continue };
            if self.table.places().len() >= MOST {
                break;
            }
            let computed = self.making.computed(seat)?;
            let error = self.table.error(&computed);
            self.table.insert(&computed);
            progress.note(format!(
                "{} at y = {:.3} mm: {error:.1e} off between {:.3} and {:.3} mm",
                self.making.side.name(),
                1e3 * computed.y,
                1e3 * from,
                1e3 * to
            ));
            if self.making.world.max(error) > precise {
                open.extend([[from, computed.y], [computed.y, to]]);
            }
        }
        Ok(())
    }
}
