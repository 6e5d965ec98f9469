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
    /// State of each contact; none of a point that could not be computed.
    pub contacts: Vec<CurveContact>,
    /// Residual of the laws of contact.
    pub residual: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// The eigenvalue with the largest growth rate, 1/s, and whether it grows by more than rounding.
    pub least_stable: Option<(Complex<f64>, bool)>,
}

/// State of a contact at a point of a creep curve.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveContact {
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
    /// Results of laws of point contact in its place.
    pub baseline: Option<Baseline>,
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
            contacts: Vec::new(),
            residual: f64::NAN,
            iterations: 0,
            least_stable: None,
        }
    }
}

/// The curve of the contacts whose creepages are `changes` larger than those of the first one; with its eigenvalues
/// where `stability` was looked at. Further contacts have groups of their own, `/creep_curve_2` and so on.
pub fn tables(wanted: &CreepCurve, all: &[CreepCurvePoint], changes: &[f64], stability: bool) -> Vec<Table> {
    let mut tables: Vec<Table> =
        changes.iter().enumerate().flat_map(|(number, change)| of_contact(wanted, all, (number, *change))).collect();
    tables.extend([
        Table::list(
            "/creep_curve/residual",
            "1",
            "Residual of the laws of contact.",
            all.iter().map(|p| p.residual).collect::<Vec<f64>>(),
        ),
        Table::list(
            "/creep_curve/iterations",
            "1",
            "Newton iterations.",
            all.iter().map(|p| p.iterations as i64).collect::<Vec<i64>>(),
        ),
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

/// The curve of the contact `number`, from 0, whose creepage is by `change` larger than that of the first one.
fn of_contact(wanted: &CreepCurve, all: &[CreepCurvePoint], (number, change): (usize, f64)) -> Vec<Table> {
    let group = if number == 0 { "/creep_curve".to_owned() } else { format!("/creep_curve_{}", number + 1) };
    let at = |point: &CreepCurvePoint| point.contacts.get(number).cloned();
    let list = |name: &str, units: &str, text: &str, of: &dyn Fn(&CurveContact) -> f64| {
        let values: Vec<f64> = all.iter().map(|p| at(p).map_or(f64::NAN, |c| of(&c))).collect();
        Table::list(&format!("{group}/{name}"), units, text, values)
    };
    let count = |name: &str, text: &str, of: &dyn Fn(&CurveContact) -> usize| {
        let counts: Vec<i64> = all.iter().map(|p| at(p).map_or(0, |c| of(&c) as i64)).collect();
        Table::list(&format!("{group}/{name}"), "1", text, counts)
    };
    let (key, unit) = (wanted.key.name(), wanted.key.unit());
    let mut tables = vec![
        Table::list(
            &format!("{group}/{key}"),
            unit,
            &format!("The {key} creepage, which changes from point to point."),
            all.iter().map(|p| p.value + change).collect::<Vec<f64>>(),
        ),
        Table::new(
            &format!("{group}/force"),
            "N",
            "Contact force (x, y, z) on body 1; NaN where the point failed, as what follows.",
            &[all.len(), 3],
            all.iter().flat_map(|p| at(p).map_or([f64::NAN; 3], |c| c.force)).collect::<Vec<f64>>(),
        ),
        list("moment_z", "N m", "Moment of the tractions on body 1 about the normal through the origin.", &|c| {
            c.moment_z
        }),
        list("approach", "m", "Rigid approach.", &|c| c.approach),
        list("stick_share", "1", "Share of the area in contact that sticks.", &|c| c.stick_share),
        count("closed", "Closed contact nodes.", &|c| c.closed),
        count("sticking", "Closed nodes that stick.", &|c| c.sticking),
    ];
    let pair = |name: &str, units: &str, text: &str, of: fn(&Baseline) -> [f64; 2]| {
        let baseline = |p| at(p).and_then(|c| c.baseline);
        let values: Vec<f64> = all.iter().flat_map(|p| baseline(p).as_ref().map_or([f64::NAN; 2], of)).collect();
        Table::new(&format!("{group}/{name}"), units, text, &[all.len(), 2], values)
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
    tables
}
