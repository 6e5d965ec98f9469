//! Points of a study that differ in where the bodies are touched: what the contact sees of both bodies is interpolated
//! over their profiles ([`PlaceTable`]), where that is as good as computing it anew.
//!
//! Each table begins with a few places of the points. Between two of them another one is computed, and kept; where the
//! table was wrong there, more follow between. Then some points, spread over the profile, are solved three times, and
//! the growth rates of the modes that are followed compared. Bodies are from the tables, computed at these places on
//! the meshes of the tables ([`ERROR`]), and computed as a sweep computes them, on meshes that follow the size of the
//! contact ([`SCATTER`]). All of it follows from the points of the study alone.

use super::point_model::{FollowedRate, StudyModel};
use super::uncertain::{Study, ALIKE};
use super::{build, goes_on, point_of};
use crate::body::hybrid::{Compact, LoadCircles};
use crate::body::mode_cache::CachedModes;
use crate::body::modes::Extent;
use crate::body::place_table::{ComputedPlace, PlaceTable};
use crate::body::Side;
use crate::case::meshes::Meshes;
use crate::case::placed_body::{are_sections, body_at, contact_seat, ContactSeat};
use crate::job::{fe_inputs, ContactPlaces, ContactWheels, Direction, Job, ModesExtent, StabilityState};
use crate::model::{PlacedModel, SharedModel};
use crate::parallel::World;
use crate::petsc::session::Petsc;
use crate::placement::Seat;
use crate::progress::Progress;
use crate::{Error, Result};
use faer::Mat;
use serde_json::{json, Value};

/// Fewer places than these are computed, each for itself.
const LEAST: usize = 96;
/// Places that a table begins with, those of a short profile, and those that it has at the most.
const FIRST: usize = 5;
const FIRST_OF_SHORT: usize = 2;
const MOST: usize = 40;
/// A profile is short if its places lie within this part of the radius of the circles.
const SHORT: f64 = 0.1;
/// Errors of a table between its places from which on it gets more of them, attempt after attempt.
const PRECISE: [f64; 3] = [2e-3, 5e-4, 1e-4];
/// A place lies between two others where it is this part of their distance away from both.
const BETWEEN: f64 = 0.2;
/// Contacts whose circles of the loads are those of a place, the part by which their range is widened, and the least
/// width of it over its middle.
const NEIGHBOURS: usize = 15;
const WIDENED: f64 = 0.03;
const NARROWEST: f64 = 0.1;
/// Radius that the sections are meshed for over the smallest one: on the mesh of a contact the compliance depends on
/// how the elements lie below the load, which no interpolation follows.
const FINER: f64 = 0.5;
/// Points that are solved to compare them, their least number, with which short profiles are content, and points that
/// are tried for each of them, since a point may have no state of rest.
const CHECKED: usize = 8;
const FEWEST: usize = 4;
const TRIED: usize = 3;
/// Differences of growth rates that are small enough, over the larger one of the growth rate and `SMALL`, 1/s: from
/// bodies computed on the same meshes, and on meshes of their own.
pub(super) const ERROR: f64 = 1e-4;
pub(super) const SCATTER: f64 = 5e-3;
const SMALL: f64 = 1.0;
/// Modal assurance criterion beyond that of a mode that is followed, below which it may be none in another computation.
const UNCERTAIN: f64 = 0.05;

/// Points by the bodies that they need, and the points.
type Groups = Vec<(Value, Vec<usize>)>;

/// Points on bodies that differ in where they are touched.
pub(super) struct PlaceFamily {
    /// The points, ascending.
    pub members: Vec<usize>,
    /// The same, place by place.
    pub groups: Groups,
}

/// Returns whether the bodies of a point may be interpolated: a wheel of a section on a rail with one contact, in
/// steady rolling.
fn is_placed(point: &Job) -> bool {
    let (Some(contact), Some(stability)) = (&point.contact, &point.analyses.stability) else { return false };
    let one =
        contact.further.is_empty() && contact.places != ContactPlaces::All && contact.wheels == ContactWheels::One;
    let rolls = stability.state() == StabilityState::Steady && stability.direction == Direction::Actual;
    let reduced = point.analyses.modes.is_some() && stability.full.is_none();
    one && rolls && reduced && point.is_loaded() && are_sections(point) && !measures_frequencies(point)
}

