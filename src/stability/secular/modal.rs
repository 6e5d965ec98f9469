//! The modes of both bodies, by the functions of which they consist over the contact.

use super::{C, REAL};
use crate::body::ModalMatrix;
use crate::model::ModalPair;
use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, MatRef};
use std::cell::RefCell;
use std::rc::Rc;

/// What is left of the shapes of a body once its functions are taken out, over their size.
const ROUNDING: f64 = 1e-13;
/// More functions than this part of the modes are not few.
const FEW: f64 = 0.4;
/// Coupling of two modes, over their frequencies, that is none.
const COUPLED: f64 = 1e-14;
/// Largest condition of the vectors of coupled modes.
const CONDITION: f64 = 1e9;
/// Groups of coupled modes that are kept for the next state of the same bodies.
const KEPT: usize = 64;

/// A mode by itself.
struct Single {
    mode: usize,
    stiffness: f64,
    damping: f64,
    /// Amplitudes of the functions.
    seen: Vec<f64>,
}

impl Single {
    /// λ² + cλ + k.
    fn at(&self, lambda: C) -> C {
        lambda * (lambda + self.damping) + self.stiffness
    }
}

/// Modes that damping or rotation couples, by their poles.
struct Group {
    modes: Vec<usize>,
    own: Rc<Poles>,
    /// What the functions do to each pole, `[poles, functions]`.
    driven: Mat<C>,
}

/// The poles of coupled modes with this stiffness and damping.
struct Poles {
    stiffness: Mat<f64>,
    damping: Mat<f64>,
    values: Vec<C>,
    /// Amplitudes of the modes for each pole, `[modes, poles]`.
    right: Mat<C>,
    /// What forces on the modes do to each pole, `[poles, modes]`.
    onto: Mat<C>,
}

thread_local! {
    /// From one state to the next the bodies are mostly the same.
    static LAST: RefCell<Vec<Rc<Poles>>> = const { RefCell::new(Vec::new()) };
}

impl Poles {
    /// None where the vectors do not tell them apart.
    fn of(stiffness: Mat<f64>, damping: Mat<f64>) -> Option<Rc<Self>> {
        let same = |p: &&Rc<Self>| p.stiffness == stiffness && p.damping == damping;
        if let Some(known) = LAST.with_borrow(|last| last.iter().find(same).cloned()) {
            return Some(known);
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
        let values = eigen.S().column_vector().iter().map(|v| v * rate).collect();
        let right = vectors.subrows(0, s).to_owned();
        let onto = Mat::from_fn(2 * s, s, |i, j| inverse[(i, s + j)] / rate);
        let made = Rc::new(Self { stiffness, damping, values, right, onto });
        LAST.with_borrow_mut(|last| {
            last.truncate(KEPT - 1);
            last.insert(0, made.clone());
        });
        Some(made)
    }
}

/// The modes of a body.
struct Part {
    /// Place of its functions among those of both.
    first: usize,
    functions: usize,
    singles: Vec<Single>,
    groups: Vec<Group>,
    /// Of each single mode and then of each pole by columns, `[functions², terms]`.
    residues: Mat<C>,
}

/// The modes of both.
pub(super) struct Modes {
    parts: Vec<Part>,
    modes: usize,
    /// Number r of functions of both bodies.
    pub seen: usize,
    /// The functions at the contact rows that are asked for, `[3n, r]`.
    pub shapes: Mat<f64>,
    /// Amplitudes of the functions in each mode, `[r, modes]`.
    basis: Mat<f64>,
    /// Poles with Im > 0 that are hardly more damped than what is listed.
    pub poles: Vec<C>,
}

impl Modes {
    /// Those of `bodies` at these contact rows, with the poles up to the angle `within`; none where the functions are not few, or a mode by itself does not
    /// oscillate.
    pub fn new(bodies: &ModalPair, rows: &[usize], within: f64) -> Option<Self> {
        let (m, lower) = (bodies.omega.len(), bodies.lower_modes);
        let psi = bodies.modes.as_ref();
        let mut bases = Vec::new();
        for (first, end) in [(0, lower), (lower, m)] {
            let limit = (FEW * (end - first) as f64) as usize;
            bases.push((
                first,
                functions(Mat::from_fn(rows.len(), end - first, |i, j| psi[(rows[i], first + j)]), limit)?,
            ));
        }
        let seen = bases.iter().map(|b| b.1.len()).sum::<usize>();
        let mut basis = Mat::<f64>::zeros(seen, m);
        let mut at = 0;
        for (first, functions) in &bases {
            for (i, f) in functions.iter().enumerate() {
                f.iter().enumerate().for_each(|(j, v)| basis[(at + i, first + j)] = *v);
            }
            at += functions.len();
        }
        let mut shapes = Mat::<f64>::zeros(psi.nrows(), seen);
        let asked = Mat::from_fn(rows.len(), m, |i, j| psi[(rows[i], j)]) * basis.transpose();
        for (i, &row) in rows.iter().enumerate() {
            (0..seen).for_each(|j| shapes[(row, j)] = asked[(i, j)]);
        }
        let mut parts = Vec::new();
        let mut at = 0;
        for ((first, functions), end) in bases.iter().zip([lower, m]) {
            parts.push(Part::new(bodies, (*first, end), basis.as_ref().subrows(at, functions.len()), at)?);
            at += functions.len();
        }
        let all = parts.iter().flat_map(Part::poles).filter(|p| p.im >= 0.0 && p.im.atan2(p.re) <= within);
        let poles: Vec<C> = all.collect();
        if seen == 0 || poles.is_empty() || poles.iter().any(|p| p.im <= REAL * p.norm()) {
            return None;
        }
        Some(Self { parts, modes: m, seen, shapes, basis, poles })
    }

