//! Loads of contact patches: rigid motions that press them together, each prescribed or with a prescribed resultant.
//!
//! Motion d_j makes the gap of patch c fall by n_cj per unit, and the reactions R = (t_x, t_y, p) of the nodes of c act
//! on it by the row (g_x, g_y, g_n) of c:
//!
//! g = g0 − Σ_j n_cj d_j + (W R)_n ≥ 0,   Σ_c Σ_i (g_x t_x + g_y t_y + g_n p)_i = F_j.
//!
//! Either d_j is given or F_j. A load N of one patch alone is the motion n = 1 of that patch with the row (0, 0, 1).
//!
//! **One vertical motion of several patches.** The upper body sinks by z, and the normal of patch c, from the lower
//! body to the upper one, is (sin δ_c, cos δ_c) along (y to the right, up), its lateral tangent (cos δ_c, −sin δ_c).
//! So n_c = cos δ_c. The upper body bears p n − t_y y of a node, the vertical part of which is p cos δ_c + t_y sin δ_c:
//! the row is (0, sin δ_c, cos δ_c). With friction, t_y = −μ p τ_y, that is Q = Σ N (cos δ − μ τ_y sin δ).
//!
//! **A lateral motion beside it.** Where the upper body moves by y to the right as well, the gap of patch c falls by
//! −y sin δ_c, and the upper body bears laterally p sin δ_c − t_y cos δ_c of a node, that is
//! Y = Σ N (sin δ + μ τ_y cos δ). The row is that of the force on the lower body, (0, cos δ_c, −sin δ_c), whose
//! resultant is −Y: so the problem without friction stays symmetric. In full sliding Q and Y determine the normal
//! forces of two patches by themselves; of more patches the motions decide.

use super::steady::PatchResultant;
use crate::{Error, Result};
use faer::Mat;

/// Normal load: the quantity that presses the bodies together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NormalLoad {
    /// Given resultant, N; the motion is found. Of one patch alone its total normal force and approach.
    Force(f64),
    /// Given motion, m: of one patch alone its approach; the force is found.
    Approach(f64),
}

/// A rigid motion of the bodies towards each other, and how it is loaded.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedMotion {
    /// Fall of the gap of each patch per unit of the motion, n_c, `[patches]`.
    pub factors: Vec<f64>,
    /// Row (g_x, g_y, g_n) of each patch in the resultant, `[patches]`.
    pub resultant: Vec<[f64; 3]>,
    /// Its resultant or itself.
    pub load: NormalLoad,
}

impl LoadedMotion {
    /// Its resultant by the forces of the `patches`, N.
    pub(super) fn borne(&self, patches: &[PatchResultant]) -> f64 {
        let of = |(g, p): (&[f64; 3], &PatchResultant)| g[0] * p.force[0] + g[1] * p.force[1] - g[2] * p.force[2];
        self.resultant.iter().zip(patches).map(of).sum()
    }
}

/// The loads of an interface.
#[derive(Debug, Clone, PartialEq)]
pub struct Loads {
    /// The rigid motions.
    pub motions: Vec<LoadedMotion>,
    /// Normal force of each patch that a solution begins with, N, `[patches]`, of loads that patches without friction
    /// may be unable to bear; otherwise a solution begins with the loads themselves, borne without friction.
    pub begin: Option<Vec<f64>>,
}

impl From<NormalLoad> for Loads {
    /// The load of an interface of one patch.
    fn from(load: NormalLoad) -> Self {
        Self::of_patches(&[load])
    }
}

impl Loads {
    /// A load or an approach for each patch by itself.
    pub fn of_patches(loads: &[NormalLoad]) -> Self {
        let unit = |c: usize, k: usize| if c == k { 1.0 } else { 0.0 };
        let motion = |(k, &load): (usize, &NormalLoad)| LoadedMotion {
            factors: (0..loads.len()).map(|c| unit(c, k)).collect(),
            resultant: (0..loads.len()).map(|c| [0.0, 0.0, unit(c, k)]).collect(),
            load,
        };
        Self { motions: loads.iter().enumerate().map(motion).collect(), begin: None }
    }

