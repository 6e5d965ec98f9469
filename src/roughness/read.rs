//! Measured roughness from text files: a line in two columns, or an area in a table.

use super::Line;
use crate::{Error, Result};
use std::path::Path;

/// Fewest samples.
const MIN_SAMPLES: usize = 16;
/// Heights above the mean, m, and distances of samples, m, between which a file is taken to be in the unit that it is said to be.
const HEIGHTS: [f64; 2] = [1e-9, 2e-3];
const DISTANCES: [f64; 2] = [1e-6, 2e-2];
/// What a straight line leaves of heights by rounding, m.
const FLAT: f64 = 1e-14;
/// Widest area, m.
const WIDTH: f64 = 0.2;

/// What was measured, its mean and the straight line through it taken away.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Way, m, ascending, `[n]`.
    pub at: Vec<f64>,
    /// Lateral places, m, ascending, `[ny]`; of a line none.
    pub y: Vec<f64>,
    /// Heights, m, `[n][ny]`, of a line `[n][1]`.
    pub height: Vec<Vec<f64>>,
}

/// Units of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Of heights, m.
    pub height: f64,
    /// Of distances, along and across, m.
    pub distance: f64,
}

/// Reads the file at `path`.
///
/// # Errors
/// The file cannot be read, a row is not one of numbers or has another length, places do not ascend, there are too few, or what they say cannot be in the `units`.
pub fn read(path: &Path, units: Units) -> Result<Measured> {
    let name = path.display().to_string();
    let bytes = crate::input::read(path).map_err(|e| Error::Input(format!("{name}: {e}")))?;
    let text = String::from_utf8(bytes).map_err(|_| {
        Error::Input(format!("{name}: expected text, found bytes that are none; export the heights as text"))
    })?;
    parse(&name, &text, units)
}

/// The same of a text; `name` is for messages. Numbers are separated by blanks, tabs, commas or semicolons; lines that begin with #, !, % or // are comments, and one
/// line of headings may stand above. Two columns are way and height. With more the first row holds a number that is not used and the lateral places, each other row its way
/// and the heights.
pub fn parse(name: &str, text: &str, units: Units) -> Result<Measured> {
    let rows = rows(name, text)?;
    let width = rows.first().map_or(0, |r| r.1.len());
    let area = width > 2;
    let y: Vec<f64> = if area { rows[0].1[1..].iter().map(|v| v * units.distance).collect() } else { Vec::new() };
    let rows = &rows[usize::from(area)..];
    let fault = |line: usize, found: String, expected: &str| {
        Err(Error::Input(format!("{name}, line {line}: found {found}, expected {expected}")))
    };
    if let Some(w) = y.windows(2).find(|w| !(w[1] > w[0])) {
        return fault(
            1,
            format!("the lateral place {} m after {} m", w[1], w[0]),
            "places that ascend, in the first row of numbers",
        );
    }
    if let Some(w) = rows.windows(2).find(|w| !(w[1].1[0] > w[0].1[0])) {
        return fault(
            w[1].0,
            format!("{} after {}", w[1].1[0], w[0].1[0]),
            "a way that ascends; sort the samples, and leave out those given twice",
        );
    }
    if rows.len() < MIN_SAMPLES {
        return Err(Error::Input(format!("{name}: found {} samples, expected at least {MIN_SAMPLES}", rows.len())));
    }
    let at: Vec<f64> = rows.iter().map(|r| r.1[0] * units.distance).collect();
    let mut height: Vec<Vec<f64>> = rows.iter().map(|r| r.1[1..].iter().map(|v| v * units.height).collect()).collect();
    level(&at, &mut height);
    let measured = Measured { at, y, height };
    measured.refuse_units(name, units)?;
    Ok(measured)
}

