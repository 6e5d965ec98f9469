//! A Timoshenko beam on what carries a rail: its point receptance in closed form, and that of a piece of it with
//! absorbing ends. The rail's own figures are compared with it, and it tells how long a rail has to be.

use super::{AbsorbingEnds, Path, RailTrack};
use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex;
use std::f64::consts::PI;

type C64 = Complex<f64>;

/// A beam, in one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Young's modulus, Pa.
    pub young: f64,
    /// Shear modulus, Pa.
    pub shear: f64,
    /// Density, kg/m³.
    pub density: f64,
    /// Area, m².
    pub area: f64,
    /// Second moment of area, m⁴.
    pub inertia: f64,
    /// Part of the area that shears.
    pub sheared: f64,
    /// Loss factor of the material.
    pub loss: f64,
}

/// Stiffness and inertia of a beam at an angular frequency.
struct At {
    bend: C64,
    shear: C64,
    /// s − m′ω².
    carried: C64,
    /// GAκ − ρIω².
    turned: C64,
    /// ρIω².
    turning: f64,
}

impl Beam {
    fn at(&self, omega: f64, foundation: C64) -> At {
        let loss = Complex::new(1.0, self.loss);
        let shear = self.shear * self.area * self.sheared * loss;
        let turning = self.density * self.inertia * omega * omega;
        At {
            bend: self.young * self.inertia * loss,
            shear,
            carried: foundation - self.density * self.area * omega * omega,
            turned: shear - turning,
            turning,
        }
    }

    /// Point receptance of the infinite beam, m/N, e^{+iωt}, on a foundation of the complex stiffness `foundation`,
    /// N/m². Source: D. J. Thompson, Railway Noise and Vibration, 2009, chapter 3; by residues of its Fourier
    /// integral over the wavenumber.
    pub fn infinite(&self, omega: f64, foundation: C64) -> C64 {
        self.along(omega, foundation, 0.0)
    }

    /// The same at the distance `x`, m, from the force.
    pub fn along(&self, omega: f64, foundation: C64, x: f64) -> C64 {
        let At { bend, shear, carried, turned, turning } = self.at(omega, foundation);
        let (a, b, c) = (bend * shear, bend * carried - shear * turning, carried * turned);
        let root = (b * b - 4.0 * a * c).sqrt();
        let mut sum = C64::default();
        for square in [(-b + root) / (2.0 * a), (-b - root) / (2.0 * a)] {
            let k = square.sqrt();
            let k = if k.im > 0.0 { k } else { -k };
            sum += (bend * square + turned) / (4.0 * a * k * square + 2.0 * b * k) * (C64::I * k * x).exp();
        }
        C64::I * sum
    }

    /// The same in the middle of the period of `ends`, from the waves of the orders up to `last`.
    pub fn finite(&self, omega: f64, foundation: C64, ends: &AbsorbingEnds, last: usize) -> C64 {
        let At { bend, shear, carried, turned, .. } = self.at(omega, foundation);
        let path = Path::Line(ends.period);
        let size = last + 1;
        let turning = |i: usize, j: usize| if ends.along > 0.0 { 0.0 } else { ends.sines(i, j) };
        // Displacement with cos kx, rotation with sin kx.
        let matrix = Mat::from_fn(2 * size, 2 * size, |row, column| {
            let (i, j) = (row % size, column % size);
            let k = path.wavenumber(i);
            let here = |v: C64| if i == j { path.length_integral(i) * v } else { C64::default() };
            let slow = |mass: f64, integral: f64| C64::I * omega * mass * integral;
            match (row < size, column < size) {
                (true, true) => here(shear * k * k + carried) + slow(self.density * self.area, ends.cosines(i, j)),
                (false, false) if i == 0 || j == 0 => Complex::new(if i == j { 1.0 } else { 0.0 }, 0.0),
                // It turns by motions along the rail.
                (false, false) => here(bend * k * k + turned) + slow(self.density * self.inertia, turning(i, j)),
                _ => here(shear * k),
            }
        });
        let load = Mat::from_fn(2 * size, 1, |i, _| Complex::new(if i < size { 1.0 } else { 0.0 }, 0.0));
        let moved = matrix.partial_piv_lu().solve(&load);
        // Shorter waves move by shear alone: the sum of 2/(L GAκ k²) over the rest.
        let rest = ends.period / (2.0 * PI * PI * shear * (last as f64 + 0.5));
        (0..size).map(|j| moved[(j, 0)]).sum::<C64>() + rest
    }

