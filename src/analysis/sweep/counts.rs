//! Points of a model at which unstable eigenvalues beside the continued ones are counted: a tenth of them, and those
//! whose number of unstable eigenvalues differs from that of the nearest point of this tenth. Where one of them has
//! more than the continued ones, all points of the model are counted.
//!
//! Which they are follows from the seed and from the results of the points, not from the ranks.

use crate::random::Stream;
use std::cell::{Cell, RefCell};

/// One point of so many is counted.
const EACH: f64 = 0.1;
/// Purpose of the random numbers that choose them.
const PURPOSE: u64 = 0xC047;
/// Points that others are compared with at the most.
const MOST: usize = 2000;

/// A point that was counted, with its number of unstable eigenvalues.
pub(super) type Counted = (usize, usize);

/// Choice of the points that are counted.
pub(super) struct Counts {
    /// True for the points that are chosen, `[points]`.
    chosen: Vec<bool>,
    /// True while all points are counted.
    all: Cell<bool>,
    /// Points of the models at hand that were counted, by the first point of the model.
    known: RefCell<Vec<(usize, Vec<Counted>)>>,
}

impl Counts {
    /// Choice among so many `points`.
    pub fn new(seed: u64, points: usize) -> Self {
        let mut stream = Stream::new(seed, PURPOSE);
        let chosen = (0..points).map(|_| stream.unit() < EACH).collect();
        Self { chosen, all: Cell::new(false), known: RefCell::default() }
    }

    /// True if a point is one of those that are chosen.
    pub fn is_chosen(&self, point: usize) -> bool {
        self.chosen.get(point).copied().unwrap_or(true)
    }

    /// Counts all points, or no longer.
    pub fn set_all(&self, all: bool) {
        self.all.set(all);
    }

    /// Keeps the points of the model of the point `first` that were `counted`.
    pub fn learn(&self, first: usize, mut counted: Vec<Counted>) {
        let step = counted.len().div_ceil(MOST).max(1);
        counted = counted.into_iter().step_by(step).collect();
        self.known.borrow_mut().push((first, counted));
    }

    /// Frees what is known of models that are no longer needed.
    pub fn forget(&self) {
        self.known.borrow_mut().clear();
    }

    /// True if a point of the model of the point `first` is counted, at which so many continued eigenvalues are
    /// `unstable`; `far` is the distance of two points.
    pub fn wants(&self, (first, point): (usize, usize), unstable: usize, far: impl Fn(usize, usize) -> f64) -> bool {
        if self.all.get() || self.is_chosen(point) {
            return true;
        }
        let known = self.known.borrow();
        let of_model = known.iter().find(|k| k.0 == first).map_or(&[][..], |k| &k.1[..]);
        let nearest = of_model.iter().min_by(|a, b| far(a.0, point).total_cmp(&far(b.0, point)));
        nearest.is_none_or(|n| n.1 != unstable)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// About a tenth is chosen, the same by the same seed; other points are counted where their number of unstable
    /// eigenvalues is not that of the nearest one.
    #[test]
    fn points_are_counted_where_their_number_changes() {
        let (a, b) = (Counts::new(1, 4000), Counts::new(1, 4000));
        let chosen: Vec<usize> = (0..4000).filter(|&i| a.is_chosen(i)).collect();
        assert!((300..500).contains(&chosen.len()), "{}", chosen.len());
        assert!((0..4000).all(|i| a.is_chosen(i) == b.is_chosen(i)));
        assert!((0..4000).any(|i| a.is_chosen(i) != Counts::new(2, 4000).is_chosen(i)));
        let far = |i: usize, k: usize| i.abs_diff(k) as f64;
        let [own, other] = [chosen[7], chosen[8]];
        let beside = own + 1;
        assert!(!a.is_chosen(beside) && other > beside + 1);
        assert!(a.wants((0, beside), 2, far), "no neighbour is known");
        a.learn(0, vec![(own, 2), (other, 3)]);
        assert!(!a.wants((0, beside), 2, far) && a.wants((0, beside), 3, far) && a.wants((5, beside), 2, far));
        assert!(a.wants((0, own), 2, far));
        a.set_all(true);
        assert!(a.wants((0, beside), 2, far));
    }
}
