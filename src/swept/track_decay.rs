//! Track decay rate of EN 15461:2008+A1:2010: how fast the vibration of a rail falls along it.
//!
//! An accelerometer stands at the middle of a sleeper bay, and a hammer strikes at 29 positions x_n from it. From the
//! responses A(x_n) of a third octave, by the rail from halfway to the position before to halfway to the one after,
//!
//!   DR = 4.343 / Σ_n |A(x_n)|²/|A(x_0)|² Δx_n   dB/m,
//!
//! which is 20 lg e β where A decays as e^{−βx}. Positions and formulas as the Python package phonometry
//! (github jmrplens/phonometry, environment/sources/track_decay.py) has read them from the standard: its Figure 2,
//! Formulas 1 and 2, Annex A.

/// Positions of the hammer, in sleeper bays from the accelerometer (Figure 2).
pub const POSITIONS: [f64; 29] = [
    0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 16.0,
    20.0, 24.0, 30.0, 36.0, 42.0, 48.0, 54.0, 66.0,
];
/// 10 lg e, as the standard prints it.
const DECIBELS: f64 = 4.343;

/// Lengths of rail Δx_n that the positions stand for, m: half the way to the neighbours, the last one symmetrical.
fn lengths(positions: &[f64]) -> Vec<f64> {
    let last = positions.len().saturating_sub(1);
    let after = |n: usize| if n < last { 0.5 * (positions[n + 1] - positions[n]) } else { 0.0 };
    let before = |n: usize| if n > 0 { 0.5 * (positions[n] - positions[n - 1]) } else { 0.0 };
    (0..positions.len()).map(|n| before(n) + if n == last { before(n) } else { after(n) }).collect()
}

/// The decay rate, dB/m, from |A(x_n)|² at the `positions`, m, the direct response first.
pub fn decay_rate(squares: &[f64], positions: &[f64]) -> f64 {
    let sum: f64 = squares.iter().zip(lengths(positions)).map(|(a, length)| a / squares[0] * length).sum();
    DECIBELS / sum
}

/// Derivative of the logarithm of the decay rate by a parameter: `squares` are |A(x_n)|² at the `positions`, m, and
/// `slopes` their derivatives. With S_n = |A(x_n)|²/|A(x_0)|² it is −Σ S_n′ Δx_n/Σ S_n Δx_n.
pub fn log_slope(squares: &[f64], slopes: &[f64], positions: &[f64]) -> f64 {
    let (first, change) = (squares[0], slopes[0] / squares[0]);
    let mut sums = [0.0; 2];
    for ((square, slope), length) in squares.iter().zip(slopes).zip(lengths(positions)) {
        sums[0] += square / first * length;
        sums[1] += (slope - square * change) / first * length;
    }
    -sums[1] / sums[0]
}

/// The lowest decay rate that positions up to `farthest`, m, can tell, dB/m (Formula 2); twice that is certain.
pub fn lowest_rate(farthest: f64) -> f64 {
    DECIBELS / farthest
}

#[cfg(test)]
mod tests {
    use super::super::beam::Beam;
    use super::*;
    use num_complex::Complex64;
    use std::f64::consts::PI;

    fn metres() -> Vec<f64> {
        POSITIONS.map(|bay| 0.6 * bay).to_vec()
    }

    /// Evenly spaced positions make a geometric series of an exponential.
    #[test]
    fn an_exponential_has_its_rate() {
        let (beta, d, n) = (0.3, 0.05, 2000);
        let positions: Vec<f64> = (0..n).map(|k| d * f64::from(k)).collect();
        let squares: Vec<f64> = positions.iter().map(|x| (-2.0 * beta * x).exp()).collect();
        let q = (-2.0 * beta * d).exp();
        let wanted = 4.343 / (d * (0.5 + q / (1.0 - q)));
        let found = decay_rate(&squares, &positions);
        assert!((found / wanted - 1.0).abs() < 1e-9, "{found} and {wanted}");
        assert!((found / (20.0 * beta / 10f64.ln()) - 1.0).abs() < 1e-3, "{found}");
        // No decay: all of the rail, and the lowest rate that is told.
        let flat = decay_rate(&[1.0; 29], &metres());
        assert!((flat - 4.343 / (39.6 + 3.6)).abs() < 1e-12 && (lowest_rate(39.6) - 0.10967).abs() < 1e-5, "{flat}");
    }

    /// Euler's beam on Winkler's foundation: u(x) = −i Σ e^{−ik_j x}/4EIk_j³ of the wave k, k⁴ = (mω² − s)/EI, and the
    /// near field −ik. ∫|u|² dx is that of four exponentials. Where the wave hardly decays the near field is half of
    /// the direct response, and the rate up to twice that of the wave alone.
    #[test]
    fn a_beam_on_winklers_foundation_in_closed_form() {
        let (bending, mass) = (210e9 * 3.037e-5 * Complex64::new(1.0, 0.06), 60.2);
        let stiffness = Complex64::new(1e8, 1e8);
        for f in [500.0, 1000.0, 2000.0, 4000.0] {
            let omega = 2.0 * PI * f;
            let k = ((mass * omega * omega - stiffness) / bending).powf(0.25);
            let k = if k.im > 0.0 { -k } else { k };
            // Of the waves k and −ik, which decay.
            let waves = [
                (k, -Complex64::I / (4.0 * bending * k.powi(3))),
                (-Complex64::I * k, {
                    let near = -Complex64::I * k;
                    -Complex64::I / (4.0 * bending * near.powi(3))
                }),
            ];
            let at = |x: f64| -> Complex64 { waves.iter().map(|(k, a)| a * (-Complex64::I * k * x).exp()).sum() };
            let integral: f64 = waves
                .iter()
                .flat_map(|(k, a)| waves.iter().map(move |(l, b)| (a * b.conj() / (Complex64::I * (k - l.conj()))).re))
                .sum();
            let exact = 10.0 / 10f64.ln() * at(0.0).norm_sqr() / integral;
            let fine: Vec<f64> = (0..80_000).map(|n| 0.01 * f64::from(n)).collect();
            let squares: Vec<f64> = fine.iter().map(|x| at(*x).norm_sqr()).collect();
            let found = decay_rate(&squares, &fine);
            assert!((found / exact - 1.0).abs() < 2e-3, "{f} Hz: {found} and {exact}");
            let grid = metres();
            let squares: Vec<f64> = grid.iter().map(|x| at(*x).norm_sqr()).collect();
            let standard = decay_rate(&squares, &grid);
            let wave = 20.0 / 10f64.ln() * -k.im;
            assert!(standard > wave && standard < 2.3 * wave, "{f} Hz: {standard}, the wave {wave}, exact {exact}");
            // Timoshenko's beam of stiff shear is Euler's.
            let beam = Beam {
                young: 210e9,
                shear: 1e16,
                // Wide, so that turning has no inertia.
                density: mass / 7.67,
                area: 7.67,
                inertia: 3.037e-5,
                sheared: 1.0,
                loss: 0.06,
            };
            for x in [0.0, 0.15, 1.2] {
                let moved = beam.along(omega, stiffness, x);
                assert!((moved / at(x) - 1.0).norm() < 0.02, "{f} Hz, {x} m: {moved:e} and {:e}", at(x));
            }
        }
    }
}
