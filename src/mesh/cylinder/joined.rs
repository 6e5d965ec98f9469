//! Connectivity of a ring-shaped hexahedral grid whose columns across the width are joined three by three outside
//! nested boxes.
//!
//! Seen along the width the grid is a plain one in angle and depth. Each of its vertices carries a level: at level l
//! only every 3^l-th line across the width has a node there. Where the level changes along an edge, each group of
//! three columns needs two more nodes on that edge; the cell between is filled by four hexahedra if it has two fine
//! vertices, by five if it has one (the corner of a box). The templates agree on the faces they share.

use crate::mesh::{CellKind, Cells, Facet, Mesh};
use std::collections::BTreeMap;

/// Levels and number of columns of the grid.
pub(super) struct JoinedGrid {
    /// Columns across the width, a multiple of 3^(highest level).
    pub columns: usize,
    /// Level of each angle division of half a turn, `[nh + 1]`, rising from 0 in steps of at most one; the other half
    /// mirrors it.
    pub level_theta: Vec<u32>,
    /// Level of each depth division from the bore to the running surface, `[nr + 1]`.
    pub level_r: Vec<u32>,
    /// Number of layers in the ring around the bore, all around one level below the highest; 0 for none. The boxes
    /// around the contact must not reach it.
    pub ring: usize,
}

/// Request of a depth division to the level there.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum DepthLevel {
    /// Outside the boxes around the contact: at least this level.
    Box(u32),
    /// In the ring around the bore: this level all around.
    Ring(u32),
}

impl DepthLevel {
    /// Level where the angle division asks for at least `theta`.
    fn level(self, theta: u32) -> u32 {
        match self {
            DepthLevel::Box(r) => r.max(theta),
            DepthLevel::Ring(r) => r,
        }
    }
}

/// Depth position of a node: division `k`, or half-way to the next one.
#[derive(Clone, Copy)]
pub(super) struct Depth {
    k: usize,
    half: bool,
}

impl Depth {
    /// Value there of a quantity given at the divisions.
    pub fn interpolate(self, values: &[f64]) -> f64 {
        if self.half {
            0.5 * (values[self.k] + values[self.k + 1])
        } else {
            values[self.k]
        }
    }
}

/// Bits of the boundary surfaces a node lies on.
const INNER: u8 = 1;
const OUTER: u8 = 2;
const SIDE_MINUS: u8 = 4;
const SIDE_PLUS: u8 = 8;
const CONTACT: u8 = 16;
const GROUPS: [(&str, u8); 5] =
    [("inner", INNER), ("outer", OUTER), ("side_minus", SIDE_MINUS), ("side_plus", SIDE_PLUS), ("contact", CONTACT)];

impl JoinedGrid {
    fn half(&self) -> usize {
        self.level_theta.len() - 1
    }

    /// Angle column of position `p` in `0..2 nh`: from -nh + 1 to nh.
    fn column(&self, p: usize) -> i64 {
        p as i64 - (self.half() as i64 - 1)
    }

    /// Angle column half-way between column `a` and the next one; behind column nh comes -nh + 1.
    fn between(&self, a: i64) -> f64 {
        let half = self.half() as f64;
        let middle = a as f64 + 0.5;
        if middle > half {
            middle - 2.0 * half
        } else {
            middle
        }
    }

    fn level(&self, p: usize, k: usize) -> u32 {
        self.at_depth(k).level(self.level_theta[self.column(p).unsigned_abs() as usize])
    }

    fn at_depth(&self, k: usize) -> DepthLevel {
        let ring = self.ring > 0 && k <= self.ring;
        if ring {
            DepthLevel::Ring(self.level_r[k].saturating_sub(1))
        } else {
            DepthLevel::Box(self.level_r[k])
        }
    }

    /// The four vertices (position, depth division) of a cell in angle and depth, counter-clockwise from the lowest.
    fn corners(&self, p: usize, k: usize) -> [(usize, usize); 4] {
        let next = (p + 1) % (2 * self.half());
        [(p, k), (next, k), (next, k + 1), (p, k + 1)]
    }

