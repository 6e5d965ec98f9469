//! Random inputs and what follows from them: sequences of points in the unit cube, distributions, confidence
//! intervals, Sobol' indices. It knows nothing of mechanics; every function is the same on every machine and rank.

pub(crate) mod cube;
pub mod distribution;
pub(crate) mod indices;
pub(crate) mod interval;
mod joe_kuo;

/// A stream of random numbers, SplitMix64 (G. L. Steele, D. Lea, C. H. Flood, Fast splittable pseudorandom number
/// generators, OOPSLA 2014).
#[derive(Debug, Clone)]
pub struct Stream(u64);

impl Stream {
    /// The stream of a `seed` and of what it is for.
    pub fn new(seed: u64, purpose: u64) -> Self {
        Self(mixed(seed ^ mixed(purpose.wrapping_add(STEP))))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(STEP);
        mixed(self.0)
    }

    /// A number between 0 and 1, neither of them included.
    pub fn unit(&mut self) -> f64 {
        ((self.bits() >> 12) as f64 + 0.5) / (1u64 << 52) as f64
    }

    /// A number from 0 to `n` − 1.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }
}

/// The increment of SplitMix64, 2⁶⁴ over the golden ratio.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

/// The output function of SplitMix64.
fn mixed(z: u64) -> u64 {
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first outputs for the seed 1234567 of the reference implementation (S. Vigna, splitmix64.c).
    #[test]
    fn the_stream_is_splitmix64() {
        let mut stream = Stream(1_234_567);
        let first: Vec<u64> = (0..3).map(|_| stream.bits()).collect();
        assert_eq!(first, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn units_are_inside_and_uniform() {
        let mut stream = Stream::new(1, 2);
        let all: Vec<f64> = (0..40_000).map(|_| stream.unit()).collect();
        assert!(all.iter().all(|u| *u > 0.0 && *u < 1.0));
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let spread = all.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / all.len() as f64;
        assert!((mean - 0.5).abs() < 0.005 && (spread - 1.0 / 12.0).abs() < 0.001, "{mean} {spread}");
        assert!((0..1000).all(|_| stream.below(7) < 7));
    }
}