    /// Number of modes.
    pub fn count(&self) -> usize {
        self.modes
    }

    /// Least and largest angular frequency.
    pub fn range(&self) -> [f64; 2] {
        self.poles.iter().fold([f64::INFINITY, 0.0], |[a, b], p| [a.min(p.im), b.max(p.im)])
    }

    /// Where the search for the roots begins: one beside each pole, no two in one place.
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

    /// K G of r × r matrices given by columns, by rows; G has a block for each body.
    pub fn times(&self, k: &[C], g: &[C]) -> Vec<C> {
        let r = self.seen;
        let mut out = vec![C::default(); r * r];
        for part in &self.parts {
            for j in part.first..part.first + part.functions {
                for l in part.first..part.first + part.functions {
                    let factor = g[j * r + l];
                    for i in 0..r {
                        out[i * r + j] += k[l * r + i] * factor;
                    }
                }
            }
        }
        out
    }

    /// G and dG/dλ at each of `values`, by columns, one after the other, `[r²]` each; and the logarithmic derivative of P.
    pub fn compliance(&self, values: &[C]) -> (Vec<C>, Vec<C>, Vec<C>) {
        let r = self.seen;
        let mut both = [vec![C::default(); r * r * values.len()], vec![C::default(); r * r * values.len()]];
        let mut slopes = vec![C::default(); values.len()];
        for part in &self.parts {
            let f = part.functions;
            let terms = part.residues.ncols();
            let mut shares = [Mat::<C>::zeros(terms, values.len()), Mat::<C>::zeros(terms, values.len())];
            for (l, &lambda) in values.iter().enumerate() {
                let poles = part.groups.iter().flat_map(|g| g.own.values.iter());
                let all = part.singles.iter().map(|s| (s.at(lambda).inv(), 2.0 * lambda + s.damping));
                for (t, (share, slope)) in all.chain(poles.map(|p| ((lambda - p).inv(), C::from(1.0)))).enumerate() {
                    slopes[l] += slope * share;
                    shares[0][(t, l)] = share;
                    shares[1][(t, l)] = -slope * share * share;
                }
            }
            for (out, shares) in both.iter_mut().zip(shares) {
                let product = &part.residues * shares;
                for l in 0..values.len() {
                    for k in 0..f * f {
                        let (i, j) = (part.first + k % f, part.first + k / f);
                        out[l * r * r + j * r + i] = product[(k, l)];
                    }
                }
            }
        }
        let [g, by] = both;
        (g, by, slopes)
    }

