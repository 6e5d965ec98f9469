//! How the modes of a swept body radiate: one exterior problem for each order and frequency.

use super::{square, Exterior};
use crate::sound::panels::PanelMesh;
use crate::sound::{Air, Bands};
use crate::swept::OutlineModes;
use crate::Result;
use faer::{Mat, MatRef};

/// Panels are at most this part of the wave length, and of the largest radius: the power of a wheel's modes is then
/// within 0.02 dB of that of panels a third as long (a test).
const PANEL: f64 = 0.5;
const PANEL_OF_RADIUS: f64 = 0.12;
/// Neighbouring frequencies are at most this far apart, by the wave number times the largest radius, and a third of a
/// third octave.
const APART: f64 = 0.75;

/// Modes of a swept body in air.
#[derive(Debug, Clone, Copy)]
pub struct RevolvedRadiators<'a> {
    modes: &'a OutlineModes,
    air: Air,
    /// Largest radius, m.
    radius: f64,
}

impl<'a> RevolvedRadiators<'a> {
    /// Radiation of these modes.
    pub fn new(modes: &'a OutlineModes, air: Air) -> Self {
        let radius = modes.outline.edges.iter().flat_map(|e| e.points).map(|x| x[0]).fold(0.0, f64::max);
        Self { modes, air, radius }
    }

    /// Frequencies, Hz, at which the resistances are needed so that they can be interpolated over the bands: a third
    /// of a third octave apart, and higher up so near to each other that waves across the body are followed.
    pub fn frequencies(&self, bands: &Bands) -> Vec<f64> {
        let most = APART * self.air.speed / (2.0 * std::f64::consts::PI * self.radius);
        let mut all: Vec<f64> = Vec::new();
        for pair in bands.grid().windows(2) {
            let parts = ((pair[1] - pair[0]) / most).ceil().max(1.0) as usize;
            all.extend((0..parts).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / parts as f64));
        }
        all.push(bands.highest());
        all
    }

    fn meshed(&self, f: f64) -> PanelMesh {
        let size = (PANEL * self.air.speed / f).min(PANEL_OF_RADIUS * self.radius);
        PanelMesh::new(&self.modes.outline, size)
    }

    /// Radiation resistances at the frequencies of `grid` (Hz), N·s/m per kg, `[frequencies × m × m]`: those of part
    /// `part` of `parts`, 0 elsewhere. Modes of different orders, and of different families, do not interact; the
    /// families of an order radiate alike.
    pub fn resistances(&self, grid: &[f64], part: usize, parts: usize) -> Result<Vec<f64>> {
        let m = self.modes.count;
        let last = self.modes.orders.iter().map(|o| o.order).max().unwrap_or(0);
        let mut all = vec![0.0; grid.len() * m * m];
        for (g, &f) in grid.iter().enumerate().filter(|(g, _)| g % parts == part) {
            let meshed = self.meshed(f);
            let exterior = Exterior::new(&meshed.surface, self.air, f, last);
            let of = |order: usize, motion: MatRef<'_, f64>| {
                exterior.field(order, meshed.normal(motion)).map(|field| exterior.resistance(&field))
            };
            self.spread(&mut all[m * m * g..m * m * (g + 1)], of)?;
        }
        Ok(all)
    }

    /// ρc ∫ φ_n,i φ_n,j dS, N·s/m per kg, `[m × m]`: what the resistances would be, did the surface radiate as a
    /// plane wave does.
    pub fn of_plane_waves(&self, bands: &Bands) -> Result<Vec<f64>> {
        let m = self.modes.count;
        let mut all = vec![0.0; m * m];
        let meshed = self.meshed(bands.highest());
        let factor = self.air.density * self.air.speed;
        self.spread(&mut all, |order, motion| {
            let found = square(&meshed.surface, order, &meshed.normal(motion));
            Ok(Mat::from_fn(found.nrows(), found.ncols(), |i, j| factor * found[(i, j)]))
        })?;
        Ok(all)
    }

    /// Result of `of` for the modes of each order, at their places in a matrix of all modes, column by column.
    fn spread(&self, all: &mut [f64], of: impl Fn(usize, MatRef<'_, f64>) -> Result<Mat<f64>>) -> Result<()> {
        let m = self.modes.count;
        for order in &self.modes.orders {
            let found = of(order.order, order.motion.as_ref())?;
            for places in &order.places {
                for (j, to) in places.iter().enumerate() {
                    places.iter().enumerate().for_each(|(i, from)| all[from + m * to] = found[(i, j)]);
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
