//! The reduced model: what contact analyses need of the two bodies and of the interface between them, dense, made
//! once for a run.

mod carried;
mod damping;
mod low_rank_compliance;
mod measured;
mod owners;
mod pair;
mod placed;
mod receptance;
mod rotating;

use crate::body::{ReducedBody, Side};
use crate::grid::{ContactPatch, Interface, TurningPoints};
use crate::job::{self, Job};
use crate::parallel::World;
use crate::{Error, Result};
use faer::Mat;
use owners::{owners, Owner};

pub use crate::body::convolution::Product;
pub use crate::body::half_space::HalfSpace;
pub use crate::body::hybrid::{ContactFunctions, Lines, LOADS};
pub use crate::body::near_contacts::NearPair;
pub use crate::body::rotation::{ModalRotation, RotationTerms};
pub use crate::body::{Convolution, ModalBlock, ModalMatrix, ModeLabel, TraceModes};
pub use damping::{damping, IntrinsicDamping};
pub use measured::{measure, shifts};
pub use owners::speeds;
pub use pair::{combined_compliance, CoupledModel, ModeFactors};
pub use placed::PlacedModel;
pub use receptance::receptance;
pub use rotating::{travelling, turning, waves, ModalDynamics, RotatingWave};

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
    pub pair: CoupledModel,
    /// Intrinsic damping of the lower and the upper body.
    pub own: [IntrinsicDamping; 2],
    /// Contribution of rotation to the lower and to the upper body, where they were made for it.
    pub rotation: [Option<ModalRotation>; 2],
    /// The compliances of `bodies` at rest, where these rotate, m/N, `[3n, 3n]`.
    pub at_rest: Vec<Option<Mat<f64>>>,
}

/// Contact trace of a body, in lower form.
#[derive(Debug, Clone)]
pub struct ContactTrace {
    /// Its modes at the contact rows.
    pub modes: TraceModes,
    /// Compliance of the contact rows, m/N, `[3n, 3n]`.
    pub compliance: Mat<f64>,
}

impl ContactTrace {
    /// A compliance without modes.
    pub fn statics(compliance: Mat<f64>) -> Self {
        let rows = Some(Mat::zeros(compliance.nrows(), 0));
        Self { modes: TraceModes { rows, ..TraceModes::default() }, compliance }
    }
}

impl ReducedModel {
    /// The model of the job from the bodies that differ, `place` naming the lower and the upper one of `parts`.
    pub fn assemble(job: &Job, interface: Interface, parts: Vec<ContactTrace>, place: [usize; 2]) -> Result<Self> {
        let missing = || Error::Defect("a body of the reduced model is missing on rank 0".into());
        let given = given(job);
        // One body in two places is one still if it is damped alike.
        let alike = place[0] == place[1]
            && given[0].map(|b| (&b.damping, b.rotation)) == given[1].map(|b| (&b.damping, b.rotation));
        let twice = place[0] == place[1] && !alike;
        let mut parts: Vec<Option<ContactTrace>> = parts.into_iter().map(Some).collect();
        let (mut bodies, mut at_rest) = (Vec::new(), Vec::new());
        let (mut own, mut rotation) = ([IntrinsicDamping::default(), IntrinsicDamping::default()], [None, None]);
        // Of several contacts the matrices are large; files keep those of one, and those that a transient goes on with.
        let wanted = job.analyses.transient.is_some() || job.analyses.receptance.is_some();
        let keeps = interface.patches.len() == 1 || wanted;
        for side in Side::BOTH.into_iter().take(if alike { 1 } else { 2 }) {
            let part = parts.get_mut(place[side.index()]).ok_or_else(missing)?;
            let part = if twice && side == Side::Lower { part.clone() } else { part.take() };
            let ContactTrace { modes, mut compliance } = part.ok_or_else(missing)?;
            if let Some(change) = modes.rows.as_ref().and_then(|rows| measured::change(&modes, rows)) {
                compliance += change;
            }
            own[side.index()] =
                IntrinsicDamping { matrix: modes.damping.map(ModalMatrix::from), springs: modes.springs };
            let names = modes.names;
            let damping = damping_of(job, side, (&modes.omega, &names), &own[side.index()])?;
            let rows = modes.rows.ok_or_else(missing)?;
            let speeds = speeds(job, side, &names, modes.omega.len());
            let body =
                ReducedBody { reach: modes.reach, names, ..ReducedBody::new(modes.omega, damping, rows, compliance) };
            rotation[side.index()] = modes.rotation;
            let rest = rotation[side.index()].as_ref().filter(|_| keeps).map(|_| body.compliance.clone());
            bodies.push(match &rotation[side.index()] {
                Some(rotation) => turning(body, rotation, &speeds),
                None => body,
            });
            at_rest.push(rest);
        }
        if alike {
            own[1] = own[0].clone();
            rotation[1] = rotation[0].clone();
        }
        let place = [0, if alike { 0 } else { 1 }];
        let mut model = Self { own, rotation, at_rest, ..Self::new(interface, bodies, place)? };
        carry(&mut model.pair, job, &model.interface, &model.rotation);
        if !keeps {
            model.bodies.iter_mut().for_each(|body| body.compliance = Mat::zeros(0, 0));
        }
        if job.is_loaded() {
            let half_space = |body: Option<&job::Body>| -> Result<HalfSpace> {
                let m = body.ok_or_else(missing)?.elastic()?;
                Ok(HalfSpace { young: m.young, poisson: m.poisson })
            };
            let [lower, upper] = given.map(half_space);
            model.pair.local = Some(local(&model.interface, [lower?, upper?])?);
        }
        Ok(model)
    }

