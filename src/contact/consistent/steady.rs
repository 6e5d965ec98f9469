//! Steady rolling by equation (3): from the solution of the nodal laws on, by Newton's method on the nodes around the
//! contact.

use super::cells::{self, ContactCells, IntegratedLaw, NodeFields};
use super::newton::{CellProblem, ConsistentEffort, ConsistentIterate, FactoredJacobian};
use super::surface::ConsistentSurface;
use crate::contact::interface::{Stencil, Upstream};
use crate::contact::law::Augmentation;
use crate::contact::loads::NormalLoad;
use crate::contact::newton;
use crate::contact::patch::refuse_border;
use crate::contact::steady::{SteadyProblem, SteadySolution};
use crate::{Error, Result};
use faer::Mat;

/// Rounds in which nodes come in and the course of w at the leading edge settles.
const ROUNDS: usize = 60;

/// A steady problem whose laws hold at points of quadrature.
#[derive(Debug, Clone)]
pub struct ConsistentSteady<'a> {
    /// The problem: an interface that is a grid, constant friction.
    pub problem: SteadyProblem<'a>,
    /// ρ_n in Pa/m, and ρ_t V in Pa, see [`augmentation`].
    pub augmentation: Augmentation,
}

/// Its solution.
#[derive(Debug, Clone)]
pub struct ConsistentSolution {
    /// Pressure and traction are nodal forces divided by nodal areas: means of what is projected, p ≥ 0 and |t| ≤ μp.
    /// The state of a node is that of the law with the fields at it, so that the nodes around the contact, which the
    /// pressed part of their cells gives a force, are open. The residual is the largest component of F(R) over the
    /// nodal area, relative to the largest pressure as that of [`SteadySolution`].
    pub solution: SteadySolution,
    /// The field H⁻¹R: tractions x, y and pressure, Pa, `[n][3]`.
    pub field: Vec<[f64; 3]>,
    /// Area under pressure, and that of it that sticks, by points of quadrature, m².
    pub area: [f64; 2],
}

/// ρ_n in Pa/m and ρ_t V in Pa of a steady problem: the inverses of the own compliance and creep of the node where
/// the bodies are nearest.
pub fn augmentation(problem: &SteadyProblem<'_>) -> Augmentation {
    let s = problem.interface;
    let nearest = (0..s.len()).filter(|&i| !s.on_border(i)).min_by(|&a, &b| s.gap[a].total_cmp(&s.gap[b]));
    let upstream = s.upstream(Stencil::Upwind1, None);
    let i = nearest.unwrap_or(0);
    Augmentation { normal: problem.rho_normal(i), tangential: problem.rho_tangential(&upstream, i) }
}

/// The contact at an iterate on all nodes.
struct Whole {
    /// Displacements, m, `[3n]`.
    u: Vec<f64>,
    /// H⁻¹R, Pa, `[3n]`.
    stress: Vec<f64>,
    /// Creep over V and gap, `[3n]`.
    motion: Vec<f64>,
    upstream: Upstream,
    integral: cells::Integral,
    residual: f64,
}

impl<'a> ConsistentSteady<'a> {
    /// With the ρ of [`augmentation`].
    pub fn new(problem: SteadyProblem<'a>) -> Self {
        let augmentation = augmentation(&problem);
        Self { problem, augmentation }
    }