    /// Number of nodes and cells, from how often each level and each pair of neighbouring levels occurs.
    pub fn count(&self) -> (u64, u64) {
        let columns = self.columns as u64;
        let per = |level: u32| columns / 3u64.pow(level);
        fn tally<T: Ord>(items: impl Iterator<Item = (T, T)>, times: u64) -> BTreeMap<(T, T), u64> {
            let mut out = BTreeMap::new();
            items.for_each(|pair| *out.entry(pair).or_default() += times);
            out
        }
        let theta = &self.level_theta;
        let r: Vec<DepthLevel> = (0..self.level_r.len()).map(|k| self.at_depth(k)).collect();
        // Both ends of the half turn occur once, all else twice. A "pair" of a division with itself stands for the
        // division.
        let mut theta_at = tally(theta.iter().map(|&l| (l, l)), 2);
        for end in [theta.first(), theta.last()].into_iter().flatten() {
            theta_at.entry((*end, *end)).and_modify(|n| *n -= 1);
        }
        let theta_pairs = tally(theta.windows(2).map(|w| (w[0], w[1])), 2);
        let r_at = tally(r.iter().map(|&l| (l, l)), 1);
        let r_pairs = tally(r.windows(2).map(|w| (w[0], w[1])), 1);
        let (mut nodes, mut cells) = (0u64, 0u64);
        // Vertices, edges along either direction, cells: each has up to four corner levels.
        for (kind, thetas, rs) in
            [(0, &theta_at, &r_at), (1, &theta_pairs, &r_at), (1, &theta_at, &r_pairs), (2, &theta_pairs, &r_pairs)]
        {
            for (&(a0, a1), &times_a) in thetas {
                for (&(b0, b1), &times_b) in rs {
                    let times = times_a * times_b;
                    let levels = [b0.level(a0), b0.level(a1), b1.level(a1), b1.level(a0)];
                    let low = levels.into_iter().min().unwrap_or(0);
                    let fine = levels.iter().filter(|&&l| l == low).count();
                    if kind == 0 {
                        nodes += times * (per(low) + 1);
                    } else if kind == 1 {
                        nodes += if fine < 4 { times * 2 * per(low + 1) } else { 0 };
                    } else {
                        nodes += if fine == 1 { times * 2 * per(low + 1) } else { 0 };
                        cells += times
                            * match fine {
                                4 => per(low),
                                2 => 4 * per(low + 1),
                                _ => 5 * per(low + 1),
                            };
                    }
                }
            }
        }
        (nodes, cells)
    }

    /// Builds nodes, cells and boundary groups. `position(a, depth, j)` is the place of the node in angle column `a`
    /// (half columns between two), `in_patch(a, j)` says whether a node of the running surface belongs to the contact
    /// patch.
    pub fn build(
        &self,
        position: impl Fn(f64, Depth, usize) -> [f64; 3],
        in_patch: impl Fn(i64, usize) -> bool,
    ) -> Mesh {
        let (turn, nr) = (2 * self.half(), self.level_r.len() - 1);
        let (n_nodes, _) = self.count();
        let mut grid = Nodes {
            coords: Vec::with_capacity(n_nodes as usize),
            bits: Vec::with_capacity(n_nodes as usize),
            nr,
            vertex: vec![u32::MAX; turn * (nr + 1)],
            along: vec![u32::MAX; turn * (nr + 1)],
            down: vec![u32::MAX; turn * (nr + 1)],
            inside: vec![u32::MAX; turn * (nr + 1)],
        };
        for p in 0..turn {
            let a = self.column(p);
            for k in 0..=nr {
                let id = grid.id(p, k);
                let level = self.level(p, k);
                let surface = if k == 0 { INNER } else { 0 } | if k == nr { OUTER } else { 0 };
                grid.vertex[id] = grid.coords.len() as u32;
                for j in (0..=self.columns).step_by(3usize.pow(level)) {
                    let mut bits = surface;
                    bits |= if j == 0 { SIDE_MINUS } else { 0 } | if j == self.columns { SIDE_PLUS } else { 0 };
                    bits |= if k == nr && in_patch(a, j) { CONTACT } else { 0 };
                    grid.push(position(a as f64, Depth { k, half: false }, j), bits);
                }
                let right = self.level((p + 1) % turn, k);
                if right != level {
                    grid.along[id] = grid.coords.len() as u32;
                    for j in self.inner_lines(level.min(right)) {
                        grid.push(position(self.between(a), Depth { k, half: false }, j), surface);
                    }
                }
                if k == nr {
                    continue;
                }
                let above = self.level(p, k + 1);
                if above != level {
                    grid.down[id] = grid.coords.len() as u32;
                    for j in self.inner_lines(level.min(above)) {
                        grid.push(position(a as f64, Depth { k, half: true }, j), 0);
                    }
                }
                let levels = self.corners(p, k).map(|(p, k)| self.level(p, k));
                let low = levels.into_iter().min().unwrap_or(0);
                if levels.iter().filter(|&&l| l == low).count() == 1 {
                    grid.inside[id] = grid.coords.len() as u32;
                    for j in self.inner_lines(low) {
                        grid.push(position(self.between(a), Depth { k, half: true }, j), 0);
                    }
                }
            }
        }
        let mut cells = Cells::default();
        for p in 0..turn {
            for k in 0..nr {
                self.fill(&grid, p, k, &mut cells);
            }
        }
        let groups = groups(&cells, &grid.bits);
        Mesh { nodes: grid.coords, cells, groups, ..Mesh::default() }
    }

