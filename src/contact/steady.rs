//! Steady rolling: pressure and traction that satisfy the laws of Signorini and Coulomb with ∂/∂t = 0, solved directly.

use super::candidates::Candidates;
use super::influence::Influence;
use super::interface::{PatchKinematics, Stencil, Upstream};
use super::law::{size, Augmentation, LinearContact, LinearNode, Node, Slip, Status, Tangent};
use super::loads::{Loads, NormalLoad};
use super::memory::{self, coefficients, SlidingNode};
use super::newton::{self, NewtonEffort, StressState};
use super::patch::refuse_border;
use super::start::{self, InitialGuess};
use crate::friction::{FrictionLaw, PatchFriction};
use crate::grid::{ContactPatch, Interface};
use crate::{Error, Result};

mod by_loads;
mod resultant;
pub use resultant::PatchResultant;

/// A steady rolling contact problem on an interface of n nodes.
///
/// ```
/// use railsqueal::body::half_space::HalfSpace;
/// use railsqueal::contact::{ContactCreepage, NormalLoad, PatchKinematics, SteadyProblem, Stencil};
/// use railsqueal::friction::FrictionLaw;
/// use railsqueal::grid::Interface;
/// use railsqueal::model::combined_compliance;
///
/// let steel = HalfSpace { young: 210e9, poisson: 0.3 };
/// let interface = Interface::paraboloid(15, 15, [7e-3, 7e-3], [4.0, 4.0])?;
/// let patch = &interface.patches[0];
/// let one = steel.compliance(&patch.x, &patch.y)?;
/// let both = combined_compliance(one.as_ref(), one.as_ref())?;
/// let solution = SteadyProblem {
///     interface: &interface,
///     compliance: both.as_ref().into(),
///     friction: FrictionLaw::Constant(0.3).into(),
///     kinematics: PatchKinematics::one(10.0, ContactCreepage { lateral: 0.003, ..ContactCreepage::default() }),
///     loads: NormalLoad::Force(70e3).into(),
///     stencil: Stencil::Edge,
///     tolerance: 1e-8,
///     max_iterations: 200,
/// }
/// .solve()?;
/// assert!((solution.force[2] + 70e3).abs() < 1.0);
/// // A positive lateral creepage gives a negative lateral force on body 1, here some 0.72 μN.
/// assert!((solution.force[1] / (0.3 * 70e3) + 0.72).abs() < 0.03);
/// # Ok::<(), railsqueal::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct SteadyProblem<'a> {
    /// The interface.
    pub interface: &'a Interface,
    /// Influence matrix W of the interface (see [`crate::model::CoupledModel::influence`]), m/N, `[3n, 3n]`, rows (x,
    /// y, n): dense, symmetric or kept by rows; or a convolution.
    pub compliance: Influence<'a>,
    /// Friction law: the coefficient at each node follows from its creep velocity and those upstream, which it
    /// remembers.
    pub friction: PatchFriction,
    /// Rolling speed V > 0 and creepages of each patch, `[patches]`. With constant friction steady stresses do not
    /// depend on the speed; the creep velocity is proportional to it.
    pub kinematics: Vec<PatchKinematics>,
    /// Loads or approaches.
    pub loads: Loads,
    /// Upstream operator.
    pub stencil: Stencil,
    /// Largest residual of a solution, relative (see [`SteadySolution::residual`]).
    pub tolerance: f64,
    /// Largest number of Newton iterations, all continuation steps together.
    pub max_iterations: usize,
}

