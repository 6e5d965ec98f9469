//! Distributed assembly. Each rank holds every cell that touches its nodes and so computes its own
//! rows whole: no entry travels, and the pattern is known before the first value, from the node graph.

use super::dofs::{DofMap, FIXED};
use super::forms::{Coupling, Form, Mass, Stiffness};
use super::Material;
use crate::mesh::distribute::MeshPart;
use crate::mesh::quality;
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
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
    pub fn new(world: &World, part: &MeshPart, dofs: &DofMap, material: &Material) -> Result<Self> {
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
        Ok(Self { part, dofs, graph })
    }

    /// The matrix of a form; this rank's rows.
    pub fn assemble(&self, form: &dyn Form) -> DistCsr {
        let (part, dofs) = (self.part, self.dofs);
        let mut matrix = self.pattern(form.coupling());
        let full = form.coupling() == Coupling::Full;
        let per_node = form.coupling().per_node();
        let mut values = Vec::new();
        for cell in part.cells.iter() {
            let order = per_node * cell.nodes.len();
            values.resize(order * order, 0.0);
            form.matrix(cell, &cell.places(&part.coords), &mut values);
            for (a, &na) in cell.nodes.iter().enumerate() {
                if na as usize >= part.owned || dofs.local[na as usize] == FIXED {
                    continue;
                }
                let row = (dofs.local[na as usize] - dofs.begin()) as usize;
                let base = matrix.indptr[row];
                // The three rows of a node are equally long.
                let length = matrix.indptr[row + 1] - base;
                for (b, &nb) in cell.nodes.iter().enumerate() {
                    let first = dofs.local[nb as usize];
                    if first == FIXED {
                        continue;
                    }
                    // The pattern was made from these very cells: the column is there.
                    let at = base + matrix.cols[base..base + length].partition_point(|&c| u64::from(c) < first);
                    for c in 0..3 {
                        if full {
                            let from = order * (3 * a + c) + 3 * b;
                            let to = at + c * length;
                            (0..3).for_each(|d| matrix.values[to + d] += values[from + d]);
                        } else {
                            matrix.values[at + c * length] += values[order * a + b];
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
                    let row = (dofs.local[node as usize] - dofs.begin()) as usize;
                    (0..3).for_each(|c| load[row + c] += value * force[c]);
                }
            }
        }
        load
    }

    /// An empty matrix with the pattern of the graph: full 3×3 blocks, or only their diagonals.
    fn pattern(&self, coupling: Coupling) -> DistCsr {
        let dofs = self.dofs;
        let per_node = coupling.per_node();
        let entries: usize = self
            .graph
            .iter()
            .enumerate()
            .filter(|(n, _)| dofs.local[*n] != FIXED)
            .map(|(_, l)| 3 * per_node * l.iter().filter(|&&m| dofs.local[m as usize] != FIXED).count())
            .sum();
        let mut indptr = Vec::with_capacity(dofs.owned() + 1);
        let mut cols = Vec::with_capacity(entries);
        indptr.push(0);
        for (n, list) in self.graph.iter().enumerate() {
            if dofs.local[n] == FIXED {
                continue;
            }
            for c in 0..3 {
                for &m in list {
                    let first = dofs.local[m as usize];
                    match coupling {
                        _ if first == FIXED => {}
                        Coupling::Full => cols.extend((0..3).map(|d| (first + d) as u32)),
                        Coupling::Components => cols.push((first + c) as u32),
                    }
                }
                indptr.push(cols.len());
            }
        }
        let values = vec![0.0; cols.len()];
        DistCsr { ranges: dofs.ranges.clone(), indptr, cols, values }
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