/// Returns whether measured frequencies take the place of computed ones, as they do in modes that are computed at a
/// place.
fn measures_frequencies(point: &Job) -> bool {
    let measured = point.all_bodies().into_iter().filter_map(|(_, body)| body.modes.as_ref());
    measured.flat_map(|modes| &modes.measured).any(|mode| mode.frequency.is_some())
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
pub(super) fn families(points: &[Option<Job>], groups: Groups) -> (Vec<PlaceFamily>, Groups) {
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
        families.push(PlaceFamily { members, groups });
    }
    (families, others)
}

/// Bodies at any place of a family, on every rank.
pub(super) struct PlacedBodies {
    shared: SharedModel,
    /// The rail and the wheel.
    tables: [PlaceTable; 2],
    /// Points that were compared.
    compared: usize,
    /// Largest difference of growth rates from bodies computed on the same meshes, and on meshes of their own.
    pub errors: [f64; 2],
}

impl PlacedBodies {
    /// Number of modes of the lower body.
    pub fn lower_modes(&self) -> usize {
        self.shared.lower_modes()
    }

    /// The bodies where a point touches them, on this rank alone.
    pub fn model(&mut self, point: &Job) -> Result<PlacedModel> {
        let (ContactSeat { seats, radius }, interface) = contact_seat(point)?;
        let [lower, upper] = [0, 1].map(|s| self.tables[s].interpolated(seats[s].y, radius, seats[s].tilt));
        self.shared.placed(point, interface, [&lower, &upper])
    }

    /// Line of the summary.
    pub fn in_words(&self) -> String {
        let [lower, upper] = [0, 1].map(|s| self.tables[s].places().len());
        let [error, scatter] = self.errors;
        format!(
            "interpolated between {lower} of the rail and {upper} of the wheel; growth rates at {} computed places \
             differ by up to {error:.1e} of them on the same meshes, by {scatter:.1e} on meshes of their own",
            self.compared
        )
    }
}

/// Data that places are computed from.
pub(super) struct PlaceInputs<'a, 'p> {
    pub petsc: &'p Petsc<'p>,
    pub meshes: &'a Meshes,
    pub points: &'a [Option<Job>],
}

/// Collective: the bodies of a `family`; none where interpolation is not good enough, and why.
pub(super) fn bodies(
    of: &PlaceInputs,
    family: &PlaceFamily,
    study: &Study,
    progress: &mut Progress,
) -> Result<std::result::Result<PlacedBodies, String>> {
    progress.stage("places of the bodies");
    let world = of.petsc.world();
    let first = point_of(of.points, family.members[0])?;
    let mut cached = Vec::new();
    let (shared, ..) = build(of.petsc, first, &mut cached, (of.meshes, &mut *progress))?;
    let mut job = first.clone();
    job.bodies.all_mut().for_each(|body| body.damping = Default::default());
    let sites = sites(world, of.points, &family.members)?;
    let found = cached.clone();
    let mesh = FINER * sites.iter().map(|s| s.radius).fold(f64::INFINITY, f64::min);
    let profile = |side: Side, progress: &mut Progress| -> Result<Profile> {
        let cached = found.get(side.index()).cloned().flatten();
        let making = Making { world, job: &job, side, cached, mesh };
        Profile::new(making, &sites, progress)
    };
    let mut profiles = match (profile(Side::Lower, progress), profile(Side::Upper, progress)) {
        (Ok(lower), Ok(upper)) => [lower, upper],
        (Err(e), _) | (_, Err(e)) => return declined(e),
    };
    let tables = profiles.each_ref().map(|p| p.table.clone());
    let mut made = PlacedBodies { shared, tables, compared: 0, errors: [f64::INFINITY; 2] };
    let checks = match checks(of, (family, &sites, study), (&mut made, &profiles, &mut cached), progress) {
        Ok(checks) if checks.len() >= FEWEST => checks,
        Ok(few) => {
            let n = few.len();
            return Ok(Err(format!(
                "computed each for itself: only {n} of the points to compare have a state of rest"
            )));
        }
        Err(e) => return declined(e),
    };
    made.compared = checks.len();
    for precise in PRECISE {
        for profile in &mut profiles {
            if let Err(e) = profile.refine(precise, progress) {
                return declined(e);
            }
        }
        made.tables = profiles.each_ref().map(|p| p.table.clone());
        let mut errors = [0.0f64; 2];
        for check in checks.iter().filter(|check| check.rank == world.rank) {
            let point = point_of(of.points, check.point)?;
            // A point that fails on the tables alone differs by more than anything.
            let rates = match study.growth_rates(StudyModel::Placed(&mut made), point) {
                Err(e) if !goes_on(&e) => return Err(e),
                rates => rates.unwrap_or_default(),
            };
            errors[0] = errors[0].max(difference(&check.same_mesh, &rates));
            errors[1] = errors[1].max(difference(&check.own_mesh, &rates));
        }
        made.errors = errors.map(|e| world.max(e));
        progress.note(made.in_words());
        if made.errors[0] <= ERROR && made.errors[1] <= SCATTER {
            return Ok(Ok(made));
        }
    }
    let [error, scatter] = made.errors;
    Ok(Err(format!(
        "computed each for itself: growth rates of interpolated ones differ by {error:.1e} of them on the same meshes, \
         by {scatter:.1e} on meshes of their own, expected {ERROR:.0e} and {SCATTER:.0e}"
    )))
}

