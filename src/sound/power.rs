//! Sound power of a body from the spectra of its modal velocities.

use super::bands::{a_weighting, Bands};
use super::radiators::Radiators;
use super::{level, Air};
use faer::Mat;
use num_complex::Complex64;

/// Radiation resistance of the modes of a body over the frequencies of some bands.
#[derive(Debug, Clone)]
pub struct Radiation {
    bands: Bands,
    /// Frequencies of `resistance`, Hz, ascending.
    grid: Vec<f64>,
    /// Radiation resistances at each frequency.
    resistance: Vec<Scaled>,
    /// Matrices of plane waves, ρc ∫ φ_n,i φ_n,j dS, the same unit: at each frequency, or one for all.
    plane: Vec<Scaled>,
}

/// A Hermitian matrix: its real part, and where it has one its imaginary part, `[m, m]`.
#[derive(Debug, Clone)]
struct Hermitian {
    real: Mat<f64>,
    imaginary: Option<Mat<f64>>,
}

impl Hermitian {
    /// Scaled matrices of the real parts, column by column, and the imaginary ones, if any, times factors of rows and
    /// columns.
    fn new(m: usize, values: &[f64], scale: &[f64]) -> Self {
        let part = |v: &[f64]| Mat::from_fn(m, m, |i, j| v[i + m * j] / (scale[i] * scale[j]));
        let (real, imaginary) = values.split_at(m * m);
        Self { real: part(real), imaginary: (imaginary.len() == m * m).then(|| part(imaginary)) }
    }

    /// xᴴ A x.
    fn form(&self, x: &[Complex64]) -> f64 {
        let of = |a: &Mat<f64>| -> Complex64 {
            let column = |(j, xj): (usize, &Complex64)| {
                let sum: Complex64 = a.col(j).iter().zip(x).map(|(a, x)| a * x.conj()).sum();
                sum * xj
            };
            x.iter().enumerate().map(column).sum()
        };
        of(&self.real).re - self.imaginary.as_ref().map_or(0.0, |a| of(a).im)
    }
}

/// A resistance R = D C D with ones in the diagonal of C. Between two frequencies the logarithm of D is a cubic of
/// that of the frequency, mode by mode, which keeps the powers of the frequency that small bodies have, and C is
/// linear: what comes out has no negative eigenvalues, as R has none.
#[derive(Debug, Clone)]
struct Scaled {
    /// Logarithm of the diagonal of D, in (N·s/m per kg)^½, and its slope over the logarithm of the frequency, `[m]`.
    size: Vec<[f64; 2]>,
    /// C.
    coherence: Hermitian,
}

/// Smallest value whose logarithm is taken: modes that do not radiate have one all the same.
const NOTHING: f64 = 1e-200;

impl Scaled {
    fn new(m: usize, values: &[f64]) -> Self {
        let size: Vec<f64> = (0..m).map(|i| values[i + m * i].max(NOTHING).sqrt()).collect();
        let coherence = Hermitian::new(m, values, &size);
        Self { coherence, size: size.into_iter().map(|d| [d.ln(), 0.0]).collect() }
    }

    /// The slopes of all, at the logarithms `x` of their frequencies: those of parabolas through neighbours, at the
    /// ends of lines.
    fn slopes(all: &mut [Self], x: &[f64]) {
        for g in 0..all.len() {
            let (before, after) = (g.saturating_sub(1), (g + 1).min(all.len() - 1));
            for i in 0..all[g].size.len() {
                let value = |g: usize| all[g].size[i][0];
                let line = |a: usize, b: usize| if a == b { 0.0 } else { (value(b) - value(a)) / (x[b] - x[a]) };
                let slope = match (before == g, after == g) {
                    (false, false) => {
                        let share = (x[after] - x[g]) / (x[after] - x[before]);
                        share * line(before, g) + (1.0 - share) * line(g, after)
                    }
                    _ => line(before, after),
                };
                all[g].size[i][1] = slope;
            }
        }
    }

    /// D x with D at the part `t` of the way from `self` to `other`, whose logarithms of the frequency are `apart`
    /// from each other.
    fn times(&self, other: &Self, (t, apart): (f64, f64), x: &[Complex64]) -> Vec<Complex64> {
        let s = 1.0 - t;
        let between = |(a, b): (&[f64; 2], &[f64; 2])| {
            let values = s * s * (1.0 + 2.0 * t) * a[0] + t * t * (1.0 + 2.0 * s) * b[0];
            (values + apart * s * t * (s * a[1] - t * b[1])).exp()
        };
        self.size.iter().zip(&other.size).map(between).zip(x).map(|(d, x)| d * x).collect()
    }
}

