//! The frictionless normal problem: Signorini's law on the normal block of W, by a primal–dual active set.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::active_set::settle;
use super::influence::Influence;
use super::loads::{LoadedMotion, Loads, NormalLoad};
use crate::grid::{ContactPatch, Interface};
use crate::{Error, Result};

/// Solution of the normal problem.
#[derive(Debug, Clone)]
pub(super) struct NormalSolution {
    /// Closed nodes, ascending.
    pub closed: Vec<usize>,
    /// Nodal normal forces of the closed nodes, N.
    pub force: Vec<f64>,
    /// Rigid motions, m, `[motions]`; 0 of those that bear nothing.
    pub motions: Vec<f64>,
}

/// Solves g = gap − N d + W_nn p ≥ 0 ⟂ p ≥ 0 for the normal reactions with the tangential ones left out.
/// `w` is the whole `[3n, 3n]` influence matrix. Loads that need friction are those that they begin with here.
pub(super) fn solve_normal(w: Influence<'_>, s: &Interface, loads: &Loads) -> Result<NormalSolution> {
    match loads.at_first() {
        None => solve_without_friction(w, s, loads),
        Some(first) => {
            let found = solve_without_friction(w, s, &first)?;
            Ok(NormalSolution { motions: loads.nearest_motions(&found.motions), ..found })
        }
    }
}

fn solve_without_friction(w: Influence<'_>, s: &Interface, loads: &Loads) -> Result<NormalSolution> {
    let n = s.len();
    let wnn = |i: usize, j: usize| w.get(3 * i + 2, 3 * j + 2);
    let limit = rounds(s);
    let patch: Vec<usize> = patches(s);
    let factor = |j: usize, i: usize| loads.motions[j].factors[patch[i]];
    let count = loads.motions.len();
    let mut inside = vec![false; n];
    let settled = settle(first_guess(w, s, loads), limit, |closed| {
        rest_on_a_node(s, loads, &patch, closed);
        if closed.is_empty() {
            return Ok((Vec::new(), (Vec::new(), loads.prescribed())));
        }
        let k = closed.len();
        let a = Mat::from_fn(k, k, |i, j| if i >= j { wnn(closed[i], closed[j]) } else { 0.0 });
        let llt = a.llt(Side::Lower).map_err(|_| not_definite())?;
        let entry = |i: usize, c: usize| if c < count { factor(c, closed[i]) } else { s.gap[closed[i]] };
        let mut solved = Mat::from_fn(k, count + 1, entry);
        llt.solve_in_place(&mut solved);
        let row = |j: usize, i: usize| loads.motions[j].resultant[patch[closed[i]]][2];
        let (force, motions) = loads.forces(&solved, row).ok_or_else(undetermined)?;
        let approach: Vec<f64> = (0..s.patches.len()).map(|c| loads.approach(&motions, c)).collect();
        inside.fill(false);
        closed.iter().for_each(|&i| inside[i] = true);
        let mut next: Vec<usize> = closed.iter().zip(&force).filter(|(_, &f)| f > 0.0).map(|(&i, _)| i).collect();
        let largest = |v: &[f64]| v.iter().fold(0.0f64, |m, g| m.max(g.abs()));
        let scale = largest(&s.gap) + largest(&approach);
        for i in (0..n).filter(|&i| !inside[i] && !loads.is_open(patch[i])) {
            let approach = approach[patch[i]];
            // Only nodes whose undeformed surfaces overlap can be pressed: deformation opens the rest, and skipping
            // them spares most of the products; points may be the ends of a lever. (Influence entries of unlike sign
            // would break this; the full map of the laws is checked on every node at the end.)
            if s.only().is_some() && !s.are_points() && s.gap[i] >= approach && wnn(i, closed[0]) >= 0.0 {
                continue;
            }
            let g = s.gap[i] - approach + closed.iter().zip(&force).map(|(&j, f)| wnn(i, j) * f).sum::<f64>();
            if g < -1e-13 * scale {
                next.push(i);
            }
        }
        next.sort_unstable();
        Ok((next, (force, motions)))
    })?;
    match settled {
        Ok((closed, (force, motions))) => Ok(NormalSolution { closed, force, motions }),
        Err(history) => Err(Error::NotConverged(format!(
            "steady contact, normal problem: the set of closed nodes did not settle in {limit} iterations; \
             nodes changed per iteration: {history:?}"
        ))),
    }
}

pub(super) fn not_definite() -> Error {
    Error::Input(
        "steady contact: the normal compliance of the contact nodes is not positive definite; \
         a support that leaves a rigid motion free, or a matrix that is not a compliance, does that"
            .into(),
    )
}

/// Most passes over a set of closed nodes: an ordinary contact settles in some five, and a pass moves the border of the
/// contact by one node at the least.
pub(super) fn rounds(s: &Interface) -> usize {
    30 + s.patches.iter().map(|p| p.x.len() + p.y.len()).sum::<usize>()
}

/// Patch of each node, `[n]`.
pub(super) fn patches(s: &Interface) -> Vec<usize> {
    s.patches.iter().enumerate().flat_map(|(c, p)| p.nodes().map(move |_| c)).collect()
}

