//! Checks of the contact before anything is factorised: whether the bodies overlap, how large the contact will be on
//! half-spaces of their materials, whether the patch holds it, and whether the grid resolves it.

mod patch;

use super::bodies::matrices_of;
use super::interface::interface_between;
use super::meshes::{Meshed, Meshes};
use super::positioned_mesh::axle;
use super::surfaces;
use crate::grid::Interface;
use crate::job::{Contact, ContactPlaces, Job, ModesExtent};
use crate::mesh::attitude::Attitude;
use crate::mesh::{quality, Mesh};
use crate::output::datasets::branches::EarlierCycle;
use crate::output::datasets::cycle_motions::{self, is_of_sweep};
use crate::output::Reader;
use crate::{Error, Result};
use std::rc::Rc;

/// Meshes of more nodes are not made for `railsqueal check`; a run makes them in any case.
const NODES: u64 = 3_000_000;

/// Lines and warnings about a contact.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PreflightReport {
    /// Lines of the report.
    pub lines: Vec<String>,
    /// Properties that make results doubtful.
    pub warnings: Vec<String>,
}

/// Lines and warnings about a `job` for a run, before anything is factorised: the examination of [`of_job`]. The meshes
/// of bodies that the run does not make, as `made` tells, are not made for it. For rank 0.
///
/// # Errors
/// As [`of_job`].
pub(crate) fn of_run(job: &Job, meshes: &Meshes, made: bool) -> Result<PreflightReport> {
    let report = if made { of_bodies(job, meshes)? } else { PreflightReport::default() };
    with_files(job, report)
}

/// Lines and warnings about a `job` for `railsqueal check`, on meshes made for it unless they have too many `nodes`
/// together. For rank 0.
///
/// # Errors
/// Meshes with elements that are inverted, or that are beside the contact point; contacts that cannot be computed;
/// files that cannot be read.
pub fn of_job(job: &Job, meshes: &Meshes, nodes: u64) -> Result<PreflightReport> {
    let report = match nodes > NODES && !job.is_reduced_anew() {
        true => {
            let text = format!("meshes of {nodes} nodes are not made for a check; run examines them");
            PreflightReport { lines: vec![text], warnings: Vec::new() }
        }
        false => of_bodies(job, meshes)?,
    };
    with_files(job, report)
}

/// Warnings about the contact of a `job` on the `interface` of an earlier run, whose bodies are not made.
///
/// # Errors
/// A contact that cannot be computed.
pub(crate) fn of_interface(job: &Job, interface: &Interface) -> Result<PreflightReport> {
    let alone = job.contact.as_ref().is_some_and(|contact| contact.further.is_empty());
    if wanted(job) && alone {
        foreseen(job, interface)
    } else {
        Ok(PreflightReport::default())
    }
}

/// The `report` with what the sections of rails and the files of roughness were understood as.
fn with_files(job: &Job, mut report: PreflightReport) -> Result<PreflightReport> {
    report.lines.splice(0..0, super::rail::measured(job)?);
    report.lines.extend(super::roughness::described(job)?);
    earlier_cycles(job)?;
    Ok(report)
}

/// An error if a branch of limit cycles is to begin from a cycle that an earlier result has not.
fn earlier_cycles(job: &Job) -> Result<()> {
    let Some(cycles) = &job.analyses.cycles else { return Ok(()) };
    for (k, given) in cycles.starts.results.iter().enumerate() {
        let wanted = (&cycles.along[..], given.cycle as usize);
        let examine = |file: Reader| match is_of_sweep(&file) {
            true => cycle_motions::examine(&file, wanted).map(drop),
            false => EarlierCycle::examine(&file, wanted).map(drop),
        };
        let path = format!("analyses.cycles.starts.results[{k}]");
        Reader::open(&given.file).and_then(examine).map_err(|e| e.context(path))?;
    }
    Ok(())
}

