//! The reduced model in the first segment of a run. Modes computed again have other signs, a pair of equal
//! frequencies other directions, and on several ranks the factorisations add in another order: a run is continued
//! with the model that it was begun with.

use crate::analysis::reduction::Reduction;
use crate::body::align::{alignment, apply_alignment};
use crate::body::fe::BodyModes;
use crate::case::bodies::BuiltBodies;
use crate::job::Job;
use crate::output::datasets::reduced::{load, ReusedModel};
use crate::output::Segments;
use crate::parallel::World;
use crate::{Error, Result};

/// On rank 0: the model that the run was begun with.
pub fn read(segments: &Segments, job: &Job) -> Result<ReusedModel> {
    load(&segments.open_first()?, job).map_err(|e| e.context("--resume"))
}

/// Collective: turns the mode shapes, computed again, into those of the model that was kept: each cluster of equal
/// frequencies by the orthogonal matrix that brings their motion of the contact nearest to the one kept (P. H.
/// Schönemann, *Psychometrika* 31 (1966)).
pub fn align(world: &World, bodies: &mut BuiltBodies, kept: &Reduction) -> Result<()> {
    let BuiltBodies { places, unique } = bodies;
    for (i, body) in unique.iter_mut().enumerate() {
        let name = body.name().to_owned();
        if body.shapes().is_none() {
            continue;
        }
        let Some(fields) = body.fields_mut() else { continue };
        let now = fields.contact_modes()?;
        let rotation = world.on_root(|| {
            let root = kept.root()?;
            let place = places.iter().find(|p| p.body == i).map(|p| p.side.index());
            let there = place.and_then(|p| root.bodies.get(root.place[p]));
            let (Some(now), Some(there)) = (now, there) else {
                return Err(Error::Defect("the modes of a body are missing".into()));
            };
            alignment(now.as_ref(), there.contact_modes.as_ref(), &there.omega).map_err(|e| {
                Error::Input(format!(
                    "--resume: the modes of body \"{}\" are not those that the run was begun with: {e}",
                    name
                ))
            })
        })?;
        let rotation = world.broadcast(rotation.unwrap_or_default());
        let shapes =
            fields.replace_shapes(None).map(|s| BodyModes { vectors: apply_alignment(&s.vectors, &rotation), ..s });
        fields.replace_shapes(shapes);
    }
    Ok(())
}
