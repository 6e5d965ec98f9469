//! Subcommands on result files and drawings: the Python package `railsqueal` performs them, found beside the program,
//! where it was installed, or on the path.

use railsqueal::{Error, Result};
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Names the Python to take, and no other.
const CHOSEN: &str = "RAILSQUEAL_PYTHON";

/// Places of a Python interpreter for the package, below a folder above the program: that of `scripts/setup`, and that
/// of `scripts/install`.
const PLACES: [&str; 2] = [".venv/bin/python", "lib/railsqueal/bin/python"];

/// Exit code 0 where the package and what it needs can be found; nothing is imported, which would take a second.
const PROBE: &str = "import sys, importlib.util as u\n\
    sys.exit(sys.version_info < (3, 11) or any(u.find_spec(m) is None for m in ('railsqueal', 'h5py', \
    'matplotlib', 'numpy')))";

/// Becomes the package, called with the arguments of this process; returns only the error where that cannot be.
pub fn hand_over() -> Error {
    let program = std::env::current_exe().unwrap_or_default();
    match python(&program, std::env::var_os(CHOSEN)) {
        Ok(mut command) => {
            let error = command.args(["-m", "railsqueal"]).args(std::env::args_os().skip(1)).exec();
            Error::Io(format!("cannot start {}: {error}", Path::new(command.get_program()).display()))
        }
        Err(error) => error,
    }
}

/// A Python that has the package; the folder `python` of a checkout that the program lies in is put before what is
/// installed.
fn python(program: &Path, chosen: Option<OsString>) -> Result<Command> {
    let above: Vec<&Path> = program.ancestors().skip(1).collect();
    let candidates: Vec<PathBuf> = match chosen {
        Some(path) => vec![path.into()],
        None => {
            let places = above.iter().flat_map(|folder| PLACES.map(|place| folder.join(place)));
            // That of a package manager lies beside the program.
            let places = places.chain([program.with_file_name("python3")]);
            places.filter(|path| path.exists()).chain(["python3".into()]).collect()
        }
    };
    let package =
        above.iter().map(|folder| folder.join("python")).find(|path| path.join("railsqueal/__init__.py").exists());
    let command = |python: &Path| {
        let mut command = Command::new(python);
        if let Some(package) = &package {
            let known = std::env::var_os("PYTHONPATH").unwrap_or_default();
            let paths = [package.clone()]
                .into_iter()
                .chain(std::env::split_paths(&known).filter(|p| !p.as_os_str().is_empty()));
            command.env("PYTHONPATH", std::env::join_paths(paths).unwrap_or_default());
        }
        command
    };
    let has_package = |python: &&PathBuf| {
        let mut probe = command(python);
        probe.args(["-c", PROBE]).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        probe.status().is_ok_and(|status| status.success())
    };
    candidates.iter().find(has_package).map(|python| command(python)).ok_or_else(|| {
        let looked: Vec<String> = candidates.iter().map(|path| path.display().to_string()).collect();
        Error::Job(format!(
            "found no Python 3.11 or later with the package railsqueal, h5py, matplotlib and numpy (looked at {}).\n  \
             Run scripts/setup in the checkout, or pip install its folder python into a Python of your own and \
             name that in {CHOSEN}",
            looked.join(", ")
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_python_without_the_package_is_refused_with_what_to_do() {
        let error = python(Path::new("/nowhere/bin/railsqueal"), Some("/bin/false".into())).expect_err("no package");
        assert_eq!(error.exit_code(), 2);
        let text = error.to_string();
        for part in ["/bin/false", "pip install", "scripts/setup", CHOSEN] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }

    #[test]
    fn the_python_beside_the_program_comes_before_that_of_the_path() {
        let prefix = tempfile::tempdir().expect("folder");
        let bin = prefix.path().join("bin");
        std::fs::create_dir(&bin).expect("folder");
        // It takes every probe.
        std::os::unix::fs::symlink("/bin/true", bin.join("python3")).expect("link");
        let command = python(&bin.join("railsqueal"), None).expect("a Python");
        assert_eq!(command.get_program(), bin.join("python3"));
    }

    #[test]
    fn the_package_of_the_checkout_comes_first() {
        let checkout = tempfile::tempdir().expect("folder");
        let package = checkout.path().join("python");
        std::fs::create_dir_all(package.join("railsqueal")).expect("package");
        std::fs::write(package.join("railsqueal/__init__.py"), "").expect("write");
        // /bin/true takes every probe.
        let command =
            python(&checkout.path().join("target/release/railsqueal"), Some("/bin/true".into())).expect("a Python");
        let path =
            command.get_envs().find(|(name, _)| *name == "PYTHONPATH").and_then(|(_, value)| value).expect("a path");
        assert_eq!(std::env::split_paths(path).next(), Some(package));
    }
}
