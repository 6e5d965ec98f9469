//! The group `/uncertainty`.

use super::super::Table;
use super::sweep::Outcome;
use crate::job::SweepPlan;
use crate::random::indices::Indices;
use crate::random::interval::IntervalMethod;
use num_complex::Complex;
use std::f64::consts::PI;

/// Statistics of a mode of the job's own point.
#[derive(Debug, Clone)]
pub struct ModeOf {
    /// Its frequency and what it consists of.
    pub name: String,
    /// Its eigenvalue at the job's own point, 1/s.
    pub own: Complex<f64>,
    /// Probability that it is unstable.
    pub probability: f64,
    /// Ends of the confidence interval.
    pub interval: [f64; 2],
    /// How the interval was made.
    pub method: IntervalMethod,
    /// Share of the samples in which it was found.
    pub found: f64,
    /// Least modal assurance criterion of those; NaN without any.
    pub agreement: f64,
    /// Quantiles of its growth rate, 1/s.
    pub quantiles: [f64; 7],
    /// Its eigenvalue at each point, where it was found, 1/s.
    pub values: Vec<Option<Complex<f64>>>,
}

/// Statistics of the samples.
#[derive(Debug, Clone)]
pub struct StudyStatistics {
    /// The uncertain keys.
    pub keys: Vec<String>,
    /// Place of each point in the design: 0 for A, 1 for B, 2 + i for A with the input i of B.
    pub parts: Vec<usize>,
    /// Number of samples at random, and of those that failed.
    pub samples: usize,
    /// Number of those that failed.
    pub failed: usize,
    /// Probability that any mode is unstable.
    pub probability: f64,
    /// Ends of its confidence interval.
    pub interval: [f64; 2],
    /// How the interval was made.
    pub method: IntervalMethod,
    /// Probability of growth that is none of the modes.
    pub other: f64,
    /// Ends of its confidence interval.
    pub other_interval: [f64; 2],
    /// Probability with which intervals hold what they stand for.
    pub confidence: f64,
    /// Probabilities of the quantiles.
    pub levels: Vec<f64>,
    /// Quantiles of the largest growth rate, 1/s.
    pub quantiles: [f64; 7],
    /// Modes by falling probability.
    pub modes: Vec<ModeOf>,
    /// Sobol' indices of the largest growth rate by the inputs; empty without them.
    pub indices: Vec<Indices>,
    /// Samples whose points were all computed, from which the indices are.
    pub index_rows: usize,
}

impl StudyStatistics {
    /// How the interval of the probability was made, in words.
    pub fn way(&self) -> &'static str {
        word(self.method)
    }
}

fn word(method: IntervalMethod) -> &'static str {
    match method {
        IntervalMethod::Wilson => "Wilson's formula",
        IntervalMethod::Replicates => "the spread of the replicates",
    }
}

