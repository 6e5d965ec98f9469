//! The analysis `steady`: rolling with friction, everything constant in time.

use super::bodies::Bodies;
use super::report::Summary;
use crate::body::statics::Statics;
use crate::contact::half_space::HalfSpace;
use crate::contact::interface::{combined_compliance, Creepage, Interface, Stencil};
use crate::contact::steady::{NormalLoad, SteadyProblem, SteadySolution};
use crate::fem::{stress, Material};
use crate::job::{self, Compliance, Job, Load};
use crate::mesh::grid::ContactGrid;
use crate::output::{contact_fields, PointField, ResultFile, Table};
use crate::parallel::World;
use crate::progress::Progress;
use crate::{Error, Result};
use faer::Mat;

/// Collective: the steady state, its tables and, with finite elements, its fields on the bodies.
#[allow(clippy::too_many_arguments)]
pub fn run(
    world: &World,
    job: &Job,
    steady: &job::Steady,
    contact: &job::Contact,
    bodies: &Bodies,
    solvers: &mut [Statics],
    file: &mut ResultFile,
    progress: &mut Progress,
    summary: &mut Summary,
) -> Result<()> {
    let interface = world.on_root(|| interface_of(bodies))?;
    progress.stage("compliance of the contact");
    let compliance = match contact.compliance {
        Compliance::Fe => fe_compliance(world, bodies, solvers, progress)?,
        Compliance::HalfSpace => world.on_root(|| half_space_compliance(bodies, interface.as_ref()))?,
    };
    progress.stage("steady rolling");
    let solution = world.on_root(|| match (&interface, &compliance) {
        (Some(s), Some(w)) => solve(s, w, steady, contact),
        _ => Err(Error::Defect("no interface on rank 0".into())),
    })?;
    if let (Some(s), Some(solution)) = (&interface, &solution) {
        file.tables(tables(s, solution));
        summarise(contact, solution, summary);
    }
    if contact.compliance == Compliance::Fe && job.output.fields {
        progress.stage("fields in the bodies");
        fields(world, bodies, solvers, interface.as_ref().zip(solution.as_ref()), file)?;
    } else if job.output.fields {
        bodies.write_shapes(file)?;
    }
    Ok(())
}

/// On rank 0: the grid both bodies share and the gap between them.
fn interface_of(bodies: &Bodies) -> Result<Interface> {
    let grids: Vec<&ContactGrid> = bodies.places.iter().filter_map(|p| p.grid.as_ref()).collect();
    let [lower, upper] = grids[..] else {
        return Err(Error::Defect("contact needs the contact grids of two bodies".into()));
    };
    // A thousandth of an element: much less than the grid error, much more than rounding in a mesh file.
    let spacing = lower.x.windows(2).chain(lower.y.windows(2)).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    ContactGrid::matched(lower, upper, 1e-3 * spacing)?;
    let gap = lower.z.iter().zip(&upper.z).map(|(l, u)| -l - u).collect();
    Interface::new(lower.x.clone(), lower.y.clone(), gap)
}

/// Collective: influence matrix of the interface from the finite-element bodies, m/N, `[3n, 3n]` on rank 0.
fn fe_compliance(
    world: &World,
    bodies: &Bodies,
    solvers: &mut [Statics],
    progress: &mut Progress,
) -> Result<Option<Mat<f64>>> {
    let mut unique = Vec::new();
    for (body, solver) in bodies.unique.iter().zip(solvers) {
        unique.push(body.compliance(world, solver, &mut |done, of| progress.step("contact rows", done, of))?);
    }
    world.on_root(|| {
        let of = |place: usize| {
            bodies
                .places
                .get(place)
                .and_then(|p| unique[p.body].as_ref())
                .ok_or_else(|| Error::Defect("compliance is not on rank 0".into()))
        };
        combined_compliance(of(0)?.as_ref(), of(1)?.as_ref())
    })
}

/// On rank 0: influence matrix of two half-spaces of the bodies' materials.
fn half_space_compliance(bodies: &Bodies, interface: Option<&Interface>) -> Result<Mat<f64>> {
    let Some(s) = interface else { return Err(Error::Defect("no interface on rank 0".into())) };
    let of = |m: &Material| HalfSpace { young: m.young, poisson: m.poisson }.compliance(&s.x, &s.y);
    let lower = of(&bodies.places[0].material)?;
    let upper = of(&bodies.places[1].material)?;
    combined_compliance(lower.as_ref(), upper.as_ref())
}

fn solve(s: &Interface, w: &Mat<f64>, steady: &job::Steady, contact: &job::Contact) -> Result<SteadySolution> {
    SteadyProblem {
        interface: s,
        compliance: w.as_ref(),
        friction: contact.friction.coefficient(0.0),
        speed: contact.speed,
        creepage: Creepage {
            longitudinal: contact.creepage.longitudinal,
            lateral: contact.creepage.lateral,
            spin: contact.creepage.spin,
        },
        load: match contact.load() {
            Load::Normal(n) => NormalLoad::Force(n),
            Load::Approach(d) => NormalLoad::Approach(d),
        },
        stencil: Stencil::default(),
        tolerance: steady.tolerance,
        max_iterations: steady.max_iterations as usize,
    }
    .solve()
}