/// Lines and warnings about the bodies and their contact.
fn of_bodies(job: &Job, meshes: &Meshes) -> Result<PreflightReport> {
    let mut report = PreflightReport::default();
    if let (Some(transient), Some(contact)) = (&job.analyses.transient, &job.contact) {
        super::transient_problem::histories(transient, contact)?;
        super::roughness::refuse_others(job, contact.all().count())?;
    }
    if job.is_disc_with_pads() {
        report.lines.extend(super::swept::inertia(job)?.into_iter().map(|line| job.bodies.with_names(line)));
        report.lines.extend(super::disc_and_pads::examine(job)?);
        if let (Some(read), Some(pads)) = (super::disc_and_pads::examine_pads(job, meshes)?, &job.bodies.upper) {
            let (_, more) = described(job, job.bodies.name_of("upper"), pads, &read)?;
            report.lines.extend(read.remarks.iter().cloned().chain(more.lines));
            report.warnings.extend(more.warnings);
        }
        return Ok(report);
    }
    if job.by_matrices() {
        // They are read whole: whether they fit each other and the contacts is not to be seen in their heads.
        let read = |(name, body)| matrices_of(name, body).map(drop);
        return Error::all(job.bodies().into_iter().map(read)).map(|()| report);
    }
    if job.placement().is_some() {
        let all = super::wheel_rail_geometry::PlacedContact::each(job)?;
        let Some(placed) = all.first() else { return Ok(report) };
        for (name, body) in job.bodies().into_iter().filter(|(_, b)| b.is_meshed()) {
            let (_, found) = of_mesh(job, meshes, name, body)?;
            report.lines.extend(found.lines);
            report.warnings.extend(found.warnings);
            for (number, at) in all.iter().enumerate() {
                let (stands, _) = at.standing(placed, (job, meshes), name, body)?;
                let of = if all.len() > 1 { format!(", contact {}", number + 1) } else { String::new() };
                report.lines.push(format!("body {name}{of}: {}", stands.text));
                let axle = axle(body, &stands).filter(|_| number == 0);
                report.warnings.extend(axle.map(|text| format!("bodies.{name}.mesh: {text}")));
            }
        }
        let mut touching = placed.lines();
        for ((number, contact), at) in job.contact.iter().flat_map(Contact::all).enumerate().zip(&all) {
            at.refuse_sections(job)?;
            if number > 0 {
                let wheel = at.wheel_of(job).map_or(String::new(), |wheel| format!(", {wheel}"));
                touching.push(format!("contact {}{wheel}:", number + 1));
                touching.extend(at.lines());
            }
            if wanted(job) {
                let found = foreseen_at((job, contact), &at.interface()?)?;
                report.lines.extend(found.lines);
                report.warnings.extend(found.warnings);
            }
        }
        touching.extend(super::wheel_rail_geometry::common_lines(job, &all));
        report.lines.splice(0..0, touching);
        let carried = super::absorbers::of_job(job)?;
        report.lines.splice(0..0, super::swept::inertia(job)?.into_iter().chain(carried.lines));
        report.warnings.extend(carried.warnings);
        let one = job.contact.as_ref().is_some_and(|c| c.places == ContactPlaces::One);
        let left_out = if one { placed.warnings() } else { Vec::new() };
        report.warnings.splice(0..0, left_out.into_iter().chain(super::wheel_rail_geometry::noise(job, placed)));
        return Ok(report);
    }
    if job.is_swept() {
        let other = |(key, _): &(String, _)| key.starts_with("others.");
        for (key, body) in job.all_bodies().into_iter().filter(other) {
            meshes.section_size(body).map_err(|e| e.context(format!("bodies.{key}.mesh")))?;
        }
        if wanted(job) {
            for (number, contact) in job.contact.iter().flat_map(Contact::all).enumerate() {
                let upper = job.upper_at(contact).map(|(_, body)| body);
                let grid = |body: Option<&crate::job::Body>| match body {
                    Some(body) => super::swept::grid(contact, body),
                    None => Ok(None),
                };
                let (Some(lower), Some(upper)) = (grid(job.bodies.lower.as_ref())?, grid(upper)?) else { continue };
                let found =
                    foreseen_at((job, contact), &interface_between(&lower, &upper)?).map_err(|e| match number {
                        0 => e,
                        _ => e.context(format!("contact.around.{}", number - 1)),
                    })?;
                if number > 0 {
                    report.lines.push(format!("contact {}, {}:", number + 1, contact.around_text()));
                }
                report.lines.extend(found.lines);
                report.warnings.extend(found.warnings);
            }
        }
        let carried = super::absorbers::of_job(job)?;
        report.lines.splice(0..0, super::swept::inertia(job)?.into_iter().chain(carried.lines));
        report.warnings.extend(carried.warnings);
        return Ok(report);
    }
    let found: Vec<Result<(Rc<Meshed>, PreflightReport)>> =
        job.bodies().into_iter().map(|(name, body)| of_mesh(job, meshes, name, body)).collect();
    // The faults of both.
    Error::all(found.iter().map(|f| f.as_ref().map(drop).map_err(Error::clone)))?;
    let mut meshed: Vec<Rc<Meshed>> = Vec::new();
    for found in found {
        let (mesh, found) = found?;
        report.lines.extend(found.lines);
        report.warnings.extend(found.warnings);
        meshed.push(mesh);
    }
    if let ([lower, upper], true) = (&meshed[..], wanted(job)) {
        // What is odd about the meshes may be why there is no such contact.
        let why = |e| report.warnings.iter().fold(e, Error::with);
        let meeting = surfaces::meet(job, [lower, upper]).map_err(why)?;
        let [lower, upper] = &meeting.grids[..] else { return Err(Error::Defect("a contact of one grid".into())) };
        let found = interface_between(lower, upper).and_then(|between| foreseen(job, &between)).map_err(why)?;
        report.lines.extend(meeting.lines.into_iter().chain(found.lines));
        report.warnings.extend(meeting.warnings.into_iter().chain(found.warnings));
    }
    Ok(report)
}