    /// Half-spaces with the influence `convolution` on the grid of the `interface`; no matrix is made.
    pub(crate) fn of_half_spaces(interface: Interface, convolution: Convolution) -> Result<Self> {
        let nothing = || ReducedBody::new(Vec::new(), Vec::new(), Mat::zeros(0, 0), Mat::zeros(0, 0));
        let mut model = Self::new(interface, vec![nothing(), nothing()], [0, 1])?;
        model.pair.convolution = Some(convolution);
        Ok(model)
    }

    /// Puts `bodies` together, `place` naming the lower and the upper one.
    pub fn new(interface: Interface, bodies: Vec<ReducedBody>, place: [usize; 2]) -> Result<Self> {
        let (Some(lower), Some(upper)) = (bodies.get(place[0]), bodies.get(place[1])) else {
            return Err(Error::Defect(format!("reduced model: bodies {place:?} of {}", bodies.len())));
        };
        let pair = CoupledModel::new(lower, upper)?;
        let at_rest = vec![None; bodies.len()];
        Ok(Self { interface, bodies, place, pair, own: Default::default(), rotation: [None, None], at_rest })
    }

    /// Gives both bodies the rotation that they have in `job`, the same job at another angular speed. Where a state of
    /// rest does not see W it stays that of before, as in [`SharedModel::pair`].
    pub(crate) fn turn(&mut self, job: &Job) -> Result<()> {
        if self.rotation.iter().all(Option::is_none) {
            return Ok(());
        }
        let changed = adapt(&mut self.pair, job, (&self.own, &self.rotation), &mut Default::default())?;
        if changed && self.pair.local.is_none() {
            self.pair.renew_compliance();
        }
        carry(&mut self.pair, job, &self.interface, &self.rotation);
        Ok(())
    }

    /// Both bodies with the damping and the rotation of another `job` on them.
    pub fn pair_of(&self, job: &Job) -> Result<CoupledModel> {
        let mut pair = self.pair.clone();
        if adapt(&mut pair, job, (&self.own, &self.rotation), &mut Default::default())? {
            pair.renew_compliance();
        }
        carry(&mut pair, job, &self.interface, &self.rotation);
        Ok(pair)
    }
}

/// Influence of each patch of half-spaces on itself, m/N, `[3n, 3n]`; patches have none on each other.
fn local(interface: &Interface, [lower, upper]: [HalfSpace; 2]) -> Result<Mat<f64>> {
    let own = |patch: &ContactPatch| {
        let [lower, upper] = [lower, upper].map(|half_space| half_space.compliance(&patch.x, &patch.y));
        combined_compliance(lower?.as_ref(), upper?.as_ref())
    };
    if let Some(patch) = interface.only() {
        return own(patch);
    }
    let mut all = Mat::zeros(3 * interface.len(), 3 * interface.len());
    for patch in &interface.patches {
        let (first, rows) = (3 * patch.first, 3 * patch.len());
        all.as_mut().submatrix_mut(first, first, rows, rows).copy_from(own(patch)?);
    }
    Ok(all)
}

/// The bodies of a job, lower first.
fn given(job: &Job) -> [Option<&job::Body>; 2] {
    [job.bodies.lower.as_ref(), job.bodies.upper.as_ref()]
}

