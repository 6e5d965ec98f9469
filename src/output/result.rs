//! The main file of a run.

use super::atomic_file::{check_target, clear, Partial, UnfinishedFiles};
use super::claim::Claim;
use super::fields::{BodyPart, PointField};
use super::overwrite_policy::replaceable;
use super::paraview_alias::show;
use super::patch::GridPatch;
use super::segments::{append_to, Segments};
use super::sequence::SequenceFile;
use super::table::Table;
use super::vtkhdf::{skeleton, strong, write_slabs, GridPiece};
use crate::parallel::World;
use crate::progress::Progress;
use crate::{Error, Result};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Companion files beside a main file: real modes of the bodies, complex modes of the coupled system, a transient.
const COMPANIONS: [&str; 4] = ["free_modes.vtkhdf", "modes.vtkhdf", "transient.vtkhdf", "cycles.vtkhdf"];

/// The reduced model of a run that is not complete, or the modes in it.
pub const MODEL: &str = "model.h5";

/// The mode shapes of a run that is not complete, in double precision.
pub const SHAPES: &str = "model.shapes.h5";

/// One HDF5 file being made. Nothing appears under its name before [`ResultFile::finish`], and nothing at all if the
/// run fails before.
pub struct ResultFile<'w> {
    world: &'w World,
    target: PathBuf,
    /// On rank 0.
    claim: Option<Claim>,
    /// On rank 0: unfinished files of earlier runs.
    left: UnfinishedFiles,
    partial: Option<Partial>,
    /// True if it has fields.
    fields: bool,
    tables: Vec<Table>,
    attached: Vec<Partial>,
    segments: Option<(Segments, Vec<String>)>,
    /// File in which this run keeps the reduced model until the file is complete.
    kept: Option<PathBuf>,
    /// True if the compliance is among it.
    all: bool,
    /// Temporary files, removed when the file is complete.
    leftovers: Vec<PathBuf>,
    /// Folders that go once the file is complete.
    discarded: Vec<PathBuf>,
}

impl<'w> ResultFile<'w> {
    /// Collective: checks that `path` can be written (`Error::Io` if not; `Error::Job` if it exists and `overwrite` is
    /// false). Call it before the long work.
    pub fn create(world: &'w World, path: &Path, overwrite: bool) -> Result<Self> {
        check_target(world, path, overwrite)?;
        let claim = world.on_root(|| Claim::new(path))?;
        // What another run wrote while this one waited for its claim.
        world.on_root(|| replaceable(path, overwrite))?;
        world.on_root(|| COMPANIONS.iter().try_for_each(|c| replaceable(&companion(path, c), overwrite)))?;
        let mut left = UnfinishedFiles::default();
        if let Some(claim) = &claim {
            outputs(path).0.iter().for_each(|target| clear(target, claim.locked, &mut left));
        }
        Ok(Self {
            world,
            target: path.to_owned(),
            claim,
            left,
            partial: None,
            fields: false,
            tables: Vec::new(),
            attached: Vec::new(),
            segments: None,
            kept: None,
            all: false,
            leftovers: Vec::new(),
            discarded: Vec::new(),
        })
    }

    /// On rank 0: unfinished files of earlier runs to the same output.
    pub fn left(&self) -> &UnfinishedFiles {
        &self.left
    }

    /// Collective: writes the static fields, once: both bodies, the fields at their points, the body and the rank of
    /// each cell. Fields are named once each.
    pub fn fields(&mut self, bodies: &[BodyPart], fields: &[PointField]) -> Result<()> {
        self.fields_and_grid(bodies, fields, &[])
    }

