use super::*;
use crate::fem::ElasticMaterial;
use crate::swept::modes::of_order;
use crate::swept::{cylinder, CylinderSection, Forms, SectionSource};
use std::f64::consts::TAU;
use std::rc::Rc;

const STEEL: ElasticMaterial = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800.0 };

/// A drawing: nodes, faces and curves.
#[derive(Clone)]
struct Drawing {
    nodes: Vec<[f64; 2]>,
    faces: Vec<Vec<usize>>,
    curves: BTreeMap<String, Vec<Vec<usize>>>,
}

impl Drawing {
    fn made(&self) -> Result<DrawnSection> {
        DrawnSection::new(Path::Axle, self.nodes.clone(), &self.faces, &self.curves, "running")
    }

    fn fault(&self) -> String {
        self.made().expect_err("refused").to_string()
    }
}

/// The ring of radii 0.1 and 0.5 m, 0.1 m wide, in `n` × `n / 4` squares, or twice as many triangles, numbered
/// clockwise or not, straight or of second order.
fn ring(n: usize, triangles: bool, second: bool) -> Drawing {
    let m = n / 4;
    let half = if second { 2 } else { 1 };
    let (rows, columns) = (half * n + 1, half * m + 1);
    let node = |i: usize, j: usize| i * columns + j;
    let place =
        |i: usize, j: usize| [0.1 + 0.4 * i as f64 / (rows - 1) as f64, -0.05 + 0.1 * j as f64 / (columns - 1) as f64];
    let nodes = (0..rows).flat_map(|i| (0..columns).map(move |j| place(i, j))).collect();
    let mut faces = Vec::new();
    for i in (0..rows - 1).step_by(half) {
        for j in (0..columns - 1).step_by(half) {
            let at = |a: usize, b: usize| node(i + a, j + b);
            // (r, y): along y first is the other way round.
            let corners = [at(0, 0), at(0, half), at(half, half), at(half, 0)];
            let middles = [at(0, 1), at(1, half), at(half, 1), at(1, 0), at(1, 1)];
            match (triangles, second) {
                (false, false) => faces.push(corners.to_vec()),
                (false, true) => faces.push([&corners[..], &middles[..4]].concat()),
                (true, false) => faces.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| corners[k]).to_vec())),
                (true, true) => {
                    let [a, b, c, d] = corners;
                    let [ab, bc, cd, da, centre] = middles;
                    faces.push(vec![a, b, c, ab, bc, centre]);
                    faces.push(vec![a, c, d, centre, cd, da]);
                }
            }
        }
    }
    let along = |i: usize| (0..columns - 1).step_by(half).map(move |j| vec![node(i, j + half), node(i, j)]).collect();
    let curves = [("inner".to_owned(), along(0)), ("running".to_owned(), along(rows - 1))].into();
    Drawing { nodes, faces, curves }
}

/// The lowest frequencies of an order of a ring whose bore is clamped, Hz.
fn frequencies(section: CrossSection, order: usize) -> Vec<f64> {
    let forms = Forms::sprung(section, STEEL, &["inner".to_owned()], &[]).expect("forms");
    of_order(&forms, order, TAU * 6000.0).expect("modes").omega.iter().take(3).map(|w| w / TAU).collect()
}

/// A drawn ring has the modes of the built-in one, whatever elements it is drawn in and wherever it is made finer.
#[test]
fn a_drawn_ring_is_the_built_in_one() {
    let spec = CylinderSection {
        inner_radius: 0.1,
        outer_radius: 0.5,
        thickness: 0.1,
        crown_radius: None,
        contact_offset: 0.02,
    };
    let wanted = frequencies(SectionSource::Cylinder(spec).for_modes().expect("section"), 2);
    assert_eq!(wanted.len(), 3);
    for (triangles, second) in [(false, false), (false, true), (true, false), (true, true)] {
        let drawn = Rc::new(ring(24, triangles, second).made().expect("a ring"));
        assert!(drawn.reach().map(|y| y.abs() - 0.05).iter().all(|d| d.abs() < 1e-15));
        let [r, slope] = drawn.running(0.013).expect("on the line");
        assert!((r - 0.5).abs() < 1e-15 && slope.abs() < 1e-12);
        assert_eq!(drawn.running(0.051), None);
        let given = SectionSource::DrawnSection { drawn, offset: 0.02, mirrored: false };
        for section in [given.for_modes(), given.for_loads(3e-3)].map(|s| s.expect("section")) {
            assert!((section.volume() / (TAU * 0.5 * (0.25 - 0.01) * 0.1) - 1.0).abs() < 1e-12);
            let found = frequencies(section, 2);
            for (f, w) in found.iter().zip(&wanted) {
                assert!((f / w - 1.0).abs() < 3e-3, "{triangles} {second}: {f} Hz, {w} Hz");
            }
        }
    }
}

