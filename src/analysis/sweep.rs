//! The analysis `sweep`: stability at many points, spread over the ranks. What the finite elements give is made once for all
//! points that share it, by all ranks together; the points themselves are solved by one rank each.

use super::bodies::Bodies;
use super::reduction::{damping, fe_inputs, Reduction, SharedModel};
use super::report::Summary;
use super::{modes, stability};
use crate::job::{Job, SweepPlan};
use crate::output::{ResultFile, Table};
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::{Error, Result};
use num_complex::Complex;

/// Collective: every point of `plan`, tables under `/sweep`. `base` is the reduced model of `job` itself, which serves all
/// points with the same finite elements. Points that fail are in the table with what went wrong, and in the summary as the failure of
/// the run.
pub fn run(
    petsc: &Petsc,
    job: &Job,
    plan: &SweepPlan,
    base: &Reduction,
    file: &mut ResultFile,
    progress: &mut Progress,
    summary: &mut Summary,
) -> Result<()> {
    let world = petsc.world();
    let mut results: Vec<Option<Outcome>> = vec![None; plan.points.len()];
    let groups = groups(&plan.points);
    for (number, (inputs, members)) in groups.iter().enumerate() {
        let model = if *inputs == fe_inputs(job) {
            SharedModel::broadcast(world, base.on_root())?
        } else {
            progress.note(format!("finite elements {} of {}", number + 1, groups.len()));
            match build(petsc, &plan.points[members[0]], progress) {
                Ok(model) => model,
                Err(e) if matches!(e, Error::Defect(_) | Error::Io(_)) => return Err(e),
                Err(e) => {
                    members.iter().for_each(|&i| results[i] = Some(Outcome::failed(&e)));
                    continue;
                }
            }
        };
        progress.stage("points of the sweep");
        let mut mine = Packed::default();
        let mut model = model;
        for (done, &i) in members.iter().enumerate().skip(world.rank).step_by(world.size) {
            mine.push(i, &solve(&plan.points[i], &mut model));
            progress.step("points", (done + world.size).min(members.len()), members.len());
        }
        let (numbers, text) = (world.gather(&mine.numbers), world.gather(&mine.text));
        world.on_root(|| Packed { numbers, text }.unpack(&mut results))?;
    }
    world.on_root(|| {
        let all: Vec<Outcome> = results
            .into_iter()
            .map(|r| r.ok_or_else(|| Error::Defect("a point of the sweep was not computed".into())))
            .collect::<Result<_>>()?;
        file.tables(tables(plan, &all));
        summarise(plan, &all, groups.len(), summary);
        Ok(())
    })?;
    Ok(())
}

/// The points by the finite elements they need, in the order of their first points.
fn groups(points: &[Job]) -> Vec<(serde_json::Value, Vec<usize>)> {
    let mut groups: Vec<(serde_json::Value, Vec<usize>)> = Vec::new();
    for (i, point) in points.iter().enumerate() {
        let inputs = fe_inputs(point);
        // Neighbouring points mostly share them.
        match groups.iter_mut().rev().find(|g| g.0 == inputs) {
            Some(group) => group.1.push(i),
            None => groups.push((inputs, vec![i])),
        }
    }
    groups
}

/// Collective: the reduced model of a point, on every rank.
fn build(petsc: &Petsc, point: &Job, progress: &mut Progress) -> Result<SharedModel> {
    let world = petsc.world();
    let mut quiet = Summary::default();
    let mut job = point.clone();
    // Each point brings its own damping.
    for body in [&mut job.bodies.lower, &mut job.bodies.upper].into_iter().flatten() {
        body.damping = Default::default();
    }
    let contact = job.contact.as_ref().ok_or_else(|| Error::Defect("a point of a sweep without contact".into()))?;
    let bodies = Bodies::build(world, &job, progress, &mut quiet)?;
    let mut solvers = bodies.solvers(petsc, &job, progress, &mut quiet)?;
    let found = modes::compute_all(petsc, &job, &bodies, &mut solvers, progress)?;
    let model = Reduction::build(world, &job, contact, &bodies, &found, &mut solvers, progress)?;
    SharedModel::broadcast(world, model.on_root())
}

/// What a point gave.
#[derive(Debug, Clone, PartialEq)]
struct Outcome {
    /// 0, or the exit code of the failure.
    status: i32,
    message: String,
    eigenvalues: Vec<Complex<f64>>,
    backward_error: f64,
    closed: usize,
    reversed: usize,
    force: [f64; 3],
    approach: f64,
}

impl Outcome {
    fn failed(error: &Error) -> Self {
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

/// Stability at one point, on this rank alone.
fn solve(point: &Job, model: &mut SharedModel) -> Outcome {
    let mut work = || -> Result<Outcome> {
        let (Some(wanted), Some(contact)) = (&point.analyses.stability, &point.contact) else {
            return Err(Error::Defect("a point of a sweep without contact or stability".into()));
        };
        super::plan::small_strain(point)?;
        let (lower, upper) = model.pair.omega.split_at(model.pair.lower_modes);
        let mut coefficients = Vec::new();
        for ((name, body), omega) in point.bodies().into_iter().zip([lower, upper]) {
            coefficients.extend(damping(&body.damping, omega, &format!("bodies.{name}.damping"))?);
        }
        model.pair.damping = coefficients;
        let stability::Found { sliding, spectrum: found, .. } =
            stability::analyse(wanted, contact, &model.interface, &model.pair)?;
        Ok(Outcome {
            status: 0,
            message: String::new(),
            eigenvalues: found.eigenpairs.iter().map(|p| p.value).collect(),
            backward_error: found.eigenpairs.iter().map(|p| p.backward_error).fold(0.0, f64::max),
            closed: sliding.closed.len(),
            reversed: sliding.reversed,
            force: sliding.force,
            approach: sliding.approach,
        })
    };
    work().unwrap_or_else(|e| Outcome::failed(&e))
}

/// Outcomes as they travel to rank 0.
#[derive(Default)]
struct Packed {
    numbers: Vec<f64>,
    text: Vec<u8>,
}

/// Numbers of an outcome before its eigenvalues.
const HEAD: usize = 11;

impl Packed {
    fn push(&mut self, index: usize, o: &Outcome) {
        let counts = [index, o.status as usize, o.closed, o.reversed, o.message.len(), o.eigenvalues.len()];
        self.numbers.extend(counts.map(|n| n as f64));
        self.numbers.extend(o.force);
        self.numbers.extend([o.approach, o.backward_error]);
        self.numbers.extend(o.eigenvalues.iter().flat_map(|l| [l.re, l.im]));
        self.text.extend(o.message.as_bytes());
    }

    fn unpack(&self, into: &mut [Option<Outcome>]) -> Result<()> {
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

/// The group `/sweep`.
fn tables(plan: &SweepPlan, all: &[Outcome]) -> Vec<Table> {
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

fn summarise(plan: &SweepPlan, all: &[Outcome], models: usize, summary: &mut Summary) {
    let failed: Vec<usize> = (0..all.len()).filter(|&i| all[i].status != 0).collect();
    let unstable = all.iter().filter(|o| o.unstable() > 0).count();
    summary.line(format!(
        "sweep of {}: {} points on {models} finite-element model{}, {unstable} unstable, {} failed",
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
