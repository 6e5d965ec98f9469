//! The loads of a patch as the orders of Fourier see them: on the nodes of the running line of a swept body.

use super::contact::{SectionContact, Spot};
use super::load_frame::rotate_loads;
use super::load_patch::{points, LoadPatch, LOADS};
use super::{Forms, Path};
use faer::Mat;

/// Family that each load of order n ≥ 1 moves: 0 (U cos nθ, V sin nθ, W cos nθ) or 1 (U sin nθ, −V cos nθ, W sin nθ).
pub const FAMILY: [usize; LOADS] = [1, 0, 0, 0, 1, 1, 1, 0, 0];

/// The loads of one order on the nodes of the running line.
#[derive(Debug, Clone)]
pub struct LineLoad {
    order: usize,
    patch: LoadPatch,
    /// nθ_c, or kx_c along a line, rad.
    phase: f64,
    /// First amplitude of a node, and for each load the weights of its U, V and W.
    nodes: Vec<(usize, [[f64; 3]; LOADS])>,
}

impl LineLoad {
    /// The loads of the order `n` on `forms`, whose rolling radius is `radius`, m; along a line its period over 2π.
    pub fn new(forms: &Forms, patch: LoadPatch, n: usize, radius: f64) -> Self {
        Self::for_contact(forms, patch, n, &SectionContact::level(radius))
    }

    /// The loads of the order `n` on the spots of a contact, in its frame.
    pub(crate) fn for_contact(forms: &Forms, patch: LoadPatch, n: usize, contact: &SectionContact) -> Self {
        let mut nodes = Vec::new();
        for spot in contact.spots() {
            let turn = contact.turn(spot);
            for (at, mut loads) in on_spot(forms, patch, n, spot) {
                // The factors x and y of a load stay; its direction is turned.
                for c in 0..3 {
                    let column = rotate_loads(std::array::from_fn(|k| spot.share * loads[k][c]), turn);
                    loads.iter_mut().zip(column).for_each(|(load, value)| load[c] = value);
                }
                nodes.push((at, loads));
            }
        }
        Self { order: n, patch, phase: forms.path.wavenumber(n) * contact.along(), nodes }
    }

    /// First amplitude that is loaded.
    pub fn first(&self) -> usize {
        self.nodes.iter().map(|(at, _)| *at).min().unwrap_or(0)
    }

    /// The loads as columns of amplitudes, each of the family that it moves, `[order, 9]`.
    pub fn columns(&self, order: usize) -> Mat<f64> {
        let mut columns = Mat::zeros(order, LOADS);
        for (at, loads) in &self.nodes {
            for (k, load) in loads.iter().enumerate() {
                (0..3).for_each(|c| columns[(at + c, k)] += load[c]);
            }
        }
        columns
    }

    /// The means of the amplitudes of a column, `[order]`, each taken of the family that its load moves.
    pub fn means(&self, amplitudes: faer::ColRef<'_, f64>) -> [f64; LOADS] {
        let mut means = [0.0; LOADS];
        for (at, loads) in &self.nodes {
            for (mean, load) in means.iter_mut().zip(loads) {
                *mean += (0..3).map(|c| load[c] * amplitudes[at + c]).sum::<f64>();
            }
        }
        means
    }

    /// The motion at the contact that has these means: coefficients of 1, x and y, as [`LoadPatch::functions`].
    pub fn functions(&self, means: &[f64; LOADS]) -> [f64; LOADS] {
        self.patch.functions(means)
    }

    /// Part of each mean of [`LineLoad::means`] in a motion of the family 0 or 1.
    pub fn shares(&self, family: usize) -> [f64; LOADS] {
        family_shares(self.order, self.phase, family)
    }
}

/// Part of each of the nine means at a contact in a motion of the family 0 or 1 of an order: the means are those of the
/// families about the contact, which lies at the angle `phase` of the waves, rad.
pub(crate) fn family_shares(order: usize, phase: f64, family: usize) -> [f64; LOADS] {
    let (s, c) = phase.sin_cos();
    let of = if family == 0 { [c, -s] } else { [s, c] };
    FAMILY.map(|own| if order == 0 { 1.0 } else { of[own] })
}

/// Loads of the order `n` on the edges of the running line under a spot, in the frame of the spot: first amplitude of a
/// node, and for each load the weights of its U, V and W.
fn on_spot(forms: &Forms, patch: LoadPatch, n: usize, spot: &Spot) -> Vec<(usize, [[f64; 3]; LOADS])> {
    let section = &forms.section;
    let mut nodes = Vec::new();
    for edge in &section.tread {
        let [first, last, middle] = edge.map(|i| spot.along(section.nodes[i]));
        let (own, reach) = (patch.middle(), patch.half()[1]);
        let (low, high) = (first.max(own - reach), last.min(own + reach));
        // An edge along the normal of the spot carries none of its loads, nor does one of another wheel.
        let elsewhere = forms.path == Path::Axle && spot.is_far_from(section.nodes[edge[2]]);
        if high <= low || elsewhere || last - first < UPRIGHT * section.length(edge) {
            continue;
        }
        // t = middle + s (last − first)/2 + s² (first + last − 2 middle)/2 along the edge.
        let (slope, bend) = (0.5 * (last - first), 0.5 * (first + last - 2.0 * middle));
        let place =
            |t: f64| (0..8).fold(0.0, |s: f64, _| s - (middle + s * (slope + s * bend) - t) / (slope + 2.0 * s * bend));
        let mut of_edge = [[[0.0; 3]; LOADS]; 3];
        for (t, step) in points(low, high, 2) {
            let s = place(t);
            let values = [0.5 * s * (s - 1.0), 0.5 * s * (s + 1.0), 1.0 - s * s];
            // Along a line it is the same everywhere.
            let radius = if forms.path == Path::Axle { spot.radius_at(t) } else { spot.radius };
            let means = patch.round(n, (radius, forms.path), t).means(n);
            for (node, value) in of_edge.iter_mut().zip(values) {
                for (k, load) in node.iter_mut().enumerate() {
                    let factor = if k < 6 { 1.0 } else { t - own };
                    load.iter_mut().zip(means[k % 6]).for_each(|(l, m)| *l += step * value * factor * m);
                }
            }
        }
        for (&node, loads) in edge.iter().zip(of_edge) {
            let Some(at) = forms.amplitude(node) else { continue };
            nodes.push((at, in_frame(&loads, spot.angle)));
        }
    }
    nodes
}

/// Loads along (x, y, n) of a level surface as loads along (x, t, n) of one of the slope angle `angle`, rad.
fn in_frame(loads: &[[f64; 3]; LOADS], angle: f64) -> [[f64; 3]; LOADS] {
    let columns: [[f64; LOADS]; 3] = std::array::from_fn(|c| rotate_loads(std::array::from_fn(|k| loads[k][c]), angle));
    std::array::from_fn(|k| [0, 1, 2].map(|c| columns[c][k]))
}

/// Extent of an edge along the tangent of a spot over its length below which it stands upright there.
const UPRIGHT: f64 = 1e-6;
