//! A wheel on a rail by their profiles, as a job places them: the grid of the contact, the gap, the creepages.

use super::meshes::Meshes;
use super::positioned_mesh::{standing, AlongPath, PositionedMesh};
use super::rail;
use crate::body::half_space::HalfSpace;
use crate::body::Side;
use crate::contact::half_space_estimate::PatchEstimate;
use crate::contact::{ContactCreepage, SPIN_SPACINGS};
use crate::grid::{ContactGrid, Interface, Transfer};
use crate::job::{self, ContactPlaces, ContactWheels, Job, Load, MeshSource};
use crate::output::datasets;
use crate::output::Table;
use crate::placement::read::ProfileKind;
use crate::placement::{
    self, finer_grid_lines, fitted_grid_lines, rough_grid_lines, Creepages, Ellipse, Frame, Gap, HertzLoad,
    RollingMotion, Seat,
};
use crate::{Error, Result};

mod contact_sites;
mod friction_zones;
mod motions;
mod profiles;

pub(crate) use contact_sites::build;
pub(super) use contact_sites::on_rail;
pub(crate) use motions::filled;
pub(super) use motions::{motions, with_motions};
use profiles::unsmoothed;
pub(super) use profiles::{description, material, noise, profile};

/// By how much a grid grows whose border the contact may reach, and how often at the most.
const GROWTH: f64 = 1.3;
const GROWN: usize = 6;
/// Radius of a curve for which the summary says what it would change, m.
const SHARP: f64 = 150.0;
/// Distance of the places of a line that is drawn, m.
const DRAWN: f64 = 1e-3;

/// A wheel on its rail at first touch, with all that the contact needs of them.
pub struct PlacedContact {
    /// Side of the track.
    side: job::TrackSide,
    placed: placement::PlacedWheel,
    frame: Frame,
    ellipse: Ellipse,
    /// How the wheel rolls.
    motion: RollingMotion,
    creepages: Creepages,
    gap: Gap,
    notes: Vec<String>,
    /// Number of the zone of friction that holds it, in a job with zones: −1 outside all.
    zone: Option<i32>,
    /// Shift to the right, m, where it follows from a lateral force.
    shift: Option<f64>,
    /// Curvature of the track, 1/m, and yaw of the axle, rad.
    track: (f64, f64),
}

impl PlacedContact {
    /// The wheel of `job` on its rail, at its first contact. For one rank: it reads the files of the profiles.
    pub fn from_job(job: &Job) -> Result<Self> {
        let contact = job.contact.as_ref().ok_or_else(|| missing("a contact"))?;
        Self::at_contact(job, contact)
    }

    /// The same at a `contact` of the job.
    pub fn at_contact(job: &Job, contact: &job::Contact) -> Result<Self> {
        Self::resolve(job, contact).map_err(|e| match unsmoothed(job) {
            Some(hint) if e.message().starts_with("contact.placement") => e.with(hint),
            _ => e,
        })
    }

    /// The wheel of `job` at each of its contacts, or both wheels. For one rank.
    pub fn all(job: &Job) -> Result<Vec<Self>> {
        let mut all = Self::each(job)?;
        if job.contact.as_ref().is_some_and(|c| c.vertical_load.is_some()) {
            // One wheel comes down on all of them: those that do not touch first are open by their distance then.
            let first = all.iter().map(|one| one.placed.height()).fold(f64::INFINITY, f64::min);
            for one in &mut all {
                let open = (one.placed.height() - first) * one.frame.angle().cos();
                one.gap.gap.iter_mut().for_each(|gap| *gap += open);
            }
        }
        Ok(all)
    }

    /// The same, each as if it were alone at first touch.
    pub(crate) fn each(job: &Job) -> Result<Vec<Self>> {
        job.contact.iter().flat_map(job::Contact::all).map(|one| Self::at_contact(job, one)).collect()
    }

