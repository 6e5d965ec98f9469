//! The pressures of a step, in single precision.

use faer::linalg::solvers::{DenseSolveCore, PartialPivLu, Solve};
use faer::Mat;

use super::krylov::conjugate_gradients;
use crate::contact::active_set::settle;
use crate::dense::{add_columns, sum_over};
use crate::transient::aligned::{whole, AlignedVec};
use crate::transient::problem::Effort;

/// Solutions after which the inverse of the normal part pays; until then conjugate gradients find the pressures too.
const WORTH: usize = 8;

/// Solver of the pressures of k nodes in l places; `gaps` everywhere is W_nn in units of the operator, columns,
/// `[k][l]`. Places without a node have no gap and no pressure.
pub(super) struct Normal {
    /// k.
    nodes: usize,
    /// Inverse of W_nn + μ W_nt d, columns, `[k][l]`, where it was made.
    inverse: AlignedVec<f32>,
    /// Open nodes, and the factor of the rows and columns of the inverse that they have.
    open: Vec<usize>,
    shut: Option<PartialPivLu<f32>>,
    /// Pressures that a uniform gap of minus the unit makes on the nodes that are not open, `[l]`; empty where not
    /// known.
    uniform: AlignedVec<f32>,
    /// Systems solved.
    solved: usize,
}

/// Gaps to be closed and what the pressures are to sum up to.
pub(super) struct Wanted {
    /// Minus the gaps over the unit, N, `[l]`; 0 at open nodes.
    pub gap: AlignedVec<f32>,
    /// Total of the pressures, N, where the bodies are free to come nearer to each other.
    pub total: Option<f32>,
}

impl Normal {
    /// For `nodes` nodes.
    pub fn new(nodes: usize) -> Self {
        let (inverse, uniform) = (AlignedVec::default(), AlignedVec::default());
        Self { nodes, inverse, open: Vec::new(), shut: None, uniform, solved: 0 }
    }

    /// Returns whether an inverse is to be made now; counts the systems solved.
    pub fn wants_inverse(&mut self) -> bool {
        self.solved += 1;
        self.solved > WORTH && self.inverse.is_empty()
    }

    /// Makes the inverse of `gaps` and `coupling`, (row, column) ↦ what friction adds.
    pub fn invert(&mut self, gaps: &[f32], coupling: impl Fn(usize, usize) -> f32) {
        let (k, l) = (self.nodes, whole::<f32>(self.nodes));
        let inverse = Mat::from_fn(k, k, |i, j| gaps[l * j + i] + coupling(i, j)).partial_piv_lu().inverse();
        self.inverse = AlignedVec::zeros(k * l);
        (0..k).for_each(|j| self.inverse[l * j..][..k].copy_from_slice(inverse.col_as_slice(j)));
        self.uniform = AlignedVec::default();
    }

    /// The pressures that do what is `wanted`, N, 0 at the `open` nodes, `[l]`, and the approach over the unit that
    /// this takes.
    pub fn press(
        &mut self,
        gaps: &[f32],
        open: Vec<usize>,
        wanted: Wanted,
        forcing: f32,
        effort: &mut Effort,
    ) -> (AlignedVec<f32>, f32) {
        if open != self.open {
            self.open = open;
            self.shut = None;
            self.uniform = AlignedVec::default();
        }
        let mut found = self.close(gaps, &wanted.gap, forcing, effort);
        let Some(total) = wanted.total else { return (found, 0.0) };
        if self.uniform.is_empty() {
            let mut one = AlignedVec::from((0..self.nodes).map(|_| 1.0));
            self.open.iter().for_each(|&i| one[i] = 0.0);
            self.uniform = self.close(gaps, &one, 1e-4, effort);
        }
        let approach = (total - sum_over(found.len(), |i| found[i])) / sum_over(found.len(), |i| self.uniform[i]);
        found.iter_mut().zip(self.uniform.iter()).for_each(|(f, u)| *f += approach * u);
        (found, approach)
    }

    /// Pressures that close `gap`.
    fn close(&mut self, gaps: &[f32], gap: &[f32], forcing: f32, effort: &mut Effort) -> AlignedVec<f32> {
        let (k, l) = (self.nodes, whole::<f32>(self.nodes));
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

    /// Pressures without friction, N, `[l]`, and the approach over the unit, from the gaps over the unit without any
    /// pressure, `[k]`; `None` where the set of closed nodes does not settle. `load` is the total of the pressures
    /// where it is given.
    pub fn frictionless(
        &mut self,
        gaps: &[f32],
        gap: &[f32],
        load: Option<f32>,
        effort: &mut Effort,
    ) -> Option<(AlignedVec<f32>, f32)> {
        let (k, l) = (self.nodes, whole::<f32>(self.nodes));
        let mut now = gap.to_vec();
        let (mut pressure, mut approach) = (AlignedVec::zeros(l), 0.0f32);
        let nearer_than = |now: &[f32]| (0..k).min_by(|&a, &b| now[a].total_cmp(&now[b]));
        let pressed = |pressure: &[f32], now: &[f32]| -> Vec<usize> {
            (0..k).filter(|&i| pressure[i] * gaps[(l + 1) * i] - now[i] > 0.0).collect()
        };
        let settled = settle(pressed(&pressure, &now), 10, |closed| {
            if closed.is_empty() {
                // Without a load nothing touches; with one the nearest node does.
                load.ok_or(())?;
                closed.extend(nearer_than(&now));
            }
            let mut open: Vec<usize> = (0..k).filter(|i| closed.binary_search(i).is_err()).collect();
            open.iter().for_each(|&i| pressure[i] = 0.0);
            response(gaps, gap, &pressure, approach, &mut now);
            let mut wanted = AlignedVec::from(now.iter().map(|g| -g));
            open.iter().for_each(|&i| wanted[i] = 0.0);
            let total = load.map(|n| n - pressure.iter().sum::<f32>());
            let (change, nearer) =
                self.press(gaps, std::mem::take(&mut open), Wanted { gap: wanted, total }, 0.05, effort);
            pressure.iter_mut().zip(change.iter()).for_each(|(p, c)| *p += c);
            approach += nearer;
            response(gaps, gap, &pressure, approach, &mut now);
            Ok::<_, ()>((pressed(&pressure, &now), ()))
        });
        matches!(settled, Ok(Ok(_))).then_some((pressure, approach))
    }
}

/// Gaps over the unit under `pressure` and `approach`.
fn response(gaps: &[f32], gap: &[f32], pressure: &[f32], approach: f32, out: &mut [f32]) {
    out.iter_mut().zip(gap).for_each(|(o, g)| *o = g - approach);
    add_columns(gaps, pressure.len(), &pressure[..gap.len()], out);
}
