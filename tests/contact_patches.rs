//! Several contact patches in one problem: against one grid that holds them all, against each patch by itself, and
//! against equilibrium by hand.

use faer::Mat;
use railsqueal::body::half_space::HalfSpace;
use railsqueal::contact::{
    ContactCreepage, LoadedMotion, Loads, NormalLoad, PatchKinematics, SlidingDirection, SlidingProblem, SteadyProblem,
    SteadySolution, Stencil, Tangent,
};
use railsqueal::friction::{Exponential, FrictionLaw, PatchFriction};
use railsqueal::grid::Interface;
use railsqueal::model::{combined_compliance, CoupledModel};
use railsqueal::roughness::{RoughSurfaces, RoughnessFeature, RoughnessShape};
use railsqueal::stability::nonlinear_eigen::{self, SpectrumMemory};
use railsqueal::stability::reduced::{self, Eigenpair};
use railsqueal::transient::loading::{History, Normal, PatchDrive};
use railsqueal::transient::{ContactSolver, Loading, Model, Scheme, Settings, State, Stepper};
use railsqueal::{body::ReducedBody, Error};

const STEEL: HalfSpace = HalfSpace { young: 205e9, poisson: 0.3 };
const SOFT: HalfSpace = HalfSpace { young: 60e9, poisson: 0.1 };
const MU: f64 = 0.3;
const PI: f64 = std::f64::consts::PI;
/// Nodes of a patch along x and y, their spacing, m, and the lines of the large grid along y.
const SIZE: [usize; 2] = [15, 13];
const SPACING: f64 = 0.9e-3;
const LINES: usize = 31;

fn line(n: usize) -> Vec<f64> {
    (0..n).map(|i| SPACING * (i as f64 - 0.5 * (n - 1) as f64)).collect()
}

/// A patch with the radii 1/`curvature`, m, and the gap at its middle `lift`, m.
fn patch(curvature: f64, lift: f64) -> Interface {
    let (x, y) = (line(SIZE[0]), line(SIZE[1]));
    let gap = |x: f64, y: f64| lift + 0.5 * curvature * (x * x + 1.3 * y * y);
    let gap = y.iter().flat_map(|&y| x.iter().map(move |&x| gap(x, y))).collect();
    Interface::new(x, y, gap).unwrap()
}

/// Two unlike half-spaces on one grid with a hump at either end, and the same with the nodes of the humps alone as
/// two patches.
struct Humps {
    whole: Interface,
    whole_w: Mat<f64>,
    patches: Interface,
    patches_w: Mat<f64>,
    /// Node of the large grid of each node of the patches.
    nodes: Vec<usize>,
}

impl Humps {
    fn new() -> Self {
        let (x, y) = (line(SIZE[0]), line(LINES));
        let parts = [patch(4.0, 0.0), patch(5.0, 4e-6)];
        let [nx, ny] = SIZE;
        let gap = (0..nx * LINES).map(|i| match i / nx {
            iy if iy < ny => parts[0].gap[i],
            iy if iy >= LINES - ny => parts[1].gap[i - nx * (LINES - ny)],
            _ => 1e-2,
        });
        let whole = Interface::new(x.clone(), y.clone(), gap.collect()).unwrap();
        let [lower, upper] = [STEEL, SOFT].map(|m| m.compliance(&x, &y).unwrap());
        let whole_w = combined_compliance(lower.as_ref(), upper.as_ref()).unwrap();
        let first = |iy: usize| (0..nx * ny).map(move |i| i + nx * iy);
        let nodes: Vec<usize> = first(0).chain(first(LINES - ny)).collect();
        let patches_w = Mat::from_fn(6 * nx * ny, 6 * nx * ny, |i, j| {
            whole_w[(3 * nodes[i / 3] + i % 3, 3 * nodes[j / 3] + j % 3)]
        });
        Self { whole, whole_w, patches: Interface::joined(parts.into()).unwrap(), patches_w, nodes }
    }

    /// Place of the middle of patch `c` on the large grid, m.
    fn middle(c: usize) -> f64 {
        [-1.0, 1.0][c] * 0.5 * SPACING * (LINES - SIZE[1]) as f64
    }

    /// Rolling of the patches that is the rolling `creepage` of the large grid.
    fn rolling(creepage: ContactCreepage) -> Vec<PatchKinematics> {
        let of = |c: usize| {
            let longitudinal = creepage.longitudinal - creepage.spin * Self::middle(c);
            PatchKinematics { speed: 10.0, creepage: ContactCreepage { longitudinal, ..creepage } }
        };
        vec![of(0), of(1)]
    }
}

fn problem<'a>(
    interface: &'a Interface,
    w: &'a Mat<f64>,
    kinematics: Vec<PatchKinematics>,
    loads: Loads,
) -> SteadyProblem<'a> {
    SteadyProblem {
        interface,
        compliance: w.as_ref().into(),
        friction: FrictionLaw::Constant(MU).into(),
        kinematics,
        loads,
        stencil: Stencil::default(),
        tolerance: 1e-12,
        max_iterations: 400,
    }
}

fn peak(s: &SteadySolution) -> f64 {
    s.pressure.iter().copied().fold(0.0, f64::max)
}

/// Largest difference of the stresses of the nodes `nodes` of `a` and of all of `b`, over the largest pressure.
fn apart(a: &SteadySolution, nodes: &[usize], b: &SteadySolution) -> f64 {
    let of = |(k, &i): (usize, &usize)| {
        let d = [0, 1].map(|c| (a.traction[i][c] - b.traction[k][c]).abs());
        d[0].max(d[1]).max((a.pressure[i] - b.pressure[k]).abs())
    };
    nodes.iter().enumerate().map(of).fold(0.0, f64::max) / peak(b)
}

