//! The linearised system of two finite-element bodies in sliding contact: what its matrices do to a vector, and how a
//! vector is read.
//!
//! (λ²M + λC + K) u − Yᵀ R = 0 with the tractions and pressures R of [`Coupling`], and Y_n u = 0 at the closed nodes;
//! Y = [B1, E B2] gives the motion of the contact rows. Its inverse at a shift is in `shift.rs`.

use super::coupling::{Coupling, CouplingMatrices};
use super::damping::DampedBody;
use super::full_body::FullBody;
use super::shift::Shift;
use crate::body::fe::BodyModes;
use crate::body::FullSystem;
use crate::eigen::quadratic::Quadratic;
use crate::parallel::World;
use crate::petsc::shell::ShellOperator;
use crate::petsc::Petsc;
use crate::Result;
use num_complex::Complex;
use std::cell::OnceCell;

type C = Complex<f64>;

/// The system, distributed: each rank has its rows of body 1, of body 2, and rank 0 those of the pressures and of the
/// friction that remembers.
pub struct System<'a> {
    pub(super) world: &'a World,
    pub(super) petsc: &'a Petsc<'a>,
    pub(super) parts: Vec<FullBody<'a>>,
    pub(super) coupling: Coupling,
    /// Unit of λ, rad/s, and of stiffness, N/m: the pressures and the changes of friction are counted in it times a
    /// metre.
    pub(super) rate: f64,
    pub(super) stiffness: f64,
    /// ‖K‖, ‖C‖, ‖M‖ by row sums in these units.
    pub(super) norms: [f64; 3],
    pub(super) shift: Option<Shift<'a>>,
    /// λ there, 1/s.
    pub(super) sigma: C,
    /// Allowed residual under rotation that the modes do not resolve; none: solutions are not corrected for it.
    pub(super) accuracy: Option<f64>,
    /// The contact as matrices, made when the transposed system is asked for.
    matrices: OnceCell<CouplingMatrices>,
}

