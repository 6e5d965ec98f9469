//! Loads and motions at a contact whose frame is turned about x against that of the section.

use super::load_patch::{Square, LOADS};

/// The components (x, y, n) of the nine loads, [`LOADS`], in a frame turned by `angle` (rad) about x: along y is cos
/// u_y − sin u_n of what was along y and n, along n is sin u_y + cos u_n. The factors x and y stay with their places.
pub fn rotate_loads(loads: [f64; LOADS], angle: f64) -> [f64; LOADS] {
    let (s, c) = angle.sin_cos();
    std::array::from_fn(|k| match k % 3 {
        0 => loads[k],
        1 => c * loads[k] - s * loads[k + 1],
        _ => s * loads[k - 1] + c * loads[k],
    })
}

/// A value for each pair of loads in that frame.
pub(crate) fn rotate_load_pairs(square: &Square, angle: f64) -> Square {
    rotate_load_pairs_between(square, [angle, angle])
}

/// A value for each pair of a load at one contact and a load at another one, each in a frame turned by an angle of its
/// own, rad.
pub(crate) fn rotate_load_pairs_between(square: &Square, [one, other]: [f64; 2]) -> Square {
    let rows = square.map(|row| rotate_loads(row, other));
    let mut all = [[0.0; LOADS]; LOADS];
    for j in 0..LOADS {
        let column = rotate_loads(std::array::from_fn(|i| rows[i][j]), one);
        column.into_iter().enumerate().for_each(|(i, v)| all[i][j] = v);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn takes n to −y; turning a product of motions is turning both; no turn leaves all as it is.
    #[test]
    fn pairs_turn_as_their_motions_do() {
        let quarter = 0.5 * std::f64::consts::PI;
        let [x, y, n] = [1.0, 2.0, 3.0];
        let loads = rotate_loads([x, y, n, 0.0, 0.0, 0.0, n, x, y], quarter);
        let wanted = [x, -n, y, 0.0, 0.0, 0.0, n, -y, x];
        assert!(loads.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-15), "{loads:?}");
        let (a, b): ([f64; LOADS], [f64; LOADS]) =
            (std::array::from_fn(|k| 1.0 + k as f64), std::array::from_fn(|k| (k * k) as f64 - 7.0));
        let square: Square = a.map(|a| b.map(|b| a * b));
        let (ta, tb) = (rotate_loads(a, 0.3), rotate_loads(b, 0.3));
        for (i, row) in rotate_load_pairs(&square, 0.3).iter().enumerate() {
            assert!(row.iter().zip(tb).all(|(v, b)| (v - ta[i] * b).abs() < 1e-12));
        }
        let other = rotate_loads(b, -1.1);
        for (i, row) in rotate_load_pairs_between(&square, [0.3, -1.1]).iter().enumerate() {
            assert!(row.iter().zip(other).all(|(v, b)| (v - ta[i] * b).abs() < 1e-12));
        }
        assert_eq!(rotate_load_pairs(&square, 0.0), square);
    }
}