/// Damping of modes with the angular frequencies `omega`, rad/s, and the names, where they are known, of the body on
/// a side of `job`: by the coefficients that the job gives, beside its `own`, which a body by matrices, a rail and
/// supports bring; none of a body that the job does not give.
fn damping_of(
    job: &Job,
    side: Side,
    (omega, names): (&[f64], &[ModeLabel]),
    own: &IntrinsicDamping,
) -> Result<ModalMatrix> {
    let Some(body) = given(job)[side.index()] else { return Ok(vec![0.0; omega.len()].into()) };
    let mut modal = vec![0.0; omega.len()];
    for Owner { key, body, modes } in owners(job, side, names, omega.len()) {
        let of = |list: &[f64]| modes.iter().filter_map(|&k| list.get(k).copied()).collect::<Vec<f64>>();
        let named: Vec<ModeLabel> = modes.iter().filter_map(|&k| names.get(k).cloned()).collect();
        let found = damping(&body.damping, (&of(omega), &named), &of(&own.springs), &format!("bodies.{key}.damping"))?;
        modes.iter().zip(found).for_each(|(&k, coefficient)| modal[k] = coefficient);
    }
    let by_matrix = |k: usize| own.matrix.as_ref().map_or(0.0, |own| body.damping_factor() * own.get(k, k));
    measured::damp(body, (omega, names), &by_matrix, &mut modal);
    Ok(match &own.matrix {
        Some(own) => own.scaled(body.damping_factor()).with_diagonal(&modal),
        None => modal.into(),
    })
}

/// The bodies on a side of `job`, each with its angular velocity, rad/s: all that the equations of motion of its modes
/// hang on.
fn on_side(job: &Job, side: Side) -> Vec<(&job::Body, f64)> {
    let others = job.bodies.others.values().filter(|_| side == Side::Upper);
    given(job)[side.index()].into_iter().chain(others).map(|body| (body, job.angular_velocity_of(body))).collect()
}

/// Part of a reduced model that stays when damping changes, on every rank.
#[derive(Debug, Clone)]
pub struct SharedModel {
    /// The grid or the points, with the gap.
    pub interface: Interface,
    pair: CoupledModel,
    own: [IntrinsicDamping; 2],
    rotation: [Option<ModalRotation>; 2],
    /// Equations of motion of the last job.
    last: LastDynamics,
}

/// Equations of motion of the lower and the upper body of the last job, each with what they were made of: the bodies of
/// the job on this side and their angular velocities, rad/s.
type LastDynamics = [Option<(Vec<(job::Body, f64)>, ModalDynamics)>; 2];

impl SharedModel {
    /// Collective: the model of rank 0 on every rank.
    pub fn broadcast(world: &World, root: Option<&ReducedModel>) -> Result<Self> {
        let interface = shared(world, root.map(|m| &m.interface))?;
        let own = [0, 1].map(|place| IntrinsicDamping::broadcast(world, root.map(|m| &m.own[place])));
        let rotation = [0, 1].map(|place| {
            let of = |f: fn(&ModalRotation) -> &Mat<f64>| {
                broadcast(world, root.and_then(|m| m.rotation[place].as_ref()).map(f))
            };
            let (gyroscopic, stiffness) = (of(|r| &r.gyroscopic), of(|r| &r.stiffness));
            let derivative = of(|r| &r.derivative);
            (gyroscopic.nrows() > 0).then_some(ModalRotation { gyroscopic, stiffness, derivative })
        });
        let pair = CoupledModel::broadcast(world, root.map(|m| &m.pair));
        Ok(Self { interface, pair, own, rotation, last: Default::default() })
    }

    /// Number of modes of the lower body.
    pub fn lower_modes(&self) -> usize {
        self.pair.lower_modes
    }

    /// Makes W as [`Self::pair`] makes it, so that it is the same to the last bit whether or not another job came
    /// before.
    pub fn renew(&mut self) {
        if self.pair.local.is_none() && self.rotation.iter().any(Option::is_some) {
            self.pair.renew_compliance();
        }
    }

    /// Equations of motion of the modes with the damping and the rotation of `job`.
    pub fn dynamics(&self, job: &Job) -> Result<ModalDynamics> {
        let (lower, upper) = self.pair.omega.split_at(self.pair.lower_modes);
        let [lower, upper] = [(Side::Lower, lower), (Side::Upper, upper)].map(|(side, omega)| {
            let k = side.index();
            dynamics_of(job, side, (omega, &self.pair.names[k]), (&self.own[k], self.rotation[k].as_ref()))
        });
        Ok(ModalDynamics::joined(&lower?, &upper?))
    }

    /// Both bodies with the damping and the rotation of `job`. Where a state of rest does not see W it stays that of
    /// before: stability has no use for it, and it takes longer than all else here.
    pub fn pair(&mut self, job: &Job) -> Result<&CoupledModel> {
        let changed = adapt(&mut self.pair, job, (&self.own, &self.rotation), &mut self.last)?;
        if changed && self.pair.local.is_none() {
            self.pair.renew_compliance();
        }
        carry(&mut self.pair, job, &self.interface, &self.rotation);
        Ok(&self.pair)
    }
}

