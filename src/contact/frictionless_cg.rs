//! The frictionless normal problem to some digits, as a start: conjugate gradients on the closed nodes, which change
//! in between (I. A. Polonsky and L. M. Keer, Wear 231 (1999); E. A. H. Vollebregt, J. Tribol. 136 (2014)),
//! preconditioned by the factor of a first guess of the contact or by the inverse of the spectrum.

use super::influence::Influence;
use super::linear::{ComponentProduct, NormalBlock, NormalFactor, LARGE};
use super::loads::{Loads, NormalLoad};
use super::normal::{first_guess, NormalSolution};
use crate::dense::{add_scattered, dot};
use crate::grid::{ContactPatch, Interface};
use crate::model::Convolution;

/// Residual at which it is good enough, as a part of the approach.
const ENOUGH: f64 = 1e-4;
/// Residual on the closed nodes at which these are looked at again.
const STEP: f64 = 0.03;
/// Products after which nodes that come and go are left to Newton's method.
const PATIENCE: usize = 40;
/// Products after which it is given up.
const LIMIT: usize = 300;

/// A normal problem on the way to its solution.
pub(super) struct FrictionlessSolution<'a, 's> {
    s: &'s Interface,
    patch: &'s ContactPatch,
    load: NormalLoad,
    /// Gaps of `nodes`, m, `[m]`.
    gap: Vec<f64>,
    /// Nodes that may close, ascending, `[m]`.
    nodes: Vec<usize>,
    /// Nodes of the first guess, `[k]`.
    guess: Vec<usize>,
    factor: NormalFactor<'a>,
    product: Compliance<'a>,
    /// Which of `nodes` are closed, `[m]`.
    closed: Vec<bool>,
    /// Forces, N, `[m]`, and what they displace, m, `[m]`.
    force: Vec<f64>,
    moved: Vec<f64>,
    approach: f64,
    products: usize,
}

/// W_nn of the nodes that may close.
enum Compliance<'a> {
    /// Column after column, over the number beside it, m/N.
    Dense(Vec<f32>, f64),
    Convolution(&'a Convolution, Box<ComponentProduct<'a>>),
}

impl<'a, 's> FrictionlessSolution<'a, 's> {
    /// At the first guess on the one patch that there is; none where there are several, or no guess that is sound.
    pub fn new(w: Influence<'a>, s: &'s Interface, loads: &Loads) -> Option<Self> {
        let (patch, load) = s.only().zip(loads.of_one_patch())?;
        let guess = first_guess(w, s, loads);
        if guess.len() < 4 {
            return None;
        }
        let entry = |i: usize, j: usize| w.get(3 * i + 2, 3 * j + 2);
        let nodes = near(patch, &guess);
        let large = guess.len() > LARGE;
        let (product, factor) = match w {
            Influence::Convolution(c) if large => (
                Compliance::Convolution(c, Box::new(ComponentProduct::new(c.fast(), s.len()))),
                NormalFactor::of_spectrum(c),
            ),
            _ => {
                let m = nodes.len();
                let unit = nodes.iter().map(|&i| entry(i, i).abs()).fold(f64::MIN_POSITIVE, f64::max);
                let mut values = vec![0.0f32; m * m];
                for (j, column) in values.chunks_exact_mut(m).enumerate() {
                    column.iter_mut().zip(&nodes).for_each(|(v, &i)| *v = (entry(i, nodes[j]) / unit) as f32);
                }
                let place: Vec<usize> = guess.iter().filter_map(|i| nodes.binary_search(i).ok()).collect();
                let of = |i: usize, j: usize| f64::from(values[m * place[j] + place[i]]) * unit;
                let factor = NormalFactor::of_dense(guess.len(), of).ok()?;
                (Compliance::Dense(values, unit), factor)
            }
        };
        let m = nodes.len();
        let closed: Vec<bool> = nodes.iter().map(|i| guess.binary_search(i).is_ok()).collect();
        let gap = nodes.iter().map(|&i| s.gap[i]).collect();
        let approach = if let NormalLoad::Approach(d) = load { d } else { 0.0 };
        let mut new = Self {
            s,
            patch,
            load,
            gap,
            nodes,
            guess,
            factor,
            product,
            closed,
            force: vec![0.0; m],
            moved: vec![0.0; m],
            approach,
            products: 0,
        };
        new.begin();
        Some(new)
    }

    /// Takes other gaps, m, of all nodes, `[n]`.
    pub fn set_gap(&mut self, gap: &[f64]) {
        self.gap = self.nodes.iter().map(|&i| gap[i]).collect();
    }

