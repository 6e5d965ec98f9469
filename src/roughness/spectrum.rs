//! Lines from spectra: levels of one-third-octave bands by wavelength.
//!
//! Bands are those of base ten: the band n has the wavelength 10^(−n/10) m in its middle and reaches from 10^(−(n +
//! ½)/10) to 10^(−(n − ½)/10) m. A level L is that of the mean square of the heights, 20 lg(r_rms / 1 µm) dB (EN
//! 15610).

use super::RoughnessLine;
use crate::{Error, Result};
use fourier::Number;
use num_complex::Complex;
use std::f64::consts::PI;

/// Largest number of samples of a line.
const MAX_SAMPLES: f64 = 2e7;
/// Samples a period of the shortest wave: the spline is then within 4e-4 of its height.
const SAMPLES: f64 = 10.0;
/// How far a wavelength may lie from the middle of its band, as a ratio: 0.0315 m is 0.031623 m.
const NOMINAL: f64 = 0.03;

/// A band of wavelengths with its level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Number n of the band.
    pub number: i32,
    /// dB re 1 µm.
    pub level: f64,
}

impl Band {
    /// The band about `wavelength`, m.
    pub fn about(wavelength: f64, level: f64) -> Result<Self> {
        let number = (-10.0 * wavelength.log10()).round();
        let band = Self { number: number as i32, level };
        let off = wavelength / band.wavelength() - 1.0;
        if !(off.abs() <= NOMINAL && number.abs() < 100.0) {
            return Err(Error::Job(format!(
                "found the wavelength {wavelength} m, expected the middle of a one-third-octave band, e.g. {:.4} m",
                band.wavelength()
            )));
        }
        Ok(band)
    }

    /// Its middle, m.
    pub fn wavelength(&self) -> f64 {
        10f64.powf(-0.1 * f64::from(self.number))
    }

    /// Its ends as wavenumbers, waves per metre.
    pub fn wavenumbers(&self) -> [f64; 2] {
        [-0.5, 0.5].map(|half| 10f64.powf(0.1 * (f64::from(self.number) + half)))
    }

    /// Mean square of the heights in the band, m².
    pub(crate) fn mean_square(&self) -> f64 {
        1e-12 * 10f64.powf(0.1 * self.level)
    }
}

/// The limit of the roughness of rails for measurements of rolling noise, figure 2 of ISO 3095:2013: 0.4 to 0.00315 m.
pub(crate) fn iso3095() -> Vec<Band> {
    const LEVELS: [f64; 22] = [
        17.1, 15.0, 13.0, 11.0, 9.0, 7.0, 4.9, 2.9, 0.9, -1.1, -3.2, -5.0, -5.6, -6.2, -6.8, -7.4, -8.0, -8.6, -9.2,
        -9.8, -10.4, -11.0,
    ];
    LEVELS.iter().enumerate().map(|(i, &level)| Band { number: i as i32 + 4, level }).collect()
}

/// A line of random phases whose `bands` have their levels exactly; it repeats itself after `length`, m. The waves in
/// a band, whole numbers of which fit into the length, are alike in height. The same seed gives the same line on
/// every machine.
///
/// # Errors
/// A band that no wave of the length falls into, given twice or with a level that is no number; no bands; too many
/// samples.
pub fn line(bands: &[Band], length: f64, seed: u64) -> Result<RoughnessLine> {
    let shortest = bands.iter().map(|b| b.wavenumbers()[1]).fold(0.0, f64::max);
    let samples = (length * shortest * SAMPLES).ceil();
    if !(shortest > 0.0 && samples.is_finite() && samples <= MAX_SAMPLES) {
        return Err(Error::Job(format!(
            "found {} bands and a length of {length} m, expected at least one band and at most {MAX_SAMPLES:e} \
             samples, {SAMPLES} in the shortest wave; shorten the length, or leave short waves out",
            bands.len()
        )));
    }
    let n = (samples as usize).max(16).next_multiple_of(2);
    let mut waves = vec![Complex::new(0.0, 0.0); n / 2 + 1];
    let mut phase = phases(seed);
    for (i, band) in bands.iter().enumerate() {
        let [from, to] = band.wavenumbers().map(|k| k * length);
        let inside = from.ceil() as usize..to.ceil() as usize;
        let wrong = match () {
            _ if inside.is_empty() => format!(
                "no wave that fits {length:.4} m, which repeats itself; make the \
             length {:.3} m or more, or leave the band out",
                1.05 * length / (to - from)
            ),
            _ if bands[..i].iter().any(|b| b.number == band.number) => "it given twice".into(),
            _ if !(band.level.abs() < 120.0) => format!("the level {} dB re 1 µm", band.level),
            _ => String::new(),
        };
        if !wrong.is_empty() {
            return Err(Error::Job(format!("band of {:.4} m: found {wrong}", band.wavelength())));
        }
        let amplitude = (2.0 * band.mean_square() / inside.len() as f64).sqrt();
        for wave in inside {
            waves[wave] = Complex::from_polar(0.5 * amplitude, phase());
        }
    }
    let mut height = vec![0.0; n];
    f64::real_inverse(n).process(&mut waves, &mut height).map_err(|e| Error::Defect(format!("roughness: {e}")))?;
    let at: Vec<f64> = (0..n).map(|i| i as f64 * length / n as f64).collect();
    RoughnessLine::repeating(&at, &height, length)
}

