//! A creep curve of 50 points by continuation, to the residuals 1e-6 and 1e-8, beside single solutions from nothing
//! to 1e-8: unlike bodies, some 500 contact nodes.
//!
//! Half-space influence (made outside the timing), as a dense matrix and as a convolution. Prints the processor time
//! of the curve, the times of every tenth point from nothing, and their ratio.

use std::time::Instant;

use railsqueal::body::half_space::HalfSpace;
use railsqueal::contact::{
    ContactCreepage, Continuation, Influence, NormalLoad, PatchKinematics, SteadyProblem, Stencil,
};
use railsqueal::friction::FrictionLaw;
use railsqueal::grid::Interface;
use railsqueal::model::{combined_compliance, Convolution};

/// Processor time of this process so far, s, where the system tells (Linux); else the time of day.
fn cpu(begun: Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|v| v.parse::<f64>().ok()).map_or(begun.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

fn main() {
    let begun = Instant::now();
    let steel = HalfSpace { young: 205e9, poisson: 0.3 };
    let soft = HalfSpace { young: 70e9, poisson: 0.2 };
    let interface = Interface::paraboloid(31, 31, [9.4e-3, 9.4e-3], [2.0, 2.0]).unwrap();
    let [a, b] = [steel, soft].map(|body| body.compliance(&interface.patches[0].x, &interface.patches[0].y).unwrap());
    let w = combined_compliance(a.as_ref(), b.as_ref()).unwrap();
    let [a, b] = [steel, soft]
        .map(|m| Convolution::of_half_space(&m, &interface.patches[0].x, &interface.patches[0].y).unwrap().unwrap());
    let convolution = Convolution::combined(&a, &b).unwrap();
    curve(begun, "matrix", &interface, w.as_ref().into());
    curve(begun, "convolution", &interface, (&convolution).into());
}

fn curve(begun: Instant, kind: &str, interface: &Interface, compliance: Influence<'_>) {
    println!("{kind}");
    let at = |lateral: f64| ContactCreepage { longitudinal: 0.0, lateral, spin: 0.1 };
    let problem = SteadyProblem {
        interface,
        compliance,
        friction: FrictionLaw::Constant(0.3).into(),
        kinematics: PatchKinematics::one(10.0, at(0.0)),
        loads: NormalLoad::Force(70e3).into(),
        stencil: Stencil::default(),
        tolerance: 1e-8,
        max_iterations: 200,
    };
    let values: Vec<f64> = (1..=50).map(|i| 2e-4 * f64::from(i)).collect();
    let (mut singles, mut work) = (0.0, [0, 0]);
    println!("   eta      cpu_s   iterations products");
    for eta in values.iter().skip(9).step_by(10) {
        let start = cpu(begun);
        let found =
            SteadyProblem { kinematics: PatchKinematics::one(10.0, at(*eta)), ..problem.clone() }.solve().unwrap();
        let time = cpu(begun) - start;
        singles += time;
        work = [work[0] + found.iterations, work[1] + found.products];
        println!("{eta:.4}    {time:8.4}  {:10} {:8}", found.iterations, found.products);
    }
    let each = |sum: usize, count: f64| sum as f64 / count;
    println!(
        "row: {kind}, from nothing, mean of five | 1e-8 | {:.4} s | {:.1} | {:.0} | ",
        singles / 5.0,
        each(work[0], 5.0),
        each(work[1], 5.0)
    );
    for tolerance in [1e-8, 1e-6] {
        let start = cpu(begun);
        let mut curve = Continuation::new(SteadyProblem { tolerance, ..problem.clone() });
        let found: Vec<_> =
            values.iter().map(|eta| curve.solve(PatchKinematics::one(10.0, at(*eta))).unwrap()).collect();
        let time = cpu(begun) - start;
        let iterations: usize = found.iter().map(|s| s.iterations).sum();
        let products: usize = found.iter().map(|s| s.products).sum();
        println!(
            "50 points to {tolerance:.0e} {time:8.4}  {iterations:10} {products:8}, {:.1} times five from nothing",
            time / singles
        );
        println!(
            "row: {kind}, by continuation, mean of 50 | {tolerance:.0e} | {:.4} s | {:.1} | {:.0} | {:.1}",
            time / 50.0,
            each(iterations, 50.0),
            each(products, 50.0),
            time / singles
        );
    }
}
