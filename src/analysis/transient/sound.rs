//! Sound power of the bodies, from the modal amplitudes that the segments keep.

use super::Inputs;
use crate::analysis::radiation::{self, bands_within, Channels, RadiationInput};
use crate::analysis::run::Run;
use crate::body::Side;
use crate::case::rail::extruded;
use crate::job::{self, Job, SoundPower};
use crate::output::datasets::record::{group, SOUND};
use crate::output::{Entry, Segments, Table};
use crate::parallel::World;
use crate::progress::Progress;
use crate::sound::bands::resolving_time;
use crate::sound::{level, pressure_level, Air, Bands, PowerSpectrum, Radiation, Welch};
use crate::swept::FORCES;
use crate::{Error, Result};
use num_complex::Complex64;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::f64::consts::PI;

const KEY: &str = "analyses.transient.sound_power";

/// Requested sound with defaults filled in.
pub struct Sound<'a> {
    wanted: &'a SoundPower,
    bands: Bands,
    air: Air,
    /// Steps between two samples.
    stride: u64,
    /// Time between them, s.
    interval: f64,
    /// Number of contacts.
    contacts: usize,
    /// The radiation of the bodies' modes, by their index in `BuiltBodies::unique`; on rank 0.
    given: BTreeMap<usize, RadiationInput>,
}

/// Checks that need no mesh: a run too short for the lowest third octave.
pub fn check(wanted: &job::Transient) -> Result<()> {
    let Some(sound) = &wanted.sound_power else { return Ok(()) };
    let lowest = Bands::spanning(sound.min_frequency, sound.min_frequency);
    // A few samples are lost at the ends of the record.
    let sample = wanted.step.max(1.0 / (radiation::SAMPLES * lowest.highest()));
    let needed = resolving_time(sound.min_frequency) + 4.0 * sample;
    let there = wanted.duration - begin(wanted, sound);
    if there < needed {
        return Err(Error::Job(format!(
            "analyses.transient.sound_power: the mean is taken from {} s to {} s, over {there:.4} s, but the \
             third octave of {} Hz can be \
             told from its neighbours after {needed:.4} s; give an earlier `from`, a longer `duration` or a \
             higher `min_frequency`",
            begin(wanted, sound),
            wanted.duration,
            lowest.nominal()[0]
        )));
    }
    Ok(())
}

/// Time from which the mean is taken, s.
fn begin(wanted: &job::Transient, sound: &SoundPower) -> f64 {
    sound.from.unwrap_or(0.5 * wanted.duration)
}

impl<'a> Sound<'a> {
    /// How often the amplitudes are needed in a run with the time step `step` (s), without the radiation.
    fn of(wanted: &'a SoundPower, bands: Bands, (step, contacts): (f64, usize)) -> Self {
        let stride = radiation::stride(bands, step);
        let interval = stride as f64 * step;
        Self { wanted, bands, air: radiation::air(wanted), stride, interval, contacts, given: BTreeMap::new() }
    }

    /// Collective: the bands that the modes allow, how often the amplitudes are needed, and how the modes radiate. A
    /// run that is continued takes the latter from its first segment: mode shapes are not the same to the last bit
    /// when computed again.
    pub fn new(world: &World, inputs: &Inputs<'a>, wanted: &'a SoundPower, progress: &mut Progress) -> Result<Self> {
        if !inputs.shapes && !inputs.options.resume {
            return Err(Error::Job(format!(
                "{KEY}: with --reuse there are no mode shapes of the bodies; leave the sound out, or run \
                 without --reuse"
            )));
        }
        let places = inputs.places.iter().filter(|p| wanted.bodies.iter().any(|&b| b.name() == p.0));
        let highest = |b: usize| inputs.modes[b].omega.last().map_or(0.0, |w| w / (2.0 * PI));
        let reach = places.map(|p| highest(p.1)).fold(f64::INFINITY, f64::min);
        let contacts = inputs.model.on_root().map_or(0, |root| root.interface.patches.len() as u64);
        let contacts = world.broadcast(vec![contacts])[0] as usize;
        let mut sound = Self::of(wanted, bands_within(KEY, wanted, reach)?, (inputs.wanted.step, contacts));
        progress.stage("radiation of sound");
        match inputs.options.resume {
            true => drop(world.on_root(|| sound.restore(inputs))?),
            false => sound.radiate(world, inputs)?,
        }
        Ok(sound)
    }

    /// Collective: how the modes radiate.
    fn radiate(&mut self, world: &World, inputs: &Inputs<'_>) -> Result<()> {
        for b in self.bodies(inputs) {
            self.given.insert(b, RadiationInput::new(world, inputs.bodies, b, (self.bands, self.air))?);
        }
        Ok(())
    }

