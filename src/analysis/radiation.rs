//! How the modes of the bodies radiate, and the sound power of their motions.

use crate::body::{Kind, Side, TraceModes};
use crate::case::bodies::BuiltBodies;
use crate::job::SoundPower;
use crate::parallel::World;
use crate::sound::bands::resolving_time;
use crate::sound::{line, revolved, surface, Air, Bands, PowerSpectrum, Radiation, Welch};
use crate::swept::{Infinite, OutlineModes, FORCES};
use crate::transient::cycle::AmplitudeRecord;
use crate::{Error, Result};
use num_complex::Complex64;
use std::f64::consts::PI;
use std::ops::Range;

/// Samples in the period of the highest frequency wanted, at least: what aliasing brings from beyond half the
/// sampling rate is then damped by the mean over the interval to a fifth of what it is there.
pub(super) const SAMPLES: f64 = 6.0;
/// Patches are at most this part of the size of the body, whatever the frequency.
const COARSEST: f64 = 0.03;

/// Radiation of the modes of a body; or of rails, under forces at the contacts.
pub(super) struct RadiationInput {
    /// Frequencies at which it is known, Hz.
    pub(super) grid: Vec<f64>,
    /// At these, N·s/m per kg, `[frequencies × m × m]`; of rails W/N², as [`line::RailRadiators::powers`] has it.
    pub(super) resistances: Vec<f64>,
    /// Matrix of plane waves, `[m × m]`; of rails as `resistances`.
    pub(super) plane: Vec<f64>,
}

impl RadiationInput {
    /// Collective: that of the body with the index `b` in [`BuiltBodies::unique`], whose mode shapes are there. Each
    /// rank takes some of the frequencies.
    pub(super) fn new(world: &World, bodies: &BuiltBodies, b: usize, (bands, air): (Bands, Air)) -> Result<Self> {
        if let Some(body) = bodies.unique.get(b) {
            let rails = world.agree(body.infinite_rails(2.0 * PI * bands.highest()))?;
            if !rails.is_empty() {
                return Self::of_rails(world, &rails, (bands, air));
            }
            let outlines = body.outlines()?;
            if !outlines.is_empty() {
                return Self::of_sections(world, &outlines, (bands, air));
            }
        }
        Self::of_mesh(world, bodies, b, (bands, air))
    }

    /// Rails far from each other: their powers add up.
    fn of_rails(world: &World, rails: &[Infinite], (bands, air): (Bands, Air)) -> Result<Self> {
        let mut all = Vec::new();
        for rail in rails {
            let radiators = line::RailRadiators::new(rail, air, &bands);
            let far = world.sum_all(&world.agree(radiators.far(world.rank, world.size))?);
            let radiators = radiators.complete(&far);
            let grid = radiators.frequencies(&bands);
            let some = world.agree(radiators.powers(&grid, world.rank, world.size))?;
            all.push((radiators.forces(), grid, some.map(|some| world.sum_all(&some))));
        }
        // They depend on the bands alone.
        let grid = all.first().map(|one| one.1.clone()).unwrap_or_default();
        let joined = |kind: usize| {
            let blocks: Vec<(usize, &[f64])> = all.iter().map(|(n, _, powers)| (*n, &powers[kind][..])).collect();
            diagonal(&blocks)
        };
        Ok(Self { resistances: joined(0), plane: joined(1), grid })
    }

    /// Bodies swept from sections, far from each other: their powers add up.
    fn of_sections(world: &World, sections: &[OutlineModes], (bands, air): (Bands, Air)) -> Result<Self> {
        let radiators: Vec<_> = sections.iter().map(|modes| revolved::RevolvedRadiators::new(modes, air)).collect();
        // The largest body needs the most, among which those of all others can be interpolated.
        let grids = radiators.iter().map(|one| one.frequencies(&bands));
        let grid = grids.max_by_key(Vec::len).unwrap_or_default();
        let added = |sum: &mut Vec<f64>, more: Vec<f64>| {
            sum.resize(more.len(), 0.0);
            sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        };
        let (mut some, mut plane) = (Vec::new(), Vec::new());
        let all = radiators.iter().try_for_each(|one| {
            added(&mut some, one.resistances(&grid, world.rank, world.size)?);
            added(&mut plane, one.of_plane_waves(&bands)?);
            Ok(())
        });
        world.agree(all)?;
        Ok(Self { resistances: world.sum_all(&some), plane, grid })
    }

