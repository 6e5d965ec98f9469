//! The analysis `receptance`: displacement of each body at the contact point per unit force there, over frequency.
//!
//! A unit force in direction c is spread over the contact nodes by shares d_i, Σ d_i = 1, and the displacement is the mean of the nodes
//! with the same shares, so that the receptance is symmetric: H(ω) = Dᵀ [Φ diag(1/(ω_k² − ω² + i c_k ω)) Φᵀ + S] D with the residual
//! S = C − Φ Ω⁻² Φᵀ, taken as static.

use super::interface::{creepage, normal_load};
use super::reduction::Reduction;
use super::run::Run;
use crate::body::ReducedBody;
use crate::contact::{FrictionLaw, SteadyProblem, Stencil};
use crate::grid::Interface;
use crate::job::{self, Spread};
use crate::model::ReducedModel;
use crate::output::Table;
use crate::{Error, Result};
use faer::MatRef;
use num_complex::Complex;

const TWO_PI: f64 = 2.0 * std::f64::consts::PI;

/// Collective: receptances of both bodies; tables under `/receptance`.
pub fn run(run: &mut Run, wanted: &job::Receptance, contact: &job::Contact, model: &Reduction) -> Result<()> {
    run.progress.stage("receptances of the contact point");
    let found = run.world().on_root(|| {
        let model = model.root()?;
        let frequency =
            wanted.frequency.numbers().map_err(|e| Error::Job(format!("analyses.receptance.frequency: {e}")))?;
        let reach = |b: &ReducedBody| b.omega.iter().copied().fold(0.0, f64::max) / TWO_PI;
        let reach = model.bodies.iter().map(reach).fold(f64::INFINITY, f64::min);
        if let Some(f) = frequency.iter().find(|&&f| f > reach) {
            return Err(Error::Job(format!(
                "analyses.receptance.frequency: {f} Hz is beyond the modes of the bodies, which reach {reach:.1} Hz; \
                 ask for more modes in analyses.modes or for lower frequencies"
            )));
        }
        let share = shares(wanted.spread, contact, model)?;
        let of = |place: usize| receptance(&model.bodies[model.place[place]], &share, &frequency);
        Ok((tables(&frequency, &share, &[of(0), of(1)]), frequency))
    })?;
    if let Some((tables, frequency)) = found {
        run.file.tables(tables);
        let (first, last) = (frequency.first().copied().unwrap_or(0.0), frequency.last().copied().unwrap_or(0.0));
        run.summary.line(format!("receptances at {} frequencies, {first} to {last} Hz", frequency.len()));
    }
    Ok(())
}

/// Share of each contact node in a unit force, `[n]`.
fn shares(spread: Spread, contact: &job::Contact, model: &ReducedModel) -> Result<Vec<f64>> {
    let s: &Interface = &model.interface;
    let force: Vec<f64> = match spread {
        Spread::Uniform => s.weight.clone(),
        Spread::Pressure => {
            let problem = SteadyProblem {
                interface: s,
                compliance: model.pair.compliance.as_ref(),
                friction: FrictionLaw::Constant(0.0),
                speed: contact.speed,
                creepage: creepage(contact),
                load: normal_load(contact),
                stencil: Stencil::default(),
                tolerance: 1e-8,
                max_iterations: 200,
            };
            problem.solve()?.pressure.iter().zip(&s.weight).map(|(p, w)| p * w).collect()
        }
    };
    let sum: f64 = force.iter().sum();
    if sum > 0.0 {
        return Ok(force.iter().map(|f| f / sum).collect());
    }
    Err(Error::Job(
        "analyses.receptance.spread: the contact is open, so there is no pressure to spread a force by; \
         raise the load, or use \"uniform\""
            .into(),
    ))
}

/// Receptance of a body in lower form under a force spread by `share` (`[n]`) at the frequencies (Hz), m/N, `[frequencies][3][3]`:
/// displacement in direction (x, y, n into the body) by force in direction (x, y, n).
pub fn receptance(body: &ReducedBody, share: &[f64], frequency: &[f64]) -> Vec<[[Complex<f64>; 3]; 3]> {
    // Dᵀ C D and Dᵀ Φ.
    let static_ = spread_twice(body.compliance.as_ref(), share);
    let modes: Vec<[f64; 3]> = (0..body.omega.len())
        .map(|k| {
            std::array::from_fn(|c| share.iter().enumerate().map(|(i, d)| d * body.contact_modes[(3 * i + c, k)]).sum())
        })
        .collect();
    let at = |f: &f64| {
        let w = TWO_PI * f;
        let mut h: [[Complex<f64>; 3]; 3] =
            std::array::from_fn(|a| std::array::from_fn(|b| Complex::new(static_[a][b], 0.0)));
        for ((phi, &own), &c) in modes.iter().zip(&body.omega).zip(&body.damping) {
            let rest = if own > 0.0 { 1.0 / (own * own) } else { 0.0 };
            let dynamic = Complex::new(own * own - w * w, c * w).inv() - rest;
            for a in 0..3 {
                for b in 0..3 {
                    h[a][b] += dynamic * phi[a] * phi[b];
                }
            }
        }
        h
    };
    frequency.iter().map(at).collect()
}

