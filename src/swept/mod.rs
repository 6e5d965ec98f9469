//! Bodies swept from a section: a section of finite elements turned about an axis, one small real symmetric problem
//! for each Fourier order.
//!
//! Cylindrical coordinates (r, θ, y) about the axle, y along it, θ = 0 at the contact point, where e_r is z and e_θ
//! is x of the lower form. Motions of the order n come in two families that are each other turned by 90° of phase:
//! (u_r, u_θ, u_y) = (U cos nθ, V sin nθ, W cos nθ) and (U sin nθ, −V cos nθ, W sin nθ), with the same (U, V, W) of
//! the section. Order 0 has one family, u = (U, V, W), in which the torsion V stands by itself. Amplitudes of a
//! section are interleaved `3*i + c` over its nodes that are free to move, c = (U, V, W).
//!
//! Nothing here knows MPI, PETSc or contact: it is plain dense and sparse algebra for one rank.

mod absorbing_ends;
mod attached;
mod beam;
mod bearings;
mod built_rail;
mod builtin;
pub mod compliance;
mod contact;
mod discrete_supports;
mod display_mesh;
mod drawn;
mod face;
mod forms;
mod free_torsion;
mod half_sections;
mod half_space_load;
pub(crate) mod infinite;
mod krylov;
mod layers;
mod load;
mod load_frame;
mod load_patch;
mod measures;
mod mirror;
pub mod modes;
mod numbering;
mod outline;
mod path;
mod rail;
mod refine;
mod rotation;
mod section;
mod shape;
mod skyline_ldlt;
mod springs;
mod track;
pub(crate) mod track_decay;
pub mod waves;
mod wheel;
mod wheelset;

pub use crate::rails::HeadPoint;
pub use absorbing_ends::AbsorbingEnds;
pub use attached::{Attachment, NearestPlace, RingLoss, Wire};
pub use beam::Beam;
pub use bearings::Bearing;
pub use built_rail::BuiltRail;
pub use builtin::{cylinder, CylinderSection, Focus, RunningPlace, SectionSource};
pub use compliance::Constant;
pub use contact::{SectionContact, Spot};
pub use discrete_supports::{DiscreteSupports, RailMember, RailOnPads, SleeperBar, SupportedRailModes};
pub use display_mesh::{DisplayMesh, PictureModes};
pub use drawn::DrawnSection;
pub use face::SectionFace;
pub use forms::{Forms, Parity, Prestress};
pub use half_sections::HalfSections;
pub use half_space_load::HalfSpaceLoad;
pub use infinite::{Infinite, FORCES};
pub use layers::SectionLayer;
pub(crate) use load::family_shares;
pub use load::{LineLoad, FAMILY};
pub(crate) use load_frame::rotate_load_pairs_between;
pub use load_frame::rotate_loads;
pub use load_patch::{LoadPatch, Square, LOADS};
pub use measures::Measures;
pub use mirror::Mirror;
pub use modes::{ContactModeData, FourierModes};
pub use outline::{Edge, OrderModes, Outline, OutlineModes};
pub use path::Path;
pub use rail::{DrawnRail, PlacedRailSection};
pub use rotation::{blocks, RotationBlocks};
pub use section::{CrossSection, SectionElement};
pub use shape::SectionCell;
pub use springs::EdgeSprings;
pub use track::{RailTrack, SleeperLayer, TrackLayer};
#[cfg(test)]
pub(crate) use wheel::w920s;
pub use wheel::{Wheel, WheelShape};
pub use wheelset::{SolidAxle, JOURNALS, SEATS};

#[cfg(test)]
mod tests;
