//! Wheels by their main dimensions.

use super::*;
use std::rc::Rc;

const STEEL_OF_WHEELS: ElasticMaterial = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };

fn curved() -> WheelShape {
    WheelShape { web: [0.022, -0.005, 0.030], hub: [-0.060, 0.110], bore_group: "bore", ..WheelShape::w920s() }
}

/// Triangles of a section with the numbers of their layers: quadrilaterals become two.
fn triangles(section: &CrossSection) -> Vec<(Vec<usize>, usize)> {
    let of = |e: &SectionElement| -> Vec<(Vec<usize>, usize)> {
        let halves = [[0, 1, 2, 4, 5, 8], [0, 2, 3, 8, 6, 7]];
        match e.kind {
            SectionCell::Tri6 => vec![(e.nodes.clone(), e.layer)],
            _ => halves.map(|t| (t.map(|k| e.nodes[k]).to_vec(), e.layer)).to_vec(),
        }
    };
    section.elements.iter().flat_map(of).collect()
}

/// A drawing of the curved wheel in triangles, finer than the program's mesh.
fn drawing() -> DrawnSection {
    let wheel = Wheel { shape: curved(), ..Wheel::w920s(0.0) };
    let section = wheel.section(even(0.002, 0.015)).unwrap();
    let faces: Vec<Vec<usize>> = triangles(&section).into_iter().map(|(face, _)| face).collect();
    let tread = section.tread.iter().filter(|e| section.nodes[e[0]][1] < section.nodes[e[1]][1]);
    let running: Vec<Vec<usize>> = tread.map(|e| e.to_vec()).collect();
    let bore: Vec<Vec<usize>> = section.edges("bore").into_iter().map(|e| e.to_vec()).collect();
    let curves = [("running".to_owned(), running), ("bore".to_owned(), bore)].into();
    DrawnSection::new(Path::Axle, section.nodes, &faces, &curves, "running").unwrap()
}

/// All modes to 6 kHz of W920S are those of a mesh with edges of 10 mm, which are short far around
/// the corners of the web.
#[test]
#[ignore = "long: scripts/validate long"]
fn frequencies_of_w920s_have_converged() {
    let sections =
        [SectionSource::Wheel(Wheel::w920s(0.0)).for_modes().unwrap(), w920s(0.0, even(0.0005, 0.01)).unwrap()];
    let spectra = sections.map(|section| {
        let forms = Forms::new(section, STEEL_OF_WHEELS, &["inner".to_owned()]).unwrap();
        spectrum(&up_to(&forms, 6000.0))
    });
    assert!(spectra[0].len() == spectra[1].len() && spectra[0].len() > 40, "{}", spectra[0].len());
    for (a, b) in spectra[0].iter().zip(&spectra[1]) {
        assert!(a.1 == b.1 && a.0 / b.0 - 1.0 < 1e-3 && a.0 / b.0 - 1.0 > -1e-4, "{a:?} {b:?}");
    }
}

/// All modes to 3 kHz of the wheel by its dimensions are those of the same wheel drawn.
#[test]
fn frequencies_of_a_wheel_by_dimensions_are_those_of_its_drawing() {
    let built = SectionSource::Wheel(Wheel { shape: curved(), ..Wheel::w920s(0.0) }).for_modes().unwrap();
    let drawn =
        SectionSource::DrawnSection { drawn: Rc::new(drawing()), offset: 0.0, mirrored: false }.for_modes().unwrap();
    let [a, b] = [&built, &drawn].map(|s| s.inertia(STEEL_OF_WHEELS));
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3 * b.abs().max(1e-2)), "{a:?} {b:?}");
    let found = [built, drawn].map(|section| {
        let forms = Forms::new(section, STEEL_OF_WHEELS, &["bore".to_owned()]).unwrap();
        spectrum(&up_to(&forms, 3000.0))
    });
    assert!(found[0].len() == found[1].len() && found[0].len() > 30, "{} {}", found[0].len(), found[1].len());
    for (a, b) in found[0].iter().zip(&found[1]) {
        assert!(a.1 == b.1 && (a.0 / b.0 - 1.0).abs() < 1e-3, "{a:?} {b:?}");
    }
}

