//! The group `/VTKHDF`: an UnstructuredGrid with one piece for each rank, as VTK's own reader wants it, and one for a
//! contact grid beside the meshes.
//!
//! Layout after the VTKHDF specification (docs.vtk.org, "VTKHDF format specification"): version 1.0 without steps,
//! 2.0 with them.

use super::atomic_file::Partial;
use super::fields::{BodyPart, FieldKind, FieldSpec, PointField};
use super::patch::{self, GridPatch, PatchGrid};
use super::table::{describe, parent, Table};
use super::values::{Layout, Values};
use crate::parallel::World;
use crate::{Error, Result};
use hdf5::types::FixedAscii;
use mpi::raw::AsRaw;

/// Datasets of the geometry.
const POINTS_PATH: &str = "/VTKHDF/Points";
const CONNECTIVITY: &str = "/VTKHDF/Connectivity";
const OFFSETS: &str = "/VTKHDF/Offsets";
const TYPES: &str = "/VTKHDF/Types";
const BODY_OF_POINT: &str = "/VTKHDF/PointData/body";
const BODY_OF_CELL: &str = "/VTKHDF/CellData/body";
const RANK: &str = "/VTKHDF/CellData/rank";

/// A dataset whose rows the ranks write.
pub(super) struct DatasetSlot {
    pub(super) path: String,
    pub(super) units: String,
    pub(super) description: String,
    pub(super) shape: Vec<usize>,
    /// An empty vector of the type.
    pub(super) like: Values,
}

impl DatasetSlot {
    fn new(path: &str, units: &str, description: &str, shape: &[usize], like: Values) -> Self {
        let (path, units, description) = (path.to_owned(), units.to_owned(), description.to_owned());
        Self { path, units, description, shape: shape.to_vec(), like }
    }
}

/// Rows of one slot that this rank writes.
pub(super) struct Slab {
    pub(super) path: String,
    pub(super) start: usize,
    pub(super) values: Values,
}

/// This rank's piece of the grid: its own cells of all bodies and the points they use, in the frame of the contact.
pub(super) struct GridPiece {
    block: PatchGrid,
    /// For each body, the local nodes that are points of the piece, in order.
    nodes: Vec<Vec<u32>>,
    local_nodes: Vec<usize>,
    upper: Vec<bool>,
    rank: i32,
    /// Points, cells and connectivity entries of each rank's piece, and of that of the contact grid.
    counts: Vec<[i64; 3]>,
    /// The piece of the contact grid, on rank 0.
    patch: Option<PatchGrid>,
}

/// Indices into [`GridPiece::counts`].
const POINTS: usize = 0;
const CELLS: usize = 1;
const ENTRIES: usize = 2;

impl GridPiece {
    /// Collective: makes the pieces of `bodies`.
    pub(super) fn new(world: &World, bodies: &[BodyPart]) -> Self {
        let mut piece = Self {
            block: PatchGrid::new(),
            nodes: Vec::new(),
            local_nodes: Vec::new(),
            upper: Vec::new(),
            rank: world.rank as i32,
            counts: Vec::new(),
            patch: None,
        };
        bodies.iter().for_each(|body| piece.add(body));
        let counts = world.all_gather(&piece.block.counts());
        piece.counts = counts.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        piece
    }

    /// Collective: with the `patches` that rank 0 has as one more piece, the last one; without any as it is.
    pub(super) fn patched(mut self, world: &World, patches: &[GridPatch]) -> Self {
        let mut block = PatchGrid::new();
        if world.is_root() {
            patches.iter().for_each(|patch| block.add(patch));
        }
        let counts = world.broadcast(block.counts().to_vec());
        if counts[POINTS] > 0 {
            self.counts.push([counts[POINTS], counts[CELLS], counts[ENTRIES]]);
            self.patch = world.is_root().then_some(block);
        }
        self
    }

