//! Measured roughness from text files: a line in two columns, or an area in a table.

use super::RoughnessLine;
use crate::input::table::{Column, ColumnPair, NumberTable};
use crate::{Error, Result};
use std::path::Path;

/// Fewest samples.
const MIN_SAMPLES: usize = 16;
/// Heights above the mean, m, and distances of samples, m, between which a file is taken to be in the unit that it is
/// said to be.
const HEIGHTS: [f64; 2] = [1e-9, 2e-3];
const DISTANCES: [f64; 2] = [1e-6, 2e-2];
/// Residual of a straight line in heights by rounding, m.
const FLAT: f64 = 1e-14;
/// Distance of two samples over the usual one: samples are missing, which is said; and too many, which is refused.
const MISSING: [f64; 2] = [1.6, 5.0];
/// Widest area, m.
const WIDTH: f64 = 0.2;

/// Measured heights, without their mean and the straight line through them.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Way, m, ascending, `[n]`.
    pub at: Vec<f64>,
    /// Lateral places, m, ascending, `[ny]`; of a line none.
    pub y: Vec<f64>,
    /// Heights, m, `[n][ny]`, of a line `[n][1]`.
    pub height: Vec<Vec<f64>>,
    /// The file as it was read, in one line.
    pub understood: String,
}

/// Units of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Unit of heights, m.
    pub height: f64,
    /// Unit of distances, along and across, m.
    pub distance: f64,
}

/// Headings of a line.
const COLUMNS: ColumnPair = ColumnPair {
    names: &[[&["way", "s", "x", "distance", "position"], &["height", "r", "z", "roughness"]]],
    expected: "the way and the height in two columns, under the headings way and height if there are any, or an area: \
               a first row of lateral places behind a word such as way, further rows of the way and the heights",
    refuse_counting: false,
};

/// Reads the file at `path`.
///
/// # Errors
/// The file cannot be read; a row is not one of numbers or has another length; headings are others, or name another
/// unit; places do not ascend; samples are missing; there are too few; what they say cannot be in the `units`.
pub fn read(path: &Path, units: Units) -> Result<Measured> {
    let table = NumberTable::read(path)?;
    of_table(&table, units)
}

/// Reads a text of which `Table` makes rows; `name` is for messages. Two columns are way and height. With more the
/// first row holds a word, or a number that is not used, and the lateral places; each other row its way and the
/// heights.
pub fn parse(name: &str, text: &str, units: Units) -> Result<Measured> {
    of_table(&NumberTable::parse(name, text)?, units)
}

/// Way, lateral places and heights of a table, in the unit of the file, and what is first.
struct Samples {
    /// The first row of samples.
    first: usize,
    /// Columns of the way and of the heights.
    way: usize,
    heights: Vec<usize>,
    y: Vec<f64>,
    described: String,
}

impl Samples {
    fn of(table: &NumberTable, units: Units) -> Result<Self> {
        let places = table.heading_numbers().filter(|_| table.width() > 2);
        let area = places.is_some() || (table.width() > 2 && !table.has_headings());
        let line = match area {
            true => table.pair(&COLUMNS).ok().filter(|_| places.is_none()),
            false => Some(table.pair(&COLUMNS)?),
        };
        if let Some(pair) = line {
            refuse_other_units(table.name(), &pair, units)?;
            let described = table.described(&pair);
            return Ok(Self { first: 0, way: pair[0].at, heights: vec![pair[1].at], y: Vec::new(), described });
        }
        let heights = (1..table.width()).collect();
        let (first, line, y) = match places {
            Some((line, y)) => (0, line, y),
            None => {
                refuse_sample_as_places(table)?;
                (1, table.line(0), table.row(0)[1..].to_vec())
            }
        };
        if let Some(w) = y.windows(2).find(|w| !(w[1] > w[0])) {
            return Err(Error::Input(format!(
                "{}, line {line}: found the lateral place {} after {}, expected places that ascend, in the first row \
                 of an area; a line has two columns, way and height",
                table.name(),
                w[1],
                w[0]
            )));
        }
        let described = format!("an area of {} lateral places", y.len());
        let y = y.into_iter().map(|v| v * units.distance).collect();
        Ok(Self { first, way: 0, heights, y, described })
    }
}

/// Refuses headings that name another unit than the job.
fn refuse_other_units(name: &str, pair: &[Column; 2], units: Units) -> Result<()> {
    let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
    for (column, key, value) in [(&pair[0], "distance_unit", units.distance), (&pair[1], "unit", units.height)] {
        if let Some(own) = column.unit.filter(|own| !same(*own, value)) {
            return Err(Error::Input(format!(
                "{name}: found a heading with the unit {own:e} m beside {key} {value:e} m; expected one unit: give \
                 {key} {own:e}"
            )));
        }
    }
    Ok(())
}

