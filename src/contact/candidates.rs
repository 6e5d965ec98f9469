//! The nodes that may touch, with everything scaled and gathered that Newton's method works on.

use std::cell::RefCell;

use super::influence::Influence;
use super::interface::Upstream;
use super::loads::{LoadedMotion, NormalLoad};
use super::newton::Factors;
use super::steady::SteadyProblem;
use crate::dense::add_scattered;
use crate::model::Convolution;
use crate::{Error, Result};

/// The candidate nodes. The unknowns are their scaled stresses x, `[3m]`; what these do is the displacement u per
/// unit of stress at the nodes that the laws of the candidates see: these themselves, and those upstream of them,
/// `[3q]`.
pub(super) struct Candidates<'a> {
    /// Node numbers, ascending, `[m]`.
    pub nodes: Vec<usize>,
    /// Grid line of each candidate, by its first node, `[m]`.
    pub line: Vec<usize>,
    /// Numbers of the nodes that are seen, ascending, `[q]`.
    pub seen: Vec<usize>,
    /// Place among the candidates of each node of the interface, `[n]`.
    place: Vec<usize>,
    /// Augmentation parameter of the normal law, Pa/m, `[m]`.
    pub rho: Vec<f64>,
    /// Augmentation parameter of the friction law times V, Pa, `[m]`.
    rho_creep: Vec<f64>,
    /// Nodal areas, m², `[m]`.
    pub weight: Vec<f64>,
    /// Scaled rigid creep of the whole creepage and undeformed gap, `[3m]`.
    constant: Vec<f64>,
    /// Derivatives of the gap rows by each scaled motion, `[motions][m]`.
    pub by_motion: Vec<Vec<f64>>,
    /// The motions that are unknown, and the equations of their resultants.
    pub resultants: Vec<Resultant>,
    /// Operator that the creep is taken with.
    upstream: Upstream,
    /// The same at each candidate, by the places of what it sees, scaled, `[m]`.
    terms: Vec<[(usize, f64); 3]>,
    /// Unit of stress, Pa.
    pub unit: f64,
    /// Motion in m per scaled motion.
    motion_unit: f64,
    products: Products<'a>,
    /// Factors of Newton's method.
    pub factors: Factors<'a>,
}

/// The equation Σ share·x = target of an unknown motion.
pub(super) struct Resultant {
    /// Number of the motion.
    pub motion: usize,
    /// Shares of the stresses (tx, ty, p) of the nodes, `[m]`.
    pub share: Vec<[f64; 3]>,
    pub target: f64,
    /// Measure of an error.
    pub scale: f64,
}

impl Resultant {
    /// Error of the scaled stresses `x`, `[3m]`.
    pub fn error(&self, x: &[f64]) -> f64 {
        let of = |(s, x): (&[f64; 3], &[f64])| s[0] * x[0] + s[1] * x[1] + s[2] * x[2];
        self.share.iter().zip(x.chunks_exact(3)).map(of).sum::<f64>() - self.target
    }
}

/// How displacements follow from the stresses, in single precision: products are bound by memory, and a step of
/// Newton's method needs no more digits. What the rounding leaves is removed by exact products.
enum Products<'a> {
    /// Columns of the influence matrix, in pieces of those that came together.
    Columns(Columns<'a>),
    Convolution(&'a Convolution, RefCell<Box<Fast<'a>>>),
}

/// A product by transforms, and the forces and displacements of all nodes.
struct Fast<'a> {
    product: crate::model::Product<'a, f32>,
    force: Vec<f32>,
    displacement: Vec<f32>,
}

/// Columns of W times nodal areas: those of a candidate once it is pressed.
struct Columns<'a> {
    matrix: faer::MatRef<'a, f64>,
    /// Column after column, `[3q]` each, less its mean motion.
    values: Vec<f32>,
    /// The mean motion (x, y, n) of each column: what bodies yield as wholes may be much more than what moves the
    /// nodes against each other.
    mean: Vec<[f64; 3]>,
    /// First column of each candidate, `[m]`.
    first: Vec<Option<usize>>,
}