    /// The bodies whose sound is wanted, by their index in `BuiltBodies::unique`.
    fn bodies(&self, inputs: &Inputs<'_>) -> BTreeSet<usize> {
        inputs.places.iter().filter(|p| self.wants(p.0)).map(|p| p.1).collect()
    }

    fn wants(&self, place: &str) -> bool {
        self.wanted.bodies.iter().any(|&b| b.name() == place)
    }

    /// The radiation as tables of the first segment.
    pub fn tables(&self) -> Vec<Table> {
        let table = |b: usize, name: &str, units: &str, text: &str, values: &[f64]| {
            Table::list(&format!("/checkpoint/sound/{b}/{name}"), units, text, values)
        };
        let of = |(&b, given): (&usize, &RadiationInput)| {
            let text = "Radiation resistances of the modes at these frequencies.";
            [
                table(b, "frequency", "Hz", "Frequencies at which the radiation is known.", &given.grid),
                table(b, "resistance", "N s/m/kg", text, &given.resistances),
                table(b, "plane", "N s/m/kg", "Radiation resistances of plane waves.", &given.plane),
            ]
        };
        self.given.iter().flat_map(of).collect()
    }

    /// On rank 0: takes the radiation from the first segment.
    fn restore(&mut self, inputs: &Inputs<'_>) -> Result<()> {
        let file = inputs.segments()?.open_first()?;
        for b in self.bodies(inputs) {
            let list = |name: &str| file.numbers(&format!("/checkpoint/sound/{b}/{name}")).map(|(_, v)| v);
            let (grid, resistances, plane) = (list("frequency")?, list("resistance")?, list("plane")?);
            // A run that is continued has no bodies.
            let rail = inputs.places.iter().any(|p| p.1 == b && is_rail(inputs.job, p.0));
            let m = if rail { FORCES * self.contacts } else { inputs.modes[b].omega.len() };
            // What forces radiate has a phase between them, and depends on the frequency even where each radiates as
            // a plane wave.
            let (each, planes) = if rail { (2 * m * m, grid.len()) } else { (m * m, 1) };
            // Of the same bands, whose ends are the first and the last frequency.
            let ends = [(grid.first(), self.bands.lowest()), (grid.last(), self.bands.highest())];
            let same = ends.into_iter().all(|(found, end)| found.is_some_and(|f| (f / end - 1.0).abs() < 1e-9));
            if !same || grid.len() < 2 || plane.len() != planes * each || resistances.len() != grid.len() * each {
                let name = file.path().display();
                return Err(Error::Input(format!("--resume: {name}: it has the radiation of other modes or bands")));
            }
            self.given.insert(b, RadiationInput { grid, resistances, plane });
        }
        Ok(())
    }

    /// The amplitudes are needed every so many steps.
    pub fn stride(&self) -> u64 {
        self.stride
    }

    /// Collective: spectra and what follows from them.
    pub fn write(&self, run: &mut Run, inputs: &Inputs<'_>) -> Result<()> {
        let world = run.world();
        let mut radiation: BTreeMap<usize, Radiation> = BTreeMap::new();
        let mut parts = Vec::new();
        let mut first = 0;
        let all = inputs.places.iter().map(|p| inputs.modes[p.1].omega.len()).sum();
        for &(name, body) in inputs.places {
            let m = inputs.modes[body].omega.len();
            let side = Side::named(name)?;
            let contacts = is_rail(inputs.job, name).then_some(self.contacts);
            let channels = Channels::new(contacts, side, (first..first + m, all));
            if let Some(given) = self.given.get(&body) {
                radiation.insert(body, given.within(channels.columns.len(), self.bands));
            }
            if self.wants(name) {
                parts.push((name, body, channels));
            }
            first += m;
        }
        let tables = world.on_root(|| {
            let welch = Welch::new(1.0 / self.interval, resolving_time(self.wanted.min_frequency));
            let mut powers = Vec::new();
            for (_, body, _) in &parts {
                let radiation = radiation.get(body).ok_or_else(|| Error::Defect("no radiation of a body".into()))?;
                powers.push(PowerSpectrum::new(radiation, welch.spacing()));
            }
            let forces = parts.iter().any(|p| p.2.are_forces()).then_some(inputs.wanted.step);
            let pieces =
                self.spectra((begin(inputs.wanted, self.wanted), forces), inputs.segments()?, &welch, |x| {
                    for (power, (.., channels)) in powers.iter_mut().zip(&parts) {
                        power.add(&channels.own(x[channels.columns.clone()].to_vec()));
                    }
                })?;
            let mut tables = self.shared(&welch, pieces, powers.first());
            for ((place, body, channels), power) in parts.iter().zip(&powers) {
                tables.extend(results(place, self.air, power));
                if let Some(radiation) = radiation.get(body).filter(|_| !channels.are_forces()) {
                    let omega = &inputs.modes[*body].omega;
                    tables.push(mode_resistance(place, radiation, omega));
                }
                let found = power.third_octaves();
                let [linear, weighted] = found.total();
                let loudest =
                    (0..found.centre.len()).max_by(|&a, &b| found.weighted()[a].total_cmp(&found.weighted()[b]));
                run.summary.value(
                    &format!("sound power of {place}"),
                    format!(
                        "{weighted:.1} dB(A), {linear:.1} dB re 1 pW; most in the third octave of {} Hz; at 7.5 \
                         m {:.1} dB(A)",
                        loudest.map_or(0.0, |b| self.bands.nominal()[b]),
                        pressure_level(self.air, weighted)
                    ),
                );
            }
            Ok(tables)
        })?;
        run.file.tables(tables.unwrap_or_default());
        Ok(())
    }

