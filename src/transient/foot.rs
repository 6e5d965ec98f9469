//! Displacement of the material upstream: w at x − Vh, interpolated along the lines of the grid.
//!
//! Between two nodes the interpolant is the cubic with the slopes of the third-order upwind-biased differences there, limited so
//! that it is monotone between monotone values (F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17 (1980)). A straight
//! line between the nodes would be diffusive where Vh is much less than their distance, an unlimited cubic overshoots at the
//! leading edge.

/// Where the foot of a node lies on its line of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Foot {
    /// On the node with this index along x.
    Node(usize),
    /// Between the nodes `left` and `left + 1`, at the share `s` of the way.
    Between {
        /// Index of the node before.
        left: usize,
        /// In (0, 1).
        s: f64,
    },
}

/// The feet of the nodes along a line of the grid at `x` (m, ascending), at the distance `travel` ≥ 0 upstream; None where a foot
/// lies before the first node.
pub fn feet(x: &[f64], travel: f64) -> Vec<Option<Foot>> {
    let close = 1e-9 * x.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    let find = |&at: &f64| {
        let foot = at - travel;
        let after = x.partition_point(|&v| v <= foot + close);
        let left = after.checked_sub(1)?;
        if (foot - x[left]).abs() <= close {
            return Some(Foot::Node(left));
        }
        Some(Foot::Between { left, s: (foot - x[left]) / (x[left + 1] - x[left]) })
    };
    x.iter().map(find).collect()
}

/// Range of the nodes along x that the value at `foot` is taken from, of `nx`.
pub fn support(foot: Foot, nx: usize) -> std::ops::RangeInclusive<usize> {
    match foot {
        Foot::Node(i) => i..=i,
        // One node after the interval, and two before it for the slope at its beginning.
        Foot::Between { left, .. } => left.saturating_sub(2)..=(left + 2).min(nx - 1),
    }
}

/// The value of the nodal quantity `v` (by index along x) at `foot` on the line `x`.
pub fn value(x: &[f64], foot: Foot, v: impl Fn(usize) -> f64) -> f64 {
    match foot {
        Foot::Node(i) => v(i),
        Foot::Between { left, s } => {
            let h = x[left + 1] - x[left];
            let (a, b) = (v(left), v(left + 1));
            let (da, db) = (h * slope(x, left, &v), h * slope(x, left + 1, &v));
            let r = 1.0 - s;
            // Hermite's cubic.
            a * r * r * (1.0 + 2.0 * s) + b * s * s * (1.0 + 2.0 * r) + s * r * (da * r - db * s)
        }
    }
}

/// The value at a foot between the nodes i − 1 and i, where i is the first closed node of its line: ahead of the edge x_e of the
/// contact the gap and the departure of w from its course inside both grow like (x_e − x)^{3/2}, and the gaps at the two open
/// nodes say where x_e lies. For short steps this is the steady analysis's difference at the edge
/// ([`crate::contact::Stencil::Edge`]). `h1`, `h2`: distances to the two open nodes, `v` the values at i, i − 1, i − 2, `gap` the gaps at
/// i − 1 and i − 2; the value stays between v(i − 1) and v(i).
pub fn edge_value(travel: f64, [h1, h2]: [f64; 2], v: [f64; 3], gap: [f64; 2]) -> f64 {
    let b = (gap[1] / gap[0]).max((1.0 + 1.2 * (h2 - h1) / h1).powf(1.2));
    let slope = ((b - 1.0) * v[0] - b * v[1] + v[2]) / (b * h1 - h2);
    let departure = v[1] - v[0] + slope * h1;
    // Distance of the first open node from the edge.
    let ahead = (h2 - h1) / (b.powf(2.0 / 3.0) - 1.0);
    let part = (1.0 - (h1 - travel) / ahead).max(0.0).powf(1.5);
    (v[0] - slope * travel + departure * part).clamp(v[0].min(v[1]), v[0].max(v[1]))
}

