//! Jobs whose bodies are given by matrices: reduction, modes and stability, without a mesh.

use super::report::Summary;
use super::run::Run;
use super::sweep::{self, Base};
use super::{full_stability, memory, modes::method, stability};
use crate::body::matrices::{reduce, Matrices, Reduced, SignedRow};
use crate::body::modes::Extent;
use crate::body::{ModalMatrix, ReducedBody};
use crate::contact::{LinearContact, LinearMemory, LinearNode, Slip, Tangent};
use crate::friction::FrictionLaw;
use crate::job::{self, Job, ModesExtent};
use crate::model::{broadcast, ModalPair};
use crate::output::datasets::stability::eigenvalues;
use crate::output::{sha256, Table};
use crate::parallel::World;
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::stability::reduced::sharpness;
use crate::stability::{dense, spectrum};
use crate::{Error, Result};
use faer::Mat;

/// A body on rank 0: its name, its matrices and their reduction.
pub(super) struct MatrixBody {
    name: &'static str,
    matrices: Matrices,
    reduced: Reduced,
}

/// The bodies of a job together, as sweeps share them.
#[derive(Debug, Clone)]
pub struct MatrixModel {
    /// Both bodies, undamped where the damping comes from a matrix.
    pair: ModalPair,
    /// ΦᵀCΦ of the lower and of the upper body, 1/s.
    damping: [Option<Mat<f64>>; 2],
    /// Frequency up to which the modes of all bodies are known, Hz.
    pub(super) reach: f64,
}

impl MatrixModel {
    /// On rank 0.
    fn new(bodies: &[MatrixBody]) -> Result<Self> {
        let of = |place: &str| bodies.iter().find(|b| b.name == place).map(|b| &b.reduced);
        let rigid = rigid(bodies.first().map_or(0, |b| b.matrices.contacts.len()));
        let body = |place: &str| of(place).map_or(&rigid, |found| &found.body);
        let pair = ModalPair::new(body("lower"), body("upper"))?;
        // A body of which all modes are kept sets no limit.
        let reach = bodies.iter().map(|b| b.reduced.reach()).fold(f64::INFINITY, f64::min);
        Ok(Self { pair, damping: ["lower", "upper"].map(|p| of(p).and_then(|b| b.damping.clone())), reach })
    }

    /// Collective: the model of the bodies of rank 0 on every rank.
    pub(super) fn shared(world: &World, bodies: &[MatrixBody]) -> Result<Self> {
        let root = world.on_root(|| Self::new(bodies))?;
        let root = root.as_ref();
        let damping = [0, 1].map(|p| {
            let matrix = broadcast(world, root.and_then(|m| m.damping[p].as_ref()));
            (matrix.nrows() > 0).then_some(matrix)
        });
        let reach = world.broadcast(root.map_or(Vec::new(), |m| vec![m.reach]));
        let reach = reach.first().copied().unwrap_or(0.0);
        Ok(Self { pair: ModalPair::broadcast(world, root.map(|m| &m.pair)), damping, reach })
    }

    /// Both bodies with the damping of `job`.
    pub(super) fn pair(&self, job: &Job) -> ModalPair {
        let scaled = |place: usize, body: &Option<job::Body>| {
            let factor = body.as_ref().and_then(|b| b.matrices.as_ref()).map_or(1.0, |m| m.damping_factor);
            self.damping[place].as_ref().map(|c| faer::Scale(factor) * c)
        };
        let (lower, upper) = (scaled(0, &job.bodies.lower), scaled(1, &job.bodies.upper));
        let mut pair = self.pair.clone();
        let none = |m: usize| ModalMatrix::from(vec![0.0; m]);
        let (m1, m) = (pair.lower_modes, pair.omega.len());
        let of = |c: Option<Mat<f64>>, m: usize| c.map_or_else(|| none(m), ModalMatrix::from);
        pair.damping = of(lower, m1).joined(&of(upper, m - m1));
        pair
    }
}

