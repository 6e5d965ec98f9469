//! Steady rolling contact, cold start: ten random creepages on unlike bodies with some 500 contact nodes, and one of
//! each of these on many more.
//!
//! Half-space influence (assembled outside the timing), steel on a softer material, ξ, η, φ all nonzero, residual 1e-8
//! of the natural map: as a dense matrix, as a convolution, and as one beside which the bodies yield as wholes
//! ("hybrid"). Prints one line per case and the minimum, median and maximum of the times. Then half-spaces on 12 100
//! nodes, and with 12 000 nodes in contact, everything within the timing. Arguments choose among `dense`,
//! `convolution`, `hybrid` and `large`.

use std::time::Instant;

use faer::Mat;
use railsqueal::body::half_space::HalfSpace;
use railsqueal::contact::{
    ContactCreepage, Influence, NormalLoad, PatchKinematics, SteadyProblem, SteadySolution, Stencil,
};
use railsqueal::grid::Interface;
use railsqueal::model::{combined_compliance, Convolution};

/// Uniform numbers in [−1, 1] from a fixed seed (xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

const STEEL: HalfSpace = HalfSpace { young: 205e9, poisson: 0.3 };
const SOFT: HalfSpace = HalfSpace { young: 70e9, poisson: 0.2 };
const LOAD: f64 = 70e3;

/// CPU time of this process so far, s, where the system tells (Linux): what a busy machine takes away is not in it.
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|v| v.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-9
}

/// One of the random cases on `nodes` lines each way: 25 of 31 lie across the contact, which holds about 490 of them.
fn case(random: &mut Random, nodes: usize) -> (Interface, ContactCreepage) {
    let curvature = [2.0 * (1.0 + 0.3 * random.next()), 2.0 * (1.0 + 0.3 * random.next())];
    let modulus = 1.0 / (1.0 / STEEL.plane() + 1.0 / SOFT.plane());
    // Radius of the circle of the mean curvature.
    let mean = (curvature[0] * curvature[1]).sqrt();
    let a = (0.75 * LOAD / (modulus * mean)).cbrt();
    let r = (curvature[1] / curvature[0]).powf(1.0 / 3.0);
    let interface = Interface::paraboloid(nodes, nodes, [a * r * 1.2, a / r * 1.2], curvature).unwrap();
    let creepage = ContactCreepage {
        longitudinal: 4e-3 * random.next(),
        lateral: 4e-3 * random.next(),
        spin: 0.6 * random.next(),
    };
    (interface, creepage)
}

fn problem<'a>(interface: &'a Interface, compliance: Influence<'a>, creepage: ContactCreepage) -> SteadyProblem<'a> {
    SteadyProblem {
        interface,
        compliance,
        friction: railsqueal::friction::FrictionLaw::Constant(0.3).into(),
        kinematics: PatchKinematics::one(10.0, creepage),
        loads: NormalLoad::Force(LOAD).into(),
        stencil: Stencil::default(),
        tolerance: 1e-8,
        max_iterations: 200,
    }
}

fn dense(s: &Interface) -> Mat<f64> {
    let [steel, soft] = [STEEL, SOFT].map(|m| m.compliance(&s.patches[0].x, &s.patches[0].y).unwrap());
    combined_compliance(steel.as_ref(), soft.as_ref()).unwrap()
}

fn convolution(s: &Interface) -> Convolution {
    let [steel, soft] =
        [STEEL, SOFT].map(|m| Convolution::of_half_space(&m, &s.patches[0].x, &s.patches[0].y).unwrap().unwrap());
    Convolution::combined(&steel, &soft).unwrap()
}

/// Half-spaces whose bodies yield by some nm/N at the contact, and turn.
fn hybrid(s: &Interface) -> Convolution {
    let pi = Mat::from_fn(3 * s.len(), 9, |row, k| {
        let [x, y] = s.point(row / 3);
        if k % 3 == row % 3 {
            [1.0, x, y][k / 3]
        } else {
            0.0
        }
    });
    let a = Mat::from_fn(9, 9, |i, j| {
        let size = [2e-9f64, 3e-8, 3e-8];
        let like = if i == j { 1.0 } else { 0.2 };
        like * (size[i / 3] * size[j / 3]).sqrt()
    });
    let w = dense(s) + &pi * a * pi.transpose();
    Convolution::found_in(w.as_ref(), &s.patches[0].x, &s.patches[0].y).unwrap()
}

