//! The modes of both bodies, by the functions of which they consist over the contact.

use super::dense_lu::add_product;
use super::pole_sums::PoleSums;
use super::{SpectrumMemory, C, REAL};
use crate::body::ModalMatrix;
use crate::model::{CoupledModel, ModeFactors};
use faer::linalg::solvers::DenseSolveCore;
use faer::Mat;
use std::cell::OnceCell;
use std::rc::Rc;

mod contact_shapes;
mod mode_set;
mod sampled;
use contact_shapes::ContactShapes;
use mode_set::{basis, functions};
pub(super) use sampled::SampledCompliance;

/// Remainder of the shapes of a body once its functions are taken out, over their size.
const ROUNDING: f64 = 1e-13;
/// More functions than this part of the modes are not few.
const FEW: f64 = 0.4;
/// Functions of both bodies together are taken where they are at most this part of those of each by itself.
const SHARED: f64 = 0.75;
/// Coupling of two modes, over their frequencies, that is none.
const COUPLED: f64 = 1e-14;
/// Largest condition of the vectors of coupled modes.
const CONDITION: f64 = 1e9;
/// Groups of coupled modes that are kept for the next state of the same bodies.
const KEPT: usize = 64;

/// A mode by itself.
#[derive(Clone)]
struct SingleMode {
    mode: usize,
    stiffness: f64,
    damping: f64,
}

impl SingleMode {
    /// λ² + cλ + k.
    fn at(&self, lambda: C) -> C {
        lambda * (lambda + self.damping) + self.stiffness
    }
}

/// Modes that damping or rotation couples, by their poles.
struct CoupledModes {
    modes: Vec<usize>,
    own: Rc<ModePoles>,
    /// Coupling of the functions to each of [`ModePoles::terms`], `[terms, functions]`.
    driven: Mat<C>,
}

/// The poles of coupled modes with this stiffness and damping.
pub(super) struct ModePoles {
    stiffness: Mat<f64>,
    damping: Mat<f64>,
    values: Vec<C>,
    /// Poles with Im ≥ 0: one of each conjugate pair.
    terms: Vec<C>,
    /// Amplitudes of the modes for each of these, real parts and then imaginary ones, `[modes, 2 terms]`.
    right: Mat<f64>,
    /// How each of these is read off the modes.
    readings: Vec<Reading>,
    /// Coupling of forces on the modes to each of these, real parts and then imaginary ones, `[2 terms, modes]`.
    onto: Mat<f64>,
}

/// The motion at a pole is a·q + b·λq of the modes: squares of the norms of a and b, and aᴴb.
struct Reading {
    squares: [f64; 2],
    product: C,
}

impl Reading {
    fn of(a: &[C], b: &[C]) -> Self {
        let square = |v: &[C]| v.iter().map(C::norm_sqr).sum();
        Self { squares: [square(a), square(b)], product: a.iter().zip(b).map(|(a, b)| a.conj() * b).sum() }
    }

    /// ‖a + λb‖².
    fn square(&self, lambda: C) -> f64 {
        self.squares[0] + lambda.norm_sqr() * self.squares[1] + 2.0 * (lambda * self.product).re
    }
}

