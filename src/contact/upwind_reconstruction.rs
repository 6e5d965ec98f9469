//! How the displacement w runs upstream of a node: what ∂x of the steady and linear analyses and the foot of a
//! particle in time both take it from.
//!
//! From the node i on, w departs from its tangent, by e_{i−1} at the upstream neighbour and by e_{i−2} = b e_{i−1} at
//! the next one. Inside the contact the departure is that of a parabola (R. M. Beam and R. F. Warming, J. Comput.
//! Phys. 22 (1976)). At the leading edge x_e w is not smooth: ahead of it both the gap and the departure of w from
//! its course inside grow like (x_e − x)^{3/2}, and the gaps at the two open nodes say where x_e lies. A straight
//! line is diffusive where a particle travels much less than the distance of the nodes. A cubic limited to be
//! monotone is not better: where w has an extremum inside the contact its slope there becomes zero, however short the
//! step, and the stress in the stick area drifts away from the steady one, in another way for every step.

/// The course of w from a node to its two upstream neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum UpwindReconstruction {
    /// A straight line to the first neighbour.
    Line,
    /// A parabola through all three.
    Parabola,
    /// The node is the first closed one of its line: a straight line up to the edge, and what grows from there with
    /// the gap.
    Edge {
        /// b, the ratio of the departures.
        ratio: f64,
    },
}

impl UpwindReconstruction {
    /// The course at the leading edge for the `gap` at the two open nodes at the distances `h`; none where they tell
    /// nothing.
    pub fn edge(h: [f64; 2], gap: [f64; 2]) -> Option<Self> {
        // Less than this no edge between the nodes would give; a corner of the surface might.
        let least = (1.0 + 1.2 * (h[1] - h[0]) / h[0]).powf(1.2);
        (gap[0] > 0.0).then(|| UpwindReconstruction::Edge { ratio: (gap[1] / gap[0]).max(least) })
    }

    /// The course in a contact: `closed` says which of the three nodes are, `gap` is that of the upstream ones.
    pub fn new(h: [f64; 2], closed: [bool; 3], gap: impl FnOnce() -> [f64; 2]) -> Self {
        match closed {
            [true, true, true] => UpwindReconstruction::Parabola,
            [true, false, false] => Self::edge(h, gap()).unwrap_or(UpwindReconstruction::Line),
            _ => UpwindReconstruction::Line,
        }
    }

    /// ∂w/∂x at the node: coefficients of w at the three nodes, those upstream at the distances `h`.
    pub fn derivative(self, h: [f64; 2]) -> [f64; 3] {
        let ratio = match self {
            UpwindReconstruction::Line => return [1.0 / h[0], -1.0 / h[0], 0.0],
            UpwindReconstruction::Parabola => (h[1] / h[0]).powi(2),
            UpwindReconstruction::Edge { ratio } => ratio,
        };
        let scale = 1.0 / (ratio * h[0] - h[1]);
        [(ratio - 1.0) * scale, -ratio * scale, scale]
    }

    /// Change of the course at the leading edge with the gaps at the two open nodes: the derivatives by these of
    /// ∂w/∂x at the node, as coefficients of w at the three nodes. None where the course does not follow the gaps.
    pub fn derivative_by_gap(self, h: [f64; 2], gap: [f64; 2]) -> Option<[[f64; 3]; 2]> {
        let (ratio, by_gap) = self.ratio_by_gap(gap)?;
        let by_ratio = derivative_by_ratio(ratio, h);
        Some(by_gap.map(|r| by_ratio.map(|d| r * d)))
    }

    /// ∂ratio/∂gap at the two open nodes; none where the course does not follow the gaps.
    fn ratio_by_gap(self, gap: [f64; 2]) -> Option<(f64, [f64; 2])> {
        let UpwindReconstruction::Edge { ratio } = self else { return None };
        // At the least ratio the gaps say nothing.
        let follows = ratio * gap[0] <= gap[1] * (1.0 + 1e-12);
        follows.then_some((ratio, [-ratio / gap[0], 1.0 / gap[0]]))
    }

