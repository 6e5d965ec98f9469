//! Elements and border of a drawn section: made of second order, and refused where they are torn, cross or overlap.

use crate::swept::{CrossSection, SectionCell, SectionElement};
use crate::{Error, Result};
use std::collections::{BTreeMap, BTreeSet};

/// Nodes nearer than this part of the size of the section are one place.
pub(super) const SAME_PLACE: f64 = 1e-9;
/// Difference between the area of the elements and that within their boundary, over the area, from which on they
/// overlap.
const OVERLAP: f64 = 1e-6;

/// Ends of an edge in one order.
pub(super) fn key(a: usize, b: usize) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

/// A node for messages.
pub(super) fn node_text(section: &CrossSection, node: usize) -> String {
    let [r, y] = section.nodes[node];
    format!("(x = {y:.6}, y = {r:.6}) m of the drawing")
}

/// The nodes that faces have, and elements of second order of positive area.
pub(super) fn quadratic(nodes: Vec<[f64; 2]>, faces: &[Vec<usize>]) -> Result<CrossSection> {
    let mut section = CrossSection { nodes, ..CrossSection::default() };
    let mut middles: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    for face in faces {
        let corners = if matches!(face.len(), 3 | 6) { 3 } else { 4 };
        let mut nodes = face.clone();
        if nodes.len() == corners {
            for k in 0..corners {
                let [a, b] = [face[k], face[(k + 1) % corners]];
                nodes.push(*middles.entry(key(a, b)).or_insert_with(|| {
                    let [p, q] = [section.nodes[a], section.nodes[b]];
                    section.nodes.push([0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])]);
                    section.nodes.len() - 1
                }));
            }
        }
        let kind = match nodes.len() {
            6 => SectionCell::Tri6,
            8 => SectionCell::Quad8,
            9 => SectionCell::Quad9,
            n => return Err(Error::Defect(format!("a face of a section with {n} nodes"))),
        };
        let mut element = SectionElement { kind, nodes, layer: 0 };
        // Twice the area of the corners.
        let corner = |k: usize| section.nodes[element.nodes[k % corners]];
        let area: f64 = (0..corners).map(|k| corner(k)[0] * corner(k + 1)[1] - corner(k + 1)[0] * corner(k)[1]).sum();
        if area < 0.0 {
            element.turn();
        }
        section.elements.push(element);
    }
    Ok(section)
}

/// An error if two nodes are at one place, where the drawing is cut along a seam. Nodes that no element has do not
/// count.
pub(super) fn joined(section: &CrossSection) -> Result<()> {
    let used: BTreeSet<usize> = section.elements.iter().flat_map(|e| e.nodes.iter().copied()).collect();
    let size = used.iter().flat_map(|&k| section.nodes[k]).fold(0.0, |m: f64, x| m.max(x.abs()));
    let mut sorted: Vec<usize> = used.into_iter().collect();
    sorted.sort_by(|&a, &b| section.nodes[a][0].total_cmp(&section.nodes[b][0]));
    for (i, &a) in sorted.iter().enumerate() {
        let [r, y] = section.nodes[a];
        let near = sorted[i + 1..].iter().take_while(|&&b| section.nodes[b][0] - r <= SAME_PLACE * size);
        if let Some(&b) = near.clone().find(|&&b| (section.nodes[b][1] - y).abs() <= SAME_PLACE * size) {
            return Err(Error::Input(format!(
                "nodes {} and {} of the section are both at {}: its parts are not joined there (Gmsh: \
                 removeDuplicateNodes, or fragment the surfaces)",
                a + 1,
                b + 1,
                node_text(section, a)
            )));
        }
    }
    Ok(())
}

/// Edges that one element alone has, in its direction: first, last and middle node.
pub(super) fn border(section: &CrossSection) -> Result<Vec<[usize; 3]>> {
    let mut edges: BTreeMap<[usize; 2], Vec<[usize; 3]>> = BTreeMap::new();
    for element in &section.elements {
        for edge in element.kind.edges() {
            let edge = edge.map(|k| element.nodes[k]);
            edges.entry(key(edge[0], edge[1])).or_default().push(edge);
        }
    }
    if let Some((ends, _)) = edges.iter().find(|(_, of)| of.len() > 2) {
        let [a, b] = ends.map(|k| node_text(section, k));
        return Err(Error::Input(format!("more than two elements of the section share the edge from {a} to {b}")));
    }
    Ok(edges.into_values().filter(|of| of.len() == 1).flatten().collect())
}

