//! Natural map of the nodes at an iterate.

use pulp::{Arch, Simd, WithSimd};

use super::normal::NormalBorder;
use super::Iterate;
use crate::contact::law::{size, Augmentation, Status};
use crate::dense::sum_over;
use crate::friction::FrictionLaw;
use crate::transient::aligned::AlignedVec;
use crate::transient::border::Border;
use crate::transient::problem::StepProblem;
use crate::transient::structure_of_arrays::{lane, lanes, lanes_mut, SoaVec3, LANES};

/// The map at an iterate, for k nodes in l places. The memory serves the following iterates and steps.
pub(super) struct NaturalMap {
    /// k.
    nodes: usize,
    /// Displacements without reactions (dx, dy, g), m.
    free: SoaVec3,
    /// Displacements, m; gaps without the shift.
    pub u: SoaVec3,
    /// Shift of the gaps by the borders, m, `[l]`.
    pub shift: AlignedVec<f64>,
    /// Augmentation along the surface and across it, N/m, `[l]` each.
    rho: [AlignedVec<f64>; 2],
    /// 1 where a node is closed and where it slips, else 0, `[l]`.
    pub closed: AlignedVec<f32>,
    pub slips: AlignedVec<f32>,
    /// Direction of t − ρ u where it slips, `[l]`, else x.
    pub direction: [AlignedVec<f64>; 2],
    /// (1 − a)/(a ρ), m/N; 0 where it does not slip, `[l]`.
    pub soft: AlignedVec<f64>,
    /// Coefficient of friction where it slips, else 0, `[l]`.
    pub mu: AlignedVec<f64>,
    /// −p dμ/d|u| where it slips, N/m, `[l]`: traction along d per motion along d. Empty where friction does not
    /// depend on the velocity.
    pub feed: AlignedVec<f64>,
    /// Coefficients of friction, `[l]`.
    friction: AlignedVec<f64>,
    /// Prescribed resultants less those of the reactions, N, `[borders]`.
    pub lack: Vec<f64>,
    pub norm: f64,
    pub largest: f64,
}

impl NaturalMap {
    /// For the nodes of a problem.
    pub fn new(p: &StepProblem<'_>) -> Self {
        let (k, l) = (p.nodes(), p.matrix.places());
        let zeros = || AlignedVec::zeros(l);
        let rho = |of: fn(Augmentation) -> f64| {
            let mut row = zeros();
            (0..k).for_each(|i| row[i] = of(p.rho(i)));
            row
        };
        Self {
            nodes: k,
            free: SoaVec3::zeros(l),
            u: SoaVec3::zeros(l),
            shift: zeros(),
            rho: [rho(|r| r.tangential), rho(|r| r.normal)],
            closed: AlignedVec::zeros(l),
            slips: AlignedVec::zeros(l),
            direction: [zeros(), zeros()],
            soft: zeros(),
            mu: zeros(),
            feed: AlignedVec::default(),
            friction: zeros(),
            lack: Vec::new(),
            norm: 0.0,
            largest: 0.0,
        }
    }

    /// Returns whether every node can move along the surface and has a compliance across it.
    pub fn moves(&self) -> bool {
        let [tangential, normal] = &self.rho;
        tangential[..self.nodes].iter().all(|r| *r > 0.0) && normal[..self.nodes].iter().all(|r| r.is_finite())
    }

    /// Goes to another problem on the same nodes.
    pub fn pose(&mut self, p: &StepProblem<'_>) {
        self.free.assign(p.free);
    }

    /// Augmentation of node `i`, N/m.
    pub fn rho(&self, i: usize) -> Augmentation {
        Augmentation { tangential: self.rho[0][i], normal: self.rho[1][i] }
    }

