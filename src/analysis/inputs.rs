//! Inputs of a run are never its outputs.

use super::RunOptions;
use crate::analysis::reuse;
use crate::job::{Job, MeshSource, Profile};
use crate::output::{companion, outputs, MODEL, SHAPES};
use crate::{Error, Result};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Every file that the run reads, and what it is.
fn inputs(job: &Job, options: &RunOptions) -> Vec<(String, PathBuf)> {
    let mut all: Vec<(String, PathBuf)> =
        options.job.iter().map(|file| ("the job file".to_owned(), file.clone())).collect();
    if let Some(file) = &options.reuse {
        all.push(("the file of --reuse".into(), file.clone()));
        all.push(("the mode shapes that go with the file of --reuse".into(), reuse::shapes::file(file)));
    }
    for (k, start) in job.analyses.cycles.iter().flat_map(|c| c.starts.results.iter().enumerate()) {
        all.push((format!("analyses.cycles.starts.results[{k}].file"), start.file.clone()));
    }
    let points = job.sweep.as_ref().map(|s| s.points.iter()).into_iter().flatten();
    for job in std::iter::once(job).chain(points) {
        for (name, body) in job.all_bodies() {
            if let Some(MeshSource::File(file)) = &body.mesh {
                all.push((format!("bodies.{name}.mesh.file"), file.path().clone()));
            }
            if let Some((key, file)) = body.section_file() {
                all.push((format!("bodies.{name}.{key}"), file.to_owned()));
            }
            if let Some(Profile::File(file)) = &body.profile {
                all.push((format!("bodies.{name}.profile.file"), file.path.clone()));
            }
            if let Some(m) = &body.matrices {
                all.extend(m.files().into_iter().map(|(key, f)| (format!("bodies.{name}.matrices.{key}"), f)));
            }
        }
        let rough = job.contact.as_ref().and_then(|c| c.roughness.as_ref());
        all.extend(rough.into_iter().flat_map(|r| r.files()).map(|(key, file)| (key, file.clone())));
    }
    all
}

/// On rank 0: `Error::Job` if a file or folder that the run would write is one that it reads, under whatever name.
pub fn refuse_overwriting_inputs(job: &Job, options: &RunOptions) -> Result<()> {
    let (files, folder) = outputs(&options.output);
    let identity = |path: &Path| std::fs::metadata(path).ok().map(|m| (m.dev(), m.ino()));
    // What a run that failed has left may be taken up by the next one with the same output.
    let left = [MODEL, SHAPES].map(|suffix| companion(&options.output, suffix));
    let files = files.into_iter().filter(|f| options.reuse.is_none() || !left.contains(f)).collect::<Vec<_>>();
    let written: Vec<_> = files.iter().filter_map(|f| Some((f, identity(f)?))).collect();
    let place = identity(&folder);
    for (what, input) in inputs(job, options) {
        let Some(read) = identity(&input) else { continue };
        let clash = written.iter().find(|(_, id)| *id == read).map(|(f, _)| f.display());
        // A segment of an earlier run would go when the steps begin.
        let inside = || place.is_some() && input.parent().and_then(identity) == place;
        let clash = clash.or_else(|| inside().then(|| folder.display()));
        if let Some(target) = clash {
            return Err(Error::Job(format!(
                "--output: {target} would be replaced, but it is an input of this run, {what} ({}); name \
                 another --output",
                input.display()
            )));
        }
    }
    Ok(())
}
