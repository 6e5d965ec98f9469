//! Modes of a mirror-symmetric body from one half of its section: two problems of half the size in place of one, and
//! either kind of modes by itself. The matrices of both kinds differ in the rows of the middle plane alone, which come
//! last: both have one factor but for these rows.

use super::modes::{near_limit, with_factor, FourierModes};
use super::{Forms, Mirror, Parity};
use crate::Result;
use faer::Mat;
use std::f64::consts::FRAC_1_SQRT_2;

/// Squares of frequencies that differ by less than this part are the same: the symmetric mode comes first.
const SAME: f64 = 1e-11;

/// One half of a mirror-symmetric section, for the symmetric and for the antisymmetric modes.
pub struct HalfSections<'m> {
    mirror: &'m Mirror,
    /// For symmetric and for antisymmetric motions.
    halves: [Forms; 2],
}

impl<'m> HalfSections<'m> {
    /// The halves of `forms` on one side of the plane of `mirror`; none where the body is not symmetric about it with
    /// all that holds it.
    pub fn new(forms: &Forms, mirror: &'m Mirror) -> Option<Self> {
        let half = |parity| forms.half(mirror, parity);
        Some(Self { mirror, halves: [half(Parity::Symmetric)?, half(Parity::Antisymmetric)?] })
    }

    /// Numbers of symmetric and of antisymmetric modes of the order `n` below ω = `limit`, rad/s, from the inertia of
    /// K_n − ω²M.
    pub fn below(&self, n: usize, limit: f64) -> Result<[usize; 2]> {
        let [one, other] = &self.halves;
        Ok(near_limit(limit, |square| one.factor_both(other, n, square))?.map(|factor| factor.negative()))
    }

    /// All modes of the order `n` up to ω = `limit`, rad/s, with amplitudes of `whole`, the forms of the whole section,
    /// and the parity of each, 1 or −1.
    pub fn of_order(&self, whole: &Forms, n: usize, limit: f64) -> Result<(FourierModes, Vec<f64>)> {
        let counts = self.below(n, limit)?;
        let mut list = Vec::new();
        let mut found = Vec::new();
        if counts != [0, 0] {
            let [one, other] = &self.halves;
            let factors = one.factor_both(other, n, one.shift())?;
            let kinds = self.halves.iter().zip([Parity::Symmetric, Parity::Antisymmetric]);
            for (place, (factor, (half, parity))) in factors.into_iter().zip(kinds).enumerate() {
                let modes = with_factor(half, n, (limit, counts[place]), factor)?;
                list.extend((0..modes.omega.len()).map(|k| (modes.omega[k], place, k)));
                found.push((modes, half, parity.sign()));
            }
        }
        list.sort_by(|a, b| a.0.total_cmp(&b.0));
        for k in 1..list.len() {
            let [square, next] = [list[k - 1].0.powi(2), list[k].0.powi(2)];
            if list[k - 1].1 > list[k].1 && next - square <= SAME * next {
                list.swap(k - 1, k);
                // Frequencies stay in their order.
                let lower = list[k].0;
                (list[k].0, list[k - 1].0) = (list[k - 1].0, lower);
            }
        }
        let mut vectors = Mat::zeros(whole.order(), list.len());
        for node in 0..whole.section.nodes.len() {
            let Some(to) = whole.amplitude(node) else { continue };
            for (column, &(_, place, k)) in list.iter().enumerate() {
                let (modes, half, sign) = &found[place];
                let (from, factors) = match half.amplitude(node) {
                    Some(from) => (from, [1.0; 3]),
                    None => match half.amplitude(self.mirror.image(node)) {
                        Some(from) => (from, [*sign, *sign, -sign]),
                        None => continue,
                    },
                };
                for c in 0..3 {
                    vectors[(to + c, column)] = FRAC_1_SQRT_2 * factors[c] * modes.vectors[(from + c, k)];
                }
            }
        }
        let modes = FourierModes {
            order: n,
            omega: list.iter().map(|at| at.0).collect(),
            vectors,
            residual: list.iter().map(|&(_, place, k)| found[place].0.residual[k]).collect(),
        };
        Ok((modes, list.iter().map(|&(_, place, _)| found[place].2).collect()))
    }
}