/// Angles drawn evenly from [0, 2π) (SplitMix64; Steele, Lea and Flood, OOPSLA 2014).
fn phases(seed: u64) -> impl FnMut() -> f64 {
    let mut x = seed;
    move || {
        x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = x;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        2.0 * PI * (z >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels of a line in the bands, from samples of its own at places that are not its knots.
    fn levels(line: &RoughnessLine, length: f64, bands: &[Band]) -> Vec<f64> {
        let n = 65536;
        let mut height: Vec<f64> = (0..n).map(|i| line.height(0.37 + i as f64 * length / n as f64)).collect();
        let plan = f64::real_forward(n);
        let mut waves = plan.make_output_vec();
        plan.process(&mut height, &mut waves).unwrap();
        let power = |j: usize| 2.0 * (waves[j] / n as f64).norm_sqr();
        let of = |b: &Band| {
            let [from, to] = b.wavenumbers().map(|k| k * length);
            let sum: f64 = (1..n / 2).filter(|&j| j as f64 >= from && (j as f64) < to).map(power).sum();
            10.0 * (sum / 1e-12).log10()
        };
        bands.iter().map(of).collect()
    }

    #[test]
    fn a_line_of_the_limit_of_iso_3095_has_its_levels_in_every_band() {
        let bands = iso3095();
        let ends = [bands[0].wavelength(), bands[21].wavelength()];
        assert!((ends[0] - 0.398).abs() < 1e-3 && (ends[1] - 0.00316).abs() < 1e-5, "{ends:?}");
        for (length, seed) in [(2.0 * PI * 0.46, 1), (10.0, 2)] {
            let line = line(&bands, length, seed).unwrap();
            for (band, got) in bands.iter().zip(levels(&line, length, &bands)) {
                assert!((got - band.level).abs() < 0.02, "{} m: {got} dB, expected {}", band.wavelength(), band.level);
            }
        }
    }

    #[test]
    fn the_seed_makes_the_line() {
        let at = |seed| line(&iso3095(), 3.0, seed).unwrap().height(1.234);
        assert!(at(1) == at(1) && at(1) != at(2));
    }

    #[test]
    fn bands_that_cannot_be_are_refused() {
        let band = |w: f64| Band::about(w, 0.0).unwrap();
        assert_eq!((band(0.0315).number, band(0.05).number, band(0.125).number), (15, 13, 9));
        assert!(Band::about(0.045, 0.0).unwrap_err().message().contains("expected the middle"));
        for (bands, length, text) in [
            (vec![band(0.4)], 0.5, "no wave that fits"),
            (vec![band(0.1), band(0.1)], 5.0, "given twice"),
            (vec![], 5.0, "at least one band"),
            (vec![band(0.00315)], 1e6, "shorten the length"),
            (vec![Band { number: 10, level: f64::NAN }], 5.0, "the level"),
        ] {
            let error = line(&bands, length, 1).unwrap_err();
            assert!(error.exit_code() == 2 && error.message().contains(text), "{error}");
        }
    }
}