    /// The two inner lines of each group of three columns of `level`.
    fn inner_lines(&self, level: u32) -> impl Iterator<Item = usize> {
        let step = 3usize.pow(level);
        (0..self.columns).step_by(3 * step).flat_map(move |j| [j + step, j + 2 * step])
    }

    /// The hexahedra of one cell in angle and depth.
    fn fill(&self, grid: &Nodes, p: usize, k: usize, cells: &mut Cells) {
        let corners = self.corners(p, k);
        let levels = corners.map(|(p, k)| self.level(p, k));
        let low = levels.into_iter().min().unwrap_or(0);
        let first = corners.map(|(p, k)| grid.vertex[grid.id(p, k)]);
        let fine = [0, 1, 2, 3].map(|c| levels[c] == low);
        let count = fine.iter().filter(|&&f| f).count();
        if count == 4 {
            for g in 0..(self.columns / 3usize.pow(low)) as u32 {
                prism(cells, first.map(|n| [n + g, n + g + 1]));
            }
            return;
        }
        // Edge c leads from corner c to corner c + 1.
        let edges = [
            grid.along[grid.id(p, k)],
            grid.down[grid.id(corners[1].0, k)],
            grid.along[grid.id(p, k + 1)],
            grid.down[grid.id(p, k)],
        ];
        for g in 0..(self.columns / 3usize.pow(low + 1)) as u32 {
            // Nodes of a fine corner: the four lines of the group; of a coarse one: its two ends; of an edge or the
            // inside: the two between.
            let f = |c: usize, line: u32| first[c] + 3 * g + line;
            let t = |c: usize| [first[c] + g, first[c] + g + 1];
            let m = |start: u32| [start + 2 * g, start + 2 * g + 1];
            if count == 2 {
                // c, c + 1 fine; c + 2, c + 3 coarse.
                let c = (0..4).find(|&c| fine[c] && fine[(c + 1) % 4]).unwrap_or(0);
                let [f1, f2, c2, c1] = [c, (c + 1) % 4, (c + 2) % 4, (c + 3) % 4];
                let (i2, i1) = (m(edges[f2]), m(edges[c1]));
                let (t1, t2) = (t(c1), t(c2));
                prism(cells, [[f(f1, 1), f(f1, 2)], [f(f2, 1), f(f2, 2)], i2, i1]);
                prism(cells, [[f(f1, 0), f(f1, 1)], [f(f2, 0), f(f2, 1)], [t2[0], i2[0]], [t1[0], i1[0]]]);
                prism(cells, [[f(f1, 2), f(f1, 3)], [f(f2, 2), f(f2, 3)], [i2[1], t2[1]], [i1[1], t1[1]]]);
                prism(cells, [i1, i2, t2, t1]);
            } else {
                let c = (0..4).find(|&c| fine[c]).unwrap_or(0);
                let [a, d, b] = [(c + 1) % 4, (c + 2) % 4, (c + 3) % 4];
                let (ia, ib, id) = (m(edges[c]), m(edges[b]), m(grid.inside[grid.id(p, k)]));
                let (ta, tb, td) = (t(a), t(b), t(d));
                prism(cells, [[f(c, 1), f(c, 2)], ia, id, ib]);
                prism(cells, [[f(c, 0), f(c, 1)], [ta[0], ia[0]], [td[0], id[0]], [tb[0], ib[0]]]);
                prism(cells, [[f(c, 2), f(c, 3)], [ia[1], ta[1]], [id[1], td[1]], [ib[1], tb[1]]]);
                prism(cells, [ia, ta, td, id]);
                prism(cells, [ib, id, td, tb]);
            }
        }
    }
}

