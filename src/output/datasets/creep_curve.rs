//! The group `/creep_curve`.

use super::super::Table;
use crate::job::CreepCurve;
use crate::Error;
use num_complex::Complex;

/// A point of a creep curve.
#[derive(Debug, Clone, PartialEq)]
pub struct CreepCurvePoint {
    /// The creepage, in its unit.
    pub value: f64,
    /// 0, or the exit code of the failure.
    pub status: i32,
    /// Error message.
    pub message: String,
    /// On body 1, N.
    pub force: [f64; 3],
    /// Moment of the tractions on body 1, N·m.
    pub moment_z: f64,
    /// m.
    pub approach: f64,
    /// Closed nodes.
    pub closed: usize,
    /// Number of sticking nodes.
    pub sticking: usize,
    /// Their share of the area in contact.
    pub stick_share: f64,
    /// Residual of the laws of contact.
    pub residual: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// Results of laws of point contact in its place.
    pub baseline: Option<Baseline>,
    /// The eigenvalue with the largest growth rate, 1/s, and whether it grows by more than rounding.
    pub least_stable: Option<(Complex<f64>, bool)>,
}

/// Forces (x, y) on body 1 by laws of point contact, N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Baseline {
    /// Half-axes of the ellipse along and across the rolling direction, m.
    pub half_axes: [f64; 2],
    /// Kalker's linear theory.
    pub linear: [f64; 2],
    /// Shen, Hedrick and Elkins.
    pub shen_hedrick_elkins: [f64; 2],
    /// Polach.
    pub polach: [f64; 2],
    /// FASTSIM.
    pub fastsim: [f64; 2],
}

impl CreepCurvePoint {
    /// A point that could not be computed.
    pub fn failed(value: f64, error: &Error) -> Self {
        Self {
            value,
            status: error.exit_code(),
            message: error.message().to_owned(),
            force: [f64::NAN; 3],
            moment_z: f64::NAN,
            approach: f64::NAN,
            closed: 0,
            sticking: 0,
            stick_share: f64::NAN,
            residual: f64::NAN,
            iterations: 0,
            baseline: None,
            least_stable: None,
        }
    }
}

/// The curve; with its eigenvalues where `stability` was looked at.
pub fn tables(wanted: &CreepCurve, all: &[CreepCurvePoint], stability: bool) -> Vec<Table> {
    let list = |name: &str, units: &str, text: &str, of: &dyn Fn(&CreepCurvePoint) -> f64| {
        Table::list(&format!("/creep_curve/{name}"), units, text, all.iter().map(of).collect::<Vec<f64>>())
    };
    let count = |name: &str, text: &str, of: &dyn Fn(&CreepCurvePoint) -> usize| {
        let counts: Vec<i64> = all.iter().map(|p| of(p) as i64).collect();
        Table::list(&format!("/creep_curve/{name}"), "1", text, counts)
    };
    let (key, unit) = (wanted.key.name(), wanted.key.unit());
    let mut tables = vec![
        list(key, unit, &format!("The {key} creepage, which changes from point to point."), &|p| p.value),
        Table::new(
            "/creep_curve/force",
            "N",
            "Contact force (x, y, z) on body 1; NaN where the point failed, as what follows.",
            &[all.len(), 3],
            all.iter().flat_map(|p| p.force).collect::<Vec<f64>>(),
        ),
        list("moment_z", "N m", "Moment of the tractions on body 1 about the normal through the origin.", &|p| {
            p.moment_z
        }),
        list("approach", "m", "Rigid approach.", &|p| p.approach),
        list("stick_share", "1", "Share of the area in contact that sticks.", &|p| p.stick_share),
        count("closed", "Closed contact nodes.", &|p| p.closed),
        count("sticking", "Closed nodes that stick.", &|p| p.sticking),
        list("residual", "1", "Residual of the laws of contact.", &|p| p.residual),
        count("iterations", "Newton iterations.", &|p| p.iterations),
        Table::list(
            "/creep_curve/status",
            "-",
            "0 computed, else the exit code that a run of this point alone would have.",
            all.iter().map(|p| p.status).collect::<Vec<i32>>(),
        ),
        Table::list(
            "/creep_curve/message",
            "-",
            "Error at a point; empty where there was none.",
            all.iter().map(|p| p.message.clone()).collect::<Vec<String>>(),
        ),
    ];
    let pair = |name: &str, units: &str, text: &str, of: fn(&Baseline) -> [f64; 2]| {
        let values: Vec<f64> = all.iter().flat_map(|p| p.baseline.as_ref().map_or([f64::NAN; 2], of)).collect();
        Table::new(&format!("/creep_curve/{name}"), units, text, &[all.len(), 2], values)
    };
    let of = |law: &str| format!("Friction (x, y) on body 1 of a point contact with the ellipse of half_axes: {law}.");
    tables.extend([
        pair(
            "half_axes",
            "m",
            "Half-axes along and across the rolling direction of the ellipse with the second moments of the pressure; \
             NaN, with the forces on it, where the point failed or the ellipse is beyond Kalker's table.",
            |b| b.half_axes,
        ),
        pair("linear", "N", &of("Kalker's linear theory, without slip"), |b| b.linear),
        pair("shen_hedrick_elkins", "N", &of("Shen, Hedrick and Elkins"), |b| b.shen_hedrick_elkins),
        pair("polach", "N", &of("Polach"), |b| b.polach),
        pair("fastsim", "N", &of("Kalker's FASTSIM"), |b| b.fastsim),
    ]);
    if stability {
        let none = Complex::new(f64::NAN, f64::NAN);
        tables.push(Table::list(
            "/creep_curve/eigenvalue",
            "1/s",
            "The eigenvalue about steady rolling with the largest growth rate; NaN where there is none.",
            all.iter().map(|p| p.least_stable.map_or(none, |l| l.0)).collect::<Vec<Complex<f64>>>(),
        ));
    }
    tables
}
