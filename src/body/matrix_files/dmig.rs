//! Matrices of Nastran in bulk data entries DMIG, as `EXTSEOUT(DMIGPCH)` and `PARAM,EXTOUT,DMIGPCH` punch them: small,
//! large and free field.
//!
//! A header entry `DMIG, NAME, 0, IFO, TIN, TOUT, POLAR, , NCOL`, then columns `DMIG, NAME, GJ, CJ, , G1, C1, A1, B1`
//! with the rest of the column on continuations. IFO 6: symmetric, each entry above or below the diagonal, not both;
//! IFO 1 and 2: all entries. Form 9, whose columns are not those of the rows, and complex matrices (TIN 3 and 4) are
//! refused. Other bulk data entries are passed over.

use super::dofs::Dof;
use super::entries::{Labels, Listing};
use super::numbers::{integer, real};
use super::{select, Fault, LabelledMatrix, Parsed};
use crate::input::text::{excerpt, lines};

/// A bulk data entry with its continuations: the fields behind its name, each with its line.
struct Card {
    line: usize,
    name: String,
    fields: Vec<(usize, String)>,
}

/// A matrix while its entries are read.
struct Matrix {
    name: String,
    /// The entries, or the reason why the matrix is not taken: others in the file may be.
    listing: Parsed<Listing>,
    labels: Labels,
}

pub(super) fn parse(text: &str, name: Option<&str>) -> Parsed<LabelledMatrix> {
    let mut matrices: Vec<Matrix> = Vec::new();
    for card in cards(text)? {
        match card.name.as_str() {
            "DMIG" => take(&card, &mut matrices)?,
            "INCLUDE" => {
                return Err(Fault::new(card.line, "found INCLUDE, expected the matrix in this file; put it in here"))
            }
            _ => {}
        }
    }
    let names: Vec<String> = matrices.iter().map(|m| m.name.clone()).collect();
    let chosen = select(&names, name)?;
    let Matrix { name, listing, labels } = matrices.swap_remove(chosen);
    let listing = listing?;
    if labels.entries.is_empty() {
        return Err(Fault::new(0, format!("found no columns of the matrix {name}; the file is truncated")));
    }
    labels.assemble(listing)
}

/// Splits the file into entries.
fn cards(text: &str) -> Parsed<Vec<Card>> {
    let mut cards: Vec<Card> = Vec::new();
    for (number, line) in lines(text) {
        // Remarks begin with $, wherever it stands.
        let line = line.split('$').next().unwrap_or("").trim_end();
        if line.trim().is_empty() {
            continue;
        }
        let (first, mut fields) = match line.contains(',') {
            true => free(number, line)?,
            false => fixed(number, line)?,
        };
        let continues = first.is_empty() || first.starts_with(['*', '+']);
        let kind = if continues { cards.last().map_or("", |c| c.name.as_str()) } else { &first };
        if kind.get(..4).is_some_and(|k| k.eq_ignore_ascii_case("DMIG")) {
            plain(number, line, &fields)?;
        }
        match (continues, cards.last_mut()) {
            (true, Some(card)) => card.fields.append(&mut fields),
            (true, None) => return Err(Fault::new(number, "found a continuation, expected an entry in front of it")),
            (false, _) => {
                let name = first.trim_end_matches('*').to_ascii_uppercase();
                cards.push(Card { line: number, name, fields });
            }
        }
    }
    Ok(cards)
}

/// Refuses a line of a matrix whose columns cannot be counted, or whose fields hold more than one word.
fn plain(number: usize, line: &str, fields: &[(usize, String)]) -> Parsed<()> {
    if !line.is_ascii() {
        return Err(Fault::new(number, format!("found \"{}\", expected plain ASCII", excerpt(line))));
    }
    if line.contains('\t') && !line.contains(',') {
        return Err(Fault::new(number, "found a tab, expected blanks: fields are counted in columns"));
    }
    match fields.iter().find(|f| f.1.contains(char::is_whitespace)) {
        Some((_, word)) => Err(Fault::new(
            number,
            format!("found \"{}\" in one field, expected one word; fields begin at column 9", excerpt(word)),
        )),
        None => Ok(()),
    }
}

/// First field, and the others with their line.
type Line = (String, Vec<(usize, String)>);

