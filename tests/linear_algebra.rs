//! The layer on PETSc, SLEPc and MUMPS against closed forms, on one, two and three ranks.
//!
//! Without arguments this program starts itself under `mpirun`; a word as argument runs only the checks whose names
//! hold it.

mod dense;
#[path = "linear_algebra/direct.rs"]
mod direct;
#[path = "linear_algebra/eigen.rs"]
mod eigen;
#[path = "linear_algebra/iterative.rs"]
mod iterative;
#[path = "linear_algebra/matrices.rs"]
mod matrices;
#[path = "linear_algebra/quadratic.rs"]
mod quadratic;
#[path = "linear_algebra/reduction.rs"]
mod reduction;
mod watch;

use railsqueal::parallel::World;
use std::process::{Command, ExitCode};

type Check = (&'static str, fn(&World));

fn main() -> ExitCode {
    if std::env::var_os("OMPI_COMM_WORLD_SIZE").is_none() && std::env::var_os("PMI_SIZE").is_none() {
        return start();
    }
    let universe = mpi::initialize().expect("MPI starts");
    let world = World::new(universe.world());
    let word = std::env::args().skip(1).find(|a| !a.starts_with('-')).unwrap_or_default();
    // A failed assertion on one rank would leave the others waiting.
    let default = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        default(info);
        // SAFETY: MPI is initialised; ends all ranks.
        unsafe { mpi::ffi::MPI_Abort(mpi::ffi::RSMPI_COMM_WORLD, 101) };
    }));
    let watch = watch::Watch::start(world.rank);
    let checks: Vec<Check> =
        [direct::CHECKS, eigen::CHECKS, iterative::CHECKS, quadratic::CHECKS, reduction::CHECKS].concat();
    for (name, check) in checks.into_iter().filter(|(name, _)| name.contains(&word)) {
        watch.begins(name);
        check(&world);
        if world.is_root() {
            println!("{} ranks: {name} ... ok", world.size);
        }
    }
    ExitCode::SUCCESS
}

/// Runs this program on one, two and three ranks, or as many as `RAILSQUEAL_RANKS` says: some MPI libraries do not
/// get on with more ranks than cores.
fn start() -> ExitCode {
    let me = std::env::current_exe().expect("path of the test");
    let ranks = std::env::var("RAILSQUEAL_RANKS").unwrap_or_else(|_| "1 2 3".into());
    for ranks in ranks.split_whitespace() {
        let status = Command::new("mpirun")
            .args(["-n", ranks])
            .arg(&me)
            .args(std::env::args().skip(1))
            .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
            .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
            .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
            .env("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe")
            .env("OPENBLAS_NUM_THREADS", "1")
            .status();
        match status {
            Ok(s) if s.success() => {}
            Ok(s) => {
                eprintln!("on {ranks} ranks: {s}");
                return ExitCode::FAILURE;
            }
            Err(e) => {
                eprintln!("mpirun: {e}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}
