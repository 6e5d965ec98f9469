//! Terms that rotation of a body of finite elements adds to its modes, and whether it is one of revolution.

use super::fe::{BodyModes, FeBody};
use super::modal::ModalMatrix;
use super::statics::Statics;
use crate::fem::assembly::Assembly;
use crate::fem::forms::{Convected, Gyroscopic, PrestressStiffness};
use crate::fem::rotation::Axis;
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
use crate::{Error, Result};
use faer::{Mat, MatRef};
use std::rc::Rc;

/// Largest velocity of the material through the surface, over that of its fastest point, of a body that passes as one
/// of revolution: a mesh has flat facets.
const THROUGH: f64 = 0.05;
/// Largest share of a support that varies with the angle, likewise.
const UNEVEN: f64 = 0.05;
/// Rounds in which the stress of a free body that rotates is found at the most, and change of what is left of the
/// forces, over them, after which it is known.
const ROUNDS: usize = 60;
const BALANCED: f64 = 1e-11;
/// Harmonics of the angle that a support is examined for.
const HARMONICS: usize = 8;

/// Rotation in the space of the free-interface modes Φ, at 1 rad/s, each `[m, m]`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalRotation {
    /// ΦᵀGΦ, skew; grows with Ω.
    pub gyroscopic: Mat<f64>,
    /// Φᵀ(K_σ − K_c)Φ, symmetric; grows with Ω².
    pub stiffness: Mat<f64>,
    /// ΦᵀMD′Φ, the derivative of cylindrical components along the angle; grows with Ω.
    pub derivative: Mat<f64>,
}

impl ModalRotation {
    /// Number of nodal diameters of each mode, `[m]`: the norm of its derivative along the angle, which is n for cos
    /// nθ and sin nθ.
    pub fn diameters(&self) -> Vec<f64> {
        self.derivative.col_iter().map(|c| c.norm_l2()).collect()
    }
}

/// Rotating parts of the bodies of modes that rotate.
#[derive(Debug, Clone, PartialEq)]
pub struct RotationTerms {
    /// The material damping C, 1/s: it takes (q̇ + D′q)ᵀ C (q̇ + D′q).
    pub dissipation: ModalMatrix,
    /// D′ at the angular velocities of the bodies, 1/s; none where all are at rest.
    pub derivative: Option<ModalMatrix>,
}

impl RotationTerms {
    /// Bodies at rest with the damping `damping`, 1/s.
    pub fn none(damping: ModalMatrix) -> Self {
        Self { dissipation: damping, derivative: None }
    }

    /// C D′, 1/s²: the part of the stiffness that stores nothing.
    pub fn stiffness(&self) -> Option<ModalMatrix> {
        self.derivative.as_ref().map(|d| ModalMatrix::from(self.dissipation.full() * d.full()))
    }

    /// Rotation terms of two bodies together, each given with its damping; none where both are at rest.
    pub fn joined(lower: (Option<&Self>, &ModalMatrix), upper: (Option<&Self>, &ModalMatrix)) -> Option<Self> {
        lower.0.or(upper.0)?;
        let [a, b] = [lower, upper].map(|(t, damping)| t.cloned().unwrap_or_else(|| Self::none(damping.clone())));
        let derivative = |t: &Self| {
            let m = t.dissipation.order();
            t.derivative.clone().unwrap_or_else(|| vec![0.0; m].into())
        };
        Some(Self {
            derivative: Some(derivative(&a).joined(&derivative(&b))),
            dissipation: a.dissipation.joined(&b.dissipation),
        })
    }

    /// Collective: that of rank 0 on every rank.
    pub(crate) fn broadcast(world: &World, root: Option<&Self>) -> Option<Self> {
        let dissipation = ModalMatrix::broadcast(world, root.map(|t| &t.dissipation));
        let derivative = ModalMatrix::broadcast(world, root.and_then(|t| t.derivative.as_ref()));
        (derivative.order() > 0).then_some(Self { dissipation, derivative: Some(derivative) })
    }
}

/// Matrices of rotation of a body, at 1 rad/s.
#[derive(Debug, Clone)]
pub struct RotationForms {
    /// The axis.
    pub axis: Axis,
    /// G, kg, skew; grows with Ω.
    pub gyroscopic: Rc<DistCsr>,
    /// K_σ − K_c, kg, symmetric; grows with Ω².
    pub stiffness: Rc<DistCsr>,
}

impl RotationForms {
    /// Collective: those of `body` about `axis`; `displacement` is what the centrifugal forces do to its nodes at 1
    /// rad/s ([`centrifugal`]), m, `[nodes]`.
    pub fn assemble(world: &World, body: &FeBody, axis: Axis, displacement: &[[f64; 3]]) -> Result<Self> {
        let assembly = Assembly::new(world, &body.part, &body.dofs)?;
        let (density, material) = (body.material.density, body.material);
        let prestress = assembly.assemble(&PrestressStiffness { material, displacement });
        let stiffness = prestress.minus_scaled(1.0, &assembly.assemble(&Convected { density, axis }));
        let gyroscopic = assembly.assemble(&Gyroscopic { density, axis });
        Ok(Self { axis, gyroscopic: gyroscopic.into(), stiffness: stiffness.into() })
    }

