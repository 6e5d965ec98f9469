//! From lines to a deck.

use super::deck::{Chunk, Deck, DeckElements, DeckPart, DeckSurface, Instance, Set};
use super::elements::{self, ElementType};
use super::keywords::{advice, fields, is_harmless, Keyword};
use super::lines::{DeckLines, Place};
use crate::{Error, Result};

/// Reads a deck.
pub fn deck(lines: &mut DeckLines) -> Result<Deck> {
    let mut deck = Deck::default();
    let mut inside = Scope::Assembly;
    let mut begun = 0;
    let mut in_step = false;
    let first = lines.next()?;
    if !first || !lines.text().starts_with('*') {
        let found = quote(if first { lines.text() } else { "nothing" });
        return Err(
            lines.wrong(format!("found {found}; expected a keyword (*…) of an input file of Abaqus or CalculiX"))
        );
    }
    loop {
        let at = lines.place();
        let keyword = Keyword::read(lines)?;
        if let (Some(fault), false) = (&keyword.fault, in_step) {
            return Err(fault.clone());
        }
        match keyword.name.as_str() {
            "STEP" => {
                in_step = true;
                leave_out(&mut deck, at, "STEP");
            }
            "ENDSTEP" => in_step = false,
            "INCLUDE" => include(lines, at, &keyword)?,
            _ if in_step => {}
            "PART" | "INSTANCE" | "ASSEMBLY" | "ENDASSEMBLY" if inside != Scope::Assembly => {
                return Err(lines.error(at, format!("*{} within {}", keyword.name, inside.open())));
            }
            "PART" => {
                let name = title(lines, at, &keyword, "NAME")?;
                if deck.parts.iter().any(|p| p.0 == name) {
                    return Err(lines.error(at, format!("a second part {}; expected different names", quote(&name))));
                }
                (inside, begun) = (Scope::Part(deck.parts.len()), at);
                deck.parts.push((name, DeckPart::default()));
            }
            "INSTANCE" => {
                instance(lines, at, &keyword, &mut deck)?;
                (inside, begun) = (Scope::Instance(deck.instances.len() - 1), at);
            }
            "ENDPART" if matches!(inside, Scope::Part(_)) => inside = Scope::Assembly,
            "ENDINSTANCE" if matches!(inside, Scope::Instance(_)) => inside = Scope::Assembly,
            "ENDPART" | "ENDINSTANCE" => {
                let name = keyword.name.trim_start_matches("END");
                return Err(lines.error(at, format!("*END {name} without *{name}")));
            }
            "ASSEMBLY" | "ENDASSEMBLY" => {}
            "NODE" => nodes(lines, at, &keyword, part(&mut deck, inside))?,
            "ELEMENT" => elements(lines, at, &keyword, &mut deck, inside)?,
            "NSET" | "ELSET" => {
                if keyword.has("INSTANCE") && inside != Scope::Assembly {
                    let text = "INSTANCE on a set within a part or an instance; expected it in the assembly";
                    return Err(lines.error(at, text));
                }
                set(lines, at, &keyword, part(&mut deck, inside))?
            }
            "SURFACE" => surface(lines, at, &keyword, part(&mut deck, inside))?,
            name if is_harmless(name) => leave_out(&mut deck, at, name),
            name => {
                return Err(lines.error(
                    at,
                    format!(
                        "the keyword *{} is not understood, and might change the body; expected nodes, solid elements, \
                         sets and surfaces. {}",
                        quote(name),
                        advice(name)
                    ),
                ))
            }
        }
        // Data of keywords that are left out.
        loop {
            if !lines.next()? {
                return match inside {
                    Scope::Assembly => Ok(deck),
                    _ => Err(lines.error(begun, format!("the file ends within {}", inside.open()))),
                };
            }
            if lines.text().starts_with('*') {
                break;
            }
        }
    }
}

