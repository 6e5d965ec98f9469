//! Tables of every layout, right and harmed ones, beside a second reader that is told the layout.

use super::*;
use std::fmt::Write;

const PLAIN: ColumnPair = ColumnPair {
    names: &[[&["y"], &["z"]], [&["x"], &["y"]]],
    expected: "two columns, y and z",
    refuse_counting: true,
};

fn values(text: &str) -> Result<Vec<[f64; 2]>> {
    let table = NumberTable::parse("t.csv", text)?;
    let pair = table.pair(&PLAIN)?;
    Ok((0..table.rows()).map(|i| [table.row(i)[pair[0].at], table.row(i)[pair[1].at]]).collect())
}

fn says(text: &str) -> String {
    let error = NumberTable::parse("t.csv", text).and_then(|t| t.pair(&PLAIN)).expect_err(text);
    assert!(error.exit_code() == 3 && error.message().starts_with("t.csv"), "{error}");
    error.message().to_owned()
}

#[test]
fn every_spelling_of_the_same_numbers_is_the_same_table() {
    let expected = [[-39.5, 1.575], [-39.0, 1e-3], [0.5, -200.0]];
    for text in [
        "-39.5 1.575\n-39 1e-3\n.5 -200\n",
        "-39.5\t1.575\n-39.\t+1.0D-3\n0.5\t-2.0d+02\n",
        "-39,5;1,575\n-39,0;0,001\n,5;-200\n",
        "-39,5 1,575\n-39,0 0,001\n0,5 -200,0\n",
        "-39.5, 1.575,\n-39.0, 0.001,\n0.5, -200.0,\n",
        "\"-39,5\",\"1,575\"\n\"-39,0\",\"0,001\"\n\"0,5\",\"-200,0\"\n",
        "\u{feff}# made by hand\r\n\r\ny;z\r\n-39.5;1.575;;\r\n;;;\r\n-39.0;0.001 ! second\r\n0.5;-200 // third\r\n",
        "% matlab\r-39.5 1.575\r-39.0 0.001\r0.5 -200.0",
        "sep=;\ni;z [mm];y [mm]\n[];mm;mm\n".replace("[];mm;mm\n", "").as_str(),
        "\u{2212}39.5\u{a0}1.575\n\u{2212}39.0\u{a0}0.001\n0.5\u{a0}\u{2212}200\n",
        "z,y\nmm,mm\n1.575,-39.5\n0.001,-39.0\n-200.0,0.5\n",
        ",y,z\n0,-39.5,1.575\n1,-39.0,0.001\n2,0.5,-200\n",
        "# z y\n1.575 -39.5\n0.001 -39.0\n-200.0 0.5\n",
        "y (mm) z (mm)\n-39.5 1.575\n-39.0 0.001\n0.5 -200.0\n",
    ] {
        let text = match text.starts_with("sep=") {
            true => format!("{text}1;1,575;-39,5\n2;0,001;-39,0\n3;-200;0,5\n"),
            false => text.to_owned(),
        };
        assert_eq!(values(&text).unwrap_or_else(|e| panic!("{e} in {text:?}")), expected, "{text:?}");
    }
}

