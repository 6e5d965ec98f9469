//! Stress recovery: Gauss-point stresses extrapolated to the corners and averaged over the cells of each node.

use super::{hex8, Material};
use crate::mesh::distribute::MeshPart;
use crate::mesh::quality;

/// Von Mises stress, Pa, of the owned nodes, `[owned]`. `u` is the displacement of all local nodes, m, `[node_ids.len()][3]`.
/// A rank holds every cell of its nodes, so the average is complete without communication.
pub fn von_mises(part: &MeshPart, u: &[[f64; 3]], material: &Material) -> Vec<f64> {
    let mut sum = vec![[0.0; 6]; part.owned];
    let mut weight = vec![0.0; part.owned];
    for cell in &part.cells {
        let x = cell.map(|n| part.coords[n as usize]);
        let mut ue = [0.0; hex8::DOFS];
        for (a, &n) in cell.iter().enumerate() {
            ue[3 * a..3 * a + 3].copy_from_slice(&u[n as usize]);
        }
        let stress = hex8::corner_stress(&x, &ue, material);
        let volume = quality::volume(&x);
        for (&n, s) in cell.iter().zip(&stress) {
            if (n as usize) < part.owned {
                weight[n as usize] += volume;
                for (acc, v) in sum[n as usize].iter_mut().zip(s) {
                    *acc += volume * v;
                }
            }
        }
    }
    sum.iter()
        .zip(&weight)
        .map(|(s, &w)| {
            let [xx, yy, zz, xy, yz, zx] = s.map(|v| if w > 0.0 { v / w } else { 0.0 });
            (0.5 * ((xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2)) + 3. * (xy * xy + yz * yz + zx * zx))
                .sqrt()
        })
        .collect()
}