/// A line of free field, blank fields appended up to the end of its line of small or large field.
fn free(number: usize, line: &str) -> Parsed<Line> {
    let mut words = line.split(',').map(|w| w.trim().to_owned());
    let first = words.next().unwrap_or_default();
    let width = if first.contains('*') { 4 } else { 8 };
    let mut fields: Vec<(usize, String)> = words.map(|w| (number, w)).collect();
    // The tenth field names the continuation.
    if fields.len() == width + 1 && fields[width].1.starts_with(['+', '*'])
        || fields.get(width).is_some_and(|f| f.1.is_empty())
    {
        fields.truncate(width);
    }
    if fields.len() > width {
        let what = format!("found {} fields behind \"{}\", expected at most {width}", fields.len(), excerpt(&first));
        return Err(Fault::new(number, what));
    }
    fields.resize(width, (number, String::new()));
    Ok((first, fields))
}

/// A line of small field (8 fields of 8 columns) or large field (4 of 16), by the asterisk in its first field.
fn fixed(number: usize, line: &str) -> Parsed<Line> {
    let first = super::numbers::columns(line, 0, 8).trim().to_owned();
    let (count, width) = if first.contains('*') { (4, 16) } else { (8, 8) };
    let field = |k: usize| (number, super::numbers::columns(line, 8 + k * width, width).trim().to_owned());
    let fields: Vec<(usize, String)> = (0..count).map(field).collect();
    Ok((first, fields))
}

/// Takes a header or a column.
fn take(card: &Card, matrices: &mut Vec<Matrix>) -> Parsed<()> {
    let fault = |what: String| Fault::new(card.line, what);
    let field = |k: usize| card.fields.get(k).map_or("", |f| f.1.as_str());
    let name = field(0).to_ascii_uppercase();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return Err(fault(format!(
            "found the name \"{}\" of a DMIG, expected one that begins with a letter",
            excerpt(&name)
        )));
    }
    let known = matrices.iter().position(|m| m.name == name);
    if field(1) == "0" {
        if known.is_some() {
            return Err(fault(format!("found a second header of the matrix {name}, expected one")));
        }
        let listing = header(card, &name).map_err(fault);
        matrices.push(Matrix { name, listing, labels: Labels::default() });
        return Ok(());
    }
    let Some(matrix) = known.map(|k| &mut matrices[k]) else {
        return Err(fault(format!(
            "found a column of the matrix {name}, expected its header in front (DMIG, {name}, 0, …)"
        )));
    };
    if matrix.listing.is_err() {
        return Ok(());
    }
    let col = dof(field(1), field(2)).map_err(fault)?;
    for quadruple in card.fields.get(4..).unwrap_or_default().chunks(4) {
        let line = quadruple[0].0;
        let word = |k: usize| quadruple.get(k).map_or("", |f| f.1.as_str());
        if (0..4).all(|k| word(k).is_empty()) {
            continue;
        }
        let fault = |what: String| Fault::new(line, format!("{name}, column {col}: {what}"));
        let row = dof(word(0), word(1)).map_err(fault)?;
        let value = real(word(2)).map_err(fault)?;
        if !word(3).is_empty() && real(word(3)).map_err(fault)? != 0.0 {
            let what = format!("found the imaginary part {} in row {row}, expected a real matrix", word(3));
            return Err(fault(what));
        }
        matrix.labels.push(row, col, value, line);
    }
    Ok(())
}

/// The form of a header that is taken.
fn header(card: &Card, name: &str) -> Result<Listing, String> {
    let field = |k: usize| card.fields.get(k).map_or("", |f| f.1.as_str());
    match field(3) {
        "1" | "2" => {}
        other => {
            return Err(format!(
            "found TIN \"{}\" of the matrix {name}, expected 1 or 2, real; complex matrices (3 and 4) are not taken",
            excerpt(other)
        ))
        }
    }
    if !matches!(field(5), "" | "0") {
        return Err(format!("found POLAR \"{}\" of the matrix {name}, expected 0 or blank", excerpt(field(5))));
    }
    match field(2) {
        "6" => Ok(Listing::Once),
        "1" | "2" => Ok(Listing::All),
        other => Err(format!(
            "found IFO \"{}\" of the matrix {name}, expected 6 (symmetric), 1 or 2 (square); rectangular ones (9) are \
             not matrices of a body",
            excerpt(other)
        )),
    }
}

/// A point and its component; blank and 0 are those of a scalar point.
fn dof(point: &str, component: &str) -> Result<Dof, String> {
    if integer(point, "a point")? < 0 {
        return Err(format!("found the point {point}, expected one above 0"));
    }
    Dof::from_words(point, if component.is_empty() { "0" } else { component }, 0)
}
