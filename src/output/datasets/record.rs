//! Values recorded of the steps until the next segment is written.

use super::super::values::{CHUNK_BYTES, CHUNK_LEAST};
use super::super::{Table, Values};
use super::points::Points;
use crate::grid::{ContactPatch, Interface};
use crate::job;
use crate::model::{CoupledModel, ReducedModel};
use crate::transient::Stepper;

/// Group of the segments from which the motion of the bodies is made; it does not become part of the main file.
pub const BODIES: &str = "/bodies";
/// Group of the segments from which the sound is made; it does not become part of the main file.
pub const SOUND: &str = "/sound";

/// Group of the contact `number`, from 0: that of the first one has what is not a contact's alone as well.
pub fn group(number: usize) -> String {
    match number {
        0 => "/transient".to_owned(),
        _ => format!("/transient_{}", number + 1),
    }
}

/// One dataset: a row for each time.
struct Column {
    group: String,
    name: &'static str,
    units: &'static str,
    text: &'static str,
    /// Shape of a row.
    row: Vec<usize>,
    /// Rows of a chunk in the file.
    chunk: usize,
    values: Values,
}

impl Column {
    fn numbers(name: &'static str, units: &'static str, row: &[usize], text: &'static str) -> Self {
        Self { group: group(0), name, units, text, row: row.to_vec(), chunk: 0, values: Values::F64(Vec::new()) }
    }

    fn push(&mut self, row: impl IntoIterator<Item = f64>) {
        match &mut self.values {
            Values::F64(v) => v.extend(row),
            Values::F32(v) => v.extend(row.into_iter().map(|x| x as f32)),
            Values::I32(v) => v.extend(row.into_iter().map(|x| x as i32)),
            Values::I8(v) => v.extend(row.into_iter().map(|x| x as i8)),
            _ => {}
        }
    }

    /// In chunks that end where segments of so many steps, a row every `stride` of them, do: such chunks go into the
    /// main file as they are.
    fn within(mut self, segment: u64, stride: u64) -> Self {
        let bytes = self.values.item_bytes() * self.row.iter().product::<usize>();
        let most = (CHUNK_BYTES / bytes.max(1)).max(1);
        self.chunk = match segment.checked_div(stride).filter(|rows| rows * stride == segment) {
            Some(rows) => {
                let rows = rows as usize;
                rows / (rows.div_ceil(most)..rows).find(|k| rows.is_multiple_of(*k)).unwrap_or(rows).max(1)
            }
            // Segments of more rows and of less: any place is the begin of a chunk of one row.
            None if bytes >= CHUNK_LEAST => 1,
            None => most,
        };
        self
    }

    fn clear(&mut self) {
        match &mut self.values {
            Values::F64(v) => v.clear(),
            Values::F32(v) => v.clear(),
            Values::I32(v) => v.clear(),
            Values::I8(v) => v.clear(),
            _ => {}
        }
    }

    fn table(&self) -> Table {
        let size: usize = self.row.iter().product();
        let mut shape = vec![self.values.len() / size.max(1)];
        shape.extend(&self.row);
        Table::new(&format!("{}/{}", self.group, self.name), self.units, self.text, &shape, self.values.clone())
            .in_chunks(self.chunk)
    }
}

/// Keeps the observables of a segment.
pub struct Recorder<'a> {
    points: &'a Points,
    /// Displacements of the points beyond the modes at the last step, m, `[3 points]`.
    beyond: Vec<f64>,
    /// Velocities of the points at the last step, m/s, `[3 points]`.
    velocities: Vec<f64>,
    /// Number of modes.
    modes: usize,
    /// Time step, s.
    step: f64,
    contact_stride: u64,
    modal_stride: u64,
    sound_stride: u64,
    body_stride: u64,
    steps: Vec<Column>,
    /// Fields of each contact.
    contact: Vec<Vec<Column>>,
    /// Resultants of each further contact at the steps.
    further: Vec<Vec<Column>>,
    modal: Vec<Column>,
    sound: Vec<Column>,
    bodies: Vec<Column>,
}