    fn add(&mut self, body: &BodyPart) {
        let part = body.part;
        let number = if body.upper { 2 } else { 1 };
        let mut point_of_node = vec![-1i64; part.node_ids.len()];
        let mut nodes = Vec::new();
        let owned = part.cells.iter().zip(&part.cell_owned).filter(|(_, &own)| own).map(|(cell, _)| cell);
        for cell in owned {
            let cell_type = cell.kind.topology();
            for (place, &image) in cell_type.mirror.iter().enumerate() {
                // Reflection turns a cell inside out; the mirrored order turns it back.
                let node = cell.nodes[if body.upper { image as usize } else { place }];
                let point = &mut point_of_node[node as usize];
                if *point < 0 {
                    *point = self.block.body_of_point.len() as i64;
                    let [x, y, z] = part.coords[node as usize];
                    self.block.points.extend([x, y, if body.upper { -z } else { z }]);
                    self.block.body_of_point.push(number);
                    nodes.push(node);
                }
                self.block.connectivity.push(*point);
            }
            self.block.offsets.push(self.block.connectivity.len() as i64);
            self.block.types.push(cell_type.vtk);
            self.block.body_of_cell.push(number);
        }
        self.nodes.push(nodes);
        self.local_nodes.push(part.node_ids.len());
        self.upper.push(body.upper);
    }

    fn total(&self, what: usize) -> usize {
        self.counts.iter().map(|c| c[what] as usize).sum()
    }

    /// Points, cells or entries before a piece.
    fn before(&self, piece: usize, what: usize) -> usize {
        self.counts[..piece].iter().map(|c| c[what] as usize).sum()
    }

    /// Number of pieces: one for each rank, and one for the contact grid if it is beside the meshes.
    pub(super) fn pieces(&self) -> usize {
        self.counts.len()
    }

    /// Number of points of all pieces.
    pub(super) fn total_points(&self) -> usize {
        self.total(POINTS)
    }

    /// The slots of the geometry and of the data that come with it.
    fn geometry_slots(&self) -> Vec<DatasetSlot> {
        let (np, nc, ne) = (self.total(POINTS), self.total(CELLS), self.total(ENTRIES));
        let body = "Body: 1 lower, 2 upper.";
        let connectivity = "Points of the cells, numbered within the piece.";
        let offsets = "Start of each cell in Connectivity, and the end, for each piece.";
        let types = "VTK cell types: 12 hexahedron.";
        vec![
            DatasetSlot::new(
                POINTS_PATH,
                "m",
                "Coordinates in the frame of the contact point.",
                &[np, 3],
                Values::F64(vec![]),
            ),
            DatasetSlot::new(CONNECTIVITY, "-", connectivity, &[ne], Values::I64(vec![])),
            DatasetSlot::new(OFFSETS, "-", offsets, &[nc + self.pieces()], Values::I64(vec![])),
            DatasetSlot::new(TYPES, "-", types, &[nc], Values::U8(vec![])),
            DatasetSlot::new(BODY_OF_POINT, "-", body, &[np], Values::I8(vec![])),
            DatasetSlot::new(BODY_OF_CELL, "-", body, &[nc], Values::I8(vec![])),
            DatasetSlot::new(RANK, "-", "Rank that owned the cell.", &[nc], Values::I32(vec![])),
        ]
    }

    /// The rows of a block in these slots, which is the piece `piece`.
    fn geometry_slabs(&self, block: &PatchGrid, piece: usize) -> Vec<Slab> {
        let [p, c, e] = [POINTS, CELLS, ENTRIES].map(|what| self.before(piece, what));
        let rank = vec![self.rank; block.body_of_cell.len()];
        let all: [(&str, usize, Values); 7] = [
            (POINTS_PATH, p, block.points.clone().into()),
            (CONNECTIVITY, e, block.connectivity.clone().into()),
            (OFFSETS, c + piece, block.offsets.clone().into()),
            (TYPES, c, block.types.clone().into()),
            (BODY_OF_POINT, p, block.body_of_point.clone().into()),
            (BODY_OF_CELL, c, block.body_of_cell.clone().into()),
            (RANK, c, rank.into()),
        ];
        all.into_iter().map(|(path, start, values)| Slab { path: path.to_owned(), start, values }).collect()
    }