    /// Velocity of long waves of compression along it, √(E/ρ), m/s.
    pub fn speed(&self) -> f64 {
        (self.young / self.density).sqrt()
    }

    /// Resistance of the beam to a wave of compression at an angular frequency, EAq, N/m, and q, 1/m, of e^{−qx}.
    fn compressed(&self, omega: f64, foundation: C64) -> (C64, C64) {
        let stiffness = self.young * self.area * Complex::new(1.0, self.loss);
        let q = ((foundation - self.density * self.area * omega * omega) / stiffness).sqrt();
        (stiffness * q, q)
    }

    /// Point receptance along the infinite bar, m/N, e^{+iωt}, on a foundation of the complex stiffness `foundation`,
    /// N/m².
    pub(crate) fn infinite_along(&self, omega: f64, foundation: C64) -> C64 {
        0.5 / self.compressed(omega, foundation).0
    }

    /// The same in the middle of the period of `ends` that have dashpots.
    pub(crate) fn finite_along(&self, omega: f64, foundation: C64, ends: &AbsorbingEnds) -> C64 {
        let (resistance, q) = self.compressed(omega, foundation);
        let dashpot = C64::I * omega * self.density * self.area * ends.along;
        // There and back, the end sends back this part of a wave.
        let back = (resistance - dashpot) / (resistance + dashpot) * (-q * ends.period).exp();
        0.5 / resistance * (1.0 + back) / (1.0 - back)
    }
}

impl RailTrack {
    /// Its complex stiffness at an angular frequency in a direction, 0 vertical, 1 longitudinal, 2 lateral; N/m².
    pub fn stiffness(&self, omega: f64, direction: usize) -> C64 {
        let of =
            |layer: &super::TrackLayer| Complex::new(layer.stiffness[direction], omega * layer.viscosity[direction]);
        let pad = of(&self.pad);
        match &self.sleeper {
            None => pad,
            Some(sleeper) => {
                let below = of(&sleeper.ballast) - omega * omega * sleeper.mass;
                pad * below / (pad + below)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 60E1, vertical.
    const RAIL: Beam = Beam {
        young: 210e9,
        shear: 80.77e9,
        density: 7860.0,
        area: 76.70e-4,
        inertia: 3.037e-5,
        sheared: 0.393,
        loss: 0.02,
    };

    /// Figures of another program for a pad of 200 MN/m² and the loss factor 0.2.
    #[test]
    fn the_beam_has_its_receptance() {
        let table = [
            (300.0, 139.0, -81.0),
            (500.0, 25.7, -123.0),
            (1000.0, 7.60, -116.0),
            (2000.0, 3.07, -104.0),
            (3000.0, 2.00, -97.0),
            (6000.0, 1.06, -91.0),
        ];
        for (f, size, phase) in table {
            let found = RAIL.infinite(2.0 * PI * f, Complex::new(200e6, 40e6));
            assert!((found.norm() * 1e10 / size - 1.0).abs() < 5e-3, "{f}: {found:e}");
            assert!((found.arg().to_degrees() - phase).abs() < 0.6, "{f}: {}", found.arg().to_degrees());
        }
    }

    /// Two metres of plain rail and five of ends to either side are an infinite rail within 1.3 %; 20 m without ends
    /// are not.
    #[test]
    fn ends_make_a_piece_of_rail_infinite() {
        let mut worst = [0.0_f64; 2];
        for f in [300.0, 400.0, 600.0, 1000.0, 1500.0, 2500.0, 4000.0, 6000.0] {
            let omega = 2.0 * PI * f;
            let foundation = Complex::new(200e6, 40e6);
            let wanted = RAIL.infinite(omega, foundation);
            let (with, without) = (
                AbsorbingEnds { period: 14.0, length: 5.0, damping: 6000.0, along: 0.0 },
                AbsorbingEnds { period: 40.0, length: 5.0, damping: 0.0, along: 0.0 },
            );
            let orders = |period: f64| (period * 8.0) as usize;
            for (worst, ends) in worst.iter_mut().zip([with, without]) {
                let found = RAIL.finite(omega, foundation, &ends, orders(ends.period));
                *worst = worst.max((found / wanted - 1.0).norm());
            }
        }
        assert!(worst[0] < 0.02 && worst[1] > 0.1, "{worst:?}");
    }
}