const HEAD: &str =
    "case nodes closed stick     xi      eta     phi  iterations products  residual   wall_s    cpu_s   \
                    tangential_force/muN";

fn line(case: usize, c: &ContactCreepage, s: &SteadySolution, times: [f64; 2]) {
    let count = |k: u8| s.state.iter().filter(|&&v| v == k).count();
    println!(
        "{case:4} {:5} {:6} {:5} {:8.5} {:8.5} {:7.4} {:10} {:8}  {:9.1e} {:8.4} {:8.4}   {:.4}",
        s.state.len(),
        count(1) + count(2),
        count(1),
        c.longitudinal,
        c.lateral,
        c.spin,
        s.iterations,
        s.products,
        s.residual,
        times[0],
        times[1],
        s.force[0].hypot(s.force[1]) / (0.3 * LOAD)
    );
}

/// Best wall and processor time of some runs.
fn timed<T>(repeats: usize, mut run: impl FnMut() -> T) -> ([f64; 2], T) {
    let mut best = [f64::INFINITY; 2];
    let mut last = None;
    for _ in 0..repeats.max(1) {
        let (start, start_cpu) = (Instant::now(), cpu());
        last = Some(run());
        best = [best[0].min(start.elapsed().as_secs_f64()), best[1].min(cpu() - start_cpu)];
    }
    (best, last.unwrap())
}

fn main() {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wanted = |name: &str| chosen.is_empty() || chosen.iter().any(|c| c == name);
    let repeats: usize = std::env::var("REPEATS").ok().and_then(|v| v.parse().ok()).unwrap_or(3);
    for kind in ["dense", "convolution", "hybrid"].into_iter().filter(|k| wanted(k)) {
        println!("{kind}\n{HEAD}");
        let mut random = Random(0x2545_f491_4f6c_dd1d);
        let mut times = [Vec::new(), Vec::new()];
        for number in 0..10 {
            let (interface, creepage) = case(&mut random, 31);
            let matrix = (kind == "dense").then(|| dense(&interface));
            let found = (kind == "hybrid").then(|| hybrid(&interface));
            let (best, s) = timed(repeats, || match (&matrix, &found) {
                (Some(w), _) => problem(&interface, w.as_ref().into(), creepage).solve().unwrap(),
                // Each run makes its own transforms.
                (_, Some(c)) => problem(&interface, (&c.fresh()).into(), creepage).solve().unwrap(),
                _ => problem(&interface, (&convolution(&interface)).into(), creepage).solve().unwrap(),
            });
            line(number, &creepage, &s, best);
            (0..2).for_each(|k| times[k].push(best[k]));
        }
        for (name, t) in ["wall", "cpu"].into_iter().zip(&mut times) {
            t.sort_by(f64::total_cmp);
            println!("{name}, best of {repeats} runs each: min {:.4} s, median {:.4} s, max {:.4} s", t[0], t[5], t[9]);
        }
        let cpu = &times[1];
        println!("row: {kind} | {:.4} s | {:.4} s | {:.4} s", cpu[0], cpu[5], cpu[9]);
    }
    for lines in [110, 153].into_iter().filter(|_| wanted("large")) {
        println!("half-spaces on {lines} x {lines} nodes\n{HEAD}");
        let mut random = Random(0x2545_f491_4f6c_dd1d);
        for number in 0..3 {
            let (interface, creepage) = case(&mut random, lines);
            let (best, s) = timed(repeats, || {
                let c = convolution(&interface);
                problem(&interface, (&c).into(), creepage).solve().unwrap()
            });
            line(number, &creepage, &s, best);
            let closed = s.state.iter().filter(|&&v| v > 0).count();
            println!(
                "row: large | {} | {closed} | {:.2} s | {} | {}",
                s.state.len(),
                best[1],
                s.iterations,
                s.products
            );
        }
    }
}