    /// Looks at an iterate.
    pub fn look(&mut self, p: &StepProblem<'_>, now: &Iterate) {
        let k = self.nodes;
        self.lack.clear();
        self.lack.extend(p.borders.iter().map(|b| b.total - resultant(p, b, &now.x)));
        if p.patch.is_empty() {
            let all = p.borders.iter().zip(&now.shift).map(|(b, s)| b.column[0][2] * s).sum::<f64>();
            self.shift[..k].fill(all);
        } else {
            (0..k).for_each(|i| self.shift[i] = p.shifted(i, &now.shift)[2]);
        }
        Arch::new().dispatch(Add { one: &self.free, other: &now.y, to: &mut self.u });
        let mut slopes = Vec::new();
        match p.friction.only() {
            Some(FrictionLaw::Constant(mu)) => self.friction[..k].fill(*mu),
            _ => {
                let along = self.u.row(0).iter().zip(self.u.row(1));
                let velocities: Vec<f64> = along.take(k).map(|(x, y)| size([*x, *y]) / p.step).collect();
                let (friction, found) = p.coefficients_with_slopes(&velocities);
                self.friction[..k].copy_from_slice(&friction);
                slopes = found;
            }
        }
        let [squares, largest] = Arch::new().dispatch(Map { x: &now.x, seen: self });
        if slopes.iter().any(|s| *s != 0.0) {
            let pressure = |i: usize| (now.x.row(2)[i] - self.rho[1][i] * (self.u.row(2)[i] + self.shift[i])).max(0.0);
            let feed = (0..k).map(|i| if self.slips[i] > 0.0 { -pressure(i) * slopes[i] } else { 0.0 });
            self.feed = AlignedVec::zeros(self.u.places());
            self.feed.iter_mut().zip(feed).for_each(|(f, v)| *f = v);
        } else {
            self.feed = AlignedVec::default();
        }
        let square = self.lack.iter().map(|l| l * l).sum::<f64>();
        self.norm = (squares + square / k as f64).sqrt();
        let square = self.lack.iter().map(|l| l * l).fold(0.0, f64::max);
        // The larger of NaN and a number is the number: it must not pass for a small residual.
        self.largest = if self.norm.is_finite() { largest.max(square).sqrt() } else { f64::INFINITY };
    }

    /// The borders as the pressures see them: at a node that slips the traction along its slip follows the pressure,
    /// and is part of the resultant. The change of the traction that the present pressures ask for is taken off what
    /// `lack`s.
    pub fn normal_borders(&self, p: &StepProblem<'_>, x: &SoaVec3, lack: &mut [f64]) -> Vec<NormalBorder> {
        let of = |(border, lack): (&Border, &mut f64)| {
            let mut normal = NormalBorder::new(p, border);
            if border.has_traction() {
                let [dx, dy] = &self.direction;
                for i in (0..self.nodes).filter(|&i| self.slips[i] > 0.0) {
                    let row = &border.row[p.patch_of(i)];
                    let along = row[0] * dx[i] + row[1] * dy[i];
                    let traction = dx[i] * x.row(0)[i] + dy[i] * x.row(1)[i];
                    *lack -= along * (self.mu[i] * x.row(2)[i] - traction);
                    normal.row[i] += (along * self.mu[i]) as f32;
                }
            }
            normal
        };
        p.borders.iter().zip(lack).map(of).collect()
    }

    /// Coefficients of friction, `[k]`.
    pub fn friction(&self) -> &[f64] {
        &self.friction[..self.nodes]
    }

    /// Status of node `i`.
    pub fn status(&self, i: usize) -> Status {
        match (self.closed[i] > 0.0, self.slips[i] > 0.0) {
            (false, _) => Status::Open,
            (_, false) => Status::Stick,
            _ => Status::Slip,
        }
    }

    /// Nodes that are open, ascending.
    pub fn open(&self) -> Vec<usize> {
        those(self.nodes, |i| self.closed[i] == 0.0)
    }

    /// Nodes that stick, ascending.
    pub fn sticking(&self) -> Vec<usize> {
        those(self.nodes, |i| self.closed[i] > self.slips[i])
    }
}

/// The few numbers below `n` that something is true of, ascending.
pub(super) fn those(n: usize, is: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut found = Vec::new();
    let mut first = 0;
    while first + LANES <= n {
        // Most lanes have none.
        if lane(|k| is(first + k)) != [false; LANES] {
            found.extend((first..first + LANES).filter(|&i| is(i)));
        }
        first += LANES;
    }
    found.extend((first..n).filter(|&i| is(i)));
    found
}

/// Resultant of the reactions `x` in a border, N.
fn resultant(p: &StepProblem<'_>, border: &Border, x: &SoaVec3) -> f64 {
    let [tx, ty, n] = [0, 1, 2].map(|c| x.row(c));
    if p.patch.is_empty() && !border.has_traction() {
        let row = border.row[0][2];
        return sum_over(n.len(), |i| row * n[i]);
    }
    (0..p.nodes()).map(|i| border.contribution(p.patch_of(i), &[tx[i], ty[i], n[i]])).sum()
}

