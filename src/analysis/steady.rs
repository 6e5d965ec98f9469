//! The analysis `steady`: rolling with friction, everything constant in time.

use super::deferred;
use super::reduction::{by_products, Reduction};
use super::run::Run;
use super::steps::Needs;
use crate::case::bodies::{Bodies, Place};
use crate::case::interface::steady_rolling;
use crate::case::placed;
use crate::contact::consistent::{ConsistentSolution, ConsistentSteady};
use crate::contact::SteadySolution;
use crate::grid::{ContactGrid, Interface};
use crate::job::{self, Compliance, Job, Quadrature};
use crate::model::ModalPair;
use crate::output::datasets::contact::{consistent, tables};
use crate::output::{contact_fields, PointField, ResultFile, Table};
use crate::parallel::World;
use crate::summary::Summary;
use crate::{Error, Result};

/// What the analysis needs of the bodies: their displacements, for the fields or because their compliance is not made.
pub(super) fn needs(job: &Job) -> Needs {
    let elements = job.contact.as_ref().is_some_and(|c| c.compliance == Compliance::Fe);
    Needs { solvers: elements && (job.output.fields || by_products(job)), shapes: false }
}

/// Collective: the steady state, its tables and, with finite elements, its fields on the bodies.
pub fn run(
    run: &mut Run,
    steady: &job::Steady,
    contact: &job::Contact,
    bodies: &Bodies,
    model: &Reduction,
) -> Result<()> {
    let world = run.world();
    run.progress.stage("steady rolling");
    let interface = model.on_root().map(|r| &r.interface);
    let problem = model.on_root().map(|r| steady_rolling((&r.interface, &r.pair), contact, Some(steady)));
    // Displacements of the bodies where the solution needed them.
    let mut displacements = None;
    // Stresses between the nodes, where the laws hold there.
    let mut between = None;
    let solution = if contact.quadrature == Quadrature::Consistent {
        let problem = problem.map(ConsistentSteady::new);
        let found = world.on_root(|| problem.ok_or_else(|| Error::Defect("no contact on rank 0".into()))?.solve())?;
        found.map(|ConsistentSolution { solution, field, area }| {
            between = Some((field, area));
            solution
        })
    } else if model.approximate {
        let found = deferred::solve(run, problem.as_ref(), steady.tolerance, bodies)?;
        displacements = Some(found.displacements);
        found.solution
    } else {
        world.on_root(|| problem.ok_or_else(|| Error::Defect("no contact on rank 0".into()))?.solve())?
    };
    if let (Some(s), Some(solution)) = (interface, &solution) {
        if contact.placement.is_some() {
            run.file.tables(placed::tables(run.job, |i| solution.pressure[i] > 0.0)?);
        }
        run.file.tables(tables(s, solution, !contact.friction.is_constant()));
        if let Some((field, area)) = &between {
            run.file.tables(consistent(field, *area));
        }
        summarise(contact, solution, &mut run.summary);
        if let Some([x, y, n]) = model.on_root().and_then(|r| deflection(&r.interface, &r.pair, solution)) {
            let text = format!("x {:.1}, y {:.1}, n {:.1} µm, part of the placement", 1e6 * x, 1e6 * y, 1e6 * n);
            run.summary.value("bodies give way by", text);
            let text = "What the bodies give way by under the load at the middle of the contact (x, y, n), upper against lower; the placement has it already.";
            run.file.tables([Table::list("/contact/deflection", "m", text, vec![x, y, n])]);
        }
    }
    if contact.compliance == Compliance::Fe && run.job.output.fields {
        run.progress.stage("fields in the bodies");
        let solved = interface.zip(solution.as_ref());
        let displacements = match displacements {
            Some(found) => found,
            None => loaded(bodies, solved)?,
        };
        fields(world, bodies, &displacements, solved, &mut run.file)?;
    } else if run.job.output.fields {
        bodies.write_shapes(&mut run.file)?;
    }
    Ok(())
}

