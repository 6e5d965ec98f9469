//! The datasets of the result file: names, units, shapes and descriptions, one file a group
//! (`docs/reference/output.md`).

pub mod branches;
pub mod checkpoint;
pub mod contact;
pub mod creep_curve;
pub mod curving;
pub mod cycles;
pub mod placement;
pub mod points;
pub mod receptance;
pub mod record;
pub mod reduced;
pub mod stability;
pub mod sweep;
pub mod track_decay;
pub mod uncertainty;