    /// Slots and slabs of the geometry and of the data that come with it.
    pub(super) fn geometry(&self) -> (Vec<DatasetSlot>, Vec<Slab>) {
        let mut slabs = self.geometry_slabs(&self.block, self.rank as usize);
        if let Some(patch) = &self.patch {
            slabs.extend(self.geometry_slabs(patch, self.pieces() - 1));
        }
        (self.geometry_slots(), slabs)
    }

    /// The sizes of the pieces, which the reader wants first.
    pub(super) fn sizes(&self) -> Vec<Table> {
        let of = |what: usize| self.counts.iter().map(|c| c[what]).collect::<Vec<i64>>();
        vec![
            Table::list(
                "/VTKHDF/NumberOfPoints",
                "1",
                "Points of each piece; one piece for each rank, the last one for a contact grid beside the meshes.",
                of(POINTS),
            ),
            Table::list("/VTKHDF/NumberOfCells", "1", "Cells of each piece.", of(CELLS)),
            Table::list("/VTKHDF/NumberOfConnectivityIds", "1", "Entries of Connectivity of each piece.", of(ENTRIES)),
        ]
    }

    /// The slot of a point field with `steps` values one after the other.
    pub(super) fn slot(&self, spec: &FieldSpec, steps: usize, single: bool) -> DatasetSlot {
        let rows = self.total(POINTS) * steps;
        let shape = if spec.kind == FieldKind::Vector { vec![rows, 3] } else { vec![rows] };
        let like = match spec.kind {
            FieldKind::Label => Values::I8(vec![]),
            _ if single => Values::F32(vec![]),
            _ => Values::F64(vec![]),
        };
        DatasetSlot::new(&field_path(&spec.name), &spec.units, &spec.description, &shape, like)
    }

    /// This rank's rows of a point field at a step.
    pub(super) fn slab(&self, field: &PointField, step: usize, single: bool) -> Result<Slab> {
        let spec = &field.spec;
        let n = spec.kind.components();
        if field.values.len() != self.nodes.len() {
            let (have, want) = (field.values.len(), self.nodes.len());
            return Err(Error::Defect(format!("field {} has values for {have} of {want} bodies", spec.name)));
        }
        let mut all = Vec::with_capacity(self.block.body_of_point.len() * n);
        for (b, values) in field.values.iter().enumerate() {
            if values.len() != n * self.local_nodes[b] {
                return Err(Error::Defect(format!(
                    "field {} of body {b} has {} values, expected {} at each of {} nodes",
                    spec.name,
                    values.len(),
                    n,
                    self.local_nodes[b]
                )));
            }
            let mirror = spec.kind == FieldKind::Vector && self.upper[b];
            for &node in &self.nodes[b] {
                let at = n * node as usize;
                all.extend_from_slice(&values[at..at + n]);
                if let (true, Some(z)) = (mirror, all.last_mut()) {
                    *z = -*z;
                }
            }
        }
        let start = step * self.total(POINTS) + self.before(self.rank as usize, POINTS);
        Ok(Slab { path: field_path(&spec.name), start, values: stored(spec, all, single) })
    }

    /// The rows of a field of one step at the contact grid, on rank 0 if there is one.
    pub(super) fn patch_slab(&self, spec: &FieldSpec, patches: &[GridPatch]) -> Result<Option<Slab>> {
        if self.patch.is_none() {
            return Ok(None);
        }
        let values = stored(spec, patch::values(spec, patches)?, false);
        Ok(Some(Slab { path: field_path(&spec.name), start: self.before(self.pieces() - 1, POINTS), values }))
    }
}

/// The values of a field in the type that it is stored in.
fn stored(spec: &FieldSpec, all: Vec<f64>, single: bool) -> Values {
    match spec.kind {
        FieldKind::Label => Values::I8(all.iter().map(|&v| v as i8).collect()),
        _ if single => Values::F32(all.iter().map(|&v| v as f32).collect()),
        _ => Values::F64(all),
    }
}

fn field_path(name: &str) -> String {
    format!("/VTKHDF/PointData/{name}")
}

