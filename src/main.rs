//! Command line of railsqueal: parses, calls, and maps errors to exit codes.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::todo))]

mod cli;

use clap::Parser;
use cli::args::{beside, completion, default_job, manual, Cli, Command, JobChanges};
use cli::{fit, init, isolated_reader, launch, rank_watchdog, results, versions};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives};
use railsqueal::analysis::{self, job_of_branches, RunOptions};
use railsqueal::case::{curving, mesh_preview, own_contact, preflight, Meshes};
use railsqueal::error::printable;
use railsqueal::job::{self, fe_inputs, Job};
use railsqueal::memory::Limit;
use railsqueal::output::{companion, job_of_run, MODEL};
use railsqueal::parallel::World;
use railsqueal::petsc::session::Petsc;
use railsqueal::plan::{self, Plan};
use railsqueal::progress::{self, Progress};
use railsqueal::scratch::Scratch;
use railsqueal::stop::Stop;
use railsqueal::summary::Summary;
use railsqueal::{Error, Result};
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::time::{Duration, Instant};

/// Allocator that ends the process with its message and code where there is no memory.
#[global_allocator]
static MEMORY: allocator::Exiting = allocator::Exiting;

/// The longest that processes which cannot meet in MPI wait for the one that reports; as a rule the launcher ends them
/// before.
const TIME_TO_REPORT: Duration = Duration::from_secs(5);

fn main() {
    allocator::give_back();
    std::process::exit(start());
}

/// Commands without MPI: usage, help, versions, the schema.
fn start() -> i32 {
    let speaks = launch::speaks(&launch::environment);
    let said = |result: Result<()>| match result {
        Ok(()) => 0,
        Err(e) => report(&e),
    };
    let text = |text: &str| said(if speaks { print(text) } else { Ok(()) });
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) if e.use_stderr() => {
            let message = e.to_string();
            return refuse(Error::Job(message.trim_start_matches("error:").trim().to_owned()), speaks);
        }
        Err(help) => return text(&help.to_string()),
    };
    // What one process does the others leave to it.
    let idle = !speaks && cli.command.as_ref().is_some_and(Command::is_of_one);
    match cli.command {
        _ if cli.version => text(&versions::text()),
        _ if idle => 0,
        Some(Command::Probe { files, head }) => {
            files.iter().map(|file| isolated_reader::child(file, head)).max().unwrap_or(0)
        }
        Some(Command::Schema) => text(&format!("{:#}\n", job::schema())),
        Some(Command::Completion { shell }) => text(&completion(shell)),
        Some(Command::Man) => text(&manual()),
        Some(Command::Init { example, output }) => {
            said(init::write(example, &output.unwrap_or_else(|| default_job(example))).and_then(|text| print(&text)))
        }
        Some(command) if command.is_of_results() => report(&results::hand_over()),
        None => {
            let message = "say what to do: init, check, run, report or another command (railsqueal --help)";
            refuse(Error::Job(message.into()), speaks)
        }
        Some(command) => match launch::no_common_world(&launch::environment) {
            Some(message) => refuse_apart(&Error::Job(message), speaks),
            None => {
                let probed = if speaks { isolated_reader::files(&command) } else { Ok(()) };
                parallel(probed.map(|()| command), speaks)
            }
        },
    }
}

/// Ends with an error that this process found before MPI started. A launcher ends all ranks as soon as one of them ends
/// with an error: under a launcher MPI starts all the same, so that the ranks agree and none ends before the message is
/// written.
fn refuse(error: Error, speaks: bool) -> i32 {
    if launch::alone(&launch::environment) {
        return report(&error);
    }
    if launch::no_common_world(&launch::environment).is_some() {
        return refuse_apart(&error, speaks);
    }
    parallel(Err(error), speaks)
}

/// Ends with an error that every process found, where MPI cannot bring the processes together. Those that do not report
/// give the one that does the time to write.
fn refuse_apart(error: &Error, speaks: bool) -> i32 {
    if speaks {
        return report(error);
    }
    std::thread::sleep(TIME_TO_REPORT);
    error.exit_code()
}

