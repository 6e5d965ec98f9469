//! W on the tangential components in single precision, those of each node turned into the direction of its slip.

use pulp::{Arch, Simd, WithSimd};

use super::krylov::conjugate_gradients;
use super::natural_map::{those, NaturalMap};
use crate::dense::{add_columns, add_transposed, dot, wide_dot};
use crate::transient::aligned::AlignedVec;
use crate::transient::delassus::DelassusOperator;
use crate::transient::problem::Effort;
use crate::transient::structure_of_arrays::{lane, lanes, lanes_mut, LANES};

/// Sine of the angle by which a direction may leave the one that the stored operator was made for, at least, and as a
/// share of what the residual of the linear system falls by.
const TURN: [f64; 2] = [0.005, 1.0];

/// Turns in which tractions follow the motion along the slip, at the most.
const TURNS: usize = 8;

/// The tangential operator on k nodes in l places, in units of that of W. e = (−d_y, d_x) is the direction across d.
/// Vectors have what is across in the first l places and what is along d in the last l; places without a node hold
/// zeros.
pub(super) struct TangentialProblem {
    /// k.
    nodes: usize,
    /// Components x and y of the direction d of each node, `[l]`.
    direction: [AlignedVec<f32>; 2],
    /// W between the components across (first k columns) and along d (last k), columns, `[2k][2l]`.
    tangential: AlignedVec<f32>,
    /// W from all normal components to the one across d at a node, `[l]`, node after node, then to the ones along,
    /// `[2k][l]`.
    coupling: AlignedVec<f32>,
    /// Its diagonal across and along d, as far as the columns are made, `[l]` each.
    diagonal: [AlignedVec<f32>; 2],
    /// 1 where the columns across and along d of a node are made, else 0, `[l]`: the ones where it is closed, the
    /// others where it sticks, or its motion along d feeds its traction.
    made: [AlignedVec<f32>; 2],
}

/// Natural map of the nodes, and those of them that stick, ascending.
pub(super) type MapAndStick<'a> = (&'a NaturalMap, &'a [usize]);

impl TangentialProblem {
    /// The operator `w` for what the map says of the nodes, in the memory of another one.
    pub fn new(w: &DelassusOperator, seen: &NaturalMap, old: Option<Self>) -> Self {
        let (k, l) = (w.size() / 3, w.places());
        let (tangential, coupling) = old.map(|o| (o.tangential, o.coupling)).unwrap_or_default();
        // Columns that are not made are met by zeros only.
        let (tangential, coupling) = (tangential.resized(4 * k * l), coupling.resized(2 * k * l));
        let direction = [0, 1].map(|c| AlignedVec::from(seen.direction[c].iter().map(|d| *d as f32)));
        let [diagonal, made] = [0, 1].map(|_| [AlignedVec::zeros(l), AlignedVec::zeros(l)]);
        let mut new = Self { nodes: k, direction, tangential, coupling, diagonal, made };
        new.complete(w, seen);
        new
    }

    /// Components x and y of the directions d, `[l]` each.
    pub fn directions(&self) -> [&[f32]; 2] {
        [&self.direction[0], &self.direction[1]]
    }