/// Collective: the analyses of the job. Reading a job makes sure that these are modes, and stability with contact points and sweeps of it.
pub fn run(run: &mut Run) -> Result<()> {
    let world = run.world();
    let bodies = reduce_all(run.petsc, run.job, run.progress, &mut run.summary);
    let own = match &bodies {
        Ok(bodies) => itself(run, bodies),
        Err(e) => Err(e.clone()),
    };
    match &run.job.sweep {
        Some(plan) if own.as_ref().err().is_none_or(sweep::goes_on) => {
            let base = bodies.and_then(|bodies| MatrixModel::shared(world, &bodies)).ok();
            let base = base.as_ref().map(Base::Matrices);
            sweep::run(run, plan, base, own.as_ref().err())
        }
        _ => own,
    }
}

/// Collective: the bodies of `job`, reduced; on rank 0.
pub(super) fn reduce_all(
    petsc: &Petsc,
    job: &Job,
    progress: &mut Progress,
    summary: &mut Summary,
) -> Result<Vec<MatrixBody>> {
    let world = petsc.world();
    let Some(modes) = &job.analyses.modes else { return Ok(Vec::new()) };
    let extent = match modes.extent() {
        ModesExtent::Count(n) => Extent::Count(n),
        ModesExtent::MaxFrequency(f) => Extent::MaxFrequency(f),
    };
    let mut bodies = Vec::new();
    for (name, body) in job.bodies() {
        progress.stage(format!("matrices of body {name}"));
        let matrices = world.on_root(|| read(name, body))?;
        if let Some(m) = &matrices {
            summary.line(format!("body {name}: {} degrees of freedom, {} contacts", m.stiffness.n, m.contacts.len()));
        }
        progress.stage(format!("modes, body {name}"));
        let step = &mut |done, of| progress.step("modes", done, of);
        let reduced = reduce(petsc, name, matrices.as_ref(), extent, method(job), step)?;
        bodies.extend(matrices.zip(reduced).map(|(matrices, reduced)| MatrixBody { name, matrices, reduced }));
    }
    Ok(bodies)
}

/// Collective: modes and stability of the job itself.
fn itself(run: &mut Run, bodies: &[MatrixBody]) -> Result<()> {
    let (world, job) = (run.world(), run.job);
    for MatrixBody { name, reduced, .. } in bodies {
        let frequency: Vec<f64> = reduced.body.omega.iter().map(|w| w / (2.0 * std::f64::consts::PI)).collect();
        let listed: Vec<String> = frequency.iter().take(6).map(|f| format!("{f:.2}")).collect();
        run.summary.value(&format!("modes of {name}"), format!("{}; Hz: {} ...", frequency.len(), listed.join(", ")));
        let text = "Frequencies of the free-interface modes, ascending; 0 is a rigid-body mode.";
        run.file.table(Table::list(&format!("/modes/{name}/frequency"), "Hz", text, frequency));
    }
    let (Some(wanted), Some(contact)) = (&job.analyses.stability, &job.contact) else { return Ok(()) };
    run.progress.stage("stability of steady sliding");
    let found = world.on_root(|| {
        let model = MatrixModel::new(bodies)?;
        let pair = model.pair(job);
        let sliding = sound(contact, &pair)?;
        let spectrum = spectrum(wanted, &pair, &sliding, model.reach)?;
        let damped: Vec<Matrices> = bodies.iter().map(|b| b.damped(job)).collect();
        let place = |name: &str| {
            let at = bodies.iter().position(|b| b.name == name)?;
            Some((&damped[at], &bodies[at].reduced))
        };
        let full = match &wanted.full {
            Some(full) => Some(dense::run(full, ["lower", "upper"].map(place), &sliding, &pair, &spectrum)?),
            None => None,
        };
        let smallest = memory::smallest(&contact.friction, |law| sharpness(&pair, &self::sliding(contact, law)?))?;
        Ok((pair, spectrum, full, smallest))
    })?;
    if let Some((pair, spectrum, full, smallest)) = &found {
        run.file.tables(eigenvalues(spectrum, pair, full.as_ref()));
        stability::summarise(spectrum, "sliding", pair, &mut run.summary);
        memory::say(&contact.friction, *smallest, &mut run.file, &mut run.summary);
        if let Some(full) = full {
            full_stability::summarise(full, &mut run.summary);
        }
    }
    Ok(())
}

