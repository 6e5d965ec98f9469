//! The group `/reduced`: the reduced model, for later runs whose bodies are the same.

use super::super::{sha256, Reader, Table, Values};
use crate::grid::Interface;
use crate::job::{differences, fe_inputs, Job};
use crate::model::{AtContact, ModalRotation, ModeName, ReducedModel, TraceModes};
use crate::{Error, Result};
use faer::Mat;
use serde_json::Value;
use std::path::Path;

/// Version of the group `/reduced`; since 2 with the SHA-256 of each dataset.
const VERSION: i64 = 2;

/// What the group `/reduced` holds beside the model.
#[derive(Debug, Clone, Default)]
pub struct Origin {
    /// Whether the upper body is the lower one's mirror image.
    pub alike: bool,
    /// Residuals of the modes of the lower and the upper body.
    pub residual: [Vec<f64>; 2],
}

/// On rank 0: the group `/reduced` of the `model`.
pub fn tables(job: &Job, origin: &Origin, model: &ReducedModel) -> Result<Vec<Table>> {
    let s = &model.interface;
    let alike = origin.alike;
    let inputs = summed_inputs(job)?.to_string();
    let mut tables = vec![
        Table::scalar("/reduced/version", "-", "Version of this group.", VERSION),
        Table::scalar("/reduced/inputs", "-", "What of the job the reduced model depends on, JSON.", inputs.as_str()),
        Table::list("/reduced/x", "m", "Longitudinal positions of the grid lines.", s.x.clone()),
        Table::list("/reduced/y", "m", "Lateral positions of the grid lines.", s.y.clone()),
        Table::list("/reduced/gap", "m", "Gap of the undeformed bodies at each node.", s.gap.clone()),
        Table::scalar("/reduced/alike", "-", "1 if the upper body is the lower one's mirror image.", i8::from(alike)),
    ];
    for (i, name) in ["lower", "upper"].into_iter().enumerate().take(if alike { 1 } else { 2 }) {
        let body = &model.bodies[model.place[i]];
        let compliance = model.at_rest[model.place[i]].as_ref().unwrap_or(&body.compliance);
        let path = |what: &str| format!("/reduced/{name}/{what}");
        let (rows, count) = body.contact_modes.shape();
        let residual = origin.residual[i].clone();
        let by_rows = |m: &Mat<f64>| -> Vec<f64> {
            (0..m.nrows()).flat_map(|i| (0..m.ncols()).map(move |j| m[(i, j)])).collect()
        };
        if body.reach.is_finite() && body.omega.last().is_some_and(|last| body.reach > *last) {
            let text = "Angular frequency up to which the modes are known, beyond the last one.";
            tables.push(Table::list(&path("reach"), "rad/s", text, vec![body.reach]));
        }
        let text = "Angular frequencies of the free-interface modes, ascending.";
        tables.push(Table::list(&path("omega"), "rad/s", text, body.omega.clone()));
        tables.push(Table::list(&path("residual"), "1", "Relative residual of each mode.", residual));
        let text = "Mass-normalised modes at the contact rows 3i + c, c = x, y, n into the body, in lower form.";
        tables.push(Table::new(&path("contact_modes"), "kg^-1/2", text, &[rows, count], by_rows(&body.contact_modes)));
        let text = "Static compliance of the contact rows, in lower form.";
        tables.push(Table::new(&path("compliance"), "m/N", text, &[rows, rows], by_rows(compliance)));
        if !body.names.is_empty() {
            let orders: Vec<i64> = body.names.iter().map(|n| i64::from(n.order)).collect();
            tables.push(Table::list(
                &path("order"),
                "1",
                "Nodal diameters of each mode, or waves on its length.",
                orders,
            ));
            let families: Vec<String> = body.names.iter().map(|n| n.family.clone()).collect();
            tables.push(Table::list(&path("family"), "-", "What of each mode moves most.", families));
        }
        if let Some(own) = &model.own[i] {
            let text = "Damping matrix of the modes that the body brings itself.";
            tables.push(Table::new(&path("damping"), "1/s", text, &[count, count], by_rows(&own.full())));
        }
        if let Some(rotation) = &model.rotation[i] {
            let mut modal = |what: &str, units: &str, text: &str, matrix: &Mat<f64>| {
                tables.push(Table::new(&path(what), units, text, &[count, count], by_rows(matrix)));
            };
            modal("gyroscopic", "1/s", "Gyroscopic matrix of the modes at 1 rad/s, skew.", &rotation.gyroscopic);
            let text =
                "Stiffness by centrifugal prestress less that of the convected velocity, of the modes at 1 rad/s.";
            modal("rotation_stiffness", "1/s^2", text, &rotation.stiffness);
            modal("derivative", "1/s", "Derivative of the modes along the angle, at 1 rad/s.", &rotation.derivative);
        }
    }
    Ok(tables.into_iter().map(Table::summed).collect())
}

/// A reduced model from an earlier run.
pub struct Reused {
    /// The model.
    pub model: ReducedModel,
    /// Frequencies, Hz, and residuals of the modes of the lower and the upper body.
    pub modes: [(Vec<f64>, Vec<f64>); 2],
    /// Where it came from.
    pub origin: Origin,
}

