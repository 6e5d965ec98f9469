//! One of the two bodies of the full system: its matrices, its damping, its rotation and its contact rows.

use super::columns::Reals;
use super::damping::{DampedBody, ModalTerms, RayleighDamping, Spin};
use crate::body::fe::BodyModes;
use crate::body::{FullSystem, Side};
use crate::parallel::World;
use crate::petsc::operator::Operator;
use crate::{Error, Result};
use num_complex::Complex;
use std::rc::Rc;

type C = Complex<f64>;

/// The sparse matrices of a rotating body.
pub(super) struct RotationOperators<'a> {
    /// Ω, rad/s.
    speed: f64,
    /// G and K_σ − K_c at 1 rad/s.
    forms: [Operator<'a>; 2],
}

impl RotationOperators<'_> {
    fn new(world: &World, spin: &Spin) -> Self {
        let forms = [&spin.forms.gyroscopic, &spin.forms.stiffness];
        Self { speed: spin.speed, forms: forms.map(|form| Operator::new(world, Rc::clone(form).into())) }
    }

    /// The matrix that goes with the power 1 or 0 of λ, and its factor.
    fn term(&self, power: usize) -> Option<(&Operator<'_>, f64)> {
        match power {
            1 => Some((&self.forms[0], self.speed)),
            0 => Some((&self.forms[1], self.speed * self.speed)),
            _ => None,
        }
    }
}

/// One of the two bodies.
pub(super) struct FullBody<'a> {
    pub body: &'a dyn FullSystem,
    pub side: Side,
    pub stiffness: Operator<'a>,
    pub mass: Operator<'a>,
    pub damping: RayleighDamping,
    /// Damping matrix that the body brings with it, beside `damping`.
    pub own: Option<Operator<'a>>,
    pub modal: Option<ModalTerms>,
    /// The modes, where it has such terms.
    pub modes: Option<&'a BodyModes>,
    turning: Option<RotationOperators<'a>>,
    /// Index in the list of finite-element bodies: equal for mirror images.
    pub index: usize,
    /// This rank's contact rows of the body in lower form: (row of the coupling, local degree of freedom, coefficient).
    pub rows: Vec<(usize, usize, f64)>,
    /// First of its local unknowns.
    pub first: usize,
}

