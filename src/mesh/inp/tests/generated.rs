//! A thousand decks with parts, instances, sets, surfaces and abbreviations, beside a small reader of the manual's
//! rules that knows nothing of the other one.

use super::of;
use crate::mesh::Facet;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

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

    /// A word as it may be written: in any case.
    fn cased(&mut self, word: &str) -> String {
        match self.below(3) {
            0 => word.to_lowercase(),
            1 => word.to_uppercase(),
            _ => word.to_owned(),
        }
    }

    /// A parameter in any case, sometimes abbreviated to `least` letters or more.
    fn short(&mut self, word: &str, least: usize) -> String {
        let letters = if self.below(2) == 0 { word.len() } else { least + self.below(word.len() - least + 1) };
        self.cased(&word[..letters])
    }
}

/// Names that sets of parts and of the assembly share.
const NAMES: [&str; 4] = ["Set-1", "Foot", "\"Two, words\"", "End.a"];

/// Nodes and elements of a block of hexahedra, with gaps between its numbers.
struct Block {
    /// Cells along x, y, z.
    cells: [usize; 3],
    step: usize,
}

impl Block {
    fn node(&self, [i, j, k]: [usize; 3]) -> usize {
        let [nx, ny, _] = self.cells.map(|n| n + 1);
        1 + self.step * (i + nx * (j + ny * k))
    }

    fn nodes(&self) -> usize {
        self.cells.iter().map(|n| n + 1).product()
    }

    fn elements(&self) -> usize {
        self.cells.iter().product()
    }

    fn write(&self, dice: &mut Dice, text: &mut String) {
        let [nx, ny, nz] = self.cells;
        writeln!(text, "*{}, {}=All", dice.cased("NODE"), dice.short("NSET", 1)).unwrap();
        for k in 0..=nz {
            for j in 0..=ny {
                for i in 0..=nx {
                    let z = dice.one_of(&["", ".0", "e0", "D+0"]);
                    writeln!(text, "{}, {i}., {j}.0, {k}{z}", self.node([i, j, k])).unwrap();
                }
            }
        }
        let (kind, set) = (dice.one_of(&["C3D8I", "c3d8r", "C3D8RH"]), dice.short("ELSET", 1));
        writeln!(text, "*{}, {}={kind},\n{set}=Whole", dice.cased("ELEMENT"), dice.short("TYPE", 1)).unwrap();
        let mut number = 0;
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    number += 1;
                    let ring =
                        |k: usize| [[i, j, k], [i + 1, j, k], [i + 1, j + 1, k], [i, j + 1, k]].map(|p| self.node(p));
                    let all: Vec<String> = ring(k).into_iter().chain(ring(k + 1)).map(|n| n.to_string()).collect();
                    let cut = dice.below(8);
                    let (a, b) = (all[..cut].join(", "), all[cut..].join(","));
                    let comma = if cut == 0 { "" } else { ", " };
                    writeln!(text, "{}{comma}{a},\n {b}", number * self.step).unwrap();
                }
            }
        }
        if dice.below(3) == 0 {
            text.push_str("** a comment, NSET=Foot\n");
        }
    }

    /// A set of nodes: of a face of the block, of some nodes, or generated.
    fn set(&self, dice: &mut Dice, parameters: &str, text: &mut String) {
        let name = NAMES[dice.below(NAMES.len())];
        let generate = dice.below(2) == 0;
        let word = if generate { format!(", {}", dice.short("GENERATE", 1)) } else { String::new() };
        writeln!(text, "*{}, {}={}{parameters}{word}", dice.cased("NSET"), dice.short("NSET", 1), dice.cased(name))
            .unwrap();
        let [nx, ny, nz] = self.cells.map(|n| n + 1);
        if generate {
            let layer = nx * ny;
            let first = 1 + self.step * layer * dice.below(nz);
            writeln!(text, "{first}, {}, {}", first + self.step * (layer - 1), self.step).unwrap();
        } else {
            let side = [0, nx - 1][dice.below(2)];
            for k in 0..nz {
                let row: Vec<String> = (0..ny).map(|j| self.node([side, j, k]).to_string()).collect();
                writeln!(text, "{}{}", row.join(", "), dice.one_of(&["", ","])).unwrap();
            }
        }
    }

    /// A surface of faces of all elements or of one, in the scope with `prefix`.
    fn surface(&self, dice: &mut Dice, prefix: &str, number: usize, text: &mut String) {
        let kind = if dice.below(2) == 0 { String::new() } else { format!(", {}=ELEMENT", dice.short("TYPE", 1)) };
        writeln!(text, "*SURFACE{kind}, {}=Surf-{number}", dice.short("NAME", 1)).unwrap();
        for _ in 0..1 + dice.below(2) {
            let member = match dice.below(2) {
                0 => dice.cased("Whole"),
                _ => (self.step * (1 + dice.below(self.elements()))).to_string(),
            };
            writeln!(text, "{prefix}{member}, S{}", 1 + dice.below(6)).unwrap();
        }
    }
}