/// The patches are at most this part of the wave length. The resistance of a ring with up to six nodal diameters is
/// then within 0.09 dB of that of patches a fifth as large, for k times the radius from 2 to 30.
pub const PATCH: f64 = 1.0 / 3.0;

impl Radiation {
    /// Edge of the patches that the bands need, m.
    pub(crate) fn patch_size(bands: &Bands, air: Air) -> f64 {
        PATCH * air.speed / bands.highest()
    }

    /// Radiation resistances at the frequencies of the bands, N·s/m per kg, `[frequencies × m × m]`: those of part
    /// `part` of `parts`, 0 elsewhere; the sum over the parts is what [`Radiation::new`] takes. Of patches as fine as
    /// `patch_size`; at low frequencies they are taken together, but never to more than `coarsest` (m).
    pub fn resistances(
        radiators: &Radiators,
        bands: &Bands,
        air: Air,
        coarsest: f64,
        part: usize,
        parts: usize,
    ) -> Vec<f64> {
        let grid = bands.grid();
        let each = radiators.square().nrows().pow(2);
        let mut all = vec![0.0; grid.len() * each];
        let mut level = radiators.clone();
        // From the highest frequency down, so that the patches only ever grow.
        for (g, &f) in grid.iter().enumerate().rev().filter(|(g, _)| g % parts == part) {
            while 2.0 * level.size() <= coarsest.min(PATCH * air.speed / f) {
                level = level.coarser();
            }
            let found = level.resistance(f, air);
            let values = found.col_iter().flat_map(|c| c.iter().copied());
            all[each * g..each * (g + 1)].iter_mut().zip(values).for_each(|(to, v)| *to = v);
        }
        all
    }

    /// ρc ∫ φ_n,i φ_n,j dS, N·s/m per kg, `[m × m]`: what the resistances would be, did the surface radiate as a
    /// plane wave does.
    pub(crate) fn of_plane_waves(radiators: &Radiators, air: Air) -> Vec<f64> {
        let factor = air.density * air.speed;
        radiators.square().col_iter().flat_map(|c| c.iter().map(move |v| factor * v)).collect()
    }

    /// In `bands`, from all resistances of m modes at the frequencies of `grid` (Hz, ascending, from the beginning of
    /// the bands to their end), N·s/m per kg, `[frequencies × m × m]`, and those of plane waves, the same or `[m ×
    /// m]` for all frequencies. Hermitian ones are `[frequencies × 2 × m × m]`, real parts before imaginary ones.
    /// With forces in place of modal velocities, W/N².
    pub fn new(bands: Bands, grid: Vec<f64>, m: usize, [resistances, plane]: [&[f64]; 2]) -> Self {
        let x: Vec<f64> = grid.iter().map(|f| f.ln()).collect();
        let made = |values: &[f64], count: usize| -> Vec<Scaled> {
            let mut all: Vec<Scaled> =
                values.chunks_exact((values.len() / count).max(1)).map(|v| Scaled::new(m, v)).collect();
            if all.len() == x.len() {
                Scaled::slopes(&mut all, &x);
            }
            all
        };
        let resistance = made(resistances, grid.len());
        let whole = m * m;
        let plane = made(plane, if plane.len() == whole { 1 } else { grid.len() });
        Self { bands, grid, resistance, plane }
    }

    /// Radiation resistance of the mode `j` of `m` at the frequency `f` (Hz), N·s/m per kg; 0 outside the bands.
    pub(crate) fn of_mode(&self, f: f64, (j, m): (usize, usize)) -> f64 {
        if !(self.bands.lowest()..=self.bands.highest()).contains(&f) {
            return 0.0;
        }
        let x: Vec<Complex64> = (0..m).map(|i| Complex64::new(if i == j { 1.0 } else { 0.0 }, 0.0)).collect();
        self.power(f, &x)[0]
    }

