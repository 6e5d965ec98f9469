//! The full analysis of a job: from the reduced spectrum to the full one, compared.

use super::run::Run;
use super::stability::without_oscillation;
use crate::body::rigid_motions::in_springs;
use crate::body::{FullSystem, ModeLabel};
use crate::case::bodies::{self, BuiltBodies};
use crate::contact::LinearContact;
use crate::job;
use crate::model::{self, CoupledModel};
use crate::parallel::World;
use crate::stability::confirmation;
use crate::stability::dense::{self, FullOrderBody};
use crate::stability::full::completeness::{partners, Wedge};
use crate::stability::full::residuals::Residuals;
use crate::stability::full::{
    spectrum, DampedBody, FullBodies, FullOptions, FullPair, FullResult, FullSpectrum, RayleighDamping, Spin,
};
use crate::stability::reduced::shares as shares_of;
use crate::stability::{grows, oscillates, Spectrum};
use crate::summary::Summary;
use crate::{Error, Result};
use num_complex::Complex;
use std::rc::Rc;

type C = Complex<f64>;

/// Collective: the full spectrum about a sliding contact; rank 0 gives the contact, the model and the spectrum of the
/// `reduced` analysis.
pub fn run(
    run: &mut Run,
    wanted: &job::FullStability,
    bodies: &BuiltBodies,
    reduced: Option<(&Spectrum, &LinearContact, &CoupledModel)>,
) -> Result<FullResult> {
    let world = run.world();
    run.progress.stage("stability of the full system");
    world.on_root(|| match reduced {
        Some((f, ..)) if wanted.max_frequency > f.limit * (1.0 + 1e-12) => Err(Error::Job(format!(
            "analyses.stability.full.max_frequency is {} Hz, but the reduced model, which it is compared with, \
             reaches {:.1} Hz; ask for more \
             modes in analyses.modes or for a lower limit",
            wanted.max_frequency, f.limit
        ))),
        _ => Ok(()),
    })?;
    let contact = shared_contact(world, reduced.map(|r| r.1));
    let mut spectrum = match run.job.by_matrices() {
        true => at_once(run, wanted, bodies, &contact)?,
        false => by_shifts(run, wanted, bodies, &contact, reduced.map(|r| r.0))?,
    };
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
    let (mut shares, mut amplitudes) = (Vec::new(), Vec::new());
    for pair in &spectrum.pairs {
        let q = modal(world, bodies, pair);
        if let Some((_, _, model)) = reduced {
            shares.push(shares_of(&model.omega, &q, pair.value));
            amplitudes.push(q);
        }
    }
    Ok(FullResult { spectrum, shares, amplitudes, partners })
}

/// Result that the full system found beside an eigenvalue of the reduced one.
pub struct FullComparison {
    /// λ, 1/s.
    pub value: C,
    /// This rank's degrees of freedom of the lower and the upper body, in lower form, of Euclidean norm 1 together.
    pub motion: [Vec<C>; 2],
    /// On rank 0: its modal amplitudes, lower body first.
    pub amplitudes: Vec<C>,
}

impl FullComparison {
    /// Collective: of what was `found` that which agrees with the reduced eigenvalue of this number, from 1: a
    /// transient of all degrees of freedom begins along it.
    pub fn nearest_to(world: &World, found: FullResult, number: u32) -> Result<Self> {
        let FullResult { spectrum, mut amplitudes, partners, .. } = found;
        let place = world.on_root(|| {
            let partner = (number as usize).checked_sub(1);
            partners.iter().position(|p| p.is_some() && *p == partner).ok_or_else(|| {
                Error::Job(format!(
                    "analyses.transient.start.mode is {number}: the full system has no eigenvalue that agrees \
                     with this one of the reduced model; take another \
                     mode, a higher analyses.stability.full.max_frequency or more modes, or leave \
                     analyses.stability.full out"
                ))
            })
        })?;
        let place = world.broadcast(vec![place.unwrap_or_default() as u64])[0] as usize;
        let missing = || Error::Defect(format!("no eigenpair {place} of the full system"));
        let pair = spectrum.pairs.into_iter().nth(place).ok_or_else(missing)?;
        let amplitudes = if place < amplitudes.len() { amplitudes.swap_remove(place) } else { Vec::new() };
        Ok(Self { value: pair.value, motion: pair.motion, amplitudes })
    }
}

