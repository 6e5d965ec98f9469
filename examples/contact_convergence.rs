//! Convergence of the total tangential force over the grid for the upstream operators, half-space, two spheres of
//! R = 0.5 m, E = 205 GPa, ν = 0.3, μ = 0.3. Prints one table per case: grid size, then F_x/μN and F_y/μN for each
//! stencil. Grids by argument (nodes per contact radius), default 6 8 10 12 16 20 24.

use railsqueal::body::half_space::HalfSpace;
use railsqueal::contact::{ContactCreepage, NormalLoad, PatchKinematics, SteadyProblem, Stencil};
use railsqueal::grid::Interface;
use railsqueal::model::combined_compliance;

fn main() {
    let grids: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let grids = if grids.is_empty() { vec![6, 8, 10, 12, 16, 20, 24] } else { grids };
    let material = HalfSpace { young: 205e9, poisson: 0.3 };
    let cases = [
        ("N 70 kN, eta 0.3 %: CONTACT -0.7177", 70e3, [0.0, 0.003, 0.0]),
        ("N 70 kN, eta 0.1 %: CONTACT -0.3005", 70e3, [0.0, 0.001, 0.0]),
        ("N 70 kN, eta 0.5 %: CONTACT -0.9304", 70e3, [0.0, 0.005, 0.0]),
        ("N 10 kN, eta 0.3 %: CONTACT -0.9684", 10e3, [0.0, 0.003, 0.0]),
        ("N 70 kN, xi 0.2 %", 70e3, [0.002, 0.0, 0.0]),
        ("N 70 kN, phi 0.5 /m", 70e3, [0.0, 0.0, 0.5]),
        ("N 70 kN, xi 0.1 %, eta -0.2 %, phi 0.3 /m", 70e3, [0.001, -0.002, 0.3]),
    ];
    let stencils = [Stencil::Upwind1, Stencil::Upwind2, Stencil::Edge];
    let mut tables = vec![Vec::new(); cases.len()];
    for &k in &grids {
        // The influence matrix of a grid scales with the inverse of its size: one matrix serves both loads.
        let n = 2 * (k + 2) + 1;
        let side = (k + 2) as f64 / k as f64;
        let unit = Interface::paraboloid(n, n, [side, side], [4.0, 4.0]).expect("grid");
        let c = material.compliance(&unit.patches[0].x, &unit.patches[0].y).expect("compliance");
        let w = combined_compliance(c.as_ref(), c.as_ref()).expect("compliance");
        for (table, &(_, load, [xi, eta, phi])) in tables.iter_mut().zip(&cases) {
            let a = (0.75 * load / (0.5 * material.plane() * 4.0)).cbrt();
            let s = Interface::paraboloid(n, n, [a * side, a * side], [4.0, 4.0]).expect("grid");
            let w = faer::Scale(1.0 / a) * &w;
            let forces = stencils.map(|stencil| {
                SteadyProblem {
                    interface: &s,
                    compliance: w.as_ref().into(),
                    friction: railsqueal::friction::FrictionLaw::Constant(0.3).into(),
                    kinematics: PatchKinematics::one(
                        10.0,
                        ContactCreepage { longitudinal: xi, lateral: eta, spin: phi },
                    ),
                    loads: NormalLoad::Force(load).into(),
                    stencil,
                    tolerance: 1e-8,
                    max_iterations: 200,
                }
                .solve()
                .map(|r| [r.force[0] / (0.3 * load), r.force[1] / (0.3 * load)])
            });
            table.push((k, forces));
        }
    }
    for ((name, _, _), table) in cases.iter().zip(tables) {
        println!("\n{name}\n grid   {}", stencils.map(|s| format!("{s:?}: F_x/muN  F_y/muN ")).join("  "));
        for (k, forces) in table {
            print!(" a/{k:<3}");
            for f in forces {
                match f {
                    Ok([x, y]) => print!("      {x:9.5} {y:9.5}   "),
                    Err(e) => print!("  {e}"),
                }
            }
            println!();
        }
    }
}
