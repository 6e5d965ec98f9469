//! Interface of a body to the contact, whatever it is made of.

pub(crate) mod align;
pub mod averaged_trace;
pub(crate) mod clusters;
pub mod collective_order;
pub(crate) mod contact_spec;
pub(crate) mod convolution;
mod discrete_supports;
pub mod elements;
pub mod fe;
pub(crate) mod full_order_integrator;
pub mod half_space;
pub mod hybrid;
pub(crate) mod inertia_relief;
pub mod matrices;
pub mod matrix_body;
pub mod matrix_files;
pub mod matrix_market;
mod matrix_rows;
pub(crate) mod modal;
pub(crate) mod mode_cache;
pub(crate) mod mode_label;
pub mod modes;
pub mod near_contacts;
pub mod nearest;
pub(crate) mod place_table;
pub(crate) mod positivity;
pub(crate) mod rail;
pub(crate) mod rails_on_sleepers;
pub mod residual_flexibility;
pub mod rigid;
pub(crate) mod rigid_motions;
pub mod rotation;
pub mod separate_bodies;
pub mod statics;
pub mod supports;
pub mod swept;
pub(crate) mod trace;

pub use contact_spec::ContactSpec;
pub use convolution::Convolution;
pub use modal::{ModalBlock, ModalMatrix};
pub use mode_label::ModeLabel;
pub use trace::{Side, Trace};

use crate::mesh::distribute::MeshPart;
use crate::petsc::csr::DistCsr;
use crate::swept::{Infinite, OutlineModes, PictureModes};
use crate::Result;
use faer::{Mat, MatRef};
use fe::BodyModes;
use hybrid::{Compact, ContactFunctions, LoadCircles};
use mode_cache::CachedModes;
use modes::Extent;
use nearest::Nearest;
use residual_flexibility::NodeRecovery;
use rotation::{ModalRotation, RotationForms, RotationTerms};

/// A body as the interface sees it, dense, on rank 0. Contact rows are interleaved `3*i + c` over the nodes `i` of the
/// contact grid; component `c` is x, y, and n = into the body (-z in lower form), so that pressure acts as `+p` on
/// row n of either body. All in lower form; [`Side`] has what turns round above.
#[derive(Debug, Clone)]
pub struct ReducedBody {
    /// Angular frequencies of the kept free-interface modes, rad/s, ascending, `[m]`; 0 for rigid-body modes.
    pub omega: Vec<f64>,
    /// Modal stiffness K (q̈ + C q̇ + K q = …), 1/s²: diag(ω²) of a body at rest.
    pub stiffness: ModalMatrix,
    /// Modal damping C, 1/s; with gyroscopic terms of a body that rotates.
    pub damping: ModalMatrix,
    /// Terms of rotation in both; none of a body at rest.
    pub turning: Option<RotationTerms>,
    /// Mass-normalised modes at the contact rows, 1/√kg, `[3n, m]`.
    pub contact_modes: Mat<f64>,
    /// Static compliance of the contact rows, m/N, `[3n, 3n]`, symmetric: the whole K⁻¹, modes included.
    pub compliance: Mat<f64>,
    /// Angular frequency up to which the modes are known, rad/s; infinite where these are all there are.
    pub reach: f64,
    /// Names of the modes, `[m]`; empty where that is not known.
    pub names: Vec<ModeLabel>,
}

impl ReducedBody {
    /// A body at rest, whose stiffness is diag(ω²).
    pub fn new(
        omega: Vec<f64>,
        damping: impl Into<ModalMatrix>,
        contact_modes: Mat<f64>,
        compliance: Mat<f64>,
    ) -> Self {
        let reach = omega.last().copied().unwrap_or(0.0);
        let (stiffness, damping) = (ModalMatrix::squares(&omega), damping.into());
        Self { omega, stiffness, damping, turning: None, contact_modes, compliance, reach, names: Vec::new() }
    }
}

