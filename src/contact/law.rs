//! The laws of Signorini and Coulomb at a node, as projections, with their derivative (`docs/explanation/contact.md`).
//!
//! From the pressure p and the traction t of a node, its gap and its creep there follow the projections q = max(0, p
//! − ρ_n g) and Proj(z), z = t − ρ_t ṡ, on the disc of radius μ q; the status; the natural map, which is zero where
//! the laws hold; and its [`Tangent`] in rows that stay regular where a node begins to slide: no law is ever divided
//! by the velocity of sliding.

use super::memory::LinearMemory;

/// Projection on the half-line p ≥ 0.
pub fn project_normal(p: f64) -> f64 {
    p.max(0.0)
}

/// |z|; without the care of `hypot` for numbers whose squares overflow, which takes longer than the rest of the laws.
pub(crate) fn size(z: [f64; 2]) -> f64 {
    (z[0] * z[0] + z[1] * z[1]).sqrt()
}

/// The unit vector across `direction`, a quarter turn ahead of it.
pub fn across(direction: [f64; 2]) -> [f64; 2] {
    [-direction[1], direction[0]]
}

pub(crate) fn product(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Projection on the disc of radius `radius` ≥ 0.
pub fn project_disc(z: [f64; 2], radius: f64) -> [f64; 2] {
    let norm = size(z);
    if norm <= radius {
        z
    } else {
        let f = radius / norm;
        [f * z[0], f * z[1]]
    }
}

/// Status of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// No contact.
    Open = 0,
    /// Contact without sliding.
    Stick = 1,
    /// Contact with sliding.
    Slip = 2,
}

/// Augmentation parameters of a node, arbitrary and positive; 0 along a surface on which the node cannot move.
#[derive(Debug, Clone, Copy)]
pub struct Augmentation {
    /// ρ_n, pressure per gap.
    pub normal: f64,
    /// ρ_t, traction per creep.
    pub tangential: f64,
}

/// State of a node in the laws. Stresses and nodal forces serve alike, and so do velocities and displacements over a
/// step.
#[derive(Debug, Clone, Copy)]
pub struct Node {
    /// Pressure p.
    pub pressure: f64,
    /// Traction t on body 1.
    pub traction: [f64; 2],
    /// Gap g.
    pub gap: f64,
    /// Creep ṡ.
    pub creep: [f64; 2],
}

impl Node {
    /// The projections with the coefficient of friction `friction` at this creep.
    #[inline(always)]
    pub fn project(&self, rho: Augmentation, friction: f64) -> Projected {
        let pressure = project_normal(self.pressure - rho.normal * self.gap);
        let z = [0, 1].map(|c| self.traction[c] - rho.tangential * self.creep[c]);
        let (length, bound) = (size(z), friction * pressure);
        let (traction, sticks) = if length <= bound {
            (z, true)
        } else {
            let f = bound / length;
            ([f * z[0], f * z[1]], false)
        };
        let status = match sticks {
            _ if pressure == 0.0 => Status::Open,
            true => Status::Stick,
            false => Status::Slip,
        };
        Projected { pressure, traction, status, z, length, friction, tangential: rho.tangential }
    }
}

/// The projections at a node.
#[derive(Debug, Clone, Copy)]
pub struct Projected {
    /// Projected pressure q.
    pub pressure: f64,
    /// Projected traction.
    pub traction: [f64; 2],
    /// The status that the projections find.
    pub status: Status,
    z: [f64; 2],
    length: f64,
    friction: f64,
    tangential: f64,
}

impl Projected {
    /// The natural map (x, y, n): t − Proj(z), p − q. All zero if and only if the laws hold.
    #[inline(always)]
    pub fn map(&self, node: &Node) -> [f64; 3] {
        let t = [0, 1].map(|c| node.traction[c] - self.traction[c]);
        [t[0], t[1], node.pressure - self.pressure]
    }