/// Refuses a first row that may be a sample as well as the lateral places of an area: its first number goes on in the
/// others as the way does.
fn refuse_sample_as_places(table: &NumberTable) -> Result<()> {
    if table.rows() < 3 {
        return Ok(());
    }
    let way = |i: usize| table.row(i)[0];
    let (before, step) = (way(1) - way(0), way(2) - way(1));
    if (before - step).abs() > 0.5 * step.abs() {
        return Ok(());
    }
    let hint = if table.counts(0) { ", or a numbering of the rows" } else { "" };
    Err(table.fault(
        0,
        format!("{} columns without headings, whose first row may be a sample{hint}", table.width()),
        "two columns, way and height; of an area the word way in the first place of the row of lateral places",
    ))
}

fn of_table(table: &NumberTable, units: Units) -> Result<Measured> {
    let name = table.name();
    let samples = Samples::of(table, units)?;
    let rows: Vec<usize> = (samples.first..table.rows()).collect();
    let way = |i: usize| table.row(i)[samples.way];
    if let Some(w) = rows.windows(2).find(|w| !(way(w[1]) > way(w[0]))) {
        return Err(table.fault(
            w[1],
            format!("{} after {}", way(w[1]), way(w[0])),
            "a way that ascends; sort the samples, and leave out those given twice",
        ));
    }
    if rows.len() < MIN_SAMPLES {
        return Err(Error::Input(format!("{name}: found {} samples, expected at least {MIN_SAMPLES}", rows.len())));
    }
    let at: Vec<f64> = rows.iter().map(|&i| way(i) * units.distance).collect();
    let heights = |i: &usize| samples.heights.iter().map(|&c| table.row(*i)[c] * units.height).collect();
    let mut height: Vec<Vec<f64>> = rows.iter().map(heights).collect();
    if at.iter().chain(height.iter().flatten()).any(|v| !(v.abs() < 1e150)) {
        return Err(Error::Input(format!("{name}: found numbers beyond 1e150, expected lengths")));
    }
    level(&at, &mut height);
    let mut measured = Measured { at, y: samples.y, height, understood: String::new() };
    measured.refuse_units(name, units)?;
    let spacing = measured.spacing(table, &rows)?;
    let y = match (measured.y.first(), measured.y.last()) {
        (Some(a), Some(b)) => format!(" from y = {:.2} to {:.2} mm", 1e3 * a, 1e3 * b),
        _ => String::new(),
    };
    let high = measured.height.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    measured.understood = format!(
        "{name}: read {} samples, {}{y}, {}; way in {}, heights in {}; {:.4} m long, {spacing}; heights within {:.2} \
         µm of their straight line",
        rows.len(),
        samples.described,
        table.layout(),
        unit_name(units.distance),
        unit_name(units.height),
        measured.length(),
        1e6 * high
    );
    Ok(measured)
}