/// Refinement at the contact is as fine as asked, and conforming: no edge but those of the border has an element on one
/// side alone.
#[test]
fn the_contact_is_made_finer() {
    let drawn = Rc::new(ring(12, false, true).made().expect("a ring"));
    for mirrored in [false, true] {
        let given = SectionSource::DrawnSection { drawn: Rc::clone(&drawn), offset: 0.02, mirrored };
        let section = given.for_loads(3e-3).expect("section");
        let [first, last] =
            [section.tread[0][0], section.tread[section.tread.len() - 1][1]].map(|k| section.nodes[k][1]);
        let wanted = if mirrored { [-0.03, 0.07] } else { [-0.07, 0.03] };
        assert!((first - wanted[0]).abs() < 1e-12 && (last - wanted[1]).abs() < 1e-12, "{first} {last}");
        let border = border(&section).expect("edges of two elements at the most");
        refuse_pieces(&section, &border).expect("one piece");
        joined(&section).expect("no two nodes at one place");
        line(&section, section.tread.clone()).expect("a running line");
        let near = section.tread.iter().filter(|e| section.nodes[e[2]][1].abs() < 3e-3);
        let longest = near.map(|e| section.nodes[e[1]][1] - section.nodes[e[0]][1]).fold(0.0, f64::max);
        assert!(longest > 0.0 && longest <= 1e-3 + 1e-12, "{longest}");
        // Groups grow with the edges they are on.
        let inner = section.groups["inner"].iter().map(|&k| section.nodes[k][0]).fold(0.0, f64::max);
        assert!((inner - 0.1).abs() < 1e-12);
        assert!(section.elements.len() < 3000, "{}", section.elements.len());
    }
    // Against the built-in section made for the same loads: the place of the forces alone is the same.
    let spec = CylinderSection {
        inner_radius: 0.1,
        outer_radius: 0.5,
        thickness: 0.1,
        crown_radius: None,
        contact_offset: 0.02,
    };
    let built = cylinder(&spec, Focus { size: 1e-3, reach: 4.5e-3, corner: 3e-3, largest: 0.03 }).expect("section");
    assert!((built.area() - 0.04).abs() < 1e-12);
}

/// Curved edges stay curved: a running line on an arc, quartered, is on the quadratic through its three nodes.
#[test]
fn edges_stay_on_their_curve() {
    let mut drawing = ring(12, false, true);
    let top = drawing.nodes.iter().map(|x| x[0]).fold(0.0, f64::max);
    for x in drawing.nodes.iter_mut().filter(|x| x[0] == top) {
        x[0] -= x[1] * x[1] / (2.0 * 0.3);
    }
    let drawn = Rc::new(drawing.made().expect("a crowned ring"));
    let section = SectionSource::DrawnSection { drawn: Rc::clone(&drawn), offset: 0.0, mirrored: false }
        .for_loads(3e-3)
        .expect("section");
    for &k in section.tread.iter().flatten() {
        let [r, y] = section.nodes[k];
        assert!((r - (top - y * y / 0.6)).abs() < 1e-12, "{r} {y}");
    }
    let [r, slope] = drawn.running(0.03).expect("on the line");
    assert!((r - (top - 0.03 * 0.03 / 0.6)).abs() < 1e-12 && (slope + 0.03 / 0.3).abs() < 1e-9);
}

