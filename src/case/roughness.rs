//! The rough surfaces of a job, on the grid of its contact.

use crate::grid::Interface;
use crate::job::{self, Job, RoughLevels, RoughnessPart};
use crate::output::Table;
use crate::roughness::read::{self, Units};
use crate::roughness::spectrum::{self, Band};
use crate::roughness::{RoughSurfaces, RoughnessFeature, RoughnessLine, RoughnessShape};
use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::f64::consts::PI;

/// Length after which a line of a body that is no wheel repeats itself, m.
const LENGTH: f64 = 20.0;
/// Largest number of places at which the heights are written.
const WRITTEN: usize = 200_000;
/// Distance of these places, m, where there are not more.
const SPACING: f64 = 5e-4;

/// The surfaces at each contact of `job`, whose grids are those of `interface`; none of smooth bodies. For one rank: it
/// reads files.
pub fn surfaces(job: &Job, interface: &Interface) -> Result<Option<Vec<RoughSurfaces>>> {
    let grids: Vec<[&[f64]; 2]> = interface.patches.iter().map(|p| [&p.x[..], &p.y[..]]).collect();
    refuse_others(job, grids.len())?;
    on_grids(job, &grids)
}

/// Refuses the roughness of more or fewer contacts than there are.
pub(crate) fn refuse_others(job: &Job, contacts: usize) -> Result<()> {
    let given = job.contact.as_ref().and_then(|c| c.roughness.as_ref()).map_or(0, |rough| rough.further.len());
    if given == 0 || given + 1 == contacts {
        return Ok(());
    }
    Err(Error::Job(format!(
        "contact.roughness.further: found the roughness of {given} further contacts, expected that of {}, or none",
        contacts - 1
    )))
}

/// The same on grids (`x`, `y`), m.
fn on_grids(job: &Job, grids: &[[&[f64]; 2]]) -> Result<Option<Vec<RoughSurfaces>>> {
    let (Some(contact), Some(wanted)) = (&job.contact, &job.analyses.transient) else { return Ok(None) };
    let Some(rough) = &contact.roughness else { return Ok(None) };
    let way = |[x, _]: [&[f64]; 2], speed: f64| {
        let [first, last] = [x.first(), x.last()].map(|v| v.copied().unwrap_or_default());
        [-last, speed * wanted.duration - first]
    };
    let at = |(number, (one, grid)): (usize, (&job::Contact, &[&[f64]; 2]))| {
        let mut made =
            RoughSurfaces { speed: one.speed, onset: rough.onset, parts: Default::default(), ahead: [0.0; 2] };
        // The surface of a body with others around it passes one contact after the other.
        let passing = !contact.around.is_empty();
        let [lower, upper] = rough.bodies(number);
        let [first, _] = rough.bodies(0);
        for (side, body) in [if passing { first } else { lower }, upper].into_iter().enumerate() {
            let turn = match &one.body {
                Some(_) if body.name == "upper" => {
                    job.upper_at(one).and_then(|(_, body)| body.axle()).map(|radius| 2.0 * PI * radius)
                }
                _ => job.circumference(body.name),
            };
            let shared = side == 0 && passing;
            let ([from, to], other) = match shared {
                true => (way(grids[0], contact.speed), 0),
                false => (way(*grid, one.speed), if rough.further.is_empty() { number } else { 0 }),
            };
            if shared {
                made.ahead[side] = -turn.map_or(0.0, |turn| one.turned * turn / (2.0 * PI));
            }
            let way = Way { y: grid[1], from, to, other, shared };
            let part = |(i, part): (usize, &RoughnessPart)| {
                way.part(part, turn).map_err(|e| e.context(format!("{}.{i}", body.path)))
            };
            made.parts[side] = body.parts.iter().enumerate().map(part).collect::<Result<_>>()?;
        }
        Ok(made)
    };
    contact.all().zip(grids).enumerate().map(at).collect::<Result<Vec<_>>>().map(Some)
}

/// Checks that need no grid.
pub fn check(job: &Job) -> Result<()> {
    let grids = vec![[&[][..]; 2]; job.contact.as_ref().map_or(0, |contact| contact.all().count())];
    on_grids(job, &grids).map(|_| ())
}

/// Columns, units, number and spacing of samples of the files of `job` as they were read, a line each.
///
/// # Errors
/// A file that cannot be read as heights.
pub fn described(job: &Job) -> Result<Vec<String>> {
    let rough = job.contact.as_ref().and_then(|c| c.roughness.as_ref()).filter(|_| job.analyses.transient.is_some());
    let parts = rough.into_iter().flat_map(|r| r.all()).flat_map(|body| body.parts);
    let files = parts.filter_map(|part| match part {
        RoughnessPart::File(file) => Some(file),
        _ => None,
    });
    files.map(|f| Ok(read::read(&f.path, units(f))?.understood)).collect()
}

