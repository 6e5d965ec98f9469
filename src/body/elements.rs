//! A body of finite elements with the solver and the modes that belong to it.

use super::collective_order::CollectiveOrderCheck;
use super::fe::{BodyModes, FeBody};
use super::half_space::HalfSpace;
use super::hybrid::Hybrid;
use super::modes::{self, Extent};
use super::nearest::Nearest;
use super::residual_flexibility::{self, NodeRecovery};
use super::rigid_motions;
use super::rotation::{self, ModalRotation, RotationForms};
use super::statics::Statics;
use super::trace::Trace;
use super::{ElasticBody, Fields, FullSystem, Kind, ModeLabel, ProgressFn, TraceModes};
use crate::eigen::sparse;
use crate::fem::dofs::FIXED;
use crate::fem::rotation::Axis;
use crate::fem::stress;
use crate::mesh::distribute::MeshPart;
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
use crate::petsc::session::Petsc;
use crate::{Error, Result};
use faer::{Mat, MatRef};
use std::cell::{RefCell, RefMut};

/// How static problems of the body are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StaticMethod {
    /// By a factorisation, which modes need as well.
    Direct,
    /// By conjugate gradients with algebraic multigrid.
    Iterative,
}

/// A body of finite elements.
pub struct Elements<'p> {
    petsc: &'p Petsc<'p>,
    /// Mesh, degrees of freedom, matrices and trace.
    pub fe: FeBody,
    method: StaticMethod,
    /// The compliance of its contact rows, where that near the contact is a half-space's.
    hybrid: Option<Hybrid>,
    eigen: sparse::Method,
    /// The axis about which it rotates.
    axis: Option<Axis>,
    /// Displacement of the nodes by centrifugal forces at 1 rad/s, m; known with the modes.
    spread: Option<Vec<[f64; 3]>>,
    statics: RefCell<Option<Statics<'p>>>,
    shapes: Option<BodyModes>,
    order: CollectiveOrderCheck,
}

impl<'p> Elements<'p> {
    /// The body `fe`, whose static problems are to be solved by `method`.
    pub fn new(petsc: &'p Petsc<'p>, fe: FeBody, method: StaticMethod) -> Self {
        let order = CollectiveOrderCheck::new(&fe.name);
        let eigen = sparse::Method::default();
        let half_space = HalfSpace { young: fe.material.young, poisson: fe.material.poisson };
        let hybrid = fe.means.as_ref().map(|m| Hybrid::new(half_space, m.grids.clone()));
        Self {
            petsc,
            fe,
            method,
            hybrid,
            eigen,
            axis: None,
            spread: None,
            statics: RefCell::new(None),
            shapes: None,
            order,
        }
    }

    /// The same body with modes computed by `eigen`.
    pub fn with_modes_by(self, eigen: sparse::Method) -> Self {
        Self { eigen, ..self }
    }

    /// Collective: the same body rotating about `axis`, whose modes say what that adds; an error unless it is one of
    /// revolution.
    pub fn rotating(self, axis: Axis) -> Result<Self> {
        rotation::of_revolution(self.petsc.world(), &self.fe, axis)?;
        Ok(Self { axis: Some(axis), ..self })
    }

    /// The same body rotating about `axis`, about which it is one of revolution by the way it is made, however coarse
    /// its facets.
    pub(crate) fn made_round(self, axis: Axis) -> Self {
        Self { axis: Some(axis), ..self }
    }

    /// Collective: notes that `call` begins; the ranks agree on it.
    fn enter(&self, call: &'static str) -> Result<&'p World> {
        let world = self.petsc.world();
        self.order.enter(world, call)?;
        Ok(world)
    }

    /// The solver, of a body that has one.
    fn solver(&self) -> Result<RefMut<'_, Statics<'p>>> {
        let missing = || Error::Defect(format!("body \"{}\" has no solver: it is not factorised", self.fe.name));
        let held = self.statics.try_borrow_mut().map_err(|_| missing())?;
        RefMut::filter_map(held, Option::as_mut).map_err(|_| missing())
    }

    fn known_shapes(&self) -> Result<&BodyModes> {
        let missing = || Error::Defect(format!("body \"{}\" has no mode shapes", self.fe.name));
        self.shapes.as_ref().ok_or_else(missing)
    }

    /// Collective: `count` sets of forces on the contact rows, N, `[3n, count]` column by column on rank 0, as loads
    /// on this rank's degrees of freedom, `[owned, count]`.
    fn loads(&self, forces: &[f64], count: usize) -> Vec<f64> {
        let world = self.petsc.world();
        let rows = self.fe.trace.rows();
        let set = |k: usize| if world.is_root() { &forces[k * rows..(k + 1) * rows] } else { &[] };
        (0..count).flat_map(|k| self.fe.load(world, set(k))).collect()
    }
}

impl ElasticBody for Elements<'_> {
    fn name(&self) -> &str {
        &self.fe.name
    }

