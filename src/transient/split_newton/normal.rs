//! The pressures of a step, in single precision.

use faer::linalg::solvers::{DenseSolveCore, PartialPivLu, Solve};
use faer::Mat;

use super::krylov::conjugate_gradients;
use crate::contact::active_set::settle;
use crate::contact::loads::solve_small;
use crate::dense::{add_columns, sum_over};
use crate::transient::aligned::{padded_len, AlignedVec};
use crate::transient::border::Border;
use crate::transient::problem::{Effort, StepProblem};

/// Solutions after which the inverse of the normal part pays; until then conjugate gradients find the pressures too.
const WORTH: usize = 8;

/// Solver of the pressures of k nodes in l places; `gaps` everywhere is W_nn in units of the operator, columns,
/// `[k][l]`. Places without a node have no gap and no pressure.
pub(super) struct NormalProblem {
    /// k.
    nodes: usize,
    /// Inverse of W_nn + μ W_nt d, columns, `[k][l]`, where it was made.
    inverse: AlignedVec<f32>,
    /// Open nodes, and the factor of the rows and columns of the inverse that they have.
    open: Vec<usize>,
    shut: Option<PartialPivLu<f32>>,
    /// Pressures that a unit of minus the shift of each border makes on the nodes that are not open, `[l]` each; empty
    /// where not known.
    uniform: Vec<AlignedVec<f32>>,
    /// Systems solved.
    solved: usize,
}

/// Gaps to be closed and what the pressures are to add to the resultants.
pub(super) struct WantedGaps {
    /// Minus the gaps over the unit, N, `[l]`; 0 at open nodes.
    pub gap: AlignedVec<f32>,
    /// Change of the resultant of each border, N.
    pub lack: Vec<f32>,
}

/// A border at the nodes.
pub(super) struct NormalBorder {
    /// Change of the gap per unit of the shift, `[l]`.
    pub column: AlignedVec<f32>,
    /// Part of the pressure in the resultant, `[l]`.
    pub row: AlignedVec<f32>,
}

impl NormalBorder {
    /// Without what friction adds.
    pub fn new(p: &StepProblem<'_>, border: &Border) -> Self {
        let at = |of: &[[f64; 3]]| {
            let mut all = AlignedVec::zeros(p.matrix.places());
            (0..p.nodes()).for_each(|i| all[i] = of[p.patch_of(i)][2] as f32);
            all
        };
        Self { column: at(&border.column), row: at(&border.row) }
    }
}

impl NormalProblem {
    /// For `nodes` nodes.
    pub fn new(nodes: usize) -> Self {
        let (inverse, uniform) = (AlignedVec::default(), Vec::new());
        Self { nodes, inverse, open: Vec::new(), shut: None, uniform, solved: 0 }
    }

    /// Returns whether an inverse is to be made now; counts the systems solved.
    pub fn wants_inverse(&mut self) -> bool {
        self.solved += 1;
        self.solved > WORTH && self.inverse.is_empty()
    }

    /// Makes the inverse of `gaps` and `coupling`, (row, column) ↦ what friction adds.
    pub fn invert(&mut self, gaps: &[f32], coupling: impl Fn(usize, usize) -> f32) {
        let (k, l) = (self.nodes, padded_len::<f32>(self.nodes));
        let inverse = Mat::from_fn(k, k, |i, j| gaps[l * j + i] + coupling(i, j)).partial_piv_lu().inverse();
        self.inverse = AlignedVec::zeros(k * l);
        (0..k).for_each(|j| self.inverse[l * j..][..k].copy_from_slice(inverse.col_as_slice(j)));
        self.uniform.clear();
    }

    /// The pressures that do what is `wanted`, N, 0 at the `open` nodes, `[l]`, and minus the shifts over the unit
    /// that this takes, `[borders]`.
    pub fn press(
        &mut self,
        (gaps, borders): (&[f32], &[NormalBorder]),
        open: Vec<usize>,
        wanted: WantedGaps,
        forcing: f32,
        effort: &mut Effort,
    ) -> (AlignedVec<f32>, Vec<f32>) {
        if open != self.open {
            self.open = open;
            self.shut = None;
            self.uniform.clear();
        }
        let mut found = self.close(gaps, &wanted.gap, forcing, effort);
        if self.uniform.len() != borders.len() {
            self.uniform.clear();
            for border in borders {
                let mut one = AlignedVec::from(border.column.iter().copied());
                self.open.iter().for_each(|&i| one[i] = 0.0);
                let uniform = self.close(gaps, &one, 1e-4, effort);
                self.uniform.push(uniform);
            }
        }
        let sum = |b: &NormalBorder, v: &[f32]| f64::from(sum_over(v.len(), |i| b.row[i] * v[i]));
        let mut matrix: Vec<f64> = borders.iter().flat_map(|b| self.uniform.iter().map(|u| sum(b, u))).collect();
        let lacks = borders.iter().zip(&wanted.lack).map(|(b, lack)| f64::from(lack - sum(b, &found) as f32));
        let mut nearer: Vec<f64> = lacks.collect();
        if !solve_small(&mut matrix, &mut nearer) {
            // A border whose nodes are all open: the map says so, and another method takes over.
            nearer.fill(f64::NAN);
        }
        let nearer: Vec<f32> = nearer.iter().map(|n| *n as f32).collect();
        for (by, uniform) in nearer.iter().zip(&self.uniform) {
            found.iter_mut().zip(uniform.iter()).for_each(|(f, u)| *f += by * u);
        }
        (found, nearer)
    }

