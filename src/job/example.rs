//! A job to try things on.

use super::Job;
use std::path::Path;

/// The two-cylinder job with keys set.
pub(crate) fn two_cylinders(sets: &[&str]) -> Job {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    let bytes = include_bytes!("../../jobs/two-cylinders.json");
    Job::from_bytes(bytes, Path::new("job.json"), &sets, None).unwrap()
}

/// The wheel at a given shift and yaw on a rail, with keys set.
pub(crate) fn wheel_on_rail(sets: &[&str]) -> Job {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    let bytes = include_bytes!("../../jobs/wheel-at-given-yaw.json");
    Job::from_bytes(bytes, Path::new("job.json"), &sets, None).unwrap()
}
