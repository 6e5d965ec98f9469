//! The steps of a run in words, for `railsqueal check`.

use super::{models, BodySize};
use crate::analysis::steps::{steps, PriorRun, Step};
use crate::job::{self, Compliance, Contact, Job, LinearSolver, Load, MeshSource, ModesExtent, TransientModel};

/// Steps of a run of `job`, in order, one line each.
pub(super) fn lines(job: &Job, bodies: &[BodySize], alike: bool) -> Vec<String> {
    let once = if alike { " (the bodies are described alike: computed once)" } else { "" };
    let decay = job.analyses.track_decay.as_ref().map(|wanted| {
        format!("track decay rates of the rail without ends: {} frequencies in each of 14 third octaves", wanted.lines)
    });
    let steps = steps(job, PriorRun::default());
    let mut lines: Vec<String> =
        decay.into_iter().chain(steps.into_iter().filter_map(|s| line(s, job, bodies, once))).collect();
    if let Some(sweep) = &job.sweep {
        let models = models(sweep).len();
        lines.push(format!(
            "{} of {}: {} points on {models} {} model{}",
            if job.analyses.uncertainty.is_some() { "uncertainty" } else { "sweep" },
            sweep.keys.join(", "),
            sweep.points.len(),
            if job.by_matrices() { "reduced" } else { "finite-element" },
            if models == 1 { "" } else { "s" }
        ));
    }
    lines
}

fn modes(job: &Job, once: &str) -> Option<String> {
    job.analyses.modes.as_ref().map(|modes| match modes.extent() {
        ModesExtent::Count(n) => format!("modes: the {n} lowest of each body{once}"),
        ModesExtent::MaxFrequency(f) => format!("modes: all of each body up to {f} Hz{once}"),
    })
}

/// Describes the terms of supports in the matrices of the bodies.
fn supports(job: &Job) -> String {
    let of = |(name, body): (&str, &job::Body)| {
        let groups: Vec<&str> = body.supports.iter().map(|s| s.group.as_str()).collect();
        let damping = if body.supports.iter().any(job::Support::damps) { ", with a damping matrix" } else { "" };
        (!groups.is_empty()).then(|| format!("; {name} on supports at {}{damping}", groups.join(", ")))
    };
    job.bodies().into_iter().filter_map(of).collect()
}

/// Describes the given quantities of the contact.
fn given(contact: &Contact) -> String {
    if contact.name.is_some() {
        let of = |one: &Contact| {
            let (name, cells) = (one.name.as_deref().unwrap_or_default(), one.points.iter().flatten().count());
            let load = one.normal_load.unwrap_or(0.0);
            format!("{name} of {cells} cells, normal load {load} N, friction {}", one.law())
        };
        return contact.all().map(of).collect::<Vec<_>>().join("; ");
    }
    if let Some(points) = &contact.points {
        let pressed = match (contact.normal_load, contact.approach) {
            (Some(n), _) => format!("normal load {n} N"),
            (None, Some(d)) => format!("approach {d} m"),
            (None, None) => "forces one by one".into(),
        };
        return format!("{} contact points, {pressed}, friction {}", points.len(), contact.friction);
    }
    let load = match (contact.vertical_load, contact.lateral_force, contact.load()) {
        (Some(q), Some(y), _) => format!("vertical load {q} N, lateral force {y} N"),
        (Some(q), None, _) => format!("vertical load {q} N"),
        (None, _, Load::Normal(_)) if contact.axle_load.is_some() => {
            let [load, moment] = [contact.axle_load.unwrap_or(0.0), contact.roll_moment];
            format!("axle load {load} N, roll moment {moment} N m")
        }
        (None, _, Load::Normal(n)) => format!("normal load {n} N"),
        (None, _, Load::Approach(d)) => format!("approach {d} m"),
    };
    let c = contact.creepage;
    let creepages = match &contact.placement {
        Some(_) => "those of the placement".into(),
        None => format!("{} {} {} 1/m", c.longitudinal, c.lateral, c.spin),
    };
    let torque = contact.torque.map_or(String::new(), |torque| format!(", torque on the axle {torque} N m"));
    let zones = if contact.friction_zones.is_empty() { "" } else { " outside its zones" };
    let (friction, speed) = (&contact.friction, contact.speed);
    format!("{load}, friction {friction}{zones}, speed {speed} m/s, creepages {creepages}{torque}")
}

