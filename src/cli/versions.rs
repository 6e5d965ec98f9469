//! Versions of the program and of the libraries in this process.

use railsqueal::petsc::session::Petsc;

/// Name and version of the program and of each library, for `--version` and the provenance. Needs no running MPI.
pub fn versions() -> Vec<(String, String)> {
    let libraries = Petsc::versions();
    let mpi = mpi::environment::library_version().unwrap_or_else(|_| "unknown".into());
    let mpi = mpi.split(['\n', '\0']).next().unwrap_or_default().trim().trim_end_matches(',').to_string();
    let (major, minor) = mpi::environment::version();
    let hdf5 = hdf5::library_version();
    let metis = (metis_sys::METIS_VER_MAJOR, metis_sys::METIS_VER_MINOR, metis_sys::METIS_VER_SUBMINOR);
    let pairs = [
        ("railsqueal", env!("CARGO_PKG_VERSION").to_string()),
        ("PETSc", libraries.petsc),
        ("scalar type", libraries.scalar),
        ("PetscInt", format!("{} bit", libraries.int_width)),
        ("SLEPc", libraries.slepc),
        ("MUMPS", libraries.mumps),
        ("MPI", format!("{major}.{minor}, {mpi}")),
        ("HDF5", format!("{}.{}.{}", hdf5.0, hdf5.1, hdf5.2)),
        ("METIS", format!("{}.{}.{}", metis.0, metis.1, metis.2)),
    ];
    pairs.into_iter().map(|(name, version)| (name.to_string(), version)).collect()
}

/// The versions as `--version` prints them.
pub fn text() -> String {
    let mut lines = versions().into_iter();
    let mut text = lines.next().map(|(name, version)| format!("{name} {version}\n")).unwrap_or_default();
    for (name, version) in lines {
        text += &format!("  {name:<12} {version}\n");
    }
    text
}