/// Free-interface modes of a body as its contact rows see them.
#[derive(Debug, Clone, Default)]
pub struct TraceModes {
    /// Angular frequencies, rad/s, ascending, `[m]`; 0 for rigid-body modes. On every rank.
    pub omega: Vec<f64>,
    /// Relative residuals of the modes, `[m]`, where they are computed one by one; on every rank.
    pub residual: Vec<f64>,
    /// Mass-normalised modes at the contact rows, 1/√kg, `[3n, m]`; on rank 0.
    pub rows: Option<Mat<f64>>,
    /// ΦᵀCΦ of a body that brings its own damping matrix, 1/s, `[m, m]`; on rank 0.
    pub damping: Option<Mat<f64>>,
    /// φᵀKφ of each mode in springs that have a loss factor of their own, 1/s², `[m]`; empty where there are none. On
    /// every rank.
    pub springs: Vec<f64>,
    /// Angular frequency up to which all modes are known, rad/s; infinite where these are all there are.
    pub reach: f64,
    /// Contribution of rotation of the body, where it was asked for; on every rank.
    pub rotation: Option<ModalRotation>,
    /// Names of the modes, `[m]`, where that is known; on every rank.
    pub names: Vec<ModeLabel>,
    /// Angular frequencies as they were computed, rad/s, `[m]`, where `omega` has measured ones; else empty. On every
    /// rank.
    pub computed: Vec<f64>,
    /// Modes that a measured shape stands for, with the modal assurance criterion; on every rank.
    pub matched: Vec<(usize, f64)>,
}

impl TraceModes {
    /// Frequencies, Hz.
    pub fn frequency(&self) -> Vec<f64> {
        self.omega.iter().map(|w| w / (2.0 * std::f64::consts::PI)).collect()
    }
}

/// Progress callback: `(done, total)`, the total 0 where it is not known.
pub type ProgressFn<'a> = dyn FnMut(usize, usize) + 'a;

/// Kinds of bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Finite elements on a mesh.
    Elements,
    /// Finite elements on a section that is turned about an axle.
    Swept,
    /// Finite elements on a section that is drawn along a line.
    Rail,
    /// Matrices from another program.
    Matrices,
    /// An elastic half-space.
    HalfSpace,
    /// Nothing that moves.
    Rigid,
}

/// Capabilities of a body that an analysis may need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Capability {
    /// A contact surface with a grid of nodes.
    Grid,
    /// Free-interface modes.
    Modes,
    /// Motions that can be shown on a mesh.
    Fields,
    /// A surface that moves in its modes, and so radiates sound.
    Surface,
    /// The matrices of all degrees of freedom.
    FullSystem,
    /// Several contacts, each on a grid of its own.
    SeveralContacts,
}

impl Kind {
    /// Returns whether bodies of this kind can give it.
    pub fn can(self, what: Capability) -> bool {
        match self {
            Kind::Elements => true,
            Kind::Swept | Kind::Rail => !matches!(what, Capability::Fields | Capability::FullSystem),
            Kind::Matrices => matches!(what, Capability::Modes | Capability::FullSystem),
            // A rigid body and a half-space have all their modes, none; a rigid body touches wherever the other one
            // does.
            Kind::Rigid | Kind::HalfSpace => {
                matches!(what, Capability::Modes | Capability::Grid | Capability::SeveralContacts)
            }
        }
    }
}

/// A body in contact. Every method but the plainest is collective: all ranks call it, in the same order; what is
/// asked of the contact rows is given and returned on rank 0; an error of one rank is one of all. All is in lower
/// form. Contact rows are stacked over the contacts of the body, in their order.
pub trait ElasticBody {
    /// Name in messages and results.
    fn name(&self) -> &str;

    /// Returns the kind of the body.
    fn kind(&self) -> Kind;

    /// Number of contact rows of all contacts, 3n, on every rank.
    fn rows(&self) -> usize;

