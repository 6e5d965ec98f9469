//! The analysis `modes`: free-interface modes of each body.

use super::bodies::Bodies;
use super::report::Summary;
use super::RunOptions;
use crate::body::modes::{compute, Extent};
use crate::body::statics::Statics;
use crate::job::ModesExtent;
use crate::output::{ResultFile, Table};
use crate::parallel::World;
use crate::progress::Progress;
use crate::Result;

/// Collective: modes of every unique body, written for every place.
#[allow(clippy::too_many_arguments)]
pub fn run(
    world: &World,
    bodies: &Bodies,
    solvers: &mut [Statics],
    extent: ModesExtent,
    _options: &RunOptions,
    file: &mut ResultFile,
    progress: &mut Progress,
    summary: &mut Summary,
) -> Result<()> {
    let extent = match extent {
        ModesExtent::Count(n) => Extent::Count(n),
        ModesExtent::MaxFrequency(f) => Extent::MaxFrequency(f),
    };
    for (index, (body, solver)) in bodies.unique.iter().zip(solvers).enumerate() {
        progress.stage(format!("modes, body {}", body.name));
        let modes = compute(world, body, solver, extent)?;
        let frequency = modes.frequency();
        let rigid = modes.omega.iter().filter(|&&w| w == 0.0).count();
        for place in bodies.places.iter().filter(|p| p.body == index) {
            let at = format!("/modes/{}", place.name);
            file.tables([
                Table::list(&format!("{at}/frequency"), "Hz", "Frequencies of the free-interface modes, ascending; 0: rigid body.", frequency.clone()),
                Table::list(&format!("{at}/residual"), "1", "Relative residual of each mode.", modes.residual.clone()),
            ]);
        }
        let elastic: Vec<String> = frequency.iter().filter(|&&f| f > 0.0).take(10).map(|f| format!("{f:.2}")).collect();
        summary.value(&format!("modes of {}", body.name), format!("{} ({rigid} rigid), lowest {} Hz", frequency.len(), elastic.join(" ")));
        let worst = modes.residual.iter().copied().fold(0.0, f64::max);
        summary.value("  largest residual", format!("{worst:.1e}"));
    }
    Ok(())
}
