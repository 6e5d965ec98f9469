//! Stiffness and mass of a section at each Fourier order, and what prestress adds. Source of the strains of order n:
//! O. C. Zienkiewicz, R. L. Taylor, The Finite Element Method, 5th edition (2000), volume 2, chapter 9, with the
//! signs of this module's families.

mod constraints;
mod half;
mod pairs;
mod prestress;
mod products;
mod strains;

use super::attached::{Attachment, Rings};
use super::bearings::{Bearing, Bearings};
use super::skyline_ldlt::{Envelope, SkylineFactor, BLOCK};
use super::springs::EdgeSprings;
use super::track::{RailTrack, TrackMatrices};
use super::{CrossSection, Path};
use crate::fem::ElasticMaterial;
use crate::{Error, Result};
use constraints::ConstrainedNodes;
pub use constraints::Parity;
use faer::{Mat, MatRef};
use std::collections::HashMap;
use std::rc::Rc;

use pairs::{number, NodePairs};
pub use prestress::Prestress;
use strains::{add, brackets, scaled, IDENTITY, NOTHING};
pub(super) use strains::{strains, stress};

/// Six strains of a node's three amplitudes: rr, θθ, yy, rθ, ry, θy.
pub(super) type Strains = [[f64; 3]; 6];

/// K_n = K0 + n K1 + n² K2 and M of a section, for all n; along a line with the wavenumber k in place of n, and
/// metres in place of radians.
#[derive(Debug, Clone)]
pub struct Forms {
    /// The section.
    pub section: CrossSection,
    /// Its material.
    pub material: ElasticMaterial,
    /// Path along which the section is swept.
    pub path: Path,
    /// Number of each node among those that are free to move.
    place: Vec<Option<usize>>,
    pairs: NodePairs,
    envelope: Rc<Envelope>,
    /// K0, K1, K2 at each pair, N/m per radian of the angle.
    stiffness: [Vec<[[f64; 3]; 3]>; 3],
    /// ∫ρ N_a N_b r dr dy at each pair, kg per radian.
    mass: Vec<f64>,
    /// Springs and dashpots of a track, or at edges, at each pair; the springs are part of K0. Nothing without them.
    track: Vec<Springs>,
    /// Tuned absorbers and ring dampers.
    pub(super) rings: Rings,
    /// Bearings of a wheelset.
    pub(super) bearings: Bearings,
    /// Nodes on the axle of a solid body, and in the middle plane of a half section.
    constraints: ConstrainedNodes,
}

/// Block of stiffness between (U, V, W) of two nodes.
pub(super) type NodeStiffness = [[f64; 3]; 3];

/// Springs, N/m², and dashpots, N·s/m², between (U, V, W) of two nodes, each metre of a line.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Springs {
    pub stiffness: [[f64; 3]; 3],
    pub viscosity: [[f64; 3]; 3],
}

impl Springs {
    /// These times a factor.
    pub fn times(&self, factor: f64) -> Self {
        Self { stiffness: scaled(&self.stiffness, factor), viscosity: scaled(&self.viscosity, factor) }
    }
}

/// Part of the velocity of sound over the radius that the shift is made of.
const SHIFT: f64 = 0.1;
/// Nodes nearer than this part of the size of a section are in one place.
const SAME_PLACE: f64 = 1e-12;

impl Forms {
    /// The forms of a section of a body of revolution, of a material, that is clamped at the nodes of the groups
    /// `fixed`.
    pub fn new(section: CrossSection, material: ElasticMaterial, fixed: &[String]) -> Result<Self> {
        Self::sprung(section, material, fixed, &[])
    }

    /// The same that stands on `springs`, too.
    pub fn sprung(
        section: CrossSection,
        material: ElasticMaterial,
        fixed: &[String],
        springs: &[EdgeSprings],
    ) -> Result<Self> {
        Self::carrying(section, material, (fixed, springs), &[])
    }