/// Collective: displacement and stress of both bodies under the reactions, and the contact fields, into `/VTKHDF`.
fn fields(
    world: &World,
    bodies: &Bodies,
    solvers: &mut [Statics],
    solved: Option<(&Interface, &SteadySolution)>,
    file: &mut ResultFile,
) -> Result<()> {
    let mut displacement = Vec::new();
    let mut von_mises = Vec::new();
    let mut contact = Vec::new();
    for place in &bodies.places {
        let body = &bodies.unique[place.body];
        // On the upper body the traction acts with the opposite sign; pressure acts into either.
        let t = if place.upper { -1.0 } else { 1.0 };
        let forces: Vec<f64> = solved.map_or(Vec::new(), |(s, r)| {
            (0..s.len())
                .flat_map(|i| [t * r.traction[i][0], t * r.traction[i][1], r.pressure[i]].map(|v| v * s.weight[i]))
                .collect()
        });
        let u = body.displacement(world, &mut solvers[place.body], &forces)?;
        let stress = stress::von_mises(&body.part, &u, &body.material);
        von_mises.push(body.at_all_nodes(world, &stress));
        displacement.push(u.into_flattened());
        let (pressure, traction, state): (&[f64], Vec<f64>, Vec<i8>) = match solved {
            Some((_, r)) => (&r.pressure, r.traction.concat(), r.state.iter().map(|&s| s as i8).collect()),
            None => (&[], Vec::new(), Vec::new()),
        };
        let nodes = place.grid.as_ref().map_or(&[][..], |g| &g.nodes);
        contact.push(contact_fields(world, &body.part, nodes, pressure, &traction, &state));
    }
    let mut all = vec![
        PointField::displacement(displacement.iter().map(Vec::as_slice).collect()),
        PointField::von_mises(von_mises.iter().map(Vec::as_slice).collect()),
    ];
    all.extend(PointField::contact(&contact));
    file.fields(&bodies.parts(), &all)
}

/// The group `/contact`.
fn tables(s: &Interface, r: &SteadySolution) -> Vec<Table> {
    let n = s.len();
    let points: Vec<[f64; 2]> = (0..n).map(|i| s.point(i)).collect();
    let list = |name: &str, units: &str, text: &str, values: Vec<f64>| {
        Table::list(&format!("/contact/{name}"), units, text, values)
    };
    let pairs = |name: &str, units: &str, text: &str, values: &[[f64; 2]]| {
        Table::new(&format!("/contact/{name}"), units, text, &[n, 2], values.concat())
    };
    let state: Vec<i8> = r.state.iter().map(|&s| s as i8).collect();
    vec![
        list(
            "x",
            "m",
            "Longitudinal position of the contact nodes; the leading edge is at negative x.",
            points.iter().map(|p| p[0]).collect(),
        ),
        list("y", "m", "Lateral position of the contact nodes.", points.iter().map(|p| p[1]).collect()),
        Table::list(
            "/contact/shape",
            "1",
            "Numbers of grid nodes along x and y; node (i, j) has index i + nx j.",
            vec![s.x.len() as i64, s.y.len() as i64],
        ),
        list("weight", "m²", "Area of each contact node: nodal force is pressure times area.", s.weight.clone()),
        list("gap0", "m", "Gap of the undeformed bodies at first touch.", s.gap.clone()),
        list("gap", "m", "Gap of the deformed bodies.", r.gap.clone()),
        list("pressure", "Pa", "Contact pressure.", r.pressure.clone()),
        pairs("traction", "Pa", "Tangential traction (x, y) on body 1.", &r.traction),
        pairs("creep", "m/s", "Creep velocity (x, y) of body 1 relative to body 2.", &r.creep),
        pairs("w", "m", "Tangential displacement difference u1 - u2 (x, y).", &r.w),
        Table::list("/contact/state", "-", "0 open, 1 stick, 2 slip.", state),
        Table::list("/contact/force", "N", "Contact force (x, y, z) on body 1.", r.force.to_vec()),
        Table::scalar(
            "/contact/moment_z",
            "N m",
            "Moment of the tractions on body 1 about the common normal.",
            r.moment_z,
        ),
        Table::scalar("/contact/approach", "m", "Rigid approach of the bodies from first touch.", r.approach),
        Table::scalar("/contact/residual", "1", "Residual of the contact laws, relative.", r.residual),
    ]
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
        summary.value("  over μN", format!("{:.4}, {:.4}", fx / limit, fy / limit));
    }
    summary.value("contact nodes closed / in stick", format!("{closed} / {stick}"));
    summary.value("residual, iterations", format!("{:.1e}, {}", r.residual, r.iterations));
}
