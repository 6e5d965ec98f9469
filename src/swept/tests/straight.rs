//! Sections along a line: bars, beams, the rail.

use super::*;
use crate::swept::waves::{self, RailMode};
use faer::linalg::solvers::Solve;
use num_complex::Complex;

/// The material of section 5 of the rail's figures: E = 210 GPa, G = 80.77 GPa, ρ = 7860 kg/m³.
pub(super) const RAIL_STEEL: ElasticMaterial = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };

/// A square bar of the side `side`, m, of `cells` elements each way, about its middle.
fn bar(side: f64, cells: usize) -> CrossSection {
    let line: Vec<f64> = (0..=cells).map(|k| side * (k as f64 / cells as f64 - 0.5)).collect();
    let lines = builtin::SectionLines { r: &line, y: &line };
    lines.section(|_, _| true, |at| at, |_, _| true)
}

/// Rods stretch at k√(E/ρ) less the part ν²k²I_p/2A of Rayleigh and Love, and square bars twist at k√(GJ/ρI_p), J =
/// 0.1405770 a⁴, to which the mesh converges as h⁴: 5.8e-4 with four elements a side, 4.5e-5 with eight.
#[test]
fn a_bar_stretches_and_twists_as_it_must() {
    let (side, period) = (0.02, 2.0);
    let steel = RAIL_STEEL;
    let forms = Forms::along(bar(side, 8), steel, period, None, 0.0).unwrap();
    for n in [1usize, 3] {
        let k = forms.path.wavenumber(n);
        assert_eq!(k, 2.0 * PI * n as f64 / period);
        let rod = k * (steel.young / steel.density).sqrt() * (1.0 - 0.5 * (0.3 * k).powi(2) * side * side / 6.0);
        let twist = k * (steel.shear() * 0.140_577_0 * 6.0 / steel.density).sqrt();
        let modes = of_order(&forms, n, 1.2 * rod).unwrap();
        for (what, wanted, good) in [("rod", rod, 1e-6), ("twist", twist, 6e-5)] {
            let off = modes.omega.iter().map(|w| (w / wanted - 1.0).abs()).fold(f64::INFINITY, f64::min);
            assert!(off < good, "{n} {what}: {off:e} {:?}", modes.omega);
        }
        // Two bends, twist and stretch.
        assert_eq!(modes.omega.len(), 4);
    }
}

/// Timoshenko's beam with κ = 5(1 + ν)/(6 + 5ν); what is left goes with k².
#[test]
fn a_bar_bends_as_timoshenko_says() {
    let (side, period) = (0.02, 2.0);
    let steel = RAIL_STEEL;
    let forms = Forms::along(bar(side, 4), steel, period, None, 0.0).unwrap();
    let (area, inertia) = (side * side, side.powi(4) / 12.0);
    let kappa = 5.0 * 1.3 / (6.0 + 5.0 * 0.3);
    for n in [2usize, 5] {
        let k = forms.path.wavenumber(n);
        let (e, g, rho) = (steel.young, steel.shear(), steel.density);
        // Both equations of the beam: ω⁴ − bω² + c = 0.
        let (s, m) = (kappa * g * area, rho * area);
        let (b, c) = (s * k * k / m + (e * inertia * k * k + s) / (rho * inertia), s * k.powi(4) * e / (m * rho));
        let wanted = (0.5 * (b - (b * b - 4.0 * c).sqrt())).sqrt();
        let modes = of_order(&forms, n, 2.0 * wanted).unwrap();
        assert_eq!(modes.omega.len(), 2, "{:?}", modes.omega);
        assert!(
            modes.omega.iter().all(|w| (w / wanted - 1.0).abs() < 3.5e-6 * (n * n) as f64),
            "{n}: {:?} {wanted}",
            modes.omega
        );
    }
}

