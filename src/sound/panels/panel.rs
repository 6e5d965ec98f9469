//! Panels of an outline, and the integrals of the fields of their sources over them.

use crate::quadrature::legendre;
use num_complex::Complex64;
use std::sync::LazyLock;

/// Nodes of a panel: the Gauss points, where pressure and velocity are known and between which they are quadratic.
/// None lies on a corner or on the axis.
pub const NODES: usize = 3;
/// Points of a panel, or of a part of it, that is far enough away, and fewer where it is farther still.
const POINTS: usize = 6;
const POINTS_FAR: usize = 4;
/// Points of either side of the node itself, and the power of the substitution that flattens the logarithm there.
const POINTS_BESIDE: usize = 12;
const FLATTEN: i32 = 4;
/// A part of a panel is far enough away if its ends and its middle are, by this multiple of its length.
const APART: f64 = 1.0;
const FAR: f64 = 2.5;
/// Halvings of a panel at most: for points on the outline itself, which only a caller's mistake brings.
const HALVINGS: usize = 40;

static RULE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| legendre(POINTS));
static RULE_FAR: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| legendre(POINTS_FAR));
static BESIDE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| legendre(POINTS_BESIDE));
static OWN: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| legendre(NODES));

/// A point of the outline of a section: what is swept from it, a ring or a line, is a source of sound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlinePoint {
    /// Its place (r, y), m.
    pub at: [f64; 2],
    /// Outward normal (r, y).
    pub normal: [f64; 2],
}

/// The field of a source, of one order of Fourier or of several.
pub trait Kernel {
    /// [∫ G, ∫ ∂G/∂n′] of what is swept from `source`, of each order, at the point (r, y) `at` (m), with the wave
    /// number `k` (1/m). The point must not be the source.
    fn integrals(&mut self, source: &OutlinePoint, at: [f64; 2], k: f64) -> &[[Complex64; 2]];
}

/// A piece of the outline: a parabola (r, y)(t), −1 ≤ t ≤ 1, through three points, m. The body lies to the left of
/// its direction, in the plane with r to the right and y upwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// First, last and middle point.
    pub points: [[f64; 2]; 3],
}

/// A node of a panel.
#[derive(Debug, Clone, Copy)]
pub struct PanelNode {
    /// Its place.
    pub point: OutlinePoint,
    /// Length of the outline that it stands for, m.
    pub length: f64,
}

impl Panel {
    /// Parameters t of the nodes.
    pub fn parameters() -> [f64; NODES] {
        std::array::from_fn(|j| OWN[j].0)
    }

    /// The nodes.
    pub fn nodes(&self) -> [PanelNode; NODES] {
        std::array::from_fn(|j| {
            let (point, length) = self.at(OWN[j].0);
            PanelNode { point, length: OWN[j].1 * length }
        })
    }

    /// The point at t, and the length per t, m.
    fn at(&self, t: f64) -> (OutlinePoint, f64) {
        let [a, b, c] = self.points;
        let value = [0.5 * t * (t - 1.0), 0.5 * t * (t + 1.0), 1.0 - t * t];
        let slope = [t - 0.5, t + 0.5, -2.0 * t];
        let at = std::array::from_fn(|i| value[0] * a[i] + value[1] * b[i] + value[2] * c[i]);
        let along: [f64; 2] = std::array::from_fn(|i| slope[0] * a[i] + slope[1] * b[i] + slope[2] * c[i]);
        let length = along[0].hypot(along[1]);
        (OutlinePoint { at, normal: [along[1] / length, -along[0] / length] }, length)
    }

    /// Length, m.
    pub fn length(&self) -> f64 {
        OWN.iter().map(|(t, w)| w * self.at(*t).1).sum()
    }
}

/// ∫ G f ds and ∫ ∂G/∂n′ f ds of what is swept, m and 1, of f that is 1 at one node of a panel and 0 at the others;
/// `[orders][nodes]`.
pub struct Integrals<K> {
    kernel: K,
    /// [∫ G f, ∫ ∂G/∂n′ f].
    pub of_order: Vec<[[Complex64; 2]; NODES]>,
}

impl<K: Kernel> Integrals<K> {
    /// Integrals for a field that has this number of orders.
    pub fn new(kernel: K, orders: usize) -> Self {
        Self { kernel, of_order: vec![[[Complex64::default(); 2]; NODES]; orders] }
    }

    /// Integrates the kernel over `panel`, at the point (r, y) `at` (m) that is not on it, with the wave number `k`
    /// (1/m).
    pub fn beside(&mut self, panel: &Panel, at: [f64; 2], k: f64) {
        self.of_order.fill(Default::default());
        self.part(panel, (at, k), [-1.0, 1.0], HALVINGS);
    }

    /// Integrates the kernel over `panel`, at its node `j`.
    pub fn at_node(&mut self, panel: &Panel, j: usize, k: f64) {
        self.of_order.fill(Default::default());
        let here = OWN[j].0;
        let at = panel.at(here).0.at;
        for end in [-1.0, 1.0] {
            for (x, w) in BESIDE.iter() {
                let s = 0.5 * (1.0 + x);
                let t = here + (end - here) * s.powi(FLATTEN);
                let weight = 0.5 * w * f64::from(FLATTEN) * s.powi(FLATTEN - 1) * f64::abs(end - here);
                self.add(panel, (at, k), t, weight);
            }
        }
    }

    /// Integrates over the part from t = `from` to `to`: halved until it is far from the point, measured by its length.
    fn part(&mut self, panel: &Panel, (at, k): ([f64; 2], f64), [from, to]: [f64; 2], halvings: usize) {
        let middle = 0.5 * (from + to);
        let [a, b, c] = [from, to, middle].map(|t| panel.at(t).0.at);
        let away = |p: [f64; 2]| (p[0] - at[0]).hypot(p[1] - at[1]);
        let length = (a[0] - c[0]).hypot(a[1] - c[1]) + (b[0] - c[0]).hypot(b[1] - c[1]);
        // No point of it is nearer to `at` by more than a quarter of its length.
        let distance = away(a).min(away(b)).min(away(c));
        if distance < APART * length && halvings > 0 {
            self.part(panel, (at, k), [from, middle], halvings - 1);
            self.part(panel, (at, k), [middle, to], halvings - 1);
            return;
        }
        let half = 0.5 * (to - from);
        let rule = if distance < FAR * length { &RULE } else { &RULE_FAR };
        for (x, w) in rule.iter() {
            self.add(panel, (at, k), middle + half * x, half * w);
        }
    }

    fn add(&mut self, panel: &Panel, (at, k): ([f64; 2], f64), t: f64, weight: f64) {
        let (source, length) = panel.at(t);
        let weight = weight * length;
        let [p, q, s] = Panel::parameters();
        let shape = [
            (t - q) * (t - s) / ((p - q) * (p - s)),
            (t - p) * (t - s) / ((q - p) * (q - s)),
            (t - p) * (t - q) / ((s - p) * (s - q)),
        ];
        for (sums, layers) in self.of_order.iter_mut().zip(self.kernel.integrals(&source, at, k)) {
            for (sum, shape) in sums.iter_mut().zip(shape) {
                sum[0] += weight * shape * layers[0];
                sum[1] += weight * shape * layers[1];
            }
        }
    }
}