    /// Follows the nodes: their directions where they have changed by too much for a linear system whose residual
    /// falls by `forcing`.
    pub fn follow(&mut self, w: &DelassusOperator, seen: &NaturalMap, forcing: f32) {
        let (k, l) = (self.nodes, w.places());
        let mut turned = AlignedVec::zeros(l);
        let limit = TURN[0].max(TURN[1] * f64::from(forcing));
        Arch::new().dispatch(Turned { seen, direction: self.directions(), limit, turned: &mut turned });
        let changed = those(k, |i| turned[i] > 0.0);
        for &i in &changed {
            (0..2).for_each(|c| self.direction[c][i] = seen.direction[c][i] as f32);
        }
        // Rows lie far apart in memory: to renew some is as much work as to renew all columns.
        if 4 * changed.len() > k {
            self.made.iter_mut().for_each(|made| made.fill(0.0));
            self.complete(w, seen);
            return;
        }
        changed.iter().for_each(|&i| self.columns(w, i, [true; 2]));
        let stride = 2 * l;
        for (own, i) in [0, 1].into_iter().flat_map(|own| changed.iter().map(move |&i| (own, i))) {
            for (other, made) in self.made.iter().enumerate() {
                for j in (0..k).filter(|&j| made[j] > 0.0) {
                    self.tangential[stride * (k * other + j) + l * own + i] =
                        self.tangential[stride * (k * own + i) + l * other + j];
                }
            }
        }
        self.complete(w, seen);
    }

    /// Takes from `rhs`, across and along, what changes of the pressures and of the tractions along the slip do.
    pub fn subtract(&self, (seen, stick): MapAndStick<'_>, along: &[f32], pressure: &[f32], rhs: &mut [f32]) {
        let (k, l) = (self.nodes, along.len());
        let pressed = pressure.iter().any(|q| *q != 0.0);
        // The operator is symmetric: rows along of a column are the columns along in that row.
        let mut across = AlignedVec::zeros(l);
        if let Some(rows) = self.tangential.get(l..) {
            add_transposed(rows, 2 * l, along, &mut across[..k]);
        }
        if pressed {
            add_transposed(&self.coupling, l, pressure, &mut across[..k]);
        }
        let closed = seen.closed.iter().zip(across.iter());
        rhs.iter_mut().zip(closed).for_each(|(r, (closed, a))| *r -= if *closed > 0.0 { *a } else { 0.0 });
        for &i in stick {
            rhs[l + i] -= wide_dot(&self.tangential[2 * l * (k + i) + l..][..l], along);
            if pressed {
                rhs[l + i] -= wide_dot(&self.coupling[l * (k + i)..][..l], pressure);
            }
        }
    }

    /// The tangential unknowns, N: across at closed nodes, along where they stick, `[2l]`, or `[l]` where none
    /// sticks. `soft` is added to the diagonal across.
    pub fn solve(
        &self,
        (seen, stick): MapAndStick<'_>,
        soft: &[f32],
        rhs: &[f32],
        forcing: f32,
        effort: &mut Effort,
    ) -> AlignedVec<f32> {
        let (k, l) = (self.nodes, soft.len());
        // Inverse of the diagonal; 0 for what is no unknown.
        let mut scale = AlignedVec::zeros(2 * l);
        let parts = seen.closed.iter().zip(self.diagonal[0].iter().zip(soft));
        for (s, (closed, (d, soft))) in scale.iter_mut().zip(parts) {
            *s = if *closed > 0.0 { 1.0 / (d + soft) } else { 0.0 };
        }
        for &i in stick {
            scale[l + i] = 1.0 / self.diagonal[1][i];
        }
        // Without nodes in stick the second half has no part.
        let size = if stick.is_empty() { l } else { 2 * l };
        let apply = |v: &[f32], out: &mut [f32]| {
            add_columns(&self.tangential, 2 * l, &v[..k], &mut out[..l]);
            out.iter_mut().zip(soft).zip(v).for_each(|((o, s), v)| *o += s * v);
            Arch::new().dispatch(Sticking { tangential: &self.tangential, count: k, nodes: stick, v, out });
        };
        conjugate_gradients(&rhs[..size], &scale[..size], forcing, apply, effort)
    }