/// Collective: the spectrum of finite elements, by successive shifts; `reduced` says on rank 0 where to look.
fn by_shifts(
    run: &mut Run,
    wanted: &job::FullStability,
    bodies: &BuiltBodies,
    contact: &LinearContact,
    reduced: Option<&Spectrum>,
) -> Result<FullSpectrum> {
    let world = run.world();
    let guide: Vec<C> = world.broadcast(reduced.map(|r| r.all.clone()).unwrap_or_default());
    let (systems, modes) = (bodies.full_systems()?, bodies.shapes());
    let rotations = systems.iter().map(|s| Ok(s.rotation()?.map(Rc::new))).collect::<Result<Vec<_>>>()?;
    let place = |(place, (name, body)): (&bodies::Place, (&str, &job::Body))| -> Result<DampedBody> {
        let damping = RayleighDamping { alpha: body.damping.alpha, beta: body.damping.beta };
        let spin = match (&rotations[place.body], modes.get(place.body)) {
            (Some(forms), Some(modes)) => {
                let modal = forms.project(world, systems[place.body].mass(), modes);
                Some(Spin { speed: run.job.angular_velocity(name), forms: Rc::clone(forms), modal })
            }
            _ => None,
        };
        let names = spin.as_ref().map(|s| ModeLabel::of_orders(&s.modal.diameters())).unwrap_or_default();
        let modal = match (&body.damping.modal, modes.get(place.body)) {
            (Some(_), Some(modes)) => {
                let lossy = systems[place.body].lossy();
                let springs = lossy.map(|k| in_springs(world, k, &modes.vectors)).unwrap_or_default();
                model::damping(&body.damping, (&modes.omega, &names), &springs, &format!("bodies.{name}.damping"))?
            }
            (Some(_), None) => return Err(Error::Defect(format!("no modes of the body {name} to damp"))),
            (None, _) => Vec::new(),
        };
        Ok(DampedBody { body: place.body, damping, modal, spin })
    };
    let places = bodies.places.iter().zip(run.job.bodies()).map(place).collect::<Result<Vec<_>>>()?;
    let places: [DampedBody; 2] =
        places.try_into().map_err(|_| Error::Defect("full stability of other than two bodies".into()))?;
    let options = FullOptions {
        max_frequency: wanted.max_frequency,
        damping_ratio: wanted.damping_ratio,
        count: wanted.count as usize,
        tolerance: wanted.tolerance,
        method: crate::case::bodies::eigen_method(run.job),
    };
    let system = FullBodies { bodies: &systems, modes: &modes, places: &places };
    spectrum(run.petsc, system, contact, &guide, &options, run.progress)
}

