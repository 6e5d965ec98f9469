//! The analysis `steady`: rolling with friction, everything constant in time.

use super::deferred_correction;
use super::reduction::{by_products, Reduction};
use super::run::Run;
use super::steps::Requirements;
use crate::body::Side;
use crate::case::axle_torque;
use crate::case::bodies::{BuiltBodies, Place};
use crate::case::interface::{at_rest, friction, steady_rolling};
use crate::case::wheel_rail_geometry;
use crate::contact::consistent::{ConsistentSolution, ConsistentSteady};
use crate::contact::{PatchResultant, SteadySolution};
use crate::grid::{ContactGrid, Interface, Transfer};
use crate::job::{self, Compliance, Job, Quadrature};
use crate::model::CoupledModel;
use crate::output::datasets::contact::{consistent, tables};
use crate::output::{averaged, contact_fields, GridPatch, PointField, ResultFile, Table};
use crate::parallel::World;
use crate::summary::Summary;
use crate::{Error, Result};

/// Requirements of the analysis on the bodies: their displacements, for the fields or because their compliance is not
/// made.
pub(super) fn needs(job: &Job) -> Requirements {
    let elements = job.contact.as_ref().is_some_and(|c| c.compliance == Compliance::Fe);
    Requirements { solvers: elements && (job.output.fields || by_products(job)), shapes: false }
}

/// Collective: the steady state, its tables and, with finite elements, its fields on the bodies.
pub fn run(
    run: &mut Run,
    steady: &job::Steady,
    contact: &job::Contact,
    bodies: &BuiltBodies,
    model: &Reduction,
) -> Result<()> {
    let world = run.world();
    run.progress.stage("steady rolling");
    let interface = model.on_root().map(|r| &r.interface);
    // A torque is balanced in a state of rest.
    let posed = if contact.torque.is_some() { at_rest } else { steady_rolling };
    let problem = model.on_root().map(|r| posed((&r.interface, &r.pair), contact, Some(steady)));
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
        let found = deferred_correction::solve(run, problem.as_ref(), steady.tolerance, bodies)?;
        displacements = Some(found.displacements);
        found.solution
    } else {
        world.on_root(|| problem.ok_or_else(|| Error::Defect("no contact on rank 0".into()))?.solve())?
    };
    if let (Some(s), Some(solution)) = (interface, &solution) {
        if contact.placement.is_some() {
            let (placed, warnings) = wheel_rail_geometry::tables(run.job, |i| solution.pressure[i])?;
            run.file.tables(placed);
            warnings.into_iter().for_each(|text| run.summary.warn(text));
        }
        run.file.tables(tables(s, solution, friction(contact).only().is_none_or(|law| !law.is_constant())));
        if let Some((field, area)) = &between {
            run.file.tables(consistent(field, *area));
        }
        summarise(contact, (s, solution), &mut run.summary);
        if contact.torque.is_some() || contact.wheels == job::ContactWheels::Both {
            let torque = axle_torque::of_contacts(run.job, &solution.patches)?;
            run.summary
                .value("torque of the contacts on the axle", format!("{torque:.6e} N m, positive where it drives"));
            let text = "Torque of the contacts on the axle, positive in the sense of its rotation.";
            run.file.table(Table::scalar("/contact/torque", "N m", text, torque));
        }
        if let Some([x, y, n]) = model.on_root().and_then(|r| deflection(&r.interface, &r.pair, solution)) {
            let text = format!("x {:.1}, y {:.1}, n {:.1} µm, included in the placement", 1e6 * x, 1e6 * y, 1e6 * n);
            run.summary.value("structural deflection under load", text);
            let text = "Structural deflection under the load at the middle of the contact (x, y, n), upper \
             against lower; included in the placement.";
            run.file.tables([Table::list("/contact/deflection", "m", text, vec![x, y, n])]);
        }
    }
    if !run.job.output.fields {
        return Ok(());
    }
    let solved = interface.zip(solution.as_ref());
    if contact.compliance == Compliance::Fe {
        run.progress.stage("fields in the bodies");
        let displacements = match displacements {
            Some(found) => found,
            None => loaded(bodies, solved)?,
        };
        fields(world, bodies, Some(&displacements), solved, &mut run.file)?;
    } else if bodies.on_meshes() && bodies.on_common_grid(world) {
        fields(world, bodies, None, solved, &mut run.file)?;
    } else {
        bodies.write_shapes(&mut run.file)?;
    }
    Ok(())
}

/// Collective: displacements of the places' bodies, this rank's degrees of freedom, m, under the reactions of the
/// solution.
fn loaded(bodies: &BuiltBodies, solved: Option<(&Interface, &SteadySolution)>) -> Result<Vec<Vec<f64>>> {
    let reactions: Vec<f64> = solved.map_or(Vec::new(), |(s, r)| {
        (0..s.len())
            .flat_map(|i| [r.traction[i][0], r.traction[i][1], r.pressure[i]].map(|v| v * s.weight[i]))
            .collect()
    });
    let of = |place: &Place| bodies.fields(place.body)?.statics(&place.side.orient(&reactions), 1);
    bodies.places.iter().map(of).collect()
}

