//! The group `/reduced`: the reduced model, for later runs whose bodies are the same.

use super::super::{sha256, Reader, Table, Values};
use crate::grid::Interface;
use crate::job::{differences, fe_inputs, Job};
use crate::model::{
    ContactFunctions, ContactTrace, HalfSpace, Lines, ModalRotation, ModeLabel, NearPair, ReducedModel, TraceModes,
    LOADS,
};
use crate::{Error, Result};
use faer::Mat;
use serde_json::Value;
use std::path::Path;

/// Version of the group `/reduced`; since 2 with the SHA-256 of each dataset.
const VERSION: i64 = 3;
/// The same of a group that keeps the contact rows as few numbers.
const OF_FUNCTIONS: i64 = 4;
/// The same where contacts act on each other through one half-space.
const OF_NEAR_CONTACTS: i64 = 5;
/// The same with the angle between their normals.
const OF_BENT_SURFACES: i64 = 6;

/// Contents of the group `/reduced` beside the model.
#[derive(Debug, Clone, Default)]
pub struct Origin {
    /// True if the upper body is the lower one's mirror image.
    pub alike: bool,
    /// Residuals of the modes of the lower and the upper body.
    pub residual: [Vec<f64>; 2],
    /// Contact rows of the lower and the upper body, where few numbers are kept in place of matrices.
    pub functions: [Option<ContactFunctions>; 2],
}

/// Dataset by which a file says that its group `/reduced` holds the modes alone.
const ALONE: &str = "/reduced/alone";

/// On rank 0: the group `/reduced` of the `model`.
pub fn tables(job: &Job, origin: &Origin, model: &ReducedModel) -> Result<Vec<Table>> {
    let s = &model.interface;
    let few = || origin.functions.iter().flatten();
    let version = match few().any(|of| !of.near.is_empty()) {
        true => OF_BENT_SURFACES,
        false if few().next().is_some() => OF_FUNCTIONS,
        false => VERSION,
    };
    let mut tables = head(job, origin.alike, version)?;
    for (number, patch) in s.patches.iter().enumerate() {
        let [x, y] = lines_of(number);
        tables.push(Table::list(&x, "m", "Longitudinal positions of the grid lines.", patch.x.clone()));
        tables.push(Table::list(&y, "m", "Lateral positions of the grid lines.", patch.y.clone()));
    }
    tables.push(Table::list("/reduced/gap", "m", "Gap of the undeformed bodies at each node.", s.gap.clone()));
    for (i, name) in ["lower", "upper"].into_iter().enumerate().take(if origin.alike { 1 } else { 2 }) {
        let body = &model.bodies[model.place[i]];
        let known = Known {
            omega: &body.omega,
            reach: body.reach,
            residual: &origin.residual[i],
            rows: origin.functions[i].is_none().then_some(&body.contact_modes),
            names: &body.names,
            damping: model.own[i].matrix.as_ref().map(|own| own.full()),
            springs: &model.own[i].springs,
            rotation: model.rotation[i].as_ref(),
        };
        tables.extend(known.tables(name));
        if let Some(functions) = &origin.functions[i] {
            tables.extend(of_functions(name, functions));
            continue;
        }
        let compliance = model.at_rest[model.place[i]].as_ref().unwrap_or(&body.compliance);
        let (path, text) =
            (format!("/reduced/{name}/compliance"), "Static compliance of the contact rows, in lower form.");
        let rows = compliance.nrows();
        tables.push(Table::new(&path, "m/N", text, &[rows, rows], by_rows(compliance)));
    }
    Ok(tables.into_iter().map(Table::summed).collect())
}

/// On rank 0: the same without compliance, of the `modes` of the bodies that differ.
pub fn tables_of_modes(job: &Job, alike: bool, modes: &[TraceModes]) -> Result<Vec<Table>> {
    let mut tables = head(job, alike, VERSION)?;
    tables.push(Table::scalar(ALONE, "-", "Contents of the group, where it does not hold all.", "modes"));
    for (name, found) in ["lower", "upper"].into_iter().zip(modes) {
        let rows =
            found.rows.as_ref().ok_or_else(|| Error::Defect("modes are kept without the contact's rows".into()))?;
        let TraceModes { omega, residual, names, damping, springs, rotation, reach, .. } = found;
        let (damping, rotation) = (damping.clone(), rotation.as_ref());
        let (reach, rows) = (*reach, Some(rows));
        tables.extend(Known { omega, residual, names, damping, springs, rotation, reach, rows }.tables(name));
    }
    Ok(tables.into_iter().map(Table::summed).collect())
}

