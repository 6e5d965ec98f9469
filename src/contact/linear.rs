//! The linear systems of Newton's method: the linearised map on the closed nodes, its preconditioner, and their
//! solution.

use std::cell::RefCell;

use faer::linalg::solvers::{Llt, PartialPivLu, Solve};
use faer::{Mat, MatMut, Side};

use super::candidates::{Candidates, Resultant};
use super::krylov::gmres;
use super::law::Tangent;
use super::loads::solve_small;
use super::newton::{node, Iterate, MapData, NewtonEffort, UNIT};
use super::normal::not_definite;
use crate::dense::dot;
use crate::model::{Convolution, Product};
use crate::Result;

/// Closed nodes from which on the normal block of a convolution is not factored.
pub(super) const LARGE: usize = 1500;
/// The normal block is factored anew where more than one in so many of the closed nodes differ from those that it was
/// factored for.
const STALE: usize = 20;

/// Approximate inverse of the normal compliance W_nn of some nodes.
pub(super) enum NormalFactor<'a> {
    /// Cholesky factor of W_nn over the number beside it, m/N.
    Single(Llt<f32>, f64),
    /// The same where single precision does not do.
    Double(Llt<f64>, f64),
    /// By the inverse of the spectrum.
    Spectrum(RefCell<Box<ComponentProduct<'a>>>),
}

/// Products of one component, with what goes in and what comes out, of all nodes, `[n]`.
pub(super) struct ComponentProduct<'a> {
    product: Product<'a, f32>,
    given: Vec<f32>,
    found: Vec<f32>,
}

impl<'a> ComponentProduct<'a> {
    pub fn new(product: Product<'a, f32>, nodes: usize) -> Self {
        Self { product, given: vec![0.0; nodes], found: vec![0.0; nodes] }
    }

    /// The product along n with the values `x` at `nodes`, there, in place; other nodes have none.
    pub fn along_n(&mut self, nodes: &[usize], x: &mut [f64]) {
        let size = x.iter().fold(f64::MIN_POSITIVE, |m: f64, v| m.max(v.abs()));
        self.given.fill(0.0);
        nodes.iter().zip(&*x).for_each(|(&i, v)| self.given[i] = (v / size) as f32);
        self.product.components(&self.given, &mut self.found, &[2]);
        x.iter_mut().zip(nodes).for_each(|(v, &i)| *v = f64::from(self.found[i]) * size);
    }
}

impl<'a> NormalFactor<'a> {
    /// Solver of k nodes whose W_nn has the entries `entry`, on and below the diagonal, m/N.
    pub fn of_dense(k: usize, entry: impl Fn(usize, usize) -> f64) -> Result<Self> {
        let unit = (0..k).map(|i| entry(i, i).abs()).fold(f64::MIN_POSITIVE, f64::max);
        let a = Mat::from_fn(k, k, |i, j| if i >= j { (entry(i, j) / unit) as f32 } else { 0.0 });
        if let Ok(factor) = a.llt(Side::Lower) {
            return Ok(Self::Single(factor, unit));
        }
        let a = Mat::from_fn(k, k, |i, j| if i >= j { entry(i, j) / unit } else { 0.0 });
        Ok(Self::Double(a.llt(Side::Lower).map_err(|_| not_definite())?, unit))
    }

    /// Solver of any nodes of a convolution.
    pub fn of_spectrum(convolution: &'a Convolution) -> Self {
        Self::Spectrum(RefCell::new(Box::new(ComponentProduct::new(
            convolution.inverse_normal(),
            convolution.rows() / 3,
        ))))
    }