    /// One vertical motion of the upper body that all patches share, with the contact angles δ (rad, `[patches]`),
    /// positive where the lower surface falls to the right (towards +y). The load is the total vertical force or the
    /// displacement downwards.
    pub fn vertical(angles: &[f64], load: NormalLoad) -> Self {
        let motion = LoadedMotion {
            factors: angles.iter().map(|d| d.cos()).collect(),
            resultant: angles.iter().map(|d| [0.0, d.sin(), d.cos()]).collect(),
            load,
        };
        Self { motions: vec![motion], begin: None }
    }

    /// A vertical and a lateral motion of the upper body that all patches share, with the contact angles δ (rad,
    /// `[patches]`), under the `vertical` force of the upper body on the lower one and the `lateral` force of the lower
    /// body on the upper one, N, positive to the right. A solution begins with the normal forces `begin`, N,
    /// `[patches]`.
    pub fn vertical_and_lateral(angles: &[f64], [vertical, lateral]: [f64; 2], begin: Vec<f64>) -> Self {
        let mut loads = Self::vertical(angles, NormalLoad::Force(vertical));
        loads.motions.push(LoadedMotion {
            factors: angles.iter().map(|d| -d.sin()).collect(),
            resultant: angles.iter().map(|d| [0.0, d.cos(), -d.sin()]).collect(),
            load: NormalLoad::Force(-lateral),
        });
        Self { begin: Some(begin), ..loads }
    }

    /// The load of the one patch that there is, where that is all; none of others.
    pub(super) fn of_one_patch(&self) -> Option<NormalLoad> {
        match &self.motions[..] {
            [m] if m.factors == [1.0] && m.resultant == [[0.0, 0.0, 1.0]] => Some(m.load),
            _ => None,
        }
    }

    /// Returns whether motion `j` bears nothing, so that its patches stay open, the nearest of them just touching. A
    /// resultant of 0 beside that of another motion of the same patches is a balance of forces.
    pub(crate) fn is_lifted(&self, j: usize) -> bool {
        let motion = &self.motions[j];
        let alone = |(c, &n): (usize, &f64)| n == 0.0 || (n > 0.0 && self.leading(c) == Some(j));
        motion.load == NormalLoad::Force(0.0) && motion.factors.iter().enumerate().all(alone)
    }

    /// Returns whether motion `j` is to be found from its resultant.
    pub(crate) fn is_unknown(&self, j: usize) -> bool {
        matches!(self.motions[j].load, NormalLoad::Force(_)) && !self.is_lifted(j)
    }

    /// The motions that are to be found from their resultants.
    pub(super) fn unknown(&self) -> Vec<usize> {
        (0..self.motions.len()).filter(|&j| self.is_unknown(j)).collect()
    }

    /// Returns whether patch `c` stays open because nothing presses it.
    pub(crate) fn is_open(&self, c: usize) -> bool {
        (0..self.motions.len()).any(|j| self.motions[j].factors[c] != 0.0 && self.is_lifted(j))
    }

    /// The first motion that moves patch `c`.
    pub(super) fn leading(&self, c: usize) -> Option<usize> {
        self.motions.iter().position(|m| m.factors[c] != 0.0)
    }

    /// Load of patch `c` as if it bore its motion alone: its order of magnitude.
    pub(super) fn of_patch(&self, c: usize) -> NormalLoad {
        if let Some(begin) = &self.begin {
            return NormalLoad::Force(begin[c]);
        }
        let Some(j) = self.leading(c) else { return NormalLoad::Approach(0.0) };
        let motion = &self.motions[j];
        let row = motion.resultant[c][2].abs().max(f64::MIN_POSITIVE);
        match motion.load {
            NormalLoad::Force(f) => NormalLoad::Force((f / row).abs()),
            NormalLoad::Approach(d) => NormalLoad::Approach(motion.factors[c] * d),
        }
    }

    /// The loads without friction that a solution begins with, where those are others.
    pub(super) fn at_first(&self) -> Option<Loads> {
        let forces: Vec<NormalLoad> = self.begin.as_ref()?.iter().map(|&f| NormalLoad::Force(f)).collect();
        Some(Self::of_patches(&forces))
    }