    /// The derivative of the projected (traction x, y, pressure) by what is projected, (t − ρ_t ṡ, p − ρ_n g), at a
    /// coefficient of friction that does not change: rows and columns (x, y, n).
    pub fn derivative(&self) -> [[f64; 3]; 3] {
        match self.status {
            Status::Open => [[0.0; 3]; 3],
            // Without friction nothing sticks.
            Status::Stick => {
                let held = if self.friction > 0.0 { 1.0 } else { 0.0 };
                [[held, 0.0, 0.0], [0.0, held, 0.0], [0.0, 0.0, 1.0]]
            }
            Status::Slip => {
                let [x, y] = self.z.map(|z| z / self.length);
                let a = self.friction * self.pressure / self.length;
                [
                    [a * y * y, -a * x * y, self.friction * x],
                    [-a * x * y, a * x * x, self.friction * y],
                    [0.0, 0.0, 1.0],
                ]
            }
        }
    }

    /// The derivative of the map of `node`, whose friction has the slope dμ/d|ṡ| there.
    pub fn tangent(&self, node: &Node, slope: f64) -> Tangent {
        match self.status {
            Status::Open => Tangent::Open,
            // Without friction nothing sticks.
            Status::Stick if self.friction > 0.0 => Tangent::Stick { creep: self.tangential },
            _ => {
                let long = self.length > 0.0;
                let direction = if long { self.z.map(|z| -z / self.length) } else { [-1.0, 0.0] };
                let a = if long { (self.friction * self.pressure / self.length).min(1.0) } else { 0.0 };
                let unit = |v: f64| if v > 0.0 { node.creep.map(|s| s / v) } else { [0.0; 2] };
                let falling = match slope {
                    0.0 => [0.0; 2],
                    _ => unit(size(node.creep)).map(|s| self.pressure * slope * s),
                };
                Tangent::Slip(Slip {
                    direction,
                    friction: self.friction,
                    across: [1.0 - a, a * self.tangential],
                    falling,
                })
            }
        }
    }
}

/// The linearised laws of a node: rows on the changes of its traction, pressure, creep and gap. A closed node keeps
/// δg = 0, an open one δp = 0; what is said of the traction depends on the status.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tangent {
    /// δt = 0.
    Open,
    /// `creep` δṡ = 0.
    Stick {
        /// Coefficient of the creep.
        creep: f64,
    },
    /// Along and across the sliding.
    Slip(Slip),
}

/// The rows of a sliding node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slip {
    /// Direction of sliding τ, a unit vector, against the traction.
    pub direction: [f64; 2],
    /// Coefficient of friction μ: τ·δt + μ δp + `falling`·δṡ = 0.
    pub friction: f64,
    /// Coefficients of δt and δṡ across τ: (1 − a, a ρ) with a = μ q/|z|, or any multiple of both, as (|ṡ|, μ p)
    /// where the laws hold.
    pub across: [f64; 2],
    /// p dμ/d|ṡ| in the direction of the creep.
    pub falling: [f64; 2],
}

impl Slip {
    /// State of steady sliding that satisfies the laws: sliding along `direction` (a unit vector) at `velocity` ≥ 0
    /// under the pressure or force `pressure`, with the coefficient of friction `friction` and its slope there.
    pub fn steady(pressure: f64, direction: [f64; 2], velocity: f64, friction: f64, slope: f64) -> Self {
        let falling = direction.map(|t| pressure * slope * t);
        Self { direction, friction, across: [velocity, friction * pressure], falling }
    }
}

impl Tangent {
    /// The two rows about the traction for changes of traction, pressure and creep: along and across the sliding;
    /// where nothing slides, along x and y.
    #[inline(always)]
    pub fn rows(&self, traction: [f64; 2], pressure: f64, creep: [f64; 2]) -> [f64; 2] {
        match self {
            Tangent::Open => traction,
            Tangent::Stick { creep: c } => creep.map(|s| c * s),
            Tangent::Slip(s) => {
                let e = across(s.direction);
                [
                    product(s.direction, traction) + s.friction * pressure + product(s.falling, creep),
                    s.across[0] * product(e, traction) + s.across[1] * product(e, creep),
                ]
            }
        }
    }