    /// Forces, N, that displace the `nodes` that it is of by `r`, m, in place; about.
    pub fn solve(&self, nodes: &[usize], r: &mut [f64]) {
        let size = r.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        if size == 0.0 {
            return;
        }
        let n = r.len();
        match self {
            Self::Single(factor, unit) => {
                let mut b: Vec<f32> = r.iter().map(|v| (v / size) as f32).collect();
                factor.solve_in_place(MatMut::from_column_major_slice_mut(&mut b, n, 1));
                r.iter_mut().zip(b).for_each(|(r, b)| *r = f64::from(b) * (size / unit));
            }
            Self::Double(factor, unit) => {
                factor.solve_in_place(MatMut::from_column_major_slice_mut(r, n, 1));
                r.iter_mut().for_each(|r| *r /= unit);
            }
            Self::Spectrum(product) => product.borrow_mut().along_n(nodes, r),
        }
    }
}

/// Approximate inverse of the scaled normal block of the closed nodes.
#[derive(Default)]
pub(super) struct NormalBlock<'a> {
    factor: Option<NormalFactor<'a>>,
    /// Numbers of the nodes that the factor is of, ascending; where it is of any, none.
    nodes: Vec<usize>,
    /// Which of these each closed node is, `[k]`.
    place: Vec<Option<usize>>,
    /// The closed nodes, as candidates.
    closed: Vec<usize>,
    /// K_nn⁻¹ ∂g/∂d of each motion, `[motions][k]`.
    by_motion: Vec<Vec<f64>>,
}

impl<'a> NormalBlock<'a> {
    /// One with a `factor` of the `nodes` (ascending; none where it is of any).
    pub fn new(factor: NormalFactor<'a>, nodes: Vec<usize>) -> Self {
        Self { factor: Some(factor), nodes, ..Self::default() }
    }

    /// Makes the block that of `closed` (indices into the candidates, which are pressed).
    pub fn update(&mut self, c: &Candidates<'a>, closed: &[usize]) -> Result<()> {
        if self.factor.is_some() && self.closed == closed {
            return Ok(());
        }
        let k = closed.len();
        match c.convolution().filter(|_| k > LARGE) {
            Some(convolution) => {
                if !matches!(self.factor, Some(NormalFactor::Spectrum(_))) {
                    self.factor = Some(NormalFactor::of_spectrum(convolution));
                }
                self.nodes = closed.iter().map(|&a| c.nodes[a]).collect();
            }
            None => {
                let known = closed.iter().filter(|&&a| self.nodes.binary_search(&c.nodes[a]).is_ok()).count();
                let spectrum = matches!(self.factor, Some(NormalFactor::Spectrum(_)));
                if self.factor.is_none() || spectrum || STALE * (self.nodes.len() + k - 2 * known) > k {
                    let entry = |i: usize, j: usize| c.yielding(closed[i], closed[j]);
                    self.factor = Some(NormalFactor::of_dense(k, entry)?);
                    self.nodes = closed.iter().map(|&a| c.nodes[a]).collect();
                }
            }
        }
        self.closed = closed.to_vec();
        self.place = closed.iter().map(|&a| self.nodes.binary_search(&c.nodes[a]).ok()).collect();
        let column = |by: &Vec<f64>| self.solve(c, &closed.iter().map(|&a| by[a]).collect::<Vec<f64>>());
        self.by_motion = c.by_motion.iter().map(column).collect();
        Ok(())
    }

    /// K_nn⁻¹ r, `[k]`, about; the factor is that of the unscaled block.
    fn solve(&self, c: &Candidates, r: &[f64]) -> Vec<f64> {
        let Some(factor) = &self.factor else { return r.to_vec() };
        let mut moved = vec![0.0; self.nodes.len()];
        for ((place, v), &a) in self.place.iter().zip(r).zip(&self.closed) {
            if let Some(k) = *place {
                moved[k] = v / c.rho[a];
            }
        }
        factor.solve(&self.nodes, &mut moved);
        // A node that the factor does not know goes by itself: ρ is the inverse of its own compliance.
        let of = |((place, v), &a): ((&Option<usize>, &f64), &usize)| place.map_or(*v, |k| moved[k] / c.weight[a]);
        self.place.iter().zip(r).zip(&self.closed).map(of).collect()
    }
}