impl<'a> Candidates<'a> {
    /// Candidates at `nodes`; `stress` (Pa, `[3n]`) sets the unit of stress.
    pub fn new(problem: &SteadyProblem<'a>, upstream: &Upstream, nodes: Vec<usize>, stress: &[f64]) -> Result<Self> {
        let s = problem.interface;
        let m = nodes.len();
        let unit = nodes.iter().map(|&i| stress[3 * i + 2]).fold(0.0, f64::max);
        if !(unit > 0.0 && unit.is_finite()) {
            return Err(Error::Defect("steady contact: Newton's method was started without contact".into()));
        }
        let mut constant = vec![0.0; 3 * m];
        let motions = &problem.loads.motions;
        let mut by_motion = vec![vec![0.0; m]; motions.len()];
        let patch: Vec<usize> = nodes.iter().map(|&i| s.patch_of(i)).collect();
        let reference = problem.rho_normal(nodes[0]);
        let mut rho = vec![0.0; m];
        for (a, &i) in nodes.iter().enumerate() {
            rho[a] = problem.rho_normal(i);
            constant[3 * a + 2] = rho[a] * s.gap[i] / unit;
            for (by, motion) in by_motion.iter_mut().zip(motions) {
                by[a] = -motion.factors[patch[a]] * rho[a] / reference;
            }
        }
        let equation = |(motion, m): (usize, &LoadedMotion)| {
            let NormalLoad::Force(f) = m.load else { return None };
            let row = |(&i, &c): (&usize, &usize)| m.resultant[c].map(|g| g * s.weight[i]);
            let rows = || nodes.iter().zip(&patch).map(row);
            let total: f64 = rows().map(|[x, y, n]| (x * x + y * y + n * n).sqrt()).sum();
            let share = rows().map(|g| g.map(|g| g / total)).collect();
            let part = |f: f64| f / (unit * total);
            let sound = problem.loads.is_unknown(motion) && total > 0.0;
            sound.then(|| Resultant { motion, share, target: part(f), scale: part(problem.loads.scale(motion)) })
        };
        let resultants = motions.iter().enumerate().filter_map(equation).collect();
        let line = nodes.iter().map(|&i| i - s.place(i).1).collect();
        let mut place = vec![usize::MAX; s.len()];
        for &i in &nodes {
            place[i] = 0;
            if !s.are_points() {
                let (_, ix, _) = s.place(i);
                // At the first node of a line the operator looks to the second one.
                (1..=ix.min(2)).for_each(|k| place[i - k] = 0);
                if ix == 0 {
                    place[i + 1] = 0;
                }
            }
        }
        let seen: Vec<usize> = (0..s.len()).filter(|&i| place[i] == 0).collect();
        seen.iter().enumerate().for_each(|(k, &i)| place[i] = k);
        let products = match problem.compliance {
            Influence::Dense(matrix) => {
                Products::Columns(Columns { matrix, values: Vec::new(), mean: Vec::new(), first: vec![None; m] })
            }
            Influence::Convolution(c) => {
                let zeros = vec![0.0; c.rows()];
                let fast = Fast { product: c.fast(), force: zeros.clone(), displacement: zeros };
                Products::Convolution(c, RefCell::new(Box::new(fast)))
            }
        };
        let mut new = Self {
            line,
            seen,
            place,
            rho,
            rho_creep: vec![0.0; m],
            upstream: Upstream { rows: Vec::new() },
            terms: vec![[(0, 0.0); 3]; m],
            weight: nodes.iter().map(|&i| s.weight[i]).collect(),
            nodes,
            constant,
            by_motion,
            resultants,
            unit,
            motion_unit: unit / reference,
            products,
            factors: Factors::default(),
        };
        new.renew(problem, upstream);
        Ok(new)
    }

    /// Takes the creep from another upstream operator; whether that changes it.
    pub fn renew(&mut self, problem: &SteadyProblem<'_>, upstream: &Upstream) -> bool {
        let mut changed = false;
        for (a, &i) in self.nodes.iter().enumerate() {
            if self.upstream.rows.get(i) == Some(&upstream.rows[i]) {
                continue;
            }
            changed = true;
            let rho = problem.rho_tangential(upstream, i);
            self.rho_creep[a] = rho;
            let place = &self.place;
            self.terms[a] = upstream.rows[i].map(|(j, d)| (if d == 0.0 { place[i] } else { place[j] }, d * rho));
        }
        self.upstream.clone_from(upstream);
        if changed {
            self.take_creepage(problem);
        }
        changed
    }

