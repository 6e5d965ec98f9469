//! Interpolation of the forces of the contact over λ, along the frequencies of the modes: Chebyshev polynomials of ln
//! λ.

use super::{CondensedContact, C};
use faer::Mat;
use std::f64::consts::FRAC_PI_2;

/// Least and largest degree that is tried.
const DEGREES: [usize; 2] = [8, 128];
/// Distance from the imaginary axis, in logarithms of λ, of the singularities of the contact: its relaxations are
/// strongly damped and lie near the negative axis.
const SMOOTH: f64 = FRAC_PI_2;
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

/// Degree that is tried first, by the decay of the coefficients of a function that is smooth beside an interval of this
/// `half` length, e^(−k asinh(d/half)) at a distance d of its singularities (L. N. Trefethen, Approximation Theory and
/// Approximation Practice, SIAM, 2013, theorem 8.1), down to a part `left`.
fn first_degree(half: f64, left: f64) -> usize {
    let decay = (SMOOTH / half).asinh();
    let degree = (-left.ln() / decay).ceil().min(0.5 * DEGREES[1] as f64) as usize + 2;
    degree.next_multiple_of(2).max(DEGREES[0])
}

impl ChebyshevStiffness {
    /// Polynomials between these angular frequencies whose last coefficients are a part `left` of the largest one; none
    /// where they do not settle.
    pub fn new(contact: &CondensedContact, [low, high]: [f64; 2], left: f64) -> Option<Self> {
        let (middle, half) = (0.5 * (low.ln() + high.ln()), 0.5 * (high / low).ln());
        let r = contact.rank;
        let mut known: Vec<Mat<C>> = Vec::new();
        let first = first_degree(half, left);
        // The points of each degree are among those of twice as many.
        for degree in std::iter::successors(Some(first), |d| Some(2 * d)).take_while(|d| *d <= DEGREES[1]) {
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