#[test]
fn what_is_not_certain_is_refused_with_its_line() {
    let rows = "1.5 2.5\n2.5 3.5\n3.5 4.5\n";
    for (text, words) in [
        (String::new(), vec!["0 rows"]),
        ("# only\n;;\n".into(), vec!["0 rows"]),
        ("y z\n".into(), vec!["line 1", "expected two numbers"]),
        ("one two\nthree four\n".into(), vec!["line 2", "three four", "expected two numbers"]),
        ("-39,1\n-38,2\n-37,3\n".into(), vec!["line 1", "decimal commas or separators"]),
        ("-39,000,1,575\n-38,000,1,400\n-37,000,1,300\n".into(), vec!["decimal commas or separators"]),
        (format!("{rows}5.5 NaN\n"), vec!["line 4", "NaN", "finite numbers"]),
        (format!("{rows}5.5 1e999\n"), vec!["line 4", "1e999"]),
        (format!("{rows}5.5 1e5.0\n"), vec!["line 4", "1e5.0"]),
        (format!("{rows}5,5 2,5\n"), vec!["line 4", "decimal point"]),
        (format!("{rows}5.5\n"), vec!["line 4", "5.5", "2 numbers, as in line 1", "blanks"]),
        (format!("{rows}5.5 2.5 1\n"), vec!["line 4", "2 numbers"]),
        (format!("{rows}5.5 2.5 % here\n"), vec!["line 4"]),
        (format!("a title of it\n{rows}"), vec!["line 1", "4 headings", "begin with #"]),
        (format!("y z\nsecond line\n{rows}"), vec!["line 2", "second"]),
        (format!("y w\n{rows}"), vec!["line 1", "\"y\", \"w\"", "y and z"]),
        (format!("y y\n{rows}"), vec!["two columns \"y\""]),
        (format!("y (ft) z (ft)\n{rows}"), vec!["y (ft)", "unit"]),
        ("1.5 2.5 3.5\n2.5 3.5 4.5\n".into(), vec!["3 columns without headings", "leave out all others"]),
        ("0 1.5\n1 2.5\n2 3.5\n".into(), vec!["counts the rows"]),
        ("1.5;;2.5\n1.5;1;2.5\n".into(), vec!["line 1"]),
        ("i,y,z\n1,2.5,3.5\n1,2.5,3.5\n4,4.5,5.5\n".into(), vec!["\"i\", \"y\", \"z\""]),
        ("x y z\n1.5 2.5 3.5\n2.5 3.5 4.5\n".into(), vec!["\"x\", \"y\", \"z\""]),
        ("\"\"\n1 2\n".into(), vec!["line"]),
        ("1.5\x1b[31m 2\n".into(), vec!["\\u{1b}"]),
    ] {
        let said = says(&text);
        for word in words {
            assert!(said.contains(word), "{word:?} not in {said:?} for {text:?}");
        }
        assert!(!said.contains(|c: char| c.is_control()), "{said:?}");
    }
}

#[test]
fn headings_name_units_and_places() {
    let units = |heading: &str| {
        let table = NumberTable::parse("t", &format!("{heading}\n1.5;2.5\n2.5;3.5\n")).unwrap();
        table.pair(&PLAIN).map(|pair| pair.map(|c| c.unit)).unwrap()
    };
    for heading in
        ["y (mm);z (mm)", "y [mm];z [mm]", "Y/mm;Z/mm", "y_mm;z_mm", "y in mm;z in mm", "y mm;z mm", "y;z\nmm;mm"]
    {
        assert_eq!(units(heading), [Some(1e-3); 2], "{heading}");
    }
    assert_eq!(units("y [µm];z [in]"), [Some(1e-6), Some(0.0254)]);
    assert_eq!(units("y;z"), [None; 2]);
    let area = NumberTable::parse("t", "way;-10;0;10\n0,0;1;2;3\n0,5;1;2;3\n").unwrap();
    assert_eq!(area.heading_numbers(), Some((1, vec![-10.0, 0.0, 10.0])));
    let table = NumberTable::parse("t", ",y,z\n0,1.5,2.5\n1,2.5,3.5\n2,3.5,4.5\n").unwrap();
    let pair = table.pair(&PLAIN).unwrap();
    assert_eq!(
        format!("{}, {}", table.described(&pair), table.layout()),
        "columns \"y\" and \"z\", without the numbering 1, separated by commas, decimal point"
    );
}

/// Numbers below n, the same in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as usize % n
    }

    fn one_of<'a>(&mut self, all: &[&'a str]) -> &'a str {
        all[self.below(all.len())]
    }

    /// A number with some digits behind the decimal sign, and its value.
    fn number(&mut self, decimal: char) -> (String, f64) {
        let sign = self.one_of(&["", "-", "+"]);
        let (digits, exponent) = (self.below(5), self.below(8));
        let mut text = format!("{sign}{}", self.below(2000));
        if digits > 0 {
            text.push('.');
            (0..digits).for_each(|_| text.push(char::from(b'0' + self.below(10) as u8)));
        }
        let power =
            if exponent == 0 { format!("{}{}", self.one_of(&["", "-", "+"]), self.below(4)) } else { String::new() };
        let value = if power.is_empty() { text.parse() } else { format!("{text}e{power}").parse() }.unwrap();
        if !power.is_empty() {
            text.push_str(self.one_of(&["e", "E", "d", "D"]));
            text.push_str(&power);
        }
        (text.replace('.', &decimal.to_string()), value)
    }
}