/// On rank 0: the reduced model that a file holds, for a job that can make use of it.
pub fn load(reader: &Reader, job: &Job) -> Result<Reused> {
    let name = reader.path().display();
    if !reader.has("/reduced/version") {
        return Err(Error::Input(format!(
            "{name}: has no reduced model; it is written by runs with a contact of finite elements and output.reduced = true"
        )));
    }
    let integer = |path: &str| match reader.verified(path)?.1 {
        Values::I64(v) if v.len() == 1 => Ok(v[0]),
        Values::I8(v) if v.len() == 1 => Ok(i64::from(v[0])),
        _ => Err(Error::Input(format!("{name}: {path} is not one whole number"))),
    };
    // That of version 1 has no checksum yet.
    let version = match reader.read("/reduced/version")?.1 {
        Values::I64(v) if v[..] == [1] => 1,
        _ => integer("/reduced/version")?,
    };
    if version != VERSION {
        return Err(Error::Input(format!(
            "{name}: its reduced model has version {version}, this program reads {VERSION}; make the file again"
        )));
    }
    let text = reader.verified_text("/reduced/inputs")?;
    let stored: Value = serde_json::from_str(&text)
        .map_err(|e| Error::Input(format!("{name}: /reduced/inputs is no JSON ({e}); make the file again")))?;
    let mut wanted = summed_inputs(job)?;
    let mut stored = stored;
    if job.analyses.modes.is_none() {
        // Modes that are not asked for do no harm: they are left out.
        for inputs in [&mut wanted, &mut stored] {
            inputs["analyses"] = Value::Null;
        }
    }
    let differing: Vec<String> = differences(&stored, &wanted).iter().map(|d| d.to_string()).collect();
    if !differing.is_empty() {
        return Err(Error::Job(format!(
            "--reuse {name}: it is of another job; what differs: {}. Run without --reuse",
            differing.join(", ")
        )));
    }
    let line = |path: &str| reader.verified_numbers(path).map(|(_, v)| v);
    let interface = Interface::new(line("/reduced/x")?, line("/reduced/y")?, line("/reduced/gap")?)
        .map_err(|e| Error::Input(format!("{name}: {}", e.message())))?;
    let rows = 3 * interface.len();
    let sized = |path: &str, rows: usize, columns: usize| -> Result<Mat<f64>> {
        let (shape, v) = reader.verified_numbers(path)?;
        if shape != [rows, columns] {
            return Err(Error::Input(format!(
                "{name}: {path} has the shape {shape:?}, expected {:?}",
                [rows, columns]
            )));
        }
        Ok(Mat::from_fn(rows, columns, |i, j| v[i * columns + j]))
    };
    let matrix = |path: &str, columns: usize| sized(path, rows, columns);
    let square = |path: &str, order: usize| sized(path, order, order);
    let alike = integer("/reduced/alike")? == 1;
    let mut parts = Vec::new();
    let mut modes = Vec::new();
    for place in ["lower", "upper"].into_iter().take(if alike { 1 } else { 2 }) {
        let path = |what: &str| format!("/reduced/{place}/{what}");
        let omega = line(&path("omega"))?;
        let (contact_modes, compliance) =
            (matrix(&path("contact_modes"), omega.len())?, matrix(&path("compliance"), rows)?);
        let frequency = omega.iter().map(|w| w / (2.0 * std::f64::consts::PI)).collect();
        modes.push((frequency, line(&path("residual"))?));
        parts.push(match job.analyses.modes {
            Some(_) => {
                let last = omega.last().copied().unwrap_or(0.0);
                let reach = match reader.has(&path("reach")) {
                    true => line(&path("reach"))?.first().copied().unwrap_or(last),
                    false => last,
                };
                let rotation = match reader.has(&path("gyroscopic")) {
                    true => {
                        let modal = |what: &str| square(&path(what), omega.len());
                        let (gyroscopic, stiffness) = (modal("gyroscopic")?, modal("rotation_stiffness")?);
                        Some(ModalRotation { gyroscopic, stiffness, derivative: modal("derivative")? })
                    }
                    false => None,
                };
                let damping = match reader.has(&path("damping")) {
                    true => Some(square(&path("damping"), omega.len())?),
                    false => None,
                };
                let names = names(reader, &path)?;
                let rows = Some(contact_modes);
                AtContact {
                    modes: TraceModes { omega, reach, rows, damping, rotation, names, ..TraceModes::default() },
                    compliance,
                }
            }
            None => AtContact::statics(compliance),
        });
    }
    if alike {
        modes.push(modes[0].clone());
    }
    let place = if alike { [0, 0] } else { [0, 1] };
    let model = ReducedModel::assemble(job, interface, parts, place)?;
    let modes: [(Vec<f64>, Vec<f64>); 2] =
        modes.try_into().map_err(|_| Error::Defect("modes of other than two bodies".into()))?;
    let origin = Origin { alike, residual: [modes[0].1.clone(), modes[1].1.clone()] };
    Ok(Reused { model, modes, origin })
}

/// What the modes of a body are called; `path` names its datasets.
fn names(reader: &Reader, path: &dyn Fn(&str) -> String) -> Result<Vec<ModeName>> {
    if !reader.has(&path("order")) {
        return Ok(Vec::new());
    }
    let wrong =
        |what: &str| Error::Input(format!("{}: {} is not a list as expected", reader.path().display(), path(what)));
    match (reader.verified(&path("order"))?.1, reader.verified(&path("family"))?.1) {
        (Values::I64(orders), Values::Text(families)) if orders.len() == families.len() => {
            let name = |(order, family): (i64, String)| ModeName { order: u32::try_from(order).unwrap_or(0), family };
            Ok(orders.into_iter().zip(families).map(name).collect())
        }
        _ => Err(wrong("order")),
    }
}

/// What the reduced model depends on, with the contents of mesh files in place of their paths.
fn summed_inputs(job: &Job) -> Result<Value> {
    let mut inputs = fe_inputs(job);
    for place in ["lower", "upper"] {
        let Some(file) = inputs.pointer_mut(&format!("/bodies/{place}/mesh/file")) else { continue };
        let sum = sha256(Path::new(file.as_str().unwrap_or_default()))?;
        *file = Value::String(format!("sha256 {sum}"));
    }
    Ok(inputs)
}