/// On rank 0: makes the temporary file with the group `/VTKHDF` of the given version, the slots, allocated but empty,
/// and the tables; then reserves its disk space. Without a version the file is empty.
pub(super) fn skeleton(
    partial: &Partial,
    version: Option<[i64; 2]>,
    slots: &[DatasetSlot],
    tables: &[Table],
    steps: Option<i64>,
) -> Result<()> {
    let make = || -> hdf5::Result<()> {
        let file = hdf5::File::with_options().with_fapl(strong).create_excl(&partial.path)?;
        if let Some(version) = version {
            let group = file.create_group("VTKHDF")?;
            group.new_attr::<i64>().shape(2).create("Version")?.write_raw(&version)?;
            let kind =
                FixedAscii::<16>::from_ascii("UnstructuredGrid").map_err(|e| hdf5::Error::from(e.to_string()))?;
            group.new_attr::<FixedAscii<16>>().create("Type")?.write_scalar(&kind)?;
            if let Some(n) = steps {
                group.create_group("Steps")?.new_attr::<i64>().create("NSteps")?.write_scalar(&n)?;
            }
        }
        for slot in slots {
            let (group, name) = parent(&file, &slot.path)?;
            let dataset = slot.like.create(&group, &name, &slot.shape, Layout::Reserved)?;
            describe(&dataset, &slot.units, &slot.description)?;
        }
        tables.iter().try_for_each(|table| table.write(&file))?;
        file.close()
    };
    let of_slots = slots.iter().map(|s| (s.shape.iter().product::<usize>() * s.like.item_bytes() + 4096) as u64);
    partial.probe(65536 + of_slots.sum::<u64>() + tables.iter().map(Table::bytes).sum::<u64>())?;
    make().map_err(|e| partial.hdf5_error("making the file", &e))?;
    let size = std::fs::metadata(&partial.path).map(|m| m.len()).unwrap_or(0);
    partial.reserve(size)
}

/// A file that all ranks have open, to write their own slabs and nothing else.
pub(super) struct OpenSlabs {
    file: hdf5::File,
}

impl OpenSlabs {
    /// Collective: opens the file of [`skeleton`] through MPI-IO.
    pub(super) fn open(world: &World, partial: &Partial) -> Result<Self> {
        let comm = world.comm.as_raw();
        let file = hdf5::File::with_options().with_fapl(|p| strong(p).mpio(comm, None)).open_rw(&partial.path);
        let file = file.map_err(|e| partial.hdf5_error("opening the file on all ranks", &e));
        Ok(Self { file: world.agree(file)? })
    }

    /// Collective in its result; each rank writes by itself.
    pub(super) fn write(&self, world: &World, partial: &Partial, slabs: &[Slab]) -> Result<()> {
        let write = || -> hdf5::Result<()> {
            for slab in slabs {
                let dataset = self.file.dataset(&slab.path)?;
                slab.values.write_rows(&dataset, slab.start)?;
            }
            Ok(())
        };
        world.agree(write().map_err(|e| partial.hdf5_error("writing fields", &e)))
    }

    /// Collective.
    pub(super) fn close(self, world: &World, partial: &Partial) -> Result<()> {
        world.agree(self.file.close().map_err(|e| partial.hdf5_error("closing the file", &e)))
    }
}

/// Collective: opens, writes and closes. Closing is collective, so a failure to write comes after it.
pub(super) fn write_slabs(world: &World, partial: &Partial, slabs: &[Slab]) -> Result<()> {
    let open = OpenSlabs::open(world, partial)?;
    let written = open.write(world, partial, slabs);
    let closed = open.close(world, partial);
    written.and(closed)
}

/// Files close with everything that is open in them, and HDF5 does not lock them: Lustre and NFS may have no locks,
/// and it would open nothing there. None is needed: a file has its name when it is complete, and segments are locked
/// by their manifest.
pub(super) fn strong(
    plist: &mut hdf5::plist::file_access::FileAccessBuilder,
) -> &mut hdf5::plist::file_access::FileAccessBuilder {
    plist.fclose_degree(hdf5::plist::file_access::FileCloseDegree::Strong).file_locking(false)
}
