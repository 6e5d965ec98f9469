//! The number of the job format, and the defaults that have changed with it.
//!
//! A job says by its key `version` which format it was written for. Jobs of earlier formats are read with the
//! defaults of today; what they leave open and would have meant something else then is told to who runs them.

use serde_json::Value;

/// The job format of this program. A default that changes makes a new one, with a line in `CHANGES`.
pub const FORMAT: u32 = 5;

/// Every default that has changed, oldest first.
const CHANGES: &[DefaultChange] = &[
    // Linearised about a sliding that is not there, most of what rolls on a curve was unstable.
    DefaultChange {
        since: 2,
        key: "analyses.stability.state",
        before: "\"sliding\"",
        now: "\"steady\" (\"sliding\" with the direction \"rigid\")",
    },
    DefaultChange { since: 2, key: "analyses.stability.direction", before: "\"rigid\"", now: "\"actual\"" },
    DefaultChange {
        since: 2,
        key: "analyses.stability.damping_ratio",
        before: "1 (all eigenvalues are listed)",
        now: "0.3",
    },
    DefaultChange {
        since: 2,
        key: "analyses.transient.start.state",
        before: "\"sliding\"",
        now: "the state of analyses.stability",
    },
    // Without a memory a falling law is ill-posed: its answers were no answers.
    DefaultChange { since: 2, key: "contact.friction.exponential.memory_length", before: "no memory", now: "2e-5 m" },
    DefaultChange { since: 2, key: "contact.friction.rational.memory_length", before: "no memory", now: "2e-5 m" },
    // The material of a wheel moves through the frame, and so its inertia.
    DefaultChange { since: 3, key: "bodies.*.rotation", before: "\"none\"", now: "\"rolling\"" },
    // Waves along a rail are longer than its ends, and came back.
    DefaultChange { since: 4, key: "bodies.*.track.ends.longitudinal", before: "0.0", now: "0.9" },
    // A wheel without damping has unstable modes that no wheel has.
    DefaultChange { since: 5, key: "bodies.*.damping", before: "none", now: "loss factors by nodal diameters" },
];

/// Test of a resolved entry: true if it has the default of before.
type AsBefore = fn(&Value) -> bool;

/// Changes that are no change of some of the entries with their key: the format, the key, and what tells these by the
/// resolved entry that holds it.
const UNCHANGED: &[(u32, &str, AsBefore)] = &[(5, "bodies.*.damping", super::damping::as_before_5)];

/// A default that changed.
#[derive(Debug, Clone, Copy)]
pub(super) struct DefaultChange {
    /// The first format that has the new one.
    pub since: u32,
    /// The key by its dotted path; `*` stands for any one segment.
    pub key: &'static str,
    /// The default before, as the user would write it.
    pub before: &'static str,
    /// The default from then on.
    pub now: &'static str,
}

/// A job format: its number, and what has changed up to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct JobFormat {
    pub number: u32,
    pub changes: &'static [DefaultChange],
}

impl JobFormat {
    /// The one of this program.
    pub const PRESENT: JobFormat = JobFormat { number: FORMAT, changes: CHANGES };

    /// A fault if the job is written for a later format, whose keys this program cannot know.
    pub fn later(&self, job: &Value) -> Option<String> {
        let number = job.get("version")?.as_u64().filter(|&n| n > u64::from(self.number))?;
        let known = match self.number {
            1 => "1".into(),
            n => format!("1 to {n}"),
        };
        Some(format!("version: found {number}, expected {known}: the job is written for a later railsqueal"))
    }

    /// The defaults, one line each, that have changed since the format of `job` (as written) and that it takes up:
    /// where the entry with the key is in `resolved`, with another value than before, and the job leaves the key out.
    pub fn changed(&self, job: &Value, resolved: &Value) -> Vec<String> {
        let number = job.get("version").and_then(Value::as_u64).unwrap_or(u64::from(self.number));
        let mut lines = Vec::new();
        for change in self.changes.iter().filter(|c| u64::from(c.since) > number) {
            let segments: Vec<&str> = change.key.split('.').collect();
            let mut places = Vec::new();
            open(Some(job), resolved, &segments, String::new(), &mut places);
            let before = serde_json::from_str::<Value>(change.before).ok();
            let same = UNCHANGED.iter().find(|(since, key, _)| (*since, *key) == (change.since, change.key));
            let changed = |place: &&String| {
                let holder = place.rsplit_once('.').map_or("", |(holder, _)| holder);
                let holder = resolved.pointer(&format!("/{}", holder.replace('.', "/")));
                if same.zip(holder).is_some_and(|((_, _, is), holder)| is(holder)) {
                    return false;
                }
                let now = resolved.pointer(&format!("/{}", place.replace('.', "/")));
                now.is_none() || now != before.as_ref()
            };
            lines.extend(places.iter().filter(changed).map(|place| {
                let DefaultChange { since, before, now, .. } = change;
                format!("{place} is not given: {now} since format {since}, {before} before")
            }));
        }
        lines
    }
}

