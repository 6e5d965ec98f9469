//! The analysis `curving`: equilibrium of the vehicle in its curve, tables under `/curving`.

use super::run::Run;
use crate::case::curving::CurvingVehicle;
use crate::Result;

/// Collective: the equilibrium of the vehicle in the curve of the job, and at the radii of `analyses.curving`.
pub fn run(run: &mut Run) -> Result<()> {
    if run.job.curve.is_none() {
        return Ok(());
    }
    run.progress.stage("steady curving");
    let job = run.job;
    let found = run.world().on_root(|| {
        let curving = CurvingVehicle::from_job(job)?;
        let tables = curving.tables(job)?;
        Ok((curving, tables))
    })?;
    if let Some((curving, tables)) = found {
        curving.lines().into_iter().for_each(|line| run.summary.line(line));
        run.warn(curving.warnings(job));
        run.file.tables(tables);
    }
    Ok(())
}