/// Two patches on unlike half-spaces are the two humps of one grid: steady rolling with stick and slip, with friction
/// that falls and is remembered, and full sliding; under a common approach, under a common load, and under the loads
/// that these make.
#[test]
fn two_patches_are_the_humps_of_one_grid() {
    let h = Humps::new();
    let falling = FrictionLaw::from(Exponential::new(0.4, 0.25, 0.1).remembering(1e-3));
    for (friction, creepage) in [
        (FrictionLaw::Constant(MU), ContactCreepage { longitudinal: 1e-3, lateral: -2e-3, spin: 0.3 }),
        (falling, ContactCreepage { longitudinal: 0.0, lateral: 3e-3, spin: -0.2 }),
    ] {
        for load in [NormalLoad::Approach(9e-5), NormalLoad::Force(60e3)] {
            let one = SteadyProblem {
                friction: friction.clone().into(),
                ..problem(&h.whole, &h.whole_w, PatchKinematics::one(10.0, creepage), load.into())
            };
            let whole = one.solve().unwrap();
            let same = |loads: Loads| {
                let p = problem(&h.patches, &h.patches_w, Humps::rolling(creepage), loads);
                SteadyProblem { friction: friction.clone().into(), ..p }.solve().unwrap()
            };
            let shared = same(Loads::vertical(&[0.0; 2], load));
            let off = apart(&whole, &h.nodes, &shared);
            assert!(off < 1e-8, "{friction} {load:?}: {off:e}");
            for c in 0..3 {
                let error = (shared.force[c] - whole.force[c]).abs();
                assert!(error < 1e-8 * whole.force[2].abs(), "{friction} {load:?}: force {c} off by {error} N");
            }
            assert!(shared.state.iter().zip(&h.nodes).all(|(s, &i)| *s == whole.state[i]));
            let [near, far] = [0, 1].map(|c| shared.patches[c]);
            assert!(near.force[2] < -1e4 && far.force[2] < -1e4, "{near:?} {far:?}");
            // Moments about the origin of the large grid.
            let moment: f64 =
                (0..2).map(|c| shared.patches[c].moment_z - Humps::middle(c) * shared.patches[c].force[0]).sum();
            assert!((moment - whole.moment_z).abs() < 1e-8 * whole.force[2].abs() * 1e-2, "{moment}");
            // Each with its own load or approach.
            let own = same(Loads::of_patches(&[near, far].map(|p| match load {
                NormalLoad::Force(_) => NormalLoad::Force(-p.force[2]),
                NormalLoad::Approach(_) => NormalLoad::Approach(p.approach),
            })));
            let off = apart(&whole, &h.nodes, &own);
            assert!(off < 1e-8, "{friction} {load:?}, own loads: {off:e}");
            assert!((own.patches[1].approach / far.approach - 1.0).abs() < 1e-8);
        }
    }
    let creepage = ContactCreepage { longitudinal: 0.01, lateral: 0.02, spin: 0.3 };
    for direction in [SlidingDirection::Rigid, SlidingDirection::Actual] {
        let sliding = |interface, w: &'_ Mat<f64>, kinematics, loads| {
            let compliance = w.as_ref();
            let (friction, stencil) = (FrictionLaw::Constant(MU), Stencil::default());
            SlidingProblem { interface, compliance, friction: friction.into(), kinematics, loads, stencil, direction }
                .solve()
                .unwrap()
        };
        let load = NormalLoad::Force(60e3);
        let whole = sliding(&h.whole, &h.whole_w, PatchKinematics::one(10.0, creepage), load.into());
        let loads = Loads::vertical(&[0.0; 2], load);
        let both = sliding(&h.patches, &h.patches_w, Humps::rolling(creepage), loads);
        let most = whole.pressure.iter().copied().fold(0.0, f64::max);
        for (k, &i) in h.nodes.iter().enumerate() {
            let off = (both.pressure[k] - whole.pressure[i]).abs();
            assert!(off < 1e-9 * most, "{direction:?}: pressure of node {k} off by {off:e} of {most:e}");
            assert!((both.creep[k][0] - whole.creep[i][0]).abs() < 1e-9, "{direction:?}: creep of node {k}");
        }
        assert!((both.motions[0] / whole.motions[0] - 1.0).abs() < 1e-9);
    }
}

/// A patch without load changes nothing of the other one; it stays open and just touches.
#[test]
fn a_patch_without_load_stays_open() {
    let h = Humps::new();
    let rolling = Humps::rolling(ContactCreepage { longitudinal: 1e-3, lateral: -2e-3, spin: 0.3 });
    for (pressed, free) in [(0, 1), (1, 0)] {
        let alone = patch([4.0, 5.0][pressed], [0.0, 4e-6][pressed]);
        let n = alone.len();
        let w = h.patches_w.as_ref().submatrix(3 * n * pressed, 3 * n * pressed, 3 * n, 3 * n).to_owned();
        let load = NormalLoad::Force(30e3);
        let mut single = problem(&alone, &w, vec![rolling[pressed]], load.into());
        single.tolerance = 1e-13;
        let single = single.solve().unwrap();
        let mut loads = [NormalLoad::Force(0.0); 2];
        loads[pressed] = load;
        let mut p = problem(&h.patches, &h.patches_w, rolling.clone(), Loads::of_patches(&loads));
        p.tolerance = 1e-13;
        let both = p.solve().unwrap();
        let nodes: Vec<usize> = h.patches.patches[pressed].nodes().collect();
        let off = apart(&both, &nodes, &single);
        assert!(off < 1e-12, "{off:e}");
        assert!((both.patches[pressed].approach / single.patches[0].approach - 1.0).abs() < 1e-12);
        let open = h.patches.patches[free].nodes();
        let least = open.clone().map(|i| both.gap[i]).fold(f64::INFINITY, f64::min);
        assert!(least.abs() < 1e-18 && open.clone().all(|i| both.state[i] == 0), "smallest gap {least}");
        assert_eq!((both.patches[free].force, both.patches[free].moment_z), ([0.0; 3], 0.0));
        // The other one lifts it by what it sinks in there.
        assert!(both.patches[free].approach > single.patches[0].approach * 0.01);
        assert!(p.contact(&both).nodes.iter().all(|n| nodes.contains(&n.node)));
    }
    let open = problem(&h.patches, &h.patches_w, rolling, Loads::of_patches(&[NormalLoad::Force(0.0); 2]));
    let open = open.solve().unwrap();
    assert_eq!((open.force, open.patches[1].approach), ([0.0; 3], 4e-6));
}