impl ModePoles {
    /// None where the vectors do not tell them apart.
    fn of(stiffness: Mat<f64>, damping: Mat<f64>, memory: &SpectrumMemory) -> Option<Rc<Self>> {
        let same = |p: &&Rc<Self>| p.stiffness == stiffness && p.damping == damping;
        let mut known = memory.poles.borrow_mut();
        // The last ones used stay the longest.
        if let Some(place) = known.iter().position(|p| same(&p)) {
            known[..=place].rotate_right(1);
            return known.first().cloned();
        }
        let s = stiffness.nrows();
        let rate = (0..s).map(|i| stiffness[(i, i)].abs().sqrt()).fold(0.0, f64::max);
        let companion = Mat::from_fn(2 * s, 2 * s, |i, j| match (i < s, j < s) {
            (true, true) => 0.0,
            (true, false) => f64::from(u8::from(i == j - s)),
            (false, true) => -stiffness[(i - s, j)] / (rate * rate),
            (false, false) => -damping[(i - s, j - s)] / rate,
        });
        let eigen = companion.eigen().ok()?;
        let vectors = eigen.U().to_owned();
        let inverse = vectors.partial_piv_lu().inverse();
        if !(vectors.norm_l2() * inverse.norm_l2() < CONDITION) {
            return None;
        }
        let values: Vec<C> = eigen.S().column_vector().iter().map(|v| v * rate).collect();
        let kept: Vec<usize> = (0..values.len()).filter(|&i| values[i].im >= 0.0).collect();
        let t = kept.len();
        let right = Mat::from_fn(s, 2 * t, |i, j| {
            let v = vectors[(i, kept[j % t])];
            if j < t {
                v.re
            } else {
                v.im
            }
        });
        let onto = Mat::from_fn(2 * t, s, |i, j| {
            let v = inverse[(kept[i % t], s + j)] / rate;
            if i < t {
                v.re
            } else {
                v.im
            }
        });
        let reading = |&i: &usize| {
            let part = |first: usize, unit: f64| (0..s).map(|j| inverse[(i, first + j)] / unit).collect::<Vec<C>>();
            Reading::of(&part(0, 1.0), &part(s, rate))
        };
        let readings = kept.iter().map(reading).collect();
        let terms = kept.iter().map(|&i| values[i]).collect();
        let made = Rc::new(Self { stiffness, damping, values, terms, right, readings, onto });
        known.truncate(KEPT - 1);
        known.insert(0, made.clone());
        Some(made)
    }
}

/// The product of a real and a complex matrix.
pub(super) fn real_times(a: &Mat<f64>, b: &Mat<C>) -> Mat<C> {
    let count = b.ncols();
    let parts = Mat::from_fn(b.nrows(), 2 * count, |i, j| if j < count { b[(i, j)].re } else { b[(i, j - count)].im });
    let product = a * parts;
    Mat::from_fn(a.nrows(), count, |i, j| C::new(product[(i, j)], product[(i, count + j)]))
}

/// The modes of a body.
struct ModeSet {
    /// Place of its functions among those of both.
    first: usize,
    functions: usize,
    singles: Vec<SingleMode>,
    /// Amplitudes of the functions in these, `[singles, functions]`.
    amplitudes: Mat<f64>,
    groups: Vec<CoupledModes>,
    terms: PoleSums,
    /// Residues of the modes by themselves, which are symmetric: on and below the diagonal, column by column,
    /// `[functions (functions + 1)/2, singles]`.
    symmetric: Mat<f64>,
    /// Residues of the other terms by columns, `[functions², columns − singles]`.
    residues: Mat<f64>,
}

/// The modes of both.
pub(super) struct ModalCompliance {
    parts: Vec<Rc<ModeSet>>,
    modes: usize,
    /// Number r of functions: those of both bodies one after the other, or those that they share.
    pub rank: usize,
    /// Amplitudes B of the functions in each mode, `[r, modes]`: its rows are of norm 1 and at right angles to each
    /// other.
    basis: Mat<f64>,
    /// Poles with Im > 0 that are hardly more damped than what is listed.
    pub poles: Vec<C>,
    /// More strongly damped poles.
    pub damped: Vec<C>,
    /// Squares of the norms of stiffness K and damping of the modes.
    pub squares: [f64; 2],
    /// B K Bᵀ, `[r, r]`.
    pub stiffness: Mat<f64>,
    of: Given,
    /// The functions at the contact rows, once a state has asked for them.
    on_contact: Rc<OnceCell<ContactShapes>>,
}

/// Inputs from which modes were computed.
struct Given {
    stiffness: ModalMatrix,
    damping: ModalMatrix,
    lower: usize,
    within: f64,
}

impl Given {
    /// True if `bodies` may have these modes, but for their stiffness and damping.
    fn is_of(&self, bodies: &CoupledModel, within: f64) -> bool {
        let order = bodies.stiffness.order();
        self.within == within && self.lower == bodies.lower_modes && self.stiffness.order() == order
    }

