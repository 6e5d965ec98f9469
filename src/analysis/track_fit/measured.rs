//! Measured decay rates of a track from a table, in third octaves.

use crate::input::table::NumberTable;
use crate::sound::Bands;
use crate::{Error, Result};
use std::path::Path;

/// Third octaves of EN 15461, Hz.
const RANGE: [f64; 2] = [100.0, 5000.0];
/// Part by which a frequency may be off the nominal or the exact centre of its band.
const OFF: f64 = 0.01;
/// Columns of a table.
const FREQUENCY: &str = "frequency";
const DIRECTIONS: [&str; 2] = ["vertical", "lateral"];
const EXPECTED: &str = "expected the columns frequency, vertical and lateral, in Hz and dB/m, named in the first row";

/// Measured decay rates.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredDecay {
    /// The file.
    pub name: String,
    /// Nominal centres of the bands, Hz, ascending, `[b]`.
    pub nominal: Vec<f64>,
    /// Their exact centres, Hz, `[b]`.
    pub centre: Vec<f64>,
    /// `vertical`, `lateral` or both, with rates, dB/m, `[b]`.
    pub directions: Vec<(&'static str, Vec<f64>)>,
    /// Bands of the file that are not looked at, Hz.
    pub left_out: Vec<f64>,
}

impl MeasuredDecay {
    /// Reads the bands of the file at `path` that lie in one of the ranges `within`, Hz; all of them without any.
    ///
    /// # Errors
    /// A file that is no table; other columns, units or frequencies; rates that are not above 0; bands missing between
    /// others of a range; no bands.
    pub fn read(path: &Path, within: &[[f64; 2]]) -> Result<Self> {
        Self::of_table(&NumberTable::read(path)?, within)
    }