    /// Collective: gets ready for what follows, and says what was made, for the summary, where that takes a
    /// factorisation.
    fn factorise(&mut self) -> Result<Option<String>> {
        Ok(None)
    }

    /// Collective: gives back the memory that [`ElasticBody::factorise`] took.
    fn release(&mut self) -> Result<()> {
        Ok(())
    }

    /// Collective: static compliance P K⁻¹ Pᵀ of the contact rows without rigid-body motions, m/N, `[3n, 3n]` on rank
    /// 0.
    fn compliance(&self, steps: &mut ProgressFn) -> Result<Option<Mat<f64>>>;

    /// Low-rank data of its contact rows, where that is few numbers, the same on every rank, after
    /// [`ElasticBody::factorise`] and [`ElasticBody::modes`].
    fn compact(&self) -> Result<Option<Compact>> {
        Ok(None)
    }

    /// Its whole contact rows in few numbers, where that is possible, the same on every rank, after
    /// [`ElasticBody::factorise`] and [`ElasticBody::modes`].
    fn contact_functions(&self) -> Result<Option<ContactFunctions>> {
        Ok(None)
    }

    /// Collective: compliance of its one contact beside the half-space under loads on each of some `circles`, m/N and
    /// so on, `[9, 9]`, of a body of a section.
    fn contact_compliances(&self, _circles: LoadCircles) -> Result<Option<Vec<Mat<f64>>>> {
        Ok(None)
    }

    /// Sets one of [`ElasticBody::contact_compliances`] in place of what [`ElasticBody::factorise`] computes.
    fn adopt_compliance(&mut self, _constant: Mat<f64>) {}

    /// Collective: the free-interface modes that are wanted.
    fn modes(&mut self, extent: Extent, steps: &mut ProgressFn) -> Result<TraceModes>;

    /// Collective: its modes at some `points`, 1/√kg, `[3p, m]` on every rank, after [`ElasticBody::modes`]; none of a
    /// body without a shape. Points and motions are (x, y, z), m: of a swept body with the axle along y and y as the
    /// job counts it, of one on a mesh in lower form.
    ///
    /// # Errors
    /// A point beside the body.
    fn modes_at(&self, _points: &[[f64; 3]]) -> Result<Option<Mat<f64>>> {
        Ok(None)
    }

    /// The modes that it has found, for another body, where they may serve one.
    fn cached_modes(&self) -> Option<CachedModes> {
        None
    }

    /// Takes modes that another body has found, for [`ElasticBody::modes`] to look whether they serve it.
    fn reuse_modes(&mut self, _found: &CachedModes) {}

    /// Collective: static displacement of the contact rows, m, `[3n]` on rank 0, under forces on them, N, `[3n]` on
    /// rank 0.
    fn response(&self, forces: &[f64]) -> Result<Vec<f64>>;

    /// The modes at all degrees of freedom, after [`ElasticBody::modes`] or [`Fields::replace_shapes`], where they are
    /// kept.
    fn shapes(&self) -> Option<&BodyModes> {
        None
    }

    /// Returns the radiating outlines of its modes, after [`ElasticBody::modes`], of bodies that are swept from
    /// sections. An error where a section has no outline that could radiate.
    fn outlines(&self) -> Result<Vec<OutlineModes>> {
        Ok(Vec::new())
    }

    /// The rails without ends that it stands for, in the order of their contacts, for angular frequencies up to
    /// `reach`, rad/s, of rails: what they radiate does not depend on where the pieces that are modelled end.
    fn infinite_rails(&self, _reach: f64) -> Result<Vec<Infinite>> {
        Ok(Vec::new())
    }

    /// Its modes on a mesh that shows them, after [`ElasticBody::modes`], of a body that is swept from a section; the
    /// same on every rank.
    fn picture(&self) -> Option<&PictureModes> {
        None
    }

