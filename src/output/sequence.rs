//! Sequences of fields on a geometry that stays: modes one after the other, a complex mode over its period, a
//! transient.

use super::atomic_file::{check_target, Partial};
use super::checksums::RowSums;
use super::fields::{BodyPart, FieldSpec, PointField};
use super::table::Table;
use super::vtkhdf::{skeleton, strong, DatasetSlot, GridPiece, OpenSlabs, Slab};
use crate::parallel::World;
use crate::{Error, Result};
use std::path::Path;

/// A VTKHDF file with `Steps`. All steps are known beforehand: their disk space is reserved when the file is made, and
/// writing one is writing rows and nothing else. Fields for looking at are stored in single precision.
pub struct SequenceFile<'w> {
    world: &'w World,
    // Before the partial file, which is removed when it is dropped.
    open: OpenSlabs,
    partial: Partial,
    piece: GridPiece,
    specs: Vec<FieldSpec>,
    single: bool,
    steps: usize,
    /// Sums of the rows of this rank, where they are wanted.
    written: Option<RowSums>,
}

/// Contents of a sequence.
pub struct Sequence<'a> {
    /// The fields that every step has.
    pub fields: Vec<FieldSpec>,
    /// The value of each step (what ParaView calls time), ascending.
    pub values: &'a [f64],
    /// Unit of the values.
    pub units: &'a str,
    /// Description of the values.
    pub description: &'a str,
    /// Further datasets, from rank 0.
    pub tables: &'a [Table],
    /// True if the SHA-256 of what each rank writes goes into the file, for what later runs take up.
    pub summed: bool,
    /// True if fields are in single precision.
    pub single: bool,
}

impl<'w> SequenceFile<'w> {
    /// Collective: makes the file with the geometry of the `bodies`.
    pub fn create(
        world: &'w World,
        path: &Path,
        overwrite: bool,
        bodies: &[BodyPart],
        sequence: Sequence<'_>,
    ) -> Result<Self> {
        let Sequence { fields: specs, values, units, description, tables, summed, single } = sequence;
        check_target(world, path, overwrite)?;
        let piece = GridPiece::new(world, bodies);
        let steps = values.len();
        let (mut slots, slabs) = piece.geometry();
        slots.extend(specs.iter().map(|s| piece.slot(s, steps, single)));
        let partial = Partial::new(world, path)?;
        world.on_root(|| {
            if values.windows(2).any(|w| w[1] <= w[0]) {
                return Err(Error::Defect(format!("the steps of {} are not ascending", path.display())));
            }
            let mut all = piece.sizes();
            all.extend(steps_tables(&piece, &specs, values, units, description));
            all.extend_from_slice(tables);
            if let Some(fault) = all.iter().find_map(Table::fault) {
                return Err(Error::Defect(fault));
            }
            skeleton(&partial, Some([2, 0]), &slots, &all, Some(steps as i64))
        })?;
        let open = OpenSlabs::open(world, &partial)?;
        let written = summed.then(RowSums::default);
        let mut file = Self { world, open, partial, piece, specs, single, steps, written };
        file.put(&slabs, &slots)?;
        Ok(file)
    }

    /// Collective: writes the fields of a step, in the order of the specs: `fields[f][b]` are the values of field f
    /// at the local nodes of body b, as in [`PointField::values`].
    pub fn step(&mut self, step: usize, fields: &[Vec<&[f64]>]) -> Result<()> {
        let slabs = if step >= self.steps || fields.len() != self.specs.len() {
            let (have, want) = (fields.len(), self.specs.len());
            Err(Error::Defect(format!("step {step} of {} with {have} of {want} fields", self.steps)))
        } else {
            let fields = self.specs.iter().zip(fields).map(|(s, v)| PointField::new(s.clone(), v.clone()));
            fields.map(|f| self.piece.slab(&f, step, self.single)).collect()
        };
        let slabs: Vec<Slab> = self.world.agree(slabs)?;
        let slots: Vec<DatasetSlot> = self.specs.iter().map(|s| self.piece.slot(s, self.steps, self.single)).collect();
        self.put(&slabs, &slots)
    }

    /// Collective: writes rows of this rank.
    fn put(&mut self, slabs: &[Slab], slots: &[DatasetSlot]) -> Result<()> {
        if let Some(written) = &mut self.written {
            for slab in slabs {
                let shape = slots.iter().find(|s| s.path == slab.path).map(|s| &s.shape[1..]);
                written.add(slab, shape.map_or(1, |s| s.iter().product()));
            }
        }
        self.open.write(self.world, &self.partial, slabs)
    }

    /// Collective: gives the file its name. A file that goes with a main one is given to
    /// [`super::ResultFile::attach`] instead, so that both appear or none.
    pub fn finish(self) -> Result<()> {
        let world = self.world;
        let mut partial = self.close()?;
        world.on_root(|| partial.publish()).map(|_| ())
    }

    /// Collective: the complete file, still under its temporary name.
    pub(super) fn close(self) -> Result<Partial> {
        self.open.close(self.world, &self.partial)?;
        let sums = self.written.map(|w| w.tables(self.world)).unwrap_or_default();
        self.world.on_root(|| add(&self.partial, &sums))?;
        Ok(self.partial)
    }
}

/// On rank 0: adds tables to a complete file.
fn add(partial: &Partial, tables: &[Table]) -> Result<()> {
    if tables.is_empty() {
        return Ok(());
    }
    let have = std::fs::metadata(&partial.path).map_or(0, |m| m.len());
    partial.reserve(have + tables.iter().map(Table::bytes).sum::<u64>() + 65536)?;
    let write = || -> hdf5::Result<()> {
        let file = hdf5::File::with_options().with_fapl(strong).open_rw(&partial.path)?;
        tables.iter().try_for_each(|table| table.write(&file))?;
        file.close()
    };
    write().map_err(|e| partial.hdf5_error("writing tables", &e))
}

/// The group `/VTKHDF/Steps`: the geometry of all steps is the first one, point data follow one another.
fn steps_tables(piece: &GridPiece, specs: &[FieldSpec], values: &[f64], units: &str, description: &str) -> Vec<Table> {
    let n = values.len();
    let pieces = piece.pieces() as i64;
    let path = |name: &str| format!("/VTKHDF/Steps/{name}");
    let zero = vec![0i64; n];
    let mut all = vec![
        Table::list(&path("Values"), units, description, values),
        Table::list(&path("PartOffsets"), "1", "First piece of each step.", zero.clone()),
        Table::list(&path("NumberOfParts"), "1", "Pieces of each step.", vec![pieces; n]),
        Table::list(&path("PointOffsets"), "1", "First point of each step.", zero.clone()),
        Table::new(&path("CellOffsets"), "1", "First cell of each step.", &[n, 1], zero.clone()),
        Table::new(&path("ConnectivityIdOffsets"), "1", "First entry of Connectivity.", &[n, 1], zero.clone()),
    ];
    let fixed = "First value of each step; the same for all.";
    all.push(Table::list(&path("PointDataOffsets/body"), "1", fixed, zero.clone()));
    all.push(Table::list(&path("CellDataOffsets/body"), "1", fixed, zero.clone()));
    all.push(Table::list(&path("CellDataOffsets/rank"), "1", fixed, zero));
    for spec in specs {
        let starts: Vec<i64> = (0..n).map(|k| (k * piece.total_points()) as i64).collect();
        let text = "First value of each step.";
        all.push(Table::list(&path(&format!("PointDataOffsets/{}", spec.name)), "1", text, starts));
    }
    all
}