/// Reads the mesh of the body `name` and describes it: size, mass, worst element, modes, and position.
fn of_mesh(job: &Job, meshes: &Meshes, name: &str, body: &crate::job::Body) -> Result<(Rc<Meshed>, PreflightReport)> {
    let found = meshes.mesh(job, name, body)?;
    let (attitude, mut report) = described(job, name, body, &found)?;
    let lies = super::mesh_diagnostics::diagnose(job, name, body, &found, &attitude)?;
    report.lines.extend(lies.lines);
    report.warnings.extend(lies.warnings);
    Ok((found, report))
}

/// Describes the mesh `found` of the body `name`: size, mass, worst element, modes.
fn described(job: &Job, name: &str, body: &crate::job::Body, found: &Meshed) -> Result<(Attitude, PreflightReport)> {
    let mut report = PreflightReport::default();
    let material = body.elastic()?;
    let mesh = &found.mesh;
    let mut worst = (f64::INFINITY, 0);
    for (number, cell) in mesh.cells.iter().enumerate() {
        let x: Vec<[f64; 3]> = cell.nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
        let [low, high] = quality::jacobian_range(cell.kind, &x);
        if !(low / high >= worst.0) {
            worst = (low / high, number);
        }
    }
    if !(worst.0 > 0.0) {
        return Err(Error::Input(format!(
            "bodies.{name}.mesh: element {} is inverted or degenerate: its smallest Jacobian is {:.3} of its \
             largest, expected more than 0; \
             repair the mesh",
            worst.1 + 1,
            worst.0
        )));
    }
    let attitude = Attitude::from_mesh(mesh);
    let mass = attitude.volume * material.density;
    let extent = [0, 1, 2].map(|c| attitude.high[c] - attitude.low[c]);
    report.lines.push(format!(
        "body {name}: {:.4} x {:.4} x {:.4} m, {mass:.4e} kg, smallest over largest Jacobian of an element {:.2}",
        extent[0], extent[1], extent[2], worst.0
    ));
    if mass > HEAVY {
        report.warnings.push(format!(
            "bodies.{name}: {mass:.1e} kg and {:.1} m long: is the mesh in mm? Lengths are in m",
            extent[0].max(extent[2])
        ));
    }
    modes(job, name, body, (attitude.volume, mesh), &mut report)?;
    Ok((attitude, report))
}

/// More modes than this are warned of.
const MANY: f64 = 1000.0;

