//! A finite-element body: its share of the mesh, its matrices, and what contact asks of them.

use super::averaged_trace::{self, AveragedTrace, MeshContact, NodeAccess};
use super::rigid_motions::RigidMotions;
use super::statics::Statics;
use super::supports::{Effect, Supported};
use super::trace::Trace;
use super::FullSystem;
use crate::fem::assembly::Operators;
use crate::fem::dofs::{DofMap, FIXED};
use crate::fem::ElasticMaterial;
use crate::grid::ContactGrid;
use crate::job::Support;
use crate::mesh::distribute::{distribute, MeshPart};
use crate::mesh::Mesh;
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
use crate::petsc::exchange::Exchange;
use crate::{Error, Result};
use faer::Mat;

/// A body of finite elements, distributed over the ranks, in lower form.
pub struct FeBody {
    /// Name in messages and results.
    pub name: String,
    /// This rank's share of the mesh.
    pub part: MeshPart,
    /// Numbers of the free degrees of freedom.
    pub dofs: DofMap,
    /// Material.
    pub material: ElasticMaterial,
    /// Stiffness and mass.
    pub operators: Operators,
    /// Its contact rows; none where it has no contact surface.
    pub trace: Trace,
    /// Terms of its contact rows, where they follow from means over a disc.
    pub means: Option<AveragedTrace>,
    /// Terms of its supports beside stiffness and mass.
    pub effect: Effect,
    /// The rigid motions that its supports leave free.
    pub rigid: RigidMotions,
    /// True if no rigid motion is free.
    pub supported: bool,
    ghosts: Exchange,
    node_ghosts: Exchange,
}

/// Free-interface modes of a body: contact open, supports held.
pub struct BodyModes {
    /// Angular frequencies, rad/s, ascending; exactly 0 for rigid-body modes.
    pub omega: Vec<f64>,
    /// Relative residuals ‖Kφ − ω²Mφ‖ / (|ω² − σ| ‖Mφ‖) with the shift σ.
    pub residual: Vec<f64>,
    /// Mass-normalised modes, this rank's degrees of freedom, `[modes][owned]`, 1/√kg.
    pub vectors: Vec<Vec<f64>>,
}

impl FeBody {
    /// Collective: distributes the mesh that rank 0 holds, with the contact nodes of a `grid` where there is contact,
    /// and assembles the body. `fixed` names the supported groups.
    pub fn new(
        world: &World,
        name: &str,
        mesh: Option<&Mesh>,
        grid: Option<&ContactGrid>,
        material: ElasticMaterial,
        fixed: &[String],
    ) -> Result<Self> {
        let contacts: Vec<MeshContact> = grid.map(|grid| MeshContact::Grid { grid, along: 0.0 }).into_iter().collect();
        Self::held(world, name, mesh, &contacts, material, (fixed, &[]))
    }

    /// Collective: [`FeBody::new`] with several `contacts`, which rank 0 gives, and the `supports` of a job beside the
    /// clamped groups.
    pub fn held(
        world: &World,
        name: &str,
        mesh: Option<&Mesh>,
        contacts: &[MeshContact],
        material: ElasticMaterial,
        (fixed, supports): (&[String], &[Support]),
    ) -> Result<Self> {
        world.on_root(|| match mesh {
            Some(m) => fixed.iter().try_for_each(|g| m.require_group(g, &format!("bodies.{name}.fixed: the mesh"))),
            None => Err(Error::Defect("no mesh on rank 0".into())),
        })?;
        let part = distribute(world, mesh)?;
        let dofs = DofMap::new(world, &part, fixed);
        let named = |e: Error| e.context(format!("body \"{name}\""));
        let mut operators = Operators::new(world, &part, &dofs, &material).map_err(named)?;
        let body = Supported { name, mesh, part: &part, dofs: &dofs, material };
        let effect = body.hold(world, supports, &mut operators)?;
        let rigid = RigidMotions::new(world, &part, &dofs, &operators, &effect).map_err(named)?;
        let ghosts = Exchange::new(world, &dofs.ranges, columns(&part, &dofs));
        // Local ghosts are ascending, so are the exchange's: the fetched values are in the order of `node_ids`.
        let node_ghosts = Exchange::new(world, &part.ranges, part.node_ids.iter().copied());
        let supported = rigid.is_empty();
        let first = |node: u32| first_at(name, node, &part, &dofs);
        let place = |node: u32| mesh.map_or([0.0; 3], |mesh| mesh.nodes[node as usize]);
        let nodes = NodeAccess { first: &first, place: &place };
        let (trace, means) = averaged_trace::trace(world, &dofs.ranges, contacts, &nodes).map_err(named)?;
        world.agree(contact_is_free(name, &trace, &effect))?;
        let name = name.into();
        Ok(Self { name, part, dofs, material, operators, trace, means, effect, rigid, supported, ghosts, node_ghosts })
    }

