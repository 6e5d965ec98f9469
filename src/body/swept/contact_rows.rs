//! Contact rows of a body of revolution: on grids, or at cells of its faces.

use super::cells::CellCompliance;
use crate::body::hybrid::{Compact, ContactFunctions, Hybrid};
use crate::parallel::World;
use crate::swept::{Forms, LoadPatch, Path, SectionContact};
use crate::{Error, Result};
use faer::Mat;

/// Contact rows of a body of revolution.
#[derive(Debug, Clone)]
pub(super) enum RevolvedRows {
    /// On the grid of each contact.
    Grids(Hybrid),
    /// The three of each cell.
    Cells(CellCompliance),
}

impl RevolvedRows {
    /// As [`Hybrid::place`]; cells act on each other through the section alone.
    pub(super) fn place(&mut self, contacts: &[SectionContact], tilts: &[f64]) -> Result<()> {
        match self {
            Self::Grids(hybrid) => hybrid.place(Path::Axle, contacts, tilts),
            Self::Cells(_) => Ok(()),
        }
    }

    /// The patches of the loads, one of each contact.
    pub(super) fn patches(&self) -> Vec<LoadPatch> {
        match self {
            Self::Grids(hybrid) => hybrid.patches(),
            Self::Cells(cells) => cells.patches().to_vec(),
        }
    }

    /// Number of contact rows.
    pub(super) fn rows(&self) -> usize {
        match self {
            Self::Grids(hybrid) => hybrid.rows(),
            Self::Cells(cells) => cells.rows(),
        }
    }

    /// Collective: as [`Hybrid::make`].
    pub(super) fn make(
        &mut self,
        world: &World,
        forms: &Forms,
        contacts: &[SectionContact],
        tilts: &[f64],
    ) -> Result<Option<String>> {
        match self {
            Self::Grids(hybrid) => hybrid.make(world, forms, contacts, tilts),
            Self::Cells(cells) => cells.make(world, forms, contacts),
        }
    }

    /// Collective: static compliance of the contact rows of the body `name`, m/N, `[3n, 3n]` on rank 0.
    pub(super) fn compliance(&self, world: &World, name: &str) -> Result<Option<Mat<f64>>> {
        match self {
            Self::Grids(hybrid) => hybrid.compliance(world, name),
            Self::Cells(cells) => world.on_root(|| cells.compliance(name)),
        }
    }

    /// As [`Hybrid::compact`]; none of cells.
    pub(super) fn compact(&self, name: &str) -> Result<Option<Compact>> {
        match self {
            Self::Grids(hybrid) => hybrid.compact(name).map(Some),
            Self::Cells(_) => Ok(None),
        }
    }

    /// As [`Hybrid::functions`]; none of cells.
    pub(super) fn functions(&self, name: &str) -> Result<Option<ContactFunctions>> {
        match self {
            Self::Grids(hybrid) => hybrid.functions(name).map(Some),
            Self::Cells(_) => Ok(None),
        }
    }

    /// As [`Hybrid::adopt`].
    pub(super) fn adopt(&mut self, constant: Mat<f64>) {
        if let Self::Grids(hybrid) = self {
            hybrid.adopt(constant);
        }
    }

    /// As [`Hybrid::add`].
    pub(super) fn add(&mut self, beside: Mat<f64>) {
        match self {
            Self::Grids(hybrid) => hybrid.add(beside),
            Self::Cells(cells) => cells.add(&beside),
        }
    }

    /// As [`Hybrid::of_modes`].
    pub(super) fn of_modes(&mut self, omega: &[f64], seen: &Mat<f64>) -> Mat<f64> {
        match self {
            Self::Grids(hybrid) => hybrid.of_modes(omega, seen),
            Self::Cells(cells) => cells.of_modes(omega, seen),
        }
    }

    /// Collective: static displacement of the contact rows of the body `name`, m, `[3n]` on rank 0, under forces on
    /// them, N.
    pub(super) fn response(&self, world: &World, name: &str, forces: &[f64]) -> Result<Vec<f64>> {
        match self {
            Self::Grids(hybrid) => hybrid.response(world, name, forces),
            Self::Cells(cells) => {
                let moved = world.on_root(|| {
                    let moved = cells.compliance(name)? * faer::ColRef::from_slice(forces);
                    Ok::<Vec<f64>, Error>(moved.iter().copied().collect())
                })?;
                Ok(moved.unwrap_or_default())
            }
        }
    }
}