    /// Power in each third octave, W, of a periodic motion: `lines` are the complex amplitudes of the modal velocities
    /// at the multiples 1, 2, … of the frequency `f` (Hz), `[..][m]`.
    pub(crate) fn of_lines(&self, f: f64, lines: &[Vec<Complex64>]) -> Vec<f64> {
        let mut power = vec![0.0; self.bands.centres().len()];
        for (k, x) in lines.iter().enumerate() {
            let f = (k + 1) as f64 * f;
            if (self.bands.lowest()..self.bands.highest()).contains(&f) {
                // The band that holds the line.
                let place = self.bands.shares(f, f * (1.0 + 1e-9));
                let band = place.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
                if let Some(power) = band.and_then(|(band, _)| power.get_mut(band)) {
                    *power += 0.5 * self.power(f, x)[0].max(0.0);
                }
            }
        }
        power
    }

    /// Power of the modal velocities x (complex, `[m]`) at the frequency `f` (Hz), xᴴ R x, with R between those at
    /// the frequencies where it is known; and that of plane waves.
    pub(super) fn power(&self, f: f64, x: &[Complex64]) -> [f64; 2] {
        let last = self.grid.len() - 2;
        let g = self.grid.partition_point(|&a| a <= f).saturating_sub(1).min(last);
        let apart = (self.grid[g + 1] / self.grid[g]).ln();
        let t = ((f / self.grid[g]).ln() / apart).clamp(0.0, 1.0);
        [&self.resistance, &self.plane].map(|all| {
            let one = all.len() == 1;
            let (low, high) = (&all[if one { 0 } else { g }], &all[if one { 0 } else { g + 1 }]);
            let scaled = low.times(high, (t, apart), x);
            (1.0 - t) * low.coherence.form(&scaled) + t * high.coherence.form(&scaled)
        })
    }
}

/// Mean sound power per hertz of a body, line by line.
#[derive(Debug, Clone)]
pub struct PowerSpectrum<'a> {
    radiation: &'a Radiation,
    /// Distance of the lines, Hz.
    spacing: f64,
    /// Number of the first line in the bands.
    first: usize,
    /// Sums of the densities, W/Hz: radiated, and of plane waves.
    sums: Vec<[f64; 2]>,
    pieces: usize,
}

impl<'a> PowerSpectrum<'a> {
    /// Nothing yet, on lines at the multiples of `spacing` (Hz).
    pub fn new(radiation: &'a Radiation, spacing: f64) -> Self {
        // All lines whose intervals reach into the bands.
        let first = (radiation.bands.lowest() / spacing - 0.5).ceil().max(1.0) as usize;
        let last = (radiation.bands.highest() / spacing + 0.5).floor() as usize;
        Self { radiation, spacing, first, sums: vec![[0.0; 2]; (last + 1).saturating_sub(first)], pieces: 0 }
    }

    /// Adds a piece: `lines` holds the spectrum of the velocity of each mode, `[m][lines]`.
    pub fn add(&mut self, lines: &[Vec<Complex64>]) {
        let mut x = vec![Complex64::default(); lines.len()];
        for (i, sum) in self.sums.iter_mut().enumerate() {
            let line = self.first + i;
            x.iter_mut().zip(lines).for_each(|(x, l)| *x = l.get(line).copied().unwrap_or_default());
            let power = self.radiation.power(line as f64 * self.spacing, &x);
            sum.iter_mut().zip(power).for_each(|(s, p)| *s += p);
        }
        self.pieces += 1;
    }

    /// Frequencies of the lines, Hz.
    pub fn frequencies(&self) -> Vec<f64> {
        (0..self.sums.len()).map(|i| (self.first + i) as f64 * self.spacing).collect()
    }

    /// Radiated power, W/Hz, `[lines]`, the mean of the pieces.
    pub fn density(&self) -> Vec<f64> {
        self.sums.iter().map(|s| s[0] / self.pieces.max(1) as f64).collect()
    }

    /// The third octaves.
    pub(crate) fn third_octaves(&self) -> ThirdOctaves {
        let bands = self.radiation.bands;
        let centre = bands.centres();
        let mut power = vec![0.0; centre.len()];
        let mut plane = vec![0.0; centre.len()];
        for (f, sum) in self.frequencies().iter().zip(&self.sums) {
            for (band, share) in bands.shares(f - 0.5 * self.spacing, f + 0.5 * self.spacing) {
                let factor = share * self.spacing / self.pieces.max(1) as f64;
                power[band] += factor * sum[0];
                plane[band] += factor * sum[1];
            }
        }
        // Rounding may leave less than nothing of modes that do not radiate.
        power.iter_mut().for_each(|p| *p = p.max(0.0));
        let efficiency = power.iter().zip(&plane).map(|(w, p)| if *p > 0.0 { w / p } else { 0.0 }).collect();
        ThirdOctaves { centre, power, efficiency }
    }
}