    /// Takes the creepages of `problem`, which has the interface, the load and the influence matrix of the one before.
    pub fn take_creepage(&mut self, problem: &SteadyProblem<'_>) {
        for (a, &i) in self.nodes.iter().enumerate() {
            let rigid = problem.interface.rigid(&problem.kinematics, i);
            for (r, c) in rigid.iter().enumerate() {
                let c = c + self.upstream.derivative(i, |j| problem.interface.shift[j][r]);
                self.constant[3 * a + r] = self.rho_creep[a] * c / self.unit;
            }
        }
    }

    /// Gets ready for products with stresses on the candidates `pressed` (ascending).
    pub fn press(&mut self, pressed: &[usize]) {
        let Products::Columns(columns) = &mut self.products else { return };
        let new: Vec<usize> = pressed.iter().copied().filter(|&a| columns.first[a].is_none()).collect();
        let height = 3 * self.seen.len();
        let begun = columns.values.len();
        columns.values.reserve_exact(3 * new.len() * height);
        columns.values.resize(begun + 3 * new.len() * height, 0.0);
        let values = &mut columns.values[begun..];
        let matrix = columns.matrix;
        for (k, &a) in new.iter().enumerate() {
            columns.first[a] = Some(begun / height + 3 * k);
            for (c, to) in (0..3).zip(values[3 * k * height..].chunks_exact_mut(height)) {
                let column = 3 * self.nodes[a] + c;
                let put = |entry: &dyn Fn(usize) -> [f64; 3], to: &mut [f32]| {
                    let mut mean = [0.0; 3];
                    self.seen.iter().for_each(|&i| mean.iter_mut().zip(entry(i)).for_each(|(m, v)| *m += v));
                    let mean = mean.map(|m| m / self.seen.len() as f64);
                    for (o, &i) in to.chunks_exact_mut(3).zip(&self.seen) {
                        let v = entry(i);
                        (0..3).for_each(|r| o[r] = (self.weight[a] * (v[r] - mean[r])) as f32);
                    }
                    mean.map(|m| self.weight[a] * m)
                };
                columns.mean.push(match matrix.try_as_col_major() {
                    Some(matrix) => {
                        let from = matrix.col(column).as_slice();
                        put(&|i| [from[3 * i], from[3 * i + 1], from[3 * i + 2]], to)
                    }
                    None => put(&|i| [0, 1, 2].map(|r| matrix[(3 * i + r, column)]), to),
                });
            }
        }
    }

    /// Displacements, `[3q]`, under the stresses `x`, `[3k]`, on the candidates `pressed`, `[k]`, for which
    /// [`press`](Self::press) was called; in single precision.
    pub fn displaced(&self, pressed: &[usize], x: &[f64]) -> Vec<f64> {
        match &self.products {
            Products::Columns(columns) => {
                let height = 3 * self.seen.len();
                let mut acting = Vec::with_capacity(x.len());
                let mut mean = [0.0; 3];
                for (v, &a) in x.chunks_exact(3).zip(pressed) {
                    let Some(first) = columns.first[a] else { continue };
                    for c in (0..3).filter(|&c| v[c] != 0.0) {
                        acting.push((&columns.values[(first + c) * height..][..height], v[c] as f32));
                        mean.iter_mut().zip(columns.mean[first + c]).for_each(|(m, w)| *m += w * v[c]);
                    }
                }
                let mut out = vec![0.0f32; height];
                add_scattered(&acting, &mut out);
                out.chunks_exact(3).flat_map(|o| [0, 1, 2].map(|r| mean[r] + f64::from(o[r]))).collect()
            }
            Products::Convolution(convolution, fast) => {
                let fast = &mut **fast.borrow_mut();
                fast.force.fill(0.0);
                for (v, &a) in x.chunks_exact(3).zip(pressed) {
                    let force = &mut fast.force[3 * self.nodes[a]..][..3];
                    force.iter_mut().zip(v).for_each(|(f, v)| *f = (self.weight[a] * v) as f32);
                }
                fast.product.times(&fast.force, &mut fast.displacement);
                let of = |&i: &usize| (3 * i..3 * i + 3).map(|k| f64::from(fast.displacement[k]));
                let mut u: Vec<f64> = self.seen.iter().flat_map(of).collect();
                let forces = pressed
                    .iter()
                    .zip(x.chunks_exact(3))
                    .map(|(&a, v)| (self.nodes[a], [0, 1, 2].map(|c| self.weight[a] * v[c])));
                convolution.add_whole(forces, &self.seen, &mut u);
                u
            }
        }
    }

