//! Stability of steady sliding of bodies given by matrices, on all their degrees of freedom, densely:
//!
//! (λ²M + λ(C + P_tᵀ D P_t) + K) u = (P_n − μ τᵀP_t)ᵀ r,  P_n u = 0,  D = (μp0/|ṡ0|)(I − ττᵀ) + μ′p0 ττᵀ
//!
//! (`docs/explanation/bodies.md`). The multipliers r are taken out exactly: u = Z q with P_n Z = 0, and the equations
//! are projected on Y with (P_n − μ τᵀP_t) Y = 0, which leaves a quadratic problem without constraints, nonsymmetric
//! since Y ≠ Z.

use crate::body::matrices::DENSE;
use crate::body::{FullSystem, Side};
use crate::contact::LinearContact;
use crate::parallel::World;
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};

type C = num_complex::Complex<f64>;

/// An eigenvalue with its motion.
#[derive(Debug, Clone)]
pub struct DensePair {
    /// λ, 1/s.
    pub value: C,
    /// Degrees of freedom of the lower and then the upper body, of norm 1, `[n]`.
    pub motion: Vec<C>,
    /// Normwise backward error of the pair in the projected quadratic problem.
    pub backward_error: f64,
    /// Largest opening of a closed contact over the largest displacement.
    pub constraint: f64,
}

/// Bodies up to this many degrees of freedom together are treated so.
pub const LARGEST: usize = DENSE;

/// A body on all its degrees of freedom, N of them.
#[derive(Debug, Clone)]
pub struct FullOrderBody {
    /// Stiffness, N/m, `[N, N]`.
    pub stiffness: Mat<f64>,
    /// Mass, kg, `[N, N]`.
    pub mass: Mat<f64>,
    /// Damping, N·s/m, `[N, N]`.
    pub damping: Option<Mat<f64>>,
    /// Contact rows (x, y, n into the body), `[3n, N]`.
    pub trace: Mat<f64>,
}

impl FullOrderBody {
    /// Collective: a distributed body with `factor` times its damping, on rank 0.
    pub fn gather(world: &World, body: &dyn FullSystem, factor: f64) -> Option<Self> {
        let (stiffness, mass) = (body.stiffness().gather(world), body.mass().gather(world));
        let damping = body.damping().and_then(|c| c.gather(world)).map(|c| faer::Scale(factor) * c);
        let (stiffness, mass) = stiffness.zip(mass)?;
        let trace = body.trace().dense(stiffness.nrows());
        Some(Self { stiffness, mass, damping, trace })
    }
}

/// Eigenvalues this much smaller than the largest of the inverted problem are infinite: motions without mass, whose
/// double infinite eigenvalues rounding moves to the root of the machine precision.
const INFINITE: f64 = 1e-6;

/// The pencil A − λE whose eigenvalues these are, λ in units of `rate`.
#[derive(Debug, Clone)]
pub struct DensePencil {
    /// A.
    pub a: Mat<f64>,
    /// E.
    pub e: Mat<f64>,
    /// Unit of λ, 1/s.
    pub rate: f64,
}

/// All finite eigenvalues, both of each conjugate pair, by falling growth rate, each with a backward error of at most
/// `tolerance`. `bodies` are the lower and the upper one, `None` for one that does not move.
pub fn eigenpairs(
    bodies: [Option<&FullOrderBody>; 2],
    contact: &LinearContact,
    tolerance: f64,
) -> Result<Vec<DensePair>> {
    Ok(spectrum(bodies, contact, tolerance)?.0)
}