/// How many modes are asked for of a body of this volume (m³) on its mesh, whether it has so many, and what they
/// take. Up to a frequency there are, for short waves, V ω³ (1/c_L³ + 2/c_T³)/6π² of them (P. Debye, *Ann. Phys.* 39
/// (1912)); the surface, and bending where the body is thin, add to that.
fn modes(
    job: &Job,
    name: &str,
    body: &crate::job::Body,
    (volume, mesh): (f64, &Mesh),
    report: &mut PreflightReport,
) -> Result<()> {
    let Some(wanted) = &job.analyses.modes else { return Ok(()) };
    let (m, key) = (
        body.elastic()?,
        match wanted.extent() {
            ModesExtent::Count(_) => "count",
            ModesExtent::MaxFrequency(_) => "max_frequency",
        },
    );
    let count = match wanted.extent() {
        ModesExtent::Count(n) => n as f64,
        ModesExtent::MaxFrequency(f) => {
            let shear = m.young / (2.0 * (1.0 + m.poisson));
            let [long, trans] =
                [2.0 * shear * (1.0 - m.poisson) / (1.0 - 2.0 * m.poisson), shear].map(|g| (g / m.density).sqrt());
            let omega = std::f64::consts::TAU * f;
            volume * omega.powi(3) * (long.powi(-3) + 2.0 * trans.powi(-3)) / (6.0 * std::f64::consts::PI.powi(2))
        }
    };
    let nodes = mesh.nodes.len();
    let held = body.fixed.iter().filter_map(|group| mesh.groups.get(group)).flatten();
    let held: std::collections::BTreeSet<u32> = held.flat_map(|&facet| mesh.cells.facet(facet)).collect();
    let free = 3 * (nodes - held.len());
    if matches!(wanted.extent(), ModesExtent::Count(n) if n > free) {
        return Err(Error::Job(format!(
            "analyses.modes.count: {count} modes are asked for, but body \"{name}\" has only {free} degrees of freedom"
        )));
    }
    if count > MANY {
        let bytes = 2.0 * 8.0 * 3.0 * nodes as f64 * count;
        report.warnings.push(format!(
            "analyses.modes.{key}: about {count:.0} modes of body {name} take {:.1} GB while they are computed, \
             each some solves with the factor, and each step of \
             stability grows with the third power of their number: hundreds are usual",
            bytes / 1e9
        ));
    }
    Ok(())
}

/// A body above this mass, kg, is hardly a wheel or a rail.
const HEAVY: f64 = 1e7;

fn wanted(job: &Job) -> bool {
    !job.analyses.on_contact().is_empty() && !job.is_reduced_anew()
}

/// The contact on a grid. The own point of a sweep may fail: the others are computed all the same.
fn foreseen(job: &Job, s: &Interface) -> Result<PreflightReport> {
    job.contact.as_ref().map_or(Ok(PreflightReport::default()), |contact| foreseen_at((job, contact), s))
}

