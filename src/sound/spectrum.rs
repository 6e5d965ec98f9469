//! Spectra by Welch's method: windowed pieces of a record, half overlapping, whose squares are averaged (P. D. Welch,
//! IEEE Trans. Audio Electroacoust. 15 (1967) 70–73).

use crate::{Error, Result};
use fourier::{FftError, Number, RealToComplex};
use num_complex::Complex64;
use std::f64::consts::PI;
use std::sync::Arc;

/// Pieces of a record of equally spaced samples.
#[derive(Clone)]
pub struct Welch {
    /// Hann window, `[length of a piece]`.
    window: Vec<f64>,
    /// Samples per second, 1/s.
    rate: f64,
    /// Discrete Fourier transform of length `size`, a power of two.
    fourier: Arc<dyn RealToComplex<f64>>,
}

impl Welch {
    /// Pieces of at least `time` s of a record with `rate` samples per second.
    pub fn new(rate: f64, time: f64) -> Self {
        let length = 2 * (0.5 * (rate * time - 1e-6)).ceil().max(2.0) as usize;
        // Periodic: shifted by half its length and added it is constant.
        let window = (0..length).map(|i| 0.5 - 0.5 * (2.0 * PI * i as f64 / length as f64).cos()).collect();
        let fourier = f64::real_forward(length.next_power_of_two());
        Self { window, rate, fourier }
    }

    /// Samples per second, 1/s.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Samples of a piece.
    pub fn length(&self) -> usize {
        self.window.len()
    }

    /// Samples from one piece to the next.
    pub(crate) fn hop(&self) -> usize {
        self.length() / 2
    }

    /// Number of pieces in a record of so many samples, and the samples at its beginning that are in none.
    pub fn pieces(&self, samples: usize) -> (usize, usize) {
        if samples < self.length() {
            return (0, samples);
        }
        let count = (samples - self.length()) / self.hop() + 1;
        (count, samples - self.length() - (count - 1) * self.hop())
    }

    /// Frequencies of the lines of a spectrum are multiples of this, Hz.
    pub fn spacing(&self) -> f64 {
        self.rate / self.fourier.len() as f64
    }

    /// Lines of a one-sided spectrum, that of frequency 0 included.
    pub fn lines(&self) -> usize {
        self.fourier.len() / 2
    }

    /// A mean over the interval T of two samples reduces a harmonic motion by sin(πfT)/(πfT); makes of the spectrum
    /// of such means that of the motion.
    pub(crate) fn undo_mean(&self, lines: &mut [Complex64]) {
        for (k, z) in lines.iter_mut().enumerate().skip(1) {
            let x = PI * k as f64 * self.spacing() / self.rate;
            *z *= x / x.sin();
        }
    }

    /// Spectrum of a piece of one channel, `[lines]`, so scaled that the squared magnitudes are the one-sided power
    /// density (unit² per Hz); half of that at frequency 0. Fails by a defect only.
    pub fn transform(&self, samples: impl Iterator<Item = f64>) -> Result<Vec<Complex64>> {
        let (mut x, mut lines) = (self.fourier.make_input_vec(), self.fourier.make_output_vec());
        for ((x, w), s) in x.iter_mut().zip(&self.window).zip(samples) {
            *x = w * s;
        }
        let defect = |e: FftError| Error::Defect(format!("spectrum of a piece of the record: {e}"));
        self.fourier.process(&mut x, &mut lines).map_err(defect)?;
        let square: f64 = self.window.iter().map(|w| w * w).sum();
        let scale = (2.0 / (self.rate * square)).sqrt();
        lines.truncate(self.lines());
        lines.iter_mut().for_each(|z| *z *= scale);
        Ok(lines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Some numbers without order.
    fn noise(n: usize) -> Vec<f64> {
        let mut state = 7u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..n).map(|_| next()).collect()
    }

    #[test]
    fn the_transform_is_the_sum_it_stands_for() {
        let welch = Welch::new(100.0, 0.5);
        assert_eq!((welch.length(), welch.lines()), (50, 32));
        let x = noise(50);
        let found = welch.transform(x.iter().copied()).unwrap();
        let square: f64 = welch.window.iter().map(|w| w * w).sum();
        for k in [0, 1, 7, 31] {
            let sum: Complex64 = (0..50)
                .map(|i| welch.window[i] * x[i] * Complex64::cis(-2.0 * PI * (i * k) as f64 / 64.0))
                .sum::<Complex64>()
                * (2.0 / (100.0 * square)).sqrt();
            assert!((found[k] - sum).norm() < 1e-14, "line {k}: {} for {sum}", found[k]);
        }
    }

    #[test]
    fn the_density_adds_up_to_the_mean_square() {
        // Parseval: of the windowed piece, so of a record whose mean square the window does not change.
        let welch = Welch::new(1000.0, 0.8);
        let n = welch.length();
        let x = noise(n);
        let windowed: f64 = x.iter().zip(&welch.window).map(|(x, w)| (x * w).powi(2)).sum::<f64>()
            / welch.window.iter().map(|w| w * w).sum::<f64>();
        let spectrum = welch.transform(x.into_iter()).unwrap();
        let last: f64 = {
            // The line at half the rate, which is not among the others.
            let sum: f64 = noise(n)
                .iter()
                .zip(&welch.window)
                .enumerate()
                .map(|(i, (x, w))| if i % 2 == 0 { x * w } else { -x * w })
                .sum();
            sum * sum / (1000.0 * welch.window.iter().map(|w| w * w).sum::<f64>())
        };
        let lines: f64 = 0.5 * spectrum[0].norm_sqr() + spectrum[1..].iter().map(|z| z.norm_sqr()).sum::<f64>() + last;
        let total = lines * welch.spacing();
        assert!((total / windowed - 1.0).abs() < 1e-12, "{total} for {windowed}");
    }

    #[test]
    fn pieces_end_with_the_record() {
        let welch = Welch::new(1000.0, 0.1);
        assert_eq!((welch.length(), welch.hop()), (100, 50));
        assert_eq!(welch.pieces(99), (0, 99));
        assert_eq!(welch.pieces(100), (1, 0));
        assert_eq!(welch.pieces(149), (1, 49));
        assert_eq!(welch.pieces(260), (4, 10));
    }

    #[test]
    fn windows_that_overlap_add_up_to_one_and_rounding_makes_them_no_longer() {
        let welch = Welch::new(100.0, 0.5);
        for i in 0..welch.hop() {
            assert!((welch.window[i] + welch.window[i + welch.hop()] - 1.0).abs() < 1e-14, "{:?}", welch.window);
        }
        let time = 0.1 + 0.2;
        assert!(20.0 * time > 6.0);
        assert_eq!(Welch::new(20.0, time).length(), 6);
    }
}
