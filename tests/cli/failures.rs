//! Runs that fail on the way: places that cannot be written, full disks, and one rank alone.

use super::program::*;
use serde_json::json;
use std::io::{BufRead, BufReader};
use std::process::Command;

#[test]
fn output_that_cannot_be_written() {
    let folder = Folder::with(small().to_string());
    for ranks in [1, 2] {
        // A folder that is not there; a file where a folder should be (root may write to any folder, but not into a
        // file).
        let ran = folder.call(ranks, "run", &["--output", &folder.text("no/such/run.h5")]);
        ran.failed(6, &["no/such/run.h5", "cannot write"]);
        let ran = folder.call(ranks, "run", &["--output", &folder.text("job.json/run.h5")]);
        ran.failed(6, &["job.json/run.h5"]);
        let ran = folder.call(ranks, "run", &["--output", &folder.text("")]);
        ran.failed(6, &["directory"]);
        folder.untouched();
    }
    folder.call(1, "run", &["--output", "/proc/run.h5"]).failed(6, &["/proc/run.h5"]);
}

#[test]
fn existing_results_are_kept() {
    let folder = Folder::with(small().to_string());
    std::fs::write(folder.path("job.h5"), "precious").expect("write");
    for ranks in [1, 2] {
        folder.call(ranks, "run", &[]).failed(2, &["job.h5", "--force"]);
        assert_eq!(std::fs::read_to_string(folder.path("job.h5")).expect("read"), "precious");
        assert_eq!(folder.listing(), ["job.h5", "job.json"]);
    }
}

/// Two runs to one file at once, as of an array of jobs without --output: one of them is refused, and loses nothing.
#[test]
fn one_of_two_runs_to_one_file_is_refused() {
    let folder = Folder::with(small().to_string());
    let set = |friction: &str| format!("contact.friction={friction}");
    let one = |friction: &str| folder.call(1, "run", &["--only", "steady", "--set", &set(friction)]);
    let (a, b) = std::thread::scope(|s| {
        let (a, b) = (s.spawn(|| one("0.2")), s.spawn(|| one("0.4")));
        (a.join().expect("a run"), b.join().expect("a run"))
    });
    let (kept, refused) = if a.code == Some(0) { ("0.2", &b) } else { ("0.4", &a) };
    assert_eq!([a.code, b.code].iter().filter(|code| **code == Some(0)).count(), 1, "{} {}", a.err, b.err);
    let says = ["another run writes to this file now", "exists already"];
    assert!(refused.code == Some(2) && says.iter().any(|s| refused.err.contains(s)), "{}", refused.err);
    let file = hdf5::File::open(folder.path("job.h5")).expect("a result");
    let job: hdf5::types::VarLenUnicode =
        file.dataset("provenance/job").and_then(|d| d.read_scalar()).expect("the job");
    let job: serde_json::Value = serde_json::from_str(&job).expect("JSON");
    assert_eq!(job["contact"]["friction"].to_string(), kept);
    assert_eq!(folder.listing(), ["job.h5", "job.hdf", "job.json"]);
}