/// The same of one of its contacts.
fn foreseen_at((job, at): (&Job, &Contact), s: &Interface) -> Result<PreflightReport> {
    match patch::foreseen((job, at), s) {
        Err(e) if job.sweep.is_some() => {
            Ok(PreflightReport { lines: Vec::new(), warnings: vec![e.message().to_owned()] })
        }
        found => found,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::example::two_cylinders;

    fn report(sets: &[&str]) -> Result<PreflightReport> {
        let job = two_cylinders(sets);
        of_job(&job, &Meshes::default(), 0)
    }

    /// The paper's cylinders: Hertz' radius is 4.88 mm at 70 kN, elements are 1 mm.
    #[test]
    fn the_contact_of_the_papers_cylinders_is_foreseen() {
        let found = report(&[]).unwrap();
        assert_eq!(found.warnings, [] as [String; 0]);
        let line = found.lines.last().unwrap();
        let word =
            |after: &str| line.split(after).nth(1).unwrap().split_whitespace().next().unwrap().parse::<f64>().unwrap();
        let (closed, half, pressure) = (word("about "), word("half lengths "), word("largest pressure "));
        // The edge lies anywhere between a closed node and an open one.
        assert!((closed / 75.0 - 1.0).abs() < 0.1 && (half - 4.884).abs() < 1.0, "{line}");
        assert!((pressure - 1401.0).abs() < 70.0, "{line}");
        // No node lies at the very front of the wheel.
        assert!(found.lines[0].contains("x 0.1000 x 1.0000 m, 5.8"), "{found:?}");
    }

    #[test]
    fn a_coarse_contact_is_warned_of_with_a_size_that_would_do() {
        let size = ["lower", "upper"].map(|b| format!("bodies.{b}.mesh.cylinder.element_size=0.003"));
        let patch = ["contact.patch.half_length=0.012", "contact.patch.half_width=0.012"];
        let found = report(&[&size[0], &size[1], patch[0], patch[1]]).unwrap();
        let [warning] = &found.warnings[..] else { panic!("{found:?}") };
        let size: f64 = warning.split("elements of ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((1.1e-3..1.6e-3).contains(&size), "{warning}");
        // With that size there is no warning any more.
        let size = ["lower", "upper"].map(|b| format!("bodies.{b}.mesh.cylinder.element_size={}", 0.95 * size));
        assert_eq!(report(&[&size[0], &size[1], patch[0], patch[1]]).unwrap().warnings, [] as [String; 0]);
    }

    /// The lateral force at 1 mm is 7.5 % too small.
    #[test]
    fn a_grid_that_is_coarse_for_spin_is_warned_of() {
        let spin = "contact.creepage={\"spin\": 0.4}";
        let found = report(&[spin]).unwrap();
        let [warning] = &found.warnings[..] else { panic!("{found:?}") };
        let part: f64 = warning.split("too small by ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        // The half length is known to half a spacing.
        assert!(warning.contains("1.00 mm apart") && (6.0..11.0).contains(&part), "{warning}");
        // With the spacing that it names, or a lateral creepage beside, there is none.
        let size = ["lower", "upper"].map(|b| format!("bodies.{b}.mesh.cylinder.element_size=0.00035"));
        assert_eq!(report(&[spin, &size[0], &size[1]]).unwrap().warnings, [] as [String; 0]);
        assert_eq!(report(&[spin, "contact.creepage.lateral=0.003"]).unwrap().warnings, [] as [String; 0]);
    }

    #[test]
    fn a_patch_that_does_not_hold_the_contact_is_refused() {
        let error = report(&["contact.patch.half_length=0.004"]).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("half_length") && error.to_string().contains("enlarge"), "{error}");
    }

    #[test]
    fn thousands_of_modes_are_counted_and_warned_of() {
        let set = |modes: &str| report(&[&format!("analyses.modes={modes}")]).unwrap().warnings;
        assert_eq!(set("{\"max_frequency\": 5000}"), [] as [String; 0]);
        assert_eq!(set("{\"count\": 3000}").len(), 2, "of each body");
        // More than there are, as a run finds.
        let coarse = ["element_size=0.002", "growth=2.0", "max_element_size=0.05"];
        let both = |key: &str| ["lower", "upper"].map(|b| format!("bodies.{b}.mesh.cylinder.{key}"));
        let mut sets: Vec<String> = coarse.iter().flat_map(|key| both(key)).collect();
        sets.push("analyses.modes={\"count\": 100000}".into());
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let error = report(&sets).expect_err("so many there are not");
        assert!(error.exit_code() == 2 && error.message().contains("degrees of freedom"), "{error}");
        let warnings = set("{\"max_frequency\": 50000}");
        let count = warnings[0].split("about ").nth(1).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap();
        // A disc of steel, c_L 5948 and c_T 3179 m/s, less what facets and the crown take.
        let volume = std::f64::consts::PI * (0.25 - 0.01) * 0.1;
        let waves = 5948.0f64.powi(-3) + 2.0 * 3179.0f64.powi(-3);
        let by_hand = volume * (std::f64::consts::TAU * 5e4).powi(3) * waves / (6.0 * std::f64::consts::PI.powi(2));
        assert!((count / by_hand - 1.0).abs() < 0.05, "{warnings:?}, by hand {by_hand}");
    }

    #[test]
    fn a_mesh_in_millimetres_is_warned_of() {
        let sets = ["inner_radius=100", "outer_radius=500", "thickness=100", "crown_radius=500", "element_size=40"];
        let sets: Vec<String> = sets.iter().map(|s| format!("bodies.lower.mesh.cylinder.{s}")).collect();
        let mut job = two_cylinders(&[]);
        job.contact = None;
        job.bodies.upper = None;
        job.analyses.steady = None;
        job.analyses.stability = None;
        let mut value = job.to_json();
        for set in &sets {
            let (path, number) = set.split_once('=').unwrap();
            let at = format!("/{}", path.replace('.', "/"));
            *value.pointer_mut(&at).unwrap() = serde_json::json!(number.parse::<f64>().unwrap());
        }
        value["bodies"]["lower"]["mesh"]["cylinder"]["max_element_size"] = serde_json::json!(60.0);
        let text = value.to_string();
        let job = Job::from_bytes(text.as_bytes(), std::path::Path::new("job.json"), &[], None).unwrap();
        let found = of_job(&job, &Meshes::default(), 0).unwrap();
        assert!(found.warnings[0].contains("is the mesh in mm"), "{found:?}");
    }
}
