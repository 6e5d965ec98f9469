//! Contact trace of a body: its contact rows as combinations of its degrees of freedom, and the side on which it
//! stands. The signs of contact rows are made here and nowhere else.

use crate::parallel::World;
use crate::{Error, Result};
use faer::{Mat, MatRef};
use mpi::traits::Equivalence;

/// Side of the contact interface. Bodies are given in lower form, the upper one reflected in z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Body 1, under the contact.
    Lower,
    /// Body 2, above it.
    Upper,
}

impl Side {
    /// Both, body 1 first.
    pub const BOTH: [Side; 2] = [Side::Lower, Side::Upper];

    /// The side that a job calls `name`; other names are a defect.
    pub fn named(name: &str) -> Result<Self> {
        let found = Self::BOTH.into_iter().find(|s| s.name() == name);
        found.ok_or_else(|| Error::Defect(format!("no side is called {name}")))
    }

    /// "lower" or "upper", as in the job and the results.
    pub fn name(self) -> &'static str {
        match self {
            Side::Lower => "lower",
            Side::Upper => "upper",
        }
    }

    /// 0 or 1.
    pub fn index(self) -> usize {
        self as usize
    }

    /// E: the factor between row `row` = 3i + c of the contact (tx, ty, p) and that of the body on this side, (x, y,
    /// n into the body): the traction on body 1 acts on body 2 with the opposite sign, the pressure into either.
    /// Displacements of the rows become the body's part of (w_x, w_y, change of gap) by the same factor.
    pub fn sign(self, row: usize) -> f64 {
        if self == Side::Upper && row % 3 < 2 {
            -1.0
        } else {
            1.0
        }
    }

    /// E r of contact rows, `[3n]`.
    pub(crate) fn orient(self, rows: &[f64]) -> Vec<f64> {
        rows.iter().enumerate().map(|(row, r)| self.sign(row) * r).collect()
    }

    /// The factor between component `c` (x, y, z) of a point or a displacement on this side and that of the lower form.
    pub(crate) fn reflection(self, c: usize) -> f64 {
        if self == Side::Upper && c == 2 {
            -1.0
        } else {
            1.0
        }
    }
}

/// Direction of the contact row `row` = 3i + c against the body's own axes in lower form: n points into the body, −z.
pub(super) fn axis(row: usize) -> f64 {
    if row % 3 == 2 {
        -1.0
    } else {
        1.0
    }
}

/// P: contact rows 3i + c, c = (x, y, n into the body), as combinations of distributed degrees of freedom.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    rows: usize,
    /// Row, degree of freedom and coefficient, by rows; the same on every rank.
    terms: Vec<(usize, u64, f64)>,
    /// The terms of this rank: row, local degree of freedom, coefficient.
    own: Vec<(usize, usize, f64)>,
    /// On rank 0: the rows of the terms of each rank.
    arriving: Vec<Vec<usize>>,
    /// Factors between the contact rows and the rows of the terms, `[3n, rows]`; none where these are the contact rows.
    factors: Option<Mat<f64>>,
}

impl Trace {
    /// Collective: the trace whose rows rank 0 gives as (degree of freedom, coefficient); `ranges` are the first
    /// degrees of freedom of the ranks, `[size + 1]`.
    pub fn new(world: &World, ranges: &[u64], rows: Option<&[Vec<(u64, f64)>]>) -> Result<Self> {
        let of_rows = rows.unwrap_or_default();
        let counts = world.broadcast(of_rows.iter().map(|r| r.len() as u64).collect::<Vec<_>>());
        let dofs = world.broadcast(of_rows.iter().flatten().map(|t| t.0).collect::<Vec<_>>());
        let factors = world.broadcast(of_rows.iter().flatten().map(|t| t.1).collect::<Vec<_>>());
        let order = ranges.last().copied().unwrap_or(0);
        if let Some(dof) = dofs.iter().find(|d| **d >= order) {
            return Err(Error::Defect(format!("trace: degree of freedom {dof} of {order}")));
        }
        let of_term = counts.iter().enumerate().flat_map(|(row, &n)| std::iter::repeat_n(row, n as usize));
        let terms: Vec<(usize, u64, f64)> = of_term.zip(dofs).zip(factors).map(|((r, d), f)| (r, d, f)).collect();
        let of_rank = |rank: usize| terms.iter().filter(move |t| (ranges[rank]..ranges[rank + 1]).contains(&t.1));
        let own = of_rank(world.rank).map(|&(r, d, f)| (r, (d - ranges[world.rank]) as usize, f)).collect();
        let arriving = match world.is_root() {
            true => (0..world.size).map(|rank| of_rank(rank).map(|t| t.0).collect()).collect(),
            false => Vec::new(),
        };
        Ok(Self { rows: counts.len(), own, arriving, terms, factors: None })
    }

    /// The trace whose contact rows are `factors` times the rows of this one; the same on every rank, `[3n, rows]`.
    pub fn times(self, factors: Mat<f64>) -> Self {
        Self { factors: Some(factors), ..self }
    }

    /// Returns whether each contact row has degrees of freedom of its own.
    pub(crate) fn is_sparse(&self) -> bool {
        self.factors.is_none()
    }

    /// Number of contact rows, 3n.
    pub fn rows(&self) -> usize {
        self.factors.as_ref().map_or(self.rows, Mat::nrows)
    }

    /// This rank's part of P: (row, local degree of freedom, coefficient), by rows, of a trace that is sparse.
    pub fn own(&self) -> &[(usize, usize, f64)] {
        &self.own
    }