/// Solution of a [`SteadyProblem`] on its n nodes.
#[derive(Debug, Clone)]
pub struct SteadySolution {
    /// Pressure, Pa, `[n]`.
    pub pressure: Vec<f64>,
    /// Traction on body 1, Pa, `[n][2]`.
    pub traction: Vec<[f64; 2]>,
    /// Creep velocity ṡ = c + V ∂w/∂x, m/s, `[n][2]`, on all nodes.
    pub creep: Vec<[f64; 2]>,
    /// 0 open, 1 stick, 2 slip, `[n]`.
    pub state: Vec<u8>,
    /// Coefficient of friction, 1, `[n]`; at open nodes that at rest.
    pub friction: Vec<f64>,
    /// Contact force on body 1, N: (x, y, z); z is up, so the third is minus the normal force. Of several patches the
    /// sum of the components, each in the frame of its patch.
    pub force: [f64; 3],
    /// Moment of the tractions on body 1 about the z axes through the origins of the patches, N·m.
    pub moment_z: f64,
    /// Forces, moment and approach of each patch, `[patches]`.
    pub patches: Vec<PatchResultant>,
    /// Rigid motions, m, `[motions]`. Those that bear nothing leave their patches open, the nearest just touching.
    pub motions: Vec<f64>,
    /// Largest component over all nodes of the natural map (p − max(0, p − ρ_n g), and t − Proj(t − ρ_t ṡ) divided by
    /// μ), relative to the largest pressure; ρ is the inverse of a node's own compliance.
    pub residual: f64,
    /// Newton iterations spent, all stages together.
    pub iterations: usize,
    /// Products with the influence matrix of the contact that these took.
    pub products: usize,
    /// Relative tangential displacement w = u1 − u2, m, `[n][2]`.
    pub w: Vec<[f64; 2]>,
    /// Gap of the deformed bodies, m, `[n]`.
    pub gap: Vec<f64>,
    /// The operator ∂x that `creep` was taken with.
    pub upstream: Upstream,
}

/// Stresses that a solution is begun with.
pub(super) struct StartStresses {
    /// Stresses (tx, ty, p), Pa, `[3n]`, pressed somewhere.
    pub stress: Vec<f64>,
    /// Rigid motions, m, `[motions]`.
    pub motions: Vec<f64>,
    /// Coefficients of friction, 1, `[n]`, where those of the rigid creep are not to be taken.
    pub friction: Option<Vec<f64>>,
}

impl StartStresses {
    /// The stresses of a `solution` of a similar problem.
    pub fn from_solution(solution: &SteadySolution) -> Self {
        Self { stress: solution.stresses(), motions: solution.motions.clone(), friction: None }
    }
}

impl<'a> SteadyProblem<'a> {
    /// Solves the problem. A result always has a residual within the tolerance, on all nodes.
    ///
    /// A law that falls with the velocity is solved for with the coefficient frozen at each node, which is then
    /// renewed from the creep found, along each line from the leading edge on. The traction at a node moves its own
    /// creep by about V μ′ p/ρ_t of what changed its coefficient, a small part in ordinary contacts; where it is not
    /// small there may be several states, and one of them is found.
    pub fn solve(&self) -> Result<SteadySolution> {
        self.solve_from(None)
    }

    /// Solves the problem, starting from the solution of a similar one on the same interface if there is one.
    pub(crate) fn solve_from(&self, start: Option<&SteadySolution>) -> Result<SteadySolution> {
        let pressed = start.filter(|r| r.pressure.iter().any(|&p| p > 0.0));
        self.solve_with(pressed.map(StartStresses::from_solution), &mut None)
    }