/// An error if elements overlap, or if there are several pieces.
pub(super) fn refuse_pieces(section: &CrossSection, border: &[[usize; 3]]) -> Result<()> {
    // ∮ r dy along quadratic edges.
    let within: f64 = border
        .iter()
        .map(|edge| {
            let [a, b, m] = edge.map(|k| section.nodes[k]);
            let part = |s: f64| {
                let [f, g] = [[0.5 * s * (s - 1.0), 0.5 * s * (s + 1.0), 1.0 - s * s], [s - 0.5, s + 0.5, -2.0 * s]];
                (f[0] * a[0] + f[1] * b[0] + f[2] * m[0]) * (g[0] * a[1] + g[1] * b[1] + g[2] * m[1])
            };
            crate::quadrature::GAUSS_3.map(|(s, weight)| weight * part(s)).iter().sum::<f64>()
        })
        .sum();
    let area = section.area();
    if (area - within).abs() > OVERLAP * area {
        return Err(Error::Input(format!(
            "the elements of the section have the area {area:.6e} m², their border encloses {within:.6e} m²: \
             elements overlap or leave gaps"
        )));
    }
    let mut piece: Vec<usize> = (0..section.nodes.len()).collect();
    fn root(piece: &mut [usize], mut k: usize) -> usize {
        while piece[k] != k {
            piece[k] = piece[piece[k]];
            k = piece[k];
        }
        k
    }
    for element in &section.elements {
        for pair in element.nodes.windows(2) {
            let [a, b] = [root(&mut piece, pair[0]), root(&mut piece, pair[1])];
            piece[a] = b;
        }
    }
    let first = root(&mut piece, section.elements[0].nodes[0]);
    for element in &section.elements {
        if root(&mut piece, element.nodes[0]) != first {
            return Err(Error::Input(format!(
                "the section is in several pieces: one has a node at {}, another at {}",
                node_text(section, section.elements[0].nodes[0]),
                node_text(section, element.nodes[0])
            )));
        }
    }
    crossed(section, border)
}

/// An error if edges of the border cross: the section covers itself.
fn crossed(section: &CrossSection, border: &[[usize; 3]]) -> Result<()> {
    let chord = |e: &[usize; 3]| [section.nodes[e[0]], section.nodes[e[1]]];
    let side = |[p, q]: [[f64; 2]; 2], x: [f64; 2]| (q[0] - p[0]) * (x[1] - p[1]) - (q[1] - p[1]) * (x[0] - p[0]);
    // By their lower end in r, so that only those near each other are compared.
    let mut sorted: Vec<&[usize; 3]> = border.iter().collect();
    let low = |e: &[usize; 3]| chord(e).iter().fold(f64::INFINITY, |m, x| m.min(x[0]));
    let high = |e: &[usize; 3]| chord(e).iter().fold(f64::NEG_INFINITY, |m, x| m.max(x[0]));
    sorted.sort_by(|a, b| low(a).total_cmp(&low(b)));
    for (i, a) in sorted.iter().enumerate() {
        let top = high(a);
        for b in sorted[i + 1..].iter().take_while(|b| low(b) <= top) {
            if a[..2].iter().any(|k| b[..2].contains(k)) {
                continue;
            }
            let (p, q) = (chord(a), chord(b));
            if side(p, q[0]) * side(p, q[1]) < 0.0 && side(q, p[0]) * side(q, p[1]) < 0.0 {
                return Err(Error::Input(format!(
                    "the border of the section crosses itself near {} and {}",
                    node_text(section, a[0]),
                    node_text(section, b[0])
                )));
            }
        }
    }
    Ok(())
}

/// The running line from small to large y: an error if it has a hole, turns back or branches.
pub(super) fn line(section: &CrossSection, mut edges: Vec<[usize; 3]>) -> Result<Vec<[usize; 3]>> {
    let y = |k: usize| section.nodes[k][1];
    for edge in &mut edges {
        if y(edge[0]) > y(edge[1]) {
            edge.swap(0, 1);
        }
        // Grows along a quadratic edge if it does at both ends.
        let [first, last, middle] = edge.map(y);
        if !(4.0 * middle - 3.0 * first - last > 0.0 && 3.0 * last + first - 4.0 * middle > 0.0) {
            return Err(Error::Input(format!(
                "the running line is not a function of y between {} and {}; leave out of it what stands upright",
                node_text(section, edge[0]),
                node_text(section, edge[1])
            )));
        }
    }
    edges.sort_by(|a, b| y(a[0]).total_cmp(&y(b[0])));
    for pair in edges.windows(2) {
        if pair[0][1] != pair[1][0] {
            return Err(Error::Input(format!(
                "the running line has a hole: it ends at {} and begins again at {}",
                node_text(section, pair[0][1]),
                node_text(section, pair[1][0])
            )));
        }
    }
    Ok(edges)
}