    fn kind(&self) -> Kind {
        Kind::Elements
    }

    fn rows(&self) -> usize {
        self.fe.trace.rows()
    }

    fn factorise(&mut self) -> Result<Option<String>> {
        let world = self.enter("factorise")?;
        if let (Some(hybrid), Some(means)) = (&mut self.hybrid, &self.fe.means) {
            let placed = hybrid.find_near(&means.positions);
            placed.map_err(|e| e.context(format!("compliance of body \"{}\"", self.fe.name)))?;
        }
        // What is there goes before the next one is made.
        *self.statics.get_mut() = None;
        let mut made = match self.method {
            StaticMethod::Direct => Statics::direct(self.petsc, &self.fe)?,
            StaticMethod::Iterative => Statics::iterative(self.petsc, &self.fe)?,
        };
        let mut text = made.describe();
        if let (Some(hybrid), Some(means)) = (&mut self.hybrid, &self.fe.means) {
            let yielding = means.yielding(world, &mut made, self.fe.dofs.owned())?;
            let patches: Vec<_> = means.patches.iter().map(|d| d.0.clone()).collect();
            text += &format!("; {}", hybrid.complete(&yielding, &patches)?);
        }
        *self.statics.get_mut() = Some(made);
        Ok(Some(text))
    }

    fn release(&mut self) -> Result<()> {
        self.enter("release")?;
        *self.statics.get_mut() = None;
        Ok(())
    }

    fn compliance(&self, steps: &mut ProgressFn) -> Result<Option<Mat<f64>>> {
        let world = self.enter("compliance")?;
        if let Some(hybrid) = &self.hybrid {
            return hybrid.compliance(world, &self.fe.name);
        }
        self.fe.compliance(world, &mut *self.solver()?, steps)
    }

    fn modes(&mut self, extent: Extent, steps: &mut ProgressFn) -> Result<TraceModes> {
        let world = self.enter("modes")?;
        let found = modes::compute(self.petsc, &self.fe, &mut *self.solver()?, extent, self.eigen, steps)?;
        let (omega, residual) = (found.omega.clone(), found.residual.clone());
        let rows = self.fe.contact_modes(world, &found);
        let seen = self.fe.means.as_ref().and_then(|m| m.averaged_modes(world, omega.len(), |k| &found.vectors[k]));
        if let (Some(hybrid), Some(seen)) = (&mut self.hybrid, seen) {
            hybrid.of_modes(&omega, &seen);
        }
        let reach = match (omega.last(), extent) {
            (Some(last), _) => *last,
            (None, Extent::MaxFrequency(f)) => 2.0 * std::f64::consts::PI * f,
            (None, Extent::Count(_)) => 0.0,
        };
        let rotation = match self.axis {
            Some(axis) => {
                let spread = rotation::centrifugal(world, &self.fe, &mut *self.solver()?, axis)?;
                let forms = RotationForms::assemble(world, &self.fe, axis, &spread)?;
                self.spread = Some(spread);
                Some(forms.project(world, &self.fe.operators.mass, &found))
            }
            None => None,
        };
        let damping = self.fe.effect.damping.as_ref().map(|c| {
            let images = rigid_motions::images(world, c, &found.vectors);
            rigid_motions::products(world, &found.vectors, &images)
        });
        let damping = damping.filter(|_| world.is_root());
        let springs = self.fe.effect.lossy.as_ref().map(|k| rigid_motions::in_springs(world, k, &found.vectors));
        let springs = springs.unwrap_or_default();
        self.shapes = Some(found);
        let orders = rotation.as_ref().map(ModalRotation::diameters).unwrap_or_default();
        let names = ModeLabel::of_orders(&orders);
        Ok(TraceModes { omega, residual, rows, damping, springs, reach, rotation, names, ..TraceModes::default() })
    }

    fn modes_at(&self, points: &[[f64; 3]]) -> Result<Option<Mat<f64>>> {
        let world = self.enter("modes at points")?;
        let shapes = self.known_shapes()?;
        let mut nodes = Vec::new();
        for (i, point) in points.iter().enumerate() {
            let near = self.fe.nearest(world, *point);
            if near.distance > near.cell {
                return Err(Error::Job(format!(
                    "bodies.{}.modes.measured: the point {i} of a shape is {:.1} mm beside the mesh, whose elements \
                     there are {:.1} mm; expected coordinates of the result file, m",
                    self.fe.name,
                    1e3 * near.distance,
                    1e3 * near.cell
                )));
            }
            nodes.push(near.node);
        }
        let mut mine = vec![0.0; 3 * points.len() * shapes.vectors.len()];
        for (vector, rows) in shapes.vectors.iter().zip(mine.chunks_mut(3 * points.len())) {
            let motion = self.fe.at_nodes(world, vector);
            for (node, rows) in nodes.iter().zip(rows.chunks_mut(3)) {
                node.iter().for_each(|&node| rows.copy_from_slice(&motion[node]));
            }
        }
        let all = world.sum_all(&mine);
        Ok(Some(Mat::from_fn(3 * points.len(), shapes.vectors.len(), |i, k| all[3 * points.len() * k + i])))
    }

