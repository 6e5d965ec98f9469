//! Convergence of the total tangential force over the grid, half-space, both upstream operators.
use railsqueal::contact::half_space::HalfSpace;
use railsqueal::contact::*;
fn main() {
    let m = HalfSpace { young: 205e9, poisson: 0.3 };
    let a = 4.884e-3;
    for st in [Stencil::Upwind1, Stencil::Upwind2] {
        for (load, eta) in [(70e3, 0.003), (70e3, 0.001), (70e3, 0.005), (10e3, 0.003)] {
            let a = a * (load / 70e3f64).cbrt();
            for k in [6usize, 8, 12, 16] {
                let h = a / k as f64;
                let nn = 2 * (k + 2) + 1;
                let half = h * (k + 2) as f64;
                let s = Interface::paraboloid(nn, nn, [half, half], [4.0, 4.0]).unwrap();
                let c = m.compliance(&s.x, &s.y).unwrap();
                let w = combined_compliance(c.as_ref(), c.as_ref()).unwrap();
                let t = std::time::Instant::now();
                let p = SteadyProblem {
                    interface: &s,
                    compliance: w.as_ref(),
                    friction: 0.3,
                    speed: 10.0,
                    creepage: Creepage { longitudinal: 0.0, lateral: eta, spin: 0.0 },
                    load: NormalLoad::Force(load),
                    stencil: st,
                    tolerance: 1e-8,
                    max_iterations: 200,
                };
                match p.solve() {
                    Ok(r) => println!(
                        "{st:?} N {load} eta {eta} a/{k}: Fy/muN {:.5} approach {:.4e} p0 {:.4e} it {} res {:.1e} time {:.3}",
                        r.force[1] / (0.3 * load),
                        r.approach,
                        r.pressure.iter().copied().fold(0.0, f64::max),
                        r.iterations,
                        r.residual,
                        t.elapsed().as_secs_f64()
                    ),
                    Err(e) => println!("{st:?} {eta} a/{k}: {e}"),
                }
            }
        }
    }
}
