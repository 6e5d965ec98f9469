//! Provenance of a result: the group `/provenance`.

use super::segments::RunOrigin;
use super::table::Table;
use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Data needed to reproduce a result.
#[derive(Debug, Clone, Default)]
pub struct Provenance {
    /// The resolved job as JSON.
    pub job: String,
    /// The command line, argument by argument.
    pub command: Vec<String>,
    /// Name and version of the program and of each library.
    pub versions: Vec<(String, String)>,
    /// Number of ranks.
    pub ranks: usize,
    /// Path, as the job gives it, and SHA-256 of each input file.
    pub inputs: Vec<(String, String)>,
    /// Name and wall time, s, of each stage.
    pub stages: Vec<(String, f64)>,
    /// Start of the run, see [`utc_now`].
    pub date: String,
    /// The parts in which a transient was made.
    pub parts: Vec<RunOrigin>,
    /// Properties that make the results doubtful.
    pub warnings: Vec<String>,
    /// Lines of the summary below the verdict.
    pub summary: Vec<String>,
    /// The damping of each body with modes, in words.
    pub damping: Vec<String>,
}

impl Provenance {
    /// The datasets of the group.
    pub fn tables(&self) -> Vec<Table> {
        let column = |pairs: &[(String, String)], second: bool| -> Vec<String> {
            pairs.iter().map(|p| if second { p.1.clone() } else { p.0.clone() }).collect()
        };
        let stages: (Vec<String>, Vec<f64>) = self.stages.iter().cloned().unzip();
        let mut tables = vec![
            Table::scalar("/provenance/job", "-", "The resolved job, JSON, defaults filled in.", self.job.as_str()),
            Table::list("/provenance/command", "-", "The command line, argument by argument.", self.command.clone()),
            Table::list(
                "/provenance/version_names",
                "-",
                "The program and its libraries.",
                column(&self.versions, false),
            ),
            Table::list("/provenance/versions", "-", "Version of each of version_names.", column(&self.versions, true)),
            Table::scalar("/provenance/ranks", "1", "Number of MPI ranks.", self.ranks as i64),
            Table::list(
                "/provenance/input_files",
                "-",
                "Input files, as the job names them.",
                column(&self.inputs, false),
            ),
            Table::list("/provenance/input_sha256", "-", "SHA-256 of each of input_files.", column(&self.inputs, true)),
            Table::list(
                "/provenance/stage_names",
                "-",
                "Stages of the run, in the order of their beginnings.",
                stages.0,
            ),
            Table::list("/provenance/stage_times", "s", "Wall time of all that each of stage_names took.", stages.1),
            Table::scalar("/provenance/date", "-", "Start of the run, UTC, ISO 8601.", self.date.as_str()),
        ];
        if !self.warnings.is_empty() {
            let text = "Reasons to doubt the results.";
            tables.push(Table::list("/provenance/warnings", "-", text, self.warnings.clone()));
        }
        if !self.summary.is_empty() {
            let text = "Lines of the summary below the verdict.";
            tables.push(Table::list("/provenance/summary", "-", text, self.summary.clone()));
        }
        if !self.damping.is_empty() {
            let text = "Damping of each body with modes, in words.";
            tables.push(Table::list("/provenance/damping", "-", text, self.damping.clone()));
        }
        if self.parts.len() > 1 {
            let text = |name: &str, text: &str, of: &dyn Fn(&RunOrigin) -> String| {
                Table::list(
                    &format!("/provenance/parts/{name}"),
                    "-",
                    text,
                    self.parts.iter().map(of).collect::<Vec<_>>(),
                )
            };
            let steps: Vec<i64> = self.parts.iter().map(|p| p.step as i64).collect();
            tables.extend([
                text("job", "The resolved job of each part of a run that was continued, JSON.", &|p| p.job.to_string()),
                text("date", "Start of the steps of each part, UTC, ISO 8601.", &|p| p.date.clone()),
                text("program", "Program and version of each part.", &|p| p.program.clone()),
                Table::list("/provenance/parts/step", "1", "Steps done before each part.", steps),
            ]);
        }
        tables
    }
}

/// SHA-256 of a file, hexadecimal.
pub fn sha256(path: &Path) -> Result<String> {
    let fail = |e: std::io::Error| Error::Input(format!("cannot read {}: {e}", path.display()));
    let mut file = crate::input::open(path).map_err(fail)?;
    let mut hash = Sha256::new();
    std::io::copy(&mut file, &mut hash).map_err(fail)?;
    Ok(hexadecimal(&hash.finalize()))
}

/// Bytes in hexadecimal figures.
pub(super) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// Date and time now, UTC, as `2026-01-31T23:59:59Z`.
pub fn utc_now() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map(|d| d.as_secs()).unwrap_or(0);
    iso_8601(seconds)
}

/// Civil date of a time since 1970, after H. Hinnant, "chrono-compatible low-level date algorithms" (civil_from_days).
fn iso_8601(seconds: u64) -> String {
    let z = (seconds / 86400) as i64 + 719_468;
    let era = z.div_euclid(146_097);
    let day_of_era = z.rem_euclid(146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    let s = seconds % 86400;
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", s / 3600, s / 60 % 60, s % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_civil() {
        assert_eq!(iso_8601(0), "1970-01-01T00:00:00Z");
        assert_eq!(iso_8601(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(iso_8601(1_709_251_199), "2024-02-29T23:59:59Z");
        assert_eq!(iso_8601(4_107_542_400), "2100-03-01T00:00:00Z");
    }

    #[test]
    fn checksum_of_a_known_text() {
        let file = tempfile::NamedTempFile::new().expect("temporary file");
        std::fs::write(file.path(), "abc").expect("write");
        let sum = sha256(file.path()).expect("checksum");
        assert_eq!(sum, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        assert_eq!(sha256(Path::new("/no/such/file")).map_err(|e| e.exit_code()), Err(3));
    }
}