    /// Change of [`Self::value`] with the gaps at the two open nodes, as coefficients of w at the three nodes. None
    /// where the course does not follow the gaps.
    pub fn value_by_gap(self, travel: f64, h: [f64; 2], gap: [f64; 2]) -> Option<[[f64; 3]; 2]> {
        let (ratio, by_gap) = self.ratio_by_gap(gap)?;
        let (root, way) = (ratio.cbrt(), h[0] - travel);
        let ahead = (h[1] - h[0]) / (root * root - 1.0);
        // Where the edge lies between the nodes it moves with the ratio: ∂ahead/∂ratio, and ∂part/∂ratio.
        let moved = if ahead < h[0] { -2.0 / 3.0 * ahead / (root * (root * root - 1.0)) } else { 0.0 };
        let ahead = ahead.min(h[0]);
        let inside = (1.0 - way / ahead).max(0.0);
        let part = inside * inside.sqrt();
        let grown = 1.5 * inside.sqrt() * way / (ahead * ahead) * moved;
        let (d, slope, change) = (self.derivative(h), part * h[0] - travel, derivative_by_ratio(ratio, h));
        let both = |k: usize| grown * h[0] * d[k] + slope * change[k];
        let by_ratio = [both(0) - grown, both(1) + grown, both(2)];
        Some(by_gap.map(|r| by_ratio.map(|v| r * v)))
    }

    /// w at the distance `travel` upstream, no further than the first neighbour: coefficients of w at the three nodes.
    pub fn value(self, travel: f64, h: [f64; 2]) -> [f64; 3] {
        let way = travel / h[0];
        // The share of the departure e_{i−1} that there is at the distance.
        let part = match self {
            UpwindReconstruction::Line => return [1.0 - way, way, 0.0],
            UpwindReconstruction::Parabola => way * way,
            UpwindReconstruction::Edge { ratio } => {
                // Distance of the first open node from the edge, which lies between it and the closed one.
                let ahead = ((h[1] - h[0]) / (ratio.cbrt().powi(2) - 1.0)).min(h[0]);
                let inside = (1.0 - (h[0] - travel) / ahead).max(0.0);
                inside * inside.sqrt()
            }
        };
        // w = w_i − travel ∂w/∂x + part e_{i−1}, e_{i−1} = w_{i−1} − w_i + h ∂w/∂x.
        let slope = part * h[0] - travel;
        let d = self.derivative(h);
        [1.0 - part + slope * d[0], part + slope * d[1], slope * d[2]]
    }
}

