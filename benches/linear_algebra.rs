//! Times of the direct solver and of the eigensolver on the clamped annular cylinder, on the ranks of `mpirun`.
//!
//! `mpirun -n 2 linear_algebra [--size METRES] [--graded 0|1] [--modes N] [-- PETSC OPTIONS]`
//!
//! With `--graded 1` the cylinder is crowned and `--size` is that of the elements in a contact patch of 14 mm by 14 mm.
//! `ORDERINGS=1` compares the elimination orders, `GAMG=1` runs the iterative solver, `MODES_ONLY=1` skips solves and
//! inverse, `SIZES=1` finds the modes with several blocks and bases, `COUNTS=parts` takes a run of modes apart,
//! `COUNTS=once` counts what its ranks do, `SLEPC=1` with SLEPc as well. Lines that begin with `row:` are for tables:
//! what, wall time in s, processor time in s, peak memory in GB.

use railsqueal::eigen::sparse::{modes, DistributedMatrices, Method, ModesOptions, ShiftedFactor};
use railsqueal::eigen::{nearest_by, Shifted, Sizes};
use railsqueal::fem::assembly::Operators;
use railsqueal::fem::dofs::DofMap;
use railsqueal::fem::ElasticMaterial;
use railsqueal::mesh::cylinder::{self, CylinderSpec};
use railsqueal::mesh::distribute::{distribute, MeshPart};
use railsqueal::parallel::World;
use railsqueal::petsc::csr::DistCsr;
use railsqueal::petsc::ksp::{rigid_body_motions, Iterative, IterativeOptions};
use railsqueal::petsc::{Factor, FactorOptions, Ordering, Petsc, Symmetry};
use std::time::Instant;

fn main() {
    let universe = mpi::initialize().expect("MPI starts");
    let world = World::new(mpi::traits::Communicator::duplicate(&universe.world()));
    let arguments: Vec<String> = std::env::args().collect();
    let number = |name: &str, default: f64| {
        let at = arguments.iter().position(|a| a == name);
        at.and_then(|i| arguments.get(i + 1)?.parse().ok()).unwrap_or(default)
    };
    let after = arguments.iter().position(|a| a == "--").map_or(arguments.len(), |i| i + 1);
    if let Err(error) = run(
        &world,
        number("--size", 0.0123),
        number("--graded", 0.0) != 0.0,
        number("--modes", 40.0) as usize,
        &arguments[after..],
    ) {
        eprintln!("{error}");
        std::process::exit(error.exit_code());
    }
}

/// Set-up and solves of conjugate gradients with multigrid.
fn iterate(world: &World, petsc: &Petsc, part: &MeshPart, k: &DistCsr, clock: &mut Clock) -> railsqueal::Result<()> {
    let free = |point: &&[f64; 3]| point[0].hypot(point[2] + 0.5) > 0.1 + 1e-6;
    let nodes: Vec<[f64; 3]> = part.coords[..part.owned].iter().filter(free).copied().collect();
    let options = IterativeOptions { tolerance: 1e-9, max_iterations: 300, prefix: String::new() };
    let mut solver = Iterative::new(petsc, k, 3, &rigid_body_motions(&nodes), options, "stiffness")?;
    clock.lap("set-up of multigrid");
    for columns in [1, 2] {
        let before = solver.effort().0;
        let mut b: Vec<f64> = (0..k.n_local() * columns).map(|i| (i as f64).sin()).collect();
        solver.solve(&mut b, columns)?;
        clock.lap(&format!("{columns} right-hand sides, {} iterations", solver.effort().0 - before));
    }
    let before = solver.effort().0;
    let first = k.order() / 2;
    solver.inverse_block(&(first..first + 6).collect::<Vec<_>>(), &mut |_, _| ())?;
    clock.lap(&format!("6 columns of the inverse, {} iterations", solver.effort().0 - before));
    if world.is_root() {
        println!("    unused options: {:?}", petsc.unused_options()?);
    }
    Ok(())
}

/// Processor time of this process, s, and its largest resident memory, MB.
fn usage() -> (f64, f64) {
    let read = |file: &str| std::fs::read_to_string(file).unwrap_or_default();
    let stat = read("/proc/self/stat");
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or("").split_whitespace().collect();
    let ticks = |i: usize| fields.get(i).and_then(|f| f.parse::<f64>().ok()).unwrap_or(0.0);
    let status = read("/proc/self/status");
    let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let peak = peak.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok()).unwrap_or(0.0);
    ((ticks(11) + ticks(12)) / 100.0, peak / 1e3)
}

