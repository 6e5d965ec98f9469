//! A body given by matrices, as contact takes it.

use super::collective_order::CollectiveOrderCheck;
use super::fe::BodyModes;
use super::matrices::{reduce, scatter, BodyMatrices, Reduced};
use super::modes::Extent;
use super::{ElasticBody, FullSystem, Kind, ProgressFn, Trace, TraceModes};
use crate::eigen::sparse::Method;
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
use crate::petsc::session::Petsc;
use crate::Result;
use faer::Mat;
use std::ops::Range;

/// A body given by its matrices.
pub struct MatrixBody<'p> {
    petsc: &'p Petsc<'p>,
    name: String,
    eigen: Method,
    /// On rank 0.
    matrices: Option<BodyMatrices>,
    stiffness: DistCsr,
    mass: DistCsr,
    damping: Option<DistCsr>,
    trace: Trace,
    /// The reduction that gave the modes; within it nothing on ranks other than 0.
    reduced: Option<Option<Reduced>>,
    shapes: Option<BodyModes>,
    order: CollectiveOrderCheck,
}

impl<'p> MatrixBody<'p> {
    /// Collective: the body `name` by the matrices of rank 0.
    pub fn new(petsc: &'p Petsc<'p>, name: &str, matrices: Option<BodyMatrices>) -> Result<Self> {
        let world = petsc.world();
        let m = matrices.as_ref();
        let (stiffness, mass) = (scatter(world, m.map(|m| &m.stiffness)), scatter(world, m.map(|m| &m.mass)));
        let damped = world.broadcast(vec![u8::from(m.is_some_and(|m| m.damping.is_some()))]) == [1];
        let damping = damped.then(|| scatter(world, m.and_then(|m| m.damping.as_ref())));
        let rows = m.map(BodyMatrices::rows);
        let trace = Trace::new(world, &stiffness.ranges, rows.as_deref())?;
        let (name, order) = (name.to_owned(), CollectiveOrderCheck::new(name));
        let eigen = Method::default();
        Ok(Self { petsc, name, eigen, matrices, stiffness, mass, damping, trace, reduced: None, shapes: None, order })
    }

    /// The same body with modes computed by `eigen`, if it is large.
    pub fn with_modes_by(self, eigen: Method) -> Self {
        Self { eigen, ..self }
    }

    /// Collective: modes and compliance; on rank 0.
    fn reduce(&self, extent: Extent, steps: &mut ProgressFn) -> Result<Option<Reduced>> {
        reduce(self.petsc, &self.name, self.matrices.as_ref(), extent, self.eigen, steps)
    }

    /// Number of degrees of freedom.
    pub fn dofs(&self) -> u64 {
        self.stiffness.order()
    }

    fn enter(&self, call: &'static str) -> Result<&'p World> {
        let world = self.petsc.world();
        self.order.enter(world, call)?;
        Ok(world)
    }

    /// Collective: the compliance, from the reduction that gave the modes or, without modes, from one of its own.
    fn statics(&self, steps: &mut ProgressFn) -> Result<Option<Mat<f64>>> {
        let of = |r: &Reduced| r.compliance.clone();
        if let Some(reduced) = &self.reduced {
            return Ok(reduced.as_ref().map(of));
        }
        let made = self.reduce(Extent::Count(0), steps)?;
        Ok(made.as_ref().map(of))
    }

    /// This rank's part of the modes of rank 0, `[n, m]`.
    fn distributed(&self, world: &World, modes: &TraceModes, vectors: Option<&Mat<f64>>) -> Option<BodyModes> {
        let known = world.broadcast(vec![u8::from(vectors.is_some())]) == [1];
        let column = |k: usize| {
            let parts = vectors.map_or(Vec::new(), |v| {
                let rows = |r: Range<u64>| r.map(|i| v[(i as usize, k)]).collect::<Vec<f64>>();
                (0..world.size).map(|rank| rows(self.stiffness.rows_of(rank))).collect()
            });
            world.scatter(parts)
        };
        known.then(|| BodyModes {
            omega: modes.omega.clone(),
            residual: Vec::new(),
            vectors: (0..modes.omega.len()).map(column).collect(),
        })
    }
}

impl ElasticBody for MatrixBody<'_> {
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> Kind {
        Kind::Matrices
    }

    fn rows(&self) -> usize {
        self.trace.rows()
    }

    fn compliance(&self, steps: &mut ProgressFn) -> Result<Option<Mat<f64>>> {
        self.enter("compliance")?;
        self.statics(steps)
    }

    fn modes(&mut self, extent: Extent, steps: &mut ProgressFn) -> Result<TraceModes> {
        let world = self.enter("modes")?;
        let reduced = self.reduce(extent, steps)?;
        let mut modes = reduced.as_ref().map(|r| r.modes.clone()).unwrap_or_default();
        modes.omega = world.broadcast(modes.omega);
        modes.reach = world.broadcast(vec![modes.reach])[0];
        self.shapes = self.distributed(world, &modes, reduced.as_ref().and_then(|r| r.vectors.as_ref()));
        self.reduced = Some(reduced);
        Ok(modes)
    }

    fn response(&self, forces: &[f64]) -> Result<Vec<f64>> {
        self.enter("response")?;
        let Some(compliance) = self.statics(&mut |_, _| {})? else { return Ok(Vec::new()) };
        let row = |i: usize| compliance.row(i).iter().zip(forces).map(|(c, f)| c * f).sum();
        Ok((0..compliance.nrows()).map(row).collect())
    }

    fn shapes(&self) -> Option<&BodyModes> {
        self.shapes.as_ref()
    }

    fn full_system(&self) -> Option<&dyn FullSystem> {
        Some(self)
    }
}

impl FullSystem for MatrixBody<'_> {
    fn name(&self) -> &str {
        &self.name
    }

    fn stiffness(&self) -> &DistCsr {
        &self.stiffness
    }

    fn mass(&self) -> &DistCsr {
        &self.mass
    }

    fn damping(&self) -> Option<&DistCsr> {
        self.damping.as_ref()
    }

    fn trace(&self) -> &Trace {
        &self.trace
    }
}