/// Change of [`UpwindReconstruction::derivative`] at an edge with its ratio.
fn derivative_by_ratio(ratio: f64, h: [f64; 2]) -> [f64; 3] {
    let scale = 1.0 / (ratio * h[0] - h[1]);
    let change = -h[0] * scale * scale;
    [scale + (ratio - 1.0) * change, -scale - ratio * change, change]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apply(c: [f64; 3], w: impl Fn(f64) -> f64, h: [f64; 2]) -> f64 {
        c[0] * w(0.0) + c[1] * w(-h[0]) + c[2] * w(-h[1])
    }

    #[test]
    fn exact_for_lines_parabolas_and_what_grows_with_the_gap() {
        let (h, edge) = ([1.0, 2.2], -0.4);
        let ahead = |x: f64| f64::max(edge - x, 0.0).powf(1.5);
        let at_edge = UpwindReconstruction::new(h, [true, false, false], || [7.0 * ahead(-1.0), 7.0 * ahead(-2.2)]);
        let line = |x: f64| 1.0 - 2.0 * x;
        let (bent, grown) = (|x: f64| (x + 9.0).powi(2), |x: f64| line(x) - 0.3 * ahead(x));
        for travel in [0.0, 0.1, 0.3, 0.45, 0.8, 1.0] {
            for (course, w) in [
                (UpwindReconstruction::Line, &line as &dyn Fn(f64) -> f64),
                (UpwindReconstruction::Parabola, &line),
                (UpwindReconstruction::Parabola, &bent),
                (at_edge, &line),
                (at_edge, &grown),
            ] {
                let (got, want) = (apply(course.value(travel, h), w, h), w(-travel));
                assert!((got - want).abs() < 1e-12, "{course:?} at {travel}: {got}, expected {want}");
            }
        }
        for (course, w, want) in [
            (UpwindReconstruction::Line, &line as &dyn Fn(f64) -> f64, -2.0),
            (UpwindReconstruction::Parabola, &bent, 18.0),
            (at_edge, &grown, -2.0),
        ] {
            let got = apply(course.derivative(h), w, h);
            assert!((got - want).abs() < 1e-12, "{course:?}: {got}, expected {want}");
        }
    }

    /// An edge between the open nodes, and one at the first of them.
    #[test]
    fn the_value_changes_with_the_gaps_as_differences_do() {
        let (h, by) = ([0.7, 1.8], 1e-6);
        for (gap, travel) in [([1.0, 9.0], 0.3), ([1.0, 9.0], 0.05), ([1.0, 5.0], 0.6)] {
            let course = |gap| UpwindReconstruction::edge(h, gap).unwrap();
            let found = course(gap).value_by_gap(travel, h, gap).unwrap();
            for k in 0..2 {
                let at = |by: f64| {
                    let mut there = gap;
                    there[k] += by;
                    course(there).value(travel, h)
                };
                let (more, less) = (at(by), at(-by));
                for c in 0..3 {
                    let want = (more[c] - less[c]) / (2.0 * by);
                    assert!((found[k][c] - want).abs() < 1e-8, "{gap:?}, {travel}: {found:?}, {k} {c} {want}");
                }
            }
        }
        assert_eq!(UpwindReconstruction::Parabola.value_by_gap(0.1, h, [1.0, 4.0]), None);
        assert_eq!(UpwindReconstruction::edge(h, [1.0, 1.0]).unwrap().value_by_gap(0.1, h, [1.0, 1.0]), None);
    }

    #[test]
    fn the_course_follows_from_what_is_closed() {
        let of = |closed, gap| UpwindReconstruction::new([1.0, 2.0], closed, || gap);
        assert_eq!(of([true; 3], [0.0; 2]), UpwindReconstruction::Parabola);
        assert_eq!(of([true, true, false], [0.0, 1.0]), UpwindReconstruction::Line);
        assert_eq!(of([false; 3], [1.0, 2.0]), UpwindReconstruction::Line);
        assert_eq!(of([true, false, false], [1.0, 4.0]), UpwindReconstruction::Edge { ratio: 4.0 });
        assert_eq!(of([true, false, false], [1.0, 1.0]), UpwindReconstruction::Edge { ratio: 2.2f64.powf(1.2) });
        assert_eq!(of([true, false, false], [0.0, 1.0]), UpwindReconstruction::Line);
    }

    /// For a short way the difference along it is the derivative.
    #[test]
    fn the_value_starts_with_the_derivative() {
        let h = [0.7, 1.8];
        for course in
            [UpwindReconstruction::Line, UpwindReconstruction::Parabola, UpwindReconstruction::Edge { ratio: 9.0 }]
        {
            let t = 1e-7;
            let (value, slope) = (course.value(t, h), course.derivative(h));
            for (k, (v, d)) in value.iter().zip(slope).enumerate() {
                let first = if k == 0 { 1.0 } else { 0.0 };
                assert!(((first - v) / t - d).abs() < 1e-6, "{course:?}: {value:?}, {slope:?}");
            }
        }
    }

    #[test]
    fn the_course_at_the_edge_follows_the_gaps() {
        let (h, gap, w) = ([0.7, 1.8], [0.3, 2.9], [1.3, -0.4, 0.8]);
        let slope = |gap| {
            let d = UpwindReconstruction::edge(h, gap).unwrap().derivative(h);
            (0..3).map(|k| d[k] * w[k]).sum::<f64>()
        };
        let by_gap = UpwindReconstruction::edge(h, gap).unwrap().derivative_by_gap(h, gap).unwrap();
        for c in 0..2 {
            let moved = |d: f64| slope([gap[0] + if c == 0 { d } else { 0.0 }, gap[1] + if c == 1 { d } else { 0.0 }]);
            let want = (moved(1e-6) - moved(-1e-6)) / 2e-6;
            let got: f64 = (0..3).map(|k| by_gap[c][k] * w[k]).sum();
            assert!((got - want).abs() < 1e-6 * want.abs(), "gap {c}: {got} against {want}");
        }
        // The least ratio stays.
        assert_eq!(UpwindReconstruction::edge(h, [1.0, 1.1]).unwrap().derivative_by_gap(h, [1.0, 1.1]), None);
        assert_eq!(UpwindReconstruction::Parabola.derivative_by_gap(h, gap), None);
    }

    #[test]
    fn third_order_where_smooth() {
        let error = |h: f64| {
            let w = |x: f64| (2.0 * x).exp();
            (apply(UpwindReconstruction::Parabola.value(0.3 * h, [h, 2.0 * h]), w, [h, 2.0 * h]) - w(-0.3 * h)).abs()
        };
        let (a, b) = (error(0.05), error(0.025));
        assert!(a / b > 7.0, "errors {a:e} {b:e}");
    }
}