    /// True if stiffness and damping of the modes from `first` to before `end`, those of a body, are those of `bodies`.
    fn is_alike(&self, bodies: &CoupledModel, first: usize, end: usize) -> bool {
        let same = |a: &ModalMatrix, b: &ModalMatrix| match (a, b) {
            (ModalMatrix::Diagonal(a), ModalMatrix::Diagonal(b)) => a[first..end] == b[first..end],
            (ModalMatrix::Blocks(a), ModalMatrix::Blocks(b)) if a.len() == 2 && b.len() == 2 => {
                let body = usize::from(first > 0);
                a[body].order() == end - first && a[body] == b[body]
            }
            _ => false,
        };
        same(&self.stiffness, &bodies.stiffness) && same(&self.damping, &bodies.damping)
    }
}

impl ModalCompliance {
    /// Modal sums of `bodies` with the functions of which they consist at these contact rows, and the functions there,
    /// `[3n, r]`, with the poles up to the angle `within`; none where the functions are not few, or a mode by itself
    /// does not oscillate. Those of the last state are taken where they serve.
    pub fn build(
        bodies: &CoupledModel,
        rows: &[usize],
        within: f64,
        memory: &SpectrumMemory,
    ) -> Option<(Rc<Self>, Mat<f64>)> {
        if let Some(factors) = &bodies.functions {
            let made = Rc::new(Self::of_factors(bodies, factors, within, memory)?);
            memory.know(Some(made.clone()));
            let shapes = &factors.functions * (&factors.amplitudes * made.basis.transpose());
            return Some((made, shapes));
        }
        let last = memory.modes().filter(|known| known.of.is_of(bodies, within));
        let (modes, asked) = match last.and_then(|last| last.shapes(bodies, rows, memory).map(|asked| (last, asked))) {
            Some((last, asked)) if last.is_alike(bodies) => (last, asked),
            Some((last, asked)) => {
                let made = Rc::new(last.with_dynamics(bodies, memory)?);
                memory.know(Some(made.clone()));
                (made, asked)
            }
            None => {
                let psi = Mat::from_fn(rows.len(), bodies.omega.len(), |i, j| bodies.modes[(rows[i], j)]);
                let made = Rc::new(Self::new(bodies, &psi, within, memory)?);
                memory.know(Some(made.clone()));
                let asked = &psi * made.basis.transpose();
                (made, asked)
            }
        };
        let mut shapes = Mat::<f64>::zeros(bodies.modes.nrows(), modes.rank);
        for (i, &row) in rows.iter().enumerate() {
            (0..modes.rank).for_each(|j| shapes[(row, j)] = asked[(i, j)]);
        }
        Some((modes, shapes))
    }

    /// Angle up to which [`poles`](Self::poles) are.
    pub fn within(&self) -> f64 {
        self.of.within
    }

    /// The functions at these contact rows of `bodies`; none where the modes consist of others as well there.
    fn shapes(&self, bodies: &CoupledModel, rows: &[usize], memory: &SpectrumMemory) -> Option<Mat<f64>> {
        let ends = [0, self.of.lower, self.modes];
        let make = || ContactShapes::new(bodies, &self.basis, ends, memory);
        let known = self.on_contact.get_or_init(make);
        let is_known = known.is_of(bodies, rows);
        let computed = if is_known { None } else { Some(make()) };
        let on = computed.as_ref().unwrap_or(known);
        let largest = |of: &Vec<[f64; 2]>, k: usize| rows.iter().map(|&row| of[row][k]).fold(0.0, f64::max).sqrt();
        let covered = on.squares.iter().all(|of| largest(of, 1) <= ROUNDING * largest(of, 0));
        covered.then(|| Mat::from_fn(rows.len(), self.rank, |i, j| on.functions[(rows[i], j)]))
    }

