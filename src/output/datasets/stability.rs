//! The group `/stability`.

use super::super::Table;
use crate::contact::baseline::{EllipticContact, LAWS};
use crate::model::{travelling, CoupledModel, ReducedModel};
use crate::stability::confirmation::Confirmation;
use crate::stability::criterion::Criterion;
use crate::stability::full::FullResult;
use crate::stability::point::Comparison;
use crate::stability::reduced::{participation, Eigenpair};
use crate::stability::sensitivity::{Derivative, Parameter, Sensitivities};
use crate::stability::{grows, Equilibrium, Spectrum};
use num_complex::Complex;

/// One line of the table of eigenvalues.
struct Listed {
    value: Complex<f64>,
    backward_error: f64,
    constraint: f64,
    source: &'static str,
    shares: Vec<f64>,
    modal: Vec<Complex<f64>>,
    partner: i64,
}

/// The eigenvalues of the reduced model, then those of the full one.
fn listed(spectrum: &Spectrum, model: &CoupledModel, full: Option<&FullResult>) -> Vec<Listed> {
    let of_reduced = |p: &Eigenpair| Listed {
        value: p.value,
        backward_error: p.backward_error,
        constraint: 0.0,
        source: "reduced",
        shares: participation(model, p),
        modal: p.modal.clone(),
        partner: -1,
    };
    let mut all: Vec<Listed> = spectrum.eigenpairs.iter().map(of_reduced).collect();
    let reduced = all.len();
    for (i, p) in full.iter().flat_map(|f| f.spectrum.pairs.iter().enumerate()) {
        let partner = full.and_then(|f| f.partners.get(i).copied().flatten());
        if let Some(partner) = partner {
            all[partner].partner = (reduced + i) as i64;
        }
        all.push(Listed {
            value: p.value,
            backward_error: p.residuals.backward_error,
            constraint: p.residuals.constraint,
            source: "full",
            shares: full.and_then(|f| f.shares.get(i).cloned()).unwrap_or_default(),
            modal: full.and_then(|f| f.amplitudes.get(i).cloned()).unwrap_or_default(),
            partner: partner.map_or(-1, |p| p as i64),
        });
    }
    all
}

/// Tables of the eigenvalues in the group `/stability`.
pub fn eigenvalues(spectrum: &Spectrum, root: &ReducedModel, full: Option<&FullResult>) -> Vec<Table> {
    let model = &root.pair;
    let all = listed(spectrum, model, full);
    let list = |name: &str, units: &str, text: &str, of: &dyn Fn(&Listed) -> f64| {
        Table::list(&format!("/stability/{name}"), units, text, all.iter().map(of).collect::<Vec<f64>>())
    };
    let value: Vec<Complex<f64>> = all.iter().map(|p| p.value).collect();
    let shares: Vec<f64> = all.iter().flat_map(|p| p.shares.iter().copied()).collect();
    let lower = model.lower_modes;
    let body: Vec<i8> = (0..model.omega.len()).map(|k| if k < lower { 1 } else { 2 }).collect();
    let frequency: Vec<f64> = model.omega.iter().map(|w| w / (2.0 * std::f64::consts::PI)).collect();
    let mut tables = vec![
        Table::list(
            "/stability/eigenvalue",
            "1/s",
            "Eigenvalues, growth rate + i angular frequency, one of each conjugate pair, by falling growth rate; \
                 those of the reduced model, then those of the full one.",
            value,
        ),
        list("frequency", "Hz", "Frequency of each eigenvalue.", &|p| p.value.im.abs() / (2.0 * std::f64::consts::PI)),
        list("growth_rate", "1/s", "Growth rate of each eigenvalue; unstable if positive.", &|p| p.value.re),
        Table::list(
            "/stability/unstable",
            "-",
            "1: grows by more than rounding; 0: does not, or is a rigid motion, of less than 0.01 1/s.",
            all.iter().map(|p| i8::from(grows(p.value, p.backward_error))).collect::<Vec<i8>>(),
        ),
        list("damping_ratio", "1", "Damping ratio, minus growth rate over modulus.", &|p| {
            -p.value.re / p.value.norm().max(f64::MIN_POSITIVE)
        }),
        list("backward_error", "1", "Backward error of each eigenpair in the scaled problem.", &|p| p.backward_error),
        list(
            "constraint_violation",
            "1",
            "Largest opening of a closed node over the largest displacement; 0 where the pressures are eliminated.",
            &|p| p.constraint,
        ),
        Table::list(
            "/stability/source",
            "-",
            "Model of each eigenvalue: reduced or full.",
            all.iter().map(|p| p.source.to_owned()).collect::<Vec<_>>(),
        ),
        Table::list(
            "/stability/partner",
            "1",
            "Place of the same eigenvalue from the other source, from 0; -1: none was looked for or needed.",
            all.iter().map(|p| p.partner).collect::<Vec<i64>>(),
        ),
        Table::new(
            "/stability/participation",
            "1",
            "Share of each free-interface mode in each eigenvector, by elastic energy.",
            &[all.len(), model.omega.len()],
            shares,
        ),
        Table::list("/stability/mode_body", "-", "Body of each free-interface mode: 1 lower, 2 upper.", body),
        Table::list("/stability/mode_frequency", "Hz", "Frequency of each free-interface mode.", frequency),
    ];
    if root.rotation.iter().any(Option::is_some) {
        let of = |p: &Listed| {
            let (lower, upper) = p.modal.split_at(model.lower_modes.min(p.modal.len()));
            [lower, upper]
                .into_iter()
                .zip(&root.rotation)
                .map(|(q, r)| r.as_ref().map_or(0.0, |r| travelling(r, q)))
                .collect::<Vec<_>>()
        };
        let text = "Nodal diameters of the motion of the lower and of the upper body: positive where it travels \
         with the rotation, negative against it, about 0 where it stands or the body does not rotate.";
        tables.push(Table::new(
            "/stability/diameters",
            "1",
            text,
            &[all.len(), 2],
            all.iter().flat_map(of).collect::<Vec<f64>>(),
        ));
    }
    if let Some(full) = full {
        let shifts = &full.spectrum.shifts;
        tables.push(Table::list(
            "/stability/shift",
            "1/s",
            "Shifts at which the full system was inverted.",
            shifts.iter().map(|s| s.shift).collect::<Vec<_>>(),
        ));
        tables.push(Table::list(
            "/stability/shift_radius",
            "1/s",
            "Distance from each shift within which every eigenvalue of the full system was found.",
            shifts.iter().map(|s| s.radius).collect::<Vec<_>>(),
        ));
    }
    tables
}

