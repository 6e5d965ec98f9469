//! Displacement of the material upstream: w at x − Vh, interpolated along the lines of the grid.
//!
//! Inside the contact it lies on the parabola through the two nodes beside the foot and the next one upstream (R. M. Beam and R. F. Warming,
//! J. Comput. Phys. 22 (1976)). For short steps the difference along the particle is then that of the steady and the linear
//! analyses, [`crate::contact::Stencil::Edge`], node by node, and what the three find is the same but for the first order in
//! Vh. A straight line would be diffusive where Vh is much less than the distance of the nodes. A cubic limited to be
//! monotone is not better: where w has an extremum inside the contact its slope there becomes zero, however short the step, and
//! the stress in the stick area drifts away from the steady one, in another way for every step.

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
        // The nodes of the interval, and the one before it.
        Foot::Between { left, .. } => left.saturating_sub(1)..=(left + 1).min(nx - 1),
    }
}

/// The value of the nodal quantity `v` (by index along x) at `foot` on the line `x`: on a parabola where `smooth`, else on a straight
/// line.
pub fn value(x: &[f64], foot: Foot, smooth: bool, v: impl Fn(usize) -> f64) -> f64 {
    match foot {
        Foot::Node(i) => v(i),
        Foot::Between { left, s } => {
            let h = x[left + 1] - x[left];
            let (a, b) = (v(left), v(left + 1));
            let line = a + s * (b - a);
            if !smooth || left == 0 {
                return line;
            }
            // Newton's form of the parabola.
            let h0 = x[left] - x[left - 1];
            let second = ((b - a) / h - (a - v(left - 1)) / h0) / (h0 + h);
            line - s * (1.0 - s) * h * h * second
        }
    }
}

/// The value at a foot between the nodes i − 1 and i, where i is the first closed node of its line: ahead of the edge x_e of the
/// contact the gap and the departure of w from its course inside both grow like (x_e − x)^{3/2}, and the gaps at the two open
/// nodes say where x_e lies. For short steps this is the steady analysis's difference at the edge
/// ([`crate::contact::Stencil::Edge`]). `h1`, `h2`: distances to the two open nodes, `v` the values at i, i − 1, i − 2, `gap` the gaps at
/// i − 1 and i − 2.
pub fn edge_value(travel: f64, [h1, h2]: [f64; 2], v: [f64; 3], gap: [f64; 2]) -> f64 {
    let b = (gap[1] / gap[0]).max((1.0 + 1.2 * (h2 - h1) / h1).powf(1.2));
    let slope = ((b - 1.0) * v[0] - b * v[1] + v[2]) / (b * h1 - h2);
    let departure = v[1] - v[0] + slope * h1;
    // Distance of the first open node from the edge, which lies between it and the closed one.
    let ahead = ((h2 - h1) / (b.cbrt().powi(2) - 1.0)).min(h1);
    let inside = (1.0 - (h1 - travel) / ahead).max(0.0);
    let part = inside * inside.sqrt();
    v[0] - slope * travel + departure * part
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: [f64; 8] = [0.0, 1.0, 1.8, 3.0, 4.1, 5.0, 6.0, 7.0];

    #[test]
    fn exact_for_parabolas_and_for_lines() {
        for travel in [0.05, 0.3, 0.77] {
            for (i, f) in feet(&X, travel).iter().enumerate().skip(1) {
                let at = X[i] - travel;
                let f = f.unwrap();
                assert!((value(&X, f, false, |j| 3.0 - 2.0 * X[j]) - (3.0 - 2.0 * at)).abs() < 1e-12);
                if i >= 2 {
                    let got = value(&X, f, true, |j| (X[j] + 9.0).powi(2));
                    assert!((got - (at + 9.0).powi(2)).abs() < 1e-11, "{i} {travel}: {got}");
                }
            }
        }
        assert_eq!(feet(&X, 1.0)[6], Some(Foot::Node(5)));
        assert_eq!(feet(&X, 0.5)[0], None);
        assert_eq!(feet(&X, 0.0)[3], Some(Foot::Node(3)));
    }

    /// As the way becomes short the difference is that of the steady analysis, inside and at the edge.
    #[test]
    fn short_ways_give_the_difference_of_the_steady_analysis() {
        let n = X.len();
        let s = crate::grid::Interface::new(X.to_vec(), vec![0.0, 1.0, 2.0], vec![0.0; 3 * n]).unwrap();
        let w: Vec<f64> = (0..3 * n).map(|i| (1.3 * i as f64).sin()).collect();
        let closed: Vec<bool> = (0..3 * n).map(|i| i % n >= 2).collect();
        // The second gap is that of an edge at the closed node itself: w departs from its course at once, with the power 3/2 of the way.
        for (ahead, travel, bound) in [([0.9, 0.1], 1e-7, 1e-5), ([0.12, 0.1], 1e-8, 1e-3)] {
            let feet = feet(&X, travel);
            let gap: Vec<f64> = (0..3 * n).map(|i| ahead.get(i % n).copied().unwrap_or(0.0)).collect();
            let steady = s.upstream(crate::contact::Stencil::Edge, Some((&gap, &closed)));
            for i in 2..n {
                let v = |j: usize| w[j];
                let foot = match i {
                    2 => edge_value(travel, [X[2] - X[1], X[2] - X[0]], [v(2), v(1), v(0)], [gap[1], gap[0]]),
                    _ => value(&X, feet[i].unwrap(), i > 3, v),
                };
                let (got, want) = ((v(i) - foot) / travel, steady.at(i, v));
                assert!((got - want).abs() < bound * want.abs().max(1.0), "node {i}, {ahead:?}: {got}, steady {want}");
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
                .skip(2)
                .map(|(i, f)| {
                    (value(&x, f.unwrap(), true, |j| (2.0 * x[j]).exp()) - (2.0 * (x[i] - 0.3 / n as f64)).exp()).abs()
                })
                .fold(0.0, f64::max)
        };
        let (a, b) = (error(20), error(40));
        assert!(a / b > 7.0, "errors {a:e} {b:e}");
    }
}