/// The place in a deck to which nodes, elements and sets belong.
#[derive(Clone, Copy, PartialEq)]
enum Scope {
    /// Outside of parts and instances.
    Assembly,
    Part(usize),
    Instance(usize),
}

impl Scope {
    /// A part or an instance that is not closed.
    fn open(self) -> &'static str {
        match self {
            Scope::Instance(_) => "an instance; expected *END INSTANCE first",
            _ => "a part; expected *END PART first",
        }
    }
}

fn part(deck: &mut Deck, inside: Scope) -> &mut DeckPart {
    match inside {
        Scope::Part(i) => &mut deck.parts[i].1,
        Scope::Instance(i) => &mut deck.instances[i].own,
        Scope::Assembly => &mut deck.top,
    }
}

fn leave_out(deck: &mut Deck, at: Place, name: &str) {
    deck.remarks.keywords.entry(name.to_string()).or_insert((at, 0)).1 += 1;
}

/// A name that a keyword must have.
fn title(lines: &DeckLines, at: Place, keyword: &Keyword, key: &str) -> Result<String> {
    keyword
        .title(key)
        .filter(|n| !n.is_empty())
        .ok_or_else(|| lines.error(at, format!("*{} without {key}; expected {key}=… on its line", keyword.name)))
}

fn include(lines: &mut DeckLines, at: Place, keyword: &Keyword) -> Result<()> {
    let name = keyword.value("INPUT").unwrap_or_default().to_string();
    if name.is_empty() {
        return Err(lines.error(at, "*INCLUDE without INPUT; expected INPUT=file"));
    }
    lines.include(&name)
}

/// A translation and a rotation may stand behind the keyword.
fn instance(lines: &mut DeckLines, at: Place, keyword: &Keyword, deck: &mut Deck) -> Result<()> {
    let (name, of) = (title(lines, at, keyword, "NAME")?, title(lines, at, keyword, "PART")?);
    let Some(part) = deck.parts.iter().position(|p| p.0 == of) else {
        return Err(
            lines.error(at, format!("the instance {} is of the part {}, which is not there", quote(&name), quote(&of)))
        );
    };
    if deck.instances.iter().any(|i| i.name == name) {
        return Err(lines.error(at, format!("a second instance {}; expected different names", quote(&name))));
    }
    let mut shift = [0.0; 3];
    let mut turn = None;
    if lines.data()? {
        reals(lines, &mut shift)?;
        if lines.data()? {
            let mut values = [0.0; 7];
            reals(lines, &mut values)?;
            if (0..3).all(|i| values[i] == values[i + 3]) {
                return Err(lines.wrong(
                    "the two points of the axis of rotation are one; expected two different \
                 ones and an angle in degrees",
                ));
            }
            turn = Some(values);
        }
    }
    deck.instances.push(Instance { name, part, own: DeckPart::default(), shift, turn });
    Ok(())
}

fn nodes(lines: &mut DeckLines, at: Place, keyword: &Keyword, part: &mut DeckPart) -> Result<()> {
    if let Some(system) = keyword.value("SYSTEM").filter(|s| !s.eq_ignore_ascii_case("R")) {
        return Err(lines.error(at, format!("*NODE with SYSTEM={}; expected Cartesian coordinates", quote(system))));
    }
    if keyword.has("INPUT") {
        return Err(lines.error(at, "*NODE with INPUT is not understood; expected the nodes below it, or *INCLUDE"));
    }
    let mut named = Chunk::new(at, None);
    while lines.data()? {
        let text = lines.text();
        let mut fields = text.split(',');
        let id = whole(fields.next());
        let mut place = [Some(0.0); 3];
        place.iter_mut().zip(fields.by_ref()).for_each(|(to, from)| *to = real(from));
        let rest = fields.any(|f| !f.trim().is_empty() && real(f).is_none());
        let (Some(id), [Some(x), Some(y), Some(z)], false) = (id, place, rest) else {
            return Err(lines
                .wrong(format!("found {}; expected the number of a node and three coordinates", quote(lines.text()))));
        };
        part.nodes.push(u64::from(id));
        part.node_at.push(lines.place());
        part.coords.push([x, y, z]);
        named.push(id);
    }
    if let Some(name) = keyword.title("NSET") {
        part.node_sets.entry(name).or_default().chunks.push(named);
    }
    Ok(())
}

