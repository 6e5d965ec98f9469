//! Files that a run may replace: regular result files of this program, and nothing else.

use super::read::Reader;
use crate::{Error, Result};
use std::fs;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

/// The first bytes of an HDF5 file.
const SIGNATURE: [u8; 8] = *b"\x89HDF\r\n\x1a\n";

/// An error if something stands at `target` that a run must not replace: anything without `overwrite`; with it, what
/// is no regular file, and what is no result of this program.
pub(super) fn replaceable(target: &Path, overwrite: bool) -> Result<()> {
    let name = target.display();
    let Ok(found) = fs::symlink_metadata(target) else { return Ok(()) };
    let kind = found.file_type();
    let leads_to = || fs::metadata(target);
    if found.is_dir() || leads_to().is_ok_and(|m| m.is_dir()) {
        return Err(Error::Io(format!("cannot write {name}: it is a directory; name a file")));
    }
    let strange = match () {
        _ if kind.is_symlink() => {
            let to = fs::read_link(target).map(|t| format!(" to {}", t.display())).unwrap_or_default();
            Some(format!("a symbolic link{to}"))
        }
        _ if kind.is_fifo() => Some("a FIFO".into()),
        _ if kind.is_char_device() || kind.is_block_device() => Some("a device".into()),
        _ if kind.is_socket() => Some("a socket".into()),
        _ => None,
    };
    if let Some(strange) = strange {
        return Err(Error::Job(format!(
            "{name} is {strange}, expected a file or nothing; results do not replace it: remove it, or name \
             another --output"
        )));
    }
    if !overwrite {
        return Err(Error::Job(format!("{name} exists already; give --force to replace it, or another --output")));
    }
    match is_result(target)? {
        true => Ok(()),
        false => Err(Error::Job(format!(
            "{name} is no result file of this program, and --force replaces nothing else: remove it, or name \
             another --output"
        ))),
    }
}

/// Returns whether a regular file is a result of this program: an HDF5 file with provenance, or a sequence for
/// ParaView.
pub(crate) fn is_result(path: &Path) -> Result<bool> {
    use std::io::Read;
    let mut start = Vec::new();
    let read = fs::File::open(path).and_then(|f| f.take(SIGNATURE.len() as u64).read_to_end(&mut start));
    read.map_err(|e| Error::Io(format!("cannot read {}: {e}", path.display())))?;
    if start != SIGNATURE {
        return Ok(false);
    }
    let Ok(reader) = Reader::open(path) else { return Ok(false) };
    Ok(["/provenance/job", "/VTKHDF/Steps", "/reduced/version"].iter().any(|path| reader.has(path)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_results_of_this_program_are_replaced() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        replaceable(&at("none.h5"), false).expect("nothing stands there");
        fs::write(at("text.h5"), "precious").expect("write");
        fs::write(at("empty.h5"), "").expect("write");
        let other = hdf5::File::create(at("other.h5")).expect("a file");
        other.create_group("data").expect("a group");
        other.close().expect("closed");
        let own = hdf5::File::create(at("own.h5")).expect("a file");
        own.create_group("provenance").and_then(|g| g.new_dataset::<i8>().create("job")).expect("a dataset");
        own.close().expect("closed");
        std::os::unix::fs::symlink(at("own.h5"), at("link.h5")).expect("link");
        std::os::unix::fs::symlink(at("nowhere"), at("dangling.h5")).expect("link");
        let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
        rustix::fs::mknodat(rustix::fs::CWD, at("fifo.h5"), rustix::fs::FileType::Fifo, mode, 0).expect("a FIFO");
        let says = |name: &str, overwrite: bool| match replaceable(&at(name), overwrite) {
            Ok(()) => String::new(),
            Err(e) => {
                assert_eq!(e.exit_code(), 2, "{e}");
                e.to_string()
            }
        };
        assert_eq!(says("own.h5", true), "");
        for name in ["own.h5", "other.h5", "text.h5", "empty.h5"] {
            assert!(says(name, false).contains("--force"), "{}", says(name, false));
        }
        for name in ["other.h5", "text.h5", "empty.h5"] {
            assert!(says(name, true).contains("no result file of this program"), "{}", says(name, true));
        }
        for (name, what) in [("link.h5", "symbolic link"), ("dangling.h5", "nowhere"), ("fifo.h5", "FIFO")] {
            for overwrite in [false, true] {
                assert!(says(name, overwrite).contains(what), "{}", says(name, overwrite));
            }
        }
        assert!(replaceable(Path::new("/dev/null"), true).expect_err("a device").to_string().contains("a device"));
        assert_eq!(replaceable(folder.path(), true).expect_err("a folder").exit_code(), 6);
    }
}
