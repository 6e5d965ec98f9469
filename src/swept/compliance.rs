//! Static compliance of a swept body at its contacts: that of a half-space and a few numbers.
//!
//! W_ij = W_hs(x_i − x_j) + π(x_i) A π(x_j)ᵀ, π = (1, x, y): A = Γ⁻¹(B − B_hs)Γ⁻¹, with B the means of the
//! displacements under the loads of [`super::LineLoad`], B_hs the same of a half-space, and Γ = ∫∫ω ππᵀ. Both are
//! sums over the orders of Fourier, whose differences fall off as soon as the waves are short against the distance to
//! the next edge: A = Σ_{n ≤ n0} B_n − B_hs(|k_x| < (n0 + ½)/R) + Σ (B_n − B_hs,n), the last sum by blocks of orders,
//! each with the value at its centre.
//!
//! Between two contacts c ≠ d, C_cd,ij = π(x_i) A_cd π(x_j)ᵀ with A_cd = Γ_c⁻¹ B_cd Γ_d⁻¹, nothing of a half-space
//! taken off. With contacts at the angles θ_c and θ_d the terms are B_cd,n times the rotation by n(θ_d − θ_c) of the
//! two families: cosines between loads of one family, sines between those of the other ones. B_cd,n falls as e^{−ns/R}
//! with the distance s across the section, and as the transform of ω where contacts lie behind each other. It is smooth
//! in n but for the rotation: it is interpolated in ln n between the centres of the blocks, by cubic polynomials, and
//! summed over every order with its own cosine and sine.

use super::half_space_load::HalfSpaceLoad;
use super::load::{LineLoad, FAMILY};
use super::load_patch::{LoadPatch, Square, LOADS};
use super::{Forms, Path, SectionContact};
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// Orders up to which each is summed by itself; along a line, waves over the height of the section, k h. What bends
/// and twists in the large goes with k⁻⁴ there, and is much.
const SINGLE: usize = 12;
const SINGLE_WAVES: f64 = 4.0;
/// First order of a block over half of its orders, round an axle and along a line: blocks grow with the order.
const SPREAD: usize = 8;
const SPREAD_WAVES: usize = 16;
/// The blocks of several contacts are narrower by this factor, since values between their centres are interpolated:
/// two thirds of the width leave a fifth of the error.
const NARROWER: [usize; 2] = [3, 2];

/// Orders at which waves are so short against the distance d to the next edge that they are those of a half-space: n
/// d/R.
const SHORT: f64 = 10.0;
/// At least so many orders.
const FEWEST: usize = 60;

/// The sum A of a body at its contacts, to be made block by block of orders.
#[derive(Debug, Clone)]
pub struct Constant<'f> {
    forms: &'f Forms,
    /// Sets of patches of the loads, one of each contact: A is made for each set.
    patches: Vec<Vec<LoadPatch>>,
    /// Spots that carry the loads, of each contact.
    contacts: Vec<SectionContact>,
    /// Last order of each contact with itself.
    own: Vec<usize>,
    /// Blocks of orders: centre and number of orders, odd.
    pub blocks: Vec<(usize, usize)>,
}

/// The blocks of orders of `forms` up to `last`, for as many contacts.
fn blocks(forms: &Forms, last: usize, contacts: usize) -> Vec<(usize, usize)> {
    let (single, spread) = match forms.path {
        Path::Axle => (SINGLE, SPREAD),
        Path::Line(_) => {
            let z = forms.section.nodes.iter().map(|x| x[0]);
            let height = z.clone().fold(f64::NEG_INFINITY, f64::max) - z.fold(f64::INFINITY, f64::min);
            ((SINGLE_WAVES / (height * forms.path.wavenumber(1))).ceil() as usize, SPREAD_WAVES)
        }
    };
    let spread = if contacts > 1 { spread * NARROWER[0] / NARROWER[1] } else { spread };
    let mut all: Vec<(usize, usize)> = (0..=single.min(last)).map(|n| (n, 1)).collect();
    let mut first = single + 1;
    while first <= last {
        let half = first / spread;
        all.push((first + half, 2 * half + 1));
        first += 2 * half + 1;
    }
    all
}

