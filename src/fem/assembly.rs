//! Distributed assembly. Each rank holds every cell that touches its nodes and so computes its own
//! rows whole: no entry travels, and the pattern is known before the first value, from the node graph.

use super::dofs::{DofMap, FIXED};
use super::forms::{Form, Mass, NodeCoupling, Stiffness};
use super::ElasticMaterial;
use crate::mesh::distribute::MeshPart;
use crate::mesh::quality;
use crate::parallel::World;
use crate::petsc::csr::{DistCsr, Stored};
use crate::{Error, Result};
use std::rc::Rc;

/// Stiffness and mass of the free degrees of freedom of one body.
#[derive(Debug, Clone)]
pub struct Operators {
    /// Stiffness K, N/m; shared with iterative solvers.
    pub stiffness: Rc<DistCsr>,
    /// Consistent mass M, kg; couples equal components only.
    pub mass: DistCsr,
}

impl Operators {
    /// Collective: K and M of a body of one material. An element that is inverted is an [`Error::Input`] that names it.
    pub fn new(world: &World, part: &MeshPart, dofs: &DofMap, material: &ElasticMaterial) -> Result<Self> {
        let assembly = Assembly::new(world, part, dofs)?;
        let stiffness = assembly.assemble(&Stiffness(*material));
        let mass = assembly.assemble(&Mass { density: material.density });
        Ok(Self { stiffness: Rc::new(stiffness), mass })
    }
}

/// The cells of a body and which of its nodes they couple: what the assembly of any form needs.
pub struct Assembly<'a> {
    part: &'a MeshPart,
    dofs: &'a DofMap,
    /// Sorted neighbours (itself included) of each owned node, as local nodes ordered by global number.
    graph: Vec<Vec<u32>>,
    /// The cells by their first nodes: one after another they meet in rows that are still in the cache.
    order: Vec<u32>,
}

impl<'a> Assembly<'a> {
    /// Collective: checks the cells. One that is inverted is an [`Error::Input`] that names it.
    pub fn new(world: &World, part: &'a MeshPart, dofs: &'a DofMap) -> Result<Self> {
        if dofs.total() > u64::from(u32::MAX) {
            return Err(Error::Memory(format!(
                "{} degrees of freedom, more than a matrix can number here",
                dofs.total()
            )));
        }
        world.agree(check(part))?;
        let mut graph: Vec<Vec<u32>> = vec![Vec::new(); part.owned];
        for cell in part.cells.iter() {
            for &a in cell.nodes.iter().filter(|&&a| (a as usize) < part.owned) {
                graph[a as usize].extend_from_slice(cell.nodes);
            }
        }
        for list in &mut graph {
            list.sort_unstable_by_key(|&n| part.node_ids[n as usize]);
            list.dedup();
        }
        let mut order: Vec<(u32, u32)> =
            part.cells.iter().zip(0..).map(|(cell, i)| (cell.nodes.iter().copied().min().unwrap_or(0), i)).collect();
        order.sort_unstable();
        Ok(Self { part, dofs, graph, order: order.into_iter().map(|(_, cell)| cell).collect() })
    }

    /// The matrix of a form; this rank's rows, of a symmetric one half of the entries between them ([`Stored::Lower`]).
    pub fn assemble(&self, form: &dyn Form) -> DistCsr {
        let (part, dofs) = (self.part, self.dofs);
        let half = form.symmetric();
        let mut matrix = self.pattern(form.coupling(), half);
        let full = form.coupling() == NodeCoupling::Full;
        let per_node = form.coupling().per_node();
        let mut values = Vec::new();
        for cell in self.order.iter().map(|&cell| part.cells.get(cell as usize)) {
            let order = per_node * cell.nodes.len();
            values.resize(order * order, 0.0);
            form.matrix(cell, &cell.places(&part.coords), &mut values);
            for (a, &na) in cell.nodes.iter().enumerate() {
                if na as usize >= part.owned || dofs.local[na as usize] == FIXED {
                    continue;
                }
                let own = dofs.local[na as usize];
                let row = (own - dofs.first()) as usize;
                let begins = [0, 1, 2].map(|c| matrix.indptr[row + c]);
                let length = matrix.indptr[row + 1] - begins[0];
                for (b, &nb) in cell.nodes.iter().enumerate() {
                    let first = dofs.local[nb as usize];
                    if first == FIXED || half && first > own && (nb as usize) < part.owned {
                        continue;
                    }
                    // The pattern was made from these very cells: the column is there.
                    let at = matrix.cols[begins[0]..begins[0] + length].partition_point(|&c| u64::from(c) < first);
                    for c in 0..3 {
                        // Of its own block a row of half a matrix has one entry more than the row before.
                        let to = begins[c] + at + if half && full && first > own { c } else { 0 };
                        if full {
                            let from = order * (3 * a + c) + 3 * b;
                            let count = if half && first == own { c + 1 } else { 3 };
                            (0..count).for_each(|d| matrix.values[to + d] += values[from + d]);
                        } else {
                            matrix.values[to] += values[order * a + b];
                        }
                    }
                }
            }
        }
        matrix
    }