    /// Solves the problem, to its tolerance on all nodes.
    pub fn solve(&self) -> Result<ConsistentSolution> {
        let p = &self.problem;
        let s = p.interface;
        if s.are_points() || !p.friction.is_constant() {
            return Err(Error::Job(
                "contact.quadrature: \"consistent\" is for contact on a grid with a constant coefficient of \
                 friction; take \"nodal\""
                    .into(),
            ));
        }
        let patch = s.single("contact.quadrature \"consistent\"")?;
        let load = p.loads.of_one_patch().ok_or_else(|| {
            Error::Job(
                "contact.quadrature: \"consistent\" takes a load or an approach along the normal; take \"nodal\""
                    .into(),
            )
        })?;
        let start = p.solve()?;
        let mut forces: Vec<f64> = start.stresses().iter().enumerate().map(|(k, v)| v * s.weight[k / 3]).collect();
        let surface = ConsistentSurface::new(patch);
        let mut approach = start.motions[0];
        let mut whole = self.whole(&surface, &forces, (approach, load));
        let mut effort =
            ConsistentEffort { iterations: start.iterations, products: start.products, ..ConsistentEffort::default() };
        if start.pressure.iter().all(|&v| v == 0.0) {
            return self.finish(whole, effort, approach);
        }
        let mut memory = FactoredJacobian::default();
        let mut residuals = Vec::new();
        let mut nodes: Vec<usize> = Vec::new();
        for _ in 0..ROUNDS {
            if whole.residual <= p.tolerance {
                return self.finish(whole, effort, approach);
            }
            if effort.iterations >= p.max_iterations {
                break;
            }
            residuals.push(format!("{:.1e}", whole.residual));
            let pressed = |forces: &[f64]| (0..s.len()).filter(|i| forces[3 * i + 2] > 0.0).collect::<Vec<_>>();
            let touching = (0..s.len()).filter(|i| forces[3 * i + 2] > 0.0 || whole.integral.forces[3 * i + 2] > 0.0);
            let wanted = surface.with_neighbours(touching);
            if wanted.iter().any(|i| nodes.binary_search(i).is_err()) {
                nodes = surface.with_neighbours(wanted.into_iter());
            }
            let cells = ContactCells::new(&surface, nodes.clone());
            let found = self.newton(&cells, &whole.upstream, (&forces, approach, load), &mut memory, &mut effort)?;
            forces.fill(0.0);
            for (f, &i) in found.forces.chunks_exact(3).zip(&nodes) {
                forces[3 * i..3 * i + 3].copy_from_slice(f);
            }
            approach -= found.shift[2];
            refuse_border(p.compliance, s, &p.loads, &pressed(&forces))?;
            whole = self.whole(&surface, &forces, (approach, load));
        }
        Err(Error::NotConverged(format!(
            "steady contact, consistent quadrature: no solution within {:.1e} after {} iterations \
             (analyses.steady.max_iterations is {}); \
             residuals on the whole interface: {}",
            p.tolerance,
            effort.iterations,
            p.max_iterations,
            residuals.join(" ")
        )))
    }

    fn law(&self) -> IntegratedLaw {
        IntegratedLaw { rho: self.augmentation, friction: self.problem.friction.law(0).coefficient(0.0) }
    }

    /// Newton's method with the upstream operator as it is, from forces on all nodes, N, `[3n]`, and an approach; the
    /// shift is the change of it.
    fn newton(
        &self,
        cells: &ContactCells,
        upstream: &Upstream,
        (forces, approach, load): (&[f64], f64, NormalLoad),
        memory: &mut FactoredJacobian,
        effort: &mut ConsistentEffort,
    ) -> Result<ConsistentIterate> {
        let p = &self.problem;
        let s = p.interface;
        let k = cells.len();
        let w = |row: usize, b: usize| p.compliance.get(row, 3 * cells.nodes[b / 3] + b % 3);
        let response = Mat::from_fn(3 * k, 3 * k, |a, b| match (cells.nodes[a / 3], a % 3) {
            (i, 2) => w(3 * i + 2, b),
            (i, c) => upstream.derivative(i, |j| w(3 * j + c, b)),
        });
        let mut constant = Vec::with_capacity(3 * k);
        for &i in &cells.nodes {
            let rigid = s.rigid(&p.kinematics, i);
            constant.extend((0..2).map(|c| rigid[c] + upstream.derivative(i, |j| s.shift[j][c])));
            constant.push(s.gap[i] - approach);
        }
        let total = match load {
            NormalLoad::Force(f) => [None, None, Some(f)],
            NormalLoad::Approach(_) => [None; 3],
        };
        let peak = (0..s.len()).map(|i| forces[3 * i + 2] / s.weight[i]).fold(f64::MIN_POSITIVE, f64::max);
        let measure: Vec<f64> = cells.nodes.iter().map(|&i| peak * s.weight[i]).collect();
        let law = self.law();
        let posed =
            CellProblem { cells, law, response: response.as_ref(), constant: &constant, total, measure: &measure };
        let own = cells.nodes.iter().flat_map(|&i| 3 * i..3 * i + 3).map(|r| forces[r]).collect();
        let start = posed.iterate(own, [0.0; 3]);
        let target = 0.3 * p.tolerance * if law.friction > 0.0 { law.friction.min(1.0) } else { 1.0 };
        posed.solve(target, start, memory, effort).map_err(|left| {
            Error::NotConverged(format!(
                "steady contact, consistent quadrature: Newton's method stalled at a residual of {:.1e}, \
                 {target:.1e} was asked for",
                left
            ))
        })
    }

