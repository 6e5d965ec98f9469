//! Modes of a body of revolution at points of its surface.

use crate::swept::{Forms, PictureModes, SectionSource};
use crate::Result;
use faer::Mat;

/// The modes `shapes` of a body at `points`, (x, y, z) with the axle along y, m; 1/√kg, `[3p, m]`. At the distance r
/// from the axle and the angle θ about it, x = r sin θ and z = r cos θ, a mode of n nodal diameters moves by
/// (U cos nθ, V sin nθ, W cos nθ) or (U sin nθ, −V cos nθ, W sin nθ): outwards, along the circle and along y.
///
/// # Errors
/// A point beside the section.
pub(super) fn modes_at(
    forms: &Forms,
    (making, name): (&SectionSource, &str),
    shapes: &PictureModes,
    points: &[[f64; 3]],
) -> Result<Mat<f64>> {
    let mut all = Mat::zeros(3 * points.len(), shapes.list.len());
    for (i, &[x, y, z]) in points.iter().enumerate() {
        let angle = x.atan2(z);
        let (near, axial) = making
            .measured_at(&forms.section, [x.hypot(z), y])
            .map_err(|e| e.context(format!("bodies.{name}.modes.measured: the point {i} of a shape")))?;
        let held = near.shares.iter().filter_map(|&(node, share)| Some((forms.amplitude(node)?, share)));
        let held: Vec<(usize, f64)> = held.collect();
        let (sin, cos) = angle.sin_cos();
        for (k, &(of, index, family)) in shapes.list.iter().enumerate() {
            let (order, vectors) = &shapes.orders[of];
            let [u, v, w] =
                [0, 1, 2].map(|c| held.iter().map(|&(at, share)| share * vectors[(at + c, index)]).sum::<f64>());
            let (sin_n, cos_n) = (*order as f64 * angle).sin_cos();
            let [along, across] = match (order, family) {
                (0, _) => [1.0, 1.0],
                (_, 0) => [cos_n, sin_n],
                _ => [sin_n, -cos_n],
            };
            let (out, round) = (along * u, across * v);
            let motion = [out * sin + round * cos, axial * along * w, out * cos - round * sin];
            (0..3).for_each(|c| all[(3 * i + c, k)] = motion[c]);
        }
    }
    Ok(all)
}
