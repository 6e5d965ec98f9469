use super::*;
use crate::dense::symmetric_eigen;
use crate::fem::ElasticMaterial;
use crate::rails::R60E1;
use crate::sound::Radiation;
use crate::swept::infinite::{ForcePlace, InfiniteRailSpec};
use crate::swept::{
    BuiltRail, CrossSection, LoadPatch, RailTrack, SectionCell, SectionContact, SectionElement, SleeperLayer,
    TrackLayer,
};
use faer::linalg::solvers::Solve;
use std::collections::BTreeMap;

const AIR: Air = Air { density: 1.2, speed: 343.0 };
const STEEL: ElasticMaterial = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };

/// A round bar of the radius `radius`, m, with the contact point on top of it.
fn round(radius: f64) -> CrossSection {
    const CELLS: usize = 4;
    const LINE: usize = 2 * CELLS + 1;
    let node = |i: usize, j: usize| i * LINE + j;
    let place = |k: usize| {
        let [u, v] = [k / LINE, k % LINE].map(|c| c as f64 / CELLS as f64 - 1.0);
        // A square becomes a circle.
        [radius * (u * (1.0 - 0.5 * v * v).sqrt() - 1.0), radius * v * (1.0 - 0.5 * u * u).sqrt()]
    };
    let element = |k: usize| {
        let (i, j) = (2 * (k / CELLS), 2 * (k % CELLS));
        let corners = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1], [1, 1]];
        SectionElement { kind: SectionCell::Quad9, nodes: corners.map(|[a, b]| node(i + a, j + b)).to_vec(), layer: 0 }
    };
    let last = LINE - 1;
    let tread = (0..CELLS).map(|k| [node(last, 2 * k), node(last, 2 * k + 2), node(last, 2 * k + 1)]).collect();
    CrossSection {
        nodes: (0..LINE * LINE).map(place).collect(),
        elements: (0..CELLS * CELLS).map(element).collect(),
        groups: BTreeMap::new(),
        tread,
        layers: Vec::new(),
    }
}

/// With its far fields.
fn complete<'a>(rail: &'a Infinite, bands: &Bands) -> RailRadiators<'a> {
    let radiators = RailRadiators::new(rail, AIR, bands);
    let parts = [0, 1].map(|part| radiators.far(part, 2).expect("far fields"));
    let all: Vec<f64> = parts[0].iter().zip(&parts[1]).map(|(a, b)| a + b).collect();
    radiators.complete(&all)
}