/// Lets a motion that has to bear its load and finds none of its nodes among the `closed` ones (ascending) rest on the
/// nearest.
pub(super) fn rest_on_a_node(s: &Interface, loads: &Loads, patch: &[usize], closed: &mut Vec<usize>) {
    for j in loads.unknown() {
        let factor = |i: usize| loads.motions[j].factors[patch[i]];
        if closed.iter().any(|&i| factor(i) != 0.0) {
            continue;
        }
        let depth = |i: usize| s.gap[i] / factor(i);
        let near = (0..s.len()).filter(|&i| factor(i) > 0.0 && !loads.is_open(patch[i]));
        if let Some(i) = near.min_by(|&a, &b| depth(a).total_cmp(&depth(b))) {
            closed.push(i);
            closed.sort_unstable();
        }
    }
}

pub(super) fn undetermined() -> Error {
    Error::NotConverged(
        "steady contact: the loads do not determine how far the bodies come together: a patch that one of them needs \
         is open, or friction bears all of it; give less load or friction, or the approach"
            .into(),
    )
}

/// Contact modulus E* (Pa) at the node of `patch` nearest to the smallest gap: Love's solution for a loaded rectangle.
pub(super) fn contact_modulus(w: Influence<'_>, s: &Interface, patch: &ContactPatch) -> f64 {
    let i = lowest(s, patch);
    let (nx, ny) = (patch.x.len(), patch.y.len());
    let (ix, iy) = patch.indices(i);
    let (ix, iy) = (ix.clamp(1, nx - 2), iy.clamp(1, ny - 2));
    let hx = 0.5 * (patch.x[ix + 1] - patch.x[ix - 1]);
    let hy = 0.5 * (patch.y[iy + 1] - patch.y[iy - 1]);
    let c = patch.node(ix, iy);
    let mean = 2.0 * (hx * (hy / hx).asinh() + hy * (hx / hy).asinh()) / std::f64::consts::PI;
    mean / (w.get(3 * c + 2, 3 * c + 2) * hx * hy)
}

/// The node of the smallest gap of `patch`.
pub(super) fn lowest(s: &Interface, patch: &ContactPatch) -> usize {
    patch.nodes().min_by(|&a, &b| s.gap[a].total_cmp(&s.gap[b])).unwrap_or(patch.first)
}

/// The nodes of smallest gap, as many as Hertz's relations on the area ask for; all of points, which have no area.
pub(super) fn first_guess(w: Influence<'_>, s: &Interface, loads: &Loads) -> Vec<usize> {
    if s.are_points() {
        return (0..s.len()).collect();
    }
    let mut guess = Vec::new();
    for (j, motion) in loads.motions.iter().enumerate() {
        let moves = |c: &usize| loads.leading(*c) == Some(j) && motion.factors[*c] > 0.0 && !loads.is_open(*c);
        let patches: Vec<usize> = (0..s.patches.len()).filter(moves).collect();
        guess.extend(guess_of(w, s, motion, &patches));
    }
    guess.sort_unstable();
    guess
}

/// The first guess on the `patches` that `motion` presses: those nodes that it reaches first.
fn guess_of(w: Influence<'_>, s: &Interface, motion: &LoadedMotion, patches: &[usize]) -> Vec<usize> {
    struct Growing {
        factor: f64,
        /// Part of the normal force in the resultant.
        row: f64,
        modulus: f64,
        lowest: f64,
        area: f64,
    }
    let mut all: Vec<Growing> = Vec::new();
    let mut order: Vec<(usize, usize)> = Vec::new();
    for (k, &c) in patches.iter().enumerate() {
        let patch = &s.patches[c];
        let (factor, row) = (motion.factors[c], motion.resultant[c][2]);
        let (modulus, lowest) = (contact_modulus(w, s, patch), s.gap[lowest(s, patch)]);
        all.push(Growing { factor, row, modulus, lowest, area: 0.0 });
        order.extend(patch.nodes().map(|i| (i, k)));
    }
    order.sort_by(|&(a, k), &(b, l)| (s.gap[a] / all[k].factor).total_cmp(&(s.gap[b] / all[l].factor)));
    let mut guess = Vec::new();
    for &(i, k) in &order {
        let level = s.gap[i] / all[k].factor;
        // A contact bounded by the level g of the gap has the approach 2g and the load 4/3 E* a δ (circle, Hertz).
        let height = |p: &Growing| (2.0 * (p.factor * level - p.lowest)).max(0.0);
        let enough = match motion.load {
            NormalLoad::Approach(d) => all[k].lowest + height(&all[k]) >= all[k].factor * d,
            NormalLoad::Force(f) => {
                let load =
                    |p: &Growing| p.row * (4.0 / 3.0 * p.modulus * (p.area / std::f64::consts::PI).sqrt() * height(p));
                all.iter().map(load).sum::<f64>() >= f && guess.len() >= 4
            }
        };
        if enough && (matches!(motion.load, NormalLoad::Force(_)) || all.len() == 1) {
            break;
        }
        if !enough {
            all[k].area += s.weight[i];
            guess.push(i);
        }
    }
    guess
}