struct Clock<'a> {
    world: &'a World,
    wall: Instant,
    cpu: f64,
}

impl Clock<'_> {
    fn lap(&mut self, what: &str) {
        let (cpu, peak) = usage();
        let (wall, spent) = (self.wall.elapsed().as_secs_f64(), self.world.sum(cpu - self.cpu));
        let peak = self.world.sum(peak);
        if self.world.is_root() {
            println!("{what:<44} {wall:7.2} s wall {spent:7.2} s cpu, peak {peak:6.0} MB");
            println!("row: {what} | {wall:.2} | {spent:.2} | {:.2}", 1e-3 * peak);
        }
        self.wall = Instant::now();
        self.cpu = usage().0;
    }
}

fn run(world: &World, size: f64, graded: bool, count: usize, options: &[String]) -> railsqueal::Result<()> {
    let petsc = Petsc::start(world, &[], options)?;
    let mut clock = Clock { world, wall: Instant::now(), cpu: 0.0 };
    let spec = CylinderSpec {
        inner_radius: 0.1,
        outer_radius: 0.5,
        thickness: 0.1,
        crown_radius: graded.then_some(0.5),
        contact_offset: 0.0,
        element_size: size,
        growth: 1.2,
        max_element_size: (!graded).then_some(size),
        patch_half_length: if graded { 0.007 } else { 0.0 },
        patch_half_width: if graded { 0.007 } else { 0.0 },
    };
    let mesh = world.on_root(|| cylinder::build(&spec))?;
    clock.lap("mesh on one rank");
    let part = distribute(world, mesh.as_ref())?;
    clock.lap("its parts");
    let dofs = DofMap::new(world, &part, &["inner".to_string()]);
    let material = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800.0 };
    let operators = Operators::new(world, &part, &dofs, &material)?;
    drop(mesh);
    let (k, m) = (&operators.stiffness, &operators.mass);
    let nonzeros = world.sum_u64(k.cols.len() as u64);
    clock.lap(&format!("assembly: {} dofs, {nonzeros} entries", k.order()));

    if let Some(way) = std::env::var_os("COUNTS") {
        return counts(world, &petsc, &operators, count, way == "once", &mut clock);
    }
    if std::env::var_os("GAMG").is_some() {
        return iterate(world, &petsc, &part, k, &mut clock);
    }
    let compare = std::env::var_os("ORDERINGS").is_some();
    let orderings: &[Ordering] =
        if compare { &[Ordering::Pord, Ordering::Scotch, Ordering::Metis] } else { &[Ordering::Metis] };
    let mut factor = None;
    for &ordering in orderings {
        drop(factor.take());
        let f = Factor::new(world, k, FactorOptions { kind: Symmetry::Positive, ordering }, "stiffness")?;
        clock.lap(&format!("factorisation, {ordering:?}"));
        if world.is_root() {
            let counted = f.statistics();
            println!("    {counted:?}");
            println!("row: {ordering:?} | {:.0} M | {:.1e}", 1e-6 * counted.factor_entries as f64, counted.flops);
        }
        factor = Some(f);
    }
    let mut factor = factor.expect("at least one ordering");
    let n = factor.n_local();
    let widths: &[usize] =
        if std::env::var_os("MODES_ONLY").is_some() { &[] } else { &[1, 2, 4, 8, 12, 16, 24, 32, 64] };
    for &width in widths {
        let mut b: Vec<f64> = (0..n * width).map(|i| (i as f64).sin()).collect();
        let repeats = if width == 1 { 5 } else { 1 };
        for _ in 0..repeats {
            factor.solve(&mut b, width)?;
        }
        clock.lap(&format!("{repeats} solves of {width} right-hand sides"));
    }
    // Rows spread over part of the surface: neighbouring nodes, as in a contact patch.
    for side in [100u64, 300, 900] {
        if widths.is_empty() {
            break;
        }
        let first = k.order() / 2;
        let rows: Vec<u64> = (first..(first + side).min(k.order())).collect();
        factor.inverse_block(&rows)?;
        clock.lap(&format!("inverse block of {side} rows"));
    }
    let pencil = DistributedMatrices::new(world, k, m);
    if std::env::var_os("SIZES").is_some() {
        return sizes(world, &mut factor, &pencil, count, &mut clock);
    }
    for method in [Method::Blocks, Method::Slepc] {
        if std::env::var_os("SLEPC").is_none() && method == Method::Slepc {
            continue;
        }
        let wanted = ModesOptions { sigma: 0.0, count, method, prefix: String::new() };
        let found = modes(&petsc, &mut factor, &pencil, &wanted, &mut |_, _| ())?;
        clock.lap(&format!("{count} modes, {method:?}, {} solves, {} restarts", found.solves, found.iterations));
        if world.is_root() {
            let hz: Vec<String> =
                found.lambda.iter().take(6).map(|l| format!("{:.3}", l.sqrt() / std::f64::consts::TAU)).collect();
            let worst = found.residuals.iter().copied().fold(0.0, f64::max);
            println!("    {} Hz …, largest residual {worst:.1e}", hz.join(" "));
            println!("    unused options: {:?}", petsc.unused_options()?);
        }
    }
    Ok(())
}

