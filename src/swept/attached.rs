//! Rings of mass that springs tie to a section: tuned absorbers and ring dampers of a wheel.
//!
//! A ring of the mass m, all round, moves by (U, V, W) of its own at each Fourier order. Springs without length tie it
//! to the displacement of the section at its place, along the radius, the circle and the axle, in the frame of the
//! section, with which they turn. With the angular frequency ω_c of the mass on the springs of one direction their
//! stiffness is k_c = m ω_c², all round. The loss factor η of springs is taken as viscous, c_c = η k_c/ω_c: right at
//! ω_c, in proportion to the frequency elsewhere. A direction without a frequency is tied by springs that are rigid up
//! to all frequencies of interest.
//!
//! N separate masses, evenly spaced, are a ring for orders n < N/2: they couple the order n with N − n, N + n and so
//! on, whose modes lie far above. From N/2 on their motion along the springs is left out, and the mass follows across
//! it.
//!
//! A ring of wire has the stiffness of a thin ring besides, of each radian with the radius r of the ring (A. E. H.
//! Love, A Treatise on the Mathematical Theory of Elasticity, chapter 21, recalled), with the area A, the second moment
//! I and the torsion constant J = 2I of the wire:
//! - in its plane EA/r (U + nV)² + EI/r³ (n²U + nV)²,
//! - across it EI GJ n²(n² − 1)²/((EI + GJ n²) r³) W², the twist of the wire being that of least energy.
//!
//! Centrifugal forces on the ring pull at the section through its springs; the tension of the springs adds no
//! stiffness.

use super::{CrossSection, Forms};
use crate::fem::ElasticMaterial;
use faer::{Mat, MatRef};
use std::collections::HashMap;
use std::f64::consts::PI;

/// Ring of mass on springs at a place of a section.
#[derive(Debug, Clone, PartialEq)]
pub struct Attachment {
    /// Name in messages.
    pub name: String,
    /// Place (r, y), m.
    pub place: [f64; 2],
    /// Mass all round, kg.
    pub mass: f64,
    /// Angular frequencies of the mass on its springs along the radius, the circle and the axle, rad/s; none: rigid.
    pub frequency: [Option<f64>; 3],
    /// Loss factor of the springs at these frequencies.
    pub loss: f64,
    /// Highest order at which the mass moves on its springs; none: any.
    pub highest: Option<usize>,
    /// Round wire of which the ring is made; none: the masses are separate.
    pub wire: Option<Wire>,
}

/// Round wire.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wire {
    /// Diameter, m.
    pub diameter: f64,
    /// Material.
    pub material: ElasticMaterial,
}

/// Block of stiffness between (U, V, W) of two nodes, N/m per radian.
type Block = [[f64; 3]; 3];

/// Angular frequency of rigid springs over 0.1 √(E/ρ) over the radius of the section: 1 to 2 MHz of a wheel.
const RIGID: f64 = 1e4;

impl Wire {
    /// Mass of a ring of the radius `r`, m, kg.
    pub fn mass(&self, r: f64) -> f64 {
        self.material.density * 0.25 * PI * self.diameter * self.diameter * 2.0 * PI * r
    }

    /// Stiffness of the ring of radius `r`, m, at the order `n`.
    fn block(&self, n: usize, r: f64) -> Block {
        let n = n as f64;
        let area = 0.25 * PI * self.diameter * self.diameter;
        let bending = self.material.young * area * self.diameter * self.diameter / 16.0;
        let torsion = 2.0 * self.material.shear() * bending / self.material.young;
        let (along, curved) = (self.material.young * area / r, bending / r.powi(3));
        let square = |scale: f64, [u, v]: [f64; 2]| [[scale * u * u, scale * u * v], [scale * v * u, scale * v * v]];
        let [stretched, bent] = [square(along, [1.0, n]), square(curved, [n * n, n])];
        let plane = |i: usize, j: usize| stretched[i][j] + bent[i][j];
        let across = match n {
            0.0 => 0.0,
            _ => bending * torsion * (n * (n * n - 1.0)).powi(2) / ((bending + torsion * n * n) * r.powi(3)),
        };
        [[plane(0, 0), plane(0, 1), 0.0], [plane(1, 0), plane(1, 1), 0.0], [0.0, 0.0, across]]
    }
}

impl Attachment {
    /// Squares of the angular frequencies at the order `n`, 1/s², of the springs to the section, and of springs that
    /// hold the mass where it does not move; `rigid` is that of rigid springs.
    fn squares(&self, n: usize, rigid: f64) -> [[f64; 3]; 2] {
        let moves = self.highest.is_none_or(|highest| n <= highest);
        let tie = |own: Option<f64>| own.map_or(rigid, |w| if moves { w * w } else { 0.0 });
        let hold = |own: Option<f64>| if own.is_some() && !moves { rigid } else { 0.0 };
        [self.frequency.map(tie), self.frequency.map(hold)]
    }