/// 60.2 kg/m; the second moments from the frequencies of long waves; motions of the whole are free, and a turned
/// section has the same modes.
#[test]
fn the_rail_has_the_measures_of_its_drawing() {
    let steel = RAIL_STEEL;
    let [middle, aside] = [0.0, 0.02].map(|y| BuiltRail::new(&R60E1, y).unwrap());
    let section = middle.for_modes().unwrap();
    assert!((section.area() / 76.70e-4 - 1.0).abs() < 2e-3, "{:e}", section.area());
    assert!((section.area() * 7850.0 - 60.2).abs() < 0.1);
    let place = aside.contact();
    assert!((place.y - 0.02).abs() < 1e-12 && aside.height(0.0).abs() < 1e-12);
    // R80 there: its angle from the arcs, and its sagitta.
    let first = (10.228e-3_f64 / 0.3).asin();
    let angle = ((0.02 - 0.22 * first.sin()) / 0.08).asin();
    assert!((place.angle + angle).abs() < 1e-12, "{place:?} {angle}");
    assert!((aside.height(2e-3) + 2e-3f64.powi(2) / 0.16).abs() < 1e-8, "{}", aside.height(2e-3));
    assert!((middle.height(-3e-3) + 3e-3f64.powi(2) / 0.6).abs() < 1e-8);
    let period = 12.0;
    let free = Forms::along(section, steel, period, None, 0.0).unwrap();
    let whole = of_order(&free, 0, 2.0 * PI * 200.0).unwrap();
    assert_eq!(whole.omega, [0.0; 4]);
    let modes = of_order(&free, 2, 2.0 * PI * 800.0).unwrap();
    let turned = Forms::along(aside.for_modes().unwrap(), steel, period, None, place.angle).unwrap();
    let other = of_order(&turned, 2, 2.0 * PI * 800.0).unwrap();
    for (a, b) in modes.omega.iter().zip(&other.omega) {
        assert!((a / b - 1.0).abs() < 1e-3, "{:?} {:?}", modes.omega, other.omega);
    }
    let k = free.path.wavenumber(1);
    let beam = |inertia: f64| (steel.young * inertia / (steel.density * 76.70e-4)).sqrt() * k * k;
    let long = of_order(&free, 1, 2.0 * PI * 100.0).unwrap();
    // Vertically Timoshenko's correction is k²I/A(1 + E/κG) = 1 % of ω² here.
    let lateral = long.omega[0] / beam(5.127e-6);
    let vertical = long.omega.iter().map(|w| (w / beam(3.037e-5) - 1.0).abs()).fold(f64::INFINITY, f64::min);
    assert!((lateral - 1.0).abs() < 5e-3 && vertical < 1e-2, "{lateral} {vertical} {:?}", long.omega);
}

#[test]
fn a_contact_beside_the_head_is_refused() {
    assert_eq!(BuiltRail::new(&R60E1, 0.036).unwrap_err().exit_code(), 2);
    assert_eq!(BuiltRail::new(&R60E1, f64::NAN).unwrap_err().exit_code(), 2);
}

/// The tracks of the tests: pads of 120 MN/m and 40 MN/m every 0.6 m, loss factor 0.2.
pub(super) fn pads() -> RailTrack {
    RailTrack { pad: TrackLayer::with_loss([200e6, 66.7e6, 66.7e6], 0.2, 60.2), sleeper: None }
}

/// Receptance at the contact, (x, y, n), m/N, from modes and A.
pub(super) fn receptance(
    waves: &[RailMode],
    list: &[waves::Member],
    c: &Mat<f64>,
    a: &Square,
    f: f64,
) -> [[Complex<f64>; 3]; 3] {
    let w = 2.0 * PI * f;
    let seen = |&(i, k, family): &waves::Member, d: usize| match waves[i].order == 0 || FAMILY[d] == family {
        true => waves[i].contact[(d, k)],
        false => 0.0,
    };
    let omega = |m: &waves::Member| waves[m.0].omega[m.1];
    let phi = Mat::from_fn(list.len(), 3, |i, d| Complex::from(seen(&list[i], d)));
    let dynamic = Mat::from_fn(list.len(), list.len(), |i, j| {
        let own = if i == j { omega(&list[i]).powi(2) - w * w } else { 0.0 };
        Complex::new(own, w * c[(i, j)])
    });
    let moved = phi.transpose() * dynamic.partial_piv_lu().solve(&phi);
    std::array::from_fn(|r| {
        std::array::from_fn(|d| {
            let rest: f64 = list.iter().map(|m| seen(m, r) * seen(m, d) / omega(m).powi(2)).sum();
            moved[(r, d)] + a[r][d] - rest
        })
    })
}