/// Limited slope at node `i`: the derivative of the cubic through the nodes i − 2 … i + 1 (of the parabola through three where
/// the line ends), no steeper than three times the secants beside the node, and none where they differ in sign.
fn slope(x: &[f64], i: usize, v: &impl Fn(usize) -> f64) -> f64 {
    let nx = x.len();
    let secant = |j: usize| (v(j + 1) - v(j)) / (x[j + 1] - x[j]);
    if i == 0 {
        return secant(0);
    }
    if i + 1 == nx {
        return secant(nx - 2);
    }
    let (before, after) = (secant(i - 1), secant(i));
    if before * after <= 0.0 {
        return 0.0;
    }
    let (h0, h1) = (x[i] - x[i - 1], x[i + 1] - x[i]);
    // Newton's form of the interpolant: derivative at x_i of the parabola, then of the cubic.
    let second = (after - before) / (h0 + h1);
    let mut d = before + h0 * second;
    if i >= 2 {
        let h00 = x[i - 1] - x[i - 2];
        let third = (second - (before - secant(i - 2)) / (h0 + h00)) / (h00 + h0 + h1);
        d -= h0 * h1 * third;
    }
    let most = 3.0 * before.abs().min(after.abs());
    d.signum() * d.abs().min(most) * if d * before > 0.0 { 1.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: [f64; 8] = [0.0, 1.0, 1.8, 3.0, 4.1, 5.0, 6.0, 7.0];

    #[test]
    fn interpolates_parabolas_nearly_and_straight_lines_exactly() {
        for travel in [0.05, 0.3, 0.77] {
            for (i, f) in feet(&X, travel).iter().enumerate().skip(1) {
                let at = X[i] - travel;
                let f = f.unwrap();
                assert!((value(&X, f, |j| 3.0 - 2.0 * X[j]) - (3.0 - 2.0 * at)).abs() < 1e-12);
                if (3..7).contains(&i) {
                    let got = value(&X, f, |j| (X[j] + 9.0).powi(2));
                    assert!((got - (at + 9.0).powi(2)).abs() < 1e-11, "{i} {travel}: {got}");
                }
            }
        }
        assert_eq!(feet(&X, 1.0)[6], Some(Foot::Node(5)));
        assert_eq!(feet(&X, 0.5)[0], None);
        assert_eq!(feet(&X, 0.0)[3], Some(Foot::Node(3)));
    }

    #[test]
    fn never_leaves_the_range_of_the_two_nodes() {
        let edge = [0.0, 0.0, 0.0, 1.0, 1.0, 0.2, 0.2, 5.0];
        for k in 1..200 {
            let travel = k as f64 * 0.004;
            for (i, f) in feet(&X, travel).iter().enumerate().skip(1) {
                let Some(Foot::Between { left, s }) = *f else { continue };
                let got = value(&X, Foot::Between { left, s }, |j| edge[j]);
                let (lo, hi) = (edge[left].min(edge[left + 1]), edge[left].max(edge[left + 1]));
                assert!(got >= lo - 1e-15 && got <= hi + 1e-15, "node {i}, travel {travel}: {got} of [{lo}, {hi}]");
            }
        }
    }

    #[test]
    fn at_the_edge_exact_for_a_line_and_what_grows_with_the_gap() {
        let (x, edge) = ([0.0, -1.0, -2.2], -0.4);
        let ahead = |x: f64| f64::max(edge - x, 0.0).powf(1.5);
        for travel in [0.1, 0.3, 0.45, 0.8] {
            let w = |x: f64| 1.0 - 2.0 * x - 0.3 * ahead(x);
            let got = edge_value(travel, [1.0, 2.2], x.map(w), [7.0 * ahead(x[1]), 7.0 * ahead(x[2])]);
            assert!((got - w(-travel)).abs() < 1e-12, "{travel}: {got}, expected {}", w(-travel));
        }
    }

    #[test]
    fn third_order_where_smooth() {
        let error = |n: usize| {
            let x: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
            feet(&x, 0.3 / n as f64)
                .iter()
                .enumerate()
                .skip(3)
                .take(n - 4)
                .map(|(i, f)| {
                    (value(&x, f.unwrap(), |j| (2.0 * x[j]).exp()) - (2.0 * (x[i] - 0.3 / n as f64)).exp()).abs()
                })
                .fold(0.0, f64::max)
        };
        let (a, b) = (error(20), error(40));
        assert!(a / b > 7.0, "errors {a:e} {b:e}");
    }
}
