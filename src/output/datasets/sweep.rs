//! The group `/sweep`.

use super::super::Table;
use crate::error::printable;
use crate::job::SweepPlan;
use crate::stability::grows;
use crate::Error;
use num_complex::Complex;

/// A mode of the job's own point at another point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Followed {
    /// Its number among those that are followed; none of a motion that grows and is none of them.
    pub mode: Option<usize>,
    /// Its eigenvalue here, 1/s.
    pub value: Complex<f64>,
    /// Modal assurance criterion of the two shapes.
    pub agreement: f64,
}

/// How the eigenvalues of a point were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EigenvalueSearch {
    /// All of them were searched for.
    Whole,
    /// They were continued from those of another point, and no other one is unstable by a count.
    Continued,
    /// They were searched for since they could not be continued with certainty.
    FellBack,
    /// They were continued, and it was not counted whether other unstable ones are missing.
    Uncounted,
    /// They were searched for, or more of them continued, since unstable ones were missing among those continued first.
    Missed,
    /// They were continued from those of a point that could not be continued itself, and no other one is unstable by a
    /// count.
    Rebased,
}

/// Outcome of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// 0, or the exit code of the failure.
    pub status: i32,
    /// Error message.
    pub message: String,
    /// Eigenvalues by falling growth rate, 1/s.
    pub eigenvalues: Vec<Complex<f64>>,
    /// The largest one.
    pub backward_error: f64,
    /// Closed nodes or contact points.
    pub closed: usize,
    /// Number of sticking nodes among them.
    pub sticking: usize,
    /// Number of nodes among them that would stick and are made to slide.
    pub reversed: usize,
    /// On body 1, N.
    pub force: [f64; 3],
    /// m; NaN where there is none.
    pub approach: f64,
    /// Angular speed of the axle by its torque, rad/s; NaN where none is given.
    pub angular_speed: f64,
    /// Modes that are followed from the job's own point, where they are.
    pub followed: Vec<Followed>,
    /// How the eigenvalues were found.
    pub search: EigenvalueSearch,
    /// True if the bodies were interpolated over their profiles.
    pub interpolated: bool,
}

impl Outcome {
    /// Outcome of a point that could not be computed.
    pub fn failed(error: &Error) -> Self {
        Self {
            status: error.exit_code(),
            message: printable(&error.to_string()).into_owned(),
            eigenvalues: Vec::new(),
            backward_error: f64::NAN,
            closed: 0,
            sticking: 0,
            reversed: 0,
            force: [f64::NAN; 3],
            approach: f64::NAN,
            angular_speed: f64::NAN,
            followed: Vec::new(),
            search: EigenvalueSearch::Whole,
            interpolated: false,
        }
    }

    /// Number of unstable eigenvalues.
    pub fn unstable(&self) -> usize {
        self.eigenvalues.iter().filter(|l| grows(**l, self.backward_error)).count()
    }
}

/// The group `/sweep`; `own` is what went wrong at the point of the job itself.
pub fn tables(plan: &SweepPlan, all: &[Outcome], own: Option<&Error>) -> Vec<Table> {
    let path = |name: &str| format!("/sweep/{name}");
    let list = |name: &str, units: &str, text: &str, of: &dyn Fn(&Outcome) -> f64| {
        Table::list(&path(name), units, text, all.iter().map(of).collect::<Vec<f64>>())
    };
    let count = |name: &str, text: &str, of: &dyn Fn(&Outcome) -> usize| {
        Table::list(&path(name), "1", text, all.iter().map(|o| of(o) as i64).collect::<Vec<i64>>())
    };
    let leading = |o: &Outcome| o.eigenvalues.first().copied();
    let offsets: Vec<i64> = std::iter::once(0)
        .chain(all.iter().scan(0i64, |sum, o| {
            *sum += o.eigenvalues.len() as i64;
            Some(*sum)
        }))
        .collect();
    let mut tables = vec![
        Table::list("/sweep/keys", "-", "Swept keys of the job.", plan.keys.clone()),
        Table::list(
            "/sweep/shape",
            "1",
            "Numbers of values along the keys of a grid, the last key running fastest; one number where lists \
             run side by side.",
            plan.shape.iter().map(|&n| n as i64).collect::<Vec<i64>>(),
        ),
        Table::list(
            "/sweep/status",
            "-",
            "0 computed, else the exit code that a run of this point alone would have.",
            all.iter().map(|o| o.status).collect::<Vec<i32>>(),
        ),
        Table::list(
            "/sweep/message",
            "-",
            "Error at a point; empty where there was none.",
            all.iter().map(|o| o.message.clone()).collect::<Vec<String>>(),
        ),
        Table::scalar(
            "/sweep/own_status",
            "-",
            "Status of the job's own point, whose results are in the other groups.",
            own.map_or(0, Error::exit_code),
        ),
        Table::scalar(
            "/sweep/own_message",
            "-",
            "Error at the job's own point; empty where there was none.",
            own.map_or("", Error::message),
        ),
        count("unstable", "Number of unstable eigenvalues, one of each conjugate pair.", &Outcome::unstable),
        list("growth_rate", "1/s", "Largest growth rate; NaN where the point failed.", &|o| {
            leading(o).map_or(f64::NAN, |l| l.re)
        }),
        list("frequency", "Hz", "Frequency of the eigenvalue with the largest growth rate.", &|o| {
            leading(o).map_or(f64::NAN, |l| l.im.abs() / (2.0 * std::f64::consts::PI))
        }),
        list("backward_error", "1", "Largest backward error of the eigenpairs.", &|o| o.backward_error),
        count("closed", "Closed contact nodes.", &|o| o.closed),
        count("sticking", "Closed nodes that stick.", &|o| o.sticking),
        count("reversed", "Closed nodes whose creep points against the sliding assumed.", &|o| o.reversed),
        Table::new(
            "/sweep/force",
            "N",
            "Contact force (x, y, z) on body 1.",
            &[all.len(), 3],
            all.iter().flat_map(|o| o.force).collect::<Vec<f64>>(),
        ),
        list("approach", "m", "Rigid approach.", &|o| o.approach),
        Table::list(
            "/sweep/eigenvalue",
            "1/s",
            "Eigenvalues of all points, one of each conjugate pair, by falling growth rate; offset says where \
             each point begins.",
            all.iter().flat_map(|o| o.eigenvalues.iter().copied()).collect::<Vec<Complex<f64>>>(),
        ),
        Table::list("/sweep/offset", "1", "First eigenvalue of each point in /sweep/eigenvalue, and the end.", offsets),
    ];
    if all.iter().any(|o| o.angular_speed.is_finite()) {
        let text = "Angular speed of the axle by its torque; NaN where the point failed.";
        tables.push(list("angular_speed", "rad/s", text, &|o| o.angular_speed));
    }
    for ((key, unit), values) in plan.keys.iter().zip(&plan.units).zip(&plan.values) {
        let text = format!("Value of {key} at each point.");
        let numbers: Option<Vec<f64>> = values.iter().map(serde_json::Value::as_f64).collect();
        tables.push(match numbers {
            Some(numbers) => Table::list(&path(&format!("values/{key}")), unit, &text, numbers),
            None => {
                let words: Vec<String> =
                    values.iter().map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned)).collect();
                Table::list(&path(&format!("values/{key}")), "-", &text, words)
            }
        });
    }
    tables
}