/// Block-diagonal W of `copies` of the matrix of two like half-spaces on a patch.
fn far_apart(s: &Interface, copies: usize) -> Mat<f64> {
    let one = STEEL.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
    let w = combined_compliance(one.as_ref(), one.as_ref()).unwrap();
    let n = w.nrows();
    Mat::from_fn(copies * n, copies * n, |i, j| if i / n == j / n { w[(i % n, j % n)] } else { 0.0 })
}

/// Patches that do not feel each other are single ones, whatever their speeds, loads and laws of friction; a common
/// load is shared by equal ones.
#[test]
fn patches_far_apart_are_single_ones() {
    let s = patch(4.0, 0.0);
    let (w, both_w) = (far_apart(&s, 1), far_apart(&s, 2));
    let both = Interface::joined(vec![s.clone(), s.clone()]).unwrap();
    let rolling = [
        PatchKinematics { speed: 10.0, creepage: ContactCreepage { longitudinal: 1e-3, lateral: -2e-3, spin: 0.3 } },
        PatchKinematics { speed: 25.0, creepage: ContactCreepage { longitudinal: -2e-3, lateral: 1e-3, spin: 0.0 } },
    ];
    let loads = [NormalLoad::Force(30e3), NormalLoad::Approach(4e-5)];
    let falling = FrictionLaw::from(Exponential::new(0.4, 0.25, 0.1).remembering(1e-3));
    let slippery = FrictionLaw::Constant(0.4 * MU);
    for laws in [[FrictionLaw::Constant(MU), slippery.clone()], [falling.clone(), falling.clone()], [slippery, falling]]
    {
        let friction = PatchFriction::new(laws[0].clone(), vec![laws[1].clone()]);
        let together = SteadyProblem {
            friction: friction.clone(),
            ..problem(&both, &both_w, rolling.to_vec(), Loads::of_patches(&loads))
        };
        let found = together.solve().unwrap();
        let linear = together.contact(&found);
        for c in 0..2 {
            let law = &laws[c];
            let single =
                SteadyProblem { friction: law.clone().into(), ..problem(&s, &w, vec![rolling[c]], loads[c].into()) };
            let alone = single.solve().unwrap();
            let nodes: Vec<usize> = both.patches[c].nodes().collect();
            let off = apart(&found, &nodes, &alone);
            assert!(off < 1e-10, "{law}, patch {c}: {off:e}");
            let creep = nodes.iter().zip(&alone.creep).map(|(&i, c)| (found.creep[i][1] - c[1]).abs());
            assert!(creep.fold(0.0, f64::max) < 1e-8, "{law}, patch {c}: creep");
            let (a, b) = (found.patches[c], alone.patches[0]);
            assert!((a.moment_z - b.moment_z).abs() < 1e-9 * b.force[2].abs() * 1e-2);
            assert!((a.approach / b.approach - 1.0).abs() < 1e-9);
            // Each is linearised with its own speed.
            let own = single.contact(&alone);
            let of_patch: Vec<_> = linear.nodes.iter().filter(|n| nodes.contains(&n.node)).collect();
            assert_eq!(of_patch.len(), own.nodes.len());
            for (a, b) in of_patch.iter().zip(&own.nodes) {
                let [p, q] = [&a.convection, &b.convection];
                assert!(p.len() == q.len() && a.node == b.node + nodes[0]);
                assert!(p.iter().zip(q).all(|(p, q)| p.0 == q.0 + nodes[0] && (p.1 - q.1).abs() < 1e-3 * q.1.abs()));
            }
            let edges =
                |at: usize| linear.edges.iter().filter(|e| nodes.contains(&linear.nodes[e.at].node)).count() == at;
            assert!(edges(own.edges.len()));
            let memory = linear.memory.iter().filter(|m| nodes.contains(&linear.nodes[m.at].node));
            let memory: Vec<_> = memory.map(|m| (m.force, m.relaxation)).collect();
            assert_eq!(memory.len(), own.memory.len());
            for ((force, rates), own) in memory.iter().zip(&own.memory) {
                assert!((force - own.force).abs() < 1e-6 * b.force[2].abs(), "{law}, patch {c}");
                assert!((rates.decay / own.relaxation.decay - 1.0).abs() < 1e-6, "{law}, patch {c}: {rates:?}");
            }
        }
        assert_eq!(linear.memory.is_empty(), friction.is_constant());
    }
    let shared = problem(&both, &both_w, vec![rolling[0]; 2], Loads::vertical(&[0.0; 2], NormalLoad::Force(50e3)));
    let found = shared.solve().unwrap();
    for p in &found.patches {
        assert!((p.force[2] / -25e3 - 1.0).abs() < 1e-10, "{:?}", found.patches);
    }
    assert!((found.motions[0] - found.patches[1].approach).abs() < 1e-18);
    // Heights apart by more than the load presses: one of them bears it all.
    let mut uneven = both.clone();
    uneven.patches[1].nodes().for_each(|i| uneven.gap[i] += 1e-3);
    let found = SteadyProblem { interface: &uneven, ..shared }.solve().unwrap();
    assert!((found.patches[0].force[2] / -50e3 - 1.0).abs() < 1e-10 && found.patches[1].force == [0.0; 3]);
}

