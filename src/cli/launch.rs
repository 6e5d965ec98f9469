//! The launcher: which rank this process is before MPI starts, and whether MPI and the launcher agree.

use railsqueal::memory::Limit;
use railsqueal::{Error, Result};

/// Variables by which launchers tell a process how many ranks they started. The first that is set decides: `mpirun`
/// inside a SLURM allocation leaves SLURM's variables of the batch step in place.
const SIZES: [&str; 4] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS"];

/// Variables with the rank of the process, in the same order.
const RANKS: [&str; 5] = ["OMPI_COMM_WORLD_RANK", "PMI_RANK", "MV2_COMM_WORLD_RANK", "PMIX_RANK", "SLURM_PROCID"];

/// Environment: a lookup that tests can replace.
pub type Lookup<'a> = &'a dyn Fn(&str) -> Option<String>;

/// The process's environment.
pub fn environment(name: &str) -> Option<String> {
    std::env::var(name).ok()
}

/// True on the one process that speaks before MPI is there (or when it will not start).
pub fn speaks(env: Lookup) -> bool {
    RANKS.iter().find_map(|name| number(env, name)).unwrap_or(0) == 0
}

/// Variables by which a process finds the others, whatever the interface.
const INTERFACES: [&str; 9] = [
    "PMIX_NAMESPACE",
    "PMIX_RANK",
    "PMI_FD",
    "PMI_RANK",
    "PMI_SIZE",
    "OMPI_COMM_WORLD_SIZE",
    "MV2_COMM_WORLD_SIZE",
    "PALS_RANKID",
    "ALPS_APP_PE",
];

/// True where no launcher has set anything by which this process would find others.
pub fn alone(env: Lookup) -> bool {
    INTERFACES.iter().all(|name| env(name).is_none()) && number(env, "SLURM_STEP_NUM_TASKS").unwrap_or(1) <= 1
}

/// Variables of Open MPI for its start, as far as nobody has set them; to be set before MPI starts.
///
/// Libraries for networks take up to half of the start; ranks that are all on one machine have shared memory. TCP stays
/// for systems that leave none: asked for its routes the kernel says none to the machine itself but through the
/// loopback device, and Open MPI 5 complains on every rank, so routes are told by the addresses. A process that no
/// launcher started has nobody to speak to: see [`ALONE`].
pub fn variables(env: Lookup) -> Vec<(&'static str, &'static str)> {
    const MESSAGES: (&str, &str) = ("OMPI_MCA_pml", "ob1");
    const ROUTES: (&str, &str) = ("OMPI_MCA_reachable", "weighted");
    let sizes = ["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_LOCAL_SIZE"].map(|name| number(env, name));
    let wanted = match (alone(env), sizes) {
        (true, _) => [&ALONE[..], &[MESSAGES]].concat(),
        (_, [Some(all), Some(here)]) if all == here => vec![MESSAGES, ROUTES],
        _ => Vec::new(),
    };
    wanted.into_iter().filter(|(name, _)| env(name).is_none()).collect()
}

/// For a process that no launcher started. Open MPI 4 puts a daemon beside it, for others that it might spawn, which
/// takes a third of the start. Without the daemon all such processes of a user share one directory for their files,
/// and the first that ends removes it while others start or open a file of results: so none is made, and what would
/// lie there, memory shared with other processes and the place of shared file pointers, is not asked for. Open MPI 5
/// has neither daemon nor shared directory, and does not know the first two names.
const ALONE: [(&str, &str); 4] = [
    ("OMPI_MCA_ess_singleton_isolated", "1"),
    ("OMPI_MCA_orte_create_session_dirs", "0"),
    ("OMPI_MCA_btl", "self"),
    ("OMPI_MCA_sharedfp", "^sm"),
];

/// `Some` message if MPI would not start, or not as one world, by what the launcher offers to the processes.
pub fn no_common_world(env: Lookup) -> Option<String> {
    mute(env).or_else(|| deaf(env, &plugins()))
}

/// `Some` message if srun started several processes and gave them nothing by which they find each other: MPI_Init
/// would abort.
fn mute(env: Lookup) -> Option<String> {
    let size = number(env, "SLURM_STEP_NUM_TASKS").filter(|n| *n > 1)?;
    if INTERFACES.iter().any(|name| env(name).is_some()) {
        return None;
    }
    Some(format!(
        "srun started {size} processes (SLURM_STEP_NUM_TASKS={size}) without a PMI by which they could find \
         each other.\n  \
         Choose the interface that the MPI library of this program speaks: `srun --mpi=list` shows those there \
         are, e.g. srun --mpi=pmix; or use the \
         mpirun of that library"
    ))
}