/// A resilient wheel by its dimensions has the frequencies and strain energies of the same wheel drawn, with its ring
/// of rubber as a physical surface.
#[test]
fn a_resilient_wheel_is_its_drawing() {
    let material = ElasticMaterial { young: 20e6, poisson: 0.45, density: 1150.0 };
    let layer = SectionLayer { name: "rubber".into(), material, loss: 0.12 };
    let shape = WheelShape {
        radii: [0.075, 0.11, 0.22, 0.33, 0.358],
        hub: [-0.07, 0.07],
        web: [0.03, 0.0, 0.0],
        rim: [-0.045, 0.040, 0.070],
        bore_group: "bore",
        layer: Some((layer.clone(), [0.25, 0.266])),
        ..WheelShape::w920s()
    };
    let wheel = Wheel { shape, ..Wheel::w920s(0.0) };
    let built = SectionSource::Wheel(wheel.clone()).for_modes().unwrap();
    let fine = wheel.section(even(0.002, 0.008)).unwrap();
    let (faces, layers): (Vec<Vec<usize>>, Vec<usize>) = triangles(&fine).into_iter().unzip();
    let rubber: Vec<usize> = (0..faces.len()).filter(|k| layers[*k] == 1).collect();
    let tread = fine.tread.iter().filter(|e| fine.nodes[e[0]][1] < fine.nodes[e[1]][1]);
    let running: Vec<Vec<usize>> = tread.map(|e| e.to_vec()).collect();
    let bore: Vec<Vec<usize>> = fine.edges("bore").into_iter().map(|e| e.to_vec()).collect();
    let curves = [("running".to_owned(), running), ("bore".to_owned(), bore)].into();
    let drawn = DrawnSection::new(Path::Axle, fine.nodes.clone(), &faces, &curves, "running").unwrap();
    let all: Vec<usize> = (0..faces.len()).collect();
    for (layers, part) in [
        (vec![(layer.clone(), &rubber[..]), (layer.clone(), &rubber[..1])], "a face in common"),
        (vec![(layer.clone(), &all[..])], "the running line lies on"),
    ] {
        let error = drawn.clone().with_layers(layers).unwrap_err();
        assert!(error.message().contains(part), "{error}");
    }
    let drawn = drawn.with_layers(vec![(layer, &rubber[..])]).unwrap();
    let drawn =
        SectionSource::DrawnSection { drawn: Rc::new(drawn), offset: 0.0, mirrored: false }.for_modes().unwrap();
    let [a, b] = [&built, &drawn].map(|s| s.inertia(STEEL_OF_WHEELS));
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6 * b.abs().max(1e-2)), "{a:?} {b:?}");
    let found = [built, drawn].map(|section| {
        let forms = Forms::new(section, STEEL_OF_WHEELS, &["bore".to_owned()]).unwrap();
        up_to(&forms, 600.0)
    });
    let [a, b] = found.each_ref().map(|modes| spectrum(modes));
    assert!(a.len() == b.len() && a.len() == 8, "{a:?} {b:?}");
    for (a, b) in a.iter().zip(&b) {
        assert!(a.1 == b.1 && (a.0 / b.0 - 1.0).abs() < 1e-3, "{a:?} {b:?}");
    }
    for (a, b) in found[0].iter().zip(&found[1]) {
        for k in 0..a.omega.len() {
            // Shares of the strain energy in the rubber.
            let [x, y] = [a, b].map(|modes| modes.lost[(k, k)] / (0.12 * modes.omega[k].powi(2)));
            assert!((x - y).abs() < 1e-3 && y > 0.1, "{}: {x} {y}", a.order);
        }
    }
}

/// The mesh of W920S on its own lines, with all dimensions written out.
fn w920s_by_hand(offset: f64, places: &[[f64; 2]], focus: Focus) -> CrossSection {
    let radii: Vec<f64> = places.iter().map(|x| x[0]).collect();
    let across: Vec<f64> = places.iter().map(|x| x[1] - offset).collect();
    let r = focus.lines(&[0.095, 0.135, 0.390, 0.460, 0.488], &radii, &[0.135, 0.390]);
    let breaks = [-0.090, -0.065, -0.012, 0.012, 0.040, 0.070, 0.090].map(|y| y - offset);
    let y = focus.lines(&breaks, &across, &breaks[2..4]);
    let inside = |r: f64, y: f64| {
        let [low, high] = match r {
            r if r < 0.135 => [-0.090, 0.090],
            r if r < 0.390 => [-0.012, 0.012],
            r if r < 0.460 => [-0.065, 0.070],
            _ => [0.040, 0.070],
        };
        low < y + offset && y + offset < high
    };
    let face = |r: f64, y: f64| r > 0.460 && y == breaks[4];
    let lines = super::super::builtin::SectionLines { r: &r, y: &y };
    let mut section = lines.section_with_face(inside, |at| at, |r, _| r == 0.460, face);
    section.groups.retain(|name, _| name == "inner");
    section
}

