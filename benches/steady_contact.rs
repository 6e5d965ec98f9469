//! Steady rolling contact, cold start: ten random creepages on unlike bodies with some 500 contact nodes.
//!
//! Half-space influence matrices (assembled outside the timing), steel on a softer material, ξ, η, φ all nonzero, residual
//! 1e-8 of the natural map. Prints one line per case and the minimum, median and maximum of the wall times.

use std::time::Instant;

use railsqueal::body::half_space::HalfSpace;
use railsqueal::contact::{Creepage, NormalLoad, SteadyProblem, Stencil};
use railsqueal::grid::Interface;
use railsqueal::model::combined_compliance;

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

/// CPU time of this process so far, s, where the system tells (Linux): what a busy machine takes away is not in it.
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|v| v.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-9
}

fn main() {
    let steel = HalfSpace { young: 205e9, poisson: 0.3 };
    let soft = HalfSpace { young: 70e9, poisson: 0.2 };
    let repeats: usize = std::env::var("REPEATS").ok().and_then(|v| v.parse().ok()).unwrap_or(3);
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    println!("case nodes closed stick     xi      eta     phi  iterations products  residual   wall_s    cpu_s   tangential_force/muN");
    let (mut times, mut cpu_times) = (Vec::new(), Vec::new());
    for case in 0..10 {
        let curvature = [2.0 * (1.0 + 0.3 * random.next()), 2.0 * (1.0 + 0.3 * random.next())];
        let (cx, cy) = (1.0 / steel.plane(), 1.0 / soft.plane());
        let modulus = 1.0 / (cx + cy);
        // Radius of the circle of the mean curvature; 25 nodes across hold about 490 of them.
        let load = 70e3;
        let mean = (curvature[0] * curvature[1]).sqrt();
        let a = (0.75 * load / (modulus * mean)).cbrt();
        let r = (curvature[1] / curvature[0]).powf(1.0 / 3.0);
        let nodes = 31;
        let interface = Interface::paraboloid(nodes, nodes, [a * r * 1.2, a / r * 1.2], curvature).unwrap();
        let w = combined_compliance(
            steel.compliance(&interface.x, &interface.y).unwrap().as_ref(),
            soft.compliance(&interface.x, &interface.y).unwrap().as_ref(),
        )
        .unwrap();
        let creepage =
            Creepage { longitudinal: 4e-3 * random.next(), lateral: 4e-3 * random.next(), spin: 0.6 * random.next() };
        let problem = SteadyProblem {
            interface: &interface,
            compliance: w.as_ref(),
            friction: railsqueal::friction::FrictionLaw::Constant(0.3),
            speed: 10.0,
            creepage,
            load: NormalLoad::Force(load),
            stencil: Stencil::default(),
            tolerance: 1e-8,
            max_iterations: 200,
        };
        let (mut best, mut best_cpu) = (f64::INFINITY, f64::INFINITY);
        let mut last = None;
        for _ in 0..repeats {
            let (start, start_cpu) = (Instant::now(), cpu());
            let solution = problem.solve().unwrap();
            best = best.min(start.elapsed().as_secs_f64());
            best_cpu = best_cpu.min(cpu() - start_cpu);
            last = Some(solution);
        }
        let s = last.unwrap();
        let count = |k: u8| s.state.iter().filter(|&&v| v == k).count();
        println!(
            "{case:4} {:5} {:6} {:5} {:8.5} {:8.5} {:7.4} {:10} {:8}  {:9.1e} {:8.4} {:8.4}   {:.4}",
            interface.len(),
            count(1) + count(2),
            count(1),
            creepage.longitudinal,
            creepage.lateral,
            creepage.spin,
            s.iterations,
            s.products,
            s.residual,
            best,
            best_cpu,
            s.force[0].hypot(s.force[1]) / (0.3 * load)
        );
        times.push(best);
        cpu_times.push(best_cpu);
    }
    for (name, t) in [("wall", &mut times), ("cpu", &mut cpu_times)] {
        t.sort_by(f64::total_cmp);
        println!("{name}, best of {repeats} runs each: min {:.4} s, median {:.4} s, max {:.4} s", t[0], t[5], t[9]);
        if name == "cpu" {
            println!("row: dense compliance | {:.4} s | {:.4} s | {:.4} s", t[0], t[5], t[9]);
        }
    }
}