    /// State of the whole interface under forces, N, `[3n]`, and an approach, where `load` is given.
    fn whole(&self, surface: &ConsistentSurface, forces: &[f64], (approach, load): (f64, NormalLoad)) -> Whole {
        let p = &self.problem;
        let (s, n) = (p.interface, p.interface.len());
        let (u, stress, law) = (p.compliance.multiply(forces), surface.field(forces), self.law());
        let gap: Vec<f64> = (0..n).map(|i| s.gap[i] - approach + u[3 * i + 2]).collect();
        let closed: Vec<bool> = (0..n).map(|i| stress[3 * i + 2] > law.rho.normal * gap[i]).collect();
        let upstream = s.upstream(p.stencil, Some((&gap, &closed)));
        let mut motion = Vec::with_capacity(3 * n);
        for i in 0..n {
            let rigid = s.rigid(&p.kinematics, i);
            motion.extend((0..2).map(|c| rigid[c] + upstream.derivative(i, |j| s.shift[j][c] + u[3 * j + c])));
            motion.push(gap[i]);
        }
        let fields = NodeFields { stress: &stress, motion: &motion };
        let integral = cells::integral(&surface.rule(), n, surface.cells(), fields, law);
        let peak = (0..n).map(|i| forces[3 * i + 2] / s.weight[i]).fold(0.0, f64::max);
        let friction = if law.friction > 0.0 { law.friction } else { 1.0 };
        let mut residual = 0.0f64;
        for i in 0..n {
            let of = |c: usize| (forces[3 * i + c] - integral.forces[3 * i + c]) / s.weight[i];
            let most = of(2).abs().max(of(0).hypot(of(1)) / friction);
            if most > 0.0 || most.is_nan() {
                residual = if most / peak <= residual { residual } else { most / peak };
            }
        }
        if let NormalLoad::Force(f) = load {
            let sum: f64 = forces.iter().skip(2).step_by(3).sum();
            if f > 0.0 {
                residual = residual.max((sum - f).abs() / f);
            }
        }
        Whole { u, stress, motion, upstream, integral, residual }
    }

    /// The solution.
    fn finish(&self, whole: Whole, effort: ConsistentEffort, approach: f64) -> Result<ConsistentSolution> {
        let p = &self.problem;
        let s = p.interface;
        let n = s.len();
        let Whole { u, stress, motion, upstream, integral, residual } = whole;
        if !residual.is_finite() {
            return Err(Error::NotConverged(
                "steady contact, consistent quadrature: the solution is not finite".into(),
            ));
        }
        let fields = NodeFields { stress: &stress, motion: &motion };
        let over: Vec<f64> = integral.forces.iter().enumerate().map(|(k, f)| f / s.weight[k / 3]).collect();
        let counts = newton::NewtonEffort { iterations: effort.iterations, products: effort.products };
        let nodal = p.evaluate(&over, vec![approach], upstream, &u, counts)?;
        let solution =
            SteadySolution { state: (0..n).map(|i| self.law().status(fields, i) as u8).collect(), residual, ..nodal };
        let field = stress.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect();
        Ok(ConsistentSolution { solution, field, area: integral.area })
    }
}