/// Patches tilted by ±δ under one vertical load, all sliding: N follows from the balance by hand, N (2 cos δ) = Q where
/// both slide to the same side, 2 N (cos δ − μ sin δ) = Q where both slide down the slope of the lower surface.
#[test]
fn a_vertical_load_is_borne_by_pressures_and_friction() {
    let (angle, load) = (0.6f64, 40e3);
    let s = patch(4.0, 0.0);
    let w = far_apart(&s, 2);
    let both = Interface::joined(vec![s.clone(), s]).unwrap();
    let loads = || Loads::vertical(&[angle, -angle], NormalLoad::Force(load));
    let rolling = |eta: [f64; 2]| {
        let of = |lateral| PatchKinematics {
            speed: 10.0,
            creepage: ContactCreepage { lateral, ..ContactCreepage::default() },
        };
        eta.map(of).to_vec()
    };
    for (eta, want) in [
        ([0.05, 0.05], load / (2.0 * angle.cos())),
        // Where the surface falls to the right, friction on the upper body points to the left and up the slope...
        ([0.05, -0.05], load / (2.0 * (angle.cos() - MU * angle.sin()))),
        // ... and down it where it slides up.
        ([-0.05, 0.05], load / (2.0 * (angle.cos() + MU * angle.sin()))),
    ] {
        let kinematics = rolling(eta);
        let sliding = SlidingProblem {
            interface: &both,
            compliance: w.as_ref(),
            friction: FrictionLaw::Constant(MU).into(),
            kinematics: kinematics.clone(),
            loads: loads(),
            stencil: Stencil::default(),
            direction: SlidingDirection::Rigid,
        };
        let rigid = sliding.solve().unwrap();
        let rolling = problem(&both, &w, kinematics, loads()).solve().unwrap();
        // The creep of the deformed bodies has a part along x, too.
        for (patches, motion, bound) in
            [(&rigid.patches, rigid.motions[0], 1e-9), (&rolling.patches, rolling.motions[0], 1e-4)]
        {
            for (p, eta) in patches.iter().zip(eta) {
                assert!((-p.force[2] / want - 1.0).abs() < bound, "eta {eta}: {p:?}, wanted {want} N");
                assert!((p.force[1] + MU * want * eta.signum()).abs() < bound * want, "eta {eta}: {p:?}");
                assert!((p.approach - motion * angle.cos()).abs() < 1e-15);
            }
            let up = patches[0].force[1] * angle.sin() - patches[1].force[1] * angle.sin();
            let sum = up - angle.cos() * (patches[0].force[2] + patches[1].force[2]);
            assert!((sum / load - 1.0).abs() < 1e-9, "{sum} N");
        }
        assert!(rolling.state.iter().all(|&s| s != 1));
    }
    // Unequal angles and creepages, some nodes in stick: the resultant of the solution is the load, with the force of
    // each patch turned from its frame into the vertical, on the upper body.
    let angles = [0.05, -0.764];
    let kinematics = rolling([2e-3, 8e-3]);
    let found = problem(&both, &w, kinematics, Loads::vertical(&angles, NormalLoad::Force(load))).solve().unwrap();
    assert!(found.state.contains(&1) && found.patches.iter().all(|p| p.force[2] < 0.0));
    let up = |(p, d): (&railsqueal::contact::PatchResultant, f64)| -p.force[2] * d.cos() + p.force[1] * d.sin();
    let sum: f64 = found.patches.iter().zip(angles).map(up).sum();
    assert!((sum / load - 1.0).abs() < 1e-9, "{sum} N");
}

