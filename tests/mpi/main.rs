//! Tests that need MPI. Started by cargo, this program starts itself under `mpirun` on 1, 2 and 3 ranks and runs every
//! test in each world; `cargo test --test mpi -- NAME` runs those whose name contains NAME.

use railsqueal::parallel::World;
use std::io::Write;
use std::process::{exit, Child, Command, Output, Stdio};

mod bodies;
#[path = "../cells/mod.rs"]
mod cells;
#[path = "../dense/mod.rs"]
mod dense;
mod distribution;
mod elasticity;
mod elements;
mod freed;
mod residual;
mod rotation;
mod stability;
mod supports;
mod surface;
#[path = "../watch/mod.rs"]
mod watch;

/// A test is called on all ranks of a world and panics when it fails.
type Test = (&'static str, fn(&World));

const TESTS: &[Test] = &[
    ("bodies::every_body_gives_what_it_says", bodies::every_body_gives_what_it_says),
    ("bodies::elements_are_their_matrices", bodies::elements_are_their_matrices),
    ("bodies::calls_out_of_step_are_told", bodies::calls_out_of_step_are_told),
    ("elasticity::patch_test", elasticity::patch_test),
    ("elasticity::cantilever", elasticity::cantilever),
    ("elasticity::convergence_order", elasticity::convergence_order),
    ("elasticity::ghost_values", elasticity::ghost_values),
    ("elements::patch_test", elements::patch_test),
    ("elements::convergence_order", elements::convergence_order),
    ("elements::modes_of_an_annulus", elements::modes_of_an_annulus),
    ("elements::radiators_of_any_faces", elements::radiators_of_any_faces),
    ("elements::mixed_cells_are_distributed", elements::mixed_cells_are_distributed),
    ("distribution::a_wheel_is_divided_evenly", distribution::a_wheel_is_divided_evenly),
    ("distribution::one_cell", distribution::one_cell),
    ("distribution::no_cells", distribution::no_cells),
    ("distribution::a_rank_without_nodes", distribution::a_rank_without_nodes),
    ("distribution::no_mesh", distribution::no_mesh),
    ("residual::contact_forces_move_a_node", residual::contact_forces_move_a_node),
    ("residual::nothing_is_left_by_all_modes", residual::nothing_is_left_by_all_modes),
    ("freed::large_blocks_go_back", freed::large_blocks_go_back),
    ("freed::what_is_between_others_goes_back", freed::what_is_between_others_goes_back),
    ("supports::a_block_on_springs", supports::a_block_on_springs),
    ("supports::a_bar_with_a_mass", supports::a_bar_with_a_mass),
    ("supports::a_rod_that_absorbs", supports::a_rod_that_absorbs),
    ("supports::a_free_bar_is_balanced", supports::a_free_bar_is_balanced),
    ("supports::what_supports_leave_free", supports::what_supports_leave_free),
    ("supports::half_of_a_block", supports::half_of_a_block),
    ("supports::a_swept_ring_on_springs", supports::a_swept_ring_on_springs),
    ("surface::the_boundary_is_found_once", surface::the_boundary_is_found_once),
    ("rotation::an_annulus_splits_its_pairs", rotation::an_annulus_splits_its_pairs),
    ("rotation::further_pairs_are_those_of_their_orders", rotation::further_pairs_are_those_of_their_orders),
    ("rotation::rigid_motions_on_a_distorted_mesh", rotation::rigid_motions_on_a_distorted_mesh),
    ("rotation::fixed_and_turning_frame_agree", rotation::fixed_and_turning_frame_agree),
    (
        "rotation::prestress_of_a_free_wheel_balances_rigid_rotations",
        rotation::prestress_of_a_free_wheel_balances_rigid_rotations,
    ),
    ("rotation::a_free_wheel_precesses", rotation::a_free_wheel_precesses),
    ("rotation::what_is_not_of_revolution_is_refused", rotation::what_is_not_of_revolution_is_refused),
    ("stability::unlike_bodies", stability::unlike_bodies),
    ("stability::friction_that_remembers", stability::friction_that_remembers),
    ("stability::bodies_on_dashpots", stability::bodies_on_dashpots),
    ("stability::bodies_that_rotate", stability::bodies_that_rotate),
    ("stability::unlike_damping", stability::unlike_damping),
    ("stability::mirror_images", stability::mirror_images),
    ("stability::modal_damping", stability::modal_damping),
    ("stability::modal_damping_of_a_mirror_image", stability::modal_damping_of_a_mirror_image),
    ("stability::modal_against_rayleigh_damping", stability::modal_against_rayleigh_damping),
    ("stability::ranks_without_rows", stability::ranks_without_rows),
    ("stability::several_contacts", stability::several_contacts),
    ("stability::backward_errors", stability::backward_errors),
    ("stability::transposed_system", stability::transposed_system),
    ("stability::inaccurate_pairs_are_refused", stability::inaccurate_pairs_are_refused),
];

/// Number of ranks of each world, and into how many worlds its tests are divided that run at once: single ranks would
/// leave processors idle.
const WORLDS: [(usize, usize); 3] = [(1, 2), (2, 1), (3, 1)];

/// Environment variable of a rank under test: which of how many parts of the tests it runs.
const PART: &str = "RAILSQUEAL_TEST_PART";

fn main() {
    // cargo passes its own flags (--nocapture, --test-threads=…) along; only a bare word is a filter.
    let filter = std::env::args().skip(1).find(|a| !a.starts_with('-')).unwrap_or_default();
    if let Ok(part) = std::env::var(PART) {
        run_in_world(&filter, &part);
        return;
    }
    if std::env::args().any(|a| a == "--list") {
        TESTS.iter().for_each(|(name, _)| println!("{name}: test"));
        return;
    }
    let mut failed = 0;
    let selected = TESTS.iter().filter(|(name, _)| name.contains(&filter)).count();
    for (ranks, parts) in WORLDS.into_iter().filter(|_| selected > 0) {
        let worlds: Vec<Child> = (0..parts).map(|part| start(ranks, &filter, &format!("{part} {parts}"))).collect();
        let ended: Vec<Output> =
            worlds.into_iter().map(|world| world.wait_with_output().expect("the end of a world")).collect();
        for output in &ended {
            print!("{}", String::from_utf8_lossy(&output.stdout));
        }
        let wrong: Vec<_> = ended.iter().filter(|world| !world.status.success()).collect();
        for world in &wrong {
            println!("test on {ranks} ranks ... FAILED ({})", world.status);
        }
        failed += usize::from(!wrong.is_empty());
    }
    let word = if failed == 0 { "ok" } else { "FAILED" };
    println!(
        "\ntest result: {word}. {} passed; {failed} failed; 0 ignored; 0 measured; 0 filtered out",
        selected * (WORLDS.len() - failed)
    );
    exit(if failed == 0 { 0 } else { 101 });
}

/// Starts a world of this program; what it prints is kept, so that lines of several do not mix.
fn start(ranks: usize, filter: &str, part: &str) -> Child {
    let me = std::env::current_exe().expect("path of the test program");
    Command::new("mpirun")
        // Worlds at once would be bound to the same processor.
        .args(["-n", &ranks.to_string(), "--bind-to", "none"])
        .arg(me)
        .arg(filter)
        .env(PART, part)
        .env(railsqueal::body::collective_order::CHECK, "1")
        .env("OPENBLAS_NUM_THREADS", "1")
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        .env("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe")
        // There may be more ranks than processors.
        .env("OMPI_MCA_mpi_yield_when_idle", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .stdout(Stdio::piped())
        .spawn()
        .expect("mpirun must be installed")
}

/// Runs the tests of this part ("PART PARTS") on all ranks of this world. A panic on one rank aborts the world: the
/// others may wait in a collective call.
fn run_in_world(filter: &str, part: &str) {
    let [part, parts] = part.split_once(' ').map(|(k, n)| [k, n].map(|n| n.parse::<usize>())).expect("two numbers");
    let (part, parts) = (part.expect("a number"), parts.expect("a number"));
    let universe = mpi::initialize().expect("MPI starts");
    let world = World::new(mpi::traits::Communicator::duplicate(&universe.world()));
    let watch = watch::Watch::start(world.rank);
    let selected = TESTS.iter().filter(|(name, _)| name.contains(filter));
    for (name, test) in selected.skip(part).step_by(parts) {
        watch.begins(name);
        if world.is_root() {
            print!("test {name} on {} ranks ... ", world.size);
            std::io::stdout().flush().expect("stdout");
        }
        if std::panic::catch_unwind(|| test(&world)).is_err() {
            println!("FAILED on rank {}", world.rank);
            mpi::traits::Communicator::abort(&world.comm, 101);
        }
        mpi::traits::CommunicatorCollectives::barrier(&world.comm);
        if world.is_root() {
            println!("ok");
        }
    }
}
