//! A pair of bodies in other modal coordinates: the same bodies, with full modal matrices.

use faer::Mat;
use railsqueal::body::{ModalBlock, ModalMatrix};
use railsqueal::model::CoupledModel;

/// I − 2 v vᵀ / |v|², with no entry of v that is 0.
fn turn(n: usize) -> Mat<f64> {
    let v: Vec<f64> = (0..n).map(|i| 1.0 + (1.7 * i as f64).sin()).collect();
    let square: f64 = v.iter().map(|v| v * v).sum();
    Mat::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) - 2.0 * v[i] * v[j] / square)
}

/// The pair with the modes of each body turned into one another, Ψ Q, QᵀKQ, QᵀCQ; and Q, `[m, m]`.
pub fn rotated(pair: &CoupledModel) -> (CoupledModel, Mat<f64>) {
    let (m1, m) = (pair.lower_modes, pair.omega.len());
    let turns = [turn(m1), turn(m - m1)];
    let q = ModalMatrix::Blocks(turns.iter().cloned().map(|m| ModalBlock::Full(m.into())).collect()).full();
    let of = |matrix: &ModalMatrix| {
        let block = |(first, q): (usize, &Mat<f64>)| {
            let own = Mat::from_fn(q.nrows(), q.nrows(), |i, j| matrix.get(first + i, first + j));
            let turned = q.transpose() * own * q;
            // Symmetric to the last bit, as what is made from symmetric matrices.
            Mat::from_fn(q.nrows(), q.nrows(), |i, j| 0.5 * (turned[(i, j)] + turned[(j, i)]))
        };
        ModalMatrix::Blocks([0, m1].into_iter().zip(&turns).map(block).map(|m| ModalBlock::Full(m.into())).collect())
    };
    let turned = CoupledModel {
        modes: &pair.modes * &q,
        stiffness: of(&pair.stiffness),
        damping: of(&pair.damping),
        ..pair.clone()
    };
    (turned, q)
}
