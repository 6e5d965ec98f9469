//! Statics of a body that nothing holds, by inertia relief: loads are balanced by the inertia of the rigid motion
//! that they cause, and the displacement is the one without a rigid part, QᵀK_c⁻¹Q f with Q = I − MΦ_rΦ_rᵀ. K_c is
//! the stiffness held at as few degrees of freedom as determine the body: they bear nothing under a balanced load, so
//! that it does not matter which they are.

use super::rigid_motions::{products, RigidMotions};
use crate::eigen::Shifted;
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
use crate::petsc::mumps::{Factor, FactorOptions, Symmetry};
use crate::Result;
use faer::Mat;

/// A factorisation of K_c, and the rigid motions.
pub struct InertiaRelief<'p> {
    world: &'p World,
    factor: Factor<'p>,
    rigid: RigidMotions,
    /// The degrees of freedom that K_c holds, global.
    held: Vec<u64>,
    ranges: Vec<u64>,
}

impl<'p> InertiaRelief<'p> {
    /// Collective: factorises the stiffness of a body with the free motions `rigid`.
    pub fn new(world: &'p World, stiffness: &DistCsr, rigid: &RigidMotions, name: &str) -> Result<Self> {
        let mut held = determining(world, &stiffness.ranges, rigid);
        held.sort_unstable();
        let mut k = stiffness.clone();
        k.hold(world.rank, &held, 1.0);
        let factor = Factor::new(world, &k, FactorOptions::new(Symmetry::Positive), name)?;
        Ok(Self { world, factor, rigid: rigid.clone(), held, ranges: stiffness.ranges.clone() })
    }

    /// The factorisation.
    pub fn factor(&self) -> &Factor<'p> {
        &self.factor
    }

    /// The rigid motions.
    pub fn rigid(&self) -> &RigidMotions {
        &self.rigid
    }

    /// Collective: the deformations under `count` loads in place, `[owned, count]`, N in, m out.
    pub fn solve(&mut self, f: &mut [f64], count: usize) -> Result<()> {
        self.rigid.balance(self.world, f, count);
        self.held_at_rest(f, count);
        self.factor.solve(f, count)?;
        self.rigid.deform(self.world, f, count);
        Ok(())
    }

    /// Sets loads to 0 where K_c is held.
    fn held_at_rest(&self, f: &mut [f64], count: usize) {
        let own = self.ranges[self.world.rank]..self.ranges[self.world.rank + 1];
        let n = (own.end - own.start) as usize;
        for dof in self.held.iter().filter(|d| own.contains(d)) {
            (0..count).for_each(|k| f[k * n + (dof - own.start) as usize] = 0.0);
        }
    }

    /// Collective: entries of QᵀK_c⁻¹Q at `rows` × `rows` (the same on every rank), m/N, on rank 0: with Z =
    /// K_c⁻¹MΦ_r it is K_c⁻¹ − ZΦ_rᵀ − Φ_rZᵀ + Φ_r(Φ_rᵀMZ)Φ_rᵀ.
    pub fn inverse_block(&mut self, rows: &[u64]) -> Result<Mat<f64>> {
        let world = self.world;
        let (r, n) = (self.rigid.len(), self.rigid.shapes.first().map_or(0, Vec::len));
        let mut z = self.rigid.loads.concat();
        self.held_at_rest(&mut z, r);
        self.factor.solve(&mut z, r)?;
        let z: Vec<Vec<f64>> = (0..r).map(|k| z[k * n..(k + 1) * n].to_vec()).collect();
        let inner = products(world, &self.rigid.loads, &z);
        let [z, phi] = [&z, &self.rigid.shapes].map(|vectors| self.at(rows, vectors));
        let mut block = self.factor.inverse_block(rows)?;
        if !world.is_root() {
            return Ok(block);
        }
        for i in 0..rows.len() {
            for j in 0..rows.len() {
                if self.held.contains(&rows[i]) || self.held.contains(&rows[j]) {
                    block[(i, j)] = 0.0;
                }
            }
        }
        let mixed = &z * phi.transpose();
        Ok(block - &mixed - mixed.transpose() + &phi * inner * phi.transpose())
    }

    /// Collective: vectors at `rows`, `[rows, vectors]` on every rank.
    fn at(&self, rows: &[u64], vectors: &[Vec<f64>]) -> Mat<f64> {
        let own = self.ranges[self.world.rank]..self.ranges[self.world.rank + 1];
        let value = |v: &Vec<f64>, row: u64| if own.contains(&row) { v[(row - own.start) as usize] } else { 0.0 };
        let mine: Vec<f64> = vectors.iter().flat_map(|v| rows.iter().map(move |&row| value(v, row))).collect();
        let all = self.world.sum_all(&mine);
        Mat::from_fn(rows.len(), vectors.len(), |i, k| all[i + rows.len() * k])
    }
}

/// The inverse for elastic modes at the shift 0: rigid motions, which lie below it, are no part of its range.
impl Shifted for InertiaRelief<'_> {
    fn sigma(&self) -> f64 {
        0.0
    }

    fn solve(&mut self, x: &mut [f64], columns: usize) -> Result<()> {
        InertiaRelief::solve(self, x, columns)
    }

    fn below(&self) -> u64 {
        self.rigid.len() as u64
    }
}

/// Collective: one degree of freedom for each rigid motion, so that a motion that vanishes at all of them vanishes:
/// by elimination with the largest remaining entry as pivot.
fn determining(world: &World, ranges: &[u64], rigid: &RigidMotions) -> Vec<u64> {
    let mut rest = rigid.shapes.clone();
    let first = ranges[world.rank];
    let mut chosen = Vec::new();
    for k in 0..rest.len() {
        // Any motion left may have the pivot; the largest entry of all is found once for each.
        let entry = |m: usize, i: usize| rest[m][i].abs();
        let own = (k..rest.len()).flat_map(|m| (0..rest[m].len()).map(move |i| (m, i)));
        let best = own.max_by(|a, b| entry(a.0, a.1).total_cmp(&entry(b.0, b.1)));
        let size = best.map_or(-1.0, |(m, i)| entry(m, i));
        let largest = world.max(size);
        // Of several ranks with the same entry the lowest row is taken.
        let mine = best.filter(|_| size == largest).map_or(u64::MAX, |(_, i)| first + i as u64);
        let Some((rank, dof)) = world.all_gather(&[mine]).into_iter().enumerate().min_by_key(|c| c.1) else { break };
        let motion = world.all_gather(&[best.map_or(0, |b| b.0 as u64)])[rank] as usize;
        rest.swap(k, motion);
        let row: Vec<f64> =
            rest.iter().map(|v| if rank == world.rank { v[(dof - first) as usize] } else { 0.0 }).collect();
        let row = world.sum_all(&row);
        let pivot = rest[k].clone();
        for m in k + 1..rest.len() {
            let factor = row[m] / row[k];
            rest[m].iter_mut().zip(&pivot).for_each(|(v, p)| *v -= factor * p);
        }
        chosen.push(dof);
    }
    chosen
}
