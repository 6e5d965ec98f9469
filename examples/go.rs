use railsqueal::parallel::World;
use railsqueal::*;
fn main() {
    let universe = mpi::initialize().unwrap();
    let world = World::new(mpi::traits::Communicator::duplicate(&universe.world()));
    let args: Vec<String> = std::env::args().collect();
    let bytes = job::read_file(args[1].as_ref()).unwrap();
    let sets: Vec<String> = args[3..].to_vec();
    let r = (|| {
        let job = job::Job::from_bytes(&bytes, args[1].as_ref(), &sets, None)?;
        let petsc = petsc::session::Petsc::start(&world, &[], &[])?;
        let mut p = progress::Progress::new(world.is_root());
        let o = analysis::RunOptions {
            output: args[2].clone().into(),
            force: true,
            command: args.clone(),
            versions: vec![],
        };
        let r = analysis::run(&petsc, &job, &o, &mut p);
        if world.is_root() {
            for (n, t) in p.times() {
                eprintln!("{t:8.2} s {n}");
            }
        }
        r
    })();
    match r {
        Ok(s) => {
            if world.is_root() {
                print!("{s}")
            }
        }
        Err(e) => {
            if world.is_root() {
                eprintln!("error: {e}");
            }
            std::process::exit(e.exit_code())
        }
    }
}