    fn resolve(job: &Job, contact: &job::Contact) -> Result<Self> {
        let given = contact.placement.as_ref().ok_or_else(|| missing("a placement"))?;
        let body = |of: &'_ Option<job::Body>| of.clone().ok_or_else(|| missing("a body"));
        let (lower, upper) = (&body(&job.bodies.lower)?, &body(&job.bodies.upper)?);
        let mut notes = Vec::new();
        let wheel = profile(upper, ProfileKind::Wheel, &mut notes)?;
        let rail = profile(lower, ProfileKind::Rail, &mut notes)?;
        let named = |e: Error| e.context("contact.placement");
        let placed = description(given).place(&wheel, &rail).map_err(named)?;
        let compliance = |b: &job::Body| -> Result<f64> {
            Ok(1.0 / HalfSpace { young: b.elastic()?.young, poisson: b.elastic()?.poisson }.plane())
        };
        let modulus = 1.0 / (compliance(lower)? + compliance(upper)?);
        let press = match contact.load() {
            Load::Normal(force) => HertzLoad::Force(force),
            Load::Approach(approach) => HertzLoad::Approach(approach),
        };
        let ellipse = placed.ellipse(modulus, press).map_err(named)?;
        let frame = placed.centred_frame(ellipse.approach).map_err(named)?;
        let motion = RollingMotion {
            speed: given.speed.unwrap_or(contact.speed),
            curvature: given.curvature,
            angular_speed: given.angular_speed,
            longitudinal: given.creepage.longitudinal,
            lateral: given.creepage.lateral,
            spin: given.creepage.spin,
        };
        let creepages = placed.creepages(&frame, &motion).map_err(named)?;
        let mut extent = placed.extent(&frame, &ellipse).map_err(named)?;
        // A grid stays where the angular speed is still to be found.
        let rolling = RollingMotion { angular_speed: None, longitudinal: Some(0.0), ..motion };
        let of_grid = match contact.torque {
            Some(_) => placed.creepages(&frame, &rolling).map_err(named)?,
            None => creepages,
        };
        let creepage =
            ContactCreepage { longitudinal: of_grid.longitudinal, lateral: of_grid.lateral, spin: of_grid.spin };
        let spacings = if creepage.is_ruled_by_spin(ellipse.semi_axes) { SPIN_SPACINGS } else { 0.0 };
        let several = job.contact.as_ref().is_some_and(|c| c.places == ContactPlaces::All && !c.further.is_empty());
        for _ in 0..GROWN {
            let [x, y] = if several { rough_grid_lines(extent) } else { finer_grid_lines(extent, spacings) };
            let mut gap = placed.gap(&frame, &x, &y).map_err(named)?;
            let beside = overlap(&gap, ellipse.approach);
            if beside == [false; 2] {
                if several {
                    let [x, y] = fitted_grid_lines(closed_range(&gap, modulus, &ellipse)?, spacings);
                    gap = placed.gap(&frame, &x, &y).map_err(named)?.up_to_neighbours();
                }
                let track = (given.curvature, given.yaw);
                let here = job::Contact { touch_angle: placed.touch().angle, ..contact.clone() };
                notes.extend(friction_zones::friction_text(&here));
                let zone = friction_zones::zone_number(&here);
                let (side, shift) = (given.side, contact.lateral_force.map(|_| given.lateral));
                return Ok(Self { side, placed, frame, ellipse, motion, creepages, gap, notes, zone, shift, track });
            }
            extent = [0, 1].map(|c| extent[c] * if beside[c] { GROWTH } else { 1.0 });
        }
        Err(Error::Job(format!(
            "contact.placement: wheel and rail lie near each other over more than {:.1} by {:.1} mm around the \
             point of contact: found no place where a grid could end, expected a contact of \
             finite size; move the wheel, or check the profiles",
            1e3 * extent[0],
            1e3 * extent[1]
        )))
    }