/// A thin round bar that bends like Euler's beam: each wavenumber moves a cylinder to and fro, whose radiation is
/// that of H_1. Above its critical frequency and below it. What waves do not travel is in it. A force farther along
/// the bar radiates with the one at its origin as the distance says; one along the bar by its lever, the radius, as a
/// couple: +iξR times what the force across moves.
#[test]
fn a_round_bar_radiates_as_a_beam_of_moving_cylinders() {
    const DISTANCE: f64 = 0.23;
    let (radius, loss) = (0.01, 0.05);
    let place = |along: f64| ForcePlace {
        patch: LoadPatch::Circle { radius: 2e-3 },
        contact: SectionContact::level(1.0).at_place(along),
        tilt: 0.0,
    };
    let making = InfiniteRailSpec {
        section: round(radius),
        material: STEEL,
        track: None,
        angle: 0.0,
        loss,
        places: [0.0, DISTANCE].map(place).to_vec(),
    };
    let rail = Infinite::new(&making, 2.0 * PI * 3000.0).expect("rail");
    let bands = Bands::spanning(100.0, 2000.0);
    let radiators = complete(&rail, &bands);
    let (area, inertia) = (PI * radius * radius, PI * radius.powi(4) / 4.0);
    // Its critical frequency is about 640 Hz.
    for f in [200.0, 500.0, 900.0, 2000.0] {
        let (omega, k) = (2.0 * PI * f, AIR.wave_number(f));
        let stiff = Complex64::new(1.0, loss) * STEEL.young * inertia;
        // With the inertia of turning sections, and their shear (G. R. Cowper's factor 6(1 + ν)/(7 + 6ν)).
        let sheared = STEEL.shear() * area * 6.0 * 1.3 / (7.0 + 1.8) * Complex64::new(1.0, loss);
        let turned = |xi: f64| sheared + stiff * xi * xi - STEEL.density * inertia * omega * omega;
        let response = |xi: f64| {
            let turned = turned(xi);
            let moved = sheared * xi * xi - STEEL.density * area * omega * omega;
            (moved - (sheared * xi).powi(2) / turned).inv()
        };
        let power = |xi: f64| {
            let kappa = (k * k - xi * xi).sqrt();
            let z = kappa * radius;
            let of = |n: i32| Complex64::new(libm::jn(n, z), -libm::yn(n, z));
            let slope = 0.5 * (of(0) - of(2));
            let d = 16.0 / (kappa * kappa * slope.norm_sqr());
            omega * AIR.density / (8.0 * PI) * PI * d * omega * omega * response(xi).norm_sqr() / PI
        };
        let steps = 40_000;
        let weighted = |weight: &dyn Fn(f64) -> f64| -> f64 {
            let xi = |i: usize| k * (i as f64 + 0.5) / steps as f64;
            (0..steps).map(|i| k / steps as f64 * power(xi(i)) * weight(xi(i))).sum()
        };
        let wanted = weighted(&|_| 1.0);
        let found = radiators.at(f).expect("powers");
        let [free, plane] = [&found[0], &found[1]].map(|of| [0, 1, 2].map(|c| of[(c, c)].re));
        // Sideways it moves as much, and twists without a sound; what the force makes of its surroundings is not in
        // the beam, and counts the more the faster it goes.
        let good = 0.06 * (f / 900.0).max(1.0);
        for power in &free[1..3] {
            let off = 10.0 * (power / wanted).log10();
            assert!(off.abs() < good, "{f} Hz: {power} W/N² for {wanted}, {off:.3} dB");
        }
        // Along it, it bends the bar by its lever, the radius.
        let cross = found[0][(1, 2)].re;
        assert!(free[0] < 6e-2 * free[2] && cross.abs() < 2e-4 * free[2], "{f} Hz: {free:?}, {cross}");
        assert!(plane[2] > free[2], "{f} Hz: {plane:?}, {free:?}");
        // Both across; and the one at the origin across, the other along the bar.
        // A couple turns the section, whose shear takes a part of it.
        let lever = |xi: f64| radius * xi * (sheared / turned(xi)).re;
        let scale = [wanted, (wanted * weighted(&|xi| lever(xi).powi(2))).sqrt()];
        let apart = [weighted(&|xi| (DISTANCE * xi).cos()), -weighted(&|xi| lever(xi) * (DISTANCE * xi).sin())];
        for ((j, wanted), scale) in [5, 3].into_iter().zip(apart).zip(scale) {
            let off = (found[0][(2, j)] - wanted).norm() / scale;
            println!("{f} Hz, {j}: {} for {wanted} W/N², {off:.1e}", found[0][(2, j)]);
            assert!(off < 0.01 * (f / 900.0).max(1.0), "{f} Hz, {j}: {} for {wanted} W/N²", found[0][(2, j)]);
        }
    }
}

/// 60E1 on usual pads and sleepers.
fn rail(reach: f64) -> Infinite {
    rail_under(reach, &[0.0])
}

/// The same under forces at some places along it, m.
fn rail_under(reach: f64, along: &[f64]) -> Infinite {
    let section = BuiltRail::new(&R60E1, 0.01).expect("rail");
    let pad = TrackLayer::with_loss([300e6, 40e6, 40e6].map(|s| s / 0.6), 0.2, 60.0);
    let ballast = TrackLayer::with_loss([100e6, 70e6, 70e6].map(|s| s / 0.6), 1.0, 250.0);
    let place = |along: f64| ForcePlace {
        patch: LoadPatch::Circle { radius: 3e-3 },
        contact: SectionContact::level(1.0).at_place(along),
        tilt: -section.contact().angle,
    };
    let making = InfiniteRailSpec {
        section: section.for_modes().expect("section"),
        material: STEEL,
        track: Some(RailTrack { pad, sleeper: Some(SleeperLayer { mass: 250.0, ballast }) }),
        angle: section.contact().angle,
        loss: 0.02,
        places: along.iter().map(|&along| place(along)).collect(),
    };
    Infinite::new(&making, 2.0 * PI * reach).expect("rail")
}

