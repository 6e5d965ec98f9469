use super::*;

#[test]
fn arguments_are_consistent() {
    use clap::CommandFactory;
    Cli::command().debug_assert();
}

#[test]
fn the_result_lies_beside_the_job() {
    assert_eq!(default_output(Path::new("a/b.json")), Path::new("a/b.h5"));
    assert_eq!(default_output(Path::new("b")), Path::new("b.h5"));
    assert_eq!(beside(Path::new("/dev/shm/b.json")).expect("a folder"), Path::new("/dev/shm/b.h5"));
    for path in ["/dev/stdin", "/dev/fd/63", "/proc/self/fd/0"] {
        let error = beside(Path::new(path)).expect_err(path);
        assert!(error.exit_code() == 2 && error.message().contains("--output"), "{error}");
    }
}

#[test]
fn a_job_of_an_example_has_its_name() {
    assert_eq!(default_job(Example::WheelOnRailContact), Path::new("wheel-on-rail-contact.json"));
}

#[test]
fn the_manual_and_the_completion_know_every_command_that_is_shown() {
    use clap::CommandFactory;
    let (manual, bash) = (manual(), completion(clap_complete::Shell::Bash));
    for command in Cli::command().get_subcommands() {
        let name = command.get_name();
        let section = format!(".SH \"railsqueal {name}\"");
        assert_eq!(manual.contains(&section), !command.is_hide_set(), "{name}");
        assert!(command.is_hide_set() || bash.contains(&format!("railsqueal,{name})")), "{name}");
    }
    assert!(manual.contains("Exit codes"));
}

/// The options of pictures and reports are those of the Python package.
#[test]
fn decay_rates_are_fitted_here_and_modes_in_python() {
    let parse = |line: &[&str]| Cli::try_parse_from([&["railsqueal"], line].concat()).map(|cli| cli.command);
    let of_results = |line: &[&str]| parse(line).expect("a command").is_some_and(|c| c.is_of_results());
    assert!(of_results(&["fit", "hammer.uff", "--modes", "2"]));
    assert!(!of_results(&["fit", "job.json", "--decay", "rates.csv", "--key", "pad.vertical"]));
    assert!(
        of_results(&["plot", "r.h5", "--decay", "rates.csv"]) && of_results(&["report", "r.h5", "--decay", "r.csv"])
    );
    for line in [&["fit", "job.json", "--key", "pad.vertical"][..], &["fit", "j", "--decay", "r", "--modes", "2"]] {
        assert!(parse(line).is_err(), "{line:?}");
    }
}

#[test]
fn values_may_begin_with_a_minus() {
    let line = ["railsqueal", "run", "j.json", "--set", "contact.creepage.lateral=-0.01", "--", "-log_view"];
    let Some(Command::Run { changes, petsc, .. }) = Cli::parse_from(line).command else { panic!("no run") };
    assert_eq!(changes.sets, ["contact.creepage.lateral=-0.01"]);
    assert_eq!(petsc, ["-log_view"]);
}