impl<'a> FullBody<'a> {
    /// Collective: the body at `place`, whose contact rows are those of the `nodes` of the coupling and whose
    /// unknowns follow those of `earlier`. `modes` are its free modes, asked for where the place has modal damping or
    /// rotates.
    pub fn new(
        world: &World,
        bodies: &[&'a dyn FullSystem],
        modes: &[&'a BodyModes],
        place: &DampedBody,
        nodes: &[usize],
        earlier: &[FullBody<'a>],
    ) -> Result<Self> {
        let DampedBody { body: index, damping, .. } = *place;
        let missing = || Error::Defect("full stability: a body is missing".into());
        let body = *bodies.get(index).ok_or_else(missing)?;
        let mut place_of = vec![None; body.trace().rows() / 3];
        nodes.iter().enumerate().for_each(|(at, &node)| place_of[node] = Some(at));
        let in_contact =
            |&(row, dof, factor): &(usize, usize, f64)| place_of[row / 3].map(|at| (3 * at + row % 3, dof, factor));
        let mut rows: Vec<_> = body.trace().own().iter().filter_map(in_contact).collect();
        rows.sort_by_key(|r| r.0);
        let (stiffness, mass) = (body.stiffness().operator(world), body.mass().operator(world));
        let own = body.damping().map(|c| c.operator(world));
        let modal = match (place.modal.is_empty() && place.spin.is_none(), modes.get(index)) {
            (true, _) => None,
            (_, None) => return Err(Error::Defect("full stability: no modes to damp or to turn".into())),
            (_, Some(modes)) => {
                let twin = earlier.iter().filter(|p| p.index == index).find_map(|p| p.modal.as_ref());
                let loads = twin.map_or_else(|| ModalTerms::loads(world, &mass, modes), |twin| Rc::clone(&twin.loads));
                Some(ModalTerms::new(loads, modes, place)?)
            }
        };
        let modes = modes.get(index).copied().filter(|_| modal.is_some());
        let turning = place.spin.as_ref().map(|spin| RotationOperators::new(world, spin));
        let first = earlier.iter().map(FullBody::len).sum();
        let side = Side::BOTH[earlier.len().min(1)];
        Ok(Self { body, side, stiffness, mass, damping, own, modal, modes, turning, index, rows, first })
    }

    /// Its local unknowns.
    pub fn len(&self) -> usize {
        self.body.stiffness().n_local()
    }

    /// Its rows of a local vector.
    pub fn local_rows<'v>(&self, x: &'v [C]) -> &'v [C] {
        &x[self.first..self.first + self.len()]
    }

    /// This rank's entries of Y: (row of the coupling, local degree of freedom, coefficient).
    pub fn rows(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.rows.iter().map(|&(row, dof, factor)| (row, dof, self.side.sign(row) * factor))
    }

    /// Collective: bounds of the norms of its K, C and M by row sums.
    pub fn norms(&self, world: &World) -> [f64; 3] {
        let k = self.stiffness.matrix().norm_inf(world);
        let m = self.mass.matrix().norm_inf(world);
        let modal = self.modal.as_ref().map_or([0.0; 2], |d| d.norms(world));
        let own = self.own.as_ref().map_or(0.0, |c| c.matrix().norm_inf(world));
        [k + modal[0], self.damping.alpha.abs() * m + self.damping.beta.abs() * k + own + modal[1], m]
    }

    /// This rank's rows of it in vectors of `n` rows each.
    pub fn reals(&self, x: &[C], n: usize) -> Reals {
        Reals::from_rows(x, n, self.first..self.first + self.len())
    }

    /// Collective: its matrix of this power of λ times motions.
    pub fn multiply(&self, world: &World, power: usize, u: &Reals) -> Reals {
        let turning = self.turning.as_ref().and_then(|t| t.term(power));
        let mut out = self.multiply_with(world, (power, turning), u);
        if let Some(modal) = &self.modal {
            modal.add(world, power, u, &mut out);
        }
        out
    }

    /// Collective: the transposed matrix times motions: gyroscopic terms are skew, the others of sparse matrices
    /// symmetric.
    pub fn multiply_transposed(&self, world: &World, power: usize, u: &Reals) -> Reals {
        let turned = |(matrix, factor): (_, f64)| (matrix, if power == 1 { -factor } else { factor });
        let turning = self.turning.as_ref().and_then(|t| t.term(power)).map(turned);
        let mut out = self.multiply_with(world, (power, turning), u);
        if let Some(modal) = &self.modal {
            modal.add_transposed(world, power, u, &mut out);
        }
        out
    }

    /// Collective: the matrices of this power of λ but for modal terms, with those of rotation as given, times motions.
    fn multiply_with(
        &self,
        world: &World,
        (power, turning): (usize, Option<(&Operator<'_>, f64)>),
        u: &Reals,
    ) -> Reals {
        let RayleighDamping { alpha, beta } = self.damping;
        let mut terms = match power {
            0 => vec![(&self.stiffness, 1.0)],
            1 => vec![(&self.mass, alpha), (&self.stiffness, beta)],
            _ => vec![(&self.mass, 1.0)],
        };
        terms.extend(self.own.as_ref().filter(|_| power == 1).map(|c| (c, 1.0)));
        terms.extend(turning);
        let mut out = u.zeros();
        for (matrix, factor) in terms.into_iter().filter(|t| t.1 != 0.0) {
            let product = apply(world, matrix, u);
            out.values.iter_mut().zip(&product.values).for_each(|(o, p)| *o += factor * p);
        }
        out
    }

    /// Collective: its matrices of the powers 0, 1, 2 of λ times motions.
    pub fn images(&self, world: &World, u: &Reals) -> [Reals; 3] {
        let RayleighDamping { alpha, beta } = self.damping;
        let (mut stiff, mass) = (apply(world, &self.stiffness, u), apply(world, &self.mass, u));
        let mut damped = u.zeros();
        let rayleigh = stiff.values.iter().zip(&mass.values).map(|(k, m)| beta * k + alpha * m);
        damped.values.iter_mut().zip(rayleigh).for_each(|(d, v)| *d = v);
        let add = |out: &mut Reals, (matrix, factor): (&Operator, f64)| {
            let product = apply(world, matrix, u);
            out.values.iter_mut().zip(&product.values).for_each(|(o, p)| *o += factor * p);
        };
        if let Some(own) = &self.own {
            add(&mut damped, (own, 1.0));
        }
        for (power, out) in [&mut stiff, &mut damped].into_iter().enumerate() {
            if let Some(term) = self.turning.as_ref().and_then(|t| t.term(power)) {
                add(out, term);
            }
            if let Some(modal) = &self.modal {
                modal.add(world, power, u, out);
            }
        }
        [stiff, damped, mass]
    }

    /// Returns whether it rotates.
    pub fn turns(&self) -> bool {
        self.turning.is_some()
    }

    /// Collective: what rotation adds to uᴴ K u of a motion, N/m times the square of its unit.
    pub fn stiffening(&self, world: &World, x: &[C]) -> C {
        let (Some(turning), Some(modal)) = (&self.turning, &self.modal) else { return C::default() };
        let u = self.reals(x, x.len());
        let mut sum = u.zeros();
        modal.add(world, 0, &u, &mut sum);
        let mut product = vec![C::default(); x.len()];
        sum.add_to(C::from(1.0), &mut product, x.len(), self.first);
        if let Some((matrix, factor)) = turning.term(0) {
            apply(world, matrix, &u).add_to(C::from(factor), &mut product, x.len(), self.first);
        }
        world.sum_all(&[x.iter().zip(&product).map(|(u, s)| u.conj() * s).sum()])[0]
    }

    /// Collective: uᴴ C u of its own damping of a motion, N·s/m times the square of its unit.
    pub fn dissipation(&self, world: &World, x: &[C]) -> f64 {
        let u = self.reals(x, x.len());
        let form = |matrix: &Operator| {
            world.sum(u.values.iter().zip(&apply(world, matrix, &u).values).map(|(u, p)| u * p).sum())
        };
        let RayleighDamping { alpha, beta } = self.damping;
        let rayleigh = alpha * form(&self.mass) + beta * form(&self.stiffness);
        let own = self.own.as_ref().map_or(0.0, form);
        rayleigh + own + self.modal.as_ref().map_or(0.0, |d| d.power(world, &u))
    }

    /// Collective: amplitudes Bᵀu of its modal terms of each of the vectors `x` of `n` rows; empty where it has none.
    pub fn amplitudes(&self, world: &World, x: &[C], n: usize) -> Vec<Vec<C>> {
        match &self.modal {
            Some(modal) => modal.amplitudes(world, &self.reals(x, n)),
            None => vec![Vec::new(); x.len() / n],
        }
    }
}

/// Collective: A u.
fn apply(world: &World, matrix: &Operator, u: &Reals) -> Reals {
    let mut out = u.zeros();
    matrix.apply_block(world, &u.values, &mut out.values, u.width());
    out
}