/// The power through the surface is that in the far field, for any motions of the rail, and what one radiates by
/// another's pressure is mutual.
#[test]
fn powers_are_the_same_near_and_far() {
    let rail = rail(3000.0);
    let radiators = RailRadiators::new(&rail, AIR, &Bands::spanning(100.0, 4000.0));
    let (surface, q) = (&radiators.meshed.surface, 12);
    // Mixtures of all motions.
    let mix = Mat::from_fn(radiators.normal.ncols(), q, |i, j| ((7 * i + 5 * j * j) as f64).sin());
    let velocity = &radiators.normal * mix;
    for kappa in [0.3, 4.0, 15.0, 33.0, 60.0] {
        let pressure = pressures(surface, kappa, velocity.as_ref()).expect("pressures");
        let count = directions(kappa, 0.2);
        let d = far(surface, kappa, velocity.as_ref(), &pressure, count);
        let nodes = surface.nodes();
        let through = Mat::from_fn(q, q, |i, j| -> Complex64 {
            let all = (0..nodes.len()).map(|k| nodes[k].length * velocity[(k, i)] * pressure[(k, j)]);
            Complex64::i() * all.sum::<Complex64>()
        });
        for i in 0..q {
            for j in 0..q {
                let away: Complex64 = (0..count).map(|k| d[(k, i)].conj() * d[(k, j)]).sum();
                let away = away / (4.0 * count as f64);
                let size = (through[(i, i)].norm() * through[(j, j)].norm()).sqrt();
                let mutual = (through[(i, j)] - through[(j, i)]).norm() / size;
                let apart = (through[(i, j)].re - away.re).abs() / size;
                assert!(mutual < 2e-3 && apart < 2e-3, "κ {kappa}, {i} {j}: {mutual:.1e}, {apart:.1e}");
            }
        }
    }
}

/// Between the frequencies of the grid the power of a force is within 0.1 dB of the exact one, whatever its
/// direction, and positive; a rail radiates little more than a plane wave would, and far less at low frequencies.
#[test]
fn powers_are_interpolated() {
    let rail = rail(5100.0);
    let bands = Bands::spanning(100.0, 4000.0);
    let radiators = complete(&rail, &bands);
    let grid = radiators.frequencies(&bands);
    assert!(grid.len() > 200 && grid.windows(2).all(|w| w[0] < w[1] && w[1] < 1.02 * w[0]), "{grid:?}");
    for g in [3, 60, 120, 170, 200, 230, 260] {
        let Some(four) = grid.get(g..g + 4) else { continue };
        let middle = (four[1] * four[2]).sqrt();
        let found = radiators.powers(&[four, &[middle]].concat(), 0, 1).expect("powers");
        let ends = [0, 1].map(|kind| &found[kind][..4 * 18]);
        let radiation = Radiation::new(bands, four.to_vec(), FORCES, ends);
        let unit = |c: usize| -> Vec<Complex64> {
            (0..FORCES).map(|k| Complex64::new(f64::from(u8::from(k == c)), 0.0)).collect()
        };
        let mixed = vec![Complex64::new(0.3, 0.1), Complex64::new(-0.5, 0.6), Complex64::new(1.0, -0.2)];
        for x in [unit(0), unit(1), unit(2), mixed] {
            let powers = radiation.power(middle, &x);
            for kind in 0..2 {
                let at = &found[kind][4 * 18..];
                let entry = |i: usize, j: usize| Complex64::new(at[i + 3 * j], at[9 + i + 3 * j]);
                let wanted: Complex64 = (0..9).map(|k| x[k % 3].conj() * entry(k % 3, k / 3) * x[k / 3]).sum();
                assert!(wanted.im.abs() < 1e-12 * wanted.re && wanted.re > 0.0);
                let apart = 10.0 * (powers[kind] / wanted.re).log10();
                assert!(apart.abs() < 0.1, "{middle:.1} Hz, {x:?}, kind {kind}: {apart:.3} dB");
            }
            let efficiency = powers[0] / powers[1];
            // Cylinders have up to 1.15; head and foot that move together have more.
            assert!(efficiency < 1.5, "{middle} Hz: {efficiency}");
        }
    }
    let efficiency = |f: f64, c: usize| {
        let [free, plane] = radiators.at(f).expect("powers");
        free[(c, c)].re / plane[(c, c)].re
    };
    // Long waves let the air flow round the rail, short ones do not.
    assert!(
        efficiency(150.0, 2) < 0.3 && efficiency(3000.0, 2) > 0.7,
        "{} {}",
        efficiency(150.0, 2),
        efficiency(3000.0, 2)
    );
}

/// The two translations and the turn of a rigid section at the nodes of the outline, `[2 · nodes, 3]`, and the length
/// of the outline that belongs to each node, m.
fn rigid_motions(rail: &Infinite) -> (Mat<f64>, Vec<f64>) {
    let outline = rail.outline();
    let (mut at, mut length) = (vec![[0.0; 2]; outline.nodes.len()], vec![0.0; outline.nodes.len()]);
    for edge in &outline.edges {
        let [a, b, _] = edge.points;
        let whole = (b[0] - a[0]).hypot(b[1] - a[1]);
        let nodes = edge.nodes.expect("a free edge").into_iter().zip(edge.points);
        for ((node, point), part) in nodes.zip([1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0]) {
            at[node] = point;
            length[node] += part * whole;
        }
    }
    let rigid = Mat::from_fn(2 * at.len(), 3, |i, j| match (i % 2, j) {
        (0, 0) | (1, 1) => 1.0,
        (0, 2) => -at[i / 2][1],
        (1, 2) => at[i / 2][0],
        _ => 0.0,
    });
    (rigid, length)
}

