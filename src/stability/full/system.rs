//! The linearised system of two finite-element bodies in sliding contact: what its matrices and its inverse at a shift do to a
//! vector.
//!
//! (λ²M + λC + K) u − Yᵀ R = 0 with the tractions and pressures R of [`Coupling`], and Y_n u = 0 at the closed nodes; Y = [B1, E B2]
//! gives the motion of the contact rows. The bodies meet in the contact rows alone. With Rayleigh damping
//! λ²M + λC + K = (1 + λβ)(K − sM), s = −(λ² + λα)/(1 + λβ), and on the curve of the shifts that [`Damping::on_curve`] gives s is real: then one
//! real symmetric factorisation for each body is all, and what couples the bodies is a small dense problem on their receptances
//! at the contact rows (Woodbury's identity). Modal damping is of low rank and enters in the same way.

use super::coupling::{CoupledContact, Coupling};
use super::damping::{DampedBody, Damping, ModalCorrection, ModalTerms, Spin};
use super::inverse::{Inverse, ShiftedBody};
use crate::body::fe::BodyModes;
use crate::body::{FullSystem, Side};
use crate::parallel::World;
use crate::petsc::complex::ComplexFactor;
use crate::petsc::csr::Operator;
use crate::petsc::mumps::{Factor, FactorOptions, Symmetry};
use crate::petsc::shell::ShellOperator;
use crate::petsc::Petsc;
use crate::{Error, Result};
use faer::Mat;
use num_complex::Complex;
use std::rc::Rc;

type C = Complex<f64>;

/// What corrections for the rotation may leave of a solution.
const CORRECTED: f64 = 1e-11;
/// Most corrections of a solution.
const CORRECTIONS: usize = 12;

/// One of the two bodies.
struct Part<'a> {
    body: &'a dyn FullSystem,
    side: Side,
    stiffness: Operator<'a>,
    mass: Operator<'a>,
    damping: Damping,
    modal: Option<ModalTerms>,
    spin: Option<Spin>,
    /// Index in the list of finite-element bodies: equal for mirror images.
    index: usize,
    /// This rank's contact rows of the body in lower form: (row of the coupling, local degree of freedom, coefficient).
    rows: Vec<(usize, usize, f64)>,
    /// First of its local unknowns.
    first: usize,
}

impl Part<'_> {
    fn len(&self) -> usize {
        self.body.stiffness().n_local()
    }

    /// This rank's entries of Y: (row of the coupling, local degree of freedom, coefficient).
    fn rows(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.rows.iter().map(|&(row, dof, factor)| (row, dof, self.side.sign(row) * factor))
    }
}

/// The inverse at a shift.
struct Shift<'a> {
    bodies: Vec<ShiftedBody<'a>>,
    /// Of each part, where its modes are damped.
    modal: Vec<Option<ModalCorrection>>,
    /// On rank 0.
    contact: Option<CoupledContact>,
}

/// The system, distributed: each rank has its rows of body 1, of body 2, and rank 0 those of the pressures and of the friction that remembers.
pub struct System<'a> {
    world: &'a World,
    petsc: &'a Petsc<'a>,
    parts: Vec<Part<'a>>,
    coupling: Coupling,
    /// Unit of λ, rad/s, and of stiffness, N/m: the pressures and the changes of friction are counted in it times a metre.
    rate: f64,
    stiffness: f64,
    /// ‖K‖, ‖C‖, ‖M‖ by row sums in these units.
    norms: [f64; 3],
    shift: Option<Shift<'a>>,
    /// λ there, 1/s.
    sigma: C,
}

/// x̄ᵀy of this rank's rows.
fn inner(x: &[C], y: &[C]) -> C {
    x.iter().zip(y).map(|(x, y)| x.conj() * y).sum()
}