/// `Some` message if srun offers PMI-1 or PMI-2 to an Open MPI whose plugins speak neither: MPI_Init would end the
/// processes in its own words. `plugins` are the names of its interfaces, none if they are not known.
fn deaf(env: Lookup, plugins: &[String]) -> Option<String> {
    env("SLURM_STEP_ID")?;
    let offered = ["PMI_FD", "PMI_RANK"].iter().find(|name| env(name).is_some())?;
    let other = ["PMIX_NAMESPACE", "OMPI_COMM_WORLD_SIZE"].iter().any(|name| env(name).is_some());
    if other || plugins.is_empty() || plugins.iter().any(|p| ["s1", "s2", "cray"].contains(&p.as_str())) {
        return None;
    }
    Some(format!(
        "srun offers PMI-1 or PMI-2 ({offered} is set), and the Open MPI of this program speaks neither.\n  \
         Choose PMIx, srun --mpi=pmix (`srun --mpi=list` \
         shows what there is), or the mpirun of that library"
    ))
}

/// Interfaces that the Open MPI of this process has as plugins: `ext3x`, `s2`, …; none where they are built in, or
/// where it is another MPI.
fn plugins() -> Vec<String> {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let library = maps.lines().filter_map(|l| Some(&l[l.find('/')?..])).find(|path| path.contains("/libmpi.so"));
    let Some(place) = library.and_then(|path| std::path::Path::new(path).parent()) else { return Vec::new() };
    let mut found = Vec::new();
    // Beside the library in openmpi, in Debian in openmpi/lib/openmpi3.
    let mut folders = vec![(place.to_owned(), 0)];
    while let Some((folder, depth)) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if let Some(plugin) = name.strip_prefix("mca_pmix_").and_then(|n| n.strip_suffix(".so")) {
                found.push(plugin.to_owned());
            }
            if depth < 3 && (name.starts_with("openmpi") || (depth > 0 && name == "lib")) {
                folders.push((entry.path(), depth + 1));
            }
        }
    }
    found
}

/// `Some` message if the launcher started several processes but MPI made a world of one of each.
pub fn singletons(world_size: usize, env: Lookup) -> Option<String> {
    if world_size != 1 {
        return None;
    }
    let (name, size) = SIZES.iter().find_map(|name| Some((*name, number(env, name)?)))?;
    if size <= 1 {
        return None;
    }
    Some(format!(
        "the launcher started {size} processes ({name}={size}), but MPI made {size} separate worlds of one rank \
         instead of one world.\n  \
         The launcher and the MPI library of this program do not speak the same PMI. Use the mpirun of the MPI library \
         that `railsqueal --version` names, or under SLURM choose the matching interface: `srun --mpi=list` \
         shows those there \
         are, e.g. srun --mpi=pmix (or pmi2)."
    ))
}

fn number(env: Lookup, name: &str) -> Option<u64> {
    env(name)?.trim().parse().ok()
}

/// MPI and the libraries open so many files each before the program has its own.
const DESCRIPTORS: u64 = 32;

/// An error if this process may open too few files (`ulimit -n`) for MPI, which then ends without a word.
pub fn enough_descriptors() -> Result<()> {
    match rustix::process::getrlimit(rustix::process::Resource::Nofile).current {
        Some(limit) if limit < DESCRIPTORS => Err(Error::Io(format!(
            "the limit of open files (ulimit -n) is {limit}, expected {DESCRIPTORS} or more; raise it, e.g. \
             ulimit -n 1024"
        ))),
        _ => Ok(()),
    }
}

/// Address space that MPI and the libraries take for their start, MB, and more than they need.
const START: f64 = 128.0;