    /// Coefficients of the two rows along x and y: of the traction, of the pressure, of the creep.
    pub fn plane(&self) -> ([[f64; 2]; 2], [f64; 2], [[f64; 2]; 2]) {
        let unit = |c: f64| [[c, 0.0], [0.0, c]];
        match self {
            Tangent::Open => (unit(1.0), [0.0; 2], unit(0.0)),
            Tangent::Stick { creep } => (unit(0.0), [0.0; 2], unit(*creep)),
            Tangent::Slip(s) => {
                let (d, e) = (s.direction, across(s.direction));
                let of = |along: [f64; 2], c: f64| [0, 1].map(|p| [0, 1].map(|q| d[p] * along[q] + c * e[p] * e[q]));
                (of(d, s.across[0]), d.map(|d| s.friction * d), of(s.falling, s.across[1]))
            }
        }
    }

    /// Change of the traction per change of the pressure where the creep stays: −μ τ.
    pub fn friction(&self) -> [f64; 2] {
        match self {
            Tangent::Slip(s) => s.direction.map(|t| -s.friction * t),
            _ => [0.0; 2],
        }
    }

    /// The tractions that the creep makes, δt = −μ τ δp + Σ b f: their directions b, across the sliding first, and
    /// the coefficient c in c f + b·δṡ = 0. It is 0 where a node sticks, and directions in which the creep makes no
    /// traction are left out.
    pub fn yielding(&self) -> impl Iterator<Item = ([f64; 2], f64)> {
        let pairs = match self {
            Tangent::Open => [None, None],
            Tangent::Stick { .. } => [Some(([1.0, 0.0], 0.0)), Some(([0.0, 1.0], 0.0))],
            Tangent::Slip(s) => {
                let along = product(s.direction, s.falling);
                let coefficient = |traction: f64, creep: f64| (creep != 0.0).then(|| traction / creep);
                [
                    coefficient(s.across[0], s.across[1]).map(|c| (across(s.direction), c)),
                    coefficient(1.0, along).map(|c| (s.direction, c)),
                ]
            }
        };
        pairs.into_iter().flatten()
    }
}

impl Tangent {
    /// D in δt = −μ τ δp − D δṡ; none where the node sticks or is about to, and nothing bounds D.
    pub fn resistance(&self) -> Option<[[f64; 2]; 2]> {
        let mut d = [[0.0; 2]; 2];
        for (b, coefficient) in self.yielding() {
            let factor = 1.0 / coefficient;
            if !factor.is_finite() {
                return None;
            }
            (0..2).for_each(|p| (0..2).for_each(|q| d[p][q] += factor * b[p] * b[q]));
        }
        Some(d)
    }
}

/// A contact linearised about a steady state, in nodal forces: its k closed nodes on an interface of n.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LinearContact {
    /// The closed nodes, `[k]`.
    pub nodes: Vec<LinearNode>,
    /// How the creep at the leading edge follows the gaps ahead of it.
    pub edges: Vec<LinearEdge>,
    /// The coefficients of friction of those nodes that remember theirs, from the leading edge on; empty where none
    /// changes.
    pub memory: Vec<LinearMemory>,
}

/// The course of w at the first closed node of a line, which goes with where the gaps ahead of it put the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearEdge {
    /// Place of the node in the list of closed ones.
    pub at: usize,
    /// The two open nodes and the change of V ∂w/∂x (x, y) with the gap there, 1/s.
    pub gaps: [(usize, [f64; 2]); 2],
}

/// A closed node of a [`LinearContact`].
#[derive(Debug, Clone, PartialEq)]
pub struct LinearNode {
    /// Its place on the interface (rows 3i + c of the bodies).
    pub node: usize,
    /// The linearised laws, N, m/s.
    pub tangent: Tangent,
    /// V ∂/∂x at the node, which with λ makes the creep of a displacement: pairs (node, coefficient in 1/s); empty
    /// where nothing rolls.
    pub convection: Vec<(usize, f64)>,
}

