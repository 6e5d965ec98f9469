//! The group `/creep_curve`.

use super::super::Table;
use crate::job::CreepCurve;
use crate::Error;
use num_complex::Complex;

/// A point of a creep curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The creepage, in its unit.
    pub value: f64,
    /// 0, or the exit code of the failure.
    pub status: i32,
    /// What went wrong.
    pub message: String,
    /// On body 1, N.
    pub force: [f64; 3],
    /// Of the tractions on body 1, N·m.
    pub moment_z: f64,
    /// m.
    pub approach: f64,
    /// Closed nodes.
    pub closed: usize,
    /// Those that stick.
    pub sticking: usize,
    /// Their share of the area in contact.
    pub stick_share: f64,
    /// Residual of the laws of contact.
    pub residual: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// The eigenvalue with the largest growth rate, 1/s, and whether it grows by more than rounding.
    pub least_stable: Option<(Complex<f64>, bool)>,
}

impl Point {
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
            least_stable: None,
        }
    }
}

/// The curve; with its eigenvalues where `stability` was looked at.
pub fn tables(wanted: &CreepCurve, all: &[Point], stability: bool) -> Vec<Table> {
    let list = |name: &str, units: &str, text: &str, of: &dyn Fn(&Point) -> f64| {
        Table::list(&format!("/creep_curve/{name}"), units, text, all.iter().map(of).collect::<Vec<f64>>())
    };
    let count = |name: &str, text: &str, of: &dyn Fn(&Point) -> usize| {
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
            "What went wrong at a point; empty where nothing did.",
            all.iter().map(|p| p.message.clone()).collect::<Vec<String>>(),
        ),
    ];
    if stability {
        let none = Complex::new(f64::NAN, f64::NAN);
        tables.push(Table::list(
            "/creep_curve/eigenvalue",
            "1/s",
            "Eigenvalue with the largest growth rate about steady rolling, growth rate + i angular frequency; NaN where there is none.",
            all.iter().map(|p| p.least_stable.map_or(none, |l| l.0)).collect::<Vec<Complex<f64>>>(),
        ));
    }
    tables
}