    /// Follows the tractions `along` and the unknowns `found`, which were solved for with a right-hand side of the
    /// norm `rhs` and are right where they do not feed the former, to where `along` has grown by `feed` (1, in the
    /// unit of W) times the motion along d at the nodes that slip.
    pub fn feed(
        &self,
        known: MapAndStick<'_>,
        feed: &[f32],
        (along, found, pressure): (&mut [f32], &mut [f32], &[f32]),
        (soft, rhs, forcing): (&[f32], f32, f32),
        effort: &mut Effort,
    ) {
        let ((seen, _), l) = (known, along.len());
        let (base, still) = (along.to_vec(), AlignedVec::zeros(l));
        let norm = |v: &[f32]| dot(v, v).sqrt();
        // Motion along d, to which unknowns and tractions add as they change.
        let mut moved = AlignedVec::zeros(l);
        Arch::new().dispatch(Pressed { w: self, slips: &seen.slips, pressure, out: &mut moved });
        self.add_motion(along, found, &mut moved);
        // What has changed since the unknowns were solved for.
        let mut pending = AlignedVec::zeros(l);
        for _ in 0..TURNS {
            let mut change = AlignedVec::zeros(l);
            for i in (0..l).filter(|&i| seen.slips[i] > 0.0) {
                change[i] = base[i] + feed[i] * moved[i] - along[i];
                along[i] += change[i];
                pending[i] += change[i];
            }
            if norm(&change) > forcing * (norm(along) + norm(found)) {
                self.add_motion(&change, &[], &mut moved);
                continue;
            }
            // What they do to the unknowns matters where it is more than what is left of these anyway.
            let mut more = AlignedVec::zeros(2 * l);
            self.subtract(known, &pending, &still, &mut more);
            let share = forcing * rhs / norm(&more);
            if !(share < 0.5) {
                break;
            }
            let step = self.solve(known, soft, &more, share, effort);
            found.iter_mut().zip(step.iter()).for_each(|(f, m)| *f += m);
            self.add_motion(&change, &step, &mut moved);
            pending.fill(0.0);
        }
    }

    /// Adds the motion along d at nodes that slip, under tractions `along` at these and the unknowns `found`, as far
    /// as there are any.
    fn add_motion(&self, along: &[f32], found: &[f32], out: &mut [f32]) {
        let (k, l) = (self.nodes, along.len());
        add_columns(&self.tangential[2 * l * k + l..], 2 * l, &along[..k], out);
        if let Some(across) = found.get(..k) {
            add_columns(&self.tangential[l..], 2 * l, across, out);
        }
        // Along d the unknowns of nodes in stick.
        if let Some(stuck) = found.get(l..l + k) {
            add_columns(&self.tangential[2 * l * k + l..], 2 * l, stuck, out);
        }
    }

    /// Makes the columns that are needed and not made.
    fn complete(&mut self, w: &DelassusOperator, seen: &NaturalMap) {
        let free = if seen.feed.is_empty() { 1.0 } else { 0.0 };
        let across = those(self.nodes, |i| seen.closed[i] > self.made[0][i]);
        across.into_iter().for_each(|i| self.columns(w, i, [true, false]));
        let along = those(self.nodes, |i| seen.closed[i] - free * seen.slips[i] > self.made[1][i]);
        along.into_iter().for_each(|i| self.columns(w, i, [false, true]));
    }

    /// Makes the columns of node `i` across d and along, as far as `wanted`.
    fn columns(&mut self, w: &DelassusOperator, i: usize, wanted: [bool; 2]) {
        let (k, l) = (self.nodes, w.places());
        let direction = [&self.direction[0][..], &self.direction[1][..]];
        let [dx, dy] = direction.map(|d| d[i]);
        let columns = [w.tangential(i, 0), w.tangential(i, 1)];
        for (c, factors) in [[-dy, dx], [dx, dy]].into_iter().enumerate().filter(|&(c, _)| wanted[c]) {
            let own = k * c + i;
            let tangential = &mut self.tangential[2 * l * own..][..2 * l];
            let coupling = &mut self.coupling[l * own..][..l];
            Arch::new().dispatch(Column { columns, factors, direction, tangential, coupling });
            self.diagonal[c][i] = tangential[l * c + i];
            self.made[c][i] = 1.0;
        }
    }
}

