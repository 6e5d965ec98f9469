use super::*;
use crate::body::rotation::ModalRotation;
use crate::body::ReducedBody;
use crate::contact::{Slip, Tangent};

/// Eigenpairs of points on a body that turns satisfy the equations of motion, the closed gap and the row of friction
/// across the sliding, c f + λ w_y + (carried q)_y = 0, as they stand; without the carried rates they do not.
#[test]
fn eigenpairs_of_a_turning_body_satisfy_the_equations_as_they_stand() {
    let number = |i: usize, k: usize| ((7 * i + 5 * k + 3) % 11) as f64 / 5.0 - 1.0;
    let body = |m: usize, first: usize| {
        let omega: Vec<f64> = (0..m).map(|k| 2e3 + 500.0 * (k + first) as f64).collect();
        let modes = Mat::from_fn(6, m, |i, k| number(i, k + first));
        let mut compliance = Mat::from_fn(6, 6, |i, j| if i == j { 4e-7 } else { 2e-8 });
        for (k, w) in omega.iter().enumerate() {
            let mode = modes.col(k);
            compliance += faer::Scale(1.0 / (w * w)) * (mode * mode.transpose());
        }
        ReducedBody::new(omega.clone(), omega.iter().map(|w| 0.01 * w).collect::<Vec<f64>>(), modes, compliance)
    };
    let mut pair = CoupledModel::new(&body(4, 0), &body(3, 4)).unwrap();
    let skew = Mat::from_fn(4, 4, |i, j| [[0.0, 3.0, 0.0, 0.0], [-3.0, 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4]][i][j]);
    let rotation = ModalRotation { gyroscopic: Mat::zeros(4, 4), stiffness: Mat::zeros(4, 4), derivative: skew };
    let mut rates = Mat::zeros(6, 7);
    let along = pair.modes.as_ref().subcols(0, 4) * &rotation.derivative;
    rates.as_mut().subcols_mut(0, 4).copy_from(faer::Scale(50.0) * along);
    pair.carried = Some(rates.clone());
    let (friction, velocity, force) = (0.4, 5.0, 300.0);
    let node = |node: usize| {
        let slip = Slip::steady(force, [1.0, 0.0], velocity, friction, 0.0);
        LinearNode { node, tangent: Tangent::Slip(slip), convection: Vec::new() }
    };
    let contact = LinearContact { nodes: vec![node(0), node(1)], ..LinearContact::default() };
    let pairs = eigenpairs(&pair, &contact, 1e-9).unwrap();
    assert!(pairs.len() > 10);
    let mut without = 0.0f64;
    for found in &pairs {
        let (value, q) = (found.value, &found.modal);
        let r = reactions(&pair, &contact, found).unwrap();
        let times = |matrix: &Mat<f64>, v: &[Complex<f64>]| -> Vec<Complex<f64>> {
            (0..matrix.nrows()).map(|i| v.iter().enumerate().map(|(j, v)| v * matrix[(i, j)]).sum()).collect()
        };
        let [moved, under, carried] = [times(&pair.modes, q), times(&pair.residual, &r), times(&rates, q)];
        let forces = times(&pair.modes.transpose().to_owned(), &r);
        let scale = q.iter().map(|q| q.norm()).fold(0.0, f64::max) * value.norm_sqr();
        for k in 0..7 {
            let inertia = q[k] * (value * value + value * pair.damping.get(k, k) + pair.stiffness.get(k, k));
            assert!((inertia - forces[k]).norm() < 1e-8 * scale, "{value}: mode {k}");
        }
        let size = moved.iter().map(|y| y.norm()).fold(f64::MIN_POSITIVE, f64::max);
        for i in 0..2 {
            let y = |c: usize| moved[3 * i + c] + under[3 * i + c];
            assert!(y(2).norm() < 1e-8 * size, "{value}: gap {i}");
            // R = (−μ p, f, p): f acts across.
            assert!((r[3 * i] + friction * r[3 * i + 2]).norm() <= 1e-10 * r[3 * i].norm(), "{value}: along {i}");
            let row = r[3 * i + 1] * velocity / (friction * force) + value * y(1);
            let rate = size * value.norm();
            assert!((row + carried[3 * i + 1]).norm() < 1e-8 * rate, "{value}: across {i}");
            without = without.max(row.norm() / rate);
        }
    }
    assert!(without > 1e-3, "{without:e}");
}