    /// The modes of bodies that share the functions of which their modes were made.
    fn of_factors(bodies: &CoupledModel, factors: &ModeFactors, within: f64, memory: &SpectrumMemory) -> Option<Self> {
        let m = bodies.omega.len();
        let found = functions(factors.amplitudes.clone(), (FEW * m as f64) as usize)?;
        let basis = Mat::from_fn(found.len(), m, |i, j| found[i][j]);
        let blocks = [[0, found.len()]; 2];
        // Places of one body differ by the amplitudes alone.
        let last = memory.modes().filter(|last| last.of.is_of(bodies, within));
        Self::with_basis(bodies, (basis, blocks), (within, last.as_deref()), memory)
    }

    fn new(bodies: &CoupledModel, psi: &Mat<f64>, within: f64, memory: &SpectrumMemory) -> Option<Self> {
        let (m, lower) = (bodies.omega.len(), bodies.lower_modes);
        Self::with_basis(bodies, basis(psi, [(0, lower), (lower, m)])?, (within, None), memory)
    }

    /// The modes with these amplitudes of the functions, of which each body has those from a first one on, so many; a
    /// body with the stiffness and damping of the `last` state has the modes of that.
    fn with_basis(
        bodies: &CoupledModel,
        (basis, blocks): (Mat<f64>, [[usize; 2]; 2]),
        (within, last): (f64, Option<&Self>),
        memory: &SpectrumMemory,
    ) -> Option<Self> {
        let (m, lower) = (bodies.omega.len(), bodies.lower_modes);
        let ends = [(0, lower), (lower, m)];
        let mut parts = Vec::new();
        for (k, ((first, end), [at, count])) in ends.into_iter().zip(blocks).enumerate() {
            let own = (basis.as_ref().subrows(at, count), at);
            let known = last.filter(|last| last.of.is_alike(bodies, first, end));
            parts.push(Rc::new(match known {
                Some(known) => known.parts[k].elsewhere(own),
                None => ModeSet::new(bodies, (first, end), own, memory)?,
            }));
        }
        Self::of_parts(bodies, (parts, within), basis)
    }

    /// True if stiffness and damping of both are those of `bodies`.
    fn is_alike(&self, bodies: &CoupledModel) -> bool {
        let ends = [0, self.of.lower, self.modes];
        ends.windows(2).all(|of| of[0] == of[1] || self.of.is_alike(bodies, of[0], of[1]))
    }

    /// The same modes with stiffness and damping of `bodies`: that of a wheel that rotates has a share of its damping.
    fn with_dynamics(&self, bodies: &CoupledModel, memory: &SpectrumMemory) -> Option<Self> {
        let ends = [0, self.of.lower, self.modes];
        let mut parts = Vec::new();
        for (part, of) in self.parts.iter().zip(ends.windows(2)) {
            parts.push(match of[0] == of[1] || self.of.is_alike(bodies, of[0], of[1]) {
                true => part.clone(),
                false => {
                    let basis = self.basis.as_ref().subrows(part.first, part.functions);
                    Rc::new(ModeSet::new(bodies, (of[0], of[1]), (basis, part.first), memory)?)
                }
            });
        }
        let made = Self::of_parts(bodies, (parts, self.of.within), self.basis.clone())?;
        Some(Self { on_contact: self.on_contact.clone(), ..made })
    }

    /// The modes of both bodies with their amplitudes B of the functions, `[r, modes]`.
    fn of_parts(bodies: &CoupledModel, (parts, within): (Vec<Rc<ModeSet>>, f64), basis: Mat<f64>) -> Option<Self> {
        let (m, lower, rank) = (bodies.omega.len(), bodies.lower_modes, basis.nrows());
        let all = parts.iter().flat_map(|part| part.poles()).filter(|p| p.im >= 0.0);
        let (poles, mut damped): (Vec<C>, Vec<C>) = all.partition(|p| p.im.atan2(p.re) <= within);
        damped.retain(|p| p.im > 0.0);
        if rank == 0 || poles.is_empty() || poles.iter().any(|p| p.im <= REAL * p.norm()) {
            return None;
        }
        let stiffness = &basis * bodies.stiffness.product(basis.transpose());
        let squares = [bodies.stiffness.square(), bodies.damping.square()];
        let of = Given { stiffness: bodies.stiffness.clone(), damping: bodies.damping.clone(), lower, within };
        let on_contact = Rc::default();
        Some(Self { parts, modes: m, rank, basis, poles, damped, squares, stiffness, of, on_contact })
    }