/// A table as a device or a spreadsheet may write it.
struct Written {
    text: String,
    separator: &'static str,
    decimal: char,
    values: Vec<[f64; 2]>,
    headed: bool,
}

fn written(dice: &mut Dice) -> Written {
    let (separator, decimal) =
        [(";", '.'), (";", ','), ("\t", '.'), ("\t", ','), (" ", '.'), ("  ", ','), (",", '.'), (", ", '.')]
            [dice.below(8)];
    let end = dice.one_of(&["\n", "\r\n", "\r"]);
    let (headed, index, swapped) = (dice.below(2) == 0, dice.below(4) == 0, dice.below(3) == 0);
    let (index, swapped) = (headed && index, headed && swapped);
    let trailing = if separator.trim().is_empty() || dice.below(4) > 0 { "" } else { separator.trim() };
    let mut text = dice.one_of(&["", "\u{feff}"]).to_owned();
    if dice.below(3) == 0 {
        text += &format!("{} measured on a day{end}", dice.one_of(&["#", "!", "%", "//"]));
    }
    let row = |cells: [&str; 3], text: &mut String, comment: &str| {
        let cells = if swapped { [cells[0], cells[2], cells[1]] } else { cells };
        let cells = if index { &cells[..] } else { &cells[1..] };
        write!(text, "{}{trailing}{comment}{end}", cells.join(separator)).unwrap();
    };
    if headed {
        let unit = dice.one_of(&["", " [mm]", "_mm"]);
        let unit = if separator.trim().is_empty() && unit.contains(' ') { "" } else { unit };
        row([dice.one_of(&["i", "no", "Index"]), &format!("y{unit}"), &format!("Z{unit}")], &mut text, "");
    }
    let mut values = Vec::new();
    for i in 0..3 + dice.below(8) {
        let (a, b) = (dice.number(decimal), dice.number(decimal));
        let comment = if dice.below(10) == 0 { dice.one_of(&[" # here", " ! here", " // here"]) } else { "" };
        row([&i.to_string(), &a.0, &b.0], &mut text, comment);
        if dice.below(12) == 0 {
            text += end;
        }
        values.push([a.1, b.1]);
    }
    Written { text, separator, decimal, values, headed }
}