/// Two patches under a vertical and a lateral force of the wheel: in full sliding the normal forces follow from both by
/// statics, N (cos δ − μτ sin δ) and N (sin δ + μτ cos δ), also where no pressures without friction bear these forces,
/// such as no lateral force on two surfaces that fall to the same side. With nodes in stick the resultants are the
/// forces, and with three patches too.
#[test]
fn a_vertical_and_a_lateral_force_determine_two_normal_forces() {
    let s = patch(4.0, 0.0);
    let rolling = |eta: &[f64]| {
        let of = |&lateral: &f64| PatchKinematics {
            speed: 10.0,
            creepage: ContactCreepage { lateral, ..ContactCreepage::default() },
        };
        eta.iter().map(of).collect::<Vec<_>>()
    };
    let sums = |patches: &[railsqueal::contact::PatchResultant], angles: &[f64]| {
        let all = || patches.iter().zip(angles);
        let vertical: f64 = all().map(|(p, d)| -p.force[2] * d.cos() + p.force[1] * d.sin()).sum();
        let lateral: f64 = all().map(|(p, d)| -p.force[2] * d.sin() - p.force[1] * d.cos()).sum();
        [vertical, lateral]
    };
    let w = far_apart(&s, 2);
    let both = Interface::joined(vec![s.clone(), s.clone()]).unwrap();
    for (angles, eta, vertical, lateral) in [
        ([-0.02, -0.6], [0.05, 0.05], 40e3, 0.0),
        ([-0.02, -1.2], [0.05, 0.05], 40e3, -10e3),
        ([0.03, 0.9], [-0.05, -0.05], 40e3, 3e3),
        ([0.03, 0.9], [0.05, -0.05], 40e3, 20e3),
    ] {
        let part = |d: f64, eta: f64| {
            let friction = MU * eta.signum();
            [d.cos() - friction * d.sin(), d.sin() + friction * d.cos()]
        };
        let [[q1, y1], [q2, y2]] = [0, 1].map(|c| part(angles[c], eta[c]));
        let determinant = q1 * y2 - q2 * y1;
        let want = [(vertical * y2 - lateral * q2) / determinant, (lateral * q1 - vertical * y1) / determinant];
        assert!(want.iter().all(|n| *n > 1e3), "{want:?} N of {angles:?}");
        let loads = || Loads::vertical_and_lateral(&angles, [vertical, lateral], vec![20e3, 5e3]);
        let sliding = SlidingProblem {
            interface: &both,
            compliance: w.as_ref(),
            friction: FrictionLaw::Constant(MU).into(),
            kinematics: rolling(&eta),
            loads: loads(),
            stencil: Stencil::default(),
            direction: SlidingDirection::Rigid,
        };
        let rigid = sliding.solve().unwrap();
        let rolling = problem(&both, &w, rolling(&eta), loads()).solve().unwrap();
        for (patches, motions, bound) in
            [(&rigid.patches, &rigid.motions, 1e-8), (&rolling.patches, &rolling.motions, 1e-3)]
        {
            for ((p, want), d) in patches.iter().zip(want).zip(angles) {
                assert!((-p.force[2] / want - 1.0).abs() < bound, "{angles:?}: {p:?}, wanted {want} N");
                assert!((p.approach - (motions[0] * d.cos() - motions[1] * d.sin())).abs() < 1e-12);
            }
            let found = sums(patches, &angles);
            assert!((found[0] - vertical).abs() < 1e-8 * vertical && (found[1] - lateral).abs() < 1e-8 * vertical);
        }
    }
    // Nodes in stick, and a third patch: the forces of a state under given loads lead back to it.
    for (angles, eta) in [(&[0.05, -0.764][..], &[2e-3, 8e-3][..]), (&[0.05, -0.3, -1.1][..], &[2e-3, 3e-3, 8e-3][..])]
    {
        let count = angles.len();
        let (w, joined) = (far_apart(&s, count), Interface::joined(vec![s.clone(); count]).unwrap());
        let shared = Loads::vertical(angles, NormalLoad::Force(40e3));
        let first = problem(&joined, &w, rolling(eta), shared).solve().unwrap();
        assert!(first.state.contains(&1));
        let loads = Loads::vertical_and_lateral(angles, sums(&first.patches, angles), vec![10e3; count]);
        let again = problem(&joined, &w, rolling(eta), loads).solve().unwrap();
        for (p, q) in first.patches.iter().zip(&again.patches) {
            assert!((p.force[2] / q.force[2] - 1.0).abs() < 1e-6, "{p:?} {q:?}");
        }
        assert!(again.motions[1].abs() < 1e-6 * again.motions[0].abs(), "{:?}", again.motions);
    }
    // A force that lies outside what friction and angles allow has no equilibrium.
    let loads = Loads::vertical_and_lateral(&[-0.02, -0.6], [40e3, 30e3], vec![20e3, 5e3]);
    let error = problem(&both, &w, rolling(&[0.05, 0.05]), loads).solve().unwrap_err();
    assert!(matches!(error, Error::NotConverged(_)), "{error}");
}

/// Two motions of two patches, up and down and about the middle: the loads follow from the moment.
#[test]
fn two_motions_share_their_patches() {
    let s = patch(4.0, 0.0);
    let w = far_apart(&s, 2);
    let both = Interface::joined(vec![s.clone(), s]).unwrap();
    let motion = |factors: [f64; 2], load: f64| LoadedMotion {
        factors: factors.to_vec(),
        resultant: factors.iter().map(|&n| [0.0, 0.0, n]).collect(),
        load: NormalLoad::Force(load),
    };
    let (arm, load) = (0.75, 40e3);
    let kinematics =
        vec![
            PatchKinematics { speed: 10.0, creepage: ContactCreepage { lateral: 2e-3, ..ContactCreepage::default() } };
            2
        ];
    for moment in [0.0, 6e3] {
        let loads = Loads { motions: vec![motion([1.0, 1.0], load), motion([arm, -arm], moment)], begin: None };
        let found = problem(&both, &w, kinematics.clone(), loads).solve().unwrap();
        let want = [0.5 * (load + moment / arm), 0.5 * (load - moment / arm)];
        for (p, want) in found.patches.iter().zip(want) {
            assert!((-p.force[2] / want - 1.0).abs() < 1e-9, "{p:?}, wanted {want} N");
        }
        let [z, roll] = found.motions[..] else { panic!("{:?}", found.motions) };
        assert!((found.patches[1].approach - (z - arm * roll)).abs() < 1e-15);
    }
    // A moment that would lift one of them off and more has no equilibrium.
    let loads = Loads { motions: vec![motion([1.0, 1.0], load), motion([arm, -arm], 2.0 * load * arm)], begin: None };
    let error = problem(&both, &w, kinematics, loads).solve().unwrap_err();
    assert!(matches!(error, Error::NotConverged(_)), "{error}");
}

/// The linearised laws are satisfied by the difference of two neighbouring states: patch 1 pressed a little more
/// changes both, with stick and slip, each convected by its own speed.
#[test]
fn the_linearised_contact_is_the_difference_of_states() {
    let h = Humps::new();
    let mut kinematics = Humps::rolling(ContactCreepage { longitudinal: 1e-3, lateral: -2e-3, spin: 0.3 });
    kinematics[1].speed = 17.0;
    let state = |more: f64| {
        let loads = Loads::of_patches(&[NormalLoad::Approach(8e-5 + more), NormalLoad::Approach(8e-5)]);
        let p = SteadyProblem { tolerance: 1e-13, ..problem(&h.patches, &h.patches_w, kinematics.clone(), loads) };
        let found = p.solve().unwrap();
        (p.contact(&found), found)
    };
    let step = 1e-9;
    let ((linear, middle), (_, low), (_, high)) = (state(0.0), state(-step), state(step));
    assert!(low.state == middle.state && high.state == middle.state, "a node changes its status");
    let weight = &h.patches.weight;
    let change = |of: &dyn Fn(&SteadySolution) -> f64| (of(&high) - of(&low)) / (2.0 * step);
    let mut largest = [0.0f64; 2];
    let mut of_other: f64 = 0.0;
    for (at, node) in linear.nodes.iter().enumerate() {
        let i = node.node;
        let traction = [0, 1].map(|c| weight[i] * change(&|s| s.traction[i][c]));
        let pressure = weight[i] * change(&|s| s.pressure[i]);
        let mut creep = [0, 1]
            .map(|c| node.convection.iter().map(|&(j, v)| v * change(&|s: &SteadySolution| s.w[j][c])).sum::<f64>());
        for edge in linear.edges.iter().filter(|e| e.at == at) {
            for (j, by) in edge.gaps {
                let gap = change(&|s| s.gap[j]);
                (0..2).for_each(|c| creep[c] += by[c] * gap);
            }
        }
        let (size, scale) = match &node.tangent {
            // A node that sticks has no creep, the change of which is measured by that of its convection.
            Tangent::Stick { .. } => (creep[0].hypot(creep[1]), 1e-3 * kinematics[0].speed),
            tangent => {
                let [along, across] = tangent.rows(traction, pressure, creep);
                let Tangent::Slip(slip) = tangent else { panic!("an open node") };
                let unit = slip.across[0].hypot(slip.across[1] / (weight[i] * 1e12));
                (along.hypot(across / unit), pressure.abs().max(MU * weight[i] * 1e12))
            }
        };
        let patch = h.patches.patch_of(i);
        largest[patch] = largest[patch].max(size / scale);
        if patch == 1 {
            of_other = of_other.max(pressure.abs());
        }
    }
    assert!(of_other > 0.0, "the other patch does not feel it");
    // The error of the difference goes with the square of the step, down to rounding.
    assert!(largest.iter().all(|&v| v < 2e-4), "{largest:?}");
}