fn spread_twice(m: MatRef<'_, f64>, share: &[f64]) -> [[f64; 3]; 3] {
    let loaded: Vec<(usize, f64)> = share.iter().copied().enumerate().filter(|s| s.1 != 0.0).collect();
    std::array::from_fn(|a| {
        std::array::from_fn(|b| {
            let column = |&(j, d): &(usize, f64)| -> f64 {
                d * loaded.iter().map(|&(i, e)| e * m[(3 * i + a, 3 * j + b)]).sum::<f64>()
            };
            loaded.iter().map(column).sum()
        })
    })
}

fn tables(frequency: &[f64], share: &[f64], bodies: &[Vec<[[Complex<f64>; 3]; 3]>; 2]) -> Vec<Table> {
    let mut tables = vec![
        Table::list("/receptance/frequency", "Hz", "Frequencies.", frequency.to_vec()),
        Table::list("/receptance/share", "1", "Share of each contact node in the unit force.", share.to_vec()),
    ];
    for (name, values) in ["lower", "upper"].into_iter().zip(bodies) {
        tables.push(Table::new(
            &format!("/receptance/{name}"),
            "m/N",
            "Displacement in direction (x, y, n into the body) by a unit force in direction (x, y, n), in lower form.",
            &[frequency.len(), 3, 3],
            values.iter().flatten().flatten().copied().collect::<Vec<Complex<f64>>>(),
        ));
    }
    tables
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;

    /// Two nodes; two modes and a residual S.
    fn body() -> ReducedBody {
        let omega = vec![TWO_PI * 100.0, TWO_PI * 300.0];
        let contact_modes = Mat::from_fn(6, 2, |i, k| 0.1 * ((i + 1) as f64 * (k as f64 + 0.4)).cos());
        let compliance = Mat::from_fn(6, 6, |i, j| {
            let modal: f64 = (0..2).map(|k| contact_modes[(i, k)] * contact_modes[(j, k)] / omega[k].powi(2)).sum();
            modal + if i == j { 2e-9 } else { 1e-10 }
        });
        ReducedBody { omega, damping: vec![4.0, 9.0], contact_modes, compliance }
    }

    #[test]
    fn at_rest_it_is_the_static_compliance() {
        let b = body();
        let share = [0.25, 0.75];
        let h = &receptance(&b, &share, &[0.0])[0];
        for a in 0..3 {
            for c in 0..3 {
                let mut want = 0.0;
                for i in 0..2 {
                    for j in 0..2 {
                        want += share[i] * share[j] * b.compliance[(3 * i + a, 3 * j + c)];
                    }
                }
                let error = (h[a][c] - want).norm();
                assert!(error < 1e-14 * h[2][2].norm(), "({a}, {c}): {} and {want}", h[a][c]);
            }
        }
    }

    /// One mass on a spring and a dashpot, with a spring s in series: x = F (1/(k − mω² + icω) + s).
    #[test]
    fn one_degree_of_freedom_has_its_closed_form() {
        let (m, k, c, s): (f64, f64, f64, f64) = (2.0, 8e5, 40.0, 1e-7);
        let b = ReducedBody {
            omega: vec![(k / m).sqrt()],
            damping: vec![c / m],
            contact_modes: Mat::from_fn(3, 1, |i, _| if i == 2 { 1.0 / m.sqrt() } else { 0.0 }),
            compliance: Mat::from_fn(3, 3, |i, j| if i == 2 && j == 2 { 1.0 / k + s } else { 0.0 }),
        };
        let f = [0.0, 30.0, 100.0, 100.6584, 500.0, 5000.0];
        for (f, h) in f.iter().zip(receptance(&b, &[1.0], &f)) {
            let w = TWO_PI * f;
            let want = Complex::new(k - m * w * w, c * w).inv() + s;
            assert!((h[2][2] - want).norm() < 1e-11 * want.norm(), "{f} Hz: {} and {want}", h[2][2]);
            assert_eq!(h[0][2].norm() + h[1][1].norm(), 0.0);
            // Force leads the displacement: the phase lies between 0 and −180°.
            assert!(h[2][2].im <= 0.0, "{f} Hz: {}", h[2][2]);
        }
    }

    #[test]
    fn it_is_symmetric_and_has_one_peak_for_each_mode() {
        let f: Vec<f64> = (0..800).map(|i| 0.5 * i as f64).collect();
        let h = receptance(&body(), &[0.5, 0.5], &f);
        let size: Vec<f64> = h.iter().map(|h| h[2][2].norm()).collect();
        let peaks: Vec<f64> =
            (1..799).filter(|&i| size[i] > size[i - 1] && size[i] > size[i + 1]).map(|i| f[i]).collect();
        assert_eq!(peaks, [100.0, 300.0]);
        let largest = |h: &[[Complex<f64>; 3]; 3]| h.iter().flatten().map(|v| v.norm()).fold(0.0, f64::max);
        assert!(h.iter().all(|h| (h[0][2] - h[2][0]).norm() <= 1e-14 * largest(h)));
    }
}
