//! A rail, as a job gives it.

use crate::body::rail::{RailOnTrack as RailBody, RailSpec};
use crate::body::rails_on_sleepers::RailsOnSleepers;
use crate::body::separate_bodies::{SeparateBodies, SeparateBody};
use crate::body::{ContactSpec, ElasticBody};
use crate::fem::ElasticMaterial;
use crate::job::{self, Extruded, Job, MeshSource, RailFile, RailSection};
use crate::mesh::msh::plane;
use crate::parallel::World;
use crate::summary::Summary;
use crate::swept::waves::RailDamping;
use crate::swept::BuiltRail;
use crate::swept::{
    AbsorbingEnds, Beam, DiscreteSupports, DrawnRail, DrawnSection, Path, PlacedRailSection, RailTrack, SleeperBar,
    SleeperLayer, TrackLayer,
};
use crate::{Error, Result};
use std::f64::consts::PI;
use std::rc::Rc;

/// Part by which the point receptance of the rail that is modelled may differ from that of an infinite one.
const OFF: f64 = 0.05;
/// Frequencies at which this is looked at, over the lowest that is asked for.
const LOOKED_AT: [f64; 7] = [1.0, 1.15, 1.3, 1.6, 2.0, 3.0, 5.0];
/// Orders of a beam for each metre: waves down to a quarter of a metre.
const ORDERS: f64 = 8.0;
/// Lengths that are tried, each so many times the one before, to say which would do.
const LONGER: f64 = 1.25;
const LONGEST: f64 = 120.0;

/// Part by which a rail may differ along itself from one without ends, for which it is told from where on it does
/// not; where that search begins, Hz, and the ratio of its steps.
const ENDLESS: f64 = 0.1;
const HIGHEST: f64 = 5000.0;
const NEXT: f64 = 1.01;

/// Largest angle between the contact's frame, which is that of the profiles, and the surface of the section, rad.
const ASKEW: f64 = 0.5;

/// Position of the contact on a rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RailContactPosition {
    /// To the right of the middle of the upright section, m.
    pub y: f64,
    /// Height over the middle of the head, m; none: that of the surface at y.
    pub z: Option<f64>,
    /// True if it is the right-hand rail: a drawing is of the left-hand one.
    pub right: bool,
    /// Angle of the contact's frame against the upright section, from y to z, rad; none: that of the surface.
    pub tilt: Option<f64>,
}

/// A contact on a rail.
#[derive(Debug, Clone)]
pub struct RailContact {
    /// Its place; none: where the job says.
    pub at: Option<RailContactPosition>,
    /// Lines of its grid along x and y, m; none where no analysis looks at the contact.
    pub lines: Option<[Vec<f64>; 2]>,
    /// Distance x along the rail from the first contact, m.
    pub along: f64,
}

/// The rail of a body.
pub fn extruded(body: &job::Body) -> Option<&Extruded> {
    match &body.mesh {
        Some(MeshSource::Extruded(extruded)) => Some(extruded),
        _ => None,
    }
}

/// Position of the contact without a placement.
fn given(extruded: &Extruded) -> RailContactPosition {
    RailContactPosition { y: extruded.contact_offset, z: None, right: false, tilt: None }
}

/// Its section, with the contact point at a place of its head.
pub(super) fn section(extruded: &Extruded, at: RailContactPosition) -> Result<PlacedRailSection> {
    let section = match (&extruded.section, extruded.section.built()) {
        (RailSection::File(file), _) => drawn(file, at).map(PlacedRailSection::DrawnSection),
        (_, Some(rail)) => built(rail, at).map(PlacedRailSection::Built),
        _ => Err(Error::Defect("a section of a rail that is neither built in nor drawn".into())),
    }?;
    let angle = section.contact().angle;
    match at.tilt {
        Some(tilt) if !((tilt - angle).abs() <= ASKEW) => Err(Error::Job(format!(
            "the contact on the rail: found the profile tilted by {:.1} degrees and the section by {:.1} \
             degrees there, expected at most {:.0} degrees \
             between them; give the section that the profile is of, or the profile of the section",
            tilt.to_degrees(),
            angle.to_degrees(),
            ASKEW.to_degrees()
        ))),
        _ => Ok(section),
    }
}

/// A built-in rail.
fn built(rail: &'static crate::rails::Rail, at: RailContactPosition) -> Result<BuiltRail> {
    match at.z {
        Some(z) => BuiltRail::near(rail, [at.y, z]),
        None => BuiltRail::new(rail, at.y),
    }
}