impl MatrixBody {
    /// The matrices with the damping factor of `job`.
    fn damped(&self, job: &Job) -> Matrices {
        let mut matrices = self.matrices.clone();
        let given = job.bodies().into_iter().find(|(name, _)| *name == self.name);
        let factor = given.and_then(|(_, b)| b.matrices.as_ref()).map_or(1.0, |m| m.damping_factor);
        for c in matrices.damping.iter_mut() {
            c.values.iter_mut().for_each(|v| *v *= factor);
        }
        matrices
    }
}

/// On rank 0: name and checksum of every matrix file.
pub fn checksums(job: &Job) -> Result<Vec<(String, String)>> {
    let given = job.bodies().into_iter().filter_map(|(_, body)| body.matrices.as_ref());
    let files = given.flat_map(|m| [Some(&m.mass), m.damping.as_ref(), Some(&m.stiffness)]).flatten();
    files.map(|path| Ok((path.display().to_string(), sha256(path)?))).collect()
}

/// On rank 0: the matrices of a body.
fn read(name: &str, body: &job::Body) -> Result<Matrices> {
    let Some(given) = &body.matrices else {
        return Err(Error::Defect(format!("body {name} has no matrices")));
    };
    let signed = |row: i64| -> SignedRow {
        (row != 0).then(|| (row.unsigned_abs() as usize - 1, if row < 0 { -1.0 } else { 1.0 }))
    };
    let rows = |c: &job::MatrixContact| {
        let along = |k: usize| c.tangential.get(k).and_then(|&row| signed(row));
        [along(0), along(1), signed(c.normal)]
    };
    let contacts = given.contacts.iter().map(rows).collect();
    Matrices::read(name, &given.mass, given.damping.as_deref(), &given.stiffness, contacts)
}

/// A body that does not move.
fn rigid(contacts: usize) -> ReducedBody {
    ReducedBody::new(Vec::new(), Vec::new(), Mat::zeros(3 * contacts, 0), Mat::zeros(3 * contacts, 3 * contacts))
}

/// The sliding contact that the points of the job describe, refused where the memory of its friction is too short for the bodies.
pub(super) fn sound(contact: &job::Contact, pair: &ModalPair) -> Result<LinearContact> {
    memory::refuse_short(&contact.friction, |law| sharpness(pair, &sliding(contact, law)?))?;
    sliding(contact, &contact.friction)
}

/// The sliding contact that the points of the job describe, with the friction `law`.
fn sliding(contact: &job::Contact, law: &FrictionLaw) -> Result<LinearContact> {
    let Some(points) = &contact.points else {
        return Err(Error::Defect("bodies given by matrices without contact points".into()));
    };
    let node = |(node, p): (usize, &job::ContactPoint)| {
        let d = [p.direction.first().copied().unwrap_or(0.0), p.direction.get(1).copied().unwrap_or(0.0)];
        let norm = d[0].hypot(d[1]);
        // A law that depends on the velocity is taken at rest where none is given, and does not fall there; without a force neither matters.
        let (v, force) = (p.slip_velocity.unwrap_or(0.0), p.force.unwrap_or(0.0));
        let slip = Slip::steady(force, d.map(|d| d / norm), v, law.coefficient(v), 0.0);
        let memory = (v * force > 0.0).then(|| LinearMemory::at_a_point(law, node, slip.direction, force, v)).flatten();
        (LinearNode { node, tangent: Tangent::Slip(slip), convection: Vec::new() }, memory)
    };
    let (nodes, memory): (Vec<_>, Vec<_>) = points.iter().enumerate().map(node).unzip();
    Ok(LinearContact { nodes, memory: memory.into_iter().flatten().collect(), ..LinearContact::default() })
}
