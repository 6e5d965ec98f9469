//! Uncertain inputs with the distribution of what was measured: `"distribution": "measured"`.

use super::model::*;

/// Value and standard deviation of a key of a measured mode; none of another key.
type Measured = Option<(Option<f64>, Option<f64>)>;

/// The measured number at a dotted path, and its standard deviation.
fn measured(job: &Job, key: &str) -> Measured {
    let rest = key.strip_prefix("bodies.")?;
    let (name, rest) = rest.split_once(".modes.measured.")?;
    let (index, what) = rest.split_once('.')?;
    let bodies = job.all_bodies();
    let (_, body) = bodies.iter().find(|(of, _)| of == name)?;
    let mode = body.modes.as_ref()?.measured.get(index.parse::<usize>().ok()?)?;
    match what {
        "frequency" => Some((mode.frequency, mode.frequency_deviation)),
        "loss_factor" => Some((mode.loss_factor, mode.loss_factor_deviation)),
        "damping_ratio" => Some((mode.damping_ratio, mode.damping_ratio_deviation)),
        _ => None,
    }
}

impl Job {
    /// Makes `"measured"` the normal distribution about the measured value, cut off below 0 where the job says no ends;
    /// the faults of inputs that were not measured.
    pub(super) fn resolve_measured_inputs(&mut self) -> Vec<String> {
        let Some(wanted) = &self.analyses.uncertainty else { return Vec::new() };
        let (mut inputs, mut faults) = (wanted.inputs.clone(), Vec::new());
        let asked = |input: &UncertainInput| input.distribution == Distribution::Measured;
        for (i, input) in inputs.iter_mut().enumerate().filter(|(_, input)| asked(input)) {
            let place = format!("analyses.uncertainty.inputs.{i} ({}).distribution", input.key);
            match measured(self, &input.key) {
                Some((Some(mean), Some(deviation))) => {
                    input.distribution = Distribution::Normal { mean, deviation };
                    input.truncate = input.truncate.or(Some([Some(0.0), None]));
                }
                Some((None, _)) => faults.push(format!("{place}: found \"measured\", but {} is not given", input.key)),
                Some((_, None)) => faults.push(format!(
                    "{place}: found \"measured\", expected its standard deviation at {}_deviation",
                    input.key
                )),
                None => faults.push(format!(
                    "{place}: found \"measured\", expected a key such as bodies.upper.modes.measured.0.loss_factor; \
                     give another distribution"
                )),
            }
        }
        if let Some(wanted) = &mut self.analyses.uncertainty {
            wanted.inputs = inputs;
        }
        faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Result;
    use std::path::Path;

    const WHEEL: &str = include_str!("../../jobs/wheel-at-given-yaw.json");

    fn read(measured: &str, inputs: &str) -> Result<Job> {
        let sets = [
            format!(r#"bodies.upper.modes={{"measured": [{measured}]}}"#),
            format!(r#"analyses.uncertainty={{"inputs": [{inputs}], "samples": 32}}"#),
        ];
        Job::from_bytes(WHEEL.as_bytes(), Path::new("job.json"), &sets, None)
    }

    const MODE: &str = r#"{"near": 344, "loss_factor": 3e-4, "loss_factor_deviation": 1e-4}"#;
    const INPUT: &str = r#"{"key": "bodies.upper.modes.measured.0.loss_factor", "distribution": "measured"}"#;

    /// The samples are those of the normal distribution that ends at 0, as if it were written out.
    #[test]
    fn what_was_measured_is_its_distribution() {
        let job = read(MODE, INPUT).unwrap();
        let input = &job.analyses.uncertainty.as_ref().unwrap().inputs[0];
        assert_eq!(input.distribution, Distribution::Normal { mean: 3e-4, deviation: 1e-4 });
        assert_eq!(input.truncate, Some([Some(0.0), None]));
        let normal = r#"{"normal": {"mean": 3e-4, "deviation": 1e-4}}, "truncate": [0, null]"#;
        let written = read(MODE, &INPUT.replace("\"measured\"", normal)).unwrap();
        let values = |job: &Job| job.sweep.as_ref().unwrap().values.clone();
        assert_eq!(values(&job), values(&written));
    }

    #[test]
    fn what_was_not_measured_is_refused() {
        for (mode, input, part) in [
            (
                r#"{"near": 344, "loss_factor": 3e-4}"#,
                INPUT.to_owned(),
                "expected its standard deviation at bodies.upper.modes.measured.0.loss_factor_deviation",
            ),
            (MODE, INPUT.replace("loss_factor", "frequency"), "measured.0.frequency is not given"),
            (MODE, INPUT.replace(".0.", ".1."), "expected a key such as"),
            (
                MODE,
                r#"{"key": "contact.friction", "distribution": "measured"}"#.to_owned(),
                "expected a key such as bodies.upper.modes.measured.0.loss_factor",
            ),
            (
                r#"{"near": 344, "frequency": 350, "loss_factor_deviation": 1e-4}"#,
                INPUT.to_owned(),
                "measured.0.loss_factor is not given",
            ),
        ] {
            let error = read(mode, &input).unwrap_err();
            assert!(error.exit_code() == 2 && error.message().contains(part), "{part}: {error}");
        }
    }
}