/// Contact rows of the body in one place as few numbers.
fn of_functions(place: &str, of: &ContactFunctions) -> Vec<Table> {
    let path = |what: &str| format!("/reduced/{place}/{what}");
    let (order, count) = of.seen.shape();
    let HalfSpace { young, poisson } = of.half_space;
    let beside = "Compliance beside the half-spaces between the functions of all contacts, nine each: (1, x, y) times \
                  the directions x, y, n.";
    let seen = "Amplitudes of these functions in the mass-normalised modes, in lower form.";
    let mut tables = vec![
        Table::scalar(&path("young"), "Pa", "Young's modulus of the half-space at each contact.", young),
        Table::scalar(&path("poisson"), "1", "Poisson's ratio of the half-space at each contact.", poisson),
        Table::new(&path("function_compliance"), "m/N", beside, &[order, order], by_rows(&of.constant)),
        Table::new(&path("function_modes"), "kg^-1/2", seen, &[order, count], by_rows(&of.seen)),
    ];
    if !of.near.is_empty() {
        let text = "Pairs of contacts that act on each other through one half-space: their numbers from 0, the place \
                    of the second one from the first along x and y, m, and its angle against the first about x, rad.";
        let numbers = |&NearPair { contacts: [c, d], apart: [x, y], bend }: &NearPair| [c as f64, d as f64, x, y, bend];
        let pairs = of.near.iter().flat_map(numbers);
        tables.push(Table::new(
            &path("near_contacts"),
            "1, 1, m, m, rad",
            text,
            &[of.near.len(), 5],
            pairs.collect::<Vec<f64>>(),
        ));
    }
    tables
}

/// Datasets of the grid lines of the contact `number`, from 0.
fn lines_of(number: usize) -> [String; 2] {
    ["x", "y"].map(|axis| match number {
        0 => format!("/reduced/{axis}"),
        _ => format!("/reduced/{axis}_{}", number + 1),
    })
}

/// The interface of the contacts whose grid lines a file holds; `line` reads a dataset.
fn interface(reader: &Reader, line: &dyn Fn(&str) -> Result<Vec<f64>>) -> Result<Interface> {
    let name = reader.path().display();
    let gap = line("/reduced/gap")?;
    let (mut parts, mut first) = (Vec::new(), 0);
    for [x, y] in (0..).map(lines_of).take_while(|[x, _]| reader.has(x)) {
        let (x, y) = (line(&x)?, line(&y)?);
        let last = (first + x.len() * y.len()).min(gap.len());
        let part = Interface::new(x, y, gap[first..last].to_vec());
        parts.push(part.map_err(|e| Error::Input(format!("{name}: {}", e.message())))?);
        first = last;
    }
    if parts.is_empty() || first != gap.len() {
        let found = gap.len();
        return Err(Error::Input(format!("{name}: /reduced/gap: found {found} values, expected one a node, {first}")));
    }
    Interface::joined(parts)
}

/// Tables at the beginning of both.
fn head(job: &Job, alike: bool, version: i64) -> Result<Vec<Table>> {
    let inputs = summed_inputs(job)?.to_string();
    Ok(vec![
        Table::scalar("/reduced/version", "-", "Version of this group.", version),
        Table::scalar(
            "/reduced/inputs",
            "-",
            "Part of the job that the reduced model depends on, JSON.",
            inputs.as_str(),
        ),
        Table::scalar("/reduced/alike", "-", "1 if the upper body is the lower one's mirror image.", i8::from(alike)),
    ])
}

fn by_rows(m: &Mat<f64>) -> Vec<f64> {
    // Room for all of it at once: a vector that grows takes up to twice as much.
    let mut rows = Vec::with_capacity(m.nrows() * m.ncols());
    (0..m.nrows()).for_each(|i| rows.extend((0..m.ncols()).map(|j| m[(i, j)])));
    rows
}

/// Known data of the modes of a body; see [`TraceModes`].
struct Known<'a> {
    omega: &'a [f64],
    reach: f64,
    residual: &'a [f64],
    /// None where few numbers stand for them.
    rows: Option<&'a Mat<f64>>,
    names: &'a [ModeLabel],
    damping: Option<Mat<f64>>,
    springs: &'a [f64],
    rotation: Option<&'a ModalRotation>,
}

