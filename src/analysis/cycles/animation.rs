//! Cycles as motions of the bodies about their means, for ParaView. They are those of the modes: what the contact
//! yields by itself is not seen.
//!
//! u(x, θ) = Re Σ_{k ≥ 1} Σ_m φ_m(x) q_mk e^{ikθ} with the modal amplitudes q_mk of the multiple k of the frequency.

use crate::analysis::run::Run;
use crate::case::bodies::BuiltBodies;
use crate::case::display_modes::Pictures;
use crate::cycles::{BranchPoint, PeriodicSolution};
use crate::job::Job;
use crate::output::datasets::branches::{shown, OneBranch};
use crate::output::{companion, FieldKind, FieldSpec, Sequence, SequenceFile, Table};
use crate::Result;
use num_complex::Complex;
use std::f64::consts::PI;

type C = Complex<f64>;

/// Steps of a period.
const PHASES: usize = 24;

/// True if the motion of cycles is written.
pub fn is_shown(job: &Job) -> bool {
    let wanted = job.analyses.cycles.as_ref().is_some_and(|c| c.every.is_some());
    wanted && (job.output.swept_modes == Some(true) || (job.output.fields && !job.is_reduced_anew()))
}

/// Collective: writes `FILE.cycles.vtkhdf` with the cycles that have a period in the tables.
pub(super) fn write(run: &mut Run, bodies: &BuiltBodies, branches: &[OneBranch], every: Option<u32>) -> Result<()> {
    if !is_shown(run.job) {
        return Ok(());
    }
    let world = run.world();
    let cycles: Vec<(usize, &BranchPoint)> = shown(branches, every);
    let pictures = Pictures::new(world, bodies, |_| true);
    let drawn = !pictures.is_empty();
    if cycles.is_empty() || (!drawn && bodies.places.iter().any(|p| bodies.shapes_of(p.body).is_err())) {
        run.summary
            .value("motion of the cycles", "not written: the modes of an earlier run have no shapes".to_string());
        return Ok(());
    }
    run.progress.stage("motion of the cycles");
    let parts = if drawn { pictures.parts() } else { bodies.parts() };
    let mut file = {
        let steps = cycles.len() * PHASES;
        let values: Vec<f64> = (0..steps).map(|i| i as f64 / PHASES as f64).collect();
        let list = |name: &str, units: &str, text: &str, of: &dyn Fn(usize) -> f64| {
            Table::list(&format!("/cycles/{name}"), units, text, (0..steps).map(of).collect::<Vec<f64>>())
        };
        let at = |step: usize| cycles[step / PHASES];
        let tables = [
            Table::list(
                "/cycles/point",
                "1",
                "Place of the cycle of each step among the rows of /cycles of the main file, from 0.",
                (0..steps).map(|i| at(i).0 as i64).collect::<Vec<_>>(),
            ),
            list("key", "-", "Value of the key of the cycle of each step.", &|i| at(i).1.key),
            list("frequency", "Hz", "Frequency of the cycle of each step.", &|i| at(i).1.cycle.frequency),
            list("phase", "1", "Time of each step as a part of the period.", &|i| (i % PHASES) as f64 / PHASES as f64),
        ];
        let text = "Displacement about its mean, of the modes alone, at one moment of the period of a limit cycle.";
        let sequence = Sequence {
            fields: vec![FieldSpec::new("displacement", "m", text, FieldKind::Vector)],
            values: &values,
            units: "1",
            description: "Periods shown so far: cycle k of the file, from 0, takes k to k + 1.",
            tables: &tables,
            summed: false,
            single: true,
        };
        SequenceFile::create(world, &companion(&run.options.output, "cycles.vtkhdf"), run.replaces(), &parts, sequence)?
    };
    for (number, (_, point)) in cycles.iter().enumerate() {
        for phase in 0..PHASES {
            let q = amplitudes(&point.cycle, 2.0 * PI * phase as f64 / PHASES as f64);
            let moved: Vec<Vec<f64>> = match drawn {
                true => (0..parts.len()).map(|k| real(pictures.moved(k, &q))).collect(),
                false => moved(bodies, &q)?,
            };
            file.step(number * PHASES + phase, &[moved.iter().map(Vec::as_slice).collect()])?;
        }
        run.progress.step("cycles", number + 1, cycles.len());
    }
    run.file.attach(file)
}

/// Modal amplitudes of a cycle at the phase `theta` about their means, m √kg, `[m]`; their imaginary parts are zero.
fn amplitudes(cycle: &PeriodicSolution, theta: f64) -> Vec<C> {
    let mut sum = vec![0.0; cycle.modal.first().map_or(0, Vec::len)];
    for (k, harmonic) in cycle.modal.iter().enumerate().skip(1) {
        let turn = C::from_polar(1.0, k as f64 * theta);
        sum.iter_mut().zip(harmonic).for_each(|(s, q)| *s += (q * turn).re);
    }
    sum.into_iter().map(C::from).collect()
}

fn real([re, _]: [Vec<f64>; 2]) -> Vec<f64> {
    re
}

/// Displacements of the bodies with meshes of their own under modal amplitudes `q`, m √kg, `[m]`, at this rank's nodes,
/// m, `[3 nodes]` each.
fn moved(bodies: &BuiltBodies, q: &[C]) -> Result<Vec<Vec<f64>>> {
    let mut first = 0;
    let mut all = Vec::new();
    for place in &bodies.places {
        let shapes = &bodies.shapes_of(place.body)?.vectors;
        let mut u = vec![0.0; shapes.first().map_or(0, Vec::len)];
        for (shape, q) in shapes.iter().zip(&q[first..]) {
            u.iter_mut().zip(shape).for_each(|(u, s)| *u += q.re * s);
        }
        first += shapes.len();
        all.push(bodies.fields(place.body)?.at_nodes(&u).into_flattened());
    }
    Ok(all)
}