/// Places that `segments` lead to in `resolved` and that are not given in `job`.
fn open(job: Option<&Value>, resolved: &Value, segments: &[&str], path: String, places: &mut Vec<String>) {
    let Some((first, rest)) = segments.split_first() else { return };
    let Some(entry) = resolved.as_object() else { return };
    let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    let given = |key: &str| job.and_then(|j| j.get(key)).filter(|v| !v.is_null());
    match (rest, *first) {
        ([], key) => {
            if given(key).is_none() {
                places.push(join(key));
            }
        }
        (_, "*") => entry.iter().for_each(|(key, inner)| open(given(key), inner, rest, join(key), places)),
        (_, key) => {
            if let Some(inner) = entry.get(key) {
                open(given(key), inner, rest, join(key), places);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Job;
    use serde_json::json;
    use std::path::Path;

    const SQUEAL: &[u8] = include_bytes!("../../jobs/squeal.json");

    /// A program of format 3 in which defaults have changed twice.
    const THIRD: JobFormat = JobFormat {
        number: 3,
        changes: &[
            DefaultChange { since: 2, key: "analyses.transient.theta", before: "0.6", now: "0.51" },
            DefaultChange { since: 2, key: "analyses.transient.step", before: "2e-5", now: "1e-5" },
            DefaultChange { since: 2, key: "analyses.steady.tolerance", before: "1e-6", now: "1e-8" },
            DefaultChange { since: 3, key: "bodies.*.mesh.cylinder.growth", before: "1.4", now: "1.3" },
            DefaultChange { since: 3, key: "solver.linear", before: "\"gamg\"", now: "\"mumps\"" },
        ],
    };

    fn read(sets: &[&str], format: &JobFormat) -> crate::Result<Job> {
        let mut job: Value = serde_json::from_slice(SQUEAL).unwrap();
        job["version"] = json!(format.number);
        let job = job.to_string();
        let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
        Job::of_format(job.as_bytes(), Path::new("job.json"), &sets, None, format)
    }

    #[test]
    fn an_older_job_is_told_the_defaults_it_takes_up() {
        let job = read(&["version=1"], &THIRD).unwrap();
        // Not the step, which it gives, nor the tolerance of an analysis that it has not.
        let expected = [
            "analyses.transient.theta is not given: 0.51 since format 2, 0.6 before",
            "bodies.lower.mesh.cylinder.growth is not given: 1.3 since format 3, 1.4 before",
            "bodies.upper.mesh.cylinder.growth is not given: 1.3 since format 3, 1.4 before",
            "solver.linear is not given: \"mumps\" since format 3, \"gamg\" before",
        ];
        assert_eq!(job.changed_defaults, expected);
        // As resolved it has the defaults of today.
        assert_eq!(job.version, 3);
        let given = [
            "version=1",
            "analyses.transient.theta=0.5",
            "bodies.lower.mesh.cylinder.growth=1.3",
            "solver.linear=mumps",
        ];
        assert_eq!(read(&given, &THIRD).unwrap().changed_defaults, expected[2..3]);
    }

    #[test]
    fn a_job_of_the_present_format_is_told_nothing_and_a_later_one_is_refused() {
        assert!(read(&[], &JobFormat::PRESENT).unwrap().changed_defaults.is_empty());
        assert_eq!(read(&[], &JobFormat::PRESENT).unwrap().version, FORMAT);
        let resolved = read(&[], &THIRD).unwrap().to_json();
        let told = |number: u32| THIRD.changed(&json!({ "version": number }), &resolved).len();
        assert_eq!([1, 2, 3].map(told), [5, 3, 0], "those of formats 2 and 3, of format 3, none");
        let present = format!("expected 1 to {FORMAT}:");
        for (format, known) in [(THIRD, "expected 1 to 3:"), (JobFormat::PRESENT, &present[..])] {
            // Its keys may be unknown here; that is not what is wrong.
            let later = json!({ "version": FORMAT + 1, "key_of_the_future": 1 }).to_string();
            let error = Job::of_format(later.as_bytes(), Path::new("job.json"), &[], None, &format).unwrap_err();
            let text = error.to_string();
            let found = format!("version: found {}", FORMAT + 1);
            assert!(text.contains(&found) && text.contains(known) && !text.contains("future"), "{text}");
        }
    }

    #[test]
    fn every_change_is_of_a_key_and_of_a_format_up_to_the_present_one() {
        let known = crate::job::schema::Checker::default();
        for change in CHANGES {
            assert!(change.since > 1, "{change:?}: the first format changed nothing");
            assert!(change.since <= FORMAT, "{change:?}");
            let path: Vec<&str> = change.key.split('.').map(|s| if s == "*" { "lower" } else { s }).collect();
            let (key, entry) = path.split_last().unwrap();
            assert!(known.keys_at(entry).is_some_and(|keys| keys.iter().any(|k| k == key)), "{change:?}");
        }
    }
}