/// Whatever --force is given for: inputs stay, and nothing but regular results of this program goes.
#[test]
fn inputs_and_what_is_no_result_are_never_replaced() {
    let folder = Folder::with(small().to_string());
    let quick = ["--only", "steady", "--set", "output.fields=false"];
    let call = |args: &[&str]| folder.call(1, "run", &[&quick[..], args].concat());
    let (job, result) = (folder.text("job.json"), folder.text("job.h5"));
    call(&["--output", &job, "--force"]).failed(2, &["--output", "job.json", "an input of this run, the job file"]);
    call(&[]).good();
    let before = std::fs::read(&result).expect("read");
    call(&["--reuse", &result, "--force"]).failed(2, &["job.h5", "an input of this run, the file of --reuse"]);
    // Under another name, too.
    std::fs::hard_link(&result, folder.path("other.h5")).expect("link");
    call(&["--reuse", &result, "--output", &folder.text("other.h5"), "--force"]).failed(2, &["the file of --reuse"]);
    assert_eq!(std::fs::read(&result).expect("read"), before);
    let dangling = folder.path("dangling.h5");
    std::os::unix::fs::symlink(folder.path("nowhere"), &dangling).expect("link");
    std::fs::write(folder.path("notes.h5"), "precious").expect("write");
    assert!(Command::new("mkfifo").arg(folder.path("fifo.h5")).status().expect("mkfifo").success());
    for force in [&[][..], &["--force"]] {
        for (name, what) in [("dangling.h5", "a symbolic link to"), ("fifo.h5", "a FIFO")] {
            call(&[&["--output", &folder.text(name)], force].concat()).failed(2, &[name, what]);
        }
    }
    call(&["--output", "/dev/null", "--force"]).failed(2, &["/dev/null", "a device"]);
    call(&["--output", &folder.text("notes.h5"), "--force"]).failed(2, &["notes.h5", "no result file of this program"]);
    assert_eq!(std::fs::read_to_string(folder.path("notes.h5")).expect("read"), "precious");
    assert!(std::fs::symlink_metadata(&dangling).expect("the link").is_symlink());
    call(&["--force"]).good();
    let mut blocks = super::program::job("blocks.json");
    for body in ["lower", "upper"] {
        let mesh = format!("{}/meshes/block-{body}.msh", env!("CARGO_MANIFEST_DIR"));
        std::fs::copy(mesh, folder.path(&format!("{body}.msh"))).expect("copy");
        blocks["bodies"][body]["mesh"]["file"] = json!(format!("{body}.msh"));
    }
    std::fs::write(folder.path("job.json"), blocks.to_string()).expect("write");
    folder
        .call(1, "run", &["--output", &folder.text("upper.msh"), "--force"])
        .failed(2, &["upper.msh", "an input of this run, bodies.upper.mesh.file"]);
}

/// Modes and compliance are on the disk as soon as they exist, and a later run takes them up.
#[test]
fn what_was_computed_stays_where_a_later_step_fails() {
    let mut job = small();
    job["analyses"] = json!({ "modes": { "count": 5 }, "stability": { "direction": "rigid" }, "steady": {} });
    job["output"] = json!({ "fields": false });
    let folder = Folder::with(job.to_string());
    // Spin alone has a pole inside the contact, where nothing slides.
    let pole = ["--set", "contact.creepage={\"spin\": 0.5}"];
    folder.call(2, "run", &pole).failed(2, &["pole", "job.model.h5: --reuse", "takes them up"]);
    assert_eq!(folder.listing(), ["job.json", "job.model.h5"]);
    let model = folder.text("job.model.h5");
    let kept = std::fs::read(&model).expect("read");
    let ran = folder.call(2, "run", &["--reuse", &model, "--output", &folder.text("other.h5")]);
    assert!(!ran.good().err.contains("modes, body"), "{}", ran.err);
    assert_eq!(std::fs::read(&model).expect("read"), kept, "an input stays");
    std::fs::remove_file(folder.path("other.h5")).expect("remove");
    // They may be made again, and are gone when the results are complete.
    let ran = folder.call(1, "run", &["--force", "--output", &folder.text("job.h5")]);
    assert!(ran.good().err.contains("job.model.h5 has modes and compliance"), "{}", ran.err);
    assert_eq!(folder.listing(), ["job.h5", "job.json"]);
    // So they are where the same results are made of them; these are whole.
    folder.call(2, "run", &[&pole[..], &["--force"]].concat()).failed(2, &["pole"]);
    let ran = folder.call(2, "run", &["--reuse", &model, "--force"]);
    assert!(!ran.good().err.contains("modes, body"), "{}", ran.err);
    assert!(super::transient::open(folder.path("job.h5")).group("reduced/lower").is_ok());
    assert_eq!(folder.listing(), ["job.h5", "job.json"]);
}