/// First order of a block.
fn first((centre, width): (usize, usize)) -> usize {
    centre - width / 2
}

impl<'f> Constant<'f> {
    /// Compliance of `forms` with the rolling radius `radius`, m, under loads on `patches`, from as many orders as the
    /// next edge asks for.
    pub fn new(forms: &'f Forms, patches: &[LoadPatch], radius: f64) -> Result<Self> {
        Self::for_contact(forms, patches, &SectionContact::level(radius))
    }

    /// The same of a contact, in its frame.
    pub(crate) fn for_contact(forms: &'f Forms, patches: &[LoadPatch], contact: &SectionContact) -> Result<Self> {
        let sets: Vec<Vec<LoadPatch>> = patches.iter().map(|&patch| vec![patch]).collect();
        Self::of_contacts(forms, &sets, std::slice::from_ref(contact))
    }

    /// The same of several contacts, each in its frame; each set of `patches` has one patch of each contact.
    pub(crate) fn of_contacts(
        forms: &'f Forms,
        patches: &[Vec<LoadPatch>],
        contacts: &[SectionContact],
    ) -> Result<Self> {
        let mut own = Vec::new();
        for (c, contact) in contacts.iter().enumerate() {
            let largest = patches.iter().map(|set| set[c].half()[1] + set[c].middle().abs()).fold(0.0, f64::max);
            own.push(last_order(forms, contact, largest)?);
        }
        let mut last = own.iter().copied().fold(FEWEST, usize::max);
        for c in 0..contacts.len() {
            for d in 0..c {
                let half =
                    patches.iter().flat_map(|set| [set[c].half()[0], set[d].half()[0]]).fold(f64::INFINITY, f64::min);
                last = last.max(last_between([&contacts[c], &contacts[d]], half));
            }
        }
        let blocks = blocks(forms, last, contacts.len());
        Ok(Self { forms, patches: patches.to_vec(), contacts: contacts.to_vec(), own, blocks })
    }

    /// The sum with the orders up to `last` in place of those by itself.
    pub fn up_to(self, last: usize) -> Self {
        let own = vec![last; self.own.len()];
        Self { blocks: blocks(self.forms, last, self.contacts.len()), own, ..self }
    }

    /// The contacts whose loads on a `set` of patches are not those of an earlier one at another place along the path,
    /// and of each contact the place among these of the one that it is like.
    fn distinct(&self, set: &[LoadPatch]) -> (Vec<usize>, Vec<usize>) {
        let (mut distinct, mut like) = (Vec::new(), Vec::new());
        for (c, contact) in self.contacts.iter().enumerate() {
            let same = |&d: &usize| set[d] == set[c] && contact.is_along(&self.contacts[d]);
            let place = distinct.iter().position(same).unwrap_or(distinct.len());
            if place == distinct.len() {
                distinct.push(c);
            }
            like.push(place);
        }
        (distinct, like)
    }

    fn half_space(&self, patch: LoadPatch) -> HalfSpaceLoad {
        let material = self.forms.material;
        HalfSpaceLoad { patch, shear: material.shear(), poisson: material.poisson }
    }

    /// −B_hs of the orders that are summed one by one, for each set of patches, `[9T, 9T]` with T contacts.
    pub fn singles(&self) -> Vec<Mat<f64>> {
        let singles = self.blocks.iter().filter(|b| b.1 == 1).count();
        let of = |set: &Vec<LoadPatch>| {
            let mut all = Mat::zeros(LOADS * set.len(), LOADS * set.len());
            for (c, (&patch, contact)) in set.iter().zip(&self.contacts).enumerate() {
                let known = contact.locally(|spot| self.half_space(patch).up_to((singles as f64 - 0.5) / spot.radius));
                put(&mut all, [c, c], &scaled([patch, patch], |a, b| -known[a][b]));
            }
            all
        };
        self.patches.iter().map(of).collect()
    }

