//! The formats of profile files: two columns of text, Miniprof, SIMPACK.

use crate::input::table::{ColumnPair, NumberTable};
use crate::input::text;
use crate::{Error, Result};

/// A point of a file: its line, y and z in the unit of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ProfileFilePoint {
    pub line: usize,
    pub y: f64,
    pub z: f64,
}

/// Contents of a file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RawProfile {
    /// Points in the order of the file.
    pub points: Vec<ProfileFilePoint>,
    /// Length unit in m, where the file itself says it.
    pub unit: Option<f64>,
    /// True if the file names that unit column by column, so that no other can be meant.
    pub stated: bool,
    /// True if the format has z down.
    pub down: bool,
    /// Format, columns, separator and decimal sign in words.
    pub source: String,
    /// Remarks on points that were left out or changed.
    pub notes: Vec<String>,
}

/// A format, chosen by the end of the file's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ProfileFormat {
    Text,
    Miniprof,
    Simpack,
}

impl ProfileFormat {
    /// The format of a file of this name.
    pub fn from_name(name: &str) -> Self {
        let end = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        match end.as_str() {
            "whl" | "ban" => ProfileFormat::Miniprof,
            "prw" | "prr" => ProfileFormat::Simpack,
            _ => ProfileFormat::Text,
        }
    }

    /// Reads the text of a file; `name` is for messages.
    pub fn parse(self, name: &str, text: &str) -> Result<RawProfile> {
        match self {
            ProfileFormat::Text => columns(name, text),
            ProfileFormat::Miniprof => miniprof(name, text),
            ProfileFormat::Simpack => simpack(name, text),
        }
    }
}

fn bad_line(name: &str, line: usize, found: &str, expected: &str) -> Error {
    Error::Input(format!("{name}, line {line}: found \"{}\", expected {expected}", text::excerpt(found)))
}

/// Columns of a profile, whose names are those of the axes across and down: y and z, in files of Miniprof x and y.
const COLUMNS: ColumnPair = ColumnPair {
    names: &[[&["y"], &["z"]], [&["x"], &["y"]], [&["x"], &["z"]]],
    expected:
        "two columns, y across and z up or down, under the headings y and z (or x and y, x and z) if there are any",
    refuse_counting: true,
};

/// Points of a table with the columns y and z at `place`.
fn points_of(table: &NumberTable, place: [usize; 2]) -> Vec<ProfileFilePoint> {
    let point =
        |i: usize| ProfileFilePoint { line: table.line(i), y: table.row(i)[place[0]], z: table.row(i)[place[1]] };
    (0..table.rows()).map(point).collect()
}

/// A table of text with y and z in two columns, by its headings if it has any.
fn columns(name: &str, text: &str) -> Result<RawProfile> {
    let table = NumberTable::parse(name, text)?;
    let pair = table.pair(&COLUMNS)?;
    let unit = match pair.each_ref().map(|c| c.unit) {
        [Some(y), Some(z)] if y != z => {
            return Err(Error::Input(format!(
                "{name}: found headings with the units {y} m for y and {z} m for z, expected one unit"
            )));
        }
        [y, z] => y.or(z),
    };
    Ok(RawProfile {
        points: points_of(&table, [pair[0].at, pair[1].at]),
        unit,
        stated: unit.is_some(),
        down: false,
        source: format!("{}, {}", table.described(&pair), table.layout()),
        notes: Vec::new(),
    })
}

/// Columns of Miniprof without a `ColumnDef`.
const MINIPROF: [&str; 5] = ["X", "Y", "A", "C", "N"];