/// A deck: flat, with a part and its instance, or with the mesh in the instance.
fn deck(dice: &mut Dice) -> String {
    let block = Block { cells: [1, 1, 1].map(|n| n + dice.below(2)), step: 1 + dice.below(3) };
    let mut text = String::from("*Heading\n made\n");
    let inside = |dice: &mut Dice, text: &mut String| {
        block.write(dice, text);
        for number in 0..dice.below(3) {
            block.set(dice, "", text);
            block.surface(dice, "", number, text);
        }
    };
    let shape = dice.below(3);
    if shape == 0 {
        inside(dice, &mut text);
        return text;
    }
    writeln!(text, "*{}, {}=Block", dice.cased("PART"), dice.short("NAME", 1)).unwrap();
    if shape == 1 {
        inside(dice, &mut text);
    }
    writeln!(text, "*{}\n*Part, Name=Empty\n*End Part", dice.cased("END PART")).unwrap();
    writeln!(text, "*Assembly, name=A\n*Instance, {}=B-1, {}=Block", dice.short("NAME", 1), dice.short("PART", 1))
        .unwrap();
    if dice.below(2) == 0 {
        writeln!(text, "{}, -1.5, {}.", dice.below(5), dice.below(3)).unwrap();
        if dice.below(2) == 0 {
            let axis = [[1, 0, 0], [0, 1, 0], [0, 0, 1]][dice.below(3)];
            let angle = [90, -90, 180, 30][dice.below(4)];
            writeln!(text, "1., 2., 0., {}, {}, {}, {angle}.", 1 + axis[0], 2 + axis[1], axis[2]).unwrap();
        }
    }
    if shape == 2 {
        inside(dice, &mut text);
    }
    writeln!(text, "*End Instance\n*Instance, name=E-1, part=Empty\n*Node\n1, 9., 9., 9.\n*End Instance").unwrap();
    for number in 0..dice.below(3) {
        let parameters = format!(", {}=B-1{}", dice.short("INSTANCE", 3), dice.one_of(&["", ", internal"]));
        block.set(dice, &parameters, &mut text);
        let prefix = format!("{}.", dice.cased("B-1"));
        block.surface(dice, &prefix, number, &mut text);
    }
    text.push_str("*End Assembly\n*Step, name=S\n*Nset, nset=Foot, bad=1\n99\n*End Step\n");
    assert!(block.nodes() <= 27);
    text
}

/// A deck by the small reader: coordinates by instance and number, elements, and faces by scope and name.
#[derive(Default)]
struct Told {
    nodes: Vec<((String, u32), [f64; 3])>,
    elements: Vec<((String, u32), Vec<u32>)>,
    sets: BTreeMap<(String, String), BTreeSet<(String, u32)>>,
    surfaces: BTreeMap<(String, String), Vec<(String, u8)>>,
}

