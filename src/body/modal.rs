//! Matrices in modal coordinates: diagonal where the modes do not couple, one full block for each body where they do.

use crate::parallel::World;
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};
use num_complex::Complex;
use std::ops::{AddAssign, Mul};
use std::sync::Arc;

/// A matrix over the modes of one body, or of several bodies one after the other; bodies never couple in it.
#[derive(Debug, Clone, PartialEq)]
pub enum ModalMatrix {
    /// The diagonal, `[m]`.
    Diagonal(Vec<f64>),
    /// Square blocks along the diagonal, one for each body.
    Blocks(Vec<ModalBlock>),
}

/// The block of a body: the modes of a rail do not couple although those of a wheel that rotates do.
#[derive(Debug, Clone)]
pub enum ModalBlock {
    /// The diagonal, `[m]`.
    Diagonal(Vec<f64>),
    /// `[m, m]`, shared by the models of a study.
    Full(Arc<Mat<f64>>),
}

impl PartialEq for ModalBlock {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Diagonal(a), Self::Diagonal(b)) => a == b,
            (Self::Full(a), Self::Full(b)) => Arc::ptr_eq(a, b) || a == b,
            _ => false,
        }
    }
}

impl From<Mat<f64>> for ModalBlock {
    fn from(block: Mat<f64>) -> Self {
        Self::Full(Arc::new(block))
    }
}

impl ModalBlock {
    /// Number of modes.
    pub fn order(&self) -> usize {
        match self {
            Self::Diagonal(d) => d.len(),
            Self::Full(a) => a.nrows(),
        }
    }

    /// Entry (i, j).
    pub fn get(&self, i: usize, j: usize) -> f64 {
        match self {
            Self::Diagonal(d) if i == j => d[i],
            Self::Diagonal(_) => 0.0,
            Self::Full(a) => a[(i, j)],
        }
    }

    /// Every entry, `[m, m]`.
    pub fn full(&self) -> Mat<f64> {
        match self {
            Self::Diagonal(d) => Mat::from_fn(d.len(), d.len(), |i, j| if i == j { d[i] } else { 0.0 }),
            Self::Full(a) => Mat::clone(a),
        }
    }

    /// Square of the Frobenius norm.
    pub fn square(&self) -> f64 {
        match self {
            Self::Diagonal(d) => d.iter().map(|v| v * v).sum(),
            Self::Full(a) => a.squared_norm_l2(),
        }
    }

    fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Diagonal(d) => Self::Diagonal(d.iter().map(|v| factor * v).collect()),
            Self::Full(a) if factor == 1.0 => Self::Full(a.clone()),
            Self::Full(a) => (faer::Scale(factor) * &**a).into(),
        }
    }

    fn transposed(&self) -> Self {
        match self {
            Self::Diagonal(d) => Self::Diagonal(d.clone()),
            Self::Full(a) => a.transpose().to_owned().into(),
        }
    }

    fn add_diagonal(&mut self, diagonal: &[f64]) {
        match self {
            Self::Diagonal(own) => own.iter_mut().zip(diagonal).for_each(|(o, d)| *o += d),
            Self::Full(_) if diagonal.iter().all(|d| *d == 0.0) => {}
            Self::Full(a) => {
                let a = Arc::make_mut(a);
                diagonal.iter().enumerate().for_each(|(i, d)| a[(i, i)] += d);
            }
        }
    }

    /// See [`ModalMatrix::statics`].
    fn statics(&self, forces: MatRef<'_, f64>) -> Mat<f64> {
        let b = match self {
            Self::Diagonal(d) => {
                let at = |i: usize, j: usize| if d[i] > 0.0 { forces[(i, j)] / d[i] } else { 0.0 };
                return Mat::from_fn(forces.nrows(), forces.ncols(), at);
            }
            Self::Full(b) => b,
        };
        let mut out = Mat::zeros(forces.nrows(), forces.ncols());
        let largest = b.norm_max();
        let stiff: Vec<usize> =
            (0..b.nrows()).filter(|&i| b.row(i).norm_max().max(b.col(i).norm_max()) > 1e-14 * largest).collect();
        let k = Mat::from_fn(stiff.len(), stiff.len(), |i, j| b[(stiff[i], stiff[j])]);
        let f = Mat::from_fn(stiff.len(), forces.ncols(), |i, j| forces[(stiff[i], j)]);
        let q = k.partial_piv_lu().solve(&f);
        for (i, &row) in stiff.iter().enumerate() {
            (0..forces.ncols()).for_each(|j| out[(row, j)] = q[(i, j)]);
        }
        out
    }
}