/// A of the rail with the contact at y, m, on circles of the loads, with the mesh and the period of the arguments.
pub(super) fn at_contact(y: f64, radii: &[f64], parts: f64, period: f64, singles: Option<usize>) -> Vec<Square> {
    let rail = BuiltRail::new(&R60E1, y).unwrap();
    let focus = Focus { size: radii[0] / parts, reach: 1.5 * radii[0], corner: 0.03 / parts, largest: 0.03 / parts };
    let section = rail.section(focus).unwrap();
    let forms = Forms::along(section, RAIL_STEEL, period, Some(&pads()), rail.contact().angle).unwrap();
    let patches: Vec<LoadPatch> = radii.iter().map(|&radius| LoadPatch::Circle { radius }).collect();
    let mut constant = Constant::new(&forms, &patches, period / (2.0 * PI)).unwrap();
    if let Some(singles) = singles {
        let usual: Vec<_> = constant.blocks.iter().copied().filter(|b| b.0 - b.1 / 2 > singles).collect();
        let next = usual[0].0 - usual[0].1 / 2;
        constant.blocks = (0..next).map(|n| (n, 1)).chain(usual).collect();
    }
    own(&constant)
}

/// Largest difference of what the middle of the contact does under forces on it, m/N, along x, and across.
fn apart(a: &Square, b: &Square) -> [f64; 2] {
    let of = |i: usize, j: usize| (a[i][j] - b[i][j]).abs();
    let across = [(1, 1), (1, 2), (2, 1), (2, 2)].into_iter().map(|(i, j)| of(i, j)).fold(0.0, f64::max);
    [of(0, 0), across]
}

/// To 1 pm/N in the orders, in the length of the rail, and in the mesh along x and the normal. Laterally the head of
/// a rail on pads yields by 61 nm/N, most of it by rolling; of that the mesh of the foot and web leaves 5e-4. Along x
/// a rail on pads of 67 MN/m² moves as a whole over some ten metres: coth(λL/2)/(2√(EA s)), λ = √(s/EA), is what its
/// length is seen by.
#[test]
fn the_contact_on_the_rail_yields_as_it_must() {
    let [usual, wide] = at_contact(0.01, &[5e-3, 7.5e-3], 3.0, 14.0, None)[..] else { panic!() };
    assert!((usual[2][2] - 4.7e-9).abs() < 0.2e-9 && (usual[1][1] - 61.2e-9).abs() < 0.3e-9, "{usual:?}");
    // Pressed down on the right of its middle the head rolls to the right; turned back from the tangent, which falls
    // to the right there.
    let (sin, cos) = BuiltRail::new(&R60E1, 0.01).unwrap().contact().angle.sin_cos();
    let upright = (cos * cos - sin * sin) * usual[1][2] - sin * cos * (usual[1][1] - usual[2][2]);
    assert!(sin < 0.0 && (2e-9..4e-9).contains(&upright), "{upright:e}");
    let [along, across] = apart(&usual, &wide);
    assert!(along < 3e-12 && across < 40e-12, "circle: {along:e} {across:e}");
    let fine = at_contact(0.01, &[5e-3], 4.5, 14.0, None)[0];
    let mesh = |i: usize, j: usize| (usual[i][j] - fine[i][j]).abs();
    assert!(
        mesh(0, 0) < 1e-12 && mesh(2, 2) < 1e-12 && mesh(1, 2) < 2e-12,
        "mesh: {:e} {:e} {:e}",
        mesh(0, 0),
        mesh(2, 2),
        mesh(1, 2)
    );
    assert!((usual[1][1] / fine[1][1] - 1.0).abs() < 7e-4, "{:e} {:e}", usual[1][1], fine[1][1]);
    let coarse = |period: f64, singles: Option<usize>| at_contact(0.01, &[5e-3], 2.0, period, singles)[0];
    let base = coarse(14.0, None);
    let orders = coarse(14.0, Some(120));
    assert!(apart(&base, &orders).iter().all(|d| *d < 1e-12), "orders: {:?}", apart(&base, &orders));
    let long = coarse(21.0, None);
    let spring = (210e9 * 76.7e-4 * 66.7e6_f64).sqrt();
    let decay = (66.7e6_f64 / (210e9 * 76.7e-4)).sqrt();
    let whole = |period: f64| 0.5 / (spring * (0.5 * decay * period).tanh());
    let [_, across] = apart(&base, &long);
    let along = base[0][0] - long[0][0] - (whole(14.0) - whole(21.0));
    assert!(across < 1e-12 && along.abs() < 1e-12, "length: {along:e} {across:e}");
}

