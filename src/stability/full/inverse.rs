//! The inverse of the dynamic stiffness of one body at a shift, with its responses to forces on the contact rows and
//! on the modes that are damped.

use super::columns::{Columns, Reals};
use crate::petsc::complex::ComplexFactor;
use crate::petsc::mumps::Factor;
use crate::Result;
use num_complex::Complex;

type C = Complex<f64>;

/// Inverse of λ²M + λ(αM + βK) + K.
pub(super) enum Inverse<'a> {
    /// Inverse of K − sM with real s, and the factor 1/(1 + λβ) that belongs to it.
    Real(Factor<'a>, C),
    /// Inverse of the matrix itself.
    Complex(ComplexFactor<'a>),
}

/// A body, or two mirror images, at a shift.
pub(super) struct ShiftedBody<'a> {
    /// The inverse.
    pub inverse: Inverse<'a>,
    /// The inverse times [Bᵀ, MΦ] (without the factor of a real one): local rows of `[3m + modes]` columns, m/N;
    /// imaginary parts, empty if there are none. MΦ only where modes are damped.
    pub columns: [Columns; 2],
    /// The parts that it stands for.
    pub parts: Vec<usize>,
}

impl<'a> ShiftedBody<'a> {
    /// Collective: the body of `parts` with the responses to `count` real `loads`, local rows column by column.
    pub fn new(mut inverse: Inverse<'a>, mut loads: Vec<f64>, count: usize, parts: Vec<usize>) -> Result<Self> {
        let columns = match &mut inverse {
            Inverse::Real(factor, _) => {
                factor.solve(&mut loads, count)?;
                [loads, Vec::new()]
            }
            Inverse::Complex(factor) => {
                let mut columns: Vec<C> = loads.iter().map(|&v| C::from(v)).collect();
                factor.solve(&mut columns, count)?;
                [columns.iter().map(|v| v.re).collect(), columns.iter().map(|v| v.im).collect()]
            }
        };
        let rows = columns[0].len() / count.max(1);
        Ok(Self { inverse, columns: columns.map(|values| Columns { rows, values }), parts })
    }

    fn scale(&self) -> C {
        match &self.inverse {
            Inverse::Real(_, scale) => *scale,
            Inverse::Complex(_) => C::from(1.0),
        }
    }

    /// The response at place `at` of the columns, m/N.
    pub fn response(&self, at: usize) -> C {
        self.scale() * C::new(self.columns[0].values[at], self.columns[1].values.get(at).copied().unwrap_or(0.0))
    }

    /// Collective: solves for columns of local rows in place.
    pub fn solve(&mut self, columns: &mut [C], count: usize) -> Result<()> {
        match &mut self.inverse {
            Inverse::Real(factor, scale) => {
                // Real and imaginary parts are columns of one real solve.
                let mut both: Vec<f64> = columns.iter().map(|v| v.re).chain(columns.iter().map(|v| v.im)).collect();
                factor.solve(&mut both, 2 * count)?;
                let (re, im) = both.split_at(columns.len());
                for ((v, re), im) in columns.iter_mut().zip(re).zip(im) {
                    *v = *scale * C::new(*re, *im);
                }
                Ok(())
            }
            Inverse::Complex(factor) => factor.solve(columns, count),
        }
    }

    /// The columns times `factors` (of the contact rows in lower form, then of the damped modes), of each motion, are
    /// added to `u`.
    pub fn add_response(&self, factors: &[Vec<C>], u: &mut Reals) {
        let scaled = |unit: C| -> Vec<Vec<C>> {
            let factor = self.scale() * unit;
            factors.iter().map(|f| f.iter().map(|f| factor * f).collect()).collect()
        };
        for (columns, unit) in self.columns.iter().zip([C::from(1.0), C::i()]) {
            if !columns.values.is_empty() {
                columns.add(&scaled(unit), u);
            }
        }
    }
}