    /// Collective: compliance P K⁻¹ Pᵀ of the contact rows (x, y, n into the body), m/N, `[3n, 3n]` on rank 0, `None`
    /// elsewhere.
    pub fn compliance(
        &self,
        world: &World,
        statics: &mut Statics,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Option<Mat<f64>>> {
        let block = statics.inverse_block(&self.trace.dofs(), progress)?;
        Ok(world.is_root().then(|| self.trace.enclose(block.as_ref())))
    }

    /// Collective: forces on the contact rows (x, y, n), N, `[3n]` on rank 0, as a load on this rank's degrees of
    /// freedom.
    pub fn load(&self, world: &World, forces: &[f64]) -> Vec<f64> {
        let mut load = vec![0.0; self.dofs.owned()];
        self.trace.spread(world, forces, &mut load);
        load
    }

    /// Collective: this rank's degrees of freedom, m, under forces on the contact rows (x, y, n), N, `[3n]` on rank 0.
    pub fn response(&self, world: &World, statics: &mut Statics, forces: &[f64]) -> Result<Vec<f64>> {
        let mut u = self.load(world, forces);
        statics.solve(&mut u, 1)?;
        Ok(u)
    }

    /// Position at which the three degrees of freedom of an owned node begin among those of this rank; none at a
    /// support.
    fn first_of(&self, node: usize) -> Option<usize> {
        let first = self.dofs.local[node];
        (first != FIXED).then(|| (first - self.dofs.first()) as usize)
    }

    /// Collective: a vector of this rank's degrees of freedom at an owned node, given on the rank that owns it; (x,
    /// y, z) on every rank, 0 at a support.
    pub fn at_node(&self, world: &World, u: &[f64], node: Option<usize>) -> [f64; 3] {
        let first = node.and_then(|node| self.first_of(node));
        let here: [f64; 3] = first.map_or([0.0; 3], |f| std::array::from_fn(|c| u[f + c]));
        here.map(|v| world.sum(v))
    }

    /// Collective: contact rows (x, y, n) under unit forces (x, y, z) at an owned node, given on the rank that owns
    /// it, m/N, `[3][3n]` on rank 0, empty elsewhere; 0 at a support.
    pub fn transfer(&self, world: &World, statics: &mut Statics, node: Option<usize>) -> Result<[Vec<f64>; 3]> {
        let owned = self.dofs.owned();
        let first = node.and_then(|node| self.first_of(node));
        let mut u = vec![0.0; 3 * owned];
        if let Some(first) = first {
            (0..3).for_each(|c| u[c * owned + first + c] = 1.0);
        }
        u.chunks_exact_mut(owned.max(1)).for_each(|u| self.effect.clear(&self.dofs, u));
        statics.solve(&mut u, 3)?;
        let rows = self.trace.gather(world, 3, |c| &u[c * owned..(c + 1) * owned]);
        Ok([0, 1, 2].map(|c| rows.as_ref().map_or(Vec::new(), |rows| rows.col(c).iter().copied().collect())))
    }

    /// Collective: a vector of this rank's degrees of freedom as values at the local nodes (ghosts included), 0 at
    /// supports.
    pub fn at_nodes(&self, world: &World, u: &[f64]) -> Vec<[f64; 3]> {
        let fetched = self.ghosts.fetch(world, u);
        let begin = self.dofs.first();
        let value = |dof: u64| match self.ghosts.ghosts().binary_search(&dof) {
            Ok(at) => fetched[at],
            Err(_) => u[(dof - begin) as usize],
        };
        let node =
            |&first: &u64| if first == FIXED { [0.0; 3] } else { std::array::from_fn(|c| value(first + c as u64)) };
        self.dofs.local.iter().map(node).collect()
    }

    /// Collective: values of the owned nodes, `[owned]`, completed by those of the ghosts, `[node_ids.len()]`.
    pub(crate) fn at_all_nodes(&self, world: &World, owned: &[f64]) -> Vec<f64> {
        let mut all = owned.to_vec();
        all.extend(self.node_ghosts.fetch(world, owned));
        all
    }

    /// Collective: modes at the contact rows (x, y, n), `[3n, modes]` on rank 0, `None` elsewhere.
    pub fn contact_modes(&self, world: &World, modes: &BodyModes) -> Option<Mat<f64>> {
        self.trace.gather(world, modes.vectors.len(), |k| &modes.vectors[k])
    }

    /// Collective: diagonal of the bounding box, m.
    pub fn diameter(&self, world: &World) -> f64 {
        let extent = |c: usize| {
            let top = self.part.coords.iter().map(|p| p[c]).fold(f64::NEG_INFINITY, f64::max);
            let bottom = self.part.coords.iter().map(|p| -p[c]).fold(f64::NEG_INFINITY, f64::max);
            world.max(top) + world.max(bottom)
        };
        (0..3).map(|c| extent(c).powi(2)).sum::<f64>().sqrt()
    }
}

/// Refuses single components clamped at the contact.
fn contact_is_free(name: &str, trace: &Trace, effect: &Effect) -> Result<()> {
    match trace.dofs().iter().any(|d| effect.held.binary_search(d).is_ok()) {
        true => Err(Error::Job(format!(
            "bodies.{name}.supports: a clamp or a plane of symmetry holds a node of the contact surface; their \
             groups must not touch the contact patch"
        ))),
        false => Ok(()),
    }
}

/// On rank 0: the first degree of freedom of a `node` of the contact surface.
fn first_at(name: &str, node: u32, part: &MeshPart, dofs: &DofMap) -> Result<u64> {
    match dofs.all[part.renumbered[node as usize] as usize] {
        FIXED => Err(Error::Job(format!(
            "bodies.{name}.fixed: a support holds node {node} of the contact surface; the groups in `fixed` \
             must not touch the contact patch"
        ))),
        first => Ok(first),
    }
}

fn columns(part: &MeshPart, dofs: &DofMap) -> Vec<u64> {
    let ghosts = &dofs.local[part.owned..];
    ghosts.iter().filter(|&&d| d != FIXED).flat_map(|&d| [d, d + 1, d + 2]).collect()
}

impl FullSystem for FeBody {
    fn name(&self) -> &str {
        &self.name
    }

    fn stiffness(&self) -> &DistCsr {
        &self.operators.stiffness
    }

    fn mass(&self) -> &DistCsr {
        &self.operators.mass
    }

    fn damping(&self) -> Option<&DistCsr> {
        self.effect.damping.as_ref()
    }

    fn lossy(&self) -> Option<&DistCsr> {
        self.effect.lossy.as_ref()
    }

    fn trace(&self) -> &Trace {
        &self.trace
    }
}
