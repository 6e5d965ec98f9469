//! A job as it was written, with other values of some of its keys.

use super::{overrides, parse, schema};
use crate::Result;
use serde_json::Value;
use std::path::Path;

/// The text of the job in `bytes` after the overrides `sets`, with numbers at dotted paths; all other keys as they were
/// written. `path` names it in messages.
///
/// # Errors
/// A job that is no JSON; overrides of keys that do not exist.
pub fn with_numbers(bytes: &[u8], path: &Path, sets: &[String], numbers: &[(String, f64)]) -> Result<String> {
    let mut value = parse::parse(bytes, &path.display().to_string())?;
    overrides::apply(&mut value, sets, &schema::Checker::default())?;
    for (key, number) in numbers {
        let segments: Vec<&str> = key.split('.').collect();
        overrides::put(&mut value, &segments, Value::from(*number), key)?;
    }
    Ok(format!("{value:#}\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_keys_stay_as_they_were_written() {
        let text = br#"{"version": 5, "title": "t", "bodies": {"lower": {"track": {"pad": {"vertical": 1e8}}}}}"#;
        let sets = ["title=new".to_owned()];
        let numbers =
            [("bodies.lower.track.pad.vertical".to_owned(), 2.5e8), ("bodies.lower.track.spacing".into(), 0.65)];
        let found = with_numbers(text, Path::new("job.json"), &sets, &numbers).expect("a job");
        let wanted =
            r#"{"version":5,"title":"new","bodies":{"lower":{"track":{"pad":{"vertical":2.5e8},"spacing":0.65}}}}"#;
        let [found, wanted]: [Value; 2] = [found.as_str(), wanted].map(|t| serde_json::from_str(t).expect("JSON"));
        assert_eq!(found, wanted);
        assert_eq!(with_numbers(text, Path::new("j"), &["tittle=new".into()], &[]).expect_err("no key").exit_code(), 2);
    }
}