    /// Load ∫ f·v dV of a body force f(x), N/m³, on this rank's degrees of freedom, N.
    pub fn load(&self, force: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
        let (part, dofs) = (self.part, self.dofs);
        let mut load = vec![0.0; dofs.owned()];
        for cell in part.cells.iter() {
            let x = cell.places(&part.coords);
            for p in cell.kind.mass_rule() {
                let shape = &p.shape;
                let volume = p.weight * quality::determinant(&quality::jacobian(&x, shape));
                let place = std::array::from_fn(|c| x.iter().zip(&shape.values).map(|(x, n)| n * x[c]).sum());
                let force = force(place).map(|f| f * volume);
                for (&node, value) in cell.nodes.iter().zip(&shape.values) {
                    if node as usize >= part.owned || dofs.local[node as usize] == FIXED {
                        continue;
                    }
                    let row = (dofs.local[node as usize] - dofs.first()) as usize;
                    (0..3).for_each(|c| load[row + c] += value * force[c]);
                }
            }
        }
        load
    }

    /// First degrees of freedom of the free nodes of `list` that the node of the degree of freedom `own` couples to,
    /// as far as they are stored.
    fn coupled<'s>(&'s self, own: u64, list: &'s [u32], half: bool) -> impl Iterator<Item = u64> + 's {
        let mirrored = move |m: u32, first: u64| half && first > own && (m as usize) < self.part.owned;
        let each = list.iter().map(|&m| (m, self.dofs.local[m as usize]));
        each.filter(move |&(m, first)| first != FIXED && !mirrored(m, first)).map(|(_, first)| first)
    }

    /// An empty matrix with the pattern of the graph: full 3×3 blocks, or only their diagonals; `half` of a symmetric
    /// one.
    fn pattern(&self, coupling: NodeCoupling, half: bool) -> DistCsr {
        let dofs = self.dofs;
        let free = || self.graph.iter().enumerate().map(|(n, l)| (dofs.local[n], &l[..])).filter(|n| n.0 != FIXED);
        let blocks: usize = free().map(|(own, list)| self.coupled(own, list, half).count()).sum();
        // Above the diagonals of the blocks there are three entries.
        let left_out = if half && coupling == NodeCoupling::Full { dofs.owned() } else { 0 };
        let entries = 3 * coupling.per_node() * blocks - left_out;
        let mut indptr = Vec::with_capacity(dofs.owned() + 1);
        let mut cols = Vec::with_capacity(entries);
        indptr.push(0);
        for (own, list) in free() {
            for c in 0..3 {
                for first in self.coupled(own, list, half) {
                    match coupling {
                        NodeCoupling::Full if half && first == own => cols.extend((0..=c).map(|d| (first + d) as u32)),
                        NodeCoupling::Full => cols.extend((0..3).map(|d| (first + d) as u32)),
                        NodeCoupling::Components => cols.push((first + c) as u32),
                    }
                }
                indptr.push(cols.len());
            }
        }
        let values = vec![0.0; cols.len()];
        let stored = if half { Stored::Lower { first: dofs.first() } } else { Stored::Whole };
        DistCsr { ranges: dofs.ranges.clone(), indptr, cols, values, stored }
    }
}

/// Refuses inverted cells.
fn check(part: &MeshPart) -> Result<()> {
    for (cell, id) in part.cells.iter().zip(&part.cell_ids) {
        let x = cell.places(&part.coords);
        let [det, _] = quality::jacobian_range(cell.kind, &x);
        if det.is_nan() || det <= 0.0 {
            return Err(Error::Input(format!(
                "mesh: element {id} ({}) is inverted or degenerate (Jacobian {det:e} m³ at a node, must be positive); \
                 its nodes are {x:?}; repair the mesh",
                cell.kind.topology().name
            )));
        }
    }
    Ok(())
}

/// Collective: volume of the mesh, m³, each cell counted once.
pub fn volume(world: &World, part: &MeshPart) -> f64 {
    let owned = part.cells.iter().zip(&part.cell_owned).filter(|(_, &o)| o);
    world.sum(owned.map(|(c, _)| quality::volume(c.kind, &c.places(&part.coords))).sum())
}