/// A signal is acknowledged when it comes, and ends any job at the end of a step.
#[test]
fn a_signal_ends_a_job_without_a_transient() {
    let mut job = small();
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["max_element_size"] = json!(0.03);
    }
    job["output"] = json!({ "fields": false });
    let folder = Folder::with(job.to_string());
    let mut command = Command::new(PROGRAM);
    command.args(["run", &folder.text("job.json")]).env("OPENBLAS_NUM_THREADS", "1");
    let mut child = Running::start(1, command.stderr(std::process::Stdio::piped()));
    let mut lines = BufReader::new(child.stderr.take().expect("stderr")).lines().map(|l| l.expect("a line"));
    assert!(lines.by_ref().any(|line| line.contains("meshing")));
    super::interrupted::signal("USR1", child.id());
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().expect("wait").code(), Some(5), "{rest:?}");
    assert!(rest.iter().any(|l| l.contains("a signal came")), "{rest:?}");
    assert!(rest.iter().any(|l| l.contains("railsqueal: error: stopped on request")), "{rest:?}");
    folder.untouched();
}

/// A limit on the size of files stands for a full disk where no small file system can be mounted: the same code paths.
#[test]
fn files_that_may_not_grow() {
    let folder = Folder::with(small().to_string());
    for ranks in [1, 2] {
        let mut command = mpirun();
        // Over shared memory Open MPI itself would need larger files.
        command.env("OMPI_MCA_btl", "self,tcp");
        command.args([
            "-n",
            &ranks.to_string(),
            "sh",
            "-c",
            "ulimit -f 40; exec \"$0\" run \"$1\" --only steady --set output.reduced=false",
            PROGRAM,
            &folder.text("job.json"),
        ]);
        finish_on(ranks, &mut command).failed(6, &["job.h5", "ulimit -f"]);
        folder.untouched();
    }
}

#[test]
fn full_disk() {
    let folder = Folder::with(small().to_string());
    std::fs::create_dir(folder.path("disk")).expect("make a folder");
    let disk = folder.text("disk");
    let mount = Command::new("mount").args(["-t", "tmpfs", "-o", "size=200k", "tmpfs", &disk]).output();
    if !mount.is_ok_and(|m| m.status.success()) {
        eprintln!("no small file system can be mounted here; files_that_may_not_grow stands for it");
        return;
    }
    let ran = folder.call(
        2,
        "run",
        &["--only", "steady", "--set", "output.reduced=false", "--output", &folder.text("disk/run.h5")],
    );
    let left = std::fs::read_dir(&disk).expect("list").count();
    assert!(Command::new("umount").arg(&disk).status().expect("umount").success());
    ran.failed(6, &["run.h5", "No space left"]);
    assert_eq!(left, 0);
}

/// Rank 1 alone may not write large files: it fails where the others do not, and all end with its code and one message.
#[test]
fn one_rank_alone_fails() {
    let mut job = small();
    job["output"] = json!({ "reduced": false });
    let folder = Folder::with(job.to_string());
    let job = folder.text("job.json");
    let mut command = mpirun();
    // Over shared memory Open MPI itself would need larger files.
    command.env("OMPI_MCA_btl", "self,tcp");
    // The mpirun of Debian 13 crashes where it is given several programs.
    let line = "[ \"$OMPI_COMM_WORLD_RANK\" != 1 ] || ulimit -f 8; exec \"$0\" run \"$1\" --only steady";
    command.args(["-n", "3", "sh", "-c", line, PROGRAM, &job]);
    finish_on(3, &mut command).failed(6, &["job.h5"]);
    folder.untouched();
}