impl From<Vec<f64>> for ModalMatrix {
    fn from(diagonal: Vec<f64>) -> Self {
        ModalMatrix::Diagonal(diagonal)
    }
}

impl From<Mat<f64>> for ModalMatrix {
    fn from(block: Mat<f64>) -> Self {
        ModalMatrix::Blocks(vec![block.into()])
    }
}

impl ModalMatrix {
    /// diag(ω²) of angular frequencies, rad/s.
    pub fn squares(omega: &[f64]) -> Self {
        ModalMatrix::Diagonal(omega.iter().map(|w| w * w).collect())
    }

    /// Number of modes m.
    pub fn order(&self) -> usize {
        match self {
            ModalMatrix::Diagonal(d) => d.len(),
            ModalMatrix::Blocks(blocks) => blocks.iter().map(ModalBlock::order).sum(),
        }
    }

    /// The blocks, a diagonal being one of them.
    pub fn blocks(&self) -> Vec<ModalBlock> {
        match self {
            ModalMatrix::Diagonal(d) => vec![ModalBlock::Diagonal(d.clone())],
            ModalMatrix::Blocks(blocks) => blocks.clone(),
        }
    }

    /// The matrix of two bodies, one after the other: diagonal if both are.
    pub fn joined(&self, other: &Self) -> Self {
        match (self, other) {
            (ModalMatrix::Diagonal(a), ModalMatrix::Diagonal(b)) => ModalMatrix::Diagonal([&a[..], &b[..]].concat()),
            _ => ModalMatrix::Blocks([self.blocks(), other.blocks()].concat()),
        }
    }

