//! Friction of the patches of an interface.

use super::{FrictionLaw, Memory, Remembered};

/// Friction of the patches of an interface: one law of all of them, or one of each.
///
/// ```
/// use railsqueal::friction::{FrictionLaw, PatchFriction};
///
/// let tread = FrictionLaw::Constant(0.4);
/// let flange = FrictionLaw::Constant(0.1);
/// let friction = PatchFriction::new(tread.clone(), vec![flange.clone()]);
/// assert_eq!((friction.law(0), friction.law(1)), (&tread, &flange));
/// assert!(PatchFriction::from(tread).only().is_some());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct PatchFriction {
    first: FrictionLaw,
    /// Laws of the patches behind the first one; empty where all have its law.
    others: Vec<FrictionLaw>,
}

impl<L: Into<FrictionLaw>> From<L> for PatchFriction {
    fn from(law: L) -> Self {
        Self { first: law.into(), others: Vec::new() }
    }
}

impl PatchFriction {
    /// Friction with a law for the first patch and for each of the `others`, `[patches - 1]`.
    pub fn new(first: FrictionLaw, mut others: Vec<FrictionLaw>) -> Self {
        if others.iter().all(|law| *law == first) {
            others.clear();
        }
        Self { first, others }
    }

    /// The law of a patch.
    #[inline]
    pub fn law(&self, patch: usize) -> &FrictionLaw {
        match patch {
            0 => &self.first,
            _ => self.others.get(patch - 1).unwrap_or(&self.first),
        }
    }

    /// The law of all patches, where they have the same one.
    pub fn only(&self) -> Option<&FrictionLaw> {
        self.others.is_empty().then_some(&self.first)
    }

    /// True if the laws are those of an interface of `patches` patches.
    pub(crate) fn fits(&self, patches: usize) -> bool {
        self.others.is_empty() || self.others.len() + 1 == patches
    }

    /// The different laws, or the one of all patches.
    pub(crate) fn laws(&self) -> impl Iterator<Item = &FrictionLaw> {
        std::iter::once(&self.first).chain(&self.others)
    }

    /// True if no coefficient depends on the velocity.
    pub fn is_constant(&self) -> bool {
        self.laws().all(FrictionLaw::is_constant)
    }

    /// The largest coefficient of all patches at all velocities.
    pub fn largest(&self) -> f64 {
        self.laws().map(FrictionLaw::largest).fold(0.0, f64::max)
    }

    /// The memory of the first law that has one.
    pub(crate) fn memory(&self) -> Option<Memory> {
        self.laws().find_map(FrictionLaw::memory)
    }

    /// The same friction with a memory of the length `length`, m, in the first law that has one, and those of the
    /// others in proportion.
    pub(crate) fn remembering(&self, length: f64) -> Self {
        let Some(first) = self.memory() else { return self.clone() };
        let changed = |law: &FrictionLaw| match law.memory() {
            Some(own) => law.remembering(if own == first { length } else { own.length * (length / first.length) }),
            None => law.clone(),
        };
        Self { first: changed(&self.first), others: self.others.iter().map(changed).collect() }
    }

    /// Coefficients of nodes that slide at the velocities `v` ≥ 0 and their slopes, s/m, `[k]` each, with the `patch`
    /// of each node, `[k]`, or none where there is one, and what they remember, as
    /// [`FrictionLaw::renewed_with_slopes`] has them.
    pub(crate) fn renewed_with_slopes(
        &self,
        patch: &[usize],
        before: &[Remembered],
        v: &[f64],
    ) -> (Vec<f64>, Vec<f64>) {
        if self.others.is_empty() || patch.is_empty() {
            return self.first.renewed_with_slopes(before, v);
        }
        let (mut mu, mut slope) = (vec![0.0; v.len()], vec![0.0; v.len()]);
        for (c, law) in self.laws().enumerate() {
            let own: Vec<usize> = (0..v.len()).filter(|&i| patch[i] == c).collect();
            let remembered: Vec<Remembered> = own.iter().filter_map(|&i| before.get(i).copied()).collect();
            let velocities: Vec<f64> = own.iter().map(|&i| v[i]).collect();
            let found = law.renewed_with_slopes(&remembered, &velocities);
            for (k, &i) in own.iter().enumerate() {
                (mu[i], slope[i]) = (found.0[k], found.1[k]);
            }
        }
        (mu, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Exponential, Rational};
    use super::*;

    #[test]
    fn nodes_have_the_coefficients_of_the_laws_of_their_patches() {
        let laws: [FrictionLaw; 3] = [
            Exponential::new(0.4, 0.2, 0.3).into(),
            FrictionLaw::Constant(0.1),
            FrictionLaw::from(Rational::new(0.3, 0.2, 0.5)).remembering(5e-5),
        ];
        let friction = PatchFriction::new(laws[0].clone(), laws[1..].to_vec());
        let patch = [2, 0, 1, 1, 0, 2, 2];
        let v: Vec<f64> = (0..7).map(|i| 0.07 * f64::from(i)).collect();
        let own = |i: usize| Remembered { own: 0.3, upstream: 0.25 + 0.01 * i as f64, step: 1e-5, passage: 1e-4 };
        let before: Vec<Remembered> = (0..7).map(own).collect();
        for before in [&before[..], &[]] {
            let (mu, slope) = friction.renewed_with_slopes(&patch, before, &v);
            for i in 0..7 {
                let own = before.get(i).map_or(&[][..], std::slice::from_ref);
                let (one, by) = laws[patch[i]].renewed_with_slopes(own, &v[i..=i]);
                assert_eq!((mu[i], slope[i]), (one[0], by[0]), "node {i}");
            }
        }
        assert_eq!(friction.largest(), 0.4);
        assert!(!friction.is_constant() && friction.fits(3) && !friction.fits(2));
    }

    #[test]
    fn memories_change_in_proportion() {
        let of = |length| FrictionLaw::from(Exponential::new(0.4, 0.2, 0.3)).remembering(length);
        let friction = PatchFriction::new(FrictionLaw::Constant(0.2), vec![of(2e-5), of(5e-5)]);
        let changed = friction.remembering(4e-6);
        let lengths: Vec<Option<f64>> = changed.laws().map(|law| law.memory().map(|m| m.length)).collect();
        assert_eq!(lengths[..2], [None, Some(4e-6)]);
        assert!((lengths[2].unwrap() - 1e-5).abs() < 1e-20, "{lengths:?}");
    }

    #[test]
    fn equal_laws_are_one() {
        let law = FrictionLaw::Constant(0.3);
        assert_eq!(PatchFriction::new(law.clone(), vec![law.clone(), law.clone()]).only(), Some(&law));
    }
}