    /// The same patches with the motions prescribed as `motions`, m, `[motions]`.
    pub(super) fn held_at(&self, motions: &[f64]) -> Self {
        let held =
            |(motion, &d): (&LoadedMotion, &f64)| LoadedMotion { load: NormalLoad::Approach(d), ..motion.clone() };
        Self { motions: self.motions.iter().zip(motions).map(held).collect(), begin: None }
    }

    /// The motions, m, `[motions]`, that come nearest to the `approaches` of the patches, m, `[patches]`, by least
    /// squares; those that are prescribed as they are.
    pub(super) fn nearest_motions(&self, approaches: &[f64]) -> Vec<f64> {
        let (unknown, mut motions) = (self.unknown(), self.prescribed());
        let rest: Vec<f64> = approaches.iter().enumerate().map(|(c, d)| d - self.approach(&motions, c)).collect();
        let factors = |j: usize| &self.motions[j].factors;
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let mut matrix: Vec<f64> =
            unknown.iter().flat_map(|&l| unknown.iter().map(move |&j| product(factors(l), factors(j)))).collect();
        let mut rhs: Vec<f64> = unknown.iter().map(|&l| product(factors(l), &rest)).collect();
        if solve_small(&mut matrix, &mut rhs) {
            unknown.iter().zip(&rhs).for_each(|(&j, d)| motions[j] = *d);
        }
        motions
    }

    /// The motions that are prescribed; 0 for the others, `[motions]`.
    pub(super) fn prescribed(&self) -> Vec<f64> {
        let of = |m: &LoadedMotion| if let NormalLoad::Approach(d) = m.load { d } else { 0.0 };
        self.motions.iter().map(of).collect()
    }

    /// Approach of patch `c` under the `motions`, m.
    pub fn approach(&self, motions: &[f64], c: usize) -> f64 {
        self.motions.iter().zip(motions).map(|(m, d)| m.factors[c] * d).sum()
    }

    /// Force by which the resultant of motion `j` is measured, N.
    pub(super) fn scale(&self, j: usize) -> f64 {
        let size = |m: &LoadedMotion| if let NormalLoad::Force(f) = m.load { f.abs() } else { 0.0 };
        match size(&self.motions[j]) {
            own if own > 0.0 => own,
            _ => self.motions.iter().map(size).fold(f64::MIN_POSITIVE, f64::max),
        }
    }

    /// Resultant of motion `j` by the forces of the `patches` less the given one, over the largest given one; 0 of a
    /// motion that is prescribed.
    pub(super) fn error(&self, j: usize, patches: &[PatchResultant]) -> f64 {
        let NormalLoad::Force(f) = self.motions[j].load else { return 0.0 };
        let largest = (0..self.motions.len()).map(|l| self.scale(l)).fold(0.0, f64::max);
        (self.motions[j].borne(patches) - f) / largest
    }