/// The drawing in a file, x across the track, towards its middle of the left-hand rail, and y up.
fn drawn(file: &RailFile, at: RailContactPosition) -> Result<DrawnRail> {
    let named = |e: Error| e.context(format!("section {}", file.path.display()));
    let drawing = plane::read(&file.path)?;
    let nodes = drawing.nodes.iter().map(|&[x, y]| [file.scale * y, file.scale * x]).collect();
    let drawn =
        DrawnSection::new(Path::Line(1.0), nodes, &drawing.faces, &drawing.curves, &file.running).map_err(named)?;
    let drawn = Rc::new(if at.right { drawn.mirrored() } else { drawn });
    match at.z {
        Some(z) => DrawnRail::near(drawn, &file.foot, [at.y, z]),
        None => DrawnRail::new(drawn, &file.foot, at.y),
    }
    .map_err(named)
}

/// An error where a rail cannot be touched.
pub(crate) fn touched(extruded: &Extruded, at: RailContactPosition) -> Result<()> {
    section(extruded, at).map(|_| ())
}

/// Heights of the surface over its tangent at the contact point, m, at the distances `across`, m, along the tangent.
pub fn heights(extruded: &Extruded, across: &[f64]) -> Result<Vec<f64>> {
    let section = section(extruded, given(extruded))?;
    Ok(across.iter().map(|&y| section.height(y)).collect())
}

/// Nodes and elements of its section, as the modes see it.
pub fn size(extruded: &Extruded) -> Result<[usize; 2]> {
    let section = section(extruded, given(extruded))?.for_modes()?;
    Ok([section.nodes.len(), section.elements.len()])
}

/// Area, mass, second moments and centroid of the rails of a job that are given by their sections, one line each.
pub fn measured(job: &Job) -> Result<Vec<String>> {
    let line = |name: &str, body: &job::Body, extruded: &Extruded| {
        let named = |e: Error| e.context(format!("bodies.{name}.mesh.extruded"));
        let measures = section(extruded, given(extruded)).and_then(|s| s.measures()).map_err(named)?;
        let [vertical, lateral] = measures.inertia.map(|i| 1e8 * i);
        Ok(format!(
            "body {name}: rail {}, {:.2} cm², {:.2} kg/m, second moments {vertical:.1} cm⁴ vertically and \
             {lateral:.1} cm⁴ \
             laterally, centroid {:.1} mm above the underside",
            extruded.section.built().map_or("of a drawing", |rail| rail.name),
            1e4 * measures.area,
            measures.area * body.elastic()?.density,
            1e3 * measures.centroid
        ))
    };
    let rails = job.bodies().into_iter().filter_map(|(name, body)| extruded(body).map(|rail| (name, body, rail)));
    rails.map(|(name, body, rail)| line(name, body, rail)).collect()
}

/// Track under a rail of the mass `mass`, kg/m, spread evenly.
pub(super) fn continuous_track(track: &job::Track, mass: f64) -> RailTrack {
    let layer = |of: &job::Layer, mass: f64| {
        let [vertical, lateral] = [of.vertical, of.lateral].map(|k| k / track.spacing);
        TrackLayer::with_loss([vertical, lateral, lateral], of.loss_factor, mass)
    };
    let sleeper = track.sleeper.as_ref().map(|s| {
        let mass = s.mass / track.spacing;
        SleeperLayer { mass, ballast: layer(&s.ballast, mass) }
    });
    RailTrack { pad: layer(&track.pad, mass), sleeper }
}

/// Discrete pads and sleepers of `laid` on a rail of the length `period`, m; none where they are spread evenly.
fn bays(track: &job::Track, laid: &RailTrack, period: f64) -> Option<DiscreteSupports> {
    let length = track.pad_length?;
    let count = (period / track.spacing).round() as usize;
    let (pad, sleeper) = (laid.pad, laid.sleeper);
    Some(DiscreteSupports {
        count,
        spacing: period / count.max(1) as f64,
        length,
        position: track.position,
        pad,
        sleeper,
        shared: track
            .sleeper
            .and_then(|s| s.both_rails)
            .map(|bar| SleeperBar { length: bar.length, rail_distance: bar.rail_distance }),
    })
}