    /// The degrees of freedom that P takes, each once, in the order of the rows; the same on every rank.
    pub fn dofs(&self) -> Vec<u64> {
        let mut seen = std::collections::HashSet::new();
        self.terms.iter().map(|t| t.1).filter(|d| seen.insert(*d)).collect()
    }

    /// P, whole, of `order` degrees of freedom, `[3n, order]`.
    pub fn dense(&self, order: usize) -> Mat<f64> {
        let mut p = Mat::zeros(self.rows, order);
        self.terms.iter().for_each(|&(row, dof, f)| p[(row, dof as usize)] += f);
        self.combined(p)
    }

    /// P B Pᵀ with B given at the degrees of freedom [`Trace::dofs`]; `[3n, 3n]`.
    pub fn enclose(&self, block: MatRef<'_, f64>) -> Mat<f64> {
        let place: std::collections::HashMap<u64, usize> = self.dofs().into_iter().zip(0..).collect();
        let mut of_row = vec![Vec::new(); self.rows];
        self.terms.iter().for_each(|&(row, dof, f)| of_row[row].push((place[&dof], f)));
        if let (true, Some(nodes)) = (self.is_sparse(), single(&of_row)) {
            return Mat::from_fn(self.rows, self.rows, |i, j| {
                let ((a, f), (b, g)) = (nodes[i], nodes[j]);
                f * g * block[(a, b)]
            });
        }
        let half =
            Mat::from_fn(self.rows, block.ncols(), |i, b| of_row[i].iter().map(|&(a, f)| f * block[(a, b)]).sum());
        let half = self.combined(half);
        let whole = Mat::from_fn(self.rows, half.nrows(), |j, i| {
            of_row[j].iter().map(|&(b, g): &(usize, f64)| g * half[(i, b)]).sum::<f64>()
        });
        self.combined(whole)
    }

    /// The contact rows from those of the terms, column by column.
    fn combined(&self, rows: Mat<f64>) -> Mat<f64> {
        match &self.factors {
            Some(factors) => factors * rows,
            None => rows,
        }
    }

    /// Collective: P u of `count` vectors of this rank's degrees of freedom, `vector(k)`, `[3n, count]` on rank 0,
    /// `None` elsewhere.
    pub fn gather<'v>(&self, world: &World, count: usize, vector: impl Fn(usize) -> &'v [f64]) -> Option<Mat<f64>> {
        let mut values = Vec::with_capacity(count * self.own.len());
        for k in 0..count {
            let u = vector(k);
            values.extend(self.own.iter().map(|&(_, dof, f)| f * u[dof]));
        }
        let all = world.gather(&values);
        let mut rows = world.is_root().then(|| Mat::<f64>::zeros(self.rows, count))?;
        let mut rest = &all[..];
        for arriving in &self.arriving {
            let (mine, others) = rest.split_at(count * arriving.len());
            for (k, column) in mine.chunks_exact(arriving.len().max(1)).enumerate() {
                arriving.iter().zip(column).for_each(|(&row, v)| rows[(row, k)] += v);
            }
            rest = others;
        }
        Some(self.combined(rows))
    }

    /// Collective: P u of a vector of this rank's degrees of freedom, `[3n]` on rank 0, empty elsewhere.
    pub fn project(&self, world: &World, u: &[f64]) -> Vec<f64> {
        self.gather(world, 1, |_| u).map_or(Vec::new(), |rows| rows.col(0).iter().copied().collect())
    }

    /// Collective: P u on every rank, of real or complex vectors.
    pub fn everywhere<T>(&self, world: &World, u: &[T]) -> Vec<T>
    where
        T: Equivalence + Copy + Default + std::ops::AddAssign,
        f64: std::ops::Mul<T, Output = T>,
    {
        let mut rows = vec![T::default(); self.rows];
        self.own.iter().for_each(|&(row, dof, f)| rows[row] += f * u[dof]);
        let rows = world.sum_all(&rows);
        let Some(factors) = &self.factors else { return rows };
        let row = |i: usize| {
            let mut sum = T::default();
            rows.iter().enumerate().for_each(|(k, r)| sum += factors[(i, k)] * *r);
            sum
        };
        (0..factors.nrows()).map(row).collect()
    }

    /// Collective: Pᵀ f of forces on the contact rows, N, `[3n]` on rank 0, added to this rank's degrees of freedom
    /// `load`.
    pub fn spread(&self, world: &World, forces: &[f64], load: &mut [f64]) {
        let forces = world.broadcast(forces.to_vec());
        let forces = match &self.factors {
            Some(factors) if !forces.is_empty() => {
                (factors.transpose() * faer::ColRef::from_slice(&forces)).iter().copied().collect()
            }
            _ => forces,
        };
        // Nothing is given for no forces at all.
        for &(row, dof, f) in self.own.iter().filter(|_| !forces.is_empty()) {
            load[dof] += f * forces[row];
        }
    }
}

/// The one term of each row, where all rows have one alone.
fn single(of_row: &[Vec<(usize, f64)>]) -> Option<Vec<(usize, f64)>> {
    of_row.iter().map(|row| if let [one] = row[..] { Some(one) } else { None }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn traction_turns_round_on_the_upper_side_and_pressure_does_not() {
        assert_eq!(Side::Lower.orient(&[1.0, 2.0, 3.0, 4.0]), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(Side::Upper.orient(&[1.0, 2.0, 3.0, 4.0]), [-1.0, -2.0, 3.0, -4.0]);
        assert_eq!(Side::named("upper").unwrap(), Side::Upper);
        assert!(Side::named("left").is_err());
    }
}