    fn of_mesh(world: &World, bodies: &BuiltBodies, b: usize, (bands, air): (Bands, Air)) -> Result<Self> {
        let (body, modes) = (bodies.fields(b)?, bodies.shapes_of(b)?);
        let [size, coarsest] = patch_sizes((bands, air), body.diameter());
        let radiators = surface::radiators(world, body, modes, size);
        let some = Radiation::resistances(&radiators, &bands, air, coarsest, world.rank, world.size);
        let plane = Radiation::of_plane_waves(&radiators, air);
        Ok(Self { grid: bands.grid(), resistances: world.sum_all(&some), plane })
    }

    /// Radiation of this many modes, or forces, in `bands`, those that it was made for.
    pub(super) fn within(&self, channels: usize, bands: Bands) -> Radiation {
        Radiation::new(bands, self.grid.clone(), channels, [&self.resistances, &self.plane])
    }
}

/// Matrices with some blocks along the diagonal, from those of each block, `[matrices × n × n]`, with its n.
fn diagonal(blocks: &[(usize, &[f64])]) -> Vec<f64> {
    let order: usize = blocks.iter().map(|(n, _)| n).sum();
    let count = blocks.first().map_or(0, |(n, values)| values.len() / (n * n));
    let mut all = vec![0.0; count * order * order];
    for (matrix, to) in all.chunks_exact_mut((order * order).max(1)).enumerate() {
        let mut first = 0;
        for (n, values) in blocks {
            for (k, value) in values[n * n * matrix..n * n * (matrix + 1)].iter().enumerate() {
                to[first + k % n + order * (first + k / n)] = *value;
            }
            first += n;
        }
    }
    all
}

/// By what of a sample a body radiates: by the amplitudes of its modes, or, rails, by the forces at the contacts. A
/// sample has the amplitudes of all modes and then, contact after contact, the impulses of the forces on body 1 (x, y,
/// z).
#[derive(Debug, Clone)]
pub(super) struct Channels {
    pub(super) columns: Range<usize>,
    /// Factors that make a force along (x, y, into the body) of it.
    signs: Option<[f64; FORCES]>,
}

impl Channels {
    /// Radiation of a body on this side, whose modes are `modes` of `all`; a rail has this number of `contacts`.
    pub(super) fn new(contacts: Option<usize>, side: Side, (modes, all): (Range<usize>, usize)) -> Self {
        let Some(contacts) = contacts else {
            return Self { columns: modes, signs: None };
        };
        // Into the body is against z of the lower form, and the upper one is pushed by the opposite of the tractions.
        let along = if side == Side::Lower { 1.0 } else { -1.0 };
        Self { columns: all..all + FORCES * contacts, signs: Some([along, along, -1.0]) }
    }

    /// Returns whether they are forces.
    pub(super) fn are_forces(&self) -> bool {
        self.signs.is_some()
    }

    /// Spectra of these columns as the body takes them.
    pub(super) fn own(&self, mut lines: Vec<Vec<Complex64>>) -> Vec<Vec<Complex64>> {
        if let Some(signs) = &self.signs {
            for (lines, sign) in lines.iter_mut().zip(signs.iter().cycle()) {
                lines.iter_mut().for_each(|v| *v *= sign);
            }
        }
        lines
    }
}

/// The air of a job.
pub(super) fn air(wanted: &SoundPower) -> Air {
    Air { density: wanted.air_density, speed: wanted.sound_speed }
}

/// The third octaves that are wanted under `key`, of modes that reach `reach` (Hz).
pub(super) fn bands_within(key: &str, wanted: &SoundPower, reach: f64) -> Result<Bands> {
    if let Some(f) = wanted.max_frequency.filter(|f| *f > reach) {
        return Err(Error::Job(format!(
            "{key}.max_frequency: found {f} Hz, but the modes kept reach {reach:.1} Hz only; keep more modes in \
             analyses.modes"
        )));
    }
    Bands::between(wanted.min_frequency, wanted.max_frequency.unwrap_or(reach)).map_err(|e| e.context(key))
}