    /// Collective: the rotation in the space of the `modes` of the body, whose mass is `mass`; the same on every rank.
    pub fn project(&self, world: &World, mass: &DistCsr, modes: &BodyModes) -> ModalRotation {
        let phi = &modes.vectors;
        let gyroscopic = bilinear(world, &self.gyroscopic, phi);
        let stiffness = bilinear(world, &self.stiffness, phi);
        // D′ = D − ê×: of D its skew part G/2, which it is but for the facets of the mesh.
        let turned = |v: &Vec<f64>| -> Vec<f64> {
            v.chunks_exact(3).flat_map(|p| self.axis.turned([p[0], p[1], p[2]])).collect()
        };
        let (operator, rows) = (mass.operator(world), mass.n_local());
        let mut loaded = vec![0.0; rows * phi.len()];
        for (column, out) in phi.iter().zip(loaded.chunks_exact_mut(rows.max(1))) {
            operator.apply(world, &turned(column), out);
        }
        let frame = products(world, phi, &loaded);
        ModalRotation {
            derivative: faer::Scale(0.5) * skew(gyroscopic.as_ref()) - skew(frame.as_ref()),
            gyroscopic: skew(gyroscopic.as_ref()),
            stiffness: symmetric(stiffness.as_ref()),
        }
    }
}

/// Collective: the displacement of the nodes of `body` by the centrifugal forces about `axis` at 1 rad/s, m,
/// `[nodes]`. `statics` holds the factorisation of its stiffness, of a free body that of K − σM. The forces on a free
/// body balance; its displacement is known but for motions as a whole, which cause no stress.
pub fn centrifugal(world: &World, body: &FeBody, statics: &mut Statics, axis: Axis) -> Result<Vec<[f64; 3]>> {
    let density = body.material.density;
    let load = Assembly::new(world, &body.part, &body.dofs)?.load(|x| axis.outward(x).map(|r| density * r));
    let mut u = load.clone();
    statics.solve(&mut u, 1)?;
    if body.supported {
        return Ok(body.at_nodes(world, &u));
    }
    // f − K u loses σ/(σ − ω²) of its elastic part with each round; what stays is what does not balance, by the
    // facets of the mesh.
    let stiffness = body.operators.stiffness.operator(world);
    let size = |v: &[f64]| world.sum(v.iter().map(|v| v * v).sum()).sqrt();
    let mut rest = load.clone();
    for _ in 0..ROUNDS {
        let mut next = vec![0.0; load.len()];
        stiffness.apply(world, &u, &mut next);
        next.iter_mut().zip(&load).for_each(|(r, f)| *r = f - *r);
        let changed = size(&rest.iter().zip(&next).map(|(a, b)| a - b).collect::<Vec<f64>>());
        if changed <= BALANCED * size(&load) {
            return Ok(body.at_nodes(world, &u));
        }
        rest.copy_from_slice(&next);
        statics.solve(&mut next, 1)?;
        u.iter_mut().zip(next).for_each(|(u, r)| *u += r);
    }
    Err(Error::NotConverged(format!(
        "bodies.{}.rotation: the stress by the centrifugal forces was not found in {ROUNDS} rounds",
        body.name
    )))
}

/// Collective: ΦᵀAΦ on every rank.
fn bilinear(world: &World, a: &DistCsr, phi: &[Vec<f64>]) -> Mat<f64> {
    let rows = a.n_local();
    let mut image = vec![0.0; rows * phi.len()];
    let operator = a.operator(world);
    for (column, out) in phi.iter().zip(image.chunks_exact_mut(rows.max(1))) {
        operator.apply(world, column, out);
    }
    products(world, phi, &image)
}

/// Collective: ΦᵀY on every rank; `y` column by column.
fn products(world: &World, phi: &[Vec<f64>], y: &[f64]) -> Mat<f64> {
    let m = phi.len();
    let rows = phi.first().map_or(0, Vec::len);
    let left = Mat::from_fn(rows, m, |i, k| phi[k][i]);
    let own = left.transpose() * MatRef::from_column_major_slice(y, rows, m);
    let all =
        world.sum_all(&own.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<f64>>()).collect::<Vec<f64>>());
    Mat::from_fn(m, m, |i, j| all[i + m * j])
}

/// The part that rounding and sums in another order have left of a skew matrix.
fn skew(a: MatRef<'_, f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| 0.5 * (a[(i, j)] - a[(j, i)]))
}

