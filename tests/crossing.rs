//! A wheel on the wing rail and the nose of a crossing at once, on half-spaces, beside CONTACT. The rails change along
//! the track, so that the gap is made here.

use railsqueal::body::half_space::HalfSpace;
use railsqueal::body::hybrid::half_spaces;
use railsqueal::contact::{ContactCreepage, Loads, NormalLoad, PatchKinematics, SteadyProblem, Stencil};
use railsqueal::friction::FrictionLaw;
use railsqueal::grid::Interface;
use railsqueal::model::combined_compliance;
use railsqueal::placement::builtin::s1002;
use railsqueal::placement::RunningProfile;

/// The natural cubic spline through points with ascending x.
struct Spline {
    x: Vec<f64>,
    y: Vec<f64>,
    /// Second derivatives at the points.
    bend: Vec<f64>,
}

impl Spline {
    fn through(points: &[[f64; 2]]) -> Self {
        let [x, y] = [0, 1].map(|c: usize| points.iter().map(|p| p[c]).collect::<Vec<f64>>());
        let n = x.len();
        let h: Vec<f64> = x.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(n > 3 && h.iter().all(|h| *h > 0.0), "{x:?}");
        // Elimination of the three diagonals of h bend = 6 [slope], with no bend at both ends.
        let (mut upper, mut right) = (vec![0.0; n], vec![0.0; n]);
        for i in 1..n - 1 {
            let jump = 6.0 * ((y[i + 1] - y[i]) / h[i] - (y[i] - y[i - 1]) / h[i - 1]);
            let pivot = 2.0 * (h[i - 1] + h[i]) - h[i - 1] * upper[i - 1];
            upper[i] = h[i] / pivot;
            right[i] = (jump - h[i - 1] * right[i - 1]) / pivot;
        }
        let mut bend = vec![0.0; n];
        (1..n - 1).rev().for_each(|i| bend[i] = right[i] - upper[i] * bend[i + 1]);
        Self { x, y, bend }
    }

    fn at(&self, x: f64) -> f64 {
        assert!((self.x[0]..=self.x[self.x.len() - 1]).contains(&x), "{x} is outside the points");
        let i = self.x.partition_point(|v| *v <= x).clamp(1, self.x.len() - 1) - 1;
        let h = self.x[i + 1] - self.x[i];
        let (a, b) = ((self.x[i + 1] - x) / h, (x - self.x[i]) / h);
        let bent = (a * a * a - a) * self.bend[i] + (b * b * b - b) * self.bend[i + 1];
        a * self.y[i] + b * self.y[i + 1] + h * h / 6.0 * bent
    }
}

/// A contact of `two_patches`, as CONTACT prints it: mm, N, MPa.
struct Patch {
    /// Origin of its frame: forwards of the axle, and y and z of the rail.
    origin: [f64; 3],
    angle: f64,
    /// Rolling speed, m/s, and creepages: longitudinal, lateral, spin in 1/mm.
    speed: f64,
    creepage: [f64; 3],
    /// Normal force, and forces along and across the track.
    force: [f64; 3],
    approach: f64,
    pressure: f64,
    /// Elements in contact, and those of them that stick.
    elements: [f64; 2],
    /// Half sides of the grid.
    half: [f64; 2],
}

const PATCHES: [Patch; 2] = [
    Patch {
        origin: [-2.46, 32.0806, -1.5177],
        angle: -0.05,
        speed: 1.999,
        creepage: [-1.187e-3, -2.673e-4, 1.087e-4],
        force: [6171.0, 1611.0, 152.9],
        approach: 17.25e-3,
        pressure: 634.5,
        elements: [437.0, 138.0],
        half: [3.8, 2.4],
    },
    Patch {
        origin: [4.1777, -31.7981, 6.1984],
        angle: -0.764,
        speed: 2.016,
        creepage: [1.546e-2, 6.235e-3, 1.492e-3],
        force: [4790.0, -1313.0, -557.3],
        approach: 20.54e-3,
        pressure: 1584.0,
        elements: [128.0, 0.0],
        half: [4.6, 1.0],
    },
];

/// Spacing of the grids, that of CONTACT, mm: the nose has five elements of it across.
const SPACING: f64 = 0.2;

/// Place of the axle along the track, shift and radius of the wheel, and the height of its running circle below the
/// origin of the rail under the load, mm.
const ALONG: f64 = 160.0;
const SHIFT: f64 = 3.52;
const RADIUS: f64 = 460.0;
const HEIGHT: f64 = -0.9238;

/// How far the wheel is drawn back along both normals, in proportion to the cosines of the contact angles, mm. The
/// shape of the gap stays that under the load. A wheel raised by as much would slide along the nose by 35 µm, which
/// turns the gap there by 3 mrad and changes the forces by 2 %.
const DRAWN_BACK: f64 = 0.05;

/// Lines of the rail along the track past a contact, `[line][point]`: place along the track, y and z, mm.
fn rail(contact: usize) -> Vec<Vec<[f64; 3]>> {
    let mut lines: Vec<Vec<[f64; 3]>> = Vec::new();
    for row in include_str!("data/crossing/rail.csv").lines().skip(1) {
        let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        let [of, line, rest @ ..] = &cells[..] else { panic!("{row}") };
        if *of as usize == contact + 1 {
            lines.resize(*line as usize + 1, Vec::new());
            lines[*line as usize].push([rest[0], rest[1], rest[2]]);
        }
    }
    lines
}

impl Patch {
    /// Lines of the grid in the frame of the program, m.
    fn lines(&self) -> [Vec<f64>; 2] {
        [0, 1].map(|c| {
            let n = (self.half[c] / SPACING).round() as i64;
            (-n..=n).map(|i| 1e-3 * i as f64 * SPACING).collect()
        })
    }

