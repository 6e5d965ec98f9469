//! The motion of the bodies as a sequence for ParaView, made from the modal amplitudes and the reactions that the
//! segments keep: the modes, and statically what the contact forces move beyond them.

use super::Inputs;
use crate::analysis::run::Run;
use crate::body::ReducedBody;
use crate::case::bodies::Place;
use crate::output::datasets::record::BODIES;
use crate::output::{companion, Entry, FieldKind, FieldSpec, Segments, Sequence, SequenceFile};
use crate::parallel::World;
use crate::{Error, Result};
use std::collections::VecDeque;

/// Times that are worked on together: a solve of so many loads takes a fraction of as many solves.
const TOGETHER: usize = 16;
/// Degrees of freedom whose part of these times stays in the cache.
const SPAN: usize = 1024;

/// A time: modal amplitudes, m √kg, `[m]`, and reactions (tx, ty, p), N, `[3n]`.
type Row = (Vec<f64>, Vec<f64>);

/// Contents of the segments, one segment in memory at a time; on rank 0, empty elsewhere.
struct Kept {
    segments: Option<Segments>,
    entries: std::vec::IntoIter<Entry>,
    waiting: VecDeque<Row>,
}

impl Kept {
    /// The next `count` times.
    fn next(&mut self, count: usize) -> Result<Vec<Row>> {
        while self.waiting.len() < count {
            let (Some(segments), Some(entry)) = (&self.segments, self.entries.next()) else {
                return Err(Error::Defect("times are missing in the segments".into()));
            };
            let segment = segments.open(&entry)?;
            let rows = |name: &str| -> Result<Vec<Vec<f64>>> {
                let (shape, values) = segment.numbers(&format!("{BODIES}/{name}"))?;
                let width = shape.get(1).map_or(1, |&w| w.max(1));
                Ok(values.chunks_exact(width).map(<[f64]>::to_vec).collect())
            };
            if segment.has(BODIES) {
                self.waiting.extend(rows("displacement")?.into_iter().zip(rows("reaction")?));
            }
        }
        Ok(self.waiting.drain(..count).collect())
    }
}

/// Collective: writes `FILE.transient.vtkhdf` with one static solve for each body and time. In memory are the modes
/// and some times, whatever the number of steps.
pub fn write(run: &mut Run, inputs: &Inputs<'_>) -> Result<()> {
    let world = run.world();
    let parts = inputs.bodies.parts();
    let found = world.on_root(|| {
        let segments = inputs.segments()?;
        let (mut times, entries) = (Vec::new(), segments.entries());
        for entry in &entries {
            let segment = segments.open(entry)?;
            if segment.has(BODIES) {
                times.extend(segment.numbers(&format!("{BODIES}/time"))?.1);
            }
        }
        Ok((times, entries))
    })?;
    let (times, entries) = found.unwrap_or_default();
    let times = world.broadcast(times);
    if times.is_empty() {
        return Ok(());
    }
    let text = "Displacement from the unloaded body, in the frame of the contact point: the modes kept and, \
     statically, the others.";
    let spec = FieldSpec::new("displacement", "m", text, FieldKind::Vector);
    let path = companion(&run.options.output, "transient.vtkhdf");
    let frames = Sequence {
        fields: vec![spec],
        values: &times,
        units: "s",
        description: "Time.",
        tables: &[],
        summed: false,
        single: true,
    };
    let mut sequence = SequenceFile::create(world, &path, run.replaces(), &parts, frames)?;
    let mut kept = Kept { segments: inputs.segments.cloned(), entries: entries.into_iter(), waiting: VecDeque::new() };
    for first in (0..times.len()).step_by(TOGETHER) {
        let count = TOGETHER.min(times.len() - first);
        let rows = world.on_root(|| kept.next(count))?.unwrap_or_default();
        let moved = displacements(world, inputs, &rows, count)?;
        for k in 0..count {
            let at_nodes = |(place, u): (&Place, &Vec<f64>)| -> Result<Vec<f64>> {
                let body = inputs.bodies.fields(place.body)?;
                let n = body.len();
                Ok(body.at_nodes(&u[k * n..(k + 1) * n]).into_flattened())
            };
            let values: Vec<Vec<f64>> = inputs.bodies.places.iter().zip(&moved).map(at_nodes).collect::<Result<_>>()?;
            sequence.step(first + k, &[values.iter().map(Vec::as_slice).collect()])?;
        }
        run.progress.step("times", first + count, times.len());
    }
    run.file.attach(sequence)
}

/// Collective: displacements of the body of each place at `count` times, whose rows rank 0 has, this rank's degrees
/// of freedom, m, `[owned, count]` column by column: u = Φ (q − Ω⁻² Φ_cᵀ F) + K⁻¹ F under the contact forces F.
fn displacements(world: &World, inputs: &Inputs<'_>, rows: &[Row], count: usize) -> Result<Vec<Vec<f64>>> {
    let mut all = Vec::new();
    let mut first = 0;
    for (index, place) in inputs.bodies.places.iter().enumerate() {
        let (body, modes) = (inputs.bodies.fields(place.body)?, inputs.bodies.shapes_of(place.body)?);
        let forces: Vec<Vec<f64>> = rows.iter().map(|(_, r)| place.side.orient(r)).collect();
        let mut u = body.statics(&forces.concat(), count)?;
        let factors = world.on_root(|| {
            let root = inputs.model.root()?;
            let reduced = &root.bodies[root.place[index]];
            let own = rows.iter().map(|(q, _)| &q[first..first + reduced.omega.len()]);
            Ok(own.zip(&forces).flat_map(|(q, f)| dynamic_part(reduced, q, f)).collect::<Vec<f64>>())
        })?;
        let factors = world.broadcast(factors.unwrap_or_default());
        add(&modes.vectors, &factors, &mut u);
        first += modes.vectors.len();
        all.push(u);
    }
    Ok(all)
}