/// Residuals of an eigenpair.
#[derive(Debug, Clone, Copy)]
pub struct Residuals {
    /// |P(λ)x| / ((|λ|²‖M‖ + |λ|‖C‖ + ‖K‖) |x|) (Tisseur, Linear Algebra Appl. 309, 2000).
    pub backward_error: f64,
    /// |P(σ)⁻¹P(λ)x| / |x| with the last shift σ.
    pub correction: f64,
    /// Largest |Y_n u| of the closed nodes over the largest |u|.
    pub constraint: f64,
}

impl<'a> System<'a> {
    /// Collective: the system of two `places` of `bodies`, lower first. `modes` are the free modes of each body, asked for where a place has modal
    /// damping. `rate` is the unit of λ, rad/s.
    pub fn new(
        petsc: &'a Petsc<'a>,
        bodies: &[&'a dyn FullSystem],
        modes: &[&BodyModes],
        places: &[DampedBody; 2],
        coupling: Coupling,
        rate: f64,
    ) -> Result<Self> {
        let world = petsc.world();
        let mut parts: Vec<Part> = Vec::new();
        let mut first = 0;
        for (side, place) in Side::BOTH.into_iter().zip(places) {
            let DampedBody { body: index, damping, .. } = *place;
            let missing = || Error::Defect("full stability: a body is missing".into());
            let body = *bodies.get(index).ok_or_else(missing)?;
            let mut place_of = vec![None; body.trace().rows() / 3];
            coupling.nodes.iter().enumerate().for_each(|(at, &node)| place_of[node] = Some(at));
            let in_contact =
                |&(row, dof, factor): &(usize, usize, f64)| place_of[row / 3].map(|at| (3 * at + row % 3, dof, factor));
            let mut rows: Vec<_> = body.trace().own().iter().filter_map(in_contact).collect();
            rows.sort_by_key(|r| r.0);
            let (stiffness, mass) = (body.stiffness().operator(world), body.mass().operator(world));
            let modal = match (place.modal.is_empty() && place.spin.is_none(), modes.get(index)) {
                (true, _) => None,
                (_, None) => return Err(Error::Defect("full stability: no modes to damp or to turn".into())),
                (_, Some(modes)) => {
                    let enough = if place.spin.is_some() { 2 } else { 1 } * modes.vectors.len();
                    let twin = parts.iter().filter(|p| p.index == index).find_map(|p| p.modal.as_ref());
                    let loads = match twin.filter(|twin| twin.loads.len() >= enough) {
                        Some(twin) => Rc::clone(&twin.loads),
                        None => ModalTerms::loads(world, &mass, modes, place),
                    };
                    Some(ModalTerms::new(loads, modes, place)?)
                }
            };
            let spin = place.spin.clone();
            parts.push(Part { body, side, stiffness, mass, damping, modal, spin, index, rows, first });
            first += body.stiffness().n_local();
        }
        let stiffness = parts.iter().map(|p| p.stiffness.matrix().max_abs(world)).fold(0.0, f64::max);
        let mut norms = [0.0f64; 3];
        for p in &parts {
            let k = p.stiffness.matrix().norm_inf(world);
            let m = p.mass.matrix().norm_inf(world);
            let modal = p.modal.as_ref().map_or([0.0; 2], |d| d.norms(world));
            let c = p.damping.alpha.abs() * m + p.damping.beta.abs() * k + modal[1];
            for (norm, v) in norms.iter_mut().zip([k + modal[0], c * rate, m * rate * rate]) {
                *norm = norm.max(v / stiffness);
            }
        }
        let d = coupling.largest_damping();
        norms[0] += 1.0 + d * coupling.largest_rate() / stiffness;
        norms[1] += d * rate / stiffness;
        let (own, moved) = coupling.largest_memory();
        norms[0] += own[1] / rate + moved[1] / (rate * stiffness) + own[0];
        norms[1] += own[0] + moved[0] / stiffness;
        Ok(Self { world, petsc, parts, coupling, rate, stiffness, norms, shift: None, sigma: C::default() })
    }

    /// Unit of λ, rad/s.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// First local unknown of the pressures.
    fn pressures(&self) -> usize {
        self.parts.iter().map(Part::len).sum()
    }

    /// Collective: gets the inverse ready at the shift of imaginary part `height`, rad/s; returns the shift, 1/s.
    pub fn shift_to(&mut self, height: f64) -> Result<C> {
        self.shift = None;
        let damping = self.parts[0].damping;
        let (sigma, s) = damping.on_curve(height).ok_or_else(|| {
            Error::Job(format!(
                "bodies.lower.damping: at {:.1} Hz it is beyond critical, so no mode of that frequency oscillates; lower analyses.stability.full.max_frequency",
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
            let real = (self.parts[group[0]].damping == damping).then_some(s);
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
        let contact = self.world.on_root(|| self.coupling.at(&receptance, sigma))?;
        self.shift = Some(Shift { bodies, modal, contact });
        self.sigma = sigma;
        Ok(sigma)
    }

    /// Collective: what the modal damping of a part adds to the inverse of its body at λ = `sigma`.
    fn correction(&self, part: &Part, damping: &ModalTerms, body: &ShiftedBody, sigma: C) -> ModalCorrection {
        let (n, m, count) = (part.len(), 3 * self.coupling.nodes.len(), damping.count());
        // G = UᵀZ, then YZ, column by column.
        let mut all = vec![C::default(); (count + m) * count];
        for (k, out) in all.chunks_exact_mut(count + m).enumerate() {
            let z: Vec<C> = (0..n).map(|i| body.response((m + k) * n + i)).collect();
            out[..count].copy_from_slice(&damping.amplitudes(&z));
            for (row, dof, y) in part.rows() {
                out[count + row] += y * z[dof];
            }
        }
        let all = self.world.sum_all(&all);
        let gram = Mat::from_fn(count, count, |i, j| all[j * (count + m) + i]);
        ModalCorrection::new(damping, sigma, &gram, Mat::from_fn(m, count, |i, j| all[j * (count + m) + count + i]))
    }

    /// The inverse of the parts `group` (one body, mirror images, damped alike but for their modes) at λ = `sigma`, with the real s that belongs to it
    /// if there is one.
    fn invert(&self, group: Vec<usize>, sigma: C, s: Option<f64>) -> Result<ShiftedBody<'a>> {
        let part = &self.parts[group[0]];
        let (n, m) = (part.len(), 3 * self.coupling.nodes.len());
        let (k, mass) = (part.body.stiffness(), part.body.mass());
        let name = format!("body {} at {:.1} Hz", part.body.name(), sigma.im / (2.0 * std::f64::consts::PI));
        let modal = group.iter().filter_map(|&p| self.parts[p].modal.as_ref()).max_by_key(|d| d.loads.len());
        let count = m + modal.map_or(0, |d| d.loads.len());
        let mut loads = vec![0.0; n * count];
        for &(row, dof, factor) in &part.rows {
            loads[row * n + dof] = factor;
        }
        for (load, column) in modal.iter().flat_map(|d| d.loads.iter()).zip(m..) {
            loads[column * n..(column + 1) * n].copy_from_slice(load);
        }
        let Damping { alpha, beta } = part.damping;
        let inverse = match s {
            Some(s) => {
                let options = FactorOptions::new(Symmetry::Indefinite);
                let factor = Factor::new(self.world, &k.minus_scaled(s, mass), options, &name)?;
                Inverse::Real(factor, 1.0 / (1.0 + sigma * beta))
            }
            None => {
                let (a, b) = (1.0 + sigma * beta, sigma * sigma + sigma * alpha);
                Inverse::Complex(ComplexFactor::new(self.petsc, k, mass, [a, b], "stability_", &name)?)
            }
        };
        ShiftedBody::new(inverse, loads, count, group)
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

    /// Collective: amplitudes of the damped modes of a part, Uᵀ u; empty where it has none.
    fn amplitudes(&self, part: &Part, x: &[C]) -> Vec<C> {
        let u = &x[part.first..part.first + part.len()];
        part.modal.as_ref().map_or(Vec::new(), |d| self.world.sum_all(&d.amplitudes(u)))
    }

    /// out += factor Yᵀ R.
    fn add_forces(&self, forces: &[C], factor: f64, out: &mut [C]) {
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
    fn multipliers(&self, x: &[C], from: usize, count: usize) -> Vec<C> {
        let first = self.pressures() + from;
        let mine = if self.world.is_root() { &x[first..first + count] } else { &[] };
        self.world.broadcast(mine.iter().map(|r| r * self.stiffness).collect())
    }

    /// Collective: the motion of the two bodies (local rows) and the pressures (N, on every rank) of a vector.
    pub fn split(&self, x: &[C]) -> ([Vec<C>; 2], Vec<C>) {
        let of = |p: usize| self.parts.get(p).map_or(Vec::new(), |p| x[p.first..p.first + p.len()].to_vec());
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

    /// Collective: what rotation of the lower and of the upper body adds to uᴴ K u, N/m times the square of the motion's unit.
    pub fn stiffening(&self, x: &[C]) -> [C; 2] {
        let of = |part: &Part| {
            let (Some(spin), Some(modal)) = (&part.spin, &part.modal) else { return C::default() };
            let u = &x[part.first..part.first + part.len()];
            let mut product = vec![C::default(); u.len()];
            spin.forms.stiffness.operator(self.world).apply(self.world, u, &mut product);
            modal.add_seen(self.world, true, -1.0, u, &mut product);
            let unseen = self.world.sum_all(&[inner(u, &product)])[0];
            modal.stiffening(self.world, u) + spin.speed * spin.speed * unseen
        };
        [0, 1].map(|p| self.parts.get(p).map_or(C::default(), of))
    }

    /// Collective: uᴴ C u of the lower and of the upper body with their own damping, N·s/m times the square of the motion's unit.
    pub fn dissipation(&self, x: &[C]) -> [f64; 2] {
        let of = |part: &Part| {
            let u = &x[part.first..part.first + part.len()];
            let mut product = vec![C::default(); u.len()];
            let mut form = |matrix: &Operator| {
                matrix.apply(self.world, u, &mut product);
                self.world.sum(u.iter().zip(&product).map(|(u, p)| (u.conj() * p).re).sum())
            };
            let Damping { alpha, beta } = part.damping;
            let rayleigh = alpha * form(&part.mass) + beta * form(&part.stiffness);
            rayleigh + part.modal.as_ref().map_or(0.0, |d| d.power(self.world, u))
        };
        [0, 1].map(|p| self.parts.get(p).map_or(0.0, of))
    }

    /// Collective: out += what of the rotation the modes do not see, G − MΦ G̃ ΦᵀM and alike, of the power 1 or 0 of λ.
    fn add_unseen(&self, power: usize, factor: f64, x: &[C], out: &mut [C]) {
        let world = self.world;
        let unit = factor * self.rate.powi(power as i32) / self.stiffness;
        for part in &self.parts {
            let (Some(spin), Some(modal)) = (&part.spin, &part.modal) else { continue };
            let (form, factor) = match power {
                1 => (&spin.forms.gyroscopic, unit * spin.speed),
                0 => (&spin.forms.stiffness, unit * spin.speed * spin.speed),
                _ => continue,
            };
            let span = part.first..part.first + part.len();
            let (x, out) = (&x[span.clone()], &mut out[span]);
            let mut product = vec![C::default(); x.len()];
            form.operator(world).apply(world, x, &mut product);
            out.iter_mut().zip(&product).for_each(|(o, p)| *o += factor * p);
            modal.add_seen(world, power == 0, -factor, x, out);
        }
    }

    /// Collective: residuals of the pair (λ in 1/s, x).
    pub fn residuals(&mut self, lambda: C, x: &[C]) -> Result<Residuals> {
        let world = self.world;
        let scaled = lambda / self.rate;
        let mut sum = vec![C::default(); x.len()];
        let mut y = sum.clone();
        let mut power = C::from(1.0);
        let mut scale = 0.0;
        for (p, norm) in self.norms.into_iter().enumerate() {
            self.multiply(p, x, &mut y)?;
            sum.iter_mut().zip(&y).for_each(|(s, y)| *s += power * y);
            scale += power.norm() * norm;
            power *= scaled;
        }
        let norm = |v: &[C]| world.sum(v.iter().map(|v| v.norm_sqr()).sum()).sqrt();
        let size = norm(x);
        let backward_error = norm(&sum) / (scale * size);
        self.solve(&mut sum)?;
        let correction = norm(&sum) / size;
        let y = self.motion(x);
        let gap = (0..self.coupling.closed()).map(|i| y[3 * i + 2].norm()).fold(0.0, f64::max);
        let u = world.max(x[..self.pressures()].iter().map(|v| v.norm()).fold(0.0, f64::max));
        Ok(Residuals { backward_error, correction, constraint: gap / u })
    }

    /// Collective: a start for the eigensolver, the same on any number of ranks: the answer to unlike forces on the contact rows.
    pub fn start(&mut self) -> Result<Vec<C>> {
        let mut x = vec![C::default(); self.n_local()];
        let forces: Vec<C> = (0..3 * self.coupling.nodes.len())
            .map(|i| {
                C::new(0.3 + (i as f64 * 0.618_033_988_749_894_9).fract(), (i as f64 * 0.754_877_666_246_692_7).fract())
            })
            .collect();
        self.add_forces(&forces, 1.0, &mut x);
        self.solve(&mut x)?;
        let size = self.world.sum(x.iter().map(|v| v.norm_sqr()).sum()).sqrt();
        x.iter_mut().for_each(|v| *v /= size);
        Ok(x)
    }

    fn size(&self, v: &[C]) -> f64 {
        self.world.sum(v.iter().map(|v| v.norm_sqr()).sum()).sqrt()
    }

    /// Collective: solves with what the modes see of the rotation.
    fn solve_seen(&mut self, x: &mut [C]) -> Result<()> {
        let world = self.world;
        let first = self.pressures();
        let mut shift = self.shift.take().ok_or_else(|| Error::Defect("full stability: no shift is set".into()))?;
        for body in &mut shift.bodies {
            let mut columns: Vec<C> = Vec::new();
            for &part in &body.parts {
                let part = &self.parts[part];
                columns.extend(x[part.first..part.first + part.len()].iter().map(|v| v * self.stiffness));
            }
            let solved = body.solve(&mut columns, body.parts.len());
            if let Err(e) = solved {
                self.shift = Some(shift);
                return Err(e);
            }
            let mut rest = &columns[..];
            for &part in &body.parts {
                let part = &self.parts[part];
                let (mine, tail) = rest.split_at(part.len());
                x[part.first..part.first + part.len()].copy_from_slice(mine);
                rest = tail;
            }
        }
        let mut y = self.motion(x);
        // Amplitudes of the damped modes, then the factors of their responses that modal damping takes off: first without the contact forces.
        let amplitudes: Vec<Vec<C>> = self.parts.iter().map(|part| self.amplitudes(part, x)).collect();
        let none = vec![C::default(); y.len()];
        for (correction, g) in shift.modal.iter().zip(&amplitudes) {
            let Some(correction) = correction else { continue };
            for (k, h) in correction.factors(g, &none).into_iter().enumerate() {
                y.iter_mut().enumerate().for_each(|(i, y)| *y -= correction.motion[(i, k)] * h);
            }
        }
        let closed = self.coupling.closed();
        let (forces, friction) = match &shift.contact {
            Some(contact) => {
                let rows = &x[first + closed..][..self.coupling.remembering()];
                let remembered: Vec<C> = rows.iter().map(|r| r * self.stiffness * self.rate).collect();
                contact.forces(&self.coupling, &y, &x[first..first + closed], &remembered)
            }
            None => (Vec::new(), Vec::new()),
        };
        let forces = world.broadcast(forces);
        for body in &shift.bodies {
            for &index in &body.parts {
                let part = &self.parts[index];
                let mut factors: Vec<C> = forces.iter().enumerate().map(|(row, f)| part.side.sign(row) * f).collect();
                if let Some(correction) = &shift.modal[index] {
                    factors.extend(correction.factors(&amplitudes[index], &forces).iter().map(|h| -h));
                }
                body.add_response(&factors, &mut x[part.first..part.first + part.len()]);
            }
        }
        if world.is_root() {
            for i in 0..closed {
                x[first + i] = forces[3 * i + 2] / self.stiffness;
            }
            for (x, f) in x[first + closed..].iter_mut().zip(&friction) {
                *x = f / self.stiffness;
            }
        }
        self.shift = Some(shift);
        Ok(())
    }
}

impl ShellOperator for System<'_> {
    fn n_local(&self) -> usize {
        let multipliers = if self.world.is_root() { self.coupling.closed() + self.coupling.remembering() } else { 0 };
        // A rank without any unknown gets one that is zero.
        (self.pressures() + multipliers).max(1)
    }

    fn multiply(&mut self, power: usize, x: &[C], out: &mut [C]) -> Result<()> {
        let world = self.world;
        let unit = self.rate.powi(power as i32) / self.stiffness;
        out.fill(C::default());
        let mut product = Vec::new();
        for part in &self.parts {
            let span = part.first..part.first + part.len();
            let x = &x[span.clone()];
            product.resize(x.len(), C::default());
            let Damping { alpha, beta } = part.damping;
            let terms = match power {
                0 => [(1.0, Some(&part.stiffness)), (0.0, None)],
                1 => [(alpha, Some(&part.mass)), (beta, Some(&part.stiffness))],
                _ => [(1.0, Some(&part.mass)), (0.0, None)],
            };
            for (factor, matrix) in terms {
                let Some(matrix) = matrix.filter(|_| factor != 0.0) else { continue };
                matrix.apply(world, x, &mut product);
                for (o, p) in out[span.clone()].iter_mut().zip(&product) {
                    *o += factor * unit * p;
                }
            }
            if let Some(modal) = &part.modal {
                modal.add(world, power, unit, x, &mut out[span]);
            }
        }
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
        self.add_unseen(power, 1.0, x, out);
        Ok(())
    }

    /// The inverse stands for all of the rotation but what the modes do not see of it, E: y − P̃⁻¹Ey + P̃⁻¹EP̃⁻¹Ey − … is the solution of the whole.
    fn solve(&mut self, x: &mut [C]) -> Result<()> {
        self.solve_seen(x)?;
        if self.parts.iter().all(|p| p.spin.is_none()) {
            return Ok(());
        }
        let mut term = x.to_vec();
        let mut last = 1.0;
        for _ in 0..CORRECTIONS {
            let (mut still, mut moving) = (vec![C::default(); x.len()], vec![C::default(); x.len()]);
            self.add_unseen(0, -1.0, &term, &mut still);
            self.add_unseen(1, -1.0, &term, &mut moving);
            let rate = self.sigma / self.rate;
            term = still.iter().zip(&moving).map(|(s, m)| s + rate * m).collect();
            self.solve_seen(&mut term)?;
            x.iter_mut().zip(&term).for_each(|(x, t)| *x += t);
            // What is left is smaller than the last term by as much as that than the one before.
            let share = self.size(&term) / self.size(x);
            if share * (share / last) <= CORRECTED {
                return Ok(());
            }
            if !(share < last) {
                break;
            }
            last = share;
        }
        Err(Error::NotConverged(format!(
            "stability, full system: the solution at {:.1} Hz does not take in the rotation that the modes do not see: the last correction is {last:.1e} of it; \
             ask for more modes in analyses.modes",
            self.sigma.im / (2.0 * std::f64::consts::PI)
        )))
    }
}