/// A body of two half-space patches far apart whose modes move one patch alone, against a rigid one.
fn modal(s: &Interface, frequencies: &[f64], seed: f64) -> ReducedBody {
    let omega: Vec<f64> = frequencies.iter().map(|f| 2.0 * PI * f).collect();
    let modes = Mat::from_fn(3 * s.len(), omega.len(), |i, k| {
        let [x, y] = s.point(i / 3);
        let phase = 2.3 * k as f64 + seed;
        0.05 * ((1.7 * (i % 3) as f64 + phase).sin() + 10.0 * (x * phase.cos() + y * (2.0 * phase).sin()))
    });
    let mut compliance = far_apart(s, 1);
    for k in 0..omega.len() {
        for j in 0..3 * s.len() {
            for i in 0..3 * s.len() {
                compliance[(i, j)] += modes[(i, k)] * modes[(j, k)] / omega[k].powi(2);
            }
        }
    }
    let damping = vec![0.4; omega.len()];
    ReducedBody::new(omega, damping, modes, compliance)
}

/// Both bodies side by side: rows and modes of the second after those of the first.
fn side_by_side(a: &ReducedBody, b: &ReducedBody) -> ReducedBody {
    let joined = |a: &Mat<f64>, b: &Mat<f64>| {
        Mat::from_fn(a.nrows() + b.nrows(), a.ncols() + b.ncols(), |i, j| match (i < a.nrows(), j < a.ncols()) {
            (true, true) => a[(i, j)],
            (false, false) => b[(i - a.nrows(), j - a.ncols())],
            _ => 0.0,
        })
    };
    let omega = [&a.omega[..], &b.omega[..]].concat();
    let damping = vec![0.4; omega.len()];
    ReducedBody::new(omega, damping, joined(&a.contact_modes, &b.contact_modes), joined(&a.compliance, &b.compliance))
}

fn rigid(n: usize) -> ReducedBody {
    ReducedBody::new(vec![], vec![], Mat::zeros(3 * n, 0), Mat::zeros(3 * n, 3 * n))
}

fn values(of: &[Eigenpair]) -> Vec<num_complex::Complex<f64>> {
    of.iter().map(|p| p.value).filter(|v| v.im > 0.0 && v.re.abs() < 0.3 * v.norm()).collect()
}