/// A unit in words.
fn unit_name(unit: f64) -> String {
    let names = [(1.0, "m"), (1e-3, "mm"), (1e-6, "µm")];
    names.iter().find(|n| n.0 == unit).map_or_else(|| format!("{unit:e} m"), |n| n.1.to_owned())
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

    /// The spacing of the samples in words, those that are missing included; refuses gaps.
    fn spacing(&self, table: &NumberTable, rows: &[usize]) -> Result<String> {
        let steps: Vec<f64> = self.at.windows(2).map(|w| w[1] - w[0]).collect();
        let mut sorted = steps.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted[sorted.len() / 2];
        let mm = |v: f64| 1e3 * v;
        if let Some(k) = steps.iter().position(|s| *s > DISTANCES[1].min(MISSING[1] * usual)) {
            return Err(table.fault(
                rows[k + 1],
                format!(
                    "a gap of {:.3} mm in the way, from {:.4} to {:.4} m, where samples are {:.3} mm apart",
                    mm(steps[k]),
                    self.at[k],
                    self.at[k + 1],
                    mm(usual)
                ),
                format!(
                    "samples at most {:.3} mm apart: measure again, fill the gap, or give the part of the file on one \
                     side of it",
                    mm(DISTANCES[1].min(MISSING[1] * usual))
                ),
            ));
        }
        let wide: Vec<f64> = steps.into_iter().filter(|s| *s > MISSING[0] * usual).collect();
        let largest = sorted[sorted.len() - 1];
        Ok(match wide.len() {
            0 => format!("samples every {:.4} mm", mm(usual)),
            n => format!("samples every {:.4} mm but for {n} gaps of up to {:.4} mm", mm(usual), mm(largest)),
        })
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
                "found {what} {found:.1e} m, expected samples every {:.0e} to {:.0e} m and at most {WIDTH} m \
                 across: {}",
                DISTANCES[0],
                DISTANCES[1],
                advice("distance_unit", units.distance)
            ));
        }
        Ok(())
    }

    /// Lines at the lateral places `y` (m) of a contact, which repeat themselves after `period` (m) if there is one,
    /// else begin at `from` (m): one for all of a line, one for each of an area. Between the columns of an area the
    /// heights are a spline, beyond the outermost those of these.
    pub fn lines(&self, y: &[f64], period: Option<f64>, from: f64) -> Result<Vec<RoughnessLine>> {
        let across = |row: &Vec<f64>| -> Result<Vec<f64>> {
            if self.y.len() < 2 {
                return Ok(vec![row[0]]);
            }
            let line = RoughnessLine::through(self.y.clone(), row.clone())?;
            Ok(y.iter().map(|&v| line.height(v)).collect())
        };
        let rows = self.height.iter().map(across).collect::<Result<Vec<_>>>()?;
        (0..rows[0].len())
            .map(|j| {
                let height: Vec<f64> = rows.iter().map(|row| row[j]).collect();
                match period {
                    Some(period) => RoughnessLine::repeating(&self.at, &height, period),
                    None => Ok(RoughnessLine::through(self.at.clone(), height)?.moved(from - self.at[0])),
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
        assert!((lines[0].height(s - 0.01) - 3e-6 * (500.0 * s).sin()).abs() < 2e-7);
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
        let at: Vec<f64> = lines.iter().map(|line| line.height(s)).collect();
        // Straight across, and level beyond the columns.
        for (got, want) in [(at[0] - at[1], -raw), (at[2] - at[1], 2.5 * raw)] {
            assert!((got - want).abs() < 1e-12, "{got:e}, expected {want:e}");
        }
    }

    /// An index, headings in another order, and rows that may be samples as well as places.
    #[test]
    fn columns_are_followed_or_refused() {
        let plain = parse("f", &text(40, |s| format!("{s};{}", (300.0 * s).sin())), MICRO).unwrap();
        let same = |text: &str| {
            let found = parse("f", text, MICRO).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!((&found.at, &found.height), (&plain.at, &plain.height), "{text}");
            found.understood
        };
        let row = |s: f64| (s, (300.0 * s).sin());
        let said = same(&format!("height [µm],way [m]\n{}", text(40, |s| format!("{1},{0}", row(s).0, row(s).1))));
        assert!(said.contains("\"way [m]\" and \"height [µm]\"") && said.contains("samples every 1.0000 mm"), "{said}");
        let indexed = text(40, |s| format!("{:.0},{},{}", 1e3 * s, row(s).0, row(s).1));
        assert!(same(&format!("i,way,height\n{indexed}")).contains("without the numbering \"i\""));
        same(&text(40, |s| format!("{};{}", row(s).0, row(s).1).replace('.', ",")));
        for (file, want) in [
            (indexed, "may be a sample, or a numbering of the rows"),
            (text(40, |s| format!("{s} 1 {}", 2.0 + s)), "may be a sample"),
            (format!("way height left\n{}", text(40, |s| format!("{s} 1 2"))), "\"way\", \"height\", \"left\""),
            (format!("way (mm) height\n{}", text(40, |s| format!("{s} {s}"))), "give distance_unit 1e-3"),
        ] {
            let error = parse("f.txt", &file, MICRO).unwrap_err();
            assert!(error.message().contains(want), "{error}: expected {want}");
        }
        let area = text(40, |s| format!("{s} {0} {0} {0}", row(s).1));
        let found = parse("f", &format!("way -0.01 0 0.01\n{area}"), MICRO).unwrap();
        assert_eq!(found.y, [-0.01, 0.0, 0.01]);
        assert!(found.understood.contains("an area of 3 lateral places from y = -10.00 to 10.00 mm"));
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
            (format!("0 1 -1\n{}", text(20, |s| format!("{s} 1 2"))), "line 1: found the lateral place -1 after 1,"),
            (String::new(), "found 0 rows of numbers"),
        ] {
            let error = parse("f.txt", &text, MICRO).unwrap_err();
            assert!(error.message().contains(want) && error.message().starts_with("f.txt"), "{error}: expected {want}");
        }
        // A drop-out of 8 mm between samples of 1 mm is refused, one of 3 mm is said.
        let without = |gone: std::ops::Range<usize>| -> String {
            let kept = (0..100).filter(|i| !gone.contains(i)).map(|i| 1e-3 * i as f64);
            kept.map(|s| good(s) + "\n").collect()
        };
        let error = parse("f.txt", &without(40..48), MICRO).unwrap_err();
        assert!(error.message().contains("line 41: found a gap of 9.000 mm"), "{error}");
        let found = parse("f.txt", &without(40..43), MICRO).unwrap();
        assert!(found.understood.contains("every 1.0000 mm but for 1 gaps of up to 4.0000 mm"), "{}", found.understood);
        assert!(read(Path::new("/nowhere/f.txt"), MICRO).unwrap_err().message().contains("/nowhere/f.txt"));
    }
}
