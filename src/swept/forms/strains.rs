//! Strains and stresses of a ring, and sums over its blocks.

use super::Strains;

pub(super) const NOTHING: [[f64; 3]; 3] = [[0.0; 3]; 3];

pub(super) const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

pub(super) fn scaled(block: &[[f64; 3]; 3], factor: f64) -> [[f64; 3]; 3] {
    block.map(|row| row.map(|v| factor * v))
}

/// (nU + V)² + (U + nV)² + n²W²: the square of the derivative along the angle of the Cartesian components.
pub(super) fn brackets(n: usize) -> [[f64; 3]; 3] {
    let n = n as f64;
    [[n * n + 1.0, 2.0 * n, 0.0], [2.0 * n, n * n + 1.0, 0.0], [0.0, 0.0, n * n]]
}

/// Strains of the amplitudes (U, V, W) of a node with the shape function `value` and its slopes along r and y, and
/// 1/r round an axle: what does not go with n, and what does.
pub(in crate::swept) fn strains(value: f64, [along_r, along_y]: [f64; 2], over: Option<f64>) -> [Strains; 2] {
    let (bent, wave) = (value * over.unwrap_or(0.0), value * over.unwrap_or(1.0));
    [
        [
            [along_r, 0.0, 0.0],
            [bent, 0.0, 0.0],
            [0.0, 0.0, along_y],
            [0.0, along_r - bent, 0.0],
            [along_y, 0.0, along_r],
            [0.0, along_y, 0.0],
        ],
        [[0.0; 3], [0.0, wave, 0.0], [0.0; 3], [-wave, 0.0, 0.0], [0.0; 3], [0.0, 0.0, -wave]],
    ]
}

/// Stresses of strains, column by column.
pub(in crate::swept) fn stress(strains: &Strains, lambda: f64, shear: f64) -> Strains {
    let mut out = [[0.0; 3]; 6];
    for c in 0..3 {
        let trace = strains[0][c] + strains[1][c] + strains[2][c];
        (0..3).for_each(|k| out[k][c] = lambda * trace + 2.0 * shear * strains[k][c]);
        (3..6).for_each(|k| out[k][c] = shear * strains[k][c]);
    }
    out
}

/// Adds the weighted work of stresses on strains.
pub(super) fn add(block: &mut [[f64; 3]; 3], stress: &Strains, strain: &Strains, weight: f64) {
    for (c, row) in block.iter_mut().enumerate() {
        for (d, v) in row.iter_mut().enumerate() {
            *v += weight * (0..6).map(|k| stress[k][c] * strain[k][d]).sum::<f64>();
        }
    }
}
