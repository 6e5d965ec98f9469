//! The contact of a job on half-spaces, as it is foreseen before a run: how many nodes close, and whether the grid is
//! fine enough for them and for the spin.

use super::super::interface::creepage;
use super::PreflightReport;
use crate::body::half_space::HalfSpace;
use crate::contact::half_space_estimate::PatchEstimate;
use crate::contact::{ContactCreepage, SPIN_SPACINGS};
use crate::grid::{ContactPatch, Interface};
use crate::job::{Contact, Job, Load};
use crate::Result;

/// Contacts of fewer closed nodes are coarse: `docs/explanation/limits.md`, "Range", has forces for 5 to 161 of them.
const FEW: f64 = 40.0;
/// At most so many grid lines in each direction are taken: the contact is to be foreseen, not computed.
const LINES: usize = 40;

/// The contact on a grid.
pub(super) fn foreseen((job, at): (&Job, &Contact), s: &Interface) -> Result<PreflightReport> {
    let Load::Normal(load) = at.load() else { return Ok(PreflightReport::default()) };
    let coarse = thinned(s)?;
    // Of the normal compliance, which is all that counts here, both bodies have the sum.
    let mut compliance = 0.0;
    for (_, body) in job.bodies() {
        let m = body.elastic()?;
        compliance += 1.0 / HalfSpace { young: m.young, poisson: m.poisson }.plane();
    }
    let patch = coarse.single("the estimate of the contact")?;
    let w = HalfSpace { young: 1.0 / compliance, poisson: 0.0 }.compliance(&patch.x, &patch.y)?;
    let found = PatchEstimate::new(w.as_ref(), &coarse, load)?;
    let lowest = (0..s.len()).min_by(|&a, &b| s.gap[a].total_cmp(&s.gap[b])).unwrap_or(0);
    let cell = s.weight[lowest];
    let closed = found.area / cell;
    let mut report = PreflightReport::default();
    report.lines.push(format!(
        "contact on half-spaces: about {closed:.0} closed nodes, half lengths {:.2} mm and {:.2} mm, largest \
         pressure {:.0} MPa, local approach {:.1} µm",
        1e3 * found.half()[0],
        1e3 * found.half()[1],
        1e-6 * found.pressure,
        1e6 * found.approach
    ));
    if closed < FEW {
        let size = cell.sqrt() * (closed / FEW).sqrt();
        report.warnings.push(format!(
            "the contact will have about {closed:.0} closed nodes, fewer than {FEW}: friction forces, growth \
             rates and pressures can be wrong by several percent; \
             elements of {size:.1e} m at the contact would do"
        ));
    }
    report.warnings.extend(coarse_for_spin(creepage(at), s, lowest, found.half()));
    Ok(report)
}

/// Remark on a grid that is coarse for the spin of the job, with the spacing along x at the node `lowest`.
fn coarse_for_spin(creepage: ContactCreepage, s: &Interface, lowest: usize, half: [f64; 2]) -> Option<String> {
    let (ContactPatch { x, .. }, ix, _) = s.place(lowest);
    let ix = ix.clamp(1, x.len() - 1);
    let spacing = x[ix] - x[ix - 1];
    // As at 1 mm on the paper's cylinders, and a little beyond what is taken by default.
    let fine = half[0] / SPIN_SPACINGS;
    let (edge, others) = ((half[0] * half[1]).sqrt(), creepage.longitudinal.hypot(creepage.lateral));
    (creepage.is_ruled_by_spin(half) && spacing > 1.1 * fine).then(|| {
        format!(
            "spin rules the rigid slip ({:.2e} at the edge of the contact, {others:.2e} by the other creepages), and \
             the nodes are {:.2} mm apart along x: the lateral force that it makes can be too small by {:.0} %; \
             a spacing \
             of {:.2} mm makes it good to 1 %",
            creepage.spin.abs() * edge,
            1e3 * spacing,
            200.0 * (spacing / half[0]).powi(2),
            1e3 * fine
        )
    })
}

/// The interface on some of its grid lines, the outermost among them.
fn thinned(s: &Interface) -> Result<Interface> {
    let some = |n: usize| -> Vec<usize> {
        let step = (n - 1).div_ceil(LINES - 1).max(1);
        let mut lines: Vec<usize> = (0..n).step_by(step).collect();
        if lines.last() != Some(&(n - 1)) {
            lines.push(n - 1);
        }
        lines
    };
    let patch = s.single("the estimate of the contact")?;
    let (ix, iy) = (some(patch.x.len()), some(patch.y.len()));
    let gap = iy.iter().flat_map(|&j| ix.iter().map(move |&i| s.gap[patch.node(i, j)])).collect();
    Interface::new(ix.iter().map(|&i| patch.x[i]).collect(), iy.iter().map(|&j| patch.y[j]).collect(), gap)
}