/// The group `/stability/confirmation`: SLEPc's confirmation of the unstable eigenvalues of the reduced model, each
/// with its place in the list, and on those of the full one, which come after `reduced` others.
pub fn confirmations(of_reduced: Vec<(usize, Confirmation)>, reduced: usize, full: Option<&FullResult>) -> Vec<Table> {
    let of_full = full.iter().flat_map(|f| f.spectrum.pairs.iter().enumerate());
    let of_full = of_full.filter_map(|(i, p)| Some((reduced + i, p.confirmation?)));
    let all: Vec<(usize, Confirmation)> = of_reduced.into_iter().chain(of_full).collect();
    if all.is_empty() {
        return Vec::new();
    }
    let path = |name: &str| format!("/stability/confirmation/{name}");
    let errors: Vec<f64> = all.iter().flat_map(|(_, c)| c.residuals).collect();
    vec![
        Table::list(
            &path("place"),
            "1",
            "Place in /stability/eigenvalue, from 0, of each unstable eigenvalue that SLEPc's two-sided method \
             has confirmed.",
            all.iter().map(|(i, _)| *i as i64).collect::<Vec<i64>>(),
        ),
        Table::list(
            &path("eigenvalue"),
            "1/s",
            "The same eigenvalue by SLEPc.",
            all.iter().map(|(_, c)| c.value).collect::<Vec<Complex<f64>>>(),
        ),
        Table::list(
            &path("difference"),
            "1",
            "Distance of the two over their size.",
            all.iter().map(|(_, c)| c.difference).collect::<Vec<f64>>(),
        ),
        Table::list(
            &path("condition"),
            "1",
            "Condition number of the eigenvalue, by its right and its left vector: times a backward error it \
             bounds the relative error.",
            all.iter().map(|(_, c)| c.condition).collect::<Vec<f64>>(),
        ),
        Table::new(
            &path("backward_error"),
            "1",
            "Backward errors of SLEPc's eigenvalue with its right and with its left vector.",
            &[all.len(), 2],
            errors,
        ),
    ]
}