/// The rules of the reader once more, for a text whose layout is known: its rows of two numbers, or `None` if it should
/// be refused.
fn told(text: &str, separator: &str, decimal: char) -> Option<Vec<[f64; 2]>> {
    let text = text.replace('\u{feff}', "").replace("\r\n", "\n").replace('\r', "\n");
    let mut rows: Vec<Vec<&str>> = Vec::new();
    let mut comment = "";
    for line in text.split('\n') {
        let cut = ["#", "!", "//"].iter().filter_map(|mark| line.find(mark)).min().unwrap_or(line.len());
        let (whole, line) = (line.trim(), line[..cut].trim());
        if rows.is_empty() && !whole.is_empty() && (line.is_empty() || line.starts_with('%')) {
            comment = whole.trim_start_matches(['#', '!', '%', '/']);
        }
        if line.is_empty() || line.starts_with('%') || line.chars().all(|c| ";, \t".contains(c)) {
            continue;
        }
        let mut cells: Vec<&str> = match separator.trim() {
            // Between tabs blanks are part of headings, never of numbers.
            "" if separator != "\t" || !rows.is_empty() => line.split_whitespace().collect(),
            mark => line.split(if mark.is_empty() { "\t" } else { mark }).map(str::trim).collect(),
        };
        while cells.last() == Some(&"") {
            cells.pop();
        }
        rows.push(cells);
    }
    let number = |cell: &str| -> Option<f64> {
        if cell.chars().any(|c| !"0123456789+-.,eEdD".contains(c))
            || cell.contains(if decimal == '.' { ',' } else { '.' })
        {
            return None;
        }
        if decimal == ',' && cell.ends_with(',') {
            return None;
        }
        cell.replace(decimal, ".").replace(['d', 'D'], "e").parse().ok().filter(|v: &f64| v.is_finite())
    };
    let width = rows.last()?.len();
    let unit = |rest: &str| ["", "m", "mm"].contains(&rest.trim_matches(['[', ']', '_', ' ', '\t']));
    let places = |names: Vec<&str>| {
        let names: Vec<String> = names.iter().map(|n| n.trim().to_lowercase()).collect();
        let find = |c: &str| names.iter().position(|n| n.strip_prefix(c).is_some_and(unit));
        let numbering = |n: &String| ["", "i", "no", "no.", "index", "n", "id"].contains(&n.as_str());
        let named = [["y", "z"], ["x", "y"]].iter().find_map(|pair| Some([find(pair[0])?, find(pair[1])?]))?;
        let others = names.iter().enumerate().filter(|(i, n)| !named.contains(i) && !numbering(n)).count();
        (names.len() == width && width <= 3 && others == 0).then_some(named)
    };
    let mut place = [0, 1];
    if rows[0].first().is_some_and(|cell| number(cell).is_none()) {
        let names = rows.remove(0);
        place = match names.as_slice() {
            [one] => places(one.split_whitespace().collect())?,
            _ => places(names)?,
        };
    } else {
        let words = match separator.trim() {
            "" => comment.split_whitespace().collect(),
            mark => comment.split(mark).collect(),
        };
        match places(words) {
            Some(found) => place = found,
            None if width != 2 => return None,
            None => {}
        }
    }
    rows.iter()
        .map(|row| {
            let numbers: Vec<f64> = row.iter().map(|c| number(c)).collect::<Option<_>>()?;
            (numbers.len() == width).then(|| place.map(|p| numbers[p]))
        })
        .collect()
}

/// Ten thousand tables: as they are written, they are read to the last bit; harmed, they are refused or read as the
/// second reader reads them.
#[test]
fn tables_are_read_to_the_last_bit_or_refused() {
    let mut dice = Dice(42);
    let (mut read, mut refused) = (0, 0);
    for round in 0..10_000 {
        let w = written(&mut dice);
        let digits = w.separator.starts_with(',') && !w.headed && !w.text.contains(['.', 'e', 'E', 'd', 'D']);
        match values(&w.text) {
            Ok(found) => assert_eq!(found, w.values, "round {round}: {:?}", w.text),
            // Whole numbers between commas are not certain.
            Err(e) => assert!(digits || e.message().contains("counts the rows"), "round {round}: {e} in {:?}", w.text),
        }
        assert_eq!(told(&w.text, w.separator, w.decimal).as_ref(), Some(&w.values), "{:?}", w.text);
        let mut chars: Vec<char> = w.text.chars().collect();
        for _ in 0..1 + dice.below(2) {
            let at = dice.below(chars.len());
            let c = *dice
                .one_of(&["0", "7", ".", ",", ";", "-", " ", "\t", "e", "D", "x", "\n", "#"])
                .as_bytes()
                .first()
                .unwrap();
            match dice.below(3) {
                0 => drop(chars.remove(at)),
                1 => chars.insert(at, char::from(c)),
                _ => chars[at] = char::from(c),
            }
        }
        let text: String = chars.into_iter().collect();
        match values(&text) {
            Ok(found) => {
                read += 1;
                assert_eq!(
                    Some(found),
                    told(&text, w.separator, w.decimal),
                    "round {round}: {text:?} was {:?}",
                    w.text
                );
            }
            Err(error) => {
                refused += 1;
                assert!(error.exit_code() == 3 && error.message().starts_with("t.csv"), "{error}");
            }
        }
    }
    assert!(read > 2000 && refused > 2000, "{read} read, {refused} refused");
}