impl<'a> Recorder<'a> {
    /// An empty one, of a run that goes on from the reactions `reaction` (N, `[3n]`). For sound the amplitudes of the
    /// modes are kept every `sound_stride` steps; 0 for never.
    pub fn new(
        points: &'a Points,
        wanted: &job::Transient,
        model: &ReducedModel,
        sound_stride: u64,
        reaction: &[f64],
    ) -> Self {
        let number = Column::numbers;
        let count = |name, text| Column { values: Values::I32(Vec::new()), ..number(name, "1", &[], text) };
        let p = points.names.len();
        let mut steps = vec![
            number("time", "s", &[], "Time of each step."),
            number("force", "N", &[3], "Contact force (x, y, z) on body 1; z is minus the normal force."),
            number("moment_z", "N m", &[], "Moment of the tractions on body 1 about the common normal."),
            number("approach", "m", &[], "Rigid approach of the bodies."),
            number("kinetic", "J", &[], "Kinetic energy of the modes."),
            number("elastic", "J", &[], "Elastic energy, that of the contact included."),
            number("friction_loss", "J", &[], "Energy dissipated by friction since the start."),
            number("damping_loss", "J", &[], "Energy dissipated by damping since the start."),
            number("impact_loss", "J", &[], "Energy lost in impacts since the start."),
            number("drive_work", "J", &[], "Work of the drive since the start."),
            number("rolling_work", "J", &[], "Part of the work of the drive that is the rolling moment's."),
            number(
                "balance",
                "J",
                &[],
                "Energy gained by the discretisation since the start; after a perturbed start, since the end of the \
                 first step.",
            ),
            number("residual", "N", &[], "Residual of the contact laws."),
            count("closed", "Closed contact nodes."),
            count("stick", "Closed nodes that stick."),
            count("iterations", "Iterations of the contact solver."),
            count("products", "Products with the influence matrix."),
        ];
        if p > 0 {
            steps.push(number("point_displacement", "m", &[p, 3], "Displacement (x, y, z) of each point."));
            let text = "Velocity (x, y, z) of each point; beyond the modes the mean over the step.";
            steps.push(number("point_velocity", "m/s", &[p, 3], text));
        }
        let fields = |n: usize| {
            let creep = "Creep velocity (x, y) over the step, 0 away from the contact.";
            let state = number("contact_state", "-", &[n], "0 open, 1 stick, 2 slip.");
            vec![
                number("contact_time", "s", &[], "Times of the contact fields."),
                number("contact_pressure", "Pa", &[n], "Contact pressure."),
                number("contact_traction", "Pa", &[n, 2], "Tangential traction (x, y) on body 1."),
                number("contact_creep", "m/s", &[n, 2], creep),
                Column { values: Values::I8(Vec::new()), ..state },
            ]
        };
        let resultants = || {
            vec![
                number("force", "N", &[3], "Contact force (x, y, z) on body 1; z is minus the normal force."),
                number("moment_z", "N m", &[], "Moment of the tractions on body 1 about the common normal."),
                number("approach", "m", &[], "Rigid approach of the bodies."),
                count("closed", "Closed contact nodes."),
                count("stick", "Closed nodes that stick."),
            ]
        };
        let n = model.interface.len();
        let m = model.pair.omega.len();
        let modal = vec![
            number("modal_time", "s", &[], "Times of modal_displacement."),
            number("modal_displacement", "m kg^1/2", &[m], "Amplitude of each mode."),
        ];
        // Not for the main file.
        let scratch = |group: &'static str, reactions: &[usize]| {
            let mut columns = vec![
                number("time", "s", &[], "Times of displacement."),
                number("displacement", "m kg^1/2", &[m], "Amplitude of each mode."),
            ];
            columns.extend(reactions.iter().map(|&n| {
                number("reaction", "N", &[3 * n], "Reactions (x, y, normal) of the contact nodes at these times.")
            }));
            columns.into_iter().map(|c| Column { group: group.to_owned(), ..c }).collect()
        };
        let (sound, bodies) = (scratch(SOUND, &[]), scratch(BODIES, &[n]));
        let within = |columns: Vec<Column>, stride: u32| -> Vec<Column> {
            columns.into_iter().map(|c| c.within(wanted.segment.into(), stride.into())).collect()
        };
        let of_contact = |number: usize, columns: Vec<Column>, stride: u32| -> Vec<Column> {
            within(columns.into_iter().map(|c| Column { group: group(number), ..c }).collect(), stride)
        };
        let patches = || model.interface.patches.iter().enumerate();
        Self {
            points,
            beyond: points.residual(reaction),
            velocities: vec![0.0; 3 * p],
            modes: m,
            step: wanted.step,
            contact_stride: u64::from(wanted.contact_stride),
            modal_stride: u64::from(wanted.modal_stride),
            sound_stride,
            body_stride: u64::from(wanted.body_stride),
            steps: within(steps, 1),
            contact: patches().map(|(k, p)| of_contact(k, fields(p.len()), wanted.contact_stride)).collect(),
            further: patches().skip(1).map(|(k, _)| of_contact(k, resultants(), 1)).collect(),
            modal: within(modal, wanted.modal_stride),
            sound,
            bodies,
        }
    }

    /// Takes a step.
    pub fn record_step(&mut self, stepper: &Stepper<'_>) {
        let (state, report, time) = (stepper.state(), stepper.report(), stepper.time());
        let (e, first) = (&state.energy, &report.patches[0]);
        let mut rows: Vec<Vec<f64>> = vec![
            vec![time],
            first.force.to_vec(),
            vec![first.moment_z],
            vec![stepper.approach(0)],
            vec![e.kinetic],
            vec![e.elastic],
            vec![e.friction],
            vec![e.damping],
            vec![e.impact],
            vec![e.drive],
            vec![e.rolling],
            vec![e.residual()],
            vec![report.residual],
            vec![first.closed as f64],
            vec![first.stick as f64],
            vec![report.effort.iterations as f64],
            vec![report.effort.products as f64],
        ];
        if !self.points.names.is_empty() {
            let beyond = self.points.residual(&state.reaction);
            let (mut u, mut v) = (self.points.modal(&state.q), self.points.modal(&state.v));
            for (k, (now, then)) in beyond.iter().zip(&self.beyond).enumerate() {
                u[k] += now;
                v[k] += (now - then) / self.step;
            }
            self.velocities.clone_from(&v);
            rows.extend([u, v]);
            self.beyond = beyond;
        }
        self.steps.iter_mut().zip(rows).for_each(|(c, row)| c.push(row));
        for (k, columns) in self.further.iter_mut().enumerate() {
            let own = &report.patches[k + 1];
            let counts = [own.closed as f64, own.stick as f64].map(|n| vec![n]);
            let rows = [own.force.to_vec(), vec![own.moment_z], vec![stepper.approach(k + 1)]];
            columns.iter_mut().zip(rows.into_iter().chain(counts)).for_each(|(c, row)| c.push(row));
        }
        let due = |stride: u64| stride > 0 && state.step.is_multiple_of(stride);
        if due(self.contact_stride) {
            let f = stepper.fields();
            for (columns, patch) in self.contact.iter_mut().zip(stepper.patches()) {
                let nodes = patch.nodes();
                let rows: [Vec<f64>; 5] = [
                    vec![time],
                    f.pressure[nodes.clone()].to_vec(),
                    f.traction[nodes.clone()].concat(),
                    f.creep[nodes.clone()].concat(),
                    f.state[nodes].iter().map(|&s| f64::from(s)).collect(),
                ];
                columns.iter_mut().zip(rows).for_each(|(c, row)| c.push(row));
            }
        }
        // Their amplitudes are the last coordinates, where others move as well.
        let amplitudes = || state.q[state.q.len().saturating_sub(self.modes)..].to_vec();
        if due(self.modal_stride) {
            let rows = [vec![time], amplitudes()];
            self.modal.iter_mut().zip(rows).for_each(|(c, row)| c.push(row));
        }
        if due(self.sound_stride) {
            let rows = [vec![time], amplitudes()];
            self.sound.iter_mut().zip(rows).for_each(|(c, row)| c.push(row));
        }
        if due(self.body_stride) {
            let rows = [vec![time], state.q.clone(), state.reaction.clone()];
            self.bodies.iter_mut().zip(rows).for_each(|(c, row)| c.push(row));
        }
    }

    /// Velocities (x, y, z) of the points at the step taken last, m/s, `[3 points]`.
    pub fn velocities(&self) -> &[f64] {
        &self.velocities
    }

    /// Returns whether anything was taken since the last segment.
    pub fn any(&self) -> bool {
        self.steps.iter().any(|c| !c.values.is_empty())
    }

    /// The tables of the segment.
    pub fn tables(&self) -> Vec<Table> {
        let of_contacts = self.contact.iter().chain(&self.further).flatten();
        let all = self.steps.iter().chain(of_contacts).chain(&self.modal).chain(&self.sound).chain(&self.bodies);
        all.filter(|c| !c.values.is_empty()).map(Column::table).collect()
    }

    /// Forgets what was written.
    pub fn clear(&mut self) {
        let of_contacts = self.contact.iter_mut().chain(&mut self.further).flatten();
        let all = [&mut self.steps, &mut self.modal, &mut self.sound, &mut self.bodies];
        all.into_iter().flatten().chain(of_contacts).for_each(Column::clear);
    }
}

/// Grid and modes that the datasets refer to.
pub fn grid(s: &Interface, pair: &CoupledModel) -> Vec<Table> {
    let of_contact = |(number, patch): (usize, &ContactPatch)| {
        let xy = |c: usize| patch.nodes().map(|i| s.point(i)[c]).collect::<Vec<f64>>();
        let name = |name: &str| format!("{}/grid/{name}", group(number));
        [
            Table::list(&name("x"), "m", "Longitudinal position of each contact node.", xy(0)),
            Table::list(&name("y"), "m", "Lateral position of each contact node.", xy(1)),
            Table::list(&name("weight"), "m²", "Area of each contact node.", s.weight[patch.nodes()].to_vec()),
        ]
    };
    let mut tables: Vec<Table> = s.patches.iter().enumerate().flat_map(of_contact).collect();
    tables.push(Table::list(
        "/transient/grid/mode_frequency",
        "Hz",
        "Frequency of each mode, the lower body's, then the upper one's.",
        pair.omega.iter().map(|w| w / (2.0 * std::f64::consts::PI)).collect::<Vec<f64>>(),
    ));
    tables
}

#[cfg(test)]
mod tests;