struct Add<'a> {
    one: &'a SoaVec3,
    other: &'a SoaVec3,
    to: &'a mut SoaVec3,
}

impl WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let all = self.one.lanes().into_iter().zip(self.other.lanes()).zip(self.to.lanes_mut());
        for ((one, other), to) in all {
            for ((one, other), to) in one.iter().zip(other).zip(to) {
                *to = lane(|k| one[k] + other[k]);
            }
        }
    }
}

/// The laws of [`crate::contact::law`] at all nodes.
struct Map<'a> {
    x: &'a SoaVec3,
    seen: &'a mut NaturalMap,
}

impl WithSimd for Map<'_> {
    /// Sum of the squares of the map, and the largest square at a node along the surface and across it.
    type Output = [f64; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; 2] {
        let Self { x, seen } = self;
        let [tx, ty, pressure] = x.lanes();
        let blocks = tx.len();
        let [ux, uy, gap] = seen.u.lanes().map(|row| &row[..blocks]);
        let [rt, rn] = [&seen.rho[0], &seen.rho[1]].map(|row| lanes(row, blocks));
        let [friction, shift] = [&seen.friction, &seen.shift].map(|row| lanes(row, blocks));
        let [dx, dy] = &mut seen.direction;
        let [dx, dy, soft, mu] = [dx, dy, &mut seen.soft, &mut seen.mu].map(|row| lanes_mut(row, blocks));
        let [closed, slips] = [&mut seen.closed, &mut seen.slips].map(|row| lanes_mut(row, blocks));
        let (mut squares, mut largest) = ([0.0f64; LANES], [0.0f64; LANES]);
        for b in 0..blocks {
            let (tx, ty, p, ux, uy, gap) = (tx[b], ty[b], pressure[b], ux[b], uy[b], gap[b]);
            let (rt, rn, m, shift) = (rt[b], rn[b], friction[b], shift[b]);
            let q = lane(|k| (p[k] - rn[k] * (gap[k] + shift[k])).max(0.0));
            let zx = lane(|k| tx[k] - rt[k] * ux[k]);
            let zy = lane(|k| ty[k] - rt[k] * uy[k]);
            let length = lane(|k| (zx[k] * zx[k] + zy[k] * zy[k]).sqrt());
            let bound = lane(|k| m[k] * q[k]);
            let long = lane(|k| length[k] > 0.0);
            let share = lane(|k| if long[k] { bound[k] / length[k] } else { 0.0 });
            let within = lane(|k| length[k] <= bound[k]);
            let kept = lane(|k| if within[k] { 1.0 } else { share[k] });
            let fx = lane(|k| tx[k] - kept[k] * zx[k]);
            let fy = lane(|k| ty[k] - kept[k] * zy[k]);
            let residue = lane(|k| p[k] - q[k]);
            let along = lane(|k| fx[k] * fx[k] + fy[k] * fy[k]);
            let normal = lane(|k| residue[k] * residue[k]);
            squares = lane(|k| squares[k] + along[k] + normal[k]);
            largest = lane(|k| largest[k].max(along[k]).max(normal[k]));
            // Without friction nothing sticks.
            let shut = lane(|k| q[k] > 0.0);
            let sliding = lane(|k| shut[k] & !(within[k] & (m[k] > 0.0)));
            closed[b] = lane(|k| if shut[k] { 1.0 } else { 0.0 });
            slips[b] = lane(|k| if sliding[k] { 1.0 } else { 0.0 });
            let turned = lane(|k| sliding[k] & long[k]);
            dx[b] = lane(|k| if turned[k] { zx[k] / length[k] } else { 1.0 });
            dy[b] = lane(|k| if turned[k] { zy[k] / length[k] } else { 0.0 });
            // Without friction nothing is left to turn: a row t_e = 0 is as good.
            let a = lane(|k| share[k].min(1.0));
            let creep = lane(|k| (a[k] * rt[k]).max(1e-9 * rt[k]));
            soft[b] = lane(|k| if sliding[k] { (1.0 - a[k]) / creep[k] } else { 0.0 });
            mu[b] = lane(|k| if sliding[k] { m[k] } else { 0.0 });
        }
        [squares.iter().sum(), largest.iter().fold(0.0, |a, b| a.max(*b))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::{Node, Tangent};
    use crate::transient::DelassusOperator;

    /// Node by node the laws say the same: with and without friction, open, in stick and in slip, at rest without a
    /// traction, in lanes that are full and not.
    #[test]
    fn the_map_is_that_of_the_laws() {
        for (k, friction) in [(1, 0.3), (8, 0.3), (21, 0.3), (21, 0.0)] {
            let compliance = |i: usize, c: usize| (1.0 + 0.1 * i as f64 + 0.2 * c as f64) * 1e-9;
            let place = |j: usize| (j / (3 * k), j % (3 * k));
            let entry = |(i, j)| if i == j { compliance(i / 3, i % 3) } else { 0.0 };
            let matrix = DelassusOperator::new((0..9 * k * k).map(|n| entry(place(n))).collect());
            let number = |n: usize| (1.0 + (7 * n * n + 3 * n) as f64).sin();
            let x: Vec<f64> = (0..3 * k).map(|n| if n / 3 == 2 { 0.0 } else { 100.0 * number(n) }).collect();
            let y: Vec<f64> = (0..3 * k).map(|n| 5e-8 * number(n + 100)).collect();
            // The third node is at rest without a traction, and closed.
            let free: Vec<f64> = (0..3 * k)
                .map(|n| match (n / 3, n % 3) {
                    (2, 2) => -3e-7 - y[n],
                    (2, _) => -y[n],
                    (i, c) => [0.3e-7, 2e-7, 1e-7][c] * number(n + 200) - if i % 3 == 0 && c == 2 { 3e-7 } else { 0.0 },
                })
                .collect();
            let law = FrictionLaw::Constant(friction).into();
            let p = StepProblem {
                matrix: &matrix,
                free: &free,
                friction: &law,
                before: &[],
                step: 1e-5,
                patch: &[],
                borders: &[Border::of_component(2, 50.0)],
                tolerance: 1e-10,
            };
            let mut seen = NaturalMap::new(&p);
            seen.pose(&p);
            let l = matrix.places();
            let now =
                Iterate { x: SoaVec3::from_interleaved(&x, l), shift: vec![2e-8], y: SoaVec3::from_interleaved(&y, l) };
            seen.look(&p, &now);
            let lack = 50.0 - x.iter().skip(2).step_by(3).sum::<f64>();
            let (mut square, mut largest) = (lack * lack / k as f64, lack.abs());
            let mut count = [0; 3];
            for i in 0..k {
                let u = |c: usize| free[3 * i + c] + y[3 * i + c];
                let node = Node {
                    pressure: x[3 * i + 2],
                    traction: [x[3 * i], x[3 * i + 1]],
                    gap: u(2) + now.shift[0],
                    creep: [u(0), u(1)],
                };
                let found = node.project(p.rho(i), friction);
                let tangent = found.tangent(&node, 0.0);
                let status = if matches!(tangent, Tangent::Slip(_)) { Status::Slip } else { found.status };
                assert_eq!(seen.status(i), status, "node {i} of {k}");
                count[status as usize] += 1;
                let f = found.map(&node);
                square += f.iter().map(|f| f * f).sum::<f64>();
                largest = largest.max(size([f[0], f[1]])).max(f[2].abs());
                let is = [seen.direction[0][i], seen.direction[1][i], seen.mu[i], seen.soft[i] * p.rho(i).tangential];
                let expected = match tangent {
                    Tangent::Slip(slip) => {
                        let d = slip.direction.map(|t| -t);
                        // Where nothing turns what does, the least counts as a part of the augmentation.
                        let creep = slip.across[1].max(1e-9 * p.rho(i).tangential);
                        [d[0], d[1], friction, slip.across[0] * p.rho(i).tangential / creep]
                    }
                    _ => [1.0, 0.0, 0.0, 0.0],
                };
                for (a, b) in is.iter().zip(&expected) {
                    assert!(
                        (a - b).abs() <= 1e-14 * b.abs().max(1.0),
                        "node {i} of {k}: {is:?}, expected {expected:?}"
                    );
                }
            }
            assert!((seen.norm / square.sqrt() - 1.0).abs() < 1e-14 && (seen.largest / largest - 1.0).abs() < 1e-14);
            let kinds = if friction > 0.0 { 3 } else { 2 };
            assert!(k < 21 || count.iter().filter(|n| **n > 0).count() == kinds, "{count:?}");
            assert_eq!(seen.open().len(), count[0]);
            assert_eq!(seen.sticking().len(), count[1]);
        }
    }
}