/// The rows of numbers with their lines, all of the same length.
fn rows(name: &str, text: &str) -> Result<Vec<(usize, Vec<f64>)>> {
    let mut rows: Vec<(usize, Vec<f64>)> = Vec::new();
    let mut headings = false;
    for (k, line) in text.lines().enumerate() {
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() || line.starts_with(['#', '!', '%']) || line.starts_with("//") {
            continue;
        }
        let words = line.split(|c: char| c.is_whitespace() || c == ',' || c == ';').filter(|w| !w.is_empty());
        let numbers: Option<Vec<f64>> = words.map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        let columns = rows.first().map_or(0, |r| r.1.len());
        let expected = match numbers {
            Some(numbers) if numbers.len() >= 2 && (rows.is_empty() || numbers.len() == columns) => {
                rows.push((k + 1, numbers));
                continue;
            }
            None if rows.is_empty() && !headings => {
                headings = true;
                continue;
            }
            _ if rows.is_empty() => "two numbers, way and height, or a row of lateral places".to_string(),
            _ => format!("{columns} numbers, as in the rows above"),
        };
        let short: String = line.chars().take(60).collect();
        return Err(Error::Input(format!(
            "{name}, line {}: found \"{short}\", expected {expected}; comments begin with #, !, % or //",
            k + 1
        )));
    }
    Ok(rows)
}

/// Takes the straight line away that is nearest to the mean across, in the sense of least squares.
fn level(at: &[f64], height: &mut [Vec<f64>]) {
    let n = at.len() as f64;
    let mean: Vec<f64> = height.iter().map(|row| row.iter().sum::<f64>() / row.len() as f64).collect();
    let (s0, r0) = (at.iter().sum::<f64>() / n, mean.iter().sum::<f64>() / n);
    let spread: f64 = at.iter().map(|s| (s - s0).powi(2)).sum();
    let slope = at.iter().zip(&mean).map(|(s, r)| (s - s0) * (r - r0)).sum::<f64>() / spread;
    for (row, s) in height.iter_mut().zip(at) {
        row.iter_mut().for_each(|r| *r -= r0 + slope * (s - s0));
    }
}

impl Measured {
    /// The way that is covered, m.
    pub fn length(&self) -> f64 {
        self.at[self.at.len() - 1] - self.at[0]
    }

    /// Refuses what looks like another unit.
    fn refuse_units(&self, name: &str, units: Units) -> Result<()> {
        let step = self.length() / (self.at.len() - 1) as f64;
        let high = self.height.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let wide = self.y.last().zip(self.y.first()).map_or(0.0, |(b, a)| b - a);
        let advice = |key: &str, now: f64| {
            let say = match now {
                1e-6 => "1e-3 for millimetres, 1 for metres",
                1.0 => "1e-3 for millimetres, 1e-2 for centimetres",
                _ => "1 for metres, 1e-3 for millimetres, 1e-6 for micrometres",
            };
            format!("the file is read with {key} {now:e} m; give another ({say})")
        };
        let fault = |text: String| Err(Error::Input(format!("{name}: {text}")));
        if high <= FLAT {
            return fault("found a straight line, expected roughness".into());
        }
        if !(HEIGHTS[0]..=HEIGHTS[1]).contains(&high) {
            return fault(format!(
                "found heights up to {high:.1e} m, expected {:.0e} to {:.0e} m: {}",
                HEIGHTS[0],
                HEIGHTS[1],
                advice("unit", units.height)
            ));
        }
        if !(DISTANCES[0]..=DISTANCES[1]).contains(&step) || wide > WIDTH {
            let (what, found) = if wide > WIDTH { ("a width of", wide) } else { ("samples every", step) };
            return fault(format!(
                "found {what} {found:.1e} m, expected samples every {:.0e} to {:.0e} m and at most {WIDTH} m across: {}",
                DISTANCES[0],
                DISTANCES[1],
                advice("distance_unit", units.distance)
            ));
        }
        Ok(())
    }