    /// Pressures that close `gap`.
    fn close(&mut self, gaps: &[f32], gap: &[f32], forcing: f32, effort: &mut Effort) -> AlignedVec<f32> {
        let (k, l) = (self.nodes, padded_len::<f32>(self.nodes));
        if self.inverse.is_empty() {
            let mut scale = AlignedVec::from((0..k).map(|i| 1.0 / gaps[(l + 1) * i]));
            self.open.iter().for_each(|&i| scale[i] = 0.0);
            let apply = |v: &[f32], out: &mut [f32]| add_columns(gaps, l, &v[..k], out);
            return conjugate_gradients(gap, &scale, forcing, apply, effort);
        }
        let mut out = AlignedVec::zeros(l);
        add_columns(&self.inverse, l, &gap[..k], &mut out);
        if self.open.is_empty() {
            return out;
        }
        let shut = self.shut.get_or_insert_with(|| {
            let (open, inverse) = (&self.open, &self.inverse);
            Mat::from_fn(open.len(), open.len(), |i, j| inverse[l * open[j] + open[i]]).partial_piv_lu()
        });
        // Forces on the gaps of open nodes that keep their pressures at 0.
        let closing = shut.solve(&Mat::from_fn(self.open.len(), 1, |i, _| -out[self.open[i]]));
        for (a, &j) in self.open.iter().enumerate() {
            out.iter_mut().zip(&self.inverse[l * j..][..l]).for_each(|(o, w)| *o += w * closing[(a, 0)]);
        }
        self.open.iter().for_each(|&i| out[i] = 0.0);
        out
    }

    /// Pressures without friction, N, `[l]`, and minus the shifts over the unit, `[borders]`, from the gaps over the
    /// unit without any pressure, `[k]`; `None` where the set of closed nodes does not settle. `loads` are the
    /// resultants of the borders, N.
    pub fn frictionless(
        &mut self,
        (gaps, borders): (&[f32], &[NormalBorder]),
        gap: &[f32],
        loads: &[f32],
        effort: &mut Effort,
    ) -> Option<(AlignedVec<f32>, Vec<f32>)> {
        let (k, l) = (self.nodes, padded_len::<f32>(self.nodes));
        let mut now = gap.to_vec();
        let (mut pressure, mut approach) = (AlignedVec::zeros(l), vec![0.0f32; borders.len()]);
        let pressed = |pressure: &[f32], now: &[f32]| -> Vec<usize> {
            (0..k).filter(|&i| pressure[i] * gaps[(l + 1) * i] - now[i] > 0.0).collect()
        };
        let settled = settle(pressed(&pressure, &now), 10, |closed| {
            // Without a load nothing touches; with one the nearest node does.
            for border in borders {
                if closed.iter().all(|&i| border.column[i] == 0.0) {
                    let moved = (0..k).filter(|&i| border.column[i] != 0.0);
                    closed.extend(moved.min_by(|&a, &b| now[a].total_cmp(&now[b])));
                    closed.sort_unstable();
                }
            }
            if closed.is_empty() {
                return Err(());
            }
            let mut open: Vec<usize> = (0..k).filter(|i| closed.binary_search(i).is_err()).collect();
            open.iter().for_each(|&i| pressure[i] = 0.0);
            response((gaps, borders), gap, &pressure, &approach, &mut now);
            let mut wanted = AlignedVec::from(now.iter().map(|g| -g));
            open.iter().for_each(|&i| wanted[i] = 0.0);
            let sum = |b: &NormalBorder| b.row.iter().zip(pressure.iter()).map(|(r, p)| r * p).sum::<f32>();
            let lack = borders.iter().zip(loads).map(|(b, n)| n - sum(b)).collect();
            let wanted = WantedGaps { gap: wanted, lack };
            let (change, nearer) = self.press((gaps, borders), std::mem::take(&mut open), wanted, 0.05, effort);
            pressure.iter_mut().zip(change.iter()).for_each(|(p, c)| *p += c);
            approach.iter_mut().zip(&nearer).for_each(|(a, n)| *a += n);
            response((gaps, borders), gap, &pressure, &approach, &mut now);
            Ok::<_, ()>((pressed(&pressure, &now), ()))
        });
        matches!(settled, Ok(Ok(_))).then_some((pressure, approach))
    }
}

/// Gaps over the unit under `pressure` and minus the shifts `approach`, `[borders]`.
fn response(
    (gaps, borders): (&[f32], &[NormalBorder]),
    gap: &[f32],
    pressure: &[f32],
    approach: &[f32],
    out: &mut [f32],
) {
    out.copy_from_slice(gap);
    for (border, by) in borders.iter().zip(approach) {
        out.iter_mut().zip(border.column.iter()).for_each(|(o, c)| *o -= c * by);
    }
    add_columns(gaps, pressure.len(), &pressure[..gap.len()], out);
}