/// The group `/stability/criterion`: the first eigenvalues of the reduced model by one free mode on everything else.
pub fn causes(all: &[Criterion]) -> Vec<Table> {
    if all.is_empty() {
        return Vec::new();
    }
    let path = |name: &str| format!("/stability/criterion/{name}");
    let list = |name: &str, units: &str, text: &str, of: &dyn Fn(&Criterion) -> f64| {
        Table::list(&path(name), units, text, all.iter().map(of).collect::<Vec<f64>>())
    };
    vec![
        Table::list(
            &path("mode"),
            "1",
            "Free mode that is taken apart, from 0, of both bodies in the order of mode_body; a pair goes together.",
            all.iter().map(|c| c.modes.first().map_or(-1, |&k| k as i64)).collect::<Vec<i64>>(),
        ),
        list("damping", "1/s", "Part of the growth rate that the mode's own damping makes.", &|c| c.damping),
        list("across", "1/s", "Part of it by motion along the surface, whose creep turns the friction.", &|c| c.across),
        list("tilting", "1/s", "Part of it by the course of the motion over the contact.", &|c| c.tilting),
        list(
            "coupling",
            "1/kg",
            "kappa: the mode at the contact along the normal times that along the normal and the friction.",
            &|c| c.coupling,
        ),
        Table::list(
            &path("compliance"),
            "m/N",
            "H at the eigenvalue: what everything but the mode yields to a normal force and its friction.",
            all.iter().map(|c| c.compliance).collect::<Vec<Complex<f64>>>(),
        ),
        list("growth_rate", "1/s", "Growth rate that these make.", &|c| c.growth_rate),
    ]
}

/// The group `/stability/point`: one point in place of each contact, beside the `listed` eigenvalues of the reduced
/// model.
pub fn of_point(all: &Comparison, listed: usize) -> Vec<Table> {
    let contacts = all.ellipses.len();
    let (rows, of_each): (&[usize], &str) = match contacts {
        1 => (&[2], ""),
        _ => (&[contacts, 2], ", a row for each contact"),
    };
    let of_ellipses = |of: fn(&EllipticContact) -> Vec<f64>, width: usize| -> Vec<f64> {
        all.ellipses.iter().flat_map(|e| e.as_ref().map_or(vec![f64::NAN; width], of)).collect()
    };
    let mut tables = vec![
        Table::new(
            "/stability/point/half_axes",
            "m",
            &format!(
                "Half-axes along and across the rolling direction of the ellipse with the second moments of the \
                 pressure{of_each}."
            ),
            rows,
            of_ellipses(|e| vec![e.a, e.b], 2),
        ),
        Table::new(
            "/stability/point/stiffness",
            "N/m",
            &format!("Stiffness of Hertz' contact{}.", if contacts > 1 { ", of each contact" } else { "" }),
            &rows[..rows.len() - 1],
            of_ellipses(|e| vec![e.normal_stiffness()], 1),
        ),
    ];
    for of in &all.laws {
        let (name, words, _) = LAWS[of.law];
        let path = |what: &str| format!("/stability/point/{name}/{what}");
        let none = Complex::new(f64::NAN, f64::NAN);
        let beside: Vec<Complex<f64>> = (0..listed).map(|i| of.partner(i).unwrap_or(none)).collect();
        tables.extend([
            Table::new(
                &path("force"),
                "N",
                &format!("Friction (x, y) on body 1 by {words}{of_each}."),
                rows,
                of.forces.iter().flatten().copied().collect::<Vec<f64>>(),
            ),
            Table::list(
                &path("eigenvalue"),
                "1/s",
                &format!(
                    "Eigenvalues with one point in place of each patch and the forces of {words}, by falling growth \
                     rate."
                ),
                of.eigenpairs.iter().map(|p| p.value).collect::<Vec<_>>(),
            ),
            Table::list(
                &path("backward_error"),
                "1",
                "Backward error of each eigenpair in the scaled problem.",
                of.eigenpairs.iter().map(|p| p.backward_error).collect::<Vec<f64>>(),
            ),
            Table::list(
                &path("partner"),
                "1",
                "Place in /stability/eigenvalue, from 0, of the mode of the discretised contact that moves \
                 alike; -1: none.",
                of.partners.iter().map(|p| p.map_or(-1, |p| p as i64)).collect::<Vec<i64>>(),
            ),
            Table::list(
                &path("beside"),
                "1/s",
                "For each eigenvalue of the reduced model in /stability/eigenvalue its partner here; NaN: none.",
                beside,
            ),
        ]);
    }
    tables
}