    /// On rank 0: hands the spectra of the modal velocities of each piece of the record to `take`, and those of the
    /// forces on body 1 (x, y, z) of each contact where the length of a step, s, is given; returns the number of
    /// pieces. One piece is in memory.
    fn spectra(
        &self,
        (from, forces): (f64, Option<f64>),
        segments: &Segments,
        welch: &Welch,
        mut take: impl FnMut(&[Vec<Complex64>]),
    ) -> Result<usize> {
        let rows_of = |entry: &Entry| -> Result<(Vec<f64>, Vec<f64>)> {
            let segment = segments.open(entry)?;
            if !segment.has(&format!("{SOUND}/time")) {
                return Ok((Vec::new(), Vec::new()));
            }
            let time = segment.numbers(&format!("{SOUND}/time"))?.1;
            Ok((time, segment.numbers(&format!("{SOUND}/displacement"))?.1))
        };
        let steps_of = |entry: &Entry| -> Result<(Vec<f64>, Vec<f64>)> {
            let segment = segments.open(entry)?;
            if forces.is_none() || !segment.has("/transient/force") {
                return Ok((Vec::new(), Vec::new()));
            }
            let of = |contact: usize| segment.numbers(&format!("{}/force", group(contact))).map(|(_, values)| values);
            let each = (0..self.contacts).map(of).collect::<Result<Vec<_>>>()?;
            let time = segment.numbers("/transient/time")?.1;
            let step = |k: usize| each.iter().flat_map(move |of| of[FORCES * k..FORCES * (k + 1)].to_vec());
            let rows = (0..time.len()).flat_map(step).collect();
            Ok((time, rows))
        };
        let mut impulse = Impulse::new(FORCES * self.contacts);
        let wanted = |t: f64| t >= from - 1e-9 * self.interval;
        let mut rows = 0;
        for entry in segments.entries() {
            rows += rows_of(&entry)?.0.into_iter().filter(|&t| wanted(t)).count();
        }
        let (pieces, mut skip) = welch.pieces(rows.saturating_sub(1));
        if pieces == 0 {
            return Err(Error::Defect(format!("sound power: {rows} samples for pieces of {}", welch.length())));
        }
        let mut last: Option<(f64, Vec<f64>)> = None;
        let mut record: VecDeque<Vec<f64>> = VecDeque::new();
        let mut done = 0;
        for entry in segments.entries() {
            let (times, values) = rows_of(&entry)?;
            let modes = values.len() / times.len().max(1);
            let (steps, force) = steps_of(&entry)?;
            let mut steps = steps.into_iter().zip(force.chunks_exact(FORCES * self.contacts)).peekable();
            for (&t, q) in times.iter().zip(values.chunks_exact(modes.max(1))) {
                let length = forces.unwrap_or(0.0);
                while let Some((_, force)) = steps.next_if(|(at, _)| *at <= t + 0.5 * length) {
                    impulse.add(force, length);
                }
                if !wanted(t) {
                    continue;
                }
                let impulses = forces.iter().flat_map(|_| impulse.sum.iter().copied());
                let q: Vec<f64> = q.iter().copied().chain(impulses).collect();
                let m = q.len();
                if let Some((before, p)) = &last {
                    if (t - before - self.interval).abs() > 1e-3 * self.interval {
                        return Err(Error::Input(format!(
                            "{}: the samples for sound power jump from {before} s to {t} s; they must be {} s apart",
                            segments.path(&entry).display(),
                            self.interval
                        )));
                    }
                    // The mean velocity over the interval.
                    if skip > 0 {
                        skip -= 1;
                    } else {
                        record.push_back(q.iter().zip(p).map(|(q, p)| (q - p) / self.interval).collect());
                    }
                }
                last = Some((t, q));
                if record.len() == welch.length() {
                    let mut x =
                        (0..m).map(|j| welch.transform(record.iter().map(|v| v[j]))).collect::<Result<Vec<_>>>()?;
                    x.iter_mut().for_each(|x| welch.undo_mean(x));
                    take(&x);
                    done += 1;
                    record.drain(..welch.hop());
                }
            }
            steps.for_each(|(_, force)| impulse.add(force, forces.unwrap_or(0.0)));
        }
        if done != pieces {
            return Err(Error::Defect(format!(
                "sound power: {done} pieces of the record where {pieces} were expected"
            )));
        }
        Ok(pieces)
    }