fn elements(lines: &mut DeckLines, at: Place, keyword: &Keyword, deck: &mut Deck, inside: Scope) -> Result<()> {
    let name = title(lines, at, keyword, "TYPE")?.to_uppercase();
    let kind = elements::element_type(&name).ok_or_else(|| {
        let what = format!(
            "elements of the type {}; expected {} (and CPS3, CPS4, CPS6, CPS8, SFM3D… or shells for surfaces). Take \
             others out of the file",
            quote(&name),
            elements::solids()
        );
        lines.error(at, what)
    })?;
    if keyword.has("INPUT") {
        return Err(
            lines.error(at, "*ELEMENT with INPUT is not understood; expected the elements below it, or *INCLUDE")
        );
    }
    let n = kind.nodes();
    let loose = matches!(kind, ElementType::Facet(_)) && elements::remark(&name).is_some();
    let mut block = DeckElements { kind, loose, ids: Vec::new(), at: Vec::new(), nodes: Vec::new() };
    let mut named = Chunk::new(at, None);
    // An element may take several lines.
    let mut element: Vec<u32> = Vec::with_capacity(n + 1);
    let mut begun = at;
    while lines.data()? {
        if element.is_empty() {
            begun = lines.place();
        }
        let text = lines.text();
        for field in text.strip_suffix(',').unwrap_or(text).split(',') {
            let Some(value) = whole(Some(field)).filter(|_| element.len() <= n) else {
                let found = quote(if element.len() <= n { field.trim() } else { text });
                return Err(
                    lines.wrong(format!("found {found}; expected the number of a {name} and those of its {n} nodes"))
                );
            };
            element.push(value);
        }
        if element.len() == n + 1 {
            block.ids.push(element[0]);
            block.at.push(begun);
            block.nodes.extend_from_slice(&element[1..]);
            named.push(element[0]);
            element.clear();
        }
    }
    if !element.is_empty() {
        return Err(lines.error(begun, format!("an element {name} with {} of its {n} nodes", element.len() - 1)));
    }
    if elements::remark(&name).is_some() {
        deck.remarks.elements.entry(name).or_insert((at, 0)).1 += block.ids.len();
    }
    let part = part(deck, inside);
    if let Some(name) = keyword.title("ELSET") {
        part.element_sets.entry(name).or_default().chunks.push(named);
    }
    if !matches!(kind, ElementType::Line(_)) {
        part.blocks.push(block);
    }
    Ok(())
}

fn set(lines: &mut DeckLines, at: Place, keyword: &Keyword, part: &mut DeckPart) -> Result<()> {
    let name = title(lines, at, keyword, &keyword.name)?;
    let generate = keyword.has("GENERATE");
    let mut chunk = Chunk::new(at, keyword.title("INSTANCE"));
    if keyword.name == "NSET" && keyword.has("ELSET") {
        chunk.nodes_of = Some(title(lines, at, keyword, "ELSET")?);
    }
    while lines.data()? {
        let text = lines.text();
        if chunk.nodes_of.is_some() {
            let text = format!("found {}; expected no data below *NSET with ELSET", quote(text));
            return Err(lines.wrong(text));
        }
        if generate {
            let values: Vec<Option<u32>> = text.trim_end_matches(',').split(',').map(|f| whole(Some(f))).collect();
            let [Some(first), Some(last), step] = [0, 1, 2].map(|i| values.get(i).copied().unwrap_or(Some(1))) else {
                return Err(lines.wrong(format!("found {}; expected first, last and step of numbers", quote(text))));
            };
            let Some(step) = step.filter(|&s| s > 0 && first <= last && values.len() <= 3 && values.len() >= 2) else {
                return Err(lines
                    .wrong(format!("found {}; expected first, last (not below it) and a step above 0", quote(text))));
            };
            chunk.generated.push([first, last, step]);
            continue;
        }
        for field in fields(text).map(str::trim).filter(|f| !f.is_empty()) {
            match whole(Some(field)) {
                Some(id) => chunk.push(id),
                None => chunk.names.push(field.trim_matches('"').to_lowercase()),
            }
        }
    }
    let sets = if keyword.name == "NSET" { &mut part.node_sets } else { &mut part.element_sets };
    sets.entry(name).or_insert_with(Set::default).chunks.push(chunk);
    Ok(())
}

