//! The free surface of a body as radiators of sound: its boundary facets, divided where the surface has an edge, and
//! the flow of the modes through patches of them.

use super::radiators::{add, Key, RadiatingPatch};
use super::Radiators;
use crate::body::fe::BodyModes;
use crate::body::Fields;
use crate::mesh::{Facet, FacetKind};
use crate::parallel::World;
use faer::Mat;
use std::collections::{BTreeMap, HashMap};

/// Facets that meet at a larger angle than this belong to different parts of the surface (45°).
const EDGE: f64 = std::f64::consts::FRAC_1_SQRT_2;

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] - b[c])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Area vector of a polygon with three or four corners, m².
fn area(x: &[[f64; 3]]) -> [f64; 3] {
    // The diagonals of a quadrilateral, two sides of a triangle.
    cross(sub(x[2], x[0]), sub(x[x.len() - 1], x[1])).map(|v| 0.5 * v)
}

/// In place of the fourth corner of a triangle.
const NONE: u64 = u64::MAX;

/// Smooth part, from 0, of each facet given by its corners, global nodes, and area vector.
fn parts(corners: &[[u64; 4]], normal: &[[f64; 3]]) -> Vec<u64> {
    let mut parent: Vec<usize> = (0..corners.len()).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    let mut edges: HashMap<[u64; 2], usize> = HashMap::new();
    for (f, n) in corners.iter().enumerate() {
        let count = if n[3] == NONE { 3 } else { 4 };
        for k in 0..count {
            let (a, b) = (n[k], n[(k + 1) % count]);
            let Some(other) = edges.remove(&[a.min(b), a.max(b)]) else {
                edges.insert([a.min(b), a.max(b)], f);
                continue;
            };
            let (p, q) = (normal[f], normal[other]);
            if dot(p, q) > EDGE * (dot(p, p) * dot(q, q)).sqrt() {
                let (i, j) = (root(&mut parent, f), root(&mut parent, other));
                parent[i.max(j)] = i.min(j);
            }
        }
    }
    let mut number = HashMap::new();
    (0..corners.len())
        .map(|f| {
            let r = root(&mut parent, f);
            let next = number.len() as u64;
            *number.entry(r).or_insert(next)
        })
        .collect()
}

/// A point of a facet that stands for a piece of it.
struct Sample {
    at: [f64; 3],
    area: [f64; 3],
    /// Position on the reference facet.
    reference: [f64; 2],
}