    /// Displacements as by [`displaced`](Self::displaced) in full precision, under the stresses `x` of all candidates,
    /// `[3m]`.
    pub fn displaced_exactly(&self, problem: &SteadyProblem<'_>, x: &[f64]) -> Vec<f64> {
        let mut forces = vec![0.0; 3 * problem.interface.len()];
        for ((v, &i), weight) in x.chunks_exact(3).zip(&self.nodes).zip(&self.weight) {
            (0..3).for_each(|c| forces[3 * i + c] = weight * v[c]);
        }
        self.of_all(&problem.compliance.multiply(&forces), 1.0)
    }

    /// Observed part of the displacements `all` of all nodes, `[3n]`, times `scale`.
    pub fn of_all(&self, all: &[f64], scale: f64) -> Vec<f64> {
        self.seen.iter().flat_map(|&i| (3 * i..3 * i + 3).map(|k| scale * all[k])).collect()
    }

    /// Displacement along n of candidate `a` per force along n on the candidate `b`, which is pressed, m/N.
    pub fn yielding(&self, a: usize, b: usize) -> f64 {
        match &self.products {
            Products::Columns(columns) => columns.first[b].map_or(0.0, |first| {
                let near = columns.values[(first + 2) * 3 * self.seen.len() + 3 * self.place(a) + 2];
                (f64::from(near) + columns.mean[first + 2][2]) / self.weight[b]
            }),
            Products::Convolution(c, _) => c.get(3 * self.nodes[a] + 2, 3 * self.nodes[b] + 2),
        }
    }

    /// Scaled creep (x, y) of each of the candidates `line` on one grid line, which are pressed, under a stress on
    /// `b`, one of them, along `c`; but for what bodies yield as wholes.
    pub fn creep_on_line(&self, line: &[usize], b: usize, c: usize, out: &mut Vec<[f64; 2]>) {
        out.clear();
        match &self.products {
            Products::Columns(columns) => {
                let Some(first) = columns.first[b] else { return };
                let column = &columns.values[(first + c) * 3 * self.seen.len()..][..3 * self.seen.len()];
                out.extend(line.iter().map(|&a| {
                    let [p, q, r] = self.terms[a];
                    let of = |e: usize| {
                        let at = |(k, d): (usize, f64)| d * f64::from(column[3 * k + e]);
                        at(p) + at(q) + at(r)
                    };
                    [of(0), of(1)]
                }));
            }
            Products::Convolution(convolution, _) => {
                let along = convolution.along(c, self.nodes[b]);
                let weight = self.weight[b];
                out.extend(line.iter().map(|&a| {
                    let mut creep = [0.0; 2];
                    for (k, d) in self.terms[a] {
                        let [x, y] = along[self.seen[k] % convolution.shape()[0]];
                        creep[0] += d * weight * x;
                        creep[1] += d * weight * y;
                    }
                    creep
                }));
            }
        }
    }

    /// Place of candidate `a` among the observed nodes.
    pub fn place(&self, a: usize) -> usize {
        self.place[self.nodes[a]]
    }