    /// The matrix times a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        match self {
            ModalMatrix::Diagonal(d) => ModalMatrix::Diagonal(d.iter().map(|v| factor * v).collect()),
            ModalMatrix::Blocks(blocks) => ModalMatrix::Blocks(blocks.iter().map(|b| b.scaled(factor)).collect()),
        }
    }

    /// The matrix plus a diagonal, `[m]`.
    pub(crate) fn with_diagonal(mut self, diagonal: &[f64]) -> Self {
        match &mut self {
            ModalMatrix::Diagonal(own) => own.iter_mut().zip(diagonal).for_each(|(o, d)| *o += d),
            ModalMatrix::Blocks(blocks) => {
                let mut rest = diagonal;
                for b in blocks {
                    let (own, others) = rest.split_at(b.order().min(rest.len()));
                    b.add_diagonal(own);
                    rest = others;
                }
            }
        }
        self
    }

    /// The transposed matrix.
    pub fn transposed(&self) -> Self {
        match self {
            ModalMatrix::Diagonal(d) => ModalMatrix::Diagonal(d.clone()),
            ModalMatrix::Blocks(blocks) => ModalMatrix::Blocks(blocks.iter().map(ModalBlock::transposed).collect()),
        }
    }

    /// Entry (i, j).
    pub fn get(&self, i: usize, j: usize) -> f64 {
        match self {
            ModalMatrix::Diagonal(d) => {
                if i == j {
                    d[i]
                } else {
                    0.0
                }
            }
            ModalMatrix::Blocks(blocks) => {
                let mut first = 0;
                for b in blocks {
                    let end = first + b.order();
                    if i < end && j < end {
                        return if i >= first && j >= first { b.get(i - first, j - first) } else { 0.0 };
                    }
                    first = end;
                }
                0.0
            }
        }
    }

    /// Rows and columns of the `modes`, ascending, `[modes, modes]`.
    pub fn submatrix(&self, modes: &[usize]) -> Mat<f64> {
        let mut found = Mat::zeros(modes.len(), modes.len());
        let mut first = 0;
        for b in self.blocks().iter() {
            let end = first + b.order();
            let own = modes.partition_point(|&k| k < first)..modes.partition_point(|&k| k < end);
            for j in own.clone() {
                let column = found.col_as_slice_mut(j);
                own.clone().for_each(|i| column[i] = b.get(modes[i] - first, modes[j] - first));
            }
            first = end;
        }
        found
    }

    /// The whole matrix, `[m, m]`.
    pub fn full(&self) -> Mat<f64> {
        let m = self.order();
        let mut all = Mat::zeros(m, m);
        let mut first = 0;
        for b in self.blocks() {
            let n = b.order();
            all.as_mut().submatrix_mut(first, first, n, n).copy_from(&b.full());
            first += n;
        }
        all
    }

    /// True if the modes from `first` to before `end` couple with no other one.
    pub(crate) fn is_diagonal(&self, first: usize, end: usize) -> bool {
        let ModalMatrix::Blocks(blocks) = self else { return true };
        let mut at = 0;
        blocks.iter().all(|b| {
            let own = at..at + b.order();
            at = own.end;
            own.end <= first || end <= own.start || matches!(b, ModalBlock::Diagonal(_))
        })
    }

    /// Square of the Frobenius norm.
    pub fn square(&self) -> f64 {
        match self {
            ModalMatrix::Diagonal(d) => d.iter().map(|v| v * v).sum(),
            ModalMatrix::Blocks(blocks) => blocks.iter().map(ModalBlock::square).sum(),
        }
    }

    /// A x of real or complex amplitudes, `[m]`.
    pub fn times<T>(&self, x: &[T]) -> Vec<T>
    where
        T: Copy + Default + AddAssign,
        f64: Mul<T, Output = T>,
    {
        let blocks = match self {
            ModalMatrix::Diagonal(d) => return d.iter().zip(x).map(|(d, x)| *d * *x).collect(),
            ModalMatrix::Blocks(blocks) => blocks,
        };
        let mut out = vec![T::default(); x.len()];
        let mut first = 0;
        for b in blocks {
            let span = first..first + b.order();
            let (into, of) = (&mut out[span.clone()], &x[span.clone()]);
            match b {
                ModalBlock::Diagonal(d) => into.iter_mut().zip(d.iter().zip(of)).for_each(|(o, (d, x))| *o += *d * *x),
                ModalBlock::Full(a) => {
                    for (column, &x) in a.col_iter().zip(of) {
                        into.iter_mut().zip(column.iter()).for_each(|(o, a)| *o += *a * x);
                    }
                }
            }
            first = span.end;
        }
        out
    }

    /// A X of the columns of X, `[m, k]`.
    pub fn product(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let blocks = match self {
            ModalMatrix::Diagonal(d) => return Mat::from_fn(x.nrows(), x.ncols(), |i, j| d[i] * x[(i, j)]),
            ModalMatrix::Blocks(blocks) => blocks,
        };
        let mut out = Mat::zeros(x.nrows(), x.ncols());
        let mut first = 0;
        for b in blocks {
            let own = x.subrows(first, b.order());
            let product = match b {
                ModalBlock::Diagonal(d) => Mat::from_fn(d.len(), x.ncols(), |i, j| d[i] * own[(i, j)]),
                ModalBlock::Full(a) => &**a * own,
            };
            out.as_mut().subrows_mut(first, b.order()).copy_from(product);
            first += b.order();
        }
        out
    }

    /// xᴴ A x of the symmetric part.
    pub fn form(&self, x: &[Complex<f64>]) -> f64 {
        x.iter().zip(self.times(x)).map(|(x, y)| (x.conj() * y).re).sum()
    }

    /// Largest |a_ij − a_ji| over the largest |a_ij|.
    pub fn asymmetry(&self) -> f64 {
        let ModalMatrix::Blocks(blocks) = self else { return 0.0 };
        let (mut largest, mut apart) = (0.0f64, 0.0f64);
        for b in blocks {
            match b {
                ModalBlock::Diagonal(d) => largest = d.iter().fold(largest, |l, v| l.max(v.abs())),
                ModalBlock::Full(b) => {
                    for j in 0..b.ncols() {
                        for i in 0..b.nrows() {
                            largest = largest.max(b[(i, j)].abs());
                            apart = apart.max((b[(i, j)] - b[(j, i)]).abs());
                        }
                    }
                }
            }
        }
        if largest > 0.0 {
            apart / largest
        } else {
            0.0
        }
    }

    /// Every entry of the diagonal, or of each block with its zeros, block by block.
    pub fn values(&self) -> Vec<f64> {
        let full = |b: &ModalBlock| {
            let all = b.full();
            all.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<f64>>()).collect::<Vec<f64>>()
        };
        match self {
            ModalMatrix::Diagonal(d) => d.clone(),
            ModalMatrix::Blocks(blocks) => blocks.iter().flat_map(full).collect(),
        }
    }

    /// Collective: the matrix of rank 0 on every rank.
    pub fn broadcast(world: &World, root: Option<&Self>) -> Self {
        // Orders of the blocks, each with 1 where it is a diagonal; none for a diagonal.
        let orders = root.map_or(Vec::new(), |m| match m {
            ModalMatrix::Diagonal(_) => Vec::new(),
            ModalMatrix::Blocks(blocks) => {
                let of = |b: &ModalBlock| [b.order() as u64, u64::from(matches!(b, ModalBlock::Diagonal(_)))];
                blocks.iter().flat_map(of).collect()
            }
        });
        let orders = world.broadcast(orders);
        let kept = |m: &Self| match m {
            ModalMatrix::Diagonal(d) => d.clone(),
            ModalMatrix::Blocks(blocks) => {
                let of = |b: &ModalBlock| match b {
                    ModalBlock::Diagonal(d) => d.clone(),
                    ModalBlock::Full(a) => a.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<f64>>()).collect(),
                };
                blocks.iter().flat_map(of).collect()
            }
        };
        let values = world.broadcast(root.map_or(Vec::new(), kept));
        if orders.is_empty() {
            return ModalMatrix::Diagonal(values);
        }
        let mut rest = &values[..];
        let block = |of: &[u64]| {
            let (n, diagonal) = (of[0] as usize, of[1] == 1);
            let (mine, others) = rest.split_at(if diagonal { n } else { n * n });
            rest = others;
            match diagonal {
                true => ModalBlock::Diagonal(mine.to_vec()),
                false => Mat::from_fn(n, n, |i, j| mine[i + n * j]).into(),
            }
        };
        ModalMatrix::Blocks(orders.chunks_exact(2).map(block).collect())
    }

    /// The static amplitudes K⁻¹ f under modal forces, columns of `[m, k]`, with this matrix as stiffness. Modes
    /// without stiffness stay at 0.
    pub fn statics(&self, forces: MatRef<'_, f64>) -> Mat<f64> {
        let mut out = Mat::zeros(forces.nrows(), forces.ncols());
        let mut first = 0;
        for b in self.blocks() {
            let own = b.statics(forces.subrows(first, b.order()));
            out.as_mut().subrows_mut(first, b.order()).copy_from(own);
            first += b.order();
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks() -> ModalMatrix {
        let a = Mat::from_fn(2, 2, |i, j| [[4.0, 1.0], [1.0, 3.0]][i][j]);
        ModalMatrix::from(a).joined(&ModalMatrix::from(vec![5.0, 0.0]))
    }

    #[test]
    fn bodies_do_not_couple() {
        let m = blocks();
        assert_eq!((m.order(), m.get(0, 1), m.get(1, 2), m.get(2, 0), m.get(2, 2)), (4, 1.0, 0.0, 0.0, 5.0));
        let x = [1.0, -2.0, 3.0, 7.0];
        assert_eq!(m.times(&x), [2.0, -5.0, 15.0, 0.0]);
        let full = m.full();
        assert!((0..4).all(|i| (0..4).all(|j| full[(i, j)] == m.get(i, j))));
        assert_eq!(m.scaled(2.0).times(&x), [4.0, -10.0, 30.0, 0.0]);
    }

    #[test]
    fn statics_undo_the_stiffness_and_leave_rigid_modes_alone() {
        let m = blocks();
        let q = [0.3, -0.1, 2.0, 0.0];
        let f = m.times(&q);
        let found = m.statics(Mat::from_fn(4, 1, |i, _| if i == 3 { 9.0 } else { f[i] }).as_ref());
        assert!((0..4).all(|i| (found[(i, 0)] - q[i]).abs() < 1e-15), "{found:?}");
    }
}
