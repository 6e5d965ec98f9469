//! Stability with a contact of one point beside the discretised one: what discretising the contact changes.

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

/// On rank 0: the eigenvalues with one point in place of the contact that was `found`, by each law; none where the
/// job does not ask.
pub(super) fn wanted(examined: &StabilityProblem, found: &StabilityResult) -> Result<Option<Comparison>> {
    let StabilityProblem { job, stability, contact, model: (interface, pair) } = *examined;
    let Some(state) = found.state.as_ref().filter(|_| stability.contact == StabilityContact::Point) else {
        return Ok(None);
    };
    interface.single("analyses.stability.contact \"point\"")?;
    let ellipse = ellipse(job, contact, (interface, 0), &state.pressure)?.ok_or_else(|| {
        Error::Job(
            "analyses.stability.contact: found \"point\", but the pressure is not that of an ellipse whose \
             half-axes Kalker's table has \
             (ratios of 0.1 to 10); leave it out"
                .into(),
        )
    })?;
    let place = Footprint::of_pressure(interface, &state.pressure);
    let of = |(law, (_, _, force)): (usize, &(_, _, TotalForceLaw))| -> Result<LawSpectrum> {
        let friction = LinearForce::new(force, &ellipse, &creepage(contact), contact.speed, contact.law());
        let force = friction.force;
        let point =
            PointContact { place: &place, stiffness: ellipse.normal_stiffness(), speed: contact.speed, friction };
        let all = eigenpairs(pair, &point, stability.tolerance)?;
        let eigenpairs = listed_pairs(stability, all, found.spectrum.limit);
        let partners = partners(&eigenpairs, &found.spectrum.eigenpairs);
        Ok(LawSpectrum { law, force, eigenpairs, partners })
    };
    let laws = LAWS.iter().enumerate().map(of).collect::<Result<Vec<LawSpectrum>>>()?;
    Ok(Some(Comparison { ellipse, laws }))
}

/// Writes the summary lines of the comparison, beside the eigenvalues of `patch`, of which the first `listed` are told
/// of.
pub(super) fn summarise(all: &Comparison, patch: &Spectrum, listed: usize, summary: &mut Summary) {
    let names: Vec<&str> = all.laws.iter().map(|l| LAWS[l.law].1).collect();
    let unstable = |l: &LawSpectrum| l.eigenpairs.iter().filter(|e| grows(e.value, e.backward_error)).count();
    let counts: Vec<String> = all.laws.iter().map(|l| format!("{} by {}", unstable(l), LAWS[l.law].1)).collect();
    summary.line(format!(
        "contact of one point, half-axes {:.2} and {:.2} mm, {:.0} N/um; unstable: {}",
        1e3 * all.ellipse.a,
        1e3 * all.ellipse.b,
        1e-6 * all.ellipse.normal_stiffness(),
        counts.join(", ")
    ));
    summary.value("growth rates, 1/s", format!("patch; {}", names.join("; ")));
    for (i, e) in patch.eigenpairs.iter().enumerate().take(listed) {
        let of = |l: &LawSpectrum| l.partner(i).map_or("no such mode".into(), |value| format!("{:+.4}", value.re));
        let beside: Vec<String> = all.laws.iter().map(of).collect();
        summary.value(&format!("{:.3} Hz", e.frequency()), format!("{:+.4}; {}", e.growth_rate(), beside.join("; ")));
    }
}