fn units(file: &job::RoughFile) -> Units {
    Units { height: file.unit, distance: file.distance_unit }
}

/// SHA-256 of a model that rolls on `surfaces`.
pub fn identity(model: String, surfaces: Option<&[RoughSurfaces]>) -> String {
    let Some(surfaces) = surfaces else { return model };
    let of = |one: &RoughSurfaces| match one.ahead {
        [0.0, 0.0] => format!("{:?}", one.parts),
        ahead => format!("{:?}{ahead:?}", one.parts),
    };
    let text = surfaces.iter().fold(model, |text, one| text + &of(one));
    Sha256::digest(text.as_bytes()).iter().map(|b| format!("{b:02x}")).collect()
}

/// The heights that pass the middle of the contact `number`, from 0, over the run of `duration`, s; of an area those of
/// the lateral place nearest to y = 0.
pub fn tables(number: usize, surface: &RoughSurfaces, y: &[f64], duration: f64) -> Vec<Table> {
    let group = if number == 0 { "/roughness".to_owned() } else { format!("/roughness_{}", number + 1) };
    let middle = (0..y.len()).min_by(|&a, &b| y[a].abs().total_cmp(&y[b].abs())).unwrap_or(0);
    let way = surface.speed * duration;
    let count = ((way / SPACING).ceil() as usize).clamp(2, WRITTEN);
    let at = |i: usize| way * i as f64 / (count - 1) as f64;
    let height =
        |body: usize| -> Vec<f64> { (0..count).map(|i| surface.height(body, at(i) / surface.speed, middle)).collect() };
    let list = |name: &str, text: &str, values: Vec<f64>| Table::list(&format!("{group}/{name}"), "m", text, values);
    vec![
        list("way", "Way rolled, V t.", (0..count).map(at).collect()),
        list("lower", "Height of the lower body's surface that passes the middle of the contact then.", height(0)),
        list("upper", "The same of the upper body.", height(1)),
    ]
}

/// The ways that pass the contact during the run, and its lateral places.
struct Way<'a> {
    y: &'a [f64],
    /// m.
    from: f64,
    /// m.
    to: f64,
    /// Number of the contact, where it has other lines by the same spectrum than the first one, from 0.
    other: usize,
    /// True if the surface passes several contacts, one after the other.
    shared: bool,
}

impl Way<'_> {
    /// `part` of a body that comes back after `turn`, m, if it is a wheel.
    fn part(&self, part: &RoughnessPart, turn: Option<f64>) -> Result<RoughnessFeature> {
        let shape = |shape: RoughnessShape, at: f64| Ok(RoughnessFeature::Shape { shape, at, period: turn });
        match part {
            RoughnessPart::Spectrum(s) => {
                Ok(RoughnessFeature::Lines(vec![line(s, s.length.or(turn).unwrap_or(LENGTH), self.other)?]))
            }
            RoughnessPart::File(file) => Ok(RoughnessFeature::Lines(self.measured(file, turn)?)),
            // Waves need not fit a wheel: they are a test of what the contact does.
            RoughnessPart::Wave(w) => {
                let shape = RoughnessShape::Wave { length: w.wavelength, height: w.amplitude };
                Ok(RoughnessFeature::Shape { shape, at: w.at, period: None })
            }
            RoughnessPart::Flat(f) => {
                let chord = turn.map_or(0.0, |t| RoughnessShape::chord(f.length, t / (2.0 * PI)));
                let length = f.length;
                match f.rounded {
                    true => shape(RoughnessShape::RoundedFlat { length, depth: f.depth.unwrap_or(0.5 * chord) }, f.at),
                    false => shape(RoughnessShape::Flat { length, depth: f.depth.unwrap_or(chord) }, f.at),
                }
            }
            RoughnessPart::Joint(j) => shape(RoughnessShape::Joint { length: j.length, depth: j.depth }, j.at),
            RoughnessPart::Step(s) => shape(RoughnessShape::Step { length: s.length, height: s.height }, s.at),
        }
    }

    /// The lines of a `file`.
    fn measured(&self, file: &job::RoughFile, turn: Option<f64>) -> Result<Vec<RoughnessLine>> {
        let measured = read::read(&file.path, units(file))?;
        let (name, length) = (file.path.display(), measured.length());
        // The first sample comes once more at the end of a turn, a step after the last one.
        let step = length / (measured.at.len() - 1) as f64;
        let period = file.period.or(turn.filter(|t| length + 1.5 * step >= *t));
        if let Some(period) = period.filter(|p| length + 1.5 * step < *p) {
            return Err(Error::Input(format!(
                "{name}: found {length:.4} m, expected as much as what repeats itself, file.period, {period:.4} \
                 m; give a shorter period, or a longer file"
            )));
        }
        if period.is_none() && self.shared {
            return Err(Error::Input(format!(
                "{name}: found {length:.4} m that do not repeat themselves, expected the whole surface of a body that \
                 several others stand around; give a file as long as its circumference{}, or file.period",
                turn.map_or(String::new(), |t| format!(", {t:.4} m"))
            )));
        }
        if period.is_none() && length < self.to - self.from {
            let turn = turn.map_or(String::new(), |t| format!(" (the wheel's circumference is {t:.4} m)"));
            return Err(Error::Input(format!(
                "{name}: found {length:.4} m, expected the {:.4} m that pass the contact in this run; give a \
                 longer file or a shorter analyses.transient.duration, or say in file.period \
                 after which way it repeats itself{turn}",
                self.to - self.from
            )));
        }
        measured.lines(self.y, period, self.from)
    }
}

