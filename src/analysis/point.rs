//! Stability with one point in place of each contact beside the discretised ones: what discretising them changes.

use crate::case::interface::creepage;
use crate::case::stability_problem::{StabilityProblem, StabilityResult};
use crate::contact::baseline::{EllipticContact, Footprint, LinearForce, TotalForceLaw, LAWS};
use crate::grid::Interface;
use crate::job::{self, Job, StabilityContact};
use crate::stability::point::{eigenpairs, partners, Comparison, LawSpectrum, PointContact};
use crate::stability::{grows, listed_pairs, Spectrum};
use crate::summary::Summary;
use crate::{Error, Result};

/// The ellipse of the contact `number` of the interface under `pressure` (Pa, `[n]`) on half-spaces of the bodies'
/// materials, with the coefficient of friction at the rigid creep of the centre. None where there is no ellipse in the
/// range of the table of Kalker's coefficients.
pub(super) fn ellipse(
    job: &Job,
    contact: &job::Contact,
    (s, number): (&Interface, usize),
    pressure: &[f64],
) -> Result<Option<EllipticContact>> {
    let mut materials = [(0.0, 0.0); 2];
    for ((_, body), m) in job.bodies().into_iter().zip(&mut materials) {
        let material = body.elastic()?;
        *m = (material.young, material.poisson);
    }
    let nodes = s.patches[number].nodes().map(|i| (s.point(i), pressure[i] * s.weight[i]));
    let c = creepage(contact);
    let friction = contact.law().coefficient(contact.speed * c.longitudinal.hypot(c.lateral));
    Ok(EllipticContact::of_pressure(nodes, friction, materials))
}

/// On rank 0: the eigenvalues with one point in place of each contact that was `found`, by each law; none where the
/// job does not ask.
pub(super) fn wanted(examined: &StabilityProblem, found: &StabilityResult) -> Result<Option<Comparison>> {
    let StabilityProblem { job, stability, contact, model: (interface, pair) } = *examined;
    let Some(state) = found.state.as_ref().filter(|_| stability.contact == StabilityContact::Point) else {
        return Ok(None);
    };
    let point = |(number, one): (usize, &job::Contact)| -> Result<Option<(EllipticContact, Footprint)>> {
        let mut pressure = vec![0.0; interface.len()];
        let own = interface.patches[number].nodes();
        pressure[own.clone()].copy_from_slice(&state.pressure[own]);
        // One that is open carries nothing.
        if pressure.iter().all(|p| *p <= 0.0) {
            return Ok(None);
        }
        let ellipse = ellipse(job, one, (interface, number), &pressure)?.ok_or_else(|| {
            let which = if contact.further.is_empty() { String::new() } else { format!(" of contact {}", number + 1) };
            Error::Job(format!(
                "analyses.stability.contact: found \"point\", but the pressure{which} is not that of an ellipse whose \
                 half-axes Kalker's table has (ratios of 0.1 to 10); leave it out"
            ))
        })?;
        Ok(Some((ellipse, Footprint::of_pressure(interface, &pressure))))
    };
    let points = contact.all().enumerate().map(point).collect::<Result<Vec<_>>>()?;
    let of = |(law, (_, _, force)): (usize, &(_, _, TotalForceLaw))| -> Result<LawSpectrum> {
        let (mut contacts, mut forces) = (Vec::new(), Vec::new());
        for (one, point) in contact.all().zip(&points) {
            let Some((ellipse, place)) = point else {
                forces.push([0.0; 2]);
                continue;
            };
            let friction = LinearForce::new(force, ellipse, &creepage(one), one.speed, one.law());
            forces.push(friction.force);
            contacts.push(PointContact { place, stiffness: ellipse.normal_stiffness(), speed: one.speed, friction });
        }
        let all = eigenpairs(pair, &contacts, stability.tolerance)?;
        let eigenpairs = listed_pairs(stability, all, found.spectrum.limit);
        let partners = partners(&eigenpairs, &found.spectrum.eigenpairs);
        Ok(LawSpectrum { law, forces, eigenpairs, partners })
    };
    let laws = LAWS.iter().enumerate().map(of).collect::<Result<Vec<LawSpectrum>>>()?;
    Ok(Some(Comparison { ellipses: points.into_iter().map(|point| point.map(|(ellipse, _)| ellipse)).collect(), laws }))
}

/// Writes the summary lines of the comparison, beside the eigenvalues of `patch`, of which the first `listed` are told
/// of.
pub(super) fn summarise(all: &Comparison, patch: &Spectrum, listed: usize, summary: &mut Summary) {
    let names: Vec<&str> = all.laws.iter().map(|l| LAWS[l.law].1).collect();
    let unstable = |l: &LawSpectrum| l.eigenpairs.iter().filter(|e| grows(e.value, e.backward_error)).count();
    let counts: Vec<String> = all.laws.iter().map(|l| format!("{} by {}", unstable(l), LAWS[l.law].1)).collect();
    let axes = |e: &Option<EllipticContact>| match e {
        Some(e) => {
            let stiffness = 1e-6 * e.normal_stiffness();
            format!("half-axes {:.2} and {:.2} mm, {stiffness:.0} N/um", 1e3 * e.a, 1e3 * e.b)
        }
        None => "open".into(),
    };
    let axes: Vec<String> = all.ellipses.iter().map(axes).collect();
    let which = if axes.len() > 1 { "contacts of one point each" } else { "contact of one point" };
    summary.line(format!("{which}, {}; unstable: {}", axes.join("; "), counts.join(", ")));
    summary.value("growth rates, 1/s", format!("patch; {}", names.join("; ")));
    for (i, e) in patch.eigenpairs.iter().enumerate().take(listed) {
        let of = |l: &LawSpectrum| l.partner(i).map_or("no such mode".into(), |value| format!("{:+.4}", value.re));
        let beside: Vec<String> = all.laws.iter().map(of).collect();
        summary.value(&format!("{:.3} Hz", e.frequency()), format!("{:+.4}; {}", e.growth_rate(), beside.join("; ")));
    }
}
