//! Modes of both families of all orders, in the order of their frequencies.

use crate::body::rotation::ModalRotation;
use crate::swept::{family_shares, ContactModeData, OrderModes, LOADS};
use faer::Mat;
use std::collections::BTreeSet;

/// A mode of one family among those of its order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Member<'s> {
    pub(super) of: &'s ContactModeData,
    pub(super) index: usize,
    /// 0: (U cos nθ, V sin nθ, W cos nθ); 1: (U sin nθ, −V cos nθ, W sin nθ).
    pub(super) family: usize,
}

impl Member<'_> {
    pub(super) fn omega(&self) -> f64 {
        self.of.omega[self.index]
    }

    /// ψ̂, 1/√kg and 1/(√kg m): the mode at the contact number `contact`, which lies at the angle `along`, rad, as far
    /// as its family has it.
    pub(super) fn contact_motion(&self, contact: usize, along: f64) -> [f64; LOADS] {
        let shares = family_shares(self.of.order, self.of.order as f64 * along, self.family);
        std::array::from_fn(|k| shares[k] * self.of.contact[(LOADS * contact + k, self.index)])
    }
}

/// Modes of all orders and families, ascending.
pub(super) fn members(all: &[ContactModeData]) -> Vec<Member<'_>> {
    let mut list: Vec<Member> = Vec::new();
    for of in all {
        for index in 0..of.omega.len() {
            list.extend((0..ContactModeData::families(of.order)).map(|family| Member { of, index, family }));
        }
    }
    // The families of a pair stay beside each other.
    list.sort_by(|a, b| a.omega().total_cmp(&b.omega()));
    list
}

/// The modes of `list` on the outline, by orders.
pub(super) fn on_outline(list: &[Member]) -> Vec<OrderModes> {
    let orders: BTreeSet<usize> = list.iter().map(|m| m.of.order).collect();
    let of = |order: usize| {
        let mine = |family| list.iter().enumerate().filter(move |(_, m)| m.of.order == order && m.family == family);
        // A cut never goes through a pair: either family has the same modes.
        let kept: Vec<&Member> = mine(0).map(|(_, mode)| mode).collect();
        let rows = kept.first().map_or(0, |mode| mode.of.outline.nrows());
        OrderModes {
            order,
            motion: Mat::from_fn(rows, kept.len(), |i, j| kept[j].of.outline[(i, kept[j].index)]),
            places: (0..ContactModeData::families(order)).map(|f| mine(f).map(|(place, _)| place).collect()).collect(),
        }
    };
    orders.into_iter().map(of).collect()
}

/// ΦᵀGΦ, Φᵀ(K_σ − K_c)Φ and ΦᵀMD′Φ of the modes, at 1 rad/s.
pub(super) fn rotation(list: &[Member]) -> ModalRotation {
    let between = |value: &dyn Fn(&Member, &Member) -> f64| {
        Mat::from_fn(list.len(), list.len(), |i, j| match list[i].of.order == list[j].of.order {
            true => value(&list[i], &list[j]),
            false => 0.0,
        })
    };
    // ΦsᵀMDΦc = −g and ΦcᵀMDΦs = g; of order 0 it is the coupling itself.
    let sign = |a: &Member, b: &Member| match (a.of.order, a.family, b.family) {
        (0, ..) | (_, 0, 1) => 1.0,
        (_, 1, 0) => -1.0,
        _ => 0.0,
    };
    let same = |a: &Member, b: &Member| f64::from(u8::from(a.index == b.index));
    // A body that turns freely about its axle has no stiffness against it at any speed, but for rounding.
    let free = |m: &Member| m.of.order == 0 && m.omega() == 0.0;
    ModalRotation {
        gyroscopic: between(&|a, b| 2.0 * sign(a, b) * a.of.rotation.coupling[(a.index, b.index)]),
        stiffness: between(&|a, b| match a.family == b.family {
            true if !free(a) && !free(b) => a.of.rotation.stiffness[(a.index, b.index)],
            _ => 0.0,
        }),
        derivative: between(&|a, b| sign(a, b) * a.of.order as f64 * same(a, b)),
    }
}