/// A facet with nodes at `x` (m, `[nodes][3]`) divided into pieces no longer than `size`, m.
fn samples(kind: FacetKind, x: &[[f64; 3]], size: f64) -> Vec<Sample> {
    let length = |a: usize, b: usize| dot(sub(x[a], x[b]), sub(x[a], x[b])).sqrt();
    let count = |l: f64| (l / size).ceil().max(1.0) as usize;
    let point = |at: [f64; 2]| -> [f64; 3] {
        let w = kind.shape(at);
        std::array::from_fn(|c| (0..x.len()).map(|k| w[k] * x[k][c]).sum())
    };
    let piece = |corners: &[[f64; 2]], middle: [f64; 2]| {
        let places: Vec<[f64; 3]> = corners.iter().map(|&at| point(at)).collect();
        Sample { at: point(middle), area: area(&places), reference: middle }
    };
    let mut found = Vec::new();
    if kind.corners() == 3 {
        let n = count(length(0, 1).max(length(1, 2)).max(length(2, 0)));
        let at = |i: usize, j: usize| [i as f64 / n as f64, j as f64 / n as f64];
        let mut take = |corners: [[f64; 2]; 3]| {
            let middle = [0, 1].map(|c| corners.iter().map(|p| p[c]).sum::<f64>() / 3.0);
            found.push(piece(&corners, middle));
        };
        for i in 0..n {
            for j in 0..n - i {
                take([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 2 <= n {
                    take([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
        return found;
    }
    let (ns, nt) = (count(length(0, 1).max(length(3, 2))), count(length(0, 3).max(length(1, 2))));
    for i in 0..ns {
        for j in 0..nt {
            let s = [i, i + 1].map(|i| i as f64 / ns as f64);
            let t = [j, j + 1].map(|j| j as f64 / nt as f64);
            let corners = [[s[0], t[0]], [s[1], t[0]], [s[1], t[1]], [s[0], t[1]]];
            found.push(piece(&corners, [0.5 * (s[0] + s[1]), 0.5 * (t[0] + t[1])]));
        }
    }
    found
}

/// Collective: the modes of a body on patches of its surface no longer than `size` (m); on rank 0, `None` elsewhere.
pub fn radiators(world: &World, body: &dyn Fields, modes: &BodyModes, size: f64) -> Radiators {
    let part = body.mesh();
    let facets = part.boundary();
    let kind = |f: Facet| part.cells.get(f.cell as usize).kind.faces()[f.face as usize].kind;
    let places = |f: Facet| part.cells.facet(f).map(|n| part.coords[n as usize]).collect::<Vec<[f64; 3]>>();
    let corners = |f: Facet| -> [u64; 4] {
        let mut ids = part.cells.facet(f).take(kind(f).corners()).map(|n| part.node_ids[n as usize]);
        std::array::from_fn(|_| ids.next().unwrap_or(NONE))
    };
    let normal = |f: Facet| area(&places(f)[..kind(f).corners()]);
    let count = world.gather(&[facets.len() as u64]);
    let nodes = world.gather(&facets.iter().flat_map(|&f| corners(f)).collect::<Vec<u64>>());
    let normals = world.gather(&facets.iter().flat_map(|&f| normal(f)).collect::<Vec<f64>>());
    let mut numbers = Vec::new();
    if world.is_root() {
        let nodes: Vec<[u64; 4]> = nodes.chunks_exact(4).map(|n| [n[0], n[1], n[2], n[3]]).collect();
        let normals: Vec<[f64; 3]> = normals.chunks_exact(3).map(|n| [n[0], n[1], n[2]]).collect();
        let all = parts(&nodes, &normals);
        let mut rest = &all[..];
        for n in count {
            let (mine, others) = rest.split_at(n as usize);
            numbers.push(mine.to_vec());
            rest = others;
        }
    }
    let numbers = world.scatter(numbers);

    // The pieces of this rank, and the patches they are in.
    let mut patch_of: BTreeMap<Key, usize> = BTreeMap::new();
    let mut pieces = Vec::new();
    for (&f, &number) in facets.iter().zip(&numbers) {
        for sample in samples(kind(f), &places(f), size) {
            let [i, j, k] = sample.at.map(|x| (x / size).floor() as i64);
            let next = patch_of.len();
            let patch = *patch_of.entry([number as i64, i, j, k]).or_insert(next);
            pieces.push((patch, f, sample));
        }
    }
    let m = modes.omega.len();
    let mut geometry = vec![[0.0; 4]; patch_of.len()];
    for (patch, _, s) in &pieces {
        let a = dot(s.area, s.area).sqrt();
        geometry[*patch][0] += a;
        (0..3).for_each(|c| geometry[*patch][c + 1] += a * s.at[c]);
    }
    let mut flow = vec![0.0; patch_of.len() * m];
    let mut velocity = Mat::<f64>::zeros(pieces.len(), m);
    for (j, vector) in modes.vectors.iter().enumerate() {
        let u = body.at_nodes(vector);
        for (row, (patch, facet, s)) in pieces.iter().enumerate() {
            let weights = kind(*facet).shape(s.reference);
            let through: f64 = part.cells.facet(*facet).zip(weights).map(|(n, w)| w * dot(u[n as usize], s.area)).sum();
            flow[patch * m + j] += through;
            // Of unit area in the square.
            let a = dot(s.area, s.area).sqrt();
            velocity[(row, j)] = if a > 0.0 { through / a.sqrt() } else { 0.0 };
        }
    }
    let square = velocity.transpose() * &velocity;
    let square: Vec<f64> = square.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<f64>>()).collect();
    let square = world.sum_all(&square);

    // In the order of their first pieces.
    let mut keys = vec![[0; 4]; patch_of.len()];
    patch_of.into_iter().for_each(|(key, place)| keys[place] = key);
    let keys = world.all_gather(keys.as_flattened());
    let geometry = world.all_gather(geometry.as_flattened());
    let flow = world.all_gather(&flow);
    let mut patches = BTreeMap::new();
    for (p, key) in keys.chunks_exact(4).enumerate() {
        let g = &geometry[4 * p..4 * p + 4];
        let patch = RadiatingPatch { area: g[0], moment: [g[1], g[2], g[3]], flow: flow[m * p..m * (p + 1)].to_vec() };
        add(&mut patches, [key[0], key[1], key[2], key[3]], patch);
    }
    patches.retain(|_, p| p.area > 0.0);
    Radiators::new(patches, size, Mat::from_fn(m, m, |i, j| square[i + m * j]))
}