/// A step in words; some are not worth a line.
fn line(step: Step, job: &Job, bodies: &[BodySize], once: &str) -> Option<String> {
    let (wanted, contact) = (&job.analyses, job.contact.as_ref());
    match step {
        Step::PriorRun | Step::EarlierShapes | Step::EarlierModes | Step::Geometry | Step::FreeModes => None,
        Step::Bodies if job.is_disc_with_pads() => {
            let of_pads = if job.by_matrices() { "mass, damping and stiffness" } else { "the mesh" };
            Some(format!("section of the disc; {of_pads} of the pads from files"))
        }
        Step::Bodies if job.by_matrices() => Some("mass, damping and stiffness from files".into()),
        Step::Bodies if job.placement().is_some() => Some("the wheel on the rail: gap and creepages".into()),
        Step::Bodies if job.is_swept() => Some("sections of the bodies that are swept".into()),
        Step::Bodies if job.bodies().iter().any(|(_, b)| matches!(b.mesh, Some(MeshSource::File(_)))) => {
            Some(format!("mesh files, read once by rank 0, distributed; stiffness and mass{}", supports(job)))
        }
        Step::Bodies => Some(format!("meshes, distributed; stiffness and mass{}", supports(job))),
        Step::Solvers if job.is_swept() => {
            contact.map(|_| format!("statics of each body{once} under loads at the contact, by orders"))
        }
        Step::Solvers => Some(match job.solver.linear {
            LinearSolver::Mumps => format!("factorisation of the stiffness of each body{once}"),
            LinearSolver::Gamg => format!("multigrid for the stiffness of each body{once}"),
        }),
        Step::FreeSolvers => Some("(what solves with the stiffness is freed)".into()),
        Step::Modes => modes(job, once),
        Step::Model => contact.map(|contact| {
            let nodes = bodies.iter().map(|b| b.contact_nodes).max().unwrap_or(0);
            let source = match contact.compliance {
                _ if job.by_matrices() => "the matrices".into(),
                Compliance::Fe => format!("finite elements{once}"),
                Compliance::HalfSpace => "elastic half-spaces, as convolutions".into(),
                Compliance::Hybrid => "half-spaces and the statics of the bodies".into(),
            };
            format!("compliance of {nodes} contact nodes ({} rows) from {source}", 3 * nodes)
        }),
        Step::Receptance => wanted.receptance.as_ref().map(|receptance| {
            let count = receptance.frequency.numbers().map_or(0, |f| f.len());
            let what = if count == 1 { "frequency" } else { "frequencies" };
            format!("receptances of the contact point at {count} {what}")
        }),
        Step::Stability => wanted.stability.as_ref().zip(contact).map(|(stability, contact)| {
            let full = stability.full.as_ref().map_or(String::new(), |full| {
                let most = full.max_frequency;
                let way = if job.by_matrices() { "at once" } else { "by successive shifts" };
                format!(
                    "\n  stability of the full system: all eigenvalues up to {most} Hz {way}, compared with \
                 those of the modes"
                )
            });
            format!("stability of steady {} on the modes: {}{full}", moves(stability), given(contact))
        }),
        Step::Steady => {
            wanted.steady.as_ref().zip(contact).map(|(steady, contact)| {
                format!("steady rolling: {}, tolerance {:e}", given(contact), steady.tolerance)
            })
        }
        Step::CreepCurve => wanted.creep_curve.as_ref().map(|curve| {
            let count = curve.numbers().map_or(0, |v| v.len());
            format!("creep curve: steady rolling at {count} values of the {} creepage", curve.key.name())
        }),
        Step::Transient => wanted.transient.as_ref().map(|t| {
            let sound = t.sound_power.as_ref().map_or("", |_| "; sound power radiated in it, in third octaves");
            let count = (t.duration / t.step).round();
            let moved = match t.model {
                TransientModel::Reduced => "on the modes",
                TransientModel::Full => "on all degrees of freedom, with one factorisation for each body",
            };
            format!("transient {moved}: {count} steps of {} s, {} s{sound}", t.step, t.duration)
        }),
        Step::Cycles => wanted.cycles.as_ref().map(|c| {
            let stable = if c.stability { ", with their multipliers" } else { "" };
            format!(
                "limit cycles over {} from {} to {}: at most {} in each direction from each that is marched for at \
                 most {} s; {} harmonics, {} steps of a period{stable}",
                c.along, c.from, c.to, c.most, c.march.duration, c.harmonics, c.samples
            )
        }),
    }
}

/// Describes the motion of the contact about which stability is examined.
fn moves(stability: &crate::job::Stability) -> &'static str {
    match stability.state() {
        crate::job::StabilityState::Steady => "rolling",
        crate::job::StabilityState::Sliding => "sliding",
    }
}