/// A Newton step.
pub(super) struct NewtonStep {
    /// Change of the stresses, `[3m]`.
    pub dx: Vec<f64>,
    /// Change of the motions, `[motions]`.
    pub dd: Vec<f64>,
    /// Change of the displacements that follows, `[3q]`.
    pub du: Vec<f64>,
}

/// The linearised map at an iterate. Unknowns `[3k + motions]`: (δtx, δty, δp) of the closed nodes, then the changes of
/// the rigid motions; those that are prescribed keep the equation δd = 0.
pub(super) struct NewtonSystem<'a, 'w> {
    c: &'a Candidates<'w>,
    closed: &'a [usize],
    tangents: Vec<Tangent>,
    normal: &'a NormalBlock<'w>,
    lines: Vec<Line>,
    /// Part of the pressures of the closed nodes in each resultant, the friction of those that slide included,
    /// `[resultants][k]`.
    bearing: Vec<Vec<f64>>,
    rhs: Vec<f64>,
}

/// The tangential block of the closed nodes of one grid line, or of a part of it, factored.
struct Line {
    first: usize,
    len: usize,
    factor: PartialPivLu<f32>,
}

impl<'a, 'w> NewtonSystem<'a, 'w> {
    /// Linearises at `now` with the closed nodes `closed`, which are pressed, and for which `normal` has been updated.
    pub fn new(
        c: &'a Candidates<'w>,
        law: MapData<'a>,
        now: &Iterate,
        normal: &'a NormalBlock<'w>,
        closed: &'a [usize],
    ) -> Self {
        let k = closed.len();
        let mut tangents = Vec::with_capacity(k);
        let mut rhs = vec![0.0; 3 * k + c.by_motion.len()];
        for (i, &a) in closed.iter().enumerate() {
            let (x, y) = (&now.x[3 * a..3 * a + 3], &now.y[3 * a..3 * a + 3]);
            let node = node(x, y);
            // The normal row closes the gap: the bound of the traction is that of the pressure itself.
            let mut projected = node.project(UNIT, law.friction[a]);
            projected.pressure = x[2].max(0.0);
            let tangent = projected.tangent(&node, 0.0);
            let [along, across] = tangent.rows(node.traction, node.pressure, node.creep);
            rhs[3 * i..3 * i + 3].copy_from_slice(&[-along, -across, -y[2]]);
            tangents.push(tangent);
        }
        c.resultants.iter().for_each(|r| rhs[3 * k + r.motion] = -r.error(&now.x));
        let bearing = |r: &Resultant| -> Vec<f64> {
            let of = |(&a, tangent): (&usize, &Tangent)| {
                let ([x, y, n], t) = (r.share[a], tangent.friction());
                n + x * t[0] + y * t[1]
            };
            closed.iter().zip(&tangents).map(of).collect()
        };
        let bearing = c.resultants.iter().map(bearing).collect();
        let mut creeps = Vec::new();
        let lines = (0..k)
            .collect::<Vec<_>>()
            .chunk_by(|&i, &j| c.line[closed[i]] == c.line[closed[j]])
            .map(|ids| {
                let (first, len) = (ids[0], ids.len());
                let mut block = Mat::<f32>::zeros(2 * len, 2 * len);
                for j in 0..len {
                    for q in 0..2 {
                        c.creep_on_line(&closed[first..first + len], closed[first + j], q, &mut creeps);
                        let column = block.col_as_slice_mut(2 * j + q);
                        for (i, (out, creep)) in column.chunks_exact_mut(2).zip(&creeps).enumerate() {
                            let t = [0, 1].map(|r| f64::from(u8::from(i == j && r == q)));
                            let [u, v] = tangents[first + i].rows(t, 0.0, *creep);
                            (out[0], out[1]) = (u as f32, v as f32);
                        }
                    }
                }
                Line { first, len, factor: block.partial_piv_lu() }
            })
            .collect();
        Self { c, closed, tangents, normal, lines, bearing, rhs }
    }

