//! Compliance and motions of a part of the modes.

use super::{real_times, CoupledModes, ModePoles, ModeSet, Reading, SingleMode, COUPLED, FEW, ROUNDING, SHARED};
use crate::model::CoupledModel;
use crate::stability::nonlinear_eigen::pole_sums::PoleSums;
use crate::stability::nonlinear_eigen::{SpectrumMemory, C};
use faer::{Mat, MatRef};
use std::rc::Rc;

impl ModeSet {
    /// The modes from `first` to before `end`, whose amplitudes of the functions are in `basis`, `[functions, modes
    /// of both]`, of which the first one is function `at` of both bodies.
    pub(super) fn new(
        bodies: &CoupledModel,
        (first, end): (usize, usize),
        (basis, at): (MatRef<'_, f64>, usize),
        memory: &SpectrumMemory,
    ) -> Option<Self> {
        let (mut singles, mut groups) = (Vec::new(), Vec::new());
        for modes in coupled(bodies, first, end) {
            if modes.len() > 1 {
                let own = ModePoles::of(bodies.stiffness.submatrix(&modes), bodies.damping.submatrix(&modes), memory)?;
                groups.push(CoupledModes::new(own, modes, basis));
                continue;
            }
            let mode = modes[0];
            let (stiffness, damping) = (bodies.stiffness.get(mode, mode), bodies.damping.get(mode, mode));
            if !(stiffness > 0.0) {
                return None;
            }
            singles.push(SingleMode { mode, stiffness, damping });
        }
        Some(Self::of_modes((singles, groups), (basis, at)))
    }

    /// The same modes with other amplitudes of the functions.
    pub(super) fn elsewhere(&self, (basis, at): (MatRef<'_, f64>, usize)) -> Self {
        let group = |g: &CoupledModes| CoupledModes::new(g.own.clone(), g.modes.clone(), basis);
        Self::of_modes((self.singles.clone(), self.groups.iter().map(group).collect()), (basis, at))
    }

    /// Modes by themselves and coupled ones, with their amplitudes of the functions.
    fn of_modes(
        (singles, groups): (Vec<SingleMode>, Vec<CoupledModes>),
        (basis, at): (MatRef<'_, f64>, usize),
    ) -> Self {
        let functions = basis.nrows();
        let amplitudes = Mat::from_fn(singles.len(), functions, |t, i| basis[(i, singles[t].mode)]);
        let of = |real: bool| {
            let all = groups.iter().flat_map(|g: &CoupledModes| g.own.terms.iter());
            all.filter(move |p| (p.im == 0.0) == real).copied().collect::<Vec<C>>()
        };
        let (real, pairs) = (of(true), of(false));
        let terms = PoleSums {
            singles: [singles.iter().map(|s| s.stiffness).collect(), singles.iter().map(|s| s.damping).collect()],
            real: real.iter().map(|p| p.re).collect(),
            pairs: [pairs.iter().map(|p| p.re).collect(), pairs.iter().map(|p| p.im).collect()],
        };
        let pairs_of = lower_half(functions);
        let symmetric = Mat::from_fn(pairs_of.len(), singles.len(), |k, t| {
            let [i, j] = pairs_of[k];
            amplitudes[(t, i)] * amplitudes[(t, j)]
        });
        let mut residues = Mat::<f64>::zeros(functions * functions, terms.columns() - singles.len());
        let (mut real, mut pairs) = (0, 0);
        for g in &groups {
            let count = g.own.terms.len();
            let moved = Mat::from_fn(functions, g.modes.len(), |i, j| basis[(i, g.modes[j])]) * &g.own.right;
            for (j, pole) in g.own.terms.iter().enumerate() {
                let of = |k: usize| {
                    let i = k % functions;
                    C::new(moved[(i, j)], moved[(i, count + j)]) * g.driven[(j, k / functions)]
                };
                if pole.im == 0.0 {
                    (0..functions * functions)
                        .for_each(|k| residues[(k, terms.of_real(real) - singles.len())] = of(k).re);
                    real += 1;
                } else {
                    // R/(λ − p) and its conjugate.
                    let [along, aside] = terms.of_pair(pairs).map(|column| column - singles.len());
                    for k in 0..functions * functions {
                        let residue = of(k);
                        (residues[(k, along)], residues[(k, aside)]) = (2.0 * residue.re, -2.0 * residue.im);
                    }
                    pairs += 1;
                }
            }
        }
        Self { first: at, functions, singles, amplitudes, groups, terms, symmetric, residues }
    }

    /// Its own of the forces on all functions, `[functions, forces]`.
    pub(super) fn own(&self, forces: &[Vec<C>]) -> Mat<C> {
        Mat::from_fn(self.functions, forces.len(), |i, l| forces[l][self.first + i])
    }

    /// Amplitudes of its modes by themselves under `forces` on its functions, for each of `values`, `[singles,
    /// values]`.
    pub(super) fn motions_of_singles(&self, values: &[C], forces: &Mat<C>) -> Mat<C> {
        let mut moved = real_times(&self.amplitudes, forces);
        for (l, &lambda) in values.iter().enumerate() {
            let column = moved.col_as_slice_mut(l).iter_mut();
            column.zip(&self.singles).for_each(|(q, s)| *q /= off(s.at(lambda), s.stiffness));
        }
        moved
    }

    /// Its G at each of `values`, real part and imaginary part, and the same of derivatives, N in all, `[functions²,
    /// 2N values]`; and the logarithmic derivative of its P.
    pub(super) fn compliance<const N: usize>(&self, values: &[C]) -> (Mat<f64>, Vec<C>) {
        let columns = self.terms.columns();
        let mut shares = vec![0.0; columns * 2 * N * values.len()];
        let mut slopes = Vec::with_capacity(values.len());
        for (&lambda, own) in values.iter().zip(shares.chunks_exact_mut((columns * 2 * N).max(1))) {
            let mut parts: Vec<&mut [f64]> = own.chunks_exact_mut(columns.max(1)).collect();
            slopes.push(self.terms.evaluate(lambda, &mut parts));
        }
        slopes.resize(values.len(), C::default());
        let shares = MatRef::from_column_major_slice(&shares, columns, 2 * N * values.len());
        let (of_singles, of_groups) = shares.split_at_row(self.singles.len());
        let mut sums = &self.residues * of_groups;
        if !self.singles.is_empty() {
            let (symmetric, f) = (&self.symmetric * of_singles, self.functions);
            let places = lower_half(f);
            for l in 0..sums.ncols() {
                let (sum, half) = (sums.col_as_slice_mut(l), symmetric.col_as_slice(l));
                for (&[i, j], v) in places.iter().zip(half) {
                    sum[i + f * j] += v;
                    if i != j {
                        sum[j + f * i] += v;
                    }
                }
            }
        }
        (sums, slopes)
    }

    pub(super) fn poles(&self) -> Vec<C> {
        let single = |s: &SingleMode| {
            let half = 0.5 * s.damping;
            let root = C::from(half * half - s.stiffness).sqrt();
            [root - half, -root - half]
        };
        let groups = self.groups.iter().flat_map(|g| g.own.values.iter().copied());
        self.singles.iter().flat_map(single).chain(groups).collect()
    }
}

impl CoupledModes {
    /// These `modes` with their amplitudes of the functions in `basis`.
    fn new(own: Rc<ModePoles>, modes: Vec<usize>, basis: MatRef<'_, f64>) -> Self {
        let onto = &own.onto * Mat::from_fn(modes.len(), basis.nrows(), |i, j| basis[(j, modes[i])]);
        let t = own.terms.len();
        let driven = Mat::from_fn(t, basis.nrows(), |i, j| C::new(onto[(i, j)], onto[(t + i, j)]));
        Self { modes, own, driven }
    }

    /// No more than the square of the norm of [`motions`](Self::motions) for each of `values`: as much as is read off
    /// them at one pole.
    pub(super) fn least(&self, values: &[C], forces: &Mat<C>) -> Vec<f64> {
        let by_pole = &self.driven * forces;
        let of = |(l, lambda): (usize, &C)| {
            let at = self.own.terms.iter().zip(&self.own.readings).zip(by_pole.col_as_slice(l));
            let read = |((pole, reading), by): ((&C, &Reading), &C)| {
                by.norm_sqr() / (off(lambda - pole, pole.norm()).norm_sqr() * reading.square(*lambda))
            };
            at.map(read).fold(0.0, f64::max)
        };
        values.iter().enumerate().map(of).collect()
    }

    /// Amplitudes of its modes under `forces` on the functions, for each of `values`, `[modes, values]`.
    pub(super) fn motions(&self, values: &[C], forces: &Mat<C>) -> Mat<C> {
        let (t, f, count) = (self.own.terms.len(), self.driven.ncols(), values.len());
        let by_pole = &self.driven * forces;
        let by_other = Mat::from_fn(t, f, |i, j| self.driven[(i, j)].conj()) * forces;
        // Of the amplitudes a and b of a pole and of its conjugate the modes have Re (a + b) + i Im (a − b): a real
        // product.
        let mut amplitudes = Mat::<f64>::zeros(2 * t, 2 * count);
        let sizes: Vec<f64> = self.own.terms.iter().map(|p| p.norm()).collect();
        for (l, lambda) in values.iter().enumerate() {
            for (j, pole) in self.own.terms.iter().enumerate() {
                let size = sizes[j];
                let a = by_pole[(j, l)] * off(lambda - pole, size).inv();
                let b = match pole.im == 0.0 {
                    true => C::default(),
                    false => by_other[(j, l)] * off(lambda - pole.conj(), size).inv(),
                };
                let (sum, turned) = (a + b, C::i() * (a - b));
                (amplitudes[(j, l)], amplitudes[(j, count + l)]) = (sum.re, sum.im);
                (amplitudes[(t + j, l)], amplitudes[(t + j, count + l)]) = (turned.re, turned.im);
            }
        }
        let moved = &self.own.right * amplitudes;
        Mat::from_fn(self.modes.len(), count, |i, l| C::new(moved[(i, l)], moved[(i, count + l)]))
    }
}

/// Rows and columns on and below the diagonal of a matrix of order `n`, column by column.
fn lower_half(n: usize) -> Vec<[usize; 2]> {
    (0..n).flat_map(|j| (j..n).map(move |i| [i, j])).collect()
}

/// Removes rounding at a pole: `v`, but zero if it is less than rounding of `size`.
pub(super) fn off(v: C, size: f64) -> C {
    if v.norm_sqr() < (f64::EPSILON * size).powi(2) {
        C::from(f64::EPSILON * size)
    } else {
        v
    }
}

/// The modes from `first` to before `end` in groups that are coupled, each ascending.
pub(super) fn coupled(bodies: &CoupledModel, first: usize, end: usize) -> Vec<Vec<usize>> {
    if [&bodies.stiffness, &bodies.damping].iter().all(|m| m.is_diagonal(first, end)) {
        return (first..end).map(|i| vec![i]).collect();
    }
    let rate: Vec<f64> = (first..end).map(|i| bodies.stiffness.get(i, i).abs().sqrt()).collect();
    let tied = |i: usize, j: usize| {
        let (a, b) = (rate[i - first], rate[j - first]);
        bodies.stiffness.get(i, j).abs() > COUPLED * a * b || bodies.damping.get(i, j).abs() > COUPLED * (a * b).sqrt()
    };
    // The first mode of the group of each, as far as it is known.
    let mut group: Vec<usize> = (0..end - first).collect();
    let mut apart = group.len();
    for (j, i) in (first..end).flat_map(|j| (first..end).map(move |i| (j, i))) {
        let [a, b] = [group[i - first], group[j - first]];
        if a != b && tied(i, j) {
            let [low, high] = [a.min(b), a.max(b)];
            group.iter_mut().filter(|of| **of == high).for_each(|of| *of = low);
            apart -= 1;
            if apart == 1 {
                break;
            }
        }
    }
    let members = |of: usize| (first..end).filter(|i| group[i - first] == of).collect::<Vec<_>>();
    (0..group.len()).filter(|&of| group[of] == of).map(members).collect()
}

/// Amplitudes B of the functions of which the modes `psi` consist, `[r, modes]`, with orthonormal rows, and the first
/// one and the number of those of each body, whose modes lie between two of `ends`. Bodies
/// that move alike over the contact share their functions: it sees the sum of their motions alone.
pub(super) fn basis(psi: &Mat<f64>, ends: [(usize, usize); 2]) -> Option<(Mat<f64>, [[usize; 2]; 2])> {
    let few = |(first, end): (usize, usize)| (FEW * (end - first) as f64) as usize;
    let of = |range: (usize, usize), limit: usize| {
        functions(psi.as_ref().subcols(range.0, range.1 - range.0).to_owned(), limit)
    };
    let both = [of(ends[0], few(ends[0]))?, of(ends[1], few(ends[1]))?];
    let counts = [both[0].len(), both[1].len()];
    let limit = (SHARED * (counts[0] + counts[1]) as f64) as usize;
    let put = |basis: &mut Mat<f64>, (row, first): (usize, usize), functions: &[Vec<f64>]| {
        for (i, f) in functions.iter().enumerate() {
            f.iter().enumerate().for_each(|(j, v)| basis[(row + i, first + j)] = *v);
        }
    };
    let shared = if counts.contains(&0) { None } else { of((0, psi.ncols()), limit) };
    if let Some(shared) = shared {
        let mut basis = Mat::<f64>::zeros(shared.len(), psi.ncols());
        put(&mut basis, (0, 0), &shared);
        return Some((basis, [[0, shared.len()]; 2]));
    }
    let mut basis = Mat::<f64>::zeros(counts[0] + counts[1], psi.ncols());
    put(&mut basis, (0, ends[0].0), &both[0]);
    put(&mut basis, (counts[0], ends[1].0), &both[1]);
    Some((basis, [[0, counts[0]], counts]))
}

/// Orthonormal functions of the columns that the rows of `shapes` consist of, by elimination of the largest row each
/// time; none where they are more than `limit`.
pub(super) fn functions(mut shapes: Mat<f64>, limit: usize) -> Option<Vec<Vec<f64>>> {
    let (rows, columns) = (shapes.nrows(), shapes.ncols());
    let mut found: Vec<Vec<f64>> = Vec::new();
    let mut largest = 0.0;
    loop {
        let mut sizes = vec![0.0; rows];
        for j in 0..columns {
            sizes.iter_mut().zip(shapes.col_as_slice(j)).for_each(|(s, v)| *s += v * v);
        }
        let Some(row) = (0..rows).max_by(|&a, &b| sizes[a].total_cmp(&sizes[b])) else { return Some(found) };
        largest = f64::max(largest, sizes[row].sqrt());
        if sizes[row] == 0.0 || sizes[row].sqrt() <= ROUNDING * largest {
            return Some(found);
        }
        if found.len() >= limit {
            return None;
        }
        let mut new: Vec<f64> = (0..columns).map(|j| shapes[(row, j)]).collect();
        for _ in 0..2 {
            for old in &found {
                let product: f64 = old.iter().zip(&new).map(|(a, b)| a * b).sum();
                new.iter_mut().zip(old).for_each(|(a, b)| *a -= product * b);
            }
            let norm = new.iter().map(|v| v * v).sum::<f64>().sqrt();
            new.iter_mut().for_each(|v| *v /= norm);
        }
        let mut along = vec![0.0; rows];
        for (j, n) in new.iter().enumerate() {
            along.iter_mut().zip(shapes.col_as_slice(j)).for_each(|(a, v)| *a += v * n);
        }
        for (j, n) in new.iter().enumerate() {
            shapes.col_as_slice_mut(j).iter_mut().zip(&along).for_each(|(v, a)| *v -= a * n);
        }
        found.push(new);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::ReducedBody;

    /// Groups of modes whose damping couples them, also by way of others, in either direction.
    #[test]
    fn coupled_modes_are_found() {
        let mut damping = Mat::from_fn(7, 7, |i, j| if i == j { 1.0 } else { 0.0 });
        [(5, 1), (1, 3), (6, 0)].iter().for_each(|&(i, j)| damping[(i, j)] = 0.2);
        let body = ReducedBody::new(vec![10.0; 7], damping, Mat::zeros(3, 7), Mat::zeros(3, 3));
        let rigid = ReducedBody::new(Vec::new(), Vec::new(), Mat::zeros(3, 0), Mat::zeros(3, 3));
        let bodies = CoupledModel::new(&body, &rigid).unwrap();
        assert_eq!(coupled(&bodies, 0, 7), [vec![0, 6], vec![1, 3, 5], vec![2], vec![4]]);
        assert_eq!(coupled(&bodies, 1, 5), [vec![1, 3], vec![2], vec![4]]);
        let all = ReducedBody { damping: Mat::from_fn(7, 7, |_, _| 1.0).into(), ..body };
        assert_eq!(coupled(&CoupledModel::new(&all, &rigid).unwrap(), 0, 7), [(0..7).collect::<Vec<_>>()]);
    }
}