/// The third octaves that are wanted under `key`, of the modes of the bodies that are heard.
pub fn bands_of((key, wanted): (&str, &SoundPower), bodies: &BuiltBodies, modes: &[TraceModes]) -> Result<Bands> {
    let heard = bodies.places.iter().filter(|place| wanted.bodies.iter().any(|b| b.name() == place.name));
    let highest = |b: usize| modes.get(b).and_then(|m| m.omega.last()).map_or(0.0, |w| w / (2.0 * PI));
    bands_within(key, wanted, heard.map(|place| highest(place.body)).fold(f64::INFINITY, f64::min))
}

/// Stride between two samples, in steps of length `step`, s.
pub(super) fn stride(bands: Bands, step: f64) -> u64 {
    (1.0 / (SAMPLES * bands.highest() * step)).floor().max(1.0) as u64
}

/// Sizes of the patches of a body of so large a diameter, m: of the finest ones, and of the largest to which they are
/// taken together.
pub(super) fn patch_sizes((bands, air): (Bands, Air), diameter: f64) -> [f64; 2] {
    let coarsest = COARSEST * diameter;
    [Radiation::patch_size(&bands, air).min(coarsest), coarsest]
}

/// Sound of recorded modal displacements, on every rank.
pub struct ModalSound {
    /// Name of each body that is heard, by what, how it radiates.
    parts: Vec<(&'static str, Channels, Radiation)>,
    bands: Bands,
    air: Air,
    heard: AmplitudeRecord,
    welch: Welch,
}

impl ModalSound {
    /// Collective: of the sound that is `wanted` under `key`, of motions in steps of length `step`, s, under some
    /// `contacts`. The `bodies` in the places have their mode shapes, and `modes` are those of each that differs.
    pub fn new(
        world: &World,
        (key, wanted): (&str, &SoundPower),
        (step, contacts): (f64, usize),
        bodies: &BuiltBodies,
        modes: &[TraceModes],
    ) -> Result<Self> {
        let count = |body: usize| modes.get(body).map_or(0, |m| m.omega.len());
        let mut parts = Vec::new();
        let mut first = 0;
        for place in &bodies.places {
            let columns = first..first + count(place.body);
            first = columns.end;
            if wanted.bodies.iter().any(|b| b.name() == place.name) {
                let all = bodies.places.iter().map(|p| count(p.body)).sum();
                let rail = bodies.unique.get(place.body).is_some_and(|body| body.kind() == Kind::Rail);
                let contacts = rail.then_some(contacts);
                parts.push((place.name, place.body, Channels::new(contacts, place.side, (columns, all))));
            }
        }
        let bands = bands_of((key, wanted), bodies, modes)?;
        let mut made: Vec<(usize, Radiation)> = Vec::new();
        for (_, body, channels) in &parts {
            if made.iter().all(|m| m.0 != *body) {
                let given = RadiationInput::new(world, bodies, *body, (bands, air(wanted)))?;
                made.push((*body, given.within(channels.columns.len(), bands)));
            }
        }
        let radiation = |body: usize| made.iter().find(|m| m.0 == body).map(|m| m.1.clone());
        let parts = parts.into_iter().filter_map(|(name, body, channels)| Some((name, channels, radiation(body)?)));
        let stride = stride(bands, step);
        let interval = stride as f64 * step;
        let welch = Welch::new(1.0 / interval, resolving_time(wanted.min_frequency));
        // One more sample than means between them, and some that rounding takes at the ends.
        let heard = AmplitudeRecord { stride: stride as usize, time: (welch.length() + 3) as f64 * interval };
        Ok(Self { parts: parts.collect(), bands, air: air(wanted), heard, welch })
    }

    /// Quantities of a motion to be recorded.
    pub fn quantities(&self) -> AmplitudeRecord {
        self.heard
    }

    /// The air around the bodies.
    pub fn air(&self) -> Air {
        self.air
    }

    /// The third octaves.
    pub fn bands(&self) -> Bands {
        self.bands
    }