/// Starts MPI, runs the command on all ranks, and ends all ranks with one message and one exit code. An error in place
/// of the command was found before MPI started, on this rank or on all.
fn parallel(command: Result<Command>, speaks: bool) -> i32 {
    for (name, value) in launch::variables(&launch::environment) {
        std::env::set_var(name, value);
    }
    // Signals count from here on, whatever is being done when they come.
    let stop = match &command {
        Ok(Command::Run { wall_time, .. }) => Some(Stop::listen(Instant::now(), *wall_time, speaks)),
        _ => None,
    };
    if let Err(error) = launch::enough_descriptors().and_then(|()| launch::enough_address_space()) {
        return refuse_apart(&error, speaks);
    }
    // Threads of the dense algebra exist beside the one that calls MPI.
    let Some((universe, _)) = mpi::initialize_with_threading(mpi::Threading::Funneled) else {
        return report(&Error::Defect("MPI was initialised already".into()));
    };
    let world = World::new(universe.world().duplicate());
    install_panic_hook(world.is_root());
    let farewell = universe.world().duplicate();
    if let Some(message) = launch::singletons(world.size, &launch::environment) {
        return refuse_apart(&Error::Job(message), speaks);
    }
    let result = world.agree(command).and_then(|command| match command {
        Command::Run { job: path, changes, output, force, reuse, resume, wall_time, petsc } => {
            let source = path.clone().or(resume.clone()).unwrap_or_default();
            let job = match (&path, &resume) {
                (None, Some(result)) => read(&world, &source, &changes, || match job_of_branches(result) {
                    Some(path) => job::read_file(&path),
                    None => job_of_run(result),
                }),
                _ => read(&world, &source, &changes, || job::read_file(&source)),
            };
            job.and_then(|job| {
                let output = match resume.clone().or(output) {
                    Some(output) => output,
                    None => beside(&source)?,
                };
                // Branches of limit cycles keep what is done themselves; bodies are those of the model that is left.
                let branches = resume.is_some() && job.analyses.transient.is_none() && job.analyses.cycles.is_some();
                let left = Some(companion(&output, MODEL)).filter(|model| branches && model.is_file());
                let options = RunOptions {
                    job: path,
                    resume: resume.is_some() && !branches,
                    output,
                    force: force || branches,
                    reuse: reuse.or(left),
                    command: std::env::args_os().map(lossy).collect(),
                    versions: versions::versions(),
                    wall_time,
                };
                let stop = stop.as_ref().ok_or_else(|| Error::Defect("a run that no signal stops".into()))?;
                rank_watchdog::watch(&world);
                run(&world, &job, &options, &petsc, stop).map_err(|e| with_remarks(&job, e))
            })
        }
        Command::Curving { job, changes, contact } => print_curving(&world, &job, &changes, contact),
        Command::Fit { file, band, track, .. } => {
            fit::track(&world, &file, &band, &track).and_then(|text| world.on_root(|| print(&text)).map(|_| ()))
        }
        Command::Check { job, changes, mesh } => check(&world, &job, &changes, mesh.as_deref()),
        _ => Ok(()),
    });
    match result {
        Ok(()) => 0,
        Err(error) => {
            let together = all_arrive(&farewell);
            if world.is_root() || !together {
                report(&error);
            }
            // What could not be closed HDF5 would close again at the end of MPI, and crash.
            if !together || hdf5_chunks::has_open_files() {
                farewell.abort(error.exit_code());
            }
            error.exit_code()
        }
    }
}

