//! Static compliance of a swept body at its contact: that of a half-space and a few numbers.
//!
//! W_ij = W_hs(x_i − x_j) + π(x_i) A π(x_j)ᵀ, π = (1, x, y): A = Γ⁻¹(B − B_hs)Γ⁻¹, with B the means of the
//! displacements under the loads of [`super::LineLoad`], B_hs the same of a half-space, and Γ = ∫∫ω ππᵀ. Both are
//! sums over the orders of Fourier, whose differences fall off as soon as the waves are short against the distance to
//! the next edge: A = Σ_{n ≤ n0} B_n − B_hs(|k_x| < (n0 + ½)/R) + Σ (B_n − B_hs,n), the last sum by blocks of orders,
//! each with the value at its centre.

use super::load::{HalfSpaceLoad, LineLoad, Patch, Square, LOADS};
use super::skyline_ldlt::Factor;
use super::{Forms, Path, SectionContact};
use crate::{Error, Result};

/// Orders up to which each is summed by itself; along a line, waves over the height of the section, k h. What bends
/// and twists in the large goes with k⁻⁴ there, and is much.
const SINGLE: usize = 12;
const SINGLE_WAVES: f64 = 4.0;
/// Half of a block of orders over its first order, round an axle and along a line: blocks grow with the order.
const SPREAD: usize = 8;
const SPREAD_WAVES: usize = 16;

/// Orders at which waves are so short against the distance d to the next edge that they are those of a half-space: n
/// d/R.
const SHORT: f64 = 10.0;
/// At least so many orders.
const FEWEST: usize = 60;

/// The sum A of a body, to be made block by block of orders.
#[derive(Debug, Clone)]
pub struct Constant<'f> {
    forms: &'f Forms,
    /// The circles of the loads: A is made for each of them.
    patches: Vec<Patch>,
    /// Spots that carry the loads.
    contact: SectionContact,
    /// Blocks of orders: centre and number of orders, odd.
    pub blocks: Vec<(usize, usize)>,
}

/// The blocks of orders of `forms` up to `last`.
fn blocks(forms: &Forms, last: usize) -> Vec<(usize, usize)> {
    let (single, spread) = match forms.path {
        Path::Axle => (SINGLE, SPREAD),
        Path::Line(_) => {
            let z = forms.section.nodes.iter().map(|x| x[0]);
            let height = z.clone().fold(f64::NEG_INFINITY, f64::max) - z.fold(f64::INFINITY, f64::min);
            ((SINGLE_WAVES / (height * forms.path.wavenumber(1))).ceil() as usize, SPREAD_WAVES)
        }
    };
    let mut all: Vec<(usize, usize)> = (0..=single.min(last)).map(|n| (n, 1)).collect();
    let mut first = single + 1;
    while first <= last {
        let half = first / spread;
        all.push((first + half, 2 * half + 1));
        first += 2 * half + 1;
    }
    all
}

impl<'f> Constant<'f> {
    /// Compliance of `forms` with the rolling radius `radius`, m, under loads on `patches`, from as many orders as the
    /// next edge asks for.
    pub fn new(forms: &'f Forms, patches: &[Patch], radius: f64) -> Result<Self> {
        Self::at(forms, patches, &SectionContact::level(radius))
    }

    /// The same of a contact, in its frame.
    pub fn at(forms: &'f Forms, patches: &[Patch], contact: &SectionContact) -> Result<Self> {
        let section = &forms.section;
        let largest = patches.iter().map(|p| p.radius).fold(0.0, f64::max);
        let mut last = FEWEST;
        for spot in contact.spots() {
            let ends = section.tread.iter().flat_map(|e| [e[0], e[1]].map(|k| spot.along(section.nodes[k])));
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
        Ok(Self { forms, patches: patches.to_vec(), contact: contact.clone(), blocks: blocks(forms, last) })
    }

    /// The sum with the orders up to `last` in place of those by itself.
    pub fn up_to(self, last: usize) -> Self {
        Self { blocks: blocks(self.forms, last), ..self }
    }

    fn half_space(&self, patch: Patch) -> HalfSpaceLoad {
        let material = self.forms.material;
        HalfSpaceLoad { patch, shear: material.shear(), poisson: material.poisson }
    }

    /// −B_hs of the orders that are summed one by one, for each patch.
    pub fn singles(&self) -> Vec<Square> {
        let singles = self.blocks.iter().filter(|b| b.1 == 1).count();
        let of = |&patch: &Patch| {
            let known = self.contact.locally(|spot| self.half_space(patch).up_to((singles as f64 - 0.5) / spot.radius));
            self.scaled(patch, |c, d| -known[c][d])
        };
        self.patches.iter().map(of).collect()
    }

    /// Γ⁻¹BΓ⁻¹.
    fn scaled(&self, patch: Patch, of: impl Fn(usize, usize) -> f64) -> Square {
        let moments = patch.moments();
        std::array::from_fn(|c| std::array::from_fn(|d| of(c, d) / (moments[c] * moments[d])))
    }

    /// Contribution of a block, for each patch; factorised in the `memory` of the block before, which then holds that
    /// of this one.
    pub fn block(&self, index: usize, memory: &mut Vec<f64>) -> Result<Vec<Square>> {
        let (n, width) = self.blocks[index];
        let forms = self.forms;
        let factor = forms.factor_in(std::mem::take(memory), n, 0.0)?.positive("the statics of a swept body")?;
        let of = |&patch: &Patch| {
            let term = order(forms, &factor, &LineLoad::at(forms, patch, n, &self.contact));
            let same = match width {
                1 => [[0.0; LOADS]; LOADS],
                _ => self.contact.locally(|spot| self.half_space(patch).order(n, spot.radius)),
            };
            self.scaled(patch, |c, d| width as f64 * (term[c][d] - same[c][d]))
        };
        let all = self.patches.iter().map(of).collect();
        *memory = factor.into_memory();
        Ok(all)
    }
}

/// The means of the displacements of one order under each load.
fn order(forms: &Forms, factor: &Factor, line: &LineLoad) -> Square {
    let moved = factor.solve_from(line.first(), line.columns(forms.order()).as_ref());
    let means: [[f64; LOADS]; LOADS] = std::array::from_fn(|d| line.means(moved.col(d)));
    let both = |c: usize, d: usize| if line.together(c, d) { 0.5 * (means[c][d] + means[d][c]) } else { 0.0 };
    std::array::from_fn(|c| std::array::from_fn(|d| both(c, d)))
}

/// The sum of parts, for each patch.
pub fn sum(parts: impl IntoIterator<Item = Vec<Square>>) -> Vec<Square> {
    let mut all: Vec<Square> = Vec::new();
    for part in parts {
        all.resize(part.len(), [[0.0; LOADS]; LOADS]);
        for (a, p) in all.iter_mut().flatten().flatten().zip(part.iter().flatten().flatten()) {
            *a += p;
        }
    }
    all
}