    fn of_table(table: &NumberTable, within: &[[f64; 2]]) -> Result<Self> {
        let [frequency, vertical, lateral] = columns(table)?;
        let directions: Vec<(&'static str, usize)> =
            DIRECTIONS.into_iter().zip([vertical, lateral]).filter_map(|(name, at)| Some((name, at?))).collect();
        let Some(frequency) = frequency.filter(|_| !directions.is_empty()) else {
            let names = [(FREQUENCY, frequency), (DIRECTIONS[0], vertical), (DIRECTIONS[1], lateral)];
            let found: Vec<&str> = names.into_iter().filter_map(|(name, at)| at.map(|_| name)).collect();
            let found = found.join(", ");
            return Err(Error::Input(format!("{}: found the columns {found} alone, {EXPECTED}", table.name())));
        };
        let bands = Bands::spanning(RANGE[0], RANGE[1]);
        let (nominal, centres) = (bands.nominal(), bands.centres());
        let mut read = Self {
            name: table.name().to_owned(),
            nominal: Vec::new(),
            centre: Vec::new(),
            directions: directions.iter().map(|(name, _)| (*name, Vec::new())).collect(),
            left_out: Vec::new(),
        };
        let inside = |f: f64| within.is_empty() || within.iter().any(|[low, high]| (*low..=*high).contains(&f));
        let (mut last, mut before): (f64, Option<usize>) = (0.0, None);
        for i in 0..table.rows() {
            let f = table.row(i)[frequency];
            if !(f > last) {
                let expected = "the bands in the order of their frequencies, each once, in Hz";
                return Err(table.fault(i, format!("{f} Hz after {last} Hz"), expected));
            }
            last = f;
            for (name, at) in &directions {
                let rate = table.row(i)[*at];
                if !(rate > 0.0) {
                    let expected = "one above 0; leave out the band, or the column, that was not measured";
                    return Err(table.fault(i, format!("a decay rate of {rate} dB/m ({name})"), expected));
                }
            }
            let Some(band) = band(f, i, table)? else {
                read.left_out.push(f);
                continue;
            };
            if !inside(nominal[band]) {
                read.left_out.push(f);
                before = None;
                continue;
            }
            // A band that no range asks for may lack.
            if let Some(missing) = before.map(|b| b + 1).filter(|b| *b < band && inside(nominal[*b])) {
                let found = format!("{f} Hz after {} Hz", nominal[missing - 1]);
                let (low, high) = (nominal[missing - 1], nominal[band]);
                let expected = format!(
                    "the third octave of {} Hz between them; add it, or name the bands that there are, such as --band \
                     {},{low} --band {high},{}",
                    nominal[missing],
                    read.nominal.first().copied().unwrap_or(low),
                    RANGE[1]
                );
                return Err(table.fault(i, found, expected));
            }
            before = Some(band);
            read.nominal.push(nominal[band]);
            read.centre.push(centres[band]);
            for ((_, rates), (_, at)) in read.directions.iter_mut().zip(&directions) {
                rates.push(table.row(i)[*at]);
            }
        }
        if read.nominal.is_empty() {
            let (first, last) = (table.row(0)[frequency], last);
            return Err(Error::Input(format!(
                "{}: found no third octave from {} to {} Hz that is asked for, the table reaches from {first} to \
                 {last} Hz; expected frequencies in Hz, or another --band",
                read.name, RANGE[0], RANGE[1]
            )));
        }
        Ok(read)
    }
}

/// Columns of frequency, vertical and lateral rates.
fn columns(table: &NumberTable) -> Result<[Option<usize>; 3]> {
    let names = [FREQUENCY, DIRECTIONS[0], DIRECTIONS[1]];
    let fault = |found: String| Error::Input(format!("{}: found {found}, {EXPECTED}", table.name()));
    let headings = table.headings(&names).ok_or_else(|| {
        fault("no names of columns, so that nothing says which direction the rates are of".to_owned())
    })?;
    let mut columns = [None; 3];
    for (at, heading) in headings.iter().enumerate() {
        let Some(k) = names.iter().position(|name| *name == heading.name) else {
            return Err(fault(format!("the column \"{}\"", heading.title)));
        };
        let unit = if k == 0 { "hz" } else { "db/m" };
        if let Some(other) = heading.unit.as_ref().filter(|other| *other != unit) {
            return Err(fault(format!("the column \"{}\" in {other}", heading.title)));
        }
        if columns[k].replace(at).is_some() {
            return Err(fault(format!("two columns {}", heading.name)));
        }
    }
    Ok(columns)
}

/// Number of the band of the frequency `f`, Hz, in row `i` among those of the standard; none beyond them.
fn band(f: f64, i: usize, table: &NumberTable) -> Result<Option<usize>> {
    let bands = Bands::spanning(RANGE[0], RANGE[1]);
    let near = |a: f64| (f / a - 1.0).abs() <= OFF;
    let found =
        bands.nominal().iter().zip(bands.centres()).position(|(nominal, centre)| near(*nominal) || near(centre));
    if found.is_some() || f < bands.lowest() || f > bands.highest() {
        return Ok(found);
    }
    let around: Vec<String> = bands
        .nominal()
        .windows(2)
        .find(|w| f < w[1])
        .map_or_else(Vec::new, |w| w.iter().map(|nominal| nominal.to_string()).collect());
    Err(table.fault(i, format!("{f} Hz"), format!("centres of third octaves, here {} Hz", around.join(" or "))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, within: &[[f64; 2]]) -> Result<MeasuredDecay> {
        MeasuredDecay::of_table(&NumberTable::parse("rates.csv", text)?, within)
    }

    #[test]
    fn bands_and_directions_are_read() {
        let text = "frequency [Hz];lateral (dB/m);vertical\n80;1,0;2\n500;1,1;2,5\n630;1,2;2\n794,33;1,3;1\n";
        let found = read(text, &[]).expect("rates");
        assert_eq!(found.nominal, [500.0, 630.0, 800.0]);
        assert!((found.centre[2] - 794.328).abs() < 1e-3);
        assert_eq!(found.directions, [("vertical", vec![2.5, 2.0, 1.0]), ("lateral", vec![1.1, 1.2, 1.3])]);
        assert_eq!(found.left_out, [80.0]);
        // A gap is one only within what is asked for.
        let gap = "frequency,vertical\n100,1\n125,2\n200,3\n250,4\n315,4\n";
        assert_eq!(read(gap, &[[100.0, 130.0], [190.0, 260.0]]).expect("rates").nominal, [100.0, 125.0, 200.0, 250.0]);
    }

    #[test]
    fn other_tables_are_refused() {
        for (text, parts) in [
            ("250;2.1\n315;2.5\n", &["rates.csv: found no names of columns", "direction"][..]),
            ("frequency;vertical;axial\n250;2.1;1\n315;2.5;1\n", &["the column \"axial\"", "vertical and lateral"]),
            ("frequency;vertical [1/m]\n250;2.1\n315;2.5\n", &["\"vertical [1/m]\" in 1/m", "dB/m"]),
            ("frequency [kHz];vertical\n0.25;2.1\n0.315;2.5\n", &["in khz", "in Hz"]),
            ("vertical;lateral\n250;2.1\n315;2.5\n", &["found the columns vertical, lateral alone"]),
            ("frequency;vertical;vertical\n250;2.1;1\n", &["two columns vertical"]),
            ("frequency;vertical\n315;2.1\n250;2.5\n", &["line 3", "250 Hz after 315 Hz", "order"]),
            ("frequency;vertical\n250;2.1\n315;-0.3\n", &["line 3", "a decay rate of -0.3 dB/m (vertical)"]),
            ("frequency;vertical\n250;2.1\n270;1\n315;2\n", &["line 3", "found 270 Hz", "250 or 315 Hz"]),
            (
                "frequency;vertical\n250;2.1\n400;1\n",
                &["line 3", "third octave of 315 Hz", "--band 250,250 --band 400,5000"],
            ),
            ("frequency;vertical\n0.25;2.1\n0.315;1\n", &["no third octave", "from 0.25 to 0.315", "in Hz"]),
        ] {
            let error = read(text, &[]).expect_err(text);
            assert_eq!(error.exit_code(), 3, "{error}");
            for part in parts {
                assert!(error.message().contains(part), "no {part:?} in: {error}");
            }
        }
    }
}
