//! The modes as first-order motions, each with its own exponent: q̈ + C q̇ + K q = f has the response
//! q(s) = Σ x_j (y_jᵀ f)/(s − λ_j), where λ_j are the eigenvalues and x_j, y_j the displacements and the loads of the
//! eigenvectors of [0, 1; −K, −C]. Modes that neither stiffness nor damping couples are treated apart.

use crate::model::ModalMatrix;
use crate::transient::Model;
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::Mat;

type C = num_complex::Complex<f64>;

/// Entries of the modal matrices below this part of the largest one couple nothing.
const COUPLED: f64 = 1e-14;
/// Relative difference of both sides of the equations of motion up to which eigenvectors are complete.
const COMPLETE: f64 = 1e-7;
/// Damping is changed by this part where it is critical, so that there are two eigenvectors.
const APART: f64 = 1e-9;

/// Modes that are coupled with each other, n of them.
#[derive(Clone)]
struct Component {
    /// Their places.
    modes: Vec<usize>,
    /// Eigenvalues, 1/s, `[2n]`.
    lambda: Vec<C>,
    /// x, `[n, 2n]`, and y, `[2n, n]`.
    right: Mat<C>,
    left: Mat<C>,
}

/// All modes.
#[derive(Clone)]
pub(super) struct Poles(Vec<Component>);

impl Poles {
    /// The modes of `model`.
    pub(super) fn new(model: &Model<'_>) -> Result<Self> {
        let parts = match (&model.stiffness, &model.damping) {
            (ModalMatrix::Diagonal(_), ModalMatrix::Diagonal(_)) => (0..model.omega.len()).map(|k| vec![k]).collect(),
            _ => components(model),
        };
        parts.into_iter().map(|modes| Component::new(model, modes)).collect::<Result<_>>().map(Self)
    }

    /// Modal amplitudes under the modal forces `force`, `[m]`, that go with exp(st), s in 1/s.
    pub(super) fn response(&self, s: C, force: &[C]) -> Vec<C> {
        let mut out = vec![C::default(); force.len()];
        for part in &self.0 {
            let n = part.modes.len();
            for (j, lambda) in part.lambda.iter().enumerate() {
                let load: C = (0..n).map(|k| part.left[(j, k)] * force[part.modes[k]]).sum();
                let motion = load / (s - lambda);
                (0..n).for_each(|k| out[part.modes[k]] += part.right[(k, j)] * motion);
            }
        }
        out
    }

    /// Each eigenvalue with what acts at the contact of its displacements, ξ, and with what forces there do, β, `[r]`
    /// each; `mix` is C, column by column.
    pub(super) fn at_contact(&self, mix: &[Vec<f64>]) -> Vec<(C, Vec<C>, Vec<C>)> {
        let of = |part: &Component, j: usize| {
            let sum = |of: &dyn Fn(usize) -> C, c: &[f64]| -> C {
                part.modes.iter().enumerate().map(|(k, &mode)| of(k) * c[mode]).sum()
            };
            let motion = mix.iter().map(|c| sum(&|k| part.right[(k, j)], c)).collect();
            let load = mix.iter().map(|c| sum(&|k| part.left[(j, k)], c)).collect();
            (part.lambda[j], motion, load)
        };
        self.0.iter().flat_map(|part| (0..part.lambda.len()).map(move |j| of(part, j))).collect()
    }
}