    /// Preconditioner for Newton's method.
    pub fn block(self) -> NormalBlock<'a> {
        NormalBlock::new(self.factor, self.guess)
    }

    /// The solution, from the one before where there was one; none where it does not settle, or reaches nodes that
    /// were left out.
    pub fn settle(&mut self) -> Option<NormalSolution> {
        let m = self.nodes.len();
        self.products = 0;
        while self.products < LIMIT {
            let off = self.descend()?;
            // Which pull, and which of the others penetrate.
            let mut changed = 0;
            let allowed = 0.3 * ENOUGH * self.approach.abs();
            let mut pulled = false;
            for k in 0..m {
                if self.closed[k] && self.force[k] <= 0.0 {
                    (self.closed[k], self.force[k], pulled) = (false, 0.0, true);
                    changed += 1;
                } else if !self.closed[k] && self.gap(k) < -allowed {
                    self.closed[k] = true;
                    changed += 1;
                }
            }
            // Some at the edge may come and go by rounding.
            let few = self.products > PATIENCE && 100 * changed <= m;
            if (changed == 0 && off <= ENOUGH) || (few && off <= 30.0 * ENOUGH) {
                return self.found();
            }
            if pulled {
                if let NormalLoad::Force(f) = self.load {
                    let all: f64 = self.force.iter().sum();
                    if !(all > 0.0) {
                        return None;
                    }
                    self.force.iter_mut().for_each(|v| *v *= f / all);
                }
                self.moved = self.times(&self.force.clone());
            }
        }
        None
    }

    fn found(&self) -> Option<NormalSolution> {
        let closed: Vec<usize> = (0..self.nodes.len()).filter(|&k| self.closed[k] && self.force[k] > 0.0).collect();
        let solution = NormalSolution {
            force: closed.iter().map(|&k| self.force[k]).collect(),
            closed: closed.iter().map(|&k| self.nodes[k]).collect(),
            motions: vec![self.approach],
        };
        // A node at the edge of those that were looked at has neighbours that were not.
        let all = |i: usize| self.patch.neighbours(i, 1).all(|j| self.nodes.binary_search(&j).is_ok());
        let sound = solution.force.iter().all(|f| f.is_finite()) && solution.closed.iter().all(|&i| all(i));
        (sound && !solution.closed.is_empty()).then_some(solution)
    }

    /// Gap of a node but for the approach, and the gap.
    fn open(&self, k: usize) -> f64 {
        self.gap[k] + self.moved[k]
    }

    fn gap(&self, k: usize) -> f64 {
        self.open(k) - self.approach
    }

    /// Forces that look like Hertz's.
    fn begin(&mut self) {
        let gaps = || (0..self.nodes.len()).filter(|&k| self.closed[k]).map(|k| self.gap[k]);
        let (low, high) = gaps().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), g| (l.min(g), h.max(g)));
        let level = (high - low).max(f64::MIN_POSITIVE) * 1.02;
        for k in 0..self.nodes.len() {
            let depth = 1.0 - (self.gap[k] - low) / level;
            self.force[k] = if self.closed[k] { depth.max(0.0).sqrt() * self.s.weight[self.nodes[k]] } else { 0.0 };
        }
        let all: f64 = self.force.iter().sum();
        let moved = self.times(&self.force.clone());
        let factor = match self.load {
            NormalLoad::Force(f) => f / all,
            // As deep as the deepest node is to be pressed.
            NormalLoad::Approach(d) => {
                let deepest = (0..self.nodes.len()).fold(f64::MIN_POSITIVE, |m, k| f64::max(m, moved[k]));
                (d - low) / deepest
            }
        };
        self.force.iter_mut().for_each(|v| *v *= factor);
        self.moved = moved.iter().map(|v| v * factor).collect();
    }

    /// Conjugate gradients on the closed nodes, their sum of forces kept where it is given; the residual left, as a
    /// part of the approach.
    fn descend(&mut self) -> Option<f64> {
        let closed: Vec<usize> = (0..self.nodes.len()).filter(|&k| self.closed[k]).collect();
        if closed.is_empty() {
            return None;
        }
        let given = matches!(self.load, NormalLoad::Force(_));
        let ones = self.precondition(&closed, &vec![1.0; closed.len()]);
        let total: f64 = ones.iter().sum();
        let mut direction: Vec<f64> = Vec::new();
        let (mut before, mut first) = (0.0, None);
        for _ in 0..20 {
            let mut z = self.precondition(&closed, &closed.iter().map(|&k| -self.open(k)).collect::<Vec<f64>>());
            if given {
                self.approach = -z.iter().sum::<f64>() / total;
            }
            z.iter_mut().zip(&ones).for_each(|(z, o)| *z += self.approach * o);
            let r: Vec<f64> = closed.iter().map(|&k| -self.gap(k)).collect();
            let off = r.iter().fold(0.0f64, |m, v| m.max(v.abs())) / self.approach.abs().max(f64::MIN_POSITIVE);
            let start = *first.get_or_insert(off);
            if off <= ENOUGH || off <= STEP * start {
                return Some(off);
            }
            let now = dot(&z, &r);
            if !(now > 0.0 && now.is_finite()) {
                return None;
            }
            let keep = if direction.is_empty() { 0.0 } else { now / before };
            before = now;
            direction = match direction.is_empty() {
                true => z,
                false => direction.iter().zip(&z).map(|(d, z)| z + keep * d).collect(),
            };
            let mut force = vec![0.0; self.nodes.len()];
            closed.iter().zip(&direction).for_each(|(&k, d)| force[k] = *d);
            let moved = self.times(&force);
            let curvature: f64 = closed.iter().map(|&k| force[k] * moved[k]).sum();
            if !(curvature > 0.0) {
                return None;
            }
            let step = now / curvature;
            for k in 0..self.nodes.len() {
                self.force[k] += step * force[k];
                self.moved[k] += step * moved[k];
            }
        }
        let off = closed.iter().map(|&k| self.gap(k).abs()).fold(0.0, f64::max);
        Some(off / self.approach.abs().max(f64::MIN_POSITIVE))
    }

    /// About the forces that displace the closed nodes by `r`.
    fn precondition(&self, closed: &[usize], r: &[f64]) -> Vec<f64> {
        if let NormalFactor::Spectrum(_) = self.factor {
            let (nodes, mut r): (Vec<usize>, _) = (closed.iter().map(|&k| self.nodes[k]).collect(), r.to_vec());
            self.factor.solve(&nodes, &mut r);
            return r;
        }
        let mut all = vec![0.0; self.guess.len()];
        let place: Vec<_> = closed.iter().map(|&k| self.guess.binary_search(&self.nodes[k]).ok()).collect();
        place.iter().zip(r).for_each(|(place, r)| place.iter().for_each(|&k| all[k] = *r));
        self.factor.solve(&self.guess, &mut all);
        let own = |k: usize, r: f64| match &self.product {
            Compliance::Dense(values, unit) => r / (f64::from(values[k * (self.nodes.len() + 1)]) * unit),
            Compliance::Convolution(..) => 0.0,
        };
        place.iter().zip(r).zip(closed).map(|((place, r), &k)| place.map_or_else(|| own(k, *r), |p| all[p])).collect()
    }

    fn times(&mut self, force: &[f64]) -> Vec<f64> {
        self.products += 1;
        let m = self.nodes.len();
        let size = force.iter().fold(f64::MIN_POSITIVE, |a: f64, v| a.max(v.abs()));
        match &mut self.product {
            Compliance::Dense(values, unit) => {
                let acting = (0..m).filter(|&k| force[k] != 0.0);
                let columns: Vec<_> = acting.map(|k| (&values[k * m..][..m], (force[k] / size) as f32)).collect();
                let mut out = vec![0.0f32; m];
                add_scattered(&columns, &mut out);
                out.iter().map(|&v| f64::from(v) * (size * *unit)).collect()
            }
            Compliance::Convolution(convolution, product) => {
                let mut moved = force.to_vec();
                product.along_n(&self.nodes, &mut moved);
                let mut whole = vec![0.0; 3 * m];
                let forces = self.nodes.iter().zip(force).map(|(&i, &f)| (i, [0.0, 0.0, f]));
                convolution.add_whole(forces, &self.nodes, &mut whole);
                moved.iter_mut().zip(whole.chunks_exact(3)).for_each(|(u, w)| *u += w[2]);
                moved
            }
        }
    }
}

/// The nodes of `set` (ascending) and those about it, ascending: as far as a tenth of its breadth, three at the least.
fn near(patch: &ContactPatch, set: &[usize]) -> Vec<usize> {
    let reach = 3.max((set.len() as f64).sqrt() as usize / 10);
    let mut mark = vec![false; patch.len()];
    for &i in set {
        patch.neighbours(i, reach).for_each(|j| mark[j - patch.first] = true);
    }
    patch.nodes().filter(|i| mark[i - patch.first]).collect()
}
