//! Block Gauss–Seidel: the laws solved node after node, the others as they are. Slow on dense operators, but it does
//! not cycle: it brings the reactions near enough for Newton's method.

use super::problem::{node, Effort, StepProblem};

/// At most `sweeps` sweeps over the nodes; returns reactions and shift.
pub(super) fn sweep(
    p: &StepProblem<'_>,
    target: f64,
    mut reaction: Vec<f64>,
    mut shift: [f64; 3],
    sweeps: usize,
    effort: &mut Effort,
) -> (Vec<f64>, [f64; 3]) {
    let k = p.nodes();
    let mut y = vec![0.0; 3 * k];
    for s in 0..sweeps {
        // Renewed now and then: the updates leave rounding behind.
        if s % 10 == 0 {
            p.matrix.times(&reaction, &mut y);
            effort.products += 1;
        }
        let mut moved: f64 = 0.0;
        for i in 0..k {
            let old = [reaction[3 * i], reaction[3 * i + 1], reaction[3 * i + 2]];
            let u = [0, 1, 2].map(|c| p.free[3 * i + c] + y[3 * i + c] + shift[c]);
            let found = p.project(i, p.rho(i), &node(&old, &u));
            let new = [found.traction[0], found.traction[1], found.pressure];
            for c in 0..3 {
                let change = new[c] - old[c];
                if change != 0.0 {
                    reaction[3 * i + c] = new[c];
                    moved = moved.max(change.abs());
                    y.iter_mut().zip(p.matrix.col(3 * i + c)).for_each(|(y, w)| *y += w * change);
                }
            }
        }
        effort.sweeps += 1;
        // The shift by its own scalar equation: the mean compliance of the loaded nodes is that of all of them
        // together.
        let error = p.total_error(&reaction);
        for c in 0..3 {
            if p.total[c].is_some() {
                let loaded = (0..k).filter(|&i| reaction[3 * i + 2] > 0.0).count().max(1) as f64;
                let stiffness = (0..k).map(|i| if c == 2 { p.rho(i).normal } else { p.rho(i).tangential }).sum::<f64>()
                    / k.max(1) as f64;
                shift[c] += error[c] / (stiffness * loaded.sqrt());
                moved = moved.max(error[c].abs());
            }
        }
        if moved <= target {
            break;
        }
    }
    (reaction, shift)
}