/// Sound power in third octaves.
#[derive(Debug, Clone, PartialEq)]
pub struct ThirdOctaves {
    /// Exact centres, Hz.
    pub centre: Vec<f64>,
    /// Power, W.
    pub power: Vec<f64>,
    /// Radiation efficiency: the power by that of plane waves, ρc ∫ v_n² dS; 0 where nothing moves.
    pub efficiency: Vec<f64>,
}

impl ThirdOctaves {
    /// A-weighted power of the bands, W.
    pub fn weighted(&self) -> Vec<f64> {
        self.centre.iter().zip(&self.power).map(|(&f, p)| p * 10f64.powf(a_weighting(f) / 10.0)).collect()
    }

    /// Levels of the whole, dB re 1 pW: linear and A-weighted.
    pub fn total(&self) -> [f64; 2] {
        [level(self.power.iter().sum()), level(self.weighted().iter().sum())]
    }
}

#[cfg(test)]
mod tests {
    use super::super::radiators::{Key, RadiatingPatch};
    use super::super::spectrum::Welch;
    use super::*;
    use std::collections::BTreeMap;
    use std::f64::consts::PI;

    const AIR: Air = Air { density: 1.2, speed: 340.0 };

    /// All at once.
    fn radiation(radiators: &Radiators, bands: Bands) -> Radiation {
        let parts = [0, 1].map(|part| Radiation::resistances(radiators, &bands, AIR, 0.1, part, 2));
        let all: Vec<f64> = parts[0].iter().zip(&parts[1]).map(|(a, b)| a + b).collect();
        let m = radiators.square().nrows();
        Radiation::new(bands, bands.grid(), m, [&all, &Radiation::of_plane_waves(radiators, AIR)])
    }

    /// A small piston of 1 cm² with one mode of unit displacement.
    fn piston() -> Radiators {
        let area = 1e-4;
        let patch = RadiatingPatch { area, moment: [0.0; 3], flow: vec![area] };
        let patches: BTreeMap<Key, RadiatingPatch> = [([0; 4], patch)].into();
        Radiators::new(patches, 1e-3, Mat::from_fn(1, 1, |_, _| area))
    }

    #[test]
    fn a_tone_is_found_in_its_band_with_its_power() {
        for (f, weight) in [(1000.0, 0.0), (100.0, -19.1), (107.0, -19.1), (2400.0, 1.3)] {
            let bands = Bands::spanning(63.0, 4000.0);
            let radiation = radiation(&piston(), bands);
            let rate = 20e3;
            let welch = Welch::new(rate, super::super::bands::resolving_time(63.0));
            let amplitude = 0.02;
            let mut spectrum = PowerSpectrum::new(&radiation, welch.spacing());
            for piece in 0..5 {
                let at = |i: usize| amplitude * (2.0 * PI * f * (i + piece * welch.hop()) as f64 / rate + 0.3).cos();
                spectrum.add(&[welch.transform((0..welch.length()).map(at)).unwrap()]);
            }
            // Low-frequency limit of a piston in a baffle, ρc k² S²/(2π) ⟨v²⟩, which the interpolation between
            // frequencies keeps.
            let k = AIR.wave_number(f);
            let wanted = AIR.density * AIR.speed * k * k * 1e-8 / (2.0 * PI) * 0.5 * amplitude * amplitude;
            let found = spectrum.third_octaves();
            let band = (0..found.centre.len())
                .min_by(|&a, &b| (found.centre[a] / f).ln().abs().total_cmp(&(found.centre[b] / f).ln().abs()))
                .unwrap();
            let total: f64 = found.power.iter().sum();
            assert!((total / wanted - 1.0).abs() < 5e-3, "{f} Hz: {total} W for {wanted}");
            assert!(found.power[band] / wanted > 0.99, "{f} Hz: {} of {wanted} W in its band", found.power[band]);
            let [linear, a] = found.total();
            assert!((linear - level(wanted)).abs() < 0.03, "{f} Hz: {linear} dB");
            assert!((a - linear - weight).abs() < 0.06, "{f} Hz: A-weighted {a} of {linear} dB");
            let sigma = k * k * 1e-4 / (2.0 * PI);
            assert!((found.efficiency[band] / sigma - 1.0).abs() < 0.01, "{} for {sigma}", found.efficiency[band]);
            let lines: f64 = spectrum.density().iter().sum::<f64>() * welch.spacing();
            assert!((lines / total - 1.0).abs() < 1e-6, "lines {lines}, bands {total}");
        }
    }