    /// Contribution of a block, for each set of patches; factorised in the `memory` of the block before, which then
    /// holds that of this one.
    pub fn block(&self, index: usize, memory: &mut Vec<f64>) -> Result<Vec<Mat<f64>>> {
        let (n, width) = self.blocks[index];
        let forms = self.forms;
        let free = n == 0 && forms.turns_freely();
        let factor = match free {
            true => forms.factor_free(std::mem::take(memory))?,
            false => forms.factor_in(std::mem::take(memory), n, 0.0)?.positive("the statics of a swept body")?,
        };
        let solve = |first: usize, loads: MatRef<'_, f64>| match free {
            true => forms.solve_free(&factor, loads),
            false => factor.solve_from(first, loads),
        };
        let of = |set: &Vec<LoadPatch>| {
            let (distinct, like) = self.distinct(set);
            let line = |&c: &usize| LineLoad::for_contact(forms, set[c], n, &self.contacts[c]);
            let means = order(forms, solve, &distinct.iter().map(line).collect::<Vec<LineLoad>>());
            let mut all = Mat::zeros(LOADS * set.len(), LOADS * set.len());
            for (c, contact) in self.contacts.iter().enumerate() {
                if first((n, width)) <= self.own[c] {
                    let same = match width {
                        1 => [[0.0; LOADS]; LOADS],
                        _ => contact.locally(|spot| self.half_space(set[c]).order(n, spot.radius)),
                    };
                    let term = pair_of(means.as_ref(), [like[c]; 2]);
                    let together = |a: usize, b: usize| n == 0 || FAMILY[a] == FAMILY[b];
                    let of = |a: usize, b: usize| if together(a, b) { term[a][b] } else { 0.0 };
                    let block = scaled([set[c], set[c]], |a, b| width as f64 * (of(a, b) - same[a][b]));
                    put(&mut all, [c, c], &block);
                }
                for (d, other) in self.contacts.iter().enumerate().filter(|(d, _)| *d != c) {
                    let apart = other.along() - contact.along();
                    let [cos, sin] = weight(&self.blocks, index, |n| forms.path.wavenumber(n) * apart);
                    let turn = |a: usize, b: usize| match (FAMILY[a], FAMILY[b]) {
                        _ if n == 0 => 1.0,
                        (0, 1) => -sin,
                        (1, 0) => sin,
                        _ => cos,
                    };
                    let term = pair_of(means.as_ref(), [like[c], like[d]]);
                    put(&mut all, [c, d], &scaled([set[c], set[d]], |a, b| turn(a, b) * term[a][b]));
                }
            }
            all
        };
        let all = self.patches.iter().map(of).collect();
        *memory = factor.into_memory();
        Ok(all)
    }
}

/// Last order of a contact with itself, under loads up to `largest` from it along y, m.
fn last_order(forms: &Forms, contact: &SectionContact, largest: f64) -> Result<usize> {
    let section = &forms.section;
    let mut last = FEWEST;
    for spot in contact.spots() {
        let tread = match spot.is_on_a_face() {
            true => section.face_at(spot),
            false => section.running_at(spot.origin[1]),
        };
        let ends = tread.iter().flat_map(|e| [e[0], e[1]].map(|k| spot.along(section.nodes[k])));
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
        let room = high.min(-low);
        if !(room >= largest) {
            return Err(Error::Job(format!(
                "the running line reaches from {low:.4} m to {high:.4} m about the contact point, along the \
                 surface, expected {largest:.4} m to either \
                 side at least; move the contact or make the patch smaller"
            )));
        }
        last = last.max((SHORT * spot.radius / room).ceil() as usize);
    }
    Ok(last)
}

/// Last order between two contacts with patches of the half extent `half` along x, m, and more.
fn last_between([one, other]: [&SectionContact; 2], half: f64) -> usize {
    let mut last = 0;
    for a in one.spots() {
        for b in other.spots() {
            let across = (a.origin[0] - b.origin[0]).hypot(a.origin[1] - b.origin[1]);
            last = last.max((SHORT * a.radius.max(b.radius) / across.max(half)).ceil() as usize);
        }
    }
    last
}