    fn response(&self, forces: &[f64]) -> Result<Vec<f64>> {
        let world = self.enter("response")?;
        if let Some(hybrid) = &self.hybrid {
            return hybrid.response(world, &self.fe.name, forces);
        }
        let motion = self.fe.response(world, &mut *self.solver()?, forces)?;
        Ok(self.fe.trace.project(world, &motion))
    }

    fn shapes(&self) -> Option<&BodyModes> {
        self.shapes.as_ref()
    }

    fn fields(&self) -> Option<&dyn Fields> {
        Some(self)
    }

    fn fields_mut(&mut self) -> Option<&mut dyn Fields> {
        Some(self)
    }

    fn full_system(&self) -> Option<&dyn FullSystem> {
        Some(self)
    }
}

impl FullSystem for Elements<'_> {
    fn name(&self) -> &str {
        FullSystem::name(&self.fe)
    }

    fn stiffness(&self) -> &DistCsr {
        self.fe.stiffness()
    }

    fn mass(&self) -> &DistCsr {
        self.fe.mass()
    }

    fn damping(&self) -> Option<&DistCsr> {
        FullSystem::damping(&self.fe)
    }

    fn lossy(&self) -> Option<&DistCsr> {
        FullSystem::lossy(&self.fe)
    }

    fn trace(&self) -> &Trace {
        FullSystem::trace(&self.fe)
    }

    fn rotation(&self) -> Result<Option<RotationForms>> {
        let (Some(axis), world) = (self.axis, self.petsc.world()) else { return Ok(None) };
        match &self.spread {
            Some(spread) => RotationForms::assemble(world, &self.fe, axis, spread).map(Some),
            // Its modes are of an earlier run.
            None if self.shapes.is_some() => {
                let spread = rotation::centrifugal(world, &self.fe, &mut *self.solver()?, axis)?;
                RotationForms::assemble(world, &self.fe, axis, &spread).map(Some)
            }
            None => Ok(None),
        }
    }
}

impl Fields for Elements<'_> {
    fn mesh(&self) -> &MeshPart {
        &self.fe.part
    }

    fn len(&self) -> usize {
        self.fe.dofs.owned()
    }

    fn nearest(&self, point: [f64; 3]) -> Nearest {
        self.fe.nearest(self.petsc.world(), point)
    }

    fn diameter(&self) -> f64 {
        self.fe.diameter(self.petsc.world())
    }

    fn at_nodes(&self, motion: &[f64]) -> Vec<[f64; 3]> {
        self.fe.at_nodes(self.petsc.world(), motion)
    }

    fn von_mises(&self, motion: &[f64]) -> Vec<f64> {
        let u = self.at_nodes(motion);
        self.fe.at_all_nodes(self.petsc.world(), &stress::von_mises(&self.fe.part, &u, &self.fe.material))
    }

    fn of_nodes(&self, value: &dyn Fn(usize) -> Option<[f64; 3]>) -> Option<Vec<f64>> {
        let free = (0..self.fe.part.owned).filter(|&n| self.fe.dofs.local[n] != FIXED);
        let values: Option<Vec<[f64; 3]>> = free.map(value).collect();
        values.map(|v| v.into_flattened())
    }

    fn replace_shapes(&mut self, shapes: Option<BodyModes>) -> Option<BodyModes> {
        std::mem::replace(&mut self.shapes, shapes)
    }

    fn contact_modes(&self) -> Result<Option<Mat<f64>>> {
        let world = self.enter("contact_modes")?;
        Ok(self.fe.contact_modes(world, self.known_shapes()?))
    }

    fn statics(&self, forces: &[f64], count: usize) -> Result<Vec<f64>> {
        self.enter("statics")?;
        let mut motions = self.loads(forces, count);
        self.solver()?.solve(&mut motions, count)?;
        Ok(motions)
    }

    fn improve(&self, motions: &mut [f64], forces: &[f64], count: usize, accuracy: f64) -> Result<()> {
        self.enter("improve")?;
        let loads = self.loads(forces, count);
        self.solver()?.improve(motions, &loads, count, accuracy)
    }

    fn iterations(&self) -> usize {
        self.solver().map_or(0, |s| s.iterations())
    }

    fn at_contact(&self, motion: &[f64]) -> Vec<f64> {
        self.fe.trace.project(self.petsc.world(), motion)
    }

    fn node_motion(&self, contact_modes: Option<MatRef<'_, f64>>, node: Option<usize>) -> Result<NodeRecovery> {
        let world = self.enter("node_motion")?;
        residual_flexibility::at_node(world, &self.fe, &mut *self.solver()?, self.known_shapes()?, contact_modes, node)
    }
}
