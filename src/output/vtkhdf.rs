//! The group `/VTKHDF`: an UnstructuredGrid with one piece for each rank, as VTK's own reader wants it.
//!
//! Layout after the VTKHDF specification (docs.vtk.org, "VTKHDF format specification"): version 1.0 without steps,
//! 2.0 with them.

use super::fields::{BodyPart, FieldKind, FieldSpec, PointField};
use super::partial::Partial;
use super::table::{describe, parent, Table};
use super::values::{Layout, Values};
use crate::parallel::World;
use crate::{Error, Result};
use hdf5::types::FixedAscii;
use mpi::raw::AsRaw;

/// A dataset whose rows the ranks write.
pub(super) struct Slot {
    pub(super) path: String,
    pub(super) units: String,
    pub(super) description: String,
    pub(super) shape: Vec<usize>,
    /// An empty vector of the type.
    pub(super) like: Values,
}

impl Slot {
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
pub(super) struct Piece {
    points: Vec<f64>,
    connectivity: Vec<i64>,
    offsets: Vec<i64>,
    types: Vec<u8>,
    body_of_point: Vec<i8>,
    body_of_cell: Vec<i8>,
    /// For each body, the local nodes that are points of the piece, in order.
    nodes: Vec<Vec<u32>>,
    local_nodes: Vec<usize>,
    upper: Vec<bool>,
    rank: i32,
    /// Points, cells and connectivity entries of each rank's piece.
    counts: Vec<[i64; 3]>,
}

/// Where to find what in [`Piece::counts`].
const POINTS: usize = 0;
const CELLS: usize = 1;
const ENTRIES: usize = 2;

impl Piece {
    /// Collective: makes the pieces of `bodies`.
    pub(super) fn new(world: &World, bodies: &[BodyPart]) -> Self {
        let mut piece = Self {
            points: Vec::new(),
            connectivity: Vec::new(),
            offsets: vec![0],
            types: Vec::new(),
            body_of_point: Vec::new(),
            body_of_cell: Vec::new(),
            nodes: Vec::new(),
            local_nodes: Vec::new(),
            upper: Vec::new(),
            rank: world.rank as i32,
            counts: Vec::new(),
        };
        bodies.iter().for_each(|body| piece.add(body));
        let mine = [piece.body_of_point.len() as i64, piece.body_of_cell.len() as i64, piece.connectivity.len() as i64];
        piece.counts = world.all_gather(&mine).chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        piece
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
                    *point = self.body_of_point.len() as i64;
                    let [x, y, z] = part.coords[node as usize];
                    self.points.extend([x, y, if body.upper { -z } else { z }]);
                    self.body_of_point.push(number);
                    nodes.push(node);
                }
                self.connectivity.push(*point);
            }
            self.offsets.push(self.connectivity.len() as i64);
            self.types.push(cell_type.vtk);
            self.body_of_cell.push(number);
        }
        self.nodes.push(nodes);
        self.local_nodes.push(part.node_ids.len());
        self.upper.push(body.upper);
    }

    fn total(&self, what: usize) -> usize {
        self.counts.iter().map(|c| c[what] as usize).sum()
    }

    fn start(&self, what: usize) -> usize {
        self.counts[..self.rank as usize].iter().map(|c| c[what] as usize).sum()
    }

    /// Number of pieces: one for each rank.
    pub(super) fn pieces(&self) -> usize {
        self.counts.len()
    }

    /// Number of points of all pieces.
    pub(super) fn total_points(&self) -> usize {
        self.total(POINTS)
    }

    /// Slots and slabs of the geometry and of the data that come with it.
    pub(super) fn geometry(&self) -> (Vec<Slot>, Vec<Slab>) {
        let (np, nc, ne) = (self.total(POINTS), self.total(CELLS), self.total(ENTRIES));
        let (p, c, e) = (self.start(POINTS), self.start(CELLS), self.start(ENTRIES));
        let ranks = self.counts.len();
        let cells = self.body_of_cell.len();
        let body = "Body: 1 lower, 2 upper.";
        let all: Vec<(Slot, usize, Values)> = vec![
            (
                Slot::new(
                    "/VTKHDF/Points",
                    "m",
                    "Coordinates in the frame of the contact point.",
                    &[np, 3],
                    Values::F64(vec![]),
                ),
                p,
                self.points.clone().into(),
            ),
            (
                Slot::new(
                    "/VTKHDF/Connectivity",
                    "-",
                    "Points of the cells, numbered within the piece.",
                    &[ne],
                    Values::I64(vec![]),
                ),
                e,
                self.connectivity.clone().into(),
            ),
            (
                Slot::new(
                    "/VTKHDF/Offsets",
                    "-",
                    "Start of each cell in Connectivity, and the end, for each piece.",
                    &[nc + ranks],
                    Values::I64(vec![]),
                ),
                c + self.rank as usize,
                self.offsets.clone().into(),
            ),
            (
                Slot::new("/VTKHDF/Types", "-", "VTK cell types: 12 hexahedron.", &[nc], Values::U8(vec![])),
                c,
                self.types.clone().into(),
            ),
            (
                Slot::new("/VTKHDF/PointData/body", "-", body, &[np], Values::I8(vec![])),
                p,
                self.body_of_point.clone().into(),
            ),
            (
                Slot::new("/VTKHDF/CellData/body", "-", body, &[nc], Values::I8(vec![])),
                c,
                self.body_of_cell.clone().into(),
            ),
            (
                Slot::new("/VTKHDF/CellData/rank", "-", "Rank that owned the cell.", &[nc], Values::I32(vec![])),
                c,
                vec![self.rank; cells].into(),
            ),
        ];
        all.into_iter()
            .map(|(slot, start, values)| {
                let slab = Slab { path: slot.path.clone(), start, values };
                (slot, slab)
            })
            .unzip()
    }

    /// The sizes of the pieces, which the reader wants first.
    pub(super) fn sizes(&self) -> Vec<Table> {
        let of = |what: usize| self.counts.iter().map(|c| c[what]).collect::<Vec<i64>>();
        vec![
            Table::list("/VTKHDF/NumberOfPoints", "1", "Points of each piece; one piece for each rank.", of(POINTS)),
            Table::list("/VTKHDF/NumberOfCells", "1", "Cells of each piece.", of(CELLS)),
            Table::list("/VTKHDF/NumberOfConnectivityIds", "1", "Entries of Connectivity of each piece.", of(ENTRIES)),
        ]
    }

    /// The slot of a point field with `steps` values one after the other.
    pub(super) fn slot(&self, spec: &FieldSpec, steps: usize, single: bool) -> Slot {
        let rows = self.total(POINTS) * steps;
        let shape = if spec.kind == FieldKind::Vector { vec![rows, 3] } else { vec![rows] };
        let like = match spec.kind {
            FieldKind::Label => Values::I8(vec![]),
            _ if single => Values::F32(vec![]),
            _ => Values::F64(vec![]),
        };
        Slot::new(&field_path(&spec.name), &spec.units, &spec.description, &shape, like)
    }

    /// This rank's rows of a point field at a step.
    pub(super) fn slab(&self, field: &PointField, step: usize, single: bool) -> Result<Slab> {
        let spec = &field.spec;
        let n = spec.kind.components();
        if field.values.len() != self.nodes.len() {
            let (have, want) = (field.values.len(), self.nodes.len());
            return Err(Error::Defect(format!("field {} has values for {have} of {want} bodies", spec.name)));
        }
        let mut all = Vec::with_capacity(self.body_of_point.len() * n);
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
        let values = match spec.kind {
            FieldKind::Label => Values::I8(all.iter().map(|&v| v as i8).collect()),
            _ if single => Values::F32(all.iter().map(|&v| v as f32).collect()),
            _ => Values::F64(all),
        };
        Ok(Slab { path: field_path(&spec.name), start: step * self.total(POINTS) + self.start(POINTS), values })
    }
}

fn field_path(name: &str) -> String {
    format!("/VTKHDF/PointData/{name}")
}

/// On rank 0: makes the temporary file with the group `/VTKHDF` of the given version, the slots, allocated but empty, and
/// the tables; then reserves its disk space. Without a version the file is empty.
pub(super) fn skeleton(
    partial: &Partial,
    version: Option<[i64; 2]>,
    slots: &[Slot],
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

/// Files close with everything that is open in them, and HDF5 does not lock them: Lustre and NFS may have no locks, and it would open nothing there.
/// None is needed: a file has its name when it is complete, and segments are locked by their manifest.
pub(super) fn strong(
    plist: &mut hdf5::plist::file_access::FileAccessBuilder,
) -> &mut hdf5::plist::file_access::FileAccessBuilder {
    plist.fclose_degree(hdf5::plist::file_access::FileCloseDegree::Strong).file_locking(false)
}