    /// Name of the wheel, of a job with contacts at both wheels.
    pub fn wheel_of(&self, job: &Job) -> Option<&'static str> {
        job.contact.as_ref().filter(|c| c.wheels == ContactWheels::Both)?;
        Some(match self.side {
            job::TrackSide::Left => "left-hand wheel",
            job::TrackSide::Right => "right-hand wheel",
        })
    }

    /// Nodes of the grid.
    pub fn nodes(&self) -> usize {
        self.gap.gap.len()
    }

    /// Longitudinal and lateral creepage, 1, spin, 1/m, rolling speed, m/s, and contact angle δ of the frame and at
    /// first touch, rad, positive where the rail falls to the right.
    pub fn motion(&self) -> [f64; 6] {
        self.motion_with(&self.creepages)
    }

    /// The same with these creepages.
    pub(super) fn motion_with(&self, c: &Creepages) -> [f64; 6] {
        [c.longitudinal, c.lateral, c.spin, c.speed, self.frame.angle(), self.placed.touch().angle]
    }

    /// The creepages at another angular speed of the wheel, rad/s.
    pub(super) fn at_angular_speed(&self, angular_speed: f64) -> Result<Creepages> {
        let motion = RollingMotion { angular_speed: Some(angular_speed), ..self.motion };
        self.placed.creepages(&self.frame, &motion).map_err(|e| e.context("contact.placement"))
    }

    /// ∂(V ξ, V η, V φ)/∂Ω, m, m and 1, of the motion of the wheel, also where creepages are given in its place.
    pub(super) fn slip_rate(&self) -> Result<[f64; 3]> {
        let slip = |angular_speed: f64| -> Result<[f64; 3]> {
            let own =
                RollingMotion { angular_speed: Some(angular_speed), ..RollingMotion::free_rolling(self.motion.speed) };
            let c = self.placed.creepages(&self.frame, &own).map_err(|e| e.context("contact.placement"))?;
            Ok([c.longitudinal, c.lateral, c.spin].map(|creepage| c.speed * creepage))
        };
        // It is linear in Ω.
        let (one, two) = (slip(1.0)?, slip(2.0)?);
        Ok([0, 1, 2].map(|k| two[k] - one[k]))
    }

    /// The grid with the gap.
    pub fn interface(&self) -> Result<Interface> {
        Interface::new(self.gap.x.clone(), self.gap.y.clone(), self.gap.gap.clone())
    }

    /// An error where one of the `closed` nodes lies beyond the end of a profile.
    pub fn refuse_edge(&self, closed: impl Fn(usize) -> bool) -> Result<()> {
        self.gap.refuse_edge(closed)
    }

    /// An error where a section of `job` cannot be touched where the wheel stands.
    pub fn refuse_sections(&self, job: &Job) -> Result<()> {
        let [lower, upper] = self.placed.seats(&self.frame)?;
        let track = self.side;
        for (name, body) in job.bodies() {
            let checked = match &body.mesh {
                Some(MeshSource::Extruded(rail)) => rail::touched(rail, on_rail(lower, track)),
                Some(MeshSource::Revolved(_)) => super::swept::touched(body, upper, track),
                _ => Ok(()),
            };
            checked.map_err(|e| e.context(format!("bodies.{name}")))?;
        }
        Ok(())
    }

    /// Lines of the grid along x and y, m.
    pub(crate) fn grid_lines(&self) -> [&[f64]; 2] {
        [&self.gap.x, &self.gap.y]
    }

    /// Position of the contact on the body `name`.
    pub(crate) fn seat(&self, name: &str) -> Result<Seat> {
        let seats = self.placed.seats(&self.frame).map_err(|e| e.context("contact.placement"))?;
        Ok(seats[Side::named(name)?.index()])
    }

    /// Place of this contact along the path of the body on a side, from that of the `first` contact of the wheel.
    pub(crate) fn along(&self, first: &Self, side: Side, radius: f64) -> AlongPath {
        match side {
            Side::Lower => AlongPath::Line { distance: first.frame.origin()[0] - self.frame.origin()[0] },
            Side::Upper => {
                let behind = first.placed.ahead_of_axle(&first.frame) - self.placed.ahead_of_axle(&self.frame);
                AlongPath::Axle { angle: behind / self.placed.touch().radius, radius }
            }
        }
    }

    /// The body `name` of a mesh file where it is touched by this contact of a wheel, with its `first` one.
    pub(crate) fn standing(
        &self,
        first: &Self,
        (job, meshes): (&Job, &Meshes),
        name: &str,
        body: &job::Body,
    ) -> Result<(PositionedMesh, AlongPath)> {
        let (Some(contact), Some(placement)) = (&job.contact, job.placement()) else {
            return Err(Error::Defect("a mesh is put on a placement of a job without one".into()));
        };
        let seat = self.seat(name)?;
        let meshed = meshes.mesh(job, name, body)?;
        let along = self.along(first, Side::named(name)?, placement.radius);
        let at = (seat, placement.side, along);
        let how = (contact.compliance, !contact.further.is_empty());
        let stands = standing(&meshed.mesh, at, self.grid_lines(), how, placement.radius);
        stands.map(|stands| (stands, along)).map_err(|e| e.context(format!("bodies.{name}.mesh")))
    }

    /// The grid of the body on a side, which its mesh meets by `transfer`, if it has one.
    fn grid(&self, side: Side, transfer: Option<Transfer>) -> ContactGrid {
        // The plane of the contact is where the wheel ends; the rail lies below it by the gap.
        let height = |gap: &f64| if side == Side::Lower { -gap } else { 0.0 };
        let z = self.gap.gap.iter().map(height).collect();
        ContactGrid { x: self.gap.x.clone(), y: self.gap.y.clone(), transfer, z }
    }

    /// The `contact` of a job with the creepages of this wheel.
    fn filled(
        contact: &job::Contact,
        [longitudinal, lateral, spin, speed, angle, touch_angle]: [f64; 6],
    ) -> job::Contact {
        let track =
            contact.placement.as_ref().map(|p| job::Placement { speed: p.speed.or(Some(contact.speed)), ..p.clone() });
        job::Contact {
            creepage: job::Creepage { longitudinal, lateral, spin },
            speed,
            angle,
            touch_angle,
            placement: track,
            ..contact.clone()
        }
    }

    /// Lines of the result, for the summary, one line each.
    pub fn lines(&self) -> Vec<String> {
        let touch = self.placed.touch();
        let c = &self.creepages;
        let curvatures = self.placed.curvatures();
        let [a, b] = self.ellipse.semi_axes;
        let mut lines = vec![
            format!(
                "wheel on rail: touch at y = {:.2} mm of the wheel's profile and {:.2} mm of the rail's, \
                 contact angle {:.2} mrad, rolling radius {:.3} mm",
                1e3 * touch.wheel,
                1e3 * touch.rail,
                1e3 * touch.angle,
                1e3 * touch.radius
            ),
            format!(
                "curvatures, 1/m: wheel {:.4} along and {:.4} across, rail {:.4} across; Hertz: {:.2} by {:.2} \
                 mm, {:.0} MPa, approach {:.2} µm",
                curvatures.wheel_rolling,
                curvatures.wheel_across,
                curvatures.rail_across,
                1e3 * a,
                1e3 * b,
                1e-6 * self.ellipse.pressure,
                1e6 * self.ellipse.approach
            ),
            format!(
                "creepages of rail over wheel: longitudinal {:.6}, lateral {:.6}, spin {:.5} 1/m at {:.4} m/s; \
                 frame tilted by {:.2} mrad, grid of {} x {} nodes",
                c.longitudinal,
                c.lateral,
                c.spin,
                c.speed,
                1e3 * self.frame.angle(),
                self.gap.x.len(),
                self.gap.y.len()
            ),
        ];
        lines.extend(self.straight());
        lines.extend(self.notes.iter().cloned());
        lines
    }

    /// Change that a curve would make in the creepages of a wheel on straight track, in words.
    fn straight(&self) -> Option<String> {
        let (curvature, yaw) = self.track;
        let across = self.frame.origin()[1];
        // ξ has −y/R, and a sharp curve is where an angle of attack of this size comes from.
        let (at, change) = (SHARP, across.abs() / SHARP);
        (curvature == 0.0 && yaw != 0.0).then(|| {
            format!(
                "these creepages are those of straight track at this yaw: in a curve of {at} m the longitudinal \
                 creepage of an inner wheel at this angular \
                 speed is {change:.4} less, of an outer one as much more, and free rolling of the axle takes \
                 part of it back (curve and vehicle in the job)"
            )
        })
    }

    /// Properties that make results doubtful.
    pub fn warnings(&self) -> Vec<String> {
        let others = self.placed.others(self.ellipse.approach).unwrap_or_default();
        let second = others.into_iter().filter(|t| t.separate);
        second
            .map(|t| {
                let place = format!(
                    "wheel and rail have a second contact at y = {:.2} mm of the wheel's \
                 profile",
                    1e3 * t.wheel
                );
                match t.gap < 0.0 {
                    true => format!("{place}, which carries load beside this one and is left out"),
                    false => format!(
                        "{place}, {:.1} µm open at first touch, within the approach of {:.1} µm: it would take \
                         a part of the load, and is left out",
                        1e6 * t.gap,
                        1e6 * self.ellipse.approach
                    ),
                }
            })
            .collect()
    }

    /// The group `/placement`, or that of a further contact with the `number` from 0.
    fn tables(&self, number: usize) -> Vec<Table> {
        let touch = self.placed.touch();
        let c = &self.creepages;
        datasets::placement::tables(
            number,
            &datasets::placement::PlacementResult {
                touch: [touch.wheel, touch.rail],
                origin: self.frame.origin(),
                angles: [touch.angle, self.frame.angle()],
                radius: touch.radius,
                curvatures: self.placed.curvatures().relative,
                semi_axes: self.ellipse.semi_axes,
                creepages: [c.longitudinal, c.lateral, c.spin],
                speed: c.speed,
                friction_zone: self.zone,
                lateral_shift: self.shift,
                lines: [self.placed.rail_line(DRAWN), self.placed.wheel_line(DRAWN)],
            },
        )
    }
}

