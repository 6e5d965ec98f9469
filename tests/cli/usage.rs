//! Usage, help, versions, the schema, `check`, and the launcher.

use super::program::*;
use serde_json::json;
use std::process::Command;

#[test]
fn version_names_every_library() {
    let ran = railsqueal(1, &["--version"]);
    let ran = ran.good();
    for name in ["railsqueal", "PETSc", "scalar type", "complex", "SLEPc", "MUMPS", "MPI", "HDF5", "METIS"] {
        assert!(ran.out.contains(name), "no {name} in: {}", ran.out);
    }
    assert_eq!(ran.out.lines().next(), Some(concat!("railsqueal ", env!("CARGO_PKG_VERSION"))));
}

#[test]
fn the_printed_schema_is_the_kept_one() {
    let ran = railsqueal(1, &["schema"]);
    assert_eq!(ran.good().out, include_str!("../../schemas/job.schema.json"));
    // One rank speaks.
    let ran = railsqueal(2, &["schema"]);
    assert_eq!(ran.good().out, include_str!("../../schemas/job.schema.json"));
}

#[test]
fn help_lists_the_exit_codes() {
    let ran = railsqueal(1, &["--help"]);
    for part in ["run", "check", "schema", "Exit codes", "7  not enough memory"] {
        assert!(ran.good().out.contains(part), "no {part:?} in: {}", ran.out);
    }
}

#[test]
fn wrong_usage_is_exit_2() {
    for (args, part) in [
        (&[][..], "say what to do"),
        (&["run"][..], "<JOB>"),
        (&["rum", "job.json"][..], "rum"),
        (&["run", "job.json", "--sat", "a=1"][..], "--sat"),
        (&["check", "job.json", "--output", "x.h5"][..], "--output"),
    ] {
        railsqueal(1, args).failed(2, &[part]);
    }
    railsqueal(2, &["rum"]).failed(2, &["rum"]);
}

/// Rank command of `mpirun`: a line of the shell, with the program as `$0` and the rank in `$rank`.
fn ranks_by_shell(ranks: usize, line: &str) -> Ran {
    let line = format!("rank=$OMPI_COMM_WORLD_RANK; {line}");
    finish_on(ranks, mpirun().args(["-n", &ranks.to_string(), "sh", "-c", &line, PROGRAM]))
}

/// `mpirun` ends all ranks when one of them ends with an error, and rank 0, the one that reports, starts a second late.
#[test]
fn an_error_before_mpi_starts_is_reported_however_late_rank_0_is() {
    // As srun starts processes without an interface by which MPI could bring them together.
    let apart = "env -i PATH=\"$PATH\" SLURM_STEP_NUM_TASKS=2 SLURM_PROCID=\"$rank\"";
    for ranks in [2, 3] {
        for (environment, arguments, part) in [
            ("", "rum", "unrecognized subcommand 'rum'"),
            ("", "", "say what to do"),
            (apart, "run job.json", "srun --mpi=list"),
            (apart, "rum", "unrecognized subcommand 'rum'"),
        ] {
            let line = format!("[ \"$rank\" != 0 ] || sleep 1; exec {environment} \"$0\" {arguments}");
            ranks_by_shell(ranks, &line).failed(2, &[part]);
        }
    }
}

/// A rank that was called otherwise than the others ends them all with its message.
#[test]
fn an_error_of_one_rank_before_mpi_starts_is_the_error_of_all() {
    let job = format!("{}/jobs/two-cylinders.json", env!("CARGO_MANIFEST_DIR"));
    let line = format!("[ \"$rank\" != 1 ] || exec \"$0\" rum; exec \"$0\" check '{job}'");
    ranks_by_shell(2, &line).failed(2, &["unrecognized subcommand 'rum'"]);
}

#[test]
fn stdout_that_cannot_be_written_is_an_io_error_and_a_closed_pipe_is_none() {
    let full = Command::new("sh").args(["-c", &format!("{PROGRAM} schema > /dev/full")]).output().expect("sh");
    assert_eq!(full.status.code(), Some(6), "{full:?}");
    let pipe = Command::new("bash").args(["-c", &format!("set -o pipefail; {PROGRAM} schema | head -n 1")]).output();
    let pipe = pipe.expect("bash");
    assert!(pipe.status.success() && pipe.stderr.is_empty(), "{pipe:?}");
}

/// All ranks end by themselves where rank 0 alone cannot speak or knows what does not fit.
#[test]
fn what_rank_0_alone_finds_ends_all_ranks() {
    let folder = Folder::with(small().to_string());
    let ran = folder.call(2, "check", &["--set", "solver.memory_limit=1e7"]);
    ran.failed(7, &["solver.memory_limit gives 10 MB"]);
    assert!(!ran.err.contains("MPI_ABORT"), "{}", ran.err);
    let job = folder.text("job.json");
    for command in ["check", "run"] {
        let mut launch = mpirun();
        let line = format!("exec \"$0\" {command} \"$1\" --only steady > /dev/full");
        launch.args(["-n", "2", "sh", "-c", &line, PROGRAM, &job]);
        let ran = finish_on(2, &mut launch);
        ran.failed(6, &["cannot write to stdout"]);
        assert!(!ran.err.contains("MPI_ABORT"), "{}", ran.err);
    }
}

