//! The reduced model: what contact analyses need of the bodies, dense, made once for a run. Modes and compliance come from the
//! finite elements (or the compliance from half-spaces, which have no modes); everything after this works on it alone.

use super::bodies::Bodies;
use super::deferred;
use super::interface::{half_spaces, interface_of, near};
use crate::body::fe::BodyModes;
use crate::body::statics::Statics;
use crate::body::ReducedBody;
use crate::contact::{combined_compliance, Interface};
use crate::job::{self, Compliance, Job, LinearSolver, ModalDamping};
use crate::parallel::World;
use crate::progress::Progress;
use crate::transient::Model;
use crate::{Error, Result};
use faer::Mat;
use serde_json::{json, Value};

/// The reduced model on rank 0, nothing elsewhere.
pub struct Reduction {
    root: Option<ReducedModel>,
    /// True if the compliance is only near that of the finite elements, for steady rolling to correct by static solves.
    pub approximate: bool,
}

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

impl Reduction {
    /// Collective: the reduced model of the job's bodies with the `modes` of each of `Bodies::unique` (none of them, where
    /// the job asks for none: the compliance is then all there is).
    pub fn build(
        world: &World,
        job: &Job,
        contact: &job::Contact,
        bodies: &Bodies,
        modes: &[BodyModes],
        solvers: &mut [Statics],
        progress: &mut Progress,
    ) -> Result<Self> {
        let interface = world.on_root(|| interface_of(bodies))?;
        progress.stage("compliance of the contact");
        let mut parts = Vec::new();
        let approximate = by_products(job, contact);
        let mut probed = Vec::new();
        if approximate {
            for (body, solver) in bodies.unique.iter().zip(solvers) {
                probed.push(deferred::probe(world, body, solver)?);
            }
        } else if contact.compliance == Compliance::Fe {
            for (i, (body, solver)) in bodies.unique.iter().zip(solvers).enumerate() {
                let step = &mut |done, of| progress.step("contact rows", done, of);
                let compliance = body.compliance(world, solver, step)?;
                let shapes = match modes.get(i) {
                    Some(modes) => body.contact_modes(world, modes)?,
                    None => compliance.as_ref().map(|c| Mat::zeros(c.nrows(), 0)),
                };
                let omega = modes.get(i).map(|m| m.omega.clone()).unwrap_or_default();
                let part = |(compliance, contact_modes)| BodyPart { omega, contact_modes, compliance };
                parts.extend(compliance.zip(shapes).map(part));
            }
        }
        let root = world.on_root(|| {
            let interface = interface.ok_or_else(|| Error::Defect("no interface on rank 0".into()))?;
            let mut place: Vec<usize> = bodies.places.iter().map(|p| p.body).collect();
            if approximate || contact.compliance == Compliance::HalfSpace {
                let rigid = |compliance: Mat<f64>| BodyPart {
                    omega: Vec::new(),
                    contact_modes: Mat::zeros(compliance.nrows(), 0),
                    compliance,
                };
                let both = match approximate {
                    true => near(bodies, &interface, &probed)?,
                    false => half_spaces(bodies, &interface)?,
                };
                parts = both.map(rigid).into();
                place = vec![0, 1];
            }
            ReducedModel::assemble(job, interface, parts, place)
        })?;
        Ok(Self { root, approximate })
    }

    /// On rank 0: the reduction to `model`.
    pub fn of(model: ReducedModel) -> Self {
        Self { root: Some(model), approximate: false }
    }

    /// Elsewhere: no model.
    pub fn elsewhere() -> Self {
        Self { root: None, approximate: false }
    }

    /// The model; to be asked for on rank 0 only.
    pub fn root(&self) -> Result<&ReducedModel> {
        self.root.as_ref().ok_or_else(|| Error::Defect("the reduced model is on rank 0".into()))
    }

    /// The model on rank 0, `None` elsewhere.
    pub fn on_root(&self) -> Option<&ReducedModel> {
        self.root.as_ref()
    }
}

/// Whether the compliance of the bodies is left unmade: an iterative solver gives one displacement at a time, which is enough for
/// steady rolling where nothing else asks for the compliance.
fn by_products(job: &Job, contact: &job::Contact) -> bool {
    let analyses = &job.analyses;
    contact.compliance == Compliance::Fe
        && job.solver.linear == LinearSolver::Gamg
        && analyses.modes.is_none()
        && analyses.stability.is_none()
        && analyses.transient.is_none()
        && job.sweep.is_none()
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
            reduced.push(ReducedBody { omega, damping, contact_modes, compliance });
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
pub(super) fn broadcast(world: &World, matrix: Option<&Mat<f64>>) -> Mat<f64> {
    let shape = world.broadcast(matrix.map_or(Vec::new(), |m| vec![m.nrows() as u64, m.ncols() as u64]));
    let values =
        matrix.map_or(Vec::new(), |m| m.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<f64>>()).collect());
    let values = world.broadcast(values);
    let [rows, columns] = [0, 1].map(|k| shape.get(k).map_or(0, |&n| n as usize));
    Mat::from_fn(rows, columns, |i, j| values[i + rows * j])
}