/// The system refuses what the factorisation asks for, although the estimate beforehand found enough: exit 7, with
/// what was needed.
#[test]
fn a_factorisation_that_does_not_fit() {
    let folder = Folder::with(job("annulus.json").to_string());
    let mut command = Command::new("sh");
    // The factor alone takes more than the address space that is left; the estimate is passed over.
    let limit = "ulimit -v 1100000; exec \"$0\" run \"$1\" --set solver.memory_limit=64e9";
    command.args(["-c", limit, PROGRAM, &folder.text("job.json")]);
    command.env("OPENBLAS_NUM_THREADS", "1");
    finish(&mut command).failed(7, &["out of memory in the factorisation", "body lower", "it needs about", "gamg"]);
    folder.untouched();
}

/// Whatever address space there is: the run comes to its end, or is refused. Without a look beforehand OpenBLAS asks
/// for its buffers for ever where MUMPS has taken what there was.
#[test]
#[ignore = "long: scripts/validate long"]
fn under_any_limit_of_the_address_space_a_run_ends() {
    let folder = Folder::with(job("annulus.json").to_string());
    let output = folder.text("run.h5");
    let ends = |kilobytes: u64, given: &[&str]| {
        let mut command = Command::new("timeout");
        let limit = format!("ulimit -v {kilobytes}; exec \"$0\" run \"$@\"");
        command.args(["300", "sh", "-c", &limit, PROGRAM, &folder.text("job.json"), "--force", "--output", &output]);
        finish(command.args(given).env("OPENBLAS_NUM_THREADS", "1"))
    };
    // Less than the estimate asks for: at once, with what to raise.
    let ran = ends(800_000, &[]);
    ran.failed(7, &["the job needs about", "in the process of rank 0", "ulimit -v"]);
    assert!(!ran.err.contains("meshing"), "{}", ran.err);
    let mut codes = std::collections::BTreeSet::new();
    // The estimate is passed over.
    for kilobytes in [500_000, 650_000, 800_000, 950_000, 1_100_000, 3_200_000] {
        let ran = ends(kilobytes, &["--set", "solver.memory_limit=64e9"]);
        assert!(matches!(ran.code, Some(0 | 7)), "{kilobytes} kB: {ran:?}");
        codes.extend(ran.code);
    }
    assert_eq!(codes.len(), 2, "some end, some do not fit: {codes:?}");
}

/// A rank that is stopped, or killed: the others do not wait for it for ever, and say why.
#[test]
fn a_rank_that_is_lost_ends_the_others() {
    let mut job = small();
    job["output"] = json!({ "fields": false });
    job["analyses"]["steady"] = json!(null);
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["max_element_size"] = json!(0.02);
    }
    let folder = Folder::with(job.to_string());
    for (name, parts) in [("STOP", &["rank 1", "has been stopped", "the run ends"][..]), ("KILL", &["on signal 9"])] {
        let mut command = mpirun();
        command.args(["-n", "2", PROGRAM]);
        let mut child = super::interrupted::start_on(2, command, &["run", &folder.text("job.json")]);
        // From here on both are at work.
        let mut lines = BufReader::new(child.stderr.take().expect("stderr")).lines().map(|l| l.expect("a line"));
        assert!(lines.by_ref().any(|line| line.contains("meshing")));
        super::interrupted::signal(name, super::interrupted::rank_of(child.id(), 1));
        let rest: Vec<String> = lines.collect();
        // Open MPI 5 breaks its lines elsewhere than Open MPI 4.
        let text = rest.join(" ");
        assert!(!child.wait().expect("wait").success(), "{text}");
        parts.iter().for_each(|part| assert!(text.contains(part), "{name}: no {part:?} in {text}"));
        // The lock of a process that is killed goes with it, its file with the next run.
        let _ = std::fs::remove_file(folder.path(".job.h5.claim"));
    }
    folder.untouched();
}