/// Eigenvalues of two patches that neither compliance nor modes couple are those of both by themselves, by the dense
/// pencil and by the determinant; coupled ones are found alike by both.
#[test]
fn eigenvalues_of_patches_apart_are_those_of_each() {
    let s = patch(4.0, 0.0);
    let n = s.len();
    let both = Interface::joined(vec![s.clone(), s.clone()]).unwrap();
    let first: Vec<f64> = (0..40).map(|k| 400.0 + 90.0 * f64::from(k)).collect();
    let second: Vec<f64> = (0..40).map(|k| 433.0 + 87.0 * f64::from(k)).collect();
    let bodies = [modal(&s, &first, 0.0), modal(&s, &second, 1.1)];
    let rolling = [
        PatchKinematics { speed: 10.0, creepage: ContactCreepage { longitudinal: 0.0, lateral: 0.003, spin: 0.3 } },
        PatchKinematics { speed: 14.0, creepage: ContactCreepage { longitudinal: 0.001, lateral: -0.012, spin: 0.0 } },
    ];
    let loads = [NormalLoad::Force(40e3), NormalLoad::Force(20e3)];
    let falling = FrictionLaw::from(Exponential::new(0.4, 0.25, 0.1).remembering(1e-3));
    let friction = PatchFriction::new(FrictionLaw::Constant(MU), vec![falling]);
    let linear = |s: &Interface, pair: &CoupledModel, (patch, count): (usize, usize)| {
        let (rolling, loads) = (rolling[patch..][..count].to_vec(), Loads::of_patches(&loads[patch..][..count]));
        let friction = if count == 2 { friction.clone() } else { friction.law(patch).clone().into() };
        let p = SteadyProblem { friction, ..problem(s, &pair.compliance, rolling, loads) };
        p.contact(&p.solve().unwrap())
    };
    let mut alone = Vec::new();
    for c in 0..2 {
        let pair = CoupledModel::new(&bodies[c], &rigid(n)).unwrap();
        let contact = linear(&s, &pair, (c, 1));
        alone.extend(values(&reduced::eigenpairs(&pair, &contact, 1e-8).unwrap()));
    }
    let whole = side_by_side(&bodies[0], &bodies[1]);
    let pair = CoupledModel::new(&whole, &rigid(2 * n)).unwrap();
    let contact = linear(&both, &pair, (0, 2));
    let dense = values(&reduced::eigenpairs(&pair, &contact, 1e-8).unwrap());
    let determinant = nonlinear_eigen::eigenpairs(&pair, &contact, [0.3, 1e-10], &SpectrumMemory::default())
        .unwrap()
        .expect("many modes by few functions");
    let alike = |found: &[num_complex::Complex<f64>], wanted: &[num_complex::Complex<f64>], bound: f64, what: &str| {
        assert!(wanted.len() >= 70 && found.len() == wanted.len(), "{what}: {} of {}", found.len(), wanted.len());
        for w in wanted {
            let near = found.iter().map(|v| (v - w).norm()).fold(f64::INFINITY, f64::min);
            assert!(near < bound * w.norm(), "{what}: {w} off by {near:e}");
        }
    };
    alike(&dense, &alone, 1e-8, "two patches");
    alike(&values(&determinant), &dense, 1e-8, "determinant");
    // A body whose modes move both patches, and whose patches feel each other.
    let modes = Mat::from_fn(6 * n, 80, |i, k| {
        whole.contact_modes[(i, k)] + 0.4 * whole.contact_modes[((i + 3 * n) % (6 * n), k)]
    });
    let mut compliance = far_apart(&s, 2);
    for j in 0..6 * n {
        for i in 0..6 * n {
            let modal: f64 = (0..80).map(|k| modes[(i, k)] * modes[(j, k)] / whole.omega[k].powi(2)).sum();
            compliance[(i, j)] += modal + if i % 3 == j % 3 { 1e-10 } else { 0.0 };
        }
    }
    let whole = ReducedBody::new(whole.omega, vec![0.4; 80], modes, compliance);
    let pair = CoupledModel::new(&whole, &rigid(2 * n)).unwrap();
    let contact = linear(&both, &pair, (0, 2));
    let dense = values(&reduced::eigenpairs(&pair, &contact, 1e-8).unwrap());
    let determinant = nonlinear_eigen::eigenpairs(&pair, &contact, [0.3, 1e-10], &SpectrumMemory::default())
        .unwrap()
        .expect("many modes by few functions");
    alike(&values(&determinant), &dense, 1e-8, "coupled patches");
    let moved = alone.iter().map(|w| dense.iter().map(|v| (v - w).norm()).fold(f64::INFINITY, f64::min));
    assert!(moved.fold(0.0, f64::max) > 1.0, "the coupling moves nothing");
}

fn settings(loading: Loading, friction: impl Into<PatchFriction>, step: f64) -> Settings {
    let (scheme, solver) = (Scheme { step, theta: 0.5 }, ContactSolver::Newton);
    Settings { scheme, friction: friction.into(), solver, tolerance: 1e-12, drive: loading }
}

/// Constant rolling of patches whose approaches are those of the gaps.
fn held(kinematics: &[PatchKinematics]) -> Loading {
    let loads = vec![NormalLoad::Approach(0.0); kinematics.len()];
    Loading::of_loads(&Loads::of_patches(&loads), kinematics.iter().copied().map(PatchDrive::constant).collect())
}

/// Bodies without modes on the interface `s`.
fn quasi_static<'a>(s: &'a Interface, w: &'a Mat<f64>, none: &'a Mat<f64>) -> Model<'a> {
    Model {
        interface: s,
        residual: w.as_ref(),
        modes: none.as_ref(),
        omega: &[],
        stiffness: vec![].into(),
        damping: vec![].into(),
        turning: None,
        carried: None,
        load: &[],
    }
}

/// In time two patches are the humps of one grid too, step by step, under an approach that grows: stick, slip, and
/// nodes that come in; with friction that is remembered.
#[test]
fn in_time_two_patches_are_the_humps_of_one_grid() {
    let h = Humps::new();
    let creepage = ContactCreepage { longitudinal: 1e-3, lateral: -2e-3, spin: 0.3 };
    let falling = FrictionLaw::from(Exponential::new(0.4, 0.25, 0.1).remembering(1e-3));
    let (step, steps) = (4e-5, 12);
    for friction in [FrictionLaw::Constant(MU), falling] {
        let end = step * steps as f64;
        let approach = || Normal::Approach(History::table("approach", &[[0.0, 5e-5], [end, 9e-5]], end).unwrap());
        let run = |s: &Interface, w: &Mat<f64>, kinematics: Vec<PatchKinematics>| -> Vec<(State, [f64; 3], usize)> {
            let none = Mat::zeros(3 * s.len(), 0);
            let model = quasi_static(s, w, &none);
            let drives = kinematics.into_iter().map(PatchDrive::constant).collect::<Vec<_>>();
            let angles = vec![0.0; drives.len()];
            let mut loading = Loading::of_loads(&Loads::vertical(&angles, NormalLoad::Approach(0.0)), drives);
            loading.motions[0].normal = approach();
            let start = State::at_rest(&model, &vec![0.0; 3 * s.len()], &[5e-5]);
            let mut stepper = Stepper::new(model, settings(loading, friction.clone(), step), start).unwrap();
            (0..steps)
                .map(|_| {
                    stepper.advance().unwrap();
                    let report = stepper.report();
                    // Frames of patches on one plane are one.
                    let sum = |c: usize| report.patches.iter().map(|patch| patch.force[c]).sum();
                    (stepper.state().clone(), [0, 1, 2].map(sum), report.stick())
                })
                .collect()
        };
        let whole = run(&h.whole, &h.whole_w, PatchKinematics::one(10.0, creepage));
        let both = run(&h.patches, &h.patches_w, Humps::rolling(creepage));
        for ((a, force, stick), (b, same, number)) in whole.iter().zip(&both) {
            let load = -force[2];
            for (k, &i) in h.nodes.iter().enumerate() {
                for c in 0..3 {
                    let off = (b.reaction[3 * k + c] - a.reaction[3 * i + c]).abs();
                    assert!(off < 1e-8 * load, "{friction}, step {}: node {k} off by {off:e} of {load} N", a.step);
                }
            }
            assert!((0..3).all(|c| (force[c] - same[c]).abs() < 1e-8 * load) && stick == number);
            let (e, f) = (a.energy, b.energy);
            for (name, a, b) in
                [("friction", e.friction, f.friction), ("drive", e.drive, f.drive), ("rolling", e.rolling, f.rolling)]
            {
                assert!((a - b).abs() < 1e-7 * e.drive.abs().max(e.friction), "{friction}: {name} {a} and {b} J");
            }
        }
        let (closed, last) = (|s: &State| s.reaction.chunks(3).filter(|r| r[2] > 0.0).count(), steps - 1);
        assert!(closed(&both[last].0) > closed(&both[0].0) + 20 && both[last].2 > 10);
    }
}