    /// Its motions on a mesh, where it has one.
    fn fields(&self) -> Option<&dyn Fields> {
        None
    }

    /// [`ElasticBody::fields`], to be changed.
    fn fields_mut(&mut self) -> Option<&mut dyn Fields> {
        None
    }

    /// Its matrices, where it has them.
    fn full_system(&self) -> Option<&dyn FullSystem> {
        None
    }
}

/// A body that can be shown on a mesh. A motion is a vector of this rank's degrees of freedom, m, in lower form; its
/// length is that of [`Fields::len`].
pub trait Fields {
    /// This rank's share of the mesh.
    fn mesh(&self) -> &MeshPart;

    /// Number of this rank's degrees of freedom.
    fn len(&self) -> usize;

    /// Returns whether this rank has none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Collective: the node nearest to a point, m, in lower form.
    fn nearest(&self, point: [f64; 3]) -> Nearest;

    /// Collective: diagonal of the bounding box, m.
    fn diameter(&self) -> f64;

    /// Collective: a motion at the nodes of this rank, ghosts included; 0 at supports.
    fn at_nodes(&self, motion: &[f64]) -> Vec<[f64; 3]>;

    /// Collective: von Mises stress of a motion, Pa, at the nodes of this rank, ghosts included.
    fn von_mises(&self, motion: &[f64]) -> Vec<f64>;

    /// The motion that has this value at each owned node; `None` where a value is missing at a node that is free to
    /// move.
    fn of_nodes(&self, value: &dyn Fn(usize) -> Option<[f64; 3]>) -> Option<Vec<f64>>;

    /// Takes modes from elsewhere as those of [`ElasticBody::shapes`], or none; returns those there were.
    fn replace_shapes(&mut self, shapes: Option<BodyModes>) -> Option<BodyModes>;

    /// Collective: the modes at the contact rows, 1/√kg, `[3n, m]` on rank 0.
    fn contact_modes(&self) -> Result<Option<Mat<f64>>>;

    /// Collective: static motions under `count` sets of forces on the contact rows, N, `[3n, count]` column by column
    /// on rank 0; `[len, count]`.
    fn statics(&self, forces: &[f64], count: usize) -> Result<Vec<f64>>;

    /// Collective: improves approximate static motions, `[len, count]`, until the residual is `accuracy` of the
    /// forces, `[3n, count]` on rank 0.
    fn improve(&self, motions: &mut [f64], forces: &[f64], count: usize, accuracy: f64) -> Result<()>;

    /// Iterations of its static solver so far.
    fn iterations(&self) -> usize;

    /// Collective: a motion at the contact rows, m, `[3n]` on rank 0, empty elsewhere.
    fn at_contact(&self, motion: &[f64]) -> Vec<f64>;

    /// Collective: what modes and contact forces do to an owned node, given on the rank that owns it. `contact_modes`
    /// are the modes at the contact rows, `[3n, m]`, on rank 0.
    fn node_motion(&self, contact_modes: Option<MatRef<'_, f64>>, node: Option<usize>) -> Result<NodeRecovery>;
}

/// A body whose matrices are at hand, distributed by rows.
pub trait FullSystem {
    /// Name in messages.
    fn name(&self) -> &str;

    /// Stiffness K, N/m.
    fn stiffness(&self) -> &DistCsr;

    /// Mass M, kg.
    fn mass(&self) -> &DistCsr;

    /// Damping C of its own, N·s/m.
    fn damping(&self) -> Option<&DistCsr> {
        None
    }

    /// Stiffness of the springs in it that have a loss factor of their own, N/m.
    fn lossy(&self) -> Option<&DistCsr> {
        None
    }

    /// Its contact rows.
    fn trace(&self) -> &Trace;

    /// Collective: what rotation adds at 1 rad/s, of a body that rotates and whose modes are known.
    fn rotation(&self) -> Result<Option<RotationForms>> {
        Ok(None)
    }
}