/// Lines on all contacts `placed` of a job: the shift that follows from a lateral force, and zones that hold none.
pub(crate) fn common_lines(job: &Job, placed: &[PlacedContact]) -> Vec<String> {
    let force = job.contact.as_ref().and_then(|c| c.lateral_force);
    let shift = force.zip(placed.first().and_then(|one| one.shift));
    let shift = shift
        .map(|(force, shift)| format!("lateral force of {force} N on the wheel: a shift of {:.4} mm", 1e3 * shift));
    let torque = job.contact.as_ref().and_then(|c| c.torque);
    let torque = torque.map(|torque| {
        format!(
            "torque on the axle of {torque} N m: its angular speed and the longitudinal creepages follow from the \
             creep forces, and take the place of those above"
        )
    });
    shift.into_iter().chain(torque).chain(friction_zones::empty_zones(job, placed)).collect()
}

fn missing(what: &str) -> Error {
    Error::Defect(format!("a wheel is placed on its rail by a job without {what}"))
}

/// Returns whether undeformed bodies that have approached each other by `approach` (m) overlap on the border of the
/// grid, where x ends and where y ends: the contact is smaller than the overlap.
fn overlap(gap: &Gap, approach: f64) -> [bool; 2] {
    let (nx, ny) = (gap.x.len(), gap.y.len());
    let closed = |ix: usize, iy: usize| gap.gap[ix + nx * iy] < approach;
    [(0..ny).any(|iy| closed(0, iy) || closed(nx - 1, iy)), (0..nx).any(|ix| closed(ix, 0) || closed(ix, ny - 1))]
}