    /// Amplitudes of the modes under the forces on the functions, one list for each of `values`, `[modes, values]`.
    pub fn motions(&self, values: &[C], forces: &[Vec<C>]) -> Mat<C> {
        let mut q = Mat::<C>::zeros(self.modes, values.len());
        // What is on a pole hardly moves the contact.
        let off = |v: C, size: f64| if v.norm() < f64::EPSILON * size { C::from(f64::EPSILON * size) } else { v };
        for part in &self.parts {
            for (l, (&lambda, force)) in values.iter().zip(forces).enumerate() {
                let force = &force[part.first..part.first + part.functions];
                for s in &part.singles {
                    let by: C = s.seen.iter().zip(force).map(|(b, f)| b * f).sum();
                    q[(s.mode, l)] = by / off(s.at(lambda), s.stiffness);
                }
            }
            for g in &part.groups {
                let force = Mat::from_fn(part.functions, values.len(), |i, l| forces[l][part.first + i]);
                let mut amplitudes = &g.driven * force;
                for (l, lambda) in values.iter().enumerate() {
                    for (j, pole) in g.own.values.iter().enumerate() {
                        amplitudes[(j, l)] /= off(lambda - pole, pole.norm());
                    }
                }
                let moved = &g.own.right * amplitudes;
                for l in 0..values.len() {
                    g.modes.iter().enumerate().for_each(|(i, &mode)| q[(mode, l)] = moved[(i, l)]);
                }
            }
        }
        q
    }

    /// What the contact sees of amplitudes of the modes, `[r, values]`.
    pub fn seen_of(&self, q: &Mat<C>) -> Mat<C> {
        Mat::from_fn(self.seen, self.modes, |i, j| C::from(self.basis[(i, j)])) * q
    }
}

impl Part {
    /// The modes from `first` to before `end`, whose amplitudes of the functions are in `basis`, `[functions, modes of both]`.
    fn new(bodies: &ModalPair, (first, end): (usize, usize), basis: MatRef<'_, f64>, at: usize) -> Option<Self> {
        let functions = basis.nrows();
        let (mut singles, mut groups) = (Vec::new(), Vec::new());
        for modes in coupled(bodies, first, end) {
            if modes.len() > 1 {
                groups.push(Group::new(bodies, modes, basis)?);
                continue;
            }
            let mode = modes[0];
            let (stiffness, damping) = (bodies.stiffness.get(mode, mode), bodies.damping.get(mode, mode));
            if !(stiffness > 0.0) {
                return None;
            }
            singles.push(Single { mode, stiffness, damping, seen: (0..functions).map(|i| basis[(i, mode)]).collect() });
        }
        let poles = groups.iter().map(|g: &Group| g.own.values.len()).sum::<usize>();
        let mut residues = Mat::<C>::zeros(functions * functions, singles.len() + poles);
        for (t, s) in singles.iter().enumerate() {
            for k in 0..functions * functions {
                residues[(k, t)] = C::from(s.seen[k % functions] * s.seen[k / functions]);
            }
        }
        let mut t = singles.len();
        for g in &groups {
            let moved = Mat::from_fn(functions, g.modes.len(), |i, j| C::from(basis[(i, g.modes[j])])) * &g.own.right;
            for j in 0..g.own.values.len() {
                for k in 0..functions * functions {
                    residues[(k, t)] = moved[(k % functions, j)] * g.driven[(j, k / functions)];
                }
                t += 1;
            }
        }
        Some(Self { first: at, functions, singles, groups, residues })
    }

