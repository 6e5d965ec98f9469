//! What the points of a sweep gave: on its way to rank 0, in the results and in the summary.

use crate::analysis::report::Summary;
use crate::job::SweepPlan;
use crate::output::Table;
use crate::{Error, Result};
use num_complex::Complex;

/// What a point gave.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Outcome {
    /// 0, or the exit code of the failure.
    pub status: i32,
    /// What went wrong.
    pub message: String,
    /// Eigenvalues by falling growth rate, 1/s.
    pub eigenvalues: Vec<Complex<f64>>,
    /// The largest one.
    pub backward_error: f64,
    /// Closed nodes or contact points.
    pub closed: usize,
    /// Those of them that would stick.
    pub reversed: usize,
    /// On body 1, N.
    pub force: [f64; 3],
    /// m; NaN where there is none.
    pub approach: f64,
}

impl Outcome {
    /// Of a point that could not be computed.
    pub fn failed(error: &Error) -> Self {
        Self {
            status: error.exit_code(),
            message: error.to_string(),
            eigenvalues: Vec::new(),
            backward_error: f64::NAN,
            closed: 0,
            reversed: 0,
            force: [f64::NAN; 3],
            approach: f64::NAN,
        }
    }

    fn unstable(&self) -> usize {
        self.eigenvalues.iter().filter(|l| l.re > 0.0).count()
    }
}

/// Outcomes as they travel to rank 0.
#[derive(Default)]
pub(super) struct Packed {
    pub numbers: Vec<f64>,
    pub text: Vec<u8>,
}

/// Numbers of an outcome before its eigenvalues.
const HEAD: usize = 11;

impl Packed {
    /// Adds the outcome of a point.
    pub fn push(&mut self, index: usize, o: &Outcome) {
        let counts = [index, o.status as usize, o.closed, o.reversed, o.message.len(), o.eigenvalues.len()];
        self.numbers.extend(counts.map(|n| n as f64));
        self.numbers.extend(o.force);
        self.numbers.extend([o.approach, o.backward_error]);
        self.numbers.extend(o.eigenvalues.iter().flat_map(|l| [l.re, l.im]));
        self.text.extend(o.message.as_bytes());
    }

    /// Puts all outcomes in their places.
    pub fn unpack(&self, into: &mut [Option<Outcome>]) -> Result<()> {
        let torn = || Error::Defect("results of a sweep were torn on their way".into());
        let (mut numbers, mut text) = (&self.numbers[..], &self.text[..]);
        while !numbers.is_empty() {
            let (head, rest) = numbers.split_at_checked(HEAD).ok_or_else(torn)?;
            let count = |k: usize| head[k] as usize;
            let (values, rest) = rest.split_at_checked(2 * count(5)).ok_or_else(torn)?;
            let (message, after) = text.split_at_checked(count(4)).ok_or_else(torn)?;
            (numbers, text) = (rest, after);
            *into.get_mut(count(0)).ok_or_else(torn)? = Some(Outcome {
                status: head[1] as i32,
                message: String::from_utf8_lossy(message).into_owned(),
                eigenvalues: values.chunks_exact(2).map(|v| Complex::new(v[0], v[1])).collect(),
                backward_error: head[10],
                closed: count(2),
                reversed: count(3),
                force: [head[6], head[7], head[8]],
                approach: head[9],
            });
        }
        Ok(())
    }
}

/// The group `/sweep`; `own` is what went wrong at the point of the job itself.
pub(super) fn tables(plan: &SweepPlan, all: &[Outcome], own: Option<&Error>) -> Vec<Table> {
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
            "Numbers of values along the keys of a grid, the last key running fastest; one number where lists run side by side.",
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
            "What went wrong at a point; empty where nothing did.",
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
            "What went wrong at the job's own point; empty where nothing did.",
            own.map_or("", Error::message),
        ),
        count("unstable", "Number of unstable eigenvalues, one of each conjugate pair.", &Outcome::unstable),
        list("growth_rate", "1/s", "Largest growth rate; NaN where the point failed.", &|o| {
            leading(o).map_or(f64::NAN, |l| l.re)
        }),
        list("frequency", "Hz", "Frequency of the eigenvalue with the largest growth rate.", &|o| {
            leading(o).map_or(f64::NAN, |l| l.im / (2.0 * std::f64::consts::PI))
        }),
        list("backward_error", "1", "Largest backward error of the eigenpairs.", &|o| o.backward_error),
        count("closed", "Closed contact nodes.", &|o| o.closed),
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
            "Eigenvalues of all points, one of each conjugate pair, by falling growth rate; offset says where each point begins.",
            all.iter().flat_map(|o| o.eigenvalues.iter().copied()).collect::<Vec<Complex<f64>>>(),
        ),
        Table::list("/sweep/offset", "1", "First eigenvalue of each point in /sweep/eigenvalue, and the end.", offsets),
    ];
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

/// What the summary says of them; `kind` names the `models` that they were computed on.
pub(super) fn summarise(plan: &SweepPlan, all: &[Outcome], models: usize, kind: &str, summary: &mut Summary) {
    let failed: Vec<usize> = (0..all.len()).filter(|&i| all[i].status != 0).collect();
    let unstable = all.iter().filter(|o| o.unstable() > 0).count();
    summary.line(format!(
        "sweep of {}: {} points on {models} {kind} model{}, {unstable} unstable, {} failed",
        plan.keys.join(", "),
        all.len(),
        if models == 1 { "" } else { "s" },
        failed.len()
    ));
    let place = |i: usize| {
        let here: Vec<String> =
            plan.keys.iter().zip(&plan.values).map(|(key, values)| format!("{key} = {}", values[i])).collect();
        here.join(", ")
    };
    let growth = |i: &usize| all[*i].eigenvalues.first().map_or(f64::NEG_INFINITY, |l| l.re);
    let worst = (0..all.len()).filter(|&i| all[i].status == 0).max_by(|a, b| growth(a).total_cmp(&growth(b)));
    if let Some(l) = worst.and_then(|i| all[i].eigenvalues.first()) {
        let frequency = l.im / (2.0 * std::f64::consts::PI);
        summary.value("largest growth rate", format!("{:+.4} 1/s at {frequency:.3} Hz", l.re));
        summary.value("  there", place(worst.unwrap_or_default()));
    }
    let Some(&first) = failed.first() else { return };
    summary.value("first failed point", format!("{}: {}", place(first), all[first].message));
    summary.fail(Error::NotConverged(format!(
        "{} of {} points of the sweep failed, the others are in the results; /sweep/status and /sweep/message say which and why. \
         The first is {}: {}",
        failed.len(),
        all.len(),
        place(first),
        all[first].message
    )));
}