/// The same at a shift of the full system, where the first factorisations fitted: real, and complex where the damping
/// of the bodies differs.
#[test]
#[ignore = "long: scripts/validate long"]
fn factorisations_at_a_shift_that_do_not_fit() {
    let mut job = job("curve.json");
    // A small lower body and a large upper one, whose factor at the shift is the largest thing of all.
    for (body, far) in [("lower", 0.1), ("upper", 0.027)] {
        let cylinder = &mut job["bodies"][body]["mesh"]["cylinder"];
        cylinder["element_size"] = json!(0.004);
        cylinder["growth"] = json!(1.5);
        cylinder["max_element_size"] = json!(far);
    }
    job["contact"]["patch"] = json!({ "half_length": 0.012, "half_width": 0.012 });
    job["analyses"] =
        json!({ "modes": { "count": 4 }, "stability": { "direction": "rigid", "full": { "max_frequency": 400 } } });
    job["output"] = json!({ "fields": false, "reduced": false });
    for (alpha, kilobytes, parts) in [
        (1.0, 1_350_000, ["in the factorisation of body upper at", "a coarser mesh"]),
        (5.0, 1_400_000, ["in the complex factorisation of body upper at", "equal damping.alpha"]),
    ] {
        job["bodies"]["upper"]["damping"]["alpha"] = json!(alpha);
        let folder = Folder::with(job.to_string());
        let mut command = Command::new("sh");
        let limit = format!("ulimit -v {kilobytes}; exec \"$0\" run \"$1\" --set solver.memory_limit=64e9");
        command.args(["-c", &limit, PROGRAM, &folder.text("job.json")]);
        command.env("OPENBLAS_NUM_THREADS", "1");
        finish(&mut command)
            .failed(7, &[&["out of memory", "the system refuses", "it needs about"], &parts[..]].concat());
        folder.untouched();
    }
}

/// Batch systems set small limits: MPI would end without a word.
#[test]
fn too_few_open_files_are_said() {
    let folder = Folder::with(small().to_string());
    let ran = finish(Command::new("bash").args([
        "-c",
        "ulimit -n 10; exec \"$0\" run \"$1\"",
        PROGRAM,
        &folder.text("job.json"),
    ]));
    ran.failed(6, &["ulimit -n", "is 10", "expected 32 or more"]);
    folder.untouched();
}

/// An address space that does not hold MPI is refused: it would crash, or wait for ever.
#[test]
fn too_little_address_space_is_said() {
    let folder = Folder::with(small().to_string());
    let told = (170_000..500_000).step_by(80_000).any(|kilobytes| {
        let line = format!("ulimit -v {kilobytes}; exec timeout 10 \"$0\" run \"$1\"");
        let ran = finish(Command::new("bash").env("OPENBLAS_NUM_THREADS", "1").args([
            "-c",
            &line,
            PROGRAM,
            &folder.text("job.json"),
        ]));
        folder.untouched();
        // The dynamic linker has no room for the libraries, or OpenBLAS waits for room of its own: no line of the
        // program has run.
        if matches!(ran.code, Some(124 | 127)) {
            return false;
        }
        ran.failed(7, &["ulimit -v", "expected 128 MB or more"]);
        true
    });
    assert!(told, "no limit is told");
}

/// A file system that fails when HDF5 closes a file: HDF5 would close it again at the end of MPI, and crash.
#[test]
fn a_file_that_cannot_be_closed_ends_with_its_message() {
    let folder = Folder::with(small().to_string());
    std::fs::write(
        folder.path("close.c"),
        "#include <errno.h>\n#include <sys/types.h>\nint ftruncate(int f, off_t n) { errno = EINVAL; return -1; }\n\
         int ftruncate64(int f, off_t n) { errno = EINVAL; return -1; }\n",
    )
    .expect("write");
    let library = folder.text("close.so");
    let made = Command::new("cc").args(["-shared", "-fPIC", "-o", &library, &folder.text("close.c")]).status();
    assert!(made.expect("a C compiler").success());
    let ran = finish(
        Command::new(PROGRAM)
            .env("OPENBLAS_NUM_THREADS", "1")
            .env("LD_PRELOAD", &library)
            .args(["run", &folder.text("job.json")]),
    );
    ran.failed(6, &["cannot write", "Invalid argument"]);
    assert!(!folder.path("job.h5").exists());
}