/// Collective: displacements of the places' bodies, this rank's degrees of freedom, m, under the reactions of the solution.
fn loaded(bodies: &Bodies, solved: Option<(&Interface, &SteadySolution)>) -> Result<Vec<Vec<f64>>> {
    let reactions: Vec<f64> = solved.map_or(Vec::new(), |(s, r)| {
        (0..s.len())
            .flat_map(|i| [r.traction[i][0], r.traction[i][1], r.pressure[i]].map(|v| v * s.weight[i]))
            .collect()
    });
    let of = |place: &Place| bodies.fields(place.body)?.statics(&place.side.turned(&reactions), 1);
    bodies.places.iter().map(of).collect()
}

/// Collective: displacement and stress of both bodies, and the contact fields, into `/VTKHDF`.
fn fields(
    world: &World,
    bodies: &Bodies,
    displacements: &[Vec<f64>],
    solved: Option<(&Interface, &SteadySolution)>,
    file: &mut ResultFile,
) -> Result<()> {
    let mut displacement = Vec::new();
    let mut von_mises = Vec::new();
    let mut contact = Vec::new();
    for (place, u) in bodies.places.iter().zip(displacements) {
        let body = bodies.fields(place.body)?;
        von_mises.push(body.von_mises(u));
        displacement.push(body.at_nodes(u).into_flattened());
        let (pressure, traction, state): (&[f64], Vec<f64>, Vec<i8>) = match solved {
            Some((_, r)) => (&r.pressure, r.traction.concat(), r.state.iter().map(|&s| s as i8).collect()),
            None => (&[], Vec::new(), Vec::new()),
        };
        let nodes = place.grid.as_ref().map_or(&[][..], ContactGrid::nodes);
        contact.push(contact_fields(world, body.mesh(), nodes, pressure, &traction, &state));
    }
    let mut all = vec![
        PointField::displacement(displacement.iter().map(Vec::as_slice).collect()),
        PointField::von_mises(von_mises.iter().map(Vec::as_slice).collect()),
    ];
    // Pressure and traction are at the nodes of the grid, which those of the meshes may not be.
    let at_nodes = bodies.places.iter().all(|p| p.grid.as_ref().is_none_or(|g| !g.nodes().is_empty()));
    if world.max(f64::from(u8::from(!at_nodes))) == 0.0 {
        all.extend(PointField::contact(&contact));
    }
    file.fields(&bodies.parts(), &all)
}

fn summarise(contact: &job::Contact, r: &SteadySolution, summary: &mut Summary) {
    let [fx, fy, fz] = r.force;
    let closed = r.state.iter().filter(|&&s| s > 0).count();
    let stick = r.state.iter().filter(|&&s| s == 1).count();
    let peak = r.pressure.iter().copied().fold(0.0, f64::max);
    summary.line("steady rolling");
    summary.value("normal force", format!("{:.6e} N", -fz));
    summary.value("approach", format!("{:.4} µm", 1e6 * r.approach));
    summary.value("largest pressure", format!("{:.2} MPa", 1e-6 * peak));
    summary.value("force on body 1 (x, y)", format!("{fx:.6e}, {fy:.6e} N"));
    let limit = -fz * contact.friction.coefficient(0.0);
    if limit > 0.0 {
        let at_rest = if contact.friction.is_constant() { "" } else { " (μ at rest)" };
        summary.value(&format!("  over μN{at_rest}"), format!("{:.4}, {:.4}", fx / limit, fy / limit));
    }
    summary.value("contact nodes closed / in stick", format!("{closed} / {stick}"));
    summary.value("residual, iterations", format!("{:.1e}, {}", r.residual, r.iterations));
}

/// What the bodies give way by at the middle of the contact, where their placement has it already.
fn deflection(interface: &Interface, pair: &ModalPair, solution: &SteadySolution) -> Option<[f64; 3]> {
    let of = |i: usize| {
        let [x, y] = solution.traction[i];
        [x, y, solution.pressure[i]].map(|v| v * interface.weight[i])
    };
    let reaction: Vec<f64> = (0..interface.len()).flat_map(of).collect();
    let moved = pair.deflection(&reaction)?;
    let middle = interface.x.len() / 2 + interface.x.len() * (interface.y.len() / 2);
    Some(std::array::from_fn(|c| moved[3 * middle + c]))
}
