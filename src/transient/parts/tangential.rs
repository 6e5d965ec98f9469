//! W on the tangential components in single precision, those of each node turned into the direction of its slip.

use pulp::{Arch, Simd, WithSimd};

use super::krylov::conjugate_gradients;
use super::Node;
use crate::contact::law::Status;
use crate::dense::{add_columns, dot};
use crate::transient::compact::Operator;
use crate::transient::problem::Effort;

/// Sine of the angle by which a direction may leave the one that the stored operator was made for, at least, and as a share of what the
/// residual of the linear system falls by.
const TURN: [f64; 2] = [0.005, 1.0];

/// Turns in which tractions follow the motion along the slip, at the most.
const TURNS: usize = 8;

/// The tangential operator on k nodes, in units of that of W. e = (−d_y, d_x) is the direction across d.
pub(super) struct Tangential {
    /// Components x and y of the direction d of each node.
    direction: [Vec<f32>; 2],
    /// W between the components across (first k) and along d (last k), columns, `[2k][2k]`.
    tangential: Vec<f32>,
    /// W from all normal components to the one across d at a node, `[k]`, node after node, then to the ones along, `[2k][k]`.
    coupling: Vec<f32>,
    /// Whether the columns across and along d of a node are made: the ones where it is closed, the others where it sticks, or its motion along d
    /// feeds its traction.
    made: [Vec<bool>; 2],
}

impl Tangential {
    /// The operator `w` for what the map says of the nodes, in the memory of another one.
    pub fn new(w: &Operator, nodes: &[Node], old: Option<Self>) -> Self {
        let k = nodes.len();
        let (mut tangential, mut coupling) = old.map(|o| (o.tangential, o.coupling)).unwrap_or_default();
        // Columns that are not made are met by zeros only.
        tangential.resize(4 * k * k, 0.0);
        coupling.resize(2 * k * k, 0.0);
        let direction = [0, 1].map(|c| nodes.iter().map(|n| n.d[c] as f32).collect());
        let mut new = Self { direction, tangential, coupling, made: [vec![false; k], vec![false; k]] };
        new.complete(w, nodes);
        new
    }

    /// Direction of node `i`.
    pub fn direction(&self, i: usize) -> [f64; 2] {
        [f64::from(self.direction[0][i]), f64::from(self.direction[1][i])]
    }

    /// Follows the nodes: their directions where they have changed by too much for a linear system whose residual falls by `forcing`.
    pub fn follow(&mut self, w: &Operator, nodes: &[Node], forcing: f32) {
        let k = nodes.len();
        let limit = TURN[0].max(TURN[1] * f64::from(forcing));
        let mut changed = Vec::new();
        for (i, node) in nodes.iter().enumerate().filter(|(_, n)| n.status == Status::Slip) {
            let (d, f) = (node.d, self.direction(i));
            if (d[0] * f[1] - d[1] * f[0]).abs() > limit || d[0] * f[0] + d[1] * f[1] < 0.0 {
                (self.direction[0][i], self.direction[1][i]) = (d[0] as f32, d[1] as f32);
                changed.push(i);
            }
        }
        // Rows lie far apart in memory: to renew some is as much work as to renew all columns.
        if 4 * changed.len() > k {
            self.made.iter_mut().for_each(|made| made.fill(false));
            self.complete(w, nodes);
            return;
        }
        changed.iter().for_each(|&i| self.columns(w, i, [true; 2]));
        for own in changed.iter().flat_map(|&i| [i, k + i]) {
            for other in (0..2 * k).filter(|o| self.made[o / k][o % k]) {
                self.tangential[2 * k * other + own] = self.tangential[2 * k * own + other];
            }
        }
        self.complete(w, nodes);
    }

    /// Takes from `rhs`, across and along, what changes of the pressures and of the tractions along the slip do.
    pub fn subtract(&self, nodes: &[Node], along: &[f32], pressure: &[f32], rhs: &mut [f32]) {
        Arch::new().dispatch(Subtract { w: self, nodes, along, pressure, rhs });
    }