/// A point that is solved to compare it.
struct Check {
    point: usize,
    /// Rank that has its growth rates.
    rank: usize,
    /// Growth rates with bodies computed at its place on the meshes of the tables.
    same_mesh: Vec<FollowedRate>,
    /// Growth rates with bodies computed for this point alone.
    own_mesh: Vec<FollowedRate>,
}

/// Collective: the points to compare, one of each part of the profile of the rail.
fn checks(
    of: &PlaceInputs,
    (family, sites, study): (&PlaceFamily, &[ContactSeat], &Study),
    (made, profiles, cached): (&mut PlacedBodies, &[Profile; 2], &mut Vec<Option<CachedModes>>),
    progress: &mut Progress,
) -> Result<Vec<Check>> {
    let world = of.petsc.world();
    let mut order: Vec<usize> = (0..sites.len()).collect();
    order.sort_by(|&a, &b| sites[a].seats[0].y.total_cmp(&sites[b].seats[0].y));
    let mut all = Vec::new();
    let wanted = if profiles.iter().all(Profile::is_short) { FEWEST } else { CHECKED };
    // Every other part of the profile first: what is content with few has them spread as well.
    for k in (0..CHECKED).step_by(2).chain((1..CHECKED).step_by(2)) {
        if all.len() == wanted {
            break;
        }
        progress.note(format!("place {} of {wanted} to compare", all.len() + 1));
        let middle = (2 * k + 1) * order.len() / (2 * CHECKED);
        let rank = all.len() % world.size;
        for &member in order.iter().skip(middle).take(TRIED) {
            let (i, site) = (family.members[member], sites[member]);
            let point = point_of(of.points, i)?;
            let solved = (|| {
                let (mut model, ..) = build(of.petsc, point, cached, (of.meshes, &mut *progress))?;
                let mut places = Vec::new();
                for (side, profile) in profiles.iter().enumerate() {
                    let computed = profile.making.computed((site.seats[side], profile.radii(site.seats[side].y)))?;
                    places.push(profile.table.only(&computed));
                }
                let rates = |model: StudyModel| match rank == world.rank {
                    true => study.growth_rates(model, point),
                    false => Ok(Vec::new()),
                };
                let own_mesh = world.agree(rates(StudyModel::Shared(&mut model)))?;
                made.tables.clone_from_slice(&places);
                let same_mesh = world.agree(rates(StudyModel::Placed(made)))?;
                Ok(Check { point: i, rank, same_mesh, own_mesh })
            })();
            match solved {
                Ok(check) => {
                    all.push(check);
                    break;
                }
                Err(e) if goes_on(&e) => {}
                Err(e) => return Err(e),
            }
        }
    }
    Ok(all)
}

/// The reason why places are not interpolated; what concerns the run as a whole stays an error.
fn declined<T>(error: Error) -> Result<std::result::Result<T, String>> {
    match error {
        Error::Defect(_) | Error::Io(_) | Error::Stopped(_) => Err(error),
        error => Ok(Err(format!("computed each for itself: {}", error.message()))),
    }
}

/// Largest difference of growth rates of modes, over their size; infinite where one has not the modes of the other, and
/// this is no question of the criterion by which they are followed.
fn difference(exact: &[FollowedRate], found: &[FollowedRate]) -> f64 {
    let is_in = |of: &[FollowedRate], mode: usize| of.iter().any(|f| f.mode == mode);
    let lost =
        |a: &[FollowedRate], b: &[FollowedRate]| a.iter().any(|f| f.agreement > ALIKE + UNCERTAIN && !is_in(b, f.mode));
    if exact.is_empty() || lost(exact, found) || lost(found, exact) {
        return f64::INFINITY;
    }
    let of = |a: &FollowedRate| {
        let other = found.iter().find(|b| b.mode == a.mode)?;
        Some((a.rate - other.rate).abs() / a.rate.abs().max(SMALL))
    };
    exact.iter().filter_map(of).fold(0.0, f64::max)
}