impl Component {
    fn new(model: &Model<'_>, modes: Vec<usize>) -> Result<Self> {
        if let [mode] = modes[..] {
            return Ok(Self::single(mode, model.stiffness.get(mode, mode), model.damping.get(mode, mode)));
        }
        let n = modes.len();
        let companion = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, _) => f64::from(u8::from(i + n == j)),
            (false, true) => -model.stiffness.get(modes[i - n], modes[j]),
            (false, false) => -model.damping.get(modes[i - n], modes[j - n]),
        });
        // Velocities count by a frequency, so that both halves of an eigenvector are alike.
        let typical = modes.iter().map(|&k| model.omega[k]).fold(0.0, f64::max).max(1.0);
        let scaled = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, false) => typical * companion[(i, j)],
            (false, true) => companion[(i, j)] / typical,
            _ => companion[(i, j)],
        });
        let failed = |what: String| Error::NotConverged(format!("limit cycles: motions of the modes: {what}"));
        let eigen = scaled.eigen().map_err(|e| failed(format!("{e:?}")))?;
        let lambda: Vec<C> = eigen.S().column_vector().iter().copied().collect();
        let vectors = eigen.U();
        let unit = Mat::from_fn(2 * n, n, |i, k| C::new(f64::from(u8::from(i == k + n)), 0.0));
        let inverse = vectors.partial_piv_lu().solve(unit);
        let right = Mat::from_fn(n, 2 * n, |i, j| vectors[(i, j)]);
        let left = Mat::from_fn(2 * n, n, |j, k| inverse[(j, k)] / typical);
        // Σ x_j y_jᵀ = 0 and Σ λ_j x_j y_jᵀ = 1 where the eigenvectors are complete.
        let [zero, one] = [0, 1].map(|power| {
            let weighted =
                Mat::from_fn(2 * n, n, |j, k| left[(j, k)] * if power == 0 { C::new(typical, 0.0) } else { lambda[j] });
            &right * weighted
        });
        let error = (0..n).flat_map(|i| (0..n).map(move |k| (i, k))).fold(0.0f64, |m, (i, k)| {
            let unit = C::new(f64::from(u8::from(i == k)), 0.0);
            m.max(zero[(i, k)].norm()).max((one[(i, k)] - unit).norm())
        });
        match error < COMPLETE {
            true => Ok(Self { modes, lambda, right, left }),
            false => Err(failed(format!(
                "{n} coupled modes have no complete set of eigenvectors (error {error:.1e}); change damping or rotation"
            ))),
        }
    }

    fn single(mode: usize, stiffness: f64, damping: f64) -> Self {
        let mut square = 0.25 * damping * damping - stiffness;
        if square.abs() < APART * stiffness.max(f64::MIN_POSITIVE) {
            square = -APART * stiffness.max(f64::MIN_POSITIVE);
        }
        let root = C::new(square, 0.0).sqrt();
        let lambda = [root, -root].map(|r| r - 0.5 * damping);
        let left = |j: usize| 1.0 / (lambda[j] - lambda[1 - j]);
        Self {
            modes: vec![mode],
            lambda: lambda.to_vec(),
            right: Mat::from_fn(1, 2, |_, _| C::new(1.0, 0.0)),
            left: Mat::from_fn(2, 1, |j, _| left(j)),
        }
    }
}

/// Sets of modes that stiffness or damping couples.
fn components(model: &Model<'_>) -> Vec<Vec<usize>> {
    let m = model.omega.len();
    let largest = |of: &ModalMatrix| (0..m).map(|k| of.get(k, k).abs()).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let limits = [COUPLED * largest(&model.stiffness), COUPLED * largest(&model.damping)];
    let coupled = |i: usize, j: usize| {
        let of = |a: &ModalMatrix, limit: f64| a.get(i, j).abs().max(a.get(j, i).abs()) > limit;
        of(&model.stiffness, limits[0]) || of(&model.damping, limits[1])
    };
    let mut found: Vec<Vec<usize>> = Vec::new();
    let mut free: Vec<usize> = (0..m).collect();
    while let Some(first) = free.first().copied() {
        let (mut part, mut next) = (Vec::new(), vec![first]);
        free.remove(0);
        while let Some(i) = next.pop() {
            part.push(i);
            let (joined, others) = free.into_iter().partition(|&j| coupled(i, j));
            let joined: Vec<usize> = joined;
            next.extend(joined);
            free = others;
        }
        part.sort_unstable();
        found.push(part);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Interface;
    use num_complex::Complex;

    /// The response beside the solution of (K − s² + isC) q = f, with modes that damping couples and one apart.
    #[test]
    fn response_solves_the_equations_of_motion() {
        let interface = Interface::points(vec![0.0], vec![[0.0; 2]]).unwrap();
        let (residual, modes) = (Mat::<f64>::zeros(3, 3), Mat::<f64>::zeros(3, 3));
        let omega = [300.0, 310.0, 900.0];
        let damping = Mat::from_fn(3, 3, |i, j| match (i, j) {
            (0, 1) => 40.0,
            (1, 0) => -40.0,
            (i, j) if i == j => 5.0,
            _ => 0.0,
        });
        let model = Model {
            interface: &interface,
            residual: residual.as_ref(),
            modes: modes.as_ref(),
            omega: &omega,
            stiffness: ModalMatrix::squares(&omega),
            damping: damping.clone().into(),
            turning: None,
            carried: None,
            load: &[],
        };
        let poles = Poles::new(&model).unwrap();
        assert_eq!(poles.0.iter().map(|p| p.modes.clone()).collect::<Vec<_>>(), [vec![0, 1], vec![2]]);
        let force = [Complex::new(1.0, 0.5), Complex::new(-2.0, 0.0), Complex::new(0.3, 0.7)];
        for s in [0.0, 305.0, 1000.0] {
            let q = poles.response(Complex::new(0.0, s), &force);
            for i in 0..3 {
                let inertia = (omega[i] * omega[i] - s * s) * q[i];
                let resistance: Complex<f64> = (0..3).map(|j| Complex::new(0.0, s * damping[(i, j)]) * q[j]).sum();
                assert!((inertia + resistance - force[i]).norm() < 1e-9, "{s} rad/s, mode {i}");
            }
        }
    }
}
