//! Contacts that reach the border of the patch are refused, with the size that the patch must have.

use super::influence::Influence;
use super::loads::{Loads, NormalLoad};
use super::normal::{contact_modulus, lowest};
use crate::grid::{ContactPatch, Interface};
use crate::{Error, Result};

/// A contact that would need a patch this many times as large has flat surfaces.
const FLAT: f64 = 100.0;

/// Refuses a contact that reaches the border of the patch, saying how large the patch must be.
pub(super) fn refuse_border(w: Influence<'_>, s: &Interface, loads: &Loads, closed: &[usize]) -> Result<()> {
    let Some(&first) = closed.iter().find(|&&i| s.on_border(i)) else { return Ok(()) };
    let half = |x: &[f64]| 0.5 * (x[x.len() - 1] - x[0]);
    let (patch, ix, iy) = s.place(first);
    let number = s.patch_of(first);
    let [a, b] = needed_half_sizes(w, s, patch, loads.of_patch(number));
    let named = if s.only().is_some() { String::new() } else { format!(" of contact {}", number + 1) };
    let [x, y] = s.point(first);
    let flat = |needed: f64, half: f64| !needed.is_finite() || needed > FLAT * half;
    let flat = [("x", flat(a, half(&patch.x))), ("y", flat(b, half(&patch.y)))];
    if let Some((axis, _)) = flat.iter().find(|(_, is)| *is) {
        return Err(Error::Job(format!(
            "contact.patch{named}: the contact reaches the border of the patch at x = {x:.4e} m, y = {y:.4e} m, and \
             the surfaces are flat on \
             each other along {axis}: their contact ends at an edge of the bodies, not within a patch. Give one \
             of them a curvature there \
             (for cylinders crown_radius)"
        )));
    }
    Err(Error::Job(format!(
        "contact.patch{named}: the contact reaches the border of the patch at x = {:.4e} m, y = {:.4e} m. The patch \
         has \
         half_length {:.4e} m and half_width {:.4e} m; this load needs about half_length {:.4e} m and \
         half_width {:.4e} m: \
         enlarge contact.patch.half_length and contact.patch.half_width to these, or the groups \"contact\" of \
         mesh files",
        x,
        y,
        half(&patch.x),
        half(&patch.y),
        a.max(half(&patch.x) * if ix.is_multiple_of(patch.x.len() - 1) { 1.1 } else { 0.0 }),
        b.max(half(&patch.y) * if iy.is_multiple_of(patch.y.len() - 1) { 1.1 } else { 0.0 }),
    )))
}

/// Half sizes (m) of a patch that holds the contact with a margin of a fifth: Hertz on the curvatures fitted to the gap
/// and the modulus of the compliance, with the axes of the ellipse in the approximation a/b = (κy/κx)^(2/3).
fn needed_half_sizes(w: Influence<'_>, s: &Interface, patch: &ContactPatch, load: NormalLoad) -> [f64; 2] {
    let low = lowest(s, patch);
    let (ix, iy) = patch.indices(low);
    let (x0, y0) = (s.point(low)[0], s.point(low)[1]);
    // Least squares of gap = (κx X² + κy Y²)/2 along the two grid lines through the lowest node.
    let fit = |pairs: &mut dyn Iterator<Item = (f64, f64)>| {
        let (mut num, mut den) = (0.0, 0.0);
        for (d, g) in pairs {
            num += 0.5 * d * d * (g - s.gap[low]);
            den += 0.25 * d.powi(4);
        }
        (num / den).max(f64::MIN_POSITIVE)
    };
    let kx = fit(&mut patch.x.iter().enumerate().map(|(i, x)| (x - x0, s.gap[patch.node(i, iy)])));
    let ky = fit(&mut patch.y.iter().enumerate().map(|(j, y)| (y - y0, s.gap[patch.node(ix, j)])));
    let modulus = contact_modulus(w, s, patch);
    let mean = (kx * ky).sqrt();
    // Circle of the geometric mean curvature: a³ = 3N/(4E* κ), or a² = δ/κ; the mean radius of the ellipse is near it.
    let c = match load {
        NormalLoad::Force(f) => (0.75 * f / (modulus * mean)).cbrt(),
        NormalLoad::Approach(d) => ((d - s.gap[low]).max(0.0) / mean).sqrt(),
    };
    let ratio = (ky / kx).powf(1.0 / 3.0);
    [1.2 * (c * ratio) + x0.abs(), 1.2 * (c / ratio) + y0.abs()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::half_space::HalfSpace;

    #[test]
    fn the_message_says_how_large_or_that_the_surfaces_are_flat() {
        let steel = HalfSpace { young: 205e9, poisson: 0.3 };
        let message = |curvature: [f64; 2]| {
            let s = Interface::paraboloid(7, 7, [1e-3, 1e-3], curvature).unwrap();
            let w = steel.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
            refuse_border(w.as_ref().into(), &s, &NormalLoad::Force(1e4).into(), &[0]).unwrap_err().to_string()
        };
        let curved = message([4.0, 4.0]);
        assert!(curved.contains("this load needs about half_length") && !curved.contains("inf"), "{curved}");
        let flat = message([4.0, 0.0]);
        assert!(flat.contains("flat on each other along y") && !flat.contains("inf"), "{flat}");
    }
}