/// Collective: where the `members` of the points touch their bodies.
fn sites(world: &World, points: &[Option<Job>], members: &[usize]) -> Result<Vec<ContactSeat>> {
    let mine = &members[world.share(members.len())];
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
    /// Radius of the circle that all places are meshed for, m.
    mesh: f64,
}

impl Making<'_> {
    /// Collective: the body at a place with circles between two radii, m.
    fn computed(&self, (seat, [low, high]): (Seat, [f64; 2])) -> Result<ComputedPlace> {
        let radii = [low, 0.5 * (low + high), high];
        let body = body_at(self.world, self.job, self.side, (seat, radii[1]))?;
        let all = body.contact_compliances(LoadCircles { mesh: self.mesh, radii: &radii })?;
        let all = all.ok_or_else(|| Error::Job(format!("the {} body has no section", self.side.name())))?;
        let compact = |(radius, constant): (f64, Mat<f64>)| self.compact((seat, radius), constant);
        let compacts: Vec<Compact> = radii.into_iter().zip(all).map(compact).collect::<Result<_>>()?;
        let compacts = compacts.try_into().map_err(|_| Error::Defect("a place without three circles".into()))?;
        Ok(ComputedPlace { y: seat.y, tilt: seat.tilt, radii, compacts })
    }

    /// Collective: the body at a place with a circle of this radius, m, and its compliance there.
    fn compact(&self, at: (Seat, f64), constant: Mat<f64>) -> Result<Compact> {
        let missing = || Error::Defect("a body that is interpolated has no modes".into());
        let mut body = body_at(self.world, self.job, self.side, at)?;
        if let Some(cached) = &self.cached {
            body.reuse_modes(cached);
        }
        body.adopt_compliance(constant);
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
    /// Places of the points on it, ascending, with the radii of the circles of the loads there, m.
    seats: Vec<(Seat, f64)>,
    table: PlaceTable,
    /// Places that the table began with.
    first: usize,
}

impl<'a> Profile<'a> {
    /// Collective: the body at its first places.
    fn new(making: Making<'a>, sites: &[ContactSeat], progress: &mut Progress) -> Result<Self> {
        let mut seats: Vec<(Seat, f64)> = sites.iter().map(|s| (s.seats[making.side.index()], s.radius)).collect();
        seats.sort_by(|a, b| a.0.y.total_cmp(&b.0.y));
        let (from, to) = (seats[0].0, seats[seats.len() - 1].0.y);
        let reference = seats.iter().map(|s| s.1).sum::<f64>() / seats.len() as f64;
        let one = making.computed((from, range_about(&seats, from.y)))?;
        let mut table = PlaceTable::new(one.compacts[0].half_space, one.compacts[0].seen.ncols(), reference);
        table.insert(&one);
        let (mut last, length) = (from.y, to - from.y);
        let first = if length < SHORT * reference { FIRST_OF_SHORT } else { FIRST };
        for k in 1..first {
            let wanted = from.y + length * k as f64 / (first - 1) as f64;
            let far = |s: &(Seat, f64)| (s.0.y - wanted).abs();
            let Some(&(seat, _)) = seats.iter().min_by(|a, b| far(a).total_cmp(&far(b))) else { continue };
            if seat.y - last > 0.1 * length / first as f64 {
                progress.step("places", k, first);
                table.insert(&making.computed((seat, range_about(&seats, seat.y)))?);
                last = seat.y;
            }
        }
        Ok(Self { making, seats, table, first })
    }

    /// Returns whether all places lie near each other.
    fn is_short(&self) -> bool {
        self.first == FIRST_OF_SHORT
    }

    /// Radii that those of the contacts about a place `y`, m, lie between, m.
    fn radii(&self, y: f64) -> [f64; 2] {
        range_about(&self.seats, y)
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
            let computed = self.making.computed((seat.0, self.radii(seat.0.y)))?;
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

/// Range of the radii of the contacts at the `seats`, ascending, about a place `y`, m.
fn range_about(seats: &[(Seat, f64)], y: f64) -> [f64; 2] {
    let place = seats.partition_point(|s| s.0.y < y);
    let near = &seats[place.saturating_sub(NEIGHBOURS / 2)..(place + NEIGHBOURS / 2 + 1).min(seats.len())];
    let low = near.iter().map(|s| s.1).fold(f64::INFINITY, f64::min) * (1.0 - WIDENED);
    let high = near.iter().map(|s| s.1).fold(0.0, f64::max) * (1.0 + WIDENED);
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let half = half.max(0.5 * NARROWEST * middle);
    [middle - half, middle + half]
}