/// Ends along x and y, m, of the closed part of a contact under the force of the `ellipse`, N, by half-spaces with a
/// contact modulus, Pa: bodies that conform overlap over more than they touch.
fn closed_range(gap: &Gap, modulus: f64, ellipse: &Ellipse) -> Result<[[f64; 2]; 2]> {
    let grid = Interface::new(gap.x.clone(), gap.y.clone(), gap.gap.clone())?;
    let w = HalfSpace { young: modulus, poisson: 0.0 }.compliance(&gap.x, &gap.y)?;
    let range = PatchEstimate::new(w.as_ref(), &grid, ellipse.force)?.range;
    // To the first open lines.
    let more = [&gap.x, &gap.y].map(|lines| 0.5 * (lines[1] - lines[0]));
    Ok([0, 1].map(|c| [range[c][0] - more[c], range[c][1] + more[c]]))
}

/// On rank 0: the tables of the placement of `job` and warnings, after its contacts were found not to reach the end of
/// a profile. `pressure` is that of the nodes, those of all contacts one after the other.
pub(crate) fn tables(job: &Job, pressure: impl Fn(usize) -> f64) -> Result<(Vec<Table>, Vec<String>)> {
    let (mut all, mut warnings, mut first) = (Vec::new(), Vec::new(), 0);
    for (number, placed) in PlacedContact::all(job)?.iter().enumerate() {
        placed.refuse_edge(|node| pressure(first + node) > 0.0)?;
        let share = placed.gap.share_at_neighbour(|node| pressure(first + node));
        if share > 0.0 {
            warnings.push(format!(
                "contact {} ends where another contact of the wheel begins, with {:.1} % of its force on the last line \
                 of its grid: wheel and rail conform there, and the pressure near that line is too high",
                number + 1,
                100.0 * share
            ));
        }
        all.extend(placed.tables(number));
        first += placed.nodes();
    }
    Ok((all, warnings))
}
