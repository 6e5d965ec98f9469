//! Reactions to begin with where nothing is known, in single precision and without products with all of W: the
//! pressures without friction, then the tractions under these pressures.

use super::normal::NormalBorder;
use super::{Iterate, SplitNewton};
use crate::transient::aligned::AlignedVec;
use crate::transient::problem::{Effort, StepProblem};
use crate::transient::structure_of_arrays::SoaVec3;

/// Newton steps on the tractions, and the share of the first residual below which the pressures have to follow.
const STEPS: usize = 5;
const ENOUGH: f64 = 0.02;
/// Reduction of the residual of a linear system: the directions of slip, which the systems are made for, still change
/// much.
const FORCING: f32 = 0.3;

/// Reactions and the shifts of the borders; the response in single precision.
pub(super) fn start(parts: &mut SplitNewton, p: &StepProblem<'_>, shift: &[f64], effort: &mut Effort) -> Iterate {
    let (w, l) = (p.matrix, p.matrix.places());
    let unit = w.unit();
    let mut now = Iterate { x: SoaVec3::zeros(l), shift: shift.to_vec(), y: SoaVec3::zeros(l) };
    let gap = |i: usize| ((p.free[3 * i + 2] + p.shifted(i, shift)[2]) / unit) as f32;
    let gap: Vec<f32> = (0..p.nodes()).map(gap).collect();
    let loads: Vec<f32> = p.borders.iter().map(|b| b.total as f32).collect();
    let borders: Vec<NormalBorder> = p.borders.iter().map(|b| NormalBorder::new(p, b)).collect();
    let Some((pressure, nearer)) = parts.normal.frictionless((w.gaps(), &borders), &gap, &loads, effort) else {
        return now;
    };
    now.shift.iter_mut().zip(&nearer).for_each(|(s, n)| *s -= unit * f64::from(*n));
    let respond = |now: &mut Iterate, sorted: &[f32]| {
        for (c, row) in sorted.chunks_exact(l).enumerate() {
            now.y.row_mut(c).iter_mut().zip(row).for_each(|(y, v)| *y += unit * f64::from(*v));
        }
    };
    now.x.row_mut(2).iter_mut().zip(pressure.iter()).for_each(|(x, q)| *x = f64::from(*q));
    respond(&mut now, &w.pressed(&pressure));
    let still = AlignedVec::zeros(l);
    let mut enough = None;
    for _ in 0..STEPS {
        parts.seen.look(p, &now);
        if parts.seen.norm <= *enough.get_or_insert(ENOUGH * parts.seen.norm) {
            break;
        }
        let before = [0, 1].map(|c| now.x.row(c).to_vec());
        parts.slide(p, &still, &mut now.x, FORCING, effort);
        let change = [0, 1].map(|c| now.x.row(c).iter().zip(&before[c]).map(|(a, b)| (a - b) as f32).collect());
        respond(&mut now, &w.pulled(change));
    }
    now
}
