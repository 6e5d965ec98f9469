//! Stress recovery: the stresses of the cells at a node averaged over them.

use super::element::element;
use super::ElasticMaterial;
use crate::mesh::distribute::MeshPart;
use crate::mesh::quality;

/// Von Mises stress, Pa, of the owned nodes, `[owned]`. `u` is the displacement of all local nodes, m,
/// `[node_ids.len()][3]`. A rank holds every cell of its nodes, so the average is complete without communication.
pub fn von_mises(part: &MeshPart, u: &[[f64; 3]], material: &ElasticMaterial) -> Vec<f64> {
    let mut sum = vec![[0.0; 6]; part.owned];
    let mut weight = vec![0.0; part.owned];
    let mut stress = Vec::new();
    for cell in part.cells.iter() {
        let x = cell.places(&part.coords);
        let ue: Vec<f64> = cell.nodes.iter().flat_map(|&n| u[n as usize]).collect();
        stress.resize(cell.nodes.len(), [0.0; 6]);
        element(cell.kind).nodal_stress(&x, &ue, material, &mut stress);
        let volume = quality::volume(cell.kind, &x);
        for (&n, s) in cell.nodes.iter().zip(&stress) {
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