    /// Solves the problem from `start`, with the candidates `kept` from a solution with other creepages, of which
    /// those of this one remain.
    pub(super) fn solve_with(
        &self,
        start: Option<StartStresses>,
        kept: &mut Option<Candidates<'a>>,
    ) -> Result<SteadySolution> {
        self.check()?;
        let s = self.interface;
        if self.is_open() {
            let upstream = s.upstream(Stencil::Upwind1, None);
            let stress = vec![0.0; 3 * s.len()];
            return self.evaluate(
                &stress,
                self.loads.prescribed(),
                upstream,
                &self.response(&stress),
                NewtonEffort::default(),
            );
        }

        if let Some(first) = self.loads.at_first() {
            return self.solve_by_loads(first, start);
        }
        let mut effort = NewtonEffort::default();
        let InitialGuess { mut at, mut candidates, mut friction } = match start {
            None => start::cold(self)?,
            Some(r) => {
                let friction = r.friction.unwrap_or_else(|| self.friction_at_first(&r.stress));
                let at = StressState { stress: r.stress, motions: r.motions, displacement: None };
                let closed = at.closed();
                refuse_border(self.compliance, s, &self.loads, &closed)?;
                let wanted = self.dilate(&closed);
                let candidates = match kept.take() {
                    Some(mut old) if wanted.iter().all(|i| old.nodes.binary_search(i).is_ok()) => {
                        old.take_creepage(self);
                        old
                    }
                    // The edge is looked at once the displacements are known.
                    _ => Candidates::new(self, &s.upstream(Stencil::Upwind2, None), wanted, &at.stress)?,
                };
                InitialGuess { at, candidates, friction }
            }
        };
        // In rare cases friction closes nodes outside the candidates taken from the frictionless contact: take them in.
        let mut residuals = Vec::new();
        let rounds = if self.friction.is_constant() { 10 } else { 60 };
        for _ in 0..rounds {
            newton::solve(self, &mut candidates, &friction, 0.5 * self.tolerance, &mut at, &mut effort)?;
            refuse_border(self.compliance, s, &self.loads, &at.closed())?;
            let u = self.response(&at.stress);
            effort.products += 1;
            let approach = self.approaches(&at.motions);
            let deformed = |i: usize| s.gap[i] - approach[s.patch_of(i)] + u[3 * i + 2];
            let upstream = s.edge_upstream(self.stencil, &at.stress, deformed);
            let solution = self.evaluate(&at.stress, at.motions.clone(), upstream.clone(), &u, effort)?;
            if solution.residual <= self.tolerance {
                *kept = Some(candidates);
                return Ok(solution);
            }
            at.displacement = Some(u);
            residuals.push(format!("{:.1e}", solution.residual));
            friction.clone_from(&solution.friction);
            let peak = solution.pressure.iter().copied().fold(0.0, f64::max);
            let mut closed: Vec<usize> = (0..s.len())
                .filter(|&i| {
                    at.stress[3 * i + 2] > 0.0 || -solution.gap[i] * self.rho_normal(i) > 0.1 * self.tolerance * peak
                })
                .collect();
            if closed.iter().any(|i| candidates.nodes.binary_search(i).is_err()) {
                closed.extend_from_slice(&candidates.nodes);
                candidates = Candidates::new(self, &upstream, self.dilate(&closed), &at.stress)?;
            }
        }
        Err(Error::NotConverged(format!(
            "steady contact: {} did not settle; residuals on the whole interface: {}",
            if self.friction.is_constant() {
                "the contact area"
            } else {
                "the coefficients of friction at the velocities of the nodes"
            },
            residuals.join(" ")
        )))
    }

    /// Augmentation parameter of the normal law at node `i`: the inverse of its own compliance, Pa/m.
    pub(super) fn rho_normal(&self, i: usize) -> f64 {
        1.0 / (self.compliance.get(3 * i + 2, 3 * i + 2) * self.interface.weight[i])
    }

    /// Augmentation parameter of the friction law at node `i` times V, Pa: the inverse of the node's own creep per unit
    /// traction and speed.
    pub(super) fn rho_tangential(&self, upstream: &Upstream, i: usize) -> f64 {
        let own = |c: usize| upstream.derivative(i, |j| self.compliance.get(3 * j + c, 3 * i + c));
        1.0 / (own(0).abs().max(own(1).abs()) * self.interface.weight[i])
    }

    /// Coefficients of friction at the rigid creep under the stresses `stress`, Pa, `[3n]`: 1, `[n]`.
    pub(super) fn friction_at_first(&self, stress: &[f64]) -> Vec<f64> {
        let s = self.interface;
        let rigid = |i: usize| {
            let c = s.rigid(&self.kinematics, i);
            self.kinematics[s.patch_of(i)].speed * c[0].hypot(c[1])
        };
        coefficients(&self.friction, s, &self.kinematics, |i| stress[3 * i + 2] > 0.0, rigid)
    }