/// The absorbing ends of a rail of the length `period`, m, and of a material with waves of compression of `speed`, m/s.
fn ends(track: &job::Track, period: f64, speed: f64) -> Option<AbsorbingEnds> {
    let job::Ends { length, damping, longitudinal } = track.ends;
    (length > 0.0 && (damping > 0.0 || longitudinal > 0.0)).then_some(AbsorbingEnds {
        period,
        length,
        damping,
        along: longitudinal * speed,
    })
}

/// A rail, and what beams tell of it.
struct Planned<'a> {
    making: RailSpec<'a>,
    beam: Beam,
    laid: RailTrack,
}

fn planned<'a>(
    world: &World,
    job: &Job,
    (name, body): (&str, &job::Body),
    contacts: &'a [RailContact],
) -> Result<Planned<'a>> {
    let missing = || Error::Defect("a rail is asked for of a body that is none".into());
    let extruded = extruded(body).ok_or_else(missing)?;
    let track = body.track.clone().unwrap_or_default();
    let m = body.elastic()?;
    let material = ElasticMaterial { young: m.young, poisson: m.poisson, density: m.density };
    let at = contacts.first().and_then(|c| c.at).unwrap_or_else(|| given(extruded));
    // A file is read by every rank, and may be there for some of them only.
    let section_at =
        |at: RailContactPosition| section(extruded, at).map_err(|e| e.context(format!("bodies.{name}.mesh.extruded")));
    let section = world.agree(section_at(at))?;
    let beam = |lateral| section.beam(material, lateral, track.loss_factor);
    let beams = [(0, beam(false)?), (2, beam(true)?)];
    let beam = beams[0].1;
    let laid = continuous_track(&track, beam.density * beam.area);
    let period = extruded.length;
    let ends = ends(&track, period, beam.speed());
    if let Some(lowest) = lowest(job) {
        let none = AbsorbingEnds { period, length: 0.5 * period, damping: 0.0, along: 0.0 };
        let whole = ends.unwrap_or(none);
        long_enough(&beams, &laid, whole, lowest)
            .map_err(|e| e.context(format!("bodies.{name}.mesh.extruded.length")))?;
    }
    let bays = bays(&track, &laid, period);
    let angle = section.contact().angle;
    let mut specs = Vec::new();
    for (number, contact) in contacts.iter().enumerate() {
        let Some([x, y]) = &contact.lines else { continue };
        let own = ContactSpec::own([x, y], at.tilt.unwrap_or(angle));
        specs.push(match contact.at.filter(|_| number > 0) {
            None => own,
            Some(there) => {
                let place = world.agree(section_at(there))?.contact();
                let tilt = there.tilt.unwrap_or(place.angle);
                ContactSpec { tilt, place: Some(place), along: contact.along, ..own }
            }
        });
    }
    let making = RailSpec {
        section,
        material,
        period,
        // Sleepers that stand apart are no part of the section.
        track: if bays.is_some() { RailTrack { sleeper: None, ..laid } } else { laid },
        even: laid,
        bays,
        damping: RailDamping { loss: track.loss_factor, ends },
        contacts: specs,
        tilt: at.tilt,
    };
    Ok(Planned { making, beam, laid })
}

/// The rail `name` with its contacts; its size and range of validity go to the summary.
pub(crate) fn build<'w>(
    (world, summary): (&'w World, &mut Summary),
    job: &Job,
    body: (&str, &job::Body),
    contacts: &[RailContact],
) -> Result<RailBody<'w>> {
    let rail = planned(world, job, body, contacts)?;
    if rail.making.bays.is_some_and(|bays| bays.shared.is_some()) {
        return Err(Error::Job(format!(
            "bodies.{}.track.sleeper.both_rails: only one wheel touches its rail, expected both; leave the key out for \
             a rail with half a sleeper of its own",
            body.0
        )));
    }
    told((world, summary), body.0, rail)
}

/// A rail; its size and range of validity go to the summary.
fn told<'w>((world, summary): (&'w World, &mut Summary), name: &str, rail: Planned) -> Result<RailBody<'w>> {
    let Planned { making, beam, laid } = rail;
    let dashpots = making.damping.ends.filter(|ends| ends.along > 0.0);
    let from = dashpots.map(|ends| endless_along(&beam, &laid, &ends));
    let rail = RailBody::new(world, name, making)?;
    let (unknowns, mass) = (rail.unknowns(), rail.mass());
    summary.line(format!("body {name}: rail, {unknowns} unknowns of each order, {mass:.2} kg/m"));
    if let Some(from) = from {
        let percent = 100.0 * ENDLESS;
        let on = match from {
            Some(from) => format!("above {from:.0} Hz"),
            None => format!("nowhere up to {HIGHEST:.0} Hz: see track.ends.longitudinal"),
        };
        let what = "longitudinal receptance of the rail within";
        summary.line(format!("body {}: {what} {percent:.0} % of the infinite rail {on}", name));
    }
    Ok(rail)
}