    /// Refuses loads that do not belong to `patches` patches, or that no contact with the largest coefficient of
    /// friction `friction` can bear.
    pub fn check(&self, patches: usize, friction: f64) -> Result<()> {
        let fits = |m: &LoadedMotion| [m.factors.len(), m.resultant.len()] == [patches; 2];
        let begins = self.begin.as_ref().is_none_or(|forces| forces.len() == patches);
        if self.motions.is_empty() || !begins || !self.motions.iter().all(fits) {
            return Err(Error::Defect(format!("contact: {} loads for {patches} patches", self.motions.len())));
        }
        for (j, motion) in self.motions.iter().enumerate() {
            let of = match self.motions.len() {
                1 => String::new(),
                _ => format!(" of motion {}", j + 1),
            };
            let numbers = motion.factors.iter().chain(motion.resultant.as_flattened());
            if numbers.clone().any(|v| !v.is_finite()) {
                return Err(Error::Defect(format!("contact: a load{of} with factors that are not finite")));
            }
            if motion.factors.iter().all(|&n| n == 0.0) {
                return Err(Error::Job(format!(
                    "contact: the load{of} moves no contact along its normal, so that it cannot be borne; \
                     leave it out, or give contacts whose normals are not across it"
                )));
            }
            // By friction each newton of pressure adds up to μ|g_t|.
            let most = |sign: f64| {
                let of = |g: &[f64; 3]| sign * g[2] + friction * g[0].hypot(g[1]);
                motion.resultant.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
            };
            match motion.load {
                NormalLoad::Approach(d) if !d.is_finite() => {
                    return Err(Error::Job(format!("contact.approach{of} is {d} m: it must be finite")));
                }
                NormalLoad::Force(f) if !f.is_finite() || (f < 0.0 && most(-1.0) <= 0.0) => {
                    return Err(Error::Job(format!(
                        "contact.normal_load{of} is {f} N: it must be at least 0 (pressing)"
                    )));
                }
                NormalLoad::Force(f) if (f < 0.0 && most(-1.0) <= 0.0) || (f > 0.0 && most(1.0) <= 0.0) => {
                    return Err(Error::Job(format!(
                        "contact.normal_load{of} is {f} N: no contact presses that way, with or without friction; \
                         give contacts whose normals have a part along it"
                    )));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Forces on k closed nodes, N, `[k]`, and the motions, m, `[motions]`: `solved` holds A⁻¹ times the factors n of
    /// each motion at the nodes and A⁻¹ times the undeformed gaps, `[k, motions + 1]`; `row` is the part of each
    /// node's pressure in the resultant of a motion, `(motion, node)`. None where the resultants do not determine
    /// the motions.
    pub(crate) fn forces(&self, solved: &Mat<f64>, row: impl Fn(usize, usize) -> f64) -> Option<(Vec<f64>, Vec<f64>)> {
        let k = solved.nrows();
        let unknown = self.unknown();
        let mut motions = self.prescribed();
        let sum = |j: usize, c: usize| (0..k).map(|i| row(j, i) * solved[(i, c)]).sum::<f64>();
        let last = self.motions.len();
        let mut matrix: Vec<f64> = Vec::new();
        let mut rhs = Vec::new();
        for &l in &unknown {
            let NormalLoad::Force(f) = self.motions[l].load else { continue };
            matrix.extend(unknown.iter().map(|&j| sum(l, j)));
            let given = motions.iter().enumerate().filter(|(_, d)| **d != 0.0).map(|(j, d)| d * sum(l, j)).sum::<f64>();
            rhs.push(f + sum(l, last) - given);
        }
        if !solve_small(&mut matrix, &mut rhs) {
            return None;
        }
        unknown.iter().zip(&rhs).for_each(|(&j, d)| motions[j] = *d);
        let force = |i: usize| (0..last).map(|j| motions[j] * solved[(i, j)]).sum::<f64>() - solved[(i, last)];
        Some(((0..k).map(force).collect(), motions))
    }
}

/// Solves the small system of `matrix`, by rows, for `rhs`, in place, by elimination with pivots; false where it is
/// singular.
pub(crate) fn solve_small(matrix: &mut [f64], rhs: &mut [f64]) -> bool {
    let n = rhs.len();
    for k in 0..n {
        let size = |i: usize| matrix[n * i + k].abs();
        let pivot = (k..n).max_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(k);
        if !(size(pivot) > 0.0) {
            return false;
        }
        (0..n).for_each(|j| matrix.swap(n * k + j, n * pivot + j));
        rhs.swap(k, pivot);
        for i in k + 1..n {
            let factor = matrix[n * i + k] / matrix[n * k + k];
            (k..n).for_each(|j| matrix[n * i + j] -= factor * matrix[n * k + j]);
            rhs[i] -= factor * rhs[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| matrix[n * k + j] * rhs[j]).sum();
        rhs[k] = (rhs[k] - known) / matrix[n * k + k];
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two springs of 2 and 4 m/N with gaps of 1 and 0 m.
    #[test]
    fn the_approach_is_given_or_carries_the_load() {
        let solved = Mat::from_fn(2, 2, |i, c| [[0.5, 0.5], [0.25, 0.0]][i][c]);
        let forces = |load: NormalLoad| Loads::from(load).forces(&solved, |_, _| 1.0).unwrap();
        assert_eq!(forces(NormalLoad::Approach(3.0)), (vec![1.0, 0.75], vec![3.0]));
        assert_eq!(forces(NormalLoad::Force(1.75)), (vec![1.0, 0.75], vec![3.0]));
    }

    /// Springs of 1 and 0.5 m/N under 0.82 N vertically, at normals with the cosines 0.6 and 0.8: z (0.36 + 1.28) is
    /// the load.
    #[test]
    fn a_shared_motion_presses_each_patch_by_its_angle() {
        let loads = Loads::vertical(&[(0.6f64).acos(), -(0.8f64).acos()], NormalLoad::Force(0.82));
        let n = [0.6, 0.8];
        let solved = Mat::from_fn(2, 2, |i, c| if c == 0 { n[i] / [1.0, 0.5][i] } else { 0.0 });
        let (force, motions) = loads.forces(&solved, |_, i| n[i]).unwrap();
        assert!((motions[0] - 0.5).abs() < 1e-15, "{motions:?}");
        assert!((force[0] - 0.3).abs() < 1e-15 && (force[1] - 0.8).abs() < 1e-15, "{force:?}");
        assert!((loads.approach(&motions, 1) - 0.4).abs() < 1e-15);
        // A node that slides towards +y (τ_y = 1) on a surface that falls to the right bears less of the load.
        let [_, y, n] = loads.motions[0].resultant[0];
        assert!((n - 0.3 * y - (0.6 - 0.3 * 0.8)).abs() < 1e-15);
    }

    #[test]
    fn loads_that_cannot_be_borne_are_refused() {
        let message = |loads: &Loads, mu: f64| loads.check(loads.motions[0].factors.len(), mu).unwrap_err().to_string();
        assert!(message(&NormalLoad::Force(-1.0).into(), 0.3).contains("contact.normal_load is -1 N"));
        assert!(message(&NormalLoad::Approach(f64::NAN).into(), 0.3).contains("contact.approach"));
        let mut across = Loads::vertical(&[0.1, 0.2], NormalLoad::Force(1.0));
        across.motions[0].factors = vec![0.0; 2];
        assert!(message(&across, 0.3).contains("moves no contact along its normal"));
        // Upside down: nothing presses upwards; with friction the steep one could.
        let down = Loads::vertical(&[3.0, 1.7], NormalLoad::Force(1.0));
        assert!(message(&down, 0.1).contains("no contact presses that way"));
        down.check(2, 0.3).unwrap();
        assert!(Loads::from(NormalLoad::Force(1.0)).check(2, 0.3).is_err());
        let second = Loads::of_patches(&[NormalLoad::Force(1.0), NormalLoad::Force(-2.0)]);
        assert!(message(&second, 0.3).contains("contact.normal_load of motion 2 is -2 N"));
    }

    #[test]
    fn a_motion_without_load_keeps_its_patches_open() {
        let loads = Loads::of_patches(&[NormalLoad::Force(5.0), NormalLoad::Force(0.0), NormalLoad::Approach(1e-5)]);
        assert_eq!([0, 1, 2].map(|c| loads.is_open(c)), [false, true, false]);
        assert_eq!((loads.unknown(), loads.prescribed()), (vec![0], vec![0.0, 0.0, 1e-5]));
        // A moment of 0 about the middle presses both.
        let mut roll = loads;
        roll.motions[1] = LoadedMotion {
            factors: vec![1.0, -1.0, 0.0],
            resultant: vec![[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0; 3]],
            load: NormalLoad::Force(0.0),
        };
        assert!(!roll.is_open(1) && roll.is_unknown(1) && roll.scale(1) == 5.0);
    }

    #[test]
    fn small_systems_are_solved_with_pivots() {
        let mut x = [3.0, 8.0, 3.0];
        // Rows (0, 1, 0), (2, 0, 1), (1, 1, −1) for (2.0, 3.0, 2.0 + 3.0 − 3.0…).
        assert!(solve_small(&mut [0.0, 1.0, 0.0, 2.0, 0.0, 1.0, 1.0, 1.0, -1.0], &mut x));
        let want = [8.0 / 3.0, 3.0, 8.0 / 3.0];
        assert!(x.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-14), "{x:?}");
        assert!(!solve_small(&mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 1.0]));
    }
}