/// What of a job its reduced model depends on, damping apart: two jobs with the same have the same modes and compliances.
pub fn fe_inputs(job: &Job) -> Value {
    let body = |b: &job::Body| {
        let mut fixed = b.fixed.clone();
        fixed.sort();
        let mut matrices = b.matrices.clone();
        // A factor costs nothing.
        matrices.iter_mut().for_each(|m| m.damping_factor = 1.0);
        json!({ "mesh": b.mesh, "material": b.material, "fixed": fixed, "matrices": matrices })
    };
    let contact = job.contact.as_ref();
    json!({
        "bodies": {
            "lower": job.bodies.lower.as_ref().map(body),
            "upper": job.bodies.upper.as_ref().map(body),
        },
        "contact": { "patch": contact.map(|c| c.patch), "compliance": contact.map(|c| c.compliance) },
        "analyses": { "modes": job.analyses.modes },
    })
}

/// Modal damping coefficients c_k of modes with the angular frequencies `omega` (rad/s), 1/s, `[m]`: α + β ω_k², or η_k ω_k with
/// loss factors η_k. `key` names the damping in messages.
pub fn damping(given: &job::Damping, omega: &[f64], key: &str) -> Result<Vec<f64>> {
    let factor = |k: usize, frequency: f64| -> Result<f64> {
        match &given.modal {
            Some(ModalDamping::ByMode(factors)) => Ok(factors.get(k).or(factors.last()).map_or(0.0, |f| f.0)),
            Some(ModalDamping::ByFrequency(bands)) => {
                match bands.iter().find(|b| b.up_to.is_none_or(|end| frequency <= end)) {
                    Some(band) => Ok(band.loss_factor.0),
                    None => Err(Error::Job(format!(
                        "{key}.modal.by_frequency: mode {} at {frequency:.1} Hz lies above the last band; \
                         raise its up_to, or leave it out for a band without end",
                        k + 1
                    ))),
                }
            }
            None => Ok(0.0),
        }
    };
    let coefficient = |(k, &w): (usize, &f64)| match given.modal {
        Some(_) => Ok(w * factor(k, w / (2.0 * std::f64::consts::PI))?),
        None => Ok(given.alpha + given.beta * w * w),
    };
    omega.iter().enumerate().map(coefficient).collect()
}

/// Two bodies on one interface: combined compliance and modes.
#[derive(Debug, Clone)]
pub struct ModalPair {
    /// W = C1 + E C2 E, m/N, `[3n, 3n]`.
    pub compliance: Mat<f64>,
    /// Residual S = W − Ψ Ω⁻² Ψᵀ, m/N, `[3n, 3n]`.
    pub residual: Mat<f64>,
    /// Ψ = [Φ1, E Φ2], 1/√kg, `[3n, m1 + m2]`.
    pub modes: Mat<f64>,
    /// Angular frequencies, rad/s, `[m1 + m2]`: the lower body's, then the upper one's.
    pub omega: Vec<f64>,
    /// Modal damping coefficients, 1/s, `[m1 + m2]`.
    pub damping: Vec<f64>,
    /// m1.
    pub lower_modes: usize,
    /// Damping between different modes, 1/s, `[m1 + m2, m1 + m2]` with a zero diagonal; only a damping matrix has it.
    pub coupling: Option<Mat<f64>>,
}

impl ModalPair {
    /// The pair on its `interface` as the transient takes it, without loads other than the contact's.
    pub fn in_time<'a>(&'a self, interface: &'a Interface) -> Model<'a> {
        let (residual, modes) = (self.residual.as_ref(), self.modes.as_ref());
        Model { interface, residual, modes, omega: &self.omega, damping: &self.damping, load: &[] }
    }