    /// Returns whether nothing presses the bodies, or the approaches do not close the gap.
    fn is_open(&self) -> bool {
        let s = self.interface;
        let approach = self.approaches(&self.loads.prescribed());
        let open = |c: usize| self.loads.is_open(c) || s.patches[c].nodes().all(|i| s.gap[i] >= approach[c]);
        self.loads.unknown().is_empty() && (0..s.patches.len()).all(open)
    }

    /// Approaches of the patches under the rigid `motions`, m, `[patches]`.
    pub(super) fn approaches(&self, motions: &[f64]) -> Vec<f64> {
        (0..self.interface.patches.len()).map(|c| self.loads.approach(motions, c)).collect()
    }

    /// The motions with those that bear nothing as far as the first touch of their patches, where the displacement is
    /// `u`, m, `[3n]`.
    fn touching(&self, mut motions: Vec<f64>, u: &[f64]) -> Vec<f64> {
        let s = self.interface;
        for (j, motion) in self.loads.motions.iter().enumerate().filter(|(j, _)| self.loads.is_lifted(*j)) {
            motions[j] = 0.0;
            let approach = self.approaches(&motions);
            let reach = |(c, p): (usize, &ContactPatch)| {
                let gaps = p.nodes().map(|i| s.gap[i] + u[3 * i + 2] - approach[c]);
                gaps.fold(f64::INFINITY, f64::min) / motion.factors[c]
            };
            let pressed = s.patches.iter().enumerate().filter(|(c, _)| motion.factors[*c] > 0.0);
            motions[j] = pressed.map(reach).fold(f64::INFINITY, f64::min);
        }
        motions
    }

    /// Nodes of `set` (ascending or not) and their eight neighbours, ascending.
    pub(super) fn dilate(&self, set: &[usize]) -> Vec<usize> {
        let s = self.interface;
        let mut mark = vec![false; s.len()];
        for &i in set {
            s.place(i).0.neighbours(i, 1).for_each(|j| mark[j] = true);
        }
        (0..s.len()).filter(|&i| mark[i]).collect()
    }

    fn check(&self) -> Result<()> {
        let n = self.interface.len();
        if self.compliance.shape() != (3 * n, 3 * n)
            || self.interface.weight.len() != n
            || self.interface.gap.len() != n
            || self.interface.shift.len() != n
            || self.kinematics.len() != self.interface.patches.len()
            || !self.friction.fits(self.interface.patches.len())
        {
            return Err(Error::Defect(format!(
                "steady contact: an influence matrix of {:?} entries and {} rolling speeds for {n} nodes on {} patches",
                self.compliance.shape(),
                self.kinematics.len(),
                self.interface.patches.len()
            )));
        }
        let rolling = |k: &PatchKinematics| {
            let c = k.creepage;
            [
                ("contact.speed", k.speed, k.speed > 0.0, "positive"),
                ("contact.creepage.longitudinal", c.longitudinal, true, "finite"),
                ("contact.creepage.lateral", c.lateral, true, "finite"),
                ("contact.creepage.spin", c.spin, true, "finite"),
            ]
        };
        let rubbing = |law: &FrictionLaw| {
            [0.0, f64::MAX].map(|v| law.coefficient(v)).map(|mu| ("contact.friction", mu, mu >= 0.0, "at least 0"))
        };
        let tolerance = ("analyses.steady.tolerance", self.tolerance, self.tolerance > 0.0, "positive");
        let all = self.friction.laws().flat_map(rubbing).chain(std::iter::once(tolerance));
        for (key, value, fits, expected) in all.chain(self.kinematics.iter().flat_map(rolling)) {
            if !value.is_finite() || !fits {
                return Err(Error::Job(format!("{key} is {value}: it must be {expected}")));
            }
        }
        self.loads.check(self.interface.patches.len(), self.friction.largest())?;
        for i in 0..n {
            for c in 0..3 {
                let d = self.compliance.get(3 * i + c, 3 * i + c);
                if !(d.is_finite() && d > 0.0) {
                    return Err(Error::Input(format!(
                        "steady contact: the compliance of contact node {i} in direction {} is {d} m/N, it must \
                         be positive",
                        ["x", "y", "n"][c]
                    )));
                }
            }
        }
        Ok(())
    }