    /// Distance of the wheel, drawn back, and the rail along the normal, m.
    fn gap(&self, number: usize, wheel: &RunningProfile) -> Vec<f64> {
        let (sin, cos) = self.angle.sin_cos();
        let [x0, y0, z0] = self.origin;
        let along: Vec<[Spline; 2]> = rail(number)
            .iter()
            .map(|line| [1, 2].map(|c| Spline::through(&line.iter().map(|p| [p[0], p[c]]).collect::<Vec<_>>())))
            .collect();
        let [x, y] = self.lines();
        let column = |back: &f64| -> Vec<f64> {
            // Forwards of the axle; x of the program is backwards.
            let ahead = x0 - 1e3 * back;
            let section: Vec<[f64; 2]> = along
                .iter()
                .map(|line| {
                    let [right, down] = [0, 1].map(|c: usize| line[c].at(ALONG + ahead) - [y0, z0][c]);
                    [right * cos + down * sin, down * cos - right * sin]
                })
                .collect();
            let section = Spline::through(&section);
            let meet_wheel = |across: f64| {
                let mut depth = section.at(across);
                for _ in 0..50 {
                    let at = y0 + across * cos - depth * sin;
                    let local = wheel.local(1e-3 * (at - SHIFT));
                    let radius = RADIUS + 1e3 * local.z;
                    let surface = (radius * radius - ahead * ahead).sqrt();
                    let slope = local.slope * radius / surface;
                    let step = (surface - RADIUS + HEIGHT - z0 - across * sin - depth * cos) / (cos + slope * sin);
                    depth += step;
                    if step.abs() < 1e-9 {
                        return depth;
                    }
                }
                panic!("no wheel along the normal at {across} mm");
            };
            let open = |across: f64| section.at(across) - meet_wheel(across) + DRAWN_BACK * cos;
            y.iter().map(|across| 1e-3 * open(1e3 * across)).collect()
        };
        let columns: Vec<Vec<f64>> = x.iter().map(column).collect();
        (0..y.len()).flat_map(|j| columns.iter().map(move |c| c[j])).collect()
    }
}

/// `two_patches` of CONTACT's test bank: a wheel S1002 under a vertical force of 10 kN, friction in it, on the wing
/// rail (−0.050 rad) and on the nose (−0.764 rad) of a crossing. Normal forces, approaches and the largest pressures
/// agree within 1 %, tangential forces within 1 % of the bound of friction.
#[test]
fn wing_rail_and_nose_share_a_vertical_force_as_in_contact() {
    let wheel = s1002().unwrap();
    let steel = HalfSpace { young: 2.0 * 82e9 * 1.28, poisson: 0.28 };
    let gaps: Vec<Vec<f64>> = PATCHES.iter().enumerate().map(|(c, patch)| patch.gap(c, &wheel)).collect();
    let part = |(patch, gap): (&Patch, &Vec<f64>)| {
        let [x, y] = patch.lines();
        Interface::new(x, y, gap.clone()).unwrap()
    };
    let interface = Interface::joined(PATCHES.iter().zip(&gaps).map(part).collect()).unwrap();
    let grids: Vec<[Vec<f64>; 2]> = PATCHES.iter().map(Patch::lines).collect();
    let own = half_spaces(&steel, &grids).unwrap();
    let compliance = combined_compliance(own.as_ref(), own.as_ref()).unwrap();
    // Backwards in the program is forwards in CONTACT with the other sign, and so is a spin.
    let kinematics = |patch: &Patch| {
        let [longitudinal, lateral, spin] = patch.creepage;
        let creepage = ContactCreepage { longitudinal: -longitudinal, lateral, spin: -1e3 * spin };
        PatchKinematics { speed: patch.speed, creepage }
    };
    let problem = SteadyProblem {
        interface: &interface,
        compliance: compliance.as_ref().into(),
        friction: FrictionLaw::Constant(0.3).into(),
        kinematics: PATCHES.iter().map(kinematics).collect(),
        loads: Loads::vertical(&PATCHES.map(|patch| patch.angle), NormalLoad::Force(10e3)),
        stencil: Stencil::default(),
        tolerance: 1e-8,
        max_iterations: 200,
    };
    let found = problem.solve().unwrap();
    let mut first = 0;
    for (c, patch) in PATCHES.iter().enumerate() {
        let nodes = first..first + gaps[c].len();
        first = nodes.end;
        let [x, y, z] = found.patches[c].force;
        let close = |what: &str, found: f64, wanted: f64, bound: f64| {
            println!("contact {c}, {what}: {found:.6} ({wanted})");
            assert!((found - wanted).abs() < bound, "contact {c}, {what}: {found}, CONTACT has {wanted}");
        };
        let [normal, forwards, right] = patch.force;
        close("normal force", -z, normal, 0.01 * normal);
        close("force forwards", -x, forwards, 0.01 * 0.3 * normal);
        close("force to the right", y, right, 0.01 * 0.3 * normal);
        let nearest = gaps[c].iter().copied().fold(f64::INFINITY, f64::min);
        let approach = 1e3 * (found.patches[c].approach - nearest);
        close("approach", approach, patch.approach, 0.01 * patch.approach);
        let peak = 1e-6 * found.pressure[nodes.clone()].iter().copied().fold(0.0, f64::max);
        close("largest pressure", peak, patch.pressure, 0.01 * patch.pressure);
        let count = |states: &[u8]| found.state[nodes.clone()].iter().filter(|s| states.contains(s)).count() as f64;
        let [closed, stuck] = patch.elements;
        close("elements in contact", count(&[1, 2]), closed, 0.02 * closed);
        close("elements that stick", count(&[1]), stuck, 0.02 * closed);
    }
}