/// The manual's rules: a keyword line goes on behind a comma; names have no case; a parameter is the one that begins
/// so; an instance is moved first, then turned about the axis through two points by an angle in degrees.
fn told(text: &str) -> Told {
    let mut told = Told::default();
    let mut lines: Vec<String> = Vec::new();
    for line in text.lines().filter(|l| !l.starts_with("**")) {
        match lines.last_mut() {
            Some(last) if last.starts_with('*') && last.ends_with(',') => last.push_str(line),
            _ => lines.push(line.trim().to_lowercase()),
        }
    }
    let split = |line: &str| -> Vec<String> {
        let mut fields = vec![String::new()];
        let mut quoted = false;
        for c in line.chars() {
            match c {
                '"' => quoted = !quoted,
                ',' if !quoted => fields.push(String::new()),
                c => fields.last_mut().unwrap().push(c),
            }
        }
        fields.into_iter().map(|f| f.trim().to_owned()).filter(|f| !f.is_empty()).collect()
    };
    let number = |f: &String| f.replace('d', "e").parse::<f64>().unwrap_or(0.0);
    let (mut scope, mut i) = (String::new(), 0);
    let has_parts = text.to_lowercase().contains("*part");
    // The place of an instance by its part, as parts come first.
    let mut places: BTreeMap<String, (String, Vec<Vec<f64>>)> = BTreeMap::new();
    while i < lines.len() {
        let fields = split(&lines[i]);
        let end = (i + 1..lines.len()).find(|&k| lines[k].starts_with('*')).unwrap_or(lines.len());
        let data: Vec<Vec<String>> = lines[i + 1..end].iter().map(|l| split(l)).collect();
        i = end;
        let value = |word: &str| {
            let found = fields[1..].iter().find(|f| word.starts_with(f.split('=').next().unwrap().trim()));
            found.map(|f| f.split_once('=').map_or(String::new(), |p| p.1.trim().to_owned()))
        };
        match fields[0].replace(' ', "").as_str() {
            "*part" => scope = value("name").unwrap(),
            "*instance" => {
                scope = value("name").unwrap();
                let rows = data.iter().map(|r| r.iter().map(number).collect()).collect();
                places.insert(value("part").unwrap(), (scope.clone(), rows));
            }
            "*endpart" | "*endinstance" => scope.clear(),
            "*step" => break,
            "*node" => {
                for row in &data {
                    let mut x = [1, 2, 3].map(|c| row.get(c).map_or(0.0, number));
                    x.iter_mut().for_each(|v| *v += 0.0);
                    let key = (scope.clone(), row[0].parse().unwrap());
                    if let Some(set) = value("nset") {
                        told.sets.entry((scope.clone(), set)).or_default().insert(key.clone());
                    }
                    told.nodes.push((key, x));
                }
            }
            "*element" => {
                let all: Vec<u32> = data.iter().flatten().map(|f| f.parse().unwrap()).collect();
                for row in all.chunks(9) {
                    told.elements.push(((scope.clone(), row[0]), row[1..].to_vec()));
                }
            }
            "*nset" => {
                let inside = value("instance").filter(|v| !v.is_empty()).unwrap_or_else(|| scope.clone());
                let generate = fields[1..].iter().any(|f| !f.contains('=') && "generate".starts_with(f.as_str()));
                let set = told.sets.entry((scope.clone(), value("nset").unwrap())).or_default();
                for row in &data {
                    let row: Vec<u32> = row.iter().map(|f| f.parse().unwrap()).collect();
                    match generate {
                        true => set.extend((row[0]..=row[1]).step_by(row[2] as usize).map(|n| (inside.clone(), n))),
                        false => set.extend(row.into_iter().map(|n| (inside.clone(), n))),
                    }
                }
            }
            "*surface" => {
                let rows = data.iter().map(|r| (r[0].clone(), r[1][1..].parse::<u8>().unwrap() - 1));
                told.surfaces.insert((scope.clone(), value("name").unwrap()), rows.collect());
            }
            _ => {}
        }
    }
    if has_parts {
        told.place(&places);
    }
    told
}

impl Told {
    /// Parts under the names of their instances, and these in their places.
    fn place(&mut self, places: &BTreeMap<String, (String, Vec<Vec<f64>>)>) {
        let named = |scope: &mut String| {
            if let Some((name, _)) = places.get(scope) {
                scope.clone_from(name);
            }
        };
        let moved = |x: [f64; 3], rows: &[Vec<f64>]| {
            let shift = rows.first().cloned().unwrap_or_default();
            let x = [0, 1, 2].map(|c| x[c] + shift.get(c).copied().unwrap_or_default());
            let Some(turn) = rows.get(1) else { return x };
            // Rodrigues' formula about the axis from a to b.
            let a = [0, 1, 2].map(|c| turn[c]);
            let axis = [0, 1, 2].map(|c| turn[c + 3] - turn[c]);
            let length = axis.iter().map(|v| v * v).sum::<f64>().sqrt();
            let e = axis.map(|v| v / length);
            let r = [0, 1, 2].map(|c| x[c] - a[c]);
            let cross = [e[1] * r[2] - e[2] * r[1], e[2] * r[0] - e[0] * r[2], e[0] * r[1] - e[1] * r[0]];
            let along: f64 = (0..3).map(|c| e[c] * r[c]).sum();
            let (s, k) = turn[6].to_radians().sin_cos();
            [0, 1, 2].map(|c| a[c] + r[c] * k + cross[c] * s + e[c] * along * (1.0 - k))
        };
        for ((scope, _), x) in &mut self.nodes {
            named(scope);
            let rows = places.values().find(|p| p.0 == *scope).map(|p| p.1.as_slice());
            *x = moved(*x, rows.unwrap_or_default());
        }
        self.elements.iter_mut().for_each(|((scope, _), _)| named(scope));
        let rename = |scope: &String| {
            let mut scope = scope.clone();
            named(&mut scope);
            scope
        };
        let sets = std::mem::take(&mut self.sets).into_iter();
        for ((scope, name), members) in sets {
            let members = members.into_iter().map(|(s, n)| (rename(&s), n));
            self.sets.entry((rename(&scope), name)).or_default().extend(members);
        }
        self.surfaces =
            std::mem::take(&mut self.surfaces).into_iter().map(|((s, n), rows)| ((rename(&s), n), rows)).collect();
    }