fn symmetric(a: MatRef<'_, f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| 0.5 * (a[(i, j)] + a[(j, i)]))
}

/// Collective: an error with the measure of it unless `body` and its supports are of revolution about `axis`.
pub fn of_revolution(world: &World, body: &FeBody, axis: Axis) -> Result<()> {
    let part = &body.part;
    let (mut through, mut fastest) = (0.0f64, 0.0f64);
    let mut held = vec![0.0; 1 + 2 * HARMONICS];
    let mut sprung = held.clone();
    let count = |amount: f64, angle: f64, sums: &mut Vec<f64>| {
        sums[0] += amount;
        for n in 1..=HARMONICS {
            sums[2 * n - 1] += amount * (n as f64 * angle).cos();
            sums[2 * n] += amount * (n as f64 * angle).sin();
        }
    };
    // A direction across the axis from which angles are counted, and the one beyond it.
    let e = axis.direction;
    let across = axis.turned(if e[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] });
    let size = across.iter().map(|v| v * v).sum::<f64>().sqrt();
    let first = across.map(|v| v / size);
    let second = axis.turned(first);
    let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| a[c] * b[c]).sum::<f64>();
    for facet in part.boundary() {
        let cell = part.cells.get(facet.cell as usize);
        let x: Vec<[f64; 3]> = cell.facet_corners(facet.face as usize).map(|n| part.coords[n as usize]).collect();
        let centre: [f64; 3] = std::array::from_fn(|c| x.iter().map(|p| p[c]).sum::<f64>() * (1.0 / x.len() as f64));
        // The diagonals of a quadrilateral, two sides of a triangle.
        let diagonals = [[2, 0], [x.len() - 1, 1]]
            .map(|[a, b]: [usize; 2]| -> [f64; 3] { std::array::from_fn(|c| x[a][c] - x[b][c]) });
        let [p, q] = diagonals;
        let normal: [f64; 3] =
            std::array::from_fn(|c| 0.5 * (p[(c + 1) % 3] * q[(c + 2) % 3] - p[(c + 2) % 3] * q[(c + 1) % 3]));
        let area = dot(normal, normal).sqrt();
        let w = axis.velocity(centre);
        through = through.max(dot(w, normal).abs() / area);
        fastest = fastest.max(dot(w, w).sqrt());
        if part.cells.facet(facet).all(|n| body.dofs.local[n as usize] == crate::fem::dofs::FIXED) {
            let r = axis.outward(centre);
            let angle = dot(r, second).atan2(dot(r, first));
            count(area, angle, &mut held);
        }
    }
    for springs in &body.effect.springs {
        let first_dof = body.dofs.first();
        for (node, place) in part.coords[..part.owned].iter().enumerate() {
            let first_of = body.dofs.local[node];
            if first_of == crate::fem::dofs::FIXED {
                continue;
            }
            // What a unit displacement of all nodes along x, y and z would make there: the stiffness that stands on
            // the node.
            let stands = |c: u64| {
                let (columns, values) = springs.row((first_of + c - first_dof) as usize);
                let alike =
                    columns.iter().zip(values).filter(|(column, _)| u64::from(**column) % 3 == (first_of + c) % 3);
                alike.map(|(_, v)| v).sum::<f64>()
            };
            let r = axis.outward(*place);
            count((0..3).map(stands).sum(), dot(r, second).atan2(dot(r, first)), &mut sprung);
        }
    }
    let through = world.max(through) / world.max(fastest).max(f64::MIN_POSITIVE);
    let [held, sprung] = [held, sprung].map(|sums| world.sum_all(&sums));
    let unevenness = |sums: &[f64]| {
        (1..=HARMONICS).map(|n| sums[2 * n - 1].hypot(sums[2 * n])).fold(0.0, f64::max) / sums[0].max(f64::MIN_POSITIVE)
    };
    let (uneven, loose) = (unevenness(&held), unevenness(&sprung));
    let refused = |what: &str, measure: f64, most: f64| {
        Err(Error::Job(format!(
            "bodies.{}.rotation: the {what} is not of revolution about the axis through {:?} m along {:?}: \
             found {measure:.3}, expected at most {most}; \
             correct the axis, or set rotation to \"none\"",
            body.name, axis.centre, axis.direction
        )))
    };
    if through > THROUGH {
        return refused("surface (velocity of the material through it, over its largest)", through, THROUGH);
    }
    if loose > UNEVEN {
        return refused("stiffness of the springs (its largest harmonic over the angle)", loose, UNEVEN);
    }
    if body.supported && ((held[0] == 0.0 && sprung[0] == 0.0) || uneven > UNEVEN) {
        return refused(
            "support (largest harmonic of its area over the angle)",
            if held[0] == 0.0 { 1.0 } else { uneven },
            UNEVEN,
        );
    }
    Ok(())
}
