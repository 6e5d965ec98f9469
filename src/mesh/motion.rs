//! Rotations of points.

/// The point `x` turned about the axis through `about` along `axis` (of any length but 0) by `angle`, rad,
/// right-handed (Rodrigues). Quarter turns are exact.
pub fn rotated(x: [f64; 3], about: [f64; 3], axis: [f64; 3], angle: f64) -> [f64; 3] {
    let length = axis.iter().map(|a| a * a).sum::<f64>().sqrt();
    let k = axis.map(|a| a / length);
    let (sin, cos) = sin_cos(angle);
    let r = [0, 1, 2].map(|c| x[c] - about[c]);
    let along: f64 = k.iter().zip(r).map(|(a, b)| a * b).sum();
    let cross = [k[1] * r[2] - k[2] * r[1], k[2] * r[0] - k[0] * r[2], k[0] * r[1] - k[1] * r[0]];
    [0, 1, 2].map(|c| about[c] + r[c] * cos + cross[c] * sin + k[c] * along * (1.0 - cos))
}

/// Sine and cosine; those of whole quarter turns are 0 and ±1, so that planes of a mesh stay planes to the last bit.
fn sin_cos(angle: f64) -> (f64, f64) {
    let quarters = angle / std::f64::consts::FRAC_PI_2;
    if (quarters - quarters.round()).abs() > 1e-14 * quarters.abs().max(1.0) {
        return angle.sin_cos();
    }
    [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][quarters.round().rem_euclid(4.0) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_right_handed_and_quarter_turns_exact() {
        let quarter = std::f64::consts::FRAC_PI_2;
        assert_eq!(rotated([1.0, 0.0, 0.0], [0.0; 3], [0.0, 0.0, 2.0], quarter), [0.0, 1.0, 0.0]);
        assert_eq!(rotated([0.0, 1.0, 0.0], [0.0; 3], [3.0, 0.0, 0.0], quarter), [0.0, 0.0, 1.0]);
        assert_eq!(rotated([0.0, 0.0, 1.0], [0.0; 3], [0.0, 1.0, 0.0], -3.0 * quarter), [1.0, 0.0, 0.0]);
        // About an axis that does not pass through the origin; there and back.
        assert_eq!(rotated([2.0, 1.0, 5.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0], 2.0 * quarter), [0.0, 1.0, 5.0]);
        let (x, about, axis) = ([0.3, -0.7, 1.1], [0.2, 0.4, -0.5], [1.0, -2.0, 0.5]);
        let back = rotated(rotated(x, about, axis, 0.7), about, axis, -0.7);
        assert!(back.iter().zip(x).all(|(a, b)| (a - b).abs() < 1e-15), "{back:?}");
        let third = rotated(x, [0.0; 3], [1.0, 1.0, 1.0], 4.0 * quarter / 3.0);
        assert!(third.iter().zip([x[2], x[0], x[1]]).all(|(a, b)| (a - b).abs() < 1e-15), "{third:?}");
    }
}