/// Returns whether the other ranks come to the same end. They do where errors were agreed upon; where one rank alone
/// failed, the others wait in a collective call for ever, and it must end them.
fn all_arrive(farewell: &SimpleCommunicator) -> bool {
    let begun = Instant::now();
    let mut request = farewell.immediate_barrier();
    loop {
        match request.test() {
            Ok(_) => return true,
            Err(pending) => request = pending,
        }
        if begun.elapsed() > Duration::from_secs(20) {
            // The request cannot be completed any more; the process ends by abort.
            std::mem::forget(request);
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn run(world: &World, job: &Job, options: &RunOptions, petsc: &[String], stop: &Stop) -> Result<()> {
    if options.wall_time.is_some_and(|s| !(s > 0.0 && s.is_finite())) {
        return Err(Error::Job("--wall-time: expected a number of seconds > 0".into()));
    }
    if options.wall_time.is_some() && job.analyses.transient.is_none() && job.analyses.cycles.is_none() {
        return Err(Error::Job(
            "--wall-time: only a transient and branches of limit cycles stop by themselves and save their state; the \
             job has neither analyses.transient nor analyses.cycles: leave the option out"
                .into(),
        ));
    }
    let meshes = Meshes::default();
    refuse_what_does_not_fit(world, job, &meshes, options.reuse.is_some() && !job.output.fields)?;
    if let Some(place) = &job.solver.out_of_core {
        let made = world.agree(Scratch::new(place))?;
        world.scratch.set(made).map_err(|_| Error::Defect("two folders for factors".into()))?;
    }
    let petsc_options: Vec<(String, String)> =
        job.petsc_options.iter().map(|(name, value)| (name.clone(), value.to_string())).collect();
    let session = Petsc::start(world, &petsc_options, petsc)?;
    let mut progress = Progress::new(world.is_root());
    let summary =
        analysis::run(&session, job, options, &analysis::RunContext { meshes: &meshes, stop }, &mut progress)?;
    let unused = session.unused_options()?;
    // Rank 0 knows of failures of parts of the work.
    world.on_root(|| {
        let said = print(&summary.to_string());
        if !unused.is_empty() {
            let names = unused.join(", ");
            let _ = writeln!(std::io::stderr(), "railsqueal: warning: unused PETSc options: {names}");
        }
        summary.failure().map_or(said, |e| Err(e.clone()))
    })?;
    Ok(())
}

fn check(world: &World, path: &Path, changes: &JobChanges, mesh: Option<&Path>) -> Result<()> {
    let job = read(world, path, changes, || job::read_file(path))?;
    examine(world, &job, path, mesh).map_err(|e| with_remarks(&job, e))
}

/// Collective: what `railsqueal check` says of the `job` read from `path`.
fn examine(world: &World, job: &Job, path: &Path, mesh: Option<&Path>) -> Result<()> {
    let meshes = Meshes::default();
    // A mesh that lies wrong is what one wants to see: it comes before all that could be refused.
    world.on_root(|| mesh.map_or(Ok(()), |file| mesh_preview::surfaces(job, &meshes)?.write(file)))?;
    // What the analyses cannot do, and what is wrong with the bodies, all together.
    let (capable, planned) = (analysis::check(job), plan_of(world, job, &meshes));
    Error::all([capable, planned.as_ref().map(drop).map_err(Error::clone)])?;
    let (here, plan) = planned?;
    world.on_root(|| {
        let plan = plan.ok_or_else(|| Error::Defect("no plan on rank 0".into()))?;
        let limit = Limit::or_system(job.solver.memory_limit);
        let mut summary = Summary::from_job(job);
        // Meshes that do not fit are not made.
        let foreseen = plan
            .fits(here, &limit)
            .and_then(|()| plan.fits_disk(here))
            .and_then(|()| preflight::of_job(job, &meshes, plan.bodies.iter().map(|b| b.nodes).sum()));
        let mut lines = Vec::new();
        if let Ok(report) = &foreseen {
            report.warnings.iter().for_each(|text| summary.warn(text));
            lines = report.lines.clone();
        }
        let mut text = format!("{:#}\n\n{summary}{plan}", job.to_json());
        lines.iter().for_each(|line| text += &format!("  {line}\n"));
        text += &format!("  {:<28} {:>6.1} GB  ({})\n", "available memory", limit.bytes / 1e9, limit.source);
        if let Ok(output) = beside(path) {
            text += &format!("results of a run go to {}\n", output.display());
        }
        print(&text)?;
        foreseen.map(|_| ())
    })?;
    Ok(())
}

/// The error with what of the job is implausible and may be its reason.
fn with_remarks(job: &Job, error: Error) -> Error {
    match error {
        Error::Job(_) | Error::Input(_) | Error::NotConverged(_) => job::plausible(job).iter().fold(error, Error::with),
        _ => error,
    }
}

/// Collective: an error if the job, or a point of its sweep, needs more memory than there is. Of a `reduced` job the
/// finite elements themselves need none.
fn refuse_what_does_not_fit(world: &World, job: &Job, meshes: &Meshes, reduced: bool) -> Result<()> {
    let (here, plan) = plan_of(world, job, meshes)?;
    let plan = plan.filter(|_| !reduced);
    let given = job.solver.memory_limit;
    let fits = |plan: &Plan| {
        plan.fits(here, &Limit::or_system(given))?;
        plan.fits_disk(here)?;
        given.map_or_else(|| plan.fits_process(&Limit::of_process()), |_| Ok(()))
    };
    world.agree(plan.as_ref().map_or(Ok(()), fits))?;
    let models = job.sweep.as_ref().map(plan::models).unwrap_or_default();
    let models: Vec<&Job> = models.into_iter().filter(|p| !reduced || fe_inputs(p) != fe_inputs(job)).collect();
    // Rank 0 reads the files of meshes and matrices; what else there is to measure is done by all ranks.
    let of_files = |p: &&Job| p.bodies().iter().any(|(_, b)| b.is_meshed() || b.matrices.is_some());
    let mine = match (models.iter().any(of_files), world.is_root()) {
        (false, _) => world.share(models.len()),
        (true, true) => 0..models.len(),
        (true, false) => 0..0,
    };
    let fits_point = |p: &&Job| fits(&Plan::of_point(p, plan::sizes(p, meshes)?, world.size));
    world.together(|| models[mine].iter().try_for_each(|p| fits_point(p).map_err(|e| e.context("analyses.sweep"))))?;
    if reduced {
        meshes.forget();
    }
    Ok(())
}

/// Collective: number of ranks on the node of this rank, and on rank 0 the plan of the job.
fn plan_of(world: &World, job: &Job, meshes: &Meshes) -> Result<(usize, Option<Plan>)> {
    let here = world.comm.split_shared(0).size() as usize;
    let plan = world.on_root(|| {
        let sizes = plan::sizes(job, meshes);
        Error::all([job::range(job).map(drop), sizes.as_ref().map(drop).map_err(Error::clone)])?;
        Ok(Plan::new(job, sizes?, world.size))
    })?;
    Ok((here, plan))
}

/// Collective: the job, whose `bytes` rank 0 reads, understood by all. `path` names it.
fn read(world: &World, path: &Path, changes: &JobChanges, bytes: impl FnOnce() -> Result<Vec<u8>>) -> Result<Job> {
    let bytes = world.broadcast(world.on_root(bytes)?.unwrap_or_default());
    let mut job = world.agree(Job::from_bytes(&bytes, path, &changes.sets, changes.only.as_deref()))?;
    curving::resolve(world, &mut job)?;
    Ok(job)
}

/// Collective: prints the equilibrium of the vehicle in the curve of a job, and on request the forces of the
/// discretised contact.
fn print_curving(world: &World, path: &Path, changes: &JobChanges, contact: bool) -> Result<()> {
    let job = read(world, path, changes, || job::read_file(path))?;
    if job.curve.is_none() {
        return Err(Error::Job(format!(
            "{}: the job has no curve and no vehicle; give both, e.g. \"curve\": {{\"radius\": 150, \"speed\": \
             10, \"rail_cant\": 0.025}}, \
             \"vehicle\": \"metro_bogie\"",
            path.display()
        )));
    }
    // The examination of `check`, but for the memory: no bodies are made here.
    analysis::check(&job)?;
    let meshes = Meshes::default();
    let (_, plan) = plan_of(world, &job, &meshes)?;
    world.on_root(|| {
        let nodes = plan.map_or(0, |p| p.bodies.iter().map(|b| b.nodes).sum());
        preflight::of_job(&job, &meshes, nodes)?;
        let found = curving::CurvingVehicle::from_job(&job)?;
        let mut lines = found.lines();
        lines.extend(found.warnings(&job).into_iter().map(|w| format!("warning: {w}")));
        if contact {
            lines.extend(own_contact::lines(&own_contact::own_contacts(&job, &found)?));
        }
        lines.push(String::new());
        print(&lines.join("\n"))
    })?;
    Ok(())
}

/// Prints on stdout. A reader that has seen enough (`| head`) is no error.
fn print(text: &str) -> Result<()> {
    progress::end_line();
    let mut out = std::io::stdout().lock();
    match out.write_all(printable(text).as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Io(format!("cannot write to stdout: {e}"))),
        _ => Ok(()),
    }
}

/// Says what is wrong, and returns the exit code. A message that cannot be written is lost; the code is not.
fn report(error: &Error) -> i32 {
    progress::end_line();
    let _ = writeln!(std::io::stderr(), "railsqueal: error: {}", printable(&error.to_string()));
    error.exit_code()
}

/// A panic is a defect: one message, and all ranks end. Rank 0 speaks first, should all panic together.
fn install_panic_hook(root: bool) {
    std::panic::set_hook(Box::new(move |info| {
        if !root {
            std::thread::sleep(Duration::from_millis(500));
        }
        let what = info.payload();
        let what = what.downcast_ref::<&str>().copied().or_else(|| what.downcast_ref::<String>().map(String::as_str));
        let place = info.location().map(|l| format!(" at {}:{}", l.file(), l.line())).unwrap_or_default();
        report(&Error::Defect(format!("{}{place}", what.unwrap_or("panic"))));
        SimpleCommunicator::world().abort(1);
    }));
}

fn lossy(text: std::ffi::OsString) -> String {
    text.to_string_lossy().into_owned()
}
