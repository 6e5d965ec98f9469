//! Departure points of the semi-Lagrangian transport: x − Vh on the lines of the grid. Its displacement there lies on
//! the [`UpwindReconstruction`] upstream, as in the steady and the linear analyses: for short steps the difference
//! along the particle is theirs ([`crate::contact::Stencil::Edge`]), node by node, and what the three find is the same
//! but for the first order in Vh.
//!
//! [`UpwindReconstruction`]: crate::contact::upwind_reconstruction::UpwindReconstruction

/// Position of the departure point of a node on its line of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DeparturePoint {
    /// On the node with this index along x.
    Node(usize),
    /// Between the nodes `left` and `left + 1`.
    Between {
        /// Index of the node before.
        left: usize,
        /// Distance from the node after, m.
        travel: f64,
    },
}

/// The feet of the nodes along a line of the grid at `x` (m, ascending), at the distance `travel` ≥ 0 upstream; None
/// where a foot lies before the first node.
pub fn feet(x: &[f64], travel: f64) -> Vec<Option<DeparturePoint>> {
    let close = 1e-9 * x.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    let find = |&at: &f64| {
        let foot = at - travel;
        let after = x.partition_point(|&v| v <= foot + close);
        let left = after.checked_sub(1)?;
        if (foot - x[left]).abs() <= close {
            return Some(DeparturePoint::Node(left));
        }
        Some(DeparturePoint::Between { left, travel: x[left + 1] - foot })
    };
    x.iter().map(find).collect()
}

/// Range of the nodes along x that the value at `foot` is taken from, of `nx`.
pub fn support(foot: DeparturePoint, nx: usize) -> std::ops::RangeInclusive<usize> {
    match foot {
        DeparturePoint::Node(i) => i..=i,
        // The nodes of the interval, and the one before it.
        DeparturePoint::Between { left, .. } => left.saturating_sub(1)..=(left + 1).min(nx - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::upwind_reconstruction::UpwindReconstruction;

    const X: [f64; 8] = [0.0, 1.0, 1.8, 3.0, 4.1, 5.0, 6.0, 7.0];

    #[test]
    fn feet_lie_where_the_particles_were() {
        assert_eq!(feet(&X, 1.0)[6], Some(DeparturePoint::Node(5)));
        assert_eq!(feet(&X, 0.5)[0], None);
        assert_eq!(feet(&X, 0.0)[3], Some(DeparturePoint::Node(3)));
        for travel in [0.05, 0.3, 0.77, 1.4] {
            for (i, f) in feet(&X, travel).iter().enumerate().skip(2) {
                let Some(DeparturePoint::Between { left, travel: way }) = *f else { panic!("{i}, {travel}: {f:?}") };
                assert!(
                    (X[left + 1] - way - (X[i] - travel)).abs() < 1e-12 && way > 0.0 && way < X[left + 1] - X[left]
                );
                assert_eq!(support(f.unwrap(), X.len()), left.saturating_sub(1)..=left + 1);
            }
        }
    }

    /// As the way becomes short the difference is that of the steady analysis, inside and at the edge.
    #[test]
    fn short_ways_give_the_difference_of_the_steady_analysis() {
        let n = X.len();
        let s = crate::grid::Interface::new(X.to_vec(), vec![0.0, 1.0, 2.0], vec![0.0; 3 * n]).unwrap();
        let w: Vec<f64> = (0..3 * n).map(|i| (1.3 * i as f64).sin()).collect();
        let closed: Vec<bool> = (0..3 * n).map(|i| i % n >= 2).collect();
        // The second gap is that of an edge at the closed node: w departs from its course at once, with the power 3/2
        // of the way.
        for (ahead, travel, bound) in [([0.9, 0.1], 1e-7, 1e-5), ([0.12, 0.1], 1e-8, 1e-3)] {
            let feet = feet(&X, travel);
            let gap: Vec<f64> = (0..3 * n).map(|i| ahead.get(i % n).copied().unwrap_or(0.0)).collect();
            let steady = s.upstream(crate::contact::Stencil::Edge, Some((&gap, &closed)));
            for i in 2..n {
                let Some(DeparturePoint::Between { left, travel: way }) = feet[i] else { panic!("{i}: {:?}", feet[i]) };
                assert_eq!(left + 1, i);
                let (h, near) = ([X[i] - X[i - 1], X[i] - X[i - 2]], [i, i - 1, i - 2]);
                let course = UpwindReconstruction::new(h, near.map(|j| closed[j]), || [gap[i - 1], gap[i - 2]]);
                let foot: f64 = course.value(way, h).iter().zip(near).map(|(c, j)| c * w[j]).sum();
                let (got, want) = ((w[i] - foot) / travel, steady.derivative(i, |j| w[j]));
                assert!((got - want).abs() < bound * want.abs().max(1.0), "node {i}, {ahead:?}: {got}, steady {want}");
            }
        }
    }
}
