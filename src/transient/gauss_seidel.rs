//! Block Gauss–Seidel: the laws solved node after node, the others as they are. Slow on dense operators, but it does
//! not cycle: it brings the reactions near enough for Newton's method.

use super::problem::{node, Effort, StepProblem};

/// At most `sweeps` sweeps over the nodes; returns reactions and shifts.
pub(super) fn sweep(
    p: &StepProblem<'_>,
    target: f64,
    mut reaction: Vec<f64>,
    mut shift: Vec<f64>,
    sweeps: usize,
    effort: &mut Effort,
) -> (Vec<f64>, Vec<f64>) {
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
            let by = p.shifted(i, &shift);
            let u = [0, 1, 2].map(|c| p.free[3 * i + c] + y[3 * i + c] + by[c]);
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
        // Each shift by its own scalar equation: the mean compliance of the loaded nodes is that of all of them
        // together.
        for (b, error) in p.total_errors(&reaction).into_iter().enumerate() {
            let border = &p.borders[b];
            let moves = || (0..k).filter(|&i| border.moves(p.patch_of(i)));
            let loaded = moves().filter(|&i| reaction[3 * i + 2] > 0.0).count().max(1) as f64;
            let stiffness = |i: usize| {
                let (rho, c) = (p.rho(i), p.patch_of(i));
                let [x, y, n] = [0, 1, 2].map(|d| border.row[c][d] * border.column[c][d]);
                rho.tangential * (x + y) + rho.normal * n
            };
            let stiffness = moves().map(stiffness).sum::<f64>() / moves().count().max(1) as f64;
            if stiffness != 0.0 {
                shift[b] += error / (stiffness * loaded.sqrt());
            }
            moved = moved.max(error.abs());
        }
        if moved <= target {
            break;
        }
    }
    (reaction, shift)
}