    /// Faces by the full names of their groups, those of surfaces over those of sets.
    fn groups(&self) -> BTreeMap<(String, String), BTreeSet<(usize, u8)>> {
        // Nodes of the faces S1 to S6, from 0.
        const FACES: [[usize; 4]; 6] =
            [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]];
        let corners = |e: usize, f: usize| {
            let ((scope, _), nodes) = &self.elements[e];
            FACES[f].iter().map(|&c| (scope.clone(), nodes[c])).collect::<BTreeSet<_>>()
        };
        let all: Vec<(usize, usize)> = (0..self.elements.len()).flat_map(|e| (0..6).map(move |f| (e, f))).collect();
        let boundary: Vec<(usize, usize)> = all
            .iter()
            .copied()
            .filter(|&(e, f)| all.iter().filter(|&&(d, g)| corners(d, g) == corners(e, f)).count() == 1)
            .collect();
        let mut groups: BTreeMap<(String, String), BTreeSet<(usize, u8)>> = BTreeMap::new();
        for (key, rows) in &self.surfaces {
            let faces = groups.entry(key.clone()).or_default();
            for (member, face) in rows {
                let (scope, what) = match member.split_once('.') {
                    Some((scope, what)) => (scope.to_owned(), what),
                    None => (key.0.clone(), member.as_str()),
                };
                let hits = self
                    .elements
                    .iter()
                    .enumerate()
                    .filter(|(_, ((s, id), _))| *s == scope && (what == "whole" || what.parse() == Ok(*id)));
                faces.extend(hits.map(|(e, _)| (e, *face)));
            }
        }
        for (key, nodes) in &self.sets {
            let faces: BTreeSet<(usize, u8)> =
                boundary.iter().filter(|&&(e, f)| corners(e, f).is_subset(nodes)).map(|&(e, f)| (e, f as u8)).collect();
            let used: usize = self.nodes.iter().filter(|(k, _)| k.0 != "e-1" && nodes.contains(k)).count();
            let solid = self.nodes.iter().filter(|(k, _)| k.0 != "e-1").count();
            if !faces.is_empty() && used < solid && !groups.contains_key(key) {
                groups.insert(key.clone(), faces);
            }
        }
        groups
    }
}

#[test]
fn a_thousand_decks_mean_what_the_manual_says() {
    let mut dice = Dice(7);
    let (mut parts, mut ambiguous, mut compared) = (0, 0, 0);
    for round in 0..1000 {
        let text = deck(&mut dice);
        let (mesh, _) = of(&text).unwrap_or_else(|e| panic!("round {round}: {e}\n{text}"));
        let told = told(&text);
        let expected: Vec<&[f64; 3]> = told.nodes.iter().filter(|n| n.0 .0 != "e-1").map(|n| &n.1).collect();
        let near = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(p, q)| (p - q).abs() < 1e-12);
        assert!(
            mesh.nodes.len() == expected.len() && mesh.nodes.iter().zip(expected).all(|(a, b)| near(a, b)),
            "{text}"
        );
        let has_parts = text.to_lowercase().contains("*part");
        parts += usize::from(has_parts);
        let groups = told.groups();
        for ((scope, name), faces) in &groups {
            let same: Vec<_> = groups.iter().filter(|(k, _)| k.1 == *name).collect();
            let unique = same.iter().all(|(_, f)| *f == faces);
            let full = match (has_parts, scope.as_str()) {
                (false, _) => name.clone(),
                (true, "") => format!("assembly.{name}"),
                (true, scope) => format!("{scope}.{name}"),
            };
            let mut named = mesh.clone();
            named.add_aliases(std::iter::once(&full));
            let found = |name: &str| -> BTreeSet<(usize, u8)> {
                let facets = named.groups.get(name).into_iter().flatten();
                facets.map(|f: &Facet| (f.cell as usize, f.face)).collect()
            };
            assert_eq!(found(&full), *faces, "round {round}, {full}:\n{text}");
            compared += 1;
            match unique {
                true => assert_eq!(found(name), *faces, "round {round}, {name}:\n{text}"),
                false => {
                    ambiguous += 1;
                    assert!(named.require_group(name, "the mesh").is_err(), "round {round}, {name}:\n{text}");
                }
            }
        }
        let names: BTreeSet<&String> = groups.keys().map(|k| &k.1).collect();
        assert!(mesh.groups.len() >= names.len() && mesh.groups.len() <= groups.len(), "round {round}:\n{text}");
    }
    assert!(parts > 500 && ambiguous > 100 && compared > 1500, "{parts} {ambiguous} {compared}");
}