/// The group `/uncertainty` from all points, in the order of the plan.
pub fn tables(plan: &SweepPlan, all: &[Outcome], study: &StudyStatistics) -> Vec<Table> {
    let path = |name: &str| format!("/uncertainty/{name}");
    let list = |name: &str, units: &str, text: &str, values: Vec<f64>| Table::list(&path(name), units, text, values);
    let number = |name: &str, units: &str, text: &str, value: f64| Table::scalar(&path(name), units, text, value);
    let each = |name: &str, units: &str, text: &str, of: &dyn Fn(&Outcome) -> f64| {
        list(name, units, text, all.iter().map(of).collect())
    };
    let count = |name: &str, text: &str, of: &dyn Fn(&Outcome) -> usize| {
        Table::list(&path(name), "1", text, all.iter().map(|o| of(o) as i64).collect::<Vec<i64>>())
    };
    let leading = |o: &Outcome| o.eigenvalues.first().copied();
    let hertz = |z: Complex<f64>| z.im.abs() / (2.0 * PI);
    let mut tables = vec![
        Table::list(&path("keys"), "-", "Uncertain keys of the job.", plan.keys.clone()),
        Table::list(
            &path("part"),
            "-",
            "Place of a point in the design: 0 and 1 are random samples, which the probabilities are of; 2 + i is the \
             sample 0 with the input i of sample 1.",
            study.parts.iter().map(|&p| p as i32).collect::<Vec<i32>>(),
        ),
        Table::list(
            &path("status"),
            "-",
            "0 computed, else the exit code that a run of this point alone would have.",
            all.iter().map(|o| o.status).collect::<Vec<i32>>(),
        ),
        Table::list(
            &path("message"),
            "-",
            "Reason why a point failed; empty where it did not.",
            all.iter().map(|o| o.message.clone()).collect::<Vec<String>>(),
        ),
        count("unstable", "Number of unstable eigenvalues, one of each conjugate pair.", &Outcome::unstable),
        each("growth_rate", "1/s", "Largest growth rate; NaN where the point failed.", &|o| {
            leading(o).map_or(f64::NAN, |l| l.re)
        }),
        each("frequency", "Hz", "Frequency of the eigenvalue with the largest growth rate.", &|o| {
            leading(o).map_or(f64::NAN, hertz)
        }),
        count("closed", "Closed contact nodes.", &|o| o.closed),
        count("sticking", "Closed nodes that stick.", &|o| o.sticking),
        Table::list(
            &path("search"),
            "-",
            "0: all eigenvalues were searched for; 1: they were continued from those of a base point, and no other one \
             is unstable by a count; 2: searched for, since they could not be continued; 3: continued without a count; \
             4: unstable ones were missing among those continued first; 5: continued from those of a \
             point of the kind 2, and counted.",
            all.iter().map(|o| o.search as i32).collect::<Vec<i32>>(),
        ),
        Table::list(
            &path("interpolated"),
            "-",
            "1: what the contact sees of the bodies was interpolated over their profiles; 0: it was computed.",
            all.iter().map(|o| i32::from(o.interpolated)).collect::<Vec<i32>>(),
        ),
        Table::scalar(&path("samples"), "1", "Number of random samples.", study.samples as i64),
        Table::scalar(&path("failed"), "1", "Number of those that failed.", study.failed as i64),
        number("confidence", "1", "Probability with which intervals hold what they stand for.", study.confidence),
        number("probability", "1", "Probability that any mode is unstable.", study.probability),
        list("probability_interval", "1", "Ends of its confidence interval.", study.interval.to_vec()),
        Table::scalar(&path("interval_method"), "-", "Method of that interval.", study.way()),
        number("other_probability", "1", "Probability of growth that is none of the modes.", study.other),
        list("other_interval", "1", "Ends of its confidence interval.", study.other_interval.to_vec()),
        list("levels", "1", "Probabilities of the quantiles.", study.levels.clone()),
        list("quantiles", "1/s", "Quantiles of the largest growth rate.", study.quantiles.to_vec()),
    ];
    for ((key, unit), values) in plan.keys.iter().zip(&plan.units).zip(&plan.values) {
        let numbers = values.iter().map(|v| v.as_f64().unwrap_or(f64::NAN)).collect();
        tables.push(list(&format!("values/{key}"), unit, &format!("Value of {key} at each point."), numbers));
    }
    tables.extend(of_modes(all.len(), &study.modes));
    if !study.indices.is_empty() {
        tables.extend(of_indices(study));
    }
    tables
}

/// Tables of the largest relative differences of growth rates between bodies that are interpolated and bodies computed,
/// one pair for each set of bodies: computed on the same meshes, and on meshes of their own.
pub fn interpolation_errors(all: &[[f64; 2]]) -> Vec<Table> {
    if all.is_empty() {
        return Vec::new();
    }
    let of = |k: usize| all.iter().map(|e| e[k]).collect::<Vec<f64>>();
    let text = "Largest difference of growth rates between interpolated bodies and those computed";
    let over = "over the larger one of the growth rate and 1 1/s";
    vec![
        Table::list("/uncertainty/interpolation_error", "1", &format!("{text} on the same meshes, {over}."), of(0)),
        Table::list("/uncertainty/mesh_scatter", "1", &format!("{text} on meshes of their own, {over}."), of(1)),
    ]
}

