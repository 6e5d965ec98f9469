//! Modes of a rail, order by order of its period, and the damping between all of them.

use super::modes::{contact_functions, FourierModes};
use super::{AbsorbingEnds, Forms, LineLoad};
use crate::{Error, Result};
use faer::Mat;

/// Modes of an order as contact and damping need them: numbers alone, for all ranks. For n ≥ 1 each stands for two, one
/// of either family.
#[derive(Debug, Clone, PartialEq)]
pub struct RailMode {
    /// Number n of waves on the period.
    pub order: usize,
    /// Angular frequencies, rad/s, ascending, `[m]`.
    pub omega: Vec<f64>,
    /// Relative residuals, `[m]`.
    pub residual: Vec<f64>,
    /// ψ̂ = Γ⁻¹⟨ωπ, φ⟩ over the circles of the contacts, of the family about each contact that each of its nine loads
    /// moves, `[9T, m]`.
    pub contact: Mat<f64>,
    /// φᵀKφ of the springs of the track, 1/s², `[m]`.
    pub springs: Vec<f64>,
    /// φᵀCφ of its dashpots, 1/s, `[m, m]`.
    pub dashpots: Mat<f64>,
    /// Amplitudes, 1/√kg, `[amplitudes, m]`.
    pub vectors: Mat<f64>,
}

/// Damping of a rail beside its track's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RailDamping {
    /// Loss factor of the rail: what it stores at a mode's own frequency ω dissipates c = ηk/ω.
    pub loss: f64,
    /// Absorbing ends.
    pub ends: Option<AbsorbingEnds>,
}

/// A mode: index of its order in a list of [`RailMode`], index there, family.
pub type Member = (usize, usize, usize);

impl RailMode {
    /// Modal data of `modes` of `forms`, with the loads of their order at the contacts.
    pub fn new(forms: &Forms, modes: FourierModes, loads: &[LineLoad]) -> Self {
        let FourierModes { order, omega, vectors, residual } = modes;
        let m = omega.len();
        let contact = contact_functions(vectors.as_ref(), loads);
        let (springs, dashpots) = match forms.track(order, vectors.as_ref()) {
            None => (vec![0.0; m], Mat::zeros(m, m)),
            Some([springs, dashpots]) => {
                ((0..m).map(|k| vectors.col(k).transpose() * springs.col(k)).collect(), vectors.transpose() * dashpots)
            }
        };
        Self { order, omega, residual, contact, springs, dashpots, vectors }
    }

    /// The same in a frame turned by `angle`, rad, from y to z against that of the amplitudes, without contacts.
    pub fn rotated(&self, angle: f64) -> Self {
        let (s, c) = angle.sin_cos();
        let v = &self.vectors;
        let vectors = Mat::from_fn(v.nrows(), v.ncols(), |i, k| match i % 3 {
            0 => c * v[(i, k)] - s * v[(i + 2, k)],
            1 => v[(i, k)],
            _ => c * v[(i, k)] + s * v[(i - 2, k)],
        });
        let contact = Mat::zeros(0, self.contact.ncols());
        let Self { order, omega, residual, springs, dashpots, .. } = self.clone();
        Self { order, omega, residual, contact, springs, dashpots, vectors }
    }

    /// As one list of numbers.
    pub(crate) fn to_numbers(&self) -> Vec<f64> {
        let sizes = [self.order, self.omega.len(), self.contact.nrows(), self.vectors.nrows()];
        let mut list = sizes.map(|n| n as f64).to_vec();
        list.extend(self.omega.iter().chain(&self.residual).chain(&self.springs));
        for matrix in [&self.dashpots, &self.contact, &self.vectors] {
            matrix.col_iter().for_each(|c| list.extend(c.iter()));
        }
        list
    }

