//! The frictionless normal problem: Signorini's law on the normal block of W, by a primal–dual active set.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::active_set::{settle, under};
use super::influence::Influence;
use super::steady::NormalLoad;
use crate::grid::Interface;
use crate::{Error, Result};

/// Solution of the normal problem.
#[derive(Debug, Clone)]
pub(super) struct NormalSolution {
    /// Closed nodes, ascending.
    pub closed: Vec<usize>,
    /// Nodal normal forces of the closed nodes, N.
    pub force: Vec<f64>,
    /// Approach, m.
    pub approach: f64,
}

/// Solves g = gap − δ + W_nn p ≥ 0 ⟂ p ≥ 0 for the normal reactions with the tangential ones left out.
/// `w` is the whole `[3n, 3n]` influence matrix.
pub(super) fn solve_normal(w: Influence<'_>, s: &Interface, load: NormalLoad) -> Result<NormalSolution> {
    let n = s.len();
    let wnn = |i: usize, j: usize| w.get(3 * i + 2, 3 * j + 2);
    // An ordinary contact settles in some five passes, and a pass moves the border of the contact by one node at the
    // least.
    let limit = 30 + s.x.len() + s.y.len();
    let mut inside = vec![false; n];
    let settled = settle(first_guess(w, s, load), limit, |closed| {
        if closed.is_empty() {
            if let NormalLoad::Approach(approach) = load {
                return Ok((Vec::new(), (Vec::new(), approach)));
            }
            closed.extend((0..n).min_by(|&a, &b| s.gap[a].total_cmp(&s.gap[b])));
        }
        let k = closed.len();
        let a = Mat::from_fn(k, k, |i, j| if i >= j { wnn(closed[i], closed[j]) } else { 0.0 });
        let factor = a.llt(Side::Lower).map_err(|_| not_definite())?;
        let mut solved = Mat::from_fn(k, 2, |i, c| if c == 0 { 1.0 } else { s.gap[closed[i]] });
        factor.solve_in_place(&mut solved);
        let (force, approach) = under(load, &solved);
        inside.fill(false);
        closed.iter().for_each(|&i| inside[i] = true);
        let mut next: Vec<usize> = closed.iter().zip(&force).filter(|(_, &f)| f > 0.0).map(|(&i, _)| i).collect();
        let scale = s.gap.iter().fold(0.0f64, |m, g| m.max(g.abs())) + approach.abs();
        for i in (0..n).filter(|&i| !inside[i]) {
            // Only nodes whose undeformed surfaces overlap can be pressed: deformation opens the rest, and skipping
            // them spares most of the products; points may be the ends of a lever. (Influence entries of unlike sign
            // would break this; the full map of the laws is checked on every node at the end.)
            if !s.are_points() && s.gap[i] >= approach && wnn(i, closed[0]) >= 0.0 {
                continue;
            }
            let g = s.gap[i] - approach + closed.iter().zip(&force).map(|(&j, f)| wnn(i, j) * f).sum::<f64>();
            if g < -1e-13 * scale {
                next.push(i);
            }
        }
        next.sort_unstable();
        Ok((next, (force, approach)))
    })?;
    match settled {
        Ok((closed, (force, approach))) => Ok(NormalSolution { closed, force, approach }),
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

/// Contact modulus E* (Pa) seen by the node nearest to the smallest gap: Love's solution for a loaded rectangle.
pub(super) fn contact_modulus(w: Influence<'_>, s: &Interface) -> f64 {
    let i = (0..s.len()).min_by(|&a, &b| s.gap[a].total_cmp(&s.gap[b])).unwrap_or(0);
    let (nx, ny) = (s.x.len(), s.y.len());
    let (ix, iy) = ((i % nx).clamp(1, nx - 2), (i / nx).clamp(1, ny - 2));
    let hx = 0.5 * (s.x[ix + 1] - s.x[ix - 1]);
    let hy = 0.5 * (s.y[iy + 1] - s.y[iy - 1]);
    let c = ix + nx * iy;
    let mean = 2.0 * (hx * (hy / hx).asinh() + hy * (hx / hy).asinh()) / std::f64::consts::PI;
    mean / (w.get(3 * c + 2, 3 * c + 2) * hx * hy)
}

/// The nodes of smallest gap, as many as Hertz's relations on the area ask for; all of points, which have no area.
pub(super) fn first_guess(w: Influence<'_>, s: &Interface, load: NormalLoad) -> Vec<usize> {
    if s.are_points() {
        return (0..s.len()).collect();
    }
    let mut order: Vec<usize> = (0..s.len()).collect();
    order.sort_by(|&a, &b| s.gap[a].total_cmp(&s.gap[b]));
    let lowest = order.first().map_or(0.0, |&i| s.gap[i]);
    let modulus = contact_modulus(w, s);
    let mut area = 0.0;
    let mut guess = Vec::new();
    for &i in &order {
        // A contact bounded by the level g of the gap has the approach 2g and the load 4/3 E* a δ (circle, Hertz).
        let height = 2.0 * (s.gap[i] - lowest);
        let enough = match load {
            NormalLoad::Approach(d) => lowest + height >= d,
            NormalLoad::Force(f) => {
                4.0 / 3.0 * modulus * (area / std::f64::consts::PI).sqrt() * height >= f && guess.len() >= 4
            }
        };
        if enough {
            break;
        }
        area += s.weight[i];
        guess.push(i);
    }
    guess.sort_unstable();
    guess
}
