//! A start for many contact nodes from the solution on a coarser grid: from far away Newton's method takes the more
//! steps, or fails, the finer the grid.

use super::influence::Influence;
use super::law::project_disc;
use super::steady::{SteadyProblem, SteadySolution};
use crate::grid::Interface;

/// Closed nodes from which on it is worth while.
const FROM: usize = 700;
/// Residual on the coarser grid: its own error is larger.
const TOLERANCE: f64 = 1e-3;

/// The solution of `problem`, whose contact holds `closed` nodes, on every second grid line, and that grid; none
/// where there is no coarser one that would do, or no solution on it.
pub(super) fn solution(problem: &SteadyProblem<'_>, closed: usize) -> Option<(Interface, SteadySolution)> {
    let Influence::Convolution(fine) = problem.compliance else { return None };
    if closed < FROM || problem.interface.are_points() {
        return None;
    }
    let (interface, convolution) = (coarse(problem.interface)?, fine.coarsened()?);
    let tolerance = TOLERANCE.max(problem.tolerance);
    let coarse =
        SteadyProblem { interface: &interface, compliance: (&convolution).into(), tolerance, ..problem.clone() };
    let found = coarse.solve().ok()?;
    Some((interface, found))
}

/// Tractions in `stress` (Pa, `[3n]`), which holds the pressures alone: in the same proportion to these as in the
/// `solution` on the grid `coarse`.
pub(super) fn tractions(
    problem: &SteadyProblem<'_>,
    (coarse, solution): (&Interface, &SteadySolution),
    friction: &[f64],
    stress: &mut [f64],
) {
    let Some((fine, coarse)) = problem.interface.only().zip(coarse.only()) else { return };
    let [cx, cy] = [coarse.x.len(), coarse.y.len()];
    for (i, stress) in stress.chunks_exact_mut(3).enumerate().filter(|(_, stress)| stress[2] > 0.0) {
        let (ix, iy) = fine.indices(i);
        let (mut pressure, mut traction) = (0.0, [0.0; 2]);
        for (jx, jy) in
            [(ix / 2, iy / 2), (ix.div_ceil(2), iy / 2), (ix / 2, iy.div_ceil(2)), (ix.div_ceil(2), iy.div_ceil(2))]
        {
            if jx < cx && jy < cy {
                let j = jx + cx * jy;
                pressure += solution.pressure[j];
                (0..2).for_each(|c| traction[c] += solution.traction[j][c]);
            }
        }
        if pressure > 0.0 {
            let p = stress[2];
            let t = project_disc(traction.map(|t| t * p / pressure), friction[i] * p);
            stress[..2].copy_from_slice(&t);
        }
    }
}

/// Every second line of a grid; none of several, or of a grid with too few lines.
fn coarse(s: &Interface) -> Option<Interface> {
    let patch = s.only()?;
    let every = |x: &[f64]| -> Vec<f64> { x.iter().copied().step_by(2).collect() };
    let (x, y) = (every(&patch.x), every(&patch.y));
    let (nx, ny) = (x.len(), y.len());
    let nodes: Vec<usize> = (0..ny).flat_map(|j| (0..nx).map(move |i| patch.node(2 * i, 2 * j))).collect();
    let mut coarse = Interface::new(x, y, nodes.iter().map(|&i| s.gap[i]).collect()).ok()?;
    coarse.shift = nodes.iter().map(|&i| s.shift[i]).collect();
    Some(coarse)
}