    /// Power in each third octave, W, `[bodies × bands]`, of modal displacements and impulses of C contacts as they
    /// were to be kept, `[samples][m + 3C]`; of none, rest, it is 0. The estimate is that of a transient.
    pub fn powers(&self, samples: &[Vec<f64>]) -> Result<Vec<f64>> {
        let bands = self.bands.centres().len();
        if samples.is_empty() {
            return Ok(vec![0.0; self.parts.len() * bands]);
        }
        let interval = 1.0 / self.welch.rate();
        let means: Vec<Vec<f64>> = samples
            .windows(2)
            .map(|pair| pair[1].iter().zip(&pair[0]).map(|(b, a)| (b - a) / interval).collect())
            .collect();
        let (pieces, skip) = self.welch.pieces(means.len());
        if pieces == 0 {
            let text = format!("sound power: {} samples for pieces of {}", samples.len(), self.welch.length());
            return Err(Error::Defect(text));
        }
        let mut all = Vec::new();
        for (_, channels, radiation) in &self.parts {
            let mut power = PowerSpectrum::new(radiation, self.welch.spacing());
            for piece in 0..pieces {
                let of = skip + piece * self.welch.hop();
                let rows = means.get(of..of + self.welch.length()).unwrap_or_default();
                let lines = |j: usize| -> Result<Vec<Complex64>> {
                    let mut x = self.welch.transform(rows.iter().map(|v| v[j]))?;
                    self.welch.undo_mean(&mut x);
                    Ok(x)
                };
                power.add(&channels.own(channels.columns.clone().map(lines).collect::<Result<Vec<_>>>()?));
            }
            all.extend(power.third_octaves().power);
        }
        Ok(all)
    }

    /// Power in each third octave, W, `[bodies × bands]`, of a periodic motion of the frequency `f` (Hz): `lines` are
    /// the complex amplitudes of the modal velocities and of the forces on body 1 at C contacts at its multiples 1, 2,
    /// …, `[..][m + 3C]`.
    pub fn powers_of_lines(&self, f: f64, lines: &[Vec<Complex64>]) -> Vec<f64> {
        let of = |(_, channels, radiation): &(&'static str, Channels, Radiation)| {
            // Columns become spectra and back: the signs of forces are those of a column.
            let columns = channels.columns.clone().map(|j| lines.iter().map(|l| l[j]).collect()).collect();
            let own = channels.own(columns);
            let lines: Vec<Vec<Complex64>> = (0..lines.len()).map(|k| own.iter().map(|c| c[k]).collect()).collect();
            radiation.of_lines(f, &lines)
        };
        self.parts.iter().flat_map(of).collect()
    }

    /// The names of the bodies that are heard.
    pub fn names(&self) -> Vec<&'static str> {
        self.parts.iter().map(|p| p.0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_lie_along_the_diagonal_of_each_matrix() {
        let (one, other) = ([1.0, 2.0], [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        let joined = diagonal(&[(1, &one), (2, &other)]);
        let matrix = |[a, b, c, d, e]: [f64; 5]| [a, 0.0, 0.0, 0.0, b, c, 0.0, d, e];
        assert_eq!(joined, [matrix([1.0, 3.0, 4.0, 5.0, 6.0]), matrix([2.0, 7.0, 8.0, 9.0, 10.0])].concat());
    }

    /// A body below takes forces along x and y as they are and that along z into itself; one above takes the opposite
    /// of the former.
    #[test]
    fn each_contact_has_its_forces_as_the_body_takes_them() {
        let lines: Vec<Vec<Complex64>> = (0..6).map(|k| vec![Complex64::new(f64::from(k), 1.0)]).collect();
        for (side, signs) in [(Side::Lower, [1.0, 1.0, -1.0]), (Side::Upper, [-1.0, -1.0, -1.0])] {
            let channels = Channels::new(Some(2), side, (3..5, 9));
            assert!(channels.columns == (9..15) && channels.are_forces());
            let own = channels.own(lines.clone());
            (0..6).for_each(|k| assert_eq!(own[k][0], lines[k][0] * signs[k % 3], "{k}"));
        }
        let modes = Channels::new(None, Side::Lower, (3..5, 9));
        assert!(modes.columns == (3..5) && !modes.are_forces() && modes.own(lines.clone()) == lines);
    }
}