/// Two patches with modes of their own, at their own speeds, are the two contacts by themselves; the energies add up.
#[test]
fn in_time_patches_apart_are_single_ones() {
    let s = patch(4.0, 0.0);
    let n = s.len();
    let bodies = [modal(&s, &[600.0, 1300.0], 0.0), modal(&s, &[900.0, 2100.0], 1.1)];
    let rolling = [
        PatchKinematics { speed: 10.0, creepage: ContactCreepage { longitudinal: 0.0, lateral: 0.003, spin: 0.3 } },
        PatchKinematics { speed: 14.0, creepage: ContactCreepage { longitudinal: 0.001, lateral: -0.012, spin: 0.0 } },
    ];
    let loads = [NormalLoad::Force(40e3), NormalLoad::Force(20e3)];
    let both = Interface::joined(vec![s.clone(), s.clone()]).unwrap();
    let whole = CoupledModel::new(&side_by_side(&bodies[0], &bodies[1]), &rigid(2 * n)).unwrap();
    // The state of rest, whose approaches become part of the gaps; moved by velocities of the modes.
    let rest = problem(&both, &whole.compliance, rolling.to_vec(), Loads::of_patches(&loads)).solve().unwrap();
    let gap = |s: &Interface, first: usize| -> Vec<f64> {
        (0..s.len()).map(|i| s.gap[i] - rest.patches[both.patch_of(first + i)].approach).collect()
    };
    let reaction = |nodes: std::ops::Range<usize>| -> Vec<f64> {
        nodes
            .flat_map(|i| [rest.traction[i][0], rest.traction[i][1], rest.pressure[i]].map(|v| v * both.weight[i]))
            .collect()
    };
    // A wave on one of the lower surfaces, and a joint on the other one.
    let rough = |c: usize| {
        let (shape, at) = match c {
            0 => (RoughnessShape::Wave { length: 4e-3, height: 2e-6 }, 0.0),
            _ => (RoughnessShape::Joint { length: 0.01, depth: 5e-6 }, 4e-3),
        };
        let feature = RoughnessFeature::Shape { shape, at, period: None };
        RoughSurfaces { speed: rolling[c].speed, onset: 1e-3, parts: [vec![feature], vec![]], ahead: [0.0; 2] }
    };
    let run = |s: &Interface, pair: &CoupledModel, first: usize, kinematics: &[PatchKinematics], kicks: &[f64]| {
        let surfaces = (0..kinematics.len()).map(|c| rough(first / n + c)).collect();
        let s = s.with_gap(gap(s, first));
        let model = Model::new(pair, &s);
        let mut start = State::at_rest(&model, &reaction(first..first + s.len()), &vec![0.0; kinematics.len()]);
        start.v.copy_from_slice(kicks);
        let settings = settings(held(kinematics), FrictionLaw::Constant(MU), 1e-5);
        let mut stepper = Stepper::new(model, settings, start).unwrap().rough(surfaces).unwrap();
        (0..60).for_each(|_| stepper.advance().unwrap());
        (stepper.state().clone(), stepper.report().clone())
    };
    let kicks = [0.3, -0.2, 0.25, 0.1];
    let (found, report) = run(&both, &whole, 0, &rolling, &kicks);
    let mut sums = [0.0; 6];
    let mut closed = 0;
    for c in 0..2 {
        let pair = CoupledModel::new(&bodies[c], &rigid(n)).unwrap();
        let (alone, own) = run(&s, &pair, n * c, &rolling[c..=c], &kicks[2 * c..2 * c + 2]);
        let load = -own.force()[2];
        for k in 0..3 * n {
            let off = (found.reaction[3 * n * c + k] - alone.reaction[k]).abs();
            assert!(off < 1e-8 * load, "patch {c}: reaction {k} off by {off:e} of {load} N");
        }
        for k in 0..2 {
            assert!((found.v[2 * c + k] - alone.v[k]).abs() < 1e-8 && (found.q[2 * c + k] - alone.q[k]).abs() < 1e-12);
        }
        let e = alone.energy;
        for (sum, v) in sums.iter_mut().zip([e.kinetic, e.elastic, e.friction, e.damping, e.drive, e.rolling]) {
            *sum += v;
        }
        closed += own.closed();
        let force = report.patches[c].force;
        assert!((0..3).all(|k| (force[k] - own.force()[k]).abs() < 1e-8 * load), "patch {c}: {force:?}");
    }
    let e = found.energy;
    for (sum, v) in sums.iter().zip([e.kinetic, e.elastic, e.friction, e.damping, e.drive, e.rolling]) {
        assert!((sum - v).abs() < 1e-7 * sums[2].abs(), "{v} J, the sum of both is {sum} J");
    }
    assert_eq!(report.closed(), closed);
    assert_eq!(report.force(), report.patches[0].force);
}

#[path = "patches/loaded.rs"]
mod loaded;