/// Miniprof (Greenwood Engineering): a header of `key=value` lines, or an old one with MINI…PROF in its first lines
/// that a blank line ends; then the points, in mm. `ColumnDef` names the columns; a double quote begins a comment.
fn miniprof(name: &str, text: &str) -> Result<RawProfile> {
    let mut rows = Vec::new();
    let old = text::lines(text).take(3).any(|(_, l)| l.contains("MINIPROF") || l.contains("MINIWHEELPROF"));
    let mut body = !old;
    let mut names: Vec<String> = MINIPROF.map(str::to_owned).to_vec();
    for (k, full) in text::lines(text) {
        let line = full.split('"').next().unwrap_or_default().trim();
        if line.is_empty() {
            // A comment is no blank line that ends the header.
            body |= full.trim().is_empty();
            continue;
        }
        if line.starts_with("[FileInfo]") {
            return Err(bad_line(
                name,
                k,
                line,
                "one profile; files of several sections (.mpt) are not supported: export the section as .whl or .ban",
            ));
        }
        if let Some((key, value)) = line.split_once('=') {
            if key.trim().eq_ignore_ascii_case("ColumnDef") {
                names = value.split(',').map(|n| n.trim().to_uppercase()).collect();
                if !["X", "Y"].iter().all(|c| names.iter().any(|n| n == c)) {
                    return Err(bad_line(name, k, line, "columns X and Y, as in ColumnDef=X,Y,A,C"));
                }
            }
            continue;
        }
        if !body {
            continue;
        }
        if !line.starts_with(|c: char| c.is_ascii_digit() || "+-.,\u{2212}".contains(c)) {
            return Err(bad_line(name, k, line, "the numbers of a point"));
        }
        rows.push((k, line));
    }
    if rows.is_empty() {
        return Err(Error::Input(format!(
            "{name}: found no points, expected them after the header (an old one, with MINIPROF, ends with a \
             blank line); name a file of two \
             plain columns otherwise than .whl or .ban"
        )));
    }
    let table = NumberTable::of_lines(name, rows.into_iter())?;
    let find = |c: &str| names.iter().position(|n| n == c).unwrap_or(usize::MAX);
    let place = ["X", "Y"].map(find);
    if table.width() > names.len() || place.iter().any(|&p| p >= table.width()) {
        let found = format!("{} numbers", table.width());
        return Err(table.fault(0, found, format!("the columns {} (ColumnDef)", names.join(","))));
    }
    Ok(RawProfile {
        points: points_of(&table, place),
        unit: Some(1e-3),
        stated: false,
        down: false,
        source: format!("Miniprof, columns X and Y of {}, {}", names[..table.width()].join(","), table.layout()),
        notes: Vec::new(),
    })
}

/// Keys of a SIMPACK file that change its points, with the values they have when they are not given.
#[derive(Debug)]
struct Changes {
    distance: f64,
    shift: [f64; 2],
    rotate: f64,
    bound_y: [f64; 2],
    bound_z: [f64; 2],
    mirror: [f64; 2],
    inversion: f64,
    length: f64,
    angle: f64,
    smooth: f64,
}

impl Changes {
    fn field(&mut self, key: &str) -> Option<&mut f64> {
        Some(match key {
            "point.dist.min" => &mut self.distance,
            "shift.y" => &mut self.shift[0],
            "shift.z" => &mut self.shift[1],
            "rotate" => &mut self.rotate,
            "bound.y.min" => &mut self.bound_y[0],
            "bound.y.max" => &mut self.bound_y[1],
            "bound.z.min" => &mut self.bound_z[0],
            "bound.z.max" => &mut self.bound_z[1],
            "mirror.y" => &mut self.mirror[0],
            "mirror.z" => &mut self.mirror[1],
            "inversion" => &mut self.inversion,
            "units.len.f" => &mut self.length,
            "units.ang.f" => &mut self.angle,
            "approx.smooth" => &mut self.smooth,
            _ => return None,
        })
    }
}

