//! Compliance of a body of revolution at cells of its faces, each under an even load.
//!
//! A cell is a rectangle that a pad presses. Its three contact rows are the means of the displacement over it, its
//! forces even loads, 1/(4ab) N/m² along x, y and n. With A of [`Constant`], from which the half-space is taken off
//! within a cell, and B_hs of that half-space under the same load, both between the constant loads alone,
//!
//! C_cc = A_cc + B_hs,   C_cd = A_cd   (c ≠ d).

use crate::body::half_space::HalfSpace;
use crate::body::hybrid::{in_grids, statics};
use crate::parallel::World;
use crate::swept::{Constant, Forms, LoadPatch, SectionContact, LOADS};
use crate::{Error, Result};
use faer::Mat;

/// Rows of a cell.
const ROWS: usize = 3;
/// Part of the largest eigenvalue of the compliance by which what the modes leave of it may be negative.
const NEGATIVE: f64 = 1e-9;

/// The cells of a body, on every rank.
#[derive(Debug, Clone)]
pub struct CellCompliance {
    half_space: HalfSpace,
    patches: Vec<LoadPatch>,
    /// Compliance, m/N, `[3T, 3T]`; none before it is made.
    compliance: Option<Mat<f64>>,
    /// Addition to that from elsewhere, m/N, `[3T, 3T]`.
    beside: Mat<f64>,
    /// Part of the modes, m/N, `[3T, 3T]`.
    modal: Mat<f64>,
}

/// The constant motions of the rows or columns of nine each, `[9T, m]` to `[3T, m]`.
fn constant_rows(all: &Mat<f64>) -> Mat<f64> {
    let row = |i: usize| i / ROWS * LOADS + i % ROWS;
    Mat::from_fn(all.nrows() / LOADS * ROWS, all.ncols(), |i, j| all[(row(i), j)])
}

/// The same of rows and columns, `[9T, 9T]` to `[3T, 3T]`.
fn constant_part(all: &Mat<f64>) -> Mat<f64> {
    let rows = constant_rows(all).transpose().to_owned();
    constant_rows(&rows).transpose().to_owned()
}

impl CellCompliance {
    /// Cells of the half sides `half` along x and y, m, of a body of the material of `half_space`.
    pub fn new(half_space: HalfSpace, half: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let patches: Vec<LoadPatch> = half.into_iter().map(|half| LoadPatch::Rectangle { half, middle: 0.0 }).collect();
        let order = ROWS * patches.len();
        let none = || Mat::zeros(order, order);
        Self { half_space, patches, compliance: None, beside: none(), modal: none() }
    }

    /// The patches of the loads.
    pub fn patches(&self) -> &[LoadPatch] {
        &self.patches
    }

    /// Number of contact rows, 3T.
    pub fn rows(&self) -> usize {
        ROWS * self.patches.len()
    }

    /// Collective: makes the compliance from the `forms` of a section that is meshed for loads on its `contacts`.
    /// Returns a line for the summary.
    pub fn make(&mut self, world: &World, forms: &Forms, contacts: &[SectionContact]) -> Result<Option<String>> {
        let constant = Constant::of_contacts(forms, std::slice::from_ref(&self.patches), contacts)?;
        let last = constant.blocks.iter().map(|b| b.0 + b.1 / 2).max().unwrap_or(0);
        let count = constant.blocks.len();
        let made = in_grids(world, &constant, &vec![0.0; contacts.len()])?;
        let all = made.first().ok_or_else(|| Error::Defect("no compliance of cells".into()))?;
        let mut compliance = constant_part(all);
        // Cells of the same sides have the same half-space.
        let mut known: Vec<(LoadPatch, _)> = Vec::new();
        for (c, &patch) in self.patches.iter().enumerate() {
            let place = known.iter().position(|(other, _)| *other == patch).unwrap_or(known.len());
            if place == known.len() {
                known.push((patch, self.half_space.under_loads(patch)));
            }
            let own = &known[place].1;
            for i in 0..ROWS {
                for j in 0..ROWS {
                    compliance[(ROWS * c + i, ROWS * c + j)] += own[i][j];
                }
            }
        }
        let normal = (0..self.patches.len()).map(|c| 1e12 * compliance[(ROWS * c + 2, ROWS * c + 2)]);
        let (low, high) = normal.fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
        self.compliance = Some(compliance);
        Ok(Some(format!(
            "section of {} unknowns solved at {count} of the Fourier orders up to {last}; compliance of {} cells along \
             their normals {low:.1} to {high:.1} pm/N",
            forms.order(),
            self.patches.len()
        )))
    }

    /// The modes with ψ̂ = `seen`, `[9T, m]`, and the angular frequencies `omega`, rad/s, at the contact rows, 1/√kg,
    /// `[3T, m]`. Keeps their share of the compliance.
    pub fn of_modes(&mut self, omega: &[f64], seen: &Mat<f64>) -> Mat<f64> {
        let rows = constant_rows(seen);
        self.modal = statics(omega, rows.as_ref());
        rows
    }

    /// Adds compliance beside what the forms of the section say, m/N and so on, `[9T, 9T]`; the last one given counts.
    pub fn add(&mut self, beside: &Mat<f64>) {
        self.beside = constant_part(beside);
    }

    /// Collective: static compliance of the contact rows of the body `name`, m/N, `[3T, 3T]`, on every rank. What the
    /// modes leave of it has to be positive.
    pub fn compliance(&self, name: &str) -> Result<Mat<f64>> {
        let missing = || Error::Defect(format!("body \"{name}\" has no compliance: it is not factorised"));
        let whole = self.compliance.as_ref().ok_or_else(missing)? + &self.beside;
        let lowest = |of: &Mat<f64>| -> Result<[f64; 2]> {
            let values = of.self_adjoint_eigenvalues(faer::Side::Lower).map_err(|e| {
                Error::NotConverged(format!("compliance of body \"{name}\": eigenvalues failed: {e:?}"))
            })?;
            Ok([values.first().copied().unwrap_or(0.0), values.last().copied().unwrap_or(0.0)])
        };
        let ([left, _], [_, largest]) = (lowest(&(&whole - &self.modal))?, lowest(&whole)?);
        match left < -NEGATIVE * largest {
            false => Ok(whole),
            true => Err(Error::Job(format!(
                "bodies.{name}: its modes yield more at the cells of contacts than the whole body does (by {:.2e} of \
                 the largest compliance); ask for fewer modes in analyses.modes",
                -left / largest
            ))),
        }
    }
}
