//! Position of a contact of one point on the interface.

use crate::grid::{ContactPatch, Interface};

/// Weights at which the modes are evaluated: pairs (node, coefficient).
pub struct Footprint {
    /// Mean over the contact; the coefficients add up to 1.
    pub mean: Vec<(usize, f64)>,
    /// Mean of the slope ∂/∂x over it, 1/m.
    pub slope: Vec<(usize, f64)>,
}

impl Footprint {
    /// The contact on the grid `s` under `pressure`, Pa, `[n]`: means weighted by its forces. Modes are smooth: their
    /// slope is the central difference at each node, that of the parabola through it and its neighbours.
    pub(crate) fn of_pressure(s: &Interface, pressure: &[f64]) -> Self {
        let force = |i: usize| pressure[i] * s.weight[i];
        let load: f64 = (0..s.len()).map(force).sum();
        let closed: Vec<usize> = (0..s.len()).filter(|&i| pressure[i] > 0.0 && !s.on_border(i)).collect();
        let mean: Vec<(usize, f64)> = closed.iter().map(|&i| (i, force(i) / load)).collect();
        let slope = mean.iter().flat_map(|&(i, share)| {
            let (ContactPatch { x, .. }, at, _) = s.place(i);
            let [back, ahead] = [x[at] - x[at - 1], x[at + 1] - x[at]];
            let [upstream, downstream] = [-ahead / (back * (back + ahead)), back / (ahead * (back + ahead))];
            [(i - 1, upstream), (i, -upstream - downstream), (i + 1, downstream)].map(|(j, c)| (j, share * c))
        });
        let slope = slope.collect();
        Self { mean, slope }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean over the pressure of a field on a graded grid, and slope of a parabola.
    #[test]
    fn a_place_has_means_and_slopes() {
        let (x, y) = (vec![-3.0, -1.5, -0.5, 0.0, 1.0, 2.5, 4.0], vec![-2.0, -1.0, 0.5, 1.0]);
        let s = Interface::new(x, y, vec![0.0; 28]).unwrap();
        let mut pressure = vec![0.0; s.len()];
        let pressed = [(9, 2.0), (10, 1.0), (11, 3.0), (17, 4.0)];
        pressed.iter().for_each(|&(i, p)| pressure[i] = p);
        let place = Footprint::of_pressure(&s, &pressure);
        let field = |[x, y]: [f64; 2]| 1.0 + 2.0 * x - 0.5 * x * x + x * y;
        let slope = |[x, y]: [f64; 2]| 2.0 - x + y;
        let load: f64 = pressed.iter().map(|&(i, p)| p * s.weight[i]).sum();
        let over = |f: &dyn Fn([f64; 2]) -> f64| -> f64 {
            pressed.iter().map(|&(i, p)| p * s.weight[i] / load * f(s.point(i))).sum()
        };
        let by = |list: &[(usize, f64)]| list.iter().map(|&(i, c)| c * field(s.point(i))).sum::<f64>();
        assert!((by(&place.mean) - over(&field)).abs() < 1e-12, "{}", by(&place.mean));
        assert!((by(&place.slope) - over(&slope)).abs() < 1e-12, "{}", by(&place.slope));
    }
}