    /// The same that carries `attachments`, each at the place of the section that is nearest to its own.
    pub(crate) fn carrying(
        mut section: CrossSection,
        material: ElasticMaterial,
        (fixed, springs): (&[String], &[EdgeSprings]),
        attachments: &[Attachment],
    ) -> Result<Self> {
        let rings = Rings::new(&mut section, attachments);
        let blocks = springs.iter().map(|s| s.blocks(&section)).collect::<Result<Vec<_>>>()?.concat();
        let mut free = vec![true; section.nodes.len()];
        for name in fixed {
            let Some(nodes) = section.groups.get(name) else {
                let names: Vec<String> = section.groups.keys().map(|k| format!("\"{k}\"")).collect();
                return Err(Error::Job(format!(
                    "the section has no group \"{name}\" to clamp; its groups are {}",
                    names.join(", ")
                )));
            };
            nodes.iter().for_each(|&k| free[k] = false);
        }
        let mut forms = Self::made(section, material, Path::Axle, &free, &rings.links(&free))?;
        forms.lay(&TrackMatrices { blocks, mass: None });
        forms.carry(rings);
        Ok(forms)
    }

    /// The forms of a section of a material along a line of the period `period`, m, free or on a track; the section
    /// is turned by `tilt`, rad, from y to z, against the upright one.
    pub fn along(
        mut section: CrossSection,
        material: ElasticMaterial,
        period: f64,
        track: Option<&RailTrack>,
        tilt: f64,
    ) -> Result<Self> {
        let added = track.map(|t| t.added(&mut section, tilt)).transpose()?;
        let links: Vec<[usize; 2]> = added.iter().flat_map(|a| a.blocks.iter().map(|b| [b.0, b.1])).collect();
        let free = vec![true; section.nodes.len()];
        let mut forms = Self::made(section, material, Path::Line(period), &free, &links)?;
        if let Some(added) = added {
            forms.lay(&added);
        }
        Ok(forms)
    }

    fn made(
        section: CrossSection,
        material: ElasticMaterial,
        path: Path,
        free: &[bool],
        links: &[[usize; 2]],
    ) -> Result<Self> {
        section.check(path)?;
        // The running line comes last: of a solution under loads there nothing before it has to be made.
        let tread = section.running_at(0.0);
        let numbers = number(&section, free, links, tread.as_flattened());
        let mut forms = Self::unassembled(section, material, path, numbers, None);
        forms.assemble();
        Ok(forms)
    }

    /// Forms of free nodes with these numbers and pairs, all of them 0; of a half section with the nodes of its
    /// `middle` plane, and the symmetry of motions there.
    fn unassembled(
        section: CrossSection,
        material: ElasticMaterial,
        path: Path,
        (place, pairs): (Vec<Option<usize>>, NodePairs),
        middle: Option<(&[usize], Parity)>,
    ) -> Self {
        let empty = vec![[[0.0; 3]; 3]; pairs.columns.len()];
        let mass = vec![0.0; pairs.columns.len()];
        let constraints = match path {
            Path::Axle => ConstrainedNodes::new(&section, middle, &place, &pairs),
            Path::Line(_) => ConstrainedNodes::default(),
        };
        let stiffness = [empty.clone(), empty.clone(), empty];
        let blocks = pairs.iter().map(|(a, b, _)| (3 * a + 2, 3 * b));
        let envelope = Rc::new(Envelope::new(3 * pairs.rows(), blocks));
        Self {
            section,
            material,
            path,
            place,
            pairs,
            envelope,
            stiffness,
            mass,
            track: Vec::new(),
            rings: Rings::default(),
            bearings: Bearings::default(),
            constraints,
        }
    }

    /// Adds the mass of rings; their stiffness goes with the order.
    fn carry(&mut self, mut rings: Rings) {
        rings.settle(self.shift(), |a, b| self.pair(a, b));
        for (node, mass) in rings.masses() {
            if let Some(k) = self.pair(node, node) {
                self.mass[k] += mass;
            }
        }
        self.rings = rings;
    }

    /// Stiffness of rings, their springs and bearings at the order n, of each radian, by pairs.
    fn of_rings(&self, n: usize) -> HashMap<usize, NodeStiffness> {
        let mut all = self.rings.stiffness(n, |node| self.section.nodes[node][0]);
        self.bearings.add_stiffness(n, &mut all);
        all
    }