fn of_modes(points: usize, modes: &[ModeOf]) -> Vec<Table> {
    let path = |name: &str| format!("/uncertainty/modes/{name}");
    let list = |name: &str, units: &str, text: &str, of: &dyn Fn(&ModeOf) -> f64| {
        Table::list(&path(name), units, text, modes.iter().map(of).collect::<Vec<f64>>())
    };
    let words = |name: &str, text: &str, of: &dyn Fn(&ModeOf) -> String| {
        Table::list(&path(name), "-", text, modes.iter().map(of).collect::<Vec<String>>())
    };
    let pairs = |of: &dyn Fn(&ModeOf) -> [f64; 2]| modes.iter().flat_map(of).collect::<Vec<f64>>();
    let samples = |of: &dyn Fn(Complex<f64>) -> f64| -> Vec<f64> {
        (0..points).flat_map(|i| modes.iter().map(move |m| m.values[i])).map(|v| v.map_or(f64::NAN, of)).collect()
    };
    let (m, all) = (modes.len(), [points, modes.len()]);
    vec![
        words("name", "Frequency at the job's own point and the free mode with the largest share.", &|m| {
            m.name.clone()
        }),
        list("own_frequency", "Hz", "Frequency at the job's own point.", &|m| m.own.im / (2.0 * PI)),
        list("own_growth_rate", "1/s", "Growth rate at the job's own point.", &|m| m.own.re),
        list("probability", "1", "Probability that the mode is unstable.", &|m| m.probability),
        Table::new(&path("interval"), "1", "Ends of its confidence interval.", &[m, 2], pairs(&|m| m.interval)),
        words("interval_method", "Method of that interval.", &|m| word(m.method).into()),
        list("found", "1", "Share of the random samples in which the mode was found by its shape.", &|m| m.found),
        list("agreement", "1", "Least modal assurance criterion of the shapes found.", &|m| m.agreement),
        Table::new(
            &path("quantiles"),
            "1/s",
            "Quantiles of the growth rate of the mode.",
            &[m, 7],
            modes.iter().flat_map(|m| m.quantiles).collect::<Vec<f64>>(),
        ),
        Table::new(
            &path("growth_rate"),
            "1/s",
            "Growth rate of each mode at each point; NaN where it was not found.",
            &all,
            samples(&|z| z.re),
        ),
        Table::new(&path("frequency"), "Hz", "Frequency of it.", &all, samples(&|z| z.im / (2.0 * PI))),
    ]
}

fn of_indices(study: &StudyStatistics) -> Vec<Table> {
    let path = |name: &str| format!("/uncertainty/indices/{name}");
    let all = &study.indices;
    let list = |name: &str, text: &str, of: &dyn Fn(&Indices) -> f64| {
        Table::list(&path(name), "1", text, all.iter().map(of).collect::<Vec<f64>>())
    };
    let interval = |name: &str, of: &dyn Fn(&Indices) -> [f64; 2]| {
        let values: Vec<f64> = all.iter().flat_map(of).collect();
        Table::new(&path(name), "1", "Ends of its confidence interval.", &[all.len(), 2], values)
    };
    vec![
        list("first", "First-order Sobol' index of the largest growth rate by each input.", &|i| i.first),
        interval("first_interval", &|i| i.first_interval),
        list("total", "Total Sobol' index of the largest growth rate by each input.", &|i| i.total),
        interval("total_interval", &|i| i.total_interval),
        Table::scalar(&path("rows"), "1", "Samples with all points computed.", study.index_rows as i64),
    ]
}