/// Away from the corners of the web the section of W920S has the nodes and elements of its lines, and its running line
/// and bore.
#[test]
fn w920s_has_the_mesh_of_its_lines_away_from_the_corners() {
    let fine = Focus { size: 0.002, reach: 0.009, corner: 0.003, largest: 0.03 };
    let root = Wheel { height: Some(0.006), ..Wheel::w920s(0.032) };
    let spots = [[0.460, 0.040 - 0.010], [0.460 + 0.012, 0.040]];
    let at = |offset: f64| (Wheel::w920s(offset), vec![[0.460, offset]]);
    let cases = [(at(0.0), even(0.003, 0.03)), (at(-0.02), COARSE), ((root, spots.to_vec()), fine)];
    for ((wheel, spots), focus) in cases {
        let (section, lines) = (wheel.section(focus).unwrap(), w920s_by_hand(wheel.offset, &spots, focus));
        assert_eq!(section.nodes[..lines.nodes.len()], lines.nodes);
        assert!(section.tread == lines.tread && section.groups == lines.groups);
        assert!((section.volume() / lines.volume() - 1.0).abs() < 1e-12);
        let kept = lines.elements.iter().filter(|e| section.elements.contains(e)).count();
        assert!(kept < lines.elements.len() && kept > lines.elements.len() - 60, "{kept} of {}", lines.elements.len());
        let shortest = |corner: [f64; 2]| {
            let edges =
                section.elements.iter().flat_map(|e| e.kind.edges().iter().map(|[a, b, _]| [e.nodes[*a], e.nodes[*b]]));
            let ends = edges.map(|edge| edge.map(|k| section.nodes[k]));
            let there =
                ends.filter(|e| e.iter().any(|p| (p[0] - corner[0]).hypot(p[1] + wheel.offset - corner[1]) < 1e-9));
            there.map(|[p, q]| (p[0] - q[0]).hypot(p[1] - q[1])).fold(0.0, f64::max)
        };
        for corner in [[0.135, -0.012], [0.135, 0.012], [0.390, -0.012], [0.390, 0.012]] {
            assert!(shortest(corner) < 0.6e-3, "{corner:?}: {:e} m", shortest(corner));
        }
    }
}

/// Mass and moments of inertia of W920S are the sums of those of its rings, also with a ring of rubber in the rim.
#[test]
fn inertia_is_that_of_rings() {
    // Inner and outer radius, ends, and density.
    let mut rings = vec![
        ([0.095, 0.135], [-0.090, 0.090], 7860.0),
        ([0.135, 0.390], [-0.012, 0.012], 7860.0),
        ([0.390, 0.460], [-0.065, 0.070], 7860.0),
        ([0.460, 0.488], [0.040, 0.070], 7860.0),
    ];
    let rubber = ElasticMaterial { young: 20e6, poisson: 0.45, density: 1150.0 };
    let layer = SectionLayer { name: "layer".into(), material: rubber, loss: 0.1 };
    let resilient = WheelShape { layer: Some((layer, [0.400, 0.416])), ..WheelShape::w920s() };
    for (k, shape) in [WheelShape::w920s(), resilient].into_iter().enumerate() {
        if k == 1 {
            rings.push(([0.400, 0.416], [-0.065, 0.070], 1150.0 - 7860.0));
        }
        let (mut mass, mut first, mut polar, mut second) = (0.0, 0.0, 0.0, 0.0);
        for ([a, b], [low, high], density) in &rings {
            let m = density * PI * (b * b - a * a) * (high - low);
            let middle = 0.5 * (low + high);
            mass += m;
            first += m * middle;
            polar += 0.5 * m * (a * a + b * b);
            second += m * (middle * middle + (high - low) * (high - low) / 12.0);
        }
        let wanted = [mass, first / mass, polar, 0.5 * polar + second - first * first / mass];
        let found = Wheel { shape, ..Wheel::w920s(0.0) }.section(COARSE).unwrap().inertia(STEEL_OF_WHEELS);
        for (x, y) in found.iter().zip(wanted) {
            assert!((x / y - 1.0).abs() < 1e-9, "{found:?} {wanted:?}");
        }
    }
}