impl LinearContact {
    /// Number of nodes that stick.
    pub fn sticking(&self) -> usize {
        self.nodes.iter().filter(|n| matches!(n.tangent, Tangent::Stick { .. })).count()
    }

    /// Returns whether `other` has the same closed nodes, with the same status, so that the two differ in their numbers
    /// alone.
    pub fn alike(&self, other: &Self) -> bool {
        let nodes = |c: &Self| -> Vec<_> {
            let of = |n: &LinearNode| (n.node, std::mem::discriminant(&n.tangent), n.tangent.yielding().count());
            c.nodes.iter().map(of).collect()
        };
        let edges = |c: &Self| c.edges.iter().map(|e| e.at).collect::<Vec<_>>();
        let memory = |c: &Self| c.memory.iter().map(|m| (m.at, m.upstream)).collect::<Vec<_>>();
        nodes(self) == nodes(other) && edges(self) == edges(other) && memory(self) == memory(other)
    }

    /// All of it as numbers, for [`LinearContact::from_numbers`].
    pub fn numbers(&self) -> Vec<f64> {
        let mut out = vec![self.edges.len() as f64, self.memory.len() as f64];
        for edge in &self.edges {
            out.push(edge.at as f64);
            out.extend(edge.gaps.iter().flat_map(|&(node, [x, y])| [node as f64, x, y]));
        }
        out.extend(self.memory.iter().flat_map(LinearMemory::numbers));
        for n in &self.nodes {
            let (kind, values) = match n.tangent {
                Tangent::Open => (0.0, [0.0; 7]),
                Tangent::Stick { creep } => (1.0, [creep, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
                Tangent::Slip(Slip { direction: [a, b], friction, across: [c, d], falling: [e, f] }) => {
                    (2.0, [a, b, friction, c, d, e, f])
                }
            };
            out.extend([n.node as f64, kind]);
            out.extend(values);
            out.push(n.convection.len() as f64);
            out.extend(n.convection.iter().flat_map(|&(j, v)| [j as f64, v]));
        }
        out
    }

    /// Restores the law from the output of [`LinearContact::numbers`].
    pub fn from_numbers(numbers: &[f64]) -> Self {
        let mut nodes = Vec::new();
        let (head, rest) = numbers.split_at(numbers.len().min(2));
        let [edges, count] = [0, 1].map(|k| head.get(k).map_or(0, |n| *n as usize));
        let (edges, rest) = rest.split_at((7 * edges).min(rest.len()));
        let edge = |&[at, i, a, b, j, c, d]: &[f64; 7]| LinearEdge {
            at: at as usize,
            gaps: [(i as usize, [a, b]), (j as usize, [c, d])],
        };
        let edges = edges.chunks_exact(7).filter_map(|c| c.try_into().ok()).map(edge).collect();
        let (memory, mut rest) = rest.split_at((8 * count).min(rest.len()));
        let memory = memory.chunks_exact(8).filter_map(|c| c.try_into().ok()).map(LinearMemory::from_numbers).collect();
        while let [node, kind, a, b, friction, c, d, e, f, count, tail @ ..] = rest {
            let tangent = match *kind as u8 {
                0 => Tangent::Open,
                1 => Tangent::Stick { creep: *a },
                _ => Tangent::Slip(Slip {
                    direction: [*a, *b],
                    friction: *friction,
                    across: [*c, *d],
                    falling: [*e, *f],
                }),
            };
            let (terms, after) = tail.split_at((2 * *count as usize).min(tail.len()));
            let convection = terms.chunks_exact(2).map(|t| (t[0] as usize, t[1])).collect();
            nodes.push(LinearNode { node: *node as usize, tangent, convection });
            rest = after;
        }
        Self { nodes, edges, memory }
    }
}

#[cfg(test)]
mod tests;
