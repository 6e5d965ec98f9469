//! The rigid motions that the supports of a body leave free, known by geometry: no eigenvalue decides which they are.

use super::supports::Effect;
use crate::dense::symmetric_eigen;
use crate::fem::assembly::Operators;
use crate::fem::dofs::{DofMap, FIXED};
use crate::mesh::distribute::MeshPart;
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
use crate::{Error, Result};
use faer::Mat;

/// A motion is free where what holds the body resists it by less than this part of what it resists most: rounding
/// against the square of a small support's size over the body's.
const FREE: f64 = 1e-12;
/// Largest force by a rigid motion, over the norm of the stiffness times the motion.
const FORCE: f64 = 1e-10;

/// The free rigid motions Φ_r of a body, orthonormal in its mass, this rank's degrees of freedom, 1/√kg; none of a
/// body that is held.
#[derive(Debug, Clone, Default)]
pub struct RigidMotions {
    /// Φ_r, `[r][owned]`.
    pub shapes: Vec<Vec<f64>>,
    /// MΦ_r, `[r][owned]`.
    pub loads: Vec<Vec<f64>>,
}

impl RigidMotions {
    /// Collective: those of the body with these matrices whose supports have this `effect`.
    pub fn new(world: &World, part: &MeshPart, dofs: &DofMap, operators: &Operators, effect: &Effect) -> Result<Self> {
        let all = candidates(world, part);
        let of_nodes = |k: usize, free: bool| -> Vec<f64> {
            let nodes = (0..part.owned).filter(|&n| (dofs.local[n] != FIXED) == free);
            nodes.flat_map(|n| all[k][n]).collect()
        };
        let moving: Vec<Vec<f64>> = (0..6).map(|k| of_nodes(k, true)).collect();
        let clamped: Vec<Vec<f64>> = (0..6).map(|k| of_nodes(k, false)).collect();
        let own = dofs.first()..dofs.first() + dofs.owned() as u64;
        let held: Vec<usize> =
            effect.held.iter().filter(|d| own.contains(d)).map(|d| (d - own.start) as usize).collect();
        let at_held: Vec<Vec<f64>> = moving.iter().map(|m| held.iter().map(|&d| m[d]).collect()).collect();
        let mut resistance = Mat::<f64>::zeros(6, 6);
        let mut add = |form: Mat<f64>| {
            let trace: f64 = (0..6).map(|k| form[(k, k)]).sum();
            if trace > 0.0 {
                resistance += faer::Scale(1.0 / trace) * form;
            }
        };
        add(products(world, &clamped, &clamped));
        add(products(world, &at_held, &at_held));
        for springs in &effect.springs {
            add(products(world, &moving, &images(world, springs, &moving)));
        }
        let missing = || Error::NotConverged("the rigid motions of a body that its supports leave free".into());
        let (values, vectors) = symmetric_eigen(resistance.as_ref()).ok_or_else(missing)?;
        let largest = values.last().copied().unwrap_or(0.0);
        let free: Vec<usize> = (0..6).filter(|&k| values[k] <= FREE * largest).collect();
        let mut shapes: Vec<Vec<f64>> = free
            .iter()
            .map(|&k| {
                let mut sum = vec![0.0; dofs.owned()];
                for (motion, j) in moving.iter().zip(0..) {
                    sum.iter_mut().zip(motion).for_each(|(s, m)| *s += vectors[(j, k)] * m);
                }
                effect.clear(dofs, &mut sum);
                sum
            })
            .collect();
        orthonormalise(world, &operators.mass, &mut shapes)?;
        let loads = images(world, &operators.mass, &shapes);
        let norm = operators.stiffness.norm_inf(world);
        for (shape, force) in shapes.iter().zip(images(world, &operators.stiffness, &shapes)) {
            let size = |v: &[f64]| world.max(v.iter().fold(0.0, |m: f64, x| m.max(x.abs())));
            let (force, motion) = (size(&force), size(shape));
            if force > FORCE * norm * motion {
                return Err(Error::Input(format!(
                    "a rigid motion of {motion:e} makes a force of {force:e} in a stiffness of the norm \
                     {norm:e}, expected none; \
                     are there springs so weak (or the coordinates so large) that rounding hides them?"
                )));
            }
        }
        Ok(Self { shapes, loads })
    }

    /// Their number r.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Returns whether the body is held.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Collective: Q f = f − MΦ_r Φ_rᵀ f of `count` loads, N, `[owned, count]`: what of them does not accelerate the
    /// body.
    pub fn balance(&self, world: &World, loads: &mut [f64], count: usize) {
        project(world, loads, count, &self.shapes, &self.loads);
    }

    /// Collective: Qᵀ u = u − Φ_r Φ_rᵀ M u of `count` motions, `[owned, count]`: what of them is not rigid.
    pub fn deform(&self, world: &World, motions: &mut [f64], count: usize) {
        project(world, motions, count, &self.loads, &self.shapes);
    }
}