    /// Lines at the lateral places `y` (m) of a contact, which repeat themselves after `period` (m) if there is one, else begin at `from` (m): one for all of a line, one for each
    /// of an area. Between the columns of an area the heights are a spline, beyond the outermost those of these.
    pub fn lines(&self, y: &[f64], period: Option<f64>, from: f64) -> Result<Vec<Line>> {
        let across = |row: &Vec<f64>| -> Result<Vec<f64>> {
            if self.y.len() < 2 {
                return Ok(vec![row[0]]);
            }
            let line = Line::through(self.y.clone(), row.clone())?;
            Ok(y.iter().map(|&v| line.at(v)).collect())
        };
        let rows = self.height.iter().map(across).collect::<Result<Vec<_>>>()?;
        (0..rows[0].len())
            .map(|j| {
                let height: Vec<f64> = rows.iter().map(|row| row[j]).collect();
                match period {
                    Some(period) => Line::repeating(&self.at, &height, period),
                    None => Ok(Line::through(self.at.clone(), height)?.moved(from - self.at[0])),
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MICRO: Units = Units { height: 1e-6, distance: 1.0 };

    fn text(n: usize, row: impl Fn(f64) -> String) -> String {
        (0..n).map(|i| row(1e-3 * i as f64) + "\n").collect()
    }

    #[test]
    fn a_line_is_levelled_and_begins_where_it_is_told() {
        let wavy = text(400, |s| format!("{s}; {}", 5.0 + 80.0 * s + 3.0 * (500.0 * s).sin()));
        let found = parse("f", &format!("# measured\nway height\n{wavy}"), MICRO).unwrap();
        assert!(found.y.is_empty() && (found.length() - 0.399).abs() < 1e-12);
        let lines = found.lines(&[-1e-3, 1e-3], None, -0.01).unwrap();
        assert_eq!(lines.len(), 1);
        let ends = lines[0].ends().unwrap();
        assert!((ends[0] + 0.01).abs() < 1e-15 && (ends[1] - 0.389).abs() < 1e-12, "{ends:?}");
        // Of the wave the line takes away some per cent, as it is not a whole number of them.
        let s = 0.2005;
        assert!((lines[0].at(s - 0.01) - 3e-6 * (500.0 * s).sin()).abs() < 2e-7);
    }

    #[test]
    fn an_area_is_a_line_at_each_lateral_place() {
        let body = text(64, |s| {
            let r = |y: f64| 2.0 * (600.0 * s).sin() * (1.0 + 200.0 * y);
            format!("{} {} {} {}", 1e3 * s, r(-0.01), r(0.0), r(0.01))
        });
        let found = parse("f", &format!("0 -10 0 10\n{body}"), Units { height: 1e-6, distance: 1e-3 }).unwrap();
        assert_eq!(found.y, [-0.01, 0.0, 0.01]);
        let lines = found.lines(&[-0.02, -0.005, 0.0075], None, 0.0).unwrap();
        // At a sample. The line that was taken away is the same across, so that it is not in differences.
        let s: f64 = 0.031;
        let raw = 2e-6 * (600.0 * s).sin();
        let at: Vec<f64> = lines.iter().map(|line| line.at(s)).collect();
        // Straight across, and level beyond the columns.
        for (got, want) in [(at[0] - at[1], -raw), (at[2] - at[1], 2.5 * raw)] {
            assert!((got - want).abs() < 1e-12, "{got:e}, expected {want:e}");
        }
    }

    #[test]
    fn bad_files_are_refused_with_their_line_and_what_to_do() {
        let good = |s: f64| format!("{s} {}", (300.0 * s).sin());
        let nano = |s: f64| format!("{s} {}", 1e-4 * (300.0 * s).sin());
        for (text, want) in [
            (text(8, good), "found 8 samples, expected at least 16"),
            (text(20, good) + "0.005 1\n", "line 21: found 0.005 after 0.019"),
            (text(20, good) + "0.03 1 2\n", "line 21: found \"0.03 1 2\", expected 2 numbers"),
            (text(20, good) + "0.03 high\n", "line 21"),
            (text(20, |s| format!("{s} NaN")), "expected two numbers"),
            (
                text(20, |s| format!("{s} {}", 4e4 * (300.0 * s).sin())),
                "unit 1e-6 m; give another (1e-3 for millimetres",
            ),
            (text(20, nano), "expected 1e-9 to 2e-3 m"),
            (
                text(20, |s| format!("{} {}", 1e3 * s, (300.0 * s).sin())),
                "distance_unit 1e0 m; give another (1e-3 for millimetres",
            ),
            (text(20, |s| format!("{s} 3")), "found a straight line"),
            (format!("0 1 -1\n{}", text(20, |s| format!("{s} 1 2"))), "line 1: found the lateral place -1 m after 1 m"),
            (String::new(), "found 0 samples"),
        ] {
            let error = parse("f.txt", &text, MICRO).unwrap_err();
            assert!(error.message().contains(want) && error.message().starts_with("f.txt"), "{error}: expected {want}");
        }
        assert!(read(Path::new("/nowhere/f.txt"), MICRO).unwrap_err().message().contains("/nowhere/f.txt"));
    }
}
