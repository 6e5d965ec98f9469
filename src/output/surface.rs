//! The surfaces of meshes before anything is computed: a file that ParaView opens and `plot` draws
//! (`docs/reference/output.md`, "Meshes before a run").

use super::atomic_file::{sweep, Partial};
use super::overwrite_policy::replaceable;
use super::read::Reader;
use super::table::Table;
use super::vtkhdf::skeleton;
use crate::{Error, Result};
use std::path::Path;

/// Ending of the file, which ParaView goes by.
const ENDING: &str = "vtkhdf";
/// Dataset that tells such a file from all others.
const GROUPS: &str = "/surface/group";

/// A facet of a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFacet {
    /// Three or four corners, outward, as indices of points.
    pub corners: Vec<u32>,
    /// 1 lower, 2 upper.
    pub body: i8,
    /// Index of its group; −1 where it is in none.
    pub group: i32,
}

/// A group of facets.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// "lower" or "upper", and its name in the mesh.
    pub name: String,
    /// Role of the group in the job: "contact", "fixed", "support" or nothing.
    pub role: &'static str,
}

/// A node of the contact grid on the surface of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactNode {
    /// 1 lower, 2 upper.
    pub body: i8,
    /// Position, m; in the plane of the contact where there is no facet.
    pub place: [f64; 3],
    /// True if a facet of the contact surface of the body is there.
    pub on_face: bool,
}

/// The surfaces of the bodies of a job, in the frame of the contact.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surfaces {
    /// Points, m.
    pub points: Vec<[f64; 3]>,
    /// Facets of all bodies.
    pub faces: Vec<SurfaceFacet>,
    /// Groups of all bodies.
    pub groups: Vec<Group>,
    /// Nodes of the contact grid as they lie on the surface of each body that has one, the lower one first.
    pub contact: Vec<ContactNode>,
    /// Nodes along x and y of the common grid, node (i, j) of a body its (i + nx·j)-th; zeros where the nodes are
    /// those of the meshes.
    pub common: [usize; 2],
}

impl Surfaces {
    /// On one rank alone: writes the file. One of this kind is replaced, nothing else is.
    pub fn write(&self, path: &Path) -> Result<()> {
        if path.extension().is_none_or(|e| e != ENDING) {
            return Err(Error::Job(format!(
                "--mesh {}: expected a name that ends in .{ENDING}, which ParaView opens as it is",
                path.display()
            )));
        }
        let ours = path.is_file() && Reader::open(path).is_ok_and(|r| r.has(GROUPS));
        if !ours {
            replaceable(path, false)?;
        }
        sweep(path);
        let mut partial = Partial::alone(path);
        skeleton(&partial, Some([1, 0]), &[], &self.tables(), None)?;
        partial.publish()
    }

    fn tables(&self) -> Vec<Table> {
        let n = self.points.len();
        let connectivity: Vec<i64> = self.faces.iter().flat_map(|f| f.corners.iter().map(|&c| i64::from(c))).collect();
        let ends = self.faces.iter().scan(0i64, |at, f| {
            *at += f.corners.len() as i64;
            Some(*at)
        });
        let offsets: Vec<i64> = std::iter::once(0).chain(ends).collect();
        // VTK's triangle and quadrilateral.
        let types: Vec<u8> = self.faces.iter().map(|f| if f.corners.len() == 3 { 5 } else { 9 }).collect();
        let of_faces = |value: fn(&SurfaceFacet) -> i32| self.faces.iter().map(value).collect::<Vec<i32>>();
        let count = |what: usize| vec![what as i64];
        let places: Vec<f64> = self.contact.iter().flat_map(|c| c.place).collect();
        let text = |of: fn(&Group) -> &str| self.groups.iter().map(|g| of(g).to_owned()).collect::<Vec<String>>();
        vec![
            Table::list("/VTKHDF/NumberOfPoints", "1", "Points.", count(n)),
            Table::list("/VTKHDF/NumberOfCells", "1", "Facets.", count(self.faces.len())),
            Table::list("/VTKHDF/NumberOfConnectivityIds", "1", "Entries of Connectivity.", count(connectivity.len())),
            Table::new(
                "/VTKHDF/Points",
                "m",
                "Coordinates in the frame of the contact point.",
                &[n, 3],
                self.points.as_flattened().to_vec(),
            ),
            Table::list("/VTKHDF/Connectivity", "-", "Corners of the facets, outward.", connectivity),
            Table::list("/VTKHDF/Offsets", "-", "Start of each facet in Connectivity, and the end.", offsets),
            Table::list("/VTKHDF/Types", "-", "VTK cell types: 5 triangle, 9 quadrilateral.", types),
            Table::list("/VTKHDF/CellData/body", "-", "Body: 1 lower, 2 upper.", of_faces(|f| f.body.into())),
            Table::list(
                "/VTKHDF/CellData/group",
                "-",
                "Row of /surface/group; -1 for facets in no group.",
                of_faces(|f| f.group),
            ),
            Table::list(GROUPS, "-", "Body and name of each group of facets.", text(|g| &g.name)),
            Table::list(
                "/surface/role",
                "-",
                "Use of it in the job: contact, fixed, support, or nothing.",
                text(|g| g.role),
            ),
            Table::list(
                "/surface/contact_body",
                "-",
                "Body of each contact node: 1 lower, 2 upper.",
                self.contact.iter().map(|c| i32::from(c.body)).collect::<Vec<i32>>(),
            ),
            Table::new(
                "/surface/contact_point",
                "m",
                "Contact nodes as they lie on the surfaces.",
                &[self.contact.len(), 3],
                places,
            ),
            Table::list(
                "/surface/contact_on_face",
                "-",
                "1 where a facet of the contact surface is behind the contact node, 0 where the grid leaves the \
                 surface.",
                self.contact.iter().map(|c| i8::from(c.on_face)).collect::<Vec<i8>>(),
            ),
            Table::list(
                "/surface/common_grid",
                "1",
                "Nodes along x and y of the common contact grid; 0 where the contact nodes are those of the meshes.",
                self.common.map(|n| n as i64).to_vec(),
            ),
        ]
    }
}
