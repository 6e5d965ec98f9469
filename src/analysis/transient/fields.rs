//! The motion of the bodies as a sequence for ParaView, made from the modal amplitudes that the segments keep.

use super::Inputs;
use crate::output::{companion, FieldSpec, Kind, Reader, ResultFile, Segments, SequenceFile};
use crate::parallel::World;
use crate::Result;

/// Collective: writes `FILE.transient.vtkhdf`. Memory holds one time and the modes, whatever the number of steps.
pub fn write(world: &World, inputs: &Inputs<'_>, segments: &Segments, file: &mut ResultFile<'_>) -> Result<()> {
    let bodies = inputs.bodies;
    let (step, stride) = (inputs.wanted.step, f64::from(inputs.wanted.body_stride));
    let wanted = |t: f64| ((t / step).round() % stride) == 0.0;
    let times = world.on_root(|| {
        let mut times = Vec::new();
        for path in segments.files()? {
            let segment = Reader::open(&path)?;
            if segment.has("/transient/modal_time") {
                times.extend(segment.numbers("/transient/modal_time")?.1.into_iter().filter(|&t| wanted(t)));
            }
        }
        Ok(times)
    })?;
    let times = world.broadcast(times.unwrap_or_default());
    if times.is_empty() {
        return Ok(());
    }
    let text = "Displacement by the modes, in the frame of the contact point.";
    let spec = FieldSpec::new("displacement", "m", text, Kind::Vector);
    let path = companion(&inputs.options.output, "transient.vtkhdf");
    let force = inputs.options.force || inputs.options.resume;
    let mut sequence =
        SequenceFile::create(world, &path, force, &bodies.parts(), vec![spec], &times, ("s", "Time."), &[])?;
    let count = world.broadcast(world.on_root(|| Ok(vec![segments.files()?.len() as u64]))?.unwrap_or_default());
    let mut written = 0;
    for number in 0..count.first().copied().unwrap_or(0) as usize {
        let rows = world.on_root(|| {
            let files = segments.files()?;
            let segment = Reader::open(&files[number])?;
            if !segment.has("/transient/modal_displacement") {
                return Ok(Vec::new());
            }
            let times = segment.numbers("/transient/modal_time")?.1;
            let rows = segment.numbers("/transient/modal_displacement")?.1;
            let m = rows.len() / times.len().max(1);
            let rows = times.iter().zip(rows.chunks_exact(m.max(1))).filter(|(t, _)| wanted(**t));
            Ok(rows.flat_map(|(_, q)| q.to_vec()).collect())
        })?;
        let rows = world.broadcast(rows.unwrap_or_default());
        let m: usize = bodies.places.iter().map(|p| inputs.modes[p.body].omega.len()).sum();
        for q in rows.chunks_exact(m.max(1)) {
            let mut first = 0;
            let mut values = Vec::new();
            for place in &bodies.places {
                let (body, modes) = (&bodies.unique[place.body], &inputs.modes[place.body]);
                let mut u = vec![0.0; body.dofs.owned()];
                for (vector, a) in modes.vectors.iter().zip(&q[first..]) {
                    u.iter_mut().zip(vector).for_each(|(u, v)| *u += a * v);
                }
                first += modes.omega.len();
                values.push(body.at_nodes(world, &u).into_flattened());
            }
            sequence.step(written, &[values.iter().map(Vec::as_slice).collect()])?;
            written += 1;
        }
    }
    file.attach(sequence)
}
