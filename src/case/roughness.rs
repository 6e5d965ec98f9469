//! The rough surfaces of a job, on the grid of its contact.

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

/// The surfaces of `job`, whose contact has the grid (`x`, `y`), m; none of smooth bodies. For one rank: it reads
/// files.
pub fn surface(job: &Job, [x, y]: [&[f64]; 2]) -> Result<Option<RoughSurfaces>> {
    let (Some(contact), Some(wanted)) = (&job.contact, &job.analyses.transient) else { return Ok(None) };
    let Some(rough) = &contact.roughness else { return Ok(None) };
    let [first, last] = [x.first(), x.last()].map(|v| v.copied().unwrap_or_default());
    let way = Way { y, from: -last, to: contact.speed * wanted.duration - first };
    let mut parts = [Vec::new(), Vec::new()];
    for (side, (name, given)) in parts.iter_mut().zip(rough.bodies()) {
        let turn = job.circumference(name);
        for (i, part) in given.iter().enumerate() {
            let path = format!("contact.roughness.{name}.{i}");
            side.push(way.part(part, turn).map_err(|e| e.context(&path))?);
        }
    }
    Ok(Some(RoughSurfaces { speed: contact.speed, onset: rough.onset, parts }))
}

/// Checks that need no grid.
pub fn check(job: &Job) -> Result<()> {
    surface(job, [&[], &[]]).map(|_| ())
}

/// Columns, units, number and spacing of samples of the files of `job` as they were read, a line each.
///
/// # Errors
/// A file that cannot be read as heights.
pub fn described(job: &Job) -> Result<Vec<String>> {
    let rough = job.contact.as_ref().and_then(|c| c.roughness.as_ref()).filter(|_| job.analyses.transient.is_some());
    let parts = rough.iter().flat_map(|r| r.bodies()).flat_map(|(_, parts)| parts);
    let files = parts.filter_map(|part| match part {
        RoughnessPart::File(file) => Some(file),
        _ => None,
    });
    files.map(|f| Ok(read::read(&f.path, units(f))?.understood)).collect()
}

fn units(file: &job::RoughFile) -> Units {
    Units { height: file.unit, distance: file.distance_unit }
}

/// SHA-256 of a model that rolls on `surface`.
pub fn identity(model: String, surface: Option<&RoughSurfaces>) -> String {
    let Some(surface) = surface else { return model };
    let text = format!("{model}{:?}", surface.parts);
    Sha256::digest(text.as_bytes()).iter().map(|b| format!("{b:02x}")).collect()
}

/// The heights that pass the middle of the contact, over the run of `duration`, s; of an area those of the lateral
/// place nearest to y = 0.
pub fn tables(surface: &RoughSurfaces, y: &[f64], duration: f64) -> Vec<Table> {
    let middle = (0..y.len()).min_by(|&a, &b| y[a].abs().total_cmp(&y[b].abs())).unwrap_or(0);
    let way = surface.speed * duration;
    let count = ((way / SPACING).ceil() as usize).clamp(2, WRITTEN);
    let at = |i: usize| way * i as f64 / (count - 1) as f64;
    let height =
        |body: usize| -> Vec<f64> { (0..count).map(|i| surface.height(body, at(i) / surface.speed, middle)).collect() };
    let list = |name: &str, text: &str, values: Vec<f64>| Table::list(&format!("/roughness/{name}"), "m", text, values);
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
}

impl Way<'_> {
    /// `part` of a body that comes back after `turn`, m, if it is a wheel.
    fn part(&self, part: &RoughnessPart, turn: Option<f64>) -> Result<RoughnessFeature> {
        let shape = |shape: RoughnessShape, at: f64| Ok(RoughnessFeature::Shape { shape, at, period: turn });
        match part {
            RoughnessPart::Spectrum(s) => {
                Ok(RoughnessFeature::Lines(vec![line(s, s.length.or(turn).unwrap_or(LENGTH))?]))
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

/// A line by its spectrum, of the `length`, m.
fn line(s: &job::RoughSpectrum, length: f64) -> Result<RoughnessLine> {
    let bands: Vec<Band> = match &s.levels {
        RoughLevels::Named(job::RoughStandard::Iso3095) => spectrum::iso3095(),
        RoughLevels::Bands(pairs) => {
            pairs.iter().map(|[wavelength, level]| Band::about(*wavelength, *level)).collect::<Result<_>>()?
        }
    };
    let kept = bands.into_iter().filter(|b| b.wavelength() >= s.shortest);
    let bands: Vec<Band> = kept.map(|b| Band { level: b.level + s.raise, ..b }).collect();
    spectrum::line(&bands, length, u64::from(s.seed))
}