/// `count` modes with several blocks and bases.
fn sizes(
    world: &World,
    factor: &mut Factor,
    pencil: &DistributedMatrices,
    count: usize,
    clock: &mut Clock,
) -> railsqueal::Result<()> {
    for (block, subspace) in [(4, 100), (6, 110), (8, 86), (8, 104), (8, 112), (8, 120), (8, 128), (12, 110), (16, 250)]
    {
        let before = usage().0;
        let mut first = Timed { at: ShiftedFactor { factor, sigma: 0.0 }, seconds: 0.0 };
        let found = nearest_by(pencil, &mut first, count, Sizes { block, subspace }, &mut |_, _| ())?;
        let (solves, all) = (world.sum(first.seconds), world.sum(usage().0 - before));
        if world.is_root() {
            let (columns, restarts) = (found.solves, found.iterations);
            println!(
                "row: {block} | {subspace} | {columns} | {restarts} | {solves:.1} | {:.1} | {all:.1}",
                all - solves
            );
        }
        clock.lap(&format!("{count} modes with blocks of {block}"));
    }
    Ok(())
}

/// A factor with the processor time of its solves on this rank, s.
struct Timed<'f, 'w> {
    at: ShiftedFactor<'f, 'w>,
    seconds: f64,
}

impl Shifted for Timed<'_, '_> {
    fn sigma(&self) -> f64 {
        self.at.sigma()
    }

    fn solve(&mut self, x: &mut [f64], columns: usize) -> railsqueal::Result<()> {
        let before = usage().0;
        let solved = self.at.solve(x, columns);
        self.seconds += usage().0 - before;
        solved
    }

    fn below(&self) -> u64 {
        self.at.below()
    }
}

/// Operation counts of a run of modes, one part after the other: work on one rank, and shared work. With `once` nothing
/// is done twice.
fn counts(
    world: &World,
    petsc: &Petsc,
    operators: &Operators,
    count: usize,
    once: bool,
    clock: &mut Clock,
) -> railsqueal::Result<()> {
    let (k, m) = (&operators.stiffness, &operators.mass);
    let options = FactorOptions { kind: Symmetry::Positive, ordering: Ordering::Metis };
    if !once {
        Factor::estimate(world, k, options)?;
        clock.lap("ordering and analysis");
    }
    let mut factor = Factor::new(world, k, options, "stiffness")?;
    clock.lap("factorisation with its analysis");
    if !once {
        factor.renew(k, "stiffness")?;
        clock.lap("factorisation alone");
        let mut b: Vec<f64> = (0..8 * factor.n_local()).map(|i| (i as f64).sin()).collect();
        for _ in 0..3 {
            factor.solve(&mut b, 8)?;
        }
        clock.lap("3 solves of 8 right-hand sides");
    }
    let counted = factor.statistics();
    if world.is_root() {
        let entries = [counted.factor_entries, counted.entries_max].map(|n| n as f64);
        println!("row: counted | {} | {} | {} | {}", counted.flops, counted.flops_max, entries[0], entries[1]);
    }
    let pencil = DistributedMatrices::new(world, k, m);
    let wanted = ModesOptions { sigma: 0.0, count, method: Method::Blocks, prefix: String::new() };
    let found = modes(petsc, &mut factor, &pencil, &wanted, &mut |_, _| ())?;
    clock.lap(&format!("modes, {} right-hand sides", found.solves));
    Ok(())
}