    /// Tables that the bodies share.
    fn shared(&self, welch: &Welch, pieces: usize, any: Option<&PowerSpectrum<'_>>) -> Vec<Table> {
        let list = |name: &str, units: &str, text: &str, values: Vec<f64>| {
            Table::list(&format!("/transient/sound_power/{name}"), units, text, values)
        };
        vec![
            list("band_frequency", "Hz", "Exact centres of the third octaves.", self.bands.centres()),
            list("band_name", "Hz", "Nominal centres of the third octaves.", self.bands.nominal()),
            list(
                "frequency",
                "Hz",
                "Frequencies of the lines of `density`.",
                any.map(PowerSpectrum::frequencies).unwrap_or_default(),
            ),
            Table::scalar("/transient/sound_power/pieces", "1", "Pieces of the record in the mean.", pieces as i64),
            Table::scalar(
                "/transient/sound_power/piece",
                "s",
                "Length of a piece.",
                welch.length() as f64 * self.interval,
            ),
        ]
    }
}

/// Impulses of forces beside their first values, which would drown what varies, N·s.
#[derive(Debug)]
struct Impulse {
    first: Option<Vec<f64>>,
    sum: Vec<f64>,
}

impl Impulse {
    /// None yet of so many components.
    fn new(components: usize) -> Self {
        Self { first: None, sum: vec![0.0; components] }
    }

    /// Another step of so many s.
    fn add(&mut self, force: &[f64], step: f64) {
        let first = self.first.get_or_insert_with(|| force.to_vec());
        for ((sum, force), first) in self.sum.iter_mut().zip(force).zip(first) {
            *sum += step * (force - *first);
        }
    }
}

/// Returns whether the body in the place `name` is a rail.
fn is_rail(job: &Job, name: &str) -> bool {
    job.bodies().into_iter().any(|(there, body)| there == name && extruded(body).is_some())
}

/// How each mode radiates at its own frequency, for those who make a sound of the modal amplitudes.
fn mode_resistance(place: &str, radiation: &Radiation, omega: &[f64]) -> Table {
    let of = |(j, w): (usize, &f64)| radiation.of_mode(w / (2.0 * PI), (j, omega.len()));
    Table::list(
        &format!("/transient/sound_power/{place}/mode_resistance"),
        "N s/m/kg",
        "Radiation resistance of each mode at its own frequency; 0 outside the third octaves.",
        omega.iter().enumerate().map(of).collect::<Vec<f64>>(),
    )
}

/// Tables of one body.
fn results(place: &str, air: Air, power: &PowerSpectrum<'_>) -> Vec<Table> {
    let list = |name: &str, units: &str, text: &str, values: Vec<f64>| {
        Table::list(&format!("/transient/sound_power/{place}/{name}"), units, text, values)
    };
    let found = power.third_octaves();
    let [linear, weighted] = found.total();
    let total = |name: &str, text: &str, value: f64| {
        Table::scalar(&format!("/transient/sound_power/{place}/{name}"), "dB", text, value)
    };
    let levels = |powers: &[f64]| powers.iter().map(|&p| level(p)).collect();
    vec![
        list("level", "dB", "Sound power level of each third octave, re 1 pW.", levels(&found.power)),
        list("level_a", "dB", "The same, A-weighted.", levels(&found.weighted())),
        list(
            "radiation_efficiency",
            "1",
            "Power over that of plane waves from the same surface velocity.",
            found.efficiency,
        ),
        list("density", "W/Hz", "Sound power per hertz at each line.", power.density()),
        total("total_level", "Sound power level of all third octaves, re 1 pW.", linear),
        total("total_level_a", "The same, A-weighted.", weighted),
        total(
            "pressure_level_a",
            "A-weighted sound pressure level at 7.5 m over hard ground, re 20 µPa, if all directions were alike.",
            pressure_level(air, weighted),
        ),
        list("power", "W", "Sound power in each third octave.", found.power),
    ]
}

#[cfg(test)]
mod tests;
