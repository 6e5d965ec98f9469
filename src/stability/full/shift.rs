//! The inverse of the system at a shift.
//!
//! The bodies meet in the contact rows alone. With Rayleigh damping λ²M + λC + K = (1 + λβ)(K − sM), s = −(λ² +
//! λα)/(1 + λβ), and on the curve of the shifts that [`RayleighDamping::on_curve`] gives s is real: then one real
//! symmetric factorisation for each body is all, and what couples the bodies is a small dense problem on their
//! receptances at the contact rows (Woodbury's identity). What is given in the space of the modes, damping and rotation
//! as far as they see it, is of low rank and enters in the same way.

use super::columns::Reals;
use super::coupling::{CoupledContact, TransposedRows};
use super::damping::{ModalCorrection, ModalTerms, RayleighDamping};
use super::full_body::FullBody;
use super::inverse::{Inverse, ShiftedBody};
use super::system::System;
use crate::eigen::quadratic::{random, Quadratic, BLOCK};
use crate::petsc::complex::ComplexFactor;
use crate::petsc::mumps::{Factor, FactorOptions, Symmetry};
use crate::{Error, Result};
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// The inverse at a shift.
pub(super) struct Shift<'a> {
    bodies: Vec<ShiftedBody<'a>>,
    /// Modal correction of each part, where its modes are damped.
    modal: Vec<Option<ModalCorrection>>,
    /// On rank 0.
    contact: Option<CoupledContact>,
}

impl<'a> System<'a> {
    /// Collective: gets the inverse ready at the shift of imaginary part `height`, rad/s; returns the shift, 1/s.
    pub fn shift_to(&mut self, height: f64) -> Result<C> {
        self.shift = None;
        let damping = self.parts[0].damping;
        let (sigma, s) = damping.on_curve(height).ok_or_else(|| {
            Error::Job(format!(
                "bodies.lower.damping: at {:.1} Hz it is beyond critical, so no mode of that frequency \
                 oscillates; lower analyses.stability.full.max_frequency",
                height / (2.0 * std::f64::consts::PI)
            ))
        })?;
        let m = 3 * self.coupling.nodes.len();
        // Parts with one inverse: the modes that are damped do not matter to it.
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for (index, part) in self.parts.iter().enumerate() {
            let same = |g: &&mut Vec<usize>| {
                let other = &self.parts[g[0]];
                other.index == part.index && other.damping == part.damping
            };
            match groups.iter_mut().find(same) {
                Some(group) => group.push(index),
                None => groups.push(vec![index]),
            }
        }
        let mut bodies: Vec<ShiftedBody> = Vec::new();
        for group in groups {
            let first = &self.parts[group[0]];
            // On the curve of the shifts K − sM is all there is only where Rayleigh's damping is.
            let real = (first.damping == damping && first.own.is_none()).then_some(s);
            bodies.push(self.invert(group, sigma, real)?);
        }
        let mut receptance = vec![C::default(); m * m];
        for body in &bodies {
            for &index in &body.parts {
                let part = &self.parts[index];
                let n = part.len();
                for column in 0..m {
                    let turned = part.side.sign(column);
                    for (row, dof, y) in part.rows() {
                        receptance[row + column * m] += y * turned * body.response(column * n + dof);
                    }
                }
            }
        }
        let receptance = self.world.sum_all(&receptance);
        let mut receptance = Mat::from_fn(m, m, |i, j| receptance[i + j * m]);
        let mut modal: Vec<Option<ModalCorrection>> = Vec::new();
        for (index, part) in self.parts.iter().enumerate() {
            let body = bodies.iter().find(|b| b.parts.contains(&index));
            let correction = part.modal.as_ref().zip(body).map(|(d, body)| self.correction(part, d, body, sigma));
            if let Some(correction) = &correction {
                receptance -= correction.receptance();
            }
            modal.push(correction);
        }
        let contact = self.world.on_root(|| self.coupling.factorise(&receptance, sigma))?;
        self.shift = Some(Shift { bodies, modal, contact });
        self.sigma = sigma;
        Ok(sigma)
    }

    /// Collective: what the modal damping of a part adds to the inverse of its body at λ = `sigma`.
    fn correction(&self, part: &FullBody, damping: &ModalTerms, body: &ShiftedBody, sigma: C) -> ModalCorrection {
        let (n, m, count) = (part.len(), 3 * self.coupling.nodes.len(), damping.count());
        // G = BᵀZ, then YZ, column by column.
        let mut all = vec![C::default(); (count + m) * count];
        for (at, some) in all.chunks_mut((count + m) * BLOCK).enumerate() {
            let columns = some.len() / (count + m);
            let first = (m + at * BLOCK) * n;
            let z: Vec<C> = (first..first + columns * n).map(|i| body.response(i)).collect();
            let own = damping.loads.dots(count, &Reals::from_rows(&z, n.max(1), 0..n));
            for (k, out) in some.chunks_exact_mut(count + m).enumerate() {
                if let Some(own) = own.get(k) {
                    out[..count].copy_from_slice(own);
                }
                for (row, dof, y) in part.rows() {
                    out[count + row] += y * z[k * n + dof];
                }
            }
        }
        let all = self.world.sum_all(&all);
        let gram = Mat::from_fn(count, count, |i, j| all[j * (count + m) + i]);
        ModalCorrection::new(damping, sigma, &gram, Mat::from_fn(m, count, |i, j| all[j * (count + m) + count + i]))
    }