/// Collective: the contact fields, at the nodes of the meshes or on cells of a common grid, into `/VTKHDF`; with
/// displacement and stress of both bodies where their `displacements` are known.
fn fields(
    world: &World,
    bodies: &BuiltBodies,
    displacements: Option<&[Vec<f64>]>,
    solved: Option<(&Interface, &SteadySolution)>,
    file: &mut ResultFile,
) -> Result<()> {
    let mut displacement = Vec::new();
    let mut von_mises = Vec::new();
    let mut contact = Vec::new();
    let mut patches = Vec::new();
    for (i, place) in bodies.places.iter().enumerate() {
        let body = bodies.fields(place.body)?;
        let grid = place.grid();
        let mut on_grid = Vec::new();
        if let Some(u) = displacements.and_then(|all| all.get(i)) {
            von_mises.push(body.von_mises(u));
            displacement.push(body.at_nodes(u).into_flattened());
            let rows = match grid.and_then(|g| g.transfer.as_ref()) {
                Some(Transfer::Averages { rows, .. }) => rows,
                _ => &[][..],
            };
            let at = |values: &[Vec<f64>], n: usize| averaged(world, body.mesh(), rows, &values[i], n);
            on_grid.push(("displacement".to_owned(), at(&displacement, 3)));
            on_grid.push(("von_mises".to_owned(), at(&von_mises, 1)));
        }
        let (pressure, traction, state): (&[f64], Vec<f64>, Vec<i8>) = match solved {
            Some((_, r)) => (&r.pressure, r.traction.concat(), r.state.iter().map(|&s| s as i8).collect()),
            None => (&[], Vec::new(), Vec::new()),
        };
        let nodes = grid.map_or(&[][..], ContactGrid::nodes);
        // Of a common grid no node is one of the mesh: these are free here, and the grid has cells of its own.
        contact.push(contact_fields(world, body.mesh(), nodes, pressure, &traction, &state));
        if let (Some((_, r)), Some(grid), false) = (solved, grid, place.laid.is_empty()) {
            on_grid.push(("pressure".to_owned(), r.pressure.clone()));
            on_grid.push(("traction".to_owned(), place.on_mesh(&r.traction).into_flattened()));
            on_grid.push(("state".to_owned(), state.iter().map(|&s| f64::from(s)).collect()));
            let (upper, lines) = (place.side == Side::Upper, [grid.x.len(), grid.y.len()]);
            patches.push(GridPatch { upper, lines, points: place.laid.clone(), values: on_grid });
        }
    }
    let mut all = Vec::new();
    if displacements.is_some() {
        all.push(PointField::displacement(displacement.iter().map(Vec::as_slice).collect()));
        all.push(PointField::von_mises(von_mises.iter().map(Vec::as_slice).collect()));
    }
    all.extend(PointField::contact(&contact));
    file.fields_and_grid(&bodies.parts(), &all, &patches)
}

fn summarise(contact: &job::Contact, (s, r): (&Interface, &SteadySolution), summary: &mut Summary) {
    summary.line("steady rolling");
    let names = contact.names();
    for (number, (one, resultant)) in contact.all().zip(&r.patches).enumerate() {
        if r.patches.len() > 1 {
            let lies = match contact.around.is_empty() {
                true => format!("{}, contact angle {:.2} degrees", names[number], one.angle.to_degrees()),
                false => one.around_text(),
            };
            summary.line(format!("contact {}: {lies}", number + 1));
        }
        let [fx, fy, fz] = resultant.force;
        let nodes = s.patches[number].nodes();
        let closed = r.state[nodes.clone()].iter().filter(|&&s| s > 0).count();
        let stick = r.state[nodes.clone()].iter().filter(|&&s| s == 1).count();
        let peak = r.pressure[nodes].iter().copied().fold(0.0, f64::max);
        summary.value("normal force", format!("{:.6e} N", -fz));
        summary.value("approach", format!("{:.4} µm", 1e6 * resultant.approach));
        summary.value("largest pressure", format!("{:.2} MPa", 1e-6 * peak));
        let [x, y] = r.centre_of(s, number).map(|x| 1e3 * x);
        summary.value("centre of the pressure (x, y)", format!("{x:+.3}, {y:+.3} mm"));
        summary.value("force on body 1 (x, y)", format!("{fx:.6e}, {fy:.6e} N"));
        let limit = -fz * one.law().coefficient(0.0);
        if limit > 0.0 {
            let at_rest = if one.law().is_constant() { "" } else { " (μ at rest)" };
            summary.value(&format!("  over μN{at_rest}"), format!("{:.4}, {:.4}", fx / limit, fy / limit));
        }
        summary.value("contact nodes closed / in stick", format!("{closed} / {stick}"));
    }
    if contact.vertical_load.is_some() && r.patches.len() > 1 {
        let sum = |force: &dyn Fn([f64; 3], [f64; 2]) -> f64| -> f64 {
            let of = |(one, p): (&job::Contact, &PatchResultant)| force(p.force, [one.angle.sin(), one.angle.cos()]);
            contact.all().zip(&r.patches).map(of).sum()
        };
        // The contact bears the normal force −F_z and gives the wheel the friction −F_y.
        let vertical = sum(&|[_, y, z], [sin, cos]| y * sin - z * cos);
        let lateral = sum(&|[_, y, z], [sin, cos]| -z * sin - y * cos);
        summary.value("vertical load of the wheel", format!("{vertical:.6e} N"));
        summary.value("lateral force on the wheel", format!("{lateral:.6e} N, positive to the right"));
    }
    summary.value("residual, iterations", format!("{:.1e}, {}", r.residual, r.iterations));
}

/// Displacement of the bodies at the middle of the contact that the placement already includes.
fn deflection(interface: &Interface, pair: &CoupledModel, solution: &SteadySolution) -> Option<[f64; 3]> {
    let of = |i: usize| {
        let [x, y] = solution.traction[i];
        [x, y, solution.pressure[i]].map(|v| v * interface.weight[i])
    };
    let reaction: Vec<f64> = (0..interface.len()).flat_map(of).collect();
    let moved = pair.deflection(&reaction)?;
    let patch = interface.only()?;
    let middle = patch.node(patch.x.len() / 2, patch.y.len() / 2);
    Some(std::array::from_fn(|c| moved[3 * middle + c]))
}
