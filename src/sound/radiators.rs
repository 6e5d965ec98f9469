//! Elementary radiators: patches of the smooth parts of a surface, and the radiation resistance of modes on them.

use super::Air;
use faer::Mat;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Place of a patch: the smooth part of the surface it belongs to, and the cube of a lattice it lies in.
pub type Key = [i64; 4];

/// One patch.
#[derive(Debug, Clone, PartialEq)]
pub struct RadiatingPatch {
    /// Area, m².
    pub area: f64,
    /// Area times the position of its centre, m³.
    pub moment: [f64; 3],
    /// Volume flow of each mode through it, ∫ φ_j · n dS, m²/√kg, `[m]`.
    pub flow: Vec<f64>,
}

/// The patches of a body in one frame, and the mean square of its modes' normal displacements.
#[derive(Debug, Clone, PartialEq)]
pub struct Radiators {
    patches: BTreeMap<Key, RadiatingPatch>,
    /// Edge of the lattice's cubes, m.
    size: f64,
    /// ∫ φ_n,i φ_n,j dS, m²/kg, `[m, m]`.
    square: Mat<f64>,
}

impl Radiators {
    /// Patches by their places in a lattice of cubes with edge `size` (m), and ∫ φ_n,i φ_n,j dS (m²/kg).
    pub fn new(patches: BTreeMap<Key, RadiatingPatch>, size: f64, square: Mat<f64>) -> Self {
        Self { patches, size, square }
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.patches.len()
    }

    /// True without patches.
    pub fn is_empty(&self) -> bool {
        self.patches.is_empty()
    }

    /// Area, m².
    pub fn area(&self) -> f64 {
        self.patches.values().map(|p| p.area).sum()
    }

    /// Edge of the lattice's cubes, m.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// ∫ φ_n,i φ_n,j dS, m²/kg, `[m, m]`: with the velocities' cross-spectra, ρc times it is the power of a surface
    /// that radiates as a plane wave does.
    pub fn square(&self) -> &Mat<f64> {
        &self.square
    }

    /// The same with the patches of 2 × 2 × 2 cubes taken together.
    pub fn coarser(&self) -> Self {
        let mut patches: BTreeMap<Key, RadiatingPatch> = BTreeMap::new();
        for (key, patch) in &self.patches {
            let [part, i, j, k] = *key;
            add(&mut patches, [part, i.div_euclid(2), j.div_euclid(2), k.div_euclid(2)], patch.clone());
        }
        Self { patches, size: 2.0 * self.size, square: self.square.clone() }
    }

    /// Radiation resistance of the modes at the frequency `f` (Hz), N·s/m per kg, `[m, m]`, symmetric: the mean power
    /// is ½ q̇ᴴ R q̇ of complex amplitudes q̇, tr(R S) of spectra of mean squares.
    ///
    /// Every smooth part of the surface radiates as if set into a rigid baffle of its own. By Rayleigh's integral a
    /// patch with the flow Q_b makes the pressure p = iωρ Q_b e^{−ikr}/(2πr) at the distance r, whose part in phase
    /// with the flow gives R = Qᵀ K Q, K_ab = ρc k²/(2π) · sin(k r_ab)/(k r_ab) (K. A. Cunefare, J. Acoust. Soc. Am.
    /// 90 (1991); S. J. Elliott, M. E. Johnson, J. Acoust. Soc. Am. 94 (1993) 2194–2204, eq. 14).
    pub fn resistance(&self, f: f64, air: Air) -> Mat<f64> {
        let m = self.square.nrows();
        let k = air.wave_number(f);
        let mut half = Mat::<f64>::zeros(m, m);
        let all: Vec<(i64, &RadiatingPatch)> = self.patches.iter().map(|(key, p)| (key[0], p)).collect();
        for part in all.chunk_by(|a, b| a.0 == b.0) {
            // One list for each coordinate.
            let at: [Vec<f64>; 3] = std::array::from_fn(|c| part.iter().map(|(_, p)| p.moment[c] / p.area).collect());
            let flow = Mat::from_fn(part.len(), m, |a, j| part[a].1.flow[j]);
            for first in (0..part.len()).step_by(BLOCK) {
                let rows = BLOCK.min(part.len() - first);
                // The upper triangle, with half of the diagonal.
                let mut kernel = Mat::<f64>::zeros(rows, part.len() - first);
                for b in 0..kernel.ncols() {
                    let above = rows.min(b);
                    let [x, y, z] = at.each_ref().map(|c| (&c[first..first + above], c[first + b]));
                    let column = kernel.col_mut(b).try_as_col_major_mut().map(|c| c.as_slice_mut());
                    let Some(column) = column else { continue };
                    for (a, entry) in column[..above].iter_mut().enumerate() {
                        let r2 = (x.0[a] - x.1).powi(2) + (y.0[a] - y.1).powi(2) + (z.0[a] - z.1).powi(2);
                        // Patches may share their centre: folded surfaces.
                        let kr = (k * r2.sqrt()).max(1e-8);
                        *entry = sine(kr) / kr;
                    }
                    if b < rows {
                        column[b] = 0.5;
                    }
                }
                let pressure = &kernel * flow.subrows(first, part.len() - first);
                half += flow.subrows(first, rows).transpose() * &pressure;
            }
        }
        let factor = air.density * air.speed * k * k / (2.0 * PI);
        Mat::from_fn(m, m, |i, j| factor * (half[(i, j)] + half[(j, i)]))
    }
}

/// sin x for 0 ≤ x < 10⁶, to 10⁻¹²: without branches, so that several are computed at once.
fn sine(x: f64) -> f64 {
    // Added and subtracted again it leaves the nearest integer, whose last bit is that of the sum.
    const ROUND: f64 = 6755399441055744.0;
    // π = HIGH + LOW, HIGH with zeros at its end so that n HIGH is exact.
    const HIGH: f64 = 3.141592651605606;
    const LOW: f64 = 1.984187159361081e-09;
    let sum = x * std::f64::consts::FRAC_1_PI + ROUND;
    let n = sum - ROUND;
    let y = (x - n * HIGH) - n * LOW;
    let s = y * y;
    // Taylor's series up to y¹⁷: the next term is below 5e-14 for |y| ≤ π/2.
    const TERMS: [f64; 8] = [
        1.0 / 355687428096000.0,
        -1.0 / 1307674368000.0,
        1.0 / 6227020800.0,
        -1.0 / 39916800.0,
        1.0 / 362880.0,
        -1.0 / 5040.0,
        1.0 / 120.0,
        -1.0 / 6.0,
    ];
    let series = TERMS.iter().fold(0.0, |sum, term| sum * s + term);
    let value = y + y * s * series;
    // Odd multiples of π change the sign.
    f64::from_bits(value.to_bits() ^ (sum.to_bits() << 63))
}

/// Rows of the kernel in memory at once.
const BLOCK: usize = 256;

/// Adds a patch to those at its place.
pub fn add(patches: &mut BTreeMap<Key, RadiatingPatch>, key: Key, patch: RadiatingPatch) {
    match patches.get_mut(&key) {
        Some(p) => {
            p.area += patch.area;
            p.moment.iter_mut().zip(patch.moment).for_each(|(a, b)| *a += b);
            p.flow.iter_mut().zip(patch.flow).for_each(|(a, b)| *a += b);
        }
        None => {
            patches.insert(key, patch);
        }
    }
}

#[cfg(test)]
mod tests;
