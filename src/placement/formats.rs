//! The formats of profile files: two columns of text, Miniprof, SIMPACK.

use crate::{Error, Result};

/// A point of a file: its line, y and z in the unit of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    pub line: usize,
    pub y: f64,
    pub z: f64,
}

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Raw {
    /// Points in the order of the file.
    pub points: Vec<Point>,
    /// Length unit in m, where the file itself says it.
    pub unit: Option<f64>,
    /// What was left out or done to the points.
    pub notes: Vec<String>,
}

/// A format, chosen by the end of the file's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Text,
    Miniprof,
    Simpack,
}

impl Format {
    /// The format of a file of this name.
    pub fn of(name: &str) -> Self {
        let end = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        match end.as_str() {
            "whl" | "ban" => Format::Miniprof,
            "prw" | "prr" => Format::Simpack,
            _ => Format::Text,
        }
    }

    /// Reads the text of a file; `name` is for messages.
    pub fn parse(self, name: &str, text: &str) -> Result<Raw> {
        match self {
            Format::Text => columns(name, text),
            Format::Miniprof => miniprof(name, text),
            Format::Simpack => simpack(name, text),
        }
    }
}

/// Numbers of a line, separated by blanks, tabs, commas or semicolons, up to the first word that is none.
fn numbers(line: &str) -> Vec<f64> {
    let words = line.split(|c: char| c.is_whitespace() || c == ',' || c == ';').filter(|w| !w.is_empty());
    words.map_while(|w| w.parse().ok()).collect()
}

fn bad_line(name: &str, line: usize, found: &str, expected: &str) -> Error {
    let short: String = found.trim().chars().take(60).collect();
    Error::Input(format!("{name}, line {line}: found \"{short}\", expected {expected}"))
}

/// Two columns, y and z; further ones are ignored. Lines that begin with #, !, % or // are comments, and one line of headings may stand above
/// the numbers.
fn columns(name: &str, text: &str) -> Result<Raw> {
    let mut points = Vec::new();
    let mut headings = false;
    for (k, line) in text.lines().enumerate() {
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() || line.starts_with(['#', '!', '%']) || line.starts_with("//") {
            continue;
        }
        match numbers(line)[..] {
            [y, z, ..] => points.push(Point { line: k + 1, y, z }),
            _ if points.is_empty() && !headings => headings = true,
            _ => return Err(bad_line(name, k + 1, line, "two numbers, y and z; comments begin with #, !, % or //")),
        }
    }
    Ok(Raw { points, unit: None, notes: Vec::new() })
}

/// Miniprof (Greenwood Engineering): a header of `key=value` lines, or an old one with MINI…PROF in its first lines that a blank line ends; then
/// the points, in mm. `ColumnDef` names the columns; a double quote begins a comment.
fn miniprof(name: &str, text: &str) -> Result<Raw> {
    let mut points = Vec::new();
    let old = text.lines().take(3).any(|l| l.contains("MINIPROF") || l.contains("MINIWHEELPROF"));
    let (mut body, mut place) = (!old, [0, 1]);
    for (k, full) in text.lines().enumerate() {
        let line = full.split('"').next().unwrap_or_default().trim();
        if line.is_empty() {
            // A comment is no blank line that ends the header.
            body |= full.trim().is_empty();
            continue;
        }
        if line.starts_with("[FileInfo]") {
            return Err(bad_line(
                name,
                k + 1,
                line,
                "one profile; files of several sections (.mpt) are not supported: export the section as .whl or .ban",
            ));
        }
        if let Some((key, value)) = line.split_once('=') {
            if key.trim().eq_ignore_ascii_case("ColumnDef") {
                let names: Vec<&str> = value.split(',').map(str::trim).collect();
                let find = |c: &str| names.iter().position(|n| n.eq_ignore_ascii_case(c));
                place = match (find("X"), find("Y")) {
                    (Some(x), Some(y)) => [x, y],
                    _ => return Err(bad_line(name, k + 1, line, "columns X and Y, as in ColumnDef=X,Y,A,C")),
                };
            }
            continue;
        }
        if !body {
            continue;
        }
        let row = numbers(line);
        match (row.get(place[0]), row.get(place[1])) {
            (Some(&y), Some(&z)) => points.push(Point { line: k + 1, y, z }),
            _ => return Err(bad_line(name, k + 1, line, "the numbers of a point")),
        }
    }
    if points.is_empty() {
        return Err(Error::Input(format!(
            "{name}: found no points, expected them after the header (an old one, with MINIPROF, ends with a blank line); name a file of two \
             plain columns otherwise than .whl or .ban"
        )));
    }
    Ok(Raw { points, unit: Some(1e-3), notes: Vec::new() })
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

/// SIMPACK .prw and .prr: sections `header`, `spline` and in it `point`, between `.begin` and `.end`; keys change the points in the order of
/// their numbers in the file's own comments: thinned, shifted, turned, cut, mirrored, inverted, scaled. An exclamation mark begins a comment.
fn simpack(name: &str, text: &str) -> Result<Raw> {
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
    let mut points = Vec::new();
    let mut inside = false;
    for (k, full) in text.lines().enumerate() {
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
            match numbers(line)[..] {
                [y, z, ..] => points.push(Point { line: k + 1, y, z }),
                _ => return Err(bad_line(name, k + 1, full, "the two numbers of a point, y and z")),
            }
            continue;
        }
        let Some((key, value)) = line.split_once('=') else {
            return Err(bad_line(name, k + 1, full, "key = value, or a section's begin or end"));
        };
        if let Some(field) = changes.field(key.trim()) {
            let value = value.trim();
            let number = value.parse::<f64>().ok().filter(|v| v.is_finite());
            *field = number.ok_or_else(|| bad_line(name, k + 1, full, &format!("a number for {}", key.trim())))?;
        }
    }
    if points.is_empty() {
        return Err(Error::Input(format!("{name}: found no points, expected them between point.begin and point.end")));
    }
    apply(name, points, &changes)
}

fn apply(name: &str, mut points: Vec<Point>, c: &Changes) -> Result<Raw> {
    if !(c.length > 0.0 && c.angle > 0.0) {
        return Err(Error::Input(format!(
            "{name}: found the unit factors {} for lengths and {} for angles, expected numbers above zero (1000 for mm)",
            c.length, c.angle
        )));
    }
    let mut notes = Vec::new();
    if c.distance > 0.0 {
        points = points.into_iter().fold(Vec::new(), |mut kept: Vec<Point>, p| {
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
    Ok(Raw { points, unit: Some(1.0 / c.length), notes })
}