    /// The inverse of the parts `group` (one body, mirror images, damped alike but for their modes) at λ = `sigma`,
    /// with the real s that belongs to it if there is one.
    fn invert(&self, group: Vec<usize>, sigma: C, s: Option<f64>) -> Result<ShiftedBody<'a>> {
        let part = &self.parts[group[0]];
        let (n, m) = (part.len(), 3 * self.coupling.nodes.len());
        let (k, mass) = (part.body.stiffness(), part.body.mass());
        let name = format!("body {} at {:.1} Hz", part.body.name(), sigma.im / (2.0 * std::f64::consts::PI));
        let modal = part.modal.as_ref().or_else(|| group.iter().find_map(|&p| self.parts[p].modal.as_ref()));
        // What a real inverse makes of MΦ is known from the modes, as exactly as they are; where a body rotates pairs
        // are improved anyway.
        let turns = group.iter().any(|&p| self.parts[p].turns());
        let modes = group.iter().find_map(|&p| self.parts[p].modes);
        let known = s.filter(|_| turns).zip(modes);
        let count = m + modal.filter(|_| known.is_none()).map_or(0, |d| d.count());
        let mut loads = vec![0.0; n * count];
        for &(row, dof, factor) in &part.rows {
            loads[row * n + dof] = factor;
        }
        if let Some(modal) = modal.filter(|_| known.is_none()) {
            loads[m * n..].copy_from_slice(&modal.loads.values);
        }
        let RayleighDamping { alpha, beta } = part.damping;
        let inverse = match s {
            Some(s) => {
                let options = FactorOptions::new(Symmetry::Indefinite);
                let factor = Factor::new(self.world, &k.minus_scaled(s, mass), options, &name)?;
                Inverse::Real(factor, 1.0 / (1.0 + sigma * beta))
            }
            None => {
                let (a, b) = (1.0 + sigma * beta, sigma * sigma + sigma * alpha);
                let mut terms = vec![(k, a), (mass, b)];
                terms.extend(part.own.as_ref().map(|c| (c.matrix(), sigma)));
                Inverse::Complex(ComplexFactor::new(self.petsc, &terms, "stability_", &name)?)
            }
        };
        let mut body = ShiftedBody::new(inverse, loads, count, group)?;
        if let Some((s, modes)) = known {
            for (shape, omega) in modes.vectors.iter().zip(&modes.omega) {
                let factor = 1.0 / (omega * omega - s);
                body.columns[0].values.extend(shape.iter().map(|v| factor * v));
            }
        }
        Ok(body)
    }

    /// Collective: a start for an eigensolver, the same on any number of ranks, columns of norm 1: the answers to
    /// unlike forces, in the first column on the contact rows, in the others on the bodies.
    pub fn start(&mut self, columns: usize) -> Result<Vec<C>> {
        let n = self.n_local();
        let mut x = vec![C::default(); n * columns];
        let forces: Vec<C> = (0..3 * self.coupling.nodes.len())
            .map(|i| {
                C::new(0.3 + (i as f64 * 0.618_033_988_749_894_9).fract(), (i as f64 * 0.754_877_666_246_692_7).fract())
            })
            .collect();
        for (k, x) in x.chunks_exact_mut(n).enumerate() {
            if k == 0 {
                self.add_forces(&forces, 1.0, x);
                continue;
            }
            let mut noise = vec![C::default(); n];
            for (body, part) in self.parts.iter().enumerate() {
                let first = part.body.stiffness().rows_of(self.world.rank).start;
                let mut numbers = vec![0.0; part.len()];
                random(first, (2 * k + body) as u64, &mut numbers);
                noise[part.first..].iter_mut().zip(numbers).for_each(|(v, number)| *v = C::from(number));
            }
            self.product(2, &noise, x, 1);
        }
        Quadratic::solve(self, &mut x, columns)?;
        for x in x.chunks_exact_mut(n) {
            let size = self.size(x);
            x.iter_mut().for_each(|v| *v /= size);
        }
        Ok(x)
    }

    /// Collective: solves for the columns of `x` in place, with what the modes see of the rotation; with the transposed
    /// matrix where this is `transposed`.
    pub(super) fn solve_seen(&mut self, x: &mut [C], columns: usize, transposed: bool) -> Result<()> {
        let n = x.len() / columns.max(1);
        let mut shift = self.shift.take().ok_or_else(|| Error::Defect("full stability: no shift is set".into()))?;
        let solved = shift.bodies.iter_mut().try_for_each(|body| self.solve_bodies(body, x, n));
        if solved.is_ok() {
            self.couple(&shift, x, n, transposed);
        }
        self.shift = Some(shift);
        solved
    }

    /// Collective: the response of the parts of one inverse, each by itself, to columns of `n` rows.
    fn solve_bodies(&self, body: &mut ShiftedBody, x: &mut [C], n: usize) -> Result<()> {
        let parts: Vec<&FullBody> = body.parts.iter().map(|&index| &self.parts[index]).collect();
        let mut columns: Vec<C> = Vec::new();
        for x in x.chunks_exact(n) {
            for part in &parts {
                columns.extend(part.local_rows(x).iter().map(|v| v * self.stiffness));
            }
        }
        body.solve(&mut columns, parts.len() * (x.len() / n))?;
        let mut rest = &columns[..];
        for x in x.chunks_exact_mut(n) {
            for part in &parts {
                let (mine, tail) = rest.split_at(part.len());
                x[part.first..part.first + part.len()].copy_from_slice(mine);
                rest = tail;
            }
        }
        Ok(())
    }

    /// Forces on the rows of the contact that the transposed system makes of the motion `y` of the bodies by
    /// themselves and of the right-hand side `rows` of the multipliers, N, `[3m]`; and the solution for these rows.
    fn transposed_forces(&self, contact: &CoupledContact, y: &[C], rows: &[C]) -> (Vec<C>, Vec<C>) {
        let closed = self.coupling.closed();
        let (pressures, friction) = rows[..closed + self.coupling.remembering()].split_at(closed);
        let mut weights: Vec<C> = y[..3 * closed].iter().map(|v| v / self.stiffness).collect();
        pressures.iter().enumerate().for_each(|(i, r)| weights[3 * i + 2] += r / self.stiffness);
        let friction: Vec<C> = friction.iter().map(|f| f / self.stiffness).collect();
        let TransposedRows { motion, pressures, friction } =
            contact.transposed(&self.coupling, self.matrices(), &weights, &friction);
        let remembered = friction.iter().map(|f| f * self.stiffness * self.rate);
        (motion.iter().map(|f| f * self.stiffness).collect(), pressures.into_iter().chain(remembered).collect())
    }

    /// Collective: the solutions of the whole from the responses of the bodies, each by itself, for vectors of `n`
    /// rows. The inverses of the bodies without modal terms are symmetric.
    fn couple(&self, shift: &Shift, x: &mut [C], n: usize, transposed: bool) {
        let world = self.world;
        let first = self.pressures();
        let amplitudes: Vec<Vec<Vec<C>>> = self.parts.iter().map(|part| part.amplitudes(world, x, n)).collect();
        // Factors of the responses of each part, for each vector.
        let mut factors: Vec<Vec<Vec<C>>> = vec![Vec::new(); self.parts.len()];
        for (at, x) in x.chunks_exact_mut(n).enumerate() {
            let mut y = self.motion(x);
            // The factors of the modes' responses that modal damping takes off: first without the contact forces.
            let none = vec![C::default(); y.len()];
            for (correction, g) in shift.modal.iter().zip(&amplitudes) {
                let Some(correction) = correction else { continue };
                for (k, h) in correction.factors(&g[at], &none, transposed).into_iter().enumerate() {
                    y.iter_mut().enumerate().for_each(|(i, y)| *y -= correction.motion[(i, k)] * h);
                }
            }
            let closed = self.coupling.closed();
            let (forces, multipliers) = match &shift.contact {
                Some(contact) if transposed => self.transposed_forces(contact, &y, &x[first..]),
                Some(contact) => {
                    let rows = &x[first + closed..][..self.coupling.remembering()];
                    let remembered: Vec<C> = rows.iter().map(|r| r * self.stiffness * self.rate).collect();
                    let (forces, friction) = contact.forces(&self.coupling, &y, &x[first..first + closed], &remembered);
                    let pressures = (0..closed).map(|i| forces[3 * i + 2] / self.stiffness);
                    let multipliers = pressures.chain(friction.iter().map(|f| f / self.stiffness)).collect();
                    (forces, multipliers)
                }
                None => (Vec::new(), Vec::new()),
            };
            let forces = world.broadcast(forces);
            for ((part, factors), index) in self.parts.iter().zip(&mut factors).zip(0..) {
                let mut own: Vec<C> = forces.iter().enumerate().map(|(row, f)| part.side.sign(row) * f).collect();
                if let Some(correction) = &shift.modal[index] {
                    own.extend(correction.factors(&amplitudes[index][at], &forces, transposed).iter().map(|h| -h));
                }
                factors.push(own);
            }
            x[first..].iter_mut().zip(multipliers).for_each(|(x, v): (&mut C, C)| *x = v);
        }
        for body in &shift.bodies {
            for &index in &body.parts {
                let part = &self.parts[index];
                let mut response = part.reals(x, n).zeros();
                body.add_response(&factors[index], &mut response);
                response.add_to(C::from(1.0), x, n, part.first);
            }
        }
    }
}
