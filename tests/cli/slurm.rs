//! The script that runs a job under SLURM, with commands of SLURM's names that write down how they are called.

use super::full_transient::short;
use super::program::*;
use super::transient::sliding;
use serde_json::json;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

/// A folder with commands in place of SLURM's; `mpi` is what srun says of its interfaces.
fn cluster(job: &serde_json::Value, mpi: &str) -> Folder {
    let folder = Folder::with(job.to_string());
    std::fs::create_dir(folder.path("bin")).expect("a folder");
    let note = |name: &str| format!("echo \"{name} $*\" >> \"$SLURM_SUBMIT_DIR/calls\"");
    let run = "while [[ $1 == --mpi=* || $1 == -n || $1 =~ ^[0-9]+$ ]]; do shift; done; exec \"$@\"";
    let commands = [
        ("srun", format!("[ \"$1\" = --mpi=list ] && {{ echo '{mpi}' >&2; exit; }}\n{}\n{run}", note("srun"))),
        ("mpirun", format!("{}\n{run}", note("mpirun"))),
        ("scontrol", note("scontrol")),
    ];
    for (name, text) in commands {
        let path = folder.path("bin").join(name);
        std::fs::write(&path, format!("#!/bin/bash\n{text}\n")).expect("write");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("executable");
    }
    folder
}

/// Runs the script; the job's time ends in `left` s.
fn submit(folder: &Folder, args: &[&str], restarts: u32, left: u64) -> (Ran, String) {
    let _ = std::fs::remove_file(folder.path("calls"));
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("a date").as_secs();
    let path = format!("{}:{}", folder.text("bin"), std::env::var("PATH").unwrap_or_default());
    let mut command = Command::new("bash");
    command.arg(concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/slurm.sh")).arg("job.json").args(args);
    command.env("PATH", path).env("RAILSQUEAL", PROGRAM).env("SLURM_SUBMIT_DIR", folder.path(""));
    command.env("SLURM_JOB_ID", "7").env("SLURM_NTASKS", "1").env("SLURM_JOB_END_TIME", (now + left).to_string());
    command.env("SLURM_RESTART_COUNT", restarts.to_string());
    let ran = finish(&mut command);
    (ran, std::fs::read_to_string(folder.path("calls")).expect("the calls"))
}

#[test]
fn options_reach_the_check_and_a_launcher_is_chosen() {
    let mut job = small();
    job["output"] = json!({ "fields": false });
    for (mpi, launcher) in [("none pmi2 pmix pmix_v4", "srun --mpi=pmix "), ("none cray_shasta pmi2", "mpirun -n 1 ")] {
        let folder = cluster(&job, mpi);
        let set = "contact.friction=0.25";
        let (ran, calls) = submit(&folder, &["--set", set, "--only=steady", "--output", "x.h5"], 0, 3600);
        assert!(ran.good().out.contains("steady rolling") && !ran.out.contains("estimated memory"), "{}", ran.out);
        let lines: Vec<&str> = calls.lines().collect();
        assert_eq!(lines.len(), 2, "{calls}");
        assert!(lines.iter().all(|l| l.starts_with(launcher)), "{calls}");
        assert!(lines[0].ends_with(&format!("check job.json --set {set} --only=steady")), "{calls}");
        // Steady rolling has no use for an end of the time.
        assert!(lines[1].ends_with(&format!("run job.json --set {set} --only=steady --output x.h5")), "{calls}");
        assert!(folder.path("x.h5").exists());
        let (ran, calls) = submit(&folder, &["--set", "contact.friction=-1"], 0, 3600);
        ran.failed(2, &["contact.friction"]);
        assert_eq!(calls.lines().count(), 1, "it ends with the check: {calls}");
    }
}

/// The run stops before the end of the job's time, is put into the queue again, and goes on as it was begun.
#[test]
fn a_run_that_is_stopped_comes_into_the_queue_again_and_goes_on() {
    let job = sliding(json!({ "duration": 0.03, "start": { "mode": 1, "amplitude": 1e-6 }, "segment": 500 }));
    let folder = cluster(&job, "pmix");
    let args = ["--force", "-o", "r.h5", "--set", "output.fields=false"];
    // Less than the two minutes that are left for the end.
    let (ran, calls) = submit(&folder, &args, 0, 121);
    ran.failed(5, &["limit of wall time", "into the queue again"]);
    assert!(calls.lines().last().is_some_and(|l| l == "scontrol requeue 7"), "{calls}");
    assert!(folder.path("r.transient/manifest").exists());
    let (ran, calls) = submit(&folder, &args, 1, 3600);
    // The run has its modes and its compliance.
    assert!(!ran.good().err.contains("modes, body") && !ran.err.contains("meshing"), "{}", ran.err);
    let line = calls.lines().last().expect("a call");
    assert!(line.contains("--resume r.h5 --set output.fields=false") && !line.contains("--force"), "{line}");
    assert!(line.contains("--wall-time 34") && folder.path("r.h5").exists(), "{line}");
}

/// Every transient stops before the end of the job's time, on the modes or on all degrees of freedom.
#[test]
fn a_transient_of_either_model_knows_the_end_of_the_time() {
    for model in ["reduced", "full"] {
        let folder = cluster(&short(model), "pmix");
        // How it is called is known before it computes.
        std::fs::write(folder.path("file"), "").expect("a file where a folder would be");
        let (ran, calls) = submit(&folder, &["--output", "file/x.h5"], 0, 3600);
        ran.failed(6, &["cannot write file/x.transient"]);
        assert!(calls.lines().last().is_some_and(|line| line.contains("--wall-time 34")), "{model}: {calls}");
    }
}

/// Runs that are killed before their first segment leave modes and compliance at the most, and a folder without
/// segments.
#[test]
fn a_run_that_was_killed_during_its_set_up_begins_again_with_what_there_is() {
    let mut job = sliding(json!({ "duration": 0.005, "start": { "mode": 1, "amplitude": 1e-6 } }));
    job["output"] = json!({ "fields": false });
    let folder = cluster(&job, "pmix");
    let place = folder.path("job.transient");
    std::fs::create_dir(&place).and_then(|()| std::fs::write(place.join("manifest"), "")).expect("a folder");
    let (ran, calls) = submit(&folder, &[], 1, 3600);
    assert!(ran.good().err.contains("modes, body"), "{}", ran.err);
    assert!(!calls.contains("--resume") && !calls.contains("--reuse"), "{calls}");
    std::fs::rename(folder.path("job.h5"), folder.path("job.model.h5")).expect("rename");
    let (ran, calls) = submit(&folder, &[], 1, 3600);
    assert!(!ran.good().err.contains("modes, body") && calls.contains("--reuse job.model.h5"), "{calls}{}", ran.err);
    assert!(folder.path("job.h5").exists() && !folder.path("job.model.h5").exists());
    // Of a job that was another one.
    std::fs::rename(folder.path("job.h5"), folder.path("job.model.h5")).expect("rename");
    let (ran, _) = submit(&folder, &["--set", "bodies.lower.material.young=2e11"], 1, 3600);
    assert!(ran.good().err.contains("from the beginning") && ran.err.contains("modes, body"), "{}", ran.err);
}