impl<'a> System<'a> {
    /// Collective: the system of two `places` of `bodies`, lower first. `modes` are the free modes of each body,
    /// asked for where a place has modal damping or rotates. `rate` is the unit of λ, rad/s.
    pub fn new(
        petsc: &'a Petsc<'a>,
        bodies: &[&'a dyn FullSystem],
        modes: &[&'a BodyModes],
        places: &[DampedBody; 2],
        coupling: Coupling,
        rate: f64,
    ) -> Result<Self> {
        let world = petsc.world();
        let mut parts: Vec<FullBody> = Vec::new();
        for place in places {
            let part = FullBody::new(world, bodies, modes, place, &coupling.nodes, &parts)?;
            parts.push(part);
        }
        let stiffness = parts.iter().map(|p| p.stiffness.matrix().max_abs(world)).fold(0.0, f64::max);
        let mut norms = [0.0f64; 3];
        for part in &parts {
            let [k, c, m] = part.norms(world);
            for (norm, v) in norms.iter_mut().zip([k, c * rate, m * rate * rate]) {
                *norm = norm.max(v / stiffness);
            }
        }
        let d = coupling.largest_damping();
        norms[0] += 1.0 + d * coupling.largest_rate() / stiffness;
        norms[1] += d * rate / stiffness;
        let (own, moved) = coupling.largest_memory();
        norms[0] += own[1] / rate + moved[1] / (rate * stiffness) + own[0];
        norms[1] += own[0] + moved[0] / stiffness;
        let (shift, sigma, accuracy) = (None, C::default(), None);
        let matrices = OnceCell::new();
        Ok(Self { world, petsc, parts, coupling, rate, stiffness, norms, shift, sigma, accuracy, matrices })
    }

    /// The contact as matrices.
    pub(super) fn matrices(&self) -> &CouplingMatrices {
        self.matrices.get_or_init(|| CouplingMatrices::new(&self.coupling))
    }

    /// Unit of λ, rad/s.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Returns whether a body rotates: then the inverse is one of a nearby problem.
    pub(super) fn turns(&self) -> bool {
        self.parts.iter().any(FullBody::turns)
    }

    /// First local unknown of the pressures.
    pub(super) fn pressures(&self) -> usize {
        self.parts.iter().map(FullBody::len).sum()
    }

    /// Collective: the Euclidean norm of a vector.
    pub(super) fn size(&self, v: &[C]) -> f64 {
        self.world.sum(v.iter().map(|v| v.norm_sqr()).sum()).sqrt()
    }

    /// Collective: motion of the contact rows, Y u, m, `[3m]`, on every rank.
    pub fn motion(&self, x: &[C]) -> Vec<C> {
        let mut y = vec![C::default(); 3 * self.coupling.nodes.len()];
        for part in &self.parts {
            for (row, dof, factor) in part.rows() {
                y[row] += factor * x[part.first + dof];
            }
        }
        self.world.sum_all(&y)
    }

    /// out += factor Yᵀ R.
    pub(super) fn add_forces(&self, forces: &[C], factor: f64, out: &mut [C]) {
        for part in &self.parts {
            for (row, dof, y) in part.rows() {
                out[part.first + dof] += factor * y * forces[row];
            }
        }
    }

    /// The pressures of `x` on every rank, N.
    fn pressures_of(&self, x: &[C]) -> Vec<C> {
        self.multipliers(x, 0, self.coupling.closed())
    }

    /// The changes of friction of `x` on every rank, N.
    fn friction_of(&self, x: &[C]) -> Vec<C> {
        self.multipliers(x, self.coupling.closed(), self.coupling.remembering())
    }

    /// `count` unknowns of rank 0, the first of them `from` after the first of its pressures, on every rank, N.
    pub(super) fn multipliers(&self, x: &[C], from: usize, count: usize) -> Vec<C> {
        let first = self.pressures() + from;
        let mine = if self.world.is_root() { &x[first..first + count] } else { &[] };
        self.world.broadcast(mine.iter().map(|r| r * self.stiffness).collect())
    }

    /// Collective: the motion of the two bodies (local rows) and the pressures (N, on every rank) of a vector.
    pub fn split(&self, x: &[C]) -> ([Vec<C>; 2], Vec<C>) {
        let of = |p: usize| self.parts.get(p).map_or(Vec::new(), |p| p.local_rows(x).to_vec());
        ([of(0), of(1)], self.pressures_of(x))
    }

    /// Collective: reactions of the closed nodes in the pair (λ in 1/s, x), N, rows (x, y, n), `[3k]`, on every rank.
    pub fn reactions(&self, lambda: C, x: &[C]) -> Vec<C> {
        let y = self.motion(x);
        let mut forces = self.coupling.pressure_forces(&self.pressures_of(x));
        let (damped, rolling) = (self.coupling.damping_forces(&y), self.coupling.convection_forces(&y));
        let remembered = self.coupling.memory_forces(&self.friction_of(x));
        for (((f, d), r), m) in forces.iter_mut().zip(damped).zip(rolling).zip(remembered) {
            *f += lambda * d + r + m;
        }
        forces.truncate(3 * self.coupling.closed());
        forces
    }

    /// Collective: what rotation of the lower and of the upper body adds to uᴴ K u, N/m times the square of the
    /// motion's unit.
    pub fn stiffening(&self, x: &[C]) -> [C; 2] {
        [0, 1].map(|p| self.parts.get(p).map_or(C::default(), |part| part.stiffening(self.world, x)))
    }

    /// Collective: uᴴ C u of the lower and of the upper body with their own damping, N·s/m times the square of the
    /// motion's unit.
    pub(crate) fn dissipation(&self, x: &[C]) -> [f64; 2] {
        [0, 1].map(|p| self.parts.get(p).map_or(0.0, |part| part.dissipation(self.world, x)))
    }

    /// Factor of the matrix of this power of λ.
    pub(super) fn unit(&self, power: usize) -> f64 {
        self.rate.powi(power as i32) / self.stiffness
    }

    /// Collective: out = A x with the matrix A of this power of λ, of each of the `columns` vectors.
    pub(super) fn product(&self, power: usize, x: &[C], out: &mut [C], columns: usize) {
        let n = x.len() / columns.max(1);
        let unit = self.unit(power);
        out.fill(C::default());
        for part in &self.parts {
            part.multiply(self.world, power, &part.reals(x, n)).add_to(C::from(unit), out, n, part.first);
        }
        for (x, out) in x.chunks_exact(n).zip(out.chunks_exact_mut(n)) {
            self.add_contact(power, unit, x, out);
        }
    }

    /// Collective: what the contact adds to it, of one vector.
    fn add_contact(&self, power: usize, unit: f64, x: &[C], out: &mut [C]) {
        let world = self.world;
        let first = self.pressures();
        match power {
            0 => {
                let y = self.motion(x);
                let mut forces = self.coupling.convection_forces(&y);
                let pressed = self.coupling.pressure_forces(&self.pressures_of(x));
                let friction = self.friction_of(x);
                let remembered = self.coupling.memory_forces(&friction);
                forces.iter_mut().zip(pressed).zip(remembered).for_each(|((f, p), m)| *f += p + m);
                self.add_forces(&forces, -unit, out);
                if world.is_root() {
                    let closed = self.coupling.closed();
                    for i in 0..closed {
                        out[first + i] = y[3 * i + 2];
                    }
                    for (out, row) in out[first + closed..].iter_mut().zip(self.coupling.memory_rows(0, &y, &friction))
                    {
                        *out = row / (self.stiffness * self.rate);
                    }
                } else if first == 0 {
                    out[0] = x[0];
                }
            }
            1 => {
                let y = self.motion(x);
                self.add_forces(&self.coupling.damping_forces(&y), -unit, out);
                let friction = self.friction_of(x);
                if world.is_root() {
                    let at = first + self.coupling.closed();
                    for (out, row) in out[at..].iter_mut().zip(self.coupling.memory_rows(1, &y, &friction)) {
                        *out = row / self.stiffness;
                    }
                }
            }
            _ => {}
        }
    }
}

impl Quadratic for System<'_> {
    fn world(&self) -> &World {
        self.world
    }

    fn n_local(&self) -> usize {
        let multipliers = if self.world.is_root() { self.coupling.closed() + self.coupling.remembering() } else { 0 };
        // A rank without any unknown gets one that is zero.
        (self.pressures() + multipliers).max(1)
    }

    fn multiply(&mut self, power: usize, x: &[C], out: &mut [C], columns: usize) -> Result<()> {
        self.product(power, x, out, columns);
        Ok(())
    }

    fn images(&mut self, x: &[C], columns: usize) -> Result<[Vec<C>; 3]> {
        let n = x.len() / columns.max(1);
        let mut all = [0, 1, 2].map(|_| vec![C::default(); x.len()]);
        for part in &self.parts {
            for ((image, out), power) in part.images(self.world, &part.reals(x, n)).iter().zip(&mut all).zip(0..) {
                image.add_to(C::from(self.unit(power)), out, n, part.first);
            }
        }
        for (out, power) in all.iter_mut().zip(0..) {
            for (x, out) in x.chunks_exact(n).zip(out.chunks_exact_mut(n)) {
                self.add_contact(power, self.unit(power), x, out);
            }
        }
        Ok(all)
    }

    fn solve(&mut self, x: &mut [C], columns: usize) -> Result<()> {
        self.solve_whole(x, columns, false)
    }
}

impl ShellOperator for System<'_> {
    fn n_local(&self) -> usize {
        Quadratic::n_local(self)
    }

    fn multiply(&mut self, power: usize, x: &[C], out: &mut [C]) -> Result<()> {
        Quadratic::multiply(self, power, x, out, 1)
    }

    fn solve(&mut self, x: &mut [C]) -> Result<()> {
        self.solve_whole(x, 1, false)
    }

    fn multiply_transposed(&mut self, power: usize, x: &[C], out: &mut [C]) -> Result<()> {
        self.transposed_product(power, x, out, 1);
        Ok(())
    }

    fn solve_transposed(&mut self, x: &mut [C]) -> Result<()> {
        self.solve_whole(x, 1, true)
    }
}
