//! Clusters of equal frequencies. A body of revolution has its modes in pairs; a basis that keeps one of a pair and
//! drops the other is not the body's, so a cut never goes through a cluster.

/// Neighbouring frequencies closer than this, relatively, belong to one cluster. A mesh that is refined at the contact
/// splits the pairs of a body of revolution by a few 1e-4 of their frequency.
pub const CLUSTER_GAP: f64 = 2e-3;

/// Length of the shortest complete list that holds at least `count` of the ascending `values`, or `None` when the last
/// cluster may go on beyond the list, so more values are needed to tell. `values` are frequencies (Hz) or
/// eigenvalues' roots.
pub fn cut(values: &[f64], count: usize) -> Option<usize> {
    let mut end = count;
    while end < values.len() {
        if end == 0 || values[end] - values[end - 1] > CLUSTER_GAP * values[end] {
            return Some(end);
        }
        end += 1;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::cut;

    #[test]
    fn a_pair_stays_together() {
        let f = [0.0, 0.0, 100.0, 100.01, 200.0, 300.0, 300.0];
        assert_eq!(cut(&f, 2), Some(2));
        assert_eq!(cut(&f, 1), Some(2));
        assert_eq!(cut(&f, 3), Some(4));
        assert_eq!(cut(&f, 4), Some(4));
        assert_eq!(cut(&f, 6), None, "the last cluster touches the end of the list");
        assert_eq!(cut(&f, 7), None);
        assert_eq!(cut(&f, 0), Some(0));
    }
}