    /// The same body on `bearings`, each at the place of the section that is nearest to its own.
    pub fn on_bearings(mut self, bearings: &[Bearing]) -> Self {
        self.bearings = Bearings::new(&self.section, bearings, |a, b| self.pair(a, b));
        self
    }

    /// Adds springs, dashpots and mass of a track, or springs at edges.
    fn lay(&mut self, added: &TrackMatrices) {
        if added.blocks.is_empty() {
            return;
        }
        self.track = vec![Springs::default(); self.pairs.columns.len()];
        for (a, b, springs) in &added.blocks {
            let Some(k) = self.pair(*a, *b) else { continue };
            for c in 0..3 {
                for d in 0..3 {
                    self.stiffness[0][k][c][d] += springs.stiffness[c][d];
                    self.track[k].stiffness[c][d] += springs.stiffness[c][d];
                    self.track[k].viscosity[c][d] += springs.viscosity[c][d];
                }
            }
        }
        if let Some((sleeper, mass)) = added.mass {
            if let Some(k) = self.pair(sleeper, sleeper) {
                self.mass[k] += mass;
            }
        }
    }

    /// Number of amplitudes that are free.
    pub fn order(&self) -> usize {
        3 * self.pairs.rows()
    }

    /// A shift below all eigenvalues, 1/s²: minus the square of a part of the velocity of sound over the largest
    /// radius, or the height along a line.
    pub fn shift(&self) -> f64 {
        let range = |(low, high): (f64, f64), x: &[f64; 2]| (low.min(x[0]), high.max(x[0]));
        let (low, high) = self.section.nodes.iter().fold((f64::INFINITY, f64::NEG_INFINITY), range);
        let size = if self.path == Path::Axle { high } else { high - low };
        -(SHIFT / size).powi(2) * self.material.young / self.material.density
    }

    /// Returns whether `other` is the same section of the same material on the same way, in a frame that is elsewhere
    /// and turned by `angle`, rad, from y to z against that of this one; of a body of revolution along the axle alone.
    /// Tracks and springs are not looked at.
    pub(crate) fn is_elsewhere(&self, other: &Self, angle: f64) -> bool {
        let (a, b) = (&self.section, &other.section);
        let alike = self.path == other.path && self.material == other.material && self.place == other.place;
        if !alike
            || a.nodes.len() != b.nodes.len()
            || a.elements != b.elements
            || a.tread != b.tread
            || a.groups != b.groups
            || a.layers != b.layers
            || !self.rings.are_alike(&other.rings)
            || !self.bearings.are_alike(&other.bearings)
        {
            return false;
        }
        let (Some(&[first, also]), Some(&[to, there])) = (a.nodes.first(), b.nodes.first()) else { return false };
        let (s, c) = angle.sin_cos();
        let from = |x: &[f64; 2]| [x[0] - first, x[1] - also];
        let size = a.nodes.iter().map(|x| from(x)[0].hypot(from(x)[1])).fold(0.0, f64::max);
        let round = self.path == Path::Axle;
        a.nodes.iter().zip(&b.nodes).all(|(x, y)| {
            let [r, w] = from(x);
            let off = [c * r - s * w - (y[0] - to), c * w + s * r - (y[1] - there)];
            let same = off[0].hypot(off[1]) <= SAME_PLACE * size;
            same && (!round || (x[0] - y[0]).abs() <= SAME_PLACE * size)
        })
    }

    /// First amplitude of a node; none where it is clamped.
    pub fn amplitude(&self, node: usize) -> Option<usize> {
        self.place[node].map(|k| 3 * k)
    }