/// Which nodes slip in a direction that has left the one the operator was made for.
struct Turned<'a> {
    seen: &'a NaturalMap,
    direction: [&'a [f32]; 2],
    /// Sine of the angle by which it may.
    limit: f64,
    /// 1 or 0, `[l]`.
    turned: &'a mut [f32],
}

impl WithSimd for Turned<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { seen, direction, limit, turned } = self;
        let blocks = turned.len() / LANES;
        let [dx, dy] = [0, 1].map(|c| lanes(&seen.direction[c], blocks));
        let [fx, fy, slips] = [direction[0], direction[1], &seen.slips].map(|row| lanes(row, blocks));
        let turned = lanes_mut(turned, blocks);
        for b in 0..blocks {
            let (dx, dy, slips) = (dx[b], dy[b], slips[b]);
            let (fx, fy) = (fx[b].map(f64::from), fy[b].map(f64::from));
            let sine = lane(|k| (dx[k] * fy[k] - dy[k] * fx[k]).abs());
            let cosine = lane(|k| dx[k] * fx[k] + dy[k] * fy[k]);
            turned[b] = lane(|k| if (sine[k] > limit) | (cosine[k] < 0.0) { slips[k] } else { 0.0 });
        }
    }
}

/// The response to one tangential direction at a node.
struct Column<'a> {
    /// Columns x and y of W at the node, rows x, y and n, `[3][l]`, and what each of them takes part with.
    columns: [&'a [f32]; 2],
    factors: [f32; 2],
    direction: [&'a [f32]; 2],
    /// Across and along at all nodes, `[2l]`.
    tangential: &'a mut [f32],
    /// Gaps of all nodes, `[l]`.
    coupling: &'a mut [f32],
}

impl WithSimd for Column<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let ([dx, dy], [a, b], [f, g]) = (self.direction, self.columns, self.factors);
        let l = dx.len();
        // Plain indices into lists of one length: the compiler turns these into vector instructions.
        let (across, along) = self.tangential.split_at_mut(l);
        let (across, along, gap) = (&mut across[..l], &mut along[..l], &mut self.coupling[..l]);
        let (dx, dy) = (&dx[..l], &dy[..l]);
        let ([ax, ay, an], [bx, by, bn]) = ([0, 1, 2].map(|r| &a[l * r..][..l]), [0, 1, 2].map(|r| &b[l * r..][..l]));
        for j in 0..l {
            let (x, y) = (f * ax[j] + g * bx[j], f * ay[j] + g * by[j]);
            across[j] = dx[j] * y - dy[j] * x;
            along[j] = dx[j] * x + dy[j] * y;
            gap[j] = f * an[j] + g * bn[j];
        }
    }
}

/// Couplings along the surface of the components of sticking `nodes`.
struct Sticking<'a> {
    tangential: &'a [f32],
    /// k.
    count: usize,
    nodes: &'a [usize],
    v: &'a [f32],
    out: &'a mut [f32],
}

impl WithSimd for Sticking<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let l = self.out.len() / 2;
        for &i in self.nodes {
            let column = &self.tangential[2 * l * (self.count + i)..][..2 * l];
            let factor = self.v[l + i];
            self.out[..l].iter_mut().zip(column).for_each(|(o, w)| *o += factor * w);
            self.out[l + i] = dot(column, self.v);
        }
    }
}

/// Motion along d of the nodes that slip, under changes of the pressures.
struct Pressed<'a> {
    w: &'a TangentialProblem,
    slips: &'a [f32],
    pressure: &'a [f32],
    out: &'a mut [f32],
}

impl WithSimd for Pressed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (k, l) = (self.w.nodes, self.pressure.len());
        for i in (0..k).filter(|&i| self.slips[i] > 0.0) {
            self.out[i] = dot(&self.w.coupling[l * (k + i)..][..l], self.pressure);
        }
    }
}