/// Tables of the state in the group `/stability`; with the coefficient of friction where it is `varying`.
pub fn equilibrium(s: &Equilibrium, varying: bool) -> Vec<Table> {
    let moves = if s.sliding { "sliding" } else { "rolling" };
    // Forces of several contacts have frames of their own and no sum.
    let contacts = s.patches.len();
    let (rows, of_each): (&[usize], &str) =
        if contacts > 1 { (&[contacts, 3], ", a row for each contact in its frame") } else { (&[3], "") };
    let mut tables = vec![
        Table::new(
            "/stability/force",
            "N",
            &format!("Contact force (x, y, z) on body 1 in steady {moves}{of_each}."),
            rows,
            s.patches.iter().flat_map(|p| p.force).collect::<Vec<f64>>(),
        ),
        Table::new(
            "/stability/approach",
            "m",
            &format!("Rigid approach in steady {moves}{}.", if contacts > 1 { ", of each contact" } else { "" }),
            &rows[..rows.len() - 1],
            s.patches.iter().map(|p| p.approach).collect::<Vec<f64>>(),
        ),
        Table::list(
            "/stability/pressure",
            "Pa",
            &format!("Pressure at the contact nodes in steady {moves}."),
            s.pressure.clone(),
        ),
        Table::scalar(
            "/stability/reversed",
            "1",
            "Closed nodes whose creep in the deformed state points against the sliding assumed.",
            s.reversed as i64,
        ),
    ];
    if !s.sliding {
        let state: Vec<i8> = s.state.iter().map(|&s| s as i8).collect();
        tables.push(Table::list("/stability/state", "-", "0 open, 1 stick, 2 slip.", state));
    }
    if varying {
        let text =
            format!("Coefficient of friction at the contact nodes in steady {moves}; at open nodes that at rest.");
        tables.push(Table::list("/stability/friction", "1", &text, s.friction.clone()));
    }
    tables
}

/// The group `/stability/sensitivity`, of bodies with `modes` modes together.
pub fn derivatives(all: &Sensitivities, modes: usize) -> Vec<Table> {
    let of = |d: &Derivative| {
        let (name, units) = match d.parameter {
            Parameter::Friction => ("friction", "1/s"),
            Parameter::NormalLoad => ("normal_load", "1/(N s)"),
            Parameter::Approach => ("approach", "1/(m s)"),
            Parameter::Speed => ("speed", "1/m"),
            Parameter::Longitudinal => ("longitudinal", "1/s"),
            Parameter::Lateral => ("lateral", "1/s"),
            Parameter::Spin => ("spin", "m/s"),
            Parameter::LowerPosition => ("lower_position", "1/(m s)"),
            Parameter::UpperPosition => ("upper_position", "1/(m s)"),
        };
        let relative = if d.parameter == Parameter::Friction { ", over what it is" } else { "" };
        let text =
            format!("Derivative of each eigenvalue of the reduced model by the {}{relative}.", d.parameter.name());
        Table::list(&format!("/stability/sensitivity/{name}"), units, &text, d.by.clone())
    };
    let mut tables: Vec<Table> = all.parameters.iter().map(of).collect();
    tables.push(Table::new(
        "/stability/sensitivity/damping",
        "1/s",
        "Derivative of each eigenvalue of the reduced model by the damping ratio of each free-interface mode.",
        &[all.damping.len(), modes],
        all.damping.concat(),
    ));
    tables
}

#[cfg(test)]
mod tests {
    use super::super::super::values::Values;
    use super::*;
    use crate::contact::baseline::coefficients;
    use crate::stability::point::LawSpectrum;

    /// A contact that is open among several has its row: no ellipse, and no friction.
    #[test]
    fn an_open_contact_has_no_ellipse() {
        let kalker = coefficients(0.3, 1.25).expect("half-axes of the table");
        let closed = EllipticContact { a: 5e-3, b: 4e-3, load: 7e4, friction: 0.3, shear: 8e10, plane: 1.1e11, kalker };
        let law = LawSpectrum { law: 0, forces: vec![[0.0; 2], [3.0, -4.0]], eigenpairs: vec![], partners: vec![] };
        let tables = of_point(&Comparison { ellipses: vec![None, Some(closed)], laws: vec![law] }, 0);
        let of = |name: &str| {
            let path = format!("/stability/point/{name}");
            let table = tables.iter().find(|table| table.path == path).expect("the table");
            let Values::F64(values) = &table.values else { panic!("{name}: no numbers") };
            (table.shape.clone(), values.clone())
        };
        let (shape, axes) = of("half_axes");
        assert!(shape == [2, 2] && axes[..2].iter().all(|a| a.is_nan()) && axes[2..] == [5e-3, 4e-3], "{axes:?}");
        let (shape, stiffness) = of("stiffness");
        assert!(shape == [2] && stiffness[0].is_nan() && stiffness[1] == closed.normal_stiffness(), "{stiffness:?}");
        assert_eq!(of("linear/force"), (vec![2, 2], vec![0.0, 0.0, 3.0, -4.0]));
    }
}