    /// All those of lists put one after the other, by orders.
    pub fn from_numbers(mut numbers: &[f64]) -> Result<Vec<Self>> {
        let mut all = Vec::new();
        while !numbers.is_empty() {
            let [m, seen, rows] = [1, 2, 3].map(|k| numbers.get(k).map_or(0, |m| *m as usize));
            let length = 4 + (3 + seen + m + rows) * m;
            if numbers.len() < length {
                return Err(Error::Defect(format!("waves of an order: {} numbers of {length}", numbers.len())));
            }
            let (mine, rest) = numbers.split_at(length);
            let (list, matrices) = mine[4..].split_at(3 * m);
            let matrix = |rows: usize, first: usize| Mat::from_fn(rows, m, |i, j| matrices[first + i + rows * j]);
            all.push(Self {
                order: mine[0] as usize,
                omega: list[..m].to_vec(),
                residual: list[m..2 * m].to_vec(),
                springs: list[2 * m..].to_vec(),
                dashpots: matrix(m, 0),
                contact: matrix(seen, m * m),
                vectors: matrix(rows, (m + seen) * m),
            });
            numbers = rest;
        }
        all.sort_by_key(|s| s.order);
        Ok(all)
    }
}

/// Returns whether (U, W) of a mode goes with cos kx, and the sign with which V does; 0 where V goes with sin kx. An
/// order without waves has its one family constant along the rail.
pub(super) fn shape(order: usize, family: usize) -> (bool, f64) {
    match (order, family) {
        (0, _) => (true, 1.0),
        (_, 0) => (true, 0.0),
        _ => (false, -1.0),
    }
}

/// ΦᵀCΦ, 1/s, `[members, members]`, of modes `list` of `waves` of `forms`.
pub fn damping(forms: &Forms, waves: &[RailMode], list: &[Member], given: &RailDamping) -> Mat<f64> {
    let mut c = Mat::zeros(list.len(), list.len());
    for (i, &(a, k, family)) in list.iter().enumerate() {
        for (j, &(b, l, other)) in list.iter().enumerate() {
            if (a, family) == (b, other) {
                c[(i, j)] = 0.5 * (waves[a].dashpots[(k, l)] + waves[a].dashpots[(l, k)]);
            }
        }
        let (omega, springs) = (waves[a].omega[k], waves[a].springs[k]);
        if omega > 0.0 {
            c[(i, i)] += given.loss * (omega * omega - springs).max(0.0) / omega;
        }
    }
    let Some(ends) = &given.ends else { return c };
    let first: Vec<usize> = waves
        .iter()
        .scan(0, |sum, w| {
            *sum += w.omega.len();
            Some(*sum - w.omega.len())
        })
        .collect();
    let count = waves.iter().map(|w| w.omega.len()).sum();
    let mut all = Mat::<f64>::zeros(forms.order(), count);
    for (wave, &at) in waves.iter().zip(&first) {
        all.as_mut().subcols_mut(at, wave.omega.len()).copy_from(&wave.vectors);
    }
    let [across, along] = [false, true].map(|v| all.transpose() * forms.mass_of(v, all.as_ref()));
    for (i, &(a, k, family)) in list.iter().enumerate() {
        for (j, &(b, l, other)) in list.iter().enumerate() {
            let at = (first[a] + k, first[b] + l);
            let (m, n) = (waves[a].order, waves[b].order);
            let ((cos, sign), (also, turn)) = (shape(m, family), shape(n, other));
            // Ends are alike on either side: cosines and sines do not meet.
            if cos == also {
                c[(i, j)] += across[at] * if cos { ends.cosines(m, n) } else { ends.sines(m, n) };
            }
            if (sign == 0.0) == (turn == 0.0) {
                let ends = match (ends.along > 0.0, sign == 0.0) {
                    (true, true) => 0.0,
                    (true, false) => ends.closing(m, n),
                    (false, true) => ends.sines(m, n),
                    (false, false) => ends.cosines(m, n),
                };
                c[(i, j)] += along[at] * if sign == 0.0 { ends } else { sign * turn * ends };
            }
        }
    }
    c
}
