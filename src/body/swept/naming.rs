//! Names of the modes of a body of revolution.

use super::Member;
use crate::body::ModeLabel;
use crate::swept::ContactModeData;
use std::collections::BTreeMap;

/// Component with the largest motion: names of U, V and W.
const KINDS: [&str; 3] = ["radial", "circumferential", "axial"];

/// Kind of the mode `k` of an order: its component with the largest motion; of a wheelset symmetric or antisymmetric
/// about its middle as well, where modes of order 1 bend the axle and the circumferential ones of order 0 twist it.
fn kind(seen: &ContactModeData, k: usize) -> String {
    let shares = &seen.shares[k];
    let largest = (0..3).max_by(|&a, &b| shares[a].total_cmp(&shares[b])).unwrap_or(0);
    let parity = match seen.parity[k] {
        p if p > 0.5 => "symmetric ",
        p if p < -0.5 => "antisymmetric ",
        _ => return KINDS[largest].into(),
    };
    let own = match (seen.order, largest) {
        (0, 1) => "torsion",
        (1, _) => "bending",
        _ => KINDS[largest],
    };
    format!("{parity}{own}")
}

/// Names of the modes of all orders: what moves most, numbered from 0 within an order, by frequency.
pub(super) fn names(all: &[ContactModeData], list: &[Member]) -> Vec<ModeLabel> {
    let of = |seen: &ContactModeData| -> Vec<ModeLabel> {
        let kinds: Vec<String> = (0..seen.omega.len()).map(|k| kind(seen, k)).collect();
        let number = |k: usize| kinds[..k].iter().filter(|own| **own == kinds[k]).count();
        let label = |k: usize| ModeLabel { order: seen.order as u32, family: format!("{} {}", kinds[k], number(k)) };
        (0..seen.omega.len()).map(label).collect()
    };
    let named: BTreeMap<usize, Vec<ModeLabel>> = all.iter().map(|seen| (seen.order, of(seen))).collect();
    list.iter().map(|m| named[&m.of.order][m.index].clone()).collect()
}