    /// Solves to the relative residual `tolerance`; None when that fails badly.
    pub fn solve(&self, tolerance: f64, effort: &mut NewtonEffort) -> Option<NewtonStep> {
        let k = self.closed.len();
        let solved = gmres(&self.rhs, tolerance, 200, |r| self.precondition(r), |v| self.apply(v));
        effort.products += solved.products;
        if solved.relative.is_nan() || solved.relative > 0.5 || solved.x.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let mut dx = vec![0.0; 3 * self.c.nodes.len()];
        for (i, &a) in self.closed.iter().enumerate() {
            dx[3 * a..3 * a + 3].copy_from_slice(&solved.x[3 * i..3 * i + 3]);
        }
        Some(NewtonStep { dx, dd: solved.x[3 * k..].to_vec(), du: solved.image })
    }

    /// Linearised map of `v`, and the change of the displacements.
    fn apply(&self, v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let k = self.closed.len();
        let du = self.c.displaced(self.closed, &v[..3 * k]);
        let mut out = vec![0.0; v.len()];
        // Motions that are prescribed stay.
        out[3 * k..].copy_from_slice(&v[3 * k..]);
        self.c.resultants.iter().for_each(|r| out[3 * k + r.motion] = 0.0);
        for (i, &a) in self.closed.iter().enumerate() {
            let t = &v[3 * i..3 * i + 3];
            let mut s = self.c.responds(a, &du);
            for r in &self.c.resultants {
                let [x, y, n] = r.share[a];
                s[2] += self.c.by_motion[r.motion][a] * v[3 * k + r.motion];
                out[3 * k + r.motion] += x * t[0] + y * t[1] + n * t[2];
            }
            let [u, w] = self.tangents[i].rows([t[0], t[1]], t[2], [s[0], s[1]]);
            out[3 * i..3 * i + 3].copy_from_slice(&[u, w, s[2]]);
        }
        (out, du)
    }

    /// Approximate solution for the residual `r`.
    fn precondition(&self, r: &[f64]) -> Vec<f64> {
        let k = self.closed.len();
        let mut out = r.to_vec();
        let p: Vec<f64> = (0..k).map(|i| r[3 * i + 2]).collect();
        let mut p = self.normal.solve(self.c, &p);
        let z = |of: &Resultant| &self.normal.by_motion[of.motion];
        let resultants = &self.c.resultants;
        let mut border: Vec<f64> =
            self.bearing.iter().flat_map(|b| resultants.iter().map(move |of| dot(b, z(of)))).collect();
        let mut d: Vec<f64> =
            self.bearing.iter().zip(resultants).map(|(b, of)| dot(b, &p) - r[3 * k + of.motion]).collect();
        if solve_small(&mut border, &mut d) {
            for (of, d) in resultants.iter().zip(d) {
                p.iter_mut().zip(z(of)).for_each(|(p, z)| *p -= d * z);
                out[3 * k + of.motion] = d;
            }
        }
        let mut t: Vec<f32> = Vec::new();
        for line in &self.lines {
            t.clear();
            for i in line.first..line.first + line.len {
                let [along, across] = self.tangents[i].rows([0.0; 2], p[i], [0.0; 2]);
                t.extend([(r[3 * i] - along) as f32, (r[3 * i + 1] - across) as f32]);
            }
            let n = t.len();
            line.factor.solve_in_place(MatMut::from_column_major_slice_mut(&mut t, n, 1));
            for (i, v) in (line.first..).zip(t.chunks_exact(2)) {
                out[3 * i] = f64::from(v[0]);
                out[3 * i + 1] = f64::from(v[1]);
            }
        }
        for i in 0..k {
            out[3 * i + 2] = p[i];
        }
        out
    }
}