    /// W R for the stresses `(tx, ty, p)` of all nodes, `[3n]`, Pa: m, `[3n]`.
    fn response(&self, stress: &[f64]) -> Vec<f64> {
        let force: Vec<f64> = stress.iter().enumerate().map(|(k, v)| v * self.interface.weight[k / 3]).collect();
        self.compliance.multiply(&force)
    }

    /// Everything that follows from the stresses `(tx, ty, p)` of all nodes, `[3n]`, Pa, the rigid motions, m,
    /// `[motions]`, and the displacement (w_x, w_y, change of gap) that the stresses cause, m, `[3n]`.
    pub(super) fn evaluate(
        &self,
        stress: &[f64],
        motions: Vec<f64>,
        upstream: Upstream,
        u: &[f64],
        effort: NewtonEffort,
    ) -> Result<SteadySolution> {
        let s = self.interface;
        let n = s.len();
        let motions = self.touching(motions, u);
        let approach = self.approaches(&motions);
        let peak = (0..n).map(|i| stress[3 * i + 2]).fold(0.0, f64::max);
        let mut solution = SteadySolution {
            pressure: (0..n).map(|i| stress[3 * i + 2]).collect(),
            traction: (0..n).map(|i| [stress[3 * i], stress[3 * i + 1]]).collect(),
            creep: vec![[0.0; 2]; n],
            state: vec![Status::Open as u8; n],
            friction: Vec::new(),
            force: [0.0; 3],
            moment_z: 0.0,
            patches: Vec::new(),
            motions,
            residual: 0.0,
            iterations: effort.iterations,
            products: effort.products,
            w: (0..n).map(|i| [s.shift[i][0] + u[3 * i], s.shift[i][1] + u[3 * i + 1]]).collect(),
            upstream: Upstream { rows: Vec::new() },
            gap: (0..n).map(|i| s.gap[i] - approach[s.patch_of(i)] + u[3 * i + 2]).collect(),
        };
        let largest = self.friction.largest();
        for i in 0..n {
            solution.creep[i] = s.rigid(&self.kinematics, i);
            for c in 0..2 {
                solution.creep[i][c] += upstream.derivative(i, |j| solution.w[j][c]);
            }
        }
        let speed = |i: usize| self.kinematics[s.patch_of(i)].speed;
        let velocity = |i: usize| speed(i) * solution.creep[i][0].hypot(solution.creep[i][1]);
        let closed = |i: usize| solution.pressure[i] > 0.0;
        solution.friction = coefficients(&self.friction, s, &self.kinematics, closed, velocity);
        for i in 0..n {
            let creep = solution.creep[i];
            let (rn, rt) = (self.rho_normal(i), self.rho_tangential(&upstream, i));
            let (p, t) = (solution.pressure[i], solution.traction[i]);
            let mu = solution.friction[i];
            let node = Node { pressure: p, traction: t, gap: solution.gap[i], creep };
            let found = node.project(Augmentation { normal: rn, tangential: rt }, mu);
            // A node at the border of the interface is open; the operator there serves the written creep alone.
            solution.state[i] = if p > 0.0 { found.status } else { Status::Open } as u8;
            if peak > 0.0 {
                let scale = if largest > 0.0 { largest * peak } else { peak };
                let [x, y, n] = found.map(&node);
                solution.residual = solution.residual.max(n.abs() / peak).max(size([x, y]) / scale);
            }
            solution.creep[i] = creep.map(|v| v * speed(i));
        }
        solution.upstream = upstream;
        let reaction: Vec<f64> = stress.iter().enumerate().map(|(k, v)| v * s.weight[k / 3]).collect();
        solution.patches = PatchResultant::of_patches(s, &reaction, &approach);
        (solution.force, solution.moment_z) = PatchResultant::total(&solution.patches);
        for j in self.loads.unknown() {
            let motion = &self.loads.motions[j];
            let NormalLoad::Force(f) = motion.load else { continue };
            let apart = motion.borne(&solution.patches) - f;
            solution.residual = solution.residual.max(apart.abs() / self.loads.scale(j));
        }
        if !solution.residual.is_finite() {
            return Err(Error::NotConverged("steady contact: the solution is not finite".into()));
        }
        Ok(solution)
    }
}

