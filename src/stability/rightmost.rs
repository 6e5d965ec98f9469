//! The least stable eigenvalue alone, where one state after the other is looked at: all eigenvalues, but the vector
//! of that one only, by inverse iteration. Vectors are most of the work of a dense eigenproblem.

use super::reduced::{assemble, eigenpairs, images, Eigenpair, ScaledPencil};
use crate::contact::LinearContact;
use crate::model::CoupledModel;
use crate::Result;
use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// Steps of inverse iteration: the first one finds the direction, the others its last digits.
const STEPS: usize = 3;

/// The first of [`eigenpairs`] with Im λ ≥ 0 that is `listed`. What is not listed with a backward error of 0 must not
/// be with a larger one.
pub fn rightmost(
    bodies: &CoupledModel,
    contact: &LinearContact,
    tolerance: f64,
    listed: impl Fn(&Eigenpair) -> bool,
) -> Result<Option<Eigenpair>> {
    let pencil = assemble(bodies, contact, None)?;
    let (m, rate) = (bodies.omega.len(), pencil.scales.rate);
    let pair = |value: C, vector: &[C], backward_error: f64| Eigenpair {
        value: value * rate,
        modal: vector.iter().take(m).copied().collect(),
        tangential: vector.iter().skip(2 * m).map(|f| f * pencil.scales.force).collect(),
        backward_error,
    };
    let mut values = pencil.values()?;
    values.retain(|v| listed(&pair(*v, &[], 0.0)));
    values.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    for value in values {
        // Any start will do that is not blind for the vector: phases without a pattern.
        let start = Mat::from_fn(pencil.a.nrows(), 1, |i, _| C::from_polar(1.0, (i * i) as f64));
        let (vector, backward_error) = vector(&pencil, value, start);
        if !(backward_error <= tolerance) {
            // Defective, or worse: all of them say what is wrong.
            let all = eigenpairs(bodies, contact, tolerance)?;
            return Ok(all.into_iter().find(|p| p.value.im >= 0.0 && listed(p)));
        }
        let found = pair(value, &vector, backward_error);
        if listed(&found) {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

/// The vector of norm 1 of the eigenvalue `value` of `pencil` that inverse iteration finds from `start`, `[n, 1]`, and
/// the backward error of both.
pub(super) fn vector(pencil: &ScaledPencil, value: C, start: Mat<C>) -> (Vec<C>, f64) {
    let n = pencil.a.nrows();
    // Just beside it the matrix can be factored.
    let beside = value + C::new(1e-13, 1e-13) * value.norm();
    let of = |i: usize, j: usize| C::new(pencil.a[(i, j)], 0.0) - beside * pencil.e[(i, j)];
    let lu = Mat::from_fn(n, n, of).partial_piv_lu();
    let mut x = start;
    for _ in 0..STEPS {
        let image = Mat::from_fn(n, 1, |i, _| (0..n).map(|j| x[(j, 0)] * pencil.e[(i, j)]).sum::<C>());
        x = lu.solve(&image);
        let norm = x.norm_l2();
        x.col_iter_mut().for_each(|c| c.iter_mut().for_each(|v| *v /= norm));
    }
    let residual = images([&pencil.a, &pencil.e], &[value], &x).norm_l2();
    let size = pencil.a.norm_l2() + value.norm() * pencil.e.norm_l2();
    let vector = x.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<C>>()).collect();
    (vector, residual / size)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::ReducedBody;
    use crate::contact::{LinearNode, Slip, Tangent};

    /// Two masses with modes that friction couples, beside one by itself: the first eigenpair of all, with its
    /// vector; none where none is listed.
    #[test]
    fn it_is_the_first_of_all() {
        let rows = Mat::from_fn(6, 3, |i, k| {
            [[0.3, 0.7, 1.0, -0.2, 0.5, 0.8], [-0.6, 0.2, 0.9, 0.4, 0.4, -0.5], [0.1, 0.2, 0.3, 0.2, 0.1, 0.4]][k][i]
        });
        let omega: Vec<f64> = vec![30.0, 31.0, 80.0];
        let compliance = Mat::from_fn(6, 6, |i, j| {
            let own = if i == j { 2e-3 } else { 0.0 };
            own + (0..3).map(|k| rows[(i, k)] * rows[(j, k)] / omega[k].powi(2)).sum::<f64>()
        });
        let lower = ReducedBody::new(omega, vec![0.01; 3], rows, compliance);
        let rigid = ReducedBody::new(vec![], vec![], Mat::zeros(6, 0), Mat::zeros(6, 6));
        let bodies = CoupledModel::new(&lower, &rigid).unwrap();
        for direction in [[0.6, 0.8], [-0.6, -0.8]] {
            let node = |node: usize| LinearNode {
                node,
                tangent: Tangent::Slip(Slip::steady(5.0, direction, 0.4, 0.6, 0.0)),
                convection: Vec::new(),
            };
            let contact = LinearContact { nodes: vec![node(0), node(1)], ..LinearContact::default() };
            let all = eigenpairs(&bodies, &contact, 1e-10).unwrap();
            for most in [f64::INFINITY, all[0].value.re - 1e-6, -1e9] {
                let listed = |p: &Eigenpair| p.value.re < most;
                let found = rightmost(&bodies, &contact, 1e-10, listed).unwrap();
                let want = all.iter().find(|p| p.value.im >= 0.0 && listed(p));
                assert_eq!(found.is_some(), want.is_some());
                let Some((found, want)) = found.zip(want) else { continue };
                assert!(
                    (found.value - want.value).norm() < 1e-11 * want.value.norm(),
                    "{} {}",
                    found.value,
                    want.value
                );
                assert!(found.backward_error < 1e-12, "{}", found.backward_error);
                let both = |of: &dyn Fn(&Eigenpair) -> Vec<C>| -> f64 {
                    let (a, b) = (of(&found), of(want));
                    let square = |v: &[C]| v.iter().map(C::norm_sqr).sum::<f64>();
                    let product: C = a.iter().zip(&b).map(|(a, b)| a.conj() * b).sum();
                    product.norm_sqr() / (square(&a) * square(&b))
                };
                assert!((both(&|p| p.modal.clone()) - 1.0).abs() < 1e-9, "another motion");
            }
        }
    }
}
