//! Kalker's coefficients of the linear theory of rolling contact: forces without slip on an elliptic contact of like
//! half-spaces.

/// C11, C22 and C23 = −C32 of an elliptic contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// Longitudinal.
    pub longitudinal: f64,
    /// Lateral.
    pub lateral: f64,
    /// Lateral force by spin.
    pub spin: f64,
}

/// A row: C11, C22, C23, each for ν = 0, 1/4, 1/2.
type Row = [[f64; 3]; 3];

/// Half-axis ratios a/b = 0.1, 0.2 … 1 (a along the rolling direction). J. J. Kalker, *Three-Dimensional Elastic
/// Bodies in Rolling Contact* (Kluwer, 1990), table E3; at a/b = 0.8 it has 1.15 for C23 at ν = 1/4, taken as a
/// misprint of the 1.25 that the neighbours ask for.
#[allow(clippy::approx_constant)] // Figures of the table.
const NARROW: [Row; 10] = [
    [[2.51, 3.31, 4.85], [2.51, 2.52, 2.53], [0.334, 0.473, 0.731]],
    [[2.59, 3.37, 4.81], [2.59, 2.63, 2.66], [0.483, 0.603, 0.809]],
    [[2.68, 3.44, 4.80], [2.68, 2.75, 2.81], [0.607, 0.715, 0.889]],
    [[2.78, 3.53, 4.82], [2.78, 2.88, 2.98], [0.720, 0.823, 0.977]],
    [[2.88, 3.62, 4.83], [2.88, 3.01, 3.14], [0.827, 0.929, 1.07]],
    [[2.98, 3.72, 4.91], [2.98, 3.14, 3.31], [0.930, 1.03, 1.18]],
    [[3.09, 3.81, 4.97], [3.09, 3.28, 3.48], [1.03, 1.14, 1.29]],
    [[3.19, 3.91, 5.05], [3.19, 3.41, 3.65], [1.13, 1.25, 1.40]],
    [[3.29, 4.01, 5.12], [3.29, 3.54, 3.82], [1.23, 1.36, 1.51]],
    [[3.40, 4.12, 5.20], [3.40, 3.67, 3.98], [1.33, 1.47, 1.63]],
];

/// The same for b/a = 0.1, 0.2 … 1.
const LONG: [Row; 10] = [
    [[10.7, 11.7, 12.9], [10.7, 12.8, 16.0], [12.2, 14.6, 18.0]],
    [[6.96, 7.78, 8.82], [6.96, 8.14, 9.79], [5.72, 6.63, 7.89]],
    [[5.57, 6.34, 7.34], [5.57, 6.40, 7.51], [3.79, 4.32, 5.01]],
    [[4.84, 5.57, 6.57], [4.84, 5.48, 6.31], [2.88, 3.24, 3.70]],
    [[4.37, 5.10, 6.11], [4.37, 4.90, 5.56], [2.35, 2.62, 2.96]],
    [[4.06, 4.78, 5.80], [4.06, 4.50, 5.04], [2.01, 2.23, 2.50]],
    [[3.82, 4.54, 5.58], [3.82, 4.21, 4.67], [1.76, 1.95, 2.18]],
    [[3.65, 4.36, 5.42], [3.65, 3.99, 4.39], [1.58, 1.75, 1.94]],
    [[3.51, 4.22, 5.30], [3.51, 3.81, 4.16], [1.44, 1.59, 1.77]],
    [[3.40, 4.12, 5.20], [3.40, 3.67, 3.98], [1.33, 1.47, 1.63]],
];

/// The coefficients for Poisson's ratio `poisson` and the half-axes a/b = `ratio`, between 0.1 and 10: straight
/// between the ratios of the table, and in ν the parabola of the inverses. None beyond the table.
///
/// ```
/// use railsqueal::contact::baseline::coefficients;
///
/// let round = coefficients(0.25, 1.0).expect("within the table");
/// let table = [4.12, 3.67, 1.47];
/// let found = [round.longitudinal, round.lateral, round.spin];
/// assert!(found.iter().zip(table).all(|(a, b)| (a - b).abs() < 1e-12));
/// assert!(coefficients(0.25, 0.01).is_none());
/// ```
pub fn coefficients(poisson: f64, ratio: f64) -> Option<Coefficients> {
    let (table, g) = if ratio <= 1.0 { (&NARROW, ratio) } else { (&LONG, 1.0 / ratio) };
    if !(g >= 0.1 && (0.0..=0.5).contains(&poisson)) {
        return None;
    }
    let row = ((10.0 * g).floor() as usize).clamp(1, 9);
    let part = 10.0 * g - row as f64;
    let of = |coefficient: usize| {
        let at = |k: usize| {
            let [low, high] = [row - 1, row].map(|r| table[r][coefficient][k]);
            low + part * (high - low)
        };
        let n = poisson;
        let inverse =
            8.0 * (n - 0.25) * (n - 0.5) / at(0) - 16.0 * n * (n - 0.5) / at(1) + 8.0 * n * (n - 0.25) / at(2);
        1.0 / inverse
    };
    Some(Coefficients { longitudinal: of(0), lateral: of(1), spin: of(2) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_met_and_a_circle_of_steel_has_the_known_figure() {
        let c = coefficients(0.25, 0.8).unwrap();
        assert!(
            (c.longitudinal - 3.91).abs() < 1e-12 && (c.lateral - 3.41).abs() < 1e-12 && (c.spin - 1.25).abs() < 1e-12
        );
        let c = coefficients(0.5, 5.0).unwrap();
        assert!(
            (c.longitudinal - 8.82).abs() < 1e-12 && (c.lateral - 9.79).abs() < 1e-12 && (c.spin - 7.89).abs() < 1e-12
        );
        // C22 of a circle with ν = 0.3 by CONTACT's own theory.
        let c = coefficients(0.3, 1.0).unwrap();
        assert!((c.lateral - 3.729).abs() < 5e-3, "{c:?}");
        assert!(coefficients(0.3, 0.05).is_none() && coefficients(0.3, 20.0).is_none());
    }

    /// Each figure of the table is where the ones beside it have it, and both tables meet: a misprint would show.
    #[test]
    fn the_table_is_smooth() {
        for table in [&NARROW, &LONG] {
            for (i, c, k) in (1..9).flat_map(|i| (0..3).flat_map(move |c| (0..3).map(move |k| (i, c, k)))) {
                let place = |j: usize| (j as f64 + 1.0).ln();
                let beside: Vec<usize> = (i.max(2) - 2..=(i + 2).min(9)).filter(|&j| j != i).collect();
                let share = |j: usize| -> f64 {
                    let others = beside.iter().filter(|&&m| m != j);
                    others.map(|&m| (place(i) - place(m)) / (place(j) - place(m))).product()
                };
                let want = beside.iter().map(|&j| share(j) * table[j][c][k].ln()).sum::<f64>().exp();
                let found = table[i][c][k];
                assert!((found / want - 1.0).abs() < 0.01, "row {i}, C{c}, ν {k}: {found}, by its neighbours {want}");
            }
        }
        assert_eq!(NARROW[9], LONG[9]);
    }
}