impl Known<'_> {
    /// The datasets of the body in one place.
    fn tables(&self, place: &str) -> Vec<Table> {
        let path = |what: &str| format!("/reduced/{place}/{what}");
        let count = self.omega.len();
        let mut tables = Vec::new();
        if self.reach.is_finite() && self.omega.last().is_none_or(|last| self.reach > *last) {
            let text = "Angular frequency up to which the modes are known, beyond the last one.";
            tables.push(Table::list(&path("reach"), "rad/s", text, vec![self.reach]));
        }
        let text = "Angular frequencies of the free-interface modes, ascending.";
        tables.push(Table::list(&path("omega"), "rad/s", text, self.omega.to_vec()));
        tables.push(Table::list(&path("residual"), "1", "Relative residual of each mode.", self.residual.to_vec()));
        if let Some(rows) = self.rows {
            let text = "Mass-normalised modes at the contact rows 3i + c, c = x, y, n into the body, in lower form.";
            let shape = [rows.nrows(), rows.ncols()];
            tables.push(Table::new(&path("contact_modes"), "kg^-1/2", text, &shape, by_rows(rows)));
        }
        if !self.names.is_empty() {
            let orders: Vec<i64> = self.names.iter().map(|n| i64::from(n.order)).collect();
            let text = "Nodal diameters of each mode, or waves on its length.";
            tables.push(Table::list(&path("order"), "1", text, orders));
            let families: Vec<String> = self.names.iter().map(|n| n.family.clone()).collect();
            tables.push(Table::list(&path("family"), "-", "Part of the body that moves most in each mode.", families));
        }
        if !self.springs.is_empty() {
            let text = "Twice the energy of each mode in springs that have a loss factor of their own, over the \
             square of its amplitude.";
            tables.push(Table::list(&path("springs"), "1/s^2", text, self.springs.to_vec()));
        }
        let mut modal = |what: &str, units: &str, text: &str, matrix: &Mat<f64>| {
            tables.push(Table::new(&path(what), units, text, &[count, count], by_rows(matrix)));
        };
        if let Some(own) = &self.damping {
            modal("damping", "1/s", "Damping matrix of the modes that the body brings itself.", own);
        }
        if let Some(rotation) = self.rotation {
            modal("gyroscopic", "1/s", "Gyroscopic matrix of the modes at 1 rad/s, skew.", &rotation.gyroscopic);
            let text =
                "Stiffness by centrifugal prestress less that of the convected velocity, of the modes at 1 rad/s.";
            modal("rotation_stiffness", "1/s^2", text, &rotation.stiffness);
            modal("derivative", "1/s", "Derivative of the modes along the angle, at 1 rad/s.", &rotation.derivative);
        }
        tables
    }
}

/// A reduced model from an earlier run.
pub struct ReusedModel {
    /// The model; none where the file has the modes alone.
    pub model: Option<ReducedModel>,
    /// The modes of the bodies that differ.
    pub modes: Vec<TraceModes>,
    /// Origin of the model.
    pub origin: Origin,
}

/// Returns whether a file holds the modes alone, of a run that ended before the compliance was made.
pub fn of_modes_alone(reader: &Reader) -> bool {
    reader.has(ALONE)
}