    /// Number of modes.
    pub fn count(&self) -> usize {
        self.modes
    }

    /// Least and largest angular frequency.
    pub fn range(&self) -> [f64; 2] {
        self.poles.iter().fold([f64::INFINITY, 0.0], |[a, b], p| [a.min(p.im), b.max(p.im)])
    }

    /// Start points of the search for the roots: one beside each pole, no two in one place.
    pub fn starts(&self) -> Vec<C> {
        let mut poles = self.poles.clone();
        poles.sort_by(|a, b| a.im.total_cmp(&b.im));
        let place = |i: usize| poles[i.min(poles.len() - 1)].im;
        (0..poles.len())
            .map(|i| {
                let gap = (place(i + 2) - place(i)).max(1e-4 * place(i));
                poles[i] + C::new(-0.02 * gap, (0.2 + 0.05 * (i % 3) as f64) * gap)
            })
            .collect()
    }

    /// Adds K G of r × r matrices given by columns to `out`; G has a block for each body, or one where both bodies
    /// consist of the same functions.
    pub fn add_product(&self, k: &[C], g: &[C], out: &mut [C]) {
        add_product((k, g), self.rank, &self.blocks(), out);
    }

    /// First function and number of functions of each block of G.
    pub fn blocks(&self) -> Vec<[usize; 2]> {
        let mut blocks: Vec<[usize; 2]> = self.parts.iter().map(|p| [p.first, p.functions]).collect();
        blocks.dedup();
        blocks
    }

    /// No more than the squares of the norms of the amplitudes of the modes under the forces on the functions, for
    /// each of `values`.
    pub fn least(&self, values: &[C], forces: &[Vec<C>]) -> Vec<f64> {
        let mut squares = vec![0.0; values.len()];
        for part in &self.parts {
            let forces = part.own(forces);
            let moved = part.motions_of_singles(values, &forces);
            let of_groups = part.groups.iter().map(|g| g.least(values, &forces));
            for (l, square) in squares.iter_mut().enumerate() {
                *square += moved.col(l).squared_norm_l2();
            }
            of_groups.for_each(|of| squares.iter_mut().zip(of).for_each(|(a, b)| *a += b));
        }
        squares
    }

    /// Amplitudes of the modes under the forces on the functions, one list for each of `values`, `[modes, values]`.
    pub fn motions(&self, values: &[C], forces: &[Vec<C>]) -> Mat<C> {
        let mut q = Mat::<C>::zeros(self.modes, values.len());
        let mut put = |modes: &mut dyn Iterator<Item = usize>, moved: &Mat<C>| {
            for (i, mode) in modes.enumerate() {
                (0..values.len()).for_each(|l| q[(mode, l)] = moved[(i, l)]);
            }
        };
        for part in &self.parts {
            let forces = part.own(forces);
            put(&mut part.singles.iter().map(|s| s.mode), &part.motions_of_singles(values, &forces));
            for g in &part.groups {
                put(&mut g.modes.iter().copied(), &g.motions(values, &forces));
            }
        }
        q
    }

    /// Amplitudes of the functions in each mode, `[r, modes]`.
    #[cfg(test)]
    pub(crate) fn contact_basis(&self) -> &Mat<f64> {
        &self.basis
    }

    /// Converts rows per amplitude of the functions to rows per amplitude of the modes, `[rows, modes]`.
    pub fn on_modes(&self, rows: &Mat<f64>) -> Mat<f64> {
        rows * &self.basis
    }

    /// Forces on the modes of forces on the functions, `[modes, values]`.
    pub fn on_modes_of(&self, forces: &Mat<C>) -> Mat<C> {
        real_times(&self.basis.transpose().to_owned(), forces)
    }

    /// Contact values of amplitudes of the modes, `[r, values]`.
    pub fn motions_of(&self, q: &Mat<C>) -> Mat<C> {
        real_times(&self.basis, q)
    }
}