    fn assemble(&mut self) {
        for element in &self.section.elements {
            let material = self.section.material(element, self.material);
            let (lambda, shear) = material.lame();
            for shape in element.kind.points() {
                let (r, jacobian) = self.section.jacobian(element, &shape);
                let weight = jacobian.determinant * shape.weight * self.path.measure(r);
                let over = (self.path == Path::Axle).then_some(1.0 / r);
                let strains: Vec<[Strains; 2]> = shape
                    .value
                    .iter()
                    .zip(&shape.slope)
                    .map(|(&value, &slope)| strains(value, jacobian.slope(slope), over))
                    .collect();
                let stresses = strains.iter().map(|both| both.map(|b| stress(&b, lambda, shear)));
                for (i, stress) in stresses.enumerate() {
                    for j in 0..strains.len() {
                        let Some(k) = self.pair(element.nodes[i], element.nodes[j]) else { continue };
                        let [zero, one] = &strains[j];
                        add(&mut self.stiffness[0][k], &stress[0], zero, weight);
                        add(&mut self.stiffness[1][k], &stress[0], one, weight);
                        add(&mut self.stiffness[1][k], &stress[1], zero, weight);
                        add(&mut self.stiffness[2][k], &stress[1], one, weight);
                        self.mass[k] += material.density * shape.value[i] * shape.value[j] * weight;
                    }
                }
            }
        }
    }

    /// The pair of two nodes in the lower triangle.
    fn pair(&self, a: usize, b: usize) -> Option<usize> {
        let (a, b) = (self.place[a]?, self.place[b]?);
        if b <= a {
            self.pairs.find(a, b)
        } else {
            None
        }
    }

    /// K_n − σM at a pair, of the whole way.
    fn block(&self, n: usize, sigma: f64, k: usize) -> [[f64; 3]; 3] {
        let (w, x) = (self.path.length_integral(n), self.path.wavenumber(n));
        std::array::from_fn(|c| {
            std::array::from_fn(|d| {
                let [zero, one, two] = [0, 1, 2].map(|p| self.stiffness[p][k][c][d]);
                let inertia = if c == d { sigma * self.mass[k] } else { 0.0 };
                w * (zero + x * one + x * x * two - inertia)
            })
        })
    }

    /// K_n − σM, factorised.
    pub fn factor(&self, n: usize, sigma: f64) -> Result<SkylineFactor> {
        self.factor_in(Vec::new(), n, sigma)
    }

    /// The same with the factor of forms that differ in the last nodes alone, those from the number `from` on.
    fn factor_like(&self, other: &SkylineFactor, from: usize, n: usize, sigma: f64) -> Result<SkylineFactor> {
        SkylineFactor::like(other, self.values(Vec::new(), n, sigma), 3 * from)
    }

    /// The same in the memory of another factor.
    pub(crate) fn factor_in(&self, memory: Vec<f64>, n: usize, sigma: f64) -> Result<SkylineFactor> {
        SkylineFactor::new(&self.envelope, self.values(memory, n, sigma))
    }

    /// The values of K_n − σM in the envelope, in the memory of others.
    fn values(&self, memory: Vec<f64>, n: usize, sigma: f64) -> Vec<f64> {
        let mut values = self.envelope.empty(memory);
        let (w, x) = (self.path.length_integral(n), self.path.wavenumber(n));
        let [zero, one, two] = &self.stiffness;
        let rings = self.of_rings(n);
        for (a, b, k) in self.pairs.iter() {
            let ([zero, one, two], at) = ([&zero[k], &one[k], &two[k]], self.envelope.place(3 * a, 3 * b));
            for c in 0..3 {
                // Of a node with itself the lower triangle.
                for d in 0..if a == b { c + 1 } else { 3 } {
                    values[at + BLOCK * d + c] = w * (zero[c][d] + x * (one[c][d] + x * two[c][d]));
                }
            }
            if let Some(ring) = rings.get(&k).filter(|_| !rings.is_empty()) {
                for c in 0..3 {
                    for d in 0..if a == b { c + 1 } else { 3 } {
                        values[at + BLOCK * d + c] += w * ring[c][d];
                    }
                }
            }
            if self.constraints.has(k) {
                let raw: NodeStiffness = std::array::from_fn(|c| {
                    std::array::from_fn(|d| w * (zero[c][d] + x * (one[c][d] + x * two[c][d])))
                });
                let regular =
                    if a == b { self.constraints.held(n, k, raw) } else { self.constraints.projected(n, k, raw) };
                let inertia = self.constraints.projected(n, k, scaled(&IDENTITY, w * sigma * self.mass[k]));
                for c in 0..3 {
                    for d in 0..if a == b { c + 1 } else { 3 } {
                        values[at + BLOCK * d + c] = regular[c][d] - inertia[c][d];
                    }
                }
            } else if sigma != 0.0 {
                let inertia = w * sigma * self.mass[k];
                (0..3).for_each(|c| values[at + BLOCK * c + c] -= inertia);
            }
        }
        values
    }