/// An error if the address space of this process (`ulimit -v`) leaves too little for MPI and the libraries, which then
/// crash or wait for ever. Below some 160 MB the libraries cannot be loaded, and below some 320 MB OpenBLAS 0.3.29
/// waits for ever while it is loaded: no line of this program runs.
pub fn enough_address_space() -> Result<()> {
    let limit = Limit::of_process();
    if limit.bytes < 1e6 * START {
        return Err(Error::Memory(format!(
            "{} leaves {:.0} MB, expected {START:.0} MB or more for the start of MPI and the libraries; raise it \
             (ulimit -v unlimited)",
            limit.source,
            1e-6 * limit.bytes
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processes_of_srun_without_an_interface_are_refused_before_mpi_starts() {
        let with = |names: &'static [&'static str]| move |name: &str| names.contains(&name).then(|| "4".to_owned());
        let message = mute(&with(&["SLURM_STEP_NUM_TASKS"])).expect("a message");
        assert!(message.contains("4 processes") && message.contains("srun --mpi=list"), "{message}");
        for interface in INTERFACES {
            let env = |name: &str| ["SLURM_STEP_NUM_TASKS", interface].contains(&name).then(|| "4".to_owned());
            assert_eq!(mute(&env), None, "{interface}");
        }
        assert_eq!(mute(&|name: &str| (name == "SLURM_STEP_NUM_TASKS").then(|| "1".to_owned())), None);
        assert_eq!(mute(&|_: &str| None), None);
    }

    #[test]
    fn a_process_is_alone_where_nobody_started_others() {
        assert!(alone(&|_: &str| None));
        assert!(alone(&|name: &str| (name == "SLURM_STEP_NUM_TASKS").then(|| "1".to_owned())));
        for name in INTERFACES.into_iter().chain(["SLURM_STEP_NUM_TASKS"]) {
            assert!(!alone(&|asked: &str| (asked == name).then(|| "2".to_owned())), "{name}");
        }
    }

    #[test]
    fn an_interface_that_the_library_does_not_speak_is_refused() {
        let env = |names: &'static [&'static str]| move |name: &str| names.contains(&name).then(|| "0".to_owned());
        let plugins = |names: &[&str]| names.iter().map(|n| n.to_string()).collect::<Vec<_>>();
        let pmi2 = env(&["SLURM_STEP_ID", "PMI_FD", "PMI_RANK"]);
        let text = deaf(&pmi2, &plugins(&["ext3x", "flux"])).unwrap_or_default();
        assert!(text.contains("--mpi=pmix") && text.contains("PMI_FD"), "{text}");
        assert_eq!(deaf(&pmi2, &plugins(&["ext3x", "s2"])), None, "it speaks PMI-2");
        assert_eq!(deaf(&pmi2, &[]), None, "it is not known what it speaks");
        assert_eq!(deaf(&env(&["SLURM_STEP_ID", "PMI_RANK", "PMIX_NAMESPACE"]), &plugins(&["ext3x"])), None);
        assert_eq!(deaf(&env(&["PMI_RANK"]), &plugins(&["ext3x"])), None, "no srun");
    }

    #[test]
    fn networks_are_left_out_where_all_ranks_are_on_one_machine() {
        let names = |pairs: &[(&str, &str)]| variables(&of(pairs)).iter().map(|(name, _)| *name).collect::<Vec<_>>();
        let lone = ALONE.map(|(name, _)| name);
        assert_eq!(names(&[]), [&lone[..], &["OMPI_MCA_pml"]].concat());
        assert_eq!(names(&[("OMPI_MCA_pml", "ucx")]), lone, "somebody has chosen");
        let here = ("OMPI_COMM_WORLD_LOCAL_SIZE", "4");
        assert_eq!(names(&[("OMPI_COMM_WORLD_SIZE", "4"), here]), ["OMPI_MCA_pml", "OMPI_MCA_reachable"]);
        assert_eq!(names(&[("OMPI_COMM_WORLD_SIZE", "8"), here]), [""; 0], "two machines");
        assert_eq!(names(&[("PMI_SIZE", "4")]), [""; 0], "another launcher");
    }

    fn of<'a>(pairs: &'a [(&'a str, &'a str)]) -> impl Fn(&str) -> Option<String> + 'a {
        |name| pairs.iter().find(|(n, _)| *n == name).map(|(_, v)| v.to_string())
    }

    #[test]
    fn several_worlds_of_one_are_noticed() {
        for name in SIZES {
            let pairs = [(name, "3")];
            let text = singletons(1, &of(&pairs)).unwrap_or_default();
            assert!(text.contains("3 processes") && text.contains("PMI") && text.contains(name), "{name}: {text}");
            assert_eq!(singletons(3, &of(&pairs)), None, "{name}");
        }
    }

    #[test]
    fn a_true_world_of_one_is_none() {
        assert_eq!(singletons(1, &of(&[])), None);
        assert_eq!(singletons(1, &of(&[("OMPI_COMM_WORLD_SIZE", "1"), ("SLURM_STEP_NUM_TASKS", "8")])), None);
        assert_eq!(singletons(1, &of(&[("PMI_SIZE", "no number")])), None);
    }

    #[test]
    fn one_process_speaks() {
        assert!(speaks(&of(&[])));
        assert!(speaks(&of(&[("PMI_RANK", "0")])));
        assert!(!speaks(&of(&[("OMPI_COMM_WORLD_RANK", "1")])));
        assert!(!speaks(&of(&[("SLURM_PROCID", "2")])));
    }
}