impl SteadyProblem<'_> {
    /// The contact of `solution` linearised about it, with the status of every node kept: nodes that stick move with
    /// each other, those that slide keep to the bound of friction.
    pub fn contact(&self, solution: &SteadySolution) -> LinearContact {
        let s = self.interface;
        let closed: Vec<usize> = (0..s.len()).filter(|&i| solution.pressure[i] > 0.0).collect();
        let (mut nodes, mut remembering) = (Vec::new(), Vec::new());
        for &i in &closed {
            let force = solution.pressure[i] * s.weight[i];
            let (t, mu) = (solution.traction[i], solution.friction[i]);
            let (sticks, length) = (solution.state[i] == Status::Stick as u8, size(t));
            // Without friction there is no traction to tell the direction of the creep.
            let against = if length > 0.0 { t.map(|t| -t / length) } else { [1.0, 0.0] };
            let velocity = if sticks { 0.0 } else { size(solution.creep[i]) };
            let tangent = match sticks {
                true => Tangent::Stick { creep: 1.0 },
                false => Tangent::Slip(Slip::steady(force, against, velocity, mu, 0.0)),
            };
            let terms = solution.upstream.rows[i].iter().filter(|t| t.1 != 0.0);
            let speed = self.kinematics[s.patch_of(i)].speed;
            nodes.push(LinearNode { node: i, tangent, convection: terms.map(|&(j, d)| (j, speed * d)).collect() });
            remembering.push(SlidingNode { node: i, creep: against.map(|t| velocity * t), force, friction: mu });
        }
        let edges = match self.stencil {
            Stencil::Edge => s.edges(&closed, &solution.gap, &solution.w, &self.kinematics),
            _ => Vec::new(),
        };
        LinearContact { nodes, edges, memory: memory::linear(&self.friction, s, &self.kinematics, &remembering) }
    }
}

impl StressState {
    /// Nodes under pressure, ascending.
    pub fn closed(&self) -> Vec<usize> {
        (0..self.stress.len() / 3).filter(|&i| self.stress[3 * i + 2] > 0.0).collect()
    }
}

impl SteadySolution {
    /// Centre of the pressure on the first patch of `s`, (x, y), m; the origin without pressure.
    pub fn centre(&self, s: &Interface) -> [f64; 2] {
        self.centre_of(s, 0)
    }

    /// Centre of the pressure on patch `c` of `s`, (x, y), m; its origin without pressure.
    pub(crate) fn centre_of(&self, s: &Interface, c: usize) -> [f64; 2] {
        let (mut sum, mut moments) = (0.0, [0.0; 2]);
        for i in s.patches[c].nodes() {
            let force = self.pressure[i] * s.weight[i];
            sum += force;
            s.point(i).iter().zip(&mut moments).for_each(|(x, m)| *m += x * force);
        }
        moments.map(|m| if sum > 0.0 { m / sum } else { 0.0 })
    }

    /// Stresses (tx, ty, p), Pa, `[3n]`.
    pub(super) fn stresses(&self) -> Vec<f64> {
        self.traction.iter().zip(&self.pressure).flat_map(|(t, &p)| [t[0], t[1], p]).collect()
    }
}
