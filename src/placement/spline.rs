//! Cubic splines through points, smooth if asked for.

use super::profile::ProfilePiece;

/// The cubic pieces of the natural spline through the points (y, z), m, `[n]`, y strictly ascending, n ≥ 2: `[n − 1]`
/// pieces.
///
/// With a `wavelength` (m) above zero it is the smoothing spline that minimises ∫(f − z)² + λ∫f″², the first integral
/// taken as a sum with the points' own shares of the line, λ = (wavelength/2π)⁴: a wave of that length keeps half of
/// its height, one of half the length 6 %, one of twice the length 94 % (C. H. Reinsch, Smoothing by spline
/// functions, Numer. Math. 10, 1967).
pub fn spline(y: &[f64], z: &[f64], wavelength: f64) -> Vec<ProfilePiece> {
    let n = y.len();
    let h: Vec<f64> = y.windows(2).map(|w| w[1] - w[0]).collect();
    let lambda = (wavelength / (2.0 * std::f64::consts::PI)).powi(4);
    // Weight of a point: half the distances to its neighbours.
    let share = |i: usize| 0.5 * (if i > 0 { h[i - 1] } else { 0.0 } + h.get(i).copied().unwrap_or(0.0));
    // Second differences Q: column j belongs to the point j + 1 and has three entries from row j on.
    let q = |j: usize| [1.0 / h[j], -1.0 / h[j] - 1.0 / h[j + 1], 1.0 / h[j + 1]];
    let m = n.saturating_sub(2);
    // (R + λ QᵀW⁻¹Q) γ = Qᵀz with the second derivatives γ: diagonal and two bands.
    let mut band = vec![[0.0; 3]; m];
    let mut second = vec![0.0; m];
    for j in 0..m {
        let a = q(j);
        second[j] = (0..3).map(|k| a[k] * z[j + k]).sum();
        band[j][0] = (h[j] + h[j + 1]) / 3.0;
        band[j][1] = h[j + 1] / 6.0;
        for d in 0..3.min(m - j) {
            let b = q(j + d);
            band[j][d] += lambda * (d..3).map(|k| a[k] * b[k - d] / share(j + k)).sum::<f64>();
        }
    }
    solve(&mut band, &mut second);
    let mut value = z.to_vec();
    for (j, g) in second.iter().enumerate() {
        let a = q(j);
        for k in 0..3 {
            value[j + k] -= lambda * a[k] * g / share(j + k);
        }
    }
    let bend = |i: usize| if i == 0 || i + 1 == n { 0.0 } else { second[i - 1] };
    let piece = |i: usize| {
        let (g0, g1) = (bend(i), bend(i + 1));
        let slope = (value[i + 1] - value[i]) / h[i] - h[i] * (2.0 * g0 + g1) / 6.0;
        let coefficients = vec![value[i], slope, 0.5 * g0, (g1 - g0) / (6.0 * h[i])];
        ProfilePiece::Polynomial { at: y[i], coefficients }
    };
    (0..n.saturating_sub(1)).map(piece).collect()
}

/// Solves a symmetric positive definite system of two bands in place: `band[j]` holds the entries (j, j), (j, j+1),
/// (j, j+2).
fn solve(band: &mut [[f64; 3]], b: &mut [f64]) {
    let m = b.len();
    for j in 0..m {
        let [d, e, f] = band[j];
        if j + 1 < m {
            band[j + 1][0] -= e * e / d;
            band[j + 1][1] -= e * f / d;
            b[j + 1] -= b[j] * e / d;
        }
        if j + 2 < m {
            band[j + 2][0] -= f * f / d;
            b[j + 2] -= b[j] * f / d;
        }
    }
    for j in (0..m).rev() {
        let [d, e, f] = band[j];
        let after = |k: usize| b.get(j + k).copied().unwrap_or(0.0);
        b[j] = (b[j] - e * after(1) - f * after(2)) / d;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(f: impl Fn(f64) -> f64, n: usize) -> (Vec<f64>, Vec<f64>) {
        // Uneven distances, 0.1 m in all.
        let y: Vec<f64> = (0..n).map(|i| (i as f64 + 0.3 * (1.7 * i as f64).sin()) * 0.1 / n as f64).collect();
        let z = y.iter().map(|&y| f(y)).collect();
        (y, z)
    }

    fn at(y: &[f64], pieces: &[ProfilePiece], v: f64) -> super::super::profile::Local {
        pieces[y.partition_point(|&k| k <= v).clamp(1, pieces.len()) - 1].local(v)
    }

    #[test]
    fn it_passes_through_its_points_smoothly_and_converges() {
        let f = |y: f64| 1e-3 * (60.0 * y).sin();
        let mut before = f64::INFINITY;
        for n in [40, 80, 160] {
            let (y, z) = points(f, n);
            let pieces = spline(&y, &z, 0.0);
            for i in 1..n - 1 {
                let (a, b) = (pieces[i - 1].local(y[i]), pieces[i].local(y[i]));
                assert!((a.z - z[i]).abs() < 1e-17 && (b.z - z[i]).abs() < 1e-17);
                assert!((a.slope - b.slope).abs() < 1e-13 && (a.second - b.second).abs() < 1e-9);
            }
            // Away from the ends, whose second derivative is set to zero.
            let worst = (0..200).map(|i| 0.03 + 0.04 * i as f64 / 200.0);
            let worst = worst.map(|v| (at(&y, &pieces, v).z - f(v)).abs()).fold(0.0, f64::max);
            assert!(worst < before / 12.0, "{n}: {worst} after {before}");
            before = worst;
        }
        assert!(before < 1e-10);
    }

    #[test]
    fn smoothing_keeps_lines_and_half_of_a_wave_of_its_length() {
        let (y, z) = points(|y| 0.02 - 0.4 * y, 50);
        for (piece, v) in spline(&y, &z, 0.01).iter().zip(&y) {
            assert!((piece.local(*v).z - (0.02 - 0.4 * v)).abs() < 1e-12);
        }
        let length = 8e-3;
        for (times, kept) in [(1.0, 0.5), (2.0, 16.0 / 17.0), (0.5, 1.0 / 17.0)] {
            let wave = |y: f64| 1e-5 * (2.0 * std::f64::consts::PI * (y - 0.05) / (times * length)).cos();
            let (y, z) = points(wave, 400);
            let found = at(&y, &spline(&y, &z, length), 0.05).z / 1e-5;
            assert!((found - kept).abs() < 0.01, "{times}: {found} {kept}");
        }
    }

    #[test]
    fn two_points_are_a_line() {
        let pieces = spline(&[0.0, 2.0], &[1.0, 3.0], 0.0);
        assert_eq!(pieces.len(), 1);
        assert_eq!(pieces[0].local(1.0).z, 2.0);
    }
}