    /// The tangential unknowns, N: across at closed nodes, along where they stick. `soft` is added to the diagonal across.
    pub fn solve(&self, nodes: &[Node], soft: &[f32], rhs: &[f32], forcing: f32, effort: &mut Effort) -> Vec<f32> {
        let k = nodes.len();
        let stick: Vec<usize> = (0..k).filter(|&i| nodes[i].status == Status::Stick).collect();
        // Inverse of the diagonal; 0 for what is no unknown.
        let mut scale = vec![0.0f32; 2 * k];
        for (i, _) in nodes.iter().enumerate().filter(|(_, n)| n.status != Status::Open) {
            scale[i] = 1.0 / (self.tangential[(2 * k + 1) * i] + soft[i]);
        }
        for &i in &stick {
            scale[k + i] = 1.0 / self.tangential[(2 * k + 1) * (k + i)];
        }
        // Without nodes in stick the second half has no part.
        let size = if stick.is_empty() { k } else { 2 * k };
        let apply = |v: &[f32], out: &mut [f32]| {
            add_columns(&self.tangential, 2 * k, &v[..k], &mut out[..k]);
            out.iter_mut().zip(soft).zip(v).for_each(|((o, s), v)| *o += s * v);
            Arch::new().dispatch(Sticking { tangential: &self.tangential, nodes: &stick, v, out });
        };
        conjugate_gradients(&rhs[..size], &scale[..size], forcing, apply, effort)
    }

    /// Follows the tractions `along` and the unknowns `found`, which were solved for with a right-hand side of the norm `rhs` and are right where
    /// they do not feed the former, to where `along` has grown by `feed` (1, in the unit of W) times the motion along d at the nodes that slip.
    pub fn feed(
        &self,
        nodes: &[Node],
        feed: &[f32],
        (along, found, pressure): (&mut [f32], &mut [f32], &[f32]),
        (soft, rhs, forcing): (&[f32], f32, f32),
        effort: &mut Effort,
    ) {
        let k = nodes.len();
        let (base, still) = (along.to_vec(), vec![0.0f32; k]);
        let norm = |v: &[f32]| dot(v, v).sqrt();
        // Motion along d, to which unknowns and tractions add as they change.
        let mut moved = vec![0.0f32; k];
        Arch::new().dispatch(Pressed { w: self, nodes, pressure, out: &mut moved });
        self.add_motion(along, found, &mut moved);
        // What has changed since the unknowns were solved for.
        let mut pending = vec![0.0f32; k];
        for _ in 0..TURNS {
            let mut change = vec![0.0f32; k];
            for i in (0..k).filter(|&i| nodes[i].status == Status::Slip) {
                change[i] = base[i] + feed[i] * moved[i] - along[i];
                along[i] += change[i];
                pending[i] += change[i];
            }
            if norm(&change) > forcing * (norm(along) + norm(found)) {
                self.add_motion(&change, &[], &mut moved);
                continue;
            }
            // What they do to the unknowns matters where it is more than what is left of these anyway.
            let mut more = vec![0.0f32; 2 * k];
            self.subtract(nodes, &pending, &still, &mut more);
            let share = forcing * rhs / norm(&more);
            if !(share < 0.5) {
                break;
            }
            let step = self.solve(nodes, soft, &more, share, effort);
            found.iter_mut().zip(&step).for_each(|(f, m)| *f += m);
            self.add_motion(&change, &step, &mut moved);
            pending.fill(0.0);
        }
    }

    /// Adds the motion along d at nodes that slip, under tractions `along` at these and the unknowns `found`, as far as there are any.
    fn add_motion(&self, along: &[f32], found: &[f32], out: &mut [f32]) {
        let k = along.len();
        add_columns(&self.tangential[2 * k * k + k..], 2 * k, along, out);
        if let Some(across) = found.get(..k) {
            add_columns(&self.tangential[k..], 2 * k, across, out);
        }
        // Along d the unknowns of nodes in stick.
        if let Some(stuck) = found.get(k..2 * k) {
            add_columns(&self.tangential[2 * k * k + k..], 2 * k, stuck, out);
        }
    }

    /// Makes the columns that are needed and not made.
    fn complete(&mut self, w: &Operator, nodes: &[Node]) {
        let feeds = nodes.iter().any(|n| n.feed != 0.0);
        for (i, node) in nodes.iter().enumerate() {
            let fed = feeds && node.status == Status::Slip;
            let needed = [node.status != Status::Open, node.status == Status::Stick || fed];
            self.columns(w, i, [0, 1].map(|c| needed[c] && !self.made[c][i]));
        }
    }