fn surface(lines: &mut DeckLines, at: Place, keyword: &Keyword, part: &mut DeckPart) -> Result<()> {
    let name = title(lines, at, keyword, "NAME")?;
    let kind = keyword.title("TYPE").unwrap_or_else(|| "element".into());
    let nodes = match kind.as_str() {
        "element" => false,
        "node" => true,
        other => {
            return Err(lines.error(at, format!("a surface of the type {}; expected ELEMENT or NODE", quote(other))))
        }
    };
    let mut members = Vec::new();
    while lines.data()? {
        let text = lines.text();
        let mut fields = fields(text).map(str::trim);
        let member = fields.next().unwrap_or_default().trim_matches('"').to_lowercase();
        let label = fields.next().filter(|l| !l.is_empty() && !nodes).map(str::to_uppercase);
        // Surface elements have two sides, and are one facet here.
        let label = label.filter(|l| l != "SPOS" && l != "SNEG");
        let face = label
            .as_deref()
            .map(|l| l.strip_prefix('S').and_then(|n| n.parse::<u8>().ok()).filter(|n| (1..=6).contains(n)));
        if member.is_empty() || face == Some(None) {
            return Err(lines.wrong(format!(
                "found {}; expected an element or a set, and S1 to S6 for a face of solid elements",
                quote(text)
            )));
        }
        members.push((member, face.flatten().map(|n| n - 1), lines.place()));
    }
    match part.surfaces.entry(name) {
        std::collections::btree_map::Entry::Occupied(there) => {
            Err(lines.error(at, format!("a second surface {}; expected different names", quote(there.key()))))
        }
        std::collections::btree_map::Entry::Vacant(free) => {
            free.insert(DeckSurface { nodes, members });
            Ok(())
        }
    }
}

/// A whole number above 0 and below 2³²; the manual has at most 999 999 999.
fn whole(field: Option<&str>) -> Option<u32> {
    field?.trim().parse().ok().filter(|&n| n > 0)
}

/// A finite number, with the exponent of Fortran too; a field that is empty is 0.
fn real(field: &str) -> Option<f64> {
    let text = field.trim();
    if text.is_empty() {
        return Some(0.0);
    }
    let value = text.parse().ok().or_else(|| text.replace(['d', 'D'], "e").parse().ok());
    value.filter(|v: &f64| v.is_finite())
}

/// Numbers of the last line into `values`; those that are not there are 0.
fn reals(lines: &DeckLines, values: &mut [f64]) -> Result<()> {
    let wrong =
        || -> Error { lines.wrong(format!("found {}; expected {} numbers", quote(lines.text()), values.len())) };
    let found: Vec<f64> =
        lines.text().trim_end_matches(',').split(',').map(real).collect::<Option<_>>().ok_or_else(wrong)?;
    if found.len() > values.len() {
        return Err(wrong());
    }
    values.iter_mut().zip(found).for_each(|(to, from)| *to = from);
    Ok(())
}

/// The beginning of a text, for messages.
pub fn quote(text: &str) -> String {
    format!("{:?}", text.chars().take(60).collect::<String>())
}