/// Collective: the spectrum of small bodies, all at once on rank 0.
fn at_once(
    run: &Run,
    wanted: &job::FullStability,
    bodies: &BuiltBodies,
    contact: &LinearContact,
) -> Result<FullSpectrum> {
    let world = run.world();
    let systems: Vec<Option<&dyn FullSystem>> =
        bodies.places.iter().map(|p| bodies.unique.get(p.body).and_then(|b| b.full_system())).collect();
    let order: u64 = systems.iter().flatten().map(|s| s.stiffness().order()).sum();
    if order > dense::LARGEST as u64 {
        return Err(Error::Job(format!(
            "analyses.stability.full: bodies given by matrices are treated densely there, up to {} degrees of \
             freedom; found {order}. \
             Leave it out: the reduced analysis takes larger bodies",
            dense::LARGEST
        )));
    }
    let given = [run.job.bodies.lower.as_ref(), run.job.bodies.upper.as_ref()];
    let wholes: Vec<Option<FullOrderBody>> = systems
        .iter()
        .zip(given)
        .map(|(s, body)| s.and_then(|s| FullOrderBody::gather(world, s, body.map_or(1.0, job::Body::damping_factor))))
        .collect();
    let wedge = Wedge::new(wanted.max_frequency, wanted.damping_ratio);
    let found = world.on_root(|| {
        let [lower, upper] = [0, 1].map(|p| wholes.get(p).and_then(Option::as_ref));
        let (mut found, pencil) = dense::spectrum([lower, upper], contact, wanted.tolerance)?;
        found.retain(|p| wedge.holds(p.value));
        let unstable = found.iter().filter(|p| grows(p.value, p.backward_error) && p.value.im != 0.0);
        let unstable: Vec<C> = unstable.map(|p| p.value).collect();
        let confirmed = match pencil.filter(|_| !unstable.is_empty()) {
            Some(pencil) => confirmation::of_pencil(run.petsc, pencil, &unstable)?,
            None => Vec::new(),
        };
        Ok((found, confirmed))
    })?;
    let (found, confirmed) = found.unwrap_or_default();
    let mut confirmed = confirmed.into_iter();
    let values = world.broadcast(found.iter().map(|p| p.value).collect::<Vec<C>>());
    let errors = world.broadcast(found.iter().flat_map(|p| [p.backward_error, p.constraint]).collect::<Vec<f64>>());
    let mut pairs = Vec::new();
    for (i, value) in values.into_iter().enumerate() {
        let mut first = 0;
        let mut motion = [Vec::new(), Vec::new()];
        for (motion, system) in motion.iter_mut().zip(&systems) {
            let Some(stiffness) = system.map(|s| s.stiffness()) else { continue };
            let of_rank = |rank: usize| {
                let rows = stiffness.rows_of(rank);
                found
                    .get(i)
                    .map_or(Vec::new(), |p| p.motion[first + rows.start as usize..first + rows.end as usize].to_vec())
            };
            let parts = if world.is_root() { (0..world.size).map(of_rank).collect() } else { Vec::new() };
            *motion = world.scatter(parts);
            first += stiffness.order() as usize;
        }
        let (pressure, forces) = (Vec::new(), Vec::new());
        let residuals = Residuals { backward_error: errors[2 * i], correction: 0.0, constraint: errors[2 * i + 1] };
        let (damping, stiffening) = ([0.0; 2], [0.0; 2]);
        // On rank 0, in the order of the pairs.
        let asked = grows(value, residuals.backward_error) && value.im != 0.0;
        let confirmation = if asked { confirmed.next().flatten() } else { None };
        pairs.push(FullPair { value, motion, pressure, forces, damping, stiffening, residuals, confirmation });
    }
    Ok(FullSpectrum { pairs, shifts: Vec::new() })
}

/// Collective: modal amplitudes Φᵀ M u of both bodies, lower first.
fn modal(world: &World, bodies: &BuiltBodies, pair: &FullPair) -> Vec<C> {
    let mut q = Vec::new();
    for (place, u) in bodies.places.iter().zip(&pair.motion) {
        let body = &bodies.unique[place.body];
        let (Some(system), Some(modes)) = (body.full_system(), body.shapes()) else { continue };
        let mut mu = vec![C::default(); u.len()];
        system.mass().operator(world).apply(world, u, &mut mu);
        for phi in &modes.vectors {
            q.push(phi.iter().zip(&mu).map(|(p, m)| p * m).sum());
        }
    }
    world.sum_all(&q)
}

/// Writes the summary lines of a result.
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
    let confirmed: Vec<_> = pairs.iter().filter(|p| p.confirmation.is_some()).map(|p| p.confirmation).collect();
    if !confirmed.is_empty() {
        summary.value("SLEPc confirms", confirmation::in_words(&confirmed));
    }
    let unstable: Vec<_> = pairs.iter().filter(|p| grows(p.value, p.residuals.backward_error)).collect();
    without_oscillation(unstable.iter().map(|p| p.value), summary);
    let first = pairs.iter().take(unstable.len().max(3));
    for p in first.filter(|p| oscillates(p.value) || !grows(p.value, p.residuals.backward_error)) {
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
