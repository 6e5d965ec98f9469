//! The datasets of the result file: names, units, shapes and descriptions, one file a group
//! (`docs/reference/output.md`).

pub(crate) mod branches;
pub(crate) mod checkpoint;
pub mod contact;
pub(crate) mod contacts;
pub(crate) mod creep_curve;
pub mod curving;
pub(crate) mod cycle_motions;
pub(crate) mod cycles;
pub(crate) mod nodal_periods;
pub mod placement;
pub(crate) mod points;
pub(crate) mod receptance;
pub(crate) mod record;
pub mod reduced;
pub mod stability;
pub(crate) mod sweep;
pub(crate) mod track_decay;
pub(crate) mod uncertainty;