/// Collective: x −= B Aᵀ x for each of `count` columns.
fn project(world: &World, x: &mut [f64], count: usize, a: &[Vec<f64>], b: &[Vec<f64>]) {
    let n = x.len() / count.max(1);
    let column = |k: usize| k * n..(k + 1) * n;
    let dot = |k: usize, v: &Vec<f64>| -> f64 { x[column(k)].iter().zip(v).map(|(x, a)| x * a).sum() };
    let own: Vec<f64> = (0..count).flat_map(|k| a.iter().map(move |v| (k, v))).map(|(k, v)| dot(k, v)).collect();
    let all = world.sum_all(&own);
    for k in 0..count {
        for (b, amount) in b.iter().zip(&all[k * a.len()..]) {
            x[column(k)].iter_mut().zip(b).for_each(|(x, b)| *x -= amount * b);
        }
    }
}

/// Collective: the six motions at the nodes of this rank: translations, rotations about the middle of the nodes over
/// the size of the body.
fn candidates(world: &World, part: &MeshPart) -> [Vec<[f64; 3]>; 6] {
    let own = &part.coords[..part.owned];
    let mut sums = [0.0; 4];
    for x in own {
        (0..3).for_each(|c| sums[c] += x[c]);
        sums[3] += 1.0;
    }
    let sums = world.sum_all(&sums);
    let centre: [f64; 3] = std::array::from_fn(|c| sums[c] / sums[3].max(1.0));
    let arm = |x: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|c| x[c] - centre[c]) };
    let reach = world.max(own.iter().map(|x| arm(x).iter().map(|v| v * v).sum::<f64>().sqrt()).fold(0.0, f64::max));
    std::array::from_fn(|k| {
        let (axis, turns) = (k % 3, k >= 3);
        let motion = |x: &[f64; 3]| -> [f64; 3] {
            let mut u = [0.0; 3];
            if turns {
                let r = arm(x).map(|v| v / reach);
                u[(axis + 1) % 3] = -r[(axis + 2) % 3];
                u[(axis + 2) % 3] = r[(axis + 1) % 3];
            } else {
                u[axis] = 1.0;
            }
            u
        };
        own.iter().map(motion).collect()
    })
}

/// Collective: the images of vectors.
pub(super) fn images(world: &World, matrix: &DistCsr, vectors: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let operator = matrix.operator(world);
    let image = |v: &Vec<f64>| {
        let mut out = vec![0.0; v.len()];
        operator.apply(world, v, &mut out);
        out
    };
    vectors.iter().map(image).collect()
}

/// Collective: AᵀB on every rank.
pub(super) fn products(world: &World, a: &[Vec<f64>], b: &[Vec<f64>]) -> Mat<f64> {
    let dot = |x: &Vec<f64>, y: &Vec<f64>| -> f64 { x.iter().zip(y).map(|(x, y)| x * y).sum() };
    let own: Vec<f64> = b.iter().flat_map(|y| a.iter().map(move |x| dot(x, y))).collect();
    let all = world.sum_all(&own);
    Mat::from_fn(a.len(), b.len(), |i, j| all[i + a.len() * j])
}

/// Collective: φᵀKφ of each of the vectors in springs, `[vectors]`, on every rank.
pub(crate) fn in_springs(world: &World, springs: &DistCsr, vectors: &[Vec<f64>]) -> Vec<f64> {
    let dot = |(x, y): (&Vec<f64>, &Vec<f64>)| -> f64 { x.iter().zip(y).map(|(x, y)| x * y).sum() };
    let own: Vec<f64> = vectors.iter().zip(&images(world, springs, vectors)).map(dot).collect();
    world.sum_all(&own)
}

/// Collective: makes vectors orthonormal in the mass, twice for what rounding left the first time.
fn orthonormalise(world: &World, mass: &DistCsr, vectors: &mut [Vec<f64>]) -> Result<()> {
    for _ in 0..2 {
        for k in 0..vectors.len() {
            let (before, rest) = vectors.split_at_mut(k);
            let load = &images(world, mass, &rest[..1])[0];
            let own: Vec<f64> = before.iter().map(|b| b.iter().zip(load).map(|(b, l)| b * l).sum()).collect();
            let vector = &mut rest[0];
            for (b, amount) in before.iter().zip(world.sum_all(&own)) {
                vector.iter_mut().zip(b).for_each(|(v, b)| *v -= amount * b);
            }
            let load = &images(world, mass, &rest[..1])[0];
            let vector = &mut rest[0];
            let size = world.sum(vector.iter().zip(load).map(|(v, l)| v * l).sum()).sqrt();
            if !(size > 0.0) {
                return Err(Error::Input("a body has no mass in one of its rigid motions".into()));
            }
            vector.iter_mut().for_each(|v| *v /= size);
        }
    }
    Ok(())
}