/// A line by its spectrum, of the `length`, m; each `other` contact has one of its own.
fn line(s: &job::RoughSpectrum, length: f64, other: usize) -> Result<RoughnessLine> {
    let bands: Vec<Band> = match &s.levels {
        RoughLevels::Named(job::RoughStandard::Iso3095) => spectrum::iso3095(),
        RoughLevels::Bands(pairs) => {
            pairs.iter().map(|[wavelength, level]| Band::about(*wavelength, *level)).collect::<Result<_>>()?
        }
    };
    let kept = bands.into_iter().filter(|b| b.wavelength() >= s.shortest);
    let bands: Vec<Band> = kept.map(|b| Band { level: b.level + s.raise, ..b }).collect();
    spectrum::line(&bands, length, u64::from(s.seed) + ((other as u64) << 32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::example;

    const ROUGH: &str = r#"contact.roughness={"lower": [{"spectrum": {"levels": "ISO3095", "seed": 7}}],
        "upper": [{"wave": {"wavelength": 0.05, "amplitude": 1e-5}}]}"#;
    const TRANSIENT: &str = r#"analyses.transient={"duration": 0.01, "step": 1e-5}"#;
    const GRID: [[&[f64]; 2]; 2] = [[&[-1e-3, 0.0, 1e-3], &[0.0]]; 2];

    fn heights(surface: &RoughSurfaces, body: usize) -> Vec<f64> {
        (0..20).map(|k| surface.height(body, 0.03 + 1e-4 * f64::from(k), 0)).collect()
    }

    fn with_two(mut job: Job) -> Job {
        let contact = job.contact.as_mut().unwrap();
        contact.further = vec![contact.clone()];
        job
    }

    /// A spectrum gives each contact a line of its own; the first one has that of a single contact, and waves are the
    /// same everywhere.
    #[test]
    fn contacts_have_lines_of_their_own_by_one_spectrum() {
        let job = example::wheel_on_rail(&[ROUGH, TRANSIENT]);
        let alone = on_grids(&job, &GRID[..1]).unwrap().unwrap();
        let both = on_grids(&with_two(job), &GRID).unwrap().unwrap();
        assert_eq!(both[0], alone[0]);
        let [first, second] = [&both[0], &both[1]].map(|surface| heights(surface, 0));
        let size = |v: &[f64]| v.iter().map(|h| h * h).sum::<f64>().sqrt();
        let apart: Vec<f64> = first.iter().zip(&second).map(|(a, b)| a - b).collect();
        assert!(size(&apart) > 0.1 * size(&first), "{first:?} {second:?}");
        assert_eq!(heights(&both[0], 1), heights(&both[1], 1));
    }

    /// Further contacts have the roughness that is given for them; a list too many is refused.
    #[test]
    fn further_contacts_have_the_roughness_that_is_given() {
        let own = r#"{"upper": [{"wave": {"wavelength": 0.03, "amplitude": 2e-5}}]}"#;
        let mut job = with_two(example::wheel_on_rail(&[ROUGH, TRANSIENT]));
        let rough = job.contact.as_mut().and_then(|contact| contact.roughness.as_mut()).unwrap();
        rough.further = vec![serde_json::from_str(own).unwrap()];
        let both = on_grids(&job, &GRID).unwrap().unwrap();
        assert!(heights(&both[0], 0).iter().any(|h| *h != 0.0) && heights(&both[1], 0).iter().all(|h| *h == 0.0));
        let most = |surface| heights(surface, 1).iter().fold(0.0, |m: f64, h| m.max(h.abs()));
        assert!(most(&both[0]) <= 1e-5 && (1e-5..=2e-5).contains(&most(&both[1])));
        assert!(refuse_others(&job, 2).is_ok());
        let text = refuse_others(&job, 1).unwrap_err().to_string();
        assert!(text.contains("contact.roughness.further: found the roughness of 1 further contacts"), "{text}");
    }
}