    /// Makes the columns of node `i` across d and along, as far as `wanted`.
    fn columns(&mut self, w: &Operator, i: usize, wanted: [bool; 2]) {
        let k = self.made[0].len();
        let direction = [&self.direction[0][..], &self.direction[1][..]];
        let [dx, dy] = direction.map(|d| d[i]);
        let columns = [w.tangential(i, 0), w.tangential(i, 1)];
        for (c, factors) in [[-dy, dx], [dx, dy]].into_iter().enumerate().filter(|&(c, _)| wanted[c]) {
            let own = k * c + i;
            Arch::new().dispatch(Column {
                columns,
                factors,
                direction,
                tangential: &mut self.tangential[2 * k * own..][..2 * k],
                coupling: &mut self.coupling[k * own..][..k],
            });
            self.made[c][i] = true;
        }
    }
}

/// The response to one tangential direction at a node.
struct Column<'a> {
    /// Columns x and y of W at the node, rows x, y and n, `[3][k]`, and what each of them takes part with.
    columns: [&'a [f32]; 2],
    factors: [f32; 2],
    direction: [&'a [f32]; 2],
    /// Across and along at all nodes, `[2k]`.
    tangential: &'a mut [f32],
    /// Gaps of all nodes, `[k]`.
    coupling: &'a mut [f32],
}

impl WithSimd for Column<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let ([dx, dy], [a, b], [f, g]) = (self.direction, self.columns, self.factors);
        let k = dx.len();
        // Plain indices into lists of one length: the compiler turns these into vector instructions.
        let (across, along) = self.tangential.split_at_mut(k);
        let (across, along, gap) = (&mut across[..k], &mut along[..k], &mut self.coupling[..k]);
        let (dx, dy) = (&dx[..k], &dy[..k]);
        let ([ax, ay, an], [bx, by, bn]) = ([0, 1, 2].map(|r| &a[k * r..][..k]), [0, 1, 2].map(|r| &b[k * r..][..k]));
        for j in 0..k {
            let (x, y) = (f * ax[j] + g * bx[j], f * ay[j] + g * by[j]);
            across[j] = dx[j] * y - dy[j] * x;
            along[j] = dx[j] * x + dy[j] * y;
            gap[j] = f * an[j] + g * bn[j];
        }
    }
}

/// What the components along of sticking `nodes` do and what is done to them.
struct Sticking<'a> {
    tangential: &'a [f32],
    nodes: &'a [usize],
    v: &'a [f32],
    out: &'a mut [f32],
}

impl WithSimd for Sticking<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let k = self.out.len() / 2;
        for &i in self.nodes {
            let column = &self.tangential[2 * k * (k + i)..][..2 * k];
            let factor = self.v[k + i];
            self.out[..k].iter_mut().zip(column).for_each(|(o, w)| *o += factor * w);
            self.out[k + i] = dot(column, self.v);
        }
    }
}

/// See [`Tangential::subtract`].
struct Subtract<'a> {
    w: &'a Tangential,
    nodes: &'a [Node],
    along: &'a [f32],
    pressure: &'a [f32],
    rhs: &'a mut [f32],
}

impl WithSimd for Subtract<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let k = self.nodes.len();
        let pressed = self.pressure.iter().any(|q| *q != 0.0);
        for part in [0, 1] {
            for (i, node) in self.nodes.iter().enumerate() {
                if node.status == Status::Stick || (part == 0 && node.status == Status::Slip) {
                    let own = k * part + i;
                    // The operator is symmetric: rows along of a column are the columns along in that row.
                    let row = &self.w.tangential[2 * k * own + k..][..k];
                    self.rhs[own] -= dot(row, self.along);
                    if pressed {
                        self.rhs[own] -= dot(&self.w.coupling[k * own..][..k], self.pressure);
                    }
                }
            }
        }
    }
}

/// Motion along d of the nodes that slip, under changes of the pressures.
struct Pressed<'a> {
    w: &'a Tangential,
    nodes: &'a [Node],
    pressure: &'a [f32],
    out: &'a mut [f32],
}

impl WithSimd for Pressed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let k = self.nodes.len();
        for (i, _) in self.nodes.iter().enumerate().filter(|(_, n)| n.status == Status::Slip) {
            self.out[i] = dot(&self.w.coupling[k * (k + i)..][..k], self.pressure);
        }
    }
}