    /// Collective: as [`ResultFile::fields`], with cells of the contact grid on the bodies as a piece of their own:
    /// rank 0's count.
    pub(crate) fn fields_and_grid(
        &mut self,
        bodies: &[BodyPart],
        fields: &[PointField],
        patches: &[GridPatch],
    ) -> Result<()> {
        let world = self.world;
        if self.partial.is_some() {
            return Err(Error::Defect("the fields of a result file are written once".into()));
        }
        let piece = GridPiece::new(world, bodies).patched(world, patches);
        let (mut slots, mut slabs) = piece.geometry();
        slots.extend(fields.iter().map(|f| piece.slot(&f.spec, 1, false)));
        let mine: Result<Vec<_>> = fields.iter().map(|f| piece.slab(f, 0, false)).collect();
        slabs.extend(world.agree(mine)?);
        let on_grid: Result<Vec<_>> = fields.iter().map(|f| piece.patch_slab(&f.spec, patches)).collect();
        slabs.extend(world.agree(on_grid)?.into_iter().flatten());
        let partial = Partial::new(world, &self.target)?;
        world.on_root(|| skeleton(&partial, Some([1, 0]), &slots, &piece.sizes(), None))?;
        write_slabs(world, &partial, &slabs)?;
        self.partial = Some(partial);
        self.fields = true;
        Ok(())
    }

    /// Adds a table. Only rank 0's counts; others may pass what they like or not call. Faults show in `finish`.
    pub fn table(&mut self, table: Table) {
        if self.world.is_root() {
            self.tables.push(table);
        }
    }

    /// Adds several.
    pub fn tables(&mut self, tables: impl IntoIterator<Item = Table>) {
        tables.into_iter().for_each(|t| self.table(t));
    }

    /// On rank 0: the tables that were added so far.
    pub(crate) fn tables_so_far(&self) -> &[Table] {
        &self.tables
    }

    /// Collective: leaves a complete sequence to this file: it gets its name when this one does.
    pub fn attach(&mut self, sequence: SequenceFile) -> Result<()> {
        self.attached.push(sequence.close()?);
        Ok(())
    }

    /// Collective: the tables of rank 0, computed so far, are kept in a file of their own beside this one until it is
    /// complete: `FILE.model.h5`, which stays where the run fails later. That of an earlier run, or of this one,
    /// makes room. `all` if the compliance is among them.
    pub fn keep(&mut self, tables: &[Table], all: bool) -> Result<()> {
        let target = companion(&self.target, MODEL);
        self.world.on_root(|| {
            replaceable(&target, true)?;
            let mut partial = Partial::alone(&target);
            skeleton(&partial, None, &[], tables, None)?;
            partial.publish()
        })?;
        self.leave(target.clone());
        (self.kept, self.all) = (Some(target), all);
        Ok(())
    }

    /// Returns whether the compliance was among the tables of the last [`ResultFile::keep`].
    pub(crate) fn keeps_all(&self) -> bool {
        self.all
    }

    /// File in which the mode shapes are kept until the file is complete: `FILE.model.shapes.h5`.
    pub fn shapes(&self) -> PathBuf {
        companion(&self.target, SHAPES)
    }