/// The rail whose motions radiate by these alone, at the nodes of the outline, `[2 · nodes, q]`.
fn moving<'a>(rail: &'a Infinite, bands: &Bands, motion: &Mat<f64>) -> RailRadiators<'a> {
    let mut radiators = RailRadiators::new(rail, AIR, bands);
    radiators.normal = radiators.meshed.normal(motion.as_ref());
    let all = radiators.far(0, 1).expect("far fields");
    radiators.complete(&all)
}

/// The sound of a rail beside that of the rigid part of its sections' motion alone, by least squares over the outline:
/// they deform little below 1 kHz.
#[test]
fn sections_that_deform_are_heard_above_a_kilohertz() {
    let rail = rail(2600.0);
    let bands = Bands::spanning(100.0, 2000.0);
    let (motions, length) = rigid_motions(&rail);
    let weighted = Mat::from_fn(motions.nrows(), 3, |i, j| length[i / 2] * motions[(i, j)]);
    let amplitudes = (weighted.transpose() * &motions).partial_piv_lu().solve(weighted.transpose() * rail.motion());
    let whole = complete(&rail, &bands);
    let part = moving(&rail, &bands, &(&motions * amplitudes));
    let level = |a: f64, b: f64| 10.0 * (a / b).log10();
    let beyond = |f: f64| {
        let [a, b] = [&whole, &part].map(|r| {
            let [free, _] = r.at(f).expect("powers");
            [1, 2].map(|c| free[(c, c)].re)
        });
        [level(a[0], b[0]), level(a[1], b[1])]
    };
    for (f, most) in [(125.0, [0.05, 0.05]), (500.0, [0.15, 0.1]), (800.0, [0.3, 0.1]), (1250.0, [0.6, 0.1])] {
        let [lateral, vertical] = beyond(f);
        assert!(lateral.abs() < most[0] && vertical.abs() < most[1], "{f} Hz: {lateral:+.2} and {vertical:+.2} dB");
    }
    let [lateral, vertical] = beyond(2000.0);
    assert!((1.5..2.0).contains(&lateral) && (0.2..0.5).contains(&vertical), "{lateral:+.2} and {vertical:+.2} dB");
}

/// Two contacts at one place are one: each radiates alone and with the other as one contact does, whose forces along
/// and across the rail do not interact. G is Hermitian and has no negative eigenvalues, also of contacts apart.
#[test]
fn contacts_at_one_place_radiate_as_one() {
    let bands = Bands::spanning(400.0, 1000.0);
    let [one, all] = [&[0.0][..], &[0.0, 0.0, 0.4]].map(|along| {
        let rail = rail_under(2600.0, along);
        complete(&rail, &bands).at(770.0).expect("powers")
    });
    for (one, all) in one.iter().zip(&all) {
        let scale = |i: usize, j: usize| (all[(i, i)].re * all[(j, j)].re).sqrt();
        for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
            assert!((all[(i, j)] - all[(j, i)].conj()).norm() < 1e-14 * scale(i, j), "({i}, {j})");
            let (wanted, alike) = (one[(i % 3, j % 3)], (i < 6) == (j < 6));
            let off = (all[(i, j)] - wanted).norm() / scale(i, j);
            assert!(if alike { off < 3e-3 } else { i % 3 != j % 3 || off > 0.1 }, "({i}, {j}): {off:.1e}");
        }
        let real = Mat::from_fn(18, 18, |i, j| match (i < 9, j < 9) {
            (true, true) | (false, false) => all[(i % 9, j % 9)].re,
            (true, false) => -all[(i, j - 9)].im,
            (false, true) => all[(i - 9, j)].im,
        });
        let (values, _) = symmetric_eigen(real.as_ref()).expect("eigenvalues");
        assert!(values[0] > -1e-3 * values[17], "{values:?}");
    }
}

#[test]
fn a_rail_without_damping_is_refused() {
    let making = InfiniteRailSpec {
        section: round(0.01),
        material: STEEL,
        track: None,
        angle: 0.0,
        loss: 0.0,
        places: vec![ForcePlace::at_contact_point(LoadPatch::Circle { radius: 2e-3 }, 0.0)],
    };
    let rail = Infinite::new(&making, 2.0 * PI * 1500.0).expect("rail");
    let radiators = complete(&rail, &Bands::spanning(800.0, 1000.0));
    let error = radiators.at(900.0).expect_err("endless waves");
    assert!(error.message().contains("900.0 Hz") && error.message().contains("track.loss_factor"), "{error}");
}