    fn poles(&self) -> Vec<C> {
        let single = |s: &Single| {
            let half = 0.5 * s.damping;
            let root = C::from(half * half - s.stiffness).sqrt();
            [root - half, -root - half]
        };
        let groups = self.groups.iter().flat_map(|g| g.own.values.iter().copied());
        self.singles.iter().flat_map(single).chain(groups).collect()
    }
}

impl Group {
    fn new(bodies: &ModalPair, modes: Vec<usize>, basis: MatRef<'_, f64>) -> Option<Self> {
        let s = modes.len();
        let block = |of: &ModalMatrix| Mat::from_fn(s, s, |i, j| of.get(modes[i], modes[j]));
        let own = Poles::of(block(&bodies.stiffness), block(&bodies.damping))?;
        let driven = &own.onto * Mat::from_fn(s, basis.nrows(), |i, j| C::from(basis[(j, modes[i])]));
        Some(Self { modes, own, driven })
    }
}

/// The modes from `first` to before `end` in groups that are coupled.
fn coupled(bodies: &ModalPair, first: usize, end: usize) -> Vec<Vec<usize>> {
    let diagonal = |m: &ModalMatrix| matches!(m, ModalMatrix::Diagonal(_));
    if diagonal(&bodies.stiffness) && diagonal(&bodies.damping) {
        return (first..end).map(|i| vec![i]).collect();
    }
    let rate: Vec<f64> = (first..end).map(|i| bodies.stiffness.get(i, i).abs().sqrt()).collect();
    let tied = |i: usize, j: usize| {
        let (a, b) = (rate[i - first], rate[j - first]);
        bodies.stiffness.get(i, j).abs() > COUPLED * a * b || bodies.damping.get(i, j).abs() > COUPLED * (a * b).sqrt()
    };
    let mut left: Vec<usize> = (first..end).collect();
    let mut groups = Vec::new();
    while let Some(start) = left.first().copied() {
        left.remove(0);
        let mut group = vec![start];
        let mut next = 0;
        while next < group.len() {
            let i = group[next];
            let (near, far): (Vec<usize>, Vec<usize>) = left.into_iter().partition(|&j| tied(i, j) || tied(j, i));
            group.extend(near);
            left = far;
            next += 1;
        }
        groups.push(group);
    }
    groups
}

/// Orthonormal functions of the columns that the rows of `shapes` consist of, by elimination of the largest row each time; none where they are more
/// than `limit`.
fn functions(mut shapes: Mat<f64>, limit: usize) -> Option<Vec<Vec<f64>>> {
    let (rows, columns) = (shapes.nrows(), shapes.ncols());
    let mut found: Vec<Vec<f64>> = Vec::new();
    let mut largest = 0.0;
    loop {
        let mut sizes = vec![0.0; rows];
        for j in 0..columns {
            sizes.iter_mut().zip(shapes.col_as_slice(j)).for_each(|(s, v)| *s += v * v);
        }
        let Some(row) = (0..rows).max_by(|&a, &b| sizes[a].total_cmp(&sizes[b])) else { return Some(found) };
        largest = f64::max(largest, sizes[row].sqrt());
        if sizes[row] == 0.0 || sizes[row].sqrt() <= ROUNDING * largest {
            return Some(found);
        }
        if found.len() >= limit {
            return None;
        }
        let mut new: Vec<f64> = (0..columns).map(|j| shapes[(row, j)]).collect();
        for _ in 0..2 {
            for old in &found {
                let product: f64 = old.iter().zip(&new).map(|(a, b)| a * b).sum();
                new.iter_mut().zip(old).for_each(|(a, b)| *a -= product * b);
            }
            let norm = new.iter().map(|v| v * v).sum::<f64>().sqrt();
            new.iter_mut().for_each(|v| *v /= norm);
        }
        let mut along = vec![0.0; rows];
        for (j, n) in new.iter().enumerate() {
            along.iter_mut().zip(shapes.col_as_slice(j)).for_each(|(a, v)| *a += v * n);
        }
        for (j, n) in new.iter().enumerate() {
            shapes.col_as_slice_mut(j).iter_mut().zip(&along).for_each(|(v, a)| *v -= a * n);
        }
        found.push(new);
    }
}