    /// Applies rotation at the order n, at 1 rad/s, to columns: (K_σ − K_c) x with the prestress `sigma`. K_c alone
    /// without it.
    pub fn rotation(&self, n: usize, sigma: Option<&Prestress>, x: MatRef<'_, f64>) -> Mat<f64> {
        let bracket = brackets(n);
        self.product(x, |k| {
            let (section, angle) = sigma.map_or((0.0, 0.0), |s| (s.along_section[k], s.along_angle[k]));
            let around = scaled(&bracket, self.path.length_integral(n) * (angle - self.mass[k]));
            let mut block = scaled(&IDENTITY, self.path.length_integral(n) * section);
            block.iter_mut().flatten().zip(around.iter().flatten()).for_each(|(b, a)| *b += a);
            block
        })
    }

    /// Springs and dashpots of the track times columns at the order n, `[order, k]`; none without a track.
    pub fn track(&self, n: usize, x: MatRef<'_, f64>) -> Option<[Mat<f64>; 2]> {
        let whole = self.path.length_integral(n);
        let of = |part: fn(&Springs) -> &[[f64; 3]; 3]| self.product(x, |k| scaled(part(&self.track[k]), whole));
        (!self.track.is_empty()).then(|| [of(|s| &s.stiffness), of(|s| &s.viscosity)])
    }

    /// Springs and dashpots of the track times columns with (U, W) of x alone, or with V alone, each metre of a line,
    /// `[order, k]`; 0 without a track.
    pub(super) fn track_of(&self, along: bool, x: MatRef<'_, f64>) -> [Mat<f64>; 2] {
        let part = Mat::from_fn(x.nrows(), x.ncols(), |i, k| if (i % 3 == 1) == along { x[(i, k)] } else { 0.0 });
        let of =
            |of: fn(&Springs) -> [[f64; 3]; 3]| self.product(part.as_ref(), |k| self.track.get(k).map_or(NOTHING, of));
        [of(|s| s.stiffness), of(|s| s.viscosity)]
    }

    /// First amplitude of each node under the foot, and its share in the mean over the foot.
    pub(super) fn foot(&self) -> Vec<(usize, f64)> {
        let edges = self.section.edges("foot");
        let length: f64 = edges.iter().flat_map(|e| self.section.along(e)).map(|(_, step)| step).sum();
        let of = |edge: &[usize; 3]| {
            let all = self.section.along(edge);
            edge.iter()
                .enumerate()
                .filter_map(|(i, &node)| {
                    let share = all.iter().map(|(values, step)| values[i] * step).sum::<f64>() / length;
                    Some((self.amplitude(node)?, share))
                })
                .collect::<Vec<_>>()
        };
        edges.iter().flat_map(of).collect()
    }

    /// M x of columns with U and V of x exchanged, and with U, V as V, −U at the order 0: φᵀ of it is ∫ρ(U_j V_k +
    /// V_j U_k), or ∫ρ(U_j V_k − V_j U_k), all round.
    pub fn exchanged(&self, n: usize, x: MatRef<'_, f64>) -> Mat<f64> {
        let sign = if n == 0 { -1.0 } else { 1.0 };
        let exchanged = Mat::from_fn(x.nrows(), x.ncols(), |i, k| match i % 3 {
            0 => x[(i + 1, k)],
            1 => sign * x[(i - 1, k)],
            _ => 0.0,
        });
        self.mass(n, exchanged.as_ref())
    }
}