/// On rank 0: the reduced model that a file holds, for a job that can make use of it.
pub fn load(reader: &Reader, job: &Job) -> Result<ReusedModel> {
    let name = reader.path().display();
    if !reader.has("/reduced/version") {
        return Err(Error::Input(format!(
            "{name}: has no reduced model; it is written by runs with a contact of finite elements and \
             output.reduced = true"
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
    if ![VERSION, OF_FUNCTIONS, OF_NEAR_CONTACTS, OF_BENT_SURFACES].contains(&version) {
        return Err(Error::Input(format!(
            "{name}: its reduced model has version {version}, this program reads {VERSION} to {OF_BENT_SURFACES}; make \
             the file again"
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
    let alone = of_modes_alone(reader) && reader.verified_text(ALONE)? == "modes";
    let interface = match alone {
        true => None,
        false => Some(interface(reader, &line)?),
    };
    let sized = |path: &str, rows: Option<usize>, columns: usize| -> Result<Mat<f64>> {
        let (shape, v) = reader.verified_numbers(path)?;
        let rows = rows.or(shape.first().copied()).unwrap_or(0);
        if shape != [rows, columns] {
            return Err(Error::Input(format!(
                "{name}: {path} has the shape {shape:?}, expected {:?}",
                [rows, columns]
            )));
        }
        Ok(Mat::from_fn(rows, columns, |i, j| v[i * columns + j]))
    };
    let rows = interface.as_ref().map(|s| 3 * s.len());
    let square = |path: &str, order: usize| sized(path, Some(order), order);
    let alike = integer("/reduced/alike")? == 1;
    let lines = |s: &Interface| s.patches.iter().map(|p| [p.x.clone(), p.y.clone()]).collect::<Vec<Lines>>();
    let grids = interface.as_ref().map(lines).unwrap_or_default();
    let mut functions = [None, None];
    let (mut modes, mut compliances) = (Vec::new(), Vec::new());
    for (i, place) in ["lower", "upper"].into_iter().enumerate().take(if alike { 1 } else { 2 }) {
        let path = |what: &str| format!("/reduced/{place}/{what}");
        let omega = line(&path("omega"))?;
        let residual = line(&path("residual"))?;
        let contact_modes = match reader.has(&path("function_modes")) {
            true => {
                let order = LOADS * grids.len();
                let seen = sized(&path("function_modes"), Some(order), omega.len())?;
                let constant = square(&path("function_compliance"), order)?;
                let one = |what: &str| match line(&path(what))?[..] {
                    [value] => Ok(value),
                    _ => Err(Error::Input(format!("{name}: {}: expected one number", path(what)))),
                };
                let half_space = HalfSpace { young: one("young")?, poisson: one("poisson")? };
                let pairs = match reader.has(&path("near_contacts")) {
                    true => line(&path("near_contacts"))?,
                    false => Vec::new(),
                };
                let columns = if version < OF_BENT_SURFACES { 4 } else { 5 };
                let pair = |v: &[f64]| NearPair {
                    contacts: [v[0] as usize, v[1] as usize],
                    apart: [v[2], v[3]],
                    bend: v.get(4).copied().unwrap_or(0.0),
                };
                let near: Vec<NearPair> = pairs.chunks_exact(columns).map(pair).collect();
                let is_pair = |pair: &NearPair| pair.contacts[0] < pair.contacts[1] && pair.contacts[1] < grids.len();
                if pairs.len() % columns != 0 || pairs.iter().any(|v| !v.is_finite()) || !near.iter().all(is_pair) {
                    return Err(Error::Input(format!(
                        "{name}: {}: expected pairs of the {} contacts",
                        path("near_contacts"),
                        grids.len()
                    )));
                }
                let few = ContactFunctions { half_space, near, constant, seen };
                let (compliance, contact_modes) = few.on_grids(&grids)?;
                compliances.push(compliance);
                functions[i] = Some(few);
                contact_modes
            }
            false => {
                if let Some(rows) = rows {
                    compliances.push(square(&path("compliance"), rows)?);
                }
                sized(&path("contact_modes"), rows, omega.len())?
            }
        };
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
        let springs = match reader.has(&path("springs")) {
            true => {
                let springs = line(&path("springs"))?;
                if springs.len() != omega.len() {
                    let found = springs.len();
                    return Err(Error::Input(format!(
                        "{name}: {} has {found} values, expected {}, one a mode",
                        path("springs"),
                        omega.len()
                    )));
                }
                springs
            }
            false => Vec::new(),
        };
        let names = names(reader, &path)?;
        let rows = Some(contact_modes);
        modes.push(TraceModes {
            omega,
            residual,
            reach,
            rows,
            damping,
            springs,
            rotation,
            names,
            ..TraceModes::default()
        });
    }
    let residual = |i: usize| modes[i.min(modes.len() - 1)].residual.clone();
    let origin = Origin { alike, residual: [residual(0), residual(1)], functions };
    let model = match interface {
        Some(interface) => {
            let part = |(modes, compliance): (&TraceModes, Mat<f64>)| match job.analyses.modes {
                Some(_) => ContactTrace { modes: modes.clone(), compliance },
                None => ContactTrace::statics(compliance),
            };
            let parts = modes.iter().zip(compliances).map(part).collect();
            Some(ReducedModel::assemble(job, interface, parts, if alike { [0, 0] } else { [0, 1] })?)
        }
        None => None,
    };
    Ok(ReusedModel { model, modes, origin })
}

/// Names of the modes of a body; `path` names its datasets.
fn names(reader: &Reader, path: &dyn Fn(&str) -> String) -> Result<Vec<ModeLabel>> {
    if !reader.has(&path("order")) {
        return Ok(Vec::new());
    }
    let wrong =
        |what: &str| Error::Input(format!("{}: {} is not a list as expected", reader.path().display(), path(what)));
    match (reader.verified(&path("order"))?.1, reader.verified(&path("family"))?.1) {
        (Values::I64(orders), Values::Text(families)) if orders.len() == families.len() => {
            let name = |(order, family): (i64, String)| ModeLabel { order: u32::try_from(order).unwrap_or(0), family };
            Ok(orders.into_iter().zip(families).map(name).collect())
        }
        _ => Err(wrong("order")),
    }
}

/// Inputs that the reduced model depends on, with the contents of mesh files in place of their paths.
fn summed_inputs(job: &Job) -> Result<Value> {
    let mut inputs = fe_inputs(job);
    for place in ["lower", "upper"] {
        let at = format!("/bodies/{place}/mesh/file");
        // With more than its path it is an object.
        let path = if inputs.pointer(&at).is_some_and(Value::is_object) { format!("{at}/path") } else { at };
        let Some(file) = inputs.pointer_mut(&path) else { continue };
        let sum = sha256(Path::new(file.as_str().unwrap_or_default()))?;
        *file = Value::String(format!("sha256 {sum}"));
    }
    Ok(inputs)
}