    #[test]
    fn modes_that_move_against_each_other_do_not_add_up() {
        // Two modes with the same flow, in phase and in opposition.
        let area = 1e-4;
        let patches: BTreeMap<Key, RadiatingPatch> =
            [([0; 4], RadiatingPatch { area, moment: [0.0; 3], flow: vec![area; 2] })].into();
        let two = Radiators::new(patches, 1e-3, Mat::from_fn(2, 2, |_, _| area));
        let radiation = radiation(&two, Bands::spanning(500.0, 1000.0));
        let one = Complex64::new(0.3, -0.4);
        let [single, _] = radiation.power(700.0, &[one, Complex64::default()]);
        let [both, plane] = radiation.power(700.0, &[one, one]);
        assert!((both / single - 4.0).abs() < 1e-12, "{both} for {single}");
        assert!((plane / (AIR.density * AIR.speed * area) - 1.0).abs() < 1e-12, "{plane}");
        let [none, _] = radiation.power(700.0, &[one, -one]);
        assert!(none.abs() < 1e-12 * single, "{none} for {single}");
    }

    #[test]
    fn patches_are_as_large_as_the_wave_length_allows_and_no_larger() {
        let bands = Bands::spanning(500.0, 2000.0);
        let fine = Radiation::patch_size(&bands, AIR);
        assert!((fine - AIR.speed / bands.highest() / 3.0).abs() < 1e-12, "{fine}");
        // A square plate of patches much smaller than that.
        let (size, n) = (0.25 * fine, 32);
        let mut patches: BTreeMap<Key, RadiatingPatch> = BTreeMap::new();
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let (area, at) = (size * size, [i, j].map(|k| size * (k as f64 + 0.5)));
            let flow = vec![area * (1.0 + (0.3 * i as f64).sin())];
            patches.insert([0, i, j, 0], RadiatingPatch { area, moment: [area * at[0], area * at[1], 0.0], flow });
        }
        let plate = Radiators::new(patches, size, Mat::from_fn(1, 1, |_, _| 1.0));
        for coarsest in [1.0, 3.0 * fine] {
            let found = Radiation::resistances(&plate, &bands, AIR, coarsest, 0, 1);
            for (r, f) in found.iter().zip(bands.grid()) {
                let doublings = (coarsest.min(AIR.speed / f / 3.0) / size).log2().floor() as usize;
                assert!((1..=4).contains(&doublings), "{doublings} at {f} Hz");
                let level = (0..doublings).fold(plate.clone(), |p, _| p.coarser());
                assert_eq!(*r, level.resistance(f, AIR)[(0, 0)], "{f} Hz, {doublings} doublings");
            }
        }
    }

    #[test]
    fn a_line_across_the_border_of_two_bands_is_divided() {
        let bands = Bands::spanning(400.0, 800.0);
        let radiation = radiation(&piston(), bands);
        let spacing = 11.0;
        // The lower border of the first band and that between the second and the third, with the line next to each.
        for (band, border) in [(0, bands.lowest()), (2, 1000.0 * 10f64.powf(-0.25))] {
            let line = (border / spacing).round() as usize;
            let mut lines = vec![Complex64::default(); 200];
            lines[line] = Complex64::new(1e-3, 0.0);
            let mut spectrum = PowerSpectrum::new(&radiation, spacing);
            spectrum.add(&[lines]);
            let all = radiation.power(line as f64 * spacing, &[Complex64::new(1e-3, 0.0)])[0] * spacing;
            let above = (line as f64 + 0.5) - border / spacing;
            assert!(above > 0.05 && above < 0.95, "{above}");
            let power = spectrum.third_octaves().power;
            assert!((power[band] / all - above).abs() < 1e-9, "{power:?} of {all}, {above} of it above {border} Hz");
            if band > 0 {
                assert!((power[band - 1] / all - (1.0 - above)).abs() < 1e-9, "{power:?} of {all}");
            }
        }
    }
}
