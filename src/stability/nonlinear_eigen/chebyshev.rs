//! Interpolation of the forces of the contact over λ, along the frequencies of the modes: Chebyshev polynomials of ln
//! λ.

use super::{CondensedContact, C};
use faer::Mat;

/// Degrees that are tried, one after the other; the points of each are among those of the next.
const DEGREES: [usize; 5] = [8, 16, 32, 64, 128];
/// Part of the largest coefficient that the last ones may have.
const LEFT: f64 = 1e-12;
/// Part that is nothing.
const NOTHING: f64 = 1e-15;
/// Logarithm by which what is left may have grown beside the interval.
const DIGITS: f64 = 10.0;
/// How far a root may lie beyond the interval, in its half lengths.
const BEYOND: f64 = 1.1;

/// The forces K on y, per y, as functions of λ.
pub(super) struct ChebyshevStiffness {
    degree: usize,
    middle: f64,
    half: f64,
    /// Coefficients of K by columns, `[r², kept]`.
    stiffness: Mat<C>,
    /// Polynomials whose coefficients are more than rounding.
    kept: usize,
}

impl ChebyshevStiffness {
    /// Between these angular frequencies; none where the polynomials do not settle.
    pub fn new(contact: &CondensedContact, range: [f64; 2]) -> Option<Self> {
        Self::to_precision(contact, range, LEFT)
    }

    /// The same with a part `left` of the largest coefficient that the last ones may have.
    pub fn to_precision(contact: &CondensedContact, [low, high]: [f64; 2], left: f64) -> Option<Self> {
        let (middle, half) = (0.5 * (low.ln() + high.ln()), 0.5 * (high / low).ln());
        let r = contact.rank;
        let mut known: Vec<Mat<C>> = Vec::new();
        for degree in DEGREES {
            let node = |k: usize| {
                let x = (std::f64::consts::PI * k as f64 / degree as f64).cos();
                contact.stiffness(C::new(0.0, (middle + half * x).exp()))
            };
            let mut old = std::mem::take(&mut known).into_iter();
            known = match old.len() {
                0 => (0..=degree).map(node).collect(),
                _ => (0..=degree).filter_map(|k| if k % 2 == 0 { old.next() } else { Some(node(k)) }).collect(),
            };
            // Values at the points to coefficients.
            let weight = Mat::from_fn(degree + 1, degree + 1, |k, j| {
                let ends = |k: usize| if k == 0 || k == degree { 0.5 } else { 1.0 };
                let phase = std::f64::consts::PI * ((k * j) % (2 * degree)) as f64 / degree as f64;
                C::from(2.0 / degree as f64 * ends(k) * ends(j) * phase.cos())
            });
            let values = Mat::from_fn(r * r, degree + 1, |i, k| known[k][(i % r, i / r)]);
            let stiffness = values * &weight;
            let sizes: Vec<f64> =
                stiffness.col_iter().map(|c| c.iter().map(|v| v.norm()).fold(0.0, f64::max)).collect();
            let largest = |from: usize| sizes[from..].iter().copied().fold(0.0, f64::max);
            if !(largest(degree - 2) <= left * largest(0)) {
                continue;
            }
            let kept = (0..=degree).rev().find(|&j| sizes[j] > NOTHING * largest(0)).unwrap_or(0) + 1;
            let stiffness = stiffness.subcols(0, kept).to_owned();
            return Some(Self { degree, middle, half, stiffness, kept });
        }
        None
    }

    /// Place of λ on the interval, −1 to 1.
    fn place(&self, lambda: C) -> C {
        ((lambda / C::i()).ln() - self.middle) / self.half
    }

    /// Returns whether λ lies where the polynomials hold; how well they do is judged by the eigenpair.
    pub fn covers(&self, lambda: C) -> bool {
        self.place(lambda).re.abs() <= BEYOND
    }

    /// Returns whether λ lies beside the interval, so near that the polynomials hold there but for some digits.
    pub fn holds(&self, lambda: C) -> bool {
        self.place(lambda).re.abs() <= 1.0 && self.is_near(lambda)
    }

    /// Returns whether λ lies so near to the interval that the polynomials hold as well as on it, but for some digits.
    pub fn is_near(&self, lambda: C) -> bool {
        self.place(lambda).im.abs() * self.degree as f64 <= DIGITS
    }

    /// The polynomials at λ and their derivatives by λ, `[kept]` each.
    fn polynomials(&self, lambda: C) -> (Vec<C>, Vec<C>) {
        let x = self.place(lambda);
        // Far outside nothing is known; they are bounded there, so that whoever is there can come back.
        let x = C::new(x.re.clamp(-BEYOND, BEYOND), x.im.clamp(-0.5, 0.5));
        let by = (lambda * self.half).inv();
        let (mut t, mut d) = (vec![C::from(1.0), x], vec![C::default(), C::from(1.0)]);
        for k in 1..self.kept.max(2) - 1 {
            t.push(2.0 * x * t[k] - t[k - 1]);
            d.push(2.0 * t[k] + 2.0 * x * d[k] - d[k - 1]);
        }
        (t, d.into_iter().map(|d| d * by).collect())
    }

    /// K at each of `values`, by columns, one after the other, `[r²]` each.
    pub fn stiffness(&self, values: &[C]) -> Vec<C> {
        self.combined(&values.iter().map(|v| self.polynomials(*v).0).collect::<Vec<_>>())
    }

    /// The same of K and dK/dλ.
    pub fn stiffnesses(&self, values: &[C]) -> [Vec<C>; 2] {
        let (t, d): (Vec<Vec<C>>, Vec<Vec<C>>) = values.iter().map(|v| self.polynomials(*v)).unzip();
        [&t, &d].map(|p| self.combined(p))
    }

    /// Combination of the coefficients of K by these polynomials, of each place.
    fn combined(&self, p: &[Vec<C>]) -> Vec<C> {
        let product = &self.stiffness * Mat::from_fn(self.kept, p.len(), |k, l| p[l][k]);
        product.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<C>>()).collect()
    }
}