/// The rails of both sides with the contacts of each, the one of the first contact first, told in the summary; the
/// first contact of the second one is `ahead` of that of the first one along +x, m.
pub(crate) fn build_both<'w>(
    (world, summary): (&'w World, &mut Summary),
    job: &Job,
    body: (&str, &job::Body),
    (contacts, ahead): ([&[RailContact]; 2], f64),
) -> Result<Box<dyn ElasticBody + 'w>> {
    let right = |of: &[RailContact]| of.first().and_then(|c| c.at).is_some_and(|at| at.right);
    let names = contacts.map(|of| if right(of) { "right" } else { "left" });
    let [first, second] = [0, 1].map(|rail| planned(world, job, body, contacts[rail]));
    let [mut first, mut second] = [first?, second?];
    // Sleepers below both rails couple them; without these each rail is on even pads.
    let shared = first.making.bays.filter(|bays| bays.shared.is_some());
    if shared.is_some() {
        (first.making.bays, second.making.bays) = (None, None);
    } else if let Some(bays) = &mut second.making.bays {
        // Sleepers lie across the track.
        bays.position += ahead;
    }
    let what = if shared.is_some() { "on common sleepers" } else { "without coupling" };
    summary.line(format!("body {}: two rails {what}, {} and {}", body.0, names[0], names[1]));
    let one = told((world, summary), body.0, first)?;
    let other = RailBody::new(world, body.0, second.making)?;
    let named = |side: &str, rail: RailBody<'w>| SeparateBody {
        name: format!("{side} rail"),
        family: Some(side.into()),
        section: 0,
        body: rail,
    };
    let rails = SeparateBodies::new(world, body.0, vec![named(names[0], one), named(names[1], other)]);
    Ok(match shared {
        Some(sleepers) => Box::new(RailsOnSleepers::new(world, rails, sleepers, ahead)),
        None => Box::new(rails),
    })
}

/// The lowest frequency that a job asks for a motion of the rail at, Hz.
fn lowest(job: &Job) -> Option<f64> {
    let frequencies = job.analyses.receptance.as_ref()?.frequency.numbers().ok()?;
    frequencies.into_iter().filter(|f| *f > 0.0).min_by(f64::total_cmp)
}

/// Largest part by which the point receptances of beams like the rail are off those of infinite ones from the
/// frequency `lowest`, Hz, on.
fn off(beams: &[(usize, Beam)], track: &RailTrack, ends: &AbsorbingEnds, lowest: f64) -> f64 {
    let mut worst = 0.0_f64;
    for omega in LOOKED_AT.map(|part| 2.0 * PI * lowest * part) {
        for (direction, beam) in beams {
            let foundation = track.stiffness(omega, *direction);
            let infinite = beam.infinite(omega, foundation);
            let finite = beam.finite(omega, foundation, ends, (ORDERS * ends.period) as usize);
            worst = worst.max((finite / infinite - 1.0).norm());
        }
    }
    worst
}

/// The lowest frequency from which on the point receptance of a bar like the rail, along itself, is that of one
/// without ends within [`ENDLESS`], Hz; none where it is not even so at [`HIGHEST`]. The ends have dashpots.
fn endless_along(bar: &Beam, track: &RailTrack, ends: &AbsorbingEnds) -> Option<f64> {
    let off = |f: f64| {
        let omega = 2.0 * PI * f;
        let foundation = track.stiffness(omega, 1);
        (bar.finite_along(omega, foundation, ends) / bar.infinite_along(omega, foundation) - 1.0).norm()
    };
    let frequencies = std::iter::successors(Some(HIGHEST), |f| Some(f / NEXT)).take_while(|f| *f > 1.0);
    frequencies.take_while(|f| off(*f) <= ENDLESS).last()
}

