//! Files of a run: one HDF5 file with fields for ParaView, tables and provenance, and sequences beside it.
//!
//! A file is made in three steps, so that a failure is one error on all ranks and leaves nothing behind:
//! 1. rank 0 makes a temporary file beside the final name, with every group and every dataset of the fields, allocated
//!    but empty, and reserves the disk space of the fields;
//! 2. all ranks open it through MPI-IO and write their own rows; no metadata changes here, so nothing but data can
//!    fail;
//! 3. rank 0 adds the tables (compressed where that pays), syncs, and renames the file to its final name.
//!
//! `docs/reference/output.md` lists what is in the file.

mod atomic_file;
mod checksums;
mod claim;
pub(crate) mod datasets;
mod dimensions;
mod fields;
mod modes;
mod overwrite_policy;
mod paraview_alias;
mod patch;
mod provenance;
mod read;
mod result;
mod segments;
mod sequence;
pub mod surface;
mod table;
mod values;
pub(crate) mod verdict;
mod vtkhdf;

pub use atomic_file::UnfinishedFiles;
pub use fields::{contact_fields, BodyPart, FieldKind, FieldSpec, PointField};
pub use modes::write_modes;
pub use patch::{averaged, GridPatch};
pub use provenance::{sha256, utc_now, Provenance};
pub use read::{survey, Reader};
pub use result::{companion, outputs, ResultFile, MODEL, SHAPES};
pub use segments::{job_of_run, Entry, RunOrigin, Segments};
pub use sequence::{Sequence, SequenceFile};
pub use table::Table;
pub use values::Values;
