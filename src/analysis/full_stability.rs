//! The full analysis of a job: from the reduced spectrum to the full one, compared.

use super::bodies::{self, Bodies};
use super::report::Summary;
use super::run::Run;
use crate::body::FullSystem;
use crate::contact::LinearContact;
use crate::job;
use crate::model::{self, ModalPair};
use crate::parallel::World;
use crate::stability::full::cover::{partners, Wedge};
use crate::stability::full::{spectrum, Damping, FullBodies, FullOptions, FullPair, FullResult, FullSpectrum, Place};
use crate::stability::reduced::shares as shares_of;
use crate::stability::{grows, Spectrum};
use crate::{Error, Result};
use num_complex::Complex;

type C = Complex<f64>;

/// Collective: the full spectrum about a sliding contact; rank 0 gives the contact, the model and the spectrum of the `reduced` analysis.
pub fn run(
    run: &mut Run,
    wanted: &job::FullStability,
    bodies: &Bodies,
    reduced: Option<(&Spectrum, &LinearContact, &ModalPair)>,
) -> Result<FullResult> {
    let world = run.world();
    run.progress.stage("stability of the full system");
    world.on_root(|| match reduced {
        Some((f, ..)) if wanted.max_frequency > f.limit * (1.0 + 1e-12) => Err(Error::Job(format!(
            "analyses.stability.full.max_frequency is {} Hz, but the reduced model, which it is compared with, reaches {:.1} Hz; ask for more \
             modes in analyses.modes or for a lower limit",
            wanted.max_frequency, f.limit
        ))),
        _ => Ok(()),
    })?;
    let contact = shared_contact(world, reduced.map(|r| r.1));
    let guide: Vec<C> = world.broadcast(reduced.map(|r| r.0.all.clone()).unwrap_or_default());
    let (systems, modes) = (bodies.full_systems()?, bodies.shapes());
    let place = |(place, (name, body)): (&bodies::Place, (&str, &job::Body))| -> Result<Place> {
        let damping = Damping { alpha: body.damping.alpha, beta: body.damping.beta };
        let modal = match (&body.damping.modal, modes.get(place.body)) {
            (Some(_), Some(modes)) => model::damping(&body.damping, &modes.omega, &format!("bodies.{name}.damping"))?,
            (Some(_), None) => return Err(Error::Defect(format!("no modes of the body {name} to damp"))),
            (None, _) => Vec::new(),
        };
        Ok(Place { body: place.body, damping, modal })
    };
    let places = bodies.places.iter().zip(run.job.bodies()).map(place).collect::<Result<Vec<_>>>()?;
    let places: [Place; 2] =
        places.try_into().map_err(|_| Error::Defect("full stability of other than two bodies".into()))?;
    let options = FullOptions {
        max_frequency: wanted.max_frequency,
        damping_ratio: wanted.damping_ratio,
        count: wanted.count as usize,
        tolerance: wanted.tolerance,
    };
    let system = FullBodies { bodies: &systems, modes: &modes, places: &places };
    let mut spectrum = spectrum(run.petsc, system, &contact, &guide, &options, run.progress)?;
    let paired = world.on_root(|| {
        let full: Vec<C> = spectrum.pairs.iter().map(|p| p.value).collect();
        let reduced: Vec<C> = reduced.map(|r| r.0.eigenpairs.iter().map(|p| p.value).collect()).unwrap_or_default();
        partners(&full, &reduced, &Wedge::new(wanted.max_frequency, wanted.damping_ratio), wanted.agreement)
    })?;
    let mut order: Vec<usize> = (0..spectrum.pairs.len()).collect();
    order.sort_by(|&a, &b| spectrum.pairs[b].value.re.total_cmp(&spectrum.pairs[a].value.re));
    let partners = paired.map(|p| order.iter().map(|&i| p[i]).collect()).unwrap_or_default();
    let mut slots: Vec<Option<FullPair>> = spectrum.pairs.into_iter().map(Some).collect();
    spectrum.pairs = order.iter().filter_map(|&i| slots[i].take()).collect();
    let mut shares = Vec::new();
    for pair in &spectrum.pairs {
        let q = amplitudes(world, bodies, &systems, pair);
        if let Some((_, _, model)) = reduced {
            shares.push(shares_of(&model.omega, &q, pair.value));
        }
    }
    Ok(FullResult { spectrum, shares, partners })
}

/// Collective: modal amplitudes Φᵀ M u of both bodies, lower first.
fn amplitudes(world: &World, bodies: &Bodies, systems: &[&dyn FullSystem], pair: &FullPair) -> Vec<C> {
    let modes = bodies.shapes();
    let mut q = Vec::new();
    for (place, u) in bodies.places.iter().zip(&pair.motion) {
        let mut mu = vec![C::default(); u.len()];
        systems[place.body].mass().operator(world).apply(world, u, &mut mu);
        for phi in modes.get(place.body).iter().flat_map(|m| &m.vectors) {
            q.push(phi.iter().zip(&mu).map(|(p, m)| p * m).sum());
        }
    }
    world.sum_all(&q)
}

/// What the summary says of it.
pub fn summarise(found: &FullResult, summary: &mut Summary) {
    let FullSpectrum { pairs, shifts } = &found.spectrum;
    let worst = |of: &dyn Fn(&FullPair) -> f64| pairs.iter().map(of).fold(0.0, f64::max);
    let solves: usize = shifts.iter().map(|s| s.solves).sum();
    summary.line(format!(
        "stability of the full system: {} unstable of {} eigenvalues",
        pairs.iter().filter(|p| grows(p.value, p.residuals.backward_error)).count(),
        pairs.len()
    ));
    summary.value(
        "completeness",
        match shifts.len() {
            0 => "all eigenvalues at once, every one has its partner".into(),
            n => format!("{n} shifts, {solves} solves; discs meet, every eigenvalue has its partner"),
        },
    );
    summary.value(
        "accuracy",
        format!(
            "backward error {:.1e}, opening of closed nodes {:.1e}, change by one more iteration {:.1e}",
            worst(&|p| p.residuals.backward_error),
            worst(&|p| p.residuals.constraint),
            worst(&|p| p.residuals.correction)
        ),
    );
    let unstable = pairs.iter().filter(|p| grows(p.value, p.residuals.backward_error)).count();
    for p in pairs.iter().take(unstable.max(3)) {
        summary.value(
            &format!("{:.3} Hz", p.value.im / (2.0 * std::f64::consts::PI)),
            format!("growth rate {:+.4} 1/s", p.value.re),
        );
    }
}

/// Collective: the contact of rank 0 on every rank.
fn shared_contact(world: &World, contact: Option<&LinearContact>) -> LinearContact {
    LinearContact::from_numbers(&world.broadcast(contact.map(LinearContact::numbers).unwrap_or_default()))
}