    /// Collective: the mode shapes of this run, made as [`ResultFile::shapes`], are kept; without any, those of an
    /// earlier run go.
    pub(crate) fn keep_shapes(&mut self, shapes: Option<SequenceFile>) -> Result<()> {
        let path = self.shapes();
        match shapes {
            Some(made) => made.finish()?,
            None => drop(self.world.on_root(|| match std::fs::remove_file(&path) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(super::atomic_file::failure(&path, &e)),
                _ => Ok(()),
            })?),
        }
        self.leave(path);
        Ok(())
    }

    /// This file goes when the main one is complete.
    pub fn leave(&mut self, path: PathBuf) {
        self.leftovers.push(path);
    }

    /// The file of [`ResultFile::keep`].
    pub(crate) fn kept_file(&self) -> Option<&Path> {
        self.kept.as_deref()
    }

    /// The folder `path` goes once the file is complete: what it keeps is then in the file.
    pub(crate) fn discard(&mut self, path: &Path) {
        self.discarded.push(path.to_owned());
    }

    /// The datasets of `group` in these segments become part of the file, which then takes their place.
    pub(crate) fn append(&mut self, segments: Segments, group: &str) {
        self.segments.get_or_insert_with(|| (segments, Vec::new())).1.push(group.to_owned());
    }

    /// Collective: the file that is being made, begun if it was not.
    fn begun(&mut self) -> Result<Partial> {
        if let Some(partial) = self.partial.take() {
            return Ok(partial);
        }
        let partial = Partial::new(self.world, &self.target)?;
        self.world.on_root(|| skeleton(&partial, None, &[], &[], None))?;
        Ok(partial)
    }

    /// Collective: puts the segments of `append` together, if there are any.
    pub fn merge(&mut self, progress: &mut Progress) -> Result<()> {
        let world = self.world;
        if world.max(f64::from(u8::from(self.segments.is_some()))) == 0.0 {
            return Ok(());
        }
        progress.stage("putting the segments together");
        let partial = self.begun()?;
        let segments = &self.segments;
        world.on_root(|| {
            let Some((segments, groups)) = segments else { return Ok(()) };
            let have = std::fs::metadata(&partial.path).map(|m| m.len()).unwrap_or(0);
            partial.reserve(have + 2 * segments.bytes() + 65536)?;
            groups.iter().try_for_each(|group| append_to(&partial.path, segments, group, progress))
        })?;
        self.partial = Some(partial);
        Ok(())
    }

    /// Collective: writes the tables and, after all others, those that `last` gives on rank 0; then the file, and
    /// those attached, get their names, and a file with fields the link `FILE.hdf`.
    pub fn finish(mut self, last: impl FnOnce() -> Vec<Table>) -> Result<()> {
        let world = self.world;
        let mut partial = self.begun()?;
        let tables = &self.tables;
        let (attached, fields) = (&mut self.attached, self.fields);
        let (segments, leftovers, discarded) = (&self.segments, &self.leftovers, &self.discarded);
        let claim = &self.claim;
        world.on_root(|| {
            let mut seen = BTreeSet::new();
            add(&partial, tables, &mut seen)?;
            add(&partial, &last(), &mut seen)?;
            if !claim.as_ref().is_none_or(|claim| claim.holds(&partial.target)) {
                return Err(partial.aside());
            }
            attached.iter_mut().try_for_each(Partial::publish)?;
            partial.publish()?;
            let _ = show(&partial.target, fields);
            if let Some((segments, _)) = segments {
                segments.remove();
            }
            for path in leftovers {
                let _ = std::fs::remove_file(path);
            }
            for folder in discarded {
                let _ = std::fs::remove_dir_all(folder);
            }
            // Those of an earlier run do not belong to this file.
            let new = |path: &PathBuf| attached.iter().any(|a| &a.target == path);
            for old in COMPANIONS.map(|c| companion(&partial.target, c)).iter().filter(|c| !new(c)) {
                let _ = std::fs::remove_file(old);
            }
            Ok(())
        })?;
        Ok(())
    }
}

/// On rank 0: writes tables into the file that is being made, none of them among those `seen` before.
fn add(partial: &Partial, tables: &[Table], seen: &mut BTreeSet<String>) -> Result<()> {
    for table in tables {
        if let Some(fault) = table.fault() {
            return Err(Error::Defect(fault));
        }
        if !seen.insert(table.path.clone()) {
            return Err(Error::Defect(format!("table {} is written twice", table.path)));
        }
    }
    let have = std::fs::metadata(&partial.path).map(|m| m.len()).unwrap_or(0);
    partial.reserve(have + tables.iter().map(Table::bytes).sum::<u64>() + 65536)?;
    let write = || -> hdf5::Result<()> {
        let file = hdf5::File::with_options().with_fapl(strong).open_rw(&partial.path)?;
        tables.iter().try_for_each(|table| table.write(&file))?;
        file.close()
    };
    write().map_err(|e| partial.hdf5_error("writing tables", &e))
}

/// The files that a run with the main file `path` may write, and the folder of its segments.
pub fn outputs(path: &Path) -> (Vec<PathBuf>, PathBuf) {
    let beside = COMPANIONS.iter().chain([&MODEL, &SHAPES]).map(|c| companion(path, c));
    (std::iter::once(path.to_owned()).chain(beside).collect(), companion(path, "transient"))
}

/// Path of a file that goes with the main one: `companion("a/run.h5", "modes.vtkhdf")` is `a/run.modes.vtkhdf`.
pub fn companion(path: &Path, suffix: &str) -> PathBuf {
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(format!("{stem}.{suffix}"))
}