    /// Combines the lower and the upper body (both in lower form). Rigid-body modes (ω = 0) have no part in the compliance.
    pub fn new(lower: &ReducedBody, upper: &ReducedBody) -> Result<Self> {
        for (name, b) in [("lower", lower), ("upper", upper)] {
            let m = b.omega.len();
            if b.damping.len() != m || b.contact_modes.ncols() != m || b.contact_modes.nrows() != b.compliance.nrows() {
                return Err(Error::Defect(format!(
                    "reduced {name} body: {m} frequencies, {} damping coefficients, contact modes {:?}, compliance {:?}",
                    b.damping.len(),
                    b.contact_modes.shape(),
                    b.compliance.shape()
                )));
            }
        }
        let compliance = combined_compliance(lower.compliance.as_ref(), upper.compliance.as_ref())?;
        let (rows, m1, m2) = (compliance.nrows(), lower.omega.len(), upper.omega.len());
        let modes = Mat::from_fn(rows, m1 + m2, |i, k| {
            if k < m1 {
                lower.contact_modes[(i, k)]
            } else {
                let v = upper.contact_modes[(i, k - m1)];
                if i % 3 == 2 {
                    v
                } else {
                    -v
                }
            }
        });
        let omega: Vec<f64> = lower.omega.iter().chain(&upper.omega).copied().collect();
        let damping = lower.damping.iter().chain(&upper.damping).copied().collect();
        let scaled = Mat::from_fn(rows, m1 + m2, |i, k| if omega[k] > 0.0 { modes[(i, k)] / omega[k] } else { 0.0 });
        let residual = &compliance - &scaled * scaled.transpose();
        Ok(Self { compliance, residual, modes, omega, damping, lower_modes: m1, coupling: None })
    }

    /// Collective: the pair of rank 0 on every rank; a damping between different modes stays behind.
    pub fn broadcast(world: &World, root: Option<&ModalPair>) -> Self {
        let list = |of: &dyn Fn(&ModalPair) -> Vec<f64>| world.broadcast(root.map(of).unwrap_or_default());
        Self {
            compliance: broadcast(world, root.map(|p| &p.compliance)),
            residual: broadcast(world, root.map(|p| &p.residual)),
            modes: broadcast(world, root.map(|p| &p.modes)),
            omega: list(&|p| p.omega.clone()),
            damping: list(&|p| p.damping.clone()),
            coupling: None,
            lower_modes: list(&|p| vec![p.lower_modes as f64]).first().map_or(0, |&n| n as usize),
        }
    }

    /// Takes the modal damping matrices ΦᵀCΦ of the bodies, 1/s, `[m1, m1]` and `[m2, m2]`, where there are any.
    pub fn set_damping(&mut self, lower: Option<&Mat<f64>>, upper: Option<&Mat<f64>>) {
        let m = self.omega.len();
        let mut coupling = Mat::zeros(m, m);
        for (first, matrix) in [(0, lower), (self.lower_modes, upper)] {
            let Some(c) = matrix else { continue };
            for j in 0..c.ncols() {
                for i in 0..c.nrows() {
                    if i == j {
                        self.damping[first + i] = c[(i, i)];
                    } else {
                        coupling[(first + i, first + j)] = c[(i, j)];
                    }
                }
            }
        }
        self.coupling = Some(coupling);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{DampingBand, LossFactor};

    fn modal(modal: ModalDamping) -> job::Damping {
        job::Damping { modal: Some(modal), ..Default::default() }
    }

    #[test]
    fn damping_is_rayleigh_or_by_loss_factors() {
        let omega = [0.0, 100.0, 1000.0, 1e4];
        let rayleigh = job::Damping { alpha: 2.0, beta: 1e-6, modal: None };
        assert_eq!(damping(&rayleigh, &omega, "d").unwrap(), [2.0, 2.01, 3.0, 102.0]);
        let by_mode = modal(ModalDamping::ByMode(vec![LossFactor(0.5), LossFactor(0.01), LossFactor(0.002)]));
        assert_eq!(damping(&by_mode, &omega, "d").unwrap(), [0.0, 1.0, 2.0, 20.0]);
        let band = |up_to: Option<f64>, eta: f64| DampingBand { up_to, loss_factor: LossFactor(eta) };
        let end = 1000.0 / (2.0 * std::f64::consts::PI);
        let bands = modal(ModalDamping::ByFrequency(vec![band(Some(end), 0.01), band(None, 0.001)]));
        assert_eq!(damping(&bands, &omega, "d").unwrap(), [0.0, 1.0, 10.0, 10.0]);
        let short = modal(ModalDamping::ByFrequency(vec![band(Some(end), 0.01)]));
        let error = damping(&short, &omega, "bodies.lower.damping").unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.message().contains("bodies.lower.damping.modal.by_frequency: mode 4 at 1591.5 Hz"), "{error}");
    }
}