#[test]
fn what_cannot_be_a_section_is_refused() {
    let good = ring(16, false, false);
    let with = |change: &dyn Fn(&mut Drawing)| {
        let mut drawing = good.clone();
        change(&mut drawing);
        drawing.fault()
    };
    let says = |text: String, words: &[&str]| assert!(words.iter().all(|w| text.contains(w)), "{text}");
    let running = |d: &mut Drawing| d.curves.remove("running").expect("a running line");
    says(with(&|d| drop(running(d))), &["no physical curve \"running\"", "inner"]);
    let hole = |d: &mut Drawing| {
        let mut line = running(d);
        line.remove(1);
        d.curves.insert("running".into(), line);
    };
    says(with(&hole), &["hole", "ends at (x = -0.025", "begins again at (x = 0.000"]);
    let round = |d: &mut Drawing| {
        let mut line = running(d);
        let last = d.nodes.len() - 1;
        line.push(vec![last, last - 5]);
        d.curves.insert("running".into(), line);
    };
    says(with(&round), &["not a function of y"]);
    let within = |d: &mut Drawing| drop(d.curves.insert("web".into(), vec![vec![6, 7]]));
    says(with(&within), &["\"web\"", "not on the border"]);
    says(with(&|d| d.nodes.iter_mut().for_each(|x| x[0] -= 0.2)), &["beyond the axle", "beside the axle"]);
    says(with(&|d| d.nodes[6] = [0.3, 0.2]), &["Jacobian"]);
    says(with(&|d| d.faces.push(d.faces[0].clone())), &["more than two elements"]);
    let seam = |d: &mut Drawing| {
        let place = d.nodes[6];
        d.nodes.push(place);
        let last = d.nodes.len() - 1;
        let node = d.faces[0].iter_mut().find(|k| **k == 6).expect("a corner");
        *node = last;
    };
    says(with(&seam), &["both at (x = -0.025", "not joined"]);
    let apart = |d: &mut Drawing| {
        let first = d.nodes.len();
        d.nodes.extend([[0.1, 0.2], [0.1, 0.3], [0.2, 0.3]]);
        d.faces.push(vec![first, first + 1, first + 2]);
    };
    says(with(&apart), &["several pieces", "x = 0.2"]);
    // A face folded back, and a strip that curls round into the ring.
    let strip = |places: [[f64; 2]; 3]| {
        move |d: &mut Drawing| {
            let (first, last) = (d.nodes.len(), d.nodes.len() - 1);
            d.nodes.extend(places);
            d.faces.push(vec![last - 1, last, first]);
            d.faces.push(vec![first, last, first + 1]);
            d.faces.push(vec![last, first + 1, first + 2]);
        }
    };
    says(with(&strip([[0.55, 0.06], [0.44, 0.02], [0.43, 0.0]])), &["overlap"]);
    says(with(&strip([[0.55, 0.06], [0.44, 0.1], [0.44, 0.0]])), &["crosses itself"]);
    let drawn = Rc::new(ring(8, false, false).made().expect("a ring"));
    let beside = SectionSource::DrawnSection { drawn, offset: 0.07, mirrored: false }
        .for_modes()
        .expect_err("beside")
        .to_string();
    says(beside, &["y = 0.07", "from -0.05 to 0.05 m"]);
    let mut steep = ring(8, false, false);
    steep.nodes.iter_mut().filter(|x| x[0] > 0.49).for_each(|x| x[0] -= 0.5 * x[1]);
    let cone = Rc::new(steep.made().expect("a cone"));
    says(cone.refuse_steep(0.0).expect_err("steep").to_string(), &["slope -0.50", "at most 0.2"]);
    SectionSource::DrawnSection { drawn: cone, offset: 0.0, mirrored: false }
        .for_modes()
        .expect("a frame along the cone");
    let mut steep = ring(8, false, false);
    steep.nodes.iter_mut().for_each(|x| x[0] += 0.5 - 6.0 * x[1]);
    let wall = Rc::new(steep.made().expect("a wall"));
    says(
        SectionSource::DrawnSection { drawn: wall, offset: 0.0, mirrored: false }
            .for_modes()
            .expect_err("steep")
            .to_string(),
        &["slope -6.00", "80 degrees"],
    );
}