    /// Returns true if `other` is the same but for its place.
    fn is_alike(&self, other: &Self) -> bool {
        *self == Self { place: self.place, ..other.clone() }
    }
}

/// Ring that a section carries.
#[derive(Debug, Clone)]
struct Carried {
    attachment: Attachment,
    /// Its node.
    node: usize,
    /// Nodes of the section with the values of their shape functions at its place.
    shares: Vec<(usize, f64)>,
    /// Pairs of nodes with the product of their factors in (Σ N_i u_i − u)², the pair of its own node last.
    pairs: Vec<(usize, f64)>,
}

/// Rings that a section carries.
#[derive(Debug, Clone, Default)]
pub(super) struct Rings {
    carried: Vec<Carried>,
    /// Square of the angular frequency of rigid springs, 1/s².
    rigid: f64,
}

impl Rings {
    /// Rings of `attachments`, each of which becomes a node of `section`, at the place of it that is nearest.
    pub fn new(section: &mut CrossSection, attachments: &[Attachment]) -> Self {
        let mut carried = Vec::new();
        for attachment in attachments {
            let Some(at) = section.nearest(attachment.place) else { continue };
            let node = section.nodes.len();
            section.nodes.push(at.place);
            let shares = at.shares.into_iter().filter(|(_, value)| *value != 0.0).collect();
            carried.push(Carried { attachment: attachment.clone(), node, shares, pairs: Vec::new() });
        }
        Self { carried, rigid: 0.0 }
    }

    /// Nodes whose motions are coupled, of those that are `free`.
    pub fn links(&self, free: &[bool]) -> Vec<[usize; 2]> {
        let of = |ring: &Carried| -> Vec<[usize; 2]> {
            let nodes = ring.shares.iter().map(|(node, _)| *node).filter(|&k| free[k]);
            let both = nodes.flat_map(|k| [[k, ring.node], [ring.node, k]]);
            both.chain([[ring.node, ring.node]]).collect()
        };
        self.carried.iter().flat_map(of).collect()
    }

    /// Returns true if there are none.
    pub fn is_empty(&self) -> bool {
        self.carried.is_empty()
    }

    /// Returns true if `other` has the same rings but for their places.
    pub fn are_alike(&self, other: &Self) -> bool {
        let alike = |(a, b): (&Carried, &Carried)| a.attachment.is_alike(&b.attachment);
        self.carried.len() == other.carried.len() && self.carried.iter().zip(&other.carried).all(alike)
    }

    /// Nodes of the rings, with their masses of each radian, kg.
    pub fn masses(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.carried.iter().map(|ring| (ring.node, ring.attachment.mass / (2.0 * PI)))
    }

    /// Fills in the index of each `pair` of nodes, and rigid springs by the shift of the section, 1/s².
    pub fn settle(&mut self, shift: f64, pair: impl Fn(usize, usize) -> Option<usize>) {
        self.rigid = RIGID * RIGID * shift.abs();
        for ring in &mut self.carried {
            let all: Vec<(usize, f64)> = ring.shares.iter().copied().chain([(ring.node, -1.0)]).collect();
            let each = all.iter().flat_map(|&(a, va)| all.iter().map(move |&(b, vb)| (a, b, va * vb)));
            ring.pairs = each.filter_map(|(a, b, product)| Some((pair(a, b)?, product))).collect();
        }
    }

    /// Stiffness of the rings and their springs at the order `n`, by pairs of nodes.
    pub fn stiffness(&self, n: usize, radius: impl Fn(usize) -> f64) -> HashMap<usize, Block> {
        let mut all: HashMap<usize, Block> = HashMap::new();
        for ring in &self.carried {
            let mass = ring.attachment.mass / (2.0 * PI);
            let [tie, hold] = ring.attachment.squares(n, self.rigid);
            for &(pair, product) in &ring.pairs {
                let block = all.entry(pair).or_default();
                (0..3).for_each(|c| block[c][c] += mass * product * tie[c]);
            }
            let Some(&(own, _)) = ring.pairs.last() else { continue };
            let block = all.entry(own).or_default();
            (0..3).for_each(|c| block[c][c] += mass * hold[c]);
            if let Some(wire) = ring.attachment.wire {
                let elastic = wire.block(n, radius(ring.node));
                block.as_flattened_mut().iter_mut().zip(elastic.as_flattened()).for_each(|(b, e)| *b += e);
            }
        }
        all
    }
}

/// Energies of modes in the springs of rings that have a loss factor.
#[derive(Debug, Clone)]
pub struct RingLoss {
    /// φᵀKφ in these springs, 1/s², `[m]`.
    pub stored: Vec<f64>,
    /// ΦᵀCΦ of their dashpots, 1/s, `[m, m]`.
    pub viscous: Mat<f64>,
}