/// Gives `pair` the damping and the rotation of `job`; `own` and `rotation` are what the bodies bring for them. A body
/// that is as in the `last` job keeps its equations of motion. Returns true if W changes by that.
fn adapt(
    pair: &mut CoupledModel,
    job: &Job,
    (own, rotation): (&[IntrinsicDamping; 2], &[Option<ModalRotation>; 2]),
    last: &mut LastDynamics,
) -> Result<bool> {
    let (lower, upper) = pair.omega.split_at(pair.lower_modes);
    for (side, omega) in [(Side::Lower, lower), (Side::Upper, upper)] {
        let k = side.index();
        let bodies = on_side(job, side);
        let same = |known: &[(job::Body, f64)]| known.iter().map(|(body, speed)| (body, *speed)).eq(bodies.clone());
        if last[k].as_ref().is_some_and(|(known, _)| same(known)) {
            continue;
        }
        let found = dynamics_of(job, side, (omega, &pair.names[k]), (&own[k], rotation[k].as_ref()))?;
        last[k] = Some((bodies.into_iter().map(|(body, speed)| (body.clone(), speed)).collect(), found));
    }
    let [Some((_, lower)), Some((_, upper))] = &*last else {
        return Err(Error::Defect("a body without equations of motion".into()));
    };
    let joined = ModalDynamics::joined(lower, upper);
    let changed = rotation.iter().any(Option::is_some) && joined.stiffness != pair.stiffness;
    (pair.stiffness, pair.damping, pair.turning) = (joined.stiffness, joined.damping, joined.turning);
    Ok(changed)
}

/// Gives `pair` the rates at which its lower body turns under the upper one on the `interface` in `job`.
fn carry(pair: &mut CoupledModel, job: &Job, interface: &Interface, rotation: &[Option<ModalRotation>; 2]) {
    pair.carried = carried::carried(interface, pair, rotation[0].as_ref(), job.angular_velocity(Side::Lower.name()));
}

/// Equations of motion of the modes of the body on a side of `job`, see [`damping_of`], with its `rotation` for the
/// unit of angular velocity, where it rotates.
fn dynamics_of(
    job: &Job,
    side: Side,
    modes: (&[f64], &[ModeLabel]),
    (own, rotation): (&IntrinsicDamping, Option<&ModalRotation>),
) -> Result<ModalDynamics> {
    let damping = damping_of(job, side, modes, own)?;
    let speeds = speeds(job, side, modes.1, modes.0.len());
    Ok(ModalDynamics::new(modes.0, damping, rotation.map(|r| (r, &speeds[..]))))
}

/// Collective: the interface of rank 0 on every rank.
pub fn shared(world: &World, root: Option<&Interface>) -> Result<Interface> {
    let list = |of: &dyn Fn(&Interface) -> Vec<f64>| world.broadcast(root.map(of).unwrap_or_default());
    let lines =
        |of: &dyn Fn(&ContactPatch) -> &Vec<f64>| list(&|s| s.patches.iter().flat_map(|p| of(p).clone()).collect());
    let (x, y, gap) = (lines(&|p| &p.x), lines(&|p| &p.y), list(&|s| s.gap.clone()));
    let shape = |s: &Interface| s.patches.iter().flat_map(|p| [p.x.len() as u64, p.y.len() as u64]).collect();
    let shape: Vec<u64> = world.broadcast(root.map(shape).unwrap_or_default());
    let creep = list(&|s| match s.are_points() {
        true => (0..s.len()).flat_map(|i| s.creep(i)).collect(),
        false => Vec::new(),
    });
    let axle = list(&|s| (0..s.len()).filter_map(|i| s.axle(i)).collect());
    let weight = if axle.is_empty() { Vec::new() } else { list(&|s| s.weight.clone()) };
    let pairs = |all: &[f64]| all.chunks_exact(2).map(|c| [c[0], c[1]]).collect::<Vec<[f64; 2]>>();
    let interface = match creep.is_empty() {
        true => {
            let [mut x, mut y, mut gap] = [x, y, gap].map(Vec::into_iter);
            let take = |of: &mut std::vec::IntoIter<f64>, n: usize| of.by_ref().take(n).collect::<Vec<f64>>();
            let part = |n: &[u64]| {
                let [nx, ny] = [n[0] as usize, n[1] as usize];
                Interface::new(take(&mut x, nx), take(&mut y, ny), take(&mut gap, nx * ny))
            };
            shape.chunks_exact(2).map(part).collect::<Result<Vec<_>>>().and_then(Interface::joined)
        }
        false if axle.is_empty() => Interface::points(gap, pairs(&creep)),
        false => {
            let mut first = 0;
            let part = |n: &[u64]| {
                let nodes = first..first + (n[0] * n[1]) as usize;
                first = nodes.end;
                Interface::turning(TurningPoints {
                    area: weight[nodes.clone()].to_vec(),
                    creep: pairs(&creep[2 * nodes.start..2 * nodes.end]),
                    axle: axle[nodes].to_vec(),
                })
            };
            shape.chunks_exact(2).map(part).collect::<Result<Vec<_>>>().and_then(Interface::joined)
        }
    };
    world.agree(interface)
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