/// Modal amplitudes, m √kg, `[m]`, less what the contact forces (x, y, n), N, `[3n]`, make of them statically.
fn dynamic_part(body: &ReducedBody, q: &[f64], forces: &[f64]) -> Vec<f64> {
    let part = |(k, (&w, q)): (usize, (&f64, &f64))| {
        let force: f64 = body.contact_modes.col(k).iter().zip(forces).map(|(p, f)| p * f).sum();
        q - if w > 0.0 { force / (w * w) } else { 0.0 }
    };
    body.omega.iter().zip(q).enumerate().map(part).collect()
}

/// Adds the columns, times the factors `[sums][columns]`, to each of the sums, which follow one another.
fn add(columns: &[Vec<f64>], factors: &[f64], sums: &mut [f64]) {
    let rows = columns.first().map_or(0, Vec::len);
    for first in (0..rows).step_by(SPAN) {
        let span = first..rows.min(first + SPAN);
        for (j, column) in columns.iter().enumerate() {
            for (sum, f) in sums.chunks_exact_mut(rows).zip(factors.chunks_exact(columns.len())) {
                sum[span.clone()].iter_mut().zip(&column[span.clone()]).for_each(|(s, c)| *s += f[j] * c);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::Table;
    use faer::Mat;

    #[test]
    fn sums_go_over_all_spans() {
        let rows = 2 * SPAN + 7;
        let columns = [1.0, 2.0, 3.0].map(|f| (0..rows).map(|i| f * i as f64).collect::<Vec<f64>>());
        let mut sums = [vec![0.5; rows], vec![0.0; rows]].concat();
        add(&columns, &[1.0, 1.0, 1.0, 0.0, -2.0, 1.0], &mut sums);
        for i in [0, SPAN - 1, SPAN, 2 * SPAN, rows - 1] {
            assert_eq!((sums[i], sums[rows + i]), (0.5 + 6.0 * i as f64, -(i as f64)));
        }
    }

    /// Times that are worked on together come from several segments, and one segment lasts for several of them.
    #[test]
    fn times_follow_one_another_across_segments() {
        let folder = tempfile::tempdir().expect("a folder");
        let segments = Segments::claim(&folder.path().join("run.h5"), false).expect("a folder");
        segments.start_run(serde_json::Value::Null).expect("a run");
        let row = |k: usize| (vec![k as f64, -(k as f64)], (0..3).map(|c| (3 * k + c) as f64).collect::<Vec<f64>>());
        let ends = [0, 7, 7, 30, 35, 37];
        for (number, w) in ends.windows(2).enumerate() {
            let rows: Vec<Row> = (w[0]..w[1]).map(row).collect();
            let list = |name: &str, values: Vec<f64>| {
                let shape = [rows.len(), values.len() / rows.len().max(1)];
                Table::new(&format!("{BODIES}/{name}"), "1", "Rows.", &shape, values)
            };
            let q = rows.iter().flat_map(|r| r.0.clone()).collect();
            let reactions = rows.iter().flat_map(|r| r.1.clone()).collect();
            let all = [list("displacement", q), list("reaction", reactions)];
            let start = [Table::scalar("/checkpoint/step", "1", "Steps.", 0i64)];
            segments.write(number as u64, if rows.is_empty() { &start } else { &all }).expect("a segment");
        }
        let entries = segments.entries().into_iter();
        let mut kept = Kept { segments: Some(segments), entries, waiting: VecDeque::new() };
        for (first, count) in [(0, 16), (16, 16), (32, 5)] {
            let wanted: Vec<Row> = (first..first + count).map(row).collect();
            assert_eq!(kept.next(count).expect("times"), wanted);
        }
        assert!(kept.next(1).is_err());
    }

    /// At rest under the forces nothing is left of the modes; a rigid-body motion is no part of the statics.
    #[test]
    fn what_is_static_comes_from_the_solve_alone() {
        let omega = vec![0.0, 20.0, 50.0];
        let contact_modes = Mat::from_fn(6, 3, |i, k| ((3 * i + 5 * k) as f64).sin());
        let body = ReducedBody::new(omega, vec![0.0; 3], contact_modes, Mat::zeros(6, 6));
        let forces: Vec<f64> = (0..6).map(|i| 100.0 * (i as f64).cos()).collect();
        let force = |k: usize| (0..6).map(|i| body.contact_modes[(i, k)] * forces[i]).sum::<f64>();
        let rest = [0.3, force(1) / 400.0, force(2) / 2500.0];
        let part = dynamic_part(&body, &rest, &forces);
        assert!(part[0] == 0.3 && part[1..].iter().all(|v| v.abs() < 1e-15), "{part:?}");
        let moved = dynamic_part(&body, &[0.3, rest[1] + 0.01, rest[2]], &forces);
        assert!((moved[1] - 0.01).abs() < 1e-15, "{moved:?}");
    }
}