/// The rail on pads of the length `period`, m, by its modes up to `limit`, Hz.
pub(super) struct PaddedRail {
    forms: Forms,
    pub waves: Vec<RailMode>,
    pub list: Vec<waves::Member>,
}

impl PaddedRail {
    pub(super) fn new(period: f64, limit: f64, patch: LoadPatch) -> Self {
        let radius = period / (2.0 * PI);
        let rail = BuiltRail::new(&R60E1, 0.0).unwrap();
        let forms = Forms::along(rail.for_modes().unwrap(), RAIL_STEEL, period, Some(&pads()), 0.0).unwrap();
        let of = |n| {
            let modes = of_order(&forms, n, 2.0 * PI * limit)?;
            Ok(RailMode::new(&forms, modes, &[LineLoad::new(&forms, patch, n, radius)]))
        };
        let size = |w: &RailMode| w.omega.len();
        let waves: Vec<RailMode> = by_orders(1, size, |o| o.into_iter().map(of).collect()).unwrap();
        let mut list = Vec::new();
        for (i, w) in waves.iter().enumerate() {
            list.extend((0..size(w)).flat_map(|k| (0..ContactModeData::families(w.order)).map(move |f| (i, k, f))));
        }
        Self { forms, waves, list }
    }

    /// ΦᵀCΦ with the loss factor 0.02.
    pub(super) fn damped(&self, ends: Option<AbsorbingEnds>) -> Mat<f64> {
        waves::damping(&self.forms, &self.waves, &self.list, &waves::RailDamping { loss: 0.02, ends })
    }
}

/// The rail on pads against the infinite beam, vertically; up to 1.5 kHz the section is a beam. The rail is some 700
/// modes to 6.5 kHz; here to 3.5 kHz.
#[test]
fn the_rail_on_pads_responds_as_a_beam() {
    let (period, patch) = (14.0, LoadPatch::Circle { radius: 5e-3 });
    let rail = PaddedRail::new(period, 3500.0, patch);
    let PaddedRail { waves, list, .. } = &rail;
    let numbers: Vec<f64> = waves.iter().rev().flat_map(RailMode::to_numbers).collect();
    assert_eq!(&RailMode::from_numbers(&numbers).unwrap(), waves);
    assert!(RailMode::from_numbers(&numbers[1..]).is_err());
    let ends = AbsorbingEnds { period, length: 5.0, damping: 6000.0, along: 0.0 };
    let (plain, whole) = (rail.damped(None), rail.damped(Some(ends)));
    // Damping takes energy from every motion.
    assert!((&whole - whole.transpose()).norm_max() < 1e-9 * whole.norm_max());
    let smallest = whole.self_adjoint_eigenvalues(faer::Side::Lower).unwrap()[0];
    assert!(smallest > 0.0, "{smallest}");
    // An end all along, α = 1 everywhere, is the mass itself: the same but for the one that is 1/3 of it on average.
    let trace = |c: &Mat<f64>| (0..list.len()).map(|i| c[(i, i)]).sum::<f64>();
    let mean = (trace(&whole) - trace(&plain)) / list.len() as f64;
    assert!((mean / (2.0 * 6000.0 * 5.0 / 3.0 / period) - 1.0).abs() < 0.02, "{mean}");
    let a = at_contact(0.0, &[patch.half()[1]], 2.0, period, None)[0];
    let beam = beam_60e1(RAIL_STEEL, false, 0.02);
    let mut off = [0.0_f64; 2];
    for f in [100.0, 200.0, 300.0, 400.0, 500.0, 700.0, 1000.0, 1500.0] {
        let wanted = beam.infinite(2.0 * PI * f, pads().stiffness(2.0 * PI * f, 0));
        let found = [&whole, &plain].map(|c| receptance(waves, list, c, &a, f)[2][2] / wanted);
        assert!((found[0].norm() - 1.0).abs() < 0.04, "{f} Hz: {}", found[0]);
        assert!(found[0].arg().abs().to_degrees() < 5.0, "{f} Hz: {} degrees", found[0].arg().to_degrees());
        off = [0, 1].map(|k| off[k].max((found[k] - 1.0).norm()));
    }
    assert!(off[1] > 0.15, "without ends: {off:?}");
}