#[test]
fn check_says_what_would_be_computed_and_writes_nothing() {
    let folder = Folder::with(small().to_string());
    for ranks in [1, 2] {
        let ran = folder.call(ranks, "check", &["--set", "contact.friction=0.45", "--only", "steady"]);
        for part in [
            "\"friction\": 0.45",
            "\"linear\": \"mumps\"",
            " cells, ",
            "degrees of freedom",
            "49 contact nodes",
            "steady rolling: normal load 70000 N, friction 0.45",
            "estimated memory",
            "job.h5",
        ] {
            assert!(ran.good().out.contains(part), "no {part:?} in: {}", ran.out);
        }
        assert!(!ran.out.contains("modes: the"), "--only keeps one analysis: {}", ran.out);
        folder.untouched();
    }
}

/// Not silently a limit of nothing.
#[test]
fn a_wall_time_without_a_transient_is_refused() {
    let folder = Folder::with(small().to_string());
    for ranks in [1, 2] {
        folder.call(ranks, "run", &["--wall-time", "60"]).failed(2, &["--wall-time", "analyses.transient"]);
        folder.untouched();
    }
}

#[test]
fn multigrid_with_modes_is_refused_before_anything_is_meshed() {
    let folder = Folder::with(small().to_string());
    for command in ["check", "run"] {
        let ran = folder.call(1, command, &["--set", "solver.linear=gamg"]);
        ran.failed(2, &["solver.linear", "analyses.modes"]);
        assert!(!ran.err.contains("meshing"), "{}", ran.err);
        folder.untouched();
    }
    folder.call(1, "check", &["--set", "solver.linear=gamg", "--only", "steady"]).good();
}

#[test]
fn the_jobs_of_the_project_are_valid() {
    let jobs = std::fs::read_dir(format!("{}/jobs", env!("CARGO_MANIFEST_DIR"))).expect("jobs");
    let mut paths: Vec<_> = jobs.map(|entry| entry.expect("an entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "json"));
    assert!(paths.len() > 20, "{paths:?}");
    for path in paths {
        // Its meshes are made by scripts with Gmsh; docs/reference/meshes.md has the commands.
        if path.ends_with("wheel-on-rail-3d.json") && !path.with_file_name("rail-3d.msh").exists() {
            let path = path.display().to_string();
            railsqueal(1, &["check", &path]).failed(3, &["bodies.lower.mesh", "rail-3d.msh", "wheel-3d.msh"]);
            continue;
        }
        let path = path.display().to_string();
        assert!(railsqueal(1, &["check", &path]).good().out.contains("estimated memory"), "{path}");
    }
}

/// Each law of friction is taken from a job and has its formula.
#[test]
fn every_law_of_friction_can_be_given() {
    use railsqueal::job::Job;
    let e = |x: f64| f64::exp(-x);
    // At 0.2 m/s.
    for (law, want) in [
        (json!(0.3), 0.3),
        (json!({ "exponential": { "static": 0.4, "kinetic": 0.3, "decay_velocity": 0.5 } }), 0.3 + 0.1 * e(0.4)),
        (json!({ "rational": { "static": 0.4, "kinetic": 0.3, "half_velocity": 0.6 } }), 0.3 + 0.1 * 0.75),
        (
            json!({ "double_exponential": {
                "static": 0.4, "kinetic": 0.2, "share": 0.25, "decay_velocity": 0.1, "second_decay_velocity": 0.4
            } }),
            0.2 + 0.2 * (0.25 * e(2.0) + 0.75 * e(0.5)),
        ),
        (json!({ "linear": { "static": 0.4, "kinetic": 0.2, "end_velocity": 0.8 } }), 0.35),
        (json!({ "kraft": { "static": 0.4 } }), 0.4 * (1.0 - 0.5 * e(0.69) - 0.5 * e(34.5))),
        (json!({ "table": { "points": [[0, 0.4], [0.1, 0.42], [0.5, 0.34]] } }), 0.4),
    ] {
        let mut job = small();
        job["contact"]["friction"] = law.clone();
        let bytes = job.to_string().into_bytes();
        let read = Job::from_bytes(&bytes, std::path::Path::new("job.json"), &[], None);
        let read = read.unwrap_or_else(|e| panic!("{law}: {e}"));
        let friction = &read.contact.as_ref().expect("the contact").friction;
        let found = friction.coefficient(0.2);
        assert!((found - want).abs() < 1e-12, "{law}: {found}, expected {want}");
        let folder = Folder::with(job.to_string());
        assert!(folder.call(1, "check", &[]).good().out.contains(&format!("friction {friction}")), "{law}");
    }
}

/// Processes of Open MPI without a launcher remove each other's files where they share a directory.
#[test]
fn processes_without_a_launcher_do_not_disturb_each_other() {
    let folder = Folder::with(small().to_string());
    std::thread::scope(|scope| {
        for _ in 0..6 {
            scope.spawn(|| (0..10).for_each(|_| _ = folder.call(1, "check", &[]).good()));
        }
    });
}

#[test]
fn several_worlds_of_one_are_refused() {
    let folder = Folder::with(small().to_string());
    for variable in ["PMI_SIZE", "SLURM_STEP_NUM_TASKS"] {
        let job = folder.text("job.json");
        let ran = finish(Command::new(PROGRAM).env(variable, "4").args(["run", &job]));
        ran.failed(2, &["4 processes", variable, "PMI", "srun --mpi"]);
        folder.untouched();
    }
    // The processes other than the first say nothing and end with the same code.
    let silent = finish(Command::new(PROGRAM).env("PMI_SIZE", "4").env("PMI_RANK", "3").args(["run", "x"]));
    assert_eq!((silent.code, silent.err.as_str()), (Some(2), ""));
}