/// The same with the pencil that they are eigenvalues of; none where nothing has mass.
pub fn spectrum(
    bodies: [Option<&FullOrderBody>; 2],
    contact: &LinearContact,
    tolerance: f64,
) -> Result<(Vec<DensePair>, Option<DensePencil>)> {
    let sizes = bodies.map(|b| b.map_or(0, |m| m.stiffness.nrows()));
    let n = sizes[0] + sizes[1];
    let full = |of: &dyn Fn(&FullOrderBody) -> Option<&Mat<f64>>| {
        let mut a = Mat::<f64>::zeros(n, n);
        for (body, first) in bodies.iter().zip([0, sizes[0]]) {
            let Some(own) = body.and_then(of) else { continue };
            a.as_mut().submatrix_mut(first, first, own.nrows(), own.ncols()).copy_from(own);
        }
        a
    };
    let mass = full(&|m| Some(&m.mass));
    let stiffness = full(&|m| Some(&m.stiffness));
    let mut damping = full(&|m| m.damping.as_ref());

    // Rows of w = u1 − u2 along x and y, and of the change of gap, at each contact.
    let rows = |node: usize| -> [Vec<(usize, f64)>; 3] {
        std::array::from_fn(|c| {
            let of = |(side, first): (Side, usize)| -> Vec<(usize, f64)> {
                let Some(body) = bodies[side.index()] else { return Vec::new() };
                let term = |j: usize| (first + j, side.sign(c) * body.trace[(3 * node + c, j)]);
                (0..body.trace.ncols()).map(term).filter(|t| t.1 != 0.0).collect()
            };
            Side::BOTH.into_iter().zip([0, sizes[0]]).flat_map(of).collect()
        })
    };
    let k = contact.nodes.len();
    let (mut normal, mut friction) = (Mat::<f64>::zeros(k, n), Mat::<f64>::zeros(k, n));
    for (i, at) in contact.nodes.iter().enumerate() {
        let [x, y, gap] = rows(at.node);
        let [fx, fy] = at.tangent.friction();
        let resistance = at.tangent.resistance().ok_or_else(|| {
            Error::Job(format!("contact.points: contact {} sticks; all of them have to slide here", at.node + 1))
        })?;
        let both = [&x, &y];
        for (p, rows) in both.iter().enumerate() {
            for (q, columns) in both.iter().enumerate() {
                for &(row, v) in rows.iter() {
                    columns.iter().for_each(|&(column, w)| damping[(row, column)] += resistance[p][q] * v * w);
                }
            }
        }
        // A contact without normal motion keeps its force: no multiplier, no friction.
        if gap.is_empty() {
            continue;
        }
        for (j, s) in gap {
            normal[(i, j)] += s;
            friction[(i, j)] += s;
        }
        for (row, f) in [(&x, fx), (&y, fy)] {
            row.iter().for_each(|&(j, s)| friction[(i, j)] += f * s);
        }
    }
    let (z, y) = (null_space(normal.as_ref())?, null_space(friction.as_ref())?);
    if z.ncols() != y.ncols() {
        return Err(Error::NotConverged(format!(
            "stability: {} motions keep the contacts closed, but {} are free of their reactions: friction locks \
             a contact",
            z.ncols(),
            y.ncols()
        )));
    }
    let project = |a: &Mat<f64>| y.transpose() * (a * &z);
    let (k2, c2, m2) = (project(&stiffness), project(&damping), project(&mass));
    let (kn, cn, mn) = (k2.norm_l2(), c2.norm_l2(), m2.norm_l2());
    if mn == 0.0 {
        return Ok((Vec::new(), None));
    }
    let rate = (kn / mn).sqrt().max(f64::MIN_POSITIVE);

    // λ (q, v, f) of v = λ q, time in units of 1/rate, equations in units of the stiffness; f are the coefficients of
    // friction that change.
    let (m, nf) = (z.ncols(), contact.memory.len());
    let size = 2 * m + nf;
    let mut a = Mat::<f64>::zeros(size, size);
    let mut e = Mat::<f64>::zeros(size, size);
    let largest = contact.memory.iter().map(|m| m.force).fold(0.0, f64::max);
    let unit = if largest > 0.0 { largest / kn } else { 1.0 };
    for (i, memory) in contact.memory.iter().enumerate() {
        let [x, y_row, _] = rows(contact.nodes[memory.at].node);
        let mut along = vec![0.0; n];
        for (row, t) in [(&x, memory.direction[0]), (&y_row, memory.direction[1])] {
            row.iter().for_each(|&(j, s)| along[j] += s * t);
        }
        let at = 2 * m + i;
        for j in 0..m {
            let on = |basis: &Mat<f64>| (0..n).map(|k| along[k] * basis[(k, j)]).sum::<f64>();
            a[(m + j, at)] = -memory.force / (kn * unit) * on(&y);
            a[(at, m + j)] = memory.relaxation.gain * unit * on(&z);
        }
        a[(at, at)] = -memory.relaxation.decay / rate;
        if let Some(from) = memory.upstream {
            a[(at, 2 * m + from)] = memory.relaxation.upstream / rate;
        }
        e[(at, at)] = 1.0;
    }
    for j in 0..m {
        a[(j, m + j)] = 1.0;
        e[(j, j)] = 1.0;
        for i in 0..m {
            a[(m + i, j)] = -k2[(i, j)] / kn;
            a[(m + i, m + j)] = -c2[(i, j)] * rate / kn;
            e[(m + i, m + j)] = m2[(i, j)] * rate * rate / kn;
        }
    }
    // A real shift in the right half-plane; an eigenvalue there would show in the backward errors.
    let shift = 0.7390851332151607;
    let inverted = (&a - faer::Scale(shift) * &e).partial_piv_lu().solve(&e);
    if inverted.col_iter().any(|c| c.iter().any(|v| !v.is_finite())) {
        return Err(Error::NotConverged("stability: the linearised system is singular at the shift".into()));
    }
    let eigen =
        inverted.eigen().map_err(|e| Error::NotConverged(format!("stability: dense eigenvalues failed: {e:?}")))?;
    let theta = eigen.S().column_vector();
    let largest = theta.iter().map(|t| t.norm()).fold(0.0, f64::max);
    let mut pairs = Vec::new();
    let norms = (a.norm_l2(), e.norm_l2());
    for p in (0..size).filter(|&p| theta[p].norm() > INFINITE * largest) {
        let scaled = C::new(shift, 0.0) + theta[p].inv();
        let lambda = scaled * rate;
        let q: Vec<C> = (0..m).map(|i| eigen.U()[(i, p)]).collect();
        let norm = |v: &[C]| v.iter().map(|c| c.norm_sqr()).sum::<f64>().sqrt();
        let residual: Vec<C> = (0..m)
            .map(|i| (0..m).map(|j| q[j] * (lambda * (lambda * m2[(i, j)] + c2[(i, j)]) + k2[(i, j)])).sum())
            .collect();
        let scale = lambda.norm_sqr() * mn + lambda.norm() * cn + kn;
        let backward_error = match nf {
            0 => norm(&residual) / (scale * norm(&q)),
            _ => {
                let x: Vec<C> = (0..size).map(|i| eigen.U()[(i, p)]).collect();
                let row = |i: usize| (0..size).map(|j| x[j] * (a[(i, j)] - scaled * e[(i, j)])).sum::<C>();
                norm(&(0..size).map(row).collect::<Vec<C>>()) / ((norms.0 + scaled.norm() * norms.1) * norm(&x))
            }
        };
        if !(backward_error <= tolerance) {
            return Err(Error::NotConverged(format!(
                "stability: the eigenvalue {:.6e} {:+.6e}i 1/s has a backward error of {backward_error:.1e}, \
                 {tolerance:.1e} was asked for",
                lambda.re, lambda.im
            )));
        }
        let motion: Vec<C> = (0..n).map(|i| (0..m).map(|j| q[j] * z[(i, j)]).sum()).collect();
        let length = norm(&motion);
        let largest = motion.iter().map(|v| v.norm()).fold(0.0, f64::max);
        let opening = |i: usize| (0..n).map(|j| motion[j] * normal[(i, j)]).sum::<C>().norm();
        let constraint = (0..k).map(opening).fold(0.0, f64::max) / largest;
        pairs.push(DensePair {
            value: lambda,
            motion: motion.into_iter().map(|v| v / length).collect(),
            backward_error,
            constraint,
        });
    }
    pairs.sort_by(|a, b| b.value.re.total_cmp(&a.value.re).then(b.value.im.total_cmp(&a.value.im)));
    Ok((pairs, Some(DensePencil { a, e, rate })))
}