/// Adds the hexahedron over a quadrilateral that is counter-clockwise in (angle, depth), from low to high y at each
/// of its corners. (angle, y, radius) is right-handed, so the face of high y comes first.
fn prism(cells: &mut Cells, q: [[u32; 2]; 4]) {
    cells.push(CellKind::Hex8, [q.map(|line| line[1]), q.map(|line| line[0])].as_flattened());
}

/// Boundary facets: faces all of whose nodes lie on the same boundary surface.
fn groups(cells: &Cells, bits: &[u8]) -> BTreeMap<String, Vec<Facet>> {
    let mut out: BTreeMap<String, Vec<Facet>> = GROUPS.iter().map(|(n, _)| (n.to_string(), Vec::new())).collect();
    for (i, cell) in cells.iter().enumerate() {
        for face in 0..cell.kind.faces().len() {
            let common = cell.facet(face).fold(!0u8, |b, n| b & bits[n as usize]);
            for (name, bit) in GROUPS {
                if common & bit != 0 {
                    if let Some(facets) = out.get_mut(name) {
                        facets.push(Facet { cell: i as u32, face: face as u8 });
                    }
                }
            }
        }
    }
    out
}

/// Nodes made so far, and the first node of each vertex, edge and corner cell of the grid in angle and depth.
struct Nodes {
    coords: Vec<[f64; 3]>,
    bits: Vec<u8>,
    nr: usize,
    vertex: Vec<u32>,
    along: Vec<u32>,
    down: Vec<u32>,
    inside: Vec<u32>,
}

impl Nodes {
    fn id(&self, p: usize, k: usize) -> usize {
        p * (self.nr + 1) + k
    }

    fn push(&mut self, at: [f64; 3], bits: u8) {
        self.coords.push(at);
        self.bits.push(bits);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::quality::jacobian_range;
    use crate::mesh::FacetKey;
    use std::f64::consts::PI;

    /// Levels that change anywhere, at the last angle division too: every face has two cells or lies on the boundary,
    /// and no cell is turned inside out. A column half-way is within the turn.
    #[test]
    fn cells_fit_together_wherever_the_level_changes() {
        for (level_theta, level_r, ring) in [
            (vec![0, 0, 1, 1, 2], vec![2, 2, 1, 0, 0], 0),
            (vec![0, 1, 1, 1, 1], vec![1, 1, 1, 0], 0),
            (vec![0, 0, 1, 1, 2], vec![2, 2, 2, 2, 1, 0], 1),
            (vec![0, 1, 2, 2, 2], vec![2, 2, 2, 2, 1, 0], 2),
        ] {
            let (half, nr) = (level_theta.len() as f64 - 1.0, level_r.len() - 1);
            let grid = JoinedGrid { columns: 9, level_theta, level_r, ring };
            let radii: Vec<f64> = (0..=nr).map(|k| 1.0 + 0.3 * k as f64).collect();
            let position = |a: f64, depth: Depth, j: usize| {
                assert!(a > -half && a <= half, "column {a} of {half}");
                let (angle, r) = (PI * a / half, depth.interpolate(&radii));
                [r * angle.sin(), 0.1 * j as f64, r * angle.cos()]
            };
            let mesh = grid.build(position, |_, _| false);
            assert_eq!(grid.count(), (mesh.nodes.len() as u64, mesh.cells.len() as u64));
            for cell in mesh.cells.iter() {
                let [low, high] = jacobian_range(cell.kind, &cell.places(&mesh.nodes));
                assert!(low > 0.02 * high, "Jacobian from {low:e} to {high:e}");
            }
            let mut faces: BTreeMap<FacetKey, i32> = BTreeMap::new();
            for cell in mesh.cells.iter() {
                (0..cell.kind.faces().len()).for_each(|f| *faces.entry(cell.facet_key(f)).or_default() += 1);
            }
            for &facet in mesh.groups.values().flatten() {
                *faces.entry(mesh.cells.facet_key(facet)).or_default() += 1;
            }
            assert!(faces.values().all(|&n| n == 2), "{:?}", faces.iter().find(|(_, &n)| n != 2));
        }
    }
}