/// SIMPACK .prw and .prr: sections `header`, `spline` and in it `point`, between `.begin` and `.end`; keys change the
/// points in the order of their numbers in the file's own comments: thinned, shifted, turned, cut, mirrored,
/// inverted, scaled. An exclamation mark begins a comment.
fn simpack(name: &str, text: &str) -> Result<RawProfile> {
    let mut changes = Changes {
        distance: 0.0,
        shift: [0.0; 2],
        rotate: 0.0,
        bound_y: [1.0, 0.0],
        bound_z: [1.0, 0.0],
        mirror: [0.0; 2],
        inversion: 0.0,
        length: 1.0,
        angle: 1.0,
        smooth: 0.0,
    };
    let mut rows = Vec::new();
    let mut inside = false;
    for (k, full) in text::lines(text) {
        let line = full.split('!').next().unwrap_or_default().trim();
        let word = line.to_ascii_lowercase();
        if line.is_empty() {
            continue;
        }
        if word.ends_with(".begin") || word.ends_with(".end") {
            inside = word == "point.begin";
            continue;
        }
        if inside {
            if !line.starts_with(|c: char| c.is_ascii_digit() || "+-.,\u{2212}".contains(c)) {
                return Err(bad_line(name, k, full, "the two numbers of a point, y and z"));
            }
            rows.push((k, line));
            continue;
        }
        let Some((key, value)) = line.split_once('=') else {
            return Err(bad_line(name, k, full, "key = value, or a section's begin or end"));
        };
        if let Some(field) = changes.field(key.trim()) {
            let value = value.trim();
            let number = value.parse::<f64>().ok().filter(|v| v.is_finite());
            *field = number.ok_or_else(|| bad_line(name, k, full, &format!("a number for {}", key.trim())))?;
        }
    }
    if rows.is_empty() {
        return Err(Error::Input(format!("{name}: found no points, expected them between point.begin and point.end")));
    }
    let table = NumberTable::of_lines(name, rows.into_iter())?;
    let source = match table.width() {
        2 => format!("SIMPACK, {}", table.layout()),
        3 => format!("SIMPACK, columns 1 and 2 of 3 (weights are not used), {}", table.layout()),
        n => {
            return Err(table.fault(0, format!("{n} numbers"), "those of a point: y, z, and a weight if there is one"))
        }
    };
    apply(name, points_of(&table, [0, 1]), &changes, source)
}

fn apply(name: &str, mut points: Vec<ProfileFilePoint>, c: &Changes, source: String) -> Result<RawProfile> {
    if !(c.length > 0.0 && c.angle > 0.0) {
        return Err(Error::Input(format!(
            "{name}: found the unit factors {} for lengths and {} for angles, expected numbers above zero (1000 \
             for mm)",
            c.length, c.angle
        )));
    }
    let mut notes = Vec::new();
    if c.distance > 0.0 {
        points = points.into_iter().fold(Vec::new(), |mut kept: Vec<ProfileFilePoint>, p| {
            if kept.last().is_none_or(|last| (p.y - last.y).abs() > c.distance) {
                kept.push(p);
            }
            kept
        });
    }
    let (s, k) = (c.rotate / c.angle).sin_cos();
    for p in &mut points {
        let (y, z) = (p.y + c.shift[0], p.z + c.shift[1]);
        (p.y, p.z) = (k * y - s * z, s * y + k * z);
    }
    if c.bound_y[0] < c.bound_y[1] {
        points.retain(|p| (c.bound_y[0]..=c.bound_y[1]).contains(&p.y));
    }
    if c.bound_z[0] < c.bound_z[1] {
        points.retain(|p| (c.bound_z[0]..=c.bound_z[1]).contains(&p.z));
    }
    for p in &mut points {
        p.y *= if c.mirror[0] == 1.0 { -1.0 } else { 1.0 };
        p.z *= if c.mirror[1] == 1.0 { -1.0 } else { 1.0 };
    }
    if c.inversion == 1.0 {
        points.reverse();
    }
    if c.smooth != 0.0 {
        notes.push(format!(
            "{name}: approx.smooth = {} was not used; the profile has a smoothing length of its own",
            c.smooth
        ));
    }
    Ok(RawProfile { points, unit: Some(1.0 / c.length), stated: false, down: true, source, notes })
}
