//! The reduced model: what contact analyses need of the two bodies and of the interface between them, dense, made once for a run.

mod damping;
mod pair;
mod receptance;

use crate::body::ReducedBody;
use crate::grid::Interface;
use crate::job::Job;
use crate::parallel::World;
use crate::{Error, Result};
use faer::Mat;

pub use crate::body::ModalMatrix;
pub use damping::damping;
pub use pair::{combined_compliance, ModalPair};
pub use receptance::receptance;

/// Two bodies and the interface between them.
#[derive(Debug, Clone)]
pub struct ReducedModel {
    /// The grid both bodies share, with the gap.
    pub interface: Interface,
    /// The bodies that differ, in lower form.
    pub bodies: Vec<ReducedBody>,
    /// Index in `bodies` of the lower and of the upper body.
    pub place: [usize; 2],
    /// Both bodies together: W, its residual, the modes.
    pub pair: ModalPair,
}

/// What the finite elements give of a body, in lower form; damping comes from the job.
#[derive(Debug, Clone)]
pub struct BodyPart {
    /// Angular frequencies, rad/s, `[m]`.
    pub omega: Vec<f64>,
    /// Mass-normalised modes at the contact rows, 1/√kg, `[3n, m]`.
    pub contact_modes: Mat<f64>,
    /// Compliance of the contact rows, m/N, `[3n, 3n]`.
    pub compliance: Mat<f64>,
}

impl ReducedModel {
    /// The model of the job from the bodies that differ, `place` naming the lower and the upper one of `parts`.
    pub fn assemble(job: &Job, interface: Interface, mut parts: Vec<BodyPart>, mut place: Vec<usize>) -> Result<Self> {
        let missing = || Error::Defect("a body of the reduced model is missing on rank 0".into());
        let given = job.bodies();
        let mut reduced: Vec<ReducedBody> = Vec::new();
        for (i, (name, body)) in given.iter().enumerate() {
            let first = (0..i).find(|&j| place[j] == place[i]);
            // One body in two places is one still if it is damped alike.
            if let Some(first) = first.filter(|&j| given[j].1.damping == body.damping) {
                place[i] = first;
                continue;
            }
            let (omega, contact_modes, compliance) = match first {
                Some(first) => {
                    let b = reduced.get(first).ok_or_else(missing)?;
                    (b.omega.clone(), b.contact_modes.clone(), b.compliance.clone())
                }
                None => {
                    let part = parts.get_mut(place[i]).ok_or_else(missing)?;
                    let empty = BodyPart { omega: Vec::new(), contact_modes: Mat::new(), compliance: Mat::new() };
                    let part = std::mem::replace(part, empty);
                    (part.omega, part.contact_modes, part.compliance)
                }
            };
            let damping = damping(&body.damping, &omega, &format!("bodies.{name}.damping"))?;
            place[i] = reduced.len();
            reduced.push(ReducedBody::new(omega, damping, contact_modes, compliance));
        }
        let [lower, upper] = place[..] else { return Err(missing()) };
        Self::new(interface, reduced, [lower, upper])
    }

    /// Puts `bodies` together, `place` naming the lower and the upper one.
    pub fn new(interface: Interface, bodies: Vec<ReducedBody>, place: [usize; 2]) -> Result<Self> {
        let (Some(lower), Some(upper)) = (bodies.get(place[0]), bodies.get(place[1])) else {
            return Err(Error::Defect(format!("reduced model: bodies {place:?} of {}", bodies.len())));
        };
        let pair = ModalPair::new(lower, upper)?;
        Ok(Self { interface, bodies, place, pair })
    }
}

/// Interface and pair of a reduced model, on every rank.
#[derive(Debug, Clone)]
pub struct SharedModel {
    /// The grid both bodies share, with the gap.
    pub interface: Interface,
    /// Both bodies together.
    pub pair: ModalPair,
}

impl SharedModel {
    /// Collective: the model of rank 0 on every rank.
    pub fn broadcast(world: &World, root: Option<&ReducedModel>) -> Result<Self> {
        let list =
            |of: &dyn Fn(&Interface) -> Vec<f64>| world.broadcast(root.map(|m| of(&m.interface)).unwrap_or_default());
        let (x, y, gap) = (list(&|s| s.x.clone()), list(&|s| s.y.clone()), list(&|s| s.gap.clone()));
        let pair = ModalPair::broadcast(world, root.map(|m| &m.pair));
        let interface = world.agree(Interface::new(x, y, gap))?;
        Ok(Self { interface, pair })
    }
}

/// Collective: a matrix of rank 0 on every rank.
pub(crate) fn broadcast(world: &World, matrix: Option<&Mat<f64>>) -> Mat<f64> {
    let shape = world.broadcast(matrix.map_or(Vec::new(), |m| vec![m.nrows() as u64, m.ncols() as u64]));
    let values =
        matrix.map_or(Vec::new(), |m| m.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<f64>>()).collect());
    let values = world.broadcast(values);
    let [rows, columns] = [0, 1].map(|k| shape.get(k).map_or(0, |&n| n as usize));
    Mat::from_fn(rows, columns, |i, j| values[i + rows * j])
}