impl Forms {
    /// Energies of the columns `x` at the order n in springs and dashpots of rings.
    pub(crate) fn ring_loss(&self, n: usize, x: MatRef<'_, f64>) -> RingLoss {
        let m = x.ncols();
        let mut loss = RingLoss { stored: vec![0.0; m], viscous: Mat::zeros(m, m) };
        let amplitude = |node: usize, c: usize, k: usize| self.amplitude(node).map_or(0.0, |first| x[(first + c, k)]);
        for ring in self.rings.carried.iter().filter(|ring| ring.attachment.loss > 0.0) {
            let Attachment { mass, frequency, loss: factor, .. } = ring.attachment;
            let [tie, _] = ring.attachment.squares(n, self.rings.rigid);
            for (c, omega) in (0..3).filter_map(|c| Some((c, frequency[c]?))) {
                let stretched = |k: usize| {
                    let section: f64 = ring.shares.iter().map(|&(node, value)| value * amplitude(node, c, k)).sum();
                    section - amplitude(ring.node, c, k)
                };
                let stretch: Vec<f64> = (0..m).map(stretched).collect();
                let stiffness = self.path.length_integral(n) * mass / (2.0 * PI) * tie[c];
                (0..m).for_each(|k| loss.stored[k] += stiffness * stretch[k] * stretch[k]);
                let dashpot = factor * stiffness / omega;
                loss.viscous += Mat::from_fn(m, m, |i, j| dashpot * stretch[i] * stretch[j]);
            }
        }
        loss
    }

    /// Returns true if rings have springs with a loss factor.
    pub(crate) fn has_lossy_rings(&self) -> bool {
        self.rings.carried.iter().any(|ring| ring.attachment.loss > 0.0)
    }

    /// Rings that the section carries.
    pub fn attachments(&self) -> impl Iterator<Item = &Attachment> {
        self.rings.carried.iter().map(|ring| &ring.attachment)
    }
}

/// Place of a section that is nearest to another place.
#[derive(Debug, Clone, PartialEq)]
pub struct NearestPlace {
    /// Place (r, y), m.
    pub place: [f64; 2],
    /// Distance, m.
    pub distance: f64,
    /// Nodes of the element there with the values of their shape functions.
    pub shares: Vec<(usize, f64)>,
}

/// Most Newton steps to a place in an element.
const STEPS: usize = 20;

impl CrossSection {
    /// Place of the section that is nearest to `place`, (r, y), m.
    pub fn nearest(&self, place: [f64; 2]) -> Option<NearestPlace> {
        let apart = |x: [f64; 2]| (x[0] - place[0]).hypot(x[1] - place[1]);
        let mut best: Option<NearestPlace> = None;
        let nearer = |best: &Option<NearestPlace>, distance: f64| best.as_ref().is_none_or(|b| distance < b.distance);
        for element in &self.elements {
            let corners = element.nodes.iter().map(|&k| self.nodes[k]);
            let size = corners
                .clone()
                .map(|x| (x[0] - self.nodes[element.nodes[0]][0]).hypot(x[1] - self.nodes[element.nodes[0]][1]));
            let (size, near) = (size.fold(0.0, f64::max), corners.map(apart).fold(f64::INFINITY, f64::min));
            let nearest = element.nodes.iter().find(|&&k| apart(self.nodes[k]) == near);
            if let Some(&node) = nearest.filter(|_| nearer(&best, near)) {
                best = Some(NearestPlace { place: self.nodes[node], distance: near, shares: vec![(node, 1.0)] });
            }
            if !nearer(&best, near - size) {
                continue;
            }
            let mut local = element.kind.middle();
            for _ in 0..STEPS {
                let shape = element.kind.shape(local, 0.0);
                let off = self.interpolated(element, &shape.value);
                let off = [place[0] - off[0], place[1] - off[1]];
                let (_, jacobian) = self.jacobian(element, &shape);
                for (k, unit) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
                    let slope = jacobian.slope(unit);
                    local[k] = (local[k] + slope[0] * off[0] + slope[1] * off[1]).clamp(-3.0, 3.0);
                }
            }
            let values = element.kind.shape(element.kind.inside(local), 0.0).value;
            let found = self.interpolated(element, &values);
            let distance = apart(found);
            if nearer(&best, distance) {
                let shares = element.nodes.iter().copied().zip(values).collect();
                best = Some(NearestPlace { place: found, distance, shares });
            }
        }
        best
    }

    /// Place (r, y) of an element with these values of its shape functions, m.
    fn interpolated(&self, element: &super::SectionElement, values: &[f64]) -> [f64; 2] {
        [0, 1].map(|c| element.nodes.iter().zip(values).map(|(&k, v)| v * self.nodes[k][c]).sum())
    }

    /// Least and largest r and y, m.
    pub fn extent(&self) -> [[f64; 2]; 2] {
        let used = self.elements.iter().flat_map(|e| &e.nodes).map(|&k| self.nodes[k]);
        used.fold([[f64::INFINITY, f64::NEG_INFINITY]; 2], |range, x| {
            [0, 1].map(|c| [range[c][0].min(x[c]), range[c][1].max(x[c])])
        })
    }
}
