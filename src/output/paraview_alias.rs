//! `FILE.hdf`, the name under which every ParaView from 5.11 on, and pyvista, take `FILE.h5` for a file with fields.

use std::fs;
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// Extension by which these programs recognise a file with fields.
const EXTENSION: &str = "hdf";

/// The link to the main file `path`, whether there is one or not: `run.hdf` of `run.h5`. None for a file that has
/// this name itself.
pub(super) fn link(path: &Path) -> Option<PathBuf> {
    Some(path.with_extension(EXTENSION)).filter(|link| link != path)
}

/// The main file `path` is there: with fields a link leads to it, without any a link of an earlier run goes. What
/// somebody else has put under that name stays, and a file system without links is no reason to fail, as the main
/// file is complete without it.
pub(super) fn show(path: &Path, fields: bool) -> io::Result<()> {
    let (Some(link), Some(name)) = (link(path), path.file_name()) else { return Ok(()) };
    match fs::read_link(&link) {
        Ok(to) if to.as_os_str() == name => {
            if fields {
                return Ok(());
            }
            fs::remove_file(link)
        }
        Err(e) if e.kind() == io::ErrorKind::NotFound && fields => symlink(name, link),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_comes_and_goes_with_the_fields_and_nothing_else_is_touched() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        fs::write(at("run.h5"), "fields").expect("write");
        show(&at("run.h5"), false).expect("nothing to do");
        assert!(fs::symlink_metadata(at("run.hdf")).is_err());
        for _ in 0..2 {
            show(&at("run.h5"), true).expect("a link");
            assert_eq!(fs::read(at("run.hdf")).expect("leads there"), b"fields");
        }
        show(&at("run.h5"), false).expect("gone");
        assert!(fs::symlink_metadata(at("run.hdf")).is_err());
        fs::write(at("run.hdf"), "precious").expect("write");
        for fields in [true, false] {
            show(&at("run.h5"), fields).expect("left alone");
            assert_eq!(fs::read(at("run.hdf")).expect("still there"), b"precious");
        }
        fs::remove_file(at("run.hdf")).expect("removed");
        symlink("other.h5", at("run.hdf")).expect("a link of somebody else");
        for fields in [true, false] {
            show(&at("run.h5"), fields).expect("left alone");
            assert_eq!(fs::read_link(at("run.hdf")).expect("still there"), Path::new("other.h5"));
        }
        show(&at("own.hdf"), true).expect("a file of this name needs none");
        assert!(fs::symlink_metadata(at("own.hdf")).is_err());
    }
}