/// Orthonormal basis of the motions that the rows of `a` do not see, `[n, n − rank]`.
fn null_space(a: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let n = a.ncols();
    let svd = a.transpose().svd().map_err(|e| Error::NotConverged(format!("stability: contact rows: {e:?}")))?;
    let s = svd.S().column_vector();
    let largest = (0..s.nrows()).map(|i| s[i]).fold(0.0, f64::max);
    let rank = (0..s.nrows()).filter(|&i| s[i] > 1e-12 * largest).count();
    Ok(svd.U().subcols(rank, n - rank).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{LinearNode, Slip, Tangent};
    use std::f64::consts::PI;

    fn matrix(n: usize, entries: &[(usize, usize, f64)]) -> Mat<f64> {
        let mut a = Mat::zeros(n, n);
        entries.iter().for_each(|&(i, j, v)| a[(i, j)] += v);
        a
    }

    /// Signed rows (x, y, n) of each contact.
    fn trace(n: usize, rows: &[[Option<(usize, f64)>; 3]]) -> Mat<f64> {
        Mat::from_fn(3 * rows.len(), n, |i, j| rows[i / 3][i % 3].filter(|r| r.0 == j).map_or(0.0, |r| r.1))
    }

    /// A contact that slides along `direction`, its force, velocity and slope of the friction.
    fn node(node: usize, friction: f64, direction: [f64; 2], [force, velocity, slope]: [f64; 3]) -> LinearNode {
        let tangent = Tangent::Slip(Slip::steady(force, direction, velocity, friction, slope));
        LinearNode { node, tangent, convection: Vec::new() }
    }

    fn contact(nodes: Vec<LinearNode>) -> LinearContact {
        LinearContact { nodes, ..LinearContact::default() }
    }

    const UNLOADED: [f64; 3] = [0.0, 1.0, 0.0];

    /// S. Hultén, 1997: two masses, two massless contact points.
    #[test]
    fn hultens_flutter() {
        let [k1, k2] = [100.0, 75.0].map(|f: f64| (2.0 * PI * f).powi(2));
        let entries =
            [(0, 0, k1), (2, 2, k1), (0, 2, -k1), (2, 0, -k1), (1, 1, k2), (3, 3, k2), (1, 3, -k2), (3, 1, -k2)];
        let body = FullOrderBody {
            mass: matrix(4, &[(0, 0, 1.0), (1, 1, 1.0)]),
            damping: None,
            stiffness: matrix(4, &entries),
            trace: trace(4, &[[Some((1, 1.0)), None, Some((2, 1.0))], [Some((0, 1.0)), None, Some((3, 1.0))]]),
        };
        let c = contact(vec![node(0, 0.4, [-1.0, 0.0], UNLOADED), node(1, 0.4, [1.0, 0.0], UNLOADED)]);
        let found = eigenpairs([Some(&body), None], &c, 1e-12).unwrap();
        assert_eq!(found.len(), 4, "{found:?}");
        let first = found[0].value;
        assert!((first.re - 72.3586).abs() < 1e-4 && (first.im / (2.0 * PI) - 89.1354).abs() < 1e-4, "{first}");
    }

    /// One mass, whose motion along the belt loads the contact through a coupled stiffness k': λ² m = −(k + μ τ k').
    /// Turning the sliding round changes the stiffness, which the two contacts above would not show.
    #[test]
    fn friction_acts_against_the_sliding() {
        let (m, k, coupled, mu) = (2.0, 8e4, 3e4, 0.4);
        let body = FullOrderBody {
            mass: matrix(2, &[(0, 0, m), (1, 1, m)]),
            damping: None,
            stiffness: matrix(2, &[(0, 0, k), (1, 1, 2.0 * k), (0, 1, coupled), (1, 0, coupled)]),
            trace: trace(2, &[[Some((0, 1.0)), None, Some((1, 1.0))]]),
        };
        for (upper, tau) in [(false, 1.0), (false, -1.0), (true, 1.0), (true, -1.0)] {
            let c = contact(vec![node(0, mu, [tau, 0.0], UNLOADED)]);
            let [a, b] = if upper { [None, Some(&body)] } else { [Some(&body), None] };
            let found = eigenpairs([a, b], &c, 1e-12).unwrap();
            // Friction on body 1 is −μ τ r, on body 2 the opposite.
            let side = if upper { -1.0 } else { 1.0 };
            let want = C::new(0.0, ((k + side * mu * tau * coupled) / m).sqrt());
            assert!((found[0].value - want).norm() < 1e-9 * want.norm(), "{} against {want}", found[0].value);
        }
    }

    /// A mass on a spring k along x and y slides on a rigid belt: λ = −d/2m ± i√(k/m − d²/4m²) across the sliding
    /// with d = μN/v, and with d = μ′N along it, where a falling law makes it grow.
    #[test]
    fn damping_across_and_falling_friction_along() {
        let (m, k) = (2.0, 8e4);
        let body = FullOrderBody {
            mass: matrix(2, &[(0, 0, m), (1, 1, m)]),
            damping: None,
            stiffness: matrix(2, &[(0, 0, k), (1, 1, k)]),
            trace: trace(2, &[[Some((0, 1.0)), Some((1, 1.0)), None]]),
        };
        let c = contact(vec![node(0, 0.4, [0.6, 0.8], [50.0, 0.5, -0.3])]);
        let found = eigenpairs([None, Some(&body)], &c, 1e-12).unwrap();
        for (pair, d) in found.iter().step_by(2).zip([-0.3 * 50.0, 0.4 * 50.0 / 0.5]) {
            let sigma = -d / (2.0 * m);
            let want = C::new(sigma, (k / m - sigma * sigma).sqrt());
            assert!((pair.value - want).norm() < 1e-9 * want.norm(), "{} against {want}", pair.value);
        }
    }
}