    /// The convolution that products are made by, if they are.
    pub fn convolution(&self) -> Option<&'a Convolution> {
        match self.products {
            Products::Columns(_) => None,
            Products::Convolution(c, _) => Some(c),
        }
    }

    /// Change of the scaled creep and gap of candidate `a` by the displacements `u`.
    pub fn responds(&self, a: usize, u: &[f64]) -> [f64; 3] {
        let creep = |r: usize| self.terms[a].iter().map(|&(k, d)| d * u[3 * k + r]).sum::<f64>();
        [creep(0), creep(1), self.rho[a] * u[3 * self.place(a) + 2]]
    }

    /// Change of the scaled gap of candidate `a` by the scaled `motions`, `[motions]`.
    pub fn approached(&self, a: usize, motions: &[f64]) -> f64 {
        self.by_motion.iter().zip(motions).map(|(by, d)| by[a] * d).sum()
    }

    /// Scaled creep and gap of all candidates, `[3m]`, with the displacements `u`, the scaled `motions`, and part of
    /// the creepage.
    pub fn response(&self, u: &[f64], motions: &[f64], creep_factor: f64) -> Vec<f64> {
        let mut y = Vec::with_capacity(3 * self.nodes.len());
        for a in 0..self.nodes.len() {
            let ([sx, sy, g], c) = (self.responds(a, u), &self.constant[3 * a..3 * a + 3]);
            y.extend([sx + creep_factor * c[0], sy + creep_factor * c[1], g + c[2] + self.approached(a, motions)]);
        }
        y
    }

    /// Rigid motions, m, over their unit.
    pub fn scaled(&self, motions: &[f64]) -> Vec<f64> {
        motions.iter().map(|d| d / self.motion_unit).collect()
    }

    /// Scaled rigid motions in m.
    pub fn unscaled(&self, motions: &[f64]) -> Vec<f64> {
        motions.iter().map(|d| d * self.motion_unit).collect()
    }

    /// The upstream operator of the contact with the scaled stresses `x` and `motions`, whose displacements are `u`.
    pub fn upstream_of(&self, problem: &SteadyProblem<'_>, x: &[f64], u: &[f64], motions: &[f64]) -> Upstream {
        let s = problem.interface;
        let mut stress = vec![0.0; 3 * s.len()];
        x.chunks_exact(3).zip(&self.nodes).for_each(|(v, &i)| stress[3 * i + 2] = v[2]);
        let approach = problem.approaches(&self.unscaled(motions));
        let deformed = |i: usize| s.gap[i] - approach[s.patch_of(i)] + self.unit * u[3 * self.place[i] + 2];
        s.edge_upstream(problem.stencil, &stress, deformed)
    }

    /// First guess of the tractions for the pressures in `x`, `[3m]`, whose tractions are zero, by the simplified
    /// theory of rolling contact (J. J. Kalker's FASTSIM, Vehicle System Dynamics 11 (1982)): along each line from the
    /// leading edge on t grows by −ṡ Δx/(V L) and is cut at μp. The flexibility L is the one at which a traction
    /// proportional to the pressure of a patch has on average the gradient of w that it has in truth (`friction`: μ of
    /// each candidate, `[m]`): with w = L t and elliptic stresses, L = −2⟨ṡ x⟩/(V p_max).
    pub fn guess_tractions(&self, problem: &SteadyProblem<'_>, friction: &[f64], x: &mut [f64], y: &[f64]) {
        let m = self.nodes.len();
        let pressed: Vec<usize> = (0..m).filter(|&a| x[3 * a + 2] > 0.0).collect();
        let probe: Vec<f64> = pressed.iter().flat_map(|&a| [x[3 * a + 2], x[3 * a + 2], 0.0]).collect();
        let u = self.displaced(&pressed, &probe);
        let s = problem.interface;
        let position = |a: usize| s.point(self.nodes[a])[0];
        for closed in pressed.chunk_by(|&a, &b| s.patch_of(self.nodes[a]) == s.patch_of(self.nodes[b])) {
            let peak = closed.iter().map(|&a| x[3 * a + 2]).fold(0.0, f64::max);
            let count = closed.len() as f64;
            let centre = closed.iter().map(|&a| position(a)).sum::<f64>() / count;
            let flexibility = [0, 1].map(|c| {
                let of = |&a: &usize| (position(a) - centre) * self.responds(a, &u)[c] / self.rho_creep[a];
                let mean = closed.iter().map(of).sum::<f64>();
                -2.0 * mean / (count * peak)
            });
            if flexibility.iter().any(|l| *l <= 0.0 || !l.is_finite()) {
                continue;
            }
            let mut previous: Option<usize> = None;
            for &a in closed {
                let (t, length) = match previous {
                    Some(b) if self.nodes[a] == self.nodes[b] + 1 && self.line[a] == self.line[b] => {
                        ([x[3 * b], x[3 * b + 1]], position(a) - position(b))
                    }
                    // The edge lies half-way ahead of the first node, more or less.
                    _ => ([0.0; 2], 0.5 * self.weight[a].sqrt()),
                };
                let z = [0, 1].map(|c| t[c] - y[3 * a + c] / self.rho_creep[a] * length / flexibility[c]);
                let z = super::law::project_disc(z, friction[a] * x[3 * a + 2]);
                x[3 * a..3 * a + 2].copy_from_slice(&z);
                previous = Some(a);
            }
        }
    }
}
