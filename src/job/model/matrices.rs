//! A body by its matrices: files, degrees of freedom, contacts and supports.

use super::Component;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A body by its matrices, real files of other programs relative to the job file. Degrees of freedom without mass and
/// rigid-body motions are allowed. Such a body may be alone: its counter-body is then rigid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Matrices {
    /// File of the mass matrix M, symmetric, kg.
    pub mass: MatrixFile,
    /// File of the damping matrix C, N·s/m. Without it there is no damping.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<MatrixFile>,
    /// Factor of the damping matrix.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub damping_factor: f64,
    /// File of the stiffness matrix K, symmetric, N/m.
    pub stiffness: MatrixFile,
    /// File that lists node and direction of each row of the matrices, for formats that number rows only. Default: the
    /// file with the ending `dof` beside a stiffness file with the ending `sti`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dofs: Option<PathBuf>,
    /// Length of the files' unit, m, with forces in N and times in s: 0.001 for mm, N, t and s.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub scale: f64,
    /// Nodes that are clamped or lie on springs and dashpots, which the matrices do not have.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub supports: Vec<MatrixSupport>,
    /// Contacts of the body: one entry for each of `contact.points`, in their order. With the key `contacts` of the job
    /// they follow from its cells.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<MatrixContact>,
}

fn one() -> f64 {
    1.0
}

impl Matrices {
    /// File of the degrees of freedom: the one that is given, or that which CalculiX writes beside the stiffness.
    pub(crate) fn dofs_file(&self) -> Option<PathBuf> {
        let stiffness = self.stiffness.path();
        let calculix = stiffness.extension().is_some_and(|e| e.eq_ignore_ascii_case("sti"));
        self.dofs.clone().or_else(|| calculix.then(|| stiffness.with_extension("dof")))
    }

    /// All files with their keys.
    pub fn files(&self) -> Vec<(&'static str, PathBuf)> {
        let matrices =
            [("mass", Some(&self.mass)), ("damping", self.damping.as_ref()), ("stiffness", Some(&self.stiffness))];
        let paths = matrices.into_iter().filter_map(|(key, file)| Some((key, file?.path().clone())));
        paths.chain(self.dofs_file().map(|file| ("dofs", file))).collect()
    }

    /// Paths of all files that the job names, to be changed.
    pub(crate) fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        let matrices = [Some(&mut self.mass), self.damping.as_mut(), Some(&mut self.stiffness)];
        matrices.into_iter().flatten().map(MatrixFile::path_mut).chain(&mut self.dofs).collect()
    }
}

/// A matrix file: its path, or its path and how to read it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum MatrixFile {
    /// Path; the ending says the format.
    Path(PathBuf),
    /// Path and more.
    Keys(MatrixFileKeys),
}

/// A matrix file and how to read it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatrixFileKeys {
    /// Path of the file.
    pub path: PathBuf,
    /// Name of the matrix in a file of several: of DMIG, OUTPUT4 and Abaqus' `*MATRIX INPUT`. Case does not matter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Format. Default: by the ending of the path, and Matrix Market by its first line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<MatrixFormat>,
}

impl MatrixFile {
    /// Its path.
    pub fn path(&self) -> &PathBuf {
        match self {
            MatrixFile::Path(path) => path,
            MatrixFile::Keys(keys) => &keys.path,
        }
    }

    /// Its path, to be changed.
    pub(crate) fn path_mut(&mut self) -> &mut PathBuf {
        match self {
            MatrixFile::Path(path) => path,
            MatrixFile::Keys(keys) => &mut keys.path,
        }
    }
}

/// Format of a matrix file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MatrixFormat {
    /// Matrix Market, coordinate or array.
    MatrixMarket,
    /// Abaqus' `*MATRIX OUTPUT` in text: matrix input, labels or coordinate.
    Abaqus,
    /// CalculiX' `SOLVER=MATRIXSTORAGE`.
    Calculix,
    /// Nastran's bulk data entries DMIG.
    Dmig,
    /// Nastran's OUTPUT4, text or binary.
    Op4,
    /// Harwell–Boeing.
    HarwellBoeing,
}

/// Nodes that are clamped or lie on springs and dashpots to the ground.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatrixSupport {
    /// Numbers of the nodes in the other program.
    pub nodes: Vec<i64>,
    /// Components of the displacement that are held at these nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clamped: Vec<Component>,
    /// Stiffness of a spring at each node along x, y and z, N/m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 0.0)), extend("unit" = "N/m"))]
    pub stiffness: Option<[f64; 3]>,
    /// Damping of a dashpot at each node along x, y and z, N·s/m; `damping_factor` multiplies it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 0.0)), extend("unit" = "N·s/m"))]
    pub damping: Option<[f64; 3]>,
}

/// Degrees of freedom of a body at one contact: of a node by directions, or 1-based rows of the matrices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatrixContact {
    /// Number of the node in the other program. Without it `normal` and `tangential` are rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node: Option<i64>,
    /// Number of the node of the counter-body, where the same matrices have both bodies: the contact has the
    /// displacement of `node` relative to this one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub against: Option<i64>,
    /// Direction of the normal, into the body (with `against` into the body of `node`); or the row of that
    /// displacement. A minus sign turns a row round; 0 means that the body does not move in that direction.
    pub normal: MatrixDirection,
    /// Directions x and y, or the rows of the displacements along them; y may be left out.
    pub tangential: Vec<MatrixDirection>,
    /// Key of the job that it was made of, for messages; none of a contact that the job gives.
    #[serde(skip)]
    pub made_of: Option<String>,
}

/// A direction at a node, or a row.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum MatrixDirection {
    /// Signed row, from 1; 0: no motion.
    Row(i64),
    /// Axis of the other program's frame.
    Axis(MatrixAxis),
    /// Vector in the other program's frame, of any length but 0.
    Vector([f64; 3]),
}

/// A signed axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum MatrixAxis {
    /// Along x.
    #[serde(rename = "x")]
    X,
    /// Along y.
    #[serde(rename = "y")]
    Y,
    /// Along z.
    #[serde(rename = "z")]
    Z,
    /// Against x.
    #[serde(rename = "-x")]
    MinusX,
    /// Against y.
    #[serde(rename = "-y")]
    MinusY,
    /// Against z.
    #[serde(rename = "-z")]
    MinusZ,
}

impl MatrixDirection {
    /// The direction as a unit vector; none of a row.
    pub fn vector(&self) -> Option<[f64; 3]> {
        let v = match self {
            MatrixDirection::Row(_) => return None,
            MatrixDirection::Vector(v) => *v,
            MatrixDirection::Axis(MatrixAxis::X) => [1.0, 0.0, 0.0],
            MatrixDirection::Axis(MatrixAxis::Y) => [0.0, 1.0, 0.0],
            MatrixDirection::Axis(MatrixAxis::Z) => [0.0, 0.0, 1.0],
            MatrixDirection::Axis(MatrixAxis::MinusX) => [-1.0, 0.0, 0.0],
            MatrixDirection::Axis(MatrixAxis::MinusY) => [0.0, -1.0, 0.0],
            MatrixDirection::Axis(MatrixAxis::MinusZ) => [0.0, 0.0, -1.0],
        };
        let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        Some(v.map(|c| c / length))
    }
}
