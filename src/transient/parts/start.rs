//! Reactions to begin with where nothing is known, in single precision and without products with all of W: the pressures without
//! friction, then the tractions under these pressures.

use super::{look, Iterate, Operators};
use crate::transient::lines::Lines;
use crate::transient::problem::{Effort, StepProblem};

/// Newton steps on the tractions, and the share of the first residual below which the pressures have to follow.
const STEPS: usize = 5;
const ENOUGH: f64 = 0.02;
/// What the residual of a linear system falls by: the directions of slip, which the systems are made for, still change much.
const FORCING: f32 = 0.3;

/// Reactions and the shift of the gaps; not the response.
pub(super) fn start(parts: &mut Operators, p: &StepProblem<'_>, shift: f64, effort: &mut Effort) -> Iterate {
    let (w, size) = (p.matrix, p.matrix.size());
    let unit = w.unit();
    let mut now = Iterate { x: vec![0.0; size], shift, y: vec![0.0; size] };
    let gap: Vec<f32> = p.free[2..].iter().step_by(3).map(|g| ((g + shift) / unit) as f32).collect();
    let load = p.total[2].map(|n| n as f32);
    let Some((pressure, nearer)) = parts.normal.frictionless(w.gaps(), &gap, load, effort) else {
        return now;
    };
    now.shift -= unit * f64::from(nearer);
    let respond = |now: &mut Iterate, sorted: &[f32]| {
        for (c, row) in sorted.chunks_exact(w.places()).enumerate() {
            now.y[c..].iter_mut().step_by(3).zip(row).for_each(|(y, v)| *y += unit * f64::from(*v));
        }
    };
    now.x[2..].iter_mut().step_by(3).zip(pressure.iter()).for_each(|(x, q)| *x = f64::from(*q));
    respond(&mut now, &w.pressed(&pressure));
    let still = Lines::zeros(w.places());
    let mut enough = None;
    for _ in 0..STEPS {
        let seen = look(p, &parts.rho, &now);
        if seen.norm <= *enough.get_or_insert(ENOUGH * seen.norm) {
            break;
        }
        let before = now.x.clone();
        let u: Vec<f64> = p.free.iter().zip(&now.y).map(|(f, y)| f + y).collect();
        parts.slide(p, &seen, (&u, &still), &mut now.x, FORCING, effort);
        let change: Vec<f32> = now.x.iter().zip(&before).map(|(a, b)| (a - b) as f32).collect();
        respond(&mut now, &w.pulled(&change));
    }
    now
}