/// The lowest frequency, Hz, from which on the rail of a body is one without ends along itself, as the summary tells
/// it; none of another body, of a rail without dashpots at its ends, and of one that never is.
///
/// # Errors
/// A section that cannot be read.
pub fn endless_from(body: &job::Body) -> Result<Option<f64>> {
    let Some(extruded) = extruded(body) else { return Ok(None) };
    let track = body.track.clone().unwrap_or_default();
    let m = body.elastic()?;
    let material = ElasticMaterial { young: m.young, poisson: m.poisson, density: m.density };
    let beam = section(extruded, given(extruded))?.beam(material, false, track.loss_factor)?;
    let laid = continuous_track(&track, beam.density * beam.area);
    let ends = ends(&track, extruded.length, beam.speed()).filter(|ends| ends.along > 0.0);
    Ok(ends.and_then(|ends| endless_along(&beam, &laid, &ends)))
}

/// An error that says how long a rail has to be if it is too short for the frequency `lowest`, Hz.
fn long_enough(beams: &[(usize, Beam)], track: &RailTrack, ends: AbsorbingEnds, lowest: f64) -> Result<()> {
    let found = off(beams, track, &ends, lowest);
    if found <= OFF {
        return Ok(());
    }
    let mut longer = ends;
    while longer.period < LONGEST {
        // To whole decimetres, as it is said.
        [&mut longer.period, &mut longer.length].into_iter().for_each(|l| *l = (10.0 * LONGER * *l).ceil() / 10.0);
        if off(beams, track, &longer, lowest) <= OFF {
            return Err(Error::Job(format!(
                "found {} m, too short for motions at {lowest} Hz: the receptance of a beam like the rail is \
                 {:.0} % off that of an infinite one; \
                 expected {:.1} m with track.ends.length {:.1} m, or higher frequencies",
                ends.period,
                100.0 * found,
                longer.period,
                longer.length
            )));
        }
    }
    Err(Error::Job(format!(
        "found {} m, too short for motions at {lowest} Hz: the receptance of a beam like the rail is {:.0} % \
         off that of an infinite one, and no length up to \
         {LONGEST} m with ends that grow alike will do; ask for higher frequencies, or change track.ends",
        ends.period,
        100.0 * found
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rails::R60E1;

    const STEEL: ElasticMaterial = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };

    fn beam(lateral: bool, loss: f64) -> Beam {
        BuiltRail::new(&R60E1, 0.0).unwrap().beam(STEEL, lateral, loss).unwrap()
    }

    fn found(track: &job::Track, period: f64, lowest: f64) -> (f64, Result<()>) {
        let beams = [0, 2].map(|direction| (direction, beam(direction == 2, track.loss_factor)));
        let laid = continuous_track(track, 60.2);
        let ends = ends(track, period, beams[0].1.speed()).unwrap();
        (off(&beams, &laid, &ends, lowest), long_enough(&beams, &laid, ends, lowest))
    }

    #[test]
    fn a_rail_that_is_too_short_is_told_how_long_it_has_to_be() {
        let usual = job::Track::default();
        let usual_ends = usual.ends;
        assert!(found(&usual, 14.0, 300.0).1.is_ok());
        let short = job::Track { ends: job::Ends { length: 2.0, ..usual_ends }, ..usual };
        let (off, error) = found(&short, 5.0, 300.0);
        let message = error.unwrap_err().to_string();
        assert!(off > OFF && message.contains("expected"), "{off} {message}");
        // What it says will do.
        let number = |before: &str| -> f64 {
            let rest = &message[message.find(before).unwrap() + before.len()..];
            rest[..rest.find(" m").unwrap()].parse().unwrap()
        };
        let long = job::Track { ends: job::Ends { length: number("track.ends.length "), ..usual_ends }, ..short };
        assert!(found(&long, number("expected "), 300.0).0 <= OFF, "{message}");
    }
    /// Waves along the rail are much longer; the summary tells the effect of the ends on them.
    #[test]
    fn longer_rails_are_endless_from_lower_on() {
        let usual = job::Track::default();
        let beam = beam(false, usual.loss_factor);
        let laid = continuous_track(&usual, 60.2);
        let from =
            |period: f64, track: &job::Track| endless_along(&beam, &laid, &ends(track, period, beam.speed()).unwrap());
        let [short, long] = [14.0, 42.0].map(|period| from(period, &usual).unwrap());
        assert!((250.0..300.0).contains(&short) && long < 0.85 * short, "{short} {long}");
        let reflecting = job::Track { ends: job::Ends { longitudinal: 0.5, ..usual.ends }, ..usual };
        assert_eq!(from(14.0, &reflecting), None);
    }
}