/// Weights of the value at the centre of the block `index` in the sums over all orders n of cos φ_n and sin φ_n times a
/// function of n, which is known at the centres of the blocks; φ_n = `phase`(n), rad.
fn weight(blocks: &[(usize, usize)], index: usize, phase: impl Fn(usize) -> f64) -> [f64; 2] {
    let mut sums = [0.0; 2];
    let near = index.saturating_sub(3)..blocks.len().min(index + 4);
    for k in near {
        let (centre, width) = blocks[k];
        if width == 1 && k != index {
            continue;
        }
        for n in first(blocks[k])..first(blocks[k]) + width {
            let share = match width {
                1 => 1.0,
                _ => cardinal(blocks, index, (k, centre), n),
            };
            let (sin, cos) = phase(n).sin_cos();
            sums[0] += share * cos;
            sums[1] += share * sin;
        }
    }
    sums
}

/// Cubic polynomial in ln n that is 1 at the centre of the block `index` and 0 at the other three centres nearest to n,
/// which lies in the block `k` with the centre `centre`; 0 where that block is none of the four.
fn cardinal(blocks: &[(usize, usize)], index: usize, (k, centre): (usize, usize), n: usize) -> f64 {
    let begin = if n < centre { k.saturating_sub(2) } else { k.saturating_sub(1) };
    // Order 0 has no logarithm.
    let begin = begin.min(blocks.len().saturating_sub(4)).max(1);
    let four = begin..blocks.len().min(begin + 4);
    if !four.contains(&index) {
        return 0.0;
    }
    let at = |j: usize| (blocks[j].0 as f64).ln();
    let t = (n as f64).ln();
    four.filter(|&j| j != index).map(|j| (t - at(j)) / (at(index) - at(j))).product()
}

/// Γ⁻¹BΓ⁻¹ between loads on two patches, in the functions of the contact points.
pub(crate) fn scaled([one, other]: [LoadPatch; 2], of: impl Fn(usize, usize) -> f64) -> Square {
    let rows: Square = std::array::from_fn(|c| other.functions(&std::array::from_fn(|d| of(c, d))));
    let columns: Square = std::array::from_fn(|d| one.functions(&std::array::from_fn(|c| rows[c][d])));
    std::array::from_fn(|c| std::array::from_fn(|d| columns[d][c]))
}

/// The means of the displacements of one order under each load, were all of one family, `[9T, 9T]`; `solve` has the
/// displacements from an amplitude on under loads that are 0 before it.
fn order(forms: &Forms, solve: impl Fn(usize, MatRef<'_, f64>) -> Mat<f64>, lines: &[LineLoad]) -> Mat<f64> {
    let mut loads = Mat::zeros(forms.order(), LOADS * lines.len());
    for (c, line) in lines.iter().enumerate() {
        loads.as_mut().subcols_mut(LOADS * c, LOADS).copy_from(line.columns(forms.order()));
    }
    let first = lines.iter().map(LineLoad::first).min().unwrap_or(0);
    let moved = solve(first, loads.as_ref());
    let mut means = Mat::<f64>::zeros(loads.ncols(), loads.ncols());
    for (c, line) in lines.iter().enumerate() {
        for column in 0..loads.ncols() {
            let found = line.means(moved.col(column));
            (0..LOADS).for_each(|k| means[(LOADS * c + k, column)] = found[k]);
        }
    }
    Mat::from_fn(means.nrows(), means.ncols(), |i, j| 0.5 * (means[(i, j)] + means[(j, i)]))
}

/// Values between the loads of two contacts, of a matrix of those between all, `[9T, 9T]`.
pub fn pair_of(all: MatRef<'_, f64>, [one, other]: [usize; 2]) -> Square {
    std::array::from_fn(|a| std::array::from_fn(|b| all[(LOADS * one + a, LOADS * other + b)]))
}

/// Puts values between the loads of two contacts into a matrix of those between all, `[9T, 9T]`.
pub fn put(all: &mut Mat<f64>, [one, other]: [usize; 2], pair: &Square) {
    for (a, row) in pair.iter().enumerate() {
        row.iter().enumerate().for_each(|(b, v)| all[(LOADS * one + a, LOADS * other + b)] = *v);
    }
}

/// The sum of parts, for each set of patches.
pub fn sum(parts: impl IntoIterator<Item = Vec<Mat<f64>>>) -> Vec<Mat<f64>> {
    let mut all: Vec<Mat<f64>> = Vec::new();
    for part in parts {
        match all.is_empty() {
            true => all = part,
            false => all.iter_mut().zip(part).for_each(|(a, p)| *a += p),
        }
    }
    all
}
